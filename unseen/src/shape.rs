//! How far a model of an arm is from the arm.

use nalgebra::{Matrix3, SMatrix, SVector, Vector3};

use crate::arms::Pose;

/// Root mean square distances (mm) of a point on the flange.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Distance {
    /// As the model is.
    pub as_is: f64,
    /// With the base moved and the point on the flange shifted to the best: what no sensor tells apart from its own frame and target.
    pub shape: f64,
}

fn skew(v: &Vector3<f64>) -> Matrix3<f64> {
    Matrix3::new(0.0, -v.z, v.y, v.z, 0.0, -v.x, -v.y, v.x, 0.0)
}

/// Distance of modelled flanges from true ones, for a point fixed on the flange (mm).
pub fn distance(truth: &[Pose], model: &[Pose], point: &Vector3<f64>) -> Distance {
    let mut normal = SMatrix::<f64, 9, 9>::zeros();
    let mut right = SVector::<f64, 9>::zeros();
    let place = |pose: &Pose, point: &Vector3<f64>| pose.rotation * point + pose.translation.vector;
    let off: Vec<Vector3<f64>> =
        truth.iter().zip(model).map(|(t, m)| place(t, point) - place(m, point)).collect();
    let slopes: Vec<SMatrix<f64, 3, 9>> = model
        .iter()
        .map(|m| {
            let mut slope = SMatrix::<f64, 3, 9>::zeros();
            slope.fixed_view_mut::<3, 3>(0, 0).copy_from(&Matrix3::identity());
            // Turns are counted in mm at half a metre, so that all unknowns are of one size.
            slope.fixed_view_mut::<3, 3>(0, 3).copy_from(&(-skew(&place(m, point)) / 500.0));
            slope.fixed_view_mut::<3, 3>(0, 6).copy_from(&m.rotation.to_rotation_matrix().into_inner());
            slope
        })
        .collect();
    for (slope, off) in slopes.iter().zip(&off) {
        normal += slope.transpose() * slope;
        right += slope.transpose() * off;
    }
    // A point on one axis of turning leaves directions open: they are left where they are.
    let scale = normal.trace() / 9.0;
    for k in 0..9 {
        normal[(k, k)] += 1e-9 * scale;
    }
    let found = normal.cholesky().map_or_else(SVector::zeros, |factor| factor.solve(&right));
    let rms = |errors: &mut dyn Iterator<Item = f64>| (errors.sum::<f64>() / truth.len() as f64).sqrt();
    Distance {
        as_is: rms(&mut off.iter().map(Vector3::norm_squared)),
        shape: rms(&mut slopes.iter().zip(&off).map(|(slope, off)| (off - slope * found).norm_squared())),
    }
}
