//! Quantities at x that are the same for all rows, and the disturbances of each row.

use nalgebra::{Matrix3, Vector3};

use crate::identification::calibration::columns::Columns;
use crate::identification::calibration::problem::CalibrationProblem;
use crate::measurement::sensor::disturbance::{Disturbance, Kind};
use truegrind_arm::chain::{self, LinkTable};
use truegrind_arm::parameter::Parameter;
use truegrind_math::se3::{Pose, left_jacobian};

/// Row-independent quantities at x.
pub(in crate::identification::calibration) struct State {
    pub(super) tables: [LinkTable; 6],
    pub(super) links_mm: [(f64, f64); 6],
    /// Target in the last DH frame.
    pub(super) target: Pose,
    pub(super) base_from_sensor: Pose,
    pub(super) outlets: Vec<Vector3<f64>>,
    pub(super) zeros: Vec<f64>,
    /// Rotation axes of the sensor frame's rotation vector, in the base.
    pub(super) sensor_axes: Matrix3<f64>,
    /// Rotation axes of the target's rotation vector, in the last DH frame.
    pub(super) target_axes: Matrix3<f64>,
    /// Rotation from the flange to the last DH frame.
    pub(super) flange: Matrix3<f64>,
    pub(super) effects: Vec<f64>,
    /// Disturbance of each row; absent for an undisturbed measurement.
    pub(super) disturbed: Option<DisturbanceColumns>,
}

/// Disturbances row by row, as columns.
#[derive(Default)]
pub(super) struct DisturbanceColumns {
    pub(super) zero: Vec<f64>,
    pub(super) frame: [Vec<f64>; 3],
    pub(super) turn: [Vec<f64>; 3],
    pub(super) tool: [Vec<f64>; 3],
    /// 1 + relative error.
    pub(super) scale: Vec<f64>,
    pub(super) sag: Vec<f64>,
}

impl DisturbanceColumns {
    fn of(disturbances: &[Disturbance], columns: &Columns) -> Option<Self> {
        let profiles = &columns.profiles;
        let n = profiles.first().map(Vec::len)?;
        let zeros = || vec![0.0; n];
        let mut out = Self {
            zero: zeros(),
            frame: std::array::from_fn(|_| zeros()),
            turn: std::array::from_fn(|_| zeros()),
            tool: std::array::from_fn(|_| zeros()),
            scale: vec![1.0; n],
            sag: zeros(),
        };
        let add = |to: &mut [f64], value: f64, profile: &[f64]| {
            to.iter_mut().zip(profile).for_each(|(t, c)| *t += value * c);
        };
        let add_motions = |to: &mut [Vec<f64>; 3], motions: &[[Vec<f64>; 3]], v: &[f64], profile: &[f64]| {
            for (motion, value) in motions.iter().zip(v) {
                for (to, along) in to.iter_mut().zip(motion) {
                    to.iter_mut().zip(along).zip(profile).for_each(|((t, s), c)| *t += value * s * c);
                }
            }
        };
        for (index, (disturbance, profile)) in disturbances.iter().zip(profiles).enumerate() {
            let v = &disturbance.values;
            add_motions(&mut out.frame, &columns.shifts[index], v, profile);
            add_motions(&mut out.turn, &columns.turns[index], v, profile);
            match &disturbance.kind {
                Kind::Zero => add(&mut out.zero, v[0], profile),
                Kind::Frame { turning } => {
                    for k in 0..3 {
                        add(&mut out.frame[k], v[k], profile);
                        if *turning {
                            add(&mut out.turn[k], v[k + 3], profile);
                        }
                    }
                }
                Kind::Target => (0..3).for_each(|k| add(&mut out.tool[k], v[k], profile)),
                Kind::Scale => add(&mut out.scale, v[0], profile),
                Kind::Sag => add(&mut out.sag, v[0], profile),
                Kind::Load { .. } | Kind::JointZero { .. } | Kind::Empirical(_) => {}
            }
        }
        Some(out)
    }
}

impl State {
    pub(in crate::identification::calibration) fn of(problem: &CalibrationProblem, x: &[f64]) -> Self {
        let (model, frames) = problem.apply(x);
        let turned = |is: fn(&Parameter) -> Option<usize>| {
            let mut phi = Vector3::zeros();
            for (parameter, value) in problem.parameters.iter().zip(x) {
                if let Some(k) = is(parameter).filter(|&k| k >= 3) {
                    phi[k - 3] += value;
                }
            }
            phi
        };
        let sensor = turned(|p| if let Parameter::SensorFrame(k) = p { Some(*k) } else { None });
        let target = turned(|p| if let Parameter::Target(k) = p { Some(*k) } else { None });
        let flange = *model.flange.rotation.to_rotation_matrix().matrix();
        Self {
            tables: chain::tables(&model.links),
            links_mm: std::array::from_fn(|i| (model.links[i].a_mm, model.links[i].d_mm)),
            target: model.flange * frames.flange_from_target,
            base_from_sensor: frames.base_from_sensor,
            outlets: frames.outlets_mm,
            zeros: frames.zeros_mm,
            sensor_axes: left_jacobian(&sensor),
            target_axes: flange * left_jacobian(&target),
            flange,
            effects: problem.columns.effects.iter().map(|e| x[e.index]).collect(),
            disturbed: DisturbanceColumns::of(&frames.disturbances, &problem.columns),
        }
    }
}
