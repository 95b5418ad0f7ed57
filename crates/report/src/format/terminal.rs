//! Plain text for a terminal: columns aligned within a given width, no colour codes.
//!
//! Every character is assumed to be one cell wide, which holds for all text of truegrind itself. Control characters are escaped
//! ([`visible`]).

use super::{visible, words};
use crate::document::{Block, Document};
use crate::status::Status;
use crate::table::{Alignment, ColumnKind, Table};

/// Text columns are narrowed to this width before a table is split into blocks.
const MIN_TEXT_WIDTH: usize = 12;
/// Longer cells count as sentences, which need a wider column.
const SENTENCE: usize = 40;
const MIN_SENTENCE_WIDTH: usize = 24;
/// Longer names may be broken.
const MAX_UNBROKEN_NAME: usize = 28;
const GAP: usize = 2;
/// Stands for a space at which no line is broken.
const GLUE: char = '\u{a0}';

/// The table as lines of at most `width` characters. A wider table first omits common folders of paths, then wraps headings and text cells,
/// and finally continues in blocks below, which repeat as many leading columns as identify the rows. Nothing is truncated.
pub fn table(table: &Table, width: usize) -> String {
    let mut text = String::new();
    if !table.title.is_empty() {
        text.push_str(&wrapped(&table.title, width, ""));
    }
    let columns = 0..table.columns.len();
    let heading: Vec<String> = table.columns.iter().map(|column| flat(&column.label())).collect();
    let rows = (0..table.rows.len()).map(|row| columns.clone().map(|c| flat(&table.shown(row, c))).collect());
    let mut lines: Vec<Vec<String>> = std::iter::once(heading).chain(rows).collect();
    let widest = |lines: &[Vec<String>]| -> Vec<usize> {
        columns.clone().map(|c| lines.iter().map(|line| length(&line[c])).max().unwrap_or(0)).collect()
    };
    let mut widths = widest(&lines);
    if total(widths.iter().copied()) > width {
        columns.clone().for_each(|column| omit_common_folder(&mut lines[1..], column));
        widths = widest(&lines);
    }
    shrink(table, &lines, &mut widths, width);
    for (number, block) in blocks(&widths, identifying_columns(table, &lines[1..]), width).iter().enumerate()
    {
        if !text.is_empty() && number > 0 {
            text.push('\n');
        }
        for (index, line) in lines.iter().enumerate() {
            let mut cells: Vec<Vec<String>> = block.iter().map(|&c| wrap_cell(&line[c], widths[c])).collect();
            let height = cells.iter().map(Vec::len).max().unwrap_or(1);
            if index == 0 {
                // Headings end at the rule.
                for cell in &mut cells {
                    cell.splice(0..0, vec![String::new(); height - cell.len()]);
                }
            }
            for row in 0..height {
                let cell = |(place, &c): (usize, &usize)| {
                    let piece = cells[place].get(row).map_or("", String::as_str);
                    fit(piece, widths[c], table.columns[c].alignment())
                };
                push_line(&mut text, block.iter().enumerate().map(cell));
            }
            if index == 0 {
                push_line(&mut text, block.iter().map(|&c| "─".repeat(widths[c])));
            }
        }
    }
    for note in &table.notes {
        text.push_str(&wrapped(note, width, "  "));
    }
    text
}

/// The document as lines of at most `width` characters, without plots, collapsed details, and headings of these alone.
pub fn document(document: &Document, width: usize) -> String {
    let mut text = wrapped(&document.title, width, "");
    text.push_str(&format!("{}\n", "═".repeat(length(&visible::text(&document.title)).min(width))));
    if !document.subtitle.is_empty() {
        text.push_str(&wrapped(&document.subtitle, width, ""));
    }
    for (index, block) in document.blocks.iter().enumerate() {
        if shows(block, &document.blocks[index + 1..]) {
            text.push('\n');
            push_block(&mut text, block, width);
        }
    }
    text
}

/// Whether a block is shown on a terminal, given the following blocks.
fn shows(block: &Block, after: &[Block]) -> bool {
    match block {
        Block::Figure(_) | Block::Details { .. } => false,
        Block::Heading(level, _) => after
            .iter()
            .take_while(|block| !matches!(block, Block::Heading(next, _) if next <= level))
            .any(|block| !matches!(block, Block::Figure(_) | Block::Details { .. } | Block::Heading(..))),
        _ => true,
    }
}

/// A status for a terminal, `[warning]`.
pub fn badge(status: Status) -> String {
    format!("[{}]", status.word())
}

