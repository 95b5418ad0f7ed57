//! Circular motions: kept and checked, or replaced by straight pieces; arcs of NC.

use std::f64::consts::{PI, TAU};

use nalgebra::{Isometry3, Point3, Unit, UnitQuaternion, Vector3};
use truegrind_arm::effect::Effect;
use truegrind_arm::effect::backlash::Backlash;
use truegrind_arm::model::Joints;
use truegrind_compensation::cell::Cell;
use truegrind_compensation::compensate::compensate;
use truegrind_compensation::cut::Cuts;
use truegrind_compensation::deviation::MotionStatus;
use truegrind_compensation::options::{Circles, Options};
use truegrind_compensation::plan::reason::OutcomeReason;
use truegrind_compensation::plan::solved_program::plan;
use truegrind_compensation::segment::curve::{Arc, Curve};
use truegrind_math::se3::Pose;
use truegrind_programs::motion::{MotionKind, Reason, Switch};
use truegrind_programs::nc::dialect::Dialect;
use truegrind_programs::nc::setup::Setup;
use truegrind_programs::rapid::Task;
use truegrind_programs::reading::Program;
use truegrind_programs::rewrite::RewriteOptions;

use super::segment::{down, gone, known, module, module_with, rewrite, start_joints, told};
use super::{estimated, nominal, perturbed};

/// Distance of a point from a circle about a vertical axis.
fn off_circle(point: &Vector3<f64>, centre: [f64; 3], radius: f64) -> f64 {
    let off = point - Vector3::from(centre);
    (off.x.hypot(off.y) - radius).hypot(off.z)
}

const CENTRE: [f64; 3] = [380.0, 0.0, 320.0];
const RADIUS: f64 = 60.0;

fn on_circle(degrees: f64) -> String {
    let (sin, cos) = degrees.to_radians().sin_cos();
    down(CENTRE[0] + RADIUS * cos, CENTRE[1] + RADIUS * sin, CENTRE[2])
}

/// From −150° over −90° to −20°, a three-point arc of 130°.
fn arc_program(options: &str, name: &str) -> String {
    module(&format!(
        "  MoveL {},v200,fine,tool0;\n  {name} {}, ! over\n   {}{options},v50,z5,tool0;\n  MoveL {},v200,fine,tool0;\n",
        on_circle(-150.0),
        on_circle(-90.0),
        on_circle(-20.0),
        on_circle(-20.0).replacen("320.0000", "350.0000", 1),
    ))
}

#[test]
fn a_circle_is_kept_and_its_path_checked() {
    let actual = perturbed(11, 1.0);
    let source = arc_program("", "MoveC");
    let (planned, text) = rewrite(&source, &known(&actual), &Options::default());
    let outcome = &planned.outcomes[1];
    assert_eq!((outcome.status, outcome.inserted), (MotionStatus::Changed, 0), "{outcome:?}");
    assert!(text.contains("MoveC") && text.contains("! over"));
    // The stated deviation is that of an arm that follows the commanded circle.
    let task = Task::read(&[("p.mod", text.as_bytes())]);
    let ends = told(&task.listing);
    let via = task.listing.motions[1].targets[0].value.unwrap().cartesian().unwrap().pose();
    let point = |p: &Pose| Point3::from(p.translation.vector);
    let arc = Arc::through(&point(&ends[0]), &point(&via), &point(&ends[1]), None).unwrap();
    let path = (0..=400).map(|k| {
        let s = f64::from(k) / 400.0;
        let rotation = ends[0].rotation.slerp(&ends[1].rotation, s);
        Isometry3::from_parts(arc.at(s).coords.into(), rotation)
    });
    let most = gone(path, &start_joints(&ends[0]), &actual)
        .iter()
        .map(|pose| off_circle(&pose.translation.vector, CENTRE, RADIUS))
        .fold(0.0, f64::max);
    let stated = outcome.path_deviation_mm.get().unwrap();
    assert!(most > 1e-4 && (most - stated).abs() < 4e-3, "{most} stated as {stated}");
}

