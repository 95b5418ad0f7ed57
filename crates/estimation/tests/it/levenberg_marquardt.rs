//! Levenberg–Marquardt on published problems, and on bad input.

use truegrind_estimation::estimate::{Estimate, Termination};
use truegrind_estimation::least_squares::lm::{Options, solve};
use truegrind_estimation::least_squares::{Factorisation, Form};
use truegrind_estimation::problem::{Prior, Problem};

use super::residuals::{Dual, Rows, rows};
use super::{nist, published};

fn reaches(cost: f64, minima: &[f64]) -> bool {
    minima.iter().any(|m| (2.0 * cost - m).abs() <= 2e-5 * m + 1e-14)
}

fn precise() -> Options {
    Options { cost_tolerance: 1e-15, max_iterations: 600, ..Options::default() }
}

fn monotone(estimate: &Estimate) -> bool {
    estimate.trace.windows(2).all(|pair| pair[1].cost <= pair[0].cost)
}

#[test]
fn finds_the_published_minima_with_cholesky_and_with_qr() {
    for factorisation in [Factorisation::Cholesky, Factorisation::Qr] {
        for case in published::all() {
            let options = Options { factorisation, ..precise() };
            let estimate = solve(&*case.problem, &case.start, &options);
            println!(
                "{factorisation:?} {}: {} after {} passes, Σr² {:e}",
                case.name,
                estimate.termination,
                estimate.evaluations.jacobians / case.problem.rows() as u64,
                2.0 * estimate.cost
            );
            assert!(reaches(estimate.cost, &case.minima), "{}: Σr² {:e}", case.name, 2.0 * estimate.cost);
            assert!(estimate.termination.is_converged(), "{}: {}", case.name, estimate.termination);
            assert!(monotone(&estimate), "{}", case.name);
        }
    }
}

#[test]
fn agrees_with_the_certified_regressions() {
    for case in nist::all() {
        for (which, start) in case.starts.iter().enumerate() {
            let problem =
                rows(start.len(), case.data.len(), |b, i| (case.model)(b, case.data[i].0) - case.data[i].1);
            let options = Options { cost_tolerance: 1e-16, factorisation: Factorisation::Qr, ..precise() };
            let estimate = solve(&problem, start, &options);
            println!(
                "{} start {which}: {} after {} passes",
                case.name,
                estimate.termination,
                estimate.evaluations.jacobians / case.data.len() as u64
            );
            assert!(monotone(&estimate), "{}", case.name);
            // From the far start these four end elsewhere or take thousands of steps, here as with most
            // solvers.
            if which == 0 && ["Lanczos3", "MGH10", "MGH17", "BoxBOD"].contains(&case.name) {
                continue;
            }
            let relative = (2.0 * estimate.cost / case.sum_of_squares - 1.0).abs();
            assert!(relative < 1e-6, "{} start {which}: Σr² off by {relative:e}", case.name);
            // Standard deviations: of the parameters for unit noise, times the residual standard deviation.
            let degrees = (case.data.len() - start.len()) as f64;
            let noise = (case.sum_of_squares / degrees).sqrt();
            let sigmas = estimate.sigmas().unwrap();
            for (k, sigma) in sigmas.iter().enumerate() {
                let off = (estimate.x[k] / case.certified[k] - 1.0).abs();
                assert!(off < 1e-4, "{} start {which}: b{} off by {off:e}", case.name, k + 1);
                let off = (sigma * noise / case.deviations[k] - 1.0).abs();
                assert!(off < 1e-3, "{} start {which}: σ of b{} off by {off:e}", case.name, k + 1);
            }
        }
    }
}

#[test]
fn cholesky_and_qr_take_the_same_steps() {
    let case = published::rosenbrock();
    let with = |factorisation| solve(&*case.problem, &case.start, &Options { factorisation, ..precise() });
    let (cholesky, qr) = (with(Factorisation::Cholesky), with(Factorisation::Qr));
    assert_eq!(cholesky.trace.len(), qr.trace.len());
    for (a, b) in cholesky.trace.iter().zip(&qr.trace) {
        assert!((a.cost - b.cost).abs() <= 1e-8 * (a.cost + 1e-6), "{} {}", a.cost, b.cost);
    }
}

