//! The arm that a diagnosis hands over to compensation: which causes it has, what it lacks, its expected benefit and its verdict.

use super::cause::Cause;
use super::discrepancy::Discrepancy;
use super::extension::Extended;
use super::in_doubt;
use super::joint_scatter::JointScatter;
use super::law_error;
use super::link_geometry::LINK_Z;
use super::options::Options;
use super::play_flanks;
use super::search::{Search, SearchContext};
use super::selection::contains_cause;
use super::sensor_causes::{self, Apart, apart};
use super::validation::{ErrorsByStage, StageError};
use super::written_model::{fit_written, time_discrepancy, under_correlated_noise, written_causes};
use crate::identification::benefit::{Benefit, NoBenefit, benefit};
use crate::identification::beyond_noise::{BeyondNoise, joint_errors_rad};
use crate::identification::calibration::Frames;
use crate::identification::fit::Fitted;
use crate::identification::identify::{
    self, Identification, IdentifyError, arm_covariance, arm_parameters_of, fit_geometry,
    learned_width_uncertainty, median_condition, with_sigma_in_region,
};
use crate::identification::inflation::inflation_from_errors;
use crate::identification::linearised_readings::widen_by_scale;
use crate::identification::parameter_table::parameter_table;
use crate::identification::tolerance::Tolerance;
use crate::identification::unseen_target::unseen_target;
use crate::identification::verdict::VerdictBuilder;
use crate::measurement::dataset::{Dataset, Sensor};
use crate::measurement::noise_floor::NoiseFloor;
use crate::measurement::split::{self, Split};
use nalgebra::{DMatrix, DVector};
use std::cell::OnceCell;
use std::f64::consts::FRAC_1_SQRT_2;
use truegrind_arm::estimated::{
    Estimated, EstimatedParameter, Judgement, Provenance, Reason, ReasonKind, StageErrors, Verdict,
};
use truegrind_arm::model::Model;
use truegrind_arm::parameter::Parameter;
use truegrind_arm::region::Region;
use truegrind_estimation::estimate::Estimate;
use truegrind_estimation::problem::Problem;

/// What is needed to hand over an arm.
pub(super) struct Handover<'a> {
    pub(super) search: &'a Search<'a>,
    /// Name of the robot.
    pub(super) robot: &'a str,
    /// That of all rows, if all were searched.
    pub(super) discrepancy: Option<&'a Discrepancy>,
    /// A scatter about a joint.
    pub(super) scatter: Option<JointScatter>,
    /// The noise floor of sensor and rounding (mm).
    pub(super) noise_floor_mm: Option<f64>,
    /// What all causes leave beyond the scatter of repeated poses.
    pub(super) beyond_noise: BeyondNoise,
    /// Whether the log rounds the angles.
    pub(super) is_log_rounded: bool,
    /// The scatter of repeated poses, where enough were repeated.
    pub(super) repeats: Option<NoiseFloor>,
    /// Says that there are too few poses.
    pub(super) few_poses: Option<String>,
    /// The geometry of `identify`, once it was asked for.
    pub(super) identified: OnceCell<Option<Fitted>>,
    /// Says that the rows are those of two arms.
    pub(super) mixed: Option<String>,
}

/// The arm for compensation.
pub(super) struct WrittenModel {
    pub(super) estimated: Estimated,
    /// Absent where it cannot be stated.
    pub(super) benefit: Option<Benefit>,
}

/// A fit under the tolerances of arms, with its errors.
struct WrittenFit {
    fit: Extended,
    errors: StageError,
}

/// What an arm for compensation is made of.
struct WrittenArm<'a> {
    /// The fit that is written.
    fitted: &'a Extended,
    /// The same with uncertain causes of size 0, whose uncertainty it is written with.
    with_uncertain: &'a Extended,
    /// Errors of the written fit.
    errors: StageError,
    /// Errors of the fit with the certain causes of the measurement: what it lacks beyond the errors with all causes is the arm's, and
    /// what a fit without the causes of the measurement lacks beyond that is not.
    beside_sensor: StageError,
    /// The fit with the causes of the measurement, where it is not written.
    left_out: Option<&'a LeftOut>,
}

