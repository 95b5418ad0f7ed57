//! `truegrind path SURFACE.toml --robot R -o PROGRAM.mod`: makes a grinding program.

use std::path::{Path, PathBuf};

use anyhow::{anyhow, bail};
use clap::Args;
use truegrind::planning::toolpath::{Toolpath, toolpath};
use truegrind::programs::nc;
use truegrind::programs::nc::dialect::Dialect;
use truegrind::programs::nc::orientation::Angles;
use truegrind::programs::rapid::writer;
use truegrind::robots::Robot;
use truegrind::surfaces::SurfaceFile;

use super::exit_status::ExitStatus;
use super::files::{self, Batch};
use super::inputs::{self, UrdfLinks};
use super::robot_match;
use super::terminal::print_message;
use truegrind::compensation::cell::nc_setup::angle_convention;

/// Arguments of `path`.
#[derive(Debug, Args)]
pub(super) struct Arguments {
    /// Surface file: surface, work object, tool and pattern.
    surface: PathBuf,
    /// Robot: a name from `truegrind robots`, or a robot file.
    #[arg(long)]
    robot: String,
    #[command(flatten)]
    links: UrdfLinks,
    /// Program to write; the extension selects RAPID (.mod), Fanuc style (.nc) or Siemens 840D (.mpf). `-` prints RAPID.
    #[arg(short, long, value_name = "PROGRAM")]
    output: PathBuf,
    /// Write the targets into the instructions instead of declaring them as p10, p20, …
    #[arg(long)]
    inline: bool,
}

pub(super) fn run(arguments: &Arguments) -> anyhow::Result<ExitStatus> {
    Batch::check(&[&arguments.surface], &[&arguments.output])?;
    let robot = inputs::robot(arguments.links.of(&arguments.robot))?;
    let file = surface(&arguments.surface)?;
    // An output that is an input is reported first.
    files::expect(&arguments.surface)?;
    Batch::check(&[], &[&arguments.output])?;
    let control = control_of(&arguments.output)?;
    let mut path = toolpath(&file, &robot.model, &robot.sheet.name)?;
    path.draft.named_targets = !arguments.inline;
    let bytes = match control {
        Some(control) => nc::writer::write(&path.draft, control, angles_of(&robot))?,
        None => writer::write(&path.draft)?,
    };
    let mut batch = Batch::sparing([&arguments.surface]);
    batch.add(&arguments.output, bytes);
    batch.write()?;
    report_toolpath(&path, &robot, &arguments.output);
    if control.is_none() {
        robot_match::note_other_language(&robot);
    }
    Ok(ExitStatus::Done)
}

/// The control for which an output is written; `None` for RAPID, which stdout gets too.
fn control_of(output: &Path) -> anyhow::Result<Option<Dialect>> {
    let extension = output.extension().map(|extension| extension.to_string_lossy().to_ascii_lowercase());
    match extension.as_deref() {
        Some("nc") => Ok(Some(Dialect::Fanuc)),
        Some("mpf" | "spf") => Ok(Some(Dialect::Siemens)),
        Some("mod" | "modx" | "prg" | "sys") | None => Ok(None),
        Some(other) => bail!(
            "{}: new programs are written as RAPID (.mod), Fanuc style (.nc) or 840D (.mpf), not as .{other}: choose one of these extensions",
            output.display()
        ),
    }
}

/// Meaning of A, B and C: that of the robot file, or else rotations about the fixed x, y and z axes (W, P, R).
fn angles_of(robot: &Robot) -> Angles {
    robot.sheet.orientation().and_then(angle_convention).unwrap_or(Angles::Wpr)
}

fn report_toolpath(path: &Toolpath, robot: &Robot, output: &Path) {
    let passes = path.points.iter().map(|p| p.pass + 1).max().unwrap_or(0);
    print_message(format_args!(
        "{} targets in {passes} passes for {}, smallest distance to a singularity {:.3}; written to {}",
        path.points.len(),
        robot.sheet.name,
        path.singularity,
        output.display()
    ));
}

/// Reads a surface file and the mesh that it names.
pub(super) fn surface(path: &Path) -> anyhow::Result<SurfaceFile> {
    let bytes = files::read(path)?;
    let name = path.display().to_string();
    inputs::refuse_program(path, "a surface file (.toml)")?;
    let resolve = |mesh: &str| inputs::read_beside(path, mesh).map_err(|e| format!("{e:#}"));
    SurfaceFile::read(&name, &bytes, resolve)
        .map_err(|e| anyhow!("{e}; expected a surface file, such as surfaces/blade.toml"))
}
