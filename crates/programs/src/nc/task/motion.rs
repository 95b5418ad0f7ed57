//! Where a block goes, and with what.

use std::sync::Arc as Shared;

use nalgebra::UnitQuaternion;

use super::super::arc::{Arc, Plane};
use super::super::dialect::Dialect;
use super::super::expression::Worth;
use super::super::machine::{Group, Mode, OF_ALL, OF_ARCS, OF_TOOL, Turn};
use super::super::syntax::Belongs;
use super::{Event, Lister, Needs, Said, Written};
use crate::motion::{
    FARTHEST_MM, Modal, Motion, MotionKind, MotionTarget, Origin, Reason, RobTarget, Role, Span, Speed,
    SpeedValue, Switch, TargetValue, Zone, ZoneValue,
};

impl Lister<'_, '_> {
    fn instruction(&mut self, name: &str) -> Shared<str> {
        if let Some(found) = self.instructions.get(name) {
            return found.clone();
        }
        let shared: Shared<str> = name.into();
        self.instructions.insert(name.to_owned(), shared.clone());
        shared
    }

    fn listed(&mut self, said: &Said<'_>, name: &str, kind: MotionKind) -> Motion {
        let first = said.words.first().map_or(self.tree.nodes[said.node as usize].first, |word| word.first);
        Motion {
            place: self.place(first),
            statement: self.tree.node_span(said.node),
            instruction: self.instruction(name),
            kind,
            targets: Vec::new(),
            speed: None,
            zone: None,
            tool: None,
            work_object: None,
            timed: false,
            insertable: false,
            straightens: false,
            rapid: kind == MotionKind::Joint,
            configures: false,
            axis: None,
            by_radius: false,
            modal: Modal { conf_linear: Switch::Off, conf_joint: Switch::Off, ..Modal::START },
            in_loop: false,
            conditional: said.skippable,
            previous: self.state.previous,
            routine: None,
            left: None,
        }
    }

    fn push(&mut self, motion: Motion, written: Written) -> u32 {
        let index = self.listing.motions.len() as u32;
        self.listing.motions.push(motion);
        self.written.push(written);
        self.events.push(Event::Motion(index));
        index
    }

    /// A motion that is listed and left.
    pub(super) fn left(&mut self, said: &Said<'_>, name: &str, reason: Reason) {
        let mut motion = self.listed(said, name, MotionKind::Unknown);
        motion.left = Some(reason);
        let written = self.written_as(said, None);
        self.push(motion, written);
        self.state.previous = None;
        if said.spin.is_some() {
            // It holds beyond what makes the orientation unknown.
            self.state.spin = Err(Reason::OrientationUnknown);
        }
    }

    /// A path of its own kind that is listed and left.
    pub(super) fn left_path(&mut self, said: &Said<'_>, name: &str, needs: Needs) {
        self.left(said, name, Reason::NotFollowed);
        if let Some(written) = self.written.last_mut() {
            written.needs = needs;
        }
    }

    /// What the way of a block hangs on where it is no line and no arc, or a line that its words say by an angle.
    fn needs_of(&self, said: &Said<'_>, mode: Mode) -> Needs {
        match mode {
            Mode::Other(Reason::NotFollowed) if self.state.tangent => Needs::Tangent,
            Mode::Other(Reason::NotFollowed) => Needs::Start,
            _ if said.aside == Some(Reason::NotFollowed) => Needs::Start,
            // No word can be put into a block with R+, and none of A, B, C into this LN: what they leave out holds on.
            _ if said.lengthens => Needs::Start,
            _ if said.aside == Some(Reason::AlongNormal) && said.axes.contains(&None) => Needs::Start,
            _ => Needs::Nothing,
        }
    }

    fn written_as(&self, said: &Said<'_>, arc: Option<(Arc, bool, bool)>) -> Written {
        let state = &self.state;
        let angles = if state.turn == Turn::Rpy { &state.rpy } else { &state.abc };
        let vector = match (state.vector, state.spin) {
            ([Ok(x), Ok(y), Ok(z)], Ok(spin)) => Some(([x, y, z], spin)),
            _ => None,
        };
        Written {
            node: said.node,
            absolute: state.absolute,
            unit_mm: state.unit_mm,
            counting_open: state.doubt(1 << Group::Distance as u32).is_some(),
            start: state.position.map(Result::ok),
            start_angles: angles.map(Result::ok),
            angles: angles.map(Result::ok),
            start_vector: vector,
            vector,
            shift: state.shift.map(Result::ok),
            turn: state.turn,
            vector_words: state.vector_words,
            arc,
            insertable: false,
            paraxial: said.paraxial,
            restates: false,
            may_lack: self.may_lack(said),
            needs: Needs::Nothing,
        }
    }

