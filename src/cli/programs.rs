//! Programs as the command line names them: modules of one task, task lists, NC files, folders.

use std::collections::BTreeSet;
use std::path::{Path, PathBuf};

use anyhow::{Context, bail};
use truegrind::compensation::cell::{Cell, CellFrame};
use truegrind::program::motion::Frame;
use truegrind::program::nc::orientation::Angles;
use truegrind::program::nc::setup::Setup;
use truegrind::program::rapid::task_list;
use truegrind::program::reading::{Language, Program};
use truegrind::robots::sheet::Orientation;

use super::{files, inputs};

/// Files that are read and rewritten together.
#[derive(Debug)]
pub(super) struct Programs {
    /// Files, in the order of the listing.
    pub(super) files: Vec<(PathBuf, Vec<u8>)>,
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
    /// Its files; a task list stands for those that it names.
    pub(super) fn files(&self) -> Vec<PathBuf> {
        let list = |path: &Path| path.extension().is_some_and(|e| e.eq_ignore_ascii_case("pgf"));
        let mut out = Vec::new();
        for path in &self.paths {
            match list(path).then(|| files::read(path)) {
                Some(Ok(bytes)) => {
                    out.extend(task_list::modules(&bytes).iter().map(|module| inputs::beside(path, module)));
                }
                _ => out.push(path.clone()),
            }
        }
        out
    }

    /// Where a file goes in the folder of outputs: below a folder that was named everything keeps its place.
    pub(super) fn place(&self, path: &Path) -> PathBuf {
        match &self.under {
            Some(under) => {
                path.strip_prefix(under).map_or_else(|_| files::name(path).into(), Path::to_path_buf)
            }
            None => PathBuf::from(files::name(path)),
        }
    }
}

/// The tasks that the command line names. RAPID modules named one by one are one task, unless each shall be its own; a
/// task list, an NC file and every program of a folder is a task of its own.
pub(super) fn jobs(paths: &[PathBuf], each: bool) -> anyhow::Result<Vec<Job>> {
    let mut jobs = Vec::new();
    let mut together = Vec::new();
    for path in paths {
        if path.is_dir() {
            in_folder(path, &mut jobs)?;
            continue;
        }
        let ending = path.extension().map(|ending| ending.to_string_lossy().to_ascii_lowercase());
        let name = files::name(path);
        let alone = each
            || ending.as_deref() == Some("pgf")
            || Language::by_name(&name).unwrap_or_else(|| {
                // An ending that says nothing: the file itself does.
                Language::of(&name, &files::read(path).unwrap_or_default())
            }) == Language::Nc;
        if alone {
            jobs.push(Job { paths: vec![path.clone()], under: None });
        } else {
            together.push(path.clone());
        }
    }
    if !together.is_empty() {
        jobs.insert(0, Job { paths: together, under: None });
    }
    if jobs.is_empty() {
        bail!(
            "no program found: a folder is searched for .mod, .prg, .sys, .pgf, .nc, .mpf, .ngc, .h and the like"
        );
    }
    Ok(jobs)
}

/// Every program below a folder, in the order of names. What a task list names is not taken again on its own.
fn in_folder(folder: &Path, jobs: &mut Vec<Job>) -> anyhow::Result<()> {
    let mut found = Vec::new();
    let mut open = vec![folder.to_path_buf()];
    while let Some(next) = open.pop() {
        let entries =
            std::fs::read_dir(&next).with_context(|| format!("{}: cannot be read", next.display()))?;
        for entry in entries {
            let entry = entry.with_context(|| format!("{}: cannot be read", next.display()))?;
            let (path, kind) = (entry.path(), entry.file_type());
            // Links are not followed: they could lead round in a circle.
            match kind {
                Ok(kind) if kind.is_dir() => open.push(path),
                Ok(kind) if kind.is_file() && Language::by_name(&files::name(&path)).is_some() => {
                    found.push(path)
                }
                _ => {}
            }
        }
    }
    found.sort();
    let mut listed: BTreeSet<PathBuf> = BTreeSet::new();
    for path in &found {
        if path.extension().is_some_and(|ending| ending.eq_ignore_ascii_case("pgf"))
            && let Ok(bytes) = files::read(path)
        {
            listed.extend(task_list::modules(&bytes).iter().map(|module| inputs::beside(path, module)));
        }
    }
    let under = Some(folder.to_path_buf());
    jobs.extend(
        found
            .into_iter()
            .filter(|path| !listed.contains(path))
            .map(|path| Job { paths: vec![path], under: under.clone() }),
    );
    Ok(())
}

impl Programs {
    /// Reads the files of one task; a `.pgf` stands for the modules that it lists.
    pub(super) fn read(paths: &[PathBuf]) -> anyhow::Result<Self> {
        let mut files = Vec::new();
        for path in paths {
            let bytes = files::read(path)?;
            if path.extension().is_some_and(|e| e.eq_ignore_ascii_case("pgf")) {
                for module in task_list::modules(&bytes) {
                    let place = inputs::beside(path, &module);
                    files.push((place.clone(), files::read(&place)?));
                }
            } else {
                files.push((path.clone(), bytes));
            }
        }
        if files.is_empty() {
            bail!("no module to read: the task list names none");
        }
        Ok(Self { files })
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
    let frames = |list: &[CellFrame]| -> Vec<(String, Frame)> {
        list.iter().filter_map(|frame| Some((frame.name.clone(), Frame::from_pose(&frame.pose()?)))).collect()
    };
    Setup {
        dialect: None,
        angles: orientation.and_then(angles),
        tools: frames(&cell.tool),
        frames: frames(&cell.wobj),
    }
}

/// The convention of A, B and C that a robot file names; quaternions are no three angles.
pub(super) fn angles(orientation: Orientation) -> Option<Angles> {
    match orientation {
        Orientation::Quaternion => None,
        Orientation::Abc => Some(Angles::Abc),
        Orientation::Wpr => Some(Angles::Wpr),
        Orientation::RotationVector => Some(Angles::RotationVector),
        Orientation::Rxyz => Some(Angles::Rxyz),
    }
}
