//! `truegrind measurement template --robot R`: writes an empty measurement table.

use std::path::PathBuf;

use clap::{Args, Subcommand, ValueEnum};
use truegrind::calibration::measurement::dataset::Sensor;
use truegrind::calibration::measurement::import::template;

use super::exit_status::ExitStatus;
use super::files::{Batch, spare_filled_in};
use super::inputs::{self, UrdfLinks};
use super::output_extension::csv_file;
use super::terminal::print_message;

/// Arguments of `measurement`.
#[derive(Debug, Args)]
pub(super) struct Arguments {
    #[command(subcommand)]
    what: What,
}

#[derive(Debug, Subcommand)]
enum What {
    /// Write an empty table with the columns that a measurement needs.
    Template(Template),
}

#[derive(Debug, Args)]
struct Template {
    /// Robot: a name from `truegrind robots`, or a robot file.
    #[arg(long)]
    robot: String,
    #[command(flatten)]
    links: UrdfLinks,
    /// Quantity that the sensor measures.
    #[arg(long, value_enum, default_value_t = Reads::Position)]
    sensor: Reads,
    /// CSV file to write. Default: stdout.
    #[arg(short, long, value_name = "FILE.csv", default_value = "-", value_parser = csv_file)]
    output: PathBuf,
}

/// What a sensor measures.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
pub(super) enum Reads {
    /// Length of a draw-wire cable.
    Cable,
    /// Position of a reflector or marker. `tracker` and `camera` mean the same.
    #[value(alias = "tracker", alias = "camera")]
    Position,
    /// Position and orientation of a target.
    Pose,
}

impl From<Reads> for Sensor {
    fn from(reads: Reads) -> Self {
        match reads {
            Reads::Cable => Sensor::Cable,
            Reads::Position => Sensor::Position,
            Reads::Pose => Sensor::Pose,
        }
    }
}

pub(super) fn run(arguments: &Arguments) -> anyhow::Result<ExitStatus> {
    let What::Template(template) = &arguments.what;
    empty_table(template)
}

fn empty_table(arguments: &Template) -> anyhow::Result<ExitStatus> {
    let robot = inputs::robot(arguments.links.of(&arguments.robot))?;
    let columns = template::columns(arguments.sensor.into());
    let names: Vec<&str> = columns.iter().map(|column| column.name).collect();
    let mut batch = Batch::default();
    let form = names.join(",") + "\n";
    Batch::check(&[], &[&arguments.output])?;
    spare_filled_in(&arguments.output, &form)?;
    batch.add(&arguments.output, form);
    batch.write()?;
    print_message(format_args!("fill in one row for each pose of {}:", robot.sheet.name));
    for (names, meaning) in template::meanings(&columns) {
        print_message(format_args!("  {names}: {meaning}"));
    }
    let joints = &robot.sheet.joints;
    if let (Some(low), Some(high)) = (joints.min_deg, joints.max_deg) {
        let ranges: Vec<String> =
            (0..6).map(|j| format!("J{} {} to {}°", j + 1, signed(low[j]), signed(high[j]))).collect();
        print_message(format_args!("joint ranges in the data sheet: {}", ranges.join(", ")));
    }
    print_message("columns that may be empty can be deleted");
    print_message("`truegrind plan` chooses the most informative poses");
    Ok(ExitStatus::Done)
}

/// A number with a true minus sign, which cannot be read as a range.
fn signed(value: f64) -> String {
    format!("{value}").replace('-', "−")
}
