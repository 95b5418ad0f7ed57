//! Tables of a diagnosis.

use super::words::{AMBIGUOUS, confidence, place, place_of};
use crate::table::{Cell, Table};
use truegrind_arm::parameter::display_unit;
use truegrind_calibration::diagnosis::finding::{Diagnosis, Finding};

/// Errors of the models on other measurements of the same arm.
pub fn transfer_table(diagnosis: &Diagnosis) -> Table {
    Table::of("RMSE on other measurements of this arm, only the frames refitted", &diagnosis.transfers)
        .text("file", "file", |other| other.file.as_str())
        .count("rows", "rows", |other| other.rows)
        .number("nominal_rmse_mm", "data sheet", "mm", 3, |other| other.nominal_rmse_mm)
        .number("geometric_rmse_mm", "geometry", "mm", 3, |other| other.geometric_rmse_mm)
        .number("extended_rmse_mm", "all causes", "mm", 3, |other| other.extended_rmse_mm)
        .number("written_rmse_mm", "written arm", "mm", 3, |other| other.written_rmse_mm)
        .table()
}

/// Errors by stage.
pub fn stage_table(diagnosis: &Diagnosis) -> Table {
    let fits = &diagnosis.fits;
    Table::of(
        "Errors by stage",
        &[
            ("nominal: frames fitted", &fits.nominal),
            ("geometric: and links", &fits.geometric),
            ("extended: and causes", &fits.extended),
        ],
    )
    .text("stage", "stage", |(name, _)| *name)
    .number("rmse_mm", "RMSE", "mm", 3, |(_, stage)| stage.rmse_mm)
    .number("mean_mm", "mean", "mm", 3, |(_, stage)| stage.mean_mm)
    .number("max_mm", "max", "mm", 3, |(_, stage)| stage.max_mm)
    .number("cv_rmse_mm", "held out, random", "mm", 3, |(_, stage)| stage.cv_rmse_mm)
    .number("cv_blocks_rmse_mm", "held out, blocks", "mm", 3, |(_, stage)| stage.cv_blocks_rmse_mm)
    .number("cv_regions_rmse_mm", "held out, regions", "mm", 3, |(_, stage)| stage.cv_regions_rmse_mm)
.note("RMSE, mean and max on the rows of the fit. Held out: five random folds; contiguous blocks, which reveal drifts and jumps \
         along the rows; and eight regions of joint space, which show what to expect where no pose was measured nearby. identify holds out one share of the rows once: its figure scatters more.")
.table()
}

/// One row per finding.
pub fn finding_table(diagnosis: &Diagnosis) -> Table {
    Table::of("Findings", &diagnosis.findings)
        .text("effect", "effect", |finding| finding.effect.as_str())
        .text("where", "where", |finding| place(finding))
        .text("confidence", "confidence", |finding| confidence(finding))
        .number("worth_mm", "explains", "mm", 3, |finding| finding.worth_mm)
        .significant("p_value", "p", "", 2, |finding| p_value(finding.p_value))
        .number("cv_rmse_before_mm", "held out without", "mm", 4, |finding| finding.gain.cv_rmse_before_mm)
        .number("cv_rmse_after_mm", "held out with", "mm", 4, |finding| finding.gain.cv_rmse_after_mm)
.note("explains: the part of the readings that nothing else in the model explains, RMS over all rows. identified: better than its \
         alternatives, significant once smooth unmodelled trends are allowed for, and found again in halves of the rows.")
.note(AMBIGUOUS)
.table()
}

/// The causes that cannot be told apart.
pub(super) fn members(finding: &Finding) -> Table {
    Table::of("Causes that these rows cannot tell apart", &finding.members)
        .text("family", "family", |member| member.family.words())
        .text("effect", "effect", |member| member.effect.as_str())
        .text("where", "where", |member| place_of(member.effect, member.joints.as_deref(), member.rows))
        .number("share", "share", "%", 0, |member| 100.0 * member.share)
.note("share: of the evidence, if exactly one of these is true. It is not a probability: do not replace a part before the deciding \
         measurement.")
.table()
}

/// Row ranges of a set-up that changed with time.
pub(super) fn sessions(finding: &Finding) -> Table {
    Table::of("Sessions", &finding.sessions)
        .text("rows", "rows", |session| format!("{} to {}", session.rows[0], session.rows[1]))
        .text("what", "cause of a shift of these rows alone", |session| {
            session.shift.as_ref().unwrap_or(&session.cause).as_str()
        })
        .number("worth_mm", "explains", "mm", 3, |session| session.worth_mm)
        .table()
}

/// A p-value; pages state an underflowing one as a bound.
fn p_value(p: f64) -> Cell {
    if p < 1e-300 { Cell::Worded { value: p, shown: "< 1e-300".to_owned() } } else { p.into() }
}

pub(super) fn parameters(finding: &Finding) -> Table {
    // The knots of a map are shown as a plot.
    let shown = finding.parameters.iter().filter(|parameter| parameter.name != "knot");
    Table::of("Parameters", shown.map(|parameter| (parameter, display_unit(&parameter.unit))))
        .text("name", "parameter", |(parameter, _)| parameter.name.as_str())
        .significant("value", "value ± 1σ", "", 4, |(parameter, (scale, _))| {
            Cell::with_sigma(parameter.value * scale, parameter.sigma.map(|sigma| sigma * scale))
        })
        .text("unit", "unit", |(_, (_, unit))| *unit)
        .table()
}

pub(super) fn rivals(finding: &Finding) -> Table {
    Table::of("Alternatives fitted in its place", &finding.alternatives)
        .text("effect", "effect", |rival| rival.effect.as_str())
        .text("where", "where", |rival| place_of(rival.effect, rival.joints.as_deref(), rival.rows))
        .number("cv_rmse_mm", "held out", "mm", 4, |rival| rival.cv_rmse_mm)
        .number("beaten_by", "worse by", "2 ln Bayes factor", 1, |rival| rival.twice_log_bayes_factor)
        .table()
}

/// Effects that the data cannot decide.
pub fn not_testable_table(diagnosis: &Diagnosis) -> Table {
    Table::of("Not testable", &diagnosis.not_testable)
        .text("effect", "effect", |item| match &item.joints {
            Some(joints) => {
                format!("{}, {}", item.effect.words(), place_of(item.effect, Some(joints), None))
            }
            None => item.effect.words(),
        })
        .text("reason", "why", |item| item.reason.as_str())
        .text("remedy", "what would decide", |item| item.remedy.as_str())
        .table()
}

/// Name of a bar: the first two stages, then causes by number.
pub(super) fn step_name(index: usize) -> String {
    match index {
        0 => "S".to_owned(),
        1 => "G".to_owned(),
        n => format!("+ {}", n - 1),
    }
}

/// The steps of the diagnosis.
pub fn step_table(diagnosis: &Diagnosis) -> Table {
    Table::of("Steps", diagnosis.steps.iter().enumerate())
        .text("step", "step", |(index, _)| step_name(*index))
        .text("added", "added", |(_, step)| step.added.as_str())
        .number("cv_rmse_mm", "held out", "mm", 4, |(_, step)| step.cv_rmse_mm)
        .table()
}
