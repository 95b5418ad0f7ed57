//! One damped step of a linearised problem, with preallocated memory.
//!
//! In scaled parameters z = D x the model of the cost is c + γᵀs + ½ sᵀSs with γ = D⁻¹g and S = D⁻¹AD⁻¹, whose
//! diagonal is 1 where D is fresh. The step solves (S + μI) s = −γ; the parameters move by h = D⁻¹s. μ is thus
//! a pure number, whatever the units of the parameters.

use faer::dyn_stack::{MemBuffer, MemStack};
use faer::linalg::cholesky::llt;
use faer::prelude::*;
use faer::{Mat, MatMut, MatRef, Par};
use nalgebra::DMatrix;

use crate::least_squares::Factorisation;
use crate::least_squares::triangular::TriangularFactor;
use crate::objective::{Objective, is_finite};
use crate::problem::NormalEquations;

/// A problem linearised at a point, priors included.
pub(crate) enum Linearisation {
    Normal(NormalEquations),
    Factor(TriangularFactor),
}

impl Linearisation {
    pub(crate) fn at(objective: &mut Objective<'_>, x: &[f64], factorisation: Factorisation) -> Self {
        match factorisation {
            Factorisation::Cholesky => Self::Normal(objective.normal_equations(x)),
            Factorisation::Qr => Self::Factor(TriangularFactor::of_objective(objective, x)),
        }
    }

    pub(crate) fn cost(&self) -> f64 {
        match self {
            Self::Normal(equations) => equations.cost,
            Self::Factor(factor) => factor.cost(),
        }
    }

    pub(crate) fn is_finite(&self) -> bool {
        match self {
            Self::Normal(equations) => is_finite(equations),
            Self::Factor(factor) => factor.is_finite(),
        }
    }

    fn column_norm(&self, k: usize) -> f64 {
        match self {
            Self::Normal(equations) => equations.matrix[(k, k)].max(0.0).sqrt(),
            Self::Factor(factor) => factor.r.column(k).norm(),
        }
    }

    fn gradient(&self, k: usize) -> f64 {
        match self {
            Self::Normal(equations) => equations.gradient[k],
            Self::Factor(factor) => factor.r.column(k).dot(&factor.rhs),
        }
    }

    /// The inverse of the undamped normal matrix, or `None` where it is singular to working precision.
    pub(crate) fn covariance(&self) -> Option<DMatrix<f64>> {
        match self {
            Self::Normal(equations) => inverse_of_normal(&equations.matrix),
            Self::Factor(factor) => factor.covariance(),
        }
    }
}

/// Prediction for a step.
#[derive(Debug, Clone, Copy)]
pub(crate) struct PredictedReduction {
    /// Reduction of the cost that the undamped quadratic model predicts.
    pub(crate) reduction: f64,
    /// ‖s‖ = ‖D h‖.
    pub(crate) step_norm: f64,
}

pub(crate) struct DampedSystem {
    p: usize,
    /// D: the largest column norms so far (Moré 1978), 0 for a column that has always been zero.
    scale: Vec<f64>,
    /// Whether D is the identity throughout, as in the printed methods.
    unscaled: bool,
    /// Diagonal of S, to which pivots are compared: 1 where the column has its largest norm so far.
    diagonal: Vec<f64>,
    gradient: Vec<f64>,
    factor: Vec<f64>,
    step: Vec<f64>,
    memory: MemBuffer,
}

/// A pivot (squared length of the remainder of a unit column) below this means that the column depends on the others.
fn negligible_pivot(p: usize) -> f64 {
    64.0 * p as f64 * f64::EPSILON
}

/// Additional damping of a singular system, relative to the diagonal, so that a step is finite along its null space.
const SINGULAR_DAMPING: f64 = 1e-9;

impl DampedSystem {
    pub(crate) fn new(p: usize) -> Self {
        let request = llt::factor::cholesky_in_place_scratch::<f64>(p, Par::Seq, Default::default());
        Self {
            p,
            scale: vec![0.0; p],
            unscaled: false,
            diagonal: vec![1.0; p],
            gradient: vec![0.0; p],
            factor: vec![0.0; p * p],
            step: vec![0.0; p],
            memory: MemBuffer::new(request),
        }
    }

