//! Inverse kinematics of many targets, eight in lanes: along a path, each started from its neighbour, or each with its own seed.

use rayon::prelude::*;

use super::budget::{SearchBudget, with_budget};
use super::configuration::{self, Configuration};
use super::kernel::{Outputs, Solved};
use super::{Branch, Inverse, InverseError, Solution, same_branch};
use crate::chain::FrameColumns;
use crate::joints::{self, Joints, MappedJoints};
use crate::model::Limits;
use truegrind_math::lanes::{AnyWidth, SinCos, WIDTH, vectorised};
use truegrind_math::se3::Pose;

/// Neighbours on a path that are farther apart are solved sequentially, not in lanes (rad).
const MAX_STRIDE_RAD: f64 = 0.35;
/// Strides up to this size are extrapolated to the next eight seeds (rad).
const STEADY_STRIDE_RAD: f64 = 0.05;
/// Targets that one thread processes at a time; the results do not depend on it.
const CHUNK: usize = 1024;

/// Joints that reach a target, with their configuration.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PathJoints {
    /// Controller angles (rad).
    pub joints: Joints,
    /// Their configuration.
    pub configuration: Configuration,
    /// The signed margins of the [`Branch`] at these joints.
    margins: [f64; 3],
}

impl PathJoints {
    /// Whether the joints have the requested configuration, within the tolerances of [`Inverse::solve_configured`].
    pub fn matches(&self, wanted: &Configuration) -> bool {
        wanted.matches(&self.joints, &self.margins)
    }

    /// The same with the exact branch: no other solution of the target has that configuration.
    pub fn matches_exactly(&self, wanted: &Configuration) -> bool {
        self.matches(wanted) && wanted.matches_branch_exactly(&self.margins)
    }

    /// [`Inverse::branch_margins`] at these joints.
    pub fn margins(&self) -> [f64; 3] {
        self.margins
    }
}

