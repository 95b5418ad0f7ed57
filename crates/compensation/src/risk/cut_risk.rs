//! The risk that a correction makes a cut worse than it was.
//!
//! If only the shape of a path is corrected, the residual after its best rigid registration is assessed. The probability is
//! in `probability`.

use nalgebra::{DMatrix, DVector, Matrix3xX, Vector3, Vector6};

use crate::risk::placement::{Placement, TargetDeviation};
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
    /// Predicted standard deviation of its shape, after its best rigid registration (RMS, mm).
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
    /// Twists of the best registration per unit of each parameter, in the work object, and their reference point.
    pub(crate) registered: RegisteredFrame,
}

/// Most points by which a cut is assessed.
pub(crate) const MOST_POINTS: usize = 32;

/// Assesses the points of a cut.
pub(crate) fn assess_cut(
    off: &[TargetDeviation],
    knowledge: &Estimated,
    placement: Placement,
) -> Option<Judgement> {
    let registration = Registration::of(&off.iter().map(|o| o.intended).collect::<Vec<_>>())?;
    let twists = registration.twists(off.iter().map(|o| &o.jacobian));
    let twist = registration.twist(off.iter().map(|o| &o.shift));
    let mut square = 0.0;
    let parameters = knowledge.order.len();
    let mut toward = DVector::zeros(parameters);
    let (mut shapes, mut places) =
        (StackedRows::new(off.len(), parameters), StackedRows::new(off.len(), parameters));
    for (k, point) in off.iter().enumerate() {
        let mut shape = point.jacobian.clone();
        for p in 0..shape.ncols() {
            let moved = registration.shift(&twists.column(p).into_owned(), k);
            (0..3).for_each(|i| shape[(i, p)] -= moved[i]);
        }
        let shift = match placement {
            Placement::Shape => {
                let shift = point.shift - registration.shift(&twist, k);
                toward += shape.tr_mul(&shift);
                shift
            }
            _ => {
                places.set(k, &point.jacobian);
                toward += point.jacobian.tr_mul(&point.shift);
                point.shift
            }
        };
        square += shift.norm_squared();
        shapes.set(k, &shape);
    }
    let of_shape = shapes.total_variance(&knowledge.covariance);
    let variance = match placement {
        Placement::Shape => of_shape,
        _ => places.total_variance(&knowledge.covariance),
    };
    let rms = |sum: f64| (sum.max(0.0) / off.len() as f64).sqrt();
    let registered = RegisteredFrame {
        origin_mm: registration.centre.coords,
        twists: twists.column_iter().map(|twist| twist.into_owned()).collect(),
    };
    Some(Judgement {
        deviation_mm: rms(square),
        sigma_mm: rms(variance),
        shape_sigma_mm: rms(of_shape),
        square,
        toward,
        registered,
    })
}

/// Jacobians of the points of a cut, one below the other: column-major, padded by zeros to whole groups of rows.
struct StackedRows {
    columns: Vec<f64>,
    rows: usize,
    parameters: usize,
}

impl StackedRows {
    fn new(points: usize, parameters: usize) -> Self {
        let rows = (3 * points).next_multiple_of(WIDTH);
        Self { columns: vec![0.0; rows * parameters], rows, parameters }
    }

    /// Sets the Jacobian (3 × p) of point `k`.
    fn set(&mut self, k: usize, jacobian: &Matrix3xX<f64>) {
        for (column, values) in self.columns.chunks_exact_mut(self.rows).zip(jacobian.column_iter()) {
            column[3 * k..3 * k + 3].copy_from_slice(values.as_slice());
        }
    }

    /// Σ tr(J C Jᵀ) over the points, C the covariance of the parameters (p × p): tr(C Σ JᵀJ), whose sum over rows is vectorised.
    fn total_variance(&self, covariance: &DMatrix<f64>) -> f64 {
        let p = self.parameters;
        if p == 0 {
            return 0.0;
        }
        let mut products = DMatrix::zeros(p, p);
        add_products(&self.columns, self.rows, products.as_mut_slice());
        // The lower triangle is filled.
        let mut sum = 0.0;
        for j in 0..p {
            sum += covariance[(j, j)] * products[(j, j)];
            for i in j + 1..p {
                sum += 2.0 * covariance[(i, j)] * products[(i, j)];
            }
        }
        sum
    }
}

/// The registration of a cut expressed in the base, for a stationary work object.
pub(crate) fn in_base(registered: &RegisteredFrame, base_from_object: &Pose) -> RegisteredFrame {
    let turn = base_from_object.rotation;
    RegisteredFrame {
        origin_mm: base_from_object.transform_point(&registered.origin_mm.into()).coords,
        twists: registered
            .twists
            .iter()
            .map(|t| {
                let v: Vector3<f64> = turn * t.fixed_rows::<3>(0);
                let w: Vector3<f64> = turn * t.fixed_rows::<3>(3);
                Vector6::new(v.x, v.y, v.z, w.x, w.y, w.z)
            })
            .collect(),
    }
}
