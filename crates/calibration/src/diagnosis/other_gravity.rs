//! Whether gravity seems to act along another direction than the robot file states: an arm on a wall or a ceiling whose file was not told.
//!
//! What a weight does under one direction of gravity, a joint, an axis that wobbles or two gears may imitate under another, and pass every test.
//! Therefore, for each of 13 directions (the axes of the base, and between them), deflections under gravity along it are selected forwards by
//! evidence: joints that yield and bases that tilt, with everything else free. The best direction is a rival of all causes of the arm that were
//! found, with the odds of a file that states no mount and the number of directions against it. Deflections are linear in the direction, so that
//! it and its opposite explain the same: masses, which are positive, tell them apart.

use std::ops::Range;

use nalgebra::{DMatrix, DVector, Vector3};
use rayon::prelude::*;

use super::catalogue::{Candidate, weight_candidates};
use super::cause::Cause;
use super::cause_kind::CauseKind;
use super::confirmation::CLEAR_TWICE_LOG_BF;
use super::design::{Design, FullDesign, side_by_side};
use super::extension::{Extended, Subject};
use super::score::{Score, VISIBLE, score_columns, score_from};
use truegrind_arm::effect::Effect;
use truegrind_arm::model::Model;
use truegrind_math::work::checkpoint;

/// Directions up to their sign.
const DIRECTIONS: [[i8; 3]; 13] = [
    [1, 0, 0],
    [0, 1, 0],
    [0, 0, 1],
    [1, 1, 0],
    [1, -1, 0],
    [1, 0, 1],
    [1, 0, -1],
    [0, 1, 1],
    [0, 1, -1],
    [1, 1, 1],
    [1, 1, -1],
    [1, -1, 1],
    [1, -1, -1],
];

/// Prior odds of a file that states the mount against one that does not, and of an arm on a floor, a wall or a ceiling against one at a slant.
const STATED_ODDS: f64 = 10.0;
const STRAIGHT_ODDS: f64 = 10.0;

/// Straight directions, and the others.
const STRAIGHT: usize = 3;
const SLANTED: usize = DIRECTIONS.len() - STRAIGHT;

/// Most deflections that are selected under one direction.
const MAX_SELECTED: usize = 3;

/// Cosine from which a direction is that of the file.
const SAME: f64 = 0.9;

/// Another direction of gravity, with what yields under it.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct OtherGravity {
    direction: [i8; 3],
    stated: Vector3<f64>,
    /// Effect and joints (from 0) of the deflections.
    yields: Vec<(CauseKind, Vec<usize>)>,
}

/// Deflections under one direction of gravity.
struct Selected {
    /// Places in [`Deflections::causes`].
    chosen: Vec<usize>,
    merit: f64,
    score: Option<Score>,
}

/// The deflections that weight can cause, under gravity along each axis of the base: they are linear in gravity, so that those under any direction
/// follow without another pass over the rows.
struct Deflections {
    causes: Vec<Cause>,
    /// Prior standard deviations of the parameters, by cause.
    sizes: Vec<Vec<f64>>,
    /// Variants tried, by cause.
    tried: Vec<f64>,
    /// Places of the parameters among all W of one axis, by cause.
    places: Vec<Range<usize>>,
    /// Gradient (3 W) and information (3 W × 3 W), axis by axis.
    gradient: DVector<f64>,
    information: DMatrix<f64>,
}

/// Gradient (W) and information (W × W) of all deflections under one direction.
struct Along(DVector<f64>, DMatrix<f64>);

impl Deflections {
    fn of(subject: &Subject<'_>, design: &Design) -> Self {
        let axes: Vec<Vec<(Candidate, DMatrix<f64>)>> = [[1, 0, 0], [0, 1, 0], [0, 0, 1]]
            .par_iter()
            .map(|&axis| {
                checkpoint();
                let nominal = Model { gravity: in_base(axis), ..subject.nominal.clone() };
                let turned = Subject { nominal: &nominal, ..*subject };
                let with_columns = |candidate: Candidate| {
                    let columns = candidate.columns(design);
                    (candidate, columns)
                };
                weight_candidates(&turned).into_iter().map(with_columns).collect()
            })
            .collect();
        let columns = axes.iter().flatten().map(|(_, columns)| columns);
        let projected = design.project(&side_by_side(columns, design.rows()));
        let of_axis: Vec<&Candidate> = axes[0].iter().map(|(candidate, _)| candidate).collect();
        let sizes: Vec<Vec<f64>> = of_axis.iter().map(|candidate| candidate.cause.sizes()).collect();
        let mut end = 0;
        let places = sizes.iter().map(|sizes| {
            end += sizes.len();
            end - sizes.len()..end
        });
        Self {
            places: places.collect(),
            sizes,
            tried: of_axis.iter().map(|candidate| candidate.tried).collect(),
            causes: of_axis.into_iter().map(|candidate| candidate.cause.clone()).collect(),
            gradient: projected.gradient,
            information: projected.information,
        }
    }

