//! The cell file of a surface whose tool and work object are taught in the cell.

use nalgebra::{UnitQuaternion, Vector3};

use crate::toolpath::Toolpath;
use truegrind_arm::condition::Condition;
use truegrind_arm::inverse::{Inverse, InverseError};
use truegrind_arm::model::Model;
use truegrind_compensation::cell::{Cell, CellFrame, FrameOrigin};
use truegrind_math::se3::Pose;
use truegrind_surfaces::SurfaceFile;

/// The cell as commonly set up with the uncalibrated arm: the tool taught by reorienting it about one point, the work object
/// by three points. `names` are those of tool and work object in the program.
///
/// # Errors
/// [`InverseError`] if the arm does not reach the points.
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
    let reached = |tip: Pose| {
        let flange = object * tip * surface.tool.flange_from_tool.inverse();
        let joints = inverse.solve_near(&flange, &near)?.joints;
        Ok(std::array::from_fn(|i| joints[i].to_degrees()))
    };
    let teaching_deg = taught
        .iter()
        .map(|point| reached(Pose::from_parts((*point).into(), orientation)))
        .collect::<Result<Vec<[f64; 6]>, InverseError>>()?;
    // Rotations about the tip, which is fixed at one point above the middle of the part (rad).
    let turns = [[0.0, 0.0, 0.0], [0.4, 0.0, 0.3], [-0.4, 0.0, 0.0], [0.0, 0.4, -0.3], [0.0, -0.4, 0.0]];
    let about_tip = turns
        .iter()
        .map(|turn| {
            let turn = UnitQuaternion::from_scaled_axis(Vector3::from(*turn));
            reached(Pose::from_parts(Vector3::new(0.0, 0.0, 40.0).into(), orientation * turn))
        })
        .collect::<Result<Vec<[f64; 6]>, InverseError>>()?;
    Ok(Cell {
        tool: vec![CellFrame { teaching_deg: about_tip, ..CellFrame::of(tool, FrameOrigin::Taught) }],
        wobj: vec![CellFrame {
            teaching_deg,
            taught_with: Some(tool.to_owned()),
            ..CellFrame::of(work_object, FrameOrigin::Taught)
        }],
        ..Cell::default()
    })
}
