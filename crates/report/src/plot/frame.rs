//! Frame of a plot: title, legend, grid, axes with ticks and labels.

use std::ops::Range;

use super::ink::Ink;
use super::letters;
use super::pen::{BOLD, HPos, LABEL, Marker, PIXEL, Paint, Pen, Point, THIN, TITLE, VPos};
use super::scale::Scale;

const TICK: i32 = 4 * PIXEL;
/// Margin around a plot.
pub(super) const EDGE: i32 = 10 * PIXEL;
/// Space below the label of the horizontal axis, for fonts with deep descenders.
const FOOT: i32 = 6 * PIXEL;
const LEGEND_LINE: i32 = 20 * PIXEL;
const GLYPH: i32 = 30 * PIXEL;
const GLYPH_GAP: i32 = 6 * PIXEL;
const ENTRY_GAP: i32 = 20 * PIXEL;

/// Description of a frame.
pub(super) struct Frame<'a> {
    pub(super) title: &'a str,
    pub(super) x: Scale,
    pub(super) y: Scale,
    pub(super) x_text: String,
    pub(super) y_text: String,
    pub(super) legend: Vec<Entry>,
    pub(super) x_grid: bool,
    pub(super) y_grid: bool,
    /// Space right of the axes (canvas units).
    pub(super) right: i32,
}

/// One entry of a legend.
#[derive(Debug, Clone)]
pub(super) struct Entry {
    pub(super) name: String,
    pub(super) ink: Ink,
    pub(super) glyph: Glyph,
}

/// Symbol of an entry.
#[derive(Debug, Clone, Copy)]
pub(super) enum Glyph {
    Line { dash: &'static str, width: i32, marker: Option<Marker> },
    Point(Marker),
    Area { alpha: f64, outlined: bool },
}

impl Frame<'_> {
    /// Draws the frame over the whole picture and returns its inside, which maps values to positions.
    pub(super) fn draw(&self, pen: &mut Pen) -> Inside {
        let size = pen.size;
        self.draw_panel(pen, (0, 0), size)
    }

    /// Draws the frame in a panel with this upper left corner and size.
    pub(super) fn draw_panel(&self, pen: &mut Pen, corner: Point, size: Point) -> Inside {
        let mut top = corner.1 + EDGE;
        if !self.title.is_empty() {
            pen.bold(self.title, (corner.0 + EDGE, top), TITLE);
            top += TITLE as i32 + 6 * PIXEL;
        }
        top = self.draw_legend(pen, (corner.0, top), size.0) + 6 * PIXEL;

        let widest = self.y.ticks.iter().map(|tick| letters::width(&tick.1, LABEL)).fold(0.0, f64::max);
        let mut left = widest as i32 + 2 * TICK + EDGE;
        if !self.y_text.is_empty() {
            left += LABEL as i32 + 4 * PIXEL;
        }
        let mut below = LABEL as i32 + 2 * TICK + 8 * PIXEL;
        if !self.x_text.is_empty() {
            below += LABEL as i32 + 3 * PIXEL;
        }
        // Half of the last tick label is right of the axis.
        let last = self.x.ticks.last().map_or(0.0, |tick| letters::width(&tick.1, LABEL) / 2.0);
        let right = corner.0 + size.0 - self.right.max(last as i32) - EDGE;
        let (left, bottom) = (corner.0 + left, corner.1 + size.1 - FOOT - below);
        let inside = Inside {
            x: left..right.max(left),
            y: top..bottom.max(top),
            x_scale: self.x.clone(),
            y_scale: self.y.clone(),
        };
        inside.draw_grid(pen, self.x_grid, self.y_grid);
        inside.draw_axes(pen);
        pen.upright(&self.y_text, (corner.0, (top + bottom) / 2), LABEL);
        let foot = corner.1 + size.1 - FOOT;
        pen.text(&self.x_text, ((left + right) / 2, foot), LABEL, HPos::Center, VPos::Bottom);
        inside
    }

    /// Draws the legend from a corner on within a width, and returns where it ends.
    fn draw_legend(&self, pen: &mut Pen, (left, top): Point, width: i32) -> i32 {
        if self.legend.is_empty() {
            return top;
        }
        let (mut x, mut y) = (left + EDGE, top);
        for entry in &self.legend {
            let room = GLYPH + GLYPH_GAP + letters::width(&entry.name, LABEL) as i32;
            if x > left + EDGE && x + room > left + width - EDGE {
                (x, y) = (left + EDGE, y + LEGEND_LINE);
            }
            let middle = y + LEGEND_LINE / 2;
            entry.draw(pen, x, middle);
            pen.text(&entry.name, (x + GLYPH + GLYPH_GAP, middle), LABEL, HPos::Left, VPos::Center);
            x += room + ENTRY_GAP;
        }
        y + LEGEND_LINE
    }
}

