//! Ranges and speeds of joints, and of sums of joints.

use std::fmt;

use serde::{Deserialize, Serialize};

use crate::bounds::{COUPLING, InvalidValue, JOINT_DEG};
use crate::joints::Joints;

/// Range and speed of the joints, in the controller's angles.
#[derive(Debug, Clone, PartialEq)]
pub struct Limits {
    /// Lowest angle (rad).
    pub min_rad: [f64; 6],
    /// Highest angle (rad).
    pub max_rad: [f64; 6],
    /// Highest speed [rad/s], where published.
    pub speed_rad_s: Option<[f64; 6]>,
    /// Ranges of sums of joints, where one link gets into the way of another: of J2 + J3 of a FANUC, for instance.
    pub sums: Vec<SumLimit>,
}

impl Limits {
    /// The first joint or sum of joints outside its range, if any.
    ///
    /// ```
    /// use truegrind_arm::model::{Joints, Limited};
    /// use truegrind_arm::robots;
    ///
    /// // Axis 5 of an IRB 120 turns by 120° either way.
    /// let limits = robots::load("abb-irb-120")?.model.limits;
    /// assert_eq!(limits.violated(&Joints::zeros()), None);
    /// assert_eq!(limits.violated(&Joints::new(0.0, 0.0, 0.0, 0.0, 2.2, 0.0)), Some(Limited::Joint(4)));
    /// // The forearm of an LR Mate goes down to 70° below the upper arm's normal, J2 + J3 = -70°.
    /// let limits = robots::load("fanuc-lr-mate-200id")?.model.limits;
    /// let low = Joints::new(0.0, 0.0, -1.3, 0.0, 0.0, 0.0);
    /// assert_eq!(limits.violated(&low).map(|what| what.to_string()), Some("the sum of joints 2 and 3".into()));
    /// # Ok::<(), robots::RobotError>(())
    /// ```
    pub fn violated(&self, q: &Joints) -> Option<Limited> {
        self.violated_beyond(q, 0.0)
    }

    /// The same with ranges wider by a slack (rad) at either end.
    pub fn violated_beyond(&self, q: &Joints, slack_rad: f64) -> Option<Limited> {
        let inside = |joint: usize| {
            q[joint] >= self.min_rad[joint] - slack_rad && q[joint] <= self.max_rad[joint] + slack_rad
        };
        let alone = (0..6).find(|&joint| !inside(joint));
        let sum = || self.sums.iter().find(|sum| !sum.holds(q, slack_rad));
        alone.map(Limited::joint).or_else(|| sum().map(SumLimit::name))
    }

    /// Angle at joints `q`, lowest and highest angle of a joint or a sum of joints (rad).
    pub fn angle_and_range(&self, what: Limited, q: &Joints) -> [f64; 3] {
        let joint = what.last();
        match self.sums.iter().find(|sum| sum.name() == what) {
            Some(sum) => [sum.of(q), sum.min_rad, sum.max_rad],
            None => [q[joint], self.min_rad[joint], self.max_rad[joint]],
        }
    }
}

/// The range of a sum of joints.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(from = "SumSheet", into = "SumSheet")]
pub struct SumLimit {
    /// Factor of each joint.
    pub factors: [f64; 6],
    /// Lowest sum (rad).
    pub min_rad: f64,
    /// Highest sum (rad).
    pub max_rad: f64,
}

impl SumLimit {
    /// The sum (rad).
    pub fn of(&self, q: &Joints) -> f64 {
        (0..6).map(|joint| self.factors[joint] * q[joint]).sum()
    }

    /// Whether the sum lies in its range, which a slack (rad) widens at either end.
    pub fn holds(&self, q: &Joints, slack_rad: f64) -> bool {
        let sum_rad = self.of(q);
        sum_rad >= self.min_rad - slack_rad && sum_rad <= self.max_rad + slack_rad
    }

    /// Range of a sum with these factors (rad), if it is this one or its negative.
    pub(crate) fn range_of(&self, factors: &Joints) -> Option<[f64; 2]> {
        let own = Joints::from(self.factors);
        if *factors == own {
            return Some([self.min_rad, self.max_rad]);
        }
        (*factors == -own).then_some([-self.max_rad, -self.min_rad])
    }

    /// Refuses numbers out of bounds, an empty range, and fewer than two joints.
    pub(crate) fn check(&self, key: &str) -> Result<(), InvalidValue> {
        let [min, max] = [self.min_rad, self.max_rad].map(f64::to_degrees);
        let range = format!("{key} min_deg and max_deg");
        COUPLING.check_all(format_args!("{key} of"), &self.factors)?;
        JOINT_DEG.check_all(&range, &[min, max])?;
        if min >= max {
            return Err(InvalidValue::new(range, format!("{min} and {max}"), "min below max"));
        }
        match self.factors.iter().filter(|factor| **factor != 0.0).count() {
            count @ 0..2 => {
                Err(InvalidValue::new(format!("{key} of"), format!("{count} joints"), "at least two joints"))
            }
            _ => Ok(()),
        }
    }

    /// By what messages name it.
    pub fn name(&self) -> Limited {
        let counts = |factor: &f64| *factor != 0.0;
        let first = self.factors.iter().position(counts).unwrap_or(0);
        let last = self.factors.iter().rposition(counts).unwrap_or(0);
        Limited::Sum { first: first as u8, last: last as u8 }
    }
}

/// A sum of joints in a file.
#[derive(Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct SumSheet {
    of: [f64; 6],
    min_deg: f64,
    max_deg: f64,
}

impl From<SumSheet> for SumLimit {
    fn from(sheet: SumSheet) -> Self {
        let SumSheet { of, min_deg, max_deg } = sheet;
        Self { factors: of, min_rad: min_deg.to_radians(), max_rad: max_deg.to_radians() }
    }
}

impl From<SumLimit> for SumSheet {
    fn from(sum: SumLimit) -> Self {
        Self { of: sum.factors, min_deg: sum.min_rad.to_degrees(), max_deg: sum.max_rad.to_degrees() }
    }
}

/// What has a range: a joint, or a sum of joints. Joints are 0-based.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Limited {
    /// One joint.
    Joint(u8),
    /// A sum from its first to its last joint.
    Sum {
        /// The first.
        first: u8,
        /// The last.
        last: u8,
    },
}

impl Limited {
    /// One joint.
    pub fn joint(joint: usize) -> Self {
        Self::Joint(joint as u8)
    }

    /// The joint, of a sum the last one.
    pub fn last(self) -> usize {
        match self {
            Self::Joint(joint) | Self::Sum { last: joint, .. } => usize::from(joint),
        }
    }
}

impl fmt::Display for Limited {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Joint(joint) => write!(f, "joint {}", joint + 1),
            Self::Sum { first, last } => write!(f, "the sum of joints {} and {}", first + 1, last + 1),
        }
    }
}
