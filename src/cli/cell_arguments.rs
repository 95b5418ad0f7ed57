//! Options that describe the cell a program runs in, shared by `compensate`, `deviation` and `view`.

use std::path::PathBuf;

use anyhow::{anyhow, bail};
use clap::Args;
use truegrind::arm::condition::Condition;
use truegrind::arm::estimated::Estimated;
use truegrind::arm::model::Model;
use truegrind::compensation::cell::{Cell, Used};
use truegrind::compensation::condition::overload::stated_overload;
use truegrind::compensation::condition::stated::StatedCondition;
use truegrind::compensation::frames::surface_frames::surface_frame_contradictions;
use truegrind::compensation::frames::taught::contradictions;
use truegrind::file_kind::FileKind;
use truegrind::programs::motion::Listing;
use truegrind::programs::motion::load::Loads;
use truegrind::programs::reading::Program;
use truegrind::surfaces::SurfaceFile;

use super::files;
use super::inputs;
use super::terminal::print_message;

/// What `--cell` reads.
const CELL_FILE: &str = "a cell file, as `truegrind cell PROGRAM… -o CELL.toml` writes it";

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
        let payload_centre_mm = self.payload_centre.as_deref();
        let payload_centre_mm = payload_centre_mm
            .map(|text| super::stated_frames::triple("--payload-centre", text))
            .transpose()?;
        let stated =
            StatedCondition { payload_kg: self.payload, payload_centre_mm, temperature_c: self.temperature };
        let condition = stated.on(model)?;
        if let Some(note) = stated.overload_note(model) {
            print_message(format_args!("note: {note}"));
        }
        let cell = self.read_cell()?;
        let surface = self.surface.as_deref().map(super::path::surface).transpose()?;
        let cell = match &surface {
            Some(surface) => cell.with_surface(surface)?,
            None => cell,
        };
        Ok((cell, surface, condition))
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
        let text = files::read_text(path)?;
        if text.trim().is_empty() {
            bail!("{}: this file is empty; expected {CELL_FILE}", path.display());
        }
        let cell = Cell::from_toml(&text).map_err(|e| {
            let told = anyhow!(
                "{}: {}; a cell file lists [[tool]] and [[wobj]]",
                path.display(),
                e.to_string().trim_end()
            );
            inputs::other_kind_or(path, &[FileKind::Cell], CELL_FILE, told)
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

/// Refuses a length that cannot be meant in millimetres.
pub(super) fn check_length(option: &str, mm: f64, most_mm: f64) -> anyhow::Result<()> {
    if mm > 0.0 && mm <= most_mm {
        return Ok(());
    }
    bail!("{option} {mm}: expected a length above 0 in mm, up to {most_mm} (50 µm are 0.05)")
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
