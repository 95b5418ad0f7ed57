//! The rigid motion by which the cuts of a rewritten program lie off where the original intends them: a correction of the shape alone keeps
//! the placement of the path, and with it turns the tool and moves what lies beside the cuts.
//!
//! Method. Least squares over the ends of the cuts for small rotations: with r = p − c and deviations d, the shift is the mean of d and
//! ω = (Σ |r|² I − r rᵀ)⁺ Σ r × d (Horn 1987 for small motions); rotations that the ends do not determine are 0.
//! Shapes: positions and deviations in the axes of the base (mm).

use nalgebra::{Matrix3, SymmetricEigen, UnitQuaternion, Vector3};

use super::executed_end::{ExecutedEnd, deviation};
use truegrind_programs::motion::{Listing, MotionKind};

/// Share of the largest eigenvalue, below which the points lie on a line.
const ON_A_LINE: f64 = 1e-9;

/// The ends of a cut: where each is intended, and its deviation.
type CutEnd = (Vector3<f64>, Vector3<f64>);

/// A rigid motion of a path.
#[derive(Debug, Clone, Copy)]
pub(super) struct KeptPlacement {
    centre: Vector3<f64>,
    shift: Vector3<f64>,
    turn: Vector3<f64>,
}

impl KeptPlacement {
    /// Of all cuts, and of those in each work object.
    pub(super) fn all(
        original: &Listing,
        partners: &[Option<usize>],
        before: &[Option<&ExecutedEnd>],
        after: &[Option<&ExecutedEnd>],
    ) -> Vec<Self> {
        let mut cuts: Vec<(Option<&str>, CutEnd)> = Vec::new();
        for (index, motion) in original.motions.iter().enumerate() {
            if !matches!(motion.kind, MotionKind::Linear | MotionKind::Circular) {
                continue;
            }
            let (Some(was), Some(is)) = (before[index], partners[index].and_then(|partner| after[partner]))
            else {
                continue;
            };
            let object = original.work_object(motion).map(|object| object.name.as_str());
            let at = (was.base_from_object * was.commanded).translation.vector;
            cuts.push((object, (at, deviation(was, is))));
        }
        let mut objects: Vec<Option<&str>> = cuts.iter().map(|(object, _)| *object).collect();
        objects.sort_unstable();
        objects.dedup();
        let every: Vec<CutEnd> = cuts.iter().map(|(_, end)| *end).collect();
        let mut out: Vec<Self> = Self::of(&every).into_iter().collect();
        if objects.len() > 1 {
            out.extend(objects.iter().filter_map(|object| {
                let of: Vec<CutEnd> =
                    cuts.iter().filter(|(other, _)| other == object).map(|(_, end)| *end).collect();
                Self::of(&of)
            }));
        }
        out
    }

    fn of(ends: &[CutEnd]) -> Option<Self> {
        if ends.is_empty() {
            return None;
        }
        let n = ends.len() as f64;
        let centre = ends.iter().map(|(at, _)| at).sum::<Vector3<f64>>() / n;
        let shift = ends.iter().map(|(_, off)| off).sum::<Vector3<f64>>() / n;
        let (mut inertia, mut moment) = (Matrix3::zeros(), Vector3::zeros());
        for (at, off) in ends {
            let r = at - centre;
            inertia += Matrix3::identity() * r.norm_squared() - r * r.transpose();
            moment += r.cross(&(off - shift));
        }
        // Squares of these numbers must stay finite, or the iteration does not end.
        if !inertia.iter().all(|value| value.abs() < 1e100) {
            return None;
        }
        let axes = SymmetricEigen::new(inertia);
        let least = ON_A_LINE * axes.eigenvalues.amax();
        let turn = (0..3)
            .filter(|k| axes.eigenvalues[*k] > least)
            .map(|k| {
                let axis = axes.eigenvectors.column(k).into_owned();
                axis * (axis.dot(&moment) / axes.eigenvalues[k])
            })
            .sum();
        Some(Self { centre, shift, turn })
    }

    /// How it moves a place.
    pub(super) fn at(&self, place: &Vector3<f64>) -> Vector3<f64> {
        self.shift + self.turn.cross(&(place - self.centre))
    }

    /// How it turns a tool, in the axes of the base.
    pub(super) fn rotation(&self) -> UnitQuaternion<f64> {
        UnitQuaternion::from_scaled_axis(self.turn)
    }
}
