//! The sections of a cell file, and what is wrong with them.

use std::collections::HashMap;
use std::fmt;

use nalgebra::{Quaternion, UnitQuaternion};
use serde::{Deserialize, Serialize};
use thiserror::Error;

use truegrind_arm::model::Joints;
use truegrind_math::se3::Pose;
use truegrind_programs::motion::{Listing, MAX_POSITION_MM};
use truegrind_programs::nc::dialect::Dialect;
use truegrind_programs::nc::orientation::Angles;
use truegrind_programs::nc::setup;
use truegrind_surfaces::SurfaceFile;
use truegrind_surfaces::file::Origin;

/// Which frame of a work object its teaching points define.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
#[non_exhaustive]
pub enum Teaches {
    /// The user frame, as in the controller's three-point method; object frame and program displacements apply on top of it.
    #[default]
    Uframe,
    /// The object frame: user and object frame together are at the touched points, displacements on top.
    Oframe,
}

/// Origin of a frame.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
#[non_exhaustive]
pub enum FrameOrigin {
    /// From CAD or measured by other means: exact.
    Metrology,
    /// Taught with the uncalibrated arm.
    Taught,
}

impl FrameOrigin {
    /// The word used in files.
    fn word(self) -> &'static str {
        match self {
            FrameOrigin::Metrology => "metrology",
            FrameOrigin::Taught => "taught",
        }
    }
}

impl From<Origin> for FrameOrigin {
    fn from(origin: Origin) -> Self {
        match origin {
            Origin::Metrology => FrameOrigin::Metrology,
            Origin::Taught => FrameOrigin::Taught,
        }
    }
}

/// One tool or work object of a cell.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct CellFrame {
    /// Name in the program, case-insensitive.
    pub name: String,
    /// Its origin.
    pub origin: FrameOrigin,
    /// Controller joint angles (°) of the teaching points. A tool that the robot holds: four or more poses with the TCP at
    /// one fixed point. A stationary tool: one or more poses in which the tool named in `taught_with` touches its tip, or
    /// four or more with one and the same tip on the robot. A work object: three poses, the first two on its x axis, the
    /// third on its y axis, touched by the tool named in `taught_with` (where the robot holds the part, by a stationary
    /// tool).
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub teaching_deg: Vec<[f64; 6]>,
    /// The tool that touched the teaching points. Where a work object names none, the only tool of program and cell file
    /// other than tool0; with several it must be named.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub taught_with: Option<String>,
    /// Which frame of a work object the teaching points define; by default the user frame.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub teaches: Option<Teaches>,
    /// Position (mm) for NC programs, which name tools and work offsets (`T1`, `G54`) without their values: a tool on the
    /// flange, a work object in the base. A RAPID program states it itself, and the two must agree.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub position_mm: Option<[f64; 3]>,
    /// Orientation, w, x, y, z; by default none.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub quaternion_wxyz: Option<[f64; 4]>,
}

impl CellFrame {
    /// A frame of which only the origin is known.
    pub fn of(name: impl Into<String>, origin: FrameOrigin) -> Self {
        Self {
            name: name.into(),
            origin,
            teaching_deg: Vec::new(),
            taught_with: None,
            teaches: None,
            position_mm: None,
            quaternion_wxyz: None,
        }
    }

    /// The pose stated in the file.
    pub fn pose(&self) -> Option<Pose> {
        let [w, x, y, z] = self.quaternion_wxyz.unwrap_or([1.0, 0.0, 0.0, 0.0]);
        let turn = UnitQuaternion::from_quaternion(Quaternion::new(w, x, y, z));
        self.position_mm.map(|position| Pose::from_parts(position.into(), turn))
    }
}

