//! Settings of a plan.

use super::candidate::Bounds;
use super::keep_out::KeepOut;
use super::questions::Question;
use super::schedule::Visits;
use truegrind_arm::model::Model;
use truegrind_calibration::diagnosis::something_else::SomethingElse;
use truegrind_calibration::identification::tolerance::Tolerance;
use truegrind_calibration::measurement::dataset::Sensor;

/// Settings of a plan.
#[derive(Debug, Clone)]
pub struct Options {
    /// Number of different poses.
    pub poses: usize,
    /// Optimality criterion.
    pub index: Index,
    /// Noise of a reading.
    pub noise: Noise,
    /// Priors.
    pub tolerance: Tolerance,
    /// Number of candidates.
    pub candidates: usize,
    /// Constraints on candidates.
    pub bounds: Bounds,
    /// Repeated visits.
    pub visits: Visits,
    /// Ambiguous findings of a diagnosis.
    pub questions: Vec<Question>,
    /// What no cause of a diagnosis explains: poses are added that tell most about it.
    pub something_else: Option<SomethingElse>,
    /// Number of these poses.
    pub field_poses: usize,
    /// Whether the poses are to determine geometry and effects, not only what no cause explains.
    pub geometry: bool,
    /// Non-centrality from which an effect counts as detected.
    pub decisive: f64,
    /// Load that the flange may carry (kg), where known: what it would decide is stated.
    pub rated_load_kg: Option<f64>,
    /// Seed of all random numbers.
    pub seed: u64,
}

impl Default for Options {
    fn default() -> Self {
        Self {
            poses: 60,
            index: Index::default(),
            noise: Noise::default(),
            tolerance: Tolerance::default(),
            candidates: 2000,
            bounds: Bounds::default(),
            visits: Visits::default(),
            questions: Vec::new(),
            something_else: None,
            field_poses: FIELD_POSES,
            geometry: true,
            decisive: 25.0,
            rated_load_kg: None,
            seed: 0,
        }
    }
}

/// Poses or visits for what no cause explains.
pub const FIELD_POSES: usize = 10;

/// Radius of the links, and distance of a cable or line of sight from them, as a share of the reach.
const LINK_SHARE: f64 = 1.0 / 12.0;

/// Distance from the mounting plane to the flange of the stretched arm, at most (mm).
pub fn reach_mm(nominal: &Model) -> f64 {
    nominal.links[1..].iter().map(|link| link.a_mm.abs() + link.d_mm.abs()).sum()
}

impl Options {
    /// The usual settings for an arm and a sensor: the links, with a radius of a twelfth of the reach, stay above the mounting plane and as far
    /// from a cable or a line of sight, where one is known.
    pub fn usual(nominal: &Model, sensor: Sensor, sight_is_known: bool) -> Self {
        let about_links_mm = LINK_SHARE * reach_mm(nominal);
        let visits = Visits::default();
        Self {
            noise: Noise::usual(sensor),
            bounds: Bounds {
                clearance_mm: (sensor == Sensor::Cable || sight_is_known).then_some(about_links_mm),
                space: KeepOut {
                    floor_mm: Some(0.0),
                    boxes_mm: Vec::new(),
                    radius_mm: about_links_mm,
                    approach_rad: visits.approach_rad,
                },
                ..Bounds::default()
            },
            visits,
            ..Self::default()
        }
    }

    /// The same for `unexplained` alone: `count` poses for an error that follows the pose, without repeats; as many visits of one pose for an error
    /// that follows time, over as long a time as was measured before.
    pub fn for_something_else(self, unexplained: SomethingElse, count: usize) -> Self {
        let mut visits = Visits { repeats: 0, both_sides: 0, warm_up: 0, ..self.visits };
        if !unexplained.is_in_time() {
            return Self {
                poses: 0,
                field_poses: count,
                something_else: Some(unexplained),
                visits,
                questions: Vec::new(),
                geometry: false,
                ..self
            };
        }
        visits.warm_up = count;
        let seconds = unexplained.hours.map(|hours| 3600.0 * hours / count.saturating_sub(1).max(1) as f64);
        visits.seconds_per_row = seconds.unwrap_or(0.0).max(visits.seconds_per_row);
        Self {
            poses: 1,
            field_poses: 0,
            something_else: None,
            visits,
            questions: Vec::new(),
            geometry: false,
            ..self
        }
    }
}

/// Total standard deviations of a reading: sensor, hook, repeatability of the arm.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Noise {
    /// Of a length or a coordinate (mm).
    pub reading_mm: f64,
    /// Of an orientation (rad).
    pub reading_rad: f64,
}

/// Usual standard deviation of an orientation (°).
pub const READING_DEG: f64 = 0.006;

impl Noise {
    /// The usual noise of a sensor.
    pub fn usual(sensor: Sensor) -> Self {
        let reading_mm = if sensor == Sensor::Cable { 0.05 } else { 0.03 };
        Self { reading_mm, reading_rad: READING_DEG.to_radians() }
    }
}

impl Default for Noise {
    fn default() -> Self {
        Self::usual(Sensor::Position)
    }
}

/// Optimality criterion.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
#[non_exhaustive]
pub enum Index {
    /// Determinant of the normal matrix with its priors: minimises the volume of the posterior's confidence ellipsoid.
    #[default]
    D,
    /// Observability index O1: the geometric mean of the singular values, without priors, over the combinations that
    /// the candidates determine.
    O1,
}
