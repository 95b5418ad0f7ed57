//! Regressors of load and empirical disturbances: sensor shifts and joint rotations of each row per unit of each parameter.

use std::cell::OnceCell;

use nalgebra::{Point3, Vector3, Vector6};

use super::frames::Frames;
use super::sensor_motion::sensor_motions;
use crate::measurement::dataset::{Dataset, Reading, Row, Sensor};
use crate::measurement::sensor::disturbance::Kind;
use crate::measurement::sensor::empirical::{AssumedLoad, CornerSpeed, EmpiricalFault, second_degree};

use truegrind_arm::condition::Condition;
use truegrind_arm::effect::Effect;
use truegrind_arm::model::{Body, Model};

/// Shifts of the sensor (mm), one for each parameter, from the row and the vector from sensor to target.
type ShiftFn<'a> = dyn Fn(&Row, Vector3<f64>) -> Vec<Vector3<f64>> + 'a;

/// Seconds in an hour.
const HOUR_S: f64 = 3600.0;

/// Rotation of each joint (rad) per unit of each parameter, row by row, of faults that rotate joints.
fn fault_rotations(fault: EmpiricalFault, dataset: &Dataset, model: &Model) -> Vec<[Option<Vec<f64>>; 6]> {
    if !fault.rotates_joints() {
        return Vec::new();
    }
    if let Some(effect) = fault.effect() {
        return effect_rotations(&effect, dataset, model);
    }
    let rows = &dataset.rows;
    let none = || -> [Option<Vec<f64>>; 6] { Default::default() };
    match fault {
        EmpiricalFault::Latency { middle_s, corners } => {
            let rates: Vec<Vector6<f64>> = rows
                .iter()
                .map(|r| {
                    let rate = r.motion().and_then(|m| m.rates).map(|rates| match corners {
                        CornerSpeed::Before => rates.before,
                        CornerSpeed::After => rates.after,
                        CornerSpeed::Mean => rates.mean,
                    });
                    rate.map_or_else(Vector6::zeros, |rate| model.joint_map * rate / HOUR_S)
                })
                .collect();
            let middle_h = middle_s as f64 / HOUR_S;
            let hours = |r: &Row| r.condition.time_h.map_or(0.0, |t| t - middle_h);
            let times = |by: &dyn Fn(&Row) -> f64| -> [Option<Vec<f64>>; 6] {
                std::array::from_fn(|j| {
                    Some(rows.iter().zip(&rates).map(|(r, rate)| rate[j] * by(r)).collect())
                })
            };
            vec![times(&|_| 1.0), times(&hours)]
        }
        EmpiricalFault::ArmUnsettled => (0..6)
            .map(|joint| {
                let mut out = none();
                let step = |r: &Row| r.motion().map_or(0.0, |m| -(model.joint_map * m.step)[joint]);
                out[joint] = Some(rows.iter().map(step).collect());
                out
            })
            .collect(),
        _ => Vec::new(),
    }
}

/// The same of an effect of one joint.
fn effect_rotations(effect: &Effect, dataset: &Dataset, model: &Model) -> Vec<[Option<Vec<f64>>; 6]> {
    let Some(joint) = effect.joint() else { return Vec::new() };
    let statics = Model { effects: Vec::new(), ..model.clone() }.statics();
    let mut out: Vec<[Option<Vec<f64>>; 6]> = vec![Default::default(); effect.parameters().len()];
    for row in dataset.rows.iter() {
        let condition = model.gear_condition(&row.condition);
        let turns = effect.regressors(&statics, &model.mapped(&row.joints), &condition);
        for (column, turn) in out.iter_mut().zip(turns) {
            column[joint].get_or_insert_default().push(turn[joint]);
        }
    }
    out
}

/// Static torques (N m) of an assumed load.
pub fn torques_under(dataset: &Dataset, model: &Model, load: AssumedLoad) -> Vec<Vector6<f64>> {
    if load == AssumedLoad::Masses {
        return torques(dataset, model);
    }
    let masses = load.masses();
    torques_of_ends(dataset, model, |end| {
        masses.iter().find(|mass| mass.frame == end).map_or(0.0, |mass| mass.mass_kg)
    })
}

/// Static torques (N m): of the arm's masses where these are known, otherwise of 1 kg at the flange.
fn torques(dataset: &Dataset, model: &Model) -> Vec<Vector6<f64>> {
    if model.bodies.is_none() {
        return flange_torques(dataset, model);
    }
    let statics = Model { effects: Vec::new(), ..model.clone() }.statics();
    let torque =
        |r: &Row| Vector6::from(statics.torques::<f64>(&model.mapped(&r.joints).into(), &r.condition));
    dataset.rows.iter().map(torque).collect()
}

