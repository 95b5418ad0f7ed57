//! The calibration problem: every Jacobian column has a numerical twin, lanes and padding change nothing.

use nalgebra::{DMatrix, Matrix6, Point3, UnitQuaternion, Vector3};
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use truegrind_arm::condition::Condition;
use truegrind_arm::effect::Effect;
use truegrind_arm::effect::axis_wobble::AxisWobble;
use truegrind_arm::effect::base_tilt::{BaseTilt, TiltTerm};
use truegrind_arm::effect::compliance::Compliance;
use truegrind_arm::effect::harmonic::Harmonic;
use truegrind_arm::effect::thermal::Thermal;
use truegrind_arm::link::{Link, LinkModel};
use truegrind_arm::model::{Body, Joints, Limits, Model};
use truegrind_arm::parameter::{LinkCoordinate, Parameter, link_parameters};
use truegrind_calibration::identification::calibration::{CalibrationProblem, Frames, Weight};
use truegrind_calibration::measurement::dataset::{Dataset, Motion, Rates, Reading, Row, Sensor};
use truegrind_calibration::measurement::sensor::disturbance::{Disturbance, Kind, Profile};
use truegrind_calibration::measurement::sensor::empirical::{
    AssumedLoad, CornerSpeed, EmpiricalFault, Overturning, Pole,
};
use truegrind_estimation::problem::Problem;
use truegrind_math::difference;
use truegrind_math::lanes::{Instructions, with_instructions};
use truegrind_math::se3::{Pose, pose_from_vector};

fn arm() -> Model {
    let rows: [(f64, f64, f64, f64); 6] = [
        (0.0, 290.0, -90.0, 0.0),
        (270.0, 0.0, 0.0, -90.0),
        (70.0, 0.0, -90.0, 0.0),
        (0.0, 302.0, 90.0, 0.0),
        (0.0, 0.0, -90.0, 0.0),
        (0.0, 72.0, 0.0, 0.0),
    ];
    let links = std::array::from_fn(|i| {
        let (a_mm, d_mm, alpha, theta) = rows[i];
        Link {
            model: if i == 1 { LinkModel::Hayati } else { LinkModel::Dh },
            a_mm,
            d_mm,
            alpha_rad: alpha.to_radians(),
            theta_rad: theta.to_radians(),
            beta_rad: 0.0,
        }
    });
    Model {
        links,
        joint_map: Matrix6::identity(),
        limits: Limits { min_rad: [-3.0; 6], max_rad: [3.0; 6], speed_rad_s: None, sums: Vec::new() },
        flange: pose_from_vector(&[0.0, 0.0, 0.0, 0.1, -0.2, 0.3]),
        bodies: Some(std::array::from_fn(|i| Body {
            mass_kg: 6.0 - i as f64,
            centre_mm: [-30.0, 12.0 * i as f64, 20.0],
        })),
        gravity: Vector3::new(0.0, 0.1, -1.0).normalize(),
        effects: vec![
            Effect::JointCompliance(Compliance { joint: 1, compliance_rad_per_nm: 2e-5 }),
            Effect::GearEccentricity(Harmonic { joint: 3, order: 2.0, sine_rad: 3e-4, cosine_rad: 1e-4 }),
            Effect::ThermalDrift(Thermal {
                start_h: 0.0,
                growth: 2e-4,
                time_constant_h: 1.5,
                growth_per_k: 1.2e-5,
                reference_c: 20.0,
            }),
            Effect::BaseTilt(BaseTilt {
                deep: true,
                term: vec![
                    TiltTerm { frame: None, about: None, tilt_rad_per_nm: 1e-6, sway_mm_per_nm: 3e-4 },
                    TiltTerm {
                        frame: Some(4),
                        about: Some([0, 1]),
                        tilt_rad_per_nm: -2e-5,
                        sway_mm_per_nm: 0.0,
                    },
                ],
            }),
            Effect::AxisWobble(AxisWobble {
                joint: 2,
                tilt_rad: [1e-4, -2e-4, 5e-5, 1e-4],
                radial_mm: Some([0.02, -0.01, 0.03, 0.01]),
            }),
        ],
    }
}

