//! Work offsets, programmable frames and tools: what sets them, and their entries in the listing.

use nalgebra::{UnitQuaternion, Vector3};

use super::super::dialect::Dialect;
use super::super::modal_group::{ModalGroup, TOOL_GROUPS};
use super::super::modal_state::ModalState;
use super::super::orientation::Angles;
use super::super::setup::{self, flange_tool};
use super::super::syntax::{Word, WordValue};
use super::super::token::Token;
use super::{Block, Interpreter, StateEvent};
use crate::motion::{Frame, Reason, ReplacedFrame, Tool, WorkObject, WorkObjectValue, intern};
use truegrind_math::se3::Pose;

/// Frames that differ by less are the same but for their last digit (mm, rad).
const SAME_MM: f64 = 0.01;
const SAME_RAD: f64 = 1e-4;

impl Interpreter<'_, '_> {
    /// TRANS, ROT and their additive forms. True if the block is one of them.
    pub(super) fn programmable_frame(&mut self, block: &Block<'_>) -> bool {
        let Some(word) = block.words.iter().find(|word| {
            [
                "TRANS", "ATRANS", "ROT", "AROT", "SCALE", "ASCALE", "MIRROR", "AMIRROR", "ROTS", "AROTS",
                "CROTS",
            ]
            .iter()
            .any(|name| word.is(name))
        }) else {
            return false;
        };
        let name = word.name.to_ascii_uppercase();
        let adds = name[0] == b'A';
        let before = self.state.programmable_frame;
        let unsupported = |state: &ModalState| state.groups.is_on(ModalGroup::ProgrammableFrame);
        let was = unsupported(&self.state);
        let unknown = self.state.unknown_reason(ModalGroup::ProgrammableFrame.bit()).is_some();
        self.mark_programmable_frame_set();
        if adds && unknown {
            // The frame to which it adds is unknown.
            self.state.groups.set_value(ModalGroup::ProgrammableFrame, 1);
        }
        if !adds {
            // A command that does not add replaces the whole programmable frame, and nothing else.
            self.state.programmable_frame = None;
            self.state.groups.set_value(ModalGroup::ProgrammableFrame, 0);
        }
        let stated = block.has_motion_words() || block.words.iter().any(|word| word.is("RPL"));
        let pose = self.programmed_frame(block, &name, stated);
        match pose {
            Some(_) if !stated => {}
            Some(pose) => {
                self.state.programmable_frame =
                    Some(self.state.programmable_frame.unwrap_or_else(Pose::identity) * pose);
            }
            None => self.state.groups.set_value(ModalGroup::ProgrammableFrame, 1),
        }
        let rotation = |pose: &Option<Pose>| pose.map_or(UnitQuaternion::identity(), |pose| pose.rotation);
        let same = rotation(&before).angle_to(&rotation(&self.state.programmable_frame)) < 1e-9;
        if !same || was || unsupported(&self.state) {
            self.invalidate_pose();
        } else {
            self.displace_frame((!unknown).then_some(before));
        }
        true
    }

    /// The programmable frame was this and has been displaced without a turn: the arm stands where it stood, at other coordinates. They
    /// are unknown if the frame was. Where an increment begins after that, there or at the same coordinate in the new frame, is a setting of the
    /// control (840D: SD42440), and words that restate the place would decide it: a program with increments keeps its coordinates unknown.
    pub(super) fn displace_frame(&mut self, before: Option<Option<Pose>>) {
        let Some(before) = before.filter(|_| !self.is_conditional() && !self.may_increment) else {
            self.invalidate_position();
            return;
        };
        let [before, after] =
            [before, self.state.programmable_frame].map(|frame| frame.unwrap_or_else(Pose::identity));
        let moved = after.rotation.inverse() * (before.translation.vector - after.translation.vector);
        for (axis, position) in self.state.position.iter_mut().enumerate() {
            *position = position.map(|position| position + moved[axis]);
        }
        self.events.push(StateEvent::FrameMoved(moved.into()));
    }

