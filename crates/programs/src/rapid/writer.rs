//! Writer: a new module from a draft.
//!
//! Written as a programmer would: tool and work object as PERS, targets as CONST p10, p20, … or in the instructions,
//! predefined speeds and zones where they exist, else CONST, one PROC main.

use std::collections::BTreeMap;

use thiserror::Error;

use super::number;
use super::print;
use super::token::{folded, keyword};
use super::value::built_in;
use crate::draft::{Draft, Step};
use crate::motion::{Frame, MotionKind, TargetValue};
use crate::rewrite::RewriteOptions;

/// Why a draft cannot be written.
#[derive(Debug, Clone, PartialEq, Error)]
#[non_exhaustive]
pub enum WriteError {
    /// A name that RAPID does not allow.
    #[error(
        "`{name}` is no RAPID name: expected a letter, then letters, digits or `_`, at most 32 and no reserved word"
    )]
    Name {
        /// The name.
        name: String,
    },
    /// A step without the data of its kind.
    #[error("step {step}: a {kind:?} motion does not take this target: expected {expected}")]
    Step {
        /// The index of the step.
        step: usize,
        /// Its kind.
        kind: MotionKind,
        /// What it requires.
        expected: &'static str,
    },
    /// A number that is not finite.
    #[error(
        "step {step}: a number of the target, speed, zone or wait is not finite, or the wait is negative"
    )]
    NotFinite {
        /// The index of the step.
        step: usize,
    },
}

/// Writes a module. Line ends are LF, characters outside Latin-1 become `?`.
///
/// ```
/// use truegrind_math::option_f64::OptionF64;
/// use truegrind_programs::draft::{Draft, Step};
/// use truegrind_programs::motion::{Frame, MotionKind, RobTarget, TargetValue, ToolValue, WorkObjectValue};
/// use truegrind_programs::rapid::{Task, writer};
///
/// let frame = Frame::IDENTITY;
/// let tool = ToolValue { robhold: true, frame, mass_kg: 0.8, centre_of_gravity_mm: [0.0, 0.0, 40.0] };
/// let object = WorkObjectValue {
///     robhold: false,
///     fixed: true,
///     mechanical_unit: String::new(),
///     user_frame: frame,
///     object_frame: frame,
/// };
/// let to = RobTarget {
///     position_mm: [380.0, -60.5, 250.0],
///     quaternion: [0.0, 0.0, 1.0, 0.0],
///     conf: [-1, -1, 0, 0],
///     external: [OptionF64::NONE; 6],
/// };
/// let step = Step {
///     kind: MotionKind::Linear,
///     to: TargetValue::Cartesian(to),
///     via: None,
///     speed_mm_s: 50.0,
///     zone_mm: None,
///     comment: None,
///     wait_s: None,
/// };
/// let mut draft = Draft {
///     name: "Blade".into(),
///     comments: Vec::new(),
///     tool: ("tDisc".into(), tool),
///     work_object: ("wPart".into(), object),
///     named_targets: true,
///     monitor_configuration: true,
///     start_deg: None,
///     steps: vec![step],
/// };
/// // The module reads back with the same target.
/// let module = writer::write(&draft)?;
/// let listing = Task::read(&[("blade.mod", &module[..])]).listing;
/// assert_eq!(listing.motions[0].targets[0].value, Ok(TargetValue::Cartesian(to)));
///
/// draft.tool.0 = "disc 2".into();
/// let refused = writer::write(&draft).map_err(|error| error.to_string());
/// assert!(refused.is_err_and(|said| said.starts_with("`disc 2` is no RAPID name")));
/// # Ok::<(), writer::WriteError>(())
/// ```
pub fn write(draft: &Draft) -> Result<Vec<u8>, WriteError> {
    for name in [&draft.name, &draft.tool.0, &draft.work_object.0] {
        check_name(name)?;
    }
    for (index, step) in draft.steps.iter().enumerate() {
        check_step(index, step)?;
    }
    let mut writer = Writer {
        out: Vec::new(),
        options: RewriteOptions::default(),
        speeds: BTreeMap::new(),
        zones: BTreeMap::new(),
    };
    writer.line(0, &format!("MODULE {}", draft.name));
    for comment in &draft.comments {
        writer.comment(1, comment);
    }
    writer.frames(draft);
    writer.speeds_and_zones(&draft.steps);
    if draft.named_targets {
        writer.targets(&draft.steps);
    }
    writer.line(0, "");
    writer.line(1, "PROC main()");
    let switch = if draft.monitor_configuration { "On" } else { "Off" };
    writer.line(2, &format!("ConfJ\\{switch};"));
    writer.line(2, &format!("ConfL\\{switch};"));
    let mut number = 0;
    for step in &draft.steps {
        writer.step(draft, step, &mut number);
    }
    writer.line(1, "ENDPROC");
    writer.line(0, "ENDMODULE");
    Ok(writer.out)
}

