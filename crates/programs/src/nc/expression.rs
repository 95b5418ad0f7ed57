//! Parsing and evaluation of expressions.
//!
//! One evaluator for all controls: `[ … ]` (Fanuc, LinuxCNC) and `( … )` (Siemens) group, `#5`, `R5`, `R[5]`, `Q5`,
//! `#<depth>` and names are variables, functions take their argument in either bracket, angles are degrees. Operators
//! by precedence: powers; `*` `/` MOD DIV; `+` `-`; relations; AND OR XOR.

use super::dialect::Dialect;
use super::syntax::NcTree;
use super::token::Token;
use crate::motion::Reason;
use crate::rapid::number;

/// The largest number that a control holds in a word.
pub(super) const MAX_NUMBER: f64 = 1e9;

/// The largest nesting depth.
const DEPTH: u32 = 64;

/// The canonical name of a variable: `#5`, `R5`, `<depth>` in upper case.
pub type Variable = Vec<u8>;

/// The value of an expression, or why it is unknown.
pub type Evaluated = Result<f64, Reason>;

/// The tokens are not an expression.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct NotAnExpression;

type Parsed = Result<Evaluated, NotAnExpression>;

/// Parses and evaluates one expression.
pub struct Evaluator<'r, 's> {
    tree: &'r NcTree<'s>,
    dialect: Dialect,
    /// The next token that is not white space.
    pub at: u32,
    end: u32,
    depth: u32,
    variables: &'r dyn Fn(&Variable) -> Evaluated,
}

