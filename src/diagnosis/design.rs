//! A fit, linearised and whitened: what a candidate adds beyond everything that is already free.
//!
//! With J the whitened Jacobian of the n scalar rows by the p free parameters and Λ their prior precisions,
//! JᵀJ + Λ = L Lᵀ and Q = J L⁻ᵀ. A candidate with columns C (n × k) has, with everything else refitted to first order, the
//! gradient g = Cᵀr and the information S = CᵀC − (QᵀC)ᵀ(QᵀC), with r the residual at the optimum. The model without some
//! of the parameters follows from the same J: their columns go, their share J x goes back into r, and the rest is solved
//! anew, r ← r − Q L⁻¹(Jᵀr + Λx).
//!
//! Source: the score test with nuisance parameters, Rao 1948; the projection is that of Frisch and Waugh.

use std::sync::Arc;

use faer::dyn_stack::{MemBuffer, MemStack};
use faer::linalg::cholesky::llt;
use faer::{Accum, MatMut, MatRef, Par};
use nalgebra::{DMatrix, DVector, Vector3};

use super::extension::{Extended, Subject};
use crate::estimation::problem::Problem;
use crate::identification::calibration::Calibration;
use crate::kinematics::parameter::{LinkCoordinate, Parameter};
use crate::measurement::dataset::{Reading, Sensor};
use crate::measurement::sensor::disturbance::sag_mm;

/// Slopes of the whitened residual by what candidates are made of, n each.
#[derive(Debug, Clone)]
pub struct Slopes {
    /// By the rotation of each joint.
    pub by_joint: Vec<DVector<f64>>,
    /// By a common relative growth of all lengths.
    pub by_growth: DVector<f64>,
    /// By the touched point on the flange, n × 3.
    pub by_tool: DMatrix<f64>,
    /// By the sensor's frame or the outlet, n × 6 or n × 3.
    pub by_frame: DMatrix<f64>,
    /// By a cable's zero; zeros for other sensors.
    pub by_zero: DVector<f64>,
    /// By the sensor's scale.
    pub by_scale: DVector<f64>,
    /// By a cable's squared weight over tension; zeros for other sensors.
    pub by_sag: DVector<f64>,
    /// What a whitened residual is worth in mm; 0 for orientations.
    pub mm: Vec<f64>,
}

/// See the module page. Scalar rows are ordered observation by observation.
#[derive(Debug, Clone)]
pub struct Design {
    /// Observations.
    pub observations: usize,
    /// Scalar rows of an observation.
    pub per: usize,
    /// Residuals at the optimum of what is free, n.
    pub residual: DVector<f64>,
    /// Q transposed, p × n.
    pub basis: Arc<DMatrix<f64>>,
    /// What was taken out of the basis again.
    pub reduction: Option<Reduction>,
    /// What candidates are made of.
    pub slopes: Arc<Slopes>,
}

/// Directions of a basis that are free no more.
#[derive(Debug, Clone)]
pub struct Reduction {
    /// U, orthonormal, p × d.
    directions: DMatrix<f64>,
    /// (Q U)ᵀ, d × n.
    pub removed: DMatrix<f64>,
    /// How far the residual moved along each.
    moved: DVector<f64>,
}

/// A fit linearised, from which the design of any smaller model follows without a refit.
#[derive(Debug, Clone)]
pub struct Linear {
    observations: usize,
    per: usize,
    jacobian: DMatrix<f64>,
    /// JᵀJ + Λ.
    normal: DMatrix<f64>,
    residual: DVector<f64>,
    x: Vec<f64>,
    precision: Vec<f64>,
    slopes: Arc<Slopes>,
}

/// A whole design with what it takes to go on from it to smaller ones.
#[derive(Debug, Clone)]
pub struct Whole {
    /// Everything free.
    pub design: Design,
    /// L.
    lower: DMatrix<f64>,
    /// The estimate after one more step.
    x: DVector<f64>,
}

/// What a candidate's columns come to against a design.
#[derive(Debug, Clone)]
pub struct Projected {
    /// Gradient, k.
    pub gradient: DVector<f64>,
    /// Information with everything else refitted, k × k.
    pub information: DMatrix<f64>,
    /// QᵀC, p × k.
    pub shared: DMatrix<f64>,
    /// The part of that along directions that are free no more, d × k.
    pub given_back: Option<DMatrix<f64>>,
}

