//! SIMD over rows: kinematics written once over [`Real`] runs on `f64` and, with as many rows as a vector register holds, on
//! [`Lanes`].
//!
//! Products and sums are never fused, and every function has one formula for all widths, so a row gives the same bits
//! alone, in lanes, and on any processor. A kernel implements [`AnyWidth`]; [`vectorised`] compiles it for each vector
//! instruction set and selects the widest at run time (safe, through `pulp`, without build flags): AVX-512 has eight rows
//! in a register, AVX2 four, Neon two; other machines process row by row.

use std::cell::Cell;
use std::ops::{Add, AddAssign, Div, Mul, Neg, Sub, SubAssign};
use std::sync::OnceLock;

use pulp::{Arch, Simd, WithSimd};

/// Rows of a group: as many as the widest register holds. Results of work in groups do not depend on the number of rows in a
/// register.
pub const WIDTH: usize = 8;

/// Operations that the kinematic kernels need, on a number or on a register of several.
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
    /// Number of rows in the register; divides [`WIDTH`].
    const ROWS: usize;
    /// The same value in every lane, in a register like this one.
    fn splat(self, value: f64) -> Self;
    /// Consecutive elements of a column, in a register like this one; beyond the end the last one is repeated.
    fn load(self, column: &[f64], from: usize) -> Self;
    /// Writes the lanes to consecutive elements of a column, up to its end.
    fn store(self, column: &mut [f64], from: usize);
    /// Square root.
    fn sqrt(self) -> Self;
    /// Whether the magnitude exceeds `limit` in any lane; false for NaN.
    fn any_above(self, limit: f64) -> bool;
    /// 1 where the magnitude is at most `limit`, 0 elsewhere and for NaN.
    fn within(self, limit: f64) -> Self;
    /// 1 where the value is above 0, 0 elsewhere and for NaN.
    fn positive(self) -> Self;
    /// Applies a function to each lane separately, if there is no vector form.
    fn each(self, f: impl Fn(f64) -> f64) -> Self;
    /// The first numbers of a slice, in a register like this one.
    ///
    /// # Panics
    /// If there are fewer than [`Real::ROWS`].
    fn whole(self, numbers: &[f64]) -> Self;
    /// self · factor + term with a single rounding, at every width; for sums over rows only.
    fn times_plus(self, factor: Self, term: Self) -> Self;
}

impl Real for f64 {
    const ROWS: usize = 1;
    #[inline(always)]
    fn splat(self, value: f64) -> Self {
        value
    }
    #[inline(always)]
    fn load(self, column: &[f64], from: usize) -> Self {
        column.get(from).or(column.last()).copied().unwrap_or(0.0)
    }
    #[inline(always)]
    fn store(self, column: &mut [f64], from: usize) {
        if let Some(place) = column.get_mut(from) {
            *place = self;
        }
    }
    #[inline(always)]
    fn sqrt(self) -> Self {
        f64::sqrt(self)
    }
    #[inline(always)]
    fn any_above(self, limit: f64) -> bool {
        self.abs() > limit
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
    #[inline(always)]
    fn whole(self, numbers: &[f64]) -> Self {
        numbers[0]
    }
    #[inline(always)]
    fn times_plus(self, factor: Self, term: Self) -> Self {
        f64::mul_add(self, factor, term)
    }
}

/// Several rows in one register, with the token that proves that the machine has its instructions.
#[derive(Debug, Clone, Copy)]
pub struct Lanes<S: Simd>(S, S::f64s);

macro_rules! lane_operator {
    ($($trait:ident $method:ident $instruction:ident),*) => {$(
        impl<S: Simd> $trait for Lanes<S> {
            type Output = Self;
            #[inline(always)]
            fn $method(self, other: Self) -> Self {
                Self(self.0, self.0.$instruction(self.1, other.1))
            }
        }
    )*};
}
lane_operator!(Add add add_f64s, Sub sub sub_f64s, Mul mul mul_f64s, Div div div_f64s);

impl<S: Simd> Neg for Lanes<S> {
    type Output = Self;
    #[inline(always)]
    fn neg(self) -> Self {
        Self(self.0, self.0.neg_f64s(self.1))
    }
}

impl<S: Simd> AddAssign for Lanes<S> {
    #[inline(always)]
    fn add_assign(&mut self, other: Self) {
        *self = *self + other;
    }
}

impl<S: Simd> SubAssign for Lanes<S> {
    #[inline(always)]
    fn sub_assign(&mut self, other: Self) {
        *self = *self - other;
    }
}

impl<S: Simd> Lanes<S> {
    /// 1 where the mask is set, 0 elsewhere.
    #[inline(always)]
    fn chosen(self, mask: S::m64s) -> Self {
        let Self(simd, _) = self;
        Self(simd, simd.select_f64s(mask, simd.splat_f64s(1.0), simd.splat_f64s(0.0)))
    }

