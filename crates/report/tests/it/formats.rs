use proptest::prelude::*;
use truegrind_report::document::{Block, Document, KeyFigure, PageVerdict, Provenance};
use truegrind_report::format::{csv, html, json, markdown, terminal, visible};
use truegrind_report::status::Status;
use truegrind_report::table::{Alignment, Cell, Column, Table};

fn small() -> Table {
    let mut table = Table::new(
        "Parameters, <raw>",
        vec![
            Column::text("name", "Name"),
            Column::significant("value_mm", "Change", "mm", 2),
            Column::count("rows", "Rows"),
            Column::number("max_mm", "Max", "mm", 3),
            Column::text("state", "State"),
        ],
    );
    table.push([
        "a|1 \"x\"".into(),
        Cell::WithSigma { value: 0.1 + 0.2, sigma: 0.0125 },
        480usize.into(),
        (-1.0 / 3.0).into(),
        Cell::Judged(Status::Good, "kept, as is".into()),
    ]);
    table.push(["d_2".into(), Cell::Missing, Cell::Missing, f64::NAN.into()]);
    table.notes.push("σ is 1σ.".to_owned());
    table
}

#[test]
fn a_table_on_a_terminal() {
    insta::assert_snapshot!(terminal::table(&small(), 80), @r#"
    Parameters, <raw>
    Name       Change [mm]  Rows  Max [mm]  State
    ───────  ─────────────  ────  ────────  ─────────────
    a|1 "x"  0.300 ± 0.013   480    -0.333  ✓ kept, as is
    d_2                  –     –         –  –
    σ is 1σ.
    "#);
}

#[test]
fn a_table_in_markdown() {
    insta::assert_snapshot!(markdown::table(&small()), @r#"
    **Parameters, \<raw>**

    | Name     |   Change [mm] | Rows | Max [mm] | State         |
    | :------- | ------------: | ---: | -------: | :------------ |
    | a\|1 "x" | 0.300 ± 0.013 |  480 |   -0.333 | ✓ kept, as is |
    | d_2      |             – |    – |        – | –             |

    σ is 1σ.
    "#);
}

#[test]
fn a_table_in_csv_has_every_digit_and_sigma_in_a_column_of_its_own() {
    assert_eq!(
        csv::table(&small()),
        "name,value_mm,sigma_mm,rows,max_mm,state\r\n\
         \"a|1 \"\"x\"\"\",0.30000000000000004,0.0125,480,-0.3333333333333333,\"kept, as is\"\r\n\
         d_2,,,,,\r\n"
    );
}

#[test]
fn a_table_in_json_keeps_the_order_of_columns_and_has_null_for_nothing() {
    insta::assert_snapshot!(json::table(&small()), @r#"
    {
      "title": "Parameters, <raw>",
      "units": {
        "value_mm": "mm",
        "sigma_mm": "mm",
        "max_mm": "mm"
      },
      "rows": [
        {
          "name": "a|1 \"x\"",
          "value_mm": 0.30000000000000004,
          "sigma_mm": 0.0125,
          "rows": 480,
          "max_mm": -0.3333333333333333,
          "state": "kept, as is"
        },
        {
          "name": "d_2",
          "value_mm": null,
          "sigma_mm": null,
          "rows": null,
          "max_mm": null,
          "state": null
        }
      ],
      "notes": [
        "σ is 1σ."
      ]
    }
    "#);
}

#[test]
fn a_table_in_html() {
    insta::assert_snapshot!(html::table(&small()), @r#"
    <div class="table">
    <table>
    <caption>Parameters, &lt;raw&gt;</caption>
    <thead><tr><th scope="col">Name</th><th scope="col" class="number">Change <span class="unit">mm</span></th><th scope="col" class="number">Rows</th><th scope="col" class="number">Max <span class="unit">mm</span></th><th scope="col">State</th></tr></thead>
    <tbody>
    <tr><td class="short">a|1 &quot;x&quot;</td><td class="number">0.300 ± 0.013</td><td class="number">480</td><td class="number">-0.333</td><td class="short"><span class="status good"><span aria-hidden="true">✓</span> kept, as is</span></td></tr>
    <tr><td class="short">d_2</td><td class="number">–</td><td class="number">–</td><td class="number">–</td><td class="short">–</td></tr>
    </tbody>
    </table>
    </div>
    <p class="note">σ is 1σ.</p>
    "#);
}

#[test]
fn results_as_json_have_null_for_what_is_not_finite() {
    #[derive(serde::Serialize)]
    struct Fit {
        rmse_mm: f64,
        cv_rmse_mm: Option<f64>,
        condition: f64,
        errors_mm: Vec<f64>,
    }
    let fit =
        Fit { rmse_mm: 0.25, cv_rmse_mm: None, condition: f64::INFINITY, errors_mm: vec![f64::NAN, 1e-9] };
    insta::assert_snapshot!(json::text(&fit).unwrap(), @r#"
    {
      "rmse_mm": 0.25,
      "cv_rmse_mm": null,
      "condition": null,
      "errors_mm": [
        null,
        1e-9
      ]
    }
    "#);
}

#[test]
fn equal_keys_are_told_apart() {
    let mut table = Table::new(
        "",
        vec![Column::count("n", "n"), Column::count("n", "again"), Column::count("n_2", "third")],
    );
    table.push([1usize.into(), 2usize.into(), 3usize.into()]);
    assert_eq!(csv::table(&table), "n,n_2,n_2_2\r\n1,2,3\r\n");
    let rows: serde_json::Value =
        serde_json::from_str(&serde_json::to_string(&json::Rows(&table)).unwrap()).unwrap();
    assert_eq!(rows, serde_json::json!([{"n": 1, "n_2": 2, "n_2_2": 3}]));
}

proptest! {
    /// Whatever the words and numbers, a CSV reader gets back the same words and the same bits, but for an apostrophe before
    /// words that a spreadsheet would compute.
    #[test]
    fn csv_round_trip(
        words in proptest::collection::vec("[ -~\r\n\té–\"]{0,12}", 1..6),
        numbers in proptest::collection::vec(proptest::num::f64::ANY, 6),
    ) {
        let mut table = Table::new("", vec![Column::text("word", "Word"), Column::number("x_mm", "x", "mm", 1)]);
        for (word, number) in words.iter().zip(&numbers) {
            table.push([word.as_str().into(), (*number).into()]);
        }
        let text = csv::table(&table);
        let mut reader = ::csv::ReaderBuilder::new().from_reader(text.as_bytes());
        let records: Vec<_> = reader.records().map(Result::unwrap).collect();
        prop_assert_eq!(records.len(), words.len());
        for ((record, word), number) in records.iter().zip(&words).zip(&numbers) {
            let computed = word.len() > 1 && word.starts_with(['=', '+', '-', '@', '\t', '\r']) && word.parse::<f64>().is_err();
            prop_assert_eq!(&record[0], &format!("{}{word}", if computed { "'" } else { "" }));
            if number.is_nan() {
                prop_assert_eq!(&record[1], "");
            } else {
                prop_assert_eq!(record[1].parse::<f64>().unwrap().to_bits(), number.to_bits());
            }
        }
    }

    /// Lines of a table keep the width, except where one number with its row's name is wider.
    #[test]
    fn a_terminal_table_keeps_the_width(width in 40usize..140, columns in 1usize..20) {
        let mut table = Table::new("t", (0..columns).map(|i| Column::number(format!("c{i}"), format!("col {i}"), "mm", 2)).collect());
        table.columns.insert(0, Column::text("name", "Name"));
        table.columns.push(Column::text("note", "Note"));
        for row in 0..3 {
            let mut cells: Vec<Cell> = vec!["a method with a rather long name".into()];
            cells.extend((0..columns).map(|i| Cell::Number((row * i) as f64 * 17.3)));
            cells.push("and words about it".into());
            table.push(cells);
        }
        for line in terminal::table(&table, width).lines() {
            prop_assert!(line.chars().count() <= width, "{} > {width}: {line}", line.chars().count());
        }
    }
}

/// Nothing is cut off a table on a terminal: not names that tell things apart, robots or programs in folders, and not the
/// reasons beside them. What is too long goes on in the next line, word by word.
#[test]
fn nothing_is_cut_off_a_table_on_a_terminal() {
    let columns = || {
        let mut out = vec![Column::text("file", "Program")];
        out.extend((0..5).map(|i| Column::number(format!("n{i}"), format!("figure {i}"), "mm", 3)));
        out.push(Column::text("note", "Note"));
        out
    };
    let row = |name: &str| -> Vec<Cell> {
        let numbers = (0..5).map(|i| Cell::Number(f64::from(i)));
        std::iter::once(name.into())
            .chain(numbers)
            .chain(["a reason that is told in some more words".into()])
            .collect()
    };
    let robots = [
        "universal-robots-ur10e-high-payload",
        "universal-robots-ur10e-high-speed",
        "universal-robots-ur10e",
    ];
    let programs =
        ["customers/of-this-year/parts/blade-left.mod", "customers/of-this-year/parts/blade-right.mod"];
    for names in [&robots[..], &programs[..]] {
        let mut table = Table::new("", columns());
        names.iter().for_each(|name| table.push(row(name)));
        for width in [80, 100, 120] {
            let text = terminal::table(&table, width);
            assert!(text.lines().all(|line| line.chars().count() <= width), "{text}");
            // What stands in the first column, and in the last one, put together again.
            let (mut first, mut last) = (String::new(), String::new());
            for line in text.lines() {
                let cells: Vec<&str> = line.split("  ").map(str::trim).collect();
                first += cells.first().unwrap();
                last = format!("{last} {}", cells.last().unwrap());
            }
            for name in names {
                assert!(first.contains(name.rsplit('/').next().unwrap()), "{name} at {width}:\n{text}");
            }
            let reasons = last.matches("a reason that is told in some more words").count();
            assert_eq!(reasons, names.len(), "{width}:\n{text}");
            assert!(!text.contains("wor…") && !text.contains("high-…"), "{text}");
        }
    }
    // Folders that all share say nothing; what differs is there whole.
    let mut table = Table::new("", columns());
    programs.iter().for_each(|name| table.push(row(name)));
    let text = terminal::table(&table, 80);
    assert!(text.contains("…/blade-left.mod") && text.contains("…/blade-right.mod"), "{text}");
}

#[test]
fn a_wide_table_goes_on_below_with_its_first_column() {
    let mut table =
        Table::new("", (0..6).map(|i| Column::number(format!("p{i}"), format!("P{i}"), "mm", 2)).collect());
    table.columns.insert(0, Column::text("method", "method"));
    table.push(std::iter::once(Cell::from("LTLM")).chain((0..6).map(|i| Cell::Number(f64::from(i)))));
    insta::assert_snapshot!(terminal::table(&table, 40), @r"
              P0    P1    P2    P3    P4
    method  [mm]  [mm]  [mm]  [mm]  [mm]
    ──────  ────  ────  ────  ────  ────
    LTLM    0.00  1.00  2.00  3.00  4.00

              P5
    method  [mm]
    ──────  ────
    LTLM    5.00
    ");
}

#[test]
fn headings_are_wrapped_before_names_and_names_are_not_broken() {
    let mut table = Table::new(
        "",
        vec![
            Column::text("name", "Name"),
            Column::text("maker", "Maker"),
            Column::number("repeatability_mm", "Repeatability", "mm", 3),
            Column::number("reach_mm", "Reach", "mm", 0),
        ],
    );
    table.push(["abb-irb-4600-60-2.05".into(), "Universal Robots".into(), 0.06.into(), 2050.0.into()]);
    let rule = [20, 16, 13, 5].map(|width| "─".repeat(width)).join("  ");
    let expected = [
        "                                        Repeatability  Reach",
        "Name                  Maker                      [mm]   [mm]",
        &rule,
        "abb-irb-4600-60-2.05  Universal Robots          0.060   2050",
    ];
    assert_eq!(terminal::table(&table, 60), expected.join("\n") + "\n");
}

#[test]
fn an_excerpt_says_what_it_leaves_out() {
    let mut table = Table::new("", vec![Column::count("i", "i")]);
    for i in 0..100usize {
        table.push([i.into()]);
    }
    let excerpt = table.excerpt(6);
    let shown: Vec<&Cell> = excerpt.rows.iter().map(|row| &row[0]).collect();
    let count = |i| Cell::Count(i);
    assert_eq!(shown, [&count(0), &count(1), &count(2), &count(3), &"⋮".into(), &count(98), &count(99)]);
    assert_eq!(excerpt.notes, ["94 of 100 rows, between the first 4 and the last 2, are omitted here."]);
    assert_eq!(table.excerpt(100), table);
}

#[test]
fn a_table_without_rows_or_columns() {
    let table = Table::new("", Vec::new());
    assert_eq!((terminal::table(&table, 80), csv::table(&table)), (String::new(), "\r\n".to_owned()));
    let table = Table::new("", vec![Column::number("x_mm", "x", "mm", 1)]);
    assert_eq!(terminal::table(&table, 80), "x [mm]\n──────\n");
    assert_eq!(table.columns[0].alignment(), Alignment::Right);
    assert_eq!(csv::table(&table), "x_mm\r\n");
}

const HOSTILE: &str = "</p></title><script>alert('x')</script> & \"q\" | `c` *b* _u_ [a](http://x) \u{1}";

/// Every place of a document that takes words.
fn hostile() -> Document {
    let mut table = Table::new(HOSTILE, vec![Column::number(HOSTILE, HOSTILE, HOSTILE, 1)]);
    table.push([HOSTILE.into()]);
    table.push([Cell::Judged(Status::Bad, HOSTILE.into())]);
    table.notes.push(HOSTILE.to_owned());
    let mut page = Document::new(HOSTILE);
    page.subtitle = HOSTILE.to_owned();
    page.heading(2, HOSTILE);
    page.paragraph(HOSTILE);
    page.push(Block::List(vec![HOSTILE.to_owned()]));
    page.push(Block::Code(HOSTILE.to_owned()));
    page.push(PageVerdict::new(Status::Bad, HOSTILE, [HOSTILE]));
    page.push(Block::Details { summary: HOSTILE.to_owned(), blocks: vec![table.into()] });
    page
}

#[test]
fn words_never_become_markup() {
    let html = html::document(&hostile());
    assert!(!html.contains("<script"));
    super::plots::assert_well_formed(&html);
    let markdown = markdown::document(&hostile());
    // Code is shown as it is, between fences; elsewhere nothing opens a tag.
    let outside_code: String = markdown.split("```").step_by(2).collect();
    assert!(!outside_code.contains("<script") || outside_code.contains("\\<script"));
    assert_eq!(outside_code.matches("<script").count(), outside_code.matches("\\<script").count());
    assert!(outside_code.contains(r"\*b\* \_u\_ [a\](http://x)"));
}

#[test]
fn file_names_stay_readable_in_markdown() {
    let mut page = Document::new("path_01_left.mod");
    page.paragraph("- 3 of 4 targets in main_program.mod, R&D cell");
    assert_eq!(
        markdown::document(&page),
        "# path_01_left.mod\n\n\\- 3 of 4 targets in main_program.mod, R&D cell\n"
    );
}

/// Text of others that acts without showing never stands in a page as it is. Not the escape sequence alone: all control
/// characters of ASCII and Latin-1, what turns the direction of reading round, what has no width, other ends of lines.
#[test]
fn what_acts_without_showing_is_spelled_out_in_every_format() {
    let hidden =
        (0..=0x10_ffff).filter_map(char::from_u32).filter(|c| visible::is_invisible(*c)).collect::<String>();
    for c in [
        '\0', '\x07', '\x1b', '\x7f', '\u{80}', '\u{9b}', '\u{9f}', '\u{200b}', '\u{2028}', '\u{202e}',
        '\u{2066}', '\u{2069}', '\u{feff}',
    ] {
        assert!(hidden.contains(c), "{c:?}");
    }
    let words = format!("a{hidden}z");
    let mut table =
        Table::new(&words, vec![Column::text(&words, &words), Column::number("n", &words, &words, 1)]);
    table.push([words.as_str().into()]);
    table.push([Cell::Judged(Status::Bad, words.clone())]);
    table.notes.push(words.clone());
    let mut page = Document::new(&words);
    page.subtitle.clone_from(&words);
    page.heading(2, &words);
    page.paragraph(&words);
    page.push(Block::List(vec![words.clone()]));
    page.push(Block::Code(words.clone()));
    page.push(vec![KeyFigure::new(&words, 1.0, 1, &words).note(&words)]);
    page.push(PageVerdict::new(Status::Bad, &words, [&words]));
    page.push(Provenance { remarks: vec![(words.clone(), words.clone())], ..Provenance::here() });
    page.push(Block::Table(table.clone()));
    page.push(Block::Details { summary: words.clone(), blocks: vec![table.clone().into()] });
    for (format, text) in [
        ("terminal", terminal::document(&page, 100)),
        ("markdown", markdown::document(&page)),
        ("html", html::document(&page)),
        ("json", json::table(&table)),
        ("csv", csv::table(&table).replace('\r', "")),
    ] {
        let found: Vec<char> = text.chars().filter(|c| visible::is_invisible(*c)).collect();
        assert!(found.is_empty(), "{format}: {found:?}");
        if format != "json" {
            assert!(text.contains("x1b") && text.contains("u{202e}"), "{format}");
        }
    }
    let back: serde_json::Value = serde_json::from_str(&json::table(&table)).unwrap();
    assert_eq!(back["title"], words.as_str(), "a reader of JSON gets every character back");
}

#[test]
fn bytes_that_are_no_text_are_spelled_out() {
    assert_eq!(visible::bytes(b"ok \x9b2J \xc3\xa4\r\n\x1b[m"), "ok \\x9b2J \u{e4}\r\n\\x1b[m");
    assert_eq!(visible::line("a\r\nb\tc\rd\x08"), "a b c d\\x08");
    assert_eq!(visible::text("a\rb\r\n"), "a\\x0db\r\n");
}

/// The class: a table that is too wide for the terminal, in whose continuation the rows could not be told apart.
#[test]
fn a_table_that_continues_below_repeats_what_tells_its_rows_apart() {
    let columns = vec![
        Column::text("effect", "effect"),
        Column::text("where", "where"),
        Column::number("worth_mm", "worth", "mm", 3),
        Column::number("without_mm", "held out without", "mm", 4),
    ];
    let mut table = Table::new("Findings", columns);
    for joint in 1..=2 {
        table.push(["gear".into(), format!("joint {joint}").into(), 0.1.into(), 0.05.into()]);
    }
    let text = terminal::table(&table, 30);
    let below = text.split("\n\n").nth(1).unwrap();
    assert!(below.contains("gear    joint 1") && below.contains("gear    joint 2"), "{text}");
    // Where one column tells them apart, it stands alone.
    table.rows[1][0] = "play".into();
    let text = terminal::table(&table, 30);
    assert!(!text.split("\n\n").nth(1).unwrap().contains("joint"), "{text}");
}

#[test]
fn key_figures_fill_their_rows_and_options_are_not_broken() {
    let page = |count: usize| {
        let mut page = Document::new("Page");
        page.push(vec![KeyFigure::new("Largest", 0.37, 3, "mm").note("below --max-risk, 7.2 %"); count]);
        html::document(&page)
    };
    // Six in a row of a wide page, twice three in a narrower one; never one alone.
    for (count, columns) in
        [(6, "--wide:6;--medium:3"), (9, "--wide:5;--medium:3"), (7, "--wide:4;--medium:4")]
    {
        assert!(page(count).contains(columns), "{count}");
    }
    assert!(page(1).contains("below <span class=\"option\">--max-risk</span>, 7.2\u{a0}%"), "{}", page(1));
}

#[test]
fn the_note_of_a_key_figure_stays_within_the_terminal() {
    let mut document = Document::new("Page");
    document.push(vec![
        KeyFigure::new("Programs before", 0.66, 3, "mm").note("expected RMS inside the measured region"),
        KeyFigure::new("After", 0.05, 3, "mm"),
    ]);
    let text = terminal::document(&document, 48);
    assert!(text.lines().all(|line| line.chars().count() <= 52), "{text}");
    assert!(text.contains("0.660 mm  expected RMS inside the\n"), "{text}");
    assert!(text.contains("\n                           measured region\n"), "{text}");
    assert!(text.ends_with("After            0.050 mm\n"), "{text}");
}

/// A p-value too small for its digits is a number to programs and a bound to people.
#[test]
fn a_number_that_pages_show_in_words_is_a_number_in_data() {
    let mut table = Table::new("", vec![Column::significant("p_value", "p", "", 2)]);
    table.push([Cell::Worded { value: 0.0, shown: "< 1e-300".to_owned() }]);
    assert_eq!(csv::table(&table), "p_value\r\n0\r\n");
    let rows: serde_json::Value =
        serde_json::from_str(&serde_json::to_string(&json::Rows(&table)).unwrap()).unwrap();
    assert_eq!(rows, serde_json::json!([{"p_value": 0.0}]));
    assert!(terminal::table(&table, 80).contains("< 1e-300"));
}
