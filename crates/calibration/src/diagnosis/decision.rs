//! Causes that cannot be told apart: their branch of the tree of causes, their shares, and the measurement that decides.
//!
//! The share of a member is its marginal likelihood over the sum of all: with b the finding's own 2 ln Bayes factor against a rival, the
//! rival's weight is exp(−b/2), the finding's 1 (Kass and Raftery 1995, equation 1, equal prior odds). Evidence is too sure where no
//! cause is quite right (Yang and Zhu 2018): where the best rival comes nearer once smooth unmodelled trends are allowed for, all rivals do by
//! as much.

use super::cause::Cause;
use super::cause_kind::CauseKind;
use super::finding::{Confidence, Family, Finding, Member};
use super::something_else::SomethingElse;
use crate::identification::calibration::Frames;
use crate::measurement::dataset::Sensor;

/// The file of a diagnosis in commands.
pub const DIAGNOSIS_FILE: &str = "DIAGNOSIS.json";

/// Share below which a rival is beaten and not listed.
const MIN_SHARE: f64 = 0.01;

/// Effects that poses, repeats, both sides of approach or visits over time decide: those that `plan` has questions for.
pub const DECIDED_BY_POSES: [CauseKind; 10] = [
    CauseKind::JointCompliance,
    CauseKind::LinkBending,
    CauseKind::GearEccentricity,
    CauseKind::GearRatio,
    CauseKind::JointCoupling,
    CauseKind::Backlash,
    CauseKind::ThermalDrift,
    CauseKind::SensorZeroShift,
    CauseKind::SensorFrameShift,
    CauseKind::ToolShift,
];

/// The branch of a kind; of a thermal drift the arm's; none for findings that merge several.
pub(super) fn family(effect: CauseKind) -> Option<Family> {
    use CauseKind::*;
    Some(match effect {
        LinkGeometry | LinkBending | LinkTwist | JointCompliance | JointStiffness | ThermalDrift
        | SmoothCorrection => Family::Arm,
        GearEccentricity | GearTransmission | GearRatio | GearTwoJoints | JointCoupling | JointZeroShift
        | Backlash | AxisWobble => Family::Drive,
        SensorScale | SensorAxes | SensorRange | LensDistortion | CableSag | CablePulley | CableDrum
        | CableReversal | AirRefraction | TargetNest | TargetDroop => Family::Sensor,
        SensorZeroShift | SensorFrameShift | ToolShift | BaseTilt | PayloadChange | SetupChange => {
            Family::SetUp
        }
        Latency | Unsettled | AngleRounding | ReadoutMismatch | Outliers => Family::Log,
        SmallDisturbances | Unexplained => return None,
    })
}

/// The branch of a cause.
pub(super) fn family_of(cause: &Cause) -> Family {
    match cause {
        // Its stand, not the arm, follows the temperature.
        Cause::Measurement(_) if cause.is_thermal() => Family::SetUp,
        Cause::Arm(_) => family(cause.kind()).unwrap_or(Family::Arm),
        Cause::Measurement(_) => family(cause.kind()).unwrap_or(Family::Sensor),
    }
}

