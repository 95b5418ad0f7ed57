//! A scoring simulator that shares no physics with truegrind: its own link transforms, its own gravity by differences of
//! the potential energy, its own gears, and what the estimator does not have: heavy tails, noise that depends on the
//! pose, a second small effect, masses other than the data sheet's.

use nalgebra::{Matrix4, Vector3, Vector4};
use rand::RngExt;
use rand_chacha::ChaCha8Rng;
use rand_chacha::rand_core::SeedableRng;
use rand_distr::{Distribution, StandardNormal, StudentT};

use truegrind_arm::condition::Condition;
use truegrind_arm::model::{Joints, Model};
use truegrind_calibration::measurement::dataset::{Dataset, Reading, Row, Sensor};

/// A hidden effect, joints from 0, rows by index.
#[derive(Debug, Clone, PartialEq)]
pub enum Hidden {
    Compliance {
        joint: usize,
        peak_rad: f64,
    },
    Gear {
        joint: usize,
        order: f64,
        peak_rad: f64,
        phase: f64,
    },
    Ratio {
        joint: usize,
        error: f64,
    },
    Coupling {
        driver: usize,
        joint: usize,
        factor: f64,
    },
    Backlash {
        joint: usize,
        play_rad: f64,
    },
    /// Play that gravity closes at about this torque: at almost none a flank, at much a spring that stiffens.
    LoadedPlay {
        joint: usize,
        play_rad: f64,
        closed_nm: f64,
        /// Below this torque friction holds the link on the flank of its side of approach.
        friction_nm: f64,
    },
    /// The link from this joint to the next bends like a beam; its end sags by this where it sags most.
    Bending {
        joint: usize,
        mm: f64,
    },
    /// The end of the link from this joint to the next tilts under the moment of what stands beside its plane, about no axis more than about
    /// another: by this where it tilts most.
    Twist {
        joint: usize,
        peak_rad: f64,
    },
    /// A joint of the wrist yields under a tool of 4 kg that stands beside the axis of the flange by these (mm): by this where it yields most.
    SideTool {
        joint: usize,
        peak_rad: f64,
        aside_mm: [f64; 2],
    },
    /// A joint stands off by this in all rows up to one.
    LostCounts {
        joint: usize,
        until: usize,
        rad: f64,
    },
    /// The third axis of the sensor reads too long by this share.
    Depth {
        share: f64,
    },
    /// The target hangs down from the end of its pole, which stands on the flange, by this where the pole is level.
    Droop {
        mm: f64,
    },
    /// The pedestal tilts by this for each N m that overturns it.
    Tilt {
        rad_per_nm: f64,
    },
    /// The axis of a joint tilts by this, about a direction that turns twice while the joint turns once.
    Wobble {
        joint: usize,
        peak_rad: f64,
        /// Of the joint, where the tilt is about x.
        phase: f64,
    },
    /// A tracker reads distances too long by this.
    Range {
        mm: f64,
    },
    Thermal {
        growth: f64,
        time_constant_h: f64,
    },
    Zero {
        from: usize,
        to: usize,
        mm: f64,
    },
    Frame {
        from: usize,
        to: usize,
        mm: [f64; 3],
    },
    Tool {
        from: usize,
        to: usize,
        mm: [f64; 3],
    },
    Outliers {
        list: Vec<usize>,
        mm: f64,
    },
    /// The sensor's stand or outlet creeps while the hall warms up.
    Drift {
        mm: [f64; 3],
        time_constant_h: f64,
    },
    /// The target creeps on the flange.
    Creep {
        mm: [f64; 3],
        time_constant_h: f64,
    },
    /// Links grow with the logged temperature.
    Warm {
        growth_per_k: f64,
    },
    /// A sensor that reads too long, in all rows or, as a second one does, in some.
    Scale {
        rows: Option<[usize; 2]>,
        factor: f64,
    },
    /// A cable sensor that reads longer by this where the cable has paid out.
    Reversal {
        mm: f64,
    },
    /// A camera 2.2 m above the arm that looks down: positions 45° beside its axis are read further from it by this share.
    Lens {
        share: f64,
    },
    /// A slack cable: weight per length over tension, squared (1/m²).
    Sag {
        square_per_m2: f64,
    },
    /// A mass at the flange that nobody logged, on joints 2 and 3 that yield.
    Payload {
        from: usize,
        to: usize,
        kg: f64,
    },
    /// A smooth push of the touched point that depends on where it is: nothing in the catalogue.
    Warp {
        mm: f64,
    },
}

