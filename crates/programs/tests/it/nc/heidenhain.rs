//! Heidenhain conversational: what single blocks preserve, and what they make unknown.

use nalgebra::{Quaternion, UnitQuaternion};
use truegrind_programs::motion::Reason::*;
use truegrind_programs::nc::dialect::Dialect::Heidenhain;
use truegrind_programs::nc::parser::parse;
use truegrind_programs::rewrite::{NewTarget, RewriteOutcome};

use super::default_deny::{begin, check, left};
use super::{ends, moved, rewrite_as};

/// The end points of the blocks after the first motion.
fn after(body: &str) -> Vec<Result<[f64; 3], truegrind_programs::motion::Reason>> {
    let presets = "; truegrind tool T1 t [[0,0,50],[1,0,0,0]]\n";
    ends(&format!("{presets}{}{body}\n", begin(Heidenhain)), Heidenhain)[1..].to_vec()
}

/// The same, with the datum shift in the last block (mm).
fn shifted(body: &str) -> (Option<truegrind_programs::motion::Reason>, Option<[f64; 3]>) {
    let source = format!("{}{}{body}\n", super::default_deny::HEAD, begin(Heidenhain));
    let setup = truegrind_programs::nc::setup::Setup { dialect: Some(Heidenhain), ..Default::default() };
    let task = truegrind_programs::nc::Task::read(&[("x", source.as_bytes())], &setup);
    let last = task.listing.motions.last().unwrap();
    let shift = task.listing.work_object(last).unwrap().displacement.map(|frame| frame.position_mm);
    (last.reason(), shift)
}

#[test]
fn a_datum_shift_over_several_lines_is_known_after_the_last() {
    let l = "L X+10 Y+0 Z+50 A+180 B+0 C+90";
    let cycle = |lines: &[&str]| -> String {
        let line = |(at, line): (usize, &&str)| format!("CYCL DEF 7.{} {line}\n", at + 1);
        format!("CYCL DEF 7.0 DATUM SHIFT\n{}", lines.iter().enumerate().map(line).collect::<String>())
    };
    let shift = Some([-60.0, 0.0, 0.0]);
    // After a row of the table a shift is unknown, until each axis is stated.
    for before in ["", "CALL LBL 1\n", "TRANS DATUM TABLE TABLINE1\n"] {
        for lines in [&["X-60", "Y+0", "Z+0"][..], &["Y+0", "X-60", "Z+0"], &["X-60 Y+0 Z+0"]] {
            let body = format!("{before}{}{l}\nLBL 1\nCYCL DEF 7.1 Z+5\nLBL 0", cycle(lines));
            assert_eq!(shifted(&body), (None, shift), "{body}");
        }
        let body = format!("{before}{}{l}\nLBL 1\nCYCL DEF 7.1 Z+5\nLBL 0", cycle(&["X-60", "Y+0"]));
        let expected = match before {
            "" => (None, shift),
            // The label has shifted Z.
            "CALL LBL 1\n" => (None, Some([-60.0, 0.0, 5.0])),
            _ => (left(Transformed), None),
        };
        assert_eq!(shifted(&body), expected, "{body}");
    }
    // An unreadable number, a row of the table, an increment to an unknown value.
    for line in
        ["CYCL DEF 7.1 XQ5", "CYCL DEF 7.1 #5", "TRANS DATUM TABLE TABLINE1\nCYCL DEF 7.1 IX+5 Y+0 Z+0"]
    {
        assert_eq!(shifted(&format!("{line}\n{l}")).0, left(Transformed), "{line}");
    }
    assert_eq!(shifted(&format!("{}{l}", cycle(&["X+1", "IX+2"]))), (None, Some([3.0, 0.0, 0.0])));
    // A shift of a rotary axis offsets its angles.
    assert_eq!(shifted(&format!("{}{l}", cycle(&["X+1", "C+90"]))).0, left(Transformed));
    assert_eq!(shifted(&format!("{}{l}", cycle(&["X-60", "C+0"]))), (None, shift));
    assert_eq!(shifted(&format!("{}TRANS DATUM RESET\n{l}", cycle(&["C+90"]))), (None, None));
}

