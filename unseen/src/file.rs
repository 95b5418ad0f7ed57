//! A file of somebody's measurement, and the same rows changed by nothing that matters.
//!
//! What a reading should be is not known here, so nothing is marked: the question is whether the same rows give the same findings.

use std::collections::BTreeMap;

use rand::{Rng, RngExt};

use crate::draw::{Purpose, generator};
use crate::stability::{Change, named, same};
use crate::under_test::{Finding, diagnosed};

/// A table of numbers, comma-separated, with a line of names.
#[derive(Debug, Clone, PartialEq)]
pub struct Table {
    names: Vec<String>,
    lines: Vec<Vec<String>>,
}

/// Names of columns that are read from a sensor.
fn is_reading(name: &str) -> bool {
    name == "L" || name.starts_with("measured")
}

/// Names of columns that hold angles.
fn is_joint(name: &str) -> bool {
    name.strip_prefix('q').is_some_and(|number| number.parse::<u8>().is_ok())
}

/// Half of the eighth decimal.
const HALF: f64 = 0.5e-8;

impl Table {
    /// Reads a file.
    pub fn read(text: &str) -> Self {
        let cells = |line: &str| line.split(',').map(|cell| cell.trim().to_owned()).collect::<Vec<_>>();
        let mut lines = text.lines().filter(|line| !line.trim().is_empty()).map(cells);
        Self { names: lines.next().unwrap_or_default(), lines: lines.collect() }
    }

    /// Rows.
    pub fn rows(&self) -> usize {
        self.lines.len()
    }

    /// The file again.
    pub fn text(&self) -> String {
        let all = std::iter::once(&self.names).chain(&self.lines);
        all.map(|line| line.join(",") + "\n").collect()
    }

    /// The changed rows; `None` where the change needs repeats and there are none. A file of fewer decimals cannot be rounded at the
    /// eighth: its angles and readings are moved by as much as that would do.
    pub fn changed(&self, change: Change, rng: &mut impl Rng) -> Option<Self> {
        let mut out = self.clone();
        match change {
            Change::Rounded => {
                for line in &mut out.lines {
                    let cells =
                        self.names.iter().zip(line).filter(|(name, _)| is_joint(name) || is_reading(name));
                    for (_, cell) in cells {
                        if let Ok(number) = cell.parse::<f64>() {
                            *cell = format!("{:.10}", number + rng.random_range(-HALF..HALF));
                        }
                    }
                }
            }
            Change::OneLess => {
                out.lines.remove(rng.random_range(0..self.lines.len()));
            }
            Change::Shuffled => {
                let reading: Vec<usize> =
                    (0..self.names.len()).filter(|&c| is_reading(&self.names[c])).collect();
                for rows in self.repeats() {
                    for k in (1..rows.len()).rev() {
                        let other = rows[rng.random_range(0..=k)];
                        for &c in &reading {
                            let (a, b) = (out.lines[rows[k]][c].clone(), out.lines[other][c].clone());
                            (out.lines[rows[k]][c], out.lines[other][c]) = (b, a);
                        }
                    }
                }
            }
        }
        (out != *self).then_some(out)
    }

    /// Rows that follow each other at one pose.
    fn repeats(&self) -> Vec<Vec<usize>> {
        let joints: Vec<usize> = (0..self.names.len()).filter(|&c| is_joint(&self.names[c])).collect();
        let pose = |i: usize| joints.iter().map(|&c| self.lines[i].get(c).cloned()).collect::<Vec<_>>();
        let mut out: Vec<Vec<usize>> = Vec::new();
        for i in 0..self.lines.len() {
            match out.last_mut() {
                Some(group) if pose(group[0]) == pose(i) => group.push(i),
                _ => out.push(vec![i]),
            }
        }
        out.into_iter().filter(|group| group.len() > 1).collect()
    }
}

/// A file under many changes.
#[derive(Debug, Clone, PartialEq)]
pub struct Trials {
    /// Identified causes of the rows as they are.
    pub plain: Vec<Finding>,
    /// Of each change how often it was tried, and the lists that were not the same.
    pub changed: BTreeMap<Change, (usize, Vec<Vec<Finding>>)>,
}

/// Diagnoses the rows as they are and `runs` times after changes, one kind after the other. `tell` hears of each.
///
/// # Errors
/// What the command line would say.
pub fn trials(
    table: &Table,
    robot: &str,
    (runs, seed): (usize, u64),
    tell: impl Fn(usize, Change, bool, &[Finding]),
) -> Result<Trials, String> {
    let plain = named(&diagnosed(&table.text(), robot)?);
    let mut changed: BTreeMap<Change, (usize, Vec<Vec<Finding>>)> = BTreeMap::new();
    for run in 0..runs {
        let change = Change::ALL[run % Change::ALL.len()];
        let mut rng = generator(seed, run as u64, 0, 0, Purpose::Variant);
        let Some(other) = table.changed(change, &mut rng) else { continue };
        let found = named(&diagnosed(&other.text(), robot)?);
        let alike = same(&plain, &found);
        tell(run, change, alike, &found);
        let entry = changed.entry(change).or_default();
        entry.0 += 1;
        if !alike {
            entry.1.push(found);
        }
    }
    Ok(Trials { plain, changed })
}
