//! Statements: open blocks on a stack; after a broken statement the parser skips to the beginning of the next.

pub(super) mod ahead;
mod control_flow;
mod declaration;
mod expression;
mod keywords;

use crate::motion::OpaqueReason;
use crate::rapid::syntax::Syntax;
use crate::rapid::token::{Token, same_name};
use crate::tree::nodes::Nodes;
use crate::tree::{Opaque, Tree};

/// Greatest nesting depth of blocks.
const BLOCK_DEPTH: usize = 100;

struct Fail(OpaqueReason);

type Parsed = Result<(), Fail>;

#[derive(Clone, Copy)]
struct Block {
    kind: Syntax,
    node: u32,
    /// The token that opened it.
    opener: u32,
}

/// Reads statements, one after another.
pub(crate) struct Parser<'t, 's> {
    tree: &'t Tree<'s, Token, Syntax>,
    kinds: &'t [Token],
    /// The next token that is no trivia.
    at: u32,
    /// One past the last consumed token that is no trivia.
    last: u32,
    depth: u32,
    pub(super) nodes: Nodes<Syntax>,
    pub(super) opaque: Vec<Opaque>,
    blocks: Vec<Block>,
}

impl<'t, 's> Parser<'t, 's> {
    pub(super) fn new(tree: &'t Tree<'s, Token, Syntax>) -> Self {
        let kinds = tree.kinds();
        let mut parser = Parser {
            tree,
            kinds,
            at: 0,
            last: 0,
            depth: 0,
            nodes: Nodes::with_capacity(kinds.len() / 3),
            opaque: Vec::new(),
            blocks: Vec::new(),
        };
        parser.skip_trivia();
        parser
    }

    // ---- tokens ----

    #[inline]
    fn skip_trivia(&mut self) {
        while self.kinds.get(self.at as usize).is_some_and(|kind| kind.is_trivia()) {
            self.at += 1;
        }
    }

    #[inline]
    fn peek(&self) -> Token {
        self.kinds.get(self.at as usize).copied().unwrap_or(Token::End)
    }

    /// The token after the next, trivia left out.
    fn peek_second(&self) -> Token {
        self.kinds
            .get(self.at as usize + 1..)
            .and_then(|rest| rest.iter().find(|kind| !kind.is_trivia()))
            .copied()
            .unwrap_or(Token::End)
    }

    #[inline]
    fn bump(&mut self) {
        if (self.at as usize) < self.kinds.len() {
            self.at += 1;
            self.last = self.at;
            self.skip_trivia();
        }
    }

    /// Consumes so many tokens, of which none is trivia and behind which there is none.
    #[inline]
    fn advance(&mut self, tokens: u32) {
        self.at += tokens;
        self.last = self.at;
    }

    #[inline]
    fn eat(&mut self, kind: Token) -> bool {
        let found = self.peek() == kind;
        if found {
            self.bump();
        }
        found
    }

    fn expect(&mut self, kind: Token, reason: OpaqueReason) -> Parsed {
        if self.eat(kind) { Ok(()) } else { Err(Fail(reason)) }
    }

    /// Whether the next token begins a line.
    fn begins_line(&self) -> bool {
        let between = self.tree.range(self.last, self.at);
        self.tree.source()[between].contains(&b'\n')
    }

    /// A name, or the placeholder that stands for one.
    fn name(&mut self) -> Parsed {
        if matches!(self.peek(), Token::Ident | Token::Placeholder) {
            self.bump();
            Ok(())
        } else {
            Err(Fail(OpaqueReason::ExpectedName))
        }
    }

    fn at_word(&self, word: &[u8]) -> bool {
        self.peek() == Token::Ident && same_name(self.tree.text(self.at), word)
    }

    // ---- nodes ----

    #[inline]
    fn open(&mut self, kind: Syntax) -> u32 {
        self.nodes.open(kind, self.at)
    }

    #[inline]
    fn close(&mut self, node: u32) {
        // An empty node stands where the last token ended, inside its parent.
        let first = self.nodes.first(node).min(self.last);
        self.nodes.close(node, first, self.last);
    }

