//! The whole diagnosis of one data set.

use std::cell::OnceCell;

use super::cause::Cause;
use super::cause_kind::CauseKind;
use super::data_quality::single_angles;
use super::decision;
use super::extension::{Extended, Subject};
use super::finding::{
    Confidence, DiagnoseError, DiagnosedRows, Diagnosis, Finding, Fits, RangeNoise, SCHEMA, Stage,
};
use super::handover::{Handover, WrittenModel, too_many_aside};
use super::merged;
pub use super::options::Options;
use super::other_gravity::OtherGravity;
use super::picture::Picture;
use super::preparation::{Prepared, prepare};
use super::residual_tests;
use super::search::{Confirmed, Search, SearchContext};
use super::selection::is_same_effect;
use super::summary::{self, Summary};
use super::testability::not_testable;
use super::validation::{StageError, nominal};
use super::words;
use crate::identification::benefit::Benefit;
use crate::identification::beyond_noise::BeyondNoise;
use crate::identification::calibration::Frames;
use crate::identification::fit::{
    OTHER_ARM_MM, OUTLIER_SHARE, Observations, WRONG_ORIENTATION_RAD, frame_parameters,
    median_orientation_error,
};
use crate::identification::misreading;
use crate::identification::mixed_rows::{MixedRows, mixed_rows};
use crate::identification::shifted_rows;
use crate::identification::start::count_distinct_poses;
use crate::identification::tolerance::Tolerance;
use crate::measurement::dataset::Dataset;
use crate::measurement::split;
use truegrind_arm::effect::Effect;
use truegrind_arm::estimated::{Estimated, StageErrors};
use truegrind_arm::model::Model;
use truegrind_arm::parameter::arm_parameters;
use truegrind_math::statistics::ErrorSummary;

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
    let observed = &prepared.observed;
    let subject =
        Subject { observed, nominal: nominal_arm, frames, evaluated_at: frames, tolerance: &tolerance };
    let registered = nominal(&subject);
    let fitted_frames = registered.frames.clone();
    let subject = Subject { evaluated_at: &fitted_frames, ..subject };
    refuse_other_arm(dataset, robot, &registered, &subject)?;
    let needed = poses_needed_at_least(dataset, nominal_arm);
    let thin_rows = thin_rows(&prepared.observed);
    let searched = Subject { observed: thin_rows.as_ref().unwrap_or(&prepared.observed), ..subject };
    let context = SearchContext { dataset, prepared: &prepared, subject, searched, options, progress };
    let most = if needed.is_some() { 0 } else { options.selection.most };
    let mut search = Search::run(&context, registered, most);
    refuse_other_rows(&search, robot)?;
    search.drop_unvalidated_causes();
    progress("stability selection in halves of the rows");
    let mut confirmed = search.confirm();
    search.purge_validation(&mut confirmed);
    let left_mm = ErrorSummary::of(search.full_fit.problem.errors_mm(&search.full_fit.x)).rmse;
    let mixed = mixed_rows(&prepared.observed, nominal_arm, frames, &options.arm_tolerance, left_mm);
    let structure = residual_tests::structure(&subject, &search.full_fit, &search.set_aside);
    let smoothed = search.fit_smooth_correction(&structure);
    let summary = summary::summarise(&search, &confirmed, &structure, (smoothed, needed.is_some()));
    let few_poses = needed.map(|needed| few_poses_note(dataset, needed));
    let mut notes: Vec<String> = few_poses.iter().cloned().collect();
    notes.append(&mut search.notes);
    notes.extend(confirmed.other_gravity.as_ref().map(OtherGravity::note));
    if !search.set_aside.is_empty() {
        notes.extend(shifted_rows::note(dataset, &search.full_fit.model, &search.full_fit.frames));
    }
    let mut finding_of_cause = vec![0; search.searched_fit.causes.len()];
    for (index, merged) in summary.findings.iter().enumerate() {
        merged.causes.iter().for_each(|&k| finding_of_cause[k] = index);
    }
    let certain =
        merged::certain_flags(&summary.findings, &confirmed.outcome.confirmations, &search.full_fit.causes);
    let (extended, scatter) = (summary.extended.clone(), summary.joint_scatter.clone());
    let all_causes = &search.errors.with_causes;
    let all_causes = StageErrors { fitted: all_causes.fitted, held_out: all_causes.random };
    let parameters = extended.parameters.len();
    let mut beyond = BeyondNoise::of(&all_causes, parameters, dataset.sensor, summary.repeats.as_ref())
        .less_rounding(summary.noise_floor.0, dataset.sensor);
    if let Some(rounded) = &summary.rounded_log {
        beyond = beyond.beside_rounded_log(rounded, summary.repeats.as_ref(), dataset.sensor);
    }
    let (is_log_rounded, repeats) = (summary.rounded_log.is_some(), summary.repeats);
    let (mut diagnosis, pictures) = build_diagnosis(&search, &confirmed, summary, robot, notes);
    diagnosis.poses_needed = needed;
    let handover = Handover {
        search: &search,
        robot,
        discrepancy: thin_rows.is_none().then_some(&confirmed.outcome.discrepancy),
        scatter,
        noise_floor_mm: diagnosis.noise_floor_mm,
        beyond_noise: beyond,
        is_log_rounded,
        repeats,
        few_poses,
        identified: OnceCell::new(),
        mixed: mixed.as_ref().map(MixedRows::sentence),
    };
    let WrittenModel { estimated, benefit } = handover.arm(&certain, &mut diagnosis.notes);
    diagnosis.verdict = Some(estimated.verdict.clone());
    for (k, finding) in diagnosis.findings.iter_mut().enumerate() {
        let own = (0..finding_of_cause.len()).filter(|&cause| finding_of_cause[cause] == k);
        let effects = own.filter_map(|cause| match &search.searched_fit.causes[cause] {
            Cause::Arm(effect) => Some(effect.clone()),
            fault => fault.effect(),
        });
        say_whether_corrected(finding, effects, &estimated);
    }
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

