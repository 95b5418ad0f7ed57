//! Colour bar.

use re_sdk_types::archetypes::{LineStrips2D, Points2D};
use re_sdk_types::components::{Color, Radius};

use super::colour::{INTENDED, STEPS, Scale};
use super::page::{Pane, View};
use super::recording::{Store, VisualError};

/// A bar of all colours, with values (mm) below.
pub(super) fn draw(store: &mut Store, scale: &Scale) -> Result<(), VisualError> {
    let edge = |step: usize| 100.0 * step as f32 / STEPS as f32;
    let bar = LineStrips2D::new((0..STEPS).map(|s| [[edge(s), 0.0], [edge(s + 1), 0.0]]))
        .with_colors((0..STEPS).map(|s| Color::from(scale.colour(s))))
        .with_radii([2.0f32]);
    store.fixed("legend/bar", &bar)?;
    let ticks = [0.0f32, 0.25, 0.5, 0.75, 1.0];
    let figures = Points2D::new(ticks.map(|t| [100.0 * t, 2.0]))
        .with_radii([Radius::new_ui_points(1.0)])
        .with_colors([Color::from(INTENDED)])
        .with_labels(ticks.map(|t| format!("{}", (f64::from(t) * scale.top_mm * 1e6).round() / 1e6)))
        .with_show_labels(true);
    store.fixed("legend/figures", &figures)
}

/// The view that shows the bar.
pub(super) fn pane(what: &str) -> Pane {
    Pane::View(View::flat(what, &["+ /legend/**"], [-6.0, 106.0], [-4.0, 8.5]))
}
