//! Order spectrum of a joint's residual; finds reducer harmonics.
//!
//! For every joint, the projection of the residual on its rotation, by order n per turn: Σ aᵢ e^(i n uᵢ) with aᵢ = θᵢ·rᵢ,
//! over Σ |θᵢ|². Powers of e^(iu) follow by multiplication, so an order costs ten operations a row. Correlation with geometry
//! is ignored here, which can only underestimate a peak; the few strongest are then scored like any other candidate.

use std::sync::{Arc, OnceLock};

use nalgebra::DVector;
use rayon::prelude::*;

use super::catalogue::{Candidate, FINE, STILL_RAD};
use super::design::Design;
use super::extension::Subject;
use truegrind_arm::effect::Effect;
use truegrind_arm::effect::harmonic::Harmonic;
use truegrind_math::lanes::{AnyWidth, SinCos, WIDTH, vectorised};

/// The lowest order that is tried.
const MIN_ORDER: usize = 3;

/// Orders up to this are tried: twice the ratio of a strain-wave reducer of 1:160 is 320.
pub const MAX_ORDER: usize = 330;

/// χ² of a peak from which a fine map is tried.
const MAP_CHI_SQUARE: f64 = 25.0;

/// Peaks kept for each joint.
const KEPT: usize = 2;

/// (cosine, sine) of a joint's angle and of twice the angle, padded to whole blocks of rows.
struct JointHarmonics {
    once: [Vec<f64>; 2],
    twice: [Vec<f64>; 2],
    /// The candidate of each order, once it was asked for.
    candidates: Vec<OnceLock<Arc<Candidate>>>,
}

/// The turns of all joints that moved; they depend on no fit.
pub struct AngleHarmonics([Option<JointHarmonics>; 6]);

impl AngleHarmonics {
    /// Computes them for the rows of a data set.
    pub fn of(subject: &Subject<'_>) -> Self {
        let rows = &subject.observed.dataset.rows;
        let mapped: Vec<_> = rows.iter().map(|r| subject.nominal.mapped(&r.joints)).collect();
        Self(std::array::from_fn(|joint| {
            let angles = || mapped.iter().map(|q| q[joint]);
            let (low, high) =
                angles().fold((f64::INFINITY, f64::NEG_INFINITY), |(l, h), a| (l.min(a), h.max(a)));
            let both = |times: f64| {
                let padded = |f: fn(f64) -> f64| {
                    let mut out: Vec<f64> = angles().map(|a| f(times * a)).collect();
                    out.resize(out.len().next_multiple_of(ROWS), 0.0);
                    out
                };
                [padded(f64::cos), padded(f64::sin)]
            };
            (high - low > STILL_RAD).then(|| JointHarmonics {
                once: both(1.0),
                twice: both(2.0),
                candidates: (MIN_ORDER..=MAX_ORDER).map(|_| OnceLock::new()).collect(),
            })
        }))
    }
}

/// The strongest orders of a joint, with their χ².
fn strongest_orders(harmonics: &JointHarmonics, theta: &DVector<f64>, design: &Design) -> Vec<(f64, usize)> {
    let mut weight = 0.0;
    let mut pull = vec![0.0; design.observations.next_multiple_of(ROWS)];
    for (i, p) in pull.iter_mut().enumerate().take(design.observations) {
        for s in i * design.per..(i + 1) * design.per {
            *p += theta[s] * design.residual[s];
            weight += theta[s] * theta[s];
        }
    }
    let sums = vectorised(Orders { harmonics, pull: &pull });
    let of = |(order, [sine, cosine]): (usize, [f64; 2])| {
        (2.0 * (sine * sine + cosine * cosine) / weight.max(1e-300), order)
    };
    let mut lines: Vec<(f64, usize)> = (MIN_ORDER..=MAX_ORDER).zip(sums).map(of).collect();
    lines.sort_by(|a, b| b.0.total_cmp(&a.0).then(a.1.cmp(&b.1)));
    lines.truncate(KEPT);
    lines
}

