//! Siemens 840D.

use super::super::Control::Siemens;
use super::{bows, goes, moves, others, stands};

const NAN: f64 = f64::NAN;

#[test]
fn words_hold_on_and_count() {
    goes(
        Siemens,
        &[
            ("X5\nZ=-1", &[[5.0, 2.0, 3.0], [5.0, 2.0, -1.0]]),
            ("X=IC(4)\nG91 X1 Y=AC(7)\nG90 X5", &[[5.0, 2.0, 3.0], [6.0, 7.0, 3.0], [5.0, 7.0, 3.0]]),
            ("G70 X1\nG71 Y.5", &[[25.4, 2.0, 3.0], [25.4, 0.5, 3.0]]),
            ("N10 AGAIN: X5 ; X7", &[[5.0, 2.0, 3.0]]),
            ("MSG(\"X9; Y9\")\nX5", &[[5.0, 2.0, 3.0]]),
        ],
    );
}

#[test]
fn formulas_keep_their_order() {
    goes(
        Siemens,
        &[
            ("R1=12.5 R2=3\nX=R1*2-R2", &[[22.0, 2.0, 3.0]]),
            ("X=2+3*4 Y=(2+3)*4 Z=7 DIV 2".replace("7 DIV 2", "(7 DIV 2)").leak(), &[[14.0, 20.0, 3.0]]),
            ("DEF REAL DEEP=5\nDEEP=DEEP+1\nX=DEEP", &[[6.0, 2.0, 3.0]]),
            ("X=SIN(30)*2 Y=POT(3) Z=SQRT(16)", &[[1.0, 9.0, 4.0]]),
            ("R1=2EX1\nX=R1 Y=1.5EX-1", &[[20.0, 0.15, 3.0]]),
            ("X=ATAN2(1,1) Y=TRUNC(-1.5) Z=R77", &[[45.0, -1.0, 0.0]]),
            // Comparisons come last: R1 > (5 AND 1).
            ("R1=3\nIF R1>5 AND 1 GOTOF A_1\nX9\nA_1: X5", &[[5.0, 2.0, 3.0]]),
        ],
    );
}

#[test]
fn ways_part_and_come_back() {
    goes(
        Siemens,
        &[
            ("IF 1==1 GOTOF ON_1\nX9\nON_1: X5", &[[5.0, 2.0, 3.0]]),
            (
                "R1=0\nAGAIN:\nR1=R1+1\nX=R1\nIF R1<3 GOTOB AGAIN",
                &[[1.0, 2.0, 3.0], [2.0, 2.0, 3.0], [3.0, 2.0, 3.0]],
            ),
            ("IF 1>2\nX9\nELSE\nX5\nENDIF\nX6", &[[5.0, 2.0, 3.0], [6.0, 2.0, 3.0]]),
            ("IF 1<2\nIF 1>2\nX9\nENDIF\nX5\nELSE\nX8\nENDIF", &[[5.0, 2.0, 3.0]]),
            ("FOR R1=1 TO 2\nX=R1\nENDFOR\nX0", &[[1.0, 2.0, 3.0], [2.0, 2.0, 3.0], [0.0, 2.0, 3.0]]),
            ("FOR R1=5 TO 2\nX=R1\nENDFOR\nX0", &[[0.0, 2.0, 3.0]]),
            ("R1=0\nWHILE R1<2\nR1=R1+1\nX=R1\nENDWHILE", &[[1.0, 2.0, 3.0], [2.0, 2.0, 3.0]]),
            ("R1=0\nREPEAT\nR1=R1+1\nX=R1\nUNTIL R1>=2", &[[1.0, 2.0, 3.0], [2.0, 2.0, 3.0]]),
            (
                "A_1:\nX=IC(1)\nE_1: X=IC(1)\nREPEAT A_1 E_1 P=1\nX0",
                &[[2.0, 2.0, 3.0], [3.0, 2.0, 3.0], [4.0, 2.0, 3.0], [5.0, 2.0, 3.0], [0.0, 2.0, 3.0]],
            ),
            ("N50 GOTOF N70\nX9\nN70 X5", &[[5.0, 2.0, 3.0]]),
        ],
    );
}

