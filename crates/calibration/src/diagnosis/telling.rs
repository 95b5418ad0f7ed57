//! What is told of a search: a finding for each story, what the record itself shows, and what is left.

use super::data_quality::{mismatch_finding, noise_floor, outlier_finding, rounding_finding};
use super::extension::Extended;
use super::finding::{Finding, Step};
use super::findings::Context;
use super::held::FoldErrors;
use super::picture::Picture;
use super::remaining::Structure;
use super::search::{Confirmed, Search};
use super::shadow::{Shadows, beyond_noise_mm};
use super::something_else::Left;
use super::stories::{self, Story};
use super::worth::Worth;
use crate::measurement::split;

/// What is told.
pub(super) struct Told {
    /// Ranked by what they are worth.
    pub(super) stories: Vec<Story>,
    /// The error as causes were added.
    pub(super) steps: Vec<Step>,
    /// The fit to all rows, whole.
    pub(super) extended: Extended,
    /// The noise floor (mm), and where it is from.
    pub(super) noise_floor: (Option<f64>, String),
    /// What is left, in a sentence.
    pub(super) remaining: Option<String>,
}

/// Tells of a search. `smoothed`: the held-out error without the smooth correction (mm), where there is one.
pub(super) fn told(
    search: &Search<'_>,
    confirmed: &Confirmed,
    structure: &Structure,
    smoothed: Option<f64>,
) -> Told {
    let ground = search.ground;
    let (subject, searched, prepared) = (&ground.subject, &ground.searched, ground.prepared);
    let (stages, outcome) = (&search.stages, &confirmed.outcome);
    let floor = split::noise_floor(ground.dataset);
    let mut steps = vec![
        Step { added: "data sheet, frames fitted".to_owned(), cv_rmse_mm: stages[0].random.rmse },
        Step { added: "geometry".to_owned(), cv_rmse_mm: stages[1].random.rmse },
    ];
    let extended = search.extended.clone().whole(subject);
    let (told, finding_of_cause, pictures) = findings(search, confirmed, &extended, &mut steps);
    let worth = Worth::new(searched, &search.found, &confirmed.whole);
    let shadows = Shadows {
        causes: &search.found.causes,
        confirmations: &outcome.confirmations,
        worth: &worth,
        nominal: subject.nominal,
        growth_mm: outcome.discrepancy.growth_mm(),
        field_mm: outcome.discrepancy.field_mm(),
        beyond_noise_mm: floor
            .map_or(0.0, |floor| beyond_noise_mm(stages[2].fitted.rmse, floor.sigma_mm, floor.freedom)),
    };
    let mut stories = stories::told(
        stories::of(told, &finding_of_cause, pictures),
        &outcome.confirmations,
        &outcome.discrepancy,
        &shadows,
        stages[1].fitted.rmse,
    );
    if smoothed.is_some() {
        let added = "smooth correction, without a physical name".to_owned();
        steps.push(Step { added, cv_rmse_mm: stages[2].random.rmse });
    }
    (ground.tell)("looking at what is left");
    let noise_floor = noise_floor(&floor, subject, &search.extended);
    let rest = Left {
        dataset: &searched.observed.dataset,
        discrepancy: &outcome.discrepancy,
        structure,
        after: &stages[2],
        smoothed,
        floor_mm: noise_floor.0,
    };
    let off_mm = off_mm(&search.extended, &search.wild);
    let rough_mm = shadows.roughly_described_mm();
    let of_the_record = [
        rounding_finding(ground.dataset, prepared, subject, &search.geometric, stages),
        mismatch_finding(ground.dataset, prepared, &stages[2]),
        outlier_finding(ground.dataset, &search.wild, (off_mm, rough_mm), &stages[2]),
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
    Told { stories, steps, extended, noise_floor, remaining: rest.sentence() }
}

/// How far the farthest of some rows is off (mm).
fn off_mm(fit: &Extended, rows: &[(usize, f64)]) -> f64 {
    let errors = fit.problem.errors_mm(&fit.x);
    rows.iter().filter_map(|(i, _)| errors.get(*i)).map(|e| e.abs()).fold(0.0, f64::max)
}

/// A finding for each accepted cause, the error with each added to `steps`.
fn findings(
    search: &Search<'_>,
    confirmed: &Confirmed,
    extended: &Extended,
    steps: &mut Vec<Step>,
) -> (Vec<Finding>, Vec<usize>, Vec<Picture>) {
    let ground = search.ground;
    let rows = &ground.searched.observed.dataset;
    let folds = split::purged(rows, 5, search.reach, ground.options.selection.seed);
    let aside: &[usize] = if ground.thinned() { &[] } else { &search.set_aside };
    let context = Context {
        subject: &ground.searched,
        found: &search.found,
        extended,
        whole: &confirmed.whole,
        held: &FoldErrors::of(&confirmed.linear, &folds),
        set_aside: aside,
    };
    context.findings(&search.accepted, steps)
}
