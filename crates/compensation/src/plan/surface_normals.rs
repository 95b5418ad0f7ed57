//! Deviations along the normal of the machined surface.

use nalgebra::Point3;

use crate::deviation::ON_SURFACE_MM;
use crate::plan::Plan;
use truegrind_surfaces::SurfaceFile;

impl Plan {
    /// Adds the surface normal, and the deviation along it, to every point above the surface. Points away from the surface are
    /// not counted as cutting.
    pub fn add_normals(&mut self, surface: &SurfaceFile) {
        for point in &mut self.points {
            let in_object = point.base_from_object.inverse() * point.intended;
            let Some(foot) = surface.surface.foot(&Point3::from(in_object.translation.vector)) else {
                continue;
            };
            let normal = foot.contact.normal.into_inner();
            point.cutting &= foot.normal_mm.abs() < ON_SURFACE_MM;
            point.normal = Some(normal);
            for deviation in [&mut point.before, &mut point.after].into_iter().flatten() {
                deviation.normal_mm = Some(normal.dot(&deviation.vector_mm));
            }
        }
    }
}
