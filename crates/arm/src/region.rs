//! Measured region of an arm: joint ranges and a thinned cloud of poses, to detect programs that leave it.

use rayon::prelude::*;
use serde::{Deserialize, Serialize};

use crate::joints::Joints;

/// The measured region of an estimated arm.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Region {
    /// Lowest measured joint angles (°).
    pub min_deg: [f64; 6],
    /// Highest measured joint angles (°).
    pub max_deg: [f64; 6],
    /// Measured joint vectors (°), thinned so that they are far from each other.
    pub samples_deg: Vec<[f64; 6]>,
    /// Typical distance of a measured pose to its nearest neighbour among the samples [°, Euclidean in joint space].
    pub spacing_deg: f64,
    /// Largest predicted standard deviation of the flange's position over the measured poses (mm).
    pub sigma_mm: f64,
}

/// How a pose leaves the measured region.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Outside {
    /// One joint is outside the range in which it was measured.
    Joint {
        /// Joint, 0-based.
        joint: usize,
        /// By how much (°).
        by_deg: f64,
    },
    /// All joints are in range, but no measured pose is near.
    Coverage {
        /// Distance to the nearest measured pose over the distance that measured poses have, above 1.
        ratio: f64,
    },
}

/// Poses kept in a region.
const MAX_SAMPLES: usize = 200;

/// A joint may leave its measured range by this much without a flag (°): rounding of logs and programs.
const SLACK_DEG: f64 = 0.5;

/// A pose may lie this many spacings from its nearest measured neighbour without a flag.
const SPACINGS: f64 = 2.0;

fn square(a: &[f64; 6], b: &[f64; 6]) -> f64 {
    a.iter().zip(b).map(|(a, b)| (a - b) * (a - b)).sum()
}

fn distance(a: &[f64; 6], b: &[f64; 6]) -> f64 {
    square(a, b).sqrt()
}

/// Poses that one thread processes at a time.
const CHUNK: usize = 8192;

/// Updates each pose's distance to the nearest sample with one more; returns the farthest pose, the last of several.
fn farthest(nearest: &mut [f64], poses: &[[f64; 6]], sample: &[f64; 6]) -> Option<(usize, f64)> {
    let last = |a: &(usize, f64), b: &(usize, f64)| a.1.total_cmp(&b.1).then(a.0.cmp(&b.0));
    let chunks = nearest.par_chunks_mut(CHUNK).zip(poses.par_chunks(CHUNK)).enumerate();
    let farthest = chunks.filter_map(|(chunk, (nearest, poses))| {
        nearest.iter_mut().zip(poses).for_each(|(d, pose)| *d = d.min(distance(pose, sample)));
        let indexed = nearest.iter().enumerate().map(|(k, d)| (chunk * CHUNK + k, *d));
        indexed.max_by(last)
    });
    farthest.max_by(last)
}

