//! Simulated calibrations and what becomes of programs: whether the verdict writes what helps. Shared by the tests and by
//! the sweep of `benches/verdict.rs`.

// Public to the bench that includes this file, which does not read all of it.
#![allow(unreachable_pub, dead_code)]

use std::fmt;

use nalgebra::{DMatrix, DVector, UnitQuaternion};
use truegrind_arm::condition::Condition;
use truegrind_arm::estimated::Judgement;
use truegrind_arm::jacobian::{BaseAndTool, parameter_jacobian};
use truegrind_arm::model::{Joints, Model};
use truegrind_arm::parameter::Parameter;
use truegrind_calibration::identification::identify::{Identification, Options, identify};
use truegrind_calibration::identification::solver::SOLVERS;
use truegrind_calibration::identification::start::candidate_frames;
use truegrind_calibration::identification::tolerance::Tolerance;
use truegrind_calibration::measurement::dataset::Dataset;
use truegrind_calibration::measurement::simulation::Simulation;
use truegrind_calibration::measurement::simulation::recipe::Recipe;
use truegrind_calibration::measurement::{import, split};
use truegrind_math::se3::{Pose, vector_from_pose};

/// One arm, measured once.
#[derive(Debug, Clone, Copy)]
pub struct Case {
    /// Robot of the catalogue.
    pub robot: &'static str,
    /// Whether a draw-wire measures, else a tracker.
    pub cable: bool,
    /// Rows.
    pub rows: usize,
    /// Standard deviation of a reading (mm).
    pub noise_mm: f64,
    /// Relative error of the sensor's scale.
    pub scale: f64,
    /// How far the arm is off, against σ 0.25 mm, 0.03° and 0.1° of joint zeros.
    pub spread: f64,
    /// Seed of arm and rows.
    pub seed: u64,
}

impl fmt::Display for Case {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let sensor = if self.cable { "cable" } else { "tracker" };
        write!(
            f,
            "{},{sensor},{},{},{},{},{}",
            self.robot, self.rows, self.noise_mm, self.scale, self.spread, self.seed
        )
    }
}

/// What became of a case.
pub struct Outcome {
    /// The verdict; absent where nothing could be fitted at all.
    pub status: Option<Judgement>,
    /// Probability of a benefit that was promised, and without any scale.
    pub chances: Option<[f64; 2]>,
    /// RMS error at fresh poses with the part placed anew (mm): data sheet and estimate.
    pub rms_mm: [f64; 2],
    /// The identification.
    pub found: Option<Identification>,
}

impl Outcome {
    /// Whether a model file would be written without a flag.
    pub fn written(&self) -> bool {
        matches!(self.status, Some(Judgement::Pass | Judgement::NotEvaluated))
    }

    /// Whether programs are better for the model.
    pub fn helps(&self) -> bool {
        self.rms_mm[1] < self.rms_mm[0]
    }
}

impl Case {
    fn recipe(&self, rows: usize, seed: u64) -> String {
        let Case { robot, spread, noise_mm, scale, .. } = *self;
        let [length, twist, zero] = [0.25, 0.03, 0.1].map(|v| v * spread);
        let sensor = if self.cable {
            "kind = \"cable\"\noutlets_mm = [[900.0, 250.0, 60.0]]\nzeros_mm = [14.0]\nhook_mm = [35.0, 10.0, 60.0]"
        } else {
            "kind = \"position\"\nframe = { position_mm = [2310.5, -640.2, 512.7], wxyz = [0.12, 0.02, -0.03, 0.99] }\n\
             reflector_mm = [38.2, 12.6, 61.3]"
        };
        let fault = if scale == 0.0 {
            String::new()
        } else {
            format!("[[fault]]\nfault = \"sensor-scale\"\nerror = {scale}\n")
        };
        format!(
            "robot = \"{robot}\"\nseed = {seed}\n[arm.random]\nseed = {}\na_mm = {length}\nd_mm = {length}\n\
             alpha_deg = {twist}\nbeta_deg = {twist}\ntheta_deg = {zero}\n\
             [[arm.effect]]\neffect = \"gear-eccentricity\"\njoint = 0\norder = 1.0\nsine_rad = 1.0e-4\ncosine_rad = 1.0e-4\n\
             [poses]\nkind = \"random\"\ncount = {rows}\nmin_deg = [-90.0, -50.0, -60.0, -120.0, -100.0, -150.0]\n\
             max_deg = [90.0, 60.0, 50.0, 120.0, 100.0, 150.0]\n[sensor]\n{sensor}\n[noise]\nsigma_mm = {noise_mm}\n\
             joints_deg = 0.0005\n{fault}",
            self.seed
        )
    }

