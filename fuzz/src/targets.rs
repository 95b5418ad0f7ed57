//! The targets by name, with the samples that they start from and the words of their languages.

use std::path::Path;

/// Something that reads bytes of others.
pub struct Target {
    /// Its name on the command line.
    pub name: &'static str,
    /// What is tried: must end, without a panic, within the bounds of time and memory.
    pub run: fn(&[u8]),
    /// Folders of samples, below the repository, and the endings that count there.
    samples: &'static [(&'static str, &'static [&'static str])],
    /// Words of the language, a file of this name below `fuzz/words`.
    words: &'static str,
    /// The longest piece of a sample (bytes): a whole model is long.
    pub longest: usize,
}

const PROGRAMS: usize = 6000;
const TABLES: usize = 64_000;

/// All targets.
pub const TARGETS: [Target; 16] = [
    target("rapid", crate::rapid, &[("programs", &["mod", "modx", "prg", "sys"])], "rapid", PROGRAMS),
    target("nc", crate::nc, &[("programs", &["nc", "mpf", "ngc", "h"])], "nc", PROGRAMS),
    target("rapid-job", crate::rapid_job, &[("programs", &["mod", "modx", "prg", "sys"])], "rapid", PROGRAMS),
    target("nc-job", crate::nc_job, &[("programs", &["nc", "mpf", "ngc", "h"])], "nc", PROGRAMS),
    target("csv", crate::csv, &[("tests/data", &["csv"]), ("fuzz/corpus/csv", &["csv"])], "csv", PROGRAMS),
    target("points", crate::points, &[("fuzz/corpus/points", &["txt"])], "csv", PROGRAMS),
    target("xlsx", crate::xlsx, &[("fuzz/corpus/xlsx", &["parts"])], "xlsx", TABLES),
    target("surface", crate::surface, &[("surfaces", &["toml"])], "surface", PROGRAMS),
    target("stl", crate::stl, &[("surfaces", &["stl"]), ("fuzz/corpus/stl", &["stl"])], "stl", PROGRAMS),
    target("model", crate::model, &[("fuzz/corpus/model", &["toml"])], "toml", TABLES),
    target("robot", crate::robot, &[("fuzz/corpus/robot", &["toml"])], "toml", PROGRAMS),
    target(
        "arm-file",
        crate::arm_file,
        &[("crates/arm/tests/data", &["urdf"]), ("fuzz/corpus/arm", &["csv", "conf", "yaml"])],
        "arm",
        PROGRAMS,
    ),
    target("cell", crate::cell, &[("fuzz/corpus/cell", &["toml"])], "toml", PROGRAMS),
    target("recipe", crate::recipe, &[("tests/data", &["toml"])], "toml", PROGRAMS),
    target("experiment", crate::experiment, &[("experiments", &["toml"])], "toml", PROGRAMS),
    target("list", crate::list, &[("fuzz/corpus/pgf", &["pgf"])], "pgf", PROGRAMS),
];

const fn target(
    name: &'static str,
    run: fn(&[u8]),
    samples: &'static [(&'static str, &'static [&'static str])],
    words: &'static str,
    longest: usize,
) -> Target {
    Target { name, run, samples, words, longest }
}

/// The folder of the repository.
fn root() -> std::path::PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("..")
}

impl Target {
    /// Its samples, in the order of their names.
    pub fn samples(&self) -> Vec<Vec<u8>> {
        let mut files = Vec::new();
        for (folder, endings) in self.samples {
            let entries = std::fs::read_dir(root().join(folder)).into_iter().flatten();
            let paths = entries.filter_map(|entry| entry.ok().map(|entry| entry.path()));
            let counts = |path: &std::path::PathBuf| {
                path.extension().is_some_and(|ending| endings.iter().any(|wanted| ending == *wanted))
            };
            files.extend(paths.filter(counts));
        }
        files.sort();
        files.iter().filter_map(|path| std::fs::read(path).ok()).collect()
    }

    /// The words of its language, one a line, with `\n`, `\r`, `\t` and `\u{…}` (a byte where it is one) for what a line
    /// cannot hold.
    pub fn words(&self) -> Vec<Vec<u8>> {
        let file = root().join("fuzz/words").join(format!("{}.txt", self.words));
        let text = std::fs::read_to_string(file).unwrap_or_default();
        text.lines().map(unescaped).filter(|word| !word.is_empty()).collect()
    }
}

fn unescaped(line: &str) -> Vec<u8> {
    let mut out = Vec::new();
    let mut rest = line;
    while let Some(at) = rest.find('\\') {
        out.extend_from_slice(&rest.as_bytes()[..at]);
        rest = &rest[at + 1..];
        let plain = [("n", b'\n'), ("r", b'\r'), ("t", b'\t')];
        let hex = rest.strip_prefix("u{").and_then(|hex| hex.split_once('}'));
        if let Some((code, after)) =
            hex.and_then(|(h, after)| Some((u32::from_str_radix(h, 16).ok()?, after)))
        {
            match u8::try_from(code) {
                Ok(byte) => out.push(byte),
                Err(_) => out.extend(char::from_u32(code).map(|c| c.to_string()).unwrap_or_default().bytes()),
            }
            rest = after;
        } else if let Some((_, byte, after)) =
            plain.iter().find_map(|(name, byte)| Some((name, *byte, rest.strip_prefix(name)?)))
        {
            // `\Rz` is a word of RAPID, `\n` at the end of a word is the end of a line.
            if after.is_empty()
                || after.starts_with(['\\', ' '])
                || after.starts_with(|c: char| !c.is_alphanumeric())
            {
                out.push(byte);
                rest = after;
            } else {
                out.push(b'\\');
            }
        } else {
            out.push(b'\\');
        }
    }
    out.extend_from_slice(rest.as_bytes());
    out
}
