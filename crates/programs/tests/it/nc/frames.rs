//! Work offsets, shifts and tools, as each control treats them.

use truegrind_programs::motion::Reason::*;
use truegrind_programs::nc::Task;
use truegrind_programs::nc::dialect::Dialect::{Fanuc, Heidenhain, Iso, LinuxCnc, Siemens};
use truegrind_programs::nc::setup::Setup;

use super::default_deny::{F, G, HEAD, S, begin, check, left, reasons};
use super::{change_of, ends, listing_of, moved, rewrite_as};

const L: &str = "L X+5 Y+5 Z+5 A+180 B+0 C+0";

#[test]
fn a_number_beside_a_work_offset_is_not_ignored() {
    check(
        Fanuc,
        &[
            (&format!("G54 P2\n{F}\nG54\n{F}"), &[left(WorkObjectUnknown), None]),
            // The number belongs to the call or the dwell.
            (&format!("G54 M98 P1000\n{F}"), &[left(Subprogram), None]),
            (&format!("G54 G4 P500\n{F}"), &[None]),
        ],
    );
    check(Iso, &[(&format!("G54 P2\n{G}"), &[left(WorkObjectUnknown)])]);
    let named = "(truegrind frame G54 P2 w [[500,0,0],[1,0,0,0]])";
    check(Fanuc, &[(&format!("{named}\nG54 P2\n{F}"), &[None])]);
}

#[test]
fn offsets_in_g91_are_absolute_on_linuxcnc() {
    let body = "G90 G54\nG10 L2 P1 X350 Y0 Z250 R0\nG91 G10 L2 P1 X10 Y1 Z2\nG90\nG1 X1 Y2 Z3 A180 B0 C0\n";
    let at = |dialect| {
        let listing = listing_of(body, dialect);
        let motion = listing.motions.last().unwrap();
        listing
            .work_object(motion)
            .unwrap()
            .value
            .as_ref()
            .map(|value| value.user_frame.position_mm)
            .map_err(|r| *r)
    };
    assert_eq!(at(LinuxCnc), Ok([10.0, 1.0, 2.0]));
    // A plain file may be for either.
    assert_eq!(at(Iso), Err(Assigned));
}

#[test]
fn a_shift_within_a_shift_is_unknown() {
    let shifted = left(Displacement);
    check(
        Fanuc,
        &[
            ("G92 X100. Y0. Z50.\nG52 X5.\nG1 X100. Y0. Z50.", &[shifted]),
            ("G52 X5.\nG92 X100.\nX101.\nG52 X0.\nX5. Y5. Z5.", &[None, shifted]),
            ("G52 X5.\nG52 X6.\nX5. Y5. Z5. A180. B0. C0.", &[None]),
            // Only the named axes lose their shift.
            (&format!("G92 X0. Y0.\nG92.1 X0.\n{F}"), &[shifted]),
            (&format!("G92 X0. Y0.\nG92.1 X0. Y0. Z0.\n{F}"), &[None]),
            (&format!("G92 X0. Y0.\nG92.1\n{F}"), &[shifted]),
            (&format!("G92.1\n{F}"), &[None]),
        ],
    );
    let found =
        ends(&format!("{}G92 X0 Y0\nG52 X5\nX1\nG92.1\nX1 Y1 Z1 A180 B0 C0\n", begin(LinuxCnc)), LinuxCnc);
    assert_eq!(found[1..], [Ok([6.0, 2.0, 3.0]), Ok([1.0, 1.0, 1.0])]);
}

#[test]
fn a_preset_may_cancel_the_datum_shift() {
    let preset = "; truegrind frame PRESET2 w [[600,0,0],[1,0,0,0]]\n";
    let shift = "CYCL DEF 7.0 DATUM SHIFT\nCYCL DEF 7.1 X+40";
    let next = "CYCL DEF 247 DATUM SETTING Q339=+2";
    check(
        Heidenhain,
        &[
            (&format!("{preset}{shift}\n{next}\n{L}"), &[left(Displacement)]),
            (&format!("{preset}{next}\n{L}"), &[None]),
            (&format!("{preset}{shift}\n{next}\nTRANS DATUM RESET\n{L}"), &[None]),
            (&format!("{preset}{shift}\n{next}\nCYCL DEF 7.1 X+0 Y+0 Z+0\n{L}"), &[None]),
            (&format!("{preset}{shift}\n{next}\nCYCL DEF 7.1 X+0\n{L}"), &[left(Transformed)]),
        ],
    );
}

