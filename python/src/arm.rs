//! Forward and inverse kinematics, common to `Robot`, `Model` and `Arm`.

use numpy::ndarray::ArrayView2;
use numpy::{PyArray1, PyArray2, PyArrayMethods, PyUntypedArrayMethods};
use pyo3::prelude::*;
use truegrind::{Condition, Inverse, InverseError, Joints, Model, Pose};

use crate::arrays::{self, Tuple, joints, numbers, rows, shaped};
use crate::errors::{Kind, Refusal};
use crate::model::PyModel;
use crate::robot::{PyArm, PyRobot};
use crate::types::{Object, Poses, Solutions};

/// An arm, the nominal arm whose closed-form inverse starts the search for joints, and the default condition.
pub(crate) struct Acting<'a> {
    pub(crate) arm: &'a Model,
    pub(crate) nominal: &'a Model,
    pub(crate) condition: Condition,
}

/// The arm of a `Robot`, `Model` or `Arm`.
///
/// # Errors
/// Any other type.
pub(crate) fn acting<'a>(arm: &'a Bound<'_, PyAny>) -> PyResult<Acting<'a>> {
    if let Ok(robot) = arm.cast::<PyRobot>() {
        return Ok(robot.get().acting());
    }
    if let Ok(model) = arm.cast::<PyModel>() {
        return Ok(model.get().acting());
    }
    if let Ok(arm) = arm.cast::<PyArm>() {
        return Ok(arm.get().acting());
    }
    let found = arm.get_type().name()?.to_string();
    Err(Refusal::argument("arm", found, "a Robot, a Model or an Arm").into())
}

/// Condition of a call; unstated values are those of the arm.
#[derive(Debug, Clone, Copy, Default)]
pub(crate) struct Stated {
    pub(crate) payload_kg: Option<f64>,
    pub(crate) payload_centre_mm: Option<[f64; 3]>,
    pub(crate) temperature_c: Option<f64>,
    pub(crate) time_h: Option<f64>,
}

/// Payloads above this are typing errors (kg).
const MAX_PAYLOAD_KG: f64 = 3000.0;

impl Stated {
    /// The condition of a call.
    ///
    /// # Errors
    /// A mass out of range.
    pub(crate) fn on(&self, own: &Condition) -> Result<Condition, Refusal> {
        if let Some(kg) = self.payload_kg
            && !(0.0..=MAX_PAYLOAD_KG).contains(&kg)
        {
            return Err(Refusal::argument("payload_kg", kg, "a mass in kg, from 0 to 3000"));
        }
        if self.payload_centre_mm.is_some() && self.payload_kg.is_none() {
            return Err(Refusal::argument("payload_kg", "nothing", "the mass whose centre is stated"));
        }
        Ok(Condition {
            payload_kg: self.payload_kg.or(own.payload_kg),
            payload_centre_mm: self.payload_centre_mm.unwrap_or(own.payload_centre_mm),
            temperature_c: self.temperature_c.or(own.temperature_c),
            time_h: self.time_h.or(own.time_h),
            ..*own
        })
    }
}

/// Poses of the flange, as the tuple `Poses`.
pub(crate) fn forward<'py>(
    py: Python<'py>,
    acting: &Acting<'_>,
    q_deg: &Bound<'py, PyAny>,
    stated: &Stated,
) -> PyResult<Object<'py, Poses>> {
    let q_deg = numbers("q_deg", q_deg)?;
    let (q_deg, one) = rows("q_deg", q_deg.as_array(), 6)?;
    let condition = stated.on(&acting.condition)?;
    let (position, rotation) = arrays::forward(py, acting.arm, &condition, q_deg)?;
    let position = shaped(position.into_any(), one)?;
    let rotation = shaped(rotation.into_any(), one)?;
    arrays::named(py, Tuple::Poses, (position, rotation))
}

/// Joints that reach poses of the flange, as the tuple `Solutions`.
pub(crate) fn inverse<'py>(
    py: Python<'py>,
    acting: &Acting<'_>,
    position_mm: &Bound<'py, PyAny>,
    rotation: &Bound<'py, PyAny>,
    near_deg: Option<&Bound<'py, PyAny>>,
    stated: &Stated,
) -> PyResult<Object<'py, Solutions>> {
    let position_mm = numbers("position_mm", position_mm)?;
    let (places, one) = rows("position_mm", position_mm.as_array(), 3)?;
    let targets = arrays::poses(places, numbers("rotation", rotation)?.as_array())?;
    let condition = stated.on(&acting.condition)?;
    let seeds = match near_deg {
        None => vec![Joints::zeros(); targets.len()],
        Some(near) => {
            let near = numbers("near_deg", near)?;
            seeds(rows("near_deg", near.as_array(), 6)?.0, targets.len())?
        }
    };
    let seeded = near_deg.is_some();
    let (arm, nominal) = (acting.arm, acting.nominal);
    let solved = py.detach(|| {
        let inverse = Inverse::new(arm, &condition, nominal);
        let solve = |target: &Pose, seed: &Joints| inverse.solve_near(target, seed).map(|found| found.joints);
        match (targets.as_slice(), seeded) {
            ([target], _) => vec![solve(target, &seeds[0])],
            (_, true) => {
                let found = inverse.solve_seeded(&targets, &seeds);
                found.into_iter().map(|found| found.map(|found| found.joints)).collect()
            }
            (_, false) => path(&inverse, &targets),
        }
    });
    let count = solved.len();
    let q_deg = PyArray2::<f64>::zeros(py, [count, 6], false);
    {
        let mut array = q_deg.readwrite();
        let out = array.as_slice_mut()?;
        for (row, found) in out.chunks_exact_mut(6).zip(&solved) {
            match found {
                Ok(joints) => row.iter_mut().zip(joints.iter()).for_each(|(to, q)| *to = q.to_degrees()),
                Err(_) => row.fill(f64::NAN),
            }
        }
    }
    if let ([Err(why)], true) = (solved.as_slice(), one) {
        return Err(Refusal::new(Kind::Inverse, why).into());
    }
    let reached: Vec<bool> = solved.iter().map(Result::is_ok).collect();
    let reached = PyArray1::from_vec(py, reached);
    let why: Vec<Option<String>> =
        solved.iter().map(|found| found.as_ref().err().map(ToString::to_string)).collect();
    debug_assert_eq!(q_deg.shape()[0], count);
    let (q_deg, reached) = (shaped(q_deg.into_any(), one)?, shaped(reached.into_any(), one)?);
    arrays::named(py, Tuple::Solutions, (q_deg, reached, if one { None } else { Some(why) }))
}

/// Solves targets in order, each starting at the joints of the last reached one.
fn path(inverse: &Inverse<'_>, targets: &[Pose]) -> Vec<Result<Joints, InverseError>> {
    let found = inverse.solve_path(targets, &Joints::zeros());
    found.into_iter().map(|found| found.map(|found| found.joints)).collect()
}

fn seeds(near: ArrayView2<'_, f64>, count: usize) -> Result<Vec<Joints>, Refusal> {
    match near.nrows() {
        1 => Ok(vec![joints(near, 0); count]),
        n if n == count => Ok((0..count).map(|row| joints(near, row)).collect()),
        n => Err(Refusal::argument(
            "near_deg",
            format!("{n} rows"),
            &format!("one row, or {count}: one for each position"),
        )),
    }
}
