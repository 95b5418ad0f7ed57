//! The kinds of NC token.

/// A kind of token. Trivia (white space, line ends, comments, tape lines) come first, so that one comparison detects
/// them.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
#[repr(u8)]
#[allow(missing_docs)]
pub enum Token {
    Space,
    LineEnd,
    Comment,
    /// A whole line that begins with `%`: tape start and end, program name.
    Tape,
    /// One letter: an address.
    Address,
    /// A word of letters (and digits where the dialect has them): TRAORI, A3, GOTO, `<depth>`.
    Name,
    Number,
    String,
    Plus,
    Minus,
    Star,
    Power,
    Percent,
    Slash,
    Equal,
    EqualEqual,
    NotEqual,
    Less,
    Greater,
    LessEqual,
    GreaterEqual,
    BracketOpen,
    BracketClose,
    ParenOpen,
    ParenClose,
    Comma,
    Colon,
    Hash,
    Unknown,
    End,
}

impl Token {
    /// Whether it is white space or a comment.
    #[inline]
    pub fn is_trivia(self) -> bool {
        self <= Token::Tape
    }
}
