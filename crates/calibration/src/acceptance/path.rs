//! Path accuracy and path repeatability (ISO 9283, positions) of the measured paths.
//!
//! Method. x_ci are the m sampling points of the commanded path. The attained path j of n intersects the plane normal to the
//! commanded path through x_ci at x_ij:
//!
//! > x̄_i = Σ_j x_ij / n, AT = max_i |x̄_i − x_ci|, l_ij = |x_ij − x̄_i|, RT = max_i (l̄_i + 3 S_i), S_i² = Σ_j (l_ij − l̄_i)² / (n − 1)
//!
//! A reading slightly earlier or later along the path therefore has no effect.
//! Shapes. Rows with path, cycle and sample; the sampling points are those of every cycle. At least ten cycles are required. A
//! reading can be early or late by a twentieth of the path plus one point.
//! Source and departures. ISO 9283:1998, path characteristics. The commanded path is the target's position under the model at
//! the logged joints, averaged over the cycles, since pose accuracy is also stated under the model. Its direction at a point is
//! the mean of those from and to the neighbours. A path is straight between two readings; its first and last piece are extended
//! by their own length. A point that some cycle does not pass is omitted and counted.
//! Checked against. A path with figures calculated by hand (`tests/it/acceptance/path.rs`).

use std::collections::{BTreeMap, BTreeSet};
use std::ops::Range;

use nalgebra::{Point3, Vector3};
use truegrind_arm::model::Model;
use truegrind_math::se3::Pose;
use truegrind_math::statistics::{ErrorSummary, largest};

use super::error::AcceptError;
use crate::identification::calibration::Frames;
use crate::identification::fit::Observations;
use crate::measurement::dataset::Reading;

/// Cycles of a path for path accuracy and repeatability (ISO 9283).
pub const PATH_CYCLES: usize = 10;
/// Fewest sampling points of a path.
pub const PATH_POINTS: usize = 3;

/// Result for one path.
#[derive(Debug, Clone, PartialEq)]
pub struct PathFound {
    /// Name.
    pub path: String,
    /// Number of cycles.
    pub cycles: usize,
    /// Sampling points that every cycle contains and passes.
    pub points: usize,
    /// Sampling points omitted because some cycle does not contain or pass them.
    pub left_out: usize,
    /// The largest distance from the commanded path to the barycentre of the attained paths (mm); the path accuracy if there
    /// are [`PATH_CYCLES`] cycles. `None` for fewer than [`PATH_POINTS`] points.
    pub deviation_mm: Option<f64>,
    /// The path repeatability (mm), if there are [`PATH_CYCLES`] cycles.
    pub repeatability_mm: Option<f64>,
}

impl PathFound {
    /// The path accuracy (mm), if there are enough cycles.
    pub fn accuracy_mm(&self) -> Option<f64> {
        self.deviation_mm.filter(|_| self.cycles >= PATH_CYCLES)
    }
}

type Position = Vector3<f64>;

/// The rows of one path, by cycle and sampling point.
type Cycles = BTreeMap<u32, BTreeMap<u32, usize>>;

/// Every path of the rows, in the order of first appearance.
pub(super) fn found(
    observed: &Observations,
    model: &Model,
    frames: &Frames,
) -> Result<Vec<PathFound>, AcceptError> {
    let mut names: Vec<&str> = Vec::new();
    let mut paths: Vec<Cycles> = Vec::new();
    for (at, row) in observed.dataset.rows.iter().enumerate() {
        let Some(point) = row.path() else { continue };
        let which = names.iter().position(|name| *name == point.path).unwrap_or_else(|| {
            names.push(&point.path);
            paths.push(Cycles::new());
            names.len() - 1
        });
        let before = paths[which].entry(point.cycle).or_default().insert(point.sample, at);
        if let Some(before) = before {
            let first = observed.dataset.rows[before].number;
            let file = observed.dataset.file.clone();
            return Err(AcceptError::PointTwice { file, rows: [first, row.number], point: point.clone() });
        }
    }
    Ok(names.iter().zip(&paths).map(|(name, cycles)| one(name, cycles, observed, model, frames)).collect())
}

