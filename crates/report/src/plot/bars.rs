//! Bar charts with optional whiskers.

use super::axis::Axis;
use super::frame::{Entry, Frame, Glyph, Inside};
use super::ink::Ink;
use super::letters;
use super::pen::{HPos, LABEL, PIXEL, Paint, Pen, THIN, VPos};
use super::scale::{Ends, Scale};
use crate::number::{MISSING, Precision};

/// A bar chart.
#[derive(Debug, Clone, PartialEq)]
pub struct Bars {
    /// Title; may be empty.
    pub title: String,
    /// Value axis. On a logarithmic axis bars start at its lower end.
    pub y: Axis,
    /// Categories along the horizontal axis, such as methods.
    pub names: Vec<String>,
    /// Groups of bars, side by side in each category.
    pub groups: Vec<BarGroup>,
    /// Precision of the number above each bar; `None` for no numbers.
    pub labels: Option<Precision>,
}

/// One bar per category.
#[derive(Debug, Clone, PartialEq)]
pub struct BarGroup {
    /// Name in the legend; may be empty.
    pub name: String,
    /// One value per category; a missing one is marked `–`.
    pub values: Vec<Option<f64>>,
    /// Standard deviations, drawn as whiskers; may be shorter than `values`.
    pub deviations: Vec<Option<f64>>,
    /// Colour; by default in the order of the groups.
    pub ink: Option<Ink>,
}

impl BarGroup {
    /// Values without whiskers.
    pub fn new(name: impl Into<String>, values: impl IntoIterator<Item = Option<f64>>) -> Self {
        Self { name: name.into(), values: values.into_iter().collect(), deviations: Vec::new(), ink: None }
    }
}

impl Bars {
    /// The SVG, 900 × 380 pixels.
    pub fn svg(&self) -> String {
        let name = if self.title.is_empty() { self.y.text() } else { self.title.clone() };
        Pen::draw((900, 380), &name, |pen| self.draw(pen))
    }

    fn draw(&self, pen: &mut Pen) {
        let legend = self.groups.iter().enumerate().filter(|(_, group)| !group.name.is_empty());
        let frame = Frame {
            title: &self.title,
            x: Scale::named(&shortened(&self.names)),
            y: Scale::of(&self.y, self.extent(), Ends::Zero, 6),
            x_text: String::new(),
            y_text: self.y.text(),
            legend: legend
                .map(|(index, group)| Entry {
                    name: group.name.clone(),
                    ink: self.ink(index),
                    glyph: Glyph::Area { alpha: 1.0, outlined: false },
                })
                .collect(),
            x_grid: false,
            y_grid: true,
            right: 0,
        };
        let inside = frame.draw(pen);
        if !self.groups.iter().any(|group| (0..group.values.len()).any(|index| group.value(index).is_some()))
        {
            inside.draw_empty(pen);
            return;
        }
        let slot = f64::from(inside.x.end - inside.x.start) / self.names.len().max(1) as f64;
        let breadth = (slot * 0.78 / self.groups.len().max(1) as f64).min(f64::from(90 * PIXEL));
        for index in 0..self.groups.len() {
            let offset = (index as f64 - (self.groups.len() as f64 - 1.0) / 2.0) * breadth;
            for position in 0..self.names.len() {
                let Some(center) = inside.across(position as f64) else { continue };
                let middle = center + offset.round() as i32;
                self.draw_bar(pen, &inside, (index, position), middle, breadth);
            }
        }
        // The zero line is drawn over the bars.
        let base = inside.base();
        pen.line(&[(inside.x.start, base), (inside.x.end, base)], Paint::text(0.5), THIN, "");
    }

    fn ink(&self, group: usize) -> Ink {
        self.groups[group].ink.unwrap_or(Ink::nth(group + usize::from(self.groups.len() == 1)))
    }

