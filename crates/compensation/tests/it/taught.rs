//! Frames that were taught with the arm. The truth is known here: an actual arm touches points that lie where they lie, the
//! controller works out its frames from the joints with the arm of the data sheet, and the rewritten program is run on the
//! actual arm by code of this file's own.
//!
//! The class of fault: a frame that a cell file says was taught is re-evaluated as if it had been taught otherwise (with
//! another tool, another frame, by another arm), and a program is written that is off by the difference.

use nalgebra::{Point3, UnitQuaternion, Vector3};
use truegrind_arm::condition::Condition;
use truegrind_arm::effect::Effect;
use truegrind_arm::effect::compliance::Compliance;
use truegrind_arm::inverse::Inverse;
use truegrind_arm::model::{Joints, Model};
use truegrind_compensation::cell::Cell;
use truegrind_compensation::deviation::MotionStatus;
use truegrind_compensation::frames::taught::contradictions;
use truegrind_compensation::frames::taught::{taught_frame, taught_tcp};
use truegrind_compensation::options::Options;
use truegrind_compensation::plan::Plan;
use truegrind_compensation::plan::reason::OutcomeReason;
use truegrind_compensation::plan::solved_program::plan;
use truegrind_math::se3::Pose;
use truegrind_programs::motion::TargetValue;
use truegrind_programs::rapid::Task;
use truegrind_programs::rewrite::RewriteOptions;

use super::{estimated, nominal, perturbed};

mod cell_file;

const EXT: &str = "[9E9,9E9,9E9,9E9,9E9,9E9]";
/// What is claimed (mm).
const RIGHT_MM: f64 = 0.01;

fn pose(position: [f64; 3], turn: [f64; 3]) -> Pose {
    Pose::new(Vector3::from(position), Vector3::from(turn))
}

/// `[[x,y,z],[q1,q2,q3,q4]]` as a controller saves it.
fn rapid(frame: &Pose) -> String {
    let (t, q) = (frame.translation.vector, frame.rotation.quaternion());
    format!("[[{:.5},{:.5},{:.5}],[{:.9},{:.9},{:.9},{:.9}]]", t.x, t.y, t.z, q.w, q.i, q.j, q.k)
}

fn tool(name: &str, frame: &Pose, held: bool) -> String {
    let held = if held { "TRUE" } else { "FALSE" };
    format!("PERS tooldata {name}:=[{held},{},[1,[0,0,50],[1,0,0,0],0,0,0]];\n", rapid(frame))
}

fn object(name: &str, [user, within]: [&Pose; 2], held: bool) -> String {
    let held = if held { "TRUE" } else { "FALSE" };
    format!("PERS wobjdata {name}:=[{held},TRUE,\"\",{},{}];\n", rapid(user), rapid(within))
}

/// Joints as a file states them, to some decimals.
fn degrees(joints: &[Joints], decimals: usize) -> String {
    let one = |q: &Joints| {
        let angles: Vec<String> = q.iter().map(|a| format!("{:.decimals$}", a.to_degrees())).collect();
        format!("[{}]", angles.join(", "))
    };
    format!("[{}]", joints.iter().map(one).collect::<Vec<_>>().join(",\n "))
}

/// Joints with which an arm puts its flange somewhere.
fn joints(arm: &Model, flange: &Pose) -> Joints {
    let sheet = nominal();
    Inverse::new(arm, &Condition::default(), &sheet)
        .solve_near(flange, &Joints::new(0.0, 0.4, 0.2, 0.0, 0.9, 0.0))
        .unwrap()
        .joints
}

fn flange(arm: &Model, q: &Joints) -> Pose {
    arm.at_condition(&Condition::default()).forward(q)
}