fn one(name: &str, cycles: &Cycles, observed: &Observations, model: &Model, frames: &Frames) -> PathFound {
    let all: BTreeSet<u32> = cycles.values().flat_map(BTreeMap::keys).copied().collect();
    let shared: Vec<u32> =
        all.iter().copied().filter(|sample| cycles.values().all(|rows| rows.contains_key(sample))).collect();
    let commanded: Vec<Position> = shared
        .iter()
        .map(|sample| {
            let positions = cycles.values().map(|rows| {
                let row = &observed.dataset.rows[rows[sample]];
                let flange = model.at_condition(&row.condition).forward(&row.joints);
                (flange * frames.flange_from_target).translation.vector
            });
            positions.sum::<Position>() / cycles.len() as f64
        })
        .collect();
    let attained: Vec<Vec<Position>> = cycles
        .values()
        .map(|rows| {
            let position = |sample| seen(observed, rows[sample], &frames.base_from_sensor);
            shared.iter().filter_map(position).collect()
        })
        .collect();
    let measures = characteristics(&commanded, &attained);
    let enough = measures.len() >= PATH_POINTS;
    PathFound {
        path: name.to_owned(),
        cycles: cycles.len(),
        points: measures.len(),
        left_out: all.len() - measures.len(),
        deviation_mm: enough.then(|| largest(measures.iter().map(|point| point.deviation_mm))),
        repeatability_mm: (enough && cycles.len() >= PATH_CYCLES)
            .then(|| largest(measures.iter().map(|point| point.repeatability_mm))),
    }
}

/// A sampling point over all cycles.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Passed {
    /// Distance from the commanded point to the barycentre of the cycles' intersections with its plane (mm).
    pub deviation_mm: f64,
    /// Mean distance from the barycentre and three standard deviations of it (mm).
    pub repeatability_mm: f64,
}

/// The points of a commanded path whose normal plane every attained path intersects (mm). Readings of the attained paths have
/// the same indices as the points.
pub fn characteristics(commanded: &[Position], attained: &[Vec<Position>]) -> Vec<Passed> {
    let reach = 1 + commanded.len() / 20;
    let at = |point: usize| {
        let along = direction(commanded, point)?;
        let near = point.saturating_sub(reach + 1)..point + reach + 1;
        let passed: Vec<Position> = attained
            .iter()
            .map(|path| passing(path, near.clone(), &commanded[point], &along))
            .collect::<Option<_>>()?;
        let barycentre = passed.iter().sum::<Position>() / passed.len() as f64;
        let distances = ErrorSummary::of(passed.iter().map(|position| (position - barycentre).norm()));
        Some(Passed {
            deviation_mm: (barycentre - commanded[point]).norm(),
            repeatability_mm: distances.mean + 3.0 * distances.standard_deviation,
        })
    };
    (0..commanded.len()).filter_map(at).collect()
}

/// Direction of a path at one of its points: the mean of the unit directions from and to the neighbours, so that both cross
/// the plane even if their lengths are very different. `None` if the path reverses or does not move.
fn direction(path: &[Position], point: usize) -> Option<Position> {
    let piece = |from: usize| (path.get(from + 1)? - path[from]).try_normalize(f64::EPSILON);
    let here = [point.checked_sub(1).and_then(piece), piece(point)];
    here.into_iter().flatten().sum::<Position>().try_normalize(1e-6)
}

/// Intersection of a path with the plane through a point normal to `along`, in that direction, on one of the pieces `near`;
/// the one nearest to the point.
fn passing(path: &[Position], near: Range<usize>, point: &Position, along: &Position) -> Option<Position> {
    let last = path.len().checked_sub(2)?;
    let passages = (near.start..near.end.min(last + 1)).filter_map(|k| {
        let [from, to] = [path[k], path[k + 1]];
        let height = (from - point).dot(along);
        let climb = (to - from).dot(along);
        if climb.is_nan() || climb <= 0.0 {
            return None;
        }
        // First and last piece are extended by their own length.
        let (least, most) = (if k == 0 { -1.0 } else { 0.0 }, if k == last { 2.0 } else { 1.0 });
        let share = -height / climb;
        (least..=most).contains(&share).then(|| from + (to - from) * share)
    });
    passages.min_by(|a, b| (a - point).norm().total_cmp(&(b - point).norm()))
}

/// Measured position of the target in the base (mm).
pub(super) fn seen(observed: &Observations, row: usize, base_from_sensor: &Pose) -> Option<Vector3<f64>> {
    let position = match &observed.dataset.rows[row].reading {
        Reading::Cable(_) => return None,
        Reading::Position(position) => *position,
        Reading::Pose(pose) => pose.translation.vector,
    };
    Some((base_from_sensor * Point3::from(position)).coords)
}
