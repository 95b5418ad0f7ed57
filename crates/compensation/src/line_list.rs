//! Lists of line numbers for a sentence.

use std::path::Path;

use truegrind_programs::motion::{Listing, Place};

/// Line numbers of motions, the first few; `None` without any.
pub(crate) fn lines_of(listing: &Listing, motions: &[u32]) -> Option<String> {
    numbered(listing, motions.iter().map(|motion| listing.motions[*motion as usize].place))
}

/// How many lines are listed.
const NAMED_LINES: usize = 8;

/// Line numbers, the first few, by file where there are several; `None` without any.
pub(crate) fn numbered(listing: &Listing, places: impl Iterator<Item = Place>) -> Option<String> {
    let mut files: Vec<(u32, Vec<String>)> = Vec::new();
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
        match files.last_mut() {
            Some((file, lines)) if *file == place.file => lines.push(line),
            _ => files.push((place.file, vec![line])),
        }
    }
    let is_one_file = listing.files.len() < 2;
    let of_file = |(file, lines): &(u32, Vec<String>)| {
        let word = if lines.len() == 1 { "line" } else { "lines" };
        let name = Path::new(&listing.files[*file as usize]).file_name().unwrap_or_default().display();
        let place = if is_one_file { String::new() } else { format!(" of {name}") };
        format!("{word} {}{place}", lines.join(", "))
    };
    let named: Vec<String> = files.iter().map(of_file).collect();
    (!named.is_empty()).then(|| format!("{}{more}", named.join("; ")))
}
