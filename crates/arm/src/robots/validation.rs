//! Checks of a data sheet before it becomes a model.
//!
//! Frequent faults have their own messages: radians for degrees, metres for millimetres, a table of another arm (detected by the
//! file's own published poses), plain DH on parallel axes (allowed, with a warning: d cannot be identified there, rls-2025).

use nalgebra::{Matrix6, Vector6};

use super::error::RobotError;
use super::sheet::{DataSheet, LinkSheet, Point, Published, unit_quaternion};
use crate::bounds::{
    self, Bound, COUPLING, DIRECTION, InvalidValue, JOINT_DEG, LENGTH_MM, MASS_KG, POSITION_MM, SPEED_DEG_S,
};
use crate::link::LinkModel;
use crate::model::Model;

/// Below this sine of the twist two axes count as parallel: 0.5°.
const PARALLEL: f64 = 0.0087;

/// An invalid value, before file and robot are known.
#[derive(Debug)]
pub(super) struct Fault {
    key: String,
    found: String,
    expected: &'static str,
    remedy: &'static str,
}

impl Fault {
    fn new(
        key: impl Into<String>,
        found: impl ToString,
        expected: &'static str,
        remedy: &'static str,
    ) -> Self {
        Self { key: key.into(), found: found.to_string(), expected, remedy }
    }

    fn of_number(invalid: InvalidValue, remedy: &'static str) -> Self {
        Self::new(invalid.key, invalid.found, invalid.expected, remedy)
    }

    pub(super) fn of(self, file: &str, robot: &str) -> RobotError {
        RobotError::Invalid {
            file: file.into(),
            robot: robot.into(),
            key: self.key.into(),
            found: self.found.into(),
            expected: self.expected,
            remedy: self.remedy,
        }
    }
}

pub(super) fn link_count(found: usize) -> Fault {
    Fault::new(
        "link",
        format!("{found} links"),
        "six [[robot.link]]",
        "truegrind supports arms with six rotary axes",
    )
}

/// Checks all but the published poses; returns the warnings.
pub(super) fn check(sheet: &DataSheet) -> Result<Vec<String>, Fault> {
    if sheet.name.trim().is_empty() {
        return Err(Fault::new("name", "nothing", "a name", "give the arm a name"));
    }
    if sheet.link.len() != 6 {
        return Err(link_count(sheet.link.len()));
    }
    bounded(sheet).map_err(|invalid| Fault::of_number(invalid, "correct the number"))?;
    performance(sheet)
        .map_err(|invalid| Fault::of_number(invalid, "leave the key out where it is not known"))?;
    units(sheet)?;
    links(&sheet.link)?;
    joints(sheet)?;
    mounting(sheet)?;
    Ok(warnings(sheet))
}

/// Every number must be finite and within its bounds.
fn bounded(sheet: &DataSheet) -> Result<(), InvalidValue> {
    for (i, link) in sheet.link.iter().enumerate() {
        bounds::link(i, [link.a_mm, link.d_mm], [link.alpha_deg, link.theta_deg, link.beta_deg])?;
    }
    let joints = &sheet.joints;
    JOINT_DEG.check_all("joints.min_deg", joints.min_deg.iter().flatten())?;
    JOINT_DEG.check_all("joints.max_deg", joints.max_deg.iter().flatten())?;
    COUPLING.check_all("joints.map", joints.map.iter().flatten().flatten())?;
    joints.sum.iter().try_for_each(|sum| sum.check("joints.sum"))?;
    DIRECTION.check_all("mounting.gravity", &sheet.mounting.gravity)?;
    LENGTH_MM.check_all("mounting.plate_mm", &sheet.mounting.plate_mm)?;
    if let Some(masses) = &sheet.masses {
        LENGTH_MM.check_all("masses.centre_mm", masses.centre_mm.as_flattened())?;
    }
    if let Some(flange) = &sheet.flange {
        LENGTH_MM.check_all("flange.position_mm", &flange.position_mm)?;
        DIRECTION.check_all("flange.quaternion_wxyz", &flange.quaternion_wxyz)?;
    }
    for pose in &sheet.published {
        JOINT_DEG.check_all("published.joints_deg", &pose.joints_deg)?;
        POSITION_MM.check_all("published.position_mm", pose.position_mm.iter().flatten())?;
        POSITION_MM.check_all("published.radius_mm", &pose.radius_mm)?;
        DIRECTION.check_all("published.quaternion_wxyz", pose.quaternion_wxyz.iter().flatten())?;
        POSE_TOLERANCE_MM.check("published.tolerance_mm", pose.tolerance_mm)?;
    }
    Ok(())
}

