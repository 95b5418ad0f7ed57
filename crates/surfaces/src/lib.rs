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
pub mod error;
pub mod expression;
pub mod equation;
pub mod mesh;
pub mod sampling;
pub mod path;
pub mod file;
pub mod sample;

use nalgebra::{Point3, Unit, Vector3};

pub use equation::{Explicit, Implicit, Parametric};
pub use error::SurfaceError;
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
    /// Range of the first plan coordinate, x in mm or u.
    pub first: [f64; 2],
    /// Range of the second plan coordinate, y in mm or v.
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

impl Surface {
    /// The rectangle of plan coordinates over which the surface is used.
    pub fn domain(&self) -> Domain {
        match self {
            Surface::Explicit(surface) => surface.domain(),
            Surface::Parametric(surface) => surface.domain(),
            Surface::Implicit(surface) => surface.domain(),
            Surface::Mesh(surface) => surface.domain(),
        }
    }

    /// The point and normal at a plan position. `None` where the surface has none: off an implicit surface or a
    /// mesh, or where an equation is not finite. An equation also answers beyond its domain.
    pub fn contact(&self, plan: [f64; 2]) -> Option<Contact> {
        match self {
            Surface::Explicit(surface) => surface.contact(plan),
            Surface::Parametric(surface) => surface.contact(plan),
            Surface::Implicit(surface) => surface.contact(plan),
            Surface::Mesh(surface) => surface.contact(plan),
        }
    }

    /// What a call of [`Surface::contact`] costs, in terms of an equation.
    pub(crate) fn look_cost(&self) -> f64 {
        match self {
            Surface::Explicit(surface) => surface.look_cost(),
            Surface::Parametric(surface) => surface.look_cost(),
            Surface::Implicit(surface) => surface.look_cost(),
            Surface::Mesh(surface) => surface.look_cost(),
        }
    }

    /// The nearest point of the surface to `point` (in the surface's frame), and how far it is along the normal there.
    ///
    /// Explicit and parametric surfaces end at the border of their domain, a mesh at its own; an implicit one is
    /// followed beyond. `None` for a point that is not finite or one for which no nearest point is found.
    pub fn foot(&self, point: &Point3<f64>) -> Option<Foot> {
        if !point.iter().all(|c| c.is_finite()) {
            return None;
        }
        match self {
            Surface::Explicit(surface) => surface.foot(point),
            Surface::Parametric(surface) => surface.foot(point),
            Surface::Implicit(surface) => surface.foot(point),
            Surface::Mesh(surface) => surface.foot(point),
        }
    }

    /// Deviation of `point` along the surface normal in mm, positive on the outward side (material left standing).
    pub fn deviation_mm(&self, point: &Point3<f64>) -> Option<f64> {
        self.foot(point).map(|foot| foot.normal_mm)
    }

    /// Normal curvature in 1/mm at a contact in the tangential part of `direction`: positive where the surface
    /// falls away from its outward side (1/r on a ball of radius r seen from outside), negative in a hollow.
    pub fn curvature_per_mm(&self, at: &Contact, direction: &Vector3<f64>) -> f64 {
        match self {
            Surface::Explicit(surface) => surface.curvature_per_mm(at, direction),
            Surface::Parametric(surface) => surface.curvature_per_mm(at, direction),
            Surface::Implicit(surface) => surface.curvature_per_mm(at, direction),
            Surface::Mesh(surface) => surface.curvature_per_mm(at, direction),
        }
    }

    /// Triangles over the whole domain: `cells` × `cells` cells of two triangles each for an equation (cells that
    /// leave the surface are left out), its own triangles for a mesh.
    pub fn tessellate(&self, cells: usize) -> Tessellation {
        if let Surface::Mesh(mesh) = self {
            return mesh.tessellation();
        }
        let cells = cells.max(1);
        let mut shown = Tessellation::default();
        let mut at = Vec::with_capacity((cells + 1) * (cells + 1));
        for plan in self.domain().lattice(cells) {
            at.push(self.contact(plan).map(|contact| {
                shown.vertices_mm.push(contact.position_mm);
                shown.normals.push(contact.normal);
                shown.vertices_mm.len() as u32 - 1
            }));
        }
        let row = cells + 1;
        for corner in (0..cells).flat_map(|i| (0..cells).map(move |k| i * row + k)) {
            // Two triangles a–b–c and a–c–d around the cell, turned so that they face outward.
            let [a, b, c, d] = [corner, corner + 1, corner + row + 1, corner + row].map(|i| at[i]);
            for triangle in [[a, b, c], [a, c, d]] {
                let [Some(i), Some(j), Some(k)] = triangle else { continue };
                let [p, q, r] = [i, j, k].map(|v| shown.vertices_mm[v as usize]);
                let facing = (q - p).cross(&(r - p)).dot(&shown.normals[i as usize]) >= 0.0;
                shown.triangles.push(if facing { [i, j, k] } else { [i, k, j] });
            }
        }
        shown
    }
}

impl Foot {
    /// Measures `point` against the tangent plane of its foot.
    pub(crate) fn over(contact: Contact, point: &Point3<f64>) -> Option<Self> {
        let away = point - contact.position_mm;
        let normal_mm = contact.normal.dot(&away);
        let beside_mm = (away - contact.normal.into_inner() * normal_mm).norm();
        (normal_mm.is_finite() && beside_mm.is_finite()).then_some(Self { contact, normal_mm, beside_mm })
    }
}

impl Domain {
    /// Middle of the domain.
    pub fn centre(&self) -> [f64; 2] {
        self.at([0.5, 0.5])
    }

    /// The plan position at shares 0…1 of the two ranges.
    pub fn at(&self, share: [f64; 2]) -> [f64; 2] {
        // Written so that share 1 gives the upper end exactly.
        let between = |[from, to]: [f64; 2], s: f64| from * (1.0 - s) + to * s;
        [between(self.first, share[0]), between(self.second, share[1])]
    }

    /// A lattice of (n + 1)² plan positions over the domain, borders included; the second coordinate runs slowest.
    pub(crate) fn lattice(&self, n: usize) -> impl Iterator<Item = [f64; 2]> + use<> {
        let domain = *self;
        (0..=n).flat_map(move |k| (0..=n).map(move |i| domain.at([i, k].map(|j| j as f64 / n as f64))))
    }

    pub(crate) fn check(&self, names: [&'static str; 2]) -> Result<(), SurfaceError> {
        check_range(names[0], self.first)?;
        check_range(names[1], self.second)
    }
}

/// Refuses a range that is empty, reversed or not finite.
pub(crate) fn check_range(name: &'static str, [from, to]: [f64; 2]) -> Result<(), SurfaceError> {
    if from.is_finite() && to.is_finite() && from < to {
        Ok(())
    } else {
        Err(SurfaceError::Range { name, from, to })
    }
}
