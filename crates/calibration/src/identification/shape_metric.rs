//! What a change of an arm's parameters makes of the shape of its motion over a region: the metric in which corrections are judged.

use nalgebra::{DMatrix, DVector};

use crate::identification::fit::Fitted;
use crate::identification::scaled_cholesky::gram;
use truegrind_arm::condition::Condition;
use truegrind_arm::jacobian::{BaseAndTool, parameter_jacobian};
use truegrind_arm::model::Joints;
use truegrind_arm::parameter::Parameter;
use truegrind_arm::region::Region;
use truegrind_math::se3::{Pose, vector_from_pose};

/// M at `condition` over a region. δᵀ M δ is the mean square displacement (mm²) of the
/// target by a change δ of the fit's parameters, rigid motions of base and target projected out. Rows and columns of
/// measurement parameters are zero.
pub(crate) fn shape_metric(fitted: &Fitted, condition: &Condition, region: &Region) -> Option<DMatrix<f64>> {
    let indices: Vec<usize> =
        fitted.parameters.iter().enumerate().filter(|(_, p)| p.is_of_arm()).map(|(k, _)| k).collect();
    let mut list: Vec<Parameter> = indices.iter().map(|&k| fitted.parameters[k]).collect();
    let own = list.len();
    if own == 0 {
        return None;
    }
    list.extend((0..6).map(Parameter::SensorFrame).chain((0..3).map(Parameter::Target)));
    let posed = fitted.model.at_condition(condition);
    let target =
        Pose::from_parts(fitted.frames.flange_from_target.translation, nalgebra::UnitQuaternion::identity());
    let ends = BaseAndTool { world_from_base: [0.0; 6], flange_from_tool: vector_from_pose(&target) };
    let poses = judged_poses(region);
    let mut stack = DMatrix::zeros(3 * poses.len(), list.len());
    for (k, q) in poses.iter().enumerate() {
        let twists = parameter_jacobian(&ends, &posed, q, &list);
        stack.rows_mut(3 * k, 3).copy_from(&twists.rows(0, 3));
    }
    let (arm, rigid) = (stack.columns(0, own).into_owned(), stack.columns(own, 9).into_owned());
    // Rotations move by hundreds of millimetres per radian: columns of equal length, then an orthonormal basis.
    let svd =
        DMatrix::from_columns(&rigid.column_iter().map(|c| c / c.norm().max(1e-12)).collect::<Vec<_>>())
            .svd(true, false);
    let basis = svd.u?;
    let rigid: Vec<DVector<f64>> = basis
        .column_iter()
        .zip(svd.singular_values.iter())
        .filter(|(_, value)| **value > 1e-6)
        .map(|(column, _)| column.into_owned())
        .collect();
    let shape = if rigid.is_empty() {
        arm
    } else {
        let basis = DMatrix::from_columns(&rigid);
        &arm - &basis * basis.tr_mul(&arm)
    };
    let mut out = DMatrix::zeros(fitted.parameters.len(), fitted.parameters.len());
    let square = gram(&shape) / poses.len().max(1) as f64;
    for (i, &a) in indices.iter().enumerate() {
        for (j, &b) in indices.iter().enumerate() {
            out[(a, b)] = square[(i, j)];
        }
    }
    out.iter().all(|v| v.is_finite()).then_some(out)
}

/// Poses at which a change is judged: placed on few, base and target would take up part of the shape.
const JUDGED: usize = 200;

/// Poses inside the region, none of them measured: at its own poses a fit of few rows is nearer to the arm than at any others. Each joint is
/// that of another sample, so that it is distributed as in the measurement. Where such poses leave the region, as along a path, it is the
/// samples and the midpoints of pairs of them.
fn judged_poses(region: &Region) -> Vec<Joints> {
    let samples = &region.samples_deg;
    let n = samples.len();
    let sample = |k: usize| samples[k % n].map(f64::to_radians);
    let rounds = JUDGED.div_ceil(n.max(1)).min(n.saturating_sub(1)).max(1);
    let steps = (0..rounds).map(|round| 1 + round * n.saturating_sub(1) / rounds);
    let recombined =
        steps.flat_map(|step| (0..n).map(move |k| Joints::from_fn(|i, _| sample(k + i * step)[i])));
    let mut out: Vec<Joints> = recombined.filter(|q| region.outside(q).is_none()).collect();
    if out.len() < n {
        out = (0..n).map(|k| Joints::from(sample(k))).collect();
        out.extend((0..n).map(|k| 0.5 * (Joints::from(sample(k)) + Joints::from(sample(k + n / 3 + 1)))));
    }
    out
}
