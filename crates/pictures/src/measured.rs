//! Recording of measurements: poses of the arm, readings of the sensor, residuals of fits.
//!
//! | entity | content |
//! |---|---|
//! | `arm/at_row` | the arm at the logged joints, row by row |
//! | `arm/nominal`, `arm/exaggerated` | the nominal arm, transparent; the real arm with exaggerated differences |
//! | `touched` | the measured point at all rows, coloured by the size of the residual |
//! | `read` | the position read by a tracker at the current row |
//! | `sensor/…` | cable outlets and the current cable, or the tracker frame and its beam |
//! | `keep_out` | forbidden boxes |
//! | `set_aside` | rows that were set aside as outliers |
//! | `residual/…` | residuals by row, before and after, and of held-out rows |
//! | `joints/…` | logged joint angles by row |
//! | `summary`, `legend` | errors, verdict, parameters with their standard deviations; the colours |

mod scene;
mod words;

use nalgebra::{Point3, Vector3};
use re_sdk_types::archetypes::{Boxes3D, LineStrips3D, Points3D, TransformAxes3D};
use re_sdk_types::components::{Color, MarkerShape, Radius};

use super::arm::{self, ArmState, Figure, LinkMesh, Paint};
use super::colour::{BEFORE, INTENDED, JOINTS, REFUSED, Scale, after};
use super::curve::{self, Pen, curve};
use super::legend;
use super::page::{Eye, Pane, View, page};
use super::recording::{Recording, Store, VisualError};
use super::shape::Shape;
use truegrind_arm::estimated::Estimated;
use truegrind_arm::model::Model;
use truegrind_calibration::diagnosis::diagnose::Diagnosed;
use truegrind_calibration::identification::calibration::Frames;
use truegrind_calibration::identification::fit::{Observations, errors_on};
use truegrind_calibration::identification::identify::{Identification, prepare_observations};
use truegrind_calibration::identification::rounding::logged_covariance;
use truegrind_calibration::measurement::dataset::{Dataset, Reading, Row};
use truegrind_math::se3::Pose;

pub use self::scene::{MeasuredScene, Residuals};

/// The time axis: [`Row::number`].
pub const AXIS: &str = "row";

/// Playback speed (rows per second).
const ROWS_PER_SECOND: f64 = 4.0;

/// Length of the axes of the tracker frame, relative to the length of the arm.
const SENSOR_AXES: f64 = 0.12;

/// The colour scale ends at this quantile of the residuals, so that outliers do not dominate it.
const TOP_QUANTILE: f64 = 0.98;

/// Recording of an identification.
///
/// # Errors
/// [`VisualError::Empty`] without rows.
pub fn dataset_recording(
    dataset: &Dataset,
    found: &Identification,
    meshes: &[LinkMesh],
) -> Result<Recording, VisualError> {
    let estimated: &Estimated = &found.estimated;
    let observed = if found.readout_fusion.is_ok() {
        prepare_observations(dataset, &estimated.nominal, true).0
    } else {
        Observations { dataset: dataset.clone(), angles: logged_covariance(dataset) }
    };
    let left = |stage: &str, model: &Model, frames: &Frames| Residuals {
        stage: stage.to_owned(),
        rows: numbered(dataset, errors_on(&observed, model, frames)),
    };
    let residuals = [
        left("before: frames fitted", &found.registered.model, &found.registered.frames),
        left("after: geometry fitted", &found.geometry.model, &found.geometry.frames),
    ];
    let held_out: Vec<(usize, f64)> = found.held_out.iter().map(|(row, _, after)| (*row, *after)).collect();
    measured_recording(&MeasuredScene {
        dataset,
        arm: &estimated.model,
        arm_is: &format!("{} as estimated", estimated.robot),
        nominal: Some(&estimated.nominal),
        meshes,
        planned: false,
        keep_out_mm: &[],
        answer: &[],
        frames: Some(&found.geometry.frames),
        residuals: &residuals,
        held_out: &held_out,
        set_aside: &estimated.provenance.set_aside,
        identification: Some(found),
        diagnosis: None,
    })
}

