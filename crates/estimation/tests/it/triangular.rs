//! The streamed triangular factor, and what is read off it.

use nalgebra::{DMatrix, DVector};
use truegrind_estimation::least_squares::rank::analyse;
use truegrind_estimation::least_squares::triangular::triangular_factor;
use truegrind_estimation::problem::Problem;

use super::levenberg_marquardt::wide;
use super::residuals::{Dual, rows};

#[test]
fn has_the_normal_equations_of_the_whole_jacobian() {
    let (problem, _) = wide(1700);
    let x = vec![0.01; 28];
    let factor = triangular_factor(&problem, &x, &[1.0; 28]);
    let mut normal = problem.normal_equations(&x);
    normal.symmetrize();
    let scale = normal.matrix.norm();
    assert!((factor.r.tr_mul(&factor.r) - &normal.matrix).norm() < 1e-12 * scale);
    assert!((factor.r.tr_mul(&factor.rhs) - &normal.gradient).norm() < 1e-12 * normal.gradient.norm());
    assert!((factor.cost() / normal.cost - 1.0).abs() < 1e-12);
    let inverse = factor.covariance().unwrap();
    assert!((inverse * normal.matrix - DMatrix::identity(28, 28)).norm() < 1e-8);
    let threads = |n| rayon::ThreadPoolBuilder::new().num_threads(n).build().unwrap();
    let one = threads(1).install(|| triangular_factor(&problem, &x, &[1.0; 28]));
    let two = threads(2).install(|| triangular_factor(&problem, &x, &[1.0; 28]));
    assert_eq!(one, two);
}

#[test]
fn sees_singular_values_that_normal_equations_lose() {
    // Läuchli's matrix: JᵀJ rounds ε² away, the triangular factor does not.
    let tiny = 1e-9;
    let problem = rows(2, 3, move |x: &[Dual], i| [x[0] + x[1], tiny * x[0], tiny * x[1]][i]);
    let factor = triangular_factor(&problem, &[0.0, 0.0], &[1.0, 1.0]);
    let analysis = analyse(&factor.r, None).unwrap();
    assert_eq!(analysis.rank, 2);
    assert!((analysis.singular_values[1] / tiny - 1.0).abs() < 1e-6);
    let normal = problem.normal_equations(&[0.0, 0.0]);
    assert_eq!(normal.matrix[(0, 0)] * normal.matrix[(1, 1)] - normal.matrix[(1, 0)].powi(2), 0.0);
}

#[test]
fn names_the_directions_that_no_row_sees() {
    // x₀ and x₂ only as x₀ + 2 x₂, x₃ not at all.
    let row = |x: &[Dual], i: usize| {
        let t = i as f64 / 10.0;
        (x[0] + 2.0 * x[2]) * t + x[1] * t * t + 0.0 * x[3] - 1.0
    };
    let problem = rows(4, 40, row);
    let factor = triangular_factor(&problem, &[1.0; 4], &[1.0; 4]);
    let analysis = analyse(&factor.r, Some(1e-10)).unwrap();
    assert_eq!(analysis.rank, 2);
    let null = analysis.null_space();
    assert_eq!(null.shape(), (4, 2));
    for direction in
        [DVector::from_vec(vec![2.0, 0.0, -1.0, 0.0]), DVector::from_vec(vec![0.0, 0.0, 0.0, 1.0])]
    {
        let inside = &null * null.tr_mul(&direction);
        assert!((inside - &direction).norm() < 1e-10 * direction.norm());
    }
    assert!(factor.covariance().is_none());
}

#[test]
fn scale_multiplies_columns() {
    let (problem, _) = wide(100);
    let x = vec![0.0; 28];
    let plain = triangular_factor(&problem, &x, &[1.0; 28]);
    let scaled = triangular_factor(&problem, &x, &[2.0; 28]);
    assert!((scaled.r - 2.0 * plain.r).norm() < 1e-9);
}

#[test]
fn few_rows_and_bad_rows_are_answered() {
    let few = rows(3, 2, |x: &[Dual], i| x[i] + x[2] - 1.0);
    let factor = triangular_factor(&few, &[0.0; 3], &[1.0; 3]);
    assert!(factor.covariance().is_none());
    assert_eq!(analyse(&factor.r, None).unwrap().rank, 2);
    let none = rows(3, 0, |_: &[Dual], _| Dual::from(0.0));
    assert_eq!(triangular_factor(&none, &[0.0; 3], &[1.0; 3]).r, DMatrix::zeros(3, 3));
    let bad = rows(2, 4, |x: &[Dual], _| x[0] * f64::NAN + x[1]);
    let factor = triangular_factor(&bad, &[1.0; 2], &[1.0; 2]);
    assert!(!factor.is_finite() && analyse(&factor.r, None).is_none());
}
