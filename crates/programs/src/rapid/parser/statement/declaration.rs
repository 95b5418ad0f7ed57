//! Data, types, and the heads of routines.

use super::{Fail, Parsed, Parser, Syntax, Token};
use crate::motion::OpaqueReason;

impl Parser<'_, '_> {
    pub(super) fn routine_header(&mut self, kind: Syntax) -> Parsed {
        if kind == Syntax::Func {
            self.name()?;
        }
        self.name()?;
        if kind == Syntax::Trap || self.peek() != Token::ParenOpen {
            return Ok(());
        }
        let node = self.open(Syntax::Parameters);
        self.bump();
        while !matches!(self.peek(), Token::ParenClose | Token::End) {
            while matches!(self.peek(), Token::Comma | Token::Pipe) {
                self.bump();
            }
            self.parameter()?;
        }
        self.expect(Token::ParenClose, OpaqueReason::Unclosed)?;
        self.close(node);
        Ok(())
    }

    pub(super) fn parameter(&mut self) -> Parsed {
        let node = self.open(Syntax::Parameter);
        self.eat(Token::Backslash);
        if matches!(self.peek(), Token::Var | Token::Pers | Token::InOut) {
            self.bump();
        }
        let lone = self.peek() == Token::Placeholder;
        self.name()?;
        if self.peek() == Token::Ident || self.peek() == Token::Placeholder {
            self.name()?;
        } else if !lone {
            return Err(Fail(OpaqueReason::ExpectedName));
        }
        if self.eat(Token::BraceOpen) {
            while matches!(self.peek(), Token::Star | Token::Comma | Token::Placeholder) {
                self.bump();
            }
            self.expect(Token::BraceClose, OpaqueReason::Unclosed)?;
        }
        self.close(node);
        Ok(())
    }

    pub(super) fn record(&mut self) -> Parsed {
        let node = self.open(Syntax::Record);
        self.eat(Token::Local);
        self.bump();
        self.name()?;
        while !matches!(self.peek(), Token::EndRecord | Token::End) {
            let component = self.open(Syntax::Component);
            self.name()?;
            self.name()?;
            self.expect(Token::Semicolon, OpaqueReason::MissingSemicolon)?;
            self.close(component);
        }
        self.expect(Token::EndRecord, OpaqueReason::MissingEnd)?;
        self.close(node);
        Ok(())
    }

    pub(super) fn alias(&mut self) -> Parsed {
        let node = self.open(Syntax::Alias);
        self.eat(Token::Local);
        self.bump();
        self.name()?;
        self.name()?;
        self.expect(Token::Semicolon, OpaqueReason::MissingSemicolon)?;
        self.close(node);
        Ok(())
    }

    pub(super) fn data(&mut self) -> Parsed {
        let node = self.open(Syntax::Data);
        while self.peek() == Token::Local || self.at_word(b"TASK") {
            self.bump();
        }
        if !matches!(self.peek(), Token::Var | Token::Pers | Token::Const) {
            return Err(Fail(OpaqueReason::Unexpected));
        }
        self.bump();
        self.name()?;
        self.name()?;
        if self.peek() == Token::BraceOpen {
            let dimensions = self.open(Syntax::Dimensions);
            self.bump();
            self.expression()?;
            while self.eat(Token::Comma) {
                self.expression()?;
            }
            self.expect(Token::BraceClose, OpaqueReason::Unclosed)?;
            self.close(dimensions);
        }
        if self.eat(Token::Assign) {
            self.expression()?;
        }
        self.expect(Token::Semicolon, OpaqueReason::MissingSemicolon)?;
        self.close(node);
        Ok(())
    }
}
