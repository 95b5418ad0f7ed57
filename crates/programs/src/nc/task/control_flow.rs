//! Jumps, loops, subprograms, and the values of variables.

use super::super::dialect::Dialect;
use super::super::expression::{Evaluated, Variable, numbered};
use super::super::modal_state::ModalGroup;
use super::super::syntax::WordValue;
use super::super::token::Token;
use super::siemens_names::{Address, address};
use super::{Block, Interpreter, StateEvent};
use crate::motion::Reason;

impl Interpreter<'_, '_> {
    /// Whether a block can be reached from elsewhere than the block before.
    pub(super) fn is_reached_by_jumps(&self, block: &Block<'_>) -> bool {
        let Some(first) = block.words.first() else { return false };
        if first.name.len() > 1
            && self.dialect == Dialect::Siemens
            && self.tree.kind(first.end.saturating_sub(1)) == Some(Token::Colon)
        {
            return true;
        }
        let number = block.words.iter().take(2).find(|word| word.address() == Some(b'N'));
        let labelled = block
            .words
            .get(1)
            .is_some_and(|word| self.tree.kind(word.end - 1) == Some(Token::Colon) && word.name.len() > 1);
        labelled
            || number
                .and_then(|word| self.literal(word))
                .is_some_and(|number| self.computed_jump || self.jump_targets.contains(&(number as u64)))
    }

    /// Whether a block stands in the contour that a cycle of a lathe reads.
    pub(super) fn contour_of(&mut self, block: &Block<'_>) {
        let number = block.words.iter().take(2).find(|word| word.address() == Some(b'N'));
        let number = number.and_then(|word| self.literal(word)).map(|number| number as u64);
        // The block before was the last one.
        if self.contour_end == Some(u64::MAX) {
            self.contour_end = None;
        }
        let Some(number) = number else { return };
        if self.contour_end == Some(number) {
            self.contour_end = Some(u64::MAX);
        } else if let Some(&last) = self.contours.get(&number) {
            self.contour_end = Some(if last == number { u64::MAX } else { last });
        }
    }

    /// Whether a block holds a synchronised action of Siemens.
    pub(super) fn is_action(&self, block: &Block<'_>) -> bool {
        self.dialect == Dialect::Siemens
            && block
                .words
                .iter()
                .any(|word| ["WHEN", "WHENEVER", "FROM", "EVERY"].iter().any(|name| word.is(name)))
    }

    /// What a block assigns to variables. One that is assigned only where a condition holds is not known from here on.
    ///
    /// LinuxCNC reads the whole line before it assigns; what others do with a value in the line that assigns it is not
    /// certain, so that it is not known there where the line moves as well.
    pub(super) fn values(&mut self, block: &Block<'_>) -> Vec<(Option<Variable>, Evaluated)> {
        let mut values = Vec::new();
        let conditional = block.words.iter().any(|word| word.is("IF"));
        let moves =
            block.has_motion_words() || block.centre.iter().any(Option::is_some) || !block.g.is_empty();
        for word in &block.words {
            if !word.assigned {
                continue;
            }
            let name: Option<Variable> = match word.name {
                b"#" => match word.index {
                    Some((first, _)) if self.tree.kind(first) == Some(Token::Name) => {
                        Some(self.tree.text(first).to_ascii_uppercase())
                    }
                    Some(range) => self.evaluate_tokens(range).ok().map(|number| {
                        self.system_parameter(number);
                        numbered(b"#", number)
                    }),
                    None => None,
                },
                [b'R' | b'r'] => word
                    .index
                    .and_then(|range| self.evaluate_tokens(range).ok())
                    .map(|number| numbered(b"R", number)),
                [b'R' | b'r', digits @ ..] if !digits.is_empty() && digits.iter().all(u8::is_ascii_digit) => {
                    Some(word.name.to_ascii_uppercase())
                }
                name if name.len() > 1 && word.index.is_none() && self.is_variable(name) => {
                    Some(name.to_ascii_uppercase())
                }
                _ => continue,
            };
            let value = match word.value {
                _ if self.synchronised_actions => Err(Reason::Variable),
                _ if conditional => Err(Reason::UnknownFlow),
                WordValue::Literal { .. } => self.literal(word).ok_or(Reason::WrongShape),
                WordValue::Expression { first, end } => self.evaluate_tokens((first, end)),
                _ => Err(Reason::WrongShape),
            };
            let value = match &name {
                // An INT rounds what it is given; in which direction is left to the control.
                Some(name) if self.integer_variables.contains(name) => value
                    .and_then(|value| if value.fract() == 0.0 { Ok(value) } else { Err(Reason::Variable) }),
                _ => value,
            };
            if name.is_none() && word.name == b"#" {
                // It may be one that the control itself reads: offsets, tools, settings.
                self.frames_assigned();
                self.tools_assigned();
                self.invalidate_group(ModalGroup::CoordinateShift, Reason::Variable);
            }
            match &name {
                _ if self.dialect == Dialect::LinuxCnc => {}
                Some(name) => {
                    let now = if moves { Err(Reason::Variable) } else { value };
                    self.set_variable(name.clone(), now);
                }
                None => self.state.variables.invalidate(Reason::Variable),
            }
            values.push((name, value));
        }
        values
    }

