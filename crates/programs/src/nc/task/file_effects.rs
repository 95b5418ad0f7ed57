//! Side effects of a whole file, by modal group. A group that the file only ever sets to one value is known at every join.

use super::super::modal_group::{ALL_GROUPS, GROUP_COUNT, ModalGroup};
use super::super::modal_state::AssignedKinds;

/// What a file sets on some path.
#[derive(Debug, Clone, Default)]
pub(super) struct FileEffects {
    /// The value to which a group is set.
    pub(super) value: [Option<u64>; GROUP_COUNT as usize],
    /// Groups that are set to more than one value, one bit each.
    pub(super) varying: u32,
    /// What is assigned where control flow may have branched before.
    pub(super) assigned: AssignedKinds,
    /// Whether the file sets origins (G92).
    pub(super) sets_origin: bool,
    /// How many joins have been passed.
    pub(super) joins: u32,
}

impl FileEffects {
    pub(super) fn record(&mut self, group: ModalGroup, value: u64) {
        match self.value[group as usize] {
            Some(old) if old != value => self.varying |= group.bit(),
            _ => self.value[group as usize] = Some(value),
        }
    }

    /// Records a value that certainly replaces all before it.
    pub(super) fn overwrite(&mut self, group: ModalGroup, value: u64) {
        self.value[group as usize] = Some(value);
        self.varying &= !group.bit();
    }

    /// Every group may be set to any value.
    pub(super) fn set_all_varying(&mut self) {
        self.varying = ALL_GROUPS;
    }

    /// A group is set to a value that the text does not determine.
    pub(super) fn set_varying(&mut self, group: ModalGroup) {
        self.varying |= group.bit();
    }
}
