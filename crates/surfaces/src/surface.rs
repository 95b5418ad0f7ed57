//! A workpiece's surface, from an equation or a mesh.

use nalgebra::{Point3, Vector3};

use crate::contact::{Contact, Foot};
use crate::domain::Domain;
use crate::equation::{Explicit, Implicit, Parametric};
use crate::mesh::Mesh;
use crate::tessellation::Tessellation;

/// A workpiece's surface.
#[derive(Debug, Clone)]
#[non_exhaustive]
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

    /// Cost of a call of [`Surface::contact`], in terms of an equation.
    pub(crate) fn evaluation_cost(&self) -> f64 {
        match self {
            Surface::Explicit(surface) => surface.evaluation_cost(),
            Surface::Parametric(surface) => surface.evaluation_cost(),
            Surface::Implicit(surface) => surface.evaluation_cost(),
            Surface::Mesh(surface) => surface.evaluation_cost(),
        }
    }

    /// The nearest point of the surface to `point` (in the surface's frame), and its distance along the normal there.
    ///
    /// Explicit and parametric surfaces end at the border of their domain, a mesh at its own; an implicit one is followed
    /// beyond. `None` for a point that is not finite or for which no nearest point is found.
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

    /// Deviation of `point` along the surface normal in mm, positive on the outward side (excess material).
    pub fn deviation_mm(&self, point: &Point3<f64>) -> Option<f64> {
        self.foot(point).map(|foot| foot.normal_mm)
    }

    /// Normal curvature in 1/mm at a contact in the tangential part of `direction`: positive where the surface curves away
    /// from its outward side (1/r on a ball of radius r seen from outside), negative in a hollow.
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
            // Two triangles a–b–c and a–c–d of the cell, oriented outward.
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
