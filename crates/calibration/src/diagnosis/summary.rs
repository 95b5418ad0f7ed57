//! Summarises a search: findings of causes, data quality, and the unexplained residual.

use super::cause::Cause;
use super::cause_kind::CauseKind;
use super::confounding::{Confounding, excess_over_noise_mm};
use super::contribution::Contributions;
use super::data_quality::{Deviation, mismatch_finding, noise_floor, outlier_finding, rounding_finding};
use super::extension::Extended;
use super::finding::{Finding, NoiseFloorSource, Step};
use super::findings::FindingBuilder;
use super::held_out::FoldErrors;
use super::joint_scatter::JointScatter;
use super::merged::{self, MergedFinding};
use super::picture::Picture;
use super::residual_tests::{self, Structure};
use super::search::{Confirmed, Search};
use super::something_else::SomethingElse;
use super::unexplained::{Unexplained, something_else};
use crate::identification::rounded_log::{RoundedLog, Rounding};
use crate::measurement::dataset::{Dataset, Sensor};
use crate::measurement::noise_floor::{self, NoiseFloor};
use crate::measurement::split;

/// Summary of a search.
pub(super) struct Summary {
    /// Findings by descending contribution.
    pub(super) findings: Vec<MergedFinding>,
    /// The held-out error as causes were added.
    pub(super) steps: Vec<Step>,
    /// The fit to all rows with all parameters of its causes.
    pub(super) extended: Extended,
    /// The noise floor (mm) and its source.
    pub(super) noise_floor: (Option<f64>, NoiseFloorSource),
    /// The scatter of repeated poses, where enough were repeated.
    pub(super) repeats: Option<NoiseFloor>,
    /// The unexplained residual, in a sentence.
    pub(super) remaining: Option<String>,
    /// The same for a planner, where it is a finding.
    pub(super) something_else: Option<SomethingElse>,
    /// The joint about which the residual scatters, where that is large.
    pub(super) joint_scatter: Option<JointScatter>,
    /// What a log that rounds leaves beside all causes.
    pub(super) rounded_log: Option<RoundedLog>,
}

/// The scatter of repeated poses, where it is known: between the shifts that were found, or beside one that was not.
fn repeats_beside_shifts(search: &Search<'_>) -> Option<NoiseFloor> {
    let rows = without_outliers(search);
    let shifted: Vec<[usize; 2]> = search.full_fit.causes.iter().filter_map(Cause::rows).collect();
    let between = noise_floor::noise_floor_within(&rows, &shifted).filter(|_| !shifted.is_empty());
    let known = |floor: Option<NoiseFloor>| floor.filter(NoiseFloor::is_known);
    known(between).or_else(|| known(noise_floor::noise_floor_beside_shift(&rows)))
}

/// Summarises a search. `smoothed` is the held-out error without the smooth correction (mm), if there is one; `few_poses`: there are too few to
/// separate effects from geometry.
pub(super) fn summarise(
    search: &Search<'_>,
    confirmed: &Confirmed,
    structure: &Structure,
    (smoothed, few_poses): (Option<f64>, bool),
) -> Summary {
    let context = search.context;
    let (subject, searched, prepared) = (&context.subject, &context.searched, context.prepared);
    let (errors, outcome) = (&search.errors, &confirmed.outcome);
    let floor = repeats_beside_shifts(search);
    let mut steps = vec![
        Step { added: "data sheet, frames fitted".to_owned(), cv_rmse_mm: errors.registered.random.rmse },
        Step { added: "geometry".to_owned(), cv_rmse_mm: errors.geometric.random.rmse },
    ];
    let extended = search.full_fit.clone().whole(subject);
    let contributions = Contributions::new(searched, &search.searched_fit, &confirmed.whole);
    let Findings { of_causes, finding_of_cause, pictures, of_links } =
        findings(search, confirmed, &extended, &contributions, &mut steps);
    let confounding = confounding(search, confirmed, &contributions, floor.as_ref());
    let mut findings = merged::merge_findings(
        merged::from_findings(of_causes, &finding_of_cause, pictures),
        &outcome.confirmations,
        &outcome.discrepancy,
        &confounding,
        errors.geometric.fitted.rmse,
    );
    if smoothed.is_some() {
        let added = "smooth correction, without a physical cause".to_owned();
        steps.push(Step { added, cv_rmse_mm: errors.with_causes.random.rmse });
    }
    (context.progress)("analysing the residual");
    let noise_floor = noise_floor(&floor, subject, &search.full_fit);
    let aside: Vec<usize> =
        residual_tests::outliers(&search.searched_fit).into_iter().map(|(row, _)| row).collect();
    let logged_rad = searched.observed.angles.typical_rad();
    let scatter = JointScatter::of(&confirmed.linear, &search.searched_fit.robust_weight, &aside, logged_rad);
    let rounding = rounding_beside_causes(search, floor.as_ref());
    let rounding_finding =
        rounding_finding(context.dataset, prepared, subject, &search.geometric, (errors, few_poses))
            .filter(|_| rounding != Rounding::Exact);
    // Of repeated poses the scatter has no rounding.
    let rounding_mm = rounding_finding.as_ref().filter(|_| floor.is_some()).and_then(|f| f.worth_mm);
    let unexplained = Unexplained {
        dataset: &searched.observed.dataset,
        discrepancy: &outcome.discrepancy,
        scatter: scatter.as_ref(),
        structure,
        after: &errors.with_causes,
        smoothed,
        floor_mm: noise_floor.0.map(|floor_mm| floor_mm.hypot(rounding_mm.unwrap_or(0.0))),
        noise_measured: floor.is_some(),
    };
    let outliers = unexpected_outliers(search);
    let off = Deviation::of(&search.full_fit, &outliers);
    let empirical_mm = confounding.largest_empirical_rms_mm();
    let unexplained_finding = unexplained.finding();
    let something_else =
        unexplained_finding.is_some().then(|| something_else(&searched.observed.dataset, confirmed));
    let of_the_record = [
        rounding_finding,
        mismatch_finding(context.dataset, prepared, &errors.with_causes),
        outlier_finding(context.dataset, &outliers, (off, empirical_mm), &errors.with_causes),
        unexplained_finding,
    ];
    let without_causes = of_the_record.into_iter().flatten().chain(of_links);
    findings.extend(without_causes.map(MergedFinding::without_cause));
    merged::rank(&mut findings);
    Summary {
        findings,
        steps,
        extended,
        noise_floor,
        repeats: floor,
        remaining: unexplained.sentence(),
        something_else,
        joint_scatter: unexplained.scatter().cloned(),
        rounded_log: match rounding {
            Rounding::Rounded(rounded) => Some(rounded),
            Rounding::Exact | Rounding::Undecided => None,
        },
    }
}

