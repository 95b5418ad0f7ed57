//! O words: subprograms, conditions and loops.

use std::collections::HashMap;

use super::{Call, LinuxCnc};

/// The label and the rest of an O word.
pub(super) fn o_word(line: &str) -> Option<(String, &str)> {
    let rest = line.strip_prefix('O')?.trim_start();
    let end = if rest.starts_with('<') {
        rest.find('>')? + 1
    } else {
        rest.bytes().take_while(u8::is_ascii_digit).count()
    };
    (end > 0).then(|| (rest[..end].replace(' ', ""), rest[end..].trim()))
}

/// The first word of what follows a label.
fn verb(rest: &str) -> &str {
    let end = rest.find(|c: char| !c.is_ascii_alphabetic()).unwrap_or(rest.len());
    &rest[..end]
}

impl LinuxCnc<'_> {
    /// The next line after `at` (or the last before it) with this label and one of these words.
    fn labelled(&self, at: usize, label: &str, verbs: &[&str], forward: bool) -> Result<usize, String> {
        let is = |line: usize| {
            let text = self.lines[line].split_whitespace().collect::<Vec<_>>().join(" ");
            o_word(&text).is_some_and(|(other, rest)| other == label && verbs.contains(&verb(rest)))
        };
        let found = if forward {
            (at + 1..self.lines.len()).find(|&line| is(line))
        } else {
            (0..at).rev().find(|&line| is(line))
        };
        found.ok_or_else(|| format!("no {verbs:?} of {label}"))
    }

    /// Runs an O word; the line to go on with.
    pub(super) fn o_word(&mut self, at: usize, line: &str) -> Result<usize, String> {
        let (label, rest) = o_word(line).ok_or(line)?;
        let verb = verb(rest);
        let condition = rest[verb.len()..].trim();
        match verb {
            "SUB" => Ok(self.labelled(at, &label, &["ENDSUB"], true)? + 1),
            "CALL" => self.call(at, &label, condition),
            "ENDSUB" | "RETURN" => {
                let call = self.calls.pop().ok_or("return without a call")?;
                let global = |name: &str| {
                    name.starts_with("#<_") || name[1..].parse::<i32>().is_ok_and(|number| number > 30)
                };
                self.parameters.retain(|name, _| global(name));
                self.parameters.extend(call.own);
                Ok(call.back)
            }
            "IF" => {
                let holds = self.value(condition)? != 0.0;
                self.taken.insert(label.clone(), holds);
                if holds { Ok(at + 1) } else { self.labelled(at, &label, &["ELSEIF", "ELSE", "ENDIF"], true) }
            }
            "ELSEIF" => {
                if self.taken.get(&label) == Some(&true) {
                    return self.labelled(at, &label, &["ENDIF"], true);
                }
                let holds = self.value(condition)? != 0.0;
                self.taken.insert(label.clone(), holds);
                if holds { Ok(at + 1) } else { self.labelled(at, &label, &["ELSEIF", "ELSE", "ENDIF"], true) }
            }
            "ELSE" if self.taken.get(&label) == Some(&true) => self.labelled(at, &label, &["ENDIF"], true),
            "ELSE" | "ENDIF" | "DO" => Ok(at + 1),
            "WHILE" => self.while_word(at, &label, condition),
            "ENDWHILE" => self.labelled(at, &label, &["WHILE"], false),
            "REPEAT" => {
                let times = self.value(condition)?.round() as i64;
                if times < 1 {
                    return Ok(self.labelled(at, &label, &["ENDREPEAT"], true)? + 1);
                }
                self.repeats.insert(at, times - 1);
                Ok(at + 1)
            }
            "ENDREPEAT" => {
                let begin = self.labelled(at, &label, &["REPEAT"], false)?;
                let left = self.repeats.get_mut(&begin).ok_or("no repeat")?;
                *left -= 1;
                Ok(if *left >= 0 { begin + 1 } else { at + 1 })
            }
            "BREAK" => Ok(self.labelled(at, &label, &["ENDWHILE", "WHILE", "ENDREPEAT"], true)? + 1),
            "CONTINUE" => self.labelled(at, &label, &["ENDWHILE", "WHILE", "ENDREPEAT"], true),
            _ => Err(format!("O word {line}")),
        }
    }

    /// The head of a loop, or the end of one that begins with DO.
    fn while_word(&mut self, at: usize, label: &str, condition: &str) -> Result<usize, String> {
        let holds = self.value(condition)? != 0.0;
        let begin = self.labelled(at, label, &["DO", "ENDWHILE"], false);
        let closes = begin.is_ok_and(|line| self.lines[line].contains("DO"));
        match (closes, holds) {
            (true, true) => Ok(self.labelled(at, label, &["DO"], false)? + 1),
            (true, false) | (false, true) => Ok(at + 1),
            (false, false) => Ok(self.labelled(at, label, &["ENDWHILE"], true)? + 1),
        }
    }

    fn call(&mut self, at: usize, label: &str, arguments: &str) -> Result<usize, String> {
        let is = |line: &String| {
            let text = line.split_whitespace().collect::<Vec<_>>().join(" ");
            o_word(&text).is_some_and(|(other, rest)| other == label && verb(rest) == "SUB")
        };
        let Some(begin) = self.lines.iter().position(is) else {
            self.machine.elsewhere(format!("call {label}"), true);
            self.machine.lost();
            return Ok(at + 1);
        };
        let mut inner = HashMap::new();
        let mut rest = arguments;
        let mut number = 1;
        while let Some(open) = rest.find('[') {
            let bytes = &rest.as_bytes()[open..];
            let end = super::value_end(bytes, 0).ok_or("argument")?;
            inner.insert(format!("#{number}"), self.value(&rest[open..open + end])?);
            rest = &rest[open + end..];
            number += 1;
        }
        let local = |name: &str| {
            name.starts_with("#<") && !name.starts_with("#<_")
                || name[1..].parse::<i32>().is_ok_and(|number| number <= 30)
        };
        let own: HashMap<String, f64> =
            self.parameters.iter().filter(|(name, _)| local(name)).map(|(n, v)| (n.clone(), *v)).collect();
        self.parameters.retain(|name, _| !local(name));
        self.parameters.extend(inner);
        self.calls.push(Call { back: at + 1, own });
        Ok(begin + 1)
    }
}