    /// Lane by lane; all others 0.
    #[inline(always)]
    fn spread(self) -> [f64; WIDTH] {
        let mut out = [0.0; WIDTH];
        out[..S::F64_LANES].copy_from_slice(pulp::bytemuck::cast_slice(std::slice::from_ref(&self.1)));
        out
    }

    /// The first lanes of eight numbers.
    #[inline(always)]
    fn gathered(self, lanes: &[f64; WIDTH]) -> Self {
        match S::as_simd_f64s(&lanes[..S::F64_LANES]).0 {
            [full] => Self(self.0, *full),
            _ => self,
        }
    }
}

/// Up to eight consecutive elements of a column; beyond the end the last one is repeated.
#[cold]
#[inline(never)]
fn load_end(column: &[f64], from: usize) -> [f64; WIDTH] {
    let mut out = [0.0; WIDTH];
    for (k, place) in out.iter_mut().enumerate() {
        *place = column.get(from + k).or(column.last()).copied().unwrap_or(0.0);
    }
    out
}

/// Writes lanes up to the end of a column.
#[cold]
#[inline(never)]
fn store_end(column: &mut [f64], from: usize, lanes: &[f64]) {
    for (place, value) in column.iter_mut().skip(from).zip(lanes) {
        *place = *value;
    }
}

impl<S: Simd> Real for Lanes<S> {
    const ROWS: usize = S::F64_LANES;
    #[inline(always)]
    fn splat(self, value: f64) -> Self {
        Self(self.0, self.0.splat_f64s(value))
    }
    #[inline(always)]
    fn load(self, column: &[f64], from: usize) -> Self {
        if let Some(full) = column.get(from..from + S::F64_LANES)
            && let [full] = S::as_simd_f64s(full).0
        {
            return Self(self.0, *full);
        }
        self.gathered(&load_end(column, from))
    }
    #[inline(always)]
    fn store(self, column: &mut [f64], from: usize) {
        if let Some(full) = column.get_mut(from..from + S::F64_LANES)
            && let [full] = S::as_mut_simd_f64s(full).0
        {
            *full = self.1;
        } else {
            store_end(column, from, &self.spread()[..S::F64_LANES]);
        }
    }
    #[inline(always)]
    fn sqrt(self) -> Self {
        Self(self.0, self.0.sqrt_f64s(self.1))
    }
    #[inline(always)]
    fn any_above(self, limit: f64) -> bool {
        let Self(simd, value) = self;
        let above = simd.greater_than_f64s(simd.abs_f64s(value), simd.splat_f64s(limit));
        simd.first_true_m64s(above) < S::F64_LANES
    }
    #[inline(always)]
    fn within(self, limit: f64) -> Self {
        let Self(simd, value) = self;
        self.chosen(simd.less_than_or_equal_f64s(simd.abs_f64s(value), simd.splat_f64s(limit)))
    }
    #[inline(always)]
    fn positive(self) -> Self {
        let Self(simd, value) = self;
        self.chosen(simd.greater_than_f64s(value, simd.splat_f64s(0.0)))
    }
    #[inline(always)]
    fn each(self, f: impl Fn(f64) -> f64) -> Self {
        let mut lanes = self.spread();
        for lane in &mut lanes[..S::F64_LANES] {
            *lane = f(*lane);
        }
        self.gathered(&lanes)
    }
    #[inline(always)]
    fn whole(self, numbers: &[f64]) -> Self {
        Self(self.0, S::as_simd_f64s(&numbers[..S::F64_LANES]).0[0])
    }
    #[inline(always)]
    fn times_plus(self, factor: Self, term: Self) -> Self {
        Self(self.0, self.0.mul_add_f64s(self.1, factor.1, term.1))
    }
}

/// Numbers aligned so that a register is read from a single cache line, which doubles the speed of memory-bound loops.
#[derive(Debug, Clone, Default)]
pub struct Buffer {
    numbers: Vec<f64>,
    first: usize,
}

impl Buffer {
    /// The first `count` numbers, as they were left; grows with zeros.
    pub fn first_mut(&mut self, count: usize) -> &mut [f64] {
        if self.numbers.len() < self.first + count {
            self.numbers = vec![0.0; count + WIDTH];
            self.first = aligned(&self.numbers);
        }
        &mut self.numbers[self.first..][..count]
    }
}

/// The first index in a column, below [`WIDTH`], from which registers are aligned to cache lines.
pub fn aligned(column: &[f64]) -> usize {
    const LINE_BYTES: usize = WIDTH * size_of::<f64>();
    column.as_ptr().align_offset(LINE_BYTES) % WIDTH
}

/// Numbers that are the same in all rows.
///
/// Kernels use loops instead of `map`: functions that the standard library does not guarantee to inline would be compiled
/// without the vector instructions of their caller.
#[inline(always)]
pub fn splats<R: Real, const N: usize>(like: R, values: &[f64; N]) -> [R; N] {
    let mut out = [like; N];
    for k in 0..N {
        out[k] = like.splat(values[k]);
    }
    out
}

/// A kernel for registers of any width.
pub trait AnyWidth {
    /// Result.
    type Output;
    /// Runs the kernel with registers like `like`, which is 0. Every function that it calls must be `#[inline(always)]` to be
    /// compiled with the same instructions.
    fn run<R: SinCos>(self, like: R) -> Self::Output;
}

/// Runs `kernel` compiled for the widest vector instructions of this machine.
///
/// Products and sums are never fused, so every instruction set gives the same bits. Builds with debug assertions process row
/// by row unless [`with_instructions`] is used. There large functions are not inlined (`cfg_attr`): without optimisation every
/// intermediate result of an inlined function has its own stack slot, which together exceed a thread's stack, and passing
/// registers between functions is slow.
#[inline]
pub fn vectorised<K: AnyWidth>(kernel: K) -> K::Output {
    match cfg!(debug_assertions) {
        true => DEMANDED.get().unwrap_or(Arch::Scalar).dispatch(OnRegisters(kernel)),
        false => widest(kernel),
    }
}

/// Like [`vectorised`], also in builds with debug assertions: for small kernels of this crate, which is always optimised.
#[inline]
pub(crate) fn widest<K: AnyWidth>(kernel: K) -> K::Output {
    static WIDEST: OnceLock<Arch> = OnceLock::new();
    let arch = DEMANDED.get().unwrap_or_else(|| *WIDEST.get_or_init(Arch::new));
    arch.dispatch(OnRegisters(kernel))
}

struct OnRegisters<K>(K);

impl<K: AnyWidth> WithSimd for OnRegisters<K> {
    type Output = K::Output;

