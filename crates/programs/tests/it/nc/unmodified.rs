//! An unmodified path does not change: neither its start nor the words that it omits.

use proptest::prelude::*;
use truegrind_programs::motion::Reason::*;
use truegrind_programs::nc::Task;
use truegrind_programs::nc::dialect::Dialect::{self, Fanuc, Heidenhain, LinuxCnc, Siemens};
use truegrind_programs::nc::setup::Setup;
use truegrind_programs::rewrite::RewriteOutcome;

use super::default_deny::{HEAD, begin, check, left};
use super::{moved, rewrite_as};

/// The text after a rewrite of everything possible, without its head.
fn rewritten(dialect: Dialect, body: &str) -> String {
    let source = format!("{HEAD}{}{body}\n", begin(dialect));
    let (text, _) = rewrite_as(&source, dialect, |listing| moved(listing, [0.5, -0.25, 0.125]));
    text[HEAD.len()..].lines().skip(begin(dialect).lines().count()).map(|line| format!("{line}\n")).collect()
}

#[test]
fn the_start_of_an_unmodified_path_is_pinned() {
    let path = left(BeforeUnmodifiedPath);
    let other = left(UnsupportedPath);
    check(
        Siemens,
        &[
            ("X10\nX20\nCIP X40 Y0 I1=30 J1=10 K1=50\nG1 X50 Y0 Z50", &[None, path, other, None]),
            // A tangential path also needs the start of the motion before.
            ("X10\nX20\nX30\nCT X60 Y10", &[None, path, path, other]),
            ("X10\nX20\nX30 ANG=45", &[None, path, other]),
        ],
    );
    check(
        Heidenhain,
        &[
            ("L X+10\nL X+20\nCC X+20 Y+10\nCP IPA+90 DR+", &[None, path, other]),
            ("L X+10\nL X+20\nL X+30\nCT X+50 Y+20", &[None, path, path, other]),
            ("L X+10\nL X+20\nRND R2", &[path, left(RoundedCorner), left(RoundedCorner)]),
        ],
    );
    check(LinuxCnc, &[("X10\nX20\nG5.1 X30 Y5 I2 J3", &[None, path, other])]);
}

/// A control rounds or chamfers a corner in its working plane alone, which corrected lines leave: both its lines stay, and where the first begins.
/// On a Heidenhain they were corrected, and under RNDM all but the line with that word.
#[test]
fn rounded_corners_keep_their_lines() {
    let (path, corner) = (left(BeforeUnmodifiedPath), left(RoundedCorner));
    check(
        Siemens,
        &[
            ("X10\nX20 RND=2\nY30\nX40", &[path, corner, corner, None]),
            ("X10\nX20 CHF=2\nM8\nY30\nX40", &[path, corner, corner, None]),
            // A corner of no size is none.
            ("X10\nX20 RND=0\nY30 CHF=0\nX40", &[None, None, None, None]),
            ("RNDM=2\nX10\nX20\nRNDM=0\nX30\nX40", &[corner, corner, corner, None]),
        ],
    );
    check(Fanuc, &[("X10.\nX20. ,R0\nY30.", &[None, None, None])]);
    check(Fanuc, &[("X10.\nX20. ,R2.\nY30. ,C1.\nX40.\nX50.", &[path, corner, corner, corner, None])]);
    check(Heidenhain, &[("L X+10\nL X+20\nRND R2\nL Y+30\nL X+40", &[path, corner, corner, corner, None])]);
}

/// After a rotation of the frame, a path that needs one axis depends on every axis of the motions before.
#[test]
fn a_rotated_frame_mixes_the_axes_of_a_dependency() {
    let (path, open) = (left(BeforeUnmodifiedPath), left(PositionUnknown));
    let cip = "CIP X40 Y0 I1=30 J1=10 K1=50";
    let turned = format!("X10 Y5\n$P_PFRAME=CTRANS(X,10)\nX20\nAROT Z90\nY=30 Z5\n{cip}");
    let plain = format!("X10 Y5\nX20 Y10 Z1\nX30 Y12 Z2\n{cip}");
    let listed = [path, open, open, left(UnsupportedPath)];
    // Without a rotation the axes are independent: a motion that states all of them ends where it states.
    check(Siemens, &[(&turned, &listed), (&plain, &[None, None, path, left(UnsupportedPath)])]);
}

