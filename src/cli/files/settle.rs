//! Many new files on the disk at once: a sync for each costs a run of small programs more than all its computing.

use std::path::Path;

use anyhow::Context;

/// Whether this system can.
pub(super) const CAN: bool = cfg!(target_os = "linux");

/// Waits until all that was written below a folder is on the disk; where there is no folder nothing was.
///
/// # Errors
/// What the disk says of any of it.
pub(crate) fn settle(folder: &Path) -> anyhow::Result<()> {
    settled(folder)
        .with_context(|| format!("{}: not everything that was written got to the disk", folder.display()))
}

#[cfg(target_os = "linux")]
fn settled(folder: &Path) -> std::io::Result<()> {
    match std::fs::File::open(folder) {
        Err(error) if error.kind() == std::io::ErrorKind::NotFound => Ok(()),
        open => Ok(rustix::fs::syncfs(open?)?),
    }
}

#[cfg(not(target_os = "linux"))]
fn settled(_: &Path) -> std::io::Result<()> {
    Ok(())
}
