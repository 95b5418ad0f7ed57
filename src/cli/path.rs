//! `truegrind path SURFACE.toml --robot R -o PROGRAM.mod`.

use std::path::{Path, PathBuf};

use anyhow::{anyhow, bail};
use clap::Args;
use truegrind::planning::toolpath::{Toolpath, toolpath};
use truegrind::programs::nc;
use truegrind::programs::nc::dialect::Dialect;
use truegrind::programs::nc::orientation::Angles;
use truegrind::programs::rapid::writer;
use truegrind::programs::reading::Language;
use truegrind::robots::Robot;
use truegrind::surfaces::SurfaceFile;

use super::exit_status::ExitStatus;
use super::files::{self, Batch};
use super::inputs;
use super::output_extension;
use super::terminal::print_message;
use truegrind::compensation::cell::nc_setup::angles;

/// Arguments of `path`.
#[derive(Debug, Args)]
pub(super) struct Arguments {
    /// Surface, work object, tool and pattern.
    surface: PathBuf,
    /// Robot: a name of `truegrind robots`, or a TOML file.
    #[arg(long)]
    robot: String,
    /// The program to write: RAPID (.mod), Fanuc style (.nc) or Siemens (.mpf) by its ending; `-` prints RAPID.
    #[arg(short, long, value_name = "PROGRAM")]
    output: PathBuf,
    /// Put the targets into the instructions instead of naming them p10, p20, …
    #[arg(long)]
    inline: bool,
}

pub(super) fn run(arguments: &Arguments) -> anyhow::Result<ExitStatus> {
    Batch::check(&[&arguments.surface], &[&arguments.output])?;
    let robot = inputs::robot(&arguments.robot)?;
    let file = surface(&arguments.surface)?;
    // An output that is an input is told as such first.
    files::expect(&arguments.surface)?;
    Batch::check(&[], &[&arguments.output])?;
    output_extension::refuse_unknown(&arguments.output)?;
    let mut path = toolpath(&file, &robot.model, &robot.sheet.name)?;
    path.draft.named_targets = !arguments.inline;
    let ending = arguments.output.extension().map(|ending| ending.to_string_lossy().to_ascii_lowercase());
    let bytes = match ending.as_deref() {
        Some("nc") => nc::writer::write(&path.draft, Dialect::Fanuc, angles_of(&robot))?,
        Some("mpf" | "spf") => nc::writer::write(&path.draft, Dialect::Siemens, angles_of(&robot))?,
        Some("ngc" | "h") => bail!(
            "{}: programs of this control are read and rewritten, not written anew; name a .mod, .nc or .mpf file",
            arguments.output.display()
        ),
        _ if Language::by_name(&files::name(&arguments.output)) == Some(Language::Nc) => bail!(
            "{}: which control it is for, the ending does not say; name a .mod (RAPID), .nc (Fanuc style) or .mpf (840D) file",
            arguments.output.display()
        ),
        _ => writer::write(&path.draft)?,
    };
    let mut batch = Batch::sparing([&arguments.surface]);
    batch.add(&arguments.output, bytes);
    batch.write()?;
    report_toolpath(&path, &robot, &arguments.output);
    Ok(ExitStatus::Done)
}

/// What A, B and C mean: as the robot file says, else turns about the fixed x, y and z as their letters have it.
fn angles_of(robot: &Robot) -> Angles {
    robot.sheet.orientation().and_then(angles).unwrap_or(Angles::Wpr)
}

fn report_toolpath(path: &Toolpath, robot: &Robot, output: &Path) {
    let passes = path.points.iter().map(|p| p.pass + 1).max().unwrap_or(0);
    print_message(format_args!(
        "{} targets in {passes} passes for {}, distance to singularity at least {:.3}; written to {}",
        path.points.len(),
        robot.sheet.name,
        path.singularity,
        output.display()
    ));
}

/// Reads a surface file; a mesh is looked up beside it.
pub(super) fn surface(path: &Path) -> anyhow::Result<SurfaceFile> {
    let bytes = files::read(path)?;
    let name = path.display().to_string();
    let resolve = |mesh: &str| inputs::read_beside(path, mesh).map_err(|e| format!("{e:#}"));
    SurfaceFile::read(&name, &bytes, resolve).map_err(|e| anyhow!("{e}"))
}
