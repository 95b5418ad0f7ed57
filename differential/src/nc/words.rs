//! Blocks of letters and values, as Fanuc and LinuxCNC write them.

use super::Control;

/// A block without its comments, in upper case.
pub fn bare(line: &str) -> String {
    let mut out = String::new();
    let mut inside = false;
    for letter in line.chars() {
        match letter {
            '(' => inside = true,
            ')' if inside => inside = false,
            ';' if !inside => break,
            _ if inside => {}
            _ => out.extend(letter.to_uppercase()),
        }
    }
    out.trim().to_owned()
}

/// The words of a block: a letter and the text of its value. `None` where it cannot be read.
pub fn words(_control: Control, block: &str) -> Option<Vec<(char, String)>> {
    let bytes: Vec<u8> = block.bytes().filter(|byte| !byte.is_ascii_whitespace()).collect();
    let mut out = Vec::new();
    let mut at = 0;
    while at < bytes.len() {
        let letter = bytes[at] as char;
        if letter == '%' {
            at += 1;
            continue;
        }
        if !letter.is_ascii_alphabetic() {
            return None;
        }
        let end = value_end(&bytes, at + 1)?;
        out.push((letter, String::from_utf8(bytes[at + 1..end].to_vec()).ok()?));
        at = end;
    }
    Some(out)
}

/// Where a value ends: signs, then a number, a variable, brackets or a function of brackets.
pub fn value_end(bytes: &[u8], mut at: usize) -> Option<usize> {
    while bytes.get(at).is_some_and(|byte| matches!(byte, b'+' | b'-')) {
        at += 1;
    }
    match bytes.get(at)? {
        b'[' => bracket_end(bytes, at),
        b'#' if bytes.get(at + 1) == Some(&b'<') => {
            Some(at + bytes[at..].iter().position(|byte| *byte == b'>')? + 1)
        }
        b'#' => value_end(bytes, at + 1),
        byte if byte.is_ascii_digit() || *byte == b'.' => {
            Some(at + bytes[at..].iter().take_while(|byte| byte.is_ascii_digit() || **byte == b'.').count())
        }
        byte if byte.is_ascii_alphabetic() => {
            let name = bytes[at..].iter().take_while(|byte| byte.is_ascii_alphabetic()).count();
            let mut end = bracket_end(bytes, at + name)?;
            if &bytes[at..at + name] == b"ATAN" && bytes.get(end) == Some(&b'/') {
                end = bracket_end(bytes, end + 1)?;
            }
            (name > 1).then_some(end)
        }
        _ => None,
    }
}

fn bracket_end(bytes: &[u8], open: usize) -> Option<usize> {
    let mut depth = 0;
    if bytes.get(open) != Some(&b'[') {
        return None;
    }
    for (at, byte) in bytes.iter().enumerate().skip(open) {
        match byte {
            b'[' => depth += 1,
            b']' => depth -= 1,
            _ => {}
        }
        if depth == 0 {
            return Some(at + 1);
        }
    }
    None
}
