//! Starts in two bytes against a plain list.

use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use truegrind_programs::tree::starts::Starts;

/// Mostly short tokens, some long ones, which pass one or several multiples of 65,536.
fn starts(random: &mut ChaCha8Rng, tokens: usize, longest: u32) -> Vec<u32> {
    let mut at = if random.random_bool(0.5) { 0 } else { random.random_range(0..200_000) };
    (0..tokens)
        .map(|_| {
            let start = at;
            at += match random.random_range(0..2000) {
                0 => random.random_range(1..=longest),
                1 => 65_536 * random.random_range(1..4),
                _ => random.random_range(1..40),
            };
            start
        })
        .collect()
}

fn packed(plain: &[u32]) -> Starts {
    let mut starts = Starts::with_capacity(plain.len());
    // One by one, and some at once.
    let (first, rest) = plain.split_at(plain.len() / 3);
    first.iter().for_each(|&start| starts.push(start));
    rest.chunks(64).for_each(|some| starts.extend(some));
    starts
}

fn check(starts: &Starts, plain: &[u32]) {
    let at = |token: u32| plain.get(token as usize).copied();
    let end = plain.len() as u32 + 3;
    for token in 0..end {
        assert_eq!(starts.get(token), at(token), "token {token}");
        for second in [token, token + 1, token + 17, token + 1023, token + 1024, token + 5000, token / 2, 0] {
            assert_eq!(starts.pair(token, second), (at(token), at(second)), "tokens {token} and {second}");
        }
    }
}

#[test]
fn no_token_has_no_start() {
    check(&Starts::default(), &[]);
    check(&packed(&[0]), &[0]);
}

#[test]
fn starts_are_those_of_a_plain_list_whatever_the_lengths() {
    let mut random = ChaCha8Rng::seed_from_u64(1);
    for round in 0..60 {
        let (tokens, longest) = (random.random_range(0..9000), [100, 70_000, 140_000, 500_000][round % 4]);
        let plain = starts(&mut random, tokens, longest);
        check(&packed(&plain), &plain);
    }
}

#[test]
fn a_multiple_may_be_passed_at_either_end_of_a_block() {
    for before in [1, 1022, 1023, 1024, 1025, 2047, 2048, 2049] {
        for length in [65_535, 65_536, 65_537, 131_073, 1 << 24] {
            let last = before - 1 + length;
            let plain: Vec<u32> = (0..before).chain((0..3000).map(|token| last + token)).collect();
            check(&packed(&plain), &plain);
        }
    }
}

#[test]
fn starts_reach_to_four_gibibytes() {
    let plain: Vec<u32> = (0..3000).chain((0..3000).map(|token| u32::MAX - 4000 + token)).collect();
    check(&packed(&plain), &plain);
}

#[test]
fn parts_that_are_appended_are_the_whole() {
    let mut random = ChaCha8Rng::seed_from_u64(2);
    for round in 0..60 {
        let tokens = random.random_range(0..6000);
        let plain = starts(&mut random, tokens, [100, 70_000, 140_000, 500_000][round % 4]);
        let mut cuts: Vec<usize> = (0..round % 5).map(|_| random.random_range(0..=tokens)).collect();
        cuts.extend([0, tokens]);
        cuts.sort_unstable();
        let mut whole = Starts::default();
        cuts.windows(2).for_each(|cut| whole.append(&packed(&plain[cut[0]..cut[1]])));
        check(&whole, &plain);
    }
}
