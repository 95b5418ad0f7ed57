//! Single blocks: what takes effect at their end, what rotates axes, how their words are evaluated.

use truegrind_programs::motion::Reason::*;
use truegrind_programs::nc::Task;
use truegrind_programs::nc::dialect::Dialect::{Fanuc, Heidenhain, Iso, LinuxCnc, Siemens};
use truegrind_programs::nc::parser::parse;
use truegrind_programs::nc::setup::Setup;

use super::default_deny::{HEAD, begin, check, left};
use super::ends;

#[test]
fn m129_takes_effect_at_the_end_of_its_block() {
    check(Heidenhain, &[("L X+20\nL X+30 M129\nL X+40 Y+0 Z+0", &[None, None, left(NoTcpMode)])]);
    check(Heidenhain, &[("M129\nL X+40 Y+0 Z+0", &[left(NoTcpMode)])]);
}

#[test]
fn a_path_block_may_end_with_m_alone() {
    check(Heidenhain, &[("L X+20 M\nL X+30 R0 F500 M\nL X+40", &[None, None, None])]);
}

#[test]
fn a_comment_continues_on_the_next_line() {
    let goes_on = "5 ;This is a comment that goes on~\n in the next line~\n X+99 and\n6 L X+20\n";
    for (source, motions) in [
        (goes_on.to_owned(), 2),
        // A block number begins a block; without a number it is unknown what continues.
        ("5 ;~~~~~~~~\n6 L X+20\n".to_owned(), 2),
        (";~~~~~~~~\nL X+20\n".to_owned(), 2),
        // In a definition the block continues.
        ("5 CYCL DEF 200 ~\n Q200=2 ;CLEARANCE ~\n Q201=-20 ;DEPTH\n6 L X+20\n".to_owned(), 2),
        ("5 ;text~\n\nL X+20\n".to_owned(), 2),
    ] {
        let source = format!("{HEAD}{}{source}", begin(Heidenhain));
        let tree = parse(source.as_bytes(), Heidenhain);
        assert_eq!(tree.print(), source.as_bytes());
        let setup = Setup { dialect: Some(Heidenhain), ..Setup::default() };
        let task = Task::read(&[("x", source.as_bytes())], &setup);
        let found: Vec<_> = task.listing.motions.iter().map(|motion| motion.reason()).collect();
        assert_eq!(found, vec![None; motions], "{source}");
        let line = source.lines().position(|line| line.ends_with("L X+20")).unwrap() as u32 + 1;
        assert_eq!(task.listing.motions[1].place.line, line, "{source}");
    }
}

#[test]
fn a_motion_code_beside_the_end_of_a_cycle_is_active() {
    check(Iso, &[("G0 G17 G40 G49 G80 G90\nX20 Y0", &[None]), ("G80 G1\nX20 Y0", &[None])]);
    check(Fanuc, &[("G81 Z-5. R2. F100.\nG0 G80\nX5. Y5. Z5.", &[left(Cycle), None])]);
}

#[test]
fn motions_of_rotary_axes_are_listed() {
    let l = "L X+10 Y+0 Z+50 A+180 B+0 C+90";
    let tilt = "PLANE SPATIAL SPA+0 SPB+20 SPC+0 TURN MB MAX FMAX";
    check(
        Heidenhain,
        &[
            (&format!("{tilt}\nPLANE RESET TURN FMAX\n{l}"), &[left(TiltsTool), left(TiltsTool), None]),
            ("PLANE RESET MOVE ABST10 F500\nL X+10", &[left(TiltsTool), left(PositionUnknown)]),
            ("PLANE RESET STAY\nL X+10", &[None]),
        ],
    );
    check(Fanuc, &[("G53.1\nX5.\nG53.6 R10.", &[left(TiltsTool), left(PositionUnknown), left(TiltsTool)])]);
    check(
        Siemens,
        &[("CYCLE800(1,\"TC\",0,57,0,0,0)\nX5\nCYCLE800()", &[left(TiltsTool), left(Transformed)])],
    );
}

#[test]
fn arcs_lie_in_the_plane_perpendicular_to_the_tool() {
    let go = "M128\nL X+10 Y+0 Z+50 A+180 B+0 C+0";
    check(
        Heidenhain,
        &[
            (
                &format!("TOOL CALL 1 Y S1000\n{go}\nCR X+20 Z+60 R+10 DR+"),
                &[left(BeforeUnmodifiedArc), left(Transformed)],
            ),
            (
                &format!("TOOL CALL 1 X\n{go}\nCR Y+10 Z+60 R+10 DR+"),
                &[left(BeforeUnmodifiedArc), left(Transformed)],
            ),
            (
                &format!("TOOL CALL 1 Y\nTOOL CALL 1 Z\n{go}\nCR X+20 Y+10 R+10 DR+\nTOOL CALL S500"),
                &[None, None],
            ),
        ],
    );
}