    /// Opens a node around everything since `node`, which began with token `first`.
    fn wrap(&mut self, kind: Syntax, node: u32, first: u32) {
        self.nodes.open_before(node, kind, first);
    }

    fn open_block(&mut self, kind: Syntax) {
        let node = self.open(kind);
        self.blocks.push(Block { kind, node, opener: self.at });
    }

    fn close_block(&mut self) {
        if let Some(block) = self.blocks.pop() {
            self.close(block.node);
        }
    }

    /// Closes blocks above the one at `index` that lack their END, then leaves that one on top.
    fn close_above(&mut self, index: usize) {
        while self.blocks.len() > index + 1 {
            let block = self.blocks[self.blocks.len() - 1];
            if block.kind.needs_end() {
                self.missing_end(block);
            }
            self.close_block();
        }
    }

    fn missing_end(&mut self, block: Block) {
        let reason = OpaqueReason::MissingEnd;
        self.opaque.push(Opaque { first: block.opener, end: block.opener + 1, reason, at: self.at });
    }

    /// After a complete statement: a compact IF ends with the statement it guards.
    fn statement_done(&mut self) {
        while self.blocks.last().is_some_and(|block| block.kind == Syntax::CompactIf) {
            self.close_block();
        }
    }

    /// Turns everything since token `first`, whose nodes begin at `node`, into an opaque region.
    fn recover(&mut self, node: u32, first: u32, reason: OpaqueReason) {
        let reason = if self.peek() == Token::OpenString { OpaqueReason::UnclosedString } else { reason };
        let (at, fresh) = (self.at, self.at == first);
        self.nodes.truncate(node);
        if fresh {
            self.bump();
        }
        let mut line = match reason {
            OpaqueReason::MissingSemicolon | OpaqueReason::UnclosedString => true,
            OpaqueReason::Unexpected => fresh,
            _ => false,
        };
        while self.peek() != Token::End {
            if line && self.last > first && self.begins_line() {
                break;
            }
            if self.eat(Token::Semicolon) || self.last > first && self.peek().begins_statement() {
                break;
            }
            line |= self.peek() == Token::OpenString;
            self.bump();
        }
        self.nodes.push(Syntax::Opaque, first, self.last.max(first));
        self.opaque.push(Opaque { first, end: self.last.max(first), reason, at });
    }

    // ---- file and blocks ----

    pub(super) fn begin(&mut self) {
        self.at = 0;
        self.open_block(Syntax::File);
        self.skip_trivia();
        if self.kinds == [Token::Unknown] {
            self.recover(1, 0, OpaqueReason::Binary);
        }
    }

    /// Items to the end of the file, or until one begins at or after a token.
    pub(super) fn items(&mut self, until: u32) {
        while self.at < until && self.peek() != Token::End {
            self.item();
        }
    }

    pub(super) fn finish(&mut self) {
        self.close_above(0);
        self.close_block();
        // What follows the last statement belongs to the file.
        self.nodes.close(0, 0, self.kinds.len() as u32);
        self.opaque.sort_by_key(|opaque| opaque.first);
    }

    fn item(&mut self) {
        let (node, first, blocks) = (self.nodes.len(), self.at, self.blocks.len());
        if let Err(Fail(reason)) = self.try_item() {
            if reason == OpaqueReason::StrayEnd {
                // One keyword only: what follows it can be read.
                self.bump();
                self.eat(Token::Semicolon);
                self.nodes.truncate(node);
                self.nodes.push(Syntax::Opaque, first, self.last);
                self.opaque.push(Opaque { first, end: self.last, reason, at: first });
            } else if reason == OpaqueReason::TooDeep && blocks >= BLOCK_DEPTH {
                self.skip_routine(first);
            } else {
                self.blocks.truncate(blocks);
                self.recover(node, first, reason);
            }
            self.statement_done();
        }
    }

    /// Blocks nest too deeply: everything to the end of the routine is opaque.
    fn skip_routine(&mut self, first: u32) {
        while !matches!(
            self.peek(),
            Token::End | Token::EndProc | Token::EndFunc | Token::EndTrap | Token::EndModule
        ) {
            self.bump();
        }
        self.nodes.push(Syntax::Opaque, first, self.last);
        self.opaque.push(Opaque { first, end: self.last, reason: OpaqueReason::TooDeep, at: first });
        // The blocks inside the routine end here without a further message.
        while self.blocks.last().is_some_and(|block| block.kind.is_statement_block()) {
            self.close_block();
        }
    }

