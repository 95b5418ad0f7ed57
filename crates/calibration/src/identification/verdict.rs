//! The verdict on an estimated arm, shared by identification and diagnosis.
//!
//! A fit *fails* if it did not converge, a link parameter is physically implausible, the held-out error increased, or a stated
//! limit is exceeded. It is *doubtful* if none of this holds but its expected benefit is uncertain: a scale error of the sensor
//! explains the readings as well as the links, or there are too few rows for their noise. A doubtful model is written only on
//! request, and every use of it says so.

use crate::identification::benefit::{Benefit, LawError, MIN_PROBABILITY, NoBenefit, ScaleError};
use crate::identification::sensor_laws::SensorLaw;
use crate::identification::tolerance::Tolerance;
use crate::measurement::dataset::Sensor;
use truegrind_arm::estimated::{EstimatedParameter, Judgement, Reason, ReasonKind, Verdict};
use truegrind_math::statistics::ErrorSummary;

/// Probability from which a scale error of the sensor counts as detected.
const FOUND: f64 = 0.95;

/// A detected scale error makes a model doubtful if the estimated arm's RMS error, given that scale error, exceeds this share of
/// the nominal arm's.
const SPOILT: f64 = 0.5;

/// A parameter farther than this many tolerances from nominal makes the fit fail.
const IMPLAUSIBLE_DEVIATION: f64 = 6.0;

/// A joint zero farther than this many tolerances from the data sheet's is no matter of manufacture: 0.75° by default, where Nubiola and Bonev
/// 2013 find up to 0.5°.
const MASTERED_DEVIATION: f64 = 2.5;

/// Standard deviations that are subtracted first.
const MASTERED_Z: f64 = 3.0;

/// Most of these parameters that the verdict names.
const NAMED: usize = 4;

/// Collects the reasons for and against a model, one sentence each.
#[derive(Debug, Clone, Default)]
pub struct VerdictBuilder {
    failures: Vec<Reason>,
    doubts: Vec<Reason>,
    others: Vec<Reason>,
    /// Which of these is the expected benefit.
    benefit: Option<usize>,
    limits_stated: bool,
}

/// Limits of the held-out error beyond which a fit fails (mm); `None` where not stated.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Limits {
    /// Of the RMSE.
    pub rmse_mm: Option<f64>,
    /// Of the largest error.
    pub max_mm: Option<f64>,
}

impl VerdictBuilder {
    /// Adds a reason for failure.
    pub fn fail(&mut self, reason: impl Into<Reason>) {
        self.failures.push(reason.into());
    }

    /// Adds a reason for doubt.
    pub fn doubt(&mut self, reason: impl Into<Reason>) {
        self.doubts.push(reason.into());
    }

    /// Adds a note.
    pub fn note(&mut self, reason: impl Into<Reason>) {
        self.others.push(reason.into());
    }

    /// Fails for a link parameter too far from nominal. `margin` standard deviations of the estimate are subtracted first: with
    /// wide priors, weakly determined parameters scatter.
    pub fn check_links(&mut self, parameters: &[EstimatedParameter], tolerance: &Tolerance, margin: f64) {
        let implausible =
            parameters.iter().filter(|p| p.is_of_link() && is_implausible(p, tolerance, margin));
        let mut off: Vec<(&str, f64)> = implausible
            .map(|p| (p.name.as_str(), (p.value - p.nominal).abs() / tolerance_of(p, tolerance)))
            .collect();
        off.sort_by(|a, b| b.1.total_cmp(&a.1));
        let subject = match off.as_slice() {
            [] => return,
            [(name, off)] => format!("{name} is estimated {off:.0} tolerances from nominal"),
            [_, _, ..] => {
                let farthest: Vec<String> =
                    off.iter().take(NAMED).map(|(name, off)| format!("{name} by {off:.0}")).collect();
                format!(
                    "{} link parameters are estimated more than {IMPLAUSIBLE_DEVIATION} tolerances from nominal, {}{}",
                    off.len(),
                    if off.len() > NAMED { "the farthest " } else { "" },
                    farthest.join(", ")
                )
            }
        };
        self.fail(format!(
            "{subject}: wrong units, wrong robot, or an effect that link geometry cannot represent"
        ));
    }

