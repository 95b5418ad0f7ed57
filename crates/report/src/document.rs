//! Documents: headings, text, key figures, tables, plots, verdicts and provenance, independent of the format.

use super::number::Precision;
use super::status::Status;
use super::table::{Cell, Table};

/// A document, independent of the format.
///
/// ```
/// use truegrind_report::document::{Block, Document, PageVerdict};
/// use truegrind_report::format::html;
/// use truegrind_report::status::Status;
/// let mut page = Document::new("Identification of abb-irb-120");
/// page.push(PageVerdict::new(Status::Good, "The model may be used", ["converged", "rank 27 of 27"]));
/// page.heading(2, "Residuals");
/// page.paragraph("Cable lengths, measured minus predicted.");
/// assert!(html::document(&page).starts_with("<!doctype html>"));
/// ```
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Document {
    /// Title.
    pub title: String,
    /// Subtitle; may be empty.
    pub subtitle: String,
    /// The content in reading order.
    pub blocks: Vec<Block>,
}

/// A block of a document.
#[derive(Debug, Clone, PartialEq)]
#[non_exhaustive]
pub enum Block {
    /// A heading; level 2 is a section. Level 1 is the title of the document.
    Heading(u8, String),
    /// A paragraph.
    Paragraph(String),
    /// A bullet list.
    List(Vec<String>),
    /// A row of key figures.
    KeyFigures(Vec<KeyFigure>),
    /// A table.
    Table(Table),
    /// A plot.
    Figure(Figure),
    /// A verdict with its reasons.
    Verdict(PageVerdict),
    /// Details for some readers; collapsed in HTML.
    Details {
        /// Heading of the collapsed part.
        summary: String,
        /// The content.
        blocks: Vec<Block>,
    },
    /// Monospaced text: a command, lines of a program.
    Code(String),
    /// Provenance of the results.
    Provenance(Provenance),
}

/// A key figure, such as the held-out error.
#[derive(Debug, Clone, PartialEq)]
pub struct KeyFigure {
    /// Label.
    pub label: String,
    /// Value.
    pub value: Cell,
    /// Digits shown.
    pub precision: Precision,
    /// Unit; may be empty.
    pub unit: String,
    /// Explanation or value for comparison; may be empty.
    pub note: String,
    /// Status, if judged.
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

    /// Adds a note.
    pub fn note(mut self, note: impl Into<String>) -> Self {
        self.note = note.into();
        self
    }

    /// Adds a status.
    pub fn status(mut self, status: Status) -> Self {
        self.status = Some(status);
        self
    }

    /// Value and unit; `–` without unit if the value is missing.
    pub(super) fn shown(&self) -> (String, &str) {
        let shown = self.value.shown(self.precision);
        let unit = if shown == super::number::MISSING { "" } else { self.unit.as_str() };
        (shown, unit)
    }
}

/// A plot with its caption.
#[derive(Debug, Clone, PartialEq)]
pub struct Figure {
    /// SVG document, as made by the plots of [`super::plot`].
    pub svg: String,
    /// What it shows and how to read it.
    pub caption: String,
}

impl Figure {
    /// A plot with its caption.
    pub fn new(svg: String, caption: impl Into<String>) -> Self {
        Self { svg, caption: caption.into() }
    }
}

/// A verdict with its reasons.
#[derive(Debug, Clone, PartialEq)]
pub struct PageVerdict {
    /// Status.
    pub status: Status,
    /// One sentence.
    pub headline: String,
    /// Reasons; may be empty.
    pub reasons: Vec<String>,
}

impl PageVerdict {
    /// A verdict with its reasons.
    pub fn new<S: Into<String>>(
        status: Status,
        headline: impl Into<String>,
        reasons: impl IntoIterator<Item = S>,
    ) -> Self {
        Self { status, headline: headline.into(), reasons: reasons.into_iter().map(Into::into).collect() }
    }
}

/// Provenance of results, sufficient to reproduce them.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Provenance {
    /// Program and version.
    pub version: String,
    /// Command, if any.
    pub command: Option<String>,
    /// Name of the method.
    pub method: Option<String>,
    /// Seed of all random numbers.
    pub seed: Option<u64>,
    /// Input files.
    pub sources: Vec<Source>,
    /// Further remarks as name and value.
    pub remarks: Vec<(String, String)>,
}

/// An input file.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Source {
    /// File name.
    pub name: String,
    /// Role: measurements, robot, program.
    pub role: String,
    /// SHA-256 of its bytes in hexadecimal, if known.
    pub sha256: Option<String>,
    /// Number of rows used.
    pub rows: Option<usize>,
}

impl Source {
    /// An input file; an empty hash counts as unknown.
    pub fn new(name: impl Into<String>, role: &str, sha256: &str, rows: Option<usize>) -> Self {
        let sha256 = Some(sha256.to_owned()).filter(|hash| !hash.is_empty());
        Self { name: name.into(), role: role.to_owned(), sha256, rows }
    }
}

impl Provenance {
    /// Provenance of this version of truegrind.
    pub fn here() -> Self {
        Self { version: format!("truegrind {}", env!("CARGO_PKG_VERSION")), ..Self::default() }
    }

    /// Name and value of every known entry, in a fixed order.
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

impl From<PageVerdict> for Block {
    fn from(verdict: PageVerdict) -> Self {
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
