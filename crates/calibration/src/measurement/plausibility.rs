//! Plausibility of a file's units, angle convention and quaternion order, tested against the nominal arm.
//!
//! Method: the nominal arm is registered to the sensor (and to the controller's read-out, if logged) under every combination
//! of {degrees, radians} × {mm, m, inch, cm} × {logged, DH angles} × {scalar first, scalar last, inverted}. The residual is
//! taken relative to the travel of the flange under that interpretation, since in a wrong unit the arm hardly moves. A data
//! sheet is accurate to some tenths of a percent, a wrong unit to tens of percent: an interpretation that fits ten times
//! better than the stated one is reported.
//!
//! Shapes: up to 120 evenly spaced rows. Stopping rule: closed forms and [`registration`]. Source: none. A hook, reflector
//! or tool of unknown position is fitted too, so that its offset is not mistaken for a wrong unit.
//! Checked against simulated files in every wrong unit, and against real files.

use std::fmt;

use nalgebra::{Quaternion, UnitQuaternion, Vector3};

use super::convention::AngleConvention;
use super::dataset::{Dataset, Reading, Row};
use super::registration;
use truegrind_arm::condition::Condition;
use truegrind_arm::model::Model;
use truegrind_math::se3::Pose;
use truegrind_math::statistics::median;

/// Factor by which another interpretation must fit better.
const MARGIN: f64 = 10.0;
/// Relative residual up to which the stated interpretation is accepted: no wrong unit fits so well.
const ACCEPTED_SHARE: f64 = 0.01;
/// Relative residual above which another interpretation explains nothing.
const USELESS_SHARE: f64 = 0.1;
/// Most rows that are used.
const ROWS: usize = 120;
/// Lever arm that converts an orientation error to a position error [mm/rad].
const LEVER_MM: f64 = 300.0;

/// Unit of the file's angles.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
#[non_exhaustive]
pub enum AngleUnit {
    /// As the format says.
    Degrees,
    /// Radians.
    Radians,
}

/// Unit of the file's lengths.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
#[non_exhaustive]
pub enum LengthUnit {
    /// As the format says.
    Millimetres,
    /// Metres.
    Metres,
    /// Inches.
    Inches,
    /// Centimetres.
    Centimetres,
}

impl LengthUnit {
    /// The unit in mm.
    pub fn millimetres(self) -> f64 {
        match self {
            LengthUnit::Millimetres => 1.0,
            LengthUnit::Metres => 1000.0,
            LengthUnit::Inches => 25.4,
            LengthUnit::Centimetres => 10.0,
        }
    }
}

/// Interpretation of the four numbers of an orientation.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
#[non_exhaustive]
pub enum Orientation {
    /// Scalar first, target in the sensor's frame, as the format says.
    ScalarFirst,
    /// Scalar in the last column.
    ScalarLast,
    /// Orientation of the sensor in the target's frame.
    Inverted,
}

/// One interpretation of a file.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Interpretation {
    /// Unit of q1 to q6.
    pub angles: AngleUnit,
    /// Unit of the sensor's (or read-out's) lengths.
    pub lengths: LengthUnit,
    /// Convention of the angles.
    pub convention: AngleConvention,
    /// Quaternion order; of full poses only.
    pub orientation: Orientation,
}

/// The readings that were compared with the nominal arm.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum ComparedReading {
    /// The sensor's readings.
    Sensor,
    /// The controller's Cartesian read-out.
    Readout,
}

/// Another interpretation of the file fits an order of magnitude better than the stated one.
#[derive(Debug, Clone, PartialEq)]
pub struct UnitSuspicion {
    /// The file.
    pub file: String,
    /// Readings that were compared with the arm.
    pub compared: ComparedReading,
    /// The interpretation stated by format and caller.
    pub stated: Interpretation,
    /// The interpretation that fits.
    pub likely: Interpretation,
    /// Residual of the registered nominal arm under the stated interpretation.
    pub stated_error: InterpretationError,
    /// Residual under the likely interpretation.
    pub likely_error: InterpretationError,
}

/// Residual of an interpretation.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct InterpretationError {
    /// Root mean square residual of the registered nominal arm (mm).
    pub rmse_mm: f64,
    /// The residual relative to the flange's travel, its root mean square distance from its mean position.
    pub share: f64,
}

