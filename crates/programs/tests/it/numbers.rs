//! The class: a motion has, or would get, a number that no controller can hold. Such a motion is left with a reason
//! of its own, and no written number has an exponent or is infinite or NaN.

use truegrind_programs::motion::Reason;
use truegrind_programs::nc;
use truegrind_programs::nc::dialect::Dialect;
use truegrind_programs::nc::setup::Setup;
use truegrind_programs::rapid::Task;
use truegrind_programs::rewrite::{Change, NewTarget, RewriteOptions, RewriteOutcome};

const EXT: &str = "[9E9,9E9,9E9,9E9,9E9,9E9]";

fn rapid(x: &str, speed: &str) -> Option<Reason> {
    let source = format!(
        "MODULE M\nPROC main()\nMoveL [[{x},0,400],[0,0,1,0],[0,0,0,0],{EXT}],{speed},fine,tool0;\nENDPROC\nENDMODULE\n"
    );
    Task::read(&[("m.mod", source.as_bytes())]).listing.motions[0].reason()
}

#[test]
fn too_large_numbers_of_rapid_leave_the_motion() {
    let long = "9".repeat(309);
    for x in ["1E39", "-1E300", "1E400", "Exp(9E9)", "1E30*1E30", &long] {
        assert_eq!(rapid(x, "v100"), Some(Reason::NumberRange), "{x}");
    }
    for speed in
        ["[0,500,5000,1000]", "[-5,500,5000,1000]", "[1E39,500,5000,1000]", "v100\\V:=0", "v100\\V:=1E39"]
    {
        assert_eq!(rapid("400", speed), Some(Reason::NumberRange), "{speed}");
    }
    assert_eq!(rapid("400", "v100"), None);
    assert_eq!(rapid("400", "v100\\V:=50"), None);
}

#[test]
fn too_large_or_zero_feeds_and_words_of_nc_leave_the_motion() {
    const HEAD: &str = "; truegrind angles wpr\n; truegrind tool T0 t [[0,0,100],[1,0,0,0]]\n; truegrind frame G54 w [[500,0,0],[1,0,0,0]]\nG90 G21 G17 G54\n";
    let long = format!("F{}", "9".repeat(309));
    for (word, reason) in [
        ("F0", Some(Reason::NumberRange)),
        ("F-5", Some(Reason::NumberRange)),
        (&long, Some(Reason::NumberRange)),
        ("F600", None),
    ] {
        let source = format!("{HEAD}G1 X1 Y2 Z3 A180 B0 C0 {word}\n");
        let setup = Setup { dialect: Some(Dialect::LinuxCnc), ..Setup::default() };
        let task = nc::Task::read(&[("x", source.as_bytes())], &setup);
        assert_eq!(task.listing.motions[0].reason(), reason, "{word}");
        assert!(task.listing.speeds.iter().all(|speed| !speed.text.contains("inf")));
    }
}

#[test]
fn no_number_beyond_the_range_of_a_control_is_written() {
    let source = format!(
        "MODULE M\nPROC main()\nMoveL [[1,0,400],[0,0,1,0],[0,0,0,0],{EXT}],v100,fine,tool0;\nENDPROC\nENDMODULE\n"
    );
    let task = Task::read(&[("m.mod", source.as_bytes())]);
    for (x, q) in
        [(f64::NAN, 1.0), (f64::INFINITY, 1.0), (1e300, 1.0), (1e8, 1.0), (1.0, 0.0), (1.0, f64::NAN)]
    {
        let new =
            NewTarget::Cartesian { position_mm: [x, 0.0, 0.0], quaternion: [0.0, 0.0, q, 0.0], conf: None };
        let change = Change { motion: 0, targets: [new].into(), before: vec![] };
        let rewritten = task.rewrite(&[change], &RewriteOptions::default()).unwrap();
        assert_eq!(rewritten.outcomes, [RewriteOutcome::Refused(Reason::NumberRange)], "{x} {q}");
        assert!(rewritten.files[0].edits.is_empty());
    }
}
