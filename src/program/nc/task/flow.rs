//! Jumps, loops, subprograms, and the values of variables.

use super::super::dialect::Dialect;
use super::super::expression::{Variable, Worth, numbered};
use super::super::syntax::{Belongs, Word};
use super::super::token::Token;
use super::{Event, Lister, Said};
use crate::program::motion::Reason;

impl Lister<'_, '_> {
    /// Whether a block can be reached from elsewhere than the block before.
    pub(super) fn is_reached_by_jumps(&self, said: &Said<'_>) -> bool {
        let Some(first) = said.words.first() else { return false };
        if first.name.len() > 1
            && self.dialect == Dialect::Siemens
            && self.tree.kind(first.end.saturating_sub(1)) == Some(Token::Colon)
        {
            return true;
        }
        let number = said.words.iter().take(2).find(|word| word.address() == Some(b'N'));
        let labelled = said
            .words
            .get(1)
            .is_some_and(|word| self.tree.kind(word.end - 1) == Some(Token::Colon) && word.name.len() > 1);
        labelled
            || number
                .and_then(|word| self.literal(word))
                .is_some_and(|number| self.anywhere || self.targets.contains(&(number as u64)))
    }

    /// Whether a block holds a synchronised action of Siemens.
    pub(super) fn is_action(&self, said: &Said<'_>) -> bool {
        self.dialect == Dialect::Siemens
            && said
                .words
                .iter()
                .any(|word| ["WHEN", "WHENEVER", "FROM", "EVERY"].iter().any(|name| word.is(name)))
    }

    /// Values of variables. One that is assigned only where a condition holds is not known from here on.
    pub(super) fn assignments(&mut self, said: &Said<'_>) {
        for word in &said.words {
            if let Some((name, value)) = self.assignment(said, word) {
                self.assign(name, value);
            }
        }
    }

    /// The same of all words of a block at once.
    pub(super) fn assigned(&self, said: &Said<'_>) -> Vec<(Option<Variable>, Worth)> {
        said.words.iter().filter_map(|word| self.assignment(said, word)).collect()
    }

    /// A variable gets a value; any of them where it is computed which.
    pub(super) fn assign(&mut self, name: Option<Variable>, value: Worth) {
        let number = name.as_ref().map(|name| {
            name.strip_prefix(b"#").and_then(|digits| std::str::from_utf8(digits).ok()?.parse::<u32>().ok())
        });
        // Variables of the control: offsets of the work, shifts, offsets of tools.
        match number {
            None | Some(Some(5201..=5206 | 5221..=5399 | 7001..=7999 | 14001..=14999))
                if self.dialect.paren_comments() =>
            {
                self.some_frames_set();
            }
            Some(Some(5210..=5219)) => self.state.shift = [Err(Reason::Variable); 3],
            Some(Some(2001..=2999 | 10001..=13999)) if self.dialect != Dialect::LinuxCnc => {
                self.some_tools_set();
            }
            _ => {}
        }
        match name {
            Some(name) => {
                self.state.variables.insert(name, value);
            }
            None => self.state.variables.values_mut().for_each(|value| *value = Err(Reason::Variable)),
        }
    }

    fn assignment(&self, said: &Said<'_>, word: &Word<'_>) -> Option<(Option<Variable>, Worth)> {
        if !word.assigned {
            return None;
        }
        let conditional = said.words.iter().any(|word| word.is("IF"));
        {
            let name: Option<Variable> = match word.name {
                b"#" => match word.index {
                    Some((first, _)) if self.tree.kind(first) == Some(Token::Name) => {
                        Some(self.tree.text(first).to_ascii_uppercase())
                    }
                    Some(range) => self.evaluated(range).ok().map(|number| numbered(b'#', number)),
                    None => None,
                },
                [b'R' | b'r'] => word
                    .index
                    .and_then(|range| self.evaluated(range).ok())
                    .map(|number| numbered(b'R', number)),
                [b'R' | b'r', digits @ ..] if !digits.is_empty() && digits.iter().all(u8::is_ascii_digit) => {
                    Some(word.name.to_ascii_uppercase())
                }
                name if name.len() > 1 && word.index.is_none() && self.is_variable(name) => {
                    Some(name.to_ascii_uppercase())
                }
                _ => return None,
            };
            let value = match word.belongs {
                _ if self.actions => Err(Reason::Variable),
                _ if conditional => Err(Reason::UnknownFlow),
                Belongs::Literal { .. } => self.literal(word).ok_or(Reason::WrongShape),
                Belongs::Expression { first, end } => self.evaluated((first, end)),
                _ => Err(Reason::WrongShape),
            };
            Some((name, value))
        }
    }

