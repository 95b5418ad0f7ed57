//! Imported rows as the measurements of a robot: what its arm alone checks ([`prepare_rows`]), and what its data sheet adds.

use super::convention::AngleConvention;
use super::dataset::Dataset;
use super::matching::{Mismatch, prepare_rows};
use super::plausibility::implausible_payload;
use truegrind_arm::robots::Robot;

/// The rows with the controller's angles, ready for a fit, with notes on loads and on the base. `convention`: by default that of the robot
/// file. `allow_odd_units` skips the check of units.
///
/// # Errors
/// [`Mismatch`].
pub fn rows_of_robot(
    dataset: Dataset,
    robot: &Robot,
    convention: Option<AngleConvention>,
    allow_odd_units: bool,
) -> Result<Dataset, Mismatch> {
    let rated = robot.sheet.payload_kg.filter(|_| !allow_odd_units);
    if let Some(suspicion) = rated.and_then(|rated| implausible_payload(&dataset, rated)) {
        return Err(Mismatch::Payload(suspicion));
    }
    let convention = convention.unwrap_or_else(|| robot.sheet.joints.angles.into());
    let mut dataset = prepare_rows(dataset, &robot.sheet.name, &robot.model, convention, allow_odd_units)?;
    note_payloads(&mut dataset, robot);
    note_base(&mut dataset, robot);
    Ok(dataset)
}

/// Payload over the rated one that is noted.
const OVERLOAD: f64 = 1.2;

/// Notes payloads that are not used, and those above the rated one: perhaps they are in pounds or newtons.
fn note_payloads(dataset: &mut Dataset, robot: &Robot) {
    let loads_kg = || dataset.rows.iter().filter_map(|row| row.condition.payload_kg);
    let most_kg = loads_kg().reduce(f64::max);
    if robot.model.bodies.is_none() && most_kg != loads_kg().reduce(f64::min) {
        dataset.notes.push(format!(
            "column payload: no masses are known for {}, and without them a deflection cannot follow the load, so the loads are not used; measure \
             each load in a file of its own, or state the masses in a robot file",
            robot.sheet.name
        ));
    }
    let is_at_flange = dataset.rows.iter().all(|row| row.condition.payload_centre_mm == [0.0; 3]);
    if robot.model.bodies.is_some() && is_at_flange && most_kg.is_some_and(|kg| kg > 0.0) {
        dataset.notes.push(
            "column payload: its centre of mass is taken to be at the flange; where it is not, state it in the columns payload_x, payload_y and \
             payload_z (mm, in the flange frame), or the compliance of the wrist is found too large"
                .to_owned(),
        );
    }
    if let (Some(kg), Some(rated)) = (most_kg, robot.sheet.payload_kg)
        && kg > OVERLOAD * rated
    {
        dataset.notes.push(format!(
            "column payload: up to {kg} kg, and {} is rated for {rated} kg; check that it is in kg",
            robot.sheet.name
        ));
    }
}

/// Notes the base that frames and programs are read in, where it is not that of the robot file.
fn note_base(dataset: &mut Dataset, robot: &Robot) {
    dataset.notes.extend(robot.base_note.iter().map(|note| {
        format!(
            "{note}. Sensor frames and the positions of programs count from that base, where controllers have it: compare a position that the \
             controller shows with `truegrind robots --check`"
        )
    }));
}
