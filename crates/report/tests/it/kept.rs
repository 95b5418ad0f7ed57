//! What jobs of a shared run keep comes back with every bit: else what is put together later is not what one run writes.

use nalgebra::{Quaternion, Translation3, UnitQuaternion, Vector3, Vector6};
use proptest::prelude::*;
use serde_json::json;
use truegrind_arm::region::Outside;
use truegrind_compensation::deviation::{
    After, BetweenTargets, Deviation, MissingMotion, MissingMotions, MotionStatus, PathPoint, PathReport,
};
use truegrind_math::se3::Pose;
use truegrind_programs::motion::MotionKind;
use truegrind_report::batch::{self, Ended, Row};
use truegrind_report::deviation::{from_kept, kept};
use truegrind_report::kept::{Packed, unpacked};
use truegrind_report::placement::Placed;

/// Any finite number, with all its bits.
fn number() -> impl Strategy<Value = f64> {
    any::<u64>().prop_map(f64::from_bits).prop_filter("finite", |value| value.is_finite())
}

fn pose() -> impl Strategy<Value = Pose> {
    prop::array::uniform7(number()).prop_map(|[x, y, z, w, i, j, k]| {
        let turn = UnitQuaternion::new_unchecked(Quaternion::new(w, i, j, k));
        Pose::from_parts(Translation3::new(x, y, z), turn)
    })
}

fn side() -> impl Strategy<Value = Option<Deviation>> {
    prop::option::of((prop::array::uniform4(number()), prop::option::of(number())).prop_map(
        |([x, y, z, angle_rad], normal_mm)| Deviation {
            vector_mm: Vector3::new(x, y, z),
            angle_rad,
            normal_mm,
        },
    ))
}

fn outside() -> impl Strategy<Value = Option<Outside>> {
    prop_oneof![
        Just(None),
        (0..6_usize, number()).prop_map(|(joint, by_deg)| Some(Outside::Joint { joint, by_deg })),
        number().prop_map(|ratio| Some(Outside::Coverage { ratio })),
    ]
}

prop_compose! {
    fn point()(
        poses in prop::array::uniform4(pose()),
        normal in prop::option::of(prop::array::uniform3(number())),
        joints in prop::array::uniform2(prop::option::of(prop::array::uniform6(number()))),
        (before, after, outside) in (side(), side(), outside()),
        sigmas in prop::array::uniform2(prop::option::of(number())),
        (index, line, part, cutting, kind) in (any::<u32>(), any::<u32>(), any::<u32>(), any::<bool>(), 0..6_usize),
        (instruction, reason) in (".*", prop::option::of(".*")),
        status in prop::sample::select(vec![MotionStatus::Changed, MotionStatus::Left, MotionStatus::Refused, MotionStatus::Flagged]),
    ) -> PathPoint {
        let kinds = [
            MotionKind::Linear, MotionKind::Joint, MotionKind::Circular, MotionKind::AbsoluteJoint, MotionKind::External,
            MotionKind::Unknown,
        ];
        PathPoint {
            index: index as usize,
            file: 1,
            line,
            instruction,
            kind: kinds[kind],
            cutting,
            base_from_object: poses[0],
            part,
            part_from_object: poses[3],
            flange_from_tool: poses[1],
            intended: poses[2],
            normal: normal.map(Vector3::from),
            joints_before: joints[0].map(Vector6::from),
            joints_after: joints[1].map(Vector6::from),
            before,
            after,
            sigma_mm: sigmas[0],
            shape_sigma_mm: sigmas[1],
            outside,
            status,
            reason,
        }
    }
}

