//! The cell file of a surface whose work object was taught in place.

use nalgebra::Vector3;

use crate::toolpath::Toolpath;
use truegrind_arm::condition::Condition;
use truegrind_arm::inverse::{Inverse, InverseError};
use truegrind_arm::model::Model;
use truegrind_compensation::cell::{Cell, CellFrame, FrameOrigin};
use truegrind_math::se3::Pose;
use truegrind_surfaces::SurfaceFile;

/// The cell as it is set up in most shops: the tool measured, the work object taught with the uncalibrated arm by three
/// points. `names` are those of tool and work object in the program.
///
/// # Errors
/// [`InverseError`] where the arm does not reach the three points.
pub fn taught_cell(
    surface: &SurfaceFile,
    path: &Toolpath,
    nominal: &Model,
    names: [&str; 2],
) -> Result<Cell, InverseError> {
    let [tool, work_object] = names;
    let inverse = Inverse::new(nominal, &Condition::default(), nominal);
    let object = surface.work_object.base_from_work_object;
    let middle = path.points.len() / 2;
    let (orientation, near) = (path.points[middle].orientation, path.joints[middle]);
    let taught = [Vector3::new(-40.0, 0.0, 0.0), Vector3::new(40.0, 0.0, 0.0), Vector3::new(0.0, 60.0, 0.0)];
    let teaching_deg = taught
        .iter()
        .map(|point| {
            let tip = Pose::from_parts((*point).into(), orientation);
            let flange = object * tip * surface.tool.flange_from_tool.inverse();
            let joints = inverse.solve_near(&flange, &near)?.joints;
            Ok(std::array::from_fn(|i| joints[i].to_degrees()))
        })
        .collect::<Result<Vec<[f64; 6]>, InverseError>>()?;
    Ok(Cell {
        tool: vec![CellFrame::of(tool, FrameOrigin::Metrology)],
        wobj: vec![CellFrame {
            teaching_deg,
            taught_with: Some(tool.to_owned()),
            ..CellFrame::of(work_object, FrameOrigin::Taught)
        }],
        ..Cell::default()
    })
}
