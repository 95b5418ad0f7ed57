//! Reading and rewriting a RAPID module of 100,000 MoveL (15.9 MB): MB/s per core, and the way from bytes to bytes.
//!
//! `cargo bench --no-default-features --bench program`
//!
//! Counted from file to file on two cores of an AMD Zen 4 at 3.5 GHz, medians with other work stopped:
//!
//! | module | 7c20e9f | this code | required |
//! |---|---|---|---|
//! | 100,000 MoveL, 16.5 MB | 0.43 s (0.59 s user, 0.14 s system), 246 MB | 0.58 s (0.74 + 0.17 s), 165 MB | 0.3 s |
//! | 1,180,000 MoveL, 194 MB | 9.3 s (6.9 + 7.2 s), 2.73 GB | 8.4 s (10.7 + 3.0 s, before the Jacobians of a cut were stacked), 1.68 GB | 4 s, 1.2 GB |
//!
//! Parsing on one thread: 238 MB/s (400 required), 525 MB/s on two; lexing 940 MB/s on two. The plan of 100,000 motions takes 0.435 s,
//! in 7c20e9f 0.225 to 0.285 s in the same run.
//!
//! Two cores of an AMD Zen 5 at 4.17 GHz at a load of 10 to 16, processor time (the clock says nothing there), 7c20e9f and this code in turn:
//! file to file 0.457 + 0.13 s and 0.476 + 0.14 s (0.573 before the Jacobians of a cut were taken eight at a time), plan on one thread
//! 0.28 and 0.30 s (0.395), 1,180,000 MoveL 5.0 + 1.9 s, 2.48 GB and 5.5 + 2.0 s, 1.59 GB. Parsing on one thread: 33 ms and another 20 ms that
//! clear the pages of tokens and nodes (480 and 297 MB/s; 7c20e9f 35.3 + 21 ms): 6.2 million tokens of 5 bytes and 1.6 million nodes of 16 are
//! 3.4 bytes for each byte of a file of 16.5 MB; 400 MB/s leave room to clear 1.8.
//!
//! The same machine at a load of 6 to 13, but above the priority of all else, in turn with 498b129f, medians of nine: file to file 0.30 and
//! 0.29 s by the clock (0.41 + 0.12 and 0.40 + 0.12 s). 1,180,000 MoveL of 171 MB: 3.70 s and 3.55 s by the clock (4.07 + 1.84 and 3.94 + 1.70 s), 1.54 GB.
//! Of the 0.33 s of a profiled run lexing takes 18 ms, parsing and joining its parts 30, symbols 8, the listing 55 on one thread while another reads
//! the targets, original joints 17, risk 25, targets 50, paths 60, edits 25, bytes and words 20; both threads are busy for seven eighths of it.
//!
//! Memory of the 171 MB: 1.13 GB when all motions are listed, 1.35 GB when targets are solved, 1.5 GB at the end of the plan. 1.2 GB for 198 MB are
//! 6.1 bytes for each byte of source; source, tokens and nodes alone are 4.4, and the listing, which is made from them, 2.6.
//! Tried and left out: one codegen unit for each crate (user time 1 % less in turn, twice the time to build); trees freed by another thread (they
//! wait behind the plan: 2.03 GB).
//!
//! Since then tokens have 3 bytes instead of 5 and nodes 8 instead of 16 (1.9 bytes for each byte of source), a number ends within sixteen bytes at
//! once, and plain expressions need no call. Two cores of a Xeon at a load of 4 to 6, above the priority of all else, in turn with cfc4cf8b, the
//! fastest and the median of three runs: lexing on one thread 43 and 64 ms before, 29 and 33 ms now; parsing 60 and 70 ms, 43 and 48 ms (370 and
//! 330 MB/s, 1.4 times as many as before); listing 168 and 199 ms, 144 and 170 ms. The plan is as before (0.31 to 0.34 s), file to file 0.58 and 0.55 s.
//! 1,180,000 MoveL of 194 MB: 1.33 and 1.05 GB when all motions are listed, 1.44 and 1.44 when targets are solved, 1.64 and 1.57 at most, at the end of the
//! plan: for each motion 165 bytes of source, some 380 of the listing, 416 of the solved target, 136 of the outcome and 136 of the change. 1.2 GB are 1000.
//!
//! Since then a target is in its motion (external axes in 48 bytes instead of 96), a solved target takes 320 bytes instead of 416, an outcome 64
//! instead of 136 and a change 112 in one piece instead of 152 in two, registrations of cuts are in one list that is freed once targets are solved,
//! and passes over all motions that were sequential run on all threads. Two cores of a Xeon at a load of 3 to 5, above the priority of all else, in
//! turn with 2b6ccd99, medians of fifteen and of two: file to file 0.490 and 0.430 s, 146 and 137 MB; 1,144,000 MoveL of 189 MB 6.43 and 5.82 s,
//! 1.53 and 1.16 GB, of 200 MB 1.63 and 1.22 GB. Left out: changes that take over the memory of the solved targets (a sequential pass more, and
//! targets solved again where the writer refuses one); literals inserted in parallel gain nothing, but need no state.
//!
//! On Zen 4: 7c20e9f did not assess risk: that was 0.23 s of 0.83 s user, half of it tr(J C Jᵀ) of 32 points of each cut. Stacked
//! Jacobians and one product of their columns left 0.14 s. Of the 7.4 µs of a motion targets and checks between them have 39 %, edits and the file 12 %, reading
//! 9 %, and no function more than 4 %. For 0.3 s on two cores a motion may take 6 µs, page faults included, which take 1.7.
//! Memory: 68,000 pages of 4 KiB are touched at a peak of 40,000; the system clears each. With malloc keeping what is freed (trim and
//! mmap thresholds of glibc) system time falls from 0.18 to 0.10 s; mimalloc 2.0 gains nothing. On a Xeon neither these thresholds, nor huge pages
//! (glibc's tunable, jemalloc's and mimalloc's options), nor jemalloc gain anything from file to file, in four rounds in turn.