    /// Notes joint zeros that are farther from the data sheet's than manufacture makes them, and still plausible, unless something else failed.
    pub fn check_mastering(&mut self, parameters: &[EstimatedParameter], tolerance: &Tolerance) {
        let zeros: Vec<String> = parameters
            .iter()
            .filter_map(|p| {
                let joint = p.name.strip_prefix("link")?.strip_suffix(".theta")?;
                let off = p.value - p.nominal;
                let is_off = off.abs() - MASTERED_Z * p.sigma > MASTERED_DEVIATION * tolerance.zero_rad;
                (is_off && !is_implausible(p, tolerance, 0.0))
                    .then(|| format!("joint {joint} by {:+.2}°", off.to_degrees()))
            })
            .collect();
        // A wrong robot or unit has such zeros too.
        if !zeros.is_empty() && self.failures.is_empty() {
            self.note(format!(
                "joint zeros differ from the data sheet by more than manufacture explains ({}): the mastering (calibration of the encoders) \
                 seems to be off. Check the calibration marks. This model holds for the zeros as they are now: once a joint is mastered \
                 again, measure again",
                zeros.join(", ")
            ));
        }
    }

    /// Fails if the held-out error increased or is unknown (RMSE in mm).
    pub fn check_held_out(&mut self, registered_mm: f64, model_mm: f64) {
        if registered_mm.is_nan() || model_mm.is_nan() {
            self.fail("the held-out error is unknown: no row was held out, or an error is not a number");
        } else if model_mm > registered_mm {
            self.fail(format!(
                "on held-out rows the estimated geometry is worse than registered frames alone: {model_mm:.3} against \
                 {registered_mm:.3} mm RMSE"
            ));
        }
    }

    /// Fails if the held-out error exceeds a stated limit; notes if none is stated.
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
            self.note(Reason::new(
                ReasonKind::NoLimits,
                "held-out error not judged: no limits were stated (--limit-rmse, --limit-max)",
            ));
        }
    }

    /// Adds doubts if the benefit is uncertain, with the reason.
    pub fn check_benefit(&mut self, benefit: Result<&Benefit, &NoBenefit>, sensor: Sensor) {
        let found = match benefit {
            Ok(found) => found,
            Err(why) => {
                self.doubt(why.to_string());
                return;
            }
        };
        let sentence = benefit_sentence(found);
        if found.probability >= MIN_PROBABILITY {
            self.benefit = Some(self.others.len());
            self.note(sentence);
            match &found.scale {
                Some(scale) if spoils(scale) => self.doubt(scale_sentence(scale, sensor)),
                _ => {}
            }
            return;
        }
        self.doubt(sentence);
        // With the sensor's further error out of the question all would be well.
        let is_to_blame =
            |law: &&LawError| law.benefit_without.is_none_or(|without| without >= MIN_PROBABILITY);
        if let Some(law) = found.law.as_ref().filter(is_to_blame) {
            self.doubt(law_sentence(law));
            return;
        }
        if found.probability_without_scale < MIN_PROBABILITY {
            self.doubt(too_few_rows(found));
            return;
        }
        match &found.scale {
            // Every model has a stated scale: it says nothing of whether there is an error.
            Some(_) if found.scale_stated => self.doubt(stated_scale_sentence(found, sensor)),
            Some(scale) if scale.probability > 0.5 => self.doubt(scale_sentence(scale, sensor)),
            Some(scale) => self.doubt(format!(
                "these rows cannot distinguish a sensor scale error of {} from longer links: {}",
                percent(scale),
                remedy(sensor)
            )),
            None => self.doubt(too_few_rows(found)),
        }
    }

    /// The verdict, with the reasons against the model first.
    pub fn build(mut self) -> Verdict {
        let status = match (self.failures.is_empty(), self.doubts.is_empty(), self.limits_stated) {
            (false, ..) => Judgement::Fail,
            (true, false, _) => Judgement::Doubtful,
            (true, true, true) => Judgement::Pass,
            (true, true, false) => Judgement::NotEvaluated,
        };
        let mut reasons = std::mem::take(&mut self.failures);
        reasons.append(&mut self.doubts);
        // What speaks against the model is not in its expected benefit.
        if status == Judgement::Fail
            && let Some(benefit) = self.benefit.and_then(|k| self.others.get_mut(k))
        {
            benefit.text.insert_str(0, "apart from the problems above: ");
        }
        reasons.append(&mut self.others);
        Verdict { status, reasons }
    }
}