impl Linear {
    /// Linearises a fit at its estimate.
    pub fn of(subject: &Subject<'_>, fit: &Extended) -> Self {
        let dataset = &subject.observed.dataset;
        let per = fit.task.rows_per_observation();
        let rows = fit.task.rows();
        let p = fit.parameters.len();
        let mut residual = vec![0.0; rows];
        let mut jacobian = vec![0.0; rows * p];
        fit.task.jacobian(&fit.x, 0..rows, &mut residual, &mut jacobian);
        let residual = DVector::from_vec(residual).map(finite);
        let jacobian = DMatrix::from_vec(rows, p, jacobian).map(finite);
        let precision: Vec<f64> = fit.priors.iter().map(|prior| prior.sigma.powi(-2)).collect();
        let mut normal = gram(&jacobian);
        for (k, precision) in precision.iter().enumerate() {
            normal[(k, k)] += precision;
        }
        // Slopes by what candidates are made of, at the estimate.
        let anchors = dataset.anchors();
        let mut probes: Vec<Parameter> = Vec::new();
        for coordinate in [LinkCoordinate::Theta, LinkCoordinate::A, LinkCoordinate::D] {
            probes.extend((0..6).map(|joint| Parameter::Link { joint, coordinate }));
        }
        probes.extend((0..3).map(Parameter::Tool));
        let first_frame = probes.len();
        if dataset.sensor == Sensor::Cable {
            for anchor in 0..anchors {
                probes.extend((0..3).map(|axis| Parameter::Outlet { anchor, axis }));
                probes.push(Parameter::Zero { anchor });
            }
        } else {
            probes.extend((0..6).map(Parameter::Base));
        }
        let weights: Vec<_> = fit
            .weights
            .iter()
            .zip(&fit.trust)
            .map(|(w, t)| crate::identification::calibration::Weight {
                per_mm: w.per_mm * t.sqrt(),
                per_rad: w.per_rad * t.sqrt(),
            })
            .collect();
        let task = Calibration::new(dataset, &fit.model, &fit.frames, &probes, &[], &weights);
        let (mut r, mut slopes) = (vec![0.0; rows], vec![0.0; rows * probes.len()]);
        task.jacobian(&vec![0.0; probes.len()], 0..rows, &mut r, &mut slopes);
        let column = |k: usize| DVector::from_column_slice(&slopes[k * rows..(k + 1) * rows]).map(finite);
        let mut by_growth = DVector::zeros(rows);
        for (joint, link) in fit.model.links.iter().enumerate() {
            by_growth += column(6 + joint) * link.a_mm + column(12 + joint) * link.d_mm;
        }
        let summed = |axis: usize| {
            (0..anchors).fold(DVector::zeros(rows), |sum, a| sum + column(first_frame + 4 * a + axis))
        };
        let (by_frame, by_zero) = if dataset.sensor == Sensor::Cable {
            (DMatrix::from_columns(&[summed(0), summed(1), summed(2)]), summed(3))
        } else {
            let columns: Vec<_> = (0..6).map(|k| column(first_frame + k)).collect();
            (DMatrix::from_columns(&columns), DVector::zeros(rows))
        };
        let (by_scale, by_sag) = readings(subject, fit, per, &weights);
        let mm = (0..rows)
            .map(|s| if s % per < 3 { 1.0 / weights[s / per].per_mm.max(1e-12) } else { 0.0 })
            .collect();
        let slopes = Arc::new(Slopes {
            by_joint: (0..6).map(column).collect(),
            by_growth,
            by_tool: DMatrix::from_columns(&[column(18), column(19), column(20)]),
            by_frame,
            by_zero,
            by_scale,
            by_sag,
            mm,
        });
        let observations = dataset.rows.len();
        Self { observations, per, jacobian, normal, residual, x: fit.x.clone(), precision, slopes }
    }

    /// The design of the whole fit, from which those of smaller models follow at little cost.
    pub fn whole(&self) -> Whole {
        let lower = lower_factor(self.normal.clone());
        let basis = solved(&lower, self.jacobian.transpose());
        let x = DVector::from_column_slice(&self.x);
        let mut gradient = self.jacobian.tr_mul(&self.residual);
        for (g, (x, precision)) in gradient.iter_mut().zip(self.x.iter().zip(&self.precision)) {
            *g += precision * x;
        }
        let half = lower.solve_lower_triangular(&gradient).unwrap_or_else(|| DVector::zeros(gradient.len()));
        let mut residual = self.residual.clone();
        residual.gemv_tr(-1.0, &basis, &half, 1.0);
        let step = lower.tr_solve_lower_triangular(&half).unwrap_or_else(|| DVector::zeros(half.len()));
        let design = Design {
            observations: self.observations,
            per: self.per,
            residual,
            basis: Arc::new(basis),
            reduction: None,
            slopes: Arc::clone(&self.slopes),
        };
        Whole { design, lower, x: x - step }
    }

