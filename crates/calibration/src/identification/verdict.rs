//! The verdict on an estimated arm, the same for a fit of geometry and for one with causes beside it.
//!
//! A fit *fails* where it is no model: it did not converge, a link came out where no arm has it, rows that were held out got
//! worse, a stated limit is missed. It is *doubtful* where nothing of that holds, but its data do not promise that programs
//! will be better for it: a scale of the sensor explains what the links were bent to follow, or rows are too few for their
//! noise. A doubtful model is written only where that is asked for, and says so wherever it is used.

use crate::identification::benefit::{Benefit, ScaleError};
use crate::identification::tolerance::Tolerance;
use crate::measurement::dataset::Sensor;
use truegrind_arm::estimated::{EstimatedParameter, Judgement, Verdict};
use truegrind_math::statistics::ErrorSummary;

/// Least probability of a benefit with which a model is not doubtful.
pub const MIN_PROBABILITY: f64 = 0.96;

/// Probability from which a scale of the sensor counts as found.
const FOUND: f64 = 0.95;

/// A scale that is found makes a model doubtful where it accounts for this share of the error (RMS) that the estimated arm
/// is then left with, against the data sheet's.
const SPOILT: f64 = 0.5;

/// A parameter farther than this many tolerances from nominal makes the fit fail.
const STRANGE_DEVIATION: f64 = 6.0;

/// What speaks for and against a model, one sentence each.
#[derive(Debug, Clone, Default)]
pub struct VerdictBuilder {
    failures: Vec<String>,
    doubts: Vec<String>,
    others: Vec<String>,
    limits_stated: bool,
}

/// Limits of the held-out error beyond which a fit fails (mm); none where nothing is stated.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Limits {
    /// Of the RMSE.
    pub rmse_mm: Option<f64>,
    /// Of the largest error.
    pub max_mm: Option<f64>,
}

impl VerdictBuilder {
    /// A reason why this is no model.
    pub fn fail(&mut self, reason: impl Into<String>) {
        self.failures.push(reason.into());
    }

    /// A reason why it may not serve programs.
    pub fn doubt(&mut self, reason: impl Into<String>) {
        self.doubts.push(reason.into());
    }

    /// Something to know.
    pub fn note(&mut self, reason: impl Into<String>) {
        self.others.push(reason.into());
    }

    /// Fails where a link lies where no arm has it. `sure` standard deviations of the estimate are taken off first: with
    /// wide priors a parameter that the data hardly see wanders.
    pub fn check_links(&mut self, parameters: &[EstimatedParameter], tolerance: &Tolerance, sure: f64) {
        for p in parameters.iter().filter(|p| p.name.starts_with("link")) {
            let one = if p.unit == "mm" { tolerance.length_mm } else { tolerance.angle_rad };
            let off = (p.value - p.nominal).abs();
            if !((off - sure * p.sigma) / one < STRANGE_DEVIATION) {
                self.fail(format!(
                    "{} came out {:.0} tolerances from nominal: wrong units, wrong robot, or an effect that geometry cannot hold",
                    p.name,
                    off / one
                ));
            }
        }
    }

    /// Fails where rows that were held out are worse off (RMSE in mm).
    pub fn check_held_out(&mut self, registered_mm: f64, model_mm: f64) {
        if model_mm > registered_mm {
            self.fail(format!(
                "geometry is worse than registered frames on held-out rows: {model_mm:.3} against {registered_mm:.3} mm RMSE"
            ));
        }
    }

    /// Fails where a stated limit of the held-out error is missed, and says where none is stated.
    pub fn check_limits(&mut self, limits: &Limits, held_out: &ErrorSummary) {
        for (name, limit, found) in
            [("RMSE", limits.rmse_mm, held_out.rmse), ("maximum", limits.max_mm, held_out.max)]
        {
            let Some(limit) = limit else { continue };
            self.limits_stated = true;
            if found <= limit {
                self.note(format!("held-out {name} {found:.3} mm is within the stated {limit} mm"));
            } else {
                self.fail(format!("held-out {name} {found:.3} mm exceeds the stated {limit} mm"));
            }
        }
        if !self.limits_stated {
            self.note("held-out error not evaluated: no limits were stated (--limit-rmse, --limit-max)");
        }
    }

