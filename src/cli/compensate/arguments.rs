//! Arguments of `compensate`.

use std::path::{Path, PathBuf};

use anyhow::bail;
use clap::{Args, ValueEnum};
use truegrind::arm::condition::Condition;
use truegrind::compensation::cut::Cuts;
use truegrind::compensation::options::{Circles, Emit, Options};
use truegrind::compensation::risk::placement::Placement;

use crate::cli::cell_arguments::{CellArguments, check_length};
use crate::cli::computation::Common;
use crate::cli::inputs::StatedRobot;
use crate::cli::outputs::Outputs;
use crate::cli::programs::Grouping;
use crate::cli::shares::Shares;

/// Kind of targets in the output.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
enum EmitArgument {
    /// Corrected robtargets.
    Targets,
    /// Joint targets.
    Joints,
}

/// How circular motions are written.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
enum CirclesArgument {
    /// Circles through the corrected points; the path between them is checked at sample points.
    Keep,
    /// Straight segments within the tolerance.
    Segments,
}

/// Whether the placement of a path is corrected.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
enum PlacementArgument {
    /// The shape of the path in each work object; its placement too if it is off by more than the model's uncertainty and the
    /// correction does harm with a probability of at most half of --max-risk.
    Auto,
    /// Only the shape of the path in each work object.
    Shape,
    /// Shape and placement.
    Absolute,
}

// More than twenty fields: one for each argument of the command line.
/// Arguments of `compensate`.
#[derive(Debug, Clone, Args)]
#[command(
    after_help = "NC programs (G-code, Heidenhain) do not contain the tool, the work offsets and the meaning of A, B and C. \
    `truegrind cell PROGRAM… -o cell.toml` writes a cell file in which you fill them in; docs/nc.md has a complete example for \
    each of Fanuc style, 840D, LinuxCNC and Heidenhain."
)]
pub(crate) struct Arguments {
    /// Programs to correct: RAPID modules of one task, .pgf task lists, NC files, or folders of them.
    #[arg(required = true)]
    pub(super) programs: Vec<PathBuf>,
    #[command(flatten)]
    pub(super) grouping: Grouping,
    /// Estimated arm (a model file), or the word `nominal`, which changes nothing.
    #[arg(long)]
    pub(super) model: String,
    #[command(flatten)]
    pub(super) robot: StatedRobot,
    /// Output: a file for one program, a folder for several.
    #[arg(short, long, value_name = "OUT")]
    pub(super) output: Option<PathBuf>,
    /// Write corrected robtargets or joint targets.
    #[arg(long, value_enum, default_value_t = EmitArgument::Targets)]
    emit: EmitArgument,
    /// Write circular motions (MoveC, G2, G3) as circles or as straight segments.
    #[arg(long, value_enum, default_value_t = CirclesArgument::Keep)]
    circles: CirclesArgument,
    /// Largest deviation from the intended path between two targets (mm).
    #[arg(long, value_name = "MM", default_value_t = 0.05, allow_negative_numbers = true)]
    tolerance: f64,
    /// Largest correction to write (mm); a motion that needs more is refused.
    #[arg(long, value_name = "MM", default_value_t = 10.0, allow_negative_numbers = true)]
    max_correction: f64,
    /// If one motion of a cut cannot be corrected, correct the others as long as no step exceeds the tolerance. By default the
    /// whole cut then stays unchanged.
    #[arg(long)]
    partial: bool,
    /// Correct shape and placement of the path, or its shape alone. Use `shape` for work objects that were taught or adjusted in
    /// place.
    #[arg(long, value_enum, default_value_t = PlacementArgument::Auto)]
    placement: PlacementArgument,
    /// Leave a cut unchanged if its correction makes it worse with a probability above this.
    #[arg(long, value_name = "P", default_value_t = 0.1, allow_negative_numbers = true)]
    max_risk: f64,
    /// Also rewrite joint targets (MoveAbsJ).
    #[arg(long)]
    joint_targets: bool,
    /// No longer needed: motions whose configuration is not monitored (ConfL \Off, ConfJ \Off) and whose start the program text does
    /// not determine are always flagged.
    #[arg(long, hide = true)]
    flag_open_starts: bool,
    #[command(flatten)]
    pub(super) cell: CellArguments,
    /// Plan and report, but write no program.
    #[arg(long)]
    pub(super) dry_run: bool,
    /// Like --dry-run, but exit with code 1 if anything would change.
    #[arg(long)]
    pub(super) check: bool,
    /// Also correct a program that already carries the mark of another model; the two corrections add up.
    #[arg(long)]
    pub(super) again: bool,
    /// Use a doubtful model: one whose data do not show that programs improve.
    #[arg(long)]
    pub(super) allow_doubtful: bool,
    /// Write the changes as a unified diff.
    #[arg(long, value_name = "FILE", num_args = 0..=1, default_missing_value = "-")]
    pub(super) diff: Option<PathBuf>,
    #[command(flatten)]
    pub(super) common: Common,
    #[command(flatten)]
    pub(super) outputs: Outputs,
    #[command(flatten)]
    pub(super) shares: Shares,
    /// Keep smaller records, without an entry for each motion. `gather` can then write every report except --json, for which the
    /// programs have to be processed again.
    #[arg(long, help_heading = "Several jobs, on one machine or many")]
    brief_records: bool,
}

