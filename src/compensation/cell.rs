//! Where tools and work objects come from, and what that means under a better model of the arm.
//!
//! A frame from *metrology* (CAD, a measuring machine, a tracker) is true as it stands. A frame that was *taught* with
//! the uncalibrated arm stands where the nominal model put it; the estimated model, given the same joint angles, says
//! where it truly is. A taught frame without its teaching points cannot be moved: the difference is estimated and
//! stated instead.

use nalgebra::{DMatrix, DVector, Matrix3, Point3, Quaternion, UnitQuaternion, Vector3};
use serde::{Deserialize, Serialize};

use crate::kinematics::model::{Joints, Posed};
use crate::math::se3::{Pose, rotation_from_matrix};

/// How a frame was obtained.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum FrameOrigin {
    /// From CAD or measured by other means: true as it stands.
    Metrology,
    /// Taught with the uncalibrated arm.
    Taught,
}

/// One tool or work object of a cell.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct CellFrame {
    /// Name in the program; letters count the same in either case.
    pub name: String,
    /// How it was obtained.
    pub origin: FrameOrigin,
    /// Controller joint angles (°) of the teaching points. A tool: four or more poses with the TCP at one fixed
    /// point. A work object: three poses, first and second on its x axis, the third on its y axis, with the tool
    /// named in `taught_with`.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub teaching_deg: Vec<[f64; 6]>,
    /// The tool with which a work object was taught.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub taught_with: Option<String>,
    /// Where it lies (mm), for NC programs, which name tools and work offsets (`T1`, `G54`) without saying where they are:
    /// a tool on the flange, a work object in the base.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub position_mm: Option<[f64; 3]>,
    /// How it is turned, w, x, y, z; not at all where left out.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub quaternion_wxyz: Option<[f64; 4]>,
}

impl CellFrame {
    /// Where the file says it lies.
    pub fn pose(&self) -> Option<Pose> {
        let [w, x, y, z] = self.quaternion_wxyz.unwrap_or([1.0, 0.0, 0.0, 0.0]);
        let turn = UnitQuaternion::from_quaternion(Quaternion::new(w, x, y, z));
        self.position_mm.map(|position| Pose::from_parts(position.into(), turn))
    }
}

/// What an external axis carries.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Carries {
    /// The robot's base: a track or gantry.
    Base,
    /// A part, a tool, or nothing that a target depends on.
    Other,
}

/// One external axis of a cell.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct CellAxis {
    /// Its letter in a target, `a` to `f`.
    pub axis: char,
    /// What it carries.
    pub carries: Carries,
}

impl CellAxis {
    /// Its place among the external axes of a target.
    pub fn index(&self) -> Option<usize> {
        ('a'..='f').position(|letter| letter == self.axis.to_ascii_lowercase())
    }
}

/// The cell file: what is known of the origin of tools and work objects, and of external axes.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Cell {
    /// Tools.
    #[serde(default)]
    pub tool: Vec<CellFrame>,
    /// Work objects.
    #[serde(default)]
    pub wobj: Vec<CellFrame>,
    /// External axes.
    #[serde(default)]
    pub external: Vec<CellAxis>,
}

impl Cell {
    /// Reads a cell file.
    ///
    /// # Errors
    /// A sentence with key and reason.
    pub fn from_toml(text: &str) -> Result<Self, String> {
        let cell: Self = toml::from_str(text).map_err(|e| format!("not a cell file: {e}"))?;
        for (kind, frame, least) in
            cell.tool.iter().map(|f| ("tool", f, 4)).chain(cell.wobj.iter().map(|f| ("wobj", f, 3)))
        {
            if let Some(q) = frame.quaternion_wxyz
                && !((q.iter().map(|q| q * q).sum::<f64>() - 1.0).abs() < 1e-3)
            {
                return Err(format!("{kind} \"{}\": quaternion_wxyz has not length 1", frame.name));
            }
            let found = frame.teaching_deg.len();
            if frame.origin == FrameOrigin::Taught && found > 0 && found < least {
                return Err(format!(
                    "{kind} \"{}\": {found} teaching points, expected at least {least}",
                    frame.name
                ));
            }
        }
        if let Some(wrong) = cell.external.iter().find(|axis| axis.index().is_none()) {
            return Err(format!("external axis '{}': expected one of a, b, c, d, e, f", wrong.axis));
        }
        Ok(cell)
    }

    /// What an external axis carries, by its place in a target.
    pub fn carries(&self, index: usize) -> Option<Carries> {
        self.external.iter().find(|axis| axis.index() == Some(index)).map(|axis| axis.carries)
    }

    /// What is known of a tool.
    pub fn tool(&self, name: &str) -> Option<&CellFrame> {
        self.tool.iter().find(|f| f.name.eq_ignore_ascii_case(name))
    }

    /// What is known of a work object.
    pub fn wobj(&self, name: &str) -> Option<&CellFrame> {
        self.wobj.iter().find(|f| f.name.eq_ignore_ascii_case(name))
    }
}

/// The TCP that stays at one point over all poses, by linear least squares (the n-point method).
/// `None` for poses that do not fix it (orientations too much alike).
pub fn taught_tcp(arm: &Posed<'_>, teaching: &[Joints]) -> Option<Vector3<f64>> {
    // R_i t + p_i = c for all i: unknown t and c.
    let n = teaching.len();
    let mut a = DMatrix::zeros(3 * n, 6);
    let mut b = DVector::zeros(3 * n);
    for (i, q) in teaching.iter().enumerate() {
        let flange = arm.forward(q);
        a.view_mut((3 * i, 0), (3, 3)).copy_from(flange.rotation.to_rotation_matrix().matrix());
        a.view_mut((3 * i, 3), (3, 3)).copy_from(&-Matrix3::<f64>::identity());
        b.rows_mut(3 * i, 3).copy_from(&-flange.translation.vector);
    }
    let svd = a.svd(true, true);
    if svd.singular_values.min() < 1e-3 {
        return None;
    }
    let x = svd.solve(&b, 0.0).ok()?;
    Some(x.fixed_rows::<3>(0).into_owned())
}

/// The frame through three taught points: the first two on x, the third on y (the origin is its foot on x).
/// `None` where the points are in line.
pub fn taught_frame(points: &[Point3<f64>; 3]) -> Option<Pose> {
    let x = (points[1] - points[0]).try_normalize(1e-9)?;
    let along = x.dot(&(points[2] - points[0]));
    let origin = points[0] + x * along;
    let y = (points[2] - origin).try_normalize(1e-9)?;
    let rotation = rotation_from_matrix(&Matrix3::from_columns(&[x, y, x.cross(&y)]));
    Some(Pose::from_parts(origin.coords.into(), rotation))
}
