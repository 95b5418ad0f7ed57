//! Masses above the rated payload of the arm: perhaps they are in another unit, or of another robot.

use super::payload::payload_at;
use crate::line_list::lines_of;
use truegrind_arm::gravity::STANDARD_GRAVITY;
use truegrind_arm::robots;
use truegrind_programs::motion::Listing;
use truegrind_programs::motion::load::Loads;

const KG_PER_POUND: f64 = 0.453_592_37;
const KG_PER_NEWTON: f64 = 1.0 / STANDARD_GRAVITY;

/// The rated payload of an arm of the catalogue (kg), where its data sheet states it.
pub fn rated_payload_kg(robot: &str) -> Option<f64> {
    robots::load(robot).ok()?.sheet.payload_kg
}

/// What is said of a mass above the rated payload: the robot, and the unit in which the robot would carry it.
pub fn overload(kg: f64, robot: &str, rated_kg: f64) -> String {
    let units = [("pounds", KG_PER_POUND), ("newtons", KG_PER_NEWTON), ("grams", 1e-3)];
    let likely = units.iter().find(|(_, kg_per_unit)| kg * kg_per_unit <= rated_kg);
    let likely = likely.map_or_else(String::new, |(unit, kg_per_unit)| {
        format!(" (in {unit} it would be {:.3} kg)", kg * kg_per_unit)
    });
    format!("{robot} is rated for {rated_kg} kg; check that the mass is right and in kg{likely}")
}

/// Masses beyond this share of the rated payload are hardly those of the program and the robot at hand.
const FAR_ABOVE: f64 = 1.5;

/// Whether a mass is far above the rated payload of a robot.
pub fn is_far_above_rating(kg: f64, robot: &str) -> bool {
    rated_payload_kg(robot).is_some_and(|rated_kg| kg > FAR_ABOVE * rated_kg)
}

/// The largest mass that a program states, tools included, where it is above the rated payload.
#[derive(Debug, Clone, PartialEq)]
pub struct StatedOverload {
    /// That mass.
    pub most_kg: f64,
    /// It in words, with its lines.
    pub note: String,
}

/// See [`StatedOverload`].
pub fn stated_overload(listing: &Listing, loads: &Loads, robot: &str) -> Option<StatedOverload> {
    let rated_kg = rated_payload_kg(robot)?;
    let mass_kg = |index: usize| {
        Some(payload_at(loads, index, &listing.motions[index], listing)?.mass_kg).filter(|kg| *kg > rated_kg)
    };
    let masses: Vec<(u32, f64)> =
        (0..listing.motions.len()).filter_map(|index| Some((index as u32, mass_kg(index)?))).collect();
    let most_kg = masses.iter().map(|(_, kg)| *kg).reduce(f64::max)?;
    let motions: Vec<u32> = masses.into_iter().map(|(motion, _)| motion).collect();
    let lines = lines_of(listing, &motions)?;
    let overload = overload(most_kg, robot, rated_kg);
    let note = format!(
        "payload: up to {most_kg} kg, as stated by the program's tools and loads ({lines}), and {overload}"
    );
    Some(StatedOverload { most_kg, note })
}