fn dataset(sensor: Sensor, rows: usize, seed: u64) -> Dataset {
    let mut random = ChaCha8Rng::seed_from_u64(seed);
    let arm = arm();
    let rows = (0..rows)
        .map(|number| {
            let joints = Joints::from_fn(|_, _| random.random_range(-1.5..1.5));
            let condition = Condition {
                time_h: Some(number as f64 * 0.1),
                temperature_c: Some(21.0 + 0.1 * number as f64),
                payload_kg: Some(1.5),
                ..Condition::default()
            };
            let pose = arm.forward(&joints, &condition);
            let reading = match sensor {
                Sensor::Cable => Reading::Cable(random.random_range(400.0..900.0)),
                Sensor::Position => Reading::Position(pose.translation.vector + Vector3::new(3.0, -2.0, 1.0)),
                Sensor::Pose => {
                    Reading::Pose(Box::new(pose_from_vector(&[2.0, 1.0, -3.0, 0.02, -0.03, 0.01]) * pose))
                }
            };
            let anchor = if sensor == Sensor::Cable { number % 2 } else { 0 };
            let mut row = Row::new(number, joints, reading);
            (row.condition, row.anchor) = (condition.into(), anchor);
            row.extra_mut().motion =
                Some(Motion { step: joints * 0.3, rates: Some(Rates::steady(joints * 700.0)) });
            row
        })
        .collect();
    Dataset {
        file: "made".into(),
        sha256: String::new(),
        sensor,
        rows,
        notes: Vec::new(),
        joined_by_time: false,
        station_names: Vec::new(),
        angle_step_rad: None,
        readout_step_mm: None,
        reading_step_mm: None,
        other_columns: Vec::new(),
        sheet: None,
    }
}

/// A turn of the sensor frame as a fit of a good arm finds it.
const SMALL_TURN_RAD: f64 = 1e-3;

/// One of each kind that the sensor can suffer, none of them at rest. Each part of the sensor frame's turn is about `turn_rad`.
fn disturbances(sensor: Sensor, turn_rad: f64) -> Vec<Disturbance> {
    let rows = Profile::Rows { from: 3, to: 8 };
    let mut kinds = vec![
        (Kind::Target, rows),
        (Kind::Scale, Profile::Constant),
        (Kind::Frame { turning: sensor != Sensor::Cable }, rows),
        (Kind::Frame { turning: false }, Profile::Temperature { reference_c: 21.5 }),
        (Kind::Load { joints: vec![1, 2], compliance: None }, rows),
        (
            Kind::Load { joints: vec![1, 4], compliance: Some(vec![1e-5, 2e-5]) },
            Profile::Exponential { time_constant_h: 0.5, start_h: 0.0 },
        ),
    ];
    if sensor == Sensor::Cable {
        kinds.push((Kind::Zero, rows));
        kinds.push((Kind::Sag, Profile::Constant));
    }
    let of_pose = [
        EmpiricalFault::NonlinearStiffness { joint: 1, load: AssumedLoad::Masses, largest_mnm: 20_000 },
        EmpiricalFault::Hardening { joint: 2, load: AssumedLoad::Frame(4), bend_mnm: 300 },
        EmpiricalFault::Range { from_mm: 1000, to_mm: 3000 },
        EmpiricalFault::Refraction,
        EmpiricalFault::LoadedPlay {
            joint: 1,
            load: AssumedLoad::Frame(4),
            friction_mnm: 300,
            closing_mnm: 200,
        },
        EmpiricalFault::TwoJointGear { joint: 2, other: 3, orders: [1, 1] },
        EmpiricalFault::TwoJointGear { joint: 4, other: 5, orders: [2, 1] },
        EmpiricalFault::AxisWobble { joint: 2, radial: true },
        EmpiricalFault::TargetDroop { pole: Pole::Axis, turning: true },
        EmpiricalFault::TargetDroop { pole: Pole::Offset, turning: false },
        EmpiricalFault::TargetDroop { pole: Pole::Bracket, turning: true },
        EmpiricalFault::BaseTilt { load: Overturning::Masses, axes: None, deep: false },
        EmpiricalFault::BaseTilt { load: Overturning::Lumps, axes: Some([0, 1]), deep: true },
    ];
    let of_sensor = match sensor {
        Sensor::Cable => [
            EmpiricalFault::Pulley,
            EmpiricalFault::Drum { from_mm: 500, to_mm: 1200 },
            EmpiricalFault::CableReversal,
        ],
        _ => [EmpiricalFault::SensorAxes, EmpiricalFault::TargetNest { second: true }, EmpiricalFault::Lens],
    };
    let of_motion = [
        EmpiricalFault::Latency { middle_s: 900, corners: CornerSpeed::Before },
        EmpiricalFault::ArmUnsettled,
        EmpiricalFault::SensorUnsettled,
    ];
    let forms = of_pose.into_iter().chain(of_sensor).chain(of_motion);
    kinds.extend(forms.map(|form| (Kind::Empirical(form), Profile::Constant)));
    // A form that does not go as far in each row.
    kinds
        .extend(of_sensor.map(|form| {
            (Kind::Empirical(form), Profile::Exponential { time_constant_h: 0.5, start_h: 0.0 })
        }));
    kinds
        .into_iter()
        .map(|(kind, course)| {
            let mut out = Disturbance::new(kind, course);
            let size = match out.kind {
                Kind::Scale => 1e-3,
                // Its slope by the geometry is left out: a millionth of the length's own.
                Kind::Sag => 1e-6,
                Kind::Load { compliance: None, .. } => 1e-5,
                Kind::Empirical(form) => 0.1 * form.prior_sigma(0),
                _ => 0.6,
            };
            out.values.iter_mut().enumerate().for_each(|(k, v)| *v = size * (1.0 - 0.3 * k as f64));
            if let Kind::Frame { turning: true } = out.kind {
                out.values[3..].iter_mut().for_each(|v| *v *= turn_rad / 0.6);
            }
            out
        })
        .collect()
}

