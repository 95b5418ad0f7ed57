//! Writes a file in place, if a new file could not replace it: it has several hard links, or an owner or folder that a new file
//! cannot have.
//!
//! Disk space is allocated before a byte changes, and the old content is restored if writing fails. A process killed in between
//! leaves a partial file.

use std::fs::{self, File};
use std::io::{self, Read, Seek, SeekFrom, Write};
use std::path::Path;

/// An open file with its old content.
#[derive(Debug)]
pub(super) struct InPlace {
    file: File,
    old: Vec<u8>,
}

impl InPlace {
    /// Opens the file and keeps its content.
    pub(super) fn open(destination: &Path) -> io::Result<Self> {
        let mut file = fs::OpenOptions::new().read(true).write(true).open(destination)?;
        let mut old = Vec::new();
        file.read_to_end(&mut old)?;
        Ok(Self { file, old })
    }

    /// Overwrites the content; restores it on failure.
    pub(super) fn put(&mut self, bytes: &[u8]) -> io::Result<()> {
        let done = self.overwrite(bytes);
        if done.is_err() {
            let _ = self.restore();
        }
        done
    }

    fn overwrite(&mut self, bytes: &[u8]) -> io::Result<()> {
        // The part beyond the old end needs new disk space, so it is written first.
        let kept = self.old.len().min(bytes.len());
        self.file.seek(SeekFrom::Start(kept as u64))?;
        self.file.write_all(&bytes[kept..])?;
        self.file.seek(SeekFrom::Start(0))?;
        self.file.write_all(&bytes[..kept])?;
        self.file.set_len(bytes.len() as u64)?;
        self.file.sync_all()
    }

    /// Restores the old content.
    pub(super) fn restore(&mut self) -> io::Result<()> {
        let old = std::mem::take(&mut self.old);
        self.file.seek(SeekFrom::Start(0))?;
        let written = self.file.write_all(&old).and_then(|()| self.file.set_len(old.len() as u64));
        self.old = old;
        written?;
        self.file.sync_all()
    }
}
