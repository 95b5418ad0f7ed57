//! Errors of the library as exceptions, with the attributes file, row, column, found and expected where known.

use pyo3::prelude::*;
use pyo3::types::PyDict;
use truegrind::arm::estimated;
use truegrind::calibration::acceptance::AcceptError;
use truegrind::calibration::diagnosis::measured::MeasuredError;
use truegrind::calibration::exported::ExportError;
use truegrind::calibration::identification::start::StartError;
use truegrind::calibration::identification::stated_placement::PlacementError;
use truegrind::calibration::measurement::matching::Mismatch;
use truegrind::calibration::measurement::plausibility::PayloadSuspicion;
use truegrind::calibration::measurement::stations::StationError;
use truegrind::compensation::cell::CellError;
use truegrind::compensation::condition::stated::ConditionError;
use truegrind::planning::poses::settings::SettingsError;
use truegrind::{
    CompensateError, IdentifyError, ImportError, ModelFileError, NominalMismatch, PlanError, RecipeError,
    RobotError, SolverError, TrackError, TrackStateError,
};

/// Exception class.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Kind {
    Argument,
    Dataset,
    Robot,
    Model,
    Fit,
    Program,
    Cell,
    Recipe,
    Plan,
    Track,
    Inverse,
    Defect,
}

impl Kind {
    fn class(self) -> &'static str {
        match self {
            Kind::Argument => "ArgumentError",
            Kind::Dataset => "DatasetError",
            Kind::Robot => "RobotError",
            Kind::Model => "ModelError",
            Kind::Fit => "FitError",
            Kind::Program => "ProgramError",
            Kind::Cell => "CellError",
            Kind::Recipe => "RecipeError",
            Kind::Plan => "PlanError",
            Kind::Track => "TrackError",
            Kind::Inverse => "InverseError",
            Kind::Defect => "Defect",
        }
    }
}

/// An error before it becomes a Python exception.
#[derive(Debug)]
pub(crate) struct Refusal {
    kind: Kind,
    message: String,
    file: Option<String>,
    sheet: Option<String>,
    row: Option<usize>,
    column: Option<String>,
    found: Option<String>,
    expected: Option<String>,
}

/// Command line options and the corresponding keywords.
const KEYWORDS: [(&str, &str); 43] = [
    ("--allow-odd-units", "allow_odd_units=True"),
    ("--cable-zero", "cable_zeros_mm"),
    ("--touched-point", "touched_point"),
    ("--touched-sigma", "touched_sigma_mm"),
    ("--frame-sigma", "frame_sigma_mm"),
    ("--payload-centre", "payload_centre_mm"),
    ("--payload", "payload_kg"),
    ("--temperature", "temperature_c"),
    ("--to ur-yaml", "format=\"ur-yaml\""),
    ("--index", "index"),
    ("--margin", "margin_deg"),
    ("--floor", "floor_mm"),
    ("--settle", "settle_s"),
    ("--approach", "approach_deg"),
    ("--seconds-per-row", "seconds_per_row"),
    ("--speed", "speed_mm_s"),
    ("--sigma-angle", "sigma_angle_deg"),
    ("--link-radius", "link_radius_mm"),
    ("--clearance", "clearance_mm"),
    ("--repeats", "repeats"),
    ("--both-sides", "both_sides"),
    ("--warm-up", "warm_up"),
    ("--decisive", "decisive"),
    ("--candidates", "candidates"),
    ("--singularity", "singularity"),
    ("--finding", "finding"),
    ("--for", "diagnosis"),
    ("--model", "model"),
    ("--actual", "actual"),
    ("--surface", "surface"),
    ("--box", "box_mm"),
    ("--range", "range_mm"),
    ("--keep-out", "keep_out_mm"),
    ("--poses", "poses"),
    ("--angles dh", "angles=\"dh\""),
    ("--base LINK --tip LINK", "truegrind.Robot(file, base=LINK, tip=LINK)"),
    ("--robot", "the robot"),
    ("--first-poses", "first_poses"),
    ("--sigma", "sigma_mm ="),
    ("--state", "state"),
    ("--outlet", "outlets_mm"),
    ("--sensor-frame", "sensor_frame"),
    ("--cell", "cell"),
];

