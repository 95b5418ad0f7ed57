//! The cell file: origins of tools and work objects.
//!
//! A frame from *metrology* (CAD, a measuring machine, a tracker) is exact. A frame *taught* with the uncalibrated arm is
//! where the nominal model put it; the estimated model, given the same joint angles, determines its real pose
//! ([`crate::frames::taught`]). A taught frame without its teaching points cannot be moved: the difference is estimated and
//! reported instead.
//!
//! ```toml
//! [[tool]]
//! name = "tPointer"
//! origin = "taught"              # metrology | taught
//! teaching_deg = [[…], […], […], […]]   # four or more poses about one fixed point
//!
//! [[wobj]]
//! name = "wPart"
//! origin = "taught"
//! taught_with = "tPointer"       # the tool that touched the points
//! teaches = "uframe"             # uframe | oframe
//! teaching_deg = [[…], […], […]] # two points on x, one on y
//!
//! [[external]]
//! axis = "a"
//! carries = "base"               # base | other
//! ```
//!
//! Before the first table may stand `robot = "abb-irb-120"`, the robot of the programs, which a model must be of, and for NC programs
//! `control = "fanuc"`, the control that runs NC programs, `angles = "wpr"`, what A, B and C mean, and `start_deg = [0, 0, 0, 0, 90, 0]`, the joints in which the arm starts, roughly.
//! A value may be `"?"`: it is still to
//! be filled in, and nothing is corrected before it is ([`Cell::open`]).

mod file;
mod lookup;
pub mod nc_setup;
mod placeholders;
pub mod robot_match;
pub mod template;
mod used;

pub use file::{AXES, Carries, Cell, CellAxis, CellError, CellFrame, FrameKind, FrameOrigin, Teaches};
pub(crate) use lookup::{CellLookup, same_name};
pub use used::Used;
