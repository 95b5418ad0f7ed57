//! Running RAPID: statements, calls, errors, interrupts (ABB, RAPID kernel, and the reference of instructions).

use std::cell::{Cell, RefCell};
use std::collections::{BTreeMap, HashMap};
use std::rc::Rc;

use super::parser::{Argument, Data, Expr, Item, Kind, Mode, Module, Part, Place, Routine, Stmt, Storage};
use super::value::{Types, Value};
use crate::arm::Pose;

/// Data while the program runs.
#[derive(Debug)]
pub struct Box_ {
    /// Its name.
    pub name: String,
    /// Its type.
    pub kind: String,
    pub(super) value: RefCell<Value>,
    /// What is still to be worked out: the declaration, in its module.
    pending: RefCell<Option<(Rc<Data>, usize)>>,
}

/// A place in data.
#[derive(Debug, Clone)]
pub struct Ref {
    /// The data.
    pub data: Rc<Box_>,
    path: Vec<usize>,
    kind: String,
}

#[derive(Debug, Clone)]
enum Symbol {
    Data(Ref),
    /// A parameter that is missing.
    Missing,
    Routine(Rc<Routine>, usize),
}

type Scope = HashMap<String, Symbol>;

/// Why execution leaves a statement.
#[derive(Debug, Clone, PartialEq)]
pub enum Stop {
    /// An error; a handler of the routine may take it.
    Error(i32),
    /// An error that leaves the routine.
    Raised(i32),
    /// RETRY in a handler.
    Retry,
    /// TRYNEXT in a handler.
    TryNext,
    /// The program ends.
    Exit,
    /// The budget of statements is used up.
    Budget,
    /// The interpreter does not know something.
    Unknown(String),
}

impl From<String> for Stop {
    fn from(text: String) -> Self {
        Stop::Unknown(text)
    }
}

enum Flow {
    On,
    Return(Option<Value>),
    Goto(String),
}

type Ran<T> = Result<T, Stop>;

/// Where a motion goes.
#[derive(Debug, Clone, PartialEq)]
pub enum Goal {
    /// A pose of the tool in the base, as told, and its configuration.
    Pose {
        /// In the object with its displacement.
        in_object: Pose,
        /// The told displacement of the program.
        displaced: Pose,
        /// `robconf`.
        conf: [i32; 4],
    },
    /// Joints (rad).
    Joints([f64; 6]),
}

/// How a motion goes.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Way {
    /// Joints in proportion.
    Joint,
    /// A line.
    Line,
    /// An arc.
    Arc,
}

/// A mass on the flange: kg, centre on the flange (mm).
pub type Load = (f64, [f64; 3]);

/// A motion that was executed.
#[derive(Debug, Clone, PartialEq)]
pub struct Motion {
    /// File and byte of its statement.
    pub at: (usize, usize),
    /// How it goes.
    pub way: Way,
    /// The circle point, then the end.
    pub goals: Vec<Goal>,
    /// Name of the tool's data, and the tool: held by the robot, frame.
    pub tool: (String, bool, Pose),
    /// Name of the object's data, and the object: held by the robot, user frame, object frame.
    pub object: (String, bool, Pose, Pose),
    /// Whether its configuration is monitored.
    pub monitored: bool,
    /// Whether the last three joints go in proportion on a line or an arc (SingArea \Wrist).
    pub wrist: bool,
    /// What the arm carries.
    pub load: Load,
    /// What it carries without what is gripped.
    pub tool_load: Load,
    /// Speed, zone and what else stands behind the targets.
    pub rest: String,
}

/// Something that happened.
#[derive(Debug, Clone, PartialEq)]
pub enum Event {
    /// A motion.
    Motion(Box<Motion>),
    /// Anything else, in words.
    Said(String),
}

pub(super) struct Frame {
    locals: RefCell<Scope>,
    module: usize,
    routine: Rc<Routine>,
    handling: Cell<bool>,
}