fn parameters(sensor: Sensor) -> Vec<Parameter> {
    let mut out = link_parameters(&arm());
    for (index, effect) in arm().effects.iter().enumerate() {
        out.extend((0..effect.parameters().len()).map(|parameter| Parameter::Effect { index, parameter }));
    }
    let tool = if sensor == Sensor::Pose { 6 } else { 3 };
    out.extend((0..tool).map(Parameter::Target));
    match sensor {
        Sensor::Cable => {
            for anchor in 0..2 {
                out.extend((0..3).map(|axis| Parameter::Outlet { anchor, axis }));
                out.push(Parameter::Zero { anchor });
            }
        }
        _ => out.extend((0..6).map(Parameter::SensorFrame)),
    }
    for (index, disturbance) in disturbances(sensor, SMALL_TURN_RAD).iter().enumerate() {
        out.extend(
            (0..disturbance.values.len()).map(|parameter| Parameter::Disturbance { index, parameter }),
        );
    }
    out
}

fn problem(sensor: Sensor, rows: usize) -> CalibrationProblem {
    task_with(sensor, rows, Some(SMALL_TURN_RAD))
}

/// With the turn of the sensor frame where measurements are disturbed.
fn task_with(sensor: Sensor, rows: usize, disturbed: Option<f64>) -> CalibrationProblem {
    let data = dataset(sensor, rows, 7);
    let frames = Frames {
        base_from_sensor: pose_from_vector(&[12.0, -5.0, 8.0, 0.02, 0.3, -0.1]),
        flange_from_target: pose_from_vector(&[10.0, 20.0, 30.0, 0.01, -0.02, 0.05]),
        outlets_mm: vec![Vector3::new(500.0, -600.0, 50.0), Vector3::new(-300.0, 700.0, 90.0)],
        zeros_mm: vec![3.0, -4.0],
        disturbances: disturbed.map_or_else(Vec::new, |turn_rad| disturbances(sensor, turn_rad)),
    };
    let weights: Vec<Weight> =
        (0..rows).map(|i| Weight { per_mm: 2.0 + i as f64 * 0.01, per_rad: 300.0 }).collect();
    let mut list = parameters(sensor);
    list.retain(|p| disturbed.is_some() || !matches!(p, Parameter::Disturbance { .. }));
    CalibrationProblem::new(&data, &arm(), &frames, &list, &[], &weights)
}

