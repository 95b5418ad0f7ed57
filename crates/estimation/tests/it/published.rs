//! Test problems of Moré, Garbow and Hillstrom, "Testing unconstrained optimization software", ACM TOMS 7
//! (1981), with the numbers of that paper.

use truegrind_estimation::problem::Problem;

use super::residuals::{Dual, rows};

/// A problem with its standard start and the published minima of Σ r² (not halved).
pub(crate) struct Published {
    pub(crate) name: &'static str,
    pub(crate) problem: Box<dyn Problem>,
    pub(crate) start: Vec<f64>,
    pub(crate) minima: Vec<f64>,
}

fn published<F>(name: &'static str, start: &[f64], m: usize, minima: &[f64], formula: F) -> Published
where
    F: Fn(&[Dual], usize) -> Dual + Sync + 'static,
{
    let problem = Box::new(rows(start.len(), m, formula));
    Published { name, problem, start: start.to_vec(), minima: minima.to_vec() }
}

pub(crate) fn rosenbrock() -> Published {
    published("Rosenbrock", &[-1.2, 1.0], 2, &[0.0], |x, i| match i {
        0 => 10.0 * (x[1] - x[0] * x[0]),
        _ => 1.0 - x[0],
    })
}

/// All problems used here.
pub(crate) fn all() -> Vec<Published> {
    const BARD: [f64; 15] =
        [0.14, 0.18, 0.22, 0.25, 0.29, 0.32, 0.35, 0.39, 0.37, 0.58, 0.73, 0.96, 1.34, 2.10, 4.39];
    const GAUSSIAN: [f64; 8] = [0.0009, 0.0044, 0.0175, 0.0540, 0.1295, 0.2420, 0.3521, 0.3989];
    const MEYER: [f64; 16] = [
        34780.0, 28610.0, 23650.0, 19630.0, 16370.0, 13720.0, 11540.0, 9744.0, 8261.0, 7030.0, 6005.0,
        5147.0, 4427.0, 3820.0, 3307.0, 2872.0,
    ];
    const KOWALIK: [(f64, f64); 11] = [
        (0.1957, 4.0),
        (0.1947, 2.0),
        (0.1735, 1.0),
        (0.1600, 0.5),
        (0.0844, 0.25),
        (0.0627, 0.167),
        (0.0456, 0.125),
        (0.0342, 0.1),
        (0.0323, 0.0833),
        (0.0235, 0.0714),
        (0.0246, 0.0625),
    ];
    const OSBORNE: [f64; 33] = [
        0.844, 0.908, 0.932, 0.936, 0.925, 0.908, 0.881, 0.850, 0.818, 0.784, 0.751, 0.718, 0.685, 0.658,
        0.628, 0.603, 0.580, 0.558, 0.538, 0.522, 0.506, 0.490, 0.478, 0.467, 0.457, 0.448, 0.438, 0.431,
        0.424, 0.420, 0.414, 0.411, 0.406,
    ];
    vec![
        rosenbrock(),
        published("Freudenstein and Roth", &[0.5, -2.0], 2, &[0.0, 48.9842], |x, i| match i {
            0 => -13.0 + x[0] + ((5.0 - x[1]) * x[1] - 2.0) * x[1],
            _ => -29.0 + x[0] + ((x[1] + 1.0) * x[1] - 14.0) * x[1],
        }),
        published("Powell badly scaled", &[0.0, 1.0], 2, &[0.0], |x, i| match i {
            0 => 1e4 * x[0] * x[1] - 1.0,
            _ => (-x[0]).exp() + (-x[1]).exp() - 1.0001,
        }),
        published("Brown badly scaled", &[1.0, 1.0], 3, &[0.0], |x, i| match i {
            0 => x[0] - 1e6,
            1 => x[1] - 2e-6,
            _ => x[0] * x[1] - 2.0,
        }),
        published("Beale", &[1.0, 1.0], 3, &[0.0], |x, i| {
            [1.5, 2.25, 2.625][i] - x[0] * (1.0 - x[1].powi(i as i32 + 1))
        }),
        published("Jennrich and Sampson", &[0.3, 0.4], 10, &[124.362], |x, i| {
            let t = (i + 1) as f64;
            2.0 + 2.0 * t - ((t * x[0]).exp() + (t * x[1]).exp())
        }),
        published("Helical valley", &[-1.0, 0.0, 0.0], 3, &[0.0], |x, i| {
            let turn = (x[1] / x[0]).atan() / (2.0 * std::f64::consts::PI);
            let turn = if x[0].value < 0.0 { turn + 0.5 } else { turn };
            match i {
                0 => 10.0 * (x[2] - 10.0 * turn),
                1 => 10.0 * ((x[0] * x[0] + x[1] * x[1]).sqrt() - 1.0),
                _ => x[2],
            }
        }),
        published("Bard", &[1.0, 1.0, 1.0], 15, &[8.21487e-3], |x, i| {
            let (u, v) = ((i + 1) as f64, (15 - i) as f64);
            BARD[i] - (x[0] + u / (v * x[1] + u.min(v) * x[2]))
        }),
        published("Gaussian", &[0.4, 1.0, 0.0], 15, &[1.12793e-8], |x, i| {
            let t = (7.0 - i as f64) / 2.0;
            x[0] * (-x[1] * (t - x[2]).powi(2) / 2.0).exp() - GAUSSIAN[i.min(14 - i)]
        }),
        published("Meyer", &[0.02, 4000.0, 250.0], 16, &[87.9458], |x, i| {
            let t = 45.0 + 5.0 * (i + 1) as f64;
            x[0] * (x[1] / (t + x[2])).exp() - MEYER[i]
        }),
        published("Box three-dimensional", &[0.0, 10.0, 20.0], 10, &[0.0], |x, i| {
            let t = 0.1 * (i + 1) as f64;
            (-t * x[0]).exp() - (-t * x[1]).exp() - x[2] * ((-t).exp() - (-10.0 * t).exp())
        }),
        published("Powell singular", &[3.0, -1.0, 0.0, 1.0], 4, &[0.0], |x, i| match i {
            0 => x[0] + 10.0 * x[1],
            1 => 5.0_f64.sqrt() * (x[2] - x[3]),
            2 => (x[1] - 2.0 * x[2]).powi(2),
            _ => 10.0_f64.sqrt() * (x[0] - x[3]).powi(2),
        }),
        published("Wood", &[-3.0, -1.0, -3.0, -1.0], 6, &[0.0], |x, i| match i {
            0 => 10.0 * (x[1] - x[0] * x[0]),
            1 => 1.0 - x[0],
            2 => 90.0_f64.sqrt() * (x[3] - x[2] * x[2]),
            3 => 1.0 - x[2],
            4 => 10.0_f64.sqrt() * (x[1] + x[3] - 2.0),
            _ => 0.1_f64.sqrt() * (x[1] - x[3]),
        }),
        published("Kowalik and Osborne", &[0.25, 0.39, 0.415, 0.39], 11, &[3.07505e-4], |x, i| {
            let (y, u) = KOWALIK[i];
            y - x[0] * (u * u + u * x[1]) / (u * u + u * x[2] + x[3])
        }),
        published("Brown and Dennis", &[25.0, 5.0, -5.0, -1.0], 20, &[85822.2], |x, i| {
            let t = (i + 1) as f64 / 5.0;
            (x[0] + t * x[1] - t.exp()).powi(2) + (x[2] + x[3] * t.sin() - t.cos()).powi(2)
        }),
        published("Osborne 1", &[0.5, 1.5, -1.0, 0.01, 0.02], 33, &[5.46489e-5], |x, i| {
            let t = 10.0 * i as f64;
            OSBORNE[i] - (x[0] + x[1] * (-t * x[3]).exp() + x[2] * (-t * x[4]).exp())
        }),
        published("Watson 6", &[0.0; 6], 31, &[2.28767e-3], watson),
        published("Watson 9", &[0.0; 9], 31, &[1.39976e-6], watson),
        published("linear, full rank", &[1.0; 5], 20, &[15.0], |x, i| {
            let mean = x.iter().fold(Dual::from(0.0), |sum, x| sum + *x) * (2.0 / 20.0);
            if i < 5 { x[i] - mean - 1.0 } else { -mean - 1.0 }
        }),
        published("linear, rank 1", &[1.0; 5], 20, &[20.0 * 19.0 / (2.0 * 41.0)], |x, i| {
            let sum = x.iter().enumerate().fold(Dual::from(0.0), |sum, (k, x)| sum + (k + 1) as f64 * *x);
            (i + 1) as f64 * sum - 1.0
        }),
    ]
}

fn watson(x: &[Dual], i: usize) -> Dual {
    match i {
        0..29 => {
            let t = (i + 1) as f64 / 29.0;
            let (mut slope, mut sum) = (Dual::from(0.0), Dual::from(0.0));
            for (j, x) in x.iter().enumerate() {
                sum = sum + *x * t.powi(j as i32);
                if j > 0 {
                    slope = slope + j as f64 * t.powi(j as i32 - 1) * *x;
                }
            }
            slope - sum * sum - 1.0
        }
        29 => x[0],
        _ => x[1] - x[0] * x[0] - 1.0,
    }
}