/// The finding and those of its rivals that have a share, largest first; empty if none has.
pub fn members(finding: &Finding) -> Vec<Member> {
    let Some(own) = finding.family else { return Vec::new() };
    let mut out = vec![Member {
        effect: finding.effect,
        joints: finding.joints.clone(),
        rows: finding.rows,
        family: own,
        share: 0.0,
    }];
    let mut logs = vec![0.0];
    let least =
        finding.alternatives.iter().map(|rival| rival.twice_log_bayes_factor).fold(f64::INFINITY, f64::min);
    let nearer = finding.margin.map_or(0.0, |margin| (least - margin).max(0.0));
    for rival in &finding.alternatives {
        let same = |m: &Member| {
            (&m.effect, &m.joints, m.rows, m.family)
                == (&rival.effect, &rival.joints, rival.rows, rival.family)
        };
        // The same name twice is one member in two variants: the better one counts.
        let log = -0.5 * (rival.twice_log_bayes_factor - nearer);
        if let Some(place) = out.iter().position(same) {
            logs[place] = f64::max(logs[place], log);
            continue;
        }
        logs.push(log);
        out.push(Member {
            effect: rival.effect,
            joints: rival.joints.clone(),
            rows: rival.rows,
            family: rival.family,
            share: 0.0,
        });
    }
    let most = logs.iter().copied().fold(f64::NEG_INFINITY, f64::max);
    let total: f64 = logs.iter().map(|log| (log - most).exp()).sum();
    out.iter_mut().zip(&logs).for_each(|(member, log)| member.share = (log - most).exp() / total);
    let named = (out[0].effect, out[0].joints.clone(), out[0].family);
    let is_named = |m: &Member| (&m.effect, &m.joints, m.family) == (&named.0, &named.1, named.2);
    out.retain(|member| member.share >= MIN_SHARE || is_named(member));
    out.sort_by(|a, b| b.share.total_cmp(&a.share));
    let kept: f64 = out.iter().map(|member| member.share).sum();
    out.iter_mut().for_each(|member| member.share /= kept);
    if out.len() < 2 { Vec::new() } else { out }
}

/// The measurement that separates an effect from others where no plan of poses can, and what to look for in it.
fn in_words(effect: CauseKind) -> Option<&'static str> {
    use CauseKind::*;
    Some(match effect {
        SensorScale => {
            "measure a known length with the sensor (a scale bar): if it is read wrong, the sensor's scale is the cause"
        }
        SensorAxes => {
            "measure a known length (a scale bar) along each axis of the sensor: if the readings differ, its axes are not alike"
        }
        SensorRange => {
            "measure known lengths with the sensor at its least and greatest distance: what they are off by is the sensor's"
        }
        LensDistortion => {
            "measure the same ten poses with the camera turned by 90° about its axis, and again with the target near the middle of the picture: \
             what changes is the lens"
        }
        CableReversal => {
            "measure the same ten poses twice, once with the cable paying out to each and once winding in: what changes is the sensor"
        }
        CableSag | CablePulley | CableDrum => {
            "move the cable's outlet to another place and measure again (`diagnose --also`): what follows the cable and not the pose is the \
             sensor"
        }
        AirRefraction => {
            "measure the same ten poses at dawn and at noon, or from half the distance: what changes is the air"
        }
        TargetNest => {
            "measure the same ten poses with the reflector turned by 90° in its nest: what changes is the target"
        }
        TargetDroop => {
            "measure the same ten poses with the target on a shorter or stiffer pole, or straight on the flange: what changes is the pole"
        }
        BaseTilt => {
            "put a level or a dial gauge on the base and read it with the arm stretched out and folded: what changes is the pedestal"
        }
        JointStiffness => "measure the same ten poses with and without a load: what changes is the stiffness",
        PayloadChange => "weigh the tool, and measure the same ten poses with and without it",
        AxisWobble => {
            "turn this joint alone through its whole range, and read a target far from its axis and one near it at every ten degrees: what \
             leaves the plane of the circle twice a turn is the bearing"
        }
        LinkTwist => {
            "measure the same ten poses with and without a load beside the flange: what changes is the link, and not a bearing"
        }
        GearTwoJoints | GearTransmission => {
            "turn each joint in question alone through its whole range in steps of a few degrees, and read at each: what returns with the angle \
             is the gear"
        }
        Latency => "measure the same ten poses once at rest and once in motion: what changes is the clock",
        Unsettled => {
            "measure the same ten poses again with twice the wait before each reading: what changes had not settled"
        }
        _ => return None,
    })
}