    fn try_item(&mut self) -> Parsed {
        let compact = self.blocks.last().is_some_and(|block| block.kind == Syntax::CompactIf);
        match self.peek() {
            Token::Module => self.module(),
            Token::EndModule => self.end(|kind| kind == Syntax::Module),
            Token::Local => match self.peek_second() {
                Token::Proc | Token::Func | Token::Trap => self.routine(),
                Token::Record => self.record(),
                Token::Alias => self.alias(),
                _ => self.data(),
            },
            Token::Var | Token::Pers | Token::Const => self.data(),
            Token::Proc | Token::Func | Token::Trap => self.routine(),
            Token::EndProc => self.end(|kind| kind == Syntax::Proc),
            Token::EndFunc => self.end(|kind| kind == Syntax::Func),
            Token::EndTrap => self.end(|kind| kind == Syntax::Trap),
            Token::Record => self.record(),
            Token::Alias => self.alias(),
            Token::Error | Token::Undo | Token::Backward => self.clause(),
            Token::ElseIf | Token::Else => self.branch(),
            Token::EndIf => self.end(|kind| kind == Syntax::If),
            Token::EndFor => self.end(|kind| kind == Syntax::For),
            Token::EndWhile => self.end(|kind| kind == Syntax::While),
            Token::EndTest => self.end(|kind| kind == Syntax::Test),
            Token::Case | Token::Default => self.case(),
            Token::If | Token::For | Token::While | Token::Test if self.blocks.len() >= BLOCK_DEPTH => {
                Err(Fail(OpaqueReason::TooDeep))
            }
            Token::If => self.condition(),
            Token::For => self.for_loop(),
            Token::While => self.while_loop(),
            Token::Test => self.test(),
            Token::Semicolon => {
                self.bump();
                self.statement_done();
                Ok(())
            }
            Token::EndRecord => Err(Fail(OpaqueReason::StrayEnd)),
            _ => {
                let result = self.statement();
                if result.is_ok() && compact {
                    self.statement_done();
                }
                result
            }
        }
    }

    fn module(&mut self) -> Parsed {
        self.close_above(0);
        self.open_block(Syntax::Module);
        self.bump();
        let header = (self.nodes.len(), self.at);
        let result = self.module_header();
        self.header_done(header, result);
        Ok(())
    }

    fn module_header(&mut self) -> Parsed {
        self.name()?;
        if self.peek() == Token::ParenOpen {
            let node = self.open(Syntax::Attributes);
            self.bump();
            while self.peek() == Token::Comma
                || self.peek() == Token::Ident
                || self.peek().is_keyword() && !self.peek().begins_statement()
            {
                self.bump();
            }
            self.expect(Token::ParenClose, OpaqueReason::Unclosed)?;
            self.close(node);
        }
        Ok(())
    }

    /// A broken header of a block is opaque to the end of its line; the block stays open.
    fn header_done(&mut self, (node, first): (u32, u32), result: Parsed) {
        if let Err(Fail(reason)) = result {
            let at = self.at;
            self.nodes.truncate(node);
            let first = first.min(at);
            while self.peek() != Token::End
                && !self.begins_line()
                && !matches!(self.peek(), Token::Then | Token::Do)
            {
                self.bump();
            }
            if matches!(self.peek(), Token::Then | Token::Do) {
                self.bump();
            }
            let end = self.last.max(first + 1).min(self.kinds.len() as u32);
            self.opaque.push(Opaque { first, end, reason, at });
        }
    }

    /// An END: closes the nearest open block that `wanted` accepts, inside the current routine.
    fn end(&mut self, wanted: impl Fn(Syntax) -> bool) -> Parsed {
        let inner = |kind: Syntax| kind.is_statement_block();
        let is_block_end =
            matches!(self.peek(), Token::EndIf | Token::EndFor | Token::EndWhile | Token::EndTest);
        for index in (1..self.blocks.len()).rev() {
            let kind = self.blocks[index].kind;
            if wanted(kind) {
                self.close_above(index);
                self.bump();
                self.close_block();
                if is_block_end {
                    self.statement_done();
                }
                return Ok(());
            }
            if is_block_end && !inner(kind) {
                break;
            }
        }
        Err(Fail(OpaqueReason::StrayEnd))
    }

