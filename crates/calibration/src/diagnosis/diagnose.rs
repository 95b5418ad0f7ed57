//! The whole diagnosis of one data set.

use super::cause::Cause;
use super::cause_kind::CauseKind;
use super::data_quality::single_angles;
use super::decision;
use super::discrepancy::Discrepancy;
use super::extension::{Extended, Subject};
use super::finding::{DiagnoseError, Diagnosis, Fits, RangeNoise, SCHEMA, Source, Stage};
use super::in_doubt::{self, MissingError};
use super::joint_scatter::JointScatter;
use super::link_geometry::LINK_Z;
use super::merged;
pub use super::options::Options;
use super::picture::Picture;
use super::preparation::{Prepared, prepare};
use super::residual_tests;
use super::search::{Confirmed, Search, SearchContext};
use super::selection::contains_cause;
use super::sensor_causes::{self, probability_worse};
use super::summary::{self, Summary};
use super::testability::not_testable;
use super::validation::{StageError, nominal};
use super::written_model::{certain_causes, fit_written, time_discrepancy, under_correlated_noise};
use crate::identification::benefit::{Benefit, NoBenefit, benefit};
use crate::identification::beyond_noise::BeyondNoise;
use crate::identification::calibration::Frames;
use crate::identification::fit::{
    Fitted, Observations, WRONG_ORIENTATION_RAD, frame_parameters, median_orientation_error,
};
use crate::identification::identify::{
    self, Identification, arm_covariance, arm_parameters_of, learned_width_uncertainty, mean_condition,
    parameter_table, with_sigma_in_region,
};
use crate::identification::inflation::inflation_from_errors;
use crate::identification::linearised_readings::widen_by_scale;
use crate::identification::start::count_distinct_poses;
use crate::identification::tolerance::Tolerance;
use crate::identification::unseen_target::unseen_target;
use crate::identification::verdict::{CONVERGED, VerdictBuilder};
use crate::measurement::dataset::{Dataset, Sensor};
use crate::measurement::split;
use nalgebra::DMatrix;
use truegrind_arm::effect::Effect;
use truegrind_arm::estimated::{Estimated, EstimatedParameter, Judgement, Provenance, StageErrors, Verdict};
use truegrind_arm::model::Model;
use truegrind_arm::parameter::arm_parameters;
use truegrind_arm::region::Region;
use truegrind_estimation::estimate::Estimate;
use truegrind_estimation::problem::Problem;

/// A diagnosis with its fits.
#[derive(Debug, Clone)]
pub struct Diagnosed {
    /// The result.
    pub diagnosis: Diagnosis,
    /// Geometry alone.
    pub geometric: Extended,
    /// With all causes.
    pub extended: Extended,
    /// The arm for compensation, with its verdict.
    pub estimated: Estimated,
    /// Its expected benefit for programs; absent where its equations have no solution.
    pub benefit: Option<Benefit>,
    /// The rows as fitted.
    pub prepared: Prepared,
    /// Rows set aside, as indices of the data set.
    pub set_aside: Vec<usize>,
    /// The index of the finding of each cause of the extended model; several causes can share one.
    pub finding_of_cause: Vec<usize>,
    /// A picture for each finding with a cause in the model, `None` for the others.
    pub pictures: Vec<Option<Picture>>,
}

/// Median error with only the frames fitted above which the rows are not of this arm (mm).
const WRONG_ARM_MM: f64 = 25.0;

