//! Readings of a tracker or camera that was set up in several places (column `station`), brought into the frame of the first.
//!
//! The data sheet's arm places each station; that is as exact as the arm. How each stands to the first is therefore one of the
//! [`disturbances`] of the measurement, a shift and a turn that every fit estimates along with the arm. Range and bearing of a station beyond
//! the first are no longer told apart, so that errors that depend on the distance are the first one's.

use nalgebra::{Matrix3, Point3, Vector3};
use thiserror::Error;

use super::dataset::{Dataset, Reading, Row, Sensor};
use super::registration::{self, known_target};
use super::row_list::row_list;
use super::sensor::disturbance::{Disturbance, Kind, Profile};
use truegrind_arm::condition::Condition;
use truegrind_arm::model::Model;
use truegrind_math::se3::Pose;

/// Fewest rows that place a station well: twice as many readings as unknowns.
const MIN_ROWS: usize = 4;

/// The rows of a station do not say where it stood.
#[derive(Debug, Clone, PartialEq, Error)]
#[error(
    "{file}: the rows of station {station} (column station: {}) do not determine where it stood: measure at least {MIN_ROWS} poses that are not on \
     one line from each station, and spell its name the same way in all of its rows",
    row_list(.numbers)
)]
pub struct StationError {
    /// File.
    pub file: String,
    /// Station, as the file names it.
    pub station: String,
    /// Its rows.
    pub rows: usize,
    /// Their numbers in the file.
    pub numbers: Vec<usize>,
}

/// How each station but the first stands to where the data sheet's arm puts it: nothing yet, to be fitted.
pub fn disturbances(stations: usize) -> Vec<Disturbance> {
    (1..stations)
        .map(|station| Disturbance::new(Kind::Frame { turning: true }, Profile::Station { station }))
        .collect()
}

/// The rows of each station, by index.
pub(super) fn rows_of_stations(dataset: &Dataset) -> Vec<Vec<usize>> {
    let mut out = vec![Vec::new(); dataset.stations()];
    for (index, row) in dataset.rows.iter().enumerate() {
        out[if dataset.sensor == Sensor::Cable { 0 } else { row.anchor }].push(index);
    }
    out
}

/// Brings the readings of all stations into the frame of the first, as the data sheet's arm tells, with a note.
///
/// # Errors
/// [`StationError`] where a station has too few rows.
pub(super) fn in_frame_of_first(dataset: &mut Dataset, nominal: &Model) -> Result<(), StationError> {
    if dataset.stations() < 2 {
        return Ok(());
    }
    let stations = rows_of_stations(dataset);
    let placed = placed_by_arm(dataset, nominal, &stations)?;
    let first_from_base = placed[0].inverse();
    for row in dataset.rows.iter_mut().filter(|row| row.anchor > 0) {
        let first_from_station = first_from_base * placed[row.anchor];
        match &mut row.reading {
            Reading::Position(place) => *place = (first_from_station * Point3::from(*place)).coords,
            Reading::Pose(pose) => **pose = first_from_station * **pose,
            Reading::Cable(_) => {}
        }
    }
    let counts: Vec<String> = stations.iter().map(|rows| rows.len().to_string()).collect();
    dataset.notes.push(format!(
        "{} stations with {} rows: readings are expressed in the frame of the first station; the poses of the others relative to it are fitted \
         together with the arm",
        stations.len(),
        truegrind_math::sentence::listed(&counts)
    ));
    Ok(())
}

/// Where the stations stand in the base, with the target where the station with the most rows sees it.
fn placed_by_arm(
    dataset: &Dataset,
    nominal: &Model,
    stations: &[Vec<usize>],
) -> Result<Vec<Pose>, StationError> {
    let posed = nominal.at_condition(&Condition::default());
    let flanges = |rows: &[usize]| -> Vec<Pose> {
        rows.iter().map(|&row| posed.forward(&dataset.rows[row].joints)).collect()
    };
    let places = |rows: &[usize]| -> Vec<Vector3<f64>> {
        rows.iter().map(|&row| dataset.rows[row].reading.place_mm()).collect()
    };
    let unplaced = |station: usize| StationError {
        file: dataset.file.clone(),
        station: dataset.station_name(station),
        rows: stations[station].len(),
        numbers: stations[station].iter().map(|&row| dataset.rows[row].number).collect(),
    };
    let largest = (0..stations.len()).max_by_key(|&station| stations[station].len()).unwrap_or_default();
    let target_mm = target_mm(&flanges(&stations[largest]), &stations[largest], dataset)
        .ok_or_else(|| unplaced(largest))?;
    let place = |(station, rows): (usize, &Vec<usize>)| {
        let fit = known_target(&flanges(rows), &places(rows), &target_mm);
        fit.filter(|_| rows.len() >= MIN_ROWS)
            .map(|fit| fit.base_from_sensor)
            .ok_or_else(|| unplaced(station))
    };
    stations.iter().enumerate().map(place).collect()
}

