//! A first scan of the whole file before interpretation: jump targets, declarations, programs, kinds of tool change.

use super::super::dialect::Dialect;
use super::super::expression::{Variable, literal, numbered};
use super::super::parser::word;
use super::super::syntax::{Syntax, Word, WordValue};
use super::super::token::Token;
use super::{Interpreter, code};

impl Interpreter<'_, '_> {
    /// Scans the whole file.
    pub(super) fn prescan(&mut self) {
        self.prescan_tape();
        let mut prescan = Prescan::default();
        for node in 0..self.tree.nodes.len() {
            match self.tree.nodes.kind(node) {
                kind @ (Syntax::Block | Syntax::Skippable) => {
                    self.prescan_block(&mut prescan);
                    prescan.block.skippable = kind == Syntax::Skippable;
                }
                Syntax::Word => self.prescan_word(&mut prescan, &word(self.tree, node)),
                _ => {}
            }
        }
        self.prescan_block(&mut prescan);
        self.scan.restarts_at_end =
            self.dialect != Dialect::Heidenhain && prescan.m99_alone && prescan.programs <= 1;
        let subs = prescan.subs;
        self.scan.is_subprogram |= match self.dialect {
            Dialect::Heidenhain => false,
            Dialect::LinuxCnc => subs.returns == Some(true) || subs.has && !subs.outside,
            _ => subs.returns == Some(true),
        };
    }

    /// The tape line: `%NAME G71 *` is DIN/ISO of Heidenhain, `$NAME.MIN%` Okuma, both with G codes of other
    /// meanings; `%_N_NAME_SPF` is a subprogram of Siemens.
    fn prescan_tape(&mut self) {
        let tape = (0..self.tree.len() as u32).find(|&token| self.tree.kind(token) == Some(Token::Tape));
        let text = tape.map(|token| self.tree.text(token).to_ascii_uppercase()).unwrap_or_default();
        let mut words = text.split(u8::is_ascii_whitespace);
        self.scan.unknown_control = self.dialect.paren_comments()
            && (text.first() == Some(&b'$') || words.any(|word| matches!(word, b"G70" | b"G71")));
        self.scan.is_subprogram |= text.windows(4).any(|part| part == b"_SPF");
        self.scan.is_subprogram &= self.dialect == Dialect::Siemens;
    }

    fn prescan_word(&mut self, prescan: &mut Prescan, word: &Word<'_>) {
        let Prescan { block, subs, jump, programs, .. } = prescan;
        let number = match word.value {
            WordValue::Literal { sign: None, number } => literal(self.tree.text(number)),
            _ => None,
        };
        let address = word.address();
        let moves_or_sets =
            address.is_some_and(|letter| b"GXYZABCUVWTFS".contains(&letter)) || word.is("CALL");
        block.acts |= moves_or_sets;
        block.sub |= word.is("SUB");
        block.endsub |= word.is("ENDSUB");
        block.returns |= word.is("RET");
        if matches!(address, Some(b'O' | b':')) {
            block.program = Some(match number {
                Some(number) if self.dialect != Dialect::LinuxCnc => numbered(b"O", number),
                _ => self.tree.source()[self.tree.range(word.first, word.end)].to_ascii_uppercase(),
            });
        }
        if std::mem::replace(&mut block.defines, word.is("DEFINE")) {
            self.scan.macros.insert(word.name.to_ascii_uppercase());
        }
        if std::mem::take(jump) {
            // GOTO N100: the block number is a separate word.
            match (address, number) {
                (Some(b'N'), Some(number)) => {
                    self.scan.jump_targets.insert(number as u64);
                    return;
                }
                // A label; anything else is computed.
                (None, _)
                    if word.name.first().is_some_and(|byte| byte.is_ascii_alphabetic() || *byte == b'_') => {}
                _ => self.scan.computed_jump = true,
            }
        }
        match (address, number) {
            (Some(b'M'), Some(number)) => self.prescan_m_word(block, number),
            (Some(b'G'), Some(number)) => block.cycle |= matches!(code(number), 700..=730),
            (Some(b'P'), Some(number)) => block.p = Some(number as u64),
            (Some(b'Q'), Some(number)) => block.q = Some(number as u64),
            (Some(b'H'), Some(number)) => block.h = Some(number as u64),
            (Some(b'P'), None) => block.computed.0 |= word.value != WordValue::Absent,
            (Some(b'Q' | b'H'), None) => block.computed.1 |= word.value != WordValue::Absent,
            (Some(b'O'), Some(_)) => *programs += 1,
            // Parameters of a procedure are declared names too.
            (None, _) if word.is("PROC") => {
                block.declares = true;
                self.scan.is_subprogram |= self.dialect == Dialect::Siemens && !subs.outside;
            }
            (None, _) if block.declares && matches!(word.value, WordValue::Arguments { .. }) => {
                for at in word.first..word.end {
                    if self.tree.kind(at) == Some(Token::Name) {
                        self.declare(block, self.tree.text(at));
                    }
                }
            }
            (None, _) if word.is("DEF") || block.declares => {
                block.declares = true;
                self.declare(block, word.name);
            }
            (None, number) if word.name.len() >= 4 && word.name[..4].eq_ignore_ascii_case(b"GOTO") => {
                match number {
                    Some(number) => {
                        self.scan.jump_targets.insert(number as u64);
                    }
                    None if word.value == WordValue::Absent && word.index.is_none() => *jump = true,
                    None => self.scan.computed_jump = true,
                }
            }
            _ => {}
        }
    }