/// Diagnoses `dataset` of the arm `nominal` (by name `robot`), frames starting at `frames`. `progress` is called at every step.
///
/// # Errors
/// If the rows cannot be of this arm.
pub fn diagnose(
    dataset: &Dataset,
    robot: &str,
    nominal_arm: &Model,
    frames: &Frames,
    options: &Options,
    progress: &(dyn Fn(&str) + Sync),
) -> Result<Diagnosed, DiagnoseError> {
    let prepared = prepare(dataset, nominal_arm, options.fuse_readout);
    let tolerance = Tolerance { scale: options.arm_tolerance.scale, ..options.tolerance };
    let subject =
        Subject { observed: &prepared.observed, nominal: nominal_arm, frames, tolerance: &tolerance };
    let registered = nominal(&subject);
    let typical = residual_tests::median_error_mm(&registered);
    if !(typical < WRONG_ARM_MM) {
        return Err(DiagnoseError::WrongArm {
            file: dataset.file.clone(),
            robot: robot.to_owned(),
            rmse_mm: typical,
        });
    }
    let turned = median_orientation_error(&prepared.observed, &registered.model, &registered.frames);
    if let Some(rad) = turned.filter(|rad| *rad > WRONG_ORIENTATION_RAD) {
        let (file, robot) = (dataset.file.clone(), robot.to_owned());
        return Err(DiagnoseError::WrongOrientation { file, robot, deg: rad.to_degrees() });
    }
    let needed = poses_needed_at_least(dataset, nominal_arm);
    let thin_rows = thin_rows(&prepared.observed);
    let searched = Subject { observed: thin_rows.as_ref().unwrap_or(&prepared.observed), ..subject };
    let context = SearchContext { dataset, prepared: &prepared, subject, searched, options, progress };
    let most = if needed.is_some() { 0 } else { options.selection.most };
    let mut search = Search::run(&context, registered, most);
    search.drop_unvalidated_causes();
    progress("stability selection in halves of the rows");
    let mut confirmed = search.confirm();
    search.purge_validation(&mut confirmed);
    let structure = residual_tests::structure(&subject, &search.extended, &search.set_aside);
    let smoothed = search.fit_smooth_correction(&structure);
    let summary = summary::summarise(&search, &confirmed, &structure, (smoothed, needed.is_some()));
    let few_poses = needed.map(|needed| few_poses_note(dataset, needed));
    let mut notes: Vec<String> = few_poses.iter().cloned().collect();
    notes.append(&mut search.notes);
    let mut finding_of_cause = vec![0; search.found.causes.len()];
    for (index, merged) in summary.findings.iter().enumerate() {
        merged.causes.iter().for_each(|&k| finding_of_cause[k] = index);
    }
    let certain =
        merged::certain_flags(&summary.findings, &confirmed.outcome.confirmations, &search.extended.causes);
    let (extended, scatter) = (summary.extended.clone(), summary.joint_scatter.clone());
    let all_causes = &search.stages[2];
    let all_causes = StageErrors { fitted: all_causes.fitted, held_out: all_causes.random };
    let beyond = BeyondNoise::of(&all_causes, dataset.sensor, summary.repeats.as_ref())
        .beside_rounding(summary.noise_floor.0, dataset.sensor);
    let (mut diagnosis, pictures) = build_diagnosis(&search, &confirmed, summary, robot, notes);
    diagnosis.poses_needed = needed;
    let of_all = thin_rows.is_none().then_some(&confirmed.outcome.discrepancy);
    let certain_model = certain_model(&search, &certain, of_all);
    let beside_sensor = certain_model.1;
    let ((written, written_stage), chance) = without_measurement_causes(&search, certain_model, of_all);
    let written = if written.causes.is_empty() {
        as_identified(&context, robot, &written, of_all).unwrap_or(written)
    } else {
        written
    };
    diagnosis.notes.extend(chance.map(|chance| {
        format!(
            "the written arm leaves the causes in the measurement out of its fit, since with them its links might be worse (probability {:.0} %, \
             at most {:.0} % are allowed)",
            100.0 * chance,
            100.0 * sensor_causes::MOST_PROBABILITY
        )
    }));
    let handing = Handing {
        search: &search,
        discrepancy: of_all,
        scatter,
        noise: Noise { floor_mm: diagnosis.noise_floor_mm, beyond },
        beside_sensor,
        few_poses,
    };
    let handed = with_uncertain_causes(&search, &written, of_all);
    let with_causes =
        handing.estimated(robot, [&written, handed.as_ref().unwrap_or(&written)], &written_stage);
    let (estimated, benefit) = handing.or_geometry_alone(with_causes, robot, &mut diagnosis.notes);
    diagnosis.verdict = Some(estimated.verdict.clone());
    let (geometric, set_aside) = (search.geometric, search.set_aside);
    Ok(Diagnosed {
        diagnosis,
        geometric,
        extended,
        estimated,
        benefit,
        prepared,
        set_aside,
        finding_of_cause,
        pictures,
    })
}

