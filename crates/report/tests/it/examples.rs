//! Results to look at: one identification from the shipped rows, and pages left in the build folder.

use std::sync::OnceLock;

use truegrind_arm::robots;
use truegrind_calibration::identification::identify::{Identification, Options, identify};
use truegrind_calibration::identification::solver::SOLVERS;
use truegrind_calibration::identification::start::candidate_frames;
use truegrind_calibration::identification::tolerance::Tolerance;
use truegrind_calibration::measurement::dataset::Dataset;
use truegrind_calibration::measurement::import;
use truegrind_calibration::measurement::split::Split;
use truegrind_report::document::Document;
use truegrind_report::format::html;

const ROUNDED: &[u8] = include_bytes!("../../../../tests/data/irb120-rounded.csv");

/// Every fifth row is held out.
pub(super) fn fifth(dataset: &Dataset) -> Split {
    let (train, test) = (0..dataset.rows.len()).partition(|i| i % 5 != 2);
    Split { train, test }
}

/// The shipped, coarsely rounded rows of an IRB 120.
pub(super) fn dataset() -> Dataset {
    import::read("irb120-rounded.csv", ROUNDED, &import::Options::default()).expect("ships with the project")
}

/// What the default method finds in them.
pub(super) fn identification() -> (&'static Identification, &'static Dataset) {
    static FOUND: OnceLock<(Identification, Dataset)> = OnceLock::new();
    let (found, dataset) = FOUND.get_or_init(|| {
        let robot = robots::load("abb-irb-120").unwrap();
        let dataset = dataset();
        let frames = candidate_frames(&dataset, &robot.model).unwrap().remove(0);
        let options = Options {
            tolerance: Tolerance::default(),
            solver: &SOLVERS[0],
            held_out: 0.2,
            seed: 7,
            fuse_readout: true,
            limit_rmse_mm: Some(0.2),
            limit_max_mm: None,
            stated_frames: None,
        };
        let found = identify(&dataset, "abb-irb-120", &robot.model, &frames, &fifth, &options).unwrap();
        (found, dataset)
    });
    (found, dataset)
}

/// Leaves a page in the build folder, to be looked at.
pub(super) fn leave(name: &str, page: &Document) -> String {
    let text = html::document(page);
    let folder = std::path::Path::new(env!("CARGO_TARGET_TMPDIR")).join("pages");
    std::fs::create_dir_all(&folder).unwrap();
    std::fs::write(folder.join(name), &text).unwrap();
    text
}
