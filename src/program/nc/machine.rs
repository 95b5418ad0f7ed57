//! The modal state of a control: what a block changes, and what therefore holds in it.

use std::collections::BTreeMap;

use super::arc::Plane;
use super::expression::{Variable, Worth};
use super::orientation::Angles;
use crate::math::se3::Pose;
use crate::program::motion::Reason;

/// What the last word of the motion group said.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) enum Mode {
    /// Nothing yet, or G80.
    Unset,
    /// G0.
    Rapid,
    /// G1.
    Linear,
    /// G2 (false) and G3 (true).
    Circular(bool),
    /// A path or cycle that is not followed here.
    Other(Reason),
}

/// How the tool is turned.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) enum Turn {
    /// Not stated, or not followed.
    Unknown(Reason),
    /// By A, B, C.
    Angles,
    /// By A2, B2, C2 (Siemens, ORIRPY).
    Rpy,
    /// By a tool vector.
    Vector,
}

/// Groups of words that hold until another of the group comes.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[repr(u8)]
pub(super) enum Group {
    /// G90, G91.
    Distance,
    /// G20, G21.
    Unit,
    /// G17, G18, G19.
    Plane,
    /// G54 and on.
    Frame,
    /// G40 to G42.
    Radius,
    /// G43.4, TRAORI.
    Tip,
    /// G68, G51, G16 and what turns or scales.
    Transform,
    /// T.
    Tool,
    /// G92, G52.
    Shift,
}

pub(super) const GROUPS: u32 = 9;

/// What makes coordinates others than those of the work frame; each is ended by words of its own.
pub(super) mod transforms {
    /// G16; G110 to G112 of Siemens.
    pub(crate) const POLAR: u16 = 1;
    /// G51, cycle 11 and 26.
    pub(crate) const SCALE: u16 = 1 << 1;
    /// G51.1, G101, cycle 8.
    pub(crate) const MIRROR: u16 = 1 << 2;
    /// G68, cycle 10.
    pub(crate) const TURN: u16 = 1 << 3;
    /// G68.2, G254, PLANE, cycle 19.
    pub(crate) const TILT: u16 = 1 << 4;
    /// TRANSMIT, TRACYL, TRAANG, G12.1, G7.1.
    pub(crate) const KINEMATIC: u16 = 1 << 5;
    /// CYCLE800.
    pub(crate) const SWIVEL: u16 = 1 << 6;
    /// SCALE, MIRROR, ROTS and other programmable frames that are no shift and turn.
    pub(crate) const PROGRAMMABLE: u16 = 1 << 7;
    /// DIAMON, G7 of LinuxCNC.
    pub(crate) const DIAMETER: u16 = 1 << 8;
    /// ORIMKS.
    pub(crate) const MACHINE_TURN: u16 = 1 << 9;
    /// TOFRAME, TOROT, PAROT.
    pub(crate) const TOOL_FRAME: u16 = 1 << 10;
    /// Frames that a program writes into variables of the control, datum tables.
    pub(crate) const SYSTEM: u16 = 1 << 11;
    /// G92 and G52 with rotary axes.
    pub(crate) const ROTARY: u16 = 1 << 12;
}

/// The state of a control between two blocks.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct State {
    pub(super) mode: Mode,
    pub(super) absolute: bool,
    /// mm per unit: 1 or 25.4.
    pub(super) unit_mm: f64,
    pub(super) plane: Plane,
    /// G90.1: centres are absolute.
    pub(super) centre_absolute: bool,
    /// Position of the tool in the work frame (mm), shifts included.
    pub(super) position: [Worth; 3],
    pub(super) turn: Turn,
    /// A, B, C (°).
    pub(super) abc: [Worth; 3],
    /// A2, B2, C2 (°).
    pub(super) rpy: [Worth; 3],
    /// The tool vector.
    pub(super) vector: [Worth; 3],
    /// The turn about it (°).
    pub(super) spin: Worth,
    /// Whether A2, B2, C2 are roll, pitch, yaw (ORIRPY).
    pub(super) rpy_stated: bool,
    /// G92, G52: what is added to programmed values (mm).
    pub(super) shift: [Worth; 3],
    /// G54, G500, …
    pub(super) frame: String,
    /// TRANS, ROT: a frame within the work frame.
    pub(super) programmable: Option<Pose>,
    /// What makes coordinates others than those of the work frame: bits of [`transforms`].
    pub(super) transform: u16,
    /// Axes that a block may have moved which could not be read: bits 0 to 2 X Y Z, 3 the orientation.
    pub(super) doubtful: u8,
    /// What is called after every motion (G66, MCALL, M89).
    pub(super) calls: Option<Reason>,
    pub(super) radius: bool,
    /// G43.4, TRAORI, M128.
    pub(super) tip: bool,
    /// G43.5: I, J, K are a tool vector.
    pub(super) vector_words: bool,
    pub(super) tool: String,
    /// mm/s.
    pub(super) feed: Worth,
    /// G94.
    pub(super) feed_per_minute: bool,
    pub(super) exact_stop: bool,
    /// Whether that holds beyond its block (G61).
    pub(super) exact_stop_holds: bool,
    /// The centre of the last CC (Heidenhain).
    pub(super) pole: [Worth; 2],
    pub(super) variables: BTreeMap<Variable, Worth>,
    /// Groups whose state is not known, one bit each.
    pub(super) uncertain: u32,
    /// The motion before, where no other way leads here.
    pub(super) previous: Option<u32>,
}

