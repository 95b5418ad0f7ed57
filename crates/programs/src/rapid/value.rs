//! Abstract values of RAPID expressions, and the components of the predefined types.

use truegrind_math::option_f64::OptionF64;
use truegrind_math::rounding::round;

use crate::motion::{
    Frame, JointTarget, MAX_POSITION_MM, Reason, RobTarget, SpeedValue, TargetValue, ToolValue,
    WorkObjectValue, ZoneValue,
};

/// A value, known completely or in part.
#[derive(Debug, Clone, PartialEq)]
#[non_exhaustive]
pub enum Value {
    /// num, dnum.
    Number(f64),
    /// bool.
    Bool(bool),
    /// string, without its quotes.
    Text(Vec<u8>),
    /// Records and arrays: components in order.
    List(Vec<Value>),
    /// Unknown, with the reason.
    Unknown(Reason),
}

/// The largest number of a controller: num is of single precision.
pub const MAX_NUM: f64 = f32::MAX as f64;

/// Whether a controller can represent these numbers.
pub fn held(numbers: &[f64]) -> Result<(), Reason> {
    if numbers.iter().all(|number| number.abs() <= MAX_NUM) { Ok(()) } else { Err(Reason::NumberRange) }
}

/// From this size on an external axis is "not connected" (9E9).
const NOT_CONNECTED: f64 = 8.9e9;

impl Value {
    /// Number of scalars and strings in the value; counting stops above `limit`.
    pub fn size(&self, limit: usize) -> usize {
        match self {
            Value::List(list) => list
                .iter()
                .fold(0, |sum, value| if sum > limit { sum } else { sum + value.size(limit - sum) }),
            _ => 1,
        }
    }

    /// Whether all of it is known.
    pub fn is_known(&self) -> bool {
        match self {
            Value::List(list) => list.iter().all(Value::is_known),
            Value::Unknown(_) => false,
            _ => true,
        }
    }

    /// The number.
    pub fn number(&self) -> Result<f64, Reason> {
        match self {
            Value::Number(value) => Ok(*value),
            Value::Unknown(reason) => Err(*reason),
            _ => Err(Reason::WrongShape),
        }
    }

    fn boolean(&self) -> Result<bool, Reason> {
        match self {
            Value::Bool(value) => Ok(*value),
            Value::Unknown(reason) => Err(*reason),
            _ => Err(Reason::WrongShape),
        }
    }

    fn list(&self, length: usize) -> Result<&[Value], Reason> {
        match self {
            Value::List(values) if values.len() == length => Ok(values),
            Value::Unknown(reason) => Err(*reason),
            _ => Err(Reason::WrongShape),
        }
    }

    /// A list of N numbers.
    pub fn numbers<const N: usize>(&self) -> Result<[f64; N], Reason> {
        let mut out = [0.0; N];
        for (out, value) in out.iter_mut().zip(self.list(N)?) {
            *out = value.number()?;
        }
        Ok(out)
    }

    /// A list of numbers.
    pub fn from_numbers(numbers: &[f64]) -> Value {
        Value::List(numbers.iter().map(|&number| Value::Number(number)).collect())
    }

    /// A pose: trans and rot.
    pub fn frame(&self) -> Result<Frame, Reason> {
        let [position, rotation] = self.list(2)? else { return Err(Reason::WrongShape) };
        let frame = Frame { position_mm: position.numbers()?, quaternion: rotation.numbers()? };
        held(&frame.position_mm)?;
        within_reach(&frame.position_mm)?;
        usable(&frame.quaternion)?;
        Ok(frame)
    }

    /// A pose as a value.
    pub fn from_frame(frame: &Frame) -> Value {
        Value::List(vec![Value::from_numbers(&frame.position_mm), Value::from_numbers(&frame.quaternion)])
    }

    /// A robtarget or jointtarget.
    pub fn target(&self, joints: bool) -> Result<TargetValue, Reason> {
        if joints {
            let [robot, external] = self.list(2)? else { return Err(Reason::WrongShape) };
            return joint_target(robot.numbers()?, external.numbers()?);
        }
        let [position, rotation, conf, external] = self.list(4)? else { return Err(Reason::WrongShape) };
        cartesian_target(position.numbers()?, rotation.numbers()?, conf.numbers()?, external.numbers()?)
    }

    /// A tooldata.
    pub fn tool(&self) -> Result<ToolValue, Reason> {
        let [robhold, frame, load] = self.list(3)? else { return Err(Reason::WrongShape) };
        let load = load.list(6)?;
        let (mass_kg, centre_of_gravity_mm) = (load[0].number()?, load[1].numbers()?);
        within_reach(&[mass_kg])?;
        within_reach(&centre_of_gravity_mm)?;
        Ok(ToolValue { robhold: robhold.boolean()?, frame: frame.frame()?, mass_kg, centre_of_gravity_mm })
    }

