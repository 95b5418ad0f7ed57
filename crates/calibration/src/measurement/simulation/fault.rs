//! Simulated faults of the measurement, named as in a diagnosis. Rows count from 0, ranges include both ends.

use nalgebra::{Point3, Translation3, UnitQuaternion, Vector3};
use serde::{Deserialize, Serialize};

use crate::measurement::dataset::Reading;
use crate::measurement::sensor::Rig;
use truegrind_arm::condition::Condition;
use truegrind_math::se3::Pose;

/// One fault.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(tag = "fault", rename_all = "kebab-case", deny_unknown_fields)]
#[non_exhaustive]
pub enum Fault {
    /// The cable's zero is shifted in some rows.
    SensorZeroShift {
        /// First and last row.
        rows: [usize; 2],
        /// Added to the reading (mm).
        offset_mm: f64,
    },
    /// The sensor, or a cable's outlet, is displaced in some rows.
    SensorFrameShift {
        /// First and last row.
        rows: [usize; 2],
        /// Shift in the base (mm).
        shift_mm: [f64; 3],
        /// Rotation vector in the base, about the sensor [°]; not for a cable.
        #[serde(default)]
        turn_deg: [f64; 3],
    },
    /// The target is displaced on the flange in some rows.
    ToolShift {
        /// First and last row.
        rows: [usize; 2],
        /// Shift on the flange (mm).
        shift_mm: [f64; 3],
    },
    /// Scale error of the sensor.
    SensorScale {
        /// Relative error of the readings.
        error: f64,
    },
    /// The cable sags: longer by (w/T)² h² d / 24, h the horizontal span, d the distance (parabola under its own weight,
    /// second order).
    CableSag {
        /// Weight per length over tension w/T [1/m].
        weight_over_tension_per_m: f64,
    },
    /// Single wrong readings.
    Outliers {
        /// Rows.
        row_list: Vec<usize>,
        /// Added to the reading, or to each coordinate in turn (mm).
        size_mm: f64,
    },
    /// The controller's read-out is of another pose in some rows.
    ReadoutMismatch {
        /// Rows.
        row_list: Vec<usize>,
        /// Added to x, y, z (mm).
        shift_mm: [f64; 3],
    },
    /// The payload differs from the logged one in some rows.
    PayloadChange {
        /// First and last row.
        rows: [usize; 2],
        /// The payload (kg).
        payload_kg: f64,
    },
}

fn within(rows: &[usize; 2], row: usize) -> bool {
    (rows[0]..=rows[1]).contains(&row)
}

impl Fault {
    /// Applies the fault to the true sensor and conditions of a row.
    pub(super) fn before(&self, row: usize, rig: &mut Rig, condition: &mut Condition) {
        match self {
            Fault::SensorZeroShift { rows, offset_mm } if within(rows, row) => {
                if let Rig::Cable { zeros_mm, .. } = rig {
                    zeros_mm.iter_mut().for_each(|zero| *zero += offset_mm);
                }
            }
            Fault::SensorFrameShift { rows, shift_mm, turn_deg } if within(rows, row) => {
                let shift = Vector3::from(*shift_mm);
                match rig {
                    Rig::Cable { outlets_mm, .. } => outlets_mm.iter_mut().for_each(|o| *o += shift),
                    Rig::Position { base_from_sensor, .. } | Rig::Pose { base_from_sensor, .. } => {
                        let turn =
                            UnitQuaternion::from_scaled_axis(Vector3::from(*turn_deg).map(f64::to_radians));
                        let at = base_from_sensor.translation.vector + shift;
                        *base_from_sensor =
                            Pose::from_parts(Translation3::from(at), turn * base_from_sensor.rotation);
                    }
                }
            }
            Fault::ToolShift { rows, shift_mm } if within(rows, row) => {
                let shift = Vector3::from(*shift_mm);
                match rig {
                    Rig::Cable { hook_mm, .. } => *hook_mm += shift,
                    Rig::Position { reflector_mm, .. } => *reflector_mm += shift,
                    Rig::Pose { flange_from_target, .. } => flange_from_target.translation.vector += shift,
                }
            }
            Fault::PayloadChange { rows, payload_kg } if within(rows, row) => {
                condition.payload_kg = Some(*payload_kg);
            }
            _ => {}
        }
    }

    /// Applies the fault to the reading and the read-out of a row.
    pub(super) fn after(
        &self,
        row: usize,
        rig: &Rig,
        base_from_flange: &Pose,
        anchor: usize,
        reading: &mut Reading,
        readout_mm: &mut Vector3<f64>,
    ) {
        match self {
            Fault::SensorScale { error } => match reading {
                Reading::Cable(length) => *length *= 1.0 + error,
                Reading::Position(p) => *p *= 1.0 + error,
                Reading::Pose(pose) => pose.translation.vector *= 1.0 + error,
            },
            Fault::CableSag { weight_over_tension_per_m } => {
                if let (Reading::Cable(length), Some(outlet)) = (reading, rig.origin_mm(anchor)) {
                    let away =
                        ((base_from_flange * Point3::from(rig.target_on_flange_mm())).coords - outlet) * 1e-3;
                    let level = away.x.hypot(away.y);
                    *length += 1e3 * (weight_over_tension_per_m * level).powi(2) * away.norm() / 24.0;
                }
            }
            Fault::Outliers { row_list, size_mm } => {
                if let Some(nth) = row_list.iter().position(|r| *r == row) {
                    match reading {
                        Reading::Cable(length) => *length += size_mm,
                        Reading::Position(p) => p[nth % 3] += size_mm,
                        Reading::Pose(pose) => pose.translation.vector[nth % 3] += size_mm,
                    }
                }
            }
            Fault::ReadoutMismatch { row_list, shift_mm } if row_list.contains(&row) => {
                *readout_mm += Vector3::from(*shift_mm);
            }
            _ => {}
        }
    }
}
