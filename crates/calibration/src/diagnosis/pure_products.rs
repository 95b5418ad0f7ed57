//! Products of the columns of one candidate with those of all others, with everything projected off that is free or was selected before.
//!
//! With C the columns of all candidates (n × m), Cⱼ those of the selected one, S = QᵀC for what is free, and Tᵢ what
//! [`PureProducts::project_off`] returned for each one before, the products are CᵀCⱼ − SᵀSⱼ − Σ TᵢᵀTᵢⱼ. Only CᵀCⱼ takes the rows, and of
//! a knot of an error map only those that reach it. The pure columns themselves are dense, and are not needed.

use std::ops::Range;

use nalgebra::DMatrix;

use super::algebra::{product_of_transposed, solved};
use super::design::{Design, Projected, side_by_side, times_columns};

/// See the module documentation.
pub(super) struct PureProducts {
    /// The columns of each candidate.
    pub(super) ranges: Vec<Range<usize>>,
    /// All columns transposed, m × n.
    transposed: DMatrix<f64>,
    /// S and every Tᵢ, each with m columns.
    shared: Vec<DMatrix<f64>>,
}

impl PureProducts {
    /// Nothing is selected yet.
    pub(super) fn of(design: &Design, columns: &[DMatrix<f64>], projected: &[Projected]) -> Self {
        let mut first = 0;
        let ranges = columns.iter().map(|own| {
            first += own.ncols();
            first - own.ncols()..first
        });
        let ranges: Vec<Range<usize>> = ranges.collect();
        let mut transposed = DMatrix::zeros(first, design.rows());
        for (own, range) in columns.iter().zip(&ranges) {
            transposed.rows_mut(range.start, range.len()).tr_copy_from(own);
        }
        let free: Vec<DMatrix<f64>> = projected.iter().map(|own| design.shared(own)).collect();
        let free = side_by_side(&free, design.basis.nrows());
        Self { ranges, transposed, shared: vec![free] }
    }

    /// Projects candidate `j` with the columns `own` off as well, L the factor of its information with its prior: returns L⁻¹ times its
    /// products with all, k × m.
    pub(super) fn project_off(&mut self, j: usize, own: &DMatrix<f64>, lower: &DMatrix<f64>) -> DMatrix<f64> {
        let range = &self.ranges[j];
        let mut pure = times_columns(&self.transposed, own);
        for shared in &self.shared {
            let mine = shared.columns(range.start, range.len()).into_owned();
            pure -= product_of_transposed(shared, &mine);
        }
        let shared = solved(lower, pure.transpose());
        self.shared.push(shared.clone());
        shared
    }
}
