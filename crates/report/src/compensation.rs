//! Report on the compensation of a program: JSON `truegrind.compensation/1`, table of motions, reasons, page.

mod verdict;

use std::collections::{BTreeSet, HashMap};

use serde_json::{Value, json};

use self::verdict::key_figures;
use super::deviation::{Risk, sections, status_cell, status_word};
use super::document::{Block, Document};
use super::placement;
use super::table::Table;
use truegrind_compensation::deviation::{MotionStatus, PathReport};
use truegrind_compensation::plan::reason::{Figure, OutcomeReason};
use truegrind_compensation::plan::{MotionOutcome, Plan};
use truegrind_programs::motion::{Listing, Place};

pub use self::verdict::{coverage, verdict};

/// One file of a program, by name.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct ProgramFile {
    /// The file that was read.
    pub file: String,
    /// The file that was written; `None` in a dry run.
    pub output: Option<String>,
    /// Whether nothing in it was corrected: the written file is a copy, byte for byte.
    pub unchanged: bool,
}

/// Largest number of ranges of lines listed for a reason.
const MAX_RANGES: usize = 6;

/// Rows of the table of motions on a page (about eight printed pages); the CSV file has all.
const ROWS_ON_PAGE: usize = 600;

/// Rows of the table of largest deviations.
const MAX_LISTED: usize = 8;

/// One row per motion; `files` in the order of the listing.
pub fn table(plan: &Plan, listing: &Listing, files: &[ProgramFile]) -> Table {
    let motions = plan.outcomes.iter().map(|outcome| (outcome, motion(outcome, listing)));
    let mut rows = Table::of("Motions", motions);
    if files.len() > 1 {
        rows = rows.text("file", "File", |(_, (place, _))| file_name(files, *place));
    }
    rows.count("line", "Line", |(_, (place, _))| place.line as usize)
        .text("instruction", "Instruction", |(_, (_, instruction))| *instruction)
        .text("status", "Status", |(outcome, _)| status_cell(outcome.status))
        .number("before_mm", "before", "mm", 3, |(outcome, _)| outcome.before_mm.get())
        .number("after_mm", "remainder", "mm", 4, |(outcome, _)| outcome.after_mm.get())
        .number("shape_sigma_mm", "1σ shape", "mm", 3, |(outcome, _)| outcome.shape_sigma_mm.get())
        .number("sigma_mm", "1σ placement", "mm", 3, |(outcome, _)| outcome.sigma_mm.get())
        .number("bend_mm", "between", "mm", 3, |(outcome, _)| outcome.path_deviation_mm.get())
        .count("inserted", "Inserted", |(outcome, _)| {
            (outcome.inserted > 0).then_some(outcome.inserted as usize)
        })
        .text("reason", "Reason", |(outcome, _)| outcome.reason().map(|reason| reason.to_string()))
        .note(
            "before: deviation of the tool at the end of the uncorrected motion. remainder: what the model predicts is left after rounding and \
             inverse kinematics; uncorrected motions keep their deviation. 1σ: predicted from the covariance of the model, for the shape of the \
             cut (after the best rigid registration of all cuts on the part) and for its placement. between: deviation from the intended path \
             between the targets. Inserted: number of targets inserted before the end of the motion.",
        )
        .table()
}

/// [`table`] for a page: shortened and without empty columns.
fn page_table(plan: &Plan, listing: &Listing, files: &[ProgramFile]) -> Table {
    let mut table = table(plan, listing, files);
    table.remove_empty_columns();
    table.title.clear();
    table.shorten_repeated("reason");
    table.excerpt(ROWS_ON_PAGE)
}

/// The motions with the largest uncorrected deviations; `None` if no deviation is known.
fn largest_deviations(plan: &Plan, listing: &Listing, files: &[ProgramFile]) -> Option<Table> {
    let mut known: Vec<(f64, &MotionOutcome)> =
        plan.outcomes.iter().filter_map(|outcome| Some((outcome.before_mm.get()?, outcome))).collect();
    known.sort_by(|a, b| b.0.total_cmp(&a.0));
    known.truncate(MAX_LISTED);
    let only =
        Plan { outcomes: known.into_iter().map(|(_, outcome)| outcome.clone()).collect(), ..Plan::default() };
    let mut table = table(&only, listing, files);
    table.remove_empty_columns();
    // What the solver leaves is no answer to how far off the arm will be.
    if let Some(remainder) = table.column_index("after_mm") {
        table.remove_column(remainder);
    }
    table.title = "Largest deviations before correction".to_owned();
    table.shorten_repeated("reason");
    table.notes.clear();
    (!table.rows.is_empty()).then_some(table)
}

