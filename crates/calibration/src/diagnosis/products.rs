//! A linearised fit, the functions of a discrepancy and the columns of causes, whitened for one serial correlation, with all their
//! products. The fit without some parameters, and with functions of other sizes, then takes small matrices; only its residuals
//! take a pass over the rows.
//!
//! With N = JᵀJ + Λ of the parameters that are kept, N = L Lᵀ, and C the columns of functions: the parameters change by
//! Δ = −N⁻¹(Jᵀr + Λx) once those that are dropped are taken out of r, and the projected functions have the information
//! CᵀC − SᵀS with S = L⁻¹JᵀC, and the gradient Cᵀr + CᵀJ Δ.

use std::ops::Range;

use nalgebra::{DMatrix, DVector};
use rayon::prelude::*;

use super::algebra::{back_and_forth, gram, lower_factor, product, product_of_transposed, solved};
use super::design::{Linear, side_by_side};
use super::serial_correlation::prewhiten;

/// What is multiplied, as in the fit, and its products for the last correlation that was asked for.
pub(super) struct Whitening<'a> {
    /// The linearised fit.
    pub(super) linear: &'a Linear,
    /// The functions of the discrepancy, n × m.
    pub(super) functions: &'a DMatrix<f64>,
    /// The columns of each cause, n × k.
    pub(super) own: Vec<&'a DMatrix<f64>>,
    /// Row numbers of the observations.
    pub(super) numbers: &'a [usize],
    products: Option<Products>,
}

impl<'a> Whitening<'a> {
    /// Nothing is multiplied yet.
    pub(super) fn new(
        linear: &'a Linear,
        functions: &'a DMatrix<f64>,
        own: Vec<&'a DMatrix<f64>>,
        numbers: &'a [usize],
    ) -> Self {
        Self { linear, functions, own, numbers, products: None }
    }

    /// The products for a lag-one correlation of `rho`.
    pub(super) fn at(&mut self, rho: f64) -> &Products {
        let known = self.products.take().filter(|products| products.rho == rho);
        let products = known.unwrap_or_else(|| Products::of(self, rho));
        self.products.insert(products)
    }
}

/// Products for one correlation; see the module documentation.
pub(super) struct Products {
    rho: f64,
    /// The fit: J, r, Λ, and JᵀJ + Λ.
    pub(super) linear: Linear,
    /// C, n × m.
    pub(super) functions: DMatrix<f64>,
    /// Columns of all causes, n × o.
    pub(super) own: DMatrix<f64>,
    /// Those of each.
    pub(super) of_cause: Vec<Range<usize>>,
    /// JᵀC, p × m.
    pub(super) linear_functions: DMatrix<f64>,
    /// CᵀC, m × m.
    pub(super) functions_functions: DMatrix<f64>,
    /// Cᵀr, m.
    pub(super) functions_residual: DVector<f64>,
    /// J and the columns of causes, p × o.
    pub(super) linear_own: DMatrix<f64>,
    /// C and the columns of causes, m × o.
    pub(super) functions_own: DMatrix<f64>,
    /// The columns of each cause with themselves, k × k.
    pub(super) own_own: Vec<DMatrix<f64>>,
    /// The columns of causes and r, o.
    pub(super) own_residual: DVector<f64>,
}

impl Products {
    fn of(whitening: &Whitening<'_>, rho: f64) -> Self {
        let Whitening { linear, functions, own, numbers, .. } = whitening;
        let per = linear.per;
        let linear = linear.prewhitened(rho, numbers, 1.0);
        let functions = prewhiten(functions, rho, numbers, per);
        let own: Vec<DMatrix<f64>> = own.par_iter().map(|own| prewhiten(own, rho, numbers, per)).collect();
        let mut first = 0;
        let of_cause = own
            .iter()
            .map(|columns| {
                first += columns.ncols();
                first - columns.ncols()..first
            })
            .collect();
        let own_own = own.par_iter().map(gram).collect();
        let own = side_by_side(&own, linear.residual.len());
        Self {
            rho,
            linear_functions: product(&linear.rows, &functions),
            functions_functions: gram(&functions),
            functions_residual: functions.tr_mul(&linear.residual),
            linear_own: product(&linear.rows, &own),
            functions_own: product_of_transposed(&functions, &own),
            own_own,
            own_residual: own.tr_mul(&linear.residual),
            linear,
            functions,
            own,
            of_cause,
        }
    }

    /// The fit without the parameters at `dropped`, everything else at its optimum, with the functions projected.
    pub(super) fn without(&self, dropped: &[usize]) -> Reduced {
        let linear = &self.linear;
        let kept: Vec<usize> = (0..linear.x.len()).filter(|k| !dropped.contains(k)).collect();
        let p = kept.len();
        let normal = linear.normal();
        let lower = lower_factor(DMatrix::from_fn(p, p, |a, b| normal[(kept[a], kept[b])]));
        let mut change = DVector::zeros(linear.x.len());
        dropped.iter().for_each(|&k| change[k] = -linear.x[k]);
        let gradient = DVector::from_fn(p, |a, _| {
            let taken: f64 = dropped.iter().map(|&k| normal[(kept[a], k)] * change[k]).sum();
            linear.gradient[kept[a]] + taken
        });
        if let Some(step) = back_and_forth(&lower, &gradient) {
            kept.iter().zip(step.iter()).for_each(|(&k, step)| change[k] = -step);
        }
        let mut residual = linear.residual.clone();
        residual.gemv_tr(1.0, &linear.rows, &change, 1.0);
        let shared = solved(&lower, self.linear_functions.select_rows(&kept));
        let information = &self.functions_functions - gram(&shared);
        let gradient = &self.functions_residual + self.linear_functions.tr_mul(&change);
        Reduced { kept, lower, residual, shared, information, gradient }
    }
}

/// A fit without some parameters, with the functions of the discrepancy projected.
pub(super) struct Reduced {
    kept: Vec<usize>,
    /// L.
    lower: DMatrix<f64>,
    /// Its residuals, n.
    pub(super) residual: DVector<f64>,
    /// S, kept × m.
    shared: DMatrix<f64>,
    /// Information of the functions, m × m.
    pub(super) information: DMatrix<f64>,
    /// Their gradient, m.
    pub(super) gradient: DVector<f64>,
}

impl Reduced {
    /// What the functions at `range` with these coefficients change in the readings and the fit cannot absorb, n. `linear` and `functions`
    /// are those that were whitened: what is absorbed follows from the whitened ones, and the readings are not whitened.
    pub(super) fn readings(
        &self,
        (linear, functions): (&Linear, &DMatrix<f64>),
        range: Range<usize>,
        coefficients: &DVector<f64>,
    ) -> DVector<f64> {
        let Self { kept, lower, shared, .. } = self;
        let coefficients = coefficients.rows(range.start, range.len());
        let mut out = functions.columns(range.start, range.len()) * coefficients;
        let absorbed = shared.columns(range.start, range.len()) * coefficients;
        if let Some(absorbed) = lower.tr_solve_lower_triangular(&absorbed) {
            let mut change = DVector::zeros(linear.x.len());
            kept.iter().zip(absorbed.iter()).for_each(|(&k, absorbed)| change[k] = *absorbed);
            out.gemv_tr(-1.0, &linear.rows, &change, 1.0);
        }
        out
    }
}