    fn simulated(&self, rows: usize, seed: u64) -> Simulation {
        let recipe = Recipe::parse(&self.recipe(rows, seed), "case").unwrap();
        recipe
            .simulate(|name| truegrind_arm::robots::load(name).map(|r| r.model).map_err(|e| e.to_string()))
            .unwrap()
    }

    /// The rows as a file, and the arm that was measured.
    pub fn measured(&self) -> Simulation {
        self.simulated(self.rows, 1000 + self.seed)
    }

    /// Measures, identifies, and looks at fresh poses of the same region.
    pub fn outcome(&self) -> Outcome {
        let simulation = self.measured();
        let mut dataset =
            import::read("case.csv", simulation.csv.as_bytes(), &import::Options::default()).unwrap();
        dataset.file = "case.csv".to_owned();
        let Some(found) = identified(&dataset, self.robot, &simulation.nominal) else {
            return Outcome { status: None, chances: None, rms_mm: [0.0; 2], found: None };
        };
        let fresh = self.simulated(150, 5000 + self.seed);
        let poses: Vec<Joints> = fresh.rows.iter().map(|row| row.joints).collect();
        let target = found.geometry.frames.flange_from_target;
        let rms = |model: &Model| placed_rms_mm(&simulation.actual, model, &poses, &target);
        Outcome {
            status: Some(found.estimated.verdict.status),
            chances: found.benefit.map(|b| [b.probability, b.probability_without_scale]),
            rms_mm: [rms(&simulation.nominal), rms(&found.estimated.model)],
            found: Some(found),
        }
    }
}

pub fn identified(dataset: &Dataset, robot: &str, nominal: &Model) -> Option<Identification> {
    let options = Options {
        tolerance: Tolerance { learn_widths: true, ..Tolerance::default() },
        solver: &SOLVERS[0],
        held_out: 0.2,
        seed: 0,
        fuse_readout: true,
        limit_rmse_mm: None,
        limit_max_mm: None,
        stated_frames: None,
    };
    let split = |d: &Dataset| split::random(d, 0.2, 0);
    let fits = candidate_frames(dataset, nominal).ok()?.into_iter();
    let found = fits.filter_map(|frames| identify(dataset, robot, nominal, &frames, &split, &options).ok());
    found.min_by(|a, b| a.estimated.registered.fitted.rmse.total_cmp(&b.estimated.registered.fitted.rmse))
}

/// RMS distance between a point on two arms (mm) after base and point were placed as well as they can be.
pub fn placed_rms_mm(actual: &Model, model: &Model, poses: &[Joints], target: &Pose) -> f64 {
    let still = Condition::default();
    let (real, known) = (actual.at_condition(&still), model.at_condition(&still));
    let target = Pose::from_parts(target.translation, UnitQuaternion::identity());
    let ends = BaseAndTool { world_from_base: [0.0; 6], flange_from_tool: vector_from_pose(&target) };
    let list: Vec<Parameter> =
        (0..6).map(Parameter::SensorFrame).chain((0..3).map(Parameter::Target)).collect();
    let (mut off, mut rigid) = (DVector::zeros(3 * poses.len()), DMatrix::zeros(3 * poses.len(), 9));
    for (k, q) in poses.iter().enumerate() {
        let twists = parameter_jacobian(&ends, &known, q, &list);
        rigid.rows_mut(3 * k, 3).copy_from(&twists.rows(0, 3));
        let difference =
            (real.forward(q) * target).translation.vector - (known.forward(q) * target).translation.vector;
        off.rows_mut(3 * k, 3).copy_from(&difference);
    }
    // Radians to parts of a metre.
    for k in 3..6 {
        rigid.column_mut(k).scale_mut(1e-3);
    }
    let placed = rigid.clone().svd(true, true).solve(&off, 1e-9).unwrap();
    ((&off - rigid * placed).norm_squared() / poses.len() as f64).sqrt()
}