#[test]
fn a_circle_in_straight_pieces_is_followed_within_the_tolerance_and_smoothly() {
    let actual = perturbed(11, 1.0);
    for (name, line) in [("MoveC", "MoveL"), ("MOVEC", "MoveL")] {
        for tolerance_mm in [0.02, 0.05, 0.3] {
            let source = arc_program("", name);
            let options = Options { circles: Circles::Segments, tolerance_mm, ..Options::default() };
            let known = known(&actual);
            let (planned, text) = rewrite(&source, &known, &options);
            let outcome = &planned.outcomes[1];
            assert_eq!(outcome.status, MotionStatus::Changed, "{outcome:?}");
            assert!(
                !text.to_uppercase().contains("MOVEC") && text.contains(line) && text.contains("! over"),
                "{text}"
            );
            let task = Task::read(&[("p.mod", text.as_bytes())]);
            assert!(task.listing.opaque.is_empty(), "{text}");
            let count = task.listing.motions.len();
            assert_eq!(count, 3 + outcome.inserted as usize);
            let ends = told(&task.listing);
            let pieces = &ends[..count - 1];
            let path = pieces.windows(2).flat_map(|pair| {
                let (a, b) = (pair[0], pair[1]);
                (0..=20).map(move |k| {
                    let s = f64::from(k) / 20.0;
                    let position = a.translation.vector.lerp(&b.translation.vector, s);
                    Isometry3::from_parts(position.into(), a.rotation.slerp(&b.rotation, s))
                })
            });
            let most = gone(path, &start_joints(&ends[0]), &actual)
                .iter()
                .map(|pose| off_circle(&pose.translation.vector, CENTRE, RADIUS))
                .fold(0.0, f64::max);
            assert!(most <= tolerance_mm, "{most} of {tolerance_mm}");
            assert!(most > 0.4 * tolerance_mm, "no more pieces than needed: {most} of {tolerance_mm}");
            // Equal pieces, the speed of the instruction, and a zone that does not stop; the last keeps its
            // own.
            let long = |pair: &[Pose]| (pair[0].translation.vector - pair[1].translation.vector).norm();
            let lengths: Vec<f64> = pieces.windows(2).map(long).collect();
            let mean = lengths.iter().sum::<f64>() / lengths.len() as f64;
            assert!(lengths.iter().all(|length| (length / mean - 1.0).abs() < 0.02), "{lengths:?}");
            for motion in &task.listing.motions[1..count - 2] {
                assert_eq!(motion.kind, MotionKind::Linear);
                assert_eq!(task.listing.speed(motion).unwrap().text, "v50");
                let zone = task.listing.zone(motion).unwrap().value.unwrap();
                assert!(!zone.fine && 2.0 * zone.tcp_mm <= mean, "{zone:?} in pieces of {mean}");
            }
            assert_eq!(task.listing.zone(&task.listing.motions[count - 2]).unwrap().text, "z5");
            // Each inserted target states the configuration in which it is reached.
            let nothing = estimated(nominal(), &[Joints::zeros()]);
            let again = plan(&task.listing, &nothing, &Cell::default(), &Options::default());
            assert!(again.outcomes.iter().all(|o| o.status != MotionStatus::Refused), "{:?}", again.outcomes);
        }
    }
}

#[test]
fn a_circle_that_may_not_be_split_stays_and_is_flagged() {
    let actual = perturbed(11, 1.0);
    let options = Options { circles: Circles::Segments, ..Options::default() };
    let (planned, text) =
        rewrite(&arc_program("", "MoveC").replace("v50,", "v50\\T:=3,"), &known(&actual), &options);
    assert_eq!(planned.outcomes[1].reason(), Some(OutcomeReason::CircleKept));
    assert_eq!(planned.outcomes[1].status, MotionStatus::Flagged);
    assert!(text.contains("MoveC"));
    // Nor one with an unknown start.
    let alone = module(&format!("  MoveC {},{},v50,z5,tool0;\n", on_circle(-90.0), on_circle(-20.0)));
    let (planned, _) = rewrite(&alone, &known(&actual), &options);
    assert_eq!(planned.outcomes[0].reason(), Some(OutcomeReason::CircleKept));
    // Three points that make no circle.
    let line = module(&format!(
        "  MoveL {0},v50,fine,tool0;\n  MoveC {1},{0},v50,fine,tool0;\n",
        on_circle(-150.0),
        on_circle(-90.0)
    ));
    let (planned, _) = rewrite(&line, &known(&actual), &Options::default());
    assert_eq!(planned.outcomes[1].reason(), Some(OutcomeReason::FullCircle));
}

