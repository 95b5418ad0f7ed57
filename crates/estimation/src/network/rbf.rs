//! Radial basis function network (RBF).
//!
//! **Method.** y(u) = Σₖ wₖ φ(|u − cₖ| / ρ): K centres cₖ, one weight for each centre and output. With fixed centres
//! this is linear in the weights, so the fit is a linear [`Problem`] ([`Task`]): row i has factors mᵢ for the outputs and
//! residual rᵢ = mᵢ · y(uᵢ) − tᵢ. An example is a cable, which measures one direction of a displacement.
//! - [`Form::AsPrinted`]: a centre on every point, Gaussian φ with ρ the mean distance between neighbours, almost no prior
//!   on the weights: the network interpolates its rows, noise included.
//! - [`Form::Robust`]: few centres, spread out over the points; φ of compact support (see [`radial`]), ρ three fill
//!   distances; a normal prior on the weights, whose standard deviation is the expected size of the function.
//!
//! **Shapes.** `D` inputs, m outputs, K centres: m·K weights, output by output for each centre.
//!
//! **Stops.** Those of [`gauss_newton`], which is exact in one step here.
//!
//! **Region.** [`Network::value`] is `None` beyond the reach of every centre: a network must not extrapolate beyond the
//! measured region.
//!
//! **Source and departures.** M5 of ukf-vslm-2023, without equations or numbers; its reference (Chen et al. 2019, doi
//! 10.1088/1361-6501/ab2106) predicts the position error of a target position from errors measured near it. Its 400
//! iterations of training are not needed: the optimum of a linear problem is one solution of normal equations. Compact
//! support: Wendland 1995.
//!
//! **Checked against** exact interpolation, a known smooth field between its samples, and refusal outside.

use std::ops::Range;

use crate::estimate::Estimate;
use crate::least_squares::{Form, gauss_newton};
use crate::problem::{Prior, Problem};
use truegrind_math::radial;

options! {
    /// Options of a network and its training.
    #[derive(Copy)]
    pub struct Options {
        /// As printed or robust.
        pub form: Form = Form::Robust,
        /// K (robust).
        pub centres: usize = 24,
        /// ρ in fill distances (robust): 6 and more follow a smooth field better, 3 ends soon beyond the last centre.
        pub reach: f64 = 3.0,
        /// Prior standard deviation of a weight, in the unit of the outputs.
        pub weight_sigma: f64 = 1.0,
        /// Unused: the method is deterministic. Present so that all methods have the same fields.
        pub seed: u64 = 0,
    }
}

impl Options {
    /// A Gaussian on every point.
    pub fn as_printed() -> Self {
        Self { form: Form::AsPrinted, weight_sigma: 1e3, ..Self::default() }
    }
}

/// Centres and shape of the basis functions.
#[derive(Debug, Clone, PartialEq)]
pub struct Layout<const D: usize> {
    /// The centres.
    pub centres: Vec<[f64; D]>,
    /// ρ.
    pub reach: f64,
    /// Gaussian (as printed) or of compact support (robust).
    pub form: Form,
}

impl<const D: usize> Layout<D> {
    /// Chooses the centres for `points`. Non-finite points are ignored.
    pub fn of(points: &[[f64; D]], options: &Options) -> Self {
        let most = if options.form == Form::AsPrinted { points.len() } else { options.centres };
        let (centres, fill) = radial::farthest_point_sample(points, most);
        let neighbours: Vec<f64> = centres
            .iter()
            .enumerate()
            .map(|(i, a)| {
                let others = centres.iter().enumerate().filter(|(j, _)| *j != i);
                others.map(|(_, b)| radial::distance(a, b)).fold(f64::INFINITY, f64::min)
            })
            .filter(|d| d.is_finite())
            .collect();
        let apart = neighbours.iter().sum::<f64>() / neighbours.len().max(1) as f64;
        // With a centre on every point the fill distance is 0.
        let fill = if fill > 0.0 { fill } else { apart };
        let reach = if options.form == Form::AsPrinted { apart } else { options.reach * fill };
        Self { centres, reach: if reach > 0.0 { reach } else { 1.0 }, form: options.form }
    }

    /// Value of basis function k at u.
    pub fn bump(&self, k: usize, u: &[f64; D]) -> f64 {
        match self.form {
            Form::Robust => radial::wendland(u, &self.centres[k], self.reach),
            Form::AsPrinted => (-0.5 * (radial::distance(u, &self.centres[k]) / self.reach).powi(2)).exp(),
        }
    }

