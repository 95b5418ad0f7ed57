//! New NC programs from a draft.
//!
//! Fanuc style: X Y Z and the angles A B C under G43.4. Siemens: TRAORI with the tool vector A3 B3 C3 and the spin
//! THETA. Unchanged modal words are omitted, as by post-processors. Comments state the tool and the work offset; the
//! control ignores them and `compensate` reads them. The same values must be entered at the control.

use thiserror::Error;

use super::dialect::Dialect;
use super::orientation::{Angles, vector_and_spin};
use crate::draft::Draft;
use crate::motion::{Frame, MotionKind};
use crate::rapid::number;
use crate::rewrite::RewriteOptions;

/// Why a draft cannot be written.
#[derive(Debug, Clone, PartialEq, Error)]
#[non_exhaustive]
pub enum WriteError {
    /// A dialect without a writer.
    #[error(
        "{dialect} programs are read and rewritten, but new ones are not written: name a .nc (Fanuc) or .mpf (Siemens) file"
    )]
    Dialect {
        /// Its name.
        dialect: &'static str,
    },
    /// A motion that five axes cannot make.
    #[error("step {step}: a {kind:?} motion is not written as NC: expected linear or joint motions to poses")]
    Step {
        /// The index of the step.
        step: usize,
        /// Its kind.
        kind: MotionKind,
    },
    /// A number that is not finite.
    #[error("step {step}: a number of the target or speed is not finite")]
    NotFinite {
        /// The index of the step.
        step: usize,
    },
}

/// Writes a program. `angles` is the convention of A, B and C; Siemens programs use a tool vector instead.
///
/// ```
/// use truegrind_math::option_f64::OptionF64;
/// use truegrind_programs::draft::{Draft, Step};
/// use truegrind_programs::motion::{Frame, MotionKind, RobTarget, TargetValue, ToolValue, WorkObjectValue};
/// use truegrind_programs::nc::{dialect::Dialect, orientation::Angles, setup::Setup, writer};
/// use truegrind_programs::reading::Program;
/// # let frame = Frame::IDENTITY;
/// # let tool = ToolValue { robhold: true, frame, mass_kg: 0.8, centre_of_gravity_mm: [0.0, 0.0, 40.0] };
/// # let object = WorkObjectValue {
/// #     robhold: false,
/// #     fixed: true,
/// #     mechanical_unit: String::new(),
/// #     user_frame: frame,
/// #     object_frame: frame,
/// # };
///
/// let quaternion = [0.0, 0.0, 1.0, 0.0];
/// let to = RobTarget { position_mm: [380.0, -60.5, 250.0], quaternion, conf: [0; 4], external: [OptionF64::NONE; 6] };
/// let step = Step {
///     kind: MotionKind::Linear,
///     to: TargetValue::Cartesian(to),
///     via: None,
///     speed_mm_s: 50.0,
///     zone_mm: None,
///     comment: None,
///     wait_s: None,
/// };
/// let draft = Draft {
///     name: "blade".into(),
///     comments: Vec::new(),
///     tool: ("T1".into(), tool),
///     work_object: ("G54".into(), object),
///     named_targets: false,
///     monitor_configuration: true,
///     start_deg: None,
///     steps: vec![step],
/// };
/// // Both dialects express the same position.
/// for (name, dialect) in [("blade.nc", Dialect::Fanuc), ("blade.mpf", Dialect::Siemens)] {
///     let file = writer::write(&draft, dialect, Angles::Wpr)?;
///     let program = Program::read(&[(name, &file[..])], &Setup::default());
///     let target = program.listing().motions.last().and_then(|motion| motion.to()?.value.ok()).ok_or("no target")?;
///     assert_eq!(target.cartesian().ok_or("no pose")?.position_mm, [380.0, -60.5, 250.0]);
/// }
/// assert!(writer::write(&draft, Dialect::Heidenhain, Angles::Wpr).is_err());
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
///
/// # Errors
/// [`WriteError`].
pub fn write(draft: &Draft, dialect: Dialect, angles: Angles) -> Result<Vec<u8>, WriteError> {
    if !matches!(dialect, Dialect::Fanuc | Dialect::Siemens) {
        return Err(WriteError::Dialect { dialect: dialect.text() });
    }
    let mut writer = Writer {
        out: Vec::new(),
        dialect,
        angles,
        options: RewriteOptions::default(),
        number: 0,
        last: Vec::new(),
        near: [0.0; 3],
        mode: "",
    };
    writer.head(draft);
    for (index, step) in draft.steps.iter().enumerate() {
        let target = match (step.kind, step.to.cartesian()) {
            (MotionKind::Linear | MotionKind::Joint, Some(target)) => target,
            (kind, _) => return Err(WriteError::Step { step: index, kind }),
        };
        let finite = target.position_mm.iter().chain(&target.quaternion).all(|value| value.is_finite());
        if !finite || !step.speed_mm_s.is_finite() || !step.wait_s.is_none_or(f64::is_finite) {
            return Err(WriteError::NotFinite { step: index });
        }
        writer.step(step, &target.frame());
    }
    writer.tail();
    Ok(writer.out)
}

