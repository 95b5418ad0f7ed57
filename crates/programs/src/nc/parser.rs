//! The parser: tokens to a tree of blocks (lines) and words. Never fails: unreadable text is opaque to the end of its
//! line.

use super::dialect::Dialect;
use super::expression::{Evaluated, Evaluator, is_function};
use super::lexer::lex;
use super::syntax::{NcTree, Syntax, Word, WordValue};
use super::token::Token;
use crate::motion::{OpaqueReason, Reason};
use crate::tree::nodes::Nodes;
use crate::tree::{Node, Opaque};

/// Parses one file.
pub fn parse(source: &[u8], dialect: Dialect) -> NcTree<'_> {
    let mut tree = lex(source, dialect);
    let (nodes, opaque) = {
        let mut parser =
            Parser { tree: &tree, dialect, at: 0, nodes: Nodes::default(), opaque: Vec::new(), free: false };
        parser.file();
        (parser.nodes, parser.opaque)
    };
    (tree.nodes, tree.opaque) = (nodes, opaque);
    tree
}

struct Parser<'t, 's> {
    tree: &'t NcTree<'s>,
    dialect: Dialect,
    at: u32,
    nodes: Nodes<Syntax>,
    opaque: Vec<Opaque>,
    /// Whether the block has names, beside which numbers and brackets may stand alone.
    free: bool,
}

impl Parser<'_, '_> {
    fn peek(&self) -> Token {
        self.tree.kind(self.at).unwrap_or(Token::End)
    }

    /// Skips white space and comments within the line.
    fn skip(&mut self) {
        while matches!(self.peek(), Token::Space | Token::Comment) {
            self.at += 1;
        }
    }

    fn bump(&mut self) {
        self.at += 1;
        self.skip();
    }

    /// Consumes one token; returns one past it.
    fn token(&mut self) -> Option<u32> {
        let end = self.at + 1;
        self.bump();
        Some(end)
    }

    /// Consumes an index in brackets, and the value that is assigned to it.
    fn index(&mut self) -> Option<u32> {
        let end = self.group(Token::BracketOpen, Token::BracketClose)?;
        if self.peek() != Token::Equal {
            return Some(end);
        }
        self.bump();
        self.expression()
    }

    fn file(&mut self) {
        let file = self.nodes.open(Syntax::File, 0);
        if self.tree.kinds() == [Token::Unknown] {
            self.nodes.push(Syntax::Opaque, 0, 1);
            self.opaque.push(Opaque { first: 0, end: 1, reason: OpaqueReason::Binary, at: 0 });
        } else {
            while self.peek() != Token::End {
                match self.peek() {
                    kind if kind.is_trivia() => self.at += 1,
                    _ => self.block(),
                }
            }
        }
        self.nodes.close(file, 0, self.tree.len() as u32);
    }

    fn block(&mut self) {
        let first = self.at;
        let node = self.nodes.open(Syntax::Block, first);
        if self.peek() == Token::Slash {
            self.nodes.set_kind(node, Syntax::Skippable);
            self.bump();
            // The skip level.
            if self.peek() == Token::Number {
                self.bump();
            }
        }
        if self.dialect == Dialect::Heidenhain {
            if self.peek() == Token::Number {
                self.bump();
            }
            // `5 /L X+60`: the skip mark may follow the block number.
            if self.peek() == Token::Slash {
                self.nodes.set_kind(node, Syntax::Skippable);
                self.bump();
            }
        }
        let mut last = self.at;
        let begins = self.at;
        let mut free = false;
        while !matches!(self.peek(), Token::LineEnd | Token::End) {
            if self.peek() == Token::Slash && self.at > begins && self.dialect != Dialect::Heidenhain {
                // `N10 /X5`: the rest of the block may be skipped.
                self.nodes.set_kind(node, Syntax::Skippable);
                let slash = self.at;
                self.bump();
                if self.peek() == Token::Number && self.touches(slash + 1) {
                    self.bump();
                }
                continue;
            }
            let at = self.at;
            // Numbers, strings and brackets stand alone only beside names: IF, CASE, DEF, o100 call.
            free |= self.peek() == Token::Name
                || self.peek() == Token::Address && self.at == begins && self.is_o()
                || self.peek() == Token::Hash && self.dialect == Dialect::Siemens;
            self.free = free;
            let word = self.nodes.open(Syntax::Word, at);
            match self.word(at == begins) {
                Some(end) => {
                    self.nodes.close(word, at, end);
                    last = end;
                }
                None => {
                    while !matches!(self.peek(), Token::LineEnd | Token::End) {
                        self.at += 1;
                    }
                    let mut end = self.at;
                    while end > at + 1
                        && matches!(self.tree.kind(end - 1), Some(Token::Space | Token::Comment))
                    {
                        end -= 1;
                    }
                    self.nodes.set_kind(word, Syntax::Opaque);
                    self.nodes.close(word, at, end);
                    self.opaque.push(Opaque { first: at, end, reason: OpaqueReason::Unexpected, at });
                    last = end;
                }
            }
        }
        self.nodes.close(node, first, last.max(first + 1));
    }

