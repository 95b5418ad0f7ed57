//! Chaotic maps and their uniformity.

use truegrind_estimation::chaos::map::Map;
use truegrind_estimation::chaos::uniformity::{Options, counts, study, uniformity};

#[test]
fn first_steps_by_hand() {
    let first = |map: Map, start| map.sequence(start).next().unwrap();
    let near = |a: f64, b: f64| assert!((a - b).abs() < 1e-14, "{a} {b}");
    near(first(Map::Logistic { r: 4.0 }, 0.2), 0.64);
    near(first(Map::Tent, 0.2), 0.4);
    near(first(Map::Tent, 0.7), 0.6);
    near(first(Map::Sine { a: 1.0 }, 1.0 / 6.0), 0.5);
    near(first(Map::Bernoulli, 0.7), 0.4);
    near(first(Map::Chebyshev { degree: 2.0 }, 0.7), (2.0 * 0.4 * 0.4 - 1.0 + 1.0) / 2.0);
    // u = 0.2 · (0.25 − 0.5) = −0.05
    near(first(Map::Henon, 0.25), (1.0 - 1.4 * 0.0025 + 1.5) / 3.0);
    // r = 0.5: 0.5 · 0.16 + 3.5 · 0.2 / 2 = 0.43, and at 0.5: 0.125 + 0.875 = 1 → 0, guarded.
    near(first(Map::LogisticTent { r: 0.5 }, 0.2), 0.43);
    near(first(Map::LogisticTent { r: 4.0 }, 0.2), 0.64);
    near(first(Map::LogisticTent { r: 0.0 }, 0.7), 0.6);
}

#[test]
fn no_map_leaves_the_interval_or_collapses() {
    for map in Map::ALL.into_iter().chain([Map::LogisticTent { r: 0.0 }, Map::LogisticTent { r: 4.0 }]) {
        for start in [0.37, 0.5, 0.25, 0.75, 0.0, 1.0, f64::NAN, -3.2, 1.0 / 3.0] {
            let points: Vec<f64> = map.sequence(start).take(100_000).collect();
            assert!(points.iter().all(|x| (0.0..1.0).contains(x)), "{}", map.name());
            // The last thousand points are as different from each other as those of a live orbit.
            let mut tail = points[99_000..].to_vec();
            tail.sort_by(f64::total_cmp);
            tail.dedup();
            assert!(tail.len() > 950, "{} from {start}: {} different points", map.name(), tail.len());
        }
    }
}

#[test]
fn doubling_without_the_guard_would_collapse() {
    let mut x = 0.37_f64;
    (0..60).for_each(|_| x = (2.0 * x).rem_euclid(1.0));
    assert_eq!(x, 0.0);
    let guarded: Vec<f64> = Map::Bernoulli.sequence(0.37).take(60).collect();
    assert!(guarded[59] > 0.0);
}

#[test]
fn a_sequence_is_a_function_of_its_start() {
    for map in Map::ALL {
        let take = || map.sequence(0.37).take(200).collect::<Vec<_>>();
        assert_eq!(take(), take());
    }
}

#[test]
fn logistic_has_the_arcsine_density() {
    // P(x < 0.1) = (2/π) asin √0.1 = 0.2048.
    let counts = counts(Map::Logistic { r: 4.0 }, 0.3, 100_000, 10);
    assert!((counts[0] as f64 / 100_000.0 - 0.2048).abs() < 0.01);
    assert!((counts[9] as f64 / 100_000.0 - 0.2048).abs() < 0.01);
}

#[test]
fn the_paper_s_best_parameter_is_sampling_noise() {
    let rs = [0.05, 0.1, 0.2, 0.3, 0.4, 0.5, 0.6, 0.8, 1.0, 2.0];
    let study = study(&rs, 0.5, 100_000, &Options { starts: 12, ..Options::default() });
    for p in &study.points {
        println!(
            "r {:.2}: {:.2} ± {:.2} ({:.2}), {:.1} ± {:.1} ({:.1})",
            p.r,
            p.short.deviation,
            p.short.spread,
            p.short.random,
            p.long.deviation,
            p.long.spread,
            p.long.random
        );
    }
    println!("{:?}", study.verdict);
    let at = |r: f64| study.points.iter().find(|p| (p.r - r).abs() < 1e-9).unwrap();
    // 1,000 points: random counts scatter by 4.4; neither parameter stands out.
    assert!((at(0.5).short.random - 4.43).abs() < 0.01);
    assert!((at(0.5).short.deviation - at(0.05).short.deviation).abs() < at(0.05).short.spread * 2.0);
    // 100,000 points: 144 against 48 against 44 for random points.
    assert!((at(0.5).long.deviation - 144.0).abs() < 15.0, "{}", at(0.5).long.deviation);
    assert!((at(0.05).long.deviation - 48.0).abs() < 8.0, "{}", at(0.05).long.deviation);
    assert!((at(0.5).long.random - 44.3).abs() < 0.1);
    assert!(study.verdict.sampling_noise);
}

#[test]
fn truly_uniform_counts_match_the_random_figure() {
    // The tent map has the uniform density, but neighbours in its orbit are not independent: same size of
    // scatter.
    let tent = uniformity(Map::Tent, &Options { starts: 50, points: 20_000, ..Options::default() });
    assert!((tent.deviation / tent.random - 1.0).abs() < 0.25, "{} {}", tent.deviation, tent.random);
    let logistic =
        uniformity(Map::Logistic { r: 4.0 }, &Options { starts: 5, points: 20_000, ..Options::default() });
    assert!(logistic.deviation > 5.0 * logistic.random);
}
