//! Inverse kinematics: closed form on the nominal arm for seeds, Newton's method on the estimated arm for the answer.
//!
//! Method: the nominal geometry determines the family: spherical wrist, three parallel axes (UR), or neither. A closed form
//! gives up to eight branches as seeds; Newton's method takes each to the estimated arm, whose perturbed links have no closed
//! form and whose effects depend on the joints. Without a closed form the seeds are spread over the joint ranges. Along a path
//! each target starts from its neighbour, eight in lanes, without a closed form.
//! Shapes: one target, a pose of the flange in the base (mm); solutions in controller angles (rad).
//! Termination: at 1e-9 mm and 1e-12 rad, see [`newton`]; otherwise an [`InverseError`].
//! Checked against: `forward(inverse(pose)) = pose` for every arm of the catalogue, nominal and perturbed.

pub mod solution;
pub mod configuration;
pub mod newton;
pub mod budget;
mod axes;
mod seed;
mod spherical;
mod ur;
mod structure;
mod kernel;
mod candidates;
mod path;

use std::f64::consts::PI;

use nalgebra::Matrix6;

use self::configuration::{BRANCH_TOLERANCE, Configuration};
use self::kernel::{Kernel, Solved};
use self::newton::{Goal, NewtonResult};
use self::structure::Structure;
use super::chain::FrameColumns;
use super::condition::Condition;
use super::link::Link;
use super::model::{Model, PreparedModel};
use crate::joints::{self, Joints, MappedJoints};
use truegrind_math::se3::Pose;
use truegrind_math::spectral;

pub use self::solution::{InverseError, Singularity, SingularityDistances, Solution};
pub use self::structure::Branch;

/// A joint angle may lie beyond its limit by rounding (rad).
const LIMIT_SLACK_RAD: f64 = 1e-9;

/// A solution farther from its seed than this is rejected in favour of a search over all branches (rad).
const MAX_SEED_DISTANCE_RAD: f64 = 0.9 * PI;
/// The same for an arm whose branches cannot be told apart (rad).
const MAX_SEED_DISTANCE_NO_BRANCHES_RAD: f64 = 0.5;

/// The inverse map of one estimated arm under one condition. Prepare once, use for many targets.
#[derive(Debug, Clone)]
pub struct Inverse<'a> {
    arm: PreparedModel<'a>,
    map_inverse: Option<Matrix6<f64>>,
    flange_inverse: FrameColumns<f64>,
    structure: Structure,
    kernel: Kernel,
    /// Upper bound of the distance between a point of the estimated arm and the same point of the nominal arm at equal joint
    /// angles (mm).
    model_distance_mm: f64,
}

impl<'a> Inverse<'a> {
    /// Prepares the inverse of `estimated` under `condition`; seeds and branches come from `nominal`, whose joint map
    /// must be that of `estimated`. Give the same model twice for the nominal arm itself.
    pub fn new(estimated: &'a Model, condition: &Condition, nominal: &Model) -> Self {
        let structure = Structure::of(nominal);
        let half: f64 = nominal.links[1..].iter().map(|l| l.a_mm.abs() + l.d_mm.abs()).sum::<f64>() * 0.5;
        Self {
            arm: estimated.at_condition(condition),
            map_inverse: estimated.joint_map.try_inverse(),
            flange_inverse: {
                let inverse = estimated.flange.inverse();
                let turn = inverse.rotation.to_rotation_matrix();
                FrameColumns {
                    axes: std::array::from_fn(|j| std::array::from_fn(|i| turn[(i, j)])),
                    origin: inverse.translation.vector.into(),
                }
            },
            kernel: Kernel {
                wrist_mm: structure.wrist_in_last(),
                flange_mm: estimated.flange.translation.vector.into(),
                length_mm: half.max(1.0),
            },
            model_distance_mm: model_distance_mm(estimated, condition, nominal, structure.extent_mm()),
            structure,
        }
    }

