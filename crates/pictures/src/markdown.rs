//! Numbers and foreign text in Markdown.

/// A value in mm, or a dash if missing. A value that rounds to zero has no sign.
pub(super) fn number(value: Option<f64>) -> String {
    let shown = value.filter(|v| v.is_finite()).map_or_else(|| "–".to_owned(), |v| format!("{v:.3}"));
    if shown == "-0.000" { "0.000".to_owned() } else { shown }
}

/// Foreign text as one escaped line of Markdown.
pub(super) fn line(text: &str) -> String {
    let mut out = String::new();
    for c in text.chars() {
        if matches!(c, '*' | '_' | '`' | '#' | '<' | '[' | '\\') {
            out.push('\\');
        }
        out.push(if c.is_control() { ' ' } else { c });
    }
    out
}

/// Foreign text in a cell of a Markdown table.
pub(super) fn cell(text: &str) -> String {
    line(text).replace('|', "\\|")
}

/// A value with its standard deviation, with two digits of that.
pub(super) fn with_sigma(value: f64, sigma: f64) -> String {
    if !(sigma > 0.0) || !sigma.is_finite() {
        return format!("{value:.4}");
    }
    let decimals = (1.0 - sigma.log10().floor()).clamp(0.0, 7.0) as usize;
    format!("{value:.decimals$} ± {sigma:.decimals$}")
}
