//! Where an NC program begins: no word states the configuration.

use nalgebra::DMatrix;
use truegrind_arm::condition::Condition;
use truegrind_arm::estimated::Estimated;
use truegrind_arm::model::Joints;
use truegrind_arm::parameter::link_parameters;
use truegrind_arm::robots;
use truegrind_compensation::cell::{Cell, CellError};
use truegrind_compensation::deviation::After;
use truegrind_compensation::frames::taught::contradictions;
use truegrind_compensation::options::Options;
use truegrind_compensation::plan::Plan;
use truegrind_compensation::plan::solved_program::plan;
use truegrind_compensation::verify::{ActingArm, VerificationTask, verify};
use truegrind_programs::motion::{Frame, Listing, NcFacts};
use truegrind_programs::nc::Task;
use truegrind_programs::nc::setup::Setup;

fn arm(robot: &str) -> Estimated {
    let model = robots::load(robot).unwrap().model;
    let order = link_parameters(&model);
    let n = order.len();
    let mut estimated = super::estimated(model.clone(), &[Joints::zeros()]);
    estimated.nominal = model;
    (estimated.order, estimated.covariance) = (order, DMatrix::from_diagonal_element(n, n, 1e-12));
    estimated.model.links[3].theta_rad += 1e-3;
    estimated
}

/// Two places on either side of the arm, with a tool that points down.
fn listing(x: f64, z: f64) -> Listing {
    let source = format!(
        "O1\n(truegrind angles wpr)\nG90 G21 G17 G54\nT1 M6\nG43.4 H1\nG1 X{x:.1} Y{:.1} Z{z:.1} A180. B0. C0. F600.\n\
         G1 X{x:.1} Y-{:.1} Z{z:.1} A180. B0. C0.\nM30\n",
        0.5 * x,
        0.5 * x
    );
    let frame = |z: f64| Frame { position_mm: [0.0, 0.0, z], quaternion: [1.0, 0.0, 0.0, 0.0] };
    let mut setup = Setup::default();
    setup.tools.push(("T1".to_owned(), frame(20.0)));
    setup.frames.push(("G54".to_owned(), frame(0.0)));
    Task::read(&[("p.nc", source.as_bytes())], &setup).listing
}

fn planned(arm: &Estimated, listing: &Listing, cell: &Cell) -> Plan {
    plan(listing, arm, cell, &Options::default())
}

fn started(start_deg: [f64; 6]) -> Cell {
    Cell { start_deg: Some(start_deg), ..Cell::default() }
}

fn joints_deg(plan: &Plan) -> Vec<[f64; 6]> {
    let joints = plan.points.iter().map(|point| point.joints_before.unwrap());
    joints.map(|q| std::array::from_fn(|j| q[j].to_degrees())).collect()
}

/// A UR arm turns every joint by a whole turn either way; its elbow is up.
#[test]
fn a_ur_arm_begins_without_whole_turns() {
    let plan = planned(&arm("universal-robots-ur10"), &listing(500.0, 200.0), &Cell::default());
    let q = joints_deg(&plan)[0];
    assert!(q[1] < 0.0 && q[2] > 0.0 && q.iter().all(|q| q.abs() < 180.0), "{q:?}");
}

/// A robot, where its tool points down before it (mm), the sign of axis 1 and of axis 5 as its maker counts them.
const ARMS: [(&str, [f64; 2], f64, f64); 6] = [
    ("abb-irb-120", [350.0, 250.0], 1.0, 1.0),
    ("staubli-tx60", [380.0, 0.0], 1.0, 1.0),
    ("kuka-kr6-r900-sixx", [450.0, 250.0], -1.0, 1.0),
    ("fanuc-lr-mate-200id", [400.0, -50.0], 1.0, -1.0),
    ("fanuc-m-20ia", [800.0, 0.0], 1.0, -1.0),
    ("yaskawa-gp12", [700.0, 0.0], 1.0, -1.0),
];

#[test]
fn without_a_word_the_wrist_is_in_front_and_not_turned_over_whichever_way_the_maker_counts() {
    for (robot, [x, z], first, fifth) in ARMS {
        let (arm, listing) = (arm(robot), listing(x, z));
        let plan = planned(&arm, &listing, &Cell::default());
        let reached = joints_deg(&plan);
        assert_eq!(reached.len(), 2, "{robot} {:?}", plan.outcomes);
        let aside = 0.5f64.atan().to_degrees();
        for (q, side) in reached.iter().zip([aside, -aside]) {
            assert!((q[0] - first * side).abs() < 5.0, "{robot} {q:?}");
            assert!(q[3].abs() < 20.0 && fifth * q[4] > 10.0, "{robot} {q:?}");
        }
        let note = plan.notes.iter().find(|note| note.contains("NC states no configuration")).unwrap();
        assert!(note.contains("start_deg") && note.contains("(line 6)"), "{note}");
    }
}

