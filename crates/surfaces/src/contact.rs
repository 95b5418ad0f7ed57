//! A point of a surface, and the nearest one to a given point.

use nalgebra::{Point3, Unit, Vector3};

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
    /// Remaining distance, tangential to the surface: zero unless the point is beyond the border of the surface (or, on a
    /// mesh, above an edge).
    pub tangential_mm: f64,
}

impl Foot {
    /// Measures `point` relative to the tangent plane of its foot.
    pub(crate) fn over(contact: Contact, point: &Point3<f64>) -> Option<Self> {
        let away = point - contact.position_mm;
        let normal_mm = contact.normal.dot(&away);
        let tangential_mm = (away - contact.normal.into_inner() * normal_mm).norm();
        (normal_mm.is_finite() && tangential_mm.is_finite()).then_some(Self {
            contact,
            normal_mm,
            tangential_mm,
        })
    }
}

/// A unit vector, unless the vector is too short or not finite.
pub(crate) fn direction(vector: Vector3<f64>) -> Option<Unit<Vector3<f64>>> {
    Unit::try_new(vector, f64::MIN_POSITIVE).filter(|unit| unit.iter().all(|c| c.is_finite()))
}
