//! The files that this process has read, will write and has written, identified by inode rather than by name.
//!
//! Every read and write is registered here, so verbs need not declare their inputs: a file that was read is never written, a
//! file to be written is never read, and no file is written twice.

use std::collections::BTreeMap;
use std::fs::{self, Metadata};
use std::path::{Path, PathBuf};
use std::sync::{Mutex, MutexGuard, OnceLock, PoisonError};

use anyhow::bail;

use super::destination::{Destination, Identity, Key};

#[derive(Debug, Default)]
struct Ledger {
    /// Inputs, with the name under which each was first read.
    read: BTreeMap<Identity, PathBuf>,
    /// Existing files that an output will replace.
    promised: BTreeMap<Identity, PathBuf>,
    /// Outputs written or being written.
    written: BTreeMap<Key, PathBuf>,
    /// New files among them, by folder and lower-case name, so that a million outputs need no pairwise comparison.
    alike: BTreeMap<(Identity, String), Vec<Key>>,
}

fn ledger() -> MutexGuard<'static, Ledger> {
    static LEDGER: Mutex<Ledger> = Mutex::new(Ledger {
        read: BTreeMap::new(),
        promised: BTreeMap::new(),
        written: BTreeMap::new(),
        alike: BTreeMap::new(),
    });
    LEDGER.lock().unwrap_or_else(PoisonError::into_inner)
}

/// Registers an input.
///
/// # Errors
/// The file is also an output.
pub(super) fn note_read(path: &Path, meta: &Metadata) -> anyhow::Result<()> {
    if meta.is_dir() {
        return Ok(());
    }
    let identity = Identity::of(path, meta);
    let mut ledger = ledger();
    let output = ledger.promised.get(&identity).or_else(|| ledger.written.get(&Key::There(identity.clone())));
    // The name may belong to another file by now.
    if let Some(output) = output
        && fs::metadata(output).is_ok_and(|meta| Identity::of(output, &meta) == identity)
    {
        return refuse_input(output, path);
    }
    if meta.is_file() && stdout_file() == Some(&identity) {
        bail!(
            "{} is an input, and stdout goes to it: inputs are never overwritten; name another output",
            path.display()
        );
    }
    ledger.read.entry(identity).or_insert_with(|| path.to_path_buf());
    Ok(())
}

/// The file that stdout is redirected to, if any.
#[cfg(unix)]
fn stdout_file() -> Option<&'static Identity> {
    use std::os::fd::AsFd;
    static FILE: OnceLock<Option<Identity>> = OnceLock::new();
    let look = || {
        let file = fs::File::from(std::io::stdout().as_fd().try_clone_to_owned().ok()?);
        let meta = file.metadata().ok().filter(Metadata::is_file)?;
        Some(Identity::of(Path::new("-"), &meta))
    };
    FILE.get_or_init(look).as_ref()
}

#[cfg(not(unix))]
fn stdout_file() -> Option<&'static Identity> {
    static FILE: OnceLock<Option<Identity>> = OnceLock::new();
    FILE.get_or_init(|| None).as_ref()
}

/// Registers outputs before the computation.
///
/// # Errors
/// An output is an input, two outputs are one file, or one cannot be written.
pub(super) fn promise(outputs: &[&Path]) -> anyhow::Result<()> {
    let mut destinations: Vec<Destination> = Vec::new();
    for output in outputs {
        let destination = Destination::of(output)?;
        refuse_same_file(
            &destination,
            destinations.iter().filter_map(|other| Some((other.key.as_ref()?, other.named.as_path()))),
        )?;
        destinations.push(destination);
    }
    let mut ledger = ledger();
    for destination in &destinations {
        ledger.refuse_inputs(destination)?;
    }
    for destination in destinations {
        if let Some(Key::There(identity)) = destination.key {
            ledger.promised.insert(identity, destination.named);
        }
    }
    Ok(())
}

