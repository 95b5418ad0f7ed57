//! A motion is changed only if its value and modal state are known: unknown words are listed, cancel words end only
//! their own group, and unmodified motions keep their path.

use truegrind_programs::motion::Reason::{self, *};
use truegrind_programs::nc::Task;
use truegrind_programs::nc::dialect::Dialect::{self, Fanuc, Heidenhain, Iso, LinuxCnc, Siemens};
use truegrind_programs::nc::setup::Setup;
use truegrind_programs::rewrite::{RewriteOptions, RewriteOutcome};

use super::{change_of, ends, moved, rewrite_as};

pub(super) const HEAD: &str = "; truegrind angles wpr\n; truegrind tool T0 t [[0,0,100],[1,0,0,0]]\n; truegrind tool T1 t [[0,0,50],[1,0,0,0]]\n; truegrind frame G54 w [[500,0,0],[1,0,0,0]]\n; truegrind frame G55 v [[500,0,0],[0.7071068,0,0,0.7071068]]\n; truegrind frame G500 w [[500,0,0],[1,0,0,0]]\n";

/// The head of a program, so that its first motion has a known state.
pub(super) fn begin(dialect: Dialect) -> &'static str {
    match dialect {
        Fanuc => "G90 G21 G17 G54\nG43.4 H1\nG1 X1. Y2. Z3. A180. B0. C0. F600.\n",
        Iso | LinuxCnc => "G90 G21 G17 G54\nG1 X1 Y2 Z3 A180 B0 C0 F600\n",
        Siemens => "G90 G71 G17 G54\nTRAORI\nG1 X1 Y2 Z3 A=180 B=0 C=0 F600\n",
        Heidenhain => "TOOL CALL 1 Z S1000\nM128\nL X+1 Y+2 Z+3 A+180 B+0 C+0 R0 F600\n",
    }
}

/// The motions after the first one: `None` if they would be changed.
pub(super) fn reasons(dialect: Dialect, body: &str) -> Vec<Option<Reason>> {
    let source = format!("{HEAD}{}{body}\n", begin(dialect));
    let setup = Setup { dialect: Some(dialect), ..Setup::default() };
    let task = Task::read(&[("x", source.as_bytes())], &setup);
    let found: Vec<_> = task.listing.motions.iter().map(|motion| motion.reason()).collect();
    // An unmodified arc pins the end of the first motion.
    assert!(matches!(found[0], None | Some(BeforeUnmodifiedArc | BeforeUnmodifiedPath)), "{body}: {found:?}");
    found[1..].to_vec()
}

pub(super) fn check(dialect: Dialect, cases: &[(&str, &[Option<Reason>])]) {
    for (body, expected) in cases {
        assert_eq!(reasons(dialect, body), *expected, "{dialect:?}: {body}");
    }
}

pub(super) fn left(reason: Reason) -> Option<Reason> {
    Some(reason)
}

/// A block that states everything.
pub(super) const F: &str = "G1 X5. Y5. Z5. A180. B0. C0.";
pub(super) const G: &str = "G1 X5 Y5 Z5 A180 B0 C0";
pub(super) const S: &str = "G1 X5 Y5 Z5 A=180 B=0 C=0";

#[test]
fn unknown_words_are_never_ignored() {
    let unknown: &[Option<Reason>] = &[left(UnknownWord), left(UnknownWord)];
    for code in ["G999", "G999 X9.", "G5.4 X9.", "G12.7", "G141 X9.", "G43.7 H1"] {
        check(Fanuc, &[(&format!("{code}\n{F}"), unknown)]);
    }
    for code in ["G999", "G154 P1 X5", "G6.2 X1"] {
        check(LinuxCnc, &[(&format!("{code}\n{G}"), unknown)]);
    }
    for name in ["GLUE=5", "X1=100", "A1=5", "FROBNICATE X5", "G290", "G7 X9"] {
        check(Siemens, &[(&format!("{name}\n{S}"), unknown)]);
    }
    for block in ["PRESET SELECT #3", "FROBNICATE", "CYCL DEF 800", "L X+5 M777 Y+5", "FUNCTION PARAXMODE X"]
    {
        check(Heidenhain, &[(&format!("{block}\nL X+5 Y+5 Z+5 A+180 B+0 C+0"), unknown)]);
    }
    // A computed code may be any; each group stays unknown until it is stated again.
    check(LinuxCnc, &[(&format!("G[#<c>]\n{G}"), &[left(UnknownVariable), left(UnknownVariable)])]);
    // A computed value is as good as a literal.
    check(LinuxCnc, &[("#1=0\nG[#1] X5", &[None])]);
}

