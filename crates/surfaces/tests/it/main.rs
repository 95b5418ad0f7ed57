//! Tests of `surface`.

// A test that cannot go on panics.
#![allow(clippy::unwrap_used, clippy::print_stderr)]

mod expression;
mod equation;
mod mesh;
mod sampling;
mod path;
mod file;

use truegrind_surfaces::{Domain, Explicit, Implicit, Mesh, Parametric, Surface};

/// −a…a in both plan coordinates.
fn square(a: f64) -> Domain {
    Domain { first: [-a, a], second: [-a, a] }
}

fn explicit(z: &str, domain: Domain) -> Surface {
    Surface::Explicit(Explicit::new(z, domain).unwrap())
}

fn implicit(f: &str, domain: Domain, z_mm: [f64; 2]) -> Surface {
    Surface::Implicit(Implicit::new(f, domain, z_mm).unwrap())
}

fn parametric(xyz: [&str; 3], domain: Domain) -> Surface {
    Surface::Parametric(Parametric::new(xyz, domain, false).unwrap())
}

fn mesh_of(bytes: &[u8]) -> Mesh {
    Mesh::from_stl(bytes, &Default::default()).unwrap()
}