fn between() -> impl Strategy<Value = BetweenTargets> {
    let lines = || prop::option::of(Just("lines 3, 7".to_owned()));
    (number(), prop::option::of(number()), (0..9_usize, lines()), (0..9_usize, lines()), lines()).prop_map(
        |(tolerance_mm, largest_mm, (beyond, beyond_lines), (unchecked, unchecked_lines), first_lines)| {
            BetweenTargets {
                tolerance_mm,
                largest_mm,
                beyond,
                beyond_lines,
                unchecked,
                unchecked_lines,
                first_lines,
            }
        },
    )
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(64))]

    #[test]
    fn a_path_comes_back_with_every_bit(
        mut points in prop::collection::vec(point(), 0..5),
        repeated in any::<bool>(),
        held_out_mm in prop::option::of(number()),
        achieved in any::<bool>(),
        between in prop::option::of(between()),
    ) {
        // Poses of tool and work object that follow each other are stated once.
        if let ([first, rest @ ..], true) = (points.as_mut_slice(), repeated) {
            rest.iter_mut().for_each(|point| point.base_from_object = first.base_from_object);
        }
        let after = if achieved { After::Achieved } else { After::PredictedRemainder };
        let left = MissingMotion {
            points_before: 2,
            file: 1,
            line: 3,
            instruction: "MoveL".into(),
            status: MotionStatus::Left,
            reason: Some("out of reach".into()),
        };
        let missing = Some(MissingMotions { motions: vec![left], lines: "line 3".into() });
        let report = PathReport { program: "a.mod".into(), files: vec!["b.mod".into()], model: "arm".into(), after, points, missing, differences: vec!["line 3: MoveJ".into()], between, held_out_mm, turn_sigma_rad: held_out_mm, assumptions: vec!["a tool without a turn".into()] };
        let text = serde_json::to_string(&kept(&report)).unwrap();
        let back = from_kept(&serde_json::from_str(&text).unwrap()).unwrap();
        // Signs of zeros too, which == does not tell.
        prop_assert_eq!(format!("{report:?}"), format!("{back:?}"));
    }

    #[test]
    fn a_row_and_a_contract_come_back_with_every_bit(
        numbers in prop::array::uniform3(prop::option::of(number())),
        (value, text) in (number(), "[#']?.*"),
    ) {
        let row = Row {
            file: text.clone(),
            output: None,
            ended: Ended::Failed,
            motions: [1, 2, 3, 4, usize::MAX],
            opaque: 7,
            before_mm: numbers[0],
            after_mm: numbers[1],
            expected_mm: numbers[2],
            note: Some(text.clone()),
            doubt: Some(text.clone()),
            reason: None,
            shape_only: true,
            placed: vec![Placed { name: text.clone(), frame: text.clone(), shape_only: true }],
            routines: [vec![text.clone()], vec![text.clone(), text.clone()]],
        };
        let back: Row = serde_json::from_str(&serde_json::to_string(&row).unwrap()).unwrap();
        prop_assert_eq!(format!("{row:?}"), format!("{back:?}"));
        let contract = json!({ "a": [value, text, null, true, 12, -3, u64::MAX], "b": { "c": value } });
        let kept = serde_json::to_string(&Packed(&contract)).unwrap();
        let back = unpacked(serde_json::from_str(&kept).unwrap());
        prop_assert_eq!(contract.to_string(), back.to_string());
    }
}

#[test]
fn what_is_no_path_is_none() {
    for text in
        ["null", "{}", r#"{"program":"a","model":"b","achieved":false,"held_out_mm":null,"points":[[]]}"#]
    {
        assert!(from_kept(&serde_json::from_str(text).unwrap()).is_none(), "{text}");
    }
}

/// Two programs of one workpiece, of which one kept its placement: each may run, both together do not fit.
#[test]
fn programs_of_one_work_object_that_are_placed_differently_are_told() {
    let row = |file: &str, name: &str, frame: &str, shape_only: bool| Row {
        motions: [8, 6, 0, 0, 2],
        before_mm: Some(0.5),
        shape_only,
        placed: vec![Placed { name: name.to_owned(), frame: frame.to_owned(), shape_only }],
        ..Row::without(file.to_owned(), Ended::Changed, None)
    };
    let told = |rows: &[Row]| {
        assert_eq!(
            batch::shifts_apart(rows),
            !truegrind_report::format::terminal::document(&batch::summary(rows), 200).contains("may run")
        );
        batch::shifts_apart(rows)
    };
    let moved = row("parts/p3.mod", "wA", "here", false);
    assert!(told(&[moved.clone(), row("parts/p4.mod", "wA", "here", true)]));
    assert!(!told(&[moved.clone(), row("parts/p4.mod", "wA", "here", false)]));
    assert!(!told(&[moved.clone(), row("parts/p4.mod", "wB", "here", true)]));
    assert!(!told(&[moved, row("parts/p4.mod", "wA", "elsewhere", true)]));
}

/// A routine under the displacement of a caller in another program of the run was corrected as if there were none.
#[test]
fn a_program_that_another_of_the_run_calls_may_not_run_unchecked() {
    let row = |file: &str, declares: &[&str], calls: &[&str]| Row {
        motions: [8, 8, 0, 0, 0],
        routines: [declares, calls].map(|names| names.iter().map(|name| (*name).to_owned()).collect()),
        ..Row::without(file.to_owned(), Ended::Changed, None)
    };
    let mut rows =
        vec![row("in/face.mod", &["facep"], &[]), row("in/mainm.mod", &["main"], &["facep", "grip"])];
    assert!(batch::doubt_called(&mut rows));
    let text = truegrind_report::format::terminal::document(&batch::summary(&rows), 300);
    assert!(
        text.contains("mainm.mod calls facep") && text.contains("1 of 2 is corrected and may run"),
        "{text}"
    );
    let mut apart =
        vec![row("in/face.mod", &["facep"], &["facep"]), row("in/mainm.mod", &["main"], &["grip"])];
    assert!(!batch::doubt_called(&mut apart));
}
