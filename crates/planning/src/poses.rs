//! Optimal experiment design: informative measurement poses, their order, and the program that visits them.
//!
//! - [`candidate`]: random reachable poses visible to the sensor; [`cable`]: clearance of a cable from the arm;
//!   [`keep_out`]: collision checks against floor and boxes;
//! - [`rows`]: whitened Jacobian of the readings;
//! - [`design`]: D-optimal choice among the candidates;
//! - `roadmap`: ways round what is kept out of;
//! - [`schedule`]: repeats, both sides of approach, warm-up, and the order;
//! - [`power`]: smallest detectable size of each effect;
//! - [`questions`]: ambiguous findings of a diagnosis;
//! - [`program`]: the measurement program.

mod blank;
mod options;
mod roadmap;
mod setup;
pub mod candidate;
pub mod cable;
pub mod keep_out;
pub mod rows;
pub mod design;
pub mod schedule;
pub mod power;
pub mod questions;
pub mod program;

use rand::SeedableRng;
use rand::seq::SliceRandom;
use rand_chacha::ChaCha8Rng;
use thiserror::Error;

use self::blank::blank_row;
use self::candidate::{Candidate, RejectionCounts};
use self::design::{Design, Index};
use self::keep_out::{CollisionChecker, KeepOut};
use self::power::Detectability;
use self::roadmap::Roadmap;
use self::rows::ReadingJacobian;
use self::schedule::{Connections, Row};
use truegrind_arm::model::{Joints, Model};
use truegrind_arm::parameter::{Parameter, arm_parameters};
use truegrind_calibration::identification::fit::frame_parameters;
use truegrind_calibration::measurement::dataset::{Dataset, Sensor};

pub use self::options::Options;
pub use self::setup::MeasurementSetup;

/// A plan.
#[derive(Debug, Clone, PartialEq)]
pub struct Plan {
    /// The chosen poses, in the order in which they are first visited.
    pub poses: Vec<Candidate>,
    /// The rows to measure, in order.
    pub rows: Vec<Row>,
    /// Parameters that the measurement is for: of the arm, then of the sensor's frames.
    pub parameters: Vec<Parameter>,
    /// Predicted standard deviation of each (mm, rad), priors included.
    pub sigmas: Vec<f64>,
    /// How good the chosen poses are, and as many random ones.
    pub quality: Quality,
    /// What became of the random poses.
    pub rejections: RejectionCounts,
    /// What the rows can decide.
    pub detectability: Vec<Detectability>,
    /// The checked obstacles.
    pub space: KeepOut,
}

/// Quality of a set of poses.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Quality {
    /// Information: log det of the normal matrix in units of the priors, that matrix included.
    pub log_det: f64,
    /// The same for as many random candidates, mean of ten draws.
    pub random_log_det: f64,
    /// Predicted standard deviation of what the fitted arm says of a reading, root mean square over candidates that were
    /// not chosen (mm). What no reading can see does not count.
    pub reading_sigma_mm: f64,
    /// The same after as many random candidates, mean of ten draws (mm).
    pub random_reading_sigma_mm: f64,
}

/// Why planning failed.
#[derive(Debug, Clone, PartialEq, Error)]
#[non_exhaustive]
pub enum PlanError {
    /// Too few poses are allowed.
    #[error(
        "{found} of {drawn} random poses are allowed, expected at least {wanted} to choose from ({rejections}): widen the box, \
         the cable's range or the joint margin, lower the floor or make the boxes to keep out of smaller"
    )]
    TooFew {
        /// Allowed.
        found: usize,
        /// Drawn.
        drawn: usize,
        /// Needed.
        wanted: usize,
        /// What the others failed.
        rejections: RejectionCounts,
    },
    /// What is kept out of cuts the poses that are allowed into parts, and none of them is large enough.
    #[error(
        "the boxes to keep out of and the floor part the {allowed} poses that are allowed: at most {found} can be visited without \
         entering them, expected at least {wanted}: make the boxes smaller, lower the floor, or ask for fewer poses (--poses)"
    )]
    NoWay {
        /// Poses that are allowed.
        allowed: usize,
        /// Those of the largest part that hangs together.
        found: usize,
        /// Needed.
        wanted: usize,
    },
    /// The sensor is a cable of which no outlet is stated.
    #[error("a cable needs the place of its outlet: state where in the base it comes out")]
    NoOutlet,
    /// O1 knows no effects.
    #[error("index O1 cannot weigh the questions of a diagnosis: take D-optimality")]
    IndexOfQuestions,
    /// The rows tell nothing finite.
    #[error(
        "the normal matrix of the chosen poses is not positive: the frames or the noise hold a number that is not finite"
    )]
    NotFinite,
}

/// Random sets for comparison.
const RANDOM_SETS: usize = 10;

/// Poses at which sets are compared.
const JUDGES: usize = 300;

