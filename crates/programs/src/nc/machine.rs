//! The modal state of a control: what a block changes, and what therefore holds in it.

use super::arc::Plane;
use super::dialect::Dialect;
use super::expression::{Variable, Worth};
use super::orientation::Angles;
use crate::motion::{Frame, Reason};
use crate::shared::Map;
use truegrind_math::se3::Pose;

/// What the last word of the motion group said.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) enum Mode {
    /// Nothing yet, or the aim of a jump.
    Unset,
    /// What holds is not known, for this reason.
    Lost(Reason),
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
    /// T and what else brings tools in.
    Tool,
    /// G43, G49, H; the edge D of Siemens: which length of the tool counts.
    Length,
    /// G92, G52.
    Shift,
    // What turns, scales or bends coordinates, each a state of its own: the end of one is not the end of another.
    /// G15, G16.
    Polar,
    /// G50, G51; cycle 11.
    Scale,
    /// G50.1, G51.1, G100, G101; cycle 8.
    Mirror,
    /// G68, G68.2, G69; cycle 10.
    Rotation,
    /// G12.1, G13.1: polar interpolation.
    PolarPath,
    /// G7.1, G107: a developed cylinder.
    Cylinder,
    /// G7, G8, DIAMON: diameters.
    Diameter,
    /// TRANSMIT, TRACYL, TRAANG.
    Kinematic,
    /// ORIMKS, ORIWKS.
    OrientationFrame,
    /// CYCLE800, PLANE, cycle 19, G268.
    Swivel,
    /// ROT, SCALE, MIRROR where they are no rigid motion that is known.
    Programmable,
    /// TOFRAME, TOROT.
    ToolFrame,
    /// PAROT.
    PartFrame,
    /// G54.2, G54.4, G254: offsets of the table.
    Fixture,
    /// TRANS DATUM TABLE, cycle 7 with a row of the table.
    Datum,
    /// Cycle 26: a scale for each axis.
    AxisScale,
    /// A, B, C are counted from elsewhere (G92 A0).
    Rotary,
    // What matters for some motions only.
    /// G90.1, G91.1: centres of arcs.
    Centre,
    /// ORIRPY, ORIEULER.
    Rpy,
    /// ORIROTA, ORIROTR.
    Spin,
}

pub(super) const GROUPS: u32 = Group::Spin as u32 + 1;

/// What matters for arcs only.
pub(super) const OF_ARCS: u32 = 1 << Group::Plane as u32 | 1 << Group::Centre as u32;

/// Which tool it is, and which of its lengths counts.
pub(super) const OF_TOOL: u32 = 1 << Group::Tool as u32 | 1 << Group::Length as u32;

/// What matters for every motion. Rpy and Spin say what certain words mean: those are not known where they are not.
pub(super) const OF_ALL: u32 =
    ((1 << GROUPS) - 1) & !(OF_ARCS | 1 << Group::Rpy as u32 | 1 << Group::Spin as u32);

/// Frames that the program itself sets, by name; `None` where what it sets is not known.
#[derive(Debug, Clone, PartialEq, Default)]
pub(super) struct Assigned {
    by_name: Map<String, Option<Frame>>,
    /// Those that have been set to what is not known any more, besides.
    lost: Map<String, ()>,
    /// Whether any other may have been set too.
    all: bool,
    /// Those with offsets of rotary axes, which no place and no turn about Z takes back.
    rotary: Map<String, ()>,
    /// Whether any other may have them too.
    all_rotary: bool,
}

impl Assigned {
    /// What the program has set for a name, if it has or may have.
    pub(super) fn of(&self, name: &str) -> Option<Option<Frame>> {
        let name = name.to_ascii_uppercase();
        match self.by_name.get(&name) {
            Some(frame) => Some(*frame),
            None => (self.all || self.lost.contains_key(&name)).then_some(None),
        }
    }

    pub(super) fn set(&mut self, name: &str, frame: Option<Frame>) {
        let name = name.to_ascii_uppercase();
        self.lost.insert(name.clone(), ());
        self.by_name.insert(name, frame);
    }

    /// Whether a name has, or may have, offsets of rotary axes.
    pub(super) fn is_rotary(&self, name: &str) -> bool {
        self.all_rotary || self.rotary.contains_key(&name.to_ascii_uppercase())
    }

    /// The program says whether a name has offsets of rotary axes.
    pub(super) fn set_rotary(&mut self, name: &str, rotary: bool) {
        let name = name.to_ascii_uppercase();
        if rotary {
            self.rotary.insert(name, ());
        } else {
            self.rotary.remove(&name);
        }
    }

