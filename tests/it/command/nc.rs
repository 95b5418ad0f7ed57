//! The page for who has NC programs and has never read the source.
//!
//! The class: documentation that rots. The files and the commands of the page are taken from the page, and run as they
//! stand there.

use std::fs;

use super::shares::models;
use super::{folder, truegrind};

const PAGE: &str = include_str!("../../../docs/nc.md");
const POSES: &str = include_str!("../../data/irb120-tracker.csv");

/// The blocks of the page: what stands behind the fence (`nc face.nc`), and the text.
fn blocks() -> Vec<(&'static str, String)> {
    let mut out: Vec<(&str, String)> = Vec::new();
    let mut open: Option<(&str, String)> = None;
    for line in PAGE.lines() {
        match (line.strip_prefix("```"), open.take()) {
            (Some(_), Some(block)) => out.push(block),
            (Some(head), None) => open = Some((head, String::new())),
            (None, Some((head, text))) => open = Some((head, text + line + "\n")),
            (None, None) => {}
        }
    }
    out
}

/// Words of RAPID, which nobody who reads this page knows.
const RAPID: [&str; 16] = [
    "robtarget",
    "jointtarget",
    "MoveL",
    "MoveJ",
    "MoveC",
    "MoveAbsJ",
    "wobjdata",
    "tooldata",
    "loaddata",
    "PROC",
    "ConfL",
    "ConfJ",
    "PDisp",
    "CRobT",
    "RAPID",
    "WaitTime",
];

fn speaks_no_rapid(what: &str, text: &str) {
    let words = |text: &str| -> Vec<String> {
        text.split(|c: char| !c.is_alphanumeric()).map(str::to_owned).collect()
    };
    let found: Vec<String> = words(text).into_iter().filter(|word| RAPID.contains(&word.as_str())).collect();
    assert!(found.is_empty(), "{what}: {found:?} in\n{text}");
}

#[test]
fn every_example_of_the_page_runs_as_it_stands_there() {
    let dir = folder();
    let at = dir.path();
    fs::write(at.join("poses.csv"), POSES).unwrap();
    let blocks = blocks();
    for (head, text) in &blocks {
        if let Some((_, file)) = head.split_once(' ').filter(|(_, file)| file.contains('.')) {
            fs::write(at.join(file), text).unwrap();
        }
    }
    let filled_in = fs::read_to_string(at.join("cell.toml")).unwrap();
    let mut corrected = 0;
    for (_, commands) in blocks.iter().filter(|(head, _)| *head == "sh") {
        for command in commands.lines() {
            let words: Vec<&str> = command.split_whitespace().collect();
            if words[1] == "cell" {
                // What is filled in would not be replaced.
                fs::remove_file(at.join("cell.toml")).unwrap();
            }
            let (code, out, err) = truegrind(at, &words[1..]);
            assert!(code == 0 || code == 1, "{command}: {code}\n{out}\n{err}");
            if words[1] == "cell" {
                let (_, shown) = blocks.iter().find(|(head, _)| *head == "toml skeleton").unwrap();
                assert_eq!(
                    fs::read_to_string(at.join("cell.toml")).unwrap(),
                    *shown,
                    "the skeleton of the page"
                );
                // Not filled in, it is refused, and the entry is named.
                let (code, _, err) = truegrind(
                    at,
                    &["compensate", "face.nc", "--model", "model.toml", "--cell", "cell.toml", "--dry-run"],
                );
                assert_eq!(code, 2, "{err}");
                assert!(err.contains("cell.toml") && err.contains("tool \"T1\": origin = \"?\""), "{err}");
                fs::write(at.join("cell.toml"), &filled_in).unwrap();
            }
            if words[1] == "compensate" {
                assert!(out.contains("6 motions: 6 corrected"), "{command}: {out}\n{err}");
                speaks_no_rapid(command, &format!("{out}{err}"));
                let output = fs::read_to_string(at.join(words[words.len() - 1])).unwrap();
                assert!(output.contains("truegrind 0."), "{command}: no mark in {output}");
                corrected += 1;
            }
        }
    }
    assert_eq!(corrected, 4, "one for each control");
    // The list of verbs leads there, and so does the help of the verb.
    let (_, help, _) = truegrind(at, &["compensate", "--help"]);
    assert!(help.contains("docs/nc.md"), "{help}");
}

