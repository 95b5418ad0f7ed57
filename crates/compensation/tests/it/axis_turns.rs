//! Lines and arcs on which A, B and C run linearly, each on its own, where that is another way than one rotation about one axis. The class
//! of fault: such a path was checked as if the tool took the shortest rotation between its ends.

use nalgebra::Vector3;
use truegrind_arm::condition::Condition;
use truegrind_arm::inverse::Inverse;
use truegrind_arm::model::Joints;
use truegrind_compensation::cell::Cell;
use truegrind_compensation::options::Options;
use truegrind_compensation::plan::Plan;
use truegrind_compensation::plan::reason::OutcomeReason;
use truegrind_compensation::plan::solved_program::plan;
use truegrind_math::se3::Pose;
use truegrind_programs::nc::Task;
use truegrind_programs::nc::dialect::Dialect;
use truegrind_programs::nc::orientation::Angles;
use truegrind_programs::nc::setup::Setup;
use truegrind_programs::rewrite::RewriteOptions;

use super::{estimated, nominal, perturbed};

const HEAD: &str = "(truegrind angles wpr)\n(truegrind tool T0 t [[0,0,120],[1,0,0,0]])\n(truegrind frame G54 w [[400,0,420],[1,0,0,0]])\nG90 G21 G17 G94 G54\n";

/// Ends of a program, as words.
type Words = [f64; 6];

fn words(text: &str) -> Vec<Words> {
    let mut now = [0.0; 6];
    let mut out = Vec::new();
    for line in text.lines().filter(|line| line.contains("F800") || line.contains("G0")) {
        for (slot, letter) in "XYZABC".chars().enumerate() {
            if let Some(rest) = line.split(letter).nth(1) {
                now[slot] = rest.split(' ').next().unwrap().parse().unwrap();
            }
        }
        out.push(now);
    }
    out
}

fn at(from: &Words, to: &Words, share: f64) -> Pose {
    let mean = |axis: usize| from[axis] + share * (to[axis] - from[axis]);
    Pose::from_parts(
        Vector3::new(400.0 + mean(0), mean(1), 420.0 + mean(2)).into(),
        Angles::Wpr.rotation([mean(3), mean(4), mean(5)]),
    )
}

/// The tool of the actual arm between two commanded ends, if the words run linearly.
fn followed(commanded: [&Words; 2], actual: &truegrind_arm::model::Model, mut near: Joints) -> Vec<Pose> {
    let sheet = nominal();
    let inverse = Inverse::new(&sheet, &Condition::default(), &sheet);
    let reached = Inverse::new(actual, &Condition::default(), actual);
    let tool = Pose::translation(0.0, 0.0, 120.0);
    let tip = |k: u32| {
        let flange = at(commanded[0], commanded[1], f64::from(k) / 200.0) * tool.inverse();
        near = inverse.solve_near(&flange, &near).unwrap().joints;
        reached.arm().forward(&near) * tool
    };
    (0..=200).map(tip).collect()
}

/// Largest distance of tools from the intended line between two ends (mm).
fn off_line(intended: [&Words; 2], tips: &[Pose]) -> f64 {
    let [begin, end] = [0.0, 1.0].map(|s| at(intended[0], intended[1], s).translation.vector);
    let along = end - begin;
    let off = |tip: &Pose| {
        let off = tip.translation.vector - begin;
        match along.norm() {
            length if length > 1e-6 => off.cross(&along).norm() / length,
            _ => off.norm(),
        }
    };
    tips.iter().map(off).fold(0.0, f64::max)
}

/// Largest tilt of tools against the intended orientation between two ends (°), if the words run linearly.
fn tilt_deg(intended: [&Words; 2], tips: &[Pose]) -> f64 {
    let tilt = |(k, tip): (u32, &Pose)| {
        tip.rotation.angle_to(&at(intended[0], intended[1], f64::from(k) / 200.0).rotation).to_degrees()
    };
    (0..).zip(tips).map(tilt).fold(0.0, f64::max)
}

fn planned(body: &str, actual: &truegrind_arm::model::Model, dialect: Dialect) -> (Plan, String) {
    let source = format!("{HEAD}{body}");
    let setup = Setup { dialect: Some(dialect), ..Setup::default() };
    let task = Task::read(&[("p.ngc", source.as_bytes())], &setup);
    let mut known = estimated(actual.clone(), &[Joints::zeros()]);
    (known.region.min_deg, known.region.max_deg) = ([-400.0; 6], [400.0; 6]);
    known.region.spacing_deg = 1e6;
    let planned = plan(&task.listing, &known, &Cell::default(), &Options::default());
    let rewritten = task.rewrite(&planned.changes, &RewriteOptions::default()).unwrap();
    let text = rewritten.files[0].edits.apply(source.as_bytes()).unwrap();
    (planned, String::from_utf8(text).unwrap())
}