#[test]
fn each_group_ends_with_its_own_cancel_word() {
    let t = left(Transformed);
    check(
        Fanuc,
        &[
            (&format!("G51.1 X0.\nG68 X0. Y0. R30.\nG69\n{F}\nG50.1 X0.\n{F}"), &[t, None]),
            (&format!("G51 X0. Y0. P2000\nG16\nG15\n{F}\nG50\n{F}"), &[t, None]),
            (&format!("G12.1\n{F}\nG13.1\n{F}"), &[t, None]),
            (&format!("G07.1 C50.\n{F}\nG07.1 C0\n{F}"), &[t, None]),
            (&format!("G101 X0.\n{F}\nG100 X0.\n{F}"), &[t, None]),
            (&format!("G43 H1\n{F}\nG43.4 H1\n{F}"), &[left(NoTcpMode), None]),
            (&format!("G41.2 D1\n{F}\nG40\n{F}"), &[left(RadiusCompensation), None]),
            (&format!("G154 P2\n{F}\nG54\n{F}"), &[left(WorkObjectUnknown), None]),
            (&format!("G66 P9010\n{F}\nG67\n{F}"), &[left(Subprogram), left(Subprogram), None]),
        ],
    );
    check(
        Siemens,
        &[
            (&format!("MIRROR X0\nORIWKS\n{S}\nMIRROR\n{S}"), &[t, None]),
            (&format!("SCALE X2\nTRAFOOF\nTRAORI\n{S}\nSCALE\n{S}"), &[t, None]),
            (
                &format!("CYCLE800(1,\"TC\",0,57,0,0,0)\nTRANS X10\nORIWKS\n{S}\nCYCLE800()\n{S}"),
                &[left(TiltsTool), t, None],
            ),
            (&format!("DIAMON\n{S}\nDIAMOF\n{S}"), &[t, None]),
            (&format!("TOFRAME\nTRANS\n{S}\nTOROTOF\n{S}"), &[t, None]),
            (&format!("PAROT\n{S}\nPAROTOF\n{S}"), &[t, None]),
            (&format!("TRANSMIT\n{S}\nTRAORI\n{S}"), &[t, None]),
            (&format!("TRANS X10 A30\n{S}\nTRANS\n{S}"), &[t, None]),
            (&format!("ORIMKS\n{S}\nORIWKS\n{S}"), &[t, None]),
        ],
    );
    let l = "L X+5 Y+5 Z+5 A+180 B+0 C+0";
    let mirror = "CYCL DEF 8.0 MIRROR\nCYCL DEF 8.1";
    check(
        Heidenhain,
        &[
            (&format!("{mirror} X\nPLANE RESET STAY\n{l}\n{mirror}\n{l}"), &[t, None]),
            (&format!("CYCL DEF 10.0 ROT\nCYCL DEF 10.1 ROT+30\n{l}\nCYCL DEF 10.1 ROT+0\n{l}"), &[t, None]),
            (&format!("CYCL DEF 19.0 PLANE\nCYCL DEF 19.1 A+0 B+0 C+0\n{l}"), &[None]),
            (&format!("TRANS MIRROR AXIS X\n{l}\nTRANS MIRROR RESET\n{l}"), &[t, None]),
        ],
    );
    check(
        LinuxCnc,
        &[
            (&format!("G7\n{G}\nG8\n{G}"), &[t, None]),
            (&format!("G41.1 D5\n{G}"), &[left(RadiusCompensation)]),
        ],
    );
}

#[test]
fn the_position_is_unknown_after_a_change_of_coordinates() {
    let p = left(PositionUnknown);
    let o = left(OrientationUnknown);
    check(
        Fanuc,
        &[
            ("G49\nG43.4 H1\nZ5.", &[p]),
            ("G10 L2 P1 X510. Y0. Z0.\nX5.", &[p]),
            ("G1 U-2.\nX5.", &[left(ExternalOnly), p]),
            ("X30. ,A45.\nX5.", &[left(UnsupportedPath), p]),
            (&format!("/M99 P100\nG55\nN100 {F}"), &[left(UnknownFlow)]),
            // Where the first of several calls leaves G91 active, the first block of the subprogram has an unknown end.
            (
                "M98 P1000 L2\nM30\nO1000\nX5.\nG1 X5. Y5. Z5. A180. B0. C0.\nG91 X1.\nM99",
                &[left(Subprogram), left(UnknownFlow), left(UnknownFlow), left(PositionUnknown)],
            ),
            (
                "M98 P1000\nM30\nO1000\nX5.\nG1 X5. Y5. Z5. A180. B0. C0.\nG91 X1.\nM99",
                &[left(Subprogram), left(UnknownFlow), None, None],
            ),
        ],
    );
    check(
        LinuxCnc,
        &[
            ("G10 L2 P1 X510 Y0 Z0\nX5", &[p]),
            ("G33.1 Z-5 K1\nG1 X5", &[left(UnsupportedPath), p]),
            ("G55\nX5 Y5 Z5", &[o]),
            ("T1 M6\nX5 Y5 Z5", &[o]),
            ("G53 G0 X4 A10\nG1 X5 Y5 Z5", &[left(MachineCoordinates), o]),
            ("X1.2.3\nX5", &[left(Unreadable), p]),
            // Before the first branch only the last setting counts.
            (&format!("G49\nT1 M6\nG43 H1\n{G}\no100 while [#1 lt 5]\no100 endwhile\n{G}"), &[None, None]),
            (
                &format!("o100 while [#1 lt 5]\nG91 {G}\no100 endwhile\n{G}"),
                &[left(UnknownFlow), left(UnknownFlow)],
            ),
            // R, I and K of a straight block round or chamfer its corner.
            ("X5 R2\nG0 X6 K1\nX7", &[left(UnsupportedPath), left(UnsupportedPath), None]),
            ("X EXISTS[#<a>]\nX5", &[left(UnknownVariable), None]),
        ],
    );
    check(
        Siemens,
        &[
            ("G111 X0 Y0\nAP=30 RP=20\nZ5", &[left(Transformed), p]),
            ("POS[X]=30\nZ5", &[left(UnsupportedPath), p]),
            ("X30 ANG=45\nZ5", &[left(UnsupportedPath), p]),
            ("X30 MEAS=1\nX5", &[left(Probe), p]),
            ("X30 A5=0 B5=0 C5=1\nX5 Y5 Z5", &[o, o]),
            ("POLY PO[X]=(20,1) PL=3\nX5 Y5 Z5", &[left(UnsupportedPath), left(UnsupportedPath)]),
        ],
    );
    check(
        Heidenhain,
        &[
            ("M129\nM128\nL Z+5", &[p]),
            ("L X+5 M99\nL Y+5", &[left(Cycle), p]),
            ("M118 X1 Y1\nL Z+5", &[None]),
            ("L X+5 F AUTO\nL X+6 FQ5", &[None, None]),
            // A jump may bypass later settings.
            (
                "FN 9: IF +Q1 EQU +Q2 GOTO LBL 5\nTOOL CALL 2 Z\nLBL 5\nL X+1 Y+1 Z+1 A+180 B+0 C+0",
                &[left(UnknownFlow)],
            ),
        ],
    );
}

