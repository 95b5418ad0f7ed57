//! How a program that is written may be called: its ending tells controller and reader which language it is in.

use std::path::Path;

use anyhow::bail;
use truegrind::programs::nc::dialect::Dialect;
use truegrind::programs::reading::Language;

use super::files;

/// The endings of each language, for messages.
const RAPID: &str = ".mod, .modx, .prg, .sys (RAPID)";
const NC: &str = ".nc (Fanuc style), .mpf, .spf (840D), .ngc (LinuxCNC), .h (Heidenhain) and the other endings of NC files";

/// What the ending of an output says; `None` where it has none, as the standard output and devices.
fn stated(output: &Path) -> anyhow::Result<Option<Language>> {
    let Some(ending) = output.extension() else { return Ok(None) };
    let list = ending.eq_ignore_ascii_case("pgf");
    match Language::by_name(&files::name(output)).filter(|_| !list) {
        Some(language) => Ok(Some(language)),
        None => bail!(
            "{}: .{} is the ending of no program that is written here; expected {RAPID}, or {NC}",
            output.display(),
            ending.to_string_lossy()
        ),
    }
}

/// Refuses an output whose ending is of no language that is written here.
pub(super) fn refuse_unknown(output: &Path) -> anyhow::Result<()> {
    stated(output).map(drop)
}

/// Refuses an output that would pass for anything but RAPID.
pub(super) fn refuse_nc(output: &Path) -> anyhow::Result<()> {
    match stated(output)? {
        Some(Language::Nc) => bail!("{}: a RAPID module is written; expected {RAPID}", output.display()),
        _ => Ok(()),
    }
}

/// Refuses an output that would pass for another language or another control than the program that it is made of. What
/// ends as its source does is no question.
pub(super) fn refuse_other_language(output: &Path, source: &Path, bytes: &[u8]) -> anyhow::Result<()> {
    let ending = |path: &Path| path.extension().map(|ending| ending.to_ascii_lowercase());
    if ending(output) == ending(source) {
        return Ok(());
    }
    let Some(language) = stated(output)? else { return Ok(()) };
    let (from, to) = (files::name(source), files::name(output));
    let is = Language::of(&from, bytes);
    let expected = match is {
        Language::Rapid => RAPID,
        Language::Nc => NC,
    };
    // A file of another ending that shows no sign of RAPID may be no program at all: that is told elsewhere.
    let told = Language::by_name(&from).is_some() || is == Language::Rapid;
    if is != language && told {
        bail!(
            "{}: programs are not translated, and {} is {}; expected {expected}",
            output.display(),
            source.display(),
            if is == Language::Rapid { "RAPID" } else { "an NC program" }
        );
    }
    if is == Language::Nc && told && Dialect::of_named(&from, bytes) != Dialect::of_named(&to, bytes) {
        bail!(
            "{}: under this ending the program would be taken for one of {}, and {} is one of {}: name a file that ends as it does",
            output.display(),
            Dialect::of_named(&to, bytes).text(),
            source.display(),
            Dialect::of_named(&from, bytes).text()
        );
    }
    Ok(())
}