    /// Whether a word of the block may say nothing: Fanuc passes over a word whose variable has never been set.
    fn may_lack(&self, said: &Said<'_>) -> bool {
        let words = said.axes.iter().chain(&said.abc).chain(&said.centre).chain([&said.radius]).flatten();
        let unset = |&index: &usize| {
            let word = &said.words[index];
            matches!(word.belongs, Belongs::Expression { .. }) && self.worth(word).0.is_err()
        };
        matches!(self.dialect, Dialect::Fanuc | Dialect::Iso) && { words }.any(unset)
    }

    fn axis_values(
        &self,
        said: &Said<'_>,
        words: &[Option<usize>; 3],
        old: &[Worth; 3],
        unit: f64,
    ) -> [Worth; 3] {
        std::array::from_fn(|axis| match words[axis] {
            None => old[axis],
            Some(index) => {
                let (value, increment) = self.worth(&said.words[index]);
                let value = value.map(|value| value * unit);
                if increment.unwrap_or(!self.state.absolute) {
                    old[axis].and_then(|old| value.map(|value| old + value))
                } else {
                    value
                }
            }
        })
    }

    /// Where the axes stand at the end of a block.
    fn ends_at(&self, said: &Said<'_>, from: &[Worth; 3]) -> [Worth; 3] {
        let mut to = self.axis_values(said, &said.axes, from, self.state.unit_mm);
        for (axis, to) in to.iter_mut().enumerate() {
            let Some(index) = said.axes[axis] else { continue };
            let increment = self.worth(&said.words[index]).1.unwrap_or(!self.state.absolute);
            if !increment {
                *to = to.and_then(|value| self.state.shift[axis].map(|shift| value + shift));
            }
        }
        to
    }

    /// Whether a target stands in the block as numbers.
    fn origin(&self, said: &Said<'_>, value: &Result<TargetValue, Reason>) -> Origin {
        let words = said.axes.iter().chain(&said.abc).chain(&said.rpy).chain(&said.vector);
        let literal = words.flatten().all(|&index| self.literal(&said.words[index]).is_some());
        match value {
            Ok(_) if literal => Origin::Inline,
            Ok(_) => Origin::Computed,
            Err(_) => Origin::Unknown,
        }
    }

    /// Where a block goes.
    pub(super) fn motion(&mut self, said: &Said<'_>, machine: bool) {
        let heidenhain = self.dialect == Dialect::Heidenhain;
        let mode = if heidenhain && said.rapid && self.state.mode == Mode::Linear {
            Mode::Rapid
        } else {
            self.state.mode
        };
        let straight = matches!(mode, Mode::Rapid | Mode::Linear);
        let vector_words = self.state.vector_words && straight;
        let has_centre = said.centre.iter().any(Option::is_some);
        let bends = has_centre && !vector_words || said.radius.is_some();
        // R, I and K of a straight block round or cut its corner, on controls that take them.
        let cut = self.dialect.paren_comments() && straight && bends;
        let circular = matches!(mode, Mode::Circular(_));
        if !(said.moves() || circular && bends || vector_words && has_centre) {
            self.without_axes(said);
            return;
        }
        let unknown = match mode {
            Mode::Unset => Some(Reason::NoMotionCode),
            Mode::Lost(reason) => Some(reason),
            _ => None,
        };
        if let Some(reason) = unknown {
            self.left(said, "?", reason);
            self.lose_all();
            return;
        }
        let before = self.written_as(said, None);
        // Orientation.
        let turn = self.turned(said, vector_words);
        // Position.
        let from = self.state.position;
        let to = self.ends_at(said, &from);
        let (name, kind) = name_and_kind(mode, heidenhain);
        let mut motion = self.listed(said, name, kind);
        let old_rotation = self.state.rotation(self.angles);
        self.state.turn = turn.0;
        (self.state.abc, self.state.rpy, self.state.vector, self.state.spin) = turn.1;
        let rotation = self.state.rotation(self.angles);
        let arc = self.targets(said, mode, [from, to], [old_rotation, rotation], &mut motion);
        motion.speed = (mode != Mode::Rapid).then(|| self.speed()).flatten();
        motion.zone = self.zone();
        motion.tool = Some(self.tool());
        motion.work_object = Some(self.work_object());
        motion.left = self.left_because(said, mode, machine, &motion);
        if cut && motion.left.is_none() {
            motion.left = Some(Reason::NotFollowed);
        }
        motion.timed = !self.state.feed_per_minute && kind != MotionKind::Joint;
        let splits = !motion.timed && self.splits(said, &before);
        motion.insertable = splits && kind == MotionKind::Linear && !said.others;
        motion.straightens = splits && arc.is_some() && !said.opaque;
        motion.axis = arc.map(|(arc, positive, _)| arc.plane.axis(positive));
        motion.by_radius = arc.is_some() && said.radius.is_some();
        let after = self.written_as(said, arc);
        let written = Written {
            insertable: motion.insertable,
            restates: self.restates(said, &motion),
            needs: self.needs_of(said, mode),
            ..before.until(&after)
        };
        let index = self.push(motion, written);
        self.state.previous = Some(index);
        self.state.position = to;
        self.arrived(said, mode, machine);
        // A tool vector holds in its own LN: the blocks after it have no word that says how the tool is turned now.
        if heidenhain && self.state.turn == Turn::Vector {
            self.state.lose_orientation();
            self.events.push(Event::Lost(super::ORIENTATION));
        }
    }

