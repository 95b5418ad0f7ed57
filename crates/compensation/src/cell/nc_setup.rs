//! What the cell file states that NC programs do not: control, angle convention, tools and work offsets.

use std::collections::BTreeSet;

use super::file::{Cell, CellFrame};
use truegrind_arm::robots::sheet::Orientation;
use truegrind_programs::motion::Frame;
use truegrind_programs::nc::orientation::Angles;
use truegrind_programs::nc::setup::Setup;

/// How programs are read for a cell. How the arm's own language writes orientations does not count: NC programs are written for
/// the control that drives the arm, which may use another convention.
pub fn cell_setup(cell: &Cell) -> Setup {
    let frames = |list: &[CellFrame]| -> Vec<(String, Frame)> {
        list.iter().filter_map(|frame| Some((frame.name.clone(), Frame::from_pose(&frame.pose()?)))).collect()
    };
    Setup {
        dialect: cell.control(),
        angles: cell.angles(),
        tools: frames(&cell.tool),
        frames: frames(&cell.wobj),
        called: BTreeSet::new(),
    }
}

/// The convention of A, B and C named in a robot file; quaternions have none.
pub fn angle_convention(orientation: Orientation) -> Option<Angles> {
    match orientation {
        Orientation::Quaternion => None,
        Orientation::Abc => Some(Angles::Abc),
        Orientation::Wpr => Some(Angles::Wpr),
        Orientation::RotationVector => Some(Angles::RotationVector),
        Orientation::Rxyz => Some(Angles::Rxyz),
    }
}
