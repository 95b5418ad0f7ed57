//! Simulated measurements of a known arm, to test identification and diagnosis against the truth.
//!
//! A [`Recipe`] states the actual arm (nominal plus deviations, effects, masses), where it is measured, with what
//! sensor, noise, rounding and faults. The same recipe gives the same bytes: three independent ChaCha8 streams of one
//! seed draw poses, conditions and noise, and a separate seed draws the arm.
//!
//! The log has the encoder's angles and, if requested, the read-out that the controller computes from them with the nominal
//! model, both rounded as the recipe says. The arm itself is at the unrounded angles.

pub mod recipe;
mod arm;
mod poses;
mod fault;
mod table;
mod error;
mod stream;

pub use error::RecipeError;

use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, Normal, StandardNormal, StudentT};

use nalgebra::{UnitQuaternion, Vector3};

use self::recipe::{Noise, Recipe};
use self::stream::{Stream, stream};
use super::dataset::{Reading, Sensor};
use super::sensor::Rig;
use truegrind_arm::condition::Condition;
use truegrind_arm::model::{Joints, Model};
use truegrind_math::work::checkpoint;

/// A simulated measurement.
#[derive(Debug, Clone, PartialEq)]
pub struct Simulation {
    /// The measurement file, with header.
    pub csv: String,
    /// The arm that was measured.
    pub actual: Model,
    /// The arm of the data sheet.
    pub nominal: Model,
    /// The sensor before any fault, at its first station.
    pub rig: Rig,
    /// The rows before rounding and noise.
    pub rows: Vec<SimulatedRow>,
}

/// The true state of one row.
#[derive(Debug, Clone, PartialEq)]
pub struct SimulatedRow {
    /// Angles of the encoders (rad).
    pub joints: Joints,
    /// The conditions of the actual arm, logged or not.
    pub condition: Condition,
    /// Cable outlet, 0-based.
    pub anchor: usize,
    /// Station of the tracker or camera, 0-based.
    pub station: usize,
    /// The noise-free reading.
    pub reading: Reading,
}

