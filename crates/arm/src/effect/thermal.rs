//! Thermal drift: all link lengths grow while the arm warms up, by g (1 − e^(−(t − t₀)/T)) from the time t₀ on, or with a measured
//! temperature.
//!
//! Source: the first-order warm-up of industrial arms in Yin et al. 2014 (doi 10.1007/s00170-014-5902-y).

use serde::{Deserialize, Serialize};

use crate::condition::Condition;
use crate::effect::parameter::EffectParameter;

/// Growth of the links.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Thermal {
    /// Relative growth of the warm arm over the arm at t₀ g, by the clock.
    pub growth: f64,
    /// Time constant of warming up T (h).
    pub time_constant_h: f64,
    /// The time t₀ from which growth counts (h): that of the first measured row, since no data tell how warm the arm was before. 0 is when
    /// the arm was switched on.
    #[serde(default, skip_serializing_if = "is_zero")]
    pub start_h: f64,
    /// Relative growth per kelvin, by the thermometer.
    pub growth_per_k: f64,
    /// Temperature at which the links have their nominal lengths [°C].
    pub reference_c: f64,
}

/// Whether growth counts from when the arm was switched on, as in files without `start_h`.
#[allow(clippy::trivially_copy_pass_by_ref)] // Serde passes a reference.
fn is_zero(hours: &f64) -> bool {
    *hours == 0.0
}

impl Thermal {
    pub(super) fn parameters(&self) -> Vec<EffectParameter> {
        vec![
            EffectParameter { name: "growth", unit: "1", value: self.growth },
            EffectParameter { name: "growth per kelvin", unit: "1/K", value: self.growth_per_k },
        ]
    }

    pub(super) fn set(&mut self, index: usize, value: f64) {
        *(if index == 0 { &mut self.growth } else { &mut self.growth_per_k }) = value;
    }

    pub(super) fn growth(&self, condition: &Condition) -> f64 {
        let regressors = self.growth_regressors(condition);
        self.growth * regressors[0] + self.growth_per_k * regressors[1]
    }

    pub(super) fn growth_regressors(&self, condition: &Condition) -> Vec<f64> {
        vec![
            condition
                .time_h
                .map_or(0.0, |t| 1.0 - (-(t - self.start_h).max(0.0) / self.time_constant_h).exp()),
            condition.temperature_c.map_or(0.0, |t| t - self.reference_c),
        ]
    }
}
