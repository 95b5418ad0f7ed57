//! Programs on the command line: modules of one task, task lists, NC files, folders.

use std::collections::{BTreeMap, BTreeSet};
use std::path::{Component, Path, PathBuf};

use anyhow::{Context, bail};
use clap::Args;
use rayon::prelude::*;
use truegrind::file_kind::FileKind;
use truegrind::programs::nc::called::called_programs;
use truegrind::programs::nc::setup::Setup;
use truegrind::programs::rapid::task_list;
use truegrind::programs::reading::{Language, Program};
use truegrind::units::key::sha256;
use truegrind::units::run::Unit;

use super::files;
use super::terminal::print_message;

/// The files of one task, read and rewritten together.
#[derive(Debug)]
pub(super) struct Programs {
    /// Files, in the order of the listing.
    pub(super) files: Vec<(PathBuf, Vec<u8>)>,
    /// The task lists that named them.
    lists: Vec<(PathBuf, Vec<u8>)>,
}

/// Which modules form one task.
#[derive(Debug, Clone, Copy, Args)]
pub(super) struct Grouping {
    /// Treat every named module as a separate program. By default the named modules form one task.
    #[arg(long, conflicts_with = "together")]
    each: bool,
    /// Treat all RAPID modules below a folder as one task; in a controller backup, those of each task (RAPID/TASK1 and so on). By default
    /// each is a separate program.
    #[arg(long)]
    together: bool,
    /// Allow a task list (.pgf) to name modules outside its own folder.
    #[arg(long)]
    outside: bool,
}

/// Paths of the files of one task.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(super) struct Job {
    /// Modules, a task list, or one NC file.
    pub(super) paths: Vec<PathBuf>,
    /// The folder in which they were found, if any: outputs keep their relative path.
    pub(super) under: Option<PathBuf>,
}

impl Job {
    /// Its files, or the folder that forms the task.
    pub(super) fn name(&self) -> String {
        match &self.under {
            Some(under) if self.paths.len() > 1 => under.display().to_string(),
            _ => self.paths.iter().map(|path| path.display().to_string()).collect::<Vec<_>>().join(", "),
        }
    }

    /// Its path relative to the given folder, with `/` as separator: the same on every machine, wherever the folder is.
    pub(super) fn name_below(&self) -> String {
        let below = |path: &Path| {
            let path = self.under.as_ref().and_then(|under| path.strip_prefix(under).ok()).unwrap_or(path);
            let parts = path.components().map(|part| part.as_os_str().to_string_lossy().into_owned());
            parts.collect::<Vec<_>>().join("/")
        };
        self.paths.iter().map(|path| below(path)).collect::<Vec<_>>().join(", ")
    }

    /// Its entry in a list of units.
    pub(super) fn unit(&self) -> anyhow::Result<Unit> {
        let text = |path: &PathBuf| match path.to_str() {
            Some(text) => Ok(text.to_owned()),
            None => bail!("{}: not UTF-8; a shared run needs names that can be listed", path.display()),
        };
        Ok(Unit {
            under: self.under.as_ref().map(text).transpose()?,
            paths: self.paths.iter().map(text).collect::<anyhow::Result<_>>()?,
        })
    }

    /// The job of an entry in a list of units.
    pub(super) fn of_unit(unit: &Unit) -> Self {
        Self {
            under: unit.under.as_ref().map(PathBuf::from),
            paths: unit.paths.iter().map(PathBuf::from).collect(),
        }
    }

    /// Its files; a task list is replaced by the modules that it names.
    pub(super) fn files(&self) -> Vec<PathBuf> {
        let mut out = Vec::new();
        for path in &self.paths {
            match is_list(path).then(|| files::read(path)) {
                Some(Ok(bytes)) => out.extend(listed(path, &bytes)),
                _ => out.push(path.clone()),
            }
        }
        out
    }

    /// The path of a file in the output folder: relative to the given folder or to its task list.
    pub(super) fn relative_output(&self, path: &Path) -> PathBuf {
        let beside_list = || self.paths.iter().filter(|path| is_list(path)).filter_map(|list| list.parent());
        let below = self.under.as_deref().into_iter().chain(beside_list());
        let relative = below
            .filter_map(|under| path.strip_prefix(under).ok())
            .find(|relative| relative.components().all(|part| matches!(part, Component::Normal(_))));
        relative.map_or_else(|| files::name(path).into(), Path::to_path_buf)
    }
}