    /// Any of them may have been set to anything.
    pub(super) fn lose_all(&mut self) {
        self.by_name = Map::new();
        self.all = true;
        self.all_rotary = true;
    }

    /// What holds where the way may have gone either way.
    fn joined(&mut self, other: &Assigned) {
        let agree = |a: Option<&Option<Frame>>, b: Option<&Option<Frame>>| {
            if a == b { a.copied() } else { Some(None) }
        };
        self.by_name = self.by_name.joined(&other.by_name, &agree);
        self.lost = self.lost.joined(&other.lost, &|_, _| Some(()));
        self.all |= other.all;
        self.rotary = self.rotary.joined(&other.rotary, &|_, _| Some(()));
        self.all_rotary |= other.all_rotary;
    }

    /// What holds where the way may have come from anywhere in the file: all that has been set, unless any is set `elsewhere` too.
    /// The same of offsets of rotary axes.
    fn forget(&mut self, elsewhere: bool, rotary: bool) {
        if elsewhere {
            let was = self.all_rotary;
            self.lose_all();
            self.all_rotary = was || rotary;
        }
    }
}

/// What a file gives values.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct Assigns {
    /// Work offsets.
    pub(super) frames: bool,
    /// Work offsets of rotary axes.
    pub(super) rotary: bool,
    /// Tools.
    pub(super) tools: bool,
}

impl Assigns {
    /// Anything.
    pub(super) const ALL: Assigns = Assigns { frames: true, rotary: true, tools: true };
}

/// What variables hold; a copy shares it.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Variables {
    known: Map<Variable, Worth>,
    /// Why the others that have ever been set are not known.
    lost: Reason,
}

impl Default for Variables {
    fn default() -> Self {
        Variables { known: Map::new(), lost: Reason::Variable }
    }
}

impl Variables {
    /// What a variable holds; `set`: whether anything has ever set it.
    pub(super) fn get(&self, name: &Variable, set: impl FnOnce() -> bool) -> Worth {
        match self.known.get(name) {
            Some(value) => *value,
            None if self.lost != Reason::Variable && set() => Err(self.lost),
            None => Err(Reason::Variable),
        }
    }

    pub(super) fn insert(&mut self, name: Variable, value: Worth) {
        self.known.insert(name, value);
    }

    /// None of them is known any more.
    pub(super) fn lose(&mut self, because: Reason) {
        *self = Variables { known: Map::new(), lost: because };
    }

    /// What both ways leave.
    fn join(&mut self, other: &Variables) {
        let (a_lost, b_lost) = (Err(self.lost), Err(other.lost));
        let lost = if self.lost == other.lost { self.lost } else { Reason::UnknownFlow };
        let agree = |a: Option<&Worth>, b: Option<&Worth>| {
            let (a, b) = (a.unwrap_or(&a_lost), b.unwrap_or(&b_lost));
            let value = if a == b { *a } else { Err(Reason::UnknownFlow) };
            (value != Err(lost)).then_some(value)
        };
        self.known = self.known.joined(&other.known, &agree);
        self.lost = lost;
    }
}

/// Which length the control adds to the spindle.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Length {
    /// That of the tool: nothing says otherwise.
    OfTool,
    /// That of an offset number (H).
    Of(u32),
    /// None (G49).
    None,
}

