//! The syntax of RAPID, by recursive descent (ABB, RAPID kernel, chapters 2 to 10).

use std::rc::Rc;

use super::lexer::{Token, tokens};

/// An expression.
#[derive(Debug, Clone, PartialEq)]
pub enum Expr {
    /// A number.
    Number(f64),
    /// A string.
    Text(String),
    /// TRUE or FALSE.
    Truth(bool),
    /// `[a, b, …]`
    List(Vec<Expr>),
    /// A sign before an operand.
    Minus(Box<Expr>),
    /// NOT.
    Not(Box<Expr>),
    /// Two operands.
    Two(&'static str, Box<Expr>, Box<Expr>),
    /// A name with indices and components.
    Place(Place),
    /// A function call.
    Call(String, Vec<Argument>),
}

/// A name with indices and components.
#[derive(Debug, Clone, PartialEq)]
pub struct Place {
    /// Name, in lower case.
    pub name: String,
    /// What follows it.
    pub path: Vec<Part>,
}

/// An index or a component.
#[derive(Debug, Clone, PartialEq)]
pub enum Part {
    /// `{i, j}`
    Index(Vec<Expr>),
    /// `.name`
    Component(String),
}

/// An argument of a call.
#[derive(Debug, Clone, PartialEq)]
pub enum Argument {
    /// By its place.
    Plain(Expr),
    /// By its name.
    Named(String, Expr),
    /// `\name := value`
    Option(String, Expr),
    /// `\name`
    Switch(String),
    /// `\name ? parameter`
    IfPresent(String, String),
}

/// A statement with the byte at which it begins.
#[derive(Debug, Clone, PartialEq)]
pub struct Stmt {
    /// The first byte.
    pub at: usize,
    /// What it is.
    pub kind: Kind,
}

/// Statements.
#[derive(Debug, Clone, PartialEq)]
pub enum Kind {
    /// `;`
    Nothing,
    /// `name:`
    Label(String),
    /// `a := b;`
    Assign(Place, Expr),
    /// A call of a procedure or instruction.
    Call(String, Vec<Argument>),
    /// `%name% …;`
    Late(Expr, Vec<Argument>),
    /// IF with all branches, and ELSE.
    If(Vec<(Expr, Vec<Stmt>)>, Option<Vec<Stmt>>),
    /// FOR.
    For(String, Expr, Expr, Option<Expr>, Vec<Stmt>),
    /// WHILE.
    While(Expr, Vec<Stmt>),
    /// TEST.
    Test(Expr, Vec<(Vec<Expr>, Vec<Stmt>)>, Option<Vec<Stmt>>),
    /// RETURN.
    Return(Option<Expr>),
    /// GOTO.
    Goto(String),
    /// RAISE.
    Raise(Option<Expr>),
    /// RETRY.
    Retry,
    /// TRYNEXT.
    TryNext,
    /// EXIT.
    Exit,
    /// CONNECT.
    Connect(Place, String),
}

/// How data lives.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Storage {
    /// CONST.
    Const,
    /// VAR.
    Var,
    /// PERS.
    Pers,
}

/// A declaration of data.
#[derive(Debug, Clone, PartialEq)]
pub struct Data {
    /// How it lives.
    pub storage: Storage,
    /// Its type.
    pub kind: String,
    /// Its name.
    pub name: String,
    /// Its dimensions.
    pub dims: Vec<Expr>,
    /// Its value at first.
    pub init: Option<Expr>,
}

/// How a parameter is handed over.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Mode {
    /// A copy.
    In,
    /// The caller's own.
    Reference,
}

/// A parameter.
#[derive(Debug, Clone, PartialEq)]
pub struct Parameter {
    /// Whether it may be missing.
    pub optional: bool,
    /// How it is handed over.
    pub mode: Mode,
    /// Its type.
    pub kind: String,
    /// Its name.
    pub name: String,
    /// Number of dimensions.
    pub dims: usize,
}

/// A routine.
#[derive(Debug, Clone, PartialEq)]
pub struct Routine {
    /// Its name.
    pub name: String,
    /// Whether it hands back a value.
    pub function: bool,
    /// Its parameters.
    pub parameters: Vec<Parameter>,
    /// Its data.
    pub data: Vec<Data>,
    /// Its statements.
    pub body: Vec<Stmt>,
    /// Its error handler.
    pub handler: Option<Vec<Stmt>>,
}

/// What a module declares.
#[derive(Debug, Clone, PartialEq)]
pub enum Item {
    /// A record: name, components as type and name.
    Record(String, Vec<(String, String)>),
    /// Another name of a type.
    Alias(String, String),
    /// Data; whether LOCAL.
    Data(Rc<Data>, bool),
    /// A routine; whether LOCAL.
    Routine(Rc<Routine>, bool),
}

