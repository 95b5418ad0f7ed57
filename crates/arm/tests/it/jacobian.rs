//! Every analytic derivative of the pose against its numerical twin.

use nalgebra::{DMatrix, Vector3};
use truegrind_arm::condition::Condition;
use truegrind_arm::effect::Effect;
use truegrind_arm::effect::backlash::Backlash;
use truegrind_arm::jacobian::{BaseAndTool, joint_jacobian, parameter_jacobian};
use truegrind_arm::model::{Joints, Model};
use truegrind_arm::parameter::{LinkCoordinate, Parameter, link_parameters};
use truegrind_math::difference::jacobian;
use truegrind_math::se3::{Pose, difference};

use super::arms::{SHEETS, even, generator, joints_within, perturbed, with_effects};

fn condition() -> Condition {
    Condition {
        time_h: Some(0.7),
        temperature_c: Some(31.0),
        payload_kg: Some(4.0),
        payload_centre_mm: [10.0, -20.0, 60.0],
        approach: [1, -1, 0, 1, -1, 1],
    }
}

/// Each column within `relative` of its own size, or of `floor`.
fn assert_columns_agree(analytic: &DMatrix<f64>, twin: &DMatrix<f64>, relative: f64, floor: f64, what: &str) {
    assert_eq!(analytic.shape(), twin.shape());
    for k in 0..analytic.ncols() {
        // Translation [mm] and rotation [rad] are judged each by its own size.
        for rows in [0..3, 3..6] {
            let (a, t) = (analytic.column(k), twin.column(k));
            let size = rows.clone().map(|i| t[i].abs()).fold(floor, f64::max);
            let error = rows.map(|i| (a[i] - t[i]).abs()).fold(0.0, f64::max);
            assert!(error <= relative * size, "{what}, column {k}: {error:e} of {size:e}\n{a}{t}");
        }
    }
}

fn spoiled(sheet: usize, seed: u64) -> Model {
    let mut random = generator(seed);
    let mut model = with_effects(&perturbed(&SHEETS[sheet].model(), &mut random, 3.0, 1.0), &mut random);
    model.flange = Pose::new(Vector3::new(5.0, 6.0, 7.0), Vector3::new(0.3, -0.2, 0.1));
    model.gravity = Vector3::new(0.3, -0.2, -0.9).normalize();
    model.effects.push(Effect::Backlash(Backlash { joint: 1, play_rad: 3e-4 }));
    model
}

#[test]
fn joint_jacobian_has_a_numerical_twin_on_every_arm() {
    for (sheet, named) in SHEETS.iter().enumerate() {
        let model = spoiled(sheet, 31);
        let posed = model.at_condition(&condition());
        let mut random = generator(32);
        for _ in 0..5 {
            let q = joints_within(&model, &mut random);
            let here = posed.forward(&q);
            let analytic = joint_jacobian(&posed, &q, &posed.frames(&q), &here.translation.vector.into());
            let twin = jacobian(
                |x, out| {
                    let there = posed.forward(&Joints::from_column_slice(x));
                    out.copy_from_slice(difference(&here, &there).as_slice());
                },
                q.as_slice(),
                6,
                // The line of order 80 wants a short step.
                &[2e-4; 6],
            );
            let analytic = DMatrix::from_column_slice(6, 6, analytic.as_slice());
            assert_columns_agree(&analytic, &twin, 1e-7, 1e-2, named.name);
        }
    }
}

/// All numbers of an arm between two frames, and the pose for any values of them.
struct Numbers {
    parameters: Vec<Parameter>,
    values: Vec<f64>,
    steps: Vec<f64>,
}

impl Numbers {
    fn of(model: &Model, ends: &BaseAndTool) -> Self {
        let mut parameters: Vec<Parameter> = (0..6).map(Parameter::SensorFrame).collect();
        parameters.extend(link_parameters(model));
        // Every link has all five, whichever four are free.
        for joint in 0..6 {
            for coordinate in [LinkCoordinate::Beta, LinkCoordinate::D] {
                let more = Parameter::Link { joint, coordinate };
                if !parameters.contains(&more) {
                    parameters.push(more);
                }
            }
        }
        for (index, effect) in model.effects.iter().enumerate() {
            parameters.extend(
                (0..effect.parameters().len()).map(|parameter| Parameter::Effect { index, parameter }),
            );
        }
        parameters.extend((0..6).map(Parameter::Target));
        let value = |p: &Parameter| match *p {
            Parameter::SensorFrame(k) => ends.world_from_base[k],
            Parameter::Target(k) => ends.flange_from_tool[k],
            Parameter::Link { joint, coordinate } => model.links[joint].get(coordinate),
            Parameter::Effect { index, parameter } => model.effects[index].parameters()[parameter].value,
            _ => unreachable!(),
        };
        let step = |p: &Parameter| match (p, p.unit()) {
            (Parameter::Effect { index, parameter }, _) => {
                let number = &model.effects[*index].parameters()[*parameter];
                match (number.name, number.unit) {
                    (_, "rad/(N m)" | "rad kg/(N m)") => 1e-5,
                    (_, "rad/(N m)²") => 1e-7,
                    (_, "rad/(N m)³") => 1e-9,
                    // Far from its knot a spline is almost nothing, and a short step would be all rounding.
                    ("knot", _) => 5e-4,
                    // So is a bump near its border.
                    ("weight", _) => 3e-3,
                    _ => 1e-4,
                }
            }
            (_, "mm") => 1e-1,
            _ => 1e-3,
        };
        let values = parameters.iter().map(value).collect();
        let steps = parameters.iter().map(step).collect();
        Self { parameters, values, steps }
    }

