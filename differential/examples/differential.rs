//! `cargo run --release -p truegrind-differential --example differential -- COUNT [--seed S] [--only LANGUAGE] [--one N]
//! [--without effects,taught,borders] [--with placed,mapped,loose,wrapped] [--show N]`
//!
//! COUNT corrected executions in all, over all languages or one. Ends with 1 where anything disagrees.

use std::process::ExitCode;

use truegrind_differential::outcome::{Dialect, Tally};
use truegrind_differential::rapid::Features;
use truegrind_differential::report;

fn main() -> ExitCode {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let value = |name: &str| {
        arguments.iter().position(|a| a == name).and_then(|at| arguments.get(at + 1)).map(String::as_str)
    };
    let number = |name: &str| value(name).and_then(|text| text.parse::<u64>().ok());
    let only = value("--only").map(|name| Dialect::ALL.into_iter().find(|d| d.name() == name));
    let languages = match only {
        None => Dialect::ALL.to_vec(),
        Some(Some(one)) => vec![one],
        Some(None) => {
            eprintln!("--only: expected one of rapid, fanuc, linuxcnc, siemens, heidenhain");
            return ExitCode::from(2);
        }
    };
    let left_out = value("--without").unwrap_or("");
    let features = Features {
        effects: !left_out.contains("effects"),
        taught: !left_out.contains("taught"),
        borders: !left_out.contains("borders"),
        placed: value("--with").unwrap_or("").contains("placed"),
        mapped: value("--with").unwrap_or("").contains("mapped"),
        loose: value("--with").unwrap_or("").contains("loose"),
        wrapped: value("--with").unwrap_or("").contains("wrapped"),
    };
    let seed = number("--seed").unwrap_or(0);
    if let Some(one) = number("--one") {
        println!("{}", report::one(languages[0], seed.wrapping_add(one), features));
        return ExitCode::SUCCESS;
    }
    let wanted = arguments.first().and_then(|text| text.parse().ok()).unwrap_or(1000);
    let mut all = Tally::default();
    for (dialect, tally, seconds) in report::many(&languages, seed, wanted, features) {
        println!("{}", report::line(dialect.name(), &tally, seconds));
        all.merge(tally);
    }
    let most = number("--show").unwrap_or(12) as usize;
    println!("{}", report::kinds(&all));
    for disagreement in all.disagreements.iter().take(most) {
        println!("{disagreement}");
    }
    if all.disagreements.is_empty() { ExitCode::SUCCESS } else { ExitCode::FAILURE }
}
