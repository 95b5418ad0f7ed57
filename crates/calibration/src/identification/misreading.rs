//! Readings that fit no arm: whether they would if two columns were swapped, a joint counted the other way or from another zero, some rows were
//! in another unit, a reading were missing, or each session had its own set-up.
//!
//! Each hypothesis is judged by the closed form for sensor frame and target with the nominal arm, since a wrong file is off by more than any
//! arm's tolerance. Most are of positions, those of measured poses too: a cable's single length fits too much. Of a cable, counts in place of
//! millimetres and readings that fall as it leaves are told, one factor for all lengths, and rows that are shifted.

use nalgebra::{Quaternion, Translation3, UnitQuaternion, Vector3};

use super::cable_factor;
use super::calibration::{CalibrationProblem, Frames, Weight};
use super::fit::{Observations, WRONG_ORIENTATION_RAD, median_orientation_error};
use super::shifted_rows;
use super::start::candidate_frames;
use crate::measurement::dataset::{Dataset, Reading, Sensor};
use crate::measurement::row_list::row_list;
use truegrind_arm::model::{Joints, Model};
use truegrind_math::se3::Pose;
use truegrind_math::sentence::listed;
use truegrind_math::statistics::median;

/// An explanation leaves at most this share of the error.
const SHARE: f64 = 0.1;

/// Fewest rows to which a frame is fitted.
const MIN_ROWS: usize = 8;

/// Rows with which hypotheses on all rows are tried.
const MANY: usize = 200;

const MM_IN_METRE: f64 = 1000.0;

/// The end of a message that readings are of no arm like this: what explains them, or what to check.
pub(crate) fn advice(explanation: Option<&str>) -> String {
    match explanation {
        Some(explanation) => format!(": {explanation}"),
        None => ": check that --robot is the measured arm, that the sensor stayed where it was (a column station names its places, a column anchor numbers the outlets of a cable), that no two \
                 columns are swapped, that lengths are in mm and angles in degrees, that each joint counts in the controller's direction and from its \
                 zero, and try --angles dh"
            .to_owned(),
    }
}

/// What else the readings may be, in a sentence part; `None` where nothing explains them.
pub(crate) fn explanation(dataset: &Dataset, nominal: &Model) -> Option<String> {
    if dataset.sensor == Sensor::Cable {
        return cable_factor::explanation(dataset, nominal)
            .or_else(|| shifted_rows::explanation(dataset, nominal));
    }
    if dataset.rows.len() < 2 * MIN_ROWS {
        return None;
    }
    let (positions, poses) = match dataset.sensor {
        Sensor::Pose => (&of_positions(dataset), Some(dataset)),
        _ => (dataset, None),
    };
    let case = Case { dataset: positions, poses, nominal, most_mm: SHARE * typical_mm(dataset, nominal)? };
    case.sessions()
        .or_else(|| case.mirrored())
        .or_else(|| case.swapped_joints())
        .or_else(|| case.metres())
        .or_else(|| case.radians())
        .or_else(|| case.joint_convention())
        .or_else(|| shifted_rows::explanation(positions, nominal))
        .or_else(|| case.own_orientations())
}

/// The positions of targets whose poses were measured: they alone tell most mistakes, and nothing of the orientations hides those.
fn of_positions(poses: &Dataset) -> Dataset {
    let mut out = Dataset { sensor: Sensor::Position, ..poses.clone() };
    for row in &mut out.rows {
        row.reading = Reading::Position(row.reading.place_mm());
    }
    out
}

fn fitted_frames(dataset: &Dataset, nominal: &Model) -> Option<Frames> {
    candidate_frames(dataset, nominal).ok()?.into_iter().next()
}

/// The size of each row's error.
fn errors_mm(dataset: &Dataset, nominal: &Model, frames: &Frames) -> Vec<f64> {
    let weights = vec![Weight { per_mm: 1.0, per_rad: 1.0 }; dataset.rows.len()];
    CalibrationProblem::new(dataset, nominal, frames, &[], &[], &weights).errors_mm(&[])
}

/// The median error with fitted frames.
fn typical_mm(dataset: &Dataset, nominal: &Model) -> Option<f64> {
    median(&errors_mm(dataset, nominal, &fitted_frames(dataset, nominal)?))
}

