//! Every sample of `programs/` is printed back byte for byte, and its motions are listed as in `listings/`.
//! `TRUEGRIND_UPDATE_LISTINGS=1` rewrites the listings.

use std::collections::BTreeSet;
use std::fmt::Write as _;
use std::path::{Path, PathBuf};

use truegrind_programs::motion::{Listing, Origin, Reason, Switch, TargetValue};
use truegrind_programs::rapid::{Task, task_list};
use truegrind_programs::rewrite::{Change, NewTarget, RewriteOptions};

pub(crate) fn root() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("../..")
}

/// A sample by its name: its files with their bytes.
pub(crate) type Sample = (String, Vec<(String, Vec<u8>)>);

/// Samples that belong together: a task list names several, every other file is alone.
pub(crate) fn groups() -> Vec<Sample> {
    let folder = root().join("programs");
    let mut files: Vec<PathBuf> =
        std::fs::read_dir(&folder).unwrap().map(|entry| entry.unwrap().path()).collect();
    files.sort();
    let read = |name: &str| (name.to_owned(), std::fs::read(folder.join(name)).unwrap());
    let mut together = BTreeSet::new();
    let mut groups = Vec::new();
    for file in &files {
        if file.extension().is_some_and(|extension| extension == "pgf") {
            let modules = task_list::modules(&std::fs::read(file).unwrap());
            assert!(!modules.is_empty());
            together.extend(modules.clone());
            let name = file.file_stem().unwrap().to_str().unwrap().to_owned();
            groups.push((name, modules.iter().map(|module| read(module)).collect()));
        }
    }
    for file in &files {
        let name = file.file_name().unwrap().to_str().unwrap();
        let rapid =
            ["mod", "modx", "prg", "sys"].iter().any(|wanted| file.extension().is_some_and(|e| e == *wanted));
        if rapid && !together.contains(name) {
            groups.push((file.file_stem().unwrap().to_str().unwrap().to_owned(), vec![read(name)]));
        }
    }
    groups
}

pub(crate) fn read<'s>(files: &'s [(String, Vec<u8>)]) -> Task<'s> {
    let files: Vec<(&str, &[u8])> = files.iter().map(|(name, bytes)| (&**name, &**bytes)).collect();
    Task::read(&files)
}

pub(crate) fn told(listing: &Listing, names: &[String]) -> String {
    let mut out = String::new();
    for motion in &listing.motions {
        let name = &names[motion.place.file as usize];
        let routine = motion.routine.map_or("-", |routine| &listing.routines[routine as usize].name);
        let frames = [listing.tool(motion).map(|t| &t.name), listing.work_object(motion).map(|w| &w.name)];
        let frames = frames.map(|name| name.map_or("-", String::as_str)).join(" ");
        let process = [listing.speed(motion).map(|s| &s.text), listing.zone(motion).map(|z| &z.text)];
        let process = process.map(|text| text.map_or("-", String::as_str)).join(" ");
        write!(out, "{name}:{}:{} {routine} {} ", motion.place.line, motion.place.column, motion.instruction)
            .unwrap();
        write!(out, "{:?} | {process} | {frames}", motion.kind).unwrap();
        for target in &motion.targets {
            let origin = match target.origin {
                Origin::Declared(index) => listing.declarations[index as usize].name.clone(),
                Origin::Element { declaration, .. } => {
                    format!("{}{{}}", listing.declarations[declaration as usize].name)
                }
                other => format!("{other:?}"),
            };
            match &target.value {
                Ok(TargetValue::Cartesian(t)) => {
                    write!(out, " | {origin} {:.4?} {:.5?} {:?}", t.position_mm, t.quaternion, t.conf)
                        .unwrap();
                }
                Ok(TargetValue::Joint(t)) => write!(out, " | {origin} {:?}", t.robot_deg).unwrap(),
                Err(reason) => write!(out, " | {origin} ? {reason}").unwrap(),
            }
        }
        let modal = motion.modal;
        for (name, switch, normal) in [
            ("ConfL", modal.conf_linear, Switch::On),
            ("ConfJ", modal.conf_joint, Switch::On),
            ("displaced", modal.displacement, Switch::Off),
            ("wrist", modal.wrist_interpolation, Switch::Off),
            ("sync", modal.synchronised, Switch::Off),
        ] {
            if switch != normal {
                write!(out, " | {name} {switch:?}").unwrap();
            }
        }
        for (flag, name) in
            [(motion.in_loop, "loop"), (motion.conditional, "conditional"), (motion.timed, "timed")]
        {
            if flag {
                write!(out, " | {name}").unwrap();
            }
        }
        match motion.previous {
            Some(previous) => {
                write!(out, " | after {}", listing.motions[previous as usize].place.line).unwrap()
            }
            None => out.push_str(" | after ?"),
        }
        match motion.reason() {
            Some(reason) => writeln!(out, " | LEFT {reason}").unwrap(),
            None => out.push('\n'),
        }
    }
    for region in &listing.opaque {
        let name = &names[region.place.file as usize];
        writeln!(out, "{name}:{}:{} opaque: {}", region.place.line, region.place.column, region.reason)
            .unwrap();
    }
    out
}