#[test]
fn data_written_by_the_program_override_the_setup() {
    let w = left(WorkObjectAssigned);
    check(
        Heidenhain,
        &[
            (&format!("FN 25: PRESET = X / +0 / +100\n{L}"), &[w]),
            (&format!("M143\n{L}"), &[w]),
            (&format!("FN 17: SYSWRITE ID 220 NR2 IDX1 = +10\n{L}"), &[left(UnknownWord), left(UnknownWord)]),
            (&format!("FN17: SYSWRITE ID 220 NR2 IDX1 = +10\n{L}"), &[left(UnknownWord), left(UnknownWord)]),
            (&format!("M114\n{L}"), &[left(UnknownWord), left(UnknownWord)]),
            (&format!("FN 18: SYSREAD Q1 = ID270 NR1 IDX1\n{L}"), &[None]),
        ],
    );
    // In G70 the control's own data keep their unit.
    let t = left(ToolAssigned);
    check(
        Siemens,
        &[
            (&format!("G70\n$TC_DP3[1,1]=2\nG71\nT1 D1\nG54\n{S}"), &[t]),
            (&format!("G71\n$TC_DP3[1,1]=2\nT1 D1\nG54\n{S}"), &[None]),
            // The active tool keeps its lengths until it is selected again; each length of an unstated tool must be
            // set.
            (&format!("T1 D1\n$TC_DP3[1,1]=2\nG54\n{S}"), &[t]),
            (&format!("$TC_DP3[7,1]=2\nT7 D1\nG54\n{S}"), &[left(ToolUnknown)]),
            (&format!("$TC_DP3[7,1]=2\n$TC_DP4[7,1]=0\n$TC_DP5[7,1]=1\nT7 D1\nG54\n{S}"), &[None]),
            (&format!("G70\n$P_UIFR[1]=CTRANS(X,1)\nG71\nG54\n{S}"), &[w]),
        ],
    );
}

#[test]
fn a_tool_is_active_after_the_tool_change() {
    let tool = |body: &str| {
        let listing = listing_of(&format!("G90 G54\n{body}\nG1 X1 Y2 Z3 A180 B0 C0\n"), LinuxCnc);
        listing.tool(listing.motions.last().unwrap()).unwrap().name.clone()
    };
    assert_eq!(tool("T5"), "T0");
    assert_eq!(tool("T5 M6"), "T5");
    assert_eq!(tool("T5\nM61 Q7"), "T7");
    assert_eq!(tool("M61 Q#1"), "T?");
}

#[test]
fn a_shift_rotates_nothing() {
    check(
        Heidenhain,
        &[
            ("CYCL DEF 7.0 DATUM SHIFT\nCYCL DEF 7.1 X+10\nL X+10 Y+0 Z+50", &[None]),
            ("TRANS DATUM AXIS X+10\nL X+10 Y+0 Z+50\nTRANS DATUM RESET\nL X+10 Y+0 Z+50", &[None, None]),
            ("CYCL DEF 7.1 #5\nL X+10", &[left(Transformed)]),
        ],
    );
}

