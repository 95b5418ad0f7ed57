//! The error that a model leaves beyond the noise of the sensor: effects of arm or sensor that it does not contain. The uncertainty of its
//! parameters says nothing of it, but programs will have it.

use serde::Serialize;

use super::repeats::Repeats;
use super::rounded_log::RoundedLog;
use crate::measurement::dataset::Sensor;
use crate::measurement::noise_floor::NoiseFloor;
use truegrind_arm::estimated::beyond_noise::ErringArm;
use truegrind_arm::estimated::{Estimated, StageErrors};
use truegrind_math::se3::Pose;
use truegrind_math::statistics::ErrorSummary;

/// Error of a position (mm RMS) that a model leaves.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum BeyondNoise {
    /// Beyond the scatter of repeated poses; 0 where that explains it.
    Known(f64),
    /// No poses were repeated, so all that is left may be noise, or all of it the arm's.
    AtMost(f64),
    /// No poses were repeated; a part that differs from pose to pose is seen all the same.
    Between {
        /// That part.
        least_mm: f64,
        /// All that is left.
        most_mm: f64,
    },
}

/// Error of a model that lacks causes, over that with all of them, from which it lacks something.
const LACKS: f64 = 1.02;

/// The error of a position over what the sensor sees of it.
fn of_position(sensor: Sensor) -> f64 {
    if sensor == Sensor::Cable { 3_f64.sqrt() } else { 1.0 }
}

/// Mean square error of a row (mm²) from fitted and held-out rows together. p parameters, in rows that would determine them, make the errors of
/// n fitted rows smaller by 1 − p/n, and those of held-out rows larger by 1 + p/n, since they are uncertain, which is stated elsewhere. More
/// than half of the fitted rows are not taken for p, since priors hold the rest.
fn mean_square(errors: &StageErrors, parameters: f64) -> f64 {
    let of = |summary: &ErrorSummary| match summary.count {
        0 => (0.0, 0.0),
        count => (count as f64, count as f64 * summary.rmse.powi(2)),
    };
    let ((fitted, of_fitted), (held_out, of_held_out)) = (of(&errors.fitted), of(&errors.held_out));
    let share = if fitted > 0.0 { (parameters / fitted).min(0.5) } else { 0.0 };
    (of_fitted + of_held_out) / (fitted * (1.0 - share) + held_out * (1.0 + share))
}

/// The same of a fit with so many parameters.
pub(super) fn mean_square_of(errors: &StageErrors, parameters: usize, sensor: Sensor) -> f64 {
    mean_square(errors, parameters as f64 / sensor.scalars() as f64)
}

impl BeyondNoise {
    /// From the errors of a model with so many parameters and the scatter of repeated poses.
    ///
    /// A cable sees one coordinate of the error, taken as alike in all three. Without repeated poses the smaller of held-out and fitted error
    /// counts: of few rows the held-out error is large because the parameters are uncertain, which is stated elsewhere. With them the
    /// expected excess counts, whether or not chance might explain it: what is not significant of some fifty rows is several times the
    /// uncertainty of the parameters.
    pub fn of(errors: &StageErrors, parameters: usize, sensor: Sensor, repeats: Option<&NoiseFloor>) -> Self {
        let of_position = of_position(sensor);
        let Some(floor) = repeats else {
            return Self::AtMost(of_position * errors.held_out.rmse.min(errors.fitted.rmse));
        };
        let square = mean_square_of(errors, parameters, sensor);
        Self::Known(of_position * (square - floor.sigma_mm.powi(2)).max(0.0).sqrt())
    }

    /// From the errors of a model with so many parameters and what the scatter of repeated poses is made of, where that is known.
    pub(super) fn beside(
        errors: &StageErrors,
        parameters: usize,
        sensor: Sensor,
        repeats: Option<&Repeats>,
    ) -> Self {
        let Some(repeats) = repeats else { return Self::of(errors, parameters, sensor, None) };
        let square = mean_square_of(errors, parameters, sensor);
        Self::Known(of_position(sensor) * repeats.beyond(square).sqrt())
    }

    /// Beside rounding of the log, which is no error of the arm: its RMS in the readings (mm).
    pub fn less_rounding(self, rounding_mm: Option<f64>, sensor: Sensor) -> Self {
        match (self, rounding_mm) {
            (Self::AtMost(mm), Some(rounding_mm)) => {
                Self::AtMost((mm.powi(2) - (of_position(sensor) * rounding_mm).powi(2)).max(0.0).sqrt())
            }
            _ => self,
        }
    }

