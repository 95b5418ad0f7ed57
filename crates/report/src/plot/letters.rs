//! Text widths without a font: advance widths of Helvetica, shared by Arial, Liberation Sans and Nimbus Sans.

/// Font family in the SVG, matching these widths.
pub(super) const FAMILY: &str = "Helvetica, Arial, Liberation Sans, sans-serif";

/// Advance widths of ASCII 32 to 126 in thousandths of the size (Adobe Font Metrics of Helvetica).
const WIDTHS: [u16; 95] = [
    278, 278, 355, 556, 556, 889, 667, 191, 333, 333, 389, 584, 278, 333, 278, 278, 556, 556, 556, 556, 556,
    556, 556, 556, 556, 556, 278, 278, 584, 584, 584, 556, 1015, 667, 667, 722, 722, 667, 611, 778, 722, 278,
    500, 667, 556, 833, 722, 778, 667, 778, 722, 667, 611, 722, 667, 944, 667, 667, 611, 278, 278, 278, 469,
    556, 333, 556, 556, 500, 556, 556, 278, 556, 556, 222, 222, 500, 222, 833, 556, 556, 556, 556, 333, 500,
    278, 556, 500, 722, 500, 500, 500, 334, 260, 334, 584,
];

/// Width of a line of text, in the unit of the font size; 5 % larger, since the viewer may use a wider font.
pub(super) fn width(text: &str, size: f64) -> f64 {
    let thousandths: f64 = text.chars().map(advance).sum();
    thousandths * size * 1.05e-3
}

fn advance(character: char) -> f64 {
    match character {
        ' '..='~' => f64::from(WIDTHS[character as usize - 32]),
        // Superscripts, degree sign and primes are narrow; ±, × and Greek letters about as wide as a digit.
        '⁰'..='₎' | '°' | '²' | '³' | '¹' | '′' => 350.0,
        'σ' | '±' | '×' | '–' | 'µ' | 'μ' => 580.0,
        _ => 700.0,
    }
}