    /// The targets of a motion, and its arc with whether it turns positively and whether its centre is absolute.
    fn targets(
        &self,
        said: &Said<'_>,
        mode: Mode,
        [from, to]: [[Worth; 3]; 2],
        rotations: [Rotation; 2],
        motion: &mut Motion,
    ) -> Option<(Arc, bool, bool)> {
        let value = match said.lengthens {
            true => Err(Reason::RadiusCompensation),
            false => target(to, rotations[1]),
        };
        let origin = self.origin(said, &value);
        let argument = self.argument(said);
        let mut arc = None;
        if let Mode::Circular(positive) = mode {
            let found = self.arc(said, from, to, positive);
            let via = middle(found, [from, to], rotations);
            let via_origin = if via.is_ok() { Origin::Computed } else { Origin::Unknown };
            motion.targets.push(MotionTarget { role: Role::Via, value: via, origin: via_origin, argument });
            arc = found.ok().map(|arc| (arc, positive, self.state.centre_absolute));
        }
        if motion.kind != MotionKind::Unknown {
            motion.targets.push(MotionTarget { role: Role::To, value, origin, argument });
        }
        arc
    }

    /// Whether a block may stand before this one: the words of this block that change what numbers mean would come after it.
    fn splits(&self, said: &Said<'_>, before: &Written) -> bool {
        self.meaning == self.state.meaning()
            && !begins_something(said)
            && self.dialect != Dialect::Heidenhain
            && !said.skippable
            && before.start.iter().all(Option::is_some)
    }

    /// What is not where the words of the block say.
    fn arrived(&mut self, said: &Said<'_>, mode: Mode, machine: bool) {
        if let Mode::Other(_) = mode {
            // A spline ends at its last point, whatever its way.
            self.state.previous = None;
        }
        let call = self.modal_call(said);
        if call == Some(Reason::Subprogram) || call == Some(Reason::Cycle) && self.calls_program {
            let held = self.state.modal_call;
            // G66 has been noted itself.
            if !self.dialect.paren_comments() {
                self.listing.outside.push(self.listing.motions.len() as u32 - 1);
            }
            self.forget();
            self.state.modal_call = held;
        } else if (machine || said.aside.is_some())
            && said.abc.iter().chain(&said.rpy).chain(&said.vector).any(Option::is_some)
        {
            self.lose_all();
        } else if mode == Mode::Other(Reason::Cycle)
            || machine
            || call.is_some()
            || matches!(said.aside, Some(Reason::Transformed | Reason::NotFollowed | Reason::Probe))
            || said.opaque
            || said.others && self.parallel()
        {
            self.lose_position();
        } else if said.aside == Some(Reason::AlongNormal) {
            // How the tool is turned at the end of this is not what the block before says.
            self.state.lose_orientation();
            self.state.previous = None;
            self.events.push(Event::Lost(super::ORIENTATION));
        } else if said.aside.is_some() {
            // The place is as before in the axes that the block leaves out, with what has been corrected there.
            self.state.lose_orientation();
            self.events.push(Event::Lost(super::ORIENTATION));
        }
        if said.lengthens {
            self.lose_axes(said);
        }
        if said.opaque || self.contour.is_some() {
            self.lose_all();
        }
        // Where it is not known what the numbers mean, where they lead is not known either.
        let meaning = [Group::Distance, Group::Unit, Group::Shift, Group::Diameter, Group::Rotary];
        if self.state.doubt(meaning.iter().fold(0, |all, &group| all | 1 << group as u32)).is_some() {
            self.lose_all();
        }
    }