#[test]
fn coordinates_are_counted_from_offsets_and_frames() {
    stands(
        Siemens,
        &[
            ("G55\nX5 Y5 Z5 A=180 B=0 C=0", Some([605.0, 5.0, 5.0])),
            ("G500\nX5 Y5 Z5 A=180 B=0 C=0", Some([5.0, 5.0, 5.0])),
            ("TRANS X10\nX1", Some([511.0, 2.0, 3.0])),
            ("TRANS X10\nATRANS X5 Y1\nX1 Y1", Some([516.0, 2.0, 3.0])),
            ("TRANS X10\nTRANS Y1\nX1 Y1", Some([501.0, 2.0, 3.0])),
            ("TRANS X10\nAROT Z90\nX1 Y2 Z3 A=180 B=0 C=0", Some([508.0, 1.0, 3.0])),
            ("TRANS X10\nROT Z90\nX1 Y2 Z3 A=180 B=0 C=0", Some([498.0, 1.0, 3.0])),
            ("TRANS X10\nTRANS\nX1", Some([501.0, 2.0, 3.0])),
            ("MIRROR X0\nX1 Y2 Z3 A=180 B=0 C=0", None),
            ("MIRROR X0\nTRANS\nX1 Y2 Z3 A=180 B=0 C=0", Some([501.0, 2.0, 3.0])),
            ("$P_UIFR[1]=CTRANS(X,400,Y,1)\nG54\nX1 Y2 Z3 A=180 B=0 C=0", Some([401.0, 3.0, 3.0])),
            ("$P_PFRAME=CTRANS(X,5):CROT(Z,90)\nX1 Y2 Z3 A=180 B=0 C=0", Some([503.0, 1.0, 3.0])),
            ("TRAFOOF\nX1 Y2 Z3 A=180 B=0 C=0", None),
            ("SUPA G0 Z0\nX1", None),
        ],
    );
    goes(Siemens, &[("T2 D1 M6\nX1", &[[1.0, NAN, NAN]]), ("CYCLE81(5,0,2,-5)\nX1", &[[1.0, NAN, NAN]])]);
}

#[test]
fn arcs_turn_the_right_way() {
    let half = 10.0 * std::f64::consts::FRAC_1_SQRT_2;
    bows(
        Siemens,
        "X10 Y0 Z0",
        &[
            ("G3 X0 Y10 I-10 J0", [half, half, 0.0], 90.0),
            ("G3 X0 Y10 CR=10", [half, half, 0.0], 90.0),
            ("G3 X0 Y10 CR=-10", [10.0 + half, 10.0 + half, 0.0], 270.0),
            ("G3 X0 Y10 I=AC(0) J=AC(0)", [half, half, 0.0], 90.0),
            ("G3 X0 Y10 AR=90", [half, half, 0.0], 90.0),
            ("G2 X0 Y10 AR=270", [-half, -half, 0.0], -270.0),
            ("G18 G3 X0 Z-10 I-10 K0", [half, 0.0, -half], 90.0),
        ],
    );
}

#[test]
fn tools_turn_by_angles_or_by_a_vector() {
    let down = nalgebra::Vector3::new(0.0, 0.0, -1.0);
    for words in ["A=180 B=0 C=0", "A3=0 B3=0 C3=2 THETA=0"] {
        let found = moves(Siemens, &format!("TRAORI\nG54 G1 X0 Y0 Z0 {words}"));
        let turn = found[0].turns[1].unwrap();
        assert!((turn * nalgebra::Vector3::z() - down).norm() < 1e-9, "{words}");
    }
    let found = moves(Siemens, "TRAORI\nG54 G1 X0 Y0 Z0 A3=0 B3=0 C3=1 THETA=0\nTHETA=90");
    let x = found[1].turns[1].unwrap() * nalgebra::Vector3::x();
    assert!((x - nalgebra::Vector3::new(0.0, -1.0, 0.0)).norm() < 1e-9, "{x}");
    assert_eq!(others(Siemens, "M8\nG4 F1\nT1 D1 M6"), ["M8", "wait G4 F1", "M6", "T1"]);
}
