//! Filters: against batch least squares where they must agree, and on bad input.

use nalgebra::{DMatrix, DVector};
use truegrind_estimation::estimate::{Estimate, Termination};
use truegrind_estimation::filter::{ekf, pf, prior_state, rls, ukf, ukf_vslm};
use truegrind_estimation::least_squares::{Form, gauss_newton, lm};
use truegrind_estimation::problem::{Prior, Problem};

use super::residuals::{Dual, Rows, rows};

const TRUTH: [f64; 4] = [0.3, -0.2, 0.1, 0.4];

fn noise(i: usize) -> f64 {
    // Sum of three roughly independent uniform numbers of variance 1/12 each, scaled to variance 1.
    let u = |k: usize| ((i * k) % 1009) as f64 / 1009.0 - 0.5;
    2.0 * (u(379) + u(613) + u(853))
}

/// Four parameters with priors, seen by rows that bend by `bend`; 0 is linear. Noise of one σ, truth [`TRUTH`].
fn curved(n: usize, bend: f64, per_observation: usize) -> impl Problem {
    let value = move |x: &[Dual], i: usize| {
        let mut sum = Dual::from(0.0);
        for (k, x) in x.iter().enumerate() {
            let w = (((i + 1) * (k + 2) * 37) % 101) as f64 / 101.0 - 0.5;
            sum = sum + 30.0 * w * (*x + bend * (w + 0.3) * *x * *x);
        }
        sum
    };
    let row = move |x: &[Dual], i: usize| {
        let truth = TRUTH.map(Dual::from);
        value(x, i) - value(&truth, i).value + noise(i)
    };
    let prior = Prior { mean: 0.0, sigma: 0.5 };
    Rows { per_observation, priors: vec![prior; 4], ..rows(4, n, row) }
}

fn batch(problem: &dyn Problem) -> Estimate {
    lm::solve(problem, &[0.0; 4], &lm::Options { cost_tolerance: 1e-16, ..Default::default() })
}

/// Distance from the batch result, in its own standard deviations.
fn off(estimate: &Estimate, batch: &Estimate) -> f64 {
    let sigmas = batch.sigmas().expect("batch least squares has a covariance");
    (0..4).map(|k| ((estimate.x[k] - batch.x[k]) / sigmas[k]).abs()).fold(0.0, f64::max)
}

fn relative(a: &DMatrix<f64>, b: &DMatrix<f64>) -> f64 {
    (a - b).norm() / b.norm()
}

#[test]
fn on_a_linear_problem_every_exact_filter_is_batch_least_squares() {
    for per_observation in [1, 3] {
        let problem = curved(60, 0.0, per_observation);
        let exact = batch(&problem);
        let sweeps = |sweeps| ekf::Options { sweeps, ..Default::default() };
        let estimates = [
            ekf::solve(&problem, &[0.0; 4], &sweeps(1)),
            ekf::solve(&problem, &[0.0; 4], &sweeps(5)),
            ukf::solve(&problem, &[0.0; 4], &Default::default()),
            rls::solve(&problem, &[0.0; 4], &Default::default()),
            rls::solve(
                &problem,
                &[0.0; 4],
                &rls::Options { memory: rls::Memory::Covariance, ..Default::default() },
            ),
        ];
        for (i, estimate) in estimates.iter().enumerate() {
            assert_eq!(estimate.termination, Termination::DataProcessed);
            assert!(off(estimate, &exact) < 1e-7, "{i}: {}", off(estimate, &exact));
            let covariance = estimate.covariance.as_ref().unwrap();
            assert!(relative(covariance, exact.covariance.as_ref().unwrap()) < 1e-7, "{i}");
            assert!((estimate.cost / exact.cost - 1.0).abs() < 1e-10);
        }
    }
}

#[test]
fn recursive_least_squares_is_batch_least_squares_of_one_linearisation() {
    // Also where the problem is curved: without forgetting there is no difference in method, only in
    // bookkeeping.
    let problem = curved(80, 0.4, 2);
    let one_step = gauss_newton::Options {
        form: Form::AsPrinted,
        priors: true,
        max_iterations: 1,
        ..Default::default()
    };
    let once = gauss_newton::solve(&problem, &[0.0; 4], &one_step);
    for memory in [rls::Memory::Covariance, rls::Memory::SquareRoot] {
        let options = rls::Options { memory, ..Default::default() };
        let recursive = rls::solve(&problem, &[0.0; 4], &options);
        assert!(off(&recursive, &once) < 1e-9, "{}", off(&recursive, &once));
        // The paper's start from the first rows, against the batch of all rows without priors.
        let options = rls::Options { memory, initial: rls::Initial::FirstRows(4), ..options };
        let recursive = rls::solve(&problem, &[0.0; 4], &options);
        let plain = gauss_newton::solve(&problem, &[0.0; 4], &gauss_newton::Options::as_printed());
        assert!(off(&recursive, &plain) < 1e-6, "{}", off(&recursive, &plain));
        // Linearised again and again it is Gauss–Newton, and ends where batch least squares ends.
        let options = rls::Options { memory, linearisations: 8, ..Default::default() };
        let repeated = rls::solve(&problem, &[0.0; 4], &options);
        assert!(off(&repeated, &batch(&problem)) < 1e-6);
    }
    // Too few first rows do not determine four parameters: that is said, not computed.
    let few = rls::solve(&problem, &[0.0; 4], &rls::Options::as_printed(1));
    assert_eq!(few.termination, Termination::Singular);
}

