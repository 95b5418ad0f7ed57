//! Where tools and work objects come from: the cell file.
//!
//! A frame from *metrology* (CAD, a measuring machine, a tracker) is true as it stands. A frame that was *taught* with
//! the uncalibrated arm stands where the nominal model put it; the estimated model, given the same joint angles, says
//! where it truly is ([`super::taught`]). A taught frame without its teaching points cannot be moved: the difference is
//! estimated and stated instead.
//!
//! ```toml
//! [[tool]]
//! name = "tPointer"
//! origin = "taught"              # metrology | taught
//! teaching_deg = [[…], […], […], […]]   # four or more poses about one fixed point
//!
//! [[wobj]]
//! name = "wPart"
//! origin = "taught"
//! taught_with = "tPointer"       # the tool that touched the points
//! teaches = "uframe"             # uframe | oframe
//! teaching_deg = [[…], […], […]] # two points on x, one on y
//!
//! [[external]]
//! axis = "a"
//! carries = "base"               # base | other
//! ```

use nalgebra::{Quaternion, UnitQuaternion};
use serde::{Deserialize, Serialize};
use thiserror::Error;

pub use super::taught::{taught_frame, taught_tcp};
use truegrind_math::se3::Pose;
use truegrind_programs::motion::{FARTHEST_MM, Listing, Tool, WorkObject};
use truegrind_programs::nc::setup;
use truegrind_surfaces::SurfaceFile;
use truegrind_surfaces::file::Origin;

/// Which frame of a work object its teaching points make.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
#[non_exhaustive]
pub enum Teaches {
    /// The user frame, as the controller's three-point method: the object frame and program displacements stay on top of it.
    #[default]
    Uframe,
    /// The object frame: user and object frame together stand where the points were touched, displacements on top.
    Oframe,
}

/// How a frame was obtained.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
#[non_exhaustive]
pub enum FrameOrigin {
    /// From CAD or measured by other means: true as it stands.
    Metrology,
    /// Taught with the uncalibrated arm.
    Taught,
}

impl FrameOrigin {
    /// As files say it.
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
    /// Name in the program; letters count the same in either case.
    pub name: String,
    /// How it was obtained.
    pub origin: FrameOrigin,
    /// Controller joint angles (°) of the teaching points. A tool that the robot holds: four or more poses with the TCP
    /// at one fixed point. A tool that stands: one or more poses in which the tool named in `taught_with` touches its tip,
    /// or four or more with one and the same tip on the robot. A work object: three poses, first and second on its x axis,
    /// the third on its y axis, touched by the tool named in `taught_with` (where the robot holds the part, by a tool that
    /// stands).
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub teaching_deg: Vec<[f64; 6]>,
    /// The tool that touched the teaching points. Where a work object names none, it is the one tool of program and cell
    /// file, apart from tool0; with several it must be named.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub taught_with: Option<String>,
    /// Which frame of a work object the teaching points make; the user frame where left out.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub teaches: Option<Teaches>,
    /// Where it lies (mm), for NC programs, which name tools and work offsets (`T1`, `G54`) without saying where they are:
    /// a tool on the flange, a work object in the base. A RAPID program says it itself, and must say the same.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub position_mm: Option<[f64; 3]>,
    /// How it is turned, w, x, y, z; not at all where left out.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub quaternion_wxyz: Option<[f64; 4]>,
}

impl CellFrame {
    /// One of which nothing but the origin is known.
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

    /// Where the file says it lies.
    pub fn pose(&self) -> Option<Pose> {
        let [w, x, y, z] = self.quaternion_wxyz.unwrap_or([1.0, 0.0, 0.0, 0.0]);
        let turn = UnitQuaternion::from_quaternion(Quaternion::new(w, x, y, z));
        self.position_mm.map(|position| Pose::from_parts(position.into(), turn))
    }
}

