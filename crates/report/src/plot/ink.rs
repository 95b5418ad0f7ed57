//! Colours of series and colour maps.

/// Colour of a series (Okabe and Ito, "Color Universal Design", 2008), without their yellow, which is hard to see on white.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Ink {
    /// Blue; by convention after compensation.
    Blue,
    /// Vermilion; by convention before compensation.
    Vermilion,
    /// Bluish green.
    Green,
    /// Reddish purple.
    Purple,
    /// Orange.
    Orange,
    /// Sky blue.
    Sky,
    /// Text colour of the page.
    Text,
}

impl Ink {
    /// Order of the colours of series.
    pub const CYCLE: [Ink; 7] =
        [Ink::Vermilion, Ink::Blue, Ink::Green, Ink::Purple, Ink::Orange, Ink::Sky, Ink::Text];

    /// Colour of the nth series, from 0.
    pub fn nth(index: usize) -> Ink {
        Self::CYCLE[index % Self::CYCLE.len()]
    }

    pub(super) fn rgb(self) -> [u8; 3] {
        match self {
            Ink::Blue => [0x00, 0x72, 0xb2],
            Ink::Vermilion => [0xd5, 0x5e, 0x00],
            Ink::Green => [0x00, 0x9e, 0x73],
            Ink::Purple => [0xcc, 0x79, 0xa7],
            Ink::Orange => [0xe6, 0x9f, 0x00],
            Ink::Sky => [0x56, 0xb4, 0xe9],
            Ink::Text => [0, 0, 0],
        }
    }
}

/// Colour map for values.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum ColorMap {
    /// Viridis (Smith and van der Walt, 2015), for sizes: perceptually uniform, also in grey and for colour-blind readers.
    #[default]
    Viridis,
    /// Blue over grey to red (Moreland, "Diverging color maps for scientific visualization", 2009), for signed values centred at 0.
    CoolWarm,
}

impl ColorMap {
    fn table(self) -> &'static [[u8; 3]] {
        match self {
            ColorMap::Viridis => &[
                [0x44, 0x01, 0x54],
                [0x48, 0x28, 0x78],
                [0x3e, 0x49, 0x89],
                [0x31, 0x68, 0x8e],
                [0x26, 0x82, 0x8e],
                [0x1f, 0x9e, 0x89],
                [0x35, 0xb7, 0x79],
                [0x6e, 0xce, 0x58],
                [0xb5, 0xde, 0x2b],
                [0xfd, 0xe7, 0x25],
            ],
            ColorMap::CoolWarm => &[
                [59, 76, 192],
                [98, 130, 234],
                [141, 176, 254],
                [184, 208, 249],
                [221, 221, 221],
                [245, 196, 173],
                [244, 154, 123],
                [222, 96, 77],
                [180, 4, 38],
            ],
        }
    }

    /// RGB colour at a fraction of the range, clamped to 0..1.
    pub fn at(self, fraction: f64) -> [u8; 3] {
        let table = self.table();
        let position = fraction.clamp(0.0, 1.0) * (table.len() - 1) as f64;
        // NaN becomes 0; callers exclude it.
        let below = (position as usize).min(table.len() - 2);
        let part = position - below as f64;
        std::array::from_fn(|channel| {
            let [low, high] = [table[below][channel], table[below + 1][channel]].map(f64::from);
            (low + (high - low) * part).round() as u8
        })
    }
}