    /// Beside a log that rounds, which is no error of the arm: what else there is, less the scatter of repeated poses. These are rounded to the
    /// same angles, so that their scatter has none of the rounding.
    pub(crate) fn beside_rounded_log(
        self,
        rounded: &RoundedLog,
        repeats: Option<&NoiseFloor>,
        sensor: Sensor,
    ) -> Self {
        let other_mm = of_position(sensor) * rounded.other_mm;
        match (self, repeats) {
            (Self::Known(mm), Some(floor)) => {
                let floor_mm = of_position(sensor) * floor.sigma_mm;
                Self::Known(mm.min((other_mm.powi(2) - floor_mm.powi(2)).max(0.0).sqrt()))
            }
            _ => self,
        }
    }

    /// Of a model that lacks some of the causes with which `self` was judged: `all` are the errors with them, `own` those of the model.
    /// `of_arm`: what it lacks is the arm's, not the sensor's.
    pub fn of_submodel(self, all: &StageErrors, own: &StageErrors, sensor: Sensor, of_arm: bool) -> Self {
        let [all_mm, own_mm] = [all, own].map(|errors| errors.held_out.rmse.min(errors.fitted.rmse));
        if !(own_mm > LACKS * all_mm) {
            return self;
        }
        let lacking_mm = of_position(sensor) * (own_mm.powi(2) - all_mm.powi(2)).sqrt();
        match self {
            Self::Known(mm) if of_arm => Self::Known(mm.hypot(lacking_mm)),
            Self::Known(_) => self,
            Self::AtMost(most_mm) if of_arm => {
                Self::Between { least_mm: lacking_mm, most_mm: most_mm.hypot(lacking_mm) }
            }
            Self::AtMost(most_mm) => Self::AtMost(most_mm.hypot(lacking_mm)),
            Self::Between { least_mm, most_mm } if of_arm => {
                Self::Between { least_mm: least_mm.hypot(lacking_mm), most_mm: most_mm.hypot(lacking_mm) }
            }
            Self::Between { least_mm, most_mm } => {
                Self::Between { least_mm, most_mm: most_mm.hypot(lacking_mm) }
            }
        }
    }

    /// At least a scatter of the arm (mm), which is seen without repeated poses too.
    pub fn at_least_scatter(self, scatter_mm: f64) -> Self {
        match self {
            Self::Known(mm) => Self::Known(mm.max(scatter_mm)),
            Self::AtMost(most_mm) if scatter_mm > 0.0 => {
                Self::Between { least_mm: scatter_mm, most_mm: most_mm.max(scatter_mm) }
            }
            Self::Between { least_mm, most_mm } => {
                Self::Between { least_mm: least_mm.max(scatter_mm), most_mm: most_mm.max(scatter_mm) }
            }
            Self::AtMost(_) => self,
        }
    }

    /// The error beyond the noise (mm) if all that is left is the arm's.
    pub fn most_mm(self) -> f64 {
        match self {
            Self::Known(mm) => mm,
            Self::AtMost(most_mm) | Self::Between { most_mm, .. } => most_mm,
        }
    }

    /// The error beyond the noise (mm), as far as that is known.
    pub fn known_mm(self) -> Option<f64> {
        match self {
            Self::Known(mm) | Self::Between { least_mm: mm, .. } => Some(mm),
            Self::AtMost(_) => None,
        }
    }
}

fn erring(estimated: &Estimated) -> ErringArm<'_> {
    let Estimated { model, condition, region, .. } = estimated;
    ErringArm { model, condition, samples_deg: &region.samples_deg }
}

/// The errors of the joints' angles (rad) that move the target by `beyond_mm`, over the region of the arm.
pub(crate) fn joint_errors_rad(
    estimated: &Estimated,
    flange_from_target: &Pose,
    beyond_mm: f64,
) -> Option<[f64; 6]> {
    erring(estimated).joint_errors_rad(flange_from_target, beyond_mm)
}

/// Distance of a tip from the flange for which its error is stated (mm).
const TIP_MM: f64 = 300.0;

/// How many times that of the target it is from which it is stated.
const STATED_FROM: f64 = 1.3;

/// What the errors beyond the noise, which move the target by `beyond_mm`, do to a longer tool; `None` where the target is as far out.
pub(crate) fn longer_tool(estimated: &Estimated, beyond_mm: f64) -> Option<String> {
    let tip = Pose::translation(0.0, 0.0, TIP_MM);
    let tip_mm = erring(estimated).displacement_mm(&tip, &estimated.beyond_noise_rad?);
    (tip_mm > STATED_FROM * beyond_mm).then(|| {
        format!(
            "the target sits close to the flange: errors that the model does not contain move it by {beyond_mm:.3} mm RMS. If they are errors of \
             the joint angles, they move a tool tip {TIP_MM:.0} mm in front of the flange by about {tip_mm:.3} mm RMS, and more if the tip is off \
             the axis of joint 6. `compensate` includes this for the tool of each program"
        )
    })
}
