//! Compensation and deviation of programs.

use std::path::{Path, PathBuf};

use pyo3::prelude::*;
use pyo3::types::{PyBytes, PyDict, PyList, PyMapping, PySequence, PyString};
use truegrind::compensation::cell::Used;
use truegrind::compensation::cell::nc_setup::cell_setup;
use truegrind::compensation::cell::robot_match::{
    UnreachableMotions, cell_robot_mismatch, program_robot_mismatch, unreachable_motions,
};
use truegrind::compensation::condition::stated::StatedCondition;
use truegrind::compensation::deviation::files_of;
use truegrind::compensation::frames::surface_frames::surface_frame_contradictions;
use truegrind::compensation::frames::taught::contradictions;
use truegrind::compensation::risk::placement::Placement;
use truegrind::file_kind::FileKind;
use truegrind::math::work::report_step;
use truegrind::programs::rapid::task_list;
use truegrind::report::compensation::{self as view, ProgramFile};
use truegrind::report::{deviation as deviations, format};
use truegrind::{
    ActingArm, After, Cell, Circles, CompensateOptions, CompensatePlan, Compensated, Condition, Cuts, Emit,
    Estimated, Listing, Mark, MotionStatus, NcSetup, PathReport, Program, SurfaceFile, VerificationTask,
    compensate, verify,
};

use crate::errors::{Kind, Refusal};
use crate::files;
use crate::fits::at_most;
use crate::interruptible::run;
use crate::model::{PyModel, named};
use crate::robot::PyArm;
use crate::types::{
    Columns, Counts, Dictionaries, Files, NamedModel, Object, PathOrText, ProgramFiles, Progress, Typed,
};

/// The files of one program, with their names in reports.
pub(crate) struct Sources {
    pub(crate) files: Vec<(String, Vec<u8>)>,
}

impl Sources {
    /// The parsed program; file names without folders, as on the controller.
    pub(crate) fn task<'s>(&'s self, setup: &NcSetup) -> Program<'s> {
        let plain: Vec<(&str, &[u8])> =
            self.files.iter().map(|(name, bytes)| (last(name), bytes.as_slice())).collect();
        Program::read(&plain, setup)
    }

    pub(crate) fn name(&self) -> String {
        self.files.iter().map(|(name, _)| last(name)).collect::<Vec<_>>().join(", ")
    }
}

fn last(name: &str) -> &str {
    Path::new(name).file_name().and_then(|name| name.to_str()).unwrap_or(name)
}