fn tolerance_of(parameter: &EstimatedParameter, tolerance: &Tolerance) -> f64 {
    if parameter.unit == "mm" { tolerance.length_mm } else { tolerance.angle_rad }
}

/// Whether a link parameter is too far from nominal, less `margin` standard deviations.
pub(crate) fn is_implausible(parameter: &EstimatedParameter, tolerance: &Tolerance, margin: f64) -> bool {
    let off = (parameter.value - parameter.nominal).abs();
    !((off - margin * parameter.sigma) / tolerance_of(parameter, tolerance) < IMPLAUSIBLE_DEVIATION)
}

/// Whether a scale error is detected and makes the model doubtful.
fn spoils(scale: &ScaleError) -> bool {
    scale.probability > FOUND
        && scale.value.abs() > 3.0 * scale.sigma
        && scale.geometry_share < 1.0
        && scale.estimated_mm > SPOILT * scale.nominal_mm
}

/// A probability in per cent, never rounded to 0 % or 100 %.
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
        p if p > MAX_PERCENT => "over 99.9 %".to_owned(),
        p if p < MIN_PERCENT => "under 0.1 %".to_owned(),
        p => format!("{p:.1} %"),
    }
}

/// Probabilities (%) beyond which [`percent_of`] states a bound.
pub const MIN_PERCENT: f64 = 0.1;
/// The upper one.
pub const MAX_PERCENT: f64 = 99.9;

/// The expected benefit in words.
fn benefit_sentence(found: &Benefit) -> String {
    let probability = percent_of(found.probability);
    format!(
        "inside the measured region, placement of base and flange excluded, the expected RMS error is {:.3} mm for the nominal arm \
         and {:.3} mm for the estimated one{}: it improves programs with a probability of {probability} (at least {:.0} % is \
         required)",
        found.nominal_mm,
        found.estimated_mm,
        scale_clause(found) + &beyond_noise_clause(found),
        100.0 * MIN_PROBABILITY
    )
}

/// What an unstated scale error of the sensor makes of the expected error, where that is most of it.
fn scale_clause(found: &Benefit) -> String {
    if found.scale_stated || found.estimated_mm < ASSUMED * found.estimated_without_scale_mm {
        return String::new();
    }
    format!(
        " ({:.3} mm if the scale of the sensor is exact; that was not stated, --sensor-scale-sigma)",
        found.estimated_without_scale_mm
    )
}

/// Ratio of expected errors from which the assumption on the scale is stated.
const ASSUMED: f64 = 1.5;

/// What the model leaves beyond the noise, where that counts beside the uncertainty of its parameters.
fn beyond_noise_clause(found: &Benefit) -> String {
    let Some(beyond) = found.beyond_noise else { return String::new() };
    let mut out = match beyond.known_mm() {
        Some(mm) if mm > 0.5 * found.estimated_mm => {
            format!(", of which {mm:.3} mm are expected from effects that the model does not contain")
        }
        _ => String::new(),
    };
    if let Some(most_mm) = found.counting_at_most_mm() {
        out += &format!(
            ", or up to {most_mm:.3} mm if the unexplained rest is the arm's and not noise (repeated poses would show it)"
        );
    }
    out
}

