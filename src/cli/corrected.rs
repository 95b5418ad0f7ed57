//! What came of programs that `compensate` was given, each by itself, and the reports over many: of one run, and of what the jobs of a
//! shared run kept.

use std::path::{Path, PathBuf};

use anyhow::bail;
use serde::de::IgnoredAny;
use serde::{Deserialize, Serialize};
use serde_json::{Value, json};
use truegrind::compensation::cell::Used;
use truegrind::report::batch::{self, Ended, Row};
use truegrind::report::kept::{Packed, unpacked};
use truegrind::units::done::Recorded;

use super::ending::Ending;
use super::files::Batch;
use super::outputs::Outputs;
use super::programs::Job;
use super::shares::Kept;

/// A program, rewritten.
pub(super) struct Done {
    pub(super) row: Row,
    /// Files to write, with their bytes.
    pub(super) written: Vec<(PathBuf, Vec<u8>)>,
    pub(super) diff: Vec<u8>,
    /// What to say on stderr.
    pub(super) notes: Vec<String>,
    /// Whether everything that it holds was rewritten, without refusal, flag or doubt.
    pub(super) clean: bool,
    /// Whether any byte changes.
    pub(super) changed: bool,
    /// Motions that are left because what they use is declared in none of the files.
    pub(super) undeclared: usize,
    /// Entries of the contract; absent where nothing that is asked for shows them.
    pub(super) json: Option<Vec<Value>>,
    /// What it uses of the cell file; absent where it was not looked at.
    pub(super) used: Option<Used>,
}

/// What is kept of a program, as it is written.
#[derive(Serialize)]
struct Writing<'a> {
    row: &'a Row,
    diff: String,
    notes: &'a [String],
    clean: bool,
    changed: bool,
    undeclared: usize,
    json: Option<Vec<Packed<'a>>>,
}

/// The same, as it is read.
#[derive(Deserialize)]
struct Reading<J> {
    row: Row,
    diff: String,
    notes: Vec<String>,
    clean: bool,
    changed: bool,
    undeclared: usize,
    json: J,
}

impl Kept for Done {
    fn failed(job: &Job, why: &str) -> Self {
        failed(job, why)
    }

    fn is_failed(&self) -> bool {
        self.row.ended == Ended::Failed
    }

    fn record(&self) -> anyhow::Result<String> {
        Ok(serde_json::to_string(&Writing {
            row: &self.row,
            // A character for each byte: programs may be in any character set.
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
            // A brief record has none: then its unit counts as one that is not done.
            let entries = |packed: Value| match unpacked(packed) {
                Value::Array(json) => Some(Some(json)),
                _ => None,
            };
            Recorded::<Reading<Value>>::from_bytes(bytes, key)?.and_then(|read| read.done(entries))
        } else {
            let read = Recorded::<Reading<IgnoredAny>>::from_bytes(bytes, key)?;
            read.and_then(|read| read.done(|_| Some(None)))
        }
    }

    fn lighten(&mut self) {
        self.json = None;
    }
}

impl<J> Reading<J> {
    fn done(self, json: impl FnOnce(J) -> Option<Option<Vec<Value>>>) -> Option<Done> {
        Some(Done {
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

fn failed(job: &Job, error: &str) -> Done {
    Done {
        row: Row::without(job.name(), Ended::Failed, Some(error.to_owned())),
        written: Vec::new(),
        diff: Vec::new(),
        notes: Vec::new(),
        clean: false,
        changed: false,
        undeclared: 0,
        // There is none, whatever is asked for.
        json: Some(Vec::new()),
        used: None,
    }
}

/// What the exit code of a run hangs on, beside what came of its programs.
#[derive(Debug, Clone, Copy)]
pub(super) struct Judging {
    /// Nothing was to be corrected.
    pub(super) nominal: bool,
    /// Whether anything would change was asked.
    pub(super) check: bool,
}

impl Judging {
    /// How a run ended that refused and flagged nothing (`clean`) or something, and rewrote something or nothing.
    pub(super) fn ending(self, clean: bool, changed: bool) -> Ending {
        let as_asked = match self.nominal {
            true => true,
            false if self.check => !changed,
            false => changed,
        };
        if clean && as_asked { Ending::Done } else { Ending::Flagged }
    }

    pub(super) fn to_value(self) -> Value {
        json!({ "nominal": self.nominal, "check": self.check })
    }

    fn from_value(value: &Value) -> Self {
        let is = |key: &str| value[key].as_bool() == Some(true);
        Self { nominal: is("nominal"), check: is("check") }
    }
}

/// Where the reports of many programs go.
pub(super) struct Reports<'a> {
    pub(super) outputs: &'a Outputs,
    pub(super) diff: Option<&'a Path>,
    pub(super) judging: Judging,
}

impl Reports<'_> {
    /// Prints and writes them. `is_part`: of a run that goes on elsewhere, which no number of bad programs ends.
    pub(super) fn write(&self, done: Vec<Done>, mut batch: Batch, is_part: bool) -> anyhow::Result<Ending> {
        let clean = done.iter().all(|done| done.clean);
        let changed = done.iter().any(|done| done.changed);
        let (mut rows, mut programs, mut diff) = (Vec::new(), Vec::new(), Vec::new());
        for done in done {
            rows.push(done.row);
            programs.extend(done.json.unwrap_or_default());
            diff.extend_from_slice(&done.diff);
        }
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
            bail!("none of {} programs could be done", rows.len());
        }
        Ok(self.judging.ending(clean, changed))
    }
}

/// The reports of a shared run, from what was kept of each program.
pub(super) fn gathered(
    done: Vec<Done>,
    context: &Value,
    outputs: &Outputs,
    diff: Option<&Path>,
    batch: Batch,
) -> anyhow::Result<Ending> {
    Reports { outputs, diff, judging: Judging::from_value(context) }.write(done, batch, false)
}
