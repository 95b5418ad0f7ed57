//! A program and its correction, both run, and what the actual arm does in them.

mod events;
mod follow;

use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;

use super::machine::Event;
use super::make::{self, Features};
use super::setting::Setting;
use super::{Control, End, align, execute};
use crate::model::Case;
use crate::outcome::{Dialect, Disagreement, Tally};
use crate::under_test::{Corrected, Options, corrected};

/// Blocks that a run may take.
const BUDGET: usize = 1500;

/// A program of a seed, and what became of it.
#[derive(Debug, Clone)]
pub struct Shown {
    /// The program.
    pub original: String,
    /// The corrected program, or why there is none.
    pub corrected: Result<String, String>,
    /// What was counted.
    pub tally: Tally,
}

/// Makes, corrects, runs and compares the program of a seed. RAPID is not of this module: nothing is counted.
pub fn run(dialect: Dialect, seed: u64, case: &Case) -> Tally {
    shown(dialect, seed, case, Features::default()).tally
}

/// The same, with the texts.
pub fn shown(dialect: Dialect, seed: u64, case: &Case, features: Features) -> Shown {
    let Some((control, name)) = control_of(dialect) else {
        return Shown { original: String::new(), corrected: Err("no NC".into()), tally: Tally::default() };
    };
    let setting = make::setting(seed, control, case);
    let text = make::program(seed, control, &setting, features);
    judge(dialect, control, name, seed, case, &setting, text)
}

fn control_of(dialect: Dialect) -> Option<(Control, &'static str)> {
    Some(match dialect {
        Dialect::Fanuc => (Control::Fanuc, "p.nc"),
        Dialect::LinuxCnc => (Control::LinuxCnc, "p.ngc"),
        Dialect::Siemens => (Control::Siemens, "p.mpf"),
        Dialect::Heidenhain => (Control::Heidenhain, "p.h"),
        Dialect::Rapid => return None,
    })
}

/// Corrects a program, runs both under every circumstance that its text leaves open, and compares.
pub(super) fn judge(
    dialect: Dialect,
    control: Control,
    name: &str,
    seed: u64,
    case: &Case,
    setting: &Setting,
    text: String,
) -> Shown {
    let mut tally = Tally { programs: 1, ..Tally::default() };
    let wrong = |line: usize, kind, text| Disagreement { dialect, seed, line, kind, text };
    let mut rng = ChaCha8Rng::seed_from_u64(seed ^ 0x6f70_7469);
    let tolerance_mm = if rng.random_bool(0.3) { 0.05 } else { 20.0 };
    let options = Options { tolerance_mm, ..Options::default() };
    let done = match corrected(name, text.as_bytes(), case, &case.start_toml, &options) {
        Ok(done) => done,
        Err(error) => {
            tally.disagreements.push(wrong(0, "no-result", error.clone()));
            return Shown { original: text, corrected: Err(error), tally };
        }
    };
    let new = String::from_utf8_lossy(&done.bytes).into_owned();
    let origins = align::origins(text.as_bytes(), &done.bytes, &done.edits);
    for setting in circumstances(control, setting, &text) {
        let (before, end) = execute(control, &text, &setting, BUDGET);
        if let End::Fault(line, what) = end {
            tally.disagreements.push(wrong(line + 1, "interpreter", what));
            break;
        }
        // Blocks that were put in run as well.
        let (after, end_after) = execute(control, &new, &setting, 4 * BUDGET);
        if let End::Fault(line, what) = end_after {
            tally.disagreements.push(wrong(line + 1, "broken", what));
            break;
        }
        let pair = Pair { dialect, seed, case, done: &done, origins: &origins };
        let whole = end == End::Done;
        let found = events::compare(&pair, &before, &after, whole);
        let bad = !found.disagreements.is_empty();
        tally.merge(found);
        if bad {
            break;
        }
    }
    Shown { original: text, corrected: Ok(new), tally }
}

/// What stands beside the two runs.
pub(super) struct Pair<'p> {
    dialect: Dialect,
    seed: u64,
    case: &'p Case,
    done: &'p Corrected,
    origins: &'p [Option<usize>],
}

impl Pair<'_> {
    /// The line of the original of an event of the corrected program.
    fn origin(&self, event: &Event) -> Option<usize> {
        match event {
            Event::Move(done) => self.origins.get(done.line).copied().flatten(),
            Event::Elsewhere(line, ..) => self.origins.get(*line).copied().flatten(),
            Event::Note(_) => None,
        }
    }
}

/// With and without the blocks that may be skipped, and with both meanings of a number without a point.
fn circumstances(control: Control, setting: &Setting, text: &str) -> Vec<Setting> {
    let mut out = vec![setting.clone()];
    if text
        .lines()
        .any(|line| line.trim_start_matches(|c: char| c.is_ascii_digit() || c == ' ').starts_with('/'))
    {
        out.push(Setting { skip: true, ..setting.clone() });
    }
    if control == Control::Fanuc && text.contains("(NO POINT)") {
        out.push(Setting { increments: true, ..setting.clone() });
    }
    out
}
