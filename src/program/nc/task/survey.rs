//! What the whole file sets, and where its jumps go: read once before the blocks are followed.

use std::collections::BTreeSet;

use super::super::dialect::Dialect;
use super::super::expression::literal;
use super::super::machine::{GROUPS, Group};
use super::super::parser::word;
use super::super::syntax::{Belongs, Syntax};
use super::{Lister, code};

impl Lister<'_, '_> {
    /// What the whole file sets, and where its jumps go.
    pub(super) fn survey(&mut self) {
        let mut found: [BTreeSet<u32>; GROUPS as usize] = Default::default();
        let mut jump = false;
        for node in 0..self.tree.nodes.len() as u32 {
            if self.tree.nodes[node as usize].kind != Syntax::Word {
                continue;
            }
            let said = word(self.tree, node);
            let number = match said.belongs {
                Belongs::Literal { sign: None, number } => literal(self.tree.text(number)),
                _ => None,
            };
            let address = said.address();
            if jump {
                // GOTO N100: the block number stands in a word of its own.
                jump = false;
                match (address, number) {
                    (Some(b'N'), Some(number)) => {
                        self.targets.insert(number as u64);
                        continue;
                    }
                    // A label; anything else is computed.
                    (None, _)
                        if said
                            .name
                            .first()
                            .is_some_and(|byte| byte.is_ascii_alphabetic() || *byte == b'_') => {}
                    _ => self.anywhere = true,
                }
            }
            match (address, number) {
                (Some(b'G'), Some(number)) => {
                    let code = code(number);
                    if matches!(code, 920 | 520) {
                        found[Group::Shift as usize].extend([0, 1]);
                    }
                    if let Some((group, value)) = group_of(code, self.dialect) {
                        found[group as usize].insert(value);
                    }
                }
                (Some(b'G'), None) => found.iter_mut().for_each(|found| found.extend([0, 1])),
                (Some(b'M'), Some(number)) => self.changes_tools |= number == 6.0,
                (Some(b'T'), Some(number)) => {
                    found[Group::Tool as usize].insert(number as u32);
                }
                (Some(b'T'), None) => found[Group::Tool as usize].extend([0, 1]),
                (None, number) if said.name.len() >= 4 && said.name[..4].eq_ignore_ascii_case(b"GOTO") => {
                    match number {
                        Some(number) => {
                            self.targets.insert(number as u64);
                        }
                        None if said.belongs == Belongs::Nothing && said.index.is_none() => jump = true,
                        None => self.anywhere = true,
                    }
                }
                (None, _) if said.is("TRAORI") => {
                    found[Group::Tip as usize].insert(1);
                }
                (None, _) if said.is("TRAFOOF") => {
                    found[Group::Tip as usize].insert(0);
                }
                _ => {}
            }
        }
        self.returns();
        for (group, found) in found.iter().enumerate() {
            match found.len() {
                0 => {}
                1 => self.once |= 1 << group,
                _ => self.several |= 1 << group,
            }
        }
    }
}

impl Lister<'_, '_> {
    /// `M99 P100`: goes on at N100.
    fn returns(&mut self) {
        let written = self.tree.source().windows(3).any(|three| three.eq_ignore_ascii_case(b"M99"));
        if self.dialect == Dialect::Heidenhain || !written {
            return;
        }
        for block in self.tree.child_nodes(0) {
            let words: Vec<_> = self
                .tree
                .child_nodes(block)
                .filter(|&node| self.tree.nodes[node as usize].kind == Syntax::Word)
                .map(|node| word(self.tree, node))
                .collect();
            let value = |letter: u8| {
                let found = words.iter().find(|word| word.address() == Some(letter))?;
                self.literal(found)
            };
            if value(b'M') == Some(99.0)
                && let Some(block) = value(b'P')
            {
                self.targets.insert(block as u64);
            }
        }
    }
}

/// The group that a code sets, and to what, for the survey.
fn group_of(code: u32, dialect: Dialect) -> Option<(Group, u32)> {
    Some(match code {
        900 | 910 => (Group::Distance, code),
        200 | 700 | 7000 => (Group::Unit, 20),
        210 | 710 | 7100 => (Group::Unit, 21),
        170 | 180 | 190 => (Group::Plane, code),
        540..=599 => (Group::Frame, code),
        5000..=5999 if dialect == Dialect::Siemens => (Group::Frame, code),
        400..=429 => (Group::Radius, code),
        434 | 435 | 2340 => (Group::Tip, code),
        490 => (Group::Tip, 0),
        680 | 682 | 683 | 684 | 690 | 510 | 511 | 500 | 501 | 150 | 160 => (Group::Transform, code),
        71 | 1070 | 121 | 131 | 1000 | 1010 | 2540 | 2550 if dialect != Dialect::Siemens => {
            (Group::Transform, code)
        }
        _ => return None,
    })
}
