//! Rewriting programs: the estimated arm follows the intended path, and nothing dangerous is ever written.

// A test that cannot go on panics.
#![allow(clippy::unwrap_used, clippy::print_stderr)]

mod frame_change;
mod cut;
mod differences;
mod doubtful_effects;
mod segment;
mod circles;
mod measured_turns;
mod payload;
mod placement;
mod axis_turns;
mod backlash;
mod beyond_noise;
mod joint_limits;
mod reasons;
mod remedy;
mod half_turns;
mod joint_lines;
mod singularity;
mod start;
mod taught;
mod tip_in_wrist;

use nalgebra::{DMatrix, Vector3, Vector6};
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use truegrind_arm::condition::Condition;
use truegrind_arm::estimated::{
    Estimated, FlangePoint, Judgement, Provenance, RegisteredFrame, StageErrors, Verdict,
};
use truegrind_arm::model::{Joints, Model};
use truegrind_arm::parameter::link_parameters;
use truegrind_arm::region::Region;
use truegrind_compensation::cell::{Cell, CellFrame, FrameOrigin};
use truegrind_compensation::deviation::{After, MotionStatus, PathReport};
use truegrind_compensation::frames::taught::{taught_frame, taught_tcp};
use truegrind_compensation::options::{Emit, Options};
use truegrind_compensation::plan::reason::OutcomeReason;
use truegrind_compensation::plan::solved_program::plan;
use truegrind_compensation::plan::{MotionOutcome, Plan};
use truegrind_compensation::verify::{ActingArm, VerificationTask, verify};
use truegrind_math::se3::Pose;
use truegrind_math::statistics::ErrorSummary;
use truegrind_planning::toolpath::toolpath;
use truegrind_programs::rapid::{Task, writer};
use truegrind_programs::rewrite::RewriteOptions;
use truegrind_surfaces::sample;

fn nominal() -> Model {
    truegrind_arm::robots::load("abb-irb-120").unwrap().model
}

fn perturbed(seed: u64, scale: f64) -> Model {
    let mut random = ChaCha8Rng::seed_from_u64(seed);
    let mut model = nominal();
    for parameter in link_parameters(&model.clone()) {
        let truegrind_arm::parameter::Parameter::Link { joint, coordinate } = parameter else {
            continue;
        };
        let size = if coordinate.is_length() { 0.4 } else { 0.002 };
        let link = &mut model.links[joint];
        link.set(coordinate, link.get(coordinate) + scale * size * random.random_range(-1.0..1.0));
    }
    model
}

fn estimated(model: Model, joints: &[Joints]) -> Estimated {
    let order = link_parameters(&model);
    let n = order.len();
    let zero = StageErrors { fitted: ErrorSummary::default(), held_out: ErrorSummary::default() };
    let mut out = Estimated {
        robot: "abb-irb-120".into(),
        nominal: nominal(),
        model,
        parameters: Vec::new(),
        covariance: DMatrix::from_diagonal_element(n, n, 1e-8),
        width_uncertainty: None,
        order,
        provenance: Provenance::default(),
        registered: zero,
        calibrated: zero,
        noise_floor_mm: None,
        beyond_noise_mm: None,
        beyond_noise_rad: None,
        verdict: Verdict { status: Judgement::NotEvaluated, reasons: Vec::new() },
        region: Region::of(joints, 1.0),
        condition: Condition::default(),
    };
    out.region.sigma_mm = 1.0;
    out
}

/// The blade's program with the joints of its path.
fn blade() -> (Vec<u8>, Vec<Joints>) {
    let file = sample::BLADE.read().unwrap();
    let path = toolpath(&file, &nominal(), "abb-irb-120").unwrap();
    (writer::write(&path.draft).unwrap(), path.joints)
}

fn rewritten(source: &[u8], estimated: &Estimated, cell: &Cell, options: &Options) -> (Plan, Vec<u8>) {
    let task = Task::read(&[("p.mod", source)]);
    let planned = plan(&task.listing, estimated, cell, options);
    let edits = task.rewrite(&planned.changes, &RewriteOptions::default()).unwrap();
    (planned, edits.files[0].edits.apply(source).unwrap())
}