struct Writer {
    out: Vec<u8>,
    dialect: Dialect,
    angles: Angles,
    options: RewriteOptions,
    number: u32,
    /// The last value of each address, as text.
    last: Vec<(&'static str, Vec<u8>)>,
    near: [f64; 3],
    mode: &'static str,
}

impl Writer {
    fn comment(&mut self, text: &str) {
        // One line of ASCII, without characters that end a comment.
        let text: String = text
            .chars()
            .map(|c| match c {
                '(' | ')' if self.dialect == Dialect::Fanuc => ' ',
                c if c.is_ascii() && !c.is_ascii_control() => c,
                _ => '?',
            })
            .collect();
        let line = if self.dialect == Dialect::Fanuc { format!("({text})\n") } else { format!("; {text}\n") };
        self.out.extend_from_slice(line.as_bytes());
    }

    fn block(&mut self, words: &str) {
        self.number += 10;
        self.out.extend_from_slice(format!("N{} {words}\n", self.number).as_bytes());
    }

    fn head(&mut self, draft: &Draft) {
        match self.dialect {
            Dialect::Fanuc => {
                self.out.extend_from_slice(b"%\nO0001\n");
                self.comment(&draft.name);
            }
            _ => self.comment(&draft.name),
        }
        for comment in &draft.comments {
            self.comment(comment);
        }
        if self.dialect == Dialect::Fanuc {
            self.comment(&format!("truegrind angles {}", self.angles.text()));
        }
        let object = &draft.work_object.1;
        let base = object.user_frame.pose() * object.object_frame.pose();
        self.comment(&format!("truegrind tool T1 {} {}", draft.tool.0, frame(&draft.tool.1.frame)));
        self.comment(&format!(
            "truegrind frame G54 {} {}",
            draft.work_object.0,
            frame(&Frame::from_pose(&base))
        ));
        if let Some(start) = draft.start_deg {
            self.comment(&format!(
                "truegrind start [{}]",
                start.map(|angle| format!("{angle:.1}")).join(",")
            ));
        }
        match self.dialect {
            Dialect::Fanuc => {
                self.block("G90 G21 G17 G40 G94 G64");
                self.block("T1 M6");
                self.block("G54");
                self.block("G43.4 H1");
            }
            _ => {
                self.block("G90 G71 G17 G40 G94 G64");
                self.block("T1 D1 M6");
                self.block("G54");
                self.block("TRAORI");
                self.block("ORIWKS ORIROTA");
            }
        }
    }

    fn tail(&mut self) {
        match self.dialect {
            Dialect::Fanuc => {
                self.block("G49");
                self.block("M30");
                self.out.extend_from_slice(b"%\n");
            }
            _ => {
                self.block("TRAFOOF");
                self.block("M30");
            }
        }
    }

