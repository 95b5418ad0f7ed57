//! Plan views of paths, coloured by a value such as their deviation, in panels with one colour bar.

use super::axis::Axis;
use super::color_bar::Colors;
use super::frame::{EDGE, Frame, Inside};
use super::ink::ColorMap;
use super::pen::{Marker, PIXEL, Paint, Pen, Point, TITLE};
use super::scale::{Ends, Scale};
use truegrind_math::statistics::extent;

/// Number of colours along a path; all pieces of one colour are a single element.
const SHADES: usize = 96;

/// Points closer than this to the previous one are merged, keeping the largest value (canvas units).
const NEAR: i32 = 2 * PIXEL;

/// Paths in plan view.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct PlanView {
    /// Title; may be empty.
    pub title: String,
    /// Horizontal coordinate; both coordinates have the same scale.
    pub x: Axis,
    /// Vertical coordinate.
    pub y: Axis,
    /// Meaning of the colours, common to all paths.
    pub value: Axis,
    /// Colour map.
    pub colors: ColorMap,
    /// Paths, each in its own panel.
    pub paths: Vec<PlanPath>,
}

/// One path.
#[derive(Debug, Clone, PartialEq)]
pub struct PlanPath {
    /// Title of its panel.
    pub name: String,
    /// Points (x, y).
    pub points: Vec<[f64; 2]>,
    /// Value at each point; grey if not finite.
    pub values: Vec<f64>,
}

impl PlanView {
    /// The SVG, 900 pixels wide, up to three panels in a row.
    pub fn svg(&self) -> String {
        let name = if self.title.is_empty() { self.value.text() } else { self.title.clone() };
        let columns = self.paths.len().clamp(1, 3);
        let rows = self.paths.len().div_ceil(columns).max(1);
        // The height of the panels follows the aspect ratio of the paths.
        let span = |axis: usize| {
            let ends = self.paths.iter().flat_map(|path| &path.points).map(|point| point[axis]);
            let [low, high] = extent(ends.filter(|end| end.is_finite()));
            high - low
        };
        let aspect = span(1) / span(0);
        let width = 800.0 / columns as f64 - 75.0;
        // Also replaces NaN, without points.
        let inside = if aspect > 0.0 { (width * aspect * 1.1).clamp(140.0, 560.0) } else { 200.0 };
        let height = inside as u32 + 96;
        Pen::draw((900, 30 + height * rows as u32), &name, |pen| self.draw(pen, columns, rows))
    }

    fn draw(&self, pen: &mut Pen, columns: usize, rows: usize) {
        let (width, height) = pen.size;
        let values = self.paths.iter().flat_map(|path| &path.values).copied();
        let colors = Colors::of(&self.value, self.colors, values);
        let mut top = EDGE / 2;
        if !self.title.is_empty() {
            pen.bold(&self.title, (EDGE, EDGE), TITLE);
            top += 24 * PIXEL;
        }
        let right = width - colors.room();
        let (across, down) = (right / columns as i32, (height - top) / rows as i32);
        let mut bar = (top + EDGE, height - EDGE);
        for index in 0..self.paths.len().max(1) {
            let corner = ((index % columns) as i32 * across, top + (index / columns) as i32 * down);
            let frame = self.frame(self.paths.get(index), (across, down));
            let inside = frame.draw_panel(pen, corner, (across, down));
            if let Some(path) = self.paths.get(index) {
                inside.clip(pen, |pen| path.draw(&inside, &colors, pen));
            }
            if self.paths.get(index).is_none_or(|path| path.points.is_empty()) {
                inside.draw_empty(pen);
            }
            if index == 0 {
                bar.0 = inside.y.start;
            }
            bar.1 = inside.y.end;
        }
        colors.draw(pen, right + 6 * PIXEL, bar.0, bar.1);
    }

    /// A frame with equal scales around all paths, so that panels can be compared.
    fn frame<'a>(&'a self, path: Option<&'a PlanPath>, (across, down): (i32, i32)) -> Frame<'a> {
        let points = || self.paths.iter().flat_map(|path| &path.points);
        let ticks = if across > 500 * PIXEL { 8 } else { 4 };
        let x = Scale::of(&linear(&self.x), points().map(|point| point[0]), Ends::Around, ticks);
        let y = Scale::of(&linear(&self.y), points().map(|point| point[1]), Ends::Around, ticks);
        // Approximate inside of the frame; exact to the width of a tick label.
        let room = [across - 80 * PIXEL, down - 96 * PIXEL].map(|room| f64::from(room.max(PIXEL)));
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
    fn draw(&self, inside: &Inside, colors: &Colors, pen: &mut Pen) {
        let mut rim: Vec<Vec<Point>> = Vec::new();
        let mut unknown: Vec<Vec<Point>> = Vec::new();
        let mut shades: Vec<Vec<Vec<Point>>> = vec![Vec::new(); SHADES + 1];
        for run in self.runs(inside) {
            if let [(position, value)] = run[..] {
                let paint =
                    colors.fraction(value).map_or(Paint::text(0.3), |fraction| colors.paint(fraction));
                pen.marker(Marker::Circle, position, paint);
            }
            rim.push(run.iter().map(|(position, _)| *position).collect());
            let mut last = None;
            for pair in run.windows(2) {
                // The piece between two points shows their mean value.
                let value = pair[0].1 / 2.0 + pair[1].1 / 2.0;
                let shade =
                    colors.fraction(value).map(|fraction| (fraction * SHADES as f64).round() as usize);
                let lines = match shade {
                    Some(shade) => &mut shades[shade],
                    None => &mut unknown,
                };
                match lines.last_mut() {
                    Some(line) if last == Some(shade) => line.push(pair[1].0),
                    _ => lines.push(vec![pair[0].0, pair[1].0]),
                }
                last = Some(shade);
            }
        }
        // A faint outline separates pale colours from a light page and dark ones from a dark page.
        pen.lines(&rim, Paint::text(0.35), 5 * PIXEL, true);
        pen.lines(&unknown, Paint::text(0.3), 34, true);
        for (shade, lines) in shades.iter().enumerate() {
            pen.lines(lines, colors.paint(shade as f64 / SHADES as f64), 34, true);
        }
    }

    /// Runs of the path without gaps, as positions and values; near points are merged, keeping the largest value.
    fn runs(&self, inside: &Inside) -> Vec<Vec<(Point, f64)>> {
        let mut runs: Vec<Vec<(Point, f64)>> = vec![Vec::new()];
        for (index, [x, y]) in self.points.iter().enumerate() {
            let value = self.values.get(index).copied().unwrap_or(f64::NAN);
            let Some(position) = inside.position(*x, *y) else {
                runs.push(Vec::new());
                continue;
            };
            let Some(run) = runs.last_mut() else { continue };
            match run.last_mut() {
                Some((before, kept))
                    if (position.0 - before.0).abs() < NEAR
                        && (position.1 - before.1).abs() < NEAR
                        && kept.is_nan() == value.is_nan() =>
                {
                    if value.abs() > kept.abs() {
                        *kept = value;
                    }
                }
                _ => run.push((position, value)),
            }
        }
        runs.retain(|run| !run.is_empty());
        runs
    }
}
