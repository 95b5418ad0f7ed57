//! Catalogue of robots, and the page of one robot: links, joint ranges, masses, published poses, sources.

use serde_json::{Value, json};

use super::document::{Block, Document, Figure, KeyFigure, PageVerdict};
use super::number::MISSING;
use super::plot::{Axis, PlanPath, PlanView};
use super::status::Status;
use super::table::{Cell, Table};
use truegrind_arm::condition::Condition;
use truegrind_arm::link::LinkModel;
use truegrind_arm::model::Joints;
use truegrind_arm::robots::Robot;
use truegrind_arm::robots::foreign::ImportedRobot;
use truegrind_arm::robots::sheet::{Angles, Dialect, Orientation, Point};
use truegrind_arm::robots::validation;

/// Name, maker, designation, rated load, reach, repeatability and program language of each arm.
pub fn catalogue_table(robots: &[Robot]) -> Table {
    Table::of("Robot arms", robots)
        .text("name", "Name", |robot| robot.sheet.name.as_str())
        .text("maker", "Maker", |robot| words(&robot.sheet.maker))
        .text("model", "Model", |robot| words(&robot.sheet.model))
        .significant("payload_kg", "Payload", "kg", 3, |robot| robot.sheet.payload_kg)
        .number("reach_mm", "Reach", "mm", 0, |robot| robot.sheet.reach_mm)
        .number("repeatability_mm", "Repeatability", "mm", 3, |robot| robot.sheet.repeatability_mm)
        .text("dialect", "Programs", |robot| robot.sheet.dialect.map(dialect))
        .table()
}

/// The links with their nominal parameters in mm and degrees.
pub fn link_table(robot: &Robot) -> Table {
    let hayati = robot.sheet.link.iter().any(|link| link.model == LinkModel::Hayati);
    let mut table = Table::of("Links", robot.sheet.link.iter().enumerate())
        .count("link", "Link", |(index, _)| index + 1)
        .text("model", "Model", |(_, link)| match link.model {
            LinkModel::Dh => "DH",
            LinkModel::Hayati => "Hayati",
        })
        .number("a_mm", "a", "mm", 3, |(_, link)| link.a_mm)
        .number("d_mm", "d", "mm", 3, |(_, link)| link.d_mm)
        .number("alpha_deg", "α", "°", 3, |(_, link)| link.alpha_deg)
        .number("theta_deg", "θ offset", "°", 3, |(_, link)| link.theta_deg)
        .note(
            "T = Rz(θ) Tz(d) Tx(a) Rx(α) from each frame to the next (ltlm-2024 eq. 2); θ is the joint angle plus the offset.",
        );
    if hayati {
        table = table
            .number("beta_deg", "β", "°", 3, |(_, link)| match link.model {
                LinkModel::Dh => None,
                LinkModel::Hayati => Some(link.beta_deg),
            })
            .note(
                "Hayati links end in Ry(β): their next axis is nominally parallel, and d is constant and not identified.",
            );
    }
    table.table()
}

/// Ranges and speeds of the joints in controller angles.
pub fn joint_table(robot: &Robot) -> Table {
    let joints = &robot.sheet.joints;
    let of = |values: Option<[f64; 6]>, joint: &usize| values.map(|values| values[*joint]);
    let mut table = Table::of("Joints", 0..6)
        .count("joint", "Joint", |joint| joint + 1)
        .number("min_deg", "Lowest", "°", 1, |joint| of(joints.min_deg, joint))
        .number("max_deg", "Highest", "°", 1, |joint| of(joints.max_deg, joint))
        .number("speed_deg_s", "Speed", "°/s", 0, |joint| of(joints.speed_deg_s, joint))
        .table();
    match joints.angles {
        Angles::Logged => {
            table
                .notes
                .push("Angles as displayed and logged by the controller, without the offsets θ.".to_owned());
        }
        Angles::Dh => table.notes.push("Logged angles are DH angles, including the offsets θ.".to_owned()),
    }
    for sum in &joints.sum {
        table.notes.push(format!(
            "The sum {} has a range of its own: {:.1}° to {:.1}°.",
            sum_of_joints(&sum.factors),
            sum.min_rad.to_degrees(),
            sum.max_rad.to_degrees()
        ));
    }
    for (joint, sum) in couplings(joints.map) {
        table.notes.push(format!("The rotation of joint {joint} is {sum} in controller angles."));
    }
    table
}

