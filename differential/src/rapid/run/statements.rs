//! Statements: routines with their error handlers, branches, loops, calls.

use std::cell::{Cell, RefCell};
use std::rc::Rc;

use super::values::local;
use super::{Flow, Frame, Ran, Run, Scope, Stop, Symbol};
use crate::rapid::parser::{Argument, Expr, Kind, Routine, Stmt, Storage};
use crate::rapid::value::Value;

/// ERR_REFUNKPRC.
const ERR_REFUNKPRC: i32 = 1002;

impl Run<'_> {
    pub(super) fn routine(
        &mut self,
        routine: &Rc<Routine>,
        module: usize,
        scope: Scope,
    ) -> Ran<Option<Value>> {
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
            self.calls.push(at);
            let ran = self.routine(&routine, module, scope);
            self.calls.pop();
            ran?;
            return Ok(());
        }
        self.instruction(name, arguments, at, frame)
    }
}
