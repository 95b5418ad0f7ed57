//! Readings that no pose of the arm can give, such as the code by which a sensor says that it is out of range.
//!
//! Everything that the arm carries stays within a sphere about its base, so two readings differ by its diameter at most. One reading far
//! beyond it spoils the start of every fit, also of a robust one.

use nalgebra::Vector3;

use super::dataset::Dataset;
use super::row_list::row_list;
use super::stations::rows_of_stations;
use truegrind_arm::model::Model;
use truegrind_math::statistics::median;

/// How far a tool or target may stand out beyond the flange (mm).
const TOOL_MM: f64 = 1000.0;

/// Most rows that are left out, as a share: more are in another unit, or of another arm.
const MAX_LEFT_OUT_SHARE: f64 = 0.1;

/// Leaves out readings farther from the median of all than the arm is long, with a note.
pub(super) fn without_impossible_readings(dataset: &mut Dataset, nominal: &Model) {
    let length: f64 = nominal.links.iter().map(|link| link.a_mm.hypot(link.d_mm)).sum();
    let diameter_mm = 2.0 * (length + nominal.flange.translation.vector.norm() + TOOL_MM);
    let places: Vec<Vector3<f64>> = dataset.rows.iter().map(|row| row.reading.place_mm()).collect();
    // Readings of two stations are in two frames.
    let mut from_middle_mm = vec![0.0; places.len()];
    for rows in rows_of_stations(dataset) {
        let middle = Vector3::from_fn(|axis, _| {
            median(&rows.iter().map(|&row| places[row][axis]).collect::<Vec<_>>()).unwrap_or_default()
        });
        rows.iter().for_each(|&row| from_middle_mm[row] = (places[row] - middle).norm());
    }
    let is_possible = |i: &usize| from_middle_mm[*i] <= diameter_mm;
    let (kept, left_out): (Vec<usize>, Vec<usize>) = (0..places.len()).partition(is_possible);
    if left_out.is_empty() || left_out.len() as f64 > MAX_LEFT_OUT_SHARE * places.len() as f64 {
        return;
    }
    let numbers: Vec<usize> = left_out.iter().map(|&i| dataset.rows[i].number).collect();
    let farthest = left_out.iter().map(|&i| from_middle_mm[i]).fold(0.0, f64::max);
    *dataset = dataset.subset(&kept);
    dataset.notes.push(format!(
        "{} left out: {} {farthest:.0} mm from the median of all, and this arm reaches {diameter_mm:.0} mm at most; a sensor that is \
         out of range may write such numbers",
        row_list(&numbers),
        if numbers.len() == 1 { "its reading is" } else { "their readings are up to" }
    ));
}