/// Reasons why motions were left, refused or flagged, with counts and first lines; most frequent first within each status.
pub fn reason_table(plan: &Plan, listing: &Listing, files: &[ProgramFile]) -> Table {
    Table::of("Reasons", grouped(plan))
        .text("status", "Status", |group| status_cell(group.status))
        .count("motions", "Motions", |group| group.outcomes.len())
        .text("reason", "Reason", with_causes)
        .text("worst", "Worst", |group| group.worst.map(|figure| figure.to_string()))
        .text("lines", "Lines", |group| lines(&group.outcomes, listing, files))
        .table()
}

/// JSON report, schema `truegrind.compensation/1`. `output` is `null` if nothing was written.
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
                        "status": status_word(outcome.status),
                        "reason": outcome.reason().map(|reason| reason.to_string()),
                        "before_mm": outcome.before_mm.get(),
                        "after_mm": outcome.after_mm.get(),
                        "sigma_mm": outcome.sigma_mm.get(),
                        "shape_sigma_mm": outcome.shape_sigma_mm.get(),
                    })
                })
                .collect();
            json!({
                "file": file.file,
                "output": file.output,
                "unchanged": file.unchanged,
                "opaque_regions": opaque,
                "motions": motions,
            })
        })
        .collect();
    let [placements, cuts] = placement::json(plan, listing);
    let verdict = verdict(plan, listing, is_written(files));
    json!({
        "schema": "truegrind.compensation/1",
        "verdict": { "status": verdict.status.word(), "headline": verdict.headline },
        "programs": programs,
        "placements": placements,
        "cuts": cuts,
        "chance_of_worse": plan.probability_of_harm,
    })
}

/// Whether the corrected program is written.
fn is_written(files: &[ProgramFile]) -> bool {
    files.iter().any(|file| file.output.is_some())
}

/// Summary for the terminal: verdict, reasons, unread regions, notes on tools and work objects.
pub fn summary(plan: &Plan, listing: &Listing, files: &[ProgramFile]) -> Document {
    let mut page = heading(plan, files);
    page.push(verdict(plan, listing, is_written(files)));
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

/// The page, including the deviation of the path if reports are given.
pub fn document(plan: &Plan, listing: &Listing, files: &[ProgramFile], reports: &[PathReport]) -> Document {
    let mut page = heading(plan, files);
    page.push(verdict(plan, listing, is_written(files)));
    page.push(key_figures(plan, listing));
    let reasons = reason_table(plan, listing, files);
    if !reasons.rows.is_empty() {
        page.push(reasons);
    }
    if let Some(largest) = largest_deviations(plan, listing, files) {
        page.push(largest);
    }
    let placed = placement::sentences(plan, listing);
    if !placed.is_empty() {
        page.heading(2, "Shape and placement");
        page.push(Block::List(placed));
    }
    if let Some(mut cuts) = placement::cut_table(plan, listing) {
        page.heading(2, std::mem::take(&mut cuts.title));
        page.push(cuts);
    }
    if !plan.notes.is_empty() {
        page.heading(2, "Notes");
        page.push(Block::List(plan.notes.clone()));
    }
    let risk = if plan.probability_of_harm.is_some() { Risk::Stated } else { Risk::Unstated };
    let mut programs: Vec<&str> = Vec::new();
    for report in reports {
        if programs.contains(&report.program.as_str()) {
            continue;
        }
        programs.push(&report.program);
        let of: Vec<&PathReport> = reports.iter().filter(|r| r.program == report.program).collect();
        page.heading(2, format!("Deviation of {}", report.program));
        page.blocks.extend(sections(&of, 3, risk));
    }
    page.heading(2, "Motions");
    page.push(page_table(plan, listing, files));
    if !listing.opaque.is_empty() {
        page.heading(2, "Regions that could not be read");
        page.paragraph("These regions, and any motions in them, are copied to the output byte for byte.");
        page.push(opaque_table(listing, files));
    }
    page
}

fn heading(plan: &Plan, files: &[ProgramFile]) -> Document {
    let names: Vec<&str> = files.iter().map(|file| file.file.as_str()).collect();
    let mut page = Document::new(match names.as_slice() {
        // The file name alone; the path is in the tables and the JSON.
        [name] => format!("Compensation of {}", name.rsplit(['/', '\\']).next().unwrap_or(name)),
        _ => format!("Compensation of {} files", names.len()),
    });
    let outputs: Vec<&str> = files.iter().filter_map(|file| file.output.as_deref()).collect();
    page.subtitle = match outputs.as_slice() {
        [] => "nothing was written".to_owned(),
        outputs => {
            let same =
                plan.outcomes.iter().all(|o| matches!(o.status, MotionStatus::Left | MotionStatus::Refused));
            let unchanged = if same { ", unchanged byte for byte" } else { "" };
            format!("written to {}{unchanged}", outputs.join(", "))
        }
    };
    page
}

/// Regions that could not be read.
pub fn opaque_table(listing: &Listing, files: &[ProgramFile]) -> Table {
    Table::of("Not read, left unchanged", &listing.opaque)
        .text("file", "File", |region| file_name(files, region.place))
        .count("line", "Line", |region| region.place.line as usize)
        .text("reason", "Reason", |region| region.reason.text())
        .table()
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
    status: MotionStatus,
    reason: Option<OutcomeReason>,
    /// The worst value of the reason.
    worst: Option<Figure>,
    outcomes: Vec<&'a MotionOutcome>,
}

/// The reason, with the joints that it is about, and the lines of the motions that caused it.
fn with_causes(group: &Group<'_>) -> String {
    let kind = match group.reason {
        Some(OutcomeReason::PartOfCut { because, .. }) => format!(
            "a cut is corrected as a whole or not at all, and another motion of this cut is not corrected: {because}"
        ),
        Some(reason) => reason.kind().to_owned(),
        None => "nothing to change".to_owned(),
    };
    let reasons = || group.outcomes.iter().filter_map(|outcome| outcome.reason());
    let joints: BTreeSet<String> =
        reasons().filter_map(|reason| reason.limited()).map(|what| what.to_string()).collect();
    let mut details: Vec<String> = joints.into_iter().collect();
    details.extend(cause_lines(&reasons().filter_map(|reason| reason.cause_line()).collect()));
    if details.is_empty() { kind } else { format!("{kind} ({})", details.join(", ")) }
}

/// The first few of some lines.
fn cause_lines(lines: &BTreeSet<u32>) -> Option<String> {
    const NAMED: usize = 4;
    let named: Vec<String> = lines.iter().take(NAMED).map(u32::to_string).collect();
    match lines.len() {
        0 => None,
        1 => Some(format!("line {}", named[0])),
        count if count <= NAMED => Some(format!("lines {}", named.join(", "))),
        count => Some(format!("lines {} and {} more", named.join(", "), count - NAMED)),
    }
}

fn grouped(plan: &Plan) -> Vec<Group<'_>> {
    let mut groups: Vec<Group<'_>> = Vec::new();
    let mut index_of: HashMap<_, usize> = HashMap::new();
    for outcome in plan.outcomes.iter().filter(|outcome| outcome.status != MotionStatus::Changed) {
        let reason = outcome.reason();
        // The kind of a part of a cut is that of the motion that caused it.
        let key = reason.map(|reason| (std::mem::discriminant(&reason), reason.kind()));
        let index = *index_of.entry((rank(outcome.status), key)).or_insert_with(|| {
            groups.push(Group { status: outcome.status, reason, worst: None, outcomes: Vec::new() });
            groups.len() - 1
        });
        let group = &mut groups[index];
        group.outcomes.push(outcome);
        group.worst = match (group.worst, reason.and_then(|reason| reason.figure())) {
            (Some(a), Some(b)) if b.value > a.value => Some(b),
            (None, b) => b,
            (a, _) => a,
        };
    }
    groups.sort_by(|a, b| rank(a.status).cmp(&rank(b.status)).then(b.outcomes.len().cmp(&a.outcomes.len())));
    groups
}