/// A program: a path, several paths of modules of one task, or a dictionary of names and texts.
pub(crate) fn sources(given: &Bound<'_, PyAny>) -> PyResult<Sources> {
    let mut out = Vec::new();
    if let Ok(named) = given.cast::<PyMapping>() {
        for entry in named.items()?.iter() {
            let (name, text): (String, Bound<'_, PyAny>) = entry.extract()?;
            let bytes = match text.cast::<PyBytes>() {
                Ok(bytes) => bytes.as_bytes().to_vec(),
                Err(_) => text.extract::<String>()?.into_bytes(),
            };
            out.push((name, bytes));
        }
    } else if let Some(text) = whole_program(given) {
        let expected = "a path, a list of paths, or a dictionary of names and texts: {\"name.mod\": text}";
        return Err(Refusal::argument("program", text, expected).into());
    } else if given.cast::<PyString>().is_err() && given.cast::<PySequence>().is_ok() {
        for path in given.try_iter()? {
            read(&path?, &mut out)?;
        }
    } else {
        read(given, &mut out)?;
    }
    if out.is_empty() {
        return Err(
            Refusal::argument("program", "nothing", "a program's file, or several of one task").into()
        );
    }
    Ok(Sources { files: out })
}

/// The program itself in place of its path.
fn whole_program(given: &Bound<'_, PyAny>) -> Option<String> {
    let text = given.cast::<PyString>().ok().and_then(|text| text.to_str().ok());
    let bytes = given.cast::<PyBytes>().is_ok();
    (bytes || text.is_some_and(|text| text.contains('\n'))).then(|| given.to_string())
}

/// Reads a file; a task list is replaced by the modules that it names.
fn read(given: &Bound<'_, PyAny>, out: &mut Vec<(String, Vec<u8>)>) -> PyResult<()> {
    let path: PathBuf = given.extract().map_err(|_| {
        Refusal::argument("program", given, "a path, a list of paths, or a dictionary of names and texts")
    })?;
    let bytes = files::read(&path)?;
    if !path.extension().is_some_and(|ending| ending.eq_ignore_ascii_case("pgf")) {
        out.push((path.display().to_string(), bytes));
        return Ok(());
    }
    let folder = path.parent().unwrap_or(Path::new(""));
    for module in task_list::modules(&bytes) {
        let plain = module.replace('\\', "/");
        if plain.split('/').any(|part| part == "..") || Path::new(&plain).is_absolute() {
            let message = format!(
                "{}: {module}: lies outside the folder of that task list: give its path",
                path.display()
            );
            return Err(Refusal::new(Kind::Program, message).into());
        }
        let place = folder.join(plain);
        out.push((place.display().to_string(), files::read(&place)?));
    }
    Ok(())
}

/// A text or a path: a string with a line break or `text:` is a text.
pub(crate) fn text(given: &Bound<'_, PyAny>, kind: Kind) -> PyResult<(String, Option<PathBuf>)> {
    if let Ok(text) = given.cast::<PyString>() {
        let text = text.to_str()?;
        if text.contains('\n') {
            return Ok((text.to_owned(), None));
        }
    }
    let path: PathBuf = given.extract()?;
    Ok((files::read_text(&path, kind)?, Some(path)))
}

/// The cell.
struct Place {
    cell: Cell,
    surface: Option<SurfaceFile>,
}

impl Place {
    fn read(cell: Option<&Bound<'_, PyAny>>, surface: Option<PathBuf>) -> PyResult<Self> {
        let cell = match cell {
            None => Cell::default(),
            Some(given) => {
                let (text, path) = text(given, Kind::Cell)?;
                let name = path.as_ref().map_or("cell".to_owned(), |path| path.display().to_string());
                let kind = FileKind::of(&name, text.as_bytes());
                if kind == Some(FileKind::Empty) {
                    let message = format!("{name}: this file is empty; expected a cell file (cell_file)");
                    return Err(Refusal::new(Kind::Cell, message).of_file(&name).into());
                }
                let cell = Cell::from_toml(&text).map_err(|error| {
                    if let Some(other) = kind.filter(|kind| *kind != FileKind::Cell) {
                        let message = format!("{name}: {}; expected a cell file (cell_file)", other.text());
                        return Refusal::from(error).saying(message).of_file(&name);
                    }
                    let message = format!(
                        "{name}: {}; a cell file lists [[tool]] and [[wobj]]",
                        error.to_string().trim_end()
                    );
                    Refusal::from(error).saying(message).of_file(&name)
                })?;
                if let Some(first) = cell.open.first() {
                    let message = format!("{name}: not filled in yet: {first}");
                    return Err(Refusal::new(Kind::Cell, message).of_file(&name).into());
                }
                cell
            }
        };
        let surface = surface.map(|path| read_surface(&path)).transpose()?;
        let cell = match &surface {
            Some(surface) => cell.with_surface(surface).map_err(Refusal::from)?,
            None => cell,
        };
        Ok(Self { cell, surface })
    }
}

pub(crate) fn read_surface(path: &Path) -> PyResult<SurfaceFile> {
    let bytes = files::read(path)?;
    let name = path.display().to_string();
    let resolve = |mesh: &str| {
        let beside = path.parent().unwrap_or(Path::new("")).join(mesh);
        files::read(&beside).map_err(|error| error.to_string())
    };
    let read = SurfaceFile::read(&name, &bytes, resolve);
    Ok(read.map_err(|error| Refusal::new(Kind::Program, error).of_file(&name))?)
}

/// For each file, whether it carries the mark of this model.
///
/// # Errors
/// A file carries the mark of another model.
fn marked(listing: &Listing, sources: &Sources, hash: &str, again: bool) -> Result<Vec<bool>, Refusal> {
    let mut out = vec![false; sources.files.len()];
    for ((mark, (name, _)), marked) in listing.marks.iter().zip(&sources.files).zip(&mut out) {
        let Some(mark) = mark else { continue };
        if mark.model == hash {
            *marked = true;
        } else if !again {
            let message = format!(
                "{name}: already compensated with another model ({}): use the original program, or again=True to add this correction to that one",
                mark.model
            );
            let told = Refusal::new(Kind::Program, message).of_file(name);
            return Err(told.with(format!("the mark of model {}", mark.model), "an original program"));
        }
    }
    Ok(out)
}

/// A corrected program.
#[pyclass(name = "Compensation", module = "truegrind", frozen)]
pub(crate) struct PyCompensation {
    sources: Sources,
    corrected: Vec<Vec<u8>>,
    plan: CompensatePlan,
    listing: Listing,
    report: PathReport,
    unused: Vec<String>,
}

impl PyCompensation {
    fn files(&self) -> Vec<ProgramFile> {
        let files = self.sources.files.iter().zip(&self.corrected);
        files
            .map(|((name, source), corrected)| ProgramFile {
                file: name.clone(),
                output: None,
                unchanged: source == corrected,
            })
            .collect()
    }
}

#[pymethods]
impl PyCompensation {
    /// The corrected files: bytes by name.
    #[getter]
    fn programs<'py>(&self, py: Python<'py>) -> PyResult<Typed<Files, Bound<'py, PyDict>>> {
        let out = PyDict::new(py);
        for ((name, _), bytes) in self.sources.files.iter().zip(&self.corrected) {
            out.set_item(name, PyBytes::new(py, bytes))?;
        }
        Ok(out.into())
    }

    /// Whether any byte changes.
    #[getter]
    fn changed(&self) -> bool {
        self.sources.files.iter().zip(&self.corrected).any(|((_, old), new)| old != new)
    }

    /// Writes the corrected files to a folder, or a single file to a path. Originals are never overwritten.
    fn save(&self, path: PathBuf) -> PyResult<()> {
        let places: Vec<PathBuf> = match self.sources.files.as_slice() {
            [_] if !path.is_dir() => vec![path],
            all => {
                std::fs::create_dir_all(&path)?;
                all.iter().map(|(name, _)| path.join(last(name))).collect()
            }
        };
        for place in &places {
            let there = place.canonicalize().ok();
            let same = |(name, _): &&(String, Vec<u8>)| {
                there.is_some() && Path::new(name).canonicalize().ok() == there
            };
            if let Some((name, _)) = self.sources.files.iter().find(same) {
                let message = format!("{name}: is the original program: give another place");
                return Err(Refusal::new(Kind::Program, message).of_file(name).into());
            }
        }
        places.iter().zip(&self.corrected).try_for_each(|(place, bytes)| files::write(place, bytes))
    }

    /// Status of each motion: dictionaries as in the JSON.
    #[getter]
    fn motions<'py>(&self, py: Python<'py>) -> PyResult<Typed<Dictionaries, Bound<'py, PyList>>> {
        let whole = py.import("json")?.call_method1("loads", (self.to_json()?,))?;
        let out = PyList::empty(py);
        for program in whole.get_item("programs")?.try_iter()? {
            for motion in program?.get_item("motions")?.try_iter()? {
                out.append(motion?)?;
            }
        }
        Ok(out.into())
    }

    /// Number of motions by status: changed, flagged, refused, left.
    #[getter]
    fn counts<'py>(&self, py: Python<'py>) -> PyResult<Typed<Counts, Bound<'py, PyDict>>> {
        let out = PyDict::new(py);
        for (word, status) in [
            ("changed", MotionStatus::Changed),
            ("flagged", MotionStatus::Flagged),
            ("refused", MotionStatus::Refused),
            ("left", MotionStatus::Left),
        ] {
            out.set_item(word, self.plan.outcomes.iter().filter(|outcome| outcome.status == status).count())?;
        }
        Ok(out.into())
    }

    /// Notes on tools and work objects, and on unused entries of the cell file.
    #[getter]
    fn notes(&self) -> Vec<String> {
        self.plan.notes.iter().chain(&self.unused).cloned().collect()
    }

    /// The full result as JSON text, schema ``truegrind.compensation/1``: the bytes that ``truegrind compensate --dry-run --json`` writes.
    fn to_json(&self) -> PyResult<String> {
        crate::json(&view::json(&self.plan, &self.listing, &self.files()))
    }

    /// The report as HTML.
    fn to_html(&self) -> String {
        let reports = std::slice::from_ref(&self.report);
        format::html::document(&view::document(&self.plan, &self.listing, &self.files(), reports))
    }

    fn _repr_html_(&self) -> String {
        crate::framed(&self.to_html())
    }

    fn __repr__(&self) -> String {
        format!("<Compensation of {}: {}>", self.sources.name(), view::coverage(&self.plan))
    }
}

