//! Backlash and payload: the rewritten program is run by a simulation without any notion of sides. It follows the
//! controller's joints in small steps, and each link is moved by the flank against which it lies (the play operator): θ rests
//! until q − b/2 or q + b/2 reaches it.

use std::cell::Cell as Count;

use nalgebra::{Point3, Vector3};
use truegrind_arm::condition::Condition;
use truegrind_arm::effect::Effect;
use truegrind_arm::effect::backlash::Backlash;
use truegrind_arm::effect::compliance::Compliance;
use truegrind_arm::effect::joint_load::PointMass;
use truegrind_arm::effect::loaded_backlash::LoadedBacklash;
use truegrind_arm::inverse::Inverse;
use truegrind_arm::model::{Joints, Model};
use truegrind_compensation::cell::Cell;
use truegrind_compensation::deviation::MotionStatus;
use truegrind_compensation::options::Options;
use truegrind_compensation::plan::Plan;
use truegrind_compensation::plan::reason::OutcomeReason;
use truegrind_compensation::plan::solved_program::plan;
use truegrind_math::se3::Pose;
use truegrind_programs::motion::load::Loads;
use truegrind_programs::motion::{Listing, MotionKind, TargetValue};
use truegrind_programs::rapid::Task;
use truegrind_programs::rewrite::RewriteOptions;

use super::{estimated, nominal, perturbed, run_on, worst};

/// Accuracy of the distance from the line (mm).
const CHORD_MM: f64 = 0.003;

const PLAY_DEG: [f64; 6] = [0.02, 0.015, 0.02, 0.0, 0.03, 0.0];

/// The arm with backlash and compliance.
fn worn(seed: u64) -> Model {
    let mut arm = perturbed(seed, 0.5);
    let plays = PLAY_DEG.iter().enumerate().filter(|(_, play)| **play != 0.0);
    arm.effects
        .extend(plays.map(|(joint, play)| Effect::Backlash(Backlash { joint, play_rad: play.to_radians() })));
    arm.effects.extend(
        [1, 2].map(|joint| Effect::JointCompliance(Compliance { joint, compliance_rad_per_nm: 6e-5 })),
    );
    arm
}

fn without_play(arm: &Model) -> Model {
    let mut arm = arm.clone();
    arm.effects.retain(|effect| effect.play_rad().is_none());
    arm
}

/// Lines back and forth in y, each 20 mm farther out; joint 1 reverses at every end, joints 2, 3 and 5 half way along each
/// line. The gripper takes a kilogram after the third line.
fn source() -> String {
    let mut text = String::from(
        "MODULE M\n PERS tooldata tGrip := [TRUE,[[0,0,60],[1,0,0,0]],[1.5,[10,0,40],[1,0,0,0],0,0,0]];\n \
         PERS loaddata part := [1,[0,0,30],[1,0,0,0],0,0,0];\n PROC main()\n  GripLoad load0;\n",
    );
    for k in 0..6 {
        let x = 380 + 20 * k;
        let (from, to) = if k % 2 == 0 { (-120, 120) } else { (120, -120) };
        if k == 3 {
            text += "  GripLoad part;\n";
        }
        let step = if k == 0 { "MoveJ" } else { "MoveL" };
        for (name, y) in [(step, from), ("MoveL", to)] {
            let cf1 = if y < 0 { -1 } else { 0 };
            text += &format!(
                "  {name} [[{x},{y},260],[0,0,1,0],[{cf1},0,{cf1},0],[9E9,9E9,9E9,9E9,9E9,9E9]],v100,fine,tGrip;\n"
            );
        }
    }
    text + " ENDPROC\nENDMODULE\n"
}

/// The payload: tool and part, computed by hand on the flange, which is the last frame of this arm.
fn carried(y_lines: usize) -> Condition {
    let (payload_kg, payload_centre_mm) = if y_lines < 3 {
        (1.5, [10.0, 0.0, 40.0])
    } else {
        (2.5, [15.0 / 2.5, 0.0, (1.5 * 40.0 + (60.0 + 30.0)) / 2.5])
    };
    Condition { payload_kg: Some(payload_kg), payload_centre_mm, ..Condition::default() }
}

