//! Conversion of NumPy arrays: joint angles by rows, positions and rotations, without intermediate copies.

use numpy::ndarray::{ArrayView2, ArrayViewD, Axis, Ix2};
use numpy::{
    PyArray2, PyArray3, PyArrayDyn, PyArrayMethods, PyReadonlyArrayDyn, PyUntypedArray, PyUntypedArrayMethods,
};
use pyo3::prelude::*;
use pyo3::sync::PyOnceLock;
use pyo3::types::PyTuple;
use rayon::prelude::*;
use truegrind::{Condition, JointColumns, Joints, Model, Pose, PoseColumns};

use crate::errors::Refusal;
use crate::types::Object;

/// An array of numbers.
pub(crate) type Numbers<'py> = PyReadonlyArrayDyn<'py, f64>;

/// Rows per pass, so that joints, kernel and poses stay in cache.
const BLOCK: usize = 512;

/// Number of rows from which several threads are used.
const MANY_ROWS: usize = 16 * BLOCK;

/// The doubles of an argument, copied only if NumPy has to convert them.
///
/// # Errors
/// Names the argument, which holds something else than real numbers.
pub(crate) fn numbers<'py>(name: &str, given: &Bound<'py, PyAny>) -> PyResult<Numbers<'py>> {
    let py = given.py();
    // Not of a subclass: a masked array hides some of its numbers.
    if given.get_type().is(py.get_type::<PyUntypedArray>())
        && let Ok(array) = given.cast::<PyArrayDyn<f64>>()
        && is_aligned(array)
    {
        return Ok(array.readonly());
    }
    let helper = py.import("truegrind._results")?.getattr("doubles")?;
    let array = helper
        .call1((given,))
        .map_err(|error| Refusal::argument(name, error.value(py), "an array of real numbers"))?;
    Ok(array.cast::<PyArrayDyn<f64>>()?.readonly())
}

/// Whether each number begins where a processor reads a double at once: not so in a column of packed records.
fn is_aligned(array: &Bound<'_, PyArrayDyn<f64>>) -> bool {
    let size = size_of::<f64>();
    (array.data() as usize).is_multiple_of(size)
        && array.strides().iter().all(|stride| stride.unsigned_abs().is_multiple_of(size))
}

/// The rows of an array of shape (N, `width`), or the one row of an array of shape (`width`,).
///
/// # Errors
/// Names the argument and its shape.
pub(crate) fn rows<'a>(
    name: &str,
    array: ArrayViewD<'a, f64>,
    width: usize,
) -> Result<(ArrayView2<'a, f64>, bool), Refusal> {
    let shape = array.shape().to_vec();
    let wrong = || {
        let expected = format!("an array of shape (N, {width}), or one row of shape ({width},)");
        Refusal::argument(name, format!("an array of shape {}", shown(&shape)), &expected)
    };
    let one = array.ndim() == 1;
    let array = if one { array.insert_axis(Axis(0)) } else { array };
    let array = array.into_dimensionality::<Ix2>().map_err(|_| wrong())?;
    if array.ncols() == width { Ok((array, one)) } else { Err(wrong()) }
}

pub(crate) fn shown(shape: &[usize]) -> String {
    match shape {
        [one] => format!("({one},)"),
        all => format!("({})", all.iter().map(usize::to_string).collect::<Vec<_>>().join(", ")),
    }
}

/// Controller angles (rad) of a row (°).
pub(crate) fn joints(q_deg: ArrayView2<'_, f64>, row: usize) -> Joints {
    Joints::from_fn(|j, _| q_deg[(row, j)].to_radians())
}

/// One or more points: shape (N, 3), or (3,) for one.
pub(crate) fn shaped<'py>(array: Bound<'py, PyAny>, one: bool) -> PyResult<Bound<'py, PyAny>> {
    if one { array.get_item(0) } else { Ok(array) }
}

/// Poses of the flange in the base: positions (mm), shape (N, 3), and rotation matrices, shape (N, 3, 3).
pub(crate) fn forward<'py>(
    py: Python<'py>,
    arm: &Model,
    condition: &Condition,
    q_deg: ArrayView2<'_, f64>,
) -> PyResult<(Bound<'py, PyArray2<f64>>, Bound<'py, PyArray3<f64>>)> {
    let count = q_deg.nrows();
    let position = PyArray2::<f64>::zeros(py, [count, 3], false);
    let rotation = PyArray3::<f64>::zeros(py, [count, 3, 3], false);
    {
        let (mut position, mut rotation) = (position.readwrite(), rotation.readwrite());
        let (position, rotation) = (position.as_slice_mut()?, rotation.as_slice_mut()?);
        py.detach(|| all_rows(arm, condition, q_deg, position, rotation));
    }
    Ok((position, rotation))
}