/// Poses in which an actual arm touches a point with a tip, in several orientations.
fn about(arm: &Model, point: &Point3<f64>, tip: &Vector3<f64>) -> Vec<Joints> {
    let down = UnitQuaternion::from_axis_angle(&Vector3::y_axis(), std::f64::consts::PI);
    [[0.0, 0.0, 0.0], [0.5, 0.2, 0.3], [-0.4, 0.3, -0.2], [0.2, -0.5, 0.6], [-0.3, -0.3, 0.9]]
        .iter()
        .map(|turn| {
            let rotation = UnitQuaternion::from_scaled_axis(Vector3::from(*turn)) * down;
            let at = Pose::from_parts(point.coords.into(), rotation);
            joints(arm, &(at * Pose::translation(-tip.x, -tip.y, -tip.z)))
        })
        .collect()
}

/// Poses in which an actual arm touches two points on x and one on y of a frame.
fn on_axes(arm: &Model, frame: &Pose, tip: &Vector3<f64>) -> Vec<Joints> {
    [[-30.0, 0.0], [60.0, 0.0], [0.0, 70.0]]
        .iter()
        .map(|[x, y]| about(arm, &(frame * Point3::new(*x, *y, 0.0)), tip)[0])
        .collect()
}

/// The frame that the controller makes of joints: with the arm of the data sheet.
fn made_of(joints: &[Joints], tip: &Vector3<f64>) -> Pose {
    let touched = |i: usize| flange(&nominal(), &joints[i]) * Point3::from(*tip);
    taught_frame(&[touched(0), touched(1), touched(2)]).unwrap()
}

fn translation(v: &Vector3<f64>) -> Pose {
    Pose::translation(v.x, v.y, v.z)
}

const TARGETS: [[f64; 3]; 3] = [[10.0, -20.0, 5.0], [40.0, 10.0, 5.0], [30.0, 40.0, 12.0]];

fn moves(tool: &str, object: &str, turn: &UnitQuaternion<f64>) -> String {
    let q = turn.quaternion();
    let line = |[x, y, z]: &[f64; 3]| {
        format!(
            "MoveJ [[{x},{y},{z}],[{:.9},{:.9},{:.9},{:.9}],[0,0,0,0],{EXT}],v100,fine,{tool}\\WObj:={object};\n",
            q.w, q.i, q.j, q.k
        )
    };
    TARGETS.iter().map(line).collect()
}

fn module(data: &str, body: &str) -> String {
    format!("MODULE M\n{data}PROC main()\nConfJ\\Off;\n{body}ENDPROC\nENDMODULE\n")
}

fn planned(source: &str, cell: &Cell, actual: &Model) -> (Plan, Vec<Pose>) {
    let mut known = estimated(actual.clone(), &[Joints::zeros()]);
    (known.region.min_deg, known.region.max_deg) = ([-400.0; 6], [400.0; 6]);
    known.region.spacing_deg = 1e6;
    let task = Task::read(&[("p.mod", source.as_bytes())]);
    assert!(task.listing.opaque.is_empty(), "{:?}", task.listing.opaque);
    let planned = plan(&task.listing, &known, cell, &Options::default());
    // The shape's uncertainty is that of the cut, point by point: a taught frame moves with the arm, and so does the cut.
    for cut in &planned.cuts {
        let of = |motion: &u32| planned.outcomes[*motion as usize].shape_sigma_mm.get();
        let squares: Vec<f64> = cut.motions.iter().filter_map(of).map(|sigma| sigma * sigma).collect();
        let rms = (squares.iter().sum::<f64>() / squares.len().max(1) as f64).sqrt();
        assert!(
            squares.is_empty() || (rms - cut.shape_sigma_mm).abs() < 0.01 * cut.sigma_mm + 1e-9,
            "{rms} {cut:?}"
        );
    }
    let rewritten = task.rewrite(&planned.changes, &RewriteOptions::default()).unwrap();
    let text = rewritten.files[0].edits.apply(source.as_bytes()).unwrap();
    let again = Task::read(&[("p.mod", &text)]);
    let told = again.listing.motions.iter().filter_map(|motion| match motion.to()?.value {
        Ok(TargetValue::Cartesian(target)) => Some(target.pose()),
        _ => None,
    });
    (planned, told.collect())
}