fn run_on(actual: &Model, original: &[u8], program: &[u8], cell: &Cell) -> PathReport {
    let (before, after) = (Task::read(&[("p.mod", original)]), Task::read(&[("p.mod", program)]));
    let judged = VerificationTask {
        original: &before.listing,
        rewritten: Some(&after.listing),
        cell,
        surface: None,
        program: "p.mod",
        name: "test",
        after: After::Achieved,
        tolerance_mm: Options::default().tolerance_mm,
        loads: [None, None],
    };
    let nominal = nominal();
    let acting =
        ActingArm { nominal: &nominal, model: actual, knowledge: None, condition: Condition::default() };
    let report = verify(&judged, &acting);
    assert!(report.differences.is_empty(), "a correction alone: {:?}", report.differences);
    report
}

fn worst(report: &PathReport, after: bool) -> f64 {
    let pick = |p: &truegrind_compensation::deviation::PathPoint| if after { p.after } else { p.before };
    report.points.iter().filter_map(pick).map(|d| d.norm_mm()).fold(0.0, f64::max)
}

#[test]
fn a_perfectly_known_arm_follows_the_blade_to_the_printed_decimals() {
    let (source, joints) = blade();
    for seed in 0..3 {
        let actual = perturbed(seed, 1.0);
        let known = estimated(actual.clone(), &joints);
        for emit in [Emit::Targets, Emit::Joints] {
            let options = Options { emit, ..Options::default() };
            let (planned, program) = rewritten(&source, &known, &Cell::default(), &options);
            assert!(
                planned.outcomes.iter().all(|o| o.status == MotionStatus::Changed),
                "{:?}",
                planned.outcomes.iter().find(|o| o.status != MotionStatus::Changed)
            );
            let report = run_on(&actual, &source, &program, &Cell::default());
            assert!(worst(&report, false) > 0.3, "the arm is off before");
            assert!(worst(&report, true) < 5e-4, "after: {} mm", worst(&report, true));
        }
    }
}

#[test]
fn the_plan_is_the_same_for_any_threads_and_whether_configurations_are_checked_or_not() {
    let (source, joints) = blade();
    let known = estimated(perturbed(5, 1.0), &joints);
    let text = String::from_utf8(source).unwrap();
    let unchecked = text.replace("ConfL\\On", "ConfL\\Off");
    assert_ne!(text, unchecked);
    let planned = |text: &str, threads: usize| {
        let task = Task::read(&[("p.mod", text.as_bytes())]);
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        pool.install(|| plan(&task.listing, &known, &Cell::default(), &Options::default()))
    };
    let one = planned(&text, 1);
    assert_eq!(format!("{one:?}"), format!("{:?}", planned(&text, 3)));
    let off = planned(&unchecked, 2);
    assert_eq!(off.points.len(), one.points.len());
    for (a, b) in one.points.iter().zip(&off.points) {
        let (a, b) = (a.joints_after.unwrap(), b.joints_after.unwrap());
        assert!((a - b).amax() < 1e-9, "{a:?} {b:?}");
    }
    // Points are for tables; without them the rewrite is the same.
    let task = Task::read(&[("p.mod", text.as_bytes())]);
    let bare =
        plan(&task.listing, &known, &Cell::default(), &Options { points: false, ..Options::default() });
    assert!(bare.points.is_empty());
    assert_eq!((bare.changes, bare.outcomes), (one.changes, one.outcomes));
}

#[test]
fn the_nominal_arm_changes_no_byte() {
    let (source, joints) = blade();
    let known = estimated(nominal(), &joints);
    let (_, program) = rewritten(&source, &known, &Cell::default(), &Options::default());
    assert!(program == source);
}

#[test]
fn a_large_correction_is_refused_and_named() {
    let (source, joints) = blade();
    let known = estimated(perturbed(1, 1.0), &joints);
    let options = Options { max_correction_mm: 0.01, ..Options::default() };
    let (planned, program) = rewritten(&source, &known, &Cell::default(), &options);
    assert!(program == source, "nothing may be written beyond the bound");
    assert!(planned.outcomes.iter().all(|o| o.status == MotionStatus::Refused));
    assert!(
        planned
            .outcomes
            .iter()
            .all(|o| matches!(o.reason(), Some(OutcomeReason::CorrectionTooLarge { mm }) if mm > 0.01))
    );
}

