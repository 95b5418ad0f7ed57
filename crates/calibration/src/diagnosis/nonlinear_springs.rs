//! Faults of joints that gravity loads and that do not yield in proportion: springs that are not linear, and play that the load closes.

use nalgebra::Vector6;

use super::extension::Subject;
use crate::identification::calibration::torques_under;
use crate::measurement::sensor::empirical::{AssumedLoad, EmpiricalFault};

/// Shares of the largest torque of the rows at which a joint that stiffens has yielded by half.
const BENDS: [f64; 2] = [0.1, 0.3];

/// Up to where powers of a torque count, as a share of the largest torque of the rows.
const BEYOND: f64 = 1.1;

/// Friction of a play that the load closes, as a share of that torque.
const FRICTIONS: [f64; 3] = [0.0, 0.12, 0.28];

/// Torque over which it closes, as a share of that torque.
const CLOSING: f64 = 0.02;

/// Every load that is assumed of some joint.
const LOADS: [AssumedLoad; 5] = [
    AssumedLoad::Masses,
    AssumedLoad::Frame(2),
    AssumedLoad::Frame(4),
    AssumedLoad::Frame(6),
    AssumedLoad::ELBOW_AND_WRIST,
];

/// Loads that are assumed of a joint where masses are not known: at elbow, wrist or flange, and between elbow and wrist.
fn assumed_loads(joint: usize) -> &'static [AssumedLoad] {
    use AssumedLoad::Frame;
    match joint {
        1 => &[Frame(2), Frame(4), Frame(6), AssumedLoad::ELBOW_AND_WRIST],
        2 => &[Frame(4), Frame(6)],
        _ => &[Frame(6)],
    }
}

/// The largest torque of the rows about each joint (N m), by load.
struct Largest(Vec<(AssumedLoad, Vector6<f64>)>);

impl Largest {
    fn of(subject: &Subject<'_>, loads: &[AssumedLoad]) -> Self {
        let largest = |load: AssumedLoad| {
            let torques = torques_under(&subject.observed.dataset, subject.nominal, load);
            torques.iter().fold(Vector6::zeros(), |largest: Vector6<f64>, t| largest.sup(&t.abs()))
        };
        Self(loads.iter().map(|&load| (load, largest(load))).collect())
    }

    fn of_load(&self, joint: usize, load: AssumedLoad) -> f64 {
        self.0.iter().find(|(of, _)| *of == load).map_or(0.0, |(_, torque)| torque[joint])
    }

    /// A share of it (mN m).
    fn share_mnm(&self, joint: usize, load: AssumedLoad, share: f64) -> u32 {
        two_digits_mnm(share * self.of_load(joint, load))
    }
}

/// A torque (N m) in mN m, to two digits: one row more must not change a fault.
fn two_digits_mnm(torque_nm: f64) -> u32 {
    let torque = (1e3 * torque_nm).max(1.0);
    let unit = 10_f64.powf(torque.log10().floor() - 1.0).max(1.0);
    ((torque / unit).round() * unit) as u32
}

/// The faults, with the number of variants of each, of joints that move by `moves` and that come from both sides by `sided`.
pub(super) fn faults(
    subject: &Subject<'_>,
    moves: &dyn Fn(usize) -> bool,
    sided: &[bool; 6],
) -> Vec<(EmpiricalFault, f64)> {
    let known = subject.nominal.bodies.is_some();
    let torques = Largest::of(subject, &LOADS);
    // About an upright axis gravity has no torque: the first joint has a spring only in an arm that leans.
    let first = if known { AssumedLoad::Masses } else { AssumedLoad::Frame(6) };
    let largest_mnm = torques.share_mnm(0, first, BEYOND);
    let mut out = vec![(EmpiricalFault::NonlinearStiffness { joint: 0, load: first, largest_mnm }, 1.0)];
    for joint in (1..5).filter(|&joint| moves(joint)) {
        let loads = if known { &[AssumedLoad::Masses] } else { assumed_loads(joint) };
        out.extend(springs(&torques, joint, loads));
    }
    for joint in (1..5).filter(|&joint| moves(joint)) {
        out.extend(plays(&torques, joint, known, sided[joint]));
    }
    out
}