#[test]
fn the_square_root_stays_positive_definite_where_the_printed_form_does_not() {
    // Bierman's example: a prior of variance 1/ε² and rows (1, ε), (1, 1) with 1 + ε² = 1 in double precision.
    // The smaller eigenvalue of P is (3 − √5)/2 = 0.382.
    let tiny = 1e-9;
    let smallest = |memory| {
        let covariance = DMatrix::identity(2, 2) / (tiny * tiny);
        let mut recursion = rls::RecursiveLeastSquares::new(DVector::zeros(2), covariance, memory).unwrap();
        recursion.update(&DVector::from_vec(vec![1.0, tiny]), 0.0, 1.0);
        recursion.update(&DVector::from_vec(vec![1.0, 1.0]), 0.0, 1.0);
        recursion.covariance().symmetric_eigenvalues().min()
    };
    assert!(smallest(rls::Memory::Covariance) < -1.0);
    assert!((smallest(rls::Memory::SquareRoot) - 0.382).abs() < 1e-3);
}

#[test]
fn forgetting_follows_a_change() {
    // The mean of a signal that jumps from 0 to 5 in the middle.
    let problem = Rows {
        priors: vec![Prior { mean: 0.0, sigma: 10.0 }],
        ..rows(1, 400, |x: &[Dual], i| x[0] - if i < 200 { 0.0 } else { 5.0 })
    };
    for memory in [rls::Memory::Covariance, rls::Memory::SquareRoot] {
        let with = |forgetting| {
            rls::solve(&problem, &[0.0], &rls::Options { memory, forgetting, ..Default::default() })
        };
        assert!((with(1.0).x[0] - 2.5).abs() < 0.01);
        assert!((with(0.95).x[0] - 5.0).abs() < 0.01);
        // Remembered rows: 1 / (1 − 0.95) = 20, so σ² = 1/20.
        assert!((with(0.95).sigmas().unwrap()[0].powi(2) - 0.05).abs() < 1e-4);
    }
    // A filter with process noise follows too; one without does not.
    let drifting = ekf::Options { process_sigma: vec![0.5], ..Default::default() };
    assert!((ekf::solve(&problem, &[0.0], &drifting).x[0] - 5.0).abs() < 0.01);
    let drifting = ukf::Options { process_sigma: vec![0.5], ..Default::default() };
    assert!((ukf::solve(&problem, &[0.0], &drifting).x[0] - 5.0).abs() < 0.01);
    let mut recursion =
        rls::RecursiveLeastSquares::new(DVector::zeros(1), DMatrix::identity(1, 1), rls::Memory::SquareRoot)
            .unwrap();
    recursion.predict(&[3.0]);
    assert!((recursion.covariance()[(0, 0)] - 10.0).abs() < 1e-12);
}

/// Where only some parameters drift, the triangular root says what the covariance itself says, whichever of them drift and
/// though that changes on the way; and a root that is saved and read again goes on to the same bits.
#[test]
fn a_root_of_which_some_parameters_drift_is_the_covariance() {
    let p = 9;
    let mut rng = 7_u64;
    let mut random = || {
        rng = rng.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (rng >> 33) as f64 / 2f64.powi(31) - 0.5
    };
    let start = DMatrix::from_fn(p, p, |i, j| if i == j { 4.0 } else { 0.3 / (1.0 + (i + j) as f64) });
    let begun = |memory| rls::RecursiveLeastSquares::new(DVector::zeros(p), start.clone(), memory).unwrap();
    let (mut plain, mut root) = (begun(rls::Memory::Covariance), begun(rls::Memory::SquareRoot));
    for step in 0..120 {
        let drifting = |k: usize| if step < 60 { k % 3 == 1 } else { k < 2 };
        let sigma: Vec<f64> =
            (0..p).map(|k| if drifting(k) { 0.05 + 0.01 * k as f64 } else { 0.0 }).collect();
        plain.predict(&sigma);
        root.predict(&sigma);
        let a = DVector::from_fn(p, |_, _| 3.0 * random());
        let (e, forgetting) = (random(), if step % 7 == 0 { 0.98 } else { 1.0 });
        let [one, other] = [&mut plain, &mut root].map(|recursion| recursion.update(&a, e, forgetting));
        assert!((one - other).abs() < 1e-10 * one, "step {step}: {one} {other}");
        if step == 40 {
            let again = rls::RecursiveLeastSquares::from_root(root.x.clone(), root.root().unwrap());
            let mut stopped = again;
            let mut going = root.clone();
            stopped.predict(&sigma);
            going.predict(&sigma);
            assert_eq!(stopped.root(), going.root());
        }
    }
    assert!((&plain.x - &root.x).amax() < 1e-9, "{} {}", plain.x, root.x);
    assert!((plain.covariance() - root.covariance()).amax() < 1e-10);
}

