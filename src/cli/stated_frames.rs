//! Options for sensor frames that were measured by other means. With them the raw error of a data set is defined.

use anyhow::{anyhow, bail};
use clap::Args;
use nalgebra::{Quaternion, UnitQuaternion, Vector3};
use truegrind::arm::model::Model;
use truegrind::calibration::identification::calibration::Frames;
use truegrind::calibration::identification::stated_frame::{
    beside, contradicted_target, contradiction, contradiction_beside_geometry, judged_by_fit,
    target_contradiction_by_fit, with_touched_point,
};
use truegrind::calibration::identification::tolerance::Tolerance;
use truegrind::calibration::measurement::dataset::{Dataset, Sensor};
use truegrind::calibration::measurement::stations;
use truegrind::math::se3::Pose;

/// Pose of the sensor, if known. Without [`FramePriorArguments`] it serves for the raw error only, and the fit determines the
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

impl FramePriorArguments {
    /// Prior tolerance and starting frames of the fit. The measured point is that of `found` unless it was stated. `of_arm`: the tolerances
    /// of arms, beside which the stated frames are judged.
    pub(super) fn prior(
        &self,
        [tolerance, of_arm]: [&Tolerance; 2],
        stated: Stated<'_>,
        found: Frames,
        (dataset, nominal): (&Dataset, &Model),
    ) -> anyhow::Result<(Tolerance, Frames)> {
        let Stated { frames: stated, touched } = stated;
        let mut tolerance = *tolerance;
        let touched_sigma = self.touched_sigma.as_deref().map(touched_sigma).transpose()?;
        let touched_mm = touched_sigma.map(|(mm, _)| mm);
        if let Some(mm) = touched_mm {
            tolerance.target_mm = mm;
        }
        let turned = touched.zip(touched_sigma.and_then(|(_, rad)| rad));
        if let Some((touched, rad)) = turned {
            check_turn(&touched, rad, (of_arm, &found), dataset)?;
            tolerance.target_rad = rad;
        }
        let in_stated_turn = |mut frames: Frames| {
            if let Some((touched, _)) = turned {
                frames.flange_from_target.rotation = touched.rotation;
            }
            frames
        };
        let found = match stated {
            Some(stated) => beside(dataset, nominal, stated, touched.as_ref(), &found),
            None => found,
        };
        if let Some(touched) = &touched
            && (stated.is_none() || touched_mm.is_some())
            && contradicted_target(dataset, nominal, touched, touched_mm.unwrap_or(0.0), &found).is_some()
        {
            // The arm of the data sheet alone refuses nothing.
            let sigma_mm = touched_mm.unwrap_or(UNSTATED_MM);
            let judged = target_contradiction_by_fit(of_arm, touched, sigma_mm, &found, (dataset, nominal));
            if let Some(contradiction) = judged {
                bail!("{contradiction}");
            }
        }
        let Some(text) = &self.frame_sigma else {
            if let Some(stated) = stated
                && let Some(contradiction) = contradiction(dataset, nominal, stated, &found, 0.0)
            {
                let sigma = [UNSTATED_MM, UNSTATED_MM * 1e-3];
                let stated = Frames { flange_from_target: target(touched, &found), ..stated.clone() };
                let (judged, _) =
                    judged_by_fit([&tolerance, of_arm], (&stated, &found), sigma, (dataset, nominal));
                if judged != Some(None) {
                    bail!("{contradiction}");
                }
            }
            let begins_there = stated.is_none() || touched_mm.is_some();
            let frames = match touched.filter(|_| begins_there) {
                Some(touched) => with_touched_point(dataset, nominal, &touched, found),
                None => found,
            };
            return Ok((tolerance, in_stated_turn(frames)));
        };
        let Some(stated) = stated else {
            bail!("--frame-sigma needs --sensor-frame, or --outlet and --cable-zero");
        };
        let sigma @ [mm, rad] = frame_sigma(text)?;
        let frames = in_stated_turn(Frames { flange_from_target: target(touched, &found), ..stated.clone() });
        let (judged, geometry) =
            judged_by_fit([&tolerance, of_arm], (&frames, &found), sigma, (dataset, nominal));
        // The arm of the data sheet alone refuses nothing, but may say what is wrong with the frame.
        let beside_nominal = contradiction(dataset, nominal, stated, &found, mm);
        if judged != Some(None)
            && let Some(contradiction) = beside_nominal
        {
            bail!("{contradiction}");
        }
        if let Some(geometry) = geometry
            && let Some(contradiction) =
                contradiction_beside_geometry(dataset, geometry, stated, sigma, of_arm.scale)
        {
            bail!("{contradiction}");
        }
        if let Some(Some(contradiction)) = judged {
            bail!("{contradiction}");
        }
        Ok((Tolerance { frame_mm: mm, frame_rad: rad, ..tolerance }, frames))
    }
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

/// Standard deviations by which the readings may turn a target otherwise than it is stated.
const TURN_SIGMAS: f64 = 5.0;

/// Refuses the rotation of a target that no measurement shows, or that the readings contradict by more than an arm of these tolerances can be
/// off: that of its six zeros adds up at the flange.
fn check_turn(
    touched: &Pose,
    sigma_rad: f64,
    (of_arm, found): (&Tolerance, &Frames),
    dataset: &Dataset,
) -> anyhow::Result<()> {
    if dataset.sensor != Sensor::Pose {
        bail!(
            "--touched-sigma: {} shows no orientation of the target: expected MM alone, without DEG",
            dataset.file
        );
    }
    let off_rad = touched.rotation.angle_to(&found.flange_from_target.rotation);
    if off_rad > TURN_SIGMAS * sigma_rad.hypot(6.0_f64.sqrt() * of_arm.zero_rad) {
        let q = found.flange_from_target.rotation.quaternion();
        bail!(
            "--touched-point: the readings turn the target {:.1}° from there, to {:.4},{:.4},{:.4},{:.4} (w, x, y, z) on the flange: check its rotation, or \
             state none (--touched-sigma MM)",
            off_rad.to_degrees(),
            q.w,
            q.i,
            q.j,
            q.k
        );
    }
    Ok(())
}

/// Uncertainty of a frame or point whose own is not stated, to judge it (mm).
const UNSTATED_MM: f64 = 0.5;

/// The target on the flange: where it was touched, turned as the readings say where no rotation was stated; otherwise where they put it.
fn target(touched: Option<Pose>, found: &Frames) -> Pose {
    let Some(touched) = touched else { return found.flange_from_target };
    let is_turned = touched.rotation != UnitQuaternion::identity();
    let rotation = if is_turned { touched.rotation } else { found.flange_from_target.rotation };
    Pose::from_parts(touched.translation, rotation)
}

/// What is stated of sensor and target.
#[derive(Debug, Clone, Copy)]
pub(super) struct Stated<'a> {
    /// The frames, where the sensor's place is stated.
    pub(super) frames: Option<&'a Frames>,
    /// The measured point, where it is stated.
    pub(super) touched: Option<Pose>,
}

