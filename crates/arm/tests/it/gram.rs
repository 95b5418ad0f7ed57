//! Tests of `math::gram`.

use nalgebra::DMatrix;
use rand::RngExt;
use truegrind_math::gram::add_products;
use truegrind_math::lanes::{Instructions, with_instructions};

use super::arms::generator;

fn matrix(rows: usize, columns: usize) -> DMatrix<f64> {
    let mut random = generator(91);
    DMatrix::from_fn(rows, columns, |_, _| random.random_range(-1.0..1.0))
}

/// Every number of columns, whole tiles and parts of tiles, gives nalgebra's products, added to what was there.
#[test]
fn products_of_columns_are_those_of_the_whole_matrix() {
    for columns in 0..14 {
        for rows in [0, 8, 24, 512] {
            let a = matrix(rows, columns);
            let mut square = DMatrix::repeat(columns, columns, 0.25);
            add_products(a.as_slice(), rows, if rows == 0 { &mut [] } else { square.as_mut_slice() });
            let expected = a.tr_mul(&a);
            for j in 0..columns {
                for i in 0..columns {
                    let gained = square[(i, j)] - 0.25;
                    let wanted = if i >= j { expected[(i, j)] } else { 0.0 };
                    assert!(
                        (gained - wanted).abs() < 1e-13 * rows.max(1) as f64,
                        "{rows} × {columns}: {i}, {j}"
                    );
                }
            }
        }
    }
}

/// A fused product is rounded once wherever it is computed: the sums are the same to the bit on every set of instructions.
#[test]
fn every_set_of_instructions_gives_the_same_products() {
    for columns in [1, 5, 29, 66] {
        let a = matrix(136, columns);
        let found = |set| {
            let mut square = vec![0.0; columns * columns];
            with_instructions(set, || add_products(a.as_slice(), 136, &mut square));
            square.into_iter().map(f64::to_bits).collect::<Vec<_>>()
        };
        let alone = found(Instructions::Scalar);
        for set in Instructions::available() {
            assert!(found(set) == alone, "{columns} columns: {set:?}");
        }
    }
}
