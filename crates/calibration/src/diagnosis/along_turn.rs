//! Whether the harmonics of a joint's gear add up to an error that changes along the turn: larger at some angles than at others, as of worn
//! teeth or a reducer that runs out.
//!
//! The error at the measured angles is compared between stretches, each by half its range there. A stretch is as long as a period of the
//! lowest order, so that it holds a whole period of every harmonic: a single one has the same range everywhere.

use std::f64::consts::TAU;

use super::cause::Cause;
use super::extension::Subject;
use crate::measurement::dataset::Row;
use truegrind_arm::condition::Condition;
use truegrind_arm::effect::Effect;

/// Shortest stretch (rad).
const MIN_STRETCH_RAD: f64 = TAU / 12.0;

/// Fewest rows of a stretch.
const ROWS: usize = 20;

/// Ratio of the largest to the smallest stretch from which the error counts as one that changes.
const CHANGES: f64 = 2.0;

/// Half the range of a joint's error in a stretch.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Stretch {
    /// Its middle, as logged (rad).
    pub at_rad: f64,
    /// Half the range of the error (rad).
    pub error_rad: f64,
}

/// The stretches with the largest and with the smallest error of a joint, where they differ by a factor of two.
///
/// `causes` are all of its gear transmission; `joint` counts from 0. `None` where the joint moved through less than two stretches, and
/// beside an error map, whose slow part has another range in every stretch.
pub fn along_turn(subject: &Subject<'_>, joint: usize, causes: &[&Cause]) -> Option<[Stretch; 2]> {
    let harmonics = || {
        causes.iter().map(|cause| match cause {
            Cause::Arm(effect @ Effect::GearTransmission(harmonic)) => Some((effect, harmonic.order)),
            _ => None,
        })
    };
    let orders = harmonics().map(|harmonic| Some(harmonic?.1)).collect::<Option<Vec<f64>>>()?;
    let length = (TAU / orders.into_iter().min_by(f64::total_cmp)?).max(MIN_STRETCH_RAD);
    let (nominal, still) = (subject.nominal, Condition::default());
    let statics = nominal.statics();
    let error = |row: &Row| {
        let u = nominal.mapped(&row.joints);
        harmonics().flatten().map(|(effect, _)| effect.offset(&statics, &u, &still)[joint]).sum::<f64>()
    };
    let rows = subject.observed.dataset.rows.iter();
    let mut curve: Vec<(f64, f64)> = rows.map(|row| (row.joints[joint], error(row))).collect();
    curve.sort_by(|a, b| a.0.total_cmp(&b.0));
    let (low, high) = (curve.first()?.0, curve.last()?.0);
    let stretch = |from: f64| {
        let inside = curve.iter().filter(|(angle, _)| (from..=from + length).contains(angle));
        let (count, least, most) = inside.fold(
            (0, f64::INFINITY, f64::NEG_INFINITY),
            |(count, least, most): (usize, f64, f64), (_, error)| {
                (count + 1, least.min(*error), most.max(*error))
            },
        );
        (count >= ROWS).then_some(Stretch { at_rad: from + 0.5 * length, error_rad: 0.5 * (most - least) })
    };
    let steps = ((high - low - length) / (length / 6.0)).floor();
    if steps < 6.0 {
        return None;
    }
    let stretches: Vec<Stretch> =
        (0..=steps as usize).filter_map(|k| stretch(low + k as f64 * length / 6.0)).collect();
    let by_error = |a: &&Stretch, b: &&Stretch| a.error_rad.total_cmp(&b.error_rad);
    let both = [*stretches.iter().max_by(by_error)?, *stretches.iter().min_by(by_error)?];
    (both[0].error_rad > CHANGES * both[1].error_rad).then_some(both)
}

/// The same as the end of a sentence.
pub fn in_words([largest, smallest]: [Stretch; 2]) -> String {
    format!(
        "its size changes along the turn: ±{:.4}° near {:.0}°, ±{:.4}° near {:.0}°",
        largest.error_rad.to_degrees(),
        largest.at_rad.to_degrees(),
        smallest.error_rad.to_degrees(),
        smallest.at_rad.to_degrees()
    )
}
