//! The table of G codes: which control knows each code, and what it does. A code that is missing here makes the whole modal
//! state unknown.
//!
//! Codes are in tenths: 540 for G54, 434 for G43.4. ISO stands for Fanuc and LinuxCNC alike, so it knows what either knows.

use super::super::dialect::Dialect;
use super::super::modal_group::ModalGroup;
use super::super::modal_state::MotionMode;
use crate::motion::Reason;

/// What a G code does.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) enum Action {
    /// Nothing that concerns motions.
    None,
    /// Sets a modal group to a value.
    Set(ModalGroup, u64),
    /// Sets the motion mode.
    Motion(MotionMode),
    /// G5, G5.1: a spline, or a mode switch whose axis words only name axes.
    SplineOrSwitch,
    /// A canned cycle, modal; beside P and Q one that reads a contour.
    Cycle,
    /// G80.
    CycleEnd,
    /// A cycle that reads a contour; for an ISO file perhaps a unit.
    ContourOrUnit,
    /// Feed per minute (true), or another.
    FeedPerMinute(bool),
    /// Exact stop in this block, modal, or no longer.
    ExactStopOnce,
    ExactStop,
    ContinuousPath,
    /// Switches a transform.
    Transform(ModalGroup, bool),
    /// G7: diameter programming.
    DiameterOn,
    /// G8: the end of diameter programming, or look-ahead.
    DiameterOffOrLookAhead,
    /// G15, G16: polar coordinates; with H a work offset of Okuma.
    PolarOrWorkOffset,
    /// G68.
    Rotation,
    /// G7.1, G107.
    Cylinder,
    /// G50, G51.
    Scaling,
    /// G51.1, G101 on, G50.1, G100 off: the axis words are the mirror.
    Mirror(bool),
    /// G268, G269: the axis words are the plane.
    TiltedPlane(bool),
    /// G54.2, G54.4.
    FixtureOffset,
    /// The group of G43.
    ToolLength,
    /// G58, G59 of Siemens.
    AxialShift,
    WorkOffset,
    /// G4.
    Dwell,
    /// A block without motion: settings, saved positions.
    NoMotion,
    /// G110 of Siemens: a pole relative to the tool position.
    PoleAtPosition,
    /// G10.
    SetOffset,
    /// G28.1, G30.1.
    StorePosition,
    /// A motion whose end the text does not determine.
    UnknownEnd(Reason),
    /// A measuring cycle, which sets tools or work offsets.
    Measure,
    /// G33.1: rigid tapping.
    RigidTapping,
    /// G53.1, G53.6: the rotary axes move to the tilted plane.
    AlignToPlane,
    /// G65.
    Call,
    /// G66.
    ModalCall,
    /// G67.
    ModalCallEnd,
    /// G52, G92 and their cancellation.
    Shift,
}

const FANUC: u8 = 1;
const LINUX_CNC: u8 = 2;
const SIEMENS: u8 = 4;
const HEIDENHAIN: u8 = 8;
/// Fanuc and LinuxCNC.
const BOTH: u8 = FANUC | LINUX_CNC;
const ALL: u8 = BOTH | SIEMENS | HEIDENHAIN;

