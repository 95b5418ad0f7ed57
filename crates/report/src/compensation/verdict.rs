//! Verdict and key figures of a compensation: may the program run, what are the deviations before and after, what remains to do.

use crate::deviation::status_word;
use crate::document::{KeyFigure, PageVerdict};
use crate::placement::{self, BeforeAndAfter};
use crate::status::Status;
use truegrind_calibration::identification::verdict::percent_of;
use truegrind_compensation::deviation::MotionStatus;
use truegrind_compensation::plan::reason::OutcomeReason;
use truegrind_compensation::plan::steps_to_left::is_path;
use truegrind_compensation::plan::{MotionOutcome, Plan};
use truegrind_programs::motion::{Listing, Motion, Reason};

/// All statuses in display order.
const STATUSES: [MotionStatus; 4] =
    [MotionStatus::Changed, MotionStatus::Flagged, MotionStatus::Refused, MotionStatus::Left];

/// Verdict on a compensation, the same on the terminal, on the page and in the exit code. `is_written`: the corrected program is.
pub fn verdict(plan: &Plan, listing: &Listing, is_written: bool) -> PageVerdict {
    let (status, headline) = headline(plan, listing, is_written);
    PageVerdict::new(status, headline, reasons(plan, listing))
}

/// The first that holds.
fn headline(plan: &Plan, listing: &Listing, is_written: bool) -> (Status, &'static str) {
    let to_check = count(plan, MotionStatus::Refused) + count(plan, MotionStatus::Flagged) > 0;
    let is_right = |outcome: &MotionOutcome| outcome.reason() == Some(OutcomeReason::NoChange);
    let (at_risk, _) = placement::left_at_risk(plan);
    if written(plan) == 0 {
        return match to_check {
            true => (Status::Bad, "Nothing could be corrected"),
            false if !plan.outcomes.is_empty() && plan.outcomes.iter().all(is_right) => (
                Status::NotEvaluated,
                "Nothing to correct: every number is already right to its last decimal",
            ),
            false if at_risk > 0 => (
                Status::NotEvaluated,
                "Nothing was corrected: the model is too uncertain where the program cuts",
            ),
            false => (Status::NotEvaluated, "Nothing was corrected"),
        };
    }
    let warnings = [
        (
            no_cut(plan, listing),
            "No cut was corrected, only moves between cuts: the workpiece deviates as before",
        ),
        (
            is_again(listing),
            "Corrected a second time: both corrections add up, so the remaining deviation cannot be stated",
        ),
        (to_check, "Corrected, but check the refused and flagged motions before running the program"),
        (at_risk > 0, "Corrected, except for cuts where the model is too uncertain: these are unchanged"),
        (
            !listing.opaque.is_empty(),
            "Corrected, but parts of the program could not be read: check them before running the program",
        ),
        (
            plan.steps.is_some(),
            "Corrected, but the path steps next to uncorrected motions: check them before running the program",
        ),
        (
            !listing.nc.open_controls.is_empty(),
            "Corrected, but nothing says which control the program is for: state it before running the program",
        ),
        (
            !listing.nc.unstated_lengths.is_empty(),
            "Corrected as if the tool length were active, but no G43 activates it: program G43, or G49 if it is not meant to be active, before \
             running the program",
        ),
        (
            !listing.nc.unstated_turns.is_empty(),
            "Corrected as if the turn about the tool vector were 0, but no word states it: state it, or A, B and C, before running the program",
        ),
        (
            !listing.mains.is_empty(),
            "Corrected as one task, but several files begin a program: if they are no modules of one task, give --each",
        ),
        (
            !listing.nc.replaced_frames.is_empty(),
            "Corrected, but the program sets a tool or work offset to another value than the cell file or a comment states: correct the one that \
             is wrong before running the program",
        ),
        (
            depends_on_call(plan, listing),
            "Corrected, but a call of another program may change the modal state, and each NC program is read by itself: state it again after the \
             call, or check the motions there",
        ),
        (
            !plan.unstated_axes.is_empty(),
            "Corrected as if the robot base never moves: state what the external axes carry before running the program",
        ),
        (
            plan.unknown_loads > 0,
            "Corrected, but where GripLoad sets the load at run time only the load of the tool is used: check these motions before running the \
             program",
        ),
        (
            plan.other_loads > 0,
            "Corrected, but the program carries another load than the measurement did, and the deflection of this arm is known for that one alone: \
             measure the arm with the load of the program, or check these motions before running it",
        ),
        (
            plan.is_overloaded,
            "Corrected for a mass far above what the robot is rated for: check it before running the program",
        ),
        (
            plan.has_tip_in_wrist,
            "Corrected for a tool whose tip lies within the wrist: check its frame before running the program",
        ),
        (
            paths(plan, listing)[2] > 0,
            "Corrected, except for some lines or arcs, where the workpiece deviates as before",
        ),
        (
            left_cycles(listing) > 0,
            "Corrected, except for canned cycles: their holes and pockets keep their old error next to corrected paths",
        ),
    ];
    match warnings.into_iter().find(|(holds, _)| *holds) {
        Some((_, headline)) => (Status::Warning, headline),
        None if is_written && plan.assumes_origins => (
            Status::Good,
            "All correctable motions are corrected: the program may run if tools and work objects whose origin nobody stated are exactly where it \
             says",
        ),
        None if is_written => (Status::Good, "All correctable motions are corrected: the program may run"),
        None => (Status::Good, "All correctable motions would be corrected; nothing was written"),
    }
}

