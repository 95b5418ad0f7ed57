//! Control flow (jumps, loops, subprogram calls), and assignments to variables.

use super::super::called::program_of;
use super::super::dialect::Dialect;
use super::super::expression::{Evaluated, Variable, numbered};
use super::super::modal_group::ModalGroup;
use super::super::syntax::{Word, WordValue};
use super::super::token::Token;
use super::arrivals::{Site, is_label, label};
use super::paths::is_jump;
use super::siemens_names::{AddressEffect, address_effect};
use super::{Block, FlowPoint, Interpreter, StateEvent};
use crate::motion::Reason;

impl Interpreter<'_, '_> {
    /// Records a point at which control does not simply pass on to the next block.
    pub(super) fn flow(&mut self, point: FlowPoint) {
        let next = self.listing.motions.len() as u32;
        self.call_edges.push(point, self.file, next, false);
    }

    /// Whether a block has predecessors other than the block before it.
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
            || number.and_then(|word| self.literal(word)).is_some_and(|number| {
                self.scan.computed_jump || self.scan.jump_targets.contains(&(number as u64))
            })
    }

    /// Tracks whether the block is in the contour that a lathe cycle reads.
    pub(super) fn contour_of(&mut self, block: &Block<'_>) {
        let number = block.words.iter().take(2).find(|word| word.address() == Some(b'N'));
        let number = number.and_then(|word| self.literal(word)).map(|number| number as u64);
        // The block before was the last of the contour.
        if self.pass.contour_end == Some(u64::MAX) {
            self.pass.contour_end = None;
        }
        let Some(number) = number else { return };
        if self.pass.contour_end == Some(number) {
            self.pass.contour_end = Some(u64::MAX);
        } else if let Some(&last) = self.scan.contours.get(&number) {
            self.pass.contour_end = Some(if last == number { u64::MAX } else { last });
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

    /// The assignments of a block. A conditional assignment makes its variable unknown.
    ///
    /// LinuxCNC reads the whole line before it assigns. Other controls differ in the value that a variable has in the
    /// line which assigns it; there it is unknown if the line also moves.
    pub(super) fn evaluate_assignments(&mut self, block: &Block<'_>) -> Vec<(Option<Variable>, Evaluated)> {
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
                        self.assign_system_parameter(number);
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
                _ if self.pass.synchronised_actions => Err(Reason::UnknownVariable),
                _ if conditional => Err(Reason::UnknownFlow),
                WordValue::Literal { .. } => self.literal(word).ok_or(Reason::WrongShape),
                WordValue::Expression { first, end } => self.evaluate_tokens((first, end)),
                _ => Err(Reason::WrongShape),
            };
            let value = match &name {
                // An INT rounds its value, in a direction that depends on the control.
                Some(name) if self.scan.integer_variables.contains(name) => value.and_then(|value| {
                    if value.fract() == 0.0 { Ok(value) } else { Err(Reason::UnknownVariable) }
                }),
                _ => value,
            };
            if name.is_none() && word.name == b"#" {
                // The number is unknown: it may be a system variable for offsets, tools or settings.
                self.invalidate_offsets();
                self.invalidate_tools();
                self.invalidate_group(ModalGroup::CoordinateShift, Reason::UnknownVariable);
            }
            match &name {
                _ if self.dialect == Dialect::LinuxCnc => {}
                Some(name) => {
                    let now = if moves { Err(Reason::UnknownVariable) } else { value };
                    self.set_variable(name.clone(), now);
                }
                None => self.state.variables.invalidate(Reason::UnknownVariable),
            }
            values.push((name, value));
        }
        values
    }

    pub(super) fn set_variable(&mut self, name: Variable, value: Evaluated) {
        self.assigned_variables.insert(name.clone());
        self.state.variables.insert(name, value);
    }

    /// Applies the assignments after the block, unless the block contains a branch or join.
    pub(super) fn apply_assignments(&mut self, values: Vec<(Option<Variable>, Evaluated)>, parted: bool) {
        for (name, value) in values {
            match name {
                Some(name) => {
                    let value = if parted { Err(Reason::UnknownFlow) } else { value };
                    self.set_variable(name, value);
                }
                // Any variable may have been assigned.
                None => self.state.variables.invalidate(Reason::UnknownVariable),
            }
        }
    }

    /// Assignments to system variables: `#5221=`.
    fn assign_system_parameter(&mut self, number: f64) {
        let number = number.round() as i64;
        let linux = self.dialect == Dialect::LinuxCnc;
        match number {
            // User variables, signals, timers, messages.
            ..=1199 | 3000..=3004 | 3006..=3012 | 3901 | 3902 => {}
            5061..=5070 | 5161..=5190 | 1200..=5000 | 5391.. if linux => {}
            5211..=5219 if linux => {
                self.invalidate_group(ModalGroup::CoordinateShift, Reason::UnknownVariable)
            }
            5220 if linux => self.invalidate_group(ModalGroup::WorkOffset, Reason::UnknownVariable),
            5221..=5390 if linux || number <= 5340 => {
                let name = match (number - 5221) / 20 {
                    frame @ 0..=5 => format!("G{}", 54 + frame),
                    frame => format!("G59.{}", frame - 5),
                };
                // X Y Z A B C, and as the tenth the rotation about Z of LinuxCNC; other axes do not belong to the
                // robot.
                if matches!((number - 5221) % 20, 3..=5) {
                    self.set_rotary_offset(&name, true);
                }
                self.assign_offset(&name, None);
            }
            2500..=2999 | 5201..=5220 | 7001..=7999 | 14001..=19999 | 20001..=29999 => {
                self.invalidate_offsets()
            }
            2001..=2499 | 10001..=13999 => self.invalidate_tools(),
            _ => {
                self.invalidate_offsets();
                self.invalidate_tools();
                self.state.invalidate_all(Reason::UnknownWord);
                self.pass.effects.set_all_varying();
            }
        }
    }

    /// Siemens names with or without a value.
    pub(super) fn collect_siemens_name(&self, block: &mut Block<'_>, index: usize, name: &[u8]) {
        let word = block.words[index];
        if !word.assigned || name.starts_with(b"$") || self.is_variable(name) {
            return;
        }
        match address_effect(name) {
            Some(AddressEffect::None) => {}
            Some(_) if self.further_axis(&word).is_some() => block.flags.other_axes = true,
            Some(AddressEffect::Unmodelled(reason)) => block.unmodelled = Some(reason),
            Some(AddressEffect::OtherAxes) => block.flags.other_axes = true,
            // Handled by `tool_words`.
            Some(AddressEffect::Tool) => {}
            // A name of the control or of a machine axis, or a variable of another file.
            None => {
                let text = String::from_utf8_lossy(name).into_owned();
                block.unknown_word = Some((text, Reason::UnknownWord));
            }
        }
    }

    /// The letter of the axis beside the arm that a word positions by itself: `POS[U]`, `POSA[V]`.
    pub(super) fn further_axis(&self, word: &Word<'_>) -> Option<u8> {
        let (first, end) = word.index.filter(|_| word.name.to_ascii_uppercase().starts_with(b"POS"))?;
        let mut bytes = (first..end).flat_map(|token| self.tree.text(token));
        let letter = bytes.find(|byte| byte.is_ascii_alphabetic())?.to_ascii_uppercase();
        matches!(letter, b'U'..=b'W' | b'E').then_some(letter)
    }

    /// TOFFL=, TCARR=: the tool offsets deviate from the tool's data, or no longer do.
    pub(super) fn tool_words(&mut self, block: &Block<'_>) {
        for word in &block.words {
            let name = word.name.to_ascii_uppercase();
            if self.dialect == Dialect::Siemens
                && word.assigned
                && address_effect(&name) == Some(AddressEffect::Tool)
            {
                self.invalidate_tools();
            }
        }
    }

    /// Whether a name with a value is a variable of the program: declared, or with the leading underscore of cycle
    /// parameters.
    pub(super) fn is_variable(&self, name: &[u8]) -> bool {
        self.dialect == Dialect::Siemens
            && (name.first() == Some(&b'_') || self.scan.declared.contains(&name.to_ascii_uppercase()))
    }

    /// Jumps, loops and subprogram calls. True if the block does nothing else.
    pub(super) fn control_flow(&mut self, block: &Block<'_>) -> bool {
        let Some(first) = block.words.iter().find(|word| word.address() != Some(b'N')) else { return false };
        let name = first.name.to_ascii_uppercase();
        if self.dialect == Dialect::LinuxCnc && first.address() == Some(b'O') {
            self.o_word(block);
            return true;
        }
        match (&*name, first.address()) {
            (_, Some(b'O')) if matches!(self.dialect, Dialect::Fanuc | Dialect::Iso) => {
                // A program number: execution starts at the first one.
                self.program_number(first);
                // Other words may follow on its line.
                block.words.iter().filter(|word| word.address() != Some(b'N')).count() == 1
            }
            // A program number stands alone; with other words it is a block number.
            (b":", _) if block.words.len() == 1 => {
                self.program_number(first);
                true
            }
            (b"PROC", _) => {
                self.join_unseen_predecessors();
                let name = block.words.iter().skip_while(|word| !word.is("PROC")).nth(1);
                let name = name.map(|word| word.name.to_ascii_uppercase());
                self.flow(FlowPoint::Program(name.unwrap_or_default()));
                true
            }
            (b"IF", _) => {
                self.condition(block);
                true
            }
            (
                b"WHILE" | b"DO" | b"END" | b"ELSE" | b"ENDIF" | b"ENDWHILE" | b"FOR" | b"ENDFOR" | b"LOOP"
                | b"ENDLOOP" | b"REPEAT" | b"UNTIL" | b"CASE",
                _,
            ) => {
                self.structure(&name, Variable::new(), block);
                self.flow(FlowPoint::Joins);
                true
            }
            _ if name.starts_with(b"GOTO") => {
                self.branch();
                self.jump(block);
                self.stop();
                true
            }
            _ if name.starts_with(b"REPEAT") => {
                self.subprogram(block, "REPEAT");
                true
            }
            (b"MCALL", _) => {
                let is_subprogram = block.words.iter().skip_while(|word| !word.is("MCALL")).nth(1);
                let program = |word: &Word<'_>| program_of(&String::from_utf8_lossy(word.name));
                let name = |word: &Word<'_>| word.name.to_ascii_uppercase();
                if is_subprogram.is_some_and(|word| super::siemens_names::is_measuring_cycle(&name(word))) {
                    // It runs behind every motion from here on.
                    self.list_left(block, "MCALL", Reason::Probe);
                    self.invalidate_by_probing();
                }
                self.pass.modal_callee = is_subprogram.map(program);
                self.state.modal_call = is_subprogram.map(|word| {
                    let name = name(word);
                    let cycle = super::siemens_names::is_cycle(&name) && !self.is_own_program(&name);
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
            // A macro may stand for a jump.
            (b"DEFINE", _) => {
                self.leads_anywhere();
                true
            }
            (b"DEF" | b"EXTERN", _) => true,
            _ => false,
        }
    }

    /// LinuxCNC: `O100 sub`, `O100 if […]`.
    fn o_word(&mut self, block: &Block<'_>) {
        let keyword = block.words.get(1).map(|word| word.name.to_ascii_uppercase()).unwrap_or_default();
        match &*keyword {
            b"CALL" => self.subprogram(block, "O call"),
            b"IF" => self.structure(b"IF", self.word_text(&block.words[0]), block),
            b"SUB" => {
                let before = (self.state.clone(), self.pass.unreached);
                let name = self.word_text(&block.words[0]);
                if self.pass.before_subprogram.is_some() {
                    self.leads_anywhere();
                }
                self.begin_program(&name, self.scan.is_subprogram || self.files > 1);
                self.arrive_from_elsewhere(Site::Program(name.clone()));
                self.flow(FlowPoint::Program(name));
                self.pass.before_subprogram = Some(before);
            }
            // The main path bypasses a subprogram, whose state holds only where it is called.
            b"ENDSUB" if self.pass.before_subprogram.is_some() => {
                let program = std::mem::take(&mut self.pass.program);
                self.returns_from(vec![program]);
                if let Some((state, unreached)) = self.pass.before_subprogram.take() {
                    (self.state, self.pass.unreached) = (state, unreached);
                }
                self.pass.program_ended = false;
                self.frame_index = None;
                self.tool_index.clear();
                self.events.push(StateEvent::Join);
                self.flow(FlowPoint::EndOfSubprogram);
            }
            b"RETURN" => {
                if self.paths.is_some() {
                    self.returns_from(vec![self.pass.program.clone()]);
                    self.stop();
                    self.events.push(StateEvent::Branch);
                } else {
                    self.join_unseen_predecessors();
                }
                self.flow(FlowPoint::Return);
            }
            _ => {
                self.structure(&keyword, self.word_text(&block.words[0]), block);
                self.flow(FlowPoint::Joins);
            }
        }
    }

    /// A program number: execution starts at the first one.
    fn program_number(&mut self, first: &Word<'_>) {
        let name = self.program_name(first);
        let site = Site::Program(name.clone());
        let is_first = self.pass.program.is_empty() && self.contexts.is_empty();
        self.begin_program(&name, !is_first && self.files > 1);
        if !self.contexts.is_empty() || self.is_target(&site) {
            self.arrive(site);
        }
        self.flow(FlowPoint::Program(name));
    }

    /// IF: where a jump follows, the state here is that of the path that does not take it.
    fn condition(&mut self, block: &Block<'_>) {
        if block.words.iter().any(is_jump) {
            self.branch();
            return self.jump(block);
        }
        let then = block.words.iter().position(|word| word.is("THEN"));
        match then.map(|then| &block.words[then + 1..]) {
            // IF […] THEN #1=2
            Some(rest) if !rest.is_empty() && rest.iter().all(|word| word.assigned) => self.branch(),
            Some([]) => self.structure(b"IF", Variable::new(), block),
            None if self.dialect == Dialect::Siemens => self.structure(b"IF", Variable::new(), block),
            // Haas: IF […] M99 P10.
            None if block.m.contains(&99) => {
                self.branch();
                self.leads_anywhere();
            }
            // Some controls execute it, others stop with an alarm.
            _ => self.list_unknown_word(block, "IF", Reason::UnknownWord),
        }
    }

    /// A call is listed; the pose after it is unknown. A program that is not in the file may also change the modal
    /// state: it is assumed not to, and the call is listed in [`crate::motion::NcFacts::external_calls`].
    pub(super) fn subprogram(&mut self, block: &Block<'_>, name: &str) {
        let callee = self.callee(block);
        // The words that a macro stands for are executed here, whatever they change.
        if callee.as_ref().is_some_and(|name| self.scan.macros.contains(name)) {
            return self.list_unknown_word(block, name, Reason::UnknownWord);
        }
        let is_own = match &callee {
            Some(name) => is_label(name) || self.scan.programs.contains(name),
            None => true,
        };
        if !is_own {
            self.listing.nc.external_calls.push(self.listing.motions.len() as u32);
        }
        // The call itself moves nothing.
        let preceding = self.state.preceding.clone();
        self.list_left(block, name, Reason::Subprogram);
        self.state.preceding = preceding;
        self.call(block, callee.as_ref(), is_own);
        // What CALL LBL 1 REP 2 repeats ends here, and control passes on.
        let (next, may_skip) =
            (self.listing.motions.len() as u32, block.flags.skippable || self.repeats_label(block));
        self.call_edges.push(FlowPoint::Call { callee, may_skip }, self.file, next, true);
    }

    /// The program that a block calls, as [`FileScan::programs`](super::FileScan::programs) names it; `None` for a place in the same
    /// program (M97, REPEAT), an empty name where it is computed.
    pub(super) fn callee(&self, block: &Block<'_>) -> Option<Variable> {
        let Some(first) = block.words.iter().find(|word| word.address() != Some(b'N')) else {
            return Some(Variable::new());
        };
        let text = self.word_text(first);
        let words = || text.split(u8::is_ascii_whitespace).filter(|word| !word.is_empty());
        let node = self.tree.nodes.get(block.node);
        let whole = || self.tree.source()[self.tree.range(node.first, node.end)].to_ascii_uppercase();
        let quoted = || whole().split(|byte| *byte == b'"').nth(1).map(<[u8]>::to_vec);
        match self.dialect {
            Dialect::Heidenhain => {
                let name = words().nth(2).map(<[u8]>::to_vec).unwrap_or_default();
                match words().nth(1) {
                    Some(b"LBL") => Some(label(&name)),
                    Some(b"PGM") => Some(program_of(&String::from_utf8_lossy(&quoted().unwrap_or(name)))),
                    // The program of cycle 12.
                    _ => Some(Variable::new()),
                }
            }
            Dialect::Siemens if text.starts_with(b"REPEAT") => None,
            Dialect::Siemens => {
                let named = if [&b"CALL"[..], b"PCALL", b"EXTCALL"]
                    .iter()
                    .any(|call| first.name.eq_ignore_ascii_case(call))
                {
                    quoted()
                } else {
                    Some(text.split(|byte| *byte == b'(').next().unwrap_or_default().to_vec())
                };
                Some(program_of(&String::from_utf8_lossy(&named.unwrap_or_default())))
            }
            Dialect::LinuxCnc if first.address() == Some(b'O') => Some(text),
            _ if block.m.contains(&97) => None,
            _ => {
                let number = block.p.and_then(|index| self.literal(&block.words[index]));
                // M98 P51000 calls O1000 five times.
                let names = |p: f64| [p, p % 1e4].map(|p| numbered(b"O", p));
                let [whole, last] = number.map(names).unwrap_or_default();
                let is_own = |name: &Variable| self.scan.programs.contains(name);
                Some(if is_own(&whole) || !is_own(&last) && number.is_some_and(|p| p < 1e4) {
                    whole
                } else {
                    last
                })
            }
        }
    }

    /// The name of the program that begins with a word.
    fn program_name(&self, first: &Word<'_>) -> Variable {
        match self.literal(first) {
            Some(number) => numbered(b"O", number),
            None => self.word_text(first),
        }
    }

    /// The text of a word, in upper case.
    pub(super) fn word_text(&self, word: &Word<'_>) -> Variable {
        self.tree.source()[self.tree.range(word.first, word.end)].to_ascii_uppercase()
    }
}
