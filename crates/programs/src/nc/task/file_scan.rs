//! What the first pass over a file finds, before its blocks are interpreted.

use std::collections::{BTreeSet, HashMap};

use super::super::expression::Variable;

/// Properties of a whole file that its interpretation needs in advance.
#[derive(Default)]
pub(super) struct FileScan {
    /// Whether the file changes tools by M6.
    pub(super) tool_change_by_m6: bool,
    /// Whether the program starts again at its end (M99 in a main program).
    pub(super) restarts_at_end: bool,
    /// Whether the file is only a subprogram: its initial state is that of an unknown caller.
    pub(super) is_subprogram: bool,
    /// Whether the file is of a control whose words are not supported (DIN/ISO of Heidenhain, Okuma).
    pub(super) unknown_control: bool,
    /// Contours that lathe cycles read: first block number to last.
    pub(super) contours: HashMap<u64, u64>,
    /// Names that the file declares (Siemens).
    pub(super) declared: BTreeSet<Vec<u8>>,
    /// Names of macros (Siemens, DEFINE): the words that each stands for are not read.
    pub(super) macros: BTreeSet<Vec<u8>>,
    /// Declared names of an integer type.
    pub(super) integer_variables: BTreeSet<Vec<u8>>,
    /// Programs and subprograms in the file, by their O word.
    pub(super) programs: BTreeSet<Variable>,
    /// Block numbers that are targets of jumps.
    pub(super) jump_targets: BTreeSet<u64>,
    /// Whether a jump has a computed target.
    pub(super) computed_jump: bool,
}
