//! At which orders a reducer speaks: lines of a joint-resolved residual.
//!
//! For every joint, the residual's projection on turning it, resolved at each order per turn: Σ aᵢ e^(i n uᵢ) with
//! aᵢ = θᵢ·rᵢ, over Σ |θᵢ|². Powers of e^(iu) come by multiplication, so an order costs ten operations a row. What geometry
//! shares with a line is left out here, which can only make a line look smaller; the few that stand out are then scored like
//! any other candidate.

use nalgebra::DVector;
use rayon::prelude::*;

use super::catalogue::{Candidate, FINE, STILL_RAD};
use super::design::Design;
use super::extension::Subject;
use truegrind_arm::effect::Effect;
use truegrind_arm::effect::harmonic::Harmonic;

/// Orders 3 to this are tried: twice the ratio of a strain-wave reducer of 1:160 is 320.
pub const HIGHEST: usize = 330;

/// A line's χ² from which a fine map is worth a try.
const STANDS_OUT: f64 = 25.0;

/// Lines kept for each joint.
const KEPT: usize = 2;

/// A joint's angles on the turn, as the orders go by: (cosine, sine) of once and twice the angle.
struct Turn {
    once: [Vec<f64>; 2],
    twice: [Vec<f64>; 2],
}

/// The turns of all joints that moved; they depend on no fit.
pub struct Turns([Option<Turn>; 6]);

impl Turns {
    /// Of the rows of a data set.
    pub fn of(subject: &Subject<'_>) -> Self {
        let rows = &subject.observed.dataset.rows;
        let mapped: Vec<_> = rows.iter().map(|r| subject.nominal.joint_map * r.joints).collect();
        Self(std::array::from_fn(|joint| {
            let angles = || mapped.iter().map(|q| q[joint]);
            let (low, high) =
                angles().fold((f64::INFINITY, f64::NEG_INFINITY), |(l, h), a| (l.min(a), h.max(a)));
            let both = |times: f64| {
                [angles().map(|a| (times * a).cos()).collect(), angles().map(|a| (times * a).sin()).collect()]
            };
            (high - low > STILL_RAD).then(|| Turn { once: both(1.0), twice: both(2.0) })
        }))
    }
}

/// The strongest lines of a joint: their χ² and orders.
fn strongest(turn: &Turn, theta: &DVector<f64>, design: &Design) -> Vec<(f64, usize)> {
    let (mut pull, mut weight) = (vec![0.0; design.observations], 0.0);
    for (i, p) in pull.iter_mut().enumerate() {
        for s in i * design.per..(i + 1) * design.per {
            *p += theta[s] * design.residual[s];
            weight += theta[s] * theta[s];
        }
    }
    let [cosines, sines] = &turn.once;
    let [mut cosine_of, mut sine_of] = turn.twice.clone();
    let mut lines: Vec<(f64, usize)> = Vec::with_capacity(HIGHEST);
    for order in 3..=HIGHEST {
        // Sums side by side, which the compiler can keep in lanes.
        let (mut by_sine, mut by_cosine) = ([0.0; LANES], [0.0; LANES]);
        let places = sine_of.chunks_mut(LANES).zip(cosine_of.chunks_mut(LANES));
        let turns = sines.chunks(LANES).zip(cosines.chunks(LANES)).zip(pull.chunks(LANES));
        for ((sp, cp), ((s, c), a)) in places.zip(turns) {
            for k in 0..a.len() {
                let (sine, cosine) = (sp[k] * c[k] + cp[k] * s[k], cp[k] * c[k] - sp[k] * s[k]);
                (sp[k], cp[k]) = (sine, cosine);
                by_sine[k] += a[k] * sine;
                by_cosine[k] += a[k] * cosine;
            }
        }
        let (sine, cosine): (f64, f64) = (by_sine.iter().sum(), by_cosine.iter().sum());
        lines.push((2.0 * (sine * sine + cosine * cosine) / weight.max(1e-300), order));
    }
    lines.sort_by(|a, b| b.0.total_cmp(&a.0).then(a.1.cmp(&b.1)));
    lines.truncate(KEPT);
    lines
}

/// Sums that are kept side by side.
const LANES: usize = 8;

/// The strongest lines of every joint as candidates, and the joints in which lines within the reach of a fine map stand
/// out, each with the place in [`FINE`] of the coarsest map that follows them.
pub fn candidates(
    subject: &Subject<'_>,
    turns: &Turns,
    design: &Design,
) -> (Vec<Candidate>, Vec<(usize, usize)>) {
    let dataset = &subject.observed.dataset;
    let strongest: Vec<(f64, usize, usize)> = (0..6)
        .into_par_iter()
        .flat_map_iter(|joint| {
            let lines =
                turns.0[joint].as_ref().map(|turn| strongest(turn, &design.slopes.by_joint[joint], design));
            lines.into_iter().flatten().map(move |(size, order)| (size, joint, order))
        })
        .collect();
    let mut mapped: Vec<(usize, usize)> = strongest
        .iter()
        .filter(|(size, ..)| *size > STANDS_OUT)
        .filter_map(|(_, joint, order)| Some((*joint, FINE.iter().position(|(_, reach)| order <= reach)?)))
        .collect();
    mapped.sort_unstable();
    mapped.dedup();
    let candidates = strongest
        .into_par_iter()
        .map(|(_, joint, order)| {
            let harmonic = Harmonic { joint, order: order as f64, sine_rad: 0.0, cosine_rad: 0.0 };
            Candidate {
                tried: (HIGHEST - 2) as f64,
                ..Candidate::arm(Effect::GearTransmission(harmonic), dataset, subject.nominal)
            }
        })
        .collect();
    (candidates, mapped)
}
