//! A new module reads back as the draft that it was written from.

use truegrind_math::option_f64::OptionF64;
use truegrind_programs::draft::{Draft, Step};
use truegrind_programs::motion::{
    Frame, JointTarget, MotionKind, RobTarget, TargetValue, ToolValue, WorkObjectValue,
};
use truegrind_programs::rapid::Task;
use truegrind_programs::rapid::writer::{WriteError, write};

fn pose(x: f64) -> RobTarget {
    RobTarget {
        position_mm: [x, -0.25, 120.0625],
        quaternion: [0.0, 0.6, 0.8, 0.0],
        conf: [0, -1, 1, 0],
        external: [None, Some(12.5), None, None, None, None].map(OptionF64::from),
    }
}

fn draft(named_targets: bool) -> Draft {
    let frame = |x: f64| Frame { position_mm: [x, 2.5, -3.125], quaternion: [0.6, 0.0, 0.8, 0.0] };
    let step = |kind, to, via, speed_mm_s, zone_mm| Step {
        kind,
        to,
        via,
        speed_mm_s,
        zone_mm,
        comment: None,
        wait_s: None,
    };
    let joints =
        JointTarget { robot_deg: [0.0, -30.0, 30.5, 0.0, 90.0, 180.25], external: [OptionF64::NONE; 6] };
    let cartesian = |x| TargetValue::Cartesian(pose(x));
    let mut steps = vec![
        step(MotionKind::AbsoluteJoint, TargetValue::Joint(joints), None, 200.0, None),
        step(MotionKind::Joint, cartesian(10.0), None, 200.0, Some(10.0)),
        step(MotionKind::Linear, cartesian(20.0), None, 12.5, Some(0.3)),
        step(MotionKind::Circular, cartesian(40.0), Some(pose(30.0)), 12.5, Some(2.0)),
        step(MotionKind::Linear, cartesian(50.0), None, 12.5, None),
    ];
    steps[1].comment = Some("to the part".into());
    Draft {
        name: "Path".into(),
        comments: vec!["grinding path ü\nof two lines".into()],
        tool: (
            "tWheel".into(),
            ToolValue {
                robhold: true,
                frame: frame(1.0),
                mass_kg: 2.5,
                centre_of_gravity_mm: [1.0, 2.0, 30.5],
            },
        ),
        work_object: (
            "wPart".into(),
            WorkObjectValue {
                robhold: false,
                fixed: true,
                mechanical_unit: String::new(),
                user_frame: frame(7.0),
                object_frame: frame(8.0),
            },
        ),
        named_targets,
        start_deg: None,
        monitor_configuration: true,
        steps,
    }
}

#[test]
fn a_written_module_reads_back_equal() {
    for named in [false, true] {
        let draft = draft(named);
        let text = write(&draft).unwrap();
        let task = Task::read(&[("path.mod", &text)]);
        let listing = &task.listing;
        let shown = String::from_utf8_lossy(&text);
        assert!(listing.opaque.is_empty(), "{shown}");
        assert_eq!(listing.motions.len(), draft.steps.len());
        assert_eq!(listing.declarations.len(), if named { 6 } else { 0 });
        for (motion, step) in listing.motions.iter().zip(&draft.steps) {
            assert_eq!(motion.kind, step.kind);
            assert_eq!(motion.reason(), None, "{shown}");
            assert_eq!(motion.to().unwrap().value, Ok(step.to));
            if let Some(via) = step.via {
                assert_eq!(motion.targets[0].value, Ok(TargetValue::Cartesian(via)));
            }
            assert_eq!(listing.speed(motion).unwrap().value.unwrap().tcp_mm_s, step.speed_mm_s);
            let zone = listing.zone(motion).unwrap().value.unwrap();
            assert_eq!((!zone.fine).then_some(zone.tcp_mm), step.zone_mm);
            let tool = listing.tool(motion).unwrap();
            assert_eq!((&tool.name, tool.value), (&draft.tool.0, Ok(draft.tool.1)));
            let work_object = listing.work_object(motion).unwrap();
            assert_eq!(work_object.value.as_ref(), Ok(&draft.work_object.1));
        }
        for text in
            ["  ! of two lines\n", "    ! to the part\n    MoveJ ", ",v200,z10,tWheel\\WObj:=wPart;", "vPath"]
        {
            assert!(shown.contains(text), "{text}: {shown}");
        }
        assert!(text.windows(6).any(|six| six == b"ath \xFC\n"));
    }
}

#[test]
fn drafts_that_rapid_does_not_allow_are_refused() {
    for name in ["", "1st", "MODULE", "a b", "aName_ThatIsLongerThan_32_Characters"] {
        let draft = Draft { name: name.into(), ..draft(false) };
        assert_eq!(write(&draft), Err(WriteError::Name { name: name.into() }));
    }
    let mut bad = draft(false);
    bad.steps[3].via = None;
    assert!(matches!(write(&bad), Err(WriteError::Step { step: 3, .. })));
    let mut bad = draft(false);
    bad.steps[2].speed_mm_s = f64::NAN;
    assert_eq!(write(&bad), Err(WriteError::NotFinite { step: 2 }));
}
