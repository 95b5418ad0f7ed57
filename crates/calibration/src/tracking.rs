//! Continuous calibration: recursive estimation of the arm's parameters from incoming measurements, with change detection.
//!
//! **Method.** The state vector holds the arm's parameters, with the model's covariance, and the sensor's frames, with a wide
//! prior. It is linearised at every pose and updated row by row in Potter's square-root form
//! ([`rls`](truegrind_estimation::filter::rls)), which stays positive definite. Each parameter performs a random walk between
//! poses (process noise), so the gain never vanishes.
//!
//! **Change detection.** The normalised innovation squared (NIS) of a pose is χ² with as many degrees of freedom as the pose
//! has rows, if the model holds. A pose beyond the 1 in 10⁹ quantile is rejected as an outlier; a sum over a sliding window
//! beyond the 1 in 10⁵ quantile raises the alarm. Consecutive outliers count in the window, each up to a quarter of its
//! bound, so that a jump of the arm is not mistaken for a series of outliers. An isolated outlier counts as its expectation,
//! since unmodelled effects have longer tails than χ². An alarm that no single parameter explains changes nothing in the
//! model.
//!
//! **Change localisation.** A few poses after the bound was exceeded, [`locate`] finds the change that explains the history
//! best: a jump or a drift of one parameter from some pose on, or a displacement of the whole sensor, target or outlet.
//! Parameters that explain it nearly as well are reported as alternatives: a knocked sensor and a lost joint zero can look the
//! same. Isolated outliers are ignored.
//!
//! **Set-ups.** Where the files state that the sensor was set up anew (column `station`), its frame is placed and fitted anew (`set_up`): no alarm.
//!
//! **Remounting and bursts.** Consecutive outliers are first tested for a remounted target or sensor (`mounting`): each pose
//! gives the location of target and sensor, and if these agree on one far from the old one, a single alarm is raised and
//! tracking continues there. Outliers without an explanation are a burst: one alarm until readings fit again.
//!
//! **After an alarm.** The filter restarts at the beginning of the history with a wider covariance for the changed parameters
//! (three times a jump; the process noise of a drift) and processes the history again, so that no reading is lost and the
//! model follows within a few poses ([`alarm`]).
//!
//! **Wrong arm.** First poses with residuals far above the model's held-out error are refused, and an arm that has changed before them
//! is not taken for noise (`first_noise`): a filter that did would never detect a change.
//!
//! **Noise.** The residual of the model is taken as noise. If the first poses scatter several times less, their own scatter is used (`tracking/noise`).
//!
//! **Slow changes.** A drift may stay below every bound, since the filter follows it. What counts for programs is the whole way from the
//! model that they were corrected with: the [`Departure`], which is judged at the end of every run. A [`Turn`] about axis 1 that the sensor saw is part of
//! it, and so is a move of the touched point that the [`LastLink`] may have made.
//!
//! **What no reading tells** of arm and sensor together stays as it was (`gauge`).
//!
//! **Interruption.** [`state`] stores the filter exactly: a track that was interrupted and resumed gives the same bits as one
//! that was not.
//!
//! **Shapes.** p parameters, k of which drift; a pose has 1, 3 or 6 rows. A pose costs one row evaluation with derivatives, k³
//! for the process noise and p² for each row. An alarm costs p³, and p² for each row of the history.
//!
//! **Source and departures.** rls-2025 uses RLS without forgetting, whose gain vanishes; process noise and alarm are added
//! here. Bar-Shalom, Li, Kirubarajan, *Estimation with Applications to Tracking and Navigation*,
//! 2001, ch. 5 for the NIS test.
//!
//! **Checked against** simulated arms whose parameters jump at a known pose, drift from one on, or stay constant, and
//! bit-exact resumption, also of a killed process.

pub mod alarm;
mod bounds;
mod departure;
mod error;
mod first_noise;
pub mod gain;
mod gauge;
mod last_link;
pub mod locate;
mod model;
mod mounting;
mod noise;
mod options;
mod response;
mod scale;
mod set_up;
pub mod state;
mod station;
mod tracker;
mod turn;

pub use alarm::{Alarm, Course};
pub use departure::{Departure, MovedParameter};
pub use error::{StateError, TrackError};
pub use last_link::LastLink;
pub use noise::Overstated;
pub use options::Options;
pub use scale::SCALE_NAME;
pub use state::State;
pub use tracker::{PoseUpdate, Tracker, first_poses};
pub use turn::Turn;
