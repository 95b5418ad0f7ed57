//! Tests of `visual`: recordings are read back from the bytes of the file.

// A test that cannot go on panics.
#![allow(clippy::unwrap_used, clippy::print_stderr)]
mod colour;
mod measured;
mod path;
mod read;

use read::Read;
use truegrind_pictures::recording::{Recording, VIEWER, VisualError};

#[test]
fn an_address_that_is_none_is_named() {
    let empty = path::recording(&path::scene_parts());
    let error = empty.connect("not an address").unwrap_err();
    assert!(matches!(&error, VisualError::Address { url, .. } if url == "not an address"), "{error}");
    assert!(error.to_string().contains(VIEWER), "{error}");
}

#[test]
fn a_recording_holds_content_then_page_then_the_order_to_show_it() {
    let recording: Recording = path::recording(&path::scene_parts());
    let read = Read::of(&recording.rrd().unwrap());
    assert_eq!(read.stores, ["recording", "blueprint"]);
    assert!(read.activated, "the page opens by itself");
    assert!(read.page.iter().any(|c| c.entity_path().to_string() == "/viewport"));
}
