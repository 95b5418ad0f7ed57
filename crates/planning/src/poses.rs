//! Optimal experiment design: informative measurement poses, their order, and the program that visits them.
//!
//! - [`candidate`]: random reachable poses visible to the sensor; [`cable`]: clearance of a cable from the arm;
//!   [`keep_out`]: collision checks against floor, boxes and the arm's own bodies (`own_bodies`);
//! - [`rows`]: whitened Jacobian of the readings;
//! - [`design`]: D-optimal choice among the candidates;
//! - [`field`]: choice for an error that no cause of a diagnosis explains;
//! - `roadmap`: paths around the obstacles;
//! - [`schedule`]: repeats, both sides of approach, warm-up, and the order;
//! - [`power`]: smallest detectable size of each effect;
//! - [`questions`]: ambiguous findings of a diagnosis; [`parting`]: how far rows part a finding and its rivals;
//! - [`program`]: the measurement program.

mod blank;
mod options;
mod own_bodies;
mod roadmap;
mod setup;
pub mod candidate;
pub mod cable;
pub mod keep_out;
pub mod rows;
pub mod design;
pub mod field;
pub mod schedule;
pub mod parting;
pub mod power;
pub mod questions;
pub mod program;
pub mod settings;

use rand::SeedableRng;
use rand::seq::SliceRandom;
use rand_chacha::ChaCha8Rng;
use thiserror::Error;

use self::blank::blank_row;
use self::candidate::{Candidate, RejectionCounts};
use self::design::{Design, Index};
use self::field::{FieldDesign, FieldUncertainty, TELLS};
use self::keep_out::{CollisionChecker, KeepOut};
use self::parting::Parting;
use self::power::Detectability;
use self::roadmap::Roadmap;
use self::rows::ReadingJacobian;
use self::schedule::{Connections, Row};
use truegrind_arm::model::{Joints, Model};
use truegrind_arm::parameter::{Parameter, arm_parameters};
use truegrind_calibration::diagnosis::something_else::SomethingElse;
use truegrind_calibration::identification::fit::frame_parameters;
use truegrind_calibration::measurement::dataset::{Dataset, Sensor};

pub use self::options::{FIELD_POSES, Options, READING_DEG, reach_mm};
pub use self::setup::MeasurementSetup;

/// A plan.
#[derive(Debug, Clone, PartialEq)]
pub struct Plan {
    /// The chosen poses, in the order of their first visit.
    pub poses: Vec<Candidate>,
    /// The rows to measure, in order.
    pub rows: Vec<Row>,
    /// The parameters to be determined: of the arm, then of the sensor's frames.
    pub parameters: Vec<Parameter>,
    /// Predicted standard deviation of each parameter (mm, rad), priors included.
    pub sigmas: Vec<f64>,
    /// Quality of the chosen poses, and of as many random ones.
    pub quality: Quality,
    /// Rejection counts of the random poses.
    pub rejections: RejectionCounts,
    /// Smallest detectable size of each effect.
    pub detectability: Vec<Detectability>,
    /// How far the rows part each finding in question and its rivals.
    pub partings: Vec<Parting>,
    /// Whether the poses are to determine geometry and effects, not only an error that no cause explains.
    pub geometry: bool,
    /// What is known of an error that no cause explains, where poses were chosen for it.
    pub field: Option<FieldUncertainty>,
    /// The checked obstacles.
    pub space: KeepOut,
    /// Checked distance of the cable or the line of sight from the links (mm).
    pub clearance_mm: Option<f64>,
}

