//! Detection of the control that a file is written for.
//!
//! The dialects differ in the meaning of brackets, of numbers without a decimal point, of X Y Z under G43, and of orientation words.
//! Detection looks for distinctive words in the first 64 KiB outside comments; a file without them is plain ISO 6983.

/// A family of controls.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub enum Dialect {
    /// ISO 6983 without distinctive words: parentheses are comments, numbers are mm with or without a decimal point.
    Iso,
    /// Fanuc and similar (Haas, Mitsubishi): as ISO, but a number without a decimal point may count increments.
    Fanuc,
    /// LinuxCNC.
    LinuxCnc,
    /// Siemens 840D: names, parentheses for arguments, `A3=`, frames.
    Siemens,
    /// Heidenhain conversational.
    Heidenhain,
}

/// The bytes of a file in which its control is looked for.
pub(super) const SAMPLE: usize = 1 << 16;

impl Dialect {
    /// Its name.
    pub fn text(self) -> &'static str {
        match self {
            Dialect::Iso => "ISO",
            Dialect::Fanuc => "Fanuc",
            Dialect::LinuxCnc => "LinuxCNC",
            Dialect::Siemens => "Siemens",
            Dialect::Heidenhain => "Heidenhain",
        }
    }

    /// The words that state a control, in comments and cell files.
    pub const WORDS: [(&str, Dialect); 5] = [
        ("fanuc", Dialect::Fanuc),
        ("siemens", Dialect::Siemens),
        ("linuxcnc", Dialect::LinuxCnc),
        ("heidenhain", Dialect::Heidenhain),
        ("iso", Dialect::Iso),
    ];

    /// The control that a word states.
    pub fn stated(word: &str) -> Option<Dialect> {
        Self::WORDS.iter().find(|(known, _)| word.eq_ignore_ascii_case(known)).map(|(_, dialect)| *dialect)
    }

    /// Whether `( … )` is a comment.
    pub fn paren_comments(self) -> bool {
        matches!(self, Dialect::Iso | Dialect::Fanuc | Dialect::LinuxCnc)
    }

    /// The dialect by the distinctive words of a file, else by the extension of its name.
    pub fn of_named(name: &str, source: &[u8]) -> Dialect {
        let ending = name.rsplit_once('.').map(|(_, ending)| ending.to_ascii_lowercase()).unwrap_or_default();
        let named = match &*ending {
            "ngc" => Dialect::LinuxCnc,
            "mpf" | "spf" => Dialect::Siemens,
            "h" => Dialect::Heidenhain,
            _ => return Dialect::of(source),
        };
        match Dialect::of(source) {
            Dialect::Iso => named,
            // LinuxCNC also has numbered parameters, M98 and program numbers.
            Dialect::Fanuc if named == Dialect::LinuxCnc && !only_fanuc(source) => named,
            detected => detected,
        }
    }

    /// The dialect by the distinctive words of a file.
    pub fn of(source: &[u8]) -> Dialect {
        let sample = &source[..source.len().min(SAMPLE)];
        let mut fanuc = false;
        for line in lines(sample) {
            let line = line.trim_ascii();
            if is_okuma(line) {
                return Dialect::Iso;
            }
            if line.starts_with(b"%_N_") || line.starts_with(b";$PATH") {
                return Dialect::Siemens;
            }
            let line = &line[..line.iter().position(|&byte| byte == b';').unwrap_or(line.len())];
            let upper = line.to_ascii_uppercase();
            if heidenhain(&upper) {
                return Dialect::Heidenhain;
            }
            let code = without_comments(&upper);
            if siemens(&code) {
                return Dialect::Siemens;
            }
            if linux_cnc(&code) {
                return Dialect::LinuxCnc;
            }
            fanuc |= fanuc_sign(&code);
        }
        if fanuc { Dialect::Fanuc } else { Dialect::Iso }
    }
}

/// The lines of a text; old tapes end them with CR alone.
pub(super) fn lines(sample: &[u8]) -> impl Iterator<Item = &[u8]> {
    let end = if sample.contains(&b'\n') { b'\n' } else { b'\r' };
    sample.split(move |&byte| byte == end)
}

/// Whether a text has words that only a Fanuc has.
fn only_fanuc(source: &[u8]) -> bool {
    const SIGNS: [&str; 6] = ["G43.4", "G43.5", "WHILE[", "G68.2", "G08P1", "G05P10000"];
    let sample = &source[..source.len().min(SAMPLE)];
    lines(sample).any(|line| {
        let line = &line[..line.iter().position(|&byte| byte == b';').unwrap_or(line.len())];
        let code = without_comments(&line.to_ascii_uppercase());
        SIGNS.iter().any(|sign| contains(&code, sign))
    })
}

