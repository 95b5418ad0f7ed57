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
//!
//! | key | meaning | if left out |
//! |---|---|---|
//! | `name` | name of the job, fit for a module | `surface` |
//! | `surface.kind` | `explicit`, `parametric`, `implicit`, `mesh` | required |
//! | `surface.z`, `x_mm`, `y_mm` | explicit: equation in x and y, ranges in mm | required |
//! | `surface.x`, `y`, `z`, `u`, `v` | parametric: equations in u and v, ranges | required |
//! | `surface.f`, `x_mm`, `y_mm`, `z_mm` | implicit: equation in x, y and z, ranges in mm | required |
//! | `surface.mesh`, `x_mm`, `y_mm` | mesh: name of the STL file, ranges in mm | the ranges: all of it |
//! | `surface.unit_mm` | mesh: length of the file's unit in mm | 1 |
//! | `surface.flip_normal` | parametric and mesh: the other side is outside | `false` |
//! | `work_object.name`, `tool.name` | names of wobjdata and tooldata | required |
//! | `….position_mm` | of the frame in the robot's base; of the TCP in the flange | required |
//! | `….quaternion` or `….rpy_deg` | w, x, y, z; or roll, pitch, yaw: R = Rz(yaw) Ry(pitch) Rx(roll) | no rotation |
//! | `….origin` | `metrology` or `taught`: with `--surface` it counts as that of a cell file, which must not say otherwise | not known |
//! | `tool.mass_kg`, `cog_mm` | mass, and centre of gravity in the flange | required |
//! | `tool.radius_mm` | radius where the tool touches; `step_over_mm` is at most twice as much | required by `scallop_mm` alone |
//! | `path.pattern` | `raster`, `spiral`, `contour` | required |
//! | `path.step_over_mm` or `path.scallop_mm` | distance of passes, or height of the cusp between them | one is required |
//! | `path.along` | direction of a raster: `x` or `y`, of a parametric surface `u` or `v` | the first |
//! | `path.traverse` | raster: `zigzag`, `one-way` | `zigzag` |
//! | `path.max_step_mm`, `chord_mm` | bounds on the distance of points | 5 and 0.02 |
//! | `path.lead_deg`, `tilt_deg` | angles of the tool to the normal | 0 |
//! | `path.tool_x`, `tool_x_direction` | `fixed` near a direction, or along the `feed` | `fixed`, [1, 0, 0] |
//! | `path.approach_mm` | height of approach, retract and links | 20 |
//! | `path.speed_mm_s`, `travel_speed_mm_s` | of cuts; of approach, retract and links | required; 100 |
//! | `path.zone` | `fine`, `z0`, `z1`, `z5`, … between cuts | `z1` |

mod faults;
mod surface_table;

use std::fmt::Display;

use nalgebra::{Quaternion, Translation3, UnitQuaternion, Vector3};
use serde::Deserialize;
use serde::de::IgnoredAny;
use truegrind_math::toml_text::{self, TomlError};

use self::faults::Faults;
use self::surface_table::SurfaceTable;
use crate::error::SurfaceError;
use crate::path::{self, Along, PathOptions, PathPoint, Pattern, Spacing, ToolX, Traverse};
use crate::surface::Surface;
use truegrind_math::se3::Pose;

/// The zones that controllers know by name.
pub const ZONES: [&str; 15] = [
    "fine", "z0", "z1", "z5", "z10", "z15", "z20", "z30", "z40", "z50", "z60", "z80", "z100", "z150", "z200",
];
/// A frame closer to its parent than this, but not coincident with it, is assumed to be stated in metres.
const MIN_DISTANCE_MM: f64 = 2.0;
/// Largest distance of a frame from its parent (mm).
const MAX_DISTANCE_MM: f64 = 1e6;

/// Origin of a tool or work-object frame.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Origin {
    /// From CAD or a measurement, independent of the robot.
    Metrology,
    /// Taught with the robot, and therefore affected by the robot's own error.
    Taught,
}

/// A tool on the flange.
#[derive(Debug, Clone, PartialEq)]
pub struct Tool {
    /// Name of the tooldata.
    pub name: String,
    /// Frame of the TCP in the flange.
    pub flange_from_tool: Pose,
    /// Mass in kg.
    pub mass_kg: f64,
    /// Centre of gravity in the flange frame in mm.
    pub cog_mm: Vector3<f64>,
    /// Contact radius of the tool (mm); needed for a scallop height.
    pub radius_mm: Option<f64>,
    /// Origin of the TCP, if stated.
    pub origin: Option<Origin>,
}