impl Handover<'_> {
    /// The arm with the causes that are `certain`, or with fewer of them, as the notes say.
    pub(super) fn arm(&self, certain: &[bool], notes: &mut Vec<String>) -> WrittenModel {
        if let Some(same) = self.identified_from_few_poses() {
            return same;
        }
        let (search, discrepancy) = (self.search, self.discrepancy);
        let certain = certain_model(search, certain, discrepancy);
        let beside_sensor = certain.errors;
        let (WrittenFit { fit, errors }, left_out) = without_measurement_causes(search, certain, discrepancy);
        let fit = if fit.causes.is_empty() { self.as_identified(&fit).unwrap_or(fit) } else { fit };
        notes.extend(left_out.as_ref().map(|LeftOut { apart, .. }| {
            format!(
                "the written arm was fitted without the causes in the measurement, which might make its links worse (probability \
                 {:.0} %, at most {:.0} % are allowed)",
                100.0 * apart.probability_worse,
                100.0 * sensor_causes::MAX_PROBABILITY
            )
        }));
        let left_out = left_out.as_ref();
        let with_uncertain = with_uncertain_causes(search, &fit, discrepancy);
        let with_causes = self.estimated(&WrittenArm {
            with_uncertain: with_uncertain.as_ref().unwrap_or(&fit),
            fitted: &fit,
            errors,
            beside_sensor,
            left_out,
        });
        self.or_geometry_alone(with_causes, beside_sensor, left_out, notes)
    }

    /// From too few poses to search causes in, the arm, benefit and verdict of `identify`, which fits the same rows. `None` where it refuses them.
    fn identified_from_few_poses(&self) -> Option<WrittenModel> {
        self.few_poses.as_ref().filter(|_| self.search.full_fit.causes.is_empty())?;
        let Identification { mut estimated, benefit, .. } =
            as_identify(self.search.context, self.robot, identify::identify)?;
        estimated.provenance.method = "diagnose".to_owned();
        Some(WrittenModel { estimated, benefit })
    }

    /// The written arm with its benefit, or geometry alone (with a note) if only that is not refused.
    ///
    /// A cause whose law is only nearly right can drive links that the rows determine through it alone: where links warm up unequally,
    /// a common growth is met by a link of another length whose constant part the frames take up.
    fn or_geometry_alone(
        &self,
        with_causes: WrittenModel,
        beside_sensor: StageError,
        left_out: Option<&LeftOut>,
        notes: &mut Vec<String>,
    ) -> WrittenModel {
        let verdict = &with_causes.estimated.verdict;
        if verdict.status != Judgement::Fail || self.search.full_fit.causes.is_empty() {
            return with_causes;
        }
        let Some(plain) = self.as_identified(&written(self.search, &[], None)) else { return with_causes };
        // An arm that is refused as implausible does not say how far this one may be off.
        let alone = self.estimated(&WrittenArm {
            fitted: &plain,
            with_uncertain: &plain,
            errors: self.search.validation.stage(&plain),
            beside_sensor,
            left_out,
        });
        if !matches!(alone.estimated.verdict.status, Judgement::Pass | Judgement::NotEvaluated) {
            return with_causes;
        }
        notes.push(format!(
            "the written arm is geometry alone, as `identify` fits it, since the arm with causes was refused: {}",
            verdict.reasons.first().map_or("it is implausible", |reason| reason.text.as_str())
        ));
        alone
    }

    /// A written arm without causes, with the estimate of `identify`: what names nothing should not write another geometry. `None` where
    /// that fit has other parameters or failed.
    fn as_identified(&self, written: &Extended) -> Option<Extended> {
        let Fitted { parameters, priors, estimate, model, frames, problem, .. } = self
            .identified
            .get_or_init(|| Some(as_identify(self.search.context, self.robot, fit_geometry)?.fitted))
            .as_ref()?;
        let place = |p| parameters.iter().position(|q| q == p);
        let places = written.parameters.iter().map(place).collect::<Option<Vec<usize>>>()?;
        // Rows that it rejects are few: those left count as consecutive.
        let numbers: Vec<usize> = (0..problem.rows() / problem.rows_per_observation()).collect();
        let own = estimate.covariance.as_ref()?;
        let own = under_correlated_noise(problem, &estimate.x, own, self.discrepancy, &numbers);
        let covariance = DMatrix::from_fn(places.len(), places.len(), |a, b| own[(places[a], places[b])]);
        let x: Vec<f64> = places.iter().map(|&k| estimate.x[k]).collect();
        let priors = places.iter().map(|&k| priors[k]).collect();
        let estimate = Estimate { x: x.clone(), covariance: Some(covariance), ..estimate.clone() };
        Some(Extended {
            priors,
            x,
            model: model.clone(),
            frames: frames.clone(),
            estimate,
            ..written.clone()
        })
    }

    /// The arm for compensation and its expected benefit. What it lacks stands in its covariance. Of too few poses no benefit is stated:
    /// it would be the priors'.
    fn estimated(&self, arm: &WrittenArm<'_>) -> WrittenModel {
        let SearchContext { subject, options, .. } = self.search.context;
        let (nominal, rows) = (subject.nominal, &subject.observed.dataset);
        let [fitted, mut handed] = [arm.fitted, arm.with_uncertain].map(|fit| self.widened(fit));
        if let Some(left_out) = arm.left_out {
            add_shift(&mut handed, arm.fitted, &left_out.fit);
        }
        law_error::add_law_errors(&mut handed);
        let (fitted, handed) = (&fitted, &handed);
        let beyond_noise = self.beyond_noise_of(arm);
        let mut estimated = self.without_verdict(fitted, handed, arm.errors, beyond_noise);
        // What the written arm lacks of the causes stands in its covariance: only what all of them leave comes on top.
        estimated.beyond_noise_rad = self
            .beyond_noise
            .known_mm()
            .and_then(|mm| joint_errors_rad(&estimated, &fitted.frames.flange_from_target, mm));
        if let Some(scatter) = &self.scatter {
            in_doubt::add_joint_scatter(&mut estimated, scatter);
        }
        let mut estimated = with_sigma_in_region(estimated, handed);
        let benefit = match &self.few_poses {
            Some(few) => Err(NoBenefit::FewPoses(few.clone())),
            None => {
                // A scatter about a joint remains with and without correction, as what all causes leave beyond the noise does.
                let scatter_mm = self.scatter.as_ref().map_or(0.0, JointScatter::rms_mm);
                let inflation = inflation_from_errors(fitted, rows, &estimated.calibrated);
                // Links and benefit are judged by the tolerances of arms, not by the wide priors of a diagnosis.
                let stated = options.arm_tolerance;
                let tolerance = Tolerance { scale: stated.scale.and(self.scale_sigma()), ..stated };
                benefit(fitted, rows, &estimated, &tolerance, inflation)
                    .map(|benefit| benefit.with_unmodelled(beyond_noise.at_least_scatter(scatter_mm)))
                    .map(|benefit| benefit.with_shift(arm.left_out.map_or(0.0, |out| out.apart.shape_mm)))
            }
        };
        estimated.verdict = judge(&Judged {
            fitted,
            parameters: &parameter_table(fitted, nominal),
            benefit: benefit.as_ref(),
            sensor: rows.sensor,
            unseen_target: unseen_target(handed, &self.kept_rows(), &estimated),
            errors: self.errors(arm.errors),
            set_aside: (self.search.set_aside.len(), rows.rows.len()),
            mixed: self.mixed.as_deref(),
            options,
        });
        WrittenModel { estimated, benefit: benefit.ok() }
    }

    /// The rows that were not set aside.
    fn kept_rows(&self) -> Dataset {
        let rows = &self.search.context.subject.observed.dataset;
        let kept: Vec<usize> =
            (0..rows.rows.len()).filter(|row| !self.search.set_aside.contains(row)).collect();
        rows.subset(&kept)
    }

    /// A fit with the uncertainty of the sensor's scale.
    fn widened(&self, fit: &Extended) -> Fitted {
        let mut fitted = Fitted::from(fit);
        if let Some(sigma) = self.scale_sigma() {
            widen_by_scale(&mut fitted, &self.search.context.subject.observed.dataset, sigma);
        }
        fitted
    }

    /// Uncertainty of the sensor's scale: the stated one, or what a step of the scale shows. Of two sensors that differ by s either may be
    /// right: with equal variances, the first is wrong by −s/2 ± s/2, in root mean square s/√2.
    fn scale_sigma(&self) -> Option<f64> {
        let steps = self.search.full_fit.causes.iter().filter_map(Cause::scale_step);
        let shown = steps.map(|step| step.abs() * FRAC_1_SQRT_2);
        shown.chain(self.search.context.options.arm_tolerance.scale).reduce(f64::max)
    }

    /// What an arm leaves beyond the noise.
    fn beyond_noise_of(&self, arm: &WrittenArm<'_>) -> BeyondNoise {
        let [all, beside_sensor, own] = [&self.search.errors.with_causes, &arm.beside_sensor, &arm.errors]
            .map(|s| StageErrors { fitted: s.fitted, held_out: s.random });
        let sensor = self.search.context.dataset.sensor;
        let of_arm = self.beyond_noise.of_submodel(&all, &beside_sensor, sensor, true);
        let beyond = of_arm.of_submodel(&beside_sensor, &own, sensor, false);
        // Beside the rounding of a log the difference of two errors is hardly what a cause is worth: the fit itself is asked.
        let asked = self.search.asked_of_rounding(arm.fitted, self.repeats.as_ref());
        match asked.if_rounded().filter(|_| self.is_log_rounded) {
            Some(rounded) => beyond.beside_rounded_log(&rounded, self.repeats.as_ref(), sensor),
            None => beyond,
        }
    }

    /// Errors of the data sheet, of geometry, and of the written fit.
    fn errors(&self, own: StageError) -> ErrorsByStage {
        ErrorsByStage { with_causes: own, ..self.search.errors }
    }

    fn without_verdict(
        &self,
        fitted: &Fitted,
        handed: &Fitted,
        errors: StageError,
        beyond_noise: BeyondNoise,
    ) -> Estimated {
        let SearchContext { dataset, prepared, subject, options, .. } = self.search.context;
        let set_aside = &self.search.set_aside;
        let ErrorsByStage { registered, with_causes, .. } = self.errors(errors);
        Estimated {
            robot: self.robot.to_owned(),
            nominal: subject.nominal.clone(),
            model: handed.model.clone(),
            covariance: arm_covariance(handed),
            width_uncertainty: learned_width_uncertainty(&options.arm_tolerance, fitted),
            order: arm_parameters_of(handed),
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
            parameters: parameter_table(handed, subject.nominal)
                .into_iter()
                .filter(|p| p.is_of_arm())
                .collect(),
            registered: StageErrors { fitted: registered.fitted, held_out: registered.random },
            calibrated: StageErrors { fitted: with_causes.fitted, held_out: with_causes.random },
            noise_floor_mm: self.noise_floor_mm,
            beyond_noise_mm: beyond_noise.known_mm(),
            beyond_noise_rad: None,
            verdict: Verdict { status: Judgement::NotEvaluated, reasons: Vec::new() },
            region: Region::of(subject.observed.dataset.rows.iter().map(|row| &row.joints), 0.0),
            condition: median_condition(dataset),
        }
    }
}

