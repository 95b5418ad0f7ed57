//! Options for sensor frames that were measured by other means. With them the raw error of a data set is defined.

use anyhow::{anyhow, bail};
use clap::Args;
use nalgebra::{Quaternion, UnitQuaternion, Vector3};
use truegrind::calibration::identification::stated_placement::StatedPlacement;
use truegrind::math::se3::Pose;

/// Place of sensor and target, if known. Without [`FramePriorArguments`] it serves for the raw error only, and the fit determines the
/// frames.
#[derive(Debug, Clone, Default, Args)]
pub(super) struct StatedFrameArguments {
    /// Frame of a position or pose sensor in the robot base: x,y,z (mm) or x,y,z,qw,qx,qy,qz; of several stations that of the first row.
    #[arg(long, value_name = "X,Y,Z[,Q…]", allow_hyphen_values = true)]
    sensor_frame: Option<String>,
    /// Outlet of a draw-wire cable in the robot base: x,y,z (mm). Once per cable, in the order of the column `anchor`. Needs
    /// --cable-zero.
    #[arg(long, value_name = "X,Y,Z", allow_hyphen_values = true)]
    outlet: Vec<String>,
    /// Zero offset of a cable: reading minus free length (mm). Once per cable.
    #[arg(long, value_name = "MM", allow_hyphen_values = true)]
    cable_zero: Vec<String>,
    /// Measured point (hook, reflector, target) on the flange: x,y,z (mm) or x,y,z,qw,qx,qy,qz. Given alone, it is the starting value of
    /// the fit, and the value that is kept if the poses do not determine it (one orientation of the flange). Default: the flange.
    #[arg(long, value_name = "X,Y,Z[,Q…]", allow_hyphen_values = true)]
    touched_point: Option<String>,
}

/// Prior of a fit on the stated frames.
#[derive(Debug, Clone, Default, Args)]
pub(super) struct FramePriorArguments {
    /// Uncertainty of --sensor-frame, or of --outlet and --cable-zero: standard deviation in mm and, for the rotation of a frame, in
    /// degrees (default: that of the mm at one metre). The fit then uses them as a prior, so that the placement of a path can be
    /// corrected.
    #[arg(long, value_name = "MM[,DEG]", allow_hyphen_values = true)]
    frame_sigma: Option<String>,
    /// Uncertainty of --touched-point: standard deviation in mm and, for the rotation of a target whose pose is measured, in degrees (default:
    /// unknown). Default: 50 mm, the same as for a point that is not stated.
    #[arg(long, value_name = "MM[,DEG]", allow_hyphen_values = true, requires = "touched_point")]
    touched_sigma: Option<String>,
}

/// Standard deviations of a stated frame (mm, rad). Without an angle 1 mm at a distance of 1 m.
fn frame_sigma(text: &str) -> anyhow::Result<[f64; 2]> {
    let (mm, deg) = match numbers("--frame-sigma", text)?[..] {
        [mm] => (mm, (mm * 1e-3).to_degrees()),
        [mm, deg] => (mm, deg),
        _ => bail!("--frame-sigma {text}: expected MM or MM,DEG"),
    };
    if !(mm > 0.0 && deg > 0.0) {
        bail!("--frame-sigma {text}: expected numbers above 0");
    }
    Ok([mm, deg.to_radians()])
}

/// Standard deviations of a stated target (mm, rad); no angle where none is stated.
fn touched_sigma(text: &str) -> anyhow::Result<(f64, Option<f64>)> {
    let (mm, deg) = match numbers("--touched-sigma", text)?[..] {
        [mm] => (mm, None),
        [mm, deg] => (mm, Some(deg)),
        _ => bail!("--touched-sigma {text}: expected MM or MM,DEG"),
    };
    if !(mm > 0.0) {
        bail!("--touched-sigma {text}: expected a length above 0 in mm");
    }
    if deg.is_some_and(|deg| !(deg > 0.0)) {
        bail!("--touched-sigma {text}: expected an angle above 0 in degrees");
    }
    Ok((mm, deg.map(f64::to_radians)))
}

impl StatedFrameArguments {
    /// Whether the place of a tracker or camera is stated.
    pub(super) fn states_sensor_frame(&self) -> bool {
        self.sensor_frame.is_some()
    }

    /// What is stated, without its uncertainty.
    ///
    /// # Errors
    /// Names the option that is no point, pose or length.
    pub(super) fn placement(&self) -> anyhow::Result<StatedPlacement> {
        let outlet = |text: &String| triple("--outlet", text).map(Vector3::from);
        Ok(StatedPlacement {
            sensor_frame: self
                .sensor_frame
                .as_deref()
                .map(|text| pose("--sensor-frame", text))
                .transpose()?,
            outlets_mm: self.outlet.iter().map(outlet).collect::<anyhow::Result<_>>()?,
            zeros_mm: self.cable_zero.iter().map(|text| cable_zero(text)).collect::<anyhow::Result<_>>()?,
            touched: self.touched_point.as_deref().map(|text| pose("--touched-point", text)).transpose()?,
            ..StatedPlacement::default()
        })
    }

    /// [`Self::placement`] with the uncertainty of each.
    ///
    /// # Errors
    /// As there.
    pub(super) fn prior(&self, sigmas: &FramePriorArguments) -> anyhow::Result<StatedPlacement> {
        let touched_sigma = sigmas.touched_sigma.as_deref().map(touched_sigma).transpose()?;
        Ok(StatedPlacement {
            frame_sigma: sigmas.frame_sigma.as_deref().map(frame_sigma).transpose()?,
            touched_sigma_mm: touched_sigma.map(|(mm, _)| mm),
            touched_sigma_rad: touched_sigma.and_then(|(_, rad)| rad),
            ..self.placement()?
        })
    }
}

fn cable_zero(text: &str) -> anyhow::Result<f64> {
    match numbers("--cable-zero", text)?[..] {
        [value] => Ok(value),
        _ => bail!("--cable-zero {text}: expected one number (mm)"),
    }
}

/// Numbers separated by commas.
pub(super) fn numbers(option: &str, text: &str) -> anyhow::Result<Vec<f64>> {
    text.split(',')
        .map(|cell| match cell.trim().parse::<f64>() {
            Ok(value) if value.is_finite() => Ok(value),
            _ => Err(anyhow!(
                "{option} {text}: `{}` is not a number; expected numbers with a comma between them, such as 40,0,60",
                cell.trim()
            )),
        })
        .collect()
}

pub(super) fn triple(option: &str, text: &str) -> anyhow::Result<[f64; 3]> {
    let values = numbers(option, text)?;
    <[f64; 3]>::try_from(values.as_slice())
        .map_err(|_| anyhow!("{option} {text}: {} numbers, expected x,y,z (mm)", values.len()))
}

fn pose(option: &str, text: &str) -> anyhow::Result<Pose> {
    let values = numbers(option, text)?;
    match values[..] {
        [x, y, z] => Ok(Pose::translation(x, y, z)),
        [x, y, z, qw, qx, qy, qz] => {
            let quaternion = Quaternion::new(qw, qx, qy, qz);
            let length = quaternion.norm();
            if (length - 1.0).abs() > 0.01 {
                bail!(
                    "{option} {text}: the quaternion has length {length:.3}, expected 1 (order w, x, y, z)"
                );
            }
            Ok(Pose::from_parts(Vector3::new(x, y, z).into(), UnitQuaternion::from_quaternion(quaternion)))
        }
        _ => bail!("{option} {text}: {} numbers, expected x,y,z or x,y,z,qw,qx,qy,qz", values.len()),
    }
}
