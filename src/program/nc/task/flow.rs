//! Jumps, loops, subprograms, and the values of variables.

use super::super::dialect::Dialect;
use super::super::expression::{Variable, numbered};
use super::super::syntax::Belongs;
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
        let conditional = said.words.iter().any(|word| word.is("IF"));
        for word in &said.words {
            if !word.assigned {
                continue;
            }
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
                _ => continue,
            };
            let value = match word.belongs {
                _ if self.actions => Err(Reason::Variable),
                _ if conditional => Err(Reason::UnknownFlow),
                Belongs::Literal { .. } => self.literal(word).ok_or(Reason::WrongShape),
                Belongs::Expression { first, end } => self.evaluated((first, end)),
                _ => Err(Reason::WrongShape),
            };
            match name {
                Some(name) => {
                    self.state.variables.insert(name, value);
                }
                // Any of them.
                None => self.state.variables.values_mut().for_each(|value| *value = Err(Reason::Variable)),
            }
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
                true
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