/// Masses and centres of mass; `None` if none are published.
pub fn mass_table(robot: &Robot) -> Option<Table> {
    let masses = robot.sheet.masses.as_ref()?;
    let links = masses.mass_kg.iter().zip(&masses.centre_mm).enumerate();
    let table = Table::of("Masses", links)
        .count("link", "Link", |(link, _)| link + 1)
        .number("mass_kg", "Mass", "kg", 2, |(_, (mass, _))| **mass)
        .number("centre_x_mm", "centre x", "mm", 1, |(_, (_, centre))| centre[0])
        .number("centre_y_mm", "centre y", "mm", 1, |(_, (_, centre))| centre[1])
        .number("centre_z_mm", "centre z", "mm", 1, |(_, (_, centre))| centre[2])
        .note("Centres of mass in the frame at the end of each link.");
    Some(table.table())
}

/// Published poses, and the error of the links at them.
pub fn published_table(robot: &Robot) -> Table {
    let poses = robot.sheet.published.iter();
    Table::of("Published poses", poses.map(|pose| (pose, validation::deviation(pose, &robot.model))))
        .text("what", "Pose", |(pose, _)| pose.what.as_str())
        .text("joints_deg", "Joints [°]", |(pose, _)| list(&pose.joints_deg))
        .text("point", "Point", |(pose, _)| match pose.point {
            Point::Flange => "flange",
            Point::WristCentre => "wrist centre",
        })
        .text("published_mm", "Published [mm]", |(pose, _)| match (pose.position_mm, pose.radius_mm) {
            (Some(position), _) => Some(list(&position)),
            (None, radius) => radius.map(|radius| format!("{radius} from axis 1")),
        })
        .number("miss_mm", "Error", "mm", 3, |(_, (miss, _))| *miss)
        .number("tolerance_mm", "Tolerance", "mm", 3, |(pose, _)| pose.tolerance_mm)
        .number("turn_deg", "Rotation error", "°", 4, |(_, (_, turn))| turn.map(f64::to_degrees))
        .text("source", "Source", |(pose, _)| pose.source.as_str())
        .note("Tolerance: rounding of the published numbers.")
        .table()
}

/// Sources of the numbers.
pub fn source_table(robot: &Robot) -> Table {
    let sources = &robot.sheet.sources;
    let stated = [
        ("links and joint map", &sources.links),
        ("ranges and speeds", &sources.limits),
        ("masses", &sources.masses),
        ("payload, reach, repeatability", &sources.payload),
    ];
    Table::of("Sources", stated)
        .text("numbers", "Numbers", |(numbers, _)| *numbers)
        .text("source", "Source", |(_, source)| words(source))
        .table()
}

/// The page of one robot.
pub fn document(robot: &Robot) -> Document {
    let sheet = &robot.sheet;
    let mut page = Document::new(sheet.name.clone());
    page.subtitle = [sheet.maker.as_str(), sheet.model.as_str()]
        .into_iter()
        .filter(|part| !part.is_empty())
        .collect::<Vec<_>>()
        .join(" ");
    page.blocks.extend(reservations(robot));
    let figure =
        |label: &str, value: Option<f64>, decimals, unit: &str| KeyFigure::new(label, value, decimals, unit);
    let payload = KeyFigure {
        precision: super::number::Precision::Significant(3),
        ..figure("Payload", sheet.payload_kg, 0, "kg")
    };
    page.push(vec![
        payload,
        figure("Reach", sheet.reach_mm, 0, "mm"),
        figure("Repeatability RP", sheet.repeatability_mm, 3, "mm").note("not the absolute accuracy"),
        KeyFigure::new("Programs", sheet.dialect.map(dialect), 0, "")
            .note(sheet.orientation().map_or("", orientation)),
    ]);
    if sheet.compensates {
        page.paragraph(
            "The controller already compensates with identified parameters, so programs for this robot are not corrected.",
        );
    }
    page.heading(2, "Links");
    page.push(untitled(link_table(robot)));
    if let Some(flange) = &sheet.flange {
        page.paragraph(format!(
            "Flange in the last link frame: position ({}) mm, quaternion ({}), w first.",
            list(&flange.position_mm.map(snap_to_zero)),
            list(&flange.quaternion_wxyz.map(snap_to_zero))
        ));
    }
    page.heading(2, "Joints");
    page.push(untitled(joint_table(robot)));
    page.heading(2, "Mounting and masses");
    page.paragraph(format!(
        "Direction of gravity in the base frame: ({}); mounting face at ({}) mm.",
        list(&sheet.mounting.gravity),
        list(&sheet.mounting.plate_mm)
    ));
    match mass_table(robot) {
        Some(table) => page.push(untitled(table)),
        None => page.paragraph("No masses are stated: deflections are identified for the load of the measurement and follow no other."),
    }
    page.heading(2, "Published poses");
    push_published(&mut page, robot);
    page.heading(2, "Sources");
    page.push(untitled(source_table(robot)));
    page
}

