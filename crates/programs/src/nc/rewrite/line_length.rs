//! Lines that a correction makes longer than the control accepts.
//!
//! Sources: Siemens, 840D sl Programming Manual Fundamentals, "Block length" (512 characters with comment and line
//! end); LinuxCNC reads a line into 255 bytes and rejects one that fills them. Fanuc and Heidenhain state no limit.

use std::collections::HashMap;

use crate::edit::Edits;
use crate::nc::dialect::Dialect;
use crate::nc::task::Task;

/// The longest line in bytes, line end included; `None` if the control states no limit.
fn most(dialect: Dialect) -> Option<usize> {
    match dialect {
        Dialect::Siemens => Some(512),
        Dialect::LinuxCnc => Some(253),
        _ => None,
    }
}

impl Task<'_> {
    /// The motions to refuse because a line becomes too long: the one written there, or, if the line only restates
    /// words, the last of `wanted` before it.
    pub(super) fn motions_on_long_lines(&self, edits: &[Edits], wanted: &HashMap<u32, usize>) -> Vec<u32> {
        let mut out = Vec::new();
        for (file, edits) in edits.iter().enumerate() {
            let Some(most) = most(self.dialects[file]) else { continue };
            for line in edits.grown_lines(self.trees[file].source(), most) {
                let before = |motion: &&u32| {
                    let motion = &self.listing.motions[**motion as usize];
                    motion.place.file as usize == file && (motion.statement.start as usize) < line.end
                };
                out.extend(wanted.keys().filter(before).max());
            }
        }
        out
    }
}
