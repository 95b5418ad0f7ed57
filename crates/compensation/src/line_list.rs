//! Lists of line numbers for a sentence.

use std::path::Path;

use truegrind_programs::motion::{Listing, Place};

/// Line numbers of motions, the first few; `None` without any.
pub(crate) fn lines_of(listing: &Listing, motions: &[u32]) -> Option<String> {
    numbered(&listing.files, motions.iter().map(|motion| listing.motions[*motion as usize].place))
}

/// How many lines are listed.
const NAMED_LINES: usize = 8;

/// Line numbers, the first few, by file where there are several; `None` without any.
pub fn numbered(files: &[String], places: impl Iterator<Item = Place>) -> Option<String> {
    let mut by_file: Vec<(u32, Vec<String>)> = Vec::new();
    let (mut last, mut listed, mut more) = (None, 0, "");
    for place in places {
        if last.replace((place.file, place.line)) == Some((place.file, place.line)) {
            continue;
        }
        if listed == NAMED_LINES {
            more = " and more";
            break;
        }
        listed += 1;
        let line = place.line.to_string();
        match by_file.last_mut() {
            Some((file, lines)) if *file == place.file => lines.push(line),
            _ => by_file.push((place.file, vec![line])),
        }
    }
    let of_file = |(file, lines): &(u32, Vec<String>)| {
        let word = if lines.len() == 1 { "line" } else { "lines" };
        let place = match files.get(*file as usize).filter(|_| files.len() > 1) {
            Some(path) => format!(" of {}", Path::new(path).file_name().unwrap_or_default().display()),
            None => String::new(),
        };
        format!("{word} {}{place}", lines.join(", "))
    };
    let named: Vec<String> = by_file.iter().map(of_file).collect();
    (!named.is_empty()).then(|| format!("{}{more}", named.join("; ")))
}
