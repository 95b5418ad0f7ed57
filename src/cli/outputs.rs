//! Output options of all verbs: --json, --csv, --parquet, --md, --html, and --rrd where there is an arm to draw.

use std::path::{Path, PathBuf};

use clap::Args;
use truegrind::report::document::Document;
use truegrind::report::format;
use truegrind::report::table::Table;

use super::files::{Batch, is_stdout};
use super::output_extension::{csv_file, refuse_other_kind};
use super::terminal::{print_message_lines, print_result, width};

/// Tables and pages. An option without a file name writes to stdout.
#[derive(Debug, Clone, Default, Args)]
pub(super) struct Pages {
    /// Write the full result as JSON.
    #[arg(long, value_name = "FILE", num_args = 0..=1, default_missing_value = "-")]
    pub(super) json: Option<PathBuf>,
    /// Write the table as CSV.
    #[arg(long, value_name = "FILE", num_args = 0..=1, default_missing_value = "-", value_parser = csv_file)]
    pub(super) csv: Option<PathBuf>,
    /// Write the table as an Apache Parquet file.
    #[arg(long, value_name = "FILE")]
    pub(super) parquet: Option<PathBuf>,
    /// Write the report as Markdown.
    #[arg(long, value_name = "FILE", num_args = 0..=1, default_missing_value = "-")]
    pub(super) md: Option<PathBuf>,
    /// Write the report as a self-contained HTML page with plots.
    #[arg(long, value_name = "FILE", num_args = 0..=1, default_missing_value = "-")]
    pub(super) html: Option<PathBuf>,
}

/// Pages and, for verbs with an arm to draw, the recording.
#[derive(Debug, Clone, Default, Args)]
pub(super) struct Outputs {
    #[command(flatten)]
    pub(super) pages: Pages,
    /// Write a Rerun recording (3D view).
    #[arg(long, value_name = "FILE")]
    #[cfg_attr(not(feature = "visual"), arg(value_parser = no_recordings))]
    pub(super) rrd: Option<PathBuf>,
}

/// What a build without pictures answers.
#[cfg(not(feature = "visual"))]
pub(super) const NO_RECORDINGS: &str = "this build makes and shows no recordings (it was made with --no-default-features); --html FILE writes a page";

/// A build without pictures refuses `--rrd` instead of ignoring it.
#[cfg(not(feature = "visual"))]
fn no_recordings(_: &str) -> Result<PathBuf, String> {
    Err(NO_RECORDINGS.to_owned())
}

/// Outputs of a verb without a recording.
impl From<&Pages> for Outputs {
    fn from(pages: &Pages) -> Self {
        Self { pages: pages.clone(), rrd: None }
    }
}

impl Outputs {
    /// All named files.
    pub(super) fn files(&self) -> Vec<&Path> {
        let Pages { json, csv, parquet, md, html } = &self.pages;
        [json, csv, parquet, md, html, &self.rrd].into_iter().filter_map(|p| p.as_deref()).collect()
    }

    /// Refuses a file whose extension promises another kind of file than it gets. An output that is an input is the graver fault, so that this
    /// comes once all inputs are read.
    pub(super) fn refuse_other_kinds(&self) -> anyhow::Result<()> {
        let Pages { json, csv, parquet, md, html } = &self.pages;
        let all: [(_, _, &[&str]); 5] = [
            (json, "JSON", &["json"]),
            (csv, "CSV", &["csv", "tsv"]),
            (parquet, "Parquet", &["parquet"]),
            (md, "Markdown", &["md"]),
            (html, "an HTML page", &["html", "htm"]),
        ];
        for (path, kind, own) in all {
            path.as_deref().map_or(Ok(()), |path| refuse_other_kind(path, kind, own))?;
        }
        Ok(())
    }

    /// Whether any output shows the points of a path.
    pub(super) fn of_points(&self) -> bool {
        let Pages { json: _, csv, parquet, md, html } = &self.pages;
        [csv, parquet, md, html, &self.rrd].into_iter().any(Option::is_some)
    }

    /// Whether stdout is taken by one of the outputs, so that the summary goes to stderr.
    pub(super) fn takes_stdout(&self) -> bool {
        self.files().into_iter().any(is_stdout)
    }

    /// Makes the requested outputs, and only those, and adds them to the batch.
    pub(super) fn add_made(
        &self,
        batch: &mut Batch,
        page: impl FnOnce() -> Document,
        table: impl FnOnce() -> Table,
        json: impl FnOnce() -> serde_json::Value,
    ) -> anyhow::Result<()> {
        let Pages { json: of_json, csv, parquet: of_parquet, md, html } = &self.pages;
        if let Some(path) = of_json {
            batch.add(path, format::json::text(&json())?);
        }
        if csv.is_some() || of_parquet.is_some() {
            let table = table();
            if let Some(path) = csv {
                batch.add(path, format::csv::table(&table));
            }
            if let Some(path) = of_parquet {
                batch.add(path, parquet(&table)?);
            }
        }
        if md.is_none() && html.is_none() {
            return Ok(());
        }
        let page = page();
        if let Some(path) = md {
            batch.add(path, format::markdown::document(&page));
        }
        if let Some(path) = html {
            batch.add(path, format::html::document(&page));
        }
        Ok(())
    }

    /// Prints the summary: to stdout, or to stderr if an output goes to stdout.
    pub(super) fn print(&self, page: &Document) -> anyhow::Result<()> {
        self.print_beside(page, false)
    }

    /// [`Outputs::print`]; `taken`: a program goes to stdout.
    pub(super) fn print_beside(&self, page: &Document, taken: bool) -> anyhow::Result<()> {
        let text = format::terminal::document(page, width());
        if taken || self.takes_stdout() {
            print_message_lines(&text);
            return Ok(());
        }
        print_result(&text)
    }
}

#[cfg(feature = "parquet")]
fn parquet(table: &Table) -> anyhow::Result<Vec<u8>> {
    Ok(format::parquet::table(table)?)
}

#[cfg(not(feature = "parquet"))]
fn parquet(_: &Table) -> anyhow::Result<Vec<u8>> {
    anyhow::bail!(
        "--parquet: this build has no Parquet support; build it with `--features parquet`, or use --csv"
    )
}
