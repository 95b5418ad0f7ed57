//! File access: files are read as a whole, written as a whole or not at all, and inputs are never overwritten.
//!
//! Every file that a verb reads or writes passes through here. `ledger` identifies files by inode, not by name. It refuses an
//! output that is an input, an input that is an output, and two outputs that are one file, before the computation if both
//! are known by then.
//!
//! Outputs behave as with `cp`. A new file gets the permissions of the `umask`; an existing file keeps owner and permissions;
//! a read-only file is not overwritten. A link is followed to its file, which is created if it does not exist. Devices and pipes
//! are written through. A file with several hard links is written in place; any other file is written to a temporary file,
//! synced, and renamed.

use std::fs;
use std::io::{Read, Write};
use std::path::{Path, PathBuf};

use anyhow::{Context, bail};

use super::terminal::write_stdout;
use destination::{Destination, Kind, parent};
use in_place::InPlace;
use pending::Pending;

pub(super) use destination::is_stdout;
pub(super) use ledger::new_round;

mod in_place;
mod ledger;
pub(super) mod run_files;
mod pending;
mod destination;
pub(super) mod sync;
pub(super) mod read_log;

/// The bytes of a file. It becomes an input, which no output may overwrite.
pub(super) fn read(path: &Path) -> anyhow::Result<Vec<u8>> {
    let (file, meta) = open(path)?;
    ledger::note_read(path, &meta)?;
    let bytes = read_all(file, &meta, path)?;
    read_log::note(&bytes);
    Ok(bytes)
}

/// All bytes of stdin.
pub(super) fn read_stdin() -> anyhow::Result<Vec<u8>> {
    let mut bytes = Vec::new();
    std::io::stdin().lock().read_to_end(&mut bytes).context("stdin cannot be read")?;
    Ok(bytes)
}

/// The bytes of a state file, which the program will overwrite, such as the state of a track.
pub(super) fn read_state(path: &Path) -> anyhow::Result<Vec<u8>> {
    let (file, meta) = open(path)?;
    read_all(file, &meta, path)
}

/// Registers a file as an input before it is read. A missing file is not an error here.
///
/// # Errors
/// The file is also an output.
pub(super) fn expect(path: &Path) -> anyhow::Result<()> {
    fs::metadata(path).map_or(Ok(()), |meta| ledger::note_read(path, &meta))
}

fn open(path: &Path) -> anyhow::Result<(fs::File, fs::Metadata)> {
    if path == Path::new("-") && !path.exists() {
        bail!(
            "-: input is read from files, not from stdin: write it to a file, or give /dev/stdin where the system has it"
        );
    }
    if path.is_dir() {
        bail!("{}: is a folder, and one file is expected here: name the file in it", path.display());
    }
    let try_open = || {
        let file = fs::File::open(path)?;
        let meta = file.metadata()?;
        Ok::<_, std::io::Error>((file, meta))
    };
    try_open().with_context(|| format!("{}: cannot be read", path.display()))
}

fn read_all(file: fs::File, meta: &fs::Metadata, path: &Path) -> anyhow::Result<Vec<u8>> {
    let bytes = read_in_parts(file, meta).with_context(|| format!("{}: cannot be read", path.display()))?;
    if !meta.is_file() && bytes.len() as u64 > MAX_STREAM_BYTES {
        bail!(
            "{}: more than {} MB without an end; expected a regular file",
            path.display(),
            MAX_STREAM_BYTES >> 20
        );
    }
    Ok(bytes)
}

/// Limit for a pipe or device, which may never end (bytes).
const MAX_STREAM_BYTES: u64 = 1 << 28;

/// Files of this size or more are read in parts, in parallel (bytes).
#[cfg(unix)]
const PARALLEL_BYTES: u64 = 1 << 22;

#[cfg(unix)]
fn read_in_parts(file: fs::File, meta: &fs::Metadata) -> std::io::Result<Vec<u8>> {
    use std::os::unix::fs::FileExt;

    use rayon::prelude::*;

    let length = if meta.is_file() { meta.len() } else { 0 };
    if length < PARALLEL_BYTES {
        return read_at_once(file, meta);
    }
    let mut bytes = vec![0; length as usize];
    let part = PARALLEL_BYTES as usize;
    let parts = bytes.par_chunks_mut(part).enumerate();
    parts.try_for_each(|(index, bytes)| file.read_exact_at(bytes, (index * part) as u64))?;
    // A file that grew meanwhile is read again.
    if file.metadata()?.len() == length { Ok(bytes) } else { read_at_once(file, meta) }
}

