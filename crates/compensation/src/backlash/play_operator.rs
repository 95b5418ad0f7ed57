//! Where the links are on a way on which joints with play turn.
//!
//! Method. The play operator: a link stays where it is until one of its flanks takes it along,
//! θ ← clamp(θ, q − b/2, q + b/2). A joint that turns so leaves its link behind for as long as it takes up the play; the
//! path in between is worked out in steps, from the flanks on which the links lie at the start of the way.
//! Shapes: joints q of the motors and θ of the links (rad), play b of each (rad).
//! Stops: steps are halved until the largest distance changes by less than a quarter of [`CHORD_MM`], [`DOUBLINGS`] times
//! at most; one in which a link leaves its flank or is taken along again is halved by itself, since the path has a corner there.
//! Source: M. A. Krasnosel'skii, A. V. Pokrovskii, Systems with Hysteresis, 1989, the play.
//! Checked against: an independent simulation of a controller in small steps (tests/it/compensation/play.rs).

use crate::backlash::sides::JointSides;
use crate::condition::arm_conditions::ArmConditions;
use crate::segment::condition_schedule::CHORD_MM;
use truegrind_arm::model::{Joints, PreparedModel};
use truegrind_math::se3::Pose;

/// A link that is nearer to its flank lies on it (rad): 0.005 mm on the largest arms.
const ON_FLANK_RAD: f64 = 2e-6;

/// How often a step is halved in which a link leaves its flank or is taken along again.
const CLOSER: u32 = 8;

/// How often steps are halved.
const DOUBLINGS: usize = 6;

/// Links that follow their motors with play.
#[derive(Clone, Copy)]
pub(crate) struct PlayOperator<'a> {
    /// The arm in the middle of its play, with its load on this way.
    arm: &'a PreparedModel<'a>,
    play_rad: [f64; 6],
    motor: Joints,
    /// θ − q as the play operator has it; where a play was estimated below 0 the arm shows its opposite.
    behind: Joints,
}

impl<'a> PlayOperator<'a> {
    /// At rest at joints `motor`, to which the arm came under the condition `arrival`. `onward`: a condition with the load that
    /// it carries from here on. A joint of which no side is known stands in the middle of its play.
    pub(crate) fn at(
        motor: &Joints,
        arrival: usize,
        onward: usize,
        conditions: &'a ArmConditions<'_>,
    ) -> Self {
        let sides = conditions.arm(arrival).condition.approach;
        let play_rad = conditions.play_rad;
        let behind = Joints::from_fn(|j, _| 0.5 * play_rad[j].abs() * f64::from(sides[j]));
        Self { arm: conditions.arm(conditions.middle(onward)), play_rad, motor: *motor, behind }
    }

    /// The motors go on to other joints.
    fn take(&mut self, motor: &Joints) {
        let moved = motor - self.motor;
        self.motor = *motor;
        self.behind = Joints::from_fn(|j, _| {
            let half = 0.5 * self.play_rad[j].abs();
            (self.behind[j] - moved[j]).clamp(-half, half)
        });
    }

    /// The motors go on to other joints; hands back where the flange comes.
    fn go(&mut self, motor: &Joints) -> Pose {
        self.take(motor);
        let link = Joints::from_fn(|j, _| motor[j] + self.behind[j] * self.play_rad[j].signum());
        self.arm.forward(&link)
    }

    /// On which flank each link lies, 0 for none.
    fn contact(&self) -> JointSides {
        std::array::from_fn(|j| {
            let half = 0.5 * self.play_rad[j].abs();
            i8::from(half > 0.0 && self.behind[j] >= half) - i8::from(half > 0.0 && self.behind[j] <= -half)
        })
    }

    /// Goes a step of a way; hands back how far off the tool is at most, at its end and where, to so many halvings, a link leaves
    /// its flank or is taken along again: there the path has a corner.
    fn span(
        &mut self,
        [from, to]: [f64; 2],
        halvings: u32,
        motor: &dyn Fn(f64) -> Option<Joints>,
        off: &dyn Fn(f64, &Pose) -> f64,
    ) -> f64 {
        let Some(joints) = motor(to) else { return f64::INFINITY };
        let mut there = *self;
        let flange = there.go(&joints);
        if halvings == 0 || from >= to || there.contact() == self.contact() {
            *self = there;
            return off(to, &flange);
        }
        let middle = 0.5 * (from + to);
        let first = self.span([from, middle], halvings - 1, motor, off);
        first.max(self.span([middle, to], halvings - 1, motor, off))
    }

    /// Whether each link comes to lie, at the end of a way in so many `steps`, on the side that is told of it there (0 where none
    /// is), wherever in its play one lies at the start of which none was known. The play keeps order, so both flanks tell that.
    pub(crate) fn ends_on_sides(
        &self,
        sides: &JointSides,
        steps: usize,
        motor: &dyn Fn(f64) -> Option<Joints>,
    ) -> bool {
        let half = self.play_rad.map(|play| 0.5 * play.abs());
        [-1.0, 1.0].into_iter().all(|flank| {
            let mut links = *self;
            (0..6).filter(|&j| self.behind[j] == 0.0).for_each(|j| links.behind[j] = flank * half[j]);
            let there = (0..=steps).all(|k| match motor(k as f64 / steps as f64) {
                Some(joints) => {
                    links.take(&joints);
                    true
                }
                None => false,
            });
            let lies = |j: usize| (links.behind[j] - half[j] * f64::from(sides[j])).abs() < ON_FLANK_RAD;
            there && (0..6).all(|j| sides[j] == 0 || lies(j))
        })
    }

    /// Largest distance on a way from here: `motor(s)` where the motors are at its share s, `off(s, flange)` how far off
    /// the tool is with the flange there. Infinite where the motors cannot go. Begins with so many `steps`.
    pub(crate) fn largest_deviation(
        &self,
        steps: usize,
        motor: &dyn Fn(f64) -> Option<Joints>,
        off: &dyn Fn(f64, &Pose) -> f64,
    ) -> f64 {
        let along = |steps: usize| {
            let mut links = *self;
            let mut most = 0.0_f64;
            for k in 0..=steps {
                let span = [k.saturating_sub(1), k].map(|k| k as f64 / steps as f64);
                let off_here = links.span(span, CLOSER, motor, off);
                most = most.max(off_here);
                if !most.is_finite() {
                    break;
                }
            }
            most
        };
        let mut steps = steps.max(1);
        let mut most = along(steps);
        for _ in 0..DOUBLINGS {
            steps *= 2;
            let finer = along(steps);
            let settled = (finer - most).abs() < 0.25 * CHORD_MM;
            most = finer;
            if settled || !most.is_finite() {
                break;
            }
        }
        most
    }
}