/// One sample of the path, with the position of the tool there.
struct Passed {
    motion: usize,
    /// Whether it is the end of the motion.
    end: bool,
    tip: Point3<f64>,
}

/// Runs a program in small steps. `part_from`: the first motion with the part in the gripper.
fn run(listing: &Listing, arm: &Model, part_from: usize) -> Vec<Passed> {
    run_loaded(listing, arm, part_from, &|_| [None; 6])
}

/// The same where loads close the play of some joints: `flank` says to which side (−1, 1) they do at link angles.
fn run_loaded(
    listing: &Listing,
    arm: &Model,
    part_from: usize,
    flank: &dyn Fn(&Joints) -> [Option<f64>; 6],
) -> Vec<Passed> {
    let sheet = nominal();
    let controller = Inverse::new(&sheet, &Condition::default(), &sheet);
    let stiff = without_play(arm);
    let [light, heavy] = [0, 3].map(|lines| stiff.at_condition(&carried(lines)).clone());
    let tool = Pose::translation(0.0, 0.0, 60.0);
    let half = PLAY_DEG.map(|play| 0.5 * play.to_radians());
    let mut out = Vec::new();
    let mut at: Option<(Pose, Joints)> = None;
    let mut link = Joints::zeros();
    for (m, motion) in listing.motions.iter().enumerate() {
        let Some(Ok(TargetValue::Cartesian(target))) = motion.to().map(|t| t.value) else { continue };
        let told = target.pose();
        let wanted = truegrind_arm::inverse::configuration::Configuration {
            cf1: target.conf[0],
            cf4: target.conf[1],
            cf6: target.conf[2],
            cfx: target.conf[3],
        };
        let flange = |pose: &Pose| pose * tool.inverse();
        let Some((from, start)) = at else {
            let joints = controller.solve_configured(&flange(&told), &wanted, None).unwrap().joints;
            (at, link) = (Some((told, joints)), joints);
            continue;
        };
        let steps = 400;
        let mut near = start;
        let end = controller.solve_near(&flange(&told), &start).unwrap().joints;
        for k in 1..=steps {
            let s = f64::from(k) / f64::from(steps);
            near = match motion.kind {
                MotionKind::Linear => {
                    let position = from.translation.vector.lerp(&told.translation.vector, s);
                    let pose = Pose::from_parts(position.into(), from.rotation.slerp(&told.rotation, s));
                    controller.solve_near(&flange(&pose), &near).unwrap().joints
                }
                _ => start.lerp(&end, s),
            };
            link = Joints::from_fn(|j, _| link[j].clamp(near[j] - half[j], near[j] + half[j]));
            for (j, side) in flank(&link).iter().enumerate() {
                if let Some(side) = side {
                    link[j] = near[j] + side * half[j];
                }
            }
            let posed = if m < part_from { &light } else { &heavy };
            let tip = posed.forward(&link) * tool * Point3::origin();
            out.push(Passed { motion: m, end: k == steps, tip });
        }
        at = Some((told, near));
    }
    out
}

fn options(tolerance_mm: f64, loads: Option<Loads>) -> Options {
    Options { tolerance_mm, loads, ..Options::default() }
}

fn rewrite(text: &str, arm: &Model, options: &Options) -> (Plan, Vec<u8>) {
    let task = Task::read(&[("p.mod", text.as_bytes())]);
    let spread: Vec<Joints> = (0..3).map(|k| Joints::repeat(f64::from(k) - 1.0)).collect();
    let mut known = estimated(arm.clone(), &spread);
    known.covariance *= 1e-4;
    let planned = plan(&task.listing, &known, &Cell::default(), options);
    let edits = task.rewrite(&planned.changes, &RewriteOptions::default()).unwrap();
    (planned, edits.files[0].edits.apply(text.as_bytes()).unwrap())
}