/// Static torques (N m) of masses (kg) at the origins of the frames 1 to 6 alone.
fn torques_of_ends(dataset: &Dataset, model: &Model, mass_kg: impl Fn(usize) -> f64) -> Vec<Vector6<f64>> {
    let lump = |link: usize| Body { mass_kg: mass_kg(link + 1), centre_mm: [0.0; 3] };
    let alone =
        Model { bodies: Some(std::array::from_fn(lump)), effects: Vec::new(), ..model.clone() }.statics();
    let unloaded = Condition::default();
    let torque = |r: &Row| Vector6::from(alone.torques::<f64>(&model.mapped(&r.joints).into(), &unloaded));
    dataset.rows.iter().map(torque).collect()
}

/// Shift of the sensor in the base (mm) per unit of each parameter, row by row, of faults that shift it.
pub fn sensor_shifts(
    fault: EmpiricalFault,
    dataset: &Dataset,
    model: &Model,
    frames: &Frames,
) -> Vec<Vec<Vector3<f64>>> {
    let posed = model.at_condition(&Condition::default());
    let target = Point3::from(frames.flange_from_target.translation.vector);
    let sensor = |row: &Row| match dataset.sensor {
        Sensor::Cable => frames.outlets_mm[row.anchor.min(frames.outlets_mm.len().saturating_sub(1))],
        _ => frames.base_from_sensor.translation.vector,
    };
    let shift_columns = |shift: &ShiftFn<'_>| {
        let count = fault.names().len();
        let mut out = vec![Vec::with_capacity(dataset.rows.len()); count];
        for row in dataset.rows.iter() {
            let away = (posed.forward(&row.joints) * target).coords - sensor(row);
            let here = shift(row, away);
            out.iter_mut().zip(here).for_each(|(column, v)| column.push(v));
        }
        out
    };
    match fault {
        EmpiricalFault::SensorUnsettled => shift_columns(&|row, _| {
            let Some(motion) = row.motion() else { return vec![Vector3::zeros()] };
            let (here, before) =
                (posed.forward(&row.joints) * target, posed.forward(&(row.joints - motion.step)) * target);
            vec![here - before]
        }),
        EmpiricalFault::Refraction => shift_columns(&|row, away| {
            let bend = model.gravity * (away.norm_squared() * 1e-3);
            // Half way along the beam, in metres above the base.
            let height = -1e-3 * model.gravity.dot(&(sensor(row) + 0.5 * away));
            vec![bend, bend * height]
        }),
        EmpiricalFault::Pulley => shift_columns(&|_, away| {
            let u = away.normalize();
            second_degree(&u).map(|v| u * v).to_vec()
        }),
        EmpiricalFault::Drum { from_mm, to_mm } => {
            shift_columns(&|row, away| {
                let u = away.normalize();
                // The measured length: independent of the estimated outlet and zero.
                let d = if let Reading::Cable(length) = row.reading { length } else { away.norm() };
                legendre(d, from_mm, to_mm).map(|p| u * p).to_vec()
            })
        }
        EmpiricalFault::CableReversal => shift_columns(&|row, away| {
            let Some(motion) = row.motion() else { return vec![Vector3::zeros()] };
            let before = (posed.forward(&(row.joints - motion.step)) * target).coords - sensor(row);
            let paid_out = (away.norm() - before.norm()).signum();
            // A reading that is too long is a sensor that stands back.
            vec![away.normalize() * (-0.5 * paid_out)]
        }),
        EmpiricalFault::Lens => shift_columns(&|_, away| {
            let turn = frames.base_from_sensor.rotation;
            let [x, y, z]: [f64; 3] = (turn.inverse() * away).into();
            let square = (x * x + y * y) / (z * z);
            [[x, y, 0.0], [0.0, 0.0, z]].map(|longer| turn * Vector3::from(longer) * -square).to_vec()
        }),
        EmpiricalFault::Range { from_mm, to_mm } => shift_columns(&|_, away| {
            let u = away.normalize();
            vec![u, u * legendre(away.norm(), from_mm, to_mm)[0]]
        }),
        EmpiricalFault::SensorAxes => shift_columns(&|_, away| {
            // A reading that is too long is a sensor that stands back.
            let turn = frames.base_from_sensor.rotation;
            let [x, y, z]: [f64; 3] = (turn.inverse() * away).into();
            [[2.0 * x, -y, -z], [-x, 2.0 * y, -z]].map(|longer| turn * Vector3::from(longer) / -3.0).to_vec()
        }),
        EmpiricalFault::TargetNest { second } => shift_columns(&|row, away| {
            let turn = posed.forward(&row.joints).rotation * frames.flange_from_target.rotation;
            let seen = turn.inverse() * away.normalize();
            // A matrix times the direction, without its trace, which is a length error of the beam.
            let places = [(0, 0), (0, 1), (0, 2), (1, 0), (1, 1), (1, 2), (2, 0), (2, 1)];
            let mut out = places.map(|(i, j)| turn * (Vector3::ith(i, 1.0) * seen[j])).to_vec();
            if second {
                let values = second_degree(&seen);
                out.extend((0..3).flat_map(|i| values.map(|v| turn * (Vector3::ith(i, 1.0) * v))));
            }
            out
        }),
        EmpiricalFault::TargetDroop { .. }
        | EmpiricalFault::AxisWobble { .. }
        | EmpiricalFault::BaseTilt { .. } => {
            let motions = sensor_motions(fault, dataset, model, frames);
            motions.iter().map(|rows| rows.iter().map(|[shift, _]| *shift).collect()).collect()
        }
        _ => Vec::new(),
    }
}