#[test]
fn on_a_curved_problem_filters_come_close() {
    let problem = curved(200, 0.3, 1);
    let exact = batch(&problem);
    let extended = ekf::solve(&problem, &[0.0; 4], &Default::default());
    let swept = ekf::solve(&problem, &[0.0; 4], &ekf::Options { sweeps: 10, ..Default::default() });
    let iterated = ekf::solve(&problem, &[0.0; 4], &ekf::Options { iterations: 5, ..Default::default() });
    let unscented = ukf::solve(&problem, &[0.0; 4], &Default::default());
    println!(
        "{} {} {} {}",
        off(&extended, &exact),
        off(&swept, &exact),
        off(&iterated, &exact),
        off(&unscented, &exact)
    );
    assert!(off(&extended, &exact) < 5.0 && off(&iterated, &exact) < 5.0 && off(&unscented, &exact) < 5.0);
    assert!(off(&swept, &exact) < 0.5 * off(&extended, &exact).max(0.2));
    // Sweeps that count the data as new claim to know twelve times as much.
    let printed = ekf::solve(&problem, &[0.0; 4], &ekf::Options::as_printed());
    let ratio = exact.sigmas().unwrap()[0] / printed.sigmas().unwrap()[0];
    assert!(ratio > 3.0, "{ratio}");
}

#[test]
fn normalised_innovations_are_chi_squared() {
    let problem = curved(300, 0.0, 3);
    let (x, covariance) = prior_state(&problem, &[0.0; 4], 1.0);
    let mut extended = ekf::Filter { x: x.clone(), covariance: covariance.clone() };
    let mut unscented = ukf::Filter { x, covariance, alpha: 0.1, beta: 2.0, kappa: 0.0 };
    let mut sum = 0.0;
    for i in 0..100 {
        let rows = 3 * i..3 * i + 3;
        let a = extended.update(&problem, rows.clone(), 1.0, 1).unwrap();
        let b = unscented.update(&problem, rows, 1.0).unwrap();
        assert!((a.nis - b.nis).abs() < 1e-6 * (1.0 + a.nis));
        assert_eq!((a.residual.len(), a.covariance.shape()), (3, (3, 3)));
        sum += a.nis;
    }
    // χ² with 300 degrees of freedom: 300 ± 24.5; the noise here is not quite normal.
    assert!((sum - 300.0).abs() < 4.0 * 24.5, "{sum}");
}

#[test]
fn the_printed_unscented_filter_stops_listening() {
    let problem = curved(200, 0.0, 1);
    let exact = batch(&problem);
    let printed = ukf::solve(&problem, &[0.0; 4], &ukf::Options { sweeps: 1, ..ukf::Options::as_printed() });
    println!("off by {} sigmas, {:?}", off(&printed, &exact), printed.covariance);
    assert_eq!(printed.termination, Termination::DataProcessed);
    // It claims to know everything, and is wrong by many standard deviations of what could be known.
    let claimed = printed.sigmas().unwrap().into_iter().fold(0.0, f64::max);
    assert!(claimed < 1e-3 * exact.sigmas().unwrap()[0], "{claimed}");
    assert!(off(&printed, &exact) > 3.0);
    // Another seed, another random P; the same seed, the same bits.
    let again = |seed| {
        ukf::solve(&problem, &[0.0; 4], &ukf::Options { seed, sweeps: 1, ..ukf::Options::as_printed() })
    };
    assert_eq!(again(0), printed);
}

