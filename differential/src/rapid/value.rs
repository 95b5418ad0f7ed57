//! Values of RAPID: numbers, truths, texts, and lists, which are records and arrays alike.

use std::collections::HashMap;
use std::rc::Rc;

use nalgebra::{Quaternion, Translation3, UnitQuaternion, Vector3};

use crate::arm::Pose;

/// A value.
#[derive(Debug, Clone, PartialEq)]
pub enum Value {
    /// num, dnum.
    Number(f64),
    /// bool; a switch that is there.
    Truth(bool),
    /// string.
    Text(Rc<str>),
    /// A record or an array.
    List(Vec<Value>),
    /// What has no value: switches, interrupt numbers, parameters that are missing.
    Nothing,
}

impl Value {
    /// The number.
    pub fn number(&self) -> Result<f64, String> {
        match self {
            Value::Number(value) => Ok(*value),
            other => Err(format!("expected a number, found {other:?}")),
        }
    }

    /// The truth.
    pub fn truth(&self) -> Result<bool, String> {
        match self {
            Value::Truth(value) => Ok(*value),
            other => Err(format!("expected a truth, found {other:?}")),
        }
    }

    /// The text.
    pub fn text(&self) -> Result<Rc<str>, String> {
        match self {
            Value::Text(text) => Ok(text.clone()),
            other => Err(format!("expected a string, found {other:?}")),
        }
    }

    /// The parts of a list.
    pub fn list(&self) -> Result<&[Value], String> {
        match self {
            Value::List(list) => Ok(list),
            other => Err(format!("expected a record or an array, found {other:?}")),
        }
    }

    /// A part of a list.
    pub fn part(&self, index: usize) -> Result<&Value, String> {
        self.list()?.get(index).ok_or_else(|| "a part is missing".to_owned())
    }

    /// So many numbers.
    pub fn numbers<const N: usize>(&self) -> Result<[f64; N], String> {
        let list = self.list()?;
        if list.len() != N {
            return Err(format!("expected {N} numbers, found {}", list.len()));
        }
        let mut out = [0.0; N];
        for (out, value) in out.iter_mut().zip(list) {
            *out = value.number()?;
        }
        Ok(out)
    }

    /// A pos of a vector.
    pub fn of_vector(v: &Vector3<f64>) -> Value {
        Value::List(v.iter().map(|v| Value::Number(*v)).collect())
    }

    /// A pos.
    pub fn vector(&self) -> Result<Vector3<f64>, String> {
        self.numbers::<3>().map(Vector3::from)
    }

    /// An orient.
    pub fn turn(&self) -> Result<UnitQuaternion<f64>, String> {
        let [w, x, y, z] = self.numbers()?;
        let q = Quaternion::new(w, x, y, z);
        if (q.norm_squared() - 1.0).abs() > 0.1 {
            return Err("an orientation that has not length 1".to_owned());
        }
        Ok(UnitQuaternion::from_quaternion(q))
    }

    /// An orient of a rotation, its scalar part not negative.
    pub fn of_turn(turn: &UnitQuaternion<f64>) -> Value {
        let q = if turn.w < 0.0 { -turn.into_inner() } else { turn.into_inner() };
        Value::List([q.w, q.i, q.j, q.k].map(Value::Number).to_vec())
    }

    /// A pose, also the first two components of a robtarget.
    pub fn pose(&self) -> Result<Pose, String> {
        Ok(Pose::from_parts(Translation3::from(self.part(0)?.vector()?), self.part(1)?.turn()?))
    }

    /// A pose as a value.
    pub fn of_pose(pose: &Pose) -> Value {
        Value::List(vec![Value::of_vector(&pose.translation.vector), Value::of_turn(&pose.rotation)])
    }
}

/// Records by name: their components as type and name.
#[derive(Debug, Clone)]
pub struct Types {
    records: HashMap<String, Vec<(String, String)>>,
    aliases: HashMap<String, String>,
}

const BUILT_IN: [(&str, &str); 12] = [
    ("pos", "num x num y num z"),
    ("orient", "num q1 num q2 num q3 num q4"),
    ("pose", "pos trans orient rot"),
    ("confdata", "num cf1 num cf4 num cf6 num cfx"),
    ("extjoint", "num eax_a num eax_b num eax_c num eax_d num eax_e num eax_f"),
    ("robjoint", "num rax_1 num rax_2 num rax_3 num rax_4 num rax_5 num rax_6"),
    ("robtarget", "pos trans orient rot confdata robconf extjoint extax"),
    ("jointtarget", "robjoint robax extjoint extax"),
    ("loaddata", "num mass pos cog orient aom num ix num iy num iz"),
    ("tooldata", "bool robhold pose tframe loaddata tload"),
    ("wobjdata", "bool robhold bool ufprog string ufmec pose uframe pose oframe"),
    ("speeddata", "num v_tcp num v_ori num v_leax num v_reax"),
];

impl Default for Types {
    fn default() -> Self {
        let mut out = Types { records: HashMap::new(), aliases: HashMap::new() };
        for (name, text) in BUILT_IN {
            let words: Vec<&str> = text.split(' ').collect();
            out.record(name, words.chunks(2).map(|w| (w[0].to_owned(), w[1].to_owned())).collect());
        }
        out
    }
}

impl Types {
    /// Declares a record.
    pub fn record(&mut self, name: &str, components: Vec<(String, String)>) {
        self.records.insert(name.to_owned(), components);
    }

    /// Declares another name.
    pub fn alias(&mut self, name: &str, kind: &str) {
        self.aliases.insert(name.to_owned(), kind.to_owned());
    }

    fn plain<'a>(&'a self, kind: &'a str) -> &'a str {
        let mut kind = kind;
        while let Some(other) = self.aliases.get(kind) {
            kind = other;
        }
        kind
    }

    /// Place and type of a component.
    pub fn component(&self, kind: &str, name: &str) -> Result<(usize, String), String> {
        let components =
            self.records.get(self.plain(kind)).ok_or_else(|| format!("{kind} has no components"))?;
        let index = components.iter().position(|c| c.1 == name);
        let index = index.ok_or_else(|| format!("{kind} has no component {name}"))?;
        Ok((index, components[index].0.clone()))
    }

    /// The value of data that is declared without one.
    pub fn zero(&self, kind: &str, dims: &[usize]) -> Value {
        if let Some((first, rest)) = dims.split_first() {
            return Value::List((0..*first).map(|_| self.zero(kind, rest)).collect());
        }
        match self.plain(kind) {
            "num" | "dnum" | "intnum" | "errnum" => Value::Number(0.0),
            "bool" => Value::Truth(false),
            "string" => Value::Text("".into()),
            kind => match self.records.get(kind) {
                Some(list) => Value::List(list.iter().map(|(kind, _)| self.zero(kind, &[])).collect()),
                None => Value::Nothing,
            },
        }
    }
}
