//! Effects that the data cannot detect: missing columns, or confounding with geometry and frames; with the smallest detectable
//! size.

use nalgebra::DVector;

use super::candidates::Scored;
use super::catalogue::{LoggedColumns, Regressor, STILL_RAD};
use super::cause::Cause;
use super::cause_kind::CauseKind;
use super::design::Design;
use super::finding::NotTestable;
use super::findings::pendant;
use super::preparation::Prepared;
use super::score::VISIBLE;
use super::selection::scale_information_beside_growth;
use crate::measurement::dataset::Dataset;
use truegrind_arm::effect::Effect;
use truegrind_math::spectral;

/// Peak joint rotation of an effect of practical size (rad).
const PRACTICAL_RAD: f64 = 0.15 * std::f64::consts::PI / 180.0;

/// Effects of the arm that geometry and frames can imitate in unfavourable poses.
const CONFOUNDED_WITH_GEOMETRY: [CauseKind; 5] = [
    CauseKind::JointCompliance,
    CauseKind::GearEccentricity,
    CauseKind::GearRatio,
    CauseKind::JointCoupling,
    CauseKind::Backlash,
];

/// Effects that these rows cannot detect, with the smallest detectable size.
pub(super) fn not_testable(
    dataset: &Dataset,
    whole: &Design,
    left: &[Scored],
    found: &[CauseKind],
    prepared: &Prepared,
) -> Vec<NotTestable> {
    let columns = LoggedColumns::of(dataset);
    let mut out = Vec::new();
    let missing = |kind| !found.contains(&kind);
    let mut add = |effect, joints: Option<Vec<usize>>, reason: String, remedy: &str| {
        out.push(NotTestable { effect, joints, reason, remedy: remedy.to_owned() });
    };
    if prepared.sides_from_order && missing(CauseKind::Backlash) {
        add(
            CauseKind::Backlash,
            None,
            "no approach columns, and the order of the rows does not show it".to_owned(),
            "measure each pose from both sides and log approach1 to approach6",
        );
    }
    if columns.clock.is_none() && columns.temperature.is_none() {
        add(
            CauseKind::ThermalDrift,
            None,
            "neither time nor temperature is logged".to_owned(),
            "log t and temperature, and measure from a cold start",
        );
    }
    if dataset.rows.iter().all(|r| r.readout_mm().is_none()) {
        add(
            CauseKind::ReadoutMismatch,
            None,
            "the controller's own x, y, z are not logged".to_owned(),
            "log the controller's Cartesian read-out beside the angles",
        );
    }
    if missing(CauseKind::SensorScale) {
        let one = scale_information_beside_growth(whole, &DVector::from_element(1, 1e-3));
        if one < VISIBLE {
            add(
                CauseKind::SensorScale,
                None,
                "a scale error of 0.1 % is indistinguishable from links that are all longer by 0.1 %"
                    .to_owned(),
                "measure a length standard, or distances that do not depend on the arm",
            );
        }
    }
    let still: Vec<usize> = (0..6).filter(|&j| columns.range_rad[j] <= STILL_RAD).collect();
    if !still.is_empty() {
        add(
            CauseKind::GearEccentricity,
            pendant(&still),
            "these axes hardly moved".to_owned(),
            "turn every axis through its whole range",
        );
    }
    for kind in CONFOUNDED_WITH_GEOMETRY {
        let without_sides = kind == CauseKind::Backlash && prepared.sides_from_order;
        let asked = (0..6).filter(|joint| !still.contains(joint));
        let hidden = if without_sides { Vec::new() } else { hidden_joints(kind, asked, left) };
        if !hidden.is_empty() && missing(kind) {
            let (joints, sizes): (Vec<usize>, Vec<String>) =
                hidden.iter().map(|hidden| (hidden.0, describe(hidden))).unzip();
            add(
                kind,
                pendant(&joints),
                format!(
                    "in these poses it is confounded with geometry and frames; smallest detectable peak: {}",
                    sizes.join(", ")
                ),
                "measure poses with large rotations of these joints at varied angles of the others: `truegrind plan` proposes them",
            );
        }
    }
    out
}

/// Joints of which an effect of practical size would not show, with the smallest size that would.
fn hidden_joints(kind: CauseKind, asked: impl Iterator<Item = usize>, left: &[Scored]) -> Vec<(usize, f64)> {
    asked
        .map(|joint| (joint, smallest_that_shows(kind, joint, left)))
        .filter(|(_, smallest)| *smallest > PRACTICAL_RAD)
        .collect()
}

/// The smallest detectable peak rotation of a joint by an effect of the arm (rad); NaN where it was not tried.
fn smallest_that_shows(kind: CauseKind, joint: usize, left: &[Scored]) -> f64 {
    let asked = |s: &&Scored| {
        let cause = &s.candidate.cause;
        cause.kind() == kind
            && cause.joints().last() == Some(&joint)
            && !matches!(cause, Cause::Arm(Effect::GearMap(_) | Effect::LumpedCompliance(_)))
    };
    left.iter().filter(asked).filter_map(smallest_rad).fold(f64::NAN, f64::max)
}

fn describe((joint, smallest): &(usize, f64)) -> String {
    if smallest.is_finite() && smallest.to_degrees() < 90.0 {
        format!("joint {}: {:.2}°", joint + 1, smallest.to_degrees())
    } else {
        format!("joint {}: undetectable", joint + 1)
    }
}

/// Smallest peak rotation with the non-centrality [`VISIBLE`] (rad), in the least favourable phase.
fn smallest_rad(scored: &Scored) -> Option<f64> {
    let peak = |r: &Regressor| match r {
        Regressor::Arm { rotation, .. } => {
            rotation.iter().flat_map(|(_, c)| c.iter()).fold(0.0_f64, |m, v| m.max(v.abs()))
        }
        Regressor::Disturbance { .. } | Regressor::Shift(_) => 0.0,
    };
    let information = &scored.score.information;
    let scaled: Vec<f64> = scored.candidate.regressors.iter().map(peak).collect();
    if scaled.iter().any(|s| *s <= 0.0) {
        return None;
    }
    let k = scaled.len();
    let per_peak = nalgebra::DMatrix::from_fn(k, k, |a, b| information[(a, b)] / (scaled[a] * scaled[b]));
    let least = spectral::symmetric_eigen(per_peak)?.eigenvalues.min().max(1e-12);
    Some((VISIBLE / least).sqrt())
}
