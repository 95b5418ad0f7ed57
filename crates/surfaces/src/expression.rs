//! The text of an equation: a small grammar with exact positions, and exact first and second derivatives.
//!
//! **Method.** The text is read by a grammar that knows where each character stands and binds as mathematics does (`-x^2`
//! is −(x²), `2^3^2` is 2^(3²), `1e-3` is a number), into steps in postfix order. They are evaluated on numbers, or on
//! values that carry their gradient and their second derivatives (forward differentiation to second order).
//!
//! **Shapes.** Up to three variables; a gradient of three, a symmetric 3 × 3 matrix of second derivatives (unused
//! rows zero).
//!
//! **Stops.** A text longer than [`MAX_CHARACTERS`] characters or nested deeper than [`MAX_DEPTH`] is refused. The work of an
//! evaluation grows with the length of the text.
//!
//! **Source and departures.** Griewank and Walther, *Evaluating Derivatives*, 2nd ed., ch. 3 and 13. A derivative that
//! vanishes stays zero where the outer function is infinitely steep, as it would by symbolic rules.
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

use std::f64::consts::LN_10;

use nalgebra::{Matrix3, SMatrix, SVector, Vector3};

/// Longest text that is read, in characters.
pub const MAX_CHARACTERS: usize = 2000;
/// Deepest nesting that is read.
pub const MAX_DEPTH: usize = 60;
/// The functions an equation may use.
pub static FUNCTIONS: [Function; 14] = [
    Function("sin", f64::sin, |x, f| [x.cos(), -f]),
    Function("cos", f64::cos, |x, f| [-x.sin(), -f]),
    Function("tan", f64::tan, |_, f| [1.0 + f * f, 2.0 * f * (1.0 + f * f)]),
    Function("asin", f64::asin, |x, _| arc_slopes(x)),
    Function("acos", f64::acos, |x, _| arc_slopes(x).map(|slope| -slope)),
    Function("atan", f64::atan, |x, _| [1.0 / (1.0 + x * x), -2.0 * x / (1.0 + x * x).powi(2)]),
    Function("sinh", f64::sinh, |x, f| [x.cosh(), f]),
    Function("cosh", f64::cosh, |x, f| [x.sinh(), f]),
    Function("tanh", f64::tanh, |_, f| [1.0 - f * f, -2.0 * f * (1.0 - f * f)]),
    Function("exp", f64::exp, |_, f| [f, f]),
    Function("ln", f64::ln, |x, _| [1.0 / x, -1.0 / (x * x)]),
    Function("log10", f64::log10, |x, _| [1.0 / (x * LN_10), -1.0 / (x * x * LN_10)]),
    Function("sqrt", f64::sqrt, |_, f| [0.5 / f, -0.25 / (f * f * f)]),
    // No slope at zero.
    Function("abs", f64::abs, |x, f| [x / f, 0.0]),
];

/// A function of one argument: its name, f(x), and its first and second derivative given x and f(x).
#[derive(Debug, Clone, Copy)]
pub struct Function(pub &'static str, fn(f64) -> f64, fn(f64, f64) -> [f64; 2]);

/// Of the arc sine.
fn arc_slopes(x: f64) -> [f64; 2] {
    let cosine = (1.0 - x * x).sqrt();
    [1.0 / cosine, x / (cosine * cosine * cosine)]
}

/// The constants an equation may use.
pub const CONSTANTS: [(&str, f64); 4] = [
    ("pi", std::f64::consts::PI),
    ("π", std::f64::consts::PI),
    ("tau", std::f64::consts::TAU),
    ("e", std::f64::consts::E),
];

/// Cost of a function beside that of a sum or product.
const FUNCTION_COST: f64 = 5.0;
/// Cost of an evaluation with derivatives beside that of a value.
const DERIVATIVES_COST: f64 = 5.0;

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
    steps: Vec<Step>,
    /// Most values that the steps hold at once.
    depth: usize,
}

/// A step in postfix order: it takes its operands from the end of a stack and puts its result there.
#[derive(Debug, Clone, Copy)]
enum Step {
    Number(f64),
    Variable(usize),
    Operator(char),
    /// To a constant power.
    Power(f64),
    Function(&'static Function),
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
        let steps = Reader::new(text, variables).whole()?.steps();
        let (_, depth) = steps.iter().fold((0, 1), |(top, depth), step| {
            let top = step.top_after(top);
            (top, depth.max(top))
        });
        Ok(Self { text: text.to_owned(), steps, depth })
    }

