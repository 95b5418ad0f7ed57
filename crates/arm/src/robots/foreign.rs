//! Import of foreign descriptions of arms: URDF files, Denavit–Hartenberg tables, calibration files of Universal Robots.
//!
//! Every format is read as six axes in space at zero joint angles (`axes`), and links are fitted through them. So a table whose
//! nearly parallel axes put a link hundreds of metres away gives links of the arm's own size, independent of the file's frames.
//! The result is compared with the file's own product of transforms before it is returned.

mod axes;
mod chain;
mod common;
mod table;
mod ur;
mod urdf;

use nalgebra::{Matrix6, Vector3};

use super::error::RobotError;
use super::sheet::{Angles, Convention, DataSheet, FlangeSheet, JointSheet, Masses, Mounting, Sources};
use super::{Robot, load, parse};
use crate::condition::Condition;
use crate::joints::Joints;
use crate::limits::SumLimit;
use chain::ForeignArm;
pub use common::ImportOptions;
use common::{foreign_error, zero_if_tiny};
use truegrind_math::se3::{Pose, difference};

/// An imported arm.
#[derive(Debug, Clone, PartialEq)]
pub struct ImportedRobot {
    /// The arm.
    pub robot: Robot,
    /// The kind of file.
    pub kind: Kind,
    /// Summary for comparison with the manual, one sentence each: joints, zero pose, axes, flange, and notes on the file.
    pub summary: Vec<String>,
    /// Meshes that the file names for drawing; none where it names none.
    pub visuals: Vec<Visual>,
}

/// A mesh that a file names for drawing a link. Nothing is computed from it.
#[derive(Debug, Clone, PartialEq)]
pub struct Visual {
    /// The frame to which it is fixed: 0 is the base, i the end of link i.
    pub frame: usize,
    /// Its pose in that frame.
    pub pose: Pose,
    /// Its file, as it is named there.
    pub file: String,
    /// Millimetres for each of its units, along its own axes.
    pub unit_mm: [f64; 3],
}

/// A kind of file.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[non_exhaustive]
pub enum Kind {
    /// Robot file of truegrind.
    Toml,
    /// Unified Robot Description Format.
    Urdf,
    /// A table of link parameters.
    Table,
    /// `calibration.conf` of a Universal Robots controller.
    UrConf,
    /// The kinematics file that ROS drivers take from such a controller.
    UrYaml,
}

impl Kind {
    /// The kind of a file, by its extension.
    pub fn of(name: &str) -> Option<Self> {
        let ending = name.rsplit_once('.')?.1.to_ascii_lowercase();
        match ending.as_str() {
            "toml" => Some(Kind::Toml),
            "urdf" | "xml" | "xacro" => Some(Kind::Urdf),
            "csv" | "tsv" | "txt" => Some(Kind::Table),
            "conf" => Some(Kind::UrConf),
            "yaml" | "yml" => Some(Kind::UrYaml),
            _ => None,
        }
    }

    /// In words.
    pub fn text(self) -> &'static str {
        match self {
            Kind::Toml => "robot file of truegrind",
            Kind::Urdf => "URDF",
            Kind::Table => "table of link parameters",
            Kind::UrConf => "calibration.conf of Universal Robots",
            Kind::UrYaml => "kinematics file of Universal Robots",
        }
    }
}

