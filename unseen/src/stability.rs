//! Whether the same rows give the same findings when nothing that matters is changed.

use rand::{Rng, RngExt};

use crate::case::Case;
use crate::draw::Purpose;
use crate::score::{Setting, setting};
use crate::table::{Line, text};
use crate::truth::{Kind, Meaning, meanings};
use crate::under_test::{Finding, Reply, diagnosed};

/// A change that should change nothing.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub enum Change {
    /// Every number rounded at its eighth decimal.
    Rounded,
    /// One row left out.
    OneLess,
    /// Lines of the same pose in another order among themselves.
    Shuffled,
}

impl Change {
    /// All of them.
    pub const ALL: [Change; 3] = [Change::Rounded, Change::OneLess, Change::Shuffled];

    /// Name in tables.
    pub fn name(self) -> &'static str {
        match self {
            Change::Rounded => "rounded at the eighth decimal",
            Change::OneLess => "one row left out",
            Change::Shuffled => "shuffled within repeats",
        }
    }

    /// Whether it changes nothing that matters: which reading of a pose came first is told by an arm that had not settled.
    pub fn is_idle(self, kind: Kind) -> bool {
        self != Change::Shuffled || kind != Kind::Unsettled
    }

    /// The changed rows, and to how many decimals they are written; `None` where the change needs repeats and there are none.
    pub fn of(self, lines: &[Line], rng: &mut impl Rng) -> Option<(Vec<Line>, Option<usize>)> {
        let mut out = lines.to_vec();
        match self {
            Change::Rounded => return Some((out, Some(8))),
            Change::OneLess => {
                out.remove(rng.random_range(0..lines.len()));
            }
            Change::Shuffled => {
                let mut from = 0;
                while from < out.len() {
                    let count = out[from..].iter().take_while(|line| line.q == lines[from].q).count();
                    // Times stay in order; readings, which are what repeats differ in, change places.
                    for k in (1..count).rev() {
                        let other = rng.random_range(0..=k);
                        let (a, b) = (out[from + k].reading, out[from + other].reading);
                        (out[from + k].reading, out[from + other].reading) = (b, a);
                    }
                    from += count;
                }
            }
        }
        (out != lines).then_some((out, None))
    }
}

/// What a run says of stability.
#[derive(Debug, Clone, PartialEq)]
pub struct Stability {
    /// What it was.
    pub setting: Setting,
    /// Identified causes of the rows as they are; that something is left without a name is none.
    pub plain: Vec<Finding>,
    /// Those after each change, and whether they are the same.
    pub changed: Vec<(Change, Vec<Finding>, bool)>,
    /// Why there was no diagnosis.
    pub refused: Option<String>,
}

fn identified(file: &str, robot: &str) -> Result<Vec<Finding>, String> {
    Ok(named(&diagnosed(file, robot)?))
}

/// Causes told without a doubt; that something is left without a name is none.
pub fn named(reply: &Reply) -> Vec<Finding> {
    let named = |f: &&Finding| f.identified && meanings(&f.effect, &f.parameters) != [Meaning::SomethingElse];
    reply.findings.iter().filter(named).cloned().collect()
}

/// Diagnoses a case as it is and after each change.
pub fn stability(case: &Case) -> Stability {
    let lines = case.lines();
    let mut rng = case.generator(Purpose::Variant);
    let mut out = Stability { setting: setting(case), plain: Vec::new(), changed: Vec::new(), refused: None };
    let mut of = |lines: &[Line], decimals: Option<usize>| {
        let found = identified(&text(case.sensor.kind, lines, decimals), case.sheet.name);
        found.map_err(|why| out.refused = Some(why)).unwrap_or_default()
    };
    let plain = of(&lines, None);
    let mut changed = Vec::new();
    for change in Change::ALL.into_iter().filter(|change| change.is_idle(case.kind())) {
        if let Some((lines, decimals)) = change.of(&lines, &mut rng) {
            let found = of(&lines, decimals);
            let alike = same(&plain, &found);
            changed.push((change, found, alike));
        }
    }
    (out.plain, out.changed) = (plain, changed);
    out
}

/// Whether two lists tell the same: names, joints, and rows that overlap by four in five, in any order.
pub fn same(a: &[Finding], b: &[Finding]) -> bool {
    let mut left: Vec<&Finding> = b.iter().collect();
    a.len() == b.len()
        && a.iter().all(|finding| {
            let place = left.iter().position(|other| alike(finding, other));
            place.is_some_and(|k| {
                left.remove(k);
                true
            })
        })
}

fn alike(a: &Finding, b: &Finding) -> bool {
    let rows = match (a.rows, b.rows) {
        (None, None) => true,
        (Some(a), Some(b)) => {
            let length = |from: usize, to: usize| (to + 1).saturating_sub(from) as f64;
            let both = length(a[0].max(b[0]), a[1].min(b[1]));
            both >= 0.8 * (length(a[0], a[1]) + length(b[0], b[1]) - both)
        }
        _ => false,
    };
    rows && a.effect == b.effect && a.joints == b.joints
}