#[test]
fn the_control_rounds_integer_variables() {
    let body = "DEF INT NK=5, MK=4\nDEF REAL A=3\nTRAORI\nG1 X1 Y2 Z3 A0 B0 C0\n";
    let found = ends(&format!("{body}NK=NK/2\nMK=MK/2\nX=MK\nX=NK\n"), Siemens);
    assert_eq!(found, [Ok([1.0, 2.0, 3.0]), Ok([2.0, 2.0, 3.0]), Err(UnknownVariable)]);
}

#[test]
fn a_star_ends_a_block_of_a_tape_whose_lines_end_with_cr() {
    let source = format!("{HEAD}G90 G54\nG1 X1 Y2 Z3 A180 B0 C0*\nX5*\nX6").replace('\n', "\r");
    let setup = Setup { dialect: Some(Iso), ..Setup::default() };
    let task = Task::read(&[("x", source.as_bytes())], &setup);
    assert!(task.listing.opaque.is_empty());
    assert_eq!(task.listing.motions.iter().filter(|motion| motion.reason().is_none()).count(), 3);
}

#[test]
fn a_file_of_an_unsupported_control_is_left() {
    let source =
        b"$TEST.MIN%\nO1000\n(ROUGH)\nVC1=10\nG15 H1\nG90 G21\nT1 M6\nG0 X10. Y0. Z50. A180. B0. C90.\nM02\n";
    let task = Task::read(&[("a.min", source)], &Setup::default());
    assert_eq!(task.dialects, [Iso]);
    assert!(task.listing.motions.iter().all(|motion| motion.reason().is_some()));
    let last = task.listing.motions.iter().find(|motion| motion.place.line == 8).unwrap();
    assert_eq!(last.reason(), left(UnknownWord));
    assert!(task.listing.opaque.iter().all(|opaque| opaque.place.line == 4), "{:?}", task.listing.opaque);
}

#[test]
fn linuxcnc_moves_beside_a_dwell_and_the_end_of_a_shift() {
    let go = begin(LinuxCnc);
    for (block, x) in [("G4 P1 X30", 30.0), ("G1 X30 G4 P.5", 30.0), ("G28.1 X30", 30.0)] {
        let found = ends(&format!("{go}{block}\nY5\n"), LinuxCnc);
        assert_eq!(found[1..], [Ok([x, 2.0, 3.0]), Ok([x, 5.0, 3.0])], "{block}");
    }
    // The shift ends, and then the block moves.
    for code in ["G92.1", "G92.2"] {
        let found = ends(&format!("{go}G92 X0\n{code} X30\nY5\n"), LinuxCnc);
        assert_eq!(found[1..], [Ok([30.0, 2.0, 3.0]), Ok([30.0, 5.0, 3.0])], "{code}");
    }
    check(LinuxCnc, &[("G4 P1\nX5", &[None]), ("G92.3 X30", &[left(UnknownVariable)])]);
    // On a Fanuc X is the time; for a plain file this is unknown where P states the time.
    let found = ends(&format!("{}G4 X30.\nY5.\n", begin(Fanuc)), Fanuc);
    assert_eq!(found[1..], [Ok([1.0, 5.0, 3.0])]);
    check(
        Iso,
        &[
            ("G4 X1.5\nY5", &[None]),
            ("G4 P500\nY5", &[None]),
            ("G4 P1 X30\nY5\nX5", &[left(UnknownWord), left(PositionUnknown), None]),
            ("G92.1 X30\nG1 X5 Y5 Z5", &[left(UnknownWord), None]),
        ],
    );
}

#[test]
fn a_spindle_speed_limit_shifts_nothing() {
    check(Fanuc, &[("G92 S2000\nX11.\nG52 X5.\nX10.", &[None, None]), ("G50 S2000\nX11.", &[None])]);
    check(Iso, &[("G92 S2000 M3\nX11", &[None]), ("G50 S2000\nX11", &[None])]);
    // With an axis it is a position.
    check(Fanuc, &[("G92 X0. S2000\nG52 X5.\nX10.", &[left(Displacement)])]);
}

#[test]
fn after_g80_linuxcnc_requires_a_motion_code() {
    check(LinuxCnc, &[("G80\nX11", &[left(NoMotionCode)]), ("G80\nG1 X11", &[None])]);
    check(Iso, &[("G80\nX11", &[left(NoMotionCode)])]);
    check(Fanuc, &[("G80\nX11.", &[None])]);
}

/// The motion mode after a cycle differs between controls: that before it, or the rapid motion of the cycle.
#[test]
fn after_a_cycle_under_g1_a_fanuc_requires_a_motion_code() {
    let line = "G1 X5. F100.\nG81 X6. Z-5. R2. F100.\nG80\nX11. Y5. Z5.";
    check(Fanuc, &[(line, &[None, left(Cycle), left(NoMotionCode)])]);
    let rapid = "G0 X5.\nG81 X6. Z-5. R2. F100.\nG80\nX11. Y5. Z5.";
    check(Fanuc, &[(rapid, &[None, left(Cycle), None])]);
}