/// Optional performance figures must be above 0.
fn performance(sheet: &DataSheet) -> Result<(), InvalidValue> {
    for (key, bound, value) in [
        ("payload_kg", LOAD_KG, sheet.payload_kg),
        ("reach_mm", REACH_MM, sheet.reach_mm),
        ("repeatability_mm", TOLERANCE_MM, sheet.repeatability_mm),
    ] {
        bound.check_all(key, &value)?;
    }
    SPEED_DEG_S.check_all("joints.speed_deg_s", sheet.joints.speed_deg_s.iter().flatten())?;
    MASS_KG.check_all("masses.mass_kg", sheet.masses.iter().flat_map(|masses| &masses.mass_kg))
}

const LOAD_KG: Bound = Bound::new(f64::MIN_POSITIVE, 1e4, "more than 0, up to 10,000 kg");
const REACH_MM: Bound = Bound::new(f64::MIN_POSITIVE, 2e4, "more than 0, up to 20,000 mm");
const POSE_TOLERANCE_MM: Bound = Bound::new(0.0, 100.0, "a length from 0 to 100 mm");
const TOLERANCE_MM: Bound = Bound::new(f64::MIN_POSITIVE, 100.0, "more than 0, up to 100 mm");

/// Radians for degrees, metres for millimetres.
fn units(sheet: &DataSheet) -> Result<(), Fault> {
    use std::f64::consts::{FRAC_PI_2, PI};
    let quarter = |angle: f64| angle != 0.0 && ((angle / FRAC_PI_2).round() * FRAC_PI_2 - angle).abs() < 0.01;
    let twists: Vec<f64> = sheet.link.iter().map(|link| link.alpha_deg).collect();
    if twists.iter().all(|&a| a.abs() < PI + 0.01) && twists.iter().any(|&a| quarter(a)) {
        return Err(Fault::new(
            "link alpha_deg",
            numbers(&twists),
            "degrees",
            "this looks like radians: multiply by 57.29578",
        ));
    }
    let lengths: Vec<f64> = sheet.link.iter().flat_map(|link| [link.a_mm, link.d_mm]).collect();
    if lengths.iter().all(|length| length.abs() < 5.0) {
        return Err(Fault::new(
            "link a_mm and d_mm",
            numbers(&lengths),
            "millimetres",
            "this looks like metres: multiply by 1000",
        ));
    }
    for (key, values) in
        [("joints.min_deg", &sheet.joints.min_deg), ("joints.max_deg", &sheet.joints.max_deg)]
    {
        if let Some(values) = values
            && values.iter().all(|v| v.abs() < 8.0)
        {
            return Err(Fault::new(
                key,
                numbers(values),
                "degrees",
                "this looks like radians: multiply by 57.29578",
            ));
        }
    }
    if let Some(masses) = &sheet.masses
        && masses.centre_mm.as_flattened().iter().all(|v| v.abs() < 2.0)
        && masses.centre_mm.as_flattened().iter().any(|&v| v != 0.0)
    {
        return Err(Fault::new(
            "masses.centre_mm",
            numbers(masses.centre_mm.as_flattened()),
            "millimetres",
            "this looks like metres: multiply by 1000",
        ));
    }
    Ok(())
}

fn numbers(values: &[f64]) -> String {
    let text: Vec<String> = values.iter().map(f64::to_string).collect();
    format!("[{}]", text.join(", "))
}

