//! Position of links with backlash along a segment on which joints reverse.
//!
//! Method. The play operator: a link rests until a flank engages, θ ← clamp(θ, q − b/2, q + b/2). A joint that reverses
//! leaves its link behind until the backlash is taken up; the path in between is computed in steps from the flanks on which
//! the links lie at the start.
//! Shapes: motor joints q and link joints θ (rad), backlash b of each joint (rad).
//! Stops: steps are halved until the largest deviation changes by less than a quarter of [`CHORD_MM`], at most [`DOUBLINGS`]
//! times; a step in which a link leaves its flank or engages again is halved separately, since the path has a corner there.
//! Source: M. A. Krasnosel'skii, A. V. Pokrovskii, Systems with Hysteresis, 1989, the play.
//! Checked against: an independent simulation of a controller in small steps (crates/compensation/tests/it/backlash.rs).

use crate::backlash::sides::JointSides;
use crate::condition::arm_conditions::ArmConditions;
use crate::segment::condition_schedule::CHORD_MM;
use nalgebra::Matrix6;
use truegrind_arm::model::{Joints, PreparedModel};
use truegrind_math::se3::Pose;

/// A link closer to its flank than this lies on it (rad): 0.005 mm on the largest arms.
const ON_FLANK_RAD: f64 = 2e-6;

/// How often a step is halved in which a link leaves its flank or engages again.
const CLOSER: u32 = 8;

/// How often all steps are halved.
const DOUBLINGS: usize = 6;

/// Links that follow their motors with backlash.
#[derive(Clone, Copy)]
pub(crate) struct PlayOperator<'a> {
    /// The arm at mid-play, with its payload on this segment.
    arm: &'a PreparedModel<'a>,
    play_rad: [f64; 6],
    joints_of_gears: &'a Matrix6<f64>,
    motor: Joints,
    /// θ − q of the play operator; where the estimated backlash is negative the arm shows its opposite.
    behind: Joints,
}

impl<'a> PlayOperator<'a> {
    /// At rest at motor joints `motor`, where the arm arrived under condition `arrival`. `onward`: a condition with the
    /// payload from here on. A joint of unknown side is at mid-play.
    pub(crate) fn at(
        motor: &Joints,
        arrival: usize,
        onward: usize,
        conditions: &'a ArmConditions<'_>,
    ) -> Self {
        let sides = conditions.arm(arrival).condition.approach;
        let play_rad = conditions.play_rad;
        let behind = Joints::from_fn(|j, _| 0.5 * play_rad[j].abs() * f64::from(sides[j]));
        let arm = conditions.arm(conditions.middle(onward));
        Self { arm, play_rad, joints_of_gears: &conditions.joints_of_gears, motor: *motor, behind }
    }

    /// Moves the motors.
    fn take(&mut self, motor: &Joints) {
        let moved = motor - self.motor;
        self.motor = *motor;
        self.behind = Joints::from_fn(|j, _| {
            let half = 0.5 * self.play_rad[j].abs();
            (self.behind[j] - moved[j]).clamp(-half, half)
        });
    }

    /// Moves the motors and returns the flange pose.
    fn go(&mut self, motor: &Joints) -> Pose {
        self.take(motor);
        // What of the play no load closes.
        let plays = self.arm.open_plays_rad(motor);
        let open = |j: usize| if self.play_rad[j] == 0.0 { 0.0 } else { plays[j] / self.play_rad[j].abs() };
        let behind = Joints::from_fn(|j, _| self.behind[j] * open(j));
        let link = motor + self.joints_of_gears * behind;
        self.arm.forward(&link)
    }

    /// Engaged flank of each link, 0 for none.
    fn contact(&self) -> JointSides {
        std::array::from_fn(|j| {
            let half = 0.5 * self.play_rad[j].abs();
            i8::from(half > 0.0 && self.behind[j] >= half) - i8::from(half > 0.0 && self.behind[j] <= -half)
        })
    }

    /// Moves along one step; returns the largest deviation of the tool, at its end and, to so many halvings, where a link
    /// leaves its flank or engages again: the path has a corner there.
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

    /// Whether each link ends a segment of so many `steps` on its planned side (0: none planned), wherever within its
    /// backlash a link of unknown side starts. The play operator is monotone, so testing both flanks suffices.
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

    /// Largest deviation along a segment from here: `motor(s)` are the motor joints at share s, `off(s, flange)` the
    /// deviation of the tool with that flange. Infinite where the motors cannot follow. Starts with so many `steps`.
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
            let unchanged_for = (finer - most).abs() < 0.25 * CHORD_MM;
            most = finer;
            if unchanged_for || !most.is_finite() {
                break;
            }
        }
        most
    }
}
