//! Rewritten arcs stay close to the intended path, or are refused together with the motions that depend on them.

use truegrind_programs::motion::Reason::*;
use truegrind_programs::motion::{Listing, Reason};
use truegrind_programs::nc::Task;
use truegrind_programs::nc::arc::{Arc, Plane};
use truegrind_programs::nc::dialect::Dialect::{self, Fanuc, Heidenhain, LinuxCnc, Siemens};
use truegrind_programs::nc::setup::Setup;
use truegrind_programs::rewrite::{Change, RewriteOutcome};

use super::default_deny::{HEAD, begin, check, left};
use super::{change_of, rewrite_as};

const BY: [f64; 3] = [1.7771, -1.1912, -0.8686];

/// Changes that displace all motions nearly alike, each slightly more than the one before.
fn nearly_alike(listing: &Listing, step: [f64; 2]) -> Vec<Change> {
    let all = (0..listing.motions.len() as u32)
        .filter(|&motion| listing.motions[motion as usize].reason().is_none());
    all.map(|motion| {
        let more = f64::from(motion);
        change_of(listing, motion, [BY[0] + more * step[0], BY[1] + more * step[1], BY[2]])
    })
    .collect()
}

/// The lines after the first motion, and the outcomes of all requested changes.
fn run(dialect: Dialect, body: &str, step: [f64; 2]) -> (Vec<String>, Vec<RewriteOutcome>) {
    let source = format!("{HEAD}{}{body}\n", begin(dialect));
    let (text, rewritten) = rewrite_as(&source, dialect, |listing| nearly_alike(listing, step));
    let skip = source.lines().count() - body.lines().count();
    (text.lines().skip(skip).map(str::to_owned).collect(), rewritten.outcomes)
}

/// The number after a letter.
fn number(line: &str, letter: char) -> f64 {
    let at = line.find(letter).unwrap_or_else(|| panic!("{letter} in {line}")) + 1;
    let end = line[at..].find(|c: char| !"+-.0123456789".contains(c)).map_or(line.len(), |end| at + end);
    line[at..end].parse().unwrap()
}

#[test]
fn an_arc_with_a_pinned_start_does_not_change_its_radius() {
    let refused =
        [RewriteOutcome::Refused(Reason::BeforeUnmodifiedArc), RewriteOutcome::Refused(Reason::OpenCircle)];
    // The quarter starts at the end of an unmodified arc: only its end would move.
    let (text, outcomes) =
        run(Heidenhain, "CC X+6 Y+2\nC X+1 Y+2 DR+\nCR X+0 Y+3 R+1 DR+\nL X+0 Y+9", [0.0; 2]);
    assert_eq!(text[..3], ["CC X+6 Y+2", "C X+1 Y+2 DR+", "CR X+0 Y+3 R+1 DR+"]);
    assert_eq!(outcomes[0], RewriteOutcome::Refused(WrongShape));
    assert_eq!(outcomes[1], RewriteOutcome::InPlace);
    // The same after a helical full turn, which no circle closes.
    let (text, outcomes) = run(LinuxCnc, "G3 X1 Y2 Z2 I5 J0\nG3 X0 Y3 I-1 J0\nG1 X0 Y9", [1e-2, 0.0]);
    assert_eq!(text[..2], ["G3 X1 Y2 Z2 I5 J0", "G3 X0 Y3 I-1 J0"]);
    assert_eq!(outcomes[..2], refused);
    assert_eq!(outcomes[2], RewriteOutcome::Refused(WrongShape));
    let (text, _) = run(Siemens, "G2 I5 J0 TURN=1\nG2 X3 Y4 I2 J0\nG1 X0 Y9", [0.0; 2]);
    assert_eq!(text[..2], ["G2 I5 J0 TURN=1", "G2 X3 Y4 I2 J0"]);
}