impl Inverse<'_> {
    /// Joints along a path from `start`: every target on the branch of the one before it, each joint on the turn
    /// nearest to it. After a failed target the next one starts from the last success.
    ///
    /// One thread; the same input gives the same bits.
    pub fn solve_path(&self, targets: &[Pose], start: &Joints) -> Vec<Result<Solution, InverseError>> {
        self.along(targets, start, Outputs::Full, false, |solution, _| solution)
    }

    /// The joints of [`Inverse::solve_path`], without residuals and distances to singularity: half the work. They may
    /// differ by 1e-12 rad.
    pub fn solve_path_joints(
        &self,
        targets: &[Pose],
        start: &Joints,
    ) -> Vec<Result<PathJoints, InverseError>> {
        self.along(targets, start, Outputs::Joints, false, |solution, margins| {
            self.path_joints(&solution.joints, &margins)
        })
    }

    /// The leading results of [`Inverse::solve_path_joints`], up to the first target that would need a search over all branches.
    pub fn solve_path_prefix(&self, targets: &[Pose], start: &Joints) -> Vec<PathJoints> {
        let reached = self.along(targets, start, Outputs::Joints, true, |solution, margins| {
            self.path_joints(&solution.joints, &margins)
        });
        reached.into_iter().map_while(Result::ok).collect()
    }

    /// `easily`: the first target that would need a search ends the list.
    fn along<T>(
        &self,
        targets: &[Pose],
        start: &Joints,
        outputs: Outputs,
        easily: bool,
        keep: impl Fn(Solution, [f64; 3]) -> T,
    ) -> Vec<Result<T, InverseError>> {
        let mut out = Vec::with_capacity(targets.len());
        let (mut last, mut stride) = (*start, Joints::zeros());
        let mut margins = self.margins(start);
        let (mut seeds, mut solved) = ([last; WIDTH], Solved::default());
        let mut lanes = Targets::default();
        for block in targets.chunks(WIDTH) {
            for (k, seed) in seeds.iter_mut().enumerate() {
                let ahead = (k + 1) as f64;
                for joint in 0..6 {
                    seed[joint] = last[joint] + stride[joint] * ahead;
                }
            }
            self.solve_lanes(block, &seeds, outputs, &mut lanes, &mut solved);
            if self.is_steady(block, &lanes, &solved, (&last, &margins)) {
                for k in 0..WIDTH {
                    let row = lane(&solved, k);
                    let joints = self.controller_angles(MappedJoints(row.mapped.into()));
                    (stride, last, margins) = (joints - last, joints, row.margins[1]);
                    out.push(Ok(keep(row.solution(&joints), margins)));
                }
                continue;
            }
            for (k, target) in block.iter().enumerate() {
                let row = lane(&solved, k);
                let joints = self.controller_angles(MappedJoints(row.mapped.into()));
                // Lanes are valid while strides are short and the branch is kept.
                if self.is_accepted(&row, &joints, &seeds[k])
                    && joints::max_joint_difference(&joints, &last) < MAX_STRIDE_RAD
                    && same_branch(&margins, &row.margins[1])
                    && self.within_limits(&joints)
                {
                    margins = row.margins[1];
                    stride = stride_between(&last, &joints);
                    last = joints;
                    out.push(Ok(keep(row.solution(&joints), margins)));
                    continue;
                }
                let result = match easily {
                    true => match self.solve_without_search(target, &last) {
                        Some(Ok(solution)) => Ok(solution),
                        Some(Err(_)) | None => return out,
                    },
                    false => self.solve_near(target, &last),
                };
                if let Ok(solution) = &result {
                    margins = self.margins(&solution.joints);
                    stride = stride_between(&last, &solution.joints);
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

    /// The same with so many evaluations at most for those that have to be searched for (see [`budget`](super::budget)),
    /// shared out by their number.
    pub fn solve_seeded_within(
        &self,
        targets: &[Pose],
        seeds: &[Joints],
        evaluations: u64,
    ) -> Vec<Result<Solution, InverseError>> {
        let count = targets.len().min(seeds.len());
        let chunks = count.div_ceil(CHUNK);
        targets[..count]
            .par_chunks(CHUNK)
            .zip(seeds[..count].par_chunks(CHUNK))
            .enumerate()
            .flat_map_iter(|(chunk, (targets, seeds))| {
                let mut budget = SearchBudget::of(evaluations).share(chunk, chunks);
                with_budget(&mut budget, || {
                    let blocks = targets.chunks(WIDTH).zip(seeds.chunks(WIDTH));
                    let solved = blocks.flat_map(|(targets, seeds)| {
                        let (mut lanes, mut solved) = (Targets::default(), Solved::default());
                        self.solve_lanes(targets, &padded(seeds), Outputs::Full, &mut lanes, &mut solved);
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
    pub fn solve_seeded_joints(
        &self,
        targets: &[Pose],
        seeds: &[Joints],
    ) -> Vec<Result<PathJoints, InverseError>> {
        let mut out = Vec::with_capacity(targets.len());
        let (mut lanes, mut solved) = (Targets::default(), Solved::default());
        for (targets, seeds) in targets.chunks(WIDTH).zip(seeds.chunks(WIDTH)) {
            self.solve_lanes(targets, &padded(seeds), Outputs::Joints, &mut lanes, &mut solved);
            for (k, (target, seed)) in targets.iter().zip(seeds).enumerate() {
                let row = lane(&solved, k);
                let joints = self.controller_angles(MappedJoints(row.mapped.into()));
                out.push(match self.is_accepted(&row, &joints, seed) {
                    true => self.check_limits(&joints).map(|()| self.path_joints(&joints, &row.margins[1])),
                    false => {
                        let found = self.solve_near(target, seed);
                        found.map(|s| self.path_joints(&s.joints, &self.margins(&s.joints)))
                    }
                });
            }
        }
        out
    }

    /// [`Inverse::solve_seeded`] where solution and seed differ by nearly the same offset along the list, as on the path of an
    /// estimated arm seeded with the nominal one's joints: each eight start with the last offset found. One thread.
    pub fn solve_offset_seeded(
        &self,
        targets: &[Pose],
        seeds: &[Joints],
    ) -> Vec<Result<Solution, InverseError>> {
        let mut out = Vec::with_capacity(targets.len());
        let mut beside = Joints::zeros();
        let (mut lanes, mut solved) = (Targets::default(), Solved::default());
        for (targets, seeds) in targets.chunks(WIDTH).zip(seeds.chunks(WIDTH)) {
            let begun = padded(seeds).map(|seed| seed + beside);
            self.solve_lanes(targets, &begun, Outputs::Full, &mut lanes, &mut solved);
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

    /// The kernel's solution where it is accepted, else the searched one.
    fn judged(&self, row: &Solved<f64>, target: &Pose, seed: &Joints) -> Result<Solution, InverseError> {
        let joints = self.controller_angles(MappedJoints(row.mapped.into()));
        match self.is_accepted(row, &joints, seed) {
            true => self.check_limits(&joints).map(|()| row.solution(&joints)),
            false => self.solve_near(target, seed),
        }
    }

    /// Whether [`Inverse::along`] certainly accepts all eight rows of a block, each from the one before, the first from `before`. What
    /// is near a bound is left to the judgement of single rows.
    #[inline(always)]
    fn is_steady(
        &self,
        block: &[Pose],
        targets: &Targets,
        solved: &Solved<Eight>,
        (last, margins): (&Joints, &[f64; 3]),
    ) -> bool {
        block.len() == WIDTH
            && self.map_inverse.is_some()
            && self.arm.map_is_identity()
            && self.arm.model.limits.sums.is_empty()
            && vectorised(Steady { limits: &self.arm.model.limits, targets, solved, last, margins })
    }

    fn path_joints(&self, joints: &Joints, margins: &[f64; 3]) -> PathJoints {
        let branch = self.structure.has_branches().then(|| Branch::of(margins));
        PathJoints { joints: *joints, configuration: configuration::of(branch, joints), margins: *margins }
    }

    /// The kernel on one target.
    pub(super) fn solve_fast(&self, target: &Pose, seed: &Joints) -> Solved<f64> {
        let q = target.rotation.coords;
        let t = target.translation.vector;
        let goal = self.last_frame_goal(&[q.x, q.y, q.z, q.w], &[t.x, t.y, t.z]);
        let start = self.arm.apply_joint_map(&(*seed).into());
        let (arm, structure) = (&self.arm, &self.structure);
        if arm.moves_links() {
            self.kernel.solve::<f64, true>(arm, structure, &goal, &start, Outputs::Full)
        } else {
            self.kernel.solve::<f64, false>(arm, structure, &goal, &start, Outputs::Full)
        }
    }

    /// The kernel on up to eight targets; the last one fills the lanes. `lanes` is a buffer.
    fn solve_lanes(
        &self,
        targets: &[Pose],
        seeds: &[Joints; WIDTH],
        outputs: Outputs,
        lanes: &mut Targets,
        solved: &mut Solved<Eight>,
    ) {
        for k in 0..WIDTH {
            let target = &targets[k.min(targets.len() - 1)];
            for i in 0..4 {
                lanes.quaternion[i][k] = target.rotation.coords[i];
            }
            for i in 0..3 {
                lanes.translation[i][k] = target.translation.vector[i];
            }
            for i in 0..6 {
                lanes.start[i][k] = seeds[k][i];
            }
        }
        if self.arm.moves_links() {
            vectorised(Block::<true> { inverse: self, targets: lanes, outputs, solved });
        } else {
            vectorised(Block::<false> { inverse: self, targets: lanes, outputs, solved });
        }
    }

    /// The last frame for a pose of the flange, given by quaternion (x, y, z, w) and translation.
    ///
    /// The quaternion is normalised: an interpolated one seldom has exactly length 1, and axes longer than 1 by 1e-11 would give an
    /// unreachable frame.
    #[cfg_attr(not(debug_assertions), inline(always))]
    fn last_frame_goal<R: SinCos>(&self, quaternion: &[R; 4], translation: &[R; 3]) -> FrameColumns<R> {
        let [x, y, z, w] = *quaternion;
        let one = x.splat(1.0);
        let two = x.splat(2.0) / (x * x + y * y + z * z + w * w);
        let columns = [
            [one - two * (y * y + z * z), two * (x * y + w * z), two * (x * z - w * y)],
            [two * (x * y - w * z), one - two * (x * x + z * z), two * (y * z + w * x)],
            [two * (x * z + w * y), two * (y * z - w * x), one - two * (x * x + y * y)],
        ];
        FrameColumns { axes: columns, origin: *translation }.compose(&self.flange_inverse)
    }
}

/// The stride to extrapolate: none after a long one.
#[inline(always)]
fn stride_between(from: &Joints, to: &Joints) -> Joints {
    if joints::max_joint_difference(from, to) >= STEADY_STRIDE_RAD { Joints::zeros() } else { to - from }
}

/// Eight seeds; the last one fills the lanes.
fn padded(seeds: &[Joints]) -> [Joints; WIDTH] {
    std::array::from_fn(|k| seeds[k.min(seeds.len() - 1)])
}

/// Eight targets' numbers side by side.
type Eight = [f64; WIDTH];

/// Eight targets with their seeds.
#[derive(Default)]
struct Targets {
    quaternion: [Eight; 4],
    translation: [Eight; 3],
    start: [Eight; 6],
}

/// The kernel on eight targets.
struct Block<'a, const MOVES: bool> {
    inverse: &'a Inverse<'a>,
    targets: &'a Targets,
    outputs: Outputs,
    solved: &'a mut Solved<Eight>,
}

impl<const MOVES: bool> AnyWidth for Block<'_, MOVES> {
    type Output = ();

    #[cfg_attr(not(debug_assertions), inline(always))]
    fn run<R: SinCos>(self, like: R) {
        let Inverse { arm, structure, kernel, .. } = self.inverse;
        let (targets, out) = (self.targets, self.solved);
        for from in (0..WIDTH).step_by(R::ROWS) {
            let (mut quaternion, mut translation, mut start) = ([like; 4], [like; 3], [like; 6]);
            for k in 0..4 {
                quaternion[k] = like.load(&targets.quaternion[k], from);
            }
            for k in 0..3 {
                translation[k] = like.load(&targets.translation[k], from);
            }
            for k in 0..6 {
                start[k] = like.load(&targets.start[k], from);
            }
            let goal = self.inverse.last_frame_goal(&quaternion, &translation);
            let start = arm.apply_joint_map(&start);
            let solved = kernel.solve::<R, MOVES>(arm, structure, &goal, &start, self.outputs);
            for k in 0..6 {
                solved.mapped[k].store(&mut out.mapped[k], from);
            }
            solved.residual_mm.store(&mut out.residual_mm, from);
            solved.residual_rad.store(&mut out.residual_rad, from);
            solved.steps.store(&mut out.steps, from);
            solved.converged.store(&mut out.converged, from);
            solved.singularity.store(&mut out.singularity, from);
            for side in 0..2 {
                for k in 0..3 {
                    solved.margins[side][k].store(&mut out.margins[side][k], from);
                }
            }
        }
    }
}

/// See [`Inverse::is_steady`].
struct Steady<'a> {
    limits: &'a Limits,
    targets: &'a Targets,
    solved: &'a Solved<Eight>,
    last: &'a Joints,
    margins: &'a [f64; 3],
}

impl AnyWidth for Steady<'_> {
    type Output = bool;

    #[cfg_attr(not(debug_assertions), inline(always))]
    fn run<R: SinCos>(self, like: R) -> bool {
        let Self { limits: Limits { min_rad, max_rad, .. }, targets, solved, last, margins } = self;
        let mut steady = like.splat(1.0);
        for from in (0..WIDTH).step_by(R::ROWS) {
            let singularity = like.load(&solved.singularity, from);
            steady =
                steady * like.load(&solved.converged, from) * (singularity - like.splat(1e-6)).positive();
            for joint in 0..6 {
                let angle = like.load(&solved.mapped[joint], from);
                let seed = like.load(&targets.start[joint], from);
                let before = like.load(&shifted(last[joint], &solved.mapped[joint]), from);
                // The seed differs from the row before by a few strides.
                steady = steady
                    * (angle - before).within(0.9 * STEADY_STRIDE_RAD)
                    * (angle - seed).within(STEADY_STRIDE_RAD)
                    * (angle - like.splat(min_rad[joint])).positive()
                    * (like.splat(max_rad[joint]) - angle).positive();
            }
            for k in 0..3 {
                let end = like.load(&solved.margins[1][k], from);
                let before = like.load(&shifted(margins[k], &solved.margins[1][k]), from);
                steady = steady
                    * (end * like.load(&solved.margins[0][k], from)).positive()
                    * (end * before).positive();
            }
        }
        !(like.splat(1.0) - steady).any_above(0.0)
    }
}

/// Each row's value in the row before, the first one's `before`.
#[inline(always)]
fn shifted(before: f64, rows: &Eight) -> Eight {
    let mut out = [before; WIDTH];
    out[1..].copy_from_slice(&rows[..WIDTH - 1]);
    out
}

#[inline(always)]
fn lane(solved: &Solved<Eight>, k: usize) -> Solved<f64> {
    let mut out = Solved {
        residual_mm: solved.residual_mm[k],
        residual_rad: solved.residual_rad[k],
        steps: solved.steps[k],
        converged: solved.converged[k],
        singularity: solved.singularity[k],
        ..Solved::default()
    };
    for (place, lanes) in out.mapped.iter_mut().zip(&solved.mapped) {
        *place = lanes[k];
    }
    for side in 0..2 {
        for (place, lanes) in out.margins[side].iter_mut().zip(&solved.margins[side]) {
            *place = lanes[k];
        }
    }
    out
}
