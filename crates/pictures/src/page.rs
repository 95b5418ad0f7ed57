//! Initial layout of a recording: views, camera, time panel.
//!
//! Written directly into the blueprint store, since the builder of the SDK supports neither camera nor plot legends nor axis ranges.
//! Views and containers are numbered in order.

use nalgebra::{Point3, Vector3};
use re_sdk::{AsComponents, SerializedComponentBatch};
use re_sdk_types::blueprint::archetypes::{
    Background, ContainerBlueprint, EyeControls3D, LineGrid3D, PanelBlueprint, PlotLegend, ScalarAxis,
    TextDocumentFormat, TimePanelBlueprint, ViewBlueprint, ViewContents, ViewportBlueprint, VisualBounds2D,
};
use re_sdk_types::blueprint::components::{
    ActiveTab, BackgroundKind, ColumnShare, ContainerKind, Corner2D, Enabled, Fps, IncludedContent,
    PanelState, PlayState, RootContainer, RowShare, TimelineName, ViewClass,
};
use re_sdk_types::blueprint::components::{AutoLayout, AutoViews, QueryExpression};
use re_sdk_types::components::{Color, Name, Position3D, Range1D, Vector3D};
use re_sdk_types::datatypes::{self, Float32, Float64, Range2D};

use super::colour::Rgba;
use super::recording::{Store, VisualError};

/// The time axis of blueprint stores.
const BLUEPRINT: (&str, i64) = ("blueprint", 0);

/// Background: dark, but light enough for the low end of the colour map.
const BACKGROUND: Rgba = [24, 27, 33, 255];
const GRID: Rgba = [70, 76, 88, 120];

/// A part of the layout.
pub(super) enum Pane {
    /// One view.
    View(View),
    /// Side by side, with shares.
    Row(Vec<(f32, Pane)>),
    /// Stacked vertically, with shares.
    Column(Vec<(f32, Pane)>),
    /// Tabs; the first is active.
    Tabs(Vec<Pane>),
}

/// A view: class, name, entities and settings.
pub(super) struct View {
    class: &'static str,
    name: String,
    shows: Vec<String>,
    properties: Vec<(&'static str, Vec<SerializedComponentBatch>)>,
}

impl View {
    fn new(class: &'static str, name: impl Into<String>, shows: &[&str]) -> Self {
        let shows = shows.iter().map(|s| (*s).to_owned()).collect();
        Self { class, name: name.into(), shows, properties: Vec::new() }
    }

    fn with(mut self, name: &'static str, property: &dyn AsComponents) -> Self {
        self.properties.push((name, property.as_serialized_batches()));
        self
    }

    /// A 3D view with camera `eye`. `shows`: entity expressions of Rerun, such as `+ /arm/**`.
    pub(super) fn space(name: impl Into<String>, shows: &[&str], eye: &Eye) -> Self {
        let point = |p: &Point3<f64>| Position3D::new(p.x as f32, p.y as f32, p.z as f32);
        Self::new("3D", name, shows)
            .with(
                "EyeControls3D",
                &EyeControls3D::new()
                    .with_position(point(&eye.position_mm))
                    .with_look_target(point(&eye.target_mm))
                    .with_eye_up(Vector3D::from([0.0, 0.0, 1.0])),
            )
            .with(
                "Background",
                &Background::new(BackgroundKind::SolidColor).with_color(Color::from(BACKGROUND)),
            )
            .with("LineGrid3D", &LineGrid3D::new().with_color(Color::from(GRID)))
    }

    /// A 2D view over `x` and `y`, y downwards.
    pub(super) fn flat(name: impl Into<String>, shows: &[&str], x: [f64; 2], y: [f64; 2]) -> Self {
        let bounds = re_sdk_types::blueprint::components::VisualBounds2D(Range2D {
            x_range: x.into(),
            y_range: y.into(),
        });
        Self::new("2D", name, shows).with("VisualBounds2D", &VisualBounds2D::new(bounds)).with(
            "Background",
            &Background::new(BackgroundKind::SolidColor).with_color(Color::from(BACKGROUND)),
        )
    }

    /// Curves over the time axis; `range` of the values, if known, including space for the legend.
    pub(super) fn curves(name: impl Into<String>, shows: &[&str], range: Option<[f64; 2]>) -> Self {
        let view = Self::new("TimeSeries", name, shows)
            .with("PlotLegend", &PlotLegend::new().with_corner(Corner2D::RightTop));
        match range {
            Some([low, high]) => {
                view.with("ScalarAxis", &ScalarAxis::new().with_range(Range1D::new(low, high)))
            }
            None => view,
        }
    }

    /// A text view.
    pub(super) fn text(name: impl Into<String>, shows: &[&str]) -> Self {
        Self::new("TextDocument", name, shows).with(
            "TextDocumentFormat",
            &TextDocumentFormat::new().with_word_wrap(Enabled(datatypes::Bool(true))),
        )
    }
}

/// Camera position and target.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Eye {
    position_mm: Point3<f64>,
    target_mm: Point3<f64>,
}

