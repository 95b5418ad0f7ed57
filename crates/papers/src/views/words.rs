//! The verdict of a comparison of methods in sentences.

use super::study::{name_of, passes};
use crate::protocol::{MethodResult, Study};
use crate::verdict::{Comparison, Conclusion, LEVEL, Test};
use truegrind_report::number::Precision;

/// Formats a p value.
pub(super) fn p(value: f64) -> String {
    if value < 1e-4 { "< 0.0001".to_owned() } else { Precision::Significant(2).format(value) }
}

/// Whether one of the two tests finds a difference and the other does not: that is no finding, but not "no difference" either.
fn is_undecided(comparison: &Comparison) -> bool {
    comparison.conclusion == Conclusion::NotSignificant && comparison.limited.signed_rank_holm < LEVEL
}

/// Whether neither test finds a difference.
fn is_alike(comparison: &Comparison) -> bool {
    comparison.conclusion == Conclusion::NotSignificant && !is_undecided(comparison)
}

/// Short conclusion for a table.
pub(super) fn conclusion(comparison: &Comparison, reference: &str) -> String {
    match &comparison.conclusion {
        Conclusion::ReferenceBetter => format!("{reference} better"),
        Conclusion::MethodBetter => format!("{} better", comparison.id),
        Conclusion::NotSignificant if is_undecided(comparison) => "undecided: one of two tests".to_owned(),
        Conclusion::NotSignificant => "no significant difference".to_owned(),
        Conclusion::SameOptimum { stopped, .. } if stopped.is_empty() => "same optimum".to_owned(),
        Conclusion::SameOptimum { stopped, .. } => match stopped.as_slice() {
            [one] => format!("same optimum; {one} stopped"),
            _ => "same optimum; both stopped".to_owned(),
        },
        Conclusion::Diverged { cases } => format!("{} diverged in {cases}", comparison.id),
        Conclusion::ReferenceDiverged { cases } => format!("{reference} diverged in {cases}"),
    }
}

/// Counts of the conclusions, in one line.
pub(super) fn headline(study: &Study) -> String {
    let judgement = &study.judgement;
    let count =
        |fits: fn(&Conclusion) -> bool| judgement.comparisons.iter().filter(|c| fits(&c.conclusion)).count();
    let of = |fits: fn(&Comparison) -> bool| judgement.comparisons.iter().filter(|c| fits(c)).count();
    let groups = [
        (count(|c| matches!(c, Conclusion::ReferenceBetter)), "significantly worse"),
        (count(|c| matches!(c, Conclusion::MethodBetter)), "significantly better"),
        (count(|c| matches!(c, Conclusion::SameOptimum { .. })), "with the same optimum"),
        (of(is_alike), "without significant difference"),
        (of(is_undecided), "undecided, since only one of the two tests finds a difference"),
        (count(|c| matches!(c, Conclusion::Diverged { .. })), "diverged"),
        (
            count(|c| matches!(c, Conclusion::ReferenceDiverged { .. })),
            "not compared, since the reference diverged",
        ),
    ];
    let parts: Vec<String> =
        groups.iter().filter(|(n, _)| *n > 0).map(|(n, what)| format!("{n} {what}")).collect();
    format!(
        "Of {} methods compared with {}: {}",
        judgement.comparisons.len(),
        name_of(study, &judgement.reference),
        parts.join(", ")
    )
}

/// Significant differences, the order in the paper, the cheapest methods, and the effect of the treatment.
pub(super) fn answer(study: &Study) -> Vec<String> {
    let judgement = &study.judgement;
    let reference = &judgement.reference;
    let mut out: Vec<String> =
        judgement.comparisons.iter().filter_map(|c| of_difference(study, c, reference)).collect();
    out.extend(papers_order(study));
    out.extend(cheapest(study));
    out.extend(treatments(study));
    if !judgement.can_be_significant {
        out.push(format!(
            "With {} cases and {} comparisons no difference could be significant at 5 %, whatever its size.",
            judgement.cases,
            judgement.comparisons.len()
        ));
    }
    out
}

