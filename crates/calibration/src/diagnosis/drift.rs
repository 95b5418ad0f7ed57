//! How far sensor or target moved, or links grew, during the measurement. The parameters of a drift are its asymptote, which a short log
//! extrapolates, and terms with different time constants nearly cancel: what was seen is the change of their sum within the logged time.

use crate::measurement::dataset::{Dataset, Row};
use crate::measurement::sensor::disturbance::{Disturbance, Kind, Profile};
use truegrind_arm::effect::Effect;

/// Whether it follows the clock.
pub(super) fn is_in_time(disturbance: &Disturbance) -> bool {
    matches!(disturbance.profile, Profile::Exponential { .. })
        && matches!(disturbance.kind, Kind::Zero | Kind::Frame { .. } | Kind::Target)
}

/// One sentence for drifts of one quantity.
pub(super) fn describe(drifts: &[&Disturbance], dataset: &Dataset) -> String {
    let (moved_mm, hours) = movement(drifts, dataset);
    let size = format!("by {moved_mm:.2} mm during the {} of the measurement", span(hours));
    match drifts.first().map(|d| &d.kind) {
        Some(Kind::Target) => format!("the target creeps on the flange {size}"),
        Some(Kind::Zero) => format!("the cable's zero drifted {size}"),
        _ => format!(
            "the sensor moved relative to the base {size}: its stand or the base of the arm settles or warms up"
        ),
    }
}

/// Whether the links grow by the clock.
pub(super) fn is_growth_in_time(effect: &Effect) -> bool {
    matches!(effect, Effect::ThermalDrift(thermal) if thermal.growth != 0.0)
}

/// One sentence for links that grow by the clock, as the sum of several terms.
pub(super) fn describe_growth(terms: &[&Effect], dataset: &Dataset) -> String {
    let growth = |row: &Row| terms.iter().map(|term| term.growth(&row.condition)).sum::<f64>();
    let ([grown], hours) = largest_change(dataset, |row| [growth(row)]);
    let (grew, warmed) = if grown < 0.0 { ("shrank", "cooled down") } else { ("grew", "warmed up") };
    let size = grown.abs() * 1e6;
    format!(
        "the links {grew} by {size:.0} µm per metre during the {} of the measurement, as the arm {warmed}",
        span(hours)
    )
}

/// How far the sum of `drifts` moved (mm), and the logged time span (h).
fn movement(drifts: &[&Disturbance], dataset: &Dataset) -> (f64, f64) {
    let (moved, hours) = largest_change(dataset, |row| {
        let mut sum = [0.0; 3];
        for drift in drifts {
            let factor = drift.profile.at(row);
            sum.iter_mut().zip(&drift.values).for_each(|(sum, value)| *sum += factor * value);
        }
        sum
    });
    (norm(&moved), hours)
}

/// The largest change of `of` from the first row, and the logged time span (h).
fn largest_change<const N: usize>(dataset: &Dataset, of: impl Fn(&Row) -> [f64; N]) -> ([f64; N], f64) {
    let mut rows: Vec<_> = dataset.rows.iter().filter(|row| row.condition.time_h.is_some()).collect();
    let time = |row: &Row| row.condition.time_h.unwrap_or(0.0);
    rows.sort_by(|a, b| time(a).total_cmp(&time(b)));
    let (Some(first), Some(last)) = (rows.first(), rows.last()) else { return ([0.0; N], 0.0) };
    let start = of(first);
    let change = |row: &Row| {
        let now = of(row);
        std::array::from_fn(|axis| now[axis] - start[axis])
    };
    let changes = rows.iter().map(|&row| change(row));
    let largest = changes.max_by(|a: &[f64; N], b| norm(a).total_cmp(&norm(b)));
    (largest.unwrap_or([0.0; N]), time(last) - time(first))
}

fn norm(vector: &[f64]) -> f64 {
    vector.iter().map(|v| v * v).sum::<f64>().sqrt()
}

/// A time span in hours, or in minutes if it is short.
fn span(hours: f64) -> String {
    if hours < 1.0 { format!("{:.0} min", 60.0 * hours) } else { format!("{hours:.1} h") }
}
