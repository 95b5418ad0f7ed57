//! Heidenhain conversational.

use super::super::Control::Heidenhain;
use super::{bows, goes, moves, others, stands};

const NAN: f64 = f64::NAN;

#[test]
fn words_hold_on_and_count() {
    goes(
        Heidenhain,
        &[
            ("L X+5\n12 L Z-1,5 R0 FMAX M8", &[[5.0, 2.0, 3.0], [5.0, 2.0, -1.5]]),
            ("L IX+5\nL X+5 IY-1", &[[6.0, 2.0, 3.0], [5.0, 1.0, 3.0]]),
            ("X+20\nL Y5", &[[20.0, 2.0, 3.0], [20.0, 5.0, 3.0]]),
            ("L X+5 ; Y+7", &[[5.0, 2.0, 3.0]]),
            ("/12 L X+5\n13 /L X+6", &[[5.0, 2.0, 3.0], [6.0, 2.0, 3.0]]),
        ],
    );
    let inch = moves(Heidenhain, "0 BEGIN PGM A INCH\nM128\nL X+1 Y+0 Z+0 A+180 B+0 C+0\nEND PGM A INCH");
    assert_eq!(inch[0].to[0], Some(25.4));
}

#[test]
fn formulas_keep_their_order() {
    goes(
        Heidenhain,
        &[
            ("Q1 = +5\nL X+Q1 Y-Q1", &[[5.0, -5.0, 3.0]]),
            ("Q1 = 20\nQ3 = SIN 30 * 10\nL X+Q3", &[[5.0, 2.0, 3.0]]),
            ("Q1 = ( 5 + 3 ) * 2 ^ 2\nL X+Q1", &[[32.0, 2.0, 3.0]]),
            ("Q1 = SQ 10 - 3 ^ 3\nQL1 = 7 % 4\nL X+Q1 Y+QL1", &[[73.0, 3.0, 3.0]]),
            ("Q1 = COS 60 ^ 2\nL X+Q1", &[[0.25, 2.0, 3.0]]),
            ("FN 0: Q2 = -2,5\nFN 1: Q3 = +Q2 + +5\nFN 2: Q4 = +Q2 - +5\nL X+Q3 Y+Q4", &[[2.5, -7.5, 3.0]]),
            ("FN 3: Q3 = +4 * +5\nFN 4: Q4 = +Q3 DIV +8\nL X+Q3 Y+Q4", &[[20.0, 2.5, 3.0]]),
            ("L X+Q77", &[[0.0, 2.0, 3.0]]),
        ],
    );
}

#[test]
fn ways_part_and_come_back() {
    goes(
        Heidenhain,
        &[
            ("FN 9: IF +1 EQU +1 GOTO LBL 5\nL X+9\nLBL 5\nL X+5", &[[5.0, 2.0, 3.0]]),
            ("FN 10: IF +1 NE +1 GOTO LBL 5\nL X+9\nLBL 5\nL X+5", &[[9.0, 2.0, 3.0], [5.0, 2.0, 3.0]]),
            (
                "Q1 = +0\nLBL 3\nQ1 = Q1 + 1\nL X+Q1\nFN 12: IF +Q1 LT +3 GOTO LBL 3",
                &[[1.0, 2.0, 3.0], [2.0, 2.0, 3.0], [3.0, 2.0, 3.0]],
            ),
            (
                "LBL 3\nL IX+1\nCALL LBL 3 REP 2\nL X+0",
                &[[2.0, 2.0, 3.0], [3.0, 2.0, 3.0], [4.0, 2.0, 3.0], [0.0, 2.0, 3.0]],
            ),
            ("CALL LBL 7\nL X+0\nM30\nLBL 7\nL X+7\nLBL 0", &[[7.0, 2.0, 3.0], [0.0, 2.0, 3.0]]),
            ("FN 11: IF +5 GT +1 GOTO LBL 5\nL X+9\nLBL 5\nL X+5", &[[5.0, 2.0, 3.0]]),
        ],
    );
}

