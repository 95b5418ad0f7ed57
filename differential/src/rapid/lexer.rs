//! Tokens of RAPID. Bytes are Latin-1; names count the same in either case and come out in lower case.

/// A token.
#[derive(Debug, Clone, PartialEq)]
pub enum Token {
    /// A name or a reserved word, in lower case.
    Name(String),
    /// A number without sign.
    Number(f64),
    /// A string without its quotes.
    Text(String),
    /// A sign of one or two characters.
    Sign(&'static str),
    /// The end of the file.
    End,
}

const SIGNS: [&str; 29] = [
    ":=", "<>", "<=", ">=", "<", ">", "=", "+", "-", "*", "/", "(", ")", "[", "]", "{", "}", ",", ";", ":",
    ".", "%", "\\", "?", "|", "&", "@", "#", "!",
];

fn letter(byte: u8) -> bool {
    byte.is_ascii_alphabetic() || byte >= 0xc0
}

/// Splits a file into tokens with the bytes at which they begin.
///
/// # Errors
/// Where a byte begins no token.
pub fn tokens(source: &[u8]) -> Result<Vec<(Token, usize)>, String> {
    let mut out = Vec::new();
    let mut at = 0;
    while at < source.len() {
        let begin = at;
        let byte = source[at];
        if byte.is_ascii_whitespace() || byte == 0x0b {
            at += 1;
        } else if byte == b'!' {
            while at < source.len() && source[at] != b'\n' {
                at += 1;
            }
        } else if letter(byte) {
            while at < source.len()
                && (letter(source[at]) || source[at].is_ascii_digit() || source[at] == b'_')
            {
                at += 1;
            }
            let name = source[begin..at].iter().map(|b| char::from(b.to_ascii_lowercase())).collect();
            out.push((Token::Name(name), begin));
        } else if byte.is_ascii_digit()
            || (byte == b'.' && source.get(at + 1).is_some_and(u8::is_ascii_digit))
        {
            at = number_end(source, at);
            let text = std::str::from_utf8(&source[begin..at]).map_err(|error| error.to_string())?;
            out.push((
                Token::Number(text.parse().map_err(|_| format!("byte {begin}: no number: {text}"))?),
                begin,
            ));
        } else if byte == b'"' {
            let text = string(source, &mut at)?;
            out.push((Token::Text(text), begin));
        } else {
            let sign = SIGNS.iter().find(|sign| source[at..].starts_with(sign.as_bytes()));
            let sign = sign.ok_or_else(|| format!("byte {at}: unknown sign {}", char::from(byte)))?;
            at += sign.len();
            out.push((Token::Sign(sign), begin));
        }
    }
    out.push((Token::End, source.len()));
    Ok(out)
}

fn number_end(source: &[u8], mut at: usize) -> usize {
    let digits = |mut at: usize| {
        while source.get(at).is_some_and(u8::is_ascii_digit) {
            at += 1;
        }
        at
    };
    at = digits(at);
    if source.get(at) == Some(&b'.') {
        at = digits(at + 1);
    }
    if matches!(source.get(at), Some(b'e' | b'E')) {
        let sign = usize::from(matches!(source.get(at + 1), Some(b'+' | b'-')));
        let end = digits(at + 1 + sign);
        if end > at + 1 + sign {
            at = end;
        }
    }
    at
}

/// A string: `""` is a quote, `\\` a backslash, `\hh` a byte.
fn string(source: &[u8], at: &mut usize) -> Result<String, String> {
    let begin = *at;
    let mut text = String::new();
    *at += 1;
    loop {
        match (source.get(*at), source.get(*at + 1)) {
            (Some(b'"'), Some(b'"')) => {
                text.push('"');
                *at += 2;
            }
            (Some(b'"'), _) => {
                *at += 1;
                return Ok(text);
            }
            (Some(b'\\'), Some(b'\\')) => {
                text.push('\\');
                *at += 2;
            }
            (Some(b'\n') | None, _) => return Err(format!("byte {begin}: the string does not end")),
            (Some(byte), _) => {
                text.push(char::from(*byte));
                *at += 1;
            }
        }
    }
}
