//! Readings that belong to an earlier or a later pose than the angles beside them.

use crate::measurement::dataset::{Dataset, Row};
use crate::measurement::sensor::empirical::{CornerSpeed, EmpiricalFault};

/// A latency, its drift relative to the middle of the logged times.
pub(super) fn fault(dataset: &Dataset) -> EmpiricalFault {
    let times = dataset.rows.iter().filter_map(|row| row.condition.time_h).filter(|t| t.is_finite());
    let (first, last) =
        times.fold((f64::INFINITY, f64::NEG_INFINITY), |(first, last), t| (first.min(t), last.max(t)));
    let middle_s = 0.5 * (first + last) * 3600.0;
    let middle_s = if middle_s.is_finite() { middle_s.round() as i64 } else { 0 };
    EmpiricalFault::Latency { middle_s, corners: CornerSpeed::Mean }
}

/// The latency that was found, by `delay_s`, with other speeds at the corners of the path: those of the side on which the readings are, or the
/// mean of both. None where the path has no corner, since all are the same there.
pub(super) fn variants(fault: EmpiricalFault, delay_s: f64, dataset: &Dataset) -> Vec<EmpiricalFault> {
    let EmpiricalFault::Latency { middle_s, corners } = fault else { return Vec::new() };
    let is_corner = |row: &Row| row.motion().and_then(|m| m.rates).is_some_and(|rates| rates.is_corner());
    if !dataset.rows.iter().any(is_corner) {
        return Vec::new();
    }
    let side = if delay_s < 0.0 { CornerSpeed::Before } else { CornerSpeed::After };
    let others = [side, CornerSpeed::Mean].into_iter().filter(|other| *other != corners);
    others.map(|corners| EmpiricalFault::Latency { middle_s, corners }).collect()
}

/// Whether two faults differ in these speeds alone.
pub(super) fn is_one_law(one: EmpiricalFault, other: EmpiricalFault) -> bool {
    use EmpiricalFault::Latency;
    matches!((one, other), (Latency { .. }, Latency { .. }))
}
