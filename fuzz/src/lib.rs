//! What is tried on any bytes: each function must end, without a panic, and what it asserts must hold.

pub mod targets;
mod workbook;

use std::sync::LazyLock;

use truegrind::arm::condition::Condition;
use truegrind::arm::estimated::Estimated;
use truegrind::arm::model::Joints;
use truegrind::calibration::measurement::simulation::recipe::Recipe;
use truegrind::compensation::cell::Cell;
use truegrind::compensation::compensate::{CompensateError, compensate};
use truegrind::compensation::deviation::MotionStatus;
use truegrind::compensation::frames::taught::{taught_frame, taught_tcp};
use truegrind::compensation::options::Options as Bounds;
use truegrind::papers::experiment::Experiment;
use truegrind::programs::rapid::task_list;
use truegrind::robots;
use truegrind::robots::foreign::{ImportOptions, import};
use truegrind::surfaces::mesh::{Mesh, MeshOptions};

use truegrind::calibration::measurement::import::{self, Options, TimeMatching};
use truegrind::programs::diff::unified;
use truegrind::programs::motion::{Mark, MotionKind, Role, TargetValue};
use truegrind::programs::nc::setup::Setup;
use truegrind::programs::reading::Program;
use truegrind::programs::rewrite::{Change, Extra, NewTarget, RewriteOptions};
use truegrind::programs::{nc, rapid};
use truegrind::surfaces::SurfaceFile;

