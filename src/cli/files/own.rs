//! Files that are this program's own: what jobs of one run keep for each other.
//!
//! They get their names when they are whole, so no reader sees a part, but they are not forced to the disk one by one: a
//! record that a crash of the machine tore does not read, and its unit is done again.

use std::fs;
use std::io::{self, Write};
use std::path::Path;

use anyhow::Context;

use super::place::parent;

/// Puts a file in its place, over what was there.
pub(crate) fn put(path: &Path, bytes: &[u8]) -> anyhow::Result<()> {
    let write = || {
        let mut builder = tempfile::Builder::new();
        #[cfg(unix)]
        {
            use std::os::unix::fs::PermissionsExt;
            // The system takes away what its umask forbids.
            builder.permissions(fs::Permissions::from_mode(0o666));
        }
        let mut file = builder.prefix(".part-").tempfile_in(parent(path))?;
        file.write_all(bytes)?;
        file.persist(path).map(drop).map_err(|error| error.error)
    };
    write().with_context(|| format!("{}: cannot be written", path.display()))
}

/// Notes something where it stands. A reader may see a part of it.
pub(crate) fn note(path: &Path, text: &str) -> anyhow::Result<()> {
    fs::write(path, text).with_context(|| format!("{}: cannot be written", path.display()))
}

/// The bytes of a file; `None` where it is not there.
pub(crate) fn there(path: &Path) -> anyhow::Result<Option<Vec<u8>>> {
    match fs::read(path) {
        Ok(bytes) => Ok(Some(bytes)),
        Err(error) if error.kind() == io::ErrorKind::NotFound => Ok(None),
        Err(error) => Err(error).with_context(|| format!("{}: cannot be read", path.display())),
    }
}

/// Takes a file away; one that is not there is no fault.
pub(crate) fn gone(path: &Path) {
    let _ = fs::remove_file(path);
}

/// Takes the files of a folder away whose names begin so. A folder that is not there has none.
pub(crate) fn gone_of(folder: &Path, begins: &str) {
    let files = fs::read_dir(folder).into_iter().flatten().flatten();
    for file in files.filter(|file| file.file_name().to_string_lossy().starts_with(begins)) {
        gone(&file.path());
    }
}