    /// The estimated arm under its condition.
    pub fn arm(&self) -> &PreparedModel<'a> {
        &self.arm
    }

    /// Characteristic length by which translations are divided: half of the link lengths behind axis 1 (mm).
    pub fn length_mm(&self) -> f64 {
        self.kernel.length_mm
    }

    /// Configuration of the arm at controller angles.
    pub fn configuration(&self, joints: &Joints) -> Configuration {
        configuration::of(self.branch(joints), joints)
    }

    /// Branch of the arm at controller angles; `None` for an arm without a closed form.
    pub fn branch(&self, joints: &Joints) -> Option<Branch> {
        self.structure.has_branches().then(|| Branch::of(&self.margins(joints)))
    }

    /// Distances to the named singularities; `None` for an arm without a closed form.
    pub fn singularity_distances(&self, joints: &Joints) -> Option<SingularityDistances> {
        let [shoulder, elbow, wrist] = self.margins(joints).map(f64::abs);
        self.structure.has_branches().then_some(SingularityDistances { wrist, elbow, shoulder })
    }

    /// The distances of [`Inverse::singularity_distances`] with the signs of the branch: shoulder, elbow, wrist; negative for
    /// behind, elbow back and axis 5 negative. All 1 for an arm without a closed form.
    pub fn branch_margins(&self, joints: &Joints) -> [f64; 3] {
        self.margins(joints)
    }

    /// Whether the arm has a closed form, and so branches.
    pub fn has_branches(&self) -> bool {
        self.structure.has_branches()
    }

    /// Distance to singularity at controller angles, as [`Solution::singularity`] states it.
    pub fn singularity(&self, joints: &Joints) -> f64 {
        let jacobian = newton::scaled_jacobian(&self.arm, joints, self.kernel.length_mm);
        jacobian.try_inverse().map_or(0.0, |inverse| 1.0 / inverse.norm())
    }

    /// Smallest singular value of the 6 × 6 Jacobian of the flange, translations divided by [`Inverse::length_mm`],
    /// with respect to the rotations of the joints (couplings and slopes of effects not counted). NaN where a joint is
    /// NaN.
    pub fn smallest_singular_value(&self, joints: &Joints) -> f64 {
        let jacobian = newton::scaled_jacobian(&self.arm, joints, self.kernel.length_mm);
        spectral::singular_values(&jacobian).map_or(f64::NAN, |values| values.min())
    }

    /// The solution on the branch of `seed`, each joint on the turn nearest to it. The fast function along a path.
    ///
    /// The branch can change only at a singularity: where the margin of seed or solution is below 2 %, either side counts as
    /// the seed's branch.
    ///
    /// ```
    /// use truegrind_arm::condition::Condition;
    /// use truegrind_arm::inverse::{Inverse, InverseError};
    /// use truegrind_arm::model::Joints;
    /// use truegrind_arm::robots;
    ///
    /// let arm = robots::load("abb-irb-120")?.model;
    /// let still = Condition::default();
    /// let inverse = Inverse::new(&arm, &still, &arm);
    /// let meant = Joints::new(0.3, 0.2, -0.1, 0.5, 0.8, -0.4);
    /// let found = inverse.solve_near(&arm.forward(&meant, &still), &Joints::new(0.2, 0.1, 0.0, 0.4, 0.7, -0.3))?;
    /// assert!((found.joints - meant).norm() < 1e-9);
    ///
    /// // A target two metres away is unreachable; the error states by how much.
    /// let far = nalgebra::Translation3::new(2000.0, 0.0, 0.0) * arm.forward(&meant, &still);
    /// let refused = inverse.solve_near(&far, &meant);
    /// assert!(matches!(refused, Err(InverseError::Unreachable { beyond_mm }) if beyond_mm > 1000.0));
    /// # Ok::<(), Box<dyn std::error::Error>>(())
    /// ```
    pub fn solve_near(&self, target: &Pose, seed: &Joints) -> Result<Solution, InverseError> {
        let goal = self.goal(target)?;
        if !seed.iter().all(|q| q.is_finite()) {
            return Err(InverseError::NotFinite);
        }
        if budget::refuses_near_solve() {
            return Err(InverseError::Abandoned);
        }
        let solved = self.solve_fast(target, seed);
        match self.accepted(&solved, seed) {
            Some(solution) => self.check_limits(&solution.joints).map(|()| solution),
            None => self.search_near(&goal, seed, &solved.margins[0]),
        }
    }

    /// [`Inverse::solve_near`] without a search over all branches; `None` where one would be needed.
    fn solve_without_search(&self, target: &Pose, seed: &Joints) -> Option<Result<Solution, InverseError>> {
        if self.goal(target).is_err() || !seed.iter().all(|q| q.is_finite()) {
            return Some(Err(InverseError::NotFinite));
        }
        let solution = self.accepted(&self.solve_fast(target, seed), seed)?;
        Some(self.check_limits(&solution.joints).map(|()| solution))
    }

    /// The solution in a requested configuration.
    ///
    /// An axis may lie outside its requested quarter by up to 5°, since the estimated arm differs a little from the nominal one
    /// for which the program was written; for the same reason a branch may be left where its margin is small. A solution on
    /// the exact branch has precedence: near a singularity the arm has two solutions close together, and cfx selects one.
    /// Among several the one nearest to `near` is taken; without `near` the one with the least overshoot of the quarters.
    /// Joints 2, 3 and 5 take the turn nearest to `near`; without it, or with a range of less than a turn, the turn nearest to
    /// the middle of their range.
    ///
    /// ```
    /// use truegrind_arm::condition::Condition;
    /// use truegrind_arm::inverse::Inverse;
    /// use truegrind_arm::inverse::configuration::Configuration;
    /// use truegrind_arm::model::Joints;
    /// use truegrind_arm::robots;
    ///
    /// // A target in an open place, as a RAPID program states it: the same flange with the wrist the other way round.
    /// let arm = robots::load("abb-irb-120")?.model;
    /// let still = Condition::default();
    /// let inverse = Inverse::new(&arm, &still, &arm);
    /// let meant = Joints::new(0.3, 0.2, -0.1, 0.5, 0.8, -0.4);
    /// let flange = arm.forward(&meant, &still);
    /// let up = inverse.configuration(&meant);
    /// let found = inverse.solve_configured(&flange, &up, None)?;
    /// assert!((found.joints - meant).norm() < 1e-9);
    /// let flipped = Configuration { cf4: -2, cf6: 1, cfx: up.cfx + 1, ..up };
    /// let other = inverse.solve_configured(&flange, &flipped, None)?;
    /// assert!(other.joints[4] < 0.0 && (other.joints[4] + 0.8).abs() < 1e-9);
    /// # Ok::<(), Box<dyn std::error::Error>>(())
    /// ```
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
            && let margins = self.margins(&solution.joints)
            && configuration.matches(&solution.joints, &margins)
            && configuration.matches_branch_exactly(&margins)
        {
            return Ok(solution);
        }
        self.search_configured(&goal, configuration, near)
    }

    /// All solutions within the limits: every branch, and every turn of joints with more than one.
    pub fn all(&self, target: &Pose) -> Vec<Solution> {
        self.goal(target).map(|goal| self.all_within_limits(&goal)).unwrap_or_default()
    }

    fn goal(&self, target: &Pose) -> Result<Goal, InverseError> {
        let finite =
            target.translation.vector.iter().chain(target.rotation.coords.iter()).all(|v| v.is_finite());
        if finite { Ok(Goal::of(target, &self.arm.model.flange)) } else { Err(InverseError::NotFinite) }
    }

    fn margins(&self, joints: &Joints) -> [f64; 3] {
        self.structure.margins_of(&self.arm.frames(joints))
    }

    /// The kernel's solution, if it is accepted.
    fn accepted(&self, solved: &Solved<f64>, seed: &Joints) -> Option<Solution> {
        let joints = self.controller_angles(MappedJoints(solved.mapped.into()));
        self.is_accepted(solved, &joints, seed).then_some(solved.solution(&joints))
    }

    /// Controller angles for mapped ones.
    #[inline(always)]
    fn controller_angles(&self, MappedJoints(mapped): MappedJoints) -> Joints {
        match &self.map_inverse {
            Some(inverse) if !self.arm.map_is_identity() => inverse * mapped,
            _ => mapped,
        }
    }

    /// Whether a solution of the kernel is accepted: converged, near the seed, on its branch.
    #[inline(always)]
    fn is_accepted(&self, solved: &Solved<f64>, joints: &Joints, seed: &Joints) -> bool {
        let farthest = if self.structure.has_branches() {
            MAX_SEED_DISTANCE_RAD
        } else {
            MAX_SEED_DISTANCE_NO_BRANCHES_RAD
        };
        self.map_inverse.is_some()
            && solved.converged == 1.0
            && solved.singularity > 1e-9
            && joints::max_joint_difference(joints, seed) < farthest
            && same_branch(&solved.margins[0], &solved.margins[1])
    }

    #[inline(always)]
    fn within_limits(&self, joints: &Joints) -> bool {
        self.arm.model.limits.violated_beyond(joints, LIMIT_SLACK_RAD).is_none()
    }

    fn check_limits(&self, joints: &Joints) -> Result<(), InverseError> {
        let limits = &self.arm.model.limits;
        limits.violated_beyond(joints, LIMIT_SLACK_RAD).map_or(Ok(()), |what| {
            let [angle_rad, min_rad, max_rad] = limits.angle_and_range(what, joints);
            Err(InverseError::OutsideLimits { what, angle_rad, min_rad, max_rad })
        })
    }

    fn solution(&self, outcome: &NewtonResult) -> Solution {
        Solution {
            joints: outcome.joints,
            residual_mm: outcome.residual_mm,
            residual_rad: outcome.residual_rad,
            iterations: outcome.iterations,
            singularity: self.singularity(&outcome.joints),
        }
    }
}