/// Says that there are too few poses.
fn few_poses_note(dataset: &Dataset, needed: usize) -> String {
    format!(
        "{} rows at {} distinct poses are too few to separate effects from geometry: at least {needed} poses are needed, some hundred are \
         usual; these results depend on the priors",
        dataset.rows.len(),
        count_distinct_poses(dataset, usize::MAX)
    )
}

/// What is needed to hand over an arm.
struct Handing<'a> {
    search: &'a Search<'a>,
    discrepancy: Option<&'a Discrepancy>,
    scatter: Option<JointScatter>,
    noise: Noise,
    /// Errors of the written arm beside all causes of the measurement: what it lacks beyond the errors with all causes is the arm's, and
    /// what a fit without the causes of the measurement lacks beyond that is not.
    beside_sensor: StageError,
    /// Says that there are too few poses.
    few_poses: Option<String>,
}

/// What is known of the noise.
#[derive(Clone, Copy)]
struct Noise {
    /// The noise floor of sensor and rounding (mm).
    floor_mm: Option<f64>,
    /// What all causes leave beyond the scatter of repeated poses.
    beyond: BeyondNoise,
}

impl Handing<'_> {
    /// The arm of a fit for compensation, with its expected benefit; `handed` is the same with uncertain causes. What both lack stands in
    /// the covariance.
    fn estimated(
        &self,
        robot: &str,
        [written, handed]: [&Extended; 2],
        stage: &StageError,
    ) -> (Estimated, Option<Benefit>) {
        let search = self.search;
        let mut missing = in_doubt::missing_errors(&search.context.subject, &search.extended, handed);
        // What a fault of the joint without a file leaves is known better than its scatter.
        let scatter = self.scatter.as_ref().map(MissingError::scatter);
        missing
            .extend(scatter.filter(|scatter| !missing.iter().any(|other| other.joint() == scatter.joint())));
        let [before, geometry, _] = search.stages;
        let mut fits = [written, handed].map(Fitted::from);
        if let Some(sigma) = search.context.options.arm_tolerance.scale {
            let rows = &search.context.subject.observed.dataset;
            fits.iter_mut().for_each(|fit| widen_by_scale(fit, rows, sigma));
        }
        let stages = [before, geometry, *stage];
        let few_poses = self.few_poses.as_deref();
        let [all, beside_sensor, own] = [&search.stages[2], &self.beside_sensor, stage]
            .map(|s| StageErrors { fitted: s.fitted, held_out: s.random });
        let sensor = search.context.dataset.sensor;
        let of_arm = self.noise.beyond.of_part(&all, &beside_sensor, sensor, true);
        let noise = Noise { beyond: of_arm.of_part(&beside_sensor, &own, sensor, false), ..self.noise };
        let scatter_mm = self.scatter.as_ref().map_or(0.0, JointScatter::rms_mm);
        estimated(search, robot, (&fits, missing, scatter_mm), &stages, (noise, few_poses))
    }

    /// The written arm with its benefit; where it is refused beside causes and geometry alone is not, that, with a note.
    ///
    /// A cause whose law is only nearly right can drive links that the rows determine through it alone: where links warm up unequally,
    /// a common growth is met by a link of another length whose constant part the frames take up.
    fn or_geometry_alone(
        &self,
        with_causes: (Estimated, Option<Benefit>),
        robot: &str,
        notes: &mut Vec<String>,
    ) -> (Estimated, Option<Benefit>) {
        let verdict = &with_causes.0.verdict;
        if verdict.status != Judgement::Fail || self.search.extended.causes.is_empty() {
            return with_causes;
        }
        let plain = written(self.search, &[], None);
        let Some(alone) = as_identified(self.search.context, robot, &plain, self.discrepancy) else {
            return with_causes;
        };
        // An arm that is refused as implausible does not say how far this one may be off.
        let alone = self.estimated(robot, [&alone; 2], &self.search.validation.stage(&alone));
        if !matches!(alone.0.verdict.status, Judgement::Pass | Judgement::NotEvaluated) {
            return with_causes;
        }
        notes.push(format!(
            "the written arm is geometry alone, as `identify` fits it: beside the causes the arm is refused, since {}",
            verdict.reasons.first().map_or("it is implausible", String::as_str)
        ));
        alone
    }
}

