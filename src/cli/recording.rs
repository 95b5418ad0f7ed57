//! Recordings for Rerun, of whatever verb.

use std::collections::BTreeSet;
use std::path::{Path, PathBuf};

use truegrind::arm::condition::Condition;
use truegrind::arm::estimated::Estimated;
use truegrind::arm::model::Model;
use truegrind::calibration::diagnosis::diagnose::Diagnosed;
use truegrind::calibration::identification::calibration::Frames;
use truegrind::calibration::identification::fit::errors_on;
use truegrind::calibration::identification::identify::{Identification, prepare_observations};
use truegrind::calibration::identification::register::register;
use truegrind::calibration::identification::tolerance::Tolerance;
use truegrind::calibration::measurement::dataset::{Dataset, Row};
use truegrind::calibration::tracking::{Alarm, Tracker};
use truegrind::compensation::deviation::PathReport;
use truegrind::pictures::measured::Residuals;
use truegrind::pictures::{self, LinkMesh, MeasuredScene, PathScene, Recording, Workpiece};
use truegrind::planning::poses::program::{checked, reading, unchecked};
use truegrind::planning::poses::schedule::FIRST_ROW;
use truegrind::planning::poses::{MeasurementSetup, Plan};
use truegrind::report::document::{Block, Document};
use truegrind::robots::foreign::{Kind, Visual};
use truegrind::surfaces::{Mesh, SurfaceFile};

use super::files;
use super::inputs::{self, NamedRobot};
use super::terminal::print_message;

/// The arms of a recording.
#[derive(Clone, Copy)]
pub(super) struct Arms<'a> {
    /// The arm whose deviations are shown.
    pub(super) real: &'a Model,
    /// Its description.
    pub(super) is: &'a str,
    pub(super) nominal: &'a Model,
    /// The robot on the command line; a robot file may name meshes.
    pub(super) robot: Option<NamedRobot<'a>>,
}

/// The bytes of the recording of a path.
pub(super) fn path(
    title: &str,
    arms: Arms<'_>,
    condition: Condition,
    reports: &[PathReport],
    surface: Option<&SurfaceFile>,
) -> anyhow::Result<Vec<u8>> {
    Ok(recording(title, arms, condition, reports, surface)?.rrd()?)
}

/// The recording of a path.
pub(super) fn recording(
    title: &str,
    arms: Arms<'_>,
    condition: Condition,
    reports: &[PathReport],
    surface: Option<&SurfaceFile>,
) -> anyhow::Result<Recording> {
    let triangles = surface.map(|s| s.surface.tessellate(60));
    let workpiece = triangles.as_ref().zip(surface).map(|(triangles, surface)| Workpiece {
        triangles,
        base_from_object: surface.work_object.base_from_work_object,
    });
    let meshes = meshes(arms.robot)?;
    let scene = PathScene {
        title,
        arm: arms.real,
        nominal: arms.nominal,
        meshes: &meshes,
        arm_is: arms.is,
        condition,
        reports,
        workpiece,
    };
    Ok(pictures::path_recording(&scene)?)
}

/// The bytes of the recording of an identification.
pub(super) fn identification(
    found: &Identification,
    dataset: &Dataset,
    robot: NamedRobot<'_>,
) -> anyhow::Result<Vec<u8>> {
    Ok(pictures::dataset_recording(dataset, found, &meshes(Some(robot))?)?.rrd()?)
}

/// The bytes of the recording of a diagnosis.
pub(super) fn diagnosis(
    found: &Diagnosed,
    dataset: &Dataset,
    robot: NamedRobot<'_>,
) -> anyhow::Result<Vec<u8>> {
    Ok(pictures::diagnosis_recording(dataset, found, &meshes(Some(robot))?)?.rrd()?)
}