#[test]
fn assigned_tools_and_offsets_override_the_setup() {
    let (w, t) = (left(WorkObjectAssigned), left(ToolAssigned));
    check(
        Fanuc,
        &[
            (&format!("#5221=400.\n{F}"), &[w]),
            (&format!("#5201=400.\n{F}"), &[w]),
            (&format!("#2001=40.\n{F}"), &[t]),
            (&format!("G10 L2 P0 X10. Y0. Z0.\n{F}"), &[w]),
            (&format!("G10 L2 P1 A10.\nG10 L2 P1 X510. Y0. Z0.\n{F}"), &[w]),
            (&format!("G10 L2 P1 A10.\nG91 G10 L2 P1 A0. B0. C0.\nG90 G10 L2 P1 X510. Y0. Z0.\n{F}"), &[w]),
            (&format!("G10 L2 P1 A10.\nG10 L2 P1 X510. Y0. Z0. A0. B0. C0.\n{F}"), &[None]),
            (&format!("G10 L10 P1 R100.\n{F}"), &[t]),
            (&format!("G43.4 H2\n{F}"), &[left(ToolUnknown)]),
            // Without its G code H selects another offset; in a call it is an argument.
            (&format!("H2\n{F}"), &[left(ToolUnknown)]),
            (&format!("H2 M8\n{F}\nH1\n{F}"), &[left(ToolUnknown), None]),
            (&format!("G10 L50\n{F}"), &[left(UnknownWord), left(UnknownWord)]),
        ],
    );
    check(
        LinuxCnc,
        &[
            (&format!("G10 L20 P1 X0 Y0 Z0\n{G}"), &[w]),
            (&format!("G10 L2 P[#9] X1 Y1 Z1\n{G}"), &[w]),
            (&format!("G10 L2 P1 X510 Y0 Z0 A10\n{G}"), &[w]),
            // Rotary offsets stay until they are taken back, whatever is stated for X, Y, Z and R.
            (&format!("G10 L2 P1 A10\nG10 L2 P1 X510 Y0 Z0 R0\n{G}"), &[w]),
            (&format!("G10 L20 P1 A10\nG10 L2 P1 X510 Y0 Z0 R0\n{G}"), &[w]),
            (&format!("#5224=5\nG10 L2 P1 X510 Y0 Z0 R0\n{G}"), &[w]),
            (&format!("G10 L2 P1 A10\nG10 L2 P1 X510 Y0 Z0 A0 B0 R0\n{G}"), &[w]),
            (&format!("G10 L2 P1 A10\nG10 L2 P1 X510 Y0 Z0 A0 B0 C0 R0\n{G}"), &[None]),
            (&format!("#5221=5\nG10 L2 P1 X510 Y0 Z0 R0\n{G}"), &[None]),
            (&format!("G10 L20 P1 X5\nG10 L2 P1 X510 Y0 Z0 R0\n{G}"), &[None]),
            (&format!("G10 L1 P1 Z50\n{G}"), &[t]),
            (&format!("G43.1 Z10\n{G}"), &[t]),
            (&format!("G43 H2\n{G}\nG43 H0\n{G}"), &[left(ToolUnknown), None]),
            (&format!("#5241=1\n{G}\nG55\n{G}"), &[None, w]),
            (&format!("G92 A0\n{G}\nG92.1\n{G}"), &[left(Transformed), None]),
        ],
    );
    check(
        Siemens,
        &[
            (&format!("D2\n{S}\nD1\n{S}"), &[left(ToolUnknown), None]),
            (&format!("TOFFL=5\n{S}"), &[t]),
            (&format!("$TC_DP12[1,1]=5\n{S}"), &[t]),
            (&format!("$P_UIFR[1]=CTRANS(X,400)\n{S}\nG54\n{S}"), &[w, None]),
            (&format!("$P_UBFR=CTRANS(X,5)\n{S}"), &[w]),
            (&format!("$P_PFRAME=CTRANS(X,5)\n{S}\n$P_PFRAME=CMIRROR(X)\n{S}"), &[None, left(Transformed)]),
        ],
    );
    let l = "L X+5 Y+5 Z+5 A+180 B+0 C+0";
    let named = left(ToolUnknown);
    for (call, named) in [
        ("\"MILL\" Z S1", named),
        ("Q5 Z", named),
        ("5.1 Z", named),
        ("1 Z DL+5", left(LengthAllowance)),
        ("DL+2", left(LengthAllowance)),
    ] {
        check(Heidenhain, &[(&format!("TOOL CALL {call}\n{l}"), &[named])]);
    }
    check(Heidenhain, &[(&format!("TOOL CALL 1 Z S500 DL+0\n{l}\nTOOL CALL S900\n{l}"), &[None, None])]);
}