    /// Whether a straight motion that stays can have the words said again that it leaves out.
    fn restates(&self, said: &Said<'_>, motion: &Motion) -> bool {
        let straight = matches!(motion.kind, MotionKind::Linear | MotionKind::Joint);
        let plain = straight && !said.opaque && said.aside.is_none() && self.contour.is_none();
        let settled = !(1 << Group::Radius as u32 | OF_TOOL) & OF_ALL;
        // A cycle runs where the words of the block say.
        let call = self.modal_call(said);
        // With words put in, a block would move that does not where its variable has never been set.
        plain
            && !self.may_lack(said)
            && call.is_none_or(|call| call == Reason::Cycle)
            && self.state.turned == 0
            && self.state.doubt(settled).is_none()
            && match motion.left {
                None | Some(Reason::Skippable | Reason::UnknownFlow | Reason::UnknownWord) => true,
                Some(Reason::NotFollowed) => said.corner,
                Some(Reason::Cycle) => call.is_some(),
                _ => false,
            }
    }

    /// Whether U, V and W may be increments of X, Y and Z (lathes).
    fn parallel(&self) -> bool {
        matches!(self.dialect, Dialect::Fanuc | Dialect::Iso)
    }

    /// What runs after this motion: G66, MCALL, M89, or M99 of Heidenhain.
    fn modal_call(&self, said: &Said<'_>) -> Option<Reason> {
        let here = self.dialect == Dialect::Heidenhain && said.m.contains(&99);
        self.state.modal_call.or(here.then_some(Reason::Cycle))
    }

    /// A block without words of the axes that are followed: it may move others, or what it does could not be read.
    fn without_axes(&mut self, said: &Said<'_>) {
        if !said.opaque && self.calls_cycle(said) {
            return;
        }
        if said.opaque {
            self.left(said, "?", Reason::Unread);
            self.lose_all();
        } else if let Some(reason) = said.aside {
            self.left(said, "path", reason);
            match reason {
                Reason::Transformed => self.lose_position(),
                _ => self.lose_all(),
            }
        } else if said.others {
            self.left(said, "axes", Reason::ExternalOnly);
            if self.parallel() {
                self.lose_position();
            }
        }
    }

    #[allow(clippy::type_complexity)]
    fn turned(
        &self,
        said: &Said<'_>,
        vector_words: bool,
    ) -> (Turn, ([Worth; 3], [Worth; 3], [Worth; 3], Worth)) {
        let state = &self.state;
        let (mut abc, mut rpy, mut vector, mut spin) = (state.abc, state.rpy, state.vector, state.spin);
        let mut turn = state.turn;
        let any = |words: &[Option<usize>; 3]| words.iter().any(Option::is_some);
        // What turns the tool in one way leaves open what the words of the other ways hold.
        let lost = [Err(Reason::OrientationUnknown); 3];
        if any(&said.abc) {
            abc = self.axis_values(said, &said.abc, &abc, 1.0);
            (turn, rpy, vector) = (Turn::Angles, lost, lost);
        }
        if any(&said.rpy) {
            rpy = self.axis_values(said, &said.rpy, &rpy, 1.0);
            (turn, abc, vector) = (Turn::Rpy, lost, lost);
        }
        let vector_said = if vector_words { &said.centre } else { &said.vector };
        if any(vector_said) {
            // Components that are not written are 0.
            vector = vector_said.map(|index| index.map_or(Ok(0.0), |index| self.worth(&said.words[index]).0));
            (turn, abc, rpy) = (Turn::Vector, lost, lost);
        }
        if let Some(index) = said.spin {
            spin = self.worth(&said.words[index]).0;
            if !state.spin_absolute {
                spin = Err(Reason::OrientationUnknown);
            }
        }
        (turn, (abc, rpy, vector, spin))
    }

