//! `truegrind view FILE…`: shows recordings, measurements, models and programs in Rerun.

use std::path::{Path, PathBuf};

use anyhow::{anyhow, bail};
use clap::Args;
use truegrind::arm::condition::Condition;
use truegrind::arm::estimated::Estimated;
use truegrind::arm::model::Joints;
use truegrind::calibration::identification::fit::{Start, errors_on, fit, frame_parameters};
use truegrind::calibration::identification::identify::{Options, prepare_observations};
use truegrind::calibration::identification::register::starting_frames;
use truegrind::calibration::identification::solver::SOLVERS;
use truegrind::calibration::identification::tolerance::Tolerance;
use truegrind::compensation::cell::Used;
use truegrind::compensation::cell::nc_setup::cell_setup;
use truegrind::compensation::deviation::{After, Deviation, MotionStatus, PathPoint, PathReport};
use truegrind::compensation::verify::{ActingArm, VerificationTask, verify};
use truegrind::math::se3::Pose;
use truegrind::pictures::measured::Residuals;
use truegrind::pictures::{self, MeasuredScene, PathScene, Recording};
use truegrind::programs::motion::MotionKind;
use truegrind::programs::reading::Language;

use super::cell_arguments::{CellArguments, note_unused_entries, refuse_contradictions};
use super::computation::{Common, on_threads};
use super::deviation::why_no_point;
use super::exit_status::ExitStatus;
use super::files::{self, Batch};
use super::inputs::{NamedModel, StatedRobot};
use super::programs::Programs;
use super::progress::Spinner;
use super::recording::{Arms, meshes, recording};
use super::robot_match;
use super::{identify, inputs};

/// Arguments of `view`.
#[derive(Debug, Args)]
pub(super) struct Arguments {
    /// Recordings (.rrd), measurements (.csv, .xlsx), models (.toml), programs (.mod and others).
    #[arg(required = true)]
    files: Vec<PathBuf>,
    /// Estimated arm that runs the programs or predicts the measurements.
    #[arg(long, value_name = "MODEL.toml")]
    model: Option<String>,
    #[command(flatten)]
    robot: StatedRobot,
    /// Sheet of a workbook. Default: the first with the needed columns.
    #[arg(long)]
    sheet: Option<String>,
    /// Write the recording instead of opening it.
    #[arg(long, value_name = "FILE.rrd")]
    rrd: Option<PathBuf>,
    #[command(flatten)]
    cell: CellArguments,
    #[command(flatten)]
    common: Common,
}

/// Kind of a file, by its extension and, for TOML, by its schema.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Kind {
    Recording,
    Measurements,
    Model,
    Program,
}

fn kind(path: &Path) -> anyhow::Result<Kind> {
    if !path.is_file() {
        bail!("{}: no such file", path.display());
    }
    let extension = path.extension().map(|e| e.to_string_lossy().to_lowercase()).unwrap_or_default();
    Ok(match extension.as_str() {
        "rrd" => Kind::Recording,
        "csv" | "xlsx" | "xls" | "xlsm" | "ods" => Kind::Measurements,
        "toml" => {
            let text = files::read_text(path)?;
            let table: toml::Table =
                text.parse().map_err(|e| anyhow!("{}: not TOML: {e}", path.display()))?;
            let schema = table.get("schema").and_then(|s| s.as_str()).unwrap_or_default();
            if schema != truegrind::arm::estimated::SCHEMA {
                bail!(
                    "{}: not a model file; of TOML files only models written by `truegrind identify -o` can be shown (for a \
                     surface, make its program with `truegrind path`)",
                    path.display()
                );
            }
            Kind::Model
        }
        _ if extension == "pgf" || Language::by_name(&files::name(path)).is_some() => Kind::Program,
        _ => bail!(
            "{}: expected a recording (.rrd), measurements (.csv, .xlsx), a model (.toml) or a program (.mod, .prg, .sys, \
             .pgf, .nc, .mpf and others)",
            path.display()
        ),
    })
}