fn stated(text: &str) -> Cell {
    Cell::from_toml(text).unwrap_or_else(|error| panic!("{error}\n{text}"))
}

fn faults(source: &str, cell: &Cell) -> Vec<String> {
    contradictions(&Task::read(&[("p.mod", source.as_bytes())]).listing, cell, &nominal())
}

/// What is in a cell: true frames, and what the controller was told of them.
struct Scene {
    actual: Model,
    /// The user frame in the base, and the object frame in it.
    object: [Pose; 2],
    grinder: Pose,
    pointer: Vector3<f64>,
    /// How the arm touched the points of the user frame.
    touching: Vec<Joints>,
    /// The user frame as the controller made it.
    told: Pose,
}

fn scene(seed: u64) -> Scene {
    let actual = perturbed(seed, 1.0);
    let object = [pose([380.0, -20.0, 180.0], [0.02, -0.01, 0.1]), pose([8.0, 5.0, 6.0], [0.0, 0.03, 0.2])];
    let grinder = pose([3.0, -4.0, 95.0], [0.0, 0.2, 0.0]);
    let pointer = Vector3::new(-6.0, 2.0, 130.0);
    let touching = on_axes(&actual, &object[0], &pointer);
    let told = made_of(&touching, &pointer);
    Scene { actual, object, grinder, pointer, touching, told }
}

impl Scene {
    /// Turns the tool down in the object.
    fn turn(&self) -> UnitQuaternion<f64> {
        UnitQuaternion::from_axis_angle(&Vector3::y_axis(), std::f64::consts::PI)
    }

    fn data(&self) -> String {
        tool("tPointer", &translation(&self.pointer), true)
            + &tool("tGrind", &self.grinder, true)
            + &object("wPart", [&self.told, &self.object[1]], false)
    }

    fn cell(&self, object: &str, decimals: usize) -> String {
        format!(
            "[[tool]]\nname = \"tPointer\"\norigin = \"metrology\"\n[[tool]]\nname = \"tGrind\"\norigin = \"metrology\"\n\
             [[wobj]]\nname = \"wPart\"\norigin = \"taught\"\n{object}teaching_deg = {}\n",
            degrees(&self.touching, decimals)
        )
    }

    /// How far the actual arm is off when it runs told targets (mm): `user` and `within` as the controller holds them.
    fn off(&self, told: &[Pose], [user, within]: [&Pose; 2], displaced: &Pose) -> f64 {
        let truth = self.object[0] * self.object[1] * displaced;
        let off = told.iter().zip(&TARGETS).map(|(target, meant)| {
            let q = joints(&nominal(), &(user * within * displaced * target * self.grinder.inverse()));
            let reached = flange(&self.actual, &q) * self.grinder;
            (truth.inverse() * reached.translation.vector.into_point() - Point3::from(*meant)).norm()
        });
        assert_eq!(told.len(), TARGETS.len());
        off.fold(0.0, f64::max)
    }
}

trait IntoPoint {
    fn into_point(self) -> Point3<f64>;
}

impl IntoPoint for Vector3<f64> {
    fn into_point(self) -> Point3<f64> {
        Point3::from(self)
    }
}

/// All motions are corrected; the configuration from the unknown start may be flagged.
fn all_changed(plan: &Plan) {
    let from_unknown = Some(OutcomeReason::UnknownStart);
    assert!(
        plan.outcomes.iter().all(|o| o.status == MotionStatus::Changed || o.reason() == from_unknown),
        "{:?} {:?}",
        plan.outcomes,
        plan.notes
    );
}

