//! Apache Parquet: typed columns for data frames and databases.
//!
//! Text columns are UTF-8 strings, counts 64-bit integers, all others doubles. A column with σ becomes two. A missing cell is null, and
//! so is a cell that does not match the type of its column. One row group, uncompressed, without statistics, for compatibility.
//!
//! Verified by an independent reader in the tests.

use std::sync::Arc;

use parquet::basic::{ConvertedType, Repetition, Type as Physical};
use parquet::column::writer::ColumnWriter;
use parquet::data_type::ByteArray;
use parquet::errors::ParquetError;
use parquet::file::properties::{EnabledStatistics, WriterProperties, WriterVersion};
use parquet::file::writer::SerializedFileWriter;
use parquet::schema::types::Type;

use crate::table::{Cell, ColumnKind, Table};

/// One column of the file.
struct Leaf {
    key: String,
    kind: ColumnKind,
    column: usize,
    sigma: bool,
}

/// The table as a Parquet file.
///
/// # Errors
/// Those of the Parquet writer; no table is known to cause one.
pub fn table(table: &Table) -> Result<Vec<u8>, ParquetError> {
    let leaves = leaves(table);
    let fields = leaves.iter().map(|leaf| field(leaf).map(Arc::new)).collect::<Result<_, _>>()?;
    let schema = Type::group_type_builder("table").with_fields(fields).build()?;
    let properties = WriterProperties::builder()
        .set_writer_version(WriterVersion::PARQUET_1_0)
        .set_dictionary_enabled(false)
        .set_statistics_enabled(EnabledStatistics::None)
        .set_created_by("truegrind".to_owned())
        .build();
    let mut writer = SerializedFileWriter::new(Vec::new(), Arc::new(schema), Arc::new(properties))?;
    if !table.rows.is_empty() {
        let mut group = writer.next_row_group()?;
        for leaf in &leaves {
            let Some(mut column) = group.next_column()? else { break };
            write(column.untyped(), table, leaf)?;
            column.close()?;
        }
        group.close()?;
    }
    writer.into_inner()
}

fn leaves(table: &Table) -> Vec<Leaf> {
    let mut leaves = Vec::new();
    for (column, field) in table.fields().into_iter().enumerate() {
        leaves.push(Leaf { key: field.key, kind: table.columns[column].kind, column, sigma: false });
        if let Some(key) = field.sigma_key {
            leaves.push(Leaf { key, kind: ColumnKind::Number, column, sigma: true });
        }
    }
    leaves
}

fn field(leaf: &Leaf) -> Result<Type, ParquetError> {
    let (physical, logical) = match leaf.kind {
        ColumnKind::Text => (Physical::BYTE_ARRAY, ConvertedType::UTF8),
        ColumnKind::Count => (Physical::INT64, ConvertedType::NONE),
        ColumnKind::Number => (Physical::DOUBLE, ConvertedType::NONE),
    };
    Type::primitive_type_builder(&leaf.key, physical)
        .with_repetition(Repetition::OPTIONAL)
        .with_converted_type(logical)
        .build()
}

fn write(column: &mut ColumnWriter<'_>, table: &Table, leaf: &Leaf) -> Result<(), ParquetError> {
    let cells = (0..table.rows.len()).map(|row| table.cell(row, leaf.column));
    match column {
        ColumnWriter::ByteArrayColumnWriter(column) => {
            let (values, levels) =
                present(cells.map(|cell| text(cell).map(|text| ByteArray::from(text.into_bytes()))));
            column.write_batch(&values, Some(&levels), None)?;
        }
        ColumnWriter::Int64ColumnWriter(column) => {
            let (values, levels) = present(cells.map(count));
            column.write_batch(&values, Some(&levels), None)?;
        }
        ColumnWriter::DoubleColumnWriter(column) => {
            let (values, levels) = present(cells.map(|cell| number(cell, leaf.sigma)));
            column.write_batch(&values, Some(&levels), None)?;
        }
        _ => {}
    }
    Ok(())
}

/// The present values, and their definition levels.
fn present<T>(cells: impl Iterator<Item = Option<T>>) -> (Vec<T>, Vec<i16>) {
    let (mut values, mut levels) = (Vec::new(), Vec::new());
    for cell in cells {
        levels.push(i16::from(cell.is_some()));
        values.extend(cell);
    }
    (values, levels)
}

fn text(cell: &Cell) -> Option<String> {
    match cell {
        Cell::Text(value) => Some(value.clone()),
        Cell::Judged(status, value) if value.is_empty() => Some(status.word().to_owned()),
        Cell::Judged(_, value) => Some(value.clone()),
        Cell::Count(count) => Some(count.to_string()),
        Cell::Number(value) | Cell::Worded { value, .. } | Cell::WithSigma { value, .. } => {
            (!value.is_nan()).then(|| crate::number::exact(*value))
        }
        Cell::Missing => None,
    }
}

fn count(cell: &Cell) -> Option<i64> {
    match cell {
        Cell::Count(count) => i64::try_from(*count).ok(),
        // Doubles above 2⁵³ are not exact integers.
        Cell::Number(value) if value.fract() == 0.0 && value.abs() < 9e15 => Some(*value as i64),
        _ => None,
    }
}

fn number(cell: &Cell, of_sigma: bool) -> Option<f64> {
    let value = match cell {
        Cell::WithSigma { sigma, .. } if of_sigma => *sigma,
        _ if of_sigma => return None,
        Cell::Number(value) | Cell::Worded { value, .. } | Cell::WithSigma { value, .. } => *value,
        Cell::Count(count) => *count as f64,
        _ => return None,
    };
    (!value.is_nan()).then_some(value)
}