#[test]
fn an_almost_closed_arc_keeps_its_centre() {
    for (line, plane) in [
        ("G3 X0.9994 Y2.0004 I3 J4", "IJ"),
        ("G3 X1 Y1.999 I50 J0", "IJ"),
        ("G3 X1.004 Y1.997 I4.065 J7.955", "IJ"),
        ("G2 X1 Y2.001 I50 J0", "IJ"),
        ("G18 G3 X1.0008 Z3.0006 I4.065 K7.955", "IK"),
    ] {
        for step in [[0.0, 0.0], [3e-5, -4e-5], [-2e-4, 1e-4]] {
            let (text, outcomes) = run(LinuxCnc, line, step);
            if outcomes[1] != RewriteOutcome::InPlace {
                // After such a small gap the arc may reverse its direction: then it is refused.
                assert_eq!(text[0], line);
                continue;
            }
            for letter in plane.chars() {
                let off = number(&text[0], letter) - number(line, letter);
                assert!(off.abs() < 0.02, "{line} -> {} {step:?}", text[0]);
            }
        }
    }
    // Not because it was refused.
    assert_eq!(
        run(LinuxCnc, "G3 X0.9994 Y2.0004 I3 J4", [3e-5, -4e-5]).1,
        [RewriteOutcome::InPlace, RewriteOutcome::InPlace]
    );
    assert_eq!(
        run(LinuxCnc, "G3 X1.004 Y1.997 I4.065 J7.955", [-2e-4, 1e-4]).1,
        [RewriteOutcome::InPlace, RewriteOutcome::InPlace]
    );
}

#[test]
fn a_full_circle_stays_full_when_its_end_is_rounded() {
    for (line, step) in
        [("G3 X1.001 Y2 I50 J0", 0.0), ("G3 X1.001 Y2 I5 J0", 3e-4), ("G2 X1.001 Y2 I5 J0", -3e-4)]
    {
        let (text, outcomes) = run(LinuxCnc, line, [step, 0.0]);
        assert_eq!(outcomes, [RewriteOutcome::InPlace, RewriteOutcome::InPlace], "{line}");
        assert_eq!(number(&text[0], 'X'), 1.0 + BY[0], "{}", text[0]);
        assert!((number(&text[0], 'I') - number(line, 'I')).abs() < 2e-3, "{}", text[0]);
    }
    let whole = Arc::from_centre(Plane::XY, [10.0, 0.0, 0.0], [10.001, 0.0, 0.0], [60.0, 0.0], true).unwrap();
    assert!(whole.is_full_circle());
}

#[test]
fn a_short_arc_keeps_its_radius_and_its_path() {
    for (line, chord) in
        [("G3 X1.05 Y2 R10", 0.05), ("G2 X1.02 Y2.01 R50", 0.022), ("G3 X1.3 Y2.1 I-3 J9", 0.316)]
    {
        for step in [[0.0, 0.0], [3e-5, -4e-5], [-4e-5, 5e-5]] {
            let (text, outcomes) = run(LinuxCnc, line, step);
            assert_eq!(outcomes, [RewriteOutcome::InPlace, RewriteOutcome::InPlace], "{line} {chord}");
            if line.contains('R') {
                let (now, was) = (number(&text[0], 'R'), number(line, 'R'));
                assert!((now / was - 1.0).abs() < 0.05, "{line} -> {}", text[0]);
            } else {
                assert!((number(&text[0], 'J') / 9.0 - 1.0).abs() < 0.05, "{line} -> {}", text[0]);
            }
        }
    }
}

#[test]
fn a_refused_motion_keeps_every_word() {
    // The arc has no change: the motion that ends at its start is refused too, and the one before is rewritten.
    for (dialect, body) in
        [(Fanuc, "X20.\nG3 X20.001 Y2. I5. J0.\nG1 X30."), (LinuxCnc, "X20\nG2 X30 Y2 I5 J0\nG1 X40")]
    {
        let source = format!("{HEAD}{}{body}\n", begin(dialect));
        let (text, rewritten) = rewrite_as(&source, dialect, |listing| {
            nearly_alike(listing, [0.0; 2]).into_iter().filter(|change| change.motion != 2).collect()
        });
        let arc = body.lines().nth(1).unwrap();
        assert!(text.lines().any(|line| line == arc), "{text}");
        assert_eq!(rewritten.outcomes[1], RewriteOutcome::Refused(BeforeUnmodifiedArc));
        assert_eq!(rewritten.outcomes[2], RewriteOutcome::InPlace);
    }
}

