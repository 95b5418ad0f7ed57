//! Defines a robot from its data sheet: `cargo run --example robot`, or with your own file `cargo run --example robot -- arm.toml`.
//!
//! For keys and units see the catalogue in `crates/arm/src/robots/`. Omit numbers that the maker does not publish; do not guess them.

#![allow(clippy::print_stdout)]

use std::error::Error;

use truegrind::{Condition, Inverse, Joints, robots};

const ARM: &str = r#"
[[robot]]
name = "workshop-6"
maker = "ours"
model = "Workshop 6"
dialect = "rapid"
convention = "standard-dh"
link = [
    { model = "dh", a_mm = 0.0, d_mm = 400.0, alpha_deg = -90.0, theta_deg = 0.0 },
    { model = "hayati", a_mm = 500.0, d_mm = 0.0, alpha_deg = 0.0, theta_deg = -90.0, beta_deg = 0.0 },
    { model = "dh", a_mm = 60.0, d_mm = 0.0, alpha_deg = -90.0, theta_deg = 0.0 },
    { model = "dh", a_mm = 0.0, d_mm = 480.0, alpha_deg = 90.0, theta_deg = 0.0 },
    { model = "dh", a_mm = 0.0, d_mm = 0.0, alpha_deg = -90.0, theta_deg = 0.0 },
    { model = "dh", a_mm = 0.0, d_mm = 90.0, alpha_deg = 0.0, theta_deg = 180.0 },
]
[robot.joints]
min_deg = [-170.0, -100.0, -120.0, -180.0, -120.0, -360.0]
max_deg = [170.0, 120.0, 70.0, 180.0, 120.0, 360.0]
[robot.sources]
links = "drawing 4711, sheet 2"
"#;

fn main() -> Result<(), Box<dyn Error>> {
    let (name, text) = match std::env::args().nth(1) {
        Some(path) => (path.clone(), std::fs::read_to_string(path)?),
        None => ("workshop.toml".to_owned(), ARM.to_owned()),
    };
    let robot = robots::parse(&text, &name)?;
    let arm = &robot.model;
    let still = Condition::default();
    println!("{} of {}", robot.sheet.model, robot.sheet.maker);

    // Wrong zeros are the most common mistake: check poses that are shown in the manual.
    for degrees in [[0.0; 6], [0.0, 0.0, 0.0, 0.0, 30.0, 0.0], [90.0, 0.0, 0.0, 0.0, 30.0, 0.0]] {
        let joints = Joints::from(degrees.map(f64::to_radians));
        let flange = arm.forward(&joints, &still);
        println!("joints {degrees:?}°: flange at {:.3} mm", flange.translation.vector.transpose());
    }
    // Inverse kinematics.
    let joints = Joints::from([20.0, 10.0, -15.0, 30.0, 40.0, -60.0].map(f64::to_radians));
    let flange = arm.forward(&joints, &still);
    let found = Inverse::new(arm, &still, arm).solve_near(&flange, &Joints::zeros())?;
    println!(
        "inverse and forward: {:.1e} mm apart",
        (arm.forward(&found.joints, &still).translation.vector - flange.translation.vector).norm()
    );
    Ok(())
}