#[test]
fn a_joint_outside_its_measured_range_is_flagged() {
    let (source, joints) = blade();
    let actual = perturbed(2, 1.0);
    // All joints measured where the program goes, but joint 5 only to 5° below its highest.
    let highest = joints.iter().map(|q| q[4]).fold(f64::NEG_INFINITY, f64::max);
    let cut = highest - 5.0_f64.to_radians();
    let measured: Vec<Joints> = joints
        .iter()
        .map(|q| {
            let mut q = *q;
            q[4] = q[4].min(cut);
            q
        })
        .collect();
    let known = estimated(actual, &measured);
    let (planned, _) = rewritten(&source, &known, &Cell::default(), &Options::default());
    let flagged: Vec<_> = planned.outcomes.iter().filter(|o| o.status == MotionStatus::Flagged).collect();
    assert!(!flagged.is_empty());
    let by = flagged
        .iter()
        .filter_map(|o| match o.reason() {
            Some(OutcomeReason::JointNotMeasured { joint: 4, by_deg }) => Some(by_deg),
            _ => None,
        })
        .fold(0.0, f64::max);
    assert!((by - 5.0).abs() < 0.3, "joint 5 leaves by {by}°");
}

/// A tool of 600 mm is more uncertain than the flange wherever it is: what counts is whether it is more uncertain than at the measured poses.
#[test]
fn a_long_tool_is_compared_with_itself_at_the_measured_poses() {
    let (_, joints) = blade();
    let mut known = estimated(perturbed(2, 0.3), &joints);
    // Angles are known to 0.1 mrad, lengths exactly.
    for (k, parameter) in known.order.iter().enumerate() {
        let truegrind_arm::parameter::Parameter::Link { coordinate, .. } = parameter else { continue };
        known.covariance[(k, k)] = if coordinate.is_length() { 0.0 } else { 1e-8 };
    }
    let same = known.clone();
    let arm = same.model.at_condition(&same.condition);
    let sigma_mm = |length_mm: f64, q: &Joints| {
        same.position_sigma_mm(&arm, q, &Pose::translation(0.0, 0.0, length_mm), None)
    };
    let at_flange = joints.iter().map(|q| sigma_mm(0.0, q)).fold(0.0, f64::max);
    assert!(joints.iter().any(|q| sigma_mm(600.0, q) > 2.0 * at_flange), "{at_flange}");
    known.region.sigma_mm = at_flange;
    let moves = joints.iter().step_by(7).map(|q| {
        let q: Vec<String> = q.iter().map(|angle| angle.to_degrees().to_string()).collect();
        let none = "[9E9,9E9,9E9,9E9,9E9,9E9]";
        format!("MoveAbsJ [[{}],{none}]\\NoEOffs,v20,fine,long;\n", q.join(","))
    });
    let source = format!(
        "MODULE M\nPERS tooldata long:=[TRUE,[[0,0,600],[1,0,0,0]],[1,[0,0,10],[1,0,0,0],0,0,0]];\nPROC main()\n{}ENDPROC\nENDMODULE\n",
        moves.collect::<String>()
    );
    let options = Options { joint_targets: true, ..Options::default() };
    let uncertain = |known: &Estimated| {
        let (planned, _) = rewritten(source.as_bytes(), known, &Cell::default(), &options);
        let is_uncertain = |o: &MotionOutcome| matches!(o.reason(), Some(OutcomeReason::Uncertain { .. }));
        [planned.outcomes.iter().filter(|o| is_uncertain(o)).count(), planned.outcomes.len()]
    };
    let [flagged, all] = uncertain(&known);
    assert!(flagged == 0 && all > 10, "{flagged} of {all}");
    // Measured where joint 5 is straight and the arm upright alone, its tool is less uncertain there than on the blade.
    let upright = Joints::new(0.0, 0.0, -1.5, 0.0, 0.0, 0.0);
    let growth = joints.iter().map(|q| sigma_mm(600.0, q) / sigma_mm(600.0, &upright)).fold(0.0, f64::max);
    known.region.samples_deg = vec![std::array::from_fn(|i| upright[i].to_degrees())];
    known.region.spacing_deg = 1e6;
    let [flagged, _] = uncertain(&known);
    assert_eq!(flagged > 0, growth > 2.0, "{growth}");
}