/// A pointer with another TCP, an object frame on the user frame, a displacement on top, angles as coarse as a panel shows
/// them: none of it is lost.
#[test]
fn a_user_frame_that_a_pointer_taught_is_right_under_object_frame_and_displacement() {
    for seed in 0..4 {
        let scene = scene(seed);
        let moved = pose([5.0, -3.0, 4.0], [0.0, 0.0, 0.0]);
        for (before, displaced) in [("", Pose::identity()), ("PDispSet [[5,-3,4],[1,0,0,0]];\n", moved)] {
            let source =
                module(&scene.data(), &(before.to_owned() + &moves("tGrind", "wPart", &scene.turn())));
            for decimals in [9, 2] {
                for keys in ["", "teaches = \"uframe\"\n"] {
                    let keys = format!("taught_with = \"tPointer\"\n{keys}");
                    let cell = stated(&scene.cell(&keys, decimals));
                    assert_eq!(faults(&source, &cell), Vec::<String>::new());
                    let (plan, told) = planned(&source, &cell, &scene.actual);
                    all_changed(&plan);
                    let off = scene.off(&told, [&scene.told, &scene.object[1]], &displaced);
                    assert!(off < RIGHT_MM, "seed {seed}, {decimals} decimals, {before:?}: {off} mm");
                }
            }
        }
    }
}

/// The object frame may be what was taught: user and object frame then stand together where the points were touched.
#[test]
fn an_object_frame_can_be_what_was_taught() {
    let mut scene = scene(5);
    scene.touching = on_axes(&scene.actual, &(scene.object[0] * scene.object[1]), &scene.pointer);
    let user = scene.object[0];
    let within = user.inverse() * made_of(&scene.touching, &scene.pointer);
    let data = tool("tPointer", &translation(&scene.pointer), true)
        + &tool("tGrind", &scene.grinder, true)
        + &object("wPart", [&user, &within], false);
    let displaced = pose([5.0, -3.0, 4.0], [0.0, 0.0, 0.0]);
    let source = module(
        &data,
        &("PDispSet [[5,-3,4],[1,0,0,0]];\n".to_owned() + &moves("tGrind", "wPart", &scene.turn())),
    );
    let cell = stated(&scene.cell("taught_with = \"tPointer\"\nteaches = \"oframe\"\n", 4));
    let (plan, told) = planned(&source, &cell, &scene.actual);
    all_changed(&plan);
    let off = scene.off(&told, [&user, &within], &displaced);
    assert!(off < RIGHT_MM, "{off} mm");
    // Taken for the user frame it is contradicted, with what to write.
    let found = faults(&source, &stated(&scene.cell("taught_with = \"tPointer\"\n", 4)));
    assert!(
        matches!(&found[..], [one] if one.contains("teaches = \"oframe\"") && one.contains("mm and")),
        "{found:?}"
    );
}

/// The pointer itself was taught: the frame is touched with its true TCP, told with the one that the controller found.
#[test]
fn a_pointer_that_was_taught_itself_is_re_evaluated_before_its_frame() {
    for seed in 10..13 {
        let mut scene = scene(seed);
        let tip = about(&scene.actual, &Point3::new(420.0, 60.0, 220.0), &scene.pointer);
        let sheet = nominal();
        let told_tip = taught_tcp(&sheet.at_condition(&Condition::default()), &tip).unwrap();
        assert!((told_tip - scene.pointer).norm() > 0.1, "the arm's error shows in its TCP");
        scene.told = made_of(&scene.touching, &told_tip);
        let data = tool("tPointer", &translation(&told_tip), true)
            + &tool("tGrind", &scene.grinder, true)
            + &object("wPart", [&scene.told, &scene.object[1]], false);
        let source = module(&data, &moves("tGrind", "wPart", &scene.turn()));
        let pointer =
            format!("name = \"tPointer\"\norigin = \"taught\"\nteaching_deg = {}\n", degrees(&tip, 3));
        let text = scene.cell("taught_with = \"tPointer\"\n", 3);
        let cell = stated(&text.replace("name = \"tPointer\"\norigin = \"metrology\"\n", &pointer));
        let (plan, told) = planned(&source, &cell, &scene.actual);
        all_changed(&plan);
        let off = scene.off(&told, [&scene.told, &scene.object[1]], &Pose::identity());
        assert!(off < RIGHT_MM, "seed {seed}: {off} mm");
    }
}

