//! What two versions of a program differ in, besides the words that a correction writes.

use truegrind_programs::motion::{Listing, MotionKind};
use truegrind_programs::nc::dialect::Dialect::{self, *};
use truegrind_programs::nc::setup::Setup;
use truegrind_programs::reading::Program;
use truegrind_programs::rewrite::{Change, Extra};

use super::default_deny::{HEAD, begin};
use super::{moved, rewrite_as};

fn program(dialect: Dialect, body: &str) -> String {
    format!("{HEAD}{}{body}\n", begin(dialect))
}

fn found(dialect: Dialect, original: &str, corrected: &str) -> Vec<String> {
    let setup = Setup { dialect: Some(dialect), ..Setup::default() };
    let read = |text: &str| Program::read(&[("p", text.to_owned().leak().as_bytes())], &setup);
    read(original).text_differences(&read(corrected))
}

/// Every motion moved, with two targets before each line.
fn changes(listing: &Listing) -> Vec<Change> {
    let mut changes = moved(listing, [0.25, 0.125, -0.5]);
    changes.retain(|change| listing.motions[change.motion as usize].reason().is_none());
    for change in &mut changes {
        let motion = &listing.motions[change.motion as usize];
        if motion.insertable && motion.kind == MotionKind::Linear {
            let target = change.targets.last().cloned().unwrap();
            change.before = vec![Extra { kind: MotionKind::Linear, target, external: None }; 2];
        }
    }
    changes
}

const BODIES: [(Dialect, &str); 4] = [
    (
        Fanuc,
        "N10 G64 M8\nN20 X10. F300.\nN30 G3 X20. Y2. I5. J0.\nG91 G1 X5. M9\nG90 Y5. F300.\n/G61\nG55\nG1 X1. Y2. Z3. A180. B0. C0.\nM30",
    ),
    (
        LinuxCnc,
        "G64 P0.1\nM8\nX10 F300\nG2 X20 R7\nG1 X5 F600\nX6 F600\nG53 G0 Z0\nG1 X1 Y2 Z3 A180 B0 C0\nM2",
    ),
    (
        Siemens,
        "G64\nM8\nX10 F300 S500\nG2 X20 CR=7\nG1 X=IC(5)\nMSG(\"A\")\nTRANS X5\nG1 X1 Y2 Z3 A=180 B=0 C=0\nM30",
    ),
    (
        Heidenhain,
        "L X+10 F300 M8\nCR X+20 R-7 DR+\nL IX+5 F600\nX+7\nL Y+3 FMAX\nCYCL DEF 9.0 DWELL\nCYCL DEF 9.1 DWELL 1\nL X+9 R0 M9",
    ),
];

#[test]
fn what_a_correction_writes_is_no_difference() {
    for (dialect, body) in BODIES {
        let original = program(dialect, body);
        let (corrected, _) = rewrite_as(&original, dialect, changes);
        assert_ne!(corrected, original);
        let inserts = corrected.lines().count() > original.lines().count();
        assert_eq!(inserts, dialect != Heidenhain, "{corrected}");
        assert_eq!(found(dialect, &original, &corrected), Vec::<String>::new(), "{corrected}");
        let marked = format!("{}\n{corrected}", if dialect == Fanuc { "(checked)" } else { "; checked" });
        assert_eq!(found(dialect, &original, &marked.replace("  ", " ")), Vec::<String>::new());
    }
}

/// Each was "ok".
#[test]
fn what_else_differs_is_told() {
    let edits: [&[(&str, &str)]; 4] = [
        &[
            ("G64 M8", "G61 M8"),
            (" M8", ""),
            ("G55", "G54"),
            ("F300.", "F900."),
            ("/G61", "G61"),
            ("N10", "N11"),
            ("M9", "M8"),
        ],
        &[
            ("G64 P0.1", "G64 P0.5"),
            ("M8\n", ""),
            ("G64 P0.1\n", "G61\n"),
            ("F300", "F200"),
            ("G53 ", ""),
            ("M2", ""),
        ],
        &[
            ("G64", "G60"),
            ("S500", "S900"),
            ("MSG(\"A\")\n", ""),
            ("TRANS X5", "TRANS X6"),
            ("F300", "F301"),
            ("M8\n", "M8\nM7\n"),
        ],
        &[
            ("M8", "M9"),
            ("DWELL 1", "DWELL 2"),
            ("CYCL DEF 9.0 DWELL\n", ""),
            ("FMAX", "F100"),
            ("M128\n", ""),
            ("DR+", "DR-"),
        ],
    ];
    for ((dialect, body), edits) in BODIES.into_iter().zip(edits) {
        let original = program(dialect, body);
        let (corrected, _) = rewrite_as(&original, dialect, changes);
        for (from, to) in edits {
            let edited = HEAD.to_owned() + &corrected[HEAD.len()..].replacen(from, to, 1);
            assert_ne!(edited, corrected, "{from}");
            let found = found(dialect, &original, &edited);
            let told =
                found.iter().any(|found| found.contains("in the original, besides the words of positions"));
            assert!(told, "{dialect:?} {from} {to}: {found:?}\n{edited}");
        }
    }
}
