//! The cheapest measurement that makes a position known, predicted and then actually made: rows are simulated, the arm is
//! identified, the program is planned, and the predicted sigma of the position is compared with a fit including the proposed
//! rows.
//!
//! The class of fault: a remedy that is proposed by rule, whether it helps or not.

use std::fmt::Write as _;
use std::ops::AddAssign;

use nalgebra::{DMatrix, DVector, Vector3};
use truegrind_arm::condition::Condition;
use truegrind_arm::estimated::Estimated;
use truegrind_arm::inverse::Inverse;
use truegrind_arm::model::{Joints, Model};
use truegrind_arm::parameter::{LinkCoordinate, Parameter};
use truegrind_arm::sensor::Sensor;
use truegrind_calibration::identification::calibration::{CalibrationProblem, Weight};
use truegrind_calibration::identification::fit::frame_parameters;
use truegrind_calibration::identification::identify::{self, Identification, identify};
use truegrind_calibration::identification::start::candidate_frames;
use truegrind_calibration::identification::tolerance::Tolerance;
use truegrind_calibration::measurement::dataset::Dataset;
use truegrind_calibration::measurement::simulation::recipe::Recipe;
use truegrind_calibration::measurement::{import, split};
use truegrind_compensation::cell::Cell;
use truegrind_compensation::frames::taught::taught_frame;
use truegrind_compensation::options::Options;
use truegrind_compensation::plan::solved_program::plan;
use truegrind_compensation::risk::placement::{ObjectPlacement, Placement};
use truegrind_compensation::risk::remedy::{Measurement, Remedy};
use truegrind_estimation::least_squares::lm;
use truegrind_estimation::problem::Problem;
use truegrind_math::se3::Pose;
use truegrind_programs::rapid::Task;

use super::{estimated, nominal};

/// Prediction and result agree within this factor: sensor and target positions are assumed, and the widths of the tolerances
/// are estimated again.
const NEAR: f64 = 2.0;

const ON_AXIS: &str = "0.0, 0.0, 61.3";
const BESIDE: &str = "98.2, 12.6, 61.3";

/// Rows of an arm, read by a tracker; two seeds, an even one and the next, are of one arm.
fn rows(seed: u64, count: usize, target: &str) -> (Dataset, Model) {
    let arm = seed / 2;
    let recipe = format!(
        "robot = \"abb-irb-120\"\nseed = {seed}\n[arm.random]\nseed = {arm}\na_mm = 0.4\nd_mm = 0.4\nalpha_deg = 0.1\n\
         beta_deg = 0.1\ntheta_deg = 0.15\n[poses]\nkind = \"random\"\ncount = {count}\n\
         min_deg = [-90.0, -50.0, -60.0, -120.0, -100.0, -150.0]\nmax_deg = [90.0, 60.0, 50.0, 120.0, 100.0, 150.0]\n\
         [sensor]\nkind = \"position\"\nframe = {{ position_mm = [1310.5, -640.2, 512.7], wxyz = [0.12, 0.02, -0.03, 0.99] }}\n\
         reflector_mm = [{target}]\n[noise]\nsigma_mm = 0.03\njoints_deg = 0.0005\n"
    );
    let recipe = Recipe::parse(&recipe, "rows").unwrap();
    let simulation = recipe.simulate(|_| Ok(nominal())).unwrap();
    let read = import::read("rows.csv", simulation.csv.as_bytes(), &import::Options::default()).unwrap();
    (read, simulation.actual)
}

/// The arm identified from the rows; with the true frame of the sensor where it is stated.
fn identified(rows: &Dataset, stated: bool) -> Identification {
    let mut options = identify::Options::default();
    let mut frames = candidate_frames(rows, &nominal()).unwrap().remove(0);
    if stated {
        options.tolerance = Tolerance { frame_mm: 0.1, frame_rad: 1e-4, ..options.tolerance };
        let turn =
            nalgebra::UnitQuaternion::from_quaternion(nalgebra::Quaternion::new(0.12, 0.02, -0.03, 0.99));
        frames.base_from_sensor = Pose::from_parts(Vector3::new(1310.5, -640.2, 512.7).into(), turn);
    }
    let share = |rows: &Dataset| split::random(rows, 0.2, 0);
    identify(rows, "abb-irb-120", &nominal(), &frames, &share, &options).unwrap()
}

