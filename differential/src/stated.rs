//! What the report on a corrected program says that it leaves: the most that may be found, and no more.

use crate::arm::Arm;
use crate::under_test::Row;

/// The model of the test is known to this (mm); a standard deviation beyond it comes from play.
const MODEL_SIGMA_MM: f64 = 5e-9;

/// Joints of which the side is not known are in the standard deviation with half of their play, as independent displacements.
/// All six at their worst together are no more than this times as far.
const ALL_TOGETHER: f64 = 2.449_49;

/// No point of these arms is farther from an axis (mm).
const LEVER_MM: f64 = 3000.0;

/// What a motion may be off by, as its row says.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Stated {
    /// mm at the tip.
    pub mm: f64,
    /// Turn of the tool (rad).
    pub rad: f64,
}

impl Stated {
    /// Of the end of a motion, or of a point that is `passed` on its way.
    pub fn of(row: Option<&Row>, arm: &Arm, passed: bool) -> Self {
        let Some(row) = row else { return Self::default() };
        let open_mm = row.sigma_mm.filter(|sigma| *sigma > MODEL_SIGMA_MM).unwrap_or(0.0);
        let half_plays: f64 = arm.play.iter().map(|play| 0.5 * play).sum();
        let play = half_plays != 0.0;
        let mut out = Self { mm: ALL_TOGETHER * open_mm, rad: if open_mm > 0.0 { half_plays } else { 0.0 } };
        // The remainder of the end, and what the path before it is off by.
        out.mm += row.after_mm.unwrap_or(0.0);
        if passed && play {
            // Where the path is not checked, as the report says then, what all plays do together.
            out.mm += row.bend_mm.unwrap_or(2.0 * half_plays * LEVER_MM);
            out.rad = 2.0 * half_plays;
        }
        out
    }

    /// Of a point at which the tool is turned as the way turns it, not as is told there: the path is right to what is said of it, and
    /// nothing is said where it begins under another tool or work object.
    pub fn of_the_way(mut self, row: Option<&Row>) -> Self {
        self.mm += row.map_or(0.0, |row| row.bend_mm.unwrap_or(f64::INFINITY));
        self.rad = std::f64::consts::PI;
        self
    }
}
