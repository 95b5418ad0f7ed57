//! Position and shape of a path: where the path over a work object lies as a whole, and the deviation that remains after the
//! best rigid registration.
//!
//! A sensor whose frame was fitted contains no information about the position of the arm's base. The resulting arm knows the
//! shape of a path far better than its position, and correcting the position would be a guess. *Shape* takes the rigid motion
//! that best explains the path's deviations as the real position of the work object: what was taught or adjusted in place
//! keeps its position, and only its shape is corrected. *Absolute* corrects both.

use nalgebra::{DMatrix, Matrix3, Matrix6, Matrix6xX, Point3, Vector3, Vector6};
use serde::{Deserialize, Serialize};

use crate::condition::arm_conditions::ArmConditions;
use crate::frames::frame_pair::ResolvedFrames;
use crate::risk::beyond_noise::{ErrorAt, RegisteredErrors};
use crate::risk::probability::probability_of_harm;
use crate::risk::registration::Registration;
use crate::risk::remedy::Remedy;
use truegrind_arm::estimated::beyond_noise::slopes;
use truegrind_arm::estimated::{Estimated, FlangePoint, PosteriorComponent, RegisteredFrame};
use truegrind_arm::model::Joints;
use truegrind_math::se3::Pose;

/// Whether the position of a path is corrected, or only its shape.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
#[non_exhaustive]
pub enum Placement {
    /// [`Placement::Absolute`] for work objects whose position is known better than its deviation and whose correction does
    /// harm with at most half of the accepted probability, else [`Placement::Shape`]. A work object that was taught by points that
    /// are not given has no known position.
    #[default]
    Auto,
    /// Only the shape of the path over each work object; the path keeps its position.
    Shape,
    /// Shape and position, in the robot's base or in the frame taught with this arm.
    Absolute,
}

/// Requested placement and accepted risk.
#[derive(Debug, Clone, Copy)]
pub(crate) struct PlacementChoice {
    pub(crate) placement: Placement,
    /// Cuts that are more likely to be harmed remain unmodified; for positions see [`accepts_position`].
    pub(crate) max_risk: f64,
    /// Whether the measurement that would make a position known is searched for.
    pub(crate) remedies: bool,
}

/// How the position of one work object was treated.
#[derive(Debug, Clone, PartialEq)]
pub struct ObjectPlacement {
    /// Its name.
    pub work_object: String,
    /// The other work objects on the same fixture, for which all of this holds as well.
    pub others: Vec<String>,
    /// Whether the robot holds it.
    pub held: bool,
    /// [`Placement::Shape`] or [`Placement::Absolute`].
    pub applied: Placement,
    /// Deviation of the path as a whole from its intended position (RMS over its points, mm).
    pub deviation_mm: f64,
    /// Predicted standard deviation of that (RMS over the points, mm).
    pub sigma_mm: f64,
    /// Probability that correcting the position does harm.
    pub probability_of_harm: f64,
    /// Whether the work object was taught with this arm, by points that are given.
    pub taught: bool,
    /// Whether it was taught with this arm by points that are not given, so that its real position is unknown.
    pub unlocated: bool,
    /// Measurement that would make its position known; absent where it is corrected, and where none can be predicted.
    pub remedy: Option<Remedy>,
}

/// A target of the original program.
#[derive(Debug, Clone, Copy)]
pub(crate) struct AssessedTarget {
    /// Index of its frames in the frame table.
    pub(crate) frames_index: usize,
    /// Intended pose of the tool in the work object.
    pub(crate) intended: Pose,
    /// Controller joints (rad).
    pub(crate) joints: Joints,
    /// Condition under which the arm is there.
    pub(crate) condition_index: usize,
}

/// Deviations of the targets of a path and their derivatives by the arm's parameters, in the axes of the work object.
#[derive(Debug, Clone)]
pub(crate) struct PathDeviation {
    /// Intended positions (mm).
    pub(crate) intended: Vec<Point3<f64>>,
    /// Reached minus intended (mm).
    pub(crate) shifts: Vec<Vector3<f64>>,
    /// Derivatives of the positions, one below the other (3 n × p), relative to the taught frame where there is one.
    pub(crate) jacobian: DMatrix<f64>,
    /// Errors beyond the noise of the model; empty where none are known.
    pub(crate) errors: Vec<ErrorAt>,
}