/// The bytes of the recording of a plan: the arm at each row, the expected readings, and the forbidden boxes.
pub(super) fn plan(
    plan: &Plan,
    setup: &MeasurementSetup<'_>,
    name: &str,
    robot: NamedRobot<'_>,
) -> anyhow::Result<Vec<u8>> {
    let rows = (FIRST_ROW..).zip(&plan.rows).filter_map(|(number, row)| {
        let pose = &plan.poses[row.pose];
        let mut out = Row::new(number, pose.joints, reading(plan, setup, row)?);
        out.anchor = pose.anchor;
        Some(out)
    });
    let dataset = Dataset::new(&format!("What to measure on {name}"), setup.sensor, rows.collect::<Vec<_>>());
    let rough = plan.rows.iter().filter(|row| row.cable_unclear).count();
    let mut answer = vec![
        format!("{} rows at {} poses, in this order", plan.rows.len(), plan.poses.len()),
        format!("checked: {}; not checked: {}", checked(plan), unchecked(plan, setup.sensor)),
    ];
    if rough > 0 {
        answer.push(format!("the cable must be unhooked between poses {rough} times"));
    }
    let scene = MeasuredScene {
        dataset: &dataset,
        arm: setup.nominal,
        arm_is: &format!("nominal {name}"),
        nominal: None,
        meshes: &meshes(Some(robot))?,
        planned: true,
        keep_out_mm: &plan.space.boxes_mm,
        answer: &answer,
        frames: Some(setup.frames),
        residuals: &[],
        held_out: &[],
        set_aside: &[],
        identification: None,
        diagnosis: None,
    };
    Ok(pictures::measured_recording(&scene)?.rrd()?)
}

/// The bytes of the recording of a track: the remembered poses since sensor and target were last mounted, with the residuals of the initial and
/// the current model.
pub(super) fn track(
    tracker: &Tracker,
    arm: &Estimated,
    datasets: &[Dataset],
    alarms: &[Alarm],
    robot: Option<NamedRobot<'_>>,
) -> anyhow::Result<Option<Vec<u8>>> {
    let Some(first) = datasets.first() else { return Ok(None) };
    let begun = &arm.model;
    let (model, frames) = tracker.current();
    // A single outlier would dominate the scale.
    let tame = tracker.state().history.iter().filter(|seen| seen.nis < MAX_NIS);
    let seen: BTreeSet<(&str, usize)> = tame.map(|seen| (seen.file.as_str(), seen.row)).collect();
    let mut rows: Vec<Row> = Vec::new();
    for dataset in datasets {
        let shown = dataset.rows.iter().filter(|row| seen.contains(&(dataset.file.as_str(), row.number)));
        rows.extend(shown.cloned());
    }
    if rows.is_empty() {
        return Ok(None);
    }
    // Row numbers of several files collide, so poses are numbered instead.
    if datasets.len() > 1 {
        rows.iter_mut().zip(1..).for_each(|(row, number)| row.number = number);
    }
    let numbers: Vec<usize> = rows.iter().map(|row| row.number).collect();
    let dataset = Dataset::new(&first.file, first.sensor, rows);
    let observed = prepare_observations(&dataset, begun, false).0;
    let left = |stage: &str, arm: &Model, frames: &Frames| Residuals {
        stage: stage.to_owned(),
        rows: numbers.iter().copied().zip(errors_on(&observed, arm, frames)).collect(),
    };
    let residuals = [
        left("before: the initial model of the track", begun, &frames),
        left("after: the current model", &model, &frames),
    ];
    let mut answer: Vec<String> = alarms.iter().map(ToString::to_string).collect();
    if answer.is_empty() {
        answer.push("no change was detected".to_owned());
    }
    answer.push(
        "shown: the latest poses, as far back as the track remembers them and since sensor and target were last mounted, without \
         those set aside"
            .to_owned(),
    );
    let scene = MeasuredScene {
        dataset: &dataset,
        arm: &model,
        arm_is: &format!("{} as tracked", tracker.robot()),
        nominal: Some(&arm.nominal),
        meshes: &meshes(robot)?,
        planned: false,
        keep_out_mm: &[],
        answer: &answer,
        frames: Some(&frames),
        residuals: &residuals,
        held_out: &[],
        set_aside: &[],
        identification: None,
        diagnosis: None,
    };
    Ok(Some(pictures::measured_recording(&scene)?.rrd()?))
}

/// Poses with a larger normalised innovation squared belong to another mounting.
const MAX_NIS: f64 = 1e3;

/// The data of an experiment.
pub(super) struct Compared<'a> {
    pub(super) dataset: &'a Dataset,
    pub(super) nominal: &'a Model,
    /// The actual arm, if the rows were simulated.
    pub(super) actual: Option<&'a Model>,
    pub(super) robot: NamedRobot<'a>,
}