fn intended(text: &str) -> Vec<Vector3<f64>> {
    let task = Task::read(&[("p.mod", text.as_bytes())]);
    let value = |m: &truegrind_programs::motion::Motion| m.to().unwrap().value.unwrap();
    task.listing.motions.iter().map(|m| value(m).cartesian().unwrap().pose().translation.vector).collect()
}

/// The largest deviation at the ends of lines after the first two, from where the flanks are determined. No targets were
/// inserted.
fn worst_end(program: &[u8], text: &str, arm: &Model) -> f64 {
    let task = Task::read(&[("p.mod", program)]);
    let meant = intended(text);
    let passed = run(&task.listing, arm, 6);
    let ends = passed.iter().filter(|p| p.end && p.motion > 2);
    ends.map(|p| (p.tip.coords - meant[p.motion]).norm()).fold(0.0, f64::max)
}

#[test]
fn sides_and_loads_of_the_program_leave_nothing_and_the_middle_does() {
    let text = source();
    let task = Task::read(&[("p.mod", text.as_bytes())]);
    let loads = task.loads();
    for seed in 0..3 {
        let arm = worn(seed);
        let full = options(5.0, Some(loads.clone()));
        let (planned, program) = rewrite(&text, &arm, &full);
        assert!(
            planned
                .outcomes
                .iter()
                .all(|o| o.status == MotionStatus::Changed || o.status == MotionStatus::Flagged)
        );
        let right = worst_end(&program, &text, &arm);
        assert!(right < 1e-3, "with sides and loads {right} mm are left");
        // Without sides: mid-play.
        let (_, middle) = rewrite(&text, &without_play(&arm), &full);
        let middle = worst_end(&middle, &text, &arm);
        assert!(middle > 0.05, "in the middle of the play only {middle} mm are left");
        // Without loads: a bare arm.
        let (_, bare) = rewrite(&text, &arm, &options(5.0, None));
        let bare = worst_end(&bare, &text, &arm);
        assert!(bare > 0.1, "without the load only {bare} mm are left");
    }
}

/// Where only the run decides whether the part is gripped, the deflection is that of the tool alone: the plan says at how many motions.
#[test]
fn loads_known_only_at_run_time_are_counted() {
    let perhaps = source().replace("GripLoad part;", "IF di1=1 GripLoad part;");
    let unknown = |text: &str, arm: &Model| {
        let loads = Task::read(&[("p.mod", text.as_bytes())]).loads();
        rewrite(text, arm, &options(5.0, Some(loads))).0.unknown_loads
    };
    let stiff = perturbed(1, 0.5);
    assert!(unknown(&perhaps, &worn(1)) > 2);
    assert_eq!([unknown(&source(), &worn(1)), unknown(&perhaps, &stiff)], [0, 0]);
    // At joint targets, which are left, the load changes nothing.
    let moves = |text: &str| text.replace("MoveL ", "MoveJ ");
    let home = "MoveAbsJ [[0,0,10,0,80,0],[9E9,9E9,9E9,9E9,9E9,9E9]]\\NoEOffs,v20,fine,tool0;";
    let before =
        source().replacen("GripLoad part;", &format!("IF di1=1 GripLoad part;\n{home}\nGripLoad part;"), 1);
    assert_eq!(unknown(&moves(&before), &worn(1)), 0);
}