/// What is not sure about a robot file.
fn reservations(robot: &Robot) -> Option<Block> {
    (!robot.warnings.is_empty()).then(|| {
        PageVerdict::new(
            Status::Warning,
            "The robot file can be used with reservations",
            robot.warnings.iter().cloned(),
        )
        .into()
    })
}

/// The published poses: a table, and their descriptions as a list.
fn push_published(page: &mut Document, robot: &Robot) {
    let sheet = &robot.sheet;
    if sheet.published.is_empty() {
        page.paragraph("None are stated, so the links are not verified.");
    } else {
        // Long texts are easier to read in a list.
        let mut table = untitled(published_table(robot));
        for key in ["source", "joints_deg", "point"] {
            if let Some(index) = table.column_index(key) {
                table.remove_column(index);
            }
        }
        page.push(table);
        page.push(Block::List(
            sheet
                .published
                .iter()
                .map(|pose| format!("{}: joints ({})°; {}", pose.what, list(&pose.joints_deg), pose.source))
                .collect(),
        ));
    }
}

/// Interpretation of a robot file, to be compared with the manual before a measurement.
pub fn understood(found: &ImportedRobot) -> Document {
    let mut page = Document::new(found.robot.sheet.name.clone());
    page.subtitle = format!("interpretation of the {}", found.kind.text());
    page.blocks.extend(reservations(&found.robot));
    page.push(Block::List(found.summary.clone()));
    page.paragraph("Compare zero pose and axes with the manual: wrong zeros are the most common mistake.");
    page
}

/// [`understood`] with a plot of the zero pose and the page of the robot.
pub fn checked(found: &ImportedRobot) -> Document {
    let mut page = understood(found);
    page.push(Block::Figure(zero_pose(&found.robot)));
    let whole = document(&found.robot);
    // The reservations are on top already.
    page.blocks.extend(whole.blocks.into_iter().filter(|block| !matches!(block, Block::Verdict(_))));
    page
}

/// The arm with all joints at 0° as lines between the joints, in side and front view.
fn zero_pose(robot: &Robot) -> Figure {
    let ready = robot.model.at_condition(&Condition::default());
    let frames = ready.frames(&Joints::zeros());
    let flange = ready.forward(&Joints::zeros());
    let tip = flange.translation.vector;
    // A short line along the z axis of the flange shows its direction.
    let ahead = tip + flange.rotation * nalgebra::Vector3::z() * 60.0;
    let mut stops: Vec<[f64; 3]> = frames.origin.to_vec();
    stops.extend([tip, ahead].map(<[f64; 3]>::from));
    let seen = |name: &str, across: usize| PlanPath {
        name: name.to_owned(),
        points: stops.iter().map(|at| [at[across], at[2]]).collect(),
        values: (0..stops.len()).map(|k| k.min(6) as f64).collect(),
    };
    let view = PlanView {
        title: "All joints at 0°".to_owned(),
        x: Axis::new("x, y", "mm"),
        y: Axis::new("z", "mm"),
        value: Axis::new("link", ""),
        paths: vec![seen("from the side: x and z", 0), seen("from the front: y and z", 1)],
        ..PlanView::default()
    };
    Figure::new(
        view.svg(),
        "Lines between the joint frames with all joints at 0°, and 60 mm along the z axis of the flange. Compare with the manual.",
    )
}

