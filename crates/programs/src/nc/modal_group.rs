//! Modal groups of a control, and the table of their values.
//!
//! A word of a group stays in effect until another word of the same group. [`GroupTable`] holds, for each group, a code of
//! the value in effect and whether the text determines it; values that no number represents (frames, tools) stand beside
//! it in [`ModalState`](super::modal_state::ModalState).

use super::arc::Plane;
use crate::motion::Reason;

/// Modal groups: a word of a group stays in effect until another word of the same group.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[repr(u8)]
pub(super) enum ModalGroup {
    /// G90, G91.
    DistanceMode,
    /// G20, G21.
    Unit,
    /// G17, G18, G19.
    Plane,
    /// G54 and following.
    WorkOffset,
    /// G40 to G42.
    RadiusCompensation,
    /// G43.4, TRAORI, M128.
    TcpMode,
    /// T, M6 and TOOL CALL.
    Tool,
    /// G43, G49, H; the cutting edge D of Siemens.
    ToolLength,
    /// G92, G52.
    CoordinateShift,
    // Coordinate transforms. Each is a group of its own, because each has its own cancel word.
    /// G15, G16.
    Polar,
    /// G50, G51; cycle 11.
    Scaling,
    /// G50.1, G51.1, G100, G101; cycle 8.
    Mirror,
    /// G68, G68.2, G69; cycle 10.
    Rotation,
    /// G12.1, G13.1: polar interpolation.
    PolarPath,
    /// G7.1, G107: cylindrical interpolation.
    Cylinder,
    /// G7, G8, DIAMON: diameter programming.
    Diameter,
    /// TRANSMIT, TRACYL, TRAANG.
    Kinematic,
    /// ORIMKS, ORIWKS.
    OrientationFrame,
    /// CYCLE800, PLANE, cycle 19, G268.
    TiltedPlane,
    /// TRANS, ROT, SCALE, MIRROR. The transform bit is set where they are not a known rigid motion.
    ProgrammableFrame,
    /// TOFRAME, TOROT.
    ToolFrame,
    /// PAROT.
    PartFrame,
    /// G54.2, G54.4, G254: offsets of the table.
    FixtureOffset,
    /// TRANS DATUM TABLE, cycle 7 with a row of the table.
    DatumShift,
    /// Cycle 26: one scale for each axis. TRAILON of Siemens: an axis follows another by a factor.
    AxisScaling,
    /// Offsets of A, B, C (G92 A0).
    RotaryOffset,
    /// FUNCTION TCPM REFPNT: 1 where the programmed point is not the tip.
    ReferencePoint,
    /// PTP, CP: 1 where the joints lead to the end, on a path that is no line.
    PointToPoint,
    // Groups that matter for some motions only.
    /// G90.1, G91.1: absolute or incremental arc centres.
    ArcCentreMode,
    /// ORIRPY, ORIEULER.
    RpyConvention,
    /// ORIROTA, ORIROTR.
    SpinReference,
}

impl ModalGroup {
    /// The bit of the group in a set of groups.
    pub(super) const fn bit(self) -> u32 {
        1 << self as u32
    }
}

pub(super) const GROUP_COUNT: u32 = ModalGroup::SpinReference as u32 + 1;

pub(super) const ALL_GROUPS: u32 = (1 << GROUP_COUNT) - 1;

/// Groups that matter for arcs only.
pub(super) const ARC_GROUPS: u32 = ModalGroup::Plane.bit() | ModalGroup::ArcCentreMode.bit();

/// Groups that select the tool and its length offset.
pub(super) const TOOL_GROUPS: u32 = ModalGroup::Tool.bit() | ModalGroup::ToolLength.bit();

/// Groups that matter for every motion. `RpyConvention` and `SpinReference` only interpret some words: where they are
/// unknown, so are the values of those words.
pub(super) const MOTION_GROUPS: u32 =
    ALL_GROUPS & !(ARC_GROUPS | ModalGroup::RpyConvention.bit() | ModalGroup::SpinReference.bit());

/// Coordinate transforms; their value is 1 where they are active.
const TRANSFORMS: std::ops::RangeInclusive<usize> =
    ModalGroup::Polar as usize..=ModalGroup::RotaryOffset as usize;

/// The value of each modal group, as a code, and the groups whose value the text does not determine.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct GroupTable {
    /// The G code in tenths for groups of G codes, 0 and 1 for switches, a hash for names.
    value: [u64; GROUP_COUNT as usize],
    /// Groups whose paths disagree at a join.
    unknown_after_join: u32,
    /// Groups that an unknown word may have set, and `word_reason` why.
    unknown_by_word: u32,
    word_reason: Reason,
}

impl GroupTable {
    /// The values after power-on.
    pub(super) fn start(work_offset: &str, tool: &str) -> GroupTable {
        let mut value = [0; GROUP_COUNT as usize];
        for (group, code) in [
            (ModalGroup::DistanceMode, 900),
            (ModalGroup::Unit, 210),
            (ModalGroup::Plane, 170),
            (ModalGroup::WorkOffset, name_key(work_offset)),
            (ModalGroup::Tool, name_key(tool)),
        ] {
            value[group as usize] = code;
        }
        GroupTable { value, unknown_after_join: 0, unknown_by_word: 0, word_reason: Reason::UnknownWord }
    }