/// Compliance of joints 2 and 3 of an arm whose payload changes (rad/(N m)).
pub const YIELDING: f64 = 2.0e-5;

impl Hidden {
    /// The contract's name.
    pub fn name(&self) -> &'static str {
        match self {
            Hidden::Compliance { .. } | Hidden::SideTool { .. } => "joint-compliance",
            Hidden::Bending { .. } => "link-bending",
            Hidden::Twist { .. } => "link-twist",
            Hidden::LostCounts { .. } => "joint-zero-shift",
            Hidden::Range { .. } => "sensor-range",
            Hidden::Droop { .. } => "target-droop",
            Hidden::Tilt { .. } => "base-tilt",
            Hidden::Wobble { .. } => "axis-wobble",
            Hidden::Depth { .. } => "sensor-axes",
            Hidden::Gear { order, .. } if *order <= 2.0 => "gear-eccentricity",
            Hidden::Gear { .. } => "gear-transmission",
            Hidden::Ratio { .. } => "gear-ratio",
            Hidden::Coupling { .. } => "joint-coupling",
            Hidden::Backlash { .. } | Hidden::LoadedPlay { .. } => "backlash",
            Hidden::Thermal { .. } => "thermal-drift",
            Hidden::Zero { .. } => "sensor-zero-shift",
            Hidden::Frame { .. } => "sensor-frame-shift",
            Hidden::Tool { .. } | Hidden::Creep { .. } => "tool-shift",
            Hidden::Outliers { .. } => "outliers",
            Hidden::Drift { .. } | Hidden::Warm { .. } => "thermal-drift",
            Hidden::Scale { .. } => "sensor-scale",
            Hidden::Sag { .. } => "cable-sag",
            Hidden::Reversal { .. } => "cable-reversal",
            Hidden::Lens { .. } => "lens-distortion",
            Hidden::Payload { .. } => "payload-change",
            Hidden::Warp { .. } => "unexplained",
        }
    }

    /// Joints from 1 that a finding must name.
    pub fn joints(&self) -> Option<Vec<usize>> {
        match self {
            Hidden::Compliance { joint, .. }
            | Hidden::Twist { joint, .. }
            | Hidden::SideTool { joint, .. }
            | Hidden::Bending { joint, .. }
            | Hidden::LostCounts { joint, .. }
            | Hidden::Gear { joint, .. }
            | Hidden::Ratio { joint, .. }
            | Hidden::Backlash { joint, .. }
            | Hidden::Wobble { joint, .. }
            | Hidden::LoadedPlay { joint, .. } => Some(vec![joint + 1]),
            Hidden::Coupling { driver, joint, .. } => Some(vec![driver + 1, joint + 1]),
            _ => None,
        }
    }

    /// Rows that a finding must name.
    pub fn rows(&self) -> Option<[usize; 2]> {
        match self {
            Hidden::Zero { from, to, .. }
            | Hidden::Frame { from, to, .. }
            | Hidden::Tool { from, to, .. }
            | Hidden::Payload { from, to, .. } => Some([*from, *to]),
            Hidden::Scale { rows, .. } => *rows,
            _ => None,
        }
    }
}

/// How an arm is measured.
#[derive(Debug, Clone)]
pub struct Setup {
    pub sensor: Sensor,
    pub rows: usize,
    pub sigma_mm: f64,
    /// Heavy tails, noise by pose, a second small effect.
    pub dirty: bool,
    pub seed: u64,
    /// What is logged beside the angles, and how.
    pub log: Log,
}

/// What a log holds.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Log {
    /// Approach sides in columns of their own; without them they follow from the order of the rows.
    pub sides: bool,
    /// Times.
    pub clock: bool,
    /// Temperatures, that rise by some kelvin and waver.
    pub thermometer: bool,
    /// Angles rounded to this (rad), with the controller's read-out beside them.
    pub angle_step_rad: Option<f64>,
    /// Gravity leans by this about the base's y axis, and nobody says so (rad).
    pub lean_rad: f64,
}

impl Default for Log {
    fn default() -> Self {
        Self { sides: true, clock: true, thermometer: false, angle_step_rad: None, lean_rad: 0.0 }
    }
}