/// The state of a control between two blocks.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct State {
    pub(super) mode: Mode,
    /// Whether a path that is not followed goes on in the direction of the motion before.
    pub(super) tangent: bool,
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
    /// Whether G92 has a part in it.
    pub(super) preset: bool,
    /// G54, G500, …
    pub(super) frame: String,
    /// The datum shift of X, Y and Z (mm, Heidenhain); `None` where an axis of it is not known.
    pub(super) datum: [Option<f64>; 3],
    /// TRANS, ROT: a frame within the work frame.
    pub(super) programmable: Option<Pose>,
    /// Groups that turn, scale or bend coordinates now, one bit each.
    pub(super) turned: u32,
    pub(super) radius: bool,
    /// G43.4, TRAORI, M128.
    pub(super) tip: bool,
    /// G43.5: I, J, K are a tool vector.
    pub(super) vector_words: bool,
    pub(super) tool: String,
    /// A tool that M6 will bring in.
    pub(super) next_tool: Option<String>,
    pub(super) length: Length,
    /// The offset number that belongs to a tool which no T has named.
    pub(super) own_length: Option<u32>,
    /// The edge of the tool (Siemens: D).
    pub(super) edge: u32,
    /// Work offsets that the program sets.
    pub(super) frames: Assigned,
    /// Tools that the program sets.
    pub(super) tools: Assigned,
    /// Whether the work offset that holds has been set anew and not yet called (Siemens).
    pub(super) stale: bool,
    /// THETA counts from the frame of the tool vector (ORIROTA).
    pub(super) spin_absolute: bool,
    /// What runs after each motion (G66, MCALL).
    pub(super) modal_call: Option<Reason>,
    /// The motion word before a cycle (G80 of Fanuc goes back to it).
    pub(super) before_cycle: Mode,
    /// What M70 has kept.
    pub(super) kept: Option<Box<State>>,
    /// mm/s.
    pub(super) feed: Worth,
    /// G94.
    pub(super) feed_per_minute: bool,
    pub(super) exact_stop: bool,
    /// Whether that holds beyond its block (G61).
    pub(super) exact_stop_holds: bool,
    /// The centre of the last CC (Heidenhain).
    pub(super) pole: [Worth; 2],
    pub(super) variables: Variables,
    /// Groups whose state is not known, one bit each.
    pub(super) uncertain: u32,
    /// Groups that a word has set which these readers do not know, and why.
    pub(super) obscure: u32,
    pub(super) because: Reason,
    /// The motion before, where no other way leads here.
    pub(super) previous: Option<u32>,
}

/// What the numbers of a straight block mean: a block that is put in before another is read with what held before that one.
#[derive(Debug, Clone, PartialEq, Default)]
pub(super) struct Meaning {
    unit_mm: f64,
    tip: (bool, bool),
    radius: bool,
    feed_per_minute: bool,
    turned: u32,
    programmable: Option<Pose>,
    spin_absolute: bool,
}

impl State {
    pub(super) fn meaning(&self) -> Meaning {
        Meaning {
            unit_mm: self.unit_mm,
            tip: (self.tip, self.vector_words),
            radius: self.radius,
            feed_per_minute: self.feed_per_minute,
            turned: self.turned,
            programmable: self.programmable,
            spin_absolute: self.spin_absolute,
        }
    }

    pub(super) fn start(frame: &str, tool: &str) -> State {
        State {
            mode: Mode::Unset,
            tangent: true,
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
            preset: false,
            frame: frame.to_owned(),
            datum: [Some(0.0); 3],
            programmable: None,
            turned: 0,
            radius: false,
            tip: false,
            vector_words: false,
            tool: tool.to_owned(),
            next_tool: None,
            length: Length::OfTool,
            own_length: None,
            edge: 1,
            frames: Assigned::default(),
            tools: Assigned::default(),
            stale: false,
            spin_absolute: true,
            modal_call: None,
            before_cycle: Mode::Unset,
            kept: None,
            feed: Err(Reason::Variable),
            feed_per_minute: true,
            exact_stop: false,
            exact_stop_holds: false,
            pole: [Err(Reason::PositionUnknown); 2],
            variables: Variables::default(),
            uncertain: 0,
            obscure: 0,
            because: Reason::UnknownWord,
            previous: None,
        }
    }

    /// A place that can be reached from elsewhere: what the text before says holds no more, but for groups that the
    /// whole file sets to one thing only.
    pub(super) fn forget(&mut self, constant: u32, assigns: Assigns) {
        let flow = Err(Reason::UnknownFlow);
        self.mode = Mode::Lost(Reason::UnknownFlow);
        self.before_cycle = self.mode;
        self.frames.forget(assigns.frames, assigns.rotary);
        self.tools.forget(assigns.tools, false);
        self.next_tool = None;
        self.kept = None;
        self.position = [flow; 3];
        self.turn = Turn::Unknown(Reason::UnknownFlow);
        (self.abc, self.rpy, self.vector, self.spin) = ([flow; 3], [flow; 3], [flow; 3], flow);
        self.feed = flow;
        self.pole = [flow; 2];
        self.variables.lose(Reason::UnknownFlow);
        self.uncertain |= !constant & ((1 << GROUPS) - 1);
        self.rpy_stated &= constant & 1 << Group::Rpy as u32 != 0;
        self.spin_absolute &= constant & 1 << Group::Spin as u32 != 0;
        self.previous = None;
    }

    /// After the machine has gone where the text does not tell.
    pub(super) fn lose_position(&mut self) {
        self.position = [Err(Reason::PositionUnknown); 3];
        self.previous = None;
    }

    /// After the machine may have turned as well.
    pub(super) fn lose_orientation(&mut self) {
        let none = [Err(Reason::OrientationUnknown); 3];
        (self.abc, self.rpy, self.vector) = (none, none, none);
        self.turn = Turn::Unknown(Reason::OrientationUnknown);
    }

