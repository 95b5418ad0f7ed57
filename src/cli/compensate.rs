//! `truegrind compensate PROGRAM… --model MODEL.toml -o OUT`.

use std::collections::HashMap;
use std::path::{Path, PathBuf};

use anyhow::{anyhow, bail};
use clap::{Args, ValueEnum};
use nalgebra::Point3;
use serde_json::Value;
use truegrind::arm::condition::Condition;
use truegrind::arm::estimated::Estimated;
use truegrind::arm::model::Model;
use truegrind::compensation::cell::robot_match::none_in_reach;
use truegrind::compensation::cell::{Cell, Used};
use truegrind::compensation::compensate::{Compensated, compensate};
use truegrind::compensation::condition::payload::Loads;
use truegrind::compensation::cut::Cuts;
use truegrind::compensation::deviation::{After, PathReport};
use truegrind::compensation::frames::surface_frames::misplaced;
use truegrind::compensation::frames::taught::contradictions;
use truegrind::compensation::options::{Circles, Emit, Options};
use truegrind::compensation::plan::Plan;
use truegrind::compensation::plan::listing_only_plan::untouched;
use truegrind::compensation::plan::reason::Why;
use truegrind::compensation::risk::placement::Placement;
use truegrind::programs::diff::unified;
use truegrind::programs::motion::{Listing, Mark, Reason};
use truegrind::programs::nc::setup::Setup;
use truegrind::programs::reading::{Language, Program};
use truegrind::programs::rewrite::RewriteOptions;
use truegrind::report::batch::{Ended, Row};
use truegrind::report::compensation::{self as view, ProgramFile};
use truegrind::report::status::Status as Judged;
use truegrind::surfaces::SurfaceFile;
use truegrind::units::key::sha256;

use super::belonging;
use super::computation::{Common, on_threads};
use super::corrected::{Done, Judging, Reports};
use super::ending::Ending;
use super::files::{self, Batch, witness};
use super::inputs;
use super::inputs::NamedModel;
use super::naming;
use super::outputs::Outputs;
use super::programs::{self, Grouping, Job, Programs};
use super::progress::Work;
use super::shares::{Asked, Doing, Shares, Store, Written, each, outputs_with};
use super::terminal::{say, tell, tell_lines};

/// What is written.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
pub(super) enum EmitArgument {
    /// Moved robtargets.
    Targets,
    /// Joint targets.
    Joints,
}

/// What becomes of circular motions.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
pub(super) enum CirclesArgument {
    /// Circles through their corrected points, the path checked by sampling.
    Keep,
    /// Straight pieces within the tolerance.
    Segments,
}

/// What is corrected of where a path lies.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
pub(super) enum PlacementArgument {
    /// Shape and place where the model knows the place better than it is off, else the shape alone.
    Auto,
    /// The shape of the path over each work object; the path stays where it is.
    Shape,
    /// Shape and place.
    Absolute,
}

/// What is known of the cell, for rewriting and judging.
#[derive(Debug, Clone, Args)]
pub(super) struct CellArguments {
    /// Origins of tools and work objects: metrology, or taught with their teaching points.
    #[arg(long, value_name = "CELL.toml")]
    pub(super) cell: Option<PathBuf>,
    /// The surface that is ground, for deviations along its normal.
    #[arg(long, value_name = "SURFACE.toml")]
    pub(super) surface: Option<PathBuf>,
    /// Mass at the flange while the program runs (kg), in place of what the program's tools and loads say; NC programs
    /// say nothing.
    #[arg(long, value_name = "KG", allow_negative_numbers = true)]
    pub(super) payload: Option<f64>,
    /// Centre of that mass on the flange (mm).
    #[arg(long, value_name = "X,Y,Z", requires = "payload", allow_hyphen_values = true)]
    pub(super) payload_centre: Option<String>,
}

impl CellArguments {
    /// What a program says that the arm carries, unless the command line does.
    pub(super) fn loads(&self, program: &Program<'_>) -> Option<Loads> {
        self.payload.is_none().then(|| Loads::of(program))
    }

