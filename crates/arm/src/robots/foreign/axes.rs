//! Fit of DH and Hayati links through six axes in space.
//!
//! Method: the common normals of Denavit and Hartenberg (1955) between axes that are not parallel. Between parallel ones, whose
//! common normal is undetermined or far away, Hayati and Mirmirani's form (1985): the next frame lies where the next axis meets
//! the plane through this frame across this axis, and two twists rotate this axis into the next. That is exact for nearly parallel
//! axes too, so nothing is rounded to a parallel.
//! Departures: of the two directions of a normal, the one with the smaller joint offset is taken.
//! Checked against: the file's own product of transforms.

use nalgebra::{Point3, UnitQuaternion, UnitVector3, Vector3};

use super::chain::ForeignArm;
use super::common::{foreign_error, zero_if_tiny};
use crate::link::{Link, LinkModel};
use crate::robots::error::RobotError;
use crate::robots::sheet::LinkSheet;
use truegrind_math::se3::Pose;

/// Below this sine of their angle two axes are linked by Hayati's form: 0.5°, as in the check of data sheets.
const PARALLEL: f64 = 0.0087;

/// Axes that are closer than this meet (mm). Every joint may be moved by so much, and all of them together stay a hundred times
/// below the nanometre within which an arm agrees with its file; a product of transforms is off by less.
const MEET_MM: f64 = 1e-11;

/// A first axis inclined by less is upright (rad): ten picometres at a distance of a metre.
const SAME_RAD: f64 = 1e-14;

/// What a place (mm) and an angle (°) have to be for the digits of [`FittedLinks::base_note`] to show them.
const SHOWN: [f64; 2] = [5e-4, 5e-5];

/// Fitted links and their frames.
#[derive(Debug, Clone)]
pub(super) struct FittedLinks {
    /// The links.
    pub(super) links: [LinkSheet; 6],
    /// The flange in the last link frame.
    pub(super) flange: Pose,
    /// The robot's base in the file's: its z is axis 1. The same as the file's where possible.
    pub(super) base: Pose,
    /// −1 where joint 1 of the file rotates against that z.
    pub(super) first_turn: f64,
    /// Frames of the links in the file's base with all joints at zero; the base first.
    pub(super) frames: [Pose; 7],
    /// Directions of the axes in the file's base.
    directions: [UnitVector3<f64>; 6],
}

/// Fits links through the axes of a foreign arm.
pub(super) fn fit_links(foreign: &ForeignArm, file: &str) -> Result<FittedLinks, RobotError> {
    let frames = foreign.frames();
    let lines: [(Point3<f64>, UnitVector3<f64>); 6] = std::array::from_fn(|i| {
        let frame = &frames[i];
        let direction = UnitVector3::new_normalize((frame.rotation * foreign.steps[i].axis).into_inner());
        (Point3::from(frame.translation.vector), direction)
    });
    let (base, first_turn) = base(&lines[0]);
    let mut at = base;
    let mut out = [base; 7];
    let mut links = [LinkSheet {
        model: LinkModel::Dh,
        a_mm: 0.0,
        d_mm: 0.0,
        alpha_deg: 0.0,
        theta_deg: 0.0,
        beta_deg: 0.0,
    }; 6];
    for i in 0..5 {
        let (point, direction) = (at.inverse() * lines[i + 1].0, at.inverse() * lines[i + 1].1);
        let link = between(&point, &direction, i, file)?;
        at *= turned(&link);
        links[i] = link;
        out[i + 1] = at;
    }
    let (last, flange) = last(&(at.inverse() * frames[6]));
    links[5] = last;
    out[6] = at * turned(&last);
    Ok(FittedLinks {
        links,
        flange,
        base,
        first_turn,
        frames: out,
        directions: lines.map(|(_, direction)| direction),
    })
}

/// The pose of a link with its joint at zero, from the degrees of the sheet.
fn turned(link: &LinkSheet) -> Pose {
    Link {
        model: link.model,
        a_mm: link.a_mm,
        d_mm: link.d_mm,
        alpha_rad: link.alpha_deg.to_radians(),
        theta_rad: link.theta_deg.to_radians(),
        beta_rad: link.beta_deg.to_radians(),
    }
    .pose(0.0)
}

/// The base for a first axis, and −1 where its z is against the axis: the file's own base where it lies on the axis, else the
/// nearest point of the axis.
fn base((point, direction): &(Point3<f64>, UnitVector3<f64>)) -> (Pose, f64) {
    // Upright in either sense of joint 1.
    let turn = if direction.z < -1.0 + 1e-9 { -1.0 } else { 1.0 };
    let z = direction.into_inner() * turn;
    let upright = (z - Vector3::z()).norm() < SAME_RAD;
    let foot = point - z * z.dot(&point.coords);
    let foot = if foot.coords.norm() < MEET_MM { Point3::origin() } else { foot };
    if upright {
        return (Pose::from_parts(foot.coords.into(), UnitQuaternion::identity()), turn);
    }
    // By sine and cosine: the cosine alone loses rotations below 1e-8.
    let across = Vector3::z().cross(&z);
    let (sine, cosine) = (across.norm(), z.z);
    let axis = if sine > 0.0 { across / sine } else { Vector3::x() };
    let rotation = UnitQuaternion::from_scaled_axis(axis * sine.atan2(cosine));
    (Pose::from_parts(foot.coords.into(), rotation), turn)
}

/// Angle and sign of a normal, reversed where that makes the joint offset smaller.
fn shorter(angle: f64) -> (f64, f64) {
    use std::f64::consts::{FRAC_PI_2, PI};
    if angle > FRAC_PI_2 + 1e-9 {
        (angle - PI, -1.0)
    } else if angle <= -FRAC_PI_2 - 1e-9 {
        (angle + PI, -1.0)
    } else {
        (angle, 1.0)
    }
}