    /// The text as it was given.
    pub fn text(&self) -> &str {
        &self.text
    }

    /// Cost of a value, and of its derivatives: operands, with functions, which take as long as several sums and products.
    pub(crate) fn terms(&self) -> [f64; 2] {
        let cost = |step: &Step| match step {
            Step::Number(_) | Step::Variable(_) => 1.0,
            Step::Function(_) | Step::Power(_) => FUNCTION_COST,
            Step::Operator(_) => 0.0,
        };
        let value = self.steps.iter().map(cost).sum::<f64>();
        [value, DERIVATIVES_COST * value]
    }

    /// Value at `at`, one number per variable; NaN or infinite where the expression has no value.
    pub fn value(&self, at: &[f64]) -> f64 {
        self.evaluated::<0>(at).value
    }

    /// First derivatives, in the order of the variables; entries beyond them are zero.
    pub fn gradient(&self, at: &[f64]) -> Vector3<f64> {
        self.evaluated::<3>(at).first
    }

    /// Second derivatives, rows and columns in the order of the variables; entries beyond them are zero.
    pub fn hessian(&self, at: &[f64]) -> Matrix3<f64> {
        self.evaluated::<3>(at).second
    }

    fn evaluated<const N: usize>(&self, at: &[f64]) -> Jet<N> {
        // Nearly every equation does without an allocation.
        let (mut few, mut many) = ([Jet::constant(f64::NAN); 8], Vec::new());
        let stack = if self.depth <= few.len() {
            &mut few[..]
        } else {
            many.resize(self.depth, Jet::constant(f64::NAN));
            &mut many[..]
        };
        let mut top = 0;
        for step in &self.steps {
            let last = top.max(1) - 1;
            match *step {
                Step::Number(value) => stack[top] = Jet::constant(value),
                Step::Variable(index) => stack[top] = Jet::variable(index, at[index]),
                Step::Power(exponent) => stack[last] = stack[last].power(exponent),
                Step::Function(function) => stack[last] = stack[last].function(function),
                Step::Operator(sign) => stack[last - 1] = stack[last - 1].operator(sign, &stack[last]),
            }
            top = step.top_after(top);
        }
        stack[0]
    }
}

impl Step {
    /// How many values the stack holds after this step.
    fn top_after(self, top: usize) -> usize {
        match self {
            Step::Number(_) | Step::Variable(_) => top + 1,
            Step::Power(_) | Step::Function(_) => top,
            Step::Operator(_) => top - 1,
        }
    }
}

/// A value with its first and second derivatives in N variables; N = 0 is a plain number.
#[derive(Debug, Clone, Copy)]
struct Jet<const N: usize> {
    value: f64,
    first: SVector<f64, N>,
    second: SMatrix<f64, N, N>,
}

impl<const N: usize> Jet<N> {
    fn constant(value: f64) -> Self {
        Self { value, first: SVector::zeros(), second: SMatrix::zeros() }
    }

    fn variable(index: usize, value: f64) -> Self {
        let first = SVector::from_fn(|row, _| if row == index { 1.0 } else { 0.0 });
        Self { first, ..Self::constant(value) }
    }

    fn operator(&self, sign: char, other: &Self) -> Self {
        let (a, b) = (self, other);
        match sign {
            '+' => Self { value: a.value + b.value, first: a.first + b.first, second: a.second + b.second },
            '-' => Self { value: a.value - b.value, first: a.first - b.first, second: a.second - b.second },
            '*' => {
                let cross = a.first * b.first.transpose();
                let first = a.first * b.value + b.first * a.value;
                let second = a.second * b.value + cross + cross.transpose() + b.second * a.value;
                Self { value: a.value * b.value, first, second }
            }
            // Of q = a / b, from a = q b.
            '/' => {
                let value = a.value / b.value;
                let first = (a.first - b.first * value) / b.value;
                let cross = first * b.first.transpose();
                let second = (a.second - cross - cross.transpose() - b.second * value) / b.value;
                Self { value, first, second }
            }
            // exp(b ln a).
            _ => {
                let value = a.value.powf(b.value);
                let logarithm = a.chain(a.value.ln(), [1.0 / a.value, -1.0 / (a.value * a.value)]);
                b.operator('*', &logarithm).chain(value, [value; 2])
            }
        }
    }

