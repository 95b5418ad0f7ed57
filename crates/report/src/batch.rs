//! Report over many programs: one row per program, totals, and failures.

use std::collections::{BTreeMap, BTreeSet};

use serde::{Deserialize, Serialize};
use serde_json::{Value, json};

use super::compensation::verdict as verdict_of_program;
use super::document::{Document, KeyFigure, PageVerdict};
use super::kept;
use super::placement::{self, Placed};
use super::status::Status;
use super::table::{Cell, Table};
use truegrind_compensation::deviation::MotionStatus;
use truegrind_compensation::frames::undeclared::undeclared;
use truegrind_compensation::plan::Plan;
use truegrind_compensation::plan::reason::OutcomeReason;
use truegrind_programs::motion::Listing;

/// Result for a program.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Ended {
    /// Corrected (or would be, in a dry run).
    Changed,
    /// Nothing in it changes.
    Unchanged,
    /// Already corrected with this model.
    Already,
    /// It could not be processed.
    Failed,
}

impl Ended {
    /// The word for a table.
    pub fn text(self) -> &'static str {
        match self {
            Ended::Changed => "changed",
            Ended::Unchanged => "unchanged",
            Ended::Already => "already compensated",
            Ended::Failed => "failed",
        }
    }
}

/// One program of a run. Serialised as its bit-exact record.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Row {
    /// Its files.
    pub file: String,
    /// Output file.
    pub output: Option<String>,
    /// Result.
    pub ended: Ended,
    /// Motions: all, changed, flagged, refused, left.
    pub motions: [usize; 5],
    /// Regions that could not be read.
    pub opaque: usize,
    /// Largest deviation before of the corrected motions, or of all if none is corrected (mm).
    #[serde(with = "kept::optional")]
    pub before_mm: Option<f64>,
    /// Largest predicted remainder of the corrected motions (mm).
    #[serde(with = "kept::optional")]
    pub after_mm: Option<f64>,
    /// Largest expected deviation of the corrected motions: remainder and predicted 1σ (mm).
    #[serde(with = "kept::optional")]
    pub expected_mm: Option<f64>,
    /// The error, or a remark.
    pub note: Option<String>,
    /// What makes the program doubtful although nothing in it was refused or flagged, such as steps next to uncorrected motions.
    #[serde(default)]
    pub doubt: Option<String>,
    /// The most frequent reason among refused, else flagged, else left motions, with its count.
    pub reason: Option<String>,
    /// Whether the largest deviations are those of the shape alone.
    #[serde(default)]
    pub shape_only: bool,
    /// How its stationary work objects with corrected motions are placed.
    #[serde(default)]
    pub placed: Vec<Placed>,
    /// Routines with motions that it declares, and those that it calls and does not declare, in lower case.
    #[serde(default)]
    pub routines: [Vec<String>; 2],
}

impl Row {
    /// The row of a planned program.
    pub fn of(file: String, output: Option<String>, ended: Ended, plan: &Plan, listing: &Listing) -> Row {
        let mut counts = [0; 4];
        plan.outcomes.iter().for_each(|outcome| counts[outcome.status as usize] += 1);
        let count = |motion_status: MotionStatus| counts[motion_status as usize];
        let after = plan.outcomes.iter().filter(|o| o.status.is_written()).filter_map(|o| o.after_mm.get());
        // Before and after of the same motions: those of which most is expected to remain.
        let found = placement::before_and_after(plan, listing).into_iter();
        let most = found.max_by(|a, b| a.expected_mm.unwrap_or(0.0).total_cmp(&b.expected_mm.unwrap_or(0.0)));
        Row {
            file,
            output,
            ended,
            motions: [
                plan.outcomes.len(),
                count(MotionStatus::Changed),
                count(MotionStatus::Flagged),
                count(MotionStatus::Refused),
                count(MotionStatus::Left),
            ],
            opaque: listing.opaque.len(),
            before_mm: most.map_or_else(|| placement::largest_mm(plan), |most| Some(most.before_mm)),
            after_mm: after.reduce(f64::max),
            expected_mm: most.and_then(|most| most.expected_mm),
            note: undeclared_note(listing),
            doubt: doubt(plan, listing).filter(|_| ended == Ended::Changed),
            reason: most_frequent_reason(plan),
            shape_only: most.is_some_and(|most| most.shape_only),
            placed: placement::placed(plan, listing),
            routines: [
                sorted_names(listing.routines.iter().map(|routine| routine.name.as_str())),
                sorted_names(listing.outside_calls.iter().map(|call| call.name.as_str())),
            ],
        }
    }

