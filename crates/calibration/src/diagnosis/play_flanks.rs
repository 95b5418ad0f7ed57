//! Zeros of joints that move as a play moves them: back again, which a drive that lost counts does not, or where the torque about the joint, its
//! size, or the side of approach changes.

use super::cause::Cause;
use super::cause_kind::CauseKind;
use crate::identification::calibration::torques_under;
use crate::measurement::dataset::Dataset;
use crate::measurement::sensor::empirical::AssumedLoad;
use truegrind_arm::model::Model;

/// Share of the rows on either side of the best limit, in the mean of both sides, from which it tells them apart.
const TOLD_APART: f64 = 0.9;

/// Why one of `causes` may be a play; `None` of one that may not, or that moves no joint's zero.
pub(super) fn doubt(
    causes: &[Cause],
    index: usize,
    dataset: &Dataset,
    nominal: &Model,
) -> Option<&'static str> {
    let zero = |cause: &Cause| {
        let rows = cause.rows().filter(|_| cause.kind() == CauseKind::JointZeroShift)?;
        Some((cause.joints().first().copied()?, rows))
    };
    let (joint, [from, to]) = zero(causes.get(index)?)?;
    // Beside another one of the joint it may be a step from one level to a third.
    let meets = |(other, [start, end]): (usize, [usize; 2])| {
        other == joint && [start, end] != [from, to] && start <= to + 1 && from <= end + 1
    };
    let rows = &dataset.rows;
    let ends = [0, rows.len().checked_sub(1)?].map(|row| rows[row].number);
    if from > ends[0] && to < ends[1] && !causes.iter().filter_map(zero).any(meets) {
        return Some(
            "the zero came back, which it does not after lost counts: a play that gravity or friction holds on one flank and then on the other \
             looks the same",
        );
    }
    follows_flanks(dataset, nominal, joint, [from, to]).then_some(
        "the zero changed where the load of the joint or its side of approach did: a play that changes its flank there looks the same",
    )
}

/// Whether a play of a joint (0-based) would be on one flank in the rows from one number to another, and on the other in the rest.
fn follows_flanks(dataset: &Dataset, nominal: &Model, joint: usize, [from, to]: [usize; 2]) -> bool {
    let inside: Vec<bool> = dataset.rows.iter().map(|row| (from..=to).contains(&row.number)).collect();
    let sides = dataset.rows.iter().map(|row| f64::from(row.condition.approach[joint])).collect();
    let loads = (joint as u8 + 1..=6).map(AssumedLoad::Frame).chain([AssumedLoad::Masses]);
    let of_loads = loads.flat_map(|load| {
        let torques: Vec<f64> = torques_under(dataset, nominal, load).iter().map(|t| t[joint]).collect();
        let sizes = torques.iter().map(|t| t.abs()).collect();
        [torques, sizes]
    });
    std::iter::once(sides).chain(of_loads).any(|values| told_apart(&values, &inside) >= TOLD_APART)
}

/// How well the best limit of a value tells some rows from the others: the mean of the shares on its right side, ½ if it tells nothing.
fn told_apart(values: &[f64], inside: &[bool]) -> f64 {
    let mut order: Vec<usize> = (0..values.len()).collect();
    order.sort_by(|&a, &b| values[a].total_cmp(&values[b]));
    let count = |side: bool| inside.iter().filter(|i| **i == side).count().max(1) as f64;
    let (within, without) = (count(true), count(false));
    // The share of the rows below the limit, inside less outside: −1 and 1 where all of one are below and all of the other above.
    let (mut below, mut most) = (0.0, 0.0_f64);
    for (place, &row) in order.iter().enumerate() {
        below += if inside[row] { 1.0 / within } else { -1.0 / without };
        let is_limit = order.get(place + 1).is_none_or(|&next| values[next] > values[row]);
        if is_limit {
            most = most.max(below.abs());
        }
    }
    0.5 + 0.5 * most
}
