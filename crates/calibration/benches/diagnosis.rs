//! How often a diagnosis names what was hidden, and how often it names what is not there: `cargo bench -p truegrind-calibration --bench diagnosis`.
//!
//! Arguments: runs of each kind and sensor (default 8), clean runs of each sensor (default 40), kinds to try.
//!
//! Time of a diagnosis, processor seconds on an AMD Zen 4 at 3.5 GHz: UR5 grid (1,000 positions) 5.2, 7c20e9f 7.6; UR10 D (632 poses)
//! 15.8, 7c20e9f 15.4; UR10 A (11,911 poses) 200 before fits of folds ended earlier, 7c20e9f 124; 2,500 positions along a path with three
//! findings 0.9, with eight 5.9, 7c20e9f 1.0 and 8.6. Clock time on two cores is about 0.6 of that.
//! UR5: selection 34 %, confirmation in halves 15 %, fits of folds 10 %, the written arm 9 %; products of columns are a third, and no
//! other function has more than 3 %. UR10: normal equations have more than 40 %. With some 300 parameters and the 71,466 scalar rows
//! of series A a pass multiplies 3.2 G pairs, 6.4 Gflop or 0.1 s at the peak of a core; the written arm alone takes several fits.
//! Tried and left out: folds refitted by steps with the normal matrix of the first (3 % of UR10 D, nothing of UR5 or of surfaces with drift, whose
//! nearly singular fits need every step measured). Of UR5's 4.2 s on a Xeon both threads are busy in all but 0.9.

#![allow(clippy::unwrap_used, clippy::print_stdout)]

#[path = "../tests/it/diagnosis/simulator.rs"]
#[allow(dead_code, unreachable_pub)]
mod simulator;
#[path = "../tests/it/diagnosis/scenarios.rs"]
#[allow(dead_code, unreachable_pub)]
mod scenarios;

use std::collections::BTreeMap;
use std::time::Instant;

use rand::RngExt;
use scenarios::{FIELD, KINDS, Outcome, draw, hide, log, outcome, stream};
use simulator::{Hidden, Log, Setup};
use truegrind_arm::robots;
use truegrind_calibration::measurement::dataset::Sensor;

/// Arms in turn.
const ARMS: [&str; 4] = ["abb-irb-120", "universal-robots-ur10", "abb-irb-120", "staubli-tx60"];

/// Noise in turn, in units of the sensor's: a worse sensor hides more.
const NOISE: [f64; 3] = [1.0, 4.0, 12.0];

const BINS: [f64; 5] = [10.0, 20.0, 40.0, 80.0, 160.0];

fn bin(lambda: f64) -> usize {
    BINS.iter().take_while(|b| lambda >= **b).count()
}

/// Wilson's 95 % bounds of a rate.
fn bounds(hits: usize, all: usize) -> (f64, f64) {
    if all == 0 {
        return (0.0, 1.0);
    }
    let (n, p, z) = (all as f64, hits as f64 / all as f64, 1.96_f64);
    let middle = (p + z * z / (2.0 * n)) / (1.0 + z * z / n);
    let half = z / (1.0 + z * z / n) * (p * (1.0 - p) / n + z * z / (4.0 * n * n)).sqrt();
    (middle - half, middle + half)
}

