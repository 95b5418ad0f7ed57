//! Held-out errors to first order: the rows of each fold are subtracted from the normal matrix, and the rest is solved again.
//!
//! With J the whitened Jacobian, N = JᵀJ + Λ and g = Jᵀr + Λx, a fold with rows t leaves N − JₜᵀJₜ and g − Jₜᵀrₜ. A candidate
//! with columns C and size precisions S borders that by X = L⁻¹(JᵀC − JₜᵀCₜ), L the factor of the fold's normal matrix, so each
//! candidate costs a few products, not another factorisation. A model without some parameters uses the remaining part of N, with
//! the J x of the dropped ones added back to r.
//!
//! Shapes: p parameters, n scalar rows, m of them in a fold, k columns of a candidate. Checked against refits of every fold.

use nalgebra::{DMatrix, DVector};
use rayon::prelude::*;

use super::algebra::{factored, gram, outer, product, solved};
use super::design::Linear;
use crate::measurement::split::Split;
use truegrind_math::statistics::ErrorSummary;
use truegrind_math::work::checkpoint;

/// One fold.
#[derive(Debug, Clone)]
struct Fold {
    /// Held-out scalar rows, by whole observations: the test rows, then the purged rows.
    out: Vec<usize>,
    /// Number of test rows among them.
    judged: usize,
    /// Jₜᵀ, p × m.
    rows: DMatrix<f64>,
    /// JₜᵀJₜ.
    square: DMatrix<f64>,
}

/// Cross-validation of one linearised fit.
#[derive(Debug, Clone)]
pub struct FoldErrors<'a> {
    linear: &'a Linear,
    folds: Vec<Fold>,
}

/// A fold's normal matrix, factored, and L⁻¹ of its gradient.
type Factored = Option<(DMatrix<f64>, DVector<f64>)>;

/// Cross-validation of the model without some of its parameters.
#[derive(Debug, Clone)]
pub struct Reduced<'a> {
    held: &'a FoldErrors<'a>,
    kept: Vec<usize>,
    residual: DVector<f64>,
    solved: Vec<Factored>,
}

/// Columns of an added candidate with the prior standard deviations of its parameters.
pub type Added<'a> = Option<(&'a DMatrix<f64>, &'a [f64])>;

impl<'a> FoldErrors<'a> {
    /// Prepares the folds `splits` (in observations) of the fit `linear`.
    pub fn of(linear: &'a Linear, splits: &[Split]) -> Self {
        let per = linear.per;
        let folds = splits
            .par_iter()
            .map(|split| {
                checkpoint();
                let further = neither(split, linear.observations);
                let observations = split.test.iter().chain(&further);
                let out: Vec<usize> = observations.flat_map(|&i| i * per..(i + 1) * per).collect();
                let rows = linear.rows.select_columns(&out);
                let square = outer(&rows);
                Fold { out, judged: split.test.len() * per, rows, square }
            })
            .collect();
        Self { linear, folds }
    }

    /// The model without the parameters at `dropped`.
    pub fn without(&'a self, dropped: &[usize]) -> Reduced<'a> {
        let linear = self.linear;
        let kept: Vec<usize> = (0..linear.x.len()).filter(|k| !dropped.contains(k)).collect();
        let residual = linear.without(dropped);
        let gradient = if dropped.is_empty() {
            linear.gradient.clone()
        } else {
            let pulled = &linear.rows * &residual;
            DVector::from_iterator(
                kept.len(),
                kept.iter().map(|&k| pulled[k] + linear.precision[k] * linear.x[k]),
            )
        };
        let whole = linear.normal();
        let solved = self
            .folds
            .par_iter()
            .map(|fold| {
                checkpoint();
                let p = kept.len();
                let mut normal = DMatrix::zeros(p, p);
                for (b, &to) in kept.iter().enumerate() {
                    for (a, &from) in kept.iter().enumerate().skip(b) {
                        normal[(a, b)] = whole[(from, to)] - fold.square[(from, to)];
                    }
                    normal[(b, b)] *= 1.0 + 1e-12;
                }
                let own = &fold.rows * picked(&residual, &fold.out);
                let left =
                    DVector::from_iterator(p, kept.iter().enumerate().map(|(a, &k)| gradient[a] - own[k]));
                // Only the lower triangle is read.
                factored(&mut normal).then_some(())?;
                let half = normal.solve_lower_triangular(&left)?;
                Some((normal, half))
            })
            .collect();
        Reduced { held: self, kept, residual, solved }
    }
}

/// Purged rows, which neither train nor test.
pub(super) fn neither(split: &Split, rows: usize) -> Vec<usize> {
    let mut met = vec![false; rows];
    split.train.iter().chain(&split.test).for_each(|&i| met[i] = true);
    (0..rows).filter(|&i| !met[i]).collect()
}

fn picked(all: &DVector<f64>, indices: &[usize]) -> DVector<f64> {
    DVector::from_iterator(indices.len(), indices.iter().map(|&s| all[s]))
}

impl Reduced<'_> {
    /// Sum of squares of the whitened held-out residuals.
    pub fn squares(&self, added: Added<'_>) -> f64 {
        let parts = self.held.folds.iter().zip(self.residuals(added));
        parts.map(|(fold, r)| r.rows(0, fold.judged).norm_squared()).sum()
    }

