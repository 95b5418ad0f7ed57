//! What an archive unpacks to, counted before anything is read from it.
//!
//! The reader of workbooks unpacks parts whole and believes what they say of themselves, so a file of a few kilobytes could
//! ask for any amount of memory. Here every part is unpacked once and thrown away, in a buffer of fixed size: what counts
//! is what comes out, not what the directory claims.

use std::io::{Cursor, Read};

use zip::ZipArchive;

/// What any workbook may unpack to (bytes).
const FREE_BYTES: u64 = 32 << 20;
/// And for each byte of the file; sheets of numbers shrink to a tenth, rarely to a fiftieth.
const RATIO: u64 = 100;
/// A part that is neither a sheet nor the shared strings: styles, relations, the list of sheets (bytes).
const OTHER_BYTES: u64 = 16 << 20;
/// No shared string takes fewer (bytes): `<si/>`.
const STRING_BYTES: u64 = 5;

/// Why an archive is not read.
#[derive(Debug, Clone, PartialEq)]
pub(super) enum Refusal {
    /// Not a zip archive.
    Broken(String),
    /// It unpacks to too much.
    Large {
        /// What was found.
        found: String,
        /// What would be taken.
        expected: String,
    },
}

/// What was counted.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Unpacked {
    /// Bytes of the largest part.
    pub(super) largest: u64,
    /// What all parts together may have (bytes).
    pub(super) allowed: u64,
}

/// Unpacks every part of the archive once.
pub(super) fn unpacked(bytes: &[u8]) -> Result<Unpacked, Refusal> {
    let allowed = FREE_BYTES + RATIO * bytes.len() as u64;
    let mut archive = ZipArchive::new(Cursor::new(bytes)).map_err(|e| Refusal::Broken(e.to_string()))?;
    let (mut total, mut largest) = (0, 0);
    let mut buffer = vec![0; 1 << 16];
    for index in 0..archive.len() {
        // A part that cannot be unpacked is no load; whether it is needed, its reader will say.
        let Ok(mut part) = archive.by_index(index) else { continue };
        let name = part.name().unwrap_or_default().replace('\\', "/").to_lowercase();
        let strings = name.ends_with("sharedstrings.xml");
        let other = !strings && !name.contains("/worksheets/");
        let (mut size, mut claims) = (0, Claims::default());
        while let Ok(count @ 1..) = part.read(&mut buffer) {
            size += count as u64;
            if strings {
                claims.look(&buffer[..count]);
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
        if claims.largest > size / STRING_BYTES + 1 {
            return Err(Refusal::Large {
                found: format!("a count of {} shared strings in a part of {size} bytes", claims.largest),
                expected: "no more strings than fit".to_owned(),
            });
        }
        total += size;
        largest = largest.max(size);
    }
    Ok(Unpacked { largest, allowed })
}

/// Looks for `uniqueCount = "…"` in a stream of bytes, wherever it stands: memory is set aside for that many strings before
/// the first one is read. Zero bytes are passed over, so that sixteen-bit text is read too.
#[derive(Debug, Default)]
struct Claims {
    /// Characters of the name and its `=` and quote that have been met.
    met: usize,
    number: u64,
    largest: u64,
}

impl Claims {
    const NAME: &'static [u8] = b"uniqueCount";

    fn look(&mut self, bytes: &[u8]) {
        let name = Self::NAME.len();
        for &byte in bytes.iter().filter(|b| **b != 0) {
            self.met = match self.met {
                met if met < name && byte == Self::NAME[met] => met + 1,
                met if met >= name && byte.is_ascii_whitespace() && met < name + 2 => met,
                met if met == name && byte == b'=' => met + 1,
                met if met == name + 1 && matches!(byte, b'"' | b'\'') => {
                    self.number = 0;
                    met + 1
                }
                met if met == name + 2 && byte.is_ascii_digit() => {
                    self.number = self.number.saturating_mul(10).saturating_add(u64::from(byte - b'0'));
                    self.largest = self.largest.max(self.number);
                    met
                }
                _ => usize::from(byte == Self::NAME[0]),
            };
        }
    }
}