    /// Parses one word; returns one past its last token.
    fn word(&mut self, begins: bool) -> Option<u32> {
        if begins && self.dialect == Dialect::Heidenhain && !self.is_path() {
            // Other than path blocks, Heidenhain blocks are one word.
            let at = self.at;
            return Some(self.line(at));
        }
        match self.peek() {
            Token::Address => {
                let token = self.at;
                self.bump();
                self.value(token + 1)
            }
            Token::Name if !self.is_name() => None,
            Token::Name => {
                let token = self.at;
                self.bump();
                self.named(token)
            }
            Token::Hash => {
                self.bump();
                match self.peek() {
                    Token::Name => self.bump(),
                    _ => {
                        let at = self.at;
                        self.value(at)?;
                    }
                }
                (self.peek() == Token::Equal).then_some(())?;
                self.bump();
                self.expression()
            }
            // `:100`, a program or main block number.
            Token::Colon => {
                let token = self.at;
                self.bump();
                if self.peek() == Token::Number {
                    return self.token();
                }
                Some(token + 1)
            }
            Token::Comma => {
                let token = self.at;
                self.bump();
                (self.free || self.peek() == Token::Address).then_some(token + 1)
            }
            Token::BracketOpen if self.free => self.group(Token::BracketOpen, Token::BracketClose),
            // G65 <NAME>, M98 <NAME>: a subprogram by its name.
            Token::Less if self.dialect.paren_comments() => {
                self.bump();
                while !matches!(self.peek(), Token::Greater | Token::LineEnd | Token::End) {
                    self.bump();
                }
                (self.peek() == Token::Greater).then_some(())?;
                self.token()
            }
            // The operand of a control structure: TO 10, OF 1, REPEAT 3.
            Token::Number | Token::Minus | Token::String if self.free => self.expression(),
            _ => None,
        }
    }

    /// Whether the block begins with an O word, whose line has other words.
    fn is_o(&self) -> bool {
        self.dialect == Dialect::LinuxCnc && matches!(self.tree.text(self.at), b"O" | b"o")
    }

    /// Whether a name belongs to these dialects; `XY5` does not.
    fn is_name(&self) -> bool {
        const NAMES: &str = "IF THEN ELSE ELSEIF ENDIF WHILE ENDWHILE DO END GOTO SUB ENDSUB CALL REPEAT ENDREPEAT RETURN \
            BREAK CONTINUE POPEN PCLOS DPRNT BPRNT SETVN LT GT EQ";
        let text = self.tree.text(self.at);
        !self.dialect.paren_comments()
            || text.starts_with(b"<")
            || NAMES.split(' ').any(|name| text.eq_ignore_ascii_case(name.as_bytes()))
    }

