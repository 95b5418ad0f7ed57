//! `truegrind completions SHELL` and `truegrind man`, generated from the same arguments as `--help`.

use std::path::PathBuf;

use anyhow::Context;
use clap::{Args, Command};
use clap_complete::Shell;

use super::exit_status::ExitStatus;
use super::files::{self, Batch};
use super::terminal::{print_message, write_stdout};

/// Arguments of `completions`.
#[derive(Debug, Args)]
pub(super) struct Completions {
    /// Shell.
    #[arg(value_enum)]
    shell: Shell,
}

/// Arguments of `man`.
#[derive(Debug, Args)]
pub(super) struct Man {
    /// Write the pages of all verbs to this folder: truegrind.1, truegrind-compensate.1 and so on. Default: print the main page.
    #[arg(short, long, value_name = "FOLDER")]
    output: Option<PathBuf>,
}

/// Prints a completion script.
pub(super) fn completions(arguments: &Completions, mut command: Command) -> anyhow::Result<ExitStatus> {
    let mut script = Vec::new();
    clap_complete::generate(arguments.shell, &mut command, "truegrind", &mut script);
    write_stdout(&script)?;
    Ok(ExitStatus::Done)
}

/// Prints the main page, or writes all pages.
pub(super) fn man(arguments: &Man, command: Command) -> anyhow::Result<ExitStatus> {
    // Propagates global settings to every verb.
    let mut command = command.disable_help_subcommand(true);
    command.build();
    let Some(folder) = &arguments.output else {
        write_stdout(&page(&command)?)?;
        return Ok(ExitStatus::Done);
    };
    files::make_folder(folder)?;
    let mut batch = Batch::default();
    batch.add(folder.join("truegrind.1"), page(&command)?);
    for verb in command.get_subcommands() {
        let name = format!("truegrind-{}", verb.get_name());
        batch.add(folder.join(format!("{name}.1")), page(verb)?);
    }
    batch.write()?;
    print_message(format_args!(
        "written to {}: read one with `man {}`",
        folder.display(),
        folder.join("truegrind.1").display()
    ));
    Ok(ExitStatus::Done)
}

fn page(command: &Command) -> anyhow::Result<Vec<u8>> {
    let mut out = Vec::new();
    let made = clap_mangen::Man::new(command.clone()).section("1").render(&mut out);
    made.context("the man page cannot be generated")?;
    Ok(out)
}