fn contains(line: &[u8], sign: &str) -> bool {
    line.windows(sign.len()).any(|part| part == sign.as_bytes())
}

/// `0 BEGIN PGM NAME MM`.
fn heidenhain(line: &[u8]) -> bool {
    let rest = line.trim_ascii_start();
    let rest = rest[rest.iter().take_while(|byte| byte.is_ascii_digit()).count()..].trim_ascii_start();
    rest.starts_with(b"BEGIN PGM")
}

/// A line without parentheses that follow white space, a digit or the line start (arguments follow a name).
fn without_comments(line: &[u8]) -> Vec<u8> {
    let mut out = Vec::with_capacity(line.len());
    let mut inside = false;
    for &byte in line {
        match byte {
            b'(' if !inside && !last_is_name(&out) => inside = true,
            b')' if inside => inside = false,
            _ if inside => {}
            _ => out.push(byte),
        }
    }
    out
}

/// Whether a parenthesis here would open arguments: a name of two letters or more precedes it.
fn last_is_name(before: &[u8]) -> bool {
    let name: Vec<u8> = before
        .iter()
        .rev()
        .copied()
        .take_while(|byte| byte.is_ascii_alphanumeric() || matches!(byte, b'_' | b'$'))
        .collect();
    name.iter().filter(|byte| byte.is_ascii_alphabetic()).count() >= 2
}

/// `$NAME.MIN%`, the header of an Okuma file.
pub(super) fn is_okuma(line: &[u8]) -> bool {
    line.starts_with(b"$") && line.trim_ascii_end().ends_with(b"%")
}

fn siemens(code: &[u8]) -> bool {
    const SIGNS: [&str; 24] = [
        "TRAORI", "TRAFOOF", "CYCLE8", "CYCLE9", "MCALL", "MSG(", "$P_", "$TC_", "$MA_", "$AA_", "=AC(",
        "=IC(", "=DC(", "CTRANS(", "ORIWKS", "ORIMKS", "ORIAXES", "ORIVECT", "COMPCAD", "COMPCURV",
        "EXTERN ", "DEF REAL", "DEF INT", "SUPA",
    ];
    if SIGNS.iter().any(|sign| contains(code, sign)) {
        return true;
    }
    // A3= B3= C3=, X1=, R12=: an address with a number and an equals sign, unique to Siemens.
    code.windows(2).enumerate().any(|(at, pair)| {
        pair[0].is_ascii_digit()
            && pair[1] == b'='
            && code.get(at + 2) != Some(&b'=')
            && !code.contains(&b'#')
            && code[..=at]
                .iter()
                .rev()
                .find(|byte| !byte.is_ascii_digit())
                .is_some_and(|&byte| byte.is_ascii_alphabetic() && byte != b'Q')
    })
}

fn linux_cnc(code: &[u8]) -> bool {
    let code = code.trim_ascii_start();
    if contains(code, "#<") {
        return true;
    }
    // o100 sub, o<name> call.
    let word = ["SUB", "ENDSUB", "CALL", "WHILE", "ENDWHILE", "IF", "ENDIF", "REPEAT", "ENDREPEAT"];
    code.first() == Some(&b'O')
        && code
            .split(|byte| byte.is_ascii_whitespace() || *byte == b'[')
            .skip(1)
            .take(2)
            .any(|part| word.iter().any(|word| part == word.as_bytes()))
}

fn fanuc_sign(code: &[u8]) -> bool {
    // A block number or the name of the program may stand beside it.
    let code = code.trim_ascii_start();
    let numbered = code.strip_prefix(b"N").map(|rest| {
        let digits = rest.iter().take_while(|byte| byte.is_ascii_digit()).count();
        rest[digits..].trim_ascii_start()
    });
    let code = numbered.unwrap_or(code);
    let program_number = matches!(code.first(), Some(b'O' | b':'))
        && code.len() > 1
        && code[1..].iter().take_while(|byte| byte.is_ascii_digit()).count() >= 1
        && code[1..].iter().all(|byte| byte.is_ascii_digit() || byte.is_ascii_whitespace());
    program_number
        || [
            "G43.4",
            "G43.5",
            "G5.1",
            "G05.1",
            "G54.1",
            "G65",
            "M98",
            "M198",
            "GOTO",
            "WHILE[",
            "G68.2",
            "G08P1",
            "G05P10000",
            "G154",
            "G187",
        ]
        .iter()
        .any(|sign| contains(code, sign))
        || code.first() == Some(&b'#')
}