/// An argument may be a whole file.
fn clipped(mut text: String) -> String {
    const MAX_CHARACTERS: usize = 200;
    if let Some((end, _)) = text.char_indices().nth(MAX_CHARACTERS) {
        text.truncate(end);
        text.push('…');
    }
    text
}

/// A message with keywords in place of options.
fn in_python(message: impl ToString) -> String {
    let mut message = message.to_string();
    for (option, keyword) in KEYWORDS {
        if message.contains(option) {
            message = message.replace(option, keyword);
        }
    }
    message
}

impl Refusal {
    pub(crate) fn new(kind: Kind, message: impl ToString) -> Self {
        let message = in_python(message);
        Self { kind, message, file: None, sheet: None, row: None, column: None, found: None, expected: None }
    }

    /// The same error in other words.
    pub(crate) fn saying(self, message: impl ToString) -> Self {
        Self { message: in_python(message), ..self }
    }

    /// An invalid argument: its name, the found and the expected value.
    pub(crate) fn argument(name: &str, found: impl ToString, expected: &str) -> Self {
        let found = clipped(found.to_string());
        let told = Self::new(Kind::Argument, format!("{name}: found {found}; expected {expected}"));
        told.of_key(name).with(found, expected)
    }

    pub(crate) fn of_file(self, file: &str) -> Self {
        Self { file: Some(file.to_owned()), ..self }
    }

    /// The found and the expected value.
    pub(crate) fn with(self, found: impl ToString, expected: impl ToString) -> Self {
        Self { found: Some(found.to_string()), expected: Some(expected.to_string()), ..self }
    }

    /// The line of a file that is not TOML, or has other keys, and what was expected there.
    fn of_syntax(self, fault: &str) -> Self {
        let line =
            fault.split_once(" at line ").and_then(|(_, rest)| rest.split([',', '\n']).next()?.parse().ok());
        let expected = fault.lines().map(str::trim).rfind(|line| !line.is_empty()).map(str::to_owned);
        Self { row: line, expected, ..self }
    }

    /// The argument that a message about an option begins with, and what was expected of it.
    fn of_option(self) -> Self {
        let name = self.message.split([':', ' ']).next().unwrap_or_default().to_owned();
        let both = self.message.split_once(": expected ").map(|(found, expected)| {
            let found = found.strip_prefix(&name).unwrap_or(found).trim();
            (found.to_owned(), expected.to_owned())
        });
        let told = self.of_key(name);
        match both {
            Some((found, expected)) => told.with(found, expected),
            None => told,
        }
    }

    /// Key of a file, or name of an argument.
    fn of_key(self, key: impl ToString) -> Self {
        Self { column: Some(key.to_string()), ..self }
    }
}

impl From<Refusal> for PyErr {
    fn from(refusal: Refusal) -> PyErr {
        Python::attach(|py| {
            let raised = || -> PyResult<PyErr> {
                let class = py.import("truegrind.errors")?.getattr(refusal.kind.class())?;
                let places = PyDict::new(py);
                places.set_item("file", refusal.file)?;
                places.set_item("sheet", refusal.sheet)?;
                places.set_item("row", refusal.row)?;
                places.set_item("column", refusal.column)?;
                places.set_item("found", refusal.found)?;
                places.set_item("expected", refusal.expected)?;
                Ok(PyErr::from_value(class.call((refusal.message,), Some(&places))?))
            };
            raised().unwrap_or_else(|error| error)
        })
    }
}