/// The state of a run.
pub struct Run<'a> {
    pub(super) types: Types,
    modules: Vec<(Scope, usize)>,
    global: Scope,
    /// What happened.
    pub events: Vec<Event>,
    /// Statements that may still run.
    budget: usize,
    /// Statements that have run: the clock of interrupts and inputs.
    clock: u64,
    seed: u64,
    in_function: usize,
    depth: usize,
    traps: Vec<(Rc<Routine>, usize)>,
    pub(super) asleep: bool,
    in_trap: bool,
    /// Whether a statement was put in by the correction: it takes no time.
    inserted: &'a dyn Fn(usize, usize) -> bool,
    pub(super) state: State,
    /// Why it ended, where that was not at its end.
    pub ended: Option<Stop>,
}

/// What instructions switch.
#[derive(Debug, Clone)]
pub(super) struct State {
    pub(super) monitor_lines: bool,
    pub(super) monitor_joints: bool,
    pub(super) displaced: Pose,
    pub(super) grip: Option<Load>,
    pub(super) others: std::collections::BTreeMap<String, String>,
}

impl<'a> Run<'a> {
    /// Reads the modules of a task.
    ///
    /// # Errors
    /// Where a file cannot be read.
    pub fn new(
        files: &[&[u8]],
        seed: u64,
        inserted: &'a dyn Fn(usize, usize) -> bool,
    ) -> Result<Self, String> {
        let mut run = Run {
            types: Types::default(),
            modules: Vec::new(),
            global: HashMap::new(),
            events: Vec::new(),
            budget: 700,
            clock: 0,
            seed,
            in_function: 0,
            depth: 0,
            traps: Vec::new(),
            asleep: false,
            in_trap: false,
            inserted,
            state: State {
                monitor_lines: true,
                monitor_joints: true,
                displaced: Pose::identity(),
                grip: None,
                others: Default::default(),
            },
            ended: None,
        };
        let mut modules: Vec<(Module, usize)> = Vec::new();
        for (file, source) in files.iter().enumerate() {
            modules.extend(super::parser::modules(source)?.into_iter().map(|m| (m, file)));
        }
        for item in modules.iter().flat_map(|(module, _)| &module.items) {
            match item {
                Item::Record(name, components) => run.types.record(name, components.clone()),
                Item::Alias(name, kind) => run.types.alias(name, kind),
                _ => {}
            }
        }
        super::builtin::predefined(&mut |name, kind, value| {
            let data = Rc::new(Box_ {
                name: name.to_owned(),
                kind: kind.to_owned(),
                value: RefCell::new(value),
                pending: RefCell::new(None),
            });
            run.global
                .insert(name.to_owned(), Symbol::Data(Ref { data, path: Vec::new(), kind: kind.to_owned() }));
        });
        for (index, (module, file)) in modules.into_iter().enumerate() {
            let mut scope = Scope::new();
            for item in module.items {
                let (name, symbol, local) = match item {
                    Item::Data(data, local) => {
                        let kind = data.kind.clone();
                        let made = Rc::new(Box_ {
                            name: data.name.clone(),
                            kind: kind.clone(),
                            value: RefCell::new(Value::Nothing),
                            pending: RefCell::new(Some((data.clone(), index))),
                        });
                        (data.name.clone(), Symbol::Data(Ref { data: made, path: Vec::new(), kind }), local)
                    }
                    Item::Routine(routine, local) => {
                        (routine.name.clone(), Symbol::Routine(routine, index), local)
                    }
                    _ => continue,
                };
                if !local {
                    run.global.insert(name.clone(), symbol.clone());
                }
                scope.insert(name, symbol);
            }
            run.modules.push((scope, file));
        }
        Ok(run)
    }