#[test]
fn every_column_has_a_numerical_twin() {
    let sensors = [Sensor::Cable, Sensor::Position, Sensor::Pose];
    // The last turns the sensor frame by some nine degrees.
    let courses = [None, Some(SMALL_TURN_RAD), Some(0.1)];
    for (sensor, disturbed) in sensors.into_iter().flat_map(|s| courses.map(|turn| (s, turn))) {
        let problem = task_with(sensor, 13, disturbed);
        let list = problem.free_parameters().to_vec();
        let mut random = ChaCha8Rng::seed_from_u64(3);
        let kinds: Vec<Kind> = disturbances(sensor, SMALL_TURN_RAD).into_iter().map(|d| d.kind).collect();
        // What turns with a pose is small, as the series of its rotation is.
        let turns = |index: usize| matches!(kinds[index], Kind::Empirical(form) if form.turns_target());
        let scale = |p: &Parameter| match (p, p.unit()) {
            (Parameter::Disturbance { index, .. }, _) if turns(*index) => 1e-5,
            (_, "mm") => 1.0,
            (_, "rad") => 0.02,
            _ => 1e-5,
        };
        // The torque of a load and the forms of empirical faults are taken at the starting arm.
        let loose = |p: &Parameter| match p {
            Parameter::Disturbance { index, .. } if !matches!(kinds[*index], Kind::Frame { .. }) => 3e-3,
            _ => 2e-6,
        };
        let x: Vec<f64> = list.iter().map(|p| scale(p) * random.random_range(-1.0..1.0)).collect();
        let (n, p) = (problem.rows(), list.len());
        let (mut r, mut j) = (vec![0.0; n], vec![0.0; n * p]);
        problem.jacobian(&x, 0..n, &mut r, &mut j);
        let mut alone = vec![0.0; n];
        problem.residuals(&x, 0..n, &mut alone);
        assert_eq!(r, alone, "residuals agree with and without the Jacobian");
        let analytic = DMatrix::from_vec(n, p, j);
        let steps: Vec<f64> =
            list.iter().map(|p| if scale(p) == 1.0 { 0.5 } else { 0.1 * scale(p) }).collect();
        let twin = difference::jacobian(|x, out| problem.residuals(x, 0..n, out), &x, n, &steps);
        for (k, parameter) in list.iter().enumerate() {
            let size = twin.column(k).amax().max(1e-3);
            let gap = (analytic.column(k) - twin.column(k)).amax() / size;
            assert!(gap < loose(parameter), "{sensor:?} {disturbed:?} {parameter}: relative gap {gap:e}");
        }
    }
}

/// An arm with effects reads as its forward map says, whether its effects are those of the start or added by the fit. What moves links is
/// then taken at the starting arm: a second-order difference.
#[test]
fn effects_read_as_the_forward_map_says() {
    let actual = arm();
    let mut still = actual.clone();
    let list: Vec<Parameter> = (0..still.effects.len())
        .flat_map(|index| {
            let count = still.effects[index].parameters().len();
            (0..count).map(move |parameter| Parameter::Effect { index, parameter })
        })
        .collect();
    let mut added = Vec::new();
    for effect in &mut still.effects {
        for (k, parameter) in effect.parameters().into_iter().enumerate() {
            effect.set(k, 0.0);
            added.push(parameter.value);
        }
    }
    let target = pose_from_vector(&[10.0, 20.0, 80.0, 0.1, -0.2, 0.05]);
    for sensor in [Sensor::Cable, Sensor::Position, Sensor::Pose] {
        let mut data = dataset(sensor, 13, 9);
        for row in &mut data.rows {
            let seen = actual.forward(&row.joints, &row.condition) * target;
            row.anchor = 0;
            row.reading = match sensor {
                Sensor::Cable => Reading::Cable(seen.translation.vector.norm()),
                Sensor::Position => Reading::Position(seen.translation.vector),
                Sensor::Pose => Reading::Pose(Box::new(seen)),
            };
        }
        let outlets = if sensor == Sensor::Cable { 1 } else { 0 };
        let frames = Frames { flange_from_target: target, ..Frames::at_origin(outlets) };
        let weights = [Weight { per_mm: 1.0, per_rad: 100.0 }; 13];
        let largest = |start: &Model, x: &[f64]| {
            let problem = CalibrationProblem::new(&data, start, &frames, &list, &[], &weights);
            let mut out = vec![0.0; problem.rows()];
            problem.residuals(x, 0..out.len(), &mut out);
            out.iter().fold(0.0_f64, |most, r| most.max(r.abs()))
        };
        let [from_start, from_fit] = [largest(&actual, &vec![0.0; added.len()]), largest(&still, &added)];
        assert!(largest(&still, &vec![0.0; added.len()]) > 0.1, "the effects are seen");
        assert!(from_start < 2e-5, "{sensor:?}: {from_start}");
        assert!(from_fit < 2e-4, "{sensor:?}: {from_fit}");
    }
}

/// Moment of gravity on an arm and its load about the origin of its base (N m).
fn overturning_moment(arm: &Model, row: &Row) -> Vector3<f64> {
    let newton = arm.gravity * 9.80665e-3;
    let (mut pose, mut moment) = (Pose::identity(), Vector3::zeros());
    for (i, (link, body)) in arm.links.iter().zip(arm.bodies.unwrap()).enumerate() {
        pose *= link.pose(row.joints[i]);
        moment += (pose * Point3::from(body.centre_mm)).coords.cross(&newton) * body.mass_kg;
    }
    let load = pose * arm.flange * Point3::from(row.condition.payload_centre_mm);
    moment + load.coords.cross(&newton) * row.condition.payload_kg.unwrap_or(0.0)
}

