//! The predefined functions whose result the text determines: target functions, rotations, arithmetic.
//!
//! Method: as the RAPID reference says. `Offs` adds in the object frame and keeps the orientation; `RelTool` moves along
//! the axes of the target's tool frame and then turns about its x, the new y and the new z.

use nalgebra::{Matrix3, Rotation3, Translation3, UnitQuaternion, Vector3};

use crate::motion::{Frame, Reason, TargetValue};
use crate::rapid::value::{Value, built_in};
use truegrind_math::se3::{Pose, rotation_from_matrix};

/// The type of what a predefined function that gives a target, or a part of one, answers.
pub(super) fn result_type(name: &[u8]) -> Option<&'static [u8]> {
    Some(match name {
        b"offs" | b"reltool" | b"crobt" | b"calcrobt" | b"orobt" | b"mirpos" => b"robtarget",
        b"cjointt" | b"calcjointt" => b"jointtarget",
        b"cpos" | b"posevect" => b"pos",
        b"orientzyx" | b"norient" => b"orient",
        _ => return None,
    })
}

/// A rotation from Euler angles z, y, x (degrees) as `OrientZYX`: about z, the new y, the new x.
fn orient_zyx(z_deg: f64, y_deg: f64, x_deg: f64) -> UnitQuaternion<f64> {
    UnitQuaternion::from_axis_angle(&Vector3::z_axis(), z_deg.to_radians())
        * UnitQuaternion::from_axis_angle(&Vector3::y_axis(), y_deg.to_radians())
        * UnitQuaternion::from_axis_angle(&Vector3::x_axis(), x_deg.to_radians())
}

/// Optional arguments of the functions that are known here.
#[derive(Default)]
pub(super) struct Options {
    /// `\Rx`, `\Ry`, `\Rz`.
    pub(super) turns: [Option<Value>; 3],
    /// `\WObj` of MirPos.
    pub(super) work_object: Option<Value>,
    /// `\MirY`.
    pub(super) mirrors_y: bool,
    /// `\Origin` of DefFrame.
    pub(super) origin: Option<Value>,
    /// `\Dec` of Round and Trunc.
    pub(super) decimals: Option<Value>,
    /// `\X`, `\Y` or `\Z` of EulerZYX, as 0, 1 or 2.
    pub(super) axis: Option<usize>,
}

/// x to the decimals that `\Dec` states, by a way of rounding.
fn to_decimals(x: f64, options: &Options, rounded: fn(f64) -> f64) -> Result<Value, Reason> {
    let decimals = options.decimals.as_ref().map_or(Ok(0.0), Value::number)?;
    if !(0.0..=15.0).contains(&decimals) {
        return Err(Reason::WrongShape);
    }
    let scale = 10_f64.powi(decimals.round() as i32);
    Ok(Value::Number(rounded(x * scale) / scale))
}

/// The angle about z, y or x (degrees) of a rotation R = Rz Ry Rx; `axis` counts x, y, z.
fn euler_zyx(q: [f64; 4], axis: usize) -> Result<f64, Reason> {
    crate::rapid::value::usable(&q)?;
    let turn = UnitQuaternion::from_quaternion(nalgebra::Quaternion::new(q[0], q[1], q[2], q[3]));
    let r = turn.to_rotation_matrix();
    let radians = match axis {
        0 => r[(2, 1)].atan2(r[(2, 2)]),
        1 => (-r[(2, 0)]).atan2(r[(2, 1)].hypot(r[(2, 2)])),
        _ => r[(1, 0)].atan2(r[(0, 0)]),
    };
    Ok(radians.to_degrees())
}

/// An offset: that it is unknown is another reason than an unknown base; a name that another file declares is named as such.
fn offset(value: &Value) -> Result<f64, Reason> {
    value.number().map_err(|reason| match reason {
        Reason::Undeclared | Reason::Ambiguous | Reason::Persistent => reason,
        _ => Reason::RunTimeOffset,
    })
}

/// `Offs(target, x, y, z)`: moved along the axes of the object frame.
fn offs(required: &[Value]) -> Result<Value, Reason> {
    let [target, x, y, z] = required else { return Err(Reason::MissingArgument) };
    let shift = [offset(x)?, offset(y)?, offset(z)?];
    edited(target, |frame| {
        for (position, shift) in frame.position_mm.iter_mut().zip(shift) {
            *position += shift;
        }
    })
}