#[test]
fn the_printed_form_creeps_where_its_damping_is_large_and_stops_nowhere_else() {
    // Residuals in thousandths make μ = 5 overwhelming; the sound form does not notice the unit.
    let small =
        rows(2, 2, |x: &[Dual], i| 1e-3 * if i == 0 { 10.0 * (x[1] - x[0] * x[0]) } else { 1.0 - x[0] });
    let printed = solve(&small, &[-1.2, 1.0], &Options { max_iterations: 50, ..Options::as_printed() });
    assert_eq!(printed.termination, Termination::IterationLimit);
    assert!(printed.cost > 0.9 * printed.trace[0].cost);
    let sound = solve(&small, &[-1.2, 1.0], &Options { small_cost: 1e-30, ..precise() });
    assert!(sound.cost < 1e-25, "{:e}", sound.cost);
    // Where JᵀJ is large against 5 the printed form converges.
    let large = rows(2, 3, |x: &[Dual], i| 1e3 * [x[0] - 1.0, x[1] - x[0], x[1] - 2.0][i]);
    let printed = solve(&large, &[0.0, 0.0], &Options::as_printed());
    assert!(printed.termination.is_converged());
    assert!((printed.x[0] - 4.0 / 3.0).abs() < 1e-5 && (printed.x[1] - 5.0 / 3.0).abs() < 1e-5);
}

#[test]
fn a_parameter_that_no_row_sees_stays_at_its_prior() {
    let prior = |mean, sigma| Prior { mean, sigma };
    let problem = Rows {
        priors: vec![prior(0.0, 10.0), prior(3.0, 0.1), prior(-1.0, f64::INFINITY)],
        ..rows(3, 4, |x: &[Dual], i| x[0] + x[2] * i as f64 - 5.0 - i as f64)
    };
    let estimate = solve(&problem, &[0.0, 2.0, 0.0], &precise());
    assert!(estimate.termination.is_converged());
    assert!((estimate.x[1] - 3.0).abs() < 1e-9);
    let sigmas = estimate.sigmas().unwrap();
    assert!((sigmas[1] - 0.1).abs() < 1e-12, "an unseen parameter keeps the sigma of its prior");
    // Without any prior the unseen parameter is not moved at all, and there is no covariance.
    let estimate = solve(&problem, &[0.0, 2.0, 0.0], &Options { priors: false, ..precise() });
    assert!(estimate.termination.is_converged());
    assert_eq!(estimate.x[1], 2.0);
    assert!((estimate.x[0] - 5.0).abs() < 1e-7 && (estimate.x[2] - 1.0).abs() < 1e-7);
    assert!(estimate.covariance.is_none());
}

#[test]
fn two_parameters_that_only_show_as_a_sum_do_not_run_away() {
    for factorisation in [Factorisation::Cholesky, Factorisation::Qr] {
        let problem = rows(2, 5, |x: &[Dual], i| (x[0] + x[1]) * (i + 1) as f64 - 7.0 * (i + 1) as f64 + 0.1);
        let estimate = solve(&problem, &[1.0, 2.0], &Options { factorisation, ..precise() });
        assert!(estimate.termination.is_converged(), "{}", estimate.termination);
        // The difference, of which nothing is known, stays what it was.
        assert!((estimate.x[1] - estimate.x[0] - 1.0).abs() < 1e-6, "{:?}", estimate.x);
        assert!(estimate.covariance.is_none());
    }
}

#[test]
fn what_is_not_a_number_ends_in_a_termination() {
    for form in [Form::AsPrinted, Form::Robust] {
        for factorisation in [Factorisation::Cholesky, Factorisation::Qr] {
            let options = Options { form, factorisation, ..Options::default() };
            for bad in [f64::NAN, f64::INFINITY, f64::NEG_INFINITY] {
                let problem =
                    rows(2, 4, move |x: &[Dual], i| if i == 2 { Dual::from(bad) } else { x[0] + x[1] * 2.0 });
                let estimate = solve(&problem, &[1.0, 2.0], &options);
                assert_eq!(estimate.termination, Termination::NotFinite);
                assert_eq!(estimate.x, [1.0, 2.0]);
                assert!(estimate.covariance.is_none());
            }
            let problem = rows(2, 4, |x: &[Dual], _| x[0] + x[1]);
            let estimate = solve(&problem, &[f64::NAN, 0.0], &options);
            assert_eq!(estimate.termination, Termination::NotFinite);
        }
    }
}