/// Turn of the sensor in the base (rad) about its origin per unit of each parameter, row by row, of faults that turn the target of a
/// sensor that reads orientations; none of others.
pub fn sensor_turns(
    fault: EmpiricalFault,
    dataset: &Dataset,
    model: &Model,
    frames: &Frames,
) -> Vec<Vec<Vector3<f64>>> {
    if dataset.sensor != Sensor::Pose || !fault.turns_target() {
        return Vec::new();
    }
    let motions = sensor_motions(fault, dataset, model, frames);
    motions.iter().map(|rows| rows.iter().map(|[_, turn]| *turn).collect()).collect()
}

/// Second and third Legendre polynomials of a length (mm) between two lengths (mm).
fn legendre(length_mm: f64, from_mm: u32, to_mm: u32) -> [f64; 2] {
    let (low, high) = (f64::from(from_mm), f64::from(to_mm));
    let t = (2.0 * length_mm - low - high) / (high - low).max(1.0);
    [0.5 * (3.0 * t * t - 1.0), 0.5 * (5.0 * t * t * t - 3.0 * t)]
}

/// Rows of an arm with the torques of a load, which are computed once for all disturbances that need them.
#[derive(Debug)]
pub struct LoadedRows<'a> {
    dataset: &'a Dataset,
    model: &'a Model,
    torques: OnceCell<Vec<Vector6<f64>>>,
}

impl<'a> LoadedRows<'a> {
    /// Nothing is computed yet.
    pub fn new(dataset: &'a Dataset, model: &'a Model) -> Self {
        Self { dataset, model, torques: OnceCell::new() }
    }

    fn flange_torques(&self) -> &[Vector6<f64>] {
        self.torques.get_or_init(|| flange_torques(self.dataset, self.model))
    }
}

/// Rotation of each joint (rad) per unit of each parameter of a disturbance that turns joints, row by row.
pub fn joint_rotations(kind: &Kind, rows: &LoadedRows<'_>) -> Vec<[Option<Vec<f64>>; 6]> {
    match kind {
        Kind::Empirical(fault) => fault_rotations(*fault, rows.dataset, rows.model),
        Kind::JointZero { joint } => {
            let mut out: [Option<Vec<f64>>; 6] = Default::default();
            out[*joint] = Some(vec![1.0; rows.dataset.rows.len()]);
            vec![out]
        }
        Kind::Load { joints, compliance } => {
            let torques = rows.flange_torques();
            let bent = |joint: usize, factor: f64| torques.iter().map(|t| factor * t[joint]).collect();
            match compliance {
                Some(compliance) => {
                    let mut out: [Option<Vec<f64>>; 6] = Default::default();
                    joints.iter().zip(compliance).for_each(|(&j, &c)| out[j] = Some(bent(j, c)));
                    vec![out]
                }
                None => joints
                    .iter()
                    .map(|&j| {
                        let mut out: [Option<Vec<f64>>; 6] = Default::default();
                        out[j] = Some(bent(j, 1.0));
                        out
                    })
                    .collect(),
            }
        }
        _ => Vec::new(),
    }
}

/// Torque about each joint of 1 kg at the flange, for every row (N m).
pub fn flange_torques(dataset: &Dataset, model: &Model) -> Vec<Vector6<f64>> {
    let bare = Model { bodies: None, effects: Vec::new(), ..model.clone() };
    let statics = bare.statics();
    let kilogram = Condition { payload_kg: Some(1.0), ..Condition::default() };
    dataset
        .rows
        .iter()
        .map(|r| Vector6::from(statics.torques::<f64>(&model.mapped(&r.joints).into(), &kilogram)))
        .collect()
}
