//! Every reason why a motion is left, refused or flagged occurs in a program.

use std::collections::BTreeSet;

use truegrind_arm::condition::Condition;
use truegrind_arm::estimated::Estimated;
use truegrind_arm::model::Joints;
use truegrind_arm::parameter::{LinkCoordinate, Parameter};
use truegrind_compensation::cell::Cell;
use truegrind_compensation::cut::Cuts;
use truegrind_compensation::deviation::MotionStatus;
use truegrind_compensation::options::{Circles, Options};
use truegrind_compensation::plan::Plan;
use truegrind_compensation::plan::reason::OutcomeReason;
use truegrind_compensation::plan::solved_program::plan;
use truegrind_programs::motion::Reason;
use truegrind_programs::rapid::Task;

use super::{estimated, nominal, perturbed};

/// Every variant by name: a new one does not compile until it is listed here.
fn name(why: &OutcomeReason) -> &'static str {
    match why {
        OutcomeReason::Program(_) => "program",
        OutcomeReason::MovingBase { .. } => "moving base",
        // Only with a cell file (taught.rs).
        OutcomeReason::CellContradiction => "contradicted",
        // Only where a program is rewritten (tests/it/programs.rs).
        OutcomeReason::NoChange => "same",
        OutcomeReason::JointTarget => "joint target",
        OutcomeReason::Inverse(_) => "inverse",
        OutcomeReason::OutsideLimits { .. } => "outside limits",
        // tests/it/joint_limits.rs.
        OutcomeReason::PathOutsideLimits { .. } => "way outside limits",
        OutcomeReason::StartOfLimitedPath { .. } => "before limited way",
        OutcomeReason::CorrectionTooLarge { .. } => "too far",
        OutcomeReason::RotationTooLarge { .. } => "too much turn",
        OutcomeReason::NearSingularity => "near singularity",
        OutcomeReason::JointJump { .. } => "joint jump",
        OutcomeReason::SingularPath => "singular way",
        OutcomeReason::OtherBranch => "other branch",
        OutcomeReason::AmbiguousBranch => "open branch",
        // Only where the start is unknown (tests/it/singularity.rs).
        OutcomeReason::UnknownStart => "open start",
        OutcomeReason::UncheckedPath => "unchecked path",
        OutcomeReason::PathDeviation { .. } => "bend",
        OutcomeReason::CornerDeviation { .. } => "corner",
        // tests/it/segment.rs.
        OutcomeReason::AmbiguousCentre { .. } => "open centre",
        OutcomeReason::CircleKept => "circle kept",
        // tests/it/half_turns.rs.
        OutcomeReason::HalfTurn { .. } => "half a turn",
        // tests/it/joint_lines.rs.
        OutcomeReason::LineWithoutStart => "line without start",
        OutcomeReason::LineAsJoints { .. } => "line as joints",
        OutcomeReason::TooFast { .. } => "too fast",
        OutcomeReason::NoCircle => "no circle",
        // tests/it/circles.rs.
        OutcomeReason::ArcFromUncorrected { .. } => "behind uncorrected",
        OutcomeReason::StartOfUnchangedArc { .. } => "before circle",
        // tests/it/cut.rs.
        OutcomeReason::StartOfUnchangedCut { .. } => "before a cut",
        OutcomeReason::DepartureFromUnchangedCut { .. } => "behind a cut",
        // tests/it/singularity.rs.
        OutcomeReason::StartOfSingularPath { .. } => "before singular way",
        OutcomeReason::FullCircle => "whole circle",
        OutcomeReason::JointNotMeasured { .. } => "joint not measured",
        OutcomeReason::PartOfCut { .. } => "part of cut",
        OutcomeReason::Step { .. } => "step",
        OutcomeReason::AirMoveAlone => "air-move-alone",
        // No program is known that needs so many rounds.
        OutcomeReason::NoConsistentPlan => "no consistent plan",
        // tests/it/placement.rs.
        OutcomeReason::Risk { .. } => "risk",
        OutcomeReason::NotCovered { .. } => "not covered",
        OutcomeReason::Uncertain { .. } => "uncertain",
    }
}

