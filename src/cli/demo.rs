//! `truegrind demo [-o DIR]`: the complete workflow on files that ship with truegrind.
//!
//! A surface becomes a RAPID program. Simulated measurements serve to identify the arm with each method and to diagnose the
//! errors that geometry does not explain. The program is corrected with each model and run on the simulated actual arm, which
//! has effects and noise beyond geometry. The program corrected with the diagnosed model is written.

use std::path::{Path, PathBuf};

use clap::Args;
use truegrind::Confidence;
use truegrind::arm::condition::Condition;
use truegrind::arm::estimated::Estimated;
use truegrind::arm::model::Model;
use truegrind::calibration::diagnosis;
use truegrind::calibration::identification::identify::{Identification, Options};
use truegrind::calibration::identification::solver::SOLVERS;
use truegrind::calibration::measurement::import;
use truegrind::compensation::cell::Cell;
use truegrind::compensation::compensate::compensate;
use truegrind::compensation::deviation::{After, Deviation, PathPoint, PathReport};
use truegrind::compensation::options::Options as RewriteBounds;
use truegrind::compensation::verify::{ActingArm, VerificationTask, verify};
use truegrind::planning::taught_cell::taught_cell;
use truegrind::planning::toolpath::toolpath;
use truegrind::programs::motion::Mark;
use truegrind::programs::rapid::{Task, writer};
use truegrind::programs::reading::Program;
use truegrind::report::document::Document;
use truegrind::report::{
    deviation as deviation_view, diagnosis as diagnosis_view, format, identification as identification_view,
};
use truegrind::surfaces::{SurfaceFile, sample};

use super::computation::{Common, on_threads};
use super::exit_status::ExitStatus;
use super::files::{self, Batch};
use super::progress::Spinner;
use super::terminal::{print_result, width};
use super::{diagnose, identify, inputs, simulate};

/// Simulated measurements and their recipe.
const DATA: &[u8] = include_bytes!("../../tests/data/irb120-cable.csv");
const RECIPE: &str = include_str!("../../tests/data/irb120-cable.toml");

/// Name of the diagnosed model.
const DIAGNOSED: &str = "diagnosed";

/// Arguments of `demo`.
#[derive(Debug, Args)]
pub(super) struct Arguments {
    /// Folder for all outputs.
    #[arg(short, long, default_value = "truegrind-demo")]
    output: PathBuf,
    #[command(flatten)]
    common: Common,
}

pub(super) fn run(arguments: &Arguments) -> anyhow::Result<ExitStatus> {
    files::make_folder(&arguments.output)?;
    on_threads(arguments.common.threads, || run_workflow(&arguments.output, arguments.common.seed))?
}

/// The program and the arms that run it.
struct Job<'a> {
    task: &'a Program<'a>,
    program: &'a [u8],
    cell: &'a Cell,
    surface: &'a SurfaceFile,
    nominal: &'a Model,
    /// The simulated actual arm.
    actual: &'a Model,
    condition: Condition,
}

/// The program corrected with a model, and the model file.
struct Corrected {
    program: Vec<u8>,
    model: String,
}

impl Job<'_> {
    /// Corrects the program with a model and runs it on the simulated actual arm.
    fn correct_and_run(&self, name: &str, estimated: &Estimated) -> anyhow::Result<(PathReport, Corrected)> {
        let bounds = RewriteBounds { condition: self.condition, ..RewriteBounds::default() };
        let model = estimated.to_toml()?;
        let mark = Mark {
            version: env!("CARGO_PKG_VERSION").to_owned(),
            model: Estimated::file_hash(&model),
            partial: false,
        };
        let done = compensate(self.task, estimated, self.cell, &bounds, Some(mark))?;
        let planned = done.plan;
        let program = done.rewritten.files[0].edits.apply(self.program)?;
        let after = Task::read(&[("blade.mod", program.as_slice())]);
        let judged = VerificationTask {
            original: self.task.listing(),
            rewritten: Some(&after.listing),
            cell: self.cell,
            surface: Some(&self.surface.surface),
            program: "blade.mod",
            name,
            after: After::Achieved,
            tolerance_mm: RewriteBounds::default().tolerance_mm,
            loads: [None, None],
        };
        let acting = ActingArm {
            nominal: self.nominal,
            model: self.actual,
            knowledge: None,
            condition: self.condition,
        };
        let mut report = verify(&judged, &acting);
        report.held_out_mm = Some(estimated.calibrated.held_out.rmse);
        for (point, planned) in report.points.iter_mut().zip(&planned.points) {
            (point.sigma_mm, point.outside) = (planned.sigma_mm, planned.outside);
            (point.status, point.reason) = (planned.status, planned.reason.clone());
        }
        Ok((report, Corrected { program, model }))
    }

    /// Adds the programs, the model and the deviation reports.
    fn add_files(
        &self,
        batch: &mut Batch,
        folder: &Path,
        best: &Corrected,
        reports: &[PathReport],
    ) -> anyhow::Result<()> {
        let mut page: Document = deviation_view::document(reports);
        page.title = "truegrind demo: a blade ground by an IRB 120".to_owned();
        let mut add = |name: &str, bytes: Vec<u8>| batch.add(folder.join(name), bytes);
        add("blade.mod", self.program.to_vec());
        add("blade-compensated.mod", best.program.clone());
        add("model.toml", best.model.clone().into());
        add("measurements.csv", DATA.to_vec());
        add("cell.toml", toml::to_string(self.cell)?.into());
        add("actual-arm.toml", simulate::arm_text(self.actual)?.into());
        add("deviation.csv", format::csv::table(&deviation_view::whole_table(reports)).into());
        add("deviation.md", format::markdown::document(&page).into());
        add("deviation.html", format::html::document(&page).into());
        add("deviation.json", format::json::text(&deviation_view::json(reports))?.into());
        Ok(())
    }

    #[cfg(feature = "visual")]
    fn recording(&self, reports: &[PathReport]) -> anyhow::Result<Vec<u8>> {
        let arms = super::recording::Arms {
            real: self.actual,
            is: "simulated actual arm",
            nominal: self.nominal,
            robot: None,
        };
        super::recording::path("truegrind demo", arms, self.condition, reports, Some(self.surface))
    }
}

