//! What this process has read, will write and has written, by the files themselves and not by their names.
//!
//! Every read and every write passes here, so no verb has to say what its inputs are: a file that was read is never
//! written, a file that is to be written is never read, and no file is written twice. What is known before the work is
//! refused before the work.

use std::collections::BTreeMap;
use std::fs::{self, Metadata};
use std::path::{Path, PathBuf};
use std::sync::{Mutex, MutexGuard, OnceLock, PoisonError};

use anyhow::bail;

use super::place::{Identity, Key, Place};

#[derive(Debug, Default)]
struct Ledger {
    /// Inputs, each under the name by which it was read first.
    read: BTreeMap<Identity, PathBuf>,
    /// Files that are there already and that an output will replace.
    promised: BTreeMap<Identity, PathBuf>,
    /// Outputs that are written, or just being written.
    written: BTreeMap<Key, PathBuf>,
    /// Those among them that were made anew, by folder and by name without regard to case: a million outputs must not be
    /// compared each with each.
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

/// Notes an input.
///
/// # Errors
/// It is an output too.
pub(super) fn note_read(path: &Path, meta: &Metadata) -> anyhow::Result<()> {
    if meta.is_dir() {
        return Ok(());
    }
    let identity = Identity::of(path, meta);
    let mut ledger = ledger();
    let output = ledger.promised.get(&identity).or_else(|| ledger.written.get(&Key::There(identity.clone())));
    // A name that has gone to another file since says nothing any more.
    if let Some(output) = output
        && fs::metadata(output).is_ok_and(|meta| Identity::of(output, &meta) == identity)
    {
        return refused(output, path);
    }
    if meta.is_file() && stdout_file() == Some(&identity) {
        bail!(
            "{} is an input, and the standard output goes to it: an input is never overwritten; name another output",
            path.display()
        );
    }
    ledger.read.entry(identity).or_insert_with(|| path.to_path_buf());
    Ok(())
}

/// The file that the standard output was sent to, where it is one.
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

/// Looks where outputs will go, before the work.
///
/// # Errors
/// One is an input, two are one file, or one cannot be written.
pub(super) fn promise(outputs: &[&Path]) -> anyhow::Result<()> {
    let mut places: Vec<Place> = Vec::new();
    for output in outputs {
        let place = Place::of(output)?;
        apart(&place, places.iter().filter_map(|other| Some((other.key.as_ref()?, other.named.as_path()))))?;
        places.push(place);
    }
    let mut ledger = ledger();
    for place in &places {
        ledger.spares_inputs(place)?;
    }
    for place in places {
        if let Some(Key::There(identity)) = place.key {
            ledger.promised.insert(identity, place.named);
        }
    }
    Ok(())
}

/// Takes the places of outputs that are about to be written.
///
/// # Errors
/// As [`promise`], and where something was written there before in this run.
pub(super) fn take(outputs: &[&Path]) -> anyhow::Result<Vec<Place>> {
    let mut places: Vec<Place> = Vec::new();
    let mut ledger = ledger();
    for output in outputs {
        let place = Place::of(output)?;
        ledger.spares_inputs(&place)?;
        apart(&place, places.iter().filter_map(|other| Some((other.key.as_ref()?, other.named.as_path()))))?;
        apart(&place, ledger.written_like(&place))?;
        places.push(place);
    }
    for place in &places {
        if let Some(key) = &place.key {
            ledger.written.insert(key.clone(), place.named.clone());
            if let Some(alike) = without_case(key) {
                ledger.alike.entry(alike).or_default().push(key.clone());
            }
        }
    }
    Ok(places)
}

/// A file that this process has just made: whatever bore its number before is gone.
pub(super) fn note_made(path: &Path, meta: &Metadata) {
    let identity = Identity::of(path, meta);
    let mut ledger = ledger();
    ledger.read.remove(&identity);
    ledger.promised.remove(&identity);
    ledger.written.remove(&Key::There(identity));
}

/// A file that was made is in its place.
pub(super) fn note_put(place: &Place) {
    if let Ok(meta) = fs::metadata(&place.path) {
        ledger().written.insert(Key::There(Identity::of(&place.path, &meta)), place.named.clone());
    }
}

/// A new round of a run that goes on: it writes its outputs again.
pub(crate) fn new_round() {
    let mut ledger = ledger();
    ledger.written.clear();
    ledger.alike.clear();
}

/// Folder and name of a file that is to be made, without regard to case.
fn without_case(key: &Key) -> Option<(Identity, String)> {
    match key {
        Key::New(folder, name) => Some((folder.clone(), name.to_string_lossy().to_lowercase())),
        _ => None,
    }
}

impl Ledger {
    /// What was written and may be the same file.
    fn written_like(&self, place: &Place) -> impl Iterator<Item = (&Key, &Path)> {
        // Another job may have put its own file over ours: the number of ours then goes to any other.
        let is_still = |key: &Key, named: &Path| match key {
            Key::There(identity) => {
                fs::metadata(named).is_ok_and(|meta| Identity::of(named, &meta) == *identity)
            }
            _ => true,
        };
        let same = place.key.as_ref().and_then(|key| self.written.get_key_value(key));
        let same = same.filter(|(key, named)| is_still(key, named));
        let alike = place.key.as_ref().and_then(without_case).and_then(|alike| self.alike.get(&alike));
        let alike = alike.into_iter().flatten().filter_map(|key| self.written.get_key_value(key));
        same.into_iter().chain(alike).map(|(key, named)| (key, named.as_path()))
    }

    fn spares_inputs(&self, place: &Place) -> anyhow::Result<()> {
        match &place.key {
            Some(Key::There(identity)) => match self.read.get(identity) {
                Some(input) => refused(&place.named, input),
                None if stdout_file() == Some(identity) => {
                    bail!(
                        "{}: the standard output goes to this file already; name another output",
                        place.named.display()
                    )
                }
                None => Ok(()),
            },
            _ => Ok(()),
        }
    }
}

fn refused(output: &Path, input: &Path) -> anyhow::Result<()> {
    let also = if output == input { String::new() } else { format!(" (it is {})", input.display()) };
    bail!("{} is an input{also}: an input is never overwritten; name another output", output.display())
}

/// No two outputs go to one file: the second would take the place of the first.
fn apart<'a>(place: &Place, others: impl Iterator<Item = (&'a Key, &'a Path)>) -> anyhow::Result<()> {
    for (key, named) in others {
        if !place.meets(key) {
            continue;
        }
        if *key == Key::Stdout {
            bail!("two outputs go to the standard output: name a file for all but one");
        }
        if named == place.named {
            bail!(
                "{} is named for two outputs: the second would take the place of the first",
                named.display()
            );
        }
        bail!(
            "{} and {} are one file: the second output would take the place of the first",
            named.display(),
            place.named.display()
        );
    }
    Ok(())
}