#[cfg(not(unix))]
fn read_in_parts(file: fs::File, meta: &fs::Metadata) -> std::io::Result<Vec<u8>> {
    read_at_once(file, meta)
}

fn read_at_once(mut file: fs::File, meta: &fs::Metadata) -> std::io::Result<Vec<u8>> {
    let mut bytes = Vec::new();
    if meta.is_file() {
        bytes.reserve_exact(meta.len() as usize + 1);
        file.read_to_end(&mut bytes)?;
    } else {
        file.take(MAX_STREAM_BYTES + 1).read_to_end(&mut bytes)?;
    }
    Ok(bytes)
}

/// The text of an input file.
pub(super) fn read_text(path: &Path) -> anyhow::Result<String> {
    decode(read(path)?, path)
}

/// The text of a state file, see [`read_state`].
pub(super) fn read_state_text(path: &Path) -> anyhow::Result<String> {
    decode(read_state(path)?, path)
}

fn decode(bytes: Vec<u8>, path: &Path) -> anyhow::Result<String> {
    match String::from_utf8(bytes) {
        Ok(text) => Ok(text),
        Err(error) => {
            let at = error.utf8_error().valid_up_to();
            bail!("{}: byte {at} is not UTF-8 text", path.display())
        }
    }
}

/// The canonical path of a file that may not exist yet: links are followed in the part that exists. `None` for stdout and for a
/// path with `..` below a missing folder.
pub(super) fn canonical_path(path: &Path) -> Option<PathBuf> {
    if is_stdout(path) {
        return None;
    }
    let mut rest = Vec::new();
    let mut at = std::path::absolute(path).ok()?;
    loop {
        if let Ok(mut whole) = fs::canonicalize(&at) {
            whole.extend(rest.iter().rev());
            return Some(whole);
        }
        rest.push(at.file_name()?.to_owned());
        at = at.parent()?.to_path_buf();
    }
}

/// The file name as reports print it.
pub(super) fn name(path: &Path) -> String {
    path.file_name().map_or_else(|| path.display().to_string(), |n| n.to_string_lossy().into_owned())
}

/// Files to be written together: first all are written to temporary files and synced, then all are renamed into place.
#[derive(Debug, Default)]
pub(super) struct Batch {
    files: Vec<(PathBuf, Vec<u8>)>,
    inputs: Vec<PathBuf>,
    synced_later: bool,
}

impl Batch {
    /// A batch that must not overwrite `inputs`, in addition to the files that were read.
    pub(super) fn sparing<P: AsRef<Path>>(inputs: impl IntoIterator<Item = P>) -> Self {
        let inputs = inputs.into_iter().map(|p| p.as_ref().to_path_buf()).collect();
        Self { files: Vec::new(), inputs, synced_later: false }
    }

    /// Leaves syncing of new files to [`sync`], for a caller that detects files torn by a machine crash. A file that replaces
    /// another is synced in any case.
    pub(super) fn synced_later(self, later: bool) -> Self {
        Self { synced_later: later && sync::AVAILABLE, ..self }
    }

    /// Adds a file; `-` prints it to stdout when the batch is written.
    pub(super) fn add(&mut self, path: impl Into<PathBuf>, bytes: impl Into<Vec<u8>>) {
        self.files.push((path.into(), bytes.into()));
    }

    /// Refuses before the computation what writing would refuse after it: an output that is an input (these, those read already,
    /// and those read later), two outputs that are one file, and outputs that cannot be written.
    pub(super) fn check(inputs: &[&Path], outputs: &[&Path]) -> anyhow::Result<()> {
        inputs.iter().try_for_each(|input| expect(input))?;
        ledger::promise(outputs)
    }