    /// The cell, the surface and the condition, starting from that of the model.
    pub(super) fn read(
        &self,
        model: Option<&Estimated>,
    ) -> anyhow::Result<(Cell, Option<SurfaceFile>, Condition)> {
        if let Some(kg) = self.payload
            && !(0.0..=LARGEST_PAYLOAD_KG).contains(&kg)
        {
            bail!("--payload {kg}: expected a mass in kg, from 0 to {LARGEST_PAYLOAD_KG}");
        }
        let cell = match &self.cell {
            Some(path) => Cell::from_toml(&files::read_text(path)?).map_err(|e| {
                anyhow!(
                    "{}: {}; a cell file lists [[tool]] and [[wobj]]",
                    path.display(),
                    e.to_string().trim_end()
                )
            })?,
            None => Cell::default(),
        };
        if let (Some(path), [first, rest @ ..]) = (&self.cell, cell.open.as_slice()) {
            let more = match rest.len() {
                0 => String::new(),
                1 => "; 1 more entry is open".to_owned(),
                more => format!("; {more} more entries are open"),
            };
            bail!("{}: not filled in yet: {first}{more}", path.display());
        }
        let surface = self.surface.as_deref().map(super::path::surface).transpose()?;
        let cell = match &surface {
            Some(surface) => cell.with_surface(surface)?,
            None => cell,
        };
        let mut condition = model.map(|m| m.condition).unwrap_or_default();
        condition.payload_kg = self.payload.or(condition.payload_kg);
        if let Some(text) = &self.payload_centre {
            let on_flange = Point3::from(super::stated::triple("--payload-centre", text)?);
            let in_last = model.map_or(on_flange, |arm| arm.model.flange * on_flange);
            condition.payload_centre_mm = in_last.coords.into();
        }
        Ok((cell, surface, condition))
    }
}

/// Says which entries of the cell file no program uses, where every program could be asked.
pub(super) fn say_unused<'u>(
    used: impl IntoIterator<Item = &'u Option<Used>>,
    cell: &Cell,
    surface: Option<&SurfaceFile>,
) {
    let mut all = Used::default();
    for used in used {
        let Some(used) = used else { return };
        all.join(used);
    }
    for note in all.notes(cell, surface) {
        tell(format_args!("note: {note}"));
    }
}

/// Nothing is corrected or judged where cell file or surface file and the program contradict each other.
pub(super) fn agreed(
    listing: &Listing,
    cell: &Cell,
    surface: Option<&SurfaceFile>,
    nominal: &Model,
) -> anyhow::Result<()> {
    let mut found = contradictions(listing, cell, nominal);
    found.extend(surface.iter().flat_map(|surface| misplaced(listing, surface)));
    if found.is_empty() { Ok(()) } else { bail!("{}", found.join("; ")) }
}

/// No robot carries more.
const LARGEST_PAYLOAD_KG: f64 = 3000.0;

