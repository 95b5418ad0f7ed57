//! Report on an identification: verdict, errors by stage, parameters, identifiability, outliers. Angles are shown in degrees.

mod parameter;
mod pictures;
mod tables;
mod words;

use serde_json::{Value, json};

use self::parameter::{held_by_prior, in_unit};
use self::tables::row_number;
use super::document::{Block, Document, KeyFigure, PageVerdict, Provenance, Source};
use super::number::Precision;
use super::status::Status;
use truegrind_arm::estimated::{Estimated, EstimatedParameter, Judgement, ReasonKind};
use truegrind_arm::parameter::Parameter;
use truegrind_calibration::identification::benefit::Benefit;
use truegrind_calibration::identification::identifiability::Identifiability;
use truegrind_calibration::identification::identify::Identification;
use truegrind_calibration::identification::verdict::percent_of;
use truegrind_calibration::measurement::dataset::Dataset;

pub use tables::{
    frame_table, held_out_table, observability_table, outlier_table, parameter_table, stage_table,
};

/// The page; `dataset`: the data used for the identification.
pub fn document(found: &Identification, dataset: &Dataset) -> Document {
    let mut page = summary(found);
    page.push(Block::List(words::remarks(found, dataset)));
    page.figure(
        pictures::frequency(found),
        "Errors of the held-out rows, not used in the fit: with registered frames only, and with geometry.",
    );
    page.figure(
        pictures::by_row(found),
        "The same errors by row, in file order. Steps and drifts along the rows are not geometry; random splits hide them.",
    );

    page.heading(2, "Parameters of the arm");
    page.figure(
        pictures::parameters(found),
        "Change from the data sheet with 1σ and 2σ, in units of the manufacturing tolerance (prior σ), so that lengths and angles \
         share an axis.",
    );
    page.push(parameter_table(found));

    page.heading(2, "Sensor and measured point");
    page.push(frame_table(found));

    page.heading(2, "Identifiability");
    match &found.identifiability {
        Some(report) => {
            page.push(words::identifiability(found, report));
            page.figure(
                pictures::singular_values(report),
                "Singular values of the Jacobian, with parameters in units of their prior σ and readings in units of their own σ. Above 1 \
                 the data determine a combination, below 1 the prior does; the smallest values belong to combinations that change \
                 no reading.",
            );
            page.push(observability_table(report));
        }
        None => page.paragraph("Not available: the Jacobian is not finite at the estimate."),
    }

    page.heading(2, "Rows");
    page.push(words::readout_fusion(found));
    page.push(words::outliers(found));
    if !found.outliers.rows.is_empty() {
        page.push(outlier_table(found, dataset));
    }
    page.push(Block::Details {
        summary: format!("Errors of the {} held-out rows", found.held_out.len()),
        blocks: vec![held_out_table(found).excerpt(300).into()],
    });
    page.push(Block::List(dataset.notes.clone()));
    page.blocks.retain(|block| !matches!(block, Block::List(points) if points.is_empty()));

    page.heading(2, "Convergence");
    page.figure(pictures::convergence(found), words::convergence(found));

    page.heading(2, "Provenance");
    page.push(provenance(found, dataset));
    page
}

/// Summary for the terminal: verdict, key figures, errors by stage.
pub fn summary(found: &Identification) -> Document {
    let estimated = &found.estimated;
    let mut page = Document::new(format!("Identification of {}", estimated.robot));
    page.subtitle = format!(
        "{}, {} rows, sensor {}, method {}",
        estimated.provenance.file,
        estimated.provenance.rows,
        estimated.provenance.sensor,
        estimated.provenance.method
    );
    page.push(verdict(found));
    page.push(key_figures(found));
    page.push(stage_table(found));
    page
}

