//! The marks of one run.

use crate::arms::Pose;
use crate::case::Case;
use crate::designs::Design;
use crate::sensors::Kind as Measures;
use crate::shape::{Distance, distance};
use crate::table::text;
use crate::truth::{Kind, Mark, Meaning, meanings};
use crate::under_test::{Finding, Fresh, Reply, Which, Written, diagnosed};

/// A finding with its mark.
#[derive(Debug, Clone, PartialEq)]
pub struct Marked {
    /// The finding.
    pub finding: Finding,
    /// What it says; a finding that says several things is listed once for each.
    pub says: Meaning,
    /// What it is worth.
    pub mark: Mark,
}

/// What a run was, without its rows.
#[derive(Debug, Clone, PartialEq)]
pub struct Setting {
    /// Kind of what was hidden.
    pub kind: Kind,
    /// Number of the run.
    pub run: u64,
    /// The arm.
    pub robot: &'static str,
    /// The sensor.
    pub measures: Measures,
    /// Its noise (mm).
    pub sigma_mm: f64,
    /// The design.
    pub design: Design,
    /// Rows.
    pub rows: usize,
    /// Worth of what was hidden, in standard deviations of the noise.
    pub worth: f64,
    /// Joints (from 1) that have it.
    pub joints: Vec<usize>,
}

/// The marks of a diagnosis.
#[derive(Debug, Clone, PartialEq)]
pub struct Marks {
    /// Findings.
    pub findings: Vec<Marked>,
    /// What becomes of the model.
    pub written: Written,
    /// Data sheet, geometry alone as the diagnosis and as `identify` have it, and the model file on clean fresh poses.
    pub distances: [Distance; 4],
    /// What the model file says of its shape on those poses (standard deviation, mm).
    pub shape_sigma_mm: Option<f64>,
    /// Held-out error of the report, random folds (mm).
    pub held_out_mm: f64,
    /// Held-out error of the report, blocks (mm).
    pub blocks_mm: f64,
    /// Held-out error of the report, regions of joint space (mm).
    pub regions_mm: f64,
    /// What fresh rows show of the extended model (mm).
    pub fresh_mm: f64,
    /// The probability that chance alone leaves the held-out error within 10 % of that.
    pub near_by_chance: f64,
    /// Geometry alone on fresh rows, and the extended model, over the noise.
    pub fresh_over_noise: [f64; 2],
    /// Time (s).
    pub seconds: f64,
}

/// A run that was judged.
#[derive(Debug, Clone, PartialEq)]
pub struct Outcome {
    /// What it was.
    pub setting: Setting,
    /// Its marks, or why there was no diagnosis.
    pub marks: Result<Marks, String>,
}

/// More than this above geometry alone is worse.
pub const WORSE: f64 = 1.05;

impl Marks {
    /// Findings told without a doubt that are false.
    pub fn false_names(&self) -> impl Iterator<Item = &Marked> {
        let wrong = |m: &&Marked| matches!(m.mark, Mark::WrongFamily | Mark::WrongJoint);
        self.findings.iter().filter(|m| m.finding.identified).filter(wrong)
    }

    /// Findings told without a doubt that are true.
    pub fn true_names(&self) -> usize {
        self.findings.iter().filter(|m| m.finding.identified && m.mark == Mark::True).count()
    }

    /// Findings told with a doubt, and how many of them are false.
    pub fn doubtful_names(&self) -> (usize, usize) {
        let doubtful = self.findings.iter().filter(|m| !m.finding.identified && m.mark != Mark::None);
        doubtful.fold((0, 0), |(all, wrong), m| (all + 1, wrong + usize::from(m.mark != Mark::True)))
    }

    /// Whether the true family is told with a joint that has it.
    pub fn told_with_joint(&self) -> bool {
        self.findings.iter().any(|m| m.mark == Mark::True && m.finding.joints.is_some())
    }

    /// Whether the true family is told, surely or not, and of a joint that has it where it tells one.
    pub fn told(&self) -> bool {
        self.findings.iter().any(|m| m.mark == Mark::True)
    }

    /// Whether the model file's arm has a worse shape than geometry alone as `identify` writes it.
    pub fn worse_than_identify(&self) -> bool {
        let [_, _, identified, model] = self.distances;
        model.shape > WORSE * identified.shape
    }

    /// Whether the model file's arm has a worse shape than geometry alone as the diagnosis has it, and whether it stands worse.
    pub fn worse(&self) -> [bool; 2] {
        let [_, geometry, _, model] = self.distances;
        [model.shape > WORSE * geometry.shape, model.as_is > WORSE * geometry.as_is]
    }
}

/// What a case is.
pub fn setting(case: &Case) -> Setting {
    Setting {
        kind: case.kind(),
        run: case.run,
        robot: case.sheet.name,
        measures: case.sensor.kind,
        sigma_mm: case.sensor.sigma_mm,
        design: case.walk.design,
        rows: case.walk.visits.len(),
        worth: case.worth,
        joints: case.hidden.truth.parts.joints.clone(),
    }
}

/// Diagnoses a case and marks what is said.
pub fn outcome(case: &Case) -> Outcome {
    let file = text(case.sensor.kind, &case.lines(), None);
    let marks = diagnosed(&file, case.sheet.name).and_then(|reply| marks(case, &reply));
    Outcome { setting: setting(case), marks }
}

/// Marks what is said of a case.
///
/// # Errors
/// Where fresh rows are refused that the import took before.
pub fn marks(case: &Case, reply: &Reply) -> Result<Marks, String> {
    let findings = reply.findings.iter().flat_map(|finding| {
        meanings(&finding.effect, &finding.parameters).into_iter().map(|says| {
            let mark = case.hidden.truth.mark(&finding.effect, says, finding.joints.as_deref());
            Marked { finding: finding.clone(), says, mark }
        })
    });
    let series = case.fresh().into_iter();
    let errors = series.map(|(visits, lines)| reply.errors(&text(case.sensor.kind, &lines, None), &visits));
    let fresh = Fresh::of(&errors.collect::<Result<Vec<_>, _>>()?);
    let noise_mm = case.sensor.sigma_mm * (case.sensor.lengths() as f64).sqrt();
    Ok(Marks {
        findings: findings.collect(),
        written: reply.written,
        distances: distances(case, reply),
        shape_sigma_mm: reply.shape_sigma_mm(&case.clean(), &case.sensor.target.translation.vector),
        held_out_mm: reply.held_out_mm,
        blocks_mm: reply.held_out_blocks_mm,
        regions_mm: reply.held_out_regions_mm,
        fresh_mm: fresh.extended_mm,
        near_by_chance: fresh.near_by_chance(),
        fresh_over_noise: [fresh.geometry_mm, fresh.extended_mm].map(|error| error / noise_mm),
        seconds: reply.seconds,
    })
}

fn distances(case: &Case, reply: &Reply) -> [Distance; 4] {
    let visits = case.clean();
    let truth: Vec<Pose> = visits.iter().map(|v| case.hidden.clean_flange(&case.arm, v)).collect();
    [Which::Sheet, Which::Geometry, Which::Identified, Which::Written].map(|which| {
        let model: Vec<Pose> = visits.iter().map(|v| reply.flange(which, v)).collect();
        distance(&truth, &model, &case.sensor.target.translation.vector)
    })
}