/// A fit as `identify` makes it: of geometry alone, or all of it.
type Identify<T> = fn(
    &Dataset,
    &str,
    &Model,
    &Frames,
    &dyn Fn(&Dataset) -> Split,
    &identify::Options,
) -> Result<T, IdentifyError>;

/// What `identify` makes of the same rows with the options of the diagnosis and beside the same frames.
fn as_identify<T>(context: &SearchContext<'_>, robot: &str, fit: Identify<T>) -> Option<T> {
    let SearchContext { dataset, subject, options, .. } = context;
    let defaults = identify::Options::default();
    let alone = identify::Options {
        tolerance: options.arm_tolerance.with_frames_of(subject.tolerance),
        seed: options.selection.seed,
        fuse_readout: options.fuse_readout,
        limit_rmse_mm: options.limits.rmse_mm,
        limit_max_mm: options.limits.max_mm,
        ..defaults
    };
    let share = |rows: &Dataset| split::random(rows, alone.held_out, alone.seed);
    fit(dataset, robot, subject.nominal, subject.frames, &share, &alone).ok()
}

/// The model with `causes` under the tolerances of the arm.
fn written(search: &Search<'_>, causes: &[Cause], discrepancy: Option<&Discrepancy>) -> Extended {
    let SearchContext { subject, options, .. } = &search.context;
    fit_written(subject, &options.arm_tolerance, &search.full_fit, causes, discrepancy)
}

