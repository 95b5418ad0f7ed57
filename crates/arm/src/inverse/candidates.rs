//! Global inverse search: all branches, all turns, and seeds spread over the joint ranges.

use std::f64::consts::{FRAC_PI_2, PI, TAU};

use nalgebra::UnitQuaternion;

use super::budget;
use super::configuration::{BRANCH_TOLERANCE, Configuration, QUARTER_AXES};
use super::newton::{self, Goal, NewtonResult};
use super::{Inverse, InverseError, Solution, same_branch};
use crate::joints::Joints;
use crate::limits::Limits;
use truegrind_math::se3::Pose;
use truegrind_math::spectral;

/// Solutions nearer than this are the same (rad).
const SAME_RAD: f64 = 1e-6;
/// Another solution may be near along singular directions below this value.
const NEARLY_SINGULAR: f64 = 0.15;
/// Halton seeds for an arm without a closed form.
const HALTON_SEEDS: usize = 64;
/// Halton seeds where a closed form finds nothing although the target seems reachable.
const RESCUE_SEEDS: usize = 24;
/// A solution with a smaller margin to a singularity may have a second solution across it.
const NEAR_FOLD: f64 = 0.1;
/// Perturbed targets tried where the requested solution is not found.
const PERTURBED_TARGETS: usize = 60;
/// Sizes of the perturbation, in turn (rad, and fractions of the characteristic length).
const PERTURBATION: [f64; 3] = [0.01, 0.04, 0.15];