#[test]
fn an_arc_after_unmodified_motions_keeps_its_start() {
    let before = left(BeforeUnmodifiedPath);
    let unknown = left(PositionUnknown);
    check(
        LinuxCnc,
        &[
            ("X10\nX20\nG55\nZ45\nG2 X25 Y0 I5 J0", &[None, before, unknown, unknown]),
            // If a motion between states the start of the arc, the one before it may move.
            ("X10\nX20\nG55\nX20 Y0\nG2 X25 Y0 I5 J0", &[None, None, unknown, unknown]),
            ("X10\nX20\nG55\nG91 X2 Y0\nG90 G2 X25 Y0 I5 J0", &[None, before, unknown, unknown]),
        ],
    );
    check(
        Siemens,
        &[
            // A turned frame leaves no axis where it was.
            ("X10\nX20\nROT Z5\nZ45\nG2 X30 Y0 I5 J0", &[None, before, unknown, unknown]),
            ("X10\nX20\nTRANS X1\nZ45\nG2 X29 Y2 I5 J0", &[None, None, None, None]),
            // Y is relative to the end of the motion before the change of frame, through everything between.
            (
                "X10\nX20\nTRANS Y1\nX5 Y=IC(1) Z30\nX7\nX8 Z9\nG3 X9 Y2 I0 J1",
                &[None, before, unknown, unknown, unknown, unknown],
            ),
            (
                "X10\nX20\nTRANS Y1\nX5 Y=AC(1) Z30\nX7\nX8 Z9\nG3 X9 Y2 I0 J1",
                &[None, None, None, None, None, None],
            ),
        ],
    );
}

#[test]
fn no_block_is_inserted_before_one_that_starts_the_spindle() {
    let insertable = |dialect: Dialect, words: &str| {
        let source = format!("{HEAD}{}X50 {words}\nG2 X60 Y2 I5 J0 {words}\n", begin(dialect));
        let setup = Setup { dialect: Some(dialect), ..Setup::default() };
        let task = Task::read(&[("x", source.as_bytes())], &setup);
        assert!(task.listing.motions.iter().all(|motion| motion.reason().is_none()), "{source}");
        (task.listing.motions[1].insertable, task.listing.motions[2].can_straighten)
    };
    for dialect in [LinuxCnc, Siemens] {
        for words in ["", "M5", "M9", "M1"] {
            assert_eq!(insertable(dialect, words), (true, true), "{words}");
        }
        for words in ["M3 S1000", "M8", "S500", "M4", "M7"] {
            assert_eq!(insertable(dialect, words), (false, false), "{words}");
        }
    }
}

/// The class: a Siemens block says more than where it ends. An inserted block would run without that: at another feed
/// (FB, FZ, OVR), or before the spindle turns (M1=3).
#[test]
fn no_block_is_inserted_before_a_siemens_block_with_words_beyond_its_path() {
    let insertable = |words: &str| {
        let source = format!("{HEAD}{}X50 {words}\nG2 X60 Y2 I5 J0 {words}\n", begin(Siemens));
        let setup = Setup { dialect: Some(Siemens), ..Setup::default() };
        let task = Task::read(&[("x", source.as_bytes())], &setup);
        assert!(task.listing.motions.iter().all(|motion| motion.reason().is_none()), "{source}");
        (task.listing.motions[1].insertable, task.listing.motions[2].can_straighten)
    };
    for words in ["", "F200", "F=R1*2", "G9", "; FB=100", "A3=0 B3=0 C3=1 THETA=0"] {
        assert_eq!(insertable(words), (true, true), "{words}");
    }
    let beyond = [
        "FB=100",
        "fb=100",
        "FZ=0.1",
        "F2=100",
        "OVR=50",
        "ACC[X]=50",
        "FL[X]=50",
        "FGROUP(X,Y)",
        "S1=500",
        "M1=3 S1=500",
        "M2=3",
        "H5",
        "H1=5",
        "H=QU(5)",
        "$A_OUT[1]=1",
        "FNORM",
        "SOFT",
        "R1=5",
    ];
    for words in beyond {
        assert_eq!(insertable(words), (false, false), "{words}");
    }
}

/// A control may turn the tool about one axis or run A, B and C as axes: where the two differ, no orientation is inserted.
#[test]
fn nothing_is_inserted_where_a_control_may_turn_the_tool_in_two_ways() {
    let insertable = |words: &str| {
        let source = format!("{HEAD}{}X50 {words}\nG2 X60 Y2 I5 J0\n", begin(LinuxCnc));
        let setup = Setup { dialect: Some(LinuxCnc), ..Setup::default() };
        let task = Task::read(&[("x", source.as_bytes())], &setup);
        assert!(task.listing.motions[1].reason().is_none(), "{source}");
        task.listing.motions[1].insertable
    };
    // About one axis, by little about several, and back and forth in the same orientation.
    for words in ["C40", "A179 B1 C1", "A180 B0 C0"] {
        assert!(insertable(words), "{words}");
    }
    // About several, and by whole turns, which end in the same orientation.
    for words in ["A180 B20 C50", "A150 B30", "C360", "B20 C360"] {
        assert!(!insertable(words), "{words}");
    }
}
