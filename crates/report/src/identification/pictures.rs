//! Plots of an identification.

use super::parameter::{handy, held_by_prior};
use super::tables::{self, signed};
use crate::plot::{Axis, Graph, Histogram, Ink, Interval, Intervals, Reference, Sample, Series};
use truegrind_calibration::identification::identifiability::Identifiability;
use truegrind_calibration::identification::identify::Identification;

const BEFORE: &str = "frames registered";
const AFTER: &str = "geometry";

/// Smaller singular values, relative to the largest, are rounding errors and would stretch the axis.
const MIN_SHARE: f64 = 1e-12;

fn error(found: &Identification) -> Axis {
    Axis::new(if signed(found) { "held-out error, measured minus predicted" } else { "held-out error" }, "mm")
}

/// Histogram of held-out errors before and after.
pub(super) fn frequency(found: &Identification) -> String {
    let sample = |name: &str, ink, value: fn(&(usize, f64, f64)) -> f64| {
        Sample::new(name, found.held_out.iter().map(value).collect::<Vec<_>>()).ink(ink)
    };
    Histogram {
        title: "Held-out errors".to_owned(),
        x: error(found),
        samples: vec![sample(BEFORE, Ink::Vermilion, |row| row.1), sample(AFTER, Ink::Blue, |row| row.2)],
        bins: None,
    }
    .svg()
}

/// Held-out errors by row, before and after.
pub(super) fn by_row(found: &Identification) -> String {
    let rows = tables::by_row(found);
    let points = |value: fn(&(usize, f64, f64)) -> f64| -> Vec<[f64; 2]> {
        rows.iter().map(|row| [row.0 as f64, value(row)]).collect()
    };
    Graph {
        title: "Held-out errors by row".to_owned(),
        x: Axis::new("row of the file", ""),
        y: error(found),
        series: vec![
            Series::points(BEFORE, points(|row| row.1)).ink(Ink::Vermilion),
            Series::points(AFTER, points(|row| row.2)).ink(Ink::Blue),
        ],
        references: vec![Reference::Horizontal(0.0, String::new())],
        ..Graph::default()
    }
    .svg()
}

/// Parameters of the arm in units of their priors.
pub(super) fn parameters(found: &Identification) -> String {
    let rows = found.parameters.iter().filter(|parameter| parameter.is_of_arm()).filter_map(|parameter| {
        let shown = handy(parameter);
        let mut row = Interval::new(
            shown.name,
            shown.unit,
            shown.value - shown.nominal,
            shown.sigma,
            shown.prior_sigma?,
        );
        row.determined = !held_by_prior(parameter);
        Some(row)
    });
    Intervals { title: "Change from the data sheet".to_owned(), rows: rows.collect() }.svg()
}

/// Singular values in decreasing order.
pub(super) fn singular_values(report: &Identifiability) -> String {
    let least = report.singular_values.first().copied().unwrap_or(0.0) * MIN_SHARE;
    let points: Vec<[f64; 2]> = report
        .singular_values
        .iter()
        .enumerate()
        .map(|(index, value)| [(index + 1) as f64, value.max(least)])
        .collect();
    Graph {
        title: "Singular values".to_owned(),
        x: Axis::new("number", ""),
        y: Axis::log("singular value", ""),
        series: vec![Series::points("", points).ink(Ink::Blue)],
        references: vec![Reference::Horizontal(1.0, "equal to the prior".to_owned())],
        ..Graph::default()
    }
    .svg()
}

/// Cost over iterations, one line per round.
pub(super) fn convergence(found: &Identification) -> String {
    let rounds = &found.geometry.rounds;
    let mut iteration = 0usize;
    let series = rounds
        .iter()
        .enumerate()
        .map(|(round, trace)| {
            let points: Vec<[f64; 2]> =
                trace.iter().enumerate().map(|(k, step)| [(iteration + k) as f64, step.cost]).collect();
            iteration += trace.len();
            let name = if rounds.len() > 1 { format!("round {}", round + 1) } else { String::new() };
            Series::line(name, points)
        })
        .collect();
    Graph {
        title: "Cost of the final fit".to_owned(),
        x: Axis::new("iteration", ""),
        y: Axis::log("cost, ½ Σ r² with priors", ""),
        series,
        ..Graph::default()
    }
    .svg()
}
