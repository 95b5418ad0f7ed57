//! Files: read whole, written whole or not at all, inputs never overwritten.
//!
//! Every file that a verb reads or writes passes here, so that nothing has to be listed: `ledger` knows each by itself and
//! not by its name, refuses an output that is an input, an input that is an output and two outputs that are one file, and
//! does so before the work where both are known by then.
//!
//! Outputs are handled as `cp` would handle them. A new file gets the permissions of new files (`umask`), one that is there keeps
//! owner and permissions, a read-only one stays. A link is followed to its file, which is made where it is not there yet.
//! Devices and pipes are written through. A file with several names (hard links) keeps them: it is written in place,
//! everything else is written beside its place, synced, and renamed.

use std::fs;
use std::io::{Read, Write};
use std::path::{Path, PathBuf};

use anyhow::{Context, bail};

use super::terminal::hand_over;
use in_place::InPlace;
use pending::Pending;
use place::{Kind, Place, parent};

pub(super) use ledger::new_round;
pub(super) use place::is_stdout;

mod in_place;
mod ledger;
pub(super) mod own;
mod pending;
mod place;
pub(super) mod settle;
pub(super) mod witness;

/// The bytes of a file: an input, which no output may overwrite from here on.
pub(super) fn read(path: &Path) -> anyhow::Result<Vec<u8>> {
    let (file, meta) = opened(path)?;
    ledger::note_read(path, &meta)?;
    let bytes = whole(file, &meta, path)?;
    witness::note(&bytes);
    Ok(bytes)
}

/// All that comes on the standard input.
pub(super) fn read_stdin() -> anyhow::Result<Vec<u8>> {
    let mut bytes = Vec::new();
    std::io::stdin().lock().read_to_end(&mut bytes).context("the standard input cannot be read")?;
    Ok(bytes)
}

/// The bytes of a file that is this program's own and will be written again, such as the state of a track.
pub(super) fn read_own(path: &Path) -> anyhow::Result<Vec<u8>> {
    let (file, meta) = opened(path)?;
    whole(file, &meta, path)
}

/// Takes a file for an input before it is read. One that cannot be looked at is left to whoever reads it.
///
/// # Errors
/// It is an output too.
pub(super) fn expect(path: &Path) -> anyhow::Result<()> {
    fs::metadata(path).map_or(Ok(()), |meta| ledger::note_read(path, &meta))
}

fn opened(path: &Path) -> anyhow::Result<(fs::File, fs::Metadata)> {
    let open = || {
        let file = fs::File::open(path)?;
        let meta = file.metadata()?;
        Ok::<_, std::io::Error>((file, meta))
    };
    open().with_context(|| format!("{}: cannot be read", path.display()))
}

fn whole(file: fs::File, meta: &fs::Metadata, path: &Path) -> anyhow::Result<Vec<u8>> {
    let bytes = in_parts(file, meta).with_context(|| format!("{}: cannot be read", path.display()))?;
    if !meta.is_file() && bytes.len() as u64 > MOST_OF_A_STREAM {
        bail!(
            "{}: more than {} MB come from it without an end; expected a file",
            path.display(),
            MOST_OF_A_STREAM >> 20
        );
    }
    Ok(bytes)
}

/// A pipe or device may never end: more than this is not taken from it (bytes).
const MOST_OF_A_STREAM: u64 = 1 << 28;

/// Files from here on are read in parts, on all threads (bytes).
#[cfg(unix)]
const LARGE: u64 = 1 << 22;

#[cfg(unix)]
fn in_parts(file: fs::File, meta: &fs::Metadata) -> std::io::Result<Vec<u8>> {
    use std::os::unix::fs::FileExt;

    use rayon::prelude::*;

    let length = if meta.is_file() { meta.len() } else { 0 };
    if length < LARGE {
        return at_once(file, meta);
    }
    let mut bytes = vec![0; length as usize];
    let part = LARGE as usize;
    let parts = bytes.par_chunks_mut(part).enumerate();
    parts.try_for_each(|(index, bytes)| file.read_exact_at(bytes, (index * part) as u64))?;
    // One that grew meanwhile is read again, to its end.
    if file.metadata()?.len() == length { Ok(bytes) } else { at_once(file, meta) }
}

