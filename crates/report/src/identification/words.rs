//! Sentences about an identification: what the data cannot separate, what the read-out brought, what was set aside.

use serde_json::{Value, json};

use crate::document::{Block, Verdict};
use crate::number::Precision;
use crate::status::Status;
use truegrind_arm::parameter::Parameter;
use truegrind_calibration::identification::identifiability::Identifiability;
use truegrind_calibration::identification::identify::Identification;
use truegrind_calibration::identification::rounding::NotFused;
use truegrind_calibration::measurement::dataset::Dataset;
use truegrind_calibration::measurement::split;

/// What a reader of the errors should have in mind.
pub(super) fn remarks(found: &Identification, dataset: &Dataset) -> Vec<String> {
    let mut out = Vec::new();
    let errors = &found.estimated.geometry;
    let (fitted, held) = (errors.fitted.rmse, errors.held_out.rmse);
    if held > 1.5 * fitted && fitted > 0.0 {
        out.push(format!(
            "Held-out errors are {:.1} times those of the fit: there are few rows for so many parameters, and more poses \
             would help.",
            held / fitted
        ));
    }
    if let Some(floor) = found.estimated.noise_floor_mm {
        out.push(match (split::noise_floor(dataset).is_some(), held < 1.5 * floor) {
            (true, true) => format!(
                "Repeated poses scatter by {floor:.3} mm: a better model cannot show much more in these rows."
            ),
            (true, false) => format!(
                "Repeated poses scatter by {floor:.3} mm; the rest of the {held:.3} mm is what the model does not explain."
            ),
            (false, true) => format!(
                "The rounding of the angles alone leaves {floor:.3} mm: what is left is mostly rounding, and a better \
                 model cannot show in these rows. Log angles with more decimals."
            ),
            (false, false) => format!(
                "The rounding of the angles alone leaves {floor:.3} mm; the rest of the {held:.3} mm is the sensor, and \
                 what geometry does not explain."
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

/// Judgement of rank, with a sentence for each combination that moves no reading.
pub(super) fn identifiability(found: &Identification, report: &Identifiability) -> Block {
    let missing = report.parameters.saturating_sub(report.rank);
    let rank = format!("Rank {} of {}", report.rank, report.parameters);
    if missing == 0 {
        return Verdict::new(
            Status::Good,
            format!("{rank}: no combination of parameters goes unseen"),
            [format!(
                "condition number {}; {} combinations are known better from the priors than from the data",
                Precision::Significant(3).format(report.condition),
                report.held_by_priors
            )],
        )
        .into();
    }
    let what = if missing == 1 {
        "one combination of parameters moves no reading and stays where the priors hold it".to_owned()
    } else {
        format!("{missing} combinations of parameters move no reading and stay where the priors hold them")
    };
    Verdict::new(Status::Warning, format!("{rank}: {what}"), combinations(found, report)).into()
}

/// One sentence for each combination of parameters that moves no reading, in mm and degrees.
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
        [] => "a combination without a part worth naming goes unseen".to_owned(),
        [one] => format!("{one} goes unseen"),
        [first, other] => format!("{first} goes unseen when {other} follows"),
        [first, others @ .., last] => {
            format!("{first} goes unseen when {} and {last} follow", others.join(", "))
        }
    }
}

/// What the controller's read-out brought.
pub(super) fn sharpening(found: &Identification) -> Block {
    match &found.readout_fusion {
        Ok(report) => {
            let point = report.readout_point_mm;
            Verdict::new(
                Status::Good,
                format!(
                    "The controller's read-out sharpened the rounded angles: their σ shrank to {:.0} % of what rounding \
                     leaves",
                    100.0 * report.narrowed
                ),
                [
                    format!(
                        "read-out and nominal forward map differ by {:.4} mm RMS with the angles as logged; their \
                         rounding explains {:.4} mm",
                        report.before_mm, report.expected_mm
                    ),
                    format!("with sharpened angles they differ by {:.4} mm", report.after_mm),
                    format!(
                        "the read-out is of the point ({:.3}, {:.3}, {:.3}) mm on the flange",
                        point.x, point.y, point.z
                    ),
                ],
            )
            .into()
        }
        Err(NotFused::Nothing) => Block::Paragraph(
            "Angles are used as logged: they are not rounded, no read-out was logged with every row, or sharpening was \
             switched off."
                .to_owned(),
        ),
        Err(NotFused::Mismatch { found_mm, expected_mm }) => Verdict::new(
            Status::Warning,
            format!(
                "The read-out was not used: it is {found_mm:.3} mm RMS away from the logged angles under the nominal \
                 arm, where rounding explains {expected_mm:.3} mm"
            ),
            ["angles and read-out of the same row contradict each other, or the arm is not the one that was stated"],
        )
        .into(),
    }
}

/// The same for programs.
pub(super) fn sharpening_json(found: &Identification) -> Value {
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

/// How many rows were set aside.
pub(super) fn outliers(found: &Identification) -> Block {
    let outliers = &found.outliers;
    match (outliers.rows.len(), outliers.too_many) {
        (0, 0) => Block::Paragraph("No row was set aside as an outlier.".to_owned()),
        (0, many) => Verdict::new(
            Status::Warning,
            format!("{many} rows lie beyond six robust standard deviations; that many are no accident, and all are used"),
            ["look for what they share: a stretch of rows, a pose of the arm, a payload"],
        )
        .into(),
        (rows, _) => Block::Paragraph(format!(
            "{rows} {} set aside as gross outliers and left out of every error above.",
            if rows == 1 { "row was" } else { "rows were" }
        )),
    }
}

/// Caption of the picture of convergence.
pub(super) fn convergence(found: &Identification) -> String {
    let mut text =
        format!("Cost of the final fit over its iterations; it ended \"{}\".", found.geometry.termination());
    if found.geometry.rounds.len() > 1 {
        text.push_str(
            " Each round fits with the weights that the round before led to, so costs of different rounds do not share \
             a scale.",
        );
    }
    text
}
