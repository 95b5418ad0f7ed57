//! `truegrind simulate RECIPE.toml -o DATA.csv`.

use std::path::{Path, PathBuf};

use clap::Args;
use truegrind::arm::arm_file::ArmFile;
use truegrind::arm::model::Model;
use truegrind::calibration::measurement::simulation::Simulation;
use truegrind::calibration::measurement::simulation::recipe::{Approach, Recipe};
use truegrind::file_kind::FileKind;
use truegrind::robots::foreign::Kind;

use super::exit_status::ExitStatus;
use super::files::{self, Batch};
use super::inputs;
use super::output_extension::csv_file;
use super::terminal::print_message;

/// Arguments of `simulate`.
#[derive(Debug, Args)]
pub(super) struct Arguments {
    /// Recipe: the actual arm, the measured poses and the sensor.
    recipe: PathBuf,
    /// Measurements to write; `-` prints them.
    #[arg(short, long, value_name = "DATA.csv", value_parser = csv_file)]
    output: PathBuf,
    /// Also write the simulated actual arm, for `deviation --actual`.
    #[arg(long, value_name = "ARM.toml")]
    arm: Option<PathBuf>,
    /// Seed of poses and noise, instead of that of the recipe; the arm stays the same.
    #[arg(long, allow_negative_numbers = true)]
    seed: Option<u64>,
}

pub(super) fn run(arguments: &Arguments) -> anyhow::Result<ExitStatus> {
    let mut targets = vec![arguments.output.as_path()];
    targets.extend(arguments.arm.as_deref());
    Batch::check(&[&arguments.recipe], &targets)?;
    let text = files::read_text(&arguments.recipe)?;
    let name = arguments.recipe.display().to_string();
    let Recipe { about, conditions, .. } = Recipe::parse(&text, &name).map_err(|e| {
        inputs::other_kind_or(
            &arguments.recipe,
            &[FileKind::Recipe],
            "a recipe (.toml), as in docs/simulate.md",
            e,
        )
    })?;
    let simulation = simulation(&text, &name, arguments.seed)?;
    let mut batch = Batch::sparing([&arguments.recipe]);
    let (rows, sensor) = (simulation.rows.len(), simulation.sensor());
    batch.add(&arguments.output, simulation.csv);
    if let Some(path) = &arguments.arm {
        batch.add(path, arm_text(&simulation.actual)?);
    }
    batch.write()?;
    print_message(format_args!(
        "{rows} rows, sensor {}, written to {}",
        sensor.name(),
        arguments.output.display()
    ));
    let has_play = simulation.actual.effects.iter().any(|effect| effect.play_rad().is_some());
    if has_play && conditions.approach == Approach::Unknown {
        print_message(
            "note: the arm has backlash, but circumstances.approach is not stated: every reading is taken in the middle of the play",
        );
    }
    if !about.is_empty() {
        print_message(format_args!("{about}"));
    }
    Ok(ExitStatus::Done)
}

/// Runs a recipe. A robot file that it names is looked up beside it first, then in the working directory.
pub(super) fn simulation(text: &str, name: &str, seed: Option<u64>) -> anyhow::Result<Simulation> {
    let mut recipe = Recipe::parse(text, name)?;
    if let Some(seed) = seed {
        recipe.seed = seed;
    }
    let of_file = |robot: &str| {
        let beside = inputs::beside(Path::new(name), robot);
        if Kind::of(robot).is_some() && beside.is_file() {
            beside.to_string_lossy().into_owned()
        } else {
            robot.to_owned()
        }
    };
    Ok(recipe.simulate(|robot| {
        inputs::robot(of_file(robot).as_str()).map(|r| r.model).map_err(|e| format!("{e:#}"))
    })?)
}

/// The file of a simulated actual arm.
pub(super) fn arm_text(model: &Model) -> anyhow::Result<String> {
    Ok(format!("# A simulated actual arm.\n{}", toml::to_string(&ArmFile::from(model))?))
}
