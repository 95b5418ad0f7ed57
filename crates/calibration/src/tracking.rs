//! Continuous calibration: a model that is kept accurate as measurements come in, and says when and why it had to change.
//!
//! **Method.** The state is the arm's parameters with the model's own covariance, and the sensor's frames with a wide
//! prior, linearised anew at every pose and updated row by row by Potter's square-root form
//! ([`rls`](truegrind_estimation::filter::rls)), which cannot lose positive definiteness. Every parameter drifts by a
//! random walk of its own between two poses (process noise), so that the filter never stops listening.
//!
//! **Alarm.** The normalised innovations squared (NIS) of a pose are χ² with as many degrees of freedom as the pose has
//! rows, where arm, sensor and noise are what the filter believes. A single pose beyond the 1 in 10⁹ bound is set aside
//! as an accident; the sum over a sliding window beyond the 1 in 10⁵ bound raises the alarm. Poses set aside one after
//! the other count in the window, each up to a quarter of its bound, so that a jump of the arm cannot hide as a series of
//! accidents; a lone one counts as expected, since what a model does not hold has longer tails than χ². An alarm that
//! no single parameter explains says so and changes nothing.
//!
//! **Which parameter, since when.** A few poses after the bound was left: a jump or a drift of one parameter from one pose of
//! the history on, or the sensor, its target or an outlet moved as a whole, whichever explains the history best
//! ([`locate`]). Parameters that explain it nearly as well are named as alternatives: a sensor that was
//! knocked and a joint that lost its zero can look the same. Lone accidents have no say.
//!
//! **Mounted anew, and bursts.** Before that, poses that were set aside one after the other are asked where each of them puts
//! target and sensor (`mounting`): where they agree on a place far from the old one, it was taken off and put on again, which
//! is one alarm, and the track goes on from there. Where nothing explains them they are a burst of outliers: one alarm for all
//! of them, until poses fit again.
//!
//! **After an alarm.** The filter goes back to where the history began, what moved gets room (three times a jump; the
//! process noise of a drift), and the history is taken in again: nothing is lost, and the model follows within a few
//! poses ([`alarm`]).
//!
//! **Another arm.** First poses that leave far more than the model had on held-out rows are refused: a filter that takes all
//! of it for noise would never notice anything.
//!
//! **A stop.** [`state`] holds every bit that matters, so that a track that was stopped anywhere and goes on ends in the same
//! bits as one that was not.
//!
//! **Shapes.** p parameters, k of which drift; a pose has 1, 3 or 6 rows. A pose costs one row evaluation with derivatives, k³
//! for the process noise and p² for each row. An alarm costs p³, and p² for each row of the history.
//!
//! **Source and departures.** rls-2025 keeps its arm accurate by RLS without forgetting, which stops listening; process
//! noise and alarm are ours. Bar-Shalom, Li, Kirubarajan, *Estimation with Applications to Tracking and Navigation*,
//! 2001, ch. 5 for the NIS test.
//!
//! **Checked against** a simulated arm whose parameters jump at a known pose or drift from one on, one that stays, and
//! resumption to the bit, also of a process that was killed.

pub mod alarm;
mod mounting;
mod bounds;
mod error;
pub mod locate;
mod model;
mod options;
mod response;
pub mod state;
mod tracker;

pub use alarm::{Alarm, Course};
pub use error::{StateError, TrackError};
pub use options::Options;
pub use state::State;
pub use tracker::{PoseUpdate, Tracker, first_poses};
