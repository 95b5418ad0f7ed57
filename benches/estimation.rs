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
