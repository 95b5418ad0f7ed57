//! Printing values: new literals, and new numbers in place of old ones.
//!
//! A number is replaced only where it changes by at least half a unit of the last decimal that would be written (and
//! by more than numerical noise), so that writing back what was read changes no byte. A quaternion is compared with
//! the normalised old one, takes the sign that agrees with it, and after rounding its largest component is set so
//! that the length is 1.

use super::literal::{self, JOINTTARGET, Numbers, ROBTARGET};
use super::number;
use crate::edit::Edits;
use crate::motion::{JointTarget, RobTarget, TargetValue};
use crate::rewrite::RewriteOptions;

/// Changes smaller than this are numerical noise, whatever the decimals of the source (mm).
const POSITION_NOISE_MM: f64 = 1e-7;
/// The same for quaternions.
const QUATERNION_NOISE: f64 = 1e-10;
/// The same for joints (degrees).
const JOINT_NOISE_DEG: f64 = 1e-9;

/// Most bytes between two numbers that become one edit: a short number with its commas.
const NEAR: usize = 16;

/// The new value of a target; `None` keeps the old configuration.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) enum NewValue {
    Cartesian { position_mm: [f64; 3], quaternion: [f64; 4], conf: Option<[i32; 4]> },
    Joint { robot_deg: [f64; 6] },
}

/// Half a unit of the last decimal, and never less than noise.
fn differs(old: f64, new: f64, decimals: u8, noise: f64) -> bool {
    (new - old).abs() > number::half_unit(decimals).max(noise)
}

/// A quaternion of length 1 with the sign that agrees with `like`.
fn aligned(quaternion: &[f64; 4], like: &[f64; 4]) -> [f64; 4] {
    let length = quaternion.iter().map(|q| q * q).sum::<f64>().sqrt();
    let dot: f64 = quaternion.iter().zip(like).map(|(a, b)| a * b).sum();
    let scale = if dot < 0.0 { -1.0 / length } else { 1.0 / length };
    quaternion.map(|q| q * scale)
}

/// Rounds to the decimals and sets the largest component so that the length is 1 again.
fn rounded(quaternion: &[f64; 4], decimals: &[u8; 4]) -> [f64; 4] {
    let mut out = *quaternion;
    for (q, &decimals) in out.iter_mut().zip(decimals) {
        *q = number::rounded(*q, decimals);
    }
    let mut largest = 0;
    for index in 1..4 {
        if out[index].abs() > out[largest].abs() {
            largest = index;
        }
    }
    let others: f64 = (0..4).filter(|&index| index != largest).map(|index| out[index] * out[index]).sum();
    let value = (1.0 - others).max(0.0).sqrt().copysign(out[largest]);
    out[largest] = number::rounded(value, decimals[largest]);
    out
}

/// Whether a new value differs from the old one where no source decimals are known.
pub(super) fn changes(old: &TargetValue, fresh: &NewValue, options: &RewriteOptions) -> bool {
    match (old, fresh) {
        (TargetValue::Cartesian(old), NewValue::Cartesian { position_mm, quaternion, conf }) => {
            let new = aligned(quaternion, &old.quaternion);
            let old_turn = aligned(&old.quaternion, &old.quaternion);
            let moved = old.position_mm.iter().zip(position_mm);
            let turned = old_turn.iter().zip(&new);
            moved.into_iter().any(|(&a, &b)| differs(a, b, options.position_decimals, POSITION_NOISE_MM))
                || turned
                    .into_iter()
                    .any(|(&a, &b)| differs(a, b, options.quaternion_decimals, QUATERNION_NOISE))
                || conf.is_some_and(|conf| conf != old.conf)
        }
        (TargetValue::Joint(old), NewValue::Joint { robot_deg }) => {
            let moved = old.robot_deg.iter().zip(robot_deg);
            moved.into_iter().any(|(&a, &b)| differs(a, b, options.joint_decimals, JOINT_NOISE_DEG))
        }
        _ => true,
    }
}

