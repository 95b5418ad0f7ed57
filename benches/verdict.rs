//! Sweep of the verdict: for simulated arms, sensors, rows, noise and scale errors, whether the model is written and whether
//! programs are better for it at fresh poses of the measured region.
//!
//! `cargo bench --no-default-features --bench verdict [-- SEEDS]`: the table, then how each kind of case fares; with
//! `TRUEGRIND_SWEEP=FILE` every case as a line of CSV in that file.

// A benchmark says what it measured.
#![allow(clippy::print_stdout, clippy::unwrap_used, missing_docs)]

#[path = "../crates/calibration/tests/it/identification/promise.rs"]
mod promise;

use std::collections::BTreeMap;
use std::fmt::Write as _;

use promise::{Case, Outcome};
use rayon::prelude::*;

const ARMS: [&str; 3] = ["abb-irb-120", "universal-robots-ur10", "fanuc-m-20ia"];
const ROWS: [usize; 6] = [12, 20, 40, 80, 200, 500];
const NOISES_MM: [f64; 5] = [0.02, 0.1, 0.5, 2.0, 5.0];
const SCALES: [f64; 6] = [0.0, 5e-4, 1e-3, -2e-3, 5e-3, 1e-2];

fn main() {
    let seeds: u64 = std::env::args().skip(1).find_map(|a| a.parse().ok()).unwrap_or(2);
    let mut cases = Vec::new();
    for robot in ARMS {
        for cable in [false, true] {
            for rows in ROWS {
                for noise_mm in NOISES_MM {
                    for scale in SCALES {
                        for k in 0..seeds {
                            let seed = cases.len() as u64 + 1;
                            let spread = [0.5, 1.0, 2.0][((seed / 6 + seed / 60 + k) % 3) as usize];
                            cases.push(Case { robot, cable, rows, noise_mm, scale, spread, seed });
                        }
                    }
                }
            }
        }
    }
    let outcomes: Vec<(Case, Outcome)> =
        cases.into_par_iter().map(|case| (case, Outcome { found: None, ..case.outcome() })).collect();
    let mut counts: BTreeMap<String, [usize; 5]> = BTreeMap::new();
    let mut csv =
        String::from("robot,sensor,rows,noise_mm,scale,spread,seed,status,chance,plain,before_mm,after_mm\n");
    for (case, outcome) in &outcomes {
        let place = match (outcome.status.is_some(), outcome.written(), outcome.helps()) {
            (false, ..) => 4,
            (true, true, true) => 0,
            (true, true, false) => 1,
            (true, false, true) => 2,
            (true, false, false) => 3,
        };
        let sensor = if case.cable { "cable" } else { "tracker" };
        for key in [
            "all".to_owned(),
            format!("sensor {sensor}"),
            format!("arm {}", case.robot),
            format!("rows {:3}", case.rows),
            format!("noise {:4} mm", case.noise_mm),
            format!("scale {:5.2} %", 100.0 * case.scale),
        ] {
            counts.entry(key).or_default()[place] += 1;
        }
        let [chance, plain] = outcome.chances.unwrap_or([f64::NAN; 2]);
        let [before, after] = outcome.rms_mm;
        let _ = writeln!(csv, "{case},{:?},{chance:.5},{plain:.5},{before:.4},{after:.4}", outcome.status);
    }
    println!(
        "{:28} {:>9} {:>9} {:>9} {:>9} {:>9}",
        "", "w, helps", "w, harms", "r, helps", "r, harms", "no fit"
    );
    for (key, [a, b, c, d, e]) in &counts {
        println!("{key:28} {a:9} {b:9} {c:9} {d:9} {e:9}");
    }
    if let Some(path) = std::env::var_os("TRUEGRIND_SWEEP") {
        std::fs::write(path, csv).unwrap();
    }
}