fn links(links: &[LinkSheet]) -> Result<(), Fault> {
    for (i, link) in links.iter().enumerate() {
        let key = |name: &str| format!("link {} {name}", i + 1);
        match link.model {
            LinkModel::Hayati if link.d_mm != 0.0 => {
                return Err(Fault::new(
                    key("d_mm"),
                    link.d_mm,
                    "0 on a hayati link",
                    "add it to d of the next link, whose axis is parallel",
                ));
            }
            LinkModel::Hayati if i == 5 => {
                return Err(Fault::new(
                    key("model"),
                    "hayati",
                    "dh on the last link",
                    "no axis follows that it could be parallel to",
                ));
            }
            LinkModel::Hayati if link.alpha_deg.to_radians().sin().abs() > 0.5 => {
                return Err(Fault::new(
                    key("model"),
                    format!("hayati with alpha_deg = {}", link.alpha_deg),
                    "hayati only where the next axis is parallel",
                    "write model = \"dh\"",
                ));
            }
            LinkModel::Dh if link.beta_deg != 0.0 => {
                return Err(Fault::new(
                    key("beta_deg"),
                    link.beta_deg,
                    "no beta on a dh link",
                    "write model = \"hayati\" or take beta out",
                ));
            }
            _ => {}
        }
    }
    Ok(())
}

fn joints(sheet: &DataSheet) -> Result<(), Fault> {
    let joints = &sheet.joints;
    match (&joints.min_deg, &joints.max_deg) {
        (Some(min), Some(max)) => {
            if let Some(i) = (0..6).find(|&i| min[i] >= max[i]) {
                return Err(Fault::new(
                    format!("joints.min_deg and max_deg of joint {}", i + 1),
                    format!("{} and {}", min[i], max[i]),
                    "min below max",
                    "swap or correct them",
                ));
            }
        }
        (None, None) => {}
        (Some(_), None) => {
            return Err(Fault::new(
                "joints.max_deg",
                "nothing",
                "max_deg beside min_deg",
                "give both or none",
            ));
        }
        (None, Some(_)) => {
            return Err(Fault::new(
                "joints.min_deg",
                "nothing",
                "min_deg beside max_deg",
                "give both or none",
            ));
        }
    }
    if let Some(rows) = &joints.map {
        let map = Matrix6::from_fn(|row, column| rows[row][column]);
        if map.determinant().abs() < 1e-6 {
            return Err(Fault::new(
                "joints.map",
                "a matrix that has no inverse",
                "six independent rows",
                "each row says which controller angles turn that link, with sign",
            ));
        }
        bounds::joint_map(rows).map_err(|invalid| {
            Fault::of_number(
                InvalidValue { key: "joints.map".to_owned(), ..invalid },
                "each row says which controller angles turn that link, with sign",
            )
        })?;
    }
    Ok(())
}

fn mounting(sheet: &DataSheet) -> Result<(), Fault> {
    if sheet.mounting.gravity.iter().all(|g| g.abs() < 1e-9) {
        return Err(Fault::new(
            "mounting.gravity",
            numbers(&sheet.mounting.gravity),
            "a direction",
            "[0, 0, -1] for an arm that stands, [0, 0, 1] for one that hangs",
        ));
    }
    let flange = sheet.flange.iter().map(|flange| ("flange.quaternion_wxyz", flange.quaternion_wxyz));
    let poses = sheet.published.iter().filter_map(|pose| pose.quaternion_wxyz);
    for (key, wxyz) in flange.chain(poses.map(|wxyz| ("published.quaternion_wxyz", wxyz))) {
        let norm = wxyz.iter().map(|v| v * v).sum::<f64>().sqrt();
        if !((norm - 1.0).abs() <= 1e-3) {
            return Err(Fault::new(
                key,
                format!("{} of length {norm:.4}", numbers(&wxyz)),
                "length 1, in the order w, x, y, z",
                "correct the quaternion",
            ));
        }
    }
    Ok(())
}

fn warnings(sheet: &DataSheet) -> Vec<String> {
    let mut out = Vec::new();
    for (i, link) in sheet.link.iter().enumerate().take(5) {
        if link.model == LinkModel::Dh && link.alpha_deg.to_radians().sin().abs() < PARALLEL {
            out.push(format!(
                "link {}: axes {} and {} are parallel and modelled by dh: its d cannot be identified; write model = \"hayati\"",
                i + 1,
                i + 1,
                i + 2
            ));
        }
    }
    let sources = &sheet.sources;
    let performance = sheet.payload_kg.or(sheet.reach_mm).or(sheet.repeatability_mm);
    for (key, present, source) in [
        ("links", true, &sources.links),
        ("limits", sheet.joints.min_deg.is_some(), &sources.limits),
        ("masses", sheet.masses.is_some(), &sources.masses),
        ("payload", performance.is_some(), &sources.payload),
    ] {
        if present && source.trim().is_empty() {
            out.push(format!("sources.{key}: no source stated"));
        }
    }
    if sheet.joints.min_deg.is_none() {
        out.push("joints: no range stated: targets are not checked against one".to_owned());
    }
    if sheet.published.is_empty() {
        out.push(
            "published: no pose stated: nothing checks the links; one pose of the data sheet is enough"
                .to_owned(),
        );
    }
    out
}