    fn step(&mut self, step: &crate::draft::Step, target: &Frame) {
        if let Some(comment) = &step.comment {
            self.comment(comment);
        }
        let mut words: Vec<u8> = Vec::new();
        let word = |words: &mut Vec<u8>, text: &str| {
            if !words.is_empty() {
                words.push(b' ');
            }
            words.extend_from_slice(text.as_bytes());
        };
        if step.zone_mm.is_none() {
            word(&mut words, "G9");
        }
        let mode = if step.kind == MotionKind::Joint { "G0" } else { "G1" };
        if mode != self.mode {
            word(&mut words, mode);
            self.mode = mode;
        }
        let texts = self.target_words(target);
        // The three components of a vector are written together, because an omitted one is 0.
        let vector_moves = texts.iter().any(|(name, text)| is_vector(name) && !self.is_current(name, text));
        let before = words.len();
        for (name, text) in texts {
            let is_current = if is_vector(name) { !vector_moves } else { self.is_current(name, &text) };
            if is_current {
                continue;
            }
            if !words.is_empty() {
                words.push(b' ');
            }
            words.extend_from_slice(name.as_bytes());
            words.extend_from_slice(&text);
            self.last.retain(|(other, _)| *other != name);
            self.last.push((name, text));
        }
        if words.len() == before {
            // The tool is there already.
            self.wait(step.wait_s);
            return;
        }
        if mode == "G1" {
            let mut feed = Vec::new();
            number::write_short(&mut feed, step.speed_mm_s * 60.0, 3);
            if !self.is_current("F", &feed) {
                words.extend_from_slice(b" F");
                words.extend_from_slice(&feed);
                self.last.retain(|(other, _)| *other != "F");
                self.last.push(("F", feed));
            }
        }
        let text = String::from_utf8_lossy(&words).into_owned();
        self.block(&text);
        self.wait(step.wait_s);
    }

    /// The target words with their values.
    fn target_words(&mut self, target: &Frame) -> Vec<(&'static str, Vec<u8>)> {
        let rotation = target.pose().rotation;
        let [x, y, z] = target.position_mm;
        let p = self.options.position_decimals;
        let values: Vec<(&'static str, f64, u8)> = match self.dialect {
            Dialect::Fanuc => {
                let angles = self.angles.angles(&rotation, self.near);
                self.near = angles;
                let d = self.options.joint_decimals;
                let [a, b, c] = angles;
                vec![("X", x, p), ("Y", y, p), ("Z", z, p), ("A", a, d), ("B", b, d), ("C", c, d)]
            }
            _ => {
                let (vector, spin) = vector_and_spin(&rotation, self.near[2]);
                self.near[2] = spin;
                let d = self.options.quaternion_decimals;
                let [a, b, c] = vector;
                vec![
                    ("X", x, p),
                    ("Y", y, p),
                    ("Z", z, p),
                    ("A3=", a, d),
                    ("B3=", b, d),
                    ("C3=", c, d),
                    ("THETA=", spin, self.options.joint_decimals),
                ]
            }
        };
        values
            .into_iter()
            .map(|(name, value, decimals)| {
                let mut text = Vec::new();
                number::write(&mut text, value, decimals);
                (name, text)
            })
            .collect()
    }

    /// Dwell: milliseconds for Fanuc, seconds for Siemens.
    fn wait(&mut self, seconds: Option<f64>) {
        let Some(seconds) = seconds.filter(|seconds| *seconds > 0.0) else { return };
        match self.dialect {
            Dialect::Fanuc => self.block(&format!("G4 P{:.0}", (seconds * 1000.0).round())),
            _ => {
                let mut text = b"G4 F".to_vec();
                number::write_short(&mut text, seconds, 3);
                self.block(&String::from_utf8_lossy(&text));
            }
        }
    }

    fn is_current(&self, name: &str, text: &[u8]) -> bool {
        self.last.iter().any(|(other, last)| *other == name && last == text)
    }
}

fn is_vector(name: &str) -> bool {
    name.ends_with("3=")
}

/// `[[x,y,z],[q1,q2,q3,q4]]`
fn frame(frame: &Frame) -> String {
    let mut out = b"[[".to_vec();
    for (index, value) in frame.position_mm.iter().enumerate() {
        if index > 0 {
            out.push(b',');
        }
        number::write_short(&mut out, *value, 6);
    }
    out.extend_from_slice(b"],[");
    for (index, value) in frame.quaternion.iter().enumerate() {
        if index > 0 {
            out.push(b',');
        }
        number::write_short(&mut out, *value, 9);
    }
    out.extend_from_slice(b"]]");
    String::from_utf8_lossy(&out).into_owned()
}