/// What a target that droops and turns on its pole and a base that turns below its origin do to a reading, worked out without the
/// regressors, leaves no residual but of second order.
#[test]
fn a_drooping_target_a_wobbling_axis_and_a_tilted_base_are_read_as_they_move() {
    let arm = Model { effects: Vec::new(), ..arm() };
    let sensor_at = pose_from_vector(&[1500.0, -700.0, 300.0, 0.2, -0.3, 0.4]);
    let target_at = pose_from_vector(&[10.0, 20.0, 80.0, 0.1, -0.2, 0.05]);
    let g = arm.gravity;
    let size = 1e-6;
    let turned = |turn: Vector3<f64>| {
        Pose::from_parts(Vector3::zeros().into(), UnitQuaternion::from_scaled_axis(turn))
    };
    let on_pole = |flange: &Pose, along: Vector3<f64>| {
        let n = flange.rotation * along;
        let droop = (g - n * n.dot(&g)) * (size * 1e3);
        (droop, n.cross(&g) * (size * 20.0))
    };
    let tilt = EmpiricalFault::BaseTilt { load: Overturning::Masses, axes: None, deep: true };
    let droops = [Pole::Axis, Pole::Offset].map(|pole| EmpiricalFault::TargetDroop { pole, turning: true });
    let joint = 2;
    let wobble = EmpiricalFault::AxisWobble { joint, radial: false };
    let forms = [droops[0], droops[1], wobble, tilt];
    for (sensor, form) in
        [Sensor::Position, Sensor::Pose].into_iter().flat_map(|s| forms.map(|form| (s, form)))
    {
        let mut data = dataset(sensor, 12, 8);
        let (mut values, mut shifted) = (vec![size * 1e3, size * 20.0], sensor_at);
        for row in &mut data.rows {
            let flange = arm.forward(&row.joints, &Condition::default());
            let mut seen = flange * target_at;
            match form {
                EmpiricalFault::TargetDroop { pole, .. } => {
                    let along = if pole == Pole::Axis {
                        Vector3::z()
                    } else {
                        target_at.translation.vector.normalize()
                    };
                    let (droop, turn) = on_pole(&flange, along);
                    seen.translation.vector += droop;
                    seen.rotation = UnitQuaternion::from_scaled_axis(turn) * seen.rotation;
                }
                EmpiricalFault::AxisWobble { .. } => {
                    // The frame in which the joint turns: where it stands at the angle 0.
                    let mut mapped = arm.joint_map * row.joints;
                    let angle = std::mem::replace(&mut mapped[joint], 0.0);
                    let stopped = arm.joint_map.try_inverse().unwrap() * mapped;
                    let still = arm.at_condition(&Condition::default()).frames(&stopped);
                    let [x, z] = [still.lateral[joint], still.z[joint]].map(Vector3::from);
                    let y = z.cross(&x);
                    let (s, c) = (2.0 * angle).sin_cos();
                    let turn = (x * (c + 0.3 * s) + y * (0.5 * s - 0.2 * c)) * size;
                    let centre = Pose::from_parts(
                        Vector3::from(still.origin[joint]).into(),
                        UnitQuaternion::identity(),
                    );
                    seen = centre * turned(turn) * centre.inverse() * seen;
                }
                _ => {
                    let moment = overturning_moment(&arm, row);
                    // About a place 400 mm below.
                    let below = Pose::from_parts((g * 400.0).into(), UnitQuaternion::identity());
                    seen = below * turned(moment * size) * below.inverse() * seen;
                }
            }
            let reading = sensor_at.inv_mul(&seen);
            row.reading = match sensor {
                Sensor::Pose => Reading::Pose(Box::new(reading)),
                _ => Reading::Position(reading.translation.vector),
            };
        }
        match form {
            // What a droop does alike in all directions, a shift of the sensor does.
            EmpiricalFault::TargetDroop { .. } => shifted.translation.vector -= g * (size * 1e3),
            EmpiricalFault::AxisWobble { .. } => values = [1.0, 0.3, -0.2, 0.5].map(|v| v * size).to_vec(),
            _ => values = vec![size, size * 400.0],
        }
        let mut fault = Disturbance::new(Kind::Empirical(form), Profile::Constant);
        fault.values.clone_from(&values);
        let frames = Frames {
            base_from_sensor: shifted,
            flange_from_target: target_at,
            disturbances: vec![fault],
            ..Frames::at_origin(0)
        };
        let list: Vec<Parameter> =
            (0..values.len()).map(|parameter| Parameter::Disturbance { index: 0, parameter }).collect();
        let weights = [Weight { per_mm: 1.0, per_rad: 100.0 }; 12];
        let problem = CalibrationProblem::new(&data, &arm, &frames, &list, &[], &weights);
        let largest = |x: &[f64]| {
            let mut out = vec![0.0; problem.rows()];
            problem.residuals(x, 0..out.len(), &mut out);
            out.iter().fold(0.0_f64, |most, r| most.max(r.abs()))
        };
        // The values are those of the start, and x is what they deviate by.
        let (with, without) =
            (largest(&vec![0.0; values.len()]), largest(&values.iter().map(|v| -v).collect::<Vec<_>>()));
        assert!(with < 1e-3 * without && without > 1e-4, "{sensor:?} {form:?}: {with:e} of {without:e}");
    }
}