    /// D = I: μ then has the unit of JᵀJ.
    pub(crate) fn unscaled(p: usize) -> Self {
        Self { scale: vec![1.0; p], unscaled: true, ..Self::new(p) }
    }

    /// Sets scale and gradient of a new point. Returns the largest cosine between the residual vector and a column of the
    /// Jacobian: 0 at a stationary point.
    pub(crate) fn enter(&mut self, at: &Linearisation) -> f64 {
        let length = (2.0 * at.cost()).sqrt();
        let mut cosine = 0.0_f64;
        for k in 0..self.p {
            let norm = at.column_norm(k);
            if !self.unscaled {
                self.scale[k] = self.scale[k].max(norm);
                self.diagonal[k] = if norm > 0.0 { (norm / self.scale[k]).powi(2) } else { 1.0 };
            }
            let g = at.gradient(k);
            self.gradient[k] = if self.scale[k] > 0.0 { g / self.scale[k] } else { 0.0 };
            if norm > 0.0 && length > 0.0 {
                cosine = cosine.max(g.abs() / (norm * length));
            }
        }
        cosine
    }

    /// ‖D x‖.
    pub(crate) fn scaled_norm(&self, x: &[f64]) -> f64 {
        self.scale.iter().zip(x).map(|(d, x)| (d * x).powi(2)).sum::<f64>().sqrt()
    }

    /// Writes x + h into `trial` for the damping `mu`; `None` if the system has no finite solution.
    pub(crate) fn step(
        &mut self,
        at: &Linearisation,
        mu: f64,
        x: &[f64],
        trial: &mut [f64],
    ) -> Option<PredictedReduction> {
        match at {
            Linearisation::Normal(equations) => self.solve_normal(equations, mu)?,
            Linearisation::Factor(factor) => self.solve_factor(factor, mu),
        }
        let (mut descent, mut square) = (0.0, 0.0);
        for k in 0..self.p {
            let (s, d) = (self.step[k], self.scale[k]);
            trial[k] = if d > 0.0 { x[k] + s / d } else { x[k] };
            descent -= self.gradient[k] * s;
            square += s * s;
        }
        // c(0) − c(s) = −γᵀs − ½ sᵀSs = ½ sᵀ(μs − γ), since Ss = −γ − μs.
        let reduction = 0.5 * (mu * square + descent);
        let finite = reduction.is_finite() && trial.iter().all(|x| x.is_finite());
        finite.then(|| PredictedReduction { reduction, step_norm: square.sqrt() })
    }

    /// Moves `x`, which is not the current point, by the damped step of its own linearisation `at`, in the scale of the current point;
    /// `false` if the system has no finite solution.
    pub(crate) fn correct(&mut self, at: &Linearisation, mu: f64, x: &mut [f64]) -> bool {
        let own = |k: usize| if self.scale[k] > 0.0 { at.gradient(k) / self.scale[k] } else { 0.0 };
        let foreign = (0..self.p).map(own).collect();
        let current = std::mem::replace(&mut self.gradient, foreign);
        let from = x.to_vec();
        let found = self.step(at, mu, &from, x).is_some();
        self.gradient = current;
        found
    }

    fn solve_normal(&mut self, equations: &NormalEquations, mu: f64) -> Option<()> {
        let enough = negligible_pivot(self.p);
        let regular = |smallest: f64| smallest >= enough;
        if !self.factorise(equations, mu, 0.0).is_some_and(regular) {
            if self.unscaled {
                return None;
            }
            self.factorise(equations, mu, SINGULAR_DAMPING)?;
        }
        self.step.iter_mut().zip(&self.gradient).for_each(|(s, g)| *s = -g);
        let p = self.p;
        llt::solve::solve_in_place(
            MatRef::from_column_major_slice(&self.factor, p, p),
            MatMut::from_column_major_slice_mut(&mut self.step, p, 1),
            Par::Seq,
            MemStack::new(&mut self.memory),
        );
        Some(())
    }

