//! What is said of the place of a path, and of the chance that cuts get worse.

use serde_json::{Value, json};

use super::table::{Column, Table};
use truegrind_calibration::identification::verdict::percent_of;
use truegrind_compensation::deviation::Status;
use truegrind_compensation::plan::{MotionOutcome, Plan};
use truegrind_compensation::risk::cut_risk::CutRisk;
use truegrind_compensation::risk::placement::{ObjectPlacement, Placement};
use truegrind_compensation::risk::remedy::Remedy;
use truegrind_programs::motion::Listing;

/// Cuts that are named one by one.
const NAMED: usize = 12;

fn word(placement: Placement) -> &'static str {
    match placement {
        Placement::Shape => "shape",
        _ => "absolute",
    }
}

/// One sentence for each work object: what was corrected of it and why, and what would make its place known.
pub fn sentences(plan: &Plan, listing: &Listing) -> Vec<String> {
    let what = object_word(listing);
    plan.placements.iter().map(|placement| sentence(placement, what)).collect()
}

/// What a program of this language calls the frame in which it cuts.
fn object_word(listing: &Listing) -> &'static str {
    if listing.numbered { "work offset" } else { "work object" }
}

fn sentence(placement: &ObjectPlacement, what: &str) -> String {
    let ObjectPlacement { work_object, applied, deviation_mm, sigma_mm, remedy, .. } = placement;
    let known = format!(
        "the path as a whole lies {deviation_mm:.3} mm from where it is meant, which the model knows to ± {sigma_mm:.3} mm (1σ)"
    );
    if *applied == Placement::Absolute {
        return format!("{what} {work_object}: shape and place are corrected; {known}");
    }
    let remedy =
        remedy.as_ref().map(|remedy| format!("{}; ", to_be_measured(remedy, what))).unwrap_or_default();
    format!(
        "{what} {work_object}: the shape is corrected, the path stays where it is; {known}; {remedy}--placement absolute \
         corrects the place all the same"
    )
}

/// What is to be measured so that a place becomes known, what it costs and what it leaves.
fn to_be_measured(remedy: &Remedy, what: &str) -> String {
    let what = remedy.measurements.iter().map(|m| m.instruction(what)).collect::<Vec<_>>().join(", and ");
    let (minutes, left) = (remedy.minutes(), remedy.sigma_mm);
    if remedy.suffices {
        format!(
            "the cheapest measurement that would make the place known: {what} (some {minutes:.0} minutes; it is then known to \
             ± {left:.3} mm)"
        )
    } else {
        format!(
            "no measurement that was looked at would make the place known well enough to correct it; the best: {what} (some \
             {minutes:.0} minutes) would leave ± {left:.3} mm"
        )
    }
}

/// The cuts, those first whose correction is most likely to make them worse; `None` where none is known.
pub fn cut_table(plan: &Plan, listing: &Listing) -> Option<Table> {
    if plan.cuts.is_empty() {
        return None;
    }
    let mut table = Table::new(
        "Cuts, by the chance that the correction makes them worse",
        vec![
            Column::text("lines", "Lines"),
            Column::count("motions", "Motions"),
            Column::text("judged", "Judged"),
            Column::number("off_mm", "before", "mm", 3),
            Column::number("sigma_mm", "1σ", "mm", 3),
            Column::number("worse_percent", "worse", "%", 1),
            Column::text("fate", "Outcome"),
        ],
    );
    let mut order: Vec<&CutRisk> = plan.cuts.iter().collect();
    order.sort_by(|a, b| b.probability_of_harm.total_cmp(&a.probability_of_harm));
    for cut in order.iter().take(NAMED) {
        table.push([
            lines(cut, listing).into(),
            cut.motions.len().into(),
            word(cut.assessed).into(),
            cut.deviation_mm.into(),
            cut.sigma_mm.into(),
            (100.0 * cut.probability_of_harm).into(),
            fate(cut).into(),
        ]);
    }
    let more = order.len().saturating_sub(NAMED);
    if more > 0 {
        table.notes.push(format!("{more} more cuts with a smaller chance are not listed."));
    }
    table.notes.push(
        "before: how far the cut is off as it is, RMS (judged by its shape: after its best rigid registration). 1σ: predicted \
         standard deviation of its correction. worse: probability that the corrected cut is farther off than the cut as it is."
            .to_owned(),
    );
    Some(table)
}

/// What became of a cut.
fn fate(cut: &CutRisk) -> &'static str {
    match (cut.corrected, cut.left_for_risk) {
        (true, _) => "corrected",
        (false, true) => "left as it is",
        // Why is said of its motions.
        (false, false) => "stays for another reason",
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

/// How many cuts stay since their correction may well make them worse, of how many.
pub fn left(plan: &Plan) -> (usize, usize) {
    (plan.cuts.iter().filter(|cut| cut.left_for_risk).count(), plan.cuts.len())
}

/// Predicted 1σ that counts for a motion: of the shape where its cut is judged by that, else of its place.
pub fn leads_with_shape(plan: &Plan) -> bool {
    plan.placements.iter().any(|placement| placement.applied == Placement::Shape)
}

fn rewritten(plan: &Plan) -> impl Iterator<Item = &MotionOutcome> {
    plan.outcomes.iter().filter(|outcome| matches!(outcome.status, Status::Changed | Status::Flagged))
}

/// Largest deviation of what is rewritten, as programmed (mm); where the shape alone is corrected, of the shape. `None` where
/// nothing is rewritten.
pub fn before_mm(plan: &Plan) -> Option<f64> {
    rewritten(plan).filter_map(|outcome| outcome.before_mm).reduce(f64::max)
}

/// Largest deviation of all motions as programmed (mm).
pub fn largest_mm(plan: &Plan) -> Option<f64> {
    plan.outcomes.iter().filter_map(|outcome| outcome.before_mm).reduce(f64::max)
}

/// How far off what is rewritten has to be expected (mm): what the solver leaves and the predicted 1σ, the largest of all.
pub fn expected_mm(plan: &Plan) -> Option<f64> {
    let shape = leads_with_shape(plan);
    let sigma = |outcome: &MotionOutcome| if shape { outcome.shape_sigma_mm } else { outcome.sigma_mm };
    rewritten(plan).filter_map(|outcome| Some(outcome.after_mm?.hypot(sigma(outcome)?))).reduce(f64::max)
}

/// The chance that what is written gets worse, in words; `None` where nothing is known of it.
pub fn chance(plan: &Plan) -> Option<String> {
    let all = percent_of(plan.probability_of_harm?);
    let largest =
        plan.cuts.iter().filter(|cut| cut.corrected).map(|cut| cut.probability_of_harm).fold(0.0, f64::max);
    Some(format!(
        "the probability that the corrected cuts are farther off than the cuts as they were is {all}, of any one of them {}",
        match percent_of(largest) {
            small if small.starts_with("under") => small,
            other => format!("at most {other}"),
        }
    ))
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

/// What of it the contract holds.
pub fn json(plan: &Plan, listing: &Listing) -> [Value; 2] {
    let what = object_word(listing);
    let placements = plan.placements.iter().map(|p| {
        json!({
            "work_object": p.work_object, "corrected": word(p.applied), "off_mm": p.deviation_mm, "sigma_mm": p.sigma_mm,
            "taught": p.taught, "remedy": p.remedy.as_ref().map(|remedy| remedy_json(remedy, what)),
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