/// The arm for compensation, with its errors. Its effects are included only if they lower the held-out error of this very model, in
/// random folds and in blocks; causes that are not part of it do not count.
fn certain_model(search: &Search<'_>, certain: &[bool], discrepancy: Option<&Discrepancy>) -> WrittenFit {
    let of = |certain: &[bool]| {
        let SearchContext { dataset, subject, .. } = search.context;
        let causes = &search.full_fit.causes;
        // All causes of the measurement, certain or not, but no zero that may be a play: the arm is not that of the rows on one flank.
        let is_kept = |&k: &usize| {
            let may_be_play = || play_flanks::doubt(causes, k, dataset, subject.nominal).is_some();
            certain.get(k) != Some(&false) || !causes[k].is_in_arm() && !may_be_play()
        };
        let kept = written_causes((0..causes.len()).filter(is_kept).map(|k| &causes[k]));
        let fit = written(search, &kept, discrepancy);
        WrittenFit { errors: search.validation.stage(&fit), fit }
    };
    let found = of(certain);
    let of_the_arm = |cause: &Cause| matches!(cause, Cause::Arm(_));
    let better = |than: &StageError| {
        found.errors.random.rmse < than.random.rmse && found.errors.blocks.rmse < than.blocks.rmse
    };
    let arm_alone = found.fit.causes.iter().all(of_the_arm);
    if !found.fit.causes.iter().any(of_the_arm) || arm_alone && better(&search.errors.geometric) {
        return found;
    }
    let causes = &search.full_fit.causes;
    let without: Vec<bool> =
        certain.iter().zip(causes).map(|(sure, cause)| *sure && !cause.is_in_arm()).collect();
    let plain = of(&without);
    if better(&plain.errors) { found } else { plain }
}

