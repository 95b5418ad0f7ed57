//! Simulated measurements from the shipped recipes, for use without a measurement file.

use crate::experiment::{Experiment, ExperimentError, RECIPES};
use truegrind_arm::model::Model;
use truegrind_calibration::measurement::dataset::Dataset;
use truegrind_calibration::measurement::import;
use truegrind_calibration::measurement::simulation::Simulation;
use truegrind_calibration::measurement::simulation::recipe::Recipe;

/// The recipe of that name.
///
/// # Errors
/// [`ExperimentError::Recipe`].
pub fn recipe(name: &str, experiment: &str) -> Result<Recipe, ExperimentError> {
    let fail = |message: String| ExperimentError::Recipe { experiment: experiment.to_owned(), message };
    let (file, bytes) = RECIPES
        .iter()
        .find(|(known, _)| *known == name)
        .ok_or_else(|| fail(format!("no shipped recipe is named {name}")))?;
    Recipe::parse(&String::from_utf8_lossy(bytes), file).map_err(|e| fail(e.to_string()))
}

/// Simulates the experiment's recipe. `resolve` returns the nominal model of a robot by name.
///
/// # Errors
/// [`ExperimentError::Recipe`], also where the experiment names no recipe.
pub fn measure(
    experiment: &Experiment,
    resolve: impl Fn(&str) -> Result<Model, String>,
) -> Result<(Dataset, Simulation, String), ExperimentError> {
    let fail = |message: String| ExperimentError::Recipe { experiment: experiment.name.clone(), message };
    let name = experiment
        .recipe
        .as_ref()
        .ok_or_else(|| fail("the experiment names no recipe: give a measurement file".to_owned()))?;
    let recipe = recipe(name, &experiment.name)?;
    let simulation = recipe.simulate(resolve).map_err(|e| fail(e.to_string()))?;
    let file = format!("{name} (simulated)");
    let dataset = import::read(&file, simulation.csv.as_bytes(), &import::Options::default())
        .map_err(|e| fail(e.to_string()))?;
    Ok((dataset, simulation, recipe.robot))
}
