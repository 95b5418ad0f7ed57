//! Heidenhain conversational blocks, which are not built of address words.

use super::super::dialect::Dialect;
use super::super::expression::{Evaluated, literal, numbered};
use super::super::modal_group::ModalGroup;
use super::super::modal_state::MotionMode;
use super::super::syntax::{Word, WordValue};
use super::super::token::Token;
use super::arrivals::{Site, label};
use super::block::Flags;
use super::{Block, FlowPoint, Interpreter, StartDependency};
use crate::motion::Reason;
use truegrind_math::se3::Pose;

impl<'s> Interpreter<'_, 's> {
    /// Interprets a block by its first word. True if the block does nothing else.
    pub(super) fn heidenhain(&mut self, block: &Block<'s>) -> bool {
        debug_assert_eq!(self.dialect, Dialect::Heidenhain);
        let Some(first) = block.words.first() else { return false };
        let name = first.name.to_ascii_uppercase();
        match &*name {
            b"L" | b"LN" => {
                self.state.mode = MotionMode::Linear;
                false
            }
            // Positioning blocks without L.
            [b'X' | b'Y' | b'Z' | b'A' | b'B' | b'U' | b'V' | b'W']
            | [b'I', b'X' | b'Y' | b'Z' | b'A' | b'B' | b'C' | b'U' | b'V' | b'W'] => {
                self.state.mode = MotionMode::Linear;
                false
            }
            b"C" if first.value != WordValue::Absent => {
                self.state.mode = MotionMode::Linear;
                false
            }
            b"F" | b"R" => false,
            b"C" | b"CR" => {
                let direction = block.words.iter().find(|word| word.is("DR"));
                let negative = direction.is_some_and(|word| {
                    (word.first..word.end).any(|token| self.tree.kind(token) == Some(Token::Minus))
                });
                self.state.mode = match direction {
                    Some(_) => MotionMode::Circular(!negative),
                    None => MotionMode::Unsupported(Reason::UnsupportedPath),
                };
                self.state.starts_tangent = false;
                false
            }
            b"CT" => {
                self.state.mode = MotionMode::Unsupported(Reason::UnsupportedPath);
                self.state.starts_tangent = true;
                false
            }
            b"CC" => {
                let whole =
                    |axis: usize| block.axes[axis].is_some_and(|index| block.words[index].name.len() == 1);
                if block.axes.iter().all(Option::is_none)
                    || !(0..2).all(|axis| whole(axis) || block.axes[axis].is_none())
                {
                    // The pole is at, or relative to, the tool position.
                    self.mark_position_used(super::POSITION);
                }
                for axis in 0..2 {
                    self.state.pole[axis] = match block.axes[axis] {
                        None => self.state.position[axis],
                        Some(index) => {
                            let (value, increment) = self.evaluate_word(&block.words[index]);
                            if increment == Some(true) {
                                self.state.position[axis].and_then(|at| value.map(|value| at + value))
                            } else {
                                value
                            }
                        }
                    };
                }
                true
            }
            b"M" => {
                // Axis words are values of the M word.
                if self.only_m_words(block) {
                    self.calls_cycle(block);
                }
                self.end_of_block(block);
                true
            }
            _ => {
                self.other_block(block, first, &name);
                true
            }
        }
    }

    /// The M words of a block without a motion of its own. False where one of them moves or is unknown.
    fn only_m_words(&mut self, block: &Block<'_>) -> bool {
        if let Some((word, reason)) = self.unknown_m_word(block) {
            self.list_unknown_word(block, &word, reason);
            return false;
        }
        self.m_words(block);
        !self.m_motion(block)
    }

    /// The M words in the text of a block.
    fn m_words_of_text(&mut self, block: &Block<'_>, words: &[&[u8]]) {
        let number = |word: &&[u8]| std::str::from_utf8(word.strip_prefix(b"M")?).ok()?.parse().ok();
        let m: Vec<u32> = words.iter().filter_map(number).collect();
        if !m.is_empty() {
            let flags = Flags { skippable: block.flags.skippable, ..Flags::default() };
            let of_text = Block { node: block.node, m, flags, ..Block::default() };
            self.only_m_words(&of_text);
            self.end_of_block(&of_text);
        }
    }

    /// Blocks that are read as text and not word by word.
    fn other_block(&mut self, block: &Block<'_>, first: &Word<'_>, name: &[u8]) {
        let text = self.tree.source()[self.tree.range(first.first, first.end)].to_ascii_uppercase();
        let words: Vec<&[u8]> =
            text.split(|byte| byte.is_ascii_whitespace()).filter(|part| !part.is_empty()).collect();
        let second = words.get(1).copied().unwrap_or_default();
        if name == b"STOP" || name == b"CYCL" && second == b"CALL" {
            self.m_words_of_text(block, &words);
        }
        match name {
            b"TOOL" if self.tool_block(&text, &words) => {}
            b"PLANE" | b"FUNCTION" | b"TRANS" if self.transformation_block(block, name, &words) => {}
            b"CYCL" => self.cycle_block(block, first, &words),
            b"FN" | b"Q" | b"QL" | b"QR" => self.function_block(block, first, &text, &words),
            b"LBL" if second != b"0" => {
                let name = label(second);
                self.arrive(Site::Label(name.clone()));
                self.pass.labels.push(name.clone());
                self.flow(FlowPoint::Label(name));
                self.state.mode = MotionMode::Unknown(Reason::UnknownFlow);
            }
            b"LBL" => {
                let labels = std::mem::take(&mut self.pass.labels);
                self.returns_from(labels);
                self.branch_by(FlowPoint::Return);
            }
            b"CALL" | b"SEL" if second == b"LBL" || second == b"PGM" || name == b"CALL" => {
                self.subprogram(block, "CALL");
            }
            b"TCH" => {
                self.list_left(block, "TCH PROBE", Reason::Probe);
                let number = words.get(2).copied().unwrap_or_default();
                if measures_only(number) {
                    self.invalidate_position();
                } else {
                    self.invalidate_by_probing();
                }
            }
            b"BEGIN" | b"END" => {
                if words.contains(&&b"INCH"[..]) {
                    self.state.groups.set_value(ModalGroup::Unit, 200);
                }
            }
            // Blanks, stops, strings, tables, declarations: no motion.
            b"BLK" | b"STOP" | b"QS" | b"DECLARE" | b"OPEN" | b"CLOSE" | b"SECTION" | b"SEL" | b"TABDATA"
            | b"PATTERN" | b"POS" => {}
            // Continuation lines of a cycle definition.
            _ if !first.name.first().is_some_and(u8::is_ascii_alphabetic) => {}
            _ if self.path_block(block, name) => {}
            _ => self.list_unknown_word(block, &String::from_utf8_lossy(name), Reason::UnknownWord),
        }
    }

    /// `TOOL CALL` and `TOOL DEF`. True if the block is one of them.
    fn tool_block(&mut self, text: &[u8], words: &[&[u8]]) -> bool {
        match words.get(1).copied() {
            Some(b"CALL") => self.tool_call(text),
            // A length that the program states.
            Some(b"DEF") if words.iter().skip(3).any(|word| word.starts_with(b"L")) => {
                self.invalidate_tools()
            }
            Some(b"DEF") => {}
            _ => return false,
        }
        true
    }

    /// `CYCL CALL` and `CYCL DEF`.
    fn cycle_block(&mut self, block: &Block<'_>, first: &Word<'_>, words: &[&[u8]]) {
        if words.get(1) == Some(&&b"CALL"[..]) {
            return self.cycle_call(block, "CYCL CALL");
        }
        let number: Vec<u8> = words
            .get(2)
            .map(|word| word.iter().copied().take_while(u8::is_ascii_digit).collect())
            .unwrap_or_default();
        self.cycle_definition(block, first, &number, words.get(2..).unwrap_or_default());
    }

    /// `PLANE`, `FUNCTION TCPM`, `TRANS`: frames, and functions that affect none of them. True if the block is one of
    /// them.
    fn transformation_block(&mut self, block: &Block<'_>, name: &[u8], words: &[&[u8]]) -> bool {
        let second = words.get(1).copied().unwrap_or_default();
        let third = words.get(2).copied();
        let on = third != Some(b"RESET");
        match (name, second) {
            (b"PLANE", _) => {
                // TURN moves the rotary axes to the plane, MOVE the linear ones too.
                let moves = words.iter().any(|word| matches!(*word, b"TURN" | b"MOVE"));
                if moves {
                    self.list_left(block, "PLANE", Reason::TiltsTool);
                }
                self.switch_transform(ModalGroup::TiltedPlane, second != b"RESET");
                if moves {
                    self.invalidate_pose();
                }
            }
            (b"FUNCTION", b"TCPM") => self.function_tcpm(words),
            (b"FUNCTION", _) if words.contains(&&b"TCPM"[..]) => {
                self.set_tcp_mode(false, false);
                self.set_reference_point(true);
            }
            // The default mode of a mill. The name of a kinematic model may follow, whose effect is unknown.
            (b"FUNCTION", b"MODE") => return words[2..] == [b"MILL"],
            (b"FUNCTION", b"FEED" | b"S-PULSE" | b"DWELL" | b"FILE" | b"COUNT") => {}
            (b"TRANS", b"DATUM") => self.without_moving(|this| {
                let before = this.known_datum_shift();
                match third {
                    Some(b"RESET") => {
                        this.set_datum_shift([Some(0.0); 3]);
                        this.switch_transform(ModalGroup::RotaryOffset, false);
                    }
                    Some(b"AXIS") => this.datum_shift(&words[3..]),
                    _ => this.set_datum_shift([None; 3]),
                }
                this.displace_datum(before);
            }),
            (b"TRANS", b"MIRROR") => self.switch_transform(ModalGroup::Mirror, on),
            (b"TRANS", b"ROTATION") => self.switch_transform(ModalGroup::Rotation, on),
            (b"TRANS", b"SCALE") => self.switch_transform(ModalGroup::Scaling, on),
            _ => return false,
        }
        true
    }

    /// `FUNCTION TCPM F TCP AXIS SPAT PATHCTRL AXIS REFPNT TIP-CENTER`. Without REFPNT the reference is the tip.
    fn function_tcpm(&mut self, words: &[&[u8]]) {
        let mut stated = words.iter().skip_while(|word| **word != b"REFPNT").skip(1);
        let is_tip = stated.next().is_none_or(|point| *point == b"TIP-TIP");
        self.set_tcp_mode(true, false);
        self.set_reference_point(is_tip);
    }

    /// Where the programmed point becomes another one of the tool, its coordinates change.
    fn set_reference_point(&mut self, is_tip: bool) {
        let group = ModalGroup::ReferencePoint;
        if is_tip == self.state.groups.is_on(group) || self.state.unknown_reason(group.bit()).is_some() {
            self.invalidate_position();
        }
        self.set_group(group, u64::from(!is_tip));
    }

    /// Blocks with unsupported paths. True if the block is one of them.
    fn path_block(&mut self, block: &Block<'_>, name: &[u8]) -> bool {
        if matches!(name, b"RND" | b"CHF") {
            self.round_corner(block, name);
            return true;
        }
        let dependency = match name {
            b"FPOL" => StartDependency::Independent,
            b"CP" | b"LP" | b"FC" | b"FL" | b"SPL" => StartDependency::Position,
            b"APPR" | b"DEP" | b"CTP" | b"FLT" | b"FCT" => StartDependency::Tangent,
            _ => return false,
        };
        self.list_left_path(block, &String::from_utf8_lossy(name), dependency);
        self.invalidate_position();
        true
    }

    /// RND and CHF round or chamfer the corner between their neighbours; the next block is relative to the corner.
    fn round_corner(&mut self, block: &Block<'_>, name: &[u8]) {
        let preceding = self.state.preceding.clone();
        self.list_left(block, &String::from_utf8_lossy(name), Reason::RoundedCorner);
        for index in preceding.each() {
            let index = index as usize;
            // A motion that a jump leads back from is not listed yet.
            if let (Some(motion), Some(context)) =
                (self.listing.motions.get_mut(index), self.contexts.get_mut(index))
            {
                motion.own_reason = motion.own_reason.or(Some(Reason::RoundedCorner));
                context.start_dependency = context.start_dependency.max(StartDependency::Position);
            }
        }
        self.state.preceding = preceding;
        self.state.corners.before = true;
    }

    /// `FN 0: Q1 = +5`, `Q1 = +5`.
    fn function_block(&mut self, block: &Block<'_>, first: &Word<'_>, text: &[u8], words: &[&[u8]]) {
        // FN 25 sets a datum, FN 17 any data of the control.
        match number_of_function(text) {
            Some(17) => return self.list_unknown_word(block, "FN 17", Reason::UnknownWord),
            Some(25) => {
                self.mark_position_used(super::EVERYWHERE);
                return self.invalidate_offsets();
            }
            Some(18) if text.windows(3).any(|id| id == b"270" || id == b"240") => {
                self.events.push(super::StateEvent::PositionUsed { axes: super::EVERYWHERE, read: true });
            }
            _ => {}
        }
        // FN 9 to FN 12 jump: later settings may be bypassed.
        if words.contains(&&b"GOTO"[..]) {
            self.branch();
            self.jump_to_label(words);
        }
        self.parameter(first);
    }

    /// `TOOL CALL 1 Z S1000 DL+0.5`, `TOOL CALL "MILL" Z`, `TOOL CALL Z S500`.
    fn tool_call(&mut self, text: &[u8]) {
        let text = String::from_utf8_lossy(text);
        let rest = text.split_once("CALL").map_or("", |(_, rest)| rest).trim();
        let (tool, after) = match rest.strip_prefix('"') {
            Some(quoted) => {
                let (name, after) = quoted.split_once('"').unwrap_or((quoted, ""));
                (Some(name.to_owned()), after)
            }
            None => {
                let (word, after) = rest.split_once(char::is_whitespace).unwrap_or((rest, ""));
                match word.bytes().next() {
                    Some(b'0'..=b'9') => {
                        let whole = word.bytes().all(|byte| byte.is_ascii_digit());
                        let number = word.trim_start_matches('0');
                        let zero = if number.is_empty() { "0" } else { number };
                        (Some(if whole { format!("T{zero}") } else { format!("T{word}") }), after)
                    }
                    // Only speed or axis: the tool is unchanged.
                    Some(b'X' | b'Y' | b'Z' | b'S' | b'F' | b'D') => (None, rest),
                    None => (Some(self.state.tool.name.clone()), rest),
                    _ => (Some(format!("T {word}")), after),
                }
            }
        };
        // The working plane is perpendicular to the tool axis.
        match after.split_whitespace().next() {
            Some("X") => self.set_group(ModalGroup::Plane, 190),
            Some("Y") => self.set_group(ModalGroup::Plane, 180),
            Some("Z") => self.set_group(ModalGroup::Plane, 170),
            _ => {}
        }
        // A length allowance that is added to the tool table.
        let longer = |word: &&str| {
            let delta = word.strip_prefix("DL").map(|delta| delta.trim_start_matches(['+', '-']));
            delta.is_some_and(|delta| literal(delta.as_bytes()) != Some(0.0))
        };
        let longer: String = after.split_whitespace().filter(longer).map(|word| format!(" {word}")).collect();
        match tool {
            Some(tool) => {
                self.change_tool(tool + &longer);
                self.invalidate_pose();
            }
            // The active tool may be unknown.
            None if !longer.is_empty() => self.change_tool(format!("T?{longer}")),
            None => {}
        }
    }

    /// `CYCL DEF 8.1 X`: the cycle number, and the words after it.
    fn cycle_definition(&mut self, block: &Block<'_>, first: &Word<'_>, number: &[u8], words: &[&[u8]]) {
        let title = words.first().is_some_and(|word| word.ends_with(b".0"));
        let values = words.get(1..).unwrap_or_default();
        let zero = |word: &&[u8], letters: usize| {
            let digits = word.get(letters..).unwrap_or_default();
            let digits = digits.strip_prefix(b"+").or(digits.strip_prefix(b"-")).unwrap_or(digits);
            literal(digits)
        };
        match number {
            b"7" => {
                self.without_moving(|this| {
                    let before = this.known_datum_shift();
                    this.datum_shift(values);
                    this.displace_datum(before);
                });
            }
            // The title starts the definition; the lines after it hold the values.
            b"8" => self.switch_transform(ModalGroup::Mirror, title || !values.is_empty()),
            b"10" => {
                let ends = values.len() == 1
                    && values.iter().all(|word| word.starts_with(b"ROT") && zero(word, 3) == Some(0.0));
                self.switch_transform(ModalGroup::Rotation, title || !ends);
            }
            b"11" => {
                let value = match values {
                    [word] => zero(word, 3),
                    [_, word] => zero(word, 0),
                    _ => None,
                };
                self.switch_transform(ModalGroup::Scaling, title || value != Some(1.0));
            }
            b"19" => {
                let ends = values.iter().all(|word| zero(word, 1) == Some(0.0));
                self.switch_transform(ModalGroup::TiltedPlane, title || !ends);
            }
            b"26" => {
                let ends = !values.is_empty() && values.iter().all(|word| zero(word, 1) == Some(1.0));
                self.switch_transform(ModalGroup::AxisScaling, title || !ends);
            }
            b"247" => {
                let preset = self.preset(first);
                self.without_moving(|this| {
                    this.select_work_offset(preset);
                    this.invalidate_datum_shift();
                });
            }
            b"220" | b"221" => {
                self.list_left(block, "CYCL DEF", Reason::Cycle);
                self.invalidate_pose();
            }
            // A program replaces the cycle.
            b"12" => self.cycle_is_program = true,
            // Definitions that CYCL CALL, M89 and M99 execute, and settings.
            [b'2', b'0', b'0'..=b'9'] | [b'2', b'3'..=b'7', b'0'..=b'9'] => {}
            _ if DEFINITIONS.contains(&number) => {}
            _ => self.list_unknown_word(block, "CYCL DEF", Reason::UnknownWord),
        }
    }

    /// A preset cancels the datum shift on some controls, and not on others.
    fn invalidate_datum_shift(&mut self) {
        if self.state.datum_shift != [Some(0.0); 3] {
            self.state.programmable_frame = None;
            self.frame_index = None;
            self.state.datum_shift = [None; 3];
            self.invalidate_group(ModalGroup::DatumShift, Reason::Displacement);
        }
    }

    /// `CYCL DEF 7.1 X+10` and `TRANS DATUM AXIS X+10 Y-5`: a shift within the preset. The definition may span
    /// several lines, so omitted axes keep their shift, known or not. Rows of the datum table are unknown.
    fn datum_shift(&mut self, words: &[&[u8]]) {
        if words.first().is_none_or(|word| word.len() > 3 && word.iter().all(u8::is_ascii_alphabetic)) {
            // The title; the lines after it hold the values.
            return;
        }
        let doubts = ModalGroup::DatumShift.bit() | ModalGroup::ProgrammableFrame.bit();
        let mut shift = match self.state.unknown_reason(doubts) {
            Some(_) => [None; 3],
            None => self.state.datum_shift,
        };
        for word in words {
            let (name, increment) = match word {
                [b'I', axis @ b'A'..=b'Z', ..] => (*axis, true),
                [axis @ b'A'..=b'Z', ..] => (*axis, false),
                _ => {
                    shift = [None; 3];
                    break;
                }
            };
            let value = match &word[1 + usize::from(increment)..] {
                [b'-', digits @ ..] => literal(digits).map(|value| -value),
                [b'+', digits @ ..] | digits => literal(digits),
            };
            let value = value.map(|value| value * self.state.groups.unit_mm());
            match name {
                b'X'..=b'Z' => {
                    let entry = &mut shift[usize::from(name - b'X')];
                    let old = if increment { *entry } else { Some(0.0) };
                    *entry = old.zip(value).map(|(old, value)| old + value);
                }
                // A, B and C have an offset until the whole shift ends.
                b'A'..=b'C' if value != Some(0.0) => self.switch_transform(ModalGroup::RotaryOffset, true),
                b'A'..=b'C' | b'U'..=b'W' => {}
                _ => {
                    shift = [None; 3];
                    break;
                }
            }
        }
        self.set_datum_shift(shift);
    }

    /// The frame of the datum shift, if all of it is known.
    fn known_datum_shift(&self) -> Option<Option<Pose>> {
        let groups = [ModalGroup::DatumShift, ModalGroup::RotaryOffset, ModalGroup::ProgrammableFrame];
        let known = |group: &ModalGroup| self.state.unknown_reason(group.bit()).is_none();
        let rigid = groups[..2].iter().all(|group| !self.state.groups.is_on(*group));
        (rigid && groups.iter().all(known)).then_some(self.state.programmable_frame)
    }

    /// Follows a datum shift that was `before`: the arm stands where it stood.
    fn displace_datum(&mut self, before: Option<Option<Pose>>) {
        let before = before.filter(|_| self.known_datum_shift().is_some());
        self.displace_frame(before);
    }

    /// Sets the datum shift, as far as it is known.
    fn set_datum_shift(&mut self, shift: [Option<f64>; 3]) {
        self.mark_programmable_frame_set();
        self.state.datum_shift = shift;
        self.state.programmable_frame = match shift {
            [Some(x), Some(y), Some(z)] if shift != [Some(0.0); 3] => Some(Pose::translation(x, y, z)),
            _ => None,
        };
        self.switch_transform(ModalGroup::DatumShift, shift.iter().any(Option::is_none));
    }

    /// The name of the preset in `CYCL DEF 247 … Q339=n`: `PRESET1`; the number may be in the next line.
    fn preset(&self, first: &Word<'_>) -> String {
        const NEAR: usize = 200;
        let start = self.tree.start(first.first);
        let source = &self.tree.source()[start..];
        let text = source[..source.len().min(NEAR)].to_ascii_uppercase();
        let at = text.windows(5).position(|five| five == b"Q339=").map(|at| at + 5);
        let digits: String = at
            .into_iter()
            .flat_map(|at| &text[at..])
            .map(|&byte| char::from(byte))
            .skip_while(|c| matches!(c, ' ' | '+'))
            .take_while(char::is_ascii_digit)
            .collect();
        format!("PRESET{digits}")
    }

    /// `Q1 = +5`, `FN 0: Q1 = +5`.
    fn parameter(&mut self, word: &Word<'_>) {
        let equal = (word.first..word.end).find(|&token| self.tree.kind(token) == Some(Token::Equal));
        let Some(equal) = equal else { return };
        let at = (word.first..equal).rev().find(|&token| self.tree.kind(token) == Some(Token::Number));
        let number = at.and_then(|token| literal(self.tree.text(token)));
        let (Some(at), Some(number)) = (at, number) else { return };
        // Q, QL and QR are three separate sets.
        let set = self.tree.text(at.saturating_sub(1)).to_ascii_uppercase();
        let value: Evaluated = self.evaluate_tokens((equal + 1, word.end));
        if matches!(&*set, b"Q" | b"QL" | b"QR") {
            self.set_variable(numbered(&set, number), value);
        } else {
            self.state.variables.invalidate(Reason::UnknownVariable);
        }
    }
}

