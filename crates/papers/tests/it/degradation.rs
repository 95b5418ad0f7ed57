//! An arm that degrades: RLS is least squares, and what it wins over LM has other names.

use truegrind_papers::degradation::{Degradation, Strategy, run};
use truegrind_papers::experiment::{Experiment, Kind};

use super::experiment::nominal;

fn small() -> Degradation {
    let all = Experiment::shipped().unwrap();
    let experiment = all.iter().find(|e| e.name == "rls-degradation").unwrap();
    let Some(Kind::Degradation(settings)) = experiment.kind() else { panic!("a degradation experiment") };
    Degradation { arms: 2, groups: 3, counts: vec![4, 5, 15], ..settings.clone() }
}

#[test]
fn rls_and_lm_with_the_same_memory_agree_and_memory_is_what_helps_few_poses() {
    let settings = small();
    let result = run(&settings, "test", "tx60-pose", 3, nominal).unwrap();
    // The arm degrades, and neglect undoes the first calibration.
    assert!(result.nominal_mm[0] > 0.3 && result.nominal_mm[0] < 1.2, "{:?}", result.nominal_mm);
    assert!(result.neglected_mm[2] > 2.0 * result.neglected_mm[0], "{:?}", result.neglected_mm);
    let after = |strategy: Strategy, count: usize| {
        let run = result.runs.iter().find(|j| j.strategy == strategy && j.count == count).unwrap();
        run.mean(|s| s.verification_after_mm)
    };
    for count in [15, 20, 50] {
        let (rls, memory) = (after(Strategy::Rls, count), after(Strategy::LmMemory, count));
        assert!((rls - memory).abs() < 0.02 * rls, "{count} poses: {rls} {memory}");
        assert!(rls < 0.5 * result.nominal_mm[0]);
    }
    // Forgetting follows an arm that changes better than remembering everything.
    let last = |strategy: Strategy| {
        let run = result.runs.iter().find(|j| j.strategy == strategy && j.count == 50).unwrap();
        run.steps.last().unwrap().verification_after_mm
    };
    assert!(last(Strategy::RlsForgetting) < last(Strategy::Rls));
}

#[test]
fn all_figures_of_the_paper_are_shown_and_every_table_says_that_it_is_simulated() {
    use truegrind_papers::Results;
    use truegrind_papers::views as view;
    use truegrind_report::format;
    let settings = Degradation { arms: 6, groups: 2, counts: vec![4, 15, 50], ..small() };
    let result = run(&settings, "test", "tx60-pose", 3, nominal).unwrap();
    // Two strategies with the same memory are the same, and with six arms nothing small is called a difference.
    let memory =
        result.against_rls.iter().find(|a| a.strategy == Strategy::LmMemory && a.count == 50).unwrap();
    assert_eq!(memory.outcome, truegrind_papers::degradation::Outcome::Same);
    assert!(result.against_rls.iter().all(|a| a.arms == 6 && (0.0..=1.0).contains(&a.p)));
    let experiment = Experiment::by_name("rls-degradation").unwrap();
    let results = Results::Degradation(Box::new(result));
    let page =
        view::document(&experiment, &results, &view::Origin { timings: true, ..view::Origin::default() });
    let html = format::html::document(&page);
    for figure in [
        "Fig. 4", "Fig. 7", "Fig. 9", "Fig. 10", "Fig. 11", "Fig. 12", "Fig. 13", "Fig. 14", "Table 2",
        "Table 4",
    ] {
        assert!(html.contains(figure), "{figure} is not shown");
    }
    let text = format::markdown::document(&page);
    let tables = text.matches("simulated degradation").count();
    assert!(tables >= 6, "{tables} tables and figures say so");
}

#[test]
fn few_poses_are_stated_with_rank_and_condition() {
    let result = run(&small(), "test", "tx60-pose", 3, nominal).unwrap();
    let [four, five, fifteen] = result.counts.as_slice() else { panic!("three counts") };
    assert_eq!((four.equations, five.equations), (24, 30));
    assert!(four.rank <= 24 && fifteen.rank == 24);
    assert!(four.condition > fifteen.condition);
    // Few poses are overfitted.
    assert!(four.identification_mm < four.verification_mm);
    assert!(fifteen.verification_mm < four.verification_mm);
}

#[test]
fn what_cannot_be_used_is_said() {
    let text = include_str!("../../../../experiments/rls-degradation.toml");
    for (from, to, word) in [
        ("continuous = [15, 20]", "continuous = [60]", "at most degradation.identification"),
        ("forgetting = 0.95", "forgetting = 1.5", "up to 1"),
        ("arms = 10", "arms = 0", "1 of each"),
    ] {
        let message = Experiment::parse(&text.replace(from, to), "mine.toml").unwrap_err().to_string();
        assert!(message.contains(word), "{message}");
    }
}
