//! Programs as the command line names them: modules of one task, task lists, NC files, folders.

use std::collections::BTreeSet;
use std::path::{Component, Path, PathBuf};

use anyhow::{Context, bail};
use clap::Args;
use truegrind::compensation;
use truegrind::compensation::cell::Cell;
use truegrind::programs::nc::setup::Setup;
use truegrind::programs::rapid::task_list;
use truegrind::programs::reading::{Language, Program};
use truegrind::units::key::sha256;
use truegrind::units::run::Unit;

use super::terminal::tell;
use super::{files, inputs};

/// Files that are read and rewritten together.
#[derive(Debug)]
pub(super) struct Programs {
    /// Files, in the order of the listing.
    pub(super) files: Vec<(PathBuf, Vec<u8>)>,
    /// Task lists that named some of them.
    lists: Vec<(PathBuf, Vec<u8>)>,
}

/// Which modules are read as one task.
#[derive(Debug, Clone, Copy, Args)]
pub(super) struct Grouping {
    /// Every module is a program of its own, not one task together with the others that are named.
    #[arg(long, conflicts_with = "together")]
    each: bool,
    /// All RAPID modules below a folder are one task, as in a controller's backup; without it each is a program of its own.
    #[arg(long)]
    together: bool,
    /// A task list (.pgf) may name modules outside its own folder.
    #[arg(long)]
    outside: bool,
}

/// Where the files of one task are, before they are read.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(super) struct Job {
    /// Modules, a task list, or one NC file.
    pub(super) paths: Vec<PathBuf>,
    /// The folder that was named, where it was one: outputs keep their place below it.
    pub(super) under: Option<PathBuf>,
}

impl Job {
    /// Its files, or the folder where it is one task.
    pub(super) fn name(&self) -> String {
        match &self.under {
            Some(under) if self.paths.len() > 1 => under.display().to_string(),
            _ => self.paths.iter().map(|path| path.display().to_string()).collect::<Vec<_>>().join(", "),
        }
    }

    /// Its name below the folder that was given, with `/` between folders: the same on every machine that is given the same folder,
    /// wherever it lies there.
    pub(super) fn name_below(&self) -> String {
        let below = |path: &Path| {
            let path = self.under.as_ref().and_then(|under| path.strip_prefix(under).ok()).unwrap_or(path);
            let parts = path.components().map(|part| part.as_os_str().to_string_lossy().into_owned());
            parts.collect::<Vec<_>>().join("/")
        };
        self.paths.iter().map(|path| below(path)).collect::<Vec<_>>().join(", ")
    }

    /// As a list of units holds it.
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

    /// From a list of units.
    pub(super) fn of_unit(unit: &Unit) -> Self {
        Self {
            under: unit.under.as_ref().map(PathBuf::from),
            paths: unit.paths.iter().map(PathBuf::from).collect(),
        }
    }

    /// Its files; a task list stands for those that it names.
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

    /// Where a file goes in the folder of outputs: below a folder that was named, or beside a task list, everything keeps
    /// its place.
    pub(super) fn place(&self, path: &Path) -> PathBuf {
        let beside_list = || self.paths.iter().filter(|path| is_list(path)).filter_map(|list| list.parent());
        let below = self.under.as_deref().into_iter().chain(beside_list());
        let place = below
            .filter_map(|under| path.strip_prefix(under).ok())
            .find(|place| place.components().all(|part| matches!(part, Component::Normal(_))));
        place.map_or_else(|| files::name(path).into(), Path::to_path_buf)
    }
}

/// Whether a file is a task list.
fn is_list(path: &Path) -> bool {
    path.extension().is_some_and(|ending| ending.eq_ignore_ascii_case("pgf"))
}

/// The modules of a task list, where they are.
fn listed(list: &Path, bytes: &[u8]) -> Vec<PathBuf> {
    let folder = list.parent().unwrap_or(Path::new(""));
    task_list::modules(bytes).iter().map(|module| on_disk(folder, module)).collect()
}

/// Whether a task list may have this module read: a plain file that stands below the folder of the list, links followed;
/// `outside`: anywhere.
fn allowed(list: &Path, module: &Path, outside: bool) -> anyhow::Result<()> {
    let found = std::fs::metadata(module);
    if found.is_ok_and(|found| !found.is_file()) {
        bail!(
            "{}: named in {}, is no plain file: a folder, a device or a pipe is not read",
            module.display(),
            list.display()
        );
    }
    let folder = list.parent().filter(|folder| !folder.as_os_str().is_empty()).unwrap_or(Path::new("."));
    let below = match (module.canonicalize(), folder.canonicalize()) {
        (Ok(module), Ok(folder)) => module.starts_with(folder),
        // One that is not there: as it is written.
        _ => module.strip_prefix(list.parent().unwrap_or(Path::new(""))).is_ok_and(|rest| {
            rest.components().all(|part| matches!(part, Component::Normal(_) | Component::CurDir))
        }),
    };
    if !below && !outside {
        bail!(
            "{}: named in {}, stands outside the folder of that list: put it there, or allow it with --outside",
            module.display(),
            list.display()
        );
    }
    Ok(())
}

