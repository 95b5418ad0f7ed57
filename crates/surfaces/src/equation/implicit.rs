//! The zero set of F(x, y, z).

use nalgebra::{Matrix4, Point3, Vector3, Vector4};

use crate::contact::{Contact, Foot, direction};
use crate::domain::Domain;
use crate::equation::survey::{FIXED_COST, LATTICE};
use crate::error::SurfaceError;
use crate::expression::Expression;

/// The zero set of F(x, y, z), seen from above. Outside is the side of the upper end of the z range, whatever the sign of F
/// there.
#[derive(Debug, Clone)]
pub struct Implicit {
    f: Expression,
    domain: Domain,
    z_mm: [f64; 2],
    /// +1 where F grows outwards, else −1.
    outward: f64,
    lattice: Vec<Contact>,
}

impl Implicit {
    /// Number of slices in which the z range is searched for the first zero from above.
    pub const SLICES: usize = 64;

    /// Reads `f` as an expression in x, y, z in mm; the surface is looked for over `domain` between the two heights
    /// `z_mm`.
    ///
    /// # Errors
    /// A text that cannot be read, an empty range, a value that is not finite, or no surface at all in the domain.
    pub fn new(f: &str, domain: Domain, z_mm: [f64; 2]) -> Result<Self, SurfaceError> {
        domain.check(["x", "y"])?;
        crate::domain::check_range("z", z_mm)?;
        let mut surface = Self {
            f: Expression::parse(f, &["x", "y", "z"])?,
            domain,
            z_mm,
            outward: 1.0,
            lattice: Vec::new(),
        };
        let mut above = 0_i64;
        for [x, y] in domain.lattice(LATTICE) {
            for z in [z_mm[0], 0.5 * (z_mm[0] + z_mm[1]), z_mm[1]] {
                let value = surface.f.value(&[x, y, z]);
                if !value.is_finite() {
                    return Err(SurfaceError::NotFinite {
                        text: f.to_owned(),
                        found: format!("{value}"),
                        place: format!("x = {x}, y = {y}, z = {z}"),
                    });
                }
                if z == z_mm[1] {
                    above += if value > 0.0 { 1 } else { -1 };
                }
            }
        }
        surface.outward = if above >= 0 { 1.0 } else { -1.0 };
        surface.lattice = domain.lattice(LATTICE).filter_map(|plan| surface.contact(plan)).collect();
        if surface.lattice.is_empty() {
            return Err(SurfaceError::Empty { text: f.to_owned() });
        }
        Ok(surface)
    }

    pub(crate) fn domain(&self) -> Domain {
        self.domain
    }

    /// All slices, and some Newton steps.
    pub(crate) fn evaluation_cost(&self) -> f64 {
        let [value, first] = self.f.terms();
        FIXED_COST + Self::SLICES as f64 * value + 8.0 * (value + first)
    }

    /// The first zero from above: by slices, then by safeguarded Newton steps with bisection.
    pub(crate) fn contact(&self, plan: [f64; 2]) -> Option<Contact> {
        let [x, y] = plan;
        let value = |z: f64| self.outward * self.f.value(&[x, y, z]);
        let height =
            |slice: usize| self.z_mm[1] + (self.z_mm[0] - self.z_mm[1]) * slice as f64 / Self::SLICES as f64;
        let mut above = value(self.z_mm[1]);
        let below = (1..=Self::SLICES).find(|slice| {
            let before = std::mem::replace(&mut above, value(height(*slice)));
            before > 0.0 && above <= 0.0
        })?;
        let (mut outside, mut inside) = (height(below - 1), height(below));
        let mut z = 0.5 * (outside + inside);
        for _ in 0..100 {
            let here = value(z);
            if here > 0.0 {
                outside = z;
            } else {
                inside = z;
            }
            let slope = self.outward * self.f.gradient(&[x, y, z]).z;
            let newton = z - here / slope;
            // The Newton step where it stays in the bracket, else the midpoint.
            let next = if newton < outside && newton > inside { newton } else { 0.5 * (outside + inside) };
            let step = (next - z).abs();
            z = next;
            if step <= 4.0 * f64::EPSILON * (1.0 + z.abs()) {
                break;
            }
        }
        self.at(Point3::new(x, y, z))
    }

