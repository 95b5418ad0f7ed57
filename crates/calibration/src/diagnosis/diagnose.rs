//! The whole diagnosis of one data set.

use super::cause::Cause;
use super::confirmation::Confirming;
use super::data_quality::{mismatch_finding, noise_floor, outlier_finding, rounding_finding};
use super::design::Linear;
use super::extension::{Extended, Freedom, Subject, fit};
use super::finding::{DiagnoseError, Diagnosis, Fits, RangeNoise, SCHEMA, Source, Stage, Step};
use super::findings::{Context, told_short};
use super::held::FoldErrors;
use super::picture::Picture;
use super::remaining;
use super::rows::{Prepared, prepare};
use super::selection::{self, Accepted, BLOCKS, Selection};
use super::shadow::{Shadows, beyond_noise_mm};
use super::something_else::Left;
use super::stories::{self, Story};
use super::testability::not_testable;
use super::validation::{StageError, Validation, nominal};
use super::worth::Worth;
use super::written::written;
use crate::identification::benefit::{Benefit, benefit};
use crate::identification::calibration::Frames;
use crate::identification::fit::{Fitted, frame_parameters};
use crate::identification::identify::{
    arm_covariance, arm_of, mean_condition, parameter_table, sensor_name, with_region,
};
use crate::identification::network::with_network;
use crate::identification::start::different_poses;
use crate::identification::tolerance::Tolerance;
use crate::identification::verdict::{Hearing, Limits};
use crate::measurement::dataset::{Dataset, Sensor};
use crate::measurement::sensor::disturbance::{Course, Disturbance};
use crate::measurement::split;
use truegrind_arm::estimated::{Estimated, EstimatedParameter, Judgement, Provenance, StageErrors, Verdict};
use truegrind_arm::model::Model;
use truegrind_arm::parameter::arm_parameters;
use truegrind_arm::region::Region;
use truegrind_estimation::problem::Problem;

/// How to diagnose.
#[derive(Debug, Clone)]
pub struct Options {
    /// Priors of links and frames: wide, so that what geometry can explain is never called an effect.
    pub tolerance: Tolerance,
    /// When a cause is accepted.
    pub selection: selection::Options,
    /// Contiguous blocks of the second validation.
    pub blocks: usize,
    /// Whether a smooth correction may follow what no cause explains.
    pub smooth: bool,
    /// Whether rounded angles are sharpened by the controller's read-out.
    pub fuse_readout: bool,
    /// What the held-out error of the written model (random folds) is held against.
    pub limits: Limits,
}

