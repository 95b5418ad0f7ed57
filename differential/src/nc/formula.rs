//! Values of words: numbers, variables and formulas, each control with its own order of operations.
//!
//! Source: Fanuc 30i custom macro (functions; `* / AND MOD`; `+ - OR XOR`; comparisons), LinuxCNC "Binary operators"
//! (`**`; `* / MOD`; `+ -`; comparisons; `AND OR XOR`), Siemens 840D "Job planning" (eleven levels, comparisons last),
//! Heidenhain iTNC 530 formulas (functions bind what follows; `^`; `* / %`; `+ -`).

use super::Control;

/// Why a text has no value.
#[derive(Debug, Clone, PartialEq)]
pub struct NoValue(pub String);

/// What a variable holds; `None` where nothing was ever put into it.
pub type Look<'l> = &'l dyn Fn(&str) -> Option<f64>;

#[derive(Debug, Clone, PartialEq)]
enum Piece {
    Number(f64),
    Name(String),
    Sign(&'static str),
}

/// The value of a formula.
///
/// # Errors
/// What cannot be read, and a value that is no number.
pub fn value(control: Control, text: &str, look: Look<'_>) -> Result<f64, NoValue> {
    let pieces = pieces(control, text)?;
    let mut reader = Reader { control, pieces: &pieces, at: 0, look };
    let value = reader.level(0)?;
    if reader.at < pieces.len() {
        return Err(NoValue(format!("left over in {text}")));
    }
    if value.is_finite() { Ok(value) } else { Err(NoValue(format!("no number: {text}"))) }
}

const SIGNS: [&str; 20] =
    ["**", "==", "<>", ">=", "<=", "[", "]", "(", ")", "+", "-", "*", "/", "%", "^", ">", "<", "#", ",", "="];

fn pieces(control: Control, text: &str) -> Result<Vec<Piece>, NoValue> {
    let bytes = text.as_bytes();
    let mut out = Vec::new();
    let mut at = 0;
    while at < bytes.len() {
        let here = bytes[at];
        if here.is_ascii_whitespace() {
            at += 1;
        } else if here.is_ascii_digit() || (here == b'.' && bytes.get(at + 1).is_some_and(u8::is_ascii_digit))
        {
            let end = number_end(control, bytes, at);
            let written = text[at..end].replace(',', ".").replace("EX", "e");
            out.push(Piece::Number(written.parse().map_err(|_| NoValue(written))?));
            at = end;
        } else if here == b'#' && bytes.get(at + 1) == Some(&b'<') {
            let end = text[at..].find('>').ok_or_else(|| NoValue(text.to_owned()))? + at + 1;
            out.push(Piece::Name(text[at..end].to_owned()));
            at = end;
        } else if here.is_ascii_alphabetic() || matches!(here, b'_' | b'$') {
            let macros = matches!(control, Control::Fanuc | Control::LinuxCnc);
            let goes_on = |byte: &u8| {
                byte.is_ascii_alphabetic()
                    || (!macros && (byte.is_ascii_digit() || matches!(byte, b'_' | b'$')))
            };
            let end = at + 1 + bytes[at + 1..].iter().take_while(|byte| goes_on(byte)).count();
            out.push(Piece::Name(text[at..end].to_owned()));
            at = end;
        } else {
            let sign = SIGNS.iter().find(|sign| text[at..].starts_with(**sign));
            let sign = sign.ok_or_else(|| NoValue(text.to_owned()))?;
            out.push(Piece::Sign(sign));
            at += sign.len();
        }
    }
    Ok(out)
}

/// Where a number ends: `12`, `1.5`, `.5`, `2,5` (Heidenhain), `1.5EX-1` (Siemens).
fn number_end(control: Control, bytes: &[u8], from: usize) -> usize {
    let digits = |at: usize| at + bytes[at..].iter().take_while(|byte| byte.is_ascii_digit()).count();
    let mut end = digits(from);
    let point = |byte: u8| byte == b'.' || (byte == b',' && control == Control::Heidenhain);
    if bytes.get(end).is_some_and(|&byte| point(byte)) {
        end = digits(end + 1);
    }
    if control == Control::Siemens && bytes[end..].starts_with(b"EX") {
        let sign = usize::from(bytes.get(end + 2).is_some_and(|byte| matches!(byte, b'+' | b'-')));
        end = digits(end + 2 + sign);
    }
    end
}

/// The operations of a control, those that bind least first.
fn levels(control: Control) -> &'static [&'static [&'static str]] {
    match control {
        Control::Fanuc => {
            &[&["EQ", "NE", "GT", "GE", "LT", "LE"], &["+", "-", "OR", "XOR"], &["*", "/", "AND", "MOD"]]
        }
        Control::LinuxCnc => &[
            &["AND", "OR", "XOR"],
            &["EQ", "NE", "GT", "GE", "LT", "LE"],
            &["+", "-"],
            &["*", "/", "MOD"],
            &["**"],
        ],
        Control::Siemens => &[
            &["==", "<>", ">=", "<=", ">", "<"],
            &["OR"],
            &["XOR"],
            &["AND"],
            &["B_OR"],
            &["B_XOR"],
            &["B_AND"],
            &["+", "-"],
            &["*", "/", "DIV", "MOD"],
        ],
        Control::Heidenhain => &[&["+", "-"], &["*", "/", "%"], &["^"]],
    }
}

struct Reader<'p> {
    control: Control,
    pieces: &'p [Piece],
    at: usize,
    look: Look<'p>,
}