/// The controls that know a code of motion or cycle, or one for a single block, and what it does there.
fn motion_row(code: u32, siemens: bool) -> Option<(u8, Action)> {
    use Action::*;
    const PATH: Action = Motion(MotionMode::Unsupported(Reason::UnsupportedPath));
    Some(match code {
        // Motion.
        0 => (ALL, Motion(MotionMode::Rapid)),
        10 => (ALL, Motion(MotionMode::Linear)),
        20 | 30 => (ALL, Motion(MotionMode::Circular(code == 30))),
        22..=24 | 32..=34 | 62 | 320 => (FANUC, PATH),
        330 => (ALL, PATH),
        331 => (LINUX_CNC, RigidTapping),
        340 => (FANUC | SIEMENS, PATH),
        350 | 630 if siemens => (SIEMENS, PATH),
        3310 | 3320 | 3350 | 3360 => (SIEMENS, PATH),
        50 | 51 => (BOTH, SplineOrSwitch),
        52 | 53 => (LINUX_CNC, PATH),
        1470 | 1480 | 2470 | 2480 | 3470 | 3480 => (SIEMENS, UnknownEnd(Reason::UnsupportedPath)),
        // Cycles.
        740 | 750 if siemens => (SIEMENS, UnknownEnd(Reason::ReferenceReturn)),
        700 | 710 if siemens => (SIEMENS, Set(ModalGroup::Unit, u64::from(code - 500))),
        700 | 710 | 720 => (BOTH, ContourOrUnit),
        701..=729 => (FANUC, ContourOrUnit),
        730 | 740 | 760 | 810..=890 => (BOTH, Cycle),
        731..=790 | 891..=899 | 1530 | 1550 | 1610..=1690 | 1740 | 1840 if !siemens => (FANUC, Cycle),
        800 => (BOTH, CycleEnd),
        801..=809 => (FANUC, None),
        120 | 130 | 470 | 1500 => (FANUC, UnknownEnd(Reason::Cycle)),
        650 => (FANUC, Call),
        660 | 661 => (FANUC, ModalCall),
        670 => (FANUC, ModalCallEnd),
        // One block.
        40 => (ALL, Dwell),
        110 | 220 | 230 | 1030 | 1870 => (FANUC, NoMotion),
        250 | 260 => (FANUC | SIEMENS, NoMotion),
        1110 | 1120 if siemens => (SIEMENS, NoMotion),
        1100 => (SIEMENS, PoleAtPosition),
        270 | 290 => (FANUC, UnknownEnd(Reason::ReferenceReturn)),
        280 | 300 => (BOTH, UnknownEnd(Reason::ReferenceReturn)),
        281 | 301 => (BOTH, StorePosition),
        310..=318 => (FANUC, UnknownEnd(Reason::Probe)),
        382..=385 => (LINUX_CNC, UnknownEnd(Reason::Probe)),
        350 | 360 | 370 | 1360 => (FANUC, Measure),
        _ => return Option::None,
    })
}

