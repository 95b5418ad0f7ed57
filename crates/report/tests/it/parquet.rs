//! Parquet, read back by a reader of its own that follows the specification of the format.

use std::collections::BTreeMap;

use truegrind_report::format::parquet;
use truegrind_report::status::Status;
use truegrind_report::table::{Cell, Column, Table};

/// A value of the Thrift compact protocol.
#[derive(Debug, Clone, PartialEq)]
enum Thrift {
    Int(i64),
    Text(Vec<u8>),
    List(Vec<Thrift>),
    Struct(BTreeMap<i64, Thrift>),
}

impl Thrift {
    fn int(&self) -> i64 {
        let Thrift::Int(value) = self else { panic!("{self:?}") };
        *value
    }
    fn text(&self) -> String {
        let Thrift::Text(value) = self else { panic!("{self:?}") };
        String::from_utf8(value.clone()).unwrap()
    }
    fn list(&self) -> &[Thrift] {
        let Thrift::List(value) = self else { panic!("{self:?}") };
        value
    }
    fn field(&self, id: i64) -> &Thrift {
        let Thrift::Struct(fields) = self else { panic!("{self:?}") };
        &fields[&id]
    }
}

struct Reader<'b> {
    bytes: &'b [u8],
    at: usize,
}

impl Reader<'_> {
    fn byte(&mut self) -> u8 {
        self.at += 1;
        self.bytes[self.at - 1]
    }
    fn varint(&mut self) -> u64 {
        let (mut value, mut shift) = (0, 0);
        loop {
            let byte = self.byte();
            value |= u64::from(byte & 0x7f) << shift;
            shift += 7;
            if byte & 0x80 == 0 {
                return value;
            }
        }
    }
    fn zigzag(&mut self) -> i64 {
        let value = self.varint();
        (value >> 1) as i64 ^ -((value & 1) as i64)
    }
    fn value(&mut self, kind: u8) -> Thrift {
        match kind {
            1 | 2 => Thrift::Int(i64::from(kind == 1)),
            3 => Thrift::Int(i64::from(self.byte())),
            4..=6 => Thrift::Int(self.zigzag()),
            8 => {
                let length = self.varint() as usize;
                self.at += length;
                Thrift::Text(self.bytes[self.at - length..self.at].to_vec())
            }
            9 => {
                let head = self.byte();
                let length = if head >> 4 == 15 { self.varint() as usize } else { usize::from(head >> 4) };
                Thrift::List((0..length).map(|_| self.value(head & 15)).collect())
            }
            12 => {
                let (mut fields, mut id) = (BTreeMap::new(), 0);
                loop {
                    let head = self.byte();
                    if head == 0 {
                        return Thrift::Struct(fields);
                    }
                    id = if head >> 4 == 0 { self.zigzag() } else { id + i64::from(head >> 4) };
                    fields.insert(id, self.value(head & 15));
                }
            }
            other => panic!("type {other}"),
        }
    }
}

#[derive(Debug, Clone, PartialEq)]
enum Value {
    Null,
    Int(i64),
    Double(u64),
    Text(String),
}

/// Column names and cells by column.
fn read(bytes: &[u8]) -> Vec<(String, Vec<Value>)> {
    assert_eq!((&bytes[..4], &bytes[bytes.len() - 4..]), (&b"PAR1"[..], &b"PAR1"[..]));
    let length = u32::from_le_bytes(bytes[bytes.len() - 8..bytes.len() - 4].try_into().unwrap()) as usize;
    let mut reader = Reader { bytes, at: bytes.len() - 8 - length };
    let footer = reader.value(12);
    assert_eq!(reader.at, bytes.len() - 8);
    let schema = footer.field(2).list();
    assert_eq!(schema[0].field(5).int() as usize, schema.len() - 1);
    let names = schema[1..].iter().map(|leaf| leaf.field(4).text());
    let mut columns: Vec<(String, Vec<Value>)> = names.map(|name| (name, Vec::new())).collect();
    let rows = footer.field(3).int();
    for group in footer.field(4).list() {
        for ((chunk, leaf), column) in group.field(1).list().iter().zip(&schema[1..]).zip(&mut columns) {
            let meta = chunk.field(3);
            assert_eq!(meta.field(3).list()[0].text(), column.0);
            assert_eq!(meta.field(5).int(), rows);
            assert_eq!(leaf.field(1), meta.field(1));
            let begin = meta.field(9).int() as usize;
            let end = begin + meta.field(7).int() as usize;
            let mut reader = Reader { bytes, at: begin };
            while reader.at < end {
                page(&mut reader, leaf.field(1).int(), &mut column.1);
            }
            assert_eq!(reader.at, end);
        }
    }
    assert!(columns.iter().all(|column| column.1.len() as i64 == rows), "{columns:?}");
    columns
}

