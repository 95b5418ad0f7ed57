//! What cell file and robot file say that NC programs do not say themselves.

use crate::cell::{Cell, CellFrame};
use truegrind_arm::robots::sheet::Orientation;
use truegrind_programs::motion::Frame;
use truegrind_programs::nc::orientation::Angles;
use truegrind_programs::nc::setup::Setup;

/// How programs are read for a cell; `orientation` is how programs of the robot write one, where its file says so.
pub fn cell_setup(cell: &Cell, orientation: Option<Orientation>) -> Setup {
    let frames = |list: &[CellFrame]| -> Vec<(String, Frame)> {
        list.iter().filter_map(|frame| Some((frame.name.clone(), Frame::from_pose(&frame.pose()?)))).collect()
    };
    Setup {
        dialect: None,
        angles: cell.angles().or_else(|| orientation.and_then(angle_convention)),
        tools: frames(&cell.tool),
        frames: frames(&cell.wobj),
    }
}

/// The convention of A, B and C that a robot file names; quaternions are no three angles.
pub fn angle_convention(orientation: Orientation) -> Option<Angles> {
    match orientation {
        Orientation::Quaternion => None,
        Orientation::Abc => Some(Angles::Abc),
        Orientation::Wpr => Some(Angles::Wpr),
        Orientation::RotationVector => Some(Angles::RotationVector),
        Orientation::Rxyz => Some(Angles::Rxyz),
    }
}
