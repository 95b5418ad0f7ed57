//! Running RAPID: what a run holds and leaves behind (ABB, RAPID kernel, and the reference of instructions).

mod statements;
mod values;

use std::cell::{Cell, RefCell};
use std::collections::{BTreeMap, HashMap};
use std::rc::Rc;

pub(super) use self::values::said;
use super::parser::{Data, Item, Module, Routine};
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
    /// Those of the calls around it, the outermost first.
    pub calls: Vec<(usize, usize)>,
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
    /// File and byte of the calls that run, the outermost first.
    pub(super) calls: Vec<(usize, usize)>,
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
            calls: Vec::new(),
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
}
