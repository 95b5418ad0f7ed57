//! Frame of a plot: title, legend, grid, axes with ticks and labels.

use std::ops::Range;

use plotters::chart::ChartBuilder;
use plotters::style::FontStyle;
use plotters::style::text_anchor::{HPos, VPos};

use super::canvas::{Area, DrawingError, PIXEL};
use super::ink::Ink;
use super::letters;
use super::pen::{BOLD, LABEL, Marker, Paint, Pen, THIN, TITLE, stroke, text};
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
    Line { dash: &'static str, width: u32, marker: Option<Marker> },
    Point(Marker),
    Area { alpha: f64, outlined: bool },
}

impl Frame<'_> {
    /// Draws the frame and returns its inside, which maps values to positions on the sheet.
    pub(super) fn draw(&self, pen: Pen<'_>) -> Result<Inside, DrawingError> {
        let area = pen.area;
        let mut top = EDGE;
        if !self.title.is_empty() {
            pen.bold(self.title, (EDGE, top), TITLE, HPos::Left, VPos::Top)?;
            top += TITLE as i32 + 6 * PIXEL;
        }
        top = self.draw_legend(pen, top)? + 6 * PIXEL;

        let widest = self.y.ticks.iter().map(|tick| letters::width(&tick.1, LABEL)).fold(0.0, f64::max);
        let mut left = widest as i32 + 2 * TICK + EDGE;
        if !self.y_text.is_empty() {
            left += LABEL as i32 + 4 * PIXEL;
        }
        let mut bottom = LABEL as i32 + 2 * TICK + 8 * PIXEL;
        if !self.x_text.is_empty() {
            bottom += LABEL as i32 + 3 * PIXEL;
        }
        // Half of the last tick label is right of the axis.
        let last = self.x.ticks.last().map_or(0.0, |tick| letters::width(&tick.1, LABEL) / 2.0);
        let mut chart = ChartBuilder::on(area)
            .margin_top(top)
            .margin_right(self.right.max(last as i32) + EDGE)
            .margin_bottom(FOOT)
            .x_label_area_size(bottom)
            .y_label_area_size(left)
            .build_cartesian_2d(self.x.clone(), self.y.clone())?;
        let labels = text(LABEL, FontStyle::Normal, HPos::Center, VPos::Center);
        let mut mesh = chart.configure_mesh();
        mesh.bold_line_style(stroke(Paint::text(0.14), THIN))
            .light_line_style(stroke(Paint::text(0.05), THIN))
            .axis_style(stroke(Paint::text(0.5), THIN))
            .label_style(labels.clone())
            .axis_desc_style(labels)
            .set_all_tick_mark_size(TICK)
            .x_desc(self.x_text.clone())
            .y_desc(self.y_text.clone());
        if !self.x_grid {
            mesh.disable_x_mesh();
        }
        if !self.y_grid {
            mesh.disable_y_mesh();
        }
        mesh.draw()?;
        let (x, y) = chart.plotting_area().get_pixel_range();
        Ok(Inside { x, y, x_scale: self.x.clone(), y_scale: self.y.clone() })
    }

    fn draw_legend(&self, pen: Pen<'_>, top: i32) -> Result<i32, DrawingError> {
        if self.legend.is_empty() {
            return Ok(top);
        }
        let width = pen.area.dim_in_pixel().0 as i32;
        let (mut x, mut y) = (EDGE, top);
        for entry in &self.legend {
            let room = GLYPH + GLYPH_GAP + letters::width(&entry.name, LABEL) as i32;
            if x > EDGE && x + room > width - EDGE {
                (x, y) = (EDGE, y + LEGEND_LINE);
            }
            let middle = y + LEGEND_LINE / 2;
            entry.draw(pen, x, middle)?;
            pen.text(&entry.name, (x + GLYPH + GLYPH_GAP, middle), LABEL, HPos::Left, VPos::Center)?;
            x += room + ENTRY_GAP;
        }
        Ok(y + LEGEND_LINE)
    }
}

impl Entry {
    fn draw(&self, pen: Pen<'_>, x: i32, middle: i32) -> Result<(), DrawingError> {
        let color = self.ink.rgb();
        match self.glyph {
            Glyph::Line { dash, width, marker } => {
                pen.line(vec![(x, middle), (x + GLYPH, middle)], Paint(color, 1.0), width, dash)?;
                match marker {
                    Some(marker) => pen.marker(marker, (x + GLYPH / 2, middle), Paint(color, 1.0)),
                    None => Ok(()),
                }
            }
            Glyph::Point(marker) => pen.marker(marker, (x + GLYPH / 2, middle), Paint(color, 1.0)),
            Glyph::Area { alpha, outlined } => {
                let (inset, half) = (4 * PIXEL, 6 * PIXEL);
                let corners = [(x + inset, middle - half), (x + GLYPH - inset, middle + half)];
                pen.rectangle(corners, Paint(color, alpha))?;
                if outlined { pen.outline(corners, Paint(color, 1.0), BOLD) } else { Ok(()) }
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
    pub(super) fn place(&self, x: f64, y: f64) -> Option<(i32, i32)> {
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
        if low < high { Some([self.place(low, low)?, self.place(high, high)?]) } else { None }
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
    pub(super) fn draw_empty(&self, pen: Pen<'_>) -> Result<(), DrawingError> {
        let middle = (self.x.start / 2 + self.x.end / 2, self.y.start / 2 + self.y.end / 2);
        pen.text("no data", middle, TITLE, HPos::Center, VPos::Center)
    }

    /// Draws clipped to the inside, plus the size of a marker.
    pub(super) fn clip(
        &self,
        pen: Pen<'_>,
        drawing: impl FnOnce() -> Result<(), DrawingError>,
    ) -> Result<(), DrawingError> {
        let margin = 5 * PIXEL;
        pen.sheet.open_window(
            self.x.start - margin..self.x.end + margin,
            self.y.start - margin..self.y.end + margin,
        );
        let drawn = drawing();
        pen.sheet.close_window();
        drawn
    }
}

/// Draws a plot (size in pixels).
pub(super) fn picture(
    size: (u32, u32),
    name: &str,
    drawing: impl FnOnce(Pen<'_>) -> Result<(), DrawingError>,
) -> String {
    super::canvas::draw(size, name, |area: &Area, sheet| drawing(Pen { area, sheet }))
}
