//! One link: the motion from one joint frame to the next.

use nalgebra::{Translation3, UnitQuaternion, Vector3};
use serde::{Deserialize, Serialize};

use truegrind_math::se3::Pose;

/// Which four numbers of a link are parameters.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum LinkModel {
    /// Denavit and Hartenberg: theta, d, a, alpha (ltlm-2024 eq. 2).
    Dh,
    /// Hayati: theta, a, alpha, beta, for an axis nominally parallel to the next one, where DH's d is unbounded
    /// (rls-2025, "forward kinematic model"; Hayati and Mirmirani 1985). d stays a constant of the link.
    Hayati,
}

/// T = Rz(theta) · Tz(d) · Tx(a) · Rx(alpha) · Ry(beta), from frame i−1 to frame i.
///
/// With beta = 0 this is ltlm-2024 eq. 2, with d = 0 the Hayati link; `model` says which of d and beta is free.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Link {
    /// Which parameters are free.
    pub model: LinkModel,
    /// Link length a (mm), along x after the joint's rotation.
    pub a_mm: f64,
    /// Link offset d (mm), along the joint axis.
    pub d_mm: f64,
    /// Twist alpha (rad), about x.
    pub alpha_rad: f64,
    /// Joint offset theta (rad), added to the joint angle.
    pub theta_rad: f64,
    /// Second twist beta (rad), about y; 0 for a DH link.
    pub beta_rad: f64,
}

impl Link {
    /// The pose of frame i in frame i−1 with the joint at `angle_rad` (offset not included).
    ///
    /// ```
    /// use std::f64::consts::FRAC_PI_2;
    /// use nalgebra::Point3;
    /// use truegrind_arm::link::{Link, LinkModel};
    ///
    /// // An upper arm of 270 mm with its joint at 90°: its end is on y, and its own x axis points along y.
    /// let link = Link { model: LinkModel::Dh, a_mm: 270.0, d_mm: 0.0, alpha_rad: 0.0, theta_rad: 0.0, beta_rad: 0.0 };
    /// let end = link.pose(FRAC_PI_2);
    /// assert!((end * Point3::origin() - Point3::new(0.0, 270.0, 0.0)).norm() < 1e-12);
    /// assert!((end * Point3::new(1.0, 0.0, 0.0) - Point3::new(0.0, 271.0, 0.0)).norm() < 1e-12);
    /// ```
    pub fn pose(&self, angle_rad: f64) -> Pose {
        let rz = UnitQuaternion::from_axis_angle(&Vector3::z_axis(), angle_rad + self.theta_rad);
        let rx = UnitQuaternion::from_axis_angle(&Vector3::x_axis(), self.alpha_rad);
        let ry = UnitQuaternion::from_axis_angle(&Vector3::y_axis(), self.beta_rad);
        let shift = rz * Vector3::new(self.a_mm, 0.0, self.d_mm);
        Pose::from_parts(Translation3::from(shift), rz * rx * ry)
    }
}