/// See [`Inverse::model_distance_mm`]. Effects rotate joints, except for the growth and the motions of links. A longer link moves everything
/// behind it by the same length; a rotated one by at most the angle times the length of the arm, and once more through the rotation
/// of the last frame under a target.
fn model_distance_mm(estimated: &Model, condition: &Condition, nominal: &Model, extent_mm: f64) -> f64 {
    let links = estimated.links_at(condition);
    let of = |(a, b): (&Link, &Link)| {
        let turned = (a.alpha_rad - b.alpha_rad).abs() + (a.beta_rad - b.beta_rad).abs();
        (a.a_mm - b.a_mm).abs() + (a.d_mm - b.d_mm).abs() + 2.0 * extent_mm * turned
    };
    let bodies = estimated.bodies.iter().flatten().map(|body| body.mass_kg).sum::<f64>();
    let mass_kg = bodies + condition.payload_kg.unwrap_or(0.0);
    let moved: f64 = estimated.effects.iter().map(|e| e.largest_link_motion_mm(extent_mm, mass_kg)).sum();
    links.iter().zip(&nominal.links).map(of).sum::<f64>() + moved
}

/// Whether two sets of margins belong to one branch; margins below the tolerance belong to both sides.
#[inline(always)]
fn same_branch(a: &[f64; 3], b: &[f64; 3]) -> bool {
    (0..3).all(|k| {
        (a[k] < 0.0) == (b[k] < 0.0) || a[k].abs() < BRANCH_TOLERANCE || b[k].abs() < BRANCH_TOLERANCE
    })
}
