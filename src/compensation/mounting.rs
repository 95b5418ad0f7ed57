//! Tool and work object of a motion: as the controller holds them, and as they truly are.

use nalgebra::{Point3, Vector3};

use super::cell::{Cell, FrameOrigin, taught_frame, taught_tcp};
use crate::kinematics::estimated::{Carried, Estimated};
use crate::kinematics::model::{Joints, Posed};
use crate::math::se3::{Pose, difference};
use crate::program::motion::{Tool, ToolValue, WorkObject, WorkObjectValue};

/// Frames between flange and target, for either kind of cell.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Mounting {
    /// The tool on the flange, or in the world for a tool that stands.
    pub tool: Pose,
    /// The work object in the base, or on the flange where the robot holds the part.
    pub object: Pose,
    /// Whether the robot holds the part and the tool stands.
    pub holds_part: bool,
}

impl Mounting {
    /// Where the flange must be for a target in the work object.
    pub fn flange_for(&self, object_from_tool: &Pose) -> Pose {
        if self.holds_part {
            self.tool * (self.object * object_from_tool).inverse()
        } else {
            self.object * object_from_tool * self.tool.inverse()
        }
    }

    /// The target in the work object at which a flange stands.
    pub fn target_of(&self, base_from_flange: &Pose) -> Pose {
        if self.holds_part {
            self.object.inverse() * base_from_flange.inverse() * self.tool
        } else {
            self.object.inverse() * base_from_flange * self.tool
        }
    }

    /// The work object in the base, for a flange pose.
    pub fn base_from_object(&self, base_from_flange: &Pose) -> Pose {
        if self.holds_part { base_from_flange * self.object } else { self.object }
    }

    /// The tool on the flange, where the robot holds it; the inverse path through the part otherwise.
    pub fn flange_from_tool(&self, base_from_flange: &Pose) -> Pose {
        if self.holds_part { base_from_flange.inverse() * self.tool } else { self.tool }
    }
}

/// A mounting as told and as true, with what was assumed.
#[derive(Debug, Clone, PartialEq)]
pub struct Mounted {
    /// As the controller holds it.
    pub told: Mounting,
    /// As it is, as far as is known.
    pub real: Mounting,
    /// How a taught work object moves with the arm's parameters; absent for any other.
    pub carried: Option<Carried>,
    /// What was assumed, one sentence each.
    pub notes: Vec<String>,
}

/// Works out a mounting from the program's values and the cell's knowledge.
///
/// `nominal` and `estimated` are the two arms; `usual` is a typical joint vector, at which an unknown origin's effect
/// is estimated.
pub fn mount(
    tool: (&Tool, &ToolValue),
    object: (&WorkObject, &WorkObjectValue),
    cell: &Cell,
    nominal: &Posed<'_>,
    estimated: &Posed<'_>,
    knowledge: Option<&Estimated>,
    usual: &Joints,
) -> Mounted {
    let told = Mounting {
        tool: tool.1.frame.pose(),
        object: object.1.user_frame.pose() * object.1.object_frame.pose(),
        holds_part: object.1.robhold,
    };
    let mut real = told;
    let mut notes = Vec::new();
    let mut carried = None;
    let radians = |deg: &[[f64; 6]]| -> Vec<Joints> {
        deg.iter().map(|q| Joints::from_fn(|i, _| q[i].to_radians())).collect()
    };
    let name = &tool.0.name;
    let built_in = |name: &str| name.eq_ignore_ascii_case("tool0") || name.eq_ignore_ascii_case("wobj0");
    match cell.tool(name) {
        Some(frame) if frame.origin == FrameOrigin::Metrology => {}
        Some(frame) => match taught_tcp(estimated, &radians(&frame.teaching_deg)) {
            Some(tcp) => {
                let shift = (tcp - told.tool.translation.vector).norm();
                real.tool.translation.vector = tcp;
                notes.push(format!("tool {name} was taught: re-evaluated, its TCP moves by {shift:.3} mm"));
            }
            None => notes.push(format!(
                "tool {name} was taught, but its teaching points are not given (or too much alike): taken as it \
                 stands; {}",
                tool_estimate(&told, nominal, estimated, usual)
            )),
        },
        None if built_in(name) => {}
        None => notes.push(format!(
            "tool {name}: origin not stated, taken as metrology (true as it stands); {}",
            tool_estimate(&told, nominal, estimated, usual)
        )),
    }
    let name = &object.0.name;
    match cell.wobj(name) {
        Some(frame) if frame.origin == FrameOrigin::Metrology => {}
        Some(frame) if frame.teaching_deg.len() >= 3 => {
            let teaching = radians(&frame.teaching_deg);
            let tcp = Point3::from(real.tool.translation.vector);
            let points = std::array::from_fn(|i| estimated.forward(&teaching[i]) * tcp);
            match taught_frame(&points) {
                Some(pose) => {
                    // What the program displaces was not taught: it comes on top.
                    let within = object.0.displacement.map_or_else(Pose::identity, |frame| frame.pose());
                    let pose = pose * within;
                    let shift = (pose.translation.vector - told.object.translation.vector).norm();
                    let turn = pose.rotation.angle_to(&told.object.rotation).to_degrees();
                    real.object = pose;
                    carried = knowledge
                        .and_then(|k| carried_frame(k, estimated, &teaching, &points, &pose, &real.tool));
                    notes.push(format!(
                        "work object {name} was taught: re-evaluated, it moves by {shift:.3} mm and {turn:.4}°"
                    ));
                }
                None => notes.push(format!(
                    "work object {name} was taught with three points in line: taken as it stands"
                )),
            }
        }
        Some(_) => notes.push(format!(
            "work object {name} was taught, but its teaching points are not given: taken as it stands; {}",
            object_estimate(&told, nominal, estimated, usual)
        )),
        None if built_in(name) => {}
        None => notes.push(format!(
            "work object {name}: origin not stated, taken as metrology (true as it stands in the robot's base); {}",
            object_estimate(&told, nominal, estimated, usual)
        )),
    }
    Mounted { told, real, carried, notes }
}