#[test]
fn a_wall_of_nan_is_backed_away_from() {
    // √x − 2 is not a number left of 0, where the first Gauss–Newton step from 100 leads: 100 − 160 = −60.
    let problem = rows(1, 1, |x: &[Dual], _| x[0].sqrt() - 2.0);
    let estimate = solve(&problem, &[100.0], &precise());
    assert!(estimate.termination.is_converged());
    assert!((estimate.x[0] - 4.0).abs() < 1e-9, "{:?}", estimate.x);
}

#[test]
fn no_rows_and_no_parameters_are_answered() {
    let none = rows(2, 0, |_: &[Dual], _| Dual::from(0.0));
    for form in [Form::AsPrinted, Form::Robust] {
        for factorisation in [Factorisation::Cholesky, Factorisation::Qr] {
            let options = Options { form, factorisation, ..Options::default() };
            let estimate = solve(&none, &[1.0, 2.0], &options);
            assert_eq!(estimate.x, [1.0, 2.0]);
            assert!(estimate.covariance.is_none());
            let empty = rows(0, 3, |_: &[Dual], _| Dual::from(1.0));
            assert!((solve(&empty, &[], &options).cost - 1.5).abs() < 1e-12);
        }
    }
}

/// A mildly nonlinear problem of the size of an arm's calibration.
pub(crate) fn wide(n: usize) -> (impl Problem, Vec<f64>) {
    let truth: Vec<f64> = (0..28).map(|k| 0.02 * ((k * 7 % 11) as f64 - 5.0)).collect();
    let at = truth.clone();
    let row = move |x: &[Dual], i: usize| {
        let mut sum = Dual::from(0.0);
        for (k, x) in x.iter().enumerate() {
            let w = ((i * (k + 3) * 37 % 1009) as f64 / 1009.0 - 0.5) * 6.0;
            sum = sum + 10.0 * (*x + w).sin() - 10.0 * (at[k] + w).sin();
        }
        sum / 0.05 + ((i * 7919 % 997) as f64 / 997.0 - 0.5)
    };
    (rows(28, n, row), truth)
}

#[test]
fn a_calibration_sized_problem_needs_few_passes() {
    let (problem, truth) = wide(400);
    let best = solve(&problem, &truth, &precise()).cost;
    let estimate = solve(&problem, &[0.0; 28], &Options::default());
    let passes = estimate.evaluations.jacobians / 400;
    println!("{passes} passes, relative gap {:e}", estimate.cost / best - 1.0);
    assert!(estimate.cost <= best * (1.0 + 1e-8));
    assert!(passes <= 6 && estimate.evaluations.residuals == 0);
}

#[test]
fn same_bits_for_any_number_of_threads() {
    let (problem, _) = wide(1700);
    let run = |threads, factorisation| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        let options = Options { factorisation, max_iterations: 1, ..Options::default() };
        pool.install(|| solve(&problem, &[0.0; 28], &options))
    };
    for factorisation in [Factorisation::Cholesky, Factorisation::Qr] {
        assert_eq!(run(1, factorisation), run(2, factorisation));
    }
}

/// Distances from points on a plate to a station, where the plate may stand turned: plate and station turning together
/// leave every distance as it is, so that only the priors hold them, along a circle.
struct Turntable {
    points: Vec<[f64; 2]>,
    distances: Vec<f64>,
    priors: Vec<Prior>,
}

impl Turntable {
    const SIGMA: f64 = 0.03;