/// JSON report with the error of each held-out row, schema `truegrind.identification/1`. Angles in degrees.
pub fn json(found: &Identification, dataset: &Dataset) -> Value {
    let estimated = &found.estimated;
    let parameters = |of_arm: bool| -> Vec<Value> {
        found.parameters.iter().filter(|p| p.is_of_arm() == of_arm).map(parameter_json).collect()
    };
    let held_out: Vec<Value> = found
        .held_out
        .iter()
        .map(|(row, before, after)| json!({ "row": row, "registered_mm": before, "geometry_mm": after }))
        .collect();
    let identifiability = found.identifiability.as_ref().map(|report| identifiability_json(found, report));
    let rounds: Vec<Vec<f64>> = found
        .geometry
        .rounds
        .iter()
        .map(|trace| trace.iter().map(|iteration| iteration.cost).collect())
        .collect();
    json!({
        "schema": "truegrind.identification/1",
        "dataset": {
            "file": estimated.provenance.file,
            "sha256": estimated.provenance.sha256,
            "rows": dataset.rows.len(),
            "rows_used": estimated.provenance.rows,
            "sensor": estimated.provenance.sensor,
            "robot": estimated.robot,
        },
        "method": {
            "name": estimated.provenance.method,
            "seed": estimated.provenance.seed,
            "held_out_share": estimated.provenance.held_out,
            "version": estimated.provenance.version,
            "termination": found.geometry.termination(),
            "evaluations": found.geometry.evaluations,
            "costs_by_round": rounds,
        },
        "verdict": estimated.verdict,
        "benefit": found.benefit,
        "noise_floor_mm": estimated.noise_floor_mm,
        "sigma_mm": found.geometry.sigma_mm,
        "stages": {
            "raw": found.raw.map(|all| json!({ "all": all })),
            "registered": estimated.registered,
            "geometry": estimated.calibrated,
        },
        "parameters": parameters(true),
        "frames": parameters(false),
        "identifiability": identifiability,
        "sharpening": words::readout_fusion_json(found),
        "outliers": {
            "rows": found.outliers.rows.iter().map(|row| json!({
                "row": row_number(dataset, row.index), "robust_sigmas": row.robust_sigmas, "error_mm": row.error_mm.abs(),
            })).collect::<Vec<_>>(),
            "too_many": found.outliers.too_many,
        },
        "region": estimated.region,
        "condition": estimated.condition,
        "held_out": held_out,
    })
}

/// Rank, singular values and unidentifiable combinations.
fn identifiability_json(found: &Identification, report: &Identifiability) -> Value {
    let observability: serde_json::Map<String, Value> = report
        .observability
        .iter()
        .enumerate()
        .map(|(k, value)| (format!("o{}", k + 1), json!((report.rank > 0).then_some(value))))
        .collect();
    let combinations: Vec<Value> = report
        .combinations
        .iter()
        .map(|terms| {
            terms.iter().map(|(p, share)| json!({ "parameter": p.to_string(), "share": share })).collect()
        })
        .collect();
    json!({
        "parameters": report.parameters,
        "rank": report.rank,
        "condition": report.condition,
        "determined_condition": report.determined_condition,
        "singular_values": report.singular_values,
        "observability": observability,
        "held_by_priors": report.held_by_priors,
        "combinations": combinations,
        "sentences": words::combinations(found, report),
    })
}

fn parameter_json(parameter: &EstimatedParameter) -> Value {
    let shown = match parameter.unit.as_str() {
        "rad" => in_unit(parameter, 1f64.to_degrees(), "deg"),
        unit => in_unit(parameter, 1.0, unit),
    };
    let of_arm = parameter.is_of_arm();
    json!({
        "name": shown.name,
        "unit": shown.unit,
        "nominal": of_arm.then_some(shown.nominal),
        "value": shown.value,
        "sigma": shown.sigma,
        "deviation": of_arm.then_some(shown.value - shown.nominal),
        "prior_sigma": shown.prior_sigma,
        "determined": shown.determined,
        "held_by_prior": held_by_prior(parameter),
    })
}

fn verdict(found: &Identification) -> PageVerdict {
    judged(&found.estimated)
}

