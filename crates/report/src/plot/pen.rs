//! Lines, areas, markers and text on an area of the canvas. Lengths in canvas units.

use plotters::element::{Circle, PathElement, Polygon, Rectangle};
use plotters::style::text_anchor::{HPos, Pos, VPos};
use plotters::style::{
    BLACK, Color, FontDesc, FontFamily, FontStyle, FontTransform, RGBColor, ShapeStyle, TextStyle,
};

use super::canvas::{Area, DrawingError, PIXEL, Sheet};

/// Font size of labels.
pub(super) const LABEL: f64 = 13.0 * PIXEL as f64;
/// Font size of titles.
pub(super) const TITLE: f64 = 14.5 * PIXEL as f64;
/// Width of data lines.
pub(super) const BOLD: u32 = 18;
/// Width of auxiliary lines.
pub(super) const THIN: u32 = 10;
/// Half the size of a marker.
pub(super) const MARKER: i32 = 4 * PIXEL;

type Drawn = Result<(), DrawingError>;
type Point = (i32, i32);

/// Draws on an area.
#[derive(Clone, Copy)]
pub(super) struct Pen<'a> {
    pub(super) area: &'a Area,
    pub(super) sheet: &'a Sheet,
}

/// A colour with its opacity.
#[derive(Clone, Copy)]
pub(super) struct Paint(pub(super) RGBColor, pub(super) f64);

impl Paint {
    /// Text colour of the page.
    pub(super) fn text(alpha: f64) -> Self {
        Paint(BLACK, alpha)
    }
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

impl Pen<'_> {
    pub(super) fn line(&self, points: Vec<Point>, paint: Paint, width: u32, dash: &'static str) -> Drawn {
        self.sheet.dash(dash);
        let drawn = self.area.draw(&PathElement::new(points, stroke(paint, width)));
        self.sheet.dash("");
        drawn
    }

    pub(super) fn polygon(&self, outline: Vec<Point>, paint: Paint) -> Drawn {
        self.area.draw(&Polygon::new(outline, fill(paint)))
    }

    pub(super) fn rectangle(&self, corners: [Point; 2], paint: Paint) -> Drawn {
        self.area.draw(&Rectangle::new(corners, fill(paint)))
    }

    pub(super) fn outline(&self, corners: [Point; 2], paint: Paint, width: u32) -> Drawn {
        self.area.draw(&Rectangle::new(corners, stroke(paint, width)))
    }

    pub(super) fn marker(&self, marker: Marker, (x, y): Point, paint: Paint) -> Drawn {
        let r = MARKER;
        match marker {
            Marker::Circle => self.area.draw(&Circle::new((x, y), r * 9 / 10, fill(paint))),
            Marker::Ring => self.area.draw(&Circle::new((x, y), r * 9 / 10, stroke(paint, 15))),
            Marker::Square => {
                let h = r * 8 / 10;
                self.rectangle([(x - h, y - h), (x + h, y + h)], paint)
            }
            Marker::Triangle => {
                self.polygon(vec![(x - r, y + r * 7 / 10), (x + r, y + r * 7 / 10), (x, y - r)], paint)
            }
            Marker::Diamond => {
                let h = r * 11 / 10;
                self.polygon(vec![(x - h, y), (x, y - h), (x + h, y), (x, y + h)], paint)
            }
            Marker::Cross => {
                let h = r * 8 / 10;
                self.line(vec![(x - h, y - h), (x + h, y + h)], paint, 16, "")?;
                self.line(vec![(x - h, y + h), (x + h, y - h)], paint, 16, "")
            }
        }
    }

    pub(super) fn text(&self, words: &str, at: Point, size: f64, horizontal: HPos, vertical: VPos) -> Drawn {
        self.area.draw_text(words, &text(size, FontStyle::Normal, horizontal, vertical), at)
    }

    pub(super) fn bold(&self, words: &str, at: Point, size: f64, horizontal: HPos, vertical: VPos) -> Drawn {
        self.area.draw_text(words, &text(size, FontStyle::Bold, horizontal, vertical), at)
    }

    /// Text from bottom to top, centred vertically at the point and to its right.
    pub(super) fn upright(&self, words: &str, at: Point, size: f64) -> Drawn {
        let style =
            text(size, FontStyle::Normal, HPos::Center, VPos::Top).transform(FontTransform::Rotate270);
        self.area.draw_text(words, &style, at)
    }
}

/// Text style.
pub(super) fn text(size: f64, style: FontStyle, horizontal: HPos, vertical: VPos) -> TextStyle<'static> {
    // The font family is set at the root of the SVG.
    let font = FontDesc::new(FontFamily::SansSerif, size, style);
    TextStyle { font, color: BLACK.mix(0.85).to_backend_color(), pos: Pos::new(horizontal, vertical) }
}

/// Line style.
pub(super) fn stroke(Paint(color, alpha): Paint, width: u32) -> ShapeStyle {
    ShapeStyle { color: color.mix(alpha), filled: false, stroke_width: width }
}

fn fill(Paint(color, alpha): Paint) -> ShapeStyle {
    ShapeStyle { color: color.mix(alpha), filled: true, stroke_width: 0 }
}
