//! A workbook from its parts, so that mutations reach what is inside the container.
//!
//! The text is cut at lines `=== NAME`; each piece becomes a file of that name in a ZIP archive, stored as it is.

use std::io::{Cursor, Write};

use zip::write::SimpleFileOptions;
use zip::{CompressionMethod, ZipWriter};

/// The bytes of the workbook; the text itself where it has no parts.
pub fn of(parts: &[u8]) -> Vec<u8> {
    let mut archive = ZipWriter::new(Cursor::new(Vec::new()));
    let stored = SimpleFileOptions::default().compression_method(CompressionMethod::Stored);
    let mut open = false;
    for line in parts.split_inclusive(|byte| *byte == b'\n') {
        if let Some(name) = line.strip_prefix(b"=== ") {
            let name = String::from_utf8_lossy(name.trim_ascii()).into_owned();
            open = archive.start_file(name, stored).is_ok();
        } else if open {
            open = archive.write_all(line).is_ok();
        }
    }
    archive.finish().map_or_else(|_| parts.to_vec(), Cursor::into_inner)
}