/// The bytes of the recording of an experiment: arm and sensor at its rows, and the result.
pub(super) fn comparison(of: &Compared<'_>, summary: &Document) -> anyhow::Result<Vec<u8>> {
    let observed = prepare_observations(of.dataset, of.nominal, true).0;
    let frames = register(&observed, of.nominal, &Tolerance::default())?.fitted.frames;
    let errors = errors_on(&observed, of.nominal, &frames);
    let registered = Residuals {
        stage: "frames registered, links nominal: the start of all methods".to_owned(),
        rows: of.dataset.rows.iter().map(|row| row.number).zip(errors).collect(),
    };
    let mut answer = vec![summary.title.clone()];
    for block in &summary.blocks {
        if let Block::Verdict(verdict) = block {
            answer.push(verdict.headline.clone());
            answer.extend(verdict.reasons.iter().cloned());
            break;
        }
    }
    let (arm, is) = match of.actual {
        Some(actual) => (actual, "simulated actual arm"),
        None => (of.nominal, "nominal arm"),
    };
    let scene = MeasuredScene {
        dataset: of.dataset,
        arm,
        arm_is: is,
        nominal: of.actual.map(|_| of.nominal),
        meshes: &meshes(Some(of.robot))?,
        planned: false,
        keep_out_mm: &[],
        answer: &answer,
        frames: Some(&frames),
        residuals: &[registered],
        held_out: &[],
        set_aside: &[],
        identification: None,
        diagnosis: None,
    };
    Ok(pictures::measured_recording(&scene)?.rrd()?)
}

/// Limit on the triangles of an arm; more make the viewer slow.
const MAX_TRIANGLES: usize = 150_000;

/// The STL meshes that a URDF names. A note lists those that are not drawn.
pub(super) fn meshes(robot: Option<NamedRobot<'_>>) -> anyhow::Result<Vec<LinkMesh>> {
    let Some(robot) = robot.filter(|robot| Kind::of(robot.name) == Some(Kind::Urdf)) else {
        return Ok(Vec::new());
    };
    let (name, visuals) = (robot.name, robot.import()?.visuals);
    let path = Path::new(name);
    let (mut out, mut missing, mut triangles) = (Vec::new(), Vec::new(), 0);
    for Visual { frame, pose, file, unit_mm } in visuals {
        let stl = file.to_ascii_lowercase().ends_with(".stl");
        let Some(file_path) = mesh_file(path, &file).filter(|_| stl) else {
            missing.push(file);
            continue;
        };
        let drawn = Mesh::triangles_of_stl(&files::read(&file_path)?, unit_mm)
            .map_err(|error| anyhow::anyhow!("{}: {error}", file_path.display()))?;
        triangles += drawn.triangles.len();
        if triangles > MAX_TRIANGLES {
            missing.push(file);
            continue;
        }
        out.push(LinkMesh { frame, pose, triangles: drawn });
    }
    if let Some(first) = missing.first() {
        print_message(format_args!(
            "note: {name}: {} of its meshes are not drawn ({first}{}): expected STL files of at most {MAX_TRIANGLES} triangles, \
             beside the robot file or in the package that it names; links without one are drawn as bars",
            missing.len(),
            if missing.len() > 1 { " and others" } else { "" }
        ));
    }
    Ok(out)
}

/// Path of a mesh of a URDF: `package://NAME/…` in a folder NAME above or beside the file, or beside the file; other names relative
/// to the file.
fn mesh_file(urdf: &Path, name: &str) -> Option<PathBuf> {
    let is_there = |file_path: PathBuf| file_path.is_file().then_some(file_path);
    if let Some(file_path) = name.strip_prefix("file://") {
        return is_there(PathBuf::from(file_path));
    }
    let Some(in_package) = name.strip_prefix("package://") else {
        return is_there(inputs::beside(urdf, name));
    };
    let (_, inside) = in_package.split_once('/')?;
    let folder = std::path::absolute(urdf).ok()?;
    let mut above = folder.ancestors().skip(1).take(6);
    above.find_map(|folder| is_there(folder.join(in_package)).or_else(|| is_there(folder.join(inside))))
}