    #[inline(always)]
    fn with_simd<S: Simd>(self, simd: S) -> K::Output {
        if const { S::F64_LANES == 1 } {
            self.0.run(0.0)
        } else {
            self.0.run(Lanes(simd, simd.splat_f64s(0.0)))
        }
    }
}

thread_local! {
    static DEMANDED: Cell<Option<Arch>> = const { Cell::new(None) };
}

/// A set of vector instructions.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Instructions {
    /// None: row by row.
    Scalar,
    /// AVX2, four rows.
    Avx2,
    /// AVX-512, eight rows.
    Avx512,
    /// The widest that this machine has.
    Widest,
}

impl Instructions {
    /// All instruction sets of this machine.
    pub fn available() -> Vec<Self> {
        let all = [Self::Scalar, Self::Avx2, Self::Avx512, Self::Widest];
        all.into_iter().filter(|set| set.arch().is_some()).collect()
    }

    fn arch(self) -> Option<Arch> {
        match self {
            Self::Scalar => Some(Arch::Scalar),
            #[cfg(target_arch = "x86_64")]
            Self::Avx2 => pulp::x86::V3::try_new().map(Arch::V3),
            #[cfg(target_arch = "x86_64")]
            Self::Avx512 => pulp::x86::V4::try_new().map(Arch::V4),
            #[cfg(not(target_arch = "x86_64"))]
            Self::Avx2 | Self::Avx512 => None,
            Self::Widest => Some(Arch::new()),
        }
    }
}

