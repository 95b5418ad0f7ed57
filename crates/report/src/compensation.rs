//! What became of each motion of a program: the contract `truegrind.compensation/1`, the table, the reasons, the page.

mod first;

use serde_json::{Value, json};

use self::first::key_figures;
use super::deviation::{fate, fate_word, sections};
use super::document::{Block, Document};
use super::placement;
use super::table::{Cell, Column, Table};
use truegrind_arm::inverse::InverseError;
use truegrind_compensation::deviation::{PathReport, Status as Fate};
use truegrind_compensation::plan::reason::OutcomeReason;
use truegrind_compensation::plan::{MotionOutcome, Plan};
use truegrind_programs::motion::{Listing, Place};

pub use self::first::{coverage, verdict};

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

/// Rows of the table of motions on a page, some eight sheets of paper; a longer table belongs in the CSV file.
const ROWS_ON_PAGE: usize = 600;

/// Motions that are named as the farthest off.
const FARTHEST: usize = 8;

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
            outcome.path_deviation_mm.into(),
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
    let mut table = without_empty_columns(table(plan, listing, files));
    table.title.clear();
    table.excerpt(ROWS_ON_PAGE)
}

fn without_empty_columns(mut table: Table) -> Table {
    for column in (0..table.columns.len()).rev() {
        if table.rows.iter().all(|row| row[column] == Cell::Missing) {
            table.columns.remove(column);
            table.rows.iter_mut().for_each(|row| drop(row.remove(column)));
        }
    }
    table
}

/// The motions that are farthest off as programmed, the farthest first; `None` where no deviation is known.
fn farthest(plan: &Plan, listing: &Listing, files: &[ProgramFile]) -> Option<Table> {
    let mut known: Vec<(f64, &MotionOutcome)> =
        plan.outcomes.iter().filter_map(|outcome| Some((outcome.before_mm?, outcome))).collect();
    known.sort_by(|a, b| b.0.total_cmp(&a.0));
    known.truncate(FARTHEST);
    let only =
        Plan { outcomes: known.into_iter().map(|(_, outcome)| outcome.clone()).collect(), ..Plan::default() };
    let mut table = without_empty_columns(table(&only, listing, files));
    table.title = "Farthest off as programmed".to_owned();
    table.notes.clear();
    (!table.rows.is_empty()).then_some(table)
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
        "chance_of_worse": plan.probability_of_harm,
    })
}

/// What fits a terminal: verdict with coverage, reasons, what could not be read, notes on tools and work objects.
pub fn summary(plan: &Plan, listing: &Listing, files: &[ProgramFile]) -> Document {
    let mut page = heading(plan, files);
    page.push(verdict(plan, listing));
    let reasons = reason_table(plan, listing, files);
    if !reasons.rows.is_empty() {
        page.push(reasons);
    }
    if !listing.opaque.is_empty() {
        page.push(opaque_table(listing, files));
    }
    let notes = [placement::sentences(plan, listing), plan.notes.clone()].concat();
    if !notes.is_empty() {
        page.push(Block::List(notes));
    }
    page
}

/// The page, with the deviation of the path where reports are given.
pub fn document(plan: &Plan, listing: &Listing, files: &[ProgramFile], reports: &[PathReport]) -> Document {
    let mut page = heading(plan, files);
    page.push(verdict(plan, listing));
    page.push(key_figures(plan));
    let reasons = reason_table(plan, listing, files);
    if !reasons.rows.is_empty() {
        page.push(reasons);
    }
    if let Some(farthest) = farthest(plan, listing, files) {
        page.push(farthest);
    }
    let placed = placement::sentences(plan, listing);
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

fn heading(plan: &Plan, files: &[ProgramFile]) -> Document {
    let names: Vec<&str> = files.iter().map(|file| file.file.as_str()).collect();
    let mut page = Document::new(match names.as_slice() {
        // The name alone: where it lies is in the tables and the JSON.
        [name] => format!("Compensation of {}", name.rsplit(['/', '\\']).next().unwrap_or(name)),
        _ => format!("Compensation of {} files", names.len()),
    });
    let outputs: Vec<&str> = files.iter().filter_map(|file| file.output.as_deref()).collect();
    page.subtitle = match outputs.as_slice() {
        [] => "nothing was written".to_owned(),
        outputs => {
            let same = plan.outcomes.iter().all(|o| matches!(o.status, Fate::Left | Fate::Refused));
            let as_it_was = if same { ", byte for byte as it was" } else { "" };
            format!("written to {}{as_it_was}", outputs.join(", "))
        }
    };
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
fn kind(why: &OutcomeReason) -> (String, Option<(f64, &'static str)>) {
    let plain = |text: &str| (text.to_owned(), None);
    let sized = |text: String, value: f64, unit| (text, Some((value, unit)).filter(|_| value.is_finite()));
    match *why {
        OutcomeReason::Inverse(InverseError::Unreachable { beyond_mm }) => {
            sized("target is out of reach".to_owned(), beyond_mm, "mm")
        }
        OutcomeReason::Inverse(InverseError::OtherConfiguration { .. }) => {
            plain("target is not reachable in its configuration")
        }
        OutcomeReason::Inverse(InverseError::OtherBranch { .. }) => {
            plain("target is reachable only in another configuration")
        }
        OutcomeReason::Inverse(InverseError::Abandoned) => {
            plain("its joints were not sought to the end: too many targets had to be searched for")
        }
        OutcomeReason::Inverse(InverseError::NotConverged { .. }) => plain("no joints were found"),
        OutcomeReason::CorrectionTooLarge { mm } => {
            sized("correction exceeds the bound (--max-correction)".to_owned(), mm, "mm")
        }
        OutcomeReason::RotationTooLarge { deg } => {
            sized("correction of the orientation exceeds the bound".to_owned(), deg, "°")
        }
        OutcomeReason::JointJump { joint, deg, on_the_way, .. } => sized(
            format!(
                "{}the correction would turn joint {} too far near a singularity",
                if on_the_way { "on the way to it " } else { "" },
                joint + 1
            ),
            deg,
            "°",
        ),
        OutcomeReason::PathDeviation { mm } => {
            sized("the path between targets leaves the intended one".to_owned(), mm, "mm")
        }
        OutcomeReason::TooFast { joint, ratio } => sized(
            format!("at the programmed speed joint {} turns faster than it can", joint + 1),
            ratio,
            "× limit",
        ),
        OutcomeReason::JointNotMeasured { joint, by_deg } => sized(
            format!("joint {} is outside the range in which the arm was measured", joint + 1),
            by_deg,
            "°",
        ),
        OutcomeReason::PartOfCut { because, .. } => plain(&format!(
            "its cut is corrected as a whole or not at all, and another motion stays: {because}"
        )),
        OutcomeReason::Step { mm, .. } => {
            sized("the step to a motion of the same cut that stays exceeds --tolerance".to_owned(), mm, "mm")
        }
        OutcomeReason::Risk { chance } => {
            sized("the correction may well make the cut worse (--max-risk)".to_owned(), 100.0 * chance, "%")
        }
        OutcomeReason::NotCovered { ratio } => sized("no measured pose is near".to_owned(), ratio, "×"),
        OutcomeReason::Uncertain { sigma_mm } => {
            sized("the model is uncertain here".to_owned(), sigma_mm, "mm σ")
        }
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
