//! How a program is laid out: case, blanks, comments, line ends.

use rand::RngExt;

use super::Maker;

/// Words that are written in capitals, small letters or mixed, as the program likes.
const WORDS: [&str; 12] = [
    "MoveL", "MoveJ", "MoveC", "MoveAbsJ", "Offs", "RelTool", "IF", "FOR", "ENDIF", "ENDFOR", "THEN", "ConfL",
];

const COMMENTS: [&str; 6] = [
    "! MoveL p10,v100,fine,tool0;",
    "!",
    "! \"open",
    "! p10:=[[0,0,0],[1,0,0,0],[0,0,0,0],[0,0,0,0,0,0]];",
    "!! ENDPROC \u{e4}",
    "! ] ; } \\",
];

impl Maker<'_> {
    /// The bytes of a module.
    pub(super) fn laid_out(&mut self, text: &str) -> Vec<u8> {
        let style = self.rng.random_range(0..4);
        let end = if self.chance(0.3) { "\r\n" } else { "\n" };
        let odd = self.chance(0.3);
        let mut out = String::new();
        for line in text.lines() {
            let mut line = line.to_owned();
            if style > 0 && !line.contains('"') {
                for word in WORDS {
                    let wanted = if style == 1 { word.to_uppercase() } else { word.to_lowercase() };
                    if style < 3 && line.starts_with(word) {
                        line = line.replacen(word, &wanted, 1);
                    }
                }
            }
            out.push_str(if self.chance(0.5) { "  " } else { "\t" });
            if odd && !line.contains('"') && self.chance(0.2) {
                line = self.torn(&line, end);
            }
            out.push_str(&line);
            if self.chance(0.1) {
                let comment = COMMENTS[self.rng.random_range(0..COMMENTS.len())];
                out.push(' ');
                out.push_str(comment);
            }
            out.push_str(end);
            if self.chance(0.04) {
                out.push_str(end);
            }
        }
        // Latin-1.
        out.chars().map(|c| u8::try_from(u32::from(c)).unwrap_or(b'?')).collect()
    }

    /// A line with blanks, line ends and comments at its commas.
    fn torn(&mut self, line: &str, end: &str) -> String {
        let mut out = String::new();
        for letter in line.chars() {
            out.push(letter);
            if letter == ',' {
                match self.rng.random_range(0..12) {
                    0 => out.push_str(end),
                    1 => out.push_str(&format!(" ! here, too;{end}  ")),
                    2 => out.push_str("  "),
                    3 => out.push('\t'),
                    _ => {}
                }
            }
        }
        out
    }
}