pub(super) fn run(arguments: &Arguments) -> anyhow::Result<ExitStatus> {
    let kinds = arguments.files.iter().map(|f| kind(f)).collect::<anyhow::Result<Vec<_>>>()?;
    let of = |wanted: Kind| -> Vec<PathBuf> {
        arguments.files.iter().zip(&kinds).filter(|(_, k)| **k == wanted).map(|(f, _)| f.clone()).collect()
    };
    let programs = of(Kind::Program);
    let pictures = arguments.files.len() - programs.len().saturating_sub(1);
    if let Some(path) = &arguments.rrd {
        let inputs: Vec<&Path> = arguments.files.iter().map(PathBuf::as_path).collect();
        Batch::check(&inputs, &[path])?;
        if pictures != 1 || kinds[0] == Kind::Recording {
            bail!("--rrd {}: expected measurements, a model, or the programs of one task", path.display());
        }
    }
    for file in of(Kind::Recording) {
        Recording::open(&file)?;
    }
    let work = Spinner::start("drawing");
    let recordings = on_threads(arguments.common.threads, || -> anyhow::Result<Vec<Recording>> {
        let mut out = Vec::new();
        for file in of(Kind::Measurements) {
            out.push(measurements(arguments, &file)?);
        }
        for file in of(Kind::Model) {
            out.push(model(arguments, &file)?);
        }
        if !programs.is_empty() {
            out.push(program(arguments, &programs)?);
        }
        Ok(out)
    })??;
    drop(work);
    for recording in recordings {
        match &arguments.rrd {
            Some(path) => {
                let mut batch = Batch::sparing(&arguments.files);
                batch.add(path, recording.rrd()?);
                batch.write()?;
            }
            None => recording.spawn()?,
        }
    }
    Ok(ExitStatus::Done)
}

/// The model of `--model`; `None` if absent or nominal.
fn stated_model(arguments: &Arguments) -> anyhow::Result<Option<(String, Box<Estimated>)>> {
    let Some(name) = &arguments.model else { return Ok(None) };
    match inputs::model(name)? {
        NamedModel::Nominal => Ok(None),
        model @ NamedModel::Estimated { .. } => {
            inputs::nominal(&model, arguments.robot.named())?;
            inputs::warn_doubtful(&model);
            let NamedModel::Estimated { name, arm, .. } = model else { return Ok(None) };
            Ok(Some((name, arm)))
        }
    }
}

/// Measurements: with the residuals of the given model, or with those of an identification.
fn measurements(arguments: &Arguments, file: &Path) -> anyhow::Result<Recording> {
    let stated = stated_model(arguments)?;
    let robot = match (arguments.robot.named(), &stated) {
        (Some(robot), _) => robot,
        (None, Some((_, arm))) => arm.robot.as_str().into(),
        (None, None) => bail!("{}: give --robot or --model: the measured arm is unknown", file.display()),
    };
    let data = identify::DataArguments {
        sheet: arguments.sheet.clone(),
        ..identify::DataArguments::of(file.to_path_buf(), robot)
    };
    let (robot, dataset) = identify::read(&data)?;
    let options = Options {
        tolerance: Tolerance::default(),
        solver: &SOLVERS[0],
        held_out: 0.2,
        seed: arguments.common.seed,
        fuse_readout: true,
        limit_rmse_mm: None,
        limit_max_mm: None,
        stated_frames: None,
    };
    let Some((name, arm)) = stated else {
        let found = identify::identified(&dataset, &robot.sheet.name, &robot.model, &options)?;
        return Ok(pictures::dataset_recording(&dataset, &found, &meshes(arguments.robot.named())?)?);
    };
    // The sensor may have moved since the model was made, so the frames are refitted for both arms.
    let frames = starting_frames(&dataset, &robot.model, &options.tolerance, options.fuse_readout)?;
    let (observed, _) = prepare_observations(&dataset, &robot.model, true);
    let sensing = frame_parameters(&dataset);
    let mut registered = None;
    let mut residuals = Vec::new();
    for (stage, model) in [
        ("nominal arm, frames fitted".to_owned(), &robot.model),
        (format!("{name}, frames fitted"), &arm.model),
    ] {
        let start = Start { model, frames: &frames };
        let fitted = fit(&observed, start, &sensing, &options.tolerance, &SOLVERS[0], options.seed);
        let errors = errors_on(&observed, &fitted.model, &fitted.frames);
        let rows = dataset.rows.iter().map(|row| row.number).zip(errors).collect();
        residuals.push(Residuals { stage, rows });
        registered = Some(fitted.frames);
    }
    Ok(pictures::measured_recording(&MeasuredScene {
        dataset: &dataset,
        arm: &arm.model,
        arm_is: &format!("{} as estimated in {name}", arm.robot),
        nominal: Some(&arm.nominal),
        meshes: &meshes(arguments.robot.named())?,
        planned: false,
        keep_out_mm: &[],
        answer: &[],
        frames: registered.as_ref(),
        residuals: &residuals,
        held_out: &[],
        set_aside: &[],
        identification: None,
        diagnosis: None,
    })?)
}

