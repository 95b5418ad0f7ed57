//! Functions and instructions of the controller itself (ABB, reference of instructions, functions and data types).

use std::fmt::Write;

use nalgebra::{Translation3, UnitQuaternion, Vector3};

use super::parser::{Argument, Expr};
use super::run::{Frame, Goal, Load, Motion, Run, Stop, Way, said};
use super::value::Value;
use crate::arm::Pose;

fn numbers(list: &[f64]) -> Value {
    Value::List(list.iter().map(|v| Value::Number(*v)).collect())
}

/// Data that every program has.
pub fn predefined(add: &mut dyn FnMut(&str, &str, Value)) {
    let unit = || Value::of_pose(&Pose::identity());
    let turn = || numbers(&[1.0, 0.0, 0.0, 0.0]);
    let load = |kg: f64, z: f64| {
        let zero = || Value::Number(0.0);
        Value::List(vec![Value::Number(kg), numbers(&[0.0, 0.0, z]), turn(), zero(), zero(), zero()])
    };
    add("tool0", "tooldata", Value::List(vec![Value::Truth(true), unit(), load(0.001, 0.001)]));
    let nowhere = vec![Value::Truth(false), Value::Truth(true), Value::Text("".into()), unit(), unit()];
    add("wobj0", "wobjdata", Value::List(nowhere));
    add("load0", "loaddata", load(0.001, 0.001));
    for speed in [5, 10, 20, 50, 100, 200, 500, 1000] {
        add(&format!("v{speed}"), "speeddata", numbers(&[f64::from(speed), 500.0, 5000.0, 1000.0]));
    }
    for zone in ["fine", "z0", "z1", "z5", "z10", "z50"] {
        add(zone, "zonedata", Value::Text(zone.into()));
    }
    add("high", "num", Value::Number(1.0));
    add("low", "num", Value::Number(0.0));
    for signal in ["dospindle", "dogrip", "distart"] {
        add(signal, "signaldo", Value::Nothing);
    }
}

/// Arguments of a built-in call, sorted.
struct Given<'e> {
    plain: Vec<&'e Expr>,
    options: Vec<(String, Option<Expr>)>,
}

impl<'e> Given<'e> {
    fn of(arguments: &'e [Argument], run: &Run<'_>, frame: &Frame) -> Self {
        let mut out = Given { plain: Vec::new(), options: Vec::new() };
        for argument in arguments {
            match argument {
                Argument::Plain(expr) | Argument::Named(_, expr) => out.plain.push(expr),
                Argument::Option(name, expr) => out.options.push((name.clone(), Some(expr.clone()))),
                Argument::Switch(name) => out.options.push((name.clone(), None)),
                Argument::IfPresent(name, source) if run.present(source, frame) => {
                    let whole = super::parser::Place { name: source.clone(), path: Vec::new() };
                    out.options.push((name.clone(), Some(Expr::Place(whole))));
                }
                Argument::IfPresent(..) => {}
            }
        }
        out
    }

    fn has(&self, name: &str) -> bool {
        self.options.iter().any(|option| option.0 == name)
    }

    fn option(&self, name: &str) -> Option<&Expr> {
        self.options.iter().find(|option| option.0 == name).and_then(|option| option.1.as_ref())
    }

    fn at(&self, index: usize) -> Result<&'e Expr, Stop> {
        self.plain.get(index).copied().ok_or_else(|| Stop::Unknown("an argument is missing".into()))
    }
}

fn about(axis: Vector3<f64>, degrees: f64) -> UnitQuaternion<f64> {
    UnitQuaternion::from_scaled_axis(axis * degrees.to_radians())
}

fn with_pose(target: &Value, pose: &Pose) -> Result<Value, Stop> {
    let mut list = target.list()?.to_vec();
    list[0] = Value::of_vector(&pose.translation.vector);
    list[1] = Value::of_turn(&pose.rotation);
    Ok(Value::List(list))
}