#[test]
fn the_path_between_targets_takes_up_the_play_where_joints_turn() {
    let text = source();
    let task = Task::read(&[("p.mod", text.as_bytes())]);
    let loads = task.loads();
    let arm = worn(4);
    let meant = intended(&text);
    let off_path = |program: &[u8], planned: &Plan| {
        let changed = Task::read(&[("p.mod", program)]);
        // The first motion with the part: the sixth of the original ones.
        let part_from = 6 + planned.outcomes[..6].iter().map(|o| o.inserted as usize).sum::<usize>();
        let begin = 3 + planned.outcomes[..3].iter().map(|o| o.inserted as usize).sum::<usize>();
        let distance = |p: &Point3<f64>| {
            meant
                .windows(2)
                .map(|ends| {
                    let along = ends[1] - ends[0];
                    let s = ((p.coords - ends[0]).dot(&along) / along.norm_squared()).clamp(0.0, 1.0);
                    (p.coords - ends[0] - along * s).norm()
                })
                .fold(f64::INFINITY, f64::min)
        };
        let passed = run(&changed.listing, &arm, part_from);
        // Where the gripper takes the part the arm sags at once, before any target can correct it, and the
        // joints that lift it again must take up their backlash.
        let taken = |p: &Passed| p.motion == part_from || (p.tip.coords - meant[5]).norm() < 1.0;
        passed.iter().filter(|p| p.motion > begin && !taken(p)).map(|p| distance(&p.tip)).fold(0.0, f64::max)
    };
    let (planned, program) = rewrite(&text, &arm, &options(5.0, Some(loads.clone())));
    assert!(planned.outcomes.iter().all(|o| o.inserted == 0));
    let loose = off_path(&program, &planned);
    // A link does not jump from flank to flank, it rests, and the stated deviation accounts for that.
    let stated = |planned: &Plan| {
        let without_part = planned.outcomes.iter().enumerate().filter(|(k, _)| *k > 3 && *k != 6);
        without_part.filter_map(|(_, o)| o.path_deviation_mm.get()).fold(0.0, f64::max)
    };
    assert!(loose > 0.05, "play bends the path: {loose}");
    assert!((stated(&planned) - loose).abs() < CHORD_MM, "stated {}, found {loose}", stated(&planned));
    let tolerance = 0.02;
    let (planned, program) = rewrite(&text, &arm, &options(tolerance, Some(loads)));
    assert!(planned.outcomes.iter().skip(2).all(|o| o.inserted > 0), "{:?}", planned.outcomes);
    let left = off_path(&program, &planned);
    assert!(left < tolerance + CHORD_MM, "targets where joints turn leave {left} mm of {loose}");
    assert!((stated(&planned) - left).abs() < CHORD_MM, "stated {}, found {left}", stated(&planned));
    // Where the part is taken, the deviation exceeds the tolerance for a moment, and the outcome states it.
    for (k, outcome) in planned.outcomes.iter().enumerate() {
        let bent = matches!(outcome.reason(), Some(OutcomeReason::PathDeviation { mm }) if mm > tolerance);
        assert_eq!(bent, k == 6, "{outcome:?}");
    }
}

#[test]
fn the_judge_sees_what_the_simulation_sees_and_a_start_without_sides_is_said() {
    let text = source();
    let arm = worn(7);
    let (planned, program) = rewrite(&text, &arm, &options(5.0, None));
    // Verified on the same arm: with its own sides nothing remains, except at the start, where no side is
    // known.
    let report = run_on(&arm, text.as_bytes(), &program, &Cell::default());
    assert!(worst(&report, true) < 1e-3, "{}", worst(&report, true));
    assert!(worst(&report, false) > 0.1);
    let note = planned.notes.iter().find(|note| note.contains("backlash")).expect("a note on backlash");
    assert!(note.contains("joint 1: 0.0200°") && note.contains("is unknown (it has not moved yet"), "{note}");
    // Half the backlash of each joint is in σ at the start and no longer once all joints have moved.
    let sigma = |k: usize| planned.outcomes[k].sigma_mm.get().unwrap();
    assert!(sigma(0) > 0.09, "σ at the start {}", sigma(0));
    let settled = planned.outcomes[3..].iter().filter_map(|o| o.sigma_mm.get()).fold(0.0, f64::max);
    assert!(settled < 0.2 * sigma(0), "σ later {settled}");
}

