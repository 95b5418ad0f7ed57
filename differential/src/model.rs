//! Random arms: what the makers say, and how the arm in the cell departs from it, for the test's own kinematics and as
//! the model file that truegrind reads.

use std::f64::consts::{FRAC_PI_2, PI};
use std::fmt::Write;

use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;

use crate::arm::{Arm, Link, Mass, Wobble};
use crate::joint_map::JointMap;

/// A robot of the test.
struct Sheet {
    name: &'static str,
    /// a1, d1, a2, a3, d4, d6 (mm).
    lengths: [f64; 6],
    min_deg: [f64; 6],
    max_deg: [f64; 6],
    masses: Option<[Mass; 6]>,
}

/// Data sheets of three arms.
fn sheets() -> [Sheet; 3] {
    let mass = |kg, centre| Mass { kg, centre };
    [
        Sheet {
            name: "abb-irb-120",
            lengths: [0.0, 290.0, 270.0, 70.0, 302.0, 72.0],
            min_deg: [-165.0, -110.0, -110.0, -160.0, -120.0, -400.0],
            max_deg: [165.0, 110.0, 70.0, 160.0, 120.0, 400.0],
            masses: Some([
                mass(3.067, [0.0977, 51.59, -0.12]),
                mass(3.909, [-168.76, 0.78, -2.12]),
                mass(2.944, [-12.09, -1.06, 22.81]),
                mass(1.328, [0.41, -77.3, 0.15]),
                mass(0.546, [0.0622, -0.0368, -1.09]),
                mass(0.137, [0.0013, -0.17, -7.06]),
            ]),
        },
        Sheet {
            name: "abb-irb-2600-12-1.85",
            lengths: [150.0, 445.0, 900.0, 115.0, 795.0, 85.0],
            min_deg: [-180.0, -95.0, -180.0, -400.0, -120.0, -400.0],
            max_deg: [180.0, 155.0, 75.0, 400.0, 120.0, 400.0],
            masses: None,
        },
        Sheet {
            name: "abb-irb-4600-40-2.55",
            lengths: [175.0, 495.0, 1095.0, 175.0, 1270.0, 135.0],
            min_deg: [-180.0, -90.0, -180.0, -400.0, -125.0, -400.0],
            max_deg: [180.0, 150.0, 75.0, 400.0, 120.0, 400.0],
            masses: None,
        },
    ]
}

/// Where NC programs begin, about the axes (rad).
pub const START: [f64; 6] = [0.8, 0.3, 0.2, 0.0, 1.0, 0.8];

/// An arm with its model file.
#[derive(Debug, Clone)]
pub struct Case {
    /// The arm, as told and as it is.
    pub arm: Arm,
    /// What truegrind knows of it.
    pub model_toml: String,
    /// The name of the arm in truegrind's catalogue.
    pub robot: &'static str,
    /// What a cell file says of where the arm starts; nothing for an arm whose joints are counted plainly.
    pub start_toml: String,
    /// Whether joints have play.
    pub play: bool,
    /// Whether joints yield under load.
    pub load: bool,
    /// Whether a cut of which one motion stays is left as a whole, as programs are run; otherwise each motion is judged by
    /// itself, which leaves less and so tries more of the analysis.
    pub whole_cuts: bool,
}

/// A random arm.
pub fn random(seed: u64) -> Case {
    let mut rng = ChaCha8Rng::seed_from_u64(seed ^ 0x61726d);
    let play = rng.random_bool(0.4);
    let load = rng.random_bool(0.4);
    made(&mut rng, play, load, JointMap::PLAIN, |arm| arm)
}

/// The same arm on a soft base, half of the time, with an axis that wobbles.
pub fn loose(seed: u64) -> Case {
    let mut own = ChaCha8Rng::seed_from_u64(seed ^ 0x6c_6f6f_7365);
    let soft_base = if own.random_bool(0.5) { own.random_range(0.1..1.0) * 1e-6 } else { 0.0 };
    let joint = own.random_range(0..6);
    let tilt = std::array::from_fn(|_| own.random_range(-1.0..1.0) * 2e-4);
    let mut rng = ChaCha8Rng::seed_from_u64(seed ^ 0x61726d);
    let play = rng.random_bool(0.4);
    let load = rng.random_bool(0.4);
    let wobble = Some(Wobble { joint, tilt });
    made(&mut rng, play, load, JointMap::PLAIN, |arm| Arm { soft_base, wobble, ..arm })
}

