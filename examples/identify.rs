//! Fits an arm to measured poses: `cargo run --example identify`, or with a CSV or XLSX file and a robot of the catalogue
//! `cargo run --example identify -- poses.csv abb-irb-120`.

#![allow(clippy::print_stdout)]

use std::error::Error;

use truegrind::{
    IdentifyOptions, ImportOptions, Tolerance, identify, read_measurements, robots, split, starting_frames,
};

fn main() -> Result<(), Box<dyn Error>> {
    let mut arguments = std::env::args().skip(1);
    let file = arguments.next();
    let robot = robots::load(&arguments.next().unwrap_or_else(|| "abb-irb-120".into()))?;
    let bytes = match &file {
        Some(path) => std::fs::read(path)?,
        None => include_bytes!("../tests/data/irb120-cable.csv").to_vec(),
    };
    let rows =
        read_measurements(file.as_deref().unwrap_or("irb120-cable.csv"), &bytes, &ImportOptions::default())?;

    // First the sensor frame and the measured point, then the arm, judged on held-out rows.
    let options = IdentifyOptions::default();
    let frames = starting_frames(&rows, &robot.model, &Tolerance::default(), options.fuse_readout)?;
    let share = |rows: &truegrind::Dataset| split::random(rows, options.held_out, options.seed);
    let found = identify(&rows, &robot.sheet.name, &robot.model, &frames, &share, &options)?;

    let errors = &found.estimated;
    println!(
        "held-out RMSE, seed {}, {:.0} % of {} rows:",
        options.seed,
        100.0 * options.held_out,
        rows.rows.len()
    );
    println!("  frames registered  {:.3} mm", errors.registered.held_out.rmse);
    println!("  geometry fitted    {:.3} mm", errors.calibrated.held_out.rmse);
    for parameter in found.parameters.iter().take(6) {
        println!(
            "  {:<14} {:>10.5} ± {:.5} {}",
            parameter.name, parameter.value, parameter.sigma, parameter.unit
        );
    }
    println!("verdict: {:?}", errors.verdict.status);
    Ok(())
}
