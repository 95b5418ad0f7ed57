//! Labels, calls, repeats and FN 9 to FN 12.

use super::Heidenhain;

impl Heidenhain<'_> {
    fn label(&self, name: &str) -> Result<usize, String> {
        let is = |line: &usize| {
            let text = self.lines[*line]
                .trim_start_matches('/')
                .trim_start_matches(|c: char| c.is_ascii_digit() || c == ' ');
            text.strip_prefix("LBL ").is_some_and(|other| other.trim() == name)
        };
        (0..self.lines.len()).find(is).ok_or_else(|| format!("no LBL {name}"))
    }

    /// Runs what steers; the line to go on with.
    pub(super) fn flow(&mut self, at: usize, line: &str) -> Result<Option<usize>, String> {
        if let Some(label) = line.strip_prefix("LBL ") {
            let back = if label.trim() == "0" { self.calls.pop() } else { None };
            return Ok(Some(back.unwrap_or(at + 1)));
        }
        if let Some(rest) = line.strip_prefix("CALL LBL ") {
            let Some((name, times)) = rest.split_once(" REP") else {
                self.calls.push(at + 1);
                return self.label(rest.trim()).map(Some);
            };
            let times = self.value(times)?.round() as i64;
            let left = self.repeats.entry(at).or_insert(times);
            if *left > 0 {
                *left -= 1;
                return self.label(name.trim()).map(Some);
            }
            self.repeats.remove(&at);
            return Ok(Some(at + 1));
        }
        if line.starts_with("CALL PGM") {
            self.machine.elsewhere(line, true);
            self.machine.lost();
            return Ok(Some(at + 1));
        }
        let number = line.strip_prefix("FN ").and_then(|rest| rest.split(':').next()).unwrap_or_default();
        if !matches!(number.trim(), "9" | "10" | "11" | "12") {
            return Ok(None);
        }
        let (_, rest) = line.split_once("IF").ok_or(line)?;
        let (condition, label) = rest.split_once("GOTO LBL").ok_or(line)?;
        let word =
            ["EQU", "NE", "GT", "LT"].into_iter().find(|word| condition.contains(&format!(" {word} ")));
        let word = word.ok_or(line)?;
        let (left, right) = condition.split_once(word).ok_or(line)?;
        let (left, right) = (self.value(left)?, self.value(right)?);
        let holds = match word {
            "EQU" => left == right,
            "NE" => left != right,
            "GT" => left > right,
            _ => left < right,
        };
        if holds { self.label(label.trim()).map(Some) } else { Ok(Some(at + 1)) }
    }
}
