//! The measurement program: approach, pose, wait and comment for each row.
//!
//! Targets are joint configurations, so they do not depend on the controller's nominal arm, on a tool or a work object.

use super::schedule::{FIRST_ROW, Row};
use super::{MeasurementSetup, Plan, rows};
use truegrind_arm::condition::Condition;
use truegrind_arm::model::Joints;
use truegrind_calibration::measurement::dataset::{Reading, Sensor};
use truegrind_math::option_f64::OptionF64;
use truegrind_programs::draft::{Draft, Step};
use truegrind_programs::motion::{Frame, JointTarget, MotionKind, TargetValue, ToolValue, WorkObjectValue};

/// Settings of the program.
#[derive(Debug, Clone, PartialEq)]
pub struct ProgramSettings {
    /// Name of the module.
    pub name: String,
    /// Name of the robot, for the comments.
    pub robot: String,
    /// Speed between poses [mm/s].
    pub travel_mm_s: f64,
    /// Speed of the approach [mm/s].
    pub approach_mm_s: f64,
    /// Time at rest before the reading (s).
    pub settle_s: f64,
}

impl Default for ProgramSettings {
    fn default() -> Self {
        Self {
            name: "Measure".to_owned(),
            robot: String::new(),
            travel_mm_s: 200.0,
            approach_mm_s: 20.0,
            settle_s: 2.0,
        }
    }
}

/// The program of a plan.
pub fn draft(plan: &Plan, setup: &MeasurementSetup<'_>, drive: &ProgramSettings) -> Draft {
    let target = |joints: &Joints| {
        TargetValue::Joint(JointTarget {
            robot_deg: std::array::from_fn(|i| joints[i].to_degrees()),
            external: [OptionF64::NONE; 6],
        })
    };
    let step = |joints: &Joints, speed_mm_s: f64, comment: Option<String>, wait_s: Option<f64>| Step {
        kind: MotionKind::AbsoluteJoint,
        to: target(joints),
        via: None,
        speed_mm_s,
        zone_mm: None,
        comment,
        wait_s,
    };
    let mut steps = Vec::with_capacity(2 * plan.rows.len());
    for (number, row) in (FIRST_ROW..).zip(&plan.rows) {
        let said = comment(plan, setup, row, number);
        for stop in &row.waypoints {
            steps.push(step(stop, drive.travel_mm_s, Some("on the way, to keep clear".to_owned()), None));
        }
        steps.push(step(&row.approach_from, drive.travel_mm_s, Some(said), None));
        steps.push(step(&plan.poses[row.pose].joints, drive.approach_mm_s, None, Some(drive.settle_s)));
    }
    Draft {
        name: drive.name.clone(),
        comments: vec![
            format!(
                "{} rows at {} poses of {}, to be measured.",
                plan.rows.len(),
                plan.poses.len(),
                drive.robot
            ),
            format!("Checked: joint limits, singularities{}; {}.", beside_links(plan, setup), checked(plan)),
            format!("Not checked: {}.", unchecked(plan, setup.sensor)),
            "Run it slowly first. Take one reading at each WaitTime, in this order; rows are numbered as in a spreadsheet with a header."
                .to_owned(),
        ],
        tool: (
            "tool0".to_owned(),
            ToolValue {
                robhold: true,
                frame: Frame::IDENTITY,
                mass_kg: 0.001,
                centre_of_gravity_mm: [0.0; 3],
            },
        ),
        work_object: (
            "wobj0".to_owned(),
            WorkObjectValue {
                robhold: false,
                fixed: true,
                mechanical_unit: String::new(),
                user_frame: Frame::IDENTITY,
                object_frame: Frame::IDENTITY,
            },
        ),
        start_deg: None,
        named_targets: false,
        monitor_configuration: false,
        steps,
    }
}

fn comment(plan: &Plan, setup: &MeasurementSetup<'_>, row: &Row, number: usize) -> String {
    let sides: String = row.approach.iter().map(|side| if *side > 0 { '+' } else { '-' }).collect();
    let mut text = format!("row {number}: pose {} ({}), from {sides}", row.pose + 1, row.purpose.label());
    if let Some(Reading::Cable(length)) = reading(plan, setup, row) {
        text.push_str(&format!(", cable about {length:.1} mm"));
    }
    if row.cable_unclear {
        text.push_str("; on the way here the cable leaves its range or nears a link: unhook it");
    }
    text
}

/// What nobody has checked.
pub fn unchecked(plan: &Plan, sensor: Sensor) -> String {
    let seen = match sensor {
        Sensor::Cable => "",
        _ if plan.clearance_mm.is_some() => "whether the target faces the sensor, ",
        _ => {
            "the line of sight and whether the target faces the sensor (where the sensor stands was not stated: --sensor-frame), "
        }
    };
    format!("{seen}the way to the first pose, and anything else in the cell")
}

/// Description of the checked obstacles.
pub fn checked(plan: &Plan) -> String {
    let space = &plan.space;
    let boxes = match space.boxes_mm.len() {
        0 => String::new(),
        1 => "out of the box".to_owned(),
        count => format!("out of the {count} boxes"),
    };
    let floor = space.floor_mm.map_or(String::new(), |floor| format!("above z = {floor} mm"));
    let itself = match space.radius_mm > 0.0 {
        true => "off the arm's own column, upper arm and forearm".to_owned(),
        false => String::new(),
    };
    let parts: Vec<String> = [floor, boxes, itself].into_iter().filter(|part| !part.is_empty()).collect();
    let stay = match parts.as_slice() {
        [] => return "not where the arm is in the cell".to_owned(),
        [one] => one.clone(),
        [first @ .., last] => format!("{} and {last}", first.join(", ")),
    };
    let stops: usize = plan.rows.iter().map(|row| row.waypoints.len()).sum();
    let stop_note = match stops {
        0 => String::new(),
        1 => ", with 1 stop on the way".to_owned(),
        stops => format!(", with {stops} stops on the way"),
    };
    format!(
        "links (as capsules of {:.0} mm radius along the lines between the joints, from the forearm on half of it against the arm itself; no \
         covers, cables or hoses) and target stay {stay} at every pose and on every way between them{stop_note}",
        space.radius_mm
    )
}

/// What was checked between the links and the sensor.
fn beside_links(plan: &Plan, setup: &MeasurementSetup<'_>) -> &'static str {
    match (setup.sensor, plan.clearance_mm) {
        (Sensor::Cable, _) => ", cable",
        (_, Some(_)) => ", line of sight past the links",
        (_, None) => "",
    }
}

/// Predicted reading with the nominal arm.
pub fn reading(plan: &Plan, setup: &MeasurementSetup<'_>, row: &Row) -> Option<Reading> {
    let pose = &plan.poses[row.pose];
    let flange = setup.nominal.forward(&pose.joints, &Condition::default());
    rows::rig(setup).predict(&flange, pose.anchor)
}