/// The verdict on an estimated arm, the same for identification and diagnosis.
pub fn judged(estimated: &Estimated) -> PageVerdict {
    let (before, after) = (estimated.registered.held_out.rmse, estimated.calibrated.held_out.rmse);
    // A diagnosis has a second held-out error beside it: that of the fit with all causes.
    let of = if estimated.provenance.method == "diagnose" { " of the written arm" } else { "" };
    let place = if shows_no_target(estimated) {
        "; errors are those of the target, whose place on the flange these poses do not show, and a tool elsewhere may be off by more"
    } else {
        ""
    };
    let errors =
        format!("held-out error{of} {after:.3} mm RMSE, {before:.3} mm with registered frames alone{place}");
    let (status, headline) = match estimated.verdict.status {
        Judgement::Pass if shows_more_than_noise(estimated) => (
            Status::Warning,
            format!(
                "The model may be used and meets the stated limits, but repeated poses show more than the noise of a reading: {errors}"
            ),
        ),
        Judgement::Pass => {
            (Status::Good, format!("The model may be used; it meets the stated limits: {errors}"))
        }
        Judgement::Fail => (Status::Bad, format!("The model must not be used: {errors}")),
        Judgement::Doubtful => {
            (Status::Warning, format!("The model is doubtful and needs --allow-doubtful: {errors}"))
        }
        Judgement::NotEvaluated if shows_more_than_noise(estimated) => (
            Status::Warning,
            format!(
                "The model may be used, but repeated poses show more than the noise of a reading: {errors}"
            ),
        ),
        Judgement::NotEvaluated => (
            Status::Good,
            format!(
                "The model may be used; no limit of its error was stated (--limit-rmse, --limit-max): {errors}"
            ),
        ),
    };
    let mut reasons = estimated.verdict.reasons.clone();
    if matches!(estimated.verdict.status, Judgement::Pass | Judgement::NotEvaluated) {
        // The headline says what limits were stated, and an arm that may be used has converged.
        reasons.retain(|reason| !matches!(reason.kind, ReasonKind::Converged | ReasonKind::NoLimits));
        reasons.push(
            "what to do: correct programs with it (`truegrind compensate`), inside the measured region"
                .into(),
        );
    }
    PageVerdict::new(status, headline, reasons.into_iter().map(|reason| reason.text))
}

/// Whether its verdict notes that repeated poses show more than noise.
fn shows_more_than_noise(estimated: &Estimated) -> bool {
    estimated.verdict.has(ReasonKind::MoreThanNoise)
}

/// Whether its verdict notes that the poses do not show where the target sits.
fn shows_no_target(estimated: &Estimated) -> bool {
    estimated.verdict.has(ReasonKind::TargetNotShown)
}

/// Expected deviation of programs before and after correction.
pub(super) fn benefit_figures(benefit: Option<&Benefit>) -> Vec<KeyFigure> {
    let Some(benefit) = benefit else { return Vec::new() };
    vec![
        KeyFigure::new("Programs before", benefit.nominal_mm, 3, "mm")
            .note("expected RMS deviation in the measured region, without placement of base and flange"),
        programs_after(benefit),
    ]
}

/// Expected deviation of corrected programs: a range where what the readings still deviate may be noise or the arm's.
fn programs_after(benefit: &Benefit) -> KeyFigure {
    let probability = percent_of(benefit.probability);
    let after = "Programs after";
    // A range where the verdict states one.
    let Some(most_mm) = benefit.counting_at_most_mm() else {
        return KeyFigure::new(after, benefit.estimated_mm, 3, "mm")
            .note(format!("expected RMS deviation; better with a probability of {probability}"));
    };
    let [least, most] = [benefit.estimated_mm, most_mm].map(|mm| Precision::Decimals(3).format(mm));
    KeyFigure::new(after, format!("{least} to {most}"), 3, "mm").note(format!(
        "expected RMS deviation: the larger, the more of the unexplained rest is the arm's and not noise; better with a probability \
         of {probability}"
    ))
}

/// Why the noise of the sensor is unknown: repetitions from another station or another side are no repetitions.
fn too_few_repeats(found: &Identification) -> String {
    let is_of_stations = |parameter: &Parameter| matches!(parameter, Parameter::Disturbance { .. });
    let has_stations = found.geometry.parameters.iter().any(is_of_stations);
    format!(
        "too few poses were repeated from {}",
        if has_stations { "the same station and the same sides" } else { "the same sides" }
    )
}