/// Held-out errors (mm) of the rows `test` without what the frame of a station makes of them, which the rows `train` place.
///
/// A station of four or five poses is placed so badly by those that are left of it that its held-out errors are several times those of the
/// arm. With V what n readings of unit variance leave uncertain of a frame at the place of a row, errors are divided by √(1 + tr V/3); where
/// the frame makes more of an error than three readings would, it shows nothing, and there is none. Rows of one station stay as they are.
///
/// V = I/n + S M⁻¹ Sᵀ, S the matrix of the cross product with the place relative to the mean of the n readings, M their second moments
/// Σ (|d|² I − d dᵀ); measured orientations leave the first part alone.
pub(crate) fn without_frames(train: &Dataset, test: &Dataset, errors: Vec<f64>) -> Vec<Option<f64>> {
    let stations = train.stations().max(test.stations());
    if stations < 2 {
        return errors.into_iter().map(Some).collect();
    }
    let frames: Vec<Option<FrameVariance>> =
        (0..stations).map(|station| FrameVariance::of(train, station)).collect();
    let own = |(row, error): (&Row, f64)| {
        let variance = frames[row.anchor].as_ref()?.at(&row.reading.place_mm());
        (variance < MAX_OF_FRAME).then(|| error / (1.0 + variance).sqrt())
    };
    test.rows.iter().zip(errors).map(own).collect()
}

/// Variance of a frame, in that of a reading, beyond which a held-out row shows nothing of the arm.
const MAX_OF_FRAME: f64 = 3.0;

/// Where the readings of a station leave its frame uncertain.
struct FrameVariance {
    count: f64,
    mean: Vector3<f64>,
    /// Inverse second moments; absent where orientations were measured.
    inverse: Option<Matrix3<f64>>,
}

impl FrameVariance {
    /// `None` where the rows do not determine it.
    fn of(dataset: &Dataset, station: usize) -> Option<Self> {
        let rows = || dataset.rows.iter().filter(|row| row.anchor == station);
        let count = rows().count() as f64;
        if count == 0.0 {
            return None;
        }
        let mean = rows().map(|row| row.reading.place_mm()).sum::<Vector3<f64>>() / count;
        if dataset.sensor == Sensor::Pose {
            return Some(Self { count, mean, inverse: None });
        }
        let moment = |row: &Row| {
            let d = row.reading.place_mm() - mean;
            Matrix3::identity() * d.norm_squared() - d * d.transpose()
        };
        let inverse = rows().map(moment).sum::<Matrix3<f64>>().cholesky()?.inverse();
        Some(Self { count, mean, inverse: Some(inverse) })
    }

    /// tr V/3.
    fn at(&self, place: &Vector3<f64>) -> f64 {
        let lever = (place - self.mean).cross_matrix();
        let turned = self.inverse.map_or(0.0, |inverse| (lever * inverse * lever.transpose()).trace());
        1.0 / self.count + turned / 3.0
    }
}

/// The target on the flange as rows of one station show it.
fn target_mm(flanges: &[Pose], rows: &[usize], dataset: &Dataset) -> Option<Vector3<f64>> {
    let readings = || rows.iter().map(|&row| &dataset.rows[row]).map(|row: &Row| &row.reading);
    if dataset.sensor == Sensor::Pose {
        let poses: Vec<Pose> = readings()
            .filter_map(|reading| if let Reading::Pose(p) = reading { Some(**p) } else { None })
            .collect();
        return Some(registration::poses(flanges, &poses)?.flange_from_target.translation.vector);
    }
    let places: Vec<Vector3<f64>> = readings().map(Reading::place_mm).collect();
    Some(registration::target_point(flanges, &places)?.target_mm)
}
