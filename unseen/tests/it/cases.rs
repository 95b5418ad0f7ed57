//! Cases are drawn as stated.

use truegrind_unseen::arms::{Arm, Strain};
use truegrind_unseen::case::{CLEAN, Case, FRESH_SERIES, Limits};
use truegrind_unseen::designs::Design;
use truegrind_unseen::draw::Purpose;
use truegrind_unseen::hidden::Shape;
use truegrind_unseen::sensors::Kind as Measures;
use truegrind_unseen::truth::Kind;
use truegrind_unseen::worth::{Measure, WORTH};

const SMALL: Limits = Limits { rows: 240, design: None };

#[test]
fn every_effect_is_worth_what_was_drawn() {
    for kind in Kind::ALL {
        for run in 0..3 {
            let case = Case::draw(5, kind, run, SMALL);
            let scene = case.scene();
            if kind == Kind::Clean {
                assert_eq!(case.worth, 0.0);
                continue;
            }
            assert!(case.worth >= WORTH.0 && case.worth <= WORTH.1, "{kind:?}");
            let (least, most) = case.hidden.shape.sizes();
            assert!(case.hidden.size >= least && case.hidden.size <= most, "{kind:?}");
            let (low, high) = case.sensor.kind.noise();
            assert!(case.sensor.sigma_mm >= low && case.sensor.sigma_mm <= high, "{kind:?}");
            if kind != Kind::Correlated {
                let (all, rest) = Measure::of(&scene).sizes(&scene, &case.hidden);
                assert!((rest / case.sensor.sigma_mm / case.worth - 1.0).abs() < 1e-9 && all >= rest);
            }
        }
    }
}

/// What geometry explains is taken off whole: an arm with other links, another target and another station is worth nothing.
#[test]
fn geometry_itself_is_worth_nothing() {
    let case = Case::draw(6, Kind::Bending, 0, SMALL);
    let other = case.sheet.built(&mut case.generator(Purpose::Variant));
    let mix = |a: &Arm, b: &Arm| {
        let mut out = a.clone();
        for i in 0..6 {
            // A thousandth of the way, so that nothing but the slope counts.
            out.between[i] = a.between[i].lerp_slerp(&b.between[i], 1e-3);
            out.zero[i] += 1e-3 * (b.zero[i] - a.zero[i]);
        }
        out
    };
    let moved = mix(&case.arm, &other);
    let scene = case.scene();
    let turned = truegrind_unseen::case::Case { arm: moved, ..case.clone() };
    let effect: Vec<f64> = case
        .walk
        .visits
        .iter()
        .flat_map(|v| {
            let read = |arm: &Arm| {
                scene.sensor.ideal(&(arm.flange(&v.q, &Strain::default()) * scene.sensor.target)).lengths()
            };
            read(&turned.arm).into_iter().zip(read(&case.arm)).map(|(a, b)| a - b).collect::<Vec<_>>()
        })
        .collect();
    let (all, rest) = Measure::of(&scene).split(&effect);
    assert!(all > 1e-4 && rest < 1e-2 * all, "{all} {rest}");
}

/// Noise of the rows is the sensor's, and fresh rows have the same; nothing else is in clean rows.
#[test]
fn clean_rows_hold_nothing_but_noise() {
    for run in 0..4 {
        let case = Case::draw(7, Kind::Clean, run, SMALL);
        let mut series = case.fresh();
        series.push((case.walk.visits.clone(), case.lines()));
        for (visits, lines) in series {
            let errors: Vec<f64> = lines
                .iter()
                .zip(&visits)
                .flat_map(|(line, visit)| {
                    let target = case.arm.flange(&visit.q, &Strain::default()) * case.sensor.target;
                    let exact = case.sensor.ideal(&target).lengths();
                    line.reading.lengths().into_iter().zip(exact).map(|(a, b)| a - b).collect::<Vec<_>>()
                })
                .collect();
            let n = errors.len() as f64;
            let rms = (errors.iter().map(|e| e * e).sum::<f64>() / n).sqrt() / case.sensor.sigma_mm;
            assert!((rms - 1.0).abs() < 4.0 / (2.0 * n).sqrt(), "{rms} of {n}");
        }
    }
}

