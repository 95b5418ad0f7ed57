//! The workpiece's surface and the path of a tool over it. Knows no robot.
//!
//! A surface is given by an equation, explicit z(x, y), parametric (x, y, z)(u, v) or implicit F(x, y, z) = 0
//! (ltlm-2024, "Grinding compensation experiment": the path points come from the surface equation of the component), or
//! by a triangle mesh. Whatever it is given by, a [`Surface`] answers the same questions:
//!
//! - which point and outward normal lie at a plan position ([`Surface::contact`]),
//! - how far a point is from the surface, signed along the normal ([`Surface::foot`], [`Surface::deviation_mm`]),
//! - how strongly it is bent in a direction ([`Surface::curvature_per_mm`]),
//! - which triangles show it ([`Surface::tessellate`]).
//!
//! **Frame and units.** Everything is in the surface's own frame, which is the frame of the work object, in mm and
//! rad. The *plan* coordinates of a surface are its two parameters: (u, v) of a parametric one, (x, y) of all
//! others; an implicit surface and a mesh are seen from above, along −z. The *outward* normal is the side from
//! which the tool comes.
//!
//! In reading order: [`expression`] (the text of an equation), [`equation`] (the three kinds of equation),
//! [`mesh`], [`sampling`] (how far apart passes and points may be), [`path`] (passes, tool frames, links),
//! [`file`](mod@file) (the TOML file that states all of it), [`sample`] (the files that ship).

mod budget;
mod contact;
mod domain;
mod surface;
mod tessellation;
pub mod error;
pub mod expression;
pub mod equation;
pub mod mesh;
pub mod sampling;
pub mod path;
pub mod file;
pub mod sample;

pub use contact::{Contact, Foot};
pub use domain::Domain;
pub use equation::{Explicit, Implicit, Parametric};
pub use error::SurfaceError;
pub use file::{Origin, SurfaceFile, Tool, WorkObject};
pub use mesh::Mesh;
pub use path::{PathOptions, PathPoint, PointKind};
pub use surface::Surface;
pub use tessellation::Tessellation;