    /// The value of a group, known or not.
    pub(super) fn value(&self, group: ModalGroup) -> u64 {
        self.value[group as usize]
    }

    /// The values of all groups.
    pub(super) fn values(&self) -> impl Iterator<Item = u64> {
        self.value.into_iter()
    }

    /// Whether a switch is on.
    pub(super) fn is_on(&self, group: ModalGroup) -> bool {
        self.value(group) != 0
    }

    pub(super) fn set_value(&mut self, group: ModalGroup, value: u64) {
        self.value[group as usize] = value;
    }

    pub(super) fn mark_known(&mut self, group: ModalGroup) {
        self.unknown_after_join &= !group.bit();
        self.unknown_by_word &= !group.bit();
    }

    /// Groups whose value depends on the path to here.
    pub(super) fn mark_unknown_after_join(&mut self, groups: u32) {
        self.unknown_after_join |= groups;
    }

    /// Groups that a word sets to a value that the text does not determine.
    pub(super) fn mark_unknown_by_word(&mut self, groups: u32, because: Reason) {
        self.unknown_by_word |= groups;
        self.word_reason = because;
    }

    /// Whether the value of a group depends on the path to here.
    pub(super) fn is_unknown_after_join(&self, group: ModalGroup) -> bool {
        self.unknown_after_join & group.bit() != 0
    }

    /// Why one of these groups is unknown; `None` where all are known.
    pub(super) fn unknown_reason(&self, groups: u32) -> Option<Reason> {
        if self.unknown_by_word & groups != 0 {
            return Some(self.word_reason);
        }
        (self.unknown_after_join & groups != 0).then_some(Reason::UnknownFlow)
    }

    /// The value of a group and whether it is known, as in another table.
    pub(super) fn restore(&mut self, group: ModalGroup, from: &GroupTable) {
        let bit = group.bit();
        self.value[group as usize] = from.value(group);
        self.unknown_after_join = self.unknown_after_join & !bit | from.unknown_after_join & bit;
        self.unknown_by_word = self.unknown_by_word & !bit | from.unknown_by_word & bit;
    }

    /// Joins with the table of another path: groups whose values differ are unknown; a transform that is active on one
    /// path counts as active.
    pub(super) fn join(&mut self, other: &GroupTable) {
        for (group, (value, &theirs)) in self.value.iter_mut().zip(&other.value).enumerate() {
            if *value != theirs {
                self.unknown_after_join |= 1 << group;
            }
            if TRANSFORMS.contains(&group) {
                *value = (*value).max(theirs);
            }
        }
        self.unknown_after_join |= other.unknown_after_join;
        // The first reason stays: joining the same states again then changes nothing.
        if self.unknown_by_word == 0 {
            self.word_reason = other.word_reason;
        }
        self.unknown_by_word |= other.unknown_by_word;
    }

    /// G90.
    pub(super) fn absolute(&self) -> bool {
        self.value(ModalGroup::DistanceMode) == 900
    }

    /// mm per unit: 1 or 25.4.
    pub(super) fn unit_mm(&self) -> f64 {
        if self.value(ModalGroup::Unit) == 210 { 1.0 } else { 25.4 }
    }

    /// The plane of arcs.
    pub(super) fn plane(&self) -> Plane {
        match self.value(ModalGroup::Plane) {
            170 => Plane::XY,
            180 => Plane::ZX,
            _ => Plane::YZ,
        }
    }

    /// G90.1.
    pub(super) fn centre_absolute(&self) -> bool {
        self.is_on(ModalGroup::ArcCentreMode)
    }

    /// G43.4, TRAORI, M128.
    pub(super) fn tcp_mode(&self) -> bool {
        self.value(ModalGroup::TcpMode) & 1 != 0
    }

    /// G43.5: I, J, K are a tool vector.
    pub(super) fn vector_words(&self) -> bool {
        self.value(ModalGroup::TcpMode) & 2 != 0
    }

    /// Whether A2, B2, C2 are roll, pitch, yaw (ORIRPY) on every path.
    pub(super) fn rpy_convention_stated(&self) -> bool {
        let known = self.unknown_after_join & ModalGroup::RpyConvention.bit() == 0;
        known && self.value(ModalGroup::RpyConvention) == 2
    }

    /// Whether THETA counts from the frame of the tool vector (ORIROTA) on every path.
    pub(super) fn spin_absolute(&self) -> bool {
        let known = self.unknown_after_join & ModalGroup::SpinReference.bit() == 0;
        known && !self.is_on(ModalGroup::SpinReference)
    }

    /// The active coordinate transforms, as a set of groups.
    pub(super) fn active_transforms(&self) -> u32 {
        TRANSFORMS.filter(|&group| self.value[group] != 0).fold(0, |all, group| all | 1 << group)
    }
}

/// The FNV-1a hash of a name, as the value of a group.
pub(super) fn name_key(text: &str) -> u64 {
    text.bytes().fold(0xcbf2_9ce4_8422_2325, |hash, byte| {
        (hash ^ u64::from(byte)).wrapping_mul(0x0000_0100_0000_01b3)
    })
}
