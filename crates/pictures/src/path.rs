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

mod curves;
mod lines;
mod summary;

use nalgebra::{Point3, Vector3};

use super::arm::{self, Paint, Stand};
use super::colour::{self, BEFORE, Scale};
use super::legend;
use super::page::{Eye, Pane, View, bounds, page};
use super::recording::{Recording, Store, VisualError};
use truegrind_arm::condition::Condition;
use truegrind_arm::model::Model;
use truegrind_compensation::deviation::{Deviation, PathPoint, PathReport};
use truegrind_math::se3::Pose;
use truegrind_surfaces::Tessellation;

/// The time axis: [`PathPoint::index`].
pub const AXIS: &str = "path point";

/// Points that go by in a second when the path is played.
const POINTS_PER_SECOND: f64 = 15.0;

/// Exaggerated deviations shall reach this part of the size of the path.
const REACH: f64 = 0.15;

/// No joint of the exaggerated arm turns farther than this from the arm after (rad).
const FARTHEST_RAD: f64 = 1.0;

/// A part in the cell.
#[derive(Debug, Clone, Copy)]
pub struct Workpiece<'a> {
    /// Its triangles, in the work object.
    pub triangles: &'a Tessellation,
    /// The work object in the base.
    pub base_from_object: Pose,
}

/// What is to be drawn.
#[derive(Debug, Clone, Copy)]
pub struct PathScene<'a> {
    /// Heading of the page and name of the recording.
    pub title: &'a str,
    /// The arm whose frames are drawn: the one that the deviations belong to.
    pub arm: &'a Model,
    /// What that arm is, in words: "simulated actual arm", "estimated arm of model.toml".
    pub arm_is: &'a str,
    /// The circumstances under which it runs.
    pub condition: Condition,
    /// The path under one or more models; all of the same program. The arm moves as the first one says.
    pub reports: &'a [PathReport],
    /// The part, where known.
    pub workpiece: Option<Workpiece<'a>>,
}

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

/// What all parts of the picture share.
struct Plan<'a> {
    /// The first report: its intended path, its marks and its arm are drawn.
    first: &'a PathReport,
    /// Name of each report's entities.
    names: Vec<String>,
    /// Reports whose deviations before are drawn: the first, and those that differ from it.
    befores: Vec<usize>,
    /// Whether the program says which points cut.
    has_cuts: bool,
    /// Colours of sizes.
    scale: Scale,
    /// Scale factor of exaggerated deviations.
    times: f64,
    /// Size of the intended path (mm).
    extent_mm: f64,
    /// Joints along the path: after, before, exaggerated.
    after: Vec<Stand>,
    before: Vec<Stand>,
    exaggerated: Vec<Stand>,
}

impl<'a> Plan<'a> {
    fn of(scene: &PathScene<'a>) -> Result<Self, VisualError> {
        let first = scene.reports.first().ok_or(VisualError::Empty("no path was given"))?;
        if first.points.is_empty() {
            return Err(VisualError::Empty("the path has no points"));
        }
        let has_cuts = first.points.iter().any(|p| p.cutting);
        let sizes = |r: &PathReport| -> Vec<f64> {
            let cut = r.points.iter().filter(|p| p.cutting || !has_cuts);
            cut.flat_map(|p| [p.before, p.after]).flatten().map(|d| d.norm_mm()).collect()
        };
        let sizes: Vec<f64> = scene.reports.iter().flat_map(sizes).collect();
        let cut: Vec<Point3<f64>> =
            first.points.iter().filter(|p| p.cutting || !has_cuts).map(intended).collect();
        let (low, high) = bounds(&cut);
        let extent_mm = (high - low).norm().max(1.0);
        let largest = sizes.iter().copied().filter(|s| s.is_finite()).fold(0.0, f64::max);
        let times = if largest > 0.0 { colour::round_down(REACH * extent_mm / largest) } else { 1.0 };
        let stands = |joints: &dyn Fn(&PathPoint) -> Option<truegrind_arm::model::Joints>| {
            let stand = |p: &PathPoint| {
                joints(p).map(|joints| Stand {
                    time: p.index as i64,
                    joints,
                    flange_from_tool: p.flange_from_tool,
                })
            };
            first.points.iter().filter_map(stand).collect::<Vec<Stand>>()
        };
        let exaggerated = |p: &PathPoint| {
            let (before, after) = (p.joints_before?, p.joints_after?);
            let turn = (before - after) * times;
            (turn.amax() <= FARTHEST_RAD).then_some(after + turn)
        };
        Ok(Self {
            first,
            names: names(scene.reports),
            befores: befores(scene.reports),
            has_cuts,
            scale: Scale::over(sizes),
            times,
            extent_mm,
            after: stands(&|p| p.joints_after),
            before: stands(&|p| p.joints_before),
            exaggerated: stands(&exaggerated),
        })
    }

    /// Whether a point belongs to a cut; all do where the program does not tell.
    fn cuts(&self, point: &PathPoint) -> bool {
        point.cutting || !self.has_cuts
    }

    /// The factor, as labels print it.
    fn factor(&self) -> String {
        format!("×{}", self.times)
    }

    /// Name of the deviations before of report `index`, where more than one is drawn.
    fn before_name(&self, scene: &PathScene<'_>, index: usize) -> String {
        if self.befores.len() > 1 {
            format!("before · {}", scene.reports[index].model)
        } else {
            "before".to_owned()
        }
    }
}

/// Where the tool shall be, in the base.
fn intended(point: &PathPoint) -> Point3<f64> {
    Point3::from(point.intended.translation.vector)
}

/// Where the tool goes with its deviation times a factor, in the base.
fn reached(point: &PathPoint, deviation: &Deviation, times: f64) -> Point3<f64> {
    intended(point) + point.base_from_object.rotation * deviation.vector_mm * times
}

/// A name for each report that can stand in an entity's path, each different.
fn names(reports: &[PathReport]) -> Vec<String> {
    let mut names: Vec<String> = Vec::new();
    for report in reports {
        let plain = |c: char| if c.is_alphanumeric() || c == '-' { c } else { '_' };
        let mut name: String = report.model.chars().map(plain).collect();
        if name.is_empty() || names.contains(&name) {
            name = format!("{name}_{}", names.len() + 1);
        }
        names.push(name);
    }
    names
}

/// Judged on one actual arm, the program as it was is off by the same under every model, and is drawn once.
fn befores(reports: &[PathReport]) -> Vec<usize> {
    let same = |a: &PathReport, b: &PathReport| {
        a.points.len() == b.points.len()
            && a.points.iter().zip(&b.points).all(|(p, q)| match (p.before, q.before) {
                (Some(p), Some(q)) => (p.vector_mm - q.vector_mm).norm() < 1e-9,
                (None, None) => true,
                _ => false,
            })
    };
    (0..reports.len()).filter(|&k| k == 0 || !same(&reports[0], &reports[k])).collect()
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
    let posed = scene.arm.under(&scene.condition);
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
