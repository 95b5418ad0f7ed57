//! Where programs come from and go to: folders, task lists, links, diffs, and outputs that would end in one file.

use std::fs;

use truegrind::arm::estimated::Estimated;

use super::{json, module, motions, truegrind, workshop};

#[test]
fn a_folder_is_done_in_parallel_past_what_cannot_be_done() {
    let dir = workshop();
    let at = dir.path();
    fs::create_dir_all(at.join("in/below")).unwrap();
    fs::write(at.join("in/a.mod"), module("A", 5, 0.0)).unwrap();
    fs::write(at.join("in/below/b.mod"), module("A", 4, 10.0)).unwrap();
    fs::write(at.join("in/c.mod"), "MODULE C\n  ! truegrind 0.0.1 model ffffffffffff\nENDMODULE\n").unwrap();
    fs::write(at.join("in/d.mod"), [1, 2, 3, 4, 5, 0, 0, 1]).unwrap();
    fs::write(at.join("in/e.pgf"), "<Program><Module>e1.mod</Module></Program>").unwrap();
    fs::write(at.join("in/e1.mod"), module("E", 3, 20.0)).unwrap();
    fs::write(at.join("in/f.pgf"), "<Program><Module>nowhere.mod</Module></Program>").unwrap();
    fs::write(at.join("in/g.nc"), "G21 G90\nG1 X1 Y2 Z3 F100\n").unwrap();
    fs::write(at.join("in/notes.txt"), "no program").unwrap();
    let run = |out: &str, threads: &str| {
        truegrind(
            at,
            &[
                "compensate",
                "in",
                "--model",
                "model.toml",
                "-o",
                out,
                "--csv",
                "rows.csv",
                "--json",
                "all.json",
                "--md",
                "all.md",
                "--html",
                "all.html",
                "--diff",
                "all.diff",
                "--threads",
                threads,
            ],
        )
    };
    let (code, text, err) = run("out", "1");
    assert_eq!(code, 1, "{text}\n{err}");
    let rows = fs::read_to_string(at.join("rows.csv")).unwrap();
    let status = |file: &str| -> Vec<String> {
        let row = rows.lines().find(|row| row.contains(file)).unwrap_or_else(|| panic!("{file}: {rows}"));
        row.split(',').take(4).map(str::to_owned).collect()
    };
    assert_eq!(rows.lines().count(), 8, "{rows}");
    assert_eq!(status("in/a.mod")[1..], ["changed", "5", "5"]);
    assert_eq!(status("in/below/b.mod")[1..], ["changed", "4", "4"]);
    assert_eq!(status("in/c.mod")[1], "failed");
    assert_eq!(status("in/d.mod")[1..3], ["unchanged", "0"]);
    assert_eq!(status("in/e1.mod")[1..], ["changed", "3", "3"]);
    assert_eq!(status("in/f.pgf")[1], "failed");
    assert_eq!(status("in/g.nc")[1..], ["unchanged", "1", "0"]);
    let all = json(&fs::read_to_string(at.join("all.json")).unwrap());
    assert_eq!(all["failed"].as_array().unwrap().len(), 2);
    assert_eq!(all["totals"]["motions"], 13);
    assert_eq!(all["programs"].as_array().unwrap().len(), 5);
    for page in ["all.md", "all.html"] {
        let page = fs::read_to_string(at.join(page)).unwrap();
        // The folder that all share is said once, below the names.
        assert!(page.contains("below/b.mod") && page.contains("Programs are in in/"), "{page}");
        assert!(page.contains("nowhere.mod"), "{page}");
    }
    // Below the folder everything keeps its place; what was not done is not there.
    for (file, there) in [
        ("a.mod", true),
        ("below/b.mod", true),
        ("c.mod", false),
        ("d.mod", true),
        ("e1.mod", true),
        ("g.nc", true),
    ] {
        assert_eq!(at.join("out").join(file).exists(), there, "{file}");
    }
    assert_eq!(fs::read(at.join("out/d.mod")).unwrap(), [1, 2, 3, 4, 5, 0, 0, 1]);
    // The same bytes for any number of threads, and a diff that says what changed.
    let diff = fs::read_to_string(at.join("all.diff")).unwrap();
    assert!(diff.contains("--- in/a.mod\n+++ out/a.mod\n@@ -1,"), "{diff}");
    assert_eq!(diff.lines().filter(|line| line.starts_with("-    MoveL")).count(), 12);
    let (_, _, _) = run("out2", "2");
    for file in ["a.mod", "below/b.mod", "e1.mod"] {
        assert_eq!(
            fs::read(at.join("out").join(file)).unwrap(),
            fs::read(at.join("out2").join(file)).unwrap(),
            "{file}"
        );
    }
    // Once more over what was written: all of it is done already.
    let (code, text, _) = truegrind(at, &["compensate", "out", "--model", "model.toml", "-o", "out3"]);
    assert_eq!(code, 1);
    assert!(text.contains("3 already compensated"), "{text}");
    // The deviation of all of them: what cannot be judged is listed, the others are.
    let (code, text, err) = truegrind(at, &["deviation", "in", "--model", "model.toml", "--json"]);
    assert_eq!(code, 1, "{err}");
    let programs = json(&text)["programs"].as_array().unwrap().clone();
    let names: Vec<&str> = programs.iter().map(|program| program["program"].as_str().unwrap()).collect();
    assert_eq!(names, ["a.mod", "below/b.mod", "e.pgf"], "{err}");
    assert!(err.contains("failed: in/f.pgf") && err.contains("failed: in/g.nc"), "{err}");
}

