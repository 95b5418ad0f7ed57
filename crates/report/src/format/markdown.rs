//! Markdown for GitHub and GitLab (CommonMark with tables).
//!
//! Plots are replaced by their captions, since Markdown cannot embed SVG.

use super::{html, visible};
use crate::document::{Block, Document};
use crate::table::{Alignment, Table};

/// The table with a bold title above and its notes below.
///
/// ```
/// use truegrind_report::format::markdown;
/// use truegrind_report::table::{Cell, Column, Table};
///
/// let mut table = Table::new("", vec![Column::text("name", "name"), Column::number("rmse_mm", "RMSE", "mm", 2)]);
/// table.push(["a|b".into(), 1.5.into()]);
/// table.push(["c".into(), Cell::Missing]);
/// let text = markdown::table(&table);
/// assert!(text.contains("RMSE [mm]") && text.contains("1.50") && text.contains('–'), "{text}");
/// // A bar in a name is escaped.
/// assert!(text.contains(r"a\|b"), "{text}");
/// ```
pub fn table(table: &Table) -> String {
    let mut text = String::new();
    if !table.title.is_empty() {
        text.push_str(&format!("**{}**\n\n", escape(&table.title)));
    }
    let cells: Vec<Vec<String>> = (0..table.columns.len())
        .map(|column| {
            std::iter::once(table.columns[column].label())
                .chain((0..table.rows.len()).map(|row| table.shown(row, column)))
                .map(|cell| escape(&cell))
                .collect()
        })
        .collect();
    let widths: Vec<usize> = cells
        .iter()
        .map(|column| column.iter().map(|cell| cell.chars().count()).max().unwrap_or(0).max(3))
        .collect();
    for line in 0..=table.rows.len() {
        text.push('|');
        for ((column, cells), &width) in table.columns.iter().zip(&cells).zip(&widths) {
            match column.alignment() {
                Alignment::Left => text.push_str(&format!(" {:<width$} |", cells[line])),
                Alignment::Right => text.push_str(&format!(" {:>width$} |", cells[line])),
            }
        }
        text.push('\n');
        if line == 0 {
            text.push('|');
            for (column, width) in table.columns.iter().zip(&widths) {
                let rule = "-".repeat(width - 1);
                match column.alignment() {
                    Alignment::Left => text.push_str(&format!(" :{rule} |")),
                    Alignment::Right => text.push_str(&format!(" {rule}: |")),
                }
            }
            text.push('\n');
        }
    }
    for note in &table.notes {
        text.push_str(&format!("\n{}\n", escape(note)));
    }
    text
}

/// The document.
pub fn document(document: &Document) -> String {
    let mut text = format!("# {}\n", escape(&document.title));
    if !document.subtitle.is_empty() {
        text.push_str(&format!("\n{}\n", escape(&document.subtitle)));
    }
    push_blocks(&mut text, &document.blocks);
    text
}

fn push_blocks(text: &mut String, blocks: &[Block]) {
    for block in blocks {
        text.push('\n');
        match block {
            Block::Heading(level, heading) => {
                text.push_str(&format!("{} {}\n", "#".repeat((*level).clamp(2, 6).into()), escape(heading)));
            }
            Block::Paragraph(paragraph) => text.push_str(&format!("{}\n", escape(paragraph))),
            Block::List(points) => {
                for point in points {
                    text.push_str(&format!("- {}\n", escape(point)));
                }
            }
            Block::KeyFigures(figures) => {
                for figure in figures {
                    let (shown, unit) = figure.shown();
                    let mut line = format!(
                        "- {}: **{}**",
                        escape(&figure.label),
                        escape(format!("{shown} {unit}").trim())
                    );
                    if let Some(status) = figure.status {
                        line.push_str(&format!(" ({} {})", status.sign(), status.word()));
                    }
                    if !figure.note.is_empty() {
                        line.push_str(&format!(", {}", escape(&figure.note)));
                    }
                    text.push_str(&line);
                    text.push('\n');
                }
            }
            Block::Table(block) => text.push_str(&table(block)),
            Block::Figure(figure) => text.push_str(&format!("*Figure: {}*\n", escape(&figure.caption))),
            Block::Verdict(verdict) => {
                let status = verdict.status;
                text.push_str(&format!(
                    "> **{} {}:** {}\n",
                    status.sign(),
                    status.word(),
                    escape(&verdict.headline)
                ));
                for (index, reason) in verdict.reasons.iter().enumerate() {
                    text.push_str(if index == 0 { ">\n" } else { "" });
                    text.push_str(&format!("> - {}\n", escape(reason)));
                }
            }
            Block::Details { summary, blocks } => {
                text.push_str(&format!("<details>\n<summary>{}</summary>\n", html::escape(summary)));
                push_blocks(text, blocks);
                text.push_str("\n</details>\n");
            }
            Block::Code(code) => {
                // A fence longer than any run of backticks inside.
                let longest = code.split(|c| c != '`').map(str::len).max().unwrap_or(0);
                let fence = "`".repeat((longest + 1).max(3));
                let code = visible::text(code.trim_end_matches('\n'));
                text.push_str(&format!("{fence}\n{code}\n{fence}\n"));
            }
            Block::Provenance(provenance) => {
                for (name, value) in provenance.entries() {
                    text.push_str(&format!("- {}: {}\n", escape(&name), escape(&value)));
                }
            }
        }
    }
}

/// Escapes text for one line of Markdown. Underscores inside words (`path_01.mod`) need no escape.
fn escape(text: &str) -> String {
    let characters: Vec<char> = visible::text(text).chars().collect();
    let mut escaped = String::with_capacity(text.len());
    for (index, &character) in characters.iter().enumerate() {
        let word = |i: Option<usize>| {
            i.and_then(|i| characters.get(i)).is_some_and(|c| c.is_alphanumeric() || *c == '_')
        };
        match character {
            '\\' | '`' | '*' | '<' | '|' | '~' => escaped.push('\\'),
            // Brackets are special only in `](`, `][` and `]:`.
            ']' if matches!(characters.get(index + 1), Some('(' | '[' | ':')) => escaped.push('\\'),
            '_' if !(word(index.checked_sub(1)) && word(Some(index + 1))) => escaped.push('\\'),
            '#' | '-' | '+' | '>'
                if index == 0 && characters.len() > 1 && !characters[1].is_ascii_digit() =>
            {
                escaped.push('\\');
            }
            '&' if characters[index + 1..].iter().take(12).any(|c| *c == ';') => escaped.push('\\'),
            _ => {}
        }
        escaped.push(if matches!(character, '\n' | '\r') { ' ' } else { character });
    }
    escaped
}