    /// A wobjdata.
    pub fn work_object(&self) -> Result<WorkObjectValue, Reason> {
        let [robhold, fixed, unit, user, object] = self.list(5)? else { return Err(Reason::WrongShape) };
        let unit = match unit {
            Value::Text(text) => super::token::display(text),
            Value::Unknown(reason) => return Err(*reason),
            _ => return Err(Reason::WrongShape),
        };
        Ok(WorkObjectValue {
            robhold: robhold.boolean()?,
            fixed: fixed.boolean()?,
            mechanical_unit: unit,
            user_frame: user.frame()?,
            object_frame: object.frame()?,
        })
    }

    /// A speeddata.
    pub fn speed(&self) -> Result<SpeedValue, Reason> {
        let [tcp, orientation, linear, rotating] = self.numbers()?;
        held(&[tcp, orientation, linear, rotating])?;
        if tcp <= 0.0 {
            return Err(Reason::NumberRange);
        }
        Ok(SpeedValue {
            tcp_mm_s: tcp,
            orientation_deg_s: orientation,
            linear_external_mm_s: linear,
            rotating_external_deg_s: rotating,
        })
    }

    /// A zonedata.
    pub fn zone(&self) -> Result<ZoneValue, Reason> {
        let parts = self.list(7)?;
        Ok(ZoneValue {
            fine: parts[0].boolean()?,
            tcp_mm: parts[1].number()?,
            orientation_mm: parts[2].number()?,
            orientation_deg: parts[4].number()?,
        })
    }
}

/// Whether a quaternion is near enough to length 1 to mean an orientation: off by at most 0.1 in the square of its
/// length (RAPID reference, NOrient).
pub fn usable(quaternion: &[f64; 4]) -> Result<(), Reason> {
    let square: f64 = quaternion.iter().map(|q| q * q).sum();
    if (square - 1.0).abs() <= 0.1 { Ok(()) } else { Err(Reason::BadQuaternion) }
}

/// Whether numbers (mm, °, kg) are plausible for an arm.
pub fn within_reach(numbers: &[f64]) -> Result<(), Reason> {
    if numbers.iter().all(|number| number.abs() <= MAX_POSITION_MM) {
        Ok(())
    } else {
        Err(Reason::BeyondReach)
    }
}

fn external(values: [f64; 6]) -> [OptionF64; 6] {
    values.map(|value| (value.abs() < NOT_CONNECTED).then_some(value).into())
}

/// A robtarget of its numbers.
pub fn cartesian_target(
    position_mm: [f64; 3],
    quaternion: [f64; 4],
    conf: [f64; 4],
    axes: [f64; 6],
) -> Result<TargetValue, Reason> {
    held(&position_mm)?;
    held(&quaternion)?;
    held(&axes)?;
    if !conf.iter().all(|value| value.abs() <= 8_388_608.0) {
        return Err(Reason::NumberRange);
    }
    within_reach(&position_mm)?;
    usable(&quaternion)?;
    let conf = conf.map(|value| round(value) as i32);
    Ok(TargetValue::Cartesian(RobTarget { position_mm, quaternion, conf, external: external(axes) }))
}

/// A jointtarget of its numbers.
pub fn joint_target(robot_deg: [f64; 6], axes: [f64; 6]) -> Result<TargetValue, Reason> {
    held(&robot_deg)?;
    held(&axes)?;
    if robot_deg.iter().any(|angle| angle.abs() >= NOT_CONNECTED) {
        return Err(Reason::UndefinedJoint);
    }
    within_reach(&robot_deg)?;
    Ok(TargetValue::Joint(JointTarget { robot_deg, external: external(axes) }))
}

