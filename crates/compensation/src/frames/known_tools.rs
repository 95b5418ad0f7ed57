//! The tools of a program whose value is known, by every name that they go by.

use std::collections::HashMap;

use crate::cell::{CellFrame, same_name};
use truegrind_math::se3::Pose;
use truegrind_programs::nc::setup;

/// A tool whose value is known.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct KnownTool<'a> {
    pub(crate) name: String,
    /// Whether the program's text declares it.
    pub(crate) in_text: bool,
    pub(crate) frame: Pose,
    pub(crate) held: bool,
    /// How comments call it.
    pub(crate) labels: Vec<&'a str>,
    pub(crate) stated: Option<&'a CellFrame>,
}

/// The tools whose value is known, by every name that they go by.
#[derive(Debug)]
pub(crate) struct KnownTools<'a> {
    pub(crate) list: Vec<KnownTool<'a>>,
    /// Places in the list, by names in lower case.
    lower: HashMap<String, Vec<usize>>,
    /// The same by plain names, where the program's text does not declare the tool.
    plain: HashMap<String, Vec<usize>>,
}

impl<'a> KnownTools<'a> {
    pub(crate) fn of(list: Vec<KnownTool<'a>>) -> Self {
        let mut lower: HashMap<String, Vec<usize>> = HashMap::new();
        let mut plain: HashMap<String, Vec<usize>> = HashMap::new();
        for (place, known) in list.iter().enumerate() {
            let labels = known.labels.iter().copied().filter(|_| !known.in_text);
            let stated = known.stated.map(|stated| stated.name.as_str());
            for name in std::iter::once(known.name.as_str()).chain(stated).chain(labels) {
                lower.entry(name.to_ascii_lowercase()).or_default().push(place);
            }
            if !known.in_text {
                plain.entry(setup::plain(&known.name)).or_default().push(place);
            }
        }
        Self { list, lower, plain }
    }

    /// Those of a name, in the order of the list.
    pub(crate) fn called(&self, name: &str) -> impl Iterator<Item = &KnownTool<'a>> {
        let lower = self.lower.get(&name.to_ascii_lowercase()).into_iter().flatten();
        let plain = self.plain.get(&setup::plain(name)).into_iter().flatten();
        let mut places: Vec<usize> = lower.chain(plain).copied().collect();
        places.sort_unstable();
        places.dedup();
        places.into_iter().map(|place| &self.list[place])
    }
}

/// So many names are listed in a sentence.
pub(crate) const MOST_NAMES: usize = 12;

impl KnownTool<'_> {
    pub(crate) fn is(&self, name: &str) -> bool {
        same_name(&self.name, name, self.in_text)
            || self.stated.is_some_and(|stated| stated.name.eq_ignore_ascii_case(name))
            || (!self.in_text && self.labels.iter().any(|label| label.eq_ignore_ascii_case(name)))
    }
}
