//! Fanuc.

use super::super::Control::Fanuc;
use super::{bows, goes, moves, moves_in, others, setting, stands};

const NAN: f64 = f64::NAN;

#[test]
fn words_hold_on_and_count() {
    goes(
        Fanuc,
        &[
            ("X5.\nZ-1.", &[[5.0, 2.0, 3.0], [5.0, 2.0, -1.0]]),
            ("G91 X5.\nG90 X5.", &[[6.0, 2.0, 3.0], [5.0, 2.0, 3.0]]),
            ("G20 X1.\nG21 Y.5", &[[25.4, 2.0, 3.0], [25.4, 0.5, 3.0]]),
            ("(X9.) X5. (Y7.)", &[[5.0, 2.0, 3.0]]),
            ("/X5.\nX6.", &[[5.0, 2.0, 3.0], [6.0, 2.0, 3.0]]),
            ("N10X5.Y-6.", &[[5.0, -6.0, 3.0]]),
        ],
    );
    let skipping = super::super::setting::Setting { skip: true, increments: true, ..setting() };
    let found = moves_in(Fanuc, "G90 G54\nG43.4 H1\nG1 X1. Y2. Z3. A180. B0. C0.\n/X5.\nX600", &skipping);
    assert_eq!(found[1].to, [Some(0.6), Some(2.0), Some(3.0)]);
    assert_eq!(moves(Fanuc, "G90 G54\nG1 X5 Y0. Z0.")[0].to[0], Some(5.0));
}

#[test]
fn formulas_keep_their_order() {
    goes(
        Fanuc,
        &[
            ("#1=2.\n#2=[#1*3+SIN[30]]\nX#2 Y-#1 Z[#1-1]", &[[6.5, -2.0, 1.0]]),
            ("X[2+3*4] Y[[2+3]*4] Z[7MOD4]", &[[14.0, 20.0, 3.0]]),
            ("#1=-1.2\nX[FIX[#1]] Y[FUP[#1]] Z[ROUND[#1]]", &[[-1.0, -2.0, -1.0]]),
            ("#1=3\n#3=7.\nX#[#1]", &[[7.0, 2.0, 3.0]]),
            ("X[ATAN[1]/[1]] Y[ABS[-4]] Z[SQRT[16]]", &[[45.0, 4.0, 4.0]]),
            // A variable that was never set makes its word void.
            ("X#7 Y5.", &[[1.0, 5.0, 3.0]]),
            ("X[#7+5]", &[[5.0, 2.0, 3.0]]),
        ],
    );
}

#[test]
fn ways_part_and_come_back() {
    goes(
        Fanuc,
        &[
            ("#1=5\nIF[#1GT4]GOTO 10\nX9.\nN10 X5.", &[[5.0, 2.0, 3.0]]),
            ("#1=5\nIF [#1 LE 4] GOTO 10\nX9.\nN10 X5.", &[[9.0, 2.0, 3.0], [5.0, 2.0, 3.0]]),
            ("IF [1 EQ 1] THEN #5=7.\nX#5", &[[7.0, 2.0, 3.0]]),
            (
                "#1=0\nWHILE [#1 LT 2] DO1\nG91 X1.\n#1=#1+1\nEND1\nG90 X0.",
                &[[2.0, 2.0, 3.0], [3.0, 2.0, 3.0], [0.0, 2.0, 3.0]],
            ),
            ("#1=9\nWHILE [#1 LT 2] DO1\nX1.\nEND1\nX0.", &[[0.0, 2.0, 3.0]]),
            (
                "#1=0\nN5 #1=#1+1\nX#1\nIF [#1 LT 3] GOTO 5",
                &[[1.0, 2.0, 3.0], [2.0, 2.0, 3.0], [3.0, 2.0, 3.0]],
            ),
            (
                "M98 P7 L2\nX0.\nM30\nO0007\nG91 X1.\nG90\nM99",
                &[[2.0, 2.0, 3.0], [3.0, 2.0, 3.0], [0.0, 2.0, 3.0]],
            ),
            ("#1=4.\nG65 P7 A9.\nX#1\nM30\nO0007\nX#1\nM99", &[[9.0, 2.0, 3.0], [4.0, 2.0, 3.0]]),
        ],
    );
}

