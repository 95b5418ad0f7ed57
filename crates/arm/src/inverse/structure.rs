//! Kinematic family of an arm, its closed form, and the three signed margins that identify a branch.

use nalgebra::{Point3, Vector3};

use super::axes::Axes;
use super::seed::Seed;
use super::{spherical, ur};
use crate::chain::{Chain, cross, dot, minus};
use crate::model::Model;
use truegrind_math::lanes::{Real, splats};
use truegrind_math::se3::Pose;

/// The family of an arm.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) enum Family {
    /// Axes 4, 5 and 6 meet in this point (all rotations at zero) (mm).
    Spherical(Vector3<f64>),
    /// Axes 2, 3 and 4 are parallel; axes 5 and 6 meet in this point (mm).
    Parallel(Vector3<f64>),
    /// Neither: only Newton's method.
    Other,
}

/// One of the eight solutions for a pose of an arm with a closed form.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub struct Branch {
    /// The wrist centre lies behind axis 1, seen in the direction in which the shoulder faces.
    pub behind: bool,
    /// The wrist centre lies behind the lower arm (the line through axes 2 and 3).
    pub elbow_back: bool,
    /// Axis 5 is bent to the negative side.
    pub wrist_negative: bool,
}

/// Geometry of the nominal arm for seeds and branches.
#[derive(Debug, Clone)]
pub(super) struct Structure {
    pub(super) axes: Axes,
    pub(super) family: Family,
    scales: [f64; 3],
}

impl Structure {
    pub(super) fn of(model: &Model) -> Self {
        let axes = Axes::of(model);
        let family = spherical::wrist_centre(&axes)
            .map(Family::Spherical)
            .or_else(|| ur::wrist_point(&axes).map(Family::Parallel))
            .unwrap_or(Family::Other);
        let scales = scales(&axes, family);
        Self { axes, family, scales }
    }

    /// Seeds on all branches for a pose of the last frame; `free` gives the rotations that a singular pose leaves undetermined.
    /// Empty without a closed form.
    pub(super) fn seeds(&self, target: &Pose, free: &[f64; 6]) -> Vec<Seed> {
        match &self.family {
            Family::Spherical(centre) => spherical::solve(&self.axes, centre, target, free),
            Family::Parallel(point) => ur::solve(&self.axes, point, target, free),
            Family::Other => Vec::new(),
        }
    }

    /// Sum of the link lengths (mm).
    pub(super) fn extent_mm(&self) -> f64 {
        self.axes.extent_mm
    }

    /// Whether a pose of the last frame that the closed form puts out of reach by `beyond_mm` is out of reach of every arm
    /// whose points are within `model_distance_mm` of this one's at equal joint angles.
    ///
    /// For a spherical wrist the pose determines the wrist centre, whose workspace is a ring about axis 1. In a plane through
    /// that axis a shift of the wrist centre moves it by at most as much, except for an arm with a lateral offset, whose plane
    /// rotates: more so the nearer to the axis. For any arm: a pose farther from the base than all links in line.
    pub(super) fn is_surely_unreachable(&self, last: &Pose, beyond_mm: f64, model_distance_mm: f64) -> bool {
        if !(beyond_mm > 0.0 && beyond_mm.is_finite()) {
            return false;
        }
        let axes = &self.axes;
        if last.translation.vector.norm() > axes.extent_mm + model_distance_mm {
            return true;
        }
        let Family::Spherical(centre) = self.family else { return false };
        let there = (last * axes.home_inverse * Point3::from(centre)).coords - axes.point[0];
        let from_axis = there.cross(&axes.direction[0]).norm();
        let to_side = axes.direction[1].dot(&(centre - axes.point[0])).abs();
        // The tolerances of the closed form for meeting and parallel axes.
        let loose = axes.meeting(3, 4).map_or(f64::INFINITY, |(_, gap)| gap)
            + axes.distance(5, &centre)
            + axes.extent_mm * axes.direction[1].cross(&axes.direction[2]).norm();
        let shift = 2.0 * (model_distance_mm + loose) + 1e-3;
        let nearest = from_axis - shift;
        if !(nearest > 1.1 * to_side) {
            return to_side < 1e-6 && beyond_mm > shift;
        }
        beyond_mm > shift * nearest / (nearest.powi(2) - to_side.powi(2)).sqrt()
    }

    /// The point that joints 4 to 6 move least, in the last frame (mm); the kernel takes the twist there.
    pub(super) fn wrist_in_last(&self) -> [f64; 3] {
        match self.family {
            Family::Spherical(point) | Family::Parallel(point) => {
                (self.axes.home_inverse * Point3::from(point)).coords.into()
            }
            Family::Other => [0.0; 3],
        }
    }

    /// Signed distances from the singularities between branches: distance of the wrist point in front of axis 1 (as a fraction of
    /// the arm's extent), sine of the elbow, sine of the wrist. Behind, elbow back and axis 5 negative are negative. All 1 for
    /// an arm without a closed form, which has no branches.
    #[cfg_attr(not(debug_assertions), inline(always))]
    pub(super) fn margins<R: Real>(&self, frames: &Chain<R>, wrist: &[R; 3]) -> [R; 3] {
        let (z, o) = (&frames.z, &frames.origin);
        let (end, reference) = match self.family {
            Family::Spherical(_) => (*wrist, z[3]),
            Family::Parallel(_) => (o[3], z[1]),
            Family::Other => return [wrist[0].splat(1.0); 3],
        };
        let scales = splats(wrist[0], &self.scales);
        let shoulder = dot(&cross(&z[1], &z[0]), &minus(wrist, &o[0])) * scales[0];
        let bend = cross(&minus(&o[2], &o[1]), &minus(&end, &o[2]));
        let elbow = dot(&z[1], &bend) * scales[1];
        let wrist = dot(&z[4], &cross(&reference, &z[5])) * scales[2];
        [shoulder, elbow, wrist]
    }

    /// The margins for the joint frames of a model of this structure.
    pub(super) fn margins_of(&self, frames: &Chain<f64>) -> [f64; 3] {
        let [x, y, z] = self.wrist_in_last();
        let wrist = std::array::from_fn(|k| {
            frames.origin[6][k] + x * frames.x[k] + y * frames.y[5][k] + z * frames.z[6][k]
        });
        self.margins(frames, &wrist)
    }

    /// Whether the arm has a closed form, and so branches.
    pub(super) fn has_branches(&self) -> bool {
        self.family != Family::Other
    }
}

impl Branch {
    pub(super) fn of(margins: &[f64; 3]) -> Self {
        Self { behind: margins[0] < 0.0, elbow_back: margins[1] < 0.0, wrist_negative: margins[2] < 0.0 }
    }
}

/// Factors that normalise the margins and give them the signs of the controller's joints 2 and 5.
fn scales(axes: &Axes, family: Family) -> [f64; 3] {
    let end = match family {
        Family::Spherical(centre) => centre,
        Family::Parallel(_) => axes.point[3],
        Family::Other => return [0.0; 3],
    };
    let h = axes.direction[1];
    let flat = |x: Vector3<f64>| (x - h * h.dot(&x)).norm();
    let area = flat(axes.point[2] - axes.point[1]) * flat(end - axes.point[2]);
    [axes.sense[1] / axes.extent_mm, axes.sense[1] / area, axes.sense[4]]
}