/// Arguments of `compensate`.
#[derive(Debug, Clone, Args)]
#[command(
    after_help = "NC programs (G-code, Heidenhain) leave to the control where tool and work offset lie and what A, B and C mean. \
    `truegrind cell PROGRAM… -o cell.toml` writes the file that says it, to be filled in; docs/nc.md has one complete example \
    each for Fanuc style, 840D, LinuxCNC and Heidenhain."
)]
pub(super) struct Arguments {
    /// RAPID modules of one task, .pgf lists of such, NC files, or folders of them.
    #[arg(required = true)]
    programs: Vec<PathBuf>,
    #[command(flatten)]
    grouping: Grouping,
    /// An estimated arm, or the word `nominal`, with which no byte changes.
    #[arg(long)]
    model: String,
    /// Robot; optional where the model says it, and checked against it.
    #[arg(long)]
    robot: Option<String>,
    /// A file for one program, a folder for several.
    #[arg(short, long, value_name = "OUT")]
    output: Option<PathBuf>,
    /// Moved robtargets or joint targets.
    #[arg(long, value_enum, default_value_t = EmitArgument::Targets)]
    emit: EmitArgument,
    /// Circular motions (MoveC, G2, G3) as circles or as straight pieces.
    #[arg(long, value_enum, default_value_t = CirclesArgument::Keep)]
    circles: CirclesArgument,
    /// How far the path between two targets may leave the intended line (mm).
    #[arg(long, value_name = "MM", default_value_t = 0.05, allow_negative_numbers = true)]
    tolerance: f64,
    /// Largest correction that is written (mm); a larger one is refused.
    #[arg(long, value_name = "MM", default_value_t = 10.0, allow_negative_numbers = true)]
    max_correction: f64,
    /// Correct what can be corrected of a cut of which a motion must stay as it is, without steps above the tolerance; without
    /// it such a cut stays as a whole.
    #[arg(long)]
    partial: bool,
    /// Whether the place of the path over each work object is corrected or its shape alone. What was taught or adjusted in place
    /// is in place: correct its shape.
    #[arg(long, value_enum, default_value_t = PlacementArgument::Auto)]
    placement: PlacementArgument,
    /// Leave a cut as it is where the correction makes it worse with a larger probability.
    #[arg(long, value_name = "P", default_value_t = 0.1, allow_negative_numbers = true)]
    max_risk: f64,
    /// Rewrite joint targets (MoveAbsJ) too.
    #[arg(long)]
    joint_targets: bool,
    /// Flag each motion whose configuration is stated but not checked (ConfL \Off, ConfJ \Off) and which starts where the text
    /// does not tell; without it a note says where such ways begin.
    #[arg(long)]
    flag_open_starts: bool,
    #[command(flatten)]
    cell: CellArguments,
    /// Plan and report, write no program.
    #[arg(long)]
    dry_run: bool,
    /// Like --dry-run, and end with exit code 1 where anything would change.
    #[arg(long)]
    check: bool,
    /// Correct a program again that carries the mark of another model: corrections add up.
    #[arg(long)]
    again: bool,
    /// Use a doubtful model: one whose data do not promise that programs gain.
    #[arg(long)]
    allow_doubtful: bool,
    /// What changes, as a unified diff.
    #[arg(long, value_name = "FILE", num_args = 0..=1, default_missing_value = "-")]
    diff: Option<PathBuf>,
    #[command(flatten)]
    common: Common,
    #[command(flatten)]
    outputs: Outputs,
    #[command(flatten)]
    shares: Shares,
    /// Keep no entry for every motion of what is done: `gather` makes all reports but --json of it, and where --json is asked for
    /// the programs are done again.
    #[arg(long, help_heading = "Several jobs, on one machine or many")]
    brief_records: bool,
}

impl Arguments {
    /// Whether records are kept from which every report can be made.
    fn keeps_all(&self) -> bool {
        self.shares.on() && !self.brief_records
    }

    /// Whether something that is asked for, or kept, shows the motions of each of many programs.
    fn shows_motions(&self) -> bool {
        self.outputs.pages.json.is_some() || self.keeps_all()
    }

    /// Every option that has a part in what is written, in words. What has none is taken out by name, so that one that comes anew
    /// counts until somebody says that it does not.
    fn that_count(&self) -> String {
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
}

/// What all programs of a run share.
struct Shop<'a> {
    arguments: &'a Arguments,
    /// What is corrected for; absent where the model is nominal: everything is listed, and no byte changes.
    corrector: Option<Corrector<'a>>,
    cell: Cell,
    surface: Option<SurfaceFile>,
    setup: Setup,
    options: Options,
    /// Whether the process ends with this program.
    ends: bool,
}

impl Shop<'_> {
    fn judging(&self) -> Judging {
        Judging { nominal: self.corrector.is_none(), check: self.arguments.check }
    }
}

/// The estimated arm, as it was named.
#[derive(Clone, Copy)]
struct Corrector<'a> {
    hash: &'a str,
    model: &'a str,
    arm: &'a Estimated,
}

