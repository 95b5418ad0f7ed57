//! Place and shape of paths, and the risk that corrected cuts get worse.

use std::collections::BTreeSet;

use serde::{Deserialize, Serialize};
use serde_json::{Value, json};

use super::table::Table;
use truegrind_calibration::identification::verdict::{MAX_PERCENT, MIN_PERCENT, percent_of};
use truegrind_compensation::line_list::numbered;
use truegrind_compensation::plan::reason::OutcomeReason;
use truegrind_compensation::plan::steps_to_left::is_path;
use truegrind_compensation::plan::{MotionOutcome, Plan};
use truegrind_compensation::risk::cut_risk::CutRisk;
use truegrind_compensation::risk::placement::{ObjectPlacement, Placement};
use truegrind_compensation::risk::remedy::Remedy;
use truegrind_programs::motion::{Listing, Motion, Place, Reason};

/// A work object of a program, and what of it is corrected.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Placed {
    /// Its name.
    pub name: String,
    /// Its frame, as the program states it: objects of one name that lie elsewhere are others.
    pub frame: String,
    /// Whether its placement is kept.
    pub shape_only: bool,
}

/// How the stationary work objects with corrected motions are placed.
pub fn placed(plan: &Plan, listing: &Listing) -> Vec<Placed> {
    let objects =
        || rewritten(plan).filter_map(|outcome| listing.motions.get(outcome.motion as usize)?.work_object);
    let used: BTreeSet<u32> = objects().collect();
    let placement_of = |name: &str| {
        plan.placements
            .iter()
            .find(|placement| !placement.held && names(placement).any(|other| other == name))
    };
    let of = |index: u32| {
        let object = listing.work_objects.get(index as usize)?;
        let frame = object.value.as_ref().map_or_else(
            |_| String::new(),
            |value| format!("{:?} {:?}", value.user_frame, value.object_frame),
        );
        let shape_only = placement_of(&object.name)?.applied == Placement::Shape;
        Some(Placed { name: object.name.clone(), frame, shape_only })
    };
    used.into_iter().filter_map(of).collect()
}

/// Largest number of listed cuts.
const MAX_LISTED: usize = 12;

fn word(placement: Placement) -> &'static str {
    match placement {
        Placement::Shape => "shape",
        _ => "absolute",
    }
}

/// One sentence per work object: what was corrected and why, and which measurement would determine its placement.
pub fn sentences(plan: &Plan, listing: &Listing) -> Vec<String> {
    let what = object_word(listing);
    let corrected: BTreeSet<&str> = rewritten(plan)
        .filter_map(|outcome| listing.work_object(listing.motions.get(outcome.motion as usize)?))
        .map(|object| object.name.as_str())
        .collect();
    let of = |placement: &ObjectPlacement| {
        if names(placement).any(|name| corrected.contains(name)) {
            return sentence(placement, what, &share(placement, plan, listing));
        }
        let with = if placement.others.is_empty() { "it" } else { "them" };
        let named = named(placement, what);
        format!("{named}: no motion with {with} is corrected; {}", displacement(placement))
    };
    let apart = apart(plan, what, |placement| names(placement).any(|name| corrected.contains(name)));
    let left = plan.placements.iter().filter_map(|placement| left_behind(placement, plan, listing));
    plan.placements.iter().map(of).chain(apart).chain(left).collect()
}

/// How many of the motions with a work object are corrected, where not all are.
fn share(placement: &ObjectPlacement, plan: &Plan, listing: &Listing) -> String {
    let is_here = |outcome: &&MotionOutcome| {
        let object =
            listing.motions.get(outcome.motion as usize).and_then(|motion| listing.work_object(motion));
        object.is_some_and(|object| names(placement).any(|name| name == object.name))
    };
    let all = plan.outcomes.iter().filter(is_here).count();
    let corrected = rewritten(plan).filter(is_here).count();
    if corrected < all { format!(" in {corrected} of {all} motions") } else { String::new() }
}

/// By how much cuts may come apart without a word (mm RMS).
const APART_MM: f64 = 0.05;

