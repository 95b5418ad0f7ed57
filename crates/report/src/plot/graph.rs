//! Graphs: lines, points, bands and error bars over linear or logarithmic axes.

use std::collections::BTreeSet;

use super::axis::Axis;
use super::frame::{Entry, Frame, Glyph, Inside};
use super::ink::Ink;
use super::pen::{BOLD, Marker, PIXEL, Paint, Pen, Point, THIN, dash};
use super::scale::{Ends, Scale};

/// Size in pixels.
const SIZE: (u32, u32) = (900, 420);

/// Distance between the markers of a line (pixels).
const MARKER_DISTANCE: i32 = 70;

/// Up to this many points, every point of a line has a marker.
const POINTS_WITH_MARKER: usize = 12;

/// Lines with more points are not dashed, since dashes are invisible in noisy lines.
const POINTS_WITH_DASH: usize = 400;

/// A graph.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Graph {
    /// Title; may be empty.
    pub title: String,
    /// Horizontal axis.
    pub x: Axis,
    /// Vertical axis.
    pub y: Axis,
    /// Series in drawing order.
    pub series: Vec<Series>,
    /// Reference lines, such as a noise floor.
    pub references: Vec<Reference>,
    /// Shaded ranges of the horizontal axis, such as rows to measure again.
    pub spans: Vec<Span>,
}

/// One series.
#[derive(Debug, Clone, PartialEq)]
pub struct Series {
    /// Name in the legend; empty for none.
    pub name: String,
    /// Points (x, y); non-finite ones are gaps.
    pub points: Vec<[f64; 2]>,
    /// Lower and upper bound at each point: a band for lines, error bars for points; empty for none.
    pub bounds: Vec<[f64; 2]>,
    /// Lines or points.
    pub mark: Mark,
    /// Colour; by default in the order of the series.
    pub ink: Option<Ink>,
}

/// Style of a series.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Mark {
    /// A line through the points in their order.
    Line,
    /// A marker at each point.
    Points,
}

/// A reference line.
#[derive(Debug, Clone, PartialEq)]
pub enum Reference {
    /// At a y, with its name in the legend.
    Horizontal(f64, String),
    /// At an x, with its name in the legend.
    Vertical(f64, String),
    /// Through the origin with slope 1, such as predicted equals measured.
    Diagonal(String),
}

/// A shaded range of the horizontal axis.
#[derive(Debug, Clone, PartialEq)]
pub struct Span {
    /// Its ends.
    pub range: [f64; 2],
    /// Name in the legend; spans of the same name share an entry.
    pub name: String,
}

impl Series {
    /// A line.
    pub fn line(name: impl Into<String>, points: impl Into<Vec<[f64; 2]>>) -> Self {
        Self { name: name.into(), points: points.into(), bounds: Vec::new(), mark: Mark::Line, ink: None }
    }

    /// Points.
    pub fn points(name: impl Into<String>, points: impl Into<Vec<[f64; 2]>>) -> Self {
        Self { mark: Mark::Points, ..Self::line(name, points) }
    }

    /// A line through values at 0, 1, 2, …
    pub fn sequence(name: impl Into<String>, values: &[f64]) -> Self {
        Self::line(
            name,
            values.iter().enumerate().map(|(index, value)| [index as f64, *value]).collect::<Vec<_>>(),
        )
    }

    /// Sets the colour.
    pub fn ink(mut self, ink: Ink) -> Self {
        self.ink = Some(ink);
        self
    }

    /// Adds a symmetric band or error bars.
    pub fn plus_minus(mut self, sizes: &[f64]) -> Self {
        self.bounds = self.points.iter().zip(sizes).map(|([_, y], size)| [y - size, y + size]).collect();
        self
    }
}

/// A series with its style.
struct Drawn<'a> {
    series: &'a Series,
    ink: Ink,
    dash: &'static str,
    marker: Option<Marker>,
}

impl Graph {
    /// The SVG, 900 × 420 pixels.
    pub fn svg(&self) -> String {
        let name = if self.title.is_empty() { self.y.text() } else { self.title.clone() };
        Pen::draw(SIZE, &name, |pen| self.draw(pen))
    }

