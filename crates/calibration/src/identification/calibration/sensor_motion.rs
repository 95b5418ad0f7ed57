//! Motions of the sensor that stand for a target that droops, an axis that wobbles and a base that tilts: their regressors.
//!
//! A target displaced by d and turned by ω is read as by a sensor that moved: by −d, if it reads no orientations. If it does, it turns by
//! −ω too, and since that carries the target along, it moves by −d + ω × (p − s), p the target and s the sensor.

use nalgebra::{Point3, Rotation3, Vector3};

use super::frames::Frames;
use crate::measurement::dataset::{Dataset, Row, Sensor};
use crate::measurement::sensor::empirical::{EmpiricalFault, Pole};

use truegrind_arm::condition::Condition;
use truegrind_arm::effect::Effect;
use truegrind_arm::link_motion::LinkMotion;
use truegrind_arm::model::Model;

/// Displacement (mm) and rotation vector (rad), in the base.
pub type Motion = [Vector3<f64>; 2];

/// Motions of the sensor per unit of each parameter of a fault, row by row; none of a fault without them. The turn is zero where the
/// sensor reads no orientations.
pub(super) fn sensor_motions(
    fault: EmpiricalFault,
    dataset: &Dataset,
    model: &Model,
    frames: &Frames,
) -> Vec<Vec<Motion>> {
    if let EmpiricalFault::TargetDroop { pole, turning } = fault {
        let offset = frames.flange_from_target.translation.vector;
        return of_sensor(dataset, model, frames, |_, _, flange| {
            let here = droops(pole, turning, &offset, &(flange.inverse() * model.gravity));
            here.into_iter().map(|motion| motion.map(|v| flange * v)).collect()
        });
    }
    fault.effect().map_or_else(Vec::new, |effect| motions_by_links(&effect, dataset, model, frames))
}

/// The same of an effect that moves links; none of another.
pub fn motions_by_links(
    effect: &Effect,
    dataset: &Dataset,
    model: &Model,
    frames: &Frames,
) -> Vec<Vec<Motion>> {
    if effect.first_moved_frame().is_none() {
        return Vec::new();
    }
    let alone = Model { effects: vec![effect.clone()], ..model.clone() };
    let links = link_motions(&alone, 0, dataset);
    of_sensor(dataset, model, frames, |row, at, _| {
        let of = |change: &LinkMotion<f64>| {
            let turn = Vector3::from(change.turn);
            [Vector3::from(change.shift) + turn.cross(at), turn]
        };
        links[row].iter().map(of).collect()
    })
}

/// Motions of links per unit of each parameter of effect `index`, in each row.
pub(super) fn link_motions(model: &Model, index: usize, dataset: &Dataset) -> Vec<Vec<LinkMotion<f64>>> {
    let mut posed = model.at_condition(&Condition::default());
    let of = |row: &Row| {
        if posed.condition != *row.condition {
            posed = model.at_condition(&row.condition);
        }
        posed.link_motion_regressors(index, &row.joints)
    };
    dataset.rows.iter().map(of).collect()
}

/// Motions of the sensor, parameter by parameter, from those of the target: by row, the target in the base and the flange's orientation.
fn of_sensor(
    dataset: &Dataset,
    model: &Model,
    frames: &Frames,
    of_target: impl Fn(usize, &Vector3<f64>, &Rotation3<f64>) -> Vec<Motion>,
) -> Vec<Vec<Motion>> {
    let posed = model.at_condition(&Condition::default());
    let target = Point3::from(frames.flange_from_target.translation.vector);
    let oriented = dataset.sensor == Sensor::Pose;
    let mut out: Vec<Vec<Motion>> = Vec::new();
    for (index, row) in dataset.rows.iter().enumerate() {
        let flange = posed.forward(&row.joints);
        let at = (flange * target).coords;
        let away = at - frames.base_from_sensor.translation.vector;
        let moved = of_target(index, &at, &flange.rotation.to_rotation_matrix());
        out.resize_with(moved.len(), || Vec::with_capacity(dataset.rows.len()));
        for (column, [shift, turn]) in out.iter_mut().zip(moved) {
            column.push(if oriented {
                [turn.cross(&away) - shift, -turn]
            } else {
                [-shift, Vector3::zeros()]
            });
        }
    }
    out
}

/// Motions of a target on its pole per unit of each parameter, in the flange's frame, without what a shift of the sensor does as well.
/// `g` is the direction of gravity there.
fn droops(pole: Pole, turning: bool, offset: &Vector3<f64>, g: &Vector3<f64>) -> Vec<Motion> {
    let none = Vector3::zeros();
    let along = match pole {
        Pole::Axis => Vector3::z(),
        Pole::Offset => offset.try_normalize(1e-6).unwrap_or_else(Vector3::z),
        Pole::Bracket => {
            let shifts = [
                Vector3::new(g.y, g.x, 0.0),
                Vector3::new(0.0, g.z, g.y),
                Vector3::new(g.z, 0.0, g.x),
                Vector3::new(g.x, -g.y, 0.0),
                Vector3::new(-g.x, -g.y, 2.0 * g.z),
            ];
            let mut out: Vec<Motion> = shifts.map(|shift| [shift, none]).to_vec();
            if turning {
                out.extend((0..3).map(|axis| [none, Vector3::ith(axis, 1.0).cross(g)]));
            }
            return out;
        }
    };
    let mut out = vec![[along * -along.dot(g), none]];
    if turning {
        out.push([none, along.cross(g)]);
    }
    out
}
