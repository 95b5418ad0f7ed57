//! What holds where control comes from elsewhere: at labels, at the heads and ends of loops and branches, in subprograms and behind
//! their calls. The states of all paths that lead to such a place are joined there.
//! ([`read_until_stable`]). Code that no path reaches is taken to run in the state of [`Interpreter::join_unseen_predecessors`]. A file
//! with a jump or call that may lead anywhere is read by that rule alone.

use super::super::dialect::Dialect;
use super::super::expression::{Variable, numbered};
use super::super::modal_state::ModalState;
use super::super::syntax::{Word, WordValue};
use super::super::token::Token;
use super::arrivals::{Site, Structure, StructureKind, is_label, label};
use super::{Block, Interpreter, Lengths, Pass, StateEvent};
use crate::dataflow::{Lattice, read_until_stable};
use crate::motion::Reason;

impl Interpreter<'_, '_> {
    /// Reads a file along its paths. False where they do not follow from the text.
    pub(super) fn interpret_paths(&mut self, lengths: &Lengths, start: &ModalState) -> bool {
        !self.scan.computed_jump
            && read_until_stable(
                self,
                |interpreter| &mut interpreter.paths,
                |interpreter| {
                    interpreter.truncate_to(lengths);
                    interpreter.state = start.clone();
                    interpreter.pass = Pass::default();
                    interpreter.interpret_file();
                    interpreter.pass.structures.is_empty()
                },
            )
    }

    /// Control may lead from here to a place that the text does not show.
    pub(super) fn leads_anywhere(&mut self) {
        if let Some(paths) = &mut self.paths {
            paths.lead_anywhere();
        }
    }

    /// Control may go on at `site`.
    pub(super) fn depart(&mut self, site: Site) {
        let Some(paths) = &mut self.paths else { return };
        if !self.pass.unreached {
            paths.add(&site, &at_join(&self.state));
        }
        if !matches!(site, Site::Return(_)) {
            paths.require(site);
        }
    }

    /// Control does not pass on to the next block.
    pub(super) fn stop(&mut self) {
        if self.paths.is_some() {
            self.pass.unreached = true;
            self.pass.program_ended = true;
        }
    }

    /// The state at `site`: that of all paths which lead there, and of the block before where control passes on from there.
    pub(super) fn arrive(&mut self, site: Site) {
        self.depart(site.clone());
        self.settle(&site, None);
    }

    /// The same at a place that control does not reach from the block before.
    pub(super) fn arrive_from_elsewhere(&mut self, site: Site) {
        self.pass.unreached = true;
        self.arrive(site);
    }

    /// Takes the state that arrives at a place, joined with that of another path.
    fn settle(&mut self, site: &Site, other: Option<ModalState>) {
        let Some(paths) = &mut self.paths else { return self.join_unseen_predecessors() };
        let mut arriving = paths.at(site);
        arriving.join(&other);
        let Some(state) = arriving else {
            self.pass.unreached = true;
            return self.join_unseen_predecessors();
        };
        self.state = state;
        self.pass.unreached = false;
        self.pass.program_ended = false;
        self.pass.branched = true;
        self.pass.effects.joins += 1;
        self.frame_index = None;
        self.tool_index.clear();
        self.events.push(StateEvent::Join);
    }

    /// Whether something leads to a place.
    pub(super) fn is_target(&self, site: &Site) -> bool {
        self.paths.as_ref().is_some_and(|paths| paths.is_required(site))
    }

    /// At the end of a block: code that no path reaches.
    pub(super) fn note_unreached(&mut self, block: &Block<'_>) {
        let Some(paths) = &mut self.paths else { return };
        if self.pass.unreached && !self.pass.program_ended && !block.words.is_empty() {
            self.pass.unreached = !paths.find_unreached();
        }
    }

    /// At a label or block number.
    pub(super) fn arrive_at_label(&mut self, block: &Block<'_>) {
        let sites = self.labels(block);
        if sites.is_empty() {
            self.leads_anywhere();
            return self.join_unseen_predecessors();
        }
        sites.into_iter().for_each(|site| self.arrive(site));
    }

    /// The labels of a block, and its number where a jump leads there.
    fn labels(&self, block: &Block<'_>) -> Vec<Site> {
        let mut sites = Vec::new();
        for word in block.words.iter().take(2) {
            let number = self.literal(word).map(|number| number as u64);
            match word.address() {
                Some(b'N') => {
                    let targets = &self.scan.jump_targets;
                    sites.extend(number.filter(|number| targets.contains(number)).map(at_number));
                }
                None if self.tree.kind(word.end.saturating_sub(1)) == Some(Token::Colon) => {
                    sites.push(Site::Label(word.name.to_ascii_uppercase()));
                }
                _ => {}
            }
        }
        sites
    }

