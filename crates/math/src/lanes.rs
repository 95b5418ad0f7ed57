//! One arithmetic for one row or for eight: kinematics written once over [`Real`] runs on `f64` and, with eight rows
//! side by side, on [`Lanes`].
//!
//! Products and sums are never fused, so a row gives the same bits alone, in lanes, and on any processor. The loops
//! over eight entries become vector instructions when the caller runs them inside [`vectorised`], which picks the
//! widest instruction set of the machine at run time (safe: through `pulp`, no flag at build time).

use std::ops::{Add, AddAssign, Div, Mul, Neg, Sub, SubAssign};

/// Rows that travel together.
pub const WIDTH: usize = 8;

/// What the kinematic kernels ask of a number.
pub trait Real:
    Copy
    + Add<Output = Self>
    + Sub<Output = Self>
    + Mul<Output = Self>
    + Div<Output = Self>
    + Neg<Output = Self>
    + AddAssign
    + SubAssign
{
    /// The same value in every lane.
    fn splat(value: f64) -> Self;
    /// Square root.
    fn sqrt(self) -> Self;
    /// The largest magnitude over the lanes.
    fn max_abs(self) -> f64;
    /// 1 where the magnitude is at most `limit`, 0 elsewhere and for NaN.
    fn within(self, limit: f64) -> Self;
    /// 1 where the value is above 0, 0 elsewhere and for NaN.
    fn positive(self) -> Self;
    /// A function of each lane by itself, for what has no vector form.
    fn each(self, f: impl Fn(f64) -> f64) -> Self;
}

impl Real for f64 {
    #[inline(always)]
    fn splat(value: f64) -> Self {
        value
    }
    #[inline(always)]
    fn sqrt(self) -> Self {
        f64::sqrt(self)
    }
    #[inline(always)]
    fn max_abs(self) -> f64 {
        self.abs()
    }
    #[inline(always)]
    fn within(self, limit: f64) -> Self {
        if self.abs() <= limit { 1.0 } else { 0.0 }
    }
    #[inline(always)]
    fn positive(self) -> Self {
        if self > 0.0 { 1.0 } else { 0.0 }
    }
    #[inline(always)]
    fn each(self, f: impl Fn(f64) -> f64) -> Self {
        f(self)
    }
}

/// Eight rows side by side.
#[derive(Debug, Clone, Copy, PartialEq)]
#[repr(align(64))]
pub struct Lanes(pub [f64; WIDTH]);

// Plain counting: without optimisation the parts of an iterator would all be on the stack, at every operator.
macro_rules! lane_operator {
    ($($trait:ident $method:ident $op:tt),*) => {$(
        impl $trait for Lanes {
            type Output = Self;
            #[inline(always)]
            // The macro has the operator, not its assignment.
            #[allow(clippy::assign_op_pattern)]
            fn $method(self, other: Self) -> Self {
                let mut out = [0.0; WIDTH];
                let mut k = 0;
                while k < WIDTH {
                    out[k] = self.0[k] $op other.0[k];
                    k += 1;
                }
                Self(out)
            }
        }
    )*};
}
lane_operator!(Add add +, Sub sub -, Mul mul *, Div div /);

impl Neg for Lanes {
    type Output = Self;
    #[inline(always)]
    fn neg(self) -> Self {
        let mut out = self.0;
        for o in &mut out {
            *o = -*o;
        }
        Self(out)
    }
}

impl AddAssign for Lanes {
    #[inline(always)]
    fn add_assign(&mut self, other: Self) {
        *self = *self + other;
    }
}

impl SubAssign for Lanes {
    #[inline(always)]
    fn sub_assign(&mut self, other: Self) {
        *self = *self - other;
    }
}

impl Real for Lanes {
    #[inline(always)]
    fn each(self, f: impl Fn(f64) -> f64) -> Self {
        Self(self.0.map(f))
    }
    #[inline(always)]
    fn splat(value: f64) -> Self {
        Self([value; WIDTH])
    }
    #[inline(always)]
    fn sqrt(self) -> Self {
        let mut out = self.0;
        for o in &mut out {
            *o = o.sqrt();
        }
        Self(out)
    }
    #[inline(always)]
    fn max_abs(self) -> f64 {
        self.0.iter().fold(0.0, |m, v| if v.abs() > m { v.abs() } else { m })
    }
    #[inline(always)]
    fn within(self, limit: f64) -> Self {
        let mut out = self.0;
        for o in &mut out {
            *o = o.within(limit);
        }
        Self(out)
    }
    #[inline(always)]
    fn positive(self) -> Self {
        let mut out = self.0;
        for o in &mut out {
            *o = o.positive();
        }
        Self(out)
    }
}

impl Lanes {
    /// Eight neighbours of a column; rows beyond its end repeat the last one.
    #[inline(always)]
    pub fn load(column: &[f64], from: usize) -> Self {
        let mut out = [0.0; WIDTH];
        if let Some(full) = column.get(from..from + WIDTH) {
            out.copy_from_slice(full);
        } else {
            for (k, o) in out.iter_mut().enumerate() {
                *o = column.get(from + k).or(column.last()).copied().unwrap_or(0.0);
            }
        }
        Self(out)
    }
}