/// The same arm with a controller that counts some joints the other way round, and half of the time the third from the horizontal.
pub fn mapped(seed: u64) -> Case {
    let mut rng = ChaCha8Rng::seed_from_u64(seed ^ 0x6d_6170);
    let sign = std::array::from_fn(|_| if rng.random_bool(0.5) { 1.0 } else { -1.0 });
    let coupling = [0.0, 0.0, -1.0, 1.0][rng.random_range(0..4)];
    let mut rng = ChaCha8Rng::seed_from_u64(seed ^ 0x61726d);
    let play = rng.random_bool(0.4);
    let load = rng.random_bool(0.4);
    made(&mut rng, play, load, JointMap { sign, coupling }, |arm| arm)
}

/// A random arm, with or without play and load.
pub fn with(seed: u64, play: bool, load: bool) -> Case {
    made(&mut ChaCha8Rng::seed_from_u64(seed ^ 0x61726d), play, load, JointMap::PLAIN, |arm| arm)
}

fn made(rng: &mut ChaCha8Rng, play: bool, load: bool, map: JointMap, loosened: impl Fn(Arm) -> Arm) -> Case {
    let mut all = sheets();
    let sheet = &mut all[rng.random_range(0..3)];
    let elbow = [sheet.min_deg[2], sheet.max_deg[2]].map(f64::to_radians);
    [sheet.min_deg, sheet.max_deg] = map.counted_range(&sheet.min_deg, &sheet.max_deg);
    let [a1, d1, a2, a3, d4, d6] = sheet.lengths;
    let link = |a, d, alpha, theta| Link { a, d, alpha, theta, beta: 0.0 };
    let nominal = [
        link(a1, d1, -FRAC_PI_2, 0.0),
        link(a2, 0.0, 0.0, -FRAC_PI_2),
        link(a3, 0.0, -FRAC_PI_2, 0.0),
        link(0.0, d4, FRAC_PI_2, 0.0),
        link(0.0, 0.0, -FRAC_PI_2, 0.0),
        link(0.0, d6, 0.0, PI),
    ];
    // As large as arms are wrong: tenths of a millimetre and of a degree.
    let size = rng.random_range(0.2..1.0);
    let mut off = |most: f64| rng.random_range(-1.0..1.0) * most * size;
    let actual = std::array::from_fn(|j| {
        let told: Link = nominal[j];
        // Two parallel axes have no common d: the second twist takes its place.
        let (d, beta) = if j == 1 { (0.0, off(1.5e-3)) } else { (off(0.6), 0.0) };
        Link {
            a: told.a + off(0.6),
            d: told.d + d,
            alpha: told.alpha + off(1.5e-3),
            theta: told.theta + off(1.5e-3),
            beta,
        }
    });
    let mut joints = |on: bool, most: f64| {
        std::array::from_fn(
            |_| if on && rng.random_bool(0.6) { rng.random_range(0.1..1.0) * most } else { 0.0 },
        )
    };
    // The larger the arm the stiffer its joints.
    let stiff = (a2 / 270.0).powi(3);
    let arm = Arm {
        nominal,
        actual,
        map,
        min: sheet.min_deg.map(f64::to_radians),
        max: sheet.max_deg.map(f64::to_radians),
        elbow,
        masses: sheet.masses.take(),
        compliance: joints(load, 1e-4 / stiff),
        play: joints(play, 8e-4),
        soft_base: 0.0,
        wobble: None,
    };
    let arm = loosened(arm);
    let model_toml = toml(&arm, sheet);
    let whole_cuts = rng.random_bool(0.25);
    let start_toml = match map == JointMap::PLAIN {
        true => String::new(),
        false => format!("start_deg = {:?}\n", map.counted(&START).map(f64::to_degrees)),
    };
    Case { arm, model_toml, robot: sheet.name, start_toml, play, load, whole_cuts }
}

