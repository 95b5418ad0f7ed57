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
use truegrind::planning::poses::drive::{checked, reading};
use truegrind::planning::poses::schedule::FIRST_ROW;
use truegrind::planning::poses::{Plan, Wanted};
use truegrind::report::document::{Block, Document};
use truegrind::robots::foreign::{ImportOptions, Kind, Visual, import};
use truegrind::surfaces::{Mesh, SurfaceFile};

use super::files;
use super::inputs;
use super::terminal::print_message;

/// The arms of a picture: the one whose deviations are shown, what it is in words, and that of the data sheet.
#[derive(Clone, Copy)]
pub(super) struct Arms<'a> {
    pub(super) real: &'a Model,
    pub(super) is: &'a str,
    pub(super) nominal: &'a Model,
    /// The robot as the command line names it: a file may name meshes.
    pub(super) robot: Option<&'a str>,
}

/// The recording of a path, as a file.
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

/// The recording of an identification, as a file.
pub(super) fn identification(
    found: &Identification,
    dataset: &Dataset,
    robot: &str,
) -> anyhow::Result<Vec<u8>> {
    Ok(pictures::dataset_recording(dataset, found, &meshes(Some(robot))?)?.rrd()?)
}

/// The recording of a diagnosis, as a file.
pub(super) fn diagnosis(found: &Diagnosed, dataset: &Dataset, robot: &str) -> anyhow::Result<Vec<u8>> {
    Ok(pictures::diagnosis_recording(dataset, found, &meshes(Some(robot))?)?.rrd()?)
}

/// The recording of a plan, as a file: the arm at each row with what the sensor will see, and what is kept out of.
pub(super) fn plan(plan: &Plan, wanted: &Wanted<'_>, name: &str, robot: &str) -> anyhow::Result<Vec<u8>> {
    let rows = (FIRST_ROW..).zip(&plan.rows).filter_map(|(number, row)| {
        let pose = &plan.poses[row.pose];
        let mut out = Row::new(number, pose.joints, reading(plan, wanted, row)?);
        out.anchor = pose.anchor;
        Some(out)
    });
    let dataset =
        Dataset::new(&format!("What to measure on {name}"), wanted.sensor, rows.collect::<Vec<_>>());
    let rough = plan.rows.iter().filter(|row| row.rough_way).count();
    let mut answer = vec![
        format!("{} rows at {} poses, in this order", plan.rows.len(), plan.poses.len()),
        format!(
            "checked: {}; the way to the first pose and anything else in the cell are not",
            checked(plan)
        ),
    ];
    if rough > 0 {
        answer.push(format!("{rough} times the cable has to be unhooked on the way"));
    }
    let scene = MeasuredScene {
        dataset: &dataset,
        arm: wanted.nominal,
        arm_is: &format!("{name} after its data sheet"),
        nominal: None,
        meshes: &meshes(Some(robot))?,
        planned: true,
        keep_out_mm: &plan.space.boxes_mm,
        answer: &answer,
        frames: Some(wanted.frames),
        residuals: &[],
        held_out: &[],
        set_aside: &[],
        identification: None,
        diagnosis: None,
    };
    Ok(pictures::measured_recording(&scene)?.rrd()?)
}

/// The recording of a track, as a file: the poses since sensor and target stand as they do, and what the model that it began with
/// and the one that it has now leave of them.
pub(super) fn track(
    tracker: &Tracker,
    arm: &Estimated,
    datasets: &[Dataset],
    alarms: &[Alarm],
    robot: Option<&str>,
) -> anyhow::Result<Option<Vec<u8>>> {
    let Some(first) = datasets.first() else { return Ok(None) };
    let begun = &arm.model;
    let (model, frames) = tracker.standing();
    // One wild pose would flatten all others.
    let tame = tracker.state().history.iter().filter(|seen| seen.nis < WILD);
    let seen: BTreeSet<(&str, usize)> = tame.map(|seen| (seen.file.as_str(), seen.row)).collect();
    let mut rows: Vec<Row> = Vec::new();
    for dataset in datasets {
        let shown = dataset.rows.iter().filter(|row| seen.contains(&(dataset.file.as_str(), row.number)));
        rows.extend(shown.cloned());
    }
    if rows.is_empty() {
        return Ok(None);
    }
    // Several files count their rows alike: then the poses are counted.
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
        left("before: the model that the track began with", begun, &frames),
        left("after: the model as it stands now", &model, &frames),
    ];
    let mut answer: Vec<String> = alarms.iter().map(ToString::to_string).collect();
    if answer.is_empty() {
        answer.push("no change was noticed".to_owned());
    }
    answer.push(
        "shown: the latest poses, since sensor and target stand as they do now, but for what was set aside"
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

/// A pose whose normalised innovation squared is beyond this belongs to another mounting, or to none.
const WILD: f64 = 1e3;

/// What an experiment was made on.
pub(super) struct Compared<'a> {
    pub(super) dataset: &'a Dataset,
    pub(super) nominal: &'a Model,
    /// The arm that the rows were simulated on, where they were.
    pub(super) actual: Option<&'a Model>,
    pub(super) robot: &'a str,
}

