//! Triangles that show a surface.

use nalgebra::{Point3, Unit, Vector3};

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
