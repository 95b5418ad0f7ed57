//! Colours: a map for sizes and a palette for objects.
//!
//! Deviations use viridis (S. van der Walt and N. Smith 2015, public domain), perceptually uniform and suitable for colour-blind
//! users, without its darkest fifth, which would be invisible on the dark background of the viewer. Objects use the palette of
//! M. Okabe and K. Ito, 2008.

/// Red, green, blue, opacity.
pub type Rgba = [u8; 4];

/// Viridis at sixteen even steps.
const VIRIDIS: [[u8; 3]; 16] = [
    [0x44, 0x01, 0x54],
    [0x48, 0x1a, 0x6c],
    [0x47, 0x2f, 0x7d],
    [0x41, 0x44, 0x87],
    [0x39, 0x56, 0x8c],
    [0x31, 0x68, 0x8e],
    [0x2a, 0x78, 0x8e],
    [0x23, 0x88, 0x8e],
    [0x1f, 0x98, 0x8b],
    [0x22, 0xa8, 0x84],
    [0x35, 0xb7, 0x79],
    [0x54, 0xc5, 0x68],
    [0x7a, 0xd1, 0x51],
    [0xa5, 0xdb, 0x36],
    [0xd2, 0xe2, 0x1b],
    [0xfd, 0xe7, 0x25],
];

/// Start of the used part of viridis.
const FIRST: f64 = 0.2;

/// Number of colours of a [`Scale`].
pub const STEPS: usize = 32;

/// The uncorrected program: vermilion.
pub const BEFORE: Rgba = [0xd5, 0x5e, 0x00, 255];
/// The nominal arm, transparent.
pub const GHOST: Rgba = [222, 228, 236, 255];
/// The corrected program under each model: sky blue, bluish green, orange, blue.
pub const AFTER: [Rgba; 4] =
    [[0x56, 0xb4, 0xe9, 255], [0x00, 0x9e, 0x73, 255], [0xe6, 0x9f, 0x00, 255], [0x00, 0x72, 0xb2, 255]];
/// The six joints.
pub const JOINTS: [Rgba; 6] = [
    [0x56, 0xb4, 0xe9, 255],
    [0xe6, 0x9f, 0x00, 255],
    [0x00, 0x9e, 0x73, 255],
    [0xf0, 0xe4, 0x42, 255],
    [0xd5, 0x5e, 0x00, 255],
    [0xcc, 0x79, 0xa7, 255],
];
/// Points with a warning: yellow.
pub const FLAGGED: Rgba = [0xf0, 0xe4, 0x42, 255];
/// Points that were not corrected: reddish purple.
pub const REFUSED: Rgba = [0xcc, 0x79, 0xa7, 255];
/// The intended path.
pub const INTENDED: Rgba = [245, 245, 245, 255];
/// Moves without cutting.
pub const TRAVEL: Rgba = [120, 128, 140, 255];
/// Predicted standard deviation.
pub const SIGMA: Rgba = [150, 156, 166, 255];
/// Tool axes.
pub const TOOL: Rgba = [176, 186, 200, 255];
/// The workpiece.
pub const WORKPIECE: Rgba = [92, 100, 114, 255];

/// Colour of the corrected program under model `index`.
pub fn after(index: usize) -> Rgba {
    AFTER[index % AFTER.len()]
}

/// The map at `share`, clamped to 0…1; NaN is grey.
pub fn map(share: f64) -> Rgba {
    if share.is_nan() {
        return TRAVEL;
    }
    let position = (FIRST + (1.0 - FIRST) * share.clamp(0.0, 1.0)) * (VIRIDIS.len() - 1) as f64;
    let below = (position as usize).min(VIRIDIS.len() - 2);
    let part = position - below as f64;
    let blend = |k: usize| {
        let (a, b) = (f64::from(VIRIDIS[below][k]), f64::from(VIRIDIS[below + 1][k]));
        (a + (b - a) * part).round() as u8
    };
    [blend(0), blend(1), blend(2), 255]
}

/// Colour scale for deviations, from zero to a round number in [`STEPS`] steps.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Scale {
    /// Upper end (mm).
    pub top_mm: f64,
}

impl Scale {
    /// Scale whose upper end is the next of 1, 2, 5 × 10ⁿ above all `sizes_mm`; 1 mm without sizes.
    pub fn over(sizes_mm: impl IntoIterator<Item = f64>) -> Self {
        let largest = sizes_mm.into_iter().filter(|s| s.is_finite()).fold(0.0, f64::max);
        Self { top_mm: if largest > 0.0 { round_up(largest) } else { 1.0 } }
    }

    /// The step, 0 to [`STEPS`] − 1, of a deviation (mm).
    pub fn step(&self, size_mm: f64) -> usize {
        ((size_mm / self.top_mm * STEPS as f64) as usize).min(STEPS - 1)
    }

    /// The colour of a step.
    pub fn colour(&self, step: usize) -> Rgba {
        map(step as f64 / (STEPS - 1) as f64)
    }

    /// Colour of a deviation (mm); NaN is grey.
    pub fn of(&self, size_mm: f64) -> Rgba {
        if size_mm.is_nan() { TRAVEL } else { self.colour(self.step(size_mm)) }
    }
}

/// The smallest of 1, 2, 2.5, 5 × 10ⁿ that is at least `value` > 0.
pub(super) fn round_up(value: f64) -> f64 {
    let decade = 10f64.powf(value.log10().floor());
    let steps = [1.0, 2.0, 2.5, 5.0, 10.0];
    // Tolerance for rounding of the logarithm, so that 0.5 is not rounded up to 1.
    steps.iter().map(|s| s * decade).find(|s| *s >= value * (1.0 - 1e-9)).unwrap_or(10.0 * decade)
}

/// The largest of 1, 2, 5 × 10ⁿ that is at most `value`, and at least 1.
pub(super) fn round_down(value: f64) -> f64 {
    if !(value > 1.0) || !value.is_finite() {
        return 1.0;
    }
    let decade = 10f64.powf(value.log10().floor());
    [5.0, 2.0, 1.0].iter().map(|s| s * decade).find(|s| *s <= value * (1.0 + 1e-9)).unwrap_or(1.0)
}