impl Reader<'_> {
    fn level(&mut self, level: usize) -> Result<f64, NoValue> {
        let Some(signs) = levels(self.control).get(level) else {
            return self.operand();
        };
        let mut left = self.level(level + 1)?;
        while let Some(sign) = self.one_of(signs) {
            self.at += 1;
            let right = self.level(level + 1)?;
            left = self.joined(left, sign, right)?;
        }
        Ok(left)
    }

    fn one_of(&self, signs: &[&'static str]) -> Option<&'static str> {
        let text = match self.pieces.get(self.at)? {
            Piece::Sign(sign) => *sign,
            Piece::Name(name) => name.as_str(),
            Piece::Number(_) => return None,
        };
        signs.iter().copied().find(|sign| *sign == text)
    }

    fn joined(&self, a: f64, sign: &str, b: f64) -> Result<f64, NoValue> {
        let truth = |value: bool| if value { 1.0 } else { 0.0 };
        let (p, q) = (a != 0.0, b != 0.0);
        let bits = self.control == Control::Fanuc;
        let whole = |value: f64| value.round() as i64;
        Ok(match sign {
            "+" => a + b,
            "-" => a - b,
            "*" => a * b,
            "/" | "DIV" | "MOD" | "%" if b == 0.0 => return Err(NoValue("division by zero".into())),
            "/" => a / b,
            "DIV" => (a / b).trunc(),
            "MOD" if self.control == Control::LinuxCnc => a.rem_euclid(b.abs()),
            "MOD" | "%" => a % b,
            "**" | "^" => a.powf(b),
            "AND" | "B_AND" if bits || sign == "B_AND" => (whole(a) & whole(b)) as f64,
            "OR" | "B_OR" if bits || sign == "B_OR" => (whole(a) | whole(b)) as f64,
            "XOR" | "B_XOR" if bits || sign == "B_XOR" => (whole(a) ^ whole(b)) as f64,
            "AND" => truth(p && q),
            "OR" => truth(p || q),
            "XOR" => truth(p != q),
            "EQ" | "==" => truth((a - b).abs() < 1e-9),
            "NE" | "<>" => truth((a - b).abs() >= 1e-9),
            "GT" | ">" => truth(a > b),
            "GE" | ">=" => truth(a >= b),
            "LT" | "<" => truth(a < b),
            "LE" | "<=" => truth(a <= b),
            _ => return Err(NoValue(sign.to_owned())),
        })
    }

    fn take(&mut self, sign: &str) -> bool {
        let found =
            self.pieces.get(self.at) == Some(&Piece::Sign(SIGNS.iter().find(|s| **s == sign).unwrap_or(&"")));
        self.at += usize::from(found);
        found
    }

    fn operand(&mut self) -> Result<f64, NoValue> {
        let piece = self.pieces.get(self.at).cloned().ok_or_else(|| NoValue("nothing".into()))?;
        self.at += 1;
        match piece {
            Piece::Number(number) => Ok(number),
            Piece::Sign("-") => Ok(-self.operand()?),
            Piece::Sign("+") => self.operand(),
            Piece::Sign(open @ ("[" | "(")) => {
                let inside = self.level(0)?;
                if self.take(if open == "[" { "]" } else { ")" }) {
                    Ok(inside)
                } else {
                    Err(NoValue("bracket".into()))
                }
            }
            Piece::Sign("#") => {
                let number = self.operand()?;
                Ok((self.look)(&format!("#{}", number.round() as i64)).unwrap_or(0.0))
            }
            Piece::Name(name) => self.named(&name),
            Piece::Sign(sign) => Err(NoValue(sign.to_owned())),
        }
    }

    fn named(&mut self, name: &str) -> Result<f64, NoValue> {
        let degrees = f64::to_radians;
        match name {
            "NOT" => return Ok(if self.operand()? == 0.0 { 1.0 } else { 0.0 }),
            "PI" | "$PI" => return Ok(std::f64::consts::PI),
            "ATAN" if self.control == Control::Fanuc || self.control == Control::LinuxCnc => {
                let up = self.operand()?;
                if !self.take("/") {
                    return Err(NoValue("ATAN".into()));
                }
                return Ok(up.atan2(self.operand()?).to_degrees());
            }
            "ATAN2" | "POT2" => {
                if !self.take("(") {
                    return Err(NoValue(name.to_owned()));
                }
                let first = self.level(0)?;
                let comma = self.take(",");
                let second = self.level(0)?;
                return if comma && self.take(")") {
                    Ok(first.atan2(second).to_degrees())
                } else {
                    Err(NoValue(name.to_owned()))
                };
            }
            _ => {}
        }
        let down = matches!(self.control, Control::LinuxCnc);
        let function: Option<fn(f64) -> f64> = match name {
            "SIN" => Some(|x| x.to_radians().sin()),
            "COS" => Some(|x| x.to_radians().cos()),
            "TAN" => Some(|x| x.to_radians().tan()),
            "ASIN" => Some(|x| x.asin().to_degrees()),
            "ACOS" => Some(|x| x.acos().to_degrees()),
            "ABS" => Some(f64::abs),
            "SQRT" => Some(f64::sqrt),
            "SQ" | "POT" => Some(|x| x * x),
            "ROUND" => Some(f64::round),
            "FIX" if down => Some(f64::floor),
            "FUP" if down => Some(f64::ceil),
            "FIX" | "INT" | "TRUNC" => Some(f64::trunc),
            "FUP" => Some(|x: f64| if x < 0.0 { x.floor() } else { x.ceil() }),
            "FRAC" => Some(f64::fract),
            "NEG" => Some(|x: f64| -x),
            "LN" => Some(f64::ln),
            "EXP" => Some(f64::exp),
            _ => None,
        };
        let _ = degrees;
        match function {
            Some(function) => Ok(function(self.operand()?)),
            None => (self.look)(name).ok_or_else(|| NoValue(name.to_owned())),
        }
    }
}