/// The same for codes that set modal state other than the motion, and codes without effect.
fn setting_row(code: u32, siemens: bool) -> Option<(u8, Action)> {
    use Action::*;
    let set = |group| Set(group, u64::from(code));
    Some(match code {
        // How numbers are read.
        170 | 180 | 190 => (ALL, set(ModalGroup::Plane)),
        200 | 210 => (BOTH, set(ModalGroup::Unit)),
        7000 | 7100 => (SIEMENS, Set(ModalGroup::Unit, u64::from(code / 10 - 500))),
        900 | 910 => (ALL, set(ModalGroup::DistanceMode)),
        901 | 911 => (BOTH, Set(ModalGroup::ArcCentreMode, u64::from(code == 901))),
        // Path control.
        90 => (ALL, ExactStopOnce),
        600 => (FANUC | SIEMENS, ExactStop),
        610 | 611 => (BOTH, ExactStop),
        6010..=6030 => (SIEMENS, ExactStop),
        640 => (ALL, ContinuousPath),
        6410..=6450 => (SIEMENS, ContinuousPath),
        400 | 410 | 420 => (ALL, Set(ModalGroup::RadiusCompensation, u64::from(code != 400))),
        411 | 421 => (LINUX_CNC, Set(ModalGroup::RadiusCompensation, 1)),
        412..=416 | 422..=426 => (FANUC, Set(ModalGroup::RadiusCompensation, 1)),
        930 | 950 => (ALL, FeedPerMinute(false)),
        940 => (ALL, FeedPerMinute(true)),
        // Transforms.
        70 => (LINUX_CNC, DiameterOn),
        80 => (BOTH, DiameterOffOrLookAhead),
        71 | 1070 => (FANUC, Cylinder),
        121 => (FANUC, Transform(ModalGroup::PolarPath, true)),
        1120 if !siemens => (FANUC, Transform(ModalGroup::PolarPath, true)),
        131 | 1130 => (FANUC, Transform(ModalGroup::PolarPath, false)),
        150 | 160 => (BOTH, PolarOrWorkOffset),
        500 | 510 => (BOTH, Scaling),
        501 | 511 => (BOTH, Mirror(code == 511)),
        1000 | 1010 => (FANUC, Mirror(code == 1010)),
        680..=689 => (BOTH, Rotation),
        690 => (BOTH, Transform(ModalGroup::Rotation, false)),
        2540 | 2550 => (FANUC, Transform(ModalGroup::FixtureOffset, code == 2540)),
        2680 | 2690 => (FANUC, TiltedPlane(code == 2680)),
        531 | 536 => (FANUC, AlignToPlane),
        542 | 544 => (FANUC, FixtureOffset),
        // Tools, work offsets, shifts.
        430 | 431 | 434 | 435 | 440 | 490 => (BOTH, ToolLength),
        432 => (LINUX_CNC, ToolLength),
        2340 => (FANUC, ToolLength),
        580 | 590 if siemens => (SIEMENS, AxialShift),
        540 | 550 | 560 | 570 => (ALL, WorkOffset),
        541 | 580 | 590 => (BOTH, WorkOffset),
        591..=593 => (LINUX_CNC, WorkOffset),
        1540 => (FANUC, WorkOffset),
        5000 | 5050..=5990 => (SIEMENS, WorkOffset),
        100 => (BOTH, SetOffset),
        520 | 920..=923 => (BOTH, Shift),
        // Without effect on motions; G53 is read with the words of its block.
        530 | 960 | 970 => (ALL, None),
        980 | 990 => (BOTH, None),
        620 => (FANUC | SIEMENS, None),
        630 => (FANUC, None),
        450 | 1400..=1430 | 1530 | 3400 | 3410 | 4500 | 4510 | 4600..=4620 | 6210 => (SIEMENS, None),
        9610 | 9620 | 9710 | 9720 | 9730 => (SIEMENS, None),
        _ => return Option::None,
    })
}

/// What a G code does on a control; `None` if the control does not know it.
pub(super) fn action(code: u32, dialect: Dialect) -> Option<Action> {
    let control = match dialect {
        Dialect::Fanuc => FANUC,
        Dialect::LinuxCnc => LINUX_CNC,
        Dialect::Iso => BOTH,
        Dialect::Siemens => SIEMENS,
        // Heidenhain conversational has no G codes, but those that all controls have.
        Dialect::Heidenhain => HEIDENHAIN,
    };
    let (controls, action) = {
        let siemens = dialect == Dialect::Siemens;
        motion_row(code, siemens).or_else(|| setting_row(code, siemens))?
    };
    (controls & control != 0).then_some(action)
}

/// The kinds of word in a block, for codes whose meaning depends on them.
#[derive(Debug, Clone, Copy)]
pub(super) struct WordKinds {
    /// X, Y, Z, A, B, C and the like.
    pub(super) axes: bool,
    /// I, J, K.
    pub(super) centre: bool,
}

/// Whether a G code is supported in this dialect, in a block with these words.
pub(super) fn is_g(code: u32, dialect: Dialect, word_kinds: WordKinds) -> bool {
    let supported = match (code, dialect) {
        // G8 is look-ahead; G50 with axes sets the origin of a lathe.
        (80 | 500, Dialect::Fanuc) => !word_kinds.axes,
        // G5 with a centre is a spline of LinuxCNC; alone it is a mode switch of Fanuc.
        (50 | 51, Dialect::Iso) => word_kinds.centre || !word_kinds.axes,
        _ => true,
    };
    supported && action(code, dialect).is_some()
}