/// Imports an arm from a file of any known kind; `file` is its name, whose extension determines the kind, and which messages name.
///
/// ```
/// use truegrind_arm::robots::foreign::{ImportOptions, import};
///
/// // Craig's ("modified") table of an arm: twist and length belong to the joint before.
/// let table = "convention,alpha_deg,a_mm,theta_deg,d_mm\n\
///              modified,0,0,0,400\nmodified,-90,0,-90,0\nmodified,0,500,0,0\n\
///              modified,-90,60,0,480\nmodified,90,0,0,0\nmodified,-90,0,0,90\n";
/// let found = import(table, "workshop.csv", &ImportOptions::default())?;
/// let flange = found.robot.model.forward(&nalgebra::Vector6::zeros(), &Default::default());
/// assert!((flange.translation.vector - nalgebra::Vector3::new(570.0, 0.0, 960.0)).norm() < 1e-9);
/// # Ok::<(), truegrind_arm::robots::RobotError>(())
/// ```
///
/// # Errors
/// [`RobotError`], with line, found and expected as far as they are known.
pub fn import(text: &str, file: &str, choice: &ImportOptions) -> Result<ImportedRobot, RobotError> {
    let kind = Kind::of(file).ok_or_else(|| {
        foreign_error(
            file,
            "the extension",
            file.rsplit_once('.').map_or_else(|| "none".to_owned(), |(_, extension)| format!(".{extension}")),
            "that of a robot file: .toml, .urdf, .csv (table of link parameters), .yaml or .conf (Universal Robots)",
            "give a robot file, or rename one that has another extension",
        )
    })?;
    if kind != Kind::Urdf && (choice.base.is_some() || choice.tip.is_some()) {
        let found = format!("a base or a tip for a {}", kind.text());
        return Err(foreign_error(file, "base and tip", found, "links of a URDF", "leave them out"));
    }
    let foreign = match kind {
        Kind::Toml => {
            let robot = parse(text, file)?;
            let summary = summarise(&robot, &[]);
            return Ok(ImportedRobot { robot, kind, summary, visuals: Vec::new() });
        }
        Kind::Urdf => urdf::read(text, file, choice)?,
        Kind::Table => table::read(text, file)?,
        Kind::UrYaml => ur::read_yaml(text, file)?,
        Kind::UrConf => ur::read_conf(text, file, load)?,
    };
    let (robot, notes, visuals) = robot(foreign, file, choice.ground_joint_3)?;
    let summary = summarise(&robot, &notes);
    Ok(ImportedRobot { robot, kind, summary, visuals })
}

/// Builds the robot from a foreign description and compares the two.
fn robot(
    foreign: ForeignArm,
    file: &str,
    ground_joint_3: bool,
) -> Result<(Robot, Vec<String>, Vec<Visual>), RobotError> {
    let fitted = axes::fit_links(&foreign, file)?;
    let visuals = foreign.visuals.iter().map(|shown| Visual {
        frame: shown.joints,
        pose: fitted.frames[shown.joints].inverse() * shown.place,
        file: shown.file.clone(),
        unit_mm: shown.unit_mm,
    });
    let visuals = visuals.collect();
    let mut notes = foreign.notes.clone();
    notes.extend(fitted.turn_note());
    notes.extend(fitted.base_note());
    let mut map = Matrix6::identity();
    map[(0, 0)] = fitted.first_turn;
    if let Some(couplings) = &foreign.joint_map {
        map *= couplings;
    }
    let mut limits_deg = foreign.limits_deg;
    let mut sum = Vec::new();
    if ground_joint_3 {
        // The link's own angle is the angle relative to the ground minus the rotation by joint 2.
        let along = fitted.parallel_2_3(file)?;
        map[(2, 1)] -= along;
        notes.push(
            "joint 3 is measured relative to the ground: the angle of link 3 to link 2 is J3 less the rotation by J2".to_owned(),
        );
        if let Some(limits) = &mut limits_deg {
            sum.push(limit_against_ground(limits, along));
            let name = if along < 0.0 { "J2 + J3" } else { "J3 − J2" };
            notes.push(format!("the file's range of joint 3 is taken as that of {name}"));
        }
    }
    let inside = fitted.base.inverse();
    let gravity = inside.rotation * foreign.gravity;
    let plain = map == Matrix6::identity();
    let place = fitted.base.translation.vector;
    let sheet = DataSheet {
        name: name_of(file),
        maker: foreign.maker.clone(),
        model: foreign.designation.clone(),
        payload_kg: None,
        reach_mm: None,
        repeatability_mm: None,
        dialect: foreign.dialect,
        convention: Convention::StandardDh,
        orientation: None,
        compensates: false,
        link: fitted.links.to_vec(),
        joints: JointSheet {
            angles: Angles::Logged,
            map: (!plain).then(|| std::array::from_fn(|i| std::array::from_fn(|j| map[(i, j)]))),
            min_deg: limits_deg.map(|limits| limits.map(|[low, _]| low)),
            max_deg: limits_deg.map(|limits| limits.map(|[_, high]| high)),
            speed_deg_s: foreign.speed_deg_s,
            sum,
        },
        flange: (fitted.flange != Pose::identity()).then(|| flange_sheet(&fitted.flange)),
        mounting: Mounting {
            gravity: gravity.map(zero_if_tiny).into(),
            plate_mm: (inside.rotation * -place).map(zero_if_tiny).into(),
        },
        masses: masses(&foreign, &fitted),
        sources: Sources {
            links: foreign.source.clone(),
            limits: foreign.limits_deg.map(|_| foreign.source.clone()).unwrap_or_default(),
            masses: foreign.masses.as_ref().map(|_| foreign.source.clone()).unwrap_or_default(),
            payload: String::new(),
        },
        published: Vec::new(),
    };
    let robot = Robot { base_note: fitted.base_note(), ..Robot::new(sheet, file)? };
    check_against_file(&robot, &foreign, &fitted, &map, file)?;
    Ok((robot, notes, visuals))
}