    fn of(rows: usize) -> Self {
        use rand::{RngExt, SeedableRng};
        let mut random = rand_chacha::ChaCha8Rng::seed_from_u64(7);
        let points: Vec<[f64; 2]> = (0..rows)
            .map(|_| [random.random_range(-400.0..400.0), random.random_range(-400.0..400.0)])
            .collect();
        let distances = points
            .iter()
            .map(|p| (p[0] - 742.0).hypot(p[1] - 183.0) + Self::SIGMA * random.random_range(-1.7..1.7))
            .collect();
        let prior = |sigma: f64| Prior { mean: 0.0, sigma };
        Self { points, distances, priors: vec![prior(0.005), prior(2000.0), prior(2000.0)] }
    }
}

impl Problem for Turntable {
    fn parameters(&self) -> usize {
        3
    }

    fn rows(&self) -> usize {
        self.points.len()
    }

    fn priors(&self) -> &[Prior] {
        &self.priors
    }

    fn residuals(&self, x: &[f64], rows: std::ops::Range<usize>, out: &mut [f64]) {
        self.jacobian(x, rows.clone(), out, &mut vec![0.0; 3 * rows.len()]);
    }

    fn jacobian(&self, x: &[f64], rows: std::ops::Range<usize>, r: &mut [f64], j: &mut [f64]) {
        let (sin, cos) = x[0].sin_cos();
        let n = rows.len();
        for (i, row) in rows.enumerate() {
            let [u, v] = self.points[row];
            let (px, py) = (cos * u - sin * v, sin * u + cos * v);
            let (dx, dy) = (px - 700.0 - x[1], py - 300.0 - x[2]);
            let d = dx.hypot(dy);
            r[i] = (d - self.distances[row]) / Self::SIGMA;
            j[i] = (dx * -py + dy * px) / d / Self::SIGMA;
            j[n + i] = -dx / d / Self::SIGMA;
            j[2 * n + i] = -dy / d / Self::SIGMA;
        }
    }

    fn subsample(&self, observations: &[usize]) -> Option<Box<dyn Problem + '_>> {
        Some(Box::new(Self {
            points: observations.iter().map(|&i| self.points[i]).collect(),
            distances: observations.iter().map(|&i| self.distances[i]).collect(),
            priors: self.priors.clone(),
        }))
    }
}

/// The same without a subsample form.
struct Plain(Turntable);

impl Problem for Plain {
    fn parameters(&self) -> usize {
        3
    }
    fn rows(&self) -> usize {
        self.0.rows()
    }
    fn priors(&self) -> &[Prior] {
        self.0.priors()
    }
    fn residuals(&self, x: &[f64], rows: std::ops::Range<usize>, out: &mut [f64]) {
        self.0.residuals(x, rows, out);
    }
    fn jacobian(&self, x: &[f64], rows: std::ops::Range<usize>, r: &mut [f64], j: &mut [f64]) {
        self.0.jacobian(x, rows, r, j);
    }
}

#[test]
fn very_many_rows_begin_on_few_and_reach_the_same_optimum_in_few_passes() {
    let rows = 60_000;
    let start = [0.0; 3];
    let found = solve(&Turntable::of(rows), &start, &Options::default());
    // The optimum, by a search over all rows that is not content with less than 1e-15 of the cost. From the start it would
    // take thousands of passes.
    let plain = solve(&Plain(Turntable::of(rows)), &found.x, &Options { initial_damping: 0.0, ..precise() });
    let passes = |e: &Estimate| e.evaluations.jacobians as f64 / rows as f64;
    println!(
        "{} after {:.1} passes; the optimum {} after {:.1} more",
        found.termination,
        passes(&found),
        plain.termination,
        passes(&plain)
    );
    assert!(found.termination.is_converged() && plain.termination.is_converged());
    assert!(passes(&found) < 8.0, "{} passes", passes(&found));
    assert!((found.cost - plain.cost).abs() <= 1e-8 * plain.cost, "{} {}", found.cost, plain.cost);
    assert!(monotone(&found));
    // From the optimum itself there is no detour.
    let again = solve(&Turntable::of(rows), &found.x, &Options::default());
    assert!(passes(&again) <= 2.0, "{} passes", passes(&again));
    assert!(again.cost <= found.cost * (1.0 + 1e-12));
}
