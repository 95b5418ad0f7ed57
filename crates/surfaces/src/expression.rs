//! The text of an equation: a small grammar with exact positions in front of symbolic derivatives.
//!
//! **Method.** The text is read by a grammar of our own, which knows where each character stands and binds as
//! mathematics does (`-x^2` is −(x²), `2^3^2` is 2^(3²), `1e-3` is a number). What it read is handed, with every
//! pair of parentheses written out, to `exmex`, which differentiates it symbolically, twice, and evaluates it.
//!
//! **Shapes.** Up to three variables; a gradient of three, a symmetric 3 × 3 matrix of second derivatives (unused
//! rows zero).
//!
//! **Stops.** A text longer than [`LONGEST`] characters or nested deeper than [`DEEPEST`] is refused, and so is one whose
//! second derivative has more than [`MOST_TERMS`] terms by the rules of differentiation, counted before it is taken: it
//! grows with the third power of a product's factors, and exmex's time with more than the square of that. exmex goes into
//! itself once for every term, with some 100 kB each time: it runs on a thread with a stack for the longest text.
//!
//! **Source and departures.** exmex alone reads `-x^2` as (−x)², has no `1e-3`, and reports errors without a
//! position; hence the grammar in front. `abs(f)` is handed on as √(f²), because exmex has no derivative of it.
//!
//! **Checked against.** Numerical differences of every function and operator, and the conventions above.
//!
//! ```text
//! sum     = product { ("+" | "-") product }
//! product = signed { ("*" | "/") signed }
//! signed  = ("-" | "+") signed | power
//! power   = atom [ ("^" | "**") signed ]
//! atom    = number | name | function "(" sum ")" | "(" sum ")"
//! ```

use exmex::{Differentiate, Express, FlatEx};
use nalgebra::{Matrix3, Vector3};

/// Longest text that is read, in characters.
pub const LONGEST: usize = 2000;
/// Deepest nesting that is read.
pub const DEEPEST: usize = 60;
/// Most terms of a second derivative.
pub const MOST_TERMS: f64 = 80_000.0;
/// The functions an equation may use.
pub const FUNCTIONS: [&str; 14] = [
    "sin", "cos", "tan", "asin", "acos", "atan", "sinh", "cosh", "tanh", "exp", "ln", "log10", "sqrt", "abs",
];
/// The constants an equation may use.
pub const CONSTANTS: [(&str, f64); 4] = [
    ("pi", std::f64::consts::PI),
    ("π", std::f64::consts::PI),
    ("tau", std::f64::consts::TAU),
    ("e", std::f64::consts::E),
];

/// Why a text is not an expression, and where.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[error("cannot read the expression `{text}` at column {column}: found {found}, expected {expected}")]
pub struct ExpressionError {
    /// The whole text.
    pub text: String,
    /// Where reading stopped, in characters from 1.
    pub column: usize,
    /// What was found there.
    pub found: String,
    /// What could be there, or what to write instead.
    pub expected: String,
}

/// An expression in named variables with its first and second derivatives.
#[derive(Debug, Clone)]
pub struct Expression {
    text: String,
    /// Which of the named variables occur, in alphabetical order, as exmex requires their values.
    used: Vec<usize>,
    terms: Terms,
    /// Boxed, since it occupies some 20 kB inline.
    value: Box<FlatEx<f64>>,
    first: Vec<FlatEx<f64>>,
    /// Upper triangle by rows over the used variables.
    second: Vec<FlatEx<f64>>,
}

/// Stack size for the longest text (bytes): only the used part takes memory.
const STACK: usize = 512 << 20;

/// Runs `work` on a thread with a large stack; `None` where no such thread can be started.
fn on_ample_stack<T: Send>(work: impl FnOnce() -> T + Send) -> Option<T> {
    std::thread::scope(|scope| {
        let thread = std::thread::Builder::new().stack_size(STACK).spawn_scoped(scope, work);
        thread.ok()?.join().ok()
    })
}

