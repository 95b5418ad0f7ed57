//! The risk that a correction makes a cut worse than it was.
//!
//! If only the shape is corrected, what the best rigid registration of the path over the whole part leaves of the cut is assessed: so it is
//! written. The probability is in `probability`.

use nalgebra::{DMatrix, DVector, Matrix6xX, Vector3, Vector6};

use crate::risk::beyond_noise::{CutErrors, RegisteredErrors};
use crate::risk::placement::{PathDeviation, Placement};
use crate::risk::registration::Registration;
use truegrind_arm::estimated::{Estimated, RegisteredFrame};
use truegrind_math::gram::add_products;
use truegrind_math::lanes::WIDTH;
use truegrind_math::se3::Pose;

/// Risk assessment of one cut.
#[derive(Debug, Clone, PartialEq)]
pub struct CutRisk {
    /// Its motions, by index, in order.
    pub motions: Vec<u32>,
    /// Whether its shape was assessed, or its position too.
    pub assessed: Placement,
    /// Deviation in the original program (RMS, mm).
    pub deviation_mm: f64,
    /// Predicted standard deviation of its correction (RMS, mm).
    pub sigma_mm: f64,
    /// Predicted standard deviation of its shape, after the best rigid registration of all cuts on the part (RMS, mm).
    pub shape_sigma_mm: f64,
    /// Probability that the correction makes it worse.
    pub probability_of_harm: f64,
    /// Whether it remains unmodified because of that.
    pub left_for_risk: bool,
    /// Whether it is rewritten, or with [`Cuts::Partial`](crate::cut::Cuts::Partial) a part of it. A cut of low risk can
    /// remain unmodified for another reason, which its motions state.
    pub corrected: bool,
}

/// An assessed cut.
pub(crate) struct Judgement {
    pub(crate) deviation_mm: f64,
    pub(crate) sigma_mm: f64,
    pub(crate) shape_sigma_mm: f64,
    /// |d|² (mm²), and Jᵀ d: summed over cuts they assess the program.
    pub(crate) square: f64,
    pub(crate) toward: DVector<f64>,
    /// Variance of d·e by the errors e beyond the noise (mm⁴).
    pub(crate) beyond: f64,
    /// What of σ the measurement did not show.
    pub(crate) unseen: UnseenShare,
}

/// What of a σ comes from parameters of which the measurement showed less than half.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct UnseenShare {
    /// σ as a whole (RMS, mm).
    pub(crate) sigma_mm: f64,
    /// By those parameters (RMS, mm).
    pub(crate) unseen_mm: f64,
    /// The one of them that contributes most, as an index into the order of the parameters.
    pub(crate) parameter: Option<usize>,
}

impl UnseenShare {
    /// Whether more than half of the variance was not seen.
    pub(crate) fn prevails(&self) -> bool {
        2.0 * self.unseen_mm.powi(2) > self.sigma_mm.powi(2)
    }
}

/// Most points by which a cut is assessed.
pub(crate) const MAX_POINTS: usize = 32;

/// The best registration of the path over a part, the reference of its shape.
pub(crate) struct PartRegistration<'r> {
    pub(crate) registration: &'r Registration,
    /// Its twists per unit of each parameter.
    pub(crate) twists: &'r Matrix6xX<f64>,
    /// How it follows the errors beyond the noise.
    pub(crate) errors: Option<&'r RegisteredErrors>,
}