/// A clock that counts from midnight, or from years ago, makes of late readings what one that counts from the first row does.
#[test]
fn late_readings_do_not_hang_on_where_the_clock_begins() {
    let arm = Model { effects: Vec::new(), ..arm() };
    let residuals = |begins_h: i32| {
        let mut data = dataset(Sensor::Position, 9, 7);
        for row in &mut data.rows {
            let time_h = row.condition.time_h.map(|t| t + f64::from(begins_h));
            row.condition = Condition { time_h, ..*row.condition }.into();
        }
        let middle_s = 900 + 3600 * i64::from(begins_h);
        let form = EmpiricalFault::Latency { middle_s, corners: CornerSpeed::Mean };
        let mut late = Disturbance::new(Kind::Empirical(form), Profile::Constant);
        late.values = vec![0.05, 0.2];
        let frames = Frames { disturbances: vec![late], ..Frames::at_origin(0) };
        let list = [
            Parameter::Disturbance { index: 0, parameter: 0 },
            Parameter::Disturbance { index: 0, parameter: 1 },
        ];
        let problem = CalibrationProblem::new(
            &data,
            &arm,
            &frames,
            &list,
            &[],
            &[Weight { per_mm: 1.0, per_rad: 1.0 }; 9],
        );
        let mut out = vec![0.0; problem.rows()];
        problem.residuals(&[0.05, 0.2], 0..out.len(), &mut out);
        out
    };
    let early = residuals(0);
    assert!(early.iter().any(|r| r.abs() > 1e-3));
    for begins_h in [14, 490_000] {
        for (late, early) in residuals(begins_h).iter().zip(&early) {
            assert!((late - early).abs() < 1e-6, "{late} and {early}");
        }
    }
}

#[test]
fn normal_equations_equal_the_stacked_jacobian_and_padding_is_silent() {
    for sensor in [Sensor::Cable, Sensor::Position, Sensor::Pose] {
        for rows in [1, 8, 13, 530] {
            let problem = problem(sensor, rows);
            let (n, p) = (problem.rows(), problem.parameters());
            let x = vec![1e-5; p];
            let (mut r, mut j) = (vec![0.0; n], vec![0.0; n * p]);
            problem.jacobian(&x, 0..n, &mut r, &mut j);
            let j = DMatrix::from_vec(n, p, j);
            let r = nalgebra::DVector::from_vec(r);
            let normal = problem.normal_equations(&x);
            let gradient = j.tr_mul(&r);
            if sensor == Sensor::Cable {
                let matrix = j.tr_mul(&j);
                assert!((normal.matrix - &matrix).amax() < 1e-10 * matrix.amax());
            }
            assert!((&normal.gradient - &gradient).amax() < 1e-10 * gradient.amax());
            assert_eq!(problem.gradient(&x), (normal.cost, normal.gradient), "to the bit");
            let cost = 0.5 * r.norm_squared();
            assert!((normal.cost - cost).abs() < 1e-11 * cost);
            assert!((problem.row_cost(&x) - cost).abs() < 1e-11 * cost);
            let half = rows / 2 * problem.rows_per_observation()..n;
            let mut part = vec![0.0; half.len()];
            problem.residuals(&x, half.clone(), &mut part);
            assert_eq!(part, r.as_slice()[half]);
        }
    }
}

