//! Where tools and work objects come from: the cell file.
//!
//! A frame from *metrology* (CAD, a measuring machine, a tracker) is true as it stands. A frame that was *taught* with
//! the uncalibrated arm stands where the nominal model put it; the estimated model, given the same joint angles, says
//! where it truly is ([`crate::frames::taught`]). A taught frame without its teaching points cannot be moved: the difference is
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
//!
//! Before the first table may stand `robot = "abb-irb-120"`, the robot of the programs, which a model must be of, and
//! `angles = "wpr"`, what A, B and C of NC programs mean. A value may be `"?"`: it is still to
//! be filled in, and nothing is corrected before it is ([`Cell::open`]).

pub mod nc_setup;
mod placeholders;
pub mod robot_match;
pub mod template;

use std::collections::{BTreeSet, HashMap};

use nalgebra::{Quaternion, UnitQuaternion};
use serde::{Deserialize, Serialize};
use thiserror::Error;

use truegrind_math::se3::Pose;
use truegrind_programs::motion::{FARTHEST_MM, Listing, Tool, WorkObject};
use truegrind_programs::nc::orientation::Angles;
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
    /// More teaching points of tools than can be worked through.
    #[error(
        "tool \"{name}\": {points} teaching points, and the squares of these numbers are {work} for all tools together, \
         expected at most {MOST_TEACHING}: four to ten points tell a TCP, keep those that differ most"
    )]
    TooManyPoints {
        /// The tool with the most.
        name: String,
        /// Its points.
        points: usize,
        /// The sum of the squares.
        work: usize,
    },
    /// A convention of angles that is none.
    #[error("angles = \"{found}\": expected one of {}", Angles::words())]
    Angles {
        /// What stands there.
        found: String,
    },
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

/// Teaching points of tools, squared and added: 500 of one tool, ten of each of 2,500.
const MOST_TEACHING: usize = 250_000;

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
    /// The robot of the programs, by its name in the catalogue or in its robot file.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub robot: Option<String>,
    /// What A, B and C of NC programs mean, by its word ([`Angles`]); it goes before what robot file and
    /// comments of the programs say.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub angles: Option<String>,
    /// Tools.
    #[serde(default)]
    pub tool: Vec<CellFrame>,
    /// Work objects.
    #[serde(default)]
    pub wobj: Vec<CellFrame>,
    /// External axes.
    #[serde(default)]
    pub external: Vec<CellAxis>,
    /// Entries that say `"?"`, one sentence each: they are to be filled in.
    #[serde(skip)]
    pub open: Vec<String>,
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
        let (cell, open) = placeholders::read::<Cell>(text).map_err(|e| CellError::Syntax(e.to_string()))?;
        let cell = Cell { open, ..cell };
        if let Some(found) = cell.angles.as_ref().filter(|word| Angles::of(word).is_none()) {
            return Err(CellError::Angles { found: found.clone() });
        }
        for (kind, frames) in [("tool", &cell.tool), ("wobj", &cell.wobj)] {
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
        // A frame is worked out anew for each angle of its points, to tell what their rounding explains.
        let work: usize = cell.tool.iter().map(|tool| tool.teaching_deg.len().saturating_pow(2)).sum();
        if work > MOST_TEACHING {
            let most = cell.tool.iter().max_by_key(|tool| tool.teaching_deg.len());
            let (name, points) = most.map_or(("", 0), |tool| (tool.name.as_str(), tool.teaching_deg.len()));
            return Err(CellError::TooManyPoints { name: name.to_owned(), points, work });
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

    /// What A, B and C of NC programs mean, where the file says it.
    pub fn angles(&self) -> Option<Angles> {
        self.angles.as_deref().and_then(Angles::of)
    }

    /// What an external axis carries, by its place in a target.
    pub fn carries(&self, index: usize) -> Option<Carries> {
        self.external.iter().find(|axis| axis.index() == Some(index)).map(|axis| axis.carries)
    }
}

/// A cell file beside a program, by names: which of its frames mean one of the program.
#[derive(Debug)]
pub(crate) struct CellLookup<'a> {
    pub(crate) cell: &'a Cell,
    tools: NameIndex<'a>,
    objects: NameIndex<'a>,
    /// How comments of an NC program call a tool or frame, by its plain name.
    labels: HashMap<String, Vec<&'a str>>,
}

