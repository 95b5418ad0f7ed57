//! How the tool turns along a path between two orientations: whether a control that runs A, B and C linearly and one that turns the tool about
//! one axis agree.

use super::super::modal_state::{Orientation, OrientationMode, all_known};
use super::super::orientation::{Angles, WordsAtPole};
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

/// The words of orientation in effect, with their convention.
fn stated_words(orientation: &Orientation, angles: Option<Angles>) -> Option<(Angles, [f64; 3])> {
    match orientation.mode {
        OrientationMode::Angles => Some((angles?, all_known(orientation.abc).ok()?)),
        OrientationMode::Rpy => Some((Angles::Wpr, all_known(orientation.rpy).ok()?)),
        OrientationMode::Vector | OrientationMode::Unknown(_) => None,
    }
}

/// The words of orientation in effect, where they are near a pole of their convention.
pub(super) fn words_at_pole(orientation: &Orientation, angles: Option<Angles>) -> Option<WordsAtPole> {
    let (convention, words) = stated_words(orientation, angles)?;
    WordsAtPole::of(convention, words)
}

pub(super) fn turn_between(from: &Orientation, to: &Orientation, angles: Option<Angles>) -> Turn {
    if to.mode == OrientationMode::Vector {
        return Turn::OneWay;
    }
    // Without a known start nothing is inserted.
    let (Some((convention, start)), Some((other, end))) =
        (stated_words(from, angles), stated_words(to, angles))
    else {
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