    /// Runs main so many times.
    pub fn main(&mut self, cycles: usize) {
        let main = self.modules.iter().find_map(|(scope, _)| match scope.get("main") {
            Some(Symbol::Routine(routine, module)) => Some((routine.clone(), *module)),
            _ => None,
        });
        let Some((main, module)) = main else {
            self.ended = Some(Stop::Unknown("no main".into()));
            return;
        };
        for _ in 0..cycles {
            if let Err(stop) = self.routine(&main, module, Scope::new()) {
                self.ended = Some(stop);
                return;
            }
        }
    }

    /// The values of numbers, truths and texts of all modules that were ever read or written, in words, by module and name.
    pub fn plain_data(&self) -> BTreeMap<(usize, String), String> {
        let mut out = BTreeMap::new();
        for (index, (scope, _)) in self.modules.iter().enumerate() {
            for (name, symbol) in scope {
                if let Symbol::Data(place) = symbol
                    && matches!(place.kind.as_str(), "num" | "bool" | "string")
                    && place.data.pending.borrow().is_none()
                {
                    out.insert((index, name.clone()), said(&place.data.value.borrow()));
                }
            }
        }
        out
    }

    pub(super) fn chance(&self, what: &str) -> u64 {
        let mut hash = self.seed ^ 0x9e37_79b9_7f4a_7c15;
        for byte in self.clock.to_le_bytes().into_iter().chain(what.bytes()) {
            hash = (hash ^ u64::from(byte)).wrapping_mul(0x0100_0000_01b3);
            hash ^= hash >> 29;
        }
        hash >> 7
    }

    pub(super) fn say(&mut self, text: String) {
        self.events.push(Event::Said(text));
    }

    fn tick(&mut self) -> Ran<()> {
        if self.in_function > 0 {
            return Ok(());
        }
        self.clock += 1;
        if self.budget == 0 {
            return Err(Stop::Budget);
        }
        self.budget -= 1;
        if !self.traps.is_empty() && !self.in_trap && !self.asleep && self.chance("trap").is_multiple_of(31) {
            let which = self.chance("which") as usize % self.traps.len();
            let (routine, module) = self.traps[which].clone();
            self.in_trap = true;
            let ran = self.routine(&routine, module, Scope::new());
            self.in_trap = false;
            ran?;
        }
        Ok(())
    }

    fn look(&self, name: &str, frame: &Frame) -> Option<Symbol> {
        if let Some(symbol) = frame.locals.borrow().get(name) {
            return Some(symbol.clone());
        }
        self.modules.get(frame.module).and_then(|m| m.0.get(name)).or_else(|| self.global.get(name)).cloned()
    }

    fn settle(&mut self, data: &Box_) -> Ran<()> {
        let pending = data.pending.borrow_mut().take();
        let Some((declared, module)) = pending else { return Ok(()) };
        let frame = Frame {
            locals: RefCell::default(),
            module,
            routine: Rc::new(Routine {
                name: String::new(),
                function: false,
                parameters: Vec::new(),
                data: Vec::new(),
                body: Vec::new(),
                handler: None,
            }),
            handling: Cell::new(false),
        };
        let value = self.initial(&declared, &frame)?;
        *data.value.borrow_mut() = value;
        Ok(())
    }

    fn initial(&mut self, data: &Data, frame: &Frame) -> Ran<Value> {
        if let Some(init) = &data.init {
            return self.value(init, frame);
        }
        let mut dims = Vec::new();
        for dim in &data.dims {
            dims.push(self.value(dim, frame)?.number()? as usize);
        }
        Ok(self.types.zero(&data.kind, &dims))
    }

    pub(super) fn place(&mut self, place: &Place, frame: &Frame) -> Ran<Ref> {
        let mut out = match self.look(&place.name, frame) {
            Some(Symbol::Data(place)) => place,
            _ => return Err(Stop::Unknown(format!("no data {}", place.name))),
        };
        self.settle(&out.data.clone())?;
        for part in &place.path {
            match part {
                Part::Index(list) => {
                    for index in list {
                        let index = self.value(index, frame)?.number()?;
                        if index < 1.0 {
                            return Err(Stop::Error(ERR_RANGE));
                        }
                        out.path.push(index.round() as usize - 1);
                    }
                }
                Part::Component(name) => {
                    let (index, kind) = self.types.component(&out.kind, name)?;
                    out.path.push(index);
                    out.kind = kind;
                }
            }
        }
        Ok(out)
    }