const NAMES: [&str; 24] = [
    "program",
    "moving base",
    "joint target",
    "inverse",
    "outside limits",
    "too far",
    "too much turn",
    "near singularity",
    "joint jump",
    "singular way",
    "other branch",
    "open branch",
    "unchecked path",
    "bend",
    "corner",
    "circle kept",
    "too fast",
    "no circle",
    "whole circle",
    "joint not measured",
    "part of cut",
    "step",
    "not covered",
    "uncertain",
];

fn known() -> Estimated {
    let mut known = estimated(perturbed(5, 3.0), &[Joints::zeros()]);
    (known.region.min_deg, known.region.max_deg) = ([-400.0; 6], [400.0; 6]);
    known.region.spacing_deg = 1e6;
    known
}

/// Known but for the zero of joint 1, and measured where that hardly moves the flange.
fn unsure() -> Estimated {
    let mut arm = known();
    let turn = Parameter::Link { joint: 0, coordinate: LinkCoordinate::Theta };
    let k = arm.order.iter().position(|parameter| *parameter == turn).unwrap();
    arm.covariance.fill(0.0);
    arm.covariance[(k, k)] = 1e-8;
    arm.region.samples_deg = vec![[0.0, 0.0, -90.0, 0.0, 0.0, 0.0]];
    arm
}

/// Each motion on its own, so that its own reason shows and not that of its cut.
fn planned(source: &[u8], known: &Estimated, cell: &Cell, options: &Options) -> Plan {
    planned_in_cuts(source, known, cell, &Options { cuts: Cuts::Single, ..options.clone() })
}

fn planned_in_cuts(source: &[u8], known: &Estimated, cell: &Cell, options: &Options) -> Plan {
    let task = Task::read(&[("p.mod", source)]);
    assert!(task.listing.opaque.is_empty(), "{:?}", task.listing.opaque);
    plan(&task.listing, known, cell, options)
}

fn sample(name: &str) -> Vec<u8> {
    let folder = std::path::Path::new(env!("CARGO_MANIFEST_DIR")).join("../../programs");
    std::fs::read(folder.join(name)).unwrap()
}

fn fine() -> Options {
    Options { tolerance_mm: 0.005, circles: Circles::Segments, ..Options::default() }
}

#[test]
fn each_motion_of_the_sample_states_the_reason_beside_it() {
    let source = sample("refusals.mod");
    let task = Task::read(&[("p.mod", &source)]);
    let plan = planned(&source, &known(), &Cell::default(), &fine());
    let text = String::from_utf8(source.clone()).unwrap();
    let lines: Vec<&str> = text.lines().collect();
    let mut wrong = Vec::new();
    for (motion, outcome) in task.listing.motions.iter().zip(&plan.outcomes) {
        let line = lines[motion.place.line as usize - 1];
        let expected = line.split("! expect: ").nth(1).unwrap();
        let found = outcome.reason().map_or("nothing".to_owned(), |why| why.to_string());
        if !found.contains(expected) {
            wrong.push(format!("{}: {expected}: {found} ({outcome:?})", motion.place.line));
        }
    }
    assert!(wrong.is_empty(), "{wrong:#?}");
}

/// Plans of the scenes that `programs/bounds.mod` names.
fn scene(name: &str, source: &[u8]) -> Vec<Plan> {
    let cell = Cell::default();
    let (mut arm, mut options) = (known(), Options::default());
    match name {
        "bound" => options.max_correction_mm = 1e-4,
        "turn" => options.max_rotation_rad = 1e-7,
        "singular" => options.min_singularity = 1.0,
        "unsure" => arm = unsure(),
        "elsewhere" => (arm.region.spacing_deg, arm.region.samples_deg) = (1.0, vec![[150.0; 6]]),
        "narrow" => (arm.region.min_deg[1], arm.region.max_deg[1]) = (-100.0, 5.0),
        "loose" => (options.tolerance_mm, options.circles) = (0.5, Circles::Segments),
        "joints" => options.joint_targets = true,
        "branch" => {
            options.min_singularity = 0.0;
            (options.max_rotation_rad, options.max_correction_mm) = (1.0, 50.0);
            let arms = (0..12).map(|seed| estimated(perturbed(seed, 1.0), &[Joints::zeros()]));
            return arms.map(|arm| planned(source, &arm, &cell, &options)).collect();
        }
        other => panic!("no scene {other}"),
    }
    vec![planned(source, &arm, &cell, &options)]
}

