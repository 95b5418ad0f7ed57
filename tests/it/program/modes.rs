//! What NC words set beside the usual groups: a motion is changed only where none of them makes its words mean
//! something else.

use truegrind::program::motion::{Listing, Reason, TargetValue};
use truegrind::program::nc::Task;
use truegrind::program::nc::dialect::Dialect;
use truegrind::program::nc::setup::Setup;

const HEAD: &str = "; truegrind angles wpr\n; truegrind tool T0 t [[0,0,100],[1,0,0,0]]\n; truegrind tool T1 t [[0,0,100],[1,0,0,0]]\n\
                    ; truegrind frame G54 w [[500,0,0],[1,0,0,0]]\n; truegrind frame G500 w [[500,0,0],[1,0,0,0]]\n";

fn listing_of(body: &str, dialect: Dialect) -> Listing {
    let head =
        if dialect.paren_comments() { HEAD.replace("; truegrind", "(truegrind") } else { HEAD.to_owned() };
    let head: String = head
        .lines()
        .map(|line| if line.starts_with('(') { format!("{line})\n") } else { format!("{line}\n") })
        .collect();
    let source = format!("{head}{body}\n");
    let setup = Setup { dialect: Some(dialect), ..Setup::default() };
    Task::read(&[("p", source.as_bytes())], &setup).listing
}

/// Why each motion is left.
fn left(body: &str, dialect: Dialect) -> Vec<Option<Reason>> {
    listing_of(body, dialect).motions.iter().map(|motion| motion.reason()).collect()
}

/// Why the last motion is left.
fn last(body: &str, dialect: Dialect) -> Option<Reason> {
    *left(body, dialect).last().unwrap()
}

/// After a motion that is known, these blocks, and one that states all.
fn after(blocks: &str, dialect: Dialect) -> Option<Reason> {
    let all = "X1. Y2. Z3. A10. B20. C30.";
    let (head, go) = match dialect {
        Dialect::Fanuc => ("G43.4 H1\n", format!("G1 {all}")),
        Dialect::Siemens => ("TRAORI\n", "G1 X1 Y2 Z3 A=10 B=20 C=30".to_owned()),
        Dialect::Heidenhain => ("TOOL CALL 1 Z S1\nM128\n", "L X+1 Y+2 Z+3 A+10 B+20 C+30".to_owned()),
        _ => ("", format!("G1 {all}")),
    };
    let body = format!("{head}{go}\n{blocks}\n{go}");
    assert_eq!(left(&body, dialect)[0], None, "{body}");
    last(&body, dialect)
}

/// The x of the last motion, or why it is not known.
fn x(body: &str, dialect: Dialect) -> Result<f64, Reason> {
    let listing = listing_of(body, dialect);
    let motion = listing.motions.last().unwrap();
    match (motion.reason(), motion.to().map(|to| to.value)) {
        (None, Some(Ok(TargetValue::Cartesian(target)))) => Ok(target.position_mm[0]),
        (Some(reason), _) => Err(reason),
        _ => panic!("{body}"),
    }
}

use Dialect::{Fanuc, Heidenhain, Iso, LinuxCnc, Siemens};