/// Corrects a program so that the real arm follows the intended path. ``program``: a path, a list of paths (modules of one task) or a
/// dictionary of names and texts. ``cell``: a cell file or its text. ``surface``: a surface file. ``placement``: correct shape and place
/// of the path in each work object ("absolute"), its shape alone ("shape"), or the place only where the model knows it better than it
/// is off ("auto"). ``temperature_c``: temperature of the arm while the program runs, if the model says how its links grow; by default
/// that of the measurement. A cut is left unchanged if its correction makes it worse with a probability above ``max_risk``. Nothing is written;
/// use ``Compensation.save``.
#[pyfunction]
#[pyo3(
    name = "compensate",
    signature = (
        program, model, *, cell = None, surface = None, payload_kg = None, payload_centre_mm = None, temperature_c = None,
        emit: "Literal['targets', 'joints']" = "targets", circles: "Literal['keep', 'segments']" = "keep", tolerance_mm = 0.05,
        max_correction_mm = 10.0, partial = false, placement: "Literal['auto', 'shape', 'absolute']" = "auto", max_risk = 0.1,
        joint_targets = false, again = false, allow_doubtful = false, threads = None, progress = None
    )
)]
#[expect(clippy::too_many_arguments, reason = "keywords, as the options of the command line")]
pub(crate) fn compensate_(
    py: Python<'_>,
    program: Object<'_, ProgramFiles>,
    model: Object<'_, NamedModel>,
    cell: Option<Object<'_, PathOrText>>,
    surface: Option<PathBuf>,
    payload_kg: Option<f64>,
    payload_centre_mm: Option<[f64; 3]>,
    temperature_c: Option<f64>,
    emit: &str,
    circles: &str,
    tolerance_mm: f64,
    max_correction_mm: f64,
    partial: bool,
    placement: &str,
    max_risk: f64,
    joint_targets: bool,
    again: bool,
    allow_doubtful: bool,
    threads: Option<i64>,
    progress: Option<Object<'_, Progress>>,
) -> PyResult<PyCompensation> {
    if !(0.0..=1.0).contains(&max_risk) {
        return Err(Refusal::argument("max_risk", max_risk, "a probability from 0 to 1").into());
    }
    let mut kept = None;
    let estimated = named(&model, &mut kept)?;
    estimated.allowed(allow_doubtful)?;
    let sources = sources(&program)?;
    let place = Place::read(cell.as_deref(), surface)?;
    let stated = StatedCondition { payload_kg, payload_centre_mm, temperature_c };
    let options = CompensateOptions {
        emit: match emit {
            "targets" => Emit::Targets,
            "joints" => Emit::Joints,
            other => return Err(Refusal::argument("emit", other, "\"targets\" or \"joints\"").into()),
        },
        circles: match circles {
            "keep" => Circles::Keep,
            "segments" => Circles::Segments,
            other => return Err(Refusal::argument("circles", other, "\"keep\" or \"segments\"").into()),
        },
        tolerance_mm: at_most("tolerance_mm", tolerance_mm, CompensateOptions::MAX_TOLERANCE_MM)?,
        max_correction_mm: at_most(
            "max_correction_mm",
            max_correction_mm,
            CompensateOptions::MAX_CORRECTION_MM,
        )?,
        joint_targets,
        cuts: if partial { Cuts::Partial } else { Cuts::Whole },
        placement: match placement {
            "auto" => Placement::Auto,
            "shape" => Placement::Shape,
            "absolute" => Placement::Absolute,
            other => {
                let expected = "\"auto\", \"shape\" or \"absolute\"";
                return Err(Refusal::argument("placement", other, expected).into());
            }
        },
        max_risk,
        condition: stated.on(Some(&estimated.arm)).map_err(Refusal::from)?,
        points: true,
        ..CompensateOptions::default()
    };
    let own_loads = payload_kg.is_none();
    run(py, threads, progress.as_deref(), || corrected(sources, estimated, place, options, own_loads, again))
}

