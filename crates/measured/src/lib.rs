//! Measured data sets by their names below the folder that the environment variable `TRUEGRIND_DATA` names.

use std::path::PathBuf;

use truegrind_calibration::measurement::dataset::Dataset;
use truegrind_calibration::measurement::import;

/// A measured data set; of a workbook the sheet by that name, or the first that has the columns.
///
/// # Panics
/// Where the file cannot be read: a test that needs it is ignored where there is no folder.
pub fn data_set(file: &str, sheet: Option<&str>) -> Dataset {
    let folder = PathBuf::from(
        std::env::var_os("TRUEGRIND_DATA").expect("TRUEGRIND_DATA names the folder of measured data"),
    );
    let path = folder.join(file);
    let bytes = std::fs::read(&path).unwrap_or_else(|error| panic!("{}: {error}", path.display()));
    let options = import::Options { sheet: sheet.map(str::to_owned), ..import::Options::default() };
    import::read(file, &bytes, &options).unwrap_or_else(|error| panic!("{error}"))
}
