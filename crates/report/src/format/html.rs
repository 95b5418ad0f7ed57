//! HTML: a self-contained page that loads nothing and runs no script; a content security policy enforces this.

use std::collections::BTreeSet;

use super::{visible, words};
use crate::document::{Block, Document, Figure, KeyFigure, PageVerdict};
use crate::status::Status;
use crate::table::{Alignment, Cell, Table};

/// Style sheet for light mode, dark mode and print.
const STYLE: &str = include_str!("page.css");

/// Fewest sections for a table of contents.
const SECTIONS_FOR_CONTENTS: usize = 4;

/// Longer cells count as sentences (characters).
const SENTENCE: usize = 40;

/// Columns with cells up to this length are not wrapped (characters).
const SHORT: usize = 16;

/// Tables with more rows scroll inside the page.
const ROWS_TO_SCROLL: usize = 24;

/// Tables with so many columns have less space between them.
const COLUMNS_TO_NARROW: usize = 10;

/// The document as an HTML page.
pub fn document(document: &Document) -> String {
    let mut page = Page::default();
    page.blocks(&document.blocks);
    let title = escape(&document.title);
    let subtitle = match document.subtitle.as_str() {
        "" => String::new(),
        subtitle => format!("<p class=\"subtitle\">{}</p>\n", escape(subtitle)),
    };
    format!(
        "<!doctype html>\n<html lang=\"en\">\n<head>\n<meta charset=\"utf-8\">\n\
         <meta name=\"viewport\" content=\"width=device-width, initial-scale=1\">\n\
         <meta http-equiv=\"Content-Security-Policy\" content=\"default-src 'none'; style-src 'unsafe-inline'\">\n\
         <meta name=\"color-scheme\" content=\"light dark\">\n\
         <title>{title}</title>\n<style>\n{STYLE}</style>\n</head>\n<body>\n\
         <header>\n<h1>{title}</h1>\n{subtitle}</header>\n{contents}<main>\n{body}</main>\n</body>\n</html>\n",
        contents = page.contents(),
        body = page.body,
    )
}

/// The table as an HTML fragment.
pub fn table(table: &Table) -> String {
    let wide = if table.columns.len() >= COLUMNS_TO_NARROW { " wide" } else { "" };
    let mut html = if table.rows.len() > ROWS_TO_SCROLL {
        format!("<div class=\"table long{wide}\" tabindex=\"0\">\n<table>\n")
    } else {
        format!("<div class=\"table{wide}\">\n<table>\n")
    };
    if !table.title.is_empty() {
        html.push_str(&format!("<caption>{}</caption>\n", escape(&table.title)));
    }
    html.push_str("<thead><tr>");
    for column in &table.columns {
        let unit = column.unit.as_ref().map(|unit| format!(" <span class=\"unit\">{}</span>", escape(unit)));
        html.push_str(&format!(
            "<th scope=\"col\"{}>{}{}</th>",
            side(column.alignment()),
            escape(&column.heading),
            unit.unwrap_or_default()
        ));
    }
    html.push_str("</tr></thead>\n<tbody>\n");
    // Without a class, browsers give sentences too little width.
    let sentences: Vec<bool> = (0..table.columns.len())
        .map(|column| {
            let words = table.columns[column].alignment() == Alignment::Left;
            words && (0..table.rows.len()).any(|row| table.shown(row, column).chars().count() > SENTENCE)
        })
        .collect();
    // Wrapping a short word or status would double the height of every row.
    let short: Vec<bool> = (0..table.columns.len())
        .map(|column| (0..table.rows.len()).all(|row| table.shown(row, column).chars().count() <= SHORT))
        .collect();
    for row in 0..table.rows.len() {
        html.push_str("<tr>");
        for (index, column) in table.columns.iter().enumerate() {
            let shown = match table.cell(row, index) {
                Cell::Judged(status, text) => {
                    judged(*status, if text.is_empty() { status.word() } else { text })
                }
                _ if sentences[index] => prose(&table.shown(row, index)),
                _ => escape(&table.shown(row, index)),
            };
            let class = match column.alignment() {
                Alignment::Left if sentences[index] => " class=\"words\"",
                Alignment::Left if short[index] => " class=\"short\"",
                Alignment::Left => " class=\"phrase\"",
                Alignment::Right => side(Alignment::Right),
            };
            html.push_str(&format!("<td{class}>{shown}</td>"));
        }
        html.push_str("</tr>\n");
    }
    html.push_str("</tbody>\n</table>\n</div>\n");
    for note in &table.notes {
        html.push_str(&format!("<p class=\"note\">{}</p>\n", prose(note)));
    }
    html
}

