//! Rounding to whole numbers.

/// [`f64::round`], inline: without a rounding instruction, which the oldest machines that we compile for lack, that is a call of a
/// routine, and a program of a thousand targets rounds twenty thousand times.
///
/// ```
/// use truegrind_math::rounding::round;
///
/// assert_eq!([-2.5, -0.4, 0.5, 1.4999, 2.5, 4e15 + 0.5].map(round), [-3.0, -0.0, 1.0, 1.0, 3.0, 4e15 + 1.0]);
/// ```
#[inline]
pub fn round(value: f64) -> f64 {
    // From here on doubles are whole numbers; added to a smaller one, it leaves the nearest whole number, of two the even one.
    const WHOLE: f64 = (1_u64 << 52) as f64;
    let size = value.abs();
    if !(size < WHOLE) {
        return value;
    }
    let nearest = (size + WHOLE) - WHOLE;
    let up = if size - nearest == 0.5 { 1.0 } else { 0.0 };
    (nearest + up).copysign(value)
}