pub(super) fn run(arguments: &Arguments) -> anyhow::Result<Ending> {
    let dry = arguments.dry_run || arguments.check;
    if !dry && arguments.output.is_none() {
        bail!("-o OUT is missing: a file for one program, a folder for several (or --dry-run)");
    }
    let mut jobs = match arguments.shares.listed()? {
        Some(jobs) => jobs,
        None => programs::jobs(&arguments.programs, arguments.grouping)?,
    };
    refuse_one_place_for_two(&jobs)?;
    let mut checked: Vec<&Path> = arguments.outputs.files();
    checked.extend(arguments.diff.as_deref());
    let inputs_of: Vec<&Path> = jobs.iter().flat_map(|job| &job.paths).map(PathBuf::as_path).collect();
    Batch::check(&inputs_of, &checked)?;
    if !dry {
        refuse_report_over_program(&jobs, arguments.output.as_deref(), &checked)?;
    }
    if arguments.brief_records && !arguments.shares.on() {
        bail!(
            "--brief-records: a run that no jobs share keeps no records: leave it out, or give --shard or --resume"
        );
    }
    if arguments.shares.on() && arguments.output.as_deref() == Some(Path::new("-")) {
        bail!("-o -: the standard output takes one program, a shared run is of several: name a folder");
    }
    if arguments.shares.on() {
        witness::begin();
    }
    for (value, name) in
        [(arguments.tolerance, "--tolerance"), (arguments.max_correction, "--max-correction")]
    {
        if !(value > 0.0 && value.is_finite()) {
            bail!("{name} {value}: expected a length above 0 in mm");
        }
    }
    if !(0.0..=1.0).contains(&arguments.max_risk) {
        bail!("--max-risk {}: expected a probability from 0 to 1", arguments.max_risk);
    }
    let model = inputs::model(&arguments.model)?;
    inputs::refuse_doubtful(&model, arguments.allow_doubtful)?;
    refuse_compensating_controller(arguments.robot.as_deref())?;
    let (robot, nominal) = inputs::nominal(&model, arguments.robot.as_deref())?;
    let corrector = match &model {
        NamedModel::Nominal => None,
        NamedModel::Estimated { hash, arm, name } => {
            debug_assert_eq!(nominal, arm.nominal);
            Some(Corrector { hash, model: name, arm })
        }
    };
    if corrector.is_none() && arguments.outputs.rrd.is_some() {
        bail!("--rrd: the nominal arm has no deviation to show: give an estimated arm");
    }
    let (cell, surface, condition) = arguments.cell.read(corrector.map(|c| c.arm))?;
    belonging::cell_is_of(&cell, &robot, &nominal)?;
    let options = Options {
        emit: match arguments.emit {
            EmitArgument::Targets => Emit::Targets,
            EmitArgument::Joints => Emit::Joints,
        },
        circles: match arguments.circles {
            CirclesArgument::Keep => Circles::Keep,
            CirclesArgument::Segments => Circles::Segments,
        },
        tolerance_mm: arguments.tolerance,
        max_correction_mm: arguments.max_correction,
        joint_targets: arguments.joint_targets,
        open_starts: arguments.flag_open_starts,
        cuts: if arguments.partial { Cuts::Partial } else { Cuts::Whole },
        placement: match arguments.placement {
            PlacementArgument::Auto => Placement::Auto,
            PlacementArgument::Shape => Placement::Shape,
            PlacementArgument::Absolute => Placement::Absolute,
        },
        max_risk: arguments.max_risk,
        condition,
        points: jobs.len() == 1 && arguments.outputs.of_points(),
        remedies: jobs.len() == 1 || arguments.shows_motions(),
        ..Options::default()
    };
    let setup = programs::setup(&cell, arguments.robot.as_deref().or(Some(robot.as_str())));
    let alone = matches!(jobs.as_slice(), [job] if job.under.is_none() || job.paths.len() > 1);
    let ends = alone && !arguments.shares.on();
    let shop = Shop { arguments, corrector, cell, surface, setup, options, ends };
    let shared = witness::end();
    if corrector.is_none() {
        let text = "model nominal: nothing to correct, every byte stays\n";
        if arguments.outputs.takes_stdout() || arguments.output.as_deref() == Some(Path::new("-")) {
            tell_lines(text);
        } else {
            say(text)?;
        }
    }
    if let [job] = jobs.as_slice()
        && ends
    {
        return one(&shop, job);
    }
    let store = if arguments.shares.on() {
        let asked = Asked {
            verb: "compensate",
            options: arguments.that_count(),
            shared,
            context: shop.judging().to_value(),
            output: arguments.output.as_deref().filter(|_| !dry),
        };
        let Some(store) = Store::open(&arguments.shares, &asked, &mut jobs)? else { return Ok(Ending::Done) };
        Some(store)
    } else {
        None
    };
    many(&shop, &jobs, store.as_ref())
}