/// Position of the surface.
#[derive(Debug, Clone, PartialEq)]
pub struct WorkObject {
    /// Name of the wobjdata.
    pub name: String,
    /// The surface's frame in the robot's base.
    pub base_from_work_object: Pose,
    /// Origin of the frame, if stated.
    pub origin: Option<Origin>,
}

/// Contents of a surface file, validated.
#[derive(Debug, Clone)]
pub struct SurfaceFile {
    /// Name of the job; also valid as a module name.
    pub name: String,
    /// The surface.
    pub surface: Surface,
    /// Its work object.
    pub work_object: WorkObject,
    /// The tool.
    pub tool: Tool,
    /// Path options.
    pub path: PathOptions,
    /// Feed speed of the TCP during a cut in mm/s.
    pub speed_mm_s: f64,
    /// Speed of the TCP on approach, retract and link in mm/s.
    pub travel_speed_mm_s: f64,
    /// Zone between cuts: `fine`, `z0`, `z1`, …, by the controller's names.
    pub zone: String,
}

impl SurfaceFile {
    /// Reads the bytes of a surface file. `file`: the name stated in errors; a mesh is requested by the name that the file
    /// gives it.
    ///
    /// ```
    /// use truegrind_surfaces::{Origin, SurfaceFile, sample};
    ///
    /// let none = |_: &str| Err("there is none");
    /// let blade = SurfaceFile::read("blade.toml", sample::BLADE.bytes, none)?;
    /// assert_eq!(blade.tool.name, "tSpindle");
    /// assert!(blade.points()?.len() > 100);
    /// // A mesh is asked for by its name; where it is not there, the file says so.
    /// let refused = SurfaceFile::read("plate.toml", sample::PLATE.bytes, none).map(|_| ()).map_err(|error| error.to_string());
    /// assert!(refused.is_err_and(|said| said.contains("plate.toml") && said.contains("there is none")));
    /// let plate = SurfaceFile::read("plate.toml", sample::PLATE.bytes, |_| Ok::<_, String>(sample::PLATE_STL.to_vec()))?;
    /// assert_eq!(plate.work_object.origin, Some(Origin::Taught));
    /// # Ok::<(), truegrind_surfaces::SurfaceError>(())
    /// ```
    ///
    /// # Errors
    /// File, key (or line and column), what was found, what was expected and what to do.
    pub fn read<E: Display>(
        file: &str,
        bytes: &[u8],
        resolve: impl FnOnce(&str) -> Result<Vec<u8>, E>,
    ) -> Result<Self, SurfaceError> {
        let faults = Faults { file };
        let text = std::str::from_utf8(bytes).map_err(|error| {
            let read = String::from_utf8_lossy(&bytes[..error.valid_up_to()]);
            faults.toml(&read, read.len(), "found a byte that is not UTF-8, expected text")
        })?;
        let toml =
            |error: TomlError| faults.toml(text, error.span().map_or(0, |span| span.start), error.message());
        let stated: Stated = toml_text::read(text).map_err(toml)?;
        let surface_table = SurfaceTable::read(text).map_err(toml)?;
        let name = stated.name.unwrap_or_else(|| "surface".to_owned());
        faults.name("name", &name)?;
        let surface = surface_table.surface(&faults, resolve)?;
        let work_object = faults.work_object(stated.work_object)?;
        let tool = faults.tool(stated.tool)?;
        let path = faults.path(&stated.path, surface_table.coordinates(), &tool)?;
        let motion = &stated.path;
        let speed_mm_s = faults.positive(
            "path.speed_mm_s",
            motion.speed_mm_s,
            "a speed above 0 in mm/s, up to 1,000,000",
        )?;
        let travel = motion.travel_speed_mm_s.unwrap_or(100.0);
        let travel_speed_mm_s =
            faults.positive("path.travel_speed_mm_s", travel, "a speed above 0 in mm/s, up to 1,000,000")?;
        let zone = motion.zone.clone().unwrap_or_else(|| "z1".to_owned());
        if !ZONES.contains(&zone.as_str()) {
            let expected = format!("one of {}", ZONES.join(", "));
            return Err(faults.value(
                "path.zone",
                format!("`{zone}`"),
                expected,
                "choose a zone by its name",
            ));
        }
        Ok(Self { name, surface, work_object, tool, path, speed_mm_s, travel_speed_mm_s, zone })
    }

    /// The path over the surface, in the work object.
    ///
    /// # Errors
    /// As [`path::over`].
    pub fn points(&self) -> Result<Vec<PathPoint>, SurfaceError> {
        path::over(&self.surface, &self.path)
    }
}

#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
struct Stated {
    name: Option<String>,
    /// Read by its kind, as a [`SurfaceTable`].
    #[serde(rename = "surface")]
    _surface: IgnoredAny,
    work_object: StatedWorkObject,
    tool: StatedTool,
    path: StatedPath,
}