fn key_figures(found: &Identification) -> Vec<KeyFigure> {
    let estimated = &found.estimated;
    let (before, after) = (&estimated.registered.held_out, &estimated.calibrated.held_out);
    let gain = if before.rmse > 0.0 { 100.0 * (1.0 - after.rmse / before.rmse) } else { f64::NAN };
    let floor = KeyFigure::new("Noise floor", estimated.noise_floor_mm, 3, "mm");
    let used = estimated.provenance.rows;
    let rank = found.identifiability.as_ref();
    let mut figures = benefit_figures(found.benefit.as_ref());
    figures.extend([
        KeyFigure::new("Held-out RMSE", after.rmse, 3, "mm")
            .note(format!("registered frames alone: {:.3} mm", before.rmse)),
        KeyFigure::new("Gain of the model", gain, 0, "%")
            .note("held-out RMSE, from registered frames to geometry"),
        KeyFigure::new("Largest held-out error", after.max, 3, "mm")
            .note(format!("registered: {:.3} mm", before.max)),
        match (estimated.noise_floor_mm, estimated.beyond_noise_mm) {
            (Some(_), Some(_)) if shows_more_than_noise(estimated) => {
                floor.note("scatter of repeated poses, without what they show beside noise")
            }
            (None, Some(_)) => floor.note("unknown: repeated poses show more than the noise of a reading"),
            (Some(_), Some(_)) => floor.note("scatter of repeated poses"),
            (Some(_), None) => floor.note(format!(
                "of rounding alone; that of the sensor is not known, since {}",
                too_few_repeats(found)
            )),
            (None, None) => floor.note(format!("unknown: {} and nothing is rounded", too_few_repeats(found))),
        },
    ]);
    figures.extend(found.held_out_orientation.as_ref().map(|turns| {
        KeyFigure::new("Held-out orientation", turns.rmse.to_degrees(), 4, "°")
            .note(format!("RMS; largest {:.4}°", turns.max.to_degrees()))
    }));
    figures.extend([
        KeyFigure::new("Rows used", used, 0, "").note(format!(
            "{} fitted and {} held out to state errors; the final model is fitted to all",
            used - found.held_out.len().min(used),
            found.held_out.len()
        )),
        KeyFigure::new("Set aside", estimated.provenance.set_aside.len(), 0, "")
            .note(words::set_aside(found)),
        KeyFigure::new("Rank", rank.map(|r| format!("{} of {}", r.rank, r.parameters)), 0, "").note(
            match rank {
                Some(report) => {
                    format!("{} combinations known mainly from tolerances", report.held_by_priors)
                }
                None => String::new(),
            },
        ),
    ]);
    figures
}

fn provenance(found: &Identification, dataset: &Dataset) -> Provenance {
    let from = &found.estimated.provenance;
    let remark = |name: &str, value: String| (name.to_owned(), value);
    let mut remarks = vec![
        remark("Robot", found.estimated.robot.clone()),
        remark("Sensor", from.sensor.to_string()),
        remark("Split", format!("{} % of the rows held out", (1e4 * from.held_out).round() / 100.0)),
        remark(
            "Angles refined",
            if from.sharpened { "yes, by the Cartesian read-out" } else { "no" }.to_owned(),
        ),
    ];
    if let Some(sheet) = &dataset.sheet {
        remarks.push(remark("Sheet", sheet.clone()));
    }
    if !from.set_aside.is_empty() {
        let rows: Vec<String> = from.set_aside.iter().map(usize::to_string).collect();
        remarks.push(remark("Set aside", format!("rows {}", rows.join(", "))));
    }
    let condition = &found.estimated.condition;
    for (name, value, unit) in [
        ("Time", condition.time_h, "h"),
        ("Temperature", condition.temperature_c, "°C"),
        ("Payload", condition.payload_kg, "kg"),
    ] {
        if let Some(value) = value {
            remarks
                .push(remark(name, format!("{} {unit} (median)", Precision::Significant(4).format(value))));
        }
    }
    Provenance {
        version: format!("truegrind {}", from.version),
        command: None,
        method: Some(from.method.clone()),
        seed: Some(from.seed),
        sources: vec![Source::new(&from.file, "Measurements", &from.sha256, Some(from.rows))],
        remarks,
    }
}
