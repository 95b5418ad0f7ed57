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
    /// Assumptions, one sentence each.
    pub notes: Vec<String>,
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
) -> Option<String> {
    let name = &tool.name;
    match with.teaching.stated.tool(tool) {
        Some(frame) if frame.origin == FrameOrigin::Metrology => None,
        Some(_) => Some(match real.moved_mm {
            Some(shift) => format!("tool {name} was taught: re-evaluated, its TCP moves by {shift:.3} mm"),
            None => format!(
                "tool {name} was taught, but its teaching points are not given: taken as exact; {}",
                tool_estimate(commanded, with)
            ),
        }),
        None if built_in(name) => None,
        None => Some(format!(
            "tool {name}: origin not stated, taken as metrology (exact); {}",
            tool_estimate(commanded, with)
        )),
    }
}

/// Assumption about a work object.
fn object_note(
    object: &WorkObject,
    real: &FramePair,
    commanded: &FramePair,
    found: &RealObject,
    with: &ResolveContext<'_>,
) -> Option<String> {
    let name = &object.name;
    let what = if with.teaching.listing.numbered { "work offset" } else { "work object" };
    match with.teaching.stated.object(object) {
        Some(frame) if frame.origin == FrameOrigin::Metrology => None,
        Some(_) if found.taught.is_some() => {
            let shift = (real.object.translation.vector - commanded.object.translation.vector).norm();
            let turn = real.object.rotation.angle_to(&commanded.object.rotation).to_degrees();
            Some(format!("{what} {name} was taught: re-evaluated, it moves by {shift:.3} mm and {turn:.4}°"))
        }
        Some(_) => Some(format!(
            "{what} {name} was taught, but its teaching points are not given: only an absolute placement takes it as exact; {}",
            object_estimate(commanded, with)
        )),
        None if built_in(name) => None,
        None => Some(format!(
            "{what} {name}: origin not stated, taken as metrology (exact {}); {}",
            if commanded.holds_part { "on the flange" } else { "in the robot's base" },
            object_estimate(commanded, with)
        )),
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
    Some(RegisteredFrame { origin_mm: frame.translation.vector, twists })
}

/// Where no typical pose allows an estimate.
const NO_ESTIMATE: &str = "how far it would move had it been taught cannot be estimated here";

/// How far a taught TCP would move: four orientations about a typical pose, TCP fixed under the nominal model. A stationary
/// tool is touched once with the centre of the flange.
fn tool_estimate(commanded: &FramePair, with: &ResolveContext<'_>) -> String {
    let Teaching { nominal, estimated, .. } = with.teaching;
    let typical_at: &Joints = &with.typical_at;
    if commanded.holds_part {
        let flange = |arm: &PreparedModel<'_>| arm.forward(typical_at).translation.vector;
        let shift = (flange(estimated) - flange(nominal)).norm();
        return format!("had it been taught with this arm, its TCP would move by about {shift:.2} mm");
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
        Some(tcp) => {
            let shift = (tcp - commanded.tool.translation.vector).norm();
            format!("had it been taught with this arm, its TCP would move by about {shift:.2} mm")
        }
        None => NO_ESTIMATE.to_owned(),
    }
}

/// How far a taught work object would move: its origin and 100 mm along x and y, touched near a typical pose.
fn object_estimate(commanded: &FramePair, with: &ResolveContext<'_>) -> String {
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
        Some(pose) => {
            let shift = (pose.translation.vector - commanded.object.translation.vector).norm();
            let turn = pose.rotation.angle_to(&commanded.object.rotation).to_degrees();
            format!("had it been taught with this arm, it would move by about {shift:.2} mm and {turn:.3}°")
        }
        None => NO_ESTIMATE.to_owned(),
    }
}
