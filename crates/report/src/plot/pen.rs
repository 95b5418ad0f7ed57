//! Writes SVG: lines, areas, markers and text.
//!
//! Lengths are integers in tenths of a pixel, so that every coordinate has at most one decimal.

use std::fmt::{Arguments, Write};
use std::ops::Range;

use super::letters;
use crate::format::html::escape;

/// Canvas units per pixel.
pub(super) const PIXEL: i32 = 10;
/// Font size of labels.
pub(super) const LABEL: f64 = 13.0 * PIXEL as f64;
/// Font size of titles.
pub(super) const TITLE: f64 = 14.5 * PIXEL as f64;
/// Width of data lines.
pub(super) const BOLD: i32 = 18;
/// Width of auxiliary lines.
pub(super) const THIN: i32 = 10;
/// Half the size of a marker.
pub(super) const MARKER: i32 = 4 * PIXEL;

/// A position: right and down.
pub(super) type Point = (i32, i32);

/// An SVG document under construction.
pub(super) struct Pen {
    svg: String,
    /// Width and height.
    pub(super) size: Point,
}

/// A colour with its opacity.
#[derive(Clone, Copy)]
pub(super) struct Paint(pub(super) [u8; 3], pub(super) f64);

impl Paint {
    /// Text colour of the page.
    pub(super) fn text(alpha: f64) -> Self {
        Paint([0; 3], alpha)
    }

    /// SVG colour; black is the text colour of the page.
    fn color(self) -> String {
        match self.0 {
            [0, 0, 0] => "currentColor".to_owned(),
            [red, green, blue] => format!("#{red:02X}{green:02X}{blue:02X}"),
        }
    }

    /// The attributes of a `fill` or a `stroke`.
    fn attributes(self, kind: &str) -> String {
        let mut attributes = format!(" {kind}=\"{}\"", self.color());
        if self.1 < 1.0 {
            let alpha = (self.1 * 1000.0).round() / 1000.0;
            attributes += &format!(" {kind}-opacity=\"{alpha}\"");
        }
        attributes
    }

    /// The attributes of a line of some width.
    fn stroke(self, width: i32) -> String {
        format!("{} fill=\"none\" stroke-width=\"{}\"", self.attributes("stroke"), px(width))
    }
}

/// Which part of a text is at its horizontal position.
#[derive(Clone, Copy)]
pub(super) enum HPos {
    Left,
    Center,
    Right,
}

/// Which part of a text is at its vertical position.
#[derive(Clone, Copy)]
pub(super) enum VPos {
    Top,
    Center,
    Bottom,
}

/// Shape of a marker.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Marker {
    Circle,
    Square,
    Triangle,
    Diamond,
    Cross,
    Ring,
}

impl Marker {
    /// Marker of the nth series, from 0.
    pub(super) fn nth(index: usize) -> Self {
        const CYCLE: [Marker; 6] =
            [Marker::Circle, Marker::Square, Marker::Triangle, Marker::Diamond, Marker::Cross, Marker::Ring];
        CYCLE[index % CYCLE.len()]
    }
}

/// SVG dash pattern of the nth series in pixels; the first is solid.
pub(super) fn dash(index: usize) -> &'static str {
    const DASHES: [&str; 6] = ["", "8 4", "3 3", "10 4 3 4", "15 5", "6 3 2 3 2 3"];
    DASHES[index % DASHES.len()]
}

impl Pen {
    /// The SVG document of a drawing (size in pixels). `name`: label for screen readers.
    pub(super) fn draw((width, height): (u32, u32), name: &str, drawing: impl FnOnce(&mut Pen)) -> String {
        let size = (width as i32 * PIXEL, height as i32 * PIXEL);
        let mut pen = Pen { svg: String::with_capacity(16_384), size };
        pen.write(format_args!(
            "<svg xmlns=\"http://www.w3.org/2000/svg\" viewBox=\"0 0 {width} {height}\" role=\"img\" \
             aria-label=\"{}\" font-family=\"{}\">\n",
            escape(name),
            letters::FAMILY
        ));
        drawing(&mut pen);
        pen.svg + "</svg>\n"
    }

    /// Draws clipped to a window. A nested `svg` element clips without the page-wide ids that `clipPath` needs.
    pub(super) fn within(&mut self, x: Range<i32>, y: Range<i32>, drawing: impl FnOnce(&mut Pen)) {
        let (left, top) = (px(x.start), px(y.start));
        let (width, height) = (px(x.end - x.start), px(y.end - y.start));
        self.write(format_args!(
            "<svg x=\"{left}\" y=\"{top}\" width=\"{width}\" height=\"{height}\" viewBox=\"{left} {top} {width} {height}\">\n"
        ));
        drawing(self);
        self.write(format_args!("</svg>\n"));
    }

    /// Draws a group with a tooltip.
    pub(super) fn titled(&mut self, title: &str, drawing: impl FnOnce(&mut Pen)) {
        self.write(format_args!("<g><title>{}</title>\n", escape(title)));
        drawing(self);
        self.write(format_args!("</g>\n"));
    }

    /// Lines of one colour and width as a single element, which is much shorter than one element each. Round ends hide seams between
    /// consecutive lines; otherwise lines end exactly.
    pub(super) fn lines(&mut self, lines: &[Vec<Point>], paint: Paint, width: i32, round: bool) {
        if lines.is_empty() {
            return;
        }
        let mut path = String::new();
        for line in lines {
            for (index, &(x, y)) in line.iter().enumerate() {
                path += &format!("{}{} {}", if index == 0 { "M" } else { "L" }, px(x), px(y));
            }
        }
        let ends = if round { " stroke-linecap=\"round\" stroke-linejoin=\"round\"" } else { "" };
        self.write(format_args!("<path d=\"{path}\"{}{ends}/>\n", paint.stroke(width)));
    }

