//! Text tables with comma, semicolon or tab, in UTF-8, UTF-16 with a byte order mark, or Latin-1.

use std::borrow::Cow;

use ::csv::{ByteRecord, ReaderBuilder};

use super::cell::{Cell, Line, Table, number};
use super::error::{ImportError, Location};

/// A text table, read line by line: all its cells would take several times the memory of its numbers.
pub(super) struct Text<'a> {
    text: Cow<'a, str>,
    delimiter: u8,
}

impl<'a> Text<'a> {
    pub(super) fn of(file: &str, bytes: &'a [u8]) -> Result<Self, ImportError> {
        let text = text(bytes);
        if text.contains('\0') {
            return Err(ImportError::NotATable { location: Location::file(file) });
        }
        let delimiter = delimiter(&text);
        Ok(Self { text, delimiter })
    }

    /// The table without its rows.
    pub(super) fn empty(&self) -> Table {
        let blank_lines = self.text.lines().filter(|l| l.trim().is_empty()).count();
        Table { blank_lines, decimal_comma: self.decimal_comma(), ..Table::default() }
    }

    fn decimal_comma(&self) -> bool {
        self.delimiter != b','
    }

    /// The lines without blank ones.
    pub(super) fn lines(&self, file: &str) -> impl Iterator<Item = Result<Line, ImportError>> {
        let mut reader = ReaderBuilder::new()
            .delimiter(self.delimiter)
            .has_headers(false)
            .flexible(true)
            .from_reader(self.text.as_bytes());
        let mut record = ByteRecord::new();
        let mut lines = LineCounter { bytes: self.text.as_bytes(), byte: 0, line: 1 };
        let decimal_comma = self.decimal_comma();
        std::iter::from_fn(move || match reader.read_byte_record(&mut record) {
            Ok(false) => None,
            Ok(true) => {
                let number = record.position().map_or(0, |p| lines.at(p.byte() as usize));
                let cells =
                    record.iter().map(|field| cell(&String::from_utf8_lossy(field), decimal_comma)).collect();
                Some(Ok(Line { number, cells }))
            }
            Err(error) => {
                Some(Err(ImportError::Format { location: Location::file(file), message: error.to_string() }))
            }
        })
    }
}

/// Line numbers as an editor counts them; the CSV reader does not count the blank lines that it skips.
struct LineCounter<'a> {
    bytes: &'a [u8],
    byte: usize,
    line: usize,
}

impl LineCounter<'_> {
    /// Line of the first character at or after `byte` that is not a line end. Offsets must not decrease.
    fn at(&mut self, byte: usize) -> usize {
        while let Some(&b) = self.bytes.get(self.byte) {
            if self.byte >= byte && b != b'\n' && b != b'\r' {
                break;
            }
            self.line += usize::from(b == b'\n');
            self.byte += 1;
        }
        self.line
    }
}

/// Decodes the text of a file in any encoding that spreadsheets export.
pub(super) fn text(bytes: &[u8]) -> Cow<'_, str> {
    let wide = |from: fn([u8; 2]) -> u16| {
        let units: Vec<u16> = bytes[2..].chunks_exact(2).map(|c| from([c[0], c[1]])).collect();
        Cow::Owned(String::from_utf16_lossy(&units))
    };
    match bytes {
        [0xff, 0xfe, ..] => wide(u16::from_le_bytes),
        [0xfe, 0xff, ..] => wide(u16::from_be_bytes),
        _ => {
            let bytes = bytes.strip_prefix(b"\xef\xbb\xbf").unwrap_or(bytes);
            match std::str::from_utf8(bytes) {
                Ok(text) => Cow::Borrowed(text),
                // Latin-1: every byte is the code point of its character.
                Err(_) => Cow::Owned(bytes.iter().map(|&b| char::from(b)).collect()),
            }
        }
    }
}

/// The most frequent separator in the first nonblank line. A semicolon wins a tie with commas, as in `1,5;2,5`.
fn delimiter(text: &str) -> u8 {
    let line = text.lines().find(|l| !l.trim().is_empty()).unwrap_or("");
    let count = |c: char| line.matches(c).count();
    let (comma, semicolon, tab) = (count(','), count(';'), count('\t'));
    if semicolon > 0 && semicolon >= comma && semicolon >= tab {
        b';'
    } else if tab > comma {
        b'\t'
    } else {
        b','
    }
}

fn cell(field: &str, decimal_comma: bool) -> Cell {
    let field = field.trim();
    if field.is_empty() {
        return Cell::Empty;
    }
    match number(field, decimal_comma) {
        Some(value) => Cell::Number { value, as_text: false },
        None => Cell::Text(field.to_owned()),
    }
}