#[test]
fn filter_then_search_ends_where_batch_ends() {
    let problem = curved(100, 0.3, 1);
    let exact = batch(&problem);
    let sound = ukf_vslm::solve(&problem, &[0.0; 4], &Default::default());
    assert!(sound.termination.is_converged());
    assert!((sound.cost / exact.cost - 1.0).abs() < 1e-8);
    let printed = ukf_vslm::solve(&problem, &[0.0; 4], &ukf_vslm::Options::as_printed());
    assert!(printed.cost.is_finite() && printed.cost > 1.01 * exact.cost, "{} {}", printed.cost, exact.cost);
    assert!(printed.evaluations.residuals > 0 && printed.evaluations.jacobians > 0);
    let counts: Vec<u64> =
        sound.trace.iter().map(|i| i.evaluations.residuals + i.evaluations.jacobians).collect();
    assert!(counts.windows(2).all(|pair| pair[0] <= pair[1]));
}

#[test]
fn particles_find_what_batch_finds_only_if_they_may_move() {
    let problem = curved(60, 0.3, 1);
    let exact = batch(&problem);
    let sound = pf::solve(&problem, &[0.0; 4], &pf::Options::default());
    let printed = pf::solve(&problem, &[0.0; 4], &pf::Options::as_printed());
    println!("sound {} printed {}", off(&sound, &exact), off(&printed, &exact));
    assert!(off(&sound, &exact) < 1.5);
    assert!(sound.cost < printed.cost);
    let (sigma, known) = (sound.sigmas().unwrap()[0], exact.sigmas().unwrap()[0]);
    assert!((sigma / known).ln().abs() < 0.7, "{sigma} {known}");
    // The printed form ends on copies of a few particles.
    assert!(printed.sigmas().unwrap()[0] < 0.5 * known);
}

#[test]
fn particles_do_not_depend_on_threads_but_on_the_seed() {
    let problem = curved(20, 0.3, 1);
    let run = |threads, seed| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        pool.install(|| {
            pf::solve(&problem, &[0.0; 4], &pf::Options { seed, particles: 200, ..Default::default() })
        })
    };
    assert_eq!(run(1, 7), run(2, 7));
    assert_ne!(run(1, 7).x, run(1, 8).x);
}

#[test]
fn evaluations_are_counted_in_rows() {
    let problem = curved(30, 0.0, 3);
    // Costs at the beginning and at the end of each sweep are passes of their own.
    let extended = ekf::solve(&problem, &[0.0; 4], &ekf::Options { sweeps: 2, ..Default::default() });
    assert_eq!((extended.evaluations.jacobians, extended.evaluations.residuals), (60, 90));
    let unscented = ukf::solve(&problem, &[0.0; 4], &Default::default());
    assert_eq!((unscented.evaluations.jacobians, unscented.evaluations.residuals), (0, 30 * 9 + 60));
    let recursive = rls::solve(&problem, &[0.0; 4], &Default::default());
    assert_eq!((recursive.evaluations.jacobians, recursive.evaluations.residuals), (30, 60));
    let particles =
        pf::solve(&problem, &[0.0; 4], &pf::Options { particles: 50, ..pf::Options::as_printed() });
    assert_eq!(particles.evaluations.residuals, 30 * 50 + 60);
}

#[test]
fn bad_input_is_answered() {
    let bad = rows(2, 6, |x: &[Dual], i| if i == 3 { Dual::from(f64::NAN) } else { x[0] * x[1] - 1.0 });
    let none = rows(2, 0, |_: &[Dual], _| Dual::from(0.0));
    type Solve<'a> = &'a dyn Fn(&dyn Problem, &[f64]) -> Estimate;
    let solvers: [Solve<'_>; 10] = [
        &|p, x| ekf::solve(p, x, &Default::default()),
        &|p, x| ekf::solve(p, x, &ekf::Options::as_printed()),
        &|p, x| ukf::solve(p, x, &Default::default()),
        &|p, x| ukf::solve(p, x, &ukf::Options::as_printed()),
        &|p, x| ukf_vslm::solve(p, x, &Default::default()),
        &|p, x| ukf_vslm::solve(p, x, &ukf_vslm::Options::as_printed()),
        &|p, x| rls::solve(p, x, &Default::default()),
        &|p, x| rls::solve(p, x, &rls::Options::as_printed(2)),
        &|p, x| pf::solve(p, x, &Default::default()),
        &|p, x| pf::solve(p, x, &pf::Options::as_printed()),
    ];
    for (i, solve) in solvers.iter().enumerate() {
        let estimate = solve(&bad, &[1.0, 2.0]);
        assert!(estimate.termination.is_failure(), "{i}: {}", estimate.termination);
        assert!(estimate.x.iter().all(|x| x.is_finite()), "{i}");
        assert_eq!(solve(&none, &[1.0, 2.0]).x.len(), 2, "{i}");
        let empty = rows(0, 2, |_: &[Dual], _| Dual::from(1.0));
        assert!(solve(&empty, &[]).x.is_empty(), "{i}");
    }
}