#[test]
fn the_skip_mark_may_precede_or_follow_the_block_number() {
    for block in ["/5 L X+60", "5 /L X+60", "5 / L X+60", "/L X+60"] {
        let source = format!("{block}\n");
        assert_eq!(parse(source.as_bytes(), Heidenhain).print(), source.as_bytes());
        check(
            Heidenhain,
            &[(&format!("{block}\n6 L Y+5\n7 L X+1 Y+5"), &[left(Skippable), left(UnknownFlow), None])],
        );
    }
    // Elsewhere a slash divides.
    check(Heidenhain, &[("5 Q1 = 6 / 2\n6 L X+Q1", &[None])]);
}

#[test]
fn a_surface_normal_alone_aligns_the_tool() {
    let n = "NX+0.1 NY+0 NZ+0.995";
    check(
        Heidenhain,
        &[
            (&format!("LN X+11 Y+0 Z+50 {n}\nL X+12"), &[left(AlignedToNormal), left(OrientationUnknown)]),
            (
                &format!("LN X+11 Y+0 Z+50 {n}\nL X+12 A+180 B+0 C+90\nL X+13"),
                &[left(AlignedToNormal), None, None],
            ),
            // With a tool vector the motion is known.
            (&format!("LN X+11 Y+0 Z+50 {n} TX+0 TY+0 TZ+1"), &[None]),
            // The vector holds only in its own LN: no other block can state the orientation after it, or may keep
            // one.
            (
                &format!("LN X+11 Y+0 Z+50 {n} TX+0 TY+0 TZ+1\nL X+12\nL X+12 A+180 B+0 C+90"),
                &[None, left(OrientationUnknown), None],
            ),
            ("L X+11 TX+0 TY+0 TZ+1", &[left(Unreadable)]),
            (&format!("M129\nM128\nLN X+11 Y+0 Z+50 {n}"), &[left(AlignedToNormal)]),
            (&format!("M129\nLN X+11 Y+0 Z+50 {n} M128"), &[left(AlignedToNormal)]),
            (&format!("M129\nLN X+11 Y+0 Z+50 {n}"), &[left(NoTcpMode)]),
        ],
    );
}

#[test]
fn paraxial_compensation_moves_its_axis_by_the_radius() {
    let radius = left(RadiusCompensation);
    for sign in ["+", "-"] {
        check(
            Heidenhain,
            &[
                (&format!("X+20 R{sign}\nL Y+5\nL Y+6 R0"), &[radius, radius, left(PositionUnknown)]),
                (&format!("X+20 R{sign}\nL X+1 Y+6 R0\nL Z+5"), &[radius, None, None]),
                (&format!("IX+20 R{sign} F100\nX+1 R0"), &[radius, None]),
            ],
        );
    }
    check(Heidenhain, &[("X+20 R0\nY+5", &[None, None])]);
}

#[test]
fn a_call_without_a_tool_keeps_tool_and_position() {
    check(
        Heidenhain,
        &[
            ("TOOL CALL S500\nL X+11\nTOOL CALL Z S500 F200\nL Y+11", &[None, None]),
            ("TOOL CALL 1 Z S500\nL X+11", &[left(PositionUnknown)]),
            ("TOOL CALL S500 DL+1\nL X+1 Y+1 Z+1 A+180 B+0 C+0", &[left(LengthAllowance)]),
            // A speed does not state which tool a subprogram has left.
            (
                "LBL 1\nTOOL CALL S500\nL X+1 Y+1 Z+1 A+180 B+0 C+0\nTOOL CALL 2 Z\nCALL LBL 1 REP 2",
                &[left(UnknownFlow), left(Subprogram)],
            ),
        ],
    );
}

