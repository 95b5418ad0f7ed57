//! Joints for a pose: closed form on the nominal arm for seeds, Newton on the estimated arm for the answer.
//!
//! Method: the nominal geometry tells the family ([`Family`](structure::Family)): spherical wrist, three parallel axes
//! (UR), or neither. A closed form gives up to eight branches as seeds; Newton's method carries each to the estimated
//! arm, whose perturbed links have no closed form and whose effects depend on the joints. Without a closed form the
//! seeds are spread over the joint ranges.
//! Shapes: one target, a pose of the flange in the base [mm]; solutions in controller angles [rad].
//! Stops: at 1e-9 mm and 1e-12 rad, see [`newton`]; how it ended otherwise is an [`InverseError`].
//! Checked against: `forward(inverse(pose)) = pose` for every arm of the catalogue, nominal and perturbed.

pub mod configuration;
pub mod newton;
mod axes;
mod spherical;
mod structure;
mod ur;

use std::f64::consts::{PI, TAU};

use nalgebra::Matrix6;

use self::configuration::{BRANCH_TOLERANCE, Configuration, QUARTER_AXES, QUARTER_TOLERANCE_RAD};
use self::newton::{Goal, Outcome};
use self::structure::{Family, Structure};
use super::condition::Condition;
use super::model::{Joints, Limits, Model, Posed};
use crate::math::se3::Pose;

pub use self::structure::Branch;

/// A joint angle may lie beyond its limit by rounding [rad].
const LIMIT_SLACK_RAD: f64 = 1e-9;

/// Solutions nearer than this are one [rad].
const SAME_RAD: f64 = 1e-6;

/// Joints that reach a target.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Solution {
    /// Controller angles [rad].
    pub joints: Joints,
    /// What the flange still misses the target by [mm].
    pub residual_mm: f64,
    /// What the flange still misses the target by [rad].
    pub residual_rad: f64,
    /// Newton steps taken.
    pub iterations: usize,
    /// Distance to singularity, 1/‖J⁻¹‖ (Frobenius) of the Jacobian with translations over [`Inverse::length_mm`]:
    /// at most the smallest singular value, at least its √6th part, and equal to it close to a singularity. 0 at one.
    pub singularity: f64,
}

/// A named singularity.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Singularity {
    /// Axes 4 and 6 (UR: 6 and the parallel ones) in line: joint 5.
    Wrist,
    /// The arm stretched or folded: joint 3.
    Elbow,
    /// The wrist centre on axis 1: joint 1.
    Shoulder,
    /// Not one of the named ones.
    Other,
}

impl Singularity {
    /// The joint (0-based) whose motion leaves the singularity or which turns fast near it.
    pub fn joint(&self) -> Option<usize> {
        match self {
            Singularity::Wrist => Some(4),
            Singularity::Elbow => Some(2),
            Singularity::Shoulder => Some(0),
            Singularity::Other => None,
        }
    }
}

impl std::fmt::Display for Singularity {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str(match self {
            Singularity::Wrist => "wrist singularity (joint 5)",
            Singularity::Elbow => "elbow singularity (joint 3)",
            Singularity::Shoulder => "shoulder singularity (joint 1)",
            Singularity::Other => "singularity",
        })
    }
}

/// Distances to the named singularities, each 0 at the singularity.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SingularityDistances {
    /// |sin| of the angle between axes 4 and 6; of axis 6 and the parallel axes for a UR arm.
    pub wrist: f64,
    /// |sin| of the angle between lower arm and forearm.
    pub elbow: f64,
    /// Distance of the wrist centre from the plane of axis 1, in parts of the arm's extent.
    pub shoulder: f64,
}

impl SingularityDistances {
    /// The nearest singularity and its distance.
    pub fn nearest(&self) -> (Singularity, f64) {
        let named = [
            (Singularity::Wrist, self.wrist),
            (Singularity::Elbow, self.elbow),
            (Singularity::Shoulder, self.shoulder),
        ];
        named
            .into_iter()
            .fold((Singularity::Other, f64::INFINITY), |best, n| if n.1 < best.1 { n } else { best })
    }
}