/// Replaces the numbers of the literal `text`, whose first byte is byte `at` of its file. Returns whether anything
/// changed; `None` where the text is no plain literal of that kind. `old`: what was read from it, where it is plain.
pub(super) fn replace_numbers(
    text: &[u8],
    at: usize,
    old: Option<&TargetValue>,
    fresh: &NewValue,
    options: &RewriteOptions,
    edits: &mut Edits,
) -> Option<bool> {
    let before = edits.len();
    // Numbers beside each other on one line become one edit: the list is then half as long.
    let mut last: Option<usize> = None;
    let mut put = |numbers: &Numbers, index: usize, value: f64, decimals: u8| {
        let (start, end) = numbers.spans[index];
        let (start, end) = (start as usize, end as usize);
        let write = |out: &mut Vec<u8>| number::write(out, value, decimals);
        match last.replace(end).map(|last| &text[last..start]) {
            Some(between) if between.len() <= NEAR && !between.contains(&b'\n') => {
                edits.extend_last(between, at + end, write);
            }
            _ => edits.replace_with(at + start..at + end, write),
        }
    };
    match fresh {
        NewValue::Cartesian { position_mm, quaternion, conf } => {
            let numbers = match old.and_then(TargetValue::cartesian) {
                Some(RobTarget { position_mm: [x, y, z], quaternion: [q1, q2, q3, q4], conf, .. }) => {
                    let [cf1, cf4, cf6, cfx] = conf.map(f64::from);
                    let values = [*x, *y, *z, *q1, *q2, *q3, *q4, cf1, cf4, cf6, cfx];
                    literal::places(text, &ROBTARGET[..3], &values)?
                }
                None => literal::numbers(text, ROBTARGET)?,
            };
            for (index, &new) in position_mm.iter().enumerate() {
                let decimals = numbers.decimals[index].max(options.position_decimals);
                if differs(numbers.values[index], new, decimals, POSITION_NOISE_MM) {
                    put(&numbers, index, new, decimals);
                }
            }
            let mut written = [0.0; 4];
            written.copy_from_slice(&numbers.values[3..7]);
            let new = aligned(quaternion, &written);
            let old = aligned(&written, &written);
            let places = [3, 4, 5, 6].map(|index| numbers.decimals[index].max(options.quaternion_decimals));
            let turned = (0..4).any(|index| differs(old[index], new[index], places[index], QUATERNION_NOISE));
            if turned {
                let new = rounded(&new, &places);
                for index in 0..4 {
                    if written[index] != new[index] {
                        put(&numbers, 3 + index, new[index], places[index]);
                    }
                }
            }
            if let Some(conf) = conf {
                for (index, &new) in conf.iter().enumerate() {
                    if numbers.values[7 + index].round() != f64::from(new) {
                        put(&numbers, 7 + index, f64::from(new), 0);
                    }
                }
            }
        }
        NewValue::Joint { robot_deg } => {
            let numbers = literal::numbers(text, JOINTTARGET)?;
            for (index, &new) in robot_deg.iter().enumerate() {
                let decimals = numbers.decimals[index].max(options.joint_decimals);
                if differs(numbers.values[index], new, decimals, JOINT_NOISE_DEG) {
                    put(&numbers, index, new, decimals);
                }
            }
        }
    }
    Some(edits.len() > before)
}

/// The old target with the new value.
pub(super) fn merged(old: &TargetValue, fresh: &NewValue) -> TargetValue {
    let external = match old {
        TargetValue::Cartesian(target) => target.external,
        TargetValue::Joint(target) => target.external,
    };
    match fresh {
        NewValue::Cartesian { position_mm, quaternion, conf } => {
            let (like, old_conf) = match old {
                TargetValue::Cartesian(target) => (target.quaternion, target.conf),
                TargetValue::Joint(_) => (*quaternion, [0; 4]),
            };
            TargetValue::Cartesian(RobTarget {
                position_mm: *position_mm,
                quaternion: aligned(quaternion, &like),
                conf: conf.unwrap_or(old_conf),
                external,
            })
        }
        NewValue::Joint { robot_deg } => TargetValue::Joint(JointTarget { robot_deg: *robot_deg, external }),
    }
}

/// A new literal.
pub(super) fn literal(out: &mut Vec<u8>, value: &TargetValue, options: &RewriteOptions) {
    let list = |out: &mut Vec<u8>, values: &[f64], decimals: u8| {
        out.push(b'[');
        for (index, &value) in values.iter().enumerate() {
            if index > 0 {
                out.push(b',');
            }
            number::write(out, value, decimals);
        }
        out.push(b']');
    };
    out.push(b'[');
    let external = match value {
        TargetValue::Cartesian(target) => {
            list(out, &target.position_mm, options.position_decimals);
            out.push(b',');
            let decimals = [options.quaternion_decimals; 4];
            let turn = rounded(&aligned(&target.quaternion, &target.quaternion), &decimals);
            list(out, &turn, options.quaternion_decimals);
            out.push(b',');
            list(out, &target.conf.map(f64::from), 0);
            target.external
        }
        TargetValue::Joint(target) => {
            list(out, &target.robot_deg, options.joint_decimals);
            target.external
        }
    };
    out.extend_from_slice(b",[");
    for (index, &value) in external.iter().enumerate() {
        if index > 0 {
            out.push(b',');
        }
        number::write_external(out, value);
    }
    out.extend_from_slice(b"]]");
}
