//! Tests of `math::axpy`.

use nalgebra::DMatrix;
use rand::RngExt;
use truegrind_math::axpy::add_scaled;
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