#[test]
fn a_circle_whose_start_stays_is_no_other_circle() {
    let pose = |x: f64, y: f64| {
        format!("[[{x},{y},420],[0.707107,0,0.707107,0],[0,0,0,0],[9E9,9E9,9E9,9E9,9E9,9E9]]")
    };
    let of = |seed: u64, radius: f64, start: &str| {
        let (via, to) = (pose(374.0 + radius, radius), pose(374.0 + 2.0 * radius, 0.0));
        let source = module(&format!(
            "  ConfL \\Off;\n  MoveL {start}\n  MoveC {via},{to},v50,fine,tool0;\n  MoveC {},{},v50,fine,tool0;\n",
            pose(374.0 + radius, -radius),
            pose(374.0, 0.0)
        ));
        let actual = perturbed(seed, 3.0);
        let options = Options { max_correction_mm: 50.0, tolerance_mm: 50.0, ..Options::default() };
        let (planned, text) = rewrite(&source, &known(&actual), &options);
        let shift = planned.outcomes[0].before_mm.get().or(planned.outcomes[1].before_mm.get()).unwrap();
        assert!((0.5..20.0).contains(&shift), "{shift}");
        // The configuration from the unknown start is flagged.
        let from_unknown = OutcomeReason::UnknownStart;
        let reason = |reason: Option<OutcomeReason>| reason.filter(|reason| *reason != from_unknown);
        let reasons: Vec<_> = planned.outcomes.iter().map(|outcome| reason(outcome.reason())).collect();
        assert!(reasons[1].is_none() || text.contains(&format!("MoveC {via},{to}")), "{text}");
        reasons
    };
    let start = pose(374.0, 0.0);
    let (plain, corrected) = (format!("{start},v50,fine,tool0;"), format!("{start},v50,fine,tool0 \\Corr;"));
    let unknown = "Offs(p0,0,0,found()),v50,fine,tool0;".to_owned();
    let sensor = Some(OutcomeReason::Program(Reason::SensorGuided));
    let mut strayed = 0;
    for seed in 11..19 {
        for radius in [0.5, 100.0] {
            assert_eq!(of(seed, radius, &plain)[..], [None; 3]);
        }
        // With all that begins where it ends.
        let small = of(seed, 0.5, &corrected);
        assert!(
            small == [sensor, None, None]
                || small[..2] == [sensor, Some(OutcomeReason::ArcFromUncorrected { line: 4 })],
            "{small:?}"
        );
        strayed += usize::from(small[1].is_some());
        assert_eq!(of(seed, 100.0, &corrected), [sensor, None, None]);
        assert_eq!(of(seed, 0.5, &unknown)[1], Some(OutcomeReason::NoCircle));
        assert_eq!(of(seed, 100.0, &unknown)[1..], [None; 2]);
    }
    assert!(strayed > 3, "{strayed}");
}