/// Reason why a cell file cannot be used.
#[derive(Debug, Clone, PartialEq, Eq, Error)]
#[non_exhaustive]
pub enum CellError {
    /// More teaching points of tools than can be processed.
    #[error(
        "tool \"{name}\": {points} teaching points, and the squares of these numbers are {work} for all \
         tools together, expected at most {MAX_TEACHING}: four to ten points determine a TCP; keep those \
         that differ most"
    )]
    TooManyPoints {
        /// The tool with the most points.
        name: String,
        /// Its points.
        points: usize,
        /// Sum of the squares.
        work: usize,
    },
    /// A word for a control that is not known.
    #[error("control = \"{found}\": expected one of {}", Dialect::WORDS.map(|(word, _)| word).join(", "))]
    Control {
        /// What the file has.
        found: String,
    },
    /// Joints at the start that are no angles in degrees.
    #[error(
        "start_deg = {found}: expected six joint angles in degrees (multiply radians by 57.3; whole degrees do)"
    )]
    Start {
        /// The numbers found.
        found: String,
    },
    /// An unknown angle convention.
    #[error("angles = \"{found}\": expected one of {}", Angles::words())]
    Angles {
        /// The word found.
        found: String,
    },
    /// Not TOML, or a missing, misspelt or mistyped key.
    #[error("not a cell file: {0}")]
    Syntax(String),
    /// Inconsistent keys of a frame, or an impossible number.
    #[error("{kind} \"{name}\": {what}")]
    Frame {
        /// Its section.
        kind: FrameKind,
        /// Its name.
        name: String,
        /// The key and its fault.
        what: String,
    },
    /// One frame under two equivalent names.
    #[error("{kind} \"{name}\" is stated twice (as \"{before}\" before): keep one of the two")]
    Twice {
        /// Its section.
        kind: FrameKind,
        /// Its name.
        name: String,
        /// Name of the first.
        before: String,
    },
    /// A letter that no external axis has.
    #[error("external axis '{axis}': expected one of a, b, c, d, e, f (RAPID), u, v, w, e (NC)")]
    UnknownAxis {
        /// The letter.
        axis: char,
    },
    /// An external axis stated twice.
    #[error("external axis '{axis}' is stated twice: keep one of the two")]
    AxisTwice {
        /// The letter.
        axis: char,
    },
    /// Contradiction with a surface file.
    #[error(
        "{kind} \"{name}\": the cell file states origin = \"{}\", the surface file origin = \"{}\": correct \
         the one that is wrong",
        cell.word(), surface.word()
    )]
    Contradicted {
        /// Its section.
        kind: FrameKind,
        /// Its name.
        name: String,
        /// Origin in the cell file.
        cell: FrameOrigin,
        /// Origin in the surface file.
        surface: FrameOrigin,
    },
}

/// Limit of the sum of squared numbers of teaching points of tools: 500 of one tool, ten of each of 2,500.
const MAX_TEACHING: usize = 250_000;

/// A frame's section of a cell file.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum FrameKind {
    /// `[[tool]]`.
    Tool,
    /// `[[wobj]]`, a work object or work offset.
    Wobj,
}

impl fmt::Display for FrameKind {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            FrameKind::Tool => "tool",
            FrameKind::Wobj => "wobj",
        })
    }
}

/// A tool tip nearer to the flange is stated in metres (mm): no tool is shorter, and few that a robot carries are longer than 1 m.
const METRES_MM: f64 = 1.0;

impl CellFrame {
    /// Checks that its keys are consistent and its numbers possible.
    fn check(&self, kind: FrameKind) -> Result<(), CellError> {
        let wrong =
            |what: &str| Err(CellError::Frame { kind, name: self.name.clone(), what: what.to_owned() });
        if self.name.trim().is_empty() {
            return wrong("a name is expected, as the program writes it");
        }
        if let Some(position) = self.position_mm
            && !position.iter().all(|x| x.abs() <= MAX_POSITION_MM)
        {
            return wrong("position_mm: expected three numbers in mm, within 1,000,000 mm");
        }
        if kind == FrameKind::Tool
            && let Some(position) = self.position_mm
        {
            let length_mm = position.iter().map(|x| x * x).sum::<f64>().sqrt();
            if length_mm > 0.0 && length_mm < METRES_MM {
                return wrong(&format!(
                    "position_mm: the tool tip is {length_mm:.4} mm from the flange, so the numbers are probably metres: expected mm \
                     (or exactly [0, 0, 0])"
                ));
            }
        }
        if let Some(q) = self.quaternion_wxyz {
            if !((q.iter().map(|q| q * q).sum::<f64>() - 1.0).abs() < 1e-3) {
                return wrong("quaternion_wxyz does not have length 1");
            }
            if self.position_mm.is_none() {
                return wrong("quaternion_wxyz has no effect without position_mm: state both");
            }
        }
        let found = self.teaching_deg.len();
        if !self.teaching_deg.iter().flatten().all(|angle| angle.abs() <= setup::MAX_JOINT_DEG) {
            return wrong("teaching_deg: expected joint angles in degrees");
        }
        if self.origin == FrameOrigin::Metrology && found > 0 {
            return wrong(
                "teaching_deg contradicts origin = \"metrology\": write origin = \"taught\", or remove the \
                 points if the frame's numbers are exact",
            );
        }
        if found == 0 && (self.taught_with.is_some() || self.teaches.is_some()) {
            let key = if self.taught_with.is_some() { "taught_with" } else { "teaches" };
            return wrong(&format!(
                "{key} has no effect without teaching_deg: give the teaching points, or remove it"
            ));
        }
        if kind == FrameKind::Tool && self.teaches.is_some() {
            return wrong("teaches is for work objects: a tool's points teach its TCP");
        }
        let (least, most) = match (kind, &self.taught_with) {
            (FrameKind::Tool, None) => (4, usize::MAX),
            (FrameKind::Tool, Some(_)) => (1, usize::MAX),
            _ => (3, 3),
        };
        if found > 0 && !(least..=most).contains(&found) {
            let expected = if most == least { "exactly" } else { "at least" };
            return wrong(&format!("{found} teaching points, expected {expected} {least}"));
        }
        Ok(())
    }
}

