//! The first screen of a page on a compensation: may the program run, how far off is it before and after, what is to be done.

use crate::deviation::fate_word;
use crate::document::{KeyFigure, Verdict};
use crate::placement;
use crate::status::Status;
use truegrind_compensation::deviation::Status as Fate;
use truegrind_compensation::plan::Plan;
use truegrind_compensation::plan::reason::OutcomeReason;
use truegrind_programs::motion::Listing;

/// All, in the order in which a reader wants them.
const FATES: [Fate; 4] = [Fate::Changed, Fate::Flagged, Fate::Refused, Fate::Left];

/// How a rewrite is judged, the same on the terminal, on the page and in the exit code.
pub fn verdict(plan: &Plan, listing: &Listing) -> Verdict {
    let (refused, flagged) = (count(plan, Fate::Refused), count(plan, Fate::Flagged));
    let written = count(plan, Fate::Changed) + flagged;
    let (left, cuts) = placement::left(plan);
    let same =
        !plan.outcomes.is_empty() && plan.outcomes.iter().all(|o| o.reason == Some(OutcomeReason::NoChange));
    let (status, headline) = match (written, refused + flagged) {
        (0, 0) if same => {
            (Status::NotEvaluated, "Nothing was rewritten: every number is right to its last decimal")
        }
        (0, 0) if left > 0 => (
            Status::NotEvaluated,
            "Nothing was rewritten: the measurement does not tell the arm well enough where the program cuts",
        ),
        (0, 0) => (Status::NotEvaluated, "Nothing was rewritten"),
        (0, _) => (Status::Bad, "Nothing could be rewritten"),
        (_, 0) if left > 0 => (
            Status::Warning,
            "Rewritten, but for cuts where the measurement does not tell the arm well enough: they stay as they are",
        ),
        (_, 0) => (Status::Good, "Everything that can be rewritten is rewritten: the program may run"),
        _ => (Status::Warning, "Rewritten, but look at what was refused or flagged before the program runs"),
    };
    let mut reasons: Vec<String> = sizes(plan).into_iter().collect();
    reasons.push(coverage(plan));
    if left > 0 {
        reasons.push(format!(
            "{left} of {cuts} cuts stay as they are, since the correction makes them worse with a larger probability than \
             --max-risk takes; more measured poses where they lie tell the arm better (`truegrind plan`)"
        ));
    }
    reasons.extend(placement::chance(plan));
    if refused > 0 && written > 0 {
        reasons.push(
            "a refused motion goes where it always went: between it and its rewritten neighbours the path steps by the \
             correction"
                .to_owned(),
        );
    }
    let steps =
        count_reason(plan, |why| matches!(why, OutcomeReason::PartOfCut { .. } | OutcomeReason::Step { .. }));
    if steps > 0 {
        reasons.push(format!(
            "{steps} motions could be corrected but stay, since another motion of their cut stays: half a correction would be \
             a step in the part"
        ));
    }
    if !listing.opaque.is_empty() {
        reasons.push(format!(
            "regions that could not be read and stay as they are: {}; a motion in them is not corrected",
            listing.opaque.len()
        ));
    }
    let inserted: usize = plan.outcomes.iter().map(|outcome| outcome.inserted).sum();
    if inserted > 0 {
        reasons.push(format!(
            "{inserted} targets put in, so that straight lines stay straight within the tolerance"
        ));
    }
    Verdict::new(status, headline, reasons)
}

fn count_reason(plan: &Plan, is: impl Fn(&OutcomeReason) -> bool) -> usize {
    plan.outcomes.iter().filter(|outcome| outcome.reason.as_ref().is_some_and(&is)).count()
}

/// How far off it is before and after, in words; `None` where nothing is known of it.
fn sizes(plan: &Plan) -> Option<String> {
    let as_it_is = |mm: f64| format!("as it is the program is up to {mm:.3} mm off");
    let Some(before) = placement::before_mm(plan) else { return placement::largest_mm(plan).map(as_it_is) };
    let after = placement::expected_mm(plan)?;
    let shape = if placement::leads_with_shape(plan) { ", in shape" } else { "" };
    Some(format!(
        "what is rewritten is up to {before:.3} mm off before, and an expected {after:.3} mm (1σ) after{shape}"
    ))
}

pub(super) fn key_figures(plan: &Plan) -> Vec<KeyFigure> {
    let all = plan.outcomes.len();
    let shape = if placement::leads_with_shape(plan) { "of the shape" } else { "shape and place" };
    let mut figures = vec![match placement::before_mm(plan) {
        Some(mm) => KeyFigure::new("Largest before", mm, 3, "mm").note(format!("{shape}, what is rewritten")),
        None => KeyFigure::new("Largest before", placement::largest_mm(plan), 3, "mm")
            .note("as it is, all motions"),
    }];
    let expected = placement::expected_mm(plan);
    figures.push(KeyFigure::new("Expected after", expected, 3, "mm").note(match expected {
        Some(_) => format!("{shape}, 1σ of the model: largest of what is rewritten"),
        None => "nothing is rewritten, or the model has no σ".to_owned(),
    }));
    if let Some(chance) = plan.probability_of_harm {
        figures.push(
            KeyFigure::new("Chance to be worse", 100.0 * chance, 1, "%").note("the corrected cuts together"),
        );
    }
    let [changed, flagged, refused, left] = FATES.map(|fate| count(plan, fate));
    let rewritten = changed + flagged;
    let share = if all > 0 { format!("{} of {all} motions; ", share(rewritten, all)) } else { String::new() };
    figures.push(
        KeyFigure::new("Rewritten", rewritten, 0, "")
            .note(format!("{share}{flagged} of them flagged; {refused} refused, {left} left")),
    );
    figures
}

/// One sentence: how many motions were changed, flagged, refused and left, with their shares.
pub fn coverage(plan: &Plan) -> String {
    let all = plan.outcomes.len();
    if all == 0 {
        return "the program holds no motion".to_owned();
    }
    let parts: Vec<String> = FATES
        .iter()
        .map(|&fate| {
            let found = count(plan, fate);
            format!("{found} {} ({})", fate_word(fate), share(found, all))
        })
        .collect();
    let word = if all == 1 { "motion" } else { "motions" };
    format!("{all} {word}: {}", parts.join(", "))
}

/// Share in per cent: never 100 % where something is missing, never 0 % where something is there.
fn share(part: usize, all: usize) -> String {
    let percent = 100.0 * part as f64 / all as f64;
    if part < all && percent > 99.9 {
        "> 99.9 %".to_owned()
    } else if part > 0 && percent < 0.1 {
        "< 0.1 %".to_owned()
    } else if part == all || part == 0 {
        format!("{percent:.0} %")
    } else {
        format!("{percent:.1} %")
    }
}

fn count(plan: &Plan, fate: Fate) -> usize {
    plan.outcomes.iter().filter(|outcome| outcome.status == fate).count()
}
