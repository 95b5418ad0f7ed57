//! Doubtful effects are in an arm with size 0: they correct nothing, and count in σ.

use nalgebra::{DMatrix, DVector};
use truegrind_arm::effect::Effect;
use truegrind_arm::effect::backlash::Backlash;
use truegrind_arm::effect::compliance::Compliance;
use truegrind_arm::effect::harmonic::Harmonic;
use truegrind_arm::parameter::arm_parameters;
use truegrind_compensation::cell::Cell;
use truegrind_compensation::risk::placement::Placement;
use truegrind_programs::rapid::Task;

use super::{Options, blade, estimated, perturbed, rewritten};

#[test]
fn what_is_in_doubt_changes_no_program_and_is_in_its_sigma() {
    let (source, joints) = blade();
    let plain = estimated(perturbed(5, 0.3), &joints);
    let mut doubted = plain.clone();
    doubted.model.effects = vec![
        Effect::JointCompliance(Compliance { joint: 1, compliance_rad_per_nm: 0.0 }),
        Effect::Backlash(Backlash { joint: 0, play_rad: 0.0 }),
        Effect::GearEccentricity(Harmonic { joint: 0, order: 1.0, sine_rad: 0.0, cosine_rad: 0.0 }),
    ];
    doubted.order = arm_parameters(&doubted.model);
    let (known, all) = (plain.order.len(), doubted.order.len());
    assert_eq!(all, known + 4);
    // A compliance of 1e-5 rad/(N m), and angles of 1e-3 rad.
    let variances = [plain.covariance.diagonal().as_slice(), &[1e-10, 1e-6, 1e-6, 1e-6]].concat();
    doubted.covariance = DMatrix::from_diagonal(&DVector::from_vec(variances));
    let task = Task::read(&[("p.mod", source.as_slice())]);
    // The σ decides nothing here.
    let loads = Some(task.loads());
    let options = Options { loads, placement: Placement::Absolute, max_risk: 1.0, ..Options::default() };
    let before = rewritten(&source, &plain, &Cell::default(), &options);
    let after = rewritten(&source, &doubted, &Cell::default(), &options);
    assert!(before.1 == after.1 && before.1 != source, "the corrected program is the same");
    let sigma = |plan: &super::Plan| plan.cuts.iter().map(|cut| cut.sigma_mm).fold(0.0, f64::max);
    assert!(sigma(&after.0) > 1.2 * sigma(&before.0), "{} {}", sigma(&after.0), sigma(&before.0));
    let said = |word: &str| after.0.notes.iter().any(|note| note.contains(word));
    assert!(
        said("not certain") && said("joint-compliance of joint 2") && !said("payload"),
        "{:?}",
        after.0.notes
    );
}