/// The robot holds the part and the tool stands: the tool's tip was found with a pointer on the robot, the part's frame by
/// holding it to that tip. Frames are those of flange and base then, not the other way round.
#[test]
fn a_standing_tool_and_a_held_part_that_were_taught_are_right() {
    for (seed, with_pointer) in [(20, true), (21, false), (22, true)] {
        let actual = perturbed(seed, 1.0);
        let sheet = nominal();
        let stands = pose([450.0, 30.0, 250.0], [0.0, 0.1, 0.0]);
        let probe = Vector3::new(4.0, -3.0, 90.0);
        let found_by = about(&actual, &Point3::from(stands.translation.vector), &probe);
        // As the controller finds the tip: as the mean of what the pointer touched, or with an unknown pin on the robot.
        let tip = |arm: &Model| {
            let touched = found_by.iter().map(|q| (flange(arm, q) * Point3::from(probe)).coords);
            touched.sum::<Vector3<f64>>() / found_by.len() as f64
        };
        let told_tip = match with_pointer {
            true => tip(&sheet),
            false => {
                // c of R t + p = c, by the mean over the t that fits best.
                let pin = taught_tcp(&sheet.at_condition(&Condition::default()), &found_by).unwrap();
                let touched = found_by.iter().map(|q| (flange(&sheet, q) * Point3::from(pin)).coords);
                touched.sum::<Vector3<f64>>() / found_by.len() as f64
            }
        };
        let part = [pose([10.0, -5.0, 60.0], [0.1, 0.0, 0.3]), pose([2.0, 1.0, 5.0], [0.0, 0.0, 0.4])];
        // The part's points are held to the tip, z of the part against the tool.
        let held_to: Vec<Joints> = [[-15.0, 0.0], [25.0, 0.0], [0.0, 30.0]]
            .iter()
            .map(|[x, y]| {
                let at = part[0] * pose([*x, *y, 0.0], [0.0, 0.0, 0.0]);
                let up = UnitQuaternion::from_axis_angle(&Vector3::y_axis(), 2.6);
                joints(&actual, &(Pose::from_parts(stands.translation, up) * at.inverse()))
            })
            .collect();
        let touched = |i: usize| flange(&sheet, &held_to[i]).inverse() * Point3::from(told_tip);
        let told_part = taught_frame(&[touched(0), touched(1), touched(2)]).unwrap();
        let told_stands = Pose::from_parts(told_tip.into(), stands.rotation);
        let data = tool("tProbe", &translation(&probe), true)
            + &tool("tStands", &told_stands, false)
            + &object("wHeld", [&told_part, &part[1]], true);
        let turn = stands.rotation.inverse() * UnitQuaternion::from_axis_angle(&Vector3::y_axis(), 2.6);
        let turn = (turn * part[0].rotation.inverse() * part[1].rotation.inverse()).inverse();
        let source = module(&data, &moves("tStands", "wHeld", &turn));
        let pointer = if with_pointer { "taught_with = \"tProbe\"\n" } else { "" };
        let cell = stated(&format!(
            "[[tool]]\nname = \"tProbe\"\norigin = \"metrology\"\n[[tool]]\nname = \"tStands\"\norigin = \"taught\"\n{pointer}\
             teaching_deg = {}\n[[wobj]]\nname = \"wHeld\"\norigin = \"taught\"\ntaught_with = \"tStands\"\nteaching_deg = {}\n",
            degrees(&found_by, 4),
            degrees(&held_to, 4)
        ));
        assert_eq!(faults(&source, &cell), Vec::<String>::new());
        let (plan, told) = planned(&source, &cell, &actual);
        all_changed(&plan);
        for (target, meant) in told.iter().zip(&TARGETS) {
            let q = joints(&sheet, &(told_stands * (told_part * part[1] * target).inverse()));
            let reached = (part[0] * part[1]).inverse() * flange(&actual, &q).inverse() * stands;
            let off = (reached.translation.vector - Vector3::from(*meant)).norm();
            assert!(off < RIGHT_MM, "seed {seed}: {off} mm");
        }
    }
}

