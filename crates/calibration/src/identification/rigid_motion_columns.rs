//! Displacements of a target at many poses, apart from the placement of base and target.

use nalgebra::{DMatrix, DVector, Rotation3, Vector3};

/// Position of the target and orientation of the flange at a pose.
pub(crate) type Placed = (Vector3<f64>, Rotation3<f64>);

/// The displacements of the target between two arms.
pub(crate) fn fill(column: &mut [f64], first: &[Placed], now: &[Placed]) {
    for ((into, (first, _)), (now, _)) in column.chunks_exact_mut(3).zip(first).zip(now) {
        into.copy_from_slice((now - first).as_slice());
    }
}

/// Takes the best placement out of displacements: a small motion of the base, and one of the target on the flange.
pub(crate) fn place(columns: &mut DMatrix<f64>, first: &[Placed]) {
    let mut motions = DMatrix::zeros(columns.nrows(), 9);
    for (pose, (at, rotation)) in first.iter().enumerate() {
        for axis in 0..3 {
            motions[(3 * pose + axis, axis)] = 1.0;
            let turned = Vector3::ith(axis, 1.0).cross(at);
            motions.view_mut((3 * pose, 3 + axis), (3, 1)).copy_from(&turned);
            motions.view_mut((3 * pose, 6 + axis), (3, 1)).copy_from(&rotation.matrix().column(axis));
        }
    }
    for mut motion in motions.column_iter_mut() {
        let length = motion.norm();
        motion.unscale_mut(length.max(f64::MIN_POSITIVE));
    }
    // Not all nine are independent: a target on the axis of the base's turn moves with it.
    let svd = motions.svd(true, false);
    let Some(u) = svd.u else { return };
    let largest = svd.singular_values.max();
    for (k, value) in svd.singular_values.iter().enumerate() {
        if *value > 1e-9 * largest {
            let direction: DVector<f64> = u.column(k).into_owned();
            let along = columns.tr_mul(&direction);
            columns.ger(-1.0, &direction, &along, 1.0);
        }
    }
}