    fn arc(&self, said: &Said<'_>, from: [Worth; 3], to: [Worth; 3], positive: bool) -> Result<Arc, Reason> {
        let one = |index: usize| self.literal(&said.words[index]) == Some(1.0);
        // P: turns of LinuxCNC; Q, L: spirals and cones.
        let more = self.dialect != Dialect::Siemens
            && (said.p.is_some_and(|index| !one(index)) || said.q.is_some() || said.l.is_some());
        if said.turns || more {
            return Err(Reason::NotFollowed);
        }
        let (start, end) = (all(from)?, all(to)?);
        let plane = self.state.plane;
        let unit = self.state.unit_mm;
        if self.dialect == Dialect::Heidenhain && plane != Plane::XY {
            return Err(Reason::Transformed);
        }
        if self.dialect == Dialect::Heidenhain && said.radius.is_none() {
            let centre = [self.state.pole[0]?, self.state.pole[1]?];
            return Arc::about(plane, start, end, centre, positive).ok_or(Reason::WrongShape);
        }
        if let Some(index) = said.radius {
            let radius = self.worth(&said.words[index]).0? * unit;
            return Arc::of_radius(plane, start, end, radius, positive).ok_or(Reason::WrongShape);
        }
        let mut centre = [0.0; 2];
        for (place, axis) in [plane.a, plane.b].into_iter().enumerate() {
            centre[place] = match said.centre[axis] {
                None if self.state.centre_absolute => return Err(Reason::MissingArgument),
                None => start[axis],
                Some(index) => {
                    let (value, increment) = self.worth(&said.words[index]);
                    let value = value? * unit;
                    if increment.unwrap_or(!self.state.centre_absolute) {
                        start[axis] + value
                    } else {
                        value + self.state.shift[axis]?
                    }
                }
            };
        }
        if said.centre[plane.a].is_none() && said.centre[plane.b].is_none() {
            return Err(Reason::MissingArgument);
        }
        Arc::about(plane, start, end, centre, positive).ok_or(Reason::WrongShape)
    }

    /// From the first to the last word that says where to go.
    fn argument(&self, said: &Said<'_>) -> Span {
        let words = said
            .axes
            .iter()
            .chain(&said.abc)
            .chain(&said.rpy)
            .chain(&said.vector)
            .chain(&said.centre)
            .flatten()
            .map(|&index| said.words[index]);
        let (first, end) =
            words.fold((u32::MAX, 0), |(first, end), word| (first.min(word.first), end.max(word.end)));
        if first < end { self.tree.span(first, end) } else { self.tree.node_span(said.node) }
    }

    fn left_because(&self, said: &Said<'_>, mode: Mode, machine: bool, motion: &Motion) -> Option<Reason> {
        let state = &self.state;
        let turns = !matches!(state.turn, Turn::Unknown(Reason::OrientationUnknown));
        let needs_tip = matches!(self.dialect, Dialect::Fanuc | Dialect::Siemens | Dialect::Heidenhain);
        if said.opaque {
            Some(Reason::Unread)
        } else if said.skippable {
            Some(Reason::Skippable)
        } else if said.corner {
            Some(Reason::NotFollowed)
        } else if let Mode::Other(reason) = mode {
            Some(reason)
        } else if machine {
            Some(Reason::MachineCoordinates)
        } else if self.contour.is_some() {
            Some(Reason::Cycle)
        } else if let Some(reason) = said.aside.or(self.modal_call(said)) {
            Some(reason)
        } else if let Some(reason) = state.doubt(OF_ALL) {
            Some(reason)
        } else if let (Mode::Circular(_), Some(reason)) = (mode, state.doubt(OF_ARCS)) {
            Some(reason)
        } else if state.turned != 0 {
            Some(Reason::Transformed)
        } else if said.others && self.parallel() {
            Some(Reason::UnknownWord)
        } else if self.dialect == Dialect::Heidenhain
            && matches!(mode, Mode::Circular(_))
            && state.plane != Plane::XY
        {
            // The working plane goes with the axis of the tool.
            Some(Reason::Transformed)
        } else if state.radius {
            Some(Reason::RadiusCompensation)
        } else if turns && needs_tip && !state.tip {
            Some(Reason::NoTipControl)
        } else if self.dialect == Dialect::Heidenhain
            && matches!(mode, Mode::Circular(_))
            && said.radius.is_none()
        {
            Some(Reason::CentreElsewhere)
        } else if state.feed == Err(Reason::NumberRange) && mode != Mode::Rapid {
            Some(Reason::NumberRange)
        } else {
            self.listing.left_by_frames(motion)
        }
    }