/// The same rows identified, with the options of the diagnosis.
fn identified(context: &SearchContext<'_>, robot: &str) -> Option<Identification> {
    let SearchContext { dataset, subject, options, .. } = context;
    let defaults = identify::Options::default();
    let alone = identify::Options {
        tolerance: options.arm_tolerance,
        seed: options.selection.seed,
        fuse_readout: options.fuse_readout,
        limit_rmse_mm: options.limits.rmse_mm,
        limit_max_mm: options.limits.max_mm,
        ..defaults
    };
    let share = |rows: &Dataset| split::random(rows, alone.held_out, alone.seed);
    identify::identify(dataset, robot, subject.nominal, subject.frames, &share, &alone).ok()
}

/// A written arm without causes, with the estimate of `identify`: what names nothing should not write another geometry. `None` where that
/// fit has other parameters or failed.
fn as_identified(
    context: &SearchContext<'_>,
    robot: &str,
    written: &Extended,
    discrepancy: Option<&Discrepancy>,
) -> Option<Extended> {
    let Fitted { parameters, priors, estimate, model, frames, problem, .. } =
        identified(context, robot)?.geometry;
    let place = |p| parameters.iter().position(|q| q == p);
    let places = written.parameters.iter().map(place).collect::<Option<Vec<usize>>>()?;
    // Rows that it rejects are few: those left count as consecutive.
    let numbers: Vec<usize> = (0..problem.rows() / problem.rows_per_observation()).collect();
    let own = estimate.covariance.as_ref()?;
    let own = under_correlated_noise(&problem, &estimate.x, own, discrepancy, &numbers);
    let covariance = DMatrix::from_fn(places.len(), places.len(), |a, b| own[(places[a], places[b])]);
    let x: Vec<f64> = places.iter().map(|&k| estimate.x[k]).collect();
    let priors = places.iter().map(|&k| priors[k]).collect();
    let estimate = Estimate { x: x.clone(), covariance: Some(covariance), ..estimate };
    Some(Extended { priors, x, model, frames, estimate, ..written.clone() })
}

/// The model with `causes` under the tolerances of the arm.
fn written(search: &Search<'_>, causes: &[Cause], discrepancy: Option<&Discrepancy>) -> Extended {
    let SearchContext { subject, options, .. } = &search.context;
    fit_written(subject, &options.arm_tolerance, &search.extended, causes, discrepancy)
}

/// The arm for compensation, with its errors. Its effects are included only if they lower the held-out error of this very model, in
/// random folds and in blocks; causes that are not part of it do not count.
fn certain_model(
    search: &Search<'_>,
    certain: &[bool],
    discrepancy: Option<&Discrepancy>,
) -> (Extended, StageError) {
    let of = |certain: &[bool]| {
        let fit = written(search, &certain_causes(&search.extended, certain), discrepancy);
        let errors = search.validation.stage(&fit);
        (fit, errors)
    };
    let (fit, errors) = of(certain);
    let of_the_arm = |cause: &Cause| matches!(cause, Cause::Arm(_));
    let is_carried = |cause: &Cause| of_the_arm(cause) || cause.stand_in().is_some();
    let better =
        |than: &StageError| errors.random.rmse < than.random.rmse && errors.blocks.rmse < than.blocks.rmse;
    let arm_alone = fit.causes.iter().all(of_the_arm);
    if !fit.causes.iter().any(of_the_arm) || arm_alone && better(&search.stages[1]) {
        return (fit, errors);
    }
    let causes = &search.extended.causes;
    let without: Vec<bool> =
        certain.iter().zip(causes).map(|(sure, cause)| *sure && !is_carried(cause)).collect();
    let plain = of(&without);
    if better(&plain.1) { (fit, errors) } else { plain }
}

