//! Numbers: their value, their decimals, and writing them.

use truegrind_math::option_f64::OptionF64;
use truegrind_math::rounding::round;

/// Powers of ten that are exact in double precision.
const TEN: [f64; 23] = [
    1e0, 1e1, 1e2, 1e3, 1e4, 1e5, 1e6, 1e7, 1e8, 1e9, 1e10, 1e11, 1e12, 1e13, 1e14, 1e15, 1e16, 1e17, 1e18,
    1e19, 1e20, 1e21, 1e22,
];

/// More decimals than this are never written.
pub const MAX_DECIMALS: u8 = 12;

/// The value of a number token, correctly rounded; `None` where the bytes are no number.
///
/// Up to 15 digits and small exponents are exact in one multiplication or division (Clinger 1990, the fast path);
/// everything else goes to the standard library.
pub fn value(text: &[u8]) -> Option<f64> {
    // "Not connected", a third of all numbers in targets.
    if matches!(text, b"9E+09" | b"9E9" | b"9E+9" | b"9e9") {
        return Some(9e9);
    }
    if text.first() == Some(&b'0') && text.get(1).is_some_and(u8::is_ascii_alphabetic) && text[1] | 32 != b'e'
    {
        let radix = match text[1] | 32 {
            b'x' => 16,
            b'b' => 2,
            b'o' => 8,
            b'd' => 10,
            _ => return None,
        };
        let digits = std::str::from_utf8(&text[2..]).ok()?;
        return u64::from_str_radix(digits, radix).ok().map(|value| value as f64);
    }
    let (mut mantissa, mut digits, mut exponent, mut fraction) = (0_u64, 0, 0_i32, false);
    let mut index = 0;
    while let Some(&byte) = text.get(index) {
        match byte {
            b'0'..=b'9' => {
                mantissa = mantissa.wrapping_mul(10).wrapping_add(u64::from(byte - b'0'));
                digits += i32::from(mantissa != 0);
                exponent -= i32::from(fraction);
            }
            b'.' if !fraction => fraction = true,
            b'e' | b'E' => {
                exponent = exponent.saturating_add(written_exponent(&text[index + 1..])?);
                break;
            }
            _ => return None,
        }
        index += 1;
    }
    if index == 0 {
        return None;
    }
    if digits <= 15 && exponent.unsigned_abs() <= 22 {
        let mantissa = mantissa as f64;
        let power = TEN[exponent.unsigned_abs() as usize];
        return Some(if exponent < 0 { mantissa / power } else { mantissa * power });
    }
    std::str::from_utf8(text).ok()?.parse().ok()
}

/// The value, the length and the decimals of a number at the beginning of a text, in one pass, where it is a plain one: digits
/// with or without a point, or "not connected". `None` says nothing.
#[inline]
pub fn plain(text: &[u8]) -> Option<(f64, usize, u8)> {
    let (mut mantissa, mut index, mut point) = (0_u64, 0, None);
    while let Some(&byte) = text.get(index) {
        match byte {
            b'0'..=b'9' => mantissa = mantissa.wrapping_mul(10).wrapping_add(u64::from(byte - b'0')),
            b'.' if point.is_none() => point = Some(index + 1),
            b'E' if mantissa == 9 && index == 1 && text.get(2..5) == Some(b"+09") => {
                return (!text.get(5).is_some_and(u8::is_ascii_digit)).then_some((9e9, 5, 0));
            }
            // An exponent or a radix, or letters that do not belong here.
            byte if byte.is_ascii_alphabetic() => return None,
            _ => break,
        }
        index += 1;
    }
    let digits = index - usize::from(point.is_some());
    if digits == 0 || digits > 15 {
        return None;
    }
    // Exact in one division (Clinger 1990, the fast path).
    let decimals = point.map_or(0, |point| index - point);
    Some((mantissa as f64 / TEN[decimals], index, (decimals as u8).min(MAX_DECIMALS)))
}

