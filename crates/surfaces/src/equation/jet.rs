//! A parametrised surface near one of its points, up to second order.

use nalgebra::{Matrix2, Point3, Vector2, Vector3};

use crate::contact::{Contact, Foot, direction};
use crate::domain::Domain;

/// A point of S(u, v) with its first and second derivatives.
#[derive(Debug, Clone, Copy)]
pub(super) struct Jet {
    /// S.
    pub(super) point: Point3<f64>,
    /// S_u, S_v.
    pub(super) first: [Vector3<f64>; 2],
    /// S_uu, S_uv, S_vv.
    pub(super) second: [Vector3<f64>; 3],
    /// +1 where S_u × S_v points outward, else −1.
    pub(super) outward: f64,
}

impl Jet {
    /// The point with its normal; `None` where either does not exist.
    pub(super) fn contact(&self, plan: [f64; 2]) -> Option<Contact> {
        let [su, sv] = self.first;
        let across = su.cross(&sv);
        // Where the two tangents are parallel up to rounding, at a pole, their product has no direction.
        let regular = across.norm() > 1e-10 * su.norm() * sv.norm();
        let normal = direction(across * self.outward).filter(|_| regular)?;
        let finite = self.point.iter().all(|c| c.is_finite());
        finite.then_some(Contact { plan, position_mm: self.point, normal })
    }

    /// Normal curvature −II(t, t)/I(t, t) in the direction of the tangential part of `along`, positive where the
    /// surface falls away from its outward side; 0 where there is no such direction.
    pub(super) fn curvature(&self, along: &Vector3<f64>) -> f64 {
        let [su, sv] = self.first;
        let [suu, suv, svv] = self.second;
        let metric = Matrix2::new(su.dot(&su), su.dot(&sv), su.dot(&sv), sv.dot(&sv));
        let Some(inverse) = metric.try_inverse() else { return 0.0 };
        let Some(normal) = direction(su.cross(&sv) * self.outward) else { return 0.0 };
        let t = inverse * Vector2::new(su.dot(along), sv.dot(along));
        let length = (metric * t).dot(&t);
        if length <= 1e-20 * along.norm_squared() {
            return 0.0;
        }
        let bend = suu * (t.x * t.x) + suv * (2.0 * t.x * t.y) + svv * (t.y * t.y);
        -normal.dot(&bend) / length
    }
}

/// The nearest point within the domain: projected Newton steps on |S − p|²/2 from the nearest lattice point.
pub(super) fn foot(
    jet: impl Fn([f64; 2]) -> Jet,
    domain: &Domain,
    lattice: &[Contact],
    point: &Point3<f64>,
) -> Option<Foot> {
    let squared = |c: &Contact| (c.position_mm - point).norm_squared();
    let start = lattice.iter().min_by(|a, b| squared(a).total_cmp(&squared(b)))?;
    let (low, high) =
        (Vector2::new(domain.first[0], domain.second[0]), Vector2::new(domain.first[1], domain.second[1]));
    let cost = |at: &Jet| 0.5 * (at.point - point).norm_squared();
    let mut plan = Vector2::from(start.plan);
    let mut here = jet(start.plan);
    for _ in 0..60 {
        let away = here.point - point;
        let ([su, sv], [suu, suv, svv]) = (here.first, here.second);
        let mut gradient = Vector2::new(away.dot(&su), away.dot(&sv));
        let metric = Matrix2::new(su.dot(&su), su.dot(&sv), su.dot(&sv), sv.dot(&sv));
        let bend = Matrix2::new(away.dot(&suu), away.dot(&suv), away.dot(&suv), away.dot(&svv));
        // Far from the surface the full second derivative may not be positive; the metric alone always is.
        let mut matrix = metric + bend;
        if !(matrix.determinant() > 1e-6 * metric.determinant() && matrix.trace() > 0.0) {
            matrix = metric;
        }
        // A coordinate at its bound with a step beyond it is fixed there.
        for i in 0..2 {
            if (plan[i] <= low[i] && gradient[i] > 0.0) || (plan[i] >= high[i] && gradient[i] < 0.0) {
                gradient[i] = 0.0;
                matrix[(0, 1)] = 0.0;
                matrix[(1, 0)] = 0.0;
            }
        }
        let step = -(matrix.try_inverse()? * gradient);
        let mut share = 1.0;
        let next = loop {
            let tried = (plan + step * share).sup(&low).inf(&high);
            let there = jet(tried.into());
            if cost(&there) <= cost(&here) {
                break Some((tried, there));
            }
            share *= 0.5;
            if share < 1e-6 {
                break None;
            }
        };
        let Some((tried, there)) = next else { break };
        let moved = (tried - plan).component_div(&(high - low)).amax();
        (plan, here) = (tried, there);
        if moved < 1e-13 {
            break;
        }
    }
    Foot::over(here.contact(plan.into())?, point)
}
