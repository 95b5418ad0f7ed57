//! Deviation before and after the correction.

use nalgebra::Point3;

use truegrind_compensation::deviation::{Deviation, PathPoint, PathReport};

/// Selects the deviation before or after the correction.
pub(super) type Side = fn(&PathPoint) -> Option<Deviation>;

pub(super) const BEFORE: Side = |point| point.before;

pub(super) const AFTER: Side = |point| point.after;

/// Reports grouped by program, in order of first appearance.
pub(super) fn by_program(reports: &[PathReport]) -> Vec<(&str, Vec<&PathReport>)> {
    let mut out: Vec<(&str, Vec<&PathReport>)> = Vec::new();
    for report in reports {
        match out.iter_mut().find(|(program, _)| *program == report.program) {
            Some((_, group)) => group.push(report),
            None => out.push((&report.program, vec![report])),
        }
    }
    out
}

/// Intended position of the TCP in the work object frame.
pub(super) fn intended(point: &PathPoint) -> Point3<f64> {
    point.base_from_object.inverse_transform_point(&Point3::from(point.intended.translation.vector))
}

pub(super) fn has(report: &PathReport, side: Side) -> bool {
    report.points.iter().any(|point| side(point).is_some())
}
