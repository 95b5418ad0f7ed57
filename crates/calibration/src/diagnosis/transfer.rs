//! Whether what was found is the arm's: the models of one series on another, with only the frames refitted.
//!
//! An arm's physics moves along to another day and another mounting; what was only fitted stays behind.

use super::cause::Cause;
use super::extension::{Freedom, Subject, fit};
use super::finding::Transfer;
use super::rows::prepare;
use crate::identification::calibration::Frames;
use crate::identification::fit::errors_on;
use crate::identification::tolerance::Tolerance;
use crate::measurement::dataset::Dataset;
use truegrind_arm::model::Model;
use truegrind_math::statistics::ErrorSummary;

/// Root mean square errors (mm) of data sheet, geometry and extended model on `other`, frames fitted to it, links and effects
/// as they are. `fuse_readout`: as the models were made.
pub fn transfer(
    other: &Dataset,
    frames: &Frames,
    nominal: &Model,
    geometric: &Model,
    extended: &Model,
    tolerance: &Tolerance,
    fuse_readout: bool,
) -> Transfer {
    let prepared = prepare(other, nominal, fuse_readout);
    let none: [Cause; 0] = [];
    let rmse = |model: &Model| {
        let subject = Subject { observed: &prepared.observed, nominal: model, frames, tolerance };
        let registered = fit(&subject, &none, Freedom::Frames, None);
        ErrorSummary::of(errors_on(&prepared.observed, &registered.model, &registered.frames)).rmse
    };
    Transfer {
        file: other.file.clone(),
        rows: other.rows.len(),
        nominal_rmse_mm: rmse(nominal),
        geometric_rmse_mm: rmse(geometric),
        extended_rmse_mm: rmse(extended),
    }
}