impl Inverse<'_> {
    /// [`Inverse::solve_near`] where the kernel's solution is not accepted.
    pub(super) fn search_near(
        &self,
        goal: &Goal,
        seed: &Joints,
        margins: &[f64; 3],
    ) -> Result<Solution, InverseError> {
        let found = self.branches(goal, Some(seed), margins, 0)?;
        let mut best: Option<(bool, f64, &NewtonResult)> = None;
        let mut other: Option<(f64, &NewtonResult)> = None;
        for outcome in &found {
            let distance = (outcome.joints - seed).amax();
            if !same_branch(margins, &self.margins(&outcome.joints)) {
                if other.is_none_or(|(d, _)| distance < d) {
                    other = Some((distance, outcome));
                }
                continue;
            }
            let outside = self.check_limits(&outcome.joints).is_err();
            if best.is_none_or(|(o, d, _)| (outside, distance) < (o, d)) {
                best = Some((outside, distance, outcome));
            }
        }
        match (best, other) {
            (Some((_, _, outcome)), _) => {
                self.check_limits(&outcome.joints)?;
                Ok(self.solution(outcome))
            }
            (None, Some((_, outcome))) => Err(InverseError::OtherBranch {
                wanted: self.configuration(seed).cfx,
                found: self.configuration(&outcome.joints).cfx,
            }),
            (None, None) => Err(InverseError::NotFinite),
        }
    }

    /// [`Inverse::solve_configured`] by a search over all branches.
    pub(super) fn search_configured(
        &self,
        goal: &Goal,
        configuration: &Configuration,
        near: Option<&Joints>,
    ) -> Result<Solution, InverseError> {
        let wanted = Joints::from_fn(|axis, _| match QUARTER_AXES.iter().position(|&a| a == axis) {
            Some(k) => (f64::from(configuration.quarters()[k]) + 0.5) * FRAC_PI_2,
            // A joint whose range is less than a turn has at most one turn within it.
            None => {
                near.filter(|_| self.room(axis) > TAU).map_or_else(|| self.middle(axis), |near| near[axis])
            }
        });
        let mut best: Option<([f64; 3], NewtonResult)> = None;
        let mut nearest: Option<(f64, Joints)> = None;
        let mut outside = None;
        let mut found = self.branches(goal, near, &[1.0; 3], 0)?;
        let fits = |o: &NewtonResult| {
            let margins = self.margins(&o.joints);
            configuration.matches_branch_exactly(&margins)
                && configuration.matches(&self.turned(goal, *o, &wanted).joints, &margins)
        };
        if !found.iter().any(fits) {
            found = self.branches(goal, near, &[1.0; 3], RESCUE_SEEDS)?;
        }
        if !found.iter().any(fits) {
            found = self.beside(goal, near, found, &fits);
        }
        for found in found {
            let outcome = self.turned(goal, found, &wanted);
            if !outcome.converged() {
                continue;
            }
            let joints = outcome.joints;
            let overshoot = configuration.overshoot_rad(&joints);
            if nearest.is_none_or(|(o, _)| overshoot < o) {
                nearest = Some((overshoot, joints));
            }
            let margins = self.margins(&joints);
            if !configuration.matches(&joints, &margins) {
                continue;
            }
            if let Err(error) = self.check_limits(&joints) {
                outside = Some(error);
                continue;
            }
            let distance = near.map_or(0.0, |near| (joints - near).amax());
            // The stated branch has precedence over a shorter distance.
            let strays = f64::from(u8::from(!configuration.matches_branch_exactly(&margins)));
            let rank = [strays, distance, overshoot.max(0.0)];
            if best.as_ref().is_none_or(|(r, _)| rank < *r) {
                best = Some((rank, outcome));
            }
        }
        if budget::exhausted() {
            return Err(InverseError::Abandoned);
        }
        match (best, outside, nearest) {
            (Some((_, outcome)), _, _) => Ok(self.solution(&outcome)),
            (None, Some(error), _) => Err(error),
            (None, None, Some((_, joints))) => Err(InverseError::OtherConfiguration {
                wanted: *configuration,
                nearest: self.configuration(&joints),
            }),
            (None, None, None) => Err(InverseError::NotFinite),
        }
    }

    /// One solution within the limits for each branch, each joint on the turn nearest to `near`: the candidates of a controller
    /// that moves to the nearest one. Empty where there is none.
    pub fn solve_all_branches(&self, target: &Pose, near: &Joints) -> Vec<Joints> {
        let Ok(goal) = self.goal(target) else { return Vec::new() };
        let found = self.branches(&goal, Some(near), &self.margins(near), 0).unwrap_or_default();
        let within = |o: &NewtonResult| self.check_limits(&o.joints).is_ok();
        found.iter().filter(|o| within(o)).map(|o| o.joints).collect()
    }

    /// Every solution within the limits.
    pub(super) fn all_within_limits(&self, goal: &Goal) -> Vec<Solution> {
        let mut out: Vec<Solution> = Vec::new();
        for outcome in self.branches(goal, None, &[1.0; 3], 0).unwrap_or_default() {
            for start in full_turns_within(&outcome.joints, &self.arm.model.limits) {
                let outcome = newton::solve(&self.arm, goal, &start, self.kernel.length_mm);
                let new = !out.iter().any(|s| (s.joints - outcome.joints).amax() < SAME_RAD);
                if outcome.converged() && new && self.check_limits(&outcome.joints).is_ok() {
                    out.push(self.solution(&outcome));
                }
            }
        }
        out
    }

    /// Converged solutions on all branches, joint limits ignored; each joint on the turn nearest to `near`, or to the
    /// middle of its range. An error where there is none. `margins` are those of `near`; `spread` more
    /// seeds are spread over the joint ranges.
    fn branches(
        &self,
        goal: &Goal,
        near: Option<&Joints>,
        margins: &[f64; 3],
        spread: usize,
    ) -> Result<Vec<NewtonResult>, InverseError> {
        if budget::refuses() {
            return Err(InverseError::Abandoned);
        }
        let around = near.copied().unwrap_or_else(|| Joints::from_fn(|axis, _| self.middle(axis)));
        let seeds = self.structure.seeds(&goal.last, &self.arm.model.mapped(&around).into());
        let beyond_mm = seeds.iter().map(|s| s.beyond_mm).fold(f64::INFINITY, f64::min);
        if self.structure.is_surely_unreachable(&goal.last, beyond_mm, self.model_distance_mm) {
            return Err(InverseError::Unreachable { beyond_mm });
        }
        let mut search =
            Search { inverse: self, goal, around, found: Vec::with_capacity(8), stuck: Vec::new() };
        if let Some(near) = near {
            search.attempt(near);
        }
        if let Some(map_inverse) = &self.map_inverse {
            for seed in &seeds {
                search.attempt(&(map_inverse * Joints::from(seed.rotations)));
            }
        }
        if self.structure.has_branches() {
            // Two branches meet at a fold, where Newton may take both seeds to one of them, or to none.
            if search.found.len() < seeds.len() && beyond_mm < 0.05 * self.kernel.length_mm {
                let roots = search.found.iter().chain(&search.stuck).map(|o| o.joints).collect::<Vec<_>>();
                roots.iter().for_each(|root| search.explore(root));
            }
            if let Some(near) = near
                && !search.found.iter().any(|f| same_branch(margins, &self.margins(&f.joints)))
            {
                search.explore(near);
            }
        }
        let spread = match self.structure.has_branches() {
            false => HALTON_SEEDS,
            true if search.found.is_empty() && beyond_mm < 0.05 * self.kernel.length_mm => RESCUE_SEEDS,
            true => spread,
        };
        for k in 0..spread {
            search.attempt(&self.halton_seed(k));
        }
        if budget::exhausted() {
            return Err(InverseError::Abandoned);
        }
        if !search.found.is_empty() {
            return Ok(search.found);
        }
        let miss = |o: &NewtonResult| o.residual_mm / self.kernel.length_mm + o.residual_rad;
        let closest = search.stuck.into_iter().reduce(|a, b| if miss(&b) < miss(&a) { b } else { a });
        let Some(closest) = closest else { return Err(InverseError::NotFinite) };
        if beyond_mm.is_finite() && beyond_mm > 0.0 {
            return Err(InverseError::Unreachable { beyond_mm });
        }
        if let Some((singularity, distance)) =
            self.singularity_distances(&closest.joints).map(|d| d.nearest())
            && distance < BRANCH_TOLERANCE
        {
            return Err(InverseError::NearSingularity { singularity, distance });
        }
        Err(InverseError::NotConverged {
            residual_mm: closest.residual_mm,
            residual_rad: closest.residual_rad,
        })
    }

    /// Adds solutions near a fold until one `fits`. There the closed form of the target gives few seeds; those of slightly
    /// perturbed targets lie all around the fold.
    fn beside(
        &self,
        goal: &Goal,
        near: Option<&Joints>,
        found: Vec<NewtonResult>,
        fits: &dyn Fn(&NewtonResult) -> bool,
    ) -> Vec<NewtonResult> {
        let folded = |o: &NewtonResult| self.margins(&o.joints).iter().any(|m| m.abs() < NEAR_FOLD);
        let Some(map_inverse) = self.map_inverse.filter(|_| found.iter().any(folded)) else { return found };
        let around = near.copied().unwrap_or_else(|| Joints::from_fn(|axis, _| self.middle(axis)));
        let mapped = self.arm.model.mapped(&around).into();
        let mut search = Search { inverse: self, goal, around, found, stuck: Vec::new() };
        for k in 0..PERTURBED_TARGETS {
            let width = PERTURBATION[k % PERTURBATION.len()];
            let off = Joints::from_fn(|axis, _| width * (2.0 * halton(axis, k) - 1.0));
            let shift = off.fixed_rows::<3>(0) * self.kernel.length_mm;
            let turn = UnitQuaternion::from_scaled_axis(off.fixed_rows::<3>(3).into_owned());
            let target =
                Pose::from_parts((goal.last.translation.vector + shift).into(), turn * goal.last.rotation);
            for seed in self.structure.seeds(&target, &mapped) {
                let known = search.found.len();
                search.attempt(&(map_inverse * Joints::from(seed.rotations)));
                if search.found[known..].iter().any(fits) {
                    return search.found;
                }
            }
        }
        search.found
    }

    /// The outcome with each joint on the turn nearest to `wanted`, solved again since effects may depend on the turn. A joint
    /// without a stated quarter keeps within its range where some turn does.
    fn turned(&self, goal: &Goal, outcome: NewtonResult, wanted: &Joints) -> NewtonResult {
        let mut joints = on_nearest_turn(&outcome.joints, wanted);
        for axis in (0..6).filter(|axis| !QUARTER_AXES.contains(axis)) {
            let (low, high) = range(&self.arm.model.limits, axis);
            let (less, more) = (joints[axis] - TAU, joints[axis] + TAU);
            if joints[axis] > high && less >= low {
                joints[axis] = less;
            } else if joints[axis] < low && more <= high {
                joints[axis] = more;
            }
        }
        if joints == outcome.joints {
            return outcome;
        }
        newton::solve(&self.arm, goal, &joints, self.kernel.length_mm)
    }

    /// Range of an axis (rad); infinite where none is stated.
    fn room(&self, axis: usize) -> f64 {
        let room = self.arm.model.limits.max_rad[axis] - self.arm.model.limits.min_rad[axis];
        if room.is_finite() { room } else { f64::INFINITY }
    }

    fn middle(&self, axis: usize) -> f64 {
        let (low, high) = range(&self.arm.model.limits, axis);
        0.5 * (low + high)
    }

    /// Point `k` of a Halton sequence over the joint ranges.
    fn halton_seed(&self, k: usize) -> Joints {
        Joints::from_fn(|axis, _| {
            let (low, high) = range(&self.arm.model.limits, axis);
            low + halton(axis, k) * (high - low)
        })
    }
}