    /// The frame of such a block; `None` where it is unknown or no rigid motion. `stated`: whether the block has values.
    fn programmed_frame(&self, block: &Block<'_>, name: &[u8], stated: bool) -> Option<Pose> {
        // Angles of ROT, lengths of TRANS, factors of SCALE.
        let lengths = name.ends_with(b"TRANS");
        let value = |index: usize| {
            let value = self.evaluate_word(&block.words[index]).0;
            if lengths { self.length_in_mm(value) } else { value }
        };
        let values: Result<Vec<Option<f64>>, Reason> =
            block.axes.iter().map(|word| word.map(value).transpose()).collect();
        let rpl = block.words.iter().find(|word| word.is("RPL"));
        // Offsets of rotary axes change the orientation that A, B and C state.
        let rotary = block.abc.iter().any(Option::is_some) || block.flags.other_axes;
        match (name, values) {
            (_, Err(_)) => None,
            _ if rotary => None,
            (b"TRANS" | b"ATRANS", Ok(shift)) => {
                let shift = Vector3::from_iterator(shift.iter().map(|value| value.unwrap_or(0.0)));
                Some(Pose::from_parts(shift.into(), UnitQuaternion::identity()))
            }
            (b"ROT" | b"AROT", Ok(angles)) => {
                let mut angles: Vec<f64> = angles.iter().map(|value| value.unwrap_or(0.0)).collect();
                match rpl.map(|word| self.evaluate_word(word).0) {
                    None => {}
                    // RPL rotates about the normal of the plane.
                    Some(_) if self.state.unknown_reason(ModalGroup::Plane.bit()).is_some() => {
                        angles[0] = f64::NAN
                    }
                    Some(Ok(angle)) => angles[self.state.groups.plane().normal] = angle,
                    Some(Err(_)) => angles[0] = f64::NAN,
                }
                let [x, y, z] = [angles[0], angles[1], angles[2]];
                let rotation = Angles::Wpr.rotation([x, y, z]);
                x.is_finite().then(|| Pose::from_parts(Vector3::zeros().into(), rotation))
            }
            // Without values SCALE and MIRROR are cancelled; with values they are not rigid motions.
            _ if !stated => Some(Pose::identity()),
            _ => None,
        }
    }

    /// The programmable frame is set: at joins it is unknown.
    pub(super) fn mark_programmable_frame_set(&mut self) {
        self.set_group_varying(ModalGroup::ProgrammableFrame);
        self.frame_index = None;
    }

    /// G58 and G59 of Siemens: shifts within the work offset; no motion.
    pub(super) fn axial_shift(&mut self, block: &Block<'_>, absolute: bool) {
        let alone = self.state.programmable_frame.is_none()
            && self.state.unknown_reason(ModalGroup::ProgrammableFrame.bit()).is_none()
            && absolute
            && block.abc.iter().all(Option::is_none);
        self.mark_programmable_frame_set();
        self.invalidate_position();
        let mut shift = Vector3::zeros();
        for axis in 0..3 {
            let Some(index) = block.axes[axis] else { continue };
            match self.length_in_mm(self.evaluate_word(&block.words[index]).0) {
                Ok(value) if alone => shift[axis] = value,
                _ => return self.switch_transform(ModalGroup::ProgrammableFrame, true),
            }
        }
        if !alone {
            return self.switch_transform(ModalGroup::ProgrammableFrame, true);
        }
        self.state.programmable_frame = Some(Pose::translation(shift.x, shift.y, shift.z));
    }