impl Region {
    /// The region of measured joint vectors (rad); `sigma_mm` as in the field. Cost: 200 n distances.
    pub fn of<'q>(joints: impl IntoIterator<Item = &'q Joints>, sigma_mm: f64) -> Self {
        let degrees: Vec<[f64; 6]> =
            joints.into_iter().map(|q| std::array::from_fn(|i| q[i].to_degrees())).collect();
        let mut min_deg = [f64::INFINITY; 6];
        let mut max_deg = [f64::NEG_INFINITY; 6];
        for q in &degrees {
            for i in 0..6 {
                min_deg[i] = min_deg[i].min(q[i]);
                max_deg[i] = max_deg[i].max(q[i]);
            }
        }
        // Farthest-point thinning: each new sample is the pose farthest from those taken.
        let mut nearest = vec![f64::INFINITY; degrees.len()];
        let mut samples_deg: Vec<[f64; 6]> = Vec::new();
        let mut next = 0;
        while samples_deg.len() < MAX_SAMPLES.min(degrees.len()) {
            let taken = degrees[next];
            samples_deg.push(taken);
            let far = farthest(&mut nearest, &degrees, &taken);
            match far.filter(|&(_, d)| d > 0.0) {
                Some((i, _)) => next = i,
                None => break,
            }
        }
        // Spacing: how far samples lie from each other (95 % of them), or leftover poses from the samples.
        let mut gaps: Vec<f64> = samples_deg
            .iter()
            .enumerate()
            .map(|(i, a)| {
                let others = samples_deg.iter().enumerate().filter(|(j, _)| *j != i);
                others.map(|(_, b)| distance(a, b)).fold(f64::INFINITY, f64::min)
            })
            .filter(|d| d.is_finite())
            .collect();
        gaps.sort_by(f64::total_cmp);
        let spacing_deg = gaps.get((gaps.len() * 95 / 100).min(gaps.len().saturating_sub(1)));
        Self { min_deg, max_deg, samples_deg, spacing_deg: spacing_deg.copied().unwrap_or(0.0), sigma_mm }
    }

    /// Whether a joint vector (rad) leaves the region: the joint that leaves its range farthest, else coverage.
    ///
    /// ```
    /// use truegrind_arm::model::Joints;
    /// use truegrind_arm::region::{Outside, Region};
    ///
    /// // Poses on a grid of 10° over joints 1 and 2, all within ±20°.
    /// let degrees = |a: f64, b: f64| Joints::new(a.to_radians(), b.to_radians(), 0.0, 0.0, 0.0, 0.0);
    /// let grid: Vec<Joints> =
    ///     (-2..=2).flat_map(|i| (-2..=2).map(move |k| degrees(10.0 * f64::from(i), 10.0 * f64::from(k)))).collect();
    /// let region = Region::of(&grid, 0.02);
    /// assert_eq!(region.outside(&degrees(4.0, -13.0)), None);
    /// let Some(Outside::Joint { joint: 1, by_deg }) = region.outside(&degrees(0.0, 35.0)) else { panic!("joint 2 is out") };
    /// assert!((by_deg - 15.0).abs() < 1e-9);
    /// ```
    pub fn outside(&self, q: &Joints) -> Option<Outside> {
        self.outside_along(q, &mut NearestSample::default())
    }

    /// The same along a path: the nearest sample of the previous pose is tried first and updated in `last`. The result does not
    /// depend on it.
    pub fn outside_along(&self, q: &Joints, last: &mut NearestSample) -> Option<Outside> {
        let degrees: [f64; 6] = std::array::from_fn(|i| q[i].to_degrees());
        let beyond = |i: usize| (self.min_deg[i] - degrees[i]).max(degrees[i] - self.max_deg[i]);
        let worst = (0..6).max_by(|&a, &b| beyond(a).total_cmp(&beyond(b))).unwrap_or(0);
        if beyond(worst) > SLACK_DEG {
            return Some(Outside::Joint { joint: worst, by_deg: beyond(worst) });
        }
        let allowed = SPACINGS * self.spacing_deg.max(SLACK_DEG);
        let coverage = |nearest: f64| Some(Outside::Coverage { ratio: nearest.sqrt() / allowed });
        if let Some(sample) = self.samples_deg.get(last.index) {
            let here = square(sample, &degrees);
            if here <= allowed * allowed {
                return None;
            }
            // Triangle inequality: the others have come nearer by at most the distance that the pose has moved.
            if here.sqrt() <= last.others - distance(&last.at, &degrees) {
                return coverage(here);
            }
        }
        // The first sample near enough suffices. One whose first three joints alone are farther than the second nearest is skipped.
        let (mut nearest, mut second) = (f64::INFINITY, f64::INFINITY);
        for (index, sample) in self.samples_deg.iter().enumerate() {
            let part: f64 = sample[..3].iter().zip(&degrees).map(|(a, b)| (a - b) * (a - b)).sum();
            if part > second {
                continue;
            }
            let whole = square(sample, &degrees);
            if whole <= allowed * allowed {
                *last = NearestSample { index, at: degrees, others: f64::NEG_INFINITY };
                return None;
            }
            if whole < nearest {
                (nearest, second, last.index) = (whole, nearest, index);
            } else {
                second = second.min(whole);
            }
        }
        (last.at, last.others) = (degrees, second.sqrt());
        coverage(nearest)
    }
}

/// The nearest sample of the previous pose.
#[derive(Debug, Clone, PartialEq)]
pub struct NearestSample {
    index: usize,
    /// That pose (°).
    at: [f64; 6],
    /// No other sample was nearer to it than this (°).
    others: f64,
}

impl Default for NearestSample {
    fn default() -> Self {
        Self { index: 0, at: [0.0; 6], others: f64::NEG_INFINITY }
    }
}
