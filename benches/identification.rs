//! Identification of 28 parameters on cable data: 1,042 rows to 1e-8 of the optimal cost, and a thousand times as many.
//!
//! `cargo bench --no-default-features --bench identification`; one thread, so wall time is CPU time, but two for fits of a million rows.
//!
//! A row of a pass costs 620 operations for residual and 28 slopes (chain 354, moments 84, slopes 144), none of them fused, and
//! 29 · 30 = 870 for its products with each other, two to an instruction; 112 bytes in, 232 through the second-level cache.
//! At 2.9 GHz with two 512-bit units that is 13 + 9.5 ns: no pass over 1,042 rows takes less than 24 µs there.
//! Reached on a shared Intel Xeon at 2.9 GHz: 62 µs, 39 % of that bound; the products reach 65 of 92 G/s, the rows 14 of 46.
//! On an AMD Zen 4 at 3.5 GHz, which has 16 operations in a cycle at either width: 73 µs (7c20e9f in the same run 97 to 102); the fit of
//! 1,042 rows 0.41 ms (0.62 to 0.79); of 1,042,000 rows 0.46 to 0.54 s on one thread in 6 passes of 77 ms, 214 MB (0.62 s, 514 MB).
//! On an AMD Zen 5 at 4.17 GHz, 32 operations in a cycle, under load: 38.5 to 40 µs (7c20e9f in turn 62) where 12 are the bound: rows 24.5 µs
//! for 5, products 10 µs for 7, the rest cleared buffers, which each thread now keeps. A tenth of a row's time is the jump from one kind of parameter to the next, a tenth
//! copies the frames, which are indexed. The fit of 1,042 rows 0.26 ms (0.44).
//! The same machine idle: 37.9 µs, the fit of 1,042 rows 0.237 ms (0.254 with cleared buffers), of 1,042,000 rows 0.122 s on two threads.

// A benchmark says what it measured.
#![allow(clippy::print_stderr)]

use nalgebra::Vector3;
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use truegrind::arm::condition::Condition;
use truegrind::arm::model::{Joints, Model};
use truegrind::arm::parameter::{Parameter, link_parameters};
use truegrind::calibration::identification::calibration::{CalibrationProblem, Frames, Weight};
use truegrind::calibration::identification::tolerance::Tolerance;
use truegrind::calibration::measurement::dataset::{Dataset, Reading, Row, Sensor};
use truegrind::estimation::least_squares::lm;
use truegrind::estimation::problem::{Prior, Problem, prior_cost};

fn main() {
    let pool = rayon::ThreadPoolBuilder::new().num_threads(1).build().expect("a thread");
    pool.install(divan::main);
}

/// 24 link parameters, outlet and zero: 28.
fn parameters(model: &Model) -> Vec<Parameter> {
    let mut out = link_parameters(model);
    out.extend((0..3).map(|axis| Parameter::Outlet { anchor: 0, axis }));
    out.push(Parameter::Zero { anchor: 0 });
    out
}

/// The problem, and the true parameters.
fn problem(rows: usize) -> (CalibrationProblem, Vec<f64>) {
    let nominal = truegrind::robots::load("abb-irb-120").expect("in the catalogue").model;
    let mut random = ChaCha8Rng::seed_from_u64(1042);
    let mut actual = nominal.clone();
    for parameter in link_parameters(&nominal) {
        let Parameter::Link { joint, coordinate } = parameter else { continue };
        let size = if coordinate.is_length() { 0.5 } else { 0.003 };
        let link = &mut actual.links[joint];
        link.set(coordinate, link.get(coordinate) + size * random.random_range(-1.0..1.0));
    }
    let outlet = Vector3::new(742.0, 183.0, 39.0);
    let still = Condition::default();
    let posed = actual.at_condition(&still);
    let rows: Vec<Row> = (0..rows)
        .map(|number| {
            let joints = Joints::from_fn(|_, _| random.random_range(-1.2..1.2));
            let length = (posed.forward(&joints).translation.vector - outlet).norm() + 17.0;
            Row::new(number, joints, Reading::Cable(length + 0.05 * random.random_range(-1.0..1.0)))
        })
        .collect();
    let weights = vec![Weight { per_mm: 1.0 / 0.03, per_rad: 1.0 }; rows.len()];
    let dataset = Dataset {
        joined_by_time: false,
        station_names: Vec::new(),
        file: "made".into(),
        sha256: String::new(),
        sheet: None,
        sensor: Sensor::Cable,
        rows: rows.into(),
        other_columns: Vec::new(),
        notes: Vec::new(),
        angle_step_rad: None,
        readout_step_mm: None,
        reading_step_mm: None,
    };
    let mut frames = Frames::at_origin(1);
    // A start a few millimetres off, as multilateration under the nominal arm gives it.
    let off = Vector3::new(4.0, -3.0, 5.0);
    frames.outlets_mm[0] = outlet + off;
    frames.zeros_mm[0] = 14.0;
    let list = parameters(&nominal);
    let truth = list.iter().map(|parameter| match *parameter {
        Parameter::Link { joint, coordinate } => {
            actual.links[joint].get(coordinate) - nominal.links[joint].get(coordinate)
        }
        Parameter::Outlet { axis, .. } => -off[axis],
        _ => 17.0 - 14.0,
    });
    let truth = truth.collect();
    let priors: Vec<Prior> = Tolerance::default().priors(&list, &nominal);
    (CalibrationProblem::new(&dataset, &nominal, &frames, &list, &priors, &weights), truth)
}