#[test]
fn values_are_evaluated_as_by_the_control() {
    let after = |body: &str, dialect| ends(&format!("{}{body}\n", begin(dialect)), dialect)[1..].to_vec();
    let at = |x, y, z| Ok([x, y, z]);
    // LinuxCNC reads the whole line before it assigns.
    assert_eq!(after("#3=15\n#3=6 X#3\nX#3", LinuxCnc), [at(15.0, 2.0, 3.0), at(6.0, 2.0, 3.0)]);
    assert_eq!(after("#3=15\n#3=6 X#3", Iso), [Err(UnknownVariable)]);
    assert_eq!(after("XSQRT[16]", LinuxCnc), [at(4.0, 2.0, 3.0)]);
    let rounds = "#1=-1.2\n#2=FIX[#1]\n#3=FUP[#1]\nG1 X#2 Y#3";
    assert_eq!(after(rounds, LinuxCnc), [at(-2.0, -1.0, 3.0)]);
    assert_eq!(after(rounds, Fanuc), [at(-1.0, -2.0, 3.0)]);
    assert_eq!(after(rounds, Iso), [Err(UnknownVariable)]);
    assert_eq!(after("#1=[7 AND 3]\nX#1", Fanuc), [Err(UnknownVariable)]);
    assert_eq!(after("R1=2EX1\nX=R1 Y=1.5EX-1", Siemens), [at(20.0, 0.15, 3.0)]);
    let sets = "QL1 = 7\nQ1 = +20\nQ2 = SIN 30 * Q1\nQ4 = Q1 DIV +8\nL X+Q1 Y+QL1 Z+Q2\nL X+Q4";
    let heidenhain = ends(
        &format!("; truegrind tool T1 t [[0,0,50],[1,0,0,0]]\n{}{sets}\n", begin(Heidenhain)),
        Heidenhain,
    );
    assert_eq!(heidenhain[1..], [at(20.0, 7.0, 10.0), at(2.5, 7.0, 10.0)]);
    assert_eq!(after("M70\nG20 G91\nM72\nX5", LinuxCnc), [at(5.0, 2.0, 3.0)]);
}

#[test]
fn unreadable_numbers_and_words_are_never_edited() {
    for block in ["X1.2.3", "X21,5", "X22 5 7", "X10 X12", "G0 G1 X5", "XY5.", "X +0. 12 34"] {
        for dialect in [Iso, LinuxCnc, Fanuc] {
            let source = format!("{HEAD}{}{block}\nG1 X9. Y9. Z9. A180. B0. C0.\n", begin(dialect));
            let (text, _) = rewrite_as(&source, dialect, |listing| moved(listing, [1.0, -1.0, 0.5]));
            assert!(text.contains(&format!("\n{block}\n")), "{dialect:?}: {text}");
            assert_eq!(reasons(dialect, block), [left(Unreadable)], "{dialect:?}: {block}");
        }
    }
}