fn rapid(frame: &Pose) -> String {
    let (t, q) = (frame.translation.vector, frame.rotation.quaternion());
    format!("[[{:.5},{:.5},{:.5}],[{:.9},{:.9},{:.9},{:.9}]]", t.x, t.y, t.z, q.w, q.i, q.j, q.k)
}

const TOOL: [f64; 3] = [20.0, -10.0, 150.0];

/// A raster over a part, with joints. `held`: by the robot, with a stationary tool.
struct Scene {
    object: Pose,
    tool: Pose,
    held: bool,
    targets: Vec<(Pose, Joints)>,
}

impl Scene {
    fn of(held: bool) -> Self {
        let sheet = nominal();
        let still = Condition::default();
        let inverse = Inverse::new(&sheet, &still, &sheet);
        let start = Joints::new(0.3, 0.2, 0.1, 0.4, 0.9, 0.5);
        let flange = sheet.at_condition(&still).forward(&start);
        let on_flange = Pose::translation(TOOL[0], TOOL[1], TOOL[2]);
        let middle = flange * on_flange;
        let (object, tool) = if held { (on_flange, middle) } else { (middle, on_flange) };
        let mut near = start;
        let targets = (0..16).map(|k| {
            let (row, column) = (f64::from(k / 4), f64::from(k % 4));
            let at = Vector3::new(40.0 * (column - 1.5), 25.0 * (row - 1.5), 0.0);
            let target = Pose::new(at, Vector3::new(0.05 * row, 0.08 * column, 0.0));
            let flange =
                if held { tool * (object * target).inverse() } else { object * target * tool.inverse() };
            near = inverse.solve_near(&flange, &near).unwrap().joints;
            (target, near)
        });
        let targets = targets.collect();
        Self { object, tool, held, targets }
    }

    fn text(&self) -> String {
        let sheet = nominal();
        let still = Condition::default();
        let inverse = Inverse::new(&sheet, &still, &sheet);
        let (tool, part) = if self.held { ("FALSE", "TRUE") } else { ("TRUE", "FALSE") };
        let mut text = format!(
            "MODULE Cut\nTASK PERS tooldata disc:=[{tool},{},[1,[0,0,50],[1,0,0,0],0,0,0]];\n\
             TASK PERS wobjdata part:=[{part},TRUE,\"\",{},[[0,0,0],[1,0,0,0]]];\nPROC main()\n",
            rapid(&self.tool),
            rapid(&self.object),
        );
        for (k, (pose, joints)) in self.targets.iter().enumerate() {
            let conf = inverse.configuration(joints);
            let pose = rapid(pose);
            let _ = writeln!(
                text,
                "{} [{},[{},{},{},{}],[9E9,9E9,9E9,9E9,9E9,9E9]],v50,z0,disc\\WObj:=part;",
                if k == 0 { "MoveJ" } else { "MoveL" },
                &pose[1..pose.len() - 1],
                conf.cf1,
                conf.cf4,
                conf.cf6,
                conf.cfx
            );
        }
        text + "ENDPROC\nENDMODULE\n"
    }

    fn planned(&self, known: &Estimated, cell: &Cell, max_risk: f64) -> ObjectPlacement {
        let text = self.text();
        let task = Task::read(&[("cut.mod", text.as_bytes())]);
        let planned = plan(&task.listing, known, cell, &Options { max_risk, ..Options::default() });
        let [placement] = planned.placements.as_slice() else { panic!("{:?}", planned.notes) };
        placement.clone()
    }

    /// An arm under which the position is not corrected, from rows of seeds from `seed` on.
    fn not_placed(&self, seed: u64, mut arm: impl FnMut(&Dataset) -> Estimated) -> Estimated {
        let arms = (seed..seed + 12).map(|seed| arm(&rows(seed, 150, BESIDE).0));
        let mut shape =
            arms.filter(|known| self.planned(known, &Cell::default(), 0.1).applied == Placement::Shape);
        shape.next().unwrap()
    }

