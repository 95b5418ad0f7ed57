//! Tests of `math::lanes`.

use rand::RngExt;
use truegrind_math::lanes::{
    AnyWidth, Instructions, Real, SinCos, WIDTH, sin_cos, vectorised, with_instructions,
};

use super::arms::generator;

/// Distance in units in the last place of a number of the size of `scale`.
fn ulps(a: f64, b: f64) -> f64 {
    (a - b).abs() / (f64::EPSILON * b.abs().max(f64::MIN_POSITIVE))
}

fn arguments() -> Vec<f64> {
    let mut random = generator(11);
    let mut out = vec![0.0, -0.0, 1e-300, -1e-20, 1e-8, 0.5, 1.0, -1.0, 3.0, 99_999.0, -99_999.9];
    for k in -200..=200 {
        let x = f64::from(k) * std::f64::consts::FRAC_PI_4;
        out.extend([x, x.next_up(), x.next_down()]);
    }
    out.extend((0..20_000).map(|_| random.random_range(-10.0..10.0)));
    out.extend((0..5_000).map(|_| random.random_range(-1e5..1e5)));
    out
}

#[test]
fn sine_and_cosine_agree_with_the_standard_library() {
    for x in arguments() {
        let ((s, c), (sine, cosine)) = (sin_cos(x), x.sin_cos());
        // Near a zero of the function the reduction's absolute error counts, which grows with the argument.
        let absolute = 1e-25 * x.abs() + 3e-33;
        assert!(ulps(s, sine) <= 2.0 || (s - sine).abs() <= absolute, "sin {x}: {s} instead of {sine}");
        assert!(ulps(c, cosine) <= 2.0 || (c - cosine).abs() <= absolute, "cos {x}: {c} instead of {cosine}");
    }
}

#[test]
fn what_has_no_short_reduction_goes_through_the_standard_library() {
    for x in [1e5, -1e6, 1e9, 1e22, f64::MAX, f64::MIN] {
        assert_eq!(sin_cos(x), x.sin_cos());
    }
    for x in [f64::NAN, f64::INFINITY, f64::NEG_INFINITY] {
        let (s, c) = sin_cos(x);
        assert!(s.is_nan() && c.is_nan());
    }
}

/// What a kernel makes of one column, on one set of instructions.
struct OfColumns<'a, F>(&'a [f64], F);

/// A function of numbers that works at any width: two numbers of one.
trait OfOne {
    fn of<R: SinCos>(x: R) -> [R; 2];
}

impl<F: OfOne> AnyWidth for OfColumns<'_, F> {
    type Output = [Vec<f64>; 2];

    fn run<R: SinCos>(self, like: R) -> Self::Output {
        let mut out = [vec![0.0; self.0.len()], vec![0.0; self.0.len()]];
        for from in (0..self.0.len()).step_by(R::ROWS) {
            let found = F::of(like.load(self.0, from));
            found[0].store(&mut out[0], from);
            found[1].store(&mut out[1], from);
        }
        out
    }
}

fn bits(columns: &[Vec<f64>; 2]) -> Vec<u64> {
    columns.iter().flatten().map(|v| v.to_bits()).collect()
}

/// Every set of instructions that the machine has gives the bits of one row at a time, NaN and infinities included.
fn assert_same_bits<F: OfOne + Copy>(values: &[f64], f: F) {
    let alone = OfColumns(values, f).run(0.0);
    for set in Instructions::available() {
        let together = with_instructions(set, || vectorised(OfColumns(values, f)));
        assert_eq!(bits(&together), bits(&alone), "{set:?}");
    }
}

/// Odd values among even ones, wherever they stand in a register.
fn with_odd_values() -> Vec<f64> {
    let mut values = arguments();
    for (k, odd) in [f64::NAN, f64::INFINITY, 1e6, 1e300, f64::NEG_INFINITY].into_iter().enumerate() {
        values.insert(100 + 9 * k, odd);
    }
    values
}

#[derive(Clone, Copy)]
struct Sines;
impl OfOne for Sines {
    fn of<R: SinCos>(x: R) -> [R; 2] {
        let (sine, cosine) = sin_cos(x);
        [sine, cosine]
    }
}

