//! Uniformity of the logistic-tent map over r: ltlm-2024 Figs 2 and 3, with the statistics that distinguish a property of
//! the map from sampling noise.
//!
//! The paper counts 1,000 points in 50 bins, from one start, and finds r = 0.5 "most uniform". The counts of random points
//! scatter by some 4.4, as much as the values of r differ. With 100,000 points the density of the map itself becomes
//! visible. See [`chaos::uniformity`](truegrind_estimation::chaos::uniformity).

use serde::Serialize;

use crate::experiment::Uniformity;
use truegrind_estimation::chaos::map::Map;
use truegrind_estimation::chaos::uniformity::{self, Options, Study, Uniformity as Evenness};

/// The result.
#[derive(Debug, Clone, PartialEq)]
pub struct UniformityResult {
    /// Settings of the experiment.
    pub settings: Uniformity,
    /// Figure 2 for both lengths.
    pub study: Study,
    /// Figure 3a: the first points of one sequence with the claimed r.
    pub points: Vec<f64>,
    /// The maps of Table 2 with their usual parameters.
    pub maps: Vec<MapEvenness>,
}

/// Uniformity of one map.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct MapEvenness {
    /// The map.
    pub map: Map,
    /// With the points of the short sequence.
    pub short: Evenness,
    /// With the points of the long sequence.
    pub long: Evenness,
}

/// Start of the sequence of Fig. 3; not stated in the paper.
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
        maps: Map::ALL
            .into_iter()
            .map(|map| MapEvenness {
                map,
                short: uniformity::uniformity(map, &options),
                long: uniformity::uniformity(map, &Options { points: settings.long_points, ..options }),
            })
            .collect(),
    }
}
