//! `truegrind compensate PROGRAM… --model MODEL.toml -o OUT`.

use std::path::{Path, PathBuf};

use anyhow::{anyhow, bail};
use clap::{Args, ValueEnum};
use truegrind::compensation::cell::Cell;
use truegrind::compensation::deviation::{After, PathReport, Status};
use truegrind::compensation::rewrite::{Emit, Options, Plan, plan};
use truegrind::kinematics::condition::Condition;
use truegrind::kinematics::estimated::Estimated;
use truegrind::program::motion::Mark;
use truegrind::program::rapid::{Task, task_list};
use truegrind::program::rewrite::{Outcome, RewriteOptions};
use truegrind::report::compensation::{self as view, ProgramFile};
use truegrind::surface::SurfaceFile;

use super::files::{self, Batch};
use super::inputs::NamedModel;
use super::outputs::Outputs;
use super::progress::Work;
use super::{Common, Ending, inputs, on_threads};

/// What is written.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
pub(super) enum EmitArgument {
    /// Moved robtargets.
    Targets,
    /// Joint targets.
    Joints,
}

/// What is known of the cell, for rewriting and judging.
#[derive(Debug, Clone, Args)]
pub(super) struct CellArguments {
    /// Origins of tools and work objects: metrology, or taught with their teaching points.
    #[arg(long, value_name = "CELL.toml")]
    pub(super) cell: Option<PathBuf>,
    /// The surface that is ground, for deviations along its normal.
    #[arg(long, value_name = "SURFACE.toml")]
    pub(super) surface: Option<PathBuf>,
    /// Mass at the flange while the program runs (kg).
    #[arg(long, value_name = "KG")]
    pub(super) payload: Option<f64>,
}

impl CellArguments {
    /// The cell, the surface and the condition, starting from that of the model.
    pub(super) fn read(
        &self,
        model: Option<&Estimated>,
    ) -> anyhow::Result<(Cell, Option<SurfaceFile>, Condition)> {
        let cell = match &self.cell {
            Some(path) => {
                Cell::from_toml(&files::read_text(path)?).map_err(|e| anyhow!("{}: {e}", path.display()))?
            }
            None => Cell::default(),
        };
        let surface = self.surface.as_deref().map(super::path::surface).transpose()?;
        let mut condition = model.map(|m| m.condition).unwrap_or_default();
        condition.payload_kg = self.payload.or(condition.payload_kg);
        Ok((cell, surface, condition))
    }
}

/// Arguments of `compensate`.
#[derive(Debug, Args)]
pub(super) struct Arguments {
    /// RAPID modules of one task, or a .pgf list of them.
    #[arg(required = true)]
    programs: Vec<PathBuf>,
    /// An estimated arm, or the word `nominal`, with which no byte changes.
    #[arg(long)]
    model: String,
    /// Robot; optional where the model says it, and checked against it.
    #[arg(long)]
    robot: Option<String>,
    /// A file for one program, a folder for several.
    #[arg(short, long, value_name = "OUT")]
    output: Option<PathBuf>,
    /// Moved robtargets or joint targets.
    #[arg(long, value_enum, default_value_t = EmitArgument::Targets)]
    emit: EmitArgument,
    /// How far the path between two targets may leave the intended line (mm).
    #[arg(long, value_name = "MM", default_value_t = 0.05)]
    tolerance: f64,
    /// Largest correction that is written (mm); a larger one is refused.
    #[arg(long, value_name = "MM", default_value_t = 10.0)]
    max_correction: f64,
    /// Rewrite joint targets (MoveAbsJ) too.
    #[arg(long)]
    joint_targets: bool,
    #[command(flatten)]
    cell: CellArguments,
    /// Plan and report, write no program.
    #[arg(long)]
    dry_run: bool,
    /// Like --dry-run, and end with exit code 1 where anything would change.
    #[arg(long)]
    check: bool,
    /// Correct a program again that carries the mark of another model: corrections add up.
    #[arg(long)]
    again: bool,
    #[command(flatten)]
    common: Common,
    #[command(flatten)]
    outputs: Outputs,
}

/// Programs of one task, read.
pub(super) struct Programs {
    /// Files, in the order of the listing.
    pub(super) files: Vec<(PathBuf, Vec<u8>)>,
}