    /// The row of a program without a plan.
    pub fn without(file: String, ended: Ended, note: Option<String>) -> Row {
        Row {
            file,
            output: None,
            ended,
            motions: [0; 5],
            opaque: 0,
            before_mm: None,
            after_mm: None,
            expected_mm: None,
            note,
            doubt: None,
            reason: None,
            shape_only: false,
            placed: Vec::new(),
            routines: Default::default(),
        }
    }

    /// A program without corrections must not look done.
    fn judged(&self) -> Status {
        match self.ended {
            Ended::Changed if self.is_clean() => Status::Good,
            Ended::Changed => Status::Warning,
            Ended::Unchanged if self.motions[0] == 0 && self.opaque == 0 => Status::NotEvaluated,
            Ended::Unchanged | Ended::Already => Status::Warning,
            Ended::Failed => Status::Bad,
        }
    }

    /// Note, doubt and most frequent reason.
    fn remark(&self) -> Option<String> {
        let both: Vec<&str> =
            [&self.note, &self.doubt, &self.reason].into_iter().flatten().map(String::as_str).collect();
        (!both.is_empty()).then(|| both.join("; "))
    }

    /// Whether the program may run without a check.
    fn is_clean(&self) -> bool {
        let [all, _, flagged, refused, _] = self.motions;
        let is_empty = all == 0 && self.opaque == 0;
        let rewritten = self.ended == Ended::Changed || is_empty && self.ended == Ended::Unchanged;
        rewritten && flagged + refused == 0 && self.doubt.is_none()
    }

    /// Share of corrected motions (%).
    pub fn covered_percent(&self) -> Option<f64> {
        let [all, changed, flagged, ..] = self.motions;
        (all > 0).then(|| 100.0 * (changed + flagged) as f64 / all as f64)
    }
}

/// What a run leaves to be checked or done, for its headline.
struct Open {
    /// Programs with corrections that may not run unchecked, or in which nothing is corrected.
    programs: usize,
    /// Programs that are already corrected, and in which nothing was written.
    already: usize,
    /// Refused and flagged motions.
    motions: usize,
}

impl Open {
    fn of(rows: &[Row]) -> Self {
        let [_, _, flagged, refused, _] = totals(rows);
        let is_open = |row: &&Row| matches!(row.ended, Ended::Changed | Ended::Unchanged) && !row.is_clean();
        Self {
            programs: rows.iter().filter(is_open).count(),
            already: rows.iter().filter(|row| row.ended == Ended::Already).count(),
            motions: flagged + refused,
        }
    }

    fn is_any(&self) -> bool {
        self.programs + self.already > 0
    }

    /// What is to be checked, beside so many programs that may run.
    fn check(&self, may_run: usize, of: &str) -> String {
        let are = if may_run == 1 { "is" } else { "are" };
        let runs = format!("{may_run} {of} {are} corrected and may run");
        let which = if self.motions == 0 { "left" } else { "refused, flagged or left" };
        match (self.programs, may_run) {
            (0, _) if self.already > 0 => format!("{runs}; the rest is already corrected"),
            (0, _) => runs,
            (_, 0) => format!("check the motions that are {which} before running any of them"),
            _ => format!("{runs}; check the motions that are {which} in the rest first"),
        }
    }
}

/// The headline of a verdict that is not good; `None` where refused and flagged motions say enough.
fn doubt(plan: &Plan, listing: &Listing) -> Option<String> {
    let is_doubtful = |status| matches!(status, MotionStatus::Refused | MotionStatus::Flagged);
    let verdict = verdict_of_program(plan, listing, true);
    (verdict.status == Status::Warning && !plan.outcomes.iter().any(|outcome| is_doubtful(outcome.status)))
        .then_some(verdict.headline)
}