fn page(reader: &mut Reader<'_>, physical: i64, out: &mut Vec<Value>) {
    let header = reader.value(12);
    let end = reader.at + header.field(3).int() as usize;
    let count = header.field(5).field(1).int() as usize;
    let levels = u32::from_le_bytes(reader.bytes[reader.at..reader.at + 4].try_into().unwrap()) as usize;
    reader.at += 4;
    let until = reader.at + levels;
    let mut there = Vec::new();
    while reader.at < until {
        let run = reader.varint();
        let length = (run >> 1) as usize;
        if run & 1 == 0 {
            let state = reader.byte() == 1;
            there.extend(std::iter::repeat_n(state, length));
        } else {
            // Bits, eight to a byte, the lowest first.
            for _ in 0..length {
                let bits = reader.byte();
                there.extend((0..8).map(|k| bits >> k & 1 == 1));
            }
        }
    }
    there.truncate(count);
    assert_eq!(there.len(), count);
    for there in there {
        let mut take = |count: usize| {
            reader.at += count;
            reader.bytes[reader.at - count..reader.at].to_vec()
        };
        out.push(match (there, physical) {
            (false, _) => Value::Null,
            (_, 2) => Value::Int(i64::from_le_bytes(take(8).try_into().unwrap())),
            (_, 5) => Value::Double(u64::from_le_bytes(take(8).try_into().unwrap())),
            _ => {
                let length = u32::from_le_bytes(take(4).try_into().unwrap()) as usize;
                Value::Text(String::from_utf8(take(length)).unwrap())
            }
        });
    }
    assert_eq!(reader.at, end);
}

fn sample(rows: usize) -> Table {
    let mut table = Table::new(
        "Programs",
        vec![
            Column::text("file", "Program"),
            Column::text("status", "Status"),
            Column::count("motions", "Motions"),
            Column::number("before_mm", "before", "mm", 3),
            Column::number("value_mm", "value", "mm", 3),
            Column::text("note", "Note"),
        ],
    );
    for row in 0..rows {
        let share = row as f64 / 3.0;
        table.push([
            format!("p{row}.mod – „ü“").into(),
            Cell::Judged(Status::Good, "changed".into()),
            Cell::Count(row as u64),
            if row % 3 == 0 { Cell::Missing } else { share.into() },
            Cell::WithSigma { value: -share, sigma: if row == 1 { f64::NAN } else { 0.125 } },
            Cell::Missing,
        ]);
    }
    table
}

#[test]
fn every_bit_comes_back_and_absent_cells_are_null() {
    // More rows than one page holds.
    for rows in [1, 7, 70_000] {
        let columns = read(&parquet::table(&sample(rows)).unwrap());
        let names: Vec<&str> = columns.iter().map(|(name, _)| name.as_str()).collect();
        assert_eq!(names, ["file", "status", "motions", "before_mm", "value_mm", "sigma_mm", "note"]);
        for row in 0..rows {
            let share = row as f64 / 3.0;
            let found: Vec<&Value> = columns.iter().map(|(_, cells)| &cells[row]).collect();
            assert_eq!(*found[0], Value::Text(format!("p{row}.mod – „ü“")));
            assert_eq!(*found[1], Value::Text("changed".into()));
            assert_eq!(*found[2], Value::Int(row as i64));
            let before = if row % 3 == 0 { Value::Null } else { Value::Double(share.to_bits()) };
            assert_eq!(*found[3], before);
            assert_eq!(*found[4], Value::Double((-share).to_bits()));
            let sigma = if row == 1 { Value::Null } else { Value::Double(0.125_f64.to_bits()) };
            assert_eq!(*found[5], sigma);
            assert_eq!(*found[6], Value::Null);
        }
    }
}

#[test]
fn a_table_without_rows_is_a_file_with_columns() {
    let columns = read(&parquet::table(&sample(0)).unwrap());
    assert_eq!(columns.len(), 6);
    assert!(columns.iter().all(|(_, cells)| cells.is_empty()));
}

/// The type of a column is what it is for: a single cell in words ("diverged 3/10" among errors) is absent, and the other
/// cells stay numbers.
#[test]
fn one_cell_in_words_does_not_turn_a_column_of_numbers_into_words() {
    let mut table =
        Table::new("", vec![Column::number("rmse_mm", "RMSE", "mm", 3), Column::count("rows", "Rows")]);
    table.push([0.25.into(), Cell::Count(3)]);
    table.push(["diverged 3/10".into(), 4.0.into()]);
    table.push([Cell::Missing, 4.5.into()]);
    let columns = read(&parquet::table(&table).unwrap());
    assert_eq!(columns[0].1, [Value::Double(0.25_f64.to_bits()), Value::Null, Value::Null]);
    assert_eq!(columns[1].1, [Value::Int(3), Value::Int(4), Value::Null]);
}
