//! What became of each motion of a program: the contract `truegrind.compensation/1`, the table, the reasons, the page.

use serde_json::{Value, json};

use super::deviation::{fate, fate_word, sections};
use super::document::{Block, Document, KeyFigure, Verdict};
use super::placement;
use super::status::Status;
use super::table::{Cell, Column, Table};
use truegrind_arm::inverse::InverseError;
use truegrind_compensation::deviation::{PathReport, Status as Fate};
use truegrind_compensation::rewrite::{MotionOutcome, Plan};
use truegrind_compensation::why::Why;
use truegrind_programs::motion::{Listing, Place};

/// One file of a program, by name.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct ProgramFile {
    /// The file that was read.
    pub file: String,
    /// The file that was written; `None` where nothing was (dry run).
    pub output: Option<String>,
}

/// Lines that a reason names before it says "and so many more".
const LINES_NAMED: usize = 6;

/// Rows of the table of motions on a page; the whole table belongs in the CSV file.
const ROWS_ON_PAGE: usize = 150;

/// All, in the order in which a reader wants them.
const FATES: [Fate; 4] = [Fate::Changed, Fate::Flagged, Fate::Refused, Fate::Left];

/// One row per motion. `files` in the order in which the listing counts them.
pub fn table(plan: &Plan, listing: &Listing, files: &[ProgramFile]) -> Table {
    let several = files.len() > 1;
    let mut columns = vec![
        Column::count("line", "Line"),
        Column::text("instruction", "Instruction"),
        Column::text("status", "Status"),
        Column::number("before_mm", "before", "mm", 3),
        Column::number("after_mm", "remainder", "mm", 4),
        Column::number("shape_sigma_mm", "1σ shape", "mm", 3),
        Column::number("sigma_mm", "1σ place", "mm", 3),
        Column::number("bend_mm", "bend", "mm", 3),
        Column::count("inserted", "Inserted"),
        Column::text("reason", "Reason"),
    ];
    if several {
        columns.insert(0, Column::text("file", "File"));
    }
    let mut table = Table::new("Motions", columns);
    for outcome in &plan.outcomes {
        let (place, instruction) = motion(outcome, listing);
        let mut row = vec![
            Cell::Count(u64::from(place.line)),
            instruction.into(),
            fate(outcome.status),
            outcome.before_mm.into(),
            outcome.after_mm.into(),
            outcome.shape_sigma_mm.into(),
            outcome.sigma_mm.into(),
            outcome.bend_mm.into(),
            if outcome.inserted > 0 { outcome.inserted.into() } else { Cell::Missing },
            outcome.reason.map(|reason| reason.to_string()).into(),
        ];
        if several {
            row.insert(0, file_name(files, place).into());
        }
        table.push(row);
    }
    table.notes.push(
        "before: how far the tool is off at the end of the motion as programmed. remainder: the predicted remainder, what \
         rounding and inverse kinematics leave under the same model; a motion that is left or refused keeps its deviation. \
         1σ is predicted from the covariance of the model: of the shape of the cut, after its best rigid registration, and of \
         its place. bend: how far the path to this end leaves the intended one \
         between targets; inserted: targets put in before it."
            .to_owned(),
    );
    table
}

/// [`table`] for a page: not too long, and without columns in which nothing stands.
fn page_table(plan: &Plan, listing: &Listing, files: &[ProgramFile]) -> Table {
    let mut table = table(plan, listing, files);
    table.title.clear();
    for column in (0..table.columns.len()).rev() {
        if table.rows.iter().all(|row| row[column] == Cell::Missing) {
            table.columns.remove(column);
            table.rows.iter_mut().for_each(|row| drop(row.remove(column)));
        }
    }
    table.excerpt(ROWS_ON_PAGE)
}

/// Reasons why motions were left, refused or flagged, with counts and first lines; the most frequent first within each
/// status.
pub fn reason_table(plan: &Plan, listing: &Listing, files: &[ProgramFile]) -> Table {
    let mut table = Table::new(
        "Reasons",
        vec![
            Column::text("status", "Status"),
            Column::count("motions", "Motions"),
            Column::text("reason", "Reason"),
            Column::text("worst", "Worst"),
            Column::text("lines", "Lines"),
        ],
    );
    for group in grouped(plan) {
        let places: Vec<Place> = group.outcomes.iter().map(|outcome| motion(outcome, listing).0).collect();
        table.push([
            fate(group.fate),
            group.outcomes.len().into(),
            group.reason.into(),
            group.worst.map(|(value, unit)| worst_text(value, unit)).into(),
            lines(&places, files).into(),
        ]);
    }
    table
}