/// A signed whole number; far beyond the range of a double it stays there.
#[inline]
fn written_exponent(text: &[u8]) -> Option<i32> {
    let (digits, sign) = match text {
        [b'-', digits @ ..] => (digits, -1),
        [b'+', digits @ ..] => (digits, 1),
        digits => (digits, 1),
    };
    let mut value = 0_i32;
    for &digit in digits {
        if !digit.is_ascii_digit() {
            return None;
        }
        value = (value * 10 + i32::from(digit - b'0')).min(100_000);
    }
    (!digits.is_empty()).then_some(sign * value)
}

/// Number of decimals of a number token: those after the point less the exponent.
pub fn decimals(text: &[u8]) -> u8 {
    let split = text.iter().position(|byte| matches!(byte, b'e' | b'E')).unwrap_or(text.len());
    let (digits, exponent) = text.split_at(split);
    let after =
        digits.iter().position(|&byte| byte == b'.').map_or(0, |point| digits.len() - point - 1) as i32;
    let exponent: i32 = match exponent {
        [] => 0,
        [_, rest @ ..] => written_exponent(rest).unwrap_or(0),
    };
    after.saturating_sub(exponent).clamp(0, i32::from(MAX_DECIMALS)) as u8
}

/// The value rounded to so many decimals, as a whole number of units of the last one.
pub fn units(value: f64, decimals: u8) -> f64 {
    round(value * TEN[usize::from(decimals.min(MAX_DECIMALS))])
}

/// Half a unit of the last of so many decimals.
pub fn half_unit(decimals: u8) -> f64 {
    0.5 / TEN[usize::from(decimals.min(MAX_DECIMALS))]
}

/// Rounds to so many decimals.
pub fn rounded(value: f64, decimals: u8) -> f64 {
    units(value, decimals) / TEN[usize::from(decimals.min(MAX_DECIMALS))]
}

/// Writes a value with exactly so many decimals, never `-0`.
pub fn write(out: &mut Vec<u8>, value: f64, decimals: u8) {
    let decimals = decimals.min(MAX_DECIMALS);
    let units = units(value, decimals);
    if units.abs() >= 9e15 || units.is_nan() {
        // Beyond exact integers; no position of a robot comes here.
        out.extend_from_slice(format!("{value:.*}", usize::from(decimals)).as_bytes());
        return;
    }
    // From the last digit, two at a time.
    let mut digits = [b'0'; 20];
    let mut at = digits.len();
    let mut rest = units.abs() as u64;
    while rest > 0 {
        at -= 2;
        digits[at..at + 2].copy_from_slice(&PAIRS[(rest % 100) as usize]);
        rest /= 100;
    }
    let point = digits.len() - usize::from(decimals);
    at += usize::from(digits.get(at) == Some(&b'0'));
    if units < 0.0 {
        out.push(b'-');
    }
    out.extend_from_slice(&digits[at.min(point - 1)..point]);
    if decimals > 0 {
        out.push(b'.');
        out.extend_from_slice(&digits[point..]);
    }
}

/// 00 to 99.
const PAIRS: [[u8; 2]; 100] = {
    let mut pairs = [[b'0'; 2]; 100];
    let mut k = 0;
    while k < 100 {
        pairs[k] = [b'0' + (k / 10) as u8, b'0' + (k % 10) as u8];
        k += 1;
    }
    pairs
};

/// Writes a value with at most so many decimals and no trailing zeros.
pub fn write_short(out: &mut Vec<u8>, value: f64, decimals: u8) {
    let start = out.len();
    write(out, value, decimals);
    if out[start..].contains(&b'.') {
        while out.last() == Some(&b'0') {
            out.pop();
        }
        if out.last() == Some(&b'.') {
            out.pop();
        }
    }
    if &out[start..] == b"-0" {
        out.remove(start);
    }
}

/// Writes an external axis: the number, or 9E+09 where none is connected.
pub fn write_external(out: &mut Vec<u8>, value: OptionF64) {
    match value.get() {
        Some(value) => write_short(out, value, 6),
        None => out.extend_from_slice(b"9E+09"),
    }
}
