//! At which orders a reducer speaks: lines of a joint-resolved residual.
//!
//! For every joint, the residual's projection on turning it, resolved at each order per turn: Σ aᵢ e^(i n uᵢ) with
//! aᵢ = θᵢ·rᵢ, over Σ |θᵢ|². Powers of e^(iu) come by multiplication, so an order costs ten operations a row. What geometry
//! shares with a line is left out here, which can only make a line look smaller; the few that stand out are then scored like
//! any other candidate.

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

/// The strongest lines of every joint as candidates, and the joints in which lines within the reach of a fine map stand
/// out, each with the place in [`FINE`] of the coarsest map that follows them.
pub fn candidates(subject: &Subject<'_>, design: &Design) -> (Vec<Candidate>, Vec<(usize, usize)>) {
    let dataset = &subject.observed.dataset;
    let n = design.observations;
    let strongest: Vec<(f64, usize, usize)> = (0..6)
        .into_par_iter()
        .flat_map_iter(|joint| {
            let theta = &design.slopes.by_joint[joint];
            let angles: Vec<f64> =
                dataset.rows.iter().map(|r| (subject.nominal.joint_map * r.joints)[joint]).collect();
            let (low, high) =
                angles.iter().fold((f64::INFINITY, f64::NEG_INFINITY), |(l, h), a| (l.min(*a), h.max(*a)));
            let mut lines: Vec<(f64, usize)> = Vec::new();
            if high - low > STILL_RAD {
                let (mut pull, mut weight) = (vec![0.0; n], 0.0);
                for (i, p) in pull.iter_mut().enumerate() {
                    for s in i * design.per..(i + 1) * design.per {
                        *p += theta[s] * design.residual[s];
                        weight += theta[s] * theta[s];
                    }
                }
                let turn: Vec<(f64, f64)> = angles.iter().map(|a| a.sin_cos()).collect();
                let mut power: Vec<(f64, f64)> = angles.iter().map(|a| (2.0 * a).sin_cos()).collect();
                for order in 3..=HIGHEST {
                    let (mut sine, mut cosine) = (0.0, 0.0);
                    for ((p, (s, c)), a) in power.iter_mut().zip(&turn).zip(&pull) {
                        *p = (p.0 * c + p.1 * s, p.1 * c - p.0 * s);
                        sine += a * p.0;
                        cosine += a * p.1;
                    }
                    lines.push((2.0 * (sine * sine + cosine * cosine) / weight.max(1e-300), order));
                }
                lines.sort_by(|a, b| b.0.total_cmp(&a.0).then(a.1.cmp(&b.1)));
                lines.truncate(KEPT);
            }
            lines.into_iter().map(move |(size, order)| (size, joint, order))
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
