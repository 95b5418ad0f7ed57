//! How much of an arm the poses of a test show.
//!
//! Links of ordinary tolerance are displaced, one after the other, by their standard deviation. What this moves the target, apart from the
//! best placement of base and target, is compared between the poses of the test and those of the fit: the ratio of the RMS displacements.
//! Poses close to each other show next to nothing, whatever their number, since the placement follows them.

use nalgebra::{DMatrix, Vector3};

use crate::identification::calibration::{CalibrationProblem, Frames};
use crate::identification::rigid_motion_columns::{Placed, fill, place};
use crate::identification::tolerance::Tolerance;
use crate::measurement::dataset::{Dataset, Sensor};
use truegrind_arm::condition::Condition;
use truegrind_arm::estimated::Estimated;
use truegrind_arm::model::{Joints, Model};
use truegrind_arm::parameter::{Parameter, arm_parameters};
use truegrind_math::statistics::extent;

/// Smallest share of the displacements over the region of the fit with which a test accepts an arm. A box of 300 mm with one orientation
/// shows 5 % of an arm of 1.3 m and 15 % of one of 0.6 m; a box of 60 mm at most 2 %, one pose none.
pub const MIN_SHARE: f64 = 0.05;

/// Poses that are compared.
const POSES: usize = 200;

/// What the poses of a test show.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Tested {
    /// Extent of the target's positions along the axes of the base (mm).
    pub volume_mm: [f64; 3],
    /// What links of ordinary tolerance move the target at these poses, as a share of what they do over the region of the fit.
    pub share: f64,
}

impl Tested {
    /// Whether the poses show enough of the arm to accept it.
    pub fn is_enough(&self) -> bool {
        self.share >= MIN_SHARE
    }

    pub(super) fn of(dataset: &Dataset, estimated: &Estimated, frames: &Frames) -> Self {
        let target = frames.flange_from_target.translation.vector;
        let own: Vec<Joints> = dataset.rows.iter().map(|row| row.joints).collect();
        let fitted: Vec<Joints> = estimated
            .region
            .samples_deg
            .iter()
            .map(|sample| Joints::from(sample.map(f64::to_radians)))
            .collect();
        let places = placed(&estimated.model, &every(&own, own.len()), target);
        let volume_mm = std::array::from_fn(|axis| {
            let [low, high] = extent(places.iter().map(|(at, _)| at[axis]));
            high - low
        });
        let [here, there] = [own, fitted].map(|poses| moved(&estimated.model, &every(&poses, POSES), target));
        Self { volume_mm, share: if there > 0.0 { here / there } else { 1.0 } }
    }
}

/// At most about `count` of the poses, evenly.
fn every(poses: &[Joints], count: usize) -> Vec<Joints> {
    poses.iter().step_by(poses.len().div_ceil(count.max(1)).max(1)).copied().collect()
}

fn placed(model: &Model, poses: &[Joints], target: Vector3<f64>) -> Vec<Placed> {
    let at = |joints: &Joints| {
        let flange = model.forward(joints, &Condition::default());
        let rotation = flange.rotation.to_rotation_matrix();
        (flange.translation.vector + rotation * target, rotation)
    };
    poses.iter().map(at).collect()
}

/// RMS displacement of the target by links of ordinary tolerance, apart from placement (mm).
fn moved(model: &Model, poses: &[Joints], target: Vector3<f64>) -> f64 {
    let lengths_and_angles =
        |parameter: &Parameter| parameter.is_of_arm() && matches!(parameter.unit(), "mm" | "rad");
    let links: Vec<Parameter> = arm_parameters(model).into_iter().filter(lengths_and_angles).collect();
    let priors = Tolerance::default().priors(&links, model);
    let first = placed(model, poses, target);
    let mut columns = DMatrix::zeros(3 * poses.len(), links.len());
    let none = Dataset::new("tested", Sensor::Position, Vec::new());
    let problem = CalibrationProblem::new(&none, model, &Frames::at_origin(0), &links, &[], &[]);
    for (k, prior) in priors.iter().enumerate() {
        let mut x = vec![0.0; links.len()];
        x[k] = prior.sigma;
        let (other, _) = problem.apply(&x);
        fill(columns.column_mut(k).as_mut_slice(), &first, &placed(&other, poses, target));
    }
    place(&mut columns, &first);
    (columns.norm_squared() / poses.len().max(1) as f64).sqrt()
}
