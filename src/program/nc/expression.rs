//! Expressions: where they end, and what they are worth where the text tells it.
//!
//! One reader for all controls: `[ … ]` (Fanuc, LinuxCNC) and `( … )` (Siemens) group, `#5`, `R5`, `R[5]`, `Q5`,
//! `#<depth>` and names are variables, functions take their argument in either bracket, angles are degrees. Operators
//! by priority: powers; `*` `/` MOD DIV; `+` `-`; relations; AND OR XOR.

use super::dialect::Dialect;
use super::syntax::NcTree;
use super::token::Token;
use crate::program::motion::Reason;
use crate::program::rapid::number;

/// How deeply expressions may nest.
const DEPTH: u32 = 64;

/// What a variable is called, in one form for all its spellings: `#5`, `R5`, `<depth>` in upper case.
pub type Variable = Vec<u8>;

/// What an expression is worth, or why that is not known.
pub type Worth = Result<f64, Reason>;

/// The bytes are no expression.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct NoExpression;

type Read = Result<Worth, NoExpression>;

/// Reads one expression.
pub struct Reader<'r, 's> {
    tree: &'r NcTree<'s>,
    dialect: Dialect,
    /// The next token that is no white space.
    pub at: u32,
    end: u32,
    depth: u32,
    variables: &'r dyn Fn(&Variable) -> Worth,
}

impl<'r, 's> Reader<'r, 's> {
    /// Reads tokens `first..end` with what is known of variables.
    pub fn new(
        tree: &'r NcTree<'s>,
        dialect: Dialect,
        (first, end): (u32, u32),
        variables: &'r dyn Fn(&Variable) -> Worth,
    ) -> Self {
        let mut reader = Reader { tree, dialect, at: first, end, depth: 0, variables };
        reader.skip();
        reader
    }

    fn skip(&mut self) {
        while self.at < self.end
            && self.tree.kind(self.at).is_some_and(|kind| kind.is_trivia() && kind != Token::LineEnd)
        {
            self.at += 1;
        }
    }

    fn peek(&self) -> Token {
        if self.at < self.end { self.tree.kind(self.at).unwrap_or(Token::End) } else { Token::End }
    }

    fn bump(&mut self) -> u32 {
        let token = self.at;
        self.at += 1;
        self.skip();
        token
    }

