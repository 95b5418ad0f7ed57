//! Heat strips: a value along a path or over rows, one strip per method.

use super::axis::Axis;
use super::color_bar::Colors;
use super::frame::{EDGE, Frame};
use super::ink::ColorMap;
use super::letters;
use super::pen::{LABEL, PIXEL, Paint, Pen, THIN};
use super::scale::{Ends, Scale};

/// Height of a strip in pixels.
const STRIP: u32 = 30;

/// Largest number of cells; a cell with several values shows the one farthest from zero.
const CELLS: usize = 400;

/// Number of colours.
const SHADES: usize = 64;

/// Heat strips, one below the other.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct HeatStrip {
    /// Title; may be empty.
    pub title: String,
    /// Axis along the strips; values are at 0, 1, 2, … unless a range is given.
    pub x: Axis,
    /// Meaning of the colours, common to all strips.
    pub value: Axis,
    /// Colour map.
    pub colors: ColorMap,
    /// Strips from top to bottom.
    pub strips: Vec<Strip>,
}

/// One strip.
#[derive(Debug, Clone, PartialEq)]
pub struct Strip {
    /// Its name.
    pub name: String,
    /// Evenly spaced values; non-finite ones remain empty.
    pub values: Vec<f64>,
}

impl HeatStrip {
    /// The SVG, 900 pixels wide.
    pub fn svg(&self) -> String {
        let name = if self.title.is_empty() { self.value.text() } else { self.title.clone() };
        // The vertical label of the colour bar needs its length.
        let text = letters::width(&self.value.text(), LABEL) as u32 / PIXEL as u32;
        let height = (100 + STRIP * self.strips.len().max(3) as u32).max(text + 40);
        Pen::draw((900, height), &name, |pen| self.draw(pen))
    }

    fn draw(&self, pen: &mut Pen) {
        let colors =
            Colors::of(&self.value, self.colors, self.strips.iter().flat_map(|strip| &strip.values).copied());
        let longest = self.strips.iter().map(|strip| strip.values.len()).max().unwrap_or(0);
        let axis = Axis { log: false, ..self.x.clone() };
        let last = longest.max(2) as f64 - 1.0;
        let names: Vec<String> = self.strips.iter().rev().map(|strip| strip.name.clone()).collect();
        let frame = Frame {
            title: &self.title,
            x: Scale::of(&axis, [0.0, last].into_iter(), Ends::Tight, 9),
            y: Scale::named(&names),
            x_text: self.x.text(),
            y_text: String::new(),
            legend: Vec::new(),
            x_grid: false,
            y_grid: false,
            right: colors.room(),
        };
        let inside = frame.draw(pen);
        let width = f64::from(inside.x.end - inside.x.start);
        let cells = longest.min(CELLS);
        let height = STRIP as i32 * PIXEL * 8 / 10;
        let mut shades: Vec<Vec<Vec<(i32, i32)>>> = vec![Vec::new(); SHADES + 1];
        let mut rims = Vec::new();
        for (index, strip) in self.strips.iter().enumerate() {
            let Some(middle) = inside.down((self.strips.len() - 1 - index) as f64) else { continue };
            let cell = |cell: usize| inside.x.start + (width * cell as f64 / cells as f64).round() as i32;
            let colored: Vec<Option<usize>> =
                (0..cells).map(|cell| shade(strip, &colors, cell, cells, longest)).collect();
            let mut from = 0;
            for run in colored.chunk_by(|a, b| a == b) {
                let to = from + run.len();
                if let Some(shade) = run[0] {
                    // Extends half a pixel under the next cell, since touching edges would show seams.
                    let beyond = if colored.get(to).is_some_and(Option::is_some) { PIXEL / 2 } else { 0 };
                    shades[shade].push(vec![(cell(from), middle), (cell(to) + beyond, middle)]);
                }
                from = to;
            }
            rims.push([(inside.x.start, middle - height / 2), (inside.x.end, middle + height / 2)]);
        }
        for (shade, lines) in shades.iter().enumerate() {
            pen.lines(lines, colors.paint(shade as f64 / SHADES as f64), height, false);
        }
        for rim in rims {
            pen.outline(rim, Paint::text(0.3), THIN);
        }
        if cells == 0 {
            inside.draw_empty(pen);
        }
        colors.draw(pen, inside.x.end + 2 * EDGE, inside.y.start, inside.y.end);
    }
}

/// Shade of a cell; `None` if none of its values is finite.
fn shade(strip: &Strip, colors: &Colors, cell: usize, cells: usize, longest: usize) -> Option<usize> {
    let (from, to) = (cell * longest / cells, (cell + 1) * longest / cells);
    let values = strip.values.get(from..to.min(strip.values.len()))?;
    let finite = values.iter().copied().filter(|value| value.is_finite());
    let value = finite.max_by(|a, b| a.abs().total_cmp(&b.abs()))?;
    colors.fraction(value).map(|fraction| (fraction * SHADES as f64).round() as usize)
}