/// `certain_model`, or, with the probability, the same fitted without the causes of the measurement if these make a worse arm too
/// probable.
fn without_measurement_causes(
    search: &Search<'_>,
    certain_model: (Extended, StageError),
    discrepancy: Option<&Discrepancy>,
) -> ((Extended, StageError), Option<f64>) {
    let of_the_arm: Vec<Cause> =
        certain_model.0.causes.iter().filter(|cause| matches!(cause, Cause::Arm(_))).cloned().collect();
    if of_the_arm.len() == certain_model.0.causes.len() && time_discrepancy(discrepancy).is_none() {
        return (certain_model, None);
    }
    let SearchContext { dataset, subject, .. } = search.context;
    let correlated = discrepancy.filter(|d| d.correlation > 0.0);
    let without = written(search, &of_the_arm, correlated);
    let samples = Region::of(subject.observed.dataset.rows.iter().map(|row| &row.joints), 0.0).samples_deg;
    let beside = in_doubt::with_zero_causes(&without, certain_model.0.clone());
    match probability_worse(&certain_model.0, &beside, &mean_condition(dataset), &samples) {
        Some(chance) if chance > sensor_causes::MOST_PROBABILITY => {
            let errors = search.validation.stage(&without);
            ((without, errors), Some(chance))
        }
        _ => (certain_model, None),
    }
}

/// The written arm extended by uncertain causes of size 0; `None` if it includes all causes already.
fn with_uncertain_causes(
    search: &Search<'_>,
    fit: &Extended,
    discrepancy: Option<&Discrepancy>,
) -> Option<Extended> {
    let all = in_doubt::representable_causes(&search.extended.causes, &search.accepted);
    let missing = |cause: &Cause| !contains_cause(&fit.causes, cause);
    all.iter().any(missing).then(|| in_doubt::with_zero_causes(fit, written(search, &all, discrepancy)))
}

/// Builds the diagnosis, and the pictures of its findings.
fn build_diagnosis(
    search: &Search<'_>,
    confirmed: &Confirmed,
    summary: Summary,
    robot: &str,
    mut notes: Vec<String>,
) -> (Diagnosis, Vec<Option<Picture>>) {
    let SearchContext { dataset, prepared, subject, searched, .. } = search.context;
    let set_aside = &search.set_aside;
    let noise = residual_tests::noise_model(subject, &search.extended, set_aside);
    let kinds: Vec<CauseKind> = search.found.causes.iter().map(|c| c.kind()).collect();
    let rows = &searched.observed.dataset;
    let not_testable = not_testable(rows, &confirmed.whole.design, &search.left, &kinds, prepared);
    if let Err(why) = &prepared.readout_fusion
        && dataset.angle_step_rad.is_some()
        && let crate::identification::rounding::NotFused::Mismatch { found_mm, expected_mm } = why
    {
        notes.push(format!(
            "the read-out deviates from the angles by {found_mm:.2} mm where rounding allows {expected_mm:.2} mm: it was not fused with them"
        ));
    }
    notes.extend(single_angles(dataset));
    if prepared.sides_from_order
        && search.found.causes.iter().any(|c| matches!(c, Cause::Arm(Effect::Backlash(_))))
    {
        notes.push(
            "the sides of approach were not logged (columns approach1 to approach6): backlash was judged as if every row had been approached \
             straight from the row before"
                .to_owned(),
        );
    }
    let mut measure_again: Vec<usize> = set_aside
        .iter()
        .chain(prepared.mismatch.rows.iter().map(|(i, _)| i))
        .map(|&i| dataset.rows[i].number)
        .collect();
    measure_again.sort_unstable();
    measure_again.dedup();
    let (mut findings, pictures): (Vec<_>, Vec<_>) =
        summary.findings.into_iter().map(|s| (s.finding, s.picture)).unzip();
    let asking = decision::Asking {
        robot,
        sensor: dataset.sensor,
        frames: &search.extended.frames,
        something_else: summary.something_else.as_ref(),
    };
    asking.complete(&mut findings);
    let diagnosis = Diagnosis {
        schema: SCHEMA.to_owned(),
        verdict: None,
        dataset: Source {
            file: dataset.file.clone(),
            rows: dataset.rows.len(),
            sensor: dataset.sensor,
            robot: robot.to_owned(),
            set_aside: set_aside.len(),
        },
        noise_floor_mm: summary.noise_floor.0,
        noise_floor_source: summary.noise_floor.1,
        fits: fits(search),
        steps: summary.steps,
        findings,
        not_testable,
        remaining: summary.remaining,
        something_else: summary.something_else,
        noise_model: noise.map(|n| RangeNoise {
            sigma_mm: n.sigma_mm,
            per_metre_mm: n.per_metre_mm,
            p_value: n.p_value,
        }),
        measure_again,
        poses_needed: None,
        transfers: Vec::new(),
        notes,
    };
    (diagnosis, pictures)
}

