//! Statistics over repeated cases or splits: mean ± standard deviation, in tables and as bars.

use super::number::Precision;
use super::plot::{Axis, BarGroup, Bars};
use super::table::{Cell, Column};
use truegrind_math::statistics::{ErrorSummary, mean_and_deviation};

/// A statistic of errors.
type Figure = fn(&ErrorSummary) -> f64;

/// The statistics by which methods are compared: key, heading, statistic.
const FIGURES: [(&str, &str, Figure); 3] = [
    ("rmse_mm", "RMSE", |e| e.rmse),
    ("mean_absolute_mm", "mean |e|", |e| e.mean_absolute),
    ("max_mm", "max", |e| e.max),
];

/// Mean and, for two or more values, standard deviation; `None` without values.
pub fn spread(values: &[f64]) -> Option<(f64, Option<f64>)> {
    let (mean, deviation) = mean_and_deviation(values);
    (!values.is_empty()).then_some((mean, (values.len() > 1).then_some(deviation)))
}

/// [`spread`] as a table cell.
pub fn cell(values: &[f64]) -> Cell {
    spread(values).map_or(Cell::Missing, |(mean, deviation)| Cell::with_sigma(mean, deviation))
}

/// [`spread`] of one statistic as a table cell.
pub fn over(errors: &[ErrorSummary], figure: Figure) -> Cell {
    cell(&errors.iter().map(figure).collect::<Vec<_>>())
}

/// Columns of RMSE, mean absolute error and maximum.
pub fn columns(decimals: [usize; 3]) -> [Column; 3] {
    std::array::from_fn(|k| Column::number(FIGURES[k].0, FIGURES[k].1, "mm", decimals[k]))
}

/// The cells of these columns.
pub fn cells(errors: &[ErrorSummary]) -> [Cell; 3] {
    FIGURES.map(|(_, _, figure)| over(errors, figure))
}

/// Ratio of errors from which the largest would flatten the others on a linear axis.
const WIDE: f64 = 10.0;

fn is_wide(errors: &[Option<Vec<ErrorSummary>>]) -> bool {
    let means =
        errors.iter().flatten().filter_map(|all| spread(&all.iter().map(|e| e.rmse).collect::<Vec<_>>()));
    let sizes = means.map(|(mean, _)| mean).filter(|mean| mean.is_finite() && *mean > 0.0);
    let (least, most) = sizes.fold((f64::INFINITY, 0.0_f64), |(a, b), size| (a.min(size), b.max(size)));
    most > WIDE * least
}

/// Bar chart of the three statistics for each name; a name without errors has no bar.
pub fn bars(names: Vec<String>, errors: &[Option<Vec<ErrorSummary>>], labels: Option<Precision>) -> String {
    let groups = FIGURES.map(|(_, heading, figure)| {
        let each: Vec<Option<(f64, Option<f64>)>> =
            errors.iter().map(|all| spread(&all.as_ref()?.iter().map(figure).collect::<Vec<_>>())).collect();
        BarGroup {
            deviations: each.iter().map(|one| one.and_then(|(_, deviation)| deviation)).collect(),
            ..BarGroup::new(
                heading,
                each.iter().map(|one| one.map(|(mean, _)| mean).filter(|m| m.is_finite())),
            )
        }
    });
    Bars {
        title: "Held-out errors".to_owned(),
        y: if is_wide(errors) { Axis::log("error", "mm") } else { Axis::new("error", "mm") },
        names,
        groups: groups.into(),
        labels,
    }
    .svg()
}