/// Recording of a diagnosis, with the residuals of data sheet, geometry and extended model.
///
/// # Errors
/// [`VisualError::Empty`] without rows.
pub fn diagnosis_recording(
    dataset: &Dataset,
    found: &Diagnosed,
    meshes: &[LinkMesh],
) -> Result<Recording, VisualError> {
    let observed = &found.prepared.observed;
    let left = |stage: &str, model: &Model, frames: &Frames| Residuals {
        stage: stage.to_owned(),
        rows: numbered(dataset, errors_on(observed, model, frames)),
    };
    let residuals = [
        left("before: geometry fitted", &found.geometric.model, &found.geometric.frames),
        left("after: findings in the model", &found.extended.model, &found.extended.frames),
    ];
    measured_recording(&MeasuredScene {
        dataset,
        arm: &found.estimated.model,
        arm_is: &format!("{} with everything found", found.estimated.robot),
        nominal: Some(&found.estimated.nominal),
        meshes,
        planned: false,
        keep_out_mm: &[],
        answer: &[],
        frames: Some(&found.extended.frames),
        residuals: &residuals,
        held_out: &[],
        set_aside: &found.estimated.provenance.set_aside,
        identification: None,
        diagnosis: Some(&found.diagnosis),
    })
}

fn numbered(dataset: &Dataset, errors: Vec<f64>) -> Vec<(usize, f64)> {
    dataset.rows.iter().map(|r| r.number).zip(errors).collect()
}

/// Recording of measurements.
///
/// # Errors
/// [`VisualError::Empty`] without rows.
pub fn measured_recording(scene: &MeasuredScene<'_>) -> Result<Recording, VisualError> {
    if scene.dataset.rows.is_empty() {
        return Err(VisualError::Empty("the measurement file has no rows"));
    }
    let mut store = Store::default();
    store.fixed("/", &re_sdk_types::archetypes::ViewCoordinates::RIGHT_HAND_Z_UP())?;
    let flange_from_touched = scene.frames.map_or_else(Pose::identity, |f| f.flange_from_target);
    let state = |row: &Row| ArmState {
        time: row.number as i64,
        joints: row.joints,
        flange_from_tool: flange_from_touched,
    };
    let states: Vec<ArmState> = scene.dataset.rows.iter().map(state).collect();
    let condition = *scene.dataset.rows[0].condition;
    let figure = |model| Figure { model, condition: &condition, meshes: scene.meshes };
    arm::draw(&mut store, "arm/at_row", figure(scene.arm), &Paint::SOLID, (AXIS, &states))?;
    let shape = scene.nominal.and_then(|nominal| Shape::of(figure(nominal), figure(scene.arm), &states));
    if let (Some(shape), Some(nominal)) = (&shape, scene.nominal) {
        shape.draw(&mut store, figure(nominal), AXIS)?;
    }
    keep_out(&mut store, scene)?;
    let touched: Vec<Point3<f64>> = scene
        .dataset
        .rows
        .iter()
        .map(|r| scene.arm.forward(&r.joints, &r.condition) * flange_from_touched * Point3::origin())
        .collect();
    let scale = Scale::over([quantile(scene.residuals.last(), TOP_QUANTILE)]);
    cloud(&mut store, scene, &touched, &scale)?;
    sensor(&mut store, scene, &touched)?;
    curves(&mut store, scene)?;
    if !scene.residuals.is_empty() {
        legend::draw(&mut store, &scale)?;
    }
    store.fixed(
        "summary",
        &re_sdk_types::archetypes::TextDocument::from_markdown(words::markdown(scene, shape.as_ref())),
    )?;
    let page = layout(scene, &touched, shape.as_ref())?;
    Recording::new("truegrind measurements", &scene.dataset.file, store, page)
}