/// Why a target has no joints.
#[derive(Debug, Clone, Copy, PartialEq, thiserror::Error)]
pub enum InverseError {
    /// No branch reaches the target.
    #[error("target is out of reach by {beyond_mm:.3} mm")]
    Unreachable {
        /// How far the target's wrist centre lies outside the nominal arm's reach, on the nearest branch [mm].
        beyond_mm: f64,
    },
    /// The target needs an angle that a joint does not have.
    #[error(
        "joint {} would have to stand at {:.3}°, its range is {:.3}° to {:.3}°",
        joint + 1, angle_rad.to_degrees(), min_rad.to_degrees(), max_rad.to_degrees()
    )]
    OutsideLimits {
        /// Joint, 0-based.
        joint: usize,
        /// The angle it would need [rad].
        angle_rad: f64,
        /// Lower limit [rad].
        min_rad: f64,
        /// Upper limit [rad].
        max_rad: f64,
    },
    /// The arm is so close to a singularity that no joints were found.
    #[error("no joints found this close to the {singularity}: distance {distance:.2e}")]
    NearSingularity {
        /// Which one.
        singularity: Singularity,
        /// Its distance, see [`SingularityDistances`].
        distance: f64,
    },
    /// The target is reachable, but not on the branch of the seed.
    #[error("target is reachable only in another configuration: cfx {found} instead of {wanted}")]
    OtherBranch {
        /// cfx of the seed.
        wanted: i32,
        /// cfx of the nearest solution.
        found: i32,
    },
    /// The target is reachable, but not in the requested configuration.
    #[error("target is not reachable in configuration {wanted}; the nearest is {nearest}")]
    OtherConfiguration {
        /// What was asked for.
        wanted: Configuration,
        /// The nearest that reaches the target.
        nearest: Configuration,
    },
    /// Newton's method did not arrive.
    #[error("no solution found: {residual_mm:.3e} mm and {residual_rad:.3e} rad remain")]
    NotConverged {
        /// Remaining distance [mm].
        residual_mm: f64,
        /// Remaining angle [rad].
        residual_rad: f64,
    },
    /// The target or the seed holds NaN or an infinity.
    #[error("target or seed is not a finite number")]
    NotFinite,
}

/// The inverse map of one estimated arm under one condition. Prepare once, use for many targets.
#[derive(Debug, Clone)]
pub struct Inverse<'a> {
    arm: Posed<'a>,
    nominal_map: Matrix6<f64>,
    map_inverse: Option<Matrix6<f64>>,
    structure: Structure,
    length_mm: f64,
}

impl<'a> Inverse<'a> {
    /// Prepares the inverse of `estimated` under `condition`; seeds and branches come from `nominal`, whose joint map
    /// must be that of `estimated`. Give the same model twice for the nominal arm itself.
    pub fn new(estimated: &'a Model, condition: &Condition, nominal: &Model) -> Self {
        let structure = Structure::of(nominal);
        let half: f64 = nominal.links[1..].iter().map(|l| l.a_mm.abs() + l.d_mm.abs()).sum::<f64>() * 0.5;
        Self {
            arm: estimated.under(condition),
            nominal_map: nominal.joint_map,
            map_inverse: nominal.joint_map.try_inverse(),
            structure,
            length_mm: half.max(1.0),
        }
    }