fn corrected(
    sources: Sources,
    model: &PyModel,
    place: Place,
    options: CompensateOptions,
    own_loads: bool,
    again: bool,
) -> Result<PyCompensation, Refusal> {
    let arm: &Estimated = &model.arm;
    let Place { cell, surface } = place;
    agreed(&sources, &cell, arm)?;
    report_step(&format!("reading {}", sources.name()));
    let setup = cell_setup(&cell);
    let mut program = sources.task(&setup);
    let loads = own_loads.then(|| program.loads());
    // The syntax trees are larger than the file and not needed once the motions are listed.
    program.drop_trees();
    let program = program;
    let listing = program.listing();
    refuse_marked(listing, &sources, &model.hash, again)?;
    let found: Vec<String> =
        surface.iter().flat_map(|surface| surface_frame_contradictions(listing, surface)).collect();
    if !found.is_empty() {
        let message = format!("{}: {}", sources.name(), found.join("; "));
        return Err(Refusal::new(Kind::Cell, message).of_file(&sources.name()));
    }
    let options = CompensateOptions { loads, ..options };
    let mark = Mark { version: env!("CARGO_PKG_VERSION").into(), model: model.hash.clone(), partial: false };
    report_step(&format!("rewriting {}", sources.name()));
    let Compensated { mut plan, rewritten } = compensate(&program, arm, &cell, &options, Some(mark))?;
    if let Some(found) = unreachable_motions(&plan) {
        return Err(unreachable(&found, &sources.name(), arm, &model.name));
    }
    if let Some(surface) = &surface {
        plan.add_normals(surface);
    }
    let apply = |((_, source), file): (&(String, Vec<u8>), &truegrind::FileEdits)| {
        file.edits.apply(source).map_err(|error| Refusal::new(Kind::Defect, error))
    };
    let corrected = sources.files.iter().zip(&rewritten.files).map(apply).collect::<Result<_, _>>()?;
    let report = PathReport {
        program: sources.name(),
        files: files_of(listing),
        model: model.name.clone(),
        after: After::PredictedRemainder,
        missing: plan.missing_motions(listing),
        points: std::mem::take(&mut plan.points),
        differences: Vec::new(),
        between: None,
        held_out_mm: Some(arm.calibrated.held_out.rmse),
        turn_sigma_rad: None,
        assumptions: Vec::new(),
    };
    let unused = Used::by(listing, &cell).notes(&cell, surface.as_ref());
    let listing = listing.clone();
    drop((program, rewritten));
    Ok(PyCompensation { sources, corrected, plan, listing, report, unused })
}

