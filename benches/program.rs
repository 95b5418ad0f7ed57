//! Reading and rewriting a RAPID module of 100,000 MoveL (15.9 MB): MB/s per core, and the way from bytes to bytes.
//!
//! `cargo bench --no-default-features --bench program`

use std::hint::black_box;
use std::sync::LazyLock;

use divan::Bencher;
use divan::counter::BytesCount;
use truegrind::program::rapid::Task;
use truegrind::program::rapid::lexer::lex;
use truegrind::program::rapid::parser::parse;
use truegrind::program::rewrite::{Change, NewTarget, RewriteOptions, Rewritten};

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
            Some(Change { motion, targets: vec![new], before: Vec::new() })
        })
        .collect();
    task.rewrite(&changes, &RewriteOptions::default()).expect("edits do not overlap")
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