impl From<ImportError> for Refusal {
    fn from(error: ImportError) -> Self {
        let told = Self::new(Kind::Dataset, &error);
        let place = error.location().cloned();
        let both = |found: &str, expected: &str| (Some(found.to_owned()), Some(expected.to_owned()));
        let (found, expected) = match &error {
            ImportError::Cell { found, expected, .. } | ImportError::Units { found, expected, .. } => {
                (Some(found.to_string()), Some((*expected).to_owned()))
            }
            ImportError::TooLarge { found, expected, .. } => {
                (Some(found.to_string()), Some(expected.to_string()))
            }
            ImportError::LongRow { found, expected, .. } => {
                (Some(format!("{found} cells")), Some(format!("{expected} cells")))
            }
            ImportError::MissingColumns { found, missing, .. } => {
                (Some(found.join(", ")), Some(missing.join("; ")))
            }
            ImportError::NoSensor { found, .. } => {
                (Some(found.join(", ")), Some("L, or measured_x, measured_y and measured_z".to_owned()))
            }
            ImportError::UnknownSheet { sheet, sheets, .. } => (Some(sheet.clone()), Some(sheets.join(", "))),
            ImportError::NoSheets { sheet, .. } => {
                both(&format!("sheet {sheet}"), "no sheet for a text table")
            }
            ImportError::TwoSensors { tracker, .. } => both(&format!("L, {tracker}"), "one sensor"),
            ImportError::DuplicateColumn { .. } => both("the column twice", "the column once"),
            ImportError::TooManyJoints { joint, .. } => both(&format!("joint {joint}"), "joints 1 to 6"),
            ImportError::Empty { .. } => both("no rows", "a header line and one row for each measured pose"),
            ImportError::NotATable { .. } => both("other bytes", "a text table or a workbook"),
            ImportError::Format { message, .. } => (Some(message.clone()), None),
            ImportError::Unusable { message, .. } => match message.split_once("; expected ") {
                Some((found, expected)) => both(found.strip_prefix("found ").unwrap_or(found), expected),
                None => (Some(message.clone()), None),
            },
            _ => (None, None),
        };
        let named = match &error {
            ImportError::UnknownSheet { file, .. } | ImportError::NoSheets { file, .. } => Some(file.clone()),
            _ => place.as_ref().map(|place| place.file.to_string()),
        };
        Self {
            file: named,
            sheet: place.as_ref().and_then(|place| place.sheet.as_deref().map(str::to_owned)),
            row: place.as_ref().and_then(|place| place.row),
            column: place.and_then(|place| place.column.map(String::from)),
            found,
            expected,
            ..told
        }
    }
}

impl From<Mismatch> for Refusal {
    fn from(error: Mismatch) -> Self {
        let told = Self::new(Kind::Dataset, &error);
        match error {
            Mismatch::Units(suspicion) => {
                let message = format!("{} (allow_odd_units=True accepts the rows anyway)", told.message);
                let differences = suspicion.differences();
                let found: Vec<&str> = differences.iter().map(|(found, _)| *found).collect();
                let expected = "degrees, millimetres and unit quaternions, scalar first";
                told.saying(message).of_file(&suspicion.file).with(found.join("; "), expected)
            }
            Mismatch::Condition(_) => {
                let message = format!("{} (allow_odd_units=True accepts the rows anyway)", told.message);
                told.saying(message)
            }
            Mismatch::Payload(suspicion) => suspicion.into(),
            Mismatch::Station(StationError { file, rows, .. }) => told
                .of_file(&file)
                .with(format!("{rows} rows"), "at least four poses from each station, not on one line"),
            _ => told,
        }
    }
}

impl From<PlacementError> for Refusal {
    fn from(error: PlacementError) -> Self {
        Self::new(Kind::Argument, &error).of_option()
    }
}

impl From<SettingsError> for Refusal {
    fn from(error: SettingsError) -> Self {
        Self::new(Kind::Argument, &error).of_option()
    }
}

impl From<MeasuredError> for Refusal {
    fn from(error: MeasuredError) -> Self {
        match error {
            MeasuredError::Start(error) => error.into(),
            MeasuredError::Placement(error) => error.into(),
            MeasuredError::Diagnose(error) => error.into(),
            other => Self::new(Kind::Fit, other),
        }
    }
}

impl From<ConditionError> for Refusal {
    fn from(error: ConditionError) -> Self {
        let told = Self::new(Kind::Argument, &error);
        match error {
            ConditionError::Payload { found } => {
                told.of_key("payload_kg").with(found, "a mass in kg, from 0 to 3000")
            }
            ConditionError::CentreAlone => {
                told.of_key("payload_kg").with("nothing", "the mass whose centre is stated")
            }
            ConditionError::OtherLoad { found, measured_kg, .. } => {
                told.of_key("payload_kg").with(found, format!("{measured_kg} kg, as measured"))
            }
            ConditionError::Temperature { found } => {
                told.of_key("temperature_c").with(found, "the temperature of an arm in °C")
            }
            ConditionError::NoGrowth { found } => {
                told.of_key("temperature_c").with(found, "a model that grows with the temperature")
            }
            _ => told,
        }
    }
}

