//! Whole turns of a joint beside the measured region.

use truegrind_arm::effect::Effect;
use truegrind_arm::effect::gear_ratio::GearRatio;
use truegrind_arm::estimated::Estimated;
use truegrind_arm::model::Joints;
use truegrind_arm::region::{NearestSample, Outside};
use truegrind_compensation::feasibility::measured_turns::outside_along;

fn outside(arm: &Estimated, q: &Joints) -> Option<Outside> {
    outside_along(arm, q, &mut NearestSample::default())
}

/// A joint that was measured over a whole turn stands alike after another one: each motion with axis 6 at 300° was flagged as not measured.
#[test]
fn a_whole_turn_leads_out_of_no_measured_region() {
    let at =
        |q6_deg: f64, q1_deg: f64| Joints::new(q1_deg.to_radians(), 0.2, -0.3, 0.1, 0.8, q6_deg.to_radians());
    let measured: Vec<Joints> =
        (-17..=17).flat_map(|k| [-2.0, 0.0, 2.0].map(|q1| at(10.0 * f64::from(k), q1))).collect();
    let mut arm = super::estimated(super::perturbed(5, 1.0), &measured);
    for q6 in [-370.0, -300.0, 100.0, 250.0, 300.0, 390.0] {
        assert_eq!(outside(&arm, &at(q6, 0.0)), None, "{q6}");
    }
    for q6 in [-175.0, 185.0, 540.0] {
        assert!(outside(&arm, &at(q6, 0.0)).is_some(), "{q6}");
    }
    assert!(outside(&arm, &at(300.0, 40.0)).is_some());
    // What is off by a share of the angle is so over turns.
    arm.model.effects.push(Effect::GearRatio(GearRatio { joint: 5, error: 1e-5 }));
    assert!(outside(&arm, &at(300.0, 0.0)).is_some() && outside(&arm, &at(100.0, 0.0)).is_none());
}