/// Faults with other constants than one that was found: its friction, from none to half of the largest torque and close to its own, under
/// its load and, roughly, under others; or the torque at which it has yielded by half.
pub(super) fn variants(fault: EmpiricalFault, subject: &Subject<'_>) -> Vec<EmpiricalFault> {
    use EmpiricalFault::{Hardening, LoadedPlay};
    match fault {
        LoadedPlay { joint, load, friction_mnm, closing_mnm } if friction_mnm > 0 => {
            let steps = f64::from(friction_mnm) / f64::from(closing_mnm);
            let play = |load: AssumedLoad, closing_mnm: u32, steps: f64| {
                let friction_mnm = (steps.max(0.0) * f64::from(closing_mnm)).round() as u32;
                LoadedPlay { joint, load, friction_mnm, closing_mnm }
            };
            let even = (0..=24).map(f64::from);
            let near = [-0.75, -0.5, -0.25, 0.25, 0.5, 0.75].map(|k| steps + k);
            let own = even.chain(near).map(|steps| play(load, closing_mnm, steps));
            let others = other_loads(joint, subject).into_iter().filter(|&(other, _)| other != load);
            let under =
                others.flat_map(|(other, closing)| [-3.0, 0.0, 3.0].map(|k| play(other, closing, steps + k)));
            own.chain(under).collect()
        }
        Hardening { joint, load, bend_mnm } => {
            let bend =
                |k: i32| (f64::from(bend_mnm) * 2_f64.powf(f64::from(k) / 4.0)).round().max(1.0) as u32;
            [-6, -4, -3, -2, -1, 1, 2, 3, 4, 6].map(|k| Hardening { joint, load, bend_mnm: bend(k) }).to_vec()
        }
        _ => Vec::new(),
    }
}

/// Loads that a joint may have, with the torque (mN m) over which a play closes under them: the arm's masses, a mass at one frame, and one that
/// is divided between two, since the centre of mass of what a joint carries is somewhere between.
fn other_loads(joint: usize, subject: &Subject<'_>) -> Vec<(AssumedLoad, u32)> {
    let frames: Vec<u8> = (joint as u8 + 1..=6).collect();
    let masses = subject.nominal.bodies.is_some().then_some(AssumedLoad::Masses);
    let whole: Vec<AssumedLoad> =
        frames.iter().map(|&frame| AssumedLoad::Frame(frame)).chain(masses).collect();
    let torques = Largest::of(subject, &whole);
    let of = |load| CLOSING * torques.of_load(joint, load);
    let mut out: Vec<(AssumedLoad, u32)> =
        whole.iter().map(|&load| (load, two_digits_mnm(of(load)))).collect();
    for (k, &near) in frames.iter().enumerate() {
        for &far in &frames[k + 1..] {
            out.extend([15_u8, 30, 45, 60, 75, 90].map(|far_percent| {
                let share = 0.01 * f64::from(far_percent);
                let closing =
                    (1.0 - share) * of(AssumedLoad::Frame(near)) + share * of(AssumedLoad::Frame(far));
                (AssumedLoad::Between { near, far, far_percent }, two_digits_mnm(closing))
            }));
        }
    }
    // A frame on the axis has no torque.
    out.retain(|(_, closing)| *closing > 1);
    out
}

/// Whether two faults differ in such constants, or in the load, alone.
pub(super) fn is_one_law(one: EmpiricalFault, other: EmpiricalFault) -> bool {
    use EmpiricalFault::{Hardening, LoadedPlay};
    match (one, other) {
        (LoadedPlay { joint: a, .. }, LoadedPlay { joint: b, .. })
        | (Hardening { joint: a, .. }, Hardening { joint: b, .. }) => a == b,
        _ => false,
    }
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
fn plays(torques: &Largest, joint: usize, known: bool, sided: bool) -> Vec<(EmpiricalFault, f64)> {
    let of_arm = known.then_some(AssumedLoad::Masses);
    let all: Vec<AssumedLoad> = assumed_loads(joint).iter().copied().chain(of_arm).collect();
    // Where the sides of approach are not known, what friction holds is not seen.
    let frictions = &FRICTIONS[..if sided { FRICTIONS.len() } else { 1 }];
    let variants = (frictions.len() * all.len()) as f64;
    let play = |&load: &AssumedLoad| {
        frictions.iter().map(move |&share| {
            let friction_mnm = if share > 0.0 { torques.share_mnm(joint, load, share) } else { 0 };
            let closing_mnm = torques.share_mnm(joint, load, CLOSING);
            (EmpiricalFault::LoadedPlay { joint, load, friction_mnm, closing_mnm }, variants)
        })
    };
    all.iter().flat_map(play).collect()
}