/// What the sentence of a decision needs.
pub(super) struct DecisionQuestion<'a> {
    pub(super) robot: &'a str,
    pub(super) sensor: Sensor,
    pub(super) frames: &'a Frames,
    pub(super) something_else: Option<&'a SomethingElse>,
}

impl DecisionQuestion<'_> {
    /// Adds members and decisions to the findings, which are in their final order.
    pub(super) fn complete(&self, findings: &mut [Finding]) {
        let sure = findings.iter().filter(|finding| finding.confidence == Confidence::Identified);
        let identified: Vec<_> = sure.map(|f| (f.effect, f.joints.clone(), f.rows)).collect();
        for (k, finding) in findings.iter_mut().enumerate() {
            if finding.confidence == Confidence::Identified {
                continue;
            }
            // What has a finding of its own is no other name for this one.
            let mut open = finding.clone();
            open.alternatives.retain(|rival| {
                !identified.iter().any(|(effect, joints, rows)| {
                    (*effect, joints, *rows) == (rival.effect, &rival.joints, rival.rows)
                })
            });
            finding.members = members(&open);
            finding.decided_by = self.decision(finding, k + 1);
            if finding.effect == CauseKind::Unexplained
                && let Some(decision) = &finding.decided_by
            {
                finding.remedy = decision.clone();
            }
        }
    }

    fn decision(&self, finding: &Finding, number: usize) -> Option<String> {
        let plan = || self.command(number);
        if finding.effect == CauseKind::Unexplained {
            if let Some([joint]) = finding.joints.as_deref() {
                return Some(format!(
                    "read ten poses three times from one side and once from the other: `{}`; if a pose differs by the side from which joint \
                     {joint} comes, it is play (log the sides in the column approach{joint}); if it differs from time to time, the joint \
                     does not come to rest in one place",
                    plan()
                ));
            }
            let something = self.something_else?;
            return Some(if something.is_in_time() {
                format!("measure one pose ten times, spread over as long a time as before: `{}`", plan())
            } else {
                format!("measure the ten poses that show most about it: `{}`", plan())
            });
        }
        // Sums of small things and tables of sessions have no part to decide on.
        finding.family?;
        finding.non_centrality?;
        let own = [finding.likeliest().0];
        let named: Vec<CauseKind> = if finding.members.is_empty() {
            own.to_vec()
        } else {
            finding.members.iter().map(|member| member.effect).collect()
        };
        // What the finding itself asks for comes first, then a program of poses, then what its rivals ask for.
        let by_words =
            |effects: &[CauseKind]| effects.iter().find_map(|&effect| in_words(effect)).map(str::to_owned);
        let by_poses = || {
            let decided = named.iter().any(|effect| DECIDED_BY_POSES.contains(effect));
            decided.then(|| format!("measure the poses of `{}`", plan()))
        };
        by_words(&own).or_else(by_poses).or_else(|| by_words(&named))
    }

    /// The command line that plans the poses of a finding.
    fn command(&self, number: usize) -> String {
        let sensor = match self.sensor {
            Sensor::Cable => "cable",
            Sensor::Position => "position",
            Sensor::Pose => "pose",
        };
        let mut out = format!("truegrind plan --robot {} --sensor {sensor}", self.robot);
        if self.sensor == Sensor::Cable {
            for outlet in &self.frames.outlets_mm {
                out.push_str(&format!(" --outlet {:.0},{:.0},{:.0}", outlet.x, outlet.y, outlet.z));
            }
        }
        // A target beside the axis of joint 6 sees what one on it does not.
        let target = self.frames.flange_from_target.translation.vector.map(f64::round);
        if target.norm() > 0.0 {
            out.push_str(&format!(
                " --touched-point {},{},{}",
                target.x + 0.0,
                target.y + 0.0,
                target.z + 0.0
            ));
        }
        out.push_str(&format!(" --for {DIAGNOSIS_FILE} --finding {number} -o POSES.mod"));
        out
    }
}