/// Every way in which the file can name a wrong tool: an error that says what to write, never a program.
#[test]
fn the_tool_that_touched_must_be_known_and_fit() {
    let scene = scene(30);
    let source = module(&scene.data(), &moves("tGrind", "wPart", &scene.turn()));
    let fault = |source: &str, keys: &str| {
        let cell = stated(&scene.cell(keys, 6));
        let found = faults(source, &cell);
        assert_eq!(found.len(), 1, "{found:?}");
        // A plan without the check refuses every motion.
        let (plan, told) = planned(source, &cell, &scene.actual);
        assert!(
            plan.outcomes.iter().all(|o| o.reason() == Some(OutcomeReason::CellContradiction)),
            "{:?}",
            plan.outcomes
        );
        assert!(plan.changes.is_empty() && plan.notes.contains(&found[0]));
        assert_eq!(told.len(), 3);
        found[0].clone()
    };
    let other = fault(&source, "taught_with = \"tGrind\"\n");
    assert!(other.contains("they fit tool tPointer: write taught_with = \"tPointer\""), "{other}");
    let unknown = fault(&source, "taught_with = \"tPinter\"\n");
    assert!(unknown.contains("tPinter") && unknown.contains("position_mm"), "{unknown}");
    let open = fault(&source, "");
    assert!(open.contains("tGrind, tPointer") && open.contains("taught_with"), "{open}");
    let stands = source.replace("tooldata tPointer:=[TRUE", "tooldata tPointer:=[FALSE");
    assert!(fault(&stands, "taught_with = \"tPointer\"\n").contains("that the robot holds"));
    // A pointer that the program changes as it runs has no known value.
    let changed = source.replace("ConfJ", "tPointer.tframe.trans.z:=7;\nConfJ");
    assert!(fault(&changed, "taught_with = \"tPointer\"\n").contains("no such tool has a known value"));
    // The frame was moved since: 0.4 mm are more than angles of six decimals explain.
    let text = rapid(&scene.told);
    let mut since = scene.told;
    since.translation.vector.x += 0.4;
    let moved = fault(&source.replace(&text, &rapid(&since)), "taught_with = \"tPointer\"\n");
    assert!(moved.contains("0.40 mm and 0.000°") && moved.contains("frame was changed since"), "{moved}");
}

/// With one tool alone there is nothing to name; a pointer that only the cell file knows is placed there.
#[test]
fn one_tool_needs_no_name_and_a_pointer_may_stand_in_the_cell_file_alone() {
    let scene = scene(31);
    let source = module(&scene.data(), &moves("tGrind", "wPart", &scene.turn()));
    let without = source.replace(&tool("tPointer", &translation(&scene.pointer), true), "");
    let placed = scene
        .cell("taught_with = \"tPointer\"\n", 5)
        .replace("name = \"tPointer\"\n", "name = \"tPointer\"\nposition_mm = [-6, 2, 130]\n");
    let (plan, told) = planned(&without, &stated(&placed), &scene.actual);
    all_changed(&plan);
    assert!(scene.off(&told, [&scene.told, &scene.object[1]], &Pose::identity()) < RIGHT_MM);
    // Where program and cell file place it apart, neither is believed.
    let apart = stated(&placed.replace("[-6, 2, 130]", "[-6, 2, 131]"));
    let used = source.replace("tGrind\\WObj", "tPointer\\WObj");
    let found = faults(&used, &apart);
    assert!(found.iter().any(|fault| fault.contains("1.00 mm and 0.000° away")), "{found:?}");
    let alone = scene.told;
    let touching = on_axes(&scene.actual, &scene.object[0], &scene.grinder.translation.vector);
    let told_frame = made_of(&touching, &scene.grinder.translation.vector);
    let source = without.replace(&rapid(&alone), &rapid(&told_frame));
    let cell = stated(&format!(
        "[[wobj]]\nname = \"WPART\"\norigin = \"taught\"\nteaching_deg = {}\n",
        degrees(&touching, 5)
    ));
    let (plan, told) = planned(&source, &cell, &scene.actual);
    all_changed(&plan);
    assert!(scene.off(&told, [&told_frame, &scene.object[1]], &Pose::identity()) < RIGHT_MM);
}