impl PathDeviation {
    /// Under the estimated arm.
    pub(crate) fn of(
        targets: &[AssessedTarget],
        list: &[ResolvedFrames],
        conditions: &ArmConditions<'_>,
        knowledge: &Estimated,
    ) -> Self {
        let mut out = Self {
            intended: targets.iter().map(|target| target.intended.translation.vector.into()).collect(),
            shifts: Vec::with_capacity(targets.len()),
            jacobian: DMatrix::zeros(3 * targets.len(), knowledge.order.len()),
            errors: Vec::new(),
        };
        let beyond_rad = knowledge.beyond_noise_rad.filter(|rad| rad.iter().any(|rad| *rad > 0.0));
        let mut into_object: Vec<Matrix3<f64>> = Vec::with_capacity(targets.len());
        for run in targets.chunk_by(|a, b| a.condition_index == b.condition_index) {
            let arm = conditions.arm(run[0].condition_index);
            let first = into_object.len();
            let mut points = Vec::with_capacity(run.len());
            for target in run {
                let ResolvedFrames { real, carried, .. } = &list[target.frames_index];
                let flange = arm.forward(&target.joints);
                out.shifts
                    .push(real.target_of(&flange).translation.vector - target.intended.translation.vector);
                let turn = real.base_from_object(&flange).rotation.inverse();
                into_object.push(turn.to_rotation_matrix().into_inner());
                points.push(FlangePoint {
                    joints: target.joints,
                    flange_from_tool: real.flange_from_tool(&flange),
                    carried: carried.as_ref().map(RegisteredFrame::carried),
                });
            }
            let in_base = knowledge.position_jacobians(arm, &points);
            out.errors.extend(beyond_rad.iter().flat_map(|rad| {
                points.iter().map(|point| {
                    let slopes = slopes(arm, &point.joints, &point.flange_from_tool);
                    ErrorAt { joints: point.joints, shifts: std::array::from_fn(|j| slopes[j] * rad[j]) }
                })
            }));
            out.jacobian.rows_mut(3 * first, 3 * run.len()).copy_from(&in_base);
        }
        out.turn_velocities(&into_object);
        out
    }

    /// The same of targets on one part, all in one work object: a program displacement moves the frame in which they are programmed,
    /// not the part.
    pub(crate) fn of_part(
        targets: &[AssessedTarget],
        reference: &Pose,
        list: &[ResolvedFrames],
        conditions: &ArmConditions<'_>,
        knowledge: &Estimated,
    ) -> Self {
        let mut out = Self::of(targets, list, conditions, knowledge);
        let object = |target: &AssessedTarget| list[target.frames_index].real.object;
        let reference = *reference;
        if targets.iter().all(|target| object(target) == reference) {
            return out;
        }
        let into_first: Vec<Pose> =
            targets.iter().map(|target| reference.inverse() * object(target)).collect();
        for ((into, intended), shift) in into_first.iter().zip(&mut out.intended).zip(&mut out.shifts) {
            *intended = into * *intended;
            *shift = into * *shift;
        }
        let turns: Vec<Matrix3<f64>> =
            into_first.iter().map(|into| into.rotation.to_rotation_matrix().into_inner()).collect();
        out.turn_velocities(&turns);
        out
    }

    /// Turns the derivatives and the errors of each point.
    fn turn_velocities(&mut self, turns: &[Matrix3<f64>]) {
        for mut column in self.jacobian.column_iter_mut() {
            for (turn, velocity) in turns.iter().zip(column.as_mut_slice().as_chunks_mut().0) {
                *velocity = (turn * Vector3::from(*velocity)).into();
            }
        }
        for (turn, error) in turns.iter().zip(&mut self.errors) {
            error.shifts = error.shifts.map(|shift| turn * shift);
        }
    }
}

/// Share of the accepted risk within which [`Placement::Auto`] corrects a position.
///
/// A cut has to be either corrected or left, whereas its position may stay and its shape be corrected all the same. A position
/// therefore has to earn its correction by more: at the whole of the accepted risk, 2.6 % of what `Auto` writes gets worse on 1,200
/// simulated arms (bench `uncertainty`, seeds from 50,000,000), at half of it 1.4 %; four in five positions are still corrected.
const POSITION_SHARE: f64 = 0.5;

