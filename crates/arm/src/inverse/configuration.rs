//! Arm configuration in the convention of RAPID's `confdata`, and matching of solutions to a requested one.
//!
//! cf1, cf4, cf6 count quarter turns: floor(angle / 90°) of axes 1, 4 and 6. cfx identifies the eight branches
//! (six-axis arms under RobotWare):
//!
//! | cfx | wrist centre to axis 1 | wrist centre to lower arm | axis 5 |
//! |---|---|---|---|
//! | 0, 1 | in front | in front | positive, negative |
//! | 2, 3 | in front | behind | positive, negative |
//! | 4, 5 | behind | in front | positive, negative |
//! | 6, 7 | behind | behind | positive, negative |
//!
//! In front and behind are seen from the arm as axis 1 has turned it: the wrist centre lies on the x side of the plane
//! through axes 1 and 2, and on the side of the line through axes 2 and 3 to which a growing angle of axis 2 leans. The
//! branches meet at the three singularities. Arms such as IRB 1400, 2400, 4400 and 6400 use cf1, cf4 and cf6 alone and ignore
//! cfx: a reader must not insist on it.
//!
//! Source: ABB, Technical reference manual RAPID Instructions, Functions and Data types (3HAC16581-1), confdata. The
//! table stands in the same order in the documentation of py-opw-kinematics (AXIS_CONFIGURATION.md) and in the toolbox
//! ARTE (compute_configuration.m), which also takes the signs of x in frame 1 and of the side of the lower arm in frame 2.
//! Departure: the manual leaves open to which quarter exactly −90° belongs; here, by the floor, to −1. Targets are
//! matched with a tolerance, so that nothing depends on it.

use std::f64::consts::FRAC_PI_2;
use std::fmt;

use serde::{Deserialize, Serialize};

use super::structure::{Branch, Structure};
use crate::condition::Condition;
use crate::joints::Joints;
use crate::model::Model;

/// RAPID's `confdata`.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Default, Serialize, Deserialize)]
pub struct Configuration {
    /// Quarter turn of axis 1.
    pub cf1: i32,
    /// Quarter turn of axis 4.
    pub cf4: i32,
    /// Quarter turn of axis 6.
    pub cf6: i32,
    /// Branch, 0 to 7.
    pub cfx: i32,
}

impl fmt::Display for Configuration {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "[{},{},{},{}]", self.cf1, self.cf4, self.cf6, self.cfx)
    }
}

/// Axes (0-based) whose quarter turns a configuration states.
pub(super) const QUARTER_AXES: [usize; 3] = [0, 3, 5];

/// Tolerance of a requested quarter (rad): the estimated arm differs from the nominal one by some tenths of a degree, by more
/// near the wrist singularity, while other branches differ by a quarter turn and more.
const QUARTER_TOLERANCE_RAD: f64 = 0.09;

/// Below this margin both sides count as the branch (see [`Structure::margins`]).
pub(super) const BRANCH_TOLERANCE: f64 = 0.02;

/// Configuration of an arm at controller angles (rad); cfx is 0 for an arm without a closed form. For the nominal arm,
/// or for an estimated one without its effects; [`Inverse::configuration`](super::Inverse::configuration) counts them in.
///
/// ```
/// use truegrind_arm::inverse::configuration::configuration;
/// use truegrind_arm::model::Joints;
/// use truegrind_arm::robots;
///
/// // Quarter turns of axes 1, 4 and 6 count down from −1 below zero; axis 5 below zero is the odd branch.
/// let arm = robots::load("abb-irb-120")?.model;
/// let degrees = [-20.0, 10.0, 15.0, 100.0, -40.0, 190.0_f64];
/// let found = configuration(&arm, &Joints::from(degrees.map(f64::to_radians)));
/// assert_eq!(found.to_string(), "[-1,1,2,1]");
/// # Ok::<(), robots::RobotError>(())
/// ```
pub fn configuration(model: &Model, joints: &Joints) -> Configuration {
    let frames = model.at_condition(&Condition::default()).frames(joints);
    let structure = Structure::of(model);
    of(structure.has_branches().then(|| Branch::of(&structure.margins_of(&frames))), joints)
}

pub(super) fn of(branch: Option<Branch>, joints: &Joints) -> Configuration {
    let quarter = |axis: usize| (joints[axis] / FRAC_PI_2).floor() as i32;
    Configuration { cf1: quarter(0), cf4: quarter(3), cf6: quarter(5), cfx: branch.map_or(0, |b| b.index()) }
}

impl Configuration {
    /// The quarter turns of axes 1, 4 and 6.
    pub(super) fn quarters(&self) -> [i32; 3] {
        [self.cf1, self.cf4, self.cf6]
    }

    /// The largest angle by which axes 1, 4 and 6 lie outside the stated quarters (rad).
    pub fn overshoot_rad(&self, joints: &Joints) -> f64 {
        let mut out: f64 = 0.0;
        for (axis, cf) in QUARTER_AXES.into_iter().zip(self.quarters()) {
            let low = f64::from(cf) * FRAC_PI_2;
            out = out.max(low - joints[axis]).max(joints[axis] - low - FRAC_PI_2);
        }
        out
    }

    /// Whether joints and their margins have this configuration, within the tolerances.
    pub(super) fn matches(&self, joints: &Joints, margins: &[f64; 3]) -> bool {
        self.overshoot_rad(joints) <= QUARTER_TOLERANCE_RAD && self.matches_branch(margins)
    }

    /// Whether margins have exactly the stated branch, as a controller that uses cfx reads it.
    pub(super) fn matches_branch_exactly(&self, margins: &[f64; 3]) -> bool {
        Branch::of(margins).index() == self.cfx
    }

    /// Whether margins belong to the stated branch, within the tolerance.
    fn matches_branch(&self, margins: &[f64; 3]) -> bool {
        (0..3).all(|k| {
            let wanted_negative = (self.cfx >> (2 - k)) & 1 == 1;
            margins[k].abs() < BRANCH_TOLERANCE || (margins[k] < 0.0) == wanted_negative
        })
    }
}

impl Branch {
    /// The branch as RAPID's cfx.
    pub fn index(&self) -> i32 {
        4 * i32::from(self.behind) + 2 * i32::from(self.elbow_back) + i32::from(self.wrist_negative)
    }
}
