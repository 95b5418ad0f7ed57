//! Tables of a diagnosis.

use super::words::{AMBIGUOUS, confidence, place, place_of};
use crate::table::{Cell, Column, Table};
use truegrind_arm::parameter::display_unit;
use truegrind_calibration::diagnosis::finding::{Diagnosis, Finding, FoundParameter};

/// Errors of the models on other measurements of the same arm.
pub fn transfer_table(diagnosis: &Diagnosis) -> Table {
    Table::of(
        "RMSE on other measurements of this arm, only the frames refitted",
        &diagnosis.transfers,
        [
            (Column::text("file", "file"), |other| other.file.as_str().into()),
            (Column::count("rows", "rows"), |other| other.rows.into()),
            (Column::number("nominal_rmse_mm", "data sheet", "mm", 3), |other| other.nominal_rmse_mm.into()),
            (Column::number("geometric_rmse_mm", "geometry", "mm", 3), |other| {
                other.geometric_rmse_mm.into()
            }),
            (Column::number("extended_rmse_mm", "all causes", "mm", 3), |other| {
                other.extended_rmse_mm.into()
            }),
            (Column::number("written_rmse_mm", "written arm", "mm", 3), |other| other.written_rmse_mm.into()),
        ],
    )
}

/// Errors by stage.
pub fn stage_table(diagnosis: &Diagnosis) -> Table {
    let fits = &diagnosis.fits;
    let mut table = Table::of(
        "Errors by stage",
        &[
            ("nominal: frames fitted", &fits.nominal),
            ("geometric: and links", &fits.geometric),
            ("extended: and causes", &fits.extended),
        ],
        [
            (Column::text("stage", "stage"), |(name, _)| (*name).into()),
            (Column::number("rmse_mm", "RMSE", "mm", 3), |(_, stage)| stage.rmse_mm.into()),
            (Column::number("mean_mm", "mean", "mm", 3), |(_, stage)| stage.mean_mm.into()),
            (Column::number("max_mm", "max", "mm", 3), |(_, stage)| stage.max_mm.into()),
            (Column::number("cv_rmse_mm", "held out, random", "mm", 3), |(_, stage)| stage.cv_rmse_mm.into()),
            (Column::number("cv_blocks_rmse_mm", "held out, blocks", "mm", 3), |(_, stage)| {
                stage.cv_blocks_rmse_mm.into()
            }),
            (Column::number("cv_regions_rmse_mm", "held out, regions", "mm", 3), |(_, stage)| {
                stage.cv_regions_rmse_mm.into()
            }),
        ],
    );
    table.notes.push(
        "RMSE, mean and max on the rows of the fit. Held out: five random folds; contiguous blocks, which reveal drifts and jumps \
         along the rows; and eight regions of joint space, which show what to expect where no pose was measured nearby. identify holds out one share of the rows once: its figure scatters more."
            .to_owned(),
    );
    table
}

/// One row per finding.
pub fn finding_table(diagnosis: &Diagnosis) -> Table {
    let mut table = Table::of(
        "Findings",
        &diagnosis.findings,
        [
            (Column::text("effect", "effect"), |finding| finding.effect.as_str().into()),
            (Column::text("where", "where"), |finding| place(finding).into()),
            (Column::text("confidence", "confidence"), |finding| confidence(finding).into()),
            (Column::number("worth_mm", "explains", "mm", 3), |finding| finding.worth_mm.into()),
            (Column::significant("p_value", "p", "", 2), |finding| p_value(finding.p_value)),
            (Column::number("cv_rmse_before_mm", "held out without", "mm", 4), |finding| {
                finding.gain.cv_rmse_before_mm.into()
            }),
            (Column::number("cv_rmse_after_mm", "held out with", "mm", 4), |finding| {
                finding.gain.cv_rmse_after_mm.into()
            }),
        ],
    );
    table.notes.push(
        "explains: the part of the readings that nothing else in the model explains, RMS over all rows. identified: better than its \
         alternatives, significant once smooth unmodelled trends are allowed for, and found again in halves of the rows."
            .to_owned(),
    );
    table.notes.push(AMBIGUOUS.to_owned());
    table
}

