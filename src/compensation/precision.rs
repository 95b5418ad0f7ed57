//! What a controller makes of numbers that it holds in single precision, as RAPID's `num` is.

use crate::program::motion::Frame;
use crate::program::rewrite::{Change, NewTarget};

/// The most by which a target moves when its numbers are rounded to single precision.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct SinglePrecision {
    /// Of the position (mm).
    pub position_mm: f64,
    /// Of the orientation (°).
    pub orientation_deg: f64,
    /// Of a joint (°).
    pub joint_deg: f64,
}

/// The largest of all new targets; `None` without any.
pub fn single_precision(changes: &[Change]) -> Option<SinglePrecision> {
    let short = |value: f64| f64::from(value as f32);
    let targets = changes
        .iter()
        .flat_map(|change| change.targets.iter().chain(change.before.iter().map(|extra| &extra.target)));
    let mut most: Option<SinglePrecision> = None;
    for target in targets {
        let found = match *target {
            NewTarget::Keep | NewTarget::Drop => continue,
            NewTarget::Cartesian { position_mm, quaternion, .. } => {
                let off = position_mm.map(|value| short(value) - value);
                let written = Frame { position_mm, quaternion };
                let held = Frame { position_mm, quaternion: quaternion.map(short) };
                SinglePrecision {
                    position_mm: off.iter().map(|off| off * off).sum::<f64>().sqrt(),
                    orientation_deg: written.pose().rotation.angle_to(&held.pose().rotation).to_degrees(),
                    joint_deg: 0.0,
                }
            }
            NewTarget::Joint { robot_deg } => SinglePrecision {
                joint_deg: robot_deg.iter().map(|angle| (short(*angle) - angle).abs()).fold(0.0, f64::max),
                ..SinglePrecision::default()
            },
        };
        let so_far = most.unwrap_or_default();
        most = Some(SinglePrecision {
            position_mm: so_far.position_mm.max(found.position_mm),
            orientation_deg: so_far.orientation_deg.max(found.orientation_deg),
            joint_deg: so_far.joint_deg.max(found.joint_deg),
        });
    }
    most
}

impl SinglePrecision {
    /// One sentence for a report.
    pub fn text(&self) -> String {
        // A bound is rounded up.
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
            "read in single precision, as RAPID holds numbers, targets are off by at most {} beyond what is stated here",
            parts.join(", ")
        )
    }
}