/// Every target that is known, moved and turned a little; every third stays. Every other circle becomes straight pieces.
fn changes(program: &Program<'_>) -> Vec<Change> {
    (0_u32..)
        .zip(&program.listing().motions)
        .filter(|(index, motion)| index % 3 != 2 && motion.reason().is_none())
        .map(|(motion, listed)| {
            let straightens = listed.can_straighten && motion % 2 == 0;
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

/// The estimated arm that programs and cells are tried with.
static ARM: LazyLock<Estimated> = LazyLock::new(|| {
    Estimated::from_toml(include_str!("../corpus/model/causes.toml")).expect("the sample is a model")
});

/// One whose joints have play and yield.
static LOOSE: LazyLock<Estimated> = LazyLock::new(|| {
    Estimated::from_toml(include_str!("../corpus/model/play.toml")).expect("the sample is a model")
});

/// An arm for a program: each of the two in turn.
fn arm_for(bytes: &[u8]) -> &'static Estimated {
    if bytes.len().is_multiple_of(2) { &ARM } else { &LOOSE }
}

/// The main job on any program: it ends, and no number that is written is other than finite.
fn job(program: &Program<'_>, sources: &[&[u8]], cell: &Cell, arm: &Estimated) {
    let done = match compensate(program, arm, cell, &Bounds::default(), None) {
        Ok(done) => done,
        // A cell that contradicts the program is an answer.
        Err(CompensateError::Cell(_)) => return,
        Err(error) => panic!("{error}"),
    };
    for (change, outcome) in done.plan.changes.iter().map(|c| (c, &done.plan.outcomes[c.motion as usize])) {
        for target in &change.targets {
            if let NewTarget::Cartesian { position_mm, quaternion, .. } = target {
                assert!(position_mm.iter().chain(quaternion).all(|x| x.is_finite()));
            }
        }
        let written = matches!(outcome.status, MotionStatus::Changed | MotionStatus::Flagged);
        assert!(
            !written
                || [outcome.after_mm, outcome.sigma_mm]
                    .iter()
                    .filter_map(|mm| mm.get())
                    .all(|mm| mm.is_finite())
        );
    }
    for (file, source) in done.rewritten.files.iter().zip(sources) {
        file.edits.apply(source).expect("edits are within the file");
    }
}

/// RAPID: the main job.
pub fn rapid_job(bytes: &[u8]) {
    let program = Program::Rapid(rapid::Task::read(&[("fuzz.mod", bytes)]));
    job(&program, &[bytes], &Cell::default(), arm_for(bytes));
}

/// NC: the main job.
pub fn nc_job(bytes: &[u8]) {
    let setup = Setup { angles: Some(nc::orientation::Angles::Wpr), ..Setup::default() };
    let program = Program::Nc(nc::Task::read(&[("fuzz.nc", bytes)], &setup));
    job(&program, &[bytes], &Cell::default(), arm_for(bytes));
}

/// Any bytes as text; what is no UTF-8 is replaced, as the command line refuses it.
fn text(bytes: &[u8]) -> std::borrow::Cow<'_, str> {
    String::from_utf8_lossy(bytes)
}

/// A workbook: the parts of one, put together; or its bytes with some changed behind the back of the container.
pub fn xlsx(bytes: &[u8]) {
    let mut book = workbook::of(bytes);
    if bytes.len() % 8 == 7 && !book.is_empty() {
        let at =
            bytes.iter().fold(0_usize, |sum, byte| sum.wrapping_mul(31).wrapping_add(usize::from(*byte)));
        let length = book.len();
        book[at % length] ^= 1 << (at % 8);
    }
    let _ = import::read("fuzz.xlsx", &book, &Options::default());
}

/// A mesh, and a ray through it.
pub fn stl(bytes: &[u8]) {
    if let Ok(mesh) = Mesh::from_stl(bytes, &MeshOptions::default()) {
        let down = -nalgebra::Vector3::z_axis();
        if let Some(contact) = mesh.ray(&nalgebra::Point3::new(1.0, 2.0, 1e4), &down) {
            assert!(contact.normal.iter().all(|x| x.is_finite()));
        }
    }
}

/// A model that is taken: it is written and read again, and works.
pub fn model(bytes: &[u8]) {
    let Ok(arm) = Estimated::from_toml(&text(bytes)) else { return };
    let again = arm.to_toml().expect("what was read can be written");
    Estimated::from_toml(&again).expect("what was written can be read");
    let posed = arm.model.at_condition(&Condition::default());
    assert!(posed.forward(&Joints::zeros()).translation.vector.iter().all(|x| x.is_finite()));
    let program = Program::Rapid(rapid::Task::read(&[("fuzz.mod", LINES.as_bytes())]));
    job(&program, &[LINES.as_bytes()], &Cell::default(), &arm);
}

/// A robot file that is taken reaches its own published pose, so loading checks all.
pub fn robot(bytes: &[u8]) {
    if let Ok(robot) = robots::parse(&text(bytes), "fuzz.toml") {
        let posed = robot.model.at_condition(&Condition::default());
        assert!(posed.forward(&Joints::zeros()).translation.vector.iter().all(|x| x.is_finite()));
    }
}

/// The file of an arm that others wrote, of each kind: one that is taken works.
pub fn arm_file(bytes: &[u8]) {
    for file in ["fuzz.urdf", "fuzz.csv", "fuzz.yaml", "fuzz.conf"] {
        if let Ok(found) = import(&text(bytes), file, &ImportOptions::default()) {
            let posed = found.robot.model.at_condition(&Condition::default());
            assert!(posed.forward(&Joints::zeros()).translation.vector.iter().all(|x| x.is_finite()));
        }
    }
}

/// A log of joints and the points of a tracker, above and below a line of dashes, joined by name and by time.
pub fn points(bytes: &[u8]) {
    let line = b"----\n";
    let at = bytes.windows(line.len()).position(|window| window == line).unwrap_or(bytes.len() / 2);
    let (log, rest) = bytes.split_at(at);
    let points = rest.strip_prefix(line).unwrap_or(rest);
    let (log, points, clocks) =
        (("log.csv", log), ("points.txt", points), TimeMatching { within_s: 0.5, ahead_s: 0.0 });
    let options = Options::default();
    let both = [
        import::read_joined(log, points, &options),
        import::read_joined_by_time(log, points, &clocks, &options),
    ];
    assert!(both.iter().flatten().all(|dataset| !dataset.rows.is_empty()));
}

/// A cell file that is taken, and the main job with it.
pub fn cell(bytes: &[u8]) {
    let Ok(cell) = Cell::from_toml(&text(bytes)) else { return };
    let program = Program::Rapid(rapid::Task::read(&[("fuzz.mod", TAUGHT.as_bytes())]));
    job(&program, &[TAUGHT.as_bytes()], &cell, &ARM);
}

/// Two cuts with the tools and the work object of the sample of a cell, where its teaching points put them.
static TAUGHT: LazyLock<String> = LazyLock::new(|| {
    let cell = Cell::from_toml(include_str!("../corpus/cell/cell.toml")).expect("the sample is a cell");
    let still = Condition::default();
    let arm = ARM.nominal.at_condition(&still);
    let flange = |deg: &[f64; 6]| arm.forward(&Joints::from_fn(|i, _| deg[i].to_radians()));
    let points = std::array::from_fn(|i| {
        flange(&cell.wobj[0].teaching_deg[i]) * nalgebra::Point3::new(0.0, 0.0, 100.0)
    });
    let frame = taught_frame(&points).expect("the sample's points are not in line");
    let joints: Vec<Joints> =
        cell.tool[1].teaching_deg.iter().map(|deg| Joints::from_fn(|i, _| deg[i].to_radians())).collect();
    let tip = taught_tcp(&arm, &joints).expect("the sample's poses are not alike");
    let (at, turn) = (frame.translation.vector, frame.rotation.quaternion());
    let object = format!("[[{},{},{}],[{},{},{},{}]]", at.x, at.y, at.z, turn.w, turn.i, turn.j, turn.k);
    let one = format!(
        "PERS tooldata T1:=[TRUE,[[{},{},{}],[1,0,0,0]],[1,[0,0,50],[1,0,0,0],0,0,0]];\nPROC main()\n\
         MoveJ [[0,0,50],[0,0,1,0],[0,0,0,0],[9E9,9E9,9E9,9E9,9E9,9E9]],v100,z1,T1\\WObj:=wPart;\n",
        tip.x, tip.y, tip.z
    );
    LINES.replace("[[400,0,200],[1,0,0,0]]", &object).replace("PROC main()\n", &one)
});

/// A recipe that is taken, and its measurements where they are few.
pub fn recipe(bytes: &[u8]) {
    let Ok(recipe) = Recipe::parse(&text(bytes), "fuzz.toml") else { return };
    if recipe.check().is_ok() && bytes.len().is_multiple_of(4) {
        let resolve = |name: &str| robots::load(name).map(|r| r.model).map_err(|e| e.to_string());
        let _ = recipe.simulate(resolve);
    }
}

/// An experiment of the papers.
pub fn experiment(bytes: &[u8]) {
    let _ = Experiment::parse(&text(bytes), "fuzz.toml");
}

/// A task list.
pub fn list(bytes: &[u8]) {
    assert!(task_list::modules(bytes).iter().map(String::len).sum::<usize>() <= 4 * bytes.len());
}

/// A short cut in a work object, with a tool.
const LINES: &str = "MODULE M\n\
    PERS tooldata tWheel:=[TRUE,[[0,0,100],[1,0,0,0]],[1,[0,0,50],[1,0,0,0],0,0,0]];\n\
    PERS wobjdata wPart:=[FALSE,TRUE,\"\",[[400,0,200],[1,0,0,0]],[[0,0,0],[1,0,0,0]]];\n\
    PROC main()\n\
    MoveJ [[0,0,50],[0,0,1,0],[0,0,0,0],[9E9,9E9,9E9,9E9,9E9,9E9]],v100,z1,tWheel\\WObj:=wPart;\n\
    MoveL [[0,10,20],[0,0,1,0],[0,0,0,0],[9E9,9E9,9E9,9E9,9E9,9E9]],v100,z1,tWheel\\WObj:=wPart;\n\
    MoveL [[20,10,20],[0,0,1,0],[0,0,0,0],[9E9,9E9,9E9,9E9,9E9,9E9]],v100,fine,tWheel\\WObj:=wPart;\n\
    ENDPROC\nENDMODULE\n";