impl Eye {
    /// The camera that sees all of `points` from `direction` (from the points to the camera), in a view with aspect ratio of at least
    /// `wide`; the vertical field of view of Rerun is about 55°. With `closeness` 1 they fill the view.
    pub(super) fn on(points: &[Point3<f64>], direction: Vector3<f64>, wide: f64, closeness: f64) -> Self {
        let (low, high) = bounds(points);
        let middle = nalgebra::center(&low, &high);
        let back = direction.normalize();
        let side = Vector3::z().cross(&back).try_normalize(1e-6).unwrap_or_else(Vector3::x);
        let up = back.cross(&side);
        // Apparent size of the box at its depth.
        let half = |axis: &Vector3<f64>| {
            let coordinates = points.iter().map(|p| (p - middle).dot(axis));
            let (low, high) = coordinates.fold((0.0f64, 0.0f64), |(low, high), v| (low.min(v), high.max(v)));
            (0.5 * (high - low), 0.5 * (high + low))
        };
        let ((_, right), (_, above)) = (half(&side), half(&up));
        let target_mm = middle + side * right + up * above;
        let slope = (0.5 * 55f64.to_radians()).tan() * closeness;
        let distance = points.iter().fold(1.0f64, |distance, p| {
            let off = p - target_mm;
            let needed = (off.dot(&up).abs() / slope).max(off.dot(&side).abs() / (slope * wide));
            distance.max(needed + off.dot(&back))
        });
        Self { position_mm: target_mm + back * distance, target_mm }
    }
}

/// Axis-aligned bounding box of `points`; the origin without points.
pub(super) fn bounds(points: &[Point3<f64>]) -> (Point3<f64>, Point3<f64>) {
    let Some(first) = points.first() else { return (Point3::origin(), Point3::origin()) };
    points.iter().fold((*first, *first), |(low, high), p| (low.inf(p), high.sup(p)))
}

/// The layout as a blueprint store, with the time panel paused at the start of `axis`; playback speed `per_second`.
pub(super) fn page(root: Pane, axis: &str, per_second: f64) -> Result<Store, VisualError> {
    let mut writer = Writer { store: Store::default(), written: 0 };
    let root = match root {
        view @ Pane::View(_) => Pane::Tabs(vec![view]),
        container => container,
    };
    let root = writer.pane(root)?;
    let viewport = ViewportBlueprint::new()
        .with_root_container(RootContainer(root.uuid()))
        .with_auto_layout(AutoLayout(datatypes::Bool(false)))
        .with_auto_views(AutoViews(datatypes::Bool(false)));
    writer.put("viewport".to_owned(), &viewport)?;
    let hidden = PanelBlueprint::new().with_state(PanelState::Hidden);
    writer.put("blueprint_panel".to_owned(), &hidden)?;
    writer.put("selection_panel".to_owned(), &hidden)?;
    let time = TimePanelBlueprint::new()
        .with_state(PanelState::Collapsed)
        .with_timeline(TimelineName(axis.into()))
        .with_fps(Fps(Float64(per_second)))
        .with_play_state(PlayState::Paused);
    writer.put("time_panel".to_owned(), &time)?;
    Ok(writer.store)
}

/// A numbered view or container.
#[derive(Clone, Copy)]
struct Number {
    kind: &'static str,
    number: u128,
}

impl Number {
    fn uuid(self) -> datatypes::Uuid {
        datatypes::Uuid { bytes: self.number.to_be_bytes() }
    }

    fn path(self) -> String {
        format!("{}/{}", self.kind, self.uuid())
    }
}

struct Writer {
    store: Store,
    written: u128,
}

impl Writer {
    fn put(&mut self, path: String, what: &dyn AsComponents) -> Result<(), VisualError> {
        self.store.at(path, BLUEPRINT, what.as_serialized_batches())
    }

    fn number(&mut self, kind: &'static str) -> Number {
        self.written += 1;
        Number { kind, number: self.written }
    }

    fn pane(&mut self, pane: Pane) -> Result<Number, VisualError> {
        match pane {
            Pane::View(view) => self.view(view),
            Pane::Row(parts) => {
                let (shares, panes): (Vec<f32>, Vec<Pane>) = parts.into_iter().unzip();
                self.container(ContainerKind::Horizontal, panes, &shares)
            }
            Pane::Column(parts) => {
                let (shares, panes): (Vec<f32>, Vec<Pane>) = parts.into_iter().unzip();
                self.container(ContainerKind::Vertical, panes, &shares)
            }
            Pane::Tabs(panes) => self.container(ContainerKind::Tabs, panes, &[]),
        }
    }

    fn container(
        &mut self,
        kind: ContainerKind,
        panes: Vec<Pane>,
        shares: &[f32],
    ) -> Result<Number, VisualError> {
        let mut paths = Vec::new();
        for pane in panes {
            paths.push(self.pane(pane)?.path());
        }
        let shares = shares.iter().copied();
        let mut container = ContainerBlueprint::new(kind)
            .with_contents(paths.iter().map(|p| IncludedContent(p.as_str().into())));
        container = match kind {
            ContainerKind::Horizontal => container.with_col_shares(shares.map(|s| ColumnShare(Float32(s)))),
            ContainerKind::Vertical => container.with_row_shares(shares.map(|s| RowShare(Float32(s)))),
            ContainerKind::Tabs | ContainerKind::Grid => match paths.first() {
                Some(front) => container.with_active_tab(ActiveTab(front.as_str().into())),
                None => container,
            },
        };
        let number = self.number("container");
        self.put(number.path(), &container)?;
        Ok(number)
    }

    fn view(&mut self, view: View) -> Result<Number, VisualError> {
        let number = self.number("view");
        let path = number.path();
        let shows = ViewContents::new(view.shows.iter().map(|q| QueryExpression(q.as_str().into())));
        self.put(format!("{path}/ViewContents"), &shows)?;
        let blueprint = ViewBlueprint::new(ViewClass(view.class.into()))
            .with_display_name(Name(view.name.as_str().into()))
            .with_space_origin("/");
        self.put(path.clone(), &blueprint)?;
        for (name, batches) in view.properties {
            self.store.at(format!("{path}/{name}"), BLUEPRINT, batches)?;
        }
        Ok(number)
    }
}
