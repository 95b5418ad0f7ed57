//! A path that is left goes where it always went: its start and the words that it leaves out.

use truegrind::program::motion::Reason::*;
use truegrind::program::nc::dialect::Dialect::{self, Heidenhain, LinuxCnc, Siemens};

use super::certain::{HEAD, begin, check, left};
use super::{moved, rewrite_as};

/// The text after a rewrite of everything that can be, without its head.
fn rewritten(dialect: Dialect, body: &str) -> String {
    let source = format!("{HEAD}{}{body}\n", begin(dialect));
    let (text, _) = rewrite_as(&source, dialect, |listing| moved(listing, [0.5, -0.25, 0.125]));
    text[HEAD.len()..].lines().skip(begin(dialect).lines().count()).map(|line| format!("{line}\n")).collect()
}

#[test]
fn the_start_of_a_path_that_is_left_stays() {
    let path = left(BeforeLeftPath);
    let other = left(NotFollowed);
    check(
        Siemens,
        &[
            ("X10\nX20\nCIP X40 Y0 I1=30 J1=10 K1=50\nG1 X50 Y0 Z50", &[None, path, other, None]),
            // A path that goes on in the direction of the motion before needs the start of that as well.
            ("X10\nX20\nX30\nCT X60 Y10", &[None, path, path, other]),
            ("X10\nX20\nX30 ANG=45", &[None, path, other]),
        ],
    );
    check(
        Heidenhain,
        &[
            ("L X+10\nL X+20\nCC X+20 Y+10\nCP IPA+90 DR+", &[None, path, other]),
            ("L X+10\nL X+20\nL X+30\nCT X+50 Y+20", &[None, path, path, other]),
            ("L X+10\nL X+20\nRND R2", &[None, None, other]),
        ],
    );
    check(LinuxCnc, &[("X10\nX20\nG5.1 X30 Y5 I2 J3", &[None, path, other])]);
}

#[test]
fn words_that_such_a_path_leaves_out_hold_what_they_held() {
    assert_eq!(
        rewritten(Siemens, "X10\nX20\nCIP X40 Y0 I1=30 J1=10 K1=50"),
        "X10.5000\nX20 Y2.0000 Z3.0000\nCIP X40 Y0 I1=30 J1=10 K1=50\n"
    );
    assert_eq!(
        rewritten(Heidenhain, "L X+10\nL X+20\nCC X+20 Y+10\nCP IPA+90 DR+"),
        "L X+10.5000\nL X+20 Y+2.0000 Z+3.0000\nCC X+20 Y+10\nCP IPA+90 DR+\n"
    );
}

#[test]
fn a_tool_vector_that_is_left_out_is_said_again() {
    let source = format!(
        "{HEAD}G90 G71 G17 G54\nTRAORI\nG1 X10 Y0 Z50 A3=0 B3=0 C3=1 THETA=0 F600\nG1 X9 Y1 RND=2\nX10 Y0 Z50\n/X5\nX6 A3=0 B3=0 C3=1\n"
    );
    let (text, _) = rewrite_as(&source, Siemens, |listing| {
        let mut changes = moved(listing, [0.0; 3]);
        let turn = truegrind::program::nc::orientation::Angles::Wpr.rotation([180.4, 0.0, 0.3]);
        for change in &mut changes {
            if let truegrind::program::rewrite::NewTarget::Cartesian { quaternion, .. } =
                &mut change.targets[0]
            {
                *quaternion = [turn.w, turn.i, turn.j, turn.k];
            }
        }
        changes.retain(|change| change.motion != 4);
        changes
    });
    let lines: Vec<&str> = text.lines().collect();
    let line = |begin: &str| *lines.iter().find(|line| line.starts_with(begin)).unwrap();
    let again = "A3=0.0000000 B3=0.0000000 C3=1.0000000 THETA=0.000000";
    assert_eq!(line("G1 X9"), format!("G1 X9 Y1 {again} RND=2"));
    assert_eq!(line("/X5"), format!("/X5 {again}"));
    // After a block that may be skipped both are said.
    assert!(line("X6").contains("THETA="), "{text}");
}
