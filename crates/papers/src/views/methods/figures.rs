//! The pictures of methods over cases: the papers' bars of errors and times, errors row by row, convergence.

use crate::experiment::Treatment;
use crate::protocol::{MethodResult, Study};
use crate::views::study::{held_out, seconds};
use truegrind_report::number::Precision;
use truegrind_report::plot::{Axis, BarGroup, Bars, Graph, Ink, Reference, Series};
use truegrind_report::repeated;

/// A method that diverged has no bar: it would be the only one to be seen.
pub(super) fn error_bars(study: &Study) -> String {
    let errors: Vec<_> = study.results.iter().map(held_out).collect();
    repeated::bars(names(study), &errors, None)
}

pub(super) fn time_bars(study: &Study) -> String {
    Bars {
        title: "Time of one case".to_owned(),
        y: Axis::log("time", "ms"),
        names: names(study),
        groups: vec![BarGroup::new("", study.results.iter().map(|r| Some(1e3 * seconds(r))))],
        labels: Some(Precision::Significant(2)),
    }
    .svg()
}

/// Most methods of one picture of rows: more lines cannot be told apart.
const PANEL: usize = 4;

/// Figure 7 of the papers: the held-out rows of the first case, each picture with the start beside a few methods.
pub(super) fn rows(study: &Study) -> Vec<String> {
    let registered = study.cases.first().map_or(&[][..], |c| c.registered_errors_mm.as_slice());
    let (printed, sound): (Vec<_>, Vec<_>) = study
        .results
        .iter()
        .filter(|r| !diverged(r))
        .filter_map(|r| Some((r, r.outcomes.first()?)))
        .partition(|(r, _)| r.treatment == Treatment::Printed);
    let panels = printed.chunks(PANEL).chain(sound.chunks(PANEL));
    panels
        .map(|panel| {
            let start = Series::line("BC", numbered(registered)).ink(Ink::Text);
            let each = panel.iter().zip([Ink::Vermilion, Ink::Blue, Ink::Green, Ink::Purple]);
            let each = each.map(|((r, o), ink)| Series::line(&r.method.id, numbered(&o.errors_mm)).ink(ink));
            let ids: Vec<&str> = panel.iter().map(|(r, _)| r.method.id.as_str()).collect();
            Graph {
                title: format!("Errors of the held-out rows, first case: {}", ids.join(", ")),
                x: Axis::new("held-out row", ""),
                y: Axis::new("error", "mm"),
                series: std::iter::once(start).chain(each).collect(),
                references: vec![Reference::Horizontal(0.0, String::new())],
                ..Graph::default()
            }
            .svg()
        })
        .collect()
}

fn diverged(result: &MethodResult) -> bool {
    result.outcomes.iter().any(|o| o.diverged)
}

fn numbered(errors: &[f64]) -> Vec<[f64; 2]> {
    errors.iter().enumerate().map(|(i, e)| [i as f64 + 1.0, *e]).collect()
}

/// Figures 8 (ltlm-2024) and 6 (ukf-vslm-2023).
pub(super) fn curves(study: &Study, by_passes: bool) -> String {
    let series = study.results.iter().filter(|r| r.treatment == Treatment::Printed).filter_map(|result| {
        let outcome = result.outcomes.first()?;
        // A curve that diverges leaves the picture where it is ten times above the start.
        let highest = 10.0 * outcome.curve.first()?.rmse;
        let points: Vec<[f64; 2]> = outcome
            .curve
            .iter()
            .take_while(|c| c.rmse <= highest)
            .map(|c| if by_passes { [c.passes.max(1.0), c.rmse] } else { [c.iteration as f64 + 1.0, c.rmse] })
            .collect();
        // One that leaves at once has no line, and no place in the legend.
        (points.len() > 1).then(|| Series::line(result.method.id.clone(), points))
    });
    let x = if by_passes { "passes over the rows" } else { "iteration (1 is the start)" };
    Graph {
        title: format!("Convergence over {}, first case", if by_passes { "passes" } else { "iterations" }),
        x: Axis::log(x, ""),
        y: Axis::log("RMSE of the fit", "mm"),
        series: series.collect(),
        ..Graph::default()
    }
    .svg()
}

fn names(study: &Study) -> Vec<String> {
    study.results.iter().map(|r| r.method.id.clone()).collect()
}
