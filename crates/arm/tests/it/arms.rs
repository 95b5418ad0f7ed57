//! Arms for the tests of kinematics: every sign convention and family, and ways to spoil them.
//!
//! The numbers are those of the catalogue; they are repeated here because kinematics is tested without it.

use nalgebra::{Matrix6, Vector3};
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use truegrind_arm::effect::Effect;
use truegrind_arm::effect::axis_wobble::AxisWobble;
use truegrind_arm::effect::base_tilt::{BaseTilt, TiltTerm};
use truegrind_arm::effect::bending::Bending;
use truegrind_arm::effect::compliance::Compliance;
use truegrind_arm::effect::coupling::Coupling;
use truegrind_arm::effect::error_map::ErrorMap;
use truegrind_arm::effect::gear_ratio::GearRatio;
use truegrind_arm::effect::hardening::Hardening;
use truegrind_arm::effect::harmonic::Harmonic;
use truegrind_arm::effect::joint_load::PointMass;
use truegrind_arm::effect::link_twist::LinkTwist;
use truegrind_arm::effect::loaded_backlash::LoadedBacklash;
use truegrind_arm::effect::lumped_compliance::{Lump, LumpedCompliance};
use truegrind_arm::effect::smooth_correction::SmoothCorrection;
use truegrind_arm::effect::thermal::Thermal;
use truegrind_arm::effect::torque_powers::TorquePowers;
use truegrind_arm::effect::two_joint_gear::TwoJointGear;
use truegrind_arm::link::{Link, LinkModel};
use truegrind_arm::model::{Body, Joints, Limits, Model};
use truegrind_math::se3::Pose;

/// One data sheet: a (mm), d (mm), alpha [°], theta [°] of each link.
pub(crate) struct Sheet {
    pub(crate) name: &'static str,
    links: [[f64; 4]; 6],
    map: [[f64; 6]; 6],
    min_deg: [f64; 6],
    max_deg: [f64; 6],
    hayati: &'static [usize],
}

const fn diagonal(signs: [f64; 6]) -> [[f64; 6]; 6] {
    let mut out = [[0.0; 6]; 6];
    let mut i = 0;
    while i < 6 {
        out[i][i] = signs[i];
        i += 1;
    }
    out
}

const PLAIN: [[f64; 6]; 6] = diagonal([1.0; 6]);
const KUKA: [[f64; 6]; 6] = diagonal([-1.0, 1.0, 1.0, -1.0, 1.0, -1.0]);
const YASKAWA: [[f64; 6]; 6] = diagonal([1.0, 1.0, -1.0, -1.0, -1.0, -1.0]);
const FANUC: [[f64; 6]; 6] = {
    let mut out = diagonal([1.0, 1.0, -1.0, -1.0, -1.0, -1.0]);
    out[2][1] = -1.0;
    out
};