/// One program: its own report.
fn one(shop: &Shop<'_>, job: &Job) -> anyhow::Result<Ending> {
    let arguments = shop.arguments;
    let outputs = &arguments.outputs;
    let programs = Programs::read(&job.paths)?;
    let targets = outputs_of(arguments, job, &programs, false)?;
    let inputs_of: Vec<&Path> = programs.files.iter().map(|(p, _)| p.as_path()).collect();
    let mut checked: Vec<&Path> = arguments.outputs.files();
    checked.extend(arguments.diff.as_deref());
    if programs.files.len() == 1 {
        checked.extend(targets.iter().flatten().map(PathBuf::as_path));
    }
    Batch::check(&inputs_of, &checked)?;
    let mut batch = Batch::sparing(&inputs_of);
    // Told when all is written: it says what was.
    let mut summary = None;
    let mut report = |planned: &mut Plan, program: &Program<'_>, files: &[ProgramFile]| {
        let listing = program.listing();
        summary = Some(view::summary(planned, listing, files));
        let report = PathReport {
            program: programs.name(),
            model: shop.corrector.map_or("nominal", |c| c.model).to_owned(),
            after: After::PredictedRemainder,
            points: std::mem::take(&mut planned.points),
            held_out_mm: shop.corrector.map(|c| c.arm.geometry.held_out.rmse),
        };
        let reports = if shop.corrector.is_some() { std::slice::from_ref(&report) } else { &[] };
        outputs.add_made(
            &mut batch,
            || view::document(planned, listing, files, reports),
            || truegrind::report::deviation::table(&report),
            || view::json(planned, listing, files),
        )?;
        #[cfg(feature = "visual")]
        if let (Some(path), Some(corrector)) = (&outputs.rrd, shop.corrector) {
            let bytes = super::recording::path(
                &report.program,
                super::recording::Arms {
                    real: &corrector.arm.model,
                    is: "estimated arm",
                    nominal: &corrector.arm.nominal,
                    robot: arguments.robot.as_deref(),
                },
                shop.options.condition,
                reports,
                shop.surface.as_ref(),
            )?;
            batch.add(path, bytes);
        }
        Ok(())
    };
    let work = Work::start(format!("rewriting {}", programs.name()));
    let done = on_threads(arguments.common.threads, || {
        rewritten(shop, &programs, &targets, || drop(work), &mut report)
    })??;
    for note in &done.notes {
        tell(format_args!("note: {note}"));
    }
    say_unused([&done.used], &shop.cell, shop.surface.as_ref());
    if done.row.ended == Ended::Already {
        say(format!("{}: already compensated with this model; nothing written\n", done.row.file))?;
        return Ok(Ending::Flagged);
    }
    if let Some(path) = &arguments.diff {
        batch.add(path, done.diff);
    }
    add_made(&mut batch, done.written, programs.files.len() > 1)?;
    batch.write()?;
    if let Some(summary) = &summary {
        outputs.print_beside(summary, arguments.output.as_deref() == Some(Path::new("-")))?;
    }
    Ok(shop.judging().ending(done.clean, done.changed))
}

/// Many programs: in parallel, each written on its own, going on past a bad one; one table for all.
fn many(shop: &Shop<'_>, jobs: &[Job], store: Option<&Store>) -> anyhow::Result<Ending> {
    let arguments = shop.arguments;
    #[cfg(feature = "visual")]
    if arguments.outputs.rrd.is_some() {
        bail!("--rrd shows one program: name one");
    }
    let work = Work::start(format!("rewriting {} programs", jobs.len()));
    let doing = Doing {
        read: |job: &Job| Programs::read(&job.paths),
        content: Programs::content,
        work: |job: &Job, programs: Programs| file_to_file(shop, job, &programs),
        whole: arguments.outputs.pages.json.is_some(),
    };
    let done: Vec<Done> = on_threads(arguments.common.threads, || each(store, jobs, &doing))??;
    drop(work);
    for done in &done {
        for note in &done.notes {
            tell(format_args!("note: {}: {note}", done.row.file));
        }
    }
    if store.is_none() {
        say_unused(done.iter().map(|done| &done.used), &shop.cell, shop.surface.as_ref());
    }
    let undeclared: usize = done.iter().map(|done| done.undeclared).sum();
    let module = |path: &PathBuf| Language::by_name(&files::name(path)) == Some(Language::Rapid);
    let alone = |job: &Job| job.under.is_some() && job.paths.len() == 1 && job.paths.iter().any(module);
    if undeclared > 0 && jobs.iter().any(alone) {
        tell(format_args!(
            "note: {} tools, work objects or targets that their own file does not declare: where the modules of a folder run \
             together, --together reads them as one task",
            if undeclared == 1 { "1 motion uses".to_owned() } else { format!("{undeclared} motions use") }
        ));
    }
    let inputs = jobs.iter().flat_map(|job| &job.paths);
    let outputs = outputs_with(store, &arguments.shares, &arguments.outputs)?;
    let shown = Reports { outputs: &outputs, diff: arguments.diff.as_deref(), judging: shop.judging() };
    shown.write(done, Batch::sparing(inputs), store.is_some())
}