/// The same after a jump: the dependencies of an unmodified path are tracked over every path to it.
#[test]
fn a_rotated_frame_mixes_the_axes_across_a_jump() {
    let body = |line: &str, turn: &str| {
        format!(
            "R2=5\nX10 Y5 Z1\nIF R2<>0 GOTOF M_1\nX11 Y6 Z2\nM_1:\nG1 {line}\n{turn}\nY=R2\n\
             CIP X40 Y0 Z9 I1=30 J1=10 K1=50"
        )
    };
    let kept = |line: &str, turn: &str| rewritten(Siemens, &body(line, turn)).contains("X10 Y5 Z1\n");
    assert!(kept("X20 Z4", "AROT Z90"));
    assert!(kept("X20 Z4", "G4 F1"), "it ends in Y where the motions before do");
    assert!(!kept("X20 Y7 Z4", "G4 F1"), "each axis is stated");
}

#[test]
fn omitted_words_of_unmodified_paths_keep_their_values() {
    assert_eq!(
        rewritten(Siemens, "X10\nX20\nCIP X40 Y0 I1=30 J1=10 K1=50"),
        "X10.5000\nX20 Y2.0000 Z3.0000\nCIP X40 Y0 I1=30 J1=10 K1=50\n"
    );
    assert_eq!(
        rewritten(Heidenhain, "L X+10\nL X+20\nCC X+20 Y+10\nCP IPA+90 DR+"),
        "L X+10.5000\nL X+20 Y+2.0000 Z+3.0000\nCC X+20 Y+10\nCP IPA+90 DR+\n"
    );
}

/// The class: a block that may be skipped states an axis that the motion before has changed. The next block restates
/// it, so that an origin set there, or a motion that omits the axis, is unchanged.
#[test]
fn words_of_a_skippable_block_are_restated() {
    let text = rewritten(LinuxCnc, "X10\n/X10\nY5\nG5.1 X30 Y15 I2 J3");
    let lines: Vec<&str> = text.lines().collect();
    assert!(lines[0].starts_with("X10.5000") && lines[1].starts_with("/X10"), "{text}");
    assert!(lines[2].contains("X10.0000"), "{text}");
}

#[test]
fn a_cycle_runs_at_its_original_position() {
    assert_eq!(rewritten(Heidenhain, "L X+4 M99\nL IX+2 M99"), "L X+4 Y+2.0000 Z+3.0000 M99\nL IX+2 M99\n");
}

/// The lift between a corrected cut and a cycle stays at the corrected place in the axes that the cycle states: put back there, it left the
/// finished contour sideways.
#[test]
fn a_lift_before_a_cycle_goes_straight_up() {
    // The level to which the cycle returns is that of the lift, so that the lift is not corrected.
    let lines = |dialect, lift: &str, cycle: &str, after: &str| {
        let text = rewritten(dialect, &format!("X10 Y5\n{lift}\n{cycle}\nG80\n{after}"));
        text.lines().map(str::to_owned).collect::<Vec<_>>()
    };
    for (cycle, lift) in [
        ("G81 X30 Y20 Z-3 R2", "G0 Z5"),
        ("G81 X30 Y20 Z-3 R2\nX40\nY30", "G0 Z5"),
        ("G81 X30 Z-3 R2", "G0 Y5.0000 Z5"),
        ("G81 Z-3 R2", "G0 X10.0000 Y5.0000 Z5"),
        ("G91 G81 X20 Y15 Z-5 R-3\nG90", "G0 X10.0000 Y5.0000 Z5"),
        ("/G81 X30 Y20 Z-3 R2", "G0 X10.0000 Y5.0000 Z5"),
        ("G17 G90\nG81 X30 Y20 Z-3 R2", "G0 Z5"),
    ] {
        let found = lines(LinuxCnc, "G0 Z5", cycle, "G0 X60 Y0");
        assert_eq!(found[..2], ["X10.5000 Y4.7500", lift], "{cycle}");
        let unchanged: Vec<&str> = cycle.lines().chain(["G80", "G0 X60 Y0"]).collect();
        assert_eq!(found[2..], unchanged, "{cycle}");
    }
    // G53 states no place of the work object.
    assert_eq!(lines(LinuxCnc, "G53 G0 Z5", "G81 X30 Y20 Z-3 R2", "G0 X60 Y0")[1], "G53 G0 Z5");
    assert_eq!(lines(Fanuc, "G0 Z5.", "G81 X30. Y20. Z-3. R2. F100.", "G0 X60. Y0.")[1], "G0 Z5.");
}

