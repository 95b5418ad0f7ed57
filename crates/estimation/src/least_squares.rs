//! Batch least squares: all rows at once, linearised about the current parameters.
//!
//! | file | method | Jacobian passes per iteration |
//! |---|---|---|
//! | [`lm`] | Levenberg–Marquardt, as printed (ltlm-2024 eq. 10) and robust | 1 |
//! | [`ltlm`] | logistic-tent chaotic Levenberg–Marquardt (ltlm-2024, Algorithm I) | 2, and 2M rows-only passes |
//! | [`gauss_newton`] | least squares of one linearisation (rls-2025 eq. 9), and repeated | 1 |
//! | [`sslm`] | step-size Levenberg–Marquardt (ltlm-2024, M6) | 1, and rows-only passes |
//! | [`vslm`] | variable step-size Levenberg–Marquardt (ukf-vslm-2023 eq. 15) | 1 |
//! | [`triangular`] | the triangular factor of a Jacobian that is never stored | 1 |
//! | [`rank`] | rank, condition and null space from that factor | 0 |

pub mod lm;
pub mod ltlm;
pub mod gauss_newton;
pub mod sslm;
pub mod vslm;
pub mod triangular;
pub mod rank;
pub(crate) mod damped;
pub(crate) mod search;

use serde::{Deserialize, Serialize};

/// Whether a method runs as printed in its paper, or in a numerically robust form.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Form {
    /// To the letter of the paper, including its weaknesses, which the header of each file lists.
    AsPrinted,
    /// The same idea with scaling, step control and proper stops.
    #[default]
    #[serde(rename = "sound")]
    Robust,
}

/// Factorisation used for the linear system of a step.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Factorisation {
    /// Cholesky factorisation of the normal equations: one cheap pass over the rows, half of the significant digits.
    #[default]
    Cholesky,
    /// QR factorisation of the stacked Jacobian: twice the arithmetic, all significant digits. For problems whose
    /// scaled Jacobian has a condition number beyond some 1e6.
    Qr,
}
