//! The pictures of methods over cases: the papers' bars of errors and times, errors row by row, convergence.

use super::{over, seconds};
use crate::comparison::experiment::Treatment;
use crate::comparison::protocol::{MethodResult, Study};
use crate::math::statistics::ErrorSummary;
use crate::report::number::Precision;
use crate::report::plot::{Axis, BarGroup, Bars, Graph, Mark, Reference, Series};

pub(super) fn error_bars(study: &Study) -> String {
    let group = |label: &str, figure: fn(&ErrorSummary) -> f64| {
        // A method that diverged has no bar: it would be the only one to be seen.
        let of = |r: &MethodResult| (!diverged(r)).then(|| over(r, figure));
        let all: Vec<Option<(f64, Option<f64>)>> = study.results.iter().map(of).collect();
        BarGroup {
            deviations: all.iter().map(|f| f.and_then(|f| f.1)).collect(),
            ..BarGroup::new(label, all.iter().map(|f| f.map(|f| f.0).filter(|v| v.is_finite())))
        }
    };
    Bars {
        title: "Held-out errors".to_owned(),
        y: Axis::new("error", "mm"),
        names: names(study),
        groups: vec![
            group("RMSE", |s| s.rmse),
            group("mean |e|", |s| s.mean_absolute),
            group("max", |s| s.max),
        ],
        labels: None,
    }
    .svg()
}

pub(super) fn time_bars(study: &Study) -> String {
    Bars {
        title: "Time of one case".to_owned(),
        y: Axis::log("time", "s"),
        names: names(study),
        groups: vec![BarGroup::new("", study.results.iter().map(|r| Some(seconds(r))))],
        labels: Some(Precision::Significant(2)),
    }
    .svg()
}

/// Figure 7 of the papers: the held-out rows of the first case.
pub(super) fn rows(study: &Study) -> String {
    let registered = study.cases.first().map_or(&[][..], |c| c.registered_errors_mm.as_slice());
    let mut series = vec![points("BC", registered)];
    for result in &study.results {
        // One that diverges in any case would be the only one to be seen.
        if let Some(outcome) = result.outcomes.first().filter(|_| !diverged(result)) {
            series.push(points(&result.method.id, &outcome.errors_mm));
        }
    }
    Graph {
        title: "Errors of the held-out rows, first case".to_owned(),
        x: Axis::new("held-out row", ""),
        y: Axis::new("error", "mm"),
        series,
        references: vec![Reference::Horizontal(0.0, String::new())],
        ..Graph::default()
    }
    .svg()
}

fn diverged(result: &MethodResult) -> bool {
    result.outcomes.iter().any(|o| o.diverged)
}

fn points(name: &str, errors: &[f64]) -> Series {
    let points: Vec<[f64; 2]> = errors.iter().enumerate().map(|(i, e)| [i as f64 + 1.0, *e]).collect();
    Series { mark: Mark::Line, ..Series::line(name, points) }
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
        Some(Series::line(result.method.id.clone(), points))
    });
    let x = if by_passes { "passes over the rows" } else { "iteration (1 is the start)" };
    Graph {
        title: "Convergence, first case".to_owned(),
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
