//! Identified parameters with their uncertainty in units of their prior σ, so that lengths and angles share an axis, with value and
//! unit beside them.

use super::axis::Axis;
use super::frame::{EDGE, Entry, Frame, Glyph};
use super::ink::Ink;
use super::letters;
use super::pen::{HPos, LABEL, MARKER, Marker, PIXEL, Paint, Pen, THIN, VPos};
use super::scale::{Ends, Scale};
use crate::number::Precision;

/// Height of a row in pixels.
const ROW: u32 = 22;

/// Parameters as intervals.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Intervals {
    /// Title; may be empty.
    pub title: String,
    /// Parameters from top to bottom.
    pub rows: Vec<Interval>,
}

/// One parameter.
#[derive(Debug, Clone, PartialEq)]
pub struct Interval {
    /// Its name.
    pub name: String,
    /// Unit of value, σ and prior σ.
    pub unit: String,
    /// Change from nominal.
    pub value: f64,
    /// Posterior 1σ; NaN if unknown.
    pub sigma: f64,
    /// Prior 1σ, the manufacturing tolerance.
    pub prior_sigma: f64,
    /// Whether the data determine it; otherwise it is drawn hollow and labelled as held by its prior.
    pub determined: bool,
}

impl Interval {
    /// A parameter that the data determine.
    pub fn new(
        name: impl Into<String>,
        unit: impl Into<String>,
        value: f64,
        sigma: f64,
        prior_sigma: f64,
    ) -> Self {
        Self { name: name.into(), unit: unit.into(), value, sigma, prior_sigma, determined: true }
    }

    fn text(&self) -> String {
        let number = Precision::Significant(2).format_with_sigma(self.value, self.sigma);
        let held = if self.determined { "" } else { ", held by prior" };
        format!("{number} {}{held}", self.unit)
    }
}

impl Intervals {
    /// The picture, 900 pixels wide and as high as its rows need.
    pub fn svg(&self) -> String {
        let name = if self.title.is_empty() { "identified parameters" } else { &self.title };
        let height = 110 + ROW * self.rows.len().max(2) as u32;
        Pen::draw((900, height), name, |pen| self.draw(pen))
    }

    fn draw(&self, pen: &mut Pen) {
        let texts: Vec<String> = self.rows.iter().map(Interval::text).collect();
        let widest = texts.iter().map(|text| letters::width(text, LABEL)).fold(0.0, f64::max);
        // Reversed, so that the first name is at the top.
        let names: Vec<String> = self.rows.iter().rev().map(|row| row.name.clone()).collect();
        let ends = self.rows.iter().flat_map(|row| {
            let (value, sigma) = (row.value / row.prior_sigma, row.sigma / row.prior_sigma);
            [value, value - 2.0 * sigma, value + 2.0 * sigma]
        });
        let entry = |name: &str, ink, glyph| Entry { name: name.to_owned(), ink, glyph };
        let mut legend = vec![
            entry(
                "value ± 1σ (thick), ± 2σ (thin)",
                INK,
                Glyph::Line { dash: "", width: THICK, marker: Some(Marker::Circle) },
            ),
            entry("prior ± 1σ", Ink::Text, Glyph::Area { alpha: PRIOR_ALPHA, outlined: false }),
        ];
        if self.rows.iter().any(|row| !row.determined) {
            legend.insert(1, entry("held by its prior", INK, Glyph::Point(Marker::Ring)));
        }
        let frame = Frame {
            title: &self.title,
            x: Scale::of(&Axis::default(), ends.chain([-1.2, 1.2]), Ends::Loose, 9),
            y: Scale::named(&names),
            x_text: "change from nominal, in units of the prior σ".to_owned(),
            y_text: String::new(),
            legend,
            x_grid: true,
            y_grid: false,
            right: widest as i32 + EDGE,
        };
        let inside = frame.draw(pen);
        if let [Some(from), Some(to), Some(zero)] = [-1.0, 1.0, 0.0].map(|x| inside.across(x)) {
            pen.rectangle([(from, inside.y.start), (to, inside.y.end)], Paint::text(PRIOR_ALPHA));
            pen.line(&[(zero, inside.y.start), (zero, inside.y.end)], Paint::text(0.6), THIN, "");
        }
        if self.rows.is_empty() {
            inside.draw_empty(pen);
            return;
        }
        for (index, (row, text)) in self.rows.iter().zip(&texts).enumerate() {
            let Some(y) = inside.down((self.rows.len() - 1 - index) as f64) else { continue };
            pen.text(text, (inside.x.end + EDGE, y), LABEL, HPos::Left, VPos::Center);
            let Some(x) = inside.across(row.value / row.prior_sigma) else { continue };
            let color = INK.rgb();
            for (sigmas, width) in [(2.0, THIN), (1.0, THICK)] {
                let reach = sigmas * row.sigma;
                let ends =
                    [row.value - reach, row.value + reach].map(|end| inside.across(end / row.prior_sigma));
                let [Some(from), Some(to)] = ends else { continue };
                if row.determined {
                    pen.line(&[(from, y), (to, y)], Paint(color, 1.0), width, "");
                } else {
                    // The ring stays hollow.
                    for part in
                        [(from, x - MARKER), (x + MARKER, to)].into_iter().filter(|part| part.0 < part.1)
                    {
                        pen.line(&[(part.0, y), (part.1, y)], Paint(color, 1.0), width, "");
                    }
                }
            }
            pen.marker(if row.determined { Marker::Circle } else { Marker::Ring }, (x, y), Paint(color, 1.0));
        }
    }
}

const INK: Ink = Ink::Blue;
const THICK: i32 = 3 * PIXEL;
const PRIOR_ALPHA: f64 = 0.09;
