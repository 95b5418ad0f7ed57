//! The path in words: the block of ltlm-2024 Table 8, what became of the points, and what the colours mean.

use std::fmt::Write;

use re_sdk_types::archetypes::TextDocument;

use super::scene::{PathScene, Plan};
use crate::markdown::{cell, line, number};
use crate::recording::{Store, VisualError};
use truegrind_compensation::deviation::{After, Block, Deviation, MotionStatus, PathPoint, PathReport};

pub(super) fn draw(store: &mut Store, scene: &PathScene<'_>, plan: &Plan<'_>) -> Result<(), VisualError> {
    store.fixed("summary", &TextDocument::from_markdown(markdown(scene, plan)))
}

fn markdown(scene: &PathScene<'_>, plan: &Plan<'_>) -> String {
    let mut text = format!("# {}\n\n", line(scene.title));
    let first = plan.first;
    let _ = writeln!(text, "Program **{}**, {} points.\n", line(&first.program), first.points.len());
    let _ = writeln!(text, "Arm: {}.\n", line(scene.arm_is));
    answer(&mut text, plan);
    block(&mut text, scene, plan);
    meaning(&mut text, scene);
    fate(&mut text, first);
    colours(&mut text, scene, plan);
    text
}

/// How far off it is before and after, in one line.
fn answer(text: &mut String, plan: &Plan<'_>) {
    let report = plan.first;
    let largest = |which: fn(&PathPoint) -> Option<Deviation>| {
        report
            .cut()
            .filter_map(|p| which(p).map(|d| d.norm_mm()))
            .filter(|mm| mm.is_finite())
            .reduce(f64::max)
    };
    let Some(before) = largest(|p| p.before) else { return };
    let after = match (report.expected_mm(), largest(|p| p.after)) {
        (Some(mm), Some(_)) => format!(", an expected **{mm:.3} mm** (1σ) after"),
        (None, Some(mm)) if report.after == After::Achieved => format!(", **{mm:.3} mm** after"),
        _ => String::new(),
    };
    let _ = writeln!(text, "The tool is off by up to **{before:.3} mm** before{after}.\n");
}

/// Figures down, methods across: as narrow as a panel.
fn block(text: &mut String, scene: &PathScene<'_>, plan: &Plan<'_>) {
    let mut columns: Vec<(String, Option<Block>)> = Vec::new();
    for &k in &plan.befores {
        columns.push((plan.before_name(scene, k), scene.reports[k].block(|p| p.before)));
    }
    for report in scene.reports.iter().filter(|report| rewritten(report)) {
        let left = if report.after == After::PredictedRemainder { " (remainder)" } else { "" };
        columns.push((format!("after · {}{left}", report.model), report.block(|p| p.after)));
    }
    let normal =
        plan.first.points.iter().any(|p| p.before.or(p.after).is_some_and(|d| d.normal_mm.is_some()));
    let what = if normal { "along the normal" } else { "in size" };
    let _ = writeln!(text, "## Deviation {what} [mm]\n");
    let heads: Vec<String> = columns.iter().map(|(name, _)| cell(name)).collect();
    let _ = writeln!(text, "| | {} |", heads.join(" | "));
    let _ = writeln!(text, "|---|{}", "---:|".repeat(columns.len()));
    type Figure = fn(&Block) -> f64;
    let rows: [(&str, Figure); 10] = [
        ("P1", |b| b.five_mm[0]),
        ("P2", |b| b.five_mm[1]),
        ("P3", |b| b.five_mm[2]),
        ("P4", |b| b.five_mm[3]),
        ("P5", |b| b.five_mm[4]),
        ("mean", |b| b.all.mean),
        ("mean size", |b| b.all.mean_absolute),
        ("SD", |b| b.all.standard_deviation),
        ("RMS", |b| b.all.rmse),
        ("max", |b| b.all.max),
    ];
    for (name, figure) in rows {
        let values: Vec<String> =
            columns.iter().map(|(_, block)| number(block.as_ref().map(figure))).collect();
        let _ = writeln!(text, "| {name} | {} |", values.join(" | "));
    }
    text.push('\n');
}