fn run_workflow(folder: &Path, seed: u64) -> anyhow::Result<ExitStatus> {
    let robot = inputs::robot("abb-irb-120")?;
    let nominal = &robot.model;
    let work = Spinner::start("making the program from the surface");
    let surface = sample::BLADE.read()?;
    let path = toolpath(&surface, nominal, &robot.sheet.name)?;
    let program = writer::write(&path.draft)?;
    let task = Program::Rapid(Task::read(&[("blade.mod", program.as_slice())]));
    let cell = taught_cell(&surface, &path, nominal, [&surface.tool.name, &surface.work_object.name])?;

    drop(work);
    let work = Spinner::start("identifying the arm with each method");
    let dataset = import::read("irb120-cable.csv", DATA, &import::Options::default())?;
    let simulation = simulate::simulation(RECIPE, "irb120-cable.toml", None)?;
    let mut found: Vec<Identification> = Vec::new();
    for solver in SOLVERS {
        let options = Options { solver, seed, ..Options::default() };
        found.push(identify::identified(&dataset, &robot.sheet.name, nominal, &options)?);
    }

    drop(work);
    let work = Spinner::start("diagnosing errors beyond geometry");
    let mut asked = diagnosis::diagnose::Options::default();
    asked.selection.seed = seed;
    let causes = diagnose::diagnosed(&dataset, &robot.sheet.name, nominal, &asked, &|step| work.show(step))?;
    let mut arms: Vec<(&str, &Estimated)> = vec![(DIAGNOSED, &causes.estimated)];
    arms.extend(found.iter().map(|one| (one.estimated.provenance.method.as_str(), &one.estimated)));

    drop(work);
    let work = Spinner::start("correcting the program and running it on the simulated actual arm");
    let mass = path.draft.tool.1.mass_kg;
    let condition = Condition { payload_kg: Some(mass), ..Condition::default() };
    let job = Job {
        task: &task,
        program: &program,
        cell: &cell,
        surface: &surface,
        nominal,
        actual: &simulation.actual,
        condition,
    };
    let runs = arms.into_iter().map(|(name, estimated)| job.correct_and_run(name, estimated));
    let (reports, corrected): (Vec<_>, Vec<_>) =
        runs.collect::<anyhow::Result<Vec<_>>>()?.into_iter().unzip();

    drop(work);
    let mut batch = Batch::default();
    job.add_files(&mut batch, folder, &corrected[0], &reports)?;
    let identification = identification_view::document(&found[0], &dataset);
    batch.add(folder.join("identification.html"), format::html::document(&identification));
    let diagnosis = diagnosis_view::document(&causes, &dataset);
    batch.add(folder.join("diagnosis.html"), format::html::document(&diagnosis));
    #[cfg(feature = "visual")]
    batch.add(folder.join("demo.rrd"), job.recording(&reports[..1])?);
    batch.write()?;

    print_result(summary(folder, &reports, &causes))?;
    Ok(ExitStatus::Done)
}

/// The text for the terminal.
fn summary(folder: &Path, reports: &[PathReport], causes: &diagnosis::diagnose::Diagnosed) -> String {
    let tables = [deviation_view::block_table(reports), deviation_view::registered_table(reports)];
    let mut text = headline(&reports[0], causes);
    for table in &tables {
        text += &format::terminal::table(table, width());
        text += "\n";
    }
    text += &format!(
        "All data are simulated (recipe and seed: tests/data/README.md). Written to {}:\n",
        folder.display()
    );
    for (name, what) in [
        ("deviation.html", "start here: deviation along the path before and after correction"),
        ("identification.html", "the arm geometry fitted to the measurements"),
        ("diagnosis.html", "errors that geometry does not explain, and their causes"),
        ("blade.mod, blade-compensated.mod", "the program before and after correction"),
        ("model.toml", "the estimated arm, including the causes"),
        #[cfg(feature = "visual")]
        ("demo.rrd", "3D recording: open with truegrind view or any Rerun viewer"),
    ] {
        text += &format!("  {name:<34} {what}\n");
    }
    text
}

/// The result in two lines.
fn headline(report: &PathReport, causes: &diagnosis::diagnose::Diagnosed) -> String {
    let largest = |which: fn(&PathPoint) -> Option<Deviation>| {
        report.signed_mm(which).into_iter().map(f64::abs).fold(0.0, f64::max)
    };
    let named = causes.diagnosis.findings.iter().filter(|f| f.confidence == Confidence::Identified).count();
    format!(
        "Largest deviation on the blade: {:.3} mm before correction, {:.3} mm after (simulated actual arm, along the surface \
         normal).\nModel: geometry and {named} identified causes, from {} measured poses.\n\n",
        largest(|p| p.before),
        largest(|p| p.after),
        causes.estimated.provenance.rows
    )
}
