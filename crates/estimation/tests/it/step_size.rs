//! Gauss–Newton and the two methods that vary the step size.

use truegrind_estimation::estimate::{Estimate, Termination};
use truegrind_estimation::examples::Line;
use truegrind_estimation::least_squares::{gauss_newton, lm, sslm, vslm};
use truegrind_estimation::objective::Objective;
use truegrind_estimation::problem::{Prior, Problem};

use super::levenberg_marquardt::wide;
use super::published;
use super::residuals::{Dual, Rows, rows};

fn reaches(cost: f64, minima: &[f64]) -> bool {
    minima.iter().any(|m| (2.0 * cost - m).abs() <= 1e-4 * m + 1e-12)
}

#[test]
fn one_printed_step_solves_a_linear_problem() {
    let line = rows(2, 10, |x: &[Dual], i| x[0] + x[1] * i as f64 - (3.0 - 0.5 * i as f64));
    let estimate = gauss_newton::solve(&line, &[100.0, -100.0], &gauss_newton::Options::as_printed());
    assert_eq!(estimate.termination, Termination::DataProcessed);
    assert!((estimate.x[0] - 3.0).abs() < 1e-9 && (estimate.x[1] + 0.5).abs() < 1e-9);
    let blind = rows(2, 10, |x: &[Dual], i| x[0] * i as f64 - 1.0 + 0.0 * x[1]);
    let estimate = gauss_newton::solve(&blind, &[0.0, 0.0], &gauss_newton::Options::as_printed());
    assert_eq!(estimate.termination, Termination::Singular);
}

#[test]
fn the_sound_forms_find_published_minima() {
    // Problems that a damped Gauss–Newton direction can follow all the way.
    let names = [
        "Rosenbrock",
        "Beale",
        "Helical valley",
        "Bard",
        "Gaussian",
        "Kowalik and Osborne",
        "Box three-dimensional",
        "Osborne 1",
        "Watson 6",
        "linear, full rank",
        "linear, rank 1",
    ];
    for case in published::all().iter().filter(|case| names.contains(&case.name)) {
        let (problem, start) = (&*case.problem, &case.start[..]);
        let options = vslm::Options { max_iterations: 500, ..Default::default() };
        let variable = vslm::solve(problem, start, &options);
        assert!(reaches(variable.cost, &case.minima), "vslm {}: {:e}", case.name, 2.0 * variable.cost);
        assert!(variable.termination.is_converged(), "vslm {}: {}", case.name, variable.termination);
        let searched = sslm::solve(problem, start, &sslm::Options::default());
        assert!(reaches(searched.cost, &case.minima), "sslm {}: {:e}", case.name, 2.0 * searched.cost);
        if !["Beale", "Kowalik and Osborne", "Osborne 1"].contains(&case.name) {
            let newton = gauss_newton::solve(problem, start, &Default::default());
            assert!(reaches(newton.cost, &case.minima), "gn {}: {:e}", case.name, 2.0 * newton.cost);
        }
    }
}

#[test]
fn all_agree_with_levenberg_marquardt_on_a_calibration_sized_problem() {
    let (problem, _) = wide(200);
    let start = [0.0; 28];
    let best = lm::solve(&problem, &start, &lm::Options::default());
    let others = [
        gauss_newton::solve(&problem, &start, &Default::default()),
        sslm::solve(&problem, &start, &Default::default()),
        vslm::solve(&problem, &start, &Default::default()),
    ];
    for other in others {
        assert!(other.termination.is_converged());
        assert!((other.cost / best.cost - 1.0).abs() < 1e-8);
        let (a, b) = (other.covariance.unwrap(), best.covariance.as_ref().unwrap());
        assert!((a - b).norm() < 1e-4 * b.norm());
    }
}

/// Priors included, in the same bits, whether one chunk of rows or several.
#[test]
fn cost_and_gradient_alone_are_those_of_the_normal_equations() {
    let (problem, _) = wide(2000);
    for (problem, x) in [(&problem as &dyn Problem, vec![1e-3; 28]), (&Line, vec![1.3, 0.4])] {
        let mut objective = Objective::new(problem, &x, true);
        let whole = objective.normal_equations(&x);
        assert!(whole.gradient.norm() > 0.0);
        assert_eq!(objective.gradient(&x), (whole.cost, whole.gradient));
    }
    assert!(!Line.priors().is_empty());
}

