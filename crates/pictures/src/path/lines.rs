//! Objects in the 3D view: workpiece, paths, tool axes, marks, colour bar.

use nalgebra::{Point3, Vector3};
use re_sdk_types::archetypes::{Arrows3D, LineStrips3D, Mesh3D, Points3D};
use re_sdk_types::components::{Color, Radius};

use super::scene::{PathScene, Plan, intended, reached};
use crate::colour::{BEFORE, FLAGGED, INTENDED, REFUSED, Rgba, TOOL, TRAVEL, WORKPIECE, after};
use crate::legend;
use crate::page::bounds;
use crate::recording::{Store, VisualError};
use truegrind_compensation::deviation::{Deviation, MotionStatus, PathPoint, PathReport};

/// Tool axes that are drawn at most.
const AXES: usize = 40;
/// Length of a tool axis over the size of the path.
const AXIS_LENGTH: f64 = 0.10;
/// Marks that carry a label at most; the others are drawn without.
const LABELS: usize = 4;

pub(super) fn draw(store: &mut Store, scene: &PathScene<'_>, plan: &Plan<'_>) -> Result<(), VisualError> {
    workpiece(store, scene)?;
    let points = &plan.first.points;
    let cut = strips(points, |p| plan.cuts(p).then(|| (intended(p), 0)));
    plain(store, "path/intended", &cut, INTENDED, 1.0)?;
    let travel = strips(points, |p| Some((intended(p), usize::from(plan.cuts(p)))));
    let travel: Vec<_> = travel.into_iter().filter(|(kind, _)| *kind == 0).collect();
    plain(store, "path/travel", &travel, TRAVEL, 0.6)?;
    let mut labels = Labels::over(plan);
    for &k in &plan.befores {
        let name = if k == 0 { String::new() } else { format!("_{}", plan.names[k]) };
        let title = plan.before_name(scene, k);
        let drawn = Run { name: format!("before{name}"), title, colour: BEFORE, expected: None };
        run(store, plan, &scene.reports[k], |p| p.before, &drawn, &mut labels)?;
    }
    for (k, report) in scene.reports.iter().enumerate() {
        let title =
            if scene.reports.len() > 1 { format!("after · {}", report.model) } else { "after".to_owned() };
        let expected = report.expected_mm();
        let drawn = Run { name: format!("after/{}", plan.names[k]), title, colour: after(k), expected };
        run(store, plan, report, |p| p.after, &drawn, &mut labels)?;
    }
    tool_axes(store, plan)?;
    marks(store, plan)?;
    legend::draw(store, &plan.scale)
}

fn workpiece(store: &mut Store, scene: &PathScene<'_>) -> Result<(), VisualError> {
    let Some(work) = &scene.workpiece else { return Ok(()) };
    if work.triangles.triangles.is_empty() {
        return Ok(());
    }
    let placed = work.base_from_object;
    let mesh = Mesh3D::new(work.triangles.vertices_mm.iter().map(|v| xyz(&(placed * v))))
        .with_vertex_normals(work.triangles.normals.iter().map(|n| {
            let n = placed.rotation * n.into_inner();
            [n.x as f32, n.y as f32, n.z as f32]
        }))
        .with_triangle_indices(work.triangles.triangles.iter().copied())
        .with_vertex_colors(work.triangles.vertices_mm.iter().map(|_| Color::from(WORKPIECE)));
    store.fixed("workpiece", &mesh)
}

/// Positions of labels: beside the path, where no line runs, and without overlap.
struct Labels {
    /// Middle of the cut.
    middle: Point3<f64>,
    /// Size of the cut (mm).
    size_mm: f64,
    /// Positions that have one.
    taken: Vec<Point3<f64>>,
}

/// Distance of a label from the middle of the cut, over the size of the cut: half of that, some space, and half the label by its
/// characters.
const BESIDE: f64 = 0.55;
const CHARACTER: f64 = 0.0095;
/// Farther from the middle a label leaves the view.
const MAX_FROM_MIDDLE: f64 = 0.7;
/// How much a label is lifted, over how far it goes sideways.
const LIFTED: f64 = 0.8;
/// Labels are about so long, over the size of the cut.
const LABEL_LENGTH: f64 = 0.4;

impl Labels {
    fn over(plan: &Plan<'_>) -> Self {
        let cut: Vec<Point3<f64>> = plan.first.points.iter().filter(|p| plan.cuts(p)).map(intended).collect();
        let (low, high) = bounds(&cut);
        Self { middle: nalgebra::center(&low, &high), size_mm: plan.extent_mm, taken: Vec::new() }
    }

