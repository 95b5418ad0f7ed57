//! The table `[surface]`, whose `kind` says which keys it has.

use std::fmt::Display;

use serde::Deserialize;
use serde::de::DeserializeOwned;
use truegrind_math::toml_text::{self, TomlError};

use super::faults::Faults;
use crate::domain::Domain;
use crate::equation::{Explicit, Implicit, Parametric};
use crate::error::SurfaceError;
use crate::expression::ExpressionError;
use crate::mesh::{Mesh, MeshOptions};
use crate::surface::Surface;

/// What the table states.
pub(super) enum SurfaceTable {
    Explicit(ExplicitTable),
    Parametric(ParametricTable),
    Implicit(ImplicitTable),
    Mesh(MeshTable),
}

/// A text of which only the surface is read, as the kind `T`.
#[derive(Deserialize)]
struct Text<T> {
    surface: T,
}

/// A surface of which only the kind is read.
#[derive(Deserialize)]
struct Tag {
    kind: Kind,
}

#[derive(Clone, Copy, Deserialize)]
#[serde(rename_all = "kebab-case")]
enum Kind {
    Explicit,
    Parametric,
    Implicit,
    Mesh,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct ExplicitTable {
    #[serde(rename = "kind")]
    _kind: Kind,
    z: String,
    x_mm: [f64; 2],
    y_mm: [f64; 2],
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct ParametricTable {
    #[serde(rename = "kind")]
    _kind: Kind,
    x: String,
    y: String,
    z: String,
    u: [f64; 2],
    v: [f64; 2],
    #[serde(default)]
    flip_normal: bool,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct ImplicitTable {
    #[serde(rename = "kind")]
    _kind: Kind,
    f: String,
    x_mm: [f64; 2],
    y_mm: [f64; 2],
    z_mm: [f64; 2],
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct MeshTable {
    #[serde(rename = "kind")]
    _kind: Kind,
    mesh: String,
    x_mm: Option<[f64; 2]>,
    y_mm: Option<[f64; 2]>,
    unit_mm: Option<f64>,
    #[serde(default)]
    flip_normal: bool,
}

impl SurfaceTable {
    /// Reads the text once for its kind, and once as that kind: serde's own tagged enums lose the place of an error.
    pub(super) fn read(text: &str) -> Result<Self, TomlError> {
        Ok(match toml_text::read::<Text<Tag>>(text)?.surface.kind {
            Kind::Explicit => Self::Explicit(table(text)?),
            Kind::Parametric => Self::Parametric(table(text)?),
            Kind::Implicit => Self::Implicit(table(text)?),
            Kind::Mesh => Self::Mesh(table(text)?),
        })
    }

    /// Names of the two coordinates along which passes may run.
    pub(super) fn coordinates(&self) -> [&'static str; 2] {
        match self {
            Self::Parametric(_) => ["u", "v"],
            Self::Explicit(_) | Self::Implicit(_) | Self::Mesh(_) => ["x", "y"],
        }
    }

    /// The surface; a mesh is requested by its name.
    pub(super) fn surface<E: Display>(
        &self,
        faults: &Faults<'_>,
        resolve: impl FnOnce(&str) -> Result<Vec<u8>, E>,
    ) -> Result<Surface, SurfaceError> {
        let (made, equations, unit): (_, &[_], _) = match self {
            Self::Explicit(ExplicitTable { z, x_mm, y_mm, .. }) => {
                let made = Explicit::new(z, Domain { first: *x_mm, second: *y_mm });
                (made.map(Surface::Explicit), &[("z", z)], "_mm")
            }
            Self::Parametric(ParametricTable { x, y, z, u, v, flip_normal, .. }) => {
                let made = Parametric::new([x, y, z], Domain { first: *u, second: *v }, *flip_normal);
                (made.map(Surface::Parametric), &[("x", x), ("y", y), ("z", z)], "")
            }
            Self::Implicit(ImplicitTable { f, x_mm, y_mm, z_mm, .. }) => {
                let made = Implicit::new(f, Domain { first: *x_mm, second: *y_mm }, *z_mm);
                (made.map(Surface::Implicit), &[("f", f)], "_mm")
            }
            Self::Mesh(table) => return table.surface(faults, resolve),
        };
        made.map_err(|error| {
            let key = match &error {
                SurfaceError::Expression(ExpressionError { text, .. }) => equations
                    .iter()
                    .find(|(_, equation)| *equation == text)
                    .map_or("surface".to_owned(), |(key, _)| format!("surface.{key}")),
                SurfaceError::Range { name, .. } => format!("surface.{name}{unit}"),
                _ => "surface".to_owned(),
            };
            faults.stated(&key, error)
        })
    }
}

impl MeshTable {
    fn surface<E: Display>(
        &self,
        faults: &Faults<'_>,
        resolve: impl FnOnce(&str) -> Result<Vec<u8>, E>,
    ) -> Result<Surface, SurfaceError> {
        let domain = match (self.x_mm, self.y_mm) {
            (Some(first), Some(second)) => Some(Domain { first, second }),
            (None, None) => None,
            (x, _) => {
                let (given, missing) = if x.is_some() { ("x_mm", "y_mm") } else { ("y_mm", "x_mm") };
                let expected = format!("a range, as {given} is given");
                let remedy = "state both ranges, or neither for all of the mesh";
                return Err(faults.value(&format!("surface.{missing}"), "nothing", expected, remedy));
            }
        };
        let expected = "the length of the file's unit in mm, above 0, up to 1,000,000";
        let unit_mm = faults.positive("surface.unit_mm", self.unit_mm.unwrap_or(1.0), expected)?;
        let bytes = resolve(&self.mesh).map_err(|error| {
            let found = format!("`{}`, which cannot be read ({error})", self.mesh);
            let remedy = "correct the name or put the file there";
            faults.value("surface.mesh", found, "an STL file beside this file", remedy)
        })?;
        let options = MeshOptions { unit_mm, flipped: self.flip_normal, domain };
        Mesh::from_stl(&bytes, &options).map(Surface::Mesh).map_err(|error| {
            let key = match &error {
                SurfaceError::Range { name, .. } => format!("surface.{name}_mm"),
                _ => "surface.mesh".to_owned(),
            };
            faults.stated(&key, error)
        })
    }
}

/// The surface of a text as the kind `T`.
fn table<T: DeserializeOwned>(text: &str) -> Result<T, TomlError> {
    Ok(toml_text::read::<Text<T>>(text)?.surface)
}
