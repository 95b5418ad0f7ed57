//! The errors beyond the noise of an arm's model along a path: what placement takes out of them, and what they add to the risk of a cut.
//!
//! Each joint's angle errs by eⱼ with standard deviation sⱼ (`truegrind_arm::estimated::beyond_noise`). Neighbouring poses err alike, since
//! what the model lacks (gears, bearings, weight) depends on the pose: the correlation between two poses is exp(−|Δq|/ℓ), with |Δq| the
//! length of the difference of their six joint angles and ℓ = 20°. That is an assumption: measured poses lie farther apart than a cut is
//! long, so that they hardly show it. On 90 simulated arms, measured at 200 random poses or at 30 to 60 round a part, the error of a program's
//! shape is 0.2 to 0.5 of the stated one (medians) where all that the model lacks has one or two periods per turn of a joint, and 0.5 to 1.5
//! where motors ripple and gears have play. Without these errors it was 1.1 to 4.3 and 5 to 9 times the stated one.
//!
//! With uⱼ(p) = sⱼ zⱼ × (p − oⱼ) the covariance of the displacements of two points is k(p, p') Σⱼ uⱼ(p) uⱼ(p')ᵀ. A registration is linear in
//! the displacements of its points, T d, and leaves of a point i the displacement dᵢ − Wᵢ T d.

use nalgebra::{Matrix6, Point3, Vector3, Vector6};

use crate::risk::registration::Registration;
use truegrind_arm::model::Joints;

/// Distance of two poses at which their errors are alike to 1/e (rad).
pub(crate) const ALIKE_RAD: f64 = 20.0 * std::f64::consts::PI / 180.0;

/// The error of a point of a path.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct ErrorAt {
    /// Controller joints (rad).
    pub(crate) joints: Joints,
    /// Displacement by one standard deviation of each joint's error (mm).
    pub(crate) shifts: [Vector3<f64>; 6],
}

impl ErrorAt {
    /// Mean square (mm²).
    pub(crate) fn square_mm2(&self) -> f64 {
        self.shifts.iter().map(Vector3::norm_squared).sum()
    }

    fn likeness(&self, joints: &Joints) -> f64 {
        (-(self.joints - joints).norm() / ALIKE_RAD).exp()
    }
}

/// How the registration of a part follows the errors of its points.
#[derive(Debug, Clone)]
pub(crate) struct RegisteredErrors {
    /// Joints of each point, and the twist of the registration by the error of each joint there.
    points: Vec<(Joints, [Vector6<f64>; 6])>,
    /// Covariance of the twist.
    pub(crate) covariance: Matrix6<f64>,
    /// Share of the mean square error of the points that the registration leaves.
    pub(crate) share: f64,
}

impl RegisteredErrors {
    /// Of the points of a registration; `None` without errors.
    pub(crate) fn of(
        registration: &Registration,
        intended: &[Point3<f64>],
        errors: &[ErrorAt],
    ) -> Option<Self> {
        let twists = |k: usize, at: &ErrorAt| at.shifts.map(|shift| registration.twist_of(k, &shift));
        let points: Vec<(Joints, [Vector6<f64>; 6])> =
            errors.iter().enumerate().map(|(k, at)| (at.joints, twists(k, at))).collect();
        let total: f64 = errors.iter().map(ErrorAt::square_mm2).sum();
        if !(total > 0.0) {
            return None;
        }
        let mut out = Self { points, covariance: Matrix6::zeros(), share: 1.0 };
        let beside: Vec<[Vector6<f64>; 6]> = errors.iter().map(|at| out.beside(at)).collect();
        for ((_, twists), beside) in out.points.iter().zip(&beside) {
            for (twist, beside) in twists.iter().zip(beside) {
                out.covariance += twist * beside.transpose();
            }
        }
        let left = errors.iter().zip(intended).zip(&beside);
        let left = left.map(|((at, point), beside)| out.left_mm2(registration, at, point, beside));
        out.share = (left.sum::<f64>() / total).clamp(0.0, 1.0);
        Some(out)
    }

    /// Covariance of the error of each joint at a pose with the twist, per standard deviation there.
    fn beside(&self, at: &ErrorAt) -> [Vector6<f64>; 6] {
        let mut out = [Vector6::zeros(); 6];
        for (joints, twists) in &self.points {
            let likeness = at.likeness(joints);
            for (sum, twist) in out.iter_mut().zip(twists) {
                *sum += twist * likeness;
            }
        }
        out
    }

    /// Mean square (mm²) that the registration leaves of a point.
    fn left_mm2(
        &self,
        registration: &Registration,
        at: &ErrorAt,
        point: &Point3<f64>,
        beside: &[Vector6<f64>; 6],
    ) -> f64 {
        let shared = at
            .shifts
            .iter()
            .zip(beside)
            .map(|(shift, twist)| shift.dot(&registration.shift_at(twist, point)));
        // tr(W C Wᵀ): W maps the columns of C to displacements, and then its rows.
        let columns: [Vector3<f64>; 6] =
            std::array::from_fn(|k| registration.shift_at(&self.covariance.column(k).into_owned(), point));
        let moved = (0..3).map(|axis| {
            let row = Vector6::from_fn(|k, _| columns[k][axis]);
            registration.shift_at(&row, point)[axis]
        });
        at.square_mm2() - 2.0 * shared.sum::<f64>() + moved.sum::<f64>()
    }
}

/// What errors beyond the noise add to a cut.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub(crate) struct CutErrors {
    /// Sum of the mean squares over its points (mm²).
    pub(crate) square_mm2: f64,
    /// The same of its shape.
    pub(crate) shape_square_mm2: f64,
    /// Variance of d·e, with the correction d and the error e of all points (mm⁴).
    pub(crate) along_mm4: f64,
    /// The same of its shape.
    pub(crate) shape_along_mm4: f64,
}

impl CutErrors {
    /// Of the points `intended` of a cut, which are corrected by `shifts`.
    pub(crate) fn of(
        errors: &[ErrorAt],
        intended: &[Point3<f64>],
        shifts: &[Vector3<f64>],
        registration: &Registration,
        registered: Option<&RegisteredErrors>,
    ) -> Self {
        let Some(registered) = registered else { return Self::default() };
        let turned = registration.turned(intended, shifts);
        let along: Vec<[f64; 6]> =
            errors.iter().zip(shifts).map(|(at, d)| at.shifts.map(|shift| shift.dot(d))).collect();
        let mut out = Self::default();
        let mut shared = 0.0;
        for (i, (at, point)) in errors.iter().zip(intended).enumerate() {
            let beside = registered.beside(at);
            out.square_mm2 += at.square_mm2();
            out.shape_square_mm2 += registered.left_mm2(registration, at, point, &beside);
            shared += along[i].iter().zip(&beside).map(|(a, twist)| a * twist.dot(&turned)).sum::<f64>();
            for (other, a) in errors.iter().zip(&along) {
                let products = along[i].iter().zip(a).map(|(a, b)| a * b);
                out.along_mm4 += at.likeness(&other.joints) * products.sum::<f64>();
            }
        }
        let moved = turned.dot(&(registered.covariance * turned));
        out.shape_along_mm4 = (out.along_mm4 - 2.0 * shared + moved).max(0.0);
        out
    }
}
