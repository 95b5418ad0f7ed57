//! How far sensor or target moved, or links grew, during the measurement. The parameters of a drift are its asymptote, which a short log
//! extrapolates, and terms with different time constants nearly cancel: what was seen is the change of their sum within the logged time.
//! The shift of a sensor that turns too is that of its own place, metres from the arm, where a turn and a shift cancel that nobody saw apart:
//! what was seen is how far the target moved against it, v + ω × r, r from the sensor to the middle of the readings.

use nalgebra::Vector3;

use crate::identification::calibration::Frames;
use crate::measurement::dataset::{Dataset, Row};
use crate::measurement::sensor::disturbance::{Disturbance, Kind, Profile};
use truegrind_arm::effect::Effect;

/// Whether it follows the clock.
pub(super) fn is_in_time(disturbance: &Disturbance) -> bool {
    matches!(disturbance.profile, Profile::Exponential { .. })
        && matches!(disturbance.kind, Kind::Zero | Kind::Frame { .. } | Kind::Target)
}

/// One sentence for drifts of one quantity.
pub(super) fn describe(drifts: &[&Disturbance], dataset: &Dataset, frames: &Frames) -> String {
    let (moved_mm, hours) = movement(drifts, dataset, frames);
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

/// The shift (mm) of a disturbance where the readings are that are `among` the rows.
pub(super) fn shift_at_target(
    disturbance: &Disturbance,
    dataset: &Dataset,
    frames: &Frames,
    among: impl Fn(&Row) -> bool,
) -> [f64; 3] {
    let shift = Vector3::from_fn(|axis, _| disturbance.values.get(axis).copied().unwrap_or(0.0));
    let (Kind::Frame { turning: true }, [_, _, _, x, y, z]) = (&disturbance.kind, &disturbance.values[..])
    else {
        return shift.into();
    };
    let rows: Vec<Vector3<f64>> =
        dataset.rows.iter().filter(|row| among(row)).map(|row| row.reading.place_mm()).collect();
    let middle = rows.iter().sum::<Vector3<f64>>() / rows.len().max(1) as f64;
    let away = frames.base_from_sensor.rotation * middle;
    (shift + Vector3::new(*x, *y, *z).cross(&away)).into()
}

/// How far the sum of `drifts` moved (mm), and the logged time span (h).
fn movement(drifts: &[&Disturbance], dataset: &Dataset, frames: &Frames) -> (f64, f64) {
    let shifts: Vec<[f64; 3]> =
        drifts.iter().map(|drift| shift_at_target(drift, dataset, frames, |_| true)).collect();
    let (moved, hours) = largest_change(dataset, |row| {
        let mut sum = [0.0; 3];
        for (drift, shift) in drifts.iter().zip(&shifts) {
            let factor = drift.profile.at(row);
            sum.iter_mut().zip(shift).for_each(|(sum, value)| *sum += factor * value);
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
