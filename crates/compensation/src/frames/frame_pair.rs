//! Tool and work object of a motion: as commanded, and as they really are.

use std::cell::LazyCell;

use nalgebra::{Point3, Vector3};

use crate::cell::FrameOrigin;
use crate::frames::taught::{RealObject, RealTool, TaughtFrame, Teaching, taught_frame, taught_tcp};
use truegrind_arm::estimated::{Estimated, RegisteredFrame};
use truegrind_arm::inverse::Inverse;
use truegrind_arm::model::{Joints, PreparedModel};
use truegrind_math::se3::{Pose, difference};
use truegrind_programs::motion::{Tool, ToolValue, WorkObject, WorkObjectValue};

/// The frames between flange and target, for a tool held by the robot and for a stationary tool.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct FramePair {
    /// The tool on the flange; in the world for a stationary tool.
    pub(crate) tool: Pose,
    /// The work object in the base, or on the flange where the robot holds the part.
    pub(crate) object: Pose,
    /// Whether the robot holds the part and the tool is stationary.
    pub(crate) holds_part: bool,
}

impl FramePair {
    /// Flange pose that puts the tool at a target in the work object.
    #[inline]
    pub(crate) fn flange_for(&self, object_from_tool: &Pose) -> Pose {
        if self.holds_part {
            self.tool * (self.object * object_from_tool).inverse()
        } else {
            self.object * object_from_tool * self.tool.inverse()
        }
    }

    /// The target in the work object that corresponds to a flange pose.
    #[inline]
    pub(crate) fn target_of(&self, base_from_flange: &Pose) -> Pose {
        if self.holds_part {
            self.object.inverse() * base_from_flange.inverse() * self.tool
        } else {
            self.object.inverse() * base_from_flange * self.tool
        }
    }

    /// The work object in the base, for a flange pose.
    pub(crate) fn base_from_object(&self, base_from_flange: &Pose) -> Pose {
        if self.holds_part { base_from_flange * self.object } else { self.object }
    }

    /// The tool on the flange, where the robot holds it; otherwise the inverse path through the part.
    pub(crate) fn flange_from_tool(&self, base_from_flange: &Pose) -> Pose {
        if self.holds_part { base_from_flange.inverse() * self.tool } else { self.tool }
    }
}

/// A frame pair as commanded and as real, with the assumptions made.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct ResolvedFrames {
    /// As the controller holds it.
    pub commanded: FramePair,
    /// As it really is, as far as is known.
    pub real: FramePair,
    /// How a taught work object moves with the arm's parameters; absent for any other.
    pub carried: Option<RegisteredFrame>,
    /// Whether the work object was taught with this arm by points that are not given, so that its real place is unknown.
    pub unlocated: bool,
    /// Whether the work object was taught with this arm, by points that are given or not.
    pub taught: bool,
    /// Assumptions.
    pub notes: Vec<FrameNote>,
}

/// An assumption about a tool or work object.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct FrameNote {
    /// What is assumed.
    said: String,
    /// What it would mean had the frame been taught; absent where that is no question.
    taught: Option<WouldMove>,
}

/// How far a frame would move had it been taught with this arm.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) enum WouldMove {
    /// No typical pose allows an estimate.
    Unknown,
    /// Its TCP.
    Tool { mm: f64 },
    /// The whole frame.
    Object { mm: f64, deg: f64 },
}

impl FrameNote {
    fn known(said: String) -> Self {
        Self { said, taught: None }
    }

    /// Whether it is that the frame has no stated origin and was taken as exact.
    pub(crate) fn is_assumed(&self) -> bool {
        self.taught.is_some()
    }

    /// One sentence for each assumption: the pairs of one tool with several work objects have estimates at different places, of which the
    /// largest counts.
    pub(crate) fn sentences<'n>(notes: impl Iterator<Item = &'n FrameNote>) -> Vec<String> {
        let mut merged: Vec<(FrameNote, bool)> = Vec::new();
        for note in notes {
            match merged.iter_mut().find(|(other, _)| other.said == note.said) {
                Some((other, several)) => {
                    *several |= other.taught.is_some_and(|a| note.taught.is_some_and(|b| a.differs(&b)));
                    other.taught = other.taught.zip(note.taught).map(|(a, b)| a.larger(b));
                }
                None => merged.push((note.clone(), false)),
            }
        }
        merged.iter().map(|(note, several)| note.text(*several)).collect()
    }

    /// `several`: whether other places have smaller estimates.
    fn text(&self, several: bool) -> String {
        let about = if several { "up to about" } else { "about" };
        let estimate = match self.taught {
            None => return self.said.clone(),
            Some(WouldMove::Unknown) => "its shift, if it was taught, cannot be estimated here".to_owned(),
            Some(WouldMove::Tool { mm }) => {
                format!("if it was taught with this arm, its TCP is off by {about} {mm:.2} mm")
            }
            Some(WouldMove::Object { mm, deg }) => {
                format!("if it was taught with this arm, it is off by {about} {mm:.2} mm and {deg:.3}°")
            }
        };
        format!("{}; {estimate}", self.said)
    }
}