impl From<AcceptError> for Refusal {
    fn from(error: AcceptError) -> Self {
        let told = Self::new(Kind::Fit, &error);
        match error {
            AcceptError::Length { found, .. } => {
                Self { kind: Kind::Argument, ..told }.with(found, "a length above 0 in mm, up to 100")
            }
            AcceptError::Angle { found, .. } => {
                Self { kind: Kind::Argument, ..told }.with(found, "an angle above 0°, up to 180°")
            }
            AcceptError::RowsOfTheFit { file } => {
                told.of_file(&file).with("rows of the fit", "other poses, at least 100")
            }
            AcceptError::PathsAlone { file } | AcceptError::PointTwice { file, .. } => told.of_file(&file),
            AcceptError::StartError(error) => error.into(),
            _ => told,
        }
    }
}

impl From<ExportError> for Refusal {
    fn from(error: ExportError) -> Self {
        let told = Self::new(Kind::Argument, &error);
        match error {
            ExportError::OtherMaker { of, .. } => told.of_key("format").with(of, "urdf, dh-csv or mdh-csv"),
            ExportError::Links(error) => error.into(),
            ExportError::Start(error) => error.into(),
            _ => told,
        }
    }
}

impl From<PayloadSuspicion> for Refusal {
    fn from(suspicion: PayloadSuspicion) -> Self {
        let message = format!("{suspicion} (allow_odd_units=True accepts the rows anyway)");
        Self::new(Kind::Dataset, &message).of_file(&suspicion.file)
    }
}

impl From<RobotError> for Refusal {
    fn from(error: RobotError) -> Self {
        let told = Self::new(Kind::Robot, &error);
        match error {
            RobotError::Unknown { name, known, .. } => {
                Self { found: Some(name), expected: Some(known), ..told }
            }
            RobotError::Syntax { file, line, found, message, .. } => Self {
                file: Some(file),
                row: Some(line),
                found: Some(found),
                expected: Some(message),
                ..told
            },
            RobotError::Several { file, found } => {
                Self { file: Some(file), found: Some(found.to_string()), expected: Some("1".into()), ..told }
            }
            RobotError::Foreign { file, key, found, expected, .. } => Self {
                file: Some(file.into()),
                column: Some(key.into()),
                found: Some(found.into()),
                expected: Some(expected.to_owned()),
                ..told
            },
            RobotError::Invalid { file, key, found, expected, .. } => Self {
                file: Some(file.into()),
                column: Some(key.into()),
                found: Some(found.into()),
                expected: Some(expected.to_owned()),
                ..told
            },
            _ => told,
        }
    }
}

impl From<IdentifyError> for Refusal {
    fn from(error: IdentifyError) -> Self {
        let told = Self::new(Kind::Fit, &error);
        match error {
            IdentifyError::TooFewRows { file, poses, needed, .. } => {
                told.of_file(&file).with(format!("{poses} poses"), format!("{needed} poses"))
            }
            IdentifyError::WrongArm { file, robot, rmse_mm, .. } => told
                .of_file(&file)
                .with(format!("{rmse_mm:.1} mm RMS"), format!("the measurements of {robot}")),
            IdentifyError::WrongOrientation { file, robot, deg } => {
                told.of_file(&file).with(format!("{deg:.0}°"), format!("the orientations of {robot}"))
            }
            _ => told,
        }
    }
}

impl From<StartError> for Refusal {
    fn from(error: StartError) -> Self {
        let told = Self::new(Kind::Fit, &error);
        told.of_file(&error.file)
            .with(format!("{} poses", error.poses), format!("{} poses, not collinear", error.needed))
    }
}

impl From<SolverError> for Refusal {
    fn from(error: SolverError) -> Self {
        let told = Self::new(Kind::Argument, &error).of_key("method");
        match error {
            SolverError::Unknown { name, known } => told.with(name, known.join(", ")),
            _ => told,
        }
    }
}

impl From<ModelFileError> for Refusal {
    fn from(error: ModelFileError) -> Self {
        let told = Self::new(Kind::Model, &error);
        match error {
            ModelFileError::Syntax(fault) => told.of_syntax(&fault),
            ModelFileError::Schema { found } => told.of_key("schema").with(found, estimated::SCHEMA),
            ModelFileError::UnknownParameter { name } => {
                told.of_key("covariance.order").with(name, "parameters of the arm")
            }
            ModelFileError::Triangle { expected } => {
                Self { expected: Some(format!("{expected} rows")), ..told.of_key("covariance.lower") }
            }
            ModelFileError::Arm { part, fault } => {
                told.of_key(format!("{part}.{}", fault.key)).with(fault.found, fault.expected)
            }
            ModelFileError::InvalidValue(fault) => told.of_key(fault.key).with(fault.found, fault.expected),
            _ => told,
        }
    }
}