    /// The nearest point: along the gradient to the surface and sideways until the remainder is normal to it, then Newton's
    /// method on the Lagrangian |q − p|²/2 + λF(q). The equation is followed beyond the domain.
    pub(crate) fn foot(&self, point: &Point3<f64>) -> Option<Foot> {
        let squared = |c: &Contact| (c.position_mm - point).norm_squared();
        let nearest = self.lattice.iter().min_by(|a, b| squared(a).total_cmp(&squared(b)))?;
        let found = [*point, nearest.position_mm]
            .into_iter()
            .filter_map(|start| self.nearest_from(start, point))
            .min_by(|a, b| squared(a).total_cmp(&squared(b)))?;
        Foot::over(found, point)
    }

    pub(crate) fn curvature_per_mm(&self, at: &Contact, direction: &Vector3<f64>) -> f64 {
        let p = at.position_mm;
        let (gradient, hessian) = (self.f.gradient(&[p.x, p.y, p.z]), self.f.hessian(&[p.x, p.y, p.z]));
        let tangent = direction - at.normal.into_inner() * at.normal.dot(direction);
        let length = tangent.norm_squared();
        if length <= 1e-20 * direction.norm_squared() {
            return 0.0;
        }
        self.outward * tangent.dot(&(hessian * tangent)) / (length * gradient.norm())
    }

    fn at(&self, position_mm: Point3<f64>) -> Option<Contact> {
        let gradient = self.f.gradient(&[position_mm.x, position_mm.y, position_mm.z]);
        let normal = direction(gradient * self.outward)?;
        Some(Contact { plan: [position_mm.x, position_mm.y], position_mm, normal })
    }

    fn onto(&self, start: Point3<f64>) -> Option<Point3<f64>> {
        let mut at = start;
        for _ in 0..60 {
            let (value, gradient) = (self.f.value(&[at.x, at.y, at.z]), self.f.gradient(&[at.x, at.y, at.z]));
            let step = gradient * (value / gradient.norm_squared());
            if !step.iter().all(|c| c.is_finite()) {
                return None;
            }
            at -= step;
            if step.norm() <= 1e-13 * (1.0 + at.coords.norm()) {
                return Some(at);
            }
        }
        None
    }

    fn nearest_from(&self, start: Point3<f64>, point: &Point3<f64>) -> Option<Contact> {
        let mut at = self.onto(start)?;
        for _ in 0..60 {
            let contact = self.at(at)?;
            let away = point - at;
            let sideways = away - contact.normal.into_inner() * contact.normal.dot(&away);
            if sideways.norm() <= 1e-3 * away.norm().min(1.0) {
                break;
            }
            // Half a step where a full step increases the distance, as on a strongly curved surface.
            let distance = away.norm();
            let shares = [1.0, 0.5, 0.25, 0.1, 0.02].into_iter();
            let next = shares
                .filter_map(|share| self.onto(at + sideways * share))
                .find(|next| (point - next).norm() < distance);
            match next {
                Some(next) => at = next,
                None => break,
            }
        }
        let gradient = self.f.gradient(&[at.x, at.y, at.z]);
        let mut lambda = gradient.dot(&(point - at)) / gradient.norm_squared();
        for _ in 0..30 {
            let here = [at.x, at.y, at.z];
            let (value, gradient, hessian) =
                (self.f.value(&here), self.f.gradient(&here), self.f.hessian(&here));
            let mut matrix = Matrix4::zeros();
            matrix
                .fixed_view_mut::<3, 3>(0, 0)
                .copy_from(&(nalgebra::Matrix3::identity() + hessian * -lambda));
            matrix.fixed_view_mut::<3, 1>(0, 3).copy_from(&-gradient);
            matrix.fixed_view_mut::<1, 3>(3, 0).copy_from(&gradient.transpose());
            let rest = (at - point) - gradient * lambda;
            let right = Vector4::new(rest.x, rest.y, rest.z, value);
            let Some(step) = matrix.lu().solve(&-right) else { break };
            if !step.iter().all(|c| c.is_finite()) || step.xyz().norm() > 1.0 + (point - at).norm() {
                break;
            }
            at += step.xyz();
            lambda += step.w;
            if step.xyz().norm() <= 1e-13 * (1.0 + at.coords.norm()) {
                break;
            }
        }
        self.at(self.onto(at)?)
    }
}