impl State {
    pub(super) fn start(frame: &str, tool: &str) -> State {
        State {
            mode: Mode::Unset,
            absolute: true,
            unit_mm: 1.0,
            plane: Plane::XY,
            centre_absolute: false,
            position: [Err(Reason::PositionUnknown); 3],
            turn: Turn::Unknown(Reason::OrientationUnknown),
            abc: [Err(Reason::OrientationUnknown); 3],
            rpy: [Err(Reason::OrientationUnknown); 3],
            vector: [Err(Reason::OrientationUnknown); 3],
            spin: Ok(0.0),
            rpy_stated: false,
            shift: [Ok(0.0); 3],
            frame: frame.to_owned(),
            programmable: None,
            transform: 0,
            doubtful: 0,
            calls: None,
            radius: false,
            tip: false,
            vector_words: false,
            tool: tool.to_owned(),
            feed: Err(Reason::Variable),
            feed_per_minute: true,
            exact_stop: false,
            exact_stop_holds: false,
            pole: [Err(Reason::PositionUnknown); 2],
            variables: BTreeMap::new(),
            uncertain: 0,
            previous: None,
        }
    }

    /// A place that can be reached from elsewhere: what the text before says holds no more, but for groups that the
    /// whole file sets to one thing only.
    pub(super) fn forget(&mut self, constant: u32) {
        let flow = Err(Reason::UnknownFlow);
        self.mode = Mode::Unset;
        self.position = [flow; 3];
        self.turn = Turn::Unknown(Reason::UnknownFlow);
        (self.abc, self.rpy, self.vector, self.spin) = ([flow; 3], [flow; 3], [flow; 3], flow);
        self.feed = flow;
        self.pole = [flow; 2];
        for value in self.variables.values_mut() {
            *value = flow;
        }
        self.uncertain |= !constant & ((1 << GROUPS) - 1);
        self.previous = None;
    }

    /// After the machine has gone where the text does not tell.
    pub(super) fn lose_position(&mut self) {
        self.position = [Err(Reason::PositionUnknown); 3];
        self.previous = None;
    }

    pub(super) fn certain(&mut self, group: Group) {
        self.uncertain &= !(1 << group as u32);
    }

    pub(super) fn is_uncertain(&self, group: Group) -> bool {
        self.uncertain & 1 << group as u32 != 0
    }

    /// What holds after a block that may have been skipped.
    pub(super) fn joined(mut self, other: &State) -> State {
        let same = |a: &mut Worth, b: &Worth| {
            if *a != *b {
                *a = Err(Reason::UnknownFlow);
            }
        };
        let pairs = |a: &mut [Worth], b: &[Worth]| a.iter_mut().zip(b).for_each(|(a, b)| same(a, b));
        pairs(&mut self.position, &other.position);
        pairs(&mut self.abc, &other.abc);
        pairs(&mut self.rpy, &other.rpy);
        pairs(&mut self.vector, &other.vector);
        pairs(&mut self.shift, &other.shift);
        pairs(&mut self.pole, &other.pole);
        same(&mut self.spin, &other.spin);
        same(&mut self.feed, &other.feed);
        if self.turn != other.turn {
            self.turn = Turn::Unknown(Reason::UnknownFlow);
        }
        if self.mode != other.mode {
            self.mode = Mode::Unset;
        }
        for (group, differs) in [
            (Group::Distance, self.absolute != other.absolute),
            (Group::Unit, self.unit_mm != other.unit_mm),
            (Group::Plane, self.plane != other.plane),
            (Group::Frame, self.frame != other.frame || self.programmable != other.programmable),
            (Group::Radius, self.radius != other.radius),
            (Group::Tip, self.tip != other.tip || self.vector_words != other.vector_words),
            (Group::Transform, self.transform != other.transform),
            (Group::Tool, self.tool != other.tool),
            (Group::Shift, self.shift != other.shift),
        ] {
            if differs {
                self.uncertain |= 1 << group as u32;
            }
        }
        self.uncertain |= other.uncertain;
        self.doubtful |= other.doubtful;
        self.calls = self.calls.or(other.calls);
        let keys: Vec<Variable> = self.variables.keys().chain(other.variables.keys()).cloned().collect();
        for key in keys {
            if self.variables.get(&key) != other.variables.get(&key) {
                self.variables.insert(key, Err(Reason::UnknownFlow));
            }
        }
        if self.previous != other.previous {
            self.previous = None;
        }
        self
    }

    /// Whether the rotary words that hold are those of a convention.
    pub(super) fn rotation(&self, angles: Option<Angles>) -> Result<nalgebra::UnitQuaternion<f64>, Reason> {
        let all =
            |values: &[Worth; 3]| -> Result<[f64; 3], Reason> { Ok([values[0]?, values[1]?, values[2]?]) };
        match self.turn {
            Turn::Unknown(reason) => Err(reason),
            Turn::Angles => {
                let values = all(&self.abc)?;
                Ok(angles.ok_or(Reason::Convention)?.rotation(values))
            }
            Turn::Rpy if !self.rpy_stated => Err(Reason::Convention),
            Turn::Rpy => Ok(Angles::Wpr.rotation(all(&self.rpy)?)),
            Turn::Vector => {
                super::orientation::spun(all(&self.vector)?, self.spin?).ok_or(Reason::WrongShape)
            }
        }
    }
}