    fn text(&self) -> &'s [u8] {
        self.tree.text(self.at)
    }

    /// Whether the next token is a name like this.
    fn is(&self, name: &str) -> bool {
        self.peek() == Token::Name && self.text().eq_ignore_ascii_case(name.as_bytes())
    }

    fn nested(&mut self, inner: impl FnOnce(&mut Self) -> Read) -> Read {
        if self.depth >= DEPTH {
            return Err(NoExpression);
        }
        self.depth += 1;
        let read = inner(self);
        self.depth -= 1;
        read
    }

    /// A whole expression.
    pub fn expression(&mut self) -> Read {
        self.nested(|reader| reader.chain(0))
    }

    /// Operators of this priority and all above: 0 logic, 1 relations, 2 sums, 3 products, 4 powers.
    fn chain(&mut self, level: u8) -> Read {
        if level > 4 {
            return self.signed();
        }
        let mut left = self.chain(level + 1)?;
        while let Some(operator) = self.operator(level) {
            let right = self.chain(level + 1)?;
            left = match (left, right) {
                (Ok(a), Ok(b)) => operator(a, b),
                (Err(reason), _) | (_, Err(reason)) => Err(reason),
            };
        }
        Ok(left)
    }

    fn operator(&mut self, level: u8) -> Option<fn(f64, f64) -> Worth> {
        let found: fn(f64, f64) -> Worth = match (level, self.peek()) {
            (1, Token::EqualEqual) => |a, b| Ok(f64::from(u8::from(a == b))),
            (1, Token::NotEqual) => |a, b| Ok(f64::from(u8::from(a != b))),
            (1, Token::Less) => |a, b| Ok(f64::from(u8::from(a < b))),
            (1, Token::Greater) => |a, b| Ok(f64::from(u8::from(a > b))),
            (1, Token::LessEqual) => |a, b| Ok(f64::from(u8::from(a <= b))),
            (1, Token::GreaterEqual) => |a, b| Ok(f64::from(u8::from(a >= b))),
            (2, Token::Plus) => |a, b| Ok(a + b),
            (2, Token::Minus) => |a, b| Ok(a - b),
            (3, Token::Star) => |a, b| Ok(a * b),
            (3, Token::Slash) => |a, b| if b == 0.0 { Err(Reason::WrongShape) } else { Ok(a / b) },
            (4, Token::Power) => |a, b| Ok(a.powf(b)),
            // A chain of frames: known only as a whole.
            (0, Token::Colon) if self.dialect == Dialect::Siemens => |_, _| Err(Reason::Variable),
            (_, Token::Name) => {
                let name = self.text().to_ascii_uppercase();
                let found: fn(f64, f64) -> Worth = match (level, &*name) {
                    (0, b"AND") => |a, b| Ok(f64::from(u8::from(a != 0.0 && b != 0.0))),
                    (0, b"OR") => |a, b| Ok(f64::from(u8::from(a != 0.0 || b != 0.0))),
                    (0, b"XOR") => |a, b| Ok(f64::from(u8::from((a != 0.0) != (b != 0.0)))),
                    (1, b"EQ") => |a, b| Ok(f64::from(u8::from(a == b))),
                    (1, b"NE") => |a, b| Ok(f64::from(u8::from(a != b))),
                    (1, b"LT") => |a, b| Ok(f64::from(u8::from(a < b))),
                    (1, b"GT") => |a, b| Ok(f64::from(u8::from(a > b))),
                    (1, b"LE") => |a, b| Ok(f64::from(u8::from(a <= b))),
                    (1, b"GE") => |a, b| Ok(f64::from(u8::from(a >= b))),
                    (3, b"MOD") => {
                        |a, b| if b == 0.0 { Err(Reason::WrongShape) } else { Ok(a.rem_euclid(b)) }
                    }
                    (3, b"DIV") => {
                        |a, b| if b == 0.0 { Err(Reason::WrongShape) } else { Ok((a / b).trunc()) }
                    }
                    _ => return None,
                };
                found
            }
            _ => return None,
        };
        let twice = level == 1 && self.peek() == Token::Less;
        self.bump();
        if twice && self.peek() == Token::Less {
            // `<<` joins texts.
            self.bump();
            return Some(|_, _| Err(Reason::WrongShape));
        }
        Some(found)
    }

    /// One operand, sign included, without operators after it: `X#1`, `X-[#2+1]`.
    pub fn primary_only(&mut self) -> Read {
        self.nested(Self::signed)
    }

    fn signed(&mut self) -> Read {
        match self.peek() {
            Token::Minus => {
                self.bump();
                Ok(self.nested(Self::signed)?.map(|value| -value))
            }
            Token::Plus => {
                self.bump();
                self.nested(Self::signed)
            }
            Token::Name if self.is("NOT") => {
                self.bump();
                Ok(self.nested(Self::signed)?.map(|value| f64::from(u8::from(value == 0.0))))
            }
            _ => self.primary(),
        }
    }

    fn primary(&mut self) -> Read {
        match self.peek() {
            Token::Number => {
                let text = self.text();
                self.bump();
                Ok(literal(text).ok_or(Reason::WrongShape))
            }
            Token::String => {
                self.bump();
                Ok(Err(Reason::WrongShape))
            }
            Token::BracketOpen => self.group(Token::BracketClose),
            Token::ParenOpen => self.group(Token::ParenClose),
            Token::Hash => self.variable(),
            Token::Address => {
                // R5, R[5], Q5.
                let letter = self.text()[0].to_ascii_uppercase();
                self.bump();
                let number = match self.peek() {
                    Token::Number => self.primary()?,
                    Token::BracketOpen => self.group(Token::BracketClose)?,
                    _ => return Ok(Err(Reason::Variable)),
                };
                Ok(number.and_then(|number| (self.variables)(&numbered(letter, number))))
            }
            Token::Name => self.named(),
            _ => Err(NoExpression),
        }
    }

    fn group(&mut self, close: Token) -> Read {
        self.bump();
        let mut inner = self.expression()?;
        while self.peek() == Token::Comma {
            // Several values: an index or arguments of something that is not known here.
            self.bump();
            if self.peek() != Token::Comma && self.peek() != close {
                let _ = self.expression()?;
            }
            inner = Err(Reason::Variable);
        }
        if self.peek() != close {
            return Err(NoExpression);
        }
        self.bump();
        Ok(inner)
    }

    /// `#5`, `##5`, `#[…]`, `#<name>`.
    fn variable(&mut self) -> Read {
        self.bump();
        let key = match self.peek() {
            Token::Name => {
                let name = self.text().to_ascii_uppercase();
                self.bump();
                Ok(name)
            }
            Token::Number | Token::BracketOpen | Token::Hash => {
                self.nested(Self::primary)?.map(|number| numbered(b'#', number))
            }
            _ => return Err(NoExpression),
        };
        Ok(key.and_then(|key| (self.variables)(&key)))
    }

    /// A function, or a variable with a name.
    fn named(&mut self) -> Read {
        let name = self.text().to_ascii_uppercase();
        self.bump();
        let close = match self.peek() {
            Token::BracketOpen => Token::BracketClose,
            Token::ParenOpen => Token::ParenClose,
            _ => return Ok((self.variables)(&name)),
        };
        if !FUNCTIONS.contains(&&*name) {
            return self.skip_group(close).map(|()| Err(Reason::Variable));
        }
        let first = {
            self.bump();
            self.expression()?
        };
        let mut second = None;
        if self.peek() == Token::Comma {
            self.bump();
            second = Some(self.expression()?);
        }
        if self.peek() != close {
            return Err(NoExpression);
        }
        self.bump();
        // ATAN[y]/[x] of Fanuc and LinuxCNC.
        if &*name == b"ATAN" && close == Token::BracketClose && self.peek() == Token::Slash {
            self.bump();
            second = Some(self.group(Token::BracketClose)?);
        }
        let second = match second.transpose() {
            Ok(second) => second,
            Err(reason) => return Ok(Err(reason)),
        };
        Ok(first.and_then(|x| function(self.dialect, &name, x, second)))
    }

    /// Brackets whose content is not looked at, to the end of the line at most.
    fn skip_group(&mut self, close: Token) -> Result<(), NoExpression> {
        let open = self.peek();
        let mut depth = 0_u32;
        loop {
            let kind = self.peek();
            if kind == Token::End || kind == Token::LineEnd {
                return Err(NoExpression);
            }
            self.bump();
            if kind == open {
                depth += 1;
            } else if kind == close {
                depth -= 1;
                if depth == 0 {
                    return Ok(());
                }
            }
        }
    }
}

