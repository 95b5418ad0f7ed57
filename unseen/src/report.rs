//! All runs, and their table.

use std::collections::BTreeMap;
use std::fmt::Write as _;
use std::sync::Mutex;
use std::sync::atomic::{AtomicUsize, Ordering};

use crate::case::{Case, Limits};
use crate::file::Trials;
use crate::score::{Marks, Outcome, WORSE, outcome};
use crate::stability::{Change, Stability, stability};
use crate::statistics::{is_near, quantile, wilson};
use crate::truth::{Family, Kind, Mark, Meaning};
use crate::under_test::{Finding, Written};

/// What is run.
#[derive(Debug, Clone, PartialEq)]
pub struct Plan {
    /// Kinds, in turn.
    pub kinds: Vec<Kind>,
    /// Runs in all.
    pub runs: usize,
    /// Number of the first run.
    pub first: usize,
    /// Seed.
    pub seed: u64,
    /// Limits of the cases.
    pub limits: Limits,
    /// Workers. Each has one thread for its diagnoses; a single worker has all there are.
    pub workers: usize,
}

impl Plan {
    /// The case of run `index`: kinds in turn. It depends on nothing but kind, its number among its kind, and seed.
    pub fn case(&self, index: usize) -> Case {
        let kind = self.kinds[index % self.kinds.len()];
        Case::draw(self.seed, kind, (index / self.kinds.len()) as u64, self.limits)
    }

    /// Does `work` on every run; the results stand in the order of the runs, whatever the number of workers.
    pub fn over<T: Send>(&self, work: impl Fn(&Case) -> T + Sync, tell: impl Fn(usize, &T) + Sync) -> Vec<T> {
        let next = AtomicUsize::new(self.first);
        let done: Mutex<BTreeMap<usize, T>> = Mutex::new(BTreeMap::new());
        let end = self.first + self.runs;
        let take = || {
            loop {
                let index = next.fetch_add(1, Ordering::Relaxed);
                if index >= end {
                    return;
                }
                let result = work(&self.case(index));
                tell(index, &result);
                if let Ok(mut done) = done.lock() {
                    done.insert(index, result);
                }
            }
        };
        if self.workers <= 1 {
            take();
        } else {
            std::thread::scope(|scope| {
                for _ in 0..self.workers {
                    // A pool of its own: with one for all, a worker that waits would take up another run, whose time
                    // would be counted twice.
                    scope.spawn(|| match rayon::ThreadPoolBuilder::new().num_threads(1).build() {
                        Ok(pool) => pool.install(take),
                        Err(_) => take(),
                    });
                }
            });
        }
        done.into_inner().unwrap_or_default().into_values().collect()
    }

    /// Marks of every run.
    pub fn outcomes(&self, tell: impl Fn(usize, &Outcome) + Sync) -> Vec<Outcome> {
        self.over(outcome, tell)
    }

    /// Stability of every run.
    pub fn stabilities(&self, tell: impl Fn(usize, &Stability) + Sync) -> Vec<Stability> {
        self.over(stability, tell)
    }
}

/// One line on one run.
pub fn line(index: usize, outcome: &Outcome) -> String {
    let s = &outcome.setting;
    let mut out = format!(
        "{index:>4} {:<14} {:<20} {:<12} {:<7} {:>4} rows σ {:.3} mm, worth {:>4.1} σ",
        s.kind.name(),
        s.robot,
        s.measures.name(),
        s.design.name(),
        s.rows,
        s.sigma_mm,
        s.worth
    );
    if !s.joints.is_empty() {
        let _ = write!(out, ", joint {:?}", s.joints);
    }
    match &outcome.marks {
        Err(why) => {
            let _ = write!(out, ": refused: {why}");
        }
        Ok(marks) => {
            let [_, geometry, identified, model] = marks.distances;
            let _ = write!(
                out,
                ": {:.1} s, arm {:.4} (identify {:.4}) → {:.4} mm ± {:.4}{}, held out/fresh {:.2} (blocks {:.2}, regions {:.2}){}",
                marks.seconds,
                geometry.shape,
                identified.shape,
                model.shape,
                marks.shape_sigma_mm.unwrap_or(f64::NAN),
                if marks.worse()[0] { " WORSE" } else { "" },
                marks.held_out_mm / marks.fresh_mm,
                marks.blocks_mm / marks.fresh_mm,
                marks.regions_mm / marks.fresh_mm,
                match marks.written {
                    Written::Yes => "",
                    Written::Doubtful => ", doubtful",
                    Written::No => ", not written",
                }
            );
            for told in &marks.findings {
                let sign = match told.mark {
                    Mark::True => '+',
                    Mark::None => ' ',
                    Mark::WrongFamily | Mark::WrongJoint => '-',
                };
                let sure = if told.finding.identified { "" } else { "?" };
                let _ = write!(out, "\n       {sign} {}{sure}", told.finding.effect);
                if let Meaning::Cause(family) = told.says
                    && told.finding.effect == "thermal-drift"
                    && family != Family::Thermal
                {
                    let _ = write!(out, " of {family:?}");
                }
                if let Some(joints) = &told.finding.joints {
                    let _ = write!(out, " {joints:?}");
                }
                if let Some([from, to]) = told.finding.rows {
                    let _ = write!(out, " rows {from} to {to}");
                }
            }
        }
    }
    out
}

