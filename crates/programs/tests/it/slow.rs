//! The class: a program shape that takes quadratic time. Each is read at two lengths; four times the text must take
//! about four times as long, and always less than a bound that quadratic time would exceed.

use std::time::{Duration, Instant};

use truegrind_programs::nc;
use truegrind_programs::nc::setup::Setup;
use truegrind_programs::rapid;

const NC: &str = "%\nO0001\n(truegrind angles wpr)\n(truegrind tool T1 t [[0,0,50],[1,0,0,0]])\n(truegrind frame G54 w [[400,0,250],[1,0,0,0]])\nG90 G21 G17 T1 M6\nG54 G43.4 H1\nG1 X0. Y0. Z0. A180. B0. C0. F600.\n";
const RT: &str = "[[400,0,400],[0,0,1,0],[0,0,0,0],[9E9,9E9,9E9,9E9,9E9,9E9]]";

fn times(count: usize, line: impl Fn(usize) -> String) -> String {
    (0..count).map(line).collect()
}

fn main_of(data: &str, body: &str, more: &str) -> String {
    format!(
        "MODULE M\nCONST robtarget p:={RT};\n{data}PROC main()\n{body}MoveL p,v100,fine,tool0;\nENDPROC\n{more}ENDMODULE\n"
    )
}

