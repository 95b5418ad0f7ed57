//! Which branch, and which full turn of it, follows a path.

use std::f64::consts::PI;

use truegrind_arm::condition::Condition;
use truegrind_arm::inverse::Inverse;
use truegrind_arm::robots;
use truegrind_planning::toolpath::toolpath;
use truegrind_surfaces::sample;

#[test]
fn the_wrist_is_not_wound_up_where_another_turn_of_it_does_the_same() {
    let nominal = robots::load("abb-irb-120").unwrap().model;
    let file = sample::BLADE.read().unwrap();
    let path = toolpath(&file, &nominal, "abb-irb-120").unwrap();
    let inverse = Inverse::new(&nominal, &Condition::default(), &nominal);
    // Another turn is there to be taken: joint 6 goes to 400° either way.
    let start = path.joints[0];
    let flange = inverse.arm().forward(&start);
    let all = inverse.all(&flange);
    let turned = all.iter().map(|s| s.joints - start);
    let turns = turned.filter(|moved| (0..5).all(|j| moved[j].abs() < 1e-6) && moved[5].abs() > 1.0);
    assert!(turns.count() > 0, "{start:?}");
    for joints in &path.joints {
        assert!(joints[3].abs() < PI && joints[5].abs() < PI, "{joints:?}");
    }
}
