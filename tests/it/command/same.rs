//! The same inputs give the same bytes, from run to run and for any number of threads.
//!
//! The class: whatever an output takes from the machine and not from the inputs: the clock, the order of a hash, names of temporary
//! files, folders, numbers of threads.

use std::fs;
use std::path::Path;

use super::{CABLE, files, folder, truegrind};

/// Every verb that computes, with all its outputs, in the folder `at`.
fn everything(at: &Path, threads: &str) {
    let root = Path::new(env!("CARGO_MANIFEST_DIR"));
    fs::write(at.join("data.csv"), CABLE).unwrap();
    fs::write(at.join("recipe.toml"), include_str!("../../data/irb120-cable.toml")).unwrap();
    fs::write(
        at.join("mine.toml"),
        "name = \"mine\"\ntitle = \"Mine\"\npaper = \"ours\"\n[methods]\nreference = \"B\"\n[methods.protocol]\nrows = \
         100\nheld_out = 0.2\ncases = 2\n[[methods.method]]\nid = \"A\"\nname = \"EKF\"\nsolver = \"ekf\"\ntreatment = \
         \"sound\"\n[[methods.method]]\nid = \"B\"\nname = \"LM\"\nsolver = \"lm\"\ntreatment = \"sound\"\n",
    )
    .unwrap();
    fs::create_dir(at.join("programs")).unwrap();
    for name in ["straight.mod", "circles.mod", "fanuc.nc", "siemens.mpf"] {
        fs::copy(root.join("programs").join(name), at.join("programs").join(name)).unwrap();
    }
    fs::copy(root.join("surfaces/dome.toml"), at.join("dome.toml")).unwrap();
    let pages = |stem: &str| -> Vec<String> {
        ["json", "csv", "parquet", "md", "html"]
            .iter()
            .map(|kind| format!("--{kind}={stem}.{kind}"))
            .collect()
    };
    let data = ["data.csv", "--robot", "abb-irb-120"];
    for (stem, verb, threaded) in [
        ("sim", vec!["simulate", "recipe.toml", "-o", "sim.csv", "--arm", "actual.toml"], false),
        ("id", [&["identify"][..], &data, &["-o", "model.toml"]].concat(), true),
        ("why", [&["diagnose"][..], &data, &["-o", "caused.toml"]].concat(), true),
        ("path", vec!["path", "dome.toml", "--robot", "abb-irb-120", "-o", "programs/dome.mod"], false),
        (
            "plan",
            vec![
                "plan",
                "--robot",
                "abb-irb-120",
                "--sensor",
                "cable",
                "--outlet",
                "750,200,40",
                "--poses",
                "12",
                "--candidates",
                "120",
                "-o",
                "poses.mod",
            ],
            true,
        ),
        ("compare", [&["compare"][..], &data, &["--experiment", "mine.toml"]].concat(), true),
        (
            "track",
            vec!["track", "data.csv", "--model", "model.toml", "-o", "tracks", "--date", "2026-05-04"],
            true,
        ),
        (
            "one",
            vec![
                "compensate",
                "programs/dome.mod",
                "--model",
                "caused.toml",
                "-o",
                "dome.mod",
                "--diff",
                "one.diff",
            ],
            true,
        ),
        (
            "many",
            vec!["compensate", "programs", "--model", "model.toml", "-o", "real", "--diff", "many.diff"],
            true,
        ),
        (
            "dev",
            vec![
                "deviation",
                "programs/dome.mod",
                "--model",
                "model.toml",
                "caused.toml",
                "--surface",
                "dome.toml",
            ],
            true,
        ),
    ] {
        let mut outputs = if threaded { pages(stem) } else { Vec::new() };
        if cfg!(feature = "visual") && ["id", "why", "plan", "compare", "track", "one", "dev"].contains(&stem)
        {
            outputs.push(format!("--rrd={stem}.rrd"));
        }
        let mut arguments: Vec<&str> = verb;
        arguments.extend(outputs.iter().map(String::as_str));
        if threaded {
            arguments.extend(["--threads", threads]);
        }
        let (code, out, err) = truegrind(at, &arguments);
        assert!(code == 0 || code == 1, "{arguments:?}: {err}");
        fs::write(at.join(format!("{stem}.out")), out).unwrap();
        fs::write(at.join(format!("{stem}.err")), err).unwrap();
    }
}

/// Files of a folder and of those in it, by their names below it.
fn all(at: &Path, below: &Path, out: &mut Vec<(String, Vec<u8>)>) {
    for path in files(below) {
        if path.is_dir() {
            all(at, &path, out);
        } else {
            let name = path.strip_prefix(at).unwrap().display().to_string();
            out.push((name, fs::read(&path).unwrap()));
        }
    }
}

#[test]
fn every_verb_writes_the_same_bytes_for_any_number_of_threads() {
    let runs: Vec<Vec<(String, Vec<u8>)>> = ["1", "2", "3"]
        .map(|threads| {
            let dir = folder();
            everything(dir.path(), threads);
            let mut found = Vec::new();
            all(dir.path(), dir.path(), &mut found);
            let here = dir.path().display().to_string();
            for (name, bytes) in &found {
                let text = String::from_utf8_lossy(bytes);
                assert!(!text.contains(&here), "{name} names the folder that it was made in");
            }
            found
        })
        .into();
    for other in &runs[1..] {
        let names = |run: &[(String, Vec<u8>)]| run.iter().map(|(name, _)| name.clone()).collect::<Vec<_>>();
        assert_eq!(names(&runs[0]), names(other));
        for ((name, a), (_, b)) in runs[0].iter().zip(other) {
            // What `track` tells on stderr says how long it took.
            assert!(a == b || name == "track.err", "{name} differs");
        }
    }
    assert!(runs[0].len() > 60, "{}", runs[0].len());
}