/// Most scalar rows in which causes are searched.
const SEARCHED: usize = 9_000;

/// A random subset of the rows of a very long data set, drawn by their angles; `None` if all rows are searched.
fn thin_rows(observed: &Observations) -> Option<Observations> {
    let dataset = &observed.dataset;
    let per = dataset.sensor.scalars();
    let most = SEARCHED / per;
    (dataset.rows.len() > most).then(|| {
        // Not every k-th row: one row less would change the choice of all later ones.
        let all = (0..dataset.rows.len()).map(|i| vec![i]).collect();
        let mut rows = split::shuffled_by_angles(dataset, all, 0).concat();
        rows.truncate(most);
        rows.sort_unstable();
        observed.subset(&rows)
    })
}

/// The number of poses needed, if there are too few.
fn poses_needed_at_least(dataset: &Dataset, nominal: &Model) -> Option<usize> {
    let per = dataset.sensor.scalars();
    let parameters = arm_parameters(nominal).len() + frame_parameters(dataset).len();
    let needed = parameters.div_ceil(per) + 10;
    (count_distinct_poses(dataset, needed) < needed).then_some(needed)
}

/// The errors of the three stages.
fn fits(search: &Search<'_>) -> Fits {
    (search.context.progress)("cross-validating over regions of joint space");
    let stage = |k: usize, fit: &Extended| {
        let errors = &search.stages[k];
        Stage {
            rmse_mm: errors.fitted.rmse,
            mean_mm: errors.fitted.mean_absolute,
            max_mm: errors.fitted.max,
            cv_rmse_mm: errors.random.rmse,
            cv_blocks_rmse_mm: errors.blocks.rmse,
            cv_regions_rmse_mm: search.validation.over_regions(fit).rmse,
        }
    };
    Fits {
        nominal: stage(0, &search.registered),
        geometric: stage(1, &search.geometric),
        extended: stage(2, &search.extended),
    }
}