/// Data set that the frames must match.
struct Measured<'a> {
    file: &'a str,
    sensor: Sensor,
    anchors: usize,
}

impl StatedFrameArguments {
    /// Whether the place of a tracker or camera is stated.
    pub(super) fn states_sensor_frame(&self) -> bool {
        self.sensor_frame.is_some()
    }

    /// The stated frames, if any.
    ///
    /// # Errors
    /// The frames do not match the sensor of the data.
    pub(super) fn frames(&self, dataset: &Dataset) -> anyhow::Result<Option<Frames>> {
        let measured = Measured { file: &dataset.file, sensor: dataset.sensor, anchors: dataset.anchors() };
        let disturbances = stations::disturbances(dataset.stations());
        Ok(self.frames_of(&measured)?.map(|frames| Frames { disturbances, ..frames }))
    }

    /// The stated point on the flange, if any.
    ///
    /// # Errors
    /// It is no point.
    pub(super) fn touched(&self) -> anyhow::Result<Option<Pose>> {
        self.touched_point.as_deref().map(|text| pose("--touched-point", text)).transpose()
    }

    /// Refuses a point that stands alone, where frames are not fitted about it.
    pub(super) fn refuse_point_alone(&self) -> anyhow::Result<()> {
        let placed = self.sensor_frame.is_some() || !self.outlet.is_empty() || !self.cable_zero.is_empty();
        if self.touched_point.is_some() && !placed {
            bail!("--touched-point needs --sensor-frame, or --outlet and --cable-zero");
        }
        Ok(())
    }