/// Quality of a set of poses.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Quality {
    /// Information: log det of the normal matrix in units of the priors, priors included.
    pub log_det: f64,
    /// The same for as many random candidates, mean of ten draws.
    pub random_log_det: f64,
    /// Predicted standard deviation of a reading under the fitted arm, of a length or of each coordinate as the noise is stated, root mean
    /// square over candidates that were not chosen (mm). Unobservable parameters have no effect on it.
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
        "{found} of {drawn} random poses are allowed, expected at least {wanted} candidates ({rejections}): widen the box, \
         the cable's range or the joint margin, lower the floor or make the boxes to keep out of smaller"
    )]
    TooFew {
        /// Allowed.
        found: usize,
        /// Drawn.
        drawn: usize,
        /// Needed.
        wanted: usize,
        /// Reasons for the rejections.
        rejections: RejectionCounts,
    },
    /// The obstacles divide the allowed poses into unconnected parts, none of which is large enough.
    #[error(
        "the boxes to keep out of and the floor divide the {allowed} allowed poses: at most {found} can be visited without \
         a collision, expected at least {wanted}: make the boxes smaller, lower the floor, or plan fewer poses (--poses)"
    )]
    NoWay {
        /// Number of allowed poses.
        allowed: usize,
        /// Number of poses in the largest connected part.
        found: usize,
        /// Needed.
        wanted: usize,
    },
    /// The sensor is a cable without a stated outlet.
    #[error("a cable needs the location of its outlet: state it in the base frame")]
    NoOutlet,
    /// An outlet is inside the robot's foot.
    #[error(
        "the cable's outlet is stated {:.3}, {:.3}, {:.3} mm from the origin of the base, in the robot's foot; expected millimetres: \
         multiply metres by 1000", at_mm[0], at_mm[1], at_mm[2]
    )]
    OutletInFoot {
        /// Location in the base frame.
        at_mm: [f64; 3],
    },
    /// O1 cannot include effects.
    #[error("index O1 cannot weight the questions of a diagnosis: use D-optimality")]
    IndexOfQuestions,
    /// The information matrix is not positive definite.
    #[error(
        "the normal matrix of the chosen poses is not positive definite: the frames or the noise contain a non-finite number"
    )]
    NotFinite,
}

/// Distance from the origin of the base at which no outlet can be (mm).
const FOOT_MM: f64 = 10.0;

/// Number of random sets for comparison.
const RANDOM_SETS: usize = 10;

/// Number of poses at which sets are compared.
const JUDGES: usize = 300;

/// Plans a measurement: candidates, design, order.
///
/// # Errors
/// [`PlanError`], when too few poses are allowed.
pub fn plan(setup: &MeasurementSetup<'_>, options: &Options) -> Result<Plan, PlanError> {
    if setup.sensor == Sensor::Cable {
        if setup.frames.outlets_mm.is_empty() {
            return Err(PlanError::NoOutlet);
        }
        if let Some(at) = setup.frames.outlets_mm.iter().find(|at| at.norm() < FOOT_MM) {
            return Err(PlanError::OutletInFoot { at_mm: (*at).into() });
        }
    }
    if options.index == Index::O1 && !options.questions.is_empty() {
        return Err(PlanError::IndexOfQuestions);
    }
    let nominal = Model { effects: Vec::new(), ..setup.nominal.clone() };
    let setup = &MeasurementSetup { nominal: &nominal, ..setup.clone() };
    let wanted = options.poses + options.something_else.as_ref().map_or(0, |_| options.field_poses);
    let (candidates, rejections) = candidate::draw(setup, &options.bounds, options.candidates, options.seed);
    if candidates.len() < wanted.max(1) {
        return Err(PlanError::TooFew {
            found: candidates.len(),
            drawn: rejections.drawn,
            wanted: wanted.max(1),
            rejections,
        });
    }
    let parameters = parameters(setup);
    let checker = CollisionChecker::of(setup, &options.bounds.space);
    let laid = match choose_and_order(setup, &parameters, &candidates, None, options)? {
        Some(laid) => laid,
        // Obstacles separate some of the poses: only the largest connected part is used.
        None => {
            let roadmap =
                Roadmap::between(candidates.iter().map(|candidate| candidate.joints).collect(), &checker);
            let together: Vec<Candidate> =
                roadmap.largest().into_iter().map(|i| candidates[i].clone()).collect();
            let parted =
                PlanError::NoWay { allowed: candidates.len(), found: together.len(), wanted: wanted.max(1) };
            if together.len() < wanted.max(1) {
                return Err(parted);
            }
            choose_and_order(setup, &parameters, &together, Some(&roadmap), options)?.ok_or(parted)?
        }
    };
    let OrderedChoice { poses, rows, quality, field } = laid;
    let measured = schedule::data(&rows, &poses);
    let final_jacobian = rows::reading_jacobian(setup, &parameters, &measured, &[], options);
    let sigmas = final_jacobian.sigmas().ok_or(PlanError::NotFinite)?;
    // Few visits for something else determine no arm: what they would show of it says nothing.
    let detectability = if options.geometry {
        power::detectability(setup, &parameters, &measured, options)
    } else {
        Vec::new()
    };
    let partings = options
        .questions
        .iter()
        .filter_map(|question| parting::parting(setup, &parameters, &measured, question, options))
        .collect();
    let space = options.bounds.space.clone();
    Ok(Plan {
        poses,
        rows,
        parameters,
        sigmas,
        quality,
        rejections,
        detectability,
        partings,
        field,
        clearance_mm: options.bounds.clearance_mm,
        space,
        geometry: options.geometry,
    })
}