    fn remedy(&self, known: &Estimated) -> Remedy {
        let placement = self.planned(known, &Cell::default(), 0.1);
        assert_eq!(placement.applied, Placement::Shape, "{placement:?}");
        placement.remedy.unwrap()
    }
}

fn near(foreseen: f64, came: f64) -> bool {
    foreseen < NEAR * came && came < NEAR * foreseen
}

#[test]
fn where_touching_three_points_is_enough_it_is_named_and_brings_what_was_said() {
    let mut scene = Scene::of(false);
    // The work object as the controller computed it from three touched points.
    let sheet = nominal();
    let arm = sheet.at_condition(&Condition::default());
    let touched = [0, 3, 12].map(|k| scene.targets[k].1);
    let points = touched.map(|q| (arm.forward(&q) * scene.tool).translation.vector.into());
    let told = taught_frame(&points).unwrap();
    for (target, _) in &mut scene.targets {
        *target = told.inverse() * scene.object * *target;
    }
    scene.object = told;
    let known = scene.not_placed(3, |rows| identified(rows, false).estimated);
    let remedy = scene.remedy(&known);
    assert_eq!(remedy.measurements, [Measurement::Touch], "{remedy:?}");
    assert!(remedy.suffices);
    let joints: Vec<String> =
        touched.iter().map(|q| format!("{:?}", q.map(f64::to_degrees).as_slice())).collect();
    let cell = format!(
        "[[wobj]]\nname = \"part\"\norigin = \"taught\"\ntaught_with = \"disc\"\nteaching_deg = [{}]\n",
        joints.join(", ")
    );
    let then = scene.planned(&known, &Cell::from_toml(&cell).unwrap(), 0.1);
    assert!(then.taught);
    // The uncertainty of touching by hand is predicted too, and unknown to the model: 0.05 mm at each
    // point.
    let foreseen = remedy.sigma_mm;
    assert!(foreseen > 0.02 && near(foreseen, then.sigma_mm.hypot(0.05)), "{foreseen} {then:?}");
    let before = scene.planned(&known, &Cell::default(), 0.1).sigma_mm;
    assert!(then.sigma_mm < 0.5 * before);
}

#[test]
fn where_the_sensors_frame_is_what_is_missing_it_is_named_and_brings_what_was_said() {
    // The robot holds the part: nothing can be touched, and the position of the stationary tool depends on
    // the base.
    let scene = Scene::of(true);
    let mut stated = None;
    let known = scene.not_placed(30, |rows| {
        stated = Some(identified(rows, true).estimated);
        identified(rows, false).estimated
    });
    let remedy = scene.remedy(&known);
    assert_eq!(remedy.measurements, [Measurement::Frame], "{remedy:?}");
    assert!(remedy.suffices);
    let then = scene.planned(&stated.unwrap(), &Cell::default(), 0.1);
    assert!(near(remedy.sigma_mm, then.sigma_mm), "{remedy:?} {then:?}");
}

/// The covariance of the arm's parameters after rows, by the calibration's own derivatives, for a fit that starts from the
/// previous knowledge.
fn fitted(known: &Estimated, rows: &Dataset) -> DMatrix<f64> {
    let frames = candidate_frames(rows, &nominal()).unwrap().remove(0);
    let own = frame_parameters(rows);
    let parameters = [known.order.clone(), own.clone()].concat();
    let priors = Tolerance::default().priors(&parameters, &known.model);
    let sigma_mm = known.calibrated.held_out.rmse / 3.0_f64.sqrt();
    let weights = vec![Weight { per_mm: 1.0 / sigma_mm, per_rad: 1.0 }; rows.rows.len()];
    let n = known.order.len();
    // Sensor and target first, with the arm as it is known.
    let problem = CalibrationProblem::new(rows, &known.model, &frames, &own, &priors[n..], &weights);
    let found = lm::solve(&problem, &vec![0.0; own.len()], &lm::Options::default());
    let (_, frames) = problem.apply(&found.x);
    let problem = CalibrationProblem::new(rows, &known.model, &frames, &parameters, &priors, &weights);
    let mut normal = problem.normal_equations(&vec![0.0; parameters.len()]);
    normal.symmetrize();
    let before = known.covariance.clone().cholesky().unwrap().inverse();
    normal.matrix.view_mut((0, 0), (n, n)).add_assign(&before);
    for (k, prior) in priors.iter().enumerate().skip(n) {
        normal.matrix[(k, k)] += prior.sigma.powi(-2);
    }
    let all = normal.matrix.cholesky().unwrap().inverse();
    all.view((0, 0), (n, n)).into_owned()
}