/// With backlash, or at another height, the ends of a full turn are corrected by different amounts. It was said to make no circle, or to be
/// singular, and an arc behind it had its reason.
#[test]
fn a_full_turn_whose_ends_part_says_so_and_is_made_of_lines() {
    let mut worn = perturbed(11, 1.0);
    worn.effects.extend([0, 2].map(|joint| Effect::Backlash(Backlash { joint, play_rad: 4e-4 })));
    let bent = perturbed(5, 3.0);
    let head = "(truegrind angles wpr)\n(truegrind start [0, 10, 10, 0, 70, 0])\n(truegrind tool T1 t [[12,-8,110],[1,0,0,0]])\n\
                (truegrind frame G54 w [[390,-10,230],[1,0,0,0]])\nG90 G21 G17 G40 G94\nT1 M6\nG54\nG43.4 H1\n\
                G0 X-20. Y-20. Z30. A180. B0. C0.\nG0 X0. Y0.\nG1 Z2. F600.\n";
    for (actual, turn) in
        [(&worn, "G2 X0. Y0. I20. J0.\n"), (&worn, "G3 I20. J0.\n"), (&bent, "G2 X0. Y0. Z1. I20. J0.\n")]
    {
        let source = format!("{head}{turn}G2 X40. Y0. I20. J0.\nG1 X50.\nG0 Z30.\nM30\n");
        let corrected = |circles: Circles| {
            let setup = Setup { dialect: Some(Dialect::Fanuc), ..Setup::default() };
            let program =
                Program::Nc(truegrind_programs::nc::Task::read(&[("p.nc", source.as_bytes())], &setup));
            let options = Options { circles, cuts: Cuts::Single, ..Options::default() };
            compensate(&program, &known(actual), &Cell::default(), &options, None).unwrap().plan
        };
        let kept = corrected(Circles::Keep);
        let [turn_reason, behind] = [3, 4].map(|motion| kept.outcomes[motion].reason());
        assert_eq!(turn_reason, Some(OutcomeReason::Program(Reason::OpenCircle)), "{turn}");
        let is_own = !matches!(
            behind,
            Some(OutcomeReason::Program(_) | OutcomeReason::NoCircle | OutcomeReason::SingularPath)
        );
        assert!(is_own, "{turn}{behind:?}");
        let lines = corrected(Circles::Segments);
        assert_eq!(lines.outcomes[3].reason(), None, "{turn}");
        assert!(lines.outcomes[3].inserted > 10, "{turn}{:?}", lines.outcomes[3]);
    }
}

/// An unmodified circular motion depends on its start as well: where that is corrected, a circle that is small against the
/// correction, closes, or has points unknown to the program becomes a different one.
#[test]
fn a_circle_that_stays_starts_where_it_did() {
    let pose = |x: f64, y: f64| {
        format!("[[{x},{y},420],[0.707107,0,0.707107,0],[0,0,0,0],[9E9,9E9,9E9,9E9,9E9,9E9]]")
    };
    let first = |seed: u64, circle: &str| {
        let source = module(&format!(
            "  ConfL \\Off;\n  MoveL {},v50,fine,tool0;\n  MoveL {},v50,fine,tool0;\n  MoveC {circle},v50,fine,tool0 \\Corr;\n",
            pose(370.0, -5.0),
            pose(374.0, 0.0)
        ));
        let options = Options { max_correction_mm: 50.0, tolerance_mm: 50.0, ..Options::default() };
        let (planned, text) = rewrite(&source, &known(&perturbed(seed, 3.0)), &options);
        assert!(text.contains(circle), "{text}");
        // The configuration from the unknown start is flagged.
        let from_unknown = OutcomeReason::UnknownStart;
        let reason = |reason: Option<OutcomeReason>| reason.filter(|reason| *reason != from_unknown);
        let reasons: Vec<_> = planned.outcomes.iter().map(|outcome| reason(outcome.reason())).collect();
        assert!(reasons[0].is_none() && planned.outcomes[0].before_mm.get().unwrap() > 0.5, "{reasons:?}");
        assert!(matches!(reasons[2], Some(OutcomeReason::Program(Reason::SensorGuided))), "{reasons:?}");
        reasons[1]
    };
    let stays = |seed: u64, circle: &str| {
        matches!(first(seed, circle), Some(OutcomeReason::StartOfUnchangedArc { .. }))
    };
    let mut small = 0;
    for seed in 11..19 {
        assert!(!stays(seed, &format!("{},{}", pose(474.0, 100.0), pose(574.0, 0.0))));
        assert!(stays(seed, &format!("{},{}", pose(474.0, 100.0), pose(374.0, 0.0))), "closed, seed {seed}");
        assert!(stays(seed, &format!("{},Offs(p0,0,0,reg1)", pose(474.0, 100.0))), "not told, seed {seed}");
        small += usize::from(stays(seed, &format!("{},{}", pose(374.5, 0.5), pose(375.0, 0.0))));
    }
    assert!(small > 3, "{small}");
}