/// A task list that may name modules anywhere: those stand for it.
fn outside_of(list: &Path) -> anyhow::Result<Job> {
    let modules = listed(list, &files::read(list)?);
    for module in &modules {
        allowed(list, module, true)?;
    }
    if modules.is_empty() {
        bail!("{}: names no module", list.display());
    }
    Ok(Job { paths: modules, under: list.parent().map(Path::to_path_buf) })
}

/// A file that a controller's list names: its paths have backslashes, and it takes no notice of case. Where there is no
/// such file, the name as it was written.
fn on_disk(folder: &Path, name: &str) -> PathBuf {
    let literal = folder.join(name);
    if literal.exists() {
        return literal;
    }
    let mut place = folder.to_path_buf();
    for part in name.split(['\\', '/']).filter(|part| !part.is_empty() && *part != ".") {
        let next = place.join(part);
        let open = if place.as_os_str().is_empty() { Path::new(".") } else { place.as_path() };
        let alike = || {
            let entries = std::fs::read_dir(open).ok()?;
            let names = entries.filter_map(|entry| entry.ok()?.file_name().into_string().ok());
            let same = names.filter(|name| name.to_lowercase() == part.to_lowercase());
            Some(place.join(same.min()?))
        };
        place = if next.exists() { next } else { alike().unwrap_or(next) };
    }
    if place.is_file() { place } else { literal }
}

/// The tasks that the command line names. RAPID modules named one by one are one task, unless each shall be its own; a
/// task list, an NC file and every program of a folder is a task of its own.
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
                // An ending that says nothing: the file itself does.
                Language::of(&name, &files::read(path).unwrap_or_default())
            }) == Language::Nc;
        if alone && outside && is_list(path) {
            jobs.push(outside_of(path)?);
        } else if alone {
            jobs.push(Job { paths: vec![path.clone()], under: None });
        } else {
            together.push(path.clone());
        }
    }
    if !together.is_empty() {
        jobs.insert(0, Job { paths: together, under: None });
    }
    // What is read late is an input from here on: no output of one program is the source of the next.
    for path in jobs.iter().flat_map(|job| job.paths.iter().cloned().chain(job.files())) {
        files::expect(&path)?;
    }
    if jobs.is_empty() {
        bail!(
            "no program found: a folder is searched for .mod, .prg, .sys, .pgf, .nc, .mpf, .ngc, .h and the like"
        );
    }
    Ok(jobs)
}

/// Every file below a folder that is wanted, in the order of names.
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
            // Links to folders are not followed: they could lead round in a circle.
            if kind.is_dir() {
                open.push(path);
            } else if is_wanted(&path) && path.is_file() {
                found.push(path);
            } else if kind.is_symlink() && path.is_dir() {
                tell(format_args!(
                    "note: {}: a link to a folder is not followed; name the folder",
                    path.display()
                ));
            }
        }
    }
    found.sort();
    Ok(found)
}

/// Every program below a folder, in the order of names. What a task list names is not taken again on its own; `as_one`:
/// all RAPID modules are one task, and lists say nothing new.
fn in_folder(folder: &Path, as_one: bool, jobs: &mut Vec<Job>) -> anyhow::Result<()> {
    let mut found = found_below(folder, |path| Language::by_name(&files::name(path)).is_some())?;
    let under = Some(folder.to_path_buf());
    if as_one {
        let (modules, others): (Vec<_>, Vec<_>) = found
            .into_iter()
            .filter(|path| !is_list(path))
            .partition(|path| Language::by_name(&files::name(path)) == Some(Language::Rapid));
        if !modules.is_empty() {
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

impl Programs {
    /// Reads the files of one task; a `.pgf` stands for the modules that it lists.
    pub(super) fn read(paths: &[PathBuf]) -> anyhow::Result<Self> {
        let (mut files, mut lists) = (Vec::new(), Vec::new());
        for path in paths {
            let bytes = files::read(path)?;
            if is_list(path) {
                for place in listed(path, &bytes) {
                    allowed(path, &place, false)?;
                    let module =
                        files::read(&place).with_context(|| format!("named in {}", path.display()))?;
                    files.push((place, module));
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

    /// All that was read, by name and SHA-256: what decides, beside model, cell and options, what comes of it.
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

    /// The names of the files, for a report.
    pub(super) fn name(&self) -> String {
        self.files.iter().map(|(path, _)| files::name(path)).collect::<Vec<_>>().join(", ")
    }
}

/// What cell file and robot file say that NC programs do not say themselves. `robot` is a name of the catalogue or a
/// file; one that is not found says nothing.
pub(super) fn setup(cell: &Cell, robot: Option<&str>) -> Setup {
    let orientation =
        robot.and_then(|name| inputs::robot(name).ok()).and_then(|robot| robot.sheet.orientation());
    compensation::cell::nc_setup::setup(cell, orientation)
}
