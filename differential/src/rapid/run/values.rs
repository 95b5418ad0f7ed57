//! Data and expressions: places, values, arguments of calls, operators.

use std::cell::{Cell, RefCell};
use std::rc::Rc;

use super::{Box_, Frame, Ran, Ref, Run, Scope, Stop, Symbol};
use crate::rapid::parser::{Argument, Data, Expr, Mode, Part, Place, Routine};
use crate::rapid::value::Value;

impl Run<'_> {
    pub(super) fn settle(&mut self, data: &Box_) -> Ran<()> {
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

    pub(super) fn initial(&mut self, data: &Data, frame: &Frame) -> Ran<Value> {
        if let Some(init) = &data.init {
            return self.value(init, frame);
        }
        let mut dims = Vec::new();
        for dim in &data.dims {
            dims.push(self.value(dim, frame)?.number()? as usize);
        }
        Ok(self.types.zero(&data.kind, &dims))
    }

    pub(in crate::rapid) fn place(&mut self, place: &Place, frame: &Frame) -> Ran<Ref> {
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

    pub(in crate::rapid) fn get(&self, place: &Ref) -> Ran<Value> {
        let value = place.data.value.borrow();
        let mut here = &*value;
        for index in &place.path {
            let Value::List(list) = here else { return Err(Stop::Unknown("no parts".into())) };
            here = list.get(*index).ok_or(Stop::Error(ERR_RANGE))?;
        }
        Ok(here.clone())
    }

    pub(in crate::rapid) fn put(&self, place: &Ref, value: Value) -> Ran<()> {
        let mut whole = place.data.value.borrow_mut();
        let mut here = &mut *whole;
        for index in &place.path {
            let Value::List(list) = here else { return Err(Stop::Unknown("no parts".into())) };
            here = list.get_mut(*index).ok_or(Stop::Error(ERR_RANGE))?;
        }
        *here = value;
        Ok(())
    }

    pub(in crate::rapid) fn value(&mut self, expr: &Expr, frame: &Frame) -> Ran<Value> {
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
    pub(in crate::rapid) fn present(&self, name: &str, frame: &Frame) -> bool {
        matches!(self.look(name, frame), Some(Symbol::Data(_)))
    }

    pub(super) fn bind(
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
}

/// ERR_ARRIDX and the like.
const ERR_RANGE: i32 = 1001;
/// ERR_DIVZERO.
const ERR_DIVZERO: i32 = 1003;

pub(super) fn local(name: &str, kind: &str, value: Value) -> Ref {
    let data = Rc::new(Box_ {
        name: name.to_owned(),
        kind: kind.to_owned(),
        value: RefCell::new(value),
        pending: RefCell::new(None),
    });
    Ref { data, path: Vec::new(), kind: kind.to_owned() }
}

/// A value in words, numbers to six decimals.
pub(in crate::rapid) fn said(value: &Value) -> String {
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