    pub(super) fn get(&self, place: &Ref) -> Ran<Value> {
        let value = place.data.value.borrow();
        let mut here = &*value;
        for index in &place.path {
            let Value::List(list) = here else { return Err(Stop::Unknown("no parts".into())) };
            here = list.get(*index).ok_or(Stop::Error(ERR_RANGE))?;
        }
        Ok(here.clone())
    }

    pub(super) fn put(&self, place: &Ref, value: Value) -> Ran<()> {
        let mut whole = place.data.value.borrow_mut();
        let mut here = &mut *whole;
        for index in &place.path {
            let Value::List(list) = here else { return Err(Stop::Unknown("no parts".into())) };
            here = list.get_mut(*index).ok_or(Stop::Error(ERR_RANGE))?;
        }
        *here = value;
        Ok(())
    }

    pub(super) fn value(&mut self, expr: &Expr, frame: &Frame) -> Ran<Value> {
        Ok(match expr {
            Expr::Number(value) => Value::Number(*value),
            Expr::Text(text) => Value::Text(text.as_str().into()),
            Expr::Truth(truth) => Value::Truth(*truth),
            Expr::List(list) => {
                let mut out = Vec::with_capacity(list.len());
                for part in list {
                    out.push(self.value(part, frame)?);
                }
                Value::List(out)
            }
            Expr::Minus(inner) => negative(&self.value(inner, frame)?)?,
            Expr::Not(inner) => Value::Truth(!self.value(inner, frame)?.truth()?),
            Expr::Two(sign, left, right) => {
                let left = self.value(left, frame)?;
                let right = self.value(right, frame)?;
                two(sign, &left, &right)?
            }
            Expr::Place(place) => {
                let place = self.place(place, frame)?;
                self.get(&place)?
            }
            Expr::Call(name, arguments) => {
                if let Some(Symbol::Routine(routine, module)) = self.look(name, frame) {
                    let scope = self.bind(&routine, module, arguments, frame)?;
                    self.in_function += 1;
                    let ran = self.routine(&routine, module, scope);
                    self.in_function -= 1;
                    ran?.ok_or_else(|| Stop::Unknown(format!("{name} hands back nothing")))?
                } else {
                    self.function(name, arguments, frame)?
                }
            }
        })
    }

    /// Whether a parameter is there.
    pub(super) fn present(&self, name: &str, frame: &Frame) -> bool {
        matches!(self.look(name, frame), Some(Symbol::Data(_)))
    }

    fn bind(
        &mut self,
        routine: &Rc<Routine>,
        module: usize,
        arguments: &[Argument],
        frame: &Frame,
    ) -> Ran<Scope> {
        let _ = module;
        let mut scope = Scope::new();
        let mut required = routine.parameters.iter().filter(|p| !p.optional);
        for argument in arguments {
            let find = |name: &str| routine.parameters.iter().find(|p| p.name == *name);
            let (parameter, expr) = match argument {
                Argument::Plain(expr) => (required.next(), Some(expr.clone())),
                Argument::Named(name, expr) => {
                    required.next();
                    (find(name), Some(expr.clone()))
                }
                Argument::Option(name, expr) => (find(name), Some(expr.clone())),
                Argument::Switch(name) => (find(name), None),
                Argument::IfPresent(name, source) => {
                    if !self.present(source, frame) {
                        continue;
                    }
                    let whole = Place { name: source.clone(), path: Vec::new() };
                    (find(name), Some(Expr::Place(whole)))
                }
            };
            let parameter =
                parameter.ok_or_else(|| Stop::Unknown(format!("{}: too many arguments", routine.name)))?;
            let made = match (&expr, parameter.mode) {
                (Some(Expr::Place(place)), Mode::Reference) => self.place(place, frame)?,
                (Some(expr), _) => {
                    let value = self.value(expr, frame)?;
                    local(&parameter.name, &parameter.kind, value)
                }
                (None, _) => local(&parameter.name, &parameter.kind, Value::Truth(true)),
            };
            scope.insert(parameter.name.clone(), Symbol::Data(made));
        }
        for parameter in &routine.parameters {
            scope.entry(parameter.name.clone()).or_insert(Symbol::Missing);
        }
        Ok(scope)
    }