/// Interpretations of a file that fit the nominal arm far better than the stated one: at most one for the sensor and
/// one for the read-out. `data` holds the file's angles as read, before any [`AngleConvention::apply`]; `stated` is their
/// assumed convention.
///
/// Empty for a plausible file, and for one with too few rows to decide.
///
/// ```
/// use truegrind_arm::robots;
/// use truegrind_calibration::measurement::convention::AngleConvention;
/// use truegrind_calibration::measurement::import::{Options, read};
/// use truegrind_calibration::measurement::plausibility::{LengthUnit, plausibility};
///
/// // A tracker that wrote inches where mm are expected. (Metres are so few that the import refuses them.)
/// let arm = robots::load("abb-irb-120")?.model;
/// let rows: String = (0..30)
///     .map(|k| {
///         let k = f64::from(k);
///         let degrees = [(70.0, 1.3), (40.0, 2.1), (30.0, 0.7), (80.0, 1.9), (60.0, 2.7), (90.0, 0.4)]
///             .map(|(most, pace): (f64, f64)| most * (pace * k + most).sin());
///         let flange = arm.forward(&degrees.map(f64::to_radians).into(), &Default::default()).translation.vector;
///         let read = flange / 25.4;
///         let [q1, q2, q3, q4, q5, q6] = degrees;
///         format!("{q1},{q2},{q3},{q4},{q5},{q6},{},{},{}\n", read.x, read.y, read.z)
///     })
///     .collect();
/// let csv = format!("q1,q2,q3,q4,q5,q6,measured_x,measured_y,measured_z\n{rows}");
/// let data = read("tracker.csv", csv.as_bytes(), &Options::default())?;
/// let found = plausibility(&data, &arm, AngleConvention::Logged);
/// assert_eq!(found.len(), 1);
/// assert_eq!(found[0].likely.lengths, LengthUnit::Inches);
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
pub fn plausibility(data: &Dataset, model: &Model, stated: AngleConvention) -> Vec<UnitSuspicion> {
    let stride = data.rows.len().div_ceil(ROWS).max(1);
    let rows: Vec<&Row> = data.rows.iter().step_by(stride).collect();
    let sensor = [ComparedReading::Sensor, ComparedReading::Readout];
    sensor.into_iter().filter_map(|compared| suspicion(data, &rows, model, stated, compared)).collect()
}

fn suspicion(
    data: &Dataset,
    rows: &[&Row],
    model: &Model,
    convention: AngleConvention,
    compared: ComparedReading,
) -> Option<UnitSuspicion> {
    let stated = Interpretation {
        angles: AngleUnit::Degrees,
        lengths: LengthUnit::Millimetres,
        convention,
        orientation: Orientation::ScalarFirst,
    };
    let stated_error = interpretation_error(rows, model, &stated, compared)?;
    if stated_error.share <= ACCEPTED_SHARE {
        return None;
    }
    let poses = compared == ComparedReading::Sensor && matches!(rows.first()?.reading, Reading::Pose(_));
    let orientations: &[Orientation] = if poses {
        &[Orientation::ScalarFirst, Orientation::ScalarLast, Orientation::Inverted]
    } else {
        &[Orientation::ScalarFirst]
    };
    let mut others = Vec::new();
    for angles in [AngleUnit::Degrees, AngleUnit::Radians] {
        for convention in [convention, convention.other()] {
            for lengths in
                [LengthUnit::Millimetres, LengthUnit::Metres, LengthUnit::Inches, LengthUnit::Centimetres]
            {
                for &orientation in orientations {
                    let interpretation = Interpretation { angles, lengths, convention, orientation };
                    let fits = interpretation_error(rows, model, &interpretation, compared)
                        .filter(|e| e.share.is_finite());
                    others.extend(fits.filter(|_| interpretation != stated).map(|e| (interpretation, e)));
                }
            }
        }
    }
    let lowest = others.iter().map(|(_, e)| e.share).fold(f64::INFINITY, f64::min);
    // Of interpretations that fit about equally well, the nearest to the stated one.
    let (likely, likely_error) =
        others.into_iter().filter(|(_, e)| e.share <= 2.0 * lowest).min_by(|a, b| {
            a.0.changes(&stated).cmp(&b.0.changes(&stated)).then(a.1.share.total_cmp(&b.1.share))
        })?;
    // An arm that does not move under the stated interpretation has an infinite relative residual.
    let better = likely_error.share * MARGIN < stated_error.share;
    (better && likely_error.share < USELESS_SHARE).then(|| UnitSuspicion {
        file: data.file.clone(),
        compared,
        stated,
        likely,
        stated_error,
        likely_error,
    })
}