#[test]
fn the_stated_deviation_of_a_line_counts_words_that_run_linearly() {
    let actual = perturbed(5, 1.0);
    for body in [
        "G0 X-20 Y-40 Z-80 A190 B-20 C-60\nG1 Z-100 F800\nG1 X40 Y-30 A165 B-15 C0 F800\n",
        "G0 X-20 Y-40 Z-80 A190 B20 C-60\nG1 Z-100 F800\nG1 X10 Y-30 A165 B-15 C60 F800\n",
        // Once around: the shortest rotation is none.
        "G0 X-20 Y-40 Z-80 A180 B10 C0\nG1 Z-100 F800\nG1 X10 C360 F800\n",
        "G0 X-20 Y-40 Z-80 A180 B10 C180\nG1 Z-100 F800\nG1 Y10 C-180 F800\n",
    ] {
        let (planned, text) = planned(body, &actual, Dialect::LinuxCnc);
        let (intended, commanded) = (words(&format!("{HEAD}{body}")), words(&text));
        assert_eq!((intended.len(), commanded.len()), (3, 3), "{text}");
        let down = Joints::new(0.0, 0.2, 0.2, 0.0, 1.2, 0.0);
        let tips = followed([&commanded[1], &commanded[2]], &actual, down);
        let true_mm = off_line([&intended[1], &intended[2]], &tips);
        let outcome = &planned.outcomes[2];
        let stated = outcome.path_deviation_mm.get().unwrap();
        assert!(stated > true_mm - 0.01, "{body}: stated {stated}, true {true_mm}");
        assert!(stated < true_mm + 0.3, "{body}: stated {stated}, true {true_mm}");
        let flagged = matches!(outcome.reason(), Some(OutcomeReason::PathDeviation { .. }));
        assert_eq!(flagged, true_mm > 0.05, "{body}: {true_mm} {:?}", outcome.reason());
    }
}

#[test]
fn an_arc_counts_words_that_run_linearly_too() {
    let actual = perturbed(5, 1.0);
    let stated = |turn: &str| {
        let body = format!("G0 X-20 Y-40 Z-80 A180 B10 C0\nG1 Z-100 F800\nG3 X20 Y-40 I20 J0{turn}\n");
        planned(&body, &actual, Dialect::LinuxCnc).0.outcomes[2].path_deviation_mm.get().unwrap()
    };
    let (still, around) = (stated(""), stated(" C360"));
    assert!(around > still + 0.1, "{still} {around}");
}

/// Whole turns of which a quarter is whole too.
#[test]
fn four_turns_are_no_turn_about_one_axis() {
    for (turn, is_seen) in
        [("C1440", true), ("C3600", true), ("C0", false), ("C30", false), ("A179 C30", true)]
    {
        let source = format!("{HEAD}G1 X0 Y0 Z0 A180 B0 C0 F800\nX10 {turn}\n");
        let setup = Setup { dialect: Some(Dialect::LinuxCnc), ..Setup::default() };
        let listing = Task::read(&[("p.ngc", source.as_bytes())], &setup).listing;
        let motion = &listing.motions[1];
        assert_eq!((motion.axis_turn.is_some(), motion.insertable), (is_seen, !is_seen), "{turn}");
    }
}

/// A level tool: at B90 a turn of 0.1° about its axis took A and C 69° away, and back again in the next block.
#[test]
fn near_a_pole_the_words_stay_near_the_programmed_ones() {
    let actual = perturbed(5, 1.0);
    let body = "G0 X-40 Y0 Z0 A0 B80 C0\nG1 X0 B85 F800\nG1 Y30 B89 F800\nG1 Y60 B89.9 F800\nG1 Z30 B90 F800\nG1 X-20 F800\nG1 Y20 B40 F800\n";
    let (planned, text) = planned(body, &actual, Dialect::LinuxCnc);
    let (intended, commanded) = (words(&format!("{HEAD}{body}")), words(&text));
    assert_eq!((intended.len(), commanded.len()), (7, 7), "{text}");
    for (old, new) in intended.iter().zip(&commanded) {
        assert!((3..6).all(|word| (old[word] - new[word]).abs() < 3.0), "{text}");
    }
    let pairs = intended.windows(2).zip(commanded.windows(2));
    for (old, new) in pairs {
        let (before, after) = ([&old[0], &old[1]], [&new[0], &new[1]]);
        let level = Joints::new(0.0, 0.2, 0.2, 0.0, -0.4, 0.0);
        let tips = followed(after, &actual, level);
        let (was, is) = (tilt_deg(before, &followed(before, &actual, level)), tilt_deg(before, &tips));
        assert!(is < was, "{before:?}: {was}° before, {is}° after");
        let off_mm = off_line(before, &tips);
        assert!(off_mm < 0.06, "{off_mm} mm\n{text}");
    }
    let targets = planned.outcomes.iter().map(|outcome| outcome.after_mm.get().unwrap());
    assert!(targets.into_iter().all(|mm| mm < 0.002));
    assert!(
        planned.notes.iter().any(|note| note.contains("near a pole of A, B and C")),
        "{:?}",
        planned.notes
    );
}