    /// `$P_UIFR[1]=CTRANS(X,1,Y,2):CROT(Z,90)` and `$TC_DP3[1,1]=120`.
    pub(super) fn system_variable(&mut self, word: &Word<'_>) {
        let index = |at: usize| -> Option<u32> {
            let (first, end) = word.index?;
            let numbers: Vec<u32> = (first..end)
                .filter(|&token| self.tree.kind(token) == Some(Token::Number))
                .filter_map(|token| std::str::from_utf8(self.tree.text(token)).ok()?.parse().ok())
                .collect();
            numbers.get(at).copied()
        };
        let name = word.name.to_ascii_uppercase();
        let starts = |list: &[&str]| list.iter().any(|begin| name.starts_with(begin.as_bytes()));
        if word.is("$P_UIFR") {
            let frame = match index(0) {
                Some(0) => "G500".to_owned(),
                Some(number @ 1..=4) => format!("G{}", 53 + number),
                Some(number @ 5..=99) => format!("G{}", 500 + number),
                _ => return self.invalidate_offsets(),
            };
            let pose = self.frame_expression(word).filter(|_| self.is_index_alone(word));
            // The active offset keeps its old value until it is selected again.
            self.state.work_offset.pending |= frame == self.state.work_offset.name;
            let set = pose.map(|pose| Frame::from_pose(&pose));
            self.note_replaced_offset(word.first, &frame, set);
            self.assign_offset_value(&frame, set);
        } else if word.is("$P_PFRAME") {
            self.mark_programmable_frame_set();
            self.state.programmable_frame = self.frame_expression(word);
            self.state
                .groups
                .set_value(ModalGroup::ProgrammableFrame, u64::from(self.state.programmable_frame.is_none()));
            self.without_moving(Self::invalidate_pose);
        } else if word.is("$TC_DP3") || word.is("$TC_DP4") || word.is("$TC_DP5") {
            let (Some(number), Some(1)) = (index(0), index(1)) else { return self.invalidate_tools() };
            let tool = format!("T{number}");
            let axis = match word.name[6] {
                b'3' => 2,
                b'4' => 1,
                _ => 0,
            };
            // Under G70 the data of the control stay in its own unit, under G700 they do not.
            let value = self.evaluate_word(word).0.ok().filter(|_| self.counts_in_mm());
            // The lengths that the control holds are unknown: each is NaN until the program sets it.
            let current = match (self.state.tool.assigned.get(&tool), self.tool_value(&tool)) {
                (_, Ok(frame)) | (Some(Some(frame)), _) => Some(frame),
                (None, Err(Reason::ToolUnknown)) => {
                    Some(Frame { position_mm: [f64::NAN; 3], ..Frame::IDENTITY })
                }
                _ => None,
            };
            // The active tool keeps its lengths until it is selected again.
            let may_be_active =
                self.state.unknown_reason(TOOL_GROUPS).is_some() || self.state.tool.name == tool;
            let frame = value.zip(current).filter(|_| !may_be_active).map(|(value, mut frame)| {
                frame.position_mm[axis] = value;
                frame
            });
            // The other lengths may be set next.
            let set = frame.and_then(|frame| {
                let mut one = *self.tools.get(&setup::plain(&tool))?;
                one.position_mm[axis] = frame.position_mm[axis];
                Some(one)
            });
            self.note_replaced(word.first, &tool, set, self.tools.get(&setup::plain(&tool)).copied());
            self.state.tool.assigned.set(&tool, frame);
            self.pass.effects.assigned.tools |= self.is_conditional();
            self.tool_index.clear();
            if may_be_active {
                self.invalidate_position();
            }
        } else if matches!(&*name, b"$TC_DP1" | b"$TC_DP2" | b"$TC_DP6" | b"$TC_DP24" | b"$TC_DP25")
            || starts(&["$A_", "$AC_TIMER", "$AC_MARKER", "$AC_PARAM", "$AC_FIFO", "$TC_MPP", "$TC_TP"])
        {
            // Types and radii of tools, signals, timers: neither frames nor lengths.
        } else if starts(&["$TC_"]) {
            self.invalidate_tools();
        } else if starts(&["$P_"]) {
            self.invalidate_offsets();
        } else {
            self.state.invalidate_all(Reason::UnknownWord);
            self.pass.effects.set_all_varying();
            self.events.push(super::StateEvent::PoseUnknown);
        }
    }

    /// Whether lengths are certainly in mm.
    fn counts_in_mm(&self) -> bool {
        self.state.groups.unit_mm() == 1.0 && self.state.unknown_reason(ModalGroup::Unit.bit()).is_none()
    }

    /// Whether a word has exactly one index: `$P_UIFR[1,X,TR]` sets one component.
    fn is_index_alone(&self, word: &Word<'_>) -> bool {
        word.index.is_some_and(|(first, end)| (first..end).all(|at| self.tree.kind(at) != Some(Token::Comma)))
    }