/// How a frame through three taught points moves with each parameter of the arm: the points' velocities, carried
/// through the construction of the frame by a central difference over ± 1 unit of 1e-4.
fn carried_frame(
    knowledge: &Estimated,
    estimated: &Posed<'_>,
    teaching: &[Joints],
    points: &[Point3<f64>; 3],
    frame: &Pose,
    tool: &Pose,
) -> Option<Carried> {
    const STEP: f64 = 1e-4;
    let jacobians: Vec<_> =
        teaching.iter().take(3).map(|q| knowledge.position_jacobian(estimated, q, tool)).collect();
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
    Some(Carried { origin_mm: frame.translation.vector, twists })
}

/// How far a taught TCP would move: four orientations about a typical pose, TCP fixed under the nominal model.
fn tool_estimate(told: &Mounting, nominal: &Posed<'_>, estimated: &Posed<'_>, usual: &Joints) -> String {
    let turns = [[0.0, 0.0, 0.0], [0.5, 0.3, 0.0], [-0.5, 0.3, 0.6], [0.0, -0.5, -0.6]];
    let inverse = crate::kinematics::inverse::Inverse::new(nominal.model, &nominal.condition, nominal.model);
    let at = nominal.forward(usual) * told.tool;
    let teaching: Vec<Joints> = turns
        .iter()
        .filter_map(|w| {
            let turned = at * Pose::new(Vector3::zeros(), Vector3::from(*w));
            inverse.solve_near(&(turned * told.tool.inverse()), usual).ok().map(|s| s.joints)
        })
        .collect();
    match taught_tcp(estimated, &teaching) {
        Some(tcp) if teaching.len() >= 3 => {
            let shift = (tcp - told.tool.translation.vector).norm();
            format!("had it been taught with this arm, its TCP would move by about {shift:.2} mm")
        }
        _ => "how far it would move had it been taught cannot be told here".to_owned(),
    }
}

/// How far a taught work object would move: its origin and 100 mm along x and y, touched near a typical pose.
fn object_estimate(told: &Mounting, nominal: &Posed<'_>, estimated: &Posed<'_>, usual: &Joints) -> String {
    let inverse = crate::kinematics::inverse::Inverse::new(nominal.model, &nominal.condition, nominal.model);
    let orientation = (nominal.forward(usual) * told.tool).rotation;
    let touched: Vec<Point3<f64>> = [[0.0, 0.0], [100.0, 0.0], [0.0, 100.0]]
        .iter()
        .filter_map(|[x, y]| {
            let point = told.object * Point3::new(*x, *y, 0.0);
            let pose = Pose::from_parts(point.coords.into(), orientation) * told.tool.inverse();
            let joints = inverse.solve_near(&pose, usual).ok()?.joints;
            Some(estimated.forward(&joints) * Point3::from(told.tool.translation.vector))
        })
        .collect();
    match <[Point3<f64>; 3]>::try_from(touched).ok().and_then(|p| taught_frame(&p)) {
        Some(pose) => {
            let shift = (pose.translation.vector - told.object.translation.vector).norm();
            let turn = pose.rotation.angle_to(&told.object.rotation).to_degrees();
            format!("had it been taught with this arm, it would move by about {shift:.2} mm and {turn:.3}°")
        }
        None => "how far it would move had it been taught cannot be told here".to_owned(),
    }
}