/// Point `k` of a Halton sequence, from 0 to 1, along an axis.
fn halton(axis: usize, k: usize) -> f64 {
    let base = [2, 3, 5, 7, 11, 13][axis];
    let (mut fraction, mut scale, mut rest) = (0.0, 1.0, k + 1);
    while rest > 0 {
        scale /= base as f64;
        fraction += scale * (rest % base) as f64;
        rest /= base;
    }
    fraction
}

/// Solutions collected from many seeds.
struct Search<'s, 'a> {
    inverse: &'s Inverse<'a>,
    goal: &'s Goal,
    around: Joints,
    found: Vec<NewtonResult>,
    stuck: Vec<NewtonResult>,
}

impl Search<'_, '_> {
    fn attempt(&mut self, seed: &Joints) {
        let inverse = self.inverse;
        let start = on_nearest_turn(seed, &self.around);
        let outcome = newton::solve(&inverse.arm, self.goal, &start, inverse.kernel.length_mm);
        if !outcome.converged() {
            self.stuck.push(outcome);
            return;
        }
        let outcome = inverse.turned(self.goal, outcome, &self.around);
        if outcome.converged() && !self.found.iter().any(|f| (f.joints - outcome.joints).amax() < SAME_RAD) {
            self.found.push(outcome);
        }
    }