/// A run: the data, and the same readings without noise, with and without the hidden effects.
pub struct Run {
    pub dataset: Dataset,
    /// Exact readings with all hidden effects.
    pub with: Vec<Reading>,
    /// Exact readings with all but hidden effect k.
    pub without: Vec<Vec<Reading>>,
}

struct Arm {
    links: Vec<[f64; 5]>,
    joint_map: nalgebra::Matrix6<f64>,
    flange: Matrix4<f64>,
    masses: Vec<(f64, Vector3<f64>)>,
    /// Against gravity.
    up: Vector3<f64>,
}

impl Arm {
    fn frames(&self, u: &[f64; 6]) -> Vec<Matrix4<f64>> {
        let mut out = vec![Matrix4::identity()];
        for (link, turn) in self.links.iter().zip(u) {
            let [a, alpha, d, theta, beta] = *link;
            let (s, c) = (theta + turn).sin_cos();
            let rz = Matrix4::new(c, -s, 0.0, 0.0, s, c, 0.0, 0.0, 0.0, 0.0, 1.0, d, 0.0, 0.0, 0.0, 1.0);
            let (s, c) = alpha.sin_cos();
            let rx = Matrix4::new(1.0, 0.0, 0.0, a, 0.0, c, -s, 0.0, 0.0, s, c, 0.0, 0.0, 0.0, 0.0, 1.0);
            let (s, c) = beta.sin_cos();
            let ry = Matrix4::new(c, 0.0, s, 0.0, 0.0, 1.0, 0.0, 0.0, -s, 0.0, c, 0.0, 0.0, 0.0, 0.0, 1.0);
            let last = out[out.len() - 1];
            out.push(last * rz * rx * ry);
        }
        out
    }

    /// Potential energy (N m), with a mass at the flange besides.
    fn energy(&self, u: &[f64; 6], flange_kg: f64) -> f64 {
        let frames = self.frames(u);
        let links: f64 = self
            .masses
            .iter()
            .enumerate()
            .map(|(k, (mass, centre))| {
                let at = frames[k + 1] * Vector4::new(centre.x, centre.y, centre.z, 1.0);
                mass * 9.81 * at.xyz().dot(&self.up) * 1e-3
            })
            .sum();
        links + flange_kg * 9.81 * frames[6].column(3).xyz().dot(&self.up) * 1e-3
    }

    /// Static torque of gravity about a joint (N m): what the joint sags along.
    fn torque(&self, u: &[f64; 6], joint: usize, flange_kg: f64) -> f64 {
        let h = 1e-5;
        let (mut up, mut down) = (*u, *u);
        up[joint] += h;
        down[joint] -= h;
        -(self.energy(&up, flange_kg) - self.energy(&down, flange_kg)) / (2.0 * h)
    }

    /// Static torque about a joint (N m) of a tool of 4 kg whose centre stands 100 mm in front of the flange, beside its axis.
    fn torque_of_tool(&self, u: &[f64; 6], joint: usize, aside_mm: [f64; 2]) -> f64 {
        let h = 1e-5;
        let height = |turn: f64| {
            let mut turned = *u;
            turned[joint] += turn;
            let centre = Vector4::new(aside_mm[0], aside_mm[1], 100.0, 1.0);
            (self.frames(&turned)[6] * self.flange * centre).xyz().dot(&self.up)
        };
        -4.0 * 9.81e-3 * (height(h) - height(-h)) / (2.0 * h)
    }

    /// Moment (N m) about the end of the link from a joint to the next, of all that hangs beyond, without the part about the next axis.
    fn moment_beside(&self, u: &[f64; 6], joint: usize) -> Vector3<f64> {
        let frames = self.frames(u);
        let end = frames[joint + 1];
        let (origin, axis) = (end.column(3).xyz(), end.column(2).xyz());
        let mut moment = Vector3::zeros();
        for (k, (mass, centre)) in self.masses.iter().enumerate().skip(joint + 1) {
            let at = (frames[k + 1] * Vector4::new(centre.x, centre.y, centre.z, 1.0)).xyz();
            moment += (at - origin).cross(&(self.up * (-9.81e-3 * mass)));
        }
        moment - axis * axis.dot(&moment)
    }

    /// What overturns the arm's pedestal (N m): by how much the energy falls while the whole arm turns about each axis of the base.
    fn overturning(&self, u: &[f64; 6]) -> Vector3<f64> {
        let h = 1e-5;
        let turned = |axis: usize, angle: f64| {
            let turn = nalgebra::Rotation3::from_scaled_axis(Vector3::ith(axis, -angle));
            Arm { up: turn * self.up, links: self.links.clone(), masses: self.masses.clone(), ..*self }
                .energy(u, 0.0)
        };
        Vector3::from_fn(|axis, _| -(turned(axis, h) - turned(axis, -h)) / (2.0 * h))
    }

