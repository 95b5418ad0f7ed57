//! Finds the causes of errors beyond geometry and writes the extended model: `cargo run --example diagnose`.

#![allow(clippy::print_stdout)]

use std::error::Error;

use truegrind::{
    DiagnoseOptions, ImportOptions, Tolerance, diagnose, read_measurements, robots, starting_frames,
};

fn main() -> Result<(), Box<dyn Error>> {
    // A simulated arm with compliance in joints 2 and 3 and an eccentric first gear.
    let csv = include_bytes!("../tests/data/irb120-cable.csv");
    let robot = robots::load("abb-irb-120")?;
    let rows = read_measurements("irb120-cable.csv", csv, &ImportOptions::default())?;
    let frames = starting_frames(&rows, &robot.model, &Tolerance::default(), true)?;
    let options = DiagnoseOptions::default();
    let found =
        diagnose(&rows, "abb-irb-120", &robot.model, &frames, &options, &|step| println!("… {step}"))?;

    let fits = &found.diagnosis.fits;
    println!(
        "held-out RMSE: geometry {:.3} mm, with causes {:.3} mm",
        fits.geometric.cv_rmse_mm, fits.extended.cv_rmse_mm
    );
    for finding in &found.diagnosis.findings {
        println!("{:?}: {}", finding.confidence, finding.cause);
    }
    // The model as text; its verdict states whether it may be used.
    let model = found.estimated.to_toml()?;
    println!("{} lines of model, verdict {:?}", model.lines().count(), found.estimated.verdict.status);
    Ok(())
}
