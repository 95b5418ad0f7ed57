//! What to measure: poses that tell most of an arm, in an order that tells effects from each other, as a program.
//!
//! - [`candidate`]: poses that the arm reaches and the sensor sees, drawn at random; [`sight`]: a cable past the arm;
//!   [`space`]: what it must not enter;
//! - [`rows`]: what a reading at a pose tells of every parameter;
//! - [`design`]: which of the candidates to take;
//! - `roads`: ways round what is kept out of;
//! - [`schedule`]: repeats, both sides of approach, warm-up, and the order;
//! - [`power`]: which effects the measurement can decide, and from which size on;
//! - [`rival`]: what a diagnosis could not tell apart;
//! - [`drive`]: the program that moves there.

mod blank;
mod options;
mod roads;
mod wanted;
pub mod candidate;
pub mod sight;
pub mod space;
pub mod rows;
pub mod design;
pub mod schedule;
pub mod power;
pub mod rival;
pub mod drive;

use rand::SeedableRng;
use rand::seq::SliceRandom;
use rand_chacha::ChaCha8Rng;
use thiserror::Error;

use self::blank::blank;
use self::candidate::{Candidate, Passed};
use self::design::{Design, Index};
use self::power::Decidable;
use self::roads::Roads;
use self::rows::Told;
use self::schedule::{Row, Ways};
use self::space::{Space, Watch};
use truegrind_arm::model::{Joints, Model};
use truegrind_arm::parameter::{Parameter, arm_parameters};
use truegrind_calibration::identification::fit::frame_parameters;
use truegrind_calibration::measurement::dataset::{Dataset, Sensor};

pub use self::options::Options;
pub use self::wanted::Wanted;

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
    pub passed: Passed,
    /// What the rows can decide.
    pub decidable: Vec<Decidable>,
    /// What was kept out of, at every pose and on every way.
    pub space: Space,
}

/// How much a set of poses tells.
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

/// Why there is no plan.
#[derive(Debug, Clone, PartialEq, Error)]
#[non_exhaustive]
pub enum PlanError {
    /// Too few poses are allowed.
    #[error(
        "{found} of {drawn} random poses are allowed, expected at least {wanted} to choose from ({passed}): widen the box, \
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
        passed: Passed,
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

/// Random sets that the chosen one is compared with.
const RANDOM_SETS: usize = 10;

/// Poses at which sets are compared.
const JUDGES: usize = 300;

/// Plans a measurement.
///
/// # Errors
/// [`PlanError`], when too few poses are allowed.
pub fn plan(wanted: &Wanted<'_>, options: &Options) -> Result<Plan, PlanError> {
    if wanted.sensor == Sensor::Cable && wanted.frames.outlets_mm.is_empty() {
        return Err(PlanError::NoOutlet);
    }
    if options.index == Index::O1 && !options.questions.is_empty() {
        return Err(PlanError::IndexOfQuestions);
    }
    let nominal = Model { effects: Vec::new(), ..wanted.nominal.clone() };
    let wanted = &Wanted { nominal: &nominal, ..wanted.clone() };
    let (candidates, passed) = candidate::draw(wanted, &options.bounds, options.candidates, options.seed);
    if candidates.len() < options.poses.max(1) {
        return Err(PlanError::TooFew {
            found: candidates.len(),
            drawn: passed.drawn,
            wanted: options.poses.max(1),
            passed,
        });
    }
    let parameters = parameters(wanted);
    let watch = Watch::of(wanted, &options.bounds.space);
    let laid = match laid(wanted, &parameters, &candidates, None, options)? {
        Some(laid) => laid,
        // Some of the poses lie behind a box: then only those count that hang together.
        None => {
            let roads = Roads::between(candidates.iter().map(|candidate| candidate.joints).collect(), &watch);
            let together: Vec<Candidate> =
                roads.largest().into_iter().map(|i| candidates[i].clone()).collect();
            let parted = PlanError::NoWay {
                allowed: candidates.len(),
                found: together.len(),
                wanted: options.poses.max(1),
            };
            if together.len() < options.poses.max(1) {
                return Err(parted);
            }
            laid(wanted, &parameters, &together, Some(&roads), options)?.ok_or(parted)?
        }
    };
    let Laid { poses, rows, quality } = laid;
    let measured = schedule::data(&rows, &poses);
    let final_told = rows::told(wanted, &parameters, &measured, &[], options);
    let sigmas = final_told.sigmas().ok_or(PlanError::NotFinite)?;
    let decidable = power::decidable(wanted, &parameters, &measured, options);
    let space = options.bounds.space.clone();
    Ok(Plan { poses, rows, parameters, sigmas, quality, passed, decidable, space })
}

/// Poses that were chosen, and the order of their rows.
struct Laid {
    poses: Vec<Candidate>,
    rows: Vec<Row>,
    quality: Quality,
}

/// Chooses among candidates and puts them in order; `None` where no way is found from one to the next. `roads`: along which ways.
fn laid(
    wanted: &Wanted<'_>,
    parameters: &[Parameter],
    candidates: &[Candidate],
    roads: Option<&Roads>,
    options: &Options,
) -> Result<Option<Laid>, PlanError> {
    let visits = options.visits.asked(&options.questions);
    // The rows that each candidate would give, with the effects in question beside the geometry.
    let still = candidate::rows(candidates);
    let told = rows::told(wanted, parameters, &still, &options.questions, options);
    let design = Design { told: &told, index: options.index };
    let chosen = design.choose(options.poses).ok_or(PlanError::NotFinite)?;
    let geometry = Told { interest: Vec::new(), ..rows::told(wanted, parameters, &still, &[], options) };
    let quality = quality(&geometry, &chosen, options).ok_or(PlanError::NotFinite)?;
    let poses: Vec<Candidate> = chosen.iter().map(|&i| candidates[i].clone()).collect();
    let known: Vec<Joints> = candidates.iter().map(|candidate| candidate.joints).collect();
    let ways = Ways { known: &known, roads };
    let ordered = schedule::schedule(wanted, poses, &visits, &options.bounds, &ways, options.seed);
    Ok(ordered.map(|(poses, rows)| Laid { poses, rows, quality }))
}

/// What is fitted: links, then frames.
fn parameters(wanted: &Wanted<'_>) -> Vec<Parameter> {
    let mut out = arm_parameters(wanted.nominal);
    let mut empty = Dataset::new("plan", wanted.sensor, Vec::new());
    if wanted.sensor == Sensor::Cable {
        // One row of the last cable says how many there are.
        let anchor = wanted.frames.outlets_mm.len() - 1;
        let mut row = blank(0, nalgebra::Vector6::zeros(), wanted.sensor);
        row.anchor = anchor;
        empty.rows.push(row);
    }
    out.extend(frame_parameters(&empty));
    out
}

fn quality(told: &Told, chosen: &[usize], options: &Options) -> Option<Quality> {
    let rest: Vec<usize> = (0..told.rows()).filter(|i| !chosen.contains(i)).collect();
    let all: Vec<usize> = (0..told.rows()).collect();
    let pool = if rest.is_empty() { &all } else { &rest };
    let judges: Vec<usize> = pool.iter().copied().step_by(pool.len().div_ceil(JUDGES).max(1)).collect();
    let of = |set: &[usize]| -> Option<(f64, f64)> {
        let information = told.information(set);
        let sigma = told.reading_sigma(&information, &judges)? * options.noise.reading_mm;
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