/// `RelTool(target, x, y, z \Rx \Ry \Rz)`: moved along the axes of the tool, and turned about them.
fn rel_tool(required: &[Value], options: &Options) -> Result<Value, Reason> {
    let [target, x, y, z] = required else { return Err(Reason::MissingArgument) };
    let shift = Vector3::new(offset(x)?, offset(y)?, offset(z)?);
    let mut angles = [0.0; 3];
    for (angle, option) in angles.iter_mut().zip(&options.turns) {
        if let Some(value) = option {
            *angle = offset(value)?;
        }
    }
    let [rx, ry, rz] = angles.map(f64::to_radians);
    let turn = UnitQuaternion::from_axis_angle(&Vector3::x_axis(), rx)
        * UnitQuaternion::from_axis_angle(&Vector3::y_axis(), ry)
        * UnitQuaternion::from_axis_angle(&Vector3::z_axis(), rz);
    edited(target, |frame| {
        let moved = frame.pose() * Pose::from_parts(Translation3::from(shift), turn);
        let quaternion = frame.quaternion;
        *frame = Frame::from_pose(&moved);
        if angles == [0.0; 3] {
            frame.quaternion = quaternion;
        }
    })
}

/// `MirPos(target, plane \WObj \MirY)`.
fn mir_pos(required: &[Value], options: &Options) -> Result<Value, Reason> {
    let [target, plane] = required else { return Err(Reason::MissingArgument) };
    let plane = plane.work_object()?;
    let object = match &options.work_object {
        Some(value) => value.work_object()?,
        None => built_in(b"wobj0").ok_or(Reason::WrongShape)?.work_object()?,
    };
    if !plane.fixed || !object.fixed {
        return Err(Reason::MovingWorkObject);
    }
    let plane = plane.user_frame.pose() * plane.object_frame.pose();
    let object = object.user_frame.pose() * object.object_frame.pose();
    edited(target, |frame| {
        *frame = Frame::from_pose(&mirrored(&frame.pose(), &plane, &object, options.mirrors_y));
    })
}

/// `DefFrame(p1, p2, p3 \Origin)`: a frame through three points.
fn def_frame(required: &[Value], options: &Options) -> Result<Value, Reason> {
    let [origin, x, xy] = required else { return Err(Reason::MissingArgument) };
    let point = |value: &Value| -> Result<Vector3<f64>, Reason> {
        match value.target(false)? {
            TargetValue::Cartesian(target) => Ok(Vector3::from(target.position_mm)),
            TargetValue::Joint(_) => Err(Reason::WrongShape),
        }
    };
    let (origin, x, xy) = (point(origin)?, point(x)?, point(xy)?);
    let normal = (x - origin).cross(&(xy - origin));
    if normal.norm() < 1e-9 {
        return Err(Reason::WrongShape);
    }
    let (e1, e3) = ((x - origin).normalize(), normal.normalize());
    let rotation = Rotation3::from_matrix_unchecked(Matrix3::from_columns(&[e1, e3.cross(&e1), e3]));
    // Where the origin is: in the first point, in the second, or where the third then lies on the y axis.
    let origin = match options.origin.as_ref().map_or(Ok(1.0), Value::number)?.round() {
        1.0 => origin,
        2.0 => x,
        3.0 => origin + e1 * e1.dot(&(xy - origin)),
        _ => return Err(Reason::WrongShape),
    };
    let pose = Pose::from_parts(origin.into(), rotation_from_matrix(rotation.matrix()));
    Ok(Value::from_frame(&Frame::from_pose(&pose)))
}

