//! Tools of known value, found by every name in use.

use std::collections::HashMap;

use crate::cell::{CellFrame, same_name};
use truegrind_math::se3::Pose;
use truegrind_programs::motion::load::Load;
use truegrind_programs::nc::setup;

/// A tool whose value is known.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct KnownTool<'a> {
    pub(crate) name: String,
    /// Whether the program's text declares it.
    pub(crate) in_text: bool,
    pub(crate) frame: Pose,
    pub(crate) held: bool,
    /// Its own mass, with its centre in the flange frame.
    pub(crate) load: Option<Load>,
    /// Names used in comments.
    pub(crate) labels: Vec<&'a str>,
    pub(crate) stated: Option<&'a CellFrame>,
}

/// Tools of known value, by all their names.
#[derive(Debug)]
pub(crate) struct KnownTools<'a> {
    pub(crate) list: Vec<KnownTool<'a>>,
    /// Indices into the list, by lower-case name.
    lower: HashMap<String, Vec<usize>>,
    /// The same by normalised name, for tools that the program's text does not declare.
    plain: HashMap<String, Vec<usize>>,
}

impl<'a> KnownTools<'a> {
    pub(crate) fn of(list: Vec<KnownTool<'a>>) -> Self {
        let mut lower: HashMap<String, Vec<usize>> = HashMap::new();
        let mut plain: HashMap<String, Vec<usize>> = HashMap::new();
        for (index, known) in list.iter().enumerate() {
            let labels = known.labels.iter().copied().filter(|_| !known.in_text);
            let stated = known.stated.map(|stated| stated.name.as_str());
            for name in std::iter::once(known.name.as_str()).chain(stated).chain(labels) {
                lower.entry(name.to_ascii_lowercase()).or_default().push(index);
            }
            if !known.in_text {
                plain.entry(setup::plain(&known.name)).or_default().push(index);
            }
        }
        Self { list, lower, plain }
    }

    /// The tools of a name, in list order.
    pub(crate) fn called(&self, name: &str) -> impl Iterator<Item = &KnownTool<'a>> {
        let lower = self.lower.get(&name.to_ascii_lowercase()).into_iter().flatten();
        let plain = self.plain.get(&setup::plain(name)).into_iter().flatten();
        let mut indices: Vec<usize> = lower.chain(plain).copied().collect();
        indices.sort_unstable();
        indices.dedup();
        indices.into_iter().map(|index| &self.list[index])
    }
}

/// Most names listed in a sentence.
pub(crate) const MAX_NAMES: usize = 12;

impl KnownTool<'_> {
    pub(crate) fn is(&self, name: &str) -> bool {
        same_name(&self.name, name, self.in_text)
            || self.stated.is_some_and(|stated| stated.name.eq_ignore_ascii_case(name))
            || (!self.in_text && self.labels.iter().any(|label| label.eq_ignore_ascii_case(name)))
    }
}