/// The class of fault: a line must be followed as accurately where it begins under another tool or work object than where it
/// ends. The path is the same, and so are the sides at its end.
#[test]
fn joints_turn_on_lines_that_begin_in_another_object_too() {
    let unit = "[[0,0,0],[1,0,0,0]]";
    let object = format!(" PERS wobjdata wSame := [FALSE,TRUE,\"\",{unit},{unit}];\n PROC main()");
    let mut text = String::new();
    for (k, line) in source().replace(" PROC main()", &object).lines().enumerate() {
        // Consecutive lines alternate between the two objects.
        let other = k % 2 == 0 && line.contains("Move");
        text += &if other { line.replace("tGrip;", "tGrip\\WObj:=wSame;") } else { line.to_owned() };
        text.push('\n');
    }
    assert!(text.contains("tGrip;") && text.contains("wSame;"));
    let task = Task::read(&[("p.mod", text.as_bytes())]);
    let arm = worn(0);
    let (_, program) = rewrite(&text, &arm, &options(5.0, Some(task.loads())));
    let left = worst_end(&program, &text, &arm);
    assert!(left < 1e-3, "where the object changes {left} mm are left");
}

/// The class of fault: a side that counts as known before the backlash is taken up. A link rests until its motor has moved by
/// the whole backlash, so a short motion from an unknown start determines no side, and its σ says so.
#[test]
fn less_than_the_play_tells_no_side() {
    let arm = worn(3);
    let lines: Vec<String> = source().lines().map(str::to_owned).collect();
    let first = lines.iter().position(|line| line.contains("MoveJ")).unwrap();
    // Joint 1 turns by less than its 0.02°: 0.05 mm at half a metre.
    let short = lines[first].replace("MoveJ", "MoveL").replace("-120", "-119.95");
    let mut text = lines[..=first].to_vec();
    text.push(short);
    text.extend_from_slice(&lines[first + 1..]);
    let text = text.join("\n");
    let (planned, _) = rewrite(&text, &arm, &options(5.0, None));
    let sigma = |k: usize| planned.outcomes[k].sigma_mm.get().unwrap();
    assert!(sigma(0) > 0.09 && sigma(1) > 0.05, "{} {}", sigma(0), sigma(1));
    assert!(sigma(3) < 0.2 * sigma(0), "{}", sigma(3));
}

/// The class of fault: a side derived from guessed joints. Where no configuration is checked and the start is unknown, a
/// joint can be a whole turn off and arrive from the other side.
#[test]
fn guessed_joints_tell_no_side() {
    let arm = worn(3);
    let sigma = |text: &str, k: usize| {
        let (planned, _) = rewrite(text, &arm, &options(5.0, None));
        planned.outcomes[k].sigma_mm.get().unwrap()
    };
    let checked = source();
    let unchecked =
        checked.replace("  MoveJ", "  ConfJ\\Off;\n  MoveJ").replacen("  MoveL", "  ConfJ\\On;\n  MoveL", 1);
    assert!(unchecked.contains("ConfJ\\Off") && unchecked.contains("ConfJ\\On"));
    // The first line is just as long from its real start, which is unknown.
    assert!(
        sigma(&checked, 1) < 0.7 * sigma(&unchecked, 1),
        "{} {}",
        sigma(&checked, 1),
        sigma(&unchecked, 1)
    );
    assert!((sigma(&unchecked, 1) - sigma(&unchecked, 0)).abs() < 0.2 * sigma(&unchecked, 0));
    assert!(sigma(&unchecked, 3) < 0.2 * sigma(&unchecked, 0), "{}", sigma(&unchecked, 3));
}