    /// Tries seeds on both sides of `root` along every nearly singular direction, where the second solution near a fold lies.
    fn explore(&mut self, root: &Joints) {
        let arm = &self.inverse.arm;
        let jacobian =
            newton::scaled_jacobian(arm, root, self.inverse.kernel.length_mm) * arm.rotation_jacobian(root);
        let Some(svd) = spectral::svd(&jacobian, true) else { return };
        let Some(directions) = svd.v_t else { return };
        for k in (0..6).filter(|&k| svd.singular_values[k] < NEARLY_SINGULAR) {
            let direction = directions.row(k).transpose();
            for stride in [0.02, 0.06, 0.2, 0.6] {
                self.attempt(&(root + direction * stride));
                self.attempt(&(root - direction * stride));
            }
        }
    }
}

/// The same joint positions, each on the turn nearest to `wanted`.
fn on_nearest_turn(joints: &Joints, wanted: &Joints) -> Joints {
    joints.zip_map(wanted, |q, w| q + TAU * ((w - q) / TAU).round())
}

/// Range of an axis; one turn where none is stated.
fn range(limits: &Limits, axis: usize) -> (f64, f64) {
    let (low, high) = (limits.min_rad[axis], limits.max_rad[axis]);
    if (high - low).is_finite() { (low, high) } else { (-PI, PI) }
}

/// More combinations of turns than any robot has; beyond, a joint keeps its nearest turn alone.
const MAX_COMBINATIONS: usize = 4096;

/// Every combination of full turns that lies within the limits.
fn full_turns_within(joints: &Joints, limits: &Limits) -> Vec<Joints> {
    let mut out = vec![*joints];
    for axis in 0..6 {
        // Effects may move a joint from turn to turn by this much; Newton and the limits decide.
        let slack = 0.02;
        let (min, max) = range(limits, axis);
        let low = ((min - slack - joints[axis]) / TAU).ceil();
        let high = ((max + slack - joints[axis]) / TAU).floor();
        let count = (high - low + 1.0).max(0.0);
        if count * out.len() as f64 > MAX_COMBINATIONS as f64 {
            continue;
        }
        out = out
            .iter()
            .flat_map(|base| {
                (0..count as usize).map(move |turn| {
                    let mut shifted = *base;
                    shifted[axis] += TAU * (low + turn as f64);
                    shifted
                })
            })
            .collect();
    }
    out
}
