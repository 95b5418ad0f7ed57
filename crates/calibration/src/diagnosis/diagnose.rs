//! The whole diagnosis of one data set.

use super::cause::Cause;
use super::discrepancy::Discrepancy;
use super::extension::{Extended, Subject};
use super::finding::{DiagnoseError, Diagnosis, Fits, RangeNoise, SCHEMA, Source, Stage};
use super::in_doubt;
pub use super::options::Options;
use super::picture::Picture;
use super::remaining;
use super::rows::{Prepared, prepare};
use super::search::{Confirmed, Ground, Search};
use super::selection::already;
use super::sensor_causes::{self, chance_worse};
use super::stories;
use super::telling::{self, Told};
use super::testability::not_testable;
use super::validation::{StageError, nominal};
use super::written::{kept, wandered, written};
use crate::identification::benefit::{Benefit, benefit};
use crate::identification::calibration::Frames;
use crate::identification::fit::{Fitted, Observations, frame_parameters};
use crate::identification::identify::{
    arm_covariance, arm_of, mean_condition, parameter_table, sensor_name, with_sigma_in_region,
};
use crate::identification::start::count_distinct_poses;
use crate::identification::tolerance::Tolerance;
use crate::identification::verdict::{Limits, VerdictBuilder};
use crate::measurement::dataset::{Dataset, Sensor};
use crate::measurement::split;
use truegrind_arm::estimated::{Estimated, EstimatedParameter, Judgement, Provenance, StageErrors, Verdict};
use truegrind_arm::model::Model;
use truegrind_arm::parameter::arm_parameters;
use truegrind_arm::region::Region;
use truegrind_estimation::problem::Problem;

/// A diagnosis with the fits behind it.
#[derive(Debug, Clone)]
pub struct Diagnosed {
    /// The result.
    pub diagnosis: Diagnosis,
    /// Geometry alone.
    pub geometric: Extended,
    /// With all causes.
    pub extended: Extended,
    /// The arm for compensation; its verdict says whether it may be used.
    pub estimated: Estimated,
    /// What that arm promises programs; absent where its equations have no solution.
    pub benefit: Option<Benefit>,
    /// The rows as they were fitted.
    pub prepared: Prepared,
    /// Rows set aside, as indices of the data set.
    pub set_aside: Vec<usize>,
    /// Which finding belongs to which cause of the extended model, in their order; several causes may share one.
    pub finding_of_cause: Vec<usize>,
    /// A picture for each finding that has a cause in the model, `None` for the others.
    pub pictures: Vec<Option<Picture>>,
}

/// With frames alone fitted, an error beyond this is no tolerance but a mistake (mm).
const WRONG_ARM_MM: f64 = 25.0;

