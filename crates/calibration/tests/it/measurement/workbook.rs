//! Workbooks, made here as the smallest archive that is one.

use truegrind_calibration::measurement::dataset::{Reading, Sensor};
use truegrind_calibration::measurement::import::{self, Options};

/// A cell of a sheet: nothing, a number, or text.
#[derive(Clone, Copy)]
enum Cell {
    Blank,
    Number(f64),
    Text(&'static str),
}
use Cell::{Blank, Number, Text};

/// An XLSX file of named sheets, the first row of each at `top` (from 1).
fn workbook(sheets: &[(&str, usize, Vec<Vec<Cell>>)]) -> Vec<u8> {
    let bodies: Vec<(&str, String)> = sheets
        .iter()
        .map(|(name, top, rows)| {
            let mut body = String::new();
            for (r, row) in rows.iter().enumerate() {
                body += &format!("<row r=\"{}\">", r + top);
                for (c, cell) in row.iter().enumerate() {
                    let at = format!("{}{}", char::from(b'A' + c as u8), r + top);
                    body += &match cell {
                        Blank => String::new(),
                        Number(v) => format!("<c r=\"{at}\"><v>{v}</v></c>"),
                        Text(t) => format!("<c r=\"{at}\" t=\"inlineStr\"><is><t>{t}</t></is></c>"),
                    };
                }
                body += "</row>";
            }
            (*name, body)
        })
        .collect();
    packed(&bodies, None)
}

/// An XLSX file of sheets with stated rows, and of shared strings as stated.
fn packed(sheets: &[(&str, String)], strings: Option<&str>) -> Vec<u8> {
    const MAIN: &str = "http://schemas.openxmlformats.org/spreadsheetml/2006/main";
    const OFFICE: &str = "http://schemas.openxmlformats.org/officeDocument/2006/relationships";
    const PACKAGE: &str = "http://schemas.openxmlformats.org/package/2006/relationships";
    let (mut list, mut relations, mut files) = (String::new(), String::new(), Vec::new());
    for (i, (name, body)) in sheets.iter().enumerate() {
        list += &format!("<sheet name=\"{name}\" sheetId=\"{0}\" r:id=\"rId{0}\"/>", i + 1);
        relations += &format!(
            "<Relationship Id=\"rId{0}\" Type=\"{OFFICE}/worksheet\" Target=\"worksheets/sheet{0}.xml\"/>",
            i + 1
        );
        files.push((
            format!("xl/worksheets/sheet{}.xml", i + 1),
            format!("<worksheet xmlns=\"{MAIN}\"><sheetData>{body}</sheetData></worksheet>"),
        ));
    }
    files.push((
        "_rels/.rels".into(),
        format!(
            "<Relationships xmlns=\"{PACKAGE}\"><Relationship Id=\"rId1\" Type=\"{OFFICE}/officeDocument\" \
             Target=\"xl/workbook.xml\"/></Relationships>"
        ),
    ));
    files.push((
        "xl/workbook.xml".into(),
        format!("<workbook xmlns=\"{MAIN}\" xmlns:r=\"{OFFICE}\"><sheets>{list}</sheets></workbook>"),
    ));
    files.push((
        "xl/_rels/workbook.xml.rels".into(),
        format!("<Relationships xmlns=\"{PACKAGE}\">{relations}</Relationships>"),
    ));
    if let Some(strings) = strings {
        files.push(("xl/sharedStrings.xml".into(), strings.to_owned()));
    }
    archive(&files)
}

/// A zip archive of files that are stored, not compressed.
fn archive(files: &[(String, String)]) -> Vec<u8> {
    let (mut out, mut directory) = (Vec::new(), Vec::new());
    for (name, text) in files {
        let offset = out.len() as u32;
        let mut entry = Vec::new();
        // Version, flags, method, time, date.
        [20u16, 0, 0, 0, 33].iter().for_each(|v| entry.extend(v.to_le_bytes()));
        [crc32(text.as_bytes()), text.len() as u32, text.len() as u32]
            .iter()
            .for_each(|v| entry.extend(v.to_le_bytes()));
        [name.len() as u16, 0].iter().for_each(|v| entry.extend(v.to_le_bytes()));
        out.extend(b"PK\x03\x04");
        out.extend(&entry);
        out.extend(name.as_bytes());
        out.extend(text.as_bytes());
        directory.extend(b"PK\x01\x02\x14\x00");
        directory.extend(&entry);
        // Comment, disk, attributes.
        directory.extend([0u8; 10]);
        directory.extend(offset.to_le_bytes());
        directory.extend(name.as_bytes());
    }
    let (start, size, count) = (out.len() as u32, directory.len() as u32, files.len() as u16);
    out.extend(&directory);
    out.extend(b"PK\x05\x06\x00\x00\x00\x00");
    [count, count].iter().for_each(|v| out.extend(v.to_le_bytes()));
    [size, start].iter().for_each(|v| out.extend(v.to_le_bytes()));
    out.extend([0u8; 2]);
    out
}

fn crc32(bytes: &[u8]) -> u32 {
    !bytes.iter().fold(!0u32, |crc, &b| {
        (0..8).fold(crc ^ u32::from(b), |c, _| if c & 1 == 1 { (c >> 1) ^ 0xedb8_8320 } else { c >> 1 })
    })
}

fn header() -> Vec<Cell> {
    ["q1", "q2", "q3", "q4", "q5", "q6", "L"].map(Text).to_vec()
}

fn row(length: f64) -> Vec<Cell> {
    [10.5, 20.0, 30.0, 40.0, 50.0, 60.0, length].map(Number).to_vec()
}

fn read(
    bytes: &[u8],
    sheet: Option<&str>,
) -> Result<truegrind_calibration::measurement::dataset::Dataset, String> {
    let options = Options { sheet: sheet.map(str::to_owned), ..Options::default() };
    import::read("rows.xlsx", bytes, &options).map_err(|error| error.to_string())
}

#[test]
fn the_first_sheet_with_the_columns_or_the_one_named() {
    let bytes = workbook(&[
        ("Notes", 1, vec![vec![Text("measured on a Monday")]]),
        ("Run A", 1, vec![header(), row(500.0), row(501.5)]),
        ("Run B", 1, vec![header(), row(600.25)]),
    ]);
    let data = read(&bytes, None).unwrap();
    assert_eq!((data.rows.len(), data.sensor, data.sheet.as_deref()), (2, Sensor::Cable, Some("Run A")));
    assert_eq!(data.rows[1].reading, Reading::Cable(501.5));
    assert!(
        data.notes.iter().any(|n| n.contains("sheet Run B has the columns too (1 rows)")),
        "{:?}",
        data.notes
    );
    assert_eq!(read(&bytes, Some("Run B")).unwrap().rows[0].reading, Reading::Cable(600.25));
    let error = read(&bytes, Some("Run C")).unwrap_err();
    assert_eq!(error, "rows.xlsx: there is no sheet Run C; it has Notes, Run A, Run B");
    let error = read(&bytes, Some("Notes")).unwrap_err();
    assert!(error.starts_with("rows.xlsx, sheet Notes, row 1: columns q1, q2"), "{error}");
}

#[test]
fn a_title_above_blank_rows_below_and_columns_without_a_header() {
    let mut blank_below = row(502.0);
    blank_below.extend([Blank, Number(7.0)]);
    let rows = vec![vec![Text("IRB 120, hall 3")], vec![], header(), row(500.0), vec![Blank; 7], blank_below];
    let data = read(&workbook(&[("Sheet1", 3, rows)]), None).unwrap();
    assert_eq!(data.rows.iter().map(|r| (r.number, r.line)).collect::<Vec<_>>(), [(6, 6), (8, 8)]);
    assert!(data.notes.iter().any(|n| n == "2 columns without a header skipped"), "{:?}", data.notes);
    assert!(data.notes.iter().any(|n| n == "1 blank row skipped"), "{:?}", data.notes);
}

#[test]
fn numbers_stored_as_text_are_numbers_and_other_text_is_not() {
    let mut texts = row(500.0);
    texts[6] = Text(" 512.75 ");
    let data = read(&workbook(&[("Sheet1", 1, vec![header(), texts.clone()])]), None).unwrap();
    assert_eq!(data.rows[0].reading, Reading::Cable(512.75));
    assert!(data.notes.iter().any(|n| n.starts_with("1 number stored as text")), "{:?}", data.notes);
    for (cell, found) in
        [(Text("512,75"), "`512,75`"), (Text("#DIV/0!"), "`#DIV/0!`"), (Blank, "an empty cell")]
    {
        texts[6] = cell;
        let error =
            read(&workbook(&[("Sheet1", 1, vec![header(), row(1.0), texts.clone()])]), None).unwrap_err();
        let wanted =
            format!("rows.xlsx, sheet Sheet1, row 3, column L: found {found}; expected a finite number");
        assert!(error.starts_with(&wanted), "{error}");
    }
}

/// Rows of a sheet that can be read, and then whatever is wrong.
fn with_rows(more: &str) -> String {
    let mut body = String::new();
    for (r, cells) in [header(), row(500.0), row(501.5)].iter().enumerate() {
        body += &format!("<row r=\"{}\">", r + 1);
        for (c, cell) in cells.iter().enumerate() {
            let at = format!("{}{}", char::from(b'A' + c as u8), r + 1);
            body += &match cell {
                Text(t) => format!("<c r=\"{at}\" t=\"inlineStr\"><is><t>{t}</t></is></c>"),
                Number(v) => format!("<c r=\"{at}\"><v>{v}</v></c>"),
                Blank => String::new(),
            };
        }
        body += "</row>";
    }
    body + more
}

/// The class: a workbook of a few kilobytes that claims a size. A claim is never believed: what is held is bounded by the
/// cells that are there, and a sheet that asks for more than that is refused by name.
#[test]
fn a_workbook_that_claims_a_size_is_read_by_its_cells_or_refused_by_name() {
    let cell = |at: &str| with_rows(&format!("<row><c r=\"{at}\"><v>1</v></c></row>"));
    // One cell far away, with nothing above it, is a column without a header.
    let far = read(&packed(&[("S", cell("XFD1048576"))], None), None).unwrap();
    assert_eq!(far.rows.len(), 2);
    for at in ["ZZZZ1", "A1048577", "A4294967295", "XFE2"] {
        let error = read(&packed(&[("S", cell(at))], None), None).unwrap_err();
        assert!(error.contains("expected at most 1048576 rows and 16384 columns"), "{at}: {error}");
    }
    for at in ["A0", "A-1", "", "1A", "Ä7", "A99999999999999999999", "ZZZZZZZZZZZZ9"] {
        assert!(read(&packed(&[("S", cell(at))], None), None).is_err(), "{at}");
    }
    let left: String =
        (1..3000).map(|r| format!("<row r=\"{r}\"><c r=\"XFD{r}\"><v>1</v></c></row>")).collect();
    let error = read(&packed(&[("S", left)], None), None).unwrap_err();
    assert!(error.contains("sheet S: found more than 16000000 cells"), "{error}");
    for claim in ["uniqueCount=\"4294967295\"", "uniqueCount = '99999999999999999999'"] {
        let strings = format!("<sst count=\"1\" {claim}><si><t>x</t></si></sst>");
        let error = read(&packed(&[("S", with_rows(""))], Some(&strings)), None).unwrap_err();
        assert!(error.contains("shared strings in a part of"), "{error}");
    }
    let fine = "<sst count=\"1\" uniqueCount=\"1\"><si><t>x</t></si></sst>";
    assert!(read(&packed(&[("S", with_rows(""))], Some(fine)), None).is_ok());
    // One long string in every cell.
    let long = format!("<sst><si><t>{}</t></si></sst>", "x".repeat(1 << 20));
    let cells: String =
        (1..200).map(|r| format!("<row r=\"{r}\"><c r=\"A{r}\" t=\"s\"><v>0</v></c></row>")).collect();
    let error = read(&packed(&[("S", cells)], Some(&long)), None).unwrap_err();
    assert!(error.contains("128 MB of text"), "{error}");
}

#[test]
fn what_is_no_xlsx_workbook_is_refused_by_name() {
    let error = read(b"\xd0\xcf\x11\xe0\xa1\xb1\x1a\xe1 and nothing else", None).unwrap_err();
    assert!(error.contains("an XLS workbook, or an XLSX workbook with a password"), "{error}");
    let whole = packed(&[("S", with_rows(""))], None);
    for end in (4..whole.len()).step_by(97) {
        assert!(read(&whole[..end], None).is_err());
    }
    for broken in ["<row", "<c r=\"A9\"><v>", "</sheetData></row></worksheet>", "&#xFFFFFFFF;"] {
        let _ = read(&packed(&[("S", with_rows(broken))], None), None);
    }
}