/// The model file.
fn toml(arm: &Arm, sheet: &Sheet) -> String {
    let errors =
        "count = 100\nrmse = 0.1\nmean_absolute = 0.1\nmean = 0.1\nstandard_deviation = 0.01\nmax = 0.2\n";
    let mut out = format!(
        "schema = \"truegrind.model/1\"\nrobot = \"{}\"\n\n[provenance]\nfile = \"none\"\nsha256 = \"{}\"\nrows = 200\n\
         set_aside = []\nsensor = \"position\"\nmethod = \"lm\"\nseed = 0\nheld_out = 0.2\nsharpened = false\nversion = \
         \"0.1.0\"\n\n[verdict]\nstatus = \"pass\"\nreasons = [\"made for a test\"]\n\n[condition]\npayload_centre_mm = \
         [0.0, 0.0, 0.0]\napproach = [0, 0, 0, 0, 0, 0]\n",
        sheet.name,
        "0".repeat(64)
    );
    for stage in ["registered.fitted", "registered.held_out"] {
        let _ = write!(out, "\n[{stage}]\n{}", errors.replace("0.1", "1.1").replace("0.2", "2.2"));
    }
    for stage in ["geometry.fitted", "geometry.held_out"] {
        let _ = write!(out, "\n[{stage}]\n{errors}");
    }
    let _ = write!(
        out,
        "\n[region]\nmin_deg = {:?}\nmax_deg = {:?}\nsamples_deg = [[0.0, 0.0, 0.0, 0.0, 0.0, 0.0]]\nspacing_deg = 720.0\n\
         sigma_mm = 0.1\n",
        sheet.min_deg, sheet.max_deg
    );
    for (name, links) in [("nominal", &arm.nominal), ("estimated", &arm.actual)] {
        chain(&mut out, name, links, arm, sheet);
    }
    for joint in 0..6 {
        if arm.compliance[joint] != 0.0 {
            let _ = write!(
                out,
                "\n[[estimated.effect]]\neffect = \"joint-compliance\"\njoint = {joint}\ncompliance_rad_per_nm = {:?}\n",
                arm.compliance[joint]
            );
        }
        if arm.play[joint] != 0.0 {
            let _ = write!(
                out,
                "\n[[estimated.effect]]\neffect = \"backlash\"\njoint = {joint}\nplay_rad = {:?}\n",
                arm.play[joint]
            );
        }
    }
    if arm.soft_base != 0.0 {
        let _ = write!(
            out,
            "\n[[estimated.effect]]\neffect = \"base-tilt\"\nterm = [{{ tilt_rad_per_nm = {:?} }}]\n",
            arm.soft_base
        );
    }
    if let Some(Wobble { joint, tilt }) = arm.wobble {
        let _ = write!(
            out,
            "\n[[estimated.effect]]\neffect = \"axis-wobble\"\njoint = {joint}\ntilt_rad = {tilt:?}\n"
        );
    }
    parameters(&mut out, arm);
    out
}

/// The estimated links as parameters that are known exactly.
fn parameters(out: &mut String, arm: &Arm) {
    let coordinates = |link: &Link, joint: usize| {
        let second = if joint == 1 { ("beta", "rad", link.beta) } else { ("d", "mm", link.d) };
        [("a", "mm", link.a), second, ("alpha", "rad", link.alpha), ("theta", "rad", link.theta)]
    };
    let (mut order, mut lower, mut list) = (Vec::new(), Vec::new(), String::new());
    for (joint, (nominal, actual)) in arm.nominal.iter().zip(&arm.actual).enumerate() {
        let both = coordinates(nominal, joint).into_iter().zip(coordinates(actual, joint));
        for ((coordinate, unit, nominal), (_, _, value)) in both {
            let name = format!("link{}.{coordinate}", joint + 1);
            let _ = write!(
                list,
                "\n[[parameter]]\nname = \"{name}\"\nunit = \"{unit}\"\nnominal = {nominal:?}\nvalue = {value:?}\nsigma = 1e-9\n\
                 prior_sigma = 1.0\ndetermined = 1.0\n"
            );
            let mut row = vec![0.0; order.len()];
            row.push(1e-18);
            lower.push(row);
            order.push(name);
        }
    }
    let _ = write!(out, "\n[covariance]\norder = {order:?}\nlower = {lower:?}\n{list}");
}

