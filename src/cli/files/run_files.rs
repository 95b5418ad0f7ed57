//! Internal files that the jobs of a run keep for each other.
//!
//! A file is renamed into place when it is complete, so no reader sees a part of it. It is not synced: a record torn by a
//! machine crash does not parse, and its unit is processed again.

use std::fs;
use std::io::{self, Write};
use std::path::Path;

use anyhow::Context;

use super::destination::parent;

/// Writes a file by renaming a temporary one over it.
pub(crate) fn replace(path: &Path, bytes: &[u8]) -> anyhow::Result<()> {
    let write = || {
        let mut builder = tempfile::Builder::new();
        #[cfg(unix)]
        {
            use std::os::unix::fs::PermissionsExt;
            // The system applies the umask.
            builder.permissions(fs::Permissions::from_mode(0o666));
        }
        let mut file = builder.prefix(".part-").tempfile_in(parent(path))?;
        file.write_all(bytes)?;
        file.persist(path).map(drop).map_err(|error| error.error)
    };
    write().with_context(|| format!("{}: cannot be written", path.display()))
}

/// Writes a small file in place; a reader may see a part of it.
pub(crate) fn write_note(path: &Path, text: &str) -> anyhow::Result<()> {
    fs::write(path, text).with_context(|| format!("{}: cannot be written", path.display()))
}

/// The bytes of a file; `None` if it does not exist.
pub(crate) fn read_if_exists(path: &Path) -> anyhow::Result<Option<Vec<u8>>> {
    match fs::read(path) {
        Ok(bytes) => Ok(Some(bytes)),
        Err(error) if error.kind() == io::ErrorKind::NotFound => Ok(None),
        Err(error) => Err(error).with_context(|| format!("{}: cannot be read", path.display())),
    }
}

/// Removes a file, if it exists.
pub(crate) fn remove(path: &Path) {
    let _ = fs::remove_file(path);
}

/// Removes the files of a folder whose names start with `prefix`.
pub(crate) fn remove_prefixed(folder: &Path, prefix: &str) {
    let files = fs::read_dir(folder).into_iter().flatten().flatten();
    for file in files.filter(|file| file.file_name().to_string_lossy().starts_with(prefix)) {
        remove(&file.path());
    }
}
