//! Parses time stamps such as `10:15:30.25`, with or without a date.

/// A time stamp.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Stamp {
    /// The day, counted from 1970-01-01, where a date is given.
    pub(super) day: Option<i64>,
    /// Seconds since midnight.
    pub(super) seconds: f64,
}

/// The accepted formats, for messages.
pub(super) const FORMS: &str =
    "a time such as 10:15:30.25, with a date (2026-11-23, 11/23/2026 month first, 23.11.2026) or without";

impl Stamp {
    /// The only time in a text of several words; `None` for no time, more than one, or an invalid date.
    pub(super) fn of(text: &str) -> Option<Self> {
        // ISO 8601 joins date and time by a letter.
        let joined = |word: &str| word.contains('-') && word.contains(':');
        let words = text.split_whitespace().flat_map(|word| {
            let cut = if joined(word) { word.split_once(['T', 't', '_']) } else { None };
            cut.map_or([word, ""], |(date, time)| [date, time])
        });
        let words: Vec<&str> =
            words.map(|word| word.trim_matches('"')).filter(|word| !word.is_empty()).collect();
        let mut times = words.iter().enumerate();
        let mut times =
            std::iter::from_fn(|| times.find_map(|(at, word)| seconds(word, words.get(at + 1).copied())));
        let (seconds, None) = (times.next()?, times.next()) else { return None };
        let mut dates = words.iter().filter(|word| is_date(word));
        let (date, None) = (dates.next(), dates.next()) else { return None };
        let day = match date {
            Some(date) => Some(day(date)?),
            None => None,
        };
        Some(Self { day, seconds })
    }
}

/// Seconds since midnight; `next` is the following word, possibly am or pm.
fn seconds(word: &str, next: Option<&str>) -> Option<f64> {
    let lower = word.to_ascii_lowercase();
    let lower = lower.strip_suffix('z').unwrap_or(&lower);
    let half = |word: &str| match word.to_ascii_lowercase().replace('.', "").as_str() {
        "am" => Some(0.0),
        "pm" => Some(12.0),
        _ => None,
    };
    let attached = ["am", "pm"].iter().find_map(|ending| Some((lower.strip_suffix(ending)?, half(ending))));
    let (digits, half) = attached.unwrap_or((lower, next.and_then(half)));
    let parts: Vec<f64> = digits.split(':').map(number).collect::<Option<_>>()?;
    let [hours, minutes, seconds] = parts.as_slice() else { return None };
    let hours = match half {
        Some(from) if (1.0..=12.0).contains(hours) => hours % 12.0 + from,
        Some(_) => return None,
        None => *hours,
    };
    let whole = hours.fract() == 0.0 && minutes.fract() == 0.0;
    (whole && hours < 24.0 && *minutes < 60.0 && *seconds < 60.0)
        .then_some(hours * 3600.0 + minutes * 60.0 + seconds)
}

/// An unsigned number with a decimal point or comma and nothing else.
fn number(text: &str) -> Option<f64> {
    let plain = text.bytes().all(|byte| byte.is_ascii_digit() || byte == b'.' || byte == b',');
    (plain && text.starts_with(|c: char| c.is_ascii_digit())).then(|| text.replace(',', ".").parse().ok())?
}

const SEPARATORS: [char; 3] = ['/', '-', '.'];

/// Whether a word looks like a date: three integers with the same separator.
fn is_date(word: &str) -> bool {
    SEPARATORS.iter().any(|&sign| {
        let parts: Vec<&str> = word.split(sign).collect();
        parts.len() == 3
            && parts.iter().all(|part| !part.is_empty() && part.bytes().all(|b| b.is_ascii_digit()))
    })
}

/// Days since 1970-01-01. Order: year first; else month first with `/`, day first with `.`; ambiguous with `-`.
fn day(word: &str) -> Option<i64> {
    let sign = word.chars().find(|c| SEPARATORS.contains(c))?;
    let parts: Vec<i64> = word.split(sign).map(|part| part.parse().ok()).collect::<Option<_>>()?;
    let &[first, second, third] = parts.as_slice() else { return None };
    let (year, month, day) = match sign {
        _ if first > 999 => (first, second, third),
        '/' => (third, first, second),
        '.' => (third, second, first),
        _ => return None,
    };
    let leap = year % 4 == 0 && (year % 100 != 0 || year % 400 == 0);
    let lengths = [31, if leap { 29 } else { 28 }, 31, 30, 31, 30, 31, 31, 30, 31, 30, 31];
    let length = *lengths.get(usize::try_from(month - 1).ok()?)?;
    if !(1900..=9999).contains(&year) || !(1..=length).contains(&day) {
        return None;
    }
    let before = |year: i64| (year - 1) * 365 + (year - 1) / 4 - (year - 1) / 100 + (year - 1) / 400;
    let months: i64 = lengths.iter().take(usize::try_from(month - 1).ok()?).sum();
    Some(before(year) - before(1970) + months + day - 1)
}