#[test]
fn each_turn_scale_and_mirror_ends_by_its_own_word() {
    let still = Some(Reason::Transformed);
    for (dialect, begins, others, ends) in [
        (Fanuc, "G51.1 X0.", "G69\nG15\nG50", "G50.1 X0."),
        (Fanuc, "G68 X0. Y0. R30.", "G50.1 X0.\nG15\nG50", "G69"),
        (Fanuc, "G16", "G69\nG50", "G15"),
        (Fanuc, "G51 X0. Y0. P2.", "G69\nG15\nG50.1 X0.", "G50"),
        (Fanuc, "G68.2 X0. Y0. Z0. I10. J0. K0.", "G50\nG15", "G69"),
        (Fanuc, "G12.1", "G69\nG50", "G13.1"),
        (Fanuc, "G112", "G69", "G113"),
        (Fanuc, "G7.1 C50.", "G69", "G7.1 C0"),
        (Fanuc, "G107 C50.", "G69", "G107 C0"),
        (Fanuc, "G101 X0.", "G69", "G100 X0."),
        (Fanuc, "G254", "G69", "G255"),
        (LinuxCnc, "G92 A0", "G69", "G92.1"),
        (LinuxCnc, "G7", "G69", "G8"),
        (Siemens, "MIRROR X0", "ORIWKS\nTRAORI\nCYCLE800()", "TRANS"),
        (Siemens, "SCALE X2", "ORIWKS", "ROT"),
        (
            Siemens,
            "CYCLE800(1,\"TC\",0,57,0,0,0,0,30,0,0,0,0,1)",
            "TRANS X10\nTRANS\nTRAORI\nORIWKS",
            "CYCLE800()",
        ),
        (Siemens, "ORIMKS", "TRANS", "ORIWKS"),
        (Siemens, "DIAMON", "TRANS\nORIWKS", "DIAMOF"),
        (Siemens, "DIAM90", "TRANS", "DIAMOF"),
        (Siemens, "TOFRAME", "TRANS", "TOROTOF"),
        (Siemens, "PAROT", "TRANS", "PAROTOF"),
        (Siemens, "$P_PFRAME=CMIRROR(X)", "ORIWKS", "TRANS"),
        (Siemens, "TRANS X10 A30", "ORIWKS", "TRANS"),
        (Siemens, "G58 X10 Y5", "ORIWKS", "TRANS"),
        (Heidenhain, "CYCL DEF 8.0 MIRROR IMAGE\nCYCL DEF 8.1 X", "PLANE RESET STAY", "CYCL DEF 8.1"),
        (
            Heidenhain,
            "CYCL DEF 10.0 ROTATION\nCYCL DEF 10.1 ROT+30",
            "PLANE RESET STAY",
            "CYCL DEF 10.1 ROT+0",
        ),
        (
            Heidenhain,
            "CYCL DEF 11.0 SCALING\nCYCL DEF 11.1 SCL 0.99",
            "PLANE RESET STAY",
            "CYCL DEF 11.1 SCL 1",
        ),
        (Heidenhain, "PLANE SPATIAL SPA+30 SPB+0 SPC+0 STAY", "CYCL DEF 10.1 ROT+0", "PLANE RESET STAY"),
        (
            Heidenhain,
            "CYCL DEF 19.0 WORKING PLANE\nCYCL DEF 19.1 A+30 B+0",
            "CYCL DEF 10.1 ROT+0",
            "CYCL DEF 19.1 A+0 B+0 C+0",
        ),
        (Heidenhain, "TRANS MIRROR AXIS X", "PLANE RESET STAY", "TRANS MIRROR RESET"),
    ] {
        assert_eq!(after(begins, dialect), still, "{begins}");
        assert_eq!(after(&format!("{begins}\n{others}"), dialect), still, "{begins} {others}");
        assert_eq!(after(&format!("{begins}\n{ends}"), dialect), None, "{begins} {ends}");
    }
    for frame in
        ["$P_BFRAME=CTRANS(X,10)", "$P_UBFR=CTRANS(X,10)", "$P_CHBFR[0]=CTRANS(X,1)", "$P_ACTFRAME=CROT(Z,9)"]
    {
        assert_eq!(after(frame, Siemens), still, "{frame}");
    }
    // What each says itself is no motion.
    for block in ["G51.1 X0.", "G50.1 X0.", "G7.1 C50.", "G101 X0.", "G51 X0. Y0. P2."] {
        assert_eq!(left(&format!("G43.4 H1\nG1 X1. Y2. Z3. A1. B2. C3.\n{block}"), Fanuc), [None], "{block}");
    }
    assert_eq!(left("TRAORI\nG1 X1 Y2 Z3 A=1 B=2 C=3\nG110 X1 Y1\nG58 X1", Siemens), [None]);
}

#[test]
fn a_frame_of_points_that_is_programmed_in_a_variable_is_followed() {
    let body = "TRAORI\n$P_PFRAME=CTRANS(X,10)\nG1 X1 Y2 Z3 A=1 B=2 C=3";
    let listing = listing_of(body, Siemens);
    let object = listing.work_object(&listing.motions[0]).unwrap().value.clone().unwrap();
    assert_eq!(object.object_frame.position_mm, [10.0, 0.0, 0.0]);
    assert_eq!(listing.motions[0].reason(), None);
}

#[test]
fn tool_radius_compensation_of_every_kind_is_known() {
    for code in ["G41", "G42", "G41.1", "G41.2", "G42.2", "G41.3", "G41.6", "G42.1"] {
        assert_eq!(after(&format!("{code} D1"), Fanuc), Some(Reason::RadiusCompensation), "{code}");
        assert_eq!(after(&format!("{code} D1\nG40"), Fanuc), None, "{code}");
    }
    assert_eq!(after("G41.1 D5", LinuxCnc), Some(Reason::RadiusCompensation));
}

