//! Further errors that a sensor may have beside its scale, as columns in the linearised readings: what a fit of the arm may have taken up
//! in their place.
//!
//! - A cable over a pulley at its outlet. With u the direction from the outlet to the hook, at an elevation ε above the horizontal, a
//!   pulley of radius r that swivels about the vertical makes the cable longer by r (ε − cos ε), beside a constant and terms of the order
//!   r²/d; one that is held otherwise, or guides, by second-degree harmonics of u.
//! - A cable wound in layers: second and third degree of its length.
//! - A camera whose lens distorts, or any other instrument whose scale changes over its field: the low degrees of the place in the field.
//!   A radial distortion k |l − c|² (l − c) about a centre c beside that of the poses has all degrees up to the third, and its axis is
//!   known only where the sensor frame is the camera's own; so symmetric first and all second degrees are free, and the third along the
//!   place and along what of it lies across the mean line of sight.
//!
//! None of these widths is stated by the user: they are the sizes that such parts have.

use nalgebra::{Point3, Vector3};

use super::fit::Fitted;
use crate::measurement::dataset::{Dataset, Sensor};
use crate::measurement::sensor::empirical::second_degree;
use truegrind_arm::condition::Condition;
use truegrind_math::statistics::extent;

/// A law of the sensor's error.
#[derive(Debug, Clone, Copy, PartialEq, Eq, serde::Serialize)]
#[serde(rename_all = "snake_case")]
pub enum SensorLaw {
    /// A cable over a pulley at its outlet.
    Pulley,
    /// A cable wound in layers.
    Drum,
    /// A field of a camera that is not true to scale everywhere.
    Lens,
}

/// Standard deviation of the radius of a pulley (mm).
const PULLEY_MM: f64 = 10.0;
/// Of the other harmonics of a cable's direction, and of the degrees of its length (mm).
const HARMONIC_MM: f64 = 0.5;
/// Of each degree of a camera's field, at the edge of the poses (mm).
const FIELD_MM: f64 = 0.5;

impl SensorLaw {
    /// The laws that a sensor may have.
    pub(super) fn of(sensor: Sensor) -> &'static [SensorLaw] {
        match sensor {
            Sensor::Cable => &[SensorLaw::Pulley, SensorLaw::Drum],
            Sensor::Position | Sensor::Pose => &[SensorLaw::Lens],
        }
    }

    /// Whether it counts only where it makes a model doubtful. A field of any shape follows part of whatever an arm leaves unexplained, so
    /// that it is no finding, but may show that the model is none either.
    pub(super) fn is_objection(self) -> bool {
        self == SensorLaw::Lens
    }

    /// Probability, before any reading, that the sensor has it.
    pub(super) fn probability(self) -> f64 {
        match self {
            SensorLaw::Pulley => 0.2,
            SensorLaw::Drum => 0.1,
            SensorLaw::Lens => 0.1,
        }
    }
}

/// The errors that a law makes of readings, per unit of parameters of standard deviation 1.
pub(super) struct SensorErrors<'a> {
    /// The law.
    pub(super) law: SensorLaw,
    /// Its parameters.
    pub(super) count: usize,
    /// Their errors in a row (mm): of a cable along x, otherwise in the base.
    at: ErrorsAt<'a>,
}

impl<'a> SensorErrors<'a> {
    pub(super) fn of(law: SensorLaw, fitted: &'a Fitted, dataset: &'a Dataset) -> Self {
        match law {
            SensorLaw::Pulley => Self { law, count: 6, at: pulley(fitted, dataset) },
            SensorLaw::Drum => Self { law, count: 2, at: drum(dataset) },
            SensorLaw::Lens => Self { law, count: LENS, at: lens(fitted, dataset) },
        }
    }

    /// The errors in a row.
    pub(super) fn at(&self, row: usize) -> Vec<Vector3<f64>> {
        (self.at)(row)
    }
}