/// Residual of the registered nominal arm under an interpretation; `None` for too few rows.
fn interpretation_error(
    rows: &[&Row],
    model: &Model,
    interpretation: &Interpretation,
    compared: ComparedReading,
) -> Option<InterpretationError> {
    let arm = model.at_condition(&Condition::default());
    let scale = interpretation.lengths.millimetres();
    let (mut flanges, mut lengths, mut positions, mut poses) =
        (Vec::new(), Vec::new(), Vec::new(), Vec::new());
    for row in rows {
        if compared == ComparedReading::Readout && row.readout_mm().is_none() {
            continue;
        }
        let file = match interpretation.angles {
            AngleUnit::Degrees => row.joints,
            // The import converted the numbers from degrees.
            AngleUnit::Radians => row.joints.map(f64::to_degrees),
        };
        flanges.push(arm.forward(&interpretation.convention.controller_angles(model, &file)?));
        match (compared, &row.reading, row.readout_mm()) {
            (ComparedReading::Readout, _, Some(p)) => positions.push(p * scale),
            (_, Reading::Cable(l), _) => lengths.push(l * scale),
            (_, Reading::Position(p), _) => positions.push(p * scale),
            (_, Reading::Pose(pose), _) => poses.push(interpretation.orientation.of(pose, scale)),
        }
    }
    let mean =
        flanges.iter().map(|f| f.translation.vector).sum::<Vector3<f64>>() / flanges.len().max(1) as f64;
    let square: f64 = flanges.iter().map(|f| (f.translation.vector - mean).norm_squared()).sum();
    let travel = (square / flanges.len().max(1) as f64).sqrt();
    let of = |rmse_mm: f64| Some(InterpretationError { rmse_mm, share: rmse_mm / travel });
    // At least twice as many readings as unknowns.
    if !poses.is_empty() {
        let fit = registration::poses(&flanges, &poses).filter(|_| poses.len() >= 4)?;
        return of(fit.rmse_mm.hypot(LEVER_MM * fit.rmse_rad));
    }
    if !positions.is_empty() {
        let fit = registration::target_point(&flanges, &positions).filter(|_| positions.len() >= 6)?;
        return of(fit.rmse_mm);
    }
    // Several outlets: each on its own rows; most files have one.
    let mut anchors: Vec<usize> = rows.iter().map(|r| r.anchor).collect();
    anchors.sort_unstable();
    anchors.dedup();
    let (mut square, mut count) = (0.0, 0);
    for anchor in anchors {
        let at_outlet = |i: &usize| rows[*i].anchor == anchor;
        let indices: Vec<usize> = (0..lengths.len()).filter(at_outlet).collect();
        if indices.len() < 14 {
            continue;
        }
        let own: Vec<Pose> = indices.iter().map(|&i| flanges[i]).collect();
        let read: Vec<f64> = indices.iter().map(|&i| lengths[i]).collect();
        let (fit, _) = registration::cable_and_hook(&own, &read)?;
        square += fit.rmse_mm.powi(2) * read.len() as f64;
        count += read.len();
    }
    if count == 0 { None } else { of((square / count as f64).sqrt()) }
}

/// Median time between rows above which column `t` is not in hours (h).
const LONG_INTERVAL_H: f64 = 1.0;

/// Why column `t` is probably in another unit than hours; `None` for a plausible clock.
pub fn implausible_time(data: &Dataset) -> Option<String> {
    let mut times: Vec<f64> = data.rows.iter().filter_map(|row| row.condition.time_h).collect();
    times.sort_by(f64::total_cmp);
    let intervals: Vec<f64> = times.windows(2).map(|pair| pair[1] - pair[0]).collect();
    let usual = median(&intervals).filter(|hours| *hours > LONG_INTERVAL_H)?;
    Some(format!(
        "{}: column t is in hours, so half of the rows were measured more than {usual:.1} h after the one before: if it is in seconds, divide \
         it by 3600, and if it is in minutes, by 60",
        data.file
    ))
}

/// Warmest plausible arm [°C].
const WARMEST_C: f64 = 60.0;
/// Mean above which a temperature is not in °F either.
const HOTTEST_F: f64 = 140.0;

/// Why column `temperature` is probably in another unit than °C; `None` for a plausible one.
pub fn implausible_temperature(data: &Dataset) -> Option<String> {
    let known: Vec<f64> = data.rows.iter().filter_map(|row| row.condition.temperature_c).collect();
    let usual = median(&known).filter(|temperature| *temperature > WARMEST_C)?;
    let likely = if usual > HOTTEST_F {
        "kelvin: subtract 273.15"
    } else {
        "degrees Fahrenheit: subtract 32 and divide by 1.8"
    };
    Some(format!(
        "{}: the arm is at {usual:.1} °C in half of the rows: column temperature looks like {likely}",
        data.file
    ))
}

/// Multiple of the rated payload that no arm carries while it is measured.
const IMPLAUSIBLE_LOAD: f64 = 10.0;

/// A logged payload that the arm cannot carry.
#[derive(Debug, Clone, PartialEq)]
pub struct PayloadSuspicion {
    /// The file.
    pub file: String,
    /// Its first such row, as the data set numbers them.
    pub row: usize,
    /// The payload there (kg, as the format says).
    pub payload_kg: f64,
    /// The rated payload of the arm (kg).
    pub rated_kg: f64,
}