    /// The design of the model without the parameters at `dropped`, with a basis of its own.
    pub fn design(&self, dropped: &[usize]) -> Design {
        let kept: Vec<usize> = (0..self.x.len()).filter(|k| !dropped.contains(k)).collect();
        let p = kept.len();
        let mut residual = self.residual.clone();
        for &k in dropped {
            residual.axpy(-self.x[k], &self.jacobian.column(k), 1.0);
        }
        let normal = DMatrix::from_fn(p, p, |a, b| self.normal[(kept[a], kept[b])]);
        let lower = lower_factor(normal);
        let part = self.jacobian.select_columns(&kept);
        let mut gradient = part.tr_mul(&residual);
        for (g, &k) in gradient.iter_mut().zip(&kept) {
            *g += self.precision[k] * self.x[k];
        }
        let basis = solved(&lower, part.transpose());
        let step = lower.solve_lower_triangular(&gradient).unwrap_or_else(|| DVector::zeros(p));
        residual.gemv_tr(-1.0, &basis, &step, 1.0);
        Design {
            observations: self.observations,
            per: self.per,
            residual,
            basis: Arc::new(basis),
            reduction: None,
            slopes: Arc::clone(&self.slopes),
        }
    }
}

impl Whole {
    /// The design of the model without the parameters at `dropped`, by taking directions out of the whole basis.
    ///
    /// With Z = L⁻¹E for the dropped columns E of the identity and ZᵀZ = M Mᵀ, U = Z M⁻ᵀ is orthonormal, the smaller
    /// model's projection is Q(I − UUᵀ)Qᵀ, and its residual r − QU M⁻¹x with x the dropped parameters.
    pub fn without(&self, dropped: &[usize]) -> Design {
        let (p, d) = (self.x.len(), dropped.len());
        let mut out = self.design.clone();
        if d == 0 {
            return out;
        }
        let mut picked = DMatrix::zeros(p, d);
        for (a, &k) in dropped.iter().enumerate() {
            picked[(k, a)] = 1.0;
        }
        let z = solved(&self.lower, picked);
        let m = lower_factor(gram(&z));
        let directions = solved(&m, z.transpose()).transpose();
        let taken = DVector::from_iterator(d, dropped.iter().map(|&k| self.x[k]));
        let moved = m.solve_lower_triangular(&taken).unwrap_or_else(|| DVector::zeros(d));
        let removed = product_of_transposed(&directions, &self.design.basis);
        out.residual.gemv_tr(-1.0, &removed, &moved, 1.0);
        out.reduction = Some(Reduction { directions, removed, moved });
        out
    }
}

impl Design {
    /// The design of a whole fit.
    pub fn of(subject: &Subject<'_>, fit: &Extended) -> Self {
        Linear::of(subject, fit).design(&[])
    }

    /// Columns against everything that is already free.
    pub fn project(&self, columns: &DMatrix<f64>) -> Projected {
        let shared = product(&self.basis, columns);
        let gradient = columns.tr_mul(&self.residual);
        let mut information = gram(columns) - gram(&shared);
        let given_back = self.reduction.as_ref().map(|r| product_of_transposed(&r.directions, &shared));
        if let Some(back) = &given_back {
            information += gram(back);
        }
        Projected { gradient, information, shared, given_back }
    }

    /// The same from the projection on the whole design of which this is a part.
    pub fn project_on(&self, whole: &Projected) -> Projected {
        let mut out = whole.clone();
        if let Some(reduction) = &self.reduction {
            let back = product_of_transposed(&reduction.directions, &whole.shared);
            out.information += gram(&back);
            out.gradient.gemv_tr(-1.0, &back, &reduction.moved, 1.0);
            out.given_back = Some(back);
        }
        out
    }

    /// What is left of columns when everything free has been fitted to them, n × k.
    pub fn pure(&self, columns: &DMatrix<f64>, projected: &Projected) -> DMatrix<f64> {
        let mut out = columns.clone();
        for a in 0..columns.ncols() {
            // Row by row: a product of matrices would pack the whole basis for a few columns.
            let shared = projected.shared.column(a);
            for (place, q) in out.column_mut(a).iter_mut().zip(self.basis.column_iter()) {
                *place -= q.dot(&shared);
            }
            if let (Some(reduction), Some(back)) = (&self.reduction, &projected.given_back) {
                let back = back.column(a);
                for (place, q) in out.column_mut(a).iter_mut().zip(reduction.removed.column_iter()) {
                    *place += q.dot(&back);
                }
            }
        }
        out
    }

    /// Scalar rows.
    pub fn rows(&self) -> usize {
        self.residual.len()
    }
}

/// Replaces a positive definite matrix by its lower Cholesky factor; `false` for one that is not.
pub(super) fn factored(a: &mut DMatrix<f64>) -> bool {
    let n = a.nrows();
    let request = llt::factor::cholesky_in_place_scratch::<f64>(n, Par::Seq, Default::default());
    let mut memory = MemBuffer::new(request);
    let place = MatMut::from_column_major_slice_mut(a.as_mut_slice(), n, n);
    let done = llt::factor::cholesky_in_place(
        place,
        Default::default(),
        Par::Seq,
        MemStack::new(&mut memory),
        Default::default(),
    );
    a.fill_upper_triangle(0.0, 1);
    done.is_ok() && a.diagonal().iter().all(|d| *d > 0.0)
}

