//! Where the corrected programs are written.

use std::collections::HashMap;
use std::path::{Path, PathBuf};

use anyhow::bail;

use super::arguments::Arguments;
use crate::cli::files::{self, Batch};
use crate::cli::output_extension;
use crate::cli::programs::{Job, Programs};
use truegrind::programs::reading::Language;

/// The output file of each file of a program; `None` in a dry run.
pub(super) fn output_files(
    arguments: &Arguments,
    job: &Job,
    programs: &Programs,
    several: bool,
) -> anyhow::Result<Vec<Option<PathBuf>>> {
    if arguments.writes_nothing() {
        return Ok(vec![None; programs.files.len()]);
    }
    let Some(output) = &arguments.output else { bail!(MISSING_OUTPUT) };
    let several = several || programs.files.len() > 1;
    if !several && !output.is_dir() {
        // An output that is an input is the graver fault, so it is reported before a wrong extension.
        Batch::check(&[], &[output])?;
        if let [(source, bytes)] = programs.files.as_slice() {
            output_extension::refuse_other_language(output, source, bytes)?;
        }
        return Ok(vec![Some(output.clone())]);
    }
    if arguments.prints_program() {
        bail!("-o -: stdout takes one program, and there are several: name a folder");
    }
    if output.is_file() {
        bail!("{} is a file, but there are several programs: name a folder", output.display());
    }
    Ok(programs.files.iter().map(|(path, _)| Some(output.join(job.relative_output(path)))).collect())
}

pub(super) const MISSING_OUTPUT: &str =
    "-o OUT is missing: name a file for one program or a folder for several, or use --dry-run";

/// Refuses the name of a program for what will be a folder.
pub(super) fn refuse_file_for_folder(jobs: &[Job], arguments: &Arguments) -> anyhow::Result<()> {
    let folder = match jobs {
        [job] => arguments.shares.on() || job.under.is_some() || job.files().len() > 1,
        _ => true,
    };
    match &arguments.output {
        Some(output) if folder && !output.is_dir() && Language::by_name(&files::name(output)).is_some() => {
            bail!(
                "-o {}: named like one program, but several programs, and those of a shared run, are written to a folder: name a folder",
                output.display()
            )
        }
        _ => Ok(()),
    }
}

/// Refuses two programs with the same output file.
pub(super) fn refuse_shared_output(jobs: &[Job]) -> anyhow::Result<()> {
    let mut taken: HashMap<PathBuf, (PathBuf, String)> = HashMap::new();
    for job in jobs {
        for path in job.files() {
            let relative = job.relative_output(&path);
            match taken.get(&relative) {
                Some((first, other)) if *first == path && *other != job.name() => bail!(
                    "{} belongs to {other} and to {}: each task would write a corrected version of its own. Correct one task at a time, each into \
                     its own folder",
                    path.display(),
                    job.name()
                ),
                Some((first, _)) if *first == path => bail!("{} is named twice", path.display()),
                Some((first, _)) => bail!(
                    "{} and {} would both be written to {} in the output folder: run them separately, each into its own folder",
                    first.display(),
                    path.display(),
                    relative.display()
                ),
                None => taken.insert(relative, (path, job.name())),
            };
        }
    }
    Ok(())
}

/// Refuses a report whose file is the output of a program, before anything is written.
pub(super) fn refuse_report_over_program(
    jobs: &[Job],
    output: Option<&Path>,
    reports: &[&Path],
) -> anyhow::Result<()> {
    let Some(folder) = output.filter(|output| jobs.len() > 1 || output.is_dir()) else { return Ok(()) };
    let reports: Vec<(&Path, PathBuf)> =
        reports.iter().filter_map(|report| Some((*report, files::canonical_path(report)?))).collect();
    if reports.is_empty() {
        return Ok(());
    }
    for job in jobs {
        for path in job.files() {
            let there = files::canonical_path(&folder.join(job.relative_output(&path)));
            if let Some((report, _)) = reports.iter().find(|(_, whole)| Some(whole) == there.as_ref()) {
                bail!(
                    "{} is where {} will be written: name another file for the report",
                    report.display(),
                    path.display()
                );
            }
        }
    }
    Ok(())
}

/// Adds the corrected programs to a batch; `make_folders`: creates their folders.
pub(super) fn add_programs(
    batch: &mut Batch,
    written: Vec<(PathBuf, Vec<u8>)>,
    make_folders: bool,
) -> anyhow::Result<()> {
    for (path, bytes) in written {
        if make_folders && let Some(folder) = path.parent() {
            files::make_folder(folder)?;
        }
        batch.add(path, bytes);
    }
    Ok(())
}