/// Refuses a program that was compensated with this model.
fn refuse_marked(listing: &Listing, sources: &Sources, hash: &str, again: bool) -> Result<(), Refusal> {
    let marked = marked(listing, sources, hash, again)?;
    let Some(done) = marked.iter().position(|marked| *marked) else { return Ok(()) };
    let name = &sources.files[done].0;
    let message = format!("{name} is already compensated with this model: give the original program");
    let told = Refusal::new(Kind::Program, message).of_file(name);
    Err(told.with("the mark of this model", "an original program"))
}

/// Refuses a program of which hardly a motion is in reach.
fn unreachable(found: &UnreachableMotions, name: &str, arm: &Estimated, model: &str) -> Refusal {
    let motions = found.count;
    if let Some((_, error)) = found.example.as_ref().filter(|_| 2 * found.other_configuration > motions) {
        let message = format!(
            "{name}: {} of the motions are in reach of {} only in other configurations than the program states ({error}): correct the \
             configuration data, or use the model of the robot that runs it",
            found.other_configuration, arm.robot
        );
        let told = Refusal::new(Kind::Program, message).of_file(name);
        return told.with(error.to_string(), "the configurations of this robot");
    }
    let message = format!(
        "{name}: hardly any of the {motions} motions is in reach of {} ({model}): the program belongs to another robot, or its tool and work \
         object are somewhere else (cell=); use the model of the robot that runs it",
        arm.robot
    );
    let told = Refusal::new(Kind::Program, message).of_file(name);
    told.with(format!("hardly any of {motions} motions in reach"), "a program of this robot")
}

