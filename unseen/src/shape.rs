//! How far a model of an arm is from the arm.

use nalgebra::{DMatrix, Matrix3, SMatrix, SVector, Vector3};

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

/// What no sensor tells apart from its own frame and target: the base moved and the point on the flange shifted.
struct Placement {
    slopes: Vec<SMatrix<f64, 3, 9>>,
    normal: nalgebra::Cholesky<f64, nalgebra::Const<9>>,
}

fn place(pose: &Pose, point: &Vector3<f64>) -> Vector3<f64> {
    pose.rotation * point + pose.translation.vector
}

impl Placement {
    fn of(model: &[Pose], point: &Vector3<f64>) -> Option<Self> {
        let slope = |m: &Pose| {
            let mut slope = SMatrix::<f64, 3, 9>::zeros();
            slope.fixed_view_mut::<3, 3>(0, 0).copy_from(&Matrix3::identity());
            // Turns are counted in mm at half a metre, so that all unknowns are of one size.
            slope.fixed_view_mut::<3, 3>(0, 3).copy_from(&(-skew(&place(m, point)) / 500.0));
            slope.fixed_view_mut::<3, 3>(0, 6).copy_from(&m.rotation.to_rotation_matrix().into_inner());
            slope
        };
        let slopes: Vec<SMatrix<f64, 3, 9>> = model.iter().map(slope).collect();
        let mut normal = slopes.iter().fold(SMatrix::<f64, 9, 9>::zeros(), |sum, s| sum + s.transpose() * s);
        // A point on one axis of turning leaves directions open: they are left where they are.
        let scale = normal.trace() / 9.0;
        for k in 0..9 {
            normal[(k, k)] += 1e-9 * scale;
        }
        Some(Self { slopes, normal: normal.cholesky()? })
    }

    /// Displacements without what the placement explains.
    fn rest(&self, off: &[Vector3<f64>]) -> Vec<Vector3<f64>> {
        let right = self
            .slopes
            .iter()
            .zip(off)
            .fold(SVector::<f64, 9>::zeros(), |sum, (s, off)| sum + s.transpose() * off);
        let found = self.normal.solve(&right);
        self.slopes.iter().zip(off).map(|(slope, off)| off - slope * found).collect()
    }
}

fn rms(errors: &[Vector3<f64>]) -> f64 {
    (errors.iter().map(Vector3::norm_squared).sum::<f64>() / errors.len() as f64).sqrt()
}

/// Distance of modelled flanges from true ones, for a point fixed on the flange (mm).
pub fn distance(truth: &[Pose], model: &[Pose], point: &Vector3<f64>) -> Distance {
    let off: Vec<Vector3<f64>> =
        truth.iter().zip(model).map(|(t, m)| place(t, point) - place(m, point)).collect();
    let rest = Placement::of(model, point).map_or_else(|| off.clone(), |placement| placement.rest(&off));
    Distance { as_is: rms(&off), shape: rms(&rest) }
}

/// Standard deviation of the shape (mm), where `slopes` are the derivatives of the point at each pose with respect to parameters of this
/// covariance: root mean square over the poses.
pub fn shape_sigma(
    model: &[Pose],
    point: &Vector3<f64>,
    slopes: &[DMatrix<f64>],
    covariance: &DMatrix<f64>,
) -> Option<f64> {
    let placement = Placement::of(model, point)?;
    let mut all = DMatrix::zeros(3 * model.len(), covariance.ncols());
    for column in 0..covariance.ncols() {
        let off: Vec<Vector3<f64>> =
            slopes.iter().map(|s| Vector3::new(s[(0, column)], s[(1, column)], s[(2, column)])).collect();
        for (k, rest) in placement.rest(&off).iter().enumerate() {
            all.fixed_view_mut::<3, 1>(3 * k, column).copy_from(rest);
        }
    }
    let variance = (&all * covariance).component_mul(&all).sum() / model.len() as f64;
    (variance > 0.0).then(|| variance.sqrt())
}