/// What is said of NC programs, on the terminal and on every page, is said in words of NC.
#[test]
fn no_message_about_nc_speaks_rapid() {
    let dir = folder();
    let at = dir.path();
    fs::write(at.join("poses.csv"), POSES).unwrap();
    let (code, _, err) =
        truegrind(at, &["identify", "poses.csv", "--robot", "abb-irb-120", "-o", "model.toml"]);
    assert!(code < 2, "{err}");
    let programs = [
        ("fanuc.nc", include_str!("../../../programs/fanuc.nc")),
        ("siemens.mpf", include_str!("../../../programs/siemens.mpf")),
        ("linuxcnc.ngc", include_str!("../../../programs/linuxcnc.ngc")),
        ("heidenhain.h", include_str!("../../../programs/heidenhain.h")),
        ("states.nc", include_str!("../../../programs/states.nc")),
    ];
    for (name, text) in programs {
        fs::write(at.join(name), text).unwrap();
        // Once with what its comments say, once without.
        let bare: String =
            text.lines().filter(|line| !line.contains("truegrind")).map(|l| format!("{l}\n")).collect();
        fs::write(at.join(format!("bare-{name}")), bare).unwrap();
        for name in [name.to_owned(), format!("bare-{name}")] {
            for circles in ["keep", "segments"] {
                let arguments = [
                    "compensate",
                    &name,
                    "--model",
                    "model.toml",
                    "--dry-run",
                    "--circles",
                    circles,
                    "--md",
                    "page.md",
                    "--html",
                    "page.html",
                    "--json",
                    "page.json",
                    "--csv",
                    "page.csv",
                ];
                let (code, out, err) = truegrind(at, &arguments);
                assert!(code < 2, "{name}: {err}");
                speaks_no_rapid(&name, &format!("{out}{err}"));
                for page in ["page.md", "page.html", "page.json", "page.csv"] {
                    speaks_no_rapid(
                        &format!("{page} of {name}"),
                        &fs::read_to_string(at.join(page)).unwrap(),
                    );
                }
            }
        }
    }
}

/// A comment that is meant for the correction and cannot be used is an error with its line, not a comment like any other.
#[test]
fn comments_that_misstate_are_errors_with_their_line() {
    let dir = folder();
    let at = dir.path();
    fs::write(at.join("poses.csv"), POSES).unwrap();
    let (_, _, err) = truegrind(at, &["identify", "poses.csv", "--robot", "abb-irb-120", "-o", "model.toml"]);
    let program = "%\nO1\n(COMMENT)\nG90 G21\nG1 X1. Y1. Z1. F100.\nM30\n";
    for (comment, words) in [
        ("(truegrind angles zyx)", ["line 3", "wpr", "rotation-vector"]),
        ("(truegrind angle wpr)", ["line 3", "truegrind angles", "(truegrind angle wpr)"]),
        ("(truegrind angles)", ["line 3", "wpr", "abc"]),
        ("(truegrind tool T1 tGrind [[0,0,150]])", ["line 3", "truegrind tool T1", "quaternion"]),
        ("(truegrind frame G54 [[0,0,150],[1,0,0,0]])", ["line 3", "truegrind frame G54", "quaternion"]),
    ] {
        fs::write(at.join("in.nc"), program.replace("(COMMENT)", comment)).unwrap();
        for verb in [
            &["compensate", "in.nc", "--model", "model.toml", "-o", "out.nc"][..],
            &["deviation", "in.nc", "--model", "model.toml"],
        ] {
            let (code, _, said) = truegrind(at, verb);
            assert_eq!(code, 2, "{comment}: {said}{err}");
            assert!(
                words.iter().all(|word| said.contains(word)) && said.contains("in.nc"),
                "{comment}: {said}"
            );
        }
        assert!(!at.join("out.nc").exists());
    }
    // The same word in the cell file.
    fs::write(at.join("in.nc"), program).unwrap();
    fs::write(at.join("cell.toml"), "angles = \"zyx\"\n").unwrap();
    let (code, _, said) = truegrind(
        at,
        &["compensate", "in.nc", "--model", "model.toml", "--cell", "cell.toml", "-o", "out.nc"],
    );
    assert!(
        code == 2 && said.contains("cell.toml") && said.contains("zyx") && said.contains("wpr"),
        "{said}"
    );
}

