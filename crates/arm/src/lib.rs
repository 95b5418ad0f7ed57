//! The arm as physics: links, joint effects, forward map, Jacobians, inverse.
//!
//! From what the log says to the flange:
//!
//! ```text
//! logged joints → joint map (signs, couplings) → joint effects → links, some moved by effects → flange
//! ```
//!
//! Three models of one arm are kept apart by name: *nominal* (the data sheet, which the controller computes with),
//! *estimated* (nominal plus what was identified) and *actual* (known only in a simulation). Lengths are mm, angles
//! rad, joint angles are the controller's unless a name says otherwise.

pub mod bounds;
pub mod gravity;
pub mod link;
pub mod condition;
mod joints;
mod limits;
mod body;
pub mod effect;
pub mod model;
pub mod chain;
pub mod link_motion;
pub mod parameter;
pub mod jacobian;
pub mod arm_file;
pub mod region;
pub mod sensor;
pub mod estimated;
pub mod inverse;
pub mod batch;
pub mod robots;
