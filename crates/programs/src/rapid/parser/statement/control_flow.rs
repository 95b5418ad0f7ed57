//! Statements with blocks: IF, FOR, WHILE and TEST.

use super::{Fail, Parsed, Parser};
use crate::motion::OpaqueReason;
use crate::rapid::syntax::Syntax;
use crate::rapid::token::Token;

impl Parser<'_, '_> {
    /// The nearest open block of a kind in the current routine.
    fn nearest(&self, wanted: Syntax) -> Option<usize> {
        let blocks = self.blocks.iter().enumerate().rev();
        blocks
            .take_while(|(_, block)| block.kind.is_statement_block())
            .find(|(_, block)| block.kind == wanted)
            .map(|(index, _)| index)
    }

    pub(super) fn condition(&mut self) -> Parsed {
        self.open_block(Syntax::If);
        let (block, header) = (self.blocks.len() - 1, (self.nodes.len(), self.at));
        self.bump();
        match self.expression() {
            Ok(()) if self.eat(Token::Then) => self.open_block(Syntax::Branch),
            Ok(()) => {
                // No THEN: the compact form guards one statement.
                let node = self.blocks[block].node;
                self.nodes.set_kind(node, Syntax::CompactIf);
                self.blocks[block].kind = Syntax::CompactIf;
                if self.peek().ends_block() || self.peek() == Token::End {
                    self.close_block();
                    return Err(Fail(OpaqueReason::Unexpected));
                }
            }
            failed => {
                self.header_done(header, failed);
                self.open_block(Syntax::Branch);
            }
        }
        Ok(())
    }

    pub(super) fn branch(&mut self) -> Parsed {
        let Some(index) = self.nearest(Syntax::If) else {
            return Err(Fail(OpaqueReason::StrayEnd));
        };
        self.close_above(index);
        self.open_block(Syntax::Branch);
        let header = (self.nodes.len(), self.at);
        if self.eat(Token::ElseIf) {
            let result = self.expression().and_then(|()| self.expect(Token::Then, OpaqueReason::Unexpected));
            self.header_done(header, result);
        } else {
            self.bump();
        }
        Ok(())
    }

    pub(super) fn for_loop(&mut self) -> Parsed {
        self.open_block(Syntax::For);
        let header = (self.nodes.len(), self.at);
        self.bump();
        let result = self.for_header();
        self.header_done(header, result);
        self.open_block(Syntax::Body);
        Ok(())
    }

    fn for_header(&mut self) -> Parsed {
        self.name()?;
        self.expect(Token::From, OpaqueReason::Unexpected)?;
        self.expression()?;
        self.expect(Token::To, OpaqueReason::Unexpected)?;
        self.expression()?;
        if self.eat(Token::Step) {
            self.expression()?;
        }
        self.expect(Token::Do, OpaqueReason::Unexpected)
    }

    pub(super) fn while_loop(&mut self) -> Parsed {
        self.open_block(Syntax::While);
        let header = (self.nodes.len(), self.at);
        self.bump();
        let result = self.expression().and_then(|()| self.expect(Token::Do, OpaqueReason::Unexpected));
        self.header_done(header, result);
        self.open_block(Syntax::Body);
        Ok(())
    }

    pub(super) fn test(&mut self) -> Parsed {
        self.open_block(Syntax::Test);
        let header = (self.nodes.len(), self.at);
        self.bump();
        let result = self.expression();
        self.header_done(header, result);
        if self.peek() == Token::Placeholder {
            self.bump();
        }
        Ok(())
    }

    pub(super) fn case(&mut self) -> Parsed {
        let Some(index) = self.nearest(Syntax::Test) else {
            return Err(Fail(OpaqueReason::StrayEnd));
        };
        self.close_above(index);
        self.open_block(Syntax::Case);
        let header = (self.nodes.len(), self.at);
        let result = if self.eat(Token::Case) { self.case_header() } else { self.default_header() };
        self.header_done(header, result);
        Ok(())
    }

    fn case_header(&mut self) -> Parsed {
        self.expression()?;
        while self.eat(Token::Comma) {
            self.expression()?;
        }
        self.expect(Token::Colon, OpaqueReason::Unexpected)
    }

    fn default_header(&mut self) -> Parsed {
        self.bump();
        self.expect(Token::Colon, OpaqueReason::Unexpected)
    }
}