/// Sentence for a work object whose placement is corrected in some cuts and not in others: passes over one contour come apart. Uncorrected
/// lines of which the text does not tell the place, as of a routine with its target as parameter, lie off by as much as the path as a whole.
fn left_behind(placement: &ObjectPlacement, plan: &Plan, listing: &Listing) -> Option<String> {
    if placement.applied != Placement::Absolute {
        return None;
    }
    let motion_at = |index: &u32| listing.motions.get(*index as usize);
    let is_here = |motion: &Motion| {
        listing.work_object(motion).is_some_and(|object| names(placement).any(|name| name == object.name))
    };
    let cuts = || plan.cuts.iter().filter(|cut| cut.motions.first().and_then(motion_at).is_some_and(is_here));
    if !cuts().any(|cut| cut.corrected) {
        return None;
    }
    let left: Vec<&CutRisk> = cuts().filter(|cut| !cut.corrected && cut.deviation_mm > APART_MM).collect();
    let unknown: Vec<Place> = plan
        .outcomes
        .iter()
        .filter(|outcome| is_left_at_unknown_place(outcome))
        .filter_map(|outcome| motion_at(&outcome.motion))
        .filter(|motion| is_path(motion) && is_here(motion))
        .map(|motion| motion.place)
        .collect();
    let unknown_mm = (!unknown.is_empty()).then_some(placement.deviation_mm).filter(|mm| *mm > APART_MM);
    let mm = left.iter().map(|cut| cut.deviation_mm).chain(unknown_mm).reduce(f64::max)?;
    let of_cuts = left.iter().filter_map(|cut| cut.motions.first()).filter_map(motion_at);
    let mut places: Vec<Place> = of_cuts.map(|motion| motion.place).collect();
    if unknown_mm.is_some() {
        places.extend(unknown);
        places.sort_by_key(|place| (place.file, place.line, place.column));
    }
    let (begin, stay) = match (places.len(), unknown_mm) {
        (1, None) => ("the cut that begins at", "stays where it is"),
        (_, None) => ("cuts that begin at", "stay where they are"),
        (1, Some(_)) => ("what is cut at", "stays where it is"),
        (_, Some(_)) => ("cuts at", "stay where they are"),
    };
    let lines = numbered(&listing.files, places.into_iter()).unwrap_or_default();
    let named = named(placement, object_word(listing));
    Some(format!(
        "{named}: {begin} {lines} {stay}, while others move by the correction: passes over one contour then lie up to {mm:.3} mm apart. \
         Correct all of them, or the shape alone (--placement shape)"
    ))
}

/// Whether a motion is left of which the text does not tell the place, unless it is counted from where the robot stands, and with it moves.
fn is_left_at_unknown_place(outcome: &MotionOutcome) -> bool {
    let follows = OutcomeReason::Program(Reason::CurrentPosition);
    !outcome.status.is_written() && outcome.before_mm.get().is_none() && outcome.reason() != Some(follows)
}

/// Sentence for stationary objects of which some are corrected in placement and others are not: the distances between them change.
fn apart(plan: &Plan, what: &str, is_corrected: impl Fn(&ObjectPlacement) -> bool) -> Option<String> {
    let stand = || plan.placements.iter().filter(|placement| !placement.held && is_corrected(placement));
    let of = |applied: Placement| -> Vec<&str> {
        stand().filter(|placement| placement.applied == applied).flat_map(names).collect()
    };
    let [moved, kept] = [Placement::Absolute, Placement::Shape].map(of);
    let moved_mm = stand().filter(|placement| placement.applied == Placement::Absolute);
    let most_mm = moved_mm.map(|placement| placement.deviation_mm).fold(0.0, f64::max);
    (!moved.is_empty() && !kept.is_empty()).then(|| {
        format!(
            "the placement is corrected for {} but not for {}: the two shift relative to each other by up to {most_mm:.3} mm. If these {what}s \
             belong together, give them one user frame, or choose --placement shape or --placement absolute for both",
            moved.join(", "),
            kept.join(", ")
        )
    })
}

/// The work objects of a placement.
fn names(placement: &ObjectPlacement) -> impl Iterator<Item = &str> {
    std::iter::once(&placement.work_object).chain(&placement.others).map(String::as_str)
}

/// The same as the subject of a sentence.
fn named(placement: &ObjectPlacement, what: &str) -> String {
    let all: Vec<&str> = names(placement).collect();
    match all.as_slice() {
        [name] => format!("{what} {name}"),
        all => format!("{what}s {} (placed as one)", all.join(", ")),
    }
}

/// How far the path as a whole is displaced.
fn displacement(placement: &ObjectPlacement) -> String {
    format!(
        "the path as a whole is displaced by {:.3} mm (known to ± {:.3} mm, 1σ)",
        placement.deviation_mm, placement.sigma_mm
    )
}

/// Term of the program language for a work object.
fn object_word(listing: &Listing) -> &'static str {
    if listing.numbered { "work offset" } else { "work object" }
}