/// Seen from the start, a controller wants circle point and end under at least 1° (ABB, RAPID instructions, MoveC): a program
/// that it carries out must not become one at which it stops, whichever of the points move, and under whichever tools.
#[test]
fn an_arc_that_the_controller_accepts_remains_one() {
    let tool = "PERS tooldata long := [TRUE,[[0,0,60],[1,0,0,0]],[1,[0,0,30],[1,0,0,0],0,0,0]];\n";
    let pose = |x: f64, y: f64, z: f64| {
        format!("[[{x:.4},{y:.4},{z:.4}],[0,0,1,0],[0,0,0,0],[9E9,9E9,9E9,9E9,9E9,9E9]]")
    };
    // The start is stated for the flange in one case, 60 mm above the tip of the other tool.
    let points = |listing: &truegrind_programs::motion::Listing, above: f64| {
        let place = |motion: usize, target: usize| {
            let target = listing.motions[motion].targets[target].value.unwrap();
            target.cartesian().unwrap().pose()
        };
        let start = place(0, 0) * Pose::translation(0.0, 0.0, above);
        [start, place(1, 0), place(1, 1)].map(|pose| pose.translation.vector)
    };
    let angle = |[from, via, to]: [Vector3<f64>; 3]| (via - from).angle(&(to - from)).to_degrees();
    let mut stopped = 0;
    for (before, after, above) in [
        ("tool0", "tool0", 0.0),
        ("long", "long", 0.0),
        ("tool0", "long", 60.0),
        ("tool0 \\Corr", "tool0", 0.0),
        ("tool0", "tool0 \\Corr", 0.0),
    ] {
        for seed in 11..27 {
            let (sin, cos) = 1.002_f64.to_radians().sin_cos();
            let source = module_with(
                tool,
                &format!(
                    "  ConfL \\Off;\n  MoveL {},v50,fine,{before};\n  MoveC {},{},v50,fine,{after};\n",
                    pose(374.0, -100.0, 300.0 + above),
                    pose(374.0 + 100.0 * sin, -100.0 + 100.0 * cos, 300.0),
                    pose(374.0, 100.0, 300.0)
                ),
            );
            let task = Task::read(&[("p.mod", source.as_bytes())]);
            assert!((angle(points(&task.listing, above)) - 1.002).abs() < 5e-4);
            let options = Options { max_correction_mm: 50.0, tolerance_mm: 50.0, ..Options::default() };
            let (planned, text) = rewrite(&source, &known(&perturbed(seed, 1.0)), &options);
            let task = Task::read(&[("p.mod", text.as_bytes())]);
            let seen = angle(points(&task.listing, above));
            assert!(seen >= 1.0, "{before}, {after}, seed {seed}: {seen}°, {:?}", planned.outcomes);
            let [start, arc] = [0, 1].map(|motion| planned.outcomes[motion].reason());
            stopped += usize::from(
                arc == Some(OutcomeReason::NoCircle)
                    || matches!(start, Some(OutcomeReason::StartOfUnchangedArc { .. })),
            );
        }
    }
    assert!((20..70).contains(&stopped), "{stopped}");
}

#[test]
fn every_circular_instruction_has_a_straight_form_of_the_same_process() {
    let source = include_str!("../../../../programs/circles.mod");
    let options = Options { circles: Circles::Segments, ..Options::default() };
    let (planned, text) = rewrite(source, &known(&perturbed(11, 0.5)), &options);
    // What is triggered along the whole of a circle would be triggered along its last piece.
    let original = Task::read(&[("p.mod", source.as_bytes())]);
    for (motion, outcome) in original.listing.motions.iter().zip(&planned.outcomes) {
        let kept = (MotionStatus::Flagged, Some(OutcomeReason::CircleKept));
        let expected = if &*motion.instruction == "TriggC" { kept } else { (MotionStatus::Changed, None) };
        assert_eq!((outcome.status, outcome.reason()), expected, "{outcome:?}");
    }
    let task = Task::read(&[("p.mod", text.as_bytes())]);
    assert!(task.listing.opaque.is_empty() && text.contains("! the way back"), "{text}");
    let names: std::collections::BTreeSet<&str> =
        task.listing.motions.iter().map(|motion| &*motion.instruction).collect();
    let expected = [
        "ArcL",
        "ArcLEnd",
        "ArcLStart",
        "DispL",
        "FCPressL",
        "MoveJ",
        "MoveL",
        "MoveLDO",
        "MoveLSync",
        "PaintL",
        "TriggC",
    ];
    assert!(names.iter().eq(expected.iter()), "{names:?}");
    // Every end is still there, and nothing is refused when the result is read again.
    assert_eq!(
        task.listing.motions.len(),
        planned.outcomes.iter().map(|o| 1 + o.inserted as usize).sum::<usize>()
    );
    let again = plan(&task.listing, &estimated(nominal(), &[Joints::zeros()]), &Cell::default(), &options);
    assert!(again.outcomes.iter().all(|o| o.status != MotionStatus::Refused), "{:?}", again.outcomes);
    assert!(text.contains("DispL [[") && text.contains("ArcLEnd p3,v100,seam1,weld1,fine,tool0;"), "{text}");
}