/// The contract `truegrind.compensation/1`. `output` is `null` where nothing was written.
pub fn json(plan: &Plan, listing: &Listing, files: &[ProgramFile]) -> Value {
    let programs: Vec<Value> = files
        .iter()
        .enumerate()
        .map(|(index, file)| {
            let here = |place: &Place| place.file as usize == index;
            let opaque: Vec<Value> = listing
                .opaque
                .iter()
                .filter(|region| here(&region.place))
                .map(|region| json!({ "line": region.place.line, "reason": region.reason.text() }))
                .collect();
            let motions: Vec<Value> = plan
                .outcomes
                .iter()
                .map(|outcome| (outcome, motion(outcome, listing)))
                .filter(|(_, (place, _))| here(place))
                .map(|(outcome, (place, instruction))| {
                    json!({
                        "line": place.line,
                        "instruction": instruction,
                        "status": fate_word(outcome.status),
                        "reason": outcome.reason.map(|reason| reason.to_string()),
                        "before_mm": outcome.before_mm,
                        "after_mm": outcome.after_mm,
                        "sigma_mm": outcome.sigma_mm,
                        "shape_sigma_mm": outcome.shape_sigma_mm,
                    })
                })
                .collect();
            json!({
                "file": file.file,
                "output": file.output,
                "opaque_regions": opaque,
                "motions": motions,
            })
        })
        .collect();
    let [placements, cuts] = placement::json(plan, listing);
    json!({
        "schema": "truegrind.compensation/1",
        "programs": programs,
        "placements": placements,
        "cuts": cuts,
        "chance_of_worse": plan.chance_of_worse,
    })
}

/// What fits a terminal: verdict with coverage, reasons, what could not be read, notes on tools and work objects.
pub fn summary(plan: &Plan, listing: &Listing, files: &[ProgramFile]) -> Document {
    let mut page = heading(files);
    page.push(verdict(plan, listing));
    let reasons = reason_table(plan, listing, files);
    if !reasons.rows.is_empty() {
        page.push(reasons);
    }
    if !listing.opaque.is_empty() {
        page.push(opaque_table(listing, files));
    }
    let notes = [placement::sentences(plan), plan.notes.clone()].concat();
    if !notes.is_empty() {
        page.push(Block::List(notes));
    }
    page
}

/// The page, with the deviation of the path where reports are given.
pub fn document(plan: &Plan, listing: &Listing, files: &[ProgramFile], reports: &[PathReport]) -> Document {
    let mut page = heading(files);
    page.push(verdict(plan, listing));
    page.push(key_figures(plan));
    let reasons = reason_table(plan, listing, files);
    if !reasons.rows.is_empty() {
        page.push(reasons);
    }
    let placed = placement::sentences(plan);
    if !placed.is_empty() {
        page.heading(2, "Shape and place");
        page.push(Block::List(placed));
    }
    if let Some(mut cuts) = placement::cut_table(plan, listing) {
        page.heading(2, std::mem::take(&mut cuts.title));
        page.push(cuts);
    }
    if !plan.notes.is_empty() {
        page.heading(2, "Tools and work objects");
        page.push(Block::List(plan.notes.clone()));
    }
    let mut programs: Vec<&str> = Vec::new();
    for report in reports {
        if programs.contains(&report.program.as_str()) {
            continue;
        }
        programs.push(&report.program);
        let of: Vec<&PathReport> = reports.iter().filter(|r| r.program == report.program).collect();
        page.heading(2, format!("Deviation of {}", report.program));
        page.blocks.extend(sections(&of, 3));
    }
    page.heading(2, "Motions");
    page.push(page_table(plan, listing, files));
    if !listing.opaque.is_empty() {
        page.heading(2, "What could not be read");
        page.paragraph(
            "These regions are in the output as they were, byte for byte; motions inside them, if any, too.",
        );
        page.push(opaque_table(listing, files));
    }
    page
}

