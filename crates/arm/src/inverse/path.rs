//! Many targets: along a path, each started from its neighbour, or each with a seed of its own; eight in lanes.

use rayon::prelude::*;

use super::configuration::{self, Configuration};
use super::effort::{Allowance, within};
use super::kernel::{Asked, Solved};
use super::{Branch, Inverse, InverseError, Solution, same_branch};
use crate::chain::End;
use crate::joints::Joints;
use truegrind_math::lanes::{Lanes, SinCos, WIDTH, vectorised};
use truegrind_math::se3::Pose;

/// Neighbours on a path that stand farther apart are solved one after the other, not in lanes (rad).
const LONGEST_STRIDE_RAD: f64 = 0.35;
/// Strides up to here are continued into the next eight seeds (rad).
const STEADY_STRIDE_RAD: f64 = 0.05;
/// Targets that one thread takes at a time; the results do not depend on it.
const PORTION: usize = 1024;

/// Joints that reach a target, and what comes with them at no cost.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Reached {
    /// Controller angles (rad).
    pub joints: Joints,
    /// Their configuration.
    pub configuration: Configuration,
    /// The signs of [`Branch`] at these joints, as numbers that vanish on the borders.
    margins: [f64; 3],
}

impl Reached {
    /// Whether the joints are of the configuration that was asked for, borders counted to both sides as in
    /// [`Inverse::solve_configured`].
    pub fn fits(&self, wanted: &Configuration) -> bool {
        wanted.fits(&self.joints, &self.margins)
    }

    /// The same with the branch to the sign: no other solution of the target is of that configuration.
    pub fn is_of(&self, wanted: &Configuration) -> bool {
        self.fits(wanted) && wanted.states_branch(&self.margins)
    }

    /// [`Inverse::branch_margins`] at these joints.
    pub fn margins(&self) -> [f64; 3] {
        self.margins
    }
}

