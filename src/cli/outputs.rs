//! The outputs that every verb offers: --json, --csv, --parquet, --md, --html, --rrd; and all that is printed.
//!
//! Nothing else in the program writes to stdout or stderr, so that what comes from files (names, headers, cells, words of
//! programs) passes [`visible`] on its way to a terminal or a log.

use std::fmt::Display;
use std::io::{IsTerminal, Write};
use std::path::{Path, PathBuf};

use anyhow::Context;
use clap::Args;
use truegrind::report::document::Document;
use truegrind::report::format::{self, visible};
use truegrind::report::table::Table;

use super::files::{Batch, is_stdout};

/// Where results go beside the terminal. Without a file name a result goes to stdout.
#[derive(Debug, Clone, Default, Args)]
pub(super) struct Outputs {
    /// JSON.
    #[arg(long, value_name = "FILE", num_args = 0..=1, default_missing_value = "-")]
    pub(super) json: Option<PathBuf>,
    /// CSV table.
    #[arg(long, value_name = "FILE", num_args = 0..=1, default_missing_value = "-")]
    pub(super) csv: Option<PathBuf>,
    /// The table as an Apache Parquet file.
    #[arg(long, value_name = "FILE")]
    pub(super) parquet: Option<PathBuf>,
    /// Markdown page.
    #[arg(long, value_name = "FILE", num_args = 0..=1, default_missing_value = "-")]
    pub(super) md: Option<PathBuf>,
    /// Self-contained HTML page with plots.
    #[arg(long, value_name = "FILE", num_args = 0..=1, default_missing_value = "-")]
    pub(super) html: Option<PathBuf>,
    /// Rerun recording.
    #[arg(long, value_name = "FILE")]
    pub(super) rrd: Option<PathBuf>,
}

impl Outputs {
    /// All files named.
    pub(super) fn files(&self) -> Vec<&Path> {
        [&self.json, &self.csv, &self.parquet, &self.md, &self.html, &self.rrd]
            .into_iter()
            .filter_map(|p| p.as_deref())
            .collect()
    }

    /// Whether any output shows the points of a path.
    pub(super) fn of_points(&self) -> bool {
        [&self.csv, &self.parquet, &self.md, &self.html, &self.rrd].into_iter().any(Option::is_some)
    }

    /// Whether stdout is taken by one of the outputs, so that the summary goes to stderr.
    pub(super) fn takes_stdout(&self) -> bool {
        self.files().into_iter().any(is_stdout)
    }

    /// Adds what was asked for; what was not is not made.
    pub(super) fn add_made(
        &self,
        batch: &mut Batch,
        page: impl FnOnce() -> Document,
        table: impl FnOnce() -> Table,
        json: impl FnOnce() -> serde_json::Value,
    ) -> anyhow::Result<()> {
        if let Some(path) = &self.json {
            batch.add(path, format::json::text(&json())?);
        }
        if self.csv.is_some() || self.parquet.is_some() {
            let table = table();
            if let Some(path) = &self.csv {
                batch.add(path, format::csv::table(&table));
            }
            if let Some(path) = &self.parquet {
                batch.add(path, format::parquet::table(&table));
            }
        }
        if self.md.is_none() && self.html.is_none() {
            return Ok(());
        }
        let page = page();
        if let Some(path) = &self.md {
            batch.add(path, format::markdown::document(&page));
        }
        if let Some(path) = &self.html {
            batch.add(path, format::html::document(&page));
        }
        Ok(())
    }

    /// Prints the summary, to stdout unless a result goes there.
    pub(super) fn print(&self, page: &Document) -> anyhow::Result<()> {
        self.print_beside(page, false)
    }

    /// The same; `taken`: a program goes to stdout.
    pub(super) fn print_beside(&self, page: &Document, taken: bool) -> anyhow::Result<()> {
        let text = format::terminal::document(page, width());
        if taken || self.takes_stdout() {
            tell_lines(&text);
            return Ok(());
        }
        say(&text)
    }
}

/// Prints a result. A reader that has seen enough (`| head`) is no fault.
///
/// # Errors
/// Where stdout cannot be written, such as to a full disk.
pub(super) fn say(text: impl AsRef<[u8]>) -> anyhow::Result<()> {
    print(visible::bytes(text.as_ref()).as_bytes())
}

/// Hands a file over to stdout: byte by byte as it is, or made visible where somebody looks at it.
///
/// # Errors
/// As [`say`].
pub(super) fn hand_over(bytes: &[u8]) -> anyhow::Result<()> {
    if std::io::stdout().is_terminal() { say(bytes) } else { print(bytes) }
}

fn print(bytes: &[u8]) -> anyhow::Result<()> {
    let mut out = std::io::stdout().lock();
    match out.write_all(bytes).and_then(|()| out.flush()) {
        Err(error) if error.kind() == std::io::ErrorKind::BrokenPipe => Ok(()),
        done => done.context("stdout cannot be written"),
    }
}

/// Characters of one message; more is not read by anybody.
const MOST_TOLD: usize = 10_000;

/// Tells something on stderr. It begins at the margin and goes on indented, so that no name or cell with an end of line in it
/// passes for a message of its own.
pub(super) fn tell(text: impl Display) {
    let mut text = text.to_string();
    // A file of a megabyte without a line feed is no message.
    if let Some((cut, _)) = text.char_indices().nth(MOST_TOLD) {
        let more = text[cut..].chars().count();
        text.truncate(cut);
        text += &format!("… ({more} more characters)");
    }
    tell_lines(&format!("{}\n", visible::text(&text).replace('\n', "\n  ")));
}

/// Lines for stderr that have their form already. Nobody reads them where it is closed.
pub(super) fn tell_lines(text: &str) {
    let _ = std::io::stderr().write_all(visible::text(text).as_bytes());
}

/// Columns of the terminal, 100 where there is none.
pub(super) fn width() -> usize {
    std::env::var("COLUMNS").ok().and_then(|c| c.parse().ok()).unwrap_or(100)
}