/// A quantile of the absolute residuals; 0 without residuals.
fn quantile(residuals: Option<&Residuals>, share: f64) -> f64 {
    let mut sizes: Vec<f64> =
        residuals.iter().flat_map(|r| &r.rows).map(|(_, e)| e.abs()).filter(|e| e.is_finite()).collect();
    sizes.sort_by(f64::total_cmp);
    let last = sizes.len().saturating_sub(1);
    sizes.get((last as f64 * share).ceil() as usize).copied().unwrap_or(0.0)
}

/// All measured points, coloured by the residual of the last stage; rows set aside are marked.
fn cloud(
    store: &mut Store,
    scene: &MeasuredScene<'_>,
    touched: &[Point3<f64>],
    scale: &Scale,
) -> Result<(), VisualError> {
    let sizes = scene.residuals.last().map(|r| &r.rows);
    let colour = |row: &Row| match sizes.and_then(|s| s.iter().find(|(n, _)| *n == row.number)) {
        Some((_, error)) => scale.of(error.abs()),
        None => INTENDED,
    };
    let points = Points3D::new(touched.iter().map(xyz))
        .with_colors(scene.dataset.rows.iter().map(|r| Color::from(colour(r))))
        .with_radii([Radius::new_ui_points(3.0)]);
    store.fixed("touched", &points)?;
    let aside = scene.dataset.rows.iter().zip(touched).filter(|(r, _)| scene.set_aside.contains(&r.number));
    let (labels, positions): (Vec<String>, Vec<[f32; 3]>) =
        aside.map(|(r, p)| (format!("row {} set aside", r.number), xyz(p))).unzip();
    if positions.is_empty() {
        return Ok(());
    }
    let marks = Points3D::new(positions)
        .with_colors([Color::from(REFUSED)])
        .with_radii([Radius::new_ui_points(5.0)])
        .with_labels(labels)
        .with_show_labels(scene.set_aside.len() <= 12);
    store.fixed("set_aside", &marks)
}

/// Edges of the forbidden boxes.
fn keep_out(store: &mut Store, scene: &MeasuredScene<'_>) -> Result<(), VisualError> {
    if scene.keep_out_mm.is_empty() {
        return Ok(());
    }
    let ends = |[low, high]: &[[f64; 3]; 2]| {
        let half = std::array::from_fn::<f32, 3, _>(|k| (0.5 * (high[k] - low[k])) as f32);
        let middle = std::array::from_fn::<f32, 3, _>(|k| (0.5 * (high[k] + low[k])) as f32);
        (middle, half)
    };
    let (middles, halves): (Vec<[f32; 3]>, Vec<[f32; 3]>) = scene.keep_out_mm.iter().map(ends).unzip();
    let boxes = Boxes3D::from_centers_and_half_sizes(middles, halves)
        .with_colors([Color::from(REFUSED)])
        .with_radii([Radius::new_ui_points(1.5)]);
    store.fixed("keep_out", &boxes)
}

