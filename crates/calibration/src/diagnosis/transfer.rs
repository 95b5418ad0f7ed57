//! Transfer test: the models of one series on another of the same arm, with only the frames refitted.
//!
//! Real effects of the arm persist on another day and in another mounting; overfitted ones do not.

use super::cause::Cause;
use super::extension::{Freedom, Subject, fit};
use super::finding::Transfer;
use super::preparation::prepare;
use crate::identification::calibration::Frames;
use crate::identification::fit::errors_on;
use crate::identification::tolerance::Tolerance;
use crate::measurement::dataset::Dataset;
use truegrind_arm::model::Model;
use truegrind_math::statistics::ErrorSummary;

/// Root mean square errors (mm) of data sheet, geometry and extended model on `other`, with the frames refitted, links and effects
/// unchanged. `fuse_readout` as for the models.
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
