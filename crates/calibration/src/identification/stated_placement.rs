//! What is known of sensor and target by other means: a frame, an outlet, a touched point, and how well each is known. It gives the frames of
//! the raw error and of an acceptance, and the prior of a fit.
//!
//! Messages name the options of the command line.

use nalgebra::{UnitQuaternion, Vector3};
use thiserror::Error;

use super::calibration::Frames;
use super::stated_frame::{
    beside, contradicted_target, contradiction, contradiction_beside_geometry, judged_by_fit,
    target_contradiction_by_fit, with_touched_point,
};
use super::tolerance::Tolerance;
use crate::measurement::dataset::{Dataset, Sensor};
use crate::measurement::stations;
use truegrind_arm::model::Model;
use truegrind_math::se3::Pose;

/// Why a stated placement cannot be used: it does not belong to the sensor, or the readings contradict it.
#[derive(Debug, Clone, PartialEq, Eq, Error)]
#[error("{0}")]
pub struct PlacementError(pub String);

fn refused<T>(message: impl Into<String>) -> Result<T, PlacementError> {
    Err(PlacementError(message.into()))
}

/// Uncertainty of a frame or point whose own is not stated, to judge it (mm).
const UNSTATED_MM: f64 = 0.5;

/// Sensor and target as stated; all of it may be absent.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct StatedPlacement {
    /// Frame of a position or pose sensor in the robot base; of several stations that of the first row.
    pub sensor_frame: Option<Pose>,
    /// Outlets of the cables in the robot base (mm).
    pub outlets_mm: Vec<Vector3<f64>>,
    /// Their zeros: reading minus free length (mm).
    pub zeros_mm: Vec<f64>,
    /// The measured point on the flange.
    pub touched: Option<Pose>,
    /// Standard deviations (mm, rad) of the frame, or of outlets and zeros; without them the fit takes no prior from these.
    pub frame_sigma: Option<[f64; 2]>,
    /// Standard deviation of the measured point (mm).
    pub touched_sigma_mm: Option<f64>,
    /// Standard deviation of its rotation (rad), where poses are measured; without it the rotation is a starting value.
    pub touched_sigma_rad: Option<f64>,
}

/// What the frames must match.
struct Measured<'a> {
    file: &'a str,
    sensor: Sensor,
    anchors: usize,
}

impl StatedPlacement {
    fn states_cable(&self) -> bool {
        !self.outlets_mm.is_empty() || !self.zeros_mm.is_empty()
    }

    fn states_place(&self) -> bool {
        self.sensor_frame.is_some() || self.states_cable()
    }

    /// The stated frames, if any.
    ///
    /// # Errors
    /// They do not match the sensor of the data.
    pub fn frames(&self, dataset: &Dataset) -> Result<Option<Frames>, PlacementError> {
        let measured = Measured { file: &dataset.file, sensor: dataset.sensor, anchors: dataset.anchors() };
        let disturbances = stations::disturbances(dataset.stations());
        Ok(self.frames_of(&measured)?.map(|frames| Frames { disturbances, ..frames }))
    }

    /// The frames of an acceptance: sensor and target together, or neither, since the placement is tested with both.
    ///
    /// # Errors
    /// One of them is missing, or they do not match the sensor of the data.
    pub fn frames_of_both(&self, dataset: &Dataset) -> Result<Option<Frames>, PlacementError> {
        if self.touched.is_some() && !self.states_place() {
            return refused("--touched-point needs --sensor-frame, or --outlet and --cable-zero");
        }
        if self.states_place() && self.touched.is_none() {
            let option =
                if self.sensor_frame.is_some() { "--sensor-frame" } else { "--outlet and --cable-zero" };
            return refused(format!(
                "--touched-point is missing: {option} tests where base and flange are, together with where the target sits on the flange \
                 (--touched-point 0,0,0 at its centre)"
            ));
        }
        self.frames(dataset)
    }

    /// The frames of a planned measurement. A tracker may stand anywhere; a cable needs its outlet, and is read from 0 by default.
    ///
    /// # Errors
    /// The outlet of a cable is missing, or what is stated belongs to another sensor.
    pub fn planned(&self, sensor: Sensor) -> Result<Frames, PlacementError> {
        let anchors = self.outlets_mm.len().max(1);
        let mut whole = self.clone();
        if sensor == Sensor::Cable {
            if self.outlets_mm.is_empty() {
                return refused(
                    "--outlet X,Y,Z is missing: the position of the cable outlet in the robot base (mm)",
                );
            }
            if self.zeros_mm.is_empty() {
                whole.zeros_mm = vec![0.0; anchors];
            }
        } else {
            whole.sensor_frame.get_or_insert(Pose::identity());
        }
        let found = whole.frames_of(&Measured { file: "the plan", sensor, anchors })?;
        found.map_or_else(|| refused("no frames are stated"), Ok)
    }

    fn frames_of(&self, measured: &Measured<'_>) -> Result<Option<Frames>, PlacementError> {
        if !self.states_place() {
            return Ok(None);
        }
        let anchors = measured.anchors;
        let mut frames = Frames::at_origin(anchors);
        if let Some(touched) = self.touched {
            frames.flange_from_target = touched;
        }
        if measured.sensor == Sensor::Cable {
            if self.sensor_frame.is_some() {
                return refused(format!(
                    "--sensor-frame: {} contains cable lengths, whose sensor has no frame: use --outlet and \
                     --cable-zero",
                    measured.file
                ));
            }
            for (name, found) in [("--outlet", self.outlets_mm.len()), ("--cable-zero", self.zeros_mm.len())]
            {
                if found != anchors {
                    return refused(format!(
                        "{name}: given {found} times, expected once for each of the {anchors} cables of {}",
                        measured.file
                    ));
                }
            }
            frames.outlets_mm.clone_from(&self.outlets_mm);
            frames.zeros_mm.clone_from(&self.zeros_mm);
            return Ok(Some(frames));
        }
        if self.states_cable() {
            return refused(format!(
                "--outlet and --cable-zero: {} contains {} and no cable lengths: use --sensor-frame",
                measured.file,
                if measured.sensor == Sensor::Pose { "poses" } else { "positions" }
            ));
        }
        if let Some(frame) = self.sensor_frame {
            frames.base_from_sensor = frame;
        }
        Ok(Some(frames))
    }