    /// Whether a Heidenhain block is a path or sets something that is interpreted word by word.
    fn is_path(&self) -> bool {
        let text = self.tree.text(self.at).to_ascii_uppercase();
        matches!(&*text, b"L" | b"LN" | b"C" | b"CC" | b"CR" | b"CT" | b"M" | b"R" | b"F")
            || matches!(&*text, [b'X' | b'Y' | b'Z' | b'A' | b'B' | b'U' | b'V' | b'W'])
            || matches!(&*text, [b'I', b'X' | b'Y' | b'Z' | b'A' | b'B' | b'C' | b'U' | b'V' | b'W'])
    }

    /// The value of an address: a literal, an expression, or nothing.
    fn value(&mut self, after: u32) -> Option<u32> {
        match self.peek() {
            Token::Number => self.token(),
            Token::Plus | Token::Minus => {
                let sign = self.at;
                self.bump();
                match self.peek() {
                    Token::Number => self.token(),
                    Token::Hash | Token::BracketOpen => self.primary(),
                    Token::Address | Token::Name
                        if self.dialect == Dialect::Heidenhain && self.at_parameter() =>
                    {
                        self.primary()
                    }
                    // DR+: a bare sign.
                    _ if self.dialect == Dialect::Heidenhain => Some(sign + 1),
                    _ => None,
                }
            }
            Token::Equal => {
                self.bump();
                self.expression()
            }
            Token::Hash => self.primary(),
            Token::BracketOpen if self.dialect != Dialect::Siemens => self.primary(),
            // R[5]=…
            Token::BracketOpen => self.index(),
            // XSQRT[16].
            Token::Name if self.dialect == Dialect::LinuxCnc && is_function(self.tree.text(self.at)) => {
                self.primary()
            }
            Token::Address | Token::Name
                if self.dialect == Dialect::Heidenhain && self.at_parameter() && self.touches(after) =>
            {
                self.primary()
            }
            Token::Name
                if self.dialect == Dialect::LinuxCnc
                    && self.tree.text(self.at).first() == Some(&b'<')
                    && self.touches(after) =>
            {
                // o<name>
                self.token()
            }
            _ => Some(after),
        }
    }

    fn touches(&self, after: u32) -> bool {
        self.at == after
    }

    fn at_parameter(&self) -> bool {
        matches!(&*self.tree.text(self.at).to_ascii_uppercase(), b"Q" | b"QL" | b"QR")
    }

    fn named(&mut self, token: u32) -> Option<u32> {
        let after = token + 1;
        match self.peek() {
            // A label.
            Token::Colon => self.token(),
            Token::Equal => {
                self.bump();
                self.expression()
            }
            Token::ParenOpen => self.group(Token::ParenOpen, Token::ParenClose),
            Token::BracketOpen => self.index(),
            Token::Number if self.touches(after) || self.dialect != Dialect::Heidenhain => self.token(),
            Token::Plus | Token::Minus if self.dialect == Dialect::Heidenhain => self.value(after),
            // GOTO#5: to a computed block.
            Token::Hash if self.tree.text(token).to_ascii_uppercase().starts_with(b"GOTO") => self.primary(),
            _ if self.takes_condition(token) => self.expression(),
            _ if self.is_action(token) => Some(self.line(after)),
            _ => Some(after),
        }
    }

    /// A synchronised action of Siemens, which runs concurrently with the blocks.
    fn is_action(&self, token: u32) -> bool {
        self.dialect == Dialect::Siemens
            && ["WHEN", "WHENEVER", "FROM", "EVERY"]
                .iter()
                .any(|word| self.tree.text(token).eq_ignore_ascii_case(word.as_bytes()))
    }

    /// Consumes the rest of the line; returns one past its last token that is not trivia.
    fn line(&mut self, after: u32) -> u32 {
        let mut end = after;
        while !matches!(self.peek(), Token::LineEnd | Token::End) {
            end = self.at + 1;
            self.bump();
        }
        end
    }

    fn takes_condition(&self, token: u32) -> bool {
        self.dialect == Dialect::Siemens
            && ["IF", "WHILE", "UNTIL", "CASE"]
                .iter()
                .any(|word| self.tree.text(token).eq_ignore_ascii_case(word.as_bytes()))
    }