#[test]
fn work_offsets_and_tools_that_the_program_sets_or_names_otherwise_are_not_those_of_before() {
    let unknown = Some(Reason::WorkObjectUnknown);
    let set = Some(Reason::WorkObjectAssigned);
    for block in ["G154 P1", "G110", "G54.1 P3", "G54.4 P1"] {
        assert_eq!(after(block, Fanuc), unknown, "{block}");
        assert_eq!(after(&format!("{block}\nG54"), Fanuc), None, "{block}");
    }
    for block in ["#5221=400.", "#5201=1.", "#7001=1.", "#[5000+#3]=1.", "G10 L2 P0 X1. Y1. Z1."] {
        assert_eq!(after(block, Fanuc), set, "{block}");
    }
    assert_eq!(after("#100=400.\n#3=5.", Fanuc), None);
    assert_eq!(after("G10 L20 P1 X0 Y0 Z0", LinuxCnc), set);
    assert_eq!(after("G10 L20 P2 X0 Y0 Z0", LinuxCnc), None);
    assert_eq!(after("G10 L2 P1 X350 Y0 Z300 A10", LinuxCnc), set);
    assert_eq!(after("#5210=1", LinuxCnc), Some(Reason::Variable));
    for block in ["G10 L1 P1 R5.", "G10 L10 P1 R5.", "#2001=5.", "G10 P1 R5."] {
        assert_eq!(after(block, Fanuc), Some(Reason::ToolAssigned), "{block}");
    }
    // The active offset is set anew: where the tool stands has other coordinates.
    let held = "G1 X1 Y2 Z3 A1 B2 C3\nG10 L2 P1 X400 Y0 Z300\nG1 X20";
    assert_eq!(last(held, LinuxCnc), Some(Reason::PositionUnknown));
    assert_eq!(after("G10 L2 P1 X400 Y0 Z300", LinuxCnc), None);
    // What the setup says of an offset holds until the program sets it.
    let frame =
        truegrind::program::motion::Frame { position_mm: [7.0, 0.0, 0.0], quaternion: [1.0, 0.0, 0.0, 0.0] };
    let setup =
        Setup { dialect: Some(LinuxCnc), frames: vec![("G54".to_owned(), frame)], ..Setup::default() };
    let source = "G1 X1 Y2 Z3\nG10 L2 P1 X400 Y0 Z300\nG1 X1 Y2 Z3\n";
    let listing = Task::read(&[("p", source.as_bytes())], &setup).listing;
    let at = |motion: usize| {
        listing.work_object(&listing.motions[motion]).unwrap().value.clone().unwrap().user_frame.position_mm
    };
    assert_eq!((at(0), at(1)), ([7.0, 0.0, 0.0], [400.0, 0.0, 300.0]));
    // Other lengths of the tool.
    for block in ["D2", "D0", "TOFFL=5"] {
        assert_eq!(after(block, Siemens), Some(Reason::ToolUnknown), "{block}");
        assert_eq!(after(&format!("{block}\nD1"), Siemens), None, "{block}");
    }
    for block in ["G43.1 Z10", "G43.2 X1 Y1 Z1"] {
        assert_eq!(after(block, LinuxCnc), Some(Reason::ToolUnknown), "{block}");
        assert_eq!(left(&format!("G1 X1 Y2 Z3 A1 B2 C3\n{block}"), LinuxCnc), [None], "{block}");
    }
    for call in
        ["TOOL CALL \"MILL D10\" Z S2000", "TOOL CALL Q5 Z S1", "TOOL CALL 1 Z S1 DL+5", "TOOL CALL 5.1 Z S1"]
    {
        assert_eq!(after(call, Heidenhain), Some(Reason::ToolUnknown), "{call}");
    }
    assert_eq!(after("TOOL CALL Z S2000", Heidenhain), None);
    assert_eq!(after("TOOL CALL \"X\" Z S1\nTOOL CALL 1 Z S1", Heidenhain), None);
}

