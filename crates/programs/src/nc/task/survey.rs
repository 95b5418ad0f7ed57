//! What the whole file sets, and where its jumps go: read once before the blocks are followed.

use super::super::dialect::Dialect;
use super::super::expression::{Variable, literal, numbered};
use super::super::parser::word;
use super::super::syntax::{Belongs, Syntax, Word};
use super::super::token::Token;
use super::{Lister, code};

impl Lister<'_, '_> {
    /// What the whole file sets, and where its jumps go.
    pub(super) fn survey(&mut self) {
        self.survey_tape();
        let mut survey = Survey::default();
        for node in 0..self.tree.nodes.len() as u32 {
            match self.tree.nodes[node as usize].kind {
                kind @ (Syntax::Block | Syntax::Skippable) => {
                    self.survey_block(&mut survey);
                    survey.block.skippable = kind == Syntax::Skippable;
                }
                Syntax::Word => self.survey_word(&mut survey, &word(self.tree, node)),
                _ => {}
            }
        }
        self.survey_block(&mut survey);
        self.repeats = survey.back && survey.programs <= 1;
        let subs = survey.subs;
        self.called |= match self.dialect {
            Dialect::Heidenhain => false,
            Dialect::LinuxCnc => subs.returns == Some(true) || subs.has && !subs.outside,
            _ => subs.returns == Some(true),
        };
    }

    /// What the first line says: `%NAME G71 *` is DIN/ISO of Heidenhain, `$NAME.MIN%` Okuma, whose G words have meanings of their
    /// own; `%_N_NAME_SPF` is a subprogram of Siemens.
    fn survey_tape(&mut self) {
        let tape = (0..self.tree.len() as u32).find(|&token| self.tree.kind(token) == Some(Token::Tape));
        let text = tape.map(|token| self.tree.text(token).to_ascii_uppercase()).unwrap_or_default();
        let mut words = text.split(u8::is_ascii_whitespace);
        self.foreign = self.dialect.paren_comments()
            && (text.first() == Some(&b'$') || words.any(|word| matches!(word, b"G70" | b"G71")));
        self.called |= text.windows(4).any(|part| part == b"_SPF");
        self.called &= self.dialect == Dialect::Siemens;
    }

    fn survey_word(&mut self, survey: &mut Survey, said: &Word<'_>) {
        let Survey { block, subs, jump, programs, .. } = survey;
        let number = match said.belongs {
            Belongs::Literal { sign: None, number } => literal(self.tree.text(number)),
            _ => None,
        };
        let address = said.address();
        let moves_or_sets =
            address.is_some_and(|letter| b"GXYZABCUVWTFS".contains(&letter)) || said.is("CALL");
        block.does |= moves_or_sets;
        block.sub |= said.is("SUB");
        block.endsub |= said.is("ENDSUB");
        block.returns |= said.is("RET");
        if matches!(address, Some(b'O' | b':')) {
            block.program = Some(match number {
                Some(number) if self.dialect != Dialect::LinuxCnc => numbered(b"O", number),
                _ => self.tree.source()[self.tree.range(said.first, said.end)].to_ascii_uppercase(),
            });
        }
        if std::mem::take(jump) {
            // GOTO N100: the block number stands in a word of its own.
            match (address, number) {
                (Some(b'N'), Some(number)) => {
                    self.targets.insert(number as u64);
                    return;
                }
                // A label; anything else is computed.
                (None, _)
                    if said.name.first().is_some_and(|byte| byte.is_ascii_alphabetic() || *byte == b'_') => {}
                _ => self.anywhere = true,
            }
        }
        match (address, number) {
            (Some(b'M'), Some(number)) => self.survey_m_word(block, number),
            (Some(b'G'), Some(number)) => block.cycle |= matches!(code(number), 700..=730),
            (Some(b'P'), Some(number)) => block.p = Some(number as u64),
            (Some(b'Q'), Some(number)) => block.q = Some(number as u64),
            (Some(b'H'), Some(number)) => block.h = Some(number as u64),
            (Some(b'P'), None) => block.computed.0 |= said.belongs != Belongs::Nothing,
            (Some(b'Q' | b'H'), None) => block.computed.1 |= said.belongs != Belongs::Nothing,
            (Some(b'O'), Some(_)) => *programs += 1,
            // What the caller hands over has names too.
            (None, _) if said.is("PROC") => {
                block.declares = true;
                self.called |= self.dialect == Dialect::Siemens && !subs.outside;
            }
            (None, _) if block.declares && matches!(said.belongs, Belongs::Arguments { .. }) => {
                for at in said.first..said.end {
                    if self.tree.kind(at) == Some(Token::Name) {
                        self.declare(block, self.tree.text(at));
                    }
                }
            }
            (None, _) if said.is("DEF") || block.declares => {
                block.declares = true;
                self.declare(block, said.name);
            }
            (None, number) if said.name.len() >= 4 && said.name[..4].eq_ignore_ascii_case(b"GOTO") => {
                match number {
                    Some(number) => {
                        self.targets.insert(number as u64);
                    }
                    None if said.belongs == Belongs::Nothing && said.index.is_none() => *jump = true,
                    None => self.anywhere = true,
                }
            }
            _ => {}
        }
    }

