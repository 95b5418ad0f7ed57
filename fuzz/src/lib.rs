//! What is tried on any bytes: each function must end, without a panic, and what it asserts must hold.

use truegrind::measurement::import::{self, Options};
use truegrind::program::diff::unified;
use truegrind::program::motion::{Mark, MotionKind, Role, TargetValue};
use truegrind::program::nc::setup::Setup;
use truegrind::program::reading::Program;
use truegrind::program::rewrite::{Change, Extra, NewTarget, RewriteOptions};
use truegrind::program::{nc, rapid};
use truegrind::surface::SurfaceFile;

/// Every target that is known, moved and turned a little; every third stays. Every other circle becomes straight pieces.
fn changes(program: &Program<'_>) -> Vec<Change> {
    (0_u32..)
        .zip(&program.listing().motions)
        .filter(|(index, motion)| index % 3 != 2 && motion.reason().is_none())
        .map(|(motion, listed)| {
            let straightens = listed.straightens && motion % 2 == 0;
            let targets = listed.targets.iter().map(|target| match target.value {
                _ if straightens && target.role == Role::Via => NewTarget::Drop,
                Ok(TargetValue::Cartesian(t)) => NewTarget::Cartesian {
                    position_mm: t.position_mm.map(|x| x + 0.125),
                    quaternion: [t.quaternion[0] + 1e-3, t.quaternion[1], t.quaternion[2], t.quaternion[3]],
                    conf: Some(t.conf),
                },
                Ok(TargetValue::Joint(t)) => NewTarget::Joint { robot_deg: t.robot_deg.map(|q| q + 0.01) },
                Err(_) => NewTarget::Keep,
            });
            let piece = NewTarget::Cartesian {
                position_mm: [1.0, 2.0, 3.0],
                quaternion: [1.0, 0.0, 0.0, 0.0],
                conf: None,
            };
            let piece = Extra { kind: MotionKind::Linear, target: piece, external: None };
            let before = if straightens && motion % 4 == 0 || listed.insertable && motion % 5 == 0 {
                vec![piece.clone(), piece]
            } else {
                Vec::new()
            };
            Change { motion, targets: targets.collect(), before }
        })
        .collect()
}

/// Rewriting ends, its edits are disjoint, the diff says the same, and the result can be read.
fn rewritten(source: &[u8], program: &Program<'_>) -> Vec<u8> {
    let mark = Mark { version: "0.0.0".into(), model: "0123456789ab".into(), partial: false };
    let options = RewriteOptions { mark: Some(mark), ..RewriteOptions::default() };
    let rewritten = program.rewrite(&changes(program), &options).expect("edits do not overlap");
    let edits = &rewritten.files[0].edits;
    assert_eq!(
        edits.is_empty(),
        unified(source, edits, "a", "b").expect("edits are within the file").is_empty()
    );
    edits.apply(source).expect("edits are within the file")
}

/// RAPID: the tokens are the file; listing and rewriting end; so do those of the result.
pub fn rapid(bytes: &[u8]) {
    let task = rapid::Task::read(&[("fuzz.mod", bytes)]);
    assert_eq!(task.trees[0].print(), bytes);
    let program = Program::Rapid(task);
    let text = rewritten(bytes, &program);
    let again = rapid::Task::read(&[("fuzz.mod", &text)]);
    assert_eq!(again.trees[0].print(), text);
}

/// NC: the same, in the dialect that the bytes look like and, by their length, in any.
pub fn nc(bytes: &[u8]) {
    use nc::dialect::Dialect::{Fanuc, Heidenhain, Iso, LinuxCnc, Siemens};
    let any = [Iso, Fanuc, LinuxCnc, Siemens, Heidenhain][bytes.len() % 5];
    for dialect in [None, Some(any)] {
        let setup = Setup { dialect, angles: Some(nc::orientation::Angles::Wpr), ..Setup::default() };
        let task = nc::Task::read(&[("fuzz.nc", bytes)], &setup);
        assert_eq!(task.trees[0].print(), bytes);
        let program = Program::Nc(task);
        let text = rewritten(bytes, &program);
        let again = nc::Task::read(&[("fuzz.nc", &text)], &setup);
        assert_eq!(again.trees[0].print(), text);
    }
}

/// Measurements: rows or an error.
pub fn csv(bytes: &[u8]) {
    if let Ok(dataset) = import::read("fuzz.csv", bytes, &Options::default()) {
        assert!(!dataset.rows.is_empty());
    }
}

/// A surface file: a surface or an error; a path only where it is small.
pub fn surface(bytes: &[u8]) {
    let resolve = |name: &str| -> Result<Vec<u8>, String> { Err(format!("{name}: no file here")) };
    let _ = SurfaceFile::read("fuzz.toml", bytes, resolve);
}
