//! Apache Parquet: the table as typed columns, for data frames and data bases.
//!
//! Words are UTF-8 strings, counts 64-bit integers, everything else doubles, with every bit; a column whose cells carry a
//! σ becomes two. An absent cell is null. Uncompressed, PLAIN values behind RLE definition levels, one row group: what
//! every reader understands, and little enough that no library is needed for it.
//!
//! Source: the Parquet format specification (parquet.thrift, Encodings.md) and the Thrift compact protocol.
//! Departures: no statistics, no dictionary, no compression.
//! Checked against: an own reader in the tests, and files opened with pyarrow.

use crate::table::{Cell, Table};

const MAGIC: &[u8; 4] = b"PAR1";

/// Rows of one page.
const PAGE_ROWS: usize = 65_536;

/// Physical types.
#[derive(Clone, Copy, PartialEq)]
enum Physical {
    Int64 = 2,
    Double = 5,
    Bytes = 6,
}

/// One column of the file: its name, its type and where its cells come from.
struct Leaf {
    key: String,
    physical: Physical,
    column: usize,
    sigma: bool,
}

/// The table as a Parquet file.
pub fn table(table: &Table) -> Vec<u8> {
    let leaves = leaves(table);
    let rows = table.rows.len();
    let mut out = MAGIC.to_vec();
    let mut chunks = Vec::with_capacity(leaves.len());
    for leaf in leaves.iter().filter(|_| rows > 0) {
        let begin = out.len();
        for first in (0..rows).step_by(PAGE_ROWS) {
            page(&mut out, table, leaf, first..(first + PAGE_ROWS).min(rows));
        }
        chunks.push(begin..out.len());
    }
    let footer = out.len();
    file_metadata(&mut out, &leaves, &chunks, rows);
    let length = (out.len() - footer) as u32;
    out.extend_from_slice(&length.to_le_bytes());
    out.extend_from_slice(MAGIC);
    out
}

fn leaves(table: &Table) -> Vec<Leaf> {
    let mut leaves = Vec::new();
    for (column, field) in table.fields().into_iter().enumerate() {
        let cells = || (0..table.rows.len()).map(|row| table.cell(row, column));
        let physical = if cells().any(|cell| matches!(cell, Cell::Text(_) | Cell::Judged(..))) {
            Physical::Bytes
        } else if cells().any(|cell| matches!(cell, Cell::Number(_) | Cell::WithSigma { .. })) {
            Physical::Double
        } else if cells().any(|cell| matches!(cell, Cell::Count(_))) {
            Physical::Int64
        } else {
            // Nothing stands in it: what the column is for says what it would be.
            match table.columns[column].alignment {
                crate::table::Alignment::Left => Physical::Bytes,
                crate::table::Alignment::Right => Physical::Double,
            }
        };
        leaves.push(Leaf { key: field.key, physical, column, sigma: false });
        if let Some(key) = field.sigma_key {
            leaves.push(Leaf { key, physical: Physical::Double, column, sigma: true });
        }
    }
    leaves
}

/// Appends the value of a cell in PLAIN encoding; false where there is none.
fn plain(out: &mut Vec<u8>, cell: &Cell, leaf: &Leaf) -> bool {
    let text = |out: &mut Vec<u8>, text: &str| {
        out.extend_from_slice(&(text.len() as u32).to_le_bytes());
        out.extend_from_slice(text.as_bytes());
        true
    };
    let double = |out: &mut Vec<u8>, value: f64| {
        if !value.is_nan() {
            out.extend_from_slice(&value.to_le_bytes());
        }
        !value.is_nan()
    };
    match (leaf.physical, cell) {
        (_, Cell::Missing) => false,
        (_, Cell::WithSigma { sigma, .. }) if leaf.sigma => double(out, *sigma),
        _ if leaf.sigma => false,
        (Physical::Bytes, Cell::Text(value)) => text(out, value),
        (Physical::Bytes, Cell::Judged(status, value)) if value.is_empty() => text(out, status.word()),
        (Physical::Bytes, Cell::Judged(_, value)) => text(out, value),
        (Physical::Bytes, Cell::Count(count)) => text(out, &count.to_string()),
        (Physical::Bytes, Cell::Number(value) | Cell::WithSigma { value, .. }) => {
            !value.is_nan() && text(out, &crate::number::exact(*value))
        }
        (Physical::Double, Cell::Number(value) | Cell::WithSigma { value, .. }) => double(out, *value),
        (Physical::Double, Cell::Count(count)) => double(out, *count as f64),
        (Physical::Int64, Cell::Count(count)) => {
            out.extend_from_slice(&i64::try_from(*count).unwrap_or(i64::MAX).to_le_bytes());
            true
        }
        // The type was chosen so that every other cell fits.
        _ => false,
    }
}

