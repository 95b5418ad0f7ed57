//! The places of a file to which control comes from elsewhere, and the states that arrive there.

use super::super::expression::Variable;
use super::super::modal_state::ModalState;
use crate::dataflow::Arrivals;

/// A place to which control comes from elsewhere.
#[derive(Debug, Clone, PartialEq, Eq, Hash)]
pub(super) enum Site {
    /// A label or block number.
    Label(Variable),
    /// A program or subprogram.
    Program(Variable),
    /// After the calls of a program or label.
    Return(Variable),
    /// The head of a loop, by the block that opens it.
    Head(u32),
    /// The branch of this number, if the conditions before it are false.
    Branch(u32, u32),
    /// After a loop or branches.
    After(u32),
}

/// The states that arrive at each place of a file.
pub(super) type Paths = Arrivals<Site, ModalState>;

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
    /// After ELSE.
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
