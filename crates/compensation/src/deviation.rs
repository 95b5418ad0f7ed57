//! Points of a program's path and the deviation of an arm at each.
//!
//! Frames: the *intended* pose is where the program's author wants the TCP, in the base. A deviation is reached minus
//! intended, its vector in the axes of the work object, in which programs and parts are measured.

use std::collections::{BTreeMap, BTreeSet};

use nalgebra::{Isometry3, Matrix3, Point3, SVD, Translation3, UnitQuaternion, Vector3};
use serde::{Deserialize, Serialize};

use crate::line_list::lines_of;
use truegrind_arm::model::Joints;
use truegrind_arm::region::Outside;
use truegrind_math::se3::Pose;
use truegrind_math::statistics::ErrorSummary;
use truegrind_programs::motion::{Listing, Motion, MotionKind, Place, Reason};

/// Deviation of the tool at one point.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Deviation {
    /// Reached minus intended, in the axes of the work object (mm).
    pub vector_mm: Vector3<f64>,
    /// Angle between reached and intended orientation (rad).
    pub angle_rad: f64,
    /// Signed along the outward surface normal (mm); `None` where no surface is known.
    pub normal_mm: Option<f64>,
}

impl Deviation {
    /// Deviation of `reached` from `intended`, both in the base, expressed in the axes of `base_from_object`. `normal`:
    /// outward surface normal in the work object.
    pub fn between(
        intended: &Pose,
        reached: &Pose,
        base_from_object: &Pose,
        normal: Option<&Vector3<f64>>,
    ) -> Self {
        let in_base = reached.translation.vector - intended.translation.vector;
        let vector_mm = base_from_object.rotation.inverse() * in_base;
        Self {
            vector_mm,
            angle_rad: intended.rotation.angle_to(&reached.rotation),
            normal_mm: normal.map(|n| n.dot(&vector_mm)),
        }
    }

    /// Length of the vector (mm).
    pub fn norm_mm(&self) -> f64 {
        self.vector_mm.norm()
    }

    /// The signed figure used in summaries: along the normal where there is one, else the norm.
    pub fn signed_mm(&self) -> f64 {
        self.normal_mm.unwrap_or_else(|| self.norm_mm())
    }
}

/// Outcome of a point.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum MotionStatus {
    /// Rewritten.
    Changed,
    /// Unmodified: nothing to change, or not known before run time.
    Left,
    /// Not rewritten, because that would be wrong or dangerous.
    Refused,
    /// Rewritten, with a warning.
    Flagged,
}

impl MotionStatus {
    /// Whether the motion is rewritten.
    pub fn is_written(self) -> bool {
        matches!(self, MotionStatus::Changed | MotionStatus::Flagged)
    }
}

/// A point closer to the surface than this is cutting (mm).
pub(crate) const ON_SURFACE_MM: f64 = 0.5;

/// One point of a path.
#[derive(Debug, Clone, PartialEq)]
pub struct PathPoint {
    /// Position in the path, from 0.
    pub index: usize,
    /// File of the line, as an index into [`PathReport::files`].
    pub file: u32,
    /// Line of the program, from 1; 0 for a point that no line of a program holds (between targets).
    pub line: u32,
    /// Instruction.
    pub instruction: String,
    /// How the arm moves to this point.
    pub kind: MotionKind,
    /// Whether the tool cuts on the way to this point; approaches and air moves do not.
    pub cutting: bool,
    /// Work object in the base.
    pub base_from_object: Pose,
    /// The part on which it lies, as an index of the first of the work objects that are placed as one.
    pub part: u32,
    /// The work object in a frame that all points of the part have in common: the base, or the flange that holds the part.
    pub part_from_object: Pose,
    /// Tool on the flange.
    pub flange_from_tool: Pose,
    /// Intended pose of the TCP, in the base.
    pub intended: Pose,
    /// Outward surface normal in the work object, where a surface is known.
    pub normal: Option<Vector3<f64>>,
    /// Controller joints in the original program.
    pub joints_before: Option<Joints>,
    /// Controller joints in the rewritten program.
    pub joints_after: Option<Joints>,
    /// Deviation in the original program.
    pub before: Option<Deviation>,
    /// Deviation in the rewritten program.
    pub after: Option<Deviation>,
    /// Predicted standard deviation of the position (mm), from the covariance of the estimate; of the shape where that alone is
    /// corrected.
    pub sigma_mm: Option<f64>,
    /// Predicted standard deviation of the shape of its cut, after the best rigid registration of all on the part (mm); absent outside cuts.
    pub shape_sigma_mm: Option<f64>,
    /// How the point leaves the region in which the arm was measured.
    pub outside: Option<Outside>,
    /// Outcome of the point.
    pub status: MotionStatus,
    /// Reason, where it was not simply rewritten.
    pub reason: Option<String>,
}