    fn speed(&mut self) -> Option<u32> {
        let feed = match (self.state.feed, self.state.feed_per_minute) {
            (Ok(feed), true) => feed,
            _ => return None,
        };
        if let Some(&index) = self.speeds.get(&feed.to_bits()) {
            return Some(index);
        }
        let value = SpeedValue {
            tcp_mm_s: feed,
            orientation_deg_s: 500.0,
            linear_external_mm_s: 5000.0,
            rotating_external_deg_s: 1000.0,
        };
        self.listing.speeds.push(Speed { text: format!("F{}", feed * 60.0), value: Ok(value) });
        let index = self.listing.speeds.len() as u32 - 1;
        self.speeds.insert(feed.to_bits(), index);
        Some(index)
    }

    fn zone(&mut self) -> Option<u32> {
        if !self.state.exact_stop {
            return None;
        }
        let fine = ZoneValue { fine: true, tcp_mm: 0.0, orientation_mm: 0.0, orientation_deg: 0.0 };
        let zone = Zone { text: "exact stop".to_owned(), value: Ok(fine) };
        let found = self.listing.zones.iter().position(|other| *other == zone);
        Some(found.unwrap_or_else(|| {
            self.listing.zones.push(zone);
            self.listing.zones.len() - 1
        }) as u32)
    }
}

impl Written {
    /// From where the tool stands before a block to how it is turned after it.
    fn until(self, after: &Written) -> Written {
        let same_angles = (self.turn == Turn::Rpy) == (after.turn == Turn::Rpy);
        Written {
            arc: after.arc,
            start_angles: if same_angles { self.start_angles } else { [None; 3] },
            turn: after.turn,
            angles: after.angles,
            vector: after.vector,
            ..self
        }
    }
}

/// What a motion of this mode is called in lists, and what kind it is.
fn name_and_kind(mode: Mode, heidenhain: bool) -> (&'static str, MotionKind) {
    match mode {
        Mode::Rapid if heidenhain => ("L FMAX", MotionKind::Joint),
        Mode::Linear if heidenhain => ("L", MotionKind::Linear),
        Mode::Circular(_) if heidenhain => ("C", MotionKind::Circular),
        Mode::Rapid => ("G0", MotionKind::Joint),
        Mode::Linear => ("G1", MotionKind::Linear),
        Mode::Circular(false) => ("G2", MotionKind::Circular),
        Mode::Circular(true) => ("G3", MotionKind::Circular),
        Mode::Other(Reason::Cycle) => ("cycle", MotionKind::Unknown),
        Mode::Other(_) | Mode::Unset | Mode::Lost(_) => ("path", MotionKind::Unknown),
    }
}

type Rotation = Result<UnitQuaternion<f64>, Reason>;

/// The pose at these axes, turned so.
fn target(position: [Worth; 3], rotation: Rotation) -> Result<TargetValue, Reason> {
    let position_mm = all(position)?;
    if !position_mm.iter().all(|coordinate| coordinate.abs() <= FARTHEST_MM) {
        return Err(Reason::BeyondReach);
    }
    let q = rotation?;
    let quaternion = [q.w, q.i, q.j, q.k];
    Ok(TargetValue::Cartesian(RobTarget { position_mm, quaternion, conf: [0; 4], external: [None; 6] }))
}

/// The pose half way along an arc.
fn middle(
    arc: Result<Arc, Reason>,
    [from, to]: [[Worth; 3]; 2],
    rotations: [Rotation; 2],
) -> Result<TargetValue, Reason> {
    let arc = arc?;
    let (Ok(a), Ok(b)) = (all(from), all(to)) else { return Err(Reason::PositionUnknown) };
    let half = match rotations {
        [Ok(a), Ok(b)] => Ok(a.try_slerp(&b, 0.5, 1e-9).unwrap_or(b)),
        [Err(reason), _] | [_, Err(reason)] => Err(reason),
    };
    target(arc.at(a, b, 0.5).map(Ok), half)
}

fn all(values: [Worth; 3]) -> Result<[f64; 3], Reason> {
    Ok([values[0]?, values[1]?, values[2]?])
}

/// Whether a block starts the spindle, the coolant or what else an M word may: a block that is put in before it would move
/// without. Stops and ends come when the motion is done.
fn begins_something(said: &Said<'_>) -> bool {
    said.m.iter().any(|m| !matches!(m, 0..=2 | 5 | 9 | 30))
        || said.words.iter().any(|word| word.address() == Some(b'S'))
}