/// What an external axis carries.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
#[non_exhaustive]
pub enum Carries {
    /// The robot's base: a track or gantry.
    Base,
    /// A part, a tool, or nothing that a target depends on.
    Other,
}

/// Letters of external axes: those of a RAPID target in its order, then those that NC programs alone have.
pub const AXES: [char; 9] = ['a', 'b', 'c', 'd', 'e', 'f', 'u', 'v', 'w'];

/// One external axis of a cell.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct CellAxis {
    /// Its letter: `a` to `f` in a target of RAPID, `u`, `v`, `w` or `e` in a block of an NC program.
    pub axis: char,
    /// What it carries.
    pub carries: Carries,
}

impl CellAxis {
    /// Its index in [`AXES`].
    pub fn index(&self) -> Option<usize> {
        AXES.iter().position(|letter| *letter == self.axis.to_ascii_lowercase())
    }
}

/// Keys that hold for all of a cell file.
const OF_THE_FILE: [&str; 4] = ["robot", "angles", "control", "start_deg"];

/// The message of the parser, and what TOML makes of a key of the file that stands below the head of a section.
fn with_order(message: String) -> String {
    let key = message.split("unknown field `").nth(1).and_then(|rest| rest.split('`').next());
    match key.filter(|key| OF_THE_FILE.contains(key)) {
        None => message,
        Some(key) => {
            let message = message.trim_end();
            format!(
                "{message}; `{key}` is there, but below the head of a section, so TOML reads it as part of that section: put it above the first \
                 [[tool]], [[wobj]] or [[external]]"
            )
        }
    }
}

/// The cell file: origins of tools and work objects, and external axes.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Cell {
    /// The robot of the programs, by its name in the catalogue or in its robot file.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub robot: Option<String>,
    /// Convention of A, B and C in NC programs, by its word ([`Angles`]); takes precedence over comments of the programs.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub angles: Option<String>,
    /// The control that runs NC programs: one of [`Dialect::WORDS`].
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub control: Option<String>,
    /// Joints as the controller shows them (°), roughly, in which the arm stands where a program begins: NC words state no
    /// configuration, and a place whose previous position is unknown is reached in the branch of these, by the nearest turns.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub start_deg: Option<[f64; 6]>,
    /// Tools.
    #[serde(default)]
    pub tool: Vec<CellFrame>,
    /// Work objects.
    #[serde(default)]
    pub wobj: Vec<CellFrame>,
    /// External axes.
    #[serde(default)]
    pub external: Vec<CellAxis>,
    /// Entries with the placeholder `"?"`, one sentence each.
    #[serde(skip)]
    pub open: Vec<String>,
}

