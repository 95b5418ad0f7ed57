//! Findings about the quality of the data: rounded angles, contradicting columns, outliers, noise floor, angles between which
//! nothing was measured.

use super::cause_kind::CauseKind;
use super::extension::{Extended, FreeParameters, Subject, fit};
use super::finding::{Confidence, Finding, FoundParameter, Gain, NoiseFloorSource};
use super::preparation::Prepared;
use super::selection::BLOCKS;
use super::validation::{ErrorsByStage, StageError, Validation};
use super::words;
use crate::identification::fit::Observations;
use crate::identification::rounding::{NotFused, angle_shares, rounding_floor_mm};
use crate::measurement::dataset::Dataset;
use crate::measurement::noise_floor::NoiseFloor;
use crate::measurement::repeated_poses;

/// Rounding is a finding when it causes more than this share of the variance of the residual, that of geometry or of the extended
/// model: a larger fault does not hide it.
const ROUNDING_SHARE: f64 = 0.25;

/// Step of angles below which it takes a fourth decimal (°).
const FINE_DEG: f64 = 9e-4;

/// Rounding of the angles, whose step is that of the digits in the file. Few poses leave links and target to their priors, so that what a step
/// does to a reading is not known well enough for a name: `few_poses`.
pub(super) fn rounding_finding(
    dataset: &Dataset,
    prepared: &Prepared,
    subject: &Subject<'_>,
    geometric: &Extended,
    (errors, few_poses): (&ErrorsByStage, bool),
) -> Option<Finding> {
    let step = dataset.angle_step_rad.filter(|_| !few_poses)?;
    let logged = &prepared.logged;
    let shares = angle_shares(&logged.dataset, &geometric.model, &geometric.frames, &logged.angles);
    let coordinates = dataset.sensor.axes() as f64;
    let share = shares.iter().map(|s| s.0).sum::<f64>() * coordinates / shares.len().max(1) as f64;
    let raw = Subject { observed: logged, ..*subject };
    let unsharpened = fit(&raw, &[], FreeParameters::All, Some(geometric));
    let before = Validation::of(&raw, &[], 0, BLOCKS).random_rmse(&unsharpened);
    let left = before.min(errors.with_causes.random.rmse);
    if share < ROUNDING_SHARE * left * left {
        return None;
    }
    let (gain, evidence) = match &prepared.readout_fusion {
        Ok(report) => (
            Gain { cv_rmse_before_mm: before, cv_rmse_after_mm: errors.geometric.random.rmse },
            format!(
                "all angles are multiples of {:.4}°, worth {:.3} mm at the sensor; fused with the read-out they are known \
                 {:.1} times better",
                step.to_degrees(),
                share.sqrt(),
                1.0 / report.narrowed.max(1e-6)
            ),
        ),
        Err(why) => {
            let available =
                matches!(why, NotFused::Nothing) && dataset.rows.iter().all(|r| r.readout_mm().is_some());
            let read_out = match why {
                _ if available => "the read-out was not fused with them (--raw-columns)",
                NotFused::Nothing => "there is no read-out to fuse with them",
                NotFused::Mismatch { .. } => "the read-out contradicts them, so it was not fused with them",
            };
            (
                Gain { cv_rmse_before_mm: before, cv_rmse_after_mm: before },
                format!(
                    "all angles are multiples of {:.4}°, worth {:.3} mm at the sensor; {read_out}",
                    step.to_degrees(),
                    share.sqrt()
                ),
            )
        }
    };
    let cause = format!(
        "the log rounds joint angles to {:.*}°, which alone moves the target by {:.3} mm RMS",
        if step.to_degrees() < FINE_DEG { 4 } else { 3 },
        step.to_degrees(),
        share.sqrt()
    );
    Some(Finding {
        parameters: vec![read_parameter("step", step.to_degrees(), "°")],
        worth_mm: Some(share.sqrt()),
        ..words::finding(CauseKind::AngleRounding, cause, Confidence::Identified, evidence, gain)
    })
}

/// A parameter that is read from the data, not estimated.
fn read_parameter(name: &str, value: f64, unit: &str) -> FoundParameter {
    FoundParameter { name: name.to_owned(), value, sigma: None, unit: unit.to_owned() }
}

pub(super) fn mismatch_finding(
    dataset: &Dataset,
    prepared: &Prepared,
    after: &StageError,
) -> Option<Finding> {
    let rows = &prepared.mismatch.rows;
    let largest = rows.iter().map(|r| r.1).fold(f64::NAN, f64::max);
    if rows.is_empty() {
        return None;
    }
    let cause = format!(
        "in {} rows the controller's x, y, z are of another pose than its angles, up to {largest:.2} mm apart",
        rows.len()
    );
    let evidence = format!(
        "read-out compared with the nominal forward kinematics of the angles: the other rows scatter by {:.4} mm",
        prepared.mismatch.usual_mm
    );
    Some(Finding {
        row_list: Some(rows.iter().map(|(i, _)| dataset.rows[*i].number).collect()),
        parameters: vec![read_parameter("largest mismatch", largest, "mm")],
        ..words::finding(CauseKind::ReadoutMismatch, cause, Confidence::Identified, evidence, no_gain(after))
    })
}