fn check_name(name: &str) -> Result<(), WriteError> {
    let mut bytes = name.bytes();
    let good = bytes.next().is_some_and(|first| first.is_ascii_alphabetic())
        && bytes.all(|byte| byte.is_ascii_alphanumeric() || byte == b'_')
        && name.len() <= 32
        && keyword(name.as_bytes()).is_none();
    if good { Ok(()) } else { Err(WriteError::Name { name: name.to_owned() }) }
}

fn check_step(index: usize, step: &Step) -> Result<(), WriteError> {
    let wrong = |expected| Err(WriteError::Step { step: index, kind: step.kind, expected });
    match (step.kind, &step.to, &step.via) {
        (MotionKind::Linear | MotionKind::Joint, TargetValue::Cartesian(_), None) => {}
        (MotionKind::Circular, TargetValue::Cartesian(_), Some(_)) => {}
        (MotionKind::AbsoluteJoint, TargetValue::Joint(_), None) => {}
        (MotionKind::Linear | MotionKind::Joint, ..) => return wrong("a pose and no circle point"),
        (MotionKind::Circular, ..) => return wrong("a pose and a circle point"),
        (MotionKind::AbsoluteJoint, ..) => return wrong("joint angles"),
        _ => return wrong("a linear, joint, circular or absolute joint motion"),
    }
    let finite = |target: &TargetValue| match target {
        TargetValue::Cartesian(t) => t.position_mm.iter().chain(&t.quaternion).all(|value| value.is_finite()),
        TargetValue::Joint(t) => t.robot_deg.iter().all(|value| value.is_finite()),
    };
    let via = step.via.map(TargetValue::Cartesian);
    let numbers = step.speed_mm_s.is_finite()
        && step.zone_mm.is_none_or(f64::is_finite)
        && step.wait_s.is_none_or(|seconds| seconds.is_finite() && seconds >= 0.0);
    if numbers && finite(&step.to) && via.as_ref().is_none_or(finite) {
        Ok(())
    } else {
        Err(WriteError::NotFinite { step: index })
    }
}

struct Writer {
    out: Vec<u8>,
    options: RewriteOptions,
    /// Names of speeds by their value in µm/s.
    speeds: BTreeMap<i64, String>,
    /// Names of zones by their value in µm; −1 stops.
    zones: BTreeMap<i64, String>,
}

fn micro(value: f64) -> i64 {
    (value * 1000.0).round() as i64
}

impl Writer {
    fn line(&mut self, depth: usize, text: &str) {
        if !text.is_empty() {
            self.out.extend(std::iter::repeat_n(b' ', 2 * depth));
        }
        self.out.extend(text.chars().map(|c| u8::try_from(u32::from(c)).unwrap_or(b'?')));
        self.out.push(b'\n');
    }

    fn comment(&mut self, depth: usize, text: &str) {
        for line in text.lines() {
            self.line(depth, &format!("! {line}"));
        }
    }

    fn frames(&mut self, draft: &Draft) {
        let (name, tool) = &draft.tool;
        if folded(name.as_bytes()) != b"tool0" {
            let load = format!(
                "[{},{},[1,0,0,0],0,0,0]",
                short(tool.mass_kg, 6),
                list(&tool.centre_of_gravity_mm, 6)
            );
            let held = truth(tool.robhold);
            self.line(1, &format!("PERS tooldata {name}:=[{held},{},{load}];", frame(&tool.frame)));
        }
        let (name, work_object) = &draft.work_object;
        if folded(name.as_bytes()) != b"wobj0" {
            let text = format!(
                "PERS wobjdata {name}:=[{},{},\"{}\",{},{}];",
                truth(work_object.robhold),
                truth(work_object.fixed),
                work_object.mechanical_unit.replace('"', "\"\""),
                frame(&work_object.user_frame),
                frame(&work_object.object_frame)
            );
            self.line(1, &text);
        }
    }

