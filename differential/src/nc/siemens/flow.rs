//! Jumps, conditions and loops of Siemens programs.

use super::{Section, Siemens, after_number, label};

/// Whether a line begins with a word.
fn begins(line: &str, word: &str) -> bool {
    line.strip_prefix(word)
        .is_some_and(|rest| !rest.starts_with(|c: char| c.is_ascii_alphanumeric() || c == '_'))
}

impl Siemens<'_> {
    fn head(&self, at: usize) -> String {
        let line = self.lines[at].trim();
        super::after_label(after_number(line)).to_owned()
    }

    /// The line that closes or divides what opens at `at`, with one of these words at the same depth.
    fn partner(&self, at: usize, open: &str, wanted: &[&str], close: &str) -> Result<usize, String> {
        let mut depth = 0;
        for line in at + 1..self.lines.len() {
            let text = self.head(line);
            let opens = begins(&text, open) && !(open == "IF" && text.contains("GOTO")) && !counted(&text);
            if opens {
                depth += 1;
            } else if depth == 0 && wanted.iter().any(|word| begins(&text, word)) {
                return Ok(line);
            } else if begins(&text, close) {
                depth -= 1;
            }
        }
        Err(format!("no {wanted:?}"))
    }

    /// The line that opens what closes at `at`.
    fn opener(&self, at: usize, open: &str, close: &str) -> Result<usize, String> {
        let mut depth = 0;
        for line in (0..at).rev() {
            let text = self.head(line);
            if begins(&text, close) {
                depth += 1;
            } else if begins(&text, open) && !counted(&text) {
                if depth == 0 {
                    return Ok(line);
                }
                depth -= 1;
            }
        }
        Err(format!("no {open}"))
    }

    /// Runs what steers; the line to go on with.
    pub(super) fn flow(&mut self, at: usize, line: &str) -> Result<Option<usize>, String> {
        if begins(line, "IF") {
            let rest = &line[2..];
            if let Some(jump) = rest.find("GOTO") {
                let holds = self.value(&rest[..jump])? != 0.0;
                return if holds { self.jump(at, &rest[jump..]).map(Some) } else { Ok(Some(at + 1)) };
            }
            if self.value(rest)? != 0.0 {
                return Ok(Some(at + 1));
            }
            return Ok(Some(self.partner(at, "IF", &["ELSE", "ENDIF"], "ENDIF")? + 1));
        }
        if begins(line, "ELSE") {
            return Ok(Some(self.partner(at, "IF", &["ENDIF"], "ENDIF")? + 1));
        }
        if begins(line, "GOTO") || begins(line, "GOTOF") || begins(line, "GOTOB") {
            return self.jump(at, line).map(Some);
        }
        if begins(line, "WHILE") {
            let holds = self.value(&line[5..])? != 0.0;
            let end = || self.partner(at, "WHILE", &["ENDWHILE"], "ENDWHILE");
            return Ok(Some(if holds { at + 1 } else { end()? + 1 }));
        }
        if begins(line, "ENDWHILE") {
            return self.opener(at, "WHILE", "ENDWHILE").map(Some);
        }
        if begins(line, "FOR") {
            return self.for_word(at, &line[3..], true).map(Some);
        }
        if begins(line, "ENDFOR") {
            let begin = self.opener(at, "FOR", "ENDFOR")?;
            let head = self.head(begin)[3..].to_owned();
            return self.for_word(begin, &head, false).map(Some);
        }
        if begins(line, "UNTIL") {
            let done = self.value(&line[5..])? != 0.0;
            return Ok(Some(if done { at + 1 } else { self.opener(at, "REPEAT", "UNTIL")? + 1 }));
        }
        if begins(line, "REPEAT") && !counted(line) {
            return Ok(Some(at + 1));
        }
        if begins(line, "REPEAT") || begins(line, "REPEATB") {
            return self.repeat(at, line).map(Some);
        }
        if begins(line, "ENDIF") {
            return Ok(Some(at + 1));
        }
        Ok(None)
    }

    /// The block of a label or number: GOTOF forwards, GOTOB backwards, GOTO first forwards.
    fn jump(&self, at: usize, text: &str) -> Result<usize, String> {
        let (word, aim) = text.trim().split_once(char::is_whitespace).ok_or(text)?;
        let aim = aim.trim();
        let is = |line: &usize| self.is_aim(*line, aim);
        let forward = (at + 1..self.lines.len()).find(is);
        let back = (0..=at).rev().find(is);
        let found = match word {
            "GOTOF" => forward,
            "GOTOB" => back,
            _ => forward.or(back),
        };
        found.ok_or_else(|| format!("no {aim}"))
    }

    fn is_aim(&self, line: usize, aim: &str) -> bool {
        let text = self.lines[line].trim_start_matches('/').trim();
        let number = text.split_whitespace().next().unwrap_or_default();
        label(text) == Some(aim) || (aim.starts_with('N') && number == aim)
    }

    /// `FOR R1=1 TO 3`; at the begin the variable is set, at the end it goes up.
    fn for_word(&mut self, at: usize, head: &str, first: bool) -> Result<usize, String> {
        let (start, end) = head.split_once(" TO ").ok_or(head)?;
        let (name, from) = start.split_once('=').ok_or(start)?;
        let name = name.trim().to_owned();
        let value = match first {
            true => self.value(from)?,
            false => self.variables.get(&name).copied().unwrap_or(0.0) + 1.0,
        };
        let end = self.value(end)?;
        if value <= end {
            self.variables.insert(name, value);
            return Ok(at + 1);
        }
        Ok(self.partner(at, "FOR", &["ENDFOR"], "ENDFOR")? + 1)
    }

    /// `REPEAT BEGIN END P=2`, `REPEAT BEGIN P=2` (up to this line), `REPEATB LINE P=2` (one line).
    fn repeat(&mut self, at: usize, line: &str) -> Result<usize, String> {
        if self.sections.last().is_some_and(|section| section.call == at) {
            self.sections.pop();
            return Ok(at + 1);
        }
        let mut parts = line.split_whitespace();
        let one = parts.next() == Some("REPEATB");
        let rest: Vec<&str> = parts.collect();
        let times = match rest.iter().find_map(|part| part.strip_prefix("P=")) {
            Some(text) => self.value(text)?.round() as i64,
            None => 1,
        };
        let labels: Vec<&str> = rest.into_iter().filter(|part| !part.starts_with("P=")).collect();
        let find = |aim: &str| {
            let back = (0..at).rev().find(|&line| self.is_aim(line, aim));
            back.or_else(|| (at..self.lines.len()).find(|&line| self.is_aim(line, aim)))
        };
        let begin = find(labels.first().ok_or(line)?).ok_or(line)?;
        let last = match labels.get(1) {
            Some(end) => find(end).ok_or(line)?,
            None if one => begin,
            // Up to ENDLABEL, or to the call itself.
            None => (begin..at).find(|&line| label(&self.lines[line]) == Some("ENDLABEL")).unwrap_or(at - 1),
        };
        if times < 1 {
            return Ok(at + 1);
        }
        self.sections.push(Section { call: at, last, begin, left: times });
        Ok(begin)
    }

    /// Where the way goes on behind the last line of a section that is repeated.
    pub(super) fn section_end(&mut self, at: usize, next: usize) -> usize {
        let Some(section) = self.sections.last_mut() else { return next };
        if at != section.last || next != at + 1 {
            return next;
        }
        section.left -= 1;
        if section.left > 0 {
            return section.begin;
        }
        let call = section.call;
        self.sections.pop();
        call + 1
    }
}

/// Whether a REPEAT names labels, and opens no loop.
fn counted(line: &str) -> bool {
    begins(line, "REPEATB") || line.strip_prefix("REPEAT ").is_some_and(|rest| !rest.trim().is_empty())
}
