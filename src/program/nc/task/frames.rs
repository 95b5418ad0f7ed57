//! Work offsets, frames within them, tools: what sets them, and each distinct one once in the listing.

use nalgebra::{UnitQuaternion, Vector3};

use super::super::dialect::Dialect;
use super::super::machine::{Group, transforms};
use super::super::orientation::Angles;
use super::super::setup::held;
use super::super::syntax::{Belongs, Word};
use super::super::token::Token;
use super::{Lister, Said};
use crate::math::se3::Pose;
use crate::program::motion::{Frame, Reason, Tool, WorkObject, WorkObjectValue};

impl Lister<'_, '_> {
    /// TRANS, ROT and those that add to them. True where the block is one.
    pub(super) fn programmable_frame(&mut self, said: &Said<'_>) -> bool {
        let Some(word) = said.words.iter().find(|word| {
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
        self.set(Group::Frame);
        self.state.lose_position();
        self.events.push(super::Event::Lost(super::POSITION));
        if !adds {
            // Whatever is not added replaces all.
            self.state.programmable = None;
            self.state.transform &= !transforms::PROGRAMMABLE;
        }
        let values: Result<Vec<Option<f64>>, Reason> = said
            .axes
            .iter()
            .map(|word| word.map(|index| self.worth(&said.words[index]).0).transpose())
            .collect();
        let rpl = said.words.iter().find(|word| word.is("RPL"));
        let stated = said.moves() || rpl.is_some();
        let pose = match (&*name, values) {
            (_, Err(_)) => None,
            // Rotary axes are shifted too.
            _ if said.abc.iter().any(Option::is_some) => None,
            (b"TRANS" | b"ATRANS", Ok(shift)) => {
                let unit = self.state.unit_mm;
                let shift = Vector3::from_iterator(shift.iter().map(|value| value.unwrap_or(0.0) * unit));
                Some(Pose::from_parts(shift.into(), UnitQuaternion::identity()))
            }
            (b"ROT" | b"AROT", Ok(angles)) => {
                let mut angles: Vec<f64> = angles.iter().map(|value| value.unwrap_or(0.0)).collect();
                match rpl.map(|word| self.worth(word).0) {
                    None => {}
                    Some(Ok(turn)) => angles[self.state.plane.across] = turn,
                    Some(Err(_)) => angles[0] = f64::NAN,
                }
                let [x, y, z] = [angles[0], angles[1], angles[2]];
                let turn = Angles::Wpr.rotation([x, y, z]);
                x.is_finite().then(|| Pose::from_parts(Vector3::zeros().into(), turn))
            }
            // Scaling and mirroring without values end; with values they are no rigid motion.
            _ if !stated => return true,
            _ => None,
        };
        match pose {
            Some(_) if !stated => {}
            Some(pose) => {
                self.state.programmable = Some(self.state.programmable.unwrap_or_else(Pose::identity) * pose);
            }
            None => {
                self.state.transform |= transforms::PROGRAMMABLE;
                self.set(Group::Transform);
            }
        }
        true
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
        if word.is("$P_UIFR") {
            let name = match index(0) {
                Some(number @ 1..=4) => format!("G{}", 53 + number),
                Some(number @ 5..=99) => format!("G{}", 500 + number),
                _ => return,
            };
            let pose = self.frame_expression(word);
            self.frame_set(name, pose.map(|pose| Frame::from_pose(&pose)));
        } else if word.is("$P_PFRAME") {
            self.state.programmable = self.frame_expression(word);
            let known = self.state.programmable.is_some();
            self.set(Group::Frame);
            self.transform(transforms::PROGRAMMABLE, !known);
        } else if word.name.len() > 3
            && word.name[..3].eq_ignore_ascii_case(b"$P_")
            && word.name.to_ascii_uppercase().windows(2).any(|two| two == b"FR" || two == b"BA")
        {
            // Base, channel, system and total frames.
            self.transform(transforms::SYSTEM, true);
        } else if word.is("$TC_DP3") || word.is("$TC_DP4") || word.is("$TC_DP5") {
            let (Some(number), Some(1)) = (index(0), index(1)) else { return };
            let Ok(value) = self.worth(word).0 else { return };
            let name = format!("T{number}");
            let axis = match word.name[6] {
                b'3' => 2,
                b'4' => 1,
                _ => 0,
            };
            let known = self.frames_of_tools(&name);
            let mut frame = known.unwrap_or(Frame::IDENTITY);
            frame.position_mm[axis] = value * self.state.unit_mm;
            self.tool_set(name, Some(frame));
        }
    }

    /// The program sets a work offset.
    fn frame_set(&mut self, name: String, frame: Option<Frame>) {
        if name == self.state.frame {
            // Where the tool stands has other coordinates now.
            self.state.lose_position();
            self.events.push(super::Event::Lost(super::POSITION));
        }
        self.set_frames.retain(|(other, _)| *other != name);
        self.set_frames.push((name, frame));
        self.frame_index = None;
    }

    /// The program sets a tool.
    fn tool_set(&mut self, name: String, frame: Option<Frame>) {
        self.set_tools.retain(|(other, _)| *other != name);
        self.set_tools.push((name, frame));
        self.tool_index.clear();
    }

    /// The program sets work offsets, which ones the text does not tell.
    pub(super) fn some_frames_set(&mut self) {
        self.sets_frames = true;
        self.frame_index = None;
        self.state.lose_position();
        self.events.push(super::Event::Lost(super::POSITION));
    }

    /// The program sets tools, which ones the text does not tell.
    pub(super) fn some_tools_set(&mut self) {
        self.sets_tools = true;
        self.tool_index.clear();
    }

    fn frames_of_tools(&self, name: &str) -> Option<Frame> {
        if let Some((_, frame)) = self.set_tools.iter().find(|(other, _)| other == name) {
            return *frame;
        }
        self.tools.iter().find(|(other, _)| other == name).map(|(_, frame)| *frame)
    }

    /// A chain of CTRANS and CROT with plain numbers.
    fn frame_expression(&self, word: &Word<'_>) -> Option<Pose> {
        let Belongs::Expression { first, end } = word.belongs else { return None };
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
                        false => Pose::from_parts(
                            (Vector3::new(x, y, z) * self.state.unit_mm).into(),
                            UnitQuaternion::identity(),
                        ),
                        true => Pose::from_parts(Vector3::zeros().into(), Angles::Wpr.rotation([x, y, z])),
                    };
                }
                _ => return None,
            }
        }
        Some(pose)
    }

    /// G10 L2 P1 X… of Fanuc and LinuxCNC.
    pub(super) fn set_offset(&mut self, said: &Said<'_>) {
        let number = |at: Option<usize>| at.and_then(|index| self.literal(&said.words[index]));
        let fanuc = matches!(self.dialect, Dialect::Fanuc | Dialect::Iso);
        let (l, p) = match (number(said.l), number(said.p)) {
            (Some(l @ (2.0 | 20.0)), Some(p)) => (l, p),
            (Some(1.0 | 10.0..=13.0), _) => return self.some_tools_set(),
            (None, Some(_)) if said.l.is_none() && fanuc => return self.some_tools_set(),
            (None, _) if said.l.is_none() => return,
            _ => return self.some_frames_set(),
        };
        let name = match p as u32 {
            // An offset of all offsets.
            0 if fanuc => return self.some_frames_set(),
            0 => self.state.frame.clone(),
            p if l == 20.0 && self.dialect == Dialect::Fanuc => format!("G54.1 P{p}"),
            p @ 1..=6 => format!("G{}", 53 + p),
            p @ 7..=9 => format!("G59.{}", p - 6),
            _ => return,
        };
        if l == 20.0 || said.abc.iter().any(Option::is_some) {
            // So that the tool stands at these values; with turned rotary axes.
            return self.frame_set(name, None);
        }
        let known = match self.set_frames.iter().find(|(other, _)| *other == name) {
            Some((_, frame)) => *frame,
            None => self
                .setup
                .frame(&name)
                .or_else(|| self.frames.iter().find(|(other, _)| *other == name).map(|(_, frame)| *frame)),
        };
        let mut frame = known.unwrap_or(Frame::IDENTITY);
        let mut good = said.axes.iter().all(Option::is_some) || known.is_some();
        for (axis, word) in said.axes.iter().enumerate() {
            let Some(index) = word else { continue };
            match self.worth(&said.words[*index]) {
                (Ok(value), _) if self.state.absolute => frame.position_mm[axis] = value * self.state.unit_mm,
                (Ok(value), _) => frame.position_mm[axis] += value * self.state.unit_mm,
                (Err(_), _) => good = false,
            }
        }
        match number(said.radius) {
            // The turn of the work frame about z (LinuxCNC).
            Some(turn) => {
                let turn = UnitQuaternion::from_axis_angle(&Vector3::z_axis(), turn.to_radians());
                frame.quaternion = [turn.w, turn.i, turn.j, turn.k];
            }
            None if said.radius.is_some() => good = false,
            None => {}
        }
        self.frame_set(name, good.then_some(frame));
    }

    /// The tool that is in.
    pub(super) fn tool(&mut self) -> u32 {
        if let Some(&index) = self.tool_index.get(&self.state.tool) {
            return index;
        }
        let name = self.state.tool.clone();
        let value = match self.set_tools.iter().find(|(other, _)| other.eq_ignore_ascii_case(&name)) {
            Some((_, frame)) => frame.ok_or(Reason::ToolAssigned),
            None if self.sets_tools => Err(Reason::ToolAssigned),
            None => {
                let stated = self.setup.tool(&name).or_else(|| {
                    let mut tools = self.tools.iter().rev();
                    tools.find(|(other, _)| other.eq_ignore_ascii_case(&name)).map(|(_, frame)| *frame)
                });
                stated.ok_or(Reason::ToolUnknown)
            }
        };
        let tool = Tool { name: name.clone(), value: value.map(held), place: None };
        let index = intern(&mut self.listing.tools, tool);
        self.tool_index.insert(name, index);
        index
    }

    /// The work frame that holds.
    pub(super) fn work_object(&mut self) -> u32 {
        if let Some((name, pose, index)) = &self.frame_index
            && *name == self.state.frame
            && *pose == self.state.programmable
        {
            return *index;
        }
        let name = self.state.frame.clone();
        let stated = match self.set_frames.iter().find(|(other, _)| other.eq_ignore_ascii_case(&name)) {
            Some((_, frame)) => frame.ok_or(Reason::WorkObjectAssigned),
            None if self.sets_frames => Err(Reason::WorkObjectAssigned),
            None => {
                let stated = self.setup.frame(&name).or_else(|| {
                    let mut frames = self.frames.iter().rev();
                    frames.find(|(other, _)| other.eq_ignore_ascii_case(&name)).map(|(_, frame)| *frame)
                });
                // Without a settable offset Siemens counts from the base.
                let base = (name == "G500").then_some(Frame::IDENTITY);
                stated.or(base).ok_or(Reason::WorkObjectUnknown)
            }
        };
        let within = self.state.programmable.as_ref().map_or(Frame::IDENTITY, Frame::from_pose);
        let value = stated.map(|user_frame| WorkObjectValue {
            robhold: false,
            fixed: true,
            mechanical_unit: String::new(),
            user_frame,
            object_frame: within,
        });
        let displacement = self.state.programmable.as_ref().map(Frame::from_pose);
        let work_object = WorkObject { name: name.clone(), value, place: None, displacement };
        let index = intern(&mut self.listing.work_objects, work_object);
        self.frame_index = Some((name, self.state.programmable, index));
        index
    }
}

/// The index of an equal item, else of the new one.
fn intern<T: PartialEq>(list: &mut Vec<T>, item: T) -> u32 {
    match list.iter().rev().take(256).position(|other| *other == item) {
        Some(back) => (list.len() - 1 - back) as u32,
        None => {
            list.push(item);
            list.len() as u32 - 1
        }
    }
}