impl Default for Options {
    fn default() -> Self {
        Self {
            tolerance: Tolerance {
                length_mm: 3.0,
                angle_rad: 1.0_f64.to_radians(),
                zero_rad: 1.0_f64.to_radians(),
                ..Tolerance::default()
            },
            selection: selection::Options::default(),
            blocks: BLOCKS,
            smooth: false,
            fuse_readout: true,
            limits: Limits::default(),
        }
    }
}

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
    let floor = split::noise_floor(dataset);
    let prepared = prepare(dataset, nominal_arm, options.fuse_readout);
    let subject =
        Subject { observed: &prepared.observed, nominal: nominal_arm, frames, tolerance: &options.tolerance };
    let mut notes = Vec::new();
    let needed = scarce(dataset, nominal_arm);
    if let Some(needed) = needed {
        notes.push(format!(
            "{} rows at {} different poses are too few to tell effects from geometry: at least {needed} poses are needed, some hundred are \
             usual; what is said here rests on the priors",
            dataset.rows.len(),
            different_poses(dataset, usize::MAX)
        ));
    }
    let registered = nominal(&subject);
    let typical = remaining::typical_mm(&registered);
    if !(typical < WRONG_ARM_MM) {
        return Err(DiagnoseError::WrongArm {
            file: dataset.file.clone(),
            robot: robot.to_owned(),
            rmse_mm: typical,
        });
    }
    tell("looking for causes");
    let thinned = thinned(&prepared.observed);
    let searched = Subject { observed: thinned.as_ref().unwrap_or(&prepared.observed), ..subject };
    let most = if needed.is_some() { 0 } else { options.selection.most };
    let selection = selection::select(&searched, &selection::Options { most, ..options.selection }, tell);
    let Selection { geometric, extended: mut found, mut accepted, left, families } = selection;
    let (geometric, mut extended) = match &thinned {
        None => (geometric, found.clone()),
        Some(thin) => {
            tell("fitting all rows");
            notes.push(format!(
                "causes were looked for in {} of the {} rows, drawn at random; the fits and their errors are of all rows",
                thin.dataset.rows.len(),
                dataset.rows.len()
            ));
            let causes = to_the_end(&found.causes, &thin.dataset, dataset);
            (
                fit(&subject, &[], Freedom::All, Some(&geometric)),
                fit(&subject, &causes, Freedom::All, Some(&found)),
            )
        }
    };
    let wild = remaining::outliers(&extended);
    let set_aside: Vec<usize> = wild.iter().map(|(i, _)| *i).collect();
    tell("holding rows out");
    let mut validation = Validation::of(&subject, &set_aside, options.selection.seed, options.blocks);
    let mut stages = [&registered, &geometric, &extended].map(|fit| validation.stage(fit));
    // What does not carry over to rows that were not seen together with it is no knowledge.
    while stages[2].blocks.rmse > stages[1].blocks.rmse
        && let Some(weakest) = weakest(&found, &accepted)
    {
        notes.push(format!(
            "{} was dropped again: with it the error on held-out blocks was {:.4} mm, geometry alone has {:.4}",
            told_short(&found.causes[weakest]),
            stages[2].blocks.rmse,
            stages[1].blocks.rmse
        ));
        accepted.remove(weakest);
        extended = without(&subject, &extended, &[weakest]);
        found = if thinned.is_some() { without(&searched, &found, &[weakest]) } else { extended.clone() };
        stages[2] = validation.stage(&extended);
    }
    tell("looking whether the causes come back in halves of the rows");
    let confirm = |found: &Extended, accepted: &[Accepted]| {
        let linear = Linear::of(&searched, found);
        let whole = linear.whole();
        let confirming = Confirming {
            subject: &searched,
            found,
            linear: &linear,
            accepted,
            pool: &left,
            options: &options.selection,
            families,
            sides_from_order: prepared.sides_from_order,
            raw: &whole.design,
        };
        let outcome = confirming.outcome();
        (linear, whole, outcome)
    };
    let (mut linear, mut whole, mut outcome) = confirm(&found, &accepted);
    // Rows of all the data for each one in which causes were looked for.
    let stride = dataset.rows.len().div_ceil(searched.observed.dataset.rows.len().max(1));
    let reach = outcome.discrepancy.reach;
    if reach > 0 {
        tell("holding out stretches of rows, as they resemble those before them");
        notes.push(format!(
            "readings resemble those up to {} rows before them: rows are held out in stretches, with that many rows on either side left out of \
             the fit",
            reach * stride
        ));
        validation = Validation::in_order(
            &subject,
            &set_aside,
            options.selection.seed,
            options.blocks,
            reach * stride,
        );
        stages = [&registered, &geometric, &extended].map(|fit| validation.stage(fit));
        let passing: Vec<usize> = (0..found.causes.len())
            .filter(|&k| found.causes[k].rows().is_some() && !outcome.confirmations[k].is_confirmed())
            .collect();
        if !passing.is_empty() {
            let lasting = without(&subject, &extended, &passing);
            let stage = validation.stage(&lasting);
            let excursions = outcome.discrepancy.correlation > NOISE_ITSELF;
            if excursions || stage.random.rmse < stages[2].random.rmse * PASSING {
                extended = lasting;
                stages[2] = stage;
                found =
                    if thinned.is_some() { without(&searched, &found, &passing) } else { extended.clone() };
                let mut place = 0..;
                accepted.retain(|_| !place.next().is_some_and(|k| passing.contains(&k)));
                (linear, whole, outcome) = confirm(&found, &accepted);
            }
        }
    }
    let structure = remaining::structure(&subject, &extended, &set_aside);
    let mut smoothed = None;
    if options.smooth && remaining::patterned(&structure) {
        tell("fitting a smooth correction to what is left");
        let smooth = smooth_correction(&subject, &extended);
        let stage = validation.stage(&smooth);
        if stage.random.rmse < stages[2].random.rmse && stage.blocks.rmse < stages[2].blocks.rmse {
            smoothed = Some(stages[2].random.rmse);
            (extended, stages[2]) = (smooth, stage);
        } else {
            notes.push(format!(
                "a smooth correction would not carry over: held out {:.4} mm against {:.4} without it, on blocks {:.4} against {:.4}",
                stage.random.rmse, stages[2].random.rmse, stage.blocks.rmse, stages[2].blocks.rmse
            ));
        }
    }
    let mut steps = vec![
        Step { added: "data sheet, frames fitted".to_owned(), cv_rmse_mm: stages[0].random.rmse },
        Step { added: "geometry".to_owned(), cv_rmse_mm: stages[1].random.rmse },
    ];
    let held =
        FoldErrors::of(&linear, &split::purged(&searched.observed.dataset, 5, reach, options.selection.seed));
    let aside: Vec<usize> = if thinned.is_some() { Vec::new() } else { set_aside.clone() };
    let told = extended.clone().whole(&subject);
    let context = Context {
        subject: &searched,
        found: &found,
        extended: &told,
        whole: &whole,
        held: &held,
        set_aside: &aside,
    };
    let (findings, finding_of_cause, pictures) = context.findings(&accepted, &mut steps);
    let worth = Worth::new(&searched, &found, &whole);
    let shadows = Shadows {
        causes: &found.causes,
        confirmations: &outcome.confirmations,
        worth: &worth,
        field_mm: outcome.discrepancy.field_mm(),
        beyond_noise_mm: floor
            .map_or(0.0, |floor| beyond_noise_mm(stages[2].fitted.rmse, floor.sigma_mm, floor.freedom)),
    };
    let mut stories = stories::told(
        stories::of(findings, &finding_of_cause, pictures),
        &outcome.confirmations,
        &outcome.discrepancy,
        &shadows,
        stages[1].fitted.rmse,
    );
    if smoothed.is_some() {
        let added = "smooth correction, without a physical name".to_owned();
        steps.push(Step { added, cv_rmse_mm: stages[2].random.rmse });
    }
    tell("looking at what is left");
    let (floor_mm, floor_source) = noise_floor(&floor, &subject, &extended);
    let rest = Left {
        dataset: &searched.observed.dataset,
        discrepancy: &outcome.discrepancy,
        structure: &structure,
        after: &stages[2],
        smoothed,
        floor_mm,
    };
    let of_the_record = [
        rounding_finding(dataset, &prepared, &subject, &geometric, &stages),
        mismatch_finding(dataset, &prepared, &stages[2]),
        outlier_finding(dataset, &wild, &stages[2]),
        rest.finding(),
    ];
    let without_causes = of_the_record.into_iter().flatten();
    stories.extend(without_causes.map(|finding| Story {
        finding,
        picture: None,
        causes: Vec::new(),
        doubted: Vec::new(),
    }));
    stories::rank(&mut stories);
    let noise = remaining::noise_model(&subject, &extended, &set_aside);
    let names: Vec<String> = found.causes.iter().map(|c| c.name().to_owned()).collect();
    let not_testable = not_testable(&searched.observed.dataset, &whole.design, &left, &names, &prepared);
    let remaining = rest.sentence();
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
    let mut finding_of_cause = vec![0; found.causes.len()];
    for (place, story) in stories.iter().enumerate() {
        story.causes.iter().for_each(|&k| finding_of_cause[k] = place);
    }
    let certain = stories::certain(&stories, &outcome.confirmations);
    let (findings, pictures) = stories.into_iter().map(|s| (s.finding, s.picture)).unzip();
    let mut diagnosis = Diagnosis {
        schema: SCHEMA.to_owned(),
        verdict: None,
        dataset: Source {
            file: dataset.file.clone(),
            rows: dataset.rows.len(),
            sensor: sensor_name(dataset.sensor).to_owned(),
            robot: robot.to_owned(),
            set_aside: set_aside.len(),
        },
        noise_floor_mm: floor_mm,
        noise_floor_source: floor_source,
        fits: Fits { nominal: stage(&stages[0]), geometric: stage(&stages[1]), extended: stage(&stages[2]) },
        steps,
        findings,
        not_testable,
        remaining,
        noise_model: noise.map(|n| RangeNoise {
            sigma_mm: n.sigma_mm,
            per_metre_mm: n.per_metre_mm,
            p_value: n.p_value,
        }),
        measure_again,
        poses_needed: needed,
        transfers: Vec::new(),
        notes,
    };
    let of_all = thinned.is_none().then_some(&outcome.discrepancy);
    let written = written(&subject, &extended, &certain, of_all);
    let mut written_stages = stages;
    written_stages[2] = validation.stage(&written);
    let (estimated, benefit) = estimated(
        dataset,
        robot,
        nominal_arm,
        &subject,
        &written,
        &written_stages,
        &diagnosis,
        &set_aside,
        options,
        &prepared,
    );
    diagnosis.verdict = Some(estimated.verdict.clone());
    Ok(Diagnosed {
        diagnosis,
        geometric,
        extended: told,
        estimated,
        benefit,
        prepared,
        set_aside,
        finding_of_cause,
        pictures,
    })
}