fn sentence(placement: &ObjectPlacement, what: &str, share: &str) -> String {
    let ObjectPlacement { applied, probability_of_harm, remedy, unlocated, .. } = placement;
    let (named, known) = (named(placement, what), displacement(placement));
    if *applied == Placement::Absolute {
        return format!("{named}: shape and placement are corrected{share}; {known}");
    }
    if *unlocated {
        return format!(
            "{named}: only the shape is corrected{share}, since the {what} was taught with this arm and its teaching points are missing; give them in the cell \
             file (teaching_deg) to correct the placement too; --placement absolute \
             takes the programmed frame as exact"
        );
    }
    let remedy = remedy.as_ref().map(|remedy| format!("{}; ", remedy_text(remedy, what))).unwrap_or_default();
    format!(
        "{named}: only the shape is corrected{share}; {known}; correcting the placement too would make the path worse with a probability of \
         {}; {remedy}--placement absolute corrects it anyway",
        percent_of(*probability_of_harm)
    )
}

/// The measurement that would determine a placement, its duration and the remaining uncertainty.
fn remedy_text(remedy: &Remedy, what: &str) -> String {
    let what = remedy.measurements.iter().map(|m| m.instruction(what)).collect::<Vec<_>>().join(", and ");
    let (minutes, left) = (remedy.minutes(), remedy.sigma_mm);
    if remedy.suffices {
        format!(
            "cheapest measurement that would determine the placement: {what} (about {minutes:.0} minutes; leaves ± {left:.3} mm)"
        )
    } else {
        format!(
            "no considered measurement would determine the placement well enough to correct it; the best one, {what} (about \
             {minutes:.0} minutes), leaves ± {left:.3} mm"
        )
    }
}

/// The cuts, those first whose correction is most likely to make them worse; `None` without cuts.
pub fn cut_table(plan: &Plan, listing: &Listing) -> Option<Table> {
    if plan.cuts.is_empty() {
        return None;
    }
    let mut order: Vec<&CutRisk> = plan.cuts.iter().collect();
    order.sort_by(|a, b| b.probability_of_harm.total_cmp(&a.probability_of_harm));
    let rows = order.iter().take(MAX_LISTED).map(|cut| (*cut, lines(cut, listing)));
    let mut table =
        Table::of("Cuts by the probability that the correction makes them worse", &rows.collect::<Vec<_>>())
            .text("lines", "Lines", |(_, lines)| lines.as_str())
            .count("motions", "Motions", |(cut, _)| cut.motions.len())
            .text("judged", "Judged", |(cut, _)| word(cut.assessed))
            .number("off_mm", "before", "mm", 3, |(cut, _)| cut.deviation_mm)
            .number("sigma_mm", "1σ", "mm", 3, |(cut, _)| cut.sigma_mm)
            .text("worse_percent", "worse", |(cut, _)| percent_of(cut.probability_of_harm))
            .text("fate", "Outcome", |(cut, _)| outcome_word(cut))
            .table();
    let more = order.len().saturating_sub(MAX_LISTED);
    if more > 0 {
        table.notes.push(format!("{more} more cuts with a smaller probability are not listed."));
    }
    table.notes.push(
        "before: RMS deviation of the uncorrected cut (for shape: after the best rigid registration of all cuts on the part). 1σ: \
         predicted standard deviation of its correction. worse: probability that the corrected cut deviates more than the uncorrected one."
            .to_owned(),
    );
    Some(table)
}

/// Outcome of a cut.
fn outcome_word(cut: &CutRisk) -> &'static str {
    match (cut.corrected, cut.left_for_risk) {
        (true, _) => "corrected",
        (false, true) => "left unchanged",
        // The reasons are listed with its motions.
        (false, false) => "not corrected for another reason",
    }
}

fn lines(cut: &CutRisk, listing: &Listing) -> String {
    let line =
        |motion: Option<&u32>| motion.and_then(|m| listing.motions.get(*m as usize)).map(|m| m.place.line);
    match (line(cut.motions.first()), line(cut.motions.last())) {
        (Some(first), Some(last)) if first != last => format!("{first}–{last}"),
        (Some(first), _) => first.to_string(),
        _ => String::new(),
    }
}

/// Number of cuts left unchanged because of `--max-risk`, and number of all cuts.
pub fn left_at_risk(plan: &Plan) -> (usize, usize) {
    (plan.cuts.iter().filter(|cut| cut.left_for_risk).count(), plan.cuts.len())
}

fn rewritten(plan: &Plan) -> impl Iterator<Item = &MotionOutcome> {
    plan.outcomes.iter().filter(|outcome| outcome.status.is_written())
}

/// Largest uncorrected deviation of all motions (mm).
pub fn largest_mm(plan: &Plan) -> Option<f64> {
    plan.outcomes.iter().filter_map(|outcome| outcome.before_mm.get()).reduce(f64::max)
}

