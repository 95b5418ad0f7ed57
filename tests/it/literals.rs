//! Messages: a sentence that the source breaks into lines has no run of blanks in it.

use std::fs;
use std::path::{Path, PathBuf};

/// All Rust sources of the crates, the command line and the Python module.
fn sources() -> Vec<PathBuf> {
    let root = Path::new(env!("CARGO_MANIFEST_DIR"));
    let mut folders = vec![root.join("src"), root.join("python/src")];
    folders.extend(fs::read_dir(root.join("crates")).unwrap().map(|entry| entry.unwrap().path().join("src")));
    let mut files = Vec::new();
    while let Some(folder) = folders.pop() {
        for entry in fs::read_dir(&folder).unwrap() {
            let path = entry.unwrap().path();
            if path.is_dir() {
                folders.push(path);
            } else if path.extension().is_some_and(|extension| extension == "rs") {
                files.push(path);
            }
        }
    }
    files
}

/// The string literals of a source with their lines, raw ones apart; a backslash at the end of a line takes the blanks behind it.
fn literals(source: &str) -> Vec<(usize, String)> {
    let bytes: Vec<char> = source.chars().collect();
    let at = |index: usize| bytes.get(index).copied().unwrap_or('\0');
    let (mut index, mut line, mut out) = (0, 1, Vec::new());
    while index < bytes.len() {
        let starts = |text: &str| text.chars().enumerate().all(|(k, c)| at(index + k) == c);
        let end = if starts("//") {
            (index..).find(|&k| at(k) == '\n' || k >= bytes.len()).unwrap()
        } else if at(index) == 'r'
            && matches!(at(index + 1), '"' | '#')
            && !at(index.wrapping_sub(1)).is_alphanumeric()
        {
            end_of_raw(&bytes, index + 1)
        } else if at(index) == '\'' {
            // A character, or a lifetime.
            if at(index + 1) == '\\' {
                (index + 3..).find(|&k| at(k) == '\'' || k >= bytes.len()).unwrap() + 1
            } else if at(index + 2) == '\'' {
                index + 3
            } else {
                index + 1
            }
        } else if at(index) == '"' {
            let (end, text) = literal(&bytes, index + 1);
            out.push((line, text));
            end
        } else {
            index + 1
        };
        let end = end.min(bytes.len());
        line += bytes[index..end].iter().filter(|c| **c == '\n').count();
        index = end;
    }
    out
}

/// Behind a raw literal whose hashes begin at `start`; a name such as `r#type` ends at once.
fn end_of_raw(bytes: &[char], start: usize) -> usize {
    let hashes = bytes[start..].iter().take_while(|c| **c == '#').count();
    if bytes.get(start + hashes) != Some(&'"') {
        return start;
    }
    let body = start + hashes + 1;
    let closes = |k: usize| {
        bytes[k] == '"' && bytes[k + 1..].iter().take(hashes).filter(|c| **c == '#').count() == hashes
    };
    (body..bytes.len()).find(|&k| closes(k)).map_or(bytes.len(), |k| k + 1 + hashes)
}

/// Behind a literal, and its text; `start` is behind its opening quote.
fn literal(bytes: &[char], start: usize) -> (usize, String) {
    let (mut index, mut text) = (start, String::new());
    while index < bytes.len() && bytes[index] != '"' {
        if bytes[index] != '\\' {
            text.push(bytes[index]);
            index += 1;
        } else if bytes.get(index + 1) == Some(&'\n') {
            index += 2 + bytes[index + 2..].iter().take_while(|c| c.is_whitespace()).count();
        } else {
            // Blanks behind an escaped line break indent a file that is written.
            text.push('\n');
            index += 2;
        }
    }
    (index + 1, text)
}

/// The first run of three blanks between two words, or a line break.
fn fault(text: &str) -> Option<&str> {
    let run = text.find("   ").filter(|&start| {
        let before = text[..start].chars().next_back();
        let behind = text[start..].trim_start_matches(' ').chars().next();
        before.is_some_and(|c| c != '\n') && behind.is_some_and(|c| c != '\n')
    })?;
    Some(&text[run..])
}

#[test]
fn no_message_has_a_run_of_blanks() {
    assert_eq!(literals("f(\"a \\\n    b\", 'x', r#\"c   d\"#) // \"e   f\"\n"), [(1, "a b".to_owned())]);
    assert!(
        fault("in mm in    the flange").is_some() && fault("a\n    b").is_none() && fault("   a").is_none()
    );
    let mut found = Vec::new();
    for path in sources() {
        for (line, text) in literals(&fs::read_to_string(&path).unwrap()) {
            if fault(&text).is_some() {
                found.push(format!("{}:{line}: {text}", path.display()));
            }
        }
    }
    assert!(
        found.is_empty(),
        "a literal with a line break ends its lines in a backslash:\n{}",
        found.join("\n")
    );
}
