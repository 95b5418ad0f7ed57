//! The path of a tool over a surface: passes, tool frames, approach, retract and links.
//!
//! **Method.** A pattern is a family of curves over the plan of the surface . The distance between neighbouring
//! curves is the step-over, or follows from the scallop height ([`sampling`](super::sampling)); along a curve,
//! points are as far apart as the chord error and the largest step allow. Each point gets a tool frame ([`frame`]).
//! Passes are joined by a retract along the normal, a link that stays clear of the surface, and an approach along
//! the normal .
//!
//! **Shapes.** A list of [`PathPoint`], in the order in which the tool visits them, in the surface's frame (the
//! work object).
//!
//! **Stops.** Never iterates without bound: the number of passes and points is known before they are made, and a
//! path of more than [`PathOptions::MAX_POINTS`] points is refused.
//!
//! **Source and departures.** ltlm-2024, "Grinding compensation experiment", takes path points from the surface
//! equation of the component and prints no more; pattern, spacing and frames here are the usual ones of
//! computer-aided manufacturing.
//!
//! **Checked against.** The cusp measured between two neighbouring passes of a ball on a plane and on a cylinder, chord
//! errors measured on the surface, frames right-handed and at the stated angle to the normal.

mod options;
mod pattern;
pub mod frame;
mod link;

use nalgebra::{Point3, Translation3, Unit, UnitQuaternion, Vector3};

use super::budget::Budget;
use super::sampling::{MAX_CURVE_SAMPLES, Steps, Trace};
use crate::contact::Contact;
use crate::error::SurfaceError;
use crate::surface::Surface;
use truegrind_math::se3::Pose;

pub use options::{Along, PathOptions, Pattern, Spacing, ToolX, Traverse};

/// Kind of motion to a point.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum PointKind {
    /// Descends along the normal, not yet in contact: the point above the first cut of a pass.
    Approach,
    /// In contact with the surface.
    Cut,
    /// Lifts off along the normal: the point above the last cut of a pass.
    Retract,
    /// Moves above the surface from one pass to the next.
    Link,
}

/// One point of a path, in the surface's frame (the work object).
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PathPoint {
    /// Position of the TCP. On a cut this is the contact point; lead and tilt rotate the tool about it.
    pub position_mm: Point3<f64>,
    /// Outward unit normal of the surface at the contact point (of an approach, retract or link: at the point below).
    pub normal: Unit<Vector3<f64>>,
    /// Unit feed direction, tangential to the surface.
    pub feed: Unit<Vector3<f64>>,
    /// Orientation of the tool. The columns of its rotation matrix are the tool's axes: z points into the surface, the
    /// frame is right-handed.
    pub orientation: UnitQuaternion<f64>,
    /// Kind of motion to this point.
    pub kind: PointKind,
    /// Pass of the point, counted from 0 in the order of cutting; a link belongs to the pass it leads to.
    pub pass: usize,
}

impl PathPoint {
    /// The tool frame as a pose: position and orientation in the surface's frame (the work object).
    pub fn work_object_from_tool(&self) -> Pose {
        Pose::from_parts(Translation3::from(self.position_mm), self.orientation)
    }

    /// The direction in which the tool points, into the surface.
    pub fn tool_z(&self) -> Unit<Vector3<f64>> {
        self.orientation * Vector3::z_axis()
    }
}

/// A point in contact, before it has a tool frame.
struct Cut {
    contact: Contact,
    feed: Unit<Vector3<f64>>,
    /// Reference direction of lead, tilt and a tool x along the feed: the feed, interpolated evenly through a corner.
    heading: Unit<Vector3<f64>>,
}

