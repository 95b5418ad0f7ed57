//! Whether the readings scatter as much as the track counts with.
//!
//! The noise of a track is at least the model's held-out error, which holds what the model leaves out. If the filter finds parameters that
//! leave less, or the model was written with fewer than the data determine, it is too large, and changes of that size are not seen. After
//! the first poses, the noise is judged by the innovations themselves: the σ under which their median is that of χ². Only a σ that is
//! several times too large is replaced, and only where the poses spread as the model's did: a small part of the region does not show what
//! the model leaves out elsewhere. A σ that the user stated stays.
//!
//! Under a σ that stays too large, no bound is exceeded; that the readings fit several times less well than at the beginning shows all the
//! same.

use super::bounds::window_bound;
use super::state::PoseRecord;
use super::tracker::Tracker;

/// The noise is too large where readings scatter less than this share of it.
const FAR: f64 = 0.5;

/// The replaced noise: this many times what the innovations show, as what the model leaves out has longer tails.
const MARGIN: f64 = 1.25;

/// The first innovations tell of the model's uncertainty rather than of the noise.
const EARLY: usize = 10;

/// Steps to the noise that the innovations show.
const STEPS: usize = 6;

/// Halving the noise must raise the scatter by this factor; otherwise the innovations tell the uncertainty of the parameters only.
const TOLD: f64 = 1.2;

/// Scatter under the noise that the steps ended at.
const SETTLED: std::ops::Range<f64> = 0.7..1.4;

/// The poses spread as the model's did where each joint scatters by this share of the model's.
const SPREAD: f64 = 0.6;

/// Readings fit less well where they scatter this many times as much as at the beginning.
const WORSE: f64 = 2.0;

/// Poses before the noise is judged in words.
const MIN_POSES: usize = 30;

/// Readings that scatter far less than the track counts with.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Overstated {
    /// Noise that the track assumes, along each axis (mm).
    pub sigma_mm: f64,
    /// Noise that the readings show (mm).
    pub seen_mm: f64,
    /// Smallest change that is told at once: RMS displacement of the readings (mm).
    pub smallest_change_mm: f64,
}

impl Tracker {
    /// Noise that the readings show to be too large by far; `None` where it is not, or where poses are few.
    pub fn overstated_noise(&self) -> Option<Overstated> {
        let history = &self.state.history;
        let scatter = self.scatter(history.len()).filter(|s| history.len() >= MIN_POSES && *s < FAR)?;
        Some(Overstated {
            sigma_mm: self.state.sigma_mm,
            seen_mm: scatter * self.state.sigma_mm,
            smallest_change_mm: self.smallest_change_mm()?,
        })
    }

    /// How many times less well the latest readings fit than those at the beginning of the track, under a noise that is too large to tell it
    /// otherwise.
    pub fn worse_fit(&self) -> Option<f64> {
        let before = self.state.start_scatter.filter(|scatter| *scatter < FAR)?;
        let ratio = self.scatter(2 * self.state.options.window.max(1))? / before;
        (ratio > WORSE && self.state.alarms.is_empty()).then_some(ratio)
    }

    /// The noise that the first poses showed, and the larger one that the track began with (mm).
    pub fn replaced_noise_mm(&self) -> Option<[f64; 2]> {
        self.state.replaced_sigma_mm.map(|before| [self.state.sigma_mm, before])
    }

    /// RMS displacement of the readings (mm) by which a change exceeds the window's bound within one window.
    pub fn smallest_change_mm(&self) -> Option<f64> {
        let (window, per) = (self.state.options.window.max(1), self.state.sensor.scalars());
        let scatter = self.scatter(self.state.history.len())?;
        let rows = (window * per) as f64;
        let excess = (window_bound(window * per) - rows * scatter * scatter).max(0.0);
        Some(self.state.sigma_mm * (excess / window as f64).sqrt())
    }

    /// Replaces a noise that the innovations show to be several times too large, and filters the poses again.
    pub(super) fn judge_noise(&mut self) {
        let untouched = self.state.options.sigma_mm.is_none()
            && self.state.alarms.is_empty()
            && self.state.history.len() == self.state.poses;
        let far = |tracker: &Self| tracker.late_scatter().is_some_and(|scatter| scatter < FAR);
        if !(untouched && far(self) && self.spreads_as_the_model()) {
            return;
        }
        let mut share = 1.0;
        for _ in 0..STEPS {
            let Some(scatter) = self.with_noise(share).and_then(|t| t.late_scatter()) else { return };
            share *= scatter;
        }
        let scatter = |share: f64| self.with_noise(share).and_then(|t| t.late_scatter());
        let told = match (scatter(share), scatter(share / 2.0)) {
            (Some(at), Some(at_half)) => SETTLED.contains(&at) && at_half > TOLD * at,
            _ => false,
        };
        let share = MARGIN * share;
        if !(told && share < FAR) {
            return;
        }
        if let Some(mut judged) = self.with_noise(share) {
            judged.state.replaced_sigma_mm = Some(self.state.sigma_mm);
            *self = judged;
        }
    }

    /// The track so far with another noise, `share` times this one.
    fn with_noise(&self, share: f64) -> Option<Self> {
        let mut other = self.clone();
        let (sigma_mm, sigma_rad) = (self.state.sigma_mm, self.state.sigma_rad);
        other.state.sigma_mm = share * sigma_mm;
        other.state.sigma_rad = share * sigma_rad;
        other.filter = self.state.reference.filter()?;
        // A weight is 1/√(σ² + what rounded angles add).
        let weight = |per: f64, sigma: f64| {
            let rounded = (1.0 / (per * per) - sigma * sigma).max(0.0);
            if per > 0.0 { 1.0 / (rounded + (share * sigma).powi(2)).sqrt() } else { per }
        };
        for record in &mut other.state.history {
            record.per_mm = weight(record.per_mm, sigma_mm);
            record.per_rad = weight(record.per_rad, sigma_rad);
        }
        let mut poses: Vec<PoseRecord> = std::mem::take(&mut other.state.history);
        let problem = other.problem(&poses);
        other.state.outliers = 0;
        for (at, record) in poses.iter_mut().enumerate() {
            let registered = other.registered(at);
            let taken = other.update_about(&problem, at, registered.as_ref());
            record.nis = taken.nis;
            record.error_mm = other.error_mm(&problem, at, record.per_mm);
            other.state.outliers += usize::from(taken.set_aside);
        }
        other.state.history = poses;
        Some(other)
    }

    pub(super) fn late_scatter(&self) -> Option<f64> {
        self.scatter(self.state.history.len().checked_sub(EARLY).filter(|late| *late > 0)?)
    }

    fn spreads_as_the_model(&self) -> bool {
        let spread = |values: Vec<f64>| {
            let count = values.len().max(1) as f64;
            let mean = values.iter().sum::<f64>() / count;
            (values.iter().map(|v| (v - mean).powi(2)).sum::<f64>() / count).sqrt()
        };
        (0..6).all(|joint| {
            let of_model: Vec<f64> = self.initial.region.samples_deg.iter().map(|s| s[joint]).collect();
            let here: Vec<f64> = self.state.history.iter().map(|s| s.joints[joint].to_degrees()).collect();
            spread(here) >= SPREAD * spread(of_model)
        })
    }
}
