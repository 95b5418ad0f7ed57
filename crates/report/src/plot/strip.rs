//! Heat strips: a value along a path or over rows, one strip per method, so that many are compared at a glance.

use super::axis::Axis;
use super::canvas::{DrawingError, PIXEL};
use super::color_bar::Colors;
use super::frame::{EDGE, Frame, picture};
use super::ink::ColorMap;
use super::letters;
use super::pen::{LABEL, Paint, Pen, THIN};
use super::scale::{Ends, Scale};

/// Height of a strip in pixels.
const STRIP: u32 = 30;

/// Cells across at most; of several values in a cell the one farthest from zero is shown.
const CELLS: usize = 400;

/// Colours told apart.
const SHADES: usize = 64;

/// Strips under each other.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct HeatStrip {
    /// Title inside the picture; may be empty.
    pub title: String,
    /// What runs along the strips; the values stand at 0, 1, 2, … unless a range says between which ends.
    pub x: Axis,
    /// What the colours mean; all strips share it.
    pub value: Axis,
    /// The colours.
    pub colors: ColorMap,
    /// The strips, from top to bottom.
    pub strips: Vec<Strip>,
}

/// One strip.
#[derive(Debug, Clone, PartialEq)]
pub struct Strip {
    /// Its name.
    pub name: String,
    /// Its values, evenly spaced. What is not finite stays empty.
    pub values: Vec<f64>,
}

impl HeatStrip {
    /// The picture, 900 pixels wide and as high as its strips need.
    pub fn svg(&self) -> String {
        let name = if self.title.is_empty() { self.value.text() } else { self.title.clone() };
        // The text beside the colour bar stands upright and needs its length.
        let text = letters::width(&self.value.text(), LABEL) as u32 / PIXEL as u32;
        let height = (100 + STRIP * self.strips.len().max(3) as u32).max(text + 40);
        picture((900, height), &name, |pen| self.draw(pen))
    }

    fn draw(&self, pen: Pen<'_>) -> Result<(), DrawingError> {
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
        let inside = frame.draw(pen)?;
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
                    // Half a pixel under the next cell: edges that meet would show seams.
                    let beyond = if colored.get(to).is_some_and(Option::is_some) { PIXEL / 2 } else { 0 };
                    shades[shade].push(vec![(cell(from), middle), (cell(to) + beyond, middle)]);
                }
                from = to;
            }
            rims.push([(inside.x.start, middle - height / 2), (inside.x.end, middle + height / 2)]);
        }
        for (shade, lines) in shades.iter().enumerate() {
            pen.sheet.strokes(lines, colors.at(shade as f64 / SHADES as f64), 1.0, height, false);
        }
        for rim in rims {
            pen.outline(rim, Paint::text(0.3), THIN)?;
        }
        if cells == 0 {
            inside.say_empty(pen)?;
        }
        colors.draw(pen, inside.x.end + 2 * EDGE, inside.y.start, inside.y.end)
    }
}

/// Shade of a cell, `None` where none of its values is finite.
fn shade(strip: &Strip, colors: &Colors, cell: usize, cells: usize, longest: usize) -> Option<usize> {
    let (from, to) = (cell * longest / cells, (cell + 1) * longest / cells);
    let values = strip.values.get(from..to.min(strip.values.len()))?;
    let finite = values.iter().copied().filter(|value| value.is_finite());
    let value = finite.max_by(|a, b| a.abs().total_cmp(&b.abs()))?;
    colors.fraction(value).map(|fraction| (fraction * SHADES as f64).round() as usize)
}