#[test]
fn each_motion_of_the_sample_states_the_reason_of_its_scene() {
    let source = sample("bounds.mod");
    let task = Task::read(&[("p.mod", &source)]);
    let text = String::from_utf8(source.clone()).unwrap();
    let lines: Vec<&str> = text.lines().collect();
    let mut scenes: BTreeSet<&str> = BTreeSet::new();
    let mut wrong = Vec::new();
    for (index, motion) in task.listing.motions.iter().enumerate() {
        let line = lines[motion.place.line as usize - 1];
        let Some(expected) = line.split("! expect ").nth(1) else { continue };
        for expected in expected.split(" | ") {
            let (name, expected) = expected.split_once(": ").unwrap();
            scenes.insert(name);
            let reasons = scene(name, &source).into_iter().map(|plan| plan.outcomes[index].reason());
            let found: Vec<String> =
                reasons.map(|why| why.map_or("nothing".to_owned(), |why| why.to_string())).collect();
            if !found.iter().any(|found| found.contains(expected)) {
                wrong.push(format!("{} {name}: {expected}: {found:?}", motion.place.line));
            }
        }
    }
    assert!(wrong.is_empty(), "{wrong:#?}");
    assert_eq!(scenes.len(), 9);
}

#[test]
fn every_reason_there_is_shows_in_a_program() {
    let mut seen: BTreeSet<&str> = BTreeSet::new();
    let mut look = |plan: &Plan| {
        for outcome in &plan.outcomes {
            if let Some(why) = &outcome.reason() {
                assert_ne!(outcome.status, MotionStatus::Changed);
                assert!(!why.to_string().is_empty());
                seen.insert(name(why));
            }
        }
    };
    let refusals = sample("refusals.mod");
    let cell = Cell::default();
    look(&planned(&refusals, &known(), &cell, &fine()));
    look(&planned(&sample("switches.mod"), &known(), &cell, &fine()));
    look(&planned(&sample("track.mod"), &known(), &cell, &fine()));
    let bounds = [
        Options { max_correction_mm: 1e-4, ..fine() },
        Options { max_rotation_rad: 1e-7, ..fine() },
        Options { joint_targets: true, ..fine() },
        Options { min_singularity: 1.0, ..fine() },
        Options { tolerance_mm: 0.5, ..fine() },
    ];
    for options in &bounds {
        look(&planned(&refusals, &known(), &cell, options));
    }
    for cuts in [Cuts::Whole, Cuts::Partial] {
        let line = |x: u32| {
            format!("MoveL [[{x},0,400],[0,0,1,0],[0,0,0,0],[9E9,9E9,9E9,9E9,9E9,9E9]],v20,z1,tool0;\n")
        };
        let source = ["MODULE M\nPROC main()\n", &line(380), &line(900), "ENDPROC\nENDMODULE\n"].concat();
        look(&planned_in_cuts(source.as_bytes(), &known(), &cell, &Options { cuts, ..fine() }));
    }
    // A routine that no file declares may move the arm.
    let line = |y: i32, conf: &str| {
        format!("MoveL [[420,{y},350],[0,0,1,0],{conf},[9E9,9E9,9E9,9E9,9E9,9E9]],v20,fine,tool0;\n")
    };
    let lines = [line(-250, "[-1,0,-1,0]"), "SetSpindle 5000;\n".to_owned(), line(250, "[0,0,0,0]")].concat();
    let source = format!("MODULE M\nPROC main()\n{lines}ENDPROC\nENDMODULE\n");
    look(&planned(source.as_bytes(), &known(), &cell, &Options { tolerance_mm: 5.0, ..fine() }));
    look(&planned(&refusals, &unsure(), &cell, &fine()));
    let mut elsewhere = known();
    elsewhere.region.spacing_deg = 1.0;
    elsewhere.region.samples_deg = vec![[150.0; 6]];
    look(&planned(&refusals, &elsewhere, &cell, &fine()));
    let mut narrow = known();
    (narrow.region.min_deg[1], narrow.region.max_deg[1]) = (-100.0, 5.0);
    look(&planned(&refusals, &narrow, &cell, &fine()));
    // Axis 5 almost straight, so that a correction turns it to the other side; no bound on singularity.
    let mut near = String::from("MODULE M\n PROC main()\n");
    for angle in [-0.006, -0.003, 0.003, 0.006_f64] {
        let q = nalgebra::UnitQuaternion::from_axis_angle(
            &nalgebra::Vector3::y_axis(),
            std::f64::consts::FRAC_PI_2 + angle,
        );
        let cfx = if angle > 0.0 { 0 } else { 1 };
        near += &format!(
            "  MoveJ [[374,0,{:.6}],[{:.9},0,{:.9},0],[0,0,0,{cfx}],[9E9,9E9,9E9,9E9,9E9,9E9]],v100,fine,tool0;\n",
            630.0 - 72.0 * angle,
            q.w,
            q.j
        );
    }
    near += " ENDPROC\nENDMODULE\n";
    let options = Options { min_singularity: 0.0, max_rotation_rad: 1.0, max_correction_mm: 50.0, ..fine() };
    for seed in 0..12 {
        look(&planned(
            near.as_bytes(),
            &estimated(perturbed(seed, 1.0), &[Joints::zeros()]),
            &cell,
            &options,
        ));
    }
    for min_singularity in [1e-3, 0.02] {
        look(&planned(singular().as_bytes(), &known(), &cell, &Options { min_singularity, ..fine() }));
    }
    let missing: Vec<&&str> = NAMES.iter().filter(|name| !seen.contains(*name)).collect();
    assert!(missing.is_empty(), "{missing:?}");
}

