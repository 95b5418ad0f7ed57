//! Measurements from files, arrays and data frames.

use std::path::PathBuf;
use std::sync::Arc;

use numpy::{PyArray1, PyArray2, PyUntypedArrayMethods};
use pyo3::prelude::*;
use pyo3::types::{PyBytes, PyDict, PyList};
use truegrind::calibration::measurement::convention::AngleConvention;
use truegrind::calibration::measurement::import::{self, cell::Cell};
use truegrind::calibration::measurement::rows_of_robot::rows_of_robot;
use truegrind::file_kind::FileKind;
use truegrind::{Dataset, ImportOptions, Reading, Robot, Sensor, read_measurements};

use crate::arrays::{Numbers, numbers};
use crate::errors::Refusal;
use crate::files;
use crate::interruptible::run;
use crate::types::{Anything, ArrayLike, Floats, Object, PathOrBytes, Sensors, Typed};

/// Measured poses: logged joint angles and the readings of one sensor.
#[pyclass(name = "Dataset", module = "truegrind", frozen)]
pub(crate) struct PyDataset {
    pub(crate) rows: Arc<Dataset>,
    pub(crate) odd_units: bool,
}

/// A column of a table.
enum Column<'py> {
    /// Numbers; NaN is an empty cell if `gaps` are allowed.
    Numbers(Numbers<'py>, bool),
    /// Texts or empty cells.
    Texts(Vec<Option<String>>),
}

impl Column<'_> {
    fn len(&self) -> usize {
        match self {
            Column::Numbers(numbers, _) => numbers.as_array().len(),
            Column::Texts(texts) => texts.len(),
        }
    }
}

/// The file, or the bytes of one, with its name.
fn bytes_of(source: &Bound<'_, PyAny>, name: Option<String>, ending: &str) -> PyResult<(String, Vec<u8>)> {
    if let Ok(bytes) = source.cast::<PyBytes>() {
        return Ok((name.unwrap_or_else(|| format!("measurements.{ending}")), bytes.as_bytes().to_vec()));
    }
    let path: PathBuf =
        source.extract().map_err(|_| Refusal::argument("source", source, "a path, or bytes"))?;
    Ok((name.unwrap_or_else(|| files::name(&path)), files::read(&path)?))
}

