//! Arguments, one file per verb, and the only place that prints or opens files.
//!
//! Results go to stdout, talk and progress to stderr. Exit code 0: done; 1: done, but something was refused or
//! flagged; 2: nothing done.

mod computation;
mod ending;
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
mod stated;
mod diagnose;
mod fleet;
mod plan;
mod compare;
mod track;
mod path;
mod programs;
mod shares;
mod naming;
mod belonging;
mod cell;
mod manual;
mod corrected;
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

use self::ending::Ending;

/// Learns the real robot arm from measured poses and rewrites programs so that it follows them.
#[derive(Debug, Parser)]
#[command(name = "truegrind", version, arg_required_else_help = true, max_term_width = 100)]
struct Cli {
    #[command(subcommand)]
    verb: Verb,
}

#[derive(Debug, Subcommand)]
enum Verb {
    /// The whole way on what ships with the project, without any file of yours.
    Demo(demo::Arguments),
    /// The catalogue of robots; with a name, one robot and the source of each number.
    Robots(robots::Arguments),
    /// Measurements of a stated "actual" arm, effects, noise and rounding included.
    Simulate(simulate::Arguments),
    /// What belongs to a measurement before it is made: the empty table.
    Measurement(measurement::Arguments),
    /// Fit the arm to measured poses: a model file, and what the data could tell.
    Identify(identify::Arguments),
    /// What the model of the arm gets wrong, and why: named causes, and a model extended by them.
    Diagnose(diagnose::Arguments),
    /// Which poses to measure, as a program that moves there.
    Plan(Box<plan::Arguments>),
    /// Methods side by side under a paper's protocol.
    Compare(compare::Arguments),
    /// Keep a model accurate as measurements come in.
    Track(track::Arguments),
    /// A surface to a grinding program: RAPID, or NC by the ending of the output (.nc, .mpf).
    Path(path::Arguments),
    /// The cell file that programs ask for, with every tool and frame that they name, to be filled in.
    Cell(cell::Arguments),
    /// Rewrite programs so that the estimated arm follows them.
    Compensate(compensate::Arguments),
    /// How far programs are off under a model; nothing is rewritten.
    Deviation(deviation::Arguments),
    /// Put together what the jobs of a shared run made (--shard), byte for byte as one run writes it.
    Gather(gather::Arguments),
    /// Whether an estimated arm holds a tolerance at poses that it was not fitted to: a page for the file of the cell.
    Accept(accept::Arguments),
    /// The links of an estimated arm in the formats of others: URDF, tables of link parameters, the kinematics of UR drivers.
    Export(export::Arguments),
    /// Show in Rerun what any of the above wrote.
    #[cfg(feature = "visual")]
    View(view::Arguments),
    /// The script with which a shell completes verbs and options: bash, zsh, fish, elvish, powershell.
    Completions(manual::Completions),
    /// The man page; with -o the pages of all verbs.
    Man(manual::Man),
}

/// Runs the command line.
pub(crate) fn run() -> ExitCode {
    let cli = match Cli::try_parse() {
        Ok(cli) => cli,
        Err(error) => {
            // Help and version are no failure.
            let code = if error.use_stderr() { 2 } else { 0 };
            if error.use_stderr() {
                // What was typed stands in it, names of files that a pattern found among them.
                terminal::tell_lines(&error.render().to_string());
            } else {
                let _ = error.print();
            }
            return ExitCode::from(code);
        }
    };
    defect::hush();
    match defect::isolated(|| dispatch(cli.verb)) {
        Ok(Ending::Done) => ExitCode::SUCCESS,
        Ok(Ending::Flagged) => ExitCode::from(1),
        Err(error) => {
            terminal::tell(format!("error: {error:#}"));
            ExitCode::from(2)
        }
    }
}

fn dispatch(verb: Verb) -> anyhow::Result<Ending> {
    match verb {
        Verb::Demo(arguments) => demo::run(&arguments),
        Verb::Robots(arguments) => robots::run(&arguments),
        Verb::Simulate(arguments) => simulate::run(&arguments),
        Verb::Measurement(arguments) => measurement::run(&arguments),
        Verb::Identify(arguments) => identify::run(&arguments),
        Verb::Diagnose(arguments) if fleet::is_asked(&arguments) => fleet::run(&arguments),
        Verb::Diagnose(arguments) => diagnose::run(&arguments),
        Verb::Plan(arguments) => plan::run(&arguments),
        Verb::Compare(arguments) => compare::run(&arguments),
        Verb::Track(arguments) => track::run(&arguments),
        Verb::Path(arguments) => path::run(&arguments),
        Verb::Cell(arguments) => cell::run(&arguments),
        Verb::Compensate(arguments) => compensate::run(&arguments),
        Verb::Deviation(arguments) => deviation::run(&arguments),
        Verb::Gather(arguments) => gather::run(&arguments),
        Verb::Accept(arguments) => accept::run(&arguments),
        Verb::Export(arguments) => export::run(&arguments),
        #[cfg(feature = "visual")]
        Verb::View(arguments) => view::run(&arguments),
        Verb::Completions(arguments) => manual::completions(&arguments, Cli::command()),
        Verb::Man(arguments) => manual::man(&arguments, Cli::command()),
    }
}