impl Expression {
    /// Reads `text` as an expression in `variables` (at most three, in alphabetical order).
    ///
    /// ```
    /// use truegrind_surfaces::expression::Expression;
    ///
    /// let z = Expression::parse("x^2/400 - sin(y)", &["x", "y"])?;
    /// assert!((z.value(&[20.0, 0.0]) - 1.0).abs() < 1e-12);
    /// assert!((z.gradient(&[20.0, 0.0]) - nalgebra::Vector3::new(0.1, -1.0, 0.0)).norm() < 1e-12);
    /// assert!(Expression::parse("x^2 + w", &["x", "y"]).is_err_and(|error| error.column == 7));
    /// # Ok::<(), truegrind_surfaces::expression::ExpressionError>(())
    /// ```
    ///
    /// # Errors
    /// The position of the first character that does not belong there, what was found and what was expected.
    pub fn parse(text: &str, variables: &[&str]) -> Result<Self, ExpressionError> {
        let mut reader = Reader::new(text, variables);
        let whole = reader.whole()?;
        let terms = whole.terms();
        // NaN counts as too many.
        if !(terms.second <= MOST_TERMS) {
            return Err(ExpressionError {
                text: text.to_owned(),
                column: 1,
                found: format!("an expression whose second derivative has {:.3e} terms", terms.second),
                expected: format!(
                    "at most {MOST_TERMS}: fewer factors in a product, powers as x^3, fewer nested functions"
                ),
            });
        }
        let written = whole.written();
        on_ample_stack(|| Self::differentiated(text, variables, &written, terms)).unwrap_or_else(|| {
            Err(ExpressionError {
                text: text.to_owned(),
                column: 1,
                found: "no memory to take its derivatives".to_owned(),
                expected: "a shorter expression".to_owned(),
            })
        })
    }

    /// `written` is `text` with every pair of parentheses.
    fn differentiated(
        text: &str,
        variables: &[&str],
        written: &str,
        terms: Terms,
    ) -> Result<Self, ExpressionError> {
        // The grammar admits only what exmex knows, so a refusal here names the whole text.
        let refused = |e: exmex::ExError| ExpressionError {
            text: text.to_owned(),
            column: 1,
            found: format!("something that has no derivative ({e})"),
            expected: "a smooth expression".to_owned(),
        };
        let value = exmex::parse::<f64>(written).map_err(refused)?;
        let used: Vec<usize> = variables
            .iter()
            .enumerate()
            .filter(|(_, name)| value.var_names().iter().any(|n| n == *name))
            .map(|(i, _)| i)
            .collect();
        let first = (0..used.len())
            .map(|i| value.clone().partial(i))
            .collect::<Result<Vec<_>, _>>()
            .map_err(refused)?;
        let second = (0..used.len())
            .flat_map(|i| (i..used.len()).map(move |k| (i, k)))
            .map(|(i, k)| first[i].clone().partial(k))
            .collect::<Result<Vec<_>, _>>()
            .map_err(refused)?;
        Ok(Self { text: text.to_owned(), used, terms, value: Box::new(value), first, second })
    }

    /// The text as it was given.
    pub fn text(&self) -> &str {
        &self.text
    }

    /// Terms of the value, and of all first derivatives together, as the rules of differentiation write them; each counts for
    /// more where the expression has functions, which take as long as several sums and products.
    pub(crate) fn terms(&self) -> [f64; 2] {
        let weight = match &self.text {
            text if text.contains("tan") => 4.0,
            text if FUNCTIONS.iter().any(|name| text.contains(name)) => 2.5,
            _ => 1.0,
        };
        [self.terms.value * weight, self.terms.first * self.used.len() as f64 * weight]
    }

    /// Value at `at`, one number per variable; NaN or infinite where the expression has no value.
    pub fn value(&self, at: &[f64]) -> f64 {
        self.evaluate(&self.value, at)
    }

    /// First derivatives, in the order of the variables; entries beyond them are zero.
    pub fn gradient(&self, at: &[f64]) -> Vector3<f64> {
        let mut gradient = Vector3::zeros();
        for (i, first) in self.used.iter().zip(&self.first) {
            gradient[*i] = self.evaluate(first, at);
        }
        gradient
    }

    /// Second derivatives, rows and columns in the order of the variables; entries beyond them are zero.
    pub fn hessian(&self, at: &[f64]) -> Matrix3<f64> {
        let mut hessian = Matrix3::zeros();
        let pairs = (0..self.used.len()).flat_map(|i| (i..self.used.len()).map(move |k| (i, k)));
        for ((i, k), second) in pairs.zip(&self.second) {
            let (row, column, value) = (self.used[i], self.used[k], self.evaluate(second, at));
            hessian[(row, column)] = value;
            hessian[(column, row)] = value;
        }
        hessian
    }

