//! Rounding to whole numbers, and angles as decimal numbers.

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

/// An angle in degrees, as the shortest decimal number that is the same angle in radians. A file in which angles are so written reads as it
/// was, and 120° is not 119.99999999999999.
///
/// ```
/// use truegrind_math::rounding::degrees;
///
/// let right_angle = std::f64::consts::FRAC_PI_2;
/// assert_eq!([right_angle, 120_f64.to_radians(), -0.05_f64.to_radians()].map(degrees), [90.0, 120.0, -0.05]);
/// ```
pub fn degrees(angle_rad: f64) -> f64 {
    let near = angle_rad.to_degrees();
    let decimal = |digits: i32| {
        let scale = 10_f64.powi(digits);
        (near * scale).round() / scale
    };
    let candidates = (0..=MAX_DIGITS).map(decimal).chain([near, near.next_up(), near.next_down()]);
    candidates.into_iter().find(|degrees| degrees.to_radians() == angle_rad).unwrap_or(near)
}

/// Digits behind the point up to which a double that is an angle may be a short decimal number.
const MAX_DIGITS: i32 = 13;