    fn power(&self, exponent: f64) -> Self {
        // A vanishing factor, as of x¹ at zero, is not multiplied with an infinite power.
        let times = |factor: f64, x: f64| if factor == 0.0 { 0.0 } else { factor * x };
        let lower = |factor: f64, power: f64| times(factor, self.value.powf(power));
        let bend = lower(exponent * (exponent - 1.0), exponent - 2.0);
        self.chain(self.value.powf(exponent), [lower(exponent, exponent - 1.0), bend])
    }

    fn function(&self, function: &Function) -> Self {
        let value = (function.1)(self.value);
        self.chain(value, if N == 0 { [0.0; 2] } else { (function.2)(self.value, value) })
    }

    /// f(a), given f, f′ and f″ at the value of a: f′ a′, and f″ a′ a′ᵀ + f′ a″.
    fn chain(&self, value: f64, [slope, bend]: [f64; 2]) -> Self {
        // A derivative that vanishes stays zero where the outer function is infinitely steep.
        let times = |factor: f64| move |x: f64| if x == 0.0 { 0.0 } else { factor * x };
        let second = (self.first * self.first.transpose()).map(times(bend)) + self.second.map(times(slope));
        Self { value, first: self.first.map(times(slope)), second }
    }
}

/// A part of an expression; constants are folded, so that exponents are plain numbers.
enum Part {
    Number(f64),
    Steps(Vec<Step>),
}

impl Part {
    fn steps(self) -> Vec<Step> {
        match self {
            Part::Number(value) => vec![Step::Number(value)],
            Part::Steps(steps) => steps,
        }
    }

    fn then(self, step: Step) -> Part {
        let mut steps = self.steps();
        steps.push(step);
        Part::Steps(steps)
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
        if self.characters.len() > MAX_CHARACTERS {
            return Err(self.error(
                MAX_CHARACTERS,
                "more text",
                format!("at most {MAX_CHARACTERS} characters"),
            ));
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
        if self.depth > MAX_DEPTH {
            return Err(
                self.unexpected(&format!("at most {MAX_DEPTH} nested parentheses, signs and exponents"))
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
        if self.depth > MAX_DEPTH {
            return Err(
                self.unexpected(&format!("at most {MAX_DEPTH} nested parentheses, signs and exponents"))
            );
        }
        let part = match self.token {
            Token::Sign('-') => {
                self.advance()?;
                match self.signed()? {
                    Part::Number(value) => Part::Number(-value),
                    Part::Steps(steps) => {
                        self.combined(Part::Number(-1.0), '*', Part::Steps(steps), self.start)?
                    }
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
        match (left, right) {
            (Part::Number(a), Part::Number(b)) => {
                self.finite(Jet::<0>::constant(a).operator(sign, &Jet::constant(b)).value, at)
            }
            (base, Part::Number(exponent)) if sign == '^' => Ok(base.then(Step::Power(exponent))),
            (left, right) => {
                let mut steps = left.steps();
                steps.append(&mut right.steps());
                Ok(Part::Steps(steps).then(Step::Operator(sign)))
            }
        }
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
            Token::Name(name) => self.named(&name),
            _ => Err(self.unexpected("a number, a variable, a function or `(`")),
        }
    }

    fn named(&mut self, name: &str) -> Result<Part, ExpressionError> {
        let at = self.start;
        if let Some(index) = self.variables.iter().position(|known| *known == name) {
            self.advance()?;
            return Ok(Part::Steps(vec![Step::Variable(index)]));
        }
        if let Some((_, value)) = CONSTANTS.iter().find(|(known, _)| *known == name) {
            self.advance()?;
            return Ok(Part::Number(*value));
        }
        let Some(function) = FUNCTIONS.iter().find(|function| function.0 == name) else {
            return Err(self.unknown(name));
        };
        self.advance()?;
        if self.token != Token::Sign('(') {
            return Err(self.unexpected(&format!("`(` after the function `{name}`")));
        }
        match self.parenthesised()? {
            Part::Number(value) => self.finite((function.1)(value), at),
            part => Ok(part.then(Step::Function(function))),
        }
    }

    fn unknown(&self, name: &str) -> ExpressionError {
        let expected = if name == "log" {
            "`ln` or `log10`, to say which logarithm is meant".to_owned()
        } else {
            format!(
                "one of the variables {}, the constants pi, tau, e, or a function ({})",
                self.variables.join(", "),
                FUNCTIONS.each_ref().map(|function| function.0).join(", ")
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
        Ok(inner)
    }
}
