//! Tests of `visual`: recordings are read back from the bytes of the file.

#![cfg(feature = "visual")]

mod colour;
mod measured;
mod path;
mod read;

use read::Read;
use truegrind::visual::recording::{Recording, VIEWER, VisualError};

#[test]
fn an_address_that_is_none_is_named() {
    let empty = path::recording(&path::scene_parts());
    let error = empty.connect("not an address").unwrap_err();
    assert!(matches!(&error, VisualError::Address { url, .. } if url == "not an address"), "{error}");
    assert!(error.to_string().contains(VIEWER), "{error}");
}

/// Two recordings made apart are the same file; another title is another recording.
#[test]
fn same_input_same_bytes() {
    let parts = path::scene_parts();
    let (first, second) = (path::recording(&parts).rrd().unwrap(), path::recording(&parts).rrd().unwrap());
    assert_eq!(first, second);
    let other = path::titled(&parts, "another").rrd().unwrap();
    assert_ne!(Read::of(&first).name, Read::of(&other).name);
}

#[test]
fn a_recording_holds_content_then_page_then_the_order_to_show_it() {
    let recording: Recording = path::recording(&path::scene_parts());
    let read = Read::of(&recording.rrd().unwrap());
    assert_eq!(read.stores, ["recording", "blueprint"]);
    assert!(read.activated, "the page opens by itself");
    assert!(read.page.iter().any(|c| c.entity_path().to_string() == "/viewport"));
}