impl Cell {
    /// Reads a cell file.
    ///
    /// ```
    /// use truegrind_compensation::cell::{Cell, CellError, FrameKind, FrameOrigin};
    ///
    /// let cell = Cell::from_toml("[[tool]]\nname = \"tDisc\"\norigin = \"metrology\"\nposition_mm = [0, 0, 120]\n")?;
    /// assert_eq!(cell.tool[0].origin, FrameOrigin::Metrology);
    /// assert_eq!(cell.tool[0].pose().map(|pose| pose.translation.z), Some(120.0));
    /// // One tool under two names.
    /// let twice = "[[tool]]\nname = \"T8\"\norigin = \"metrology\"\n[[tool]]\nname = \"T08\"\norigin = \"taught\"\n";
    /// assert!(matches!(Cell::from_toml(twice), Err(CellError::Twice { kind: FrameKind::Tool, .. })));
    /// // A key of the file below a section.
    /// let late = "[[tool]]\nname = \"T8\"\norigin = \"metrology\"\nstart_deg = [0, 0, 0, 0, 90, 0]\n";
    /// assert!(Cell::from_toml(late).is_err_and(|error| error.to_string().contains("put it above the first [[tool]]")));
    /// # Ok::<(), CellError>(())
    /// ```
    ///
    /// # Errors
    /// [`CellError`], with key and reason.
    pub fn from_toml(text: &str) -> Result<Self, CellError> {
        let (cell, open) = super::placeholders::read::<Cell>(text)
            .map_err(|e| CellError::Syntax(with_order(e.to_string())))?;
        let cell = Cell { open, ..cell };
        if let Some(found) = cell.angles.as_ref().filter(|word| Angles::of(word).is_none()) {
            return Err(CellError::Angles { found: found.clone() });
        }
        if let Some(found) = cell.control.as_ref().filter(|word| Dialect::stated(word).is_none()) {
            return Err(CellError::Control { found: found.clone() });
        }
        if let Some(found) = cell.start_deg.filter(|start| !setup::may_be_degrees(start)) {
            return Err(CellError::Start { found: format!("{found:?}") });
        }
        for (kind, frames) in [(FrameKind::Tool, &cell.tool), (FrameKind::Wobj, &cell.wobj)] {
            let mut stated: HashMap<String, &CellFrame> = HashMap::new();
            for frame in frames {
                frame.check(kind)?;
                if let Some(other) = stated.insert(setup::plain(&frame.name), frame) {
                    return Err(CellError::Twice {
                        kind,
                        name: frame.name.clone(),
                        before: other.name.clone(),
                    });
                }
            }
        }
        // The frame is recomputed for each angle of its points to determine the effect of rounding.
        let work: usize = cell.tool.iter().map(|tool| tool.teaching_deg.len().saturating_pow(2)).sum();
        if work > MAX_TEACHING {
            let most = cell.tool.iter().max_by_key(|tool| tool.teaching_deg.len());
            let (name, points) = most.map_or(("", 0), |tool| (tool.name.as_str(), tool.teaching_deg.len()));
            return Err(CellError::TooManyPoints { name: name.to_owned(), points, work });
        }
        if let Some(wrong) = cell.external.iter().find(|axis| axis.index().is_none()) {
            return Err(CellError::UnknownAxis { axis: wrong.axis });
        }
        for (index, axis) in cell.external.iter().enumerate() {
            if cell.external[..index].iter().any(|other| other.index() == axis.index()) {
                return Err(CellError::AxisTwice { axis: axis.axis });
            }
        }
        Ok(cell)
    }

    /// The cell with the origins that a surface file states for its tool and work object.
    ///
    /// # Errors
    /// [`CellError::Contradicted`], where the cell file states otherwise.
    pub fn with_surface(mut self, surface: &SurfaceFile) -> Result<Self, CellError> {
        let (tool, object) = (&surface.tool, &surface.work_object);
        for (kind, frames, name, origin) in [
            (FrameKind::Tool, &mut self.tool, &tool.name, tool.origin),
            (FrameKind::Wobj, &mut self.wobj, &object.name, object.origin),
        ] {
            let Some(origin) = origin.map(FrameOrigin::from) else { continue };
            match frames.iter().find(|frame| setup::same(&frame.name, name)) {
                Some(stated) if stated.origin != origin => {
                    return Err(CellError::Contradicted {
                        kind,
                        name: name.clone(),
                        cell: stated.origin,
                        surface: origin,
                    });
                }
                Some(_) => {}
                None => frames.push(CellFrame::of(name, origin)),
            }
        }
        Ok(self)
    }

    /// Convention of A, B and C in NC programs, where the file states it.
    pub fn angles(&self) -> Option<Angles> {
        self.angles.as_deref().and_then(Angles::of)
    }

    /// The control that runs NC programs, where the file states it.
    pub fn control(&self) -> Option<Dialect> {
        self.control.as_deref().and_then(Dialect::stated)
    }

    /// Joints where a program begins (rad), if this file states them, or the program itself.
    pub(crate) fn start(&self, listing: &Listing) -> Option<Joints> {
        self.start_deg.or(listing.nc.start_deg).map(|start| Joints::from(start.map(f64::to_radians)))
    }

    /// What an external axis carries, by its index in [`AXES`].
    pub fn carries(&self, index: usize) -> Option<Carries> {
        self.external.iter().find(|axis| axis.index() == Some(index)).map(|axis| axis.carries)
    }
}
