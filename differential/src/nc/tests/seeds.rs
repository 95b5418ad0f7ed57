//! Programs of many seeds, all controls.

use std::collections::BTreeMap;
use std::env::var;

use super::super::compare::shown;
use super::super::make::Features;
use crate::model;
use crate::outcome::{Dialect, Tally};

const DIALECTS: [Dialect; 4] = [Dialect::Fanuc, Dialect::LinuxCnc, Dialect::Siemens, Dialect::Heidenhain];

/// For looking into seeds: `NC_SEEDS=0..100 NC_ONLY=fanuc NC_PLAIN=1 NC_SHOW=1`, with `--ignored --nocapture`.
#[test]
#[ignore = "a tool for whoever looks into a seed"]
fn seeds_that_are_asked_for() {
    let range = var("NC_SEEDS").unwrap_or_else(|_| "0..50".into());
    let (first, last) = range.split_once("..").unwrap();
    let (first, last): (u64, u64) = (first.parse().unwrap(), last.parse().unwrap());
    let only = var("NC_ONLY").unwrap_or_default();
    let features = Features { presets: var("NC_PLAIN").is_err() };
    for dialect in DIALECTS.into_iter().filter(|dialect| only.is_empty() || dialect.name() == only) {
        let mut tally = Tally::default();
        for seed in first..last {
            let case = match var("NC_RIGID").is_ok() {
                true => model::with(seed, false, false),
                false => model::random(seed),
            };
            let found = shown(dialect, seed, &case, features);
            if var("NC_SHOW").is_ok() {
                println!("{}\n=====\n{}", found.original, found.corrected.unwrap_or_else(|error| error));
            }
            tally.merge(found.tally);
        }
        let mut kinds: BTreeMap<&str, usize> = BTreeMap::new();
        for wrong in &tally.disagreements {
            *kinds.entry(wrong.kind).or_default() += 1;
        }
        for wrong in tally.disagreements.iter().take(40) {
            println!("{wrong}");
        }
        let Tally { programs, executed, corrected, left, refused, unreachable, open, .. } = tally;
        println!(
            "{}: {programs} programs, {executed} executed, {corrected} corrected, {left} left, {refused} refused, \
             {unreachable} unreachable, {open} open; {kinds:?}",
            dialect.name()
        );
    }
}