#[test]
fn tool_centre_point_control_ends_with_its_group_and_moves_the_coordinates() {
    for code in ["G43 H1", "G44 H1", "G43.1 H1", "G49"] {
        assert_eq!(after(code, Fanuc), Some(Reason::NoTipControl), "{code}");
    }
    assert_eq!(after("G43 H1", LinuxCnc), None);
    let held = "G1 X1. Y2. Z3. A1. B2. C3.\nG43.4 H1\nG1 Z5.";
    assert_eq!(left(held, Fanuc), [Some(Reason::NoTipControl), Some(Reason::PositionUnknown)]);
    let held = "TOOL CALL 1 Z S1\nL X+1 Y+2 Z+3 A+1 B+2 C+3\nM128\nL Z+5";
    assert_eq!(last(held, Heidenhain), Some(Reason::PositionUnknown));
    let held = "G1 X1 Y2 Z3 A=1 B=2 C=3\nTRAORI\nG1 Z5";
    assert_eq!(last(held, Siemens), Some(Reason::PositionUnknown));
}

#[test]
fn words_that_are_no_plain_way_are_listed_and_leave_the_position_unknown() {
    let held = |block: &str, dialect: Dialect| {
        let (go, next) = match dialect {
            Siemens => ("TRAORI\nG1 X1 Y2 Z3 A=1 B=2 C=3", "G1 Z5"),
            Fanuc => ("G43.4 H1\nG1 X1. Y2. Z3. A1. B2. C3.", "G1 Z5."),
            _ => ("G1 X1 Y2 Z3 A1 B2 C3", "G1 Z5"),
        };
        left(&format!("{go}\n{block}\n{next}"), dialect)[1..].to_vec()
    };
    let lost = Some(Reason::PositionUnknown);
    for (block, dialect, reason) in [
        ("G1 AP=30 RP=20", Siemens, Reason::Transformed),
        ("POS[X]=100 FA[X]=500", Siemens, Reason::NotFollowed),
        ("POSA[Z]=5", Siemens, Reason::NotFollowed),
        ("G0 X1=100", Siemens, Reason::MachineCoordinates),
        ("POLY PO[X]=(20,1,2) PL=3", Siemens, Reason::NotFollowed),
        ("G1 X30 ANG=45", Siemens, Reason::NotFollowed),
        ("G1 X30 MEAS=1", Siemens, Reason::Probe),
        ("G1 X30 MEAW=1", Siemens, Reason::Probe),
        ("X30. ,A45.", Fanuc, Reason::NotFollowed),
        ("G37 Z-5.", Fanuc, Reason::Probe),
        ("G150 P100 X20. Y0. Z-5.", Fanuc, Reason::Cycle),
        ("G184 X5. Y5. Z5. R10. F10.", Fanuc, Reason::Cycle),
        ("G47 P1 X5. Y5.", Fanuc, Reason::Cycle),
        ("G70 I5. J30. L6", Fanuc, Reason::Cycle),
        ("G33.1 Z-5 K1", LinuxCnc, Reason::NotFollowed),
        ("G5.1 Q2 X0. Y0. Z0.", Fanuc, Reason::NotFollowed),
    ] {
        assert_eq!(held(block, dialect)[0], Some(reason), "{block}");
        assert!(
            *held(block, dialect).last().unwrap() == lost
                || block.starts_with("POLY")
                || block.starts_with("G33")
                || block.starts_with("G37"),
            "{block}"
        );
    }
    // An orientation by normals or cones.
    for block in ["G1 X20 A5=0 B5=0 C5=1 LEAD=5 TILT=10", "X25 A4=0 B4=0 C4=1", "X35 A6=0 B6=0 C6=1 NUT=10"] {
        assert_eq!(held(block, Siemens)[0], Some(Reason::OrientationUnknown), "{block}");
    }
    // Other axes alone.
    assert_eq!(held("G0 W5", LinuxCnc), [Some(Reason::ExternalOnly), None]);
    assert_eq!(held("G1 U3.", Fanuc), [Some(Reason::ExternalOnly), lost]);
    // LinuxCNC: several turns; stored places.
    assert_eq!(held("G3 X3 Y2 Z3 I1 J0 P2", LinuxCnc)[0], Some(Reason::NotFollowed));
    assert_eq!(held("G28.1\nG30.1", LinuxCnc), [None]);
    // Limits of the handwheel.
    let go = "TOOL CALL 1 Z S1\nM128\nL X+1 Y+2 Z+3 A+1 B+2 C+3";
    assert_eq!(left(&format!("{go}\nM118 X1 Y1\nL X+23"), Heidenhain), [None, None]);
    assert_eq!(x(&format!("{go}\nM118 X1 Y1\nL Y+23"), Heidenhain), Ok(1.0));
    assert_eq!(left(&format!("{go}\nL X+5 M118 Y1"), Heidenhain)[1], Some(Reason::Unread));
    // A cycle is called where the block ends.
    assert_eq!(left(&format!("{go}\nL X+5 M99\nL Y+5"), Heidenhain)[1..], [Some(Reason::Cycle), lost]);
    assert_eq!(left(&format!("{go}\nL X+5 M89\nL Y+5"), Heidenhain)[1], Some(Reason::Cycle));
}