pub(crate) const SHEETS: &[Sheet] = &[
    Sheet {
        name: "abb-irb-120",
        links: [
            [0.0, 290.0, -90.0, 0.0],
            [270.0, 0.0, 0.0, -90.0],
            [70.0, 0.0, -90.0, 0.0],
            [0.0, 302.0, 90.0, 0.0],
            [0.0, 0.0, -90.0, 0.0],
            [0.0, 72.0, 0.0, 180.0],
        ],
        map: PLAIN,
        min_deg: [-165.0, -110.0, -110.0, -160.0, -120.0, -400.0],
        max_deg: [165.0, 110.0, 70.0, 160.0, 120.0, 400.0],
        hayati: &[1],
    },
    Sheet {
        name: "abb-irb-1600-6-1.2",
        links: [
            [150.0, 486.5, -90.0, 0.0],
            [475.0, 0.0, 0.0, -90.0],
            [0.0, 0.0, -90.0, 0.0],
            [0.0, 600.0, 90.0, 0.0],
            [0.0, 0.0, -90.0, 0.0],
            [0.0, 65.0, 0.0, 180.0],
        ],
        map: PLAIN,
        min_deg: [-180.0, -63.0, -235.0, -200.0, -115.0, -400.0],
        max_deg: [180.0, 110.0, 55.0, 200.0, 115.0, 400.0],
        hayati: &[1],
    },
    Sheet {
        name: "abb-irb-1600-10-1.45",
        links: [
            [150.0, 486.5, -90.0, 0.0],
            [700.0, 0.0, 0.0, -90.0],
            [0.0, 0.0, -90.0, 0.0],
            [0.0, 600.0, 90.0, 0.0],
            [0.0, 0.0, -90.0, 0.0],
            [0.0, 65.0, 0.0, 180.0],
        ],
        map: PLAIN,
        min_deg: [-180.0, -90.0, -245.0, -200.0, -115.0, -400.0],
        max_deg: [180.0, 120.0, 65.0, 200.0, 115.0, 400.0],
        hayati: &[1],
    },
    Sheet {
        name: "abb-irb-2600-12-1.85",
        links: [
            [150.0, 445.0, -90.0, 0.0],
            [900.0, 0.0, 0.0, -90.0],
            [115.0, 0.0, -90.0, 0.0],
            [0.0, 795.0, 90.0, 0.0],
            [0.0, 0.0, -90.0, 0.0],
            [0.0, 85.0, 0.0, 180.0],
        ],
        map: PLAIN,
        min_deg: [-180.0, -95.0, -180.0, -400.0, -120.0, -400.0],
        max_deg: [180.0, 155.0, 75.0, 400.0, 120.0, 400.0],
        hayati: &[1],
    },
    Sheet {
        name: "abb-irb-4600-40-2.55",
        links: [
            [175.0, 495.0, -90.0, 0.0],
            [1095.0, 0.0, 0.0, -90.0],
            [175.0, 0.0, -90.0, 0.0],
            [0.0, 1270.0, 90.0, 0.0],
            [0.0, 0.0, -90.0, 0.0],
            [0.0, 135.0, 0.0, 180.0],
        ],
        map: PLAIN,
        min_deg: [-180.0, -90.0, -180.0, -400.0, -125.0, -400.0],
        max_deg: [180.0, 150.0, 75.0, 400.0, 120.0, 400.0],
        hayati: &[1],
    },
    Sheet {
        name: "abb-irb-4600-60-2.05",
        links: [
            [175.0, 495.0, -90.0, 0.0],
            [900.0, 0.0, 0.0, -90.0],
            [175.0, 0.0, -90.0, 0.0],
            [0.0, 960.0, 90.0, 0.0],
            [0.0, 0.0, -90.0, 0.0],
            [0.0, 135.0, 0.0, 180.0],
        ],
        map: PLAIN,
        min_deg: [-180.0, -90.0, -180.0, -400.0, -125.0, -400.0],
        max_deg: [180.0, 150.0, 75.0, 400.0, 120.0, 400.0],
        hayati: &[1],
    },
    Sheet {
        name: "abb-irb-6700-200-2.60",
        links: [
            [320.0, 780.0, -90.0, 0.0],
            [1125.0, 0.0, 0.0, -90.0],
            [200.0, 0.0, -90.0, 0.0],
            [0.0, 1142.5, 90.0, 0.0],
            [0.0, 0.0, -90.0, 0.0],
            [0.0, 200.0, 0.0, 180.0],
        ],
        map: PLAIN,
        min_deg: [-170.0, -65.0, -180.0, -300.0, -130.0, -360.0],
        max_deg: [170.0, 85.0, 70.0, 300.0, 130.0, 360.0],
        hayati: &[1],
    },
    Sheet {
        name: "fanuc-lr-mate-200id",
        links: [
            [50.0, 0.0, -90.0, 0.0],
            [330.0, 0.0, 0.0, -90.0],
            [35.0, 0.0, -90.0, 0.0],
            [0.0, 335.0, 90.0, 0.0],
            [0.0, 0.0, -90.0, 0.0],
            [0.0, 80.0, 0.0, 0.0],
        ],
        map: FANUC,
        min_deg: [-170.0, -100.0, -140.43, -190.0, -125.0, -360.0],
        max_deg: [170.0, 145.0, 280.0, 190.0, 125.0, 360.0],
        hayati: &[1],
    },
    Sheet {
        name: "fanuc-m-20ia",
        links: [
            [150.0, 0.0, -90.0, 0.0],
            [790.0, 0.0, 0.0, -90.0],
            [250.0, 0.0, -90.0, 0.0],
            [0.0, 835.0, 90.0, 0.0],
            [0.0, 0.0, -90.0, 0.0],
            [0.0, 100.0, 0.0, 0.0],
        ],
        map: FANUC,
        min_deg: [-170.0, -100.0, -185.0, -200.0, -140.0, -270.0],
        max_deg: [170.0, 160.0, 273.12, 200.0, 140.0, 270.0],
        hayati: &[1],
    },
    Sheet {
        name: "fanuc-m-710ic-50",
        links: [
            [150.0, 0.0, -90.0, 0.0],
            [870.0, 0.0, 0.0, -90.0],
            [170.0, 0.0, -90.0, 0.0],
            [0.0, 1016.0, 90.0, 0.0],
            [0.0, 0.0, -90.0, 0.0],
            [0.0, 175.0, 0.0, 0.0],
        ],
        map: FANUC,
        min_deg: [-180.0, -90.0, -160.0, -360.0, -125.0, -360.0],
        max_deg: [180.0, 135.0, 280.0, 360.0, 125.0, 360.0],
        hayati: &[1],
    },
    Sheet {
        name: "hsr-jr680",
        links: [
            [250.0, 653.5, -90.0, 0.0],
            [900.0, 0.0, 0.0, -90.0],
            [-205.0, 0.0, 90.0, 180.0],
            [0.0, 1030.2, -90.0, 0.0],
            [0.0, 0.0, 90.0, 90.0],
            [0.0, 200.6, 0.0, 0.0],
        ],
        map: PLAIN,
        min_deg: [-180.0, -180.0, -180.0, -180.0, -180.0, -180.0],
        max_deg: [180.0, 180.0, 180.0, 180.0, 180.0, 180.0],
        hayati: &[1],
    },
    Sheet {
        name: "kuka-kr6-r900-sixx",
        links: [
            [25.0, 400.0, -90.0, 0.0],
            [455.0, 0.0, 0.0, 0.0],
            [35.0, 0.0, -90.0, -90.0],
            [0.0, 420.0, 90.0, 0.0],
            [0.0, 0.0, -90.0, 0.0],
            [0.0, 80.0, 0.0, 180.0],
        ],
        map: KUKA,
        min_deg: [-170.0, -190.0, -120.0, -185.0, -120.0, -350.0],
        max_deg: [170.0, 45.0, 156.0, 185.0, 120.0, 350.0],
        hayati: &[1],
    },
    Sheet {
        name: "kuka-kr10-r1420",
        links: [
            [150.0, 450.0, -90.0, 0.0],
            [610.0, 0.0, 0.0, 0.0],
            [20.0, 0.0, -90.0, -90.0],
            [0.0, 660.0, 90.0, 0.0],
            [0.0, 0.0, -90.0, 0.0],
            [0.0, 80.0, 0.0, 180.0],
        ],
        map: KUKA,
        min_deg: [-170.0, -185.0, -137.0, -185.0, -120.0, -350.0],
        max_deg: [170.0, 65.0, 163.0, 185.0, 120.0, 350.0],
        hayati: &[1],
    },
    Sheet {
        name: "staubli-tx60",
        links: [
            [0.0, 0.0, -90.0, 0.0],
            [290.0, 0.0, 0.0, -90.0],
            [0.0, 20.0, 90.0, 90.0],
            [0.0, 310.0, -90.0, 0.0],
            [0.0, 0.0, 90.0, 0.0],
            [0.0, 70.0, 0.0, 0.0],
        ],
        map: PLAIN,
        min_deg: [-180.0, -127.5, -142.5, -270.0, -122.5, -270.0],
        max_deg: [180.0, 127.5, 142.5, 270.0, 132.5, 270.0],
        hayati: &[1],
    },
    Sheet {
        name: "staubli-tx90",
        links: [
            [50.0, 0.0, -90.0, 0.0],
            [425.0, 0.0, 0.0, -90.0],
            [0.0, 50.0, 90.0, 90.0],
            [0.0, 425.0, -90.0, 0.0],
            [0.0, 0.0, 90.0, 0.0],
            [0.0, 100.0, 0.0, 0.0],
        ],
        map: PLAIN,
        min_deg: [-180.0, -130.0, -145.0, -270.0, -115.0, -270.0],
        max_deg: [180.0, 147.5, 145.0, 270.0, 140.0, 270.0],
        hayati: &[1],
    },
    Sheet {
        name: "staubli-rx160",
        links: [
            [150.0, 0.0, -90.0, 0.0],
            [825.0, 0.0, 0.0, -90.0],
            [0.0, 0.0, 90.0, 90.0],
            [0.0, 625.0, -90.0, 0.0],
            [0.0, 0.0, 90.0, 0.0],
            [0.0, 110.0, 0.0, 0.0],
        ],
        map: PLAIN,
        min_deg: [-160.0, -137.5, -150.0, -270.0, -105.0, -270.0],
        max_deg: [160.0, 137.5, 150.0, 270.0, 120.0, 270.0],
        hayati: &[1],
    },
    Sheet {
        name: "universal-robots-ur10",
        links: [
            [0.0, 127.3, 90.0, 0.0],
            [-612.0, 0.0, 0.0, 0.0],
            [-572.3, 0.0, 0.0, 0.0],
            [0.0, 163.941, 90.0, 0.0],
            [0.0, 115.7, -90.0, 0.0],
            [0.0, 92.2, 0.0, 0.0],
        ],
        map: PLAIN,
        min_deg: [-360.0, -360.0, -360.0, -360.0, -360.0, -360.0],
        max_deg: [360.0, 360.0, 360.0, 360.0, 360.0, 360.0],
        hayati: &[1, 2],
    },
    Sheet {
        name: "universal-robots-ur5",
        links: [
            [0.0, 89.159, 90.0, 0.0],
            [-425.0, 0.0, 0.0, 0.0],
            [-392.25, 0.0, 0.0, 0.0],
            [0.0, 109.15, 90.0, 0.0],
            [0.0, 94.65, -90.0, 0.0],
            [0.0, 82.3, 0.0, 0.0],
        ],
        map: PLAIN,
        min_deg: [-360.0, -360.0, -360.0, -360.0, -360.0, -360.0],
        max_deg: [360.0, 360.0, 360.0, 360.0, 360.0, 360.0],
        hayati: &[1, 2],
    },
    Sheet {
        name: "yaskawa-gp12",
        links: [
            [155.0, 0.0, -90.0, 0.0],
            [614.0, 0.0, 0.0, -90.0],
            [200.0, 0.0, -90.0, 0.0],
            [0.0, 640.0, 90.0, 0.0],
            [0.0, 0.0, -90.0, 0.0],
            [0.0, 100.0, 0.0, 0.0],
        ],
        map: YASKAWA,
        min_deg: [-170.0, -90.0, -85.0, -200.0, -150.0, -455.0],
        max_deg: [170.0, 155.0, 150.0, 200.0, 150.0, 455.0],
        hayati: &[1],
    },
];