    fn survey_m_word(&mut self, block: &mut Block, number: f64) {
        self.changes_tools |= number == 6.0;
        block.ends |= number == 2.0 || number == 30.0;
        block.returns |= number == 17.0 && self.dialect == Dialect::Siemens;
        block.back |= number == 99.0;
        // Haas: to a block of the same program. Fanuc and Mitsubishi begin a subprogram at a block, which may be here.
        block.jumps |= matches!(number as u32, 46 | 96 | 97);
        block.calls |= matches!(number as u32, 98 | 198);
    }

    /// A name of a declaration: a type, or what is of that type.
    fn declare(&mut self, block: &mut Block, name: &[u8]) {
        let name = name.to_ascii_uppercase();
        match &*name {
            b"INT" | b"BOOL" | b"CHAR" => block.whole = true,
            b"REAL" | b"STRING" | b"AXIS" | b"FRAME" => block.whole = false,
            _ if block.whole => {
                self.whole_numbers.insert(name.clone());
            }
            _ => {}
        }
        self.declared.insert(name);
    }

    /// A block is read: what it says together.
    fn survey_block(&mut self, survey: &mut Survey) {
        let block = std::mem::take(&mut survey.block);
        survey.subs.add(&block);
        survey.back |= block.back && block.p.is_none();
        if self.dialect == Dialect::Heidenhain {
            return;
        }
        if block.sub || self.dialect != Dialect::LinuxCnc {
            self.programs.extend(block.program);
        }
        if block.back || block.jumps {
            self.targets.extend(block.p);
        }
        if block.calls {
            self.targets.extend([block.q, block.h].into_iter().flatten());
        }
        self.anywhere |= block.computed.0 && (block.back || block.jumps) || block.computed.1 && block.calls;
        if block.cycle
            && let (Some(p), Some(q)) = (block.p, block.q)
        {
            self.contours.entry(p).or_insert(q);
        }
    }

    /// Whether the program begins again at its end (M99 in one that calls nothing).
    pub(super) fn repeats(&self) -> bool {
        self.dialect != Dialect::Heidenhain && self.repeats
    }
}

/// What has been read so far.
#[derive(Default)]
struct Survey {
    /// The block that is being read.
    block: Block,
    subs: Subs,
    /// GOTO has been read, and not yet where to.
    jump: bool,
    /// How many programs begin (O and a number).
    programs: usize,
    /// Whether M99 stands in it without a block to go to.
    back: bool,
}

/// What a block says that the survey looks at.
#[derive(Default)]
struct Block {
    /// M99.
    back: bool,
    /// M46, M96, M97.
    jumps: bool,
    /// M98.
    calls: bool,
    /// G70 to G73.
    cycle: bool,
    /// DEF.
    declares: bool,
    /// INT, BOOL or CHAR.
    whole: bool,
    /// The block may be skipped.
    skippable: bool,
    /// M2, M30.
    ends: bool,
    /// M17, RET.
    returns: bool,
    /// O sub, O endsub.
    sub: bool,
    endsub: bool,
    /// Words that set or move something.
    does: bool,
    /// O and its number or name.
    program: Option<Variable>,
    p: Option<u64>,
    q: Option<u64>,
    h: Option<u64>,
    /// Whether P, and Q or H, are worked out while the program runs.
    computed: (bool, bool),
}

/// Whether a file is a subprogram and no more.
#[derive(Default)]
struct Subs {
    /// Whether its first end goes back to a caller.
    returns: Option<bool>,
    /// Whether it has O sub.
    has: bool,
    /// Whether anything is done outside of these.
    outside: bool,
    within: bool,
}

impl Subs {
    fn add(&mut self, block: &Block) {
        self.has |= block.sub;
        self.within |= block.sub;
        self.outside |= block.does && !self.within;
        self.within &= !block.endsub;
        if block.skippable || self.returns.is_some() {
            return;
        }
        if block.ends {
            self.returns = Some(false);
        } else if block.returns || block.back && block.p.is_none() && !block.computed.0 {
            self.returns = Some(true);
        }
    }
}