/// Whether the orientations of poses are those of the arm.
fn fits_in_orientation(poses: &Dataset, nominal: &Model) -> bool {
    fitted_frames(poses, nominal)
        .and_then(|frames| median_orientation_error(&Observations::logged(poses.clone()), nominal, &frames))
        .is_some_and(|rad| rad < WRONG_ORIENTATION_RAD)
}

/// Poses in the mirror image of their frame: y, and of turns those about x and z, get the other sign.
fn mirrored_poses(poses: &Dataset) -> Dataset {
    let mut out = poses.clone();
    for row in &mut out.rows {
        if let Reading::Pose(pose) = &row.reading {
            let (place, turn) = (pose.translation.vector, pose.rotation.into_inner());
            let turn = UnitQuaternion::from_quaternion(Quaternion::new(turn.w, -turn.i, turn.j, -turn.k));
            let place = Translation3::new(place.x, -place.y, place.z);
            row.reading = Reading::Pose(Box::new(Pose::from_parts(place, turn)));
        }
    }
    out
}

struct Case<'a> {
    /// Rows with positions.
    dataset: &'a Dataset,
    /// The same rows with orientations, where these were measured.
    poses: Option<&'a Dataset>,
    nominal: &'a Model,
    /// Largest median error of rows that fit (mm).
    most_mm: f64,
}

