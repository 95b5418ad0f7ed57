//! A catalogue of chaotic maps, each an endless sequence in [0, 1).
//!
//! **Method.** With x in [0, 1) unless stated:
//! - logistic x ← r x (1 − x), r = 4;
//! - tent x ← 2x below ½, 2(1 − x) from there;
//! - sine x ← a sin(πx), a = 1;
//! - Chebyshev u ← cos(k arccos u) on [−1, 1], k = 4, given out as (u + 1)/2;
//! - Hénon (u, v) ← (1 − 1.4u² + v, 0.3u), given out as (u + 1.5)/3;
//! - Bernoulli (doubling) x ← 2x mod 1;
//! - logistic-tent (ltlm-2024 eq. 11): x ← (r x(1 − x) + (4 − r)x/2) mod 1 below ½, with 1 − x for x in the
//!   second term from there.
//!
//! **Guards.** Doubling a binary number shifts its digits to the left, so that in floating point tent and
//! Bernoulli reach 0 after some 53 steps from any start and remain there (logistic-tent with r = 0 is the tent).
//! Exact arithmetic on an irrational start would append a new digit at the right; here it comes from SplitMix64
//! (Steele, Lea, Flood 2014), 2⁻⁵² in size. A map that reaches a fixed point, a cycle of two or a value outside its
//! interval is restarted from the same source. A sequence is determined by its map and start.
//!
//! **Source and departures.** Liu et al. 2024, Table 2 and eq. 11; formulas of the six others from the
//! literature (May 1976 logistic, Hénon 1976, …), since the paper prints none. All maps but tent, Bernoulli and
//! (nearly) logistic-tent have densities that are far from uniform; they are not transformed.
//!
//! **Checked against** the first steps by hand, 100,000 steps without collapse, and the arcsine density of
//! logistic.

use std::f64::consts::PI;

use serde::{Deserialize, Serialize};

/// One of the maps, with its parameter.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(tag = "map", rename_all = "kebab-case")]
pub enum Map {
    /// x ← r x (1 − x); chaotic on the whole interval for r = 4.
    Logistic {
        /// Growth, 0 to 4.
        r: f64,
    },
    /// Slope ±2.
    Tent,
    /// x ← a sin(πx).
    Sine {
        /// Height, 0 to 1.
        a: f64,
    },
    /// u ← cos(k arccos u).
    Chebyshev {
        /// Degree, 2 or more.
        degree: f64,
    },
    /// The two-dimensional map of Hénon with a = 1.4, b = 0.3.
    Henon,
    /// x ← 2x mod 1.
    Bernoulli,
    /// Equation 11 of ltlm-2024.
    LogisticTent {
        /// Mixture, 0 (tent) to 4 (logistic, folded by mod 1).
        r: f64,
    },
}

impl Map {
    /// The seven maps with their usual parameters; logistic-tent with the r = 0.5 of the paper.
    pub const ALL: [Map; 7] = [
        Map::Logistic { r: 4.0 },
        Map::Tent,
        Map::Sine { a: 1.0 },
        Map::Chebyshev { degree: 4.0 },
        Map::Henon,
        Map::Bernoulli,
        Map::LogisticTent { r: 0.5 },
    ];

    /// Name as in the paper's Table 2.
    pub fn name(self) -> &'static str {
        match self {
            Map::Logistic { .. } => "logistic",
            Map::Tent => "tent",
            Map::Sine { .. } => "sine",
            Map::Chebyshev { .. } => "chebyshev",
            Map::Henon => "henon",
            Map::Bernoulli => "bernoulli",
            Map::LogisticTent { .. } => "logistic-tent",
        }
    }

    /// The sequence from `start`, the start itself not included. A start outside (0, 1) is folded into it.
    pub fn sequence(self, start: f64) -> Sequence {
        let mut sequence = Sequence { map: self, state: [0.0; 2], before: [f64::NAN; 2], counter: 0 };
        let fraction = if start.is_finite() { start.rem_euclid(1.0) } else { 0.0 };
        sequence.state = sequence.place(fraction);
        if fraction == 0.0 {
            sequence.restart();
        }
        sequence
    }

    /// Image of a state under the map, before the guards.
    fn image(self, [x, y]: [f64; 2]) -> [f64; 2] {
        let x = match self {
            Map::Logistic { r } => r * x * (1.0 - x),
            Map::Tent if x < 0.5 => 2.0 * x,
            Map::Tent => 2.0 * (1.0 - x),
            Map::Sine { a } => a * (PI * x).sin(),
            Map::Chebyshev { degree } => (degree * x.acos()).cos(),
            Map::Henon => return [1.0 - 1.4 * x * x + y, 0.3 * x],
            Map::Bernoulli => (2.0 * x).rem_euclid(1.0),
            Map::LogisticTent { r } => {
                let folded = if x < 0.5 { x } else { 1.0 - x };
                (r * x * (1.0 - x) + (4.0 - r) * folded / 2.0).rem_euclid(1.0)
            }
        };
        [x, 0.0]
    }

    /// Whether the map only shifts binary digits and therefore needs new ones.
    fn shifts_digits(self) -> bool {
        matches!(self, Map::Tent | Map::Bernoulli | Map::LogisticTent { .. })
    }

    /// The state's position in the unit interval.
    fn fraction(self, x: f64) -> f64 {
        match self {
            Map::Chebyshev { .. } => 0.5 * (x + 1.0),
            Map::Henon => (x + 1.5) / 3.0,
            _ => x,
        }
    }
}

/// An endless sequence of a [`Map`] in [0, 1).
#[derive(Debug, Clone)]
pub struct Sequence {
    map: Map,
    state: [f64; 2],
    before: [f64; 2],
    counter: u64,
}

impl Sequence {
    /// The next number of SplitMix64, in (0, 1).
    fn fresh_digits(&mut self) -> f64 {
        self.counter = self.counter.wrapping_add(0x9E37_79B9_7F4A_7C15);
        let mut z = self.counter;
        z = (z ^ (z >> 30)).wrapping_mul(0xBF58_476D_1CE4_E5B9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94D0_49BB_1331_11EB);
        ((z ^ (z >> 31)) >> 12) as f64 / (1_u64 << 52) as f64 + f64::EPSILON / 2.0
    }

    /// A state for a fraction of the unit interval. Hénon starts inside its basin, close to the origin.
    fn place(&self, fraction: f64) -> [f64; 2] {
        match self.map {
            Map::Chebyshev { .. } => [2.0 * fraction - 1.0, 0.0],
            Map::Henon => [0.2 * (fraction - 0.5), 0.0],
            _ => [fraction, 0.0],
        }
    }

    fn restart(&mut self) {
        let fraction = self.fresh_digits();
        self.state = self.place(fraction);
        self.before = [f64::NAN; 2];
    }
}

impl Iterator for Sequence {
    type Item = f64;

    fn next(&mut self) -> Option<f64> {
        let mut next = self.map.image(self.state);
        if self.map.shifts_digits() {
            next[0] += self.fresh_digits() * f64::EPSILON;
        }
        let place = self.map.fraction(next[0]);
        // Written so that NaN fails too.
        let inside = place > 0.0 && place < 1.0;
        if !inside || next == self.state || next == self.before {
            self.restart();
        } else {
            self.before = self.state;
            self.state = next;
        }
        Some(self.map.fraction(self.state[0]))
    }
}