/// The causes that cannot be told apart.
pub(super) fn members(finding: &Finding) -> Table {
    let mut table = Table::of(
        "Causes that these rows cannot tell apart",
        &finding.members,
        [
            (Column::text("family", "family"), |member| member.family.words().into()),
            (Column::text("effect", "effect"), |member| member.effect.as_str().into()),
            (Column::text("where", "where"), |member| {
                place_of(member.effect, member.joints.as_deref(), member.rows).into()
            }),
            (Column::number("share", "share", "%", 0), |member| (100.0 * member.share).into()),
        ],
    );
    table.notes.push(
        "share: of the evidence, if exactly one of these is true. It is not a probability: do not replace a part before the deciding \
         measurement."
            .to_owned(),
    );
    table
}

/// Row ranges of a set-up that changed with time.
pub(super) fn sessions(finding: &Finding) -> Table {
    Table::of(
        "Sessions",
        &finding.sessions,
        [
            (Column::text("rows", "rows"), |session| {
                format!("{} to {}", session.rows[0], session.rows[1]).into()
            }),
            (Column::text("what", "cause of a shift of these rows alone"), |session| {
                session.shift.as_ref().unwrap_or(&session.cause).as_str().into()
            }),
            (Column::number("worth_mm", "explains", "mm", 3), |session| session.worth_mm.into()),
        ],
    )
}

/// A p-value; pages state an underflowing one as a bound.
fn p_value(p: f64) -> Cell {
    if p < 1e-300 { Cell::Worded { value: p, shown: "< 1e-300".to_owned() } } else { p.into() }
}

pub(super) fn parameters(finding: &Finding) -> Table {
    let mut table = Table::new(
        "Parameters",
        vec![
            Column::text("name", "parameter"),
            Column::significant("value", "value ± 1σ", "", 4),
            Column::text("unit", "unit"),
        ],
    );
    // The knots of a map are shown as a plot.
    let shown: Vec<&FoundParameter> = finding.parameters.iter().filter(|p| p.name != "knot").collect();
    for parameter in shown {
        let (scale, unit) = display_unit(&parameter.unit);
        table.push([
            Cell::from(parameter.name.as_str()),
            Cell::with_sigma(parameter.value * scale, parameter.sigma.map(|s| s * scale)),
            unit.into(),
        ]);
    }
    table
}

pub(super) fn rivals(finding: &Finding) -> Table {
    Table::of(
        "Alternatives fitted in its place",
        &finding.alternatives,
        [
            (Column::text("effect", "effect"), |rival| rival.effect.as_str().into()),
            (Column::text("where", "where"), |rival| {
                place_of(rival.effect, rival.joints.as_deref(), rival.rows).into()
            }),
            (Column::number("cv_rmse_mm", "held out", "mm", 4), |rival| rival.cv_rmse_mm.into()),
            (Column::number("beaten_by", "worse by", "2 ln Bayes factor", 1), |rival| {
                rival.twice_log_bayes_factor.into()
            }),
        ],
    )
}

/// Effects that the data cannot decide.
pub fn not_testable_table(diagnosis: &Diagnosis) -> Table {
    Table::of(
        "Not testable",
        &diagnosis.not_testable,
        [
            (Column::text("effect", "effect"), |item| match &item.joints {
                Some(joints) => {
                    format!("{}, {}", item.effect.words(), place_of(item.effect, Some(joints), None)).into()
                }
                None => item.effect.words().into(),
            }),
            (Column::text("reason", "why"), |item| item.reason.as_str().into()),
            (Column::text("remedy", "what would decide"), |item| item.remedy.as_str().into()),
        ],
    )
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
    let mut table = Table::new(
        "Steps",
        vec![
            Column::text("step", "step"),
            Column::text("added", "added"),
            Column::number("cv_rmse_mm", "held out", "mm", 4),
        ],
    );
    for (index, step) in diagnosis.steps.iter().enumerate() {
        table.push([step_name(index).into(), step.added.as_str().into(), step.cv_rmse_mm.into()]);
    }
    table
}