/// A module.
#[derive(Debug, Clone, PartialEq)]
pub struct Module {
    /// Its name.
    pub name: String,
    /// What it declares.
    pub items: Vec<Item>,
}

/// Reads a file of modules.
///
/// # Errors
/// Where the text is not RAPID.
pub fn modules(source: &[u8]) -> Result<Vec<Module>, String> {
    let mut parser = Parser { tokens: tokens(source)?, at: 0 };
    let mut out = Vec::new();
    while *parser.here() != Token::End {
        out.push(parser.module()?);
    }
    Ok(out)
}

struct Parser {
    tokens: Vec<(Token, usize)>,
    at: usize,
}

type Read<T> = Result<T, String>;

impl Parser {
    fn here(&self) -> &Token {
        &self.tokens[self.at].0
    }

    fn later(&self, steps: usize) -> &Token {
        &self.tokens[(self.at + steps).min(self.tokens.len() - 1)].0
    }

    fn fail<T>(&self, wanted: &str) -> Read<T> {
        Err(format!("byte {}: expected {wanted}, found {:?}", self.tokens[self.at].1, self.here()))
    }

    fn is(&self, sign: &str) -> bool {
        matches!(self.here(), Token::Sign(s) if *s == sign)
    }

    fn is_word(&self, words: &[&str]) -> bool {
        matches!(self.here(), Token::Name(name) if words.contains(&name.as_str()))
    }

    fn step(&mut self) {
        self.at = (self.at + 1).min(self.tokens.len() - 1);
    }

    fn eat(&mut self, sign: &str) -> bool {
        let there = self.is(sign);
        if there {
            self.step();
        }
        there
    }

    fn eat_word(&mut self, word: &str) -> bool {
        let there = self.is_word(&[word]);
        if there {
            self.step();
        }
        there
    }

    fn sign(&mut self, sign: &str) -> Read<()> {
        if self.eat(sign) { Ok(()) } else { self.fail(sign) }
    }

    fn word(&mut self, word: &str) -> Read<()> {
        if self.eat_word(word) { Ok(()) } else { self.fail(word) }
    }

    fn name(&mut self) -> Read<String> {
        let Token::Name(name) = self.here() else { return self.fail("a name") };
        let name = name.clone();
        self.step();
        Ok(name)
    }

    fn module(&mut self) -> Read<Module> {
        self.word("module")?;
        let name = self.name()?;
        if self.eat("(") {
            while !self.eat(")") {
                self.step();
            }
        }
        let mut items = Vec::new();
        while !self.eat_word("endmodule") {
            items.push(self.item()?);
        }
        Ok(Module { name, items })
    }

    fn item(&mut self) -> Read<Item> {
        let local = self.eat_word("local");
        if self.is_word(&["task"]) {
            self.step();
        }
        if self.eat_word("record") {
            let name = self.name()?;
            let mut components = Vec::new();
            while !self.eat_word("endrecord") {
                let kind = self.name()?;
                components.push((kind, self.name()?));
                self.sign(";")?;
            }
            return Ok(Item::Record(name, components));
        }
        if self.eat_word("alias") {
            let kind = self.name()?;
            let name = self.name()?;
            self.sign(";")?;
            return Ok(Item::Alias(name, kind));
        }
        if self.is_word(&["const", "var", "pers"]) {
            return Ok(Item::Data(Rc::new(self.data()?), local));
        }
        Ok(Item::Routine(Rc::new(self.routine()?), local))
    }

    fn routine(&mut self) -> Read<Routine> {
        let what = self.name()?;
        let end = match what.as_str() {
            "proc" => "endproc",
            "func" => "endfunc",
            "trap" => "endtrap",
            _ => return self.fail("a declaration"),
        };
        if what == "func" {
            self.name()?;
        }
        let name = self.name()?;
        let mut parameters = Vec::new();
        if what != "trap" {
            self.sign("(")?;
            while !self.eat(")") {
                self.eat(",");
                parameters.push(self.parameter()?);
            }
        }
        let mut data = Vec::new();
        while self.is_word(&["const", "var", "pers"]) {
            data.push(self.data()?);
        }
        let body = self.block(&[end, "error"])?;
        let handler = if self.eat_word("error") { Some(self.block(&[end])?) } else { None };
        self.word(end)?;
        Ok(Routine { name, function: what == "func", parameters, data, body, handler })
    }

    fn parameter(&mut self) -> Read<Parameter> {
        let optional = self.eat("\\");
        if optional && self.eat_word("switch") {
            let name = self.name()?;
            return Ok(Parameter { optional, mode: Mode::In, kind: "switch".into(), name, dims: 0 });
        }
        let mut mode = Mode::In;
        if self.is_word(&["var", "pers", "inout"]) {
            self.step();
            mode = Mode::Reference;
        }
        let kind = self.name()?;
        let name = self.name()?;
        let mut dims = 0;
        if self.eat("{") {
            while !self.eat("}") {
                dims += usize::from(self.is("*"));
                self.step();
            }
        }
        Ok(Parameter { optional, mode, kind, name, dims })
    }

