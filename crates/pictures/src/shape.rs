//! The arm of the data sheet as a ghost, and the real one beside it with its differences times a factor.
//!
//! **Method.** Both stand at the same joints, link after link: the pose of frame i in frame i − 1 differs between the two by a
//! small motion, of which shift and turn are multiplied and put behind the link of the data sheet. So the drawn arm is bent and
//! grown where the real one is, effects of joints included, and its tool is off by about the factor times the real deviation.

use truegrind_math::se3::Pose;

use super::arm::{self, Figure, Paint, Posed, Stand};
use super::colour::{BEFORE, GHOST, round_down};
use super::recording::{Store, VisualError};
use nalgebra::{UnitQuaternion, Vector3};

/// The drawn difference shall be at most this part of the length of the arm.
const REACH: f64 = 0.10;

/// Smaller differences are those of rounding, and not drawn (mm).
const NOTHING_MM: f64 = 1e-6;

/// Both arms at all stands.
pub(super) struct Shape {
    stands: Vec<Stand>,
    nominal: Vec<[Pose; 7]>,
    exaggerated: Vec<[Pose; 7]>,
    flange: Pose,
    /// The factor.
    pub(super) times: f64,
}

impl Shape {
    /// `None` where the two do not differ, or nothing stands.
    pub(super) fn of(nominal: Figure<'_>, real: Figure<'_>, stands: &[Stand]) -> Option<Self> {
        let [told, is] = [nominal, real].map(|f| f.model.at_condition(f.condition));
        let frames =
            |arm: &_| -> Vec<[Pose; 7]> { stands.iter().map(|s| arm::frames(arm, &s.joints)).collect() };
        let (nominal_frames, real_frames) = (frames(&told), frames(&is));
        // Of every frame and of the tool: links may be far off where the tool is not.
        let apart = nominal_frames.iter().zip(&real_frames).zip(stands).flat_map(|((a, b), stand)| {
            let tool = |last: &Pose, flange: &Pose| last * flange * stand.flange_from_tool;
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
        let flange = beyond(&nominal.model.flange, &real.model.flange, times);
        Some(Self { stands: stands.to_vec(), nominal: nominal_frames, exaggerated, flange, times })
    }

    /// Draws both, `arm/nominal` and `arm/exaggerated`.
    pub(super) fn draw(
        &self,
        store: &mut Store,
        nominal: Figure<'_>,
        axis: &'static str,
    ) -> Result<(), VisualError> {
        let [ghost, real] = [Paint::ghost(GHOST), Paint::of(BEFORE)];
        let told = Posed { frames: &self.nominal, flange: nominal.model.flange };
        let is = Posed { frames: &self.exaggerated, flange: self.flange };
        arm::draw_posed(store, "arm/nominal", nominal, &told, &ghost, (axis, &self.stands))?;
        arm::draw_posed(store, "arm/exaggerated", nominal, &is, &real, (axis, &self.stands))
    }

    /// The factor, as labels print it.
    pub(super) fn factor(&self) -> String {
        format!("×{}", self.times)
    }
}

/// The frames of an arm whose links differ from those of `nominal` by `times` what those of `real` do.
fn bent(nominal: &[Pose; 7], real: &[Pose; 7], times: f64) -> [Pose; 7] {
    let mut out = *nominal;
    for i in 1..7 {
        let [told, is] = [nominal, real].map(|frames| frames[i - 1].inverse() * frames[i]);
        out[i] = out[i - 1] * beyond(&told, &is, times);
    }
    out
}

/// From `told` towards `is` and on, `times` as far.
fn beyond(told: &Pose, is: &Pose, times: f64) -> Pose {
    let off = told.inverse() * is;
    let shift: Vector3<f64> = off.translation.vector * times;
    let turn = UnitQuaternion::from_scaled_axis(off.rotation.scaled_axis() * times);
    told * Pose::from_parts(shift.into(), turn)
}