#[test]
fn blocks_that_accept_no_added_words_are_unmodified() {
    for block in ["X+20 R+", "LN X+20 NX+0.1 NY+0 NZ+0.995"] {
        let body = format!("L X+4 Y+5\nL X+10\n{block}\nL X+1 R0\n");
        let expected = format!("L X+4.5000 Y+4.7500\nL X+10 Y+5.0000 Z+3.0000\n{block}\nL X+1 R0\n");
        let found = rewritten(Heidenhain, &body);
        let lines = |text: &str| text.lines().take(3).map(str::to_owned).collect::<Vec<_>>();
        assert_eq!(lines(&found), lines(&expected), "{block}");
    }
    let all = "LN X+20 Y+5 Z+3 NX+0.1 NY+0 NZ+0.995";
    let text = rewritten(Heidenhain, &format!("L X+4 Y+5\n{all}"));
    assert_eq!(text, format!("L X+4.5000 Y+4.7500\n{all}\n"));
}

#[test]
fn a_displaced_g92_shift_moves_no_unmodified_motion() {
    // G92 names a position X0 that is now displaced by 0.5 mm; G52 states its shift in full.
    assert_eq!(rewritten(LinuxCnc, "G92 X0\nX10\nG52 X4\nX3"), "G92 X0\nX10\nG52 X4\nX3.5000\n");
    assert_eq!(rewritten(LinuxCnc, "G92 X0\n/X7"), "G92 X0\n/X6.5000 Y2.0000 Z3.0000\n");
}

