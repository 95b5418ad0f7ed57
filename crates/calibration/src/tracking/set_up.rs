//! A sensor that is set up anew while the track goes on, as the files state it: a change that is stated is no alarm.
//!
//! The readings of each set-up are brought into the frame in which the track began, by the first rows of the set-up and the arm as it is
//! tracked then. That places them only roughly: the filter's frame of the sensor is released at the first of these rows, as wide as it began,
//! and fitted again by all of them. The search for a change gives each set-up in the history a frame of its own.

use nalgebra::{DMatrix, Vector3};

use super::error::TrackError;
use super::station::station_of;
use super::tracker::{Tracker, frame_priors};
use crate::measurement::dataset::{Dataset, Row};
use crate::measurement::registration::{FrameRegistration, known_target};
use truegrind_arm::parameter::Parameter;
use truegrind_estimation::filter::rls::RecursiveLeastSquares;
use truegrind_math::se3::{Pose, pose_from_vector, vector_from_pose};

/// Fewest rows of a set-up, and the rows that place it.
const FEWEST: usize = 4;

/// Rows that place it where the first ones do not agree: one of them is wrong, or the arm has changed as well.
const ENOUGH: usize = 8;

/// Rows agree on a place within this many standard deviations of a reading.
const AGREE: f64 = 6.0;

impl Tracker {
    /// Places the set-up whose rows are `from..end` of `dataset`; `is_over` if no more of its rows can come. `Ok(false)` where there are too few
    /// of them yet.
    pub(super) fn begin_station(
        &mut self,
        dataset: &Dataset,
        (from, end): (usize, usize),
        is_over: bool,
    ) -> Result<bool, TrackError> {
        let station = station_of(dataset, from);
        let (_, frames) = self.current();
        let first: Vec<usize> = (from..end).take(ENOUGH).collect();
        let first = dataset.subset(&first).at_unless_logged(&self.initial.condition);
        let Some(placed) = self.place(first.rows.iter().collect()) else {
            let station = station.unwrap_or_default();
            let (file, rows) = (dataset.file.clone(), end - from);
            return if is_over { Err(TrackError::Station { file, station, rows }) } else { Ok(false) };
        };
        self.state.station = station;
        let track_from_station = frames.base_from_sensor.inverse() * placed.base_from_sensor;
        // Through the state's own numbers, so that a resumed track gives the same bits.
        self.state.track_from_station = Some(vector_from_pose(&track_from_station));
        Ok(true)
    }

    /// Where the arm as tracked puts a sensor that read these rows; `None` of too few.
    fn place(&self, rows: Vec<&Row>) -> Option<FrameRegistration> {
        let (model, frames) = self.current();
        let target = frames.flange_from_target.translation.vector;
        let by = |rows: &[&Row]| {
            let flanges: Vec<Pose> =
                rows.iter().map(|row| model.forward(&row.joints, &row.condition)).collect();
            let places: Vec<Vector3<f64>> = rows.iter().map(|row| row.reading.place_mm()).collect();
            known_target(&flanges, &places, &target)
        };
        let most_mm = AGREE * 3f64.sqrt() * self.state.sigma_mm;
        let agree = |found: &FrameRegistration| found.rmse_mm <= most_mm;
        let first = rows.get(..FEWEST).and_then(by);
        if first.as_ref().is_some_and(agree) || rows.len() == FEWEST {
            return first;
        }
        // Without one that is wrong, else by all.
        let without = |left_out: usize| {
            let others: Vec<&Row> =
                rows.iter().enumerate().filter(|(k, _)| *k != left_out).map(|(_, row)| *row).collect();
            by(&others)
        };
        if rows.len() < FEWEST {
            return None;
        }
        (0..rows.len()).filter_map(without).find(agree).or_else(|| by(&rows))
    }

    /// How readings of the present set-up are brought into the frame in which the track began.
    pub(super) fn track_from_station(&self) -> Pose {
        self.state.track_from_station.as_ref().map_or_else(Pose::identity, pose_from_vector)
    }

    /// How many of the last rows of a file wait for more of their station.
    pub fn waiting(&self, dataset: &Dataset) -> usize {
        let consumed = self.state.consumed.iter().find(|consumed| consumed.file == dataset.file);
        dataset.rows.len().saturating_sub(consumed.map_or(0, |consumed| consumed.rows))
    }

    /// Forgets where the sensor stands: the next reading is the first of another set-up.
    pub(super) fn release_sensor(&mut self) {
        let Some(mut root) = self.filter.root() else { return };
        let mut widening = vec![0.0; self.parameters.len()];
        let priors = frame_priors(&self.initial, &self.parameters);
        for (k, parameter) in self.parameters.iter().enumerate() {
            if matches!(parameter, Parameter::SensorFrame(_)) {
                root.row_mut(k).fill(0.0);
                widening[k] = priors[k].sigma;
            }
        }
        self.filter = RecursiveLeastSquares::from_root(self.filter.x.clone(), root);
        self.filter.predict(&widening);
    }

    /// A frame of its own for each set-up that begins in the history: the columns of the sensor's frame in its rows alone, with their priors, after
    /// the columns `j` and the covariance of the parameters.
    pub(super) fn with_frames_of_stations(
        &self,
        j: Vec<f64>,
        covariance: DMatrix<f64>,
    ) -> (Vec<f64>, DMatrix<f64>) {
        let (history, per) = (&self.state.history, self.state.sensor.scalars());
        let begins: Vec<usize> = (0..history.len()).filter(|&at| history[at].begins_station).collect();
        let frame: Vec<usize> = (0..self.parameters.len())
            .filter(|&k| matches!(self.parameters[k], Parameter::SensorFrame(_)))
            .collect();
        let (p, rows) = (self.parameters.len(), per * history.len());
        let priors = frame_priors(&self.initial, &self.parameters);
        let mut all = j;
        let mut wide = DMatrix::zeros(p + frame.len() * begins.len(), p + frame.len() * begins.len());
        wide.view_mut((0, 0), (p, p)).copy_from(&covariance);
        for (station, &begin) in begins.iter().enumerate() {
            let end = begins.get(station + 1).copied().unwrap_or(history.len());
            for (member, &k) in frame.iter().enumerate() {
                let place = p + station * frame.len() + member;
                wide[(place, place)] = priors[k].sigma.powi(2);
                let mut column = vec![0.0; rows];
                column[per * begin..per * end].copy_from_slice(&all[k * rows..][per * begin..per * end]);
                all.extend(column);
            }
        }
        (all, wide)
    }
}