impl Inverse<'_> {
    /// Joints along a path from `start`: every target on the branch of the one before it, each joint on the turn
    /// nearest to it. A target that fails leaves the path where it was: the next one starts from the last success.
    ///
    /// One thread; the same input gives the same bits.
    pub fn solve_path(&self, targets: &[Pose], start: &Joints) -> Vec<Result<Solution, InverseError>> {
        self.along(targets, start, Asked::Everything, false, |solution, _| solution)
    }

    /// The joints of [`Inverse::solve_path`], without residuals and distances to singularity: half the work. They may
    /// differ by 1e-12 rad.
    pub fn reach_path(&self, targets: &[Pose], start: &Joints) -> Vec<Result<Reached, InverseError>> {
        self.along(targets, start, Asked::Joints, false, |Solution { joints, .. }, margins| Reached {
            joints,
            configuration: self.configuration_of(&joints, &margins),
            margins,
        })
    }

    /// The first of [`Inverse::reach_path`], up to a target for which all branches would have to be searched.
    pub fn reach_path_easily(&self, targets: &[Pose], start: &Joints) -> Vec<Reached> {
        let reached = self.along(targets, start, Asked::Joints, true, |Solution { joints, .. }, margins| {
            Reached { joints, configuration: self.configuration_of(&joints, &margins), margins }
        });
        reached.into_iter().map_while(Result::ok).collect()
    }

    /// `easily`: up to a target that is not reached without a search, which ends the list.
    fn along<T>(
        &self,
        targets: &[Pose],
        start: &Joints,
        asked: Asked,
        easily: bool,
        keep: impl Fn(Solution, [f64; 3]) -> T,
    ) -> Vec<Result<T, InverseError>> {
        let mut out = Vec::with_capacity(targets.len());
        let (mut last, mut stride) = (*start, Joints::zeros());
        let mut margins = self.margins(start);
        for block in targets.chunks(WIDTH) {
            let seeds: [Joints; WIDTH] = std::array::from_fn(|k| last + stride * (k + 1) as f64);
            let solved = self.solve_lanes(block, &seeds, asked);
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
                    None if easily => match self.solve_easily(target, &last) {
                        Some(Ok(solution)) => {
                            margins = self.margins(&solution.joints);
                            Ok(solution)
                        }
                        Some(Err(_)) | None => return out,
                    },
                    None => self.solve_near(target, &last).inspect(|s| margins = self.margins(&s.joints)),
                };
                if let Ok(solution) = &result {
                    stride = solution.joints - last;
                    if stride.amax() >= STEADY_STRIDE_RAD {
                        stride = Joints::zeros();
                    }
                    last = solution.joints;
                }
                out.push(result.map(|solution| keep(solution, margins)));
            }
        }
        out
    }

    /// [`Inverse::solve_near`] for many targets, each with its own seed, on all threads of the current pool; the same
    /// bits as one by one. Targets without a seed are left out.
    pub fn solve_seeded(&self, targets: &[Pose], seeds: &[Joints]) -> Vec<Result<Solution, InverseError>> {
        self.solve_seeded_within(targets, seeds, u64::MAX)
    }

    /// The same with so many evaluations at most for those that have to be searched for (see [`effort`](super::effort)),
    /// shared out by their number.
    pub fn solve_seeded_within(
        &self,
        targets: &[Pose],
        seeds: &[Joints],
        evaluations: u64,
    ) -> Vec<Result<Solution, InverseError>> {
        let count = targets.len().min(seeds.len());
        let portions = count.div_ceil(PORTION);
        targets[..count]
            .par_chunks(PORTION)
            .zip(seeds[..count].par_chunks(PORTION))
            .enumerate()
            .flat_map_iter(|(portion, (targets, seeds))| {
                let mut allowance = Allowance::of(evaluations).part(portion, portions);
                within(&mut allowance, || {
                    let blocks = targets.chunks(WIDTH).zip(seeds.chunks(WIDTH));
                    let solved = blocks.flat_map(|(targets, seeds)| {
                        let solved = self.solve_lanes(targets, &padded(seeds), Asked::Everything);
                        (0..targets.len())
                            .map(move |k| self.judged(&lane(&solved, k), &targets[k], &seeds[k]))
                    });
                    solved.collect::<Vec<_>>()
                })
            })
            .collect()
    }

    /// The joints of [`Inverse::solve_seeded`], without residuals and distances to singularity: half the work; they may
    /// differ by 1e-12 rad. One thread.
    pub fn reach_seeded(&self, targets: &[Pose], seeds: &[Joints]) -> Vec<Result<Reached, InverseError>> {
        let mut out = Vec::with_capacity(targets.len());
        for (targets, seeds) in targets.chunks(WIDTH).zip(seeds.chunks(WIDTH)) {
            let solved = self.solve_lanes(targets, &padded(seeds), Asked::Joints);
            for (k, (target, seed)) in targets.iter().zip(seeds).enumerate() {
                let row = lane(&solved, k);
                let found = match self.accepted(&row, seed) {
                    Some(solution) => {
                        self.check_limits(&solution.joints).map(|()| (solution.joints, row.margins[1]))
                    }
                    None => self.solve_near(target, seed).map(|s| (s.joints, self.margins(&s.joints))),
                };
                out.push(found.map(|(joints, margins)| Reached {
                    joints,
                    configuration: self.configuration_of(&joints, &margins),
                    margins,
                }));
            }
        }
        out
    }

    /// [`Inverse::solve_seeded`] where solution and seed differ alike along the list, as on the path of an estimated arm
    /// that is seeded with the nominal one's joints: each eight begin by as much beside their seeds as the last one before
    /// them ended. One thread.
    pub fn solve_beside(&self, targets: &[Pose], seeds: &[Joints]) -> Vec<Result<Solution, InverseError>> {
        let mut out = Vec::with_capacity(targets.len());
        let mut beside = Joints::zeros();
        for (targets, seeds) in targets.chunks(WIDTH).zip(seeds.chunks(WIDTH)) {
            let solved =
                self.solve_lanes(targets, &padded(seeds).map(|seed| seed + beside), Asked::Everything);
            for (k, (target, seed)) in targets.iter().zip(seeds).enumerate() {
                let result = self.judged(&lane(&solved, k), target, seed);
                if let Ok(solution) = &result {
                    beside = solution.joints - seed;
                }
                out.push(result);
            }
            if beside.amax() >= STEADY_STRIDE_RAD {
                beside = Joints::zeros();
            }
        }
        out
    }

    /// The kernel's solution where it counts, the careful one elsewhere.
    fn judged(&self, row: &Solved<f64>, target: &Pose, seed: &Joints) -> Result<Solution, InverseError> {
        match self.accepted(row, seed) {
            Some(solution) => self.check_limits(&solution.joints).map(|()| solution),
            None => self.solve_near(target, seed),
        }
    }

    fn configuration_of(&self, joints: &Joints, margins: &[f64; 3]) -> Configuration {
        configuration::of(self.structure.has_branches().then(|| Branch::of(margins)), joints)
    }

    /// The kernel on one target.
    pub(super) fn solve_fast(&self, target: &Pose, seed: &Joints) -> Solved<f64> {
        let q = target.rotation.coords;
        let t = target.translation.vector;
        let goal = self.place(&[q.x, q.y, q.z, q.w], &[t.x, t.y, t.z]);
        let start = self.arm.mapped(&(*seed).into());
        self.kernel.solve(&self.arm, &self.structure, &goal, &start, Asked::Everything)
    }

    /// The kernel on up to eight targets; the last one fills the lanes.
    fn solve_lanes(&self, targets: &[Pose], seeds: &[Joints; WIDTH], asked: Asked) -> Solved<Lanes> {
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
                self.kernel.solve(&self.arm, &self.structure, &goal, &self.arm.mapped(&start), asked)
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

/// Eight seeds; the last one fills the lanes.
fn padded(seeds: &[Joints]) -> [Joints; WIDTH] {
    std::array::from_fn(|k| seeds[k.min(seeds.len() - 1)])
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