fn nc_setup() -> Setup {
    Setup { dialect: Some(Dialect::LinuxCnc), ..Setup::default() }
}

#[test]
fn nc_arcs_helices_and_whole_circles_are_checked_and_become_straight_pieces_when_asked() {
    let head = "(truegrind angles wpr)\n(truegrind tool T0 t [[0,0,0],[1,0,0,0]])\n(truegrind frame G54 w [[0,0,0],[1,0,0,0]])\nG90 G17 G54\n";
    let actual = perturbed(12, 0.3);
    let known = known(&actual);
    // Start at (440, 0), about (380, 0); the third rises 12 mm on three quarters of a turn.
    for (body, sweep, rise) in [
        ("G3 X320 Y0 I-60 J0", PI, 0.0),
        ("G2 X320 Y0 R60", -PI, 0.0),
        ("G3 X380 Y-60 Z332 I-60", 1.5 * PI, 12.0),
        ("G3 I-60", TAU, 0.0),
    ] {
        let source = format!("{head}G1 X440 Y0 Z320 A180 B0 C180 F3000\n{body}\nX400 Y0 Z340\n", body = body)
            .replace("\nX400", "\nG1 X400");
        let setup = nc_setup();
        let task = truegrind_programs::nc::Task::read(&[("p.ngc", source.as_bytes())], &setup);
        for circles in [Circles::Keep, Circles::Segments] {
            // An arc of the control lies in its plane, whatever the arm needs: it keeps to the intended one less well.
            let tolerance_mm = if circles == Circles::Keep { 0.2 } else { 0.05 };
            let options = Options { circles, tolerance_mm, ..Options::default() };
            let planned = plan(&task.listing, &known, &Cell::default(), &options);
            let outcome = &planned.outcomes[1];
            assert_eq!(outcome.status, MotionStatus::Changed, "{body}: {outcome:?}");
            assert!(outcome.path_deviation_mm.get().unwrap() <= options.tolerance_mm, "{body}: {outcome:?}");
            assert_eq!(outcome.inserted > 10, circles == Circles::Segments, "{body}: {outcome:?}");
            let rewritten = task.rewrite(&planned.changes, &RewriteOptions::default()).unwrap();
            let text = rewritten.files[0].edits.apply(source.as_bytes()).unwrap();
            let again = truegrind_programs::nc::Task::read(&[("p.ngc", &text[..])], &setup);
            if circles == Circles::Keep {
                assert_eq!(again.listing.motions[1].kind, MotionKind::Circular);
                continue;
            }
            let shown = String::from_utf8_lossy(&text);
            assert!(again.listing.motions.iter().all(|m| m.kind == MotionKind::Linear), "{shown}");
            assert!(!shown.contains('I') && !shown.contains('R'), "{shown}");
            let ends = told(&again.listing);
            let pieces = &ends[..ends.len() - 1];
            let path = pieces.windows(2).flat_map(|pair| {
                let (a, b) = (pair[0], pair[1]);
                (0..=10).map(move |k| a.lerp_slerp(&b, f64::from(k) / 10.0))
            });
            let mut angle = 0.0_f64;
            for pose in gone(path, &start_joints(&ends[0]), &actual) {
                let off = pose.translation.vector - Vector3::from(CENTRE);
                let here = off.y.atan2(off.x);
                angle = here + ((angle - here) / TAU).round() * TAU;
                let height = rise * angle / sweep;
                let off = (off.x.hypot(off.y) - RADIUS).hypot(off.z - height);
                assert!(off <= options.tolerance_mm + 1e-6, "{body}: {off}");
            }
            assert!((angle - sweep).abs() < 1e-3, "{body}: went {angle} of {sweep}");
        }
    }
}