impl WouldMove {
    fn mm(&self) -> Option<f64> {
        match *self {
            Self::Unknown => None,
            Self::Tool { mm } | Self::Object { mm, .. } => Some(mm),
        }
    }

    /// Whether two estimates print differently.
    fn differs(&self, other: &Self) -> bool {
        self.mm().zip(other.mm()).is_some_and(|(a, b)| (a - b).abs() > 0.005)
    }

    fn larger(self, other: Self) -> Self {
        match (self, other) {
            (Self::Object { mm: a, deg: x }, Self::Object { mm: b, deg: y }) => {
                Self::Object { mm: a.max(b), deg: x.max(y) }
            }
            (a, b) => {
                if b.mm() > a.mm() {
                    b
                } else {
                    a
                }
            }
        }
    }
}

/// Inputs for resolving a frame pair.
pub(crate) struct ResolveContext<'a> {
    pub(crate) teaching: &'a Teaching<'a>,
    pub(crate) knowledge: Option<&'a Estimated>,
    /// The inverse of the nominal arm.
    pub(crate) inverse: &'a Inverse<'a>,
    /// Typical joints, at which the effect of an unknown origin is estimated; a search, which frames of known origin do not need.
    pub(crate) typical_at: LazyCell<Joints, Box<dyn Fn() -> Joints + 'a>>,
}

/// Resolves a frame pair from the program's values and the cell file.
///
/// # Errors
/// A sentence where cell file and program contradict each other.
pub(crate) fn resolve_frames(
    (tool, tool_value): (&Tool, &ToolValue),
    (object, object_value): (&WorkObject, &WorkObjectValue),
    with: &ResolveContext<'_>,
) -> Result<ResolvedFrames, String> {
    let commanded = FramePair {
        tool: tool_value.frame.pose(),
        object: object_value.user_frame.pose() * object_value.object_frame.pose(),
        holds_part: object_value.robhold,
    };
    let teaching = with.teaching;
    let real_tool = teaching.tool(tool, tool_value)?;
    let real_object = teaching.object(object, object_value)?;
    let real = FramePair { tool: real_tool.pose, object: real_object.pose, ..commanded };
    let notes = [
        tool_note(tool, &real_tool, &commanded, with),
        object_note(object, &real, &commanded, &real_object, with),
    ];
    let taught = teaching.stated.object(object).is_some_and(|frame| frame.origin == FrameOrigin::Taught);
    let unlocated = !commanded.holds_part && real_object.taught.is_none() && taught;
    // A frame on the flange moves with the arm: it has no position of its own in the base.
    let moves = real_object.taught.filter(|_| !commanded.holds_part);
    let carried = moves.zip(with.knowledge).and_then(|(t, k)| carried_frame(k, teaching.estimated, &t));
    let notes = notes.into_iter().flatten().collect();
    Ok(ResolvedFrames { commanded, real, carried, unlocated, taught, notes })
}

fn built_in(name: &str) -> bool {
    name.eq_ignore_ascii_case("tool0") || name.eq_ignore_ascii_case("wobj0")
}

/// Assumption about a tool.
fn tool_note(
    tool: &Tool,
    real: &RealTool,
    commanded: &FramePair,
    with: &ResolveContext<'_>,
) -> Option<FrameNote> {
    let name = &tool.name;
    match with.teaching.stated.tool(tool) {
        Some(frame) if frame.origin == FrameOrigin::Metrology => None,
        Some(_) => Some(match real.moved_mm {
            Some(shift) => FrameNote::known(format!(
                "tool {name} was taught: re-evaluated, its TCP moves by {shift:.3} mm"
            )),
            None => FrameNote {
                said: format!("tool {name} was taught, but its teaching points are missing: assumed exact"),
                taught: Some(tool_estimate(commanded, with)),
            },
        }),
        None if built_in(name) => None,
        None => Some(FrameNote {
            said: format!("tool {name}: origin not stated, assumed exact (metrology)"),
            taught: Some(tool_estimate(commanded, with)),
        }),
    }
}

/// Assumption about a work object.
fn object_note(
    object: &WorkObject,
    real: &FramePair,
    commanded: &FramePair,
    found: &RealObject,
    with: &ResolveContext<'_>,
) -> Option<FrameNote> {
    let name = &object.name;
    let what = if with.teaching.listing.numbered { "work offset" } else { "work object" };
    match with.teaching.stated.object(object) {
        Some(frame) if frame.origin == FrameOrigin::Metrology => None,
        Some(_) if found.taught.is_some() => {
            let shift = (real.object.translation.vector - commanded.object.translation.vector).norm();
            let turn = real.object.rotation.angle_to(&commanded.object.rotation).to_degrees();
            Some(FrameNote::known(format!(
                "{what} {name} was taught: re-evaluated, it moves by {shift:.3} mm and {turn:.4}°"
            )))
        }
        Some(_) => Some(FrameNote {
            said: format!(
                "{what} {name} was taught, but its teaching points are missing: its true place is unknown (--placement absolute takes it as exact)"
            ),
            taught: Some(object_estimate(commanded, with)),
        }),
        None if built_in(name) => None,
        None => Some(FrameNote {
            said: format!(
                "{what} {name}: origin not stated, assumed exact {} (metrology)",
                if commanded.holds_part { "on the flange" } else { "in the robot's base" }
            ),
            taught: Some(object_estimate(commanded, with)),
        }),
    }
}