fn percent(hits: usize, all: usize) -> String {
    if all == 0 { "–".to_owned() } else { format!("{:.0}", 100.0 * hits as f64 / all as f64) }
}

fn bounded(hits: usize, all: usize) -> String {
    let (low, high) = wilson(hits, all);
    if all == 0 {
        return "– of 0".to_owned();
    }
    let share = 100.0 * hits as f64 / all as f64;
    format!("{hits} of {all}, {share:.1} % ({:.1} to {:.1})", 100.0 * low, 100.0 * high)
}

/// The mean of probabilities, in percent.
fn percent_of(probabilities: &[f64]) -> String {
    format!("{:.1} %", 100.0 * probabilities.iter().sum::<f64>() / probabilities.len().max(1) as f64)
}

fn number(value: Option<f64>, digits: usize) -> String {
    value.map_or_else(|| "–".to_owned(), |v| format!("{v:.digits$}"))
}

/// The table of all runs.
pub fn table(plan: &Plan, outcomes: &[Outcome]) -> String {
    let mut out = format!(
        "{} runs from {}, seed {}, at most {} rows; false: identified names of another family or of a joint that has nothing\n\n",
        plan.runs, plan.first, plan.seed, plan.limits.rows
    );
    let _ = writeln!(
        out,
        "{:<15}{:>5}{:>7}{:>8}{:>7}{:>7}{:>7}{:>7}{:>8}{:>9}{:>9}{:>9}{:>7}{:>20}{:>8}{:>8}",
        "kind",
        "runs",
        "worth",
        "false/r",
        "any %",
        "true/r",
        "told %",
        "worse",
        "written",
        "sheet",
        "geom.",
        "model",
        "as is",
        "held out / fresh",
        "±10 %",
        "s"
    );
    for kind in Kind::ALL {
        let of: Vec<&Outcome> = outcomes.iter().filter(|o| o.setting.kind == kind).collect();
        if !of.is_empty() {
            out.push_str(&row(kind.name(), &of));
        }
    }
    let all: Vec<&Outcome> = outcomes.iter().collect();
    out.push_str(&row("all", &all));
    out.push_str(&marks_in_words(&all));
    out.push_str(&names(outcomes));
    out
}

fn row(name: &str, of: &[&Outcome]) -> String {
    let marks: Vec<&Marks> = of.iter().filter_map(|o| o.marks.as_ref().ok()).collect();
    let n = marks.len().max(1) as f64;
    let count = |test: &dyn Fn(&Marks) -> bool| marks.iter().filter(|m| test(m)).count();
    let middle =
        |value: &dyn Fn(&Marks) -> f64| quantile(&marks.iter().map(|m| value(m)).collect::<Vec<_>>(), 0.5);
    let ratios: Vec<f64> = marks.iter().map(|m| m.held_out_mm / m.fresh_mm).collect();
    let falses: usize = marks.iter().map(|m| m.false_names().count()).sum();
    let trues: usize = marks.iter().map(|m| m.true_names()).sum();
    let worth: Vec<f64> = of.iter().map(|o| o.setting.worth).collect();
    let parts: Vec<&&Outcome> = of.iter().filter(|o| o.setting.kind.has_a_part()).collect();
    let told = parts.iter().filter(|o| o.marks.as_ref().is_ok_and(Marks::told)).count();
    format!(
        "{name:<15}{:>5}{:>7}{:>8.2}{:>7}{:>7.2}{:>7}{:>7}{:>8}{:>9}{:>9}{:>9}{:>7}{:>20}{:>8}{:>8}\n",
        of.len(),
        number(quantile(&worth, 0.5), 1),
        falses as f64 / n,
        percent(count(&|m| m.false_names().next().is_some()), marks.len()),
        trues as f64 / n,
        percent(told, parts.len()),
        percent(count(&|m| m.worse()[0]), marks.len()),
        percent(count(&|m| m.written == Written::Yes), marks.len()),
        number(middle(&|m| m.distances[0].shape), 4),
        number(middle(&|m| m.distances[1].shape), 4),
        number(middle(&|m| m.distances[3].shape), 4),
        percent(count(&|m| m.worse()[1]), marks.len()),
        [0.25, 0.5, 0.75].map(|q| number(quantile(&ratios, q), 2)).join(" "),
        percent(near(&ratios), ratios.len()),
        number(middle(&|m| m.seconds), 1),
    )
}

