//! Whether a path may be run as it was corrected, in a sentence and with reasons.

use super::side::{AFTER, BEFORE, Side};
use super::words::{decimals, meaning};
use crate::document::Verdict;
use crate::status::Status;
use truegrind_compensation::deviation::{PathReport, Status as MotionStatus};

/// A path that was judged: its largest deviation (mm) as programmed and as rewritten.
type Judged<'a> = (&'a PathReport, f64, f64);

/// The verdict on one program under all models.
pub(super) fn verdict(reports: &[&PathReport]) -> Verdict {
    let count = |fate: MotionStatus| {
        reports.iter().map(|r| r.points.iter().filter(|p| p.status == fate).count()).max().unwrap_or(0)
    };
    let mut reasons = Vec::new();
    let mut status = Status::Good;
    for (fate, text) in [
        (MotionStatus::Refused, "refused: not rewritten, because that would be wrong or dangerous"),
        (MotionStatus::Flagged, "flagged: rewritten with a warning"),
    ] {
        let points = count(fate);
        if points > 0 {
            status = Status::Warning;
            reasons.push(format!("{points} {} {text}", if points == 1 { "point" } else { "points" }));
        }
    }
    let judged: Vec<Judged<'_>> = reports
        .iter()
        .filter_map(|report| Some((*report, largest(report, BEFORE)?, largest(report, AFTER)?)))
        .collect();
    for (report, before, after) in &judged {
        if after > before {
            status = if judged.iter().all(|(_, before, after)| after > before) {
                Status::Bad
            } else {
                Status::Warning
            };
            reasons.push(format!("{} makes the path worse: up to {}", report.model, known(Some(*after))));
        }
        // Under a model that corrects no cut there is no correction to be sure of.
        let corrects = report.cut().any(|p| !matches!(p.status, MotionStatus::Left));
        if !corrects {
            reasons.push(format!("under {} every cut stays as it is", report.model));
        } else if let (Some(sigma), Some(rms)) = (report.sigma_rms_mm(), before_rms(report))
            && sigma > rms
        {
            if status == Status::Good {
                status = Status::Warning;
            }
            reasons.push(format!(
                "under {} the predicted 1σ of {sigma:.3} mm exceeds the deviation that it corrects, {rms:.3} mm RMS: the \
                 model does not know enough here to say that the correction helps",
                report.model
            ));
        }
    }
    if judged.is_empty() && status == Status::Good {
        status = Status::NotEvaluated;
    }
    if judged.is_empty() && !reports.is_empty() {
        reasons.push(
            "`truegrind compensate` with the same model writes the program that takes out what the model knows of it; what \
             lies within the predicted 1σ it does not know"
                .to_owned(),
        );
    }
    Verdict::new(status, headline(reports, &judged), reasons)
}

/// From which deviation to which.
fn headline(reports: &[&PathReport], judged: &[Judged<'_>]) -> String {
    match judged {
        [] => {
            let worst = reports.iter().filter_map(|report| largest(report, BEFORE)).reduce(f64::max);
            format!("The path as it is deviates by up to {}; no rewritten path was judged", known(worst))
        }
        [(report, ..)] if report.expected_mm().is_some() => {
            // Sizes both: what is expected has no sign along a surface.
            let before = report.cut().filter_map(|p| p.before.map(|d| d.norm_mm())).reduce(f64::max);
            format!(
                "The largest deviation goes from {} to an expected {} (1σ); held-out error of the model {}",
                known(before),
                known(report.expected_mm()),
                known(report.held_out_mm),
            )
        }
        [(report, before, after)] => format!(
            "The largest deviation goes from {before:.3} mm to {after:.*} mm ({}); predicted 1σ {}, held-out error of the \
             model {}",
            decimals(report.after),
            meaning(report.after),
            known(report.sigma_rms_mm()),
            known(report.held_out_mm),
        ),
        [(first, ..), ..] => {
            let of = |pick: fn(&f64, &f64) -> std::cmp::Ordering| {
                judged.iter().map(|(report, _, after)| (after, report)).min_by(|a, b| pick(a.0, b.0))
            };
            let decimals = decimals(first.after);
            let under = |found: Option<(&f64, &&PathReport)>| match found {
                Some((after, report)) => format!("{after:.decimals$} mm under {}", report.model),
                None => known(None),
            };
            let before = judged.iter().map(|(_, before, _)| *before).fold(0.0, f64::max);
            format!(
                "The largest deviation goes from {before:.3} mm to {} at best, and to {} at worst ({})",
                under(of(|a, b| a.total_cmp(b))),
                under(of(|a, b| b.total_cmp(a))),
                meaning(first.after),
            )
        }
    }
}

/// The largest deviation of a path (mm).
fn largest(report: &PathReport, side: Side) -> Option<f64> {
    report.block(side).map(|block| block.all.max)
}

fn known(mm: Option<f64>) -> String {
    mm.map_or("not known".to_owned(), |mm| format!("{mm:.3} mm"))
}

/// Root mean square of the sizes of the deviations of the cut as programmed (mm).
fn before_rms(report: &PathReport) -> Option<f64> {
    let squares: Vec<f64> =
        report.cut().filter_map(|p| p.before.map(|d| d.vector_mm.norm_squared())).collect();
    (!squares.is_empty()).then(|| (squares.iter().sum::<f64>() / squares.len() as f64).sqrt())
}
