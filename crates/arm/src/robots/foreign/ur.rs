//! The calibration of a Universal Robots arm: its controller's `calibration.conf`, and the kinematics file that ROS drivers take
//! from it (`ur_calibration`).
//!
//! The first holds deviations from the maker's table, so it must say whose: a line `robot = universal-robots-…` above its
//! first section. The second holds the place of each joint in the one before, about whose z it turns; its base is the
//! controller's ("Base"), its last frame the controller's flange.
//!
//! Joint axes 2, 3 and 4 are nearly parallel, and in a table of Denavit–Hartenberg parameters their calibration moves d by
//! hundreds of metres there and back. Read as axes in space nothing of that is left.

use nalgebra::Vector3;

use super::chain::{ForeignArm, about_z, from_rpy};
use super::common::foreign_error;
use super::table;
use crate::joints::Joints;
use crate::robots::Robot;
use crate::robots::error::RobotError;
use crate::robots::sheet::Dialect;
use truegrind_math::se3::Pose;

/// The joints in the order of the arm.
const NAMES: [&str; 6] = ["shoulder", "upper_arm", "forearm", "wrist_1", "wrist_2", "wrist_3"];
const PLACES: [&str; 6] = ["x", "y", "z", "roll", "pitch", "yaw"];

fn foreign(steps: [super::chain::Step; 6], after: Pose, file: &str, what: &str) -> ForeignArm {
    ForeignArm {
        steps,
        after,
        gravity: -Vector3::z(),
        limits_deg: None,
        speed_deg_s: None,
        joint_map: None,
        masses: None,
        maker: "Universal Robots".to_owned(),
        designation: String::new(),
        dialect: Some(Dialect::Urscript),
        source: format!("{file}, {what}"),
        visuals: Vec::new(),
        notes: Vec::new(),
    }
}

/// The arm of a kinematics file: two levels of keys, as `ur_calibration` writes them.
pub(super) fn read_yaml(text: &str, file: &str) -> Result<ForeignArm, RobotError> {
    let mut found: [[Option<f64>; 6]; 6] = [[None; 6]; 6];
    let mut joint = None;
    for (number, line) in text.lines().enumerate() {
        let plain = line.split('#').next().unwrap_or_default();
        let Some((key, value)) = plain.split_once(':') else { continue };
        let (key, value) = (key.trim().trim_matches(['"', '\'']), value.trim());
        if value.starts_with('{') && NAMES.contains(&key) {
            return Err(foreign_error(
                file,
                format!("line {}, kinematics.{key}", number + 1),
                format!("`{}`", plain.trim()),
                "x, y, z, roll, pitch and yaw, each in a line of its own",
                "write them so, as ur_calibration does",
            ));
        }
        if value.is_empty() {
            joint = NAMES.iter().position(|name| *name == key);
            continue;
        }
        let (Some(joint), Some(column)) = (joint, PLACES.iter().position(|name| *name == key)) else {
            continue;
        };
        let value: Option<f64> = value.parse().ok().filter(|value: &f64| value.is_finite());
        let value = value.ok_or_else(|| {
            let key = format!("line {}, {}.{key}", number + 1, NAMES[joint]);
            foreign_error(
                file,
                key,
                format!("`{}`", plain.trim()),
                "a finite number (m or rad)",
                "correct it",
            )
        })?;
        found[joint][column] = Some(value);
    }
    let mut poses = [Pose::identity(); 6];
    for (joint, values) in found.iter().enumerate() {
        if let Some(missing) = values.iter().position(Option::is_none) {
            return Err(foreign_error(
                file,
                format!("kinematics.{}.{}", NAMES[joint], PLACES[missing]),
                "nothing",
                "x, y, z (m), roll, pitch and yaw (rad) of shoulder, upper_arm, forearm, wrist_1, wrist_2 and wrist_3",
                "take the file as ur_calibration writes it",
            ));
        }
        let [x, y, z, roll, pitch, yaw] = values.map(Option::unwrap_or_default);
        poses[joint] = from_rpy(Vector3::new(x, y, z) * 1000.0, [roll, pitch, yaw]);
    }
    Ok(foreign(
        poses.map(about_z),
        Pose::identity(),
        file,
        "kinematics as the driver read them from the controller",
    ))
}

