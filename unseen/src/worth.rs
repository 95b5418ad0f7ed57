//! How large an effect is beside the noise, when all that geometry could explain is taken off.
//!
//! The readings with and without the effect differ by a vector. From it the part is taken that small changes of the arm's geometry,
//! of the sensor's place and of the target would make, by least squares without any bounds, so that what is left is
//! there for every tool. The worth is the root mean square of that rest over all lengths that were read, in standard
//! deviations of the noise.

use nalgebra::{DMatrix, DVector, UnitQuaternion, Vector3};

use crate::arms::{Pose, Strain};
use crate::designs::Visit;
use crate::hidden::{Hidden, Scene, Shape};
use crate::sensors::{Kind, Sensor};

/// Rows that are looked at, at most.
const ROWS: usize = 500;

/// The readings of some rows, and what geometry can do to them.
#[derive(Debug, Clone)]
pub struct Measure {
    visits: Vec<Visit>,
    plain: DVector<f64>,
    /// Orthonormal columns of what geometry explains.
    explained: DMatrix<f64>,
}

fn stacked(readings: impl Iterator<Item = Vec<f64>>) -> DVector<f64> {
    DVector::from_vec(readings.flatten().collect())
}

impl Measure {
    /// Prepares for a scene.
    pub fn of(scene: &Scene<'_>) -> Self {
        let stride = scene.walk.visits.len().div_ceil(ROWS);
        let visits: Vec<Visit> = scene.walk.visits.iter().step_by(stride).copied().collect();
        let read = |arm: &crate::arms::Arm, sensor: &Sensor| {
            stacked(visits.iter().map(|v| {
                let target = arm.flange(&v.q, &Strain::default()) * sensor.target;
                sensor.ideal(&target).lengths()
            }))
        };
        let plain = read(scene.arm, scene.sensor);
        let mut columns: Vec<DVector<f64>> = Vec::new();
        // Steps of 0.01 mm and 0.01 mrad: differences are linear to a millionth.
        let nudge = |pose: &Pose, k: usize| {
            let mut step = [Vector3::zeros(), Vector3::zeros()];
            step[k / 3][k % 3] = if k < 3 { 1e-2 } else { 1e-5 };
            pose * Pose::from_parts(step[0].into(), UnitQuaternion::from_scaled_axis(step[1]))
        };
        for i in 0..6 {
            for k in 0..6 {
                let mut arm = scene.arm.clone();
                arm.between[i] = nudge(&arm.between[i], k);
                columns.push(read(&arm, scene.sensor) - &plain);
            }
            let mut arm = scene.arm.clone();
            arm.zero[i] += 1e-5;
            columns.push(read(&arm, scene.sensor) - &plain);
        }
        for k in 0..6 {
            let moved = Sensor { place: nudge(&scene.sensor.place, k), ..*scene.sensor };
            columns.push(read(scene.arm, &moved) - &plain);
        }
        if scene.sensor.kind == Kind::Cable {
            let moved = Sensor { zero_mm: scene.sensor.zero_mm + 1e-2, ..*scene.sensor };
            columns.push(read(scene.arm, &moved) - &plain);
        }
        Self { visits, explained: orthonormal(columns), plain }
    }

    /// Root mean squares over the lengths of an effect (mm): all of it, and what geometry cannot explain.
    pub fn sizes(&self, scene: &Scene<'_>, hidden: &Hidden) -> (f64, f64) {
        let with = stacked(self.visits.iter().map(|v| hidden.reading(scene, v).lengths()));
        self.split((with - &self.plain).as_slice())
    }

    /// The same of any differences of readings, row by row (mm).
    pub fn split(&self, effect: &[f64]) -> (f64, f64) {
        let effect = DVector::from_column_slice(effect);
        let rest = &effect - &self.explained * (self.explained.transpose() * &effect);
        let count = (effect.len() as f64).sqrt();
        (effect.norm() / count, rest.norm() / count)
    }
}

/// Gram and Schmidt, twice; columns that others span are left out.
fn orthonormal(columns: Vec<DVector<f64>>) -> DMatrix<f64> {
    let mut out: Vec<DVector<f64>> = Vec::new();
    for column in columns {
        let size = column.norm();
        let mut rest = column;
        for _ in 0..2 {
            for known in &out {
                let share = known.dot(&rest);
                rest.axpy(-share, known, 1.0);
            }
        }
        if rest.norm() > 1e-5 * size && size > 0.0 {
            let length = rest.norm();
            out.push(rest / length);
        }
    }
    DMatrix::from_columns(&out)
}

/// No effect moves readings by more than this (mm, root mean square): an arm so wrong is not measured, it is mended.
const LARGEST_MM: f64 = 3.0;

/// Sets the size of an effect so that it is worth `wanted` standard deviations, and says what it is worth. `None` where it would
/// have to be larger than any effect is, or shows nothing that geometry does not.
pub fn sized(scene: &Scene<'_>, hidden: &Hidden, wanted: f64) -> Option<(Hidden, f64)> {
    match hidden.shape {
        Shape::Nothing => return Some((hidden.clone(), 0.0)),
        // Noise beside noise: geometry explains none of it.
        Shape::Correlated(_) => return Some((hidden.sized(wanted), wanted)),
        _ => {}
    }
    let measure = Measure::of(scene);
    let goal = wanted * scene.sensor.sigma_mm;
    let mut size = small(&hidden.shape);
    let mut seen = measure.sizes(scene, &hidden.sized(size)).1;
    let mut power = 1.0;
    for _ in 0..12 {
        if !(seen > 1e-12) || !seen.is_finite() {
            return None;
        }
        let factor = (goal / seen).powf(1.0 / power).clamp(1e-3, 1e3);
        let next = size * factor;
        let (all, rest) = measure.sizes(scene, &hidden.sized(next));
        if !(all < 50.0 * LARGEST_MM) {
            return None;
        }
        if (factor - 1.0).abs() > 1e-3 {
            power = ((rest / seen).ln() / factor.ln()).clamp(0.4, 3.0);
        }
        (size, seen) = (next, rest);
        if (seen / goal - 1.0).abs() < 1e-3 {
            return (all <= LARGEST_MM).then(|| (hidden.sized(size), seen / scene.sensor.sigma_mm));
        }
    }
    None
}

/// A small size of a shape, to begin with.
fn small(shape: &Shape) -> f64 {
    use crate::hidden::{arm, sensor};
    match shape {
        Shape::Arm(arm::Shape::Hardening { .. } | arm::Shape::DeadBand { .. }) => 1e-6,
        Shape::Arm(_) => 1e-5,
        Shape::Sensor(sensor::Shape::Pulley) => 1.0,
        Shape::Sensor(sensor::Shape::Drum { .. } | sensor::Shape::Catenary { .. }) => 1e-3,
        Shape::Sensor(sensor::Shape::Refraction { .. }) => 1.0,
        Shape::Sensor(sensor::Shape::Nest { .. }) | Shape::Drift(_) => 0.01,
        Shape::Latency(_) => 1e-6,
        Shape::Unsettled(..) => 1e-5,
        Shape::Nothing | Shape::Correlated(_) => 1.0,
    }
}