/// Note on undeclared names.
fn undeclared_note(listing: &Listing) -> Option<String> {
    const NAMED: usize = 4;
    let all = undeclared(listing);
    let names: Vec<&str> = all.iter().take(NAMED).map(|one| one.name.as_str()).collect();
    let more = if all.len() > NAMED { " and more" } else { "" };
    (!names.is_empty()).then(|| format!("declared in no file: {}{more}", names.join(", ")))
}

/// The most frequent reason for refused, else flagged, else left motions, with its count.
fn most_frequent_reason(plan: &Plan) -> Option<String> {
    [(MotionStatus::Refused, "refused"), (MotionStatus::Flagged, "flagged"), (MotionStatus::Left, "left")]
        .into_iter()
        .find_map(|(motion_status, word)| {
            let reasons = plan
                .outcomes
                .iter()
                .filter(|outcome| outcome.status == motion_status)
                .filter_map(|outcome| outcome.reason());
            let mut counts: BTreeMap<&str, usize> = BTreeMap::new();
            reasons
                .filter(|why| *why != OutcomeReason::NoChange)
                .for_each(|why| *counts.entry(why.kind()).or_default() += 1);
            let (reason, count) = counts.into_iter().max_by_key(|(_, count)| *count)?;
            Some(format!("{count} {word}: {reason}"))
        })
}

/// Worst first: failed, not corrected, most refused, flagged and left motions, largest deviation.
fn worst_first(rows: &[Row]) -> Vec<Row> {
    let mut rows = rows.to_vec();
    let rank = |row: &Row| match row.ended {
        Ended::Failed => 0,
        Ended::Unchanged if row.motions[0] > 0 => 1,
        Ended::Changed => 2,
        Ended::Already => 3,
        Ended::Unchanged => 4,
    };
    let doubtful = |row: &Row| std::cmp::Reverse((row.motions[3], row.motions[2], row.motions[4]));
    let far = |row: &Row| row.before_mm.unwrap_or(0.0);
    rows.sort_by(|a, b| (rank(a), doubtful(a)).cmp(&(rank(b), doubtful(b))).then(far(b).total_cmp(&far(a))));
    rows
}

/// One row per program.
pub fn table(rows: &[Row]) -> Table {
    Table::of("Programs", rows)
        .text("file", "Program", |row| row.file.as_str())
        .text("status", "Status", |row| Cell::Judged(row.judged(), row.ended.text().to_owned()))
        .count("motions", "Motions", |row| row.motions[0])
        .count("changed", "Changed", |row| row.motions[1])
        .count("flagged", "Flagged", |row| row.motions[2])
        .count("refused", "Refused", |row| row.motions[3])
        .count("left", "Left", |row| row.motions[4])
        .number("covered_percent", "Covered", "%", 1, |row| row.covered_percent())
        .number("before_mm", "largest before", "mm", 3, |row| row.before_mm)
        .number("after_mm", "largest remainder", "mm", 4, |row| row.after_mm)
        .number("expected_mm", "expected after", "mm", 3, |row| row.expected_mm)
        .text("figures", "Figures", |row| row.shape_only.then(|| "shape only".to_owned()))
        .count("opaque", "Not read", |row| row.opaque)
        .text("output", "Written to", |row| row.output.clone())
        .text("note", "Note", |row| row.remark())
        .table()
}

/// Totals of all rows as a sentence.
pub fn sum(rows: &[Row]) -> String {
    let with = |ended: Ended| rows.iter().filter(|row| row.ended == ended).count();
    let [all, changed, flagged, refused, left] = totals(rows);
    let share = if all > 0 { 100.0 * (changed + flagged) as f64 / all as f64 } else { 0.0 };
    format!(
        "{} {}: {} changed, {} unchanged, {} already compensated, {} failed; {all} motions: {changed} changed, \
         {flagged} flagged, {refused} refused, {left} left ({share:.1} % corrected)",
        rows.len(),
        if rows.len() == 1 { "program" } else { "programs" },
        with(Ended::Changed),
        with(Ended::Unchanged),
        with(Ended::Already),
        with(Ended::Failed),
    )
}

