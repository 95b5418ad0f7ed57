//! Where the sensor was set up for a row of a track, as the files state it (column `station`).

use nalgebra::Point3;

use crate::measurement::dataset::{Dataset, Reading, Row, Sensor};
use truegrind_math::se3::Pose;

/// The name of the set-up of a row; `None` where the file states none.
pub(super) fn station_of(dataset: &Dataset, row: usize) -> Option<String> {
    let stated =
        dataset.sensor != Sensor::Cable && (!dataset.station_names.is_empty() || dataset.stations() > 1);
    stated.then(|| dataset.station_name(dataset.rows[row].anchor))
}

/// The first row after `row` that was read from another place.
pub(super) fn end_of_station(dataset: &Dataset, row: usize) -> usize {
    let name = station_of(dataset, row);
    (row..dataset.rows.len()).find(|&other| station_of(dataset, other) != name).unwrap_or(dataset.rows.len())
}

/// A row in the frame in which the track began.
pub(super) fn moved(row: &Row, track_from_station: &Pose) -> Row {
    let reading = match &row.reading {
        Reading::Position(place) => Reading::Position((track_from_station * Point3::from(*place)).coords),
        Reading::Pose(pose) => Reading::Pose(Box::new(track_from_station * **pose)),
        cable @ Reading::Cable(_) => cable.clone(),
    };
    Row {
        reading,
        anchor: if matches!(row.reading, Reading::Cable(_)) { row.anchor } else { 0 },
        ..row.clone()
    }
}

/// The number of the station of that name in a list, which is extended by a new one.
pub(super) fn number_of(name: String, names: &mut Vec<String>) -> usize {
    names.iter().position(|known| *known == name).unwrap_or_else(|| {
        names.push(name);
        names.len() - 1
    })
}
