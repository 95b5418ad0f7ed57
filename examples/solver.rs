//! A custom solver for a calibration, compared with the built-in one: `cargo run --example solver`.
//!
//! All solvers use the same [`Problem`]: residuals, derivatives, normal equations, priors. This one is gradient descent with Cauchy steps.

#![allow(clippy::print_stdout)]

use std::error::Error;

use truegrind::estimation::least_squares::lm;
use truegrind::{
    CalibrationProblem, ImportOptions, Parameter, Problem, Tolerance, Weight, read_measurements, robots,
    starting_frames,
};

/// Gradient descent with the Cauchy step length gᵀg / gᵀNg, optimal for the linearised problem.
fn descend(problem: &dyn Problem, steps: usize) -> (Vec<f64>, f64) {
    let priors = problem.priors();
    let mut x = vec![0.0; problem.parameters()];
    let cost = |x: &[f64]| {
        let terms = priors.iter().zip(x).map(|(p, x)| ((x - p.mean) / p.sigma).powi(2));
        problem.row_cost(x) + 0.5 * terms.sum::<f64>()
    };
    for _ in 0..steps {
        let mut equations = problem.normal_equations(&x);
        equations.add_priors(priors, &x);
        equations.symmetrize();
        // Columns are scaled by the prior σ, since millimetres and radians have no common unit.
        let scale = nalgebra::DVector::from_iterator(priors.len(), priors.iter().map(|p| p.sigma));
        let gradient = equations.gradient.component_mul(&scale);
        let along = gradient.component_mul(&scale);
        let length = gradient.norm_squared() / (along.transpose() * &equations.matrix * &along)[(0, 0)];
        x.iter_mut().zip(along.iter()).for_each(|(x, g)| *x -= length * g);
    }
    let end = cost(&x);
    (x, end)
}

fn main() -> Result<(), Box<dyn Error>> {
    let robot = robots::load("abb-irb-120")?;
    let csv = include_bytes!("../tests/data/irb120-cable.csv");
    let rows = read_measurements("irb120-cable.csv", csv, &ImportOptions::default())?;
    let frames = starting_frames(&rows, &robot.model, &Tolerance::default(), true)?;
    // Free parameters: link angles and sensor. All rows have weight 1/0.1 mm.
    let free: Vec<Parameter> = truegrind::arm::parameter::arm_parameters(&robot.model)
        .into_iter()
        .chain(truegrind::calibration::identification::fit::frame_parameters(&rows))
        .collect();
    let priors = Tolerance::default().priors(&free, &robot.model);
    let weights = vec![Weight { per_mm: 10.0, per_rad: 1e3 }; rows.rows.len()];
    let problem = CalibrationProblem::new(&rows, &robot.model, &frames, &free, &priors, &weights);

    let rmse_mm = |x: &[f64]| {
        let errors = problem.errors_mm(x);
        (errors.iter().map(|e| e * e).sum::<f64>() / errors.len() as f64).sqrt()
    };
    println!("start                {:.4} mm on the rows of the fit", rmse_mm(&vec![0.0; free.len()]));
    for steps in [10, 100, 1000] {
        let (x, cost) = descend(&problem, steps);
        println!("{steps:>4} steps downhill  {:.4} mm, cost {cost:.1}", rmse_mm(&x));
    }
    let best = lm::solve(&problem, &vec![0.0; free.len()], &lm::Options::default());
    println!(
        "Levenberg–Marquardt  {:.4} mm, cost {:.1}, {} iterations",
        rmse_mm(&best.x),
        best.cost,
        best.trace.len() - 1
    );
    Ok(())
}