    pub(super) fn draw(&self, pen: &mut Pen) {
        let lines = self.series.iter().filter(|series| series.mark == Mark::Line).count();
        let drawn: Vec<Drawn<'_>> = self
            .series
            .iter()
            .enumerate()
            .map(|(index, series)| {
                let line = series.mark == Mark::Line;
                let marked = !line || lines > 1;
                Drawn {
                    series,
                    ink: series.ink.unwrap_or(Ink::nth(index)),
                    dash: if line && series.points.len() <= POINTS_WITH_DASH { dash(index) } else { "" },
                    marker: marked.then_some(Marker::nth(index)),
                }
            })
            .collect();
        let inside = self.frame(&drawn).draw(pen);
        let positions =
            |series: &Series| series.points.iter().any(|[x, y]| inside.position(*x, *y).is_some());
        if !self.series.iter().any(positions) {
            inside.draw_empty(pen);
            return;
        }
        inside.clip(pen, |pen| {
            for span in &self.spans {
                draw_span(&inside, pen, span);
            }
            for drawn in &drawn {
                drawn.draw_bounds(&inside, pen);
            }
            for reference in &self.references {
                draw_reference(&inside, pen, reference);
            }
            for drawn in &drawn {
                drawn.draw(&inside, pen);
            }
        });
    }