/// The arm for compensation and its expected benefit, from the written fit and the same with uncertain causes, what both lack, and the
/// size of a scatter about a joint (mm RMS), which remains with and without correction, as what all causes leave beyond the noise does. Of too
/// few poses no benefit is stated: it would be the priors'.
fn estimated(
    search: &Search<'_>,
    robot: &str,
    ([fitted, handed], missing, scatter_mm): (&[Fitted; 2], Vec<MissingError>, f64),
    stages: &[StageError; 3],
    (noise, few_poses): (Noise, Option<&str>),
) -> (Estimated, Option<Benefit>) {
    let SearchContext { dataset, prepared, subject, options, .. } = search.context;
    let set_aside = &search.set_aside;
    let nominal_arm = subject.nominal;
    let order = arm_parameters_of(handed);
    let mut estimated = Estimated {
        robot: robot.to_owned(),
        nominal: nominal_arm.clone(),
        model: handed.model.clone(),
        covariance: arm_covariance(handed),
        width_uncertainty: learned_width_uncertainty(&options.arm_tolerance, fitted),
        order,
        provenance: Provenance {
            file: dataset.file.clone(),
            sha256: dataset.sha256.clone(),
            rows: dataset.rows.len() - set_aside.len(),
            set_aside: set_aside.iter().map(|&i| dataset.rows[i].number).collect(),
            sensor: dataset.sensor,
            method: "diagnose".to_owned(),
            seed: options.selection.seed,
            held_out: 0.2,
            sharpened: prepared.readout_fusion.is_ok(),
            version: env!("CARGO_PKG_VERSION").to_owned(),
        },
        parameters: parameter_table(handed, nominal_arm).into_iter().filter(|p| p.is_of_arm()).collect(),
        registered: StageErrors { fitted: stages[0].fitted, held_out: stages[0].random },
        geometry: StageErrors { fitted: stages[2].fitted, held_out: stages[2].random },
        noise_floor_mm: noise.floor_mm,
        beyond_noise_mm: noise.beyond.known_mm(),
        verdict: Verdict { status: Judgement::NotEvaluated, reasons: Vec::new() },
        region: Region::of(subject.observed.dataset.rows.iter().map(|row| &row.joints), 0.0),
        condition: mean_condition(dataset),
    };
    in_doubt::add_missing_errors(&mut estimated, missing);
    let mut estimated = with_sigma_in_region(estimated, handed);
    let rows = &subject.observed.dataset;
    // Links and benefit are judged by the tolerances of arms, not by the wide priors of a diagnosis.
    let plausible = &options.arm_tolerance;
    let benefit = match few_poses {
        Some(few) => Err(NoBenefit::FewPoses(few.to_owned())),
        None => {
            let inflation = inflation_from_errors(fitted, rows, &estimated.geometry);
            benefit(fitted, rows, &estimated, plausible, inflation)
                .map(|benefit| benefit.with(noise.beyond.or_scatter(scatter_mm)))
        }
    };
    let parameters = parameter_table(fitted, nominal_arm);
    let unseen = unseen_target(handed, rows, &estimated);
    estimated.verdict = judge(fitted, (rows.sensor, unseen), benefit.as_ref(), &parameters, stages, options);
    (estimated, benefit.ok())
}

/// The verdict of an identification, plus: findings must not raise the held-out error of geometry.
fn judge(
    fitted: &Fitted,
    (sensor, unseen_target): (Sensor, Option<String>),
    benefit: Result<&Benefit, &NoBenefit>,
    parameters: &[EstimatedParameter],
    stages: &[StageError; 3],
    options: &Options,
) -> Verdict {
    let mut verdict = VerdictBuilder::default();
    if fitted.termination().is_converged() {
        verdict.note(CONVERGED);
    } else {
        verdict.fail(format!("the fit did not converge: {}", fitted.termination()));
    }
    if stages[2].blocks.rmse > stages[1].blocks.rmse * 1.05 && stages[2].random.rmse > stages[1].random.rmse {
        verdict.fail(format!(
            "the held-out error is {:.3} mm with the findings, but {:.3} mm with geometry alone",
            stages[2].random.rmse, stages[1].random.rmse
        ));
    }
    verdict.check_links(parameters, &options.arm_tolerance, LINK_Z);
    verdict.check_held_out(stages[0].random.rmse, stages[2].random.rmse);
    verdict.check_benefit(benefit, sensor);
    if let Some(unseen_target) = unseen_target {
        verdict.note(unseen_target);
    }
    verdict.check_limits(&options.limits, &stages[2].random);
    verdict.build()
}
