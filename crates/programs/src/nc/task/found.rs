//! What a file sets, group by group: what is set to one thing only is known wherever ways meet.

use super::super::machine::{Assigns, GROUPS, Group};

/// What a file sets, group by group.
#[derive(Debug, Clone, Default)]
pub(super) struct Found {
    /// The one thing that a group is set to.
    pub(super) value: [Option<u64>; GROUPS as usize],
    /// Groups that are set to more than one thing, one bit each.
    pub(super) several: u32,
    /// What is given values after ways have parted, or where they may.
    pub(super) assigns: Assigns,
    /// Whether origins are set (G92).
    pub(super) presets: bool,
    /// How often the way has parted.
    pub(super) forgotten: u32,
}

impl Found {
    pub(super) fn add(&mut self, group: Group, value: u64) {
        match self.value[group as usize] {
            Some(old) if old != value => self.several |= 1 << group as u32,
            _ => self.value[group as usize] = Some(value),
        }
    }

    /// The one thing that a group is set to so far.
    pub(super) fn settle(&mut self, group: Group, value: u64) {
        self.value[group as usize] = Some(value);
        self.several &= !(1 << group as u32);
    }

    /// Every group may be set to anything.
    pub(super) fn add_all(&mut self) {
        self.several = (1 << GROUPS) - 1;
    }

    /// A group that is set to what the text does not tell.
    pub(super) fn add_any(&mut self, group: Group) {
        self.several |= 1 << group as u32;
    }
}

/// A number for a name, to tell names apart.
pub(super) fn key(text: &str) -> u64 {
    text.bytes().fold(0xcbf2_9ce4_8422_2325, |hash, byte| {
        (hash ^ u64::from(byte)).wrapping_mul(0x0000_0100_0000_01b3)
    })
}
