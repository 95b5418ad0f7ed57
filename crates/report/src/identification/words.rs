//! Sentences about an identification: unidentifiable combinations, readout fusion, outliers.

use serde_json::{Value, json};

use crate::document::{Block, PageVerdict};
use crate::number::Precision;
use crate::status::Status;
use truegrind_arm::parameter::Parameter;
use truegrind_calibration::identification::fit::{OUTLIER_CUT, Outlier};
use truegrind_calibration::identification::identifiability::Identifiability;
use truegrind_calibration::identification::identify::Identification;
use truegrind_calibration::identification::rounding::NotFused;
use truegrind_calibration::measurement::dataset::Dataset;
use truegrind_calibration::measurement::noise_floor::noise_floor;
use truegrind_math::sentence::listed;

/// Remarks on the errors.
pub(super) fn remarks(found: &Identification, dataset: &Dataset) -> Vec<String> {
    let mut out = Vec::new();
    let errors = &found.estimated.calibrated;
    let (fitted, held) = (errors.fitted.rmse, errors.held_out.rmse);
    if held > 1.5 * fitted && fitted > 0.0 {
        out.push(format!(
            "Held-out errors are {:.1} times those of the fit: there are few rows for the number of parameters; measure more poses.",
            held / fitted
        ));
    }
    if let Some(floor) = found.estimated.noise_floor_mm {
        out.push(match (noise_floor(dataset).is_some(), held < 1.5 * floor) {
            (true, true) => format!(
                "Repeated poses scatter by {floor:.3} mm, so a better model could hardly reduce the error on these rows."
            ),
            (true, false) => format!(
                "Repeated poses scatter by {floor:.3} mm; the model does not explain the rest of the {held:.3} mm."
            ),
            (false, true) => format!(
                "Rounding of the angles alone causes {floor:.3} mm, most of the remaining error: log angles with more decimals."
            ),
            (false, false) => format!(
                "Rounding of the angles alone causes {floor:.3} mm; the rest of the {held:.3} mm is sensor noise and errors beyond \
                 geometry."
            ),
        });
    }
    out.push(format!(
        "Beyond rounding, a reading scatters by {} mm (1σ) about the fitted model.",
        Precision::Significant(3).format(found.geometry.sigma_mm)
    ));
    if let Some(step) = dataset.angle_step_rad {
        out.push(format!("Logged angles are multiples of {}°.", (step.to_degrees() * 1e6).round() / 1e6));
    }
    out
}

/// Verdict on the rank, with a sentence per combination that changes no reading.
pub(super) fn identifiability(found: &Identification, report: &Identifiability) -> Block {
    let missing = report.parameters.saturating_sub(report.rank);
    let rank = format!("Rank {} of {}", report.rank, report.parameters);
    if missing == 0 {
        return PageVerdict::new(
            Status::Good,
            format!("{rank}: the data determine all combinations of parameters"),
            [format!(
                "condition number {}; {} combinations are determined more by the priors than by the data",
                Precision::Significant(3).format(report.condition),
                report.held_by_priors
            )],
        )
        .into();
    }
    let what = if missing == 1 {
        "one combination of parameters changes no reading and is fixed by the priors".to_owned()
    } else {
        format!("{missing} combinations of parameters change no reading and are fixed by the priors")
    };
    PageVerdict::new(Status::Warning, format!("{rank}: {what}"), combinations(found, report)).into()
}

/// One sentence per combination of parameters that changes no reading, in mm and degrees.
pub(super) fn combinations(found: &Identification, report: &Identifiability) -> Vec<String> {
    report.combinations.iter().map(|terms| combination(found, terms)).collect()
}

fn combination(found: &Identification, terms: &[(Parameter, f64)]) -> String {
    let moved = |(parameter, share): &(Parameter, f64)| {
        let place = found.geometry.parameters.iter().position(|p| p == parameter);
        let sigma = place.and_then(|k| found.geometry.priors.get(k)).map_or(f64::NAN, |prior| prior.sigma);
        let estimated = found.parameters.iter().find(|p| p.name == parameter.to_string());
        let unit = estimated.map_or(parameter.unit(), |p| p.unit.as_str());
        let amount = share * sigma;
        let number = |value: f64| {
            let text = Precision::Significant(2).format(value);
            if value > 0.0 { format!("+{text}") } else { text.replacen('-', "−", 1) }
        };
        match unit {
            "rad" => format!("{parameter} {}°", number(amount.to_degrees())),
            unit => format!("{parameter} {} {unit}", number(amount)),
        }
    };
    let mut terms = terms.to_vec();
    terms.sort_by(|a, b| b.1.abs().total_cmp(&a.1.abs()));
    let moves: Vec<String> = terms.iter().map(moved).collect();
    match moves.as_slice() {
        [] => "a combination without dominant members is not identifiable".to_owned(),
        [one] => format!("{one} is not identifiable"),
        [first, others @ ..] => format!("{first} together with {} is not identifiable", listed(others)),
    }
}