/// A program in which nothing is corrected makes the parts that it always made: headline, pages, JSON and exit code say so alike.
#[test]
fn a_folder_with_a_program_that_stays_as_it_was_is_not_ok() {
    let dir = workshop();
    let at = dir.path();
    fs::create_dir_all(at.join("in")).unwrap();
    fs::write(at.join("in/a.mod"), module("A", 5, 0.0)).unwrap();
    let run = |out: &str| {
        let arguments =
            ["compensate", "in", "--model", "model.toml", "-o", out, "--json", "all.json", "--md", "all.md"];
        let (code, text, err) = truegrind(at, &arguments);
        let all = json(&fs::read_to_string(at.join("all.json")).unwrap());
        let status = all["verdict"]["status"].as_str().unwrap_or_default().to_owned();
        assert!(text.contains(&format!("[{status}]")), "{text}\n{err}");
        assert!(
            fs::read_to_string(at.join("all.md"))
                .unwrap()
                .contains(all["verdict"]["headline"].as_str().unwrap())
        );
        (code, status)
    };
    assert_eq!(run("alone"), (0, "ok".to_owned()));
    // Nothing is refused or flagged: its tool is not in the text.
    fs::write(at.join("in/b.mod"), module("B", 5, 0.0).replace("tool0", "tNowhere")).unwrap();
    assert_eq!(run("both"), (1, "warning".to_owned()));
}

/// A controller backup holds a folder for each task: what one sets is not set in another, and one model is that of one arm.
#[test]
fn a_backup_is_read_by_tasks() {
    let dir = workshop();
    let at = dir.path();
    for folder in ["b/RAPID/TASK1/PROGMOD", "b/RAPID/TASK2/PROGMOD", "b/HOME"] {
        fs::create_dir_all(at.join(folder)).unwrap();
    }
    let work = module("Work", 5, 0.0);
    let other = "MODULE Other\n  PROC main()\n    PDispSet shift;\n  ENDPROC\nENDMODULE\n";
    fs::write(at.join("b/RAPID/TASK1/PROGMOD/Work.mod"), &work).unwrap();
    fs::write(at.join("b/RAPID/TASK2/PROGMOD/Other.mod"), other).unwrap();
    fs::write(at.join("b/HOME/Old.mod"), &work).unwrap();
    let run = |out: &str| {
        truegrind(
            at,
            &["compensate", "b", "--model", "model.toml", "--together", "-o", out, "--json", "all.json"],
        )
    };
    let (code, text, err) = run("out");
    assert!(code == 0 || code == 1, "{text}\n{err}");
    assert!(err.contains("in no task of the backup") && err.contains("Old.mod"), "{err}");
    assert_ne!(fs::read_to_string(at.join("out/RAPID/TASK1/PROGMOD/Work.mod")).unwrap(), work);
    // The corrected backup is judged beside the whole original, of which one task moves nothing.
    let judge = |intended: &str, more: &[&str]| {
        let arguments = ["deviation", "out", "--intended", intended, "--model", "model.toml"];
        truegrind(at, &[&arguments[..], more].concat())
    };
    let (code, text, err) = judge("b", &["--together"]);
    assert!(code < 2 && text.contains("PROGMOD/Work.mod"), "{text}{err}");
    let (code, _, err) = judge("b", &[]);
    assert!(code == 2 && err.contains("--together"), "{err}");
    // Two tasks that move are two arms, or an arm and something else.
    fs::write(at.join("b/RAPID/TASK2/PROGMOD/Other.mod"), module("Other", 5, 0.0)).unwrap();
    let (code, _, err) = run("two");
    assert_eq!(code, 2, "{err}");
    assert!(
        err.contains("several tasks move a robot") && err.contains("TASK1") && err.contains("TASK2"),
        "{err}"
    );
    assert!(!at.join("two").exists());
}