impl Lanes {
    /// Writes the lanes to neighbours of a column, as far as the column goes.
    #[inline(always)]
    pub fn store(&self, column: &mut [f64], from: usize) {
        if let Some(full) = column.get_mut(from..from + WIDTH) {
            full.copy_from_slice(&self.0);
        } else {
            for (place, value) in column.iter_mut().skip(from).zip(self.0) {
                *place = value;
            }
        }
    }
}

/// Runs `kernel` compiled for the widest vector instructions of this machine. Everything that it calls must be
/// `#[inline(always)]` to be compiled along with it.
///
/// Products and sums are never fused, so every instruction set gives the same bits; builds with debug assertions
/// compile one set only, which more than halves their time. There what is large need not be inlined, and is not
/// (`cfg_attr`): without optimisation every intermediate result of everything that is inlined has a place of its own on
/// the stack, and all of them together are more than a thread has.
#[inline]
pub fn vectorised<T>(kernel: impl FnOnce() -> T) -> T {
    #[cfg(debug_assertions)]
    return kernel();
    #[cfg(not(debug_assertions))]
    pulp::Arch::new().dispatch(kernel)
}

/// Sine and cosine, eight at once; within 2 units in the last place of the correctly rounded value for |x| < 1e5 rad.
///
/// Method: reduction by π/2 in three parts (Cody and Waite), then the polynomials of fdlibm's kernels on [−π/4, π/4].
/// Larger or not finite arguments go through the standard library.
#[inline(always)]
pub fn sin_cos<R: SinCos>(x: R) -> (R, R) {
    x.sin_cos_wide()
}

/// Numbers that have a sine and a cosine; see [`sin_cos`].
pub trait SinCos: Real {
    /// Sine and cosine.
    fn sin_cos_wide(self) -> (Self, Self);
}

impl SinCos for f64 {
    #[cfg_attr(not(debug_assertions), inline(always))]
    fn sin_cos_wide(self) -> (Self, Self) {
        sin_cos_one(self)
    }
}

impl SinCos for Lanes {
    #[cfg_attr(not(debug_assertions), inline(always))]
    fn sin_cos_wide(self) -> (Self, Self) {
        let (mut s, mut c) = ([0.0; WIDTH], [0.0; WIDTH]);
        for k in 0..WIDTH {
            (s[k], c[k]) = sin_cos_reduced(self.0[k]);
        }
        // The largest magnitude passes NaN by.
        if self.max_abs() >= LARGEST_REDUCED || self.0.iter().any(|v| v.is_nan()) {
            for k in 0..WIDTH {
                (s[k], c[k]) = sin_cos_one(self.0[k]);
            }
        }
        (Self(s), Self(c))
    }
}

/// Up to here three parts of π/2 leave no error that shows.
const LARGEST_REDUCED: f64 = 1.0e5;

#[cfg_attr(not(debug_assertions), inline(always))]
fn sin_cos_one(x: f64) -> (f64, f64) {
    if x.abs() < LARGEST_REDUCED { sin_cos_reduced(x) } else { x.sin_cos() }
}

#[cfg_attr(not(debug_assertions), inline(always))]
#[expect(clippy::excessive_precision, reason = "the constants as fdlibm prints them")]
fn sin_cos_reduced(x: f64) -> (f64, f64) {
    const TWO_OVER_PI: f64 = std::f64::consts::FRAC_2_PI;
    // π/2 in parts of 33 bits, so that k times a part is exact (fdlibm, e_rem_pio2.c).
    const PART_1: f64 = 1.570_796_326_734_125_614_17;
    const PART_2: f64 = 6.077_100_506_303_965_976_60e-11;
    const PART_3: f64 = 2.022_266_248_795_950_631_54e-21;
    // Adding and taking away 1.5·2⁵² rounds to the nearest integer and leaves it in the low bits.
    const ROUND: f64 = 6_755_399_441_055_744.0;
    let shifted = x * TWO_OVER_PI + ROUND;
    let quadrant = shifted.to_bits();
    let k = shifted - ROUND;
    let r = ((x - k * PART_1) - k * PART_2) - k * PART_3;
    let z = r * r;
    let sine = r + r
        * z
        * (-1.666_666_666_666_663_243_48e-1
            + z * (8.333_333_333_322_489_461_24e-3
                + z * (-1.984_126_982_985_794_931_34e-4
                    + z * (2.755_731_370_707_006_767_89e-6
                        + z * (-2.505_076_025_340_686_341_95e-8 + z * 1.589_690_995_211_550_102_21e-10)))));
    let w = 1.0 - 0.5 * z;
    let cosine = w
        + ((1.0 - w) - 0.5 * z)
        + z * z
            * (4.166_666_666_666_660_190_37e-2
                + z * (-1.388_888_888_887_410_957_49e-3
                    + z * (2.480_158_728_947_672_941_78e-5
                        + z * (-2.755_731_435_139_066_330_35e-7
                            + z * (2.087_572_321_298_174_827_90e-9
                                + z * -1.135_964_755_778_819_482_65e-11)))));
    let swap = quadrant & 1 == 1;
    let sine_sign = (quadrant & 2) << 62;
    let cosine_sign = ((quadrant + 1) & 2) << 62;
    let (a, b) = if swap { (cosine, sine) } else { (sine, cosine) };
    (f64::from_bits(a.to_bits() ^ sine_sign), f64::from_bits(b.to_bits() ^ cosine_sign))
}
