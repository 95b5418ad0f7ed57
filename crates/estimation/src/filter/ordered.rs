//! A triangular root L of a covariance, LLᵀ = P, ordered so that drifting parameters come last.
//!
//! Process noise then changes the last block only: with k drifting of p parameters a step costs k³ operations instead of
//! p³, and a row p². Parameters of effects are constant while links and frames drift, so k is small where p is large.
//!
//! **Method.** Row: with f = Lᵀa and s_j = ϕ + Σ_{i ≥ j} f_i², L ← LC, where C is the lower root of I − ffᵀ/s₀: C_jj =
//! √(s_{j+1}/s_j), C_ij = −f_i f_j/√(s_j s_{j+1}) (Carlson 1973, for a lower root and without cancellation, since the sums are
//! taken from the end). Drift: the last block T becomes the root of TTᵀ + diag σ².
//!
//! **Source.** Carlson, "Fast triangular formulation of the square root filter", AIAA Journal 11, 1973.
//!
//! **Checked against** Potter's form and the covariance itself (equal to rounding).

use nalgebra::{DMatrix, DVector};

/// The root.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Ordered {
    /// The parameter at each position: constant ones, then drifting ones.
    order: Vec<usize>,
    /// Number of constant parameters.
    still: usize,
    lower: DMatrix<f64>,
}

impl Ordered {
    /// From any root S with SSᵀ = P. A root that is already triangular in this order is copied bit by bit.
    pub(super) fn of(root: &DMatrix<f64>, sigma: &[f64]) -> Self {
        let (order, still) = order_of(sigma, root.nrows());
        let mut lower = DMatrix::from_fn(root.nrows(), root.ncols(), |i, j| root[(order[i], j)]);
        let triangular = (0..lower.ncols()).all(|j| (0..j.min(lower.nrows())).all(|i| lower[(i, j)] == 0.0));
        if !triangular || lower.nrows() != lower.ncols() {
            // S = (QR)ᵀ = RᵀQᵀ: Rᵀ is a root too.
            lower = lower.transpose().qr().r().transpose();
        }
        Self { order, still, lower }
    }

    /// Whether exactly these parameters drift in this order.
    pub(super) fn fits(&self, sigma: &[f64]) -> bool {
        let drifts = |k: usize| sigma.get(k).is_some_and(|sigma| *sigma != 0.0);
        self.order.iter().enumerate().all(|(place, &k)| (place >= self.still) == drifts(k))
    }

    /// The root with its rows in the order of the parameters.
    pub(super) fn root(&self) -> DMatrix<f64> {
        let mut out = DMatrix::zeros(self.lower.nrows(), self.lower.ncols());
        for (place, &k) in self.order.iter().enumerate() {
            out.row_mut(k).copy_from(&self.lower.row(place));
        }
        out
    }

    /// Adds process noise; non-finite sigmas change nothing.
    pub(super) fn drift(&mut self, sigma: &[f64]) {
        let (p, m) = (self.order.len(), self.still);
        let mut block = self.lower.view((m, m), (p - m, p - m)).into_owned();
        block = &block * block.transpose();
        for place in m..p {
            let sigma = sigma[self.order[place]];
            block[(place - m, place - m)] += sigma * sigma;
        }
        if let Some(factor) = block.cholesky() {
            self.lower.view_mut((m, m), (p - m, p - m)).copy_from(&factor.unpack());
        }
    }

    /// Updates with a row; returns ϕ + aᵀPa and Pa.
    pub(super) fn update(&mut self, a: &DVector<f64>, forgetting: f64) -> (f64, DVector<f64>) {
        let p = self.order.len();
        let here = DVector::from_fn(p, |place, _| a[self.order[place]]);
        let f = DVector::from_fn(p, |j, _| self.lower.column(j).rows_range(j..).dot(&here.rows_range(j..)));
        let mut gain = DVector::zeros(p);
        let mut after = forgetting;
        for j in (0..p).rev() {
            let before = after + f[j] * f[j];
            let (keep, take) = ((after / before).sqrt(), f[j] / (before * after).sqrt());
            let mut column = self.lower.column_mut(j);
            for i in j..p {
                let old = column[i];
                column[i] = keep * old - take * gain[i];
                gain[i] += f[j] * old;
            }
            after = before;
        }
        if forgetting != 1.0 {
            self.lower /= forgetting.sqrt();
        }
        let mut natural = DVector::zeros(p);
        self.order.iter().enumerate().for_each(|(place, &k)| natural[k] = gain[place]);
        (after, natural)
    }
}

/// The constant, then the drifting parameters, each in ascending order.
fn order_of(sigma: &[f64], p: usize) -> (Vec<usize>, usize) {
    let drifts = |k: &usize| sigma.get(*k).is_some_and(|sigma| *sigma != 0.0);
    let (last, mut order): (Vec<usize>, Vec<usize>) = (0..p).partition(drifts);
    let still = order.len();
    order.extend(last);
    (order, still)
}
