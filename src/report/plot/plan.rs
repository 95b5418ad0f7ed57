//! Paths seen from above, coloured by a value such as their deviation; several beside each other with one colour bar.

use plotters::style::text_anchor::{HPos, VPos};

use super::Axis;
use super::canvas::{DrawingError, PIXEL};
use super::color_bar::Colors;
use super::frame::{EDGE, Frame, Inside, picture};
use super::ink::ColorMap;
use super::pen::{Marker, Paint, Pen, TITLE};
use super::scale::{Ends, Scale};

/// Colours told apart along a path. Neighbouring pieces of the same one are drawn as one line.
const SHADES: f64 = 96.0;

/// Paths in plan view.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct PlanView {
    /// Title inside the picture; may be empty.
    pub title: String,
    /// Horizontal coordinate. Both coordinates have the same scale, so that shapes are true.
    pub x: Axis,
    /// Vertical coordinate.
    pub y: Axis,
    /// What the colours mean; all paths share it.
    pub value: Axis,
    /// The colours.
    pub colors: ColorMap,
    /// The paths, each in a panel of its own.
    pub paths: Vec<PlanPath>,
}

/// One path.
#[derive(Debug, Clone, PartialEq)]
pub struct PlanPath {
    /// Name over its panel.
    pub name: String,
    /// Its points, x and y.
    pub points: Vec<[f64; 2]>,
    /// The value at each point. Where it is not finite the path is grey.
    pub values: Vec<f64>,
}

impl PlanView {
    /// The picture, 900 pixels wide, up to three panels in a row.
    pub fn svg(&self) -> String {
        let name = if self.title.is_empty() { self.value.text() } else { self.title.clone() };
        let columns = self.paths.len().clamp(1, 3);
        let rows = self.paths.len().div_ceil(columns).max(1);
        let height = if columns == 1 { 460 } else { 360 };
        picture((900, 40 + height * rows as u32), &name, |pen| self.draw(pen, columns, rows))
    }

    fn draw(&self, pen: Pen<'_>, columns: usize, rows: usize) -> Result<(), DrawingError> {
        let (width, height) = pen.area.dim_in_pixel();
        let values = self.paths.iter().flat_map(|path| &path.values).copied();
        let colors = Colors::of(&self.value, self.colors, values);
        let mut top = EDGE / 2;
        if !self.title.is_empty() {
            pen.bold(&self.title, (EDGE, EDGE), TITLE, HPos::Left, VPos::Top)?;
            top += 24 * PIXEL;
        }
        let right = width as i32 - colors.room();
        let (across, down) = (right / columns as i32, (height as i32 - top) / rows as i32);
        let mut bar = (top + EDGE, height as i32 - EDGE);
        for index in 0..self.paths.len().max(1) {
            let corner = ((index % columns) as i32 * across, top + (index / columns) as i32 * down);
            let panel = pen.area.clone().shrink(corner, (across as u32, down as u32));
            let frame = self.frame(self.paths.get(index), (across, down));
            let inside = frame.draw(Pen { area: &panel, sheet: pen.sheet })?;
            if let Some(path) = self.paths.get(index) {
                inside.cut(pen, || path.draw(&inside, &colors, pen))?;
            }
            if index == 0 {
                bar.0 = inside.y.start;
            }
            bar.1 = inside.y.end;
        }
        colors.draw(pen, right + 6 * PIXEL, bar.0, bar.1)
    }

    /// A frame whose axes have the same scale, around all paths so that panels can be compared.
    fn frame<'a>(&'a self, path: Option<&'a PlanPath>, (across, down): (i32, i32)) -> Frame<'a> {
        let points = || self.paths.iter().flat_map(|path| &path.points);
        let ticks = if across > 500 * PIXEL { 8 } else { 4 };
        let x = Scale::of(&linear(&self.x), points().map(|point| point[0]), Ends::Around, ticks);
        let y = Scale::of(&linear(&self.y), points().map(|point| point[1]), Ends::Around, ticks);
        // About what the frame leaves inside; exact to the width of a tick label.
        let room = [across - 80 * PIXEL, down - 90 * PIXEL].map(|room| f64::from(room.max(PIXEL)));
        let per_unit = ((x.high - x.low) / room[0]).max((y.high - y.low) / room[1]);
        let widened = |scale: &Scale, room: f64| {
            let (middle, half) = (scale.low / 2.0 + scale.high / 2.0, per_unit * room / 2.0);
            Scale::between(middle - half, middle + half, false, ticks)
        };
        Frame {
            title: path.map_or("", |path| &path.name),
            x: widened(&x, room[0]),
            y: widened(&y, room[1]),
            x_text: self.x.text(),
            y_text: self.y.text(),
            legend: Vec::new(),
            x_grid: true,
            y_grid: true,
            right: 0,
        }
    }
}

fn linear(axis: &Axis) -> Axis {
    Axis { log: false, ..axis.clone() }
}

impl PlanPath {
    fn draw(&self, inside: &Inside, colors: &Colors, pen: Pen<'_>) -> Result<(), DrawingError> {
        // A value belongs to a point; a piece between two points shows their mean. `None` where either is unknown.
        let mut pieces: Vec<(Option<i64>, Vec<(i32, i32)>)> = Vec::new();
        let mut before: Option<((i32, i32), f64)> = None;
        for (index, [x, y]) in self.points.iter().enumerate() {
            let value = self.values.get(index).copied().unwrap_or(f64::NAN);
            let Some(place) = inside.place(*x, *y) else {
                before = None;
                continue;
            };
            if let Some((start, earlier)) = before {
                let shade =
                    colors.fraction(earlier / 2.0 + value / 2.0).map(|part| (part * SHADES).round() as i64);
                match pieces.last_mut() {
                    Some((last, points)) if *last == shade && points.last() == Some(&start) => {
                        points.push(place)
                    }
                    _ => pieces.push((shade, vec![start, place])),
                }
            }
            before = Some((place, value));
        }
        if let ([point], [value, ..]) = (&self.points[..], &self.values[..])
            && let (Some(place), Some(part)) = (inside.place(point[0], point[1]), colors.fraction(*value))
        {
            return pen.marker(Marker::Circle, place, colors.paint(part));
        }
        // A faint rim sets pale colours off from a pale page.
        for (_, points) in &pieces {
            pen.line(points.clone(), Paint::text(0.35), 5 * PIXEL as u32, "")?;
        }
        for (shade, points) in pieces {
            let paint = shade.map_or(Paint::text(0.3), |shade| colors.paint(shade as f64 / SHADES));
            pen.line(points, paint, 34, "")?;
        }
        Ok(())
    }
}
