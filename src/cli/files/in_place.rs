//! A file that is written where it stands, because another one in its place would not be the same: it has several names
//! (hard links), or an owner or folder that a new file could not have.
//!
//! The disk is asked for room before a byte changes, and what was there is put back where writing fails; a process that is
//! killed in between leaves a part.

use std::fs::{self, File};
use std::io::{self, Read, Seek, SeekFrom, Write};
use std::path::Path;

/// See the module.
#[derive(Debug)]
pub(super) struct InPlace {
    file: File,
    old: Vec<u8>,
}

impl InPlace {
    /// Opens the file and keeps what is in it.
    pub(super) fn open(place: &Path) -> io::Result<Self> {
        let mut file = fs::OpenOptions::new().read(true).write(true).open(place)?;
        let mut old = Vec::new();
        file.read_to_end(&mut old)?;
        Ok(Self { file, old })
    }

    /// Writes `bytes` over what is there; on failure what was there stays.
    pub(super) fn put(&mut self, bytes: &[u8]) -> io::Result<()> {
        let done = self.over(bytes);
        if done.is_err() {
            let _ = self.restore();
        }
        done
    }

    fn over(&mut self, bytes: &[u8]) -> io::Result<()> {
        // What is beyond the old end needs room on the disk: it comes first.
        let kept = self.old.len().min(bytes.len());
        self.file.seek(SeekFrom::Start(kept as u64))?;
        self.file.write_all(&bytes[kept..])?;
        self.file.seek(SeekFrom::Start(0))?;
        self.file.write_all(&bytes[..kept])?;
        self.file.set_len(bytes.len() as u64)?;
        self.file.sync_all()
    }

    /// Puts back what was there.
    pub(super) fn restore(&mut self) -> io::Result<()> {
        let old = std::mem::take(&mut self.old);
        self.file.seek(SeekFrom::Start(0))?;
        let written = self.file.write_all(&old).and_then(|()| self.file.set_len(old.len() as u64));
        self.old = old;
        written?;
        self.file.sync_all()
    }
}