/// A fit with the causes of the measurement that is not written.
struct LeftOut {
    fit: Extended,
    /// From the one that is written.
    apart: Apart,
}

/// Adds to the covariance of a fit how far its links and frames would be from the written ones with the causes of the measurement: these are
/// likely to be right, if not likely enough.
fn add_shift(handed: &mut Fitted, written: &Extended, with_sensor: &Extended) {
    let value = |fit: &Extended, parameter: &Parameter| {
        let index = fit.parameters.iter().position(|other| other == parameter)?;
        Some(fit.x[index])
    };
    let shift = |parameter: &Parameter| {
        let geometric = Some(parameter).filter(|parameter| !parameter.is_of_cause())?;
        Some(value(with_sensor, geometric)? - value(written, geometric)?)
    };
    let shifts = handed.parameters.iter().map(|parameter| shift(parameter).unwrap_or(0.0));
    let shift = DVector::from_iterator(handed.parameters.len(), shifts);
    if let Some(covariance) = &mut handed.estimate.covariance {
        *covariance += &shift * shift.transpose();
    }
}

/// The certain model, or the same fitted without the causes of the measurement if these make a worse arm too probable.
fn without_measurement_causes(
    search: &Search<'_>,
    certain: WrittenFit,
    discrepancy: Option<&Discrepancy>,
) -> (WrittenFit, Option<LeftOut>) {
    let of_the_arm: Vec<Cause> =
        certain.fit.causes.iter().filter(|cause| matches!(cause, Cause::Arm(_))).cloned().collect();
    if of_the_arm.len() == certain.fit.causes.len() && time_discrepancy(discrepancy).is_none() {
        return (certain, None);
    }
    let SearchContext { dataset, subject, .. } = search.context;
    let correlated = discrepancy.filter(|d| d.correlation > 0.0);
    let without = written(search, &of_the_arm, correlated);
    let region = Region::of(subject.observed.dataset.rows.iter().map(|row| &row.joints), 0.0);
    let beside = in_doubt::with_zero_causes(&without, certain.fit.clone());
    match apart(&certain.fit, &beside, &median_condition(dataset), &region) {
        Some(apart) if apart.probability_worse > sensor_causes::MAX_PROBABILITY => {
            let written = WrittenFit { errors: search.validation.stage(&without), fit: without };
            (written, Some(LeftOut { fit: certain.fit, apart }))
        }
        _ => (certain, None),
    }
}