/// The class: what the form of a statement leaves open is not in what is stated of its path. An arc that states its radius has
/// its centre at h = √(R² − c²/4) from its chord c: to four decimals h is known to √(2 R · 10⁻⁴) on a half circle, 0.11 mm at
/// 60 mm, and to about as many decimals as R on a quarter.
#[test]
fn an_arc_told_by_its_radius_leaves_its_centre_open_near_half_a_turn() {
    let head = "(truegrind angles wpr)\n(truegrind tool T0 t [[0,0,0],[1,0,0,0]])\n(truegrind frame G54 w [[0,0,0],[1,0,0,0]])\nG90 G17 G54\n";
    let known = known(&perturbed(12, 0.3));
    let planned = |body: &str, tolerance_mm: f64| {
        let source = format!("{head}G1 X440 Y0 Z320 A180 B0 C180 F3000\n{body}\n");
        let task = truegrind_programs::nc::Task::read(&[("p.ngc", source.as_bytes())], &nc_setup());
        let options = Options { tolerance_mm, ..Options::default() };
        let outcome = plan(&task.listing, &known, &Cell::default(), &options).outcomes.remove(1);
        (outcome.path_deviation_mm.get().unwrap(), outcome.reason())
    };
    let [(centre, _), (radius, wide)] =
        ["G2 X320 Y0 I-60 J0", "G2 X320 Y0 R60"].map(|body| planned(body, 1.0));
    let open = (2.0_f64 * 60.0 * 1e-4).sqrt();
    // The corrected points make it a little more or less than half a turn.
    let about = |mm: f64| (0.6 * open..1.001 * open).contains(&mm);
    assert!(about(radius - centre) && wide.is_none(), "{centre} {radius} {wide:?}");
    let (_, why) = planned("G2 X320 Y0 R60", centre + 0.5 * open);
    assert!(matches!(why, Some(OutcomeReason::AmbiguousCentre { mm }) if about(mm)), "{why:?}");
    let [(centre, _), (radius, _)] =
        ["G2 X380 Y-60 I-60 J0", "G2 X380 Y-60 R60"].map(|body| planned(body, 1.0));
    assert!((0.0..3e-4).contains(&(radius - centre)), "{centre} {radius}");
}

#[test]
fn an_arc_that_stays_says_its_word_again_after_one_that_became_straight() {
    let head = "(truegrind angles wpr)\n(truegrind tool T0 t [[0,0,0],[1,0,0,0]])\n(truegrind frame G54 w [[0,0,0],[1,0,0,0]])\nG90 G17 G54\n";
    let source = format!(
        "{head}G1 X440 Y0 Z320 A180 B0 C180 F3000\nN20 G03 X320 Y0 I-60 J0\n/N30 X440 I60\nN40 X320 I-60\nN50 G0 X300\n"
    );
    let setup = nc_setup();
    let task = truegrind_programs::nc::Task::read(&[("p.ngc", source.as_bytes())], &setup);
    // The block that may be skipped stays, and would keep the whole cut.
    let cuts = Cuts::Single;
    let options = Options { circles: Circles::Segments, tolerance_mm: 1.0, cuts, ..Options::default() };
    let planned = plan(&task.listing, &known(&perturbed(12, 1.0)), &Cell::default(), &options);
    assert!(planned.outcomes[1].inserted > 0 && planned.outcomes[2].inserted == 0);
    let rewritten = task.rewrite(&planned.changes, &RewriteOptions::default()).unwrap();
    let text = String::from_utf8(rewritten.files[0].edits.apply(source.as_bytes()).unwrap()).unwrap();
    assert!(text.contains("N20 G01 X") && text.contains("/N30 G3 X440"), "{text}");
    let again = truegrind_programs::nc::Task::read(&[("p.ngc", text.as_bytes())], &setup);
    let kinds: Vec<MotionKind> = again.listing.motions.iter().rev().take(3).map(|m| m.kind).collect();
    assert_eq!(kinds[1..], [MotionKind::Circular, MotionKind::Circular], "{text}");
}