/// The sensor and its reading at each row.
fn sensor(store: &mut Store, scene: &MeasuredScene<'_>, touched: &[Point3<f64>]) -> Result<(), VisualError> {
    let Some(frames) = scene.frames else { return Ok(()) };
    let times: Vec<i64> = scene.dataset.rows.iter().map(|r| r.number as i64).collect();
    let outlets: Vec<Option<Point3<f64>>> = scene
        .dataset
        .rows
        .iter()
        .map(|r| match r.reading {
            Reading::Cable(_) => frames.outlets_mm.get(r.anchor).map(|o| Point3::from(*o)),
            Reading::Position(_) | Reading::Pose(_) => None,
        })
        .collect();
    if outlets.iter().all(Option::is_some) {
        let name = |k: usize| match frames.outlets_mm.len() {
            1 => "cable outlet".to_owned(),
            _ => format!("cable outlet {}", k + 1),
        };
        let drawn = Points3D::new(frames.outlets_mm.iter().map(|o| xyz(&Point3::from(*o))))
            .with_colors([Color::from(BEFORE)])
            .with_radii([Radius::new_ui_points(7.0)])
            .with_labels((0..frames.outlets_mm.len()).map(name))
            .with_show_labels(true);
        store.fixed("sensor/outlet", &drawn)?;
        let cable = outlets.iter().flatten().zip(touched).map(|(o, p)| [xyz(o), xyz(p)]);
        let columns = LineStrips3D::new(cable).columns_of_unit_batches().map_err(encoding)?;
        store.over("sensor/cable", (AXIS, &times), columns)?;
        let style = LineStrips3D::update_fields()
            .with_colors([Color::from(BEFORE)])
            .with_radii([Radius::new_ui_points(1.5)]);
        return store.fixed("sensor/cable", &style);
    }
    if scene.planned && frames.base_from_sensor == Pose::identity() {
        // The position of the tracker is unknown.
        return Ok(());
    }
    let length = SENSOR_AXES * arm::length_mm(scene.arm);
    arm::still(store, "sensor/frame", &frames.base_from_sensor)?;
    store.fixed("sensor/frame", &TransformAxes3D::new(length as f32))?;
    let seen: Vec<(i64, [f32; 3])> = scene
        .dataset
        .rows
        .iter()
        .filter_map(|r| {
            let position = match &r.reading {
                Reading::Position(p) => Point3::from(*p),
                Reading::Pose(pose) => Point3::from(pose.translation.vector),
                Reading::Cable(_) => return None,
            };
            Some((r.number as i64, xyz(&(frames.base_from_sensor * position))))
        })
        .collect();
    let (times, positions): (Vec<i64>, Vec<[f32; 3]>) = seen.into_iter().unzip();
    let from = xyz(&Point3::from(frames.base_from_sensor.translation.vector));
    let rays = LineStrips3D::new(positions.iter().map(|to| [from, *to]))
        .columns_of_unit_batches()
        .map_err(encoding)?;
    store.over("sensor/ray", (AXIS, &times), rays)?;
    let style = LineStrips3D::update_fields()
        .with_colors([Color::from(BEFORE)])
        .with_radii([Radius::new_ui_points(1.0)]);
    store.fixed("sensor/ray", &style)?;
    let columns = Points3D::new(positions).columns_of_unit_batches().map_err(encoding)?;
    store.over("read", (AXIS, &times), columns)?;
    let style =
        Points3D::update_fields().with_colors([Color::from(BEFORE)]).with_radii([Radius::new_ui_points(6.0)]);
    store.fixed("read", &style)
}

fn curves(store: &mut Store, scene: &MeasuredScene<'_>) -> Result<(), VisualError> {
    for (k, stage) in scene.residuals.iter().enumerate() {
        let colour = if k == 0 && scene.residuals.len() > 1 { BEFORE } else { after(k.saturating_sub(1)) };
        let pen = Pen { name: &stage.stage, colour, width: 1.6 };
        curve(store, &format!("residual/{}", k + 1), AXIS, pen, &over(&stage.rows))?;
    }
    let held = ("after, row held out", after(1), MarkerShape::Circle);
    curve::points(store, "residual/held_out", AXIS, held, &over(scene.held_out))?;
    if let Some(last) = scene.residuals.last() {
        let aside: Vec<(usize, f64)> =
            last.rows.iter().copied().filter(|(n, _)| scene.set_aside.contains(n)).collect();
        let mark = ("set aside", REFUSED, MarkerShape::Cross);
        curve::points(store, "residual/set_aside", AXIS, mark, &over(&aside))?;
    }
    for (joint, colour) in JOINTS.into_iter().enumerate() {
        let name = format!("joint {}", joint + 1);
        let angles: Vec<(i64, f64)> =
            scene.dataset.rows.iter().map(|r| (r.number as i64, r.joints[joint].to_degrees())).collect();
        let pen = Pen { name: &name, colour, width: 1.2 };
        curve(store, &format!("joints/{}", joint + 1), AXIS, pen, &angles)?;
    }
    Ok(())
}

fn over(rows: &[(usize, f64)]) -> Vec<(i64, f64)> {
    rows.iter().filter(|(_, e)| e.is_finite()).map(|(n, e)| (*n as i64, *e)).collect()
}