/// The table for display: worst first, reasons beside the names, without the common folder, without the remainder of the solver and
/// without columns that say nothing.
fn display_table(rows: &[Row]) -> Table {
    let rows = worst_first(rows);
    let mut table = table(&rows);
    // The reason goes before the counts.
    if let Some(note) = table.column_index("note") {
        let mut column = table.columns.remove(note);
        column.heading = "Reason".to_owned();
        table.columns.insert(2, column);
        for row in &mut table.rows {
            let cell = row.remove(note);
            row.insert(2, cell);
        }
    }
    for (at, key, what) in [(0, "file", "Programs are in"), (1, "output", "Written to")] {
        let names: Vec<&str> = rows
            .iter()
            .filter_map(|row| [Some(&row.file), row.output.as_ref()][at])
            .map(String::as_str)
            .collect();
        let (Some(column), Some(folder)) = (table.column_index(key), shared_folder(&names)) else { continue };
        for row in &mut table.rows {
            if let Cell::Text(name) = &mut row[column] {
                *name = without_folder(name, folder);
            }
        }
        table.notes.push(format!("{what} {folder}"));
    }
    // Files usually keep their names.
    if let (Some(file), Some(output)) = (table.column_index("file"), table.column_index("output"))
        && table.rows.iter().all(|row| row[output] == Cell::Missing || row[output] == row[file])
    {
        table.remove_column(output);
    }
    if let Some(remainder) = table.column_index("after_mm") {
        table.remove_column(remainder);
    }
    if let Some(opaque) = table.column_index("opaque")
        && table.rows.iter().all(|row| row[opaque] == Cell::Count(0))
    {
        table.remove_column(opaque);
    }
    table.remove_empty_columns();
    table.excerpt(ROWS)
}

/// Removes a common folder from the file names in a cell.
fn without_folder(names: &str, folder: &str) -> String {
    let short = |name: &'_ str| name.strip_prefix(folder).unwrap_or(name).to_owned();
    names.split(BETWEEN).map(short).collect::<Vec<_>>().join(BETWEEN)
}

/// Separator between the files of a task.
const BETWEEN: &str = ", ";

/// The common folder of several names, with its trailing separator.
fn shared_folder<'n>(names: &[&'n str]) -> Option<&'n str> {
    let (first, rest) = names.split_first().filter(|(_, rest)| !rest.is_empty())?;
    let folder = first.rfind(['/', '\\']).map(|end| &first[..=end])?;
    let held_by_all = |folder: &str| rest.iter().all(|name| name.starts_with(folder));
    let mut folder = folder;
    while !held_by_all(folder) {
        folder = folder[..folder.len() - 1].rfind(['/', '\\']).map(|end| &folder[..=end])?;
    }
    (folder.len() > 1).then_some(folder)
}

/// Summary for the terminal: verdict and table.
pub fn summary(rows: &[Row]) -> Document {
    let mut page = Document::new(title(rows));
    let verdict = verdict(rows);
    page.push(verdict.clone());
    page.push(display_table(rows));
    if rows.len() > SCREEN {
        // The top of a long table has scrolled away.
        page.push(PageVerdict { reasons: Vec::new(), ..verdict });
    }
    page
}

/// Programs whose table fits on a screen.
const SCREEN: usize = 20;

/// Rows of the table on a terminal or page; the CSV file has all.
const ROWS: usize = 200;

/// The page.
pub fn document(rows: &[Row]) -> Document {
    let mut page = Document::new(title(rows));
    page.push(verdict(rows));
    let largest = |value: fn(&Row) -> Option<f64>| rows.iter().filter_map(value).reduce(f64::max);
    let [motions, changed, flagged, ..] = totals(rows);
    page.push(vec![
        KeyFigure::new("Corrected", changed + flagged, 0, "")
            .note(format!("of {motions} motions, {flagged} of them flagged")),
        KeyFigure::new("Largest before", largest(|row| row.before_mm), 3, "mm")
            .note("before correction: of corrected motions, or of all in programs without any"),
        KeyFigure::new("Expected after", largest(|row| row.expected_mm), 3, "mm")
            .note("1σ: largest of the corrected motions"),
        KeyFigure::new("To check", rows.iter().filter(|row| !row.is_clean()).count(), 0, "")
            .note(format!("of {} programs: failed, nothing corrected, refused or flagged", rows.len())),
    ]);
    page.push(display_table(rows));
    page
}

/// Motions of all rows: all, changed, flagged, refused, left.
fn totals(rows: &[Row]) -> [usize; 5] {
    std::array::from_fn(|k| rows.iter().map(|row| row.motions[k]).sum())
}

