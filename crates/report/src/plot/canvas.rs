//! The plotters backend that writes SVG.
//!
//! Backend coordinates are integers, so the canvas uses tenths of a pixel and writes one decimal.

use std::cell::{Cell, RefCell};
use std::convert::Infallible;
use std::fmt::Write;
use std::rc::Rc;

use plotters::drawing::IntoDrawingArea;
use plotters::prelude::{DrawingArea, DrawingAreaErrorKind};
use plotters_backend::text_anchor::{HPos, VPos};
use plotters_backend::{
    BackendColor, BackendCoord, BackendStyle, BackendTextStyle, DrawingBackend, DrawingErrorKind, FontStyle,
    FontTransform,
};

use super::letters;
use crate::format::html::escape;

/// Canvas units per pixel.
pub(super) const PIXEL: i32 = 10;

/// Error of drawing; the canvas itself cannot fail.
pub(super) type DrawingError = DrawingAreaErrorKind<Infallible>;

/// A drawing area in canvas units.
pub(super) type Area = DrawingArea<Canvas, plotters::coord::Shift>;

/// The SVG text under construction, and styles that plotters does not support. Clones share it.
#[derive(Clone)]
pub(super) struct Sheet(Rc<Shared>);

struct Shared {
    text: RefCell<String>,
    dash: Cell<&'static str>,
}

impl Sheet {
    /// Sets the SVG dash pattern of the following paths, in pixels; empty for solid.
    pub(super) fn dash(&self, pattern: &'static str) {
        self.0.dash.set(pattern);
    }

    /// Opens a clipped group (canvas units). A nested `svg` element clips without the page-wide ids that `clipPath` needs.
    pub(super) fn open_window(&self, x: std::ops::Range<i32>, y: std::ops::Range<i32>) {
        let (left, top) = (px(x.start), px(y.start));
        let (width, height) = (px(x.end - x.start), px(y.end - y.start));
        self.push(&format!(
            "<svg x=\"{left}\" y=\"{top}\" width=\"{width}\" height=\"{height}\" viewBox=\"{left} {top} {width} {height}\">\n"
        ));
    }

    /// Closes [`Sheet::open_window`].
    pub(super) fn close_window(&self) {
        self.push("</svg>\n");
    }

    /// Lines of one colour and width as a single element, which is much shorter than one element each. Round ends hide seams between
    /// consecutive lines; otherwise lines end exactly.
    pub(super) fn strokes(
        &self,
        lines: &[Vec<BackendCoord>],
        color: [u8; 3],
        alpha: f64,
        width: i32,
        round: bool,
    ) {
        if lines.is_empty() {
            return;
        }
        let mut tag = String::from("<path d=\"");
        for line in lines {
            for (index, &(x, y)) in line.iter().enumerate() {
                write_all(
                    &mut tag,
                    format_args!("{}{} {}", if index == 0 { "M" } else { "L" }, px(x), px(y)),
                );
            }
        }
        let [red, green, blue] = color;
        let color = paint(BackendColor { alpha, rgb: (red, green, blue) });
        write_all(
            &mut tag,
            format_args!("\" fill=\"none\" stroke=\"{color}\" stroke-width=\"{}\"", px(width)),
        );
        if alpha < 1.0 {
            write_all(&mut tag, format_args!(" stroke-opacity=\"{}\"", rounded(alpha)));
        }
        if round {
            tag.push_str(" stroke-linecap=\"round\" stroke-linejoin=\"round\"");
        }
        self.push(&(tag + "/>\n"));
    }

    /// Opens a group with a tooltip.
    pub(super) fn open_group(&self, title: &str) {
        self.push(&format!("<g><title>{}</title>\n", escape(title)));
    }

    /// Closes [`Sheet::open_group`].
    pub(super) fn close_group(&self) {
        self.push("</g>\n");
    }

    fn push(&self, svg: &str) {
        self.0.text.borrow_mut().push_str(svg);
    }
}