impl Run<'_> {
    /// A function of the controller.
    pub(super) fn function(
        &mut self,
        name: &str,
        arguments: &[Argument],
        frame: &Frame,
    ) -> Result<Value, Stop> {
        if name == "present" {
            let Some(Argument::Plain(Expr::Place(place))) = arguments.first() else {
                return Err(Stop::Unknown("Present of what is no parameter".into()));
            };
            return Ok(Value::Truth(self.present(&place.name, frame)));
        }
        if name == "dinput" || name == "testdi" {
            let up = self.chance("input") & 1 == 1;
            return Ok(if name == "testdi" {
                Value::Truth(up)
            } else {
                Value::Number(f64::from(u8::from(up)))
            });
        }
        let given = Given::of(arguments, self, frame);
        let mut v = Vec::new();
        for expr in &given.plain {
            v.push(self.value(expr, frame)?);
        }
        let v = |index: usize| {
            v.get(index).ok_or_else(|| Stop::Unknown(format!("{name}: an argument is missing")))
        };
        let number = |index: usize| -> Result<f64, Stop> { Ok(v(index)?.number()?) };
        Ok(match name {
            "offs" => {
                let mut list = v(0)?.list()?.to_vec();
                let moved = list[0].vector()? + Vector3::new(number(1)?, number(2)?, number(3)?);
                list[0] = Value::of_vector(&moved);
                Value::List(list)
            }
            "reltool" => {
                let pose = v(0)?.pose()?;
                let mut angle = |name: &str| -> Result<f64, Stop> {
                    Ok(match given.option(name) {
                        Some(expr) => self.value(expr, frame)?.number()?,
                        None => 0.0,
                    })
                };
                let turn = about(Vector3::x(), angle("rx")?)
                    * about(Vector3::y(), angle("ry")?)
                    * about(Vector3::z(), angle("rz")?);
                let moved = Translation3::new(number(1)?, number(2)?, number(3)?);
                with_pose(v(0)?, &(pose * Pose::from_parts(moved, turn)))?
            }
            "posemult" => Value::of_pose(&(v(0)?.pose()? * v(1)?.pose()?)),
            "poseinv" => Value::of_pose(&v(0)?.pose()?.inverse()),
            "posevect" => Value::of_vector(&(v(0)?.pose()? * nalgebra::Point3::from(v(1)?.vector()?)).coords),
            "orientzyx" => Value::of_turn(
                &(about(Vector3::z(), number(0)?)
                    * about(Vector3::y(), number(1)?)
                    * about(Vector3::x(), number(2)?)),
            ),
            "norient" => Value::of_turn(&v(0)?.turn()?),
            "abs" => Value::Number(number(0)?.abs()),
            "sin" => Value::Number(number(0)?.to_radians().sin()),
            "cos" => Value::Number(number(0)?.to_radians().cos()),
            "sqrt" => Value::Number(number(0)?.sqrt()),
            "trunc" => Value::Number(number(0)?.trunc()),
            "distance" => Value::Number((v(0)?.vector()? - v(1)?.vector()?).norm()),
            "numtostr" => Value::Text(format!("{:.*}", number(1)? as usize, number(0)?).into()),
            "dim" => {
                let mut here = v(0)?;
                for _ in 1..number(1)? as usize {
                    here = here.part(0)?;
                }
                Value::Number(here.list()?.len() as f64)
            }
            _ => return Err(Stop::Unknown(format!("function {name}"))),
        })
    }

    /// An instruction of the controller.
    pub(super) fn instruction(
        &mut self,
        name: &str,
        arguments: &[Argument],
        at: (usize, usize),
        frame: &Frame,
    ) -> Result<(), Stop> {
        let given = Given::of(arguments, self, frame);
        match name {
            "movel" | "movej" | "movec" | "moveabsj" | "moveldo" => self.motion(name, &given, at, frame),
            "incr" | "decr" | "add" | "clear" => {
                let Expr::Place(place) = given.at(0)? else { return Err(Stop::Unknown("no data".into())) };
                let place = self.place(place, frame)?;
                let here = self.get(&place)?.number()?;
                let new = match name {
                    "incr" => here + 1.0,
                    "decr" => here - 1.0,
                    "clear" => 0.0,
                    _ => here + self.value(given.at(1)?, frame)?.number()?,
                };
                self.put(&place, Value::Number(new))
            }
            "pdispset" => {
                self.state.displaced = self.value(given.at(0)?, frame)?.pose()?;
                Ok(())
            }
            "pdispoff" => {
                self.state.displaced = Pose::identity();
                Ok(())
            }
            "pdispon" => {
                let execution = match given.option("exep") {
                    Some(execution) => self.value(&execution.clone(), frame)?.pose()?,
                    None => self.stands(given.at(1)?, given.option("wobj"), frame)?,
                };
                let program = self.value(given.at(0)?, frame)?.pose()?;
                self.state.displaced = if given.has("rot") {
                    execution * program.inverse()
                } else {
                    Pose::from_parts(
                        Translation3::from(execution.translation.vector - program.translation.vector),
                        UnitQuaternion::identity(),
                    )
                };
                Ok(())
            }
            "confl" => {
                self.state.monitor_lines = !given.has("off");
                Ok(())
            }
            "confj" => {
                self.state.monitor_joints = !given.has("off");
                Ok(())
            }
            "gripload" => {
                let load = self.value(given.at(0)?, frame)?;
                self.state.grip = loaded(&load)?;
                Ok(())
            }
            "isleep" | "idisable" | "idelete" => {
                self.asleep = true;
                Ok(())
            }
            "iwatch" | "ienable" => {
                self.asleep = false;
                Ok(())
            }
            "singarea" | "softact" | "softdeact" | "cirpathmode" | "accset" | "velset" => {
                let words = self.words(&given, frame)?;
                let key = if name == "softdeact" { "softact" } else { name };
                self.state
                    .others
                    .insert(key.to_owned(), if name == "softdeact" { String::new() } else { words });
                Ok(())
            }
            "tpwrite" | "waittime" | "setdo" | "set" | "reset" | "stop" | "isignaldi" | "waitdi" => {
                let words = self.words(&given, frame)?;
                self.say(format!("{name} {words}"));
                Ok(())
            }
            _ => Err(Stop::Unknown(format!("instruction {name}"))),
        }
    }

    fn words(&mut self, given: &Given<'_>, frame: &Frame) -> Result<String, Stop> {
        let mut out = String::new();
        for expr in &given.plain {
            let word = match expr {
                Expr::Place(place) if place.path.is_empty() => match self.place(place, frame) {
                    Ok(place) => said(&self.get(&place)?),
                    Err(_) => place.name.clone(),
                },
                expr => said(&self.value(expr, frame)?),
            };
            let _ = write!(out, "{word} ");
        }
        for (name, value) in &given.options {
            let value = match value {
                Some(value) => said(&self.value(value, frame)?),
                None => String::new(),
            };
            let _ = write!(out, "\\{name} {value} ");
        }
        Ok(out)
    }

    fn motion(
        &mut self,
        name: &str,
        given: &Given<'_>,
        at: (usize, usize),
        frame: &Frame,
    ) -> Result<(), Stop> {
        let count = if name == "movec" { 2 } else { 1 };
        let mut goals = Vec::new();
        for index in 0..count {
            let target = self.value(given.at(index)?, frame)?;
            goals.push(if name == "moveabsj" {
                Goal::Joints(target.part(0)?.numbers::<6>()?.map(f64::to_radians))
            } else {
                let conf = target.part(2)?.numbers::<4>()?.map(|v| v.round() as i32);
                Goal::Pose { in_object: target.pose()?, displaced: self.state.displaced, conf }
            });
        }
        let mut rest = String::new();
        for index in [count, count + 1] {
            let _ = write!(rest, "{} ", said(&self.value(given.at(index)?, frame)?));
        }
        for expr in given.plain.iter().skip(count + 3) {
            let _ = write!(rest, "{} ", said(&self.value(expr, frame).unwrap_or(Value::Nothing)));
        }
        for option in ["v", "t", "z"] {
            if let Some(value) = given.option(option) {
                let value = self.value(&value.clone(), frame)?;
                let _ = write!(rest, "\\{option}:={} ", said(&value));
            }
        }
        let _ = write!(rest, "{:?}", self.state.others);
        let (tool_name, tool) = self.named(given.at(count + 2)?, frame)?;
        let frame_of_tool = tool.part(1)?.pose()?;
        let held = tool.part(0)?.truth()?;
        let wobj = match given.option("wobj") {
            Some(expr) => self.named(&expr.clone(), frame)?,
            None => {
                let wobj0 = super::parser::Place { name: "wobj0".into(), path: Vec::new() };
                self.named(&Expr::Place(wobj0), frame)?
            }
        };
        let object = (wobj.0, wobj.1.part(0)?.truth()?, wobj.1.part(3)?.pose()?, wobj.1.part(4)?.pose()?);
        let (own, grip) = (loaded(tool.part(2)?)?, self.state.grip);
        let grip_frame = if held { frame_of_tool } else { object.2 };
        let tool_load: Load = own.unwrap_or((0.0, [0.0; 3]));
        let mut load = tool_load;
        if let Some((kg, centre)) = grip {
            let centre = grip_frame * nalgebra::Point3::from(centre);
            let whole = load.0 + kg;
            let mixed = |k: usize| (load.0 * load.1[k] + kg * centre[k]) / whole;
            load = (whole, std::array::from_fn(mixed));
        }
        let way = match name {
            "movec" => Way::Arc,
            "movel" | "moveldo" => Way::Line,
            _ => Way::Joint,
        };
        let monitored = match way {
            Way::Joint => self.state.monitor_joints,
            _ => self.state.monitor_lines,
        };
        let wrist = self.state.others.get("singarea").is_some_and(|words| words.contains("wrist"));
        let motion = Motion {
            wrist,
            at,
            calls: self.calls.clone(),
            way,
            goals,
            tool: (tool_name, held, frame_of_tool),
            object,
            monitored,
            load,
            tool_load,
            rest,
        };
        self.events.push(super::run::Event::Motion(Box::new(motion)));
        Ok(())
    }

    /// Where the robot stands in an object, as told; the last motion must have had the same tool and object.
    fn stands(&mut self, tool: &Expr, object: Option<&Expr>, frame: &Frame) -> Result<Pose, Stop> {
        let tool = self.named(tool, frame)?.0;
        let object = match object {
            Some(object) => self.named(&object.clone(), frame)?.0,
            None => "wobj0".to_owned(),
        };
        let last = self.events.iter().rev().find_map(|event| match event {
            super::run::Event::Motion(motion) => Some(motion),
            super::run::Event::Said(_) => None,
        });
        match last.map(|motion| (motion, motion.goals.last())) {
            Some((motion, Some(Goal::Pose { in_object, displaced, .. })))
                if motion.tool.0 == tool && motion.object.0 == object =>
            {
                Ok(displaced * in_object)
            }
            _ => Err(Stop::Unknown("PDispOn from a motion of another tool or object".into())),
        }
    }

    /// A tool or object: whole data, by the name under which it was declared.
    fn named(&mut self, expr: &Expr, frame: &Frame) -> Result<(String, Value), Stop> {
        let Expr::Place(place) = expr else { return Err(Stop::Unknown("no tool or object by name".into())) };
        let place = self.place(place, frame)?;
        Ok((place.data.name.clone(), self.get(&place)?))
    }
}

/// The load of a loaddata; none where it weighs nothing.
fn loaded(load: &Value) -> Result<Option<Load>, Stop> {
    let kg = load.part(0)?.number()?;
    Ok((kg > 0.0).then_some((kg, load.part(1)?.numbers()?)))
}
