//! Algorithms that fit a model to measurements. They are independent of robots: each is tested on published problems
//! (Moré–Garbow–Hillstrom, NIST StRD) and solves any [`problem::Problem`].
//!
//! Every algorithm file has the same two items: `Options` (with a `seed` and a `Default`) and `solve(&dyn
//! Problem, start, &Options) -> Estimate`. A solver returns for any data: NaN, no rows or a singular matrix give a
//! corresponding [`estimate::Termination`], never a panic. If a paper prints a weak form of a method,
//! [`least_squares::Form`] selects that form, to the letter, or a robust one; the default is robust.
//!
//! - [`problem`] and [`estimate`]: input and output of a solver;
//! - [`least_squares`]: batch methods with derivatives;
//! - [`filter`]: recursive methods with a covariance, one observation at a time;
//! - [`swarm`]: methods that use the cost only;
//! - [`network`]: a smooth function with many weights;
//! - [`chaos`]: the maps that generate the candidates of one of the least-squares methods.
//!
//! ```
//! use std::ops::Range;
//! use truegrind_estimation::least_squares::lm;
//! use truegrind_estimation::problem::Problem;
//!
//! /// y = a e^(−b t), measured at t = 0, 1, 2, 3 with σ = 0.01.
//! struct Decay;
//!
//! const MEASURED: [f64; 4] = [2.00, 1.21, 0.74, 0.45];
//! const SIGMA: f64 = 0.01;
//!
//! impl Problem for Decay {
//!     fn parameters(&self) -> usize {
//!         2
//!     }
//!     fn rows(&self) -> usize {
//!         MEASURED.len()
//!     }
//!     fn residuals(&self, x: &[f64], rows: Range<usize>, out: &mut [f64]) {
//!         for (out, t) in out.iter_mut().zip(rows) {
//!             *out = (x[0] * (-x[1] * t as f64).exp() - MEASURED[t]) / SIGMA;
//!         }
//!     }
//!     fn jacobian(&self, x: &[f64], rows: Range<usize>, residuals: &mut [f64], jacobian: &mut [f64]) {
//!         self.residuals(x, rows.clone(), residuals);
//!         let (by_a, by_b) = jacobian.split_at_mut(rows.len());
//!         for (i, t) in rows.enumerate() {
//!             let decay = (-x[1] * t as f64).exp() / SIGMA;
//!             by_a[i] = decay;
//!             by_b[i] = -x[0] * t as f64 * decay;
//!         }
//!     }
//! }
//!
//! let estimate = lm::solve(&Decay, &[1.0, 0.0], &lm::Options::default());
//! assert!(estimate.termination.is_converged());
//! let sigmas = estimate.sigmas().expect("four rows determine two parameters");
//! assert!((estimate.x[0] - 2.0).abs() < 3.0 * sigmas[0]);
//! assert!((estimate.x[1] - 0.5).abs() < 3.0 * sigmas[1]);
//! ```

/// The options of a method: each field with its meaning and its default.
macro_rules! options {
    ($(#[$about:meta])* pub struct $name:ident { $($(#[$doc:meta])* pub $field:ident: $type:ty = $default:expr,)* }) => {
        $(#[$about])*
        #[derive(Debug, Clone, PartialEq, serde::Serialize, serde::Deserialize)]
        #[serde(default, rename_all = "kebab-case", deny_unknown_fields)]
        pub struct $name {
            $($(#[$doc])* pub $field: $type,)*
        }

        impl Default for $name {
            fn default() -> Self {
                Self { $($field: $default,)* }
            }
        }
    };
}

pub mod problem;
pub mod estimate;
pub mod objective;
pub mod least_squares;
pub mod filter;
pub mod swarm;
pub mod network;
pub mod chaos;
pub mod examples;