/// JSON of a robot with the errors at its published poses, schema `truegrind.robot/1`.
pub fn json(robot: &Robot) -> Value {
    let misses: Vec<Value> = robot
        .sheet
        .published
        .iter()
        .map(|pose| {
            let (miss, turn) = validation::deviation(pose, &robot.model);
            json!({ "what": pose.what, "miss_mm": miss, "turn_deg": turn.map(f64::to_degrees) })
        })
        .collect();
    json!({
        "schema": "truegrind.robot/1",
        "sheet": robot.sheet,
        "published_misses": misses,
        "warnings": robot.warnings,
    })
}

/// The catalogue as JSON, an entry for each row of its table.
pub fn catalogue_json(robots: &[Robot]) -> Value {
    let entries: Vec<Value> = robots
        .iter()
        .map(|robot| {
            let sheet = &robot.sheet;
            json!({
                "name": sheet.name,
                "maker": sheet.maker,
                "model": sheet.model,
                "payload_kg": sheet.payload_kg,
                "reach_mm": sheet.reach_mm,
                "repeatability_mm": sheet.repeatability_mm,
                "programs": sheet.dialect.map(dialect),
            })
        })
        .collect();
    json!({ "schema": "truegrind.robots/1", "robots": entries })
}

/// What was understood of a robot file, beside the robot itself.
pub fn checked_json(found: &ImportedRobot) -> Value {
    let mut out = json(&found.robot);
    out["understood"] = json!(found.summary);
    out
}

/// A table without its title, for use below a heading.
fn untitled(table: Table) -> Table {
    Table { title: String::new(), ..table }
}

fn words(text: &str) -> Cell {
    if text.is_empty() { Cell::Missing } else { text.into() }
}

/// Shows rounding residue as zero.
fn snap_to_zero(value: f64) -> f64 {
    if value.abs() < 1e-9 { 0.0 } else { value }
}

fn list(values: &[f64]) -> String {
    // Avoids −0.
    let shown: Vec<String> = values.iter().map(|value| format!("{}", value + 0.0)).collect();
    if shown.is_empty() { MISSING.to_owned() } else { shown.join(", ") }
}

/// The program language of a maker's controllers.
pub fn dialect(dialect: Dialect) -> &'static str {
    match dialect {
        Dialect::Rapid => "RAPID",
        Dialect::Krl => "KRL",
        Dialect::Fanuc => "FANUC TP",
        Dialect::Urscript => "URScript",
        Dialect::Val3 => "VAL 3",
        Dialect::Inform => "INFORM",
        Dialect::Hsr => "HSR",
    }
}

fn orientation(orientation: Orientation) -> &'static str {
    match orientation {
        Orientation::Quaternion => "orientation as quaternion",
        Orientation::Abc => "orientation as A, B, C",
        Orientation::Wpr => "orientation as W, P, R",
        Orientation::RotationVector => "orientation as rotation vector",
        Orientation::Rxyz => "orientation as Rx, Ry, Rz",
    }
}

/// Joints whose rotation is not their own angle alone: number and sum, such as `q3 + q2`.
fn couplings(map: Option<[[f64; 6]; 6]>) -> Vec<(usize, String)> {
    let Some(map) = map else { return Vec::new() };
    map.iter()
        .enumerate()
        .filter(|(joint, row)| (0..6).any(|k| row[k] != f64::from(u8::from(k == *joint))))
        .map(|(joint, row)| (joint + 1, sum_of_joints(row)))
        .collect()
}

/// A sum of joints in words, such as `q2 + q3`.
fn sum_of_joints(factors: &[f64; 6]) -> String {
    let mut sum = String::new();
    for (k, factor) in factors.iter().enumerate().filter(|(_, factor)| **factor != 0.0) {
        let sign = if *factor < 0.0 {
            "−"
        } else if sum.is_empty() {
            ""
        } else {
            "+"
        };
        let gap = if sum.is_empty() { "" } else { " " };
        let size = if factor.abs() == 1.0 { String::new() } else { format!("{} · ", factor.abs()) };
        sum.push_str(&format!("{gap}{sign}{gap}{size}q{}", k + 1));
    }
    sum
}