/// Draws on a sheet (size in pixels) and returns the SVG document. `name`: label for screen readers.
pub(super) fn draw(
    (width, height): (u32, u32),
    name: &str,
    drawing: impl FnOnce(&Area, &Sheet) -> Result<(), DrawingError>,
) -> String {
    let sheet =
        Sheet(Rc::new(Shared { text: RefCell::new(String::with_capacity(16_384)), dash: Cell::new("") }));
    sheet.push(&format!(
        "<svg xmlns=\"http://www.w3.org/2000/svg\" viewBox=\"0 0 {width} {height}\" role=\"img\" \
         aria-label=\"{}\" font-family=\"{}\">\n",
        escape(name),
        letters::FAMILY
    ));
    let scale = PIXEL as u32;
    let area = Canvas { sheet: sheet.clone(), size: (width * scale, height * scale) }.into_drawing_area();
    let drawn = drawing(&area, &sheet).and_then(|()| area.present());
    drop(area);
    if let Err(error) = drawn {
        sheet.push(&format!(
            "<text x=\"10\" y=\"20\">this plot could not be drawn: {}</text>\n",
            escape(&error.to_string())
        ));
    }
    sheet.push("</svg>\n");
    sheet.0.text.take()
}

/// The backend.
pub(super) struct Canvas {
    sheet: Sheet,
    size: (u32, u32),
}

type Drawn = Result<(), DrawingErrorKind<Infallible>>;

impl DrawingBackend for Canvas {
    type ErrorType = Infallible;

    fn get_size(&self) -> (u32, u32) {
        self.size
    }

    fn ensure_prepared(&mut self) -> Drawn {
        Ok(())
    }

    fn present(&mut self) -> Drawn {
        Ok(())
    }

    fn draw_pixel(&mut self, (x, y): BackendCoord, color: BackendColor) -> Drawn {
        self.draw_rect((x, y), (x + 1, y + 1), &color, true)
    }

    fn draw_line<S: BackendStyle>(&mut self, from: BackendCoord, to: BackendCoord, style: &S) -> Drawn {
        self.draw_path([from, to], style)
    }

    fn draw_rect<S: BackendStyle>(
        &mut self,
        (left, top): BackendCoord,
        (right, bottom): BackendCoord,
        style: &S,
        fill: bool,
    ) -> Drawn {
        let (x, y) = (left.min(right), top.min(bottom));
        let shape = format!(
            "<rect x=\"{}\" y=\"{}\" width=\"{}\" height=\"{}\"",
            px(x),
            px(y),
            px((right - left).abs()),
            px((bottom - top).abs())
        );
        self.shape(&shape, style, fill);
        Ok(())
    }

    fn draw_path<S: BackendStyle, I: IntoIterator<Item = BackendCoord>>(
        &mut self,
        path: I,
        style: &S,
    ) -> Drawn {
        let mut shape = String::from("<polyline points=\"");
        push_points(&mut shape, path);
        self.shape(&shape, style, false);
        Ok(())
    }

    fn draw_circle<S: BackendStyle>(
        &mut self,
        (x, y): BackendCoord,
        radius: u32,
        style: &S,
        fill: bool,
    ) -> Drawn {
        let shape = format!("<circle cx=\"{}\" cy=\"{}\" r=\"{}\"", px(x), px(y), px(radius as i32));
        self.shape(&shape, style, fill);
        Ok(())
    }

    fn fill_polygon<S: BackendStyle, I: IntoIterator<Item = BackendCoord>>(
        &mut self,
        outline: I,
        style: &S,
    ) -> Drawn {
        let mut shape = String::from("<polygon points=\"");
        push_points(&mut shape, outline);
        self.shape(&shape, style, true);
        Ok(())
    }

