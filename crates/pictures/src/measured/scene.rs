//! What is to be drawn of a measurement file.

use crate::arm::LinkMesh;
use truegrind_arm::model::Model;
use truegrind_calibration::diagnosis::finding::Diagnosis;
use truegrind_calibration::identification::calibration::Frames;
use truegrind_calibration::identification::identify::Identification;
use truegrind_calibration::measurement::dataset::Dataset;

/// What one stage of a fit leaves.
#[derive(Debug, Clone, PartialEq)]
pub struct Residuals {
    /// The stage: "frames fitted", "geometry fitted".
    pub stage: String,
    /// Data row and error (mm): signed for a cable (model minus reading), the length of the difference otherwise.
    pub rows: Vec<(usize, f64)>,
}

/// What is to be drawn of a measurement file.
#[derive(Debug, Clone, Copy)]
pub struct MeasuredScene<'a> {
    /// The file.
    pub dataset: &'a Dataset,
    /// The arm that is drawn.
    pub arm: &'a Model,
    /// What that arm is, in words.
    pub arm_is: &'a str,
    /// The arm of the data sheet, drawn as a ghost beside the other with its differences exaggerated; where known.
    pub nominal: Option<&'a Model>,
    /// Meshes that show the links, where a robot file names them; else links are bars.
    pub meshes: &'a [LinkMesh],
    /// Whether the rows are still to be measured: poses as planned, and readings as expected.
    pub planned: bool,
    /// Boxes that nothing shall enter: two corners each (mm, base).
    pub keep_out_mm: &'a [[[f64; 3]; 2]],
    /// The answer in words, where there is more to be said than the file's (Markdown, lines of a list).
    pub answer: &'a [String],
    /// Pose of the sensor relative to the arm, if known.
    pub frames: Option<&'a Frames>,
    /// What each stage leaves, the best one last; may be empty.
    pub residuals: &'a [Residuals],
    /// Errors of rows that the last stage had not seen: data row, error (mm).
    pub held_out: &'a [(usize, f64)],
    /// Data rows that were set aside as outliers.
    pub set_aside: &'a [usize],
    /// What was identified, for the text.
    pub identification: Option<&'a Identification>,
    /// What a diagnosis found in it.
    pub diagnosis: Option<&'a Diagnosis>,
}
