//! Which entries of a cell file the programs use.

use std::collections::BTreeSet;

use super::file::{AXES, Cell, CellFrame, FrameKind};
use super::lookup::CellLookup;
use truegrind_programs::motion::{Listing, TargetValue};
use truegrind_programs::nc::setup;
use truegrind_surfaces::SurfaceFile;

/// Most unused entries that are listed one by one.
const MAX_UNUSED: usize = 20;

/// The entries of a cell file that programs use.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub struct Used {
    tool: BTreeSet<usize>,
    wobj: BTreeSet<usize>,
    external: BTreeSet<usize>,
}

impl Used {
    /// Used by one program: the entries for its tools and work objects, the tools that touched their teaching points (any
    /// tool where that is not stated), and the external axes of its targets.
    pub fn by(listing: &Listing, cell: &Cell) -> Self {
        let stated = CellLookup::of(cell, listing);
        let index =
            |list: &[CellFrame], found: &CellFrame| list.iter().position(|one| std::ptr::eq(one, found));
        let mut out = Self::default();
        // Among the declared tools of NC programs are those of the cell file itself, which thereby are not used.
        let declared = listing.declared_tools.iter().filter(|tool| tool.place.is_some());
        for tool in listing.tools.iter().chain(declared) {
            out.tool.extend(stated.tools(tool).iter().filter_map(|found| index(&cell.tool, found)));
        }
        for object in &listing.work_objects {
            out.wobj.extend(stated.objects(object).iter().filter_map(|found| index(&cell.wobj, found)));
        }
        let taught = out.wobj.iter().map(|&k| &cell.wobj[k]).chain(out.tool.iter().map(|&k| &cell.tool[k]));
        let taught: Vec<&CellFrame> = taught.filter(|frame| !frame.teaching_deg.is_empty()).collect();
        for frame in taught {
            let pointer = frame.taught_with.as_deref();
            let touched = |tool: &CellFrame| pointer.is_none_or(|name| setup::same(name, &tool.name));
            out.tool.extend((0..cell.tool.len()).filter(|&k| touched(&cell.tool[k])));
        }
        let moves = |axis: usize| {
            let mut targets = listing.motions.iter().flat_map(|motion| &motion.targets);
            let stated =
                |value: &TargetValue| value.external().get(axis).is_some_and(|value| value.is_some());
            listing.nc.other_axes.contains_key(&AXES[axis].to_ascii_uppercase())
                || targets.any(|target| target.value.as_ref().is_ok_and(stated))
        };
        let axes = cell.external.iter().enumerate();
        out.external.extend(axes.filter(|(_, a)| a.index().is_some_and(moves)).map(|(index, _)| index));
        out
    }

    /// Adds the entries that another program uses.
    pub fn join(&mut self, other: &Self) {
        self.tool.extend(&other.tool);
        self.wobj.extend(&other.wobj);
        self.external.extend(&other.external);
    }

    /// A sentence for each unused entry: probably a misspelt name. Entries that came from the surface file are excepted.
    pub fn notes(&self, cell: &Cell, surface: Option<&SurfaceFile>) -> Vec<String> {
        let own = |frame: &CellFrame| {
            surface.is_none_or(|s| frame.name != s.tool.name && frame.name != s.work_object.name)
        };
        let frames = |kind: FrameKind, list: &[CellFrame], used: &BTreeSet<usize>| {
            let unused = list.iter().enumerate().filter(|(index, frame)| !used.contains(index) && own(frame));
            let say = |(_, frame): (usize, &CellFrame)| {
                format!(
                    "cell file: {kind} \"{}\" is not used by any program: is its name spelt as in the program?",
                    frame.name
                )
            };
            let mut out: Vec<String> = unused.map(say).collect();
            let more = out.len().saturating_sub(MAX_UNUSED);
            out.truncate(MAX_UNUSED);
            if more > 0 {
                out.push(format!("cell file: {more} more [[{kind}]] are not used by any program"));
            }
            out
        };
        let mut out = frames(FrameKind::Tool, &cell.tool, &self.tool);
        out.extend(frames(FrameKind::Wobj, &cell.wobj, &self.wobj));
        let unused = cell.external.iter().enumerate().filter(|(index, _)| !self.external.contains(index));
        out.extend(unused.map(|(_, axis)| {
            format!(
                "cell file: external axis '{}' does not occur in any target or block of any program",
                axis.axis
            )
        }));
        out
    }
}