/// States whether the written arm has the `effects` of a finding, and what to do where it has not: an effect of size 0 corrects nothing. A
/// finding bears the name of its first effect; of further terms those that are not certain may be missing.
fn say_whether_corrected(
    finding: &mut Finding,
    mut effects: impl Iterator<Item = Effect>,
    estimated: &Estimated,
) {
    if finding.effect == CauseKind::SmallDisturbances {
        return;
    }
    let is_written = |effect: Effect| {
        estimated.model.effects.iter().any(|other| is_same_effect(&effect, other) && !other.is_zero())
    };
    let Some(corrected) = effects.next().map(is_written) else { return };
    finding.corrected = Some(corrected);
    if !corrected {
        finding.remedy = words::remedy_left_out(finding.effect, finding.confidence == Confidence::Ambiguous);
    } else if !effects.all(is_written) {
        finding
            .remedy
            .push_str("; the written model lacks a further term of this cause, which is not certain");
    }
}

/// Refuses readings that no arm with this data sheet makes.
fn refuse_other_arm(
    dataset: &Dataset,
    robot: &str,
    registered: &Extended,
    subject: &Subject<'_>,
) -> Result<(), DiagnoseError> {
    let (file, robot) = (dataset.file.clone(), robot.to_owned());
    let errors = registered.problem.errors_mm(&registered.x);
    if !(residual_tests::median_error_mm(registered) < OTHER_ARM_MM) {
        let rmse_mm = ErrorSummary::of(errors).rmse;
        let explanation = misreading::explanation(dataset, subject.nominal);
        return Err(DiagnoseError::WrongArm { file, robot, rmse_mm, explanation });
    }
    // Most rows may fit and a good part be of other poses: where that is more than `identify` sets aside, and something explains it, it is no
    // cause to search for.
    let strange = errors.iter().filter(|error| !(error.abs() < OTHER_ARM_MM)).count();
    if strange as f64 > OUTLIER_SHARE * errors.len() as f64
        && let Some(explanation) = misreading::explanation(dataset, subject.nominal)
    {
        let rmse_mm = ErrorSummary::of(errors).rmse;
        return Err(DiagnoseError::WrongArm { file, robot, rmse_mm, explanation: Some(explanation) });
    }
    let turned = median_orientation_error(subject.observed, &registered.model, &registered.frames);
    match turned.filter(|rad| *rad > WRONG_ORIENTATION_RAD) {
        Some(rad) => Err(DiagnoseError::WrongOrientation { file, robot, deg: rad.to_degrees() }),
        None => Ok(()),
    }
}