/// Frames of a cell file by their names.
#[derive(Debug)]
struct NameIndex<'a> {
    frames: &'a [CellFrame],
    /// By name in lower case.
    lower: HashMap<String, Vec<usize>>,
    /// By plain name, in which T08 is T8.
    plain: HashMap<String, Vec<usize>>,
}

impl<'a> NameIndex<'a> {
    fn of(frames: &'a [CellFrame]) -> Self {
        let (mut lower, mut plain) = (HashMap::new(), HashMap::new());
        for (place, frame) in frames.iter().enumerate() {
            lower.entry(frame.name.to_ascii_lowercase()).or_insert_with(Vec::new).push(place);
            plain.entry(setup::plain(&frame.name)).or_insert_with(Vec::new).push(place);
        }
        Self { frames, lower, plain }
    }

    /// Those that mean one of the program: by its name first, then by how a comment calls it.
    fn meaning(&self, name: &str, in_text: bool, labels: &[&str]) -> Vec<&'a CellFrame> {
        let by = |index: &HashMap<String, Vec<usize>>, key: &str| index.get(key).cloned().unwrap_or_default();
        let mut named = by(&self.lower, &name.to_ascii_lowercase());
        if !in_text {
            named.extend(by(&self.plain, &setup::plain(name)));
        }
        named.sort_unstable();
        named.dedup();
        let mut called: Vec<usize> =
            labels.iter().flat_map(|label| by(&self.lower, &label.to_ascii_lowercase())).collect();
        called.sort_unstable();
        called.dedup();
        called.retain(|place| named.binary_search(place).is_err());
        named.into_iter().chain(called).map(|place| &self.frames[place]).collect()
    }
}

impl<'a> CellLookup<'a> {
    pub(crate) fn of(cell: &'a Cell, listing: &'a Listing) -> Self {
        let mut labels: HashMap<String, Vec<&str>> = HashMap::new();
        for (number, label) in &listing.labels {
            labels.entry(setup::plain(number)).or_default().push(label);
        }
        Self { cell, tools: NameIndex::of(&cell.tool), objects: NameIndex::of(&cell.wobj), labels }
    }

    /// How comments call what the program's text does not declare.
    pub(crate) fn labels_of(&self, name: &str) -> &[&'a str] {
        if self.labels.is_empty() {
            return &[];
        }
        self.labels.get(&setup::plain(name)).map_or(&[], Vec::as_slice)
    }

    /// The frames that mean a tool of the program.
    pub(crate) fn tools(&self, tool: &Tool) -> Vec<&'a CellFrame> {
        let in_text = tool.place.is_some();
        self.tools.meaning(&tool.name, in_text, if in_text { &[] } else { self.labels_of(&tool.name) })
    }

    /// The frames that mean a work object of the program.
    pub(crate) fn objects(&self, object: &WorkObject) -> Vec<&'a CellFrame> {
        let in_text = object.place.is_some();
        self.objects.meaning(&object.name, in_text, if in_text { &[] } else { self.labels_of(&object.name) })
    }

    /// What is known of a tool of the program.
    pub(crate) fn tool(&self, tool: &Tool) -> Option<&'a CellFrame> {
        self.tools(tool).first().copied()
    }

    /// What is known of a work object of the program.
    pub(crate) fn object(&self, object: &WorkObject) -> Option<&'a CellFrame> {
        self.objects(object).first().copied()
    }
}

/// So many unused entries are named one by one.
const MOST_UNUSED: usize = 20;