#[cfg(not(unix))]
fn in_parts(file: fs::File, meta: &fs::Metadata) -> std::io::Result<Vec<u8>> {
    at_once(file, meta)
}

fn at_once(mut file: fs::File, meta: &fs::Metadata) -> std::io::Result<Vec<u8>> {
    let mut bytes = Vec::new();
    if meta.is_file() {
        bytes.reserve_exact(meta.len() as usize + 1);
        file.read_to_end(&mut bytes)?;
    } else {
        file.take(MOST_OF_A_STREAM + 1).read_to_end(&mut bytes)?;
    }
    Ok(bytes)
}

/// The text of a file.
pub(super) fn read_text(path: &Path) -> anyhow::Result<String> {
    as_text(read(path)?, path)
}

/// The same of a file that is this program's own.
pub(super) fn read_own_text(path: &Path) -> anyhow::Result<String> {
    as_text(read_own(path)?, path)
}

fn as_text(bytes: Vec<u8>, path: &Path) -> anyhow::Result<String> {
    match String::from_utf8(bytes) {
        Ok(text) => Ok(text),
        Err(error) => {
            let at = error.utf8_error().valid_up_to();
            bail!("{}: byte {at} is not UTF-8 text", path.display())
        }
    }
}

/// Where a path leads, whether or not something is there yet: as much of it as is there with links followed, the rest as it
/// is written. `None` for the standard output, and for a path that goes up from where nothing is.
pub(super) fn whole_path(path: &Path) -> Option<PathBuf> {
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

/// The name of a file as reports print it.
pub(super) fn name(path: &Path) -> String {
    path.file_name().map_or_else(|| path.display().to_string(), |n| n.to_string_lossy().into_owned())
}

/// Files to be written together: collected first, then each written to the disk beside its place, synced, and only when
/// all are there put in place.
#[derive(Debug, Default)]
pub(super) struct Batch {
    files: Vec<(PathBuf, Vec<u8>)>,
    inputs: Vec<PathBuf>,
    settled_later: bool,
}

impl Batch {
    /// A batch that spares `inputs` too, beside all that was read.
    pub(super) fn sparing<P: AsRef<Path>>(inputs: impl IntoIterator<Item = P>) -> Self {
        let inputs = inputs.into_iter().map(|p| p.as_ref().to_path_buf()).collect();
        Self { files: Vec::new(), inputs, settled_later: false }
    }

    /// Leaves it to [`settle`] that new files get to the disk, for one who would notice that what a machine that went down left of them
    /// is not what was written. What takes the place of another file is synced before all the same.
    pub(super) fn settled_later(self, later: bool) -> Self {
        Self { settled_later: later && settle::CAN, ..self }
    }

    /// Adds a file; `-` prints it to stdout when the batch is written.
    pub(super) fn add(&mut self, path: impl Into<PathBuf>, bytes: impl Into<Vec<u8>>) {
        self.files.push((path.into(), bytes.into()));
    }

    /// Refuses early, before the work, what writing would refuse late: an output that is an input (these, what was read
    /// already, and from here on what is read), two outputs that are one file, and outputs that cannot be written.
    pub(super) fn check(inputs: &[&Path], outputs: &[&Path]) -> anyhow::Result<()> {
        inputs.iter().try_for_each(|input| expect(input))?;
        ledger::promise(outputs)
    }

    /// Writes everything or nothing.
    pub(super) fn write(self) -> anyhow::Result<()> {
        self.inputs.iter().try_for_each(|input| expect(input))?;
        let named: Vec<&Path> = self.files.iter().map(|(path, _)| path.as_path()).collect();
        let places = ledger::take(&named)?;
        let (mut ready, mut over, mut last) = (Vec::new(), Vec::new(), Vec::new());
        for (place, (_, bytes)) in places.iter().zip(&self.files) {
            let failed = || format!("{}: cannot be written; nothing was changed", place.named.display());
            match written_beside(place, bytes, self.settled_later).with_context(failed)? {
                Some(pending) => ready.push((place, pending)),
                None if matches!(place.kind, Kind::Over(_)) => {
                    over.push((place, bytes, InPlace::open(&place.path).with_context(failed)?));
                }
                None => last.push((place, bytes)),
            }
        }
        // What may still fail for want of room goes first: then all that was done can be taken back.
        for index in 0..over.len() {
            let (place, bytes, file) = &mut over[index];
            if let Err(error) = file.put(bytes) {
                let named = place.named.display().to_string();
                over[..index].iter_mut().for_each(|(_, _, file)| drop(file.restore()));
                return Err(error)
                    .with_context(|| format!("{named}: cannot be written; nothing was changed"));
            }
        }
        let mut done: Vec<&Place> = over.iter().map(|(place, ..)| *place).collect();
        for (place, file) in ready {
            file.put().with_context(|| incomplete(place, "put in place", &done, &places))?;
            ledger::note_put(place);
            done.push(place);
        }
        for (place, bytes) in last {
            match place.kind {
                Kind::Stdout => hand_over(bytes)?,
                _ => through(&place.path, bytes)
                    .with_context(|| incomplete(place, "written", &done, &places))?,
            }
            done.push(place);
        }
        Ok(())
    }
}

/// What is said where one of several outputs fails after others are there already: which are and which are not.
fn incomplete(failed: &Place, what: &str, done: &[&Place], all: &[Place]) -> String {
    let names = |of: &mut dyn Iterator<Item = &Place>| {
        of.map(|place| place.named.display().to_string()).collect::<Vec<_>>().join(", ")
    };
    let here = format!("{}: cannot be {what}", failed.named.display());
    if done.is_empty() {
        return format!("{here}; nothing was changed");
    }
    let open = |place: &&Place| !done.iter().any(|other| std::ptr::eq(*other, *place));
    format!(
        "{here}; new are already: {}; still as before: {}",
        names(&mut done.iter().copied()),
        names(&mut all.iter().filter(open))
    )
}

/// The file beside its place, on the disk; `None` where it is sent, printed, or written where it stands. `later`: a new file gets to the
/// disk later.
fn written_beside(place: &Place, bytes: &[u8], later: bool) -> std::io::Result<Option<Pending>> {
    let over = match &place.kind {
        Kind::Stdout | Kind::Stream => return Ok(None),
        Kind::Over(meta) if names(meta) > 1 => return Ok(None),
        Kind::Over(meta) => Some(meta),
        Kind::New => None,
    };
    match Pending::write(place.path.clone(), &parent(&place.path), over, bytes, later) {
        Err(error) if over.is_some() && error.kind() == std::io::ErrorKind::PermissionDenied => Ok(None),
        done => done.map(Some),
    }
}

/// How many names a file has.
#[cfg(unix)]
fn names(meta: &fs::Metadata) -> u64 {
    std::os::unix::fs::MetadataExt::nlink(meta)
}

#[cfg(not(unix))]
fn names(_: &fs::Metadata) -> u64 {
    1
}

/// Sends bytes to a device, a pipe or an open file.
fn through(path: &Path, bytes: &[u8]) -> std::io::Result<()> {
    fs::OpenOptions::new().write(true).truncate(true).open(path)?.write_all(bytes)
}

/// Makes a folder for outputs.
pub(super) fn make_folder(path: &Path) -> anyhow::Result<()> {
    fs::create_dir_all(path).with_context(|| format!("{}: folder cannot be made", path.display()))
}