fn of_columns(
    py: Python<'_>,
    name: &str,
    columns: Vec<(String, Column<'_>)>,
    allow_odd_units: bool,
) -> PyResult<PyDataset> {
    let count = columns.first().map_or(0, |(_, column)| column.len());
    for (column, values) in &columns {
        if values.len() != count {
            let found = format!("{} values in {column}", values.len());
            return Err(Refusal::argument(column, found, &format!("{count}, one for each row")).into());
        }
    }
    let names: Vec<String> = columns.iter().map(|(name, _)| name.clone()).collect();
    let views: Vec<_> = columns
        .iter()
        .map(|(_, column)| match column {
            Column::Numbers(numbers, gaps) => (Some(numbers.as_array()), *gaps, None),
            Column::Texts(texts) => (None, true, Some(texts)),
        })
        .collect();
    let rows = py.detach(|| {
        let cell =
            |column: &(Option<numpy::ndarray::ArrayViewD<'_, f64>>, bool, Option<&Vec<Option<String>>>),
             row: usize| match column {
                (Some(numbers), gaps, _) => match numbers[[row].as_slice()] {
                    value if value.is_nan() && *gaps => Cell::Empty,
                    value => Cell::Number { value, as_text: false },
                },
                (None, _, texts) => {
                    texts.and_then(|texts| texts[row].as_deref()).map_or(Cell::Empty, Cell::of_text)
                }
            };
        let lines = (0..count).map(|row| views.iter().map(|column| cell(column, row)).collect());
        let options = ImportOptions { allow_odd_units, ..ImportOptions::default() };
        import::from_rows(name, &names, lines, &options)
    });
    Ok(PyDataset { rows: Arc::new(rows.map_err(Refusal::from)?), odd_units: allow_odd_units })
}

/// Columns of an array of shape (N, width), by name.
fn add<'py>(
    columns: &mut Vec<(String, Column<'py>)>,
    argument: &str,
    array: &Numbers<'py>,
    names: &[&str],
    gaps: bool,
) -> PyResult<()> {
    let shape = array.shape();
    let fits = match shape {
        [_] => names.len() == 1,
        [_, width] => *width == names.len(),
        _ => false,
    };
    if !fits {
        let expected = if names.len() == 1 {
            "an array of shape (N,)".to_owned()
        } else {
            format!("an array of shape (N, {})", names.len())
        };
        let found = format!("an array of shape {}", crate::arrays::shown(shape));
        return Err(Refusal::argument(argument, found, &expected).into());
    }
    for (place, name) in names.iter().enumerate() {
        let column = match shape.len() {
            1 => array.as_any().clone(),
            _ => array.as_any().get_item((pyo3::types::PySlice::full(array.py()), place))?,
        };
        columns.push(((*name).to_owned(), Column::Numbers(numbers(argument, &column)?, gaps)));
    }
    Ok(())
}

#[pymethods]
impl PyDataset {
    /// Reads a text table (separated by comma, semicolon or tab) from a path or from bytes.
    #[staticmethod]
    #[pyo3(signature = (source, *, name = None, allow_odd_units = false))]
    fn from_csv(
        source: Object<'_, PathOrBytes>,
        name: Option<String>,
        allow_odd_units: bool,
    ) -> PyResult<Self> {
        let (name, bytes) = bytes_of(&source, name, "csv")?;
        read(source.py(), &name, &bytes, None, allow_odd_units)
    }

    /// Reads a workbook from a path or from bytes; by default the first sheet with the needed columns.
    #[staticmethod]
    #[pyo3(signature = (source, *, sheet = None, name = None, allow_odd_units = false))]
    fn from_xlsx(
        source: Object<'_, PathOrBytes>,
        sheet: Option<String>,
        name: Option<String>,
        allow_odd_units: bool,
    ) -> PyResult<Self> {
        let (name, bytes) = bytes_of(&source, name, "xlsx")?;
        read(source.py(), &name, &bytes, sheet, allow_odd_units)
    }

    /// Rows from arrays: logged controller angles (°) of shape (N, 6), and the readings of one sensor: ``length_mm`` (N,) of a
    /// cable, ``position_mm`` (N, 3) of a tracker, or with ``quaternion_wxyz`` (N, 4) a pose. Optional: Cartesian read-out of the
    /// controller ``readout_mm`` (N, 3), ``time_h``, ``temperature_c`` and ``payload_kg`` (N,), the payload's
    /// centre of mass in the flange frame ``payload_centre_mm`` (N, 3), at the flange by default, approach directions (N, 6) in
    /// −1, 0, 1, number of the cable outlet ``anchor`` (N,), labels ``session`` and
    /// ``station``, where tracker or camera stood. NaN means unknown.
    #[staticmethod]
    #[pyo3(signature = (
        q_deg, *, length_mm = None, position_mm = None, quaternion_wxyz = None, readout_mm = None, time_h = None,
        temperature_c = None, payload_kg = None, payload_centre_mm = None, approach = None, anchor = None, session = None, station = None,
        name = "numpy", allow_odd_units = false
    ))]
    #[expect(clippy::too_many_arguments, reason = "keywords, each with its own unit")]
    fn from_numpy<'py>(
        py: Python<'py>,
        q_deg: Object<'py, ArrayLike>,
        length_mm: Option<Object<'py, ArrayLike>>,
        position_mm: Option<Object<'py, ArrayLike>>,
        quaternion_wxyz: Option<Object<'py, ArrayLike>>,
        readout_mm: Option<Object<'py, ArrayLike>>,
        time_h: Option<Object<'py, ArrayLike>>,
        temperature_c: Option<Object<'py, ArrayLike>>,
        payload_kg: Option<Object<'py, ArrayLike>>,
        payload_centre_mm: Option<Object<'py, ArrayLike>>,
        approach: Option<Object<'py, ArrayLike>>,
        anchor: Option<Object<'py, ArrayLike>>,
        session: Option<Vec<Option<String>>>,
        station: Option<Vec<Option<String>>>,
        name: &str,
        allow_odd_units: bool,
    ) -> PyResult<Self> {
        const JOINTS: [&str; 6] = ["q1", "q2", "q3", "q4", "q5", "q6"];
        const TURN: [&str; 4] = ["measured_qw", "measured_qx", "measured_qy", "measured_qz"];
        const SIDES: [&str; 6] =
            ["approach1", "approach2", "approach3", "approach4", "approach5", "approach6"];
        let place: &[&str] = &["measured_x", "measured_y", "measured_z"];
        let mut columns = Vec::new();
        for (argument, array, names, gaps) in [
            ("q_deg", Some(q_deg), &JOINTS[..], false),
            ("length_mm", length_mm, &["L"][..], false),
            ("position_mm", position_mm, place, false),
            ("quaternion_wxyz", quaternion_wxyz, &TURN[..], false),
            ("readout_mm", readout_mm, &["x", "y", "z"][..], true),
            ("time_h", time_h, &["t"][..], true),
            ("temperature_c", temperature_c, &["temperature"][..], true),
            ("payload_kg", payload_kg, &["payload"][..], true),
            ("payload_centre_mm", payload_centre_mm, &["payload_x", "payload_y", "payload_z"][..], true),
            ("approach", approach, &SIDES[..], true),
            ("anchor", anchor, &["anchor"][..], false),
        ] {
            let Some(array) = array else { continue };
            add(&mut columns, argument, &numbers(argument, &array)?, names, gaps)?;
        }
        for (name, labels) in [("session", session), ("station", station)] {
            columns.extend(labels.map(|labels| (name.to_owned(), Column::Texts(labels))));
        }
        of_columns(py, name, columns, allow_odd_units)
    }

    /// Rows from a data frame: anything with the interchange protocol ``__dataframe__`` (pandas, polars, pyarrow, …), or with named
    /// columns that NumPy can convert. Columns are named as in files: q1 to q6 (°), L or measured_x, measured_y, measured_z (mm)
    /// and so on; nulls are empty cells.
    #[staticmethod]
    #[pyo3(signature = (frame, *, name = "dataframe", allow_odd_units = false))]
    fn from_dataframe(frame: Object<'_, Anything>, name: &str, allow_odd_units: bool) -> PyResult<Self> {
        let py = frame.py();
        let found = py.import("truegrind._dataframe")?.call_method1("columns", (&*frame,))?;
        let mut columns = Vec::new();
        for (name, values) in found.cast::<PyDict>()?.iter() {
            let column = match values.cast::<PyList>() {
                Ok(texts) => Column::Texts(texts.extract()?),
                Err(_) => Column::Numbers(numbers(&name.to_string(), &values)?, true),
            };
            columns.push((name.extract()?, column));
        }
        of_columns(py, name, columns, allow_odd_units)
    }

    /// File name as printed in reports.
    #[getter]
    fn file(&self) -> &str {
        &self.rows.file
    }

    /// ``cable``, ``position`` or ``pose``.
    #[getter]
    fn sensor(&self) -> Typed<Sensors, &'static str> {
        self.rows.sensor.name().into()
    }

    /// Remarks: skipped columns, dropped blank rows.
    #[getter]
    fn notes(&self) -> Vec<String> {
        self.rows.notes.clone()
    }

    /// SHA-256 of the file's bytes, in hex.
    #[getter]
    fn sha256(&self) -> &str {
        &self.rows.sha256
    }

    /// Logged joint angles of the controller (°), shape (N, 6).
    #[getter]
    fn q_deg<'py>(&self, py: Python<'py>) -> PyResult<Typed<Floats, Bound<'py, PyArray2<f64>>>> {
        let rows: Vec<Vec<f64>> =
            self.rows.rows.iter().map(|row| row.joints.iter().map(|q| q.to_degrees()).collect()).collect();
        Ok(PyArray2::from_vec2(py, &rows)?.into())
    }

    /// Lengths of a cable (mm), shape (N,); ``None`` for another sensor.
    #[getter]
    fn length_mm<'py>(&self, py: Python<'py>) -> Option<Typed<Floats, Bound<'py, PyArray1<f64>>>> {
        let length =
            |reading: &Reading| if let Reading::Cable(length) = reading { *length } else { f64::NAN };
        (self.rows.sensor == Sensor::Cable)
            .then(|| PyArray1::from_iter(py, self.rows.rows.iter().map(|row| length(&row.reading))).into())
    }

    /// Positions in the sensor frame (mm), shape (N, 3); ``None`` for a cable.
    #[getter]
    fn position_mm<'py>(
        &self,
        py: Python<'py>,
    ) -> PyResult<Option<Typed<Floats, Bound<'py, PyArray2<f64>>>>> {
        let place = |reading: &Reading| match reading {
            Reading::Cable(_) => vec![f64::NAN; 3],
            Reading::Position(p) => p.iter().copied().collect(),
            Reading::Pose(pose) => pose.translation.vector.iter().copied().collect(),
        };
        if self.rows.sensor == Sensor::Cable {
            return Ok(None);
        }
        let rows: Vec<Vec<f64>> = self.rows.rows.iter().map(|row| place(&row.reading)).collect();
        Ok(Some(PyArray2::from_vec2(py, &rows)?.into()))
    }

    fn __len__(&self) -> usize {
        self.rows.rows.len()
    }

    fn __repr__(&self) -> String {
        format!("<Dataset {}: {} rows, sensor {}>", self.rows.file, self.rows.rows.len(), *self.sensor())
    }
}