    /// Root mean square of [`Reduced::errors_mm`].
    pub fn rmse_mm(&self, added: Added<'_>, set_aside: &[usize]) -> f64 {
        ErrorSummary::of(self.errors_mm(added, set_aside)).rmse
    }

    /// Sizes of the held-out position errors (mm), fold by fold, without observations in `set_aside`.
    pub fn errors_mm(&self, added: Added<'_>, set_aside: &[usize]) -> Vec<f64> {
        let (per, mm) = (self.held.linear.per, &self.held.linear.slopes.mm);
        let mut errors = Vec::new();
        for (fold, residuals) in self.held.folds.iter().zip(self.residuals(added)) {
            for (scalars, r) in fold.out[..fold.judged].chunks(per).zip(residuals.as_slice().chunks(per)) {
                if !set_aside.contains(&(scalars[0] / per)) {
                    let lengths = scalars.iter().zip(r).filter(|(s, _)| mm[**s] > 0.0);
                    let square = lengths.map(|(&s, r)| (r * mm[s]).powi(2));
                    errors.push(square.sum::<f64>().sqrt());
                }
            }
        }
        errors
    }

    /// Whitened held-out residuals, fold by fold, with everything refitted in every fold to first order.
    fn residuals(&self, added: Added<'_>) -> Vec<DVector<f64>> {
        let linear = self.held.linear;
        let whole = added.map(|(columns, _)| {
            let shared = product(&linear.rows, columns);
            (shared, gram(columns), columns.tr_mul(&self.residual))
        });
        self.held
            .folds
            .par_iter()
            .zip(&self.solved)
            .map(|(fold, solved)| {
                checkpoint();
                let residual = picked(&self.residual, &fold.out);
                let unknown = || DVector::from_element(fold.out.len(), f64::INFINITY);
                let Some((lower, half)) = solved else { return unknown() };
                let (mut half, mut moved) = (half.clone(), residual.clone());
                if let (Some((columns, sizes)), Some((shared, square, gradient))) = (added, &whole) {
                    let own = columns.select_rows(&fold.out);
                    let Some((border, size)) = self.bordered(
                        fold,
                        lower,
                        &half,
                        (shared, square, gradient),
                        (&own, sizes, &residual),
                    ) else {
                        return unknown();
                    };
                    half.gemv(1.0, &border, &size, 1.0);
                    moved.gemv(1.0, &own, &size, 1.0);
                }
                let Some(step) = lower.tr_solve_lower_triangular(&half) else {
                    return unknown();
                };
                let mut full = DVector::zeros(linear.x.len());
                self.kept.iter().zip(step.iter()).for_each(|(&k, s)| full[k] = -s);
                moved.gemv_tr(1.0, &fold.rows, &full, 1.0);
                moved
            })
            .collect()
    }

    /// X of a candidate in a fold, and its estimate there.
    fn bordered(
        &self,
        fold: &Fold,
        lower: &DMatrix<f64>,
        half: &DVector<f64>,
        (shared, square, gradient): (&DMatrix<f64>, &DMatrix<f64>, &DVector<f64>),
        (own, sizes, residual): (&DMatrix<f64>, &[f64], &DVector<f64>),
    ) -> Option<(DMatrix<f64>, DVector<f64>)> {
        let cross = (shared - product(&fold.rows, own)).select_rows(&self.kept);
        let border = solved(lower, cross);
        let mut left = square - gram(own) - gram(&border);
        for (k, size) in sizes.iter().enumerate() {
            left[(k, k)] = (left[(k, k)] + size.powi(-2)) * (1.0 + 1e-12);
        }
        let slope = gradient - own.tr_mul(residual) - border.tr_mul(half);
        let size = left.cholesky()?.solve(&slope);
        Some((border, -size))
    }
}
