//! Measures the unpacked size of an archive before it is read (protection against zip bombs).
//!
//! The workbook reader unpacks whole parts and trusts the sizes that they declare, so a file of a few kilobytes could
//! allocate any amount of memory. Here every part is unpacked once into a buffer of fixed size and discarded: the actual
//! size counts, not the directory's.

use std::io::{Cursor, Read};

use zip::ZipArchive;

/// Unpacked bytes that any workbook is allowed.
const FREE_BYTES: u64 = 32 << 20;
/// Further unpacked bytes allowed for each byte of the file; sheets of numbers shrink to a tenth, rarely to a fiftieth.
const RATIO: u64 = 100;
/// Largest part other than a sheet or the shared strings: styles, relations, the list of sheets (bytes).
const OTHER_BYTES: u64 = 16 << 20;
/// Shortest possible shared string, `<si/>` (bytes).
const STRING_BYTES: u64 = 5;

/// Why an archive is refused.
#[derive(Debug, Clone, PartialEq)]
pub(super) enum Refusal {
    /// Not a zip archive.
    Broken(String),
    /// It exceeds a limit.
    Large {
        /// What was found.
        found: String,
        /// The limit.
        expected: String,
    },
}

/// Unpacked sizes.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Unpacked {
    /// Bytes of the largest part.
    pub(super) largest: u64,
    /// Limit for all parts together (bytes).
    pub(super) allowed: u64,
}

/// Unpacks every part of the archive once and checks the limits.
pub(super) fn measure_unpacked(bytes: &[u8]) -> Result<Unpacked, Refusal> {
    let allowed = FREE_BYTES + RATIO * bytes.len() as u64;
    let mut archive = ZipArchive::new(Cursor::new(bytes)).map_err(|e| Refusal::Broken(e.to_string()))?;
    let (mut total, mut largest) = (0, 0);
    let mut buffer = vec![0; 1 << 16];
    for index in 0..archive.len() {
        // A part that cannot be unpacked takes no memory; if it is needed, the workbook reader reports it.
        let Ok(mut part) = archive.by_index(index) else { continue };
        let name = part.name().unwrap_or_default().replace('\\', "/").to_lowercase();
        let strings = name.ends_with("sharedstrings.xml");
        let other = !strings && !name.contains("/worksheets/");
        let (mut size, mut string_count) = (0, StringCountScanner::default());
        while let Ok(count @ 1..) = part.read(&mut buffer) {
            size += count as u64;
            if strings {
                string_count.scan(&buffer[..count]);
            }
            if total + size > allowed {
                return Err(Refusal::Large {
                    found: format!("parts that unpack to more than {} MB", allowed >> 20),
                    expected: format!(
                        "at most 32 MB and a hundred times the {} bytes of the file",
                        bytes.len()
                    ),
                });
            }
            if other && size > OTHER_BYTES && name.ends_with(".xml") {
                return Err(Refusal::Large {
                    found: format!("the part `{name}` of more than {} MB", OTHER_BYTES >> 20),
                    expected: "as much in sheets and their strings alone".to_owned(),
                });
            }
        }
        if string_count.largest > size / STRING_BYTES + 1 {
            return Err(Refusal::Large {
                found: format!(
                    "a count of {} shared strings in a part of {size} bytes",
                    string_count.largest
                ),
                expected: "no more strings than fit".to_owned(),
            });
        }
        total += size;
        largest = largest.max(size);
    }
    Ok(Unpacked { largest, allowed })
}

/// Scans a byte stream for `uniqueCount = "…"`: the workbook reader allocates memory for that many strings before it reads
/// the first one. Zero bytes are skipped, so that UTF-16 is covered too.
#[derive(Debug, Default)]
struct StringCountScanner {
    /// Characters of the name and its `=` and quote that have matched.
    matched: usize,
    number: u64,
    largest: u64,
}

impl StringCountScanner {
    const NAME: &'static [u8] = b"uniqueCount";

    fn scan(&mut self, bytes: &[u8]) {
        let name = Self::NAME.len();
        for &byte in bytes.iter().filter(|b| **b != 0) {
            self.matched = match self.matched {
                at if at < name && byte == Self::NAME[at] => at + 1,
                at if at >= name && byte.is_ascii_whitespace() && at < name + 2 => at,
                at if at == name && byte == b'=' => at + 1,
                at if at == name + 1 && matches!(byte, b'"' | b'\'') => {
                    self.number = 0;
                    at + 1
                }
                at if at == name + 2 && byte.is_ascii_digit() => {
                    self.number = self.number.saturating_mul(10).saturating_add(u64::from(byte - b'0'));
                    self.largest = self.largest.max(self.number);
                    at
                }
                _ => usize::from(byte == Self::NAME[0]),
            };
        }
    }
}
