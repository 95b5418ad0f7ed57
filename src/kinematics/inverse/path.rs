//! Many targets: along a path, each started from its neighbour, or each with a seed of its own; eight in lanes.

use rayon::prelude::*;

use super::configuration::{self, Configuration};
use super::kernel::Solved;
use super::{Branch, Inverse, InverseError, Solution, same_branch};
use crate::kinematics::chain::End;
use crate::kinematics::model::Joints;
use crate::math::lanes::{Lanes, SinCos, WIDTH, vectorised};
use crate::math::se3::Pose;

/// Neighbours on a path that stand farther apart are solved one after the other, not in lanes (rad).
const LONGEST_STRIDE_RAD: f64 = 0.35;
/// Strides up to here are continued into the next eight seeds (rad).
const STEADY_STRIDE_RAD: f64 = 0.05;
/// Targets that one thread takes at a time; the results do not depend on it.
const PORTION: usize = 1024;

impl Inverse<'_> {
    /// Joints along a path from `start`: every target on the branch of the one before it, each joint on the turn
    /// nearest to it. A target that fails leaves the path where it was: the next one starts from the last success.
    ///
    /// One thread; the same input gives the same bits.
    pub fn solve_path(&self, targets: &[Pose], start: &Joints) -> Vec<Result<Solution, InverseError>> {
        let mut out = Vec::with_capacity(targets.len());
        let (mut last, mut stride) = (*start, Joints::zeros());
        let mut margins = self.margins(start);
        for block in targets.chunks(WIDTH) {
            let seeds: [Joints; WIDTH] = std::array::from_fn(|k| last + stride * (k + 1) as f64);
            let solved = self.solve_lanes(block, &seeds);
            for (k, target) in block.iter().enumerate() {
                let row = lane(&solved, k);
                // The road in lanes is open while strides are short and the branch is kept.
                let quick = self
                    .accepted(&row, &seeds[k])
                    .filter(|s| {
                        (s.joints - last).amax() < LONGEST_STRIDE_RAD
                            && same_branch(&margins, &row.margins[1])
                    })
                    .filter(|s| self.check_limits(&s.joints).is_ok());
                let result = match quick {
                    Some(solution) => {
                        margins = row.margins[1];
                        Ok(solution)
                    }
                    None => self.solve_near(target, &last).inspect(|s| margins = self.margins(&s.joints)),
                };
                if let Ok(solution) = &result {
                    stride = solution.joints - last;
                    if stride.amax() >= STEADY_STRIDE_RAD {
                        stride = Joints::zeros();
                    }
                    last = solution.joints;
                }
                out.push(result);
            }
        }
        out
    }

    /// [`Inverse::solve_near`] for many targets, each with its own seed, on all threads of the current pool; the same
    /// bits as one by one. Targets without a seed are left out.
    pub fn solve_seeded(&self, targets: &[Pose], seeds: &[Joints]) -> Vec<Result<Solution, InverseError>> {
        let count = targets.len().min(seeds.len());
        targets[..count]
            .par_chunks(PORTION)
            .zip(seeds[..count].par_chunks(PORTION))
            .flat_map_iter(|(targets, seeds)| {
                let blocks = targets.chunks(WIDTH).zip(seeds.chunks(WIDTH));
                blocks.flat_map(|(targets, seeds)| self.solve_block(targets, seeds))
            })
            .collect()
    }

    /// [`Inverse::configuration`] of many joint vectors.
    pub fn configurations(&self, joints: &[Joints]) -> Vec<Configuration> {
        let branches = self.structure.has_branches();
        let margins = self.margins_of_many(joints);
        let branch = |m| branches.then(|| Branch::of(m));
        joints.iter().zip(&margins).map(|(q, m)| configuration::of(branch(m), q)).collect()
    }

    /// Whether each joint vector is of the configuration that was asked for, borders counted to both sides as in
    /// [`Inverse::solve_configured`].
    pub fn fitting(&self, joints: &[Joints], wanted: &[Configuration]) -> Vec<bool> {
        let margins = self.margins_of_many(joints);
        joints.iter().zip(&margins).zip(wanted).map(|((q, m), wanted)| wanted.fits(q, m)).collect()
    }

    fn margins_of_many(&self, joints: &[Joints]) -> Vec<[f64; 3]> {
        let mut out = Vec::with_capacity(joints.len());
        for block in joints.chunks(WIDTH) {
            let angles: [Lanes; 6] =
                std::array::from_fn(|i| Lanes(std::array::from_fn(|k| block[k.min(block.len() - 1)][i])));
            let margins = vectorised(
                #[inline(always)]
                || self.kernel.margins(&self.arm, &self.structure, &angles),
            );
            out.extend((0..block.len()).map(|k| margins.map(|m| m.0[k])));
        }
        out
    }

    fn solve_block<'s>(
        &'s self,
        targets: &'s [Pose],
        seeds: &'s [Joints],
    ) -> impl Iterator<Item = Result<Solution, InverseError>> + 's {
        let padded: [Joints; WIDTH] = std::array::from_fn(|k| seeds[k.min(seeds.len() - 1)]);
        let solved = self.solve_lanes(targets, &padded);
        targets.iter().enumerate().map(move |(k, target)| match self.accepted(&lane(&solved, k), &seeds[k]) {
            Some(solution) => self.check_limits(&solution.joints).map(|()| solution),
            None => self.solve_near(target, &seeds[k]),
        })
    }

    /// The kernel on one target.
    pub(super) fn solve_fast(&self, target: &Pose, seed: &Joints) -> Solved<f64> {
        let q = target.rotation.coords;
        let t = target.translation.vector;
        let goal = self.place(&[q.x, q.y, q.z, q.w], &[t.x, t.y, t.z]);
        let start = self.arm.mapped(&(*seed).into());
        self.kernel.solve(&self.arm, &self.structure, &goal, &start)
    }

    /// The kernel on up to eight targets; the last one fills the lanes.
    fn solve_lanes(&self, targets: &[Pose], seeds: &[Joints; WIDTH]) -> Solved<Lanes> {
        let zero = Lanes([0.0; WIDTH]);
        let (mut quaternion, mut translation, mut start) = ([zero; 4], [zero; 3], [zero; 6]);
        for k in 0..WIDTH {
            let target = &targets[k.min(targets.len() - 1)];
            for (i, lanes) in quaternion.iter_mut().enumerate() {
                lanes.0[k] = target.rotation.coords[i];
            }
            for (i, lanes) in translation.iter_mut().enumerate() {
                lanes.0[k] = target.translation.vector[i];
            }
            for (i, lanes) in start.iter_mut().enumerate() {
                lanes.0[k] = seeds[k][i];
            }
        }
        vectorised(
            #[inline(always)]
            || {
                let goal = self.place(&quaternion, &translation);
                self.kernel.solve(&self.arm, &self.structure, &goal, &self.arm.mapped(&start))
            },
        )
    }

    /// Place of the last frame for a pose of the flange, given by quaternion (x, y, z, w) and translation.
    ///
    /// The quaternion need not have length 1 to the last bit: an interpolated one seldom has, and axes that are longer
    /// than 1 by 1e-11 ask for a place that no joints reach.
    #[cfg_attr(not(debug_assertions), inline(always))]
    fn place<R: SinCos>(&self, quaternion: &[R; 4], translation: &[R; 3]) -> End<R> {
        let [x, y, z, w] = *quaternion;
        let one = R::splat(1.0);
        let two = R::splat(2.0) / (x * x + y * y + z * z + w * w);
        let columns = [
            [one - two * (y * y + z * z), two * (x * y + w * z), two * (x * z - w * y)],
            [two * (x * y - w * z), one - two * (x * x + z * z), two * (y * z + w * x)],
            [two * (x * z + w * y), two * (y * z - w * x), one - two * (x * x + y * y)],
        ];
        End { axes: columns, origin: *translation }.then(&self.flange_inverse)
    }
}

fn lane(solved: &Solved<Lanes>, k: usize) -> Solved<f64> {
    Solved {
        mapped: solved.mapped.map(|v| v.0[k]),
        residual_mm: solved.residual_mm.0[k],
        residual_rad: solved.residual_rad.0[k],
        steps: solved.steps.0[k],
        converged: solved.converged.0[k],
        singularity: solved.singularity.0[k],
        margins: solved.margins.map(|m| m.map(|v| v.0[k])),
    }
}
