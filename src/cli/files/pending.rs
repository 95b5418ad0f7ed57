//! A file whose bytes are on the disk but which is not in its place yet.
//!
//! Where the file system can, it has no name until then: a process that is killed meanwhile leaves nothing behind.
//! Elsewhere it is a temporary file in the same folder.

use std::fs::{File, Metadata};
use std::io::{self, Write};
use std::path::{Path, PathBuf};

use tempfile::NamedTempFile;

use super::ledger;

/// See the module.
#[derive(Debug)]
pub(super) struct Pending {
    file: Written,
    place: PathBuf,
}

#[derive(Debug)]
enum Written {
    Named(NamedTempFile),
    #[cfg(target_os = "linux")]
    Nameless(File),
}

impl Pending {
    /// Writes `bytes` to the disk, in the folder of `place`. A file that replaces another gets its permissions and owner; a
    /// new one gets what the system gives to new files (`umask`), and is not waited for where it is settled `later`.
    ///
    /// # Errors
    /// [`io::ErrorKind::PermissionDenied`] where the folder takes no new file, or a new file cannot have the old one's owner.
    pub(super) fn write(
        place: PathBuf,
        folder: &Path,
        over: Option<&Metadata>,
        bytes: &[u8],
        later: bool,
    ) -> io::Result<Self> {
        let mut file = Written::new(folder, over.is_none())?;
        ledger::note_made(folder, &file.handle().metadata()?);
        if let Some(old) = over {
            like(file.handle(), old)?;
        }
        file.handle().write_all(bytes)?;
        if over.is_some() || !later {
            file.handle().sync_all()?;
        }
        Ok(Self { file, place })
    }

    /// Puts the file in its place, over what was there.
    pub(super) fn put(self) -> io::Result<()> {
        match self.file {
            Written::Named(file) => file.persist(&self.place).map(drop).map_err(|error| error.error),
            #[cfg(target_os = "linux")]
            Written::Nameless(file) => nameless::put(&file, &self.place),
        }
    }
}

impl Written {
    /// `open`: with the permissions of new files; else the owner's alone until it has those of the old one.
    fn new(folder: &Path, open: bool) -> io::Result<Self> {
        #[cfg(target_os = "linux")]
        if let Some(file) = nameless::new(folder, open) {
            return Ok(Written::Nameless(file));
        }
        let mut builder = tempfile::Builder::new();
        #[cfg(unix)]
        if open {
            use std::os::unix::fs::PermissionsExt;
            // The system takes away what its umask forbids.
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

/// Gives a file the owner and the permissions of another.
#[cfg(unix)]
fn like(file: &File, old: &Metadata) -> io::Result<()> {
    use std::os::unix::fs::{MetadataExt, PermissionsExt, fchown};
    let new = file.metadata()?;
    if (new.uid(), new.gid()) != (old.uid(), old.gid()) {
        fchown(file, Some(old.uid()), Some(old.gid()))?;
    }
    file.set_permissions(std::fs::Permissions::from_mode(old.permissions().mode() & 0o777))
}

#[cfg(not(unix))]
fn like(file: &File, old: &Metadata) -> io::Result<()> {
    file.set_permissions(old.permissions())
}

/// Files of Linux that get their name last.
#[cfg(target_os = "linux")]
mod nameless {
    use std::fs::File;
    use std::io;
    use std::os::fd::AsRawFd;
    use std::path::Path;

    use rustix::fs::{AtFlags, CWD, Mode, OFlags, linkat, open};
    use rustix::io::Errno;

    /// A file without a name; `None` where the file system has no such thing.
    pub(super) fn new(folder: &Path, open_to_others: bool) -> Option<File> {
        let owner = Mode::RUSR | Mode::WUSR;
        let all = owner | Mode::RGRP | Mode::WGRP | Mode::ROTH | Mode::WOTH;
        // The system takes away what its umask forbids.
        let mode = if open_to_others { all } else { owner };
        let file = open(folder, OFlags::TMPFILE | OFlags::WRONLY | OFlags::CLOEXEC, mode).ok()?;
        // Its name is given through the list of open files, which not every machine shows.
        let file = File::from(file);
        Path::new(&path_of(&file)).exists().then_some(file)
    }

    fn path_of(file: &File) -> String {
        format!("/proc/self/fd/{}", file.as_raw_fd())
    }

    fn link(file: &File, place: &Path) -> Result<(), Errno> {
        linkat(CWD, path_of(file), CWD, place, AtFlags::SYMLINK_FOLLOW)
    }

    /// Gives the file its name. A name that is taken cannot be given: then it gets another one and is renamed at once.
    pub(super) fn put(file: &File, place: &Path) -> io::Result<()> {
        match link(file, place) {
            Err(Errno::EXIST) => {}
            done => return Ok(done?),
        }
        let folder = place.parent().filter(|folder| !folder.as_os_str().is_empty()).unwrap_or(Path::new("."));
        let other = tempfile::Builder::new().make_in(folder, |other| Ok(link(file, other)?))?;
        other.into_temp_path().persist(place).map_err(|error| error.error)
    }
}
