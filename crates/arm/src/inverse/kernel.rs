//! Newton's method for one target or several in lanes: no branch, no allocation.
//!
//! Method: the missing twist is taken at the wrist point, which joints 4 to 6 hardly move. The Jacobian is then [A B; C D] with
//! A (3 × 3, translation by joints 1 to 3) far from singular wherever shoulder and elbow are, and A⁻¹ and the inverse of the
//! Schur complement S = D − C A⁻¹ B follow from cross products without pivoting. The Jacobian σ of the effects enters as
//! Δu = (I − σ) Δθ, exact to σ²; that of what yields (some 1e-3) is neglected and costs at most one step more.
//! Shapes: `R` is one row or several; unknowns are the mapped joint angles u (rad).
//! Termination: a row is frozen once it is within [`TOLERANCE_MM`] and [`TOLERANCE_RAD`], so it gets the same bits whatever its
//! neighbours do; a row with a step longer than [`MAX_STEP_RAD`] or more than [`MAX_STEPS`] steps is left to [`super::newton`].
//! For [`Outputs::Joints`], a step shorter than [`FINAL_STEP_RAD`] is the last: by quadratic convergence its remainder lies below
//! the tolerances. That requires an exact Jacobian of the effects, so it applies only without effects.
//! Checked against: [`super::newton`], the forward map.

use super::newton::{TOLERANCE_MM, TOLERANCE_RAD};
use super::solution::Solution;
use super::structure::Structure;
use crate::chain::{Chain, FrameColumns, cross, dot, minus};
use crate::joints::Joints;
use crate::model::PreparedModel;
use truegrind_math::lanes::{SinCos, splats};

/// Most steps of a row.
const MAX_STEPS: usize = 8;
/// Longest step of a joint (rad).
const MAX_STEP_RAD: f64 = 0.5;

/// A step of every joint below this leaves half its square, 1.3e-13 rad, and over 3 m of arm 4e-10 mm (rad).
const FINAL_STEP_RAD: f64 = 5e-7;

/// What the kernel computes.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Outputs {
    /// Joints, residuals and the distance to singularity at the end.
    Full,
    /// Joints alone: `singularity` above 0 states that the Jacobian at the end is invertible, and residuals are those before the
    /// last step.
    Joints,
}

/// Geometry of an arm for the kernel.
#[derive(Debug, Clone)]
pub(super) struct Kernel {
    /// The wrist point in the last frame (mm).
    pub(super) wrist_mm: [f64; 3],
    /// The flange in the last frame (mm).
    pub(super) flange_mm: [f64; 3],
    /// Characteristic length (mm).
    pub(super) length_mm: f64,
}

/// Result of a row.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct Solved<R> {
    /// Mapped joint angles (rad).
    pub(super) mapped: [R; 6],
    pub(super) residual_mm: R,
    pub(super) residual_rad: R,
    pub(super) steps: R,
    pub(super) converged: R,
    pub(super) singularity: R,
    /// [`Structure::margins`] at the start and at the end.
    pub(super) margins: [[R; 3]; 2],
}

impl Solved<f64> {
    #[inline(always)]
    pub(super) fn solution(&self, joints: &Joints) -> Solution {
        Solution {
            joints: *joints,
            residual_mm: self.residual_mm,
            residual_rad: self.residual_rad,
            iterations: self.steps as usize,
            singularity: self.singularity,
        }
    }
}

#[inline(always)]
fn at<R: SinCos>(origin: &[R; 3], axes: &[[R; 3]; 3], point: &[f64; 3]) -> [R; 3] {
    let mut out = *origin;
    let point = splats(origin[0], point);
    for k in 0..3 {
        out[k] += point[0] * axes[0][k] + point[1] * axes[1][k] + point[2] * axes[2][k];
    }
    out
}

/// Rows of the inverse of a 3 × 3 matrix given by its columns.
#[cfg_attr(not(debug_assertions), inline(always))]
fn inverse_rows<R: SinCos>(columns: &[[R; 3]; 3]) -> [[R; 3]; 3] {
    let [a, b, c] = columns;
    let mut rows = [cross(b, c), cross(c, a), cross(a, b)];
    let scale = a[0].splat(1.0) / dot(a, &rows[0]);
    for row in &mut rows {
        for entry in row {
            *entry = *entry * scale;
        }
    }
    rows
}