/// The class: after a shift a block states some axes. The others stand where they stood. Whether an increment begins there or at the
/// same coordinate in the shifted frame is a setting of the control, so nothing is known in a program with increments.
#[test]
fn axes_that_a_block_omits_after_a_shift_stand_where_they_stood() {
    let cases = [
        (Siemens, "X10 Y2 Z50\nTRANS X5 Y4\nX0\n", [0.0, -2.0, 50.0]),
        (Siemens, "X10 Y2 Z50\nTRANS X5\nATRANS X1 Y4\nZ7\n", [4.0, -2.0, 7.0]),
        (Siemens, "TRANS X5\nX10 Y2 Z50\nTRANS\nY1\n", [15.0, 1.0, 50.0]),
        (Siemens, "ROT Z90\nX10 Y2 Z50 A=180 B=0 C=0\nATRANS X5\nZ1\n", [5.0, 2.0, 1.0]),
        (
            Heidenhain,
            "L X+10 Y+2 Z+50\nCYCL DEF 7.0 DATUM SHIFT\nCYCL DEF 7.1 X+5\nCYCL DEF 7.2 Y+4\nL X+0\n",
            [0.0, -2.0, 50.0],
        ),
        (Heidenhain, "L X+10 Y+2 Z+50\nTRANS DATUM AXIS Z+7\nL X+0\n", [0.0, 2.0, 43.0]),
        (Heidenhain, "TRANS DATUM AXIS Z+7\nL X+10 Y+2 Z+43\nTRANS DATUM RESET\nL X+1\n", [1.0, 2.0, 50.0]),
    ];
    for (dialect, body, expected) in cases {
        let source = format!("{HEAD}{}{body}", begin(dialect));
        let setup = Setup { dialect: Some(dialect), ..Setup::default() };
        let task = Task::read(&[("x", source.as_bytes())], &setup);
        let end = task.listing.motions.last().unwrap().to().unwrap().value.unwrap();
        let off = |axis: usize| (end.cartesian().unwrap().position_mm[axis] - expected[axis]).abs();
        assert!((0..3).all(|axis| off(axis) < 1e-9), "{body}: {end:?}");
    }
    let unknown = left(PositionUnknown);
    check(
        Siemens,
        &[
            ("TRANS X5\nX=IC(1)\nX7", &[unknown, unknown]),
            ("TRANS X5\nY5\nX7 Z1\nX1\nG91 X1\nG90", &[unknown, None, None, None]),
        ],
    );
    check(Heidenhain, &[("CYCL DEF 7.1 X+10\nL X+5\nL IX+1", &[unknown, unknown])]);
    // On one of two ways the frame is another.
    assert!(reasons(Siemens, "IF R1>0\nTRANS X5\nENDIF\nTRANS X1\nY5")[0].is_some());
}

/// The words of a motion behind a shift are those that the corrected motion before it leaves in effect.
#[test]
fn words_behind_a_shift_continue_from_the_corrected_end() {
    let source = format!("{HEAD}{}X10 Z50\nTRANS X5 Y5\nX0 Y0\nZ0\n", begin(Siemens));
    let lines = |text: &str| -> Vec<String> { text.lines().rev().take(4).map(str::to_owned).collect() };
    let (text, _) = rewrite_as(&source, Siemens, |listing| moved(listing, [0.25, 0.5, 1.0]));
    let all = lines(&text);
    assert!(all[3].starts_with("X10.25") && all[3].contains("Z51"), "{text}");
    assert!(all[1].starts_with("X0.25") && all[1].contains("Y0.5") && !all[1].contains('Z'), "{text}");
    // The motion behind the shift is not corrected: it restates what the corrected one has changed.
    let (text, _) = rewrite_as(&source, Siemens, |listing| vec![change_of(listing, 1, [0.0, 0.0, 1.0])]);
    assert_eq!(lines(&text)[1], "X0 Y0 Z50.0000", "{text}");
}

/// An axis that follows another leaves the programmed path. One beside the arm may.
#[test]
fn motions_with_a_coupled_axis_are_left() {
    let coupled = left(Transformed);
    check(
        Siemens,
        &[
            (
                "X10 Y2\nTRAILON(X,Y,1)\nX1 Y2 Z3 A=180 B=0 C=0\nTRAILOF(X,Y)\nX1 Y2 Z3 A=180 B=0 C=0",
                &[None, coupled, coupled],
            ),
            ("TRAILON(U,Y,1)\nX1\nTRAILOF(U,Y)\nX2", &[None, None]),
        ],
    );
}