    fn frame(&self, drawn: &[Drawn<'_>]) -> Frame<'_> {
        let points = || self.series.iter().flat_map(|series| &series.points);
        let bounds = self.series.iter().flat_map(|series| &series.bounds).flatten().copied();
        let mut legend: Vec<Entry> = drawn.iter().filter_map(Drawn::entry).collect();
        let mut levels = Vec::new();
        let mut positions = Vec::new();
        // Lines of the same name share an entry, as spans do.
        let mut named = BTreeSet::new();
        for reference in &self.references {
            let name = match reference {
                Reference::Horizontal(y, name) => {
                    levels.push(*y);
                    name
                }
                Reference::Vertical(x, name) => {
                    positions.push(*x);
                    name
                }
                Reference::Diagonal(name) => name,
            };
            if named.insert(name) {
                let glyph = Glyph::Line { dash: REFERENCE_DASH, width: THIN, marker: None };
                legend.push(Entry { name: name.clone(), ink: Ink::Text, glyph });
            }
        }
        for span in &self.spans {
            positions.extend(span.range);
            if named.insert(&span.name) {
                let glyph = Glyph::Area { alpha: SPAN_ALPHA, outlined: false };
                legend.push(Entry { name: span.name.clone(), ink: SPAN_INK, glyph });
            }
        }
        legend.retain(|entry| !entry.name.is_empty());
        // Lines extend to the edges; points keep a distance.
        let loose = self.series.iter().any(|series| series.mark == Mark::Points);
        let ends = if loose { Ends::Loose } else { Ends::Tight };
        let x = points().map(|[x, _]| *x).chain(positions);
        let y = points().map(|[_, y]| *y).chain(bounds).chain(levels);
        Frame {
            title: &self.title,
            x: Scale::of(&self.x, x, ends, 9),
            y: Scale::of(&self.y, y, Ends::Loose, 6),
            x_text: self.x.text(),
            y_text: self.y.text(),
            legend,
            x_grid: true,
            y_grid: true,
            right: 0,
        }
    }
}

const REFERENCE_DASH: &str = "2 3";
const SPAN_INK: Ink = Ink::Orange;
const SPAN_ALPHA: f64 = 0.25;

fn draw_span(inside: &Inside, pen: &mut Pen, span: &Span) {
    if let [Some(from), Some(to)] = span.range.map(|x| inside.across(x)) {
        // A single row remains visible.
        let to = to.max(from + 3 * PIXEL);
        pen.rectangle([(from, inside.y.start), (to, inside.y.end)], Paint(SPAN_INK.rgb(), SPAN_ALPHA));
    }
}

fn draw_reference(inside: &Inside, pen: &mut Pen, reference: &Reference) {
    let ends = match reference {
        Reference::Horizontal(y, _) => inside.down(*y).map(|y| [(inside.x.start, y), (inside.x.end, y)]),
        Reference::Vertical(x, _) => inside.across(*x).map(|x| [(x, inside.y.start), (x, inside.y.end)]),
        Reference::Diagonal(_) => inside.diagonal(),
    };
    if let Some(ends) = ends {
        pen.line(&ends, Paint::text(0.7), THIN, REFERENCE_DASH);
    }
}

impl Drawn<'_> {
    fn entry(&self) -> Option<Entry> {
        let glyph = match (self.series.mark, self.marker) {
            (Mark::Points, Some(marker)) => Glyph::Point(marker),
            (_, marker) => Glyph::Line { dash: self.dash, width: BOLD, marker },
        };
        Some(Entry { name: self.series.name.clone(), ink: self.ink, glyph })
            .filter(|entry| !entry.name.is_empty())
    }

    fn draw(&self, inside: &Inside, pen: &mut Pen) {
        let positions = self.series.points.iter().map(|[x, y]| inside.position(*x, *y));
        match (self.series.mark, self.marker) {
            (Mark::Points, Some(marker)) => {
                let positions: Vec<_> = positions.flatten().collect();
                let alpha = if positions.len() > 300 { 0.55 } else { 0.85 };
                // Points within half a pixel of each other are drawn once.
                let mut seen = BTreeSet::new();
                for position in positions {
                    if seen.insert((position.0 / (PIXEL / 2), position.1 / (PIXEL / 2)))
                        && inside.holds(position)
                    {
                        pen.marker(marker, position, Paint(self.ink.rgb(), alpha));
                    }
                }
            }
            _ => runs(positions).into_iter().for_each(|run| self.draw_run(run, pen)),
        }
    }

    fn draw_run(&self, run: Vec<Point>, pen: &mut Pen) {
        let paint = Paint(self.ink.rgb(), 1.0);
        if let Some(marker) = self.marker {
            let all = self.series.points.len() <= POINTS_WITH_MARKER;
            let mut next = i32::MIN;
            for &position in &run {
                if all || position.0 >= next {
                    pen.marker(marker, position, paint);
                    next = position.0 + MARKER_DISTANCE * PIXEL;
                }
            }
        }
        match run[..] {
            // A single point between gaps would be invisible as a line.
            [position] if self.marker.is_none() => pen.marker(Marker::Circle, position, paint),
            _ => pen.line(&thinned(run), paint, BOLD, self.dash),
        }
    }

    fn draw_bounds(&self, inside: &Inside, pen: &mut Pen) {
        let bounded = self.series.points.iter().zip(&self.series.bounds);
        let positions =
            bounded.map(|([x, _], [low, high])| inside.position(*x, *low).zip(inside.position(*x, *high)));
        let color = self.ink.rgb();
        if self.series.mark == Mark::Points {
            for ((x, low), (_, high)) in positions.flatten() {
                let cap = 3 * PIXEL;
                for ends in [
                    [(x, low), (x, high)],
                    [(x - cap, low), (x + cap, low)],
                    [(x - cap, high), (x + cap, high)],
                ] {
                    pen.line(&ends, Paint(color, 0.8), THIN, "");
                }
            }
            return;
        }
        for run in runs(positions) {
            let mut outline = thinned(run.iter().map(|(_, high)| *high).collect());
            outline.extend(thinned(run.iter().map(|(low, _)| *low).collect()).into_iter().rev());
            pen.polygon(&outline, Paint(color, 0.2));
        }
    }
}

/// Runs without gaps.
fn runs<T>(positions: impl Iterator<Item = Option<T>>) -> Vec<Vec<T>> {
    let mut runs = Vec::new();
    let mut run = Vec::new();
    for position in positions {
        match position {
            Some(position) => run.push(position),
            None if run.is_empty() => {}
            None => runs.push(std::mem::take(&mut run)),
        }
    }
    if !run.is_empty() {
        runs.push(run);
    }
    runs
}

/// Reduces a line to at most four points per column of half a pixel (first, lowest, highest, last), which looks the same: 100,000
/// targets then need some hundred kilobytes.
pub(super) fn thinned(run: Vec<Point>) -> Vec<Point> {
    if run.len() < 2_000 {
        return run;
    }
    let mut kept: Vec<Point> = Vec::new();
    for column in run.chunk_by(|a, b| a.0 / (PIXEL / 2) == b.0 / (PIXEL / 2)) {
        let extreme = |index: usize, better: fn(i32, i32) -> bool| {
            (0..column.len())
                .fold(index, |best, i| if better(column[i].1, column[best].1) { i } else { best })
        };
        let mut picks = [0, extreme(0, |a, b| a < b), extreme(0, |a, b| a > b), column.len() - 1];
        picks.sort_unstable();
        kept.extend(picks.iter().map(|&index| column[index]));
    }
    kept.dedup();
    kept
}
