//! How far sensor or target moved during the measurement. The parameters of a drift are its asymptote, which a short log extrapolates, and
//! terms with different time constants nearly cancel: what was seen is the movement of their sum within the logged time.

use crate::measurement::dataset::Dataset;
use crate::measurement::sensor::disturbance::{Disturbance, Kind, Profile};

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

/// The largest distance (mm) from where it was in the first row, and the logged time span (h).
fn movement(drifts: &[&Disturbance], dataset: &Dataset) -> (f64, f64) {
    let mut rows: Vec<_> = dataset.rows.iter().filter(|row| row.condition.time_h.is_some()).collect();
    let time = |row: &crate::measurement::dataset::Row| row.condition.time_h.unwrap_or(0.0);
    rows.sort_by(|a, b| time(a).total_cmp(&time(b)));
    let (Some(first), Some(last)) = (rows.first(), rows.last()) else { return (0.0, 0.0) };
    let moved = |row| {
        let mut sum = [0.0; 3];
        for drift in drifts {
            let factor = drift.profile.at(row) - drift.profile.at(first);
            sum.iter_mut().zip(&drift.values).for_each(|(sum, value)| *sum += factor * value);
        }
        sum.iter().map(|v| v * v).sum::<f64>().sqrt()
    };
    (rows.iter().map(|&row| moved(row)).fold(0.0, f64::max), time(last) - time(first))
}

/// A time span in hours, or in minutes if it is short.
fn span(hours: f64) -> String {
    if hours < 1.0 { format!("{:.0} min", 60.0 * hours) } else { format!("{hours:.1} h") }
}