    /// After a word that is not known: it may have done and set anything.
    pub(super) fn lose_everything(&mut self, because: Reason) {
        self.lose_position();
        self.lose_orientation();
        self.mode = Mode::Lost(because);
        self.before_cycle = self.mode;
        self.feed = Err(because);
        self.pole = [Err(because); 2];
        self.variables.lose(because);
        self.obscure = (1 << GROUPS) - 1;
        self.because = because;
        self.next_tool = None;
    }

    pub(super) fn certain(&mut self, group: Group) {
        self.uncertain &= !(1 << group as u32);
        self.obscure &= !(1 << group as u32);
    }

    /// Whether a group turns, scales or bends coordinates from here on.
    pub(super) fn turn_frame(&mut self, group: Group, on: bool) {
        self.turned = self.turned & !(1 << group as u32) | u32::from(on) << group as u32;
    }

    /// What the tool is called whose frame the control counts with: H and D of another number, or none, make another of it.
    pub(super) fn tool_name(&self, dialect: Dialect) -> String {
        let own = |number: u32| self.own_length == Some(number) || self.tool == format!("T{number}");
        match (dialect, self.length) {
            (Dialect::Siemens, _) if self.edge == 1 => self.tool.clone(),
            (Dialect::Siemens, _) if self.edge == u32::MAX => format!("{} D?", self.tool),
            (Dialect::Siemens, _) => format!("{} D{}", self.tool, self.edge),
            (Dialect::Heidenhain, _) | (_, Length::OfTool) => self.tool.clone(),
            (_, Length::None) if self.tool == "T0" => self.tool.clone(),
            (_, Length::None) => "G49".to_owned(),
            (_, Length::Of(number)) if own(number) => self.tool.clone(),
            (_, Length::Of(u32::MAX)) => "H?".to_owned(),
            (_, Length::Of(number)) => format!("H{number}"),
        }
    }

    /// Why what holds in these groups is not known.
    pub(super) fn doubt(&self, groups: u32) -> Option<Reason> {
        if self.obscure & groups != 0 {
            return Some(self.because);
        }
        (self.uncertain & groups != 0).then_some(Reason::UnknownFlow)
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
        for (a, b) in self.datum.iter_mut().zip(other.datum) {
            *a = a.filter(|_| *a == b);
        }
        if self.turn != other.turn {
            self.turn = Turn::Unknown(Reason::UnknownFlow);
        }
        if self.mode != other.mode {
            self.mode = Mode::Lost(Reason::UnknownFlow);
        }
        if self.before_cycle != other.before_cycle {
            self.before_cycle = Mode::Lost(Reason::UnknownFlow);
        }
        let turned = self.turned ^ other.turned;
        self.uncertain |= turned;
        self.turned |= other.turned;
        self.frames.joined(&other.frames);
        self.tools.joined(&other.tools);
        self.stale |= other.stale;
        self.tangent |= other.tangent;
        self.preset |= other.preset;
        self.rpy_stated &= other.rpy_stated;
        self.spin_absolute &= other.spin_absolute;
        self.modal_call = self.modal_call.or(other.modal_call);
        if self.next_tool != other.next_tool {
            self.next_tool = Some("T?".to_owned());
        }
        for (group, differs) in [
            (Group::Distance, self.absolute != other.absolute),
            (Group::Unit, self.unit_mm != other.unit_mm),
            (Group::Plane, self.plane != other.plane),
            (Group::Frame, self.frame != other.frame),
            (Group::Programmable, self.programmable != other.programmable),
            (Group::Radius, self.radius != other.radius),
            (Group::Tip, self.tip != other.tip || self.vector_words != other.vector_words),
            (
                Group::Tool,
                self.tool != other.tool || self.own_length != other.own_length || self.edge != other.edge,
            ),
            (Group::Length, self.length != other.length || self.edge != other.edge),
            (Group::Centre, self.centre_absolute != other.centre_absolute),
            (Group::Shift, self.shift != other.shift),
        ] {
            if differs {
                self.uncertain |= 1 << group as u32;
            }
        }
        self.uncertain |= other.uncertain;
        if other.obscure != 0 {
            (self.obscure, self.because) = (self.obscure | other.obscure, other.because);
        }
        if self.kept != other.kept {
            self.kept = None;
        }
        if self.feed_per_minute != other.feed_per_minute {
            self.feed = Err(Reason::UnknownFlow);
        }
        self.variables.join(&other.variables);
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
