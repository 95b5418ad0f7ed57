//! The words that a motion lacks behind a label, a jump, a call or a loop: what several paths leave differently, and what no word states
//! since then.

use super::super::dialect::Dialect;
use super::super::expression::Evaluated;
use super::super::modal_group::{ARC_GROUPS, MOTION_GROUPS, ModalGroup};
use super::super::modal_state::{MotionMode, OrientationMode};
use super::{Block, Interpreter};
use crate::motion::Reason;

/// Groups that state how the coordinates are transformed, with what ends each.
const TRANSFORMS: [(ModalGroup, &str); 17] = [
    (ModalGroup::ProgrammableFrame, "the programmed frame (TRANS without axes ends it)"),
    (ModalGroup::Rotation, "the end of a rotation (G69, cycle 10)"),
    (ModalGroup::TiltedPlane, "the end of a tilted plane (CYCLE800(), PLANE RESET, G69)"),
    (ModalGroup::Mirror, "the end of mirroring (G50.1, cycle 8)"),
    (ModalGroup::Scaling, "the end of scaling (G50, cycle 11)"),
    (ModalGroup::AxisScaling, "the end of scaling by axes (cycle 26)"),
    (ModalGroup::DatumShift, "the datum shift (cycle 7)"),
    (ModalGroup::Polar, "the end of polar coordinates (G15)"),
    (ModalGroup::PolarPath, "the end of polar interpolation (G13.1)"),
    (ModalGroup::Cylinder, "the end of cylindrical interpolation (G7.1, G107)"),
    (ModalGroup::Diameter, "the end of diameter programming (G8, DIAMOF)"),
    (ModalGroup::Kinematic, "the kinematic transformation (TRAFOOF, then TRAORI)"),
    (ModalGroup::OrientationFrame, "the frame of orientations (ORIWKS)"),
    (ModalGroup::ToolFrame, "the end of the tool frame (TOROTOF)"),
    (ModalGroup::PartFrame, "the end of the part frame (PAROTOF)"),
    (ModalGroup::FixtureOffset, "the offset of the table (G54.2 P0)"),
    (ModalGroup::RotaryOffset, "the offsets of A, B and C"),
];

/// Transforms that are told one by one; a subprogram by itself knows of none of them.
const TOLD_TRANSFORMS: usize = 3;

impl Interpreter<'_, '_> {
    /// Notes what a block lacks whose motion comes next in the listing.
    pub(super) fn note_unstated(&mut self, block: &Block<'_>, mode: MotionMode, to: &[Evaluated; 3]) {
        let words = self.unstated(block, mode, to);
        if !words.is_empty() {
            let motion = self.listing.motions.len() as u32;
            self.listing.nc.unstated.insert(motion, words.join(", "));
        }
    }

    fn unstated(&self, block: &Block<'_>, mode: MotionMode, to: &[Evaluated; 3]) -> Vec<&'static str> {
        const FLOW: Reason = Reason::UnknownFlow;
        let lacks = |group: ModalGroup| self.state.groups.is_unknown_after_join(group);
        let arc = if matches!(mode, MotionMode::Circular(_)) { ARC_GROUPS } else { 0 };
        let counts = |group: ModalGroup| (MOTION_GROUPS | arc) & group.bit() != 0 && lacks(group);
        let mut out = Vec::new();
        out.extend(self.group_words().into_iter().filter(|(group, _)| counts(*group)).map(|(_, word)| word));
        let open: Vec<&str> =
            TRANSFORMS.iter().filter(|(group, _)| counts(*group)).map(|(_, word)| *word).collect();
        if open.len() > TOLD_TRANSFORMS {
            out.push("that no rotation, scaling, mirroring, tilted plane or programmed frame is active");
        } else {
            out.extend(open);
        }
        if mode == MotionMode::Unknown(FLOW) {
            let word = if self.dialect == Dialect::Heidenhain {
                "a motion word (L)"
            } else {
                "a motion word (G0, G1)"
            };
            out.push(word);
        }
        let axes = ["X", "Y", "Z"].into_iter().zip(to);
        out.extend(axes.filter(|(_, value)| **value == Err(FLOW)).map(|(axis, _)| axis));
        let orientation = &self.state.orientation;
        let (names, stated, values) = match orientation.mode {
            OrientationMode::Rpy => (["A2", "B2", "C2"], &block.rpy, &orientation.rpy),
            _ => (["A", "B", "C"], &block.abc, &orientation.abc),
        };
        let is_open = |value: &Evaluated| *value == Err(FLOW);
        // A mode that one word of the block selects leaves the two others open.
        if orientation.mode != OrientationMode::Vector {
            let open = (0..3).filter(|axis| stated[*axis].is_none() && is_open(&values[*axis]));
            out.extend(open.map(|axis| names[axis]));
        }
        out
    }

    /// The words of the groups that any control has.
    fn group_words(&self) -> [(ModalGroup, &'static str); 10] {
        let unit = if self.dialect == Dialect::Siemens { "G71 or G70" } else { "G21 or G20" };
        let (control, length) = match self.dialect {
            Dialect::Siemens => ("TRAORI", "D"),
            Dialect::Heidenhain => ("M128", "TOOL CALL"),
            Dialect::LinuxCnc => ("tool centre point control", "G43"),
            _ => ("G43.4", "H"),
        };
        let (offset, tool) = match self.dialect {
            Dialect::Heidenhain => ("the preset (CYCL DEF 247)", "TOOL CALL"),
            _ => ("the work offset (G54)", "the tool (T)"),
        };
        [
            (ModalGroup::DistanceMode, "G90"),
            (ModalGroup::Unit, unit),
            (ModalGroup::Plane, "G17"),
            (ModalGroup::ArcCentreMode, "G91.1"),
            (ModalGroup::WorkOffset, offset),
            (ModalGroup::RadiusCompensation, "G40"),
            (ModalGroup::TcpMode, control),
            (ModalGroup::Tool, tool),
            (ModalGroup::ToolLength, length),
            (ModalGroup::CoordinateShift, "that no G92 or G52 shift is active"),
        ]
    }
}