    fn pose(&self, model: &Model, ends: &BaseAndTool, x: &[f64], q: &Joints) -> Pose {
        let (mut model, mut ends) = (model.clone(), *ends);
        for (parameter, &value) in self.parameters.iter().zip(x) {
            match *parameter {
                Parameter::SensorFrame(k) => ends.world_from_base[k] = value,
                Parameter::Target(k) => ends.flange_from_tool[k] = value,
                Parameter::Link { joint, coordinate } => model.links[joint].set(coordinate, value),
                Parameter::Effect { index, parameter } => model.effects[index].set(parameter, value),
                _ => unreachable!(),
            }
        }
        ends.forward(&model.at_condition(&condition()), q)
    }
}

#[test]
fn parameter_jacobian_has_a_numerical_twin_on_every_arm() {
    for (sheet, named) in SHEETS.iter().enumerate() {
        let mut model = spoiled(sheet, 33);
        // The torques turn with the links: a second-order share, which the analytic derivative leaves out. Without
        // compliance everything is exact; compliance has a test of its own, as has what moves with the links.
        let yields =
            ["joint-compliance", "joint-stiffness", "link-bending", "link-twist", "base-tilt", "axis-wobble"];
        model.effects.retain(|e| !yields.contains(&e.name()) && !matches!(e, Effect::LoadedBacklash(_)));
        let mut random = generator(34);
        let mut six = |mm: f64, rad: f64| {
            std::array::from_fn(|k| if k < 3 { mm * even(&mut random) } else { rad * even(&mut random) })
        };
        let ends = BaseAndTool { world_from_base: six(500.0, 1.0), flange_from_tool: six(200.0, 1.0) };
        let numbers = Numbers::of(&model, &ends);
        let q = joints_within(&model, &mut random);
        let posed = model.at_condition(&condition());
        let analytic = parameter_jacobian(&ends, &posed, &q, &numbers.parameters);
        let here = ends.forward(&posed, &q);
        let twin = jacobian(
            |x, out| {
                out.copy_from_slice(difference(&here, &numbers.pose(&model, &ends, x, &q)).as_slice());
            },
            &numbers.values,
            6,
            &numbers.steps,
        );
        let analytic = DMatrix::from_column_slice(6, analytic.ncols(), analytic.as_slice());
        assert_columns_agree(&analytic, &twin, 1e-7, 1e-2, named.name);
    }
}

#[test]
fn compliance_has_a_numerical_twin_in_its_own_parameter() {
    let mut model = spoiled(0, 35);
    model.effects.retain(|effect| {
        effect.needs_torque()
            || effect.first_moved_frame().is_some()
            || matches!(effect, Effect::LoadedBacklash(_))
    });
    let ends = BaseAndTool { world_from_base: [0.0; 6], flange_from_tool: [10.0, 0.0, 100.0, 0.0, 0.5, 0.0] };
    let mut numbers = Numbers::of(&model, &ends);
    let keep: Vec<usize> = (0..numbers.parameters.len())
        .filter(|&k| matches!(numbers.parameters[k], Parameter::Effect { .. }))
        .collect();
    numbers.parameters = keep.iter().map(|&k| numbers.parameters[k]).collect();
    numbers.values = keep.iter().map(|&k| numbers.values[k]).collect();
    numbers.steps = keep.iter().map(|&k| numbers.steps[k]).collect();
    let mut random = generator(36);
    for _ in 0..10 {
        let q = joints_within(&model, &mut random);
        let posed = model.at_condition(&condition());
        let analytic = parameter_jacobian(&ends, &posed, &q, &numbers.parameters);
        let here = ends.forward(&posed, &q);
        let twin = jacobian(
            |x, out| out.copy_from_slice(difference(&here, &numbers.pose(&model, &ends, x, &q)).as_slice()),
            &numbers.values,
            6,
            &numbers.steps,
        );
        let analytic = DMatrix::from_column_slice(6, analytic.ncols(), analytic.as_slice());
        assert_columns_agree(&analytic, &twin, 1e-7, 1e-2, "compliance");
    }
}

#[test]
fn parameters_of_a_cable_move_no_pose() {
    let model = spoiled(0, 37);
    let ends = BaseAndTool { world_from_base: [0.0; 6], flange_from_tool: [0.0; 6] };
    let cable = [Parameter::Zero { anchor: 0 }, Parameter::Outlet { anchor: 0, axis: 2 }];
    let columns = parameter_jacobian(&ends, &model.at_condition(&condition()), &Joints::zeros(), &cable);
    assert_eq!(columns.amax(), 0.0);
}