fn rank(status: MotionStatus) -> Option<usize> {
    [MotionStatus::Refused, MotionStatus::Flagged, MotionStatus::Left].iter().position(|s| *s == status)
}

/// Lines as ranges of successive motions, grouped by file if there are several: `a.mod 12–14, 20; b.mod 3 and 7 more motions`.
fn lines(outcomes: &[&MotionOutcome], listing: &Listing, files: &[ProgramFile]) -> String {
    let mut ranges: Vec<(&MotionOutcome, Place, Place, usize)> = Vec::new();
    for &outcome in outcomes {
        let (place, _) = motion(outcome, listing);
        match ranges.last_mut() {
            Some((end, _, last, count)) if end.motion + 1 == outcome.motion && last.file == place.file => {
                (*end, *last, *count) = (outcome, place, *count + 1);
            }
            _ => ranges.push((outcome, place, place, 1)),
        }
    }
    let mut text = String::new();
    let mut last_file = None;
    for (_, first, last, _) in ranges.iter().take(MAX_RANGES) {
        if files.len() > 1 && last_file != Some(first.file) {
            let gap = if text.is_empty() { "" } else { "; " };
            text.push_str(&format!("{gap}{} ", file_name(files, *first)));
        } else if !text.is_empty() {
            text.push_str(", ");
        }
        text.push_str(&match first.line == last.line {
            true => first.line.to_string(),
            false => format!("{}–{}", first.line, last.line),
        });
        last_file = Some(first.file);
    }
    match ranges.iter().skip(MAX_RANGES).map(|range| range.3).sum() {
        0 => text,
        1 => text + " and 1 more motion",
        more => text + &format!(" and {more} more motions"),
    }
}