    /// Whether a block holds a jump behind other words.
    pub(super) fn jumps_in_passing(&self, block: &Block<'_>) -> bool {
        let first = block.words.iter().find(|word| word.address() != Some(b'N'));
        let leads = |word: &Word<'_>| is_jump(word) || word.is("IF") || word.is("CASE");
        block.words.iter().any(is_jump) && !first.is_some_and(leads)
    }

    /// The jumps of a block with GOTO.
    pub(super) fn jump(&mut self, block: &Block<'_>) {
        match self.jump_sites(block) {
            Some(sites) => sites.into_iter().for_each(|site| self.depart(site)),
            None => self.leads_anywhere(),
        }
    }

    /// Where the GOTO words of a block lead; `None` where that is computed at run time, or is the start of the program (GOTOS).
    fn jump_sites(&self, block: &Block<'_>) -> Option<Vec<Site>> {
        let mut sites = Vec::new();
        let mut words = block.words.iter();
        while let Some(word) = words.next() {
            if !is_jump(word) {
                continue;
            }
            if !["GOTO", "GOTOB", "GOTOF", "GOTOC"].iter().any(|name| word.is(name)) {
                return None;
            }
            let target = match word.value {
                WordValue::Absent if word.index.is_none() => words.next()?,
                _ => word,
            };
            let number = self.literal(target).filter(|number| *number >= 0.0);
            sites.push(match (target.address(), number) {
                (Some(b'N'), Some(number)) => at_number(number as u64),
                (None, Some(number)) if is_jump(target) => at_number(number as u64),
                (None, None) if target.value == WordValue::Absent && target.index.is_none() => {
                    Site::Label(target.name.to_ascii_uppercase())
                }
                _ => return None,
            });
        }
        Some(sites)
    }

    /// `FN 9: … GOTO LBL 5` (Heidenhain).
    pub(super) fn jump_to_label(&mut self, words: &[&[u8]]) {
        self.returns_are_common();
        let at = words.iter().position(|word| *word == b"GOTO").unwrap_or(words.len());
        match words.get(at + 1..).unwrap_or_default() {
            [b"LBL", name] if !name.starts_with(b"Q") => self.depart(Site::Label(label(name))),
            _ => self.leads_anywhere(),
        }
    }

    fn returns_are_common(&mut self) {
        if let Some(paths) = self.paths.as_mut().filter(|_| !self.returns_are_common) {
            self.returns_are_common = true;
            paths.ask_for_pass();
        }
    }

    fn return_of(&self, name: &Variable) -> Site {
        Site::Return(if self.returns_are_common { Variable::new() } else { name.clone() })
    }

    /// Control may return to the callers of these programs or labels. Their variables may be local.
    pub(super) fn returns_from(&mut self, names: Vec<Variable>) {
        if self.paths.is_none() {
            return;
        }
        let kept = self.state.variables.clone();
        self.state.variables.invalidate(Reason::UnknownFlow);
        for name in names {
            self.depart(self.return_of(&name));
        }
        self.state.variables = kept;
    }

    /// A call of a program or label of this file, or one of another file (`is_own`).
    pub(super) fn call(&mut self, block: &Block<'_>, callee: Option<&Variable>, is_own: bool) {
        if self.paths.is_none() {
            return self.join_unseen_predecessors();
        }
        match callee {
            Some(name) if is_own && self.calls_whole(block) => self.call_own(block, name),
            Some(name) if !is_own && self.is_certainly_elsewhere(block, name) => {
                self.join_unseen_predecessors()
            }
            _ => {
                self.leads_anywhere();
                self.join_unseen_predecessors();
            }
        }
    }

    /// Whether a call of a program in this file begins at its start.
    fn calls_whole(&self, block: &Block<'_>) -> bool {
        let starts_within = block.q.is_some() || block.h.is_some() || block.m.contains(&198);
        match self.dialect {
            Dialect::Heidenhain | Dialect::LinuxCnc => true,
            Dialect::Fanuc | Dialect::Iso => {
                !(starts_within && block.m.iter().any(|m| matches!(m, 98 | 198)))
            }
            Dialect::Siemens => false,
        }
    }

