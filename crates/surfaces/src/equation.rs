//! Surfaces given by equations: explicit z(x, y), parametric (x, y, z)(u, v) and implicit F(x, y, z) = 0.
//!
//! **Method.** Derivatives are symbolic ([`expression`](super::expression)). Explicit and parametric surfaces share one
//! second-order jet: normal S_u × S_v, normal curvature −II/I, and Newton's method for the nearest point. The implicit
//! surface has normal ∇F/|∇F|, normal curvature tᵀ∇²F t/|∇F|, and Newton's method on the Lagrangian of the nearest point.
//!
//! **Shapes.** Plan coordinates are (x, y), (u, v) and (x, y); positions in mm.
//!
//! **Stops.** Newton's method ends at a step below 1e-12 of the scale, after at most 60 steps; a ray through an implicit
//! surface is sampled in [`Implicit::SLICES`] slices from above.
//!
//! **Source and departures.** Textbook differential geometry (do Carmo, *Differential Geometry of Curves and Surfaces*, 2-4
//! and 3-3; for implicit surfaces R. Goldman, *Curvature formulas for implicit curves and surfaces*, 2005).
//!
//! **Checked against.** Numerical differences, the same surface written explicitly and implicitly, spheres and cylinders.

mod implicit;
mod jet;
mod survey;

use nalgebra::{Point3, Vector3};

use super::expression::Expression;
use crate::contact::{Contact, Foot};
use crate::domain::Domain;
use crate::error::SurfaceError;
use jet::Jet;
use survey::{FIXED_COST, LATTICE};

pub use implicit::Implicit;

/// z as a function of x and y. Outward is up, +z.
#[derive(Debug, Clone)]
pub struct Explicit {
    z: Expression,
    domain: Domain,
    lattice: Vec<Contact>,
}

impl Explicit {
    /// Reads `z` as an expression in x and y in mm.
    ///
    /// ```
    /// use nalgebra::{Point3, Vector3};
    /// use truegrind_surfaces::{Domain, Explicit, Surface};
    ///
    /// // A dome of radius 200 mm about (0, 0, −200): a point 0.3 mm above its top, and how strongly it is bent there.
    /// let domain = Domain { first: [-40.0, 40.0], second: [-40.0, 40.0] };
    /// let dome = Surface::Explicit(Explicit::new("sqrt(200^2 - x^2 - y^2) - 200", domain)?);
    /// let above = dome.deviation_mm(&Point3::new(0.0, 0.0, 0.3)).ok_or("no foot")?;
    /// assert!((above - 0.3).abs() < 1e-9);
    /// let top = dome.contact([0.0, 0.0]).ok_or("no contact")?;
    /// assert!((dome.curvature_per_mm(&top, &Vector3::x()) - 1.0 / 200.0).abs() < 1e-9);
    ///
    /// let refused = Explicit::new("sqrt(x", domain).map(|_| ()).map_err(|error| error.to_string());
    /// assert!(refused.is_err_and(|said| said.contains("cannot read the expression `sqrt(x`")));
    /// # Ok::<(), Box<dyn std::error::Error>>(())
    /// ```
    ///
    /// # Errors
    /// A text that cannot be read, an empty range, or a value that is not finite in the domain.
    pub fn new(z: &str, domain: Domain) -> Result<Self, SurfaceError> {
        domain.check(["x", "y"])?;
        let mut surface = Self { z: Expression::parse(z, &["x", "y"])?, domain, lattice: Vec::new() };
        surface.lattice = contacts_on_lattice(&domain, ["x", "y"], z, |plan| surface.jet(plan))?;
        Ok(surface)
    }

    pub(crate) fn domain(&self) -> Domain {
        self.domain
    }

    pub(crate) fn contact(&self, plan: [f64; 2]) -> Option<Contact> {
        let (z, slope) = (self.z.value(&plan), self.z.gradient(&plan));
        self.with(plan, z, slope, [Vector3::zeros(); 3]).contact(plan)
    }

    pub(crate) fn evaluation_cost(&self) -> f64 {
        FIXED_COST + self.z.terms().iter().sum::<f64>()
    }

    pub(crate) fn foot(&self, point: &Point3<f64>) -> Option<Foot> {
        jet::foot(|plan| self.jet(plan), &self.domain, &self.lattice, point)
    }

    pub(crate) fn curvature_per_mm(&self, at: &Contact, direction: &Vector3<f64>) -> f64 {
        self.jet(at.plan).curvature(direction)
    }