#[test]
fn modules_of_a_folder_are_one_task_when_asked() {
    let dir = workshop();
    let at = dir.path();
    fs::create_dir_all(at.join("backup/SYSMOD")).unwrap();
    fs::create_dir_all(at.join("backup/PROGMOD")).unwrap();
    let data = "MODULE Data(SYSMODULE)\n  PERS tooldata tWheel:=[TRUE,[[0,0,100],[1,0,0,0]],[1,[0,0,50],[1,0,0,0],0,0,0]];\n\
                ENDMODULE\n";
    fs::write(at.join("backup/SYSMOD/Data.sys"), data).unwrap();
    let work = module("Work", 5, 0.0).replace(",450]", ",350]").replace("tool0", "tWheel");
    fs::write(at.join("backup/PROGMOD/Work.mod"), &work).unwrap();
    let run = |more: &[&str]| {
        let arguments = ["compensate", "backup", "--model", "model.toml", "--json", "all.json"];
        truegrind(at, &[&arguments, more].concat())
    };
    let contract = || json(&fs::read_to_string(at.join("all.json")).unwrap());
    // Each by itself: the tool is not there, and the way out is named. Nothing was corrected, which is not done.
    let (code, text, err) = run(&["-o", "alone"]);
    assert_eq!(code, 1, "{text}\n{err}");
    assert!(text.contains("Nothing was corrected") && !text.contains("[ok]"), "{text}");
    assert!(text.contains("declared in no file: tWheel"), "{text}");
    assert!(err.contains("5 motions") && err.contains("--together"), "{err}");
    assert_eq!(fs::read_to_string(at.join("alone/PROGMOD/Work.mod")).unwrap(), work);
    // Together they are one task; every file keeps its place.
    let (code, text, err) = run(&["-o", "out", "--together"]);
    assert!(code == 0 || code == 1, "{text}\n{err}");
    assert!(!err.contains("--together"), "{err}");
    let found = motions(&contract(), 0);
    assert_eq!(found.len(), 5);
    assert!(found.iter().all(|(_, status, _)| status == "changed" || status == "flagged"), "{found:?}");
    assert_eq!(fs::read_to_string(at.join("out/SYSMOD/Data.sys")).unwrap(), data);
    assert_ne!(fs::read_to_string(at.join("out/PROGMOD/Work.mod")).unwrap(), work);
    // A task list as a Windows controller writes it says the same.
    let list = "<Program>\n<Module>progmod\\WORK.mod</Module><Module>SYSMOD\\Data.sys</Module></Program>";
    fs::write(at.join("backup/task.pgf"), list).unwrap();
    let (code, text, err) =
        truegrind(at, &["compensate", "backup/task.pgf", "--model", "model.toml", "-o", "listed"]);
    assert!(code == 0 || code == 1, "{text}\n{err}");
    for file in ["PROGMOD/Work.mod", "SYSMOD/Data.sys"] {
        let [a, b] = ["out", "listed"].map(|out| fs::read(at.join(out).join(file)).unwrap());
        assert_eq!(a, b, "{file}");
    }
    // In a folder the list stands for its modules, and with --together nothing is taken twice.
    let (_, text, err) = run(&["-o", "again"]);
    assert!(text.contains("1 program") && !err.contains("--together"), "{text}\n{err}");
    let (_, _, err) = run(&["-o", "whole", "--together"]);
    assert_eq!(
        fs::read(at.join("whole/PROGMOD/Work.mod")).unwrap(),
        fs::read(at.join("out/PROGMOD/Work.mod")).unwrap(),
        "{err}"
    );
    let (code, text, err) =
        truegrind(at, &["deviation", "backup", "--together", "--model", "model.toml", "--csv", "points.csv"]);
    assert_eq!(code, 0, "{text}\n{err}");
    assert_eq!(fs::read_to_string(at.join("points.csv")).unwrap().lines().count(), 6);
}