    fn along(&self, direction: [i8; 3]) -> Along {
        let width = self.gradient.len() / 3;
        let direction = in_base(direction);
        let (mut gradient, mut information) = (DVector::zeros(width), DMatrix::zeros(width, width));
        for (a, along) in direction.iter().enumerate() {
            gradient += self.gradient.rows(a * width, width) * *along;
            for (b, other) in direction.iter().enumerate() {
                information +=
                    self.information.view((a * width, b * width), (width, width)) * (along * other);
            }
        }
        Along(gradient, information)
    }

    /// The score of some of them together.
    fn score(&self, chosen: &[usize], Along(gradient, information): &Along) -> Score {
        let places: Vec<usize> = chosen.iter().flat_map(|&k| self.places[k].clone()).collect();
        let sizes: Vec<f64> = chosen.iter().flat_map(|&k| self.sizes[k].iter().copied()).collect();
        let tried: f64 = chosen.iter().map(|&k| self.tried[k]).product();
        let information = information.select_rows(&places).select_columns(&places);
        score_from((gradient.select_rows(&places), information), &sizes, tried)
    }

    /// Forward selection under gravity along a direction, by evidence.
    fn select(&self, direction: [i8; 3]) -> Selected {
        let along = self.along(direction);
        let mut out = Selected { chosen: Vec::new(), merit: 0.0, score: None };
        while out.chosen.len() < MAX_SELECTED {
            let of = |k: usize| (self.causes[k].kind(), self.causes[k].joints());
            let is_left = |k: &usize| out.chosen.iter().all(|&other| of(other) != of(*k));
            let scored = (0..self.causes.len()).filter(is_left).map(|k| {
                let all: Vec<usize> = out.chosen.iter().copied().chain([k]).collect();
                (k, self.score(&all, &along))
            });
            let Some((k, score)) = scored.max_by(|a, b| a.1.merit.total_cmp(&b.1.merit)) else { break };
            if !(score.merit > out.merit) {
                break;
            }
            out.chosen.push(k);
            (out.merit, out.score) = (score.merit, Some(score));
        }
        out
    }
}

impl OtherGravity {
    /// The direction that explains the rows about as well as the causes of the arm that contradict it, or clearly better than those that do not;
    /// `None` if none does. Causes that the stated gravity cannot make count for nothing: those that are not plausible, and joints that it would lift.
    pub(super) fn find(
        subject: &Subject<'_>,
        fit: &Extended,
        (tried, is_plausible): (&[f64], &[bool]),
        whole: &FullDesign,
    ) -> Option<Self> {
        let of_arm: Vec<usize> = (0..fit.causes.len()).filter(|&k| fit.causes[k].is_in_arm()).collect();
        if of_arm.is_empty() {
            return None;
        }
        let dropped: Vec<usize> = of_arm.iter().flat_map(|&k| fit.parameter_indices(k).to_vec()).collect();
        let design = whole.without(&dropped);
        let possible: Vec<usize> = of_arm
            .iter()
            .copied()
            .filter(|&k| is_possible(&fit.causes[k], is_plausible[k], fit, k))
            .collect();
        let columns: Vec<DMatrix<f64>> =
            possible.iter().map(|&k| Candidate::of(&fit.causes[k], subject).columns(&whole.design)).collect();
        let sizes: Vec<f64> = possible.iter().flat_map(|&k| fit.causes[k].sizes()).collect();
        let variants: f64 = possible.iter().map(|&k| tried[k]).product();
        let found = columns.first().map_or(0.0, |first| {
            score_columns(&design, &side_by_side(&columns, first.nrows()), &sizes, variants).merit
        });
        let deflections = Deflections::of(subject, &design);
        let (direction, best) = DIRECTIONS
            .par_iter()
            .map(|&direction| (direction, deflections.select(direction)))
            .max_by(|a, b| a.1.merit_of(a.0).total_cmp(&b.1.merit_of(b.0)))?;
        let merit = best.merit_of(direction);
        let sign = if best.mass(&deflections) < 0.0 { -1 } else { 1 };
        let direction = direction.map(|along| sign * along);
        let stated = subject.nominal.gravity;
        let other = Self {
            direction,
            stated,
            yields: best
                .chosen
                .iter()
                .map(|&k| (deflections.causes[k].kind(), deflections.causes[k].joints()))
                .collect(),
        };
        let contradicts_some = of_arm.iter().any(|&k| other.contradicts(&fit.causes[k]));
        let margin = if contradicts_some { -CLEAR_TWICE_LOG_BF } else { CLEAR_TWICE_LOG_BF };
        (in_base(direction).dot(&stated) < SAME && merit > VISIBLE && merit > found + margin).then_some(other)
    }