/// Shifts that do not come back are fitted noise where readings resemble those before them, unless the error on rows that were
/// held out with their neighbours is larger without them by this factor.
const PASSING: f64 = 1.1;

/// Correlation with the row before, beside smooth courses, from which the noise itself is correlated, and shifts that do not come
/// back are its excursions whatever the held-out error says: their rows were chosen to hold them.
const NOISE_ITSELF: f64 = 0.3;

/// A fit without some of its causes.
fn without(subject: &Subject<'_>, fitted: &Extended, dropped: &[usize]) -> Extended {
    let kept = fitted.causes.iter().enumerate().filter(|(k, _)| !dropped.contains(k));
    let causes: Vec<Cause> = kept.map(|(_, cause)| cause.clone()).collect();
    fit(subject, &causes, Freedom::All, Some(fitted))
}

/// The accepted cause of least merit that is not about rows.
fn weakest(found: &Extended, accepted: &[Accepted]) -> Option<usize> {
    (0..accepted.len())
        .filter(|&k| found.causes[k].rows().is_none())
        .min_by(|&a, &b| accepted[a].own.merit.total_cmp(&accepted[b].own.merit))
}

/// The extended model with a smooth correction spread over its poses: a network of bumps on the first three joints.
fn smooth_correction(subject: &Subject<'_>, extended: &Extended) -> Extended {
    // Ten poses for each centre, so that the weights are seen.
    let centres = (subject.observed.dataset.rows.len() / 10).clamp(12, 60);
    let options = truegrind_estimation::network::rbf::Options { centres, ..Default::default() };
    let mut causes = extended.causes.clone();
    let spread = with_network(subject.nominal, &subject.observed.dataset, &options);
    causes.extend(spread.effects.last().cloned().map(Cause::Arm));
    fit(subject, &causes, Freedom::All, Some(extended))
}