/// Motions are listed file by file: two modules that are named in another order than those of the original were another program.
#[test]
fn the_order_in_which_modules_are_named_does_not_matter() {
    let dir = workshop();
    let at = dir.path();
    for folder in ["in", "out"] {
        fs::create_dir_all(at.join(folder)).unwrap();
    }
    fs::write(at.join("in/a.mod"), module("A", 5, 0.0)).unwrap();
    fs::write(at.join("in/b.mod"), module("B", 5, 60.0).replace("main", "second")).unwrap();
    let (code, text, err) =
        truegrind(at, &["compensate", "in/a.mod", "in/b.mod", "--model", "model.toml", "-o", "out"]);
    assert!(code < 2, "{text}{err}");
    let judge = |files: [&str; 2]| {
        let intended = ["--intended", "in/a.mod", "--intended", "in/b.mod", "--model", "model.toml"];
        truegrind(at, &[&["deviation", files[0], files[1]], &intended[..]].concat())
    };
    let (code, text, err) = judge(["out/a.mod", "out/b.mod"]);
    assert!(code < 2, "{text}{err}");
    let (other, text, err) = judge(["out/b.mod", "out/a.mod"]);
    assert!(other == code, "{text}{err}");
}

#[cfg(unix)]
#[test]
fn links_to_files_of_a_folder_are_programs_too() {
    let dir = workshop();
    let at = dir.path();
    fs::create_dir_all(at.join("in")).unwrap();
    fs::write(at.join("real.mod"), module("A", 2, 0.0)).unwrap();
    std::os::unix::fs::symlink("../real.mod", at.join("in/a.mod")).unwrap();
    std::os::unix::fs::symlink("..", at.join("in/up")).unwrap();
    let (code, _, err) = truegrind(at, &["compensate", "in", "--model", "model.toml", "-o", "out"]);
    assert!(code == 0 || code == 1, "{err}");
    assert!(err.contains("in/up: a link to a folder is not followed"), "{err}");
    assert!(fs::read_to_string(at.join("out/a.mod")).unwrap().contains("truegrind"));
    assert_eq!(fs::read_to_string(at.join("real.mod")).unwrap(), module("A", 2, 0.0));
}

#[test]
fn dry_run_check_and_diff_write_no_program() {
    let dir = workshop();
    let at = dir.path();
    fs::write(at.join("a.mod"), module("A", 5, 0.0)).unwrap();
    let (code, text, err) =
        truegrind(at, &["compensate", "a.mod", "--model", "model.toml", "--dry-run", "--diff"]);
    assert_eq!(code, 0, "{err}");
    assert!(text.contains("--- a.mod\n+++ a.mod\n"), "{text}");
    assert!(text.contains("+  ! truegrind ") || text.contains("+! truegrind "), "{text}");
    let (code, _, _) = truegrind(at, &["compensate", "a.mod", "--model", "model.toml", "--check"]);
    assert_eq!(code, 1, "something would change");
    assert_eq!(fs::read_to_string(at.join("a.mod")).unwrap(), module("A", 5, 0.0));
    // A program of another model: refused, and with --again said to add up.
    let (code, _, err) = truegrind(at, &["compensate", "a.mod", "--model", "model.toml", "-o", "b.mod"]);
    assert_eq!(code, 0, "{err}");
    let text = fs::read_to_string(at.join("model.toml")).unwrap();
    fs::write(at.join("other.toml"), format!("{text}\n# another\n")).unwrap();
    let (code, _, err) = truegrind(at, &["compensate", "b.mod", "--model", "other.toml", "-o", "c.mod"]);
    assert_eq!(code, 2);
    assert!(err.contains("--again") && !at.join("c.mod").exists(), "{err}");
    let (code, out, err) =
        truegrind(at, &["compensate", "b.mod", "--model", "other.toml", "-o", "c.mod", "--again"]);
    // It was asked for, but nobody knows what deviates now.
    assert_eq!(code, 1, "{err}");
    assert!(err.contains("add up"), "{err}");
    assert!(out.contains("[warning] Corrected a second time") && !out.contains("expected after"), "{out}");
    let marked = fs::read_to_string(at.join("c.mod")).unwrap();
    assert_eq!(marked.matches("truegrind 0").count(), 1, "one mark, of the new model: {marked}");
    // A fragment carries no mark, and that is said.
    let fragment =
        module("A", 2, 0.0).lines().filter(|line| line.contains("MoveL")).collect::<Vec<_>>().join("\n");
    fs::write(at.join("f.mod"), fragment).unwrap();
    let (code, _, err) = truegrind(at, &["compensate", "f.mod", "--model", "model.toml", "-o", "g.mod"]);
    assert_eq!(code, 0, "{err}");
    assert!(err.contains("carries no mark"), "{err}");
    assert!(Estimated::from_toml(&text).is_ok());
}