impl Recipe {
    /// Simulates the measurement of the actual arm. `resolve` returns the nominal model of a robot by name.
    ///
    /// ```
    /// use truegrind_arm::robots;
    /// use truegrind_calibration::identification::identify::{Options, identify};
    /// use truegrind_calibration::identification::register::starting_frames;
    /// use truegrind_calibration::identification::tolerance::Tolerance;
    /// use truegrind_calibration::measurement::dataset::Dataset;
    /// use truegrind_calibration::measurement::simulation::recipe::Recipe;
    /// use truegrind_calibration::measurement::{import, split};
    ///
    /// // An arm whose third joint has a zero offset of 0.1°, seen by a tracker.
    /// let recipe = r#"
    /// robot = "abb-irb-120"
    /// seed = 4
    /// [[arm.link]]
    /// joint = 2
    /// theta_deg = 0.1
    /// [poses]
    /// kind = "random"
    /// count = 60
    /// [sensor]
    /// kind = "position"
    /// frame = { position_mm = [2000.0, -600.0, 500.0], wxyz = [1.0, 0.0, 0.0, 0.0] }
    /// reflector_mm = [38.0, 12.0, 61.0]
    /// [noise]
    /// sigma_mm = 0.01
    /// "#;
    /// let resolve = |name: &str| robots::load(name).map(|robot| robot.model).map_err(|error| error.to_string());
    /// let simulation = Recipe::parse(recipe, "recipe.toml")?.simulate(resolve)?;
    /// let turned = simulation.actual.links[2].theta_rad - simulation.nominal.links[2].theta_rad;
    /// assert!((turned.to_degrees() - 0.1).abs() < 1e-9);
    ///
    /// // The simulated file is read like any other; the fit recovers the offset.
    /// let rows = import::read("simulated.csv", simulation.csv.as_bytes(), &import::Options::default())?;
    /// assert_eq!(rows.rows.len(), 60);
    /// let options = Options::default();
    /// let nominal = &simulation.nominal;
    /// let frames = starting_frames(&rows, nominal, &Tolerance::default(), options.fuse_readout)?;
    /// let share = |rows: &Dataset| split::random(rows, options.held_out, options.seed);
    /// let found = identify(&rows, "abb-irb-120", nominal, &frames, &share, &options)?.estimated;
    /// let fitted = found.model.links[2].theta_rad - nominal.links[2].theta_rad;
    /// assert!((fitted - turned).to_degrees().abs() < 0.02, "{}°", fitted.to_degrees());
    /// assert!(found.calibrated.held_out.rmse < 0.5 * found.registered.held_out.rmse);
    /// # Ok::<(), Box<dyn std::error::Error>>(())
    /// ```
    pub fn simulate(
        &self,
        resolve: impl Fn(&str) -> Result<Model, String>,
    ) -> Result<Simulation, RecipeError> {
        self.check()?;
        let nominal = resolve(&self.robot).map_err(|message| RecipeError::Robot { message })?;
        let actual = arm::actual(&nominal, &self.arm)?;
        let rigs = self.rigs();
        let mut rng = stream(self.seed, Stream::Noise);
        let mut rows = Vec::new();
        let mut lines = Vec::new();
        for planned in poses::plan(self, &nominal, &rigs)? {
            checkpoint();
            let number = rows.len();
            let mut truth = planned.condition;
            let mut seen_by = rigs[planned.station].clone();
            for fault in &self.fault {
                fault.before(number, &mut seen_by, &mut truth);
            }
            let mut actual_joints = planned.joints;
            for q in actual_joints.iter_mut() {
                let repeatability: f64 = StandardNormal.sample(&mut rng);
                *q += repeatability * self.noise.joints_deg.to_radians();
            }
            let flange = actual.forward(&actual_joints, &truth);
            let exact = seen_by.predict(&flange, planned.anchor).ok_or(RecipeError::Invalid {
                key: "sensor.outlets_mm".into(),
                found: "no outlet".into(),
                expected: "one at least",
            })?;
            let distance = seen_by.distance_mm(&flange, planned.anchor).unwrap_or_default();
            let mut reading = noisy(&exact, distance, &self.noise, &mut rng);
            let mut readout = nominal.forward(&planned.joints, &Condition::default()).translation.vector;
            for fault in &self.fault {
                fault.after(number, &seen_by, &flange, planned.anchor, &mut reading, &mut readout);
            }
            lines.push(table::Logged {
                joints: planned.joints,
                reading,
                readout,
                condition: planned.condition,
                anchor: planned.anchor,
                station: planned.station,
            });
            rows.push(SimulatedRow {
                joints: planned.joints,
                condition: truth,
                anchor: planned.anchor,
                station: planned.station,
                reading: exact,
            });
        }
        let csv = table::csv(self, &lines);
        Ok(Simulation { csv, actual, nominal, rig: self.sensor.rig(), rows })
    }
}

/// A reading with the sensor's noise. Student's t is scaled to the stated standard deviation.
fn noisy(exact: &Reading, distance_mm: f64, noise: &Noise, rng: &mut ChaCha8Rng) -> Reading {
    let sigma = noise.sigma_mm + noise.per_metre_mm * distance_mm * 1e-3;
    // The degrees of freedom were checked to be above 2.
    let tail =
        noise.student_t.and_then(|dof| StudentT::new(dof).ok().map(|t| (t, ((dof - 2.0) / dof).sqrt())));
    let normal = Normal::new(0.0, 1.0).ok();
    let mut draw = |sigma: f64| match (&tail, &normal) {
        (Some((t, scale)), _) => t.sample(rng) * scale * sigma,
        (None, Some(normal)) => normal.sample(rng) * sigma,
        (None, None) => 0.0,
    };
    match exact {
        Reading::Cable(length) => Reading::Cable(length + draw(sigma)),
        Reading::Position(p) => Reading::Position(p + Vector3::from_fn(|_, _| draw(sigma))),
        Reading::Pose(pose) => {
            let mut out = pose.clone();
            out.translation.vector += Vector3::from_fn(|_, _| draw(sigma));
            let turn = Vector3::from_fn(|_, _| draw(noise.sigma_deg.to_radians()));
            out.rotation = UnitQuaternion::from_scaled_axis(turn) * out.rotation;
            Reading::Pose(out)
        }
    }
}

impl Simulation {
    /// The sensor of the file.
    pub fn sensor(&self) -> Sensor {
        self.rig.sensor()
    }
}