/// Assesses the points of a cut on a part, whose work object is displaced already where its shape alone is corrected.
pub(crate) fn assess_cut(
    off: &PathDeviation,
    part: &PartRegistration<'_>,
    knowledge: &Estimated,
    unseen: &[bool],
    placement: Placement,
) -> Judgement {
    let count = off.shifts.len();
    let mut shape_jacobian = off.jacobian.clone();
    for (mut column, twist) in shape_jacobian.column_iter_mut().zip(part.twists.column_iter()) {
        let twist = twist.into_owned();
        let velocities = column.as_mut_slice().as_chunks_mut().0.iter_mut();
        for (velocity, point) in velocities.zip(&off.intended) {
            *velocity = (Vector3::from(*velocity) - part.registration.shift_at(&twist, point)).into();
        }
    }
    let errors = CutErrors::of(&off.errors, &off.intended, &off.shifts, part.registration, part.errors);
    let shape = total_variance(&shape_jacobian, &knowledge.covariance, unseen);
    let of_shape = shape.total + errors.shape_square_mm2;
    let (jacobian, assessed, variance, beyond) = match placement {
        Placement::Shape => (&shape_jacobian, shape, of_shape, errors.shape_along_mm4),
        _ => {
            let whole = total_variance(&off.jacobian, &knowledge.covariance, unseen);
            (&off.jacobian, whole, whole.total + errors.square_mm2, errors.along_mm4)
        }
    };
    let square = off.shifts.iter().map(Vector3::norm_squared).sum();
    let toward = |column: &[f64]| -> f64 {
        let velocities = column.as_chunks().0.iter();
        velocities.zip(&off.shifts).map(|(velocity, shift)| Vector3::from(*velocity).dot(shift)).sum()
    };
    let columns = jacobian.column_iter().map(|column| toward(column.as_slice()));
    let toward = DVector::from_iterator(jacobian.ncols(), columns);
    let rms = |sum: f64| (sum.max(0.0) / count as f64).sqrt();
    Judgement {
        deviation_mm: rms(square),
        sigma_mm: rms(variance),
        shape_sigma_mm: rms(of_shape),
        square,
        toward,
        beyond,
        unseen: UnseenShare {
            sigma_mm: rms(variance),
            unseen_mm: rms(assessed.unseen),
            parameter: assessed.least_seen,
        },
    }
}

/// Σ tr(J C Jᵀ) over points (mm²).
#[derive(Debug, Clone, Copy, Default)]
struct TotalVariance {
    total: f64,
    /// By the parameters that the measurement did not show.
    unseen: f64,
    /// The one of them that contributes most.
    least_seen: Option<usize>,
}

/// Σ tr(J C Jᵀ) over the points, whose Jacobians J are stacked (3 n × p), C the covariance of the parameters (p × p):
/// tr(C Σ JᵀJ), whose sum over rows is vectorised. `unseen`: by parameter.
fn total_variance(jacobian: &DMatrix<f64>, covariance: &DMatrix<f64>, unseen: &[bool]) -> TotalVariance {
    let p = jacobian.ncols();
    if p == 0 {
        return TotalVariance::default();
    }
    // Padded by zeros to whole groups of rows.
    let rows = jacobian.nrows().next_multiple_of(WIDTH);
    let padded;
    let columns = if rows == jacobian.nrows() {
        jacobian
    } else {
        padded = jacobian.clone().resize_vertically(rows, 0.0);
        &padded
    };
    let mut products = DMatrix::zeros(p, p);
    add_products(columns.as_slice(), rows, products.as_mut_slice());
    // The lower triangle is filled.
    let (mut out, mut most) = (TotalVariance::default(), 0.0);
    for j in 0..p {
        let own = covariance[(j, j)] * products[(j, j)];
        out.total += own;
        if unseen[j] {
            out.unseen += own;
            if own > most {
                (out.least_seen, most) = (Some(j), own);
            }
        }
        for i in j + 1..p {
            let mixed = 2.0 * covariance[(i, j)] * products[(i, j)];
            out.total += mixed;
            if unseen[i] && unseen[j] {
                out.unseen += mixed;
            }
        }
    }
    out
}

/// The registration of a part expressed in the base, for a stationary work object. Where that was taught, the registration is relative to
/// the taught frame, which moves with the arm's parameters itself.
pub(crate) fn in_base(
    mut registered: RegisteredFrame,
    base_from_object: &Pose,
    taught: Option<&RegisteredFrame>,
) -> RegisteredFrame {
    let turn = base_from_object.rotation;
    registered.origin_mm = base_from_object.transform_point(&registered.origin_mm.into()).coords;
    for t in &mut registered.twists {
        let v: Vector3<f64> = turn * t.fixed_rows::<3>(0);
        let w: Vector3<f64> = turn * t.fixed_rows::<3>(3);
        *t = Vector6::new(v.x, v.y, v.z, w.x, w.y, w.z);
    }
    if let Some(taught) = taught {
        let lever = registered.origin_mm - taught.origin_mm;
        for (t, taught) in registered.twists.iter_mut().zip(&taught.twists) {
            let turn: Vector3<f64> = taught.fixed_rows::<3>(3).into_owned();
            let moved = turn.cross(&lever);
            *t += taught + Vector6::new(moved.x, moved.y, moved.z, 0.0, 0.0, 0.0);
        }
    }
    registered
}