#[test]
fn two_programs_never_end_in_one_file() {
    let dir = workshop();
    let at = dir.path();
    for (folder, shift) in [("left", 0.0), ("right", 1.0)] {
        fs::create_dir(at.join(folder)).unwrap();
        fs::write(at.join(folder).join("a.mod"), module("A", 5, shift)).unwrap();
    }
    let run = |arguments: &[&str]| {
        let common = ["--model", "model.toml", "-o", "out"];
        truegrind(at, &[&["compensate"], arguments, &common].concat())
    };
    for arguments in [
        &["left/a.mod", "right/a.mod"][..],
        &["left/a.mod", "right/a.mod", "--each"],
        &["left", "right"],
        &["left", "right/a.mod"],
    ] {
        let (code, _, err) = run(arguments);
        assert_eq!(code, 2, "{arguments:?}: {err}");
        let both = err.contains("left/a.mod and right/a.mod would")
            || err.contains("right/a.mod and left/a.mod would");
        assert!(both && err.contains("both be written to a.mod"), "{err}");
        assert!(!at.join("out").exists(), "{arguments:?}");
    }
    // Several programs go into a folder, and those of a shared run.
    for arguments in [&["left/a.mod", "--resume"][..], &["left", "--each"]] {
        let common = ["--model", "model.toml", "-o", "one.mod"];
        let (code, _, err) = truegrind(at, &[&["compensate"], arguments, &common].concat());
        assert_eq!(code, 2, "{arguments:?}");
        assert!(err.contains("one.mod: named like one program"), "{arguments:?}: {err}");
        assert!(!at.join("one.mod").exists(), "{arguments:?}");
    }
    let (code, _, err) = run(&["left/a.mod", "left/a.mod"]);
    assert_eq!(code, 2);
    assert!(err.contains("left/a.mod is named twice"), "{err}");
    // A module of two tasks.
    for list in ["left/one.pgf", "left/two.pgf"] {
        fs::write(at.join(list), "<Program><Module>a.mod</Module></Program>").unwrap();
    }
    let (code, _, err) = run(&["left/one.pgf", "left/two.pgf"]);
    assert_eq!(code, 2);
    let told = err.split_whitespace().collect::<Vec<_>>().join(" ");
    assert!(
        told.contains("left/a.mod belongs to left/one.pgf and to left/two.pgf")
            && told.contains("one task at a time"),
        "{err}"
    );
}

