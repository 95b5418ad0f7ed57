//! An arm in a TOML file: lengths in mm, angles in degrees.

use nalgebra::{Matrix6, Quaternion, Translation3, UnitQuaternion, Vector3};
use serde::{Deserialize, Serialize};

use super::bounds::{self, InvalidValue, LENGTH_MM, SPEED_DEG_S, display_number};
use super::effect::Effect;
use super::effect::bounds::effects;
use super::link::{Link, LinkModel};
use super::model::Model;
use crate::body::Body;
use crate::limits::{Limits, SumLimit};
use truegrind_math::rounding::degrees;
use truegrind_math::se3::Pose;

/// One link in a file.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct LinkFile {
    /// Which parameters are free.
    pub model: LinkModel,
    /// a (mm).
    pub a_mm: f64,
    /// d (mm).
    pub d_mm: f64,
    /// alpha (°).
    pub alpha_deg: f64,
    /// theta offset (°).
    pub theta_deg: f64,
    /// beta (°); Hayati links only.
    #[serde(default)]
    pub beta_deg: f64,
}

/// An arm in a file.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct ArmFile {
    /// DH rotation = map · controller angle.
    pub joint_map: [[f64; 6]; 6],
    /// Lowest controller angles (°).
    pub min_deg: [f64; 6],
    /// Highest controller angles (°).
    pub max_deg: [f64; 6],
    /// Highest joint speeds [°/s].
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub speed_deg_s: Option<[f64; 6]>,
    /// Ranges of sums of joints.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub sum: Vec<SumLimit>,
    /// Direction of gravity in the base.
    pub gravity: [f64; 3],
    /// Position of the flange in the last DH frame (mm).
    pub flange_mm: [f64; 3],
    /// Orientation of the flange in the last DH frame, scalar first.
    pub flange_wxyz: [f64; 4],
    /// The six links.
    pub link: Vec<LinkFile>,
    /// Masses of the links.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub body: Option<Vec<Body>>,
    /// Effects beyond rigid links.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub effect: Vec<Effect>,
}

impl From<&Model> for ArmFile {
    fn from(model: &Model) -> Self {
        let q = model.flange.rotation;
        Self {
            joint_map: std::array::from_fn(|i| std::array::from_fn(|j| model.joint_map[(i, j)])),
            min_deg: model.limits.min_rad.map(degrees),
            max_deg: model.limits.max_rad.map(degrees),
            speed_deg_s: model.limits.speed_rad_s.map(|s| s.map(degrees)),
            sum: model.limits.sums.clone(),
            gravity: model.gravity.into(),
            flange_mm: model.flange.translation.vector.into(),
            flange_wxyz: [q.w, q.i, q.j, q.k],
            link: model
                .links
                .iter()
                .map(|l| LinkFile {
                    model: l.model,
                    a_mm: l.a_mm,
                    d_mm: l.d_mm,
                    alpha_deg: degrees(l.alpha_rad),
                    theta_deg: degrees(l.theta_rad),
                    beta_deg: degrees(l.beta_rad),
                })
                .collect(),
            body: model.bodies.map(|b| b.to_vec()),
            effect: model.effects.clone(),
        }
    }
}

impl ArmFile {
    /// The arm.
    ///
    /// ```
    /// use truegrind_arm::arm_file::ArmFile;
    /// use truegrind_arm::robots;
    ///
    /// let arm = robots::load("abb-irb-120")?.model;
    /// let mut file = ArmFile::from(&arm);
    /// assert!((file.model()?.links[1].a_mm - arm.links[1].a_mm).abs() < 1e-12);
    /// file.link[1].a_mm = f64::NAN;
    /// let refused = file.model().map_err(|invalid| invalid.to_string());
    /// assert_eq!(refused, Err("link 2 a_mm: found NaN, expected a finite length in mm, within ±10,000".into()));
    /// # Ok::<(), Box<dyn std::error::Error>>(())
    /// ```
    ///
    /// # Errors
    /// [`InvalidValue`], which names the key, where a list has the wrong length or a number cannot be used.
    pub fn model(&self) -> Result<Model, InvalidValue> {
        self.check()?;
        let count = self.link.len();
        let links: Vec<Link> = self
            .link
            .iter()
            .map(|l| Link {
                model: l.model,
                a_mm: l.a_mm,
                d_mm: l.d_mm,
                alpha_rad: l.alpha_deg.to_radians(),
                theta_rad: l.theta_deg.to_radians(),
                beta_rad: l.beta_deg.to_radians(),
            })
            .collect();
        let links: [Link; 6] =
            links.try_into().map_err(|_| InvalidValue::new("`link`", format!("{count} links"), "6"))?;
        let bodies = match &self.body {
            None => None,
            Some(list) => Some(
                <[Body; 6]>::try_from(list.clone())
                    .map_err(|_| InvalidValue::new("`body`", format!("{} bodies", list.len()), "6"))?,
            ),
        };
        let [w, i, j, k] = self.flange_wxyz;
        let quaternion = Quaternion::new(w, i, j, k);
        let gravity = Vector3::from(self.gravity);
        Ok(Model {
            links,
            joint_map: Matrix6::from_fn(|i, j| self.joint_map[i][j]),
            limits: Limits {
                min_rad: self.min_deg.map(f64::to_radians),
                max_rad: self.max_deg.map(f64::to_radians),
                speed_rad_s: self.speed_deg_s.map(|s| s.map(f64::to_radians)),
                sums: self.sum.clone(),
            },
            flange: Pose::from_parts(
                Translation3::from(Vector3::from(self.flange_mm)),
                UnitQuaternion::from_quaternion(quaternion),
            ),
            bodies,
            gravity: gravity.normalize(),
            effects: self.effect.clone(),
        })
    }

    /// Refuses numbers out of bounds; all accepted numbers are finite.
    fn check(&self) -> Result<(), InvalidValue> {
        bounds::joint_map(&self.joint_map)?;
        bounds::joint_ranges(&self.min_deg, &self.max_deg)?;
        self.sum.iter().try_for_each(|sum| sum.check("sum"))?;
        SPEED_DEG_S.check_all("speed_deg_s", self.speed_deg_s.iter().flatten())?;
        LENGTH_MM.check_all("flange_mm", &self.flange_mm)?;
        for (key, values) in [("gravity", &self.gravity[..]), ("flange_wxyz", &self.flange_wxyz[..])] {
            let length = values.iter().map(|v| v * v).sum::<f64>().sqrt();
            if !((length - 1.0).abs() <= 1e-3) {
                return Err(InvalidValue::new(
                    key,
                    format!("a length of {}", display_number(length)),
                    "a length of 1",
                ));
            }
        }
        for (i, link) in self.link.iter().enumerate() {
            bounds::link(i, [link.a_mm, link.d_mm], [link.alpha_deg, link.theta_deg, link.beta_deg])?;
        }
        bounds::bodies(self.body.as_deref().unwrap_or_default())?;
        effects(&self.effect)
    }
}
