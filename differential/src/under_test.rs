//! The call under test. Nothing else of truegrind is used anywhere in this crate.

use std::ops::Range;

use truegrind::arm::estimated::Estimated;
use truegrind::compensation::cell::Cell;
use truegrind::compensation::compensate::{CompensateError, Compensated, compensate};
use truegrind::compensation::cut::Cuts;
use truegrind::compensation::deviation::MotionStatus as Became;
use truegrind::compensation::options::{self, Circles, Emit};
use truegrind::compensation::plan::reason::OutcomeReason;
use truegrind::programs::motion::{Listing, Mark, Motion};
use truegrind::programs::nc::setup::Setup;
use truegrind::programs::reading::Program;

use crate::model::Case;

/// What is asked of the call.
#[derive(Debug, Clone, PartialEq)]
pub struct Options {
    /// `--tolerance` (mm).
    pub tolerance_mm: f64,
    /// `--joint-targets`.
    pub joint_targets: bool,
    /// `--emit joints`.
    pub emit_joints: bool,
    /// `--circles segments`.
    pub segments: bool,
    /// `--payload` and `--payload-centre` (kg; mm on the flange).
    pub payload: Option<(f64, [f64; 3])>,
}

impl Default for Options {
    fn default() -> Self {
        Self { tolerance_mm: 0.05, joint_targets: false, emit_joints: false, segments: false, payload: None }
    }
}

/// What became of a motion.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Status {
    /// Its numbers changed.
    Changed,
    /// Left as it was.
    Left,
    /// Refused as dangerous, left as it was.
    Refused,
    /// Changed, with something to look at.
    Flagged,
}

/// A motion of the listing.
#[derive(Debug, Clone, PartialEq)]
pub struct Row {
    /// Index of the file.
    pub file: usize,
    /// Line, from 1.
    pub line: usize,
    /// The bytes of its statement.
    pub statement: Range<usize>,
    /// What became of it.
    pub status: Status,
    /// Why.
    pub reason: Option<String>,
    /// Stated remainder (mm).
    pub after_mm: Option<f64>,
    /// Stated standard deviation (mm).
    pub sigma_mm: Option<f64>,
    /// Stated distance of the path from the intended one (mm); none where it is not checked.
    pub bend_mm: Option<f64>,
    /// Whether the listing states where the motion starts.
    pub start_known: bool,
    /// Whether it is flagged since it rests on a configuration that the controller does not check.
    pub guessed: bool,
    /// Whether it keeps its numbers since the correction of it comes out as the same ones.
    pub right: bool,
}

/// Bytes that were replaced.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Edit {
    /// In the original.
    pub old: Range<usize>,
    /// In the corrected file.
    pub new: Range<usize>,
}

/// A corrected file.
#[derive(Debug, Clone, PartialEq)]
pub struct CorrectedFile {
    /// Its new bytes.
    pub bytes: Vec<u8>,
    /// What was replaced, in order.
    pub edits: Vec<Edit>,
}

/// A corrected program.
#[derive(Debug, Clone, PartialEq)]
pub struct CorrectedTask {
    /// Its files.
    pub files: Vec<CorrectedFile>,
    /// Its motions, in the order of the listing.
    pub rows: Vec<Row>,
}

/// A corrected program of one file.
#[derive(Debug, Clone, PartialEq)]
pub struct Corrected {
    /// Its new bytes.
    pub bytes: Vec<u8>,
    /// What was replaced, in order.
    pub edits: Vec<Edit>,
    /// Its motions: line, what became of it, why.
    pub status: Vec<(usize, Status, Option<String>)>,
    /// The same with all that is known.
    pub rows: Vec<Row>,
}

/// Corrects a program of one file. `cell`: a cell file's text, empty for none.
pub fn corrected(
    name: &str,
    program: &[u8],
    case: &Case,
    cell: &str,
    options: &Options,
) -> Result<Corrected, String> {
    let mut task = corrected_task(&[(name, program)], case, cell, options)?;
    let file = task.files.pop().ok_or("no file came back")?;
    let status = task.rows.iter().map(|row| (row.line, row.status, row.reason.clone())).collect();
    Ok(Corrected { bytes: file.bytes, edits: file.edits, status, rows: task.rows })
}

