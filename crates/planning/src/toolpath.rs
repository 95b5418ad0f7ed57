//! A program from a surface file: chooses the branch of the arm that follows the whole path, and its configuration.
//!
//! Every branch that reaches the first point is followed along the path on the nominal arm, which the controller uses. Of
//! those that reach the end within the joint limits, the one farthest from singularities is chosen. Full turns of joints 4
//! and 6 have the same distance from singularities; of these the one farthest from the joint limits is chosen.

use std::path::Path;

use thiserror::Error;

use truegrind_arm::condition::Condition;
use truegrind_arm::inverse::{Inverse, InverseError};
use truegrind_arm::model::{Joints, Model};
use truegrind_arm::robots::Robot;
use truegrind_compensation::cell::nc_setup::angle_convention;
use truegrind_math::option_f64::OptionF64;
use truegrind_math::se3::Pose;
use truegrind_programs::draft::{Draft, Step, heading};
use truegrind_programs::motion::{
    Frame, MotionKind, RobTarget, TargetValue, ToolValue, UNCORRECTED, WorkObjectValue,
};
use truegrind_programs::nc::dialect::Dialect;
use truegrind_programs::nc::orientation::Angles;
use truegrind_programs::{nc, rapid};
use truegrind_surfaces::path::{PathPoint, PointKind};
use truegrind_surfaces::{SurfaceError, SurfaceFile};

/// Why no program can be written.
#[derive(Debug, Error)]
#[non_exhaustive]
pub enum ToolpathError {
    /// The surface has no path.
    #[error(transparent)]
    Surface(#[from] SurfaceError),
    /// The path has no points.
    #[error("{name}: the path has no points")]
    Empty {
        /// Job.
        name: String,
    },
    /// No branch of the arm follows the whole path.
    #[error(transparent)]
    NotFollowed(Box<NotFollowed>),
}

/// The first point of a path that the best branch does not reach.
#[derive(Debug, Error)]
#[error(
    "{name}: point {point} of {count} at ({x:.1}, {y:.1}, {z:.1}) mm in {object} cannot be followed by {robot}: {error}; \
     move the work object, shorten the tool, or change lead and tilt",
    x = position_mm[0], y = position_mm[1], z = position_mm[2]
)]
pub struct NotFollowed {
    /// Job.
    pub name: String,
    /// Robot.
    pub robot: String,
    /// Point, from 1.
    pub point: usize,
    /// Number of points.
    pub count: usize,
    /// Work object.
    pub object: String,
    /// Position in the work object (mm).
    pub position_mm: [f64; 3],
    /// Cause.
    pub error: InverseError,
}

/// A program with the intended joints of every point.
#[derive(Debug, Clone)]
pub struct Toolpath {
    /// The program as input of a dialect's writer.
    pub draft: Draft,
    /// Points of the path, in the work object.
    pub points: Vec<PathPoint>,
    /// Nominal joints at each.
    pub joints: Vec<Joints>,
    /// Smallest distance to singularity on the path, as [`truegrind_arm::inverse::Solution::singularity`].
    pub singularity: f64,
}

impl Toolpath {
    /// The program for a control, or as RAPID. A, B and C of an NC program are those that the file of `robot` states, or else rotations about
    /// the fixed x, y and z axes (W, P, R). `inline`: the targets stand in the instructions and are not declared.
    ///
    /// # Errors
    /// A name that the language does not allow, or a control for which no programs are written.
    pub fn program(
        &self,
        control: Option<Dialect>,
        robot: &Robot,
        inline: bool,
    ) -> Result<Vec<u8>, WriteError> {
        let draft = Draft { named_targets: !inline, ..self.draft.clone() };
        let Some(control) = control else { return Ok(rapid::writer::write(&draft)?) };
        let angles = robot.sheet.orientation().and_then(angle_convention).unwrap_or(Angles::Wpr);
        Ok(nc::writer::write(&draft, control, angles)?)
    }
}

