//! The entries of a cell file for the tools and work objects of a program.

use std::collections::HashMap;

use super::file::{Cell, CellFrame};
use truegrind_programs::motion::{Listing, Tool, WorkObject};
use truegrind_programs::nc::setup;

/// Lookup of a program's frames in a cell file, by name.
#[derive(Debug)]
pub(crate) struct CellLookup<'a> {
    pub(crate) cell: &'a Cell,
    tools: NameIndex<'a>,
    objects: NameIndex<'a>,
    /// Names that comments of an NC program give to a tool or frame, by its normalised name.
    labels: HashMap<String, Vec<&'a str>>,
}

/// Frames of a cell file by name.
#[derive(Debug)]
struct NameIndex<'a> {
    frames: &'a [CellFrame],
    /// By lower-case name.
    lower: HashMap<String, Vec<usize>>,
    /// By normalised name, in which T08 is T8.
    plain: HashMap<String, Vec<usize>>,
}

impl<'a> NameIndex<'a> {
    fn of(frames: &'a [CellFrame]) -> Self {
        let (mut lower, mut plain) = (HashMap::new(), HashMap::new());
        for (index, frame) in frames.iter().enumerate() {
            lower.entry(frame.name.to_ascii_lowercase()).or_insert_with(Vec::new).push(index);
            plain.entry(setup::plain(&frame.name)).or_insert_with(Vec::new).push(index);
        }
        Self { frames, lower, plain }
    }

    /// The entries for a frame of the program: by its name first, then by the names that comments give it.
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
        for (number, label) in &listing.nc.labels {
            labels.entry(setup::plain(number)).or_default().push(label);
        }
        Self { cell, tools: NameIndex::of(&cell.tool), objects: NameIndex::of(&cell.wobj), labels }
    }

    /// Names given in comments to a frame that the program's text does not declare.
    pub(crate) fn labels_of(&self, name: &str) -> &[&'a str] {
        if self.labels.is_empty() {
            return &[];
        }
        self.labels.get(&setup::plain(name)).map_or(&[], Vec::as_slice)
    }

    /// The entries for a tool of the program.
    pub(crate) fn tools(&self, tool: &Tool) -> Vec<&'a CellFrame> {
        let in_text = tool.place.is_some();
        self.tools.meaning(&tool.name, in_text, if in_text { &[] } else { self.labels_of(&tool.name) })
    }

    /// The entries for a work object of the program.
    pub(crate) fn objects(&self, object: &WorkObject) -> Vec<&'a CellFrame> {
        let in_text = object.place.is_some();
        self.objects.meaning(&object.name, in_text, if in_text { &[] } else { self.labels_of(&object.name) })
    }

    /// The entry for a tool of the program.
    pub(crate) fn tool(&self, tool: &Tool) -> Option<&'a CellFrame> {
        self.tools(tool).first().copied()
    }

    /// The entry for a work object of the program.
    pub(crate) fn object(&self, object: &WorkObject) -> Option<&'a CellFrame> {
        self.objects(object).first().copied()
    }
}

/// Whether a name of a program matches one of the cell file. NC programs declare no names: there T08 is T8.
pub(crate) fn same_name(name: &str, stated: &str, in_text: bool) -> bool {
    name.eq_ignore_ascii_case(stated) || (!in_text && setup::same(name, stated))
}