/// The first payload far above the rated one: the column is in another unit.
pub fn implausible_payload(data: &Dataset, rated_kg: f64) -> Option<PayloadSuspicion> {
    data.rows.iter().find_map(|row| {
        let payload_kg = row.condition.payload_kg.filter(|kg| *kg > IMPLAUSIBLE_LOAD * rated_kg)?;
        Some(PayloadSuspicion { file: data.file.clone(), row: row.number, payload_kg, rated_kg })
    })
}

impl fmt::Display for PayloadSuspicion {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { file, row, payload_kg, rated_kg } = self;
        write!(
            f,
            "{file}: row {row}: a payload of {payload_kg} kg, but the arm is rated for {rated_kg} kg; "
        )?;
        if payload_kg / 1000.0 <= IMPLAUSIBLE_LOAD * rated_kg {
            write!(f, "the column looks like grams: divide it by 1000")
        } else {
            write!(f, "state the mass at the flange in kg")
        }
    }
}

impl Orientation {
    /// The pose under this quaternion order, from one that was read scalar first.
    fn of(self, pose: &Pose, scale: f64) -> Pose {
        let q = pose.rotation;
        let rotation = match self {
            Orientation::ScalarFirst => q,
            Orientation::ScalarLast => UnitQuaternion::from_quaternion(Quaternion::new(q.k, q.w, q.i, q.j)),
            Orientation::Inverted => q.inverse(),
        };
        Pose::from_parts(Vector3::from(pose.translation.vector * scale).into(), rotation)
    }
}

impl Interpretation {
    fn changes(&self, other: &Interpretation) -> usize {
        usize::from(self.angles != other.angles)
            + usize::from(self.lengths != other.lengths)
            + usize::from(self.convention != other.convention)
            + usize::from(self.orientation != other.orientation)
    }
}

impl UnitSuspicion {
    /// Pairs of a difference and its remedy.
    pub fn differences(&self) -> Vec<(&'static str, &'static str)> {
        let mut out = Vec::new();
        let (stated, likely) = (&self.stated, &self.likely);
        if stated.angles != likely.angles {
            out.push(("q1 to q6 look like radians", "convert the angles to degrees"));
        }
        if stated.lengths != likely.lengths {
            out.push(match (likely.lengths, self.compared) {
                (LengthUnit::Metres, ComparedReading::Sensor) => {
                    ("the sensor's lengths look like metres", "multiply them by 1000")
                }
                (LengthUnit::Inches, ComparedReading::Sensor) => {
                    ("the sensor's lengths look like inches", "multiply them by 25.4")
                }
                (LengthUnit::Centimetres, ComparedReading::Sensor) => {
                    ("the sensor's lengths look like centimetres", "multiply them by 10")
                }
                (LengthUnit::Metres, ComparedReading::Readout) => {
                    ("the read-out x, y, z looks like metres", "multiply it by 1000")
                }
                (LengthUnit::Inches, ComparedReading::Readout) => {
                    ("the read-out x, y, z looks like inches", "multiply it by 25.4")
                }
                (_, _) => ("the read-out x, y, z looks like centimetres", "multiply it by 10"),
            });
        }
        if stated.convention != likely.convention {
            out.push(match likely.convention {
                AngleConvention::Dh => {
                    ("q1 to q6 look like DH angles, offsets included", "read the file with --angles dh")
                }
                AngleConvention::Logged => {
                    ("q1 to q6 look like the controller's own angles", "read the file with --angles logged")
                }
            });
        }
        if stated.orientation != likely.orientation {
            out.push(match likely.orientation {
                Orientation::Inverted => (
                    "the quaternions look inverted (sensor in the target's frame)",
                    "write measured_qw to measured_qz as the target's orientation in the sensor's frame",
                ),
                _ => (
                    "the quaternions look scalar-last",
                    "put the scalar into measured_qw and the vector into measured_qx to measured_qz",
                ),
            });
        }
        out
    }
}

impl fmt::Display for UnitSuspicion {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let (what, remedies): (Vec<_>, Vec<_>) = self.differences().into_iter().unzip();
        let compared = match self.compared {
            ComparedReading::Sensor => "the sensor",
            ComparedReading::Readout => "the controller's read-out",
        };
        write!(
            f,
            "{}: {}: read that way, the nominal arm agrees with {compared} to {:.1} mm ({:.1} % of its travel), but as \
             stated only to {:.1} mm ({:.0} %); {}",
            self.file,
            what.join(" and "),
            self.likely_error.rmse_mm,
            100.0 * self.likely_error.share,
            self.stated_error.rmse_mm,
            100.0 * self.stated_error.share,
            remedies.join(" and ")
        )
    }
}