/// The link from a joint to the next axis, which is given in the joint's frame.
fn between(
    point: &Point3<f64>,
    direction: &UnitVector3<f64>,
    joint: usize,
    file: &str,
) -> Result<LinkSheet, RobotError> {
    let sine = direction.x.hypot(direction.y);
    let about_z = |angle: f64| UnitQuaternion::from_axis_angle(&Vector3::z_axis(), angle);
    if sine < PARALLEL {
        // Intersection of the next axis with the plane through this frame.
        let meets = point - direction.into_inner() * (point.z / direction.z);
        let length = meets.x.hypot(meets.y);
        if length < 1e-6 {
            return Err(foreign_error(
                file,
                format!("joints {} and {}", joint + 1, joint + 2),
                "two joints that turn about one line",
                "six joints that each turn about a line of their own",
                "give the link that does not turn, or the right table",
            ));
        }
        let (theta, sign) = shorter(meets.y.atan2(meets.x));
        let next = about_z(-theta) * direction;
        return Ok(LinkSheet {
            model: LinkModel::Hayati,
            a_mm: sign * length,
            d_mm: 0.0,
            alpha_deg: zero_if_tiny((-next.y).atan2(next.z).to_degrees()),
            theta_deg: zero_if_tiny(theta.to_degrees()),
            beta_deg: zero_if_tiny(next.x.asin().to_degrees()),
        });
    }
    // The common normal: across both axes.
    let normal = Vector3::new(-direction.y, direction.x, 0.0) / sine;
    let along = (point.x * direction.x + point.y * direction.y) / sine;
    let foot = point - direction.into_inner() * (along / sine);
    let length = foot.coords.dot(&normal);
    let (theta, sign) = shorter(normal.y.atan2(normal.x));
    let next = about_z(-theta) * direction;
    Ok(LinkSheet {
        model: LinkModel::Dh,
        a_mm: if length.abs() < MEET_MM { 0.0 } else { sign * length },
        d_mm: if foot.z.abs() < MEET_MM { 0.0 } else { foot.z },
        alpha_deg: zero_if_tiny((-next.y).atan2(next.z).to_degrees()),
        theta_deg: zero_if_tiny(theta.to_degrees()),
        beta_deg: 0.0,
    })
}

/// The last link and the flange after it; the link takes as much of the flange as it can represent.
fn last(flange: &Pose) -> (LinkSheet, Pose) {
    let position = flange.translation.vector;
    let z = flange.rotation * Vector3::z();
    let x = flange.rotation * Vector3::x();
    let upright = z.x.hypot(z.y) < 1e-12;
    let (theta, alpha) = match (upright, z.z < 0.0) {
        (true, false) => (x.y.atan2(x.x), 0.0),
        (true, true) => (x.y.atan2(x.x), std::f64::consts::PI),
        (false, _) => (0.0, 0.0),
    };
    let link = LinkSheet {
        model: LinkModel::Dh,
        a_mm: 0.0,
        d_mm: zero_if_tiny(position.z),
        alpha_deg: alpha.to_degrees(),
        theta_deg: zero_if_tiny(theta.to_degrees()),
        beta_deg: 0.0,
    };
    let rest = turned(&link).inverse() * flange;
    let none = rest.translation.vector.norm() < MEET_MM && rest.rotation.angle() < 1e-12;
    (link, if none { Pose::identity() } else { rest })
}

impl FittedLinks {
    /// Note on joint 1 where it turns about the base's z axis the other way.
    pub(super) fn turn_note(&self) -> Option<String> {
        (self.first_turn < 0.0).then(|| "joint 1 turns clockwise seen from above".to_owned())
    }

    /// Note on the base where it is not the file's.
    pub(super) fn base_note(&self) -> Option<String> {
        // No sign before zero.
        let rounded = |value: f64, to: f64| (value / to).round() * to + 0.0;
        let position = self.base.translation.vector.map(|mm| rounded(mm, 1e-3));
        let [roll, pitch, yaw] = {
            let (r, p, y) = self.base.rotation.euler_angles();
            [r, p, y].map(|angle| rounded(angle.to_degrees(), 1e-4))
        };
        let is_other =
            position.amax() >= SHOWN[0] || [roll, pitch, yaw].iter().any(|angle| angle.abs() >= SHOWN[1]);
        is_other.then(|| {
            format!(
                "axis 1 is not the z axis of the file's base: positions are those of a base on axis 1, which lies at \
                 ({:.3}, {:.3}, {:.3}) mm in the file's, turned by roll {roll:.4}°, pitch {pitch:.4}°, yaw {yaw:.4}°",
                position.x, position.y, position.z
            )
        })
    }

    /// +1 or −1 where axes 2 and 3 are parallel or antiparallel.
    ///
    /// # Errors
    /// Where they are neither, since then no joint is measured relative to the ground.
    pub(super) fn parallel_2_3(&self, file: &str) -> Result<f64, RobotError> {
        let along = self.directions[1].dot(&self.directions[2]);
        if along.abs() < 1.0 - 1e-4 {
            return Err(foreign_error(
                file,
                "joint 3 relative to the ground",
                format!("axes 2 and 3 at {:.2}° to each other", along.clamp(-1.0, 1.0).acos().to_degrees()),
                "parallel axes 2 and 3",
                "leave the option out: in such an arm no joint is measured relative to the ground",
            ));
        }
        Ok(along.signum())
    }
}