/// Refuses a cell or a program of another robot.
fn agreed(sources: &Sources, cell: &Cell, arm: &Estimated) -> Result<(), Refusal> {
    let (robot, nominal) = (&arm.robot, &arm.nominal);
    if let Some(fault) = cell_robot_mismatch(cell, robot, nominal) {
        return Err(Refusal::new(Kind::Cell, fault));
    }
    let fault = sources.files.iter().find_map(|(name, bytes)| {
        program_robot_mismatch(last(name), bytes, robot, nominal).map(|fault| (name, fault))
    });
    fault.map_or(Ok(()), |(name, fault)| Err(Refusal::new(Kind::Program, fault).of_file(name)))
}

/// Deviation of a program on an arm.
#[pyclass(name = "Deviation", module = "truegrind", frozen)]
pub(crate) struct PyDeviation {
    reports: Vec<PathReport>,
}

#[pymethods]
impl PyDeviation {
    /// The points of the path, one list per column of the table (mm, °); ``None`` for missing values.
    #[getter]
    fn points<'py>(&self, py: Python<'py>) -> PyResult<Object<'py, Columns>> {
        Ok(py.import("truegrind._results")?.call_method1("table", (self.to_csv(),))?.into())
    }

    /// The points as CSV text: the bytes that ``truegrind deviation --csv`` writes.
    fn to_csv(&self) -> String {
        format::csv::table(&deviations::whole_table(&self.reports))
    }

    /// The full result as JSON text, schema ``truegrind.deviation/1``: the bytes that ``truegrind deviation --json`` writes.
    fn to_json(&self) -> PyResult<String> {
        crate::json(&deviations::json(&self.reports))
    }

    /// The report as HTML.
    fn to_html(&self) -> String {
        format::html::document(&deviations::document(&self.reports))
    }

    fn _repr_html_(&self) -> String {
        crate::framed(&self.to_html())
    }

    fn __repr__(&self) -> String {
        let points: usize = self.reports.iter().map(|report| report.points.len()).sum();
        let name = self.reports.first().map_or("", |report| report.program.as_str());
        format!("<Deviation of {name}: {points} points>")
    }
}