/// Size from which reading can be interrupted.
const MANY_BYTES: usize = 1 << 20;

fn read(
    py: Python<'_>,
    name: &str,
    bytes: &[u8],
    sheet: Option<String>,
    allow_odd_units: bool,
) -> PyResult<PyDataset> {
    let options = ImportOptions { sheet, allow_odd_units };
    let read = || {
        read_measurements(name, bytes, &options).map_err(|error| {
            let told = Refusal::from(error);
            match FileKind::of(name, bytes) {
                None | Some(FileKind::Measurements | FileKind::Empty) => told,
                Some(kind) => {
                    told.saying(format!("{name}: {}; expected measurements (.csv or .xlsx)", kind.text()))
                }
            }
        })
    };
    // Threads of its own, which Ctrl-C ends, take longer to start than a small file to read.
    let rows = if bytes.len() > MANY_BYTES { run(py, Some(1), None, read)? } else { py.detach(read)? };
    Ok(PyDataset { rows: Arc::new(rows), odd_units: allow_odd_units })
}

impl PyDataset {
    /// The rows with controller angles, with units checked against the robot. `angles`: `"logged"`, `"dh"`, or by default that of the
    /// robot file.
    pub(crate) fn of(&self, robot: &Robot, angles: Option<&str>) -> Result<Dataset, Refusal> {
        let convention = angles.map(|word| {
            let expected = "\"logged\" or \"dh\"";
            word.parse::<AngleConvention>().map_err(|_| Refusal::argument("angles", word, expected))
        });
        Ok(rows_of_robot((*self.rows).clone(), robot, convention.transpose()?, self.odd_units)?)
    }
}