/// Escapes text for content and quoted attributes; control and other invisible characters are spelled out ([`visible`]).
///
/// ```
/// use truegrind_report::format::html;
///
/// // Names from programs are shown as text.
/// assert_eq!(html::escape("<b>\"p10\" & p20"), "&lt;b&gt;&quot;p10&quot; &amp; p20");
/// ```
pub fn escape(text: &str) -> String {
    let mut escaped = String::with_capacity(text.len());
    for character in visible::text(text).chars() {
        match character {
            '\r' => {}
            '&' => escaped.push_str("&amp;"),
            '<' => escaped.push_str("&lt;"),
            '>' => escaped.push_str("&gt;"),
            '"' => escaped.push_str("&quot;"),
            '\'' => escaped.push_str("&#39;"),
            c => escaped.push(c),
        }
    }
    escaped
}

/// Escapes a sentence. Commands in backticks are set as code, and neither an option (`--max-risk`) nor a number with its unit is broken
/// between two lines.
///
/// ```
/// use truegrind_report::format::html;
///
/// assert_eq!(
///     html::prose("over 99.9 %: `truegrind plan`, --max-risk"),
///     "over 99.9\u{a0}%: <code>truegrind plan</code>, <span class=\"option\">--max-risk</span>"
/// );
/// ```
pub fn prose(text: &str) -> String {
    let mut html = String::new();
    // An unpaired backtick is text.
    let paired = text.matches('`').count() / 2 * 2;
    for (number, part) in text.splitn(paired + 1, '`').enumerate() {
        if number % 2 == 1 {
            html.push_str(&format!("<code>{}</code>", escape(part)));
            continue;
        }
        for word in words::keep_units(part, '\u{a0}').split_inclusive(' ') {
            let start =
                word.find("--").filter(|at| word[at + 2..].starts_with(|c: char| c.is_ascii_lowercase()));
            let Some(start) = start else {
                html.push_str(&escape(word));
                continue;
            };
            let option = |c: char| c == '-' || c.is_ascii_alphanumeric();
            let end = word[start..].find(|c| !option(c)).map_or(word.len(), |length| start + length);
            html.push_str(&format!(
                "{}<span class=\"option\">{}</span>{}",
                escape(&word[..start]),
                escape(&word[start..end]),
                escape(&word[end..])
            ));
        }
    }
    html
}

fn side(alignment: Alignment) -> &'static str {
    match alignment {
        Alignment::Left => "",
        Alignment::Right => " class=\"number\"",
    }
}

fn judged(status: Status, text: &str) -> String {
    format!(
        "<span class=\"status {}\"><span aria-hidden=\"true\">{}</span> {}</span>",
        status.class(),
        status.sign(),
        escape(text)
    )
}

/// Key figures in a row of a wide page, and of a narrower or printed one.
const WIDE_ROW: usize = 6;
const MEDIUM_ROW: usize = 4;

/// Figures per row, at most `most`, so that the last row is nearly as full as the others.
fn balanced(figures: usize, most: usize) -> usize {
    figures.div_ceil(figures.div_ceil(most).max(1)).max(1)
}

/// The page under construction, with data for the table of contents.
#[derive(Default)]
struct Page {
    body: String,
    sections: Vec<(String, String)>,
    anchors: BTreeSet<String>,
    figures: usize,
}

impl Page {
    fn blocks(&mut self, blocks: &[Block]) {
        for block in blocks {
            self.block(block);
        }
    }