#[inline(always)]
fn times<R: SinCos>(rows: &[[R; 3]; 3], v: &[R; 3]) -> [R; 3] {
    [dot(&rows[0], v), dot(&rows[1], v), dot(&rows[2], v)]
}

#[inline(always)]
fn combine<R: SinCos>(columns: &[[R; 3]; 3], v: &[R; 3]) -> [R; 3] {
    let mut out = *v;
    for k in 0..3 {
        out[k] = columns[0][k] * v[0] + columns[1][k] * v[1] + columns[2][k] * v[2];
    }
    out
}

/// The Jacobian with respect to the DH rotations at the wrist point, factored.
struct Factored<R> {
    /// Rows of A⁻¹.
    first: [[R; 3]; 3],
    /// Columns of A⁻¹ B.
    coupled: [[R; 3]; 3],
    /// Columns of C.
    turns: [[R; 3]; 3],
    /// Rows of S⁻¹.
    last: [[R; 3]; 3],
}

impl<R: SinCos> Factored<R> {
    #[cfg_attr(not(debug_assertions), inline(always))]
    fn of(frames: &Chain<R>, wrist: &[R; 3]) -> Self {
        let zero = wrist[0].splat(0.0);
        let mut shifts = [[zero; 3]; 6];
        for (j, shift) in shifts.iter_mut().enumerate() {
            *shift = cross(&frames.z[j], &minus(wrist, &frames.origin[j]));
        }
        let first = inverse_rows(&[shifts[0], shifts[1], shifts[2]]);
        let turns = [frames.z[0], frames.z[1], frames.z[2]];
        let (mut coupled, mut schur) = ([[zero; 3]; 3], [[zero; 3]; 3]);
        for j in 0..3 {
            coupled[j] = times(&first, &shifts[3 + j]);
            schur[j] = minus(&frames.z[3 + j], &combine(&turns, &coupled[j]));
        }
        Self { first, coupled, turns, last: inverse_rows(&schur) }
    }

    /// Joint rotations for a twist.
    #[cfg_attr(not(debug_assertions), inline(always))]
    fn solve(&self, shift: &[R; 3], turn: &[R; 3]) -> [R; 6] {
        let alone = times(&self.first, shift);
        let wrist = times(&self.last, &minus(turn, &combine(&self.turns, &alone)));
        let arm = minus(&alone, &combine(&self.coupled, &wrist));
        [arm[0], arm[1], arm[2], wrist[0], wrist[1], wrist[2]]
    }

    /// Above 0 where both factors have an inverse.
    #[cfg_attr(not(debug_assertions), inline(always))]
    fn regular(&self, length: f64) -> R {
        let mut square = self.first[0][0].splat(0.0);
        for k in 0..3 {
            let first = dot(&self.first[k], &self.first[k]) * square.splat(length * length);
            square += first + dot(&self.last[k], &self.last[k]);
        }
        square.splat(1.0) / square.sqrt()
    }

    /// 1/‖J⁻¹‖ (Frobenius) at a point from which `lever` leads to the wrist point, translations divided by `length`.
    #[cfg_attr(not(debug_assertions), inline(always))]
    fn distance(&self, lever: &[R; 3], length: f64) -> R {
        let (zero, one) = (lever[0].splat(0.0), lever[0].splat(1.0));
        let mut square = zero;
        for k in 0..3 {
            let mut unit = [zero; 3];
            unit[k] = one;
            // A unit of scaled translation, and a rotation about the point, which moves the wrist point too.
            let shift = self.solve(&unit, &[zero; 3]);
            let turn = self.solve(&cross(&unit, lever), &unit);
            for j in 0..6 {
                let scaled = shift[j] * zero.splat(length);
                square += scaled * scaled + turn[j] * turn[j];
            }
        }
        one / square.sqrt()
    }
}

/// Rows whose last step was too short for another one.
struct Finished<R> {
    /// 1 for such a row.
    rows: R,
    /// Their margins before that step.
    margins: [R; 3],
}

impl<R: SinCos> Finished<R> {
    #[cfg_attr(not(debug_assertions), inline(always))]
    fn add(&mut self, rows: R, margins: &[R; 3]) {
        for k in 0..3 {
            self.margins[k] += rows * margins[k];
        }
        self.rows += rows;
    }

    /// 1 for each other row, and the margins of all rows, those of the others being `margins`.
    #[cfg_attr(not(debug_assertions), inline(always))]
    fn with_others(&self, margins: &[R; 3]) -> (R, [R; 3]) {
        let open = self.rows.splat(1.0) - self.rows;
        let mut all = *margins;
        for k in 0..3 {
            all[k] = open * all[k] + self.margins[k];
        }
        (open, all)
    }
}