/// Autocorrelated noise keeps the share that it was drawn with, and has the size that it was drawn with.
#[test]
fn correlated_noise_is_as_drawn() {
    let case = Case::draw(8, Kind::Correlated, 1, Limits { rows: 2500, design: Some(Design::Raster) });
    let Shape::Correlated(keep) = case.hidden.shape else { panic!("{:?}", case.hidden.shape) };
    let exact = case.exact(&case.walk.visits);
    let errors: Vec<f64> = case
        .lines()
        .iter()
        .zip(exact)
        .map(|(line, exact)| (line.reading.lengths()[0] - exact.lengths()[0]) / case.sensor.sigma_mm)
        .collect();
    let mean = |lag: usize| {
        let pairs = errors.iter().zip(&errors[lag..]);
        pairs.map(|(a, b)| a * b).sum::<f64>() / (errors.len() - lag) as f64
    };
    let state = case.hidden.size.powi(2);
    // Some 2,500 (1 − keep)/(1 + keep) independent values.
    let spread = (2.0 * (1.0 + keep) / (1.0 - keep) / errors.len() as f64).sqrt();
    assert!((mean(0) / (1.0 + state) - 1.0).abs() < 4.0 * spread);
    assert!((mean(1) / mean(0) - keep * state / (1.0 + state)).abs() < 4.0 * spread);
}

#[test]
fn designs_are_what_they_are_called() {
    for design in Design::ALL {
        let limits = Limits { rows: 2500, design: Some(design) };
        let kind = if design.is_path() { Kind::Latency } else { Kind::Clean };
        let case = Case::draw(9, kind, 0, limits);
        let walk = &case.walk;
        let n = walk.visits.len();
        for w in walk.visits.windows(2) {
            assert!(w[1].hours > w[0].hours);
            assert_eq!(w[1].before, if w[1].repeat == 0 { w[0].q } else { w[0].before });
            assert_eq!(w[1].q == w[0].q, w[1].repeat > 0);
        }
        let same = walk.visits.windows(2).filter(|w| w[0].q == w[1].q).count();
        match design {
            Design::Curve => assert_eq!(n, 500),
            Design::Raster => assert_eq!(n, 2500),
            _ => assert!((200..=1010).contains(&n), "{n}"),
        }
        assert_eq!(same > 0, design == Design::Repeats);
        if design.is_path() {
            // In order: a step is small beside the way.
            let flange = |q| case.arm.flange(q, &Strain::default()).translation.vector;
            let steps: Vec<f64> =
                walk.visits.windows(2).map(|w| (flange(&w[1].q) - flange(&w[0].q)).norm()).collect();
            let way: f64 = steps.iter().sum();
            assert!(steps.iter().all(|step| *step < 0.03 * way), "{design:?}");
            assert!(way > 100.0);
        }
        let series = case.fresh();
        assert_eq!((series.len(), case.clean().len()), (FRESH_SERIES, CLEAN));
        for (visits, lines) in series {
            assert_eq!(visits.len(), lines.len());
            let counted = visits.iter().filter(|v| v.counted).count();
            assert!((n..n + walk.repeats).contains(&counted));
            assert!(visits.iter().all(|v| v.row < n && v.hours <= walk.length_h()));
            // In the file every counted row follows the pose from which it came, so that its sides follow from the order of the rows.
            for w in visits.windows(2).filter(|w| w[1].counted) {
                let from = if w[1].repeat == 0 { w[0].q } else { w[0].before };
                assert_eq!(w[1].before.map(|q| (q * 1e9).round()), from.map(|q| (q * 1e9).round()));
            }
            let known = visits.iter().filter(|v| walk.visits.iter().any(|w| w.q == v.q)).count();
            assert_eq!(known, 0, "a fresh pose was measured");
        }
    }
}

/// What the arm has goes into clean poses, what the measurement has does not.
#[test]
fn only_what_is_in_the_arm_is_in_clean_poses() {
    for kind in Kind::ALL {
        let case = Case::draw(10, kind, 0, SMALL);
        let moved = case.clean().iter().any(|visit| {
            case.hidden.clean_flange(&case.arm, visit) != case.arm.flange(&visit.q, &Strain::default())
        });
        assert_eq!(moved, kind.in_arm(), "{kind:?}");
        let [cable, tracker] = kind.sensors();
        assert!(if case.sensor.kind == Measures::Cable { cable } else { tracker }, "{kind:?}");
    }
}
