//! Tests of the interpreters: a wrong one would prove nothing.

mod fanuc;
mod heidenhain;
mod linuxcnc;
mod siemens;

use super::machine::{Event, Move};
use super::setting::{Angles, Setting, plain};
use super::{Control, End, execute};

/// Tools along z, work offsets along x, one of them turned by 90° about z.
fn setting() -> Setting {
    let frame = |name: &str, x: f64, turn: f64| (name.to_owned(), plain([x, 0.0, 0.0], [0.0, 0.0, turn]));
    let tool = |name: &str, z: f64| (name.to_owned(), plain([0.0, 0.0, z], [0.0; 3]));
    Setting {
        angles: Angles::Wpr,
        tools: vec![tool("T0", 0.0), tool("T1", 50.0), tool("T2", 90.0)],
        frames: vec![
            frame("G54", 500.0, 0.0),
            frame("G55", 600.0, 0.0),
            frame("G56", 500.0, 90.0),
            frame("G54.1P2", 700.0, 0.0),
            frame("G500", 0.0, 0.0),
            frame("PRESET1", 600.0, 0.0),
        ],
        increments: false,
        skip: false,
    }
}

fn moves_in(control: Control, text: &str, setting: &Setting) -> Vec<Move> {
    let (trace, end) = execute(control, text, setting, 2000);
    assert!(matches!(end, End::Done), "{text}: {end:?}");
    trace
        .into_iter()
        .filter_map(|event| if let Event::Move(done) = event { Some(*done) } else { None })
        .collect()
}

fn moves(control: Control, text: &str) -> Vec<Move> {
    moves_in(control, text, &setting())
}

/// What is executed beside motions.
fn others(control: Control, text: &str) -> Vec<String> {
    let told = |event| match event {
        Event::Note(text) | Event::Elsewhere(_, text, _) => Some(text),
        Event::Move(_) => None,
    };
    execute(control, text, &setting(), 2000).0.into_iter().filter_map(told).collect()
}

fn begin(control: Control) -> &'static str {
    match control {
        Control::Fanuc => "G90 G21 G17 G54\nG43.4 H1\nG1 X1. Y2. Z3. A180. B0. C0. F600.\n",
        Control::LinuxCnc => "G90 G21 G17 G54\nG1 X1 Y2 Z3 A180 B0 C0 F600\n",
        Control::Siemens => "G90 G71 G17 G54\nTRAORI\nG1 X1 Y2 Z3 A=180 B=0 C=0 F600\n",
        Control::Heidenhain => "TOOL CALL 1 Z S1000\nM128\nL X+1 Y+2 Z+3 A+180 B+0 C+0 R0 F600\n",
    }
}

/// Checks where the blocks after the first motion (X1 Y2 Z3) go, in the coordinates of the program.
fn goes(control: Control, cases: &[(&str, &[[f64; 3]])]) {
    for (body, expected) in cases {
        let found = moves(control, &format!("{}{body}\n", begin(control)));
        let found: Vec<[f64; 3]> =
            found[1..].iter().map(|done| done.to.map(|value| value.unwrap_or(f64::NAN))).collect();
        let same = found.len() == expected.len()
            && found
                .iter()
                .flatten()
                .zip(expected.iter().flatten())
                .all(|(a, b)| (a - b).abs() < 1e-9 || a.is_nan() && b.is_nan());
        assert!(same, "{body}: {found:?}, expected {expected:?}");
    }
}

/// Checks where the last block of each goes, in the base.
fn stands(control: Control, cases: &[(&str, Option<[f64; 3]>)]) {
    for (body, expected) in cases {
        let found = moves(control, &format!("{}{body}\n", begin(control)));
        let at = found[found.len() - 1].pose().map(|pose| pose.translation.vector);
        let same = match (at, expected) {
            (None, None) => true,
            (Some(at), Some(expected)) => (0..3).all(|axis| (at[axis] - expected[axis]).abs() < 1e-6),
            _ => false,
        };
        assert!(same, "{body}: {at:?}, expected {expected:?}");
    }
}

/// Checks the place half way of the last block, an arc from X10 Y0 Z0, and how far it goes (°).
fn bows(control: Control, start: &str, cases: &[(&str, [f64; 3], f64)]) {
    for (body, mid, sweep) in cases {
        let found = moves(control, &format!("{}{start}\n{body}\n", begin(control)));
        let arc = found[found.len() - 1].arc.unwrap_or_else(|| panic!("no arc: {body}"));
        let near = (0..3).all(|axis| (arc.mid[axis].unwrap_or(f64::NAN) - mid[axis]).abs() < 1e-3);
        assert!(near && (arc.sweep.to_degrees() - sweep).abs() < 1e-2, "{body}: {arc:?}");
    }
}

#[test]
fn angles_turn_as_their_name_says() {
    let close = |a: [f64; 3], b: nalgebra::Vector3<f64>| (0..3).all(|axis| (a[axis] - b[axis]).abs() < 1e-12);
    let z = nalgebra::Vector3::z();
    // 90° about x, then about z: z goes to -y, and on to x.
    assert!(close([1.0, 0.0, 0.0], Angles::Wpr.turned([90.0, 0.0, 90.0]) * z));
    assert!(close([1.0, 0.0, 0.0], Angles::Abc.turned([90.0, 0.0, 90.0]) * z));
    assert!(close([0.0, -1.0, 0.0], Angles::Rxyz.turned([90.0, 0.0, 90.0]) * z));
    for angles in [Angles::Wpr, Angles::Abc, Angles::Rxyz] {
        assert!(close([0.0, 0.0, -1.0], angles.turned(angles.down(0.0, 0.0, 30.0)) * z));
    }
    let by_vector = super::setting::by_vector([1.0, 0.0, 1.0], 0.0).unwrap() * z;
    let half = std::f64::consts::FRAC_1_SQRT_2;
    assert!(close([-half, 0.0, -half], by_vector));
}
