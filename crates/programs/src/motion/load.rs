//! Loads that a program states: what each motion carries in addition to its tool.

use std::collections::HashMap;

/// A mass.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Load {
    /// Mass (kg).
    pub mass_kg: f64,
    /// Centre of mass (mm), in the frame that its owner states.
    pub centre_mm: [f64; 3],
}

/// What the gripper holds at a motion.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Grip {
    /// Nothing.
    Empty,
    /// This load, its centre in the tool frame (or in the work object that the robot holds).
    Holds(Load),
    /// The program does not determine it.
    Unknown,
}

/// The loads that a program states in addition to those of its tools.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Loads {
    /// Gripped load at each motion; shorter than the listing where nothing is ever gripped.
    pub grips: Vec<Grip>,
    /// `\TLoad` of a motion: tool and gripped load together, centre on the flange.
    pub totals: HashMap<usize, Load>,
}

impl Loads {
    /// The gripped load at a motion.
    pub fn grip(&self, motion: usize) -> Grip {
        self.grips.get(motion).copied().unwrap_or(Grip::Empty)
    }

    /// Number of motions at which the gripped load is unknown.
    pub fn unknown(&self) -> usize {
        self.grips.iter().filter(|grip| **grip == Grip::Unknown).count()
    }
}
