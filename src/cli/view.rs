//! `truegrind view FILE…`, and the recordings of the other verbs.

use std::path::PathBuf;

use anyhow::bail;
use clap::Args;
use truegrind::compensation::deviation::PathReport;
use truegrind::diagnosis::diagnose::Diagnosed;
use truegrind::identification::identify::Identification;
use truegrind::kinematics::condition::Condition;
use truegrind::kinematics::model::Model;
use truegrind::measurement::dataset::Dataset;
use truegrind::surface::SurfaceFile;
use truegrind::visual::{self, PathScene, Workpiece};

use super::Ending;

/// Arguments of `view`.
#[derive(Debug, Args)]
pub(super) struct Arguments {
    /// Recordings that other verbs wrote with --rrd.
    #[arg(required = true)]
    files: Vec<PathBuf>,
}

pub(super) fn run(arguments: &Arguments) -> anyhow::Result<Ending> {
    for file in &arguments.files {
        if !file.is_file() {
            bail!("{}: no such file; other verbs write one with --rrd FILE", file.display());
        }
        if file.extension().is_none_or(|e| !e.eq_ignore_ascii_case("rrd")) {
            bail!("{}: expected a .rrd file, which other verbs write with --rrd FILE", file.display());
        }
        visual::Recording::open(file)?;
    }
    Ok(Ending::Done)
}

/// The recording of a path.
pub(super) fn path(
    title: &str,
    arm: &Model,
    arm_is: &str,
    condition: Condition,
    reports: &[PathReport],
    surface: Option<&SurfaceFile>,
) -> anyhow::Result<Vec<u8>> {
    let triangles = surface.map(|s| s.surface.tessellate(60));
    let workpiece = triangles.as_ref().zip(surface).map(|(triangles, surface)| Workpiece {
        triangles,
        base_from_object: surface.work_object.base_from_work_object,
    });
    let scene = PathScene { title, arm, arm_is, condition, reports, workpiece };
    Ok(visual::path_recording(&scene)?.rrd()?)
}

/// The recording of an identification.
pub(super) fn identification(found: &Identification, dataset: &Dataset) -> anyhow::Result<Vec<u8>> {
    Ok(visual::dataset_recording(dataset, found)?.rrd()?)
}

/// The recording of a diagnosis.
pub(super) fn diagnosis(found: &Diagnosed, dataset: &Dataset) -> anyhow::Result<Vec<u8>> {
    Ok(visual::diagnosis_recording(dataset, found)?.rrd()?)
}
