//! Swarms on published problems of few parameters, their budgets and their weaknesses.

use truegrind_estimation::estimate::{Estimate, Termination};
use truegrind_estimation::problem::{Prior, Problem};
use truegrind_estimation::swarm::{Region, bas, de, pso, qibas, sca};

use super::published;
use super::residuals::{Dual, Rows, rows};

type Solve = fn(&dyn Problem, &[f64], bool, u64) -> Estimate;

fn wide_region() -> Region {
    Region { reach: 3.0, unknown_reach: 4.0 }
}

/// Every method with the same call: problem, start, whether as printed, seed.
fn methods() -> [(&'static str, Solve); 5] {
    [
        ("pso", |p, x, printed, seed| {
            let options = if printed { pso::Options::as_printed() } else { pso::Options::default() };
            pso::solve(p, x, &pso::Options { seed, region: wide_region(), ..options })
        }),
        ("de", |p, x, printed, seed| {
            let options = if printed { de::Options::as_printed() } else { de::Options::default() };
            de::solve(p, x, &de::Options { seed, region: wide_region(), ..options })
        }),
        ("sca", |p, x, printed, seed| {
            let options = if printed { sca::Options::as_printed() } else { sca::Options::default() };
            sca::solve(p, x, &sca::Options { seed, region: wide_region(), ..options })
        }),
        ("bas", |p, x, printed, seed| {
            let options = if printed { bas::Options::as_printed() } else { bas::Options::default() };
            bas::solve(p, x, &bas::Options { seed, region: wide_region(), ..options })
        }),
        ("qibas", |p, x, printed, seed| {
            let options = if printed { bas::Options::as_printed() } else { bas::Options::default() };
            qibas::solve(p, x, &qibas::Options { seed, region: wide_region(), ..options })
        }),
    ]
}

/// Σ r² that a method must fall below on Rosenbrock, Beale and Bard, as printed and sound.
fn asked(name: &str) -> [[f64; 3]; 2] {
    match name {
        "pso" | "de" => [[1e-6, 1e-6, 8.3e-3], [1e-12, 1e-12, 8.22e-3]],
        "sca" => [[0.5, 0.1, 0.1], [0.5, 0.1, 0.05]],
        "bas" => [[6.0, 2.0, 2.0], [0.2, 1e-2, 0.03]],
        _ => [[6.0, 2.0, 2.0], [0.2, 1e-2, 0.03]],
    }
}

#[test]
fn reach_what_their_literature_promises_on_few_parameters() {
    for (name, solve) in methods() {
        for printed in [true, false] {
            for (i, problem) in ["Rosenbrock", "Beale", "Bard"].into_iter().enumerate() {
                let all = published::all();
                let case = all.iter().find(|case| case.name == problem).unwrap();
                let mut sums: Vec<f64> =
                    (0..3).map(|seed| 2.0 * solve(&*case.problem, &case.start, printed, seed).cost).collect();
                sums.sort_by(f64::total_cmp);
                println!("{name} printed {printed} {problem}: {:e} … {:e} … {:e}", sums[0], sums[1], sums[2]);
                assert!(
                    sums[1] <= asked(name)[usize::from(!printed)][i],
                    "{name} {printed} {problem}: {sums:?}"
                );
                let start = 2.0 * case.problem.row_cost(&case.start);
                assert!(sums[2] <= start, "never worse than the start");
            }
        }
    }
}

#[test]
fn budgets_are_counted() {
    let case = published::rosenbrock();
    let passes = |estimate: Estimate| {
        assert_eq!(estimate.evaluations.jacobians, 0);
        assert!(estimate.covariance.is_none());
        assert_eq!(estimate.termination, Termination::IterationLimit);
        assert_eq!(estimate.trace.len(), 11);
        assert!(estimate.trace.windows(2).all(|pair| pair[1].cost <= pair[0].cost));
        estimate.evaluations.residuals / case.problem.rows() as u64
    };
    let (problem, start) = (&*case.problem, &case.start[..]);
    let ten = 10;
    let swarm = pso::Options { population: 7, max_iterations: ten, ..Default::default() };
    assert_eq!(passes(pso::solve(problem, start, &swarm)), 1 + 7 * 11);
    let evolution = de::Options { max_iterations: ten, ..Default::default() };
    assert_eq!(passes(de::solve(problem, start, &evolution)), 1 + 20 * 11);
    let waves = sca::Options { population: 5, max_iterations: ten, ..Default::default() };
    assert_eq!(passes(sca::solve(problem, start, &waves)), 1 + 5 * 11);
    let beetle = bas::Options { max_iterations: ten, ..Default::default() };
    assert_eq!(passes(bas::solve(problem, start, &beetle)), 1 + 30);
    assert!(passes(qibas::solve(problem, start, &beetle)) <= 1 + 40);
}

#[test]
fn stay_inside_the_box_that_the_priors_give() {
    let problem = Rows {
        priors: vec![Prior { mean: 0.0, sigma: 0.1 }, Prior { mean: 0.0, sigma: f64::INFINITY }],
        ..rows(2, 2, |x: &[Dual], i| x[i] - 100.0)
    };
    let region = Region { reach: 2.0, unknown_reach: 0.5 };
    let estimates = [
        pso::solve(&problem, &[1.0, 1.0], &pso::Options { region, ..pso::Options::as_printed() }),
        de::solve(&problem, &[1.0, 1.0], &de::Options { region, ..de::Options::as_printed() }),
        sca::solve(&problem, &[1.0, 1.0], &sca::Options { region, ..sca::Options::as_printed() }),
        bas::solve(&problem, &[1.0, 1.0], &bas::Options { region, ..bas::Options::as_printed() }),
    ];
    for estimate in estimates {
        assert!(estimate.x[0] <= 1.2 + 1e-12 && estimate.x[1] <= 1.5 + 1e-12, "{:?}", estimate.x);
        assert!(estimate.x[0] > 1.1 && estimate.x[1] > 1.25, "{:?}", estimate.x);
    }
}

#[test]
fn the_printed_sine_cosine_is_drawn_to_the_start() {
    // The same bowl, once with its minimum at the start (the origin of the box), once away from it.
    let distance_left = |shift: f64, printed: bool| {
        let bowl = rows(6, 6, move |x: &[Dual], i| x[i] - shift);
        let options = if printed { sca::Options::as_printed() } else { sca::Options::default() };
        let mut costs: Vec<f64> = (0..5)
            .map(|seed| {
                // One step beside the start, so that the minimum is not handed over with it.
                sca::solve(&bowl, &[1e-3; 6], &sca::Options { seed, max_iterations: 150, ..options }).cost
            })
            .collect();
        costs.sort_by(f64::total_cmp);
        costs[2]
    };
    let (at_start, away) = (distance_left(1e-3 + 1e-9, true), distance_left(0.6, true));
    assert!(at_start < 1e-6 * away, "{at_start:e} {away:e}");
}

#[test]
fn the_parabola_helps_the_beetle() {
    let bowl = rows(3, 3, |x: &[Dual], i| (i + 1) as f64 * (x[i] - 0.3));
    let sum = |interpolate: bool| -> f64 {
        let one = |seed| {
            let options = bas::Options { seed, max_iterations: 60, ..Default::default() };
            let solve = if interpolate { qibas::solve } else { bas::solve };
            solve(&bowl, &[0.0; 3], &options).cost.ln()
        };
        (0..10).map(one).sum()
    };
    assert!(sum(true) < sum(false));
}

#[test]
fn same_seed_same_bits_for_any_number_of_threads() {
    let case = published::rosenbrock();
    for (name, solve) in methods() {
        let run = |threads, seed| {
            let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
            pool.install(|| solve(&*case.problem, &case.start, true, seed))
        };
        assert_eq!(run(1, 3), run(2, 3), "{name}");
        assert_ne!(run(1, 3).x, run(1, 4).x, "{name}");
    }
}

#[test]
fn bad_input_is_answered() {
    let bad = rows(2, 3, |x: &[Dual], i| if i == 1 { Dual::from(f64::NAN) } else { x[0] * x[1] });
    let half = rows(1, 1, |x: &[Dual], _| x[0].sqrt() - 0.5);
    let none = rows(2, 0, |_: &[Dual], _| Dual::from(0.0));
    let empty = rows(0, 2, |_: &[Dual], _| Dual::from(1.0));
    for (name, solve) in methods() {
        for printed in [true, false] {
            let estimate = solve(&bad, &[1.0, 2.0], printed, 0);
            assert_eq!(
                (estimate.termination, estimate.x),
                (Termination::NotFinite, vec![1.0, 2.0]),
                "{name}"
            );
            // Half of the box is not a number: the other half is searched.
            let estimate = solve(&half, &[0.0], printed, 0);
            assert!(estimate.cost < 0.01 && estimate.x[0] >= 0.0, "{name} {printed} {}", estimate.cost);
            assert_eq!(solve(&none, &[1.0, 2.0], printed, 0).termination, Termination::SmallResidual);
            assert!(solve(&empty, &[], printed, 0).x.is_empty());
        }
    }
}