/// The range of joint 3 relative to the ground, as the file states it, as a range of the sum of two joints; `limits_deg` of joint 3 itself become
/// as wide as that sum allows. `along` is 1 or −1, as joints 2 and 3 turn the same way or not.
fn limit_against_ground(limits_deg: &mut [[f64; 2]; 6], along: f64) -> SumLimit {
    let own = limits_deg[2];
    let [low, high] = limits_deg[1].map(|angle| along * angle);
    limits_deg[2] = [own[0] + low.min(high), own[1] + low.max(high)];
    SumLimit {
        factors: [0.0, -along, 1.0, 0.0, 0.0, 0.0],
        min_rad: own[0].to_radians(),
        max_rad: own[1].to_radians(),
    }
}

fn flange_sheet(flange: &Pose) -> FlangeSheet {
    let q = flange.rotation;
    FlangeSheet {
        position_mm: flange.translation.vector.map(zero_if_tiny).into(),
        quaternion_wxyz: [q.w, q.i, q.j, q.k].map(zero_if_tiny),
    }
}

/// Masses of the links, with their centres in the frames of our links.
fn masses(foreign: &ForeignArm, fitted: &axes::FittedLinks) -> Option<Masses> {
    foreign.masses.as_ref().map(|masses| Masses {
        mass_kg: std::array::from_fn(|i| masses[i].mass_kg),
        centre_mm: std::array::from_fn(|i| {
            let centre = fitted.frames[i + 1].inverse() * nalgebra::Point3::from(masses[i].centre_mm);
            centre.coords.map(zero_if_tiny).into()
        }),
    })
}

/// Name of an arm without one: the file name without path separators or points.
fn name_of(file: &str) -> String {
    file.rsplit(['/', '\\']).next().unwrap_or(file).replace('.', "-")
}

/// Tolerance between the robot and the file's own product of transforms (mm, and rad on a metre).
const SAME_MM: f64 = 1e-6;

/// Refuses a robot that differs from its file. The joints of the file are those of the links, before any coupling.
fn check_against_file(
    robot: &Robot,
    foreign: &ForeignArm,
    fitted: &axes::FittedLinks,
    map: &Matrix6<f64>,
    file: &str,
) -> Result<(), RobotError> {
    // Link rotations for the file's joints; the controller's couplings are in the map alone.
    let mut plain = Matrix6::identity();
    plain[(0, 0)] = fitted.first_turn;
    let from_links = map.try_inverse().unwrap_or(plain) * plain;
    for joints in [
        Joints::zeros(),
        Joints::new(0.3, -0.4, 0.5, -0.6, 0.7, -0.8),
        Joints::new(-2.1, 0.9, -1.2, 1.7, -1.1, 2.9),
    ] {
        let ours = fitted.base * robot.model.forward(&(from_links * joints), &Condition::default());
        let theirs = foreign.forward(&joints);
        let (translation, turn) = apart(&ours, &theirs);
        if !(translation.max(1000.0 * turn) <= SAME_MM) {
            return Err(foreign_error(
                file,
                "links",
                format!(
                    "links that miss the file's own transforms by {translation:.2e} mm and {turn:.2e} rad"
                ),
                "the same arm",
                "please report it with the file: this is a defect of truegrind",
            ));
        }
    }
    Ok(())
}