/// Runs `work` with these instructions for every [`vectorised`] kernel on this thread; for tests of bit equality and for
/// benchmarks. Instruction sets that the machine does not have are ignored.
pub fn with_instructions<T>(instructions: Instructions, work: impl FnOnce() -> T) -> T {
    /// Restores the previous instruction set, also if `work` panics.
    struct Before(Option<Arch>);
    impl Drop for Before {
        fn drop(&mut self) {
            DEMANDED.set(self.0);
        }
    }
    let _before = Before(DEMANDED.replace(instructions.arch().or(DEMANDED.get())));
    work()
}

/// Sine and cosine, lane by lane; within 2 units in the last place of the correctly rounded value for |x| < 1e5 rad.
///
/// Method: reduction by π/2 in three parts (Cody and Waite), then the polynomials of fdlibm's kernels on [−π/4, π/4].
/// Larger or non-finite arguments use the standard library.
#[inline(always)]
pub fn sin_cos<R: SinCos>(x: R) -> (R, R) {
    x.sin_cos_wide()
}

/// Numbers that have a sine and a cosine; see [`sin_cos`].
pub trait SinCos: Real {
    /// Sine and cosine.
    fn sin_cos_wide(self) -> (Self, Self);

    /// Sine and cosine of r + k π/2, from those of r; the lowest bits of `shifted` are those of k.
    fn turned(shifted: Self, sine: Self, cosine: Self) -> (Self, Self);
}

impl SinCos for f64 {
    #[cfg_attr(not(debug_assertions), inline(always))]
    fn sin_cos_wide(self) -> (Self, Self) {
        if self.abs() < MAX_REDUCED { sin_cos_reduced(self) } else { self.sin_cos() }
    }

    #[inline(always)]
    fn turned(shifted: Self, sine: Self, cosine: Self) -> (Self, Self) {
        let quadrant = shifted.to_bits();
        let sine_sign = (quadrant & 2) << 62;
        let cosine_sign = ((quadrant + 1) & 2) << 62;
        let (a, b) = if quadrant & 1 == 1 { (cosine, sine) } else { (sine, cosine) };
        (f64::from_bits(a.to_bits() ^ sine_sign), f64::from_bits(b.to_bits() ^ cosine_sign))
    }
}

impl<S: Simd> SinCos for Lanes<S> {
    #[cfg_attr(not(debug_assertions), inline(always))]
    fn sin_cos_wide(self) -> (Self, Self) {
        let Self(simd, value) = self;
        let small = simd.less_than_f64s(simd.abs_f64s(value), simd.splat_f64s(MAX_REDUCED));
        if simd.first_true_m64s(simd.not_m64s(small)) < S::F64_LANES {
            let (sine, cosine) = one_by_one(self.spread());
            return (self.gathered(&sine), self.gathered(&cosine));
        }
        sin_cos_reduced(self)
    }