fn motion_with(axis: Option<[f64; 3]>, over: Switch) -> truegrind_programs::motion::Motion {
    let source = module(&format!("  MoveC {},{},v50,z5,tool0;\n", on_circle(-90.0), on_circle(-20.0)));
    let task = Task::read(&[("p.mod", source.as_bytes())]);
    let mut motion = task.listing.motions[0].clone();
    motion.axis = axis.map(Box::new);
    motion.modal.circle_point_orientation = over;
    motion
}

#[test]
fn on_an_arc_the_tool_keeps_its_orientation_or_turns_with_the_path() {
    let at = |degrees: f64, turn: f64| {
        let (sin, cos) = degrees.to_radians().sin_cos();
        let rotation = UnitQuaternion::from_euler_angles(0.3, 0.0, 0.0);
        let turn = UnitQuaternion::from_axis_angle(&Vector3::z_axis(), turn.to_radians());
        Isometry3::from_parts(Vector3::new(50.0 * cos, 50.0 * sin, 7.0).into(), turn * rotation)
    };
    for sweep in [100.0, 170.0, 190.0, 300.0] {
        for (name, turn) in [("kept", 0.0), ("with the path", 1.0)] {
            let course = Curve::round(
                at(0.0, 0.0),
                &at(0.5 * sweep, 0.5 * sweep * turn),
                at(sweep, sweep * turn),
                &motion_with(None, Switch::Off),
            )
            .unwrap();
            for k in 0..=20 {
                let s = f64::from(k) / 20.0;
                let wanted = at(s * sweep, s * sweep * turn);
                let found = course.at(s);
                assert!((found.translation.vector - wanted.translation.vector).norm() < 1e-9);
                assert!(found.rotation.angle_to(&wanted.rotation) < 1e-9, "{name} {sweep} at {s}");
            }
            assert!((course.length_mm() - 50.0 * f64::to_radians(sweep)).abs() < 1e-9);
            assert!((course.turn_rad() - f64::to_radians(sweep * turn)).abs() < 1e-6);
        }
    }
    // With the circle point's own orientation the tool passes it.
    let course =
        Curve::round(at(0.0, 0.0), &at(45.0, 20.0), at(90.0, 0.0), &motion_with(None, Switch::On)).unwrap();
    assert!(course.at(0.5).rotation.angle_to(&at(45.0, 20.0).rotation) < 1e-9);
}

#[test]
fn helices_and_whole_circles_have_their_axis() {
    let axis = Unit::new_normalize(Vector3::new(0.2, -0.3, 1.0));
    let x = axis.cross(&Vector3::x()).normalize();
    let y = axis.cross(&x);
    let centre = Point3::new(300.0, 20.0, -5.0);
    for (sweep, rise) in [(1.0, 3.0), (4.0, -8.0), (TAU, 10.0), (TAU, 0.0)] {
        let at = |s: f64| {
            let (sin, cos) = (sweep * s).sin_cos();
            centre + (x * cos + y * sin) * 42.0 + axis.into_inner() * (rise * s)
        };
        let arc = Arc::through(&at(0.0), &at(0.5), &at(1.0), Some(&axis)).unwrap();
        assert!((arc.radius - 42.0).abs() < 1e-9 && (arc.sweep - sweep).abs() < 1e-9, "{arc:?}");
        for k in 0..=10 {
            let s = f64::from(k) / 10.0;
            assert!((arc.at(s) - at(s)).norm() < 1e-9);
            let out = (at(s) - centre - axis.into_inner() * (rise * s)).normalize();
            assert!((arc.distance(&(at(s) + out * 0.25), s) - 0.25).abs() < 1e-9);
        }
        assert!((arc.length_mm() - (42.0 * sweep).hypot(rise)).abs() < 1e-9);
    }
    assert!(Arc::through(&centre, &centre, &centre, Some(&axis)).is_none());
    let in_line = [0.0, 1.0, 2.0].map(|k| centre + x * k);
    assert!(Arc::through(&in_line[0], &in_line[1], &in_line[2], None).is_none());
}