    /// Sag (mm) and turn (rad) of the end of the link from a joint to the next, of bending stiffness 1 N m²: the elastic curve, step by
    /// step along the link, under the moments of all that hangs beyond each step. The link's own mass lies evenly along it.
    fn elastic_curve(&self, u: &[f64; 6], joint: usize) -> (Vector3<f64>, Vector3<f64>) {
        let frames = self.frames(u);
        let origin = |k: usize| frames[k].column(3).xyz() * 1e-3;
        let (root, end) = (origin(joint), origin(joint + 1));
        let along = (end - root).normalize();
        let weight = |kg: f64| self.up * (-9.81 * kg);
        const STEPS: usize = 50;
        let length = (end - root).norm();
        let step = length / STEPS as f64;
        let (mut sag, mut turn) = (Vector3::zeros(), Vector3::zeros());
        for k in 0..STEPS {
            let left = length - (k as f64 + 0.5) * step;
            let here = end - along * left;
            let own = weight(self.masses[joint].0 * left / length);
            let mut moment = (along * (0.5 * left)).cross(&own);
            for (k, (mass, centre)) in self.masses.iter().enumerate().skip(joint + 1) {
                let at = (frames[k + 1] * Vector4::new(centre.x, centre.y, centre.z, 1.0)).xyz() * 1e-3;
                moment += (at - here).cross(&weight(*mass));
            }
            let bent = (moment - along * along.dot(&moment)) * step;
            turn += bent;
            sag += bent.cross(&(along * left)) * 1e3;
        }
        (sag, turn)
    }
}

/// Masses of a small grinding arm where a data sheet states none.
const MASSES: [(f64, [f64; 3]); 6] = [
    (6.0, [0.0, 40.0, -60.0]),
    (5.0, [-120.0, 0.0, 20.0]),
    (4.0, [-20.0, 10.0, 40.0]),
    (3.0, [0.0, -120.0, 0.0]),
    (1.0, [0.0, 0.0, 10.0]),
    (1.2, [0.0, 0.0, 60.0]),
];