    /// Cholesky factor of S + μI + extra · diag S; returns its smallest squared pivot relative to the diagonal (without
    /// μ), `None` if it is not positive definite.
    fn factorise(&mut self, equations: &NormalEquations, mu: f64, extra: f64) -> Option<f64> {
        let p = self.p;
        for j in 0..p {
            let column = &mut self.factor[j * p..(j + 1) * p];
            let dj = self.scale[j];
            if dj == 0.0 {
                column[j..].fill(0.0);
                column[j] = 1.0;
                continue;
            }
            for (i, (entry, di)) in column.iter_mut().zip(&self.scale).enumerate().skip(j) {
                *entry = if *di > 0.0 { equations.matrix[(i, j)] / (di * dj) } else { 0.0 };
            }
            column[j] += mu + extra * self.diagonal[j];
        }
        llt::factor::cholesky_in_place(
            MatMut::from_column_major_slice_mut(&mut self.factor, p, p),
            Default::default(),
            Par::Seq,
            MemStack::new(&mut self.memory),
            Default::default(),
        )
        .ok()?;
        Some(self.smallest_pivot(mu, |k| self.factor[k * p + k]))
    }

    /// Without scaling μ is set by the user only, and no pivot counts as negligible.
    fn smallest_pivot(&self, mu: f64, pivot: impl Fn(usize) -> f64) -> f64 {
        if self.unscaled || mu >= SINGULAR_DAMPING {
            return 1.0;
        }
        let relative = |k: usize| (pivot(k).powi(2) - mu) / self.diagonal[k];
        (0..self.p).filter(|k| self.scale[*k] > 0.0).map(relative).fold(1.0, f64::min)
    }

    /// min ‖[R D⁻¹; √μ I] s + [c; 0]‖ by one more QR of 2p rows.
    fn solve_factor(&mut self, factor: &TriangularFactor, mu: f64) {
        let p = self.p;
        if p == 0 {
            return;
        }
        let (scale, diagonal) = (&self.scale, &self.diagonal);
        let stacked = |extra: f64| {
            let entry = |i: usize, j: usize| match (i < p, j < p) {
                (true, true) if scale[j] > 0.0 => factor.r[(i, j)] / scale[j],
                (true, false) => -factor.rhs[i],
                (false, true) if i - p == j && scale[j] > 0.0 => (mu + extra * diagonal[j]).sqrt(),
                (false, true) if i - p == j => 1.0,
                _ => 0.0,
            };
            Mat::<f64>::from_fn(2 * p, p + 1, entry).qr()
        };
        let mut qr = stacked(0.0);
        // QR determines a pivot to ε, not to √ε: its square is compared with ε².
        if self.smallest_pivot(mu, |k| qr.thin_R()[(k, k)]) < negligible_pivot(p).powi(2) {
            qr = stacked(SINGULAR_DAMPING);
        }
        let r = qr.thin_R();
        for i in (0..p).rev() {
            let sum: f64 = (i + 1..p).map(|j| r[(i, j)] * self.step[j]).sum();
            self.step[i] = (r[(i, p)] - sum) / r[(i, i)];
        }
    }
}

/// Inverse of a symmetric positive definite matrix given by its lower triangle; `None` where it is singular.
pub(crate) fn inverse_of_normal(matrix: &DMatrix<f64>) -> Option<DMatrix<f64>> {
    let p = matrix.nrows();
    let scale: Vec<f64> = (0..p).map(|k| matrix[(k, k)].sqrt()).collect();
    if !scale.iter().all(|d| *d > 0.0 && d.is_finite()) {
        return None;
    }
    let scaled = Mat::<f64>::from_fn(p, p, |i, j| matrix[(i.max(j), i.min(j))] / (scale[i] * scale[j]));
    let factor = scaled.llt(faer::Side::Lower).ok()?;
    let smallest = (0..p).map(|k| factor.L()[(k, k)].powi(2)).fold(f64::INFINITY, f64::min);
    if smallest < negligible_pivot(p) {
        return None;
    }
    let mut inverse = Mat::<f64>::identity(p, p);
    factor.solve_in_place(inverse.as_mut());
    let entry = |i: usize, j: usize| 0.5 * (inverse[(i, j)] + inverse[(j, i)]) / (scale[i] * scale[j]);
    let out = DMatrix::from_fn(p, p, entry);
    out.iter().all(|v| v.is_finite()).then_some(out)
}
