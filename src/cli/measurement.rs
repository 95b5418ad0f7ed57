//! `truegrind measurement template --robot R`: the empty table of a measurement.

use std::path::PathBuf;

use clap::{Args, Subcommand, ValueEnum};
use truegrind::calibration::measurement::dataset::Sensor;
use truegrind::calibration::measurement::import::template;

use super::exit_status::ExitStatus;
use super::files::Batch;
use super::inputs;
use super::terminal::print_message;

/// Arguments of `measurement`.
#[derive(Debug, Args)]
pub(super) struct Arguments {
    #[command(subcommand)]
    what: What,
}

#[derive(Debug, Subcommand)]
enum What {
    /// An empty table with the columns that a measurement of a robot needs, to be filled in.
    Template(Template),
}

#[derive(Debug, Args)]
struct Template {
    /// Robot: a name of `truegrind robots`, or a file of one's own.
    #[arg(long)]
    robot: String,
    /// What the sensor reads.
    #[arg(long, value_enum, default_value_t = Reads::Position)]
    sensor: Reads,
    /// The CSV file to write; stdout otherwise.
    #[arg(short, long, value_name = "FILE.csv", default_value = "-")]
    output: PathBuf,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
enum Reads {
    /// The length of a cable.
    Cable,
    /// The position of a reflector or marker.
    Position,
    /// Position and orientation of a target.
    Pose,
}

pub(super) fn run(arguments: &Arguments) -> anyhow::Result<ExitStatus> {
    let What::Template(template) = &arguments.what;
    empty_table(template)
}

fn empty_table(arguments: &Template) -> anyhow::Result<ExitStatus> {
    let robot = inputs::robot(&arguments.robot)?;
    let sensor = match arguments.sensor {
        Reads::Cable => Sensor::Cable,
        Reads::Position => Sensor::Position,
        Reads::Pose => Sensor::Pose,
    };
    let columns = template::columns(sensor);
    let names: Vec<&str> = columns.iter().map(|column| column.name).collect();
    let mut batch = Batch::default();
    batch.add(&arguments.output, names.join(",") + "\n");
    batch.write()?;
    print_message(format_args!("one row for each pose of {}:", robot.sheet.name));
    for (names, meaning) in template::meanings(&columns) {
        print_message(format_args!("  {names}: {meaning}"));
    }
    let joints = &robot.sheet.joints;
    if let (Some(low), Some(high)) = (joints.min_deg, joints.max_deg) {
        let ranges: Vec<String> =
            (0..6).map(|j| format!("J{} {} to {}°", j + 1, signed(low[j]), signed(high[j]))).collect();
        print_message(format_args!("ranges of the data sheet: {}", ranges.join(", ")));
    }
    print_message("which poses tell most: `truegrind plan`");
    Ok(ExitStatus::Done)
}

/// A number with a minus sign that no one takes for a range.
fn signed(value: f64) -> String {
    format!("{value}").replace('-', "−")
}
