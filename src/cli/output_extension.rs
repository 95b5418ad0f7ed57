//! File extensions of what is written: controller, reader and spreadsheet infer the language from them.

use std::ffi::OsStr;
use std::path::{Path, PathBuf};

use anyhow::bail;
use truegrind::programs::nc::dialect::Dialect;
use truegrind::programs::nc::setup::control_of;
use truegrind::programs::reading::Language;

use super::files;

/// Extensions of each language, for messages.
const RAPID: &str = ".mod, .modx, .prg, .sys (RAPID)";
const NC: &str = ".nc (Fanuc style), .mpf, .spf (840D), .ngc (LinuxCNC), .h (Heidenhain) and the other extensions of NC files";

/// The language of an output's extension; `None` without extension, as for stdout and devices.
fn language_of(output: &Path) -> anyhow::Result<Option<Language>> {
    let Some(extension) = output.extension() else { return Ok(None) };
    let list = extension.eq_ignore_ascii_case("pgf");
    match Language::by_name(&files::name(output)).filter(|_| !list) {
        Some(language) => Ok(Some(language)),
        None => bail!(
            "{}: .{} is not an extension of programs that can be written; expected {RAPID}, or {NC}",
            output.display(),
            extension.to_string_lossy()
        ),
    }
}

/// Refuses an output with the extension of another kind of file for a model.
pub(super) fn refuse_no_model(output: &Path) -> anyhow::Result<()> {
    match output.extension().filter(|extension| !extension.eq_ignore_ascii_case("toml")) {
        Some(extension) => bail!(
            "{}: a model file is TOML: expected the extension .toml, not .{}",
            output.display(),
            extension.to_string_lossy()
        ),
        None => Ok(()),
    }
}

/// The name of a CSV file. A text named as a workbook is opened by no spreadsheet.
pub(super) fn csv_file(name: &str) -> Result<PathBuf, String> {
    let path = PathBuf::from(name);
    let is_workbook =
        |extension: &OsStr| ["xlsx", "xls", "xlsb", "ods"].iter().any(|e| extension.eq_ignore_ascii_case(e));
    if path.extension().is_some_and(is_workbook) {
        return Err("CSV is written here, which a spreadsheet opens under the extension .csv".to_owned());
    }
    Ok(path)
}

/// Extensions by which a spreadsheet, a browser or this program itself takes a file for another kind.
const TELLING: [&str; 12] =
    ["csv", "tsv", "xlsx", "xls", "xlsb", "ods", "parquet", "json", "html", "htm", "md", "toml"];

/// Refuses a report whose extension promises another kind of file.
pub(super) fn refuse_other_kind(output: &Path, kind: &str, own: &[&str]) -> anyhow::Result<()> {
    let extension = output.extension().map(|extension| extension.to_string_lossy().to_ascii_lowercase());
    match extension.filter(|found| TELLING.contains(&found.as_str()) && !own.contains(&found.as_str())) {
        Some(other) => bail!(
            "{}: {kind} is written here: expected the extension .{}, not .{other}",
            output.display(),
            own.first().unwrap_or(&"")
        ),
        None => Ok(()),
    }
}

/// Refuses an output with the extension of an NC program.
pub(super) fn refuse_nc(output: &Path) -> anyhow::Result<()> {
    match language_of(output)? {
        Some(Language::Nc) => bail!("{}: the output is a RAPID module; expected {RAPID}", output.display()),
        _ => Ok(()),
    }
}

/// Refuses an output whose extension belongs to another language or control than its source.
pub(super) fn refuse_other_language(output: &Path, source: &Path, bytes: &[u8]) -> anyhow::Result<()> {
    let extension = |path: &Path| path.extension().map(|extension| extension.to_ascii_lowercase());
    if extension(output) == extension(source) {
        return Ok(());
    }
    let Some(language) = language_of(output)? else { return Ok(()) };
    let (from, to) = (files::name(source), files::name(output));
    let is = Language::of(&from, bytes);
    let expected = match is {
        Language::Rapid => RAPID,
        Language::Nc => NC,
    };
    // A file with an unknown extension and no sign of RAPID may be no program at all, which is reported elsewhere.
    let known = Language::by_name(&from).is_some() || is == Language::Rapid;
    if is != language && known {
        bail!(
            "{}: programs are not translated between languages, and {} is {}; expected {expected}",
            output.display(),
            source.display(),
            if is == Language::Rapid { "RAPID" } else { "an NC program" }
        );
    }
    let original = control_of(&from, bytes);
    // A control reads the file by its extension, whatever it holds: Fanuc text in a file .mpf is no 840D program.
    let by_extension = Some(Dialect::of_named(&to, b"")).filter(|dialect| *dialect != Dialect::Iso);
    let written = by_extension.unwrap_or_else(|| control_of(&to, bytes));
    if is == Language::Nc && known && original != written {
        bail!(
            "{}: this extension stands for {}, but {} is for {}: use the extension of the original",
            output.display(),
            written.text(),
            source.display(),
            original.text()
        );
    }
    Ok(())
}