    /// Writes all files or none.
    pub(super) fn write(self) -> anyhow::Result<()> {
        self.inputs.iter().try_for_each(|input| expect(input))?;
        let named: Vec<&Path> = self.files.iter().map(|(path, _)| path.as_path()).collect();
        let destinations = ledger::take(&named)?;
        let (mut ready, mut over, mut last) = (Vec::new(), Vec::new(), Vec::new());
        for (destination, (_, bytes)) in destinations.iter().zip(&self.files) {
            let failed =
                || format!("{}: cannot be written; nothing was changed", destination.named.display());
            match write_temporary(destination, bytes, self.synced_later).with_context(failed)? {
                Some(pending) => ready.push((destination, pending)),
                None if matches!(destination.kind, Kind::Over(_)) => {
                    over.push((destination, bytes, InPlace::open(&destination.path).with_context(failed)?));
                }
                None => last.push((destination, bytes)),
            }
        }
        // Writes that can still fail because the disk is full go first, so that they can be undone.
        for index in 0..over.len() {
            let (destination, bytes, file) = &mut over[index];
            if let Err(error) = file.put(bytes) {
                let named = destination.named.display().to_string();
                over[..index].iter_mut().for_each(|(_, _, file)| drop(file.restore()));
                return Err(error)
                    .with_context(|| format!("{named}: cannot be written; nothing was changed"));
            }
        }
        let mut done: Vec<&Destination> = over.iter().map(|(destination, ..)| *destination).collect();
        for (destination, file) in ready {
            file.put().with_context(|| incomplete(destination, "put in place", &done, &destinations))?;
            ledger::note_put(destination);
            done.push(destination);
        }
        for (destination, bytes) in last {
            match destination.kind {
                Kind::Stdout => write_stdout(bytes)?,
                _ => write_through(&destination.path, bytes)
                    .with_context(|| incomplete(destination, "written", &done, &destinations))?,
            }
            done.push(destination);
        }
        Ok(())
    }
}

/// Error text if an output fails after others were put in place: lists which are new and which are not.
fn incomplete(failed: &Destination, what: &str, done: &[&Destination], all: &[Destination]) -> String {
    let names = |of: &mut dyn Iterator<Item = &Destination>| {
        of.map(|destination| destination.named.display().to_string()).collect::<Vec<_>>().join(", ")
    };
    let here = format!("{}: cannot be {what}", failed.named.display());
    if done.is_empty() {
        return format!("{here}; nothing was changed");
    }
    let open = |destination: &&Destination| !done.iter().any(|other| std::ptr::eq(*other, *destination));
    format!(
        "{here}; already replaced: {}; unchanged: {}",
        names(&mut done.iter().copied()),
        names(&mut all.iter().filter(open))
    )
}

/// Writes a temporary file beside the output; `None` for streams, stdout and files written in place. `later`: a new file is synced
/// later.
fn write_temporary(destination: &Destination, bytes: &[u8], later: bool) -> std::io::Result<Option<Pending>> {
    let over = match &destination.kind {
        Kind::Stdout | Kind::Stream => return Ok(None),
        Kind::Over(meta) if link_count(meta) > 1 => return Ok(None),
        Kind::Over(meta) => Some(meta),
        Kind::New => None,
    };
    match Pending::write(destination.path.clone(), &parent(&destination.path), over, bytes, later) {
        Err(error) if over.is_some() && error.kind() == std::io::ErrorKind::PermissionDenied => Ok(None),
        done => done.map(Some),
    }
}

/// Number of hard links.
#[cfg(unix)]
fn link_count(meta: &fs::Metadata) -> u64 {
    std::os::unix::fs::MetadataExt::nlink(meta)
}

#[cfg(not(unix))]
fn link_count(_: &fs::Metadata) -> u64 {
    1
}

/// Writes to a device, a pipe or an open file.
fn write_through(path: &Path, bytes: &[u8]) -> std::io::Result<()> {
    fs::OpenOptions::new().write(true).truncate(true).open(path)?.write_all(bytes)
}

/// Refuses to replace a form that somebody may have filled in: only an empty file, or one that holds just the `form`, is written again.
///
/// # Errors
/// With the path, if the file holds something else.
pub(super) fn spare_filled_in(path: &Path, form: &str) -> anyhow::Result<()> {
    if is_stdout(path) || !path.is_file() {
        return Ok(());
    }
    let there = fs::read(path).unwrap_or_default();
    if there.trim_ascii().is_empty() || there == form.as_bytes() {
        return Ok(());
    }
    bail!(
        "{}: the file exists and holds more than the empty form: what was filled in would be lost; give -o another name, or delete the file",
        path.display()
    )
}

/// Creates a folder for outputs.
pub(super) fn make_folder(path: &Path) -> anyhow::Result<()> {
    fs::create_dir_all(path).with_context(|| format!("{}: folder cannot be created", path.display()))
}