/// A predefined function of values.
pub(super) fn call(name: &[u8], required: &[Value], options: &Options) -> Result<Value, Reason> {
    let number = |index: usize| required.get(index).ok_or(Reason::MissingArgument)?.number();
    let one = |function: fn(f64) -> f64| Ok(Value::Number(function(number(0)?)));
    let vector = |index: usize| -> Result<Vector3<f64>, Reason> {
        Ok(Vector3::from(required.get(index).ok_or(Reason::MissingArgument)?.numbers::<3>()?))
    };
    match name {
        b"offs" => offs(required),
        b"reltool" => rel_tool(required, options),
        b"mirpos" => mir_pos(required, options),
        b"posemult" => {
            let [a, b] = required else { return Err(Reason::MissingArgument) };
            Ok(Value::from_frame(&Frame::from_pose(&(a.frame()?.pose() * b.frame()?.pose()))))
        }
        b"poseinv" => {
            let [pose] = required else { return Err(Reason::MissingArgument) };
            Ok(Value::from_frame(&Frame::from_pose(&pose.frame()?.pose().inverse())))
        }
        b"posevect" => {
            let [pose, vector] = required else { return Err(Reason::MissingArgument) };
            let vector = pose.frame()?.pose() * nalgebra::Point3::from(vector.numbers::<3>()?);
            Ok(Value::from_numbers(&[vector.x, vector.y, vector.z]))
        }
        b"orientzyx" => {
            let turn = orient_zyx(number(0)?, number(1)?, number(2)?);
            Ok(Value::from_numbers(&[turn.w, turn.i, turn.j, turn.k]))
        }
        b"norient" => {
            let q = required.first().ok_or(Reason::MissingArgument)?.numbers::<4>()?;
            let length = q.iter().map(|q| q * q).sum::<f64>().sqrt();
            if length == 0.0 {
                return Err(Reason::BadQuaternion);
            }
            Ok(Value::from_numbers(&q.map(|q| q / length)))
        }
        b"defframe" => def_frame(required, options),
        b"abs" => one(f64::abs),
        b"sqrt" => one(f64::sqrt),
        b"exp" => one(f64::exp),
        b"sin" => one(|x| x.to_radians().sin()),
        b"cos" => one(|x| x.to_radians().cos()),
        b"tan" => one(|x| x.to_radians().tan()),
        b"asin" => one(|x| x.asin().to_degrees()),
        b"acos" => one(|x| x.acos().to_degrees()),
        b"atan" => one(|x| x.atan().to_degrees()),
        b"round" => to_decimals(number(0)?, options, f64::round),
        b"trunc" => to_decimals(number(0)?, options, f64::trunc),
        b"eulerzyx" => {
            let axis = options.axis.ok_or(Reason::MissingArgument)?;
            let turn = required.first().ok_or(Reason::MissingArgument)?.numbers::<4>()?;
            Ok(Value::Number(euler_zyx(turn, axis)?))
        }
        b"vectmagn" => Ok(Value::Number(vector(0)?.norm())),
        b"distance" => Ok(Value::Number((vector(0)? - vector(1)?).norm())),
        b"dotprod" => Ok(Value::Number(vector(0)?.dot(&vector(1)?))),
        b"crossprod" => {
            let product = vector(0)?.cross(&vector(1)?);
            Ok(Value::from_numbers(&[product.x, product.y, product.z]))
        }
        b"min" => Ok(Value::Number(number(0)?.min(number(1)?))),
        b"max" => Ok(Value::Number(number(0)?.max(number(1)?))),
        b"atan2" => Ok(Value::Number(number(0)?.atan2(number(1)?).to_degrees())),
        b"pow" => Ok(Value::Number(number(0)?.powf(number(1)?))),
        _ => Err(Reason::RunTimeFunction),
    }
}

/// A pose in a work object, mirrored in the xy plane of a frame (RAPID reference, MirPos): the position, the z axis of the
/// tool, and its x axis (with `\MirY` its y axis); the third axis makes it right-handed again.
fn mirrored(pose: &Pose, plane: &Pose, object: &Pose, mirrors_y: bool) -> Pose {
    let world = object * pose;
    let normal = plane.rotation * Vector3::z();
    let origin = plane.translation.vector;
    let reflected = |v: Vector3<f64>| v - normal * (2.0 * normal.dot(&v));
    let position = origin + reflected(world.translation.vector - origin);
    let axis = |v: Vector3<f64>| reflected(world.rotation * v);
    let z = axis(Vector3::z());
    let columns = if mirrors_y {
        let y = axis(Vector3::y());
        [y.cross(&z), y, z]
    } else {
        let x = axis(Vector3::x());
        [x, z.cross(&x), z]
    };
    let turn = rotation_from_matrix(&Matrix3::from_columns(&columns));
    object.inverse() * Pose::from_parts(position.into(), turn)
}

/// A robtarget with another pose; conf and external axes stay.
fn edited(target: &Value, edit: impl FnOnce(&mut Frame)) -> Result<Value, Reason> {
    let parts = match target {
        Value::List(parts) if parts.len() == 4 => parts,
        Value::Unknown(reason) => return Err(*reason),
        _ => return Err(Reason::WrongShape),
    };
    let mut frame = Frame { position_mm: parts[0].numbers()?, quaternion: parts[1].numbers()? };
    crate::rapid::value::usable(&frame.quaternion)?;
    edit(&mut frame);
    let position = Value::from_numbers(&frame.position_mm);
    let rotation = Value::from_numbers(&frame.quaternion);
    Ok(Value::List(vec![position, rotation, parts[2].clone(), parts[3].clone()]))
}
