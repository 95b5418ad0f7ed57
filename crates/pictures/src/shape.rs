//! The nominal arm, transparent, and the real arm with exaggerated differences.
//!
//! **Method.** Both arms are at the same joints. For each link, the small motion between the nominal and the real pose of frame i in
//! frame i − 1 is multiplied by a factor and appended to the nominal link. The drawn arm then shows errors of links and joint effects
//! where they occur, and its tool deviates by about the factor times the real deviation.

use truegrind_math::se3::Pose;

use super::arm::{self, ArmState, Figure, Paint, Posed};
use super::colour::{BEFORE, GHOST, round_down};
use super::recording::{Store, VisualError};
use nalgebra::{UnitQuaternion, Vector3};

/// Largest drawn difference, relative to the length of the arm.
const REACH: f64 = 0.10;

/// Smaller differences are rounding errors and not drawn (mm).
const NOTHING_MM: f64 = 1e-6;

/// Frames of both arms at all states.
pub(super) struct Shape {
    states: Vec<ArmState>,
    nominal: Vec<[Pose; 7]>,
    exaggerated: Vec<[Pose; 7]>,
    flange: Pose,
    /// The factor.
    pub(super) times: f64,
}

impl Shape {
    /// `None` if the arms do not differ, or without states.
    pub(super) fn of(nominal: Figure<'_>, real: Figure<'_>, states: &[ArmState]) -> Option<Self> {
        let [nominal_arm, real_arm] = [nominal, real].map(|f| f.model.at_condition(f.condition));
        let frames =
            |arm: &_| -> Vec<[Pose; 7]> { states.iter().map(|s| arm::frames(arm, &s.joints)).collect() };
        let (nominal_frames, real_frames) = (frames(&nominal_arm), frames(&real_arm));
        // Over all frames and the tool, since links may differ where the tool does not.
        let apart = nominal_frames.iter().zip(&real_frames).zip(states).flat_map(|((a, b), state)| {
            let tool = |last: &Pose, flange: &Pose| last * flange * state.flange_from_tool;
            let ends = [(tool(&a[6], &nominal.model.flange), tool(&b[6], &real.model.flange))];
            a.iter().copied().zip(b.iter().copied()).chain(ends).collect::<Vec<_>>()
        });
        let largest = apart
            .map(|(a, b)| (a.translation.vector - b.translation.vector).norm())
            .filter(|d| d.is_finite())
            .fold(0.0, f64::max);
        if !(largest > NOTHING_MM) {
            return None;
        }
        let times = round_down(REACH * arm::length_mm(nominal.model) / largest);
        let exaggerated = nominal_frames.iter().zip(&real_frames).map(|(a, b)| bent(a, b, times)).collect();
        let flange = extrapolate(&nominal.model.flange, &real.model.flange, times);
        Some(Self { states: states.to_vec(), nominal: nominal_frames, exaggerated, flange, times })
    }

    /// Draws both, `arm/nominal` and `arm/exaggerated`.
    pub(super) fn draw(
        &self,
        store: &mut Store,
        nominal: Figure<'_>,
        axis: &'static str,
    ) -> Result<(), VisualError> {
        let [ghost, real] = [Paint::ghost(GHOST), Paint::of(BEFORE)];
        let posed = Posed { frames: &self.nominal, flange: nominal.model.flange };
        let is = Posed { frames: &self.exaggerated, flange: self.flange };
        arm::draw_posed(store, "arm/nominal", nominal, &posed, &ghost, (axis, &self.states))?;
        arm::draw_posed(store, "arm/exaggerated", nominal, &is, &real, (axis, &self.states))
    }

    /// The factor as printed in labels.
    pub(super) fn factor(&self) -> String {
        format!("×{}", self.times)
    }
}

/// Frames of an arm whose links differ from `nominal` by `times` the difference of `real`.
fn bent(nominal: &[Pose; 7], real: &[Pose; 7], times: f64) -> [Pose; 7] {
    let mut out = *nominal;
    for i in 1..7 {
        let [from, through] = [nominal, real].map(|frames| frames[i - 1].inverse() * frames[i]);
        out[i] = out[i - 1] * extrapolate(&from, &through, times);
    }
    out
}

/// Extrapolates from `from` through `through` by the factor `times`.
fn extrapolate(from: &Pose, through: &Pose, times: f64) -> Pose {
    let off = from.inverse() * through;
    let shift: Vector3<f64> = off.translation.vector * times;
    let turn = UnitQuaternion::from_scaled_axis(off.rotation.scaled_axis() * times);
    from * Pose::from_parts(shift.into(), turn)
}