#[test]
fn a_rounded_or_chamfered_corner_keeps_its_ends() {
    // A control makes a corner in its working plane alone, which corrected lines leave.
    let path = left(RoundedCorner);
    for corner in ["RND R2", "RND R2 F100", "CHF 3"] {
        check(Heidenhain, &[(&format!("L X+20\n{corner}\nL Y+30\nL IX+5"), &[path, path, path, None])]);
        assert_eq!(after(&format!("L X+20\n{corner}\nL IY+30\nL IX+5"))[3], Ok([25.0, 32.0, 3.0]));
        // An arc after it starts at the end of the line that it rounds.
        check(
            Heidenhain,
            &[(
                &format!("L X+20 Y+0\n{corner}\nCC X+20 Y+10\nC X+30 Y+10 DR+\nL Z+9"),
                &[path, path, left(CentreElsewhere), None],
            )],
        );
    }
}

#[test]
fn irrelevant_settings_are_ignored() {
    for block in ["L X+11 M120 LA5", "M120 LA5", "QS1 = \"text\"", "QS2 = QS1 || \"T\"", "FUNCTION MODE MILL"]
    {
        let found = super::default_deny::reasons(Heidenhain, &format!("{block}\nL X+12"));
        assert!(found.iter().all(Option::is_none), "{block}: {found:?}");
    }
    // A lathe, or a kinematic model known only by name.
    for block in ["FUNCTION MODE TURN", "FUNCTION MODE MILL \"HEAD\""] {
        check(Heidenhain, &[(&format!("{block}\nL X+12"), &[left(UnknownWord), left(UnknownWord)])]);
    }
}

#[test]
fn formulas_have_powers_remainders_and_pi() {
    for (formula, value) in [
        ("( Q1 + 3 ) * 2 ^ 2", 32.0),
        ("SQ 10 - 3^3", 73.0),
        ("7 % 4", 3.0),
        ("2 * PI", 2.0 * std::f64::consts::PI),
        ("COS 60 ^ 2", 0.25),
    ] {
        let found = after(&format!("Q1 = +5\nQ6 = {formula}\nL X+Q6"));
        assert_eq!(found, [Ok([(value * 1e6_f64).round() / 1e6, 2.0, 3.0])], "{formula}");
    }
    assert_eq!(after("Q6 = -7 % 4\nL X+Q6"), [Err(UnknownVariable)]);
    assert_eq!(after("Q6 = 7 % 0\nL X+Q6"), [Err(WrongShape)]);
}

/// The class: a word with more decimals than the control takes. It takes four of X and of A; more only where the program has more itself.
#[test]
fn words_of_heidenhain_have_at_most_four_decimals() {
    let source = "BEGIN PGM P MM\n; truegrind angles wpr\n; truegrind tool T1 t [[0,0,50],[1,0,0,0]]\n; truegrind frame G54 w [[500,0,0],[1,0,0,0]]\n\
                  TOOL CALL 1 Z S1000\nM128\nL X+1 Y+2 Z+3 A+180 B+0 C+0 R0 F600\nL X+5.12345 A+179.123456\nL Z+4\n";
    let (text, rewritten) = rewrite_as(source, Heidenhain, |listing| {
        let mut changes = moved(listing, [0.123_456_789, -0.2, 0.3]);
        for target in changes.iter_mut().flat_map(|change| &mut change.targets) {
            if let NewTarget::Cartesian { quaternion: [w, i, j, k], .. } = target {
                // A turn about several axes.
                let turn = UnitQuaternion::from_euler_angles(0.001, 0.002, 0.003);
                let turned = UnitQuaternion::from_quaternion(Quaternion::new(*w, *i, *j, *k)) * turn;
                [*w, *i, *j, *k] = [turned.w, turned.i, turned.j, turned.k];
            }
        }
        changes
    });
    assert!(rewritten.outcomes.iter().all(|outcome| *outcome == RewriteOutcome::InPlace), "{text}");
    let decimals = |word: &str| word.split_once('.').map_or(0, |(_, decimals)| decimals.len());
    let longest = |line: &str| line.split(' ').map(decimals).max().unwrap();
    let lines: Vec<&str> = text.lines().filter(|line| line.starts_with("L ")).collect();
    assert_eq!(lines.iter().map(|line| longest(line)).collect::<Vec<_>>(), [4, 6, 4], "{text}");
    assert!(lines[0].contains(" Y+1.8000 ") && lines[1].contains("X+5.24691"), "{text}");
}