    #[inline(always)]
    fn turned(shifted: Self, sine: Self, cosine: Self) -> (Self, Self) {
        let Self(simd, shifted) = shifted;
        let quadrant = simd.transmute_u64s_f64s(shifted);
        let (none, one, two) = (simd.splat_u64s(0), simd.splat_u64s(1), simd.splat_u64s(2));
        let minus = simd.splat_u64s(1 << 63);
        let straight = simd.equal_u64s(simd.and_u64s(quadrant, one), none);
        let sine_up = simd.equal_u64s(simd.and_u64s(quadrant, two), none);
        let cosine_up = simd.equal_u64s(simd.and_u64s(simd.add_u64s(quadrant, one), two), none);
        let (a, b) = (simd.transmute_u64s_f64s(sine.1), simd.transmute_u64s_f64s(cosine.1));
        let (a, b) = (simd.select_u64s(straight, a, b), simd.select_u64s(straight, b, a));
        let sine = simd.select_u64s(sine_up, a, simd.xor_u64s(a, minus));
        let cosine = simd.select_u64s(cosine_up, b, simd.xor_u64s(b, minus));
        (Self(simd, simd.transmute_f64s_u64s(sine)), Self(simd, simd.transmute_f64s_u64s(cosine)))
    }
}

/// Fallback for registers with a large or non-finite lane.
#[cold]
#[inline(never)]
fn one_by_one(lanes: [f64; WIDTH]) -> ([f64; WIDTH], [f64; WIDTH]) {
    (lanes.map(|x| sin_cos(x).0), lanes.map(|x| sin_cos(x).1))
}

/// Largest argument for which three parts of π/2 are accurate enough.
const MAX_REDUCED: f64 = 1.0e5;

#[cfg_attr(not(debug_assertions), inline(always))]
#[expect(clippy::excessive_precision, reason = "the constants as fdlibm prints them")]
fn sin_cos_reduced<R: SinCos>(x: R) -> (R, R) {
    const TWO_OVER_PI: f64 = std::f64::consts::FRAC_2_PI;
    // π/2 in parts of 33 bits, so that k times a part is exact (fdlibm, e_rem_pio2.c).
    const PART_1: f64 = 1.570_796_326_734_125_614_17;
    const PART_2: f64 = 6.077_100_506_303_965_976_60e-11;
    const PART_3: f64 = 2.022_266_248_795_950_631_54e-21;
    // Adding and subtracting 1.5·2⁵² rounds to the nearest integer, which is then in the low bits.
    const ROUND: f64 = 6_755_399_441_055_744.0;
    const SINE: [f64; 6] = [
        -1.666_666_666_666_663_243_48e-1,
        8.333_333_333_322_489_461_24e-3,
        -1.984_126_982_985_794_931_34e-4,
        2.755_731_370_707_006_767_89e-6,
        -2.505_076_025_340_686_341_95e-8,
        1.589_690_995_211_550_102_21e-10,
    ];
    const COSINE: [f64; 6] = [
        4.166_666_666_666_660_190_37e-2,
        -1.388_888_888_887_410_957_49e-3,
        2.480_158_728_947_672_941_78e-5,
        -2.755_731_435_139_066_330_35e-7,
        2.087_572_321_298_174_827_90e-9,
        -1.135_964_755_778_819_482_65e-11,
    ];
    let shifted = x * x.splat(TWO_OVER_PI) + x.splat(ROUND);
    let k = shifted - x.splat(ROUND);
    let r = ((x - k * x.splat(PART_1)) - k * x.splat(PART_2)) - k * x.splat(PART_3);
    let z = r * r;
    let sine = r + r * z * polynomial(z, &SINE);
    let one = x.splat(1.0);
    let half = x.splat(0.5) * z;
    let w = one - half;
    let cosine = w + ((one - w) - half) + z * z * polynomial(z, &COSINE);
    R::turned(shifted, sine, cosine)
}

/// c₀ + z (c₁ + z (c₂ + …)).
#[inline(always)]
fn polynomial<R: Real>(z: R, c: &[f64; 6]) -> R {
    let mut out = z.splat(c[5]);
    let mut k = 5;
    while k > 0 {
        k -= 1;
        out = z.splat(c[k]) + z * out;
    }
    out
}
