//! LinuxCNC.

use super::super::Control::LinuxCnc;
use super::{bows, goes, moves, others, stands};

const NAN: f64 = f64::NAN;

#[test]
fn words_hold_on_and_count() {
    goes(
        LinuxCnc,
        &[
            ("X5\nz-1", &[[5.0, 2.0, 3.0], [5.0, 2.0, -1.0]]),
            ("G91 X5\nG90 X 5", &[[6.0, 2.0, 3.0], [5.0, 2.0, 3.0]]),
            ("G20 X1\nG21 Y.5", &[[25.4, 2.0, 3.0], [25.4, 0.5, 3.0]]),
            ("M70\nG20 G91\nM72\nX5", &[[5.0, 2.0, 3.0]]),
            ("G4 P1 X30", &[[30.0, 2.0, 3.0]]),
            ("X5 ; Y7\n(X6)", &[[5.0, 2.0, 3.0]]),
        ],
    );
}

#[test]
fn formulas_keep_their_order() {
    goes(
        LinuxCnc,
        &[
            ("X[2+3*4**2] Y[[2+3]*4] Z[-7 MOD 4]", &[[50.0, 20.0, 1.0]]),
            ("#1=-1.2\nX FIX[#1] Y FUP[#1] Z ROUND[#1]", &[[-2.0, -1.0, -1.0]]),
            ("#3=15\n#3=6 X#3\nX#3", &[[15.0, 2.0, 3.0], [6.0, 2.0, 3.0]]),
            ("#<deep>=4\nX-#<deep> Y[#<deep>/2]", &[[-4.0, 2.0, 3.0]]),
            ("XSQRT[16] Y[ATAN[1]/[1]]", &[[4.0, 45.0, 3.0]]),
            ("#5=7\n#6=5\nX##6", &[[7.0, 2.0, 3.0]]),
            ("X#99", &[[0.0, 2.0, 3.0]]),
            ("X[1 LT 2 AND 3 GT 4] Y[2 EQ 2]", &[[0.0, 1.0, 3.0]]),
        ],
    );
}

#[test]
fn ways_part_and_come_back() {
    goes(
        LinuxCnc,
        &[
            ("#1=5\no1 if [#1 gt 4]\nX5\no1 else\nX6\no1 endif\nX7", &[[5.0, 2.0, 3.0], [7.0, 2.0, 3.0]]),
            ("o1 if [0]\nX5\no1 elseif [1]\nX6\no1 else\nX8\no1 endif", &[[6.0, 2.0, 3.0]]),
            ("#1=0\no2 while [#1 lt 2]\n#1=[#1+1]\nX#1\no2 endwhile", &[[1.0, 2.0, 3.0], [2.0, 2.0, 3.0]]),
            (
                "#1=0\no2 do\n#1=[#1+1]\nX#1\no2 while [#1 lt 2]\nX9",
                &[[1.0, 2.0, 3.0], [2.0, 2.0, 3.0], [9.0, 2.0, 3.0]],
            ),
            ("o3 repeat [2]\nG91 X1\no3 endrepeat", &[[2.0, 2.0, 3.0], [3.0, 2.0, 3.0]]),
            ("o3 repeat [0]\nX9\no3 endrepeat\nX1", &[[1.0, 2.0, 3.0]]),
            (
                "#1=0\no2 while [1]\n#1=[#1+1]\no4 if [#1 gt 2]\no2 break\no4 endif\nX#1\no2 endwhile\nY0",
                &[[1.0, 2.0, 3.0], [2.0, 2.0, 3.0], [2.0, 0.0, 3.0]],
            ),
            (
                "o<s> sub\nX#1 Y#2\n#1=99\no<s> endsub\n#1=4\no<s> call [7] [8]\nX#1",
                &[[7.0, 8.0, 3.0], [4.0, 8.0, 3.0]],
            ),
            (
                "o<s> sub\n#<a>=3\n#<_b>=5\no<s> return\nX9\no<s> endsub\n#<a>=1\no<s> call\nX#<a> Y#<_b>",
                &[[1.0, 5.0, 3.0]],
            ),
        ],
    );
}