#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
struct StatedWorkObject {
    name: String,
    position_mm: [f64; 3],
    quaternion: Option<[f64; 4]>,
    rpy_deg: Option<[f64; 3]>,
    origin: Option<Origin>,
}

#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
struct StatedTool {
    name: String,
    position_mm: [f64; 3],
    quaternion: Option<[f64; 4]>,
    rpy_deg: Option<[f64; 3]>,
    mass_kg: f64,
    cog_mm: [f64; 3],
    radius_mm: Option<f64>,
    origin: Option<Origin>,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq, Deserialize)]
#[serde(rename_all = "kebab-case")]
enum StatedToolX {
    Fixed,
    Feed,
}

#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
struct StatedPath {
    pattern: Pattern,
    along: Option<String>,
    traverse: Option<Traverse>,
    step_over_mm: Option<f64>,
    scallop_mm: Option<f64>,
    max_step_mm: Option<f64>,
    chord_mm: Option<f64>,
    lead_deg: Option<f64>,
    tilt_deg: Option<f64>,
    tool_x: Option<StatedToolX>,
    tool_x_direction: Option<[f64; 3]>,
    approach_mm: Option<f64>,
    speed_mm_s: f64,
    travel_speed_mm_s: Option<f64>,
    zone: Option<String>,
}

