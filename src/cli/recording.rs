//! Recordings for Rerun, of whatever verb.

use truegrind::arm::condition::Condition;
use truegrind::arm::model::Model;
use truegrind::calibration::diagnosis::diagnose::Diagnosed;
use truegrind::calibration::identification::identify::Identification;
use truegrind::calibration::measurement::dataset::Dataset;
use truegrind::compensation::deviation::PathReport;
use truegrind::pictures::{self, PathScene, Recording, Workpiece};
use truegrind::surfaces::SurfaceFile;

/// The recording of a path, as a file.
pub(super) fn path(
    title: &str,
    arm: &Model,
    arm_is: &str,
    condition: Condition,
    reports: &[PathReport],
    surface: Option<&SurfaceFile>,
) -> anyhow::Result<Vec<u8>> {
    Ok(recording(title, arm, arm_is, condition, reports, surface)?.rrd()?)
}

/// The recording of a path.
pub(super) fn recording(
    title: &str,
    arm: &Model,
    arm_is: &str,
    condition: Condition,
    reports: &[PathReport],
    surface: Option<&SurfaceFile>,
) -> anyhow::Result<Recording> {
    let triangles = surface.map(|s| s.surface.tessellate(60));
    let workpiece = triangles.as_ref().zip(surface).map(|(triangles, surface)| Workpiece {
        triangles,
        base_from_object: surface.work_object.base_from_work_object,
    });
    let scene = PathScene { title, arm, arm_is, condition, reports, workpiece };
    Ok(pictures::path_recording(&scene)?)
}

/// The recording of an identification, as a file.
pub(super) fn identification(found: &Identification, dataset: &Dataset) -> anyhow::Result<Vec<u8>> {
    Ok(pictures::dataset_recording(dataset, found)?.rrd()?)
}

/// The recording of a diagnosis, as a file.
pub(super) fn diagnosis(found: &Diagnosed, dataset: &Dataset) -> anyhow::Result<Vec<u8>> {
    Ok(pictures::diagnosis_recording(dataset, found)?.rrd()?)
}