impl PathPoint {
    /// Expected deviation after the correction (mm): remaining deviation and predicted 1σ combined, or the deviation of a point that is
    /// not corrected.
    pub fn expected_mm(&self) -> Option<f64> {
        let after = self.after?.norm_mm();
        match self.status {
            MotionStatus::Left | MotionStatus::Refused => Some(after),
            MotionStatus::Changed | MotionStatus::Flagged => Some(after.hypot(self.sigma_mm?)),
        }
    }

    /// Whether it is rewritten.
    pub fn is_corrected(&self) -> bool {
        self.status.is_written()
    }

    /// Whether its σ is that of the shape alone.
    pub fn is_sigma_of_shape(&self) -> bool {
        self.shape_sigma_mm.is_some() && self.sigma_mm == self.shape_sigma_mm
    }

    /// The reason without its measured figures (those with a decimal point; joint numbers remain), for grouping points.
    pub fn kind_of_reason(&self) -> Option<String> {
        let plain = |word: &&str| !(word.contains('.') && word.bytes().any(|b| b.is_ascii_digit()));
        self.reason.as_ref().map(|reason| reason.split(' ').filter(plain).collect::<Vec<_>>().join(" "))
    }
}

/// How much more two neighbours may differ in their deviation after the correction than before, without a step between them (mm).
const STEP_MM: f64 = 0.05;

/// Steps between points that are corrected and neighbours that are not.
#[derive(Debug, Clone, PartialEq)]
pub struct Steps<'a> {
    /// The corrected points.
    pub points: Vec<&'a PathPoint>,
    /// The largest step (mm).
    pub largest_mm: f64,
}

/// By how much the deviation changes from one point to the next (mm); in the axes of the base, since they may have different work objects.
fn jump_mm(pair: &[PathPoint], which: fn(&PathPoint) -> Option<Deviation>) -> Option<f64> {
    let [a, b] = [&pair[0], &pair[1]]
        .map(|point| which(point).map(|deviation| point.base_from_object.rotation * deviation.vector_mm));
    Some((a? - b?).norm())
}

/// Meaning of the column "after" of a table.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum After {
    /// Under the model that made the correction: only rounding, interpolation and inverse kinematics.
    PredictedRemainder,
    /// On a simulated actual arm unknown to the correction.
    Achieved,
}

/// The path of one program under one model.
#[derive(Debug, Clone, PartialEq)]
pub struct PathReport {
    /// Name of the program.
    pub program: String,
    /// Names of its files; empty where there is but one.
    pub files: Vec<String>,
    /// Name of the model (file, or method).
    pub model: String,
    /// What "after" means.
    pub after: After,
    /// The points.
    pub points: Vec<PathPoint>,
    /// Motions without a point, if any.
    pub missing: Option<MissingMotions>,
    /// What the rewritten program has differently from the original beyond moved and inserted targets, each with its lines: with any of
    /// these, the deviations after are not those of a corrected program.
    pub differences: Vec<String>,
    /// The path of the rewritten program between its targets; absent where there is no rewritten program.
    pub between: Option<BetweenTargets>,
    /// Held-out error of the model [mm RMSE], where it has one.
    pub held_out_mm: Option<f64>,
    /// Largest standard deviation of the tool's orientation at the points (rad), where a model states one.
    pub turn_sigma_rad: Option<f64>,
    /// What the deviations rest on without knowing it, each a warning.
    pub assumptions: Vec<String>,
}

/// The path of a rewritten program between the targets of the original.
#[derive(Debug, Clone, PartialEq)]
pub struct BetweenTargets {
    /// Largest deviation from the intended line or arc that a correction leaves between two targets (mm).
    pub tolerance_mm: f64,
    /// Largest deviation of a corrected line or arc from the intended one through its ends as reached (mm); infinite where the arm cannot
    /// follow; `None` where none was checked.
    pub largest_mm: Option<f64>,
    /// Lines and arcs that deviate by more than the tolerance.
    pub beyond: usize,
    /// Their lines, the first few.
    pub beyond_lines: Option<String>,
    /// Corrected lines and arcs that start at a place that is unknown or not corrected: the path to their end is not checked.
    pub unchecked: usize,
    /// Their lines, the first few.
    pub unchecked_lines: Option<String>,
    /// Lines of the corrected lines and arcs with which a program or routine begins, the first few: no text tells where their path starts.
    pub first_lines: Option<String>,
}