#[test]
fn a_code_that_is_not_known_is_no_motion_of_the_mode_before() {
    for (block, dialect) in [
        ("G999 X5.", Fanuc),
        ("G175 X5. Y5. Z5.", Fanuc),
        ("G77 X5", LinuxCnc),
        ("G810 X5", Siemens),
        ("G201 X5.", Iso),
    ] {
        let go = match dialect {
            Fanuc => "G43.4 H1\nG1 X1. Y2. Z3. A1. B2. C3.",
            Siemens => "TRAORI\nG1 X1 Y2 Z3 A=1 B=2 C=3",
            _ => "G1 X1 Y2 Z3 A1 B2 C3",
        };
        let found = left(&format!("{go}\n{block}\nG1 Y5."), dialect);
        assert_eq!(found[1], Some(Reason::UnknownInstruction), "{block}");
        assert!(found[2].is_some(), "{block}");
    }
    // Without axis words it moves nothing.
    assert_eq!(after("G187 P1\nG103 P1\nG05.1 Q1\nG08 P1", Fanuc), None);
}

#[test]
fn calls_after_every_motion_are_told() {
    let head = "G43.4 H1\nG1 X1. Y2. Z3. A1. B2. C3.\nG66 P9010 A1.\nG90 G21 G17 G54 G40 G43.4 H1\n";
    let all = "G1 X2. Y2. Z3. A1. B2. C3.\n";
    let found = left(&format!("{head}{all}X25.\nG67\n{all}"), Fanuc);
    let call = Some(Reason::Subprogram);
    assert_eq!(found[1..], [call, call, call, None]);
    let head = "TRAORI\nG1 X1 Y2 Z3 A=1 B=2 C=3\n";
    let all = "G90 G500 D1 TRAORI G17 G40 G71 G1 X2 Y2 Z3 A=1 B=2 C=3\n";
    let found = left(&format!("{head}MCALL DRILL\n{all}MCALL\n{all}"), Siemens);
    assert_eq!(found[2], call);
    // How often a subprogram runs.
    assert_eq!(left(&format!("{head}MYSUB P3\nG1 X20"), Siemens)[1], call);
}

#[test]
fn variables_get_the_values_that_the_control_gives_them() {
    let all = " Y2 Z3 A1 B2 C3";
    // LinuxCNC reads all words of a block before it sets any.
    assert_eq!(x(&format!("#3=15\n#3=6 G1 X#3{all}"), LinuxCnc), Ok(15.0));
    assert_eq!(x(&format!("#3=15\n#3=6 G1 X#3{all}\nG1 X#3{all}"), LinuxCnc), Ok(6.0));
    assert_eq!(x(&format!("#1=4\n#1=5 #2=#1\nG1 X#2{all}"), LinuxCnc), Ok(4.0));
    // Fanuc cuts off, LinuxCNC goes down and up.
    for (expression, iso, linux) in
        [("FIX[-1.2]", -1.0, -2.0), ("FUP[-1.2]", -2.0, -1.0), ("FIX[1.8]", 1.0, 1.0), ("FUP[1.2]", 2.0, 2.0)]
    {
        assert_eq!(x(&format!("#1={expression}\nG1 X#1{all}"), Iso), Ok(iso), "{expression}");
        assert_eq!(x(&format!("#1={expression}\nG1 X#1{all}"), LinuxCnc), Ok(linux), "{expression}");
    }
    let siemens = " Y2 Z3 A=1 B=2 C=3";
    for (number, wanted) in [("2EX1", 20.0), ("1.5EX-1", 0.15), ("-1.7EX+2", -170.0), ("3", 3.0)] {
        assert_eq!(x(&format!("TRAORI\nR1={number}\nG1 X=R1{siemens}"), Siemens), Ok(wanted), "{number}");
        assert_eq!(x(&format!("TRAORI\nG1 X={number}{siemens}"), Siemens), Ok(wanted), "{number}");
    }
    let go = "TOOL CALL 1 Z S1\nM128\nQ1 = 20\nQL1 = 7\nQR1 = 8\nL X+Q1 Y+0 Z+20 A+1 B+2 C+3";
    assert_eq!(x(go, Heidenhain), Ok(20.0));
    // What M70 stored holds again after M72.
    let body = format!("G90 G1 X1{all}\nM70\nG91\nM72\nG1 X20{all}");
    assert_eq!(last(&body, LinuxCnc), Some(Reason::UnknownFlow));
}