    fn routine(&mut self, routine: &Rc<Routine>, module: usize, scope: Scope) -> Ran<Option<Value>> {
        if self.depth > 40 {
            return Err(Stop::Unknown("too deep".into()));
        }
        self.depth += 1;
        let frame = Frame {
            locals: RefCell::new(scope),
            module,
            routine: routine.clone(),
            handling: Cell::new(false),
        };
        let ran = self.body(routine, &frame);
        self.depth -= 1;
        match ran {
            Err(Stop::Raised(number)) => Err(Stop::Error(number)),
            Err(stop) => Err(stop),
            Ok(Flow::Return(value)) => Ok(value),
            Ok(Flow::On) => Ok(None),
            Ok(Flow::Goto(label)) => Err(Stop::Unknown(format!("no label {label}"))),
        }
    }

    fn body(&mut self, routine: &Routine, frame: &Frame) -> Ran<Flow> {
        for data in &routine.data {
            if data.storage == Storage::Pers {
                return Err(Stop::Unknown("PERS in a routine".into()));
            }
            let value = self.initial(data, frame)?;
            frame
                .locals
                .borrow_mut()
                .insert(data.name.clone(), Symbol::Data(local(&data.name, &data.kind, value)));
        }
        self.block(&routine.body, frame)
    }

    fn block(&mut self, block: &[Stmt], frame: &Frame) -> Ran<Flow> {
        let mut next = 0;
        while let Some(stmt) = block.get(next) {
            next += 1;
            match self.guarded(stmt, frame)? {
                Flow::On => {}
                Flow::Goto(label) => {
                    match block.iter().position(|s| matches!(&s.kind, Kind::Label(l) if *l == label)) {
                        Some(index) => next = index,
                        None => return Ok(Flow::Goto(label)),
                    }
                }
                flow => return Ok(flow),
            }
        }
        Ok(Flow::On)
    }

    /// A statement with the routine's error handler.
    fn guarded(&mut self, stmt: &Stmt, frame: &Frame) -> Ran<Flow> {
        loop {
            let number = match self.stmt(stmt, frame) {
                Err(Stop::Error(number)) => number,
                other => return other,
            };
            let routine = frame.routine.clone();
            let Some(handler) = routine.handler.as_ref().filter(|_| !frame.handling.get()) else {
                return Err(Stop::Raised(number));
            };
            frame.handling.set(true);
            let handled = self.block(handler, frame);
            frame.handling.set(false);
            match handled {
                Err(Stop::Retry) => self.tick()?,
                Err(Stop::TryNext) => return Ok(Flow::On),
                Err(Stop::Error(number)) => return Err(Stop::Raised(number)),
                Err(stop) => return Err(stop),
                Ok(Flow::On) => return Ok(Flow::Return(None)),
                Ok(flow) => return Ok(flow),
            }
        }
    }