/// The arm of a controller's file: the table of the catalogue, and the deviations from it.
pub(super) fn read_conf(
    text: &str,
    file: &str,
    load: impl Fn(&str) -> Result<Robot, RobotError>,
) -> Result<ForeignArm, RobotError> {
    const LISTS: [&str; 4] = ["delta_theta", "delta_d", "delta_a", "delta_alpha"];
    let mut lists: [Option<[f64; 6]>; 4] = [None; 4];
    let mut robot = None;
    for (number, line) in text.lines().enumerate() {
        let plain = line.split(['#', ';']).next().unwrap_or_default();
        let Some((key, value)) = plain.split_once('=') else { continue };
        let (key, value) = (key.trim(), value.trim());
        if key == "robot" {
            robot = Some(value.trim_matches('"').to_owned());
        }
        let Some(list) = LISTS.iter().position(|name| *name == key) else { continue };
        let values = value.trim_start_matches('[').trim_end_matches(']').split(',');
        let values: Option<Vec<f64>> =
            values.map(|cell| cell.trim().parse().ok().filter(|v: &f64| v.is_finite())).collect();
        let six = values.and_then(|values| <[f64; 6]>::try_from(values).ok()).ok_or_else(|| {
            let key = format!("line {}, {key}", number + 1);
            foreign_error(
                file,
                key,
                format!("`{value}`"),
                "six finite numbers (m or rad)",
                "take the file as the controller has it",
            )
        })?;
        lists[list] = Some(six);
    }
    if let Some(missing) = lists.iter().position(Option::is_none) {
        return Err(foreign_error(
            file,
            LISTS[missing],
            "nothing",
            "delta_theta, delta_d, delta_a and delta_alpha, six numbers each",
            "take the file calibration.conf of the controller",
        ));
    }
    let Some(name) = robot else {
        return Err(foreign_error(
            file,
            "robot",
            "nothing",
            "a line such as `robot = universal-robots-ur10` above the first section",
            "the file contains deviations from the maker's table and does not say for which arm: write the arm there",
        ));
    };
    let nominal = load(&name)?.model;
    let [theta, d, a, alpha] = lists.map(Option::unwrap_or_default);
    let link = |i: usize| &nominal.links[i];
    let (steps, after) = table::steps(
        false,
        &std::array::from_fn(|i| link(i).theta_rad + theta[i]),
        &std::array::from_fn(|i| link(i).d_mm + 1000.0 * d[i]),
        &std::array::from_fn(|i| link(i).a_mm + 1000.0 * a[i]),
        &std::array::from_fn(|i| link(i).alpha_rad + alpha[i]),
    );
    let mut out = foreign(steps, after, file, "the controller's own calibration");
    out.designation = name.clone();
    let limits = &nominal.limits;
    out.limits_deg =
        Some(std::array::from_fn(|i| [limits.min_rad[i].to_degrees(), limits.max_rad[i].to_degrees()]));
    let still = Default::default();
    let ours = nominal.forward(&Joints::zeros(), &still).translation.vector;
    let theirs = out.forward(&Joints::zeros()).translation.vector;
    let far = d.iter().fold(0.0_f64, |far, d| far.max(d.abs()));
    out.notes.push(format!(
        "deviations from {name}: {:.3} mm of the flange at zero; its table moves parallel axes by up to {far:.3} m there and back, \
         of which nothing is left here",
        (ours - theirs).norm()
    ));
    if nominal.joint_map != nalgebra::Matrix6::identity() {
        out.joint_map = Some(nominal.joint_map);
    }
    Ok(out)
}
