//! Curves and points over a time axis.

use rerun::components::{Color, MarkerShape};
use rerun::{Scalars, SeriesLines, SeriesPoints};

use super::colour::Rgba;
use super::recording::{Store, VisualError};

/// How a curve is drawn.
#[derive(Clone, Copy)]
pub(super) struct Pen<'a> {
    pub(super) name: &'a str,
    pub(super) colour: Rgba,
    pub(super) width: f32,
}

/// A curve with its name and colour; nothing where it has no values.
pub(super) fn curve(
    store: &mut Store,
    path: &str,
    axis: &'static str,
    pen: Pen<'_>,
    points: &[(i64, f64)],
) -> Result<(), VisualError> {
    if points.is_empty() {
        return Ok(());
    }
    let style = SeriesLines::new()
        .with_names([pen.name])
        .with_colors([Color::from(pen.colour)])
        .with_widths([pen.width]);
    store.fixed(path, &style)?;
    values(store, path, axis, points)
}

/// The values of a curve or of points.
fn values(
    store: &mut Store,
    path: &str,
    axis: &'static str,
    points: &[(i64, f64)],
) -> Result<(), VisualError> {
    let times: Vec<i64> = points.iter().map(|(t, _)| *t).collect();
    let columns = Scalars::new(points.iter().map(|(_, v)| *v))
        .columns_of_unit_batches()
        .map_err(|e| VisualError::Encoding(e.to_string()))?;
    store.over(path, (axis, &times), columns)
}

/// Points with their name, colour and shape; nothing where there are none.
pub(super) fn points(
    store: &mut Store,
    path: &str,
    axis: &'static str,
    (name, colour, shape): (&str, Rgba, MarkerShape),
    points: &[(i64, f64)],
) -> Result<(), VisualError> {
    if points.is_empty() {
        return Ok(());
    }
    let style = SeriesPoints::new()
        .with_names([name])
        .with_colors([Color::from(colour)])
        .with_markers([shape])
        .with_marker_sizes([3.0]);
    store.fixed(path, &style)?;
    values(store, path, axis, points)
}