/// Which entries of a cell file programs use.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub struct Used {
    tool: BTreeSet<usize>,
    wobj: BTreeSet<usize>,
    external: BTreeSet<usize>,
}

impl Used {
    /// By one program: what stands for a tool or work object of it, the tools that touched its teaching points (any, where
    /// that is not said), and the external axes that its targets state.
    pub fn by(listing: &Listing, cell: &Cell) -> Self {
        let stated = CellLookup::of(cell, listing);
        let place =
            |list: &[CellFrame], found: &CellFrame| list.iter().position(|one| std::ptr::eq(one, found));
        let mut out = Self::default();
        for tool in listing.tools.iter().chain(&listing.declared_tools) {
            out.tool.extend(stated.tools(tool).iter().filter_map(|found| place(&cell.tool, found)));
        }
        for object in &listing.work_objects {
            out.wobj.extend(stated.objects(object).iter().filter_map(|found| place(&cell.wobj, found)));
        }
        let taught = out.wobj.iter().map(|&k| &cell.wobj[k]).chain(out.tool.iter().map(|&k| &cell.tool[k]));
        let taught: Vec<&CellFrame> = taught.filter(|frame| !frame.teaching_deg.is_empty()).collect();
        for frame in taught {
            let pointer = frame.taught_with.as_deref();
            let touched = |tool: &CellFrame| pointer.is_none_or(|name| setup::same(name, &tool.name));
            out.tool.extend((0..cell.tool.len()).filter(|&k| touched(&cell.tool[k])));
        }
        let targets = listing.motions.iter().flat_map(|motion| &motion.targets);
        let mut moved = [false; 6];
        for value in targets.filter_map(|target| target.value.as_ref().ok()) {
            (0..6).for_each(|axis| moved[axis] |= value.external()[axis].is_some());
        }
        let axes = cell.external.iter().enumerate();
        out.external
            .extend(axes.filter(|(_, a)| a.index().is_some_and(|k| moved[k])).map(|(place, _)| place));
        out
    }

    /// By another program too.
    pub fn join(&mut self, other: &Self) {
        self.tool.extend(&other.tool);
        self.wobj.extend(&other.wobj);
        self.external.extend(&other.external);
    }

    /// A sentence for each entry that no program uses: a name that is misspelt says nothing, and is not asked for. What the
    /// surface file put there is its own.
    pub fn notes(&self, cell: &Cell, surface: Option<&SurfaceFile>) -> Vec<String> {
        let own = |frame: &CellFrame| {
            surface.is_none_or(|s| frame.name != s.tool.name && frame.name != s.work_object.name)
        };
        let frames = |kind: &str, list: &[CellFrame], used: &BTreeSet<usize>| {
            let unused = list.iter().enumerate().filter(|(place, frame)| !used.contains(place) && own(frame));
            let say = |(_, frame): (usize, &CellFrame)| {
                format!(
                    "cell file: {kind} \"{}\" is used by no program: is its name as the program writes it?",
                    frame.name
                )
            };
            let mut out: Vec<String> = unused.map(say).collect();
            let more = out.len().saturating_sub(MOST_UNUSED);
            out.truncate(MOST_UNUSED);
            if more > 0 {
                out.push(format!("cell file: {more} more [[{kind}]] are used by no program"));
            }
            out
        };
        let mut out = frames("tool", &cell.tool, &self.tool);
        out.extend(frames("wobj", &cell.wobj, &self.wobj));
        let unused = cell.external.iter().enumerate().filter(|(place, _)| !self.external.contains(place));
        out.extend(unused.map(|(_, axis)| {
            format!("cell file: external axis '{}' is stated in no target of any program", axis.axis)
        }));
        out
    }
}

/// Whether a name of a program is one of the cell file. NC programs declare no names: there T08 is T8.
pub(crate) fn same_name(name: &str, stated: &str, in_text: bool) -> bool {
    name.eq_ignore_ascii_case(stated) || (!in_text && setup::same(name, stated))
}