impl Programs {
    /// Reads modules; a `.pgf` stands for the modules that it lists.
    pub(super) fn read(paths: &[PathBuf]) -> anyhow::Result<Self> {
        let mut files = Vec::new();
        for path in paths {
            let bytes = files::read(path)?;
            if path.extension().is_some_and(|e| e.eq_ignore_ascii_case("pgf")) {
                for module in task_list::modules(&bytes) {
                    let place = inputs::beside(path, &module);
                    files.push((place.clone(), files::read(&place)?));
                }
            } else {
                files.push((path.clone(), bytes));
            }
        }
        if files.is_empty() {
            bail!("no module to read: the task list names none");
        }
        Ok(Self { files })
    }

    /// The task.
    pub(super) fn task(&self) -> Task<'_> {
        let names: Vec<String> = self.files.iter().map(|(p, _)| files::name(p)).collect();
        let sources: Vec<(&str, &[u8])> =
            names.iter().zip(&self.files).map(|(n, (_, b))| (n.as_str(), b.as_slice())).collect();
        Task::read(&sources)
    }
}

pub(super) fn run(arguments: &Arguments) -> anyhow::Result<Ending> {
    let dry = arguments.dry_run || arguments.check;
    let programs = Programs::read(&arguments.programs)?;
    let targets = outputs_of(arguments, &programs, dry)?;
    let inputs_of: Vec<&Path> = programs.files.iter().map(|(p, _)| p.as_path()).collect();
    let mut checked: Vec<&Path> = arguments.outputs.files();
    if programs.files.len() == 1 {
        checked.extend(targets.iter().flatten().map(PathBuf::as_path));
    }
    Batch::check(&inputs_of, &checked)?;
    for (value, name) in
        [(arguments.tolerance, "--tolerance"), (arguments.max_correction, "--max-correction")]
    {
        if !(value > 0.0 && value.is_finite()) {
            bail!("{name} {value}: expected a length above 0 in mm");
        }
    }
    let model = inputs::model(&arguments.model)?;
    refuse_compensating_controller(arguments.robot.as_deref())?;
    let (_, nominal) = inputs::nominal(&model, arguments.robot.as_deref())?;
    let task = programs.task();
    if let Some(ending) = already(arguments, &model, &task, &programs)? {
        return Ok(ending);
    }
    let NamedModel::Estimated { hash, arm, name, .. } = &model else {
        return unchanged(&programs, &targets);
    };
    debug_assert_eq!(nominal, arm.nominal);
    let (cell, surface, condition) = arguments.cell.read(Some(arm.as_ref()))?;
    let options = Options {
        emit: match arguments.emit {
            EmitArgument::Targets => Emit::Targets,
            EmitArgument::Joints => Emit::Joints,
        },
        tolerance_mm: arguments.tolerance,
        max_correction_mm: arguments.max_correction,
        joint_targets: arguments.joint_targets,
        condition,
        points: arguments.outputs.of_points(),
        ..Options::default()
    };
    let work = Work::start(format!("rewriting {} motions", task.listing.motions.len()));
    let mut planned = on_threads(arguments.common.threads, || plan(&task.listing, arm, &cell, &options))?;
    let rewrite = RewriteOptions {
        mark: Some(Mark { version: env!("CARGO_PKG_VERSION").to_owned(), model: hash.clone() }),
        ..RewriteOptions::default()
    };
    let rewritten = task.rewrite(&planned.changes, &rewrite)?;
    for (change, outcome) in planned.changes.iter().zip(&rewritten.outcomes) {
        let row = &mut planned.outcomes[change.motion as usize];
        match outcome {
            Outcome::Unchanged if row.status == Status::Changed => row.status = Status::Left,
            Outcome::Refused(reason) => {
                row.status = Status::Refused;
                row.reason = Some(truegrind::compensation::why::Why::Program(*reason));
                row.after_mm = row.before_mm;
            }
            _ => {}
        }
    }
    drop(work);
    if let Some(surface) = &surface {
        add_normals(&mut planned, surface);
    }
    let files: Vec<ProgramFile> = programs
        .files
        .iter()
        .zip(&targets)
        .map(|((path, _), target)| ProgramFile {
            file: path.display().to_string(),
            output: target.as_ref().map(|t| t.display().to_string()),
        })
        .collect();
    arguments.outputs.print(&view::summary(&planned, &task.listing, &files));
    let report = PathReport {
        program: programs.files.iter().map(|(p, _)| files::name(p)).collect::<Vec<_>>().join(", "),
        model: name.clone(),
        after: After::PredictedRemainder,
        points: std::mem::take(&mut planned.points),
        held_out_mm: Some(arm.geometry.held_out.rmse),
    };
    let mut batch = Batch::sparing(&inputs_of);
    let reports = std::slice::from_ref(&report);
    arguments.outputs.add_made(
        &mut batch,
        || view::document(&planned, &task.listing, &files, reports),
        || truegrind::report::deviation::table(&report),
        || view::json(&planned, &task.listing, &files),
    )?;
    #[cfg(feature = "visual")]
    if let Some(path) = &arguments.outputs.rrd {
        let bytes = super::view::path(
            &report.program,
            &arm.model,
            "estimated arm",
            condition,
            reports,
            surface.as_ref(),
        )?;
        batch.add(path, bytes);
    }
    let mut changed = false;
    for (((_, source), edits), target) in programs.files.iter().zip(&rewritten.files).zip(&targets) {
        changed |= !edits.edits.is_empty();
        if edits.unmarked {
            eprintln!("note: a fragment without MODULE was changed and carries no mark");
        }
        if let Some(target) = target {
            batch.add(target, edits.edits.apply(source)?);
        }
    }
    if !dry
        && programs.files.len() > 1
        && let Some(folder) = &arguments.output
    {
        files::make_folder(folder)?;
    }
    batch.write()?;
    let clean = planned.outcomes.iter().all(|o| matches!(o.status, Status::Changed | Status::Left));
    let would_change = arguments.check && changed;
    Ok(if clean && !would_change { Ending::Done } else { Ending::Flagged })
}

