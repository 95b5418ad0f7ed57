//! truegrind learns how one real robot arm differs from its data sheet, names the causes, and rewrites RAPID and NC
//! programs so that the real arm follows the intended path.
//!
//! Lengths are millimetres and angles radians; degrees and other units occur only in files. Transforms are named by target and source
//! frame, so that `base_from_flange * flange_from_tool` composes. Three models of an arm are distinguished: *nominal* (the data sheet,
//! used by the controller), *estimated* (nominal plus everything identified) and *actual* (the real arm, known only in a
//! simulation).
//!
//! # From measurements to a corrected program
//!
//! ```
//! use truegrind::{
//!     Cell, CompensateOptions, DiagnoseOptions, ImportOptions, NcSetup, Program, Tolerance, compensate, diagnose,
//!     read_measurements, robots, starting_frames,
//! };
//!
//! # let (csv, module): (&[u8], &[u8]) = (include_bytes!("../tests/data/irb120-rounded.csv"), include_bytes!("../programs/told.mod"));
//! // The robot and its measurements.
//! let robot = robots::load("abb-irb-120")?;
//! let rows = read_measurements("poses.csv", csv, &ImportOptions::default())?;
//! // The estimated arm, including the causes of errors beyond geometry.
//! let frames = starting_frames(&rows, &robot.model, &Tolerance::default(), true)?;
//! let options = DiagnoseOptions::default();
//! let found = diagnose(&rows, "abb-irb-120", &robot.model, &frames, &options, &|_| {})?;
//! println!("held-out RMSE [mm]: {:.3}", found.diagnosis.fits.extended.cv_rmse_mm);
//! // The program, corrected for this arm.
//! let program = Program::read(&[("blade.mod", module)], &NcSetup::default());
//! let done = compensate(&program, &found.estimated, &Cell::default(), &CompensateOptions::default(), None)?;
//! for (motion, outcome) in program.listing().motions.iter().zip(&done.plan.outcomes) {
//!     println!("line {}: {:?}", motion.place.line, outcome.status);
//! }
//! let corrected: Vec<u8> = done.rewritten.files[0].edits.apply(module)?;
//! # assert!(!corrected.is_empty());
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```
//!
//! [`Estimated::verdict`] states whether a model may be used, [`MotionOutcome`] why a motion is unchanged. Everything else is in the
//! crates, re-exported as [`arm`], [`programs`], [`surfaces`],
//! [`estimation`], [`calibration`], [`compensation`], [`planning`], [`report`], [`papers`], [`math`].

// What a file is that stands in the wrong place.
pub mod file_kind;
// Runs over many inputs on several machines.
pub mod units;

// The arm.
pub use truegrind_arm::arm_file::{ArmFile, LinkFile};
pub use truegrind_arm::batch::{JointColumns, PoseColumns};
pub use truegrind_arm::condition::Condition;
pub use truegrind_arm::effect::backlash::Backlash;
pub use truegrind_arm::effect::bending::Bending;
pub use truegrind_arm::effect::compliance::Compliance;
pub use truegrind_arm::effect::coupling::Coupling;
pub use truegrind_arm::effect::error_map::ErrorMap;
pub use truegrind_arm::effect::gear_ratio::GearRatio;
pub use truegrind_arm::effect::harmonic::Harmonic;
pub use truegrind_arm::effect::lumped_compliance::{Lump, LumpedCompliance};
pub use truegrind_arm::effect::smooth_correction::SmoothCorrection;
pub use truegrind_arm::effect::thermal::Thermal;
pub use truegrind_arm::effect::{Effect, EffectParameter};
pub use truegrind_arm::estimated::{
    Estimated, EstimatedParameter, FlangePoint, Judgement, ModelFileError, Provenance, Reason, ReasonKind,
    StageErrors, Verdict,
};
pub use truegrind_arm::inverse::Inverse;
pub use truegrind_arm::inverse::configuration::Configuration;
pub use truegrind_arm::inverse::solution::{InverseError, Singularity, SingularityDistances, Solution};
pub use truegrind_arm::link::{Link, LinkModel};
pub use truegrind_arm::model::{Body, Joints, Limits, Model};
pub use truegrind_arm::parameter::{LinkCoordinate, Parameter};
pub use truegrind_arm::region::{Outside, Region};
pub use truegrind_arm::robots::{self, NominalMismatch, Robot, RobotError};
pub use truegrind_math::se3::Pose;
pub use truegrind_math::statistics::ErrorSummary;

// Measurements.
pub use truegrind_calibration::measurement::convention::{AngleConvention, UnknownConvention};
pub use truegrind_calibration::measurement::dataset::{Dataset, Reading, Row, Sensor};
pub use truegrind_calibration::measurement::import::{
    ImportError, Location as ImportLocation, Options as ImportOptions, read as read_measurements,
};
pub use truegrind_calibration::measurement::noise_floor::{self, NoiseFloor};
pub use truegrind_calibration::measurement::plausibility::{UnitSuspicion, plausibility};
pub use truegrind_calibration::measurement::sensor::disturbance::Disturbance;
pub use truegrind_calibration::measurement::simulation::recipe::Recipe;
pub use truegrind_calibration::measurement::simulation::{RecipeError, SimulatedRow, Simulation};
pub use truegrind_calibration::measurement::split::{self, Split};

// Identification, diagnosis and tracking.
pub use truegrind_calibration::diagnosis::cause::Cause;
pub use truegrind_calibration::diagnosis::cause_kind::CauseKind;
pub use truegrind_calibration::diagnosis::diagnose::{Diagnosed, Options as DiagnoseOptions, diagnose};
pub use truegrind_calibration::diagnosis::finding::{
    Alternative, Confidence, DiagnoseError, Diagnosis, Finding, Fits, FoundParameter, Gain, NotTestable,
    Stage,
};
pub use truegrind_calibration::identification::calibration::{CalibrationProblem, Frames, Weight};
pub use truegrind_calibration::identification::identifiability::{Identifiability, identifiability};
pub use truegrind_calibration::identification::identify::{
    Identification, IdentifyError, Options as IdentifyOptions, identify, prepare_observations,
};
pub use truegrind_calibration::identification::register::{Registered, register, starting_frames};
pub use truegrind_calibration::identification::solver::{Solver, SolverError, by_name as solver_by_name};
pub use truegrind_calibration::identification::start::StartError;
pub use truegrind_calibration::identification::tolerance::Tolerance;
pub use truegrind_calibration::tracking::{
    Alarm, Options as TrackOptions, State as TrackState, StateError as TrackStateError, TrackError, Tracker,
};

// Solvers.
pub use truegrind_estimation::estimate::{Estimate, Evaluations, Iteration, Termination};
pub use truegrind_estimation::problem::{NormalEquations, Prior, Problem};

// Programs.
pub use truegrind_programs::draft::{Draft, Step};
pub use truegrind_programs::edit::{EditError, Edits};
pub use truegrind_programs::motion::{
    Frame as ProgramFrame, JointTarget, Listing, Mark, Motion, MotionKind, MotionTarget, OpaqueRegion, Place,
    RobTarget, Role, Speed, Tool, WorkObject, Zone,
};
pub use truegrind_programs::nc::dialect::Dialect as NcDialect;
pub use truegrind_programs::nc::orientation::Angles as NcAngles;
pub use truegrind_programs::nc::setup::Setup as NcSetup;
pub use truegrind_programs::nc::writer::write as write_nc;
pub use truegrind_programs::rapid::writer::write as write_rapid;
pub use truegrind_programs::reading::{Language, Program};
pub use truegrind_programs::rewrite::{
    Change, FileEdits, NewTarget, RewriteOptions, RewriteOutcome, Rewritten,
};

// Surfaces, tool paths and measurement plans.
pub use truegrind_planning::poses::{
    MeasurementSetup, Options as PosesOptions, Plan as PosesPlan, PlanError, plan as plan_poses,
};
pub use truegrind_planning::taught_cell::taught_cell;
pub use truegrind_planning::toolpath::{Toolpath, ToolpathError, toolpath};
pub use truegrind_surfaces::{Contact, Domain, Mesh, Surface, SurfaceFile};

// Compensation.
pub use truegrind_compensation::cell::{Cell, CellError, CellFrame, FrameOrigin, Teaches};
pub use truegrind_compensation::compensate::{CompensateError, Compensated, compensate};
pub use truegrind_compensation::cut::Cuts;
pub use truegrind_compensation::deviation::{After, Deviation, MotionStatus, PathPoint, PathReport};
pub use truegrind_compensation::options::{Circles, Emit, Options as CompensateOptions};
pub use truegrind_compensation::plan::reason::OutcomeReason;
pub use truegrind_compensation::plan::{MotionOutcome, Plan as CompensatePlan};
pub use truegrind_compensation::verify::{ActingArm, VerificationTask, verify};

// Reports.
pub use truegrind_report::document::{Block, Document, Figure};
pub use truegrind_report::format;
pub use truegrind_report::table::{Column, Table};

// The crates.
pub use truegrind_arm as arm;
pub use truegrind_calibration as calibration;
pub use truegrind_compensation as compensation;
pub use truegrind_estimation as estimation;
pub use truegrind_math as math;
pub use truegrind_papers as papers;
#[cfg(feature = "visual")]
pub use truegrind_pictures as pictures;
pub use truegrind_planning as planning;
pub use truegrind_programs as programs;
pub use truegrind_report as report;
pub use truegrind_surfaces as surfaces;