/// The axis of the missing rotation, times the sine of its angle; and 1 where the angle is less than a quarter turn, since beyond it the sine
/// is ambiguous.
#[cfg_attr(not(debug_assertions), inline(always))]
fn missing_turn<R: SinCos>(axes: &[[R; 3]; 3], goal: &[[R; 3]; 3]) -> ([R; 3], R) {
    let (zero, one) = (axes[0][0].splat(0.0), axes[0][0].splat(1.0));
    let (mut turn, mut trace) = ([zero; 3], zero);
    for (here, there) in axes.iter().zip(goal) {
        let c = cross(here, there);
        for (t, c) in turn.iter_mut().zip(c) {
            *t += zero.splat(0.5) * c;
        }
        trace += dot(here, there);
    }
    (turn, (trace - one).positive())
}

impl Kernel {
    /// Solves for the mapped angles at which the last frame is at `goal`, from `start`, of an arm whose effects move links or of one whose do
    /// not.
    #[cfg_attr(not(debug_assertions), inline(always))]
    pub(super) fn solve<R: SinCos, const MOVES: bool>(
        &self,
        arm: &PreparedModel<'_>,
        structure: &Structure,
        goal: &FrameColumns<R>,
        start: &[R; 6],
        outputs: Outputs,
    ) -> Solved<R> {
        let (zero, one) = (start[0].splat(0.0), start[0].splat(1.0));
        let goal_wrist = at(&goal.origin, &goal.axes, &self.wrist_mm);
        let goal_flange = at(&goal.origin, &goal.axes, &self.flange_mm);
        let mut mapped = *start;
        let (mut alive, mut steps) = (one, zero);
        let mut finished = Finished { rows: zero, margins: [zero; 3] };
        let brief = outputs == Outputs::Joints && arm.model.effects.is_empty();
        let mut first_margins = [zero; 3];
        let mut step = 0;
        loop {
            let frames = arm.frames_at::<R, MOVES>(&mapped);
            let axes = [frames.x, frames.y[5], frames.z[6]];
            let wrist = at(&frames.origin[6], &axes, &self.wrist_mm);
            let flange = at(&frames.origin[6], &axes, &self.flange_mm);
            let missing = minus(&goal_flange, &flange);
            let (turn, sensible) = missing_turn(&axes, &goal.axes);
            let residual_mm = dot(&missing, &missing).sqrt();
            let residual_rad = dot(&turn, &turn).sqrt();
            let converged = residual_mm.within(TOLERANCE_MM) * residual_rad.within(TOLERANCE_RAD) * sensible;
            if step == 0 {
                first_margins = structure.margins(&frames, &wrist);
            }
            alive = alive * sensible * (one - converged);
            let factored = Factored::of(&frames, &wrist);
            let mut ends = step == MAX_STEPS || !alive.any_above(0.0);
            if !ends {
                let mut delta = factored.solve(&minus(&goal_wrist, &wrist), &turn);
                let mut carried = [zero; 6];
                for effect in &arm.model.effects {
                    effect.add_jacobian_product(&mapped, &delta, &mut carried);
                }
                for j in 0..6 {
                    delta[j] -= carried[j];
                    alive = alive * delta[j].within(MAX_STEP_RAD);
                }
                // Frozen rows must not take up a NaN: 0 · NaN is NaN, so a lost row stays lost, and only it.
                for j in 0..6 {
                    mapped[j] += alive * delta[j];
                }
                steps += alive;
                step += 1;
                if brief {
                    let mut last = alive;
                    for turn in delta {
                        last = last * turn.within(FINAL_STEP_RAD);
                    }
                    alive += -last;
                    ends = !alive.any_above(0.0);
                    if last.any_above(0.0) {
                        finished.add(last, &structure.margins(&frames, &wrist));
                    }
                }
            }
            if ends {
                let (open, margins) = finished.with_others(&structure.margins(&frames, &wrist));
                return Solved {
                    mapped,
                    residual_mm,
                    residual_rad,
                    steps,
                    converged: open * converged + finished.rows,
                    singularity: match outputs {
                        Outputs::Full => factored.distance(&minus(&wrist, &flange), self.length_mm),
                        Outputs::Joints => factored.regular(self.length_mm),
                    },
                    margins: [first_margins, margins],
                };
            }
        }
    }
}