/// The class of fault: motors and links are not distinguished. Where a corrected target lies behind the previous one by less
/// than the backlash, the motor reverses by more than all of it, and after such steps back and forth every end is right.
#[test]
fn steps_smaller_than_the_play_are_right_too() {
    let mut text = String::new();
    for line in source().lines() {
        text += line;
        text.push('\n');
        if line.contains("MoveL") && line.contains(",120,260]") {
            for y in ["119.98", "119.99", "119.95", "119.96", "119.93"] {
                text += &line.replace(",120,", &format!(",{y},"));
                text.push('\n');
            }
        }
    }
    for seed in 0..3 {
        let arm = stiff(&worn(seed));
        let meant = intended(&text);
        let (_, program) = rewrite(&text, &arm, &options(5.0, None));
        let passed = run(&Task::read(&[("p.mod", &program)]).listing, &arm, usize::MAX);
        let ends = passed.iter().filter(|p| p.end && p.motion > 2);
        let worst = ends.map(|p| (p.tip.coords - meant[p.motion]).norm()).fold(0.0, f64::max);
        assert!(worst < 2e-3, "{worst} mm");
    }
}

/// Where gravity closes the play of shoulder and elbow, and where friction holds it, the corrected program leaves nothing, and plain
/// backlash in its place does.
#[test]
fn play_that_gravity_closes_is_corrected() {
    let text = source();
    let task = Task::read(&[("p.mod", text.as_bytes())]);
    let meant = intended(&text);
    // A lump before the joint: the shoulder is always loaded, the elbow along a part of the way, the wrist never.
    let loads = [(1, 2, 0.5), (2, 4, 2.8), (4, 6, 0.45)];
    let mass = |frame| vec![PointMass { frame, mass_kg: 1.0 }];
    for seed in 0..3 {
        let plain = stiff(&worn(seed));
        let mut arm = plain.clone();
        for effect in &mut arm.effects {
            let Some((joint, play_rad)) = effect.play_rad() else { continue };
            if let Some(&(_, frame, friction_nm)) = loads.iter().find(|(of, ..)| *of == joint) {
                let mass = mass(frame);
                *effect = Effect::LoadedBacklash(LoadedBacklash {
                    joint,
                    mass,
                    friction_nm,
                    closing_nm: 1e-4,
                    play_rad,
                });
            }
        }
        // The torque from the place of the lump alone: its lever about the axis, in the arm's own frames.
        let rigid = without_play(&arm);
        let rigid = rigid.at_condition(&Condition::default());
        let torque = |link: &Joints, joint: usize, frame: usize| {
            let frames = rigid.frames(link);
            let lever = (Vector3::from(frames.origin[frame]) - Vector3::from(frames.origin[joint])) * 1e-3;
            lever.cross(&(rigid.model.gravity * 9.80665)).dot(&Vector3::from(frames.z[joint]))
        };
        let closed = Count::new([0_usize; 2]);
        let flank = |link: &Joints| {
            let mut out = [None; 6];
            for (joint, frame, friction_nm) in loads {
                let torque = torque(link, joint, frame);
                let is_closed = torque.abs() > friction_nm;
                out[joint] = is_closed.then(|| torque.signum());
                let mut counts = closed.get();
                counts[usize::from(is_closed)] += usize::from(joint == 2);
                closed.set(counts);
            }
            out
        };
        let worst = |model: &Model| {
            let (_, program) = rewrite(&text, model, &options(5.0, Some(task.loads())));
            let passed = run_loaded(&Task::read(&[("p.mod", &program)]).listing, &arm, 6, &flank);
            let ends = passed.iter().filter(|p| p.end && p.motion > 2);
            ends.map(|p| (p.tip.coords - meant[p.motion]).norm()).fold(0.0, f64::max)
        };
        let right = worst(&arm);
        let [open, shut] = closed.get();
        assert!(open > 200 && shut > 200, "the elbow is held in {open} steps and loaded in {shut}");
        assert!(right < 2e-3, "{right} mm are left");
        let sides_alone = worst(&plain);
        assert!(sides_alone > 0.05, "as plain backlash {sides_alone} mm are left");
    }
}

/// The same arm without compliance.
fn stiff(arm: &Model) -> Model {
    let mut arm = arm.clone();
    arm.effects.retain(|effect| effect.play_rad().is_some());
    arm
}