    /// Values that the vertical axis must cover.
    fn extent(&self) -> impl Iterator<Item = f64> {
        let values = self.groups.iter().flat_map(|group| {
            (0..group.values.len()).flat_map(|index| {
                let value = group.value(index);
                let spread = group.deviation(index).unwrap_or(0.0);
                // Space for the number above a bar.
                let room = match (self.labels, value) {
                    (Some(_), Some(value)) if self.y.log => Some((value + spread) * 1.5),
                    (Some(_), Some(value)) => Some((value + spread.copysign(value)) * 1.06),
                    _ => None,
                };
                [value, value.map(|value| value - spread), value.map(|value| value + spread), room]
            })
        });
        values.flatten()
    }

    /// Draws the bar of a group and category at `middle`, with whisker and number, within `breadth`.
    fn draw_bar(
        &self,
        pen: &mut Pen,
        inside: &Inside,
        (index, position): (usize, usize),
        middle: i32,
        breadth: f64,
    ) {
        let group = &self.groups[index];
        let half = (breadth * 0.46).round() as i32;
        let base = inside.base();
        let Some((value, top)) = group.value(position).and_then(|value| Some((value, inside.down(value)?)))
        else {
            pen.text(MISSING, (middle, base - 3 * PIXEL), LABEL, HPos::Center, VPos::Bottom);
            return;
        };
        let top = top.clamp(inside.y.start, inside.y.end);
        let number = Precision::Significant(4).format(value);
        let title = format!("{} {} {number} {}", self.names[position], group.name, self.y.unit);
        pen.titled(&title, |pen| {
            let corners = [(middle - half, top.min(base)), (middle + half, top.max(base))];
            pen.rectangle(corners, Paint(self.ink(index).rgb(), 1.0));
            let mut above = top.min(base);
            if let Some(spread) = group.deviation(position) {
                let ends = [value - spread, value + spread]
                    .map(|end| inside.down(end).unwrap_or(inside.y.end).clamp(inside.y.start, inside.y.end));
                draw_whisker(pen, middle, ends, half / 3);
                above = above.min(ends[1]);
            }
            if let Some(precision) = self.labels {
                let label = precision.format(value);
                let size = LABEL * 0.9;
                // Numbers wider than their bars would overlap.
                if letters::width(&label, size) <= breadth * 1.05 {
                    let (at, side) = if value < 0.0 {
                        (top.max(base) + 2 * PIXEL, VPos::Top)
                    } else {
                        (above - 2 * PIXEL, VPos::Bottom)
                    };
                    pen.text(&label, (middle, at), size, HPos::Center, side);
                }
            }
        });
    }
}

/// Draws a whisker with caps.
fn draw_whisker(pen: &mut Pen, middle: i32, ends: [i32; 2], cap: i32) {
    for path in [
        [(middle, ends[0]), (middle, ends[1])],
        [(middle - cap, ends[0]), (middle + cap, ends[0])],
        [(middle - cap, ends[1]), (middle + cap, ends[1])],
    ] {
        pen.line(&path, Paint::text(0.85), THIN + 2, "");
    }
}

impl BarGroup {
    fn value(&self, index: usize) -> Option<f64> {
        self.values.get(index).copied().flatten().filter(|value| value.is_finite())
    }

    fn deviation(&self, index: usize) -> Option<f64> {
        self.deviations.get(index).copied().flatten().filter(|spread| spread.is_finite() && *spread > 0.0)
    }
}

/// Names shortened with `…` to fit side by side in 800 pixels.
fn shortened(names: &[String]) -> Vec<String> {
    let room = 800.0 * f64::from(PIXEL) / names.len().max(1) as f64 * 0.95;
    names
        .iter()
        .map(|name| {
            let mut short = name.clone();
            while letters::width(&short, LABEL) > room && short.chars().count() > 2 {
                let keep = short.chars().count() - 2;
                short = short.chars().take(keep).collect::<String>() + "…";
            }
            short
        })
        .collect()
}