/// Chosen poses, and the order of their rows.
struct OrderedChoice {
    poses: Vec<Candidate>,
    rows: Vec<Row>,
    quality: Quality,
    field: Option<FieldUncertainty>,
}

/// Chooses among candidates and orders them; `None` if no clear path is found between two of them. `roadmap`: paths around obstacles.
fn choose_and_order(
    setup: &MeasurementSetup<'_>,
    parameters: &[Parameter],
    candidates: &[Candidate],
    roadmap: Option<&Roadmap>,
    options: &Options,
) -> Result<Option<OrderedChoice>, PlanError> {
    let mut visits = options.visits.with_questions(&options.questions);
    if options.something_else.as_ref().is_some_and(SomethingElse::is_in_time) {
        visits.warm_up = visits.warm_up.max(options.field_poses);
    }
    // The rows of each candidate, with the columns of the questions' effects besides the geometry.
    let still = candidate::rows(candidates);
    let jacobian = rows::reading_jacobian(setup, parameters, &still, &options.questions, options);
    let design = Design { jacobian: &jacobian, index: options.index };
    let mut chosen = design.choose(options.poses).ok_or(PlanError::NotFinite)?;
    let known: Vec<Joints> = candidates.iter().map(|candidate| candidate.joints).collect();
    let field = match &options.something_else {
        Some(unexplained) if !unexplained.is_in_time() => {
            let design = FieldDesign::of(unexplained, &known).ok_or(PlanError::NotFinite)?;
            let added = design.choose(options.field_poses, &chosen);
            chosen.extend(&added);
            Some(uncertainty(&design, &chosen, known.len(), options.seed))
        }
        _ => None,
    };
    let geometry = ReadingJacobian {
        interest: Vec::new(),
        ..rows::reading_jacobian(setup, parameters, &still, &[], options)
    };
    let quality = quality(&geometry, &chosen, options).ok_or(PlanError::NotFinite)?;
    let poses: Vec<Candidate> = chosen.iter().map(|&i| candidates[i].clone()).collect();
    let ways = Connections { known: &known, roadmap };
    let ordered = schedule::schedule(setup, poses, &visits, &options.bounds, &ways, options.seed);
    Ok(ordered.map(|(poses, rows)| OrderedChoice { poses, rows, quality, field }))
}

/// The fitted parameters: links, then frames.
fn parameters(setup: &MeasurementSetup<'_>) -> Vec<Parameter> {
    let mut out = arm_parameters(setup.nominal);
    let mut empty = Dataset::new("plan", setup.sensor, Vec::new());
    if setup.sensor == Sensor::Cable {
        // One row of the last cable determines the number of cables.
        let anchor = setup.frames.outlets_mm.len() - 1;
        let mut row = blank_row(0, nalgebra::Vector6::zeros(), setup.sensor);
        row.anchor = anchor;
        empty.rows.push(row);
    }
    out.extend(frame_parameters(&empty));
    out
}

/// What is known of the field before, after the chosen poses, and after as many random ones.
fn uncertainty(design: &FieldDesign, chosen: &[usize], candidates: usize, seed: u64) -> FieldUncertainty {
    let mut random = ChaCha8Rng::seed_from_u64(seed ^ 0x0066_6965_6c64);
    let mut all: Vec<usize> = (0..candidates).collect();
    let drawn = (0..RANDOM_SETS).map(|_| {
        all.shuffle(&mut random);
        design.remaining_mm(&all[..chosen.len()])
    });
    let random_mm = drawn.sum::<f64>() / RANDOM_SETS as f64;
    let (before_mm, after_mm) = (design.remaining_mm(&[]), design.remaining_mm(chosen));
    let needed = (after_mm > TELLS * before_mm).then(|| design.needed(chosen.len(), before_mm));
    FieldUncertainty { before_mm, after_mm, random_mm, needed }
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
