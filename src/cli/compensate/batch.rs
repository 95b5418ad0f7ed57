//! The result of each program, its record in a shared run, and the reports over many programs.

use std::path::{Path, PathBuf};

use anyhow::bail;
use serde::de::IgnoredAny;
use serde::{Deserialize, Serialize};
use serde_json::{Value, json};
use truegrind::compensation::cell::Used;
use truegrind::report::batch::{self, Ended, Row};
use truegrind::report::kept::{Packed, unpacked};
use truegrind::units::done::Recorded;

use crate::cli::exit_status::ExitStatus;
use crate::cli::files::Batch;
use crate::cli::outputs::Outputs;
use crate::cli::programs::Job;
use crate::cli::shares::UnitResult;

/// The result for one program.
pub(crate) struct ProgramResult {
    pub(crate) row: Row,
    /// Files to write, with their bytes.
    pub(crate) written: Vec<(PathBuf, Vec<u8>)>,
    pub(crate) diff: Vec<u8>,
    /// Messages for stderr.
    pub(crate) notes: Vec<String>,
    /// Whether the program may run without a look at the report: nothing was refused, flagged or doubtful.
    pub(crate) clean: bool,
    /// Whether any byte changes.
    pub(crate) changed: bool,
    /// Motions left unchanged because no file declares the data they use.
    pub(crate) undeclared: usize,
    /// Its entries in the JSON report; `None` if no requested output shows them.
    pub(crate) json: Option<Vec<Value>>,
    /// The entries of the cell file that it uses; `None` if it was not examined.
    pub(crate) used: Option<Used>,
}

impl ProgramResult {
    /// A result without outputs.
    pub(super) fn empty(row: Row, notes: Vec<String>) -> Self {
        Self {
            row,
            written: Vec::new(),
            diff: Vec::new(),
            notes,
            clean: false,
            changed: false,
            undeclared: 0,
            json: None,
            used: None,
        }
    }
}

/// The record of a program, for writing.
#[derive(Serialize)]
struct RecordOut<'a> {
    row: &'a Row,
    diff: String,
    notes: &'a [String],
    clean: bool,
    changed: bool,
    undeclared: usize,
    json: Option<Vec<Packed<'a>>>,
}

/// The record of a program, for reading.
#[derive(Deserialize)]
struct RecordIn<J> {
    row: Row,
    diff: String,
    notes: Vec<String>,
    clean: bool,
    changed: bool,
    undeclared: usize,
    json: J,
}

impl UnitResult for ProgramResult {
    fn failed(job: &Job, reason: &str) -> Self {
        let row = Row::without(job.name(), Ended::Failed, Some(reason.to_owned()));
        Self { json: Some(Vec::new()), ..Self::empty(row, Vec::new()) }
    }

    fn is_failed(&self) -> bool {
        self.row.ended == Ended::Failed
    }

    fn record(&self) -> anyhow::Result<String> {
        Ok(serde_json::to_string(&RecordOut {
            row: &self.row,
            // One character per byte, since programs may use any character set.
            diff: self.diff.iter().copied().map(char::from).collect(),
            notes: &self.notes,
            clean: self.clean,
            changed: self.changed,
            undeclared: self.undeclared,
            json: self.json.as_ref().map(|json| json.iter().map(Packed).collect()),
        })?)
    }

    fn read(bytes: &[u8], key: &str, whole: bool) -> Option<Recorded<Self>> {
        if whole {
            // A brief record has no entries: its unit counts as not done.
            let entries = |packed: Value| match unpacked(packed) {
                Value::Array(json) => Some(Some(json)),
                _ => None,
            };
            Recorded::<RecordIn<Value>>::from_bytes(bytes, key)?.and_then(|read| read.done(entries))
        } else {
            let read = Recorded::<RecordIn<IgnoredAny>>::from_bytes(bytes, key)?;
            read.and_then(|read| read.done(|_| Some(None)))
        }
    }

    fn lighten(&mut self) {
        self.json = None;
    }
}

impl<J> RecordIn<J> {
    fn done(self, json: impl FnOnce(J) -> Option<Option<Vec<Value>>>) -> Option<ProgramResult> {
        Some(ProgramResult {
            row: self.row,
            written: Vec::new(),
            diff: self.diff.chars().map(|c| u8::try_from(c).ok()).collect::<Option<_>>()?,
            notes: self.notes,
            clean: self.clean,
            changed: self.changed,
            undeclared: self.undeclared,
            json: json(self.json)?,
            used: None,
        })
    }
}

/// What the exit code depends on besides the results.
#[derive(Debug, Clone, Copy)]
pub(crate) struct ExitCriteria {
    /// The model is nominal, so nothing was to be corrected.
    pub(crate) nominal: bool,
    /// `--check`: nothing is expected to change.
    pub(crate) check: bool,
}

impl ExitCriteria {
    /// `clean`: nothing was refused or flagged; `changed`: something was rewritten.
    pub(crate) fn exit_status(self, clean: bool, changed: bool) -> ExitStatus {
        let as_expected = match self.nominal {
            true => true,
            false if self.check => !changed,
            false => changed,
        };
        if clean && as_expected { ExitStatus::Done } else { ExitStatus::Flagged }
    }

    pub(crate) fn to_value(self) -> Value {
        json!({ "nominal": self.nominal, "check": self.check })
    }

    fn from_value(value: &Value) -> Self {
        let is = |key: &str| value[key].as_bool() == Some(true);
        Self { nominal: is("nominal"), check: is("check") }
    }
}

/// The reports over many programs.
pub(crate) struct BatchReports<'a> {
    pub(crate) outputs: &'a Outputs,
    pub(crate) diff: Option<&'a Path>,
    pub(crate) criteria: ExitCriteria,
}

impl BatchReports<'_> {
    /// Prints and writes them. `is_part`: one job of a shared run, which does not fail even if all its programs do.
    pub(crate) fn write(
        &self,
        done: Vec<ProgramResult>,
        mut batch: Batch,
        is_part: bool,
    ) -> anyhow::Result<ExitStatus> {
        let clean = done.iter().all(|done| done.clean);
        let changed = done.iter().any(|done| done.changed);
        let (mut rows, mut programs, mut diff) = (Vec::new(), Vec::new(), Vec::new());
        for done in done {
            rows.push(done.row);
            programs.extend(done.json.unwrap_or_default());
            diff.extend_from_slice(&done.diff);
        }
        let is_called = batch::doubt_called(&mut rows);
        let clean = clean && !is_called && !batch::shifts_apart(&rows);
        self.outputs.print(&batch::summary(&rows))?;
        self.outputs.add_made(
            &mut batch,
            || batch::document(&rows),
            || batch::table(&rows),
            || batch::json(&rows, programs),
        )?;
        if let Some(path) = self.diff {
            batch.add(path, diff);
        }
        batch.write()?;
        if !is_part && rows.iter().all(|row| row.ended == Ended::Failed) {
            bail!("none of {} programs could be processed", rows.len());
        }
        Ok(self.criteria.exit_status(clean, changed))
    }
}

/// The reports of a shared run, made from the records of its programs.
pub(crate) fn gathered(
    done: Vec<ProgramResult>,
    context: &Value,
    outputs: &Outputs,
    diff: Option<&Path>,
    batch: Batch,
) -> anyhow::Result<ExitStatus> {
    BatchReports { outputs, diff, criteria: ExitCriteria::from_value(context) }.write(done, batch, false)
}
