//! Pictures as SVG text: graphs, histograms, bars, parameter intervals, paths in plan view, heat strips.
//!
//! Each plot is a struct with public fields and one method, `svg`, which always gives a whole SVG document: without
//! data it gives empty axes, and what is not finite is left out (a gap in a line). Text stays text, so that pages can
//! be searched. Black follows the text colour of the page around the picture, so that the same picture serves a light
//! and a dark page. Series differ in colour (Okabe and Ito, told apart by colour-blind eyes), in dash and in marker.
//! Legends stand above the data, never on it.
//!
//! The drawing is done by plotters on a backend of our own: its SVG backend knows neither
//! fractions of a pixel nor dashes, and its width of a text is a count of bytes. No font is needed on the machine.
//!
//! ```
//! use truegrind_report::plot::{Axis, Graph, Series};
//! let graph = Graph {
//!     title: "Convergence".to_owned(),
//!     x: Axis::new("iteration", ""),
//!     y: Axis::log("RMSE", "mm"),
//!     series: vec![Series::line("LM", [[0.0, 2.1], [1.0, 0.6], [2.0, 0.46]])],
//!     ..Graph::default()
//! };
//! assert!(graph.svg().contains(">RMSE [mm]</text>"));
//! ```

mod alike;
mod axis;
mod letters;
mod canvas;
mod ink;
mod scale;
mod pen;
mod frame;
mod graph;
mod histogram;
mod bars;
mod intervals;
mod color_bar;
mod plan;
mod strip;

pub use alike::told_apart;
pub use axis::Axis;
pub use bars::{BarGroup, Bars};
pub use graph::{Graph, Mark, Reference, Series, Span};
pub use histogram::{Bins, Histogram, Sample};
pub use ink::{ColorMap, Ink};
pub use intervals::{Interval, Intervals};
pub use plan::{PlanPath, PlanView};
pub use scale::{linear_ticks, log_ticks};
pub use strip::{HeatStrip, Strip};