impl Faults<'_> {
    fn work_object(&self, stated: StatedWorkObject) -> Result<WorkObject, SurfaceError> {
        self.name("work_object.name", &stated.name)?;
        let frame = self.frame("work_object", stated.position_mm, stated.quaternion, stated.rpy_deg)?;
        Ok(WorkObject { name: stated.name, base_from_work_object: frame, origin: stated.origin })
    }

    fn tool(&self, stated: StatedTool) -> Result<Tool, SurfaceError> {
        self.name("tool.name", &stated.name)?;
        let frame = self.frame("tool", stated.position_mm, stated.quaternion, stated.rpy_deg)?;
        let mass_kg =
            self.positive("tool.mass_kg", stated.mass_kg, "a mass above 0 in kg, up to 1,000,000")?;
        if !stated.cog_mm.iter().all(|c| c.abs() <= MAX_DISTANCE_MM) {
            let found = format!("{:?}", stated.cog_mm);
            return Err(self.value(
                "tool.cog_mm",
                found,
                "three finite numbers in mm, within ±1,000,000",
                "correct the number",
            ));
        }
        let radius_mm = stated
            .radius_mm
            .map(|radius| self.positive("tool.radius_mm", radius, "a radius above 0 in mm, up to 1,000,000"))
            .transpose()?;
        Ok(Tool {
            name: stated.name,
            flange_from_tool: frame,
            mass_kg,
            cog_mm: Vector3::from(stated.cog_mm),
            radius_mm,
            origin: stated.origin,
        })
    }

    fn frame(
        &self,
        table: &str,
        position_mm: [f64; 3],
        quaternion: Option<[f64; 4]>,
        rpy_deg: Option<[f64; 3]>,
    ) -> Result<Pose, SurfaceError> {
        let key = |key: &str| format!("{table}.{key}");
        let position = Vector3::from(position_mm);
        let away = position.norm();
        if !(away <= MAX_DISTANCE_MM) || (away > 0.0 && away < MIN_DISTANCE_MM) {
            let found = format!("{position_mm:?}");
            let remedy = "state millimetres; if these are metres, multiply them by 1000";
            return Err(self.value(&key("position_mm"), found, "a position in mm", remedy));
        }
        let rotation = match (quaternion, rpy_deg) {
            (Some(_), Some(_)) => {
                let (found, expected) = ("a rotation beside quaternion", "either quaternion or rpy_deg");
                return Err(self.value(&key("rpy_deg"), found, expected, "remove one of the two"));
            }
            (Some([w, x, y, z]), None) => {
                let stated = Quaternion::new(w, x, y, z);
                if stated.norm().is_nan() || (stated.norm() - 1.0).abs() > 1e-3 {
                    let found = format!("[{w}, {x}, {y}, {z}] of length {}", stated.norm());
                    let expected = "w, x, y, z of length 1";
                    return Err(self.value(
                        &key("quaternion"),
                        found,
                        expected,
                        "correct it, or state rpy_deg",
                    ));
                }
                UnitQuaternion::from_quaternion(stated)
            }
            (None, Some(rpy)) => {
                if !rpy.iter().all(|a| a.abs() <= 360.0) {
                    let (found, expected) = (format!("{rpy:?}"), "roll, pitch and yaw within 360 degrees");
                    return Err(self.value(&key("rpy_deg"), found, expected, "correct the angles"));
                }
                let [roll, pitch, yaw] = rpy.map(f64::to_radians);
                UnitQuaternion::from_euler_angles(roll, pitch, yaw)
            }
            (None, None) => UnitQuaternion::identity(),
        };
        Ok(Pose::from_parts(Translation3::from(position), rotation))
    }

    fn path(
        &self,
        stated: &StatedPath,
        coordinates: [&str; 2],
        tool: &Tool,
    ) -> Result<PathOptions, SurfaceError> {
        let only_raster = |key: &str, given: bool| {
            if !given || stated.pattern == Pattern::Raster {
                return Ok(());
            }
            let full = format!("path.{key}");
            Err(self.value(
                &full,
                "a key without a meaning",
                "it with pattern = \"raster\" alone",
                "remove it",
            ))
        };
        only_raster("along", stated.along.is_some())?;
        only_raster("traverse", stated.traverse.is_some())?;
        let default = PathOptions::default();
        let options = PathOptions {
            pattern: stated.pattern,
            along: self.along(stated, coordinates)?,
            traverse: stated.traverse.unwrap_or_default(),
            spacing: self.spacing(stated, tool)?,
            max_step_mm: stated.max_step_mm.unwrap_or(default.max_step_mm),
            chord_mm: stated.chord_mm.unwrap_or(default.chord_mm),
            lead_rad: stated.lead_deg.unwrap_or(0.0).to_radians(),
            tilt_rad: stated.tilt_deg.unwrap_or(0.0).to_radians(),
            tool_x: self.tool_x(stated)?,
            approach_mm: stated.approach_mm.unwrap_or(default.approach_mm),
        };
        match options.check() {
            Ok(()) => Ok(options),
            Err(SurfaceError::Option { option, found, expected }) => {
                Err(self.value(&format!("path.{option}"), found.to_string(), expected, "correct the number"))
            }
            Err(error) => Err(self.stated("path", error)),
        }
    }

    /// The coordinate of the surface along which the passes run.
    fn along(&self, stated: &StatedPath, names: [&str; 2]) -> Result<Along, SurfaceError> {
        Ok(match stated.along.as_deref() {
            None => Along::First,
            Some(name) if name == names[0] => Along::First,
            Some(name) if name == names[1] => Along::Second,
            Some(name) => {
                let expected = format!("`{}` or `{}`", names[0], names[1]);
                let remedy = "choose the coordinate along which the passes run";
                return Err(self.value("path.along", format!("`{name}`"), expected, remedy));
            }
        })
    }

    /// Distance of neighbouring passes.
    fn spacing(&self, stated: &StatedPath, tool: &Tool) -> Result<Spacing, SurfaceError> {
        Ok(match (stated.step_over_mm, stated.scallop_mm, tool.radius_mm) {
            (Some(step), None, Some(radius)) if step > 2.0 * radius => {
                let expected = format!("at most {} mm, twice tool.radius_mm", 2.0 * radius);
                let remedy = "make it smaller: the passes would leave strips between them";
                return Err(self.value("path.step_over_mm", step.to_string(), expected, remedy));
            }
            (Some(step_over_mm), None, _) => Spacing::StepOver { step_over_mm },
            (None, Some(scallop_mm), Some(tool_radius_mm)) => Spacing::Scallop { scallop_mm, tool_radius_mm },
            (None, Some(_), None) => {
                let expected = "the radius where the tool touches, as path.scallop_mm is given";
                return Err(self.value(
                    "tool.radius_mm",
                    "nothing",
                    expected,
                    "state it, or give path.step_over_mm",
                ));
            }
            (given, _, _) => {
                let found = if given.is_some() { "scallop_mm beside it" } else { "nothing" };
                let expected = "either step_over_mm or scallop_mm";
                return Err(self.value("path.step_over_mm", found, expected, "state one of the two"));
            }
        })
    }

    /// Orientation of the tool about its axis.
    fn tool_x(&self, stated: &StatedPath) -> Result<ToolX, SurfaceError> {
        Ok(match (stated.tool_x, stated.tool_x_direction) {
            (Some(StatedToolX::Feed), Some(_)) => {
                let expected = "no direction with tool_x = \"feed\"";
                return Err(self.value(
                    "path.tool_x_direction",
                    "a direction",
                    expected,
                    "remove one of the two",
                ));
            }
            (Some(StatedToolX::Feed), None) => ToolX::Feed,
            (_, direction) => ToolX::Fixed(Vector3::from(direction.unwrap_or([1.0, 0.0, 0.0]))),
        })
    }
}