/// A motion of which a report has no point: the program text does not tell where it leads, or the arm does not reach it.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub struct MissingMotion {
    /// Points of the report before it.
    pub points_before: usize,
    /// See [`PathPoint::file`].
    pub file: u32,
    /// Line of the program, from 1.
    pub line: u32,
    /// Instruction.
    pub instruction: String,
    /// Outcome.
    pub status: MotionStatus,
    /// Reason for it, where one is known.
    pub reason: Option<String>,
}

/// All of them.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub struct MissingMotions {
    /// In the order of the program; at least one.
    pub motions: Vec<MissingMotion>,
    /// Their lines, the first few.
    pub lines: String,
}

impl MissingMotions {
    /// Motions of a listing; `None` without any. Waits, calls and motions of external axes alone have no point either. `outcome`: why a
    /// motion has no point; `None` for one that has.
    pub fn of(
        listing: &Listing,
        outcome: impl Fn(u32) -> Option<(MotionStatus, Option<String>)>,
    ) -> Option<Self> {
        let (mut without, mut motions, mut points_before) = (Vec::new(), Vec::new(), 0);
        for (index, motion) in (0_u32..).zip(&listing.motions) {
            let Some((status, reason)) = outcome(index) else {
                points_before += 1;
                continue;
            };
            if !moves(motion) {
                continue;
            }
            without.push(index);
            let (Place { file, line, .. }, instruction) = (motion.place, motion.instruction.to_string());
            motions.push(MissingMotion { points_before, file, line, instruction, status, reason });
        }
        Some(Self { motions, lines: lines_of(listing, &without)? })
    }
}

/// Whether a motion may move the tool: not a wait, a call, or a motion of external axes alone.
fn moves(motion: &Motion) -> bool {
    let elsewhere = matches!(motion.own_reason, None | Some(Reason::ExternalOnly | Reason::Subprogram));
    motion.kind != MotionKind::External && !(motion.targets.is_empty() && elsewhere)
}

/// The files of a listing, as a report names them.
pub fn files_of(listing: &Listing) -> Vec<String> {
    if listing.files.len() > 1 { listing.files.clone() } else { Vec::new() }
}

/// The summary block of ltlm-2024 Table 8: five points, mean, SD. Trap of that table: its mean is signed.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Block {
    /// Signed deviations at five points spread evenly over the cut (mm).
    pub five_mm: [f64; 5],
    /// Over all cut points: signed mean, mean absolute, standard deviation (n − 1), maximum (mm).
    pub all: ErrorSummary,
}

impl PathReport {
    /// The points by which a path is judged: the cutting points, or all where nothing cuts.
    pub fn cut(&self) -> impl Iterator<Item = &PathPoint> {
        let any = self.points.iter().any(|point| point.cutting);
        self.points.iter().filter(move |point| point.cutting || !any)
    }

