//! Numerical Jacobians to check analytic ones: central differences with Richardson extrapolation.

use nalgebra::DMatrix;

/// Jacobian of `f` at `x` by central differences with steps `h` and `h/2`, extrapolated (error of order h⁴).
///
/// Shapes: `x` has n entries, `f` fills m entries, the result is m × n. `steps[k]` is the step of `x[k]` in its own
/// unit (suitable: some 1e-2 mm for a length, 1e-4 rad for an angle).
///
/// ```
/// use truegrind_math::difference::jacobian;
///
/// // The end of a link of 300 mm as a function of its angle, with a known derivative at 0.5 rad.
/// let end = |x: &[f64], out: &mut [f64]| out.copy_from_slice(&[300.0 * x[0].cos(), 300.0 * x[0].sin()]);
/// let found = jacobian(end, &[0.5], 2, &[1e-3]);
/// assert!((found[(0, 0)] + 300.0 * 0.5_f64.sin()).abs() < 1e-9);
/// assert!((found[(1, 0)] - 300.0 * 0.5_f64.cos()).abs() < 1e-9);
/// ```
pub fn jacobian(f: impl Fn(&[f64], &mut [f64]), x: &[f64], m: usize, steps: &[f64]) -> DMatrix<f64> {
    let mut out = DMatrix::zeros(m, x.len());
    let (mut at, mut plus, mut minus) = (x.to_vec(), vec![0.0; m], vec![0.0; m]);
    for k in 0..x.len() {
        let mut central = |h: f64, scale: f64, column: &mut [f64]| {
            at[k] = x[k] + h;
            f(&at, &mut plus);
            at[k] = x[k] - h;
            f(&at, &mut minus);
            at[k] = x[k];
            for (c, (p, q)) in column.iter_mut().zip(plus.iter().zip(&minus)) {
                *c += scale * (p - q) / (2.0 * h);
            }
        };
        let mut column = vec![0.0; m];
        central(steps[k], -1.0 / 3.0, &mut column);
        central(steps[k] / 2.0, 4.0 / 3.0, &mut column);
        out.column_mut(k).copy_from_slice(&column);
    }
    out
}
