//! A written file that is not in place yet.
//!
//! On file systems that support it the file has no name until then (`O_TMPFILE`), so that a killed process leaves nothing behind.
//! Elsewhere it is a temporary file in the same folder.

use std::fs::{File, Metadata};
use std::io::{self, Write};
use std::path::{Path, PathBuf};

use tempfile::NamedTempFile;

use super::ledger;

/// A written file and its destination.
#[derive(Debug)]
pub(super) struct Pending {
    file: Written,
    destination: PathBuf,
}

#[derive(Debug)]
enum Written {
    Named(NamedTempFile),
    #[cfg(target_os = "linux")]
    Nameless(File),
}

impl Pending {
    /// Writes `bytes` to a file in the folder of `destination`. A file that replaces another gets its permissions and owner; a new one
    /// gets those of the `umask`, and is not synced here if `later` is set.
    ///
    /// # Errors
    /// [`io::ErrorKind::PermissionDenied`] if the folder is not writable or a new file cannot get the owner of the old one.
    pub(super) fn write(
        destination: PathBuf,
        folder: &Path,
        over: Option<&Metadata>,
        bytes: &[u8],
        later: bool,
    ) -> io::Result<Self> {
        let mut file = Written::new(folder, over.is_none())?;
        ledger::note_made(folder, &file.handle().metadata()?);
        if let Some(old) = over {
            copy_attributes(file.handle(), old)?;
        }
        file.handle().write_all(bytes)?;
        if over.is_some() || !later {
            file.handle().sync_all()?;
        }
        Ok(Self { file, destination })
    }

    /// Moves the file into place, replacing an existing one.
    pub(super) fn put(self) -> io::Result<()> {
        match self.file {
            Written::Named(file) => file.persist(&self.destination).map(drop).map_err(|error| error.error),
            #[cfg(target_os = "linux")]
            Written::Nameless(file) => nameless::put(&file, &self.destination),
        }
    }
}

impl Written {
    /// `open`: with the permissions of the `umask`; otherwise readable by the owner only until it gets those of the old file.
    fn new(folder: &Path, open: bool) -> io::Result<Self> {
        #[cfg(target_os = "linux")]
        if let Some(file) = nameless::new(folder, open) {
            return Ok(Written::Nameless(file));
        }
        let mut builder = tempfile::Builder::new();
        #[cfg(unix)]
        if open {
            use std::os::unix::fs::PermissionsExt;
            // The system applies the umask.
            builder.permissions(std::fs::Permissions::from_mode(0o666));
        }
        builder.tempfile_in(folder).map(Written::Named)
    }

    fn handle(&mut self) -> &mut File {
        match self {
            Written::Named(file) => file.as_file_mut(),
            #[cfg(target_os = "linux")]
            Written::Nameless(file) => file,
        }
    }
}

/// Copies owner and permissions of another file.
#[cfg(unix)]
fn copy_attributes(file: &File, old: &Metadata) -> io::Result<()> {
    use std::os::unix::fs::{MetadataExt, PermissionsExt, fchown};
    let new = file.metadata()?;
    if (new.uid(), new.gid()) != (old.uid(), old.gid()) {
        fchown(file, Some(old.uid()), Some(old.gid()))?;
    }
    file.set_permissions(std::fs::Permissions::from_mode(old.permissions().mode() & 0o777))
}

#[cfg(not(unix))]
fn copy_attributes(file: &File, old: &Metadata) -> io::Result<()> {
    file.set_permissions(old.permissions())
}

/// Unnamed files of Linux.
#[cfg(target_os = "linux")]
mod nameless {
    use std::fs::File;
    use std::io;
    use std::os::fd::AsRawFd;
    use std::path::Path;

    use rustix::fs::{AtFlags, CWD, Mode, OFlags, linkat, open};
    use rustix::io::Errno;

    /// An unnamed file; `None` if the file system does not support it.
    pub(super) fn new(folder: &Path, open_to_others: bool) -> Option<File> {
        let owner = Mode::RUSR | Mode::WUSR;
        let all = owner | Mode::RGRP | Mode::WGRP | Mode::ROTH | Mode::WOTH;
        // The system applies the umask.
        let mode = if open_to_others { all } else { owner };
        let file = open(folder, OFlags::TMPFILE | OFlags::WRONLY | OFlags::CLOEXEC, mode).ok()?;
        // Naming it later needs /proc/self/fd, which may not be mounted.
        let file = File::from(file);
        Path::new(&path_of(&file)).exists().then_some(file)
    }

    fn path_of(file: &File) -> String {
        format!("/proc/self/fd/{}", file.as_raw_fd())
    }

    fn link(file: &File, destination: &Path) -> Result<(), Errno> {
        linkat(CWD, path_of(file), CWD, destination, AtFlags::SYMLINK_FOLLOW)
    }

    /// Names the file. `linkat` cannot replace a file, so an existing one is replaced by a rename.
    pub(super) fn put(file: &File, destination: &Path) -> io::Result<()> {
        match link(file, destination) {
            Err(Errno::EXIST) => {}
            done => return Ok(done?),
        }
        let folder =
            destination.parent().filter(|folder| !folder.as_os_str().is_empty()).unwrap_or(Path::new("."));
        let other = tempfile::Builder::new().make_in(folder, |other| Ok(link(file, other)?))?;
        other.into_temp_path().persist(destination).map_err(|error| error.error)
    }
}
