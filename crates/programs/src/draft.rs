//! A program that does not exist yet, said without its language: what a dialect's writer makes a file of.

use crate::motion::{MotionKind, RobTarget, TargetValue, ToolValue, WorkObjectValue};

/// A program to write.
#[derive(Debug, Clone, PartialEq)]
pub struct Draft {
    /// The name of the module.
    pub name: String,
    /// Lines that say at the top what the program is.
    pub comments: Vec<String>,
    /// The tool; declared in the program unless it is the controller's own (`tool0`).
    pub tool: (String, ToolValue),
    /// The work object; declared in the program unless it is the controller's own (`wobj0`).
    pub work_object: (String, WorkObjectValue),
    /// Whether targets get names (p10, p20, …) that can be taught anew, or stand in the instructions.
    pub named_targets: bool,
    /// Whether the controller shall hold the programmed configuration (ConfL, ConfJ).
    pub monitor_configuration: bool,
    /// The motions.
    pub steps: Vec<Step>,
}

/// One motion.
#[derive(Debug, Clone, PartialEq)]
pub struct Step {
    /// How to go. [`MotionKind::Circular`] needs `via`; [`MotionKind::AbsoluteJoint`] a joint target.
    pub kind: MotionKind,
    /// The end.
    pub to: TargetValue,
    /// The point on the arc.
    pub via: Option<RobTarget>,
    /// Speed of the TCP [mm/s].
    pub speed_mm_s: f64,
    /// Corner zone (mm); `None` stops at the end.
    pub zone_mm: Option<f64>,
    /// A comment line before it.
    pub comment: Option<String>,
    /// Time at rest after it (s).
    pub wait_s: Option<f64>,
}

/// The comment that says of a path which robot it was made for.
pub fn heading(surface: &str, robot: &str, targets: usize) -> String {
    format!("{PATH}{surface}{ROBOT}{robot}, {targets} targets.")
}

/// The robot that a program says it was made for, in the [`heading`] among its first lines.
///
/// ```
/// use truegrind_programs::draft::{heading, robot_of};
///
/// let file = format!("%\nO0001\n({})\nG90 G21\n", heading("blade", "abb-irb-120", 321));
/// assert_eq!(robot_of(file.as_bytes()), Some("abb-irb-120"));
/// assert_eq!(robot_of(b"(a path for lunch, 3 targets.)\n"), None);
/// ```
pub fn robot_of(source: &[u8]) -> Option<&str> {
    const LINES: usize = 20;
    let mut lines =
        source.split(|&byte| byte == b'\n').take(LINES).filter_map(|line| std::str::from_utf8(line).ok());
    lines.find_map(|line| {
        let said = line.trim_start_matches(['!', ';', '(', ' ', '\t']).strip_prefix(PATH)?;
        let (robot, targets) = said.split_once(ROBOT)?.1.rsplit_once(", ")?;
        targets.contains(" targets.").then_some(robot)
    })
}

const PATH: &str = "Path over surface ";
const ROBOT: &str = " for ";
