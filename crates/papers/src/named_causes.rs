//! The whole diagnosis beside the methods of a paper: blind on the rows of the fit of every case, judged on its held-out rows.
//!
//! Every method optimises geometry. What the diagnosis explains beyond that (compliance, gears, drifts and jumps of the measurement) no
//! optimiser of geometry can reach, however long it runs. It is asked only of measured rows: simulated ones contain what the
//! recipe states.

use std::time::Instant;

use serde::Serialize;
use truegrind_arm::model::Model;
use truegrind_calibration::diagnosis::diagnose::{Options, diagnose};
use truegrind_calibration::diagnosis::extension::Extended;
use truegrind_calibration::diagnosis::finding::Confidence;
use truegrind_calibration::diagnosis::preparation::prepare;
use truegrind_calibration::identification::fit::{Observations, errors_on, summary_on};
use truegrind_calibration::identification::register::starting_frames;
use truegrind_calibration::measurement::dataset::Dataset;
use truegrind_calibration::measurement::split::Split;
use truegrind_math::statistics::ErrorSummary;

/// The diagnosis of one case.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct NamedCauses {
    /// Errors of the model with all causes on held-out rows.
    pub held_out: ErrorSummary,
    /// Errors on the rows of the fit.
    pub fitted: ErrorSummary,
    /// Errors of the diagnosis' own geometry on held-out rows.
    pub geometry: ErrorSummary,
    /// Identified findings.
    pub identified: usize,
    /// All findings.
    pub findings: usize,
    /// Wall-clock time while other threads were running (s). Differs between runs.
    #[serde(skip)]
    pub seconds: f64,
}

/// Rows with the approach sides and steps of the whole file: the rows that were left out of a case were visited all the same.
pub(crate) struct Record {
    logged: Dataset,
    observed: Observations,
    fuse_readout: bool,
}

impl Record {
    pub(crate) fn of(dataset: &Dataset, nominal: &Model, fuse_readout: bool) -> Self {
        let prepared = prepare(dataset, nominal, fuse_readout);
        Self { logged: prepared.logged.dataset, observed: prepared.observed, fuse_readout }
    }

    /// Diagnoses one case, whose rows are indices of the file; `None` if its rows determine no frames or are not of this arm.
    pub(crate) fn diagnosed(&self, case: &Split, robot: &str, nominal: &Model) -> Option<NamedCauses> {
        let begun = Instant::now();
        let rows = self.logged.subset(&case.train);
        let options = Options { fuse_readout: self.fuse_readout, ..Options::default() };
        let frames = starting_frames(&rows, nominal, &options.tolerance, self.fuse_readout).ok()?;
        let found = diagnose(&rows, robot, nominal, &frames, &options, &|_| {}).ok()?;
        let seconds = begun.elapsed().as_secs_f64();
        let [train, test] = [&case.train, &case.test].map(|rows| self.observed.subset(rows));
        let errors = |fit: &Extended| ErrorSummary::of(errors_on(&test, &fit.model, &fit.frames));
        let findings = &found.diagnosis.findings;
        Some(NamedCauses {
            held_out: errors(&found.extended),
            fitted: summary_on(&train, &found.extended.model, &found.extended.frames),
            geometry: errors(&found.geometric),
            identified: findings.iter().filter(|f| f.confidence == Confidence::Identified).count(),
            findings: findings.len(),
            seconds,
        })
    }
}