/// A target close to the wrist singularity, a line through it, and a joint motion without configuration to a pose of which
/// another solution is nearer.
fn singular() -> String {
    let at = |q_deg: [f64; 6], conf: [i32; 4]| {
        let q = Joints::from_fn(|j, _| q_deg[j].to_radians());
        let pose = nominal().at_condition(&Condition::default()).forward(&q);
        let (t, r) = (pose.translation.vector, pose.rotation.quaternion());
        let [cf1, cf4, cf6, cfx] = conf;
        format!(
            "[[{:.6},{:.6},{:.6}],[{:.9},{:.9},{:.9},{:.9}],[{cf1},{cf4},{cf6},{cfx}],[9E9,9E9,9E9,9E9,9E9,9E9]],v100,fine,tool0;\n",
            t.x, t.y, t.z, r.w, r.i, r.j, r.k
        )
    };
    let mut text = String::from("MODULE M\n PROC main()\n");
    text += &format!("  MoveJ {}", at([10.0, 20.0, -10.0, 40.0, 0.8, 30.0], [0; 4]));
    text += &format!("  MoveJ {}", at([10.0, 20.0, -10.0, 40.0, 20.0, 30.0], [0; 4]));
    text += &format!("  MoveL {}", at([10.0, 20.0, -10.0, 40.0, -12.0, 30.0], [0, 0, 0, 1]));
    text += &format!("  MoveJ {}", at([10.0, 20.0, -10.0, 10.0, 70.0, 10.0], [0; 4]));
    text += "  ConfJ\\Off;\n";
    text += &format!("  MoveJ {}", at([10.0, 20.0, -10.0, 150.0, 25.0, 175.0], [0; 4]));
    text + " ENDPROC\nENDMODULE\n"
}

#[test]
fn an_axis_that_carries_the_base_refuses_its_motions() {
    let source = sample("track.mod");
    let reasons = |cell: &Cell| -> Vec<Option<OutcomeReason>> {
        planned(&source, &known(), cell, &Options::default()).outcomes.iter().map(|o| o.reason()).collect()
    };
    let base = Some(OutcomeReason::MovingBase { axis: 0 });
    // Farther away than the arm is long: the axis must carry the base, also where it is at 0.
    let found = reasons(&Cell::default());
    // And where the last target does not state it: a deactivated axis stays where it was.
    assert_eq!(found, [base; 4]);
    let stated = |text: &str| Cell::from_toml(&format!("[[external]]\naxis = \"{text}")).unwrap();
    assert_eq!(reasons(&stated("a\"\ncarries = \"base\"\n")), [base; 4]);
    let both = stated("b\"\ncarries = \"base\"\n");
    assert_eq!(reasons(&both)[3], Some(OutcomeReason::MovingBase { axis: 1 }));
    // Stated not to carry it: then the far target is out of reach.
    let other = reasons(&stated("a\"\ncarries = \"other\"\n"));
    assert_eq!(other[0], None);
    assert!(matches!(other[1], Some(OutcomeReason::Inverse(_))), "{other:?}");
    assert!(Cell::from_toml("[[external]]\naxis = \"g\"\ncarries = \"base\"\n").is_err());
    let notes = planned(&source, &known(), &Cell::default(), &Options::default()).notes;
    assert!(
        notes.iter().any(|note| note.contains("external axis a") && note.contains("[[external]]")),
        "{notes:?}"
    );
}