    /// The program assigns a work offset; `None` if the value is unknown.
    pub(super) fn assign_offset_value(&mut self, name: &str, frame: Option<Frame>) {
        self.state.work_offset.assigned.set(name, frame);
        self.pass.effects.assigned.offsets |= self.is_conditional();
        self.frame_index = None;
    }

    /// A chain of CTRANS and CROT with literal numbers.
    fn frame_expression(&self, word: &Word<'_>) -> Option<Pose> {
        let WordValue::Expression { first, end } = word.value else { return None };
        if !self.counts_in_mm() {
            return None;
        }
        let mut pose = Pose::identity();
        let (mut kind, mut values, mut axis, mut negative) = (None, [0.0; 3], None, false);
        for token in first..end {
            let text = self.tree.text(token);
            match self.tree.kind(token)? {
                Token::Name => {
                    kind = match &*text.to_ascii_uppercase() {
                        b"CTRANS" => Some(false),
                        b"CROT" => Some(true),
                        _ => return None,
                    };
                    values = [0.0; 3];
                }
                Token::Address => {
                    axis = match text[0].to_ascii_uppercase() {
                        letter @ b'X'..=b'Z' => Some(usize::from(letter - b'X')),
                        _ => return None,
                    };
                }
                Token::Minus => negative = !negative,
                Token::Plus | Token::Comma | Token::ParenOpen | Token::Space | Token::Colon => {}
                Token::Number => {
                    let value = super::literal(text)?;
                    values[axis.take()?] = if negative { -value } else { value };
                    negative = false;
                }
                Token::ParenClose => {
                    let [x, y, z] = values;
                    pose *= match kind.take()? {
                        false => Pose::from_parts(Vector3::new(x, y, z).into(), UnitQuaternion::identity()),
                        true => Pose::from_parts(Vector3::zeros().into(), Angles::Wpr.rotation([x, y, z])),
                    };
                }
                _ => return None,
            }
        }
        Some(pose)
    }

    /// A literal or computable number; whole numbers need no decimal point.
    pub(super) fn number(&self, word: &Word<'_>) -> Option<f64> {
        self.literal(word).or_else(|| match word.value {
            WordValue::Expression { first, end } => self.evaluate_tokens((first, end)).ok(),
            _ => None,
        })
    }

    /// G10: L2 P1 X sets a work offset, L20 sets one from the current position, other L set tools and parameters.
    pub(super) fn set_offset(&mut self, block: &Block<'_>) {
        let number = |at: Option<usize>| at.and_then(|index| self.number(&block.words[index]));
        let linux = self.dialect == Dialect::LinuxCnc;
        let p = number(block.p);
        let named = |p: f64| match p as u32 {
            p @ 1..=6 => Some(format!("G{}", 53 + p)),
            p @ 7..=9 if linux => Some(format!("G59.{}", p - 6)),
            _ => None,
        };
        match number(block.l) {
            Some(2.0) => {
                let name = match p {
                    Some(0.0) if linux => self.active_work_offset(),
                    Some(p) => named(p),
                    None => None,
                };
                // The external offset of a Fanuc is added to all work offsets.
                let Some(name) = name else { return self.invalidate_offsets() };
                self.set_offset_values(block, &name);
            }
            Some(20.0) => {
                self.mark_position_used(super::named_axes(block));
                let here = p.filter(|p| linux && *p == 0.0).and_then(|_| self.active_work_offset());
                match p.and_then(named).filter(|_| linux).or(here) {
                    Some(name) => {
                        if block.abc.iter().any(Option::is_some) {
                            self.set_rotary_offset(&name, true);
                        }
                        self.assign_offset(&name, None);
                    }
                    None => self.invalidate_offsets(),
                }
            }
            Some(number @ (1.0 | 3.0 | 10.0 | 11.0 | 12.0 | 13.0 | 14.0)) => {
                if linux && (number == 10.0 || number == 11.0) {
                    // A length that gives the current position these coordinates.
                    self.mark_position_used(super::named_axes(block));
                }
                self.invalidate_tools();
            }
            None if block.p.is_some() && block.l.is_none() => self.invalidate_tools(),
            // Parameters of the control, or unknown.
            _ => self.list_unknown_word(block, "G10", Reason::UnknownWord),
        }
    }

