//! Options that describe the cell a program runs in, shared by `compensate`, `deviation` and `view`.

use std::ops::RangeInclusive;
use std::path::PathBuf;

use anyhow::{anyhow, bail};
use clap::Args;
use truegrind::arm::condition::Condition;
use truegrind::arm::estimated::Estimated;
use truegrind::arm::model::Model;
use truegrind::compensation::cell::{Cell, Used};
use truegrind::compensation::condition::other_load::is_other_load;
use truegrind::compensation::condition::overload::{overload, rated_payload_kg, stated_overload};
use truegrind::compensation::condition::warmth::growth_per_k;
use truegrind::compensation::frames::surface_frames::surface_frame_contradictions;
use truegrind::compensation::frames::taught::contradictions;
use truegrind::programs::motion::Listing;
use truegrind::programs::motion::load::Loads;
use truegrind::programs::reading::Program;
use truegrind::surfaces::SurfaceFile;

use super::files;
use super::terminal::print_message;

/// Payloads above this are typing errors (kg).
const MAX_PAYLOAD_KG: f64 = 3000.0;

/// Temperatures of an arm; others are typing errors (°C).
const TEMPERATURES_C: RangeInclusive<f64> = -40.0..=120.0;

/// Cell, surface, payload and temperature.
#[derive(Debug, Clone, Args)]
pub(super) struct CellArguments {
    /// Cell file: origins of tools and work objects, measured or taught with their teaching points.
    #[arg(long, value_name = "CELL.toml")]
    pub(super) cell: Option<PathBuf>,
    /// The ground surface; deviations are then also stated along its normal.
    #[arg(long, value_name = "SURFACE.toml")]
    pub(super) surface: Option<PathBuf>,
    /// Mass at the flange while the program runs (kg). Overrides the tool and load data of a RAPID program; NC programs
    /// have none.
    #[arg(long, value_name = "KG", allow_negative_numbers = true)]
    pub(super) payload: Option<f64>,
    /// Centre of mass of the payload in the flange frame (mm).
    #[arg(long, value_name = "X,Y,Z", requires = "payload", allow_hyphen_values = true)]
    pub(super) payload_centre: Option<String>,
    /// Temperature of the arm while the program runs (°C), if the model says how its links grow per kelvin. Default: that of
    /// the measurement.
    #[arg(long, value_name = "C", allow_negative_numbers = true)]
    pub(super) temperature: Option<f64>,
}

impl CellArguments {
    /// The loads that the program declares; `None` if `--payload` overrides them.
    pub(super) fn loads(&self, program: &Program<'_>) -> Option<Loads> {
        self.payload.is_none().then(|| program.loads())
    }

    /// Cell, surface and condition; the condition starts from that of the model.
    pub(super) fn read(
        &self,
        model: Option<&Estimated>,
    ) -> anyhow::Result<(Cell, Option<SurfaceFile>, Condition)> {
        if let Some(kg) = self.payload
            && !(0.0..=MAX_PAYLOAD_KG).contains(&kg)
        {
            bail!("--payload {kg}: expected a mass in kg, from 0 to {MAX_PAYLOAD_KG}");
        }
        self.refuse_other_load(model)?;
        self.note_overload(model);
        let cell = self.read_cell()?;
        let surface = self.surface.as_deref().map(super::path::surface).transpose()?;
        let cell = match &surface {
            Some(surface) => cell.with_surface(surface)?,
            None => cell,
        };
        let mut condition = model.map(|m| m.condition).unwrap_or_default();
        condition.payload_kg = self.payload.or(condition.payload_kg);
        self.refuse_temperature(model)?;
        condition.temperature_c = self.temperature.or(condition.temperature_c);
        if let Some(text) = &self.payload_centre {
            condition.payload_centre_mm = super::stated_frames::triple("--payload-centre", text)?;
        }
        Ok((cell, surface, condition))
    }