/// Diagnoses `dataset` of the arm `nominal` (by name `robot`), frames starting at `frames`. `tell` hears of each step.
///
/// # Errors
/// When no fit is possible at all: rows that no arm of this name could give.
pub fn diagnose(
    dataset: &Dataset,
    robot: &str,
    nominal_arm: &Model,
    frames: &Frames,
    options: &Options,
    tell: &(dyn Fn(&str) + Sync),
) -> Result<Diagnosed, DiagnoseError> {
    let prepared = prepare(dataset, nominal_arm, options.fuse_readout);
    let subject =
        Subject { observed: &prepared.observed, nominal: nominal_arm, frames, tolerance: &options.tolerance };
    let registered = nominal(&subject);
    let typical = remaining::typical_mm(&registered);
    if !(typical < WRONG_ARM_MM) {
        return Err(DiagnoseError::WrongArm {
            file: dataset.file.clone(),
            robot: robot.to_owned(),
            rmse_mm: typical,
        });
    }
    let needed = scarce(dataset, nominal_arm);
    let thinned = thinned(&prepared.observed);
    let searched = Subject { observed: thinned.as_ref().unwrap_or(&prepared.observed), ..subject };
    let ground = Ground { dataset, prepared: &prepared, subject, searched, options, tell };
    let most = if needed.is_some() { 0 } else { options.selection.most };
    let mut search = Search::of(&ground, registered, most);
    search.drop_what_does_not_carry_over();
    tell("looking whether the causes come back in halves of the rows");
    let mut confirmed = search.confirm();
    search.hold_out_stretches(&mut confirmed);
    let structure = remaining::structure(&subject, &search.extended, &search.set_aside);
    let smoothed = search.smooth(&structure);
    let told = telling::told(&search, &confirmed, &structure, smoothed);
    let mut notes = Vec::new();
    if let Some(needed) = needed {
        notes.push(format!(
            "{} rows at {} different poses are too few to tell effects from geometry: at least {needed} poses are needed, some hundred are \
             usual; what is said here rests on the priors",
            dataset.rows.len(),
            count_distinct_poses(dataset, usize::MAX)
        ));
    }
    notes.append(&mut search.notes);
    let mut finding_of_cause = vec![0; search.found.causes.len()];
    for (place, story) in told.stories.iter().enumerate() {
        story.causes.iter().for_each(|&k| finding_of_cause[k] = place);
    }
    let certain = stories::certain(&told.stories, &confirmed.outcome.confirmations);
    let extended = told.extended.clone();
    let (mut diagnosis, pictures) = summed_up(&search, &confirmed, told, robot, notes);
    diagnosis.poses_needed = needed;
    let of_all = thinned.is_none().then_some(&confirmed.outcome.discrepancy);
    let proven = proven(&search, &certain, of_all);
    let ((written, written_stage), chance) = undisturbed(&search, proven, of_all);
    diagnosis.notes.extend(chance.map(|chance| {
        format!(
            "the arm is written as fitted without the causes of the measurement: beside them its shape would be worse with a \
             probability of {:.0} %, where {:.0} % is allowed",
            100.0 * chance,
            100.0 * sensor_causes::MOST
        )
    }));
    let handed = handed_on(&search, &written, of_all);
    let [before, geometry, _] = search.stages;
    let stages = [before, geometry, written_stage];
    let fits = [&written, handed.as_ref().unwrap_or(&written)].map(Fitted::from);
    let (estimated, benefit) = estimated(&ground, robot, &fits, &stages, &diagnosis, &search.set_aside);
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

/// The arm for compensation, with its errors: its causes only where they are worth it on rows that were held out, at random and in
/// blocks. Programs are moved by what is proven in this very model, not beside the causes that it leaves out.
fn proven(
    search: &Search<'_>,
    certain: &[bool],
    discrepancy: Option<&Discrepancy>,
) -> (Extended, StageError) {
    let subject = &search.ground.subject;
    let of = |certain: &[bool]| {
        let fit = written(subject, &search.extended, &kept(&search.extended, certain), discrepancy);
        let errors = search.validation.stage(&fit);
        (fit, errors)
    };
    let (fit, errors) = of(certain);
    let of_the_arm = |cause: &Cause| matches!(cause, Cause::Arm(_));
    let better =
        |than: &StageError| errors.random.rmse < than.random.rmse && errors.blocks.rmse < than.blocks.rmse;
    let arm_alone = fit.causes.iter().all(of_the_arm);
    if !fit.causes.iter().any(of_the_arm) || arm_alone && better(&search.stages[1]) {
        return (fit, errors);
    }
    let causes = &search.extended.causes;
    let without: Vec<bool> =
        certain.iter().zip(causes).map(|(sure, cause)| *sure && !of_the_arm(cause)).collect();
    let plain = of(&without);
    if better(&plain.1) { (fit, errors) } else { plain }
}

/// The arm that is proven, or, with the reason, the same fitted without the causes of the measurement, where too little speaks for a
/// better arm beside them.
fn undisturbed(
    search: &Search<'_>,
    proven: (Extended, StageError),
    discrepancy: Option<&Discrepancy>,
) -> ((Extended, StageError), Option<f64>) {
    let of_the_arm: Vec<Cause> =
        proven.0.causes.iter().filter(|cause| matches!(cause, Cause::Arm(_))).cloned().collect();
    if of_the_arm.len() == proven.0.causes.len() && wandered(discrepancy).is_none() {
        return (proven, None);
    }
    let Ground { dataset, subject, .. } = search.ground;
    let without = written(subject, &search.extended, &of_the_arm, None);
    let samples = Region::of(subject.observed.dataset.rows.iter().map(|row| &row.joints), 0.0).samples_deg;
    let beside = in_doubt::beside(&without, proven.0.clone());
    match chance_worse(&proven.0, &beside, &mean_condition(dataset), &samples) {
        Some(chance) if chance > sensor_causes::MOST => {
            let errors = search.validation.stage(&without);
            ((without, errors), Some(chance))
        }
        _ => (proven, None),
    }
}

/// The written arm with what was found beside it; `None` where all of that is written.
fn handed_on(search: &Search<'_>, fit: &Extended, discrepancy: Option<&Discrepancy>) -> Option<Extended> {
    let all = in_doubt::all(&search.extended.causes, &search.accepted);
    let missing = |cause: &Cause| !already(&fit.causes, cause);
    all.iter()
        .any(missing)
        .then(|| in_doubt::beside(fit, written(&search.ground.subject, &search.extended, &all, discrepancy)))
}

/// The diagnosis in the contract's terms, and a picture for each finding that has one.
fn summed_up(
    search: &Search<'_>,
    confirmed: &Confirmed,
    told: Told,
    robot: &str,
    mut notes: Vec<String>,
) -> (Diagnosis, Vec<Option<Picture>>) {
    let Ground { dataset, prepared, subject, searched, .. } = search.ground;
    let (stages, set_aside) = (&search.stages, &search.set_aside);
    let noise = remaining::noise_model(subject, &search.extended, set_aside);
    let names: Vec<String> = search.found.causes.iter().map(|c| c.name().to_owned()).collect();
    let rows = &searched.observed.dataset;
    let not_testable = not_testable(rows, &confirmed.whole.design, &search.left, &names, prepared);
    if let Err(why) = &prepared.readout_fusion
        && dataset.angle_step_rad.is_some()
        && let crate::identification::rounding::NotFused::Mismatch { found_mm, expected_mm } = why
    {
        notes.push(format!(
            "the read-out is {found_mm:.2} mm off the angles where rounding allows {expected_mm:.2}: angles were not sharpened"
        ));
    }
    let mut measure_again: Vec<usize> = set_aside
        .iter()
        .chain(prepared.mismatch.rows.iter().map(|(i, _)| i))
        .map(|&i| dataset.rows[i].number)
        .collect();
    measure_again.sort_unstable();
    measure_again.dedup();
    let (findings, pictures) = told.stories.into_iter().map(|s| (s.finding, s.picture)).unzip();
    let diagnosis = Diagnosis {
        schema: SCHEMA.to_owned(),
        verdict: None,
        dataset: Source {
            file: dataset.file.clone(),
            rows: dataset.rows.len(),
            sensor: sensor_name(dataset.sensor).to_owned(),
            robot: robot.to_owned(),
            set_aside: set_aside.len(),
        },
        noise_floor_mm: told.noise_floor.0,
        noise_floor_source: told.noise_floor.1,
        fits: Fits { nominal: stage(&stages[0]), geometric: stage(&stages[1]), extended: stage(&stages[2]) },
        steps: told.steps,
        findings,
        not_testable,
        remaining: told.remaining,
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

/// Scalar rows in which causes are looked for, at most.
const SEARCHED: usize = 9_000;

/// Rows of a very long data set, drawn by their angles; `None` for one that is searched whole.
fn thinned(observed: &Observations) -> Option<Observations> {
    let dataset = &observed.dataset;
    let per = match dataset.sensor {
        Sensor::Cable => 1,
        Sensor::Position => 3,
        Sensor::Pose => 6,
    };
    let most = SEARCHED / per;
    (dataset.rows.len() > most).then(|| {
        // Not every so many rows: one row less would then be another choice of all that follow it.
        let all = (0..dataset.rows.len()).map(|i| vec![i]).collect();
        let mut rows = split::shuffled_by_angles(dataset, all, 0).concat();
        rows.truncate(most);
        rows.sort_unstable();
        observed.subset(&rows)
    })
}

/// Poses needed, where there are too few.
fn scarce(dataset: &Dataset, nominal: &Model) -> Option<usize> {
    let per = match dataset.sensor {
        Sensor::Cable => 1,
        Sensor::Position => 3,
        Sensor::Pose => 6,
    };
    let parameters = arm_parameters(nominal).len() + frame_parameters(dataset).len();
    let needed = (3 * parameters).div_ceil(2 * per) + 10;
    (count_distinct_poses(dataset, needed) < needed).then_some(needed)
}

fn stage(errors: &StageError) -> Stage {
    Stage {
        rmse_mm: errors.fitted.rmse,
        mean_mm: errors.fitted.mean_absolute,
        max_mm: errors.fitted.max,
        cv_rmse_mm: errors.random.rmse,
        cv_blocks_rmse_mm: errors.blocks.rmse,
    }
}

/// The arm for compensation, and what it promises programs: the fit that is written, and the same as it is handed on.
fn estimated(
    ground: &Ground<'_>,
    robot: &str,
    [fitted, handed]: &[Fitted; 2],
    stages: &[StageError; 3],
    diagnosis: &Diagnosis,
    set_aside: &[usize],
) -> (Estimated, Option<Benefit>) {
    let Ground { dataset, prepared, subject, options, .. } = ground;
    let nominal_arm = subject.nominal;
    let order = arm_of(handed);
    let estimated = Estimated {
        robot: robot.to_owned(),
        nominal: nominal_arm.clone(),
        model: handed.model.clone(),
        covariance: arm_covariance(handed),
        order,
        provenance: Provenance {
            file: dataset.file.clone(),
            sha256: dataset.sha256.clone(),
            rows: dataset.rows.len() - set_aside.len(),
            set_aside: set_aside.iter().map(|&i| dataset.rows[i].number).collect(),
            sensor: sensor_name(dataset.sensor).to_owned(),
            method: "diagnose".to_owned(),
            seed: options.selection.seed,
            held_out: 0.2,
            sharpened: prepared.readout_fusion.is_ok(),
            version: env!("CARGO_PKG_VERSION").to_owned(),
        },
        parameters: parameter_table(handed, nominal_arm)
            .into_iter()
            .filter(|p| p.name.starts_with("link") || p.name.starts_with("effect"))
            .collect(),
        registered: StageErrors { fitted: stages[0].fitted, held_out: stages[0].random },
        geometry: StageErrors { fitted: stages[2].fitted, held_out: stages[2].random },
        noise_floor_mm: diagnosis.noise_floor_mm,
        verdict: Verdict { status: Judgement::NotEvaluated, reasons: Vec::new() },
        region: Region::of(subject.observed.dataset.rows.iter().map(|row| &row.joints), 0.0),
        condition: mean_condition(dataset),
    };
    let mut estimated = with_sigma_in_region(estimated, handed);
    let rows = &subject.observed.dataset;
    // Links and what the model promises are held against the tolerance of arms, not against the wide priors of a diagnosis.
    let plausible = Tolerance::default();
    let benefit = benefit(fitted, rows, &estimated, &plausible, variance_inflation(fitted, rows, &stages[2]));
    let parameters = parameter_table(fitted, nominal_arm);
    estimated.verdict = judge(fitted, rows.sensor, benefit.as_ref(), &parameters, stages, &options.limits);
    (estimated, benefit)
}

/// Every verdict of an identification, and that findings may not make geometry worse.
fn judge(
    fitted: &Fitted,
    sensor: Sensor,
    benefit: Option<&Benefit>,
    parameters: &[EstimatedParameter],
    stages: &[StageError; 3],
    limits: &Limits,
) -> Verdict {
    let mut verdict = VerdictBuilder::default();
    if fitted.termination().is_converged() {
        verdict.note("the fit converged");
    } else {
        verdict.fail(format!("the fit did not converge: {}", fitted.termination()));
    }
    if stages[2].blocks.rmse > stages[1].blocks.rmse * 1.05 && stages[2].random.rmse > stages[1].random.rmse {
        verdict.fail(format!(
            "with the findings the held-out error is {:.3} mm, geometry alone has {:.3}",
            stages[2].random.rmse, stages[1].random.rmse
        ));
    }
    verdict.check_links(parameters, &Tolerance::default(), SURE);
    verdict.check_held_out(stages[0].random.rmse, stages[2].random.rmse);
    verdict.check_benefit(benefit, sensor);
    verdict.check_limits(limits, &stages[2].random);
    verdict.build()
}

/// With its wide priors a link that the rows hardly see is believed off only beyond this many standard deviations.
const SURE: f64 = 2.0;

/// How many times larger than it should be the square of the held-out error is: with k parameters determined by n readings
/// it is (n + k) / (n − k) times that of the fit.
fn variance_inflation(fitted: &Fitted, dataset: &Dataset, errors: &StageError) -> f64 {
    let per = fitted.problem.rows_per_observation();
    let n = (dataset.rows.len() * per) as f64;
    let shares = fitted.sigmas().into_iter().zip(&fitted.priors);
    let spent: f64 = shares.map(|(s, p)| (1.0 - (s / p.sigma).powi(2)).clamp(0.0, 1.0)).sum();
    let expected = (n + spent) / (n - spent).max(0.05 * n).max(1.0);
    let variance_inflation = (errors.random.rmse / errors.fitted.rmse).powi(2) / expected;
    if variance_inflation.is_finite() { variance_inflation.max(1.0) } else { 1.0 }
}
