//! The class: an unmodified word is relative to the end of a corrected motion (an origin set there, an increment, a
//! position that is read), and would lead elsewhere. The motion that ends there is refused, over all paths of control
//! flow.

use truegrind_programs::motion::Reason;
use truegrind_programs::nc::dialect::Dialect::{self, Fanuc, LinuxCnc, Siemens};
use truegrind_programs::rewrite::RewriteOutcome;

use super::default_deny::{HEAD, begin};
use super::{moved, rewrite_as};

/// The outcome of the first motion, if everything that can be changed is.
fn first(dialect: Dialect, body: &str) -> RewriteOutcome {
    let source = format!("{HEAD}{}{body}\n", begin(dialect));
    let (_, rewritten) = rewrite_as(&source, dialect, |listing| moved(listing, [1.5, -1.25, 0.75]));
    rewritten.outcomes[0].clone()
}

#[test]
fn an_origin_used_by_unmodified_words_pins_the_motion_that_ends_there() {
    let refused = RewriteOutcome::Refused(Reason::BeforeOrigin);
    for body in [
        "G92 X0. Y0. Z0.\n#103=0\nWHILE [#103 LT 2] DO1\nG1 X20. Y-30. A175.\n#103=#103+1\nEND1",
        "G92 X0. Y0. Z0.\nN10 G1 X20.\nIF [#1 EQ 0] GOTO 10",
        "G92 X0. Y0. Z0.\nG81 X5. Y5. Z-5. R2.",
        "G92 X0. Y0. Z0.\nM98 P1000",
        "/G92 X0. Y0. Z0.\nG1 X5. Y5. Z5.",
        "G92 X#501\nG1 X5. Y5. Z5.",
        "G92 A0.\nG1 X5. Y5. Z5. A10.",
        "G10 L20 P1 X0. Y0.\nG1 X5. Y5. Z5.",
    ] {
        assert_eq!(first(Fanuc, body), refused, "{body}");
    }
    assert_eq!(first(LinuxCnc, "G10 L20 P1 X0 Y0 Z0\nG1 X5 Y5 Z5"), refused);
    assert_eq!(first(LinuxCnc, "G92 X0\nG92.2\nG92.3\nG1 X5 Y5 Z5"), refused);
    assert_eq!(first(Siemens, "PRESETON(X,0)\nG1 X5 Y5 Z5"), refused);
    assert_eq!(first(Siemens, "TOFRAME\nG1 X5 Y5 Z5"), refused);
}

#[test]
fn unmodified_increments_and_position_reads_pin_the_motion_that_ends_there() {
    let refused = RewriteOutcome::Refused(Reason::BeforeIncrement);
    for body in [
        "#103=0\nWHILE [#103 LT 2] DO1\nG91 G1 X20.\n#103=#103+1\nEND1",
        "#1=#5041\nG1 X#1",
        "G1 X[#5041+5.]",
        // Behind the correction the other branch would run.
        "IF[#5041 GT 0.8]GOTO 10\nG1 X5.\nN10",
        "WHILE [#5041 LT 0.8] DO1\nG91 G0 X20.\nEND1",
    ] {
        assert_eq!(first(Fanuc, body), refused, "{body}");
    }
    assert_eq!(first(Siemens, "R1=$AA_IM[X]\nG1 X=R1"), refused);
    assert_eq!(first(Siemens, "IF $AA_IW[X]>0.8 GOTOF M_1\nG1 X5\nM_1:"), refused);
    assert_eq!(first(LinuxCnc, "o1 if [#5420 LT 0.8]\nG1 X5\no1 endif"), refused);
}

/// G98, the state at power-on, leads back to the level before the cycle.
#[test]
fn a_line_behind_a_canned_cycle_keeps_the_level_at_which_the_cycle_began() {
    for (dialect, body, reason) in [
        (Fanuc, "G81 X5. Y5. Z-3. R2. F200.\nG80\nG1 X20. Y0.\nX-20.", Reason::BeforeOmitted),
        (Fanuc, "G98 G81 X5. Y5. Z-3. R2. F200.\nG3 X10. Y-10. R12.", Reason::BeforeIncrement),
        (LinuxCnc, "G98 G81 X5 Y5 Z-3 R2 F200\nG80\nG1 X20 Y0", Reason::BeforeOmitted),
    ] {
        assert_eq!(first(dialect, body), RewriteOutcome::Refused(reason), "{body}");
    }
    // The line states where it ends, and how the tool is turned.
    let stated = "G81 X5. Y5. Z-3. R2. F200.\nG80\nG1 X20. Y0. Z5. A180. B0. C0.";
    assert_eq!(first(Fanuc, stated), RewriteOutcome::InPlace);
}

/// A left block that only turns the tool ends where the motion before does, in whatever way orientations are stated.
#[test]
fn a_block_that_only_turns_takes_over_the_position() {
    for (dialect, body) in [
        (Fanuc, "M98 P200\nM30\nO0200\nC-10.\nM99"),
        (Siemens, "IF (R3)<=0 GOTOF M_1\nG70\nM_1:\nTHETA=5"),
        (Siemens, "IF (R3)<=0 GOTOF M_1\nG70\nM_1:\nA3=0 B3=0 C3=1"),
    ] {
        assert_eq!(first(dialect, body), RewriteOutcome::Refused(Reason::BeforeOmitted), "{body}");
    }
}

#[test]
fn restated_or_independent_words_pin_nothing() {
    for body in [
        "G92 X0. Y0. Z0.\nG1 X20. Y-30. Z5.",
        "G92 X0. Y0. Z0.\nG92 X0. Y0. Z0.\nG52 X0. Y0. Z0.",
        "G91 G28 Z0.",
        "G0 G53 Z0.",
        "G91 G1 X5.",
        "G54",
    ] {
        assert_eq!(first(Fanuc, body), RewriteOutcome::InPlace, "{body}");
    }
}

/// An inserted block is read with the state before the block that it precedes.
#[test]
fn no_block_is_inserted_before_one_that_changes_word_semantics() {
    for (body, free) in [("G1 X9. Y9. Z9.", true), ("G20 G1 X1. Y1. Z1.", false)] {
        let source = format!("{HEAD}{}{body}\n", begin(Fanuc));
        let setup = truegrind_programs::nc::setup::Setup { dialect: Some(Fanuc), ..Default::default() };
        let task = truegrind_programs::nc::Task::read(&[("x", source.as_bytes())], &setup);
        assert_eq!(task.listing.motions[1].insertable, free, "{body}");
    }
}

/// The class: a block that may be skipped restates corrected words, so that the tool is at one of two positions. An
/// increment from there is right on one path only: nothing is corrected there.
#[test]
fn an_increment_after_a_skippable_block_pins_the_motion_before() {
    let refused = RewriteOutcome::Refused(Reason::BeforeIncrement);
    for body in ["/Y-10\nX=IC(5) Y-7", "/A=175\nX4 A=IC(5)", "/Z7\nG91 X5 Y1 Z1", "/Y-10\nG91 Z4"] {
        assert_eq!(first(Siemens, body), refused, "{body}");
    }
    assert_eq!(first(Fanuc, "/Y-10.\nG91 X5."), refused);
    assert_eq!(first(LinuxCnc, "/Y-10\nG91 X5"), refused);
    // An absolute value does not depend on the position.
    assert_eq!(first(Siemens, "/Y-10\nX5 Y-7"), RewriteOutcome::InPlace);
}
