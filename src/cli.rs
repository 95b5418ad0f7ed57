//! The command line: one file per verb. Only this module prints and opens files.
//!
//! Results go to stdout, messages and progress to stderr. Exit code 0: done; 1: done, but something was refused or
//! flagged; 2: error: the result was not written (reports on why a model was refused may be).

mod computation;
mod exit_status;
mod defect;
mod terminal;
mod colour;
mod files;
mod inputs;
mod outputs;
mod progress;
#[cfg(feature = "visual")]
mod recording;
mod robots;
mod simulate;
mod identify;
mod stated_frames;
mod diagnose;
mod fleet;
mod plan;
mod compare;
mod track;
mod path;
mod programs;
mod shares;
mod output_extension;
mod robot_match;
mod cell;
mod cell_arguments;
mod manual;
mod compensate;
mod deviation;
mod gather;
mod export;
mod accept;
mod measurement;
mod demo;
#[cfg(feature = "visual")]
mod view;

use std::process::ExitCode;

use clap::{CommandFactory, Parser, Subcommand};

use self::exit_status::ExitStatus;

/// Learns the real robot arm from measured poses and rewrites programs so that it follows them.
#[derive(Debug, Parser)]
#[command(name = "truegrind", version, arg_required_else_help = true, max_term_width = 100)]
struct Cli {
    #[command(subcommand)]
    verb: Verb,
}

#[derive(Debug, Subcommand)]
enum Verb {
    /// Run the complete workflow on files that ship with truegrind.
    Demo(demo::Arguments),
    /// List the known robots, or show one with the source of each number.
    Robots(robots::Arguments),
    /// Simulate measurements of a given "actual" arm, with effects, noise and rounding.
    Simulate(simulate::Arguments),
    /// Prepare a measurement: write the empty table to fill in.
    Measurement(measurement::Arguments),
    /// Fit the arm geometry to measured poses; report what the data determine.
    Identify(identify::Arguments),
    /// Find the physical causes of errors that geometry does not explain, and extend the model by them.
    Diagnose(diagnose::Arguments),
    /// Choose the poses to measure and write a program that moves to them.
    Plan(Box<plan::Arguments>),
    /// Compare calibration methods in the experiment of a paper.
    Compare(compare::Arguments),
    /// Keep a model up to date as new measurements arrive.
    Track(track::Arguments),
    /// Make a grinding program from a surface: RAPID, or NC by the extension of the output (.nc, .mpf).
    Path(path::Arguments),
    /// Write a cell file to fill in, with every tool and frame that the programs use.
    Cell(cell::Arguments),
    /// Correct programs so that the real arm follows the intended path.
    Compensate(compensate::Arguments),
    /// Report how far the arm deviates when it runs programs; nothing is rewritten.
    Deviation(deviation::Arguments),
    /// Combine the results of the jobs of a shared run (--shard); same bytes as from a single run.
    Gather(gather::Arguments),
    /// Test whether an estimated arm meets a tolerance at new poses; writes an acceptance report.
    Accept(accept::Arguments),
    /// Export the links of an estimated arm: URDF, DH tables, kinematics for UR drivers.
    Export(export::Arguments),
    /// Show recordings, measurements, models and programs in Rerun.
    #[cfg(feature = "visual")]
    View(view::Arguments),
    /// Show recordings (not in this build).
    #[cfg(not(feature = "visual"))]
    #[command(hide = true)]
    View {
        /// Whatever was to be shown.
        #[arg(trailing_var_arg = true, allow_hyphen_values = true)]
        _files: Vec<String>,
    },
    /// Print a shell completion script (bash, zsh, fish, elvish, powershell).
    Completions(manual::Completions),
    /// Print the man page, or write the man pages of all verbs.
    Man(manual::Man),
}

/// Runs the command line.
pub(crate) fn run() -> ExitCode {
    let cli = match Cli::try_parse() {
        Ok(cli) => cli,
        Err(error) => {
            // Help and version are not errors.
            let code = if error.use_stderr() { 2 } else { 0 };
            if error.use_stderr() {
                // The message quotes the arguments, which may hold file names from a shell pattern.
                terminal::print_message_lines(&with_number_tip(error.render().to_string()));
            } else {
                let _ = error.print();
            }
            return ExitCode::from(code);
        }
    };
    defect::install_silent_hook();
    match defect::catch_panic(|| dispatch(cli.verb)) {
        Ok(ExitStatus::Done) => ExitCode::SUCCESS,
        Ok(ExitStatus::Flagged) => ExitCode::from(1),
        Err(error) => {
            terminal::print_message(format!("error: {error:#}"));
            ExitCode::from(2)
        }
    }
}

/// Says how numbers are written, where one has a decimal comma or several stand apart.
fn with_number_tip(mut message: String) -> String {
    let value = message.split_once("invalid value '").and_then(|(_, rest)| rest.split_once('\''));
    let comma = value.map(|(value, _)| value.replace(',', ".")).filter(|value| value.parse::<f64>().is_ok());
    if let Some(value) = comma.filter(|_| message.contains("invalid float literal")) {
        message.push_str(&format!("\n  tip: a number has a decimal point, not a comma: {value}\n"));
    }
    let apart = message.split_once("unexpected argument '").and_then(|(_, rest)| rest.split_once('\''));
    if apart.is_some_and(|(value, _)| value.parse::<f64>().is_ok()) {
        message.push_str(
            "\n  tip: several numbers of one option stand together, with commas between them: 40,0,60\n",
        );
    }
    message
}

fn dispatch(verb: Verb) -> anyhow::Result<ExitStatus> {
    match verb {
        Verb::Demo(arguments) => demo::run(&arguments),
        Verb::Robots(arguments) => robots::run(&arguments),
        Verb::Simulate(arguments) => simulate::run(&arguments),
        Verb::Measurement(arguments) => measurement::run(&arguments),
        Verb::Identify(arguments) => identify::run(&arguments),
        Verb::Diagnose(arguments) if fleet::is_requested(&arguments) => fleet::run(&arguments),
        Verb::Diagnose(arguments) => diagnose::run(&arguments),
        Verb::Plan(arguments) => plan::run(&arguments),
        Verb::Compare(arguments) => compare::run(&arguments),
        Verb::Track(arguments) => track::run(&arguments),
        Verb::Path(arguments) => path::run(&arguments),
        Verb::Cell(arguments) => cell::run(&arguments),
        Verb::Compensate(arguments) => compensate::run(&arguments),
        Verb::Deviation(arguments) => deviation::run(&arguments.with_programs()?),
        Verb::Gather(arguments) => gather::run(&arguments),
        Verb::Accept(arguments) => accept::run(&arguments),
        Verb::Export(arguments) => export::run(&arguments),
        #[cfg(feature = "visual")]
        Verb::View(arguments) => view::run(&arguments),
        #[cfg(not(feature = "visual"))]
        Verb::View { .. } => Err(anyhow::anyhow!(outputs::NO_RECORDINGS)),
        Verb::Completions(arguments) => manual::completions(&arguments, Cli::command()),
        Verb::Man(arguments) => manual::man(&arguments, Cli::command()),
    }
}