    fn block(&mut self, block: &Block) {
        match block {
            Block::Heading(level, text) => self.heading((*level).clamp(2, 6), text),
            Block::Paragraph(text) => self.push(&format!("<p>{}</p>\n", prose(text))),
            Block::List(points) => self.list(points),
            Block::KeyFigures(figures) => self.key_figures(figures),
            Block::Table(block) => self.push(&table(block)),
            Block::Figure(figure) => self.figure(figure),
            Block::Verdict(verdict) => self.verdict(verdict),
            Block::Details { summary, blocks } => {
                self.push(&format!("<details>\n<summary>{}</summary>\n", escape(summary)));
                self.blocks(blocks);
                self.push("</details>\n");
            }
            Block::Code(code) => self.push(&format!("<pre><code>{}</code></pre>\n", escape(code))),
            Block::Provenance(provenance) => {
                self.push("<dl class=\"provenance\">\n");
                for (name, value) in provenance.entries() {
                    self.push(&format!("<div><dt>{}</dt><dd>{}</dd></div>\n", escape(&name), escape(&value)));
                }
                self.push("</dl>\n");
            }
        }
    }

    fn push(&mut self, html: &str) {
        self.body.push_str(html);
    }

    fn heading(&mut self, level: u8, text: &str) {
        let anchor = self.anchor(text);
        self.push(&format!("<h{level} id=\"{anchor}\">{}</h{level}>\n", escape(text)));
        if level == 2 {
            self.sections.push((anchor, text.to_owned()));
        }
    }

    /// A unique anchor made of the letters and digits of the heading.
    fn anchor(&mut self, text: &str) -> String {
        let mut name = String::new();
        for character in text.chars() {
            if character.is_ascii_alphanumeric() {
                name.push(character.to_ascii_lowercase());
            } else if !name.is_empty() && !name.ends_with('-') {
                name.push('-');
            }
        }
        let stem = match name.trim_end_matches('-') {
            "" => "section",
            stem => stem,
        };
        let mut anchor = stem.to_owned();
        let mut number = 2;
        while !self.anchors.insert(anchor.clone()) {
            anchor = format!("{stem}-{number}");
            number += 1;
        }
        anchor
    }

    fn contents(&self) -> String {
        if self.sections.len() < SECTIONS_FOR_CONTENTS {
            return String::new();
        }
        let mut html = String::from("<nav aria-label=\"Contents\">\n<ul>\n");
        for (anchor, text) in &self.sections {
            html.push_str(&format!("<li><a href=\"#{anchor}\">{}</a></li>\n", escape(text)));
        }
        html + "</ul>\n</nav>\n"
    }

    fn list(&mut self, points: &[String]) {
        self.push("<ul>\n");
        for point in points {
            self.push(&format!("<li>{}</li>\n", prose(point)));
        }
        self.push("</ul>\n");
    }

    fn key_figures(&mut self, figures: &[KeyFigure]) {
        let [wide, medium] = [WIDE_ROW, MEDIUM_ROW].map(|most| balanced(figures.len(), most));
        self.push(&format!("<dl class=\"key-figures\" style=\"--wide:{wide};--medium:{medium}\">\n"));
        for figure in figures {
            let (shown, unit) = figure.shown();
            let unit = match unit {
                "" => String::new(),
                unit => format!(" <span class=\"unit\">{}</span>", escape(unit)),
            };
            self.push(&format!(
                "<div class=\"{}\"><dt>{}</dt><dd class=\"value\">{}{unit}</dd>",
                figure.status.map_or("plain", Status::class),
                escape(&figure.label),
                escape(&shown)
            ));
            if let Some(status) = figure.status {
                self.push(&format!("<dd>{}</dd>", judged(status, status.word())));
            }
            if !figure.note.is_empty() {
                self.push(&format!("<dd>{}</dd>", prose(&figure.note)));
            }
            self.push("</div>\n");
        }
        self.push("</dl>\n");
    }

    fn figure(&mut self, figure: &Figure) {
        self.figures += 1;
        // SVG embedded in HTML needs no namespace.
        let svg = figure.svg.replacen(" xmlns=\"http://www.w3.org/2000/svg\"", "", 1);
        self.push(&format!(
            "<figure>\n{}\n<figcaption><b>Figure {}.</b> {}</figcaption>\n</figure>\n",
            svg.trim_end(),
            self.figures,
            prose(&figure.caption)
        ));
    }

    fn verdict(&mut self, verdict: &PageVerdict) {
        let status = verdict.status;
        self.push(&format!(
            "<section class=\"verdict {}\">\n<p><b>{}</b> {}</p>\n",
            status.class(),
            judged(status, status.word()),
            prose(&verdict.headline)
        ));
        if !verdict.reasons.is_empty() {
            self.list(&verdict.reasons);
        }
        self.push("</section>\n");
    }
}
