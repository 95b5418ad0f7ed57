//! What a fit costs beyond the passes over its rows: compare `levenberg_marquardt` with `one_pass`.

use std::ops::Range;

use divan::Bencher;
use truegrind::estimation::filter::{ekf, rls, ukf};
use truegrind::estimation::least_squares::triangular::triangular_factor;
use truegrind::estimation::least_squares::{lm, ltlm};
use truegrind::estimation::problem::{Prior, Problem};

fn main() {
    divan::main();
}

const P: usize = 28;

/// Mildly nonlinear rows Σ w (x + 0.1 x²) + …, with the derivative written out.
struct Rows {
    weights: Vec<f64>,
    targets: Vec<f64>,
    priors: Vec<Prior>,
}

impl Rows {
    fn new(n: usize) -> Self {
        let weight = |i: usize, k: usize| (((i + 3) * (k + 7) * 7919) % 1009) as f64 / 50.45 - 10.0;
        let weights: Vec<f64> = (0..n * P).map(|at| weight(at / P, at % P)).collect();
        let value =
            |i: usize| (0..P).map(|k| weights[i * P + k] * bend(0.03 * (k as f64 - 13.0)).0).sum::<f64>();
        let targets = (0..n).map(|i| value(i) + ((i * 6151) % 97) as f64 / 97.0 - 0.5).collect();
        Self { weights, targets, priors: vec![Prior { mean: 0.0, sigma: 1.0 }; P] }
    }
}

fn bend(x: f64) -> (f64, f64) {
    (x + 0.1 * x * x, 1.0 + 0.2 * x)
}

impl Problem for Rows {
    fn parameters(&self) -> usize {
        P
    }
    fn rows(&self) -> usize {
        self.targets.len()
    }
    fn priors(&self) -> &[Prior] {
        &self.priors
    }
    fn residuals(&self, x: &[f64], rows: Range<usize>, out: &mut [f64]) {
        for (out, i) in out.iter_mut().zip(rows) {
            let w = &self.weights[i * P..(i + 1) * P];
            *out = w.iter().zip(x).map(|(w, x)| w * bend(*x).0).sum::<f64>() - self.targets[i];
        }
    }
    fn jacobian(&self, x: &[f64], rows: Range<usize>, residuals: &mut [f64], jacobian: &mut [f64]) {
        self.residuals(x, rows.clone(), residuals);
        let n = rows.len();
        for (k, x) in x.iter().enumerate() {
            let slope = bend(*x).1;
            for (out, i) in jacobian[k * n..(k + 1) * n].iter_mut().zip(rows.clone()) {
                *out = self.weights[i * P + k] * slope;
            }
        }
    }
}

#[divan::bench(args = [56, 1042])]
fn one_pass(bencher: Bencher<'_, '_>, n: usize) {
    let problem = Rows::new(n);
    bencher.bench_local(|| problem.normal_equations(&[0.01; P]));
}

#[divan::bench(args = [56, 1042])]
fn levenberg_marquardt(bencher: Bencher<'_, '_>, n: usize) {
    let problem = Rows::new(n);
    bencher.bench_local(|| lm::solve(&problem, &[0.0; P], &lm::Options::default()));
}

#[divan::bench(args = [1042])]
fn levenberg_marquardt_by_qr(bencher: Bencher<'_, '_>, n: usize) {
    let problem = Rows::new(n);
    let options = lm::Options {
        factorisation: truegrind::estimation::least_squares::Factorisation::Qr,
        ..Default::default()
    };
    bencher.bench_local(|| lm::solve(&problem, &[0.0; P], &options));
}

#[divan::bench(args = [1042])]
fn chaotic_levenberg_marquardt(bencher: Bencher<'_, '_>, n: usize) {
    let problem = Rows::new(n);
    bencher.bench_local(|| ltlm::solve(&problem, &[0.0; P], &ltlm::Options::default()));
}

#[divan::bench(args = [1042])]
fn streamed_triangular_factor(bencher: Bencher<'_, '_>, n: usize) {
    let problem = Rows::new(n);
    bencher.bench_local(|| triangular_factor(&problem, &[0.01; P], &[1.0; P]));
}

#[divan::bench(args = [100])]
fn extended_kalman_filter(bencher: Bencher<'_, '_>, n: usize) {
    let problem = Rows::new(n);
    bencher.bench_local(|| ekf::solve(&problem, &[0.0; P], &ekf::Options::default()));
}

#[divan::bench(args = [100])]
fn unscented_kalman_filter(bencher: Bencher<'_, '_>, n: usize) {
    let problem = Rows::new(n);
    bencher.bench_local(|| ukf::solve(&problem, &[0.0; P], &ukf::Options::default()));
}

