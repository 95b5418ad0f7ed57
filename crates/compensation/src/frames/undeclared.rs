//! Tools and work objects that motions use and no file declares, with the remedy.

use std::collections::BTreeMap;

use truegrind_programs::motion::{Listing, Motion, Place, Reason};
use truegrind_programs::reading::Language;

/// A tool or work object without a value.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Undeclared {
    /// Whether it is a tool; else a work object or work offset.
    pub tool: bool,
    /// Its name as the program writes it.
    pub name: String,
    /// Motions that use it.
    pub motions: usize,
    /// Line of the first of them, 1-based.
    pub line: u32,
}

/// The undeclared tools and work objects of a listing, in order of first use.
pub fn undeclared(listing: &Listing) -> Vec<Undeclared> {
    let mut found: BTreeMap<(bool, &str), Undeclared> = BTreeMap::new();
    let tools = listing.tools.iter().any(|tool| nowhere(tool.value.as_ref().err(), tool.place));
    let mut objects = listing.work_objects.iter();
    if !tools && !objects.any(|object| nowhere(object.value.as_ref().err(), object.place)) {
        return Vec::new();
    }
    for motion in listing.motions.iter().filter(|motion| uses_frames(motion)) {
        for (tool, name) in names(listing, motion) {
            let line = motion.place.line;
            let new = || Undeclared { tool, name: name.to_owned(), motions: 0, line };
            found.entry((tool, name)).or_insert_with(new).motions += 1;
        }
    }
    let mut found: Vec<Undeclared> = found.into_values().collect();
    found.sort_by_key(|one| (one.line, !one.tool));
    found
}

/// Whether a motion needs its tool and work object: in machine coordinates neither has a part in it, so nobody is to state them for it.
pub(crate) fn uses_frames(motion: &Motion) -> bool {
    motion.own_reason != Some(Reason::MachineCoordinates)
}

/// Undeclared frames of a motion, and whether each is a tool.
fn names<'a>(listing: &'a Listing, motion: &Motion) -> impl Iterator<Item = (bool, &'a str)> {
    // A cancelled tool length is no tool that could be declared, nor is one whose number the text does not tell.
    let is_tool = |name: &str| !(listing.numbered && matches!(name, "G49" | "T?"));
    let tool = listing
        .tool(motion)
        .filter(|tool| is_tool(&tool.name) && nowhere(tool.value.as_ref().err(), tool.place));
    let object =
        listing.work_object(motion).filter(|object| nowhere(object.value.as_ref().err(), object.place));
    let tool = tool.map(|tool| (true, tool.name.as_str()));
    tool.into_iter().chain(object.map(|object| (false, object.name.as_str())))
}

/// Whether a frame has no value for this reason because no file declares it. A declared one may have no value either: where the program
/// computes it from what is known only at run time.
fn nowhere(reason: Option<&Reason>, declared: Option<Place>) -> bool {
    declared.is_none()
        && matches!(
            reason,
            Some(
                Reason::Undeclared
                    | Reason::ToolUnknown
                    | Reason::LengthAllowance
                    | Reason::WorkObjectUnknown
            )
        )
}

/// One sentence for each, with the remedy.
pub(crate) fn notes(listing: &Listing, language: Language) -> Vec<String> {
    let sentence = |one: &Undeclared| {
        let (what, key) = match (one.tool, language) {
            (true, _) => ("tool", "tool"),
            (false, Language::Rapid) => ("work object", "wobj"),
            (false, Language::Nc) => ("work offset", "wobj"),
        };
        let uses = if one.motions == 1 {
            "1 motion uses".to_owned()
        } else {
            format!("{} motions use", one.motions)
        };
        let remedy = match language {
            Language::Rapid => {
                "give the module that declares it too, or the whole folder with --together".to_owned()
            }
            Language::Nc => format!(
                "state its pose in a cell file (--cell): [[{key}]] name = \"{}\", origin = \"metrology\", \
                 position_mm = [x, y, z], quaternion_wxyz = [w, x, y, z]",
                one.name
            ),
        };
        format!(
            "{what} {} is declared in none of the files, and {uses} it (first: line {}): {remedy}",
            one.name, one.line
        )
    };
    let all = undeclared(listing);
    let mut out: Vec<String> = all.iter().take(NAMED).map(sentence).collect();
    if all.len() > NAMED {
        out.push(format!("and {} more tools and work objects that no file declares", all.len() - NAMED));
    }
    out
}

/// Most frames that are listed.
const NAMED: usize = 12;
