//! Seeded mutations of the samples, for where no coverage-guided fuzzer runs: `mutate TARGET COUNT [SEED]`.
//!
//! Method: an input is a sample, or a piece of one, or a joint of two; one to eight times in a row bytes are flipped,
//! cut, doubled, put in at random or from a list of words of the language, or numbers are replaced. The same seed tries
//! the same inputs. A panic says with which seed and number it can be had again.

use std::panic::{AssertUnwindSafe, catch_unwind};
use std::path::Path;
use std::process::ExitCode;
use std::time::Instant;

use rand::{Rng, RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;

/// The longest input (bytes).
const LONGEST: usize = 6000;

/// A target: what is tried, the endings of its samples, words of its language.
type Target = (&'static str, fn(&[u8]), &'static [&'static str], &'static [&'static str]);

const TARGETS: [Target; 4] = [
    (
        "rapid",
        truegrind_fuzz::rapid,
        &["mod", "modx", "prg", "sys"],
        &[
            "MODULE M\n",
            "ENDMODULE\n",
            "PROC p()\n",
            "ENDPROC\n",
            "IF TRUE THEN\n",
            "ELSE\n",
            "ENDIF\n",
            "FOR i FROM 1 TO 3 DO\n",
            "ENDFOR\n",
            "WHILE x DO\n",
            "ENDWHILE\n",
            "TEST x\n",
            "CASE 1:\n",
            "DEFAULT:\n",
            "ENDTEST\n",
            "ERROR\n",
            "MoveL p,v100,z1,tool0;\n",
            "MoveC p,p,v100,z1,tool0;\n",
            "MoveC CirPoint:=p, ! c\n ToPoint:=p,v100,z1,tool0;\n",
            "MoveAbsJ j,v100,fine,tool0;\n",
            "Offs(p,1,2,3)",
            "RelTool(p,1,2,3\\Rz:=4)",
            "MirPos(p,wobj0)",
            "[[1,2,3],[1,0,0,0],[0,0,0,0],[9E9,9E9,9E9,9E9,9E9,9E9]]",
            "VAR robtarget p:=",
            "CONST num n:=",
            "p.trans.x:=1;\n",
            "PDispSet [[1,2,3],[1,0,0,0]];\n",
            "PDispOff;\n",
            "\\WObj:=w",
            "%\"p\"%;\n",
            "<SMT>",
            "\"",
            "!",
            ";",
            ",",
            "[",
            "]",
            "{",
            "}",
            "(",
            ")",
            ":=",
            "%%%",
            "\\",
            "9E9",
            "-",
            ".5",
            "\r\n",
            "\u{0}",
        ],
    ),
    (
        "nc",
        truegrind_fuzz::nc,
        &["nc", "mpf", "ngc", "h"],
        &[
            "G0 ",
            "G1 ",
            "G2 ",
            "G3 ",
            "G17",
            "G18",
            "G19",
            "G20",
            "G21",
            "G28 ",
            "G41",
            "G40",
            "G43.4",
            "G43.5",
            "G53 ",
            "G54",
            "G68 ",
            "G81 ",
            "G80",
            "G90",
            "G91",
            "G92 ",
            "X1.5",
            "Y-2",
            "Z.5",
            "A180.",
            "B0",
            "C-.5",
            "I5",
            "J-5",
            "K1",
            "R10",
            "F600",
            "X#1",
            "#1=2\n",
            "#[1]=3\n",
            "X[#1*2]",
            "X=IC(5)",
            "X=AC(R1)",
            "A3=0.1",
            "C3=1",
            "THETA=5",
            "R1=5",
            "TRAORI\n",
            "TRANS X1\n",
            "ROT Z90\n",
            "M30",
            "M98 P1",
            "L100",
            "\n",
            "/",
            "N10 ",
            "(c)",
            ";c\n",
            "%\n",
            "O5 ",
            "GOTO 10",
            "L X+1 Y+2\n",
            "CC X+1\n",
            "C X+3 DR+\n",
            "Q1 = +5\n",
            "LBL 1\n",
            "BEGIN PGM A MM\n",
            "; truegrind angles wpr\n",
            "; truegrind tool T0 t [[0,0,1],[1,0,0,0]]\n",
            "; truegrind frame G54 w [[0,0,1],[1,0,0,0]]\n",
            "999999999999999999999",
            "1e5",
            "\u{0}",
        ],
    ),
    (
        "csv",
        truegrind_fuzz::csv,
        &["csv"],
        &[
            "q1",
            "q6",
            "L",
            "measured_x",
            "measured_qw",
            "session",
            "t",
            ",",
            ";",
            "\t",
            "\n",
            "\r\n",
            "\"",
            "nan",
            "inf",
            "1e309",
            "-",
            "0",
            ",,,,",
            "\u{feff}",
            "3,5",
            "anchor",
        ],
    ),
    (
        "surface",
        truegrind_fuzz::surface,
        &["toml"],
        &[
            "name = \"x\"\n",
            "[path]\n",
            "[tool]\n",
            "explicit = \"",
            "x*y",
            "sin(x)",
            "/0",
            "^",
            "((((",
            "1e308",
            "nan",
            "-1",
            "0",
            "[",
            "]",
            "=",
            "\n",
            "\"",
            "\"\"\"",
            "#",
            "{",
            "}",
            "mesh = \"a.stl\"\n",
        ],
    ),
];

fn main() -> ExitCode {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let wanted = arguments.first().map(String::as_str).unwrap_or_default();
    let count: u64 = arguments.get(1).and_then(|text| text.parse().ok()).unwrap_or(100_000);
    let seed: u64 = arguments.get(2).and_then(|text| text.parse().ok()).unwrap_or(1);
    let Some((name, target, endings, words)) = TARGETS.into_iter().find(|target| target.0 == wanted) else {
        eprintln!("usage: mutate rapid|nc|csv|surface COUNT [SEED]");
        return ExitCode::from(2);
    };
    let samples = samples(endings);
    assert!(!samples.is_empty(), "no samples found");
    let begin = Instant::now();
    let mut slowest = 0.0_f64;
    for number in 0..count {
        let mut random = ChaCha8Rng::seed_from_u64(seed);
        random.set_stream(number);
        let input = mutated(&samples, words, &mut random);
        let started = Instant::now();
        if catch_unwind(AssertUnwindSafe(|| target(&input))).is_err() {
            eprintln!("{name}: panic at seed {seed}, number {number}: {}", String::from_utf8_lossy(&input));
            return ExitCode::FAILURE;
        }
        slowest = slowest.max(started.elapsed().as_secs_f64());
    }
    println!(
        "{name}: {count} inputs, seed {seed}, {} samples, {:.1} s, slowest {:.1} ms, no panic",
        samples.len(),
        begin.elapsed().as_secs_f64(),
        1000.0 * slowest
    );
    ExitCode::SUCCESS
}

fn samples(endings: &[&str]) -> Vec<Vec<u8>> {
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("..");
    let mut files: Vec<_> = ["programs", "surfaces", "tests/data"]
        .iter()
        .filter_map(|folder| std::fs::read_dir(root.join(folder)).ok())
        .flatten()
        .filter_map(|entry| entry.ok().map(|entry| entry.path()))
        .filter(|path| path.extension().is_some_and(|ending| endings.iter().any(|wanted| ending == *wanted)))
        .collect();
    files.sort();
    files.iter().filter_map(|path| std::fs::read(path).ok()).collect()
}

fn mutated(samples: &[Vec<u8>], words: &[&str], random: &mut ChaCha8Rng) -> Vec<u8> {
    let pick = |random: &mut ChaCha8Rng| -> Vec<u8> {
        let sample = &samples[random.random_range(0..samples.len())];
        let length = sample.len().min(LONGEST);
        let from = if sample.len() > LONGEST || random.random_bool(0.3) {
            random.random_range(0..sample.len())
        } else {
            0
        };
        sample[from..(from + length).min(sample.len())].to_vec()
    };
    let mut input = pick(random);
    if random.random_bool(0.2) {
        let other = pick(random);
        let at = random.random_range(0..=input.len());
        input.splice(at.., other);
        input.truncate(LONGEST);
    }
    for _ in 0..random.random_range(1..=8) {
        let at = random.random_range(0..=input.len());
        let end = (at + random.random_range(0..40_usize)).min(input.len());
        match random.random_range(0..8) {
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
                // A number somewhere becomes another.
                let digit = input[at..].iter().position(u8::is_ascii_digit).map(|found| at + found);
                if let Some(digit) = digit {
                    let text = ["0", "-1", "1e30", "9E9", "0.5", "12345678901234567890", "-0", "1.", ".5"]
                        [random.random_range(0..9)];
                    input.splice(digit..=digit, text.bytes());
                }
            }
            5 => {
                let word = words[random.random_range(0..words.len())];
                let times = if random.random_bool(0.02) { 200 } else { 1 };
                input.splice(at..at, word.repeat(times).into_bytes());
            }
            6 => {
                // Two lines change places.
                let mut lines: Vec<Vec<u8>> =
                    input.split_inclusive(|&byte| byte == b'\n').map(<[u8]>::to_vec).collect();
                if lines.len() > 1 {
                    let (a, b) = (random.random_range(0..lines.len()), random.random_range(0..lines.len()));
                    lines.swap(a, b);
                    input = lines.concat();
                }
            }
            _ => {
                let word = words[random.random_range(0..words.len())];
                input.splice(at..end, word.bytes());
            }
        }
        input.truncate(2 * LONGEST);
    }
    input
}