/// Deviation of a program under a model; nothing is rewritten. With ``intended``, the original program defines the intended path, and
/// ``program`` is its corrected version; ``tolerance_mm`` is the largest deviation of its path between two targets. ``temperature_c``:
/// as for ``compensate``. With ``actual`` (an
/// ``Arm`` of a simulation) the programs are run on that arm.
#[pyfunction]
#[pyo3(
    name = "deviation",
    signature = (
        program, model, *, intended = None, actual = None, tolerance_mm = 0.05, cell = None, surface = None,
        payload_kg = None, payload_centre_mm = None, temperature_c = None, threads = None, progress = None
    )
)]
#[expect(clippy::too_many_arguments, reason = "keywords, as the options of the command line")]
pub(crate) fn deviation_(
    py: Python<'_>,
    program: Object<'_, ProgramFiles>,
    model: Object<'_, NamedModel>,
    intended: Option<Object<'_, ProgramFiles>>,
    actual: Option<PyRef<'_, PyArm>>,
    tolerance_mm: f64,
    cell: Option<Object<'_, PathOrText>>,
    surface: Option<PathBuf>,
    payload_kg: Option<f64>,
    payload_centre_mm: Option<[f64; 3]>,
    temperature_c: Option<f64>,
    threads: Option<i64>,
    progress: Option<Object<'_, Progress>>,
) -> PyResult<PyDeviation> {
    let tolerance_mm = at_most("tolerance_mm", tolerance_mm, CompensateOptions::MAX_TOLERANCE_MM)?;
    let mut kept = None;
    let estimated = named(&model, &mut kept)?;
    let programs = sources(&program)?;
    let originals = intended.as_deref().map(sources).transpose()?;
    let place = Place::read(cell.as_deref(), surface)?;
    let stated = StatedCondition { payload_kg, payload_centre_mm, temperature_c };
    let condition = stated.on(Some(&estimated.arm)).map_err(Refusal::from)?;
    let actual = actual.as_deref();
    let originals = originals.as_ref();
    let task = Run { estimated, actual, programs: &programs, originals, condition, tolerance_mm };
    run(py, threads, progress.as_deref(), || task.judged(&place, payload_kg.is_none()))
}

/// A program run on an arm.
struct Run<'a> {
    estimated: &'a PyModel,
    actual: Option<&'a PyArm>,
    programs: &'a Sources,
    originals: Option<&'a Sources>,
    condition: Condition,
    tolerance_mm: f64,
}

impl Run<'_> {
    fn judged(&self, place: &Place, own_loads: bool) -> Result<PyDeviation, Refusal> {
        let Place { cell, surface } = place;
        let arm: &Estimated = &self.estimated.arm;
        agreed(self.programs, cell, arm)?;
        let setup = cell_setup(cell);
        report_step(&format!("reading {}", self.programs.name()));
        let task = self.programs.task(&setup);
        let original = self.originals.map(|original| original.task(&setup));
        for program in original.iter().chain([&task]) {
            let mut found = contradictions(program.listing(), cell, &arm.nominal);
            found.extend(
                surface.iter().flat_map(|surface| surface_frame_contradictions(program.listing(), surface)),
            );
            if !found.is_empty() {
                return Err(Refusal::new(Kind::Cell, found.join("; ")));
            }
        }
        let loads = [original.as_ref().unwrap_or(&task), &task].map(|p| own_loads.then(|| p.loads()));
        let name = self.programs.name();
        let (model, named, knowledge, after) = match self.actual {
            Some(actual) => (&actual.model, format!("actual arm {}", actual.name), None, After::Achieved),
            None => (&arm.model, self.estimated.name.clone(), Some(arm), After::PredictedRemainder),
        };
        let judged = VerificationTask {
            original: original.as_ref().map_or(task.listing(), |original| original.listing()),
            rewritten: original.as_ref().map(|_| task.listing()),
            cell,
            surface: surface.as_ref().map(|surface| &surface.surface),
            program: &name,
            name: &named,
            after,
            tolerance_mm: self.tolerance_mm,
            loads: [loads[0].as_ref(), loads[1].as_ref()],
        };
        let acting = ActingArm { nominal: &arm.nominal, model, knowledge, condition: self.condition };
        report_step(&format!("running {name}"));
        let mut report = verify(&judged, &acting);
        report.differences.extend(original.iter().flat_map(|original| original.text_differences(&task)));
        if report.points.is_empty() {
            let message = format!("{name}: no motion has a target that is known from the text");
            let told = Refusal::new(Kind::Program, message).of_file(&name);
            return Err(told.with("no motion", "motions with targets in the text"));
        }
        Ok(PyDeviation { reports: vec![report] })
    }
}
