//! What is to be drawn of a path, and what all parts of the picture share.

use nalgebra::Point3;

use crate::arm::{ArmState, Figure, LinkMesh};
use crate::colour::{self, Scale};
use crate::page::bounds;
use crate::recording::VisualError;
use crate::shape::Shape;
use truegrind_arm::condition::Condition;
use truegrind_arm::model::Model;
use truegrind_compensation::deviation::{Deviation, PathPoint, PathReport};
use truegrind_math::se3::Pose;
use truegrind_surfaces::Tessellation;

/// The time axis: [`PathPoint::index`].
pub const AXIS: &str = "path point";

/// Exaggerated deviations shall reach this part of the size of the path.
const REACH: f64 = 0.15;

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
    /// The arm of the data sheet, as the controller believes it to be: drawn as a ghost beside the other.
    pub nominal: &'a Model,
    /// Meshes that show the links, where a robot file names them; else links are bars.
    pub meshes: &'a [LinkMesh],
    /// What that arm is, in words: "simulated actual arm", "estimated arm of model.toml".
    pub arm_is: &'a str,
    /// The circumstances under which it runs.
    pub condition: Condition,
    /// The path under one or more models; all of the same program. The arm moves as the first one says.
    pub reports: &'a [PathReport],
    /// The part, where known.
    pub workpiece: Option<Workpiece<'a>>,
}

impl<'a> PathScene<'a> {
    /// How an arm of this scene is drawn.
    pub(super) fn figure(&'a self, model: &'a Model) -> Figure<'a> {
        Figure { model, condition: &self.condition, meshes: self.meshes }
    }
}

/// What all parts of the picture share.
pub(super) struct Plan<'a> {
    /// The first report: its intended path, its marks and its arm are drawn.
    pub(super) first: &'a PathReport,
    /// Name of each report's entities.
    pub(super) names: Vec<String>,
    /// Reports whose deviations before are drawn: the first, and those that differ from it.
    pub(super) befores: Vec<usize>,
    /// Whether the program says which points cut.
    pub(super) has_cuts: bool,
    /// Colours of sizes.
    pub(super) scale: Scale,
    /// Scale factor of exaggerated deviations.
    pub(super) times: f64,
    /// Size of the intended path (mm).
    pub(super) extent_mm: f64,
    /// Joints along the path, after and before.
    pub(super) after: Vec<ArmState>,
    pub(super) before: Vec<ArmState>,
    /// The arm of the data sheet and the real one with its differences exaggerated, at the joints before.
    pub(super) shape: Option<Shape>,
}

impl<'a> Plan<'a> {
    pub(super) fn of(scene: &PathScene<'a>) -> Result<Self, VisualError> {
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
        let states = |joints: &dyn Fn(&PathPoint) -> Option<truegrind_arm::model::Joints>| {
            let state = |p: &PathPoint| {
                joints(p).map(|joints| ArmState {
                    time: p.index as i64,
                    joints,
                    flange_from_tool: p.flange_from_tool,
                })
            };
            first.points.iter().filter_map(state).collect::<Vec<ArmState>>()
        };
        let before = states(&|p| p.joints_before);
        let shape = Shape::of(scene.figure(scene.nominal), scene.figure(scene.arm), &before);
        Ok(Self {
            first,
            names: names(scene.reports),
            befores: befores(scene.reports),
            has_cuts,
            scale: Scale::over(sizes),
            times,
            extent_mm,
            after: states(&|p| p.joints_after),
            before,
            shape,
        })
    }

    /// Whether a point belongs to a cut; all do where the program does not tell.
    pub(super) fn cuts(&self, point: &PathPoint) -> bool {
        point.cutting || !self.has_cuts
    }

    /// The factor, as labels print it.
    pub(super) fn factor(&self) -> String {
        format!("×{}", self.times)
    }

    /// Name of the deviations before of report `index`, where more than one is drawn.
    pub(super) fn before_name(&self, scene: &PathScene<'_>, index: usize) -> String {
        if self.befores.len() > 1 {
            format!("before · {}", scene.reports[index].model)
        } else {
            "before".to_owned()
        }
    }
}

/// Where the tool shall be, in the base.
pub(super) fn intended(point: &PathPoint) -> Point3<f64> {
    Point3::from(point.intended.translation.vector)
}

/// Where the tool goes with its deviation times a factor, in the base.
pub(super) fn reached(point: &PathPoint, deviation: &Deviation, times: f64) -> Point3<f64> {
    intended(point) + point.base_from_object.rotation * deviation.vector_mm * times
}

/// A unique name for each report, valid in an entity path.
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