    /// Position of the label of `point`: on its side of the cut, on the other, or above; `None` where each would overlap another.
    fn take(&mut self, point: &PathPoint, label: &str) -> Option<Point3<f64>> {
        let beside = (intended(point) - self.middle).try_normalize(1e-9).unwrap_or_else(Vector3::z);
        // Lifted, since a view is wider than high and a label beside the path would end beyond its edge.
        let lifted = |side: Vector3<f64>| (side + LIFTED * Vector3::z()).try_normalize(1e-9).unwrap_or(side);
        let distance =
            (BESIDE + CHARACTER * label.chars().count() as f64).min(MAX_FROM_MIDDLE) * self.size_mm;
        let positions =
            [lifted(beside), lifted(-beside), Vector3::z()].map(|away| self.middle + away * distance);
        let far = |a: &Point3<f64>, b: &Point3<f64>| (a - b).norm() >= LABEL_LENGTH * self.size_mm;
        let free = positions.into_iter().find(|position| self.taken.iter().all(|other| far(other, position)));
        self.taken.extend(free);
        free
    }
}

/// How one path is drawn.
struct Run {
    /// Its entity.
    name: String,
    /// What its label begins with.
    title: String,
    colour: Rgba,
    /// What has to be expected of it, where that is another thing than what the points say (mm).
    expected: Option<f64>,
}

/// One path, at true scale and exaggerated, with a label beside its largest deviation.
fn run(
    store: &mut Store,
    plan: &Plan<'_>,
    report: &PathReport,
    which: fn(&PathPoint) -> Option<Deviation>,
    Run { name, title, colour, expected }: &Run,
    labels: &mut Labels,
) -> Result<(), VisualError> {
    let drawn = report.points.iter().filter(|p| plan.cuts(p)).filter_map(|p| which(p).map(|d| (p, d)));
    let largest = drawn.max_by(|a, b| a.1.norm_mm().total_cmp(&b.1.norm_mm()));
    let text = |deviation: &Deviation| match expected {
        Some(mm) => format!("{title}: {mm:.3} mm expected (1σ)"),
        None => format!("{title}: {:.3} mm", deviation.norm_mm()),
    };
    let position = largest.as_ref().and_then(|(point, deviation)| labels.take(point, &text(deviation)));
    for (folder, times, width) in [("path", 1.0, 2.5), ("exaggerated", plan.times, 1.8)] {
        // At true scale only the colour shows the size; exaggerated, it separates the curves.
        let by_size = folder == "path";
        let coloured = strips(&report.points, |p| {
            let deviation = which(p).filter(|d| plan.cuts(p) && d.norm_mm().is_finite())?;
            let step = if by_size { plan.scale.step(deviation.norm_mm()) } else { 0 };
            Some((reached(p, &deviation, times), step))
        });
        let paint = |step: usize| Color::from(if by_size { plan.scale.colour(step) } else { *colour });
        if coloured.is_empty() {
            continue;
        }
        let lines =
            LineStrips3D::new(coloured.iter().map(|(_, strip)| strip.iter().map(xyz).collect::<Vec<_>>()))
                .with_colors(coloured.iter().map(|(step, _)| paint(*step)))
                .with_radii([Radius::new_ui_points(width)]);
        store.fixed(format!("{folder}/{name}"), &lines)?;
        let Some((point, deviation)) = largest else { continue };
        let at = reached(point, &deviation, times);
        let entity = format!("{folder}/largest/{name}");
        let mark = Points3D::new([xyz(&at)])
            .with_radii([Radius::new_ui_points(3.5)])
            .with_colors([Color::from(*colour)]);
        store.fixed(entity.as_str(), &mark)?;
        let Some(position) = position else { continue };
        let leader = LineStrips3D::new([[xyz(&at), xyz(&position)]])
            .with_radii([Radius::new_ui_points(0.8)])
            .with_colors([Color::from(*colour)]);
        store.fixed(format!("{entity}/leader"), &leader)?;
        let label = Points3D::new([xyz(&position)])
            .with_radii([Radius::new_ui_points(0.5)])
            .with_colors([Color::from(*colour)])
            .with_labels([text(&deviation)])
            .with_show_labels(true);
        store.fixed(format!("{entity}/label"), &label)?;
    }
    Ok(())
}

/// Cuts a path into strips of one kind each. A piece between two points has the kind of the second; where a point has
/// no place, the line breaks.
fn strips(
    points: &[PathPoint],
    position: impl Fn(&PathPoint) -> Option<(Point3<f64>, usize)>,
) -> Vec<(usize, Vec<Point3<f64>>)> {
    let mut strips: Vec<(usize, Vec<Point3<f64>>)> = Vec::new();
    let mut last: Option<Point3<f64>> = None;
    for point in points {
        let Some((here, kind)) = position(point) else {
            last = None;
            continue;
        };
        if let Some(from) = last {
            match strips.last_mut() {
                Some((same, strip)) if *same == kind && strip.last() == Some(&from) => strip.push(here),
                _ => strips.push((kind, vec![from, here])),
            }
        }
        last = Some(here);
    }
    strips
}