/// An axis that stands away from 0 throughout may carry the base as well as one that moves.
#[test]
fn an_axis_that_stands_elsewhere_than_at_0_is_asked_for() {
    let go = |axis: &str| {
        let at = |x: f64| {
            format!("MoveL [[{x},0,300],[0,0,1,0],[0,0,0,0],[{axis},9E9,9E9,9E9,9E9,9E9]],v20,z1,tool0;\n")
        };
        let text = format!("MODULE M\nPROC main()\n{}{}ENDPROC\nENDMODULE\n", at(380.0), at(390.0));
        let plan = planned(text.as_bytes(), &known(), &Cell::default(), &Options::default());
        (
            plan.unstated_axes.clone(),
            plan.notes.iter().any(|note| note.contains("external axis a is not at 0")),
        )
    };
    assert_eq!(go("300"), (vec!['a'], true));
    assert_eq!(go("0"), (vec![], false));
    assert_eq!(go("9E9"), (vec![], false));
}

/// A copy of a taught frame has its place, not that of its numbers.
#[test]
fn a_copy_of_what_was_taught_is_not_metrology() {
    let cell = Cell::from_toml(
        "[[tool]]\nname = \"t1\"\norigin = \"taught\"\n[[wobj]]\nname = \"w1\"\norigin = \"taught\"\n",
    )
    .unwrap();
    let metrology = Cell::from_toml(
        "[[tool]]\nname = \"t1\"\norigin = \"metrology\"\n[[wobj]]\nname = \"w1\"\norigin = \"metrology\"\n",
    )
    .unwrap();
    let tool = "[TRUE,[[0,0,50],[1,0,0,0]],[1,[0,0,20],[1,0,0,0],0,0,0]]";
    let object = "[FALSE,TRUE,\"\",[[380,0,300],[1,0,0,0]],[[0,0,0],[1,0,0,0]]]";
    let text = format!(
        "MODULE M\nPERS tooldata t1:={tool};\nPERS tooldata t2:={tool};\nPERS wobjdata w1:={object};\nPERS wobjdata w2:={object};\n\
         PROC main()\nw2:=w1;\nw2.oframe.trans:=[1,2,3];\nt2:=t1;\n{}{}{}ENDPROC\nENDMODULE\n",
        go("tool0", "w2"),
        go("t2", "wobj0"),
        go("tool0", "wobj0"),
    );
    let reasons = |cell: &Cell| -> Vec<Option<OutcomeReason>> {
        planned(text.as_bytes(), &known(), cell, &Options::default())
            .outcomes
            .iter()
            .map(|o| o.reason())
            .collect()
    };
    let [object, tool] =
        [Reason::WorkObjectAssigned, Reason::ToolAssigned].map(|r| Some(OutcomeReason::Program(r)));
    assert_eq!(reasons(&cell), [object, tool, None]);
    assert_eq!(reasons(&metrology), [None; 3]);
}

fn go(tool: &str, object: &str) -> String {
    let at = if object == "wobj0" { "[380,0,300]" } else { "[0,0,0]" };
    format!("MoveJ [{at},[0,0,1,0],[0,0,0,0],[9E9,9E9,9E9,9E9,9E9,9E9]],v20,z1,{tool}\\WObj:={object};\n")
}

