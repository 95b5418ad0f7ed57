//! Motions of the sensor that stand for a target that droops, an axis that wobbles and a base that tilts: their regressors.
//!
//! A target displaced by d and turned by ω is read as by a sensor that moved: by −d, if it reads no orientations. If it does, it turns by
//! −ω too, and since that carries the target along, it moves by −d + ω × (p − s), p the target and s the sensor.

use nalgebra::{Point3, Rotation3, Vector3};

use super::frames::Frames;
use crate::measurement::dataset::{Dataset, Row, Sensor};
use crate::measurement::sensor::empirical::{EmpiricalFault, Overturning, Pole};

use truegrind_arm::condition::Condition;
use truegrind_arm::effect::Statics;
use truegrind_arm::model::{Body, MappedJoints, Model};

/// Displacement (mm) and rotation vector (rad), in the base.
pub(super) type Motion = [Vector3<f64>; 2];

/// Motions of the target per unit of each parameter, from the row, the target in the base and the flange's orientation.
type MotionOfTarget<'a> = Box<dyn Fn(&Row, &Vector3<f64>, &Rotation3<f64>) -> Vec<Motion> + 'a>;

/// Motions of the sensor per unit of each parameter of a fault, row by row; none of a fault without them. The turn is zero where the
/// sensor reads no orientations.
pub(super) fn sensor_motions(
    fault: EmpiricalFault,
    dataset: &Dataset,
    model: &Model,
    frames: &Frames,
) -> Vec<Vec<Motion>> {
    let posed = model.at_condition(&Condition::default());
    let offset = frames.flange_from_target.translation.vector;
    let of_target: MotionOfTarget<'_> = match fault {
        EmpiricalFault::TargetDroop { pole, turning } => Box::new(move |_, _, flange| {
            let here = droops(pole, turning, &offset, &(flange.inverse() * model.gravity));
            here.into_iter().map(|motion| motion.map(|v| flange * v)).collect()
        }),
        EmpiricalFault::AxisWobble { joint, radial } => {
            let posed = &posed;
            Box::new(move |row, at, _| {
                let frames = posed.frames(&row.joints);
                let [z, across] = [frames.z[joint], frames.lateral[joint]].map(Vector3::from);
                let angle = posed.joint_rotations(&row.joints)[joint];
                wobbles(&z, &across, angle, radial, &(at - Vector3::from(frames.origin[joint])))
            })
        }
        EmpiricalFault::BaseTilt { load, axes, deep } => {
            let loads = Loads::of(load, model);
            Box::new(move |row, at, _| {
                let moments = loads.moments(&model.mapped(&row.joints), &row.condition);
                let turns = tilts(&moments, axes);
                let mut out: Vec<Motion> = turns.iter().map(|turn| [turn.cross(at), *turn]).collect();
                if deep {
                    out.extend(turns.iter().map(|turn| [model.gravity.cross(turn), Vector3::zeros()]));
                }
                out
            })
        }
        _ => return Vec::new(),
    };
    let oriented = dataset.sensor == Sensor::Pose;
    let mut out = vec![Vec::with_capacity(dataset.rows.len()); fault.names().len()];
    for row in dataset.rows.iter() {
        let flange = posed.forward(&row.joints);
        let at = (flange * Point3::from(offset)).coords;
        let away = at - frames.base_from_sensor.translation.vector;
        let moved = of_target(row, &at, &flange.rotation.to_rotation_matrix());
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

/// Motions of a target, at a lever from the origin of a joint's frame, per unit of each parameter of a wobble twice a turn: `z` is the joint's
/// axis, `across` a direction that turns with it, `angle` its rotation. The tilt is about axes that stand still, so twice a turn there is
/// once and three times a turn for who turns along.
fn wobbles(
    z: &Vector3<f64>,
    across: &Vector3<f64>,
    angle: f64,
    radial: bool,
    lever: &Vector3<f64>,
) -> Vec<Motion> {
    let (sin, cos) = angle.sin_cos();
    let x = across * cos - z.cross(across) * sin;
    let y = z.cross(&x);
    let (sin, cos) = (2.0 * angle).sin_cos();
    let directions = [x * cos, x * sin, y * cos, y * sin];
    let tilts = directions.map(|turn| [turn.cross(lever), turn]);
    let shifts = directions.map(|shift| [shift, Vector3::zeros()]);
    tilts.into_iter().chain(shifts).take(if radial { 8 } else { 4 }).collect()
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

/// Rotation vectors of the base (rad) per unit of each parameter under moments (N m).
fn tilts(moments: &[Vector3<f64>], axes: Option<[u8; 2]>) -> Vec<Vector3<f64>> {
    let Some([a, b]) = axes.map(|axes| axes.map(usize::from)) else { return moments.to_vec() };
    let along = |axis: usize, size: f64| Vector3::ith(axis, size);
    let first = moments.iter().map(|m| along(a, m[a]));
    let second = moments.iter().map(|m| along(b, m[b]));
    let coupled = moments.iter().map(|m| along(a, m[b]) + along(b, m[a]));
    first.chain(second).chain(coupled).collect()
}

/// What overturns a base, prepared for many poses.
struct Loads {
    each: Vec<Statics>,
    /// Whether the logged payload counts.
    logged: bool,
}

impl Loads {
    fn of(load: Overturning, model: &Model) -> Self {
        let with =
            |bodies: Option<[Body; 6]>| Model { bodies, effects: Vec::new(), ..model.clone() }.statics();
        let alone = |frame: usize| {
            let lump =
                |link: usize| Body { mass_kg: f64::from(u8::from(link + 1 == frame)), centre_mm: [0.0; 3] };
            with(Some(std::array::from_fn(lump)))
        };
        match load {
            Overturning::Masses => Self { each: vec![with(model.bodies)], logged: true },
            Overturning::Lumps => Self { each: [2, 4, 6].map(alone).to_vec(), logged: false },
        }
    }

    /// Moment of each (N m).
    fn moments(&self, u: &MappedJoints, condition: &Condition) -> Vec<Vector3<f64>> {
        let unloaded = Condition::default();
        let condition = if self.logged { condition } else { &unloaded };
        self.each.iter().map(|statics| statics.overturning_moment(u, condition)).collect()
    }
}