/// Refuses rows of which no search made one arm's: the error that all causes leave is none that an arm has, or so many rows are set aside that
/// are off by so much. What fits the others is then chance, or another set-up than that of the rest.
fn refuse_other_rows(search: &Search<'_>, robot: &str) -> Result<(), DiagnoseError> {
    let dataset = search.context.dataset;
    let errors = search.full_fit.problem.errors_mm(&search.full_fit.x);
    let of_aside = ErrorSummary::of(search.set_aside.iter().map(|&row| errors[row]));
    let left_mm = search.errors.with_causes.fitted.rmse;
    let is_of_another = too_many_aside(search.set_aside.len(), errors.len()) && of_aside.rmse > OTHER_ARM_MM;
    if left_mm < OTHER_ARM_MM && !is_of_another {
        return Ok(());
    }
    Err(DiagnoseError::WrongArm {
        file: dataset.file.clone(),
        robot: robot.to_owned(),
        rmse_mm: ErrorSummary::of(errors).rmse,
        explanation: misreading::explanation(dataset, search.context.subject.nominal),
    })
}

/// Says that there are too few poses.
fn few_poses_note(dataset: &Dataset, needed: usize) -> String {
    format!(
        "{} rows at {} distinct poses are too few to separate effects from geometry: at least {needed} poses are needed (`truegrind plan` \
         chooses 60); these results depend on the priors",
        dataset.rows.len(),
        count_distinct_poses(dataset, usize::MAX)
    )
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
    let noise = residual_tests::noise_model(subject, &search.full_fit, set_aside);
    let kinds: Vec<CauseKind> = search.searched_fit.causes.iter().map(|c| c.kind()).collect();
    let rows = &searched.observed.dataset;
    let not_testable = not_testable(rows, &confirmed.whole.design, &search.left, &kinds, prepared);
    if let Err(why) = &prepared.readout_fusion
        && dataset.angle_step_rad.is_some()
        && let crate::identification::rounding::NotFused::Mismatch { found_mm, expected_mm } = why
    {
        notes.push(format!(
            "the read-out deviates from the angles by {found_mm:.2} mm, and rounding allows {expected_mm:.2} mm: it was not fused with them"
        ));
    }
    notes.extend(single_angles(dataset));
    if prepared.sides_from_order
        && search.searched_fit.causes.iter().any(|c| matches!(c, Cause::Arm(Effect::Backlash(_))))
    {
        notes.push(
            "the sides of approach were not logged (columns approach1 to approach6): backlash was judged as if the arm had come \
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
    let question = decision::DecisionQuestion {
        robot,
        sensor: dataset.sensor,
        frames: &search.full_fit.frames,
        something_else: summary.something_else.as_ref(),
    };
    question.complete(&mut findings);
    let diagnosis = Diagnosis {
        schema: SCHEMA.to_owned(),
        verdict: None,
        dataset: DiagnosedRows {
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
    let stage = |errors: &StageError, fit: &Extended| Stage {
        rmse_mm: errors.fitted.rmse,
        mean_mm: errors.fitted.mean_absolute,
        max_mm: errors.fitted.max,
        cv_rmse_mm: errors.random.rmse,
        cv_blocks_rmse_mm: errors.blocks.rmse,
        cv_regions_rmse_mm: search.validation.over_regions(fit).rmse,
    };
    let errors = &search.errors;
    Fits {
        nominal: stage(&errors.registered, &search.registered),
        geometric: stage(&errors.geometric, &search.geometric),
        extended: stage(&errors.with_causes, &search.full_fit),
    }
}