/// The residual of each row as seen in the sensor's frame, a vector of three for lengths and one for angles.
fn seen_by_sensor(problem: &CalibrationProblem, x: &[f64], out: &mut [f64]) {
    problem.residuals(x, 0..out.len(), out);
    let turn = problem.apply(x).1.base_from_sensor.rotation.inverse();
    for vector in out.chunks_exact_mut(3) {
        let seen = turn * Vector3::from_column_slice(vector);
        vector.copy_from_slice(seen.as_slice());
    }
}

#[test]
fn normal_equations_are_those_of_residuals_seen_by_the_sensor() {
    for sensor in [Sensor::Position, Sensor::Pose] {
        let problem = task_with(sensor, 13, None);
        let steps: Vec<f64> =
            problem.free_parameters().iter().map(|p| if p.unit() == "mm" { 0.5 } else { 2e-3 }).collect();
        let x: Vec<f64> = steps.iter().map(|step| 0.3 * step).collect();
        let twin =
            difference::jacobian(|x, out| seen_by_sensor(&problem, x, out), &x, problem.rows(), &steps);
        let expected = twin.tr_mul(&twin);
        let found = problem.normal_equations(&x).matrix;
        for (i, j) in (0..x.len()).flat_map(|i| (0..x.len()).map(move |j| (i, j))) {
            let size = (expected[(i, i)] * expected[(j, j)]).sqrt();
            let gap = (found[(i, j)] - expected[(i, j)]).abs();
            assert!(gap < 1e-5 * size, "{sensor:?} {i} {j}: {gap:e} of {size:e}");
        }
    }
}

/// No row sees base and sensor turn together about the first joint, however large the residuals are.
#[test]
fn a_turn_of_base_and_sensor_together_is_not_seen() {
    for sensor in [Sensor::Position, Sensor::Pose] {
        let mut problem = task_with(sensor, 13, None);
        // The first joint of a base that has tilted turns about another axis, by as much.
        let upright = |index: usize| arm().effects[index].first_moved_frame().is_none();
        let mut standing = arm();
        standing.effects.retain(|effect| effect.first_moved_frame().is_none());
        assert!((0..standing.effects.len()).all(upright), "those that move links come last");
        let of_them = |p: &Parameter| !matches!(p, Parameter::Effect { index, .. } if !upright(*index));
        let list: Vec<Parameter> = problem.free_parameters().iter().copied().filter(of_them).collect();
        let frames = problem.apply(&vec![0.0; problem.parameters()]).1;
        let weights = [Weight { per_mm: 2.0, per_rad: 300.0 }; 13];
        problem = CalibrationProblem::new(&dataset(sensor, 13, 7), &standing, &frames, &list, &[], &weights);
        let x = vec![0.0; problem.parameters()];
        let origin = problem.apply(&x).1.base_from_sensor.translation.vector;
        let moved = Vector3::z().cross(&origin);
        let list = problem.free_parameters();
        let together = list.iter().map(|parameter| match parameter {
            Parameter::Link { joint: 0, coordinate: LinkCoordinate::Theta } | Parameter::SensorFrame(5) => {
                1.0
            }
            Parameter::SensorFrame(axis) if *axis < 3 => moved[*axis],
            _ => 0.0,
        });
        let together = nalgebra::DVector::from_iterator(list.len(), together);
        let normal = problem.normal_equations(&x);
        assert!(normal.cost > 1e3, "the residuals are large: {}", normal.cost);
        let joint = list
            .iter()
            .position(|p| matches!(p, Parameter::Link { joint: 0, coordinate: LinkCoordinate::Theta }));
        let alone = normal.matrix[(joint.unwrap(), joint.unwrap())];
        assert!(together.dot(&(&normal.matrix * &together)).abs() < 1e-12 * alone, "{sensor:?}");
        assert!(normal.gradient.dot(&together).abs() < 1e-9 * normal.gradient.norm());
    }
}

/// Residuals, Jacobian and whatever comes with a disturbance are the same to the bit on every set of instructions.
#[test]
fn every_set_of_instructions_gives_the_same_rows() {
    for sensor in [Sensor::Cable, Sensor::Position, Sensor::Pose] {
        let problem = problem(sensor, 21);
        let x = vec![1e-5; problem.parameters()];
        let found = |set| {
            let (mut r, mut j) = (vec![0.0; problem.rows()], vec![0.0; problem.rows() * x.len()]);
            with_instructions(set, || problem.jacobian(&x, 0..problem.rows(), &mut r, &mut j));
            r.into_iter().chain(j).map(f64::to_bits).collect::<Vec<_>>()
        };
        let alone = found(Instructions::Scalar);
        for set in Instructions::available() {
            assert!(found(set) == alone, "{sensor:?}: {set:?}");
        }
    }
}

