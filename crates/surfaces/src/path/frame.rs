//! Tool frame at a point of a path: z axis into the surface, rotated by lead and tilt; x axis by a rule.
//!
//! With outward normal n, feed f and l = n × f (to the left of the feed, seen with n up), the spindle direction, away from
//! the surface, is n rotated by the lead angle about l towards f, then by the tilt angle about f towards l. The tool's z axis
//! is its opposite, so that z · n = −cos(lead) cos(tilt).

use nalgebra::{Matrix3, Point3, Rotation3, Unit, UnitQuaternion, Vector3};

use crate::error::SurfaceError;
use crate::path::options::{PathOptions, ToolX};
use truegrind_math::se3::rotation_from_matrix;

/// Sine of the angle to the tool's axis below which a direction does not determine the tool's x axis.
const PARALLEL: f64 = 1e-3;

/// The orientation of the tool where the surface has the outward normal `normal` and the tool is fed along `feed`.
///
/// # Errors
/// [`SurfaceError::ToolX`] where the fixed direction of the x axis is along the tool.
pub fn orientation(
    position_mm: &Point3<f64>,
    normal: &Unit<Vector3<f64>>,
    feed: &Unit<Vector3<f64>>,
    options: &PathOptions,
) -> Result<UnitQuaternion<f64>, SurfaceError> {
    let left = Unit::new_normalize(normal.cross(feed));
    let turn = Rotation3::from_axis_angle(feed, -options.tilt_rad)
        * Rotation3::from_axis_angle(&left, options.lead_rad);
    let z = -(turn * normal.into_inner());
    let wanted = match options.tool_x {
        ToolX::Fixed(direction) => direction.normalize(),
        // The feed rotated with the tool is already normal to z.
        ToolX::Feed => turn * feed.into_inner(),
    };
    let across = wanted - z * z.dot(&wanted);
    let x = Unit::try_new(across, PARALLEL).ok_or(SurfaceError::ToolX {
        x: position_mm.x,
        y: position_mm.y,
        z: position_mm.z,
    })?;
    Ok(rotation_from_matrix(&Matrix3::from_columns(&[x.into_inner(), z.cross(&x), z])))
}