/// Measures an arm that deviates from `nominal` at random and has the hidden effects.
pub fn run(nominal: &Model, hidden: &[Hidden], setup: &Setup) -> Run {
    let mut rng = ChaCha8Rng::seed_from_u64(setup.seed);
    let mut normal = |sigma: f64| {
        let v: f64 = StandardNormal.sample(&mut rng);
        v * sigma
    };
    let links = nominal
        .links
        .iter()
        .map(|l| {
            let parallel = l.model == truegrind_arm::link::LinkModel::Hayati;
            [
                l.a_mm + normal(0.35),
                l.alpha_rad + normal(0.0012),
                l.d_mm + if parallel { 0.0 } else { normal(0.35) },
                l.theta_rad + normal(0.002),
                l.beta_rad + if parallel { normal(0.0012) } else { 0.0 },
            ]
        })
        .collect();
    let known = nominal.bodies;
    let masses = (0..6)
        .map(|k| {
            let (mass, centre) = known.map_or((MASSES[k].0, MASSES[k].1), |b| (b[k].mass_kg, b[k].centre_mm));
            (
                mass * (1.0 + normal(0.08)).max(0.5),
                Vector3::from(centre) + Vector3::from_fn(|_, _| normal(8.0)),
            )
        })
        .collect();
    let lean = setup.log.lean_rad;
    let arm = Arm {
        links,
        joint_map: nominal.joint_map,
        flange: nominal.flange.to_homogeneous(),
        masses,
        up: Vector3::new(lean.sin(), 0.0, lean.cos()),
    };
    let touched = Vector4::new(normal(15.0), normal(15.0), 60.0 + normal(20.0), 1.0);
    let tail = StudentT::new(5.0).expect("five degrees of freedom");
    let mut draw = ChaCha8Rng::seed_from_u64(setup.seed ^ 0x5eed);
    // Poses over most of each joint's range, in front of the base for the sake of a cable.
    let poses: Vec<Joints> = (0..setup.rows)
        .map(|_| {
            Joints::from_fn(|j, _| {
                let (low, high) = (nominal.limits.min_rad[j], nominal.limits.max_rad[j]);
                let middle = 0.5 * (low + high);
                let half = (0.5 * (high - low)).min(2.0) * if j == 0 { 0.5 } else { 0.75 };
                middle + half * draw.random_range(-1.0..1.0)
            })
        })
        .collect();
    let small = (draw.random_range(0..6usize), draw.random_range(0.0..std::f64::consts::TAU));
    // As far in front of a larger arm as it is larger.
    let reach: f64 = nominal.links.iter().map(|l| l.a_mm.abs() + l.d_mm.abs()).sum::<f64>() / 1000.0;
    let outlet =
        Vector3::new(900.0, draw.random_range(-300.0..300.0), draw.random_range(0.0..300.0)) * reach.max(1.0);
    let camera = hidden.iter().any(|h| matches!(h, Hidden::Lens { .. }));
    let place = if camera { Vector3::new(300.0, 0.0, 2200.0) } else { Vector3::new(2200.0, -900.0, 400.0) };
    let turn = draw.random_range(-3.0..3.0);
    let away_mm = |q: &Joints| {
        let at = *arm.frames(&(arm.joint_map * q).into()).last().expect("six") * arm.flange * touched;
        (at.xyz() - outlet).norm()
    };
    let hours = 4.0;
    let n = setup.rows;
    let mut rows = Vec::with_capacity(n);
    let (mut with, mut without) = (Vec::with_capacity(n), vec![Vec::with_capacity(n); hidden.len()]);
    let peaks: Vec<f64> = hidden
        .iter()
        .map(|h| match h {
            Hidden::Compliance { joint, .. } => poses
                .iter()
                .map(|q| arm.torque(&(arm.joint_map * q).into(), *joint, 0.0).abs())
                .fold(1e-9, f64::max),
            Hidden::Twist { joint, .. } => poses
                .iter()
                .map(|q| arm.moment_beside(&(arm.joint_map * q).into(), *joint).norm())
                .fold(1e-9, f64::max),
            Hidden::SideTool { joint, aside_mm, .. } => poses
                .iter()
                .map(|q| arm.torque_of_tool(&(arm.joint_map * q).into(), *joint, *aside_mm).abs())
                .fold(1e-9, f64::max),
            Hidden::Bending { joint, .. } => poses
                .iter()
                .map(|q| arm.elastic_curve(&(arm.joint_map * q).into(), *joint).0.norm())
                .fold(1e-9, f64::max),
            _ => 1.0,
        })
        .collect();
    for (i, q) in poses.iter().enumerate() {
        let approach: [i8; 6] = if setup.log.sides {
            std::array::from_fn(|_| if draw.random_range(0..2) == 0 { -1 } else { 1 })
        } else {
            // A joint that moved up came from below.
            let before = poses[i.max(1) - 1];
            std::array::from_fn(|j| if i > 0 && q[j] > before[j] { -1 } else { 1 })
        };
        let time = hours * i as f64 / n as f64;
        let kelvin = 6.0 * (1.0 - (-time / 1.5_f64).exp()) + 1.5 * (3.0 * time).sin();
        let u: [f64; 6] = (arm.joint_map * q).into();
        let read = |skip: Option<usize>| -> Reading {
            let mut turned = u;
            let (mut scale, mut zero) = (1.0, 0.0);
            let (mut stretched, mut slack, mut load, mut warp) = (1.0, 0.0, 0.0, 0.0);
            let (mut range, mut depth, mut lens, mut reversal) = (0.0, 0.0, 0.0, 0.0);
            let (mut moved, mut slipped) = (Vector3::zeros(), Vector4::zeros());
            for (k, h) in hidden.iter().enumerate().filter(|(k, _)| Some(*k) != skip) {
                match h {
                    Hidden::Compliance { joint, peak_rad } => {
                        turned[*joint] += peak_rad * arm.torque(&u, *joint, 0.0) / peaks[k];
                    }
                    Hidden::SideTool { joint, peak_rad, aside_mm } => {
                        turned[*joint] += peak_rad * arm.torque_of_tool(&u, *joint, *aside_mm) / peaks[k];
                    }
                    Hidden::Gear { joint, order, peak_rad, phase } => {
                        turned[*joint] += peak_rad * (order * u[*joint] + phase).cos();
                    }
                    Hidden::Ratio { joint, error } => turned[*joint] += error * u[*joint],
                    Hidden::Coupling { driver, joint, factor } => turned[*joint] += factor * u[*driver],
                    Hidden::Backlash { joint, play_rad } => {
                        // Where the controller counts an angle the other way round, above is below.
                        let sense = arm.joint_map[(*joint, *joint)].signum();
                        turned[*joint] += 0.5 * play_rad * sense * f64::from(approach[*joint]);
                    }
                    Hidden::LoadedPlay { joint, play_rad, closed_nm, friction_nm } => {
                        let torque = arm.torque(&u, *joint, 0.0);
                        let flank = if torque.abs() < *friction_nm {
                            arm.joint_map[(*joint, *joint)].signum() * f64::from(approach[*joint])
                        } else {
                            (torque / closed_nm).tanh()
                        };
                        turned[*joint] += 0.5 * play_rad * flank;
                    }
                    Hidden::LostCounts { joint, until, rad } if i <= *until => turned[*joint] += rad,
                    Hidden::Range { mm } => range += mm,
                    Hidden::Lens { share } => lens += share,
                    Hidden::Reversal { mm } => reversal += mm,
                    Hidden::Depth { share } => depth += share,
                    Hidden::Thermal { growth, time_constant_h } => {
                        scale += growth * (1.0 - (-time / time_constant_h).exp());
                    }
                    Hidden::Zero { from, to, mm } if (*from..=*to).contains(&i) => zero += mm,
                    Hidden::Frame { from, to, mm } if (*from..=*to).contains(&i) => {
                        moved += Vector3::from(*mm)
                    }
                    Hidden::Tool { from, to, mm } if (*from..=*to).contains(&i) => {
                        slipped += Vector4::new(mm[0], mm[1], mm[2], 0.0);
                    }
                    Hidden::Drift { mm, time_constant_h } => {
                        moved += Vector3::from(*mm) * (1.0 - (-time / time_constant_h).exp());
                    }
                    Hidden::Creep { mm, time_constant_h } => {
                        let share = 1.0 - (-time / time_constant_h).exp();
                        slipped += Vector4::new(mm[0], mm[1], mm[2], 0.0) * share;
                    }
                    Hidden::Warm { growth_per_k } => scale += growth_per_k * kelvin,
                    Hidden::Warp { mm } => warp += mm,
                    Hidden::Scale { rows, factor }
                        if rows.is_none_or(|[from, to]| (from..=to).contains(&i)) =>
                    {
                        stretched += factor
                    }
                    Hidden::Sag { square_per_m2 } => slack += square_per_m2,
                    Hidden::Payload { from, to, kg } if (*from..=*to).contains(&i) => load += kg,
                    _ => {}
                }
            }
            if hidden.iter().any(|h| matches!(h, Hidden::Payload { .. })) {
                for joint in [1, 2] {
                    turned[joint] += YIELDING * arm.torque(&u, joint, load);
                }
            }
            if setup.dirty {
                turned[small.0] += 1.0e-5 * (3.0 * u[small.0] + small.1).sin();
            }
            let grown = Arm {
                links: arm.links.iter().map(|l| [l[0] * scale, l[1], l[2] * scale, l[3], l[4]]).collect(),
                joint_map: arm.joint_map,
                flange: arm.flange,
                masses: Vec::new(),
                up: arm.up,
            };
            let frames = grown.frames(&turned);
            let mut at = (frames[6] * grown.flange * (touched + slipped)).xyz();
            for (k, h) in hidden.iter().enumerate().filter(|(k, _)| Some(*k) != skip) {
                if let Hidden::Bending { joint, mm } = h {
                    let (sag, turn) = arm.elastic_curve(&u, *joint);
                    let beyond = at - frames[joint + 1].column(3).xyz();
                    at += (sag + turn.cross(&beyond)) * (mm / peaks[k]);
                }
            }
            for (k, h) in hidden.iter().enumerate().filter(|(k, _)| Some(*k) != skip) {
                match h {
                    Hidden::Twist { joint, peak_rad } => {
                        let end = frames[joint + 1].column(3).xyz();
                        let turn = arm.moment_beside(&u, *joint) * (peak_rad / peaks[k]);
                        at = end + nalgebra::Rotation3::new(turn) * (at - end);
                    }
                    Hidden::Droop { mm } => {
                        let pole = (frames[6] * grown.flange).column(2).xyz();
                        at -= (arm.up - pole * pole.dot(&arm.up)) * *mm;
                    }
                    Hidden::Wobble { joint, peak_rad, phase } => {
                        let [x, y, _, centre] = [0, 1, 2, 3].map(|k| frames[*joint].column(k).xyz());
                        let (s, c) = (2.0 * (u[*joint] - phase)).sin_cos();
                        let tilt = nalgebra::Rotation3::new((x * c + y * s) * *peak_rad);
                        at = centre + tilt * (at - centre);
                    }
                    Hidden::Tilt { rad_per_nm } => {
                        at = nalgebra::Rotation3::new(arm.overturning(&u) * *rad_per_nm) * at;
                    }
                    _ => {}
                }
            }
            at.z += warp * (at.x / 180.0).sin() * (at.y / 220.0).cos();
            match setup.sensor {
                Sensor::Cable => {
                    let chord = at - outlet - moved;
                    let (span_m, d) = (chord.xy().norm() * 1e-3, chord.norm());
                    let length = d * (1.0 + slack * span_m * span_m / 24.0);
                    let paid_out = i > 0 && away_mm(q) > away_mm(&poses[i - 1]);
                    let lag = if paid_out { reversal } else { 0.0 };
                    Reading::Cable((length + 7.0 + zero + lag) * stretched)
                }
                _ => {
                    let away = at - place - moved;
                    let mut away = away * (1.0 + range / away.norm());
                    let beside = lens * away.xy().norm_squared() / (away.z * away.z);
                    away.x *= 1.0 + beside;
                    away.y *= 1.0 + beside;
                    let (s, c) = f64::sin_cos(turn);
                    Reading::Position(
                        Vector3::new(
                            c * away.x + s * away.y,
                            c * away.y - s * away.x,
                            away.z * (1.0 + depth),
                        ) * stretched,
                    )
                }
            }
        };
        let exact = read(None);
        for (k, list) in without.iter_mut().enumerate() {
            list.push(read(Some(k)));
        }
        let sigma =
            if setup.dirty { setup.sigma_mm * (0.8 + 0.4 * q[1].sin().abs()) } else { setup.sigma_mm };
        let mut noise = || {
            if setup.dirty {
                tail.sample(&mut draw) * sigma * 0.6_f64.sqrt()
            } else {
                let v: f64 = StandardNormal.sample(&mut draw);
                v * sigma
            }
        };
        let mut reading = match &exact {
            Reading::Cable(l) => Reading::Cable(l + noise()),
            Reading::Position(p) => Reading::Position(p + Vector3::new(noise(), noise(), noise())),
            other => other.clone(),
        };
        for h in hidden {
            if let Hidden::Outliers { list, mm } = h
                && list.contains(&i)
            {
                match &mut reading {
                    Reading::Cable(l) => *l += mm,
                    Reading::Position(p) => p.y += mm,
                    Reading::Pose(_) => {}
                }
            }
        }
        with.push(exact);
        let log = &setup.log;
        let logged = log.angle_step_rad.map_or(*q, |step| q.map(|v| (v / step).round() * step));
        let mut row = Row::new(i, logged, reading);
        let condition = Condition {
            time_h: log.clock.then_some(time),
            temperature_c: log.thermometer.then_some(20.0 + kelvin),
            approach: if log.sides { approach } else { [0; 6] },
            ..Condition::default()
        };
        row.condition = condition.into();
        if log.angle_step_rad.is_some() {
            let at = nominal.forward(q, &Condition::default()) * nalgebra::Point3::new(0.0, 0.0, 35.0);
            row.extra_mut().readout_mm = Some(at.coords.map(|v| (v * 100.0).round() / 100.0));
        }
        rows.push(row);
    }
    let mut dataset = Dataset::new("simulated.csv", setup.sensor, rows);
    dataset.angle_step_rad = setup.log.angle_step_rad;
    dataset.readout_step_mm = setup.log.angle_step_rad.map(|_| 0.01);
    Run { dataset, with, without }
}

/// The difference that hidden effect k makes to each reading (mm), in the sensor's frame.
pub fn difference(run: &Run, k: usize) -> Vec<Vector3<f64>> {
    run.with
        .iter()
        .zip(&run.without[k])
        .map(|pair| match pair {
            (Reading::Cable(a), Reading::Cable(b)) => Vector3::new(a - b, 0.0, 0.0),
            (Reading::Position(a), Reading::Position(b)) => a - b,
            _ => Vector3::zeros(),
        })
        .collect()
}
