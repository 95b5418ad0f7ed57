//! The surface file: surface, work object, tool and path in one TOML text.
//!
//! ```toml
//! name = "blade"
//!
//! [surface]
//! kind = "explicit"              # explicit | parametric | implicit | mesh
//! z = "12 - x^2/300 - y^2/900"   # mm from mm; parametric: x, y, z of u, v; implicit: f of x, y, z; mesh: file
//! x_mm = [-50, 50]
//! y_mm = [-80, 80]
//!
//! [work_object]
//! name = "wobjBlade"
//! position_mm = [420, 0, 250]    # of the surface's frame in the robot's base
//! rpy_deg = [0, 0, 0]            # or quaternion = [w, x, y, z]
//! origin = "metrology"           # metrology | taught; leave out if not known
//!
//! [tool]
//! name = "tSpindle"
//! position_mm = [0, 0, 120]      # of the TCP in the flange
//! quaternion = [1, 0, 0, 0]
//! mass_kg = 1.2
//! cog_mm = [0, 0, 55]
//! radius_mm = 20
//!
//! [path]
//! pattern = "raster"             # raster | spiral | contour
//! step_over_mm = 8               # or scallop_mm, which needs the tool's radius_mm
//! speed_mm_s = 40
//! ```

use nalgebra::Vector3;
use serde::Deserialize;

use super::path::PathOptions;
use super::Surface;
use crate::math::se3::Pose;

/// How a tool or work-object frame was obtained.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Origin {
    /// Drawn or measured, independent of the robot.
    Metrology,
    /// Taught with the robot, and therefore wrong by the robot's own error.
    Taught,
}

/// A tool on the flange.
#[derive(Debug, Clone, PartialEq)]
pub struct Tool {
    /// Name of the tooldata.
    pub name: String,
    /// Frame of the TCP in the flange.
    pub flange_from_tool: Pose,
    /// Mass [kg].
    pub mass_kg: f64,
    /// Centre of gravity in the flange frame [mm].
    pub cog_mm: Vector3<f64>,
    /// Radius of the tool where it touches [mm]; needed for a scallop height.
    pub radius_mm: Option<f64>,
    /// How the TCP was obtained, if stated.
    pub origin: Option<Origin>,
}

/// Where the surface is.
#[derive(Debug, Clone, PartialEq)]
pub struct WorkObject {
    /// Name of the wobjdata.
    pub name: String,
    /// The surface's frame in the robot's base.
    pub base_from_work_object: Pose,
    /// How the frame was obtained, if stated.
    pub origin: Option<Origin>,
}

/// What a surface file states, checked and ready to use.
#[derive(Debug, Clone)]
pub struct SurfaceFile {
    /// Name of the job; also fit for the name of a module.
    pub name: String,
    /// The surface.
    pub surface: Surface,
    /// Its place.
    pub work_object: WorkObject,
    /// The tool.
    pub tool: Tool,
    /// How the path runs.
    pub path: PathOptions,
    /// Feed speed of the TCP on a cut [mm/s].
    pub speed_mm_s: f64,
    /// Speed of the TCP on approach, retract and link [mm/s].
    pub travel_speed_mm_s: f64,
    /// Zone between cuts: `fine`, `z0`, `z1`, …, as the controller names it.
    pub zone: String,
}
