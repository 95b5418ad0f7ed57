//! `truegrind cell PROGRAM… -o CELL.toml`: the cell file that programs ask for, to be filled in.

use std::path::{Path, PathBuf};

use anyhow::bail;
use clap::Args;
use truegrind::compensation::cell::Cell;
use truegrind::compensation::cell::template::{Asking, skeleton};
use truegrind::programs::reading::Program;

use super::ending::Ending;
use super::files::Batch;
use super::inputs;
use super::programs::{self, Grouping, Programs};
use super::terminal::tell;

/// Arguments of `cell`.
#[derive(Debug, Args)]
pub(super) struct Arguments {
    /// RAPID modules of one task, .pgf lists of such, NC files, or folders of them.
    #[arg(required = true)]
    programs: Vec<PathBuf>,
    #[command(flatten)]
    grouping: Grouping,
    /// The cell file to write; `-` prints it.
    #[arg(short, long, value_name = "CELL.toml")]
    output: PathBuf,
    /// The robot that runs them, written into the file: a name of `truegrind robots`, or a TOML file.
    #[arg(long)]
    robot: Option<String>,
}

pub(super) fn run(arguments: &Arguments) -> anyhow::Result<Ending> {
    let jobs = programs::jobs(&arguments.programs, arguments.grouping)?;
    let all: Vec<PathBuf> = jobs.iter().flat_map(|job| job.paths.clone()).collect();
    let inputs_of: Vec<&Path> = all.iter().map(PathBuf::as_path).collect();
    Batch::check(&inputs_of, &[&arguments.output])?;
    if let Some(ending) = arguments.output.extension().filter(|ending| !ending.eq_ignore_ascii_case("toml")) {
        bail!(
            "{}: a cell file is TOML: name a .toml file, not one that ends in .{}",
            arguments.output.display(),
            ending.to_string_lossy()
        );
    }
    let robot = arguments.robot.as_deref().map(inputs::robot).transpose()?;
    let setup = programs::setup(&Cell::default(), arguments.robot.as_deref());
    let read = jobs.iter().map(|job| Programs::read(&job.paths)).collect::<anyhow::Result<Vec<_>>>()?;
    let names: Vec<String> = read.iter().map(Programs::name).collect();
    let tasks: Vec<Program<'_>> = read.iter().map(|programs| programs.task(&setup)).collect();
    let asking: Vec<Asking<'_>> = tasks
        .iter()
        .zip(&names)
        .map(|(task, name)| Asking { name, language: task.language(), listing: task.listing() })
        .collect();
    for comment in asking.iter().flat_map(|program| &program.listing.misstated) {
        tell(format_args!("note: {comment}"));
    }
    if asking.iter().all(|program| program.listing.motions.is_empty()) {
        bail!("no motion is in these programs: there is no tool and no work object to ask for");
    }
    let made = skeleton(&asking, robot.as_ref().map(|robot| robot.sheet.name.as_str()));
    let mut batch =
        Batch::sparing(read.iter().flat_map(|programs| programs.files.iter().map(|(path, _)| path)));
    batch.add(&arguments.output, made.text);
    batch.write()?;
    let said = match made.open {
        0 => "nothing to fill in: the programs use the controller's own tool and frame".to_owned(),
        1 => "1 value to fill in, marked \"?\"".to_owned(),
        open => format!("{open} values to fill in, marked \"?\""),
    };
    tell(format_args!(
        "written to {}: {said}; then: truegrind compensate … --cell",
        arguments.output.display()
    ));
    Ok(Ending::Done)
}
