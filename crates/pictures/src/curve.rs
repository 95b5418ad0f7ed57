//! Curves and points over a time axis.

use re_sdk_types::archetypes::{Scalars, SeriesLines, SeriesPoints};
use re_sdk_types::components::{Color, MarkerShape};

use super::colour::Rgba;
use super::recording::{Store, VisualError};

/// Range of the values, with space above for a legend of `names` lines; `None` without values.
pub(super) fn range(values: impl IntoIterator<Item = f64>, names: usize) -> Option<[f64; 2]> {
    /// Height of a line of the legend, relative to the plot.
    const LINE: f64 = 0.09;
    let mut ends: Option<[f64; 2]> = None;
    for value in values.into_iter().filter(|v| v.is_finite()) {
        let [low, high] = ends.unwrap_or([value; 2]);
        ends = Some([low.min(value), high.max(value)]);
    }
    let [low, high] = ends?;
    let span = (high - low).max(1e-3 * high.abs()).max(1e-9);
    let room = (LINE * (names + 1) as f64).min(0.45);
    Some([low - 0.06 * span, high + span * room / (1.0 - room)])
}

/// Style of a curve.
#[derive(Clone, Copy)]
pub(super) struct Pen<'a> {
    pub(super) name: &'a str,
    pub(super) colour: Rgba,
    pub(super) width: f32,
}

/// Draws a curve with name and colour, if it has values.
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

/// Draws points with name, colour and shape, if there are any.
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
