//! Play that a load closes, and zeros of joints that move: what is told of either, and what of both.

use truegrind_arm::effect::Effect;
use truegrind_arm::effect::loaded_backlash::LoadedBacklash;
use truegrind_calibration::diagnosis::diagnose::Diagnosed;
use truegrind_calibration::diagnosis::finding::Confidence;
use truegrind_calibration::measurement::dataset::Sensor;

use super::certain::{arm, diagnosed, identified, setup};
use super::simulator::{Hidden, run};

/// Play that gravity closes follows the sign of the torque, not the side of approach.
#[test]
fn play_that_its_load_closes_is_told_and_written() {
    let hidden = [Hidden::LoadedPlay { joint: 2, play_rad: 0.0015, closed_nm: 0.05, friction_nm: 0.0 }];
    let found = diagnosed(&run(&arm(), &hidden, &setup(Sensor::Position, 400, 81)).dataset);
    let play = found.diagnosis.findings.iter().find(|f| f.effect == "backlash").unwrap();
    assert_eq!((play.joints.as_deref(), play.confidence), (Some(&[3][..]), Confidence::Identified));
    assert!(play.cause.contains("of backlash that gravity closes"), "{}", play.cause);
    let size = &play.parameters[0];
    assert!((size.value - 0.0015).abs() < 4e-4, "{size:?}");
    assert!(play.remedy.contains("gear mesh"), "{}", play.remedy);
    assert_eq!(play.corrected, Some(true));
    let written = loaded_backlash(&found);
    assert!((written.play_rad - 0.0015).abs() < 4e-4, "{written:?}");
    let backlash = |effect: &Effect| matches!(effect, Effect::Backlash(_));
    assert!(!found.estimated.model.effects.iter().any(backlash));
}

fn loaded_backlash(found: &Diagnosed) -> LoadedBacklash {
    let of_joint = |effect: &Effect| match effect {
        Effect::LoadedBacklash(play) if play.joint == 2 => Some(play.clone()),
        _ => None,
    };
    found.estimated.model.effects.iter().find_map(of_joint).expect("a play that a load closes")
}

/// Below the friction the side of approach decides: the play has its size, and the friction its share of the largest torque.
#[test]
fn friction_holds_a_play_that_its_load_would_close() {
    for share in [0.15, 0.3] {
        // The forearm of 3 kg reaches 0.3 m: some 5 N m where it is level.
        let hidden =
            [Hidden::LoadedPlay { joint: 2, play_rad: 0.0012, closed_nm: 0.02, friction_nm: share * 5.0 }];
        let found = diagnosed(&run(&arm(), &hidden, &setup(Sensor::Position, 600, 85)).dataset);
        let play = &identified(&found)[0];
        assert_eq!((play.effect.as_str(), play.joints.as_deref()), ("backlash", Some(&[3][..])));
        assert!(play.cause.contains("friction holds it"), "{}", play.cause);
        let written = loaded_backlash(&found);
        assert!((written.play_rad - 0.0012).abs() < 1e-4, "{written:?}");
        let largest_nm = written.closing_nm / 0.02;
        assert!((written.friction_nm / largest_nm - share).abs() < 0.05, "{written:?}");
    }
}

/// The same, closed by half a newton metre, is a spring that stiffens: neither a gear nor a flank.
#[test]
fn a_spring_that_stiffens_is_no_play() {
    let hidden = [Hidden::LoadedPlay { joint: 2, play_rad: 0.0015, closed_nm: 0.5, friction_nm: 0.0 }];
    let found = diagnosed(&run(&arm(), &hidden, &setup(Sensor::Position, 400, 83)).dataset);
    let spring = &identified(&found)[0];
    assert_eq!((spring.effect.as_str(), spring.joints.as_deref()), ("joint-stiffness", Some(&[3][..])));
    assert!(spring.cause.contains("stiffens under its load"), "{}", spring.cause);
    // It is an effect of the written arm: programs are corrected for it.
    assert_eq!(spring.corrected, Some(true));
    let written = &found.estimated.model.effects;
    assert!(written.iter().any(|effect| matches!(effect, Effect::JointStiffness(_)) && !effect.is_zero()));
}

/// A joint that lost counts stands off by one angle in all rows before. The written arm is the arm as it is: that of the rows after.
#[test]
fn a_joint_that_lost_counts_is_told_with_its_angle() {
    let hidden = [Hidden::LostCounts { joint: 2, until: 149, rad: 8e-4 }];
    let found = diagnosed(&run(&arm(), &hidden, &setup(Sensor::Position, 400, 84)).dataset);
    let lost = &identified(&found)[0];
    assert_eq!((lost.effect.as_str(), lost.joints.as_deref()), ("joint-zero-shift", Some(&[3][..])));
    assert_eq!(lost.rows, Some([0, 149]));
    let offset = &lost.parameters[0];
    assert!((offset.value - 8e-4).abs() < 4.0 * offset.sigma.unwrap() + 1e-5, "{offset:?}");
}

/// Counts that are lost do not come back: a play that changes its flank twice looks like a zero that moved in some rows.
#[test]
fn a_zero_that_moves_and_comes_back_is_not_certain() {
    let until = |until, rad| Hidden::LostCounts { joint: 2, until, rad };
    let hidden = [until(219, 8e-4), until(149, -8e-4)];
    let found = diagnosed(&run(&arm(), &hidden, &setup(Sensor::Position, 400, 84)).dataset);
    let moved = found.diagnosis.findings.iter().find(|f| f.effect == "joint-zero-shift").unwrap();
    assert_eq!((moved.rows, moved.confidence), (Some([150, 219]), Confidence::Ambiguous));
    assert!(moved.doubts.iter().any(|doubt| doubt.contains("came back")), "{:?}", moved.doubts);
    // From one level to a second and on to a third it is lost twice.
    let twice = [until(219, 8e-4), until(149, 6e-4)];
    let found = diagnosed(&run(&arm(), &twice, &setup(Sensor::Position, 400, 84)).dataset);
    let lost: Vec<_> = identified(&found).into_iter().filter(|f| f.effect == "joint-zero-shift").collect();
    assert!(!lost.is_empty(), "{:?}", found.diagnosis.findings);
}
