//! Syncs many new files at once: syncing each would cost a run of small programs more than all its computation.

use std::path::Path;

use anyhow::Context;

/// Whether this system supports it.
pub(super) const AVAILABLE: bool = cfg!(target_os = "linux");

/// Waits until everything written to the file system of a folder is on disk; does nothing if the folder does not exist.
///
/// # Errors
/// Those of the file system.
pub(crate) fn sync_folder(folder: &Path) -> anyhow::Result<()> {
    sync_file_system(folder)
        .with_context(|| format!("{}: not everything could be written to disk", folder.display()))
}

#[cfg(target_os = "linux")]
fn sync_file_system(folder: &Path) -> std::io::Result<()> {
    match std::fs::File::open(folder) {
        Err(error) if error.kind() == std::io::ErrorKind::NotFound => Ok(()),
        open => Ok(rustix::fs::syncfs(open?)?),
    }
}

#[cfg(not(target_os = "linux"))]
fn sync_file_system(_: &Path) -> std::io::Result<()> {
    Ok(())
}
