//! How evenly the logistic-tent map fills its interval over r: ltlm-2024 Figs 2 and 3, with the statistics that tell a
//! property of the map from sampling noise.
//!
//! The paper counts 1,000 points in 50 bins, from one start, and finds r = 0.5 "most uniform". Random points scatter by
//! some 4.4 counts there, as much as the differences between the r. With 100,000 points the density of the map itself
//! shows. See [`chaos::uniformity`](crate::estimation::chaos::uniformity).

use crate::comparison::experiment::Uniformity;
use crate::estimation::chaos::map::Map;
use crate::estimation::chaos::uniformity::{self, Options, Study};

/// The result.
#[derive(Debug, Clone, PartialEq)]
pub struct UniformityResult {
    /// What was asked for.
    pub settings: Uniformity,
    /// Figure 2 for both lengths.
    pub study: Study,
    /// Figure 3a: the first points of one sequence with the claimed r.
    pub points: Vec<f64>,
    /// Figure 3b: their counts.
    pub counts: Vec<usize>,
}

/// Start of the sequence of Fig. 3; the paper does not state its own.
const START: f64 = 0.37;

/// Runs the study.
pub fn run(settings: &Uniformity, seed: u64) -> UniformityResult {
    let [low, high] = settings.range;
    let last = (settings.steps - 1).max(1) as f64;
    let rs: Vec<f64> = (0..settings.steps).map(|k| low + (high - low) * k as f64 / last).collect();
    let options = Options { points: settings.points, bins: settings.bins, starts: settings.starts, seed };
    let map = Map::LogisticTent { r: settings.claimed };
    UniformityResult {
        settings: settings.clone(),
        study: uniformity::study(&rs, settings.claimed, settings.long_points, &options),
        points: map.sequence(START).take(settings.points).collect(),
        counts: uniformity::counts(map, START, settings.points, settings.bins),
    }
}