#[test]
fn the_printed_recurrence_by_hand() {
    // r = x − 1, J = 1, λ = 1: each step covers δ/2 of the way; δ = 0.8, 0.4 (factor ½).
    let problem = rows(1, 1, |x: &[Dual], _| x[0] - 1.0);
    let printed = vslm::Options {
        decay: vslm::Decay::PerIteration,
        lambda: 1.0,
        decay_factor: 0.5,
        max_iterations: 2,
        ..vslm::Options::as_printed()
    };
    let estimate = vslm::solve(&problem, &[0.0], &printed);
    assert!((1.0 - estimate.x[0] - 0.6 * 0.8).abs() < 1e-15);
    // One row in each observation: per sample is the same recurrence, one row at a time.
    let estimate = vslm::solve(&problem, &[0.0], &vslm::Options { decay: vslm::Decay::PerSample, ..printed });
    assert!((1.0 - estimate.x[0] - 0.6 * 0.8).abs() < 1e-15);
    // Beginning at the start again undoes what the first iteration did: only the decayed second step remains.
    let again = vslm::Options { decay: vslm::Decay::PerSample, restart: true, ..printed };
    let estimate = vslm::solve(&problem, &[0.0], &again);
    assert!((estimate.x[0] - 0.2).abs() < 1e-15);
}

#[test]
fn decay_per_sample_freezes_after_one_pass() {
    let (problem, _) = wide(200);
    let start = [0.0; 28];
    let frozen = vslm::solve(&problem, &start, &vslm::Options::as_printed());
    let best = lm::solve(&problem, &start, &lm::Options { priors: false, ..Default::default() });
    // 0.8 · 0.95²⁰⁰ = 3e-5 is left of the step size: the second pass no longer moves, far from the minimum.
    let (first, last) = (frozen.trace[1].cost, frozen.cost);
    assert!((last / first - 1.0).abs() < 1e-2, "{first} {last}");
    assert!(last > 2.0 * best.cost, "{last} {}", best.cost);
    let steady = vslm::Options { decay: vslm::Decay::PerIteration, ..vslm::Options::as_printed() };
    let steady = vslm::solve(&problem, &start, &vslm::Options { max_iterations: 60, ..steady });
    assert!(steady.cost < 1.01 * best.cost, "{} {}", steady.cost, best.cost);
}

#[test]
fn bad_input_is_answered() {
    let bad = rows(2, 3, |x: &[Dual], i| if i == 1 { Dual::from(f64::NAN) } else { x[0] * x[1] });
    let none = rows(2, 0, |_: &[Dual], _| Dual::from(0.0));
    let walled = Rows {
        priors: vec![Prior { mean: 100.0, sigma: 1e3 }],
        ..rows(1, 2, |x: &[Dual], _| x[0].sqrt() - 2.0)
    };
    type Solve<'a> = &'a dyn Fn(&dyn Problem, &[f64]) -> Estimate;
    let solvers: [Solve<'_>; 6] = [
        &|p, x| gauss_newton::solve(p, x, &Default::default()),
        &|p, x| gauss_newton::solve(p, x, &gauss_newton::Options::as_printed()),
        &|p, x| sslm::solve(p, x, &Default::default()),
        &|p, x| sslm::solve(p, x, &sslm::Options::as_printed()),
        &|p, x| vslm::solve(p, x, &Default::default()),
        &|p, x| vslm::solve(p, x, &vslm::Options::as_printed()),
    ];
    for (i, solve) in solvers.iter().enumerate() {
        let estimate = solve(&bad, &[1.0, 2.0]);
        assert_eq!((estimate.termination, estimate.x), (Termination::NotFinite, vec![1.0, 2.0]), "{i}");
        assert_eq!(solve(&none, &[1.0, 2.0]).x, [1.0, 2.0], "{i}");
        assert!(solve(&walled, &[100.0]).x[0].is_finite(), "{i}");
    }
}