/// Caveats of the comparisons: methods with the same optimum, diverged and undecided methods, and the limits of the tests.
pub(super) fn reservations(study: &Study) -> Vec<String> {
    let judgement = &study.judgement;
    let reference = &judgement.reference;
    let mut out = same_optimum(study);
    out.extend(diverged(study));
    let of = |fits: fn(&Comparison) -> bool| judgement.comparisons.iter().filter(move |c| fits(c)).collect();
    let (by_ranks, alike): (Vec<&Comparison>, Vec<&Comparison>) = (of(is_undecided), of(is_alike));
    if !by_ranks.is_empty() {
        let each: Vec<String> =
            by_ranks.iter().map(|c| format!("{} ({} mm)", c.id, mm(c.limited.mean_mm))).collect();
        out.push(format!(
            "Undecided: {} against {reference}. The signed-rank test, which assumes independent cases, finds a \
             difference; the t test, which allows for their common rows, does not.",
            each.join(", ")
        ));
    }
    if !alike.is_empty() {
        out.push(format!(
            "No significant difference from {reference} was found for {}; this does not prove that there is none.",
            ids(&alike)
        ));
    }
    out.extend(once_converged(study));
    out.push(
        "All cases draw their rows from one file, so they are not independent. The signed-rank test assumes that they \
         are, the t test is corrected for it; a difference counts only if both find it after Holm's correction."
            .to_owned(),
    );
    out
}

fn ids(comparisons: &[&Comparison]) -> String {
    comparisons.iter().map(|c| c.id.as_str()).collect::<Vec<_>>().join(", ")
}

/// Methods with the reference's optimum, grouped by whether they differ as limited and by which of method and reference
/// was stopped.
struct Alike<'a> {
    was_significant: bool,
    stopped: [bool; 2],
    methods: Vec<&'a Comparison>,
}

/// One sentence for each group of methods with the reference's optimum.
fn same_optimum(study: &Study) -> Vec<String> {
    let reference = &study.judgement.reference;
    let mut groups: Vec<Alike<'_>> = Vec::new();
    for comparison in &study.judgement.comparisons {
        let Conclusion::SameOptimum { stopped, was_significant } = &comparison.conclusion else { continue };
        let was_significant = *was_significant;
        let stopped = [stopped.contains(&comparison.id), stopped.contains(reference)];
        match groups.iter_mut().find(|g| g.was_significant == was_significant && g.stopped == stopped) {
            Some(group) => group.methods.push(comparison),
            None => groups.push(Alike { was_significant, stopped, methods: vec![comparison] }),
        }
    }
    let sentence = |group: &Alike<'_>| {
        let (significant, of) = (group.was_significant, &group.methods);
        let before = match (significant, of.as_slice()) {
            (true, [one]) => format!("differ significantly as limited ({})", tests(&one.limited)),
            (true, _) => "differ significantly as limited".to_owned(),
            (false, _) => "do not differ significantly as limited".to_owned(),
        };
        let reason = match group.stopped {
            [false, false] => "all had converged".to_owned(),
            [true, false] => format!("{} stopped before they converged, {reference} was not", were(of)),
            [false, true] => format!("only {reference} was stopped before it converged"),
            [true, true] => "all were stopped before they converged".to_owned(),
        };
        let and = if significant { "but" } else { "and" };
        format!("{} and {reference} {before}, {and} end at the same errors: {reason}.", ids(of))
    };
    groups.iter().map(sentence).collect()
}

fn were(of: &[&Comparison]) -> String {
    format!("{} {}", ids(of), if of.len() == 1 { "was" } else { "were" })
}

/// Methods without a result in some cases.
fn diverged(study: &Study) -> Option<String> {
    let of = |c: &Comparison| match c.conclusion {
        Conclusion::Diverged { cases } => Some(format!("{} ({cases} of {})", c.id, study.cases.len())),
        _ => None,
    };
    let all: Vec<String> = study.judgement.comparisons.iter().filter_map(of).collect();
    (!all.is_empty()).then(|| format!("Diverged and not compared, with the cases: {}.", all.join(", ")))
}

/// Methods that differ significantly from the reference after convergence.
fn once_converged(study: &Study) -> Option<String> {
    let reference = &study.judgement.reference;
    let real = |c: &&Comparison| c.converged.as_ref().is_some_and(Test::is_significant);
    let each: Vec<String> = study
        .judgement
        .comparisons
        .iter()
        .filter(real)
        .filter_map(|c| Some(format!("{} ({} mm)", c.id, signed_mm(c.converged.as_ref()?.mean_mm))))
        .collect();
    (!each.is_empty()).then(|| {
        format!("After convergence these differ significantly from {reference}: {}.", each.join(", "))
    })
}