#[test]
fn coordinates_are_counted_from_presets_and_shifts() {
    let shift = "CYCL DEF 7.0 DATUM SHIFT\nCYCL DEF 7.1 X+10\nCYCL DEF 7.2 Y-5,5\n";
    let go = "L X+1 Y+2 Z+3 A+180 B+0 C+0";
    let with = |before: &str| -> &'static str { format!("{before}\n{go}").leak() };
    stands(
        Heidenhain,
        &[
            (with(shift), Some([511.0, -3.5, 3.0])),
            (with(&format!("{shift}CYCL DEF 7.1 IX+5")), Some([516.0, -3.5, 3.0])),
            (with(&format!("{shift}CYCL DEF 7.1 X+0 Y+0")), Some([501.0, 2.0, 3.0])),
            (with("TRANS DATUM AXIS Z+7"), Some([501.0, 2.0, 10.0])),
            (with("TRANS DATUM AXIS Z+7\nTRANS DATUM RESET"), Some([501.0, 2.0, 3.0])),
            (with("CYCL DEF 247 DATUM SETTING Q339=+1"), Some([601.0, 2.0, 3.0])),
            (with("CYCL DEF 247 DATUM SETTING Q339=+9"), None),
            (with("CYCL DEF 8.0 MIRROR\nCYCL DEF 8.1 X"), None),
            (with("CYCL DEF 8.0 MIRROR\nCYCL DEF 8.1 X\nCYCL DEF 8.1"), Some([501.0, 2.0, 3.0])),
            (with("CYCL DEF 10.0 ROT\nCYCL DEF 10.1 ROT+30"), None),
            (with("PLANE SPATIAL SPA+0 SPB+20 SPC+0 STAY\nPLANE RESET STAY"), Some([501.0, 2.0, 3.0])),
            (with("M129"), None),
            (with("TOOL CALL 1 Z S1 DL+5"), Some([501.0, 2.0, 3.0])),
        ],
    );
    goes(
        Heidenhain,
        &[
            ("L Z+0 M91\nL X+1", &[[1.0, 2.0, NAN]]),
            ("TOOL CALL 2 Z\nL X+1", &[[1.0, NAN, NAN]]),
            ("TOOL CALL S500\nL X+1", &[[1.0, 2.0, 3.0]]),
        ],
    );
}

#[test]
fn arcs_turn_the_right_way() {
    let half = 10.0 * std::f64::consts::FRAC_1_SQRT_2;
    bows(
        Heidenhain,
        "L X+10 Y+0 Z+0",
        &[
            ("CC X+0 Y+0\nC X+0 Y+10 DR+", [half, half, 0.0], 90.0),
            ("CC X+0 Y+0\nC X+0 Y+10 DR-", [-half, -half, 0.0], -270.0),
            ("CC IX-10 IY+0\nC X+0 Y+10 DR+", [half, half, 0.0], 90.0),
            ("CR X+0 Y+10 R+10 DR+", [half, half, 0.0], 90.0),
            ("CR X+0 Y+10 R-10 DR+", [10.0 + half, 10.0 + half, 0.0], 270.0),
            ("CC X+0 Y+0\nC X+10 Y+0 DR+", [-10.0, 0.0, 0.0], 360.0),
        ],
    );
}

#[test]
fn what_stands_beside_a_path_acts() {
    let found = moves(
        Heidenhain,
        "TOOL CALL 2 Z S1\nM128\nL X+1 Y+2 Z+3 A+180 B+0 C+0 RL\nL X+2 R0\nLN X+1 Y+1 Z+1 TX+0 TY+0 TZ+1",
    );
    assert!(found[0].pose().is_none() && found[1].pose().is_some());
    assert_eq!(found[1].tool.unwrap().translation.vector.z, 90.0);
    let z = found[2].turns[1].unwrap() * nalgebra::Vector3::z();
    assert!((z.z + 1.0).abs() < 1e-12);
    assert_eq!(others(Heidenhain, "L X+1 M8\nL X+2 M99"), ["M8", "cycle that is called by M99"]);
}