/// Corrects a program of several files of one task.
pub fn corrected_task(
    files: &[(&str, &[u8])],
    case: &Case,
    cell: &str,
    options: &Options,
) -> Result<CorrectedTask, String> {
    let estimated = Estimated::from_toml(&case.model_toml).map_err(|e| e.to_string())?;
    let cell = Cell::from_toml(cell).map_err(|e| e.to_string())?;
    let mut setup = Setup::default();
    let frame = |p: truegrind::math::se3::Pose| truegrind::programs::motion::Frame::from_pose(&p);
    setup.tools.extend(cell.tool.iter().filter_map(|f| Some((f.name.clone(), frame(f.pose()?)))));
    setup.frames.extend(cell.wobj.iter().filter_map(|f| Some((f.name.clone(), frame(f.pose()?)))));
    let program = Program::read(files, &setup);
    let mut condition = estimated.condition;
    if let Some((kg, centre)) = options.payload {
        condition.payload_kg = Some(kg);
        condition.payload_centre_mm = centre;
    }
    let wanted = options::Options {
        emit: if options.emit_joints { Emit::Joints } else { Emit::Targets },
        circles: if options.segments { Circles::Segments } else { Circles::Keep },
        tolerance_mm: options.tolerance_mm,
        joint_targets: options.joint_targets,
        condition,
        loads: options.payload.is_none().then(|| program.loads()),
        points: false,
        cuts: if case.whole_cuts { Cuts::Whole } else { Cuts::Single },
        ..options::Options::default()
    };
    let mark = Some(Mark { version: "0".to_owned(), model: "test".to_owned(), partial: false });
    let Compensated { plan: planned, rewritten } =
        match compensate(&program, &estimated, &cell, &wanted, mark) {
            // The whole program is refused: the cell file does not fit it.
            Err(error @ CompensateError::Cell(_)) => return Ok(refused(files, &program, &error.to_string())),
            done => done.map_err(|error| error.to_string())?,
        };
    let mut out = CorrectedTask { files: Vec::new(), rows: Vec::new() };
    for ((_, source), edits) in files.iter().zip(&rewritten.files) {
        let bytes = edits.edits.apply(source).map_err(|error| error.to_string())?;
        out.files.push(CorrectedFile { bytes, edits: placed(&edits.edits) });
    }
    for (motion, outcome) in program.listing().motions.iter().zip(&planned.outcomes) {
        out.rows.push(Row {
            file: motion.place.file as usize,
            line: motion.place.line as usize,
            statement: motion.statement.start as usize..motion.statement.end as usize,
            status: match outcome.status {
                Became::Changed => Status::Changed,
                Became::Left => Status::Left,
                Became::Refused => Status::Refused,
                Became::Flagged => Status::Flagged,
            },
            reason: outcome.reason().map(|why| why.to_string()),
            after_mm: outcome.after_mm.get(),
            sigma_mm: outcome.sigma_mm.get(),
            bend_mm: outcome.path_deviation_mm.get(),
            start_known: start_known(program.listing(), motion),
            guessed: outcome.reason() == Some(OutcomeReason::UnknownStart),
            right: outcome.reason() == Some(OutcomeReason::NoChange),
        });
    }
    Ok(out)
}

/// Whether the end of the motion before is stated: the end of `Offs(p, i, 0, 0)` in a loop is not.
fn start_known(listing: &Listing, motion: &Motion) -> bool {
    let end = motion.previous.and_then(|previous| listing.motions[previous as usize].to());
    end.is_some_and(|target| target.value.is_ok())
}

/// A program of which nothing is corrected.
fn refused(files: &[(&str, &[u8])], program: &Program<'_>, reason: &str) -> CorrectedTask {
    let rows = program.listing().motions.iter().map(|motion| Row {
        file: motion.place.file as usize,
        line: motion.place.line as usize,
        statement: motion.statement.start as usize..motion.statement.end as usize,
        status: Status::Refused,
        reason: Some(reason.to_owned()),
        after_mm: None,
        sigma_mm: None,
        bend_mm: None,
        start_known: start_known(program.listing(), motion),
        guessed: false,
        right: false,
    });
    let same = |(_, bytes): &(&str, &[u8])| CorrectedFile { bytes: bytes.to_vec(), edits: Vec::new() };
    CorrectedTask { files: files.iter().map(same).collect(), rows: rows.collect() }
}

/// Where edits stand in the old and in the new bytes.
fn placed(edits: &truegrind::programs::edit::Edits) -> Vec<Edit> {
    let mut list: Vec<(Range<usize>, usize)> =
        edits.iter().map(|(range, text)| (range, text.len())).collect();
    list.sort_by_key(|(range, _)| (range.start, range.end));
    let mut shift = 0isize;
    let mut out = Vec::with_capacity(list.len());
    for (old, length) in list {
        let start = (old.start as isize + shift) as usize;
        shift += length as isize - old.len() as isize;
        out.push(Edit { old, new: start..start + length });
    }
    out
}