fn chain(out: &mut String, name: &str, links: &[Link; 6], arm: &Arm, sheet: &Sheet) {
    let rows = arm.map.rows().map(|row| format!("{row:?}"));
    let _ = write!(
        out,
        "\n[{name}]\njoint_map = [{}]\nmin_deg = {:?}\nmax_deg = {:?}\ngravity = [0.0, 0.0, -1.0]\nflange_mm = [0.0, 0.0, \
         0.0]\nflange_wxyz = [1.0, 0.0, 0.0, 0.0]\n",
        rows.join(", "),
        sheet.min_deg,
        sheet.max_deg
    );
    if arm.map.coupling != 0.0 {
        let (sign, elbow) = (arm.map.sign[2], arm.elbow.map(f64::to_degrees));
        let _ = writeln!(
            out,
            "sum = [{{ of = [0.0, {:?}, {sign:?}, 0.0, 0.0, 0.0], min_deg = {:?}, max_deg = {:?} }}]",
            arm.map.coupling, elbow[0], elbow[1]
        );
    }
    for (j, link) in links.iter().enumerate() {
        let _ = write!(
            out,
            "\n[[{name}.link]]\nmodel = \"{}\"\na_mm = {:?}\nd_mm = {:?}\nalpha_deg = {:?}\ntheta_deg = {:?}\nbeta_deg = \
             {:?}\n",
            if j == 1 { "hayati" } else { "dh" },
            link.a,
            link.d,
            link.alpha.to_degrees(),
            link.theta.to_degrees(),
            link.beta.to_degrees()
        );
    }
    for mass in arm.masses.iter().flatten() {
        let _ = write!(out, "\n[[{name}.body]]\nmass_kg = {:?}\ncentre_mm = {:?}\n", mass.kg, mass.centre);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::arm::{Circumstance, difference};

    /// The closed form finds again the joints it came from, on every arm.
    #[test]
    fn inverse_finds_the_joints_again() {
        let mut rng = ChaCha8Rng::seed_from_u64(1);
        for seed in 0..600 {
            let arm = if seed < 300 { random(seed) } else { mapped(seed) }.arm;
            let q: [f64; 6] = std::array::from_fn(|j| rng.random_range(arm.min[j]..arm.max[j]));
            let mut axes = arm.map.axes(&q);
            axes[2] = rng.random_range(arm.elbow[0]..arm.elbow[1]);
            let q = arm.map.counted(&axes);
            let flange = arm.nominal_forward(&q);
            let all = arm.nominal_inverse(&flange, Some(&q));
            assert!(all.iter().all(|q| difference(&arm.nominal_forward(q), &flange).0 < 1e-8));
            let found = all.first().expect("a solution");
            assert!((0..6).all(|j| (found[j] - q[j]).abs() < 1e-6), "{seed} {q:?} {found:?}");
            assert_eq!(arm.configuration(found), arm.configuration(&q));
        }
    }

    /// Each configuration names one solution only.
    #[test]
    fn configurations_tell_solutions_apart() {
        let arm = with(3, false, false).arm;
        let flange = arm.nominal_forward(&[0.3, 0.2, 0.1, 0.4, 0.8, -0.5]);
        let all = arm.nominal_inverse(&flange, None);
        assert!(all.len() >= 4);
        for (i, a) in all.iter().enumerate() {
            for b in &all[i + 1..] {
                assert_ne!(arm.configuration(a), arm.configuration(b));
            }
        }
    }

    /// The actual arm's inverse leads back, with play and load.
    #[test]
    fn actual_inverse_leads_back() {
        let case = with(5, true, true);
        let at = Circumstance {
            behind: [1.0, -1.0, 0.0, 0.5, -1.0, 1.0].map(|share| share * 4e-4),
            payload_kg: 2.0,
            payload_centre_mm: [0.0, 10.0, 50.0],
        };
        let q = [0.3, 0.2, 0.1, 0.4, 0.8, -0.5];
        let flange = case.arm.actual_forward(&q, &at);
        let found =
            case.arm.actual_inverse(&flange, &[0.31, 0.21, 0.1, 0.41, 0.79, -0.5], &at).expect("joints");
        assert!((0..6).all(|j| (found[j] - q[j]).abs() < 1e-9));
    }
}