    /// Names for all speeds and zones, and declarations for those that the controller does not have.
    fn speeds_and_zones(&mut self, steps: &[Step]) {
        for step in steps {
            let speed = micro(step.speed_mm_s);
            if !self.speeds.contains_key(&speed) {
                let text = short(step.speed_mm_s, 3);
                let standard = format!("v{text}");
                let name = if built_in(standard.as_bytes()).is_some() {
                    standard
                } else {
                    let name = format!("vPath{}", self.speeds.len() + 1);
                    self.line(1, &format!("CONST speeddata {name}:=[{text},500,5000,1000];"));
                    name
                };
                self.speeds.insert(speed, name);
            }
            let zone = step.zone_mm.map_or(-1, micro);
            if !self.zones.contains_key(&zone) {
                let name = match step.zone_mm {
                    None => "fine".to_owned(),
                    // z0 is 0.3 mm.
                    Some(_) if zone == 300 => "z0".to_owned(),
                    Some(size) => {
                        let text = short(size, 3);
                        let standard = format!("z{text}");
                        if zone != 0 && built_in(standard.as_bytes()).is_some() {
                            standard
                        } else {
                            // As the controller's own: reorientation half as large again, a tenth of a degree per mm.
                            let name = format!("zPath{}", self.zones.len() + 1);
                            let (wide, degrees) = (short(size * 1.5, 3), short(size * 0.15, 4));
                            let zone = format!("[FALSE,{text},{wide},{wide},{degrees},{wide},{degrees}]");
                            self.line(1, &format!("CONST zonedata {name}:={zone};"));
                            name
                        }
                    }
                };
                self.zones.insert(zone, name);
            }
        }
    }

    fn literal(&self, target: &TargetValue) -> String {
        let mut out = Vec::new();
        print::literal(&mut out, target, &self.options);
        out.into_iter().map(char::from).collect()
    }

    fn targets(&mut self, steps: &[Step]) {
        let mut number = 0;
        for step in steps {
            let via = step.via.map(TargetValue::Cartesian);
            for target in via.iter().chain(std::iter::once(&step.to)) {
                number += 10;
                let (type_name, letter) = match target {
                    TargetValue::Cartesian(_) => ("robtarget", 'p'),
                    TargetValue::Joint(_) => ("jointtarget", 'j'),
                };
                let literal = self.literal(target);
                self.line(1, &format!("CONST {type_name} {letter}{number}:={literal};"));
            }
        }
    }

    fn step(&mut self, draft: &Draft, step: &Step, number: &mut u32) {
        if let Some(comment) = &step.comment {
            self.comment(2, comment);
        }
        let via = step.via.map(TargetValue::Cartesian);
        let targets: Vec<String> = via
            .iter()
            .chain(std::iter::once(&step.to))
            .map(|target| {
                *number += 10;
                match target {
                    _ if !draft.named_targets => self.literal(target),
                    TargetValue::Cartesian(_) => format!("p{number}"),
                    TargetValue::Joint(_) => format!("j{number}"),
                }
            })
            .collect();
        let name = match step.kind {
            MotionKind::Joint => "MoveJ",
            MotionKind::Circular => "MoveC",
            MotionKind::AbsoluteJoint => "MoveAbsJ",
            _ => "MoveL",
        };
        let speed = &self.speeds[&micro(step.speed_mm_s)];
        let zone = &self.zones[&step.zone_mm.map_or(-1, micro)];
        let mut text = format!("{name} {},{speed},{zone},{}", targets.join(","), draft.tool.0);
        if folded(draft.work_object.0.as_bytes()) != b"wobj0" {
            text.push_str(&format!("\\WObj:={}", draft.work_object.0));
        }
        text.push(';');
        self.line(2, &text);
        if let Some(seconds) = step.wait_s {
            self.line(2, &format!("WaitTime {};", short(seconds, 3)));
        }
    }
}

fn truth(value: bool) -> &'static str {
    if value { "TRUE" } else { "FALSE" }
}

fn short(value: f64, decimals: u8) -> String {
    let mut out = Vec::new();
    number::write_short(&mut out, value, decimals);
    out.into_iter().map(char::from).collect()
}

fn list(values: &[f64], decimals: u8) -> String {
    let texts: Vec<String> = values.iter().map(|&value| short(value, decimals)).collect();
    format!("[{}]", texts.join(","))
}

fn frame(frame: &Frame) -> String {
    format!("[{},{}]", list(&frame.position_mm, 6), list(&frame.quaternion, 9))
}
