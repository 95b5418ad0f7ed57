//! Expressions and arguments.

use super::{Fail, Parsed, Parser, Syntax, Token};
use crate::motion::OpaqueReason;

/// Greatest nesting depth of brackets and calls.
const EXPRESSION_DEPTH: u32 = 100;

impl Parser<'_, '_> {
    pub(super) fn expression_list(&mut self, open: Token, close: Token) -> Parsed {
        self.expect(open, OpaqueReason::Unexpected)?;
        let mut more = self.peek() != close;
        while more {
            self.expression()?;
            more = self.eat(Token::Comma);
        }
        self.expect(close, OpaqueReason::Unclosed)
    }

    /// The arguments of a call, up to the token that ends them.
    pub(super) fn arguments(&mut self) -> Parsed {
        let mut separated = true;
        loop {
            match self.peek() {
                Token::Semicolon | Token::ParenClose | Token::End => return Ok(()),
                Token::Comma => {
                    self.bump();
                    separated = true;
                    if matches!(self.peek(), Token::Semicolon | Token::ParenClose | Token::Comma) {
                        return Err(Fail(OpaqueReason::ExpectedExpression));
                    }
                }
                Token::Backslash => {
                    let node = self.open(Syntax::Option);
                    self.bump();
                    if !self.peek().is_keyword() && !matches!(self.peek(), Token::Ident | Token::Placeholder)
                    {
                        return Err(Fail(OpaqueReason::ExpectedName));
                    }
                    self.bump();
                    if self.eat(Token::Assign) {
                        self.expression()?;
                    } else if self.eat(Token::Question) {
                        self.name()?;
                    }
                    self.close(node);
                    separated = false;
                }
                _ if !separated => return Err(Fail(OpaqueReason::MissingSemicolon)),
                Token::Ident if self.peek_second() == Token::Assign => {
                    let node = self.open(Syntax::NamePattern);
                    self.bump();
                    self.bump();
                    self.expression()?;
                    self.close(node);
                    separated = false;
                }
                _ => {
                    let node = self.open(Syntax::Argument);
                    self.expression()?;
                    self.close(node);
                    separated = false;
                }
            }
        }
    }

    #[inline]
    pub(super) fn expression(&mut self) -> Parsed {
        // Most expressions are one token, most of these a number in an aggregate.
        if matches!(self.peek(), Token::Number | Token::Ident | Token::String) && self.ends_after(self.at) {
            self.advance(1);
            return Ok(());
        }
        self.compound()
    }

    /// An expression of more than one token; apart, so that the short way is copied to where it is used.
    #[inline(never)]
    fn compound(&mut self) -> Parsed {
        // Most of these are a number with its sign.
        let number = self.at + 1;
        if self.peek() == Token::Minus
            && self.kinds.get(number as usize) == Some(&Token::Number)
            && self.ends_after(number)
        {
            self.nodes.push(Syntax::Unary, self.at, number + 1);
            self.advance(2);
            return Ok(());
        }
        self.nested(|parser| parser.chain(0))
    }

    /// Whether a token that ends an expression follows another at once.
    #[inline]
    fn ends_after(&self, token: u32) -> bool {
        matches!(
            self.kinds.get(token as usize + 1),
            Some(
                Token::Comma | Token::BracketClose | Token::Semicolon | Token::Backslash | Token::ParenClose
            )
        )
    }

    /// Operators of this priority and all above: 0 OR XOR, 1 AND, 2 relations, 3 sums, 4 products.
    pub(super) fn chain(&mut self, level: u8) -> Parsed {
        let (node, first) = (self.nodes.len(), self.at);
        if self.peek() == Token::Not && level <= 2 {
            // NOT covers all operators that bind more strongly than those of this level.
            self.open(Syntax::Unary);
            self.bump();
            self.nested(|parser| parser.chain(level + 1))?;
            self.close(node);
            return self.operators(level, node, first);
        }
        self.operand()?;
        if self.peek().operator_level().is_none() {
            return Ok(());
        }
        (level..=4).rev().try_for_each(|level| self.operators(level, node, first))
    }

    /// A flat chain of operators of one priority after its first operand, which began at `node` and `first`.
    pub(super) fn operators(&mut self, level: u8, node: u32, first: u32) -> Parsed {
        if self.peek().operator_level() != Some(level) {
            return Ok(());
        }
        self.wrap(Syntax::Binary, node, first);
        while self.peek().operator_level() == Some(level) {
            self.bump();
            if level == 4 { self.operand()? } else { self.chain(level + 1)? }
        }
        self.close(node);
        Ok(())
    }

    pub(super) fn operand(&mut self) -> Parsed {
        if !matches!(self.peek(), Token::Minus | Token::Plus | Token::Not) {
            return self.primary();
        }
        let node = self.open(Syntax::Unary);
        self.bump();
        self.nested(Self::operand)?;
        self.close(node);
        Ok(())
    }

    pub(super) fn nested(&mut self, inner: impl FnOnce(&mut Self) -> Parsed) -> Parsed {
        if self.depth >= EXPRESSION_DEPTH {
            return Err(Fail(OpaqueReason::TooDeep));
        }
        self.depth += 1;
        let result = inner(self);
        self.depth -= 1;
        result
    }

    pub(super) fn primary(&mut self) -> Parsed {
        let (node, first) = (self.nodes.len(), self.at);
        match self.peek() {
            Token::Number | Token::String | Token::True | Token::False | Token::Star => {
                self.bump();
                return Ok(());
            }
            Token::Ident | Token::Placeholder => {
                self.bump();
                if self.peek() == Token::ParenOpen {
                    self.wrap(Syntax::Function, node, first);
                    self.bump();
                    self.nested(Self::arguments)?;
                    self.expect(Token::ParenClose, OpaqueReason::Unclosed)?;
                    self.close(node);
                }
            }
            Token::BracketOpen => {
                self.open(Syntax::Aggregate);
                self.expression_list(Token::BracketOpen, Token::BracketClose)?;
                self.close(node);
            }
            Token::ParenOpen => {
                self.open(Syntax::Paren);
                self.bump();
                self.expression()?;
                self.expect(Token::ParenClose, OpaqueReason::Unclosed)?;
                self.close(node);
            }
            Token::OpenString => return Err(Fail(OpaqueReason::UnclosedString)),
            _ => return Err(Fail(OpaqueReason::ExpectedExpression)),
        }
        if matches!(self.peek(), Token::Dot | Token::BraceOpen) {
            self.wrap(Syntax::Place, node, first);
            loop {
                if self.eat(Token::Dot) {
                    self.name()?;
                } else if self.peek() == Token::BraceOpen {
                    let index = self.open(Syntax::Index);
                    self.expression_list(Token::BraceOpen, Token::BraceClose)?;
                    self.close(index);
                } else {
                    break;
                }
            }
            self.close(node);
        }
        Ok(())
    }
}

impl Token {
    /// The priority of a binary operator.
    fn operator_level(self) -> Option<u8> {
        match self {
            Token::Or | Token::Xor => Some(0),
            Token::And => Some(1),
            Token::Equal
            | Token::NotEqual
            | Token::Less
            | Token::LessEqual
            | Token::Greater
            | Token::GreaterEqual => Some(2),
            Token::Plus | Token::Minus => Some(3),
            Token::Star | Token::Slash | Token::Div | Token::Mod => Some(4),
            _ => None,
        }
    }
}