#[test]
fn where_the_axis_of_joint_6_is_not_known_a_target_beside_it_is_named_and_brings_what_was_said() {
    let scene = Scene::of(true);
    let (measured, actual) = rows(6, 150, ON_AXIS);
    let joints: Vec<Joints> = measured.rows.iter().map(|row| row.joints).collect();
    let mut known = estimated(actual, &joints);
    // A tilt of axis 6 that a target on that axis does not see: its position on link 5 compensates for it
    // there.
    let place = |coordinate| {
        let parameter = Parameter::Link { joint: 4, coordinate };
        known.order.iter().position(|p| *p == parameter).unwrap()
    };
    let (tilt, shift) = (place(LinkCoordinate::Alpha), place(LinkCoordinate::D));
    let far = known.model.links[5].d_mm + 60.0;
    let still = Condition::default();
    let arm = known.model.at_condition(&still);
    let unseen = |sense: f64| {
        let mut out = DVector::zeros(known.order.len());
        (out[tilt], out[shift]) = (0.004, sense * 0.004 * far);
        let on_axis = Pose::translation(0.0, 0.0, 60.0);
        let moved = (known.position_jacobian(&arm, &joints[0], &on_axis) * &out).norm();
        (out, moved)
    };
    // In which sense it makes up for it, the arm says.
    let (there, back) = (unseen(1.0), unseen(-1.0));
    let (unseen, moved) = if there.1 < back.1 { there } else { back };
    assert!(moved < 0.02, "a target on the axis moves by {moved} mm");
    known.covariance += &unseen * unseen.transpose();
    known.provenance.sensor = Sensor::Position;
    known.calibrated.held_out.rmse = 0.03 * 3.0_f64.sqrt();
    // The position's deviation is less than its uncertainty.
    known.nominal = known.model.clone();
    let before = scene.planned(&known, &Cell::default(), 0.1);
    let remedy = scene.remedy(&known);
    let [Measurement::Beside { poses }] = remedy.measurements[..] else { panic!("{remedy:?} {before:?}") };
    assert!(remedy.suffices && remedy.sigma_mm < 0.5 * before.sigma_mm, "{remedy:?} {before:?}");
    let (second, _) = rows(7, poses as usize, BESIDE);
    known.covariance = fitted(&known, &second);
    let then = scene.planned(&known, &Cell::default(), 0.1);
    assert!(near(remedy.sigma_mm, then.sigma_mm), "{remedy:?} {then:?}");
}

#[test]
fn where_nothing_is_enough_that_is_said_and_what_the_best_would_leave() {
    // The nominal arm itself: its position has no deviation, and nothing determines that better.
    let scene = Scene::of(true);
    let joints: Vec<Joints> = scene.targets.iter().map(|t| t.1).collect();
    let mut known = estimated(nominal(), &joints);
    known.covariance *= 1e-4;
    let placement = scene.planned(&known, &Cell::default(), 0.1);
    let remedy = scene.remedy(&known);
    assert!(!remedy.suffices && remedy.sigma_mm <= placement.sigma_mm, "{remedy:?} {placement:?}");
    // Nor is anything proposed where no risk at all is accepted.
    let (rows, _) = rows(3, 150, BESIDE);
    let known = identified(&rows, false).estimated;
    let remedy = scene.planned(&known, &Cell::default(), 0.0).remedy.unwrap();
    assert!(!remedy.suffices && !remedy.measurements.is_empty());
}