fn all_rows(
    arm: &Model,
    condition: &Condition,
    q_deg: ArrayView2<'_, f64>,
    position: &mut [f64],
    rotation: &mut [f64],
) {
    let ready = arm.at_condition(condition);
    let block = |buffers: &mut (JointColumns, PoseColumns), first: usize, p: &mut [f64], r: &mut [f64]| {
        let (joints, poses) = buffers;
        let count = p.len() / 3;
        joints.angle_rad.iter_mut().for_each(|column| column.resize(count, 0.0));
        match q_deg.as_slice() {
            Some(all) => {
                for (k, row) in all[6 * first..][..6 * count].chunks_exact(6).enumerate() {
                    for (column, angle) in joints.angle_rad.iter_mut().zip(row) {
                        column[k] = angle.to_radians();
                    }
                }
            }
            None => {
                for (j, column) in joints.angle_rad.iter_mut().enumerate() {
                    for (k, angle) in column.iter_mut().enumerate() {
                        *angle = q_deg[(first + k, j)].to_radians();
                    }
                }
            }
        }
        ready.forward_columns(joints, poses);
        for (k, place) in p.chunks_exact_mut(3).enumerate() {
            for (i, value) in place.iter_mut().enumerate() {
                *value = poses.position_mm[i][k];
            }
        }
        for (k, matrix) in r.chunks_exact_mut(9).enumerate() {
            for i in 0..3 {
                for j in 0..3 {
                    matrix[3 * i + j] = poses.axes[3 * j + i][k];
                }
            }
        }
    };
    let count = position.len() / 3;
    if count < MANY_ROWS {
        let mut buffers = Default::default();
        let blocks = position.chunks_mut(3 * BLOCK).zip(rotation.chunks_mut(9 * BLOCK)).enumerate();
        blocks.for_each(|(k, (p, r))| block(&mut buffers, k * BLOCK, p, r));
    } else {
        position
            .par_chunks_mut(3 * BLOCK)
            .zip(rotation.par_chunks_mut(9 * BLOCK))
            .enumerate()
            .for_each_init(Default::default, |buffers, (k, (p, r))| block(buffers, k * BLOCK, p, r));
    }
}

/// Positions (mm) and rotation matrices as poses.
///
/// # Errors
/// A matrix is not a rotation, or the numbers of rows differ.
pub(crate) fn poses(
    position_mm: ArrayView2<'_, f64>,
    rotation: ArrayViewD<'_, f64>,
) -> Result<Vec<Pose>, Refusal> {
    let count = position_mm.nrows();
    let shape = rotation.shape().to_vec();
    let flat = match shape.as_slice() {
        [3, 3] if count == 1 => rotation.insert_axis(Axis(0)),
        [n, 3, 3] if *n == count => rotation,
        _ => {
            let expected = format!("({count}, 3, 3), a rotation matrix for each position");
            return Err(Refusal::argument("rotation", shown(&shape), &expected));
        }
    };
    (0..count)
        .map(|row| {
            let matrix = nalgebra::Matrix3::from_fn(|i, j| flat[[row, i, j]]);
            let off = (matrix * matrix.transpose() - nalgebra::Matrix3::identity()).amax();
            // Not `>`, so that NaN is refused too.
            if !(off <= 1e-6 && matrix.determinant() > 0.0) {
                let found = format!("row {row}, {off:.1e} away from a rotation");
                return Err(Refusal::argument("rotation", found, "right-handed rotation matrices"));
            }
            let place = nalgebra::Vector3::from_fn(|i, _| position_mm[(row, i)]);
            Ok(Pose::from_parts(place.into(), truegrind::math::se3::rotation_from_matrix(&matrix)))
        })
        .collect()
}

/// The named tuples of the package, cached.
static TUPLES: PyOnceLock<[Py<PyAny>; 2]> = PyOnceLock::new();

/// Selects a named tuple.
#[derive(Debug, Clone, Copy)]
pub(crate) enum Tuple {
    Poses,
    Solutions,
}

/// A named tuple of the package.
pub(crate) fn named<'py, H>(
    py: Python<'py>,
    tuple: Tuple,
    fields: impl IntoPyObject<'py, Target = PyTuple, Output = Bound<'py, PyTuple>, Error = PyErr>,
) -> PyResult<Object<'py, H>> {
    let classes = TUPLES.get_or_try_init(py, || -> PyResult<[Py<PyAny>; 2]> {
        let module = py.import("truegrind._results")?;
        Ok([module.getattr("Poses")?.unbind(), module.getattr("Solutions")?.unbind()])
    })?;
    let class = match tuple {
        Tuple::Poses => &classes[0],
        Tuple::Solutions => &classes[1],
    };
    Ok(class.bind(py).call1(fields.into_pyobject(py)?)?.into())
}
