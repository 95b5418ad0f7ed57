//! Information that a planned measurement would give about the arm's parameters.
//!
//! A reading depends on the arm's parameters a and on nuisance parameters b of the measurement (pose of the sensor, position
//! of the target): r = A a + B b + noise. With the weights W of the readings and the prior inverse covariance N of b, their
//! information on a is
//!
//! I = AᵀWA − AᵀWB (BᵀWB + N)⁻¹ BᵀWA,
//!
//! and a covariance C = F Fᵀ becomes F (1 + Fᵀ I F)⁻¹ Fᵀ (Bayes, linear and normal). *Stating* what an earlier measurement
//! had to estimate adds the information of its readings with a narrow prior minus that with a wide one.

use nalgebra::{Cholesky, DMatrix, Matrix3, Vector3};

use truegrind_arm::estimated::Estimated;
use truegrind_arm::model::{Joints, PreparedModel};
use truegrind_math::se3::Pose;

/// Prior standard deviation of a nuisance parameter (mm, rad).
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct PriorSigma {
    pub(crate) mm: f64,
    pub(crate) rad: f64,
}

/// Freely estimated, as in an identification.
pub(crate) const FREE: PriorSigma = PriorSigma { mm: 2000.0, rad: 3.0 };
/// A target anywhere near the flange.
const MOUNTED: PriorSigma = PriorSigma { mm: 50.0, rad: 1.0 };

/// Position of a sensor (mm, in the base).
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) enum SensorPosition {
    /// A tracker; its frame rotates about this point.
    Tracker(Vector3<f64>),
    /// Outlet of a cable.
    Outlet(Vector3<f64>),
}

/// Planned readings.
pub(crate) struct Readings<'a> {
    pub(crate) poses: &'a [Joints],
    /// Weight of each pose.
    pub(crate) weight: f64,
    pub(crate) stand: SensorPosition,
    /// Prior of the sensor's pose.
    pub(crate) stand_known: PriorSigma,
    /// Targets on the flange (mm).
    pub(crate) targets: &'a [Vector3<f64>],
    /// Standard deviation of the target positions on the flange (mm); `None` for targets anywhere.
    pub(crate) target_known_mm: Option<f64>,
    /// Standard deviation of a reading, for each coordinate (mm).
    pub(crate) sigma_mm: f64,
}

/// AᵀWA, AᵀWB and BᵀWB of readings.
pub(crate) struct NormalEquations {
    arms: DMatrix<f64>,
    mixed: DMatrix<f64>,
    owns: DMatrix<f64>,
}

impl NormalEquations {
    /// Information on the arm's parameters, given the prior standard deviations of the nuisance parameters.
    pub(crate) fn information(&self, own: &[f64]) -> DMatrix<f64> {
        let Self { arms, mixed, owns } = self;
        let mut owns = owns.clone();
        for (k, sigma) in own.iter().enumerate() {
            owns[(k, k)] += sigma.powi(-2);
        }
        match Cholesky::new(owns) {
            Some(factor) => arms - mixed * factor.solve(&mixed.transpose()),
            None => DMatrix::zeros(arms.nrows(), arms.ncols()),
        }
    }
}