/// Solves L Lᵀ x = b.
pub(super) fn back_and_forth(lower: &DMatrix<f64>, b: &DVector<f64>) -> Option<DVector<f64>> {
    lower.tr_solve_lower_triangular(&lower.solve_lower_triangular(b)?)
}

/// AᵀA.
pub(super) fn gram(a: &DMatrix<f64>) -> DMatrix<f64> {
    multiplied(shown(a).transpose(), shown(a))
}

/// A B.
pub(super) fn product(a: &DMatrix<f64>, b: &DMatrix<f64>) -> DMatrix<f64> {
    multiplied(shown(a), shown(b))
}

/// Aᵀ B.
pub(super) fn product_of_transposed(a: &DMatrix<f64>, b: &DMatrix<f64>) -> DMatrix<f64> {
    multiplied(shown(a).transpose(), shown(b))
}

/// A Aᵀ.
pub(super) fn outer(a: &DMatrix<f64>) -> DMatrix<f64> {
    multiplied(shown(a), shown(a).transpose())
}

fn shown(a: &DMatrix<f64>) -> MatRef<'_, f64> {
    MatRef::from_column_major_slice(a.as_slice(), a.nrows(), a.ncols())
}

/// On one thread, so that the bits are the same for any number of them.
fn multiplied(a: MatRef<'_, f64>, b: MatRef<'_, f64>) -> DMatrix<f64> {
    let mut out = DMatrix::zeros(a.nrows(), b.ncols());
    let (rows, columns) = out.shape();
    let place = MatMut::from_column_major_slice_mut(out.as_mut_slice(), rows, columns);
    faer::linalg::matmul::matmul(place, Accum::Replace, a, b, 1.0, Par::Seq);
    out
}

/// L⁻¹ B.
fn solved(lower: &DMatrix<f64>, mut b: DMatrix<f64>) -> DMatrix<f64> {
    let n = lower.nrows();
    let (rows, columns) = b.shape();
    let left = MatRef::from_column_major_slice(lower.as_slice(), n, n);
    let place = MatMut::from_column_major_slice_mut(b.as_mut_slice(), rows, columns);
    faer::linalg::triangular_solve::solve_lower_triangular_in_place(left, place, Par::Seq);
    b.apply(|v| *v = finite(*v));
    b
}

fn finite(v: f64) -> f64 {
    if v.is_finite() { v } else { 0.0 }
}

/// Lower Cholesky factor; a matrix that is not positive definite gets a growing ridge.
fn lower_factor(normal: DMatrix<f64>) -> DMatrix<f64> {
    let n = normal.nrows();
    let mut ridge = 0.0;
    for _ in 0..12 {
        let mut shifted = normal.clone();
        for k in 0..n {
            shifted[(k, k)] += ridge * normal[(k, k)].abs().max(f64::MIN_POSITIVE);
        }
        if factored(&mut shifted) {
            return shifted;
        }
        ridge = if ridge == 0.0 { 1e-14 } else { ridge * 10.0 };
    }
    DMatrix::identity(n, n)
}

/// Slopes by the sensor's scale and by a cable's sag.
fn readings(
    subject: &Subject<'_>,
    fit: &Extended,
    per: usize,
    weights: &[crate::identification::calibration::Weight],
) -> (DVector<f64>, DVector<f64>) {
    let dataset = &subject.observed.dataset;
    let rows = dataset.rows.len() * per;
    let (mut scale, mut sag) = (DVector::zeros(rows), DVector::zeros(rows));
    let origin = fit.frames.base_from_sensor.translation.vector;
    let touched = nalgebra::Point3::from(fit.frames.flange_from_target.translation.vector);
    for (i, row) in dataset.rows.iter().enumerate() {
        let w = weights[i].per_mm;
        // Where the model sees the point, not where the reading has it: noise is no evidence of a scale.
        let at = (fit.model.forward(&row.joints, &row.condition) * touched).coords;
        match row.reading {
            Reading::Cable(_) => {
                let away = at - fit.frames.outlets_mm[row.anchor];
                scale[i] = w * finite(away.norm() + fit.frames.zeros_mm[row.anchor]);
                sag[i] = w * finite(sag_mm(1.0, &away));
            }
            Reading::Position(_) | Reading::Pose(_) => space(&mut scale, i * per, w, at - origin),
        }
    }
    (scale, sag)
}

fn space(scale: &mut DVector<f64>, at: usize, w: f64, seen: Vector3<f64>) {
    for k in 0..3 {
        scale[at + k] = -w * finite(seen[k]);
    }
}
