//! Identity of files, independent of their names.
//!
//! `a.mod`, `./a.mod`, a symbolic or hard link to it and, in a case-insensitive folder, `A.MOD` are one file. A file that does
//! not exist yet is identified by its folder and name.

use std::ffi::OsString;
use std::fs::{self, Metadata};
use std::io;
use std::path::{Path, PathBuf};

use anyhow::{Context, bail};

/// An existing file.
#[cfg(unix)]
#[derive(Debug, Clone, PartialEq, Eq, PartialOrd, Ord)]
pub(super) struct Identity {
    device: u64,
    inode: u64,
}

#[cfg(unix)]
impl Identity {
    pub(super) fn of(_: &Path, meta: &Metadata) -> Self {
        use std::os::unix::fs::MetadataExt;
        Self { device: meta.dev(), inode: meta.ino() }
    }
}

/// An existing file.
#[cfg(not(unix))]
#[derive(Debug, Clone, PartialEq, Eq, PartialOrd, Ord)]
pub(super) struct Identity(PathBuf);

#[cfg(not(unix))]
impl Identity {
    pub(super) fn of(path: &Path, _: &Metadata) -> Self {
        Self(fs::canonicalize(path).unwrap_or_else(|_| path.to_path_buf()))
    }
}

/// Identity of an output; no two outputs may share it.
#[derive(Debug, Clone, PartialEq, Eq, PartialOrd, Ord)]
pub(super) enum Key {
    /// Stdout.
    Stdout,
    /// An existing file.
    There(Identity),
    /// A new file: its folder and its name.
    New(Identity, OsString),
}

/// How an output is written.
#[derive(Debug, Clone)]
pub(super) enum Kind {
    /// Printed.
    Stdout,
    /// Written through: a device, a pipe, a socket.
    Stream,
    /// A new file.
    New,
    /// Replaces an existing file.
    Over(Metadata),
}

/// Destination of an output, links followed.
#[derive(Debug, Clone)]
pub(super) struct Destination {
    /// As the user named it.
    pub(super) named: PathBuf,
    /// The file to be written.
    pub(super) path: PathBuf,
    pub(super) kind: Kind,
    /// `None` for a device, which accepts several outputs.
    pub(super) key: Option<Key>,
}

/// Whether a path names stdout.
pub(crate) fn is_stdout(path: &Path) -> bool {
    ["-", "/dev/stdout", "/dev/fd/1", "/proc/self/fd/1"].iter().any(|name| path == Path::new(name))
}

impl Destination {
    /// Resolves the destination of an output.
    ///
    /// # Errors
    /// It is a folder, a read-only file, or in a missing folder.
    pub(super) fn of(named: &Path) -> anyhow::Result<Self> {
        let destination =
            |path: &Path, kind, key| Self { named: named.to_path_buf(), path: path.to_path_buf(), kind, key };
        if is_stdout(named) {
            return Ok(destination(Path::new("-"), Kind::Stdout, Some(Key::Stdout)));
        }
        let meta = match fs::metadata(named) {
            Ok(meta) => meta,
            Err(error) if error.kind() == io::ErrorKind::NotFound => {
                let path = follow_links(named)?;
                let folder = parent(&path);
                let Some(meta) = fs::metadata(&folder).ok().filter(Metadata::is_dir) else {
                    bail!("{}: folder {} does not exist", named.display(), folder.display());
                };
                let name = path.file_name().map(OsString::from);
                let name =
                    name.with_context(|| format!("{}: expected the name of a file", named.display()))?;
                let key = Key::New(Identity::of(&folder, &meta), name);
                return Ok(destination(&path, Kind::New, Some(key)));
            }
            Err(error) => {
                return Err(error).with_context(|| format!("{}: cannot be written", named.display()));
            }
        };
        if meta.is_dir() {
            bail!("{} is a folder: name a file", named.display());
        }
        let identity = Identity::of(named, &meta);
        if !meta.is_file() {
            let key = (!is_device(&meta)).then_some(Key::There(identity));
            return Ok(destination(named, Kind::Stream, key));
        }
        if meta.permissions().readonly() {
            bail!("{} is read-only and is not overwritten; name another output", named.display());
        }
        if let Err(error) = fs::OpenOptions::new().write(true).open(named) {
            return Err(error).with_context(|| format!("{}: cannot be written", named.display()));
        }
        // A link may lead to an unnamed file (an open file of this process), which has no canonical path.
        let real = fs::canonicalize(named)
            .ok()
            .filter(|real| fs::metadata(real).is_ok_and(|meta| Identity::of(real, &meta) == identity));
        // Another job replaced the file in between: resolve again.
        if real.is_none() && fs::metadata(named).is_ok_and(|now| Identity::of(named, &now) != identity) {
            return Self::of(named);
        }
        Ok(match real {
            Some(real) => destination(&real, Kind::Over(meta), Some(Key::There(identity))),
            None => destination(named, Kind::Stream, Some(Key::There(identity))),
        })
    }

    /// Whether another output goes to the same file.
    pub(super) fn meets(&self, other: &Key) -> bool {
        match (&self.key, other) {
            (Some(Key::New(folder, name)), Key::New(others, another))
                if folder == others && name != another =>
            {
                let alike = name.to_string_lossy().to_lowercase() == another.to_string_lossy().to_lowercase();
                alike && ignores_case(&parent(&self.path))
            }
            (key, other) => key.as_ref() == Some(other),
        }
    }
}

/// Follows a dangling link to its target; returns any other path unchanged.
fn follow_links(named: &Path) -> anyhow::Result<PathBuf> {
    /// Limit of Linux.
    const MAX_LINKS: usize = 40;
    let mut path = named.to_path_buf();
    for _ in 0..MAX_LINKS {
        match fs::read_link(&path) {
            Ok(to) => path = parent(&path).join(to),
            Err(_) => return Ok(path),
        }
    }
    bail!("{}: the link points to itself", named.display())
}

/// Whether names in a folder are case-insensitive. Tested only if two outputs differ in case alone.
fn ignores_case(folder: &Path) -> bool {
    let probe = tempfile::Builder::new().prefix("case-a").tempfile_in(folder);
    probe.ok().and_then(|probe| {
        let name = probe.path().file_name()?.to_string_lossy().replace("case-a", "CASE-A");
        Some(folder.join(name).exists())
    }) == Some(true)
}

#[cfg(unix)]
fn is_device(meta: &Metadata) -> bool {
    use std::os::unix::fs::FileTypeExt;
    meta.file_type().is_char_device() || meta.file_type().is_block_device()
}

#[cfg(not(unix))]
fn is_device(_: &Metadata) -> bool {
    true
}

/// The folder of a file, `.` for a bare name.
pub(super) fn parent(path: &Path) -> PathBuf {
    match path.parent() {
        Some(folder) if !folder.as_os_str().is_empty() => folder.to_path_buf(),
        _ => PathBuf::from("."),
    }
}