#[test]
fn sines_side_by_side_are_the_bits_of_sines_one_by_one() {
    assert_same_bits(&with_odd_values(), Sines);
}

/// The arithmetic of a kernel in which every product would be fused if any were.
#[derive(Clone, Copy)]
struct Arithmetic;
impl OfOne for Arithmetic {
    fn of<R: SinCos>(x: R) -> [R; 2] {
        let y = x * x.splat(0.3) + x.splat(1.7);
        let mut sum = (x * y - y / x).sqrt() + -x;
        sum += y * y;
        sum -= x * y;
        [sum, x.within(2.0) + y.positive() * x.splat(0.5) + x.each(|x| x.tanh())]
    }
}

/// Products and sums are fused on no set of instructions: lanes give the bits of one row, and those of plain arithmetic.
#[test]
fn arithmetic_in_lanes_is_arithmetic_of_each_lane() {
    let values: Vec<f64> = with_odd_values().into_iter().filter(|v| *v != 0.0).collect();
    assert_same_bits(&values, Arithmetic);
    for x in [0.7, -3.1, 12.0_f64] {
        let y = x * 0.3 + 1.7;
        let mut sum = (x * y - y / x).sqrt() + -x;
        sum += y * y;
        sum -= x * y;
        assert_eq!(Arithmetic::of(x)[0].to_bits(), sum.to_bits());
    }
    assert_eq!((f64::NAN.within(1.0), f64::NAN.positive(), 0.0.positive()), (0.0, 0.0, 0.0));
}

/// Reads and writes at the border of a column, and says what lies above.
struct Borders;
impl AnyWidth for Borders {
    type Output = (Vec<f64>, Vec<f64>, [bool; 4]);

    fn run<R: SinCos>(self, like: R) -> Self::Output {
        let short = [1.0, 2.0, 3.0];
        let mut read = [0.0; WIDTH];
        for from in (0..WIDTH).step_by(R::ROWS) {
            like.load(&short, 1 + from).store(&mut read, from);
        }
        let mut written = [9.0; 3];
        for from in (0..WIDTH).step_by(R::ROWS) {
            like.splat(from as f64).each(|v| v + 1.0).store(&mut written, from);
        }
        let nothing = like.load(&[], 0).any_above(0.0);
        let any = like.splat(-2.0).any_above(1.0);
        let none = like.splat(f64::NAN).any_above(1.0);
        let equal = like.splat(1.0).any_above(1.0);
        (read.to_vec(), written.to_vec(), [nothing, any, none, equal])
    }
}

#[test]
fn a_short_column_repeats_its_last_value_and_is_written_as_far_as_it_goes() {
    for set in Instructions::available() {
        let (read, written, above) = with_instructions(set, || vectorised(Borders));
        assert_eq!(read, [2.0, 3.0, 3.0, 3.0, 3.0, 3.0, 3.0, 3.0], "{set:?}");
        assert_eq!(written.iter().filter(|v| **v == 9.0).count(), 0, "{set:?}");
        assert_eq!(above, [false, true, false, false], "{set:?}");
    }
}

/// What is demanded holds for as long as the work lasts, also where that ends in a panic.
#[test]
fn demanded_instructions_hold_for_the_work_alone() {
    struct Rows;
    impl AnyWidth for Rows {
        type Output = usize;
        fn run<R: SinCos>(self, _: R) -> usize {
            R::ROWS
        }
    }
    let before = vectorised(Rows);
    let panicked =
        std::panic::catch_unwind(|| with_instructions(Instructions::Scalar, || panic!("on purpose")));
    assert!(panicked.is_err());
    assert_eq!(vectorised(Rows), before);
    assert_eq!(with_instructions(Instructions::Scalar, || vectorised(Rows)), 1);
    let sets = Instructions::available();
    assert!(sets.contains(&Instructions::Scalar) && sets.contains(&Instructions::Widest));
    for (set, rows) in [(Instructions::Avx2, 4), (Instructions::Avx512, 8)] {
        if sets.contains(&set) {
            assert_eq!(with_instructions(set, || vectorised(Rows)), rows);
        }
    }
}
