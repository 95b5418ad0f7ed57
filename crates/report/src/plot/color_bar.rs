//! Colour scale and its bar.

use super::axis::Axis;
use super::ink::ColorMap;
use super::letters;
use super::pen::{HPos, LABEL, PIXEL, Paint, Pen, THIN, VPos};
use super::scale::{Ends, Scale};

const STEPS: i32 = 64;
const BREADTH: i32 = 14 * PIXEL;

/// Colours for a range of values.
pub(super) struct Colors {
    map: ColorMap,
    pub(super) scale: Scale,
    text: String,
}

impl Colors {
    /// Colours for the values of an axis. A signed map is symmetric about 0.
    pub(super) fn of(axis: &Axis, map: ColorMap, values: impl Iterator<Item = f64>) -> Self {
        let mut axis = axis.clone();
        let mut ends = Ends::Tight;
        let values: Vec<f64> = values.filter(|value| value.is_finite()).collect();
        if map == ColorMap::CoolWarm {
            axis.log = false;
            let size = match axis.range {
                Some([low, high]) => low.abs().max(high.abs()),
                None => values.iter().fold(0.0f64, |size, value| size.max(value.abs())),
            };
            axis.range = Some([-size, size]).filter(|_| size > 0.0);
        } else if !axis.log {
            // Sizes start at 0, so that plots of good and bad paths can be compared.
            ends = if values.iter().all(|value| *value >= 0.0) { Ends::Nought } else { Ends::Tight };
        }
        let text = axis.text();
        Self { map, scale: Scale::of(&axis, values.into_iter(), ends, 5), text }
    }

    /// Fraction of a value on the bar; `None` if it is not finite.
    pub(super) fn fraction(&self, value: f64) -> Option<f64> {
        self.scale.fraction(value).map(|fraction| fraction.clamp(0.0, 1.0))
    }

    pub(super) fn paint(&self, fraction: f64) -> Paint {
        Paint(self.map.at(fraction), 1.0)
    }

    /// Width of the bar with its labels.
    pub(super) fn room(&self) -> i32 {
        let widest = self.scale.ticks.iter().map(|tick| letters::width(&tick.1, LABEL)).fold(0.0, f64::max);
        BREADTH + widest as i32 + LABEL as i32 + 24 * PIXEL
    }

    /// Draws the bar with its left edge at `left`, from `top` to `bottom`.
    pub(super) fn draw(&self, pen: &mut Pen, left: i32, top: i32, bottom: i32) {
        let at = |fraction: f64| bottom - (fraction * f64::from(bottom - top)).round() as i32;
        for step in 0..STEPS {
            let low = at(f64::from(step) / f64::from(STEPS));
            let paint = self.paint((f64::from(step) + 0.5) / f64::from(STEPS));
            // Each step extends to the top and is covered by the next, since touching edges would show seams.
            pen.rectangle([(left, top), (left + BREADTH, low)], paint);
        }
        pen.outline([(left, top), (left + BREADTH, bottom)], Paint::text(0.5), THIN);
        let mut right = left + BREADTH;
        for (value, label) in &self.scale.ticks {
            let Some(fraction) = self.scale.fraction(*value) else { continue };
            let (y, x) = (at(fraction), left + BREADTH);
            pen.line(&[(x, y), (x + 4 * PIXEL, y)], Paint::text(0.5), THIN, "");
            pen.text(label, (x + 7 * PIXEL, y), LABEL, HPos::Left, VPos::Center);
            right = right.max(x + 7 * PIXEL + letters::width(label, LABEL) as i32);
        }
        pen.upright(&self.text, (right + 5 * PIXEL, (top + bottom) / 2), LABEL);
    }
}