#[test]
fn every_block_that_moves_is_listed() {
    check(
        LinuxCnc,
        &[("G0 W5\nG1 U3\nG1 E5\nX5", &[left(ExternalOnly), left(ExternalOnly), left(ExternalOnly), None])],
    );
    check(Fanuc, &[("N10 /X20.\nN20 X25. /Y3.", &[left(Skippable), left(Skippable)])]);
    check(Fanuc, &[(&format!("O1000 G0 X20.\n{F}"), &[left(UnknownFlow), None])]);
    let contour = "G71 U2.5 R1.0\nG71 P9 Q14 U1.5\nN9 G0 X20.\nX21.\nN14 X25.\nG70 P9 Q14";
    check(
        Fanuc,
        &[(
            &format!("{contour}\n{F}"),
            &[left(Cycle), left(Cycle), left(Cycle), left(Cycle), left(Cycle), left(Cycle), None],
        )],
    );
    check(Siemens, &[("MYSUB P3\nG1 X5", &[left(Subprogram), left(UnknownFlow)])]);
    check(Siemens, &[("MCALL CYCLE81(50,0,2,-5)\nX5\nMCALL\nX6 Y6 Z6", &[left(Cycle), None])]);
    check(Heidenhain, &[("X+20\nL Y+5\nB+10 C+170 FMAX\nL X+1", &[None, None, None, None])]);
    // A unit only where it is one.
    check(Fanuc, &[(&format!("G70 I5. J30. L6\n{F}"), &[left(Cycle), None])]);
    check(Iso, &[(&format!("G71\n{G}"), &[None])]);
    check(LinuxCnc, &[("G28.1\nX5\nG30.1\nX6", &[None, None])]);
}

#[test]
fn the_extension_determines_the_dialect_where_the_text_does_not() {
    for (name, text, dialect) in [
        ("a.ngc", "#3=15\nG1 X#3\n", LinuxCnc),
        ("a.nc", "#3=15\nG1 X#3\n", Fanuc),
        ("a.ngc", "G43.4 H1\nG1 X5.\n", Fanuc),
        ("a.ngc", "TRAORI\nG1 X5\n", Siemens),
        ("A.MPF", "TRANS X10\nG1 X5\n", Siemens),
        ("a.spf", "G1 X5\n", Siemens),
        ("a.h", "L X+5\n", Heidenhain),
        ("a.nc", "G1 X5\n", Iso),
    ] {
        assert_eq!(Dialect::of_named(name, text.as_bytes()), dialect, "{name} {text}");
    }
    // DIN/ISO of Heidenhain has other meanings: nothing is changed.
    let task =
        Task::read(&[("a.nc", b"%X G71 *\nN1 G54 X+10 Y+5 *\nN2 G01 X+1 Y+2 Z+3 *\n")], &Setup::default());
    assert!(task.listing.motions.iter().all(|motion| motion.own_reason == Some(UnknownWord)));
    // A text that is no program has no motions.
    for text in ["Dear reader,\nnothing here moves.\n", "q1_deg,q2_deg,x_mm\n0,1,2\n3.5,4,5\n"] {
        let task = Task::read(&[("a.txt", text.as_bytes())], &Setup::default());
        assert!(task.listing.motions.is_empty(), "{text}: {:?}", task.listing.motions);
    }
    // Lines that end with CR alone are lines.
    let task = Task::read(&[("a.nc", b"G90 G54\rG1 X1 Y2 Z3\rX5\r")], &Setup::default());
    assert_eq!(task.listing.motions.len(), 2);
    assert_eq!(task.listing.motions[1].place.line, 3);
}