/// Whether a corrected motion stands behind a call of a program that is in none of the files, which may change offsets, tool or units.
fn depends_on_call(plan: &Plan, listing: &Listing) -> bool {
    let file = |motion: u32| listing.motions.get(motion as usize).map(|motion| motion.place.file);
    let is_behind = |call: u32| {
        let behind = plan.outcomes.iter().filter(|outcome| outcome.motion > call);
        behind.filter(|outcome| outcome.status.is_written()).any(|outcome| file(outcome.motion) == file(call))
    };
    // The first call of each file has the most behind it.
    let mut files = std::collections::BTreeSet::new();
    let calls = listing.nc.external_calls.iter().filter(|call| files.insert(file(**call)));
    calls.copied().any(is_behind)
}

/// Everything that the headline rests on, the figures first.
fn reasons(plan: &Plan, listing: &Listing) -> Vec<String> {
    let is_any_written = written(plan) > 0;
    let mut reasons = deviations(plan, listing);
    reasons.push(coverage(plan));
    reasons.extend(left_paths(plan, listing).filter(|_| is_any_written));
    reasons.extend(left_cycles_reason(listing).filter(|_| is_any_written));
    reasons.extend(at_risk_reason(plan));
    reasons.extend(placement::risk(plan).filter(|_| !is_again(listing)));
    if is_any_written && count(plan, MotionStatus::Refused) > 0 {
        reasons.push(refused_steps(plan));
    }
    reasons.extend(plan.steps.as_ref().map(|steps| steps.sentence(listing)));
    reasons.extend(cuts_reason(plan));
    reasons.extend(opaque_reason(listing));
    reasons.extend(inserted_reason(plan));
    reasons
}

/// The steps beside refused motions, with the largest correction of the program: none of them is larger.
fn refused_steps(plan: &Plan) -> String {
    let corrected = plan.outcomes.iter().filter(|outcome| outcome.status.is_written());
    let most_mm = corrected.filter_map(|outcome| outcome.before_mm.get()).reduce(f64::max);
    let size = most_mm.map_or_else(String::new, |mm| format!(", here up to about {mm:.2} mm"));
    format!(
        "refused motions are not corrected: between them and their corrected neighbours the path steps by the size of the correction{size}"
    )
}

fn left_cycles_reason(listing: &Listing) -> Option<String> {
    match left_cycles(listing) {
        0 => None,
        1 => Some("1 canned cycle is not corrected: its motions are not in the program".to_owned()),
        count => {
            Some(format!("{count} canned cycles are not corrected: their motions are not in the program"))
        }
    }
}

fn at_risk_reason(plan: &Plan) -> Option<String> {
    let (at_risk, cuts) = placement::left_at_risk(plan);
    let are_not = match (at_risk, cuts) {
        (0, _) => return None,
        (_, 1) => "the only cut is not corrected, since that would make it".to_owned(),
        (1, _) => format!("1 of {cuts} cuts is not corrected, since that would make it"),
        _ => format!("{at_risk} of {cuts} cuts are not corrected, since that would make them"),
    };
    Some(format!(
        "{are_not} worse with a probability above --max-risk. Measure more poses near the path (`truegrind plan`)"
    ))
}

/// Motions that are kept for the sake of others of their cut.
fn cuts_reason(plan: &Plan) -> Option<String> {
    let kept = |reason: &OutcomeReason| {
        matches!(reason, OutcomeReason::PartOfCut { .. } | OutcomeReason::Step { .. })
    };
    let kept = plan.outcomes.iter().filter(|outcome| outcome.reason.as_deref().is_some_and(kept)).count();
    let (motions, own) = if kept == 1 { ("motion is", "its") } else { ("motions are", "their") };
    (kept > 0).then(|| {
        format!(
            "{kept} correctable {motions} not corrected, since another motion of {own} cut cannot be: correcting a part of a cut would \
             leave a step in the workpiece"
        )
    })
}