/// Σ aᵢ sin(n uᵢ) and Σ aᵢ cos(n uᵢ) of every order n. Each sum is eight sums, of every eighth row, so that it does not depend on
/// the register width.
struct Orders<'a> {
    harmonics: &'a JointHarmonics,
    /// a, a multiple of [`ROWS`] of them.
    pull: &'a [f64],
}

/// Rows of a block, which remain in registers over all orders.
const ROWS: usize = 2 * WIDTH;

impl AnyWidth for Orders<'_> {
    type Output = Vec<[f64; 2]>;

    #[cfg_attr(not(debug_assertions), inline(always))]
    fn run<R: SinCos>(self, like: R) -> Vec<[f64; 2]> {
        let Self {
            harmonics: JointHarmonics { once: [cosines, sines], twice: [cosines_twice, sines_twice], .. },
            pull,
        } = self;
        let mut sums = vec![[[0.0; WIDTH]; 2]; MAX_ORDER + 1 - MIN_ORDER];
        let registers = ROWS / R::ROWS;
        for first in (0..pull.len()).step_by(ROWS) {
            // Sized for the narrowest registers; wider ones use fewer.
            let (mut s, mut c, mut sp, mut cp, mut a) =
                ([like; ROWS], [like; ROWS], [like; ROWS], [like; ROWS], [like; ROWS]);
            for k in 0..registers {
                let at = first + k * R::ROWS;
                (s[k], c[k]) = (like.load(sines, at), like.load(cosines, at));
                (sp[k], cp[k]) = (like.load(sines_twice, at), like.load(cosines_twice, at));
                a[k] = like.load(pull, at);
            }
            for [by_sine, by_cosine] in &mut sums {
                for k in 0..registers {
                    let (sine, cosine) = (sp[k] * c[k] + cp[k] * s[k], cp[k] * c[k] - sp[k] * s[k]);
                    (sp[k], cp[k]) = (sine, cosine);
                    let lane = k * R::ROWS % WIDTH;
                    (like.load(by_sine, lane) + a[k] * sine).store(by_sine, lane);
                    (like.load(by_cosine, lane) + a[k] * cosine).store(by_cosine, lane);
                }
            }
        }
        sums.iter().map(|both| both.map(|lanes| lanes.iter().sum())).collect()
    }
}

/// The strongest harmonics of every joint as candidates, and the joints with peaks in the range of a fine map, each with the
/// index in [`FINE`] of the coarsest map that resolves them.
pub fn candidates(
    subject: &Subject<'_>,
    turns: &AngleHarmonics,
    design: &Design,
) -> (Vec<Arc<Candidate>>, Vec<(usize, usize)>) {
    let dataset = &subject.observed.dataset;
    let strongest: Vec<(f64, usize, usize)> = (0..6)
        .into_par_iter()
        .flat_map_iter(|joint| {
            let lines = turns.0[joint]
                .as_ref()
                .map(|harmonics| strongest_orders(harmonics, &design.slopes.by_joint[joint], design));
            lines.into_iter().flatten().map(move |(size, order)| (size, joint, order))
        })
        .collect();
    let mut mapped: Vec<(usize, usize)> = strongest
        .iter()
        .filter(|(size, ..)| *size > MAP_CHI_SQUARE)
        .filter_map(|(_, joint, order)| Some((*joint, FINE.iter().position(|(_, reach)| order <= reach)?)))
        .collect();
    mapped.sort_unstable();
    mapped.dedup();
    let candidates = strongest
        .into_par_iter()
        .filter_map(|(_, joint, order)| {
            let known = turns.0[joint].as_ref()?.candidates.get(order - MIN_ORDER)?;
            Some(Arc::clone(known.get_or_init(|| {
                let harmonic = Harmonic { joint, order: order as f64, sine_rad: 0.0, cosine_rad: 0.0 };
                Arc::new(Candidate {
                    tried: (MAX_ORDER + 1 - MIN_ORDER) as f64,
                    ..Candidate::arm(Effect::GearTransmission(harmonic), dataset, subject.nominal)
                })
            })))
        })
        .collect();
    (candidates, mapped)
}