    fn jet(&self, plan: [f64; 2]) -> Jet {
        let (z, first, second) = (self.z.value(&plan), self.z.gradient(&plan), self.z.hessian(&plan));
        let bend = [(0, 0), (0, 1), (1, 1)].map(|entry| Vector3::new(0.0, 0.0, second[entry]));
        self.with(plan, z, first, bend)
    }

    fn with(&self, plan: [f64; 2], z: f64, first: Vector3<f64>, second: [Vector3<f64>; 3]) -> Jet {
        Jet {
            point: Point3::new(plan[0], plan[1], z),
            first: [Vector3::new(1.0, 0.0, first[0]), Vector3::new(0.0, 1.0, first[1])],
            second,
            outward: 1.0,
        }
    }
}

/// x, y and z as functions of u and v. Outward is S_u × S_v, or its opposite where `flipped`.
#[derive(Debug, Clone)]
pub struct Parametric {
    coordinates: [Expression; 3],
    domain: Domain,
    flipped: bool,
    lattice: Vec<Contact>,
}

impl Parametric {
    /// Reads x, y and z in mm as expressions in u and v.
    ///
    /// # Errors
    /// A text that cannot be read, an empty range, or a place in the domain without a finite value or without a
    /// normal (a pole).
    pub fn new(coordinates: [&str; 3], domain: Domain, flipped: bool) -> Result<Self, SurfaceError> {
        domain.check(["u", "v"])?;
        let [x, y, z] = coordinates;
        let parse = |text: &str| Expression::parse(text, &["u", "v"]);
        let read = [parse(x)?, parse(y)?, parse(z)?];
        let mut surface = Self { coordinates: read, domain, flipped, lattice: Vec::new() };
        let text = format!("({x}, {y}, {z})");
        surface.lattice = contacts_on_lattice(&domain, ["u", "v"], &text, |plan| surface.jet(plan))?;
        Ok(surface)
    }

    pub(crate) fn domain(&self) -> Domain {
        self.domain
    }

    pub(crate) fn contact(&self, plan: [f64; 2]) -> Option<Contact> {
        self.flat(plan).contact(plan)
    }

    pub(crate) fn evaluation_cost(&self) -> f64 {
        FIXED_COST + self.coordinates.iter().flat_map(Expression::terms).sum::<f64>()
    }

    pub(crate) fn foot(&self, point: &Point3<f64>) -> Option<Foot> {
        jet::foot(|plan| self.jet(plan), &self.domain, &self.lattice, point)
    }

    pub(crate) fn curvature_per_mm(&self, at: &Contact, direction: &Vector3<f64>) -> f64 {
        self.jet(at.plan).curvature(direction)
    }

    fn jet(&self, plan: [f64; 2]) -> Jet {
        let second = self.coordinates.each_ref().map(|c| c.hessian(&plan));
        Jet {
            second: [(0, 0), (0, 1), (1, 1)].map(|entry| Vector3::from_fn(|row, _| second[row][entry])),
            ..self.flat(plan)
        }
    }

    /// The point and its tangents only, as a contact needs them.
    fn flat(&self, plan: [f64; 2]) -> Jet {
        let values = self.coordinates.each_ref().map(|c| c.value(&plan));
        let first = self.coordinates.each_ref().map(|c| c.gradient(&plan));
        Jet {
            point: Point3::from(values),
            first: [0, 1].map(|i| Vector3::from_fn(|row, _| first[row][i])),
            second: [Vector3::zeros(); 3],
            outward: if self.flipped { -1.0 } else { 1.0 },
        }
    }
}

/// Contacts on a lattice over the whole domain, or the place without one.
fn contacts_on_lattice(
    domain: &Domain,
    names: [&str; 2],
    text: &str,
    jet: impl Fn([f64; 2]) -> Jet,
) -> Result<Vec<Contact>, SurfaceError> {
    domain
        .lattice(LATTICE)
        .map(|plan| {
            let jet = jet(plan);
            jet.contact(plan).ok_or_else(|| SurfaceError::NotFinite {
                text: text.to_owned(),
                found: if jet.point.iter().all(|c| c.is_finite()) {
                    "without a normal".to_owned()
                } else {
                    "not finite".to_owned()
                },
                place: format!("{} = {}, {} = {}", names[0], plan[0], names[1], plan[1]),
            })
        })
        .collect()
}