/// A told TCP that its teaching poses do not give is not moved, and poses that tell none are an error.
#[test]
fn a_told_tcp_must_be_that_of_its_teaching_poses() {
    let scene = scene(40);
    let poses = about(&scene.actual, &Point3::new(420.0, 60.0, 220.0), &scene.grinder.translation.vector);
    let sheet = nominal();
    let tcp = taught_tcp(&sheet.at_condition(&Condition::default()), &poses).unwrap();
    let fault = |shift: f64, poses: &[Joints]| {
        let told = Pose::from_parts((tcp + Vector3::z() * shift).into(), scene.grinder.rotation);
        let source = module(&tool("tGrind", &told, true), &moves("tGrind", "wobj0", &scene.turn()));
        let text = format!(
            "[[tool]]\nname = \"tGrind\"\norigin = \"taught\"\nteaching_deg = {}\n",
            degrees(poses, 4)
        );
        faults(&source, &stated(&text))
    };
    assert_eq!(fault(0.0, &poses), Vec::<String>::new());
    let found = fault(8.0, &poses);
    assert!(
        matches!(&found[..], [one] if one.contains("8.00 mm") && one.contains("another tool")),
        "{found:?}"
    );
    let found = fault(0.0, &[poses[0]; 5]);
    assert!(matches!(&found[..], [one] if one.contains("too much alike")), "{found:?}");
}

/// `origin = "taught"` without points: its numbers are taken as they stand, and a note says so, for tools, work objects, and what is
/// held the other way round.
#[test]
fn taught_without_points_is_taken_as_it_stands_and_said() {
    let scene = scene(41);
    let bare =
        "[[tool]]\nname = \"tGrind\"\norigin = \"taught\"\n[[wobj]]\nname = \"wPart\"\norigin = \"taught\"\n";
    let source = module(&scene.data(), &moves("tGrind", "wPart", &scene.turn()));
    let (plan, _) = planned(&source, &stated(bare), &scene.actual);
    all_changed(&plan);
    assert_eq!(plan.notes.iter().filter(|note| note.contains("teaching points are missing")).count(), 2);
    let swapped = source.replace("tGrind:=[TRUE", "tGrind:=[FALSE").replace("wPart:=[FALSE", "wPart:=[TRUE");
    let (plan, _) = planned(&swapped, &stated(bare), &scene.actual);
    assert_eq!(plan.notes.iter().filter(|note| note.contains("teaching points are missing")).count(), 2);
}

/// The class: a linear system that is solved by a decomposition which is not exact where singular values coincide, as those of
/// orientations about one point do. The TCP of teaching poses is the one of least squares: the residuals r_i = R_i t + p_i − c
/// sum to nothing, and so do R_iᵀ r_i.
#[test]
fn the_tcp_of_teaching_poses_is_that_of_least_squares() {
    let arm = truegrind_arm::robots::load("abb-irb-2600-12-1.85").unwrap().model;
    let arm = arm.at_condition(&Condition::default());
    let mut state = 7_u64;
    let mut next = || {
        state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (state >> 11) as f64 / (1_u64 << 53) as f64 - 0.5
    };
    for _ in 0..500 {
        let base = Joints::from_fn(|_, _| next());
        let poses: Vec<Joints> = (0..6).map(|_| base + Joints::from_fn(|_, _| 0.8 * next())).collect();
        let Some(tcp) = taught_tcp(&arm, &poses) else { continue };
        let flanges: Vec<_> = poses.iter().map(|joints| arm.forward(joints)).collect();
        let tips: Vec<Vector3<f64>> =
            flanges.iter().map(|flange| (flange * Point3::from(tcp)).coords).collect();
        let middle = tips.iter().sum::<Vector3<f64>>() / tips.len() as f64;
        let slope: Vector3<f64> =
            flanges.iter().zip(&tips).map(|(flange, tip)| flange.rotation.inverse() * (tip - middle)).sum();
        assert!(slope.norm() < 1e-8 * tips.iter().map(|tip| (tip - middle).norm()).sum::<f64>(), "{slope}");
    }
}

