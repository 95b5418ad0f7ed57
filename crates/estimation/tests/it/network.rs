//! The radial basis function network: a linear problem, smooth between its samples, silent outside.

use truegrind_estimation::network::rbf::{self, Options, Task};
use truegrind_estimation::problem::Problem;
use truegrind_math::difference::jacobian;
use truegrind_math::lanes::{AnyWidth, Instructions, SinCos, WIDTH, vectorised, with_instructions};
use truegrind_math::radial;

/// A smooth field of two outputs over the unit square.
fn field(u: &[f64; 2]) -> [f64; 2] {
    [(2.0 * u[0]).sin() * u[1], 0.5 - u[0] * u[1]]
}

/// Rows that each see one direction of the field, as a cable would.
fn seen(points: &[[f64; 2]]) -> (Vec<f64>, Vec<f64>) {
    let mut factors = Vec::new();
    let mut targets = Vec::new();
    for (i, u) in points.iter().enumerate() {
        let angle = 2.4 * i as f64;
        let direction = [angle.cos(), angle.sin()];
        let y = field(u);
        factors.extend(direction);
        targets.push(direction[0] * y[0] + direction[1] * y[1]);
    }
    (factors, targets)
}

fn grid(n: usize, shift: f64) -> Vec<[f64; 2]> {
    let at = |i: usize| (i as f64 + shift) / (n as f64 - 1.0);
    (0..n * n).map(|k| [at(k / n), at(k % n)]).collect()
}

#[test]
fn learns_a_smooth_field_from_rows_that_see_one_direction_each() {
    let points = grid(20, 0.0);
    let (factors, targets) = seen(&points);
    let weigh = |v: Vec<f64>| v.into_iter().map(|v| v / 1e-3).collect::<Vec<_>>();
    // A field this smooth wants bumps that reach far: with three fill distances 80 of them are off by 0.1.
    let options = Options { centres: 80, reach: 12.0, weight_sigma: 10.0, ..Options::default() };
    let task = Task::new(points, weigh(factors), weigh(targets), &options);
    let estimate = rbf::solve(&task, &vec![0.0; task.parameters()], &options);
    assert!(estimate.termination.is_converged(), "{}", estimate.termination);
    let network = task.network(&estimate.x);
    for u in grid(9, 0.3).into_iter().filter(|u| u.iter().all(|v| (0.15..0.85).contains(v))) {
        let (y, known) = (network.value(&u).unwrap(), field(&u));
        assert!((y[0] - known[0]).abs() < 0.02 && (y[1] - known[1]).abs() < 0.02, "{u:?}: {y:?} {known:?}");
    }
    // Beyond the reach of every centre it is not asked.
    assert_eq!(network.value(&[9.0, 9.0]), None);
}

#[test]
fn as_printed_it_interpolates_its_rows_noise_included() {
    let points = grid(5, 0.0);
    let targets: Vec<f64> = (0..25).map(|i| ((i * 37) % 11) as f64 / 11.0 - 0.5).collect();
    let options = Options { weight_sigma: 1e6, ..Options::as_printed() };
    let task = Task::new(points.clone(), vec![1.0; 25], targets.clone(), &options);
    assert_eq!(task.layout.centres.len(), 25);
    let estimate = rbf::solve(&task, &[0.0; 25], &options);
    let network = task.network(&estimate.x);
    for (u, target) in points.iter().zip(&targets) {
        assert!((network.value(u).unwrap()[0] - target).abs() < 1e-4);
    }
}

#[test]
fn is_linear_and_its_jacobian_has_a_twin() {
    let points = grid(6, 0.0);
    let (factors, targets) = seen(&points);
    let task = Task::new(points, factors, targets, &Options { centres: 7, ..Options::default() });
    let (n, p) = (task.rows(), task.parameters());
    assert_eq!((n, p), (36, 14));
    let x: Vec<f64> = (0..p).map(|k| 0.3 - 0.07 * k as f64).collect();
    let (mut r, mut j) = (vec![0.0; n], vec![0.0; n * p]);
    task.jacobian(&x, 0..n, &mut r, &mut j);
    let twin = jacobian(|x, out| task.residuals(x, 0..n, out), &x, n, &vec![1e-2; p]);
    assert!(j.iter().zip(twin.iter()).all(|(a, b)| (a - b).abs() < 1e-10));
}

/// The bump at eight points.
struct Bumps<'a> {
    columns: &'a [[f64; WIDTH]; 3],
    centre: &'a [f64; 3],
}

impl AnyWidth for Bumps<'_> {
    type Output = [f64; WIDTH];

    fn run<R: SinCos>(self, like: R) -> [f64; WIDTH] {
        let mut out = [0.0; WIDTH];
        for from in (0..WIDTH).step_by(R::ROWS) {
            let points: [R; 3] = std::array::from_fn(|k| like.load(&self.columns[k], from));
            radial::wendland(&points, self.centre, 0.5).store(&mut out, from);
        }
        out
    }
}

#[test]
fn the_bump_ends_at_its_reach_and_is_the_same_in_lanes() {
    let centre = [0.1, -0.2, 0.3];
    assert_eq!(radial::wendland(&centre, &centre, 0.5), 1.0);
    assert_eq!(radial::wendland(&[0.1, -0.2, 0.8], &centre, 0.5), 0.0);
    assert_eq!(radial::wendland(&[7.0, 8.0, 9.0], &centre, 0.5), 0.0);
    let row = |i: usize| [0.05 * i as f64, -0.1, 0.2 + 0.03 * i as f64];
    let columns: [[f64; WIDTH]; 3] = std::array::from_fn(|k| std::array::from_fn(|i| row(i)[k]));
    for i in 0..WIDTH {
        let alone: f64 = radial::wendland(&row(i), &centre, 0.5);
        for set in Instructions::available() {
            let together =
                with_instructions(set, || vectorised(Bumps { columns: &columns, centre: &centre }));
            assert_eq!(alone.to_bits(), together[i].to_bits());
        }
        let step = [0.3, -0.2, 0.1];
        let slope: f64 = radial::wendland_slope(&row(i), &centre, 0.5, &step);
        let moved = |t: f64| {
            let u: [f64; 3] = std::array::from_fn(|k| row(i)[k] + t * step[k]);
            radial::wendland::<f64, 3>(&u, &centre, 0.5)
        };
        assert!((slope - (moved(1e-5) - moved(-1e-5)) / 2e-5).abs() < 1e-8);
    }
}

#[test]
fn spread_out_points_are_far_apart_and_nothing_is_far_from_them() {
    let points = grid(10, 0.0);
    let (centres, fill) = radial::farthest_point_sample(&points, 9);
    assert_eq!(centres.len(), 9);
    let far =
        points.iter().map(|p| centres.iter().map(|c| radial::distance(p, c)).fold(f64::INFINITY, f64::min));
    assert_eq!(far.fold(0.0, f64::max), fill);
    assert!(fill < 0.45);
    // More centres than points: each once.
    assert_eq!(radial::farthest_point_sample(&points, 500).0.len(), 100);
}