/// A model: the arm at its measured poses, coloured by the distance from the nominal arm.
fn model(arguments: &Arguments, file: &Path) -> anyhow::Result<Recording> {
    let named = inputs::model(&file.display().to_string())?;
    inputs::warn_doubtful(&named);
    let NamedModel::Estimated { name, arm, .. } = named else {
        bail!("{}: expected a model file", file.display());
    };
    let nominal = arm.nominal.at_condition(&Condition::default());
    let estimated = arm.model.at_condition(&arm.condition);
    let points: Vec<PathPoint> = arm
        .region
        .samples_deg
        .iter()
        .enumerate()
        .map(|(index, sample)| {
            let joints = Joints::from_fn(|i, _| sample[i].to_radians());
            let intended = nominal.forward(&joints);
            let reached = estimated.forward(&joints);
            PathPoint {
                index,
                file: 0,
                line: 0,
                instruction: "measured pose".to_owned(),
                kind: MotionKind::AbsoluteJoint,
                cutting: false,
                base_from_object: Pose::identity(),
                part: 0,
                part_from_object: Pose::identity(),
                flange_from_tool: Pose::identity(),
                intended,
                normal: None,
                joints_before: Some(joints),
                joints_after: None,
                before: Some(Deviation::between(&intended, &reached, &Pose::identity(), None)),
                after: None,
                sigma_mm: Some(arm.position_sigma_mm(&estimated, &joints, &Pose::identity(), None)),
                shape_sigma_mm: None,
                outside: None,
                status: MotionStatus::Left,
                reason: None,
            }
        })
        .collect();
    let report = PathReport {
        program: "poses of the measured region".to_owned(),
        files: Vec::new(),
        model: name.clone(),
        after: After::PredictedRemainder,
        points,
        missing: None,
        differences: Vec::new(),
        between: None,
        held_out_mm: Some(arm.calibrated.held_out.rmse),
        turn_sigma_rad: None,
        assumptions: Vec::new(),
    };
    let scene = PathScene {
        title: &format!("{name}: {} as estimated", arm.robot),
        arm: &arm.model,
        nominal: &arm.nominal,
        meshes: &meshes(arguments.robot.named())?,
        arm_is: "estimated arm",
        condition: arm.condition,
        reports: std::slice::from_ref(&report),
        workpiece: None,
    };
    Ok(pictures::path_recording(&scene)?)
}

/// Programs of one task, run by the estimated or the nominal arm.
fn program(arguments: &Arguments, paths: &[PathBuf]) -> anyhow::Result<Recording> {
    let programs = Programs::read(paths)?;
    let stated = stated_model(arguments)?;
    let knowledge = stated.as_ref().map(|(_, arm)| arm.as_ref());
    let (cell, surface, condition) = arguments.cell.read(knowledge)?;
    let nominal = match (&stated, arguments.robot.named()) {
        (Some((_, arm)), _) => arm.nominal.clone(),
        (None, Some(robot)) => inputs::robot(robot)?.model,
        (None, None) => {
            bail!("{}: give --robot or --model: the arm that runs it is unknown", paths[0].display())
        }
    };
    let robot = arguments.robot.named().or(knowledge.map(|k| k.robot.as_str().into()));
    let task = programs.task(&cell_setup(&cell));
    refuse_contradictions(task.listing(), &cell, surface.as_ref(), &nominal)?;
    if let Some(robot) = robot {
        let name = inputs::robot(robot).map_or_else(|_| robot.name.to_owned(), |robot| robot.sheet.name);
        robot_match::refuse_other_cell(&cell, &name, &nominal)?;
        robot_match::refuse_other_program(&programs, &name, &nominal)?;
    }
    note_unused_entries([&Some(Used::by(task.listing(), &cell))], &cell, surface.as_ref());
    let program = programs.name();
    let acting = ActingArm {
        nominal: &nominal,
        model: knowledge.map_or(&nominal, |k| &k.model),
        knowledge,
        condition,
    };
    let loads = arguments.cell.loads(&task);
    let report = verify(
        &VerificationTask {
            original: task.listing(),
            rewritten: None,
            cell: &cell,
            surface: surface.as_ref().map(|s| &s.surface),
            program: &program,
            name: stated.as_ref().map_or("nominal", |(name, _)| name),
            after: After::PredictedRemainder,
            tolerance_mm: truegrind::compensation::options::Options::default().tolerance_mm,
            loads: [loads.as_ref(), None],
        },
        &acting,
    );
    if report.points.is_empty() {
        bail!("{program}: {}", why_no_point(std::slice::from_ref(&report)));
    }
    let is = if knowledge.is_some() { "estimated arm" } else { "nominal arm" };
    let arms = Arms { real: acting.model, is, nominal: &nominal, robot: arguments.robot.named() };
    recording(&program, arms, condition, std::slice::from_ref(&report), surface.as_ref())
}