fn percent(scale: &ScaleError) -> String {
    format!("{:+.3} ± {:.3} %", 100.0 * scale.value, 100.0 * scale.sigma)
}

fn scale_sentence(scale: &ScaleError, sensor: Sensor) -> String {
    let share = 100.0 * (1.0 - scale.geometry_share.clamp(0.0, 1.0).sqrt());
    let absorbed =
        if share >= 0.5 { format!(", and {share:.0} % of the links' correction") } else { String::new() };
    let (long, error) = if scale.value < 0.0 { ("short", -scale.value) } else { ("long", scale.value) };
    format!(
        "a sensor that reads {:.3} ± {:.3} % too {long} explains the rows better than the links alone (probability {}){absorbed}: {}",
        100.0 * error,
        100.0 * scale.sigma,
        percent_of(scale.probability),
        remedy(sensor)
    )
}

/// That a scale is known too little for what the poses tell.
fn stated_scale_sentence(found: &Benefit, sensor: Sensor) -> String {
    format!(
        "the scale of the sensor is known too little (--sensor-scale-sigma): the same readings with an exact scale would improve programs with a \
         probability of {}, and more poses do not tell it from longer links: {}",
        percent_of(found.probability_without_scale),
        remedy(sensor)
    )
}

/// That the poses do not tell the arm from a further error of the sensor, and what to measure.
fn law_sentence(law: &LawError) -> String {
    let (error, remedy) = match law.kind {
        SensorLaw::Pulley => (
            "a cable that runs over a pulley at its outlet, of a radius of about 10 mm,",
            "measure poses that swing the cable further about its outlet (random poses over the full ranges of the joints, or some \
             with the outlet elsewhere); a cable that leaves its sensor through a small hole has no such error",
        ),
        SensorLaw::Drum => (
            "a cable whose length is wound on in layers",
            "measure poses at more directions of the cable for each of its lengths (random poses over the full ranges of the joints), \
             and the sensor itself against a known length",
        ),
        SensorLaw::Lens => (
            "a sensor whose scale changes over its field, as that of a camera whose lens distorts,",
            "measure a known length (a scale bar) in the middle and at the edges of the field, recalibrate the camera, and measure poses with the \
             flange turned as far as it can be seen at each place; with readings that are true over the whole field, identify again",
        ),
    };
    let explains = if law.probability > FOUND {
        format!("{error} explains these readings better than the arm alone")
    } else {
        format!(
            "these poses cannot separate the arm from its sensor: {error} would give nearly the same readings"
        )
    };
    let helps = law.benefit_with.map_or_else(String::new, |with| {
        format!(", and with it the model improves programs with a probability of {} only", percent_of(with))
    });
    format!("{explains} (probability {}){helps}: {remedy}", percent_of(law.probability))
}

fn remedy(sensor: Sensor) -> &'static str {
    match sensor {
        Sensor::Cable => {
            "measure a known length with the draw-wire and check its millimetres per count; correct the readings, or state how well \
             the length agreed (--sensor-scale-sigma), and identify again"
        }
        Sensor::Position | Sensor::Pose => {
            "measure a known length (a scale bar) with the tracker and check its unit, scale and atmosphere; correct the readings, or \
             state how well the length agreed (--sensor-scale-sigma), and identify again"
        }
    }
}

fn too_few_rows(found: &Benefit) -> String {
    format!(
        "{} readings determine {:.1} of {} parameters; at their noise level the correction can follow the noise rather than the \
         arm: measure more poses, or with less noise; `diagnose` tests whether something moved during the measurement",
        found.readings, found.determined, found.parameters
    )
}