    /// The name of the active work offset, if it is known.
    fn active_work_offset(&self) -> Option<String> {
        self.state
            .unknown_reason(ModalGroup::WorkOffset.bit())
            .is_none()
            .then(|| self.state.work_offset.name.clone())
    }

    fn set_offset_values(&mut self, block: &Block<'_>, name: &str) {
        let known = self.frame_value(name).ok();
        let mut frame = known.unwrap_or(Frame::IDENTITY);
        // Omitted components keep their values. An offset of LinuxCNC, for which an ISO file may be, also has a
        // rotation.
        let has_rotation = matches!(self.dialect, Dialect::LinuxCnc | Dialect::Iso);
        let complete = block.axes.iter().all(Option::is_some) && (block.radius.is_some() || !has_rotation);
        let mut known_value = complete || known.is_some();
        // In G91 LinuxCNC takes the values as absolute, Fanuc and Haas add them; for an ISO file this is unknown.
        let absolute = self.state.groups.absolute() || self.dialect == Dialect::LinuxCnc;
        known_value &= absolute || self.dialect != Dialect::Iso;
        for (axis, word) in block.axes.iter().enumerate() {
            let Some(index) = word else { continue };
            match self.evaluate_word(&block.words[*index]) {
                (Ok(value), _) if absolute => frame.position_mm[axis] = value * self.state.groups.unit_mm(),
                (Ok(value), _) => frame.position_mm[axis] += value * self.state.groups.unit_mm(),
                (Err(_), _) => known_value = false,
            }
        }
        let distance = if self.dialect == Dialect::LinuxCnc { 0 } else { ModalGroup::DistanceMode.bit() };
        known_value &= self.state.unknown_reason(distance | ModalGroup::Unit.bit()).is_none();
        // Offsets of rotary axes change what A, B and C mean, until each is set to 0.
        let zero = |index: usize| self.number(&block.words[index]) == Some(0.0);
        if !block.abc.iter().flatten().all(|&index| zero(index)) {
            self.set_rotary_offset(name, true);
        } else if absolute && block.abc.iter().all(Option::is_some) {
            self.set_rotary_offset(name, false);
        }
        known_value &= !self.state.work_offset.assigned.is_rotary(name);
        match block.radius.map(|index| self.number(&block.words[index])) {
            // A rotation about z (LinuxCNC): it turns X and Y, but not A, B and C, so that no frame describes it.
            Some(Some(0.0)) => frame.quaternion = Frame::IDENTITY.quaternion,
            Some(_) => known_value = false,
            None => {}
        }
        let set = known_value.then_some(frame);
        // What is added to a stated value agrees with it.
        if let Some(first) = block.words.first().filter(|_| absolute) {
            self.note_replaced_offset(first.first, name, set);
        }
        self.without_moving(|this| this.assign_offset(name, set));
    }

    /// Notes a work offset that the program sets otherwise than it is stated.
    fn note_replaced_offset(&mut self, token: u32, name: &str, set: Option<Frame>) {
        let stated = self.frames.get(&setup::plain(name)).copied();
        self.note_replaced(token, name, set, stated);
    }

    /// Notes a frame that the program sets at a token otherwise than it is stated.
    fn note_replaced(&mut self, token: u32, name: &str, set: Option<Frame>, stated: Option<Frame>) {
        let Some((set, stated)) = set.zip(stated) else { return };
        let [a, b] = [set.pose(), stated.pose()];
        let mm = (a.translation.vector - b.translation.vector).norm();
        if mm > SAME_MM || a.rotation.angle_to(&b.rotation) > SAME_RAD {
            let replaced = ReplacedFrame { name: name.to_owned(), set, stated };
            let place = self.place(token);
            self.listing.nc.replaced_frames.insert(place, replaced);
        }
    }