fn cost(problem: &CalibrationProblem, x: &[f64]) -> f64 {
    problem.row_cost(x) + prior_cost(problem.priors(), x)
}

/// A calibration problem whose fit with default stops is known to end within 1e-8 of the optimal cost. The reference comes
/// from the true parameters, so it does not start on a part of the rows as the fit may, and stops far later.
fn checked(rows: usize, options: &lm::Options) -> CalibrationProblem {
    let (problem, truth) = problem(rows);
    let start = vec![0.0; problem.parameters()];
    let optimum = lm::solve(
        &problem,
        &truth,
        &lm::Options { cost_tolerance: 1e-14, gradient_tolerance: 0.0, ..*options },
    );
    let found = lm::solve(&problem, &start, options);
    let worth = |x: &[f64]| if options.priors { cost(&problem, x) } else { problem.row_cost(x) };
    let gap = (worth(&found.x) - worth(&optimum.x)) / worth(&optimum.x);
    assert!(gap.abs() < 1e-8, "relative gap to the optimal cost {gap:e}");
    let passes = found.evaluations.jacobians / problem.rows() as u64;
    eprintln!(
        "{rows} rows: {passes} passes with Jacobians, relative gap {gap:.1e}, {:?}; reference {:?} after {} passes",
        found.termination,
        optimum.termination,
        optimum.evaluations.jacobians / problem.rows() as u64
    );
    problem
}

fn fit(bencher: divan::Bencher<'_, '_>, problem: &CalibrationProblem, options: &lm::Options) {
    let start = vec![0.0; problem.parameters()];
    bencher.bench_local(|| lm::solve(divan::black_box(problem), &start, options));
}

/// The same on two threads.
fn fit_side_by_side(bencher: divan::Bencher<'_, '_>, problem: &CalibrationProblem, options: &lm::Options) {
    let start = vec![0.0; problem.parameters()];
    let pool = rayon::ThreadPoolBuilder::new().num_threads(2).build().expect("two threads");
    bencher.bench_local(|| pool.install(|| lm::solve(divan::black_box(problem), &start, options)));
}

/// From the nominal arm to 1e-8 of the optimal cost.
#[divan::bench(sample_count = 50)]
fn fit_28_parameters_to_1042_rows(bencher: divan::Bencher<'_, '_>) {
    let options = lm::Options::default();
    fit(bencher, &checked(1_042, &options), &options);
}

/// A thousand times as many rows, without priors, as other solvers are measured: some seconds in all, and the memory of
/// rows, problem and fit.
#[divan::bench(sample_count = 3, sample_size = 1)]
fn fit_28_parameters_to_1042000_rows(bencher: divan::Bencher<'_, '_>) {
    let options = lm::Options { priors: false, ..lm::Options::default() };
    fit_side_by_side(bencher, &checked(1_042_000, &options), &options);
    match peak_memory_mb() {
        Some(mb) => eprintln!("peak memory of the process: {mb:.0} MB"),
        None => eprintln!("peak memory: not known on this system"),
    }
}

/// The same with priors. A million rows make a narrow valley of what only the priors hold (outlet and link 1 turning
/// together), which is curved.
#[divan::bench(sample_count = 3, sample_size = 1)]
fn fit_28_parameters_with_priors_to_1042000_rows(bencher: divan::Bencher<'_, '_>) {
    let options = lm::Options::default();
    fit_side_by_side(bencher, &checked(1_042_000, &options), &options);
}

/// The largest resident size of this process so far, where the system tells (MB).
fn peak_memory_mb() -> Option<f64> {
    let status = std::fs::read_to_string("/proc/self/status").ok()?;
    let line = status.lines().find(|line| line.starts_with("VmHWM:"))?;
    let kilobytes: f64 = line.split_whitespace().nth(1)?.parse().ok()?;
    Some(kilobytes * 1024.0 / 1e6)
}

/// One pass: residuals, Jacobian and normal equations of all rows.
#[divan::bench(args = [1_042, 1_042_000], sample_count = 5)]
fn one_pass(bencher: divan::Bencher<'_, '_>, rows: usize) {
    let (problem, _) = problem(rows);
    let x = vec![1e-5; problem.parameters()];
    bencher.bench_local(|| problem.normal_equations(divan::black_box(&x)));
}
