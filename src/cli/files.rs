//! Files: read whole, written whole or not at all, inputs never overwritten.

use std::fs;
use std::io::Write;
use std::path::{Path, PathBuf};

use anyhow::{Context, bail};

use super::outputs::say;
use pending::Pending;

mod pending;

/// The bytes of a file.
pub(super) fn read(path: &Path) -> anyhow::Result<Vec<u8>> {
    whole(path).with_context(|| format!("{}: cannot be read", path.display()))
}

/// Files from here on are read in parts, on all threads (bytes).
#[cfg(unix)]
const LARGE: u64 = 1 << 22;

#[cfg(unix)]
fn whole(path: &Path) -> std::io::Result<Vec<u8>> {
    use std::os::unix::fs::FileExt;

    use rayon::prelude::*;

    let length = fs::metadata(path).ok().filter(fs::Metadata::is_file).map_or(0, |meta| meta.len());
    if length < LARGE {
        return fs::read(path);
    }
    let file = fs::File::open(path)?;
    let mut bytes = vec![0; length as usize];
    let part = LARGE as usize;
    let parts = bytes.par_chunks_mut(part).enumerate();
    parts.try_for_each(|(index, bytes)| file.read_exact_at(bytes, (index * part) as u64))?;
    // One that grew meanwhile is read again, to its end.
    if file.metadata()?.len() == length { Ok(bytes) } else { fs::read(path) }
}

#[cfg(not(unix))]
fn whole(path: &Path) -> std::io::Result<Vec<u8>> {
    fs::read(path)
}

/// The text of a file.
pub(super) fn read_text(path: &Path) -> anyhow::Result<String> {
    let bytes = read(path)?;
    match String::from_utf8(bytes) {
        Ok(text) => Ok(text),
        Err(error) => {
            let at = error.utf8_error().valid_up_to();
            bail!("{}: byte {at} is not UTF-8 text", path.display())
        }
    }
}

/// The name of a file as reports print it.
pub(super) fn name(path: &Path) -> String {
    path.file_name().map_or_else(|| path.display().to_string(), |n| n.to_string_lossy().into_owned())
}

/// Files to be written together: collected first, then each written to the disk beside its place, synced, and only when
/// all are there put in place.
#[derive(Debug, Default)]
pub(super) struct Batch {
    files: Vec<(PathBuf, Vec<u8>)>,
    inputs: Vec<PathBuf>,
}

impl Batch {
    /// A batch that refuses to write over `inputs`.
    pub(super) fn sparing<P: AsRef<Path>>(inputs: impl IntoIterator<Item = P>) -> Self {
        Self { files: Vec::new(), inputs: inputs.into_iter().map(|p| p.as_ref().to_path_buf()).collect() }
    }

    /// Adds a file; `-` prints it to stdout when the batch is written.
    pub(super) fn add(&mut self, path: impl Into<PathBuf>, bytes: impl Into<Vec<u8>>) {
        self.files.push((path.into(), bytes.into()));
    }

    /// Refuses early, before the work, what writing would refuse late.
    pub(super) fn check(inputs: &[&Path], outputs: &[&Path]) -> anyhow::Result<()> {
        for output in outputs.iter().filter(|o| **o != Path::new("-")) {
            for input in inputs {
                if same(output, input) {
                    bail!(
                        "{} is an input: an input is never overwritten; name another output",
                        output.display()
                    );
                }
            }
            let folder = parent(output);
            if !folder.is_dir() {
                bail!("{}: folder {} does not exist", output.display(), folder.display());
            }
        }
        Ok(())
    }

    /// Writes everything or nothing.
    pub(super) fn write(self) -> anyhow::Result<()> {
        let (mut ready, mut streams) = (Vec::new(), Vec::new());
        for (path, bytes) in &self.files {
            if path == Path::new("-") {
                continue;
            }
            if self.inputs.iter().any(|input| same(path, input)) {
                bail!("{} is an input: an input is never overwritten; name another output", path.display());
            }
            // A link is not ours to replace, nor is a device or a pipe.
            let path = linked(path);
            if fs::metadata(&path).is_ok_and(|meta| !meta.is_file() && !meta.is_dir()) {
                streams.push((path, bytes));
                continue;
            }
            let folder = parent(&path);
            let failed = || format!("{}: cannot be written; nothing was changed", path.display());
            ready.push(Pending::write(path.clone(), &folder, bytes).with_context(failed)?);
        }
        for file in ready {
            let place = file.place().to_path_buf();
            file.put(permissions(&place))
                .with_context(|| format!("{}: cannot be put in place", place.display()))?;
        }
        for (path, bytes) in streams {
            let written =
                fs::OpenOptions::new().write(true).open(&path).and_then(|mut to| to.write_all(bytes));
            written.with_context(|| format!("{}: cannot be written", path.display()))?;
        }
        for (path, bytes) in &self.files {
            if path == Path::new("-") {
                say(bytes)?;
            }
        }
        Ok(())
    }
}

/// What the file shall allow: what the one in its place allows.
#[cfg(unix)]
fn permissions(place: &Path) -> Option<fs::Permissions> {
    use std::os::unix::fs::PermissionsExt;
    let mode = fs::metadata(place).map_or(0o644, |meta| meta.permissions().mode());
    Some(fs::Permissions::from_mode(mode))
}

#[cfg(not(unix))]
fn permissions(_: &Path) -> Option<fs::Permissions> {
    None
}

/// The file that a link names; any other path as it is.
fn linked(path: &Path) -> PathBuf {
    match fs::symlink_metadata(path) {
        Ok(meta) if meta.is_symlink() => fs::canonicalize(path).unwrap_or_else(|_| path.to_path_buf()),
        _ => path.to_path_buf(),
    }
}

fn parent(path: &Path) -> PathBuf {
    match path.parent() {
        Some(folder) if !folder.as_os_str().is_empty() => folder.to_path_buf(),
        _ => PathBuf::from("."),
    }
}

fn same(a: &Path, b: &Path) -> bool {
    match (fs::canonicalize(a), fs::canonicalize(b)) {
        (Ok(a), Ok(b)) => a == b,
        _ => a == b,
    }
}

/// Makes a folder for outputs.
pub(super) fn make_folder(path: &Path) -> anyhow::Result<()> {
    fs::create_dir_all(path).with_context(|| format!("{}: folder cannot be made", path.display()))
}
