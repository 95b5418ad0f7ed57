//! A folder of 1,000 programs of 1,000 targets each through the binary, file to file, all cores.
//!
//! `cargo bench --no-default-features --bench batch`
//!
//! Two cores of an AMD Zen 4 at 3.5 GHz: 3.5 s (5.7 s user, 0.6 s system); 7c20e9f took 3.2 s (5.2 + 0.35 s); 1.5 s are required.
//! Two cores of an AMD Zen 5 at 4.17 GHz under load, user time: 4.26 s (5.07 before Jacobians of eight points were taken at once); 7c20e9f in
//! turn 4.50 s. Of 5.07 reading takes 15 %, targets 17 %, the path between them 14 %, the assessment of risk 5 %, edits 8 %, files 8 %. For
//! 1.5 s a motion may take 3.0 µs, system included.
//! The same machine at a load of 11 to 16, in memory, one thread, in turn: 3.41 + 0.17 s user and system before rounding, cuts, frames, typical joints,
//! angles and decimals were worked out once or not at all, 3.23 + 0.13 s after it. On a busy disk, by the clock: 4.42 s, and 3.38 s with one thread
//! more than processors, which computes while a file is synced.
//! Since then, in turn with 498b129f, above the priority of all else, in memory: one thread 3.66 s by the clock (3.27 + 0.25 s) before and 3.39 s
//! (2.97 + 0.21 s) after the posterior of the arm was worked out once for all programs, velocities once for both deviations of a target, and
//! places, curves and states were no longer searched for and copied; two threads 1.81 and 1.70 s. A motion takes 3.2 µs, system included, and its
//! file on a disk 0.3 to 0.5 more; 1.5 s on two threads allow 3.0. Flat: lexing 6 %, parsing 3, listing 9, original joints 5, targets 9,
//! paths 9, edits 7, copying 5, memory 5.

use std::fmt::Write as _;
use std::fs;
use std::path::Path;
use std::process::Command;
use std::time::Instant;

/// Programs in the folder.
const PROGRAMS: usize = 1000;

/// Targets in each.
const TARGETS: usize = 1000;

fn run(folder: &Path, arguments: &[&str]) {
    let output = Command::new(env!("CARGO_BIN_EXE_truegrind"))
        .current_dir(folder)
        .args(arguments)
        .output()
        .expect("the binary starts");
    let code = output.status.code();
    assert!(matches!(code, Some(0 | 1)), "{code:?}: {}", String::from_utf8_lossy(&output.stderr));
}

/// All targets in front of the arm, axis 1 in the quarter that the configurations state.
fn program(number: usize) -> String {
    let mut text = format!("MODULE Path{number}\n  PROC main()\n");
    for k in 0..TARGETS {
        let (x, y) = ((k % 50) as f64 * 2.0, (k / 50) as f64 * 4.0);
        let z = 5.0 * ((x + number as f64) * 0.05).sin();
        let _ = writeln!(
            text,
            "    MoveL [[{:.4},{:.4},{:.4}],[0.0000000,0.0000000,1.0000000,0.0000000],[0,0,0,0],\
             [9E+09,9E+09,9E+09,9E+09,9E+09,9E+09]],v100,z1,tool0;",
            330.0 + x,
            y + 4.0,
            420.0 + z
        );
    }
    text + "  ENDPROC\nENDMODULE\n"
}

fn main() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let at = folder.path();
    let root = Path::new(env!("CARGO_MANIFEST_DIR"));
    fs::copy(root.join("tests/data/irb120-cable.csv"), at.join("data.csv")).expect("the sample is there");
    run(at, &["identify", "data.csv", "--robot", "abb-irb-120", "-o", "model.toml"]);
    fs::create_dir(at.join("in")).expect("a folder");
    for number in 0..PROGRAMS {
        fs::write(at.join(format!("in/path{number:04}.mod")), program(number)).expect("a program");
    }
    for round in 0..3 {
        let begin = Instant::now();
        run(
            at,
            &["compensate", "in", "--model", "model.toml", "-o", &format!("out{round}"), "--csv", "rows.csv"],
        );
        let seconds = begin.elapsed().as_secs_f64();
        #[allow(clippy::print_stdout)]
        {
            println!("{PROGRAMS} programs of {TARGETS} targets: {seconds:.2} s, file to file");
        }
    }
}