    fn stmt(&mut self, stmt: &Stmt, frame: &Frame) -> Ran<Flow> {
        let file = self.modules[frame.module].1;
        if !(self.inserted)(file, stmt.at) {
            self.tick()?;
        }
        match &stmt.kind {
            Kind::Nothing | Kind::Label(_) => {}
            Kind::Assign(place, value) => {
                let value = self.value(value, frame)?;
                let place = self.place(place, frame)?;
                self.put(&place, value)?;
            }
            Kind::Call(name, arguments) => self.call(name, arguments, (file, stmt.at), frame)?,
            Kind::Late(name, arguments) => {
                let name = self.value(name, frame)?.text()?.to_lowercase();
                if !matches!(self.look(&name, frame), Some(Symbol::Routine(..))) {
                    return Err(Stop::Error(ERR_REFUNKPRC));
                }
                self.call(&name, arguments, (file, stmt.at), frame)?;
            }
            Kind::If(branches, rest) => {
                for (condition, block) in branches {
                    if self.value(condition, frame)?.truth()? {
                        return self.block(block, frame);
                    }
                }
                if let Some(rest) = rest {
                    return self.block(rest, frame);
                }
            }
            Kind::For(name, from, to, step, body) => {
                return self.counted(name, [from, to], step.as_ref(), body, frame);
            }
            Kind::While(condition, body) => {
                while self.value(condition, frame)?.truth()? {
                    match self.block(body, frame)? {
                        Flow::On => self.tick()?,
                        flow => return Ok(flow),
                    }
                }
            }
            Kind::Test(value, cases, rest) => {
                let value = self.value(value, frame)?;
                for (values, block) in cases {
                    for case in values {
                        if self.value(case, frame)? == value {
                            return self.block(block, frame);
                        }
                    }
                }
                if let Some(rest) = rest {
                    return self.block(rest, frame);
                }
            }
            Kind::Return(None) => return Ok(Flow::Return(None)),
            Kind::Return(Some(value)) => return Ok(Flow::Return(Some(self.value(value, frame)?))),
            Kind::Goto(label) => return Ok(Flow::Goto(label.clone())),
            Kind::Raise(number) => {
                let number = match number {
                    Some(number) => self.value(number, frame)?.number()? as i32,
                    None => 0,
                };
                // From the body to the own handler, from there to the caller's.
                return Err(if frame.handling.get() { Stop::Raised(number) } else { Stop::Error(number) });
            }
            Kind::Retry => return Err(Stop::Retry),
            Kind::TryNext => return Err(Stop::TryNext),
            Kind::Exit => return Err(Stop::Exit),
            Kind::Connect(_, trap) => match self.look(trap, frame) {
                Some(Symbol::Routine(routine, module)) => self.traps.push((routine, module)),
                _ => return Err(Stop::Unknown(format!("no trap {trap}"))),
            },
        }
        Ok(Flow::On)
    }

    fn counted(
        &mut self,
        name: &str,
        [from, to]: [&Expr; 2],
        step: Option<&Expr>,
        body: &[Stmt],
        frame: &Frame,
    ) -> Ran<Flow> {
        let from = self.value(from, frame)?.number()?;
        let to = self.value(to, frame)?.number()?;
        let step = match step {
            Some(step) => self.value(step, frame)?.number()?,
            None if from <= to => 1.0,
            None => -1.0,
        };
        let hidden = frame.locals.borrow().get(name).cloned();
        let mut here = from;
        let mut out = Flow::On;
        while (step > 0.0 && here <= to) || (step < 0.0 && here >= to) {
            let counter = Symbol::Data(local(name, "num", Value::Number(here)));
            frame.locals.borrow_mut().insert(name.to_owned(), counter);
            self.tick()?;
            match self.block(body, frame)? {
                Flow::On => here += step,
                flow => {
                    out = flow;
                    break;
                }
            }
        }
        match hidden {
            Some(symbol) => frame.locals.borrow_mut().insert(name.to_owned(), symbol),
            None => frame.locals.borrow_mut().remove(name),
        };
        Ok(out)
    }

    fn call(&mut self, name: &str, arguments: &[Argument], at: (usize, usize), frame: &Frame) -> Ran<()> {
        if let Some(Symbol::Routine(routine, module)) = self.look(name, frame) {
            let scope = self.bind(&routine, module, arguments, frame)?;
            self.routine(&routine, module, scope)?;
            return Ok(());
        }
        self.instruction(name, arguments, at, frame)
    }
}