    /// Whether a call certainly leads to another file. A name that is computed may be one of this file.
    fn is_certainly_elsewhere(&self, block: &Block<'_>, name: &Variable) -> bool {
        match self.dialect {
            Dialect::Heidenhain => true,
            Dialect::Siemens => {
                !block.words.iter().any(|word| ["BLOCK", "EXECSTRING"].iter().any(|name| word.is(name)))
            }
            _ if self.scan.programs.is_empty() => true,
            // LinuxCNC ignores spaces in names and zeros before numbers.
            Dialect::LinuxCnc => {
                let digits = name.strip_prefix(b"O").unwrap_or_default();
                !name.contains(&b' ')
                    && (digits.starts_with(b"<")
                        || digits.iter().all(u8::is_ascii_digit) && !digits.is_empty() && digits[0] != b'0')
            }
            Dialect::Fanuc | Dialect::Iso => !name.is_empty(),
        }
    }

    fn call_own(&mut self, block: &Block<'_>, name: &Variable) {
        let entry = if is_label(name) { Site::Label(name.clone()) } else { Site::Program(name.clone()) };
        let is_repeated = self.repeats_label(block);
        let is_label = is_label(name);
        let passed = (is_repeated && !self.pass.unreached).then(|| at_join(&self.state));
        if is_label && is_repeated {
            self.returns_are_common();
        }
        self.state.variables.invalidate(Reason::UnknownFlow);
        self.depart(entry.clone());
        let site = self.return_of(name);
        let guess = self.guess(&site);
        self.settle(&site, passed.or(guess));
        if self.may_call_again(block) {
            self.depart(entry);
        }
    }

    /// Whether a block repeats the blocks behind a label (CALL LBL 1 REP 2).
    pub(super) fn repeats_label(&self, block: &Block<'_>) -> bool {
        self.dialect == Dialect::Heidenhain
            && block
                .words
                .first()
                .is_some_and(|word| self.word_text(word).windows(4).any(|part| part == b" REP"))
    }

    /// The state behind a call whose end no pass has reached yet.
    fn guess(&mut self, site: &Site) -> Option<ModalState> {
        let guesses = !self.pass.unreached && self.paths.as_mut()?.guess(site);
        guesses.then(|| at_join(&self.state))
    }

    /// Whether a call may run its program several times in a row (M98 P1 L3, P30001).
    fn may_call_again(&self, block: &Block<'_>) -> bool {
        let p = block.p.and_then(|index| self.literal(&block.words[index]));
        self.dialect.paren_comments()
            && self.dialect != Dialect::LinuxCnc
            && (block.l.is_some() || p.is_none_or(|p| p >= 1e4))
    }

    fn repeat(&mut self, block: &Block<'_>) {
        let mut words = block.words.iter().skip_while(|word| !word.is("REPEAT")).skip(1);
        let label = words.next().filter(|word| word.value == WordValue::Absent && word.index.is_none());
        let site = label.map(|label| Site::Label(label.name.to_ascii_uppercase()));
        // What is repeated ends at ENDLABEL, and not here.
        let end = Site::Label(b"ENDLABEL".to_vec());
        let is_before = |site: &Site| {
            self.paths.as_ref().is_some_and(|paths| paths.is_read(site) && !paths.is_read(&end))
        };
        let is_last = words.all(|word| word.address() == Some(b'P'));
        match site.filter(|site| is_last && is_before(site)) {
            Some(site) => {
                self.depart(site);
                let state = at_join(&self.state);
                self.state = state;
                self.pass.branched = true;
                self.pass.effects.joins += 1;
                self.events.push(StateEvent::Join);
            }
            None => {
                self.leads_anywhere();
                self.join_unseen_predecessors();
            }
        }
    }

    /// The start of a program or subprogram. `is_callable`: another file may call it, in any state.
    pub(super) fn begin_program(&mut self, name: &Variable, is_callable: bool) {
        if !self.pass.structures.is_empty() {
            self.leads_anywhere();
        }
        self.pass.program.clone_from(name);
        if self.paths.is_some() && is_callable {
            let before = (self.state.clone(), self.pass.unreached);
            self.join_unseen_predecessors();
            self.pass.unreached = false;
            self.depart(Site::Program(name.clone()));
            (self.state, self.pass.unreached) = before;
        }
    }

