//! What a search costs is bounded by a count, and what lies surely out of reach is told without one.
//!
//! The class: input decides how much work is done for it, and nobody counts. A target that is reached costs a few evaluations
//! of the arm, one that is not thousands, so that some hundred kilobytes of such targets kept the machine busy for minutes.

use rayon::prelude::*;
use truegrind_arm::condition::Condition;
use truegrind_arm::inverse::budget::{SearchBudget, with_budget};
use truegrind_arm::inverse::configuration::Configuration;
use truegrind_arm::inverse::{Inverse, InverseError};
use truegrind_arm::model::Joints;

use super::arms::{SHEETS, Sheet, generator, joints_within, perturbed, with_effects};

/// What an arm stands at is never told to be out of its reach, stretched and folded arms among it, however the estimated
/// arm differs from the one whose closed form is asked.
#[test]
fn a_reachable_target_is_never_called_unreachable() {
    SHEETS.par_iter().for_each(|sheet| {
        let nominal = sheet.model();
        let mut random = generator(77);
        for round in 0..12 {
            let (mm, deg) = [(0.3, 0.05), (3.0, 0.5)][round % 2];
            let actual = perturbed(&nominal, &mut random, mm, deg);
            let actual = if round % 3 == 0 { with_effects(&actual, &mut random) } else { actual };
            let condition = Condition { time_h: Some(2.0), payload_kg: Some(2.0), ..Condition::default() };
            let inverse = Inverse::new(&actual, &condition, &nominal);
            for step in 0..25 {
                let mut joints = joints_within(&nominal, &mut random);
                // About the stretched elbow, where the border of what is reached lies.
                if step % 2 == 0 {
                    joints[2] = (f64::from(step) - 12.0) * 2e-3;
                }
                let target = actual.forward(&joints, &condition);
                let all = inverse.solve_near(&target, &Joints::zeros());
                assert!(
                    !matches!(all, Err(InverseError::Unreachable { .. })),
                    "{} {round} {step}: {all:?}",
                    sheet.name
                );
            }
        }
    });
}

/// What lies farther than that costs no evaluation at all.
#[test]
fn a_target_surely_out_of_reach_is_refused_without_a_search() {
    let nominal = Sheet::named("abb-irb-120");
    let actual = perturbed(&nominal, &mut generator(3), 0.3, 0.05);
    let still = Condition::default();
    let inverse = Inverse::new(&actual, &still, &nominal);
    let mut target = actual.forward(&Joints::from([0.2, 0.3, -0.4, 0.3, 0.5, 0.1]), &still);
    target.translation.vector *= 1.6;
    let mut budget = SearchBudget::of(1_000_000);
    let wanted = Configuration { cf1: 0, cf4: 0, cf6: 0, cfx: 0 };
    with_budget(&mut budget, || {
        for _ in 0..100 {
            let found = inverse.solve_configured(&target, &wanted, None);
            assert!(matches!(found, Err(InverseError::Unreachable { .. })), "{found:?}");
        }
    });
    assert_eq!((budget.evaluations, budget.ever_exhausted), (1_000_000, false));
}

/// A search ends with its budget, says so, and neither it nor what comes after it is charged to anybody else.
#[test]
fn a_search_ends_with_its_budget_and_reports_it() {
    let nominal = Sheet::named("abb-irb-120");
    let still = Condition::default();
    let inverse = Inverse::new(&nominal, &still, &nominal);
    // Straight at the border: a wrist in line, and quarters that no solution has.
    let target = nominal.forward(&Joints::from([0.2, 0.3, -0.4, 0.3, 1e-4, 0.1]), &still);
    let wrong = Configuration { cf1: 2, cf4: -2, cf6: 1, cfx: 5 };
    let free = inverse.solve_configured(&target, &wrong, None);
    let mut budget = SearchBudget::of(20_000);
    let found: Vec<_> = with_budget(&mut budget, || {
        (0..200).map(|_| inverse.solve_configured(&target, &wrong, None)).collect()
    });
    assert_eq!(found[0], free);
    assert_eq!(found[199], Err(InverseError::Abandoned));
    let ended = found.iter().position(|one| *one == Err(InverseError::Abandoned)).unwrap();
    assert!(found[..ended].iter().all(|one| *one == free), "{found:?}");
    assert_eq!((budget.evaluations, budget.exhausted, budget.ever_exhausted), (0, true, true));
    // Once more, by nobody's budget.
    assert_eq!(inverse.solve_configured(&target, &wrong, None), free);
    // What needs no search is not refused.
    let reached = Joints::from([0.2, 0.3, -0.4, 0.3, 0.5, 0.1]);
    let easy = nominal.forward(&reached, &still);
    with_budget(&mut budget, || assert!(inverse.solve_near(&easy, &reached).is_ok()));
    assert!(!budget.exhausted && budget.ever_exhausted);
}

#[test]
fn the_shares_of_a_budget_add_up_to_the_whole() {
    for count in [1, 3, 7, 64, 1000] {
        let whole = SearchBudget::of(12_345).with_near_solves(678);
        let parts = (0..count).map(|index| whole.share(index, count));
        let sums = parts.fold((0, 0), |(a, b), part| (a + part.evaluations, b + part.near_solves));
        assert_eq!(sums, (12_345, 678));
    }
    assert_eq!(SearchBudget::of(5).share(0, 3).near_solves, u64::MAX);
}