#[test]
fn where_no_configuration_reaches_a_target_the_reason_is_what_forbids_the_nearest() {
    for conf in ["ConfL\\Off;", "ConfL\\On;"] {
        // A tool that points up at this height turns joint 5 too far.
        let source = format!(
            "MODULE M\nPROC main()\n{conf}\nMoveL [[350,0,450],[1,0,0,0],[0,0,0,0],[9E9,9E9,9E9,9E9,9E9,9E9]],v100,fine,tool0;\n\
             ENDPROC\nENDMODULE\n"
        );
        let planned = planned(source.as_bytes(), &known(), &Cell::default(), &Options::default());
        let outcome = &planned.outcomes[0];
        assert_eq!(outcome.status, MotionStatus::Refused);
        assert!(
            matches!(outcome.reason(), Some(OutcomeReason::OutsideLimits { .. })),
            "{conf} {:?}",
            outcome.reason()
        );
    }
}

#[test]
fn a_called_program_that_is_not_read_is_named() {
    let go = "G1 X500. Y0. Z500. A180. B0. C0. F600.";
    let notes = |body: &str| {
        let source = format!("O1\n(truegrind angles wpr)\nG90 G21 G17 G54\nT1 M6\nG43.4 H1\n{body}\nM30\n");
        let setup = truegrind_programs::nc::setup::Setup::default();
        let task = truegrind_programs::nc::Task::read(&[("p.nc", source.as_bytes())], &setup);
        plan(&task.listing, &known(), &Cell::default(), &Options::default()).notes
    };
    let found = notes(&format!("{go}\nM98 P2000\n{go}\nM98 P3000\n{go}"));
    let note = found.iter().find(|note| note.contains("another program that is not followed")).unwrap();
    assert!(note.starts_with("2 blocks call") && note.ends_with("(lines 7, 9)"), "{note}");
    assert!(!notes(go).iter().any(|note| note.contains("in the same file")));
}

/// A work object that is declared, and computed where the program runs, is not called undeclared.
#[test]
fn a_declared_work_object_without_a_known_value_is_not_called_undeclared() {
    let source = sample("frames.mod");
    let task = truegrind_programs::rapid::Task::read(&[("frames.mod", &source)]);
    let found = truegrind_compensation::frames::undeclared::undeclared(&task.listing);
    let names: Vec<&str> = found.iter().map(|one| one.name.as_str()).collect();
    assert_eq!(names, ["elsewhere", "nowhere"]);
}

/// A motion in machine coordinates needs no tool and no work offset: posts cancel the tool before they retract.
#[test]
fn a_motion_in_machine_coordinates_asks_for_no_frame() {
    let asked = |body: &str| {
        let source = format!("; truegrind angles wpr\nN10 G90 G71 G17 G54\nN20 T1 D1 M6\n{body}\nN90 M30\n");
        let setup = truegrind_programs::nc::setup::Setup::default();
        let task = truegrind_programs::nc::Task::read(&[("p.mpf", source.as_bytes())], &setup);
        let found = truegrind_compensation::frames::undeclared::undeclared(&task.listing);
        found.into_iter().map(|one| one.name).collect::<Vec<_>>()
    };
    assert_eq!(asked("N30 G0 SUPA Z0 D0"), [""; 0]);
    assert_eq!(
        asked("N30 TRAORI\nN40 G0 X0 Y0 Z20 A180 B0 C0\nN50 TRAFOOF\nN60 G0 SUPA Z0 D0"),
        ["T1", "G54"]
    );
}

#[test]
fn calls_of_routines_in_no_file_are_noted_with_what_is_assumed_of_them() {
    let target = "[[400,0,300],[0,0,1,0],[0,0,0,0],[9E9,9E9,9E9,9E9,9E9,9E9]]";
    let source = format!(
        "MODULE A\n PROC main()\n  SetDO valve,1;\n  SetShift;\n  MoveJ {target},v100,fine,tool0;\n  SetShift;\n ENDPROC\nENDMODULE\n"
    );
    let plan = planned(source.as_bytes(), &known(), &Cell::default(), &fine());
    let notes = plan.notes.join("\n");
    assert!(
        notes.contains("routines missing from the files are called: SetShift (lines 4, 6). They are assumed"),
        "{notes}"
    );
    assert!(!notes.contains("SetDO"), "{notes}");
}
