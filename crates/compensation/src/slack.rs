//! Where the links are on a way on which joints with play turn.
//!
//! Method. The play operator: a link stays where it is until one of its flanks takes it along,
//! θ ← clamp(θ, q − b/2, q + b/2). A joint that turns so leaves its link behind for as long as it takes up the play; the
//! path in between is worked out in steps, from the flanks on which the links lie at the start of the way.
//! Shapes: joints q of the motors and θ of the links (rad), play b of each (rad).
//! Stops: steps are halved until the largest distance changes by less than a quarter of [`CHORD_MM`], [`DOUBLINGS`] times
//! at most.
//! Source: M. A. Krasnosel'skii, A. V. Pokrovskii, Systems with Hysteresis, 1989, the play.
//! Checked against: an independent simulation of a controller in small steps (tests/it/compensation/play.rs).

use super::circumstance::Circumstances;
use super::segment::CHORD_MM;
use truegrind_arm::model::{Joints, PreparedModel};
use truegrind_math::se3::Pose;

/// How often steps are halved.
const DOUBLINGS: usize = 6;

/// Links that follow their motors with play.
#[derive(Clone, Copy)]
pub(super) struct Slack<'a> {
    /// The arm in the middle of its play, with its load on this way.
    arm: &'a PreparedModel<'a>,
    play_rad: [f64; 6],
    motor: Joints,
    /// θ − q as the play operator has it; where a play was estimated below 0 the arm shows its opposite.
    behind: Joints,
}

impl<'a> Slack<'a> {
    /// At rest at joints `motor`, to which the arm came under the condition `came`. `now`: a condition with the load that
    /// it carries from here on. A joint of which no side is known stands in the middle of its play.
    pub(super) fn at(motor: &Joints, came: usize, now: usize, acting: &'a Circumstances<'_>) -> Self {
        let sides = acting.arm(came).condition.approach;
        let play_rad = acting.play_rad;
        let behind = Joints::from_fn(|j, _| 0.5 * play_rad[j].abs() * f64::from(sides[j]));
        Self { arm: acting.arm(acting.middle(now)), play_rad, motor: *motor, behind }
    }

    /// The motors go on to other joints; hands back where the flange comes.
    fn go(&mut self, motor: &Joints) -> Pose {
        let moved = motor - self.motor;
        self.motor = *motor;
        self.behind = Joints::from_fn(|j, _| {
            let half = 0.5 * self.play_rad[j].abs();
            (self.behind[j] - moved[j]).clamp(-half, half)
        });
        let link = Joints::from_fn(|j, _| motor[j] + self.behind[j] * self.play_rad[j].signum());
        self.arm.forward(&link)
    }

    /// Largest distance on a way from here: `motor(s)` where the motors are at its share s, `off(s, flange)` how far off
    /// the tool is with the flange there. Infinite where the motors cannot go. Begins with so many `steps`.
    pub(super) fn most_off(
        &self,
        steps: usize,
        motor: &dyn Fn(f64) -> Option<Joints>,
        off: &dyn Fn(f64, &Pose) -> f64,
    ) -> f64 {
        let along = |steps: usize| {
            let mut links = *self;
            let mut most = 0.0_f64;
            for k in 0..=steps {
                let s = k as f64 / steps as f64;
                let Some(joints) = motor(s) else { return f64::INFINITY };
                most = most.max(off(s, &links.go(&joints)));
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