type Shape = (&'static str, fn(usize) -> String);

/// Shapes of NC programs, by file extension; n corresponds to about n/4 bytes.
const SHAPES_OF_NC: &[Shape] = &[
    ("open.ngc", |n| format!("; x\nG21 G90 G54\n{}", "#<".repeat(n))),
    ("brackets.ngc", |n| format!("G1 X{}", "[".repeat(n))),
    ("parens.mpf", |n| format!("N10 TRAORI\nX={}", "(".repeat(n))),
    ("braces.nc", |n| format!("{NC}{}", "{".repeat(n))),
    ("words.h", |n| format!("0 BEGIN PGM A MM\n1 L {}", "X+1 ".repeat(n / 4))),
    ("codes.nc", |n| format!("{NC}{}", "G92".repeat(n / 4))),
    ("units.nc", |n| "G70".repeat(n / 4)),
    ("offsets.nc", |n| format!("{NC}{}", "G54".repeat(n / 4))),
    ("skips.nc", |n| {
        format!("{NC}{}{}", times(n / 32, |i| format!("#{i}={i}.\n")), "/X1. Y1.\n".repeat(n / 16))
    }),
    ("sets.nc", |n| {
        format!("{NC}{}{}", times(n / 32, |i| format!("#{i}={i}.\n")), "/#1=2.\n".repeat(n / 16))
    }),
    ("labels.nc", |n| {
        format!(
            "{NC}{}{}",
            times(n / 32, |i| format!("#{i}={i}.\n")),
            times(n / 32, |i| format!("N{i} GOTO{i}\n"))
        )
    }),
    ("copies.nc", |n| format!("{NC}{}", times(n / 16, |i| format!("#{}=#{i}\n", i + 1)))),
    ("contours.nc", |n| format!("{NC}{}", times(n / 16, |i| format!("G71 P{i} Q{}\nN{i}\n", i + 1)))),
    ("subs.ngc", |n| {
        format!(
            "G21\n{}{}",
            times(n / 32, |i| format!("#{i}={i}\n")),
            times(n / 32, |i| format!("o{i} sub\no{i} endsub\n"))
        )
    }),
    ("kept.ngc", |n| {
        format!("o1 call\n{}{}", times(n / 32, |i| format!("#{i}={i}\n")), "M70\n#1=2\n".repeat(n / 32))
    }),
    ("tools.mpf", |n| {
        format!("N1 TRAORI\n{}{}", times(n / 32, |i| format!("$TC_DP3[{i},1]=1\n")), "/X1\n".repeat(n / 16))
    }),
    ("atrans.mpf", |n| {
        format!(
            "N10 G90 TRAORI\nG1 X0 Y0 Z0 A3=0 B3=0 C3=1 F600\n{}",
            "ATRANS X1\nX1 Y1 Z1 A3=0 B3=0 C3=1\n".repeat(n / 32)
        )
    }),
    ("stated.nc", |n| {
        format!(
            "{}{}",
            times(n / 32, |i| format!("(truegrind frame G54.1 P{i} w [[400,0,250],[1,0,0,0]])\n")),
            times(n / 32, |i| format!("G54.1 P{i}\n"))
        )
    }),
    ("tens.nc", |n| format!("{NC}{}", "G10 L2 P1 X1. Y1. Z1.\n".repeat(n / 32))),
    ("comments.nc", |n| format!("{NC}{}", "(a)".repeat(n / 4))),
    ("calls.h", |n| format!("0 BEGIN PGM A MM\n{}", times(n / 16, |i| format!("LBL {i}\nCALL LBL {i}\n")))),
];

/// Shapes of RAPID.
const SHAPES_OF_RAPID: &[Shape] = &[
    ("brackets", |n| main_of("", &format!("x:={};\n", "[".repeat(n)), "")),
    ("strings", |n| main_of("", &"x:=\"".repeat(n / 4), "")),
    ("placeholders", |n| main_of("", &"%%%".repeat(n / 4), "")),
    ("lates", |n| {
        main_of(
            "",
            &"%\"r\"+s%;\n".repeat(n / 16),
            &times(n / 32, |i| format!("PROC r{i}()\nPDispOff;\nENDPROC\n")),
        )
    }),
    ("each late", |n| main_of("", "", &times(n / 32, |i| format!("PROC r{i}()\n%s%;\nENDPROC\n")))),
    ("suffixes", |n| {
        main_of(
            "",
            &times(n / 32, |i| format!("%\"r\"+s+\"{i}\"%;\n")),
            &times(n / 32, |i| format!("PROC r{i}()\nENDPROC\n")),
        )
    }),
    ("joins", |n| {
        main_of(
            &times(n / 32, |i| format!("VAR num n{i}:=1;\n")),
            &format!("{}{}", times(n / 32, |i| format!("n{i}:={i};\n")), "IF b Set do1;\n".repeat(n / 32)),
            "",
        )
    }),
    ("functions", |n| {
        main_of(
            &times(n / 32, |i| format!("VAR num n{i}:=1;\n")),
            &format!("{}{}", times(n / 32, |i| format!("n{i}:={i};\n")), "x:=one(1);\n".repeat(n / 32)),
            "FUNC num one(num k)\nRETURN k;\nENDFUNC\n",
        )
    }),
    ("chain", |n| main_of("", "r0;\n", &times(n / 32, |i| format!("PROC r{i}()\nr{};\nENDPROC\n", i + 1)))),
    ("displacements", |n| main_of("", &"PDispOn p,tool0;\n".repeat(n / 32), "")),
    ("labels", |n| main_of("", &times(n / 16, |i| format!("l{i}:\nGOTO l{i};\n")), "")),
    ("constants", |n| {
        main_of(&times(n / 32, |i| format!("CONST num c{i}:=c{}+1;\n", i.saturating_sub(1))), "", "")
    }),
    ("tools", |n| {
        main_of(
            &times(n / 128, |i| {
                format!("PERS tooldata t{i}:=[TRUE,[[0,0,{i}],[1,0,0,0]],[1,[0,0,50],[1,0,0,0],0,0,0]];\n")
            }),
            &times(n / 128, |i| format!("MoveL p,v100,fine,t{i};\n")),
            "",
        )
    }),
    ("namesakes", |n| times(n / 64, |i| format!("MODULE m{i}\nPROC a()\na;\nENDPROC\nENDMODULE\n"))),
    ("cases", |n| {
        main_of("", &format!("TEST k\n{}ENDTEST\n", times(n / 32, |i| format!("CASE {i}:\nk:={i};\n"))), "")
    }),
];

fn read(name: &str, text: &str) -> Duration {
    let begin = Instant::now();
    match name.contains('.') {
        true => drop(nc::Task::read(&[(name, text.as_bytes())], &Setup::default())),
        false => drop(rapid::Task::read(&[("m.mod", text.as_bytes())])),
    }
    begin.elapsed()
}

#[test]
fn no_shape_takes_quadratic_time() {
    const SHORT: usize = 1 << 14;
    for (name, shape) in SHAPES_OF_NC.iter().chain(SHAPES_OF_RAPID) {
        assert_not_quadratic(name, [shape(SHORT), shape(4 * SHORT)]);
    }
}

fn assert_not_quadratic(name: &str, [short, long]: [String; 2]) {
    let best = |text: &str| (0..3).map(|_| read(name, text)).min().unwrap();
    let (short, long) = (best(&short), best(&long));
    // Quadratic time would be sixteen times; short times are noise.
    let square = long > Duration::from_millis(150) && long > short * 11;
    assert!(!square, "{name}: {short:?} and {long:?} for four times the text");
}

/// Each label looked for its return to the end of the file, and each program for an earlier one.
#[test]
fn twenty_thousand_labels_or_programs_take_four_times_as_long_as_five_thousand() {
    let labels = |n: usize| format!("0 BEGIN PGM A MM\n{}END PGM A MM\n", times(n, |i| format!("LBL {i}\n")));
    let programs = |n: usize| times(n, |i| format!("O{i}\nM99\n"));
    assert_not_quadratic("labels.h", [5_000, 20_000].map(labels));
    assert_not_quadratic("programs.nc", [5_000, 20_000].map(programs));
}

/// `cargo test --release -- --ignored below_a_megabyte --nocapture` prints the times of the large ones.
#[test]
#[ignore = "for figures, in a release build"]
fn below_a_megabyte_every_shape_finishes_in_time() {
    for (name, shape) in SHAPES_OF_NC.iter().chain(SHAPES_OF_RAPID) {
        let mut size = 1 << 18;
        while shape(2 * size).len() < 1_000_000 {
            size *= 2;
        }
        let text = shape(size);
        let time = read(name, &text);
        println!("{name}: {} bytes, {time:?}", text.len());
        assert!(time < Duration::from_secs(5), "{name}: {time:?}");
    }
}