#[divan::bench(args = [100])]
fn recursive_least_squares(bencher: Bencher<'_, '_>, n: usize) {
    let problem = Rows::new(n);
    bencher.bench_local(|| rls::solve(&problem, &[0.0; P], &rls::Options::default()));
}

/// Rows of the recipe that the experiments ship with, and the 24 link parameters with known frames.
mod arm {
    use truegrind::arm::estimated::Estimated;
    use truegrind::arm::model::Model;
    use truegrind::arm::parameter::link_parameters;
    use truegrind::calibration::identification::calibration::{CalibrationProblem, Weight};
    use truegrind::calibration::identification::fit::{Start, fit, frame_parameters};
    use truegrind::calibration::identification::identify::{Options, identify, prepare_observations};
    use truegrind::calibration::identification::solver::SOLVERS;
    use truegrind::calibration::identification::start::candidate_frames;
    use truegrind::calibration::identification::tolerance::Tolerance;
    use truegrind::calibration::measurement::dataset::Dataset;
    use truegrind::calibration::measurement::{import, split};
    use truegrind::papers::experiment::Experiment;
    use truegrind::papers::simulated;

    fn nominal(name: &str) -> Result<Model, String> {
        truegrind::robots::load(name).map(|r| r.model).map_err(|e| e.to_string())
    }

    /// The first `rows` cable rows as the papers set them up.
    pub(super) fn cable(rows: usize) -> CalibrationProblem {
        let experiment = Experiment::by_name("ltlm-table-6").expect("ships");
        let (dataset, simulation, _) = simulated::measure(&experiment, nominal).expect("ships");
        let dataset = dataset.subset(&(0..rows).collect::<Vec<_>>());
        let model = simulation.nominal;
        let frames = candidate_frames(&dataset, &model).expect("placed").remove(0);
        let (observed, _) = prepare_observations(&dataset, &model, false);
        let start = Start { model: &model, frames: &frames };
        let sensing = frame_parameters(&dataset);
        let fitted = fit(&observed, start, &sensing, &Tolerance::default(), &SOLVERS[0], 0);
        let parameters = link_parameters(&model);
        let priors = Tolerance::default().priors(&parameters, &model);
        let weights = vec![Weight { per_mm: 1.0, per_rad: 1.0 }; rows];
        CalibrationProblem::new(&dataset, &model, &fitted.frames, &parameters, &priors, &weights)
    }

    /// A model and the rows that it comes from: a draw-wire, a tracker, or a tracker with full poses.
    pub(super) fn measured(sensor: &str) -> (Estimated, Dataset) {
        let (robot, csv) = match sensor {
            "cable" => ("abb-irb-120", include_str!("../tests/data/irb120-cable.csv").to_owned()),
            "position" => ("abb-irb-120", include_str!("../tests/data/irb120-tracker.csv").to_owned()),
            _ => {
                let recipe = simulated::recipe("tx60-pose", "bench").expect("ships");
                ("staubli-tx60", recipe.simulate(nominal).expect("measured").csv)
            }
        };
        let dataset = import::read("rows.csv", csv.as_bytes(), &import::Options::default()).expect("read");
        let model = nominal(robot).expect("in the catalogue");
        let frames = candidate_frames(&dataset, &model).expect("placed").remove(0);
        let options = Options {
            tolerance: Tolerance::default(),
            solver: &SOLVERS[0],
            held_out: 0.2,
            seed: 0,
            fuse_readout: false,
            limit_rmse_mm: None,
            limit_max_mm: None,
            stated_frames: None,
        };
        let division = |d: &Dataset| split::random(d, 0.2, 0);
        let found = identify(&dataset, robot, &model, &frames, &division, &options).expect("identified");
        (found.estimated, dataset)
    }
}

/// Every method on 100 cable rows of an arm, as the papers set it up: seconds of the whole search.
#[divan::bench(args = truegrind::calibration::identification::solver::all().map(|s| s.name).collect::<Vec<_>>())]
fn method_on_100_cable_rows(bencher: Bencher<'_, '_>, name: &str) {
    let problem = arm::cable(100);
    let solver = truegrind::calibration::identification::solver::by_name(name).expect("in the list");
    bencher.bench_local(|| solver.solve(&problem, &[0.0; 24], 0));
}

/// One pose taken in by a track: process noise, linearisation, update.
#[divan::bench(args = ["cable", "position", "pose"])]
fn track_one_pose(bencher: Bencher<'_, '_>, sensor: &str) {
    use truegrind::calibration::tracking::{Options, Tracker};
    let (model, dataset) = arm::measured(sensor);
    let mut tracker = Tracker::begin(&model, "bench", &dataset, &Options::default()).expect("placed");
    let problem = tracker.prepare(&dataset);
    let mut pose = 0;
    bencher.bench_local(|| {
        pose = (pose + 1) % dataset.rows.len();
        tracker.update(&problem, pose)
    });
}
