//! Many programs, in parallel, and what they amount to.

use std::collections::BTreeMap;
use std::fmt::Write;
use std::time::Instant;

use rayon::prelude::*;

use crate::outcome::{Dialect, Tally};
use crate::rapid::{self, Features};

/// Programs that are made before the count is looked at again.
const BATCH: u64 = 64;

/// Runs programs of each language until its share of `wanted` corrected executions is reached; the seconds beside it. The
/// result does not depend on the number of threads.
pub fn many(
    languages: &[Dialect],
    seed: u64,
    wanted: usize,
    features: Features,
) -> Vec<(Dialect, Tally, f64)> {
    let share = wanted.div_ceil(languages.len());
    languages
        .iter()
        .map(|&dialect| {
            let begun = Instant::now();
            let mut tally = Tally::default();
            let mut next = seed;
            while tally.corrected < share && tally.programs < 1000 + 50 * share {
                let batch: Vec<Tally> =
                    (next..next + BATCH).into_par_iter().map(|seed| run(dialect, seed, features)).collect();
                batch.into_iter().for_each(|one| tally.merge(one));
                next += BATCH;
            }
            (dialect, tally, begun.elapsed().as_secs_f64())
        })
        .collect()
}

/// One program.
pub fn run(dialect: Dialect, seed: u64, features: Features) -> Tally {
    match dialect {
        Dialect::Rapid => rapid::run(seed, features),
        other => crate::nc::run(other, seed, &features.arm(seed)),
    }
}

/// Both programs of a seed with what was found, as text.
pub fn one(dialect: Dialect, seed: u64, features: Features) -> String {
    let mut out = String::new();
    if dialect == Dialect::Rapid {
        let shown = rapid::shown(seed, features);
        for (what, files) in [("original", &shown.original), ("corrected", &shown.corrected)] {
            for (name, bytes) in files {
                let text: String = bytes.iter().map(|byte| char::from(*byte)).collect();
                let _ = writeln!(out, "---- {what} {name}\n{text}");
            }
        }
        for row in &shown.rows {
            let _ = writeln!(
                out,
                "file {} line {}: {:?} {:?} {:?} {:?}",
                row.file, row.line, row.status, row.reason, row.after_mm, row.sigma_mm
            );
        }
        let _ = writeln!(out, "{}", line("rapid", &shown.tally, 0.0));
        for disagreement in &shown.tally.disagreements {
            let _ = writeln!(out, "{disagreement}");
        }
    }
    if dialect != Dialect::Rapid {
        let shown = crate::nc::shown(dialect, seed, &features.arm(seed), Default::default());
        let corrected = shown.corrected.unwrap_or_else(|error| error);
        let _ = writeln!(out, "---- original\n{}\n---- corrected\n{corrected}", shown.original);
        let _ = writeln!(out, "{}", line(dialect.name(), &shown.tally, 0.0));
        for disagreement in &shown.tally.disagreements {
            let _ = writeln!(out, "{disagreement}");
        }
    }
    out
}

/// Counts in a line.
pub fn line(name: &str, tally: &Tally, seconds: f64) -> String {
    format!(
        "{name}: {} programs, {} motions run, {} corrected, {} left, {} refused, {} out of reach, {} open, {} on a guess that is \
         flagged, {} within what is stated, {} disagreements, {seconds:.1} s",
        tally.programs,
        tally.executed,
        tally.corrected,
        tally.left,
        tally.refused,
        tally.unreachable,
        tally.open,
        tally.guessed,
        tally.stated,
        tally.disagreements.len()
    )
}

/// How many disagreements of each kind.
pub fn kinds(tally: &Tally) -> String {
    let mut kinds: BTreeMap<&str, usize> = BTreeMap::new();
    tally.disagreements.iter().for_each(|d| *kinds.entry(d.kind).or_default() += 1);
    let list: Vec<String> = kinds.iter().map(|(kind, count)| format!("{kind} {count}")).collect();
    if list.is_empty() { "no disagreement".to_owned() } else { format!("disagreements: {}", list.join(", ")) }
}