fn title(rows: &[Row]) -> String {
    match rows.len() {
        1 => "Compensation of 1 program".to_owned(),
        count => format!("Compensation of {count} programs"),
    }
}

fn verdict(rows: &[Row]) -> PageVerdict {
    let failed: Vec<&Row> = rows.iter().filter(|row| row.ended == Ended::Failed).collect();
    let [_, changed, flagged, ..] = totals(rows);
    let may_run = rows.iter().filter(|row| row.ended == Ended::Changed && row.is_clean()).count();
    let (open, apart) = (Open::of(rows), placed_apart(rows));
    // The same as of the exit code: a program in which nothing is corrected makes the parts that it always made.
    let status = match failed.len() {
        0 if changed + flagged == 0 => Status::NotEvaluated,
        0 if open.is_any() || !apart.is_empty() => Status::Warning,
        0 => Status::Good,
        _ => Status::Bad,
    };
    let headline = match status {
        Status::NotEvaluated => "Nothing was corrected".to_owned(),
        Status::Good => {
            let are = if may_run == 1 { "is" } else { "are" };
            format!("All programs were processed; {may_run} of {} {are} corrected and may run", rows.len())
        }
        Status::Warning if !open.is_any() => {
            "All programs were processed, but the features that they make on one workpiece shift relative to each other"
                .to_owned()
        }
        Status::Warning | Status::Found => {
            format!("All programs were processed; {}", open.check(may_run, &format!("of {}", rows.len())))
        }
        Status::Bad => {
            format!(
                "{} of {} programs could not be processed; {}",
                failed.len(),
                rows.len(),
                open.check(may_run, "of the others")
            )
        }
    };
    let mut reasons = vec![sum(rows)];
    reasons.extend(shape_alone(rows));
    reasons.extend(apart);
    let names: Vec<&str> = rows.iter().map(|row| row.file.as_str()).collect();
    let folder = shared_folder(&names).unwrap_or_default();
    let named = |row: &Row, words: &str| {
        let file = without_folder(&row.file, folder);
        // Many errors already begin with the file name.
        match words.strip_prefix(file.as_str()) {
            Some(rest) if rest.starts_with(':') => words.to_owned(),
            _ => format!("{file}: {words}"),
        }
    };
    reasons.extend(
        failed.iter().take(MAX_FAILED).map(|row| named(row, row.note.as_deref().unwrap_or("failed"))),
    );
    // Missing declarations are listed with the remedy.
    let missing: Vec<&Row> =
        rows.iter().filter(|row| row.ended == Ended::Unchanged && row.note.is_some()).collect();
    reasons.extend(missing.iter().take(MAX_MISSING).filter_map(|row| {
        let note = row.note.as_ref()?;
        let remedy = "add the file that declares them, or define them in a cell file (--cell)";
        Some(named(row, &format!("{note}; {remedy}")))
    }));
    if missing.len() > MAX_MISSING {
        reasons.push(format!(
            "and {} more programs without corrections because of undeclared names",
            missing.len() - MAX_MISSING
        ));
    }
    PageVerdict::new(status, headline, reasons)
}

/// Names in lower case, each once.
fn sorted_names<'n>(names: impl Iterator<Item = &'n str>) -> Vec<String> {
    let names: BTreeSet<String> = names.map(str::to_ascii_lowercase).collect();
    names.into_iter().collect()
}

/// Makes corrected programs doubtful whose routines another program of the run calls: they were read as if a displacement, a load or a tool
/// of the caller were not in force there. Whether there are any.
pub fn doubt_called(rows: &mut [Row]) -> bool {
    let mut callers: BTreeMap<String, Vec<usize>> = BTreeMap::new();
    for (index, row) in rows.iter().enumerate() {
        row.routines[1].iter().for_each(|name| callers.entry(name.clone()).or_default().push(index));
    }
    if callers.is_empty() {
        return false;
    }
    let files: Vec<String> = rows.iter().map(|row| row.file.clone()).collect();
    let mut found = false;
    for (index, row) in rows.iter_mut().enumerate().filter(|(_, row)| row.ended == Ended::Changed) {
        let called = row.routines[0].iter().filter_map(|name| {
            let caller = callers.get(name)?.iter().find(|caller| **caller != index)?;
            Some((name, &files[*caller]))
        });
        let Some((name, caller)) = called.min_by_key(|(_, caller)| *caller) else { continue };
        let caller = caller.rsplit(['/', '\\']).next().unwrap_or(caller);
        row.doubt = Some(format!(
            "{caller} calls {name}: the displacement, load and tools in force at that call are unknown. Give the modules of one task together \
             (--together)"
        ));
        found = true;
    }
    found
}