    /// IF, WHILE, ENDFOR and the like; `name` is that of a block of LinuxCNC.
    pub(super) fn structure(&mut self, keyword: &[u8], name: Variable, block: &Block<'_>) {
        use StructureKind::{Else, Endless, If, Until, While};
        if self.paths.is_none() {
            return match keyword {
                b"IF" => self.branch(),
                _ => self.join_unseen_predecessors(),
            };
        }
        let linux = self.dialect == Dialect::LinuxCnc;
        let last = self.pass.structures.last().map(|last| (last.kind, last.name == name));
        let closes = |kinds: &[StructureKind]| last.is_some_and(|(kind, same)| same && kinds.contains(&kind));
        match keyword {
            b"IF" => {
                self.branch();
                self.depart(Site::Branch(block.node, 0));
                self.open_structure(If, block, name);
            }
            b"ELSEIF" if linux && closes(&[If]) => self.next_branch(true),
            b"ELSE" if closes(&[If]) => self.next_branch(false),
            b"ENDIF" if closes(&[If, Else]) => self.end_branches(),
            b"WHILE" if linux && closes(&[Until]) => self.end_loop(),
            b"UNTIL" if closes(&[Until]) => self.end_loop(),
            b"END" | b"ENDWHILE" | b"ENDFOR" | b"ENDLOOP" | b"ENDREPEAT" if closes(&[While, Endless]) => {
                self.end_loop()
            }
            b"WHILE" | b"FOR" => self.open_loop(While, block, name),
            b"REPEAT" if linux => self.open_loop(While, block, name),
            b"LOOP" => self.open_loop(Endless, block, name),
            b"DO" if !linux => self.open_loop(Endless, block, name),
            // REPEAT NAME: back to a label before it, and on from here.
            b"REPEAT" if !linux && block.words.last().is_some_and(|word| !word.is("REPEAT")) => {
                self.repeat(block)
            }
            b"DO" | b"REPEAT" => self.open_loop(Until, block, name),
            b"BREAK" | b"CONTINUE" if linux => self.leave_loop_early(keyword, &name),
            b"CASE" => {
                self.branch();
                self.jump(block);
            }
            _ => {
                self.leads_anywhere();
                self.join_unseen_predecessors();
            }
        }
    }
}

impl Interpreter<'_, '_> {
    fn open_structure(&mut self, kind: StructureKind, block: &Block<'_>, name: Variable) {
        self.pass.structures.push(Structure { kind, block: block.node, name, branch: 0 });
    }

    fn open_loop(&mut self, kind: StructureKind, block: &Block<'_>, name: Variable) {
        self.arrive(Site::Head(block.node));
        if kind == StructureKind::While {
            self.depart(Site::After(block.node));
        }
        self.open_structure(kind, block, name);
    }

    /// The end of a loop, which leads back to its head.
    fn end_loop(&mut self) {
        let Some(Structure { kind, block, .. }) = self.pass.structures.pop() else { return };
        self.depart(Site::Head(block));
        match kind {
            StructureKind::Until => self.arrive(Site::After(block)),
            _ => self.arrive_from_elsewhere(Site::After(block)),
        }
    }

    /// ELSE, ELSEIF: the branch before it ends, and another begins where the conditions so far are false.
    fn next_branch(&mut self, is_conditional: bool) {
        let Some(structure) = self.pass.structures.last_mut() else { return };
        let (block, branch) = (structure.block, structure.branch);
        structure.branch += 1;
        if !is_conditional {
            structure.kind = StructureKind::Else;
        }
        self.depart(Site::After(block));
        self.arrive_from_elsewhere(Site::Branch(block, branch));
        if is_conditional {
            self.depart(Site::Branch(block, branch + 1));
        }
    }

    fn end_branches(&mut self) {
        let Some(Structure { kind, block, branch, .. }) = self.pass.structures.pop() else { return };
        if kind == StructureKind::If {
            self.arrive(Site::Branch(block, branch));
        }
        self.arrive(Site::After(block));
    }

    /// O break, O continue (LinuxCNC). The condition of DO stands at its end.
    fn leave_loop_early(&mut self, keyword: &[u8], name: &Variable) {
        use StructureKind::{Endless, Until, While};
        let is_loop = |structure: &&Structure| {
            matches!(structure.kind, While | Until | Endless) && structure.name == *name
        };
        let Some((kind, block)) = self
            .pass
            .structures
            .iter()
            .rev()
            .find(is_loop)
            .map(|structure| (structure.kind, structure.block))
        else {
            self.leads_anywhere();
            return self.join_unseen_predecessors();
        };
        if keyword == b"BREAK" || kind == Until {
            self.depart(Site::After(block));
        }
        if keyword == b"CONTINUE" {
            self.depart(Site::Head(block));
        }
        self.events.push(StateEvent::Branch);
        self.stop();
    }
}

/// Whether a word is GOTO, GOTOF and the like.
pub(super) fn is_jump(word: &Word<'_>) -> bool {
    word.name.len() >= 4 && word.name[..4].eq_ignore_ascii_case(b"GOTO")
}

fn at_number(number: u64) -> Site {
    Site::Label(numbered(b"N", number as f64))
}

/// A state as it arrives elsewhere. Corrected motions end elsewhere on each path, and may be written in another mode: where the tool is,
/// how it moved, and an origin that was set at the tool position do not count as known.
fn at_join(state: &ModalState) -> ModalState {
    let mut state = state.clone();
    state.forget_path();
    state
}