    fn evaluate(&self, expression: &FlatEx<f64>, at: &[f64]) -> f64 {
        let mut values = [0.0; 3];
        for (value, i) in values.iter_mut().zip(&self.used) {
            *value = at[*i];
        }
        expression.eval_relaxed(&values[..self.used.len()]).unwrap_or(f64::NAN)
    }
}

/// A part of an expression on its way to exmex; constants are folded so that exponents arrive as plain numbers.
enum Part {
    Number(f64),
    Text(String, Terms),
}

/// Number of operands and functions of an expression and its derivatives, as the rules of differentiation write them.
#[derive(Debug, Clone, Copy)]
struct Terms {
    value: f64,
    first: f64,
    second: f64,
}

impl Terms {
    const CONSTANT: Terms = Terms { value: 1.0, first: 0.0, second: 0.0 };
    const VARIABLE: Terms = Terms { value: 1.0, first: 1.0, second: 0.0 };

    /// Of two parts under an operator.
    fn combined(self, sign: char, other: Terms) -> Terms {
        let (a, b) = (self, other);
        // Constant parts and vanishing derivatives are omitted.
        let times = |x: f64, y: f64| if x == 0.0 || y == 0.0 { 0.0 } else { x + y };
        let value = a.value + b.value;
        match sign {
            '+' | '-' => Terms { value, first: a.first + b.first, second: a.second + b.second },
            '*' => Terms {
                value,
                first: times(a.first, b.value) + times(a.value, b.first),
                second: times(a.second, b.value) + 2.0 * times(a.first, b.first) + times(a.value, b.second),
            },
            // (a′b − ab′) / b², and its derivative by the same rule.
            '/' if b.first > 0.0 => {
                let over = times(a.first, b.value) + times(a.value, b.first);
                let again =
                    times(a.second, b.value) + 2.0 * times(a.first, b.first) + times(a.value, b.second);
                Terms {
                    value,
                    first: over + b.value,
                    second: again + 2.0 * over + 4.0 * b.value + 2.0 * b.first,
                }
            }
            '/' => Terms { value, first: a.first + b.value, second: a.second + b.value },
            // b a^(b−1) a′ for a constant power, else a^b (b′ ln a + b a′ / a).
            _ if b.first == 0.0 => Terms { value, ..a.within(value) },
            _ => {
                let inner = times(b.first, a.value) + times(b.value, a.first) + a.value;
                let again = times(b.second, a.value)
                    + times(b.value, a.second)
                    + 4.0 * times(a.first, b.first)
                    + 2.0 * (a.value + a.first);
                Terms { value, first: value + inner, second: value + 2.0 * inner + again }
            }
        }
    }

    /// Of an outer function with `outer` terms: f′(a) a′, and f″(a) a′² + f′(a) a″.
    fn within(self, outer: f64) -> Terms {
        if self.first == 0.0 {
            return Terms { value: outer, ..Terms::CONSTANT };
        }
        let second = outer + 2.0 * self.first + if self.second > 0.0 { outer + self.second } else { 0.0 };
        Terms { value: outer, first: outer + self.first, second }
    }
}

impl Part {
    fn terms(&self) -> Terms {
        match self {
            Part::Number(_) => Terms::CONSTANT,
            Part::Text(_, terms) => *terms,
        }
    }

    fn written(self) -> String {
        match self {
            // `Display` never writes an exponent, which exmex could not read.
            Part::Number(value) if value.is_sign_negative() => format!("(-{})", -value),
            Part::Number(value) => format!("{value}"),
            Part::Text(text, _) => text,
        }
    }
}

#[derive(Debug, Clone, PartialEq)]
enum Token {
    Number(f64),
    Name(String),
    Sign(char),
    End,
}

struct Reader<'a> {
    text: &'a str,
    variables: &'a [&'a str],
    characters: Vec<char>,
    /// The current token, its start, and where the next one is read.
    token: Token,
    start: usize,
    next: usize,
    depth: usize,
}