#[test]
fn unmodified_motions_keep_their_end_points() {
    let go = |dialect, body: &str, motion| {
        let source = format!("{HEAD}{}{body}\n", begin(dialect));
        let (text, rewritten) =
            rewrite_as(&source, dialect, |listing| vec![change_of(listing, motion, [0.5, -0.25, 0.125])]);
        (text[HEAD.len()..].lines().skip(2).map(str::to_owned).collect::<Vec<_>>(), rewritten.outcomes)
    };
    let (text, _) = go(LinuxCnc, "G1 X#100\nX5", 0);
    assert_eq!(text, ["G1 X#100 Y2.0000 Z3.0000", "X5"]);
    let (text, _) = go(LinuxCnc, "/X35\nX5 Y5", 0);
    assert_eq!(text, ["/X35 Y2.0000 Z3.0000", "X5 Y5 Z3.0000"]);
    // An increment of an unmodified motion is relative to the commanded position.
    let (text, _) = go(Siemens, "/G91 X5\nG90 X5", 0);
    assert_eq!(text[1..], ["/G91 X4.5000 Y0.2500 Z-0.1250", "G90 X5 Y2.0000 Z3.0000"]);
    // No centre in a C block of Heidenhain, and no change of its start.
    let source = format!("{HEAD}{}CC X+20 Y+2\nC X+39 Y+2 DR-\nL X+30\n", begin(Heidenhain));
    let (text, _) = rewrite_as(&source, Heidenhain, |listing| moved(listing, [0.5, 0.0, 0.0]));
    assert_eq!(text, source.replace("L X+30", "L X+30.5000"));
    // A helical full turn whose ends move apart is refused together with the motion before it.
    let source = format!("{HEAD}{}G3 X1 Y2 Z-3 I5 J0\nG1 X5\n", begin(LinuxCnc));
    let (text, rewritten) = rewrite_as(&source, LinuxCnc, |listing| {
        vec![
            change_of(listing, 0, [0.5, 0.0, 0.0]),
            change_of(listing, 1, [0.25, 0.0, 0.0]),
            change_of(listing, 2, [0.5, 0.0, 0.0]),
        ]
    });
    assert_eq!(
        rewritten.outcomes[..2],
        [RewriteOutcome::Refused(BeforeUnmodifiedArc), RewriteOutcome::Refused(OpenCircle)]
    );
    assert_eq!(text, source.replace("G1 X5\n", "G1 X5.5000\n"));
    // Without TRAORI a tool vector is not a word.
    let vector = "TRAORI\nG1 X1 Y2 Z3 A3=0 B3=0.3 C3=0.95 THETA=0 F600\n";
    let source = format!("{HEAD}{vector}TRAFOOF\nG1 X5 Y5 Z5\n");
    let (text, _) = rewrite_as(&source, Siemens, |listing| vec![change_of(listing, 0, [0.5, -0.25, 0.125])]);
    assert!(text.ends_with("\nTRAFOOF\nG1 X5 Y5 Z5\n"), "{text}");
    // A Fanuc takes eight digits in a word.
    let source = format!("{HEAD}{}", begin(Fanuc));
    let setup = Setup { dialect: Some(Fanuc), ..Setup::default() };
    let task = Task::read(&[("x", source.as_bytes())], &setup);
    let mut change = change_of(&task.listing, 0, [0.0; 3]);
    let turn = truegrind_programs::nc::orientation::Angles::Wpr.rotation([180.123_456_7, 0.0, 0.0]);
    if let truegrind_programs::rewrite::NewTarget::Cartesian { quaternion, .. } = &mut change.targets[0] {
        *quaternion = [turn.w, turn.i, turn.j, turn.k];
    }
    let rewritten = task.rewrite(&[change], &RewriteOptions::default()).unwrap();
    let text = rewritten.files[0].edits.apply(source.as_bytes()).unwrap();
    assert!(String::from_utf8_lossy(&text).contains("A180.12346 "), "{}", String::from_utf8_lossy(&text));
    assert_eq!(Reason::BeforeUnmodifiedArc.text(), "an uncorrected arc starts at the end of this motion");
}

/// The class: a modal word in a block that is left before its words are interpreted. Its value is unknown afterwards.
#[test]
fn the_spin_of_a_left_block_stays_in_effect() {
    let head = "TRAORI\nG0 X1 Y2 Z3 A3=0 B3=0.3 C3=0.95 THETA=10 F600\n/G1 Y5\n";
    let tail = "G1 X9 Y9 Z9 A3=0.1 B3=0 C3=0.99";
    let last = |between: &str| *reasons(Siemens, &format!("{head}{between}{tail}")).last().unwrap();
    // It is unknown there whether G0 or G1 is active: the block is left.
    assert_eq!(last("THETA=5\n"), Some(OrientationUnknown));
    assert_eq!(last("THETA=5\nG1 THETA=5\n"), None);
    assert_eq!(last(""), None);
}

/// The class: a work offset or tool that a called program assigns, under the name active before the call.
#[test]
fn assignments_of_a_called_program_are_unknown_after_the_call() {
    let all = "G1 X1. Y1. Z1. A180. B0. C0. F600.";
    let after = |early: &str, set: &str| {
        let begin = "G90 G21 G17 G40 G94\nT1 M6\nG54\nG43.4 H1";
        let main = format!("O0001\n{HEAD}{begin}\n{early}\n{all}\nX5.\nM98 P100\n{all}\nM30\n");
        let source = format!("{main}O0100\nG1 X3. Y3. Z3. A180. B0. C0. F600.\n{set}\nM99\n");
        let setup = Setup { dialect: Some(Fanuc), ..Setup::default() };
        let task = Task::read(&[("x", source.as_bytes())], &setup);
        let call =
            task.listing.motions.iter().position(|motion| motion.reason() == Some(Subprogram)).unwrap();
        task.listing.motions[call + 1].reason()
    };
    assert_eq!(after("", "G4 X1."), None);
    assert_eq!(after("", "G10 L2 P1 X5. Y0. Z0."), None, "the only path sets it");
    for set in ["G10 L2 P1 X[#5221+5.]", "#5221=5.", "/G10 L2 P1 X5. Y0. Z0."] {
        assert_eq!(after("", set), Some(WorkObjectAssigned), "{set}");
    }
    assert_ne!(after("", "G10 L11 P1 R50."), None, "the length of the tool");
    // All paths agree.
    assert_eq!(after("G10 L2 P1 X500. Y0. Z200.", "G4 X1."), None);
    assert_eq!(after("G10 L2 P1 X500. Y0. Z200.", "G10 L2 P1 X500. Y0. Z200."), None);
    assert_eq!(after("/G10 L2 P1 X5. Y0. Z0.", "G4 X1."), Some(WorkObjectAssigned));
}