/// Tolerance of equal links, after conversion to degrees and back (mm and rad).
const SAME: f64 = 1e-6;

/// The first difference between a nominal arm and another of the same name.
pub(super) fn difference(found: &Model, known: &Model) -> Option<String> {
    for (i, (a, b)) in found.links.iter().zip(&known.links).enumerate() {
        if a.model != b.model {
            return Some(format!("link {} is of another model", i + 1));
        }
        for (name, a, b) in [
            ("a_mm", a.a_mm, b.a_mm),
            ("d_mm", a.d_mm, b.d_mm),
            ("alpha_deg", a.alpha_rad.to_degrees(), b.alpha_rad.to_degrees()),
            ("theta_deg", a.theta_rad.to_degrees(), b.theta_rad.to_degrees()),
            ("beta_deg", a.beta_rad.to_degrees(), b.beta_rad.to_degrees()),
        ] {
            if !((a - b).abs() <= SAME) {
                return Some(format!("link {} {name} is {a:.6}, not {b:.6}", i + 1));
            }
        }
    }
    if !((found.joint_map - known.joint_map).amax() <= SAME) {
        return Some("the joint map differs".to_owned());
    }
    let flange = found.flange.inv_mul(&known.flange);
    let apart = flange.translation.vector.norm().max(flange.rotation.angle());
    (!(apart <= SAME)).then(|| "the flange differs".to_owned())
}

/// How far a model is from a published pose: of the point (mm), and of the orientation (rad) where one is published.
pub fn deviation(pose: &Published, model: &Model) -> (f64, Option<f64>) {
    let q = Vector6::from(pose.joints_deg.map(f64::to_radians));
    let condition = Default::default();
    let prepared = model.at_condition(&condition);
    let flange = prepared.forward(&q);
    let point = match pose.point {
        Point::Flange => flange.translation.vector,
        Point::WristCentre => prepared.frames(&q).origin[5].into(),
    };
    let distance = match (pose.position_mm, pose.radius_mm) {
        (Some(position), _) => (point - nalgebra::Vector3::from(position)).norm(),
        (None, Some(radius)) => (point.xy().norm() - radius).abs(),
        (None, None) => 0.0,
    };
    let turn = pose.quaternion_wxyz.map(|wxyz| flange.rotation.angle_to(&unit_quaternion(&wxyz)));
    (distance, turn)
}

/// The model must reproduce the published poses of its sheet.
pub(super) fn check_published(sheet: &DataSheet, model: &Model) -> Result<(), Fault> {
    for pose in &sheet.published {
        let key = || format!("published \"{}\"", pose.what);
        if pose.position_mm.is_some() == pose.radius_mm.is_some() {
            return Err(Fault::new(
                key(),
                if pose.radius_mm.is_some() { "both" } else { "neither" },
                "either position_mm or radius_mm",
                "give exactly one",
            ));
        }
        let (distance, turn) = deviation(pose, model);
        if !(distance <= pose.tolerance_mm) {
            return Err(Fault::new(
                key(),
                format!("the links miss it by {distance:.3} mm"),
                "a miss within tolerance_mm",
                "check lengths, signs in joints.map and the offsets theta_deg",
            ));
        }
        if let Some(turn) = turn.filter(|&turn| !(turn <= 1e-4)) {
            return Err(Fault::new(
                key(),
                format!("an orientation {:.3}° off", turn.to_degrees()),
                "the published quaternion_wxyz",
                "check alpha_deg, theta_deg of link 6 and [robot.flange]",
            ));
        }
    }
    Ok(())
}