fn opaque_reason(listing: &Listing) -> Option<String> {
    match listing.opaque.len() {
        0 => None,
        1 => Some("1 region could not be read and is unchanged; motions in it are not corrected".to_owned()),
        count => Some(format!(
            "{count} regions could not be read and are unchanged; motions in them are not corrected"
        )),
    }
}

fn inserted_reason(plan: &Plan) -> Option<String> {
    let inserted: usize = plan.outcomes.iter().map(|outcome| outcome.inserted as usize).sum();
    let targets = if inserted == 1 { "target" } else { "targets" };
    (inserted > 0).then(|| {
        format!("{inserted} {targets} inserted, to keep the path within the tolerance between targets")
    })
}

/// Lines and arcs on which the tool may cut: how many, how many of them are right or corrected, and how many are uncorrected.
fn paths(plan: &Plan, listing: &Listing) -> [usize; 3] {
    let mut found = [0; 3];
    // Nothing is cut on a lift from wherever the robot stands.
    let is_lift =
        |outcome: &MotionOutcome| outcome.reason() == Some(OutcomeReason::Program(Reason::CurrentPosition));
    for outcome in plan.outcomes.iter().filter(|outcome| !is_lift(outcome)) {
        if is_path(&listing.motions[outcome.motion as usize]) {
            let right = outcome.reason() == Some(OutcomeReason::NoChange);
            found[0] += 1;
            found[1] += usize::from(right || outcome.status.is_written());
            found[2] += usize::from(!right && outcome.status == MotionStatus::Left);
        }
    }
    found
}

/// Whether the program has cuts and all of them are unchanged.
fn no_cut(plan: &Plan, listing: &Listing) -> bool {
    let [all, corrected, _] = paths(plan, listing);
    all > 0 && corrected == 0 || !plan.cuts.is_empty() && plan.cuts.iter().all(|cut| !cut.corrected)
}

/// Sentence on uncorrected lines and arcs; `None` without any.
fn left_paths(plan: &Plan, listing: &Listing) -> Option<String> {
    match paths(plan, listing) {
        [_, _, 0] => None,
        [_, _, 1] => Some("1 line or arc on which the tool may cut is not corrected".to_owned()),
        [_, _, left] => Some(format!("{left} lines or arcs on which the tool may cut are not corrected")),
    }
}

/// Canned cycles that make something; those that are defined for later make nothing.
fn left_cycles(listing: &Listing) -> usize {
    let makes =
        |motion: &&Motion| motion.own_reason == Some(Reason::Cycle) && &*motion.instruction != "CYCL DEF";
    listing.motions.iter().filter(makes).count()
}

/// Whether the program was corrected before: its numbers are then no longer those that were intended, which before, after and risk refer to.
fn is_again(listing: &Listing) -> bool {
    listing.marks.iter().any(Option::is_some)
}

/// Whether the deviation of every line and arc on which the tool may cut is unknown: that of the other motions says nothing of the part.
fn paths_unknown(plan: &Plan, listing: &Listing) -> bool {
    let mut of_paths =
        plan.outcomes.iter().filter(|outcome| is_path(&listing.motions[outcome.motion as usize])).peekable();
    of_paths.peek().is_some() && of_paths.all(|outcome| outcome.before_mm.get().is_none())
}

/// Deviation before and after, in a sentence for each kind of correction; empty if unknown.
fn deviations(plan: &Plan, listing: &Listing) -> Vec<String> {
    if is_again(listing) {
        return vec![
            "this program was already corrected (its mark says so), so deviation and risk cannot be stated; correct the original program instead"
                .to_owned(),
        ];
    }
    let found = if no_cut(plan, listing) { Vec::new() } else { placement::before_and_after(plan, listing) };
    if found.is_empty() {
        if paths_unknown(plan, listing) {
            return vec!["by how much the uncorrected program deviates where it cuts is unknown".to_owned()];
        }
        let unknown = plan.outcomes.iter().filter(|outcome| outcome.before_mm.get().is_none()).count();
        let where_known = match unknown {
            0 => String::new(),
            1 => "; unknown at 1 motion".to_owned(),
            _ => format!("; unknown at {unknown} motions"),
        };
        let uncorrected =
            |mm: f64| format!("the uncorrected program deviates by up to {mm:.3} mm{where_known}");
        return placement::largest_mm(plan).map(uncorrected).into_iter().collect();
    }
    let of_kind = |of: &BeforeAndAfter| {
        let kind = match (of.shape_only, found.len()) {
            (true, _) => " (shape only)",
            (false, 1) => "",
            (false, _) => " (shape and placement)",
        };
        let (before, after) = (of.before_mm, of.expected_mm?);
        // Otherwise the two figures read as if the correction did harm.
        let besides = if after > before { "; uncorrected it has that uncertainty besides" } else { "" };
        Some(format!(
            "largest deviation of the corrected motions{kind}: {before:.3} mm before; after correction a standard deviation (1σ) of at most \
             {after:.3} mm is expected{besides}"
        ))
    };
    found.iter().filter_map(of_kind).collect()
}