    /// Doubts where the model does not promise to help, and says why.
    pub fn check_benefit(&mut self, benefit: Option<&Benefit>, sensor: Sensor) {
        let Some(found) = benefit else {
            self.doubt("what the model would bring programs cannot be told: its equations have no solution");
            return;
        };
        let promise = promise(found);
        if found.probability >= MIN_PROBABILITY {
            self.note(promise);
            match &found.scale {
                Some(scale) if spoils(scale) => self.doubt(scale_sentence(scale, sensor)),
                _ => {}
            }
            return;
        }
        self.doubt(promise);
        if found.probability_without_scale < MIN_PROBABILITY {
            self.doubt(few(found));
            return;
        }
        match &found.scale {
            Some(scale) if scale.probability > 0.5 => self.doubt(scale_sentence(scale, sensor)),
            Some(scale) => self.doubt(format!(
                "a scale error of the sensor of {} cannot be told from longer links by these rows: {}",
                percent(scale),
                remedy(sensor)
            )),
            None => self.doubt(few(found)),
        }
    }

    /// The verdict: what speaks against the model first.
    pub fn build(mut self) -> Verdict {
        let status = match (self.failures.is_empty(), self.doubts.is_empty(), self.limits_stated) {
            (false, ..) => Judgement::Fail,
            (true, false, _) => Judgement::Doubtful,
            (true, true, true) => Judgement::Pass,
            (true, true, false) => Judgement::NotEvaluated,
        };
        let mut reasons = std::mem::take(&mut self.failures);
        reasons.append(&mut self.doubts);
        reasons.append(&mut self.others);
        Verdict { status, reasons }
    }
}

/// Whether a scale was found, and spoils the model.
fn spoils(scale: &ScaleError) -> bool {
    scale.probability > FOUND
        && scale.value.abs() > 3.0 * scale.sigma
        && scale.geometry_share < 1.0
        && scale.estimated_mm > SPOILT * scale.nominal_mm
}

/// A probability as people read it: no 0 % and no 100 %, which nothing measured can be.
///
/// ```
/// use truegrind_calibration::identification::verdict::percent_of;
///
/// assert_eq!(percent_of(0.1234), "12.3 %");
/// assert_eq!(percent_of(1.0), "over 99.9 %");
/// assert_eq!(percent_of(1e-9), "under 0.1 %");
/// ```
pub fn percent_of(probability: f64) -> String {
    match 100.0 * probability {
        p if p > 99.9 => "over 99.9 %".to_owned(),
        p if p < 0.1 => "under 0.1 %".to_owned(),
        p => format!("{p:.1} %"),
    }
}

/// What a model promises.
fn promise(found: &Benefit) -> String {
    let probability = percent_of(found.probability);
    format!(
        "inside the measured region, apart from where base and flange are placed, the data sheet's arm is expected to be \
         {:.3} mm RMS off and the estimated one {:.3} mm: it helps programs with a probability of {probability} (at least {:.0} % \
         is asked for)",
        found.nominal_mm,
        found.estimated_mm,
        100.0 * MIN_PROBABILITY
    )
}

fn percent(scale: &ScaleError) -> String {
    format!("{:+.3} ± {:.3} %", 100.0 * scale.value, 100.0 * scale.sigma)
}

fn scale_sentence(scale: &ScaleError, sensor: Sensor) -> String {
    let share = 100.0 * (1.0 - scale.geometry_share.clamp(0.0, 1.0).sqrt());
    let bent = if share >= 0.5 {
        format!(", and {share:.0} % of what the links were bent by")
    } else {
        String::new()
    };
    let (long, error) = if scale.value < 0.0 { ("short", -scale.value) } else { ("long", scale.value) };
    format!(
        "a sensor that reads {:.3} ± {:.3} % too {long} explains the rows better than the links alone (probability {}){bent}: {}",
        100.0 * error,
        100.0 * scale.sigma,
        percent_of(scale.probability),
        remedy(sensor)
    )
}

fn remedy(sensor: Sensor) -> &'static str {
    match sensor {
        Sensor::Cable => {
            "check millimetres per count of the draw-wire, measure a known length with it, correct the readings and identify again"
        }
        Sensor::Position | Sensor::Pose => {
            "check unit, scale and atmosphere of the tracker, measure a known length (a scale bar) with it, correct the readings \
             and identify again"
        }
    }
}

fn few(found: &Benefit) -> String {
    format!(
        "{} readings determine {:.1} of {} parameters, and with the noise that they show the correction is as likely to follow \
         the noise as the arm: measure more poses, or with less noise; `diagnose` tells whether something moved while measuring",
        found.readings, found.determined, found.parameters
    )
}