fn push_block(text: &mut String, block: &Block, width: usize) {
    match block {
        Block::Heading(level, heading) => {
            text.push_str(&wrapped(heading, width, ""));
            if *level <= 2 {
                text.push_str(&format!("{}\n", "─".repeat(length(&visible::text(heading)).min(width))));
            }
        }
        Block::Paragraph(paragraph) => text.push_str(&wrapped(paragraph, width, "")),
        Block::List(points) => {
            for point in points {
                text.push_str(&wrapped(&format!("- {point}"), width, "  "));
            }
        }
        Block::KeyFigures(figures) => {
            let label = figures.iter().map(|figure| length(&figure.label)).max().unwrap_or(0);
            let value = figures.iter().map(|figure| length(&figure.shown().0)).max().unwrap_or(0);
            let unit_width = figures.iter().map(|figure| length(figure.shown().1)).max().unwrap_or(0);
            for figure in figures {
                let (shown, unit) = figure.shown();
                let name = visible::line(&figure.label);
                let (shown, unit) = (visible::line(&shown), visible::line(unit));
                let mut line = format!("{name:label$}  {shown:>value$} {unit:unit_width$}");
                if let Some(status) = figure.status {
                    line.push_str(&format!("  {}", badge(status)));
                }
                beside(text, &line, &visible::line(&figure.note), width);
            }
        }
        Block::Table(block) => text.push_str(&table(block, width)),
        Block::Figure(_) | Block::Details { .. } => {}
        Block::Verdict(verdict) => {
            text.push_str(&wrapped(&format!("{} {}", badge(verdict.status), verdict.headline), width, "  "));
            for reason in &verdict.reasons {
                text.push_str(&wrapped(&format!("  - {reason}"), width, "    "));
            }
        }
        Block::Code(code) => {
            for line in visible::text(code).lines() {
                text.push_str(&format!("    {line}\n"));
            }
        }
        Block::Provenance(provenance) => {
            for (name, value) in provenance.entries() {
                text.push_str(&wrapped(&format!("{name}: {value}"), width, "  "));
            }
        }
    }
}

/// Narrows columns until the table fits or all are at their minimum: first those of numbers with a long heading, then the widest text.
fn shrink(table: &Table, lines: &[Vec<String>], widths: &mut [usize], width: usize) {
    let whole = widths.to_vec();
    let words = |c: usize| table.columns[c].alignment() == Alignment::Left;
    let name = MAX_UNBROKEN_NAME.min(width / 3);
    let least: Vec<usize> =
        (0..widths.len()).map(|c| narrowest(lines, c, whole[c], words(c).then_some(name))).collect();
    for text in [false, true] {
        while total(widths.iter().copied()) > width {
            let widest = (0..widths.len())
                .filter(|&c| words(c) == text && widths[c] > least[c])
                .max_by_key(|&c| (widths[c], std::cmp::Reverse(c)));
            let Some(column) = widest else { break };
            widths[column] -= 1;
        }
    }
    if total(widths.iter().copied()) > width {
        // The table is split anyway, so only the widest columns are narrowed.
        let most = (width.saturating_sub(GAP) / 2).max(MIN_TEXT_WIDTH);
        (0..widths.len()).filter(|&c| words(c)).for_each(|c| widths[c] = whole[c].min(most.max(widths[c])));
    }
}

/// Least width of a column, whose heading is the first line: numbers are not broken, nor are names without spaces up to the length
/// `name` (`None` for numbers).
fn narrowest(lines: &[Vec<String>], column: usize, whole: usize, name: Option<usize>) -> usize {
    let cells = || lines.iter().skip(1).map(|line| &line[column]);
    let longest = cells().map(|cell| length(cell)).max().unwrap_or(0);
    let Some(name) = name else {
        let heading = lines.first().map_or("", |line| line[column].as_str());
        return heading.split(' ').map(length).fold(longest, usize::max);
    };
    match whole > SENTENCE {
        true => MIN_SENTENCE_WIDTH,
        false if cells().any(|cell| cell.contains(' ')) => MIN_TEXT_WIDTH,
        false => longest.min(name).max(MIN_TEXT_WIDTH),
    }
}

/// Omits the common folder of all paths of a column.
fn omit_common_folder(rows: &mut [Vec<String>], column: usize) {
    // Shorter folders are not worth omitting.
    const WORTH: usize = 4;
    let absent = |cell: &str| cell == "–" || cell == "⋮";
    let paths: Vec<&str> = rows.iter().map(|row| row[column].as_str()).filter(|cell| !absent(cell)).collect();
    let Some((first, rest)) = paths.split_first().filter(|(_, rest)| !rest.is_empty()) else { return };
    let shared = rest.iter().fold(first.len(), |shared, path| {
        shared.min(first.bytes().zip(path.bytes()).take_while(|(a, b)| a == b).count())
    });
    let Some(folders) = first.as_bytes()[..shared].iter().rposition(|byte| matches!(byte, b'/' | b'\\'))
    else {
        return;
    };
    // Text with slashes is not a path.
    if folders < WORTH || paths.iter().any(|path| path.contains(": ")) {
        return;
    }
    for row in rows.iter_mut().filter(|row| !absent(&row[column])) {
        row[column].replace_range(..folders, "…");
    }
}

/// Number of leading text columns that identify the rows; 1 if they do not.
fn identifying_columns(table: &Table, rows: &[Vec<String>]) -> usize {
    let words = table.columns.iter().take_while(|column| column.kind == ColumnKind::Text).count();
    let tells = |count: &usize| {
        let mut seen = std::collections::HashSet::new();
        rows.iter().all(|row| seen.insert(&row[..*count]))
    };
    (1..=words).find(tells).unwrap_or(1)
}