/// Whether a file is a task list.
fn is_list(path: &Path) -> bool {
    path.extension().is_some_and(|ending| ending.eq_ignore_ascii_case("pgf"))
}

/// The paths of the modules of a task list.
fn listed(list: &Path, bytes: &[u8]) -> Vec<PathBuf> {
    let folder = list.parent().unwrap_or(Path::new(""));
    task_list::modules(bytes).iter().map(|module| find_module(folder, module)).collect()
}

/// Refuses a module that is no plain file, or that lies outside the folder of its task list (links followed) unless
/// `outside` allows it.
fn check_listed(list: &Path, module: &Path, outside: bool) -> anyhow::Result<()> {
    let found = std::fs::metadata(module);
    if found.is_ok_and(|found| !found.is_file()) {
        bail!("{}: named in {}, is not a regular file", module.display(), list.display());
    }
    let folder = list.parent().filter(|folder| !folder.as_os_str().is_empty()).unwrap_or(Path::new("."));
    let below = match (module.canonicalize(), folder.canonicalize()) {
        (Ok(module), Ok(folder)) => module.starts_with(folder),
        // A missing file: judged by its written path.
        _ => module.strip_prefix(list.parent().unwrap_or(Path::new(""))).is_ok_and(|rest| {
            rest.components().all(|part| matches!(part, Component::Normal(_) | Component::CurDir))
        }),
    };
    if !below && !outside {
        bail!(
            "{}: named in {}, lies outside the folder of that task list: move it there, or allow it with --outside",
            module.display(),
            list.display()
        );
    }
    Ok(())
}

/// The job of a task list that may name modules anywhere.
fn job_of_list(list: &Path) -> anyhow::Result<Job> {
    let modules = listed(list, &files::read(list)?);
    for module in &modules {
        check_listed(list, module, true)?;
    }
    if modules.is_empty() {
        bail!("{}: the task list names no module", list.display());
    }
    Ok(Job { paths: modules, under: list.parent().map(Path::to_path_buf) })
}

/// Finds a file by the name in a controller's list, which has backslashes and ignores case; the written name if there is none.
fn find_module(folder: &Path, name: &str) -> PathBuf {
    let literal = folder.join(name);
    if literal.exists() {
        return literal;
    }
    let mut resolved = folder.to_path_buf();
    for part in name.split(['\\', '/']).filter(|part| !part.is_empty() && *part != ".") {
        let next = resolved.join(part);
        let open = if resolved.as_os_str().is_empty() { Path::new(".") } else { resolved.as_path() };
        let alike = || {
            let entries = std::fs::read_dir(open).ok()?;
            let names = entries.filter_map(|entry| entry.ok()?.file_name().into_string().ok());
            let same = names.filter(|name| name.to_lowercase() == part.to_lowercase());
            Some(resolved.join(same.min()?))
        };
        resolved = if next.exists() { next } else { alike().unwrap_or(next) };
    }
    if resolved.is_file() { resolved } else { literal }
}

/// The tasks that the command line names. Named RAPID modules form one task unless `each` is set; every task list, NC file
/// and program of a folder is a separate task.
pub(super) fn jobs(
    paths: &[PathBuf],
    Grouping { each, together: as_one, outside }: Grouping,
) -> anyhow::Result<Vec<Job>> {
    let mut jobs = Vec::new();
    let mut together = Vec::new();
    for path in paths {
        if path.is_dir() {
            in_folder(path, as_one, &mut jobs)?;
            continue;
        }
        let name = files::name(path);
        let alone = each
            || is_list(path)
            || Language::by_name(&name).unwrap_or_else(|| {
                // An unknown extension: the content decides.
                Language::of(&name, &files::read(path).unwrap_or_default())
            }) == Language::Nc;
        if alone && outside && is_list(path) {
            jobs.push(job_of_list(path)?);
        } else if alone {
            jobs.push(Job { paths: vec![path.clone()], under: None });
        } else {
            together.push(path.clone());
        }
    }
    if !together.is_empty() {
        jobs.insert(0, Job { paths: together, under: None });
    }
    // Register all files as inputs now, so that no output of one program overwrites the source of a later one.
    for path in jobs.iter().flat_map(|job| job.paths.iter().cloned().chain(job.files())) {
        files::expect(&path)?;
    }
    if jobs.is_empty() {
        bail!(
            "no program found: folders are searched for .mod, .prg, .sys, .pgf, .nc, .mpf, .ngc, .h and other NC extensions"
        );
    }
    Ok(jobs)
}