    /// Notes whether a work offset has offsets of rotary axes, which its frame does not hold.
    pub(super) fn set_rotary_offset(&mut self, name: &str, rotary: bool) {
        self.state.work_offset.assigned.set_rotary(name, rotary);
        self.pass.effects.assigned.rotary |= rotary && self.is_conditional();
    }

    /// A work offset gets a value. If it is the active one, the coordinates of the tool position change.
    pub(super) fn assign_offset(&mut self, name: &str, frame: Option<Frame>) {
        let before = self.frame_value(name).ok();
        self.assign_offset_value(name, frame);
        let holds = name.eq_ignore_ascii_case(&self.state.work_offset.name);
        if !holds && self.state.unknown_reason(ModalGroup::WorkOffset.bit()).is_none() {
            return;
        }
        self.invalidate_position();
        let same_rotation = matches!((before, frame), (Some(a), Some(b))
            if a.pose().rotation.angle_to(&b.pose().rotation) < 1e-9);
        if !same_rotation {
            self.invalidate_pose();
        }
    }

    /// The tool of a name, as the program, the setup or a comment states it.
    pub(super) fn tool_value(&self, name: &str) -> Result<Frame, Reason> {
        match self.state.tool.assigned.get(name) {
            // One of its lengths has not been set yet.
            Some(Some(frame)) if frame.position_mm.iter().any(|mm| mm.is_nan()) => Err(Reason::ToolUnknown),
            Some(Some(frame)) => Ok(frame),
            Some(None) => Err(self.state.tool.assigned.reason()),
            None => self.tools.get(&setup::plain(name)).copied().ok_or_else(|| unknown_tool(name)),
        }
    }

    /// The work offset of a name, as the program, the setup or a comment states it.
    pub(super) fn frame_value(&self, name: &str) -> Result<Frame, Reason> {
        match self.state.work_offset.assigned.get(name) {
            Some(Some(frame)) => Ok(frame),
            Some(None) => Err(self.state.work_offset.assigned.reason()),
            // Without a settable offset Siemens uses the basic frame.
            None => self
                .frames
                .get(&setup::plain(name))
                .copied()
                .or_else(|| (name == "G500").then_some(Frame::IDENTITY))
                .ok_or(Reason::WorkObjectUnknown),
        }
    }

    /// The active tool.
    pub(super) fn tool(&mut self) -> u32 {
        let name = self.state.tool.frame_name(self.dialect);
        if let Some(&index) = self.tool_index.get(&name) {
            return index;
        }
        let tool = Tool {
            name: name.clone(),
            value: self.tool_value(&name).and_then(Frame::within_reach).map(flange_tool),
            place: None,
            assigned: false,
        };
        let index = intern(&mut self.listing.tools, tool);
        self.tool_index.insert(name, index);
        index
    }

    /// The active work frame.
    pub(super) fn work_object(&mut self) -> u32 {
        if let Some((name, pose, index)) = &self.frame_index
            && *name == self.state.work_offset.name
            && *pose == self.state.programmable_frame
        {
            return *index;
        }
        let name = self.state.work_offset.name.clone();
        let stated =
            if self.state.work_offset.pending { Err(Reason::Assigned) } else { self.frame_value(&name) };
        let within = self.state.programmable_frame.as_ref().map_or(Frame::IDENTITY, Frame::from_pose);
        let near = stated.and_then(Frame::within_reach).and_then(|user| Ok((user, within.within_reach()?)));
        let value = near.map(|(user_frame, within)| WorkObjectValue {
            robhold: false,
            fixed: true,
            mechanical_unit: String::new(),
            user_frame,
            object_frame: within,
        });
        let displacement = self.state.programmable_frame.as_ref().map(Frame::from_pose);
        let work_object =
            WorkObject { name: name.clone(), value, place: None, assigned: false, displacement };
        let index = intern(&mut self.listing.work_objects, work_object);
        self.frame_index = Some((name, self.state.programmable_frame, index));
        index
    }
}

/// Why a tool of which nothing is stated is unknown: one that is called with an allowance (`T1 DL+0.5`) is another one than without.
fn unknown_tool(name: &str) -> Reason {
    if name.contains(" DL") { Reason::LengthAllowance } else { Reason::ToolUnknown }
}
