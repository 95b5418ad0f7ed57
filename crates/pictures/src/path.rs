//! Recording of a path: the arm running the program, the workpiece, and the deviation of the tool.
//!
//! | entity | content |
//! |---|---|
//! | `arm/nominal` | the nominal arm at the joints of the uncorrected program, transparent |
//! | `arm/exaggerated` | the real arm at the same joints, with exaggerated differences |
//! | `arm/after` | the real arm at the joints of the corrected program |
//! | `arm/before` | the real arm at the joints of the uncorrected program |
//! | `workpiece` | the workpiece, if its triangles are known |
//! | `path/intended`, `path/travel` | intended path of the tool, and moves between cuts |
//! | `path/before`, `path/after/…` | path of the tool to scale, coloured by the deviation |
//! | `exaggerated/…` | the paths with exaggerated deviations |
//! | `tool_axes` | direction of the tool at some points |
//! | `marks/flagged`, `marks/refused` | flagged and refused points |
//! | `deviation/normal/…`, `deviation/size/…`, `deviation/angle/…` | deviation along the path |
//! | `joints/…` | change of the joints by the correction |
//! | `summary`, `legend` | key figures, and colours |
//!
//! Deviations of a millimetre are invisible to scale, so they are also drawn exaggerated by a common factor, stated in names and
//! labels. The differences of the arm itself have a separate factor (`shape`).

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
use truegrind_compensation::deviation::After;

pub use self::scene::{AXIS, PathScene, Workpiece};

/// Playback speed (points per second).
const POINTS_PER_SECOND: f64 = 15.0;

/// Recording of a path.
///
/// # Errors
/// [`VisualError::Empty`] without a single point.
pub fn path_recording(scene: &PathScene<'_>) -> Result<Recording, VisualError> {
    let plan = Plan::of(scene)?;
    let mut store = Store::default();
    store.fixed("/", &re_sdk_types::archetypes::ViewCoordinates::RIGHT_HAND_Z_UP())?;
    arms(&mut store, scene, &plan)?;
    lines::draw(&mut store, scene, &plan)?;
    curves::draw(&mut store, scene, &plan)?;
    summary::draw(&mut store, scene, &plan)?;
    Recording::new("truegrind path", scene.title, store, layout(scene, &plan)?)
}

fn arms(store: &mut Store, scene: &PathScene<'_>, plan: &Plan<'_>) -> Result<(), VisualError> {
    let ghost = Paint::ghost(BEFORE);
    for (root, paint, states) in
        [("arm/after", &Paint::SOLID, &plan.after), ("arm/before", &ghost, &plan.before)]
    {
        arm::draw(store, root, scene.figure(scene.arm), paint, (AXIS, states))?;
    }
    match &plan.shape {
        Some(shape) => shape.draw(store, scene.figure(scene.nominal), AXIS),
        None => Ok(()),
    }
}

fn layout(scene: &PathScene<'_>, plan: &Plan<'_>) -> Result<Store, VisualError> {
    let factor = plan.factor();
    let mut part: Vec<Point3<f64>> =
        plan.first.points.iter().filter(|p| plan.cuts(p)).map(intended).collect();
    if let Some(work) = &scene.workpiece {
        part.extend(work.triangles.vertices_mm.iter().map(|v| work.base_from_object * v));
    }
    let (low, high) = bounds(&part);
    // View from beyond the workpiece, from above, slightly from the side.
    let middle = nalgebra::center(&low, &high);
    let out = Vector3::new(middle.x, middle.y, 0.0).try_normalize(1e-6).unwrap_or_else(Vector3::x);
    let side = Vector3::z().cross(&out);
    let posed = scene.arm.at_condition(&scene.condition);
    let mut cell = part.clone();
    cell.push(Point3::origin());
    let length = arm::length_mm(scene.arm);
    for states in [&plan.before, &plan.after] {
        for state in states.iter().step_by((states.len() / 8).max(1)) {
            cell.extend(arm::extent(&posed, &state.joints, length));
        }
    }
    let cell_eye = Eye::on(&cell, 0.45 * out - 0.95 * side + 0.38 * Vector3::z(), 1.0, 0.92);
    let part_eye = Eye::on(&part, 0.75 * out - 0.45 * side + 0.8 * Vector3::z(), 1.0, 0.8);
    let around = ["+ /workpiece", "+ /path/intended", "+ /path/travel"];
    let with = |more: &[&'static str]| [&around[..], more].concat();
    let arms =
        View::space("Arm, true scale [mm]", &with(&["+ /arm/after/**", "+ /arm/before/**"]), &cell_eye);
    let cell_view = match &plan.shape {
        Some(shape) => {
            let bent = View::space(
                format!("Arm [mm] – orange: {} {}, ghost: data sheet", scene.arm_is, shape.factor()),
                &with(&["+ /arm/nominal/**", "+ /arm/exaggerated/**"]),
                &cell_eye,
            );
            Pane::Tabs(vec![Pane::View(bent), Pane::View(arms)])
        }
        None => Pane::View(arms),
    };
    let on_part = ["+ /workpiece", "+ /path/intended", "+ /tool_axes", "+ /marks/**"];
    let drawn = View::space(
        format!("Deviation {factor} [mm]"),
        &[&on_part[..], &["+ /exaggerated/**"]].concat(),
        &part_eye,
    );
    let sized = |name: &str, shows: &[&'static str]| {
        Pane::View(View::space(name, &[&["+ /workpiece"], shows].concat(), &part_eye))
    };
    let mut tabs = vec![
        Pane::View(drawn),
        sized("Size before [mm]", &["+ /path/before/**", "+ /path/largest/before/**"]),
    ];
    // The remainder under the correcting model is almost zero and does not predict the arm.
    if scene.reports.iter().any(|report| report.after == After::Achieved) {
        tabs.push(sized("Size after [mm]", &["+ /path/after/**", "+ /path/largest/after/**"]));
    }
    let upper = Pane::Row(vec![
        (1.0, cell_view),
        (
            1.0,
            Pane::Column(vec![
                (6.0, Pane::Tabs(tabs)),
                (1.0, legend::pane("Colour in the tabs of sizes: deviation [mm]")),
            ]),
        ),
    ]);
    let left = Pane::Column(vec![(1.5, upper), (1.0, curves::panes(scene))]);
    let text = Pane::View(View::text("Summary", &["+ /summary"]));
    page(Pane::Row(vec![(3.0, left), (1.0, text)]), AXIS, POINTS_PER_SECOND)
}
