//! Corrects a RAPID program for an estimated arm: `cargo run --example compensate`.

#![allow(clippy::print_stdout)]

use std::error::Error;

use truegrind::{
    Cell, CompensateOptions, Effect, Harmonic, IdentifyOptions, ImportOptions, Mark, MotionStatus, NcSetup,
    Program, Tolerance, compensate, identify, read_measurements, robots, split, starting_frames,
};

const MODULE: &str = "\
MODULE Grind
  PERS tooldata tDisc := [TRUE,[[0,0,85],[1,0,0,0]],[0.8,[0,0,40],[1,0,0,0],0,0,0]];
  CONST robtarget p10 := [[380,-60,250],[0,0,1,0],[-1,-1,-1,0],[9E9,9E9,9E9,9E9,9E9,9E9]];
  CONST robtarget p20 := [[380,60,250],[0,0,1,0],[0,0,0,0],[9E9,9E9,9E9,9E9,9E9,9E9]];
  PROC main()
    MoveL p10,v50,fine,tDisc;
    MoveL p20,v50,fine,tDisc;
  ENDPROC
ENDMODULE
";

fn main() -> Result<(), Box<dyn Error>> {
    // The arm, here fitted to included measurements; `Estimated::parse` reads one from a file.
    let robot = robots::load("abb-irb-120")?;
    let csv = include_bytes!("../tests/data/irb120-tracker.csv");
    let rows = read_measurements("irb120-tracker.csv", csv, &ImportOptions::default())?;
    let options = IdentifyOptions::default();
    let frames = starting_frames(&rows, &robot.model, &Tolerance::default(), true)?;
    let share = |rows: &truegrind::Dataset| split::random(rows, options.held_out, options.seed);
    let mut arm = identify(&rows, "abb-irb-120", &robot.model, &frames, &share, &options)?.estimated;
    // A cause known from other sources can be added manually.
    arm.model.effects.push(Effect::GearEccentricity(Harmonic {
        joint: 0,
        order: 1.0,
        sine_rad: 2e-4,
        cosine_rad: 0.0,
    }));

    let program = Program::read(&[("grind.mod", MODULE.as_bytes())], &NcSetup::default());
    let mark = Mark { version: env!("CARGO_PKG_VERSION").into(), model: "0123abcd".into(), partial: false };
    let done = compensate(&program, &arm, &Cell::default(), &CompensateOptions::default(), Some(mark))?;
    for (motion, outcome) in program.listing().motions.iter().zip(&done.plan.outcomes) {
        print!("line {}: {:?}", motion.place.line, outcome.status);
        match (&outcome.reason(), outcome.before_mm.get()) {
            (Some(why), _) => println!(", {why}"),
            (None, Some(before)) => println!(", {before:.3} mm before"),
            (None, None) => println!(),
        }
    }
    if done.plan.outcomes.iter().any(|outcome| outcome.status == MotionStatus::Changed) {
        let corrected = done.rewritten.files[0].edits.apply(MODULE.as_bytes())?;
        println!("{}", String::from_utf8_lossy(&corrected));
    }
    Ok(())
}