    /// The estimated arm under its condition.
    pub fn arm(&self) -> &Posed<'a> {
        &self.arm
    }

    /// Characteristic length by which translations are divided: half of the link lengths behind axis 1 [mm].
    pub fn length_mm(&self) -> f64 {
        self.length_mm
    }

    /// Configuration of the arm at controller angles.
    pub fn configuration(&self, joints: &Joints) -> Configuration {
        configuration::of(&self.structure, &self.nominal_map, joints)
    }

    /// Branch of the arm at controller angles; `None` for an arm without a closed form.
    pub fn branch(&self, joints: &Joints) -> Option<Branch> {
        self.structure.branch(&self.nominal_rotations(joints))
    }

    /// Distances to the named singularities; `None` for an arm without a closed form.
    pub fn singularity_distances(&self, joints: &Joints) -> Option<SingularityDistances> {
        self.structure.margins(&self.nominal_rotations(joints)).map(|[shoulder, elbow, wrist]| {
            SingularityDistances { wrist: wrist.abs(), elbow: elbow.abs(), shoulder: shoulder.abs() }
        })
    }

    /// Smallest singular value of the joint Jacobian at the flange, translations divided by [`Inverse::length_mm`].
    pub fn smallest_singular_value(&self, joints: &Joints) -> f64 {
        newton::scaled_jacobian(&self.arm, joints, self.length_mm).singular_values().min()
    }

    /// The solution on the branch of `seed`, each joint on the turn nearest to it. The fast way along a path.
    pub fn solve_near(&self, target: &Pose, seed: &Joints) -> Result<Solution, InverseError> {
        let goal = self.goal(target)?;
        if !seed.iter().all(|q| q.is_finite()) {
            return Err(InverseError::NotFinite);
        }
        let direct = newton::solve(&self.arm, &goal, seed, self.length_mm);
        let moved = (direct.joints - seed).amax();
        let bound = if self.structure.family == Family::Other { 0.5 } else { 0.9 * PI };
        if direct.converged() && moved < bound && self.same_branch(seed, &direct.joints) {
            self.check_limits(&direct.joints)?;
            return Ok(self.solution(&direct));
        }
        let found = self.branches(&goal, Some(seed))?;
        let mut best: Option<(bool, f64, &Outcome)> = None;
        let mut other: Option<(f64, &Outcome)> = None;
        for outcome in &found {
            let distance = (outcome.joints - seed).amax();
            if !self.same_branch(seed, &outcome.joints) {
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
            (None, None) => Err(InverseError::NotConverged {
                residual_mm: direct.residual_mm,
                residual_rad: direct.residual_rad,
            }),
        }
    }

    /// The solution in a requested configuration.
    ///
    /// An axis may lie outside its requested quarter by up to 5°, since the estimated arm stands a little beside the
    /// nominal one for which the program was written. Among several the one nearest to `near` is taken, without `near` the one that best
    /// keeps to the quarters. Joints 2, 3 and 5 stand on the turn nearest to `near`, or in the middle of their range.
    pub fn solve_configured(
        &self,
        target: &Pose,
        configuration: &Configuration,
        near: Option<&Joints>,
    ) -> Result<Solution, InverseError> {
        let goal = self.goal(target)?;
        if near.is_some_and(|near| !near.iter().all(|q| q.is_finite())) {
            return Err(InverseError::NotFinite);
        }
        if let Some(near) = near
            && let Ok(solution) = self.solve_near(target, near)
            && self.fits(configuration, &solution.joints)
        {
            return Ok(solution);
        }
        let wanted = Joints::from_fn(|axis, _| match QUARTER_AXES.iter().position(|&a| a == axis) {
            Some(k) => (f64::from(configuration.quarters()[k]) + 0.5) * std::f64::consts::FRAC_PI_2,
            None => near.map_or_else(|| self.middle(axis), |near| near[axis]),
        });
        let mut best: Option<([f64; 2], Solution)> = None;
        let mut nearest: Option<(f64, Configuration)> = None;
        let mut outside = None;
        for outcome in self.branches(&goal, near)? {
            let start = on_turn_near(&outcome.joints, &wanted);
            let outcome = newton::solve(&self.arm, &goal, &start, self.length_mm);
            if !outcome.converged() {
                continue;
            }
            let overshoot = configuration.overshoot_rad(&outcome.joints);
            if nearest.is_none_or(|(o, _)| overshoot < o) {
                nearest = Some((overshoot, self.configuration(&outcome.joints)));
            }
            if !self.fits(configuration, &outcome.joints) {
                continue;
            }
            if let Err(error) = self.check_limits(&outcome.joints) {
                outside = Some(error);
                continue;
            }
            let distance = near.map_or(0.0, |near| (outcome.joints - near).amax());
            let rank = [distance, overshoot.max(0.0)];
            if best.as_ref().is_none_or(|(r, _)| rank < *r) {
                best = Some((rank, self.solution(&outcome)));
            }
        }
        match (best, outside, nearest) {
            (Some((_, solution)), _, _) => Ok(solution),
            (None, Some(error), _) => Err(error),
            (None, None, Some((_, nearest))) => {
                Err(InverseError::OtherConfiguration { wanted: *configuration, nearest })
            }
            (None, None, None) => Err(InverseError::Unreachable { beyond_mm: f64::NAN }),
        }
    }

    /// All solutions within the limits: every branch, and every turn of joints with more than one.
    pub fn all(&self, target: &Pose) -> Vec<Solution> {
        let Ok(goal) = self.goal(target) else { return Vec::new() };
        let Ok(found) = self.branches(&goal, None) else { return Vec::new() };
        let limits = &self.arm.model.limits;
        let mut out: Vec<Solution> = Vec::new();
        for outcome in found {
            for start in turns_within(&outcome.joints, limits) {
                let outcome = newton::solve(&self.arm, &goal, &start, self.length_mm);
                let new = !out.iter().any(|s| (s.joints - outcome.joints).amax() < SAME_RAD);
                if outcome.converged() && new && self.check_limits(&outcome.joints).is_ok() {
                    out.push(self.solution(&outcome));
                }
            }
        }
        out
    }

    fn goal(&self, target: &Pose) -> Result<Goal, InverseError> {
        let finite =
            target.translation.vector.iter().chain(target.rotation.coords.iter()).all(|v| v.is_finite());
        if finite { Ok(Goal::of(target, &self.arm.model.flange)) } else { Err(InverseError::NotFinite) }
    }

    fn nominal_rotations(&self, joints: &Joints) -> [f64; 6] {
        (self.nominal_map * joints).into()
    }

    fn middle(&self, axis: usize) -> f64 {
        let (low, high) = range(&self.arm.model.limits, axis);
        0.5 * (low + high)
    }

    fn fits(&self, configuration: &Configuration, joints: &Joints) -> bool {
        configuration.overshoot_rad(joints) <= QUARTER_TOLERANCE_RAD
            && self
                .structure
                .margins(&self.nominal_rotations(joints))
                .is_none_or(|margins| configuration.has_branch(&margins))
    }

    /// Whether two joint vectors lie on one branch; a border of which either stands near does not count.
    fn same_branch(&self, a: &Joints, b: &Joints) -> bool {
        let margins = |joints: &Joints| self.structure.margins(&self.nominal_rotations(joints));
        match (margins(a), margins(b)) {
            (Some(a), Some(b)) => (0..3).all(|k| {
                (a[k] < 0.0) == (b[k] < 0.0) || a[k].abs() < BRANCH_TOLERANCE || b[k].abs() < BRANCH_TOLERANCE
            }),
            _ => true,
        }
    }

    fn check_limits(&self, joints: &Joints) -> Result<(), InverseError> {
        let Limits { min_rad, max_rad, .. } = &self.arm.model.limits;
        for joint in 0..6 {
            let (angle_rad, min_rad, max_rad) = (joints[joint], min_rad[joint], max_rad[joint]);
            if angle_rad < min_rad - LIMIT_SLACK_RAD || angle_rad > max_rad + LIMIT_SLACK_RAD {
                return Err(InverseError::OutsideLimits { joint, angle_rad, min_rad, max_rad });
            }
        }
        Ok(())
    }

    fn solution(&self, outcome: &Outcome) -> Solution {
        let jacobian = newton::scaled_jacobian(&self.arm, &outcome.joints, self.length_mm);
        Solution {
            joints: outcome.joints,
            residual_mm: outcome.residual_mm,
            residual_rad: outcome.residual_rad,
            iterations: outcome.iterations,
            singularity: jacobian.try_inverse().map_or(0.0, |inverse| 1.0 / inverse.norm()),
        }
    }

    /// Converged solutions on all branches, limits not looked at; each joint on the turn nearest to `near`, or to the
    /// middle of its range.
    fn branches(&self, goal: &Goal, near: Option<&Joints>) -> Result<Vec<Outcome>, InverseError> {
        let around = near.copied().unwrap_or_else(|| Joints::from_fn(|axis, _| self.middle(axis)));
        let seeds = self.structure.seeds(&goal.last, &self.nominal_rotations(&around));
        let beyond_mm = seeds.iter().map(|s| s.beyond_mm).fold(f64::INFINITY, f64::min);
        let mut found: Vec<Outcome> = Vec::with_capacity(seeds.len());
        let mut closest: Option<Outcome> = None;
        let mut attempt = |start: Joints, found: &mut Vec<Outcome>| {
            let mut outcome = newton::solve(&self.arm, goal, &start, self.length_mm);
            if outcome.converged() {
                let turned = on_turn_near(&outcome.joints, &around);
                if turned != outcome.joints {
                    outcome = newton::solve(&self.arm, goal, &turned, self.length_mm);
                }
                if !found.iter().any(|f| (f.joints - outcome.joints).amax() < SAME_RAD) {
                    found.push(outcome);
                }
            } else {
                let miss = |o: &Outcome| o.residual_mm / self.length_mm + o.residual_rad;
                if closest.as_ref().is_none_or(|c| miss(&outcome) < miss(c)) {
                    closest = Some(outcome);
                }
            }
        };
        if let Some(map_inverse) = &self.map_inverse {
            for seed in &seeds {
                attempt(on_turn_near(&(map_inverse * Joints::from(seed.rotations)), &around), &mut found);
            }
        }
        let far_out = beyond_mm.is_finite() && beyond_mm > 0.05 * self.length_mm;
        let spread = match self.structure.family {
            Family::Other => 64,
            _ if found.is_empty() && !far_out => 16,
            _ => 0,
        };
        for k in 0..spread {
            attempt(self.spread_seed(k), &mut found);
        }
        if !found.is_empty() {
            return Ok(found);
        }
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

    /// Point `k` of a Halton sequence over the joint ranges.
    fn spread_seed(&self, k: usize) -> Joints {
        Joints::from_fn(|axis, _| {
            let base = [2, 3, 5, 7, 11, 13][axis];
            let (mut fraction, mut scale, mut rest) = (0.0, 1.0, k + 1);
            while rest > 0 {
                scale /= base as f64;
                fraction += scale * (rest % base) as f64;
                rest /= base;
            }
            let (low, high) = range(&self.arm.model.limits, axis);
            low + fraction * (high - low)
        })
    }
}

/// The same joint positions, each on the turn nearest to `wanted`.
fn on_turn_near(joints: &Joints, wanted: &Joints) -> Joints {
    joints.zip_map(wanted, |q, w| q + TAU * ((w - q) / TAU).round())
}

/// Range of an axis; one turn where none is stated.
fn range(limits: &Limits, axis: usize) -> (f64, f64) {
    let (low, high) = (limits.min_rad[axis], limits.max_rad[axis]);
    if (high - low).is_finite() { (low, high) } else { (-PI, PI) }
}

/// More combinations of turns than a robot has; an arm with wider limits gets the nearest turn of each joint alone.
const MOST_COMBINATIONS: usize = 4096;

/// Every combination of full turns that lies within the limits.
fn turns_within(joints: &Joints, limits: &Limits) -> Vec<Joints> {
    let mut out = vec![*joints];
    for axis in 0..6 {
        // A joint may lie outside by as much as effects move it from turn to turn; Newton and the limits decide.
        let slack = 0.02;
        let (min, max) = range(limits, axis);
        let low = ((min - slack - joints[axis]) / TAU).ceil();
        let high = ((max + slack - joints[axis]) / TAU).floor();
        let count = (high - low + 1.0).max(0.0);
        if count * out.len() as f64 > MOST_COMBINATIONS as f64 {
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