    /// Whether u lies within the reach of a centre.
    pub fn reaches(&self, u: &[f64; D]) -> bool {
        self.centres.iter().any(|c| radial::distance(u, c) < self.reach)
    }
}

/// A trained network.
#[derive(Debug, Clone, PartialEq)]
pub struct Network<const D: usize> {
    /// The basis functions.
    pub layout: Layout<D>,
    /// Number of outputs m.
    pub outputs: usize,
    /// m weights for each centre.
    pub weights: Vec<f64>,
}

impl<const D: usize> Network<D> {
    /// The outputs at u; `None` outside the region, beyond the reach of every centre.
    pub fn value(&self, u: &[f64; D]) -> Option<Vec<f64>> {
        self.layout.reaches(u).then(|| {
            let mut out = vec![0.0; self.outputs];
            for (k, weights) in self.weights.chunks(self.outputs.max(1)).enumerate() {
                let bump = self.layout.bump(k, u);
                out.iter_mut().zip(weights).for_each(|(o, w)| *o += w * bump);
            }
            out
        })
    }
}

/// The linear problem of training: one parameter for each weight.
#[derive(Debug, Clone, PartialEq)]
pub struct Task<const D: usize> {
    /// The basis functions.
    pub layout: Layout<D>,
    /// Number of outputs m.
    pub outputs: usize,
    /// Input of each row.
    pub points: Vec<[f64; D]>,
    /// Factor of each output in each row, m for each row, divided by the row's standard deviation.
    pub factors: Vec<f64>,
    /// Target of each row, divided by its standard deviation.
    pub targets: Vec<f64>,
    priors: Vec<Prior>,
}

impl<const D: usize> Task<D> {
    /// Sets up the problem.
    ///
    /// # Panics
    /// If points, factors and targets do not have the same number of rows: a programming error.
    pub fn new(points: Vec<[f64; D]>, factors: Vec<f64>, targets: Vec<f64>, options: &Options) -> Self {
        let outputs = factors.len() / points.len().max(1);
        assert_eq!(factors.len(), outputs * points.len(), "as many factors in each row");
        assert_eq!(targets.len(), points.len(), "one target for each row");
        let layout = Layout::of(&points, options);
        let prior = Prior { mean: 0.0, sigma: options.weight_sigma };
        let priors = vec![prior; outputs * layout.centres.len()];
        Self { layout, outputs, points, factors, targets, priors }
    }

    /// The network with these weights.
    pub fn network(&self, weights: &[f64]) -> Network<D> {
        Network { layout: self.layout.clone(), outputs: self.outputs, weights: weights.to_vec() }
    }
}

impl<const D: usize> Problem for Task<D> {
    fn parameters(&self) -> usize {
        self.priors.len()
    }

    fn rows(&self) -> usize {
        self.points.len()
    }

    fn priors(&self) -> &[Prior] {
        &self.priors
    }

    fn residuals(&self, x: &[f64], rows: Range<usize>, out: &mut [f64]) {
        let m = self.outputs.max(1);
        for (out, i) in out.iter_mut().zip(rows) {
            let factors = &self.factors[i * m..(i + 1) * m];
            let sum: f64 = x
                .chunks(m)
                .enumerate()
                .map(|(k, weights)| {
                    let seen: f64 = factors.iter().zip(weights).map(|(f, w)| f * w).sum();
                    seen * self.layout.bump(k, &self.points[i])
                })
                .sum();
            *out = sum - self.targets[i];
        }
    }

    fn jacobian(&self, x: &[f64], rows: Range<usize>, residuals: &mut [f64], jacobian: &mut [f64]) {
        self.residuals(x, rows.clone(), residuals);
        let (m, n) = (self.outputs.max(1), rows.len());
        for (at, i) in rows.enumerate() {
            for k in 0..self.layout.centres.len() {
                let bump = self.layout.bump(k, &self.points[i]);
                for o in 0..m {
                    jacobian[(k * m + o) * n + at] = bump * self.factors[i * m + o];
                }
            }
        }
    }
}

/// Trains: the weights that minimise the cost of `problem`, which is linear ([`Task`]).
///
/// # Panics
/// If `start` does not have one entry for each weight.
pub fn solve(problem: &dyn Problem, start: &[f64], options: &Options) -> Estimate {
    let search = gauss_newton::Options { seed: options.seed, ..gauss_newton::Options::default() };
    gauss_newton::solve(problem, start, &search)
}