/// The components of a predefined record type: names and types.
pub fn components(type_name: &[u8]) -> Option<&'static [(&'static str, &'static str)]> {
    Some(match type_name {
        b"pos" => &[("x", "num"), ("y", "num"), ("z", "num")],
        b"orient" => &[("q1", "num"), ("q2", "num"), ("q3", "num"), ("q4", "num")],
        b"pose" => &[("trans", "pos"), ("rot", "orient")],
        b"confdata" => &[("cf1", "num"), ("cf4", "num"), ("cf6", "num"), ("cfx", "num")],
        b"extjoint" => &[
            ("eax_a", "num"),
            ("eax_b", "num"),
            ("eax_c", "num"),
            ("eax_d", "num"),
            ("eax_e", "num"),
            ("eax_f", "num"),
        ],
        b"robjoint" => &[
            ("rax_1", "num"),
            ("rax_2", "num"),
            ("rax_3", "num"),
            ("rax_4", "num"),
            ("rax_5", "num"),
            ("rax_6", "num"),
        ],
        b"robtarget" => {
            &[("trans", "pos"), ("rot", "orient"), ("robconf", "confdata"), ("extax", "extjoint")]
        }
        b"jointtarget" => &[("robax", "robjoint"), ("extax", "extjoint")],
        b"loaddata" => {
            &[("mass", "num"), ("cog", "pos"), ("aom", "orient"), ("ix", "num"), ("iy", "num"), ("iz", "num")]
        }
        b"tooldata" => &[("robhold", "bool"), ("tframe", "pose"), ("tload", "loaddata")],
        b"wobjdata" => &[
            ("robhold", "bool"),
            ("ufprog", "bool"),
            ("ufmec", "string"),
            ("uframe", "pose"),
            ("oframe", "pose"),
        ],
        b"speeddata" => &[("v_tcp", "num"), ("v_ori", "num"), ("v_leax", "num"), ("v_reax", "num")],
        b"zonedata" => &[
            ("finep", "bool"),
            ("pzone_tcp", "num"),
            ("pzone_ori", "num"),
            ("pzone_eax", "num"),
            ("zone_ori", "num"),
            ("zone_leax", "num"),
            ("zone_reax", "num"),
        ],
        _ => return None,
    })
}

/// The value of predefined data: tool0, wobj0, load0, the speeds and zones of the reference, pi.
pub fn built_in(name: &[u8]) -> Option<Value> {
    let identity = || Value::from_frame(&Frame::IDENTITY);
    let load0 = || {
        vec![
            Value::Number(0.001),
            Value::from_numbers(&[0.0, 0.0, 0.001]),
            Value::from_numbers(&[1.0, 0.0, 0.0, 0.0]),
            Value::Number(0.0),
            Value::Number(0.0),
            Value::Number(0.0),
        ]
    };
    let speed = |tcp: f64| Value::from_numbers(&[tcp, 500.0, 5000.0, 1000.0]);
    let zone = |fine: bool, tcp: f64, ori: f64, deg: f64| {
        let mut parts = vec![Value::Bool(fine)];
        parts.extend([tcp, ori, ori, deg, ori, deg].map(Value::Number));
        Value::List(parts)
    };
    Some(match name {
        b"tool0" => Value::List(vec![Value::Bool(true), identity(), Value::List(load0())]),
        b"wobj0" => Value::List(vec![
            Value::Bool(false),
            Value::Bool(true),
            Value::Text(Vec::new()),
            identity(),
            identity(),
        ]),
        b"load0" => Value::List(load0()),
        b"pi" => Value::Number(std::f64::consts::PI),
        b"vmax" => speed(5000.0),
        b"fine" => zone(true, 0.0, 0.0, 0.0),
        [b'v', digits @ ..] => {
            const SPEEDS: [u32; 24] = [
                5, 10, 20, 30, 40, 50, 60, 80, 100, 150, 200, 300, 400, 500, 600, 800, 1000, 1500, 2000,
                2500, 3000, 4000, 5000, 6000,
            ];
            let value = whole(digits)?;
            if !SPEEDS.contains(&value) && value != 7000 {
                return None;
            }
            speed(f64::from(value))
        }
        [b'z', digits @ ..] => {
            let value = whole(digits)?;
            // Reorientation zone in mm and degrees per TCP zone (RAPID reference, zonedata).
            let (orientation, degrees) = match value {
                0 => return Some(zone(false, 0.3, 0.3, 0.03)),
                1 => (1.0, 0.1),
                5 => (8.0, 0.8),
                10 => (15.0, 1.5),
                15 => (23.0, 2.3),
                20 => (30.0, 3.0),
                30 => (45.0, 4.5),
                40 => (60.0, 6.0),
                50 => (75.0, 7.5),
                60 => (90.0, 9.0),
                80 => (120.0, 12.0),
                100 => (150.0, 15.0),
                150 => (225.0, 23.0),
                200 => (300.0, 30.0),
                _ => return None,
            };
            zone(false, f64::from(value), orientation, degrees)
        }
        _ => return None,
    })
}

fn whole(digits: &[u8]) -> Option<u32> {
    if digits.is_empty() || digits.len() > 1 && digits[0] == b'0' || !digits.iter().all(u8::is_ascii_digit) {
        return None;
    }
    std::str::from_utf8(digits).ok()?.parse().ok()
}