#[test]
fn coordinates_are_counted_from_offsets_and_shifts() {
    stands(
        LinuxCnc,
        &[
            ("G55\nX5 Y5 Z5 A180 B0 C0", Some([605.0, 5.0, 5.0])),
            ("G56\nX5 Y6 Z5 A180 B0 C0", Some([494.0, 5.0, 5.0])),
            ("G92 X10\nX11", Some([502.0, 2.0, 3.0])),
            ("G92 X10\nG92.1 X11", Some([511.0, 2.0, 3.0])),
            ("G92 X10\nG92.2\nX11\nG92.3\nX11", Some([502.0, 2.0, 3.0])),
            ("G52 X10\nX1", Some([511.0, 2.0, 3.0])),
            // G52 and G92 share one store.
            ("G52 X10\nG92.1\nX1", Some([501.0, 2.0, 3.0])),
            ("G91 G10 L2 P1 X10 Y1 Z2\nG90\nX1 Y2 Z3", Some([11.0, 3.0, 5.0])),
            ("G10 L2 P1 X0 Y0 Z0 R90\nX1 Y2 Z3 A180 B0 C0", Some([-2.0, 1.0, 3.0])),
            ("G10 L20 P1 X0\nX5", Some([506.0, 2.0, 3.0])),
            ("G53 G0 Z0\nG1 X1", None),
            ("G43.1 Z10\nX1 Y1 Z1 A180 B0 C0", Some([501.0, 1.0, 1.0])),
        ],
    );
    goes(LinuxCnc, &[("G28 Z0\nX1", &[[1.0, 2.0, NAN]]), ("T2 M6\nX1", &[[1.0, NAN, NAN]])]);
}

#[test]
fn a_zero_of_which_one_axis_is_not_told_keeps_the_others() {
    let shifted = "G28 Z0\nG92 X0 Y0 Z0\nG54";
    goes(
        LinuxCnc,
        &[
            (&format!("{shifted}\nX4"), &[[4.0, 0.0, 0.0]]),
            (&format!("{shifted}\nG52 X-5 Z0\nG91 X1"), &[[7.0, 0.0, NAN]]),
            (&format!("{shifted}\nG92.1 X1"), &[[1.0, 2.0, NAN]]),
        ],
    );
    stands(
        LinuxCnc,
        &[
            (&format!("{shifted}\nX4"), None),
            (&format!("{shifted}\nG52 X-5\nX10"), None),
            (&format!("{shifted}\nG52 X-5 Z0\nX10 Z0"), Some([505.0, 2.0, 0.0])),
        ],
    );
}

#[test]
fn arcs_turn_the_right_way() {
    let half = 10.0 * std::f64::consts::FRAC_1_SQRT_2;
    bows(
        LinuxCnc,
        "X10 Y0 Z0",
        &[
            ("G3 X0 Y10 I-10 J0", [half, half, 0.0], 90.0),
            ("G90.1 G3 X0 Y10 I0 J0", [half, half, 0.0], 90.0),
            ("G2 X0 Y10 R-10", [-half, -half, 0.0], -270.0),
            ("G2 X20 Y0 I5 J0", [15.0, 5.0, 0.0], -180.0),
            ("G2 I5 J0", [20.0, 0.0, 0.0], -360.0),
            ("G91 G3 X-10 Y10 R10", [half, half, 0.0], 90.0),
        ],
    );
}

#[test]
fn a_tool_is_in_when_it_has_been_changed() {
    let tool = |body: &str| {
        let found = moves(LinuxCnc, &format!("G90 G54\n{body}\nG1 X1 Y2 Z3 A180 B0 C0"));
        found[0].tool.map(|tool| tool.translation.vector.z)
    };
    assert_eq!(tool("T2"), Some(0.0));
    assert_eq!(tool("T2 M6"), Some(90.0));
    assert_eq!(tool("T2 M6\nG43 H1"), Some(50.0));
    assert_eq!(tool("M61 Q1"), Some(50.0));
    assert_eq!(tool("G43.1 Z10"), None);
    assert_eq!(others(LinuxCnc, "M8\nG4 P.5\nM3 S100"), ["M8", "wait Some(0.5)", "S100", "M3"]);
}