fn near(ratios: &[f64]) -> usize {
    ratios.iter().filter(|ratio| is_near(ratio)).count()
}

fn marks_in_words(of: &[&Outcome]) -> String {
    let marks: Vec<&Marks> = of.iter().filter_map(|o| o.marks.as_ref().ok()).collect();
    let n = marks.len();
    let count = |test: &dyn Fn(&Marks) -> bool| marks.iter().filter(|m| test(m)).count();
    let falses: usize = marks.iter().map(|m| m.false_names().count()).sum();
    let joints = marks.iter().flat_map(|m| m.false_names()).filter(|m| m.mark == Mark::WrongJoint).count();
    let trues: usize = marks.iter().map(|m| m.true_names()).sum();
    let parts = of.iter().filter(|o| o.setting.kind.has_a_part());
    let told = parts.clone().filter(|o| o.marks.as_ref().is_ok_and(Marks::told)).count();
    let on_blocks: Vec<f64> = marks.iter().map(|m| m.blocks_mm / m.fresh_mm).collect();
    let in_regions: Vec<f64> = marks.iter().map(|m| m.regions_mm / m.fresh_mm).collect();
    let held: Vec<f64> = marks.iter().map(|m| m.held_out_mm / m.fresh_mm).collect();
    let by_chance: Vec<f64> = marks.iter().map(|m| m.near_by_chance).collect();
    let seconds: Vec<f64> = marks.iter().map(|m| m.seconds).collect();
    let surely = parts.clone().filter(|o| o.marks.as_ref().is_ok_and(|m| m.true_names() > 0)).count();
    let jointed: Vec<_> = parts.clone().filter(|o| !o.setting.joints.is_empty()).collect();
    let at_joint = jointed.iter().filter(|o| o.marks.as_ref().is_ok_and(Marks::told_with_joint)).count();
    let doubtful = marks.iter().map(|m| m.doubtful_names()).fold((0, 0), |a, b| (a.0 + b.0, a.1 + b.1));
    let over = |k: usize| marks.iter().map(|m| m.fresh_over_noise[k]).collect::<Vec<f64>>();
    let written = |m: &Marks| m.written == Written::Yes;
    let said = marks.iter().filter(|m| written(m));
    let said: Vec<f64> = said.filter_map(|m| Some(m.distances[3].shape / m.shape_sigma_mm?)).collect();
    let quartiles = |v: &[f64]| [0.25, 0.5, 0.75].map(|q| number(quantile(v, q), 3)).join(", ");
    let percent_worse = 100.0 * (WORSE - 1.0);
    [
        format!("false identified names a run: {:.3} ({falses}, of them {joints} of the true family at a wrong joint)", falses as f64 / n.max(1) as f64),
        format!("runs with any: {}", bounded(count(&|m| m.false_names().next().is_some()), n)),
        format!("identified names that are true: {}", bounded(trues, trues + falses)),
        format!("true family told, where there is a part: {}", bounded(told, parts.clone().count())),
        format!("  without a doubt: {}", bounded(surely, parts.count())),
        format!("  with its joint, where a joint has it: {}", bounded(at_joint, jointed.len())),
        format!("names told with a doubt: {} a run, {} of {} false", number(Some(doubtful.0 as f64 / n.max(1) as f64), 2), doubtful.1, doubtful.0),
        format!("arm's model worse in shape than geometry alone by more than {percent_worse:.0} %: {}", bounded(count(&|m| m.worse()[0]), n)),
        format!("  as it stands: {}", bounded(count(&|m| m.worse()[1]), n)),
        format!("  of those that -o writes, in shape: {}", bounded(count(&|m| written(m) && m.worse()[0]), count(&written))),
        format!("  the same beside geometry as identify writes it: {}", bounded(count(&|m| written(m) && m.worse_than_identify()), count(&written))),
        format!("error of shape over what a written model file says of it: median {}, nine in ten below {}", number(quantile(&said, 0.5), 2), number(quantile(&said, 0.9), 2)),
        format!("  not written but with --allow-doubtful: {}, not at all: {}", bounded(count(&|m| m.written == Written::Doubtful), n), bounded(count(&|m| m.written == Written::No), n)),
        format!("held-out error over that of fresh rows, quartiles: random folds {} (within 10 %: {})", quartiles(&held), bounded(near(&held), n)),
        format!("  within 10 % as chance alone would have it: {}", percent_of(&by_chance)),
        format!("  blocks {} (within 10 %: {})", quartiles(&on_blocks), bounded(near(&on_blocks), n)),
        format!("  regions {} (within 10 %: {})", quartiles(&in_regions), bounded(near(&in_regions), n)),
        format!("fresh rows over the noise, quartiles: geometry alone {}; with causes {}", quartiles(&over(0)), quartiles(&over(1))),
        format!("time: median {} s, nine in ten below {} s, longest {} s", number(quantile(&seconds, 0.5), 1), number(quantile(&seconds, 0.9), 1), number(quantile(&seconds, 1.0), 1)),
        format!("refused: {}", bounded(of.len() - n, of.len())),
    ]
    .iter()
    .fold(String::from("\n"), |out, line| out + line + "\n")
}

