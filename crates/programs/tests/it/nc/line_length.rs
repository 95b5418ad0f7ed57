//! Lines that become longer than the control accepts.

use truegrind_programs::motion::Reason;
use truegrind_programs::nc::dialect::Dialect::{Fanuc, LinuxCnc, Siemens};
use truegrind_programs::rewrite::RewriteOutcome;

use super::default_deny::{HEAD, begin};
use super::{change_of, rewrite_as};

/// A file whose lines end with carriage returns alone counted as one line.
#[test]
fn lines_that_end_with_carriage_returns_are_lines() {
    for dialect in [Siemens, LinuxCnc] {
        let blocks: String = (0..60).map(|k| format!("X{k}. Y2. Z3.\n")).collect();
        let source = format!("{HEAD}{}{blocks}", begin(dialect)).replace('\n', "\r");
        let (text, rewritten) = rewrite_as(&source, dialect, |listing| {
            (1..50).map(|motion| change_of(listing, motion, [1.2345, 2.3456, 3.4567])).collect()
        });
        assert!(
            rewritten.outcomes.iter().all(|outcome| *outcome == RewriteOutcome::InPlace),
            "{dialect:?} {text}"
        );
    }
}

/// The class: a correction adds decimals and words until the line no longer fits the control, which refuses the file
/// or truncates the line. Such a motion is refused, and so is one whose end only a full line could restate.
#[test]
fn a_motion_whose_line_would_become_too_long_is_refused() {
    for (dialect, most) in [(Siemens, 512), (LinuxCnc, 253), (Fanuc, 2000)] {
        let comment = |text: &str, bytes: usize| format!("{text} ({})", "x".repeat(bytes - text.len() - 4));
        let comment = |text: &str, bytes: usize| match dialect {
            Siemens => comment(text, bytes).replace('(', ";").replace(')', "x"),
            _ => comment(text, bytes),
        };
        // Eight bytes are left for growth by seven or nine.
        for (block, fits) in [("X10. Y2. Z3.", true), ("X10. Y20. Z30.5", false)] {
            let full = comment(block, most - if fits { 40 } else { 4 });
            let source = format!("{HEAD}{}{full}\nX50. Y60. Z70.\n", begin(dialect));
            let by = [1.2345, 2.3456, 3.4567];
            let (text, rewritten) =
                rewrite_as(&source, dialect, |listing| (1..3).map(|m| change_of(listing, m, by)).collect());
            let stays = !fits && dialect != Fanuc;
            let expected =
                if stays { RewriteOutcome::Refused(Reason::LineTooLong) } else { RewriteOutcome::InPlace };
            assert_eq!(rewritten.outcomes[0], expected, "{dialect:?} {text}");
            assert_eq!(rewritten.outcomes[1], RewriteOutcome::InPlace, "{dialect:?}");
            assert_eq!(text.contains(&full), stays, "{dialect:?} {text}");
            assert!(dialect == Fanuc || text.lines().all(|line| line.len() < most), "{dialect:?} {text}");
        }
        // The full line restates Y and Z, which the motion before has changed.
        let full = comment("X10.", most - 4);
        let source = format!("{HEAD}{}X5. Y6. Z7.\n{full}\n", begin(dialect));
        let (text, rewritten) =
            rewrite_as(&source, dialect, |listing| vec![change_of(listing, 1, [1.2345, 2.3456, 3.4567])]);
        let expected = if dialect == Fanuc {
            RewriteOutcome::InPlace
        } else {
            RewriteOutcome::Refused(Reason::LineTooLong)
        };
        assert_eq!(rewritten.outcomes[0], expected, "{dialect:?} {text}");
    }
}