#[test]
fn a_truncated_cycle_does_not_panic() {
    for line in [
        "CYCL",
        "CYCL DEF",
        "CYCL CALL",
        "TOOL",
        "TOOL CALL",
        "TOOL DEF",
        "PLANE",
        "FUNCTION",
        "TRANS",
        "TRANS DATUM",
    ] {
        let source = format!("BEGIN PGM P MM\n{line}\nL X+1 Y+2 Z+3\nEND PGM P MM\n");
        let setup = Setup { dialect: Some(Dialect::Heidenhain), ..Setup::default() };
        let task = Task::read(&[("p.h", source.as_bytes())], &setup);
        assert!(task.listing.motions.iter().all(|motion| motion.reason().is_some()), "{line}");
    }
}

/// The class: a group is set while another group that it depends on is unknown (after a join), and is taken as known
/// although it holds on one path only: a length in an unknown unit, one axis of a shift, the tool length but not the
/// tool, the tool but not its length, the plane but not the arc centre mode.
#[test]
fn a_partial_setting_leaves_the_rest_unknown() {
    let u = left(UnknownFlow);
    let skips = |what: &str| format!("IF [#1 GT 0.] GOTO 10\n{what}\nN10 ");
    check(
        Fanuc,
        &[
            (&format!("{}G52 X10.\nG21\n{F}\nG52 X0. Y0. Z0.\n{F}", skips("G20")), &[u, None]),
            (&format!("{}G52 X10.\n{F}\nG52 X10. Y0. Z0.\n{F}", skips("G52 Y50.")), &[u, None]),
            // The second path also sets an origin: the effect of G52 then differs between controls.
            (&format!("N5 G52 X1. Y2. Z3.\n{F}\nG92 X1.\nGOTO 5"), &[left(Displacement)]),
            (&format!("{}G43.4 H1\n{F}", skips("T1 M6")), &[u]),
            // The tool that M6 changes to was prepared elsewhere.
            (&format!("N5 M6\nG43.4 H1\n{F}\nT2\nIF [#1 GT 0.] GOTO 5"), &[left(ToolUnknown)]),
        ],
    );
    let maybe = |what: &str| format!("o100 if [#1 GT 0]\n{what}\no100 endif\n");
    let arc = format!("{G}\nG2 X15 Y5 I5 J0");
    check(
        LinuxCnc,
        &[
            (&format!("T1 M6\nG43\no100 while [#1 LT 3]\nG49\nG43\n{G}\nT2 M6\no100 endwhile"), &[u]),
            (&format!("{}T1 M6\n{G}\nG43 H1\n{G}", maybe("G49")), &[u, None]),
            (
                &format!("{}G17\n{arc}\nG91.1\n{arc}", maybe("G90.1")),
                &[left(BeforeUnmodifiedArc), u, None, None],
            ),
        ],
    );
    let maybe = |what: &str| format!("IF R1>0\n{what}\nENDIF\n");
    let t = left(Transformed);
    check(
        Siemens,
        &[
            (&format!("{}TRANS X10\nG71\n{S}\nTRANS\n{S}", maybe("G70")), &[t, None]),
            (&format!("{}G58 X10\nG71\n{S}\nTRANS\n{S}", maybe("G70")), &[t, None]),
            (&format!("{}D1\n{S}\nT1 D1\n{S}", maybe("T1 D1")), &[u, None]),
        ],
    );
}

/// The class: a word with unknown distance mode (G90, G91) is taken as absolute, and the motions after it as
/// independent of those before. It may be an increment: then an unmodified path after it starts where the motion
/// before has led.
#[test]
fn a_word_that_may_be_an_increment_depends_on_its_start() {
    let source = format!(
        "{HEAD}{}X5 Y0 Z0\nIF R1>0\nG91\nENDIF\nX3 Y3 Z3\nG90\nCIP X9 Y9 I1=6 J1=7 K1=3\n{S}\n",
        begin(Siemens)
    );
    let (_, rewritten) = rewrite_as(&source, Siemens, |listing| vec![change_of(listing, 1, [0.5, 0.4, 0.3])]);
    let stays = |reason| matches!(reason, BeforeUnmodifiedPath | BeforeIncrement);
    assert!(
        matches!(rewritten.outcomes[0], RewriteOutcome::Refused(reason) if stays(reason)),
        "{rewritten:?}"
    );
}

#[test]
fn harmless_names_are_listed_with_their_uses() {
    let lines = include_str!("../../../src/nc/siemens.txt").lines().filter(|line| !line.starts_with('#'));
    let listed: Vec<(&str, &str)> = lines.map(|line| line.split_once(' ').unwrap()).collect();
    assert!(listed.windows(2).all(|two| two[0].0 < two[1].0));
    for (name, places) in listed {
        let known = |place: &str| ["alone", "call", "value"].contains(&place.trim());
        assert!(places.split(',').all(known), "{name}: {places}");
    }
    let certain = |block: &str| {
        reasons(Siemens, &format!("{block}\nG1 X9 Y9 Z9 A=180 B=0 C=0")).iter().all(Option::is_none)
    };
    for block in ["STOPRE", "MSG(\"x\")", "X5 ADIS=2", "BRISK"] {
        assert!(certain(block), "{block}");
    }
    for block in ["MYPART", "MYPART(1)", "X5 MYPART=2"] {
        assert!(!certain(block), "{block}");
    }
}