    pub(super) fn set_variable(&mut self, name: Variable, value: Evaluated) {
        self.assigned_variables.insert(name.clone());
        self.state.variables.insert(name, value);
    }

    /// After the block its variables have their values, but where the way has parted in it.
    pub(super) fn assign(&mut self, values: Vec<(Option<Variable>, Evaluated)>, parted: bool) {
        for (name, value) in values {
            match name {
                Some(name) => {
                    let value = if parted { Err(Reason::UnknownFlow) } else { value };
                    self.set_variable(name, value);
                }
                // Any of them.
                None => self.state.variables.invalidate(Reason::Variable),
            }
        }
    }

    /// `#5221=`: numbers that the control itself reads.
    fn system_parameter(&mut self, number: f64) {
        let number = number.round() as i64;
        let linux = self.dialect == Dialect::LinuxCnc;
        match number {
            // Own ones, signals, timers, messages.
            ..=1199 | 3000..=3004 | 3006..=3012 | 3901 | 3902 => {}
            5061..=5070 | 5161..=5190 | 1200..=5000 | 5391.. if linux => {}
            5211..=5219 if linux => self.invalidate_group(ModalGroup::CoordinateShift, Reason::Variable),
            5220 if linux => self.invalidate_group(ModalGroup::WorkOffset, Reason::Variable),
            5221..=5390 if linux || number <= 5340 => {
                let name = match (number - 5221) / 20 {
                    frame @ 0..=5 => format!("G{}", 54 + frame),
                    frame => format!("G59.{}", frame - 5),
                };
                // X Y Z A B C, and the turn about Z of LinuxCNC as the tenth; other axes are none of the robot's.
                if matches!((number - 5221) % 20, 3..=5) {
                    self.has_rotary(&name, true);
                }
                self.offset_is(&name, None);
            }
            2500..=2999 | 5201..=5220 | 7001..=7999 | 14001..=19999 | 20001..=29999 => self.frames_assigned(),
            2001..=2499 | 10001..=13999 => self.tools_assigned(),
            _ => {
                self.frames_assigned();
                self.tools_assigned();
                self.state.invalidate_all(Reason::UnknownWord);
                self.effects.set_all_varying();
            }
        }
    }

    /// Names of Siemens with a value, or alone.
    pub(super) fn gather_siemens(&self, block: &mut Block<'_>, index: usize, name: &[u8]) {
        let word = block.words[index];
        if !word.assigned || name.starts_with(b"$") || self.is_variable(name) {
            return;
        }
        match address(name) {
            Some(Address::Setting) => {}
            Some(Address::Aside(reason)) => block.unmodelled = Some(reason),
            Some(Address::External) => block.other_axes = true,
            // What it sets is told by the words of the block, in `tool_words`.
            Some(Address::Tool) => {}
            // A name of the control or of the machine's axes, or a variable of another file.
            None => {
                let text = String::from_utf8_lossy(name).into_owned();
                block.unknown_word = Some((text, Reason::UnknownWord));
            }
        }
    }

    /// TOFFL=, TCARR=: the tool is no more what its name says, or is again.
    pub(super) fn tool_words(&mut self, block: &Block<'_>) {
        for word in &block.words {
            let name = word.name.to_ascii_uppercase();
            if self.dialect == Dialect::Siemens && word.assigned && address(&name) == Some(Address::Tool) {
                self.tools_assigned();
            }
        }
    }

    /// Whether a name with a value is a variable of the program: one that it declares, or one with the underscore of the
    /// parameters of cycles.
    pub(super) fn is_variable(&self, name: &[u8]) -> bool {
        self.dialect == Dialect::Siemens
            && (name.first() == Some(&b'_') || self.declared.contains(&name.to_ascii_uppercase()))
    }