/// Which names were false, and which nobody knows.
fn names(outcomes: &[Outcome]) -> String {
    let mut counts: BTreeMap<(&str, &str), usize> = BTreeMap::new();
    let mut unknown: BTreeMap<&str, usize> = BTreeMap::new();
    for o in outcomes {
        let Ok(marks) = &o.marks else { continue };
        for told in marks.false_names() {
            *counts.entry((told.finding.effect.as_str(), o.setting.kind.name())).or_default() += 1;
        }
        for told in &marks.findings {
            if told.says == Meaning::Unknown {
                *unknown.entry(told.finding.effect.as_str()).or_default() += 1;
            }
        }
    }
    let mut by_name: BTreeMap<&str, Vec<(usize, &str)>> = BTreeMap::new();
    for ((name, kind), count) in counts {
        by_name.entry(name).or_default().push((count, kind));
    }
    let mut out = String::from("\nfalse names, and in which runs\n");
    for (name, mut kinds) in by_name {
        kinds.sort_by(|a, b| b.cmp(a));
        let total: usize = kinds.iter().map(|k| k.0).sum();
        let list: Vec<String> = kinds.iter().map(|(count, kind)| format!("{kind} {count}")).collect();
        let _ = writeln!(out, "  {name:<20}{total:>5}  {}", list.join(", "));
    }
    for (name, count) in unknown {
        let _ = writeln!(
            out,
            "  the table of names (truth.rs) has no {name}, told {count} times and counted as false"
        );
    }
    out
}

/// The table of stability.
pub fn stability_table(plan: &Plan, all: &[Stability]) -> String {
    let mut out = format!(
        "stability, {} runs from {}, seed {}: identified findings the same, rows that overlap by four in five\n",
        plan.runs, plan.first, plan.seed
    );
    let with: Vec<&Stability> = all.iter().filter(|s| s.refused.is_none()).collect();
    for change in Change::ALL {
        let of: Vec<(&&Stability, bool)> = with
            .iter()
            .flat_map(|s| s.changed.iter().filter(|c| c.0 == change).map(move |c| (s, c.2)))
            .collect();
        let alike = |test: &dyn Fn(&Stability) -> bool| {
            let some: Vec<bool> = of.iter().filter(|(s, _)| test(s)).map(|(_, same)| *same).collect();
            bounded(some.iter().filter(|same| **same).count(), some.len())
        };
        let _ = writeln!(
            out,
            "  {:<32}{}; where anything was identified: {}",
            change.name(),
            alike(&|_| true),
            alike(&|s| !s.plain.is_empty())
        );
    }
    let _ = writeln!(out, "  refused: {}", all.len() - with.len());
    out
}

/// Findings in one line: names, joints and rows, with a question mark where there is a doubt.
pub fn listed(findings: &[Finding]) -> String {
    let name = |f: &Finding| {
        let at = f.joints.as_ref().map(|j| format!("{j:?}")).unwrap_or_default();
        let rows = f.rows.map(|r| format!("{r:?}")).unwrap_or_default();
        format!("{}{}{at}{rows}", f.effect, if f.identified { "" } else { "?" })
    };
    findings.iter().map(name).collect::<Vec<_>>().join(" ")
}

/// What becomes of a file's findings under changes.
pub fn trials_table(trials: &Trials) -> String {
    let mut out = format!("as it is: {}\n", listed(&trials.plain));
    for (change, (count, others)) in &trials.changed {
        let _ = writeln!(out, "  {:<32}{}", change.name(), bounded(count - others.len(), *count));
    }
    out
}

/// One line on the stability of one run.
pub fn stability_line(index: usize, run: &Stability) -> String {
    let s = &run.setting;
    let mut out = format!(
        "{index:>4} {:<14} {:<12} {:<7} {:>4} rows",
        s.kind.name(),
        s.measures.name(),
        s.design.name(),
        s.rows
    );
    if let Some(why) = &run.refused {
        let _ = write!(out, ": refused: {why}");
    }
    for (change, findings, same) in &run.changed {
        if *same {
            let _ = write!(out, "; {}: same", change.name());
        } else {
            let _ = write!(
                out,
                "\n       {}\n         as it is: {}\n         changed:  {}",
                change.name(),
                listed(&run.plain),
                listed(findings)
            );
        }
    }
    out
}