/// The written arm extended by uncertain causes of size 0; `None` if it includes all causes already.
fn with_uncertain_causes(
    search: &Search<'_>,
    fit: &Extended,
    discrepancy: Option<&Discrepancy>,
) -> Option<Extended> {
    let all = written_causes(search.full_fit.causes.iter());
    let missing = |cause: &Cause| !contains_cause(&fit.causes, cause);
    all.iter().any(missing).then(|| in_doubt::with_zero_causes(fit, written(search, &all, discrepancy)))
}

/// What a written arm is judged by.
struct Judged<'a> {
    fitted: &'a Fitted,
    parameters: &'a [EstimatedParameter],
    benefit: Result<&'a Benefit, &'a NoBenefit>,
    sensor: Sensor,
    /// That the poses do not show the target's place on the flange.
    unseen_target: Option<Reason>,
    /// Errors of the data sheet, of geometry, and of the fit.
    errors: ErrorsByStage,
    /// How many rows were set aside, of how many.
    set_aside: (usize, usize),
    /// That the rows are those of two arms.
    mixed: Option<&'a str>,
    options: &'a Options,
}

/// Whether so many rows were set aside (a third) that the others need not be the arm's.
pub(super) fn too_many_aside(aside: usize, rows: usize) -> bool {
    3 * aside >= rows
}

/// The verdict of an identification, plus: a third of the rows must not be set aside, and findings must not raise the held-out error of geometry.
fn judge(case: &Judged<'_>) -> Verdict {
    let mut verdict = VerdictBuilder::default();
    let ErrorsByStage { registered, geometric, with_causes } = &case.errors;
    if case.fitted.termination().is_converged() {
        verdict.note(Reason::new(ReasonKind::Converged, "the fit converged"));
    } else {
        verdict.fail(format!("the fit did not converge: {}", case.fitted.termination()));
    }
    if with_causes.blocks.rmse > geometric.blocks.rmse * 1.05
        && with_causes.random.rmse > geometric.random.rmse
    {
        verdict.fail(format!(
            "the held-out error is {:.3} mm with the findings, but {:.3} mm with geometry alone",
            with_causes.random.rmse, geometric.random.rmse
        ));
    }
    if let Some(mixed) = case.mixed {
        verdict.fail(mixed);
    }
    let (aside, rows) = case.set_aside;
    if too_many_aside(aside, rows) {
        verdict.fail(format!(
            "{aside} of {rows} rows were set aside as outliers, so a model that fits the others need not describe the arm. Check that the sensor \
             stayed where it was (a column station names its places, a column anchor numbers the outlets of a cable), and that each reading belongs to the joint angles beside it"
        ));
    }
    verdict.check_links(case.parameters, &case.options.arm_tolerance, LINK_Z);
    verdict.check_held_out(registered.random.rmse, with_causes.random.rmse);
    verdict.check_benefit(case.benefit, case.sensor);
    if let Some(unseen_target) = &case.unseen_target {
        verdict.note(unseen_target.clone());
    }
    verdict.check_mastering(case.parameters, &case.options.arm_tolerance);
    verdict.check_limits(&case.options.limits, &with_causes.random);
    verdict.build()
}
