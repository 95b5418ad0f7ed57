//! The verdict in sentences that a careful statistician would sign.

use super::methods::name_of;
use crate::comparison::protocol::Study;
use crate::comparison::verdict::{Comparison, Conclusion, Test};
use crate::report::number::Precision;

/// A p value as people read it.
pub(super) fn p(value: f64) -> String {
    if value < 1e-4 { "< 0.0001".to_owned() } else { Precision::Significant(2).format(value) }
}

/// A few words for a table.
pub(super) fn conclusion(comparison: &Comparison, reference: &str) -> String {
    match &comparison.conclusion {
        Conclusion::ReferenceBetter => format!("{reference} better"),
        Conclusion::MethodBetter => format!("{} better", comparison.id),
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

/// One sentence for each comparison, and what limits them all.
pub(super) fn sentences(study: &Study) -> Vec<String> {
    let judgement = &study.judgement;
    let reference = &judgement.reference;
    let mut out = Vec::new();
    let mut alike = Vec::new();
    for comparison in &judgement.comparisons {
        if comparison.conclusion == Conclusion::NotSignificant {
            alike.push(comparison.id.clone());
        } else {
            out.push(sentence(study, comparison, reference));
        }
    }
    if !alike.is_empty() {
        out.push(format!(
            "No significant difference to {reference} was found for {}: that is no proof that there is none.",
            alike.join(", ")
        ));
    }
    out.extend(treatments(study));
    if !judgement.can_be_significant {
        out.push(format!(
            "With {} cases and {} comparisons no difference could be significant at 5 %, whatever the figures.",
            judgement.cases,
            judgement.comparisons.len()
        ));
    }
    out.push(
        "All cases draw their rows from one file, so they are not independent: the signed-rank test takes them as if \
         they were, the t test is corrected for it, and a difference counts only where both find it after Holm's \
         correction."
            .to_owned(),
    );
    out
}

/// What separates printed from sound methods, where both are compared.
fn treatments(study: &Study) -> Option<String> {
    let of = |id: &str| study.results.iter().find(|r| r.method.id == id).map(|r| r.treatment);
    let reference = of(&study.judgement.reference)?;
    let others: Vec<&str> =
        study.results.iter().filter(|r| r.treatment != reference).map(|r| r.method.id.as_str()).collect();
    (!others.is_empty()).then(|| {
        format!(
            "{} solve another problem than {}: as printed the frames stay where a fit of the frames alone put them, rows are \
             not weighed and there are no priors; in sound form links and frames are found together. A difference between \
             the two kinds is one of the problem, not of the search.",
            others.join(", "),
            study.judgement.reference
        )
    })
}

fn sentence(study: &Study, comparison: &Comparison, reference: &str) -> String {
    let name = name_of(study, &comparison.id);
    let of = name_of(study, reference);
    let limited = &comparison.limited;
    match &comparison.conclusion {
        Conclusion::ReferenceBetter => format!(
            "{of} leaves {} mm less than {name}, in {} of {} cases: {}.",
            mm(limited.mean_mm),
            limited.reference_better,
            study.cases.len(),
            tests(limited)
        ),
        Conclusion::MethodBetter => format!(
            "{name} leaves {} mm less than {of}, in {} of {} cases: {}.",
            mm(-limited.mean_mm),
            limited.method_better,
            study.cases.len(),
            tests(limited)
        ),
        Conclusion::SameOptimum { stopped, was_significant } => {
            let before = if *was_significant {
                format!("differ significantly as limited ({}), but", tests(limited))
            } else {
                "do not differ significantly as limited, and".to_owned()
            };
            let why = match stopped.as_slice() {
                [] => "both had converged".to_owned(),
                [one] => format!("only {one} was stopped before it converged"),
                _ => "both were stopped before they converged".to_owned(),
            };
            format!("{name} and {of} {before} converge to the same errors: {why}.")
        }
        Conclusion::Diverged { cases } => {
            format!("{name} diverged in {cases} of {} cases and is not compared.", study.cases.len())
        }
        Conclusion::ReferenceDiverged { cases } => {
            format!(
                "{of} diverged in {cases} of {} cases: {name} is not compared with it.",
                study.cases.len()
            )
        }
        Conclusion::NotSignificant => String::new(),
    }
}

fn mm(value: f64) -> String {
    Precision::Significant(2).format(value)
}

fn tests(test: &Test) -> String {
    format!(
        "p = {} (signed rank), {} (t, corrected), both after Holm",
        p(test.signed_rank_holm),
        p(test.resampled_holm)
    )
}