/// The path that `options` describe over `surface`.
///
/// Passes follow each other as approach, cuts, retract, then links where the straight way would come too close to
/// the surface. A pass that leaves the surface (a hole in a mesh) is taken up again as a pass of its own.
/// Quaternions are continuous in sign.
///
/// ```
/// use truegrind_surfaces::path::{self, PathOptions};
/// use truegrind_surfaces::{Domain, Explicit, PointKind, Surface};
///
/// let domain = Domain { first: [-50.0, 50.0], second: [-30.0, 30.0] };
/// let bump = Surface::Explicit(Explicit::new("10 - x^2/400 - y^2/900", domain)?);
/// let points = path::over(&bump, &PathOptions::default())?;
/// assert_eq!(points[0].kind, PointKind::Approach);
/// assert!(points.iter().filter(|p| p.kind == PointKind::Cut).all(|p| p.tool_z().dot(&p.normal) < -0.999));
/// # Ok::<(), truegrind_surfaces::SurfaceError>(())
/// ```
///
/// # Errors
/// Options out of range, a hollow into which the tool does not fit, a pattern that nowhere meets the surface, more than
/// [`PathOptions::MAX_POINTS`] points, or a fixed direction of the tool's x axis that is along the tool.
pub fn over(surface: &Surface, options: &PathOptions) -> Result<Vec<PathPoint>, SurfaceError> {
    options.check()?;
    let budget = Budget::of(surface);
    let curves = pattern::curves(surface, options, &budget)?;
    // The chords of a few samples are no longer than the curve: what is refused here is certainly too long.
    let mut least = 0.0;
    for curve in &curves {
        least += total_mm(trace(surface, curve, curve.initial_samples() / 4, &budget)?);
    }
    if least / options.max_step_mm > PathOptions::MAX_POINTS as f64 {
        return Err(SurfaceError::TooLong { limit: PathOptions::MAX_POINTS });
    }
    let mut passes = Vec::new();
    let mut count = 0;
    for curve in curves {
        for pass in cuts(surface, &curve, options, PathOptions::MAX_POINTS - count, &budget)? {
            count += pass.len() + 2;
            if count > PathOptions::MAX_POINTS {
                return Err(SurfaceError::TooLong { limit: PathOptions::MAX_POINTS });
            }
            passes.push(pass);
        }
    }
    if passes.is_empty() {
        return Err(SurfaceError::NoPass);
    }
    joined(surface, options, &passes, &budget)
}

/// The parts of a curve that lie on the surface, sampled in `intervals` intervals.
///
/// # Errors
/// A budget with fewer evaluations left.
fn trace(
    surface: &Surface,
    curve: &pattern::Curve,
    intervals: usize,
    budget: &Budget,
) -> Result<Vec<Trace>, SurfaceError> {
    budget.charge(intervals + 1)?;
    let domain = surface.domain();
    let point = |share: f64| surface.contact(domain.at(curve.place(share))).map(|c| c.position_mm);
    Ok(Trace::runs(point, 0.0, 1.0, intervals))
}

fn total_mm(runs: Vec<Trace>) -> f64 {
    runs.iter().map(Trace::length_mm).sum()
}

/// The cuts along one curve; one list for each part of it on the surface.
fn cuts(
    surface: &Surface,
    curve: &pattern::Curve,
    options: &PathOptions,
    room: usize,
    budget: &Budget,
) -> Result<Vec<Vec<Cut>>, SurfaceError> {
    let domain = surface.domain();
    let steps = Steps { max_step_mm: options.max_step_mm, chord_mm: options.chord_mm };
    let contact = |share: f64| surface.contact(domain.at(curve.place(share)));
    let coarse = trace(surface, curve, curve.initial_samples(), budget)?;
    let gap_mm = coarse.iter().map(Trace::coarsest_mm).fold(0.0, f64::max);
    let finer = (8.0 * gap_mm / options.max_step_mm).ceil().max(1.0) as usize;
    let mut intervals = curve.initial_samples().saturating_mul(finer).min(MAX_CURVE_SAMPLES);
    loop {
        let mut closest = usize::MAX;
        let runs: Vec<(Trace, Vec<f64>)> = trace(surface, curve, intervals, budget)?
            .into_iter()
            .map(|run| {
                let (from, to) = (run.shares[0], run.shares[run.shares.len() - 1]);
                let inner = curve.corners().iter().copied().filter(|c| *c > from && *c < to);
                let ends: Vec<f64> = [from].into_iter().chain(inner).chain([to]).collect();
                let mut shares = vec![from];
                for piece in ends.windows(2) {
                    let (divided, fewest) = run.between(piece[0], piece[1]).divided(&steps, room, budget);
                    closest = closest.min(fewest);
                    shares.extend(&divided[1..]);
                }
                (run, shares)
            })
            .collect();
        if runs.iter().map(|(_, shares)| shares.len()).sum::<usize>() > room {
            return Err(SurfaceError::TooLong { limit: PathOptions::MAX_POINTS });
        }
        // Steps over fewer than four samples are judged too coarsely: the chord error needs more, within
        // reason.
        if closest < 4
            && intervals < MAX_CURVE_SAMPLES.min((64 * curve.initial_samples()).saturating_mul(finer))
        {
            intervals *= 2;
            continue;
        }
        budget.charge(EVALUATIONS_PER_CUT * runs.iter().map(|(_, shares)| shares.len()).sum::<usize>())?;
        return Ok(runs
            .iter()
            .map(|(run, shares)| {
                shares.iter().filter_map(|s| cut(&contact, run, *s, curve, options)).collect()
            })
            .filter(|pass: &Vec<Cut>| pass.len() > 1)
            .collect());
    }
}

