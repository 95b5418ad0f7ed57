//! The surfaces that ship with truegrind, one of each kind.

use crate::error::SurfaceError;
use crate::file::SurfaceFile;

/// A sample surface file, as its bytes.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Sample {
    /// Name of the file in the folder `surfaces`.
    pub file: &'static str,
    /// Its bytes.
    pub bytes: &'static [u8],
}

/// The demo surface: explicit, a gently doubly curved patch, in a raster.
pub const BLADE: Sample =
    Sample { file: "blade.toml", bytes: include_bytes!("../../../surfaces/blade.toml") };
/// Parametric, part of a ball, in a spiral spaced by scallop height.
pub const DOME: Sample = Sample { file: "dome.toml", bytes: include_bytes!("../../../surfaces/dome.toml") };
/// Implicit, a saddle, in a contour pattern.
pub const SADDLE: Sample =
    Sample { file: "saddle-implicit.toml", bytes: include_bytes!("../../../surfaces/saddle-implicit.toml") };
/// A mesh with a hole, in a one-way raster.
pub const PLATE: Sample =
    Sample { file: "plate.toml", bytes: include_bytes!("../../../surfaces/plate.toml") };
/// The triangles of [`PLATE`].
pub const PLATE_STL: &[u8] = include_bytes!("../../../surfaces/plate.stl");

/// All sample surface files.
pub const ALL: [Sample; 4] = [BLADE, DOME, SADDLE, PLATE];

impl Sample {
    /// Reads the sample and, where needed, its mesh.
    ///
    /// # Errors
    /// None for the samples: a test reads every one.
    pub fn read(&self) -> Result<SurfaceFile, SurfaceError> {
        SurfaceFile::read(self.file, self.bytes, |name| match name {
            "plate.stl" => Ok(PLATE_STL.to_vec()),
            _ => Err("it does not ship"),
        })
    }
}