/// How the frame of a taught work object moves with each parameter of the arm.
fn carried_frame(
    knowledge: &Estimated,
    estimated: &PreparedModel<'_>,
    taught: &TaughtFrame,
) -> Option<RegisteredFrame> {
    let TaughtFrame { pointer, joints, points, frame } = taught;
    carried_through(knowledge, estimated, &pointer.real, joints, points, frame)
}

/// How a frame through three points, touched with `tip`, moves with each parameter of the arm: the points' velocities,
/// carried through the construction of the frame by a central difference over ± 1 unit of 1e-4.
pub(crate) fn carried_through(
    knowledge: &Estimated,
    estimated: &PreparedModel<'_>,
    tip: &Vector3<f64>,
    joints: &[Joints; 3],
    points: &[Point3<f64>; 3],
    frame: &Pose,
) -> Option<RegisteredFrame> {
    const STEP: f64 = 1e-4;
    let tip = Pose::translation(tip.x, tip.y, tip.z);
    let jacobians = joints.map(|q| knowledge.position_jacobian(estimated, &q, &tip));
    let twists = (0..knowledge.order.len())
        .map(|k| {
            let moved_by = |step: f64| {
                taught_frame(&std::array::from_fn(|i| {
                    let j = &jacobians[i];
                    points[i] + Vector3::new(j[(0, k)], j[(1, k)], j[(2, k)]) * step
                }))
            };
            Some(difference(&moved_by(-STEP)?, &moved_by(STEP)?) / (2.0 * STEP))
        })
        .collect::<Option<Vec<_>>>()?;
    Some(RegisteredFrame { origin_mm: frame.translation.vector, twists, beyond_share: 1.0 })
}

/// How far a taught TCP would move: four orientations about a typical pose, TCP fixed under the nominal model. A stationary
/// tool is touched once with the centre of the flange.
fn tool_estimate(commanded: &FramePair, with: &ResolveContext<'_>) -> WouldMove {
    let Teaching { nominal, estimated, .. } = with.teaching;
    let typical_at: &Joints = &with.typical_at;
    if commanded.holds_part {
        let flange = |arm: &PreparedModel<'_>| arm.forward(typical_at).translation.vector;
        return WouldMove::Tool { mm: (flange(estimated) - flange(nominal)).norm() };
    }
    let turns = [[0.0, 0.0, 0.0], [0.5, 0.3, 0.0], [-0.5, 0.3, 0.6], [0.0, -0.5, -0.6]];
    let inverse = with.inverse;
    let at = nominal.forward(typical_at) * commanded.tool;
    let teaching: Vec<Joints> = turns
        .iter()
        .filter_map(|w| {
            let turned = at * Pose::new(Vector3::zeros(), Vector3::from(*w));
            inverse.solve_near(&(turned * commanded.tool.inverse()), typical_at).ok().map(|s| s.joints)
        })
        .collect();
    match taught_tcp(estimated, &teaching) {
        Some(tcp) => WouldMove::Tool { mm: (tcp - commanded.tool.translation.vector).norm() },
        None => WouldMove::Unknown,
    }
}

/// How far a taught work object would move: its origin and 100 mm along x and y, touched near a typical pose.
fn object_estimate(commanded: &FramePair, with: &ResolveContext<'_>) -> WouldMove {
    let Teaching { nominal, estimated, .. } = with.teaching;
    let typical_at: &Joints = &with.typical_at;
    let inverse = with.inverse;
    let orientation = commanded.target_of(&nominal.forward(typical_at)).rotation;
    let touched: Vec<Point3<f64>> = [[0.0, 0.0], [100.0, 0.0], [0.0, 100.0]]
        .iter()
        .filter_map(|[x, y]| {
            let target = Pose::from_parts(Vector3::new(*x, *y, 0.0).into(), orientation);
            let joints = inverse.solve_near(&commanded.flange_for(&target), typical_at).ok()?.joints;
            let tip = Point3::from(commanded.tool.translation.vector);
            let flange = estimated.forward(&joints);
            Some(if commanded.holds_part { flange.inverse() * tip } else { flange * tip })
        })
        .collect();
    match <[Point3<f64>; 3]>::try_from(touched).ok().and_then(|p| taught_frame(&p)) {
        Some(pose) => WouldMove::Object {
            mm: (pose.translation.vector - commanded.object.translation.vector).norm(),
            deg: pose.rotation.angle_to(&commanded.object.rotation).to_degrees(),
        },
        None => WouldMove::Unknown,
    }
}