#[test]
fn an_omitted_tool_vector_is_restated() {
    let source = format!(
        "{HEAD}G90 G71 G17 G54\nTRAORI\nG1 X10 Y0 Z50 A3=0 B3=0 C3=1 THETA=0 F600\n/G1 X9 Y1\nX10 Y0 Z50\n/X5\nX6 A3=0 B3=0 C3=1\n"
    );
    let (text, _) = rewrite_as(&source, Siemens, |listing| {
        let mut changes = moved(listing, [0.0; 3]);
        let turn = truegrind_programs::nc::orientation::Angles::Wpr.rotation([180.4, 0.0, 0.3]);
        for change in &mut changes {
            if let truegrind_programs::rewrite::NewTarget::Cartesian { quaternion, .. } =
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
    assert_eq!(line("/G1 X9"), format!("/G1 X9 Y1 {again}"));
    assert_eq!(line("/X5"), format!("/X5 {again}"));
    // After a block that may be skipped both are stated.
    assert!(line("X6").contains("THETA="), "{text}");
}

/// The class: omitted words are taken from values that the control does not store. Where a vector, angles of axes or
/// A2, B2, C2 state the orientation, the words of the other two have no known values.
#[test]
fn angles_before_a_tool_vector_are_unknown_after_it() {
    for (dialect, turn, block) in [
        (Heidenhain, "LN X+4 Y+5 Z+6 TX+0 TY+0 TZ+1", "L X+7 Y+8 Z+9 B+10"),
        (Siemens, "X4 Y5 Z6 A3=0 B3=0 C3=1", "X7 Y8 Z9 B=10"),
        (Siemens, "X4 Y5 Z6 A2=180 B2=0 C2=0", "X7 Y8 Z9 B=10"),
    ] {
        let text = rewritten(dialect, &format!("{turn}\n{block}"));
        assert_eq!(text.lines().last(), Some(block), "{text}");
    }
    // An increment with unknown orientation is unmodified, and so is the motion that it is relative to.
    let text = rewritten(Heidenhain, "LN X+4 Y+5 Z+6 TX+0 TY+0 TZ+1\nL IX-10 B+0");
    assert_eq!(text, "LN X+4 Y+5 Z+6 TX+0 TY+0 TZ+1\nL IX-10 B+0\n");
}

/// The class: a word that the control may ignore, because its variable has never been set, is taken as stated. The
/// block might not move at all: no word is added to it, and it and what starts there depend on the motion before.
#[test]
fn a_block_that_might_not_move_gets_no_words() {
    let head = "X4. Y5. Z6.\n";
    for block in ["G0 Y#149", "G1 X10. Y#149", "G1 A#149", "/G0 Y#149", "G0 Z-#149"] {
        let text = rewritten(Fanuc, &format!("{head}{block}\nG1 X7. Y8. Z9. A180. B0. C0."));
        let lines: Vec<&str> = text.lines().collect();
        // The block itself would end beside where it did.
        assert_eq!(lines[..2], ["X4. Y5. Z6.", block], "{text}");
        assert_eq!(lines[2], "G1 X7.5000 Y7.7500 Z9.1250 A180. B0. C0.");
    }
    // An unmodified arc starts at the end of such a block, or of the one before it.
    let text = rewritten(Fanuc, &format!("{head}G0 Y#149\nG2 X14. Y5. I5."));
    assert_eq!(text, "X4. Y5. Z6.\nG0 Y#149\nG2 X14. Y5. I5.\n");
    // A variable that is set has a value.
    let text = rewritten(Fanuc, &format!("{head}#149=7.\n/G0 Y#149"));
    assert_eq!(text.lines().last(), Some("/G0 X4.0000 Y#149 Z6.0000"), "{text}");
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(600))]
    #[test]
    fn whatever_is_left_starts_where_it_started(
        blocks in proptest::collection::vec(0_usize..26, 1..12), dialect in 0_usize..3, increments in any::<bool>(),
    ) {
        let (dialect, pieces): (Dialect, &[&str]) = match dialect {
            0 => (Siemens, &[
                "X10", "X20 Y5", "Z7", "G1 X9 Y1 Z2", "G91 X1 Y1", "G90 X3", "CIP X40 Y0 I1=30 J1=10 K1=50", "CT X6 Y1", "G1 X5", "G2 X15 Y2 I5 J0",
                "G3 X5 Y2 CR=6", "X30 ANG=45", "X5 RND=1", "X7 F50", "A=170", "A3=0 B3=0 C3=1 X2", "THETA=5 Y3", "TRANS X5", "TRANS", "CYCLE81(5,0,2,-5)",
                "G0 X1 Y2 Z3 A=180 B=0 C=0", "X=R5", "POLY X3", "G33 Z5 K1",
            ]),
            1 => (Heidenhain, &[
                "L X+10", "L X+20 Y+5", "L IZ+7", "L X+9 Y+1 Z+2 A+180 B+0 C+0", "CC X+20 Y+10", "CP IPA+90 DR+", "C X+30 Y+2 DR+", "CR X+15 Y+8 R+10 DR-",
                "CT X+6 Y+1", "RND R2", "APPR LT X+5 Y+5 LEN5", "DEP LT LEN5", "L X+7 F50", "L A+170", "M99", "L X+4 M99", "L X+5 M129", "M128", "FC DR+ R5",
                "CYCL DEF 7.1 X+5", "L X+3 M", "LP PR+5 PA+3", "TRANS DATUM RESET", "L X+5 RL",
            ]),
            _ => (LinuxCnc, &[
                "X10", "X20 Y5", "Z7", "G1 X9 Y1 Z2", "G91 X1 Y1", "G90 X3", "G5.1 X30 Y5 I2 J3", "G5 X5 Y5 I1 J1 P1 Q1", "G1 X5", "G2 X15 Y2 I5 J0",
                "G3 X5 Y2 R6", "G3 I5", "X7 F50", "A170", "X8 F9", "G92.1", "G52 X4", "G33 Z5 K1", "G81 Z-5 R2", "G80 G1", "G0 X1 Y2 Z3 A180 B0 C0", "X#5",
                "M66 E0", "G28", "G0 Z9", "G81 X6 Y7 Z-5 R2",
            ]),
        };
        let mut body: String = blocks.iter().map(|&block| format!("{}\n", pieces[block % pieces.len()])).collect();
        // After a shift more is known in programs without them.
        if !increments {
            body = body.replace("G91 ", "").replace("L IZ", "L Z").replace("CP IPA+90 DR+\n", "");
        }
        let source = format!("{HEAD}{}{body}", begin(dialect));
        let by = [0.5, -0.25, 0.125];
        let (text, rewritten) = rewrite_as(&source, dialect, |listing| moved(listing, by));
        let setup = Setup { dialect: Some(dialect), ..Setup::default() };
        let before = Task::read(&[("x", source.as_bytes())], &setup);
        let after = Task::read(&[("x", text.as_bytes())], &setup);
        prop_assert_eq!(before.listing.motions.len(), after.listing.motions.len(), "{}", text);
        let changes = moved(&before.listing, by);
        let taken = |index: usize| {
            changes.iter().zip(&rewritten.outcomes).any(|(change, outcome)| {
                change.motion as usize == index && !matches!(outcome, RewriteOutcome::Refused(_))
            })
        };
        let end = |task: &Task<'_>, index: usize| {
            let target = *task.listing.motions[index].to()?.value.ok()?.cartesian()?;
            Some((target.position_mm, target.quaternion))
        };
        for (index, (old, new)) in before.listing.motions.iter().zip(&after.listing.motions).enumerate() {
            prop_assert_eq!(old.reason(), new.reason(), "{}\n{}", source, text);
            let (Some((a, qa)), Some((b, qb))) = (end(&before, index), end(&after, index)) else { continue };
            let at = |axis: usize| a[axis] + if taken(index) { by[axis] } else { 0.0 };
            // Before a cycle a rapid motion keeps the axes that it omits and the cycle states.
            let is_lift = !taken(index)
                && before.listing.motions.get(index + 1).is_some_and(|next| next.own_reason == Some(Cycle))
                && &*old.instruction == "G0";
            let off = |axis: usize| {
                let off = (b[axis] - at(axis)).abs();
                if is_lift { off.min((b[axis] - at(axis) - by[axis]).abs()) } else { off }
            };
            let off = (0..3).map(off).fold(0.0, f64::max);
            prop_assert!(off < 1e-3, "motion {} is off by {}\n{}\n{}", index, off, source, text);
            prop_assert!((0..4).all(|i| (qa[i] - qb[i]).abs() < 1e-6), "motion {}\n{}\n{}", index, source, text);
            // At the start of a path that is neither line nor arc nothing has moved.
            let path = before.listing.motions.get(index + 1);
            if let Some(path) = path
                && path.own_reason == Some(UnsupportedPath)
                && !["RND", "G1", "G0"].contains(&&*path.instruction)
            {
                prop_assert!(!taken(index), "motion {}\n{}\n{}", index, source, text);
            }
        }
    }
}

