//! `truegrind path SURFACE.toml --robot R -o PROGRAM.mod`: makes a grinding program.

use std::path::{Path, PathBuf};

use anyhow::anyhow;
use clap::Args;
use truegrind::file_kind::FileKind;
use truegrind::planning::toolpath::{Toolpath, control_of, toolpath};
use truegrind::robots::Robot;
use truegrind::surfaces::SurfaceFile;

use super::exit_status::ExitStatus;
use super::files::{self, Batch};
use super::inputs::{self, UrdfLinks};
use super::robot_match;
use super::terminal::print_message;

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
    let path = toolpath(&file, &robot.model, &robot.sheet.name)?;
    let bytes = path.program(control, &robot, arguments.inline)?;
    let mut batch = Batch::sparing([&arguments.surface]);
    batch.add(&arguments.output, bytes);
    batch.write()?;
    report_toolpath(&path, &robot, &arguments.output);
    if control.is_none() {
        robot_match::note_other_language(&robot);
    }
    Ok(ExitStatus::Done)
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

/// What `path` and `--surface` read.
const SURFACE_FILE: &str = "a surface file, such as surfaces/blade.toml";

/// Reads a surface file and the mesh that it names.
pub(super) fn surface(path: &Path) -> anyhow::Result<SurfaceFile> {
    let bytes = files::read(path)?;
    let name = path.display().to_string();
    let resolve = |mesh: &str| inputs::read_beside(path, mesh).map_err(|e| format!("{e:#}"));
    SurfaceFile::read(&name, &bytes, resolve).map_err(|e| {
        let told = anyhow!("{e}; expected {SURFACE_FILE}");
        inputs::other_kind_or(path, &[FileKind::Surface], SURFACE_FILE, told)
    })
}
