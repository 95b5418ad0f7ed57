//! SIMD kernel of a calibration: residuals and Jacobian of as many rows at a time as a register holds.

mod axes;
mod cable;
mod row_geometry;
mod spatial;
mod state;

pub(super) use axes::Axes;
pub(super) use state::State;

use super::problem::CalibrationProblem;
use crate::measurement::dataset::Sensor;
use cable::cable_rows;
use spatial::spatial_rows;
use truegrind_math::lanes::{AnyWidth, SinCos, WIDTH, vectorised};

/// See [`CalibrationProblem::fill`].
pub(super) fn fill(
    problem: &CalibrationProblem,
    state: &State,
    from: usize,
    lanes: usize,
    jacobian: Option<Axes>,
    out: &mut [f64],
) {
    // Compiled for arms whose links move and for others: what only one of them needs costs the other registers.
    if problem.columns.moved.is_some() {
        vectorised(Fill::<true> { problem, state, from, lanes, jacobian, out });
    } else {
        vectorised(Fill::<false> { problem, state, from, lanes, jacobian, out });
    }
}

/// See [`CalibrationProblem::fill`].
struct Fill<'a, const MOVES: bool> {
    problem: &'a CalibrationProblem,
    state: &'a State,
    from: usize,
    lanes: usize,
    jacobian: Option<Axes>,
    out: &'a mut [f64],
}

impl<const MOVES: bool> AnyWidth for Fill<'_, MOVES> {
    type Output = ();

    #[cfg_attr(not(debug_assertions), inline(always))]
    fn run<R: SinCos>(self, like: R) {
        let Self { problem, state, from, lanes, jacobian, out } = self;
        let rows = lanes * WIDTH;
        match problem.sensor {
            Sensor::Cable => {
                for row_index in (0..rows).step_by(R::ROWS) {
                    cable_rows::<R, MOVES>(
                        like,
                        problem,
                        state,
                        from * WIDTH + row_index,
                        jacobian.is_some(),
                        rows,
                        row_index,
                        out,
                    );
                }
            }
            Sensor::Position | Sensor::Pose => {
                let oriented = problem.sensor == Sensor::Pose;
                for row_index in (0..rows).step_by(R::ROWS) {
                    spatial_rows::<R, MOVES>(
                        like,
                        problem,
                        state,
                        from * WIDTH + row_index,
                        jacobian,
                        rows,
                        row_index,
                        oriented,
                        out,
                    );
                }
            }
        }
    }
}
