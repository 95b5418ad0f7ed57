//! `cargo run --release -p truegrind-unseen --example unseen -- [RUNS] [KIND…] [--seed S] [--from N] [--rows MOST]
//! [--design NAME] [--workers W] [--stability | --draw | --rows-of] [--file CSV --robot NAME] [--quiet] [--list]`
//!
//! RUNS runs in all, the kinds in turn; all kinds where none is named. Each worker diagnoses on one thread; with `--workers 1`
//! one run after another has all threads, so that its time is a user's. The same marks for any number of workers. `--draw` shows what
//! is drawn and diagnoses nothing, `--rows-of` prints the rows of the first run as a file. With `--file` the rows are those of a
//! measurement (`--json` prints the whole diagnosis); with `--stability` too, RUNS times changed by nothing that matters.

use std::process::ExitCode;

use truegrind_unseen::case::{Case, Limits};
use truegrind_unseen::designs::Design;
use truegrind_unseen::file::Table;
use truegrind_unseen::report::{Plan, line, listed, stability_line, stability_table, table, trials_table};
use truegrind_unseen::table::text;
use truegrind_unseen::truth::Kind;
use truegrind_unseen::under_test::diagnosed;
use truegrind_unseen::worth::Measure;

/// Options that take a value.
const VALUED: [&str; 7] = ["--seed", "--from", "--rows", "--design", "--workers", "--file", "--robot"];

/// Options that do not.
const PLAIN: [&str; 6] = ["--stability", "--draw", "--rows-of", "--json", "--quiet", "--list"];

fn main() -> ExitCode {
    match run(&std::env::args().skip(1).collect::<Vec<_>>()) {
        Ok(()) => ExitCode::SUCCESS,
        Err(why) => {
            eprintln!("{why}");
            ExitCode::from(2)
        }
    }
}

fn run(arguments: &[String]) -> Result<(), String> {
    let has = |name: &str| arguments.iter().any(|a| a == name);
    if has("--list") {
        Kind::ALL.iter().for_each(|kind| println!("{}", kind.name()));
        return Ok(());
    }
    let plan = plan(arguments)?;
    let quiet = has("--quiet");
    let value = |name: &str| arguments.iter().skip_while(|a| *a != name).nth(1);
    if let (Some(file), Some(robot)) = (value("--file"), value("--robot")) {
        return of_file(file, robot, has("--stability").then_some((plan.runs, plan.seed)), has("--json"));
    }
    if has("--rows-of") {
        let case = plan.case(plan.first);
        print!("{}", text(case.sensor.kind, &case.lines(), None));
    } else if has("--draw") {
        plan.over(drawn, |index, text| println!("{index:>4} {text}"));
    } else if has("--stability") {
        let all = plan.stabilities(|index, run| {
            if !quiet {
                println!("{}", stability_line(index, run));
            }
        });
        println!("{}", stability_table(&plan, &all));
    } else {
        let all = plan.outcomes(|index, outcome| {
            if !quiet {
                println!("{}", line(index, outcome));
            }
        });
        println!("\n{}", table(&plan, &all));
    }
    Ok(())
}

/// A file that somebody measured: what is said of it, or how that stands changes that do not matter.
fn of_file(file: &str, robot: &str, trials: Option<(usize, u64)>, json: bool) -> Result<(), String> {
    let rows = std::fs::read_to_string(file).map_err(|why| format!("{file}: {why}"))?;
    let table = Table::read(&rows);
    if let Some(trials) = trials {
        let told = truegrind_unseen::file::trials(&table, robot, trials, |run, change, same, found| {
            let other = if same { "same".to_owned() } else { listed(found) };
            println!("{run:>4} {}: {other}", change.name());
        })?;
        println!("{}", trials_table(&told));
        return Ok(());
    }
    let reply = diagnosed(&rows, robot)?;
    if json {
        println!("{}", reply.json()?);
    }
    println!(
        "{} rows, {:.1} s, held out: geometry {:.4} mm (blocks {:.4}), with causes {:.4} (blocks {:.4}); {} findings: {}",
        table.rows(),
        reply.seconds,
        reply.geometry_held_out_mm,
        reply.geometry_held_out_blocks_mm,
        reply.held_out_mm,
        reply.held_out_blocks_mm,
        reply.findings.len(),
        listed(&reply.findings)
    );
    Ok(())
}

fn drawn(case: &Case) -> String {
    let (scene, hidden) = (case.scene(), &case.hidden);
    let (all, rest) = Measure::of(&scene).sizes(&scene, hidden);
    format!(
        "{} {} {} {} {} rows, attempt {}, σ {:.3} mm, all {all:.4} mm, beside geometry {rest:.4} mm, worth {:.2}\n      size {:.3e} of {:?}",
        hidden.truth.kind.name(),
        case.sheet.name,
        case.sensor.kind.name(),
        case.walk.design.name(),
        case.walk.visits.len(),
        case.attempt,
        case.sensor.sigma_mm,
        case.worth,
        hidden.size,
        hidden.shape
    )
}

fn plan(arguments: &[String]) -> Result<Plan, String> {
    let mut plan = Plan {
        kinds: Vec::new(),
        runs: 90,
        first: 0,
        seed: 0,
        limits: Limits::default(),
        workers: std::thread::available_parallelism().map_or(1, usize::from),
    };
    let mut rest = arguments.iter();
    while let Some(argument) = rest.next() {
        if VALUED.contains(&argument.as_str()) {
            let value = rest.next().ok_or_else(|| format!("{argument}: expected a value"))?;
            if ["--file", "--robot"].contains(&argument.as_str()) {
                continue;
            }
            let number =
                || value.parse::<u64>().map_err(|_| format!("{argument} {value}: expected a number"));
            match argument.as_str() {
                "--seed" => plan.seed = number()?,
                "--from" => plan.first = number()? as usize,
                "--rows" => plan.limits.rows = (number()? as usize).max(60),
                "--workers" => plan.workers = number()? as usize,
                _ => {
                    let design = Design::ALL.into_iter().find(|d| d.name() == value);
                    plan.limits.design = Some(design.ok_or_else(|| {
                        format!(
                            "--design {value}: expected one of {}",
                            Design::ALL.map(Design::name).join(", ")
                        )
                    })?);
                }
            }
        } else if let Ok(runs) = argument.parse::<usize>() {
            plan.runs = runs;
        } else if let Some(kind) = Kind::ALL.into_iter().find(|kind| kind.name() == argument) {
            plan.kinds.push(kind);
        } else if !PLAIN.contains(&argument.as_str()) {
            return Err(format!("{argument}: expected a number of runs, a kind (--list) or an option"));
        }
    }
    if plan.kinds.is_empty() {
        plan.kinds = Kind::ALL.to_vec();
    }
    Ok(plan)
}
