//! Tests of `math::axpy`.

use nalgebra::DMatrix;
use rand::RngExt;
use truegrind_math::axpy::{Entry, add_scaled, add_sparse_product};
use truegrind_math::lanes::{Instructions, with_instructions};

use super::arms::generator;

/// Columns of every length, whole registers and parts of them, give the sums of the plain loop to the bit on every set of
/// instructions.
#[test]
fn sums_are_those_of_the_plain_loop_on_every_set_of_instructions() {
    let mut random = generator(17);
    for rows in [0, 1, 3, 7, 8, 9, 31, 200] {
        let columns = DMatrix::from_fn(rows, 5, |_, _| random.random_range(-1.0..1.0));
        let before: Vec<f64> = (0..rows).map(|_| random.random_range(-1.0..1.0)).collect();
        let terms = [(3, 0.3), (0, -1.7), (3, 1e-9), (4, 1e9)];
        let mut plain = before.clone();
        for (k, factor) in terms {
            plain.iter_mut().zip(columns.column(k).iter()).for_each(|(sum, number)| *sum += factor * number);
        }
        for set in Instructions::available() {
            let mut sum = before.clone();
            with_instructions(set, || add_scaled(&terms, columns.as_slice(), &mut sum));
            assert_eq!(sum, plain, "{rows} rows: {set:?}");
        }
    }
}

/// A sparse product is that of the whole matrix, to the bit on every set of instructions.
#[test]
fn a_sparse_product_is_that_of_the_matrix() {
    let mut random = generator(18);
    for rows in [1, 8, 13, 111] {
        let columns = DMatrix::from_fn(rows, 40, |_, _| random.random_range(-1.0..1.0));
        let sparse = DMatrix::from_fn(40, 9, |from, to| {
            if (3 * from + to) % 5 == 0 { random.random_range(-1.0..1.0) } else { 0.0 }
        });
        let by_row = (0..40).flat_map(|from| (0..9).map(move |to| (from, to)));
        let entries: Vec<Entry> = by_row
            .map(|(from, to)| Entry { from, to, factor: sparse[(from, to)] })
            .filter(|entry| entry.factor != 0.0)
            .collect();
        let mut plain = DMatrix::<f64>::zeros(rows, 9);
        for to in 0..9 {
            for from in 0..40 {
                plain
                    .column_mut(to)
                    .zip_apply(&columns.column(from), |sum, v| *sum += sparse[(from, to)] * v);
            }
        }
        for set in Instructions::available() {
            let mut sums = DMatrix::zeros(rows, 9);
            with_instructions(set, || {
                add_sparse_product(rows, &entries, columns.as_slice(), sums.as_mut_slice());
            });
            assert_eq!(sums, plain, "{rows} rows: {set:?}");
        }
    }
}
