//! Rows with errors.

use truegrind_calibration::identification::identify::{Identification, sensor_name};
use truegrind_calibration::measurement::dataset::{Dataset, Sensor};

/// Row number in the file; the index if the data set does not match.
pub(super) fn row_number(dataset: &Dataset, index: usize) -> usize {
    dataset.rows.get(index).map_or(index, |row| row.number)
}

/// Whether errors are signed (cable) rather than lengths of vectors.
pub(super) fn signed(found: &Identification) -> bool {
    found.estimated.provenance.sensor == sensor_name(Sensor::Cable)
}