#[test]
fn a_long_line_gets_targets_only_where_the_tolerance_would_be_broken() {
    let source = b"MODULE M\n PROC main()\n  MoveJ [[420,-250,300],[0,0,1,0],[-1,0,-1,0],[9E9,9E9,9E9,9E9,9E9,9E9]],v100,fine,tool0;\n  MoveL [[420,250,300],[0,0,1,0],[0,0,0,0],[9E9,9E9,9E9,9E9,9E9,9E9]],v100,fine,tool0;\n ENDPROC\nENDMODULE\n";
    let task = Task::read(&[("p.mod", &source[..])]);
    let actual = perturbed(5, 3.0);
    let known = estimated(actual.clone(), &[Joints::zeros()]);
    let loose =
        plan(&task.listing, &known, &Cell::default(), &Options { tolerance_mm: 5.0, ..Options::default() });
    assert_eq!(loose.outcomes[1].inserted, 0, "{:?}", loose.outcomes);
    let bend = loose.outcomes[1].path_deviation_mm.get().unwrap();
    assert!(bend > 0.02, "the line bends by {bend} mm");
    let options = Options { tolerance_mm: bend / 3.0, ..Options::default() };
    let tight = plan(&task.listing, &known, &Cell::default(), &options);
    assert!(tight.outcomes[1].inserted > 0);
    assert!(tight.outcomes[1].path_deviation_mm.get().unwrap() <= options.tolerance_mm);
    let edits = task.rewrite(&tight.changes, &RewriteOptions::default()).unwrap();
    let text = edits.files[0].edits.apply(source).unwrap();
    let again = Task::read(&[("p.mod", text.as_slice())]);
    assert_eq!(again.listing.motions.len(), 2 + tight.outcomes[1].inserted as usize);
    // The verification matches original targets with those among inserted ones.
    let report = run_on(&actual, source, &text, &Cell::default());
    assert_eq!(report.points.len(), 2);
    assert!(worst(&report, true) < 1e-3, "{}", worst(&report, true));
}

/// A line of a routine that is called from two places was not checked, as if its start were unknown: the path from either is.
#[test]
fn a_line_from_two_known_places_is_judged_by_the_worse_path() {
    let target =
        |x: f64, y: f64, turns: &str| format!("[[{x},{y},300],[0,0,1,0],{turns},[9E9,9E9,9E9,9E9,9E9,9E9]]");
    let source = |first: f64, second: &str| {
        let start = |y: f64| format!("MoveJ {},v100,fine,tool0;\n", target(420.0, y, "[-1,0,-1,0]"));
        let side = format!("MoveL {},v100,fine,tool0;\n", target(420.0, 250.0, "[0,0,0,0]"));
        format!(
            "MODULE M\nVAR robtarget seen;\nPROC main()\n{}side;\n{second}side;\nENDPROC\nPROC side()\n{side}ENDPROC\nENDMODULE\n",
            start(first)
        )
    };
    let actual = perturbed(5, 3.0);
    let mut known = estimated(actual, &[Joints::zeros()]);
    (known.region.min_deg, known.region.max_deg) = ([-400.0; 6], [400.0; 6]);
    known.region.spacing_deg = 1e6;
    let planned = |source: &str, tolerance_mm: f64| {
        let task = Task::read(&[("p.mod", source.as_bytes())]);
        let options = Options { tolerance_mm, ..Options::default() };
        let plan = plan(&task.listing, &known, &Cell::default(), &options);
        let line = task.listing.motions.iter().position(|motion| &*motion.instruction == "MoveL").unwrap();
        (plan.outcomes[line].clone(), plan.notes.join("\n"))
    };
    let near = format!("MoveJ {},v100,fine,tool0;\n", target(420.0, 100.0, "[0,0,0,0]"));
    let bend_mm = |source: &str| planned(source, 5.0).0.path_deviation_mm.get();
    let far_mm = bend_mm(&source(-250.0, "")).unwrap();
    assert!(far_mm > 0.02, "{far_mm}");
    let both = source(-250.0, &near);
    assert!((bend_mm(&both).unwrap() - far_mm).abs() < 1e-9, "{:?}", bend_mm(&both));
    let (outcome, notes) = planned(&both, far_mm / 3.0);
    let judged =
        matches!(outcome.reason(), Some(OutcomeReason::PathDeviation { mm }) if (mm - far_mm).abs() < 1e-9);
    assert!(outcome.status == MotionStatus::Flagged && judged && outcome.inserted == 0, "{outcome:?}");
    assert!(
        notes.contains("1 line or arc may start at more than one place")
            && !notes.contains("unknown or not corrected")
    );
    // One of the places is not known.
    let (outcome, notes) = planned(&source(-250.0, "MoveJ Offs(seen,0,0,0),v20,fine,tool0;\n"), far_mm / 3.0);
    assert_eq!((outcome.path_deviation_mm.get(), outcome.status), (None, MotionStatus::Changed));
    assert!(notes.contains("1 line or arc starts at a place that is unknown or not corrected"), "{notes}");
}

