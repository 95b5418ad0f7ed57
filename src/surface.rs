//! The workpiece's surface and the path of a tool over it. Knows no robot.
//!
//! A surface is given by an equation, explicit z(x, y), parametric (x, y, z)(u, v) or implicit F(x, y, z) = 0
//! (ltlm-2024, "Grinding compensation experiment": the path points come from the surface equation of the component), or
//! by a triangle mesh. Whatever it is given by, a [`Surface`] answers the same questions:
//!
//! - which point and outward normal lie at a plan position ([`Surface::contact`]),
//! - how far a point is from the surface, signed along the normal ([`Surface::foot`], [`Surface::deviation_mm`]),
//! - how strongly it is bent in a direction ([`Surface::curvature_per_mm`]),
//! - which triangles show it ([`Surface::tessellation`]).
//!
//! **Frame and units.** Everything is in the surface's own frame, which is the frame of the work object, in mm and rad.
//! The *plan* coordinates of a surface are its two parameters: (u, v) of a parametric one, (x, y) of all others; an
//! implicit surface and a mesh are seen from above, along −z. The *outward* normal is the side from which the tool comes.
//!
//! In reading order: [`expression`] (the text of an equation), [`equation`] (the three kinds of equation), [`mesh`],
//! [`sampling`] (how far apart passes and points may be), [`path`] (passes, tool frames, links), [`file`](mod@file) (the
//! TOML file that states all of it).

pub mod error;
pub mod expression;
pub mod equation;
pub mod mesh;
pub mod sampling;
pub mod path;
pub mod file;

use nalgebra::{Point3, Unit, Vector3};

pub use error::SurfaceError;
pub use equation::{Explicit, Implicit, Parametric};
pub use file::{Origin, SurfaceFile, Tool, WorkObject};
pub use mesh::Mesh;
pub use path::{PathOptions, PathPoint, PointKind};

/// A point of a surface with the outward normal there.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Contact {
    /// Plan coordinates: (u, v) of a parametric surface, (x, y) in mm of any other.
    pub plan: [f64; 2],
    /// The point, in the surface's frame.
    pub position_mm: Point3<f64>,
    /// Unit normal to the side from which the tool comes.
    pub normal: Unit<Vector3<f64>>,
}

/// The point of a surface that is nearest to a given point.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Foot {
    /// The nearest point of the surface within its domain, and the normal there.
    pub contact: Contact,
    /// Distance of the given point from the tangent plane of the foot, positive on the outward side: the signed
    /// deviation along the normal.
    pub normal_mm: f64,
    /// What remains of the distance beside the normal: zero but for a point beyond the border of the surface (and, on a
    /// mesh, for one above an edge).
    pub beside_mm: f64,
}

/// The rectangle of plan coordinates over which a surface is used.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Domain {
    /// Range of the first plan coordinate, x [mm] or u.
    pub first: [f64; 2],
    /// Range of the second plan coordinate, y [mm] or v.
    pub second: [f64; 2],
}

/// Triangles that show a surface, for pictures.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Tessellation {
    /// Corner points.
    pub vertices_mm: Vec<Point3<f64>>,
    /// Outward normal at each corner point, as many as vertices.
    pub normals: Vec<Unit<Vector3<f64>>>,
    /// Three indices into the vertices each, counter-clockwise seen from outside.
    pub triangles: Vec<[u32; 3]>,
}

/// A workpiece's surface.
#[derive(Debug, Clone)]
pub enum Surface {
    /// z as a function of x and y.
    Explicit(Explicit),
    /// x, y, z as functions of u and v.
    Parametric(Parametric),
    /// The zero set of F(x, y, z).
    Implicit(Implicit),
    /// Triangles, from an STL file.
    Mesh(Mesh),
}