/// Plans a measurement: candidates, design, order.
///
/// # Errors
/// [`PlanError`], when too few poses are allowed.
pub fn plan(setup: &MeasurementSetup<'_>, options: &Options) -> Result<Plan, PlanError> {
    if setup.sensor == Sensor::Cable && setup.frames.outlets_mm.is_empty() {
        return Err(PlanError::NoOutlet);
    }
    if options.index == Index::O1 && !options.questions.is_empty() {
        return Err(PlanError::IndexOfQuestions);
    }
    let nominal = Model { effects: Vec::new(), ..setup.nominal.clone() };
    let setup = &MeasurementSetup { nominal: &nominal, ..setup.clone() };
    let (candidates, rejections) = candidate::draw(setup, &options.bounds, options.candidates, options.seed);
    if candidates.len() < options.poses.max(1) {
        return Err(PlanError::TooFew {
            found: candidates.len(),
            drawn: rejections.drawn,
            wanted: options.poses.max(1),
            rejections,
        });
    }
    let parameters = parameters(setup);
    let checker = CollisionChecker::of(setup, &options.bounds.space);
    let laid = match choose_and_order(setup, &parameters, &candidates, None, options)? {
        Some(laid) => laid,
        // Some of the poses lie behind a box: then only those count that hang together.
        None => {
            let roadmap =
                Roadmap::between(candidates.iter().map(|candidate| candidate.joints).collect(), &checker);
            let together: Vec<Candidate> =
                roadmap.largest().into_iter().map(|i| candidates[i].clone()).collect();
            let parted = PlanError::NoWay {
                allowed: candidates.len(),
                found: together.len(),
                wanted: options.poses.max(1),
            };
            if together.len() < options.poses.max(1) {
                return Err(parted);
            }
            choose_and_order(setup, &parameters, &together, Some(&roadmap), options)?.ok_or(parted)?
        }
    };
    let OrderedChoice { poses, rows, quality } = laid;
    let measured = schedule::data(&rows, &poses);
    let final_jacobian = rows::reading_jacobian(setup, &parameters, &measured, &[], options);
    let sigmas = final_jacobian.sigmas().ok_or(PlanError::NotFinite)?;
    let detectability = power::detectability(setup, &parameters, &measured, options);
    let space = options.bounds.space.clone();
    Ok(Plan { poses, rows, parameters, sigmas, quality, rejections, detectability, space })
}

/// Poses that were chosen, and the order of their rows.
struct OrderedChoice {
    poses: Vec<Candidate>,
    rows: Vec<Row>,
    quality: Quality,
}

/// Chooses among candidates and puts them in order; `None` where no way is found from one to the next. `roadmap`: along which ways.
fn choose_and_order(
    setup: &MeasurementSetup<'_>,
    parameters: &[Parameter],
    candidates: &[Candidate],
    roadmap: Option<&Roadmap>,
    options: &Options,
) -> Result<Option<OrderedChoice>, PlanError> {
    let visits = options.visits.with_questions(&options.questions);
    // The rows that each candidate would give, with the effects in question beside the geometry.
    let still = candidate::rows(candidates);
    let jacobian = rows::reading_jacobian(setup, parameters, &still, &options.questions, options);
    let design = Design { jacobian: &jacobian, index: options.index };
    let chosen = design.choose(options.poses).ok_or(PlanError::NotFinite)?;
    let geometry = ReadingJacobian {
        interest: Vec::new(),
        ..rows::reading_jacobian(setup, parameters, &still, &[], options)
    };
    let quality = quality(&geometry, &chosen, options).ok_or(PlanError::NotFinite)?;
    let poses: Vec<Candidate> = chosen.iter().map(|&i| candidates[i].clone()).collect();
    let known: Vec<Joints> = candidates.iter().map(|candidate| candidate.joints).collect();
    let ways = Connections { known: &known, roadmap };
    let ordered = schedule::schedule(setup, poses, &visits, &options.bounds, &ways, options.seed);
    Ok(ordered.map(|(poses, rows)| OrderedChoice { poses, rows, quality }))
}

/// What is fitted: links, then frames.
fn parameters(setup: &MeasurementSetup<'_>) -> Vec<Parameter> {
    let mut out = arm_parameters(setup.nominal);
    let mut empty = Dataset::new("plan", setup.sensor, Vec::new());
    if setup.sensor == Sensor::Cable {
        // One row of the last cable says how many there are.
        let anchor = setup.frames.outlets_mm.len() - 1;
        let mut row = blank_row(0, nalgebra::Vector6::zeros(), setup.sensor);
        row.anchor = anchor;
        empty.rows.push(row);
    }
    out.extend(frame_parameters(&empty));
    out
}

fn quality(jacobian: &ReadingJacobian, chosen: &[usize], options: &Options) -> Option<Quality> {
    let rest: Vec<usize> = (0..jacobian.rows()).filter(|i| !chosen.contains(i)).collect();
    let all: Vec<usize> = (0..jacobian.rows()).collect();
    let pool = if rest.is_empty() { &all } else { &rest };
    let judges: Vec<usize> = pool.iter().copied().step_by(pool.len().div_ceil(JUDGES).max(1)).collect();
    let of = |set: &[usize]| -> Option<(f64, f64)> {
        let information = jacobian.information(set);
        let sigma = jacobian.reading_sigma(&information, &judges)? * options.noise.reading_mm;
        Some((design::log_det(&information)?, sigma))
    };
    let (log_det, reading_sigma_mm) = of(chosen)?;
    let mut random = ChaCha8Rng::seed_from_u64(options.seed ^ 0x7261_6e64_6f6d);
    let mut shuffled = all.clone();
    let mut sums = (0.0, 0.0);
    for _ in 0..RANDOM_SETS {
        shuffled.shuffle(&mut random);
        let (a, b) = of(&shuffled[..chosen.len()])?;
        sums = (sums.0 + a, sums.1 + b);
    }
    let mean = 1.0 / RANDOM_SETS as f64;
    Some(Quality {
        log_det,
        random_log_det: sums.0 * mean,
        reading_sigma_mm,
        random_reading_sigma_mm: sums.1 * mean,
    })
}