    /// Tolerance and starting frames of a fit. `found`: the start from the readings, whose measured point is kept unless one is stated.
    /// `of_arm`: the tolerances of arms, beside which the stated frames are judged.
    ///
    /// # Errors
    /// The readings contradict what is stated, or its uncertainty is stated without it.
    pub fn prior(
        &self,
        [tolerance, of_arm]: [&Tolerance; 2],
        found: Frames,
        (dataset, nominal): (&Dataset, &Model),
    ) -> Result<(Tolerance, Frames), PlacementError> {
        let stated = self.frames(dataset)?;
        let stated = stated.as_ref();
        let touched = self.touched;
        let mut tolerance = *tolerance;
        if let Some(mm) = self.touched_sigma_mm {
            if touched.is_none() {
                return refused("--touched-sigma needs --touched-point");
            }
            tolerance.target_mm = mm;
        }
        if self.touched_sigma_rad.is_some() && self.touched_sigma_mm.is_none() {
            return refused("--touched-sigma: expected MM,DEG, and not DEG alone");
        }
        let turned = touched.zip(self.touched_sigma_rad);
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
            && (stated.is_none() || self.touched_sigma_mm.is_some())
            && contradicted_target(dataset, nominal, touched, self.touched_sigma_mm.unwrap_or(0.0), &found)
                .is_some()
        {
            // The arm of the data sheet alone refuses nothing.
            let sigma_mm = self.touched_sigma_mm.unwrap_or(UNSTATED_MM);
            let judged = target_contradiction_by_fit(of_arm, touched, sigma_mm, &found, (dataset, nominal));
            judged.map_or(Ok(()), refused)?;
        }
        let Some(sigma @ [mm, rad]) = self.frame_sigma else {
            if let Some(stated) = stated
                && let Some(contradiction) = contradiction(dataset, nominal, stated, &found, 0.0)
            {
                let sigma = [UNSTATED_MM, UNSTATED_MM * 1e-3];
                let stated = Frames { flange_from_target: target(touched, &found), ..stated.clone() };
                let (judged, _) =
                    judged_by_fit([&tolerance, of_arm], (&stated, &found), sigma, (dataset, nominal));
                if judged != Some(None) {
                    return refused(contradiction);
                }
            }
            let begins_there = stated.is_none() || self.touched_sigma_mm.is_some();
            let frames = match touched.filter(|_| begins_there) {
                Some(touched) => with_touched_point(dataset, nominal, &touched, found),
                None => found,
            };
            return Ok((tolerance, in_stated_turn(frames)));
        };
        let Some(stated) = stated else {
            return refused("--frame-sigma needs --sensor-frame, or --outlet and --cable-zero");
        };
        let frames = in_stated_turn(Frames { flange_from_target: target(touched, &found), ..stated.clone() });
        let (judged, geometry) =
            judged_by_fit([&tolerance, of_arm], (&frames, &found), sigma, (dataset, nominal));
        // The arm of the data sheet alone refuses nothing, but may say what is wrong with the frame.
        let beside_nominal = contradiction(dataset, nominal, stated, &found, mm);
        if judged != Some(None)
            && let Some(contradiction) = beside_nominal
        {
            return refused(contradiction);
        }
        if let Some(geometry) = geometry
            && let Some(contradiction) =
                contradiction_beside_geometry(dataset, geometry, stated, sigma, of_arm.scale)
        {
            return refused(contradiction);
        }
        if let Some(Some(contradiction)) = judged {
            return refused(contradiction);
        }
        Ok((Tolerance { frame_mm: mm, frame_rad: rad, ..tolerance }, frames))
    }
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
) -> Result<(), PlacementError> {
    if dataset.sensor != Sensor::Pose {
        return refused(format!(
            "--touched-sigma: {} shows no orientation of the target: expected MM alone, without DEG",
            dataset.file
        ));
    }
    let off_rad = touched.rotation.angle_to(&found.flange_from_target.rotation);
    if off_rad > TURN_SIGMAS * sigma_rad.hypot(6.0_f64.sqrt() * of_arm.zero_rad) {
        let q = found.flange_from_target.rotation.quaternion();
        return refused(format!(
            "--touched-point: the readings turn the target {:.1}° from there, to {:.4},{:.4},{:.4},{:.4} (w, x, y, z) on the flange: check its rotation, or \
             state none (--touched-sigma MM)",
            off_rad.to_degrees(),
            q.w,
            q.i,
            q.j,
            q.k
        ));
    }
    Ok(())
}

/// The target on the flange: where it was touched, turned as the readings say where no rotation was stated; otherwise where they put it.
fn target(touched: Option<Pose>, found: &Frames) -> Pose {
    let Some(touched) = touched else { return found.flange_from_target };
    let is_turned = touched.rotation != UnitQuaternion::identity();
    let rotation = if is_turned { touched.rotation } else { found.flange_from_target.rotation };
    Pose::from_parts(touched.translation, rotation)
}