/// Registers outputs that are about to be written.
///
/// # Errors
/// As [`promise`], and if this run has already written one of them.
pub(super) fn take(outputs: &[&Path]) -> anyhow::Result<Vec<Destination>> {
    let mut destinations: Vec<Destination> = Vec::new();
    let mut ledger = ledger();
    for output in outputs {
        let destination = Destination::of(output)?;
        ledger.refuse_inputs(&destination)?;
        refuse_same_file(
            &destination,
            destinations.iter().filter_map(|other| Some((other.key.as_ref()?, other.named.as_path()))),
        )?;
        refuse_same_file(&destination, ledger.written_like(&destination))?;
        destinations.push(destination);
    }
    for destination in &destinations {
        if let Some(key) = &destination.key {
            ledger.written.insert(key.clone(), destination.named.clone());
            if let Some(alike) = without_case(key) {
                ledger.alike.entry(alike).or_default().push(key.clone());
            }
        }
    }
    Ok(destinations)
}

/// Registers a file that this process has just created: an earlier file with its inode number is gone.
pub(super) fn note_made(path: &Path, meta: &Metadata) {
    let identity = Identity::of(path, meta);
    let mut ledger = ledger();
    ledger.read.remove(&identity);
    ledger.promised.remove(&identity);
    ledger.written.remove(&Key::There(identity));
}

/// Registers a new file that was renamed into place.
pub(super) fn note_put(destination: &Destination) {
    if let Ok(meta) = fs::metadata(&destination.path) {
        ledger()
            .written
            .insert(Key::There(Identity::of(&destination.path, &meta)), destination.named.clone());
    }
}

/// Starts a new round of a continuing run, which writes its outputs again.
pub(crate) fn new_round() {
    let mut ledger = ledger();
    ledger.written.clear();
    ledger.alike.clear();
}

/// Folder and lower-case name of a new file.
fn without_case(key: &Key) -> Option<(Identity, String)> {
    match key {
        Key::New(folder, name) => Some((folder.clone(), name.to_string_lossy().to_lowercase())),
        _ => None,
    }
}

impl Ledger {
    /// Written outputs that may be the same file.
    fn written_like(&self, destination: &Destination) -> impl Iterator<Item = (&Key, &Path)> {
        // Another job may have replaced our file; its inode number may then be reused.
        let is_still = |key: &Key, named: &Path| match key {
            Key::There(identity) => {
                fs::metadata(named).is_ok_and(|meta| Identity::of(named, &meta) == *identity)
            }
            _ => true,
        };
        let same = destination.key.as_ref().and_then(|key| self.written.get_key_value(key));
        let same = same.filter(|(key, named)| is_still(key, named));
        let alike = destination.key.as_ref().and_then(without_case).and_then(|alike| self.alike.get(&alike));
        let alike = alike.into_iter().flatten().filter_map(|key| self.written.get_key_value(key));
        same.into_iter().chain(alike).map(|(key, named)| (key, named.as_path()))
    }

    fn refuse_inputs(&self, destination: &Destination) -> anyhow::Result<()> {
        match &destination.key {
            Some(Key::There(identity)) => match self.read.get(identity) {
                Some(input) => refuse_input(&destination.named, input),
                None if stdout_file() == Some(identity) => {
                    bail!(
                        "{}: stdout already goes to this file; name another output",
                        destination.named.display()
                    )
                }
                None => Ok(()),
            },
            _ => Ok(()),
        }
    }
}

fn refuse_input(output: &Path, input: &Path) -> anyhow::Result<()> {
    let also = if output == input { String::new() } else { format!(" (it is {})", input.display()) };
    bail!("{} is an input{also}: inputs are never overwritten; name another output", output.display())
}

/// Refuses two outputs that are one file.
fn refuse_same_file<'a>(
    destination: &Destination,
    others: impl Iterator<Item = (&'a Key, &'a Path)>,
) -> anyhow::Result<()> {
    for (key, named) in others {
        if !destination.meets(key) {
            continue;
        }
        if *key == Key::Stdout {
            bail!("two outputs go to stdout: name a file for all but one");
        }
        if named == destination.named {
            bail!("{} is named for two outputs: the second would overwrite the first", named.display());
        }
        bail!(
            "{} and {} are the same file: the second output would overwrite the first",
            named.display(),
            destination.named.display()
        );
    }
    Ok(())
}