/// The held-out error of the final model, for findings without a parameter in it.
fn no_gain(after: &StageError) -> Gain {
    Gain { cv_rmse_before_mm: after.random.rmse, cv_rmse_after_mm: after.random.rmse }
}

/// Ratio of the largest outlier to the RMS of an empirical fault above which the outlier is not a residue of that fault.
const REMAINDER: f64 = 6.0;

/// How far some rows are off.
#[derive(Debug, Clone, Copy)]
pub(super) struct Deviation {
    /// The farthest (mm).
    largest_mm: f64,
    /// Their share of the error (mm RMS over all rows).
    rms_mm: f64,
}

impl Deviation {
    pub(super) fn of(fit: &Extended, rows: &[(usize, f64)]) -> Self {
        let errors = fit.problem.errors_mm(&fit.x);
        let off = || rows.iter().filter_map(|(i, _)| errors.get(*i));
        Self {
            largest_mm: off().fold(0.0, |most, e| f64::max(most, e.abs())),
            rms_mm: (off().map(|e| e * e).sum::<f64>() / errors.len().max(1) as f64).sqrt(),
        }
    }
}

/// Outliers, which deviate by `off`. `empirical_mm` is the RMS of the largest empirical fault: where its expansion is worst, readings look
/// like outliers too.
pub(super) fn outlier_finding(
    dataset: &Dataset,
    outliers: &[(usize, f64)],
    (off, empirical_mm): (Deviation, f64),
    after: &StageError,
) -> Option<Finding> {
    if outliers.is_empty() {
        return None;
    }
    let off_mm = off.largest_mm;
    let remainder = off_mm < REMAINDER * empirical_mm;
    let doubts = if remainder {
        vec![format!(
            "they deviate by up to {off_mm:.3} mm, and a fault whose exact law is unknown moves readings by {empirical_mm:.3} mm: they might be \
             its residue"
        )]
    } else {
        Vec::new()
    };
    let mut list: Vec<usize> = outliers.iter().map(|(i, _)| dataset.rows[*i].number).collect();
    list.sort_unstable();
    let cause = format!(
        "{} far more than all others, by up to {off_mm:.3} mm, {:.0} times their scatter",
        if list.len() == 1 {
            "1 reading deviates".to_owned()
        } else {
            format!("{} readings deviate", list.len())
        },
        outliers[0].1
    );
    let confidence = if remainder { Confidence::Ambiguous } else { Confidence::Identified };
    let evidence =
        "residuals so large that the tail of the others yields one in a hundred data sets".to_owned();
    Some(Finding {
        row_list: Some(list),
        p_value: 1e-2,
        worth_mm: Some(off.rms_mm),
        doubts,
        ..words::finding(CauseKind::Outliers, cause, confidence, evidence, no_gain(after))
    })
}

/// An error between two measured angles of a joint that are nearer than this is known (rad): the period of most reducers is longer.
const NEAR_RAD: f64 = 0.5 * std::f64::consts::PI / 180.0;

/// Share of a joint's range that is near a measured angle below which the joint stood at single angles only.
const SINGLE_ANGLES: f64 = 0.2;

/// Fewest poses for each of these angles: random poses are single angles too where they are few.
const POSES_OF_AN_ANGLE: usize = 4;

/// A note on joints that stood at a few single angles only, as on a grid of poses. Rows that are held out stand at the same angles,
/// so that no held-out error shows what a gear does between them.
pub(super) fn single_angles(dataset: &Dataset) -> Option<String> {
    let poses = repeated_poses::poses(dataset).len();
    let joints: Vec<String> = (0..6)
        .filter_map(|joint| {
            let mut angles: Vec<f64> = dataset.rows.iter().map(|row| row.joints[joint]).collect();
            angles.sort_by(f64::total_cmp);
            let (low, high) = (*angles.first()?, *angles.last()?);
            let (mut groups, mut near) = (1, 2.0 * NEAR_RAD);
            for pair in angles.windows(2) {
                let apart = pair[1] - pair[0];
                groups += usize::from(apart > 2.0 * NEAR_RAD);
                near += apart.min(2.0 * NEAR_RAD);
            }
            let shared = groups > 1 && POSES_OF_AN_ANGLE * groups <= poses;
            (shared && near < SINGLE_ANGLES * (high - low))
                .then(|| format!("joint {} at {groups}", joint + 1))
        })
        .collect();
    (!joints.is_empty()).then(|| {
        format!(
            "some joints were measured at a few angles only ({}): held-out errors are valid at these angles only, and what a gear does between \
             them is unknown; measure poses at other angles before programs move there",
            joints.join(", ")
        )
    })
}

/// The noise floor (mm) of sensor and rounding, and its source.
pub(super) fn noise_floor(
    repeated: &Option<NoiseFloor>,
    subject: &Subject<'_>,
    extended: &Extended,
) -> (Option<f64>, NoiseFloorSource) {
    if let Some(floor) = repeated {
        let source = NoiseFloorSource::Repeats { poses: floor.poses, freedom: floor.freedom };
        return (Some(floor.sigma_mm), source);
    }
    let Observations { dataset, angles } = subject.observed;
    match rounding_floor_mm(dataset, &extended.model, &extended.frames, angles) {
        Some(floor) => (Some(floor), NoiseFloorSource::RoundingAlone),
        None => (None, NoiseFloorSource::Unknown),
    }
}
