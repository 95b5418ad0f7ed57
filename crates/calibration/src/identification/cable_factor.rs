//! Lengths of a cable that fit no arm: whether they would as an encoder's counts, or if they fall as the cable leaves.
//!
//! Both are one factor on all lengths, which is searched for beside outlet, zero and hook: on a grid about the ratio of the spreads of readings
//! and flanges, then by golden sections. Eight unknowns, so that the rows must be several times as many.

use nalgebra::Vector3;

use crate::measurement::dataset::{Dataset, Reading};
use crate::measurement::registration::cable_and_hook;
use truegrind_arm::model::Model;
use truegrind_math::se3::Pose;

/// Fewest rows of a cable that are judged, and most.
const FEWEST: usize = 30;
const MOST: usize = 60;

/// An explanation leaves at most this share of the error, and of the flange's travel.
const SHARE: f64 = 0.1;
const OF_TRAVEL: f64 = 0.01;

/// A factor nearer to 1 is a scale error, which is told elsewhere.
const FAR: f64 = 1.5;

/// Spread of the flange over that of the cable's length: the ends of the grid, and its steps.
const SPREADS: [f64; 2] = [0.7, 8.0];
const STEPS: usize = 16;
const SECTIONS: usize = 16;

struct Cable {
    flanges: Vec<Pose>,
    lengths: Vec<f64>,
    /// RMS distance of the flanges from their mean (mm).
    travel_mm: f64,
}

/// What else the lengths may be, in a sentence part; `None` where nothing explains them.
pub(super) fn explanation(dataset: &Dataset, nominal: &Model) -> Option<String> {
    let cable = Cable::of(dataset, nominal)?;
    let stated_mm = cable.error_mm(1.0, 1.0);
    let found = [1.0, -1.0].map(|sign| (sign, cable.readings_per_mm(sign)));
    let (sign, (per_mm, left_mm)) = found.into_iter().min_by(|a, b| a.1.1.total_cmp(&b.1.1))?;
    if !(left_mm < SHARE * stated_mm && left_mm < OF_TRAVEL * cable.travel_mm) {
        return None;
    }
    let falling = (sign < 0.0).then(|| {
        "that they fall as the cable leaves: replace each by what the sensor reads with the cable drawn in, less the reading"
            .to_owned()
    });
    let counts = (per_mm.max(1.0 / per_mm) > FAR).then(|| {
        format!(
            "that {per_mm:.3} of their units are one millimetre: divide them by the counts per millimetre of the sensor's data sheet"
        )
    });
    let what: Vec<String> = falling.into_iter().chain(counts).collect();
    (!what.is_empty()).then(|| {
        format!("the readings of the cable fit to {left_mm:.1} mm if it is taken {}", what.join("; and "))
    })
}

impl Cable {
    /// Evenly some of the rows of the first outlet.
    fn of(dataset: &Dataset, nominal: &Model) -> Option<Self> {
        let (mut flanges, mut lengths) = (Vec::new(), Vec::new());
        for row in dataset.rows.iter().step_by(dataset.rows.len().div_ceil(MOST).max(1)) {
            if let (0, Reading::Cable(length)) = (row.anchor, &row.reading) {
                flanges.push(nominal.forward(&row.joints, &row.condition));
                lengths.push(*length);
            }
        }
        if flanges.len() < FEWEST {
            return None;
        }
        let count = flanges.len() as f64;
        let mean = flanges.iter().map(|f| f.translation.vector).sum::<Vector3<f64>>() / count;
        let square: f64 = flanges.iter().map(|f| (f.translation.vector - mean).norm_squared()).sum();
        Some(Self { flanges, lengths, travel_mm: (square / count).sqrt() })
    }

    /// RMS error if so many units of the readings are a millimetre, and fall where `sign` is −1.
    fn error_mm(&self, per_mm: f64, sign: f64) -> f64 {
        // With the cable drawn in furthest at about zero: the zero is fitted, but not from anywhere.
        let longest_mm = || self.lengths.iter().copied().fold(f64::NEG_INFINITY, f64::max);
        let drawn_in = if sign < 0.0 { longest_mm() } else { 0.0 };
        let read: Vec<f64> = self.lengths.iter().map(|length| (sign * length + drawn_in) / per_mm).collect();
        cable_and_hook(&self.flanges, &read).map_or(f64::INFINITY, |(found, _)| found.rmse_mm)
    }

    /// The units per millimetre under which the readings fit best, and the error that is left (mm).
    fn readings_per_mm(&self, sign: f64) -> (f64, f64) {
        let count = self.lengths.len() as f64;
        let mean = self.lengths.iter().sum::<f64>() / count;
        let spread = (self.lengths.iter().map(|l| (l - mean).powi(2)).sum::<f64>() / count).sqrt();
        let [low, high] = SPREADS.map(|ratio| (ratio * spread / self.travel_mm).ln());
        let step = (high - low) / STEPS as f64;
        let error_mm = |log: f64| self.error_mm(log.exp(), sign);
        let grid = (0..=STEPS).map(|k| low + step * k as f64);
        let best = grid.map(|log| (log, error_mm(log))).min_by(|a, b| a.1.total_cmp(&b.1));
        let (mut from, mut to) = best.map_or((low, high), |(log, _)| (log - step, log + step));
        let golden = (5f64.sqrt() - 1.0) / 2.0;
        for _ in 0..SECTIONS {
            let [a, b] = [to - golden * (to - from), from + golden * (to - from)];
            if error_mm(a) < error_mm(b) { to = b } else { from = a }
        }
        let log = (from + to) / 2.0;
        (log.exp(), error_mm(log))
    }
}