use std::fs;
use std::hint::black_box;
use std::path::{Path, PathBuf};
use std::process::Command;
use std::sync::LazyLock;

use divan::Bencher;
use divan::counter::BytesCount;
use nalgebra::DMatrix;
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use truegrind::arm::condition::Condition;
use truegrind::arm::estimated::{Estimated, Judgement, Provenance, StageErrors, Verdict};
use truegrind::arm::model::Joints;
use truegrind::arm::parameter::{Parameter, link_parameters};
use truegrind::arm::region::Region;
use truegrind::compensation::cell::Cell;
use truegrind::compensation::options::Options;
use truegrind::compensation::plan::solved_program::plan;
use truegrind::math::statistics::ErrorSummary;
use truegrind::planning::toolpath::toolpath;
use truegrind::programs::motion::MotionKind;
use truegrind::programs::rapid::Task;
use truegrind::programs::rapid::lexer::lex;
use truegrind::programs::rapid::parser::parse;
use truegrind::programs::rapid::writer;
use truegrind::programs::rewrite::{Change, NewTarget, RewriteOptions, Rewritten};

fn main() {
    divan::main();
}

/// As a path generator writes it: 100,000 inline targets.
static MODULE: LazyLock<Vec<u8>> = LazyLock::new(|| {
    let mut text = String::from("MODULE Path\n");
    text.push_str("  PERS tooldata tWheel:=[TRUE,[[0,0,150],[1,0,0,0]],[2,[0,0,60],[1,0,0,0],0,0,0]];\n");
    text.push_str("  PERS wobjdata wPart:=[FALSE,TRUE,\"\",[[500,0,200],[1,0,0,0]],[[0,0,0],[1,0,0,0]]];\n");
    text.push_str("  PROC main()\n");
    for index in 0..100_000 {
        let (x, y) = (f64::from(index % 400) * 0.5, f64::from(index / 400) * 0.8);
        let z = 20.0 * (x * 0.03).sin();
        let half = 0.1 * (x * 0.03).cos();
        let (sin, cos) = half.sin_cos();
        text.push_str(&format!(
            "    MoveL [[{x:.4},{y:.4},{z:.4}],[0.0000000,{sin:.7},{cos:.7},0.0000000],[0,-1,0,0],\
             [9E+09,9E+09,9E+09,9E+09,9E+09,9E+09]],v100,z1,tWheel\\WObj:=wPart;\n"
        ));
    }
    text.push_str("  ENDPROC\nENDMODULE\n");
    text.into_bytes()
});

/// Every target a little elsewhere.
fn moved(task: &Task<'_>) -> Rewritten {
    let changes: Vec<Change> = (0_u32..)
        .zip(&task.listing.motions)
        .filter_map(|(motion, listed)| {
            let target = listed.targets[0].value.ok()?.cartesian().copied()?;
            let [w, x, y, z] = target.quaternion;
            let new = NewTarget::Cartesian {
                position_mm: target.position_mm.map(|value| value + 0.123_4),
                quaternion: [w + 0.001, x, y, z],
                conf: Some(target.conf),
            };
            Some(Change { motion, targets: [new].into(), before: Vec::new() })
        })
        .collect();
    task.rewrite(&changes, &RewriteOptions::default()).expect("edits do not overlap")
}

/// A grinding path of so many MoveL: the cuts of the blade that ships with the project, over and over, inline.
fn blade(moves: usize) -> (Vec<u8>, Vec<Joints>) {
    let file = truegrind::surfaces::sample::BLADE.read().expect("ships with the project");
    let nominal = truegrind::robots::load("abb-irb-120").expect("in the catalogue").model;
    let path = toolpath(&file, &nominal, "abb-irb-120").expect("is reached");
    let mut draft = path.draft.clone();
    draft.named_targets = false;
    let lines = path.draft.steps.iter().filter(|step| step.kind == MotionKind::Linear);
    draft.steps.truncate(1);
    draft.steps.extend(lines.cycle().take(moves).cloned());
    (writer::write(&draft).expect("a draft that can be written"), path.joints)
}

