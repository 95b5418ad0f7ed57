//! Seeded mutations of the samples, for where no coverage-guided fuzzer runs: `mutate TARGET COUNT [SEED]`.
//!
//! Method: an input is a sample, or a piece of one, or a joint of two; one to eight times in a row bytes are flipped,
//! cut, doubled, put in at random or from a list of words of the language, or numbers are replaced. The same seed tries
//! the same inputs. A panic, and an input that takes more than five seconds or a gigabyte, ends the run and says with which
//! seed and number it can be had again: `mutate TARGET 1 SEED NUMBER` tries that one alone and prints it.

use std::alloc::System;
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::process::ExitCode;
use std::sync::atomic::{AtomicU64, Ordering};
use std::time::{Duration, Instant};

use cap::Cap;
use rand::{Rng, RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use truegrind_fuzz::targets::{TARGETS, Target};

/// What one input may take.
const SECONDS: u64 = 5;
const BYTES: usize = 1 << 30;

#[global_allocator]
static MEMORY: Cap<System> = Cap::new(System, usize::MAX);

/// The input that is tried, and since when (ms after the start).
static NUMBER: AtomicU64 = AtomicU64::new(0);
static SINCE: AtomicU64 = AtomicU64::new(0);

fn main() -> ExitCode {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let wanted = arguments.first().map(String::as_str).unwrap_or_default();
    let number = |at: usize| arguments.get(at).and_then(|text| text.parse::<u64>().ok());
    let (count, seed, first) = (number(1).unwrap_or(100_000), number(2).unwrap_or(1), number(3));
    let Some(target) = TARGETS.iter().find(|target| target.name == wanted) else {
        let names: Vec<&str> = TARGETS.iter().map(|target| target.name).collect();
        eprintln!("usage: mutate {} COUNT [SEED [NUMBER]]", names.join("|"));
        return ExitCode::from(2);
    };
    let (samples, words) = (target.samples(), target.words());
    assert!(!samples.is_empty() && !words.is_empty(), "no samples found");
    let begin = Instant::now();
    let before = MEMORY.allocated();
    watch(begin, target.name, seed, before);
    let (mut slowest, mut most) = ((0.0_f64, 0), 0);
    for number in first.map_or(0..count, |first| first..first + count) {
        let mut random = ChaCha8Rng::seed_from_u64(seed);
        random.set_stream(number);
        let input = mutated(&samples, &words, target, &mut random);
        if first.is_some() {
            println!("{}", String::from_utf8_lossy(&input));
        }
        let started = Instant::now();
        SINCE.store(begin.elapsed().as_millis() as u64, Ordering::Relaxed);
        NUMBER.store(number + 1, Ordering::Relaxed);
        let ended = catch_unwind(AssertUnwindSafe(|| (target.run)(&input)));
        NUMBER.store(0, Ordering::Relaxed);
        if ended.is_err() {
            eprintln!(
                "{}: panic at seed {seed}, number {number}: {}",
                target.name,
                String::from_utf8_lossy(&input)
            );
            return ExitCode::FAILURE;
        }
        let took = started.elapsed().as_secs_f64();
        if took > slowest.0 {
            slowest = (took, number);
        }
        most = most.max(MEMORY.allocated().saturating_sub(before));
    }
    println!(
        "{}: {count} inputs, seed {seed}, {} samples, {:.1} s, slowest {:.1} ms (number {}), {} MB kept, no panic",
        target.name,
        samples.len(),
        begin.elapsed().as_secs_f64(),
        1000.0 * slowest.0,
        slowest.1,
        most >> 20
    );
    ExitCode::SUCCESS
}

/// Ends the process where an input takes too long or too much, and says which.
fn watch(begin: Instant, name: &'static str, seed: u64, before: usize) {
    std::thread::spawn(move || {
        let mut since = (0, 0.0);
        loop {
            std::thread::sleep(Duration::from_millis(2));
            let number = NUMBER.load(Ordering::Relaxed);
            if number == 0 {
                continue;
            }
            let ran = (begin.elapsed().as_millis() as u64).saturating_sub(SINCE.load(Ordering::Relaxed));
            let took = MEMORY.allocated().saturating_sub(before);
            if took <= BYTES && ran > 1000 * SECONDS && !used_up(&mut since, number) {
                continue;
            }
            if ran > 1000 * SECONDS || took > BYTES {
                eprintln!(
                    "{name}: seed {seed}, number {} takes {:.1} s and {} MB: the bounds are {SECONDS} s and {} MB",
                    number - 1,
                    ran as f64 / 1000.0,
                    took >> 20,
                    BYTES >> 20
                );
                std::process::exit(1);
            }
        }
    });
}

/// Whether an input that has stood on the clock for too long has also had that much of the processor, which others may have had:
/// counted from when this is first asked for it. `since`: the input and the time then.
fn used_up(since: &mut (u64, f64), number: u64) -> bool {
    let Some(now) = processor_seconds() else { return true };
    if since.0 != number {
        *since = (number, now);
    }
    now - since.1 > SECONDS as f64
}

/// Processor time of this process (s), in user and system mode; none where the system does not say it this way.
fn processor_seconds() -> Option<f64> {
    const TICKS_PER_SECOND: f64 = 100.0;
    let text = std::fs::read_to_string("/proc/self/stat").ok()?;
    // Behind the name in parentheses: 11 fields further on.
    let mut fields = text.rsplit(')').next()?.split_whitespace().skip(11);
    let [user, system] = [fields.next()?, fields.next()?].map(|field| field.parse::<f64>().ok());
    Some((user? + system?) / TICKS_PER_SECOND)
}

fn mutated(samples: &[Vec<u8>], words: &[Vec<u8>], target: &Target, random: &mut ChaCha8Rng) -> Vec<u8> {
    let longest = target.longest;
    let pick = |random: &mut ChaCha8Rng| -> Vec<u8> {
        let sample = &samples[random.random_range(0..samples.len())];
        let length = sample.len().min(longest);
        let from = if sample.len() > longest || random.random_bool(if longest > 6000 { 0.02 } else { 0.3 }) {
            random.random_range(0..sample.len())
        } else {
            0
        };
        sample[from..(from + length).min(sample.len())].to_vec()
    };
    let mut input = pick(random);
    if random.random_bool(if longest > 6000 { 0.02 } else { 0.2 }) {
        let other = pick(random);
        let at = random.random_range(0..=input.len());
        input.splice(at.., other);
        input.truncate(longest);
    }
    // Long files are one structure: most of their inputs keep it and differ in numbers and words.
    let gentle = longest > 6000 && random.random_bool(0.8);
    for _ in 0..random.random_range(1..=if gentle { 3 } else { 8 }) {
        change(&mut input, words, gentle, random);
        input.truncate(2 * longest);
    }
    input
}

fn change(input: &mut Vec<u8>, words: &[Vec<u8>], gentle: bool, random: &mut ChaCha8Rng) {
    let at = random.random_range(0..=input.len());
    let end = (at + random.random_range(0..40_usize)).min(input.len());
    match if gentle { 4 } else { random.random_range(0..8) } {
        0 if at < input.len() => input[at] ^= 1 << random.random_range(0..8),
        1 => drop(input.drain(at..end)),
        2 => {
            let piece = input[at..end].to_vec();
            let times = random.random_range(1..20);
            input.splice(at..at, piece.repeat(times));
        }
        3 => {
            let mut noise = vec![0_u8; random.random_range(1..8)];
            random.fill_bytes(&mut noise);
            input.splice(at..at, noise);
        }
        4 => {
            // A number somewhere becomes another, a digit of it or all.
            let Some(from) = input[at..].iter().position(u8::is_ascii_digit).map(|found| at + found) else {
                return;
            };
            let whole = random.random_bool(0.5);
            let digits = input[from..].iter().take_while(|b| b.is_ascii_digit() || **b == b'.').count();
            let text = NUMBERS[random.random_range(0..NUMBERS.len())];
            input.splice(from..from + if whole { digits } else { 1 }, text.bytes());
        }
        5 => {
            let word = &words[random.random_range(0..words.len())];
            let times = if random.random_bool(0.02) { 200 } else { 1 };
            input.splice(at..at, word.repeat(times));
        }
        6 => {
            // Two lines change places.
            let mut lines: Vec<Vec<u8>> =
                input.split_inclusive(|&byte| byte == b'\n').map(<[u8]>::to_vec).collect();
            if lines.len() > 1 {
                let (a, b) = (random.random_range(0..lines.len()), random.random_range(0..lines.len()));
                lines.swap(a, b);
                *input = lines.concat();
            }
        }
        _ => {
            let word = words[random.random_range(0..words.len())].clone();
            input.splice(at..end, word);
        }
    }
}

/// What numbers become.
const NUMBERS: [&str; 16] = [
    "0",
    "-1",
    "1e30",
    "9E9",
    "0.5",
    "12345678901234567890",
    "-0",
    "1.",
    ".5",
    "nan",
    "inf",
    "1e308",
    "1e-308",
    "1e6",
    "90",
    "360",
];
