//! The places of a file to which control comes from elsewhere, and the states that arrive there.

use std::collections::{HashMap, HashSet};

use super::super::expression::Variable;
use super::super::modal_state::ModalState;
use crate::dataflow::Lattice;

/// A place to which control comes from elsewhere.
#[derive(Debug, Clone, PartialEq, Eq, Hash)]
pub(super) enum Site {
    /// A label or block number.
    Label(Variable),
    /// A program or subprogram.
    Program(Variable),
    /// Behind the calls of a program or label.
    Return(Variable),
    /// The head of a loop, by the block that opens it.
    Head(u32),
    /// The branch of this number, if the conditions before it are false.
    Branch(u32, u32),
    /// Behind a loop or branches.
    Behind(u32),
}

/// The states that arrive at each place of a file, from all passes so far.
#[derive(Debug, Default)]
pub(super) struct Paths {
    pub(super) arrived: HashMap<Site, ModalState>,
    /// Those of the pass before, where this one starts anew.
    pub(super) before: HashMap<Site, ModalState>,
    /// Whether calls are guessed to change nothing where their end has not been reached, and whether one has been.
    pub(super) guesses: bool,
    pub(super) has_guessed: bool,
    /// Where something leads, and which places there are.
    pub(super) targets: HashSet<Site>,
    pub(super) places: HashSet<Site>,
    /// Whether this pass has added anything.
    pub(super) has_grown: bool,
    /// Whether something may lead anywhere.
    pub(super) is_open: bool,
    /// Whether labels are also reached by jumps: the return of any may then end any other (Heidenhain).
    pub(super) returns_are_common: bool,
    /// Whether code that no path reaches is taken to run.
    pub(super) is_all_reached: bool,
    /// Whether this pass has found code that no path reaches.
    pub(super) has_unreached: bool,
}

impl Paths {
    pub(super) fn add(&mut self, site: &Site, state: &ModalState) {
        match self.arrived.get_mut(site) {
            Some(all) => {
                let before = all.clone();
                all.join(state);
                self.has_grown |= *all != before;
            }
            None => {
                self.has_grown = true;
                self.arrived.insert(site.clone(), state.clone());
            }
        }
    }

    /// Whether a jump or call may lead to a place that the text does not show.
    pub(super) fn leads_elsewhere(&self) -> bool {
        self.is_open || self.targets.iter().any(|site| !self.places.contains(site))
    }
}

/// A loop or branches that have not ended yet.
#[derive(Debug)]
pub(super) struct Structure {
    pub(super) kind: StructureKind,
    /// The block that opens it.
    pub(super) block: u32,
    /// Its name (O word of LinuxCNC).
    pub(super) name: Variable,
    /// The number of the next branch.
    pub(super) branch: u32,
}

#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) enum StructureKind {
    /// IF, until its ELSE.
    If,
    /// Behind ELSE.
    Else,
    /// The condition stands at the head.
    While,
    /// The condition stands at the end.
    Until,
    /// Left only by a jump.
    Endless,
}

/// What the names of labels begin with.
const LABEL: &[u8] = b"LBL ";

/// Whether a name is that of a label of Heidenhain.
pub(super) fn is_label(name: &[u8]) -> bool {
    name.starts_with(LABEL)
}

/// The name of a label of Heidenhain.
pub(super) fn label(name: &[u8]) -> Variable {
    [LABEL, name].concat()
}