impl From<CellError> for Refusal {
    fn from(error: CellError) -> Self {
        let told = Self::new(Kind::Cell, &error);
        match error {
            CellError::TooManyPoints { name, points, .. } => {
                told.of_key(name).with(format!("{points} points"), "four to ten points")
            }
            CellError::Syntax(fault) => told.of_syntax(&fault),
            CellError::Angles { found } => {
                let expected = told.message.split_once("expected ").map(|(_, words)| words.to_owned());
                Self { found: Some(found), expected, ..told.of_key("angles") }
            }
            CellError::Frame { name, .. } => told.of_key(name),
            CellError::Twice { name, before, .. } => {
                told.of_key(&name).with(format!("{before}, {name}"), "one of the two")
            }
            CellError::UnknownAxis { axis } => told.of_key("external axis").with(axis, "a, b, c, d, e, f"),
            CellError::AxisTwice { axis } => told.of_key(axis).with("twice", "once"),
            _ => told,
        }
    }
}

impl From<RecipeError> for Refusal {
    fn from(error: RecipeError) -> Self {
        let told = Self::new(Kind::Recipe, &error);
        match error {
            RecipeError::Syntax { file, line, message } => {
                Self { row: Some(line), expected: Some(message), ..told.of_file(&file) }
            }
            RecipeError::Invalid { key, found, expected } => told.of_key(key).with(found, expected),
            RecipeError::Robot { .. } => told.of_key("robot"),
            RecipeError::NoPose { found, wanted, .. } => {
                told.of_key("poses").with(format!("{found} poses"), format!("{wanted} poses"))
            }
            _ => told,
        }
    }
}

impl From<PlanError> for Refusal {
    fn from(error: PlanError) -> Self {
        let told = Self::new(Kind::Plan, &error);
        match error {
            PlanError::TooFew { found, wanted, .. } | PlanError::NoWay { found, wanted, .. } => {
                told.with(format!("{found} poses"), format!("{wanted} poses"))
            }
            PlanError::OutletInFoot { at_mm } => {
                told.of_key("outlets_mm").with(format!("{at_mm:?}"), "millimetres")
            }
            PlanError::NoOutlet => told.of_key("outlets_mm").with("none", "the location of each outlet"),
            _ => told,
        }
    }
}

impl From<TrackError> for Refusal {
    fn from(error: TrackError) -> Self {
        let told = Self::new(Kind::Track, &error);
        match error {
            TrackError::TooFew { file, found, asked } => {
                told.of_file(&file).with(format!("{found} poses"), format!("{asked} poses"))
            }
            TrackError::Foreign { file, left_mm, held_out_mm, .. } => {
                told.of_file(&file).with(format!("{left_mm:.3} mm"), format!("about {held_out_mm:.3} mm"))
            }
            TrackError::Station { file, rows, .. } => {
                told.of_file(&file).with(format!("{rows} rows"), "at least 4 rows")
            }
            TrackError::Sensor { file, found, expected } => told.of_file(&file).with(found, expected),
            TrackError::State { file, .. } => told.of_file(&file),
            TrackError::Placing(error) => Self { kind: Kind::Track, ..Self::from(error) },
            _ => told,
        }
    }
}

impl From<TrackStateError> for Refusal {
    fn from(error: TrackStateError) -> Self {
        let told = Self::new(Kind::Track, &error);
        match error {
            TrackStateError::Syntax(fault) => told.of_syntax(&fault),
            TrackStateError::Value { key, found, expected } => told.of_key(key).with(found, expected),
            _ => told,
        }
    }
}

impl From<NominalMismatch> for Refusal {
    fn from(error: NominalMismatch) -> Self {
        Self::new(Kind::Model, error)
    }
}

impl From<CompensateError> for Refusal {
    fn from(error: CompensateError) -> Self {
        Self::new(Kind::Program, error)
    }
}