fn plain(
    store: &mut Store,
    path: &str,
    strips: &[(usize, Vec<Point3<f64>>)],
    colour: Rgba,
    width: f32,
) -> Result<(), VisualError> {
    if strips.is_empty() {
        return Ok(());
    }
    let lines = LineStrips3D::new(strips.iter().map(|(_, strip)| strip.iter().map(xyz).collect::<Vec<_>>()))
        .with_colors([Color::from(colour)])
        .with_radii([Radius::new_ui_points(width)]);
    store.fixed(path, &lines)
}

/// Arrows along the tool's z axis, ending at the TCP.
fn tool_axes(store: &mut Store, plan: &Plan<'_>) -> Result<(), VisualError> {
    let cut: Vec<&PathPoint> = plan.first.points.iter().filter(|p| plan.cuts(p)).collect();
    let length = AXIS_LENGTH * plan.extent_mm;
    let shown: Vec<&PathPoint> = cut.iter().step_by(cut.len().div_ceil(AXES).max(1)).copied().collect();
    let axis = |p: &PathPoint| p.intended.rotation * nalgebra::Vector3::z() * length;
    let arrows = Arrows3D::from_vectors(shown.iter().map(|p| {
        let z = axis(p);
        [z.x as f32, z.y as f32, z.z as f32]
    }))
    .with_origins(shown.iter().map(|p| xyz(&(intended(p) - axis(p)))))
    .with_radii([Radius::new_ui_points(0.8)])
    .with_colors([Color::from(TOOL)]);
    store.fixed("tool_axes", &arrows)
}

fn marks(store: &mut Store, plan: &Plan<'_>) -> Result<(), VisualError> {
    for (status, name, colour) in
        [(MotionStatus::Flagged, "flagged", FLAGGED), (MotionStatus::Refused, "refused", REFUSED)]
    {
        let marked: Vec<&PathPoint> = plan.first.points.iter().filter(|p| p.status == status).collect();
        if marked.is_empty() {
            continue;
        }
        let points = Points3D::new(marked.iter().map(|p| xyz(&intended(p))))
            .with_radii([Radius::new_ui_points(2.5)])
            .with_colors([Color::from(colour)]);
        store.fixed(format!("marks/{name}"), &points)?;
        let labels: Vec<(Point3<f64>, String)> =
            runs(&marked).iter().take(LABELS).map(|run| label(run, name)).collect();
        let texts = Points3D::new(labels.iter().map(|(at, _)| xyz(at)))
            .with_radii([Radius::new_ui_points(4.0)])
            .with_colors([Color::from(colour)])
            .with_labels(labels.iter().map(|(_, text)| text.as_str()))
            .with_show_labels(true);
        store.fixed(format!("marks/{name}/labels"), &texts)?;
    }
    Ok(())
}

/// Neighbouring points that are marked for the same kind of reason.
fn runs<'a>(marked: &[&'a PathPoint]) -> Vec<Vec<&'a PathPoint>> {
    let mut runs: Vec<Vec<&PathPoint>> = Vec::new();
    for &point in marked {
        match runs.last_mut() {
            Some(run)
                if run.last().is_some_and(|l| {
                    l.index + 1 == point.index && l.kind_of_reason() == point.kind_of_reason()
                }) =>
            {
                run.push(point);
            }
            _ => runs.push(vec![point]),
        }
    }
    runs
}

/// Position and text of the label of a run.
fn label(run: &[&PathPoint], status: &str) -> (Point3<f64>, String) {
    let (first, last, middle) = (run[0], run[run.len() - 1], run[run.len() / 2]);
    let position = match (first.line, last.line) {
        (0, _) | (_, 0) if first.index == last.index => format!("point {}", first.index),
        (0, _) | (_, 0) => format!("points {}–{}", first.index, last.index),
        (a, b) if a == b => format!("line {a}"),
        (a, b) => format!("lines {a}–{b}"),
    };
    let same = run.iter().all(|point| point.reason == first.reason);
    let which = if same { "" } else { " (the first)" };
    let reason = first.reason.as_deref().map(|r| format!(": {}{which}", short(r))).unwrap_or_default();
    (intended(middle), format!("{position} {status}{reason}"))
}

/// A reason as long as a label in a picture may be; the text beside it has the whole.
fn short(reason: &str) -> String {
    let mut out = String::new();
    for word in reason.split_whitespace() {
        if out.chars().count() + word.chars().count() >= LABEL {
            return out + " …";
        }
        out.extend([if out.is_empty() { "" } else { " " }, word]);
    }
    out
}

/// Characters of a reason that a label shows.
const LABEL: usize = 36;

fn xyz(p: &Point3<f64>) -> [f32; 3] {
    [p.x as f32, p.y as f32, p.z as f32]
}
