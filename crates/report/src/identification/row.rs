//! The rows that errors are stated on.

use truegrind_calibration::identification::identify::{Identification, sensor_name};
use truegrind_calibration::measurement::dataset::{Dataset, Sensor};

/// Number of a data row as files count them; the index itself where the data set is not the one that was used.
pub(super) fn row_number(dataset: &Dataset, index: usize) -> usize {
    dataset.rows.get(index).map_or(index, |row| row.number)
}

/// Whether a row has one error with a sign (a cable) or the length of a vector.
pub(super) fn signed(found: &Identification) -> bool {
    found.estimated.provenance.sensor == sensor_name(Sensor::Cable)
}