impl<'a> Reader<'a> {
    fn new(text: &'a str, variables: &'a [&'a str]) -> Self {
        let characters = text.chars().collect();
        Self { text, variables, characters, token: Token::End, start: 0, next: 0, depth: 0 }
    }

    fn error(&self, at: usize, found: impl Into<String>, expected: impl Into<String>) -> ExpressionError {
        ExpressionError {
            text: self.text.to_owned(),
            column: at + 1,
            found: found.into(),
            expected: expected.into(),
        }
    }

    fn unexpected(&self, expected: &str) -> ExpressionError {
        let found = match &self.token {
            Token::Number(value) => format!("the number {value}"),
            Token::Name(name) => format!("`{name}`"),
            Token::Sign(sign) => format!("`{sign}`"),
            Token::End => "the end of the text".to_owned(),
        };
        self.error(self.start, found, expected)
    }

    fn whole(&mut self) -> Result<Part, ExpressionError> {
        if self.characters.len() > LONGEST {
            return Err(self.error(LONGEST, "more text", format!("at most {LONGEST} characters")));
        }
        self.advance()?;
        let part = self.sum()?;
        match self.token {
            Token::End => Ok(part),
            Token::Number(_) | Token::Name(_) | Token::Sign('(') => {
                Err(self.unexpected("an operator between the two, such as `*` (write `2*x`, not `2x`)"))
            }
            Token::Sign(')') => Err(self.unexpected("an opening parenthesis before it")),
            Token::Sign(_) => Err(self.unexpected("an operator or the end of the text")),
        }
    }

    fn advance(&mut self) -> Result<(), ExpressionError> {
        while self.characters.get(self.next).is_some_and(|c| c.is_whitespace()) {
            self.next += 1;
        }
        self.start = self.next;
        let Some(&character) = self.characters.get(self.start) else {
            self.token = Token::End;
            return Ok(());
        };
        let run = |from: usize, admit: &dyn Fn(char) -> bool| {
            self.characters[from..].iter().take_while(|c| admit(**c)).count()
        };
        if character.is_ascii_digit() || character == '.' {
            let mut end = self.start + run(self.start, &|c| c.is_ascii_digit() || c == '.');
            // An exponent belongs to the number only where digits follow; `2*e` keeps its constant.
            if matches!(self.characters.get(end), Some('e' | 'E')) {
                let signed = usize::from(matches!(self.characters.get(end + 1), Some('+' | '-')));
                let digits = run((end + 1 + signed).min(self.characters.len()), &|c| c.is_ascii_digit());
                if digits > 0 {
                    end += 1 + signed + digits;
                }
            }
            let written: String = self.characters[self.start..end].iter().collect();
            let value = written.parse::<f64>().ok().filter(|v| v.is_finite());
            let Some(value) = value else {
                return Err(self.error(
                    self.start,
                    format!("`{written}`"),
                    "a number such as 12, 0.5 or 1e-3",
                ));
            };
            self.token = Token::Number(value);
            self.next = end;
        } else if character.is_alphabetic() || character == '_' {
            let end = self.start + run(self.start, &|c| c.is_alphanumeric() || c == '_');
            self.token = Token::Name(self.characters[self.start..end].iter().collect());
            self.next = end;
        } else if character == '*' && self.characters.get(self.start + 1) == Some(&'*') {
            self.token = Token::Sign('^');
            self.next = self.start + 2;
        } else if "+-*/^()".contains(character) {
            self.token = Token::Sign(character);
            self.next = self.start + 1;
        } else {
            let expected = match character {
                ',' => "a decimal point; functions here take one argument",
                '=' => "the right-hand side alone, without `=`",
                _ => "a number, a variable, a function, a parenthesis or one of + - * / ^",
            };
            return Err(self.error(self.start, format!("`{character}`"), expected));
        }
        Ok(())
    }

    fn sum(&mut self) -> Result<Part, ExpressionError> {
        self.depth += 1;
        if self.depth > DEEPEST {
            return Err(
                self.unexpected(&format!("at most {DEEPEST} nested parentheses, signs and exponents"))
            );
        }
        let mut left = self.product()?;
        while let Token::Sign(sign @ ('+' | '-')) = self.token {
            let at = self.start;
            self.advance()?;
            let right = self.product()?;
            left = self.combined(left, sign, right, at)?;
        }
        self.depth -= 1;
        Ok(left)
    }

    fn product(&mut self) -> Result<Part, ExpressionError> {
        let mut left = self.signed()?;
        while let Token::Sign(sign @ ('*' | '/')) = self.token {
            let at = self.start;
            self.advance()?;
            let right = self.signed()?;
            left = self.combined(left, sign, right, at)?;
        }
        Ok(left)
    }

    fn signed(&mut self) -> Result<Part, ExpressionError> {
        self.depth += 1;
        if self.depth > DEEPEST {
            return Err(
                self.unexpected(&format!("at most {DEEPEST} nested parentheses, signs and exponents"))
            );
        }
        let part = match self.token {
            Token::Sign('-') => {
                self.advance()?;
                match self.signed()? {
                    Part::Number(value) => Part::Number(-value),
                    Part::Text(text, terms) => Part::Text(format!("(-{text})"), terms),
                }
            }
            Token::Sign('+') => {
                self.advance()?;
                self.signed()?
            }
            _ => self.power()?,
        };
        self.depth -= 1;
        Ok(part)
    }

    fn power(&mut self) -> Result<Part, ExpressionError> {
        let base = self.atom()?;
        if self.token != Token::Sign('^') {
            return Ok(base);
        }
        let at = self.start;
        self.advance()?;
        let exponent = self.signed()?;
        self.combined(base, '^', exponent, at)
    }

    fn combined(&self, left: Part, sign: char, right: Part, at: usize) -> Result<Part, ExpressionError> {
        if let (Part::Number(a), Part::Number(b)) = (&left, &right) {
            let value = match sign {
                '+' => a + b,
                '-' => a - b,
                '*' => a * b,
                '/' => a / b,
                _ => a.powf(*b),
            };
            return self.finite(value, at);
        }
        let terms = left.terms().combined(sign, right.terms());
        Ok(Part::Text(format!("({}{sign}{})", left.written(), right.written()), terms))
    }

    fn finite(&self, value: f64, at: usize) -> Result<Part, ExpressionError> {
        if value.is_finite() {
            Ok(Part::Number(value))
        } else {
            Err(self.error(at, format!("a constant that is {value}"), "a finite number"))
        }
    }

    fn atom(&mut self) -> Result<Part, ExpressionError> {
        match self.token.clone() {
            Token::Number(value) => {
                self.advance()?;
                Ok(Part::Number(value))
            }
            Token::Sign('(') => self.parenthesised(),
            Token::Name(name) if self.variables.contains(&name.as_str()) => {
                self.advance()?;
                Ok(Part::Text(name, Terms::VARIABLE))
            }
            Token::Name(name) if FUNCTIONS.contains(&name.as_str()) => {
                let at = self.start;
                self.advance()?;
                if self.token != Token::Sign('(') {
                    return Err(self.unexpected(&format!("`(` after the function `{name}`")));
                }
                match self.parenthesised()? {
                    Part::Number(value) => self.finite(constant(&name, value), at),
                    Part::Text(text, terms) if name == "abs" => {
                        let square = terms.within(terms.value + 1.0);
                        Ok(Part::Text(format!("sqrt(({text})^2)"), square.within(square.value + 1.0)))
                    }
                    Part::Text(text, terms) => {
                        Ok(Part::Text(format!("{name}({text})"), terms.within(terms.value + 1.0)))
                    }
                }
            }
            Token::Name(name) => match CONSTANTS.iter().find(|(known, _)| *known == name) {
                Some((_, value)) => {
                    self.advance()?;
                    Ok(Part::Number(*value))
                }
                None => Err(self.unknown(&name)),
            },
            _ => Err(self.unexpected("a number, a variable, a function or `(`")),
        }
    }

    fn unknown(&self, name: &str) -> ExpressionError {
        let expected = if name == "log" {
            "`ln` or `log10`, to say which logarithm is meant".to_owned()
        } else {
            format!(
                "one of the variables {}, the constants pi, tau, e, or a function ({})",
                self.variables.join(", "),
                FUNCTIONS.join(", ")
            )
        };
        self.error(self.start, format!("the unknown name `{name}`"), expected)
    }

    fn parenthesised(&mut self) -> Result<Part, ExpressionError> {
        let opened = self.start + 1;
        self.advance()?;
        let inner = self.sum()?;
        if self.token != Token::Sign(')') {
            return Err(self.unexpected(&format!("`)` for the `(` at column {opened}")));
        }
        self.advance()?;
        Ok(match inner {
            Part::Number(value) => Part::Number(value),
            Part::Text(text, terms) => Part::Text(format!("({text})"), terms),
        })
    }
}

fn constant(function: &str, value: f64) -> f64 {
    match function {
        "sin" => value.sin(),
        "cos" => value.cos(),
        "tan" => value.tan(),
        "asin" => value.asin(),
        "acos" => value.acos(),
        "atan" => value.atan(),
        "sinh" => value.sinh(),
        "cosh" => value.cosh(),
        "tanh" => value.tanh(),
        "exp" => value.exp(),
        "ln" => value.ln(),
        "log10" => value.log10(),
        "sqrt" => value.sqrt(),
        _ => value.abs(),
    }
}