    fn data(&mut self) -> Read<Data> {
        let storage = match self.name()?.as_str() {
            "const" => Storage::Const,
            "var" => Storage::Var,
            _ => Storage::Pers,
        };
        let kind = self.name()?;
        let name = self.name()?;
        let mut dims = Vec::new();
        if self.eat("{") {
            dims = self.list("}")?;
        }
        let init = if self.eat(":=") { Some(self.expr()?) } else { None };
        self.sign(";")?;
        Ok(Data { storage, kind, name, dims, init })
    }

    /// Expressions with commas up to a sign, which is taken too.
    fn list(&mut self, end: &str) -> Read<Vec<Expr>> {
        let mut out = Vec::new();
        loop {
            out.push(self.expr()?);
            if self.eat(end) {
                return Ok(out);
            }
            self.sign(",")?;
        }
    }

    fn block(&mut self, ends: &[&str]) -> Read<Vec<Stmt>> {
        let mut out = Vec::new();
        while !self.is_word(ends) {
            if *self.here() == Token::End {
                return self.fail(ends[0]);
            }
            out.push(self.stmt()?);
        }
        Ok(out)
    }

    fn stmt(&mut self) -> Read<Stmt> {
        let at = self.tokens[self.at].1;
        Ok(Stmt { at, kind: self.kind()? })
    }

    fn kind(&mut self) -> Read<Kind> {
        if self.eat(";") {
            return Ok(Kind::Nothing);
        }
        if self.eat("%") {
            let name = self.expr()?;
            self.sign("%")?;
            let arguments = self.arguments(";")?;
            return Ok(Kind::Late(name, arguments));
        }
        let Token::Name(word) = self.here() else { return self.fail("a statement") };
        if *self.later(1) == Token::Sign(":") {
            let label = self.name()?;
            self.step();
            return Ok(Kind::Label(label));
        }
        let word = word.clone();
        let begin = self.at;
        self.step();
        let simple = match word.as_str() {
            "if" => return self.branches(),
            "for" => return self.counted(),
            "while" => {
                let condition = self.expr()?;
                self.word("do")?;
                let body = self.block(&["endwhile"])?;
                self.step();
                return Ok(Kind::While(condition, body));
            }
            "test" => return self.cases(),
            "return" => Kind::Return(if self.is(";") { None } else { Some(self.expr()?) }),
            "raise" => Kind::Raise(if self.is(";") { None } else { Some(self.expr()?) }),
            "goto" => Kind::Goto(self.name()?),
            "retry" => Kind::Retry,
            "trynext" => Kind::TryNext,
            "exit" => Kind::Exit,
            "connect" => {
                let place = self.place()?;
                self.word("with")?;
                Kind::Connect(place, self.name()?)
            }
            _ => {
                self.at = begin;
                return self.assignment_or_call();
            }
        };
        self.sign(";")?;
        Ok(simple)
    }

    fn assignment_or_call(&mut self) -> Read<Kind> {
        let begin = self.at;
        if let Ok(place) = self.place()
            && self.eat(":=")
        {
            let value = self.expr()?;
            self.sign(";")?;
            return Ok(Kind::Assign(place, value));
        }
        self.at = begin;
        let name = self.name()?;
        let arguments = self.arguments(";")?;
        Ok(Kind::Call(name, arguments))
    }

    fn branches(&mut self) -> Read<Kind> {
        let condition = self.expr()?;
        if !self.eat_word("then") {
            let only = self.stmt()?;
            return Ok(Kind::If(vec![(condition, vec![only])], None));
        }
        let ends = ["elseif", "else", "endif"];
        let mut branches = vec![(condition, self.block(&ends)?)];
        while self.eat_word("elseif") {
            let condition = self.expr()?;
            self.word("then")?;
            branches.push((condition, self.block(&ends)?));
        }
        let rest = if self.eat_word("else") { Some(self.block(&["endif"])?) } else { None };
        self.word("endif")?;
        Ok(Kind::If(branches, rest))
    }

    fn counted(&mut self) -> Read<Kind> {
        let name = self.name()?;
        self.word("from")?;
        let from = self.expr()?;
        self.word("to")?;
        let to = self.expr()?;
        let step = if self.eat_word("step") { Some(self.expr()?) } else { None };
        self.word("do")?;
        let body = self.block(&["endfor"])?;
        self.step();
        Ok(Kind::For(name, from, to, step, body))
    }

