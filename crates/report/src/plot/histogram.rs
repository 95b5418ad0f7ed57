//! Histograms of one or more samples over common bins.

use super::axis::Axis;
use super::frame::{Entry, Frame, Glyph};
use super::ink::Ink;
use super::pen::{BOLD, Paint, Pen, dash};
use super::scale::{Ends, Scale, linear_ticks};

/// More bins would show noise.
const MAX_BINS: usize = 60;

/// A histogram.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Histogram {
    /// Title; may be empty.
    pub title: String,
    /// Value axis; always drawn linear.
    pub x: Axis,
    /// Samples, drawn over each other.
    pub samples: Vec<Sample>,
    /// Approximate number of bins; by default from the data.
    pub bins: Option<usize>,
}

/// One sample.
#[derive(Debug, Clone, PartialEq)]
pub struct Sample {
    /// Name in the legend.
    pub name: String,
    /// Values; non-finite ones are ignored.
    pub values: Vec<f64>,
    /// Colour; by default in the order of the samples.
    pub ink: Option<Ink>,
}

impl Sample {
    /// A sample.
    pub fn new(name: impl Into<String>, values: impl Into<Vec<f64>>) -> Self {
        Self { name: name.into(), values: values.into(), ink: None }
    }

    /// Sets the colour.
    pub fn ink(mut self, ink: Ink) -> Self {
        self.ink = Some(ink);
        self
    }
}

/// Counts of every sample in common bins.
#[derive(Debug, Clone, PartialEq)]
pub struct Bins {
    /// Edges of the bins, one more than bins; empty without data. A bin includes its lower edge, the last also its upper edge.
    pub edges: Vec<f64>,
    /// Counts of each sample.
    pub counts: Vec<Vec<usize>>,
}

impl Histogram {
    /// Counts in bins of a round width. By default the width is that of Freedman and Diaconis (twice the interquartile range over the
    /// cube root of the count), the smallest over the samples.
    pub fn bins(&self) -> Bins {
        let samples: Vec<Vec<f64>> = self.samples.iter().map(|sample| sorted(&sample.values)).collect();
        let ends = samples.iter().filter_map(|sample| Some((*sample.first()?, *sample.last()?)));
        let Some((low, high)) = ends.reduce(|a, b| (a.0.min(b.0), a.1.max(b.1))) else {
            return Bins { edges: Vec::new(), counts: vec![Vec::new(); self.samples.len()] };
        };
        let span = high - low;
        let wanted = self.bins.unwrap_or_else(|| {
            let width = samples.iter().filter_map(|sample| freedman_diaconis(sample)).fold(span, f64::min);
            ((span / width).ceil() as usize).clamp(5, MAX_BINS)
        });
        let edges = edges(low, high, wanted.max(1));
        let counts = samples.iter().map(|sample| count(sample, &edges)).collect();
        Bins { edges, counts }
    }

    /// The SVG, 900 × 340 pixels.
    pub fn svg(&self) -> String {
        let name = if self.title.is_empty() {
            format!("histogram of {}", self.x.text())
        } else {
            self.title.clone()
        };
        Pen::draw((900, 340), &name, |pen| self.draw(pen))
    }

    fn draw(&self, pen: &mut Pen) {
        let bins = self.bins();
        let ink = |index: usize| self.samples[index].ink.unwrap_or(Ink::nth(index));
        let axis = Axis { log: false, ..self.x.clone() };
        let largest = bins.counts.iter().flatten().max().copied().unwrap_or(1) as f64;
        let legend = (0..self.samples.len()).filter(|&index| !self.samples[index].name.is_empty());
        let frame = Frame {
            title: &self.title,
            x: Scale::of(&axis, bins.edges.iter().copied(), Ends::Loose, 9),
            y: Scale::of(&Axis::default(), [0.0, largest.max(4.0)].into_iter(), Ends::Loose, 5),
            x_text: self.x.text(),
            y_text: "count".to_owned(),
            legend: legend
                .map(|index| Entry {
                    name: self.samples[index].name.clone(),
                    ink: ink(index),
                    glyph: Glyph::Area { alpha: ALPHA, outlined: true },
                })
                .collect(),
            x_grid: false,
            y_grid: true,
            right: 0,
        };
        let inside = frame.draw(pen);
        if bins.edges.is_empty() {
            inside.draw_empty(pen);
            return;
        }
        inside.clip(pen, |pen| {
            for (index, counts) in bins.counts.iter().enumerate() {
                let mut outline = Vec::new();
                // From the first bin that holds anything to the last.
                let held = counts
                    .iter()
                    .position(|count| *count > 0)
                    .zip(counts.iter().rposition(|count| *count > 0));
                let Some((first, last)) = held else { continue };
                for (bin, &count) in counts.iter().enumerate().take(last + 1).skip(first) {
                    let ends = [
                        inside.position(bins.edges[bin], count as f64),
                        inside.position(bins.edges[bin + 1], count as f64),
                    ];
                    outline.extend(ends.into_iter().flatten());
                }
                let (Some(first), Some(last)) = (outline.first().copied(), outline.last().copied()) else {
                    continue;
                };
                let base = inside.base();
                outline.insert(0, (first.0, base));
                outline.push((last.0, base));
                let color = ink(index).rgb();
                pen.polygon(&outline, Paint(color, ALPHA));
                pen.line(&outline, Paint(color, 1.0), BOLD, dash(index));
            }
        });
    }
}

const ALPHA: f64 = 0.28;

fn sorted(values: &[f64]) -> Vec<f64> {
    let mut values: Vec<f64> = values.iter().copied().filter(|value| value.is_finite()).collect();
    values.sort_unstable_by(f64::total_cmp);
    values
}

fn freedman_diaconis(sorted: &[f64]) -> Option<f64> {
    let quartile = |part: usize| sorted.get((sorted.len().checked_sub(1)? * part + 2) / 4).copied();
    let width = 2.0 * (quartile(3)? - quartile(1)?) / (sorted.len() as f64).cbrt();
    Some(width).filter(|width| *width > 0.0 && width.is_finite())
}

/// Round ends that enclose the data.
fn edges(low: f64, high: f64, wanted: usize) -> Vec<f64> {
    let span = high - low;
    let size = low.abs().max(high.abs());
    if span <= size * 1e-12 || !span.is_finite() {
        // A constant has one bin around it.
        let room = if size == 0.0 { 0.5 } else { size * 0.05 };
        return vec![low - room, high + room];
    }
    let mut edges = linear_ticks(low, high, wanted);
    let width = match edges[..] {
        [first, second, ..] => second - first,
        _ => return vec![low, high],
    };
    if edges[0] > low {
        edges.insert(0, edges[0] - width);
    }
    let last = edges[edges.len() - 1];
    if last < high {
        edges.push(last + width);
    }
    edges
}

fn count(sorted: &[f64], edges: &[f64]) -> Vec<usize> {
    let mut counts = vec![0; edges.len().saturating_sub(1)];
    let Some(last) = counts.len().checked_sub(1) else { return counts };
    for value in sorted {
        // Ends are rounded, so a value may lie a rounding error beyond the outermost: it belongs to that bin.
        let bin = edges.partition_point(|edge| edge <= value).saturating_sub(1).min(last);
        counts[bin] += 1;
    }
    counts
}
