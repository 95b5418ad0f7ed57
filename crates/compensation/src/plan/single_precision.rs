//! Rounding error of targets that a controller stores in single precision, as RAPID's `num` does.

use nalgebra::UnitQuaternion;
use rayon::prelude::*;

use truegrind_programs::motion::Frame;
use truegrind_programs::rewrite::{Change, NewTarget};

/// Largest change of a target when its numbers are rounded to single precision.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct SinglePrecision {
    /// Of the position (mm).
    pub position_mm: f64,
    /// Of the orientation (°).
    pub orientation_deg: f64,
    /// Of a joint (°).
    pub joint_deg: f64,
}

/// Changes per parallel work item.
const CHUNK: usize = 4096;

/// The maximum over all new targets; `None` without any.
pub fn single_precision(changes: &[Change]) -> Option<SinglePrecision> {
    let most = changes.par_chunks(CHUNK).map(|changes| {
        let targets = changes
            .iter()
            .flat_map(|change| change.targets.iter().chain(change.before.iter().map(|extra| &extra.target)));
        let mut turn = LargestTurn::default();
        targets.filter_map(|target| of(target, &mut turn)).reduce(SinglePrecision::max)
    });
    most.flatten().reduce_with(SinglePrecision::max)
}

/// The largest rotation so far.
#[derive(Default)]
struct LargestTurn {
    /// tan² of half of it, a little less than that: rounding never hides a larger one.
    tan_square: f64,
}

impl LargestTurn {
    /// The angle between two rotations (°); zero, without its arctangent, where another was certainly larger.
    fn angle_deg(&mut self, a: &UnitQuaternion<f64>, b: &UnitQuaternion<f64>) -> f64 {
        let turn = a.rotation_to(b);
        let (sine_square, cosine) = (turn.imag().norm_squared(), turn.scalar());
        if sine_square < self.tan_square * (cosine * cosine) {
            return 0.0;
        }
        self.tan_square = (1.0 - 1e-9) * sine_square / (cosine * cosine);
        turn.angle().to_degrees()
    }
}

/// Rounding error of one target; its rotation counts as zero where an earlier one is larger.
fn of(target: &NewTarget, turn: &mut LargestTurn) -> Option<SinglePrecision> {
    let short = |value: f64| f64::from(value as f32);
    match *target {
        NewTarget::Keep | NewTarget::Drop => None,
        NewTarget::Cartesian { position_mm, quaternion, .. } => {
            let off = position_mm.map(|value| short(value) - value);
            let written = Frame { position_mm, quaternion };
            let held = Frame { position_mm, quaternion: quaternion.map(short) };
            Some(SinglePrecision {
                position_mm: off.iter().map(|off| off * off).sum::<f64>().sqrt(),
                orientation_deg: turn.angle_deg(&written.pose().rotation, &held.pose().rotation),
                joint_deg: 0.0,
            })
        }
        NewTarget::Joint { robot_deg } => Some(SinglePrecision {
            joint_deg: robot_deg.iter().map(|angle| (short(*angle) - angle).abs()).fold(0.0, f64::max),
            ..SinglePrecision::default()
        }),
    }
}

impl SinglePrecision {
    /// Component-wise maximum.
    fn max(self, other: Self) -> Self {
        Self {
            position_mm: self.position_mm.max(other.position_mm),
            orientation_deg: self.orientation_deg.max(other.orientation_deg),
            joint_deg: self.joint_deg.max(other.joint_deg),
        }
    }

    /// One sentence for a report.
    pub fn text(&self) -> String {
        // Upper bounds are rounded up.
        let up = |value: f64, decimals: i32| (value * 10f64.powi(decimals)).ceil() / 10f64.powi(decimals);
        let mut parts = Vec::new();
        if self.position_mm > 0.0 || self.orientation_deg > 0.0 {
            parts.push(format!("{:.5} mm and {:.5}°", up(self.position_mm, 5), up(self.orientation_deg, 5)));
        }
        if self.joint_deg > 0.0 {
            parts.push(format!("{:.6}° per joint", up(self.joint_deg, 6)));
        }
        if parts.is_empty() {
            parts.push("nothing".to_owned());
        }
        format!(
            "read in single precision, as RAPID stores numbers, targets are off by at most {} beyond what is stated here",
            parts.join(", ")
        )
    }
}