/// The wanted files below a folder, sorted by path.
pub(super) fn found_below(folder: &Path, is_wanted: impl Fn(&Path) -> bool) -> anyhow::Result<Vec<PathBuf>> {
    let mut found = Vec::new();
    let mut open = vec![folder.to_path_buf()];
    while let Some(next) = open.pop() {
        let entries =
            std::fs::read_dir(&next).with_context(|| format!("{}: cannot be read", next.display()))?;
        for entry in entries {
            let entry = entry.with_context(|| format!("{}: cannot be read", next.display()))?;
            let (path, kind) = (entry.path(), entry.file_type());
            let Ok(kind) = kind else { continue };
            // Links to folders are not followed, since they may form a cycle.
            if kind.is_dir() {
                open.push(path);
            } else if is_wanted(&path) && path.is_file() {
                found.push(path);
            } else if kind.is_symlink() && path.is_dir() {
                print_message(format_args!(
                    "note: {}: a link to a folder is not followed; name the folder",
                    path.display()
                ));
            }
        }
    }
    found.sort();
    Ok(found)
}

/// Every program below a folder, sorted by path. Modules of a task list are not listed again; `as_one`: all RAPID modules
/// form one task, and task lists are ignored.
fn in_folder(folder: &Path, as_one: bool, jobs: &mut Vec<Job>) -> anyhow::Result<()> {
    let mut found = found_below(folder, |path| Language::by_name(&files::name(path)).is_some())?;
    let under = Some(folder.to_path_buf());
    if as_one {
        let (modules, others): (Vec<_>, Vec<_>) = found
            .into_iter()
            .filter(|path| !is_list(path))
            .partition(|path| Language::by_name(&files::name(path)) == Some(Language::Rapid));
        for modules in of_tasks(folder, modules)? {
            jobs.push(Job { paths: modules, under: under.clone() });
        }
        found = others;
    }
    let mut listed_there: BTreeSet<PathBuf> = BTreeSet::new();
    for path in found.iter().filter(|path| is_list(path)) {
        listed_there.extend(files::read(path).iter().flat_map(|bytes| listed(path, bytes)));
    }
    jobs.extend(
        found
            .into_iter()
            .filter(|path| !listed_there.contains(path))
            .map(|path| Job { paths: vec![path], under: under.clone() }),
    );
    Ok(())
}

/// Drops the programs that move nothing from several, such as the tasks of a backup that only handle signals.
pub(super) fn drop_without_motion(jobs: &mut Vec<Job>) -> anyhow::Result<()> {
    if jobs.len() < 2 {
        return Ok(());
    }
    let mut moving = Vec::new();
    for job in &*jobs {
        let files = Programs::read(&job.paths)?;
        if !files.task(&Setup::default()).listing().motions.is_empty() {
            moving.push(job.clone());
        }
    }
    if !moving.is_empty() {
        *jobs = moving;
    }
    Ok(())
}

/// The folder of the task in a controller backup in which a module lies: `…/RAPID/TASK1`.
fn task_folder(path: &Path) -> Option<&Path> {
    let is = |folder: &Path, test: &dyn Fn(&str) -> bool| {
        folder.file_name().and_then(|name| name.to_str()).is_some_and(|name| test(&name.to_ascii_uppercase()))
    };
    path.ancestors().skip(1).find(|folder| {
        is(folder, &|name| name.starts_with("TASK"))
            && folder.parent().is_some_and(|parent| is(parent, &|name| name == "RAPID"))
    })
}