impl Readings<'_> {
    /// Normal equations for the parameters of `knowledge` and the nuisance parameters.
    pub(crate) fn normal(&self, knowledge: &Estimated, arm: &PreparedModel<'_>) -> NormalEquations {
        let (parameters, own) = (knowledge.order.len(), self.own().len());
        let mut arms = DMatrix::zeros(parameters, parameters);
        let (mut mixed, mut owns) = (DMatrix::zeros(parameters, own), DMatrix::zeros(own, own));
        let weight = self.weight / (self.sigma_mm * self.sigma_mm);
        for q in self.poses {
            let flange = arm.forward(q);
            let turn = flange.rotation.to_rotation_matrix();
            for (k, target) in self.targets.iter().enumerate() {
                let point = (flange * Pose::translation(target.x, target.y, target.z)).translation.vector;
                let by_arm =
                    knowledge.position_jacobian(arm, q, &Pose::translation(target.x, target.y, target.z));
                let by_own = self.by_own(&point, turn.matrix(), k);
                let (by_arm, by_own) = match self.stand {
                    SensorPosition::Tracker(_) => (by_arm, by_own),
                    SensorPosition::Outlet(outlet) => {
                        let along = (point - outlet).normalize();
                        let along = DMatrix::from_row_slice(1, 3, along.as_slice());
                        let mut by_own = &along * by_own;
                        by_own[(0, 3)] = 1.0;
                        (along * by_arm, by_own)
                    }
                };
                arms += by_arm.tr_mul(&by_arm) * weight;
                mixed += by_arm.tr_mul(&by_own) * weight;
                owns += by_own.tr_mul(&by_own) * weight;
            }
        }
        NormalEquations { arms, mixed, owns }
    }

    /// Prior standard deviations of the nuisance parameters: six of the frame, or three of the outlet and the zero of its
    /// cable, then three per target.
    pub(crate) fn own(&self) -> Vec<f64> {
        let PriorSigma { mm, rad } = self.stand_known;
        let mut out = match self.stand {
            SensorPosition::Tracker(_) => vec![mm, mm, mm, rad, rad, rad],
            SensorPosition::Outlet(_) => vec![mm; 4],
        };
        let target = self.target_known_mm.unwrap_or(MOUNTED.mm);
        out.extend(vec![target; 3 * self.targets.len()]);
        out
    }

    /// Derivative of the position of a target by the nuisance parameters (3 × nuisance parameters).
    fn by_own(&self, point: &Vector3<f64>, turn: &Matrix3<f64>, target: usize) -> DMatrix<f64> {
        let first = match self.stand {
            SensorPosition::Tracker(_) => 6,
            SensorPosition::Outlet(_) => 4,
        };
        let mut out = DMatrix::zeros(3, first + 3 * self.targets.len());
        out.view_mut((0, 0), (3, 3)).copy_from(&-Matrix3::<f64>::identity());
        if let SensorPosition::Tracker(at) = self.stand {
            out.view_mut((0, 3), (3, 3)).copy_from(&(point - at).cross_matrix());
        }
        out.view_mut((0, first + 3 * target), (3, 3)).copy_from(turn);
        out
    }
}

/// A factor F of a covariance C = F Fᵀ; negative eigenvalues from rounding count as 0. `None` where it is not finite.
pub(crate) fn factor(covariance: &DMatrix<f64>) -> Option<DMatrix<f64>> {
    // On the correlation matrix, so that mm and rad are of comparable size.
    let scale: Vec<f64> = covariance.diagonal().iter().map(|v| v.max(0.0).sqrt()).collect();
    let unit = |k: usize| if scale[k] > 0.0 { scale[k] } else { 1.0 };
    let n = scale.len();
    let scaled = DMatrix::from_fn(n, n, |i, j| covariance[(i, j)] / (unit(i) * unit(j)));
    if !scaled.iter().all(|v| v.is_finite()) {
        return None;
    }
    let eigen = scaled.symmetric_eigen();
    Some(DMatrix::from_fn(n, n, |i, j| {
        scale[i] * eigen.eigenvectors[(i, j)] * eigen.eigenvalues[j].max(0.0).sqrt()
    }))
}

/// Covariance of T a (`seen` = T, rows × parameters) after `information` on a, where C = `factor` `factor`ᵀ before.
pub(crate) fn updated(
    factor: &DMatrix<f64>,
    information: &DMatrix<f64>,
    seen: &DMatrix<f64>,
) -> Option<DMatrix<f64>> {
    let commanded = factor.tr_mul(&(information * factor));
    let whole =
        DMatrix::identity(commanded.nrows(), commanded.ncols()) + (&commanded + commanded.transpose()) * 0.5;
    let lower = Cholesky::new(whole)?;
    let part = lower.l().solve_lower_triangular(&(seen * factor).transpose())?;
    Some(part.tr_mul(&part))
}