impl Arguments {
    /// Whether no program is written.
    pub(super) fn writes_nothing(&self) -> bool {
        self.dry_run || self.check
    }

    /// Whether the only program goes to stdout.
    pub(super) fn prints_program(&self) -> bool {
        self.output.as_deref() == Some(Path::new("-"))
    }

    /// Reports that are written to files.
    pub(super) fn report_files(&self) -> Vec<&Path> {
        let mut files = self.outputs.files();
        files.extend(self.diff.as_deref());
        files
    }

    /// Whether the entries of all motions are needed, for `--json` or for a record from which `gather` makes it.
    pub(super) fn needs_motions(&self) -> bool {
        self.outputs.pages.json.is_some() || self.shares.on() && !self.brief_records
    }

    /// All options that influence the outputs, as text for the key of a run. Options without influence are removed by name, so
    /// that a new option counts by default.
    pub(super) fn relevant_options(&self) -> String {
        let common = Common { threads: None, ..self.common.clone() };
        let diff = self.diff.as_ref().map(|_| PathBuf::new());
        let (outputs, shares) = (Outputs::default(), Shares::default());
        format!(
            "{:?}",
            Self {
                programs: Vec::new(),
                common,
                diff,
                outputs,
                shares,
                brief_records: false,
                ..self.clone()
            }
        )
    }

    /// Refuses combinations of `--brief-records`, `-o -` and a shared run that make no sense.
    pub(super) fn check_shares(&self) -> anyhow::Result<()> {
        if self.brief_records && !self.shares.on() {
            bail!("--brief-records needs --shard or --resume: other runs keep no records");
        }
        if self.shares.on() && self.prints_program() {
            bail!("-o -: stdout takes one program, and a shared run has several: name a folder");
        }
        Ok(())
    }

    /// Refuses numbers out of range.
    pub(super) fn check_numbers(&self) -> anyhow::Result<()> {
        check_length("--tolerance", self.tolerance, Options::MAX_TOLERANCE_MM)?;
        check_length("--max-correction", self.max_correction, Options::MAX_CORRECTION_MM)?;
        if !(0.0..=1.0).contains(&self.max_risk) {
            bail!("--max-risk {}: expected a probability from 0 to 1", self.max_risk);
        }
        Ok(())
    }

    /// Options of the library, for so many programs.
    pub(super) fn options(&self, condition: Condition, programs: usize) -> Options {
        Options {
            emit: match self.emit {
                EmitArgument::Targets => Emit::Targets,
                EmitArgument::Joints => Emit::Joints,
            },
            circles: match self.circles {
                CirclesArgument::Keep => Circles::Keep,
                CirclesArgument::Segments => Circles::Segments,
            },
            tolerance_mm: self.tolerance,
            max_correction_mm: self.max_correction,
            joint_targets: self.joint_targets,
            cuts: if self.partial { Cuts::Partial } else { Cuts::Whole },
            placement: match self.placement {
                PlacementArgument::Auto => Placement::Auto,
                PlacementArgument::Shape => Placement::Shape,
                PlacementArgument::Absolute => Placement::Absolute,
            },
            max_risk: self.max_risk,
            condition,
            points: programs == 1 && self.outputs.of_points(),
            remedies: programs == 1 || self.needs_motions(),
            ..Options::default()
        }
    }
}
