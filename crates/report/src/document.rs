//! A document: headings, words, key figures, tables, pictures, verdicts, provenance. One document, every format.

use super::number::Precision;
use super::status::Status;
use super::table::{Cell, Table};

/// A document, in no format yet.
///
/// ```
/// use truegrind_report::document::{Block, Document, Verdict};
/// use truegrind_report::format::html;
/// use truegrind_report::status::Status;
/// let mut page = Document::new("Identification of abb-irb-120");
/// page.push(Verdict::new(Status::Good, "The model may be used", ["converged", "rank 27 of 27"]));
/// page.heading(2, "Residuals");
/// page.paragraph("Cable lengths, measured minus predicted.");
/// assert!(html::document(&page).starts_with("<!doctype html>"));
/// ```
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Document {
    /// Title.
    pub title: String,
    /// One line under the title; may be empty.
    pub subtitle: String,
    /// The content, in reading order.
    pub blocks: Vec<Block>,
}

/// A piece of a document.
#[derive(Debug, Clone, PartialEq)]
#[non_exhaustive]
pub enum Block {
    /// A heading; level 2 is a section, 3 and 4 lie below. Level 1 is the document's title.
    Heading(u8, String),
    /// A paragraph.
    Paragraph(String),
    /// A list of points.
    List(Vec<String>),
    /// A row of numbers that matter.
    KeyFigures(Vec<KeyFigure>),
    /// A table.
    Table(Table),
    /// A picture.
    Figure(Figure),
    /// A judgement with its reasons.
    Verdict(Verdict),
    /// What only some readers want; folded in HTML.
    Details {
        /// What is inside.
        summary: String,
        /// The content.
        blocks: Vec<Block>,
    },
    /// Text with fixed pitch: a command, lines of a program.
    Code(String),
    /// Where the results came from.
    Provenance(Provenance),
}

/// One number that matters, such as the held-out error.
#[derive(Debug, Clone, PartialEq)]
pub struct KeyFigure {
    /// What it is.
    pub label: String,
    /// The number.
    pub value: Cell,
    /// Digits shown.
    pub precision: Precision,
    /// Unit; may be empty.
    pub unit: String,
    /// What it is to be compared with, or how it was got; may be empty.
    pub note: String,
    /// Judgement, where there is one.
    pub status: Option<Status>,
}

impl KeyFigure {
    /// A number with fixed decimals.
    pub fn new(
        label: impl Into<String>,
        value: impl Into<Cell>,
        decimals: usize,
        unit: impl Into<String>,
    ) -> Self {
        Self {
            label: label.into(),
            value: value.into(),
            precision: Precision::Decimals(decimals),
            unit: unit.into(),
            note: String::new(),
            status: None,
        }
    }

    /// The same with a note.
    pub fn note(mut self, note: impl Into<String>) -> Self {
        self.note = note.into();
        self
    }

    /// The same with a judgement.
    pub fn status(mut self, status: Status) -> Self {
        self.status = Some(status);
        self
    }

    /// Value with its unit, `–` without unit where there is no value.
    pub(super) fn shown(&self) -> (String, &str) {
        let shown = self.value.shown(self.precision);
        let unit = if shown == super::number::MISSING { "" } else { self.unit.as_str() };
        (shown, unit)
    }
}

/// A picture.
#[derive(Debug, Clone, PartialEq)]
pub struct Figure {
    /// A whole SVG document, as the plots of [`super::plot`] give it.
    pub svg: String,
    /// What it shows, and what to see in it.
    pub caption: String,
}

impl Figure {
    /// A picture with its caption.
    pub fn new(svg: String, caption: impl Into<String>) -> Self {
        Self { svg, caption: caption.into() }
    }
}

/// A judgement with its reasons.
#[derive(Debug, Clone, PartialEq)]
pub struct Verdict {
    /// The judgement.
    pub status: Status,
    /// One sentence.
    pub headline: String,
    /// Why; may be empty.
    pub reasons: Vec<String>,
}

impl Verdict {
    /// A judgement with its reasons.
    pub fn new<S: Into<String>>(
        status: Status,
        headline: impl Into<String>,
        reasons: impl IntoIterator<Item = S>,
    ) -> Self {
        Self { status, headline: headline.into(), reasons: reasons.into_iter().map(Into::into).collect() }
    }
}

/// Where results came from: enough to make them again.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Provenance {
    /// Program and version.
    pub version: String,
    /// The command, where there was one.
    pub command: Option<String>,
    /// Method by name.
    pub method: Option<String>,
    /// Seed of every random number.
    pub seed: Option<u64>,
    /// The files that went in.
    pub sources: Vec<Source>,
    /// Anything else, as name and value.
    pub remarks: Vec<(String, String)>,
}

/// A file that went in.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Source {
    /// Its name.
    pub name: String,
    /// What it was: measurements, robot, program.
    pub role: String,
    /// SHA-256 of its bytes in hexadecimal, where it was taken.
    pub sha256: Option<String>,
    /// Rows that were used.
    pub rows: Option<usize>,
}

impl Provenance {
    /// Provenance of this version of truegrind.
    pub fn here() -> Self {
        Self { version: format!("truegrind {}", env!("CARGO_PKG_VERSION")), ..Self::default() }
    }

    /// Name and value of every entry that is known, in a fixed order.
    pub(super) fn entries(&self) -> Vec<(String, String)> {
        let mut entries = vec![("Made by".to_owned(), self.version.clone())];
        let known = [
            ("Command", self.command.clone()),
            ("Method", self.method.clone()),
            ("Seed", self.seed.map(|seed| seed.to_string())),
        ];
        entries.extend(known.into_iter().filter_map(|(name, value)| Some((name.to_owned(), value?))));
        for source in &self.sources {
            let role = if source.role.is_empty() { "Input" } else { &source.role };
            let mut value = source.name.clone();
            if let Some(rows) = source.rows {
                value.push_str(&format!(", {rows} rows"));
            }
            if let Some(hash) = &source.sha256 {
                value.push_str(&format!(", SHA-256 {hash}"));
            }
            entries.push((role.to_owned(), value));
        }
        entries.extend(self.remarks.iter().cloned());
        entries
    }
}

impl Document {
    /// An empty document.
    pub fn new(title: impl Into<String>) -> Self {
        Self { title: title.into(), ..Self::default() }
    }

    /// Adds a block.
    pub fn push(&mut self, block: impl Into<Block>) {
        self.blocks.push(block.into());
    }

    /// Adds a heading; level 2 is a section.
    pub fn heading(&mut self, level: u8, text: impl Into<String>) {
        self.blocks.push(Block::Heading(level, text.into()));
    }

    /// Adds a paragraph.
    pub fn paragraph(&mut self, text: impl Into<String>) {
        self.blocks.push(Block::Paragraph(text.into()));
    }

    /// Adds a picture with its caption.
    pub fn figure(&mut self, svg: String, caption: impl Into<String>) {
        self.blocks.push(Block::Figure(Figure::new(svg, caption)));
    }
}

impl From<Table> for Block {
    fn from(table: Table) -> Self {
        Block::Table(table)
    }
}

impl From<Figure> for Block {
    fn from(figure: Figure) -> Self {
        Block::Figure(figure)
    }
}

impl From<Verdict> for Block {
    fn from(verdict: Verdict) -> Self {
        Block::Verdict(verdict)
    }
}

impl From<Provenance> for Block {
    fn from(provenance: Provenance) -> Self {
        Block::Provenance(provenance)
    }
}

impl From<Vec<KeyFigure>> for Block {
    fn from(figures: Vec<KeyFigure>) -> Self {
        Block::KeyFigures(figures)
    }
}