/// Regions that could not be read.
pub fn opaque_table(listing: &Listing, files: &[ProgramFile]) -> Table {
    let mut table = Table::new(
        "Not read, left as it is",
        vec![Column::text("file", "File"), Column::count("line", "Line"), Column::text("reason", "Reason")],
    );
    for region in &listing.opaque {
        table.push([
            file_name(files, region.place).into(),
            Cell::Count(u64::from(region.place.line)),
            region.reason.text().into(),
        ]);
    }
    table
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
    format!("{all} motions: {}", parts.join(", "))
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

fn heading(files: &[ProgramFile]) -> Document {
    let names: Vec<&str> = files.iter().map(|file| file.file.as_str()).collect();
    let mut page = Document::new(match names.as_slice() {
        // The name alone: where it lies is in the tables and the JSON.
        [name] => format!("Compensation of {}", name.rsplit(['/', '\\']).next().unwrap_or(name)),
        _ => format!("Compensation of {} files", names.len()),
    });
    let outputs: Vec<&str> = files.iter().filter_map(|file| file.output.as_deref()).collect();
    page.subtitle = match outputs.as_slice() {
        [] => "nothing was written".to_owned(),
        outputs => format!("written to {}", outputs.join(", ")),
    };
    page
}

/// How a rewrite is judged, the same on the terminal, on the page and in the exit code.
pub fn verdict(plan: &Plan, listing: &Listing) -> Verdict {
    let (refused, flagged) = (count(plan, Fate::Refused), count(plan, Fate::Flagged));
    let written = count(plan, Fate::Changed) + flagged;
    let (left, cuts) = placement::left(plan);
    let same = !plan.outcomes.is_empty() && plan.outcomes.iter().all(|o| o.reason == Some(Why::Same));
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
        (_, 0) => (Status::Good, "Everything that can be rewritten is rewritten"),
        _ => (Status::Warning, "Rewritten, but look at what was refused or flagged before the program runs"),
    };
    let mut reasons = vec![coverage(plan)];
    if left > 0 {
        reasons.push(format!(
            "{left} of {cuts} cuts stay as they are, since the correction makes them worse with a larger probability than \
             --max-risk takes"
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
    let steps = count_why(plan, |why| matches!(why, Why::PartOfCut { .. } | Why::Step { .. }));
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

fn count_why(plan: &Plan, is: impl Fn(&Why) -> bool) -> usize {
    plan.outcomes.iter().filter(|outcome| outcome.reason.as_ref().is_some_and(&is)).count()
}

fn key_figures(plan: &Plan) -> Vec<KeyFigure> {
    let all = plan.outcomes.len();
    let worst = |value: fn(&MotionOutcome) -> Option<f64>, only: fn(Fate) -> bool| {
        plan.outcomes.iter().filter(|o| only(o.status)).filter_map(value).reduce(f64::max)
    };
    let rewritten: fn(Fate) -> bool = |fate| matches!(fate, Fate::Changed | Fate::Flagged);
    let mut figures: Vec<KeyFigure> = FATES
        .iter()
        .map(|&fate| {
            let found = count(plan, fate);
            let mut word = fate_word(fate).to_owned();
            word[..1].make_ascii_uppercase();
            let figure = KeyFigure::new(word, found, 0, "");
            if all > 0 { figure.note(format!("{} of {all} motions", share(found, all))) } else { figure }
        })
        .collect();
    figures.push(
        KeyFigure::new("Largest before", worst(|o| o.before_mm, |_| true), 3, "mm").note("all motions"),
    );
    let shape = placement::leads_with_shape(plan);
    let sigma = move |o: &MotionOutcome| if shape { o.shape_sigma_mm } else { o.sigma_mm };
    let expected = plan
        .outcomes
        .iter()
        .filter(|o| rewritten(o.status))
        .filter_map(|o| Some(o.after_mm?.hypot(sigma(o)?)))
        .reduce(f64::max);
    figures.push(KeyFigure::new("Expected after", expected, 3, "mm").note(if shape {
        "of the shape, 1σ: largest of the rewritten motions"
    } else {
        "1σ: largest of the rewritten motions"
    }));
    if let Some(chance) = plan.chance_of_worse {
        figures.push(
            KeyFigure::new("Chance to be worse", 100.0 * chance, 1, "%").note("the corrected cuts together"),
        );
    }
    figures
}

fn motion<'a>(outcome: &MotionOutcome, listing: &'a Listing) -> (Place, &'a str) {
    match listing.motions.get(outcome.motion as usize) {
        Some(motion) => (motion.place, &motion.instruction),
        None => (Place::default(), ""),
    }
}

fn file_name(files: &[ProgramFile], place: Place) -> &str {
    files.get(place.file as usize).map_or("", |file| file.file.as_str())
}

/// Motions with the same status and the same kind of reason.
struct Group<'a> {
    fate: Fate,
    reason: String,
    /// The figure of the reason farthest from what is wanted, with its unit.
    worst: Option<(f64, &'static str)>,
    outcomes: Vec<&'a MotionOutcome>,
}

fn grouped(plan: &Plan) -> Vec<Group<'_>> {
    let mut groups: Vec<Group<'_>> = Vec::new();
    for outcome in plan.outcomes.iter().filter(|outcome| outcome.status != Fate::Changed) {
        let (reason, figure) = match &outcome.reason {
            Some(why) => kind(why),
            None => ("nothing to change".to_owned(), None),
        };
        match groups.iter_mut().find(|group| group.fate == outcome.status && group.reason == reason) {
            Some(group) => {
                group.outcomes.push(outcome);
                group.worst = match (group.worst, figure) {
                    (Some(a), Some(b)) if b.0 > a.0 => Some(b),
                    (None, b) => b,
                    (a, _) => a,
                };
            }
            None => {
                groups.push(Group { fate: outcome.status, reason, worst: figure, outcomes: vec![outcome] })
            }
        }
    }
    let rank = |fate: Fate| [Fate::Refused, Fate::Flagged, Fate::Left].iter().position(|f| *f == fate);
    groups.sort_by(|a, b| rank(a.fate).cmp(&rank(b.fate)).then(b.outcomes.len().cmp(&a.outcomes.len())));
    groups
}

/// A reason without the numbers of one motion, and its number.
fn kind(why: &Why) -> (String, Option<(f64, &'static str)>) {
    let plain = |text: &str| (text.to_owned(), None);
    let sized = |text: String, value: f64, unit| (text, Some((value, unit)).filter(|_| value.is_finite()));
    match *why {
        Why::Inverse(InverseError::Unreachable { beyond_mm }) => {
            sized("target is out of reach".to_owned(), beyond_mm, "mm")
        }
        Why::Inverse(InverseError::OtherConfiguration { .. }) => {
            plain("target is not reachable in its configuration")
        }
        Why::Inverse(InverseError::OtherBranch { .. }) => {
            plain("target is reachable only in another configuration")
        }
        Why::Inverse(InverseError::Abandoned) => {
            plain("its joints were not sought to the end: too many targets had to be searched for")
        }
        Why::Inverse(InverseError::NotConverged { .. }) => plain("no joints were found"),
        Why::TooFar { mm } => sized("correction exceeds the bound (--max-correction)".to_owned(), mm, "mm"),
        Why::TooMuchTurn { deg } => {
            sized("correction of the orientation exceeds the bound".to_owned(), deg, "°")
        }
        Why::JointJump { joint, deg, on_the_way, .. } => sized(
            format!(
                "{}the correction would turn joint {} too far near a singularity",
                if on_the_way { "on the way to it " } else { "" },
                joint + 1
            ),
            deg,
            "°",
        ),
        Why::Bend { mm } => sized("the path between targets leaves the intended one".to_owned(), mm, "mm"),
        Why::TooFast { joint, ratio } => sized(
            format!("at the programmed speed joint {} turns faster than it can", joint + 1),
            ratio,
            "× limit",
        ),
        Why::JointNotMeasured { joint, by_deg } => sized(
            format!("joint {} is outside the range in which the arm was measured", joint + 1),
            by_deg,
            "°",
        ),
        Why::PartOfCut { because, .. } => plain(&format!(
            "its cut is corrected as a whole or not at all, and another motion stays: {because}"
        )),
        Why::Step { mm, .. } => {
            sized("the step to a motion of the same cut that stays exceeds --tolerance".to_owned(), mm, "mm")
        }
        Why::Risk { chance } => {
            sized("the correction may well make the cut worse (--max-risk)".to_owned(), 100.0 * chance, "%")
        }
        Why::NotCovered { ratio } => sized("no measured pose is near".to_owned(), ratio, "×"),
        Why::Uncertain { sigma_mm } => sized("the model is uncertain here".to_owned(), sigma_mm, "mm σ"),
        ref other => (other.to_string(), None),
    }
}

fn worst_text(value: f64, unit: &str) -> String {
    match unit {
        "°" => format!("{value:.2}°"),
        "×" => format!("{value:.1} times the usual distance"),
        "× limit" => format!("{value:.2} times its limit"),
        unit => format!("{value:.3} {unit}"),
    }
}

/// The first lines, by file where there are several: `a.mod 12, 14; b.mod 3 and 7 more`.
fn lines(places: &[Place], files: &[ProgramFile]) -> String {
    let mut text = String::new();
    let mut last_file = None;
    for place in places.iter().take(LINES_NAMED) {
        if files.len() > 1 && last_file != Some(place.file) {
            let gap = if text.is_empty() { "" } else { "; " };
            text.push_str(&format!("{gap}{} {}", file_name(files, *place), place.line));
        } else {
            let gap = if text.is_empty() { "" } else { ", " };
            text.push_str(&format!("{gap}{}", place.line));
        }
        last_file = Some(place.file);
    }
    if places.len() > LINES_NAMED {
        text.push_str(&format!(" and {} more", places.len() - LINES_NAMED));
    }
    text
}