    /// Jumps, loops and subprograms. True where the block does nothing else.
    pub(super) fn control_flow(&mut self, block: &Block<'_>) -> bool {
        let Some(first) = block.words.iter().find(|word| word.address() != Some(b'N')) else { return false };
        let name = first.name.to_ascii_uppercase();
        if self.dialect == Dialect::LinuxCnc && first.address() == Some(b'O') {
            self.o_word(block);
            return true;
        }
        match (&*name, first.address()) {
            (_, Some(b'O')) if matches!(self.dialect, Dialect::Fanuc | Dialect::Iso) => {
                // The number of a program: the first one is where the machine starts.
                if !self.contexts.is_empty() {
                    self.join_unseen_predecessors();
                }
                // Words may stand on its line.
                block.words.iter().filter(|word| word.address() != Some(b'N')).count() == 1
            }
            // A program number stands alone; with words it is a block number.
            (b":", _) if block.words.len() == 1 => {
                if !self.contexts.is_empty() {
                    self.join_unseen_predecessors();
                }
                true
            }
            (b"PROC", _) => {
                self.join_unseen_predecessors();
                true
            }
            (b"IF", _) => {
                // A jump may go away; what stands here holds where it does not.
                self.branch();
                true
            }
            (
                b"WHILE" | b"DO" | b"END" | b"ELSE" | b"ENDIF" | b"ENDWHILE" | b"FOR" | b"ENDFOR" | b"LOOP"
                | b"ENDLOOP" | b"REPEAT" | b"UNTIL" | b"CASE",
                _,
            ) => {
                self.join_unseen_predecessors();
                true
            }
            _ if name.starts_with(b"GOTO") => {
                self.branch();
                true
            }
            _ if name.starts_with(b"REPEAT") => {
                self.subprogram(block, "REPEAT");
                true
            }
            (b"MCALL", _) => {
                let is_subprogram = block.words.iter().skip_while(|word| !word.is("MCALL")).nth(1);
                self.state.modal_call = is_subprogram.map(|word| {
                    let cycle = super::siemens_names::is_cycle(&word.name.to_ascii_uppercase());
                    if cycle { Reason::Cycle } else { Reason::Subprogram }
                });
                true
            }
            (b"CALL" | b"PCALL" | b"EXTCALL" | b"EXECSTRING", _) => {
                let text = String::from_utf8_lossy(&name).into_owned();
                self.subprogram(block, &text);
                true
            }
            (_, Some(b'L')) if self.dialect == Dialect::Siemens && first.value != WordValue::Absent => {
                self.subprogram(block, "L");
                true
            }
            (b"DEF" | b"EXTERN" | b"DEFINE", _) => true,
            _ => false,
        }
    }

    /// LinuxCNC: `O100 sub`, `O100 if […]`.
    fn o_word(&mut self, block: &Block<'_>) {
        let keyword = block.words.get(1).map(|word| word.name.to_ascii_uppercase()).unwrap_or_default();
        match &*keyword {
            b"CALL" => self.subprogram(block, "O call"),
            b"IF" => self.branch(),
            b"SUB" => {
                let state_before_subprogram = self.state.clone();
                self.join_unseen_predecessors();
                self.state_before_subprogram = Some(state_before_subprogram);
            }
            // The way goes past a subprogram; what stands in it holds only where it is called.
            b"ENDSUB" if self.state_before_subprogram.is_some() => {
                if let Some(state) = self.state_before_subprogram.take() {
                    self.state = state;
                }
                self.program_ended = false;
                self.frame_index = None;
                self.tool_index.clear();
                self.events.push(StateEvent::Join);
            }
            _ => self.join_unseen_predecessors(),
        }
    }

    /// A call: listed, and where it leaves the axes is not known. What a program that does not stand in the file may set
    /// beside is not known either; it is taken to set nothing, and noted.
    pub(super) fn subprogram(&mut self, block: &Block<'_>, name: &str) {
        if !self.stands_here(block) {
            self.listing.outside.push(self.listing.motions.len() as u32);
        }
        self.list_left(block, name, Reason::Subprogram);
        self.join_unseen_predecessors();
    }

    /// Whether what a block calls stands in the file.
    fn stands_here(&self, block: &Block<'_>) -> bool {
        let Some(first) = block.words.iter().find(|word| word.address() != Some(b'N')) else { return false };
        let text = self.tree.source()[self.tree.range(first.first, first.end)].to_ascii_uppercase();
        match self.dialect {
            Dialect::Heidenhain => {
                text.split(u8::is_ascii_whitespace).filter(|word| !word.is_empty()).nth(1) == Some(b"LBL")
            }
            Dialect::Siemens => text.starts_with(b"REPEAT"),
            Dialect::LinuxCnc if first.address() == Some(b'O') => self.programs.contains(&text),
            _ => {
                let number = block.p.and_then(|index| self.literal(&block.words[index]));
                // M98 P51000 calls O1000 five times.
                let here = |p: f64| [p, p % 1e4].iter().any(|p| self.programs.contains(&numbered(b"O", *p)));
                block.m.contains(&97) || number.is_some_and(here)
            }
        }
    }
}