/// Whether a report says anything of a path after a correction.
fn rewritten(report: &PathReport) -> bool {
    report.points.iter().any(|point| point.after.is_some())
}

/// What "after" is, and how far it may be trusted.
fn meaning(text: &mut String, scene: &PathScene<'_>) {
    for report in scene.reports {
        let kind = match report.after {
            _ if !rewritten(report) => "nothing is rewritten",
            After::PredictedRemainder => {
                "*after* is the **predicted remainder** (rounding, interpolation, inverse kinematics), not what the arm will do"
            }
            After::Achieved => "*after* is **achieved** on an arm that the correction knew nothing of",
        };
        let _ = writeln!(
            text,
            "**{}**: {kind}; predicted 1σ {} mm, held-out error {} mm.\n",
            line(&report.model),
            number(report.sigma_rms_mm()),
            number(report.held_out_mm)
        );
    }
}

/// How many points of the first report were changed, left, refused, flagged; and the reasons.
fn fate(text: &mut String, report: &PathReport) {
    let count = |s: MotionStatus| report.points.iter().filter(|p| p.status == s).count();
    let _ = writeln!(
        text,
        "Points: {} changed, {} left, {} flagged, {} refused; {} outside the measured region.\n",
        count(MotionStatus::Changed),
        count(MotionStatus::Left),
        count(MotionStatus::Flagged),
        count(MotionStatus::Refused),
        report.points.iter().filter(|p| p.outside.is_some()).count()
    );
    let mut reasons: Vec<(&PathPoint, usize, bool)> = Vec::new();
    let marked =
        report.points.iter().filter(|p| matches!(p.status, MotionStatus::Flagged | MotionStatus::Refused));
    for point in marked.filter(|p| p.reason.is_some()) {
        match reasons.iter_mut().find(|(known, ..)| known.kind_of_reason() == point.kind_of_reason()) {
            Some((known, n, same)) => (*n, *same) = (*n + 1, *same && known.reason == point.reason),
            None => reasons.push((point, 1, true)),
        }
    }
    for (first, n, same) in reasons.iter().take(8) {
        let which = if *same { "" } else { " (the first)" };
        let _ = writeln!(text, "- {n} × {}{which}", line(first.reason.as_deref().unwrap_or_default()));
    }
    if reasons.len() > 8 {
        let _ = writeln!(text, "- and {} other reasons", reasons.len() - 8);
    }
    text.push('\n');
}

fn colours(text: &mut String, scene: &PathScene<'_>, plan: &Plan<'_>) {
    let factor = plan.factor();
    let _ = writeln!(text, "## What is drawn\n");
    if let Some(shape) = &plan.shape {
        let _ = writeln!(
            text,
            "- Ghost: the arm as the data sheet has it, what the controller believes. Orange arm: the {}, its differences {}. \
             Both at the joints before.",
            line(scene.arm_is),
            shape.factor()
        );
    }
    let _ = writeln!(
        text,
        "- Tab *Arm, true scale*: grey with the joints after, orange with those before.\n\
         - White line: intended path; grey line: moves that do not cut.\n\
         - Lines beside it: orange before, {after} after, deviations {factor}. Tabs of sizes: true scale, dark blue is 0, yellow \
         {top} mm.\n\
         - Light arrows: where the tool points.",
        after = if scene.reports.len() > 1 { "other colours" } else { "blue" },
        top = plan.scale.top_mm
    );
    if plan.first.points.iter().any(|p| p.status == MotionStatus::Flagged) {
        text.push_str("- Yellow points: flagged.\n");
    }
    if plan.first.points.iter().any(|p| p.status == MotionStatus::Refused) {
        text.push_str("- Purple points: refused.\n");
    }
    let _ = writeln!(
        text,
        "- Curves: orange before, {after}; thin grey ±1σ as predicted.\n\n\
         Lengths are mm, in space too, in the base of the arm with z up. Time counts path points from 0.",
        after = if scene.reports.len() > 1 { "other colours after, by model" } else { "blue after" }
    );
}