/// Evaluations of the surface for one point of a path.
const EVALUATIONS_PER_CUT: usize = 5;

/// The contact at a share of a curve, with the direction of the curve there.
fn cut(
    contact: &impl Fn(f64) -> Option<Contact>,
    run: &Trace,
    share: f64,
    curve: &pattern::Curve,
    options: &PathOptions,
) -> Option<Cut> {
    let here = contact(share)?;
    let at_mm = run.length_at(share);
    let along = |reach_mm: f64| {
        let reach_mm = reach_mm.min(0.25 * run.length_mm());
        let point = |away: f64| contact(run.share_at(at_mm + away)).map(|c| c.position_mm);
        let (room_behind, room_ahead) = (at_mm, run.length_mm() - at_mm);
        let difference = if room_behind >= reach_mm && room_ahead >= reach_mm {
            point(reach_mm)? - point(-reach_mm)?
        } else {
            // At an end, the one-sided second-order difference.
            let side = if room_ahead >= room_behind { 1.0 } else { -1.0 };
            let near = point(side * reach_mm)? - here.position_mm;
            let far = point(side * 2.0 * reach_mm)? - here.position_mm;
            (near * 4.0 - far) * side
        };
        let tangential = difference - here.normal.into_inner() * here.normal.dot(&difference);
        Unit::try_new(tangential, f64::MIN_POSITIVE)
    };
    let feed = along(options.max_step_mm / 8.0)?;
    let heading =
        if curve.corners().is_empty() { feed } else { along(2.0 * options.max_step_mm).unwrap_or(feed) };
    Some(Cut { contact: here, feed, heading })
}

/// Passes with their frames, approaches, retracts and links, in one list.
fn joined(
    surface: &Surface,
    options: &PathOptions,
    passes: &[Vec<Cut>],
    budget: &Budget,
) -> Result<Vec<PathPoint>, SurfaceError> {
    let mut points: Vec<PathPoint> = Vec::new();
    let height_mm = options.approach_mm;
    for (pass, cuts) in passes.iter().enumerate() {
        let mut framed = Vec::with_capacity(cuts.len() + 2);
        for cut in cuts {
            let Contact { position_mm, normal, .. } = cut.contact;
            let orientation = frame::orientation(&position_mm, &normal, &cut.heading, options)?;
            framed.push(PathPoint {
                position_mm,
                normal,
                feed: cut.feed,
                orientation,
                kind: PointKind::Cut,
                pass,
            });
        }
        let (Some(first), Some(last)) = (cuts.first(), cuts.last()) else { continue };
        let above = |of: &PathPoint, contact: &Contact, kind| PathPoint {
            position_mm: link::lifted(contact, height_mm),
            kind,
            ..*of
        };
        let approach = above(&framed[0], &first.contact, PointKind::Approach);
        let retract = above(&framed[framed.len() - 1], &last.contact, PointKind::Retract);
        if let (Some(before), Some(cut)) =
            (points.last().copied(), pass.checked_sub(1).and_then(|p| passes[p].last()))
        {
            for stop in link::over(surface, &cut.contact, &first.contact, height_mm, budget)? {
                points.push(PathPoint {
                    position_mm: stop.position_mm,
                    normal: stop.normal,
                    feed: approach.feed,
                    orientation: turned(&before.orientation, &approach.orientation, stop.share),
                    kind: PointKind::Link,
                    pass,
                });
            }
        }
        points.push(approach);
        points.append(&mut framed);
        points.push(retract);
    }
    // A rotation has two quaternions: each point takes the one nearer to the previous, the first the one
    // with w ≥ 0.
    let mut before = UnitQuaternion::identity();
    for point in &mut points {
        if point.orientation.coords.dot(&before.coords) < 0.0 {
            point.orientation = UnitQuaternion::new_unchecked(-point.orientation.into_inner());
        }
        before = point.orientation;
    }
    Ok(points)
}

/// Interpolates two orientations; a half turn, which has no shortest rotation, is made at its end.
fn turned(from: &UnitQuaternion<f64>, to: &UnitQuaternion<f64>, share: f64) -> UnitQuaternion<f64> {
    from.try_slerp(to, share, 1e-9).unwrap_or(*to)
}