pub(crate) fn generator(seed: u64) -> ChaCha8Rng {
    ChaCha8Rng::seed_from_u64(seed)
}

/// Evenly distributed between −1 and 1.
pub(crate) fn even(random: &mut ChaCha8Rng) -> f64 {
    random.random_range(-1.0..1.0)
}

impl Sheet {
    pub(crate) fn named(name: &str) -> Model {
        SHEETS.iter().find(|s| s.name == name).expect("an arm of the list").model()
    }

    pub(crate) fn model(&self) -> Model {
        let link = |i: usize| {
            let [a_mm, d_mm, alpha, theta] = self.links[i];
            let model = if self.hayati.contains(&i) { LinkModel::Hayati } else { LinkModel::Dh };
            let (alpha_rad, theta_rad) = (alpha.to_radians(), theta.to_radians());
            Link { model, a_mm, d_mm, alpha_rad, theta_rad, beta_rad: 0.0 }
        };
        Model {
            links: std::array::from_fn(link),
            joint_map: Matrix6::from_fn(|i, j| self.map[i][j]),
            limits: Limits {
                sums: Vec::new(),
                min_rad: self.min_deg.map(f64::to_radians),
                max_rad: self.max_deg.map(f64::to_radians),
                speed_rad_s: None,
            },
            flange: Pose::identity(),
            bodies: None,
            gravity: -Vector3::z(),
            effects: Vec::new(),
        }
    }
}

