//! Which closed form an arm has, and the three signs that tell its branches apart.

use nalgebra::Vector3;

use super::axes::{Axes, rotated};
use super::{spherical, ur};
use crate::kinematics::model::Model;
use crate::math::se3::Pose;

/// Where Newton's method starts.
#[derive(Debug, Clone, Copy)]
pub(super) struct Seed {
    /// DH joint rotations [rad].
    pub(super) rotations: [f64; 6],
    /// How far the target lies beyond the nominal arm's reach on this branch [mm]; 0 within.
    pub(super) beyond_mm: f64,
}

/// The family of an arm.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) enum Family {
    /// Axes 4, 5 and 6 meet in this point (all rotations at zero) [mm].
    Spherical(Vector3<f64>),
    /// Axes 2, 3 and 4 are parallel; axes 5 and 6 meet in this point [mm].
    Parallel(Vector3<f64>),
    /// Neither: only Newton's method.
    Other,
}

/// One of the eight ways in which an arm with a closed form reaches a pose.
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
}

impl Structure {
    pub(super) fn of(model: &Model) -> Self {
        let axes = Axes::of(model);
        let family = spherical::wrist_centre(&axes)
            .map(Family::Spherical)
            .or_else(|| ur::wrist_point(&axes).map(Family::Parallel))
            .unwrap_or(Family::Other);
        Self { axes, family }
    }

    /// All branches for a pose of the last frame, nearest first where `free` decides; empty without a closed form.
    pub(super) fn seeds(&self, target: &Pose, free: &[f64; 6]) -> Vec<Seed> {
        match &self.family {
            Family::Spherical(centre) => spherical::solve(&self.axes, centre, target, free),
            Family::Parallel(point) => ur::solve(&self.axes, point, target, free),
            Family::Other => Vec::new(),
        }
    }

    /// Signed distances from the borders between branches, each within −1 and 1: how far the wrist centre lies in
    /// front of axis 1 (as part of the arm's extent), the sine of the elbow, the sine of the wrist.
    pub(super) fn margins(&self, rotations: &[f64; 6]) -> Option<[f64; 3]> {
        let axes = &self.axes;
        let h = &axes.direction;
        let (wrist, forearm_end, reference) = match self.family {
            Family::Spherical(centre) => (centre, centre, h[3]),
            Family::Parallel(point) => (point, axes.point[3], h[1]),
            Family::Other => return None,
        };
        let sense = axes.sense;
        // With axis 1 undone: turning axis 1 moves all of this alike.
        let carry =
            |x: &Vector3<f64>, last: usize| (1..=last).rev().fold(*x, |x, j| axes.turn(j, rotations[j], &x));
        let wrist_there = match self.family {
            Family::Parallel(_) => carry(&wrist, 3),
            _ => carry(&wrist, 2),
        };
        let forward = h[1].cross(&h[0]) * sense[1];
        let shoulder = forward.dot(&(wrist_there - axes.point[0])) / axes.extent_mm;
        let flat = |x: Vector3<f64>| x - h[1] * h[1].dot(&x);
        let upper = flat(axes.point[2] - axes.point[1]);
        let fore = flat(rotated(&h[2], rotations[2], &(forearm_end - axes.point[2])));
        let elbow = sense[1] * h[1].dot(&upper.cross(&fore)) / (upper.norm() * fore.norm());
        let tip = rotated(&h[4], rotations[4], &h[5]);
        let wrist = sense[4] * h[4].dot(&reference.cross(&tip));
        Some([shoulder, elbow, wrist])
    }

    pub(super) fn branch(&self, rotations: &[f64; 6]) -> Option<Branch> {
        self.margins(rotations).map(|[shoulder, elbow, wrist]| Branch {
            behind: shoulder < 0.0,
            elbow_back: elbow < 0.0,
            wrist_negative: wrist < 0.0,
        })
    }
}
