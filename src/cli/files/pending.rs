//! A file whose bytes are on the disk but which is not in its place yet.
//!
//! Where the file system can, it has no name until then: a process that is killed meanwhile leaves nothing behind.
//! Elsewhere it is a temporary file in the same folder.

use std::fs::{File, Permissions};
use std::io::{self, Write};
use std::path::{Path, PathBuf};

use tempfile::NamedTempFile;

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
    /// Writes `bytes` to the disk, in the folder of `place`.
    pub(super) fn write(place: PathBuf, folder: &Path, bytes: &[u8]) -> io::Result<Self> {
        let mut file = Written::new(folder)?;
        file.handle().write_all(bytes)?;
        file.handle().sync_all()?;
        Ok(Self { file, place })
    }

    /// Puts the file in its place, over what was there.
    pub(super) fn put(mut self, permissions: Option<Permissions>) -> io::Result<()> {
        if let Some(permissions) = permissions {
            let _ = self.file.handle().set_permissions(permissions);
        }
        match self.file {
            Written::Named(file) => file.persist(&self.place).map(drop).map_err(|error| error.error),
            #[cfg(target_os = "linux")]
            Written::Nameless(file) => nameless::put(&file, &self.place),
        }
    }

    /// Where it goes.
    pub(super) fn place(&self) -> &Path {
        &self.place
    }
}

impl Written {
    fn new(folder: &Path) -> io::Result<Self> {
        #[cfg(target_os = "linux")]
        if let Some(file) = nameless::new(folder) {
            return Ok(Written::Nameless(file));
        }
        NamedTempFile::new_in(folder).map(Written::Named)
    }

    fn handle(&mut self) -> &mut File {
        match self {
            Written::Named(file) => file.as_file_mut(),
            #[cfg(target_os = "linux")]
            Written::Nameless(file) => file,
        }
    }
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
    pub(super) fn new(folder: &Path) -> Option<File> {
        let mode = Mode::RUSR | Mode::WUSR;
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