    /// Whether a name with a value is a variable, not an address of two letters or more.
    fn is_variable(&self, name: &[u8]) -> bool {
        const ADDRESSES: [&[u8]; 26] = [
            b"A2", b"B2", b"C2", b"A3", b"B3", b"C3", b"A4", b"B4", b"C4", b"A5", b"B5", b"C5", b"THETA",
            b"CR", b"TURN", b"AR", b"AP", b"RP", b"I1", b"J1", b"K1", b"ADIS", b"LEAD", b"TILT", b"RPL",
            b"SPOS",
        ];
        self.dialect == Dialect::Siemens
            && !ADDRESSES.iter().any(|address| name.eq_ignore_ascii_case(address))
            && !name.starts_with(b"$")
    }

    /// Jumps, loops and subprograms. True where the block does nothing else.
    pub(super) fn control_flow(&mut self, said: &Said<'_>) -> bool {
        let Some(first) = said.words.iter().find(|word| word.address() != Some(b'N')) else { return false };
        let name = first.name.to_ascii_uppercase();
        if self.dialect == Dialect::LinuxCnc && first.address() == Some(b'O') {
            let keyword = said.words.get(1).map(|word| word.name.to_ascii_uppercase()).unwrap_or_default();
            match &*keyword {
                b"CALL" => self.subprogram(said, "O call"),
                b"IF" => {}
                b"SUB" => {
                    self.passed = Some((self.state.clone(), self.seen));
                    self.forget();
                }
                // The way goes past a subprogram; what stands in it holds only where it is called.
                b"ENDSUB" if self.passed.is_some() => {
                    if let Some((state, seen)) = self.passed.take() {
                        (self.state, self.seen) = (state, seen);
                    }
                    self.events.push(Event::Unknown);
                }
                _ => self.forget(),
            }
            return true;
        }
        match (&*name, first.address()) {
            (_, Some(b'O')) if matches!(self.dialect, Dialect::Fanuc | Dialect::Iso) => {
                // The number of a program: the first one is where the machine starts.
                if !self.written.is_empty() {
                    self.forget();
                }
                // Words may stand behind it.
                said.words.iter().filter(|word| word.address() != Some(b'N')).count() == 1
            }
            // A program number stands alone; with words it is a block number.
            (b":", _) if said.words.len() == 1 => {
                if !self.written.is_empty() {
                    self.forget();
                }
                true
            }
            (b"PROC", _) => {
                self.forget();
                true
            }
            (b"IF", _) => {
                // A jump may go away; what stands here holds where it does not.
                true
            }
            (
                b"WHILE" | b"DO" | b"END" | b"ELSE" | b"ENDIF" | b"ENDWHILE" | b"FOR" | b"ENDFOR" | b"LOOP"
                | b"ENDLOOP" | b"REPEAT" | b"UNTIL" | b"CASE",
                _,
            ) => {
                self.forget();
                true
            }
            _ if name.starts_with(b"GOTO") => true,
            _ if name.starts_with(b"REPEAT") => {
                self.subprogram(said, "REPEAT");
                true
            }
            (b"CALL" | b"PCALL" | b"EXTCALL" | b"MCALL" | b"EXECSTRING", _) => {
                let text = String::from_utf8_lossy(&name).into_owned();
                self.subprogram(said, &text);
                if &*name == b"MCALL" {
                    // After every motion from here on; alone it ends that.
                    let words = said.words.iter().filter(|word| word.address() != Some(b'N')).count();
                    self.state.calls = (words > 1).then_some(Reason::Subprogram);
                }
                true
            }
            (_, Some(b'L')) if self.dialect == Dialect::Siemens && first.belongs != Belongs::Nothing => {
                self.subprogram(said, "L");
                true
            }
            (b"DEF" | b"EXTERN" | b"DEFINE", _) => true,
            _ => false,
        }
    }

    /// A call: listed, and what it leaves behind is not known.
    pub(super) fn subprogram(&mut self, said: &Said<'_>, name: &str) {
        self.left(said, name, Reason::Subprogram);
        self.forget();
    }
}