#[test]
fn the_cell_file_says_where_the_arm_starts() {
    // Axis 4 of the first does not turn that far.
    for (robot, [x, z], ..) in &ARMS[1..] {
        let (x, z) = (*x, *z);
        let (arm, listing) = (arm(robot), listing(x, z));
        let usual = joints_deg(&planned(&arm, &listing, &Cell::default()))[0];
        // The wrist turned over, and a few degrees beside where it goes.
        let mut over = usual;
        over[3] += if usual[3] > 0.0 { -180.0 } else { 180.0 };
        over[4] = -usual[4];
        over[5] += if usual[5] > 0.0 { -180.0 } else { 180.0 };
        let near = over.map(|angle| angle + 4.0);
        let plan = planned(&arm, &listing, &started(near));
        let q = joints_deg(&plan)[0];
        assert!((0..6).all(|j| (q[j] - over[j]).abs() < 1e-6), "{robot} {q:?} {over:?}");
        assert!(
            !plan.notes.iter().any(|note| note.contains("NC states no configuration")),
            "{:?}",
            plan.notes
        );
        // Another configuration, another correction: a twist of the forearm moves the tool the other way.
        let corrected = |cell: &Cell| planned(&arm, &listing, cell).points[0].joints_after.unwrap();
        let [a, b] = [corrected(&Cell::default()), corrected(&started(near))];
        assert!((a - b).amax() > 1.0, "{robot} {a} {b}");
    }
}

/// The program says it as the cell file does, which overrides it.
#[test]
fn a_comment_says_where_the_arm_starts() {
    let arm = arm("staubli-tx60");
    let usual = listing(380.0, 0.0);
    let mut over = joints_deg(&planned(&arm, &usual, &Cell::default()))[0];
    over[3] += 180.0;
    over[4] *= -1.0;
    over[5] += 180.0;
    let said = Listing { nc: NcFacts { start_deg: Some(over), ..usual.nc.clone() }, ..usual.clone() };
    let plan = planned(&arm, &said, &Cell::default());
    let q = joints_deg(&plan)[0];
    assert!((0..6).all(|j| (q[j] - over[j]).abs() < 1e-6), "{q:?} {over:?}");
    assert!(!plan.notes.iter().any(|note| note.contains("NC states no configuration")), "{:?}", plan.notes);
    let begins = |plan: &Plan| joints_deg(plan)[0];
    let with_both = planned(&arm, &said, &started([0.0, 0.0, 90.0, 0.0, 90.0, 0.0]));
    let [a, b] = [begins(&with_both), begins(&planned(&arm, &usual, &Cell::default()))];
    assert!((0..6).all(|j| (a[j] - b[j]).abs() < 1e-6), "{a:?} {b:?}");
    let far = Listing {
        nc: NcFacts { start_deg: Some([0.0, 0.0, 400.0, 0.0, 90.0, 0.0]), ..usual.nc.clone() },
        ..usual
    };
    let found = contradictions(&far, &Cell::default(), &arm.nominal);
    assert!(
        found.len() == 1 && found[0].starts_with("`truegrind start` of the program: joint 3"),
        "{found:?}"
    );
}

/// Between two places the branch nearest to zero changes; a corrected program must not be run in another one than the original.
#[test]
fn a_corrected_program_starts_in_the_branch_of_the_original() {
    let nominal = robots::load("universal-robots-ur5").unwrap().model;
    let acting =
        ActingArm { nominal: &nominal, model: &nominal, knowledge: None, condition: Condition::default() };
    let ran = |original: &Listing, rewritten: &Listing| {
        let cell = Cell::default();
        let judged = VerificationTask {
            original,
            rewritten: Some(rewritten),
            cell: &cell,
            surface: None,
            program: "p.nc",
            name: "test",
            after: After::Achieved,
            tolerance_mm: Options::default().tolerance_mm,
            loads: [None, None],
        };
        verify(&judged, &acting).points.remove(0)
    };
    for z in [0.0, 40.0, 80.0] {
        let [here, beside] = [200.0, 225.0].map(|x| listing(x, z));
        let [alone, other] = [&here, &beside].map(|alone| ran(alone, alone).joints_before.unwrap());
        assert!((alone - other).amax() > 1.0, "another branch is assumed");
        let moved = (ran(&here, &beside).joints_after.unwrap() - alone).amax();
        assert!(moved < 0.6, "{z}: {moved}");
    }
}

#[test]
fn joints_that_the_arm_cannot_have_are_refused() {
    let listing = listing(350.0, 250.0);
    let nominal = arm("abb-irb-120").nominal;
    let found = contradictions(&listing, &started([0.0, 0.0, 150.0, 0.0, 90.0, 0.0]), &nominal);
    assert_eq!(found.len(), 1);
    assert!(
        found[0].contains("start_deg: joint 3 is 150.0°, outside its range of -110.0° to 70.0°"),
        "{found:?}"
    );
    assert!(contradictions(&listing, &started([0.0, 0.0, 50.0, 0.0, 90.0, 0.0]), &nominal).is_empty());
    let radians = Cell::from_toml("start_deg = [0, 0.1745, 0, 0, 1.5708, 0]\n").unwrap_err();
    assert!(radians.to_string().contains("multiply radians by 57.3"), "{radians}");
    let wrong = Cell::from_toml("start_deg = [0, 0, inf, 0, 90, 0]\n").unwrap_err();
    assert!(matches!(wrong, CellError::Start { .. }), "{wrong}");
    let cell = Cell::from_toml("start_deg = [0, 0, 10, 0, 90, 0]\n").unwrap();
    assert_eq!(cell.start_deg, Some([0.0, 0.0, 10.0, 0.0, 90.0, 0.0]));
}