/// A Heidenhain program looks alike whether an operator starts it or another program calls it: what another of the run calls begins with
/// the shifts of its caller, whoever reads it first.
#[test]
fn a_program_that_another_of_the_run_calls_is_no_main_program() {
    let dir = folder();
    let at = dir.path();
    fs::copy(models().join("model.toml"), at.join("model.toml")).unwrap();
    fs::write(at.join("cell.toml"), "[[tool]]\nname = \"T1\"\norigin = \"metrology\"\nposition_mm = [0, 0, 120]\n[[wobj]]\nname = \"G54\"\norigin = \"metrology\"\nposition_mm = [380, -20, 300]\n").unwrap();
    let head = "; truegrind angles wpr\n1 TOOL CALL 1 Z S0\n";
    let sub = format!(
        "0 BEGIN PGM SUB MM\n{head}2 M128\n3 L X-20 Y-40 Z+20 A+180 B+0 C+0 R0 FMAX\n4 L X-20 Y-40 Z+0 F800\n5 L X+20 Y-40 Z+0\n6 END PGM SUB MM\n"
    );
    let main = format!(
        "0 BEGIN PGM MAIN MM\n{head}2 CYCL DEF 7.0\n3 CYCL DEF 7.1 Z+100\n4 CALL PGM SUB.H\n5 M30\n6 END PGM MAIN MM\n"
    );
    let corrected = |folder: &str, with_main: bool| {
        fs::create_dir_all(at.join(folder)).unwrap();
        fs::write(at.join(folder).join("SUB.h"), &sub).unwrap();
        if with_main {
            fs::write(at.join(folder).join("MAIN.h"), &main).unwrap();
        }
        let out = format!("{folder}-out");
        let (code, text, err) = truegrind(
            at,
            &["compensate", folder, "--model", "model.toml", "--cell", "cell.toml", "-o", &out],
        );
        assert!(code <= 1, "{text}{err}");
        fs::read_to_string(at.join(out).join("SUB.h")).unwrap() != sub
    };
    assert!(corrected("alone", false));
    assert!(!corrected("called", true));
}

/// The convention of the arm's own language was taken for that of the control. It overruled the comment, and stood in where none was: "ok", with
/// the path of a UR10 off by 5.6 mm instead of 3.1.
#[test]
fn the_language_of_the_arm_says_nothing_of_a_b_and_c() {
    let dir = folder();
    let at = dir.path();
    let text = "G90 G71 G17\nT1 D1 M6\nG54\nTRAORI\nG0 X0 Y0 Z0 A10 B20 C30\nG1 X9 F600\nM30\n";
    fs::write(at.join("part.mpf"), text).unwrap();
    fs::write(at.join("stated.mpf"), format!("; truegrind angles rxyz\n{text}")).unwrap();
    for robot in ["abb-irb-120", "kuka-kr10-r1420", "universal-robots-ur10", "fanuc-m-20ia"] {
        for (program, asked) in [("part.mpf", true), ("stated.mpf", false)] {
            let cell = format!("{robot}-{program}.toml");
            let (_, _, err) = truegrind(at, &["cell", program, "-o", &cell, "--robot", robot]);
            let written = fs::read_to_string(at.join(&cell)).unwrap();
            assert_eq!(written.contains("angles = "), asked, "{robot} {program}: {err}{written}");
        }
    }
}
