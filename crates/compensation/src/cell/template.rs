//! Template of the cell file that programs need: filled in as far as they state it, with `"?"` for the rest.
//!
//! It loads as written; nothing is corrected with it before every `"?"` is replaced
//! ([`Cell::open`](crate::cell::Cell::open)).

use std::collections::{BTreeMap, BTreeSet};
use std::fmt::Write as _;

use crate::frames::undeclared::uses_frames;
use truegrind_math::se3::Pose;
use truegrind_programs::motion::{Frame, Listing, Motion, Reason};
use truegrind_programs::nc::dialect::Dialect;
use truegrind_programs::nc::orientation::Angles;
use truegrind_programs::nc::setup;
use truegrind_programs::reading::Language;

/// A program that needs a cell file.
#[derive(Debug, Clone, Copy)]
pub struct TemplateProgram<'a> {
    /// Its name, for comments.
    pub name: &'a str,
    /// Its language.
    pub language: Language,
    /// Its motions.
    pub listing: &'a Listing,
}

/// A cell file to fill in.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct CellTemplate {
    /// The file.
    pub text: String,
    /// Number of values to fill in.
    pub open: usize,
}

/// What programs state about a tool or work object.
struct Named {
    name: String,
    /// Name used in comments.
    label: Option<String>,
    language: Language,
    /// Its pose as programmed, or why that is unknown.
    commanded: Result<Pose, Reason>,
    motions: usize,
    /// Program and line of the first use.
    first: (String, u32),
}

/// Whether it is a tool, and its normalised name.
type Key = (bool, String);

