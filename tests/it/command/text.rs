//! Text of others on its way to a terminal or a log: file names, headers, cells, keys, words of programs.
//!
//! The class: characters that act without showing. They are spelled out wherever people look; a file that is handed on (a
//! program, a diff into a file) stays as it is, byte by byte.

use std::fs;
use std::path::Path;

use super::{CABLE, folder, truegrind};

/// Clears the screen, names the window, turns the direction of reading, breaks a line, and C1 in both ways.
const EVIL: &str = "\u{1b}[2J\u{1b}]0;t\u{7}\u{202e}\u{2066}\u{200b}\u{2028}\u{9b}2J\u{7f}";

fn shows_nothing_that_acts(what: &str, text: &str) {
    let found: Vec<char> =
        text.chars().filter(|c| truegrind::report::format::visible::is_invisible(*c) && *c != '\r').collect();
    assert!(found.is_empty(), "{what}: {found:?} in {text:?}");
}

fn run(at: &Path, arguments: &[&str]) -> String {
    let (code, out, err) = truegrind(at, arguments);
    assert!(code != 101 && code >= 0, "{arguments:?}: {err}");
    shows_nothing_that_acts(&format!("stdout of {arguments:?}"), &out);
    shows_nothing_that_acts(&format!("stderr of {arguments:?}"), &err);
    out + &err
}

#[test]
fn what_acts_without_showing_never_reaches_a_terminal_or_a_log() {
    let dir = folder();
    let at = dir.path();
    fs::write(at.join("data.csv"), CABLE).unwrap();
    assert_eq!(truegrind(at, &["identify", "data.csv", "--robot", "abb-irb-120", "-o", "model.toml"]).0, 0);
    // What is no control character passes for the text of a program; with one it is taken for a binary file.
    let program = |words: &str| {
        format!(
            "MODULE m\n  ! {words}\n  PROC main()\n    MoveL [[400,0,500],[0,0,1,0],[0,0,0,0],[9E9,9E9,9E9,9E9,9E9,9E9]],v100,\
             z1,tool0; ! {words}\n    Weird{words} 1;\n  ENDPROC\nENDMODULE\n"
        )
    };
    // Names of files.
    let name = format!("x{EVIL}.mod");
    fs::write(at.join(&name), program(EVIL)).unwrap();
    let told = run(at, &["compensate", &name, "--model", "model.toml", "--dry-run"]);
    assert!(told.contains(r"x\x1b[2J"), "{told}");
    fs::write(at.join(&name), program("\u{202e}\u{2066}\u{200b}\u{feff}")).unwrap();
    run(
        at,
        &["compensate", &name, "--model", "model.toml", "-o", "out.mod", "--md", "p.md", "--html", "p.html"],
    );
    for page in ["p.md", "p.html"] {
        shows_nothing_that_acts(page, &fs::read_to_string(at.join(page)).unwrap());
    }
    run(at, &["deviation", &name, "--model", "model.toml", "--csv", "--md", "d.md"]);
    shows_nothing_that_acts("d.md", &fs::read_to_string(at.join("d.md")).unwrap());
    run(at, &["compensate", &format!("missing{EVIL}"), "--model", "model.toml", "--dry-run"]);
    run(at, &[&format!("no-verb{EVIL}")]);
    run(at, &["identify", "data.csv", "--robot", &format!("r{EVIL}")]);
    run(at, &["identify", "data.csv", "--robot", "abb-irb-120", "--method", EVIL]);
    // Headers and cells, one with a line that would pass for a message.
    fs::write(at.join("h.csv"), CABLE.replacen("q6", &format!("q6{EVIL}"), 1)).unwrap();
    run(at, &["identify", "h.csv", "--robot", "abb-irb-120"]);
    let cell = format!("\"1{EVIL}\nerror: forged\"");
    let mut lines: Vec<String> = CABLE.lines().map(str::to_owned).collect();
    lines[3] = lines[3].replacen(lines[3].split(',').next().unwrap(), &cell, 1);
    fs::write(at.join("c.csv"), lines.join("\n")).unwrap();
    let told = run(at, &["identify", "c.csv", "--robot", "abb-irb-120"]);
    assert!(!told.contains("\nerror: forged"), "{told}");
    // A word of a megabyte is cut where it is told.
    fs::write(at.join("l.csv"), CABLE.replacen("q6", &"q".repeat(1_000_000), 1)).unwrap();
    assert!(run(at, &["identify", "l.csv", "--robot", "abb-irb-120"]).len() < 100_000);
    // Keys and words of TOML.
    for text in [format!("\"k{EVIL}\" = 1\n").replace('\u{7f}', ""), format!("robot = \"{EVIL}\n")] {
        fs::write(at.join("t.toml"), &text).unwrap();
        run(at, &["compensate", "out.mod", "--model", "t.toml", "--dry-run"]);
        run(at, &["compensate", "out.mod", "--model", "model.toml", "--cell", "t.toml", "--dry-run"]);
        run(at, &["path", "t.toml", "--robot", "abb-irb-120", "-o", "p.mod"]);
        run(at, &["simulate", "t.toml", "-o", "s.csv"]);
        run(at, &["compare", "--experiment", "t.toml"]);
        run(at, &["robots", "t.toml"]);
    }
}

#[test]
fn a_file_that_is_handed_on_stays_byte_by_byte() {
    let dir = folder();
    let at = dir.path();
    let program = format!("MODULE m\n  ! {EVIL}\nENDMODULE\n");
    fs::write(at.join("p.mod"), &program).unwrap();
    let nominal = ["compensate", "p.mod", "--model", "nominal", "--robot", "abb-irb-120", "-o", "-"];
    assert_eq!(truegrind(at, &nominal).1, program);
}

#[test]
fn a_closed_standard_error_is_no_fault() {
    let dir = folder();
    let at = dir.path();
    fs::write(at.join("recipe.toml"), include_str!("../../data/irb120-cable.toml")).unwrap();
    let run = std::process::Command::new("sh")
        .current_dir(at)
        .args([
            "-c",
            "exec \"$0\" simulate recipe.toml -o data.csv 2>/dev/full",
            env!("CARGO_BIN_EXE_truegrind"),
        ])
        .output()
        .unwrap();
    assert_eq!(run.status.code(), Some(0));
    assert!(at.join("data.csv").exists());
}