    fn prescan_m_word(&mut self, block: &mut BlockSummary, number: f64) {
        self.scan.tool_change_by_m6 |= number == 6.0;
        block.ends |= number == 2.0 || number == 30.0;
        block.returns |= number == 17.0 && self.dialect == Dialect::Siemens;
        block.m99 |= number == 99.0;
        // Haas: a jump within the program. Fanuc and Mitsubishi start a subprogram at a block that may be here.
        block.jumps |= matches!(number as u32, 46 | 96 | 97);
        block.calls |= matches!(number as u32, 98 | 198);
    }

    /// A name in a declaration: a type, or a variable of that type.
    fn declare(&mut self, block: &mut BlockSummary, name: &[u8]) {
        let name = name.to_ascii_uppercase();
        match &*name {
            b"INT" | b"BOOL" | b"CHAR" => block.integer_type = true,
            b"REAL" | b"STRING" | b"AXIS" | b"FRAME" => block.integer_type = false,
            _ if block.integer_type => {
                self.scan.integer_variables.insert(name.clone());
            }
            _ => {}
        }
        self.scan.declared.insert(name);
    }

    /// Evaluates a block after its last word.
    fn prescan_block(&mut self, prescan: &mut Prescan) {
        let block = std::mem::take(&mut prescan.block);
        prescan.subs.add(&block);
        prescan.m99_alone |= block.m99 && block.p.is_none();
        if self.dialect == Dialect::Heidenhain {
            return;
        }
        if block.sub || self.dialect != Dialect::LinuxCnc {
            self.scan.programs.extend(block.program);
        }
        if block.m99 || block.jumps {
            self.scan.jump_targets.extend(block.p);
        }
        if block.calls {
            self.scan.jump_targets.extend([block.q, block.h].into_iter().flatten());
        }
        self.scan.computed_jump |=
            block.computed.0 && (block.m99 || block.jumps) || block.computed.1 && block.calls;
        if block.cycle
            && let (Some(p), Some(q)) = (block.p, block.q)
        {
            self.scan.contours.entry(p).or_insert(q);
        }
    }
}

/// The state of the scan.
#[derive(Default)]
struct Prescan {
    /// The current block.
    block: BlockSummary,
    subs: Subs,
    /// GOTO has been read, but not its target.
    jump: bool,
    /// How many programs begin (O and a number).
    programs: usize,
    /// Whether there is an M99 without a target block.
    m99_alone: bool,
}

/// The words of a block that matter to the scan.
#[derive(Default)]
struct BlockSummary {
    /// M99.
    m99: bool,
    /// M46, M96, M97.
    jumps: bool,
    /// M98.
    calls: bool,
    /// G70 to G73.
    cycle: bool,
    /// DEF.
    declares: bool,
    /// The word before was DEFINE.
    defines: bool,
    /// INT, BOOL or CHAR.
    integer_type: bool,
    /// Block skip.
    skippable: bool,
    /// M2, M30.
    ends: bool,
    /// M17, RET.
    returns: bool,
    /// O sub, O endsub.
    sub: bool,
    endsub: bool,
    /// Words that set or move something.
    acts: bool,
    /// O and its number or name.
    program: Option<Variable>,
    p: Option<u64>,
    q: Option<u64>,
    h: Option<u64>,
    /// Whether P, and Q or H, are computed at run time.
    computed: (bool, bool),
}

/// Whether a file is only a subprogram.
#[derive(Default)]
struct Subs {
    /// Whether its first end returns to a caller.
    returns: Option<bool>,
    /// Whether it has O sub.
    has: bool,
    /// Whether anything is done outside of subprograms.
    outside: bool,
    within: bool,
}

impl Subs {
    fn add(&mut self, block: &BlockSummary) {
        self.has |= block.sub;
        self.within |= block.sub;
        self.outside |= block.acts && !self.within;
        self.within &= !block.endsub;
        if block.skippable || self.returns.is_some() {
            return;
        }
        if block.ends {
            self.returns = Some(false);
        } else if block.returns || block.m99 && block.p.is_none() && !block.computed.0 {
            self.returns = Some(true);
        }
    }
}