    fn cases(&mut self) -> Read<Kind> {
        let value = self.expr()?;
        let (mut cases, mut default) = (Vec::new(), None);
        loop {
            if self.eat_word("endtest") {
                return Ok(Kind::Test(value, cases, default));
            }
            if self.eat_word("default") {
                self.sign(":")?;
                default = Some(self.block(&["endtest"])?);
            } else {
                self.word("case")?;
                let values = self.list(":")?;
                cases.push((values, self.block(&["case", "default", "endtest"])?));
            }
        }
    }

    fn arguments(&mut self, end: &str) -> Read<Vec<Argument>> {
        let mut out = Vec::new();
        while !self.eat(end) {
            if self.eat(",") {
                continue;
            }
            out.push(self.argument()?);
        }
        Ok(out)
    }

    fn argument(&mut self) -> Read<Argument> {
        if self.eat("\\") {
            let name = self.name()?;
            return Ok(if self.eat(":=") {
                Argument::Option(name, self.expr()?)
            } else if self.eat("?") {
                Argument::IfPresent(name, self.name()?)
            } else {
                Argument::Switch(name)
            });
        }
        if matches!(self.here(), Token::Name(_)) && *self.later(1) == Token::Sign(":=") {
            let name = self.name()?;
            self.step();
            return Ok(Argument::Named(name, self.expr()?));
        }
        Ok(Argument::Plain(self.expr()?))
    }

    fn place(&mut self) -> Read<Place> {
        let name = self.name()?;
        let mut path = Vec::new();
        loop {
            if self.eat("{") {
                path.push(Part::Index(self.list("}")?));
            } else if self.eat(".") {
                path.push(Part::Component(self.name()?));
            } else {
                return Ok(Place { name, path });
            }
        }
    }

    fn expr(&mut self) -> Read<Expr> {
        let mut left = self.conjunction()?;
        while self.is_word(&["or", "xor"]) {
            let word = if self.is_word(&["or"]) { "or" } else { "xor" };
            self.step();
            left = Expr::Two(word, Box::new(left), Box::new(self.conjunction()?));
        }
        Ok(left)
    }

    fn conjunction(&mut self) -> Read<Expr> {
        let mut left = self.negation()?;
        while self.eat_word("and") {
            left = Expr::Two("and", Box::new(left), Box::new(self.negation()?));
        }
        Ok(left)
    }

    fn negation(&mut self) -> Read<Expr> {
        if self.eat_word("not") { Ok(Expr::Not(Box::new(self.negation()?))) } else { self.relation() }
    }

    fn relation(&mut self) -> Read<Expr> {
        let mut left = self.sum()?;
        while let Token::Sign(sign @ ("=" | "<>" | "<" | ">" | "<=" | ">=")) = *self.here() {
            self.step();
            left = Expr::Two(sign, Box::new(left), Box::new(self.sum()?));
        }
        Ok(left)
    }

    fn sum(&mut self) -> Read<Expr> {
        let mut left = if self.eat("-") {
            Expr::Minus(Box::new(self.product()?))
        } else {
            self.eat("+");
            self.product()?
        };
        while let Token::Sign(sign @ ("+" | "-")) = *self.here() {
            self.step();
            left = Expr::Two(sign, Box::new(left), Box::new(self.product()?));
        }
        Ok(left)
    }

    fn product(&mut self) -> Read<Expr> {
        let mut left = self.primary()?;
        loop {
            let word = match self.here() {
                Token::Sign(sign @ ("*" | "/")) => *sign,
                Token::Name(name) if name == "div" => "div",
                Token::Name(name) if name == "mod" => "mod",
                _ => return Ok(left),
            };
            self.step();
            left = Expr::Two(word, Box::new(left), Box::new(self.primary()?));
        }
    }

    fn primary(&mut self) -> Read<Expr> {
        match self.here().clone() {
            Token::Number(value) => {
                self.step();
                Ok(Expr::Number(value))
            }
            Token::Text(text) => {
                self.step();
                Ok(Expr::Text(text))
            }
            Token::Sign("-") => {
                self.step();
                Ok(Expr::Minus(Box::new(self.primary()?)))
            }
            Token::Sign("(") => {
                self.step();
                let inner = self.expr()?;
                self.sign(")")?;
                Ok(inner)
            }
            Token::Sign("[") => {
                self.step();
                Ok(Expr::List(if self.eat("]") { Vec::new() } else { self.list("]")? }))
            }
            Token::Name(name) if name == "true" || name == "false" => {
                self.step();
                Ok(Expr::Truth(name == "true"))
            }
            Token::Name(name) if *self.later(1) == Token::Sign("(") => {
                self.step();
                self.step();
                Ok(Expr::Call(name, self.arguments(")")?))
            }
            Token::Name(_) => Ok(Expr::Place(self.place()?)),
            _ => self.fail("an expression"),
        }
    }
}