/// An arm as a calibration leaves it: every link a little off, 24 parameters with a covariance, a measured region.
fn estimated(joints: &[Joints]) -> Estimated {
    let nominal = truegrind::robots::load("abb-irb-120").expect("in the catalogue").model;
    let mut random = ChaCha8Rng::seed_from_u64(120);
    let mut model = nominal.clone();
    let order = link_parameters(&nominal);
    for parameter in &order {
        let Parameter::Link { joint, coordinate } = *parameter else { continue };
        let size = if coordinate.is_length() { 0.4 } else { 0.002 };
        let link = &mut model.links[joint];
        link.set(coordinate, link.get(coordinate) + size * random.random_range(-1.0..1.0));
    }
    let n = order.len();
    let factor = DMatrix::from_fn(n, n, |_, _| random.random_range(-1e-4..1e-4));
    let still = StageErrors { fitted: ErrorSummary::default(), held_out: ErrorSummary::default() };
    // Measured around the path, as a careful operator does.
    let around = |q: &Joints| q.map(|v| v + random.random_range(-0.1..0.1));
    let measured: Vec<Joints> = joints.iter().map(around).collect();
    Estimated {
        robot: "abb-irb-120".into(),
        nominal,
        model,
        parameters: Vec::new(),
        order,
        covariance: &factor * factor.transpose(),
        width_uncertainty: None,
        provenance: Provenance::default(),
        registered: still,
        calibrated: still,
        noise_floor_mm: None,
        beyond_noise_mm: None,
        beyond_noise_rad: None,
        verdict: Verdict { status: Judgement::NotEvaluated, reasons: Vec::new() },
        region: Region::of(&measured, 1.0),
        condition: Condition::default(),
    }
}

static BLADE: LazyLock<(Vec<u8>, Estimated)> = LazyLock::new(|| {
    let (module, joints) = blade(100_000);
    let estimated = estimated(&joints);
    (module, estimated)
});

/// The whole way of `compensate` but for reading and writing files: parse, solve every target, check between the
/// points, predict σ, edit. All threads.
#[divan::bench(sample_count = 10)]
fn compensate_module(bencher: Bencher<'_, '_>) {
    let (module, estimated) = &*BLADE;
    bencher.counter(BytesCount::new(module.len())).bench_local(|| {
        let task = Task::read(&[("path.mod", black_box(module))]);
        let planned = plan(&task.listing, estimated, &Cell::default(), &Options::default());
        let rewritten = task.rewrite(&planned.changes, &RewriteOptions::default()).expect("disjoint edits");
        assert!(planned.changes.len() > 99_000, "{} changes", planned.changes.len());
        rewritten.files[0].edits.apply(module).expect("edits are within the file")
    });
}

/// The same two as files, where they stay to be looked at.
static FILES: LazyLock<PathBuf> = LazyLock::new(|| {
    let (module, estimated) = &*BLADE;
    let folder = Path::new(env!("CARGO_TARGET_TMPDIR")).join("module");
    fs::create_dir_all(&folder).expect("a folder");
    fs::write(folder.join("path.mod"), module).expect("a module");
    let model = estimated.to_toml().expect("finite numbers");
    fs::write(folder.join("model.toml"), model).expect("a model");
    folder
});

/// The whole way from file to file, as a user goes it.
#[divan::bench(sample_count = 10)]
fn compensate_file(bencher: Bencher<'_, '_>) {
    let folder = &*FILES;
    bencher.bench_local(|| {
        let output = Command::new(env!("CARGO_BIN_EXE_truegrind"))
            .current_dir(folder)
            .args(["compensate", "path.mod", "--model", "model.toml", "-o", "out.mod"])
            .output()
            .expect("the binary starts");
        let code = output.status.code();
        assert!(matches!(code, Some(0 | 1)), "{code:?}: {}", String::from_utf8_lossy(&output.stderr));
    });
}

/// Of that, the kinematics: every target solved, checked and judged.
#[divan::bench(sample_count = 10)]
fn plan_module(bencher: Bencher<'_, '_>) {
    let (module, estimated) = &*BLADE;
    let task = Task::read(&[("path.mod", module)]);
    bencher.bench_local(|| plan(&task.listing, estimated, &Cell::default(), &Options::default()));
}

#[divan::bench]
fn lex_module(bencher: Bencher<'_, '_>) {
    bencher.counter(BytesCount::new(MODULE.len())).bench(|| lex(black_box(&MODULE)));
}

#[divan::bench]
fn parse_module(bencher: Bencher<'_, '_>) {
    bencher.counter(BytesCount::new(MODULE.len())).bench(|| parse(black_box(&MODULE)));
}

#[divan::bench]
fn list_motions(bencher: Bencher<'_, '_>) {
    bencher.counter(BytesCount::new(MODULE.len())).bench(|| Task::read(&[("path.mod", black_box(&MODULE))]));
}

#[divan::bench]
fn rewrite_module(bencher: Bencher<'_, '_>) {
    bencher.counter(BytesCount::new(MODULE.len())).bench(|| {
        let task = Task::read(&[("path.mod", black_box(&MODULE))]);
        let rewritten = moved(&task);
        rewritten.files[0].edits.apply(&MODULE).expect("edits are within the file")
    });
}