#[test]
fn a_taught_work_object_carries_its_frame_to_the_estimated_arm() {
    let (source, joints) = blade();
    let file = sample::BLADE.read().unwrap();
    let actual = perturbed(9, 1.0);
    let sheet = nominal();
    let inverse = truegrind_arm::inverse::Inverse::new(&sheet, &Condition::default(), &sheet);
    let near = joints[joints.len() / 2];
    let tip = file.points().unwrap()[joints.len() / 2].orientation;
    let teaching_deg = [[-40.0, 0.0], [40.0, 0.0], [0.0, 60.0]]
        .iter()
        .map(|[x, y]| {
            let pose = Pose::from_parts(Vector3::new(*x, *y, 0.0).into(), tip);
            let flange = file.work_object.base_from_work_object * pose * file.tool.flange_from_tool.inverse();
            let q = inverse.solve_near(&flange, &near).unwrap().joints;
            std::array::from_fn(|i| q[i].to_degrees())
        })
        .collect();
    let frame = |name: &str, origin, teaching_deg| CellFrame { teaching_deg, ..CellFrame::of(name, origin) };
    let cell = Cell {
        tool: vec![frame("tSpindle", FrameOrigin::Metrology, Vec::new())],
        wobj: vec![frame("wobjBlade", FrameOrigin::Taught, teaching_deg)],
        ..Cell::default()
    };
    // The arm is known except for its base: a rigid displacement that no sensor in the base can see.
    let mut known_model = actual.clone();
    known_model.links[0].d_mm += 0.7;
    known_model.links[0].theta_rad += 0.002;
    let known = estimated(known_model, &joints);
    let (_, program) = rewritten(&source, &known, &cell, &Options::default());
    let report = run_on(&actual, &source, &program, &cell);
    assert!(worst(&report, true) < 1e-3, "taught: the base does not matter: {}", worst(&report, true));
    // With a work object from metrology the unknown base remains in the result, and the report says so.
    let (planned, program) = rewritten(&source, &known, &Cell::default(), &Options::default());
    let report = run_on(&actual, &source, &program, &Cell::default());
    assert!(worst(&report, true) > 0.5);
    let rigid = report.registered_rms_mm(|p| p.after).unwrap();
    assert!(rigid < 1e-2, "after rigid registration nothing is left: {rigid}");
    assert!(planned.notes.iter().any(|n| n.contains("wobjBlade") && n.contains("origin not stated")));
}

#[test]
fn teaching_by_points_recovers_tool_and_frame() {
    let model = perturbed(4, 1.0);
    let posed = model.at_condition(&Condition::default());
    let tcp = Vector3::new(12.0, -7.0, 130.0);
    let inverse = truegrind_arm::inverse::Inverse::new(&model, &Condition::default(), &nominal());
    let near = Joints::new(0.1, 0.3, 0.2, 0.2, 0.6, 0.1);
    let at = posed.forward(&near) * Pose::from_parts(tcp.into(), nalgebra::UnitQuaternion::identity());
    let poses: Vec<Joints> = [[0.0, 0.0, 0.0], [0.4, 0.2, 0.0], [-0.3, 0.3, 0.4], [0.1, -0.4, -0.5]]
        .iter()
        .map(|w| {
            let turned = at * Pose::new(Vector3::zeros(), Vector3::from(*w));
            let back = Pose::from_parts(tcp.into(), nalgebra::UnitQuaternion::identity()).inverse();
            inverse.solve_near(&(turned * back), &near).unwrap().joints
        })
        .collect();
    assert!((taught_tcp(&posed, &poses).unwrap() - tcp).norm() < 1e-6);
    assert!(taught_tcp(&posed, &[near, near, near, near]).is_none());
    let frame = Pose::new(Vector3::new(400.0, 20.0, 100.0), Vector3::new(0.1, 0.2, -0.3));
    let points =
        [[-30.0, 0.0, 0.0], [50.0, 0.0, 0.0], [0.0, 70.0, 0.0]].map(|p| frame * nalgebra::Point3::from(p));
    let found = taught_frame(&points).unwrap();
    assert!((found.translation.vector - frame.translation.vector).norm() < 1e-9);
    assert!(found.rotation.angle_to(&frame.rotation) < 1e-9);
}