/// LinuxCNC turns X and Y by the R of an offset, and leaves A, B and C alone: no frame of tool poses does that.
#[test]
fn a_rotation_of_the_offset_does_not_turn_the_tool() {
    for dialect in [LinuxCnc, Iso] {
        for turn in ["R30", "R-90", "R[#5]", "R0.001"] {
            check(dialect, &[(&format!("G10 L2 P1 X510 Y0 Z0 {turn}\n{G}"), &[left(WorkObjectAssigned)])]);
        }
        check(dialect, &[(&format!("G10 L2 P1 X510 Y0 Z0 R30\nG10 L2 P1 X510 Y0 Z0 R0\n{G}"), &[None])]);
        let kept = format!("G10 L2 P1 X510 Y0 Z0 R30\nG10 L2 P1 X510 Y0 Z0\n{G}");
        check(dialect, &[(&kept, &[left(WorkObjectAssigned)])]);
    }
}

/// Cycles of the control that measure can write what they measured into work offsets, rotations and tools, of which the text shows nothing.
#[test]
fn behind_a_measuring_cycle_frame_and_tool_are_unknown() {
    let (probe, after) = (left(Probe), left(AfterProbing));
    let l = "L X+5 Y+5 Z+5 A+180 B+0 C+0";
    let preset = "CYCL DEF 247 DATUM SETTING Q339=1";
    for number in [
        "404 SET BASIC ROTATION",
        "400",
        "405",
        "410",
        "419",
        "425",
        "451",
        "481",
        "1410",
        "2.0",
        "31.0",
        "463",
    ] {
        check(Heidenhain, &[(&format!("TCH PROBE {number}\n{l}"), &[probe, after])]);
        // Selecting the tool again does not help: its line of the table may be another.
        check(Heidenhain, &[(&format!("TCH PROBE {number}\nTOOL CALL 1 Z S5\n{l}"), &[probe, after])]);
    }
    for number in ["0.0", "1.0", "3.0", "420 MEASURE ANGLE", "431", "441"] {
        check(Heidenhain, &[(&format!("TCH PROBE {number}\n{l}"), &[probe, None])]);
    }
    assert_eq!(reasons(Heidenhain, &format!("TCH PROBE 410\n{preset}\n{l}"))[0], probe);
    assert_ne!(reasons(Heidenhain, &format!("TCH PROBE 410\n{preset}\n{l}"))[1], None);
    for cycle in
        ["CYCLE977(101,1)", "CYCLE961(1)", "CYCLE998(105)", "CYCLE982(1,1)", "CYCLE996", "CYCLE9960(1)"]
    {
        check(Siemens, &[(&format!("{cycle}\n{S}\nG54\n{S}"), &[probe, after, after])]);
        let assigned = format!("{cycle}\n$P_UIFR[1]=CTRANS(X,400)\nG54\n{S}");
        check(Siemens, &[(&assigned, &[probe, after])]);
    }
    check(Siemens, &[(&format!("MCALL CYCLE977(101)\n{S}\nMCALL\n{S}"), &[probe, left(Cycle), after])]);
    // Those that turn or mill set nothing.
    check(Siemens, &[(&format!("CYCLE952(1)\n{S}"), &[left(Cycle), None])]);
    check(Fanuc, &[(&format!("G37 Z50.\n{F}"), &[probe, after])]);
}

#[test]
fn points_of_the_tool_other_than_its_tip_are_not_corrected() {
    let point = left(ReferencePoint);
    let l = "L X+5 Y+5 Z+5 A+180 B+0 C+0";
    let tcpm = |point: &str| format!("FUNCTION TCPM F TCP AXIS SPAT PATHCTRL VECTOR{point}\n{l}\nL X+6");
    for (stated, expected) in [
        ("", None),
        (" REFPNT TIP-TIP", None),
        (" REFPNT TIP-CENTER", point),
        (" REFPNT CENTER-CENTER", point),
    ] {
        check(Heidenhain, &[(&tcpm(stated), &[expected, expected])]);
    }
    let back = format!("{}\n{}", tcpm(" REFPNT CENTER-CENTER"), tcpm(" REFPNT TIP-TIP"));
    check(Heidenhain, &[(&back, &[point, point, None, None])]);
    let reset = format!("{}\nFUNCTION RESET TCPM\nM128\n{l}", tcpm(" REFPNT TIP-CENTER"));
    check(Heidenhain, &[(&reset, &[point, point, None])]);
}

#[test]
fn a_line_under_ptp_is_no_line() {
    check(
        Siemens,
        &[
            (&format!("PTP\n{S}\nCP\n{S}"), &[left(UnsupportedPath), None]),
            (&format!("PTP {S}\n{S}"), &[left(UnsupportedPath), left(UnsupportedPath)]),
            // It concerns G0, whose path is not ours.
            (&format!("PTPG0\n{S}"), &[None]),
        ],
    );
}