fn layout(
    scene: &MeasuredScene<'_>,
    touched: &[Point3<f64>],
    shape: Option<&Shape>,
) -> Result<Store, VisualError> {
    let mut seen = touched.to_vec();
    seen.push(Point3::origin());
    let posed = scene.arm.at_condition(&scene.dataset.rows[0].condition);
    let (rows, length) = (&scene.dataset.rows, arm::length_mm(scene.arm));
    for row in rows.iter().step_by((rows.len() / 12).max(1)) {
        seen.extend(arm::extent(&posed, &row.joints, length));
    }
    if let Some(frames) = scene.frames {
        let at_sensor = Point3::from(frames.base_from_sensor.translation.vector);
        match scene.dataset.rows[0].reading {
            Reading::Cable(_) => seen.extend(frames.outlets_mm.iter().map(|o| Point3::from(*o))),
            // A tracker is metres away, so the view is not fitted to it.
            Reading::Position(_) | Reading::Pose(_) if at_sensor.coords.norm() < 2000.0 => {
                seen.push(at_sensor)
            }
            Reading::Position(_) | Reading::Pose(_) => {}
        }
    }
    let eye = Eye::on(&seen, Vector3::new(0.8, -0.75, 0.45), 1.6, 0.85);
    let beside = ["+ /read", "+ /sensor/**", "+ /set_aside", "+ /keep_out"];
    let view = View::space(
        format!("{} [mm], row by row", scene.arm_is),
        &[&["+ /arm/at_row/**", "+ /touched"], &beside[..]].concat(),
        &eye,
    );
    let space = match shape {
        Some(shape) => {
            let bent = View::space(
                format!("Orange: {} {} [mm], ghost: data sheet", scene.arm_is, shape.factor()),
                &["+ /arm/nominal/**", "+ /arm/exaggerated/**", "+ /sensor/outlet", "+ /sensor/frame"],
                &eye,
            );
            Pane::Tabs(vec![Pane::View(view), Pane::View(bent)])
        }
        None => Pane::View(view),
    };
    let residuals = !scene.residuals.is_empty();
    let space = if residuals {
        Pane::Column(vec![
            (5.0, space),
            (1.0, legend::pane("Colour: size of the residual after the fit [mm]")),
        ])
    } else {
        space
    };
    let angles = rows.iter().flat_map(|r| r.joints.iter().map(|q| q.to_degrees()).collect::<Vec<_>>());
    let name = match scene.planned {
        true => "Joint angles [°] over rows",
        false => "Logged joint angles [°] over rows",
    };
    let joints = View::curves(name, &["+ /joints/**"], curve::range(angles, 6));
    let joints = Pane::View(joints);
    let curves = if residuals {
        let name = match scene.dataset.rows[0].reading {
            Reading::Cable(_) => "Residual, model − reading [mm], over rows",
            Reading::Position(_) | Reading::Pose(_) => "Size of the residual [mm] over rows",
        };
        let stages = scene.residuals.iter().flat_map(|r| r.rows.iter().map(|(_, e)| *e));
        let values = stages.chain(scene.held_out.iter().map(|(_, e)| *e));
        let names = scene.residuals.len() + usize::from(!scene.held_out.is_empty());
        let view = View::curves(name, &["+ /residual/**"], curve::range(values, names));
        Pane::Row(vec![(1.3, Pane::View(view)), (1.0, joints)])
    } else {
        joints
    };
    let left = Pane::Column(vec![(1.6, space), (1.0, curves)]);
    let text = Pane::View(View::text("Summary", &["+ /summary"]));
    page(Pane::Row(vec![(2.4, left), (1.0, text)]), AXIS, ROWS_PER_SECOND)
}

fn encoding(error: impl std::fmt::Display) -> VisualError {
    VisualError::Encoding(error.to_string())
}

fn xyz(p: &Point3<f64>) -> [f32; 3] {
    [p.x as f32, p.y as f32, p.z as f32]
}