fn page(out: &mut Vec<u8>, table: &Table, leaf: &Leaf, rows: std::ops::Range<usize>) {
    let mut values = Vec::new();
    // Runs of cells that are there (1) or not (0).
    let mut levels = Vec::new();
    let mut run: Option<(bool, u64)> = None;
    let count = rows.len();
    for row in rows {
        let there = plain(&mut values, table.cell(row, leaf.column), leaf);
        match &mut run {
            Some((state, length)) if *state == there => *length += 1,
            _ => {
                flush(&mut levels, run);
                run = Some((there, 1));
            }
        }
    }
    flush(&mut levels, run);
    let size = (4 + levels.len() + values.len()) as i64;
    let mut header = Compact::default();
    header.int(1, I32, 0);
    header.int(2, I32, size);
    header.int(3, I32, size);
    header.open(5);
    header.int(1, I32, count as i64);
    header.int(2, I32, 0);
    header.int(3, I32, 3);
    header.int(4, I32, 3);
    header.close();
    header.close();
    out.extend_from_slice(&header.bytes);
    out.extend_from_slice(&(levels.len() as u32).to_le_bytes());
    out.extend_from_slice(&levels);
    out.extend_from_slice(&values);
}

/// An RLE run of definition levels.
fn flush(levels: &mut Vec<u8>, run: Option<(bool, u64)>) {
    if let Some((there, length)) = run {
        varint(levels, length << 1);
        levels.push(u8::from(there));
    }
}

fn file_metadata(out: &mut Vec<u8>, leaves: &[Leaf], chunks: &[std::ops::Range<usize>], rows: usize) {
    let mut file = Compact::default();
    file.int(1, I32, 1);
    file.list(2, STRUCT, leaves.len() + 1);
    file.element();
    file.text(4, "table");
    file.int(5, I32, leaves.len() as i64);
    file.close();
    for leaf in leaves {
        file.element();
        file.int(1, I32, leaf.physical as i64);
        file.int(3, I32, 1);
        file.text(4, &leaf.key);
        if leaf.physical == Physical::Bytes {
            // UTF8.
            file.int(6, I32, 0);
        }
        file.close();
    }
    file.int(3, I64, rows as i64);
    file.list(4, STRUCT, usize::from(!chunks.is_empty()));
    if !chunks.is_empty() {
        file.element();
        file.list(1, STRUCT, chunks.len());
        for (leaf, chunk) in leaves.iter().zip(chunks) {
            file.element();
            file.int(2, I64, chunk.start as i64);
            file.open(3);
            file.int(1, I32, leaf.physical as i64);
            // PLAIN, RLE.
            file.list(2, I32, 2);
            file.bare(0);
            file.bare(3);
            file.list(3, BINARY, 1);
            file.bare_text(&leaf.key);
            file.int(4, I32, 0);
            file.int(5, I64, rows as i64);
            file.int(6, I64, chunk.len() as i64);
            file.int(7, I64, chunk.len() as i64);
            file.int(9, I64, chunk.start as i64);
            file.close();
            file.close();
        }
        file.int(2, I64, chunks.iter().map(|chunk| chunk.len() as i64).sum());
        file.int(3, I64, rows as i64);
        file.close();
    }
    file.text(6, concat!("truegrind ", env!("CARGO_PKG_VERSION")));
    file.close();
    out.extend_from_slice(&file.bytes);
}

// ---- Thrift compact protocol ----

const I32: u8 = 5;
const I64: u8 = 6;
const BINARY: u8 = 8;
const LIST: u8 = 9;
const STRUCT: u8 = 12;

/// A struct being written, with the last field number of each struct that is open.
struct Compact {
    bytes: Vec<u8>,
    last: Vec<u8>,
}

impl Default for Compact {
    fn default() -> Self {
        Compact { bytes: Vec::new(), last: vec![0] }
    }
}

impl Compact {
    /// Fields come in rising order, never more than 15 apart.
    fn field(&mut self, id: u8, kind: u8) {
        if let Some(last) = self.last.last_mut() {
            self.bytes.push((id - *last) << 4 | kind);
            *last = id;
        }
    }

    fn int(&mut self, id: u8, kind: u8, value: i64) {
        self.field(id, kind);
        self.bare(value);
    }

    /// A number without a field, as in a list.
    fn bare(&mut self, value: i64) {
        varint(&mut self.bytes, (value << 1 ^ value >> 63) as u64);
    }

    fn text(&mut self, id: u8, text: &str) {
        self.field(id, BINARY);
        self.bare_text(text);
    }

    fn bare_text(&mut self, text: &str) {
        varint(&mut self.bytes, text.len() as u64);
        self.bytes.extend_from_slice(text.as_bytes());
    }

    fn list(&mut self, id: u8, kind: u8, length: usize) {
        self.field(id, LIST);
        if length < 15 {
            self.bytes.push((length as u8) << 4 | kind);
        } else {
            self.bytes.push(0xf0 | kind);
            varint(&mut self.bytes, length as u64);
        }
    }

    fn open(&mut self, id: u8) {
        self.field(id, STRUCT);
        self.element();
    }

    /// A struct in a list.
    fn element(&mut self) {
        self.last.push(0);
    }

    fn close(&mut self) {
        self.bytes.push(0);
        self.last.pop();
    }
}

fn varint(out: &mut Vec<u8>, mut value: u64) {
    while value >= 0x80 {
        out.push(value as u8 | 0x80);
        value >>= 7;
    }
    out.push(value as u8);
}
