//! Faults of joints that gravity loads and that do not yield in proportion: springs that are not linear, and play that the load closes.

use nalgebra::Vector6;

use super::extension::Subject;
use crate::identification::calibration::torques_under;
use crate::measurement::sensor::empirical::{AssumedLoad, EmpiricalFault};

/// Shares of the largest torque of the rows at which a joint that stiffens has yielded by half.
const BENDS: [f64; 2] = [0.1, 0.3];

/// Up to where powers of a torque count, as a share of the largest torque of the rows.
const BEYOND: f64 = 1.1;

/// Torque at which half of a play is closed, as a share of the largest: a step for the rows, and yet a slope that a solver can follow.
const CLOSED: f64 = 0.01;

/// Every load that is assumed of some joint.
const LOADS: [AssumedLoad; 5] = [
    AssumedLoad::Masses,
    AssumedLoad::Frame(2),
    AssumedLoad::Frame(4),
    AssumedLoad::Frame(6),
    AssumedLoad::ElbowAndWrist,
];

/// Loads that are assumed of a joint where masses are not known: at elbow, wrist or flange, and between elbow and wrist.
fn assumed_loads(joint: usize) -> &'static [AssumedLoad] {
    use AssumedLoad::{ElbowAndWrist, Frame};
    match joint {
        1 => &[Frame(2), Frame(4), Frame(6), ElbowAndWrist],
        2 => &[Frame(4), Frame(6)],
        _ => &[Frame(6)],
    }
}

/// The largest torque of the rows about each joint (N m), by load.
struct Largest(Vec<(AssumedLoad, Vector6<f64>)>);

impl Largest {
    fn of(subject: &Subject<'_>) -> Self {
        let largest = |load: AssumedLoad| {
            let torques = torques_under(&subject.observed.dataset, subject.nominal, load);
            torques.iter().fold(Vector6::zeros(), |largest: Vector6<f64>, t| largest.sup(&t.abs()))
        };
        Self(LOADS.map(|load| (load, largest(load))).to_vec())
    }

    /// A share of it (mN m), to two digits: one row more must not change a fault.
    fn share_mnm(&self, joint: usize, load: AssumedLoad, share: f64) -> u32 {
        let largest = self.0.iter().find(|(of, _)| *of == load).map_or(0.0, |(_, torque)| torque[joint]);
        let torque = (1e3 * share * largest).max(1.0);
        let unit = 10_f64.powf(torque.log10().floor() - 1.0).max(1.0);
        ((torque / unit).round() * unit) as u32
    }
}

/// The faults, with the number of variants of each, of joints that move by `moves`.
pub(super) fn faults(subject: &Subject<'_>, moves: &dyn Fn(usize) -> bool) -> Vec<(EmpiricalFault, f64)> {
    let known = subject.nominal.bodies.is_some();
    let torques = Largest::of(subject);
    // About an upright axis gravity has no torque: the first joint has a spring only in an arm that leans.
    let first = if known { AssumedLoad::Masses } else { AssumedLoad::Frame(6) };
    let largest_mnm = torques.share_mnm(0, first, BEYOND);
    let mut out = vec![(EmpiricalFault::NonlinearStiffness { joint: 0, load: first, largest_mnm }, 1.0)];
    for joint in (1..5).filter(|&joint| moves(joint)) {
        let loads = if known { &[AssumedLoad::Masses] } else { assumed_loads(joint) };
        out.extend(springs(&torques, joint, loads));
    }
    for joint in (1..5).filter(|&joint| moves(joint)) {
        out.extend(plays(&torques, joint, known));
    }
    out
}

/// Springs of a joint that are not linear.
fn springs(torques: &Largest, joint: usize, loads: &[AssumedLoad]) -> Vec<(EmpiricalFault, f64)> {
    let by_powers = loads.iter().map(|&load| {
        let largest_mnm = torques.share_mnm(joint, load, BEYOND);
        (EmpiricalFault::NonlinearStiffness { joint, load, largest_mnm }, loads.len() as f64)
    });
    let hardening = loads.iter().flat_map(|&load| {
        BENDS.map(|share| {
            let bend_mnm = torques.share_mnm(joint, load, share);
            (EmpiricalFault::Hardening { joint, load, bend_mnm }, (BENDS.len() * loads.len()) as f64)
        })
    });
    by_powers.chain(hardening).collect()
}

/// Play of a joint that its load closes. Where the centre of mass of what a joint carries is, is not known even where the masses are
/// stated, so that it is put at elbow, wrist or flange as well.
fn plays(torques: &Largest, joint: usize, known: bool) -> Vec<(EmpiricalFault, f64)> {
    let of_arm = known.then_some(AssumedLoad::Masses);
    let all: Vec<AssumedLoad> = assumed_loads(joint).iter().copied().chain(of_arm).collect();
    let play = |&load: &AssumedLoad| {
        let closed_mnm = torques.share_mnm(joint, load, CLOSED);
        (EmpiricalFault::LoadedPlay { joint, load, closed_mnm }, all.len() as f64)
    };
    all.iter().map(play).collect()
}