#[test]
fn cancelling_an_inactive_transform_changes_nothing() {
    for code in ["G69", "G15", "G13.1", "G50", "G50.1 X0.", "G7.1 C0."] {
        check(Fanuc, &[(&format!("{code}\nG1 X20."), &[None])]);
    }
    check(Siemens, &[("CYCLE800()\nX20\nTOROTOF\nX21\nPAROTOF\nX22", &[None, None, None])]);
    check(Heidenhain, &[("PLANE RESET STAY\nL X+20\nTRANS ROTATION RESET\nL X+21", &[None, None])]);
    // If it was active, the coordinates change.
    check(Fanuc, &[("G68 X0. Y0. R30.\nG69\nG1 X20. Y0. Z50.", &[left(OrientationUnknown)])]);
    assert_eq!(reasons(Fanuc, "/G68 X0. Y0. R30.\nG69\nG1 X20. Y0. Z50."), [left(OrientationUnknown)]);
}

#[test]
fn an_additive_shift_on_an_unknown_one_is_unknown() {
    let go = "G1 X5 Y5 Z5 A=180 B=0 C=0";
    let t = left(Transformed);
    check(
        Siemens,
        &[
            (&format!("/TRANS X10\nG500\n{go}\nTRANS\n{go}"), &[left(UnknownFlow), None]),
            (&format!("/TRANS X10\nATRANS X5\n{go}\nTRANS X5\n{go}"), &[t, None]),
            (&format!("TRANS X1\nAGAIN:\nATRANS X5\n{go}\nGOTOB AGAIN"), &[t]),
        ],
    );
}

/// The class: an offset that the program states in part. Omitted components keep their values, known or not.
#[test]
fn an_offset_without_a_rotation_word_keeps_its_rotation() {
    let value = |begin: &str, offset: &str, dialect| {
        let source = format!("{begin}G90 G57\nG10 L2 P4 {offset}\nG1 X1 Y2 Z3 A180 B0 C0\n");
        let listing = listing_of(&source, dialect);
        let motion = listing.motions.last().unwrap();
        let object = listing.work_object(motion).unwrap();
        object.value.as_ref().map(|value| value.user_frame.quaternion).map_err(|reason| *reason)
    };
    assert_eq!(value("", "X350 Y10 Z250", LinuxCnc), Err(Assigned));
    assert_eq!(value("", "X350 Y10 Z250", Iso), Err(Assigned));
    assert_eq!(value("", "X350 Y10 Z250 R0", LinuxCnc), Ok([1.0, 0.0, 0.0, 0.0]));
    assert_eq!(value("", "X350. Y10. Z250.", Fanuc), Ok([1.0, 0.0, 0.0, 0.0]));
    let turned = "; truegrind frame G57 w [[500,0,0],[0,0,0,1]]\n";
    assert_eq!(value(turned, "X350 Y10 Z250", LinuxCnc), Ok([0.0, 0.0, 0.0, 1.0]));
}

/// Where another tool comes into use, words that are left out are taken from before only if no tool is turned: otherwise they may
/// stay or follow the flange.
#[test]
fn angles_are_not_taken_from_a_tool_that_is_turned_otherwise() {
    let turned = "(truegrind tool H3 c [[0,0,30],[0.9914449,0,0.1305262,0]])\n";
    let also_turned = "(truegrind tool H4 d [[0,0,60],[0.9914449,0,0.1305262,0]])\n";
    let straight = "(truegrind tool H2 b [[0,0,80],[1,0,0,0]])\n";
    let part = "G1 X5. Y5. Z5. B1.";
    let (open, unknown) = (left(OrientationUnknown), left(ToolUnknown));
    check(
        Fanuc,
        &[
            (&format!("{straight}G43.4 H2\n{part}"), &[None]),
            (&format!("{turned}{straight}G43.4 H2\n{part}"), &[None]),
            (
                &format!("{turned}G43.4 H3\n{part}\n{F}\n{part}\nG43.4 H1\n{part}\n{F}"),
                &[open, None, None, open, None],
            ),
            (&format!("{turned}{also_turned}G43.4 H3\n{F}\nG43.4 H4\n{part}"), &[None, None]),
            // Without its length a tool is turned as with it.
            (&format!("{turned}G49\nG43.4 H1\n{part}"), &[None]),
            // A number of which nothing is stated is a length, unless others are turned.
            (&format!("G43.4 H7\n{F}\nG43.4 H1\n{part}"), &[unknown, None]),
            (&format!("{turned}G43.4 H7\n{F}\nG43.4 H1\n{part}\n{F}"), &[unknown, open, None]),
        ],
    );
    let part = "G1 X5 Y5 Z5 B1";
    check(LinuxCnc, &[(&format!("{turned}G43 H3\n{G}\nG43 H0\n{part}\n{G}"), &[None, open, None])]);
    // Where ways meet, any tool may have been in use.
    let part = "G1 X5. Y5. Z5. B1.";
    let ways = |tools: &str, number: u8| {
        format!(
            "{tools}IF [#2 GT 1] GOTO 5\nG43.4 H{number}\nN5 G1 A180. B0. C0. X1. Y2. Z3.\nG43.4 H1\n{part}"
        )
    };
    assert_eq!(reasons(Fanuc, &ways(straight, 2)).last(), Some(&None));
    assert_eq!(reasons(Fanuc, &ways(turned, 3)).last(), Some(&open));
}

