//! Curves over the path: deviation along the normal, its size, the angle, and the change of the joints.

use re_sdk_types::components::MarkerShape;

use super::scene::{AXIS, PathScene, Plan};
use crate::colour::{BEFORE, FLAGGED, JOINTS, REFUSED, SIGMA, after};
use crate::curve::{self, Pen, curve};
use crate::page::{Pane, View};
use crate::recording::{Store, VisualError};
use truegrind_compensation::deviation::{After, Deviation, MotionStatus, PathPoint, PathReport};

/// Marks on a curve at most.
const MARKS: usize = 40;

/// A figure of a deviation.
type Figure = fn(&Deviation) -> Option<f64>;

pub(super) fn draw(store: &mut Store, scene: &PathScene<'_>, plan: &Plan<'_>) -> Result<(), VisualError> {
    let figures: [(&str, Figure); 3] = [
        ("normal", |d| d.normal_mm),
        ("size", |d| Some(d.norm_mm())),
        ("angle", |d| Some(d.angle_rad.to_degrees())),
    ];
    for (folder, figure) in figures {
        for &k in &plan.befores {
            let name = plan.before_name(scene, k);
            let path = match k {
                0 => format!("deviation/{folder}/before"),
                k => format!("deviation/{folder}/before_{}", plan.names[k]),
            };
            let pen = Pen { name: &name, colour: BEFORE, width: 1.6 };
            let values = over(&scene.reports[k], |p| p.before.as_ref().and_then(figure));
            curve(store, &path, AXIS, pen, &values)?;
        }
        for (k, report) in scene.reports.iter().enumerate() {
            let name = after_name(report);
            let pen = Pen { name: &name, colour: after(k), width: 2.0 };
            let values = over(report, |p| p.after.as_ref().and_then(figure));
            curve(store, &format!("deviation/{folder}/after/{}", plan.names[k]), AXIS, pen, &values)?;
        }
    }
    sigma(store, scene)?;
    marks(store, plan)?;
    for (joint, colour) in JOINTS.into_iter().enumerate() {
        let change =
            over(plan.first, |p| Some((p.joints_after?[joint] - p.joints_before?[joint]).to_degrees()));
        let name = format!("joint {}", joint + 1);
        let pen = Pen { name: &name, colour, width: 1.4 };
        curve(store, &format!("joints/change/{}", joint + 1), AXIS, pen, &change)?;
    }
    Ok(())
}

/// The band in which one in three points is off by more, from the first report that has one.
fn sigma(store: &mut Store, scene: &PathScene<'_>) -> Result<(), VisualError> {
    let of = |r: &PathReport| over(r, |p| sigma_of(r, p));
    let Some(sigma) = scene.reports.iter().map(of).find(|s| !s.is_empty()) else { return Ok(()) };
    let pen = |name| Pen { name, colour: SIGMA, width: 1.0 };
    curve(store, "deviation/size/sigma", AXIS, pen("predicted 1σ"), &sigma)?;
    if scene.reports.iter().any(has_normals) {
        curve(store, "deviation/normal/sigma_above", AXIS, pen("predicted +1σ"), &sigma)?;
        let below: Vec<(i64, f64)> = sigma.iter().map(|(t, s)| (*t, -s)).collect();
        curve(store, "deviation/normal/sigma_below", AXIS, pen("predicted −1σ"), &below)?;
    }
    Ok(())
}

/// Flagged and refused points, on the curve of sizes; of very many so few that the curve still shows.
fn marks(store: &mut Store, plan: &Plan<'_>) -> Result<(), VisualError> {
    for (status, name, colour, shape) in [
        (MotionStatus::Flagged, "flagged", FLAGGED, MarkerShape::Diamond),
        (MotionStatus::Refused, "refused", REFUSED, MarkerShape::Cross),
    ] {
        let marked = over(plan.first, |p| {
            let at = p.before.or(p.after)?;
            (p.status == status).then(|| at.norm_mm())
        });
        if marked.is_empty() {
            continue;
        }
        let every = marked.len().div_ceil(MARKS);
        let marked: Vec<(i64, f64)> = marked.into_iter().step_by(every).collect();
        let path = format!("deviation/size/{name}");
        curve::points(store, &path, AXIS, (name, colour, shape), &marked)?;
    }
    Ok(())
}