fn main() {
    let arguments: Vec<String> = std::env::args().skip(1).filter(|a| !a.starts_with("--")).collect();
    let number = |k: usize, or: u64| arguments.get(k).and_then(|a| a.parse().ok()).unwrap_or(or);
    let (runs, clean) = (number(0, 8), number(1, 40));
    let wanted: Vec<&str> = KINDS
        .into_iter()
        .chain(["pair"])
        .chain(FIELD)
        .filter(|k| arguments.len() < 3 || arguments[2..].iter().any(|a| a == k))
        .collect();
    let arms: Vec<_> = ARMS.iter().map(|name| robots::load(name).unwrap().model).collect();
    let mut singles: BTreeMap<usize, (usize, usize, usize)> = BTreeMap::new();
    let mut pairs: BTreeMap<usize, (usize, usize, usize)> = BTreeMap::new();
    let mut by_kind: BTreeMap<(String, &str), (usize, usize)> = BTreeMap::new();
    let (mut within, mut ratios, mut wrong, mut total) = ((0, 0), Vec::new(), 0, 0);
    let mut wrong_identified = 0;
    let start = Instant::now();
    for kind in &wanted {
        for (sensor, label, sigma_mm) in [(Sensor::Cable, "cable", 0.04), (Sensor::Position, "tracker", 0.03)]
        {
            for run in 0..runs {
                let mut rng = stream(&format!("{kind}{label}"), run);
                let rows = [200, 350, 600, 1000][run as usize % 4];
                let hidden: Vec<Hidden> = if *kind == "pair" {
                    let first = rng.random_range(0..KINDS.len());
                    let second = (first + rng.random_range(1..KINDS.len())) % KINDS.len();
                    [first, second].iter().map(|&k| draw(KINDS[k], rows, &mut rng)).collect()
                } else {
                    hide(kind, rows, &mut rng)
                };
                let of_cable = |h: &Hidden| matches!(h, Hidden::Zero { .. } | Hidden::Sag { .. });
                if sensor != Sensor::Cable && hidden.iter().any(of_cable) {
                    continue;
                }
                let nominal = &arms[(run as usize / 4) % arms.len()];
                if nominal.bodies.is_none() && hidden.iter().any(|h| matches!(h, Hidden::Payload { .. })) {
                    continue;
                }
                let sigma_mm = sigma_mm * NOISE[run as usize % NOISE.len()];
                let seed = rng.random_range(0..1_000_000);
                let setup = Setup { sensor, rows, sigma_mm, dirty: true, seed, log: log(kind) };
                let began = Instant::now();
                let out: Outcome = outcome(nominal, &hidden, &setup);
                let took = began.elapsed().as_secs_f64();
                let visible = out.hidden.iter().all(|(_, l)| *l > 40.0);
                for (((h, lambda), found), sure) in out.hidden.iter().zip(&out.found).zip(&out.identified) {
                    let place = if hidden.len() > 1 { &mut pairs } else { &mut singles };
                    let entry = place.entry(bin(*lambda)).or_default();
                    entry.1 += 1;
                    entry.0 += usize::from(*found);
                    entry.2 += usize::from(*sure);
                    if *lambda > 40.0 {
                        let entry = by_kind.entry((h.name().to_owned(), label)).or_default();
                        entry.1 += 1;
                        entry.0 += usize::from(*found);
                    }
                }
                total += 1;
                wrong += usize::from(!out.wrong.is_empty());
                wrong_identified += out.wrong_identified;
                within.0 += out.within.0;
                within.1 += out.within.1;
                if visible {
                    ratios.push(out.over_truth);
                }
                if out.identified.iter().zip(&out.hidden).any(|(f, (_, l))| !f && *l > 40.0)
                    || !out.wrong.is_empty()
                {
                    println!("{kind} {label} {run} n={rows} σ={sigma_mm} mm {took:.1} s");
                    for (h, l) in &out.hidden {
                        println!("   hidden {h:?} λ {l:.0}");
                    }
                    println!(
                        "   found {:?}  wrong {:?} over truth {:.3}",
                        out.all, out.wrong, out.over_truth
                    );
                    for f in &out.diagnosed.diagnosis.findings {
                        let rivals: Vec<String> = f
                            .alternatives
                            .iter()
                            .map(|a| format!("{} {:?} {:.1}", a.effect, a.joints, a.twice_log_bayes_factor))
                            .collect();
                        println!(
                            "   {} {:?}: λ {:.0?}, ahead of {rivals:?}; {:?}",
                            f.effect, f.joints, f.non_centrality, f.doubts
                        );
                    }
                }
            }
        }
    }
    let table = |name: &str, rates: &BTreeMap<usize, (usize, usize, usize)>| {
        println!("\n{name}: found by name and joint or rows, by non-centrality λ");
        for (b, (hits, all, sure)) in rates {
            let low = if *b == 0 { 0.0 } else { BINS[b - 1] };
            let high = BINS.get(*b).map_or("…".to_owned(), |h| format!("{h:.0}"));
            let (l, h) = bounds(*hits, *all);
            println!(
                "  λ {low:>4.0} to {high:>4}: {hits:>4} of {all:>4}  ({:.0} to {:.0} %), {sure:>4} identified",
                100.0 * l,
                100.0 * h
            );
        }
    };
    table("single effects", &singles);
    table("effects in pairs", &pairs);
    println!("\nλ > 40 by kind:");
    for ((kind, label), (hits, all)) in &by_kind {
        println!("  {kind:<20} {label:<8} {hits} of {all}");
    }
    println!("\nparameters within 3σ: {} of {}", within.1, within.0);
    ratios.sort_by(f64::total_cmp);
    if let Some(worst) = ratios.last() {
        let over = ratios.iter().filter(|r| **r > 1.2).count();
        println!(
            "held-out error over that of the true structure: median {:.3}, worst {worst:.3}, above 1.2 in {over} of {}",
            ratios[ratios.len() / 2],
            ratios.len()
        );
    }
    println!(
        "runs with a further finding that was not hidden: {wrong} of {total}; false identified names: {wrong_identified}"
    );
    for (sensor, label, sigma_mm) in [(Sensor::Cable, "cable", 0.04), (Sensor::Position, "tracker", 0.03)] {
        let mut alarms = 0;
        for run in 0..clean {
            let rows = [200, 350, 600, 1000][run as usize % 4];
            let seed = 900_000 + run;
            let setup = Setup { sensor, rows, sigma_mm, dirty: true, seed, log: Log::default() };
            let out = outcome(&arms[(run as usize / 4) % arms.len()], &[], &setup);
            if !out.wrong.is_empty() {
                alarms += 1;
                println!("clean {label} {run}: {:?}", out.wrong);
            }
        }
        let (l, h) = bounds(alarms, clean as usize);
        println!(
            "false alarms, {label}: {alarms} of {clean} clean runs ({:.1} to {:.1} %)",
            100.0 * l,
            100.0 * h
        );
    }
    println!("{:.0} s", start.elapsed().as_secs_f64());
}