/// Result of the readout fusion.
pub(super) fn readout_fusion(found: &Identification) -> Block {
    match &found.readout_fusion {
        Ok(report) => {
            let point = report.readout_point_mm;
            PageVerdict::new(
                Status::Good,
                format!(
                    "The Cartesian read-out of the controller refined the rounded angles: their σ is {:.0} % of the rounding error",
                    100.0 * report.narrowed
                ),
                [
                    format!(
                        "read-out and nominal forward kinematics differ by {:.4} mm RMS with the logged angles; rounding explains {:.4} mm",
                        report.before_mm, report.expected_mm
                    ),
                    format!("with refined angles they differ by {:.4} mm", report.after_mm),
                    format!(
                        "the read-out refers to the point ({:.3}, {:.3}, {:.3}) mm on the flange",
                        point.x, point.y, point.z
                    ),
                ],
            )
            .into()
        }
        Err(NotFused::Nothing) => Block::Paragraph(
            "Angles are used as logged: they are not rounded, some rows have no Cartesian read-out, or its use was switched off."
                .to_owned(),
        ),
        Err(NotFused::Mismatch { found_mm, expected_mm }) => PageVerdict::new(
            Status::Warning,
            format!(
                "The Cartesian read-out was not used: it differs by {found_mm:.3} mm RMS from the nominal arm at the logged angles, while rounding \
                 explains {expected_mm:.3} mm"
            ),
            ["angles and read-out of the same row contradict each other, or the robot is not the stated one"],
        )
        .into(),
    }
}

/// [`readout_fusion`] as JSON.
pub(super) fn readout_fusion_json(found: &Identification) -> Value {
    match &found.readout_fusion {
        Ok(report) => json!({
            "used": true,
            "readout_point_mm": report.readout_point_mm.as_slice(),
            "before_mm": report.before_mm,
            "after_mm": report.after_mm,
            "expected_mm": report.expected_mm,
            "narrowed": report.narrowed,
        }),
        Err(NotFused::Nothing) => json!({ "used": false, "reason": "nothing to sharpen, or not wanted" }),
        Err(NotFused::Mismatch { found_mm, expected_mm }) => json!({
            "used": false, "reason": "mismatch", "found_mm": found_mm, "expected_mm": expected_mm,
        }),
    }
}

/// Most rows that a note lists.
const LISTED: usize = 4;

/// The rows that were set aside, the largest errors first.
pub(super) fn set_aside(found: &Identification) -> String {
    let numbers = &found.estimated.provenance.set_aside;
    let error = |(number, row): (&usize, &Outlier)| format!("row {number} ({:.3} mm)", row.error_mm.abs());
    let more = numbers.len().saturating_sub(LISTED);
    let rows = numbers.iter().zip(&found.outliers.rows).take(LISTED).map(error);
    let all: Vec<String> = rows.chain((more > 0).then(|| format!("{more} more"))).collect();
    match all.as_slice() {
        [] => "no gross outliers".to_owned(),
        all => format!("gross outliers: {}", listed(all)),
    }
}

/// Number of rows set aside as outliers.
pub(super) fn outliers(found: &Identification) -> Block {
    let outliers = &found.outliers;
    match (outliers.rows.len(), outliers.too_many) {
        (0, 0) => Block::Paragraph("No row was set aside as an outlier.".to_owned()),
        (0, many) => PageVerdict::new(
            Status::Warning,
            format!("{many} rows lie beyond {OUTLIER_CUT} robust standard deviations; these are too many for isolated outliers, so all rows are used"),
            ["look for what they have in common: a range of rows, a pose of the arm, a payload"],
        )
        .into(),
        (rows, _) => Block::Paragraph(format!(
            "{rows} {} set aside as gross outliers and left out of every error above.",
            if rows == 1 { "row was" } else { "rows were" }
        )),
    }
}

/// Caption of the convergence plot.
pub(super) fn convergence(found: &Identification) -> String {
    let mut text =
        format!("Cost of the final fit over its iterations; it ended \"{}\".", found.geometry.termination());
    if found.geometry.rounds.len() > 1 {
        text.push_str(
            " Each round uses the weights of the round before, so costs of different rounds are not comparable.",
        );
    }
    text
}