/// The model with every link number off by up to `mm` and `deg`.
pub(crate) fn perturbed(model: &Model, random: &mut ChaCha8Rng, mm: f64, deg: f64) -> Model {
    let mut out = model.clone();
    let rad = deg.to_radians();
    for link in &mut out.links {
        link.a_mm += mm * even(random);
        link.alpha_rad += rad * even(random);
        link.theta_rad += rad * even(random);
        match link.model {
            LinkModel::Dh => link.d_mm += mm * even(random),
            LinkModel::Hayati => link.beta_rad += rad * even(random),
        }
    }
    out
}

/// The model with masses and one of each effect of position.
pub(crate) fn with_effects(model: &Model, random: &mut ChaCha8Rng) -> Model {
    let mut out = model.clone();
    let masses = [20.0, 15.0, 10.0, 5.0, 3.0, 1.0];
    out.bodies = Some(std::array::from_fn(|i| Body {
        mass_kg: masses[i] * (1.0 + 0.2 * even(random)),
        centre_mm: [-100.0 * even(random).abs(), 30.0 * even(random), 50.0 * even(random)],
    }));
    for joint in 0..6 {
        let compliance_rad_per_nm = 2e-6 * (1.0 + even(random));
        out.effects.push(Effect::JointCompliance(Compliance { joint, compliance_rad_per_nm }));
    }
    let mut harmonic = |joint, order| Harmonic {
        joint,
        order,
        sine_rad: 3e-4 * even(random),
        cosine_rad: 3e-4 * even(random),
    };
    out.effects.push(Effect::GearEccentricity(harmonic(0, 1.0)));
    out.effects.push(Effect::GearEccentricity(harmonic(2, 2.0)));
    out.effects.push(Effect::GearTransmission(Harmonic {
        joint: 3,
        order: 80.0,
        sine_rad: 3e-5 * even(random),
        cosine_rad: 3e-5,
    }));
    let knots_rad = (0..12).map(|_| 2e-4 * even(random)).collect();
    out.effects.push(Effect::GearMap(ErrorMap { joint: 1, knots_rad }));
    let lump = [(3, None, None), (6, Some(1), None), (2, None, Some(0)), (4, Some(0), Some(2))]
        .map(|(frame, axis, moment)| Lump { frame, axis, moment, factor: 3e-6 * even(random) });
    out.effects.push(Effect::LumpedCompliance(LumpedCompliance { joint: 1, lump: lump.to_vec() }));
    for (joint, frame) in [(1, None), (1, Some(4)), (2, Some(6))] {
        out.effects.push(Effect::LinkBending(Bending { joint, frame, compliance_rad_per_nm: 2e-6 }));
    }
    out.effects.push(Effect::GearTwoJoints(TwoJointGear {
        joint: 4,
        other: 3,
        orders: [2, 1],
        sum_rad: [1e-4, -5e-5],
        difference_rad: [2e-5, 8e-5],
    }));
    for mass in [Vec::new(), vec![PointMass { frame: 2, mass_kg: 0.8 }, PointMass { frame: 4, mass_kg: 0.2 }]]
    {
        let spring = Hardening { joint: 1, mass: mass.clone(), half_nm: 10.0, deflection_rad: 3e-5 };
        let largest_nm = if mass.is_empty() { 15.0 } else { 2.0 };
        let (square_rad_per_nm2, cube_rad_per_nm3) = (3e-8, -1e-9);
        let powers = TorquePowers { joint: 2, mass, largest_nm, square_rad_per_nm2, cube_rad_per_nm3 };
        out.effects.extend([Effect::JointStiffness(spring), Effect::TorquePowers(powers)]);
    }
    for (joint, mass, friction_nm) in
        [(1, Vec::new(), 10.0), (2, vec![PointMass { frame: 4, mass_kg: 1.0 }], 0.0)]
    {
        let play = LoadedBacklash { joint, mass, friction_nm, closing_nm: 10.0, play_rad: 2e-5 };
        out.effects.push(Effect::LoadedBacklash(play));
    }
    out.effects.push(Effect::GearRatio(GearRatio { joint: 5, error: 2e-4 }));
    out.effects.push(Effect::JointCoupling(Coupling { joint: 5, driver: 4, factor: 1e-3 }));
    out.effects.push(Effect::ThermalDrift(Thermal {
        start_h: 0.0,
        growth: 2e-4,
        time_constant_h: 1.5,
        growth_per_k: 1e-5,
        reference_c: 20.0,
    }));
    let term =
        |frame, about, tilt_rad_per_nm| TiltTerm { frame, about, tilt_rad_per_nm, sway_mm_per_nm: 0.0 };
    let term = vec![
        TiltTerm { sway_mm_per_nm: 5e-4, ..term(None, None, 1e-6) },
        TiltTerm { sway_mm_per_nm: -2e-4, ..term(None, Some([0, 1]), 5e-7) },
        term(Some(4), Some([1, 1]), 1e-5),
    ];
    out.effects.push(Effect::BaseTilt(BaseTilt { deep: true, term }));
    let tilt_rad = [1e-4, -5e-5, 8e-5, 3e-5];
    out.effects.push(Effect::AxisWobble(AxisWobble { joint: 1, tilt_rad, radial_mm: None }));
    // Each motion of links is carried by those before it.
    for (joint, lean_rad) in [(1, None), (2, Some(-8e-5))] {
        out.effects.push(Effect::LinkTwist(LinkTwist { joint, twist_rad: 5e-5, lean_rad }));
    }
    let radial_mm = Some([0.02, -0.01, 0.01, 0.03]);
    out.effects.push(Effect::AxisWobble(AxisWobble { joint: 3, tilt_rad, radial_mm }));
    out.effects.push(Effect::SmoothCorrection(SmoothCorrection {
        centres_rad: vec![[0.0, 0.3, -0.2], [0.8, -0.4, 0.5], [-0.9, 0.1, 1.0]],
        reach_rad: 1.6,
        weights_rad: vec![[3e-4, -2e-4, 1e-4], [-1e-4, 3e-4, 2e-4], [2e-4, 1e-4, -3e-4]],
    }));
    out
}

/// Joints within the limits.
pub(crate) fn joints_within(model: &Model, random: &mut ChaCha8Rng) -> Joints {
    Joints::from_fn(|i, _| random.random_range(model.limits.min_rad[i]..model.limits.max_rad[i]))
}