    /// Refuses a sensor that is stated without the target, where the placement is tested with both.
    pub(super) fn refuse_frame_alone(&self) -> anyhow::Result<()> {
        let placed = self.sensor_frame.is_some() || !self.outlet.is_empty() || !self.cable_zero.is_empty();
        if placed && self.touched_point.is_none() {
            let option =
                if self.sensor_frame.is_some() { "--sensor-frame" } else { "--outlet and --cable-zero" };
            bail!(
                "--touched-point is missing: {option} tests where base and flange are, together with where the target sits on the flange \
                 (--touched-point 0,0,0 at its centre)"
            );
        }
        Ok(())
    }

    /// The frames of a planned measurement. A tracker may stand anywhere; a cable needs its outlet.
    pub(super) fn planned(&self, sensor: Sensor) -> anyhow::Result<Frames> {
        let anchors = self.outlet.len().max(1);
        if sensor == Sensor::Cable && self.outlet.is_empty() {
            bail!("--outlet X,Y,Z is missing: the position of the cable outlet in the robot base (mm)");
        }
        let zeros = if self.cable_zero.is_empty() && sensor == Sensor::Cable {
            vec!["0".to_owned(); anchors]
        } else {
            self.cable_zero.clone()
        };
        let frame = self.sensor_frame.clone();
        let frame = if sensor == Sensor::Cable { frame } else { frame.or(Some("0,0,0".to_owned())) };
        let whole = Self { cable_zero: zeros, sensor_frame: frame, ..self.clone() };
        let found = whole.frames_of(&Measured { file: "the plan", sensor, anchors })?;
        found.ok_or_else(|| anyhow!("no frames are stated"))
    }

    fn frames_of(&self, dataset: &Measured<'_>) -> anyhow::Result<Option<Frames>> {
        let cable = !self.outlet.is_empty() || !self.cable_zero.is_empty();
        let framed = self.sensor_frame.is_some();
        if !cable && !framed {
            return Ok(None);
        }
        let anchors = dataset.anchors;
        let mut frames = Frames::at_origin(anchors);
        if let Some(text) = &self.touched_point {
            frames.flange_from_target = pose("--touched-point", text)?;
        }
        match dataset.sensor {
            Sensor::Cable => {
                if framed {
                    bail!(
                        "--sensor-frame: {} contains cable lengths, whose sensor has no frame: use --outlet and \
                         --cable-zero",
                        dataset.file
                    );
                }
                for (name, found) in
                    [("--outlet", self.outlet.len()), ("--cable-zero", self.cable_zero.len())]
                {
                    if found != anchors {
                        bail!(
                            "{name}: given {found} times, expected once for each of the {anchors} cables of {}",
                            dataset.file
                        );
                    }
                }
                for (frame_value, text) in frames.outlets_mm.iter_mut().zip(&self.outlet) {
                    *frame_value = Vector3::from(triple("--outlet", text)?);
                }
                for (frame_value, text) in frames.zeros_mm.iter_mut().zip(&self.cable_zero) {
                    let [value] = numbers("--cable-zero", text)?[..] else {
                        bail!("--cable-zero {text}: expected one number (mm)");
                    };
                    *frame_value = value;
                }
            }
            Sensor::Position | Sensor::Pose => {
                if cable {
                    bail!(
                        "--outlet and --cable-zero: {} contains {} and no cable lengths: use --sensor-frame",
                        dataset.file,
                        if dataset.sensor == Sensor::Pose { "poses" } else { "positions" }
                    );
                }
                if let Some(text) = &self.sensor_frame {
                    frames.base_from_sensor = pose("--sensor-frame", text)?;
                }
            }
        }
        Ok(Some(frames))
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