impl<'r, 's> Evaluator<'r, 's> {
    /// Evaluates tokens `first..end` with the known values of variables.
    pub fn new(
        tree: &'r NcTree<'s>,
        dialect: Dialect,
        (first, end): (u32, u32),
        variables: &'r dyn Fn(&Variable) -> Evaluated,
    ) -> Self {
        let mut evaluator = Evaluator { tree, dialect, at: first, end, depth: 0, variables };
        evaluator.skip();
        evaluator
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

    /// Whether the next token is this name.
    fn is(&self, name: &str) -> bool {
        self.peek() == Token::Name && self.text().eq_ignore_ascii_case(name.as_bytes())
    }

    fn nested(&mut self, inner: impl FnOnce(&mut Self) -> Parsed) -> Parsed {
        if self.depth >= DEPTH {
            return Err(NotAnExpression);
        }
        self.depth += 1;
        let read = inner(self);
        self.depth -= 1;
        read
    }

    /// A whole expression.
    pub fn expression(&mut self) -> Parsed {
        self.nested(|evaluator| evaluator.chain(0))
    }

    /// Operators of this precedence and above: 0 logic, 1 relations, 2 sums, 3 products, 4 powers.
    fn chain(&mut self, level: u8) -> Parsed {
        if level > 4 {
            return self.unary();
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

    fn operator(&mut self, level: u8) -> Option<fn(f64, f64) -> Evaluated> {
        let found: fn(f64, f64) -> Evaluated = match (level, self.peek()) {
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
            (3, Token::Percent) => remainder,
            (4, Token::Power) => |a, b| Ok(a.powf(b)),
            // A chain of frames, which has no numeric value.
            (0, Token::Colon) if self.dialect == Dialect::Siemens => |_, _| Err(Reason::UnknownVariable),
            (_, Token::Name) => {
                let name = self.text().to_ascii_uppercase();
                let bitwise = matches!(self.dialect, Dialect::Fanuc | Dialect::Iso);
                let divides = self.dialect == Dialect::Heidenhain;
                let floors = self.dialect == Dialect::LinuxCnc;
                let found: fn(f64, f64) -> Evaluated = match (level, &*name) {
                    // Bitwise and of another precedence: unknown.
                    (0, b"AND" | b"OR" | b"XOR") if bitwise => |_, _| Err(Reason::UnknownVariable),
                    (3, b"DIV") if divides => {
                        |a, b| if b == 0.0 { Err(Reason::WrongShape) } else { Ok(a / b) }
                    }
                    (3, b"MOD") if !floors => remainder,
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
            // `<<` concatenates strings.
            self.bump();
            return Some(|_, _| Err(Reason::WrongShape));
        }
        Some(found)
    }

    /// One operand, sign included, without operators after it: `X#1`, `X-[#2+1]`.
    pub fn primary_only(&mut self) -> Parsed {
        self.nested(Self::unary)
    }

    fn unary(&mut self) -> Parsed {
        match self.peek() {
            Token::Minus => {
                self.bump();
                Ok(self.nested(Self::unary)?.map(|value| -value))
            }
            Token::Plus => {
                self.bump();
                self.nested(Self::unary)
            }
            Token::Name if self.is("NOT") => {
                self.bump();
                Ok(self.nested(Self::unary)?.map(|value| f64::from(u8::from(value == 0.0))))
            }
            _ => self.primary(),
        }
    }

    fn primary(&mut self) -> Parsed {
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
                    _ => return Ok(Err(Reason::UnknownVariable)),
                };
                Ok(number.and_then(|number| (self.variables)(&numbered(&[letter], number))))
            }
            Token::Name => self.named(),
            _ => Err(NotAnExpression),
        }
    }

    fn group(&mut self, close: Token) -> Parsed {
        self.bump();
        let mut inner = self.expression()?;
        while self.peek() == Token::Comma {
            // Several values: an index, or arguments of an unknown function.
            self.bump();
            if self.peek() != Token::Comma && self.peek() != close {
                let _ = self.expression()?;
            }
            inner = Err(Reason::UnknownVariable);
        }
        if self.peek() != close {
            return Err(NotAnExpression);
        }
        self.bump();
        Ok(inner)
    }

    /// `#5`, `##5`, `#[…]`, `#<name>`.
    fn variable(&mut self) -> Parsed {
        self.bump();
        let key = match self.peek() {
            Token::Name => {
                let name = self.text().to_ascii_uppercase();
                self.bump();
                Ok(name)
            }
            Token::Number | Token::BracketOpen | Token::Hash => {
                self.nested(Self::primary)?.map(|number| numbered(b"#", number))
            }
            _ => return Err(NotAnExpression),
        };
        Ok(key.and_then(|key| (self.variables)(&key)))
    }

    /// A function, or a named variable.
    fn named(&mut self) -> Parsed {
        let name = self.text().to_ascii_uppercase();
        self.bump();
        let close = match self.peek() {
            Token::BracketOpen => Token::BracketClose,
            Token::ParenOpen => Token::ParenClose,
            // QL1, QR1: separate sets.
            Token::Number if self.dialect == Dialect::Heidenhain && matches!(&*name, b"QL" | b"QR") => {
                return Ok(self.primary()?.and_then(|number| (self.variables)(&numbered(&name, number))));
            }
            // SIN 30: a function takes the next operand.
            _ if self.dialect == Dialect::Heidenhain && FUNCTIONS.contains(&&*name) => {
                return Ok(self.nested(Self::unary)?.and_then(|x| function(&name, x, None, self.dialect)));
            }
            _ if self.dialect == Dialect::Heidenhain && &*name == b"PI" => {
                return Ok(Ok(std::f64::consts::PI));
            }
            _ => return Ok((self.variables)(&name)),
        };
        if !FUNCTIONS.contains(&&*name) {
            return self.skip_group(close).map(|()| Err(Reason::UnknownVariable));
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
            return Err(NotAnExpression);
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
        Ok(first.and_then(|x| function(&name, x, second, self.dialect)))
    }

    /// Skips brackets, at most to the end of the line.
    fn skip_group(&mut self, close: Token) -> Result<(), NotAnExpression> {
        let open = self.peek();
        let mut depth = 0_u32;
        loop {
            let kind = self.peek();
            if kind == Token::End || kind == Token::LineEnd {
                return Err(NotAnExpression);
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

/// The remainder of a division; its sign differs between controls.
fn remainder(a: f64, b: f64) -> Evaluated {
    match () {
        () if b == 0.0 => Err(Reason::WrongShape),
        () if a < 0.0 || b < 0.0 => Err(Reason::UnknownVariable),
        () => Ok(a % b),
    }
}

/// The name of a numbered variable.
pub fn numbered(set: &[u8], number: f64) -> Variable {
    let mut name = set.to_vec();
    name.extend_from_slice(format!("{}", number.round()).as_bytes());
    name
}

/// The value of a number token, with a decimal point or comma.
pub fn literal(text: &[u8]) -> Option<f64> {
    // 1.5EX-3 of Siemens.
    if let Some(at) = text.iter().position(|byte| byte.eq_ignore_ascii_case(&b'E')) {
        let exponent: i32 = std::str::from_utf8(text.get(at + 2..)?).ok()?.parse().ok()?;
        return (exponent.abs() <= 300).then_some(number::value(&text[..at])? * 10_f64.powi(exponent));
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

/// Whether a name is a function.
pub fn is_function(name: &[u8]) -> bool {
    FUNCTIONS.iter().any(|known| name.eq_ignore_ascii_case(known))
}

const FUNCTIONS: [&[u8]; 23] = [
    b"SIN", b"COS", b"TAN", b"ASIN", b"ACOS", b"ATAN", b"ATAN2", b"SQRT", b"ABS", b"ROUND", b"FIX", b"FUP",
    b"LN", b"EXP", b"TRUNC", b"POT", b"SQR", b"INT", b"FRAC", b"SGN", b"NEG", b"SQ", b"EXISTS",
];

fn function(name: &[u8], x: f64, second: Option<f64>, dialect: Dialect) -> Evaluated {
    // A Fanuc parameter sets the range of angles; for plain ISO it is unknown too.
    let fanuc = matches!(dialect, Dialect::Fanuc | Dialect::Iso);
    let iso = dialect == Dialect::Iso;
    let in_range = |angle: f64| if fanuc && angle < 0.0 { f64::NAN } else { angle };
    let value = match (name, second) {
        (b"SIN", None) => x.to_radians().sin(),
        (b"COS", None) => x.to_radians().cos(),
        (b"TAN", None) => x.to_radians().tan(),
        (b"ASIN", None) => in_range(x.asin().to_degrees()),
        (b"ACOS", None) => x.acos().to_degrees(),
        (b"ATAN", None) => x.atan().to_degrees(),
        (b"ATAN" | b"ATAN2", Some(y)) => in_range(x.atan2(y).to_degrees()),
        (b"SQRT", None) => x.sqrt(),
        (b"ABS", None) => x.abs(),
        (b"ROUND", None) => x.round(),
        // LinuxCNC rounds down and up, Fanuc towards and away from zero.
        (b"FIX" | b"FUP", None) if iso && x < 0.0 && x.fract() != 0.0 => return Err(Reason::UnknownVariable),
        (b"FIX", None) if fanuc => x.trunc(),
        (b"FUP", None) if fanuc => x.abs().ceil().copysign(x),
        (b"FIX", None) => x.floor(),
        (b"FUP", None) => x.ceil(),
        (b"INT", None) => x.trunc(),
        (b"FRAC", None) => x.fract(),
        (b"SGN", None) if x == 0.0 => 0.0,
        (b"SGN", None) => x.signum(),
        (b"NEG", None) => -x,
        (b"SQ", None) => x * x,
        (b"LN", None) => x.ln(),
        (b"EXP", None) => x.exp(),
        (b"TRUNC", None) => x.trunc(),
        (b"POT" | b"SQR", None) => x * x,
        (b"EXISTS", _) => return Err(Reason::UnknownVariable),
        _ => return Err(Reason::WrongShape),
    };
    match value.is_finite() {
        true => Ok(value),
        false if fanuc && (name == b"ASIN" || second.is_some()) => Err(Reason::UnknownVariable),
        false => Err(Reason::WrongShape),
    }
}
