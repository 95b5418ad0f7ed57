//! The picture of a path: the arm that runs the program, the part, and how far the tool is off.
//!
//! What is in it, by entity:
//!
//! | entity | what |
//! |---|---|
//! | `arm/after` | the arm with the joints of the rewritten program |
//! | `arm/before` | the arm with the joints of the program as it was |
//! | `arm/exaggerated` | as before, with what the joints differ by times the scale factor |
//! | `workpiece` | the part, where its triangles are known |
//! | `path/intended`, `path/travel` | where the tool shall cut, and how it moves between cuts |
//! | `path/before`, `path/after/…` | where it goes, at true scale, coloured by the size of the deviation |
//! | `exaggerated/…` | the same with deviations times the scale factor |
//! | `tool_axes` | the direction in which the tool points, at some of the points |
//! | `marks/flagged`, `marks/refused` | points with a warning, and points that were not rewritten |
//! | `deviation/normal/…`, `deviation/size/…`, `deviation/angle/…` | curves over the path |
//! | `joints/…` | what the joints of the rewritten program differ by |
//! | `summary`, `legend` | the figures in words, and the colours |
//!
//! Drawn to scale, deviations of a millimetre vanish on a part of a hand's width. They are therefore drawn times a
//! factor as well, the same for all, which every name and label states. The arm that is drawn see-through follows the
//! exaggerated path of the program as it was: its joints differ by the factor times the difference, which for such small
//! turns moves the tool by the factor times the deviation.

mod scene;
mod curves;
mod lines;
mod summary;

use nalgebra::{Point3, Vector3};

use self::scene::{Plan, intended};
use super::arm::{self, Paint};
use super::colour::BEFORE;
use super::legend;
use super::page::{Eye, Pane, View, bounds, page};
use super::recording::{Recording, Store, VisualError};

pub use self::scene::{AXIS, PathScene, Workpiece};

/// Points that go by in a second when the path is played.
const POINTS_PER_SECOND: f64 = 15.0;

/// Draws a path.
///
/// # Errors
/// [`VisualError::Empty`] without a single point.
pub fn path_recording(scene: &PathScene<'_>) -> Result<Recording, VisualError> {
    let plan = Plan::of(scene)?;
    let mut store = Store::default();
    store.fixed("/", &rerun::ViewCoordinates::RIGHT_HAND_Z_UP())?;
    arms(&mut store, scene, &plan)?;
    lines::draw(&mut store, scene, &plan)?;
    curves::draw(&mut store, scene, &plan)?;
    summary::draw(&mut store, scene, &plan)?;
    Recording::new("truegrind path", scene.title, store, layout(scene, &plan)?)
}

fn arms(store: &mut Store, scene: &PathScene<'_>, plan: &Plan<'_>) -> Result<(), VisualError> {
    let ghost = Paint::ghost(BEFORE);
    for (root, paint, stands) in [
        ("arm/after", &Paint::SOLID, &plan.after),
        ("arm/before", &ghost, &plan.before),
        ("arm/exaggerated", &ghost, &plan.exaggerated),
    ] {
        arm::draw(store, root, scene.arm, &scene.condition, paint, (AXIS, stands))?;
    }
    Ok(())
}

fn layout(scene: &PathScene<'_>, plan: &Plan<'_>) -> Result<Store, VisualError> {
    let factor = plan.factor();
    let mut part: Vec<Point3<f64>> =
        plan.first.points.iter().filter(|p| plan.cuts(p)).map(intended).collect();
    if let Some(work) = &scene.workpiece {
        part.extend(work.triangles.vertices_mm.iter().map(|v| work.base_from_object * v));
    }
    let (low, high) = bounds(&part);
    // Seen from beyond the part, from above, a little from the side.
    let middle = nalgebra::center(&low, &high);
    let out = Vector3::new(middle.x, middle.y, 0.0).try_normalize(1e-6).unwrap_or_else(Vector3::x);
    let side = Vector3::z().cross(&out);
    let posed = scene.arm.at_condition(&scene.condition);
    let mut cell = part.clone();
    cell.push(Point3::origin());
    for stand in plan.after.iter().step_by((plan.after.len() / 8).max(1)) {
        cell.extend(arm::extent(&posed, &stand.joints));
    }
    let cell_eye = Eye::on(&cell, 0.45 * out - 0.95 * side + 0.38 * Vector3::z(), 1.25);
    let part_eye = Eye::on(&part, 0.75 * out - 0.45 * side + 0.8 * Vector3::z(), 1.35);
    let cell_view = View::space(
        format!("Arm [mm] – grey: after, orange: before {factor}"),
        &["+ /arm/after/**", "+ /arm/exaggerated/**", "+ /workpiece", "+ /path/intended", "+ /path/travel"],
        &cell_eye,
    );
    let drawn = View::space(
        format!("Deviation {factor} [mm]"),
        &["+ /workpiece", "+ /path/intended", "+ /exaggerated/**", "+ /tool_axes", "+ /marks/**"],
        &part_eye,
    );
    let true_scale = View::space(
        "True scale [mm]",
        &["+ /workpiece", "+ /path/**", "+ /tool_axes", "+ /marks/**", "+ /arm/after/**", "+ /arm/before/**"],
        &part_eye,
    );
    let upper = Pane::Row(vec![
        (1.0, Pane::View(cell_view)),
        (
            1.0,
            Pane::Column(vec![
                (6.0, Pane::Tabs(vec![Pane::View(drawn), Pane::View(true_scale)])),
                (1.0, legend::pane("Colour: size of the deviation [mm]")),
            ]),
        ),
    ]);
    let left = Pane::Column(vec![(1.5, upper), (1.0, curves::panes(scene))]);
    let text = Pane::View(View::text("Summary", &["+ /summary"]));
    page(Pane::Row(vec![(3.0, left), (1.0, text)]), AXIS, POINTS_PER_SECOND)
}