    /// Whether a cause of the arm is none of what yields under that direction.
    pub(super) fn contradicts(&self, cause: &Cause) -> bool {
        cause.is_in_arm() && !self.yields.contains(&(cause.kind(), cause.joints()))
    }

    /// What is said of it.
    pub(super) fn note(&self) -> String {
        let length = in_base([1, 0, 0]).norm() / Vector3::from(self.direction.map(f64::from)).norm();
        let file = self.direction.map(|along| format!("{:.3}", f64::from(along) * length)).join(", ");
        let [now, then] = [in_words(&self.stated), in_words(&in_base(self.direction))];
        format!(
            "gravity seems to act {then} of the base frame, and the robot file says {now}: under it {} these rows as well as the causes that were \
             found, or better. If the arm hangs or stands on a wall, write its robot file (`truegrind robots NAME -o ARM.toml`), set gravity = \
             [{file}] under [robot.mounting], and diagnose again with --robot ARM.toml",
            if self.yields.len() == 1 { "one deflection explains" } else { "a few deflections explain" }
        )
    }
}

/// Whether the stated gravity can make a cause of the arm, as far as that is a weight.
fn is_possible(cause: &Cause, is_plausible: bool, fit: &Extended, index: usize) -> bool {
    let of_weight =
        matches!(cause.kind(), CauseKind::JointCompliance | CauseKind::BaseTilt | CauseKind::LinkBending);
    !of_weight || (is_plausible && !lifts(cause, fit, index))
}

/// Whether an upward weight is what a joint yields to. Joint 2 may have a balancer, which lifts more than the arm weighs.
fn lifts(cause: &Cause, fit: &Extended, index: usize) -> bool {
    let Cause::Arm(Effect::LumpedCompliance(load)) = cause else { return false };
    let own = fit.parameter_indices(index);
    let Some(covariance) = fit.estimate.covariance.as_ref().filter(|_| load.joint > 1) else { return false };
    let masses: Vec<usize> = (0..load.lump.len())
        .filter(|&k| load.lump[k].axis.is_none() && load.lump[k].moment.is_none())
        .map(|k| own[k])
        .collect();
    let sum: f64 = masses.iter().map(|&k| fit.x[k]).sum();
    let variance: f64 = masses.iter().flat_map(|&a| masses.iter().map(move |&b| covariance[(a, b)])).sum();
    sum < -SURELY * variance.max(0.0).sqrt()
}

/// Standard deviations below zero from which masses are surely negative.
const SURELY: f64 = 3.0;

fn in_base(direction: [i8; 3]) -> Vector3<f64> {
    Vector3::from(direction.map(f64::from)).normalize()
}

/// "along −z", or "between +x and −z".
fn in_words(direction: &Vector3<f64>) -> String {
    let largest = direction.amax();
    let axes: Vec<String> = ["x", "y", "z"]
        .into_iter()
        .zip(direction.iter())
        .filter(|(_, along)| along.abs() > 0.5 * largest)
        .map(|(name, along)| format!("{}{name}", if *along < 0.0 { "−" } else { "+" }))
        .collect();
    match axes.as_slice() {
        [one] => format!("along {one}"),
        all => format!("between {}", truegrind_math::sentence::listed(all)),
    }
}

impl Selected {
    /// The merit less the odds against the direction.
    fn merit_of(&self, direction: [i8; 3]) -> f64 {
        let is_straight = direction.iter().filter(|along| **along != 0).count() == 1;
        let odds = if is_straight { STRAIGHT as f64 } else { STRAIGHT_ODDS * SLANTED as f64 };
        self.merit - 2.0 * (STATED_ODDS * odds).ln()
    }

    /// Compliance times mass of the first deflection, over its lumps: its sign is that of gravity.
    fn mass(&self, deflections: &Deflections) -> f64 {
        let (Some(&first), Some(score)) = (self.chosen.first(), &self.score) else { return 0.0 };
        let masses = match &deflections.causes[first] {
            Cause::Arm(Effect::LumpedCompliance(load)) => {
                load.lump.iter().filter(|lump| lump.moment.is_none()).count()
            }
            Cause::Measurement(_) => deflections.sizes[first].len().min(3),
            Cause::Arm(_) => 1,
        };
        score.estimate.iter().take(masses).sum()
    }
}