/// What the residuals say of the rounding of the angles: those of the model with all causes, or of geometry alone where these leave it open.
/// Causes that were found in the scatter of a rounded log take up a part of it.
fn rounding_beside_causes(search: &Search<'_>, repeats: Option<&NoiseFloor>) -> Rounding {
    let asked = search.asked_of_rounding(&search.full_fit, repeats);
    let of_geometry = || search.asked_of_rounding(&search.geometric, repeats).rounding();
    match asked.rounding() {
        Rounding::Undecided if matches!(of_geometry(), Rounding::Rounded(_)) => {
            asked.if_rounded().map_or(Rounding::Undecided, Rounding::Rounded)
        }
        found => found,
    }
}

/// What keeps a cause of the arm from being told apart from the sensor's faults.
fn confounding<'s>(
    search: &'s Search<'_>,
    confirmed: &'s Confirmed,
    contributions: &'s Contributions,
    floor: Option<&NoiseFloor>,
) -> Confounding<'s> {
    let (context, outcome) = (search.context, &confirmed.outcome);
    let subject = &context.subject;
    Confounding {
        causes: &search.searched_fit.causes,
        confirmations: &outcome.confirmations,
        contributions,
        nominal: subject.nominal,
        by_one_cable: context.dataset.sensor == Sensor::Cable && subject.frames.outlets_mm.len() == 1,
        dataset: &subject.observed.dataset,
        growth_mm: outcome.discrepancy.growth_mm(),
        field_mm: outcome.discrepancy.field_mm(),
        excess_over_noise_mm: floor.map_or(0.0, |floor| {
            let coordinates = context.dataset.sensor.axes();
            excess_over_noise_mm(
                search.errors.with_causes.fitted.rmse,
                floor.sigma_mm,
                coordinates * floor.freedom,
            )
        }),
    }
}

/// The outliers, without those that a fault found from the motion cannot explain because nothing is known of theirs: the first row.
fn unexpected_outliers(search: &Search<'_>) -> Vec<(usize, f64)> {
    let kinds = || search.searched_fit.causes.iter().map(|cause| cause.kind());
    let rows = &search.context.subject.observed.dataset.rows;
    let follows_motion = kinds().any(|kind| matches!(kind, CauseKind::Latency | CauseKind::Unsettled));
    let is_expected = |row: usize| follows_motion && rows[row].motion().is_none();
    search.outliers.iter().filter(|(row, _)| !is_expected(*row)).copied().collect()
}

/// The rows that no reading contradicts.
fn without_outliers(search: &Search<'_>) -> Dataset {
    let dataset = search.context.dataset;
    let mut kept = vec![true; dataset.rows.len()];
    let outliers = search.outliers.iter().map(|(row, _)| row);
    outliers.chain(&search.set_aside).for_each(|&row| kept[row] = false);
    let indices: Vec<usize> = (0..kept.len()).filter(|&row| kept[row]).collect();
    dataset.subset(&indices)
}

/// Findings, and the index of the finding of each cause.
struct Findings {
    of_causes: Vec<Finding>,
    finding_of_cause: Vec<usize>,
    pictures: Vec<Picture>,
    /// Of implausible links.
    of_links: Vec<Finding>,
}

/// The findings of the accepted causes, and of implausible links; adds the held-out error after each to `steps`.
fn findings(
    search: &Search<'_>,
    confirmed: &Confirmed,
    extended: &Extended,
    contributions: &Contributions<'_>,
    steps: &mut Vec<Step>,
) -> Findings {
    let context = search.context;
    let rows = &context.searched.observed.dataset;
    let folds = split::purged(rows, 5, search.correlation_range, context.options.selection.seed);
    let aside: &[usize] = if context.is_thinned() { &[] } else { &search.set_aside };
    let builder = FindingBuilder {
        subject: &context.searched,
        fit: &search.searched_fit,
        extended,
        whole: &confirmed.whole,
        held: &FoldErrors::of(&confirmed.linear, &folds),
        set_aside: aside,
    };
    let tolerance = &context.options.arm_tolerance;
    let of_links = builder.implausible_links(&confirmed.linear, contributions, tolerance);
    let (of_causes, finding_of_cause, pictures) = builder.findings(&search.accepted, steps);
    Findings { of_causes, finding_of_cause, pictures, of_links }
}
