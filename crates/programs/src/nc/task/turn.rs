//! How the tool turns along a path between two orientations: whether a control that runs A, B and C linearly and one that turns the tool about
//! one axis agree.

use super::super::modal_state::{Orientation, OrientationMode, all_known};
use super::super::orientation::Angles;
use crate::motion::AxisTurn;

/// How far the two ways of turning the tool along a line may lie apart (rad).
const ONE_WAY_RAD: f64 = 1e-3;

/// How the tool turns along a path.
pub(super) enum Turn {
    /// Alike whether A, B and C run linearly, as axes do, or the tool turns about one axis.
    OneWay,
    /// Differently. Which of the two a control does, its set-up decides (ORIAXES, ORIVECT; PATHCTRL): no orientation can be inserted, and the
    /// worse of both counts.
    TwoWays(AxisTurn),
    /// Between words of two kinds.
    Unknown,
}

pub(super) fn turn_between(from: &Orientation, to: &Orientation, angles: Option<Angles>) -> Turn {
    let of = |orientation: &Orientation| match orientation.mode {
        OrientationMode::Angles => Some((angles?, all_known(orientation.abc).ok()?)),
        OrientationMode::Rpy => Some((Angles::Wpr, all_known(orientation.rpy).ok()?)),
        OrientationMode::Vector | OrientationMode::Unknown(_) => None,
    };
    if to.mode == OrientationMode::Vector {
        return Turn::OneWay;
    }
    // Without a known start nothing is inserted.
    let (Some((convention, start)), Some((other, end))) = (of(from), of(to)) else {
        return if from == to { Turn::OneWay } else { Turn::Unknown };
    };
    if convention != other {
        return Turn::Unknown;
    }
    let turn = AxisTurn { convention, from_deg: start, to_deg: end };
    let about_one_axis = |share| turn.at(0.0).try_slerp(&turn.at(1.0), share, 1e-9);
    let is_alike = |&share: &f64| {
        about_one_axis(share).is_some_and(|turned| turned.angle_to(&turn.at(share)) <= ONE_WAY_RAD)
    };
    // Whole turns that are multiples of each other must not hide at all of these.
    let one_way = start == end || [0.1, 0.25, 0.5, 0.75, 0.93].iter().all(is_alike);
    if one_way { Turn::OneWay } else { Turn::TwoWays(turn) }
}