/// The arm gives way under the tool that touches, not under the load of the measurement.
#[test]
fn a_frame_is_re_evaluated_under_the_load_of_the_tool_that_touched() {
    let mut scene = scene(31);
    let spring = |joint| Effect::JointCompliance(Compliance { joint, compliance_rad_per_nm: 4e-5 });
    scene.actual.effects = vec![spring(1), spring(2)];
    let measured = Condition { payload_kg: Some(1.0), ..Condition::default() };
    // As the data of the two tools say: 12 kg, and 1 kg at 50 mm.
    let under = |mass_kg: f64, z: f64| Condition {
        payload_kg: Some(mass_kg),
        payload_centre_mm: [0.0, 0.0, z],
        ..measured
    };
    let sheet = nominal();
    let touching: Vec<Joints> = [[-30.0, 0.0], [60.0, 0.0], [0.0, 70.0]]
        .iter()
        .map(|[x, y]| {
            let down = UnitQuaternion::from_axis_angle(&Vector3::y_axis(), std::f64::consts::PI);
            let at = Pose::from_parts((scene.object[0] * Point3::new(*x, *y, 0.0)).coords.into(), down);
            let flange = at * translation(&-scene.pointer);
            let near = Joints::new(0.0, 0.4, 0.2, 0.0, 0.9, 0.0);
            Inverse::new(&scene.actual, &under(12.0, 80.0), &sheet).solve_near(&flange, &near).unwrap().joints
        })
        .collect();
    scene.told = made_of(&touching, &scene.pointer);
    scene.touching = touching;
    let data = scene.data().replacen("[1,[0,0,50]", "[12,[0,0,80]", 1);
    let source = module(&data, &moves("tGrind", "wPart", &scene.turn()));
    let cell = stated(&scene.cell("taught_with = \"tPointer\"\n", 10));
    let task = Task::read(&[("p.mod", source.as_bytes())]);
    let mut known = estimated(scene.actual.clone(), &[Joints::zeros()]);
    (known.region.min_deg, known.region.max_deg) = ([-400.0; 6], [400.0; 6]);
    known.region.spacing_deg = 1e6;
    let off = |own_loads: bool| {
        let loads = own_loads.then(|| task.loads());
        let options = Options { condition: measured, loads, ..Options::default() };
        let planned = plan(&task.listing, &known, &cell, &options);
        let rewritten = task.rewrite(&planned.changes, &RewriteOptions::default()).unwrap();
        let text = rewritten.files[0].edits.apply(source.as_bytes()).unwrap();
        let again = Task::read(&[("p.mod", &text)]);
        let truth = scene.object[0] * scene.object[1];
        let far = again.listing.motions.iter().zip(&TARGETS).map(|(motion, meant)| {
            let target = motion.to().unwrap().value.unwrap().cartesian().unwrap().pose();
            let told = scene.told * scene.object[1] * target * scene.grinder.inverse();
            let q = joints(&sheet, &told);
            let reached = scene.actual.at_condition(&under(1.0, 50.0)).forward(&q) * scene.grinder;
            (truth.inverse() * reached.translation.vector.into_point() - Point3::from(*meant)).norm()
        });
        far.fold(0.0, f64::max)
    };
    assert!(off(true) < RIGHT_MM, "{}", off(true));
    // With one stated payload for all the frame lies where another load would have put it.
    assert!(off(false) > 10.0 * RIGHT_MM, "{}", off(false));
}
