//! The kinds of RAPID token (RAPID kernel reference, chapter 2).

macro_rules! tokens {
    (plain { $($plain:ident,)* } keywords { $($keyword:ident = $text:literal,)* }) => {
        /// A kind of token. White space, comments and headers come first, so that one comparison identifies them.
        #[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
        #[repr(u8)]
        #[allow(missing_docs)]
        pub enum Token { $($plain,)* $($keyword,)* }

        /// The reserved word that these bytes spell in any case.
        #[inline]
        pub fn keyword(text: &[u8]) -> Option<Token> {
            /// For each first letter the lengths of the words that begin with it, as bits: most names are none by this
            /// alone.
            const LENGTHS: [u16; 32] = lengths(&[$($text,)*]);
            let first = text.first().filter(|byte| byte.is_ascii_alphabetic())?;
            if text.len() > MAX_WORD_BYTES || (LENGTHS[usize::from(first & 31)] >> text.len()) & 1 == 0 {
                return None;
            }
            let mut folded = [0_u8; MAX_WORD_BYTES];
            let folded = folded.get_mut(..text.len())?;
            folded.copy_from_slice(text);
            folded.make_ascii_uppercase();
            match &*folded {
                $($text => Some(Token::$keyword),)*
                _ => None,
            }
        }
    };
}

/// Bytes of the longest reserved word.
const MAX_WORD_BYTES: usize = 9;

const fn lengths(words: &[&[u8]]) -> [u16; 32] {
    let mut out = [0; 32];
    let mut k = 0;
    while k < words.len() {
        out[(words[k][0] & 31) as usize] |= 1 << words[k].len();
        k += 1;
    }
    out
}

tokens! {
    plain {
        Space, Comment, Header,
        Ident, Number, String, OpenString, Placeholder, Unknown,
        BraceOpen, BraceClose, ParenOpen, ParenClose, BracketOpen, BracketClose,
        Comma, Dot, Equal, Less, Greater, NotEqual, LessEqual, GreaterEqual,
        Plus, Minus, Star, Slash, Colon, Assign, Semicolon, Backslash, Question, Percent, Pipe,
        End,
    }
    keywords {
        Alias = b"ALIAS", And = b"AND", Backward = b"BACKWARD", Case = b"CASE", Connect = b"CONNECT",
        Const = b"CONST", Default = b"DEFAULT", Div = b"DIV", Do = b"DO", Else = b"ELSE", ElseIf = b"ELSEIF",
        EndFor = b"ENDFOR", EndFunc = b"ENDFUNC", EndIf = b"ENDIF", EndModule = b"ENDMODULE",
        EndProc = b"ENDPROC", EndRecord = b"ENDRECORD", EndTest = b"ENDTEST", EndTrap = b"ENDTRAP",
        EndWhile = b"ENDWHILE", Error = b"ERROR", Exit = b"EXIT", False = b"FALSE", For = b"FOR",
        From = b"FROM", Func = b"FUNC", Goto = b"GOTO", If = b"IF", InOut = b"INOUT", Local = b"LOCAL",
        Mod = b"MOD", Module = b"MODULE", NoStepIn = b"NOSTEPIN", Not = b"NOT", NoView = b"NOVIEW", Or = b"OR",
        Pers = b"PERS", Proc = b"PROC", Raise = b"RAISE", ReadOnly = b"READONLY", Record = b"RECORD",
        Retry = b"RETRY", Return = b"RETURN", Step = b"STEP", SysModule = b"SYSMODULE", Test = b"TEST",
        Then = b"THEN", To = b"TO", Trap = b"TRAP", True = b"TRUE", TryNext = b"TRYNEXT", Undo = b"UNDO",
        Var = b"VAR", ViewOnly = b"VIEWONLY", While = b"WHILE", With = b"WITH", Xor = b"XOR",
    }
}

impl Token {
    /// Whether it is white space, a comment or a file header.
    #[inline]
    pub fn is_trivia(self) -> bool {
        self <= Token::Header
    }

    /// Whether it is a reserved word.
    pub fn is_keyword(self) -> bool {
        self > Token::End
    }
}

/// An identifier in the form in which names are compared: lower case, Latin-1 letters included (Ü is ü).
pub fn folded(name: &[u8]) -> Vec<u8> {
    name.iter().map(|&byte| fold(byte)).collect()
}

/// One byte of an identifier in lower case.
#[inline]
pub fn fold(byte: u8) -> u8 {
    match byte {
        b'A'..=b'Z' | 0xC0..=0xD6 | 0xD8..=0xDE => byte + 32,
        _ => byte,
    }
}

/// Whether two identifiers are the same name.
pub fn same_name(a: &[u8], b: &[u8]) -> bool {
    a.len() == b.len() && a.iter().zip(b).all(|(&a, &b)| fold(a) == fold(b))
}

/// The bytes as text: Latin-1, each byte one character (UTF-8 where it is valid).
pub fn display(bytes: &[u8]) -> String {
    match std::str::from_utf8(bytes) {
        Ok(text) => text.to_owned(),
        Err(_) => bytes.iter().map(|&byte| char::from(byte)).collect(),
    }
}