/// The name of a numbered variable.
pub fn numbered(letter: u8, number: f64) -> Variable {
    let mut name = vec![letter];
    name.extend_from_slice(format!("{}", number.round()).as_bytes());
    name
}

/// The value of a number token; a comma is a point, EX of Siemens begins the exponent.
pub fn literal(text: &[u8]) -> Option<f64> {
    if let Some(at) = text.windows(2).position(|two| two.eq_ignore_ascii_case(b"EX")) {
        return number::value(&[&text[..at], b"E", &text[at + 2..]].concat());
    }
    match text.iter().position(|&byte| byte == b',') {
        Some(comma) => {
            let mut copy = text.to_vec();
            copy[comma] = b'.';
            number::value(&copy)
        }
        None => number::value(text),
    }
}

const FUNCTIONS: [&[u8]; 17] = [
    b"SIN", b"COS", b"TAN", b"ASIN", b"ACOS", b"ATAN", b"ATAN2", b"SQRT", b"ABS", b"ROUND", b"FIX", b"FUP",
    b"LN", b"EXP", b"TRUNC", b"POT", b"SQR",
];

fn function(dialect: Dialect, name: &[u8], x: f64, second: Option<f64>) -> Worth {
    let linux = dialect == Dialect::LinuxCnc;
    let value = match (name, second) {
        (b"SIN", None) => x.to_radians().sin(),
        (b"COS", None) => x.to_radians().cos(),
        (b"TAN", None) => x.to_radians().tan(),
        (b"ASIN", None) => x.asin().to_degrees(),
        (b"ACOS", None) => x.acos().to_degrees(),
        (b"ATAN", None) => x.atan().to_degrees(),
        (b"ATAN" | b"ATAN2", Some(y)) => x.atan2(y).to_degrees(),
        (b"SQRT", None) => x.sqrt(),
        (b"ABS", None) => x.abs(),
        (b"ROUND", None) => x.round(),
        (b"FIX", None) if linux => x.floor(),
        (b"FUP", None) if linux => x.ceil(),
        // Fanuc cuts digits off, or goes away from 0.
        (b"FIX", None) => x.trunc(),
        (b"FUP", None) => x.signum() * x.abs().ceil(),
        (b"LN", None) => x.ln(),
        (b"EXP", None) => x.exp(),
        (b"TRUNC", None) => x.trunc(),
        (b"POT" | b"SQR", None) => x * x,
        _ => return Err(Reason::WrongShape),
    };
    if value.is_finite() { Ok(value) } else { Err(Reason::WrongShape) }
}
