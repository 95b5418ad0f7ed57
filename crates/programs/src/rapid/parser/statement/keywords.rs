//! Keyword classes for error recovery: what ends a block, and what begins a statement.

use crate::rapid::token::Token;

impl Token {
    /// Keywords that close or continue a block.
    pub(super) fn ends_block(self) -> bool {
        matches!(
            self,
            Token::EndModule
                | Token::EndProc
                | Token::EndFunc
                | Token::EndTrap
                | Token::EndRecord
                | Token::EndIf
                | Token::EndFor
                | Token::EndWhile
                | Token::EndTest
                | Token::Else
                | Token::ElseIf
                | Token::Case
                | Token::Default
                | Token::Error
                | Token::Undo
                | Token::Backward
        )
    }

    /// Keywords with which something new certainly begins, where reading can start again.
    pub(super) fn begins_statement(self) -> bool {
        self.ends_block()
            || self.begins_with_keyword()
            || matches!(
                self,
                Token::Module
                    | Token::Proc
                    | Token::Func
                    | Token::Trap
                    | Token::Local
                    | Token::Const
                    | Token::Pers
                    | Token::Var
                    | Token::Record
                    | Token::Alias
            )
    }

    /// Whether it begins a statement that this keyword identifies.
    pub(super) fn begins_with_keyword(self) -> bool {
        matches!(
            self,
            Token::If
                | Token::For
                | Token::While
                | Token::Test
                | Token::Goto
                | Token::Return
                | Token::Raise
                | Token::Exit
                | Token::Retry
                | Token::TryNext
                | Token::Connect
        )
    }
}
