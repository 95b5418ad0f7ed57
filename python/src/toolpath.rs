//! Programs from surface files, and cell files to fill in.

use std::path::PathBuf;

use nalgebra::Vector6;
use numpy::PyArray2;
use pyo3::prelude::*;
use truegrind::compensation::cell::nc_setup::cell_setup;
use truegrind::compensation::cell::template::{TemplateProgram, cell_template};
use truegrind::planning::toolpath::{Toolpath, control_of, toolpath};
use truegrind::{Cell, NcDialect, Robot};

use crate::errors::{Kind, Refusal};
use crate::files;
use crate::interruptible::run;
use crate::programs::{read_surface, sources};
use crate::robot::named;
use crate::types::{Floats, NamedRobot, Object, ProgramFiles, Typed};

/// A tool path on a surface, with the joints of the nominal arm that follow it.
#[pyclass(name = "Toolpath", module = "truegrind", frozen)]
pub(crate) struct PyToolpath {
    path: Toolpath,
    robot: Robot,
    surface: PathBuf,
}

#[pymethods]
impl PyToolpath {
    /// Points of the path in the work object (mm), shape (N, 3).
    #[getter]
    fn position_mm<'py>(&self, py: Python<'py>) -> PyResult<Typed<Floats, Bound<'py, PyArray2<f64>>>> {
        let rows: Vec<Vec<f64>> =
            self.path.points.iter().map(|point| point.position_mm.coords.iter().copied().collect()).collect();
        Ok(PyArray2::from_vec2(py, &rows)?.into())
    }

    /// Controller angles of the nominal arm at each point (°), shape (N, 6).
    #[getter]
    fn q_deg<'py>(&self, py: Python<'py>) -> PyResult<Typed<Floats, Bound<'py, PyArray2<f64>>>> {
        let degrees = |joints: &Vector6<f64>| joints.iter().map(|q| q.to_degrees()).collect::<Vec<_>>();
        let rows: Vec<Vec<f64>> = self.path.joints.iter().map(degrees).collect();
        Ok(PyArray2::from_vec2(py, &rows)?.into())
    }

    /// Smallest distance to a singularity on the path, from 0.
    #[getter]
    fn singularity(&self) -> f64 {
        self.path.singularity
    }

    /// The program: ``"rapid"``, ``"fanuc"`` (Fanuc style) or ``"siemens"`` (840D). ``inline``: the targets stand in the instructions of a
    /// RAPID program instead of declarations.
    #[pyo3(signature = (control: "Literal['rapid', 'fanuc', 'siemens']" = "rapid", *, inline = false))]
    fn program(&self, control: &str, inline: bool) -> PyResult<String> {
        let control = match control {
            "rapid" => None,
            "fanuc" => Some(NcDialect::Fanuc),
            "siemens" => Some(NcDialect::Siemens),
            other => {
                let expected = "\"rapid\", \"fanuc\" or \"siemens\"";
                return Err(Refusal::argument("control", other, expected).into());
            }
        };
        Ok(String::from_utf8_lossy(&self.text(control, inline)?).into_owned())
    }

    /// Writes the program: RAPID (.mod), Fanuc style (.nc) or Siemens 840D (.mpf), by the extension of the path.
    #[pyo3(signature = (path, *, inline = false))]
    fn save(&self, path: PathBuf, inline: bool) -> PyResult<()> {
        let control = control_of(&path)
            .map_err(|error| Refusal::new(Kind::Program, error).of_file(&files::name(&path)))?;
        files::spare(&path, &[&self.surface])?;
        files::write(&path, &self.text(control, inline)?)
    }

    fn __len__(&self) -> usize {
        self.path.points.len()
    }

    fn __repr__(&self) -> String {
        format!("<Toolpath for {}: {} points>", self.robot.sheet.name, self.path.points.len())
    }
}

impl PyToolpath {
    fn text(&self, control: Option<NcDialect>, inline: bool) -> Result<Vec<u8>, Refusal> {
        self.path.program(control, &self.robot, inline).map_err(|error| Refusal::new(Kind::Program, error))
    }
}

/// Makes a grinding program from a surface file (TOML: surface, work object, tool and pattern), as ``truegrind path`` does. The joints are those
/// of the nominal arm, which the controller computes with. Raises ``ProgramError`` if the robot cannot follow the path.
#[pyfunction]
#[pyo3(name = "path")]
pub(crate) fn path_(py: Python<'_>, surface: PathBuf, robot: Object<'_, NamedRobot>) -> PyResult<PyToolpath> {
    let robot = named(&robot)?;
    let file = read_surface(&surface)?;
    run(py, None, None, || {
        let path = toolpath(&file, &robot.model, &robot.sheet.name)
            .map_err(|error| Refusal::new(Kind::Program, error).of_file(&files::name(&surface)))?;
        Ok(PyToolpath { path, robot, surface })
    })
}

/// The text of a cell file (TOML) with every tool and frame that a program uses. Values that the program does not state are ``"?"`` and have to be
/// filled in before ``compensate(..., cell=...)``. ``program``: as for ``compensate``. ``robot``: the robot that runs it, noted in the file.
#[pyfunction]
#[pyo3(signature = (program, *, robot = None))]
pub(crate) fn cell_file(
    program: Object<'_, ProgramFiles>,
    robot: Option<Object<'_, NamedRobot>>,
) -> PyResult<String> {
    let robot = robot.as_deref().map(named).transpose()?;
    let sources = sources(&program)?;
    let task = sources.task(&cell_setup(&Cell::default()));
    let name = sources.name();
    if task.listing().motions.is_empty() {
        let message = format!("{name}: contains no motion, so it uses no tool and no work object");
        return Err(Refusal::new(Kind::Program, message).of_file(&name).into());
    }
    let asking = TemplateProgram { name: &name, language: task.language(), listing: task.listing() };
    Ok(cell_template(&[asking], robot.as_ref().map(|robot| robot.sheet.name.as_str())).text)
}