    fn routine(&mut self) -> Parsed {
        // A routine inside a routine: the END of the outer one is missing.
        let module = self.blocks.iter().rposition(|block| block.kind == Syntax::Module).unwrap_or(0);
        self.close_above(module);
        let word = if self.peek() == Token::Local { self.peek_second() } else { self.peek() };
        let kind = match word {
            Token::Proc => Syntax::Proc,
            Token::Func => Syntax::Func,
            _ => Syntax::Trap,
        };
        self.open_block(kind);
        self.eat(Token::Local);
        self.bump();
        let header = (self.nodes.len(), self.at);
        let result = self.routine_header(kind);
        self.header_done(header, result);
        self.open_block(Syntax::Body);
        Ok(())
    }

    fn clause(&mut self) -> Parsed {
        let Some(index) = self.blocks.iter().rposition(|block| block.kind.is_routine()) else {
            return Err(Fail(OpaqueReason::Unexpected));
        };
        self.close_above(index);
        self.open_block(match self.peek() {
            Token::Error => Syntax::ErrorClause,
            Token::Undo => Syntax::UndoClause,
            _ => Syntax::BackwardClause,
        });
        self.bump();
        if self.peek() == Token::ParenOpen {
            let header = (self.nodes.len(), self.at);
            let result = self.expression_list(Token::ParenOpen, Token::ParenClose);
            self.header_done(header, result);
        }
        Ok(())
    }

    // ---- simple statements ----

    fn statement(&mut self) -> Parsed {
        let node = self.open(Syntax::Call);
        let kind = match self.peek() {
            Token::Ident => match self.peek_second() {
                Token::Colon => {
                    self.bump();
                    self.bump();
                    self.nodes.set_kind(node, Syntax::Label);
                    self.close(node);
                    return Ok(());
                }
                Token::Assign | Token::Dot | Token::BraceOpen => self.assignment()?,
                Token::Var | Token::Pers if self.at_word(b"TASK") => {
                    self.nodes.truncate(node);
                    return self.data();
                }
                _ => {
                    self.bump();
                    self.arguments()?;
                    Syntax::Call
                }
            },
            Token::Percent => {
                self.bump();
                self.expression()?;
                self.expect(Token::Percent, OpaqueReason::Unexpected)?;
                self.eat(Token::Comma);
                self.arguments()?;
                Syntax::LateCall
            }
            Token::Placeholder if self.peek_second() == Token::Assign => self.assignment()?,
            Token::Placeholder => {
                self.bump();
                self.eat(Token::Semicolon);
                self.nodes.set_kind(node, Syntax::Unwritten);
                self.close(node);
                return Ok(());
            }
            Token::Goto => {
                self.bump();
                self.name()?;
                Syntax::Goto
            }
            Token::Return => {
                self.bump();
                if self.peek() != Token::Semicolon {
                    self.expression()?;
                }
                Syntax::Return
            }
            Token::Raise => {
                self.bump();
                if self.peek() != Token::Semicolon {
                    self.expression()?;
                }
                Syntax::Raise
            }
            Token::Exit | Token::Retry | Token::TryNext => {
                self.bump();
                Syntax::Leave
            }
            Token::Connect => {
                self.bump();
                self.expression()?;
                self.expect(Token::With, OpaqueReason::Unexpected)?;
                self.expression()?;
                Syntax::Connect
            }
            _ => return Err(Fail(OpaqueReason::Unexpected)),
        };
        self.nodes.set_kind(node, kind);
        self.expect(Token::Semicolon, OpaqueReason::MissingSemicolon)?;
        self.close(node);
        Ok(())
    }

    fn assignment(&mut self) -> Result<Syntax, Fail> {
        self.primary()?;
        self.expect(Token::Assign, OpaqueReason::Unexpected)?;
        self.expression()?;
        Ok(Syntax::Assignment)
    }
}