#[test]
fn every_sample_comes_back_and_is_listed_as_expected() {
    let update = std::env::var_os("TRUEGRIND_UPDATE_LISTINGS").is_some();
    let groups = groups();
    assert!(groups.len() >= 14, "{}", groups.len());
    for (name, files) in &groups {
        let task = read(files);
        for (tree, (_, bytes)) in task.trees.iter().zip(files) {
            assert_eq!(tree.print(), *bytes, "{name}");
        }
        let found = told(&task.listing, &task.names);
        let path =
            Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/it/listings").join(format!("{name}.txt"));
        if update {
            std::fs::write(&path, &found).unwrap();
        }
        let expected = std::fs::read_to_string(&path).unwrap_or_default();
        assert_eq!(
            found, expected,
            "{name}: run with TRUEGRIND_UPDATE_LISTINGS=1 to write {path:?}, then read it"
        );
    }
}

#[test]
fn only_the_sample_of_broken_programs_has_opaque_regions() {
    for (name, files) in &groups() {
        let task = read(files);
        assert_eq!(
            task.listing.opaque.is_empty(),
            name != "broken" && name != "encoded",
            "{name}: {:?}",
            task.listing.opaque
        );
    }
}

#[test]
fn every_reason_to_leave_a_motion_has_a_sample() {
    let mut seen = BTreeSet::new();
    let mut look = |listing: &Listing| {
        for motion in &listing.motions {
            seen.extend(motion.own_reason);
            seen.extend(motion.targets.iter().filter_map(|target| target.value.err()));
        }
        seen.extend(listing.tools.iter().filter_map(|tool| tool.value.err()));
        seen.extend(listing.work_objects.iter().filter_map(|work_object| work_object.value.as_ref().err()));
    };
    for (_, files) in &groups() {
        look(&read(files).listing);
    }
    for (name, bytes) in &super::nc::samples() {
        look(&super::nc::read(name, bytes).listing);
    }
    // These belong to rewriting and are tested there.
    let rewriting = [
        Reason::NoInsertion,
        Reason::NoJointForm,
        Reason::WrongKind,
        Reason::BeforeOrigin,
        Reason::BeforeIncrement,
        Reason::BeforeOmitted,
        Reason::LineTooLong,
        Reason::OpenCircle,
    ];
    let missing: Vec<_> =
        Reason::ALL.iter().filter(|reason| !seen.contains(reason) && !rewriting.contains(reason)).collect();
    assert!(missing.is_empty(), "{missing:?}");
}

#[test]
fn rewriting_with_the_same_values_changes_no_byte() {
    for (name, files) in &groups() {
        let task = read(files);
        let changes: Vec<Change> = (0_u32..)
            .zip(&task.listing.motions)
            .map(|(motion, listed)| {
                let targets = listed.targets.iter().map(|target| match target.value {
                    Ok(TargetValue::Cartesian(t)) => {
                        // As after a computation: normalised, of either sign, with noise.
                        let q = t.pose().rotation.quaternion().coords;
                        NewTarget::Cartesian {
                            position_mm: t.position_mm.map(|x| x + 3e-11),
                            quaternion: [-q[3], -q[0], -q[1], -q[2]],
                            conf: Some(t.conf),
                        }
                    }
                    Ok(TargetValue::Joint(t)) => {
                        NewTarget::Joint { robot_deg: t.robot_deg.map(|q| q - 2e-12) }
                    }
                    Err(_) => NewTarget::Keep,
                });
                Change { motion, targets: targets.collect(), before: vec![] }
            })
            .collect();
        let rewritten = task.rewrite(&changes, &RewriteOptions::default()).unwrap();
        for (file, (_, bytes)) in rewritten.files.iter().zip(files) {
            assert!(file.edits.is_empty(), "{name}: {:?}", file.edits);
            assert_eq!(file.edits.apply(bytes).unwrap(), *bytes);
        }
    }
}