    pub(super) fn line(&mut self, points: &[Point], paint: Paint, width: i32, dash: &str) {
        let (points, stroke) = (listed(points), paint.stroke(width));
        let dash = if dash.is_empty() { String::new() } else { format!(" stroke-dasharray=\"{dash}\"") };
        self.write(format_args!("<polyline points=\"{points}\"{stroke} stroke-linejoin=\"round\"{dash}/>\n"));
    }

    pub(super) fn polygon(&mut self, outline: &[Point], paint: Paint) {
        self.write(format_args!("<polygon points=\"{}\"{}/>\n", listed(outline), paint.attributes("fill")));
    }

    pub(super) fn rectangle(&mut self, corners: [Point; 2], paint: Paint) {
        self.framed(corners, &paint.attributes("fill"));
    }

    pub(super) fn outline(&mut self, corners: [Point; 2], paint: Paint, width: i32) {
        self.framed(corners, &paint.stroke(width));
    }

    fn framed(&mut self, [(left, top), (right, bottom)]: [Point; 2], style: &str) {
        let (x, y) = (px(left.min(right)), px(top.min(bottom)));
        let (width, height) = (px((right - left).abs()), px((bottom - top).abs()));
        self.write(format_args!(
            "<rect x=\"{x}\" y=\"{y}\" width=\"{width}\" height=\"{height}\"{style}/>\n"
        ));
    }

    pub(super) fn marker(&mut self, marker: Marker, (x, y): Point, paint: Paint) {
        let r = MARKER;
        let h = r * 8 / 10;
        match marker {
            Marker::Circle | Marker::Ring => {
                let style = if marker == Marker::Ring { paint.stroke(15) } else { paint.attributes("fill") };
                let (x, y, r) = (px(x), px(y), px(r * 9 / 10));
                self.write(format_args!("<circle cx=\"{x}\" cy=\"{y}\" r=\"{r}\"{style}/>\n"));
            }
            Marker::Square => self.rectangle([(x - h, y - h), (x + h, y + h)], paint),
            Marker::Triangle => {
                self.polygon(&[(x - r, y + r * 7 / 10), (x + r, y + r * 7 / 10), (x, y - r)], paint);
            }
            Marker::Diamond => {
                let h = r * 11 / 10;
                self.polygon(&[(x - h, y), (x, y - h), (x + h, y), (x, y + h)], paint);
            }
            Marker::Cross => {
                self.line(&[(x - h, y - h), (x + h, y + h)], paint, 16, "");
                self.line(&[(x - h, y + h), (x + h, y - h)], paint, 16, "");
            }
        }
    }

    pub(super) fn text(&mut self, words: &str, at: Point, size: f64, horizontal: HPos, vertical: VPos) {
        self.letter(words, at, size, horizontal, vertical, "");
    }

    /// Bold text with its upper left corner at the point.
    pub(super) fn bold(&mut self, words: &str, at: Point, size: f64) {
        self.letter(words, at, size, HPos::Left, VPos::Top, " font-weight=\"bold\"");
    }

    /// Text from bottom to top, centred vertically at the point and to its right.
    pub(super) fn upright(&mut self, words: &str, (x, y): Point, size: f64) {
        let turned = format!(" transform=\"rotate(270 {} {})\"", px(x), px(y));
        self.letter(words, (x, y), size, HPos::Center, VPos::Top, &turned);
    }

    fn letter(&mut self, words: &str, (x, y): Point, size: f64, across: HPos, down: VPos, style: &str) {
        if words.is_empty() {
            return;
        }
        let anchor = match across {
            HPos::Left => "start",
            HPos::Center => "middle",
            HPos::Right => "end",
        };
        // Offset of the baseline in units of the font size: capitals are 0.72 high, descenders 0.21 deep.
        let drop = match down {
            VPos::Top => "0.76em",
            VPos::Center => "0.36em",
            VPos::Bottom => "-0.22em",
        };
        let (x, y, size) = (px(x), px(y), size / f64::from(PIXEL));
        let (fill, words) = (Paint::text(0.85).attributes("fill"), escape(words));
        self.write(format_args!(
            "<text x=\"{x}\" y=\"{y}\" dy=\"{drop}\" text-anchor=\"{anchor}\" font-size=\"{size}\"{fill}{style}>{words}</text>\n"
        ));
    }

    /// Writing to a string cannot fail.
    fn write(&mut self, svg: Arguments<'_>) {
        let written = self.svg.write_fmt(svg);
        debug_assert!(written.is_ok());
    }
}

/// Canvas units as pixels.
fn px(units: i32) -> String {
    let sign = if units < 0 { "-" } else { "" };
    let (whole, tenth) = (units.unsigned_abs() / PIXEL as u32, units.unsigned_abs() % PIXEL as u32);
    if tenth == 0 { format!("{sign}{whole}") } else { format!("{sign}{whole}.{tenth}") }
}

/// The points of a polyline or polygon.
fn listed(points: &[Point]) -> String {
    points.iter().map(|&(x, y)| format!("{},{}", px(x), px(y))).collect::<Vec<_>>().join(" ")
}