/// Largest deviation before and after over the rewritten motions of which the same is corrected.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct BeforeAndAfter {
    /// Whether that is the shape alone.
    pub shape_only: bool,
    /// Largest uncorrected deviation (mm), of the shape if only that is corrected.
    pub before_mm: f64,
    /// Largest expected deviation of the same motions (mm): remainder of the solver and predicted 1σ; absent if no σ is known.
    pub expected_mm: Option<f64>,
}

/// Before and after of what is corrected in shape and placement, and of what is corrected in shape alone: the one contains the placement of the
/// path, the other does not, so no figure of the one may stand beside one of the other. Motions outside cuts have no σ of a shape and do not
/// count there.
pub fn before_and_after(plan: &Plan, listing: &Listing) -> Vec<BeforeAndAfter> {
    let shape: BTreeSet<&str> =
        plan.placements.iter().filter(|p| p.applied == Placement::Shape).flat_map(names).collect();
    let is_shape_only = |outcome: &MotionOutcome| {
        let motion = listing.motions.get(outcome.motion as usize);
        let object = motion.and_then(|motion| listing.work_object(motion));
        object.is_some_and(|object| shape.contains(object.name.as_str()))
    };
    let of = |shape_only: bool| {
        let sigma =
            |outcome: &MotionOutcome| if shape_only { outcome.shape_sigma_mm } else { outcome.sigma_mm };
        let expected = |outcome: &MotionOutcome| Some(outcome.after_mm.get()?.hypot(sigma(outcome).get()?));
        let same = || rewritten(plan).filter(|outcome| is_shape_only(outcome) == shape_only);
        let expected_mm = same().filter_map(expected).reduce(f64::max);
        let counts = |outcome: &&MotionOutcome| expected_mm.is_none() || expected(outcome).is_some();
        let before_mm =
            same().filter(counts).filter_map(|outcome| outcome.before_mm.get()).reduce(f64::max)?;
        Some(BeforeAndAfter { shape_only, before_mm, expected_mm })
    };
    [false, true].into_iter().filter_map(of).collect()
}

/// The probability that the corrected cuts get worse, as a sentence; `None` if unknown.
pub fn risk(plan: &Plan) -> Option<String> {
    let all = percent_of(plan.probability_of_harm?);
    let largest =
        plan.cuts.iter().filter(|cut| cut.corrected).map(|cut| cut.probability_of_harm).fold(0.0, f64::max);
    Some(format!(
        "probability that the corrected cuts together deviate more than the uncorrected ones: {all}; for any single cut: {}",
        at_most(largest)
    ))
}

/// "At most 3.0 %", or the bound that [`percent_of`] states.
fn at_most(probability: f64) -> String {
    let bounds = MIN_PERCENT..=MAX_PERCENT;
    let percent = percent_of(probability);
    if bounds.contains(&(100.0 * probability)) { format!("at most {percent}") } else { percent }
}

fn remedy_json(remedy: &Remedy, what: &str) -> Value {
    let measurements: Vec<Value> = remedy
        .measurements
        .iter()
        .map(
            |m| json!({ "name": m.name(), "poses": m.poses(), "minutes": m.minutes(), "what": m.instruction(what) }),
        )
        .collect();
    json!({
        "measurements": measurements, "minutes": remedy.minutes(), "sigma_mm": remedy.sigma_mm,
        "suffices": remedy.suffices,
    })
}

/// The entries `placements` and `cuts` of the JSON report.
pub fn json(plan: &Plan, listing: &Listing) -> [Value; 2] {
    let what = object_word(listing);
    let each = plan.placements.iter().flat_map(|p| names(p).map(move |name| (p, name)));
    let placements = each.map(|(p, name)| {
        json!({
            "work_object": name, "corrected": word(p.applied), "off_mm": p.deviation_mm, "sigma_mm": p.sigma_mm,
            "chance_of_worse": p.probability_of_harm, "taught": p.taught, "remedy": p.remedy.as_ref().map(|remedy| remedy_json(remedy, what)),
        })
    });
    let cuts = plan.cuts.iter().map(|cut| {
        json!({
            "lines": lines(cut, listing), "motions": cut.motions.len(), "judged": word(cut.assessed), "off_mm": cut.deviation_mm,
            "sigma_mm": cut.sigma_mm, "shape_sigma_mm": cut.shape_sigma_mm, "chance_of_worse": cut.probability_of_harm, "left": cut.left_for_risk, "corrected": cut.corrected,
        })
    });
    [placements.collect(), cuts.collect()]
}