/// The cell file of these programs. `robot` is written into it where known.
pub fn cell_template(programs: &[TemplateProgram<'_>], robot: Option<&str>) -> CellTemplate {
    let mut found: BTreeMap<Key, Named> = BTreeMap::new();
    let mut axes = [false; 6];
    for program in programs {
        for motion in program.listing.motions.iter().filter(|motion| uses_frames(motion)) {
            note(program, motion, &mut found);
        }
        moved_axes(program.listing, &mut axes);
    }
    let convention = programs.iter().any(|program| {
        let targets = program.listing.motions.iter().flat_map(|motion| &motion.targets);
        targets.map(|target| &target.value).any(|value| *value == Err(Reason::UnknownConvention))
    });
    let mut out = Writer { text: String::new(), open: 0 };
    out.head(programs, robot, convention);
    for is_tool in [true, false] {
        found
            .iter()
            .filter(|((kind, _), _)| *kind == is_tool)
            .for_each(|(_, named)| out.frame(is_tool, named));
    }
    let of_blocks = programs.iter().flat_map(|program| program.listing.nc.other_axes.keys());
    let of_blocks: BTreeSet<char> = of_blocks.map(char::to_ascii_lowercase).collect();
    let of_targets = ('a'..='f').enumerate().filter(|(axis, _)| axes[*axis]).map(|(_, letter)| letter);
    for letter in of_targets.chain(of_blocks) {
        out.line("", "");
        out.line("[[external]]", "an external axis that the programs move");
        out.line(&format!("axis = \"{letter}\""), "");
        out.ask("carries", "base (it carries the robot: a track, a gantry) | other");
    }
    CellTemplate { text: out.text, open: out.open }
}

/// Records tool and work object of a motion.
fn note(program: &TemplateProgram<'_>, motion: &Motion, found: &mut BTreeMap<Key, Named>) {
    let listing = program.listing;
    let tool = listing.tool(motion).map(|tool| {
        let commanded = tool.value.as_ref().map(|value| value.frame.pose()).map_err(|reason| *reason);
        (true, tool.name.as_str(), commanded)
    });
    let object = listing.work_object(motion).map(|object| {
        let commanded = match &object.value {
            Ok(value) if !value.fixed => Err(Reason::MovingWorkObject),
            value => value.as_ref().map(|value| value.user_frame.pose()).map_err(|reason| *reason),
        };
        (false, object.name.as_str(), commanded)
    });
    for (is_tool, name, commanded) in tool.into_iter().chain(object) {
        // The controller's built-in frames; no tool length (G49), or one that the text does not tell.
        let own = ["tool0", "wobj0"].iter().any(|own| name.eq_ignore_ascii_case(own));
        let is_none = is_tool && program.language == Language::Nc && (name == "G49" || name.ends_with('?'));
        if own || is_none {
            continue;
        }
        let key = match program.language {
            Language::Rapid => name.to_ascii_lowercase(),
            Language::Nc => setup::plain(name),
        };
        let new = || Named {
            name: name.to_owned(),
            label: listing.labels_of(name).next().map(str::to_owned),
            language: program.language,
            commanded,
            motions: 0,
            first: (file_of(program, motion.place.file), motion.place.line),
        };
        let named = found.entry((is_tool, key)).or_insert_with(new);
        named.motions += 1;
        if named.commanded.is_err() && commanded.is_ok() {
            named.commanded = commanded;
        }
    }
}

/// The file of a program, of whose files each counts its own lines.
fn file_of(program: &TemplateProgram<'_>, file: u32) -> String {
    match program.listing.files.as_slice() {
        files @ [_, _, ..] => files.get(file as usize).cloned().unwrap_or_default(),
        _ => program.name.to_owned(),
    }
}

/// External axes whose value changes from target to target.
fn moved_axes(listing: &Listing, axes: &mut [bool; 6]) {
    let mut first = [None; 6];
    for target in listing.motions.iter().flat_map(|motion| &motion.targets) {
        let Ok(value) = &target.value else { continue };
        for (axis, value) in value.external().iter().enumerate() {
            let Some(value) = value.get() else { continue };
            axes[axis] |= *first[axis].get_or_insert(value) != value;
        }
    }
}

struct Writer {
    text: String,
    open: usize,
}

/// Column of comments.
const COLUMN: usize = 32;

impl Writer {
    fn line(&mut self, key: &str, comment: &str) {
        let _ = match comment {
            "" => writeln!(self.text, "{key}"),
            comment => writeln!(self.text, "{key:COLUMN$}  # {comment}"),
        };
    }

    /// A key to fill in.
    fn ask(&mut self, key: &str, comment: &str) {
        self.open += 1;
        self.line(&format!("{key} = \"?\""), comment);
    }

    fn head(&mut self, programs: &[TemplateProgram<'_>], robot: Option<&str>, convention: bool) {
        let names = match programs {
            [] => "no program".to_owned(),
            [one] => one.name.to_owned(),
            [one, rest @ ..] => format!("{} and {} more", one.name, rest.len()),
        };
        let _ = writeln!(
            self.text,
            "# The cell of {}: the positions of its tools and work objects, and how they are known.\n\
             # Replace every \"?\"; until then nothing is corrected with this file. What follows # is optional.\n\
             # An origin is \"metrology\" if the numbers are exact (CAD, measured), and \"taught\" if they come from\n\
             # points that the arm touched before it was calibrated.\n",
            names.replace(['\n', '\r'], " ")
        );
        match robot {
            Some(robot) => {
                self.line(&format!("robot = {}", quoted(robot)), "a model of another robot is refused")
            }
            None => self.line("# robot = \"abb-irb-120\"", "with it a model of another robot is refused"),
        }
        if programs.iter().any(|program| program.language == Language::Nc) {
            self.line(
                "# start_deg = [0, 0, 0, 0, 90, 0]",
                "joints (°), roughly, in which the arm starts: NC states none",
            );
        }
        if programs.iter().any(|program| !program.listing.nc.open_controls.is_empty()) {
            let words = Dialect::WORDS.map(|(word, _)| word).join(" | ");
            self.ask("control", &format!("which control runs the programs: {words}"));
        }
        if convention {
            let words = Angles::words().replace(", ", " | ");
            self.ask("angles", &format!("what A, B and C mean: {words}"));
        }
    }

    fn frame(&mut self, is_tool: bool, named: &Named) {
        let (kind, what) = match (is_tool, named.language) {
            (true, _) => ("tool", "tool"),
            (false, Language::Rapid) => ("wobj", "work object"),
            (false, Language::Nc) => ("wobj", "work offset"),
        };
        let motions =
            if named.motions == 1 { "1 motion".to_owned() } else { format!("{} motions", named.motions) };
        let uses = format!("{motions}, first in {}, line {}", named.first.0, named.first.1)
            .replace(['\n', '\r'], " ");
        self.line("", "");
        if let (Language::Rapid, Err(reason)) = (named.language, named.commanded) {
            let remedy = match reason {
                Reason::Undeclared => "give the module that declares it, too",
                Reason::MovingWorkObject => {
                    "motions in it are not corrected, whatever its origin; those past which the axis does not move can be, in a work object that is fixed \
                     where the part then is (ufprog TRUE)"
                }
                _ => "a cell file cannot say it",
            };
            self.line(&format!("# {what} {}: {reason}: {remedy} ({uses})", named.name), "");
            return;
        }
        self.line(&format!("[[{kind}]]"), &uses);
        let called =
            named.label.as_ref().map_or_else(String::new, |label| format!("a comment calls it {label}"));
        self.line(&format!("name = {}", quoted(&named.name)), &called.replace(['\n', '\r'], " "));
        self.ask("origin", "metrology | taught");
        let meaning = if is_tool { "the tool's tip on the flange" } else { "its zero in the robot's base" };
        match named.commanded {
            Ok(commanded) => {
                let Frame { position_mm: p, quaternion: q } = Frame::from_pose(&commanded);
                self.line(
                    &format!(
                        "# the program has it at [{}, {}, {}] mm, quaternion [{}, {}, {}, {}]",
                        short(p[0], 3),
                        short(p[1], 3),
                        short(p[2], 3),
                        short(q[0], 6),
                        short(q[1], 6),
                        short(q[2], 6),
                        short(q[3], 6)
                    ),
                    "",
                );
            }
            Err(_) => {
                self.ask("position_mm", &format!("{meaning}: [x, y, z] in mm"));
                self.line("# quaternion_wxyz = [1, 0, 0, 0]", "if it is rotated: w, x, y, z");
            }
        }
        if is_tool {
            self.line("# teaching_deg = [[…], […], […], […]]", "taught: 4 or more poses about one point (°)");
        } else {
            self.line("# taught_with = \"NAME\"", "taught: the tool that touched its points");
            self.line("# teaching_deg = [[…], […], […]]", "taught: two points on x, one on y (°)");
        }
    }
}

/// A number without trailing zeros.
fn short(value: f64, decimals: usize) -> String {
    let text = format!("{value:.decimals$}");
    let text = text.trim_end_matches('0').trim_end_matches('.');
    if text == "-0" { "0".to_owned() } else { text.to_owned() }
}

/// A TOML basic string.
fn quoted(text: &str) -> String {
    toml::Value::String(text.to_owned()).to_string()
}