type ErrorsAt<'a> = Box<dyn Fn(usize) -> Vec<Vector3<f64>> + Send + Sync + 'a>;

/// Errors of a length.
fn lengths(errors: &[f64]) -> Vec<Vector3<f64>> {
    errors.iter().map(|&error| Vector3::x() * error).collect()
}

fn pulley<'a>(fitted: &'a Fitted, dataset: &'a Dataset) -> ErrorsAt<'a> {
    let arm = fitted.model.at_condition(&Condition::default());
    let hook = Point3::from(fitted.frames.flange_from_target.translation.vector);
    let outlets = &fitted.frames.outlets_mm;
    let up = (-fitted.model.gravity).try_normalize(1e-9).unwrap_or_else(Vector3::z);
    Box::new(move |row| {
        let row = &dataset.rows[row];
        let outlet = outlets[row.anchor.min(outlets.len().saturating_sub(1))];
        let away = ((arm.forward(&row.joints) * hook).coords - outlet).normalize();
        let sine = away.dot(&up).clamp(-1.0, 1.0);
        let [a, b, c, d, e] = second_degree(&away).map(|v| HARMONIC_MM * v);
        lengths(&[PULLEY_MM * (sine.asin() - (1.0 - sine * sine).sqrt()), a, b, c, d, e])
    })
}

fn drum(dataset: &Dataset) -> ErrorsAt<'_> {
    let [low, high] = extent(dataset.rows.iter().map(|row| row.reading.place_mm().x));
    Box::new(move |row| {
        let t = (2.0 * dataset.rows[row].reading.place_mm().x - low - high) / (high - low).max(1.0);
        lengths(&[0.5 * (3.0 * t * t - 1.0), 0.5 * (5.0 * t * t * t - 3.0 * t)].map(|v| HARMONIC_MM * v))
    })
}

/// Parameters of a camera's field: six of first degree, eighteen of second, two of third.
const LENS: usize = 26;

fn lens<'a>(fitted: &'a Fitted, dataset: &'a Dataset) -> ErrorsAt<'a> {
    let centre = mean_reading(dataset);
    let far_mm = dataset.rows.iter().map(|row| (row.reading.place_mm() - centre).norm()).fold(1.0, f64::max);
    let sight = centre.try_normalize(1e-9).unwrap_or_else(Vector3::z);
    let rotation = fitted.frames.base_from_sensor.rotation;
    Box::new(move |row| {
        let at = (dataset.rows[row].reading.place_mm() - centre) / far_mm;
        field_degrees(&at, &sight).map(|error| rotation * error * FIELD_MM).to_vec()
    })
}

/// The errors of each degree of a field at a place in it, of length 1 at its edge, under a line of sight.
fn field_degrees(at: &Vector3<f64>, sight: &Vector3<f64>) -> [Vector3<f64>; LENS] {
    let axes = [Vector3::x(), Vector3::y(), Vector3::z()];
    let pairs = [(0, 0), (1, 1), (2, 2), (0, 1), (1, 2), (2, 0)];
    let mut out = [Vector3::zeros(); LENS];
    for (k, &(i, j)) in pairs.iter().enumerate() {
        // Of the first degree an antisymmetric part would be a rotation of the sensor.
        out[k] = if i == j { axes[i] * at[i] } else { axes[i] * at[j] + axes[j] * at[i] };
        for (axis, along) in axes.iter().enumerate() {
            out[6 + 3 * k + axis] = along * (at[i] * at[j]);
        }
    }
    let across = at - sight * at.dot(sight);
    out[LENS - 2] = at * at.norm_squared();
    out[LENS - 1] = across * across.norm_squared();
    out
}

/// The mean reading, of a cable its length along x (mm).
pub(super) fn mean_reading(dataset: &Dataset) -> Vector3<f64> {
    let n = dataset.rows.len().max(1) as f64;
    dataset.rows.iter().map(|row| row.reading.place_mm() / n).sum()
}