/// The modules below a folder by task: all in one, or in a controller backup those of each of its tasks. Modules beside them (HOME) run in
/// none of them, as far as the backup tells.
///
/// # Errors
/// If several tasks move a robot: a model belongs to one arm.
fn of_tasks(folder: &Path, modules: Vec<PathBuf>) -> anyhow::Result<Vec<Vec<PathBuf>>> {
    let mut tasks: BTreeMap<PathBuf, Vec<PathBuf>> = BTreeMap::new();
    let mut beside = Vec::new();
    for path in modules {
        match task_folder(&path).map(Path::to_path_buf) {
            Some(task) => tasks.entry(task).or_default().push(path),
            None => beside.push(path),
        }
    }
    if tasks.is_empty() {
        return Ok(if beside.is_empty() { Vec::new() } else { vec![beside] });
    }
    if !beside.is_empty() {
        let names: Vec<String> = beside.iter().map(|path| path.display().to_string()).collect();
        print_message(format_args!(
            "note: in no task of the backup, and left as they are: {}; name them to correct them",
            names.join(", ")
        ));
    }
    if tasks.len() > 1 {
        let mut moving = Vec::new();
        for (task, paths) in &tasks {
            let files = Programs::read(paths)?;
            if !files.task(&Setup::default()).listing().motions.is_empty() {
                moving.push(task.display().to_string());
            }
        }
        if moving.len() > 1 {
            bail!(
                "{}: several tasks move a robot: {}. A model belongs to one arm: name the folder of its task",
                folder.display(),
                moving.join(", ")
            );
        }
    }
    Ok(tasks.into_values().collect())
}

impl Programs {
    /// Reads the files of one task; a `.pgf` is replaced by the modules that it lists.
    pub(super) fn read(paths: &[PathBuf]) -> anyhow::Result<Self> {
        let (mut files, mut lists) = (Vec::new(), Vec::new());
        for path in paths {
            let bytes = files::read(path)?;
            if is_list(path) {
                for resolved in listed(path, &bytes) {
                    check_listed(path, &resolved, false)?;
                    let module =
                        files::read(&resolved).with_context(|| format!("named in {}", path.display()))?;
                    files.push((resolved, module));
                }
                lists.push((path.clone(), bytes));
            } else {
                files.push((path.clone(), bytes));
            }
        }
        if files.is_empty() {
            bail!("no module to read: the task list names none");
        }
        Ok(Self { files, lists })
    }

    /// The same files in the order of those of the same names in `jobs`, where these are as many: motions are listed file by file.
    pub(super) fn in_order_of(mut self, jobs: &[Job]) -> Self {
        let name = |path: &Path| files::name(path).to_lowercase();
        let wanted: Vec<String> = jobs.iter().flat_map(Job::files).map(|path| name(&path)).collect();
        let own: BTreeSet<String> = self.files.iter().map(|(path, _)| name(path)).collect();
        let others: BTreeSet<String> = wanted.iter().cloned().collect();
        if own == others && own.len() == self.files.len() {
            self.files.sort_by_key(|(path, _)| wanted.iter().position(|other| *other == name(path)));
        }
        self
    }

    /// Name and SHA-256 of every file read, for the key of the unit.
    pub(super) fn content(&self) -> Vec<(String, String)> {
        let all = self.lists.iter().chain(&self.files);
        all.map(|(path, bytes)| (path.display().to_string(), sha256(bytes))).collect()
    }

    /// The task.
    pub(super) fn task(&self, setup: &Setup) -> Program<'_> {
        let names: Vec<String> = self.files.iter().map(|(p, _)| files::name(p)).collect();
        let sources: Vec<(&str, &[u8])> =
            names.iter().zip(&self.files).map(|(n, (_, b))| (n.as_str(), b.as_slice())).collect();
        Program::read(&sources, setup)
    }

    /// Refuses files of another kind, for programs in which no motion was found.
    pub(super) fn refuse_other_kinds(&self) -> anyhow::Result<()> {
        for (path, bytes) in &self.files {
            let name = files::name(path);
            if Language::by_name(&name).is_none()
                && let Some(kind) = FileKind::of(&name, bytes)
            {
                bail!(
                    "{}: {}; expected a program: RAPID (.mod, .prg, .sys, .pgf) or NC code (.nc, .mpf, .h and others)",
                    path.display(),
                    kind.text()
                );
            }
        }
        Ok(())
    }

    /// The file names, for reports.
    pub(super) fn name(&self) -> String {
        self.files.iter().map(|(path, _)| files::name(path)).collect::<Vec<_>>().join(", ")
    }
}

/// The NC programs of a run that other programs of it call.
pub(super) fn called(jobs: &[Job]) -> BTreeSet<String> {
    let is_nc = |path: &&PathBuf| Language::by_name(&files::name(path)) == Some(Language::Nc);
    let paths: Vec<&PathBuf> = jobs.iter().flat_map(|job| &job.paths).filter(is_nc).collect();
    if paths.len() < 2 {
        return BTreeSet::new();
    }
    let calls = |path: &&PathBuf| called_programs(&files::read(path).unwrap_or_default());
    paths.par_iter().flat_map_iter(calls).collect()
}
