//! Errors of the library as exceptions, with the attributes file, row, column, found and expected where known.

use pyo3::prelude::*;
use pyo3::types::PyDict;
use truegrind::calibration::identification::start::StartError;
use truegrind::calibration::measurement::matching::Mismatch;
use truegrind::compensation::cell::CellError;
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
const KEYWORDS: [(&str, &str); 12] = [
    ("--allow-odd-units takes the file at its word", "allow_odd_units=True takes the rows at their word"),
    ("--allow-odd-units", "allow_odd_units=True"),
    ("--allow-doubtful", "allow_doubtful=True"),
    ("--angles dh", "angles=\"dh\""),
    ("--robot", "the robot"),
    ("--first-poses", "first_poses"),
    ("--sigma", "sigma_mm ="),
    ("--state", "state"),
    ("--outlet", "outlets_mm"),
    ("--sensor-frame", "sensor_frame"),
    ("--cell", "cell"),
    ("--again", "again=True"),
];

impl Refusal {
    pub(crate) fn new(kind: Kind, message: impl ToString) -> Self {
        let mut message = message.to_string();
        for (option, keyword) in KEYWORDS {
            if message.contains(option) {
                message = message.replace(option, keyword);
            }
        }
        Self { kind, message, file: None, sheet: None, row: None, column: None, found: None, expected: None }
    }

    /// An invalid argument: its name, the found and the expected value.
    pub(crate) fn argument(name: &str, found: impl ToString, expected: &str) -> Self {
        let found = found.to_string();
        let told = Self::new(Kind::Argument, format!("{name}: found {found}; expected {expected}"));
        Self { found: Some(found), expected: Some(expected.to_owned()), ..told }
    }

    pub(crate) fn of_file(self, file: &str) -> Self {
        Self { file: Some(file.to_owned()), ..self }
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
            Mismatch::Units(suspicion) => Self {
                message: format!("{} (allow_odd_units=True takes the rows at their word)", told.message),
                file: Some(suspicion.file.clone()),
                ..told
            },
            _ => told,
        }
    }
}

impl From<RobotError> for Refusal {
    fn from(error: RobotError) -> Self {
        let told = Self::new(Kind::Robot, &error);
        match error {
            RobotError::Unknown { name, known } => Self { found: Some(name), expected: Some(known), ..told },
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
            IdentifyError::TooFewRows { file, poses, needed, .. } => Self {
                file: Some(file),
                found: Some(format!("{poses} poses")),
                expected: Some(format!("{needed} poses")),
                ..told
            },
            IdentifyError::WrongArm { file, rmse_mm, .. } => {
                Self { file: Some(file), found: Some(format!("{rmse_mm:.1} mm RMS")), ..told }
            }
            _ => told,
        }
    }
}

/// Errors whose message is used unchanged.
macro_rules! told {
    ($($error:ty => $kind:ident),+ $(,)?) => {
        $(impl From<$error> for Refusal {
            fn from(error: $error) -> Self {
                Self::new(Kind::$kind, error)
            }
        })+
    };
}

told! {
    StartError => Fit,
    SolverError => Argument,
    ModelFileError => Model,
    NominalMismatch => Model,
    CellError => Cell,
    CompensateError => Program,
    RecipeError => Recipe,
    PlanError => Plan,
    TrackError => Track,
    TrackStateError => Track,
}
