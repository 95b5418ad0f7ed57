//! How large an effect is beside the noise, when all that geometry could explain is taken off.
//!
//! The readings with and without the effect differ by a vector. From it the part is taken that small changes of the arm's geometry,
//! of the sensor's place and of the target would make, by least squares without any bounds, so that what is left is
//! there for every tool. The worth is the root mean square of that rest over all lengths that were read, in standard
//! deviations of the noise.

use nalgebra::{DMatrix, DVector, UnitQuaternion, Vector3};
use rand::Rng;

use crate::arms::{Pose, Strain};
use crate::designs::Visit;
use crate::draw::scaled;
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

/// The least and greatest worth of an effect, in standard deviations of the noise.
pub const WORTH: (f64, f64) = (1.0, 20.0);

/// An effect that was given a size, beside a noise.
#[derive(Debug, Clone, PartialEq)]
pub struct Sized {
    /// The effect.
    pub hidden: Hidden,
    /// Standard deviation of a length (mm).
    pub sigma_mm: f64,
    /// What the effect is worth beside it.
    pub worth: f64,
}

/// Draws a size such as workshops meet, and a noise such as the sensor has beside which the effect is worth 1 to 20 of its standard
/// deviations. `None` where there is none.
pub fn sized(scene: &Scene<'_>, hidden: &Hidden, rng: &mut impl Rng) -> Option<Sized> {
    let (low, high) = scene.sensor.kind.noise();
    match hidden.shape {
        Shape::Nothing => {
            return Some(Sized { hidden: hidden.clone(), sigma_mm: scaled(rng, low, high), worth: 0.0 });
        }
        // Noise beside noise: geometry explains none of it.
        Shape::Correlated(_) => {
            let worth = scaled(rng, WORTH.0, WORTH.1);
            return Some(Sized { hidden: hidden.sized(worth), sigma_mm: scaled(rng, low, high), worth });
        }
        _ => {}
    }
    let (least, most) = hidden.shape.sizes();
    // Rather the larger ones: small ones leave only the finest sensors.
    let size = scaled(rng, least, most).max(scaled(rng, least, most));
    let hidden = hidden.sized(size);
    let rest = Measure::of(scene).sizes(scene, &hidden).1;
    let (least, most) = (WORTH.0.max(rest / high), WORTH.1.min(rest / low));
    if !(least < most) {
        return None;
    }
    let worth = scaled(rng, least, most);
    Some(Sized { hidden, sigma_mm: rest / worth, worth })
}
