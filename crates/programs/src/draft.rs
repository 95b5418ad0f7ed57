//! New programs, independent of the language, for the writers of the dialects.

use crate::motion::{MotionKind, RobTarget, TargetValue, ToolValue, WorkObjectValue};

/// A program to write.
#[derive(Debug, Clone, PartialEq)]
pub struct Draft {
    /// The name of the module.
    pub name: String,
    /// Comment lines at the top.
    pub comments: Vec<String>,
    /// The tool; declared in the program unless it is the controller's own (`tool0`).
    pub tool: (String, ToolValue),
    /// The work object; declared in the program unless it is the controller's own (`wobj0`).
    pub work_object: (String, WorkObjectValue),
    /// Whether targets are named (p10, p20, …), so that they can be taught, or inline in the instructions.
    pub named_targets: bool,
    /// Whether the controller monitors the programmed configuration (ConfL, ConfJ).
    pub monitor_configuration: bool,
    /// The joints at the end of the first motion (°), for languages that state no configuration.
    pub start_deg: Option<[f64; 6]>,
    /// The motions.
    pub steps: Vec<Step>,
}

/// One motion.
#[derive(Debug, Clone, PartialEq)]
pub struct Step {
    /// The kind of motion. [`MotionKind::Circular`] needs `via`; [`MotionKind::AbsoluteJoint`] a joint target.
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
    /// Dwell after it (s).
    pub wait_s: Option<f64>,
}

/// The comment that states the surface and the robot of a generated path.
pub fn heading(surface: &str, robot: &str, targets: usize) -> String {
    format!("{PATH}{surface}{ROBOT}{robot}, {targets} targets.")
}

/// The robot that a program was generated for, by the [`heading`] among its first lines.
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
        let heading = line.trim_start_matches(['!', ';', '(', ' ', '\t']).strip_prefix(PATH)?;
        let (robot, targets) = heading.split_once(ROBOT)?.1.rsplit_once(", ")?;
        targets.contains(" targets.").then_some(robot)
    })
}

const PATH: &str = "Path over surface ";
const ROBOT: &str = " for ";