#[test]
fn what_cannot_be_read_leaves_the_axes_in_doubt_until_they_are_stated() {
    let go = "G43.4 H1\nG1 X1. Y2. Z3. A1. B2. C3.\n";
    for block in ["N10 /X20.", "X1.2.3", "XY5."] {
        let found = left(&format!("{go}{block}\nX30.\nX30. Y0. Z1. A1. B2. C3.\nX31."), Fanuc);
        let from = found.len() - 3;
        assert_eq!(found[from..], [Some(Reason::Unread), None, None], "{block}");
    }
    // Blanks within a number.
    let linux = "G1 X1 Y2 Z3 A1 B2 C3\nG1 X +0. 12 34 Y 7\nX5";
    assert_eq!(left(linux, LinuxCnc)[1..], [Some(Reason::Unread), Some(Reason::Unread)]);
    assert_eq!(last("G1 X1 Y2 Z3 A1 B2 C3\nG1 X 5 Y 7", LinuxCnc), None);
}

#[test]
fn blocks_behind_program_numbers_and_at_the_aim_of_m99_are_followed() {
    let go = "G43.4 H1\nG1 X1. Y2. Z3. A1. B2. C3.\n";
    assert_eq!(left(&format!("{go}O1000 G0 X20."), Fanuc).len(), 2);
    let found = left(&format!("{go}N100 G1 X20.\nM99 P100"), Fanuc);
    assert_eq!(found[1], Some(Reason::UnknownFlow));
    assert_eq!(left(&format!("{go}N100 G1 X20.\nM99 P200"), Fanuc)[1], None);
}

#[test]
fn an_arc_about_a_centre_elsewhere_keeps_its_start_and_its_words() {
    use truegrind::program::rewrite::{Change, NewTarget, Outcome, RewriteOptions};
    let source = "; truegrind angles wpr\n; truegrind tool T1 t [[0,0,100],[1,0,0,0]]\n; truegrind frame G54 w [[500,0,0],[1,0,0,0]]\n\
                  TOOL CALL 1 Z S1\nM128\nL X+10 Y+0 Z+20 A+180 B+0 C+180\nL X+11 Y+0 Z+20\nCC X+20 Y+0\nC X+30 Y+0 DR-\nL X+31 Y+0 Z+20\n";
    let setup = Setup { dialect: Some(Heidenhain), ..Setup::default() };
    let task = Task::read(&[("p.h", source.as_bytes())], &setup);
    assert_eq!(task.listing.motions[2].left, Some(Reason::CentreElsewhere));
    let change = |motion: u32| {
        let Some(Ok(TargetValue::Cartesian(target))) =
            task.listing.motions[motion as usize].to().map(|to| to.value)
        else {
            panic!()
        };
        let [a, b, c] = target.position_mm;
        let position_mm = [a + 0.5, b + 0.5, c + 0.5];
        let targets = vec![NewTarget::Cartesian { position_mm, quaternion: target.quaternion, conf: None }];
        Change { motion, targets, before: Vec::new() }
    };
    let changes = [change(0), change(1), change(3)];
    let rewritten = task.rewrite(&changes, &RewriteOptions::default()).unwrap();
    assert_eq!(rewritten.outcomes[0], Outcome::InPlace);
    assert_eq!(rewritten.outcomes[1], Outcome::Refused(Reason::CentreElsewhere));
    let text = String::from_utf8(rewritten.files[0].edits.apply(source.as_bytes()).unwrap()).unwrap();
    assert!(text.contains("\nC X+30 Y+0 DR-\n") && text.contains("\nL X+11 Y+0 Z+20\nCC"), "{text}");
}
