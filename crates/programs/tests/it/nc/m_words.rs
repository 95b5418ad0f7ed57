//! M words: their values, their jumps, their effects.

use truegrind_programs::motion::Reason::*;
use truegrind_programs::nc::dialect::Dialect::{Fanuc, Heidenhain, Iso, LinuxCnc};

use super::default_deny::{F, G, begin, check, left};
use super::{ends, listing_of};

#[test]
fn limits_of_motors_move_nothing() {
    let after = |body: &str| ends(&format!("{}{body}\n", begin(Iso)), Iso)[1..].to_vec();
    for setting in
        ["M205 X8 Y8", "M201 X500 Y500 Z100 E5000", "M203 X500 F20", "M204 P800 R1500", "N5 M205 X8 E2"]
    {
        assert_eq!(after(&format!("{setting}\nG1 X30")), [Ok([30.0, 2.0, 3.0])], "{setting}");
    }
    // Their effect on shifts or scales is unknown: steps per millimetre, origins.
    let unknown = &[left(UnknownWord), left(UnknownWord)];
    for word in ["M92 X80", "M206 X5", "M428", "M851 Z-1", "M125 X10 Y10"] {
        check(Iso, &[(&format!("{word}\n{G}"), unknown)]);
    }
    // A machine function beside a motion leaves it a motion.
    check(Iso, &[("G1 X5 M120\nX6 M8\nM8 X7", &[None, None, None])]);
    check(Fanuc, &[("X5. M205\nM211\nX6.", &[None, None])]);
}

#[test]
fn switched_kinematics_are_unknown() {
    let unknown = &[left(UnknownWord), left(UnknownWord)];
    for word in ["M428", "M429", "M430", "M129", "M68 E3 Q1", "M67 E3 Q0", "M68 E#1 Q1", "M300"] {
        check(LinuxCnc, &[(&format!("{word}\n{G}"), unknown)]);
    }
    check(LinuxCnc, &[("M101 P1\nX5", &[None])]);
}

#[test]
fn the_number_of_an_output_is_no_axis() {
    for dialect in [LinuxCnc, Iso] {
        check(dialect, &[("M67 E0 Q50\nM68 E1 Q1\nM66 E0 L0\nM62 P1\nX22", &[None])]);
    }
}

#[test]
fn the_angle_of_the_spindle_is_no_radius() {
    let listing = listing_of(
        "G90 G54\nG43.4 H0\nG1 X0. Y0. Z0. A180. B0. C0.\nG3 X20. Y0. I10. J0.\nM19 R90.\nG1 X30.\n",
        Fanuc,
    );
    assert_eq!(listing.motions.len(), 3);
    assert!(listing.motions.iter().all(|motion| motion.reason().is_none()), "{:?}", listing.motions);
}

#[test]
fn a_cycle_called_at_the_tool_position_is_listed() {
    for call in ["L R0 FMAX M99", "M99", "L M99"] {
        check(
            Heidenhain,
            &[(&format!("{call}\nL X+30\nL X+1 Y+1 Z+1"), &[left(Cycle), left(PositionUnknown), None])],
        );
    }
    // Cycle 12 replaces the cycle by a program.
    let program = "CYCL DEF 12.0 PGM CALL\nCYCL DEF 12.1 PGM OTHER.H";
    for call in ["M99", "CYCL CALL"] {
        let found = super::default_deny::reasons(Heidenhain, &format!("{program}\n{call}\nL X+30"));
        assert_eq!(found, [left(Subprogram), left(UnknownFlow)], "{call}");
    }
}

/// The class: an M word that moves stands in a block that has no other motion.
#[test]
fn a_retraction_in_a_block_of_its_own_is_a_motion() {
    for body in ["M140 MB MAX", "M140 MB+50 F500", "STOP M140 MB MAX", "CYCL CALL M140 MB MAX"] {
        let found = super::default_deny::reasons(Heidenhain, &format!("{body}\nL Y+5\nL X+1 Y+1 Z+1"));
        assert_eq!(found[found.len() - 2..], [left(PositionUnknown), None], "{body}");
        assert!(found.contains(&left(ReferenceReturn)), "{body}: {found:?}");
    }
    check(Heidenhain, &[("STOP M104\nL X+1 Y+1 Z+1", &[left(UnknownWord), left(UnknownWord)])]);
    check(Heidenhain, &[("STOP M5\nL X+5", &[None])]);
    // The name of a program is no M word.
    check(Heidenhain, &[("BEGIN PGM M140 MM\nL X+5", &[None])]);
}

#[test]
fn targets_of_haas_jumps_are_joins() {
    let local = "N5 X5.\nN1000 Y20.\nG0 X-40. Y-40.\nM97 P1000\nM30";
    let found = super::default_deny::reasons(Fanuc, local);
    assert_eq!(found[..3], [None, left(UnknownFlow), left(PositionUnknown)]);
    for jump in ["M96 P1000 Q3", "M98 P7 Q1000", "M98 P7 H1000", "M99 P1000", "M46 Q5 P1000", "M97 P#5"] {
        let found = super::default_deny::reasons(Fanuc, &format!("X5.\nN1000 Y20.\n{F}\n{jump}"));
        assert_eq!(found[1], left(UnknownFlow), "{jump}");
    }
    // A signal may call it at any time.
    check(Fanuc, &[(&format!("M96 P1000\n{F}"), &[left(UnknownFlow), left(UnknownFlow)])]);
}
