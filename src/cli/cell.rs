//! `truegrind cell PROGRAM… -o CELL.toml`: writes a cell file to fill in.

use std::path::{Path, PathBuf};

use anyhow::bail;
use clap::Args;
use truegrind::compensation::cell::Cell;
use truegrind::compensation::cell::nc_setup::cell_setup;
use truegrind::compensation::cell::template::{TemplateProgram, cell_template};
use truegrind::programs::reading::Program;

use super::exit_status::ExitStatus;
use super::files::{Batch, spare_filled_in};
use super::inputs::{self, UrdfLinks};
use super::programs::{self, Grouping, Programs};
use super::terminal::print_message;

/// Arguments of `cell`.
#[derive(Debug, Args)]
pub(super) struct Arguments {
    /// Programs: RAPID modules of one task, .pgf task lists, NC files, or folders of them.
    #[arg(required = true)]
    programs: Vec<PathBuf>,
    #[command(flatten)]
    grouping: Grouping,
    /// Cell file to write; `-` prints it.
    #[arg(short, long, value_name = "CELL.toml")]
    output: PathBuf,
    /// Robot that runs them, noted in the file: a name from `truegrind robots`, or a robot file.
    #[arg(long)]
    robot: Option<String>,
    #[command(flatten)]
    links: UrdfLinks,
}

pub(super) fn run(arguments: &Arguments) -> anyhow::Result<ExitStatus> {
    let jobs = programs::jobs(&arguments.programs, arguments.grouping)?;
    let all: Vec<PathBuf> = jobs.iter().flat_map(|job| job.paths.clone()).collect();
    let inputs_of: Vec<&Path> = all.iter().map(PathBuf::as_path).collect();
    Batch::check(&inputs_of, &[&arguments.output])?;
    if let Some(extension) =
        arguments.output.extension().filter(|extension| !extension.eq_ignore_ascii_case("toml"))
    {
        bail!(
            "{}: a cell file is TOML: expected the extension .toml, not .{}",
            arguments.output.display(),
            extension.to_string_lossy()
        );
    }
    let named = arguments.robot.as_deref().map(|name| arguments.links.of(name));
    let robot = named.map(inputs::robot).transpose()?;
    let setup = cell_setup(&Cell::default());
    let read = jobs.iter().map(|job| Programs::read(&job.paths)).collect::<anyhow::Result<Vec<_>>>()?;
    let names: Vec<String> = read.iter().map(Programs::name).collect();
    let tasks: Vec<Program<'_>> = read.iter().map(|programs| programs.task(&setup)).collect();
    let asking: Vec<TemplateProgram<'_>> = tasks
        .iter()
        .zip(&names)
        .map(|(task, name)| TemplateProgram { name, language: task.language(), listing: task.listing() })
        .collect();
    for comment in asking.iter().flat_map(|program| &program.listing.invalid_statements) {
        print_message(format_args!("note: {comment}"));
    }
    if asking.iter().all(|program| program.listing.motions.is_empty()) {
        read.iter().try_for_each(Programs::refuse_other_kinds)?;
        bail!("these programs contain no motion, so they use no tool and no work object");
    }
    let made = cell_template(&asking, robot.as_ref().map(|robot| robot.sheet.name.as_str()));
    spare_filled_in(&arguments.output, &made.text)?;
    let mut batch =
        Batch::sparing(read.iter().flat_map(|programs| programs.files.iter().map(|(path, _)| path)));
    batch.add(&arguments.output, made.text);
    batch.write()?;
    let to_do = match made.open {
        0 => "nothing to fill in: the programs use only the default tool and work object of the controller"
            .to_owned(),
        1 => "1 value to fill in, marked \"?\"".to_owned(),
        open => format!("{open} values to fill in, marked \"?\""),
    };
    print_message(format_args!(
        "written to {}: {to_do}; then run truegrind compensate … --cell",
        arguments.output.display()
    ));
    Ok(ExitStatus::Done)
}