/// An unmodified block that gets no words ends in the axes that it omits where the motion before has led: holes of a cycle at the
/// tool position, lines in polar coordinates, blocks behind a word that the reader does not know.
#[test]
fn a_motion_stays_whose_end_an_unmodified_block_takes_over() {
    let stays = |dialect, body: &str| {
        rewritten(dialect, body).lines().next().unwrap() == body.lines().next().unwrap()
    };
    for (dialect, body) in [
        (Fanuc, "X4. Y5. Z6.\nG83 Z-5. Q1. R2. F200.\nG80\nG1 X9. Y9. Z9."),
        (Fanuc, "X4. Y5. Z6.\nG81 X7. Z-5. R2. F200.\nG80\nG1 X9. Y9. Z9."),
        (LinuxCnc, "X4 Y5 Z6\nG81 Z-5 R2 F200\nG80\nG1 X9 Y9 Z9"),
        (Siemens, "X4 Y5 Z6\nG111 X0 Y-20\nAP=30 RP=10\nG1 X9 Y9 Z9"),
    ] {
        assert!(stays(dialect, body), "{body}");
    }
    // Where the cycle states its hole, nothing of the motion before is taken over.
    for (dialect, body) in [
        (Fanuc, "X4. Y5. Z6.\nG81 X7. Y8. Z-5. R2. F200.\nG80\nG1 X9. Y9. Z9."),
        (Fanuc, "X4. Y5. Z6.\nG53 G0 Z0.\nG1 X9. Y9. Z9."),
    ] {
        assert!(!stays(dialect, body), "{body}");
    }
}

/// A turn alone has its feed in degrees per minute: with a word of X, Y or Z it would be millimetres, and some ten times as fast.
#[test]
fn a_turn_alone_gets_no_words() {
    for dialect in [LinuxCnc, Fanuc] {
        let body = "G1 X4. Y5. Z6. F600.\nX5.\nA175.\nX6. Y6. Z6. A180. B0. C0.";
        let text = rewritten(dialect, body);
        let lines: Vec<&str> = text.lines().collect();
        // The motion before stays as well, since the turn would take its end over.
        assert_eq!(lines[1..3], ["X5. Y5.0000 Z6.0000", "A175."], "{text}");
        assert!(lines[3].starts_with("X6.5"), "{text}");
        // In rapid traverse no feed counts.
        let rapid = rewritten(dialect, "G1 X4. Y5. Z6. F600.\nG0 A175.");
        assert!(rapid.starts_with("G1 X4.5"), "{rapid}");
    }
    let turn = left(TurnAlone);
    check(Siemens, &[("X5\nA=175\nX6 A=176", &[None, turn, None])]);
    check(Heidenhain, &[("L X+5\nL A+175\nL A+176 FMAX", &[None, turn, None])]);
}