/// Scalar rows in which causes are looked for, at most.
const SEARCHED: usize = 9_000;

/// Rows of a very long data set, drawn by their angles; `None` for one that is searched whole.
fn thinned(observed: &crate::identification::fit::Observed) -> Option<crate::identification::fit::Observed> {
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
        let mut rows = split::drawn(dataset, all, 0).concat();
        rows.truncate(most);
        rows.sort_unstable();
        observed.subset(&rows)
    })
}

/// Intervals that reach the last of the rows that were searched reach the last row there is.
fn to_the_end(causes: &[Cause], searched: &Dataset, dataset: &Dataset) -> Vec<Cause> {
    let last = |d: &Dataset| d.rows.last().map_or(0, |r| r.number);
    causes
        .iter()
        .map(|cause| match cause {
            Cause::Measurement(Disturbance { kind, course: Course::Rows { from, to }, values })
                if *to == last(searched) =>
            {
                Cause::Measurement(Disturbance {
                    kind: kind.clone(),
                    course: Course::Rows { from: *from, to: last(dataset) },
                    values: values.clone(),
                })
            }
            other => other.clone(),
        })
        .collect()
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
    (different_poses(dataset, needed) < needed).then_some(needed)
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

#[allow(clippy::too_many_arguments)]
fn estimated(
    dataset: &Dataset,
    robot: &str,
    nominal_arm: &Model,
    subject: &Subject<'_>,
    extended: &Extended,
    stages: &[StageError; 3],
    diagnosis: &Diagnosis,
    set_aside: &[usize],
    options: &Options,
    prepared: &Prepared,
) -> (Estimated, Option<Benefit>) {
    let fitted = Fitted::from(extended);
    let parameters = parameter_table(&fitted, nominal_arm);
    let order = arm_of(&fitted);
    let estimated = Estimated {
        robot: robot.to_owned(),
        nominal: nominal_arm.clone(),
        model: extended.model.clone(),
        covariance: arm_covariance(&fitted),
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
        parameters: parameters
            .iter()
            .filter(|p| p.name.starts_with("link") || p.name.starts_with("effect"))
            .cloned()
            .collect(),
        registered: StageErrors { fitted: stages[0].fitted, held_out: stages[0].random },
        geometry: StageErrors { fitted: stages[2].fitted, held_out: stages[2].random },
        noise_floor_mm: diagnosis.noise_floor_mm,
        verdict: Verdict { status: Judgement::NotEvaluated, reasons: Vec::new() },
        region: Region {
            min_deg: [0.0; 6],
            max_deg: [0.0; 6],
            samples_deg: Vec::new(),
            spacing_deg: 0.0,
            sigma_mm: 0.0,
        },
        condition: mean_condition(dataset),
    };
    let region = Region::of(subject.observed.dataset.rows.iter().map(|row| &row.joints), 0.0);
    let mut estimated = with_region(estimated, region, &fitted);
    let rows = &subject.observed.dataset;
    // Links and what the model promises are held against the tolerance of arms, not against the wide priors of a diagnosis.
    let plausible = Tolerance::default();
    let benefit = benefit(&fitted, rows, &estimated, &plausible, lack(&fitted, rows, &stages[2]));
    estimated.verdict = judge(&fitted, rows.sensor, benefit.as_ref(), &parameters, stages, &options.limits);
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
    let mut hearing = Hearing::default();
    if fitted.termination().is_converged() {
        hearing.tell("the fit converged");
    } else {
        hearing.fail(format!("the fit did not converge: {}", fitted.termination()));
    }
    if stages[2].blocks.rmse > stages[1].blocks.rmse * 1.05 && stages[2].random.rmse > stages[1].random.rmse {
        hearing.fail(format!(
            "with the findings the held-out error is {:.3} mm, geometry alone has {:.3}",
            stages[2].random.rmse, stages[1].random.rmse
        ));
    }
    hearing.strange_links(parameters, &Tolerance::default(), SURE);
    hearing.held_out(stages[0].random.rmse, stages[2].random.rmse);
    hearing.benefit(benefit, sensor);
    hearing.limits(limits, &stages[2].random);
    hearing.verdict()
}

/// With its wide priors a link that the rows hardly see is believed off only beyond this many standard deviations.
const SURE: f64 = 2.0;

/// How many times larger than it should be the square of the held-out error is: with k parameters determined by n readings
/// it is (n + k) / (n − k) times that of the fit.
fn lack(fitted: &Fitted, dataset: &Dataset, errors: &StageError) -> f64 {
    let per = fitted.task.rows_per_observation();
    let n = (dataset.rows.len() * per) as f64;
    let shares = fitted.sigmas().into_iter().zip(&fitted.priors);
    let spent: f64 = shares.map(|(s, p)| (1.0 - (s / p.sigma).powi(2)).clamp(0.0, 1.0)).sum();
    let expected = (n + spent) / (n - spent).max(0.05 * n).max(1.0);
    let lack = (errors.random.rmse / errors.fitted.rmse).powi(2) / expected;
    if lack.is_finite() { lack.max(1.0) } else { 1.0 }
}