fn after_name(report: &PathReport) -> String {
    let kind = match report.after {
        After::PredictedRemainder => "what the solver leaves",
        After::Achieved => "achieved",
    };
    format!("after · {} ({kind})", report.model)
}

fn has_normals(report: &PathReport) -> bool {
    report.points.iter().any(|p| p.before.or(p.after).is_some_and(|d| d.normal_mm.is_some()))
}

/// A figure of every point that has one, with the point's index.
fn over(report: &PathReport, figure: impl Fn(&PathPoint) -> Option<f64>) -> Vec<(i64, f64)> {
    let at = |p: &PathPoint| figure(p).filter(|v| v.is_finite()).map(|v| (p.index as i64, v));
    report.points.iter().filter_map(at).collect()
}

/// The sigma of a point of the cut. On the way there the arm's place counts, also where the shape of the cut alone is corrected:
/// its sigma would flatten the cut's.
fn sigma_of(report: &PathReport, point: &PathPoint) -> Option<f64> {
    let cuts = || report.points.iter().any(|point| point.cutting);
    point.sigma_mm.filter(|_| point.cutting || !cuts())
}

/// From the lowest to the highest of what a plot shows, with room for its legend.
fn range(scene: &PathScene<'_>, figure: Figure, with_sigma: bool, both_ways: bool) -> Option<[f64; 2]> {
    let points = || scene.reports.iter().flat_map(|r| &r.points);
    let deviations = points().flat_map(|p| [p.before, p.after]).flatten().filter_map(|d| figure(&d));
    let sigmas = scene.reports.iter().flat_map(|r| r.points.iter().filter_map(|p| sigma_of(r, p)));
    let sigmas = sigmas.filter(|_| with_sigma);
    let below = sigmas.clone().map(|s| -s).filter(|_| both_ways);
    let names = 1 + scene.reports.len() + if with_sigma { 1 + usize::from(both_ways) } else { 0 };
    curve::range(deviations.chain(sigmas).chain(below), names)
}

/// The curves' part of the page.
pub(super) fn panes(scene: &PathScene<'_>) -> Pane {
    let view = |name: &str, folder: &str, range: Option<[f64; 2]>| {
        Pane::View(View::curves(name, &[format!("+ /{folder}/**").as_str()], range))
    };
    let of_size = range(scene, |d| Some(d.norm_mm()), true, false);
    let size = view("Size of the deviation [mm] over the path", "deviation/size", of_size);
    let of_angle = range(scene, |d| Some(d.angle_rad.to_degrees()), false, false);
    let changes = scene.reports.first().into_iter().flat_map(|report| &report.points).filter_map(|p| {
        let change = p.joints_after? - p.joints_before?;
        Some([change.min().to_degrees(), change.max().to_degrees()])
    });
    let changes: Vec<f64> = changes.flatten().collect();
    let changed = !changes.is_empty();
    let others = [
        view("Angle of the tool's deviation [°]", "deviation/angle", of_angle),
        view("Change of the joints, after − before [°]", "joints/change", curve::range(changes, 6)),
    ];
    // Joints that nothing changes have no curve.
    let others = others.into_iter().take(if changed { 2 } else { 1 });
    if scene.reports.iter().any(has_normals) {
        let of_normal = range(scene, |d| d.normal_mm, true, true);
        let normal = view("Deviation along the normal [mm] over the path", "deviation/normal", of_normal);
        let second = Pane::Tabs(std::iter::once(size).chain(others).collect());
        Pane::Row(vec![(1.0, normal), (1.0, second)])
    } else {
        Pane::Row(vec![(1.0, size), (1.0, Pane::Tabs(others.rev().collect()))])
    }
}
