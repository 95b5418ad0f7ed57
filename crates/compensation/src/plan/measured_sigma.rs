//! How uncertain a tool is where the arm was measured: what the uncertainty of a target is compared with.
//!
//! σ grows with the lever of the tool, so that a target with a long tool and the flange at a measured pose are no comparison: a good model
//! with a long tool was always uncertain, and a bad one never.

use nalgebra::Vector6;

use crate::arms::Arms;
use crate::frames::frame_table::FrameTable;
use crate::target::solved_target::SolvedTargets;
use truegrind_arm::estimated::FlangePoint;
use truegrind_arm::model::Joints;
use truegrind_math::se3::Pose;

/// For each frame pair the largest predicted standard deviation of its tool over the measured poses (mm).
pub(crate) fn of(frame_table: &FrameTable, solved: &SolvedTargets<'_>, arms: &Arms<'_>) -> Vec<f64> {
    let mut levers: Vec<Option<Pose>> = vec![None; frame_table.list.len()];
    for target in solved.targets.iter().flatten() {
        // Where the tool is stationary, its lever on the flange is that of the first target.
        levers[target.frames_index].get_or_insert_with(|| {
            let flange = arms.estimated.arm().forward(&target.after);
            frame_table.list[target.frames_index].real.flange_from_tool(&flange)
        });
    }
    levers.into_iter().map(|lever| lever.map_or(f64::INFINITY, |lever| largest_mm(&lever, arms))).collect()
}

fn largest_mm(flange_from_tool: &Pose, arms: &Arms<'_>) -> f64 {
    let Some(knowledge) = arms.knowledge else { return f64::INFINITY };
    let measured = knowledge.region.samples_deg.iter().map(|degrees| {
        let joints: Joints = Vector6::from_fn(|joint, _| degrees[joint].to_radians());
        FlangePoint { joints, flange_from_tool: *flange_from_tool, carried: None }
    });
    let measured: Vec<FlangePoint<'_>> = measured.collect();
    let sigmas = knowledge.position_sigmas_mm(arms.estimated.arm(), &measured);
    sigmas.into_iter().reduce(f64::max).unwrap_or(knowledge.region.sigma_mm)
}
