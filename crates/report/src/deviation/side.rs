//! The two sides of a correction, and the points that they are judged by.

use nalgebra::Point3;

use truegrind_compensation::deviation::{Deviation, PathPoint, PathReport};

/// Which side of the correction.
pub(super) type Side = fn(&PathPoint) -> Option<Deviation>;

pub(super) const BEFORE: Side = |point| point.before;

pub(super) const AFTER: Side = |point| point.after;

/// Reports by program, in the order in which programs first appear.
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

/// Where the TCP shall be, in the work object.
pub(super) fn intended(point: &PathPoint) -> Point3<f64> {
    point.base_from_object.inverse_transform_point(&Point3::from(point.intended.translation.vector))
}

/// The points that a summary is made of: the cut, or all where nothing cuts.
pub(super) fn cut(report: &PathReport) -> impl Iterator<Item = &PathPoint> {
    let any = report.points.iter().any(|point| point.cutting);
    report.points.iter().filter(move |point| point.cutting || !any)
}

pub(super) fn has(report: &PathReport, side: Side) -> bool {
    report.points.iter().any(|point| side(point).is_some())
}

/// Root mean square of the predicted 1σ over the cut (mm); `None` where no point has one.
pub(super) fn sigma_rms(report: &PathReport) -> Option<f64> {
    let squares: Vec<f64> = cut(report).filter_map(|point| point.sigma_mm.map(|s| s * s)).collect();
    (!squares.is_empty()).then(|| (squares.iter().sum::<f64>() / squares.len() as f64).sqrt())
}