/// Where each program goes.
fn outputs_of(arguments: &Arguments, programs: &Programs, dry: bool) -> anyhow::Result<Vec<Option<PathBuf>>> {
    if dry {
        return Ok(vec![None; programs.files.len()]);
    }
    let Some(output) = &arguments.output else {
        bail!("-o OUT is missing: a file for one program, a folder for several (or --dry-run)");
    };
    if programs.files.len() == 1 && !output.is_dir() {
        return Ok(vec![Some(output.clone())]);
    }
    if output.is_file() {
        bail!(
            "{} is a file, but there are {} programs: name a folder",
            output.display(),
            programs.files.len()
        );
    }
    Ok(programs.files.iter().map(|(p, _)| Some(output.join(files::name(p)))).collect())
}

/// A controller that compensates by itself must not be compensated twice.
fn refuse_compensating_controller(robot: Option<&str>) -> anyhow::Result<()> {
    if let Some(name) = robot {
        let robot = inputs::robot(name)?;
        if robot.sheet.compensates {
            bail!(
                "{}: its controller already compensates (robot file, `compensates = true`); switch one of the two off",
                robot.sheet.name
            );
        }
    }
    Ok(())
}

/// What the marks of earlier runs mean for this one.
fn already(
    arguments: &Arguments,
    model: &NamedModel,
    task: &Task<'_>,
    programs: &Programs,
) -> anyhow::Result<Option<Ending>> {
    let NamedModel::Estimated { hash, .. } = model else { return Ok(None) };
    for (mark, (path, _)) in task.listing.marks.iter().zip(&programs.files) {
        let Some(mark) = mark else { continue };
        if mark.model == *hash {
            println!("{}: already compensated with this model; nothing written", path.display());
            return Ok(Some(Ending::Flagged));
        }
        if !arguments.again {
            bail!(
                "{}: already compensated with another model ({}): take the original program, or say --again, with which the \
                 corrections add up",
                path.display(),
                mark.model
            );
        }
        eprintln!(
            "note: {}: compensated before with model {}; corrections add up",
            path.display(),
            mark.model
        );
    }
    Ok(None)
}

/// The model `nominal`: the same bytes.
fn unchanged(programs: &Programs, targets: &[Option<PathBuf>]) -> anyhow::Result<Ending> {
    let mut batch = Batch::sparing(programs.files.iter().map(|(p, _)| p));
    for ((_, bytes), target) in programs.files.iter().zip(targets) {
        if let Some(target) = target {
            batch.add(target, bytes.clone());
        }
    }
    println!("model nominal: nothing to correct, every byte stays");
    batch.write()?;
    Ok(Ending::Done)
}

/// Deviations along the normal of the surface that is ground.
pub(super) fn add_normals(plan: &mut Plan, surface: &SurfaceFile) {
    for point in &mut plan.points {
        let in_object = point.base_from_object.inverse() * point.intended;
        let foot = surface.surface.foot(&nalgebra::Point3::from(in_object.translation.vector));
        let Some(foot) = foot else { continue };
        let normal = foot.contact.normal.into_inner();
        point.cutting &= foot.normal_mm.abs() < 0.5;
        point.normal = Some(normal);
        for deviation in [&mut point.before, &mut point.after].into_iter().flatten() {
            deviation.normal_mm = Some(normal.dot(&deviation.vector_mm));
        }
    }
}
