//! Plots of a degrading arm: the paper's Figs 4, 7 and 9 to 14, with additional curves.

use super::series::{SIMULATED, after_of, pose_counts};
use crate::degradation::{Count, DegradationResult, Run, Step};
use truegrind_report::document::{Block, Document, Figure};
use truegrind_report::plot::{Axis, Graph, Reference, Series};

/// Fig. 4.
pub(super) fn groups(page: &mut Document, result: &DegradationResult) {
    let series = vec![
        by_group(result, "nominal arm", &result.nominal_mm),
        by_group(result, "calibrated once", &result.neglected_mm),
    ];
    page.figure(
        over_time(result, "Mean position error of each group", series, Axis::new("mean error", "mm")),
        "The paper's Fig. 4 shows the nominal arm. Simulated: links warm up, joint zeros drift. The improvement of the first \
         calibration is lost within hours.",
    );
}

/// Fig. 7.
pub(super) fn counts(page: &mut Document, result: &DegradationResult) {
    let points = |figure: fn(&Count) -> f64| -> Vec<[f64; 2]> {
        result.counts.iter().map(|c| [c.poses as f64, figure(c)]).collect()
    };
    page.figure(
        Graph {
            title: format!("Mean error after the first group, {SIMULATED}"),
            x: Axis::new("poses", ""),
            y: Axis::log("mean error", "mm"),
            series: vec![
                Series::line("identification poses", points(|c| c.identification_mm)),
                Series::line("verification poses", points(|c| c.verification_mm)),
            ],
            references: vec![floor(result)],
            ..Graph::default()
        }
        .svg(),
        "The paper's Fig. 7: RLS over the number of poses of the first group, known frames, tolerances as prior. Few poses \
         are overfitted.",
    );
}

/// All methods in one plot for each number of poses.
pub(super) fn strategies(page: &mut Document, result: &DegradationResult) {
    for count in pose_counts(result) {
        let series = result
            .runs
            .iter()
            .filter(|j| j.count == count)
            .map(|j| by_step(result, j, j.strategy.name(), after_of))
            .collect();
        page.figure(
            over_time(
                result,
                &format!("{count} poses of each group"),
                series,
                Axis::log("mean error after, verification poses", "mm"),
            ),
            "Each method starts from its result of the previous group.",
        );
    }
}

/// Figs 9 to 14: one method and number of poses each, identification (a) and verification poses (b).
pub(super) fn of_the_paper(page: &mut Document, result: &DegradationResult) {
    for stated in &result.settings.paper {
        let Some(figure) = &stated.figure else { continue };
        let of =
            |j: &&Run| j.count == stated.count && j.strategy.paper_name() == Some(stated.method.as_str());
        let Some(run) = result.runs.iter().find(of) else { continue };
        let panel = |part: &str, poses: &str, before: fn(&Step) -> f64, after: fn(&Step) -> f64| {
            let series = vec![
                by_group(result, "nominal arm", &result.nominal_mm),
                by_step(result, run, "before", before),
                by_step(result, run, "after", after),
            ];
            let title =
                format!("{} with {} poses of each group, {poses} poses", run.strategy.name(), run.count);
            Block::Figure(Figure::new(
                over_time(result, &title, series, Axis::log("mean error", "mm")),
                format!(
                    "The paper's {figure}({part}). Before: with the estimate of the previous group, for the first group the \
                     nominal arm."
                ),
            ))
        };
        page.push(Block::Details {
            summary: format!("{figure}: {} with {} poses, group by group", run.strategy.name(), run.count),
            blocks: vec![
                panel("a", "identification", |s| s.identification_before_mm, |s| s.identification_after_mm),
                panel("b", "verification", |s| s.verification_before_mm, after_of),
            ],
        });
    }
}

fn over_time(result: &DegradationResult, title: &str, series: Vec<Series>, y: Axis) -> String {
    Graph {
        title: format!("{title}, {SIMULATED}"),
        x: Axis::new("time", "h"),
        y,
        series,
        references: vec![floor(result)],
        ..Graph::default()
    }
    .svg()
}

fn floor(result: &DegradationResult) -> Reference {
    Reference::Horizontal(result.noise_floor_mm, "sensor alone".to_owned())
}

fn hours(result: &DegradationResult, group: usize) -> f64 {
    result.settings.hours_apart * group as f64
}

fn by_group(result: &DegradationResult, name: &str, values: &[f64]) -> Series {
    let points: Vec<[f64; 2]> = values.iter().enumerate().map(|(g, v)| [hours(result, g), *v]).collect();
    Series::line(name, points)
}

fn by_step(result: &DegradationResult, run: &Run, name: &str, figure: fn(&Step) -> f64) -> Series {
    let points: Vec<[f64; 2]> = run.steps.iter().map(|s| [hours(result, s.group), figure(s)]).collect();
    Series::line(name, points)
}
