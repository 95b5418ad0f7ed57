//! Plots as SVG: graphs, histograms, bars, parameter intervals, paths in plan view, heat strips.
//!
//! Each plot is a struct with public fields and a method `svg`, which always returns a complete SVG document: without data it has
//! empty axes, and non-finite values are gaps. Text remains text, so that pages can be searched. Black follows the text colour of
//! the page, for light and dark mode. Series differ in colour (Okabe and Ito, suitable for colour-blind readers), dash and marker.
//! Legends are above the data.
//!
//! The SVG is written here (`pen`), with the widths of Helvetica in place of a font.
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

pub use alike::distinguishable;
pub use axis::Axis;
pub use bars::{BarGroup, Bars};
pub use graph::{Graph, Mark, Reference, Series, Span};
pub use histogram::{Bins, Histogram, Sample};
pub use ink::{ColorMap, Ink};
pub use intervals::{Interval, Intervals};
pub use plan::{PlanPath, PlanView};
pub use scale::{linear_ticks, log_ticks};
pub use strip::{HeatStrip, Strip};