/// The recording of an experiment, as a file: the arm and the sensor at the rows that the methods were given, and the answer.
pub(super) fn comparison(of: &Compared<'_>, summary: &Document) -> anyhow::Result<Vec<u8>> {
    let observed = prepare_observations(of.dataset, of.nominal, true).0;
    let frames = register(&observed, of.nominal, &Tolerance::default())?.fitted.frames;
    let errors = errors_on(&observed, of.nominal, &frames);
    let registered = Residuals {
        stage: "frames registered, links nominal: what the methods begin with".to_owned(),
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
        None => (of.nominal, "arm after its data sheet"),
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

/// More triangles than these no picture of an arm needs, and a viewer is slow with.
const MOST_TRIANGLES: usize = 150_000;

/// The meshes that a robot file names, so far as they are there and are STL; none of a robot of the catalogue. What is not drawn is
/// said.
pub(super) fn meshes(robot: Option<&str>) -> anyhow::Result<Vec<LinkMesh>> {
    let Some(name) = robot.filter(|name| Kind::of(name) == Some(Kind::Urdf)) else { return Ok(Vec::new()) };
    let path = Path::new(name);
    let visuals = import(&files::read_text(path)?, name, &ImportOptions::default())?.visuals;
    let (mut out, mut missing, mut triangles) = (Vec::new(), Vec::new(), 0);
    for Visual { frame, pose, file, unit_mm } in visuals {
        let stl = file.to_ascii_lowercase().ends_with(".stl");
        let Some(place) = mesh_file(path, &file).filter(|_| stl) else {
            missing.push(file);
            continue;
        };
        let drawn = Mesh::triangles_of_stl(&files::read(&place)?, unit_mm)
            .map_err(|error| anyhow::anyhow!("{}: {error}", place.display()))?;
        triangles += drawn.triangles.len();
        if triangles > MOST_TRIANGLES {
            missing.push(file);
            continue;
        }
        out.push(LinkMesh { frame, pose, triangles: drawn });
    }
    if let Some(first) = missing.first() {
        print_message(format_args!(
            "note: {name}: {} of its meshes are not drawn ({first}{}): expected STL files of at most {MOST_TRIANGLES} triangles, \
             beside the robot file or in the package that it names; links without one are drawn as bars",
            missing.len(),
            if missing.len() > 1 { " and others" } else { "" }
        ));
    }
    Ok(out)
}

/// Where a mesh lies that a URDF names: `package://NAME/…` in a folder of that name above or beside the file, or beside the file
/// itself; other names as they stand, beside the file.
fn mesh_file(urdf: &Path, name: &str) -> Option<PathBuf> {
    let is_there = |place: PathBuf| place.is_file().then_some(place);
    if let Some(place) = name.strip_prefix("file://") {
        return is_there(PathBuf::from(place));
    }
    let Some(in_package) = name.strip_prefix("package://") else {
        return is_there(inputs::beside(urdf, name));
    };
    let (_, inside) = in_package.split_once('/')?;
    let folder = std::path::absolute(urdf).ok()?;
    let mut above = folder.ancestors().skip(1).take(6);
    above.find_map(|folder| is_there(folder.join(in_package)).or_else(|| is_there(folder.join(inside))))
}