    /// Steps of the path between points of the cut that are corrected and neighbours that are not.
    pub fn steps(&self) -> Steps<'_> {
        let apart: BTreeSet<usize> = self
            .missing
            .iter()
            .flat_map(|missing| &missing.motions)
            .map(|motion| motion.points_before)
            .collect();
        let any = self.points.iter().any(|point| point.cutting);
        let mut found = Steps { points: Vec::new(), largest_mm: 0.0 };
        for (behind, pair) in (1..).zip(self.points.windows(2)) {
            let [a, b] = [&pair[0], &pair[1]];
            let is_cut = (a.cutting && b.cutting) || !any;
            if !is_cut || a.is_corrected() == b.is_corrected() || apart.contains(&behind) {
                continue;
            }
            let (Some(before_mm), Some(after_mm)) = (jump_mm(pair, |p| p.before), jump_mm(pair, |p| p.after))
            else {
                continue;
            };
            if after_mm > before_mm + STEP_MM {
                found.points.push(if a.is_corrected() { a } else { b });
                found.largest_mm = found.largest_mm.max(after_mm);
            }
        }
        found
    }

    /// Signed deviations of the cut points that have one, before or after.
    pub fn signed_mm(&self, which: fn(&PathPoint) -> Option<Deviation>) -> Vec<f64> {
        self.cut().filter_map(|p| which(p).map(|d| d.signed_mm())).collect()
    }

    /// The largest angle between intended and reached orientation over the cut (rad).
    pub fn largest_turn_rad(&self, which: fn(&PathPoint) -> Option<Deviation>) -> Option<f64> {
        self.cut().filter_map(|point| which(point).map(|deviation| deviation.angle_rad)).reduce(f64::max)
    }

    /// Root mean square of the predicted 1σ over the cut (mm); `None` where no point has one.
    pub fn sigma_rms_mm(&self) -> Option<f64> {
        let squares: Vec<f64> = self.cut().filter_map(|point| point.sigma_mm.map(|s| s * s)).collect();
        (!squares.is_empty()).then(|| (squares.iter().sum::<f64>() / squares.len() as f64).sqrt())
    }

    /// Expected deviation of the cut after the correction (mm): remaining deviation and predicted 1σ combined, maximum over
    /// all points; a point that is not corrected keeps its deviation. `None` where the remainder was achieved on an arm, or σ is
    /// unknown.
    pub fn expected_mm(&self) -> Option<f64> {
        if self.after == After::Achieved {
            return None;
        }
        self.cut().filter_map(PathPoint::expected_mm).filter(|mm| mm.is_finite()).reduce(f64::max)
    }

    /// The Table-8 block; `None` without deviations.
    pub fn block(&self, which: fn(&PathPoint) -> Option<Deviation>) -> Option<Block> {
        let values = self.signed_mm(which);
        let last = values.len().checked_sub(1)?;
        // At the middles of five equal sections of the cut.
        let five_mm = std::array::from_fn(|k| values[(last * (2 * k + 1)) / 10]);
        Some(Block { five_mm, all: ErrorSummary::of(values) })
    }

    /// RMS of the deviation vectors of the cut after the best rigid motion of each part (mm): the shape error of the path, for a base that
    /// was not measured in the work object. Points that are not corrected count too: the part has them all. `None` for fewer than three
    /// points.
    pub fn registered_rms_mm(&self, which: fn(&PathPoint) -> Option<Deviation>) -> Option<f64> {
        Self::registered_rms_mm_of(self.cut(), which)
    }

    /// The same of some points.
    pub fn registered_rms_mm_of<'p>(
        points: impl Iterator<Item = &'p PathPoint>,
        which: fn(&PathPoint) -> Option<Deviation>,
    ) -> Option<f64> {
        let mut parts: BTreeMap<u32, Vec<Pair>> = BTreeMap::new();
        for point in points {
            let Some(deviation) = which(point) else { continue };
            let in_object =
                point.base_from_object.inverse() * Point3::from(point.intended.translation.vector);
            // Two work objects on a part have axes of their own, and so has a displaced one.
            let intended = point.part_from_object * in_object;
            let reached = point.part_from_object * (in_object + deviation.vector_mm);
            parts.entry(point.part).or_default().push((intended, reached));
        }
        let count = parts.values().map(Vec::len).sum::<usize>();
        if count < 3 {
            return None;
        }
        let mut rest = 0.0;
        for pairs in parts.values() {
            let motion = best_motion(pairs)?;
            rest += pairs.iter().map(|(to, from)| (motion * from - to).norm_squared()).sum::<f64>();
        }
        Some((rest / count as f64).sqrt())
    }
}

/// Intended and reached point.
type Pair = (Point3<f64>, Point3<f64>);

/// The rigid motion that best maps the second points onto the first (Kabsch).
fn best_motion(pairs: &[Pair]) -> Option<Pose> {
    let n = pairs.len() as f64;
    let mean =
        |side: fn(&Pair) -> Point3<f64>| pairs.iter().map(|p| side(p).coords).sum::<Vector3<f64>>() / n;
    let (to, from) = (mean(|p| p.0), mean(|p| p.1));
    let spread: Matrix3<f64> =
        pairs.iter().map(|p| (p.1.coords - from) * (p.0.coords - to).transpose()).sum();
    // Squares of these numbers must stay finite, or the iteration does not end.
    if !spread.iter().all(|v| v.abs() < 1e100) {
        return None;
    }
    let svd = SVD::new(spread, true, true);
    let (u, v) = (svd.u?, svd.v_t?.transpose());
    let sign = (v * u.transpose()).determinant().signum();
    let rotation = v * Matrix3::from_diagonal(&Vector3::new(1.0, 1.0, sign)) * u.transpose();
    let rotation: UnitQuaternion<f64> = truegrind_math::se3::rotation_from_matrix(&rotation);
    Some(Isometry3::from_parts(Translation3::from(to - rotation * from), rotation))
}