/// One program of many: rewritten and written.
fn file_to_file(shop: &Shop<'_>, job: &Job, programs: &Programs) -> anyhow::Result<(Done, Written)> {
    let targets = outputs_of(shop.arguments, job, programs, true)?;
    let with_json = shop.arguments.shows_motions();
    let mut entries = with_json.then(Vec::new);
    let mut report = |planned: &mut Plan, program: &Program<'_>, files: &[ProgramFile]| {
        if with_json
            && let Value::Object(mut all) = view::json(planned, program.listing(), files)
            && let Some(Value::Array(list)) = all.remove("programs")
        {
            entries = Some(list);
        }
        Ok(())
    };
    let mut done = rewritten(shop, programs, &targets, || (), &mut report)?;
    done.json = entries;
    if job.under.is_some() && job.paths.len() > 1 {
        done.row.file = job.name();
    }
    let shared = shop.arguments.shares.on();
    let mut batch = Batch::sparing(programs.files.iter().map(|(path, _)| path)).settled_later(shared);
    let made = std::mem::take(&mut done.written);
    let hash = |(path, bytes): &(PathBuf, Vec<u8>)| (path.clone(), sha256(bytes));
    let written = if shared { made.iter().map(hash).collect() } else { Vec::new() };
    add_made(&mut batch, made, true)?;
    batch.write()?;
    Ok((done, written))
}

/// Adds the programs that were rewritten; `folders`: theirs are made where they are not there yet.
fn add_made(batch: &mut Batch, written: Vec<(PathBuf, Vec<u8>)>, folders: bool) -> anyhow::Result<()> {
    for (path, bytes) in written {
        if folders && let Some(folder) = path.parent() {
            files::make_folder(folder)?;
        }
        batch.add(path, bytes);
    }
    Ok(())
}