#[test]
fn coordinates_are_counted_from_offsets_and_shifts() {
    stands(
        Fanuc,
        &[
            ("X5.", Some([505.0, 2.0, 3.0])),
            ("G55\nX5. Y5. Z5. A180. B0. C0.", Some([605.0, 5.0, 5.0])),
            ("G54.1 P2\nX5. Y5. Z5. A180. B0. C0.", Some([705.0, 5.0, 5.0])),
            ("G56\nX5. Y6. Z5. A180. B0. C0.", Some([494.0, 5.0, 5.0])),
            ("G55\nX5.", Some([605.0, 2.0, 3.0])),
            ("G56\nX5.", None),
            ("G92 X10.\nX11.", Some([502.0, 2.0, 3.0])),
            ("G92 X10. Y0.\nG92.1 X0. Y0.\nX11. Y5.", Some([511.0, 5.0, 3.0])),
            ("G28 Z0.\nG92 X0. Y0. Z0.\nG92.1 X0. Y0. Z0.\nX10. Z0.", Some([510.0, 2.0, 0.0])),
            ("G52 X10.\nX1.", Some([511.0, 2.0, 3.0])),
            ("G52 X10.\nG52 X0.\nX1.", Some([501.0, 2.0, 3.0])),
            ("G10 L2 P1 X510. Y0. Z0.\nX1. Y2. Z3.", Some([511.0, 2.0, 3.0])),
            ("#5221=520.\nX1.", Some([521.0, 2.0, 3.0])),
            ("G68 X0. Y0. R30.\nX1. Y1. Z1.", None),
            ("G68 X0. Y0. R30.\nG69\nX1. Y1. Z1. A180. B0. C0.", Some([501.0, 1.0, 1.0])),
            ("G43 H1\nX1. Y1. Z1. A180. B0. C0.", None),
            ("G28 Z0.\nX1.", None),
            ("G28 Z0.\nZ1.", Some([501.0, 2.0, 1.0])),
        ],
    );
    goes(Fanuc, &[("G53 Z0.\nX1.", &[[1.0, 2.0, NAN]]), ("T2 M6\nX1.", &[[1.0, NAN, NAN]])]);
}

#[test]
fn arcs_turn_the_right_way() {
    let half = 10.0 * std::f64::consts::FRAC_1_SQRT_2;
    bows(
        Fanuc,
        "X10. Y0. Z0.",
        &[
            ("G3 X0. Y10. I-10. J0.", [half, half, 0.0], 90.0),
            ("G2 X0. Y10. I-10. J0.", [-half, -half, 0.0], -270.0),
            ("G3 X0. Y10. R10.", [half, half, 0.0], 90.0),
            ("G3 X0. Y10. R-10.", [10.0 + half, 10.0 + half, 0.0], 270.0),
            ("G2 X0. Y10. R10.", [10.0 - half, 10.0 - half, 0.0], -90.0),
            ("G3 X-10. Y0. Z4. I-10.", [0.0, 10.0, 2.0], 180.0),
            ("G3 I-10.", [-10.0, 0.0, 0.0], 360.0),
            ("G18 G3 X0. Z-10. I-10. K0.", [half, 0.0, -half], 90.0),
            ("G18 G2 X0. Z10. I-10. K0.", [half, 0.0, half], -90.0),
        ],
    );
    bows(Fanuc, "X0. Y10. Z0.", &[("G19 G3 Y0. Z10. J-10. K0.", [0.0, half, half], 90.0)]);
}

#[test]
fn tools_and_switches_are_noted_in_order() {
    let found = moves(Fanuc, "G90 G54\nT1 M6\nG43.4 H2\nG1 X1. Y2. Z3. A180. B0. C0.");
    assert_eq!(found[0].tool.unwrap().translation.vector.z, 90.0);
    assert_eq!(
        others(Fanuc, "M8\nT1 M6\nG4 P500\nS900 M3"),
        ["M8", "M6", "T1", "wait Some(500.0)", "S900", "M3"]
    );
}