/// The control for which a program of this name is written: Fanuc style for `.nc`, Siemens 840D for `.mpf` and `.spf`; `None` for RAPID (`.mod`
/// and others, or no extension).
///
/// # Errors
/// [`WriteError::Extension`].
pub fn control_of(output: &Path) -> Result<Option<Dialect>, WriteError> {
    let extension = output.extension().map(|extension| extension.to_string_lossy().to_ascii_lowercase());
    match extension.as_deref() {
        Some("nc") => Ok(Some(Dialect::Fanuc)),
        Some("mpf" | "spf") => Ok(Some(Dialect::Siemens)),
        Some("mod" | "modx" | "prg" | "sys") | None => Ok(None),
        Some(other) => {
            Err(WriteError::Extension { file: output.display().to_string(), extension: other.to_owned() })
        }
    }
}

/// Why a program is not written.
#[derive(Debug, Error)]
#[non_exhaustive]
pub enum WriteError {
    /// The extension of another file.
    #[error(
        "{file}: new programs are written as RAPID (.mod), Fanuc style (.nc) or 840D (.mpf), not as .{extension}: choose one of these extensions"
    )]
    Extension {
        /// The file.
        file: String,
        /// Its extension.
        extension: String,
    },
    /// As RAPID.
    #[error(transparent)]
    Rapid(#[from] rapid::writer::WriteError),
    /// As an NC program.
    #[error(transparent)]
    Nc(#[from] nc::writer::WriteError),
}

/// Makes the program of a surface file for a nominal arm. `robot` is named in errors and comments.
///
/// ```
/// use truegrind_arm::{condition::Condition, robots};
/// use truegrind_planning::toolpath::toolpath;
/// use truegrind_surfaces::sample;
///
/// let arm = robots::load("abb-irb-120")?.model;
/// let file = sample::BLADE.read()?;
/// let path = toolpath(&file, &arm, "abb-irb-120")?;
/// assert_eq!(path.points.len(), path.joints.len());
/// assert!(path.joints.iter().all(|joints| arm.limits.violated(joints).is_none()));
/// // Its joints place the tool at the points of the path.
/// let tool = arm.forward(&path.joints[0], &Condition::default()) * file.tool.flange_from_tool;
/// let setup = file.work_object.base_from_work_object * path.points[0].work_object_from_tool();
/// assert!((tool.translation.vector - setup.translation.vector).norm() < 1e-6);
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
///
/// # Errors
/// [`ToolpathError`], naming the first point that the best branch does not reach.
pub fn toolpath(file: &SurfaceFile, nominal: &Model, robot: &str) -> Result<Toolpath, ToolpathError> {
    let points = file.points()?;
    let first = points.first().ok_or_else(|| ToolpathError::Empty { name: file.name.clone() })?;
    let inverse = Inverse::new(nominal, &Condition::default(), nominal);
    let tool = file.tool.flange_from_tool;
    let flange =
        |p: &PathPoint| file.work_object.base_from_work_object * p.work_object_from_tool() * tool.inverse();
    let flanges: Vec<Pose> = points.iter().map(flange).collect();
    let mut best: Option<Followed> = None;
    let mut farthest: (usize, InverseError) = (0, InverseError::Unreachable { beyond_mm: f64::NAN });
    let starts = inverse.all(&flanges[0]);
    if starts.is_empty()
        && let Err(error) = inverse.solve_near(&flanges[0], &Joints::zeros())
    {
        farthest = (0, error);
    }
    for start in starts {
        match follow(&inverse, &flanges, start.joints) {
            Ok(found) => {
                if best.as_ref().is_none_or(|best| found.better_than(best, nominal)) {
                    best = Some(found);
                }
            }
            Err((reached, error)) if reached >= farthest.0 => farthest = (reached, error),
            Err(_) => {}
        }
    }
    let Some(Followed { singularity, joints }) = best else {
        let at = points.get(farthest.0).unwrap_or(first).position_mm;
        return Err(ToolpathError::NotFollowed(Box::new(NotFollowed {
            name: file.name.clone(),
            robot: robot.to_owned(),
            point: farthest.0 + 1,
            count: points.len(),
            object: file.work_object.name.clone(),
            position_mm: at.coords.into(),
            error: farthest.1,
        })));
    };
    let draft = draft(file, robot, &points, &joints, &inverse);
    Ok(Toolpath { draft, points, joints, singularity })
}

/// A path that one branch follows.
struct Followed {
    /// Smallest distance to singularity on the path.
    singularity: f64,
    joints: Vec<Joints>,
}

impl Followed {
    fn better_than(&self, other: &Self, nominal: &Model) -> bool {
        // Full turns of joints 4 and 6 differ only by rounding.
        if (self.singularity - other.singularity).abs() > 1e-9 {
            return self.singularity > other.singularity;
        }
        self.reach(nominal) < other.reach(nominal)
    }

    /// Distance of the joints from the middle of their ranges: the largest share of half the range of each joint, squared and summed.
    fn reach(&self, nominal: &Model) -> f64 {
        let limits = &nominal.limits;
        let share = |q: &Joints, j: usize| {
            let (low, high) = (limits.min_rad[j], limits.max_rad[j]);
            ((2.0 * q[j] - low - high) / (high - low)).abs()
        };
        let largest = |j: usize| self.joints.iter().map(|q| share(q, j)).fold(0.0, f64::max);
        (0..6).map(|j| largest(j).powi(2)).sum()
    }
}

fn follow(inverse: &Inverse<'_>, flanges: &[Pose], start: Joints) -> Result<Followed, (usize, InverseError)> {
    let mut near = start;
    let mut smallest = f64::INFINITY;
    let mut joints = Vec::with_capacity(flanges.len());
    for (i, flange) in flanges.iter().enumerate() {
        let solution = inverse.solve_near(flange, &near).map_err(|e| (i, e))?;
        near = solution.joints;
        smallest = smallest.min(solution.singularity);
        joints.push(near);
    }
    Ok(Followed { singularity: smallest, joints })
}

fn draft(
    file: &SurfaceFile,
    robot: &str,
    points: &[PathPoint],
    joints: &[Joints],
    inverse: &Inverse<'_>,
) -> Draft {
    let zone_mm = match file.zone.as_str() {
        "fine" => None,
        // RAPID's z0 is 0.3 mm; all others are named by their radius in mm.
        "z0" => Some(0.3),
        named => named.trim_start_matches('z').parse().ok(),
    };
    let steps = points
        .iter()
        .zip(joints)
        .enumerate()
        .map(|(i, (point, q))| {
            let conf = inverse.configuration(q);
            let frame = Frame::from_pose(&point.work_object_from_tool());
            let target = RobTarget {
                position_mm: frame.position_mm,
                quaternion: frame.quaternion,
                conf: [conf.cf1, conf.cf4, conf.cf6, conf.cfx],
                external: [OptionF64::NONE; 6],
            };
            let cutting = point.kind == PointKind::Cut;
            let next = points.get(i + 1).map(|p| (p.kind, p.pass));
            let comes_down = next.is_some_and(|(kind, _)| kind == PointKind::Cut) && !cutting;
            let pass_begins =
                cutting && points.get(i.wrapping_sub(1)).is_none_or(|p| p.kind != PointKind::Cut);
            Step {
                kind: if i == 0 { MotionKind::Joint } else { MotionKind::Linear },
                to: TargetValue::Cartesian(target),
                via: None,
                speed_mm_s: if cutting { file.speed_mm_s } else { file.travel_speed_mm_s },
                // The tool stops only off the surface: before the first and after the last point.
                zone_mm: if comes_down || next.is_none() { None } else { zone_mm },
                comment: pass_begins.then(|| format!("pass {}", point.pass + 1)),
                wait_s: None,
            }
        })
        .collect();
    let object = &file.work_object;
    Draft {
        name: file.name.clone(),
        comments: vec![heading(&file.name, robot, points.len()), UNCORRECTED.to_owned()],
        tool: (
            file.tool.name.clone(),
            ToolValue {
                robhold: true,
                frame: Frame::from_pose(&file.tool.flange_from_tool),
                mass_kg: file.tool.mass_kg,
                centre_of_gravity_mm: file.tool.cog_mm.into(),
            },
        ),
        work_object: (
            object.name.clone(),
            WorkObjectValue {
                robhold: false,
                fixed: true,
                mechanical_unit: String::new(),
                user_frame: Frame::from_pose(&object.base_from_work_object),
                object_frame: Frame::IDENTITY,
            },
        ),
        named_targets: true,
        monitor_configuration: true,
        start_deg: joints.first().map(|joints| std::array::from_fn(|i| joints[i].to_degrees())),
        steps,
    }
}