#[test]
fn a_thinned_task_has_the_rows_that_were_chosen() {
    for sensor in [Sensor::Cable, Sensor::Position, Sensor::Pose] {
        let problem = problem(sensor, 40);
        let chosen = [3, 4, 9, 17, 18, 19, 31, 32, 38];
        let thinned = problem.subsample(&chosen).unwrap();
        let per = problem.rows_per_observation();
        assert_eq!((thinned.rows(), thinned.parameters()), (chosen.len() * per, problem.parameters()));
        let x = vec![1e-5; problem.parameters()];
        let (mut all, mut some) = (vec![0.0; problem.rows()], vec![0.0; thinned.rows()]);
        problem.residuals(&x, 0..problem.rows(), &mut all);
        thinned.residuals(&x, 0..thinned.rows(), &mut some);
        let wanted: Vec<f64> = chosen.iter().flat_map(|i| all[i * per..(i + 1) * per].to_vec()).collect();
        assert_eq!(some, wanted);
        let cost = 0.5 * some.iter().map(|r| r * r).sum::<f64>();
        assert!((thinned.normal_equations(&x).cost - cost).abs() < 1e-11 * cost);
        assert_eq!(problem.subsample(&[]).unwrap().rows(), 0);
    }
}

/// Of very many rows the angles are kept and not their sines: a row says the same among them as among few, and so does a choice
/// of them.
#[test]
fn a_row_among_very_many_is_the_same_as_among_few() {
    const MANY_ROWS: usize = 50_003;
    let (few, many) = (task_with(Sensor::Position, 13, None), task_with(Sensor::Position, MANY_ROWS, None));
    let x = vec![1e-5; few.parameters()];
    let rows = few.rows();
    let of = |problem: &dyn Problem| {
        let (mut r, mut j) = (vec![0.0; rows], vec![0.0; rows * x.len()]);
        problem.jacobian(&x, 0..rows, &mut r, &mut j);
        r.into_iter().chain(j).collect::<Vec<_>>()
    };
    let wanted = of(&few);
    let chosen: Vec<usize> = (0..13).chain([MANY_ROWS - 1]).collect();
    let thinned = many.subsample(&chosen).unwrap();
    for found in [of(&many), of(&*thinned)] {
        for (found, wanted) in found.iter().zip(&wanted) {
            assert!((found - wanted).abs() < 1e-11 * (1.0 + wanted.abs()), "{found} instead of {wanted}");
        }
    }
}

#[test]
fn residuals_equal_the_plain_forward_map() {
    let data = dataset(Sensor::Position, 11, 7);
    let list = parameters(Sensor::Position);
    let list: Vec<Parameter> =
        list.into_iter().filter(|p| !matches!(p, Parameter::Disturbance { .. })).collect();
    let mut frames = Frames::at_origin(1);
    frames.base_from_sensor = pose_from_vector(&[12.0, -5.0, 8.0, 0.02, 0.3, -0.1]);
    frames.flange_from_target = pose_from_vector(&[10.0, 20.0, 30.0, 0.01, -0.02, 0.05]);
    let weights = vec![Weight { per_mm: 1.0, per_rad: 1.0 }; 11];
    let problem = CalibrationProblem::new(&data, &arm(), &frames, &list, &[], &weights);
    let moves_links = |p: &Parameter| matches!(*p, Parameter::Effect { index, .. } if arm().effects[index].first_moved_frame().is_some());
    // Of a base 1e-5 rad/(N m) is as much as a soft joint's.
    let size = |k: usize| if moves_links(&list[k]) { 1e-7 } else { 1e-5 };
    let x: Vec<f64> = (0..problem.parameters()).map(|k| size(k) * (k as f64 - 10.0)).collect();
    let (model, frames) = problem.apply(&x);
    let errors = problem.errors_mm(&x);
    for (row, error) in data.rows.iter().zip(errors) {
        let flange: Pose = model.forward(&row.joints, &row.condition);
        let touched = flange * nalgebra::Point3::from(frames.flange_from_target.translation.vector);
        let Reading::Position(m) = row.reading else { unreachable!() };
        let measured = frames.base_from_sensor * nalgebra::Point3::from(m);
        // The torque of the compliance is taken on the starting links: a second-order difference.
        assert!(((measured - touched).norm() - error).abs() < 1e-3);
    }
}