/// Columns of each block. The leading columns are repeated in every block as far as there is room for another column; a block has at
/// least one further column, even if that is too wide.
fn blocks(widths: &[usize], leading: usize, width: usize) -> Vec<Vec<usize>> {
    if widths.is_empty() {
        return Vec::new();
    }
    let room = |count: &usize| {
        let others = widths[*count..].iter().max().copied().unwrap_or(0);
        total(widths[..*count].iter().copied().chain([others])) <= width
    };
    let leading = (1..=leading.min(widths.len())).rev().find(room).unwrap_or(1);
    let mut blocks: Vec<Vec<usize>> = vec![(0..leading).collect()];
    for column in leading..widths.len() {
        let last = blocks.len() - 1;
        let wide = total(blocks[last].iter().chain(&[column]).map(|&c| widths[c])) > width;
        if wide && blocks[last].len() > leading {
            blocks.push((0..leading).chain([column]).collect());
        } else {
            blocks[last].push(column);
        }
    }
    blocks
}

fn total(widths: impl Iterator<Item = usize>) -> usize {
    widths.map(|width| width + GAP).sum::<usize>().saturating_sub(GAP)
}

/// A cell on one line.
fn flat(cell: &str) -> String {
    visible::line(cell).into_owned()
}

fn push_line(text: &mut String, cells: impl Iterator<Item = String>) {
    let line = cells.collect::<Vec<_>>().join(&" ".repeat(GAP));
    text.push_str(line.trim_end());
    text.push('\n');
}

/// Wraps a cell to lines of at most `width` characters: between words, in a long word after a slash, hyphen or similar, or else
/// anywhere.
fn wrap_cell(cell: &str, width: usize) -> Vec<String> {
    if length(cell) <= width {
        return vec![cell.to_owned()];
    }
    let width = width.max(1);
    let mut lines = vec![String::new()];
    for word in words::keep_units(cell, GLUE).split(' ') {
        let mut word = word;
        let line = &lines[lines.len() - 1];
        let joined = length(line) + usize::from(!line.is_empty()) + length(word);
        if joined > width && !line.is_empty() {
            lines.push(String::new());
        }
        loop {
            let last = lines.len() - 1;
            let line = &mut lines[last];
            if !line.is_empty() {
                line.push(' ');
            }
            if length(word) <= width.saturating_sub(length(line)) {
                line.push_str(word);
                break;
            }
            let hard = word.char_indices().nth(width).map_or(word.len(), |(at, _)| at);
            let soft = word[..hard].rfind(['/', '\\', '-', '_', ',', ';']).map(|at| at + 1);
            let (head, rest) = word.split_at(soft.unwrap_or(hard));
            line.push_str(head);
            word = rest;
            lines.push(String::new());
        }
    }
    lines.into_iter().map(|line| line.replace(GLUE, " ")).collect()
}

fn fit(cell: &str, width: usize, alignment: Alignment) -> String {
    let blank = " ".repeat(width.saturating_sub(length(cell)));
    match alignment {
        Alignment::Left => format!("{cell}{blank}"),
        Alignment::Right => format!("{blank}{cell}"),
    }
}

/// A line with a note beside it, wrapped in its own column.
fn beside(text: &mut String, line: &str, note: &str, width: usize) {
    let indent = length(line) + GAP;
    let room = width.saturating_sub(indent).max(MIN_SENTENCE_WIDTH);
    let mut notes = wrapped(note, room, "");
    notes.truncate(notes.trim_end().len());
    for (index, note) in notes.split('\n').enumerate() {
        let lead = if index == 0 { line.to_owned() } else { " ".repeat(length(line)) };
        text.push_str(format!("{lead}{}{note}", " ".repeat(GAP)).trim_end());
        text.push('\n');
    }
}

/// Wraps text to lines of at most `width` characters; further lines start with `indent`. A longer word, such as a file name, is not
/// broken.
fn wrapped(text: &str, width: usize, indent: &str) -> String {
    let text = &*words::keep_units(&visible::text(text), GLUE);
    let mut lines = String::new();
    let leading: String = text.chars().take_while(|c| *c == ' ').collect();
    let mut line = leading;
    let mut empty = true;
    for word in text.split([' ', '\n', '\t']).filter(|word| !word.is_empty()) {
        if !empty && length(&line) + 1 + length(word) > width {
            lines.push_str(&line);
            lines.push('\n');
            line = indent.to_owned();
            empty = true;
        }
        if !empty {
            line.push(' ');
        }
        line.push_str(word);
        empty = false;
    }
    lines.push_str(&line);
    lines.push('\n');
    lines.replace(GLUE, " ")
}

/// Number of character cells; the variation selector after the warning sign has no width.
fn length(text: &str) -> usize {
    text.chars().filter(|c| *c != '\u{fe0e}').count()
}