/// Whether a TCH PROBE cycle certainly sets neither presets nor tools: REF. PLANE, POLAR PRESET, MEASURING, MEASURING IN 3-D, MEASURE ANGLE,
/// MEASURE PLANE, FAST PROBING. Lines of a definition (`31.1`) have the number of their cycle.
fn measures_only(number: &[u8]) -> bool {
    let whole = number.split(|byte| *byte == b'.').next().unwrap_or_default();
    matches!(whole, b"0" | b"1" | b"3" | b"4" | b"420" | b"431" | b"441")
}

/// Cycles of one and two digits that a definition only prepares.
const DEFINITIONS: [&[u8]; 25] = [
    b"1", b"2", b"3", b"4", b"5", b"6", b"9", b"13", b"14", b"15", b"16", b"17", b"18", b"20", b"21", b"22",
    b"23", b"24", b"25", b"27", b"28", b"29", b"30", b"32", b"39",
];

/// The number of a function: `FN 17: SYSWRITE`, `FN17:`.
fn number_of_function(text: &[u8]) -> Option<u32> {
    let digits = text.strip_prefix(b"FN")?.trim_ascii_start();
    let end = digits.iter().position(|byte| !byte.is_ascii_digit()).unwrap_or(digits.len());
    std::str::from_utf8(&digits[..end]).ok()?.parse().ok()
}
