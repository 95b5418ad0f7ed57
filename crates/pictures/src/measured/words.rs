//! A measurement file and what was identified from it, in words.

use std::fmt::Write;

use super::scene::MeasuredScene;
use crate::markdown::{cell, line, number, with_sigma};
use crate::shape::Shape;
use truegrind_arm::estimated::{EstimatedParameter, Judgement};
use truegrind_arm::parameter::display_unit;
use truegrind_calibration::diagnosis::finding::{Confidence, Diagnosis};
use truegrind_calibration::identification::identify::Identification;
use truegrind_math::statistics::{ErrorSummary, extent};

pub(super) fn markdown(scene: &MeasuredScene<'_>, shape: Option<&Shape>) -> String {
    let dataset = scene.dataset;
    let mut text = format!("# {}\n\n", line(&dataset.file));
    let _ = writeln!(
        text,
        "{} rows, sensor: {}. Arm: {}.\n",
        dataset.rows.len(),
        dataset.sensor,
        line(scene.arm_is)
    );
    for sentence in scene.answer {
        let _ = writeln!(text, "- {}", line(sentence));
    }
    if !scene.answer.is_empty() {
        text.push('\n');
    }
    if let Some(found) = scene.identification {
        verdict(&mut text, found);
        errors(&mut text, found);
    }
    if let Some(found) = scene.diagnosis {
        causes(&mut text, found);
    }
    for note in &dataset.notes {
        let _ = writeln!(text, "- {}", line(note));
    }
    ranges(&mut text, scene);
    if let Some(found) = scene.identification {
        parameters(&mut text, &found.parameters);
    }
    text.push_str(match scene.planned {
        true => "\n## What is drawn\n\n- Grey arm: at the joints of the row.\n",
        false => "\n## What is drawn\n\n- Grey arm: at the logged joints of the row.\n",
    });
    if let Some(shape) = shape {
        let _ = writeln!(
            text,
            "- Second tab: the ghost is the arm as the data sheet has it, the orange one {}, its differences {}.",
            line(scene.arm_is),
            shape.factor()
        );
    }
    if !scene.keep_out_mm.is_empty() {
        text.push_str("- Purple boxes: what nothing shall enter.\n");
    }
    if scene.planned {
        text.push_str(
            "- Points: planned positions of the measured point, all rows. Orange: the expected reading.\n",
        );
    } else if scene.residuals.is_empty() {
        text.push_str("- Points: where the flange was, all rows.\n");
    } else {
        text.push_str(
            "- Points: where the touched point was, all rows; dark blue is a residual of 0, yellow a large one (bar below). Orange: sensor, and \
             its reading at the row.\n",
        );
        let stages: Vec<String> = scene.residuals.iter().map(|r| line(&r.stage)).collect();
        let _ = write!(text, "- Curves: the residual of each row, {}", stages.join("; "));
        let held = "; green points: rows that were held out of the fit they are judged by";
        let _ = writeln!(text, "{}.", if scene.held_out.is_empty() { "" } else { held });
    }
    text.push_str(
        "\nLengths are mm, in the base of the arm with z up. Time counts rows as the spreadsheet does.\n",
    );
    text
}

/// What was found beyond geometry, and what it brought on held-out rows.
fn causes(text: &mut String, found: &Diagnosis) {
    text.push_str("## What geometry does not explain\n\n");
    if found.findings.is_empty() {
        text.push_str("Nothing was found.\n");
    }
    for finding in &found.findings {
        let sure = match finding.confidence {
            Confidence::Identified => "identified",
            Confidence::Ambiguous => "ambiguous",
        };
        let _ = writeln!(text, "- {} ({sure})", line(&finding.cause));
    }
    text.push_str("\n## Errors, held out [mm]\n\n| | random | blocks | regions |\n|---|---:|---:|---:|\n");
    let stages = &found.fits;
    for (name, stage) in
        [("data sheet", &stages.nominal), ("geometry", &stages.geometric), ("with causes", &stages.extended)]
    {
        let [random, blocks, regions] =
            [stage.cv_rmse_mm, stage.cv_blocks_rmse_mm, stage.cv_regions_rmse_mm].map(|v| number(Some(v)));
        let _ = writeln!(text, "| {name} | {random} | {blocks} | {regions} |");
    }
    let floor = number(found.noise_floor_mm);
    let _ = writeln!(text, "\nNoise floor {floor} mm; {} rows set aside.\n", found.dataset.set_aside);
}

fn verdict(text: &mut String, found: &Identification) {
    let verdict = &found.estimated.verdict;
    let status = match verdict.status {
        Judgement::Pass => "pass",
        Judgement::Fail => "FAIL",
        Judgement::Doubtful => "doubtful",
        Judgement::NotEvaluated => "may be used; no limit of its error was stated",
    };
    let method = line(&found.estimated.provenance.method);
    let _ = writeln!(text, "Method: **{method}**. Verdict: **{status}**.\n");
    for reason in &verdict.reasons {
        let _ = writeln!(text, "- {}", line(&reason.text));
    }
    text.push('\n');
}

fn errors(text: &mut String, found: &Identification) {
    let estimated = &found.estimated;
    text.push_str("## Errors [mm]\n\n| | RMSE | mean | max |\n|---|---:|---:|---:|\n");
    let mut row = |name: &str, e: &ErrorSummary| {
        let [rmse, mean, max] = [e.rmse, e.mean_absolute, e.max].map(|v| number(Some(v)));
        let _ = writeln!(text, "| {name} | {rmse} | {mean} | {max} |");
    };
    if let Some(raw) = &found.raw {
        row("raw", raw);
    }
    row("frames, fitted rows", &estimated.registered.fitted);
    row("frames, held out", &estimated.registered.held_out);
    row("geometry, fitted rows", &estimated.calibrated.fitted);
    row("geometry, held out", &estimated.calibrated.held_out);
    let _ = writeln!(
        text,
        "\nNoise floor {} mm; {} rows set aside.\n",
        number(estimated.noise_floor_mm),
        estimated.provenance.set_aside.len()
    );
}

/// Where the joints were, in the controller's angles.
fn ranges(text: &mut String, scene: &MeasuredScene<'_>) {
    let _ = writeln!(
        text,
        "\n## Joint ranges [°]\n\n| joint | {} | limits |\n|---|---:|---:|",
        if scene.planned { "planned" } else { "measured" }
    );
    for joint in 0..6 {
        let [low, high] = extent(scene.dataset.rows.iter().map(|r| r.joints[joint].to_degrees()));
        let limits = &scene.arm.limits;
        let _ = writeln!(
            text,
            "| {} | {low:.1} … {high:.1} | {:.0} … {:.0} |",
            joint + 1,
            limits.min_rad[joint].to_degrees(),
            limits.max_rad[joint].to_degrees()
        );
    }
}

fn parameters(text: &mut String, parameters: &[EstimatedParameter]) {
    text.push_str(
        "\n## Parameters\n\nChange from nominal ± σ; *data* is the share of the knowledge that the data brought, the \
         rest is manufacturing tolerance.\n\n| | nominal | change ± σ | data |\n|---|---:|---:|---:|\n",
    );
    for p in parameters {
        let (factor, unit) = display_unit(&p.unit);
        let _ = writeln!(
            text,
            "| {} [{}] | {} | {} | {:.0} % |",
            cell(&p.name),
            cell(unit),
            (p.nominal * factor * 1e4).round() / 1e4,
            with_sigma((p.value - p.nominal) * factor, p.sigma * factor),
            100.0 * p.determined
        );
    }
}