    /// Refuses a temperature that no arm has, or that the model cannot follow.
    fn refuse_temperature(&self, model: Option<&Estimated>) -> anyhow::Result<()> {
        let Some(celsius) = self.temperature else { return Ok(()) };
        if !TEMPERATURES_C.contains(&celsius) {
            bail!(
                "--temperature {celsius}: expected the temperature of the arm in °C, from {} to {}",
                TEMPERATURES_C.start(),
                TEMPERATURES_C.end()
            );
        }
        if model.is_some_and(|model| growth_per_k(model).is_none()) {
            bail!(
                "--temperature {celsius}: the model does not say how the arm grows per kelvin: measure it cold and warm, with its temperature in the \
                 column `temperature`, or omit --temperature"
            );
        }
        Ok(())
    }

    /// Refuses a payload that the model cannot follow.
    fn refuse_other_load(&self, model: Option<&Estimated>) -> anyhow::Result<()> {
        let (Some(kg), Some(model)) = (self.payload, model) else { return Ok(()) };
        if !is_other_load(kg, model) {
            return Ok(());
        }
        let measured_kg = model.condition.payload_kg.unwrap_or(0.0);
        bail!(
            "--payload {kg}: the masses of {} are not known, so its deflection was identified for the load of the measurement ({measured_kg} kg) and \
             follows no other: measure with {kg} kg on the flange, or omit --payload and accept the error from the different load",
            model.robot
        )
    }

    /// Notes a payload above the rated one of the catalogue: perhaps it is in another unit.
    fn note_overload(&self, model: Option<&Estimated>) {
        let Some(robot) = model.map(|arm| arm.robot.as_str()) else { return };
        if let (Some(kg), Some(rated)) = (self.payload, rated_payload_kg(robot))
            && kg > rated
        {
            print_message(format_args!("note: --payload {kg}: {}", overload(kg, robot, rated)));
        }
    }

    /// Notes the loads of a program that are above the rated payload.
    pub(super) fn note_stated_overload(&self, program: &Program<'_>, robot: &str) {
        let loads = self.loads(program);
        let stated = loads.and_then(|loads| stated_overload(program.listing(), &loads, robot));
        if let Some(stated) = stated {
            print_message(format_args!("note: {}", stated.note));
        }
    }

    fn read_cell(&self) -> anyhow::Result<Cell> {
        let Some(path) = &self.cell else { return Ok(Cell::default()) };
        let cell = Cell::from_toml(&files::read_text(path)?).map_err(|e| {
            anyhow!(
                "{}: {}; a cell file lists [[tool]] and [[wobj]]",
                path.display(),
                e.to_string().trim_end()
            )
        })?;
        if let [first, rest @ ..] = cell.open.as_slice() {
            let more = match rest.len() {
                0 => String::new(),
                1 => "; 1 more entry is open".to_owned(),
                more => format!("; {more} more entries are open"),
            };
            bail!("{}: not filled in yet: {first}{more}", path.display());
        }
        Ok(cell)
    }
}

/// Notes entries of the cell file that no program uses; silent if any program could not be examined.
pub(super) fn note_unused_entries<'u>(
    used: impl IntoIterator<Item = &'u Option<Used>>,
    cell: &Cell,
    surface: Option<&SurfaceFile>,
) {
    let mut all = Used::default();
    for used in used {
        let Some(used) = used else { return };
        all.join(used);
    }
    for note in all.notes(cell, surface) {
        print_message(format_args!("note: {note}"));
    }
}

/// Refuses a program that contradicts the cell file or the surface file.
pub(super) fn refuse_contradictions(
    listing: &Listing,
    cell: &Cell,
    surface: Option<&SurfaceFile>,
    nominal: &Model,
) -> anyhow::Result<()> {
    let mut found = contradictions(listing, cell, nominal);
    found.extend(surface.iter().flat_map(|surface| surface_frame_contradictions(listing, surface)));
    if found.is_empty() { Ok(()) } else { bail!("{}", found.join("; ")) }
}