/// Why a cell file cannot be used.
#[derive(Debug, Clone, PartialEq, Eq, Error)]
#[non_exhaustive]
pub enum CellError {
    /// Not TOML, or a key that is missing, misspelt or of the wrong type.
    #[error("not a cell file: {0}")]
    Syntax(String),
    /// Keys of a frame that do not go together, or a number that cannot be.
    #[error("{kind} \"{name}\": {what}")]
    Frame {
        /// `tool` or `wobj`.
        kind: &'static str,
        /// Its name.
        name: String,
        /// The key and what is wrong.
        what: String,
    },
    /// One frame under two names that mean the same.
    #[error("{kind} \"{name}\" is stated twice (as \"{before}\" before): keep one of the two")]
    Twice {
        /// `tool` or `wobj`.
        kind: &'static str,
        /// Its name.
        name: String,
        /// The name of the first.
        before: String,
    },
    /// A letter that no external axis has.
    #[error("external axis '{axis}': expected one of a, b, c, d, e, f")]
    UnknownAxis {
        /// The letter.
        axis: char,
    },
    /// An external axis that is stated twice.
    #[error("external axis '{axis}' is stated twice: keep one of the two")]
    AxisTwice {
        /// The letter.
        axis: char,
    },
    /// A surface file says otherwise.
    #[error(
        "{kind} \"{name}\": the cell file says origin = \"{}\", the surface file origin = \"{}\": correct the one that is wrong",
        cell.word(), surface.word()
    )]
    Contradicted {
        /// `tool` or `wobj`.
        kind: &'static str,
        /// Its name.
        name: String,
        /// What the cell file says.
        cell: FrameOrigin,
        /// What the surface file says.
        surface: FrameOrigin,
    },
}

/// Joint angles beyond this are none (°).
const MOST_DEG: f64 = 3600.0;

impl CellFrame {
    /// Whether its keys go together and its numbers can be.
    fn check(&self, kind: &'static str) -> Result<(), CellError> {
        let wrong =
            |what: &str| Err(CellError::Frame { kind, name: self.name.clone(), what: what.to_owned() });
        if self.name.trim().is_empty() {
            return wrong("a name is expected, as the program writes it");
        }
        if let Some(position) = self.position_mm
            && !position.iter().all(|x| x.abs() <= FARTHEST_MM)
        {
            return wrong("position_mm: expected three numbers in mm, within 1,000,000 mm");
        }
        if let Some(q) = self.quaternion_wxyz {
            if !((q.iter().map(|q| q * q).sum::<f64>() - 1.0).abs() < 1e-3) {
                return wrong("quaternion_wxyz has not length 1");
            }
            if self.position_mm.is_none() {
                return wrong("quaternion_wxyz says nothing without position_mm: state both");
            }
        }
        let found = self.teaching_deg.len();
        if !self.teaching_deg.iter().flatten().all(|angle| angle.abs() <= MOST_DEG) {
            return wrong("teaching_deg: expected joint angles in degrees");
        }
        if self.origin == FrameOrigin::Metrology && found > 0 {
            return wrong(
                "teaching_deg contradicts origin = \"metrology\": write origin = \"taught\", or remove the points where the \
                 frame's numbers are true as they stand",
            );
        }
        if found == 0 && (self.taught_with.is_some() || self.teaches.is_some()) {
            let key = if self.taught_with.is_some() { "taught_with" } else { "teaches" };
            return wrong(&format!(
                "{key} says nothing without teaching_deg: give the teaching points, or remove it"
            ));
        }
        if kind == "tool" && self.teaches.is_some() {
            return wrong("teaches is for work objects: a tool's points teach its TCP");
        }
        let (least, most) = match (kind, &self.taught_with) {
            ("tool", None) => (4, usize::MAX),
            ("tool", Some(_)) => (1, usize::MAX),
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

/// One external axis of a cell.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct CellAxis {
    /// Its letter in a target, `a` to `f`.
    pub axis: char,
    /// What it carries.
    pub carries: Carries,
}

impl CellAxis {
    /// Its place among the external axes of a target.
    pub fn index(&self) -> Option<usize> {
        ('a'..='f').position(|letter| letter == self.axis.to_ascii_lowercase())
    }
}

/// The cell file: what is known of the origin of tools and work objects, and of external axes.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Cell {
    /// Tools.
    #[serde(default)]
    pub tool: Vec<CellFrame>,
    /// Work objects.
    #[serde(default)]
    pub wobj: Vec<CellFrame>,
    /// External axes.
    #[serde(default)]
    pub external: Vec<CellAxis>,
}

impl Cell {
    /// Reads a cell file.
    ///
    /// ```
    /// use truegrind_compensation::cell::{Cell, CellError, FrameOrigin};
    ///
    /// let cell = Cell::from_toml("[[tool]]\nname = \"tDisc\"\norigin = \"metrology\"\nposition_mm = [0, 0, 120]\n")?;
    /// assert_eq!(cell.tool[0].origin, FrameOrigin::Metrology);
    /// assert_eq!(cell.tool[0].pose().map(|pose| pose.translation.z), Some(120.0));
    /// // One tool under two names.
    /// let twice = "[[tool]]\nname = \"T8\"\norigin = \"metrology\"\n[[tool]]\nname = \"T08\"\norigin = \"taught\"\n";
    /// assert!(matches!(Cell::from_toml(twice), Err(CellError::Twice { kind: "tool", .. })));
    /// # Ok::<(), CellError>(())
    /// ```
    ///
    /// # Errors
    /// [`CellError`], with key and reason.
    pub fn from_toml(text: &str) -> Result<Self, CellError> {
        let cell: Self = toml::from_str(text).map_err(|e| CellError::Syntax(e.to_string()))?;
        for (kind, frames) in [("tool", &cell.tool), ("wobj", &cell.wobj)] {
            for (index, frame) in frames.iter().enumerate() {
                frame.check(kind)?;
                if let Some(other) =
                    frames[..index].iter().find(|other| setup::same(&other.name, &frame.name))
                {
                    return Err(CellError::Twice {
                        kind,
                        name: frame.name.clone(),
                        before: other.name.clone(),
                    });
                }
            }
        }
        if let Some(wrong) = cell.external.iter().find(|axis| axis.index().is_none()) {
            return Err(CellError::UnknownAxis { axis: wrong.axis });
        }
        for (place, axis) in cell.external.iter().enumerate() {
            if cell.external[..place].iter().any(|other| other.index() == axis.index()) {
                return Err(CellError::AxisTwice { axis: axis.axis });
            }
        }
        Ok(cell)
    }

