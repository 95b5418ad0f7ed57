//! Random numbers.

use rand::{Rng, RngExt};
use rand_chacha::ChaCha8Rng;
use rand_chacha::rand_core::SeedableRng;
use rand_distr::{Distribution, StandardNormal};

/// What a generator is for. Each has a stream of its own, so that a longer set does not change the arm.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Purpose {
    /// Which arm, sensor and design.
    Setting = 1,
    /// The arm's geometry and masses.
    Arm,
    /// Poses and times.
    Poses,
    /// The hidden effect.
    Effect,
    /// Noise of the rows.
    Noise,
    /// Fresh rows and their noise.
    Fresh,
    /// Clean poses.
    Clean,
    /// How the rows are disturbed for the test of stability.
    Variant,
}

/// The generator of one purpose in one run.
pub fn generator(seed: u64, kind: u64, run: u64, attempt: u64, purpose: Purpose) -> ChaCha8Rng {
    let mut mixed = 0_u64;
    for part in [seed, kind, run, attempt] {
        // Steele, Lea and Flood: SplitMix64.
        mixed = mixed.wrapping_add(part).wrapping_add(0x9e37_79b9_7f4a_7c15);
        mixed = (mixed ^ (mixed >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        mixed = (mixed ^ (mixed >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        mixed ^= mixed >> 31;
    }
    let mut rng = ChaCha8Rng::seed_from_u64(mixed);
    rng.set_stream(purpose as u64);
    rng
}

/// A standard normal number.
pub fn normal(rng: &mut impl Rng) -> f64 {
    StandardNormal.sample(rng)
}

/// A number between two.
pub fn between(rng: &mut impl Rng, low: f64, high: f64) -> f64 {
    rng.random_range(low..high)
}

/// A number between two, evenly in its logarithm.
pub fn scaled(rng: &mut impl Rng, low: f64, high: f64) -> f64 {
    between(rng, low.ln(), high.ln()).exp()
}

/// One of a list.
pub fn one<T: Copy>(rng: &mut impl Rng, list: &[T]) -> T {
    list[rng.random_range(0..list.len())]
}

/// A direction, evenly over the sphere.
pub fn direction(rng: &mut impl Rng) -> nalgebra::Vector3<f64> {
    loop {
        let v = nalgebra::Vector3::from_fn(|_, _| normal(rng));
        if v.norm() > 1e-3 {
            return v.normalize();
        }
    }
}