#[cfg(unix)]
#[test]
fn links_and_pipes_stay_what_they_are() {
    let dir = workshop();
    let at = dir.path();
    fs::write(at.join("a.mod"), module("A", 5, 0.0)).unwrap();
    let compensate =
        |output: &str| truegrind(at, &["compensate", "a.mod", "--model", "model.toml", "-o", output]);
    assert_eq!(compensate("plain.mod").0, 0);
    let plain = fs::read(at.join("plain.mod")).unwrap();
    // The standard output: the program and nothing else.
    let (code, text, err) = compensate("-");
    assert_eq!((code, text.as_bytes() == plain), (0, true), "{text}");
    assert!(err.contains("Compensation of a.mod") && !at.join("-").exists(), "{err}");
    // A link: the file that it names is written.
    fs::write(at.join("target.mod"), "old").unwrap();
    std::os::unix::fs::symlink("target.mod", at.join("link.mod")).unwrap();
    assert_eq!(compensate("link.mod").0, 0);
    assert!(fs::symlink_metadata(at.join("link.mod")).unwrap().is_symlink());
    assert_eq!(fs::read(at.join("target.mod")).unwrap(), plain);
    // A link to an input is that input.
    std::os::unix::fs::symlink("a.mod", at.join("input.mod")).unwrap();
    let (code, _, err) = compensate("input.mod");
    assert_eq!(code, 2);
    assert!(err.contains("inputs are never overwritten"), "{err}");
    // A pipe: written into, not replaced.
    let pipe = at.join("pipe");
    assert!(std::process::Command::new("mkfifo").arg(&pipe).status().unwrap().success());
    let reader = std::thread::spawn({
        let pipe = pipe.clone();
        move || fs::read(pipe).unwrap()
    });
    assert_eq!(compensate("pipe").0, 0);
    assert_eq!(reader.join().unwrap(), plain);
    assert!(!fs::metadata(&pipe).unwrap().is_file());
}

/// A report that would go where a program of the folder goes is refused before the first program is written.
#[test]
fn a_report_over_a_program_is_refused_before_anything_is_written() {
    let dir = workshop();
    let at = dir.path();
    fs::create_dir_all(at.join("in/below")).unwrap();
    fs::write(at.join("in/a.mod"), module("A", 3, 0.0)).unwrap();
    fs::write(at.join("in/below/b.mod"), module("B", 3, 0.0)).unwrap();
    for (option, report) in
        [("--csv", "out/a.mod"), ("--json", "out/below/../below/b.mod"), ("--diff", "./out/a.mod")]
    {
        let (code, _, err) =
            truegrind(at, &["compensate", "in", "--model", "model.toml", "-o", "out", option, report]);
        assert_eq!(code, 2, "{err}");
        assert!(!at.join("out").exists(), "{option} {report}: {err}");
    }
    let given = ["compensate", "in", "--model", "model.toml", "-o", "out", "--csv", "out.csv"];
    let (code, _, err) = truegrind(at, &given);
    assert!(code == 0 || code == 1, "{err}");
    assert!(at.join("out/a.mod").is_file() && at.join("out.csv").is_file());
}

/// A task list reads plain files below its own folder, and elsewhere only where the command line says so; a device never.
#[cfg(unix)]
#[test]
fn a_task_list_reads_no_device_and_nothing_outside_its_folder_unless_told() {
    let dir = workshop();
    let at = dir.path();
    fs::create_dir_all(at.join("in/sub")).unwrap();
    fs::write(at.join("away.mod"), module("A", 3, 0.0)).unwrap();
    fs::write(at.join("in/sub/near.mod"), module("B", 3, 0.0)).unwrap();
    std::os::unix::fs::symlink("../away.mod", at.join("in/link.mod")).unwrap();
    std::os::unix::fs::symlink("/dev/zero", at.join("in/zero.mod")).unwrap();
    let run = |module: &str, more: &[&str]| {
        fs::write(at.join("in/t.pgf"), format!("<Program><Module>{module}</Module></Program>")).unwrap();
        let given = [&["compensate", "in/t.pgf", "--model", "model.toml", "--dry-run"], more].concat();
        truegrind(at, &given)
    };
    for module in ["sub\\near.mod", "SUB/NEAR.MOD", "./sub/near.mod"] {
        let (code, _, err) = run(module, &[]);
        assert!(code == 0 || code == 1, "{module}: {err}");
    }
    let whole = at.join("away.mod").display().to_string();
    for module in ["../away.mod", "sub/../../away.mod", "link.mod", whole.as_str()] {
        let (code, _, err) = run(module, &[]);
        assert!(code == 2 && err.contains("--outside"), "{module}: {code} {err}");
        let (code, _, err) = run(module, &["--outside"]);
        assert!(code == 0 || code == 1, "{module}: {err}");
    }
    for module in ["/dev/zero", "zero.mod", "sub", "/dev/stdin"] {
        for more in [&[][..], &["--outside"]] {
            let (code, _, err) = run(module, more);
            assert!(code == 2 && err.contains("regular file"), "{module} {more:?}: {code} {err}");
        }
    }
}