    /// The cell with what a surface file says of the origin of its tool and its work object.
    ///
    /// # Errors
    /// [`CellError::Contradicted`], where the cell file says otherwise.
    pub fn with_surface(mut self, surface: &SurfaceFile) -> Result<Self, CellError> {
        let (tool, object) = (&surface.tool, &surface.work_object);
        for (kind, frames, name, origin) in [
            ("tool", &mut self.tool, &tool.name, tool.origin),
            ("wobj", &mut self.wobj, &object.name, object.origin),
        ] {
            let Some(origin) = origin.map(FrameOrigin::from) else { continue };
            match frames.iter().find(|frame| frame.name.eq_ignore_ascii_case(name)) {
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

    /// What an external axis carries, by its place in a target.
    pub fn carries(&self, index: usize) -> Option<Carries> {
        self.external.iter().find(|axis| axis.index() == Some(index)).map(|axis| axis.carries)
    }

    /// What is known of a tool of a program.
    pub fn tool_of(&self, tool: &Tool, listing: &Listing) -> Option<&CellFrame> {
        stated_of(&self.tool, &tool.name, tool.place.is_some(), listing).next()
    }

    /// What is known of a work object of a program.
    pub fn wobj_of(&self, object: &WorkObject, listing: &Listing) -> Option<&CellFrame> {
        stated_of(&self.wobj, &object.name, object.place.is_some(), listing).next()
    }
}

/// The frames of a cell file that mean one of a program: by its name first, then, in NC programs, by how a comment calls
/// it. `in_text`: the program's text declares it.
pub(super) fn stated_of<'c>(
    frames: &'c [CellFrame],
    name: &str,
    in_text: bool,
    listing: &Listing,
) -> impl Iterator<Item = &'c CellFrame> {
    let labels: Vec<&str> = listing.labels_of(name).filter(|_| !in_text).collect();
    let named = frames.iter().filter(move |frame| same_name(name, &frame.name, in_text));
    let called =
        frames.iter().filter(move |frame| labels.iter().any(|label| label.eq_ignore_ascii_case(&frame.name)));
    let named: Vec<&CellFrame> = named.collect();
    let called: Vec<&CellFrame> =
        called.filter(|frame| !named.iter().any(|one| std::ptr::eq(*one, *frame))).collect();
    named.into_iter().chain(called)
}

/// Whether a name of a program is one of the cell file. NC programs declare no names: there T08 is T8.
pub(super) fn same_name(name: &str, stated: &str, in_text: bool) -> bool {
    name.eq_ignore_ascii_case(stated) || (!in_text && setup::same(name, stated))
}