/// Largest deviations before and after.
fn deviation_figures(plan: &Plan, listing: &Listing) -> Vec<KeyFigure> {
    let before = |mm: Option<f64>, note: String| KeyFigure::new("Largest before", mm, 3, "mm").note(note);
    let after = |mm: Option<f64>, note: String| KeyFigure::new("Expected after", mm, 3, "mm").note(note);
    let nothing = |why: &str| {
        vec![
            before(
                placement::largest_mm(plan).filter(|_| !paths_unknown(plan, listing)),
                "uncorrected, all motions".to_owned(),
            ),
            after(None, why.to_owned()),
        ]
    };
    if is_again(listing) {
        return vec![before(None, "corrected before".to_owned()), after(None, "corrected before".to_owned())];
    }
    if no_cut(plan, listing) {
        return nothing("no cut is corrected");
    }
    let of_kind = |of: BeforeAndAfter| {
        let what = if of.shape_only { "of the shape" } else { "shape and placement" };
        let said = match of.expected_mm {
            Some(_) => format!("{what}, 1σ: largest of the corrected motions"),
            None => "the model has no σ here".to_owned(),
        };
        [before(Some(of.before_mm), format!("{what}, corrected motions")), after(of.expected_mm, said)]
    };
    match placement::before_and_after(plan, listing) {
        found if found.is_empty() => nothing("nothing is corrected"),
        found => found.into_iter().flat_map(of_kind).collect(),
    }
}

pub(super) fn key_figures(plan: &Plan, listing: &Listing) -> Vec<KeyFigure> {
    let all = plan.outcomes.len();
    let mut figures = deviation_figures(plan, listing);
    if let Some(chance) = plan.probability_of_harm.filter(|_| !is_again(listing)) {
        figures.push(
            KeyFigure::new("Probability of worse", percent_of(chance), 0, "")
                .note("all corrected cuts together"),
        );
    }
    let [changed, flagged, refused, left] = STATUSES.map(|status| count(plan, status));
    let rewritten = changed + flagged;
    let share = if all > 0 { format!("{} of {all} motions; ", share(rewritten, all)) } else { String::new() };
    figures.push(
        KeyFigure::new("Corrected", rewritten, 0, "")
            .note(format!("{share}{flagged} of them flagged; {refused} refused, {left} left")),
    );
    figures
}

/// One sentence: how many motions were changed, flagged, refused and left, with their shares.
pub fn coverage(plan: &Plan) -> String {
    let all = plan.outcomes.len();
    if all == 0 {
        return "the program contains no motion".to_owned();
    }
    let of = |status: MotionStatus| {
        let found = count(plan, status);
        format!("{found} {} ({})", status_word(status), share(found, all))
    };
    let flagged = count(plan, MotionStatus::Flagged);
    let written = written(plan);
    let of_which = match flagged {
        0 => String::new(),
        1 => ", of which 1 is flagged".to_owned(),
        _ => format!(", of which {flagged} are flagged"),
    };
    let parts = [
        format!("{written} corrected ({}){of_which}", share(written, all)),
        of(MotionStatus::Refused),
        of(MotionStatus::Left),
    ];
    let word = if all == 1 { "motion" } else { "motions" };
    format!("{all} {word}: {}", parts.join("; "))
}

/// Share in per cent; 100 % only if complete, 0 % only if empty.
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

/// How many motions are rewritten.
fn written(plan: &Plan) -> usize {
    plan.outcomes.iter().filter(|outcome| outcome.status.is_written()).count()
}

fn count(plan: &Plan, motion_status: MotionStatus) -> usize {
    plan.outcomes.iter().filter(|outcome| outcome.status == motion_status).count()
}
