//! The measured poses of a recipe, their order and conditions.

use nalgebra::Point3;
use rand::RngExt;

use super::error::RecipeError;
use super::recipe::{Approach, Poses, Recipe, RunConditions};
use super::stream::{Stream, stream};
use crate::measurement::sensor::Rig;
use truegrind_arm::condition::Condition;
use truegrind_arm::model::{Joints, Model};
use truegrind_math::work::checkpoint;

/// Draws for each pose before the recipe counts as infeasible.
const TRIES: usize = 10_000;
/// Upper limit of all draws, or a hundred for each pose if that is more.
const MAX_TRIES: usize = 5_000_000;

/// One planned row.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Planned {
    pub(super) joints: Joints,
    pub(super) condition: Condition,
    pub(super) anchor: usize,
    pub(super) station: usize,
}

pub(super) fn plan(recipe: &Recipe, nominal: &Model, rigs: &[Rig]) -> Result<Vec<Planned>, RecipeError> {
    let (poses, repeats) = distinct(recipe, nominal, rigs)?;
    let mut rng = stream(recipe.seed, Stream::Conditions);
    let mut out = Vec::new();
    let mut before: Option<Joints> = None;
    // Repeats follow the whole round, so that they include the drift of the run; with several stations, before the sensor is moved on.
    let rounds =
        poses.chunk_by(|a, b| a.1 == b.1).flat_map(|round| (0..repeats.max(1)).flat_map(move |_| round));
    for (joints, station) in rounds {
        let sides: Vec<[i8; 6]> = match recipe.conditions.approach {
            Approach::Unknown => vec![[0; 6]],
            Approach::Random => vec![std::array::from_fn(|_| if rng.random_bool(0.5) { 1 } else { -1 })],
            // An increasing joint angle approaches from below (−1).
            Approach::Sequence => vec![std::array::from_fn(|j| match &before {
                Some(from) if joints[j] > from[j] => -1,
                Some(from) if joints[j] < from[j] => 1,
                _ => 0,
            })],
            Approach::Both => vec![[-1; 6], [1; 6]],
        };
        before = Some(*joints);
        for approach in sides {
            for anchor in 0..recipe.sensor.anchors() {
                let condition = Condition { approach, ..Condition::default() };
                out.push(Planned { joints: *joints, condition, anchor, station: *station });
            }
        }
    }
    set_conditions(&mut out, &recipe.conditions);
    Ok(out)
}

fn set_conditions(rows: &mut [Planned], conditions: &RunConditions) {
    let last = rows.len().saturating_sub(1).max(1) as f64;
    for (i, row) in rows.iter_mut().enumerate() {
        let condition = &mut row.condition;
        condition.time_h = conditions.hours.map(|hours| hours * i as f64 / last);
        condition.temperature_c = conditions
            .temperature
            .zip(condition.time_h)
            .map(|(warm, t)| warm.end_c + (warm.start_c - warm.end_c) * (-t / warm.time_constant_h).exp());
        let payloads = &conditions.payload_kg;
        condition.payload_kg = (!payloads.is_empty()).then(|| payloads[i % payloads.len()]);
        condition.payload_centre_mm = conditions.payload_centre_mm;
    }
}

/// The distinct poses, each with the station that sees it, and how often each is measured.
fn distinct(
    recipe: &Recipe,
    nominal: &Model,
    rigs: &[Rig],
) -> Result<(Vec<(Joints, usize)>, usize), RecipeError> {
    let arm = nominal.at_condition(&Condition::default());
    let station_of = |pose: usize, poses: usize| pose * rigs.len() / poses.max(1);
    let seen = |(q, station): &(Joints, usize)| {
        checkpoint();
        let rig = &rigs[*station];
        let flange = arm.forward(q);
        let at = flange * Point3::from(rig.target_on_flange_mm());
        let inside =
            recipe.view.box_mm.is_none_or(|[low, high]| (0..3).all(|k| (low[k]..=high[k]).contains(&at[k])));
        let limits = recipe.view.limits();
        inside && (0..recipe.sensor.anchors()).all(|anchor| rig.sees(&limits, &flange, anchor))
    };
    let from_degrees = |q: &[f64; 6]| Joints::from_fn(|j, _| q[j].to_radians());
    let (poses, repeats, wanted, tries) = match &recipe.poses {
        Poses::Random { count, margin_deg, min_deg, max_deg, repeats } => {
            let limits = &nominal.limits;
            let margin = margin_deg.to_radians();
            let low: [f64; 6] = std::array::from_fn(|j| {
                let own = min_deg.map_or(f64::MIN, |m| m[j].to_radians());
                own.max(limits.min_rad[j] + margin)
            });
            let high: [f64; 6] = std::array::from_fn(|j| {
                let own = max_deg.map_or(f64::MAX, |m| m[j].to_radians());
                own.min(limits.max_rad[j] - margin)
            });
            if let Some(j) = (0..6).find(|&j| (low[j]..=high[j]).is_empty()) {
                return Err(RecipeError::Invalid {
                    key: format!("poses, joint {j}"),
                    found: format!("{:.3}° to {:.3}°", low[j].to_degrees(), high[j].to_degrees()),
                    expected: "a range inside the joint limits and their margin",
                });
            }
            let mut rng = stream(recipe.seed, Stream::Poses);
            let mut poses = Vec::with_capacity(*count);
            let mut tries = 0;
            let most = (TRIES * count).min(MAX_TRIES.max(100 * count));
            while poses.len() < *count && tries < most {
                tries += 1;
                let q = Joints::from_fn(|j, _| low[j] + (high[j] - low[j]) * rng.random::<f64>());
                let pose = (q, station_of(poses.len(), *count));
                if limits.sums.iter().all(|sum| sum.holds(&q, -margin)) && seen(&pose) {
                    poses.push(pose);
                }
            }
            (poses, *repeats, *count, tries)
        }
        Poses::Grid { min_deg, max_deg, steps, repeats } => {
            let count: usize = steps.iter().product();
            let at = |mut index: usize| {
                let mut q = [0.0; 6];
                for j in (0..6).rev() {
                    let step = index % steps[j];
                    index /= steps[j];
                    let share = if steps[j] > 1 { step as f64 / (steps[j] - 1) as f64 } else { 0.5 };
                    q[j] = min_deg[j] + (max_deg[j] - min_deg[j]) * share;
                }
                from_degrees(&q)
            };
            let all = (0..count).map(|index| (at(index), station_of(index, count)));
            (all.filter(seen).collect(), *repeats, 1, count)
        }
        Poses::List { joints_deg, repeats } => {
            let count = joints_deg.len();
            let all = joints_deg.iter().enumerate();
            let all = all.map(|(index, q)| (from_degrees(q), station_of(index, count)));
            (all.filter(seen).collect(), *repeats, 1, count)
        }
    };
    if poses.len() < wanted.max(1) {
        return Err(RecipeError::NoPose { found: poses.len(), wanted: wanted.max(1), tries });
    }
    Ok((poses, repeats))
}