/// Whether the paper's best method is also best here.
fn papers_order(study: &Study) -> Option<String> {
    let printed = |id: &str| {
        let result = study.results.iter().find(|r| r.method.id == id)?;
        result.method.paper?.rmse_mm
    };
    let all = || study.results.iter().filter_map(|r| Some((r, r.method.paper?.rmse_mm?)));
    let (best, least) = all().min_by(|a, b| a.1.total_cmp(&b.1))?;
    let id = &best.method.id;
    let failed = best.outcomes.iter().filter(|o| o.diverged).count();
    if failed > 0 {
        return Some(format!(
            "The paper has {id} first, with {least} mm. As printed, with the settings used here, it diverged in {failed} of \
             {} cases: the printed description does not reproduce its rank.",
            study.cases.len()
        ));
    }
    if *id != study.judgement.reference {
        return None;
    }
    let of = |fits: fn(&Comparison) -> bool| -> Vec<&Comparison> {
        let judged = study.judgement.comparisons.iter();
        judged.filter(|c| printed(&c.id).is_some() && fits(c)).collect()
    };
    let mut parts = Vec::new();
    let mut part = |found: &[&Comparison], what: &str| {
        if !found.is_empty() {
            parts.push(format!("{what} {}", ids(found)));
        }
    };
    part(&of(|c| matches!(c.conclusion, Conclusion::ReferenceBetter)), "this is significant against");
    part(&of(|c| matches!(c.conclusion, Conclusion::MethodBetter)), "the opposite is significant for");
    part(
        &of(|c| is_alike(c) || matches!(c.conclusion, Conclusion::SameOptimum { .. })),
        "there is no significant difference from",
    );
    part(&of(is_undecided), "one of the two tests finds a difference, the other does not, against");
    Some(format!("The paper has {id} before all others. Here {}.", parts.join("; ")))
}

/// The methods with the least cost among those not shown to be worse than the reference.
fn cheapest(study: &Study) -> Option<String> {
    let reference = &study.judgement.reference;
    let comparison = |id: &str| {
        let of = |c: &&Comparison| c.id == id;
        study.judgement.comparisons.iter().find(of)
    };
    let any_better = study
        .results
        .iter()
        .any(|r| comparison(&r.method.id).is_some_and(|c| c.conclusion == Conclusion::MethodBetter));
    let is_not_worse = |r: &&MethodResult| match comparison(&r.method.id) {
        None => !any_better && r.outcomes.iter().all(|o| !o.diverged),
        Some(c) if c.conclusion == Conclusion::MethodBetter => true,
        Some(c) => !any_better && (is_alike(c) || matches!(c.conclusion, Conclusion::SameOptimum { .. })),
    };
    let mut left: Vec<(&str, f64)> = study
        .results
        .iter()
        .filter(is_not_worse)
        .map(|r| {
            let (residuals, jacobians) = passes(study, r);
            (r.method.id.as_str(), residuals + jacobians)
        })
        .collect();
    left.sort_by(|a, b| a.1.total_cmp(&b.1));
    let each: Vec<String> = left.iter().take(3).map(|(id, n)| format!("{id} ({n:.0})")).collect();
    let which = if any_better { "significantly better" } else { "that neither test finds worse" };
    (!each.is_empty()).then(|| {
        format!(
            "Of the methods {which} than {reference}, these need the fewest passes over the rows: {}.",
            each.join(", ")
        )
    })
}

/// The difference between printed and sound treatment, where both are compared.
fn treatments(study: &Study) -> Option<String> {
    let of = |id: &str| study.results.iter().find(|r| r.method.id == id).map(|r| r.treatment);
    let reference = of(&study.judgement.reference)?;
    let others: Vec<&str> =
        study.results.iter().filter(|r| r.treatment != reference).map(|r| r.method.id.as_str()).collect();
    (!others.is_empty()).then(|| {
        format!(
            "{} solve another problem than {}: as printed, the frames are fixed by a fit of the frames alone, rows are \
             unweighted and there are no priors; in sound form links and frames are fitted together. A difference between \
             the two kinds is due to the problem, not to the search.",
            others.join(", "),
            study.judgement.reference
        )
    })
}

/// Sentence for a significant difference.
fn of_difference(study: &Study, comparison: &Comparison, reference: &str) -> Option<String> {
    let test = &comparison.limited;
    let (better, worse, in_cases, mean) = match comparison.conclusion {
        Conclusion::ReferenceBetter => {
            (reference, comparison.id.as_str(), test.reference_better, test.mean_mm)
        }
        Conclusion::MethodBetter => (comparison.id.as_str(), reference, test.method_better, -test.mean_mm),
        _ => return None,
    };
    Some(format!(
        "{} has an RMSE {} mm below that of {}, and is better in {in_cases} of {} cases.",
        name_of(study, better),
        mm(mean),
        name_of(study, worse),
        study.cases.len(),
    ))
}

fn mm(value: f64) -> String {
    Precision::Significant(2).format(value)
}

fn signed_mm(value: f64) -> String {
    format!("{}{}", if value > 0.0 { "+" } else { "" }, mm(value))
}

fn tests(test: &Test) -> String {
    format!(
        "p = {} (signed rank), {} (t, corrected), both after Holm",
        p(test.signed_rank_holm),
        p(test.resampled_holm)
    )
}