fn apart(a: &Pose, b: &Pose) -> (f64, f64) {
    let off = difference(a, b);
    (off.fixed_rows::<3>(0).norm(), off.fixed_rows::<3>(3).norm())
}

/// Summary of the arm, for comparison with the manual.
fn summarise(robot: &Robot, notes: &[String]) -> Vec<String> {
    let still = Condition::default();
    let ready = robot.model.at_condition(&still);
    let frames = ready.frames(&Joints::zeros());
    let flange = ready.forward(&Joints::zeros());
    // No sign before zero.
    let place = flange.translation.vector.map(|mm| (mm * 1e3).round() / 1e3 + 0.0);
    let reach: f64 = robot.model.links[1..].iter().map(|link| link.a_mm.hypot(link.d_mm)).sum();
    let axes: Vec<String> = (0..6)
        .map(|i| {
            let turn = robot.model.joint_map[(i, i)];
            let axis = Vector3::from(frames.z[i]) * if turn < 0.0 { -1.0 } else { 1.0 };
            format!("J{} {}", i + 1, direction(&axis))
        })
        .collect();
    let map = robot.model.joint_map;
    let coupled: Vec<String> = (0..6)
        .flat_map(|i| (0..6).map(move |j| (i, j)))
        .filter(|&(i, j)| i != j && map[(i, j)] != 0.0)
        .map(|(i, j)| format!("link {} turns with J{} too, by {}", i + 1, j + 1, map[(i, j)]))
        .collect();
    let family = if crate::inverse::Inverse::new(&robot.model, &still, &robot.model).has_branches() {
        "a closed form is known for its inverse"
    } else {
        "no closed form is known for its inverse, which is solved numerically"
    };
    let mut out = vec![
        format!(
            "zero pose: all joints at 0° put the flange at ({:.3}, {:.3}, {:.3}) mm",
            place.x, place.y, place.z
        ),
        format!(
            "flange at zero: its z points along {}, its x along {}",
            direction(&(flange.rotation * Vector3::z())),
            direction(&(flange.rotation * Vector3::x()))
        ),
        format!("axes at zero, about which joints turn counter-clockwise: {}", axes.join(", ")),
        format!("links after axis 1 are {reach:.0} mm long together; {family}"),
    ];
    if !coupled.is_empty() {
        out.push(coupled.join("; "));
    }
    out.push(mounted(&robot.sheet.mounting));
    out.extend(notes.iter().cloned());
    out
}

/// How the arm is mounted, in words.
fn mounted(mounting: &Mounting) -> String {
    let down = Vector3::from(mounting.gravity).normalize();
    let along = direction(&down);
    let how = match along.as_str() {
        "−z" => "the arm stands",
        "+z" => "the arm hangs",
        "+x" | "−x" | "+y" | "−y" => "the arm is on a wall",
        _ => "the arm is tilted",
    };
    // No sign before zero.
    let [x, y, z] = mounting.plate_mm.map(|mm| (mm * 1e3).round() / 1e3 + 0.0);
    let face = match [x, y, z] {
        [0.0, 0.0, 0.0] => "at the origin of the base".to_owned(),
        _ => format!("at ({x:.3}, {y:.3}, {z:.3}) mm in the base"),
    };
    format!("mounting: {how} (gravity points along {along} of the base); its mounting face is {face}")
}

/// A direction in words.
fn direction(v: &Vector3<f64>) -> String {
    for (axis, name) in [(Vector3::x(), "x"), (Vector3::y(), "y"), (Vector3::z(), "z")] {
        let along = v.dot(&axis);
        if along.abs() > 1.0 - 1e-6 {
            return format!("{}{name}", if along < 0.0 { "−" } else { "+" });
        }
    }
    format!("({:.4}, {:.4}, {:.4})", v.x, v.y, v.z)
}