    /// Skips brackets.
    fn group(&mut self, open: Token, close: Token) -> Option<u32> {
        let mut depth = 0_u32;
        loop {
            let kind = self.peek();
            if matches!(kind, Token::LineEnd | Token::End) {
                return None;
            }
            let end = self.at + 1;
            self.bump();
            if kind == open {
                depth += 1;
            } else if kind == close {
                depth -= 1;
                if depth == 0 {
                    return Some(end);
                }
            }
        }
    }

    fn read(&mut self, whole: bool) -> Option<u32> {
        let unknown = |_: &Vec<u8>| -> Evaluated { Err(Reason::UnknownVariable) };
        let first = self.at;
        let mut evaluator =
            Evaluator::new(self.tree, self.dialect, (first, self.tree.len() as u32), &unknown);
        let read = if whole { evaluator.expression() } else { evaluator.primary_only() };
        let _ = read.ok()?;
        self.at = evaluator.at;
        let mut end = self.at;
        while end > first + 1 && self.tree.kind(end - 1).is_some_and(Token::is_trivia) {
            end -= 1;
        }
        self.skip();
        Some(end)
    }

    fn expression(&mut self) -> Option<u32> {
        self.read(true)
    }

    fn primary(&mut self) -> Option<u32> {
        self.read(false)
    }
}

/// The typed view of a word node.
pub fn word<'s>(tree: &NcTree<'s>, node: u32) -> Word<'s> {
    let Node { first, end, .. } = tree.nodes.get(node);
    let mut at = first;
    let next = |at: &mut u32| {
        *at += 1;
        while *at < end && tree.kind(*at).is_some_and(Token::is_trivia) {
            *at += 1;
        }
    };
    let kind = |at: u32| if at < end { tree.kind(at).unwrap_or(Token::End) } else { Token::End };
    let mut word =
        Word { first, end, name: tree.text(first), index: None, value: WordValue::Absent, assigned: false };
    let hash = kind(at) == Token::Hash;
    next(&mut at);
    if hash {
        // `#5 = …`: the index names the variable.
        let index = at;
        while !matches!(kind(at), Token::Equal | Token::End) {
            next(&mut at);
        }
        word.index = Some((index, at));
    } else if kind(at) == Token::BracketOpen
        && (tree.kind(first) == Some(Token::Name) || indexed(tree, at, end))
    {
        let index = at + 1;
        let mut depth = 0_u32;
        while at < end {
            match kind(at) {
                Token::BracketOpen => depth += 1,
                Token::BracketClose => depth -= 1,
                _ => {}
            }
            if depth == 0 {
                break;
            }
            at += 1;
        }
        word.index = Some((index, at));
        next(&mut at);
    }
    if kind(at) == Token::Equal {
        word.assigned = true;
        next(&mut at);
    }
    let sign = matches!(kind(at), Token::Plus | Token::Minus).then_some(at);
    let mut after_sign = at;
    if sign.is_some() {
        next(&mut after_sign);
    }
    word.value = match kind(at) {
        Token::End => WordValue::Absent,
        Token::ParenOpen if !word.assigned => WordValue::Arguments { first: at, end },
        _ if kind(after_sign) == Token::Number && after_sign + 1 == end => {
            WordValue::Literal { sign, number: after_sign }
        }
        // R+, DR-: a bare sign.
        _ if at >= end || kind(after_sign) == Token::End => WordValue::Absent,
        _ => WordValue::Expression { first: at, end },
    };
    word
}

/// Whether the bracket at `at` is an index: an equals sign follows it.
fn indexed(tree: &NcTree<'_>, at: u32, end: u32) -> bool {
    let mut depth = 0_u32;
    for token in at..end {
        match tree.kind(token) {
            Some(Token::BracketOpen) => depth += 1,
            Some(Token::BracketClose) => {
                depth -= 1;
                if depth == 0 {
                    return (token + 1..end)
                        .find(|&next| tree.kind(next).is_some_and(|kind| !kind.is_trivia()))
                        .is_some_and(|next| tree.kind(next) == Some(Token::Equal));
                }
            }
            _ => {}
        }
    }
    false
}