    fn draw_text<S: BackendTextStyle>(&mut self, text: &str, style: &S, (x, y): BackendCoord) -> Drawn {
        let color = style.color();
        if color.alpha == 0.0 || text.is_empty() {
            return Ok(());
        }
        let anchor = match style.anchor().h_pos {
            HPos::Left => "start",
            HPos::Center => "middle",
            HPos::Right => "end",
        };
        // Offset of the baseline in units of the font size: capitals are 0.72 high, descenders 0.21 deep.
        let drop = match style.anchor().v_pos {
            VPos::Top => "0.76em",
            VPos::Center => "0.36em",
            VPos::Bottom => "-0.22em",
        };
        let (x, y) = (px(x), px(y));
        let turn = match style.transform() {
            FontTransform::None => 0,
            FontTransform::Rotate90 => 90,
            FontTransform::Rotate180 => 180,
            FontTransform::Rotate270 => 270,
        };
        let mut tag = format!("<text x=\"{x}\" y=\"{y}\" dy=\"{drop}\" text-anchor=\"{anchor}\"");
        let size = style.size() / f64::from(PIXEL);
        write_all(&mut tag, format_args!(" font-size=\"{size}\" fill=\"{}\"", paint(color)));
        if color.alpha < 1.0 {
            write_all(&mut tag, format_args!(" fill-opacity=\"{}\"", rounded(color.alpha)));
        }
        if turn != 0 {
            write_all(&mut tag, format_args!(" transform=\"rotate({turn} {x} {y})\""));
        }
        if let FontStyle::Bold = style.style() {
            tag.push_str(" font-weight=\"bold\"");
        }
        self.sheet.push(&format!("{tag}>{}</text>\n", escape(text)));
        Ok(())
    }

    fn estimate_text_size<S: BackendTextStyle>(
        &self,
        text: &str,
        style: &S,
    ) -> Result<(u32, u32), DrawingErrorKind<Infallible>> {
        Ok((letters::width(text, style.size()).ceil() as u32, style.size().ceil() as u32))
    }
}

impl Canvas {
    /// Writes a tag with its fill or stroke.
    fn shape<S: BackendStyle>(&self, tag: &str, style: &S, fill: bool) {
        let color = style.color();
        if color.alpha == 0.0 {
            return;
        }
        let kind = if fill { "fill" } else { "stroke" };
        let mut attributes = format!("{kind}=\"{}\"", paint(color));
        if color.alpha < 1.0 {
            write_all(&mut attributes, format_args!(" {kind}-opacity=\"{}\"", rounded(color.alpha)));
        }
        if !fill {
            write_all(
                &mut attributes,
                format_args!(" fill=\"none\" stroke-width=\"{}\"", px(style.stroke_width() as i32)),
            );
            if tag.starts_with("<polyline") {
                attributes.push_str(" stroke-linejoin=\"round\"");
            }
            let dash = self.sheet.0.dash.get();
            if !dash.is_empty() {
                write_all(&mut attributes, format_args!(" stroke-dasharray=\"{dash}\""));
            }
        }
        let quote = if tag.contains("points=") { "\"" } else { "" };
        self.sheet.push(&format!("{tag}{quote} {attributes}/>\n"));
    }
}

/// SVG colour; black is the text colour of the page.
fn paint(color: BackendColor) -> String {
    match color.rgb {
        (0, 0, 0) => "currentColor".to_owned(),
        (red, green, blue) => format!("#{red:02X}{green:02X}{blue:02X}"),
    }
}

/// Canvas units as pixels.
fn px(units: i32) -> String {
    let sign = if units < 0 { "-" } else { "" };
    let (whole, tenth) = (units.unsigned_abs() / PIXEL as u32, units.unsigned_abs() % PIXEL as u32);
    if tenth == 0 { format!("{sign}{whole}") } else { format!("{sign}{whole}.{tenth}") }
}

fn rounded(alpha: f64) -> f64 {
    (alpha * 1000.0).round() / 1000.0
}

fn push_points(shape: &mut String, path: impl IntoIterator<Item = BackendCoord>) {
    for (index, (x, y)) in path.into_iter().enumerate() {
        if index > 0 {
            shape.push(' ');
        }
        write_all(shape, format_args!("{},{}", px(x), px(y)));
    }
}

/// Writing to a string cannot fail.
fn write_all(text: &mut String, arguments: std::fmt::Arguments<'_>) {
    let written = text.write_fmt(arguments);
    debug_assert!(written.is_ok());
}