/// Whether [`Placement::Auto`] corrects a position that is known to `sigma_mm` and whose correction does harm with probability
/// `probability_of_harm`.
pub(crate) fn accepts_position(
    deviation_mm: f64,
    sigma_mm: f64,
    probability_of_harm: f64,
    max_risk: f64,
) -> bool {
    sigma_mm <= deviation_mm && probability_of_harm <= POSITION_SHARE * max_risk
}

/// Most sampled targets of a work object.
pub(crate) const MAX_POINTS: usize = 200;

/// At most `most` of `items`, evenly spaced, in order.
pub(crate) fn evenly_spaced<T: Copy>(items: &[T], most: usize) -> Vec<T> {
    let count = items.len().min(most);
    (0..count).map(|k| items[k * items.len() / count]).collect()
}

/// The path over one work object.
pub(crate) struct AssessedObject {
    pub(crate) placement: ObjectPlacement,
    /// The displacement of the work object that realises the requested placement, in the frame of the first target (`None`: none).
    pub(crate) displacement: Option<Pose>,
    /// Its best registration, the reference of its shape, in the work object of the first target.
    pub(crate) registration: Registration,
    /// The twists of the registration per unit of each parameter.
    pub(crate) twists: Matrix6xX<f64>,
    /// How it follows the errors beyond the noise; absent without any.
    pub(crate) errors: Option<RegisteredErrors>,
}

/// The path over one work object, from sampled targets.
pub(crate) fn assess_placement(
    name: &str,
    targets: &[AssessedTarget],
    list: &[ResolvedFrames],
    conditions: &ArmConditions<'_>,
    knowledge: &Estimated,
    posterior: &[PosteriorComponent],
    choice: PlacementChoice,
) -> Option<AssessedObject> {
    let reference = list[targets.first()?.frames_index].real.object;
    let taught = targets.iter().any(|target| list[target.frames_index].carried.is_some());
    let off = PathDeviation::of_part(targets, &reference, list, conditions, knowledge);
    let count = targets.len();
    let registration = Registration::of(&off.intended)?;
    let twist = registration.twist(off.shifts.iter().copied());
    let squares = (0..count).map(|k| registration.shift(&twist, k).norm_squared());
    let deviation_mm = (squares.sum::<f64>() / count as f64).sqrt();
    let twists = registration.twists(&off.jacobian);
    let errors = RegisteredErrors::of(&registration, &off.intended, &off.errors);
    let of_errors = errors.as_ref().map_or_else(Matrix6::zeros, |errors| errors.covariance);
    let covariance: Matrix6<f64> = &twists * &knowledge.covariance * twists.transpose() + of_errors;
    let sigma_mm = registration.mean_square(&covariance).max(0.0).sqrt();
    let weighed = registration.weighed(&twist);
    let toward = twists.tr_mul(&weighed);
    let along = weighed.dot(&(of_errors * weighed));
    let square = deviation_mm * deviation_mm * count as f64;
    let probability_of_harm = probability_of_harm(square, &toward, along, posterior, count);
    let unlocated = targets.iter().any(|target| list[target.frames_index].unlocated);
    let accepted =
        !unlocated && accepts_position(deviation_mm, sigma_mm, probability_of_harm, choice.max_risk);
    let applied = match choice.placement {
        Placement::Auto if accepted => Placement::Absolute,
        Placement::Auto => Placement::Shape,
        other => other,
    };
    let placement = ObjectPlacement {
        work_object: name.to_owned(),
        others: Vec::new(),
        held: list[targets[0].frames_index].real.holds_part,
        applied,
        deviation_mm,
        sigma_mm,
        probability_of_harm,
        taught,
        unlocated,
        remedy: None,
    };
    let stays = applied == Placement::Absolute || !deviation_mm.is_finite();
    let displacement = (!stays).then(|| displacement(&registration, &off, twist));
    Some(AssessedObject { placement, displacement, registration, twists, errors })
}

/// The rigid motion that best maps the intended points to the reached ones: the linear solution, refined twice.
fn displacement(registration: &Registration, off: &PathDeviation, first: Vector6<f64>) -> Pose {
    let mut motion = registration.motion(&first);
    for _ in 0..2 {
        let left = |(intended, shift): (&Point3<f64>, &Vector3<f64>)| {
            motion.inverse() * (intended + shift) - intended
        };
        let left = registration.twist(off.intended.iter().zip(&off.shifts).map(left));
        motion *= registration.motion(&left);
    }
    motion
}