type Report<'r> = &'r mut dyn FnMut(&mut Plan, &Program<'_>, &[ProgramFile]) -> anyhow::Result<()>;

/// Plans and rewrites one program; `report` sees the plan before it goes.
fn rewritten(
    shop: &Shop<'_>,
    programs: &Programs,
    targets: &[Option<PathBuf>],
    worked: impl FnOnce(),
    report: Report<'_>,
) -> anyhow::Result<Done> {
    let mut program = programs.task(&shop.setup);
    let loads = shop.arguments.cell.loads(&program);
    // Listed, a program needs its trees no more: they are larger than the file.
    program.forget_trees();
    let program = program;
    let listing = program.listing();
    let known = programs.files.iter().any(|(path, _)| Language::by_name(&files::name(path)).is_some());
    if listing.motions.is_empty() && !known && shop.corrector.is_some() {
        bail!(
            "{}: no motion was found, and the ending of the name says nothing: expected RAPID (.mod, .prg, .sys, .pgf) or NC \
             code (.nc, .mpf, .h and the like)",
            programs.name()
        );
    }
    let mut notes = Vec::new();
    if listing.motions.is_empty() {
        notes.push(match listing.opaque.len() {
            0 => format!("{}: no motion in it, nothing to correct", programs.name()),
            unread => {
                format!("{}: no motion was found; regions that could not be read: {unread}", programs.name())
            }
        });
    }
    let names = programs.files.iter().map(|(path, _)| path.display().to_string()).collect::<Vec<_>>();
    let nothing_left = |notes: Vec<String>| Done {
        row: Row::without(names.join(", "), Ended::Already, None),
        written: Vec::new(),
        diff: Vec::new(),
        notes,
        clean: false,
        changed: false,
        undeclared: 0,
        json: None,
        used: None,
    };
    let marked = already(shop, &program, programs, &mut notes)?;
    if marked.iter().all(|marked| *marked) {
        return Ok(nothing_left(notes));
    }
    if let Some(corrector) = shop.corrector {
        belonging::made_for(programs, &corrector.arm.robot, &corrector.arm.nominal)?;
        let found: Vec<String> =
            shop.surface.iter().flat_map(|surface| misplaced(listing, surface)).collect();
        if !found.is_empty() {
            bail!("{}: {}", programs.name(), found.join("; "));
        }
    }
    let used = Some(Used::by(listing, &shop.cell));
    let options = Options { loads, ..shop.options.clone() };
    let Compensated { plan: mut planned, rewritten } = match shop.corrector {
        Some(corrector) => {
            let mark = Mark {
                version: env!("CARGO_PKG_VERSION").to_owned(),
                model: corrector.hash.to_owned(),
                partial: false,
            };
            compensate(&program, corrector.arm, &shop.cell, &options, Some(mark))?
        }
        None => Compensated {
            plan: untouched(listing, &options),
            rewritten: program.rewrite(&[], &RewriteOptions::default())?,
        },
    };
    if let (Some(motions), Some(corrector)) = (none_in_reach(&planned), shop.corrector) {
        bail!(
            "{}: {motions} motions and hardly one in reach of {} ({}): the program is another robot's, or its tool and work \
             object are not where it is told (--cell); give the model of the robot that runs it",
            programs.name(),
            corrector.arm.robot,
            corrector.model
        );
    }
    if marked.contains(&true) {
        // Modules of one task, some corrected before. What carries no mark has nothing to correct, or was left out then.
        let open =
            rewritten.files.iter().zip(&marked).position(|(file, marked)| !marked && !file.edits.is_empty());
        let Some(open) = open else { return Ok(nothing_left(notes)) };
        let done = marked.iter().position(|marked| *marked).unwrap_or(0);
        bail!(
            "{} is already compensated with this model, {} is not: give the original of {}",
            names[done],
            names[open],
            names[done]
        );
    }
    worked();
    if let Some(surface) = &shop.surface {
        planned.add_normals(surface);
    }
    let files: Vec<ProgramFile> = names
        .iter()
        .zip(targets)
        .map(|(name, target)| ProgramFile {
            file: name.clone(),
            output: target.as_ref().map(|t| t.display().to_string()),
        })
        .collect();
    let (mut written, mut diff, mut changed) = (Vec::new(), Vec::new(), false);
    for (((path, source), edits), target) in programs.files.iter().zip(&rewritten.files).zip(targets) {
        changed |= !edits.edits.is_empty();
        if edits.unmarked {
            notes.push("a fragment without MODULE was changed and carries no mark".to_owned());
        }
        if shop.arguments.diff.is_some() {
            let new = target.as_ref().map_or_else(|| path.display().to_string(), |t| t.display().to_string());
            diff.extend(unified(source, &edits.edits, &path.display().to_string(), &new)?);
        }
        if let Some(target) = target {
            written.push((target.clone(), edits.edits.apply(source)?));
        }
    }
    let ended = if changed { Ended::Changed } else { Ended::Unchanged };
    let output = targets.iter().flatten().map(|t| t.display().to_string()).collect::<Vec<_>>().join(", ");
    let output = Some(output).filter(|output| !output.is_empty());
    let row = Row::of(names.join(", "), output, ended, &planned, listing);
    let undeclared = [Reason::Undeclared, Reason::ToolUnknown, Reason::WorkObjectUnknown].map(Why::Program);
    let undeclared =
        planned.outcomes.iter().filter(|o| o.reason.is_some_and(|why| undeclared.contains(&why))).count();
    let clean = match shop.corrector {
        // Asked to change nothing, and nothing was in doubt.
        None => true,
        // Read whole, and no motion in it.
        Some(_) if listing.motions.is_empty() => listing.opaque.is_empty(),
        // A check passes where nothing is left to change.
        Some(_) if shop.arguments.check && !changed => {
            planned.outcomes.iter().all(|o| o.reason == Some(Why::Same))
        }
        Some(_) => view::verdict(&planned, listing).status == Judged::Good,
    };
    report(&mut planned, &program, &files)?;
    if shop.ends {
        // To take a million pieces apart just before all memory goes back takes a tenth of the time of the whole.
        std::mem::forget((program, planned, rewritten));
    }
    Ok(Done { row, written, diff, notes, clean, changed, undeclared, json: None, used })
}

/// Where each file of a program goes.
fn outputs_of(
    arguments: &Arguments,
    job: &Job,
    programs: &Programs,
    several: bool,
) -> anyhow::Result<Vec<Option<PathBuf>>> {
    if arguments.dry_run || arguments.check {
        return Ok(vec![None; programs.files.len()]);
    }
    let Some(output) = &arguments.output else {
        bail!("-o OUT is missing: a file for one program, a folder for several (or --dry-run)");
    };
    let several = several || programs.files.len() > 1;
    if !several && !output.is_dir() {
        // That it is an input weighs more than how it is called.
        Batch::check(&[], &[output])?;
        if let [(source, bytes)] = programs.files.as_slice() {
            naming::like_its_source(output, source, bytes)?;
        }
        return Ok(vec![Some(output.clone())]);
    }
    if output == Path::new("-") {
        bail!("-o -: the standard output takes one program, these are several: name a folder");
    }
    if output.is_file() {
        bail!("{} is a file, but there are several programs: name a folder", output.display());
    }
    Ok(programs.files.iter().map(|(path, _)| Some(output.join(job.place(path)))).collect())
}

/// No two programs may end in one file: the second would take the place of the first.
fn refuse_one_place_for_two(jobs: &[Job]) -> anyhow::Result<()> {
    let mut taken: HashMap<PathBuf, PathBuf> = HashMap::new();
    for job in jobs {
        for path in job.files() {
            let place = job.place(&path);
            match taken.get(&place) {
                Some(first) if *first == path => bail!("{} is named twice", path.display()),
                Some(first) => bail!(
                    "{} and {} would both be written to {} in the output folder: run them one by one, each into a folder \
                     of its own",
                    first.display(),
                    path.display(),
                    place.display()
                ),
                None => taken.insert(place, path),
            };
        }
    }
    Ok(())
}

/// No report may go where a program of the folder of outputs will be: refused before the first is written.
fn refuse_report_over_program(jobs: &[Job], output: Option<&Path>, reports: &[&Path]) -> anyhow::Result<()> {
    let Some(folder) = output.filter(|output| jobs.len() > 1 || output.is_dir()) else { return Ok(()) };
    let reports: Vec<(&Path, PathBuf)> =
        reports.iter().filter_map(|report| Some((*report, files::whole_path(report)?))).collect();
    if reports.is_empty() {
        return Ok(());
    }
    for job in jobs {
        for path in job.files() {
            let place = folder.join(job.place(&path));
            let there = files::whole_path(&place);
            if let Some((report, _)) = reports.iter().find(|(_, whole)| Some(whole) == there.as_ref()) {
                bail!(
                    "{} is where {} will be written: name another file for the report",
                    report.display(),
                    path.display()
                );
            }
        }
    }
    Ok(())
}

/// A controller that compensates by itself must not be compensated twice.
fn refuse_compensating_controller(robot: Option<&str>) -> anyhow::Result<()> {
    if let Some(name) = robot {
        let robot = inputs::robot(name)?;
        if robot.sheet.compensates {
            bail!(
                "{}: its controller already compensates (robot file, `compensates = true`); switch one of the two off",
                robot.sheet.name
            );
        }
    }
    Ok(())
}

/// What the marks of earlier runs mean for this one: which files are corrected with this model already.
fn already(
    shop: &Shop<'_>,
    program: &Program<'_>,
    programs: &Programs,
    notes: &mut Vec<String>,
) -> anyhow::Result<Vec<bool>> {
    let mut marked = vec![false; programs.files.len()];
    let Some(corrector) = shop.corrector else { return Ok(marked) };
    for (index, (mark, (path, _))) in program.listing().marks.iter().zip(&programs.files).enumerate() {
        let Some(mark) = mark else { continue };
        if mark.model == corrector.hash {
            marked[index] = true;
            continue;
        }
        if !shop.arguments.again {
            bail!(
                "{}: already compensated with another model ({}): take the original program, or say --again, with which the \
                 corrections add up",
                path.display(),
                mark.model
            );
        }
        notes.push(format!(
            "{}: compensated before with model {}; corrections add up",
            path.display(),
            mark.model
        ));
    }
    Ok(marked)
}