/// Programs of which the shape alone is corrected, with their work objects: their paths stay as far off as a whole as they were.
fn shape_alone(rows: &[Row]) -> Option<String> {
    let corrected = || rows.iter().filter(|row| row.ended == Ended::Changed && !row.placed.is_empty());
    let kept: Vec<&Row> =
        corrected().filter(|row| row.placed.iter().any(|placed| placed.shape_only)).collect();
    let objects: BTreeSet<&str> = kept
        .iter()
        .flat_map(|row| row.placed.iter().filter(|placed| placed.shape_only))
        .map(|placed| placed.name.as_str())
        .collect();
    let named: Vec<&str> = objects.iter().copied().take(MAX_APART).collect();
    let more = if objects.len() > MAX_APART { " and others" } else { "" };
    (!kept.is_empty()).then(|| {
        format!(
            "shape only in {} of {} corrected programs ({}{more}): the shape of their paths is corrected, not their placement (--placement)",
            kept.len(),
            corrected().count(),
            named.join(BETWEEN)
        )
    })
}

/// Whether features of one workpiece shift relative to each other, since some programs keep their placement and others correct it.
pub fn shifts_apart(rows: &[Row]) -> bool {
    !placed_apart(rows).is_empty()
}

/// Sentence for each work object of which some programs keep the placement and others correct it.
fn placed_apart(rows: &[Row]) -> Vec<String> {
    let mut programs: BTreeMap<(&str, &str), [Vec<&str>; 2]> = BTreeMap::new();
    for row in rows.iter().filter(|row| row.ended == Ended::Changed) {
        for placed in &row.placed {
            let of = programs.entry((&placed.name, &placed.frame)).or_default();
            of[usize::from(placed.shape_only)].push(&row.file);
        }
    }
    let names: Vec<&str> = rows.iter().map(|row| row.file.as_str()).collect();
    let folder = shared_folder(&names).unwrap_or_default();
    let listed = |files: &[&str]| {
        let some: Vec<String> =
            files.iter().take(MAX_APART).map(|file| without_folder(file, folder)).collect();
        let more = files.len().saturating_sub(MAX_APART);
        if more > 0 { format!("{} and {more} more", some.join(BETWEEN)) } else { some.join(BETWEEN) }
    };
    let apart = programs.iter().filter(|(_, [moved, kept])| !moved.is_empty() && !kept.is_empty());
    apart
        .map(|((name, _), [moved, kept])| {
            format!(
                "{name}: the placement is corrected in {} but not in {}, so that the features that they make on one workpiece shift relative to \
                 each other. Choose --placement shape or --placement absolute for all, or give programs of RAPID that belong together as one task \
                 (--together)",
                listed(moved),
                listed(kept)
            )
        })
        .collect()
}

/// Largest number of programs that a sentence names on either side.
const MAX_APART: usize = 5;

/// Largest number of listed failures; the table has all.
const MAX_FAILED: usize = 20;

/// Largest number of programs listed for undeclared names.
const MAX_MISSING: usize = 5;

/// JSON report `truegrind.compensation/1` over all programs, with failures. `programs`: the entries of the single reports.
pub fn json(rows: &[Row], programs: Vec<Value>) -> Value {
    let failed: Vec<Value> = rows
        .iter()
        .filter(|row| row.ended == Ended::Failed)
        .map(|row| json!({ "file": row.file, "error": row.note }))
        .collect();
    let (totals, verdict) = (totals(rows), verdict(rows));
    json!({
        "schema": "truegrind.compensation/1",
        "verdict": { "status": verdict.status.word(), "headline": verdict.headline },
        "programs": programs,
        "failed": failed,
        "totals": {
            "programs": rows.len(),
            "motions": totals[0],
            "changed": totals[1],
            "flagged": totals[2],
            "refused": totals[3],
            "left": totals[4],
        },
    })
}