/// The program's value is what the control uses, but one of the two is wrong; it was corrected for it without a word.
#[test]
fn a_frame_that_the_program_sets_otherwise_than_it_is_stated_is_listed() {
    let replaced = |body: &str, dialect| {
        let listing = listing_of(body, dialect);
        let found = listing.nc.replaced_frames.iter();
        found
            .map(|(place, frame)| {
                (place.line, frame.name.clone(), frame.set.position_mm, frame.stated.position_mm)
            })
            .collect::<Vec<_>>()
    };
    // Behind the three comments of the head.
    let of = |line: u32, name: &str, set, stated| vec![(line, name.to_owned(), set, stated)];
    let tool = "; truegrind tool T1 u [[0,0,100],[1,0,0,0]]\n";
    let siemens = |set: &str| replaced(&format!("{tool}{set}\nT1 D1\nG54\nTRAORI\n{S}\n"), Siemens);
    let stated = [500.0, 0.0, 0.0];
    assert_eq!(siemens("G71\n$P_UIFR[1]=CTRANS(X,400)"), of(7, "G54", [400.0, 0.0, 0.0], stated));
    assert_eq!(siemens("G71\n$P_UIFR[1]=CTRANS(X,500):CROT(Z,1)").len(), 1);
    assert_eq!(siemens("G71\n$TC_DP3[1,1]=90"), of(7, "T1", [0.0, 0.0, 90.0], [0.0, 0.0, 100.0]));
    // Where a motion used it as stated before, the program changes it on purpose.
    assert_eq!(siemens(&format!("G71\nT1 D1\nG54\nTRAORI\n{S}\n$P_UIFR[1]=CTRANS(X,400)")), []);
    // The same value, one that no motion uses, one that is not known.
    for set in [
        "G71\n$P_UIFR[1]=CTRANS(X,500.001)",
        "G71\n$P_UIFR[2]=CTRANS(X,400)",
        "G71\n$P_UIFR[1]=CTRANS(X,R1)",
        "G71\n$TC_DP3[1,1]=100",
        "G71",
    ] {
        assert_eq!(siemens(set), [], "{set}");
    }
    let linuxcnc =
        |set: &str| replaced(&format!("G21 G90\n{set}\nG54 T0 M6 G43\nG1 X1 Y2 Z3 A180 B0 C0\n"), LinuxCnc);
    assert_eq!(linuxcnc("G10 L2 P1 X400 Y0 Z0 R0"), of(6, "G54", [400.0, 0.0, 0.0], stated));
    assert_eq!(linuxcnc("G10 L2 P1 Z7"), of(6, "G54", [500.0, 0.0, 7.0], stated));
    assert_eq!(linuxcnc("G10 L2 P1 X500 Y0 Z0 R0"), []);
    // What is added to a stated value agrees with it.
    let fanuc = |set: &str| replaced(&format!("G21 G90\n{set}\nG90 G54 T0 M6\nG43.4 H0\n{F}\n"), Fanuc);
    assert_eq!(fanuc("G10 L2 P1 X400. Y0. Z0."), of(6, "G54", [400.0, 0.0, 0.0], stated));
    assert_eq!(fanuc("G91 G10 L2 P1 X1. Y0. Z0."), []);
}