impl Entry {
    fn draw(&self, pen: &mut Pen, x: i32, middle: i32) {
        let paint = Paint(self.ink.rgb(), 1.0);
        match self.glyph {
            Glyph::Line { dash, width, marker } => {
                pen.line(&[(x, middle), (x + GLYPH, middle)], paint, width, dash);
                if let Some(marker) = marker {
                    pen.marker(marker, (x + GLYPH / 2, middle), paint);
                }
            }
            Glyph::Point(marker) => pen.marker(marker, (x + GLYPH / 2, middle), paint),
            Glyph::Area { alpha, outlined } => {
                let (inset, half) = (4 * PIXEL, 6 * PIXEL);
                let corners = [(x + inset, middle - half), (x + GLYPH - inset, middle + half)];
                pen.rectangle(corners, Paint(paint.0, alpha));
                if outlined {
                    pen.outline(corners, paint, BOLD);
                }
            }
        }
    }
}

/// The inside of a drawn frame.
pub(super) struct Inside {
    /// Left and right end, in canvas units of the sheet.
    pub(super) x: Range<i32>,
    /// Top and bottom end.
    pub(super) y: Range<i32>,
    x_scale: Scale,
    y_scale: Scale,
}

impl Inside {
    /// Position of a point; `None` if it is not finite, or not positive on a logarithmic axis.
    pub(super) fn position(&self, x: f64, y: f64) -> Option<(i32, i32)> {
        Some((self.across(x)?, self.down(y)?))
    }

    /// Horizontal position of a value.
    pub(super) fn across(&self, x: f64) -> Option<i32> {
        let fraction = self.x_scale.fraction(x)?;
        Some(self.x.start + (fraction * f64::from(self.x.end - self.x.start)).clamp(-1e6, 1e6).round() as i32)
    }

    /// Vertical position of a value.
    pub(super) fn down(&self, y: f64) -> Option<i32> {
        let fraction = self.y_scale.fraction(y)?;
        Some(self.y.end - (fraction * f64::from(self.y.end - self.y.start)).clamp(-1e6, 1e6).round() as i32)
    }

    /// Ends of the line y = x within both axes.
    pub(super) fn diagonal(&self) -> Option<[(i32, i32); 2]> {
        let (x, y) = (&self.x_scale, &self.y_scale);
        let (low, high) = (x.low.max(y.low), x.high.min(y.high));
        if low < high { Some([self.position(low, low)?, self.position(high, high)?]) } else { None }
    }

    /// Position of zero on the vertical axis, or of the end nearest to zero.
    pub(super) fn base(&self) -> i32 {
        self.down(0.0).unwrap_or(self.y.end).clamp(self.y.start, self.y.end)
    }

    /// Whether a position is inside, including the edge.
    pub(super) fn holds(&self, (x, y): (i32, i32)) -> bool {
        (self.x.start..=self.x.end).contains(&x) && (self.y.start..=self.y.end).contains(&y)
    }

    /// Draws "no data" in the middle.
    pub(super) fn draw_empty(&self, pen: &mut Pen) {
        let middle = (self.x.start / 2 + self.x.end / 2, self.y.start / 2 + self.y.end / 2);
        pen.text("no data", middle, TITLE, HPos::Center, VPos::Center);
    }

    /// Draws clipped to the inside, plus the size of a marker.
    pub(super) fn clip(&self, pen: &mut Pen, drawing: impl FnOnce(&mut Pen)) {
        let with_margin = |range: &Range<i32>| range.start - 5 * PIXEL..range.end + 5 * PIXEL;
        pen.within(with_margin(&self.x), with_margin(&self.y), drawing);
    }

    fn draw_grid(&self, pen: &mut Pen, x_grid: bool, y_grid: bool) {
        let positions = |ticks: &[(f64, String)]| ticks.iter().map(|tick| tick.0).collect::<Vec<_>>();
        for (paint, x, y) in [
            (Paint::text(0.05), &self.x_scale.minor, &self.y_scale.minor),
            (Paint::text(0.14), &positions(&self.x_scale.ticks), &positions(&self.y_scale.ticks)),
        ] {
            for x in x.iter().filter(|_| x_grid).filter_map(|x| self.across(*x)) {
                pen.line(&[(x, self.y.start), (x, self.y.end)], paint, THIN, "");
            }
            for y in y.iter().filter(|_| y_grid).filter_map(|y| self.down(*y)) {
                pen.line(&[(self.x.start, y), (self.x.end, y)], paint, THIN, "");
            }
        }
    }

    /// Draws both axes with their ticks and labels.
    fn draw_axes(&self, pen: &mut Pen) {
        let paint = Paint::text(0.5);
        let (left, bottom) = (self.x.start, self.y.end);
        pen.line(&[(left, self.y.start), (left, bottom)], paint, THIN, "");
        for (value, label) in &self.y_scale.ticks {
            let Some(y) = self.down(*value).filter(|y| self.y.contains(y) || *y == bottom) else { continue };
            pen.text(label, (left - 2 * TICK, y), LABEL, HPos::Right, VPos::Center);
            pen.line(&[(left - TICK, y), (left, y)], paint, THIN, "");
        }
        pen.line(&[(left, bottom), (self.x.end, bottom)], paint, THIN, "");
        for (value, label) in &self.x_scale.ticks {
            let within = self.x.start..=self.x.end;
            let Some(x) = self.across(*value).filter(|x| within.contains(x)) else { continue };
            pen.text(label, (x, bottom + 2 * TICK), LABEL, HPos::Center, VPos::Top);
            pen.line(&[(x, bottom), (x, bottom + TICK)], paint, THIN, "");
        }
    }
}
