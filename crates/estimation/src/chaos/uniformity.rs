//! Uniformity of a chaotic sequence on the unit interval, and the significance of differences.
//!
//! **Method.** The first m points of a sequence are counted in N bins, and the standard deviation of the counts is
//! computed (ltlm-2024 eq. 12, with N − 1) for each of many starts. For random points its expectation is
//! √(m/N · (1 − 1/N)), with a relative sampling spread of about √(1/(2(N − 1))): smaller differences are noise.
//!
//! **Source and departures.** Liu et al. 2024, eq. 12, Figs 2 and 3: 50 bins, 1,000 points, one unstated start,
//! r from 0 to 4; "r = 0.5 achieves the best uniformity". Here every r has many starts and two lengths. With 1,000
//! points r = 0.5 and its neighbours cannot be distinguished from each other or from random points; with 100,000
//! points the density of the map itself is visible, and r = 0.5 is among the less uniform of the small r. The claim
//! is sampling noise. It is harmless: the identification does not depend on the uniformity of some ten points.
//!
//! **Checked against** random counts, and the figures above.

use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use rayon::prelude::*;
use serde::{Deserialize, Serialize};

use crate::chaos::map::Map;
use truegrind_math::statistics::mean_and_deviation;

options! {
    /// Options of the count. The defaults are those of the paper, with many starts.
    #[derive(Copy)]
    pub struct Options {
        /// Points of each sequence.
        pub points: usize = 1_000,
        /// Bins of equal width.
        pub bins: usize = 50,
        /// Number of sequences, each from a different start.
        pub starts: usize = 100,
        /// Seed of the starts.
        pub seed: u64 = 0,
    }
}

/// Equation 12 over many starts.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Uniformity {
    /// Mean over the starts of the standard deviation of the counts.
    pub deviation: f64,
    /// Standard deviation over the starts.
    pub spread: f64,
    /// Expected value for independent uniform random points.
    pub random: f64,
    /// Sampling spread of that value.
    pub random_spread: f64,
}

/// Counts of the first `points` of a sequence in bins of equal width (Fig. 3b).
pub fn counts(map: Map, start: f64, points: usize, bins: usize) -> Vec<usize> {
    let mut counts = vec![0; bins];
    for x in map.sequence(start).take(points) {
        if let Some(count) = counts.get_mut((x * bins as f64) as usize) {
            *count += 1;
        }
    }
    counts
}

/// Uniformity of a map over many starts.
pub fn uniformity(map: Map, options: &Options) -> Uniformity {
    let mut rng = ChaCha8Rng::seed_from_u64(options.seed);
    let starts: Vec<f64> = (0..options.starts).map(|_| rng.random_range(0.01..0.99)).collect();
    let deviations: Vec<f64> = starts
        .into_par_iter()
        .map(|start| {
            let counts = counts(map, start, options.points, options.bins);
            mean_and_deviation(&counts.iter().map(|c| *c as f64).collect::<Vec<_>>()).1
        })
        .collect();
    let (deviation, spread) = mean_and_deviation(&deviations);
    let bins = options.bins as f64;
    let random = (options.points as f64 / bins * (1.0 - 1.0 / bins)).sqrt();
    Uniformity { deviation, spread, random, random_spread: random / (2.0 * (bins - 1.0)).sqrt() }
}

/// Uniformity of the logistic-tent map at one r, for a short and a long sequence.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Point {
    /// Parameter of the map.
    pub r: f64,
    /// With the points of the short sequence.
    pub short: Uniformity,
    /// With the points of the long sequence.
    pub long: Uniformity,
}

/// Figure 2 with its statistics: the logistic-tent map over r.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Study {
    /// One entry for each r.
    pub points: Vec<Point>,
    /// Conclusion for the claimed r.
    pub verdict: UniformityVerdict,
}

/// Whether one r is more uniform than all others.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct UniformityVerdict {
    /// The r that is claimed to be best.
    pub claimed: f64,
    /// The r with the smallest deviation of the short sequence.
    pub best_short: f64,
    /// The r with the smallest deviation of the long sequence.
    pub best_long: f64,
    /// Number of other r within one sampling spread of the claimed one, or better, in the short sequence.
    pub indistinguishable_short: usize,
    /// Number of r that are better than the claimed one by more than one sampling spread in the long sequence.
    pub better_long: usize,
    /// Whether the claim is sampling noise: the short sequence does not distinguish the claimed r, and the long one
    /// prefers another.
    pub sampling_noise: bool,
}

/// Runs the study over `rs` (Fig. 2: 0 to 4), with sequences of `options.points` and of `long_points`, and
/// judges `claimed`.
pub fn study(rs: &[f64], claimed: f64, long_points: usize, options: &Options) -> Study {
    let long_options = Options { points: long_points, ..*options };
    let point = |r: f64| {
        let map = Map::LogisticTent { r };
        Point { r, short: uniformity(map, options), long: uniformity(map, &long_options) }
    };
    let points: Vec<Point> = rs.iter().map(|r| point(*r)).collect();
    let reference = point(claimed);
    let best = |size: fn(&Point) -> f64| {
        points.iter().min_by(|a, b| size(a).total_cmp(&size(b))).map_or(claimed, |best| best.r)
    };
    let others = || points.iter().filter(|point| point.r != claimed);
    let near = |p: &&Point| p.short.deviation <= reference.short.deviation + reference.short.spread;
    let better = |p: &&Point| p.long.deviation < reference.long.deviation - reference.long.spread;
    let (indistinguishable_short, better_long) =
        (others().filter(near).count(), others().filter(better).count());
    let verdict = UniformityVerdict {
        claimed,
        best_short: best(|p| p.short.deviation),
        best_long: best(|p| p.long.deviation),
        indistinguishable_short,
        better_long,
        sampling_noise: indistinguishable_short > 0 && better_long > 0,
    };
    Study { points, verdict }
}