impl Case<'_> {
    fn fits(&self, dataset: &Dataset) -> bool {
        typical_mm(dataset, self.nominal).is_some_and(|mm| mm <= self.most_mm)
    }

    /// Several set-ups in one file, each of which fits by itself.
    fn sessions(&self) -> Option<String> {
        let mut names: Vec<&str> = self.dataset.rows.iter().filter_map(|row| row.session()).collect();
        names.sort_unstable();
        names.dedup();
        let fits = |name: &&str| {
            let rows =
                (0..self.dataset.rows.len()).filter(|row| self.dataset.rows[*row].session() == Some(*name));
            let rows: Vec<usize> = rows.collect();
            rows.len() >= MIN_ROWS && self.fits(&self.dataset.subset(&rows))
        };
        (names.len() > 1 && names.iter().all(fits)).then(|| {
            format!(
                "each session ({}) fits by itself, but sensor or target moved between them: if it was the sensor, copy column session to a \
                 column station; if it was the target, put each session into a file of its own",
                listed(&names)
            )
        })
    }

    /// A mirror image: no motion of the sensor makes one.
    fn mirrored(&self) -> Option<String> {
        let swapped = self.with_readings(|row| {
            let place = self.dataset.rows[row].reading.place_mm();
            Some(Vector3::new(place.y, place.x, place.z))
        });
        self.fits(&swapped).then(|| {
            if self.poses.is_some_and(|poses| fits_in_orientation(&mirrored_poses(poses), self.nominal)) {
                "the readings are a mirror image, positions and orientations alike: they are in a left-handed frame; give measured_y, measured_qx and \
                 measured_qz the other sign"
            } else {
                "the readings are a mirror image: two of measured_x, measured_y and measured_z are swapped, or one has the other sign"
            }
            .to_owned()
        })
    }

    /// Positions that fit by themselves, beside orientations that fit nothing.
    fn own_orientations(&self) -> Option<String> {
        (self.poses.is_some() && self.fits(self.dataset)).then(|| {
            "the positions fit by themselves: check the order of measured_qw to measured_qz and that they belong to these rows, or delete these \
             columns to use the positions alone"
                .to_owned()
        })
    }

    fn swapped_joints(&self) -> Option<String> {
        let pairs = (0..6).flat_map(|a| (a + 1..6).map(move |b| (a, b)));
        let is_it = |(a, b): &(usize, usize)| {
            let mut swapped = self.dataset.clone();
            swapped.rows.iter_mut().for_each(|row| row.joints.swap_rows(*a, *b));
            self.fits(&swapped)
        };
        pairs.into_iter().find(is_it).map(|(a, b)| {
            format!(
                "the readings fit if the angles of joints {} and {} change places: their columns are swapped",
                a + 1,
                b + 1
            )
        })
    }

    /// Some rows in metres, the others in millimetres: their readings are a thousand times as small.
    fn metres(&self) -> Option<String> {
        let sizes: Vec<f64> = self.dataset.rows.iter().map(|row| row.reading.place_mm().norm()).collect();
        let (least, most) = sizes
            .iter()
            .fold((f64::INFINITY, 0.0_f64), |(low, high), size| (low.min(*size), high.max(*size)));
        let between = (least.max(most * 1e-6) * most).sqrt();
        let small: Vec<usize> = (0..sizes.len()).filter(|&row| sizes[row] < between).collect();
        let scaled = self.with_readings(|row| {
            let factor = if sizes[row] < between { MM_IN_METRE } else { 1.0 };
            Some(factor * self.dataset.rows[row].reading.place_mm())
        });
        let is_it = !small.is_empty() && small.len() < sizes.len() && self.fits(&scaled);
        is_it.then(|| {
            format!(
                "the readings fit if those of {} are metres and the others millimetres",
                self.listed(&small)
            )
        })
    }

    /// Angles of some rows in radians, those of the others in degrees.
    fn radians(&self) -> Option<String> {
        let most = |row: usize| self.dataset.rows[row].joints.amax().to_degrees();
        let small: Vec<usize> =
            (0..self.dataset.rows.len()).filter(|&row| most(row) <= std::f64::consts::TAU).collect();
        if small.is_empty() || small.len() == self.dataset.rows.len() {
            return None;
        }
        let mut scaled = self.dataset.clone();
        small.iter().for_each(|&row| scaled.rows[row].joints *= 1f64.to_degrees());
        self.fits(&scaled).then(|| {
            format!(
                "the readings fit if the joint angles of {} are radians and the others degrees",
                self.listed(&small)
            )
        })
    }

    /// Joints that were logged with the opposite sign, or one from a zero that is a quarter or half of a turn away. Several fit where they give the
    /// same positions of the target: a turn of a wrist by 180° is another sign of the joint after it.
    fn joint_convention(&self) -> Option<String> {
        let few = self.few();
        let fits = |change: &dyn Fn(&mut Joints)| {
            let mut changed = few.clone();
            changed.rows.iter_mut().for_each(|row| change(&mut row.joints));
            self.fits(&changed)
        };
        let mut found: Vec<String> = Vec::new();
        for joint in 0..6 {
            if fits(&|joints| joints[joint] *= -1.0) {
                found.push(format!("if q{} gets the other sign", joint + 1));
            }
        }
        for (joint, deg) in (0..6).flat_map(|joint| [90.0, -90.0, 180.0].map(|deg| (joint, deg))) {
            if fits(&|joints| joints[joint] += f64::to_radians(deg)) {
                found.push(format!("if {deg:+.0}° are added to q{}", joint + 1));
            }
        }
        if !found.is_empty() {
            return Some(format!(
                "the readings fit {}: check direction and zero of that joint against the data sheet (`truegrind robots`)",
                found.join(", or ")
            ));
        }
        let signs = |choice: u32| (0..6).filter(move |joint| choice >> joint & 1 == 1);
        let mut choices: Vec<u32> = (1..1 << 6).filter(|choice: &u32| choice.count_ones() > 1).collect();
        choices.sort_by_key(|choice| choice.count_ones());
        let is_it = |choice: &u32| fits(&|joints| signs(*choice).for_each(|joint| joints[joint] *= -1.0));
        let joints: Vec<String> =
            signs(choices.into_iter().find(is_it)?).map(|joint| format!("q{}", joint + 1)).collect();
        Some(format!(
            "the readings fit if {} get the other sign: check the directions of these joints against the data sheet (`truegrind robots`)",
            listed(&joints)
        ))
    }

    /// Rows as the file numbers them.
    fn listed(&self, rows: &[usize]) -> String {
        row_list(&rows.iter().map(|&row| self.dataset.rows[row].number).collect::<Vec<_>>())
    }

    /// Evenly some of the rows, for hypotheses that concern all of them alike.
    fn few(&self) -> Dataset {
        let step = self.dataset.rows.len().div_ceil(MANY).max(1);
        self.dataset.subset(&(0..self.dataset.rows.len()).step_by(step).collect::<Vec<_>>())
    }

    /// The rows with other readings; those without one are left out.
    fn with_readings(&self, reading: impl Fn(usize) -> Option<Vector3<f64>>) -> Dataset {
        let found: Vec<(usize, Vector3<f64>)> =
            (0..self.dataset.rows.len()).filter_map(|row| Some((row, reading(row)?))).collect();
        let mut out = self.dataset.subset(&found.iter().map(|(row, _)| *row).collect::<Vec<_>>());
        for (row, (_, place)) in out.rows.iter_mut().zip(found) {
            row.reading = Reading::Position(place);
        }
        out
    }
}