#[test]
fn the_quick_sigma_equals_the_covariance() {
    let (_, joints) = blade();
    let mut known = estimated(perturbed(3, 1.0), &joints);
    let n = known.order.len();
    let mut random = ChaCha8Rng::seed_from_u64(8);
    let factor = DMatrix::from_fn(n, n, |_, _| random.random_range(-1e-3..1e-3));
    known.covariance = &factor * factor.transpose();
    let posed = known.model.at_condition(&known.condition);
    let tool = Pose::new(Vector3::new(5.0, -3.0, 120.0), Vector3::new(0.1, 0.0, 0.2));
    for q in joints.iter().step_by(37) {
        let slow = known.position_covariance(&posed, q, &tool).trace().sqrt();
        let quick = known.position_sigma_mm(&posed, q, &tool, None);
        assert!((slow - quick).abs() < 1e-9 * slow, "{slow} {quick}");
    }
    // Relative to two frames at once, row by row or in lanes: the same bits.
    let mut frame = || RegisteredFrame {
        origin_mm: Vector3::new(400.0, 20.0, 100.0),
        twists: (0..n).map(|_| Vector6::from_fn(|_, _| random.random_range(-1.0..1.0))).collect(),
        beyond_share: 0.3,
    };
    let frames = [frame(), frame()];
    let chosen = |k: usize| [None, Some(frames[0].carried()), Some(frames[1].carried())][k % 3];
    let at = |carried, q: &Joints| FlangePoint { joints: *q, flange_from_tool: tool, carried };
    let rows: Vec<&Joints> = joints.iter().step_by(11).collect();
    let points: Vec<FlangePoint<'_>> = rows.iter().enumerate().map(|(k, q)| at(chosen(k), q)).collect();
    let others: Vec<_> = (0..rows.len()).map(|k| (k % 5 > 0).then(|| chosen(k / 2))).collect();
    let both = known.position_sigmas_mm_in_two(&posed, &points, &others);
    for (k, q) in rows.iter().enumerate() {
        let alone = |carried| known.position_sigma_mm(&posed, q, &tool, carried);
        assert_eq!(both[k], (alone(chosen(k)), others[k].map(alone)), "row {k}");
    }
}

#[test]
fn single_precision_is_stated_at_its_known_spacing() {
    use truegrind_compensation::plan::single_precision::single_precision;
    use truegrind_programs::rewrite::{Change, NewTarget};
    assert_eq!(single_precision(&[]), None);
    // Between 1024 and 2048 single precision has a spacing of 2^-13 mm: half of it is the most a number is off.
    let at = |x: f64| NewTarget::Cartesian {
        position_mm: [x, 0.0, 0.0],
        quaternion: [1.0, 0.0, 0.0, 0.0],
        conf: None,
    };
    let half = 0.5 * 2.0_f64.powi(-13);
    let change = |target| Change { motion: 0, targets: [target].into(), before: vec![] };
    let off = single_precision(&[change(at(1500.0)), change(at(1500.0 + half))]).unwrap();
    assert!((off.position_mm - half).abs() < 1e-12, "{off:?}");
    assert_eq!(off.orientation_deg, 0.0);
    let joints = NewTarget::Joint { robot_deg: [90.0 + 2.0_f64.powi(-18), 0.0, 0.0, 0.0, 0.0, 0.0] };
    let off = single_precision(&[change(joints)]).unwrap();
    assert!((off.joint_deg - 2.0_f64.powi(-18)).abs() < 1e-12 && off.text().contains("per joint"), "{off:?}");
    // Of many rotations the largest counts, to the bit.
    let mut random = ChaCha8Rng::seed_from_u64(9);
    let turned = |random: &mut ChaCha8Rng| NewTarget::Cartesian {
        position_mm: [0.0; 3],
        quaternion: std::array::from_fn(|_| random.random_range(-1.0..1.0)),
        conf: None,
    };
    let all: Vec<Change> = (0..500).map(|_| change(turned(&mut random))).collect();
    let alone = all.iter().map(|one| single_precision(std::slice::from_ref(one)).unwrap().orientation_deg);
    assert_eq!(single_precision(&all).unwrap().orientation_deg, alone.fold(0.0, f64::max));
}