/// ERR_ARRIDX and the like.
const ERR_RANGE: i32 = 1001;
/// ERR_REFUNKPRC.
const ERR_REFUNKPRC: i32 = 1002;
/// ERR_DIVZERO.
const ERR_DIVZERO: i32 = 1003;

fn local(name: &str, kind: &str, value: Value) -> Ref {
    let data = Rc::new(Box_ {
        name: name.to_owned(),
        kind: kind.to_owned(),
        value: RefCell::new(value),
        pending: RefCell::new(None),
    });
    Ref { data, path: Vec::new(), kind: kind.to_owned() }
}

/// A value in words, numbers to six decimals.
pub(super) fn said(value: &Value) -> String {
    match value {
        Value::Number(n) => format!("{:.6}", n + 0.0),
        Value::Truth(t) => t.to_string(),
        Value::Text(t) => format!("{t:?}"),
        Value::List(list) => format!("[{}]", list.iter().map(said).collect::<Vec<_>>().join(",")),
        Value::Nothing => "–".to_owned(),
    }
}

fn negative(value: &Value) -> Result<Value, Stop> {
    Ok(match value {
        Value::Number(n) => Value::Number(-n),
        Value::List(list) => Value::List(list.iter().map(negative).collect::<Result<_, _>>()?),
        _ => return Err(Stop::Unknown("minus of what is no number".into())),
    })
}

fn two(sign: &str, left: &Value, right: &Value) -> Result<Value, Stop> {
    let numbers = || -> Result<(f64, f64), Stop> { Ok((left.number()?, right.number()?)) };
    Ok(match (sign, left, right) {
        ("=", _, _) => Value::Truth(left == right),
        ("<>", _, _) => Value::Truth(left != right),
        ("and", _, _) => Value::Truth(left.truth()? && right.truth()?),
        ("or", _, _) => Value::Truth(left.truth()? || right.truth()?),
        ("xor", _, _) => Value::Truth(left.truth()? != right.truth()?),
        ("+", Value::Text(a), Value::Text(b)) => Value::Text(format!("{a}{b}").into()),
        ("+", Value::List(_), Value::List(_)) => Value::of_vector(&(left.vector()? + right.vector()?)),
        ("-", Value::List(_), Value::List(_)) => Value::of_vector(&(left.vector()? - right.vector()?)),
        ("*", Value::List(a), Value::List(_)) if a.len() == 3 => {
            Value::of_vector(&left.vector()?.cross(&right.vector()?))
        }
        ("*", Value::List(_), Value::List(_)) => Value::of_turn(&(left.turn()? * right.turn()?)),
        ("*", Value::List(_), Value::Number(n)) => Value::of_vector(&(left.vector()? * *n)),
        ("*", Value::Number(n), Value::List(_)) => Value::of_vector(&(right.vector()? * *n)),
        ("/", _, Value::Number(0.0)) => return Err(Stop::Error(ERR_DIVZERO)),
        ("/", Value::List(_), Value::Number(n)) => Value::of_vector(&(left.vector()? / *n)),
        ("div" | "mod", _, _) => {
            let (a, b) = numbers()?;
            let (a, b) = (a.round(), b.round());
            if b == 0.0 {
                return Err(Stop::Error(ERR_DIVZERO));
            }
            Value::Number(if sign == "div" { (a / b).trunc() } else { a - b * (a / b).trunc() })
        }
        _ => {
            let (a, b) = numbers()?;
            match sign {
                "+" => Value::Number(a + b),
                "-" => Value::Number(a - b),
                "*" => Value::Number(a * b),
                "/" => Value::Number(a / b),
                "<" => Value::Truth(a < b),
                ">" => Value::Truth(a > b),
                "<=" => Value::Truth(a <= b),
                ">=" => Value::Truth(a >= b),
                _ => return Err(Stop::Unknown(format!("operator {sign}"))),
            }
        }
    })
}
