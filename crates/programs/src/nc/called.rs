//! The programs that a text calls by name: what holds at their start is the caller's, whatever they look like (every program of Heidenhain
//! begins alike).

/// The names of called programs, in capitals, without folder and extension: `CALL PGM NAME`, `CYCL DEF 12.1 PGM NAME`, `SEL PGM "NAME"`
/// (Heidenhain), `CALL "NAME"`, `PCALL`, `EXTCALL` (Siemens).
pub fn called_programs(source: &[u8]) -> Vec<String> {
    let mut out = Vec::new();
    for line in source.split(|byte| *byte == b'\n') {
        if !line
            .windows(4)
            .any(|part| part.eq_ignore_ascii_case(b"CALL") || part.eq_ignore_ascii_case(b"PGM "))
        {
            continue;
        }
        let text = String::from_utf8_lossy(line).to_uppercase();
        let text = text.split(';').next().unwrap_or_default();
        let is_number = |word: &&str| word.trim_start_matches('N').chars().all(|c| c.is_ascii_digit());
        let mut words = text.split_whitespace().skip_while(is_number);
        let words: [&str; 4] = std::array::from_fn(|_| words.next().unwrap_or_default());
        let name = match words {
            ["CALL" | "SEL", "PGM", name, _] | ["CYCL", "DEF", "12.1", name] => {
                if name == "PGM" {
                    text.split("PGM").nth(1).map(str::trim)
                } else {
                    Some(name)
                }
            }
            [call, ..] if ["CALL", "PCALL", "EXTCALL"].iter().any(|known| call.starts_with(known)) => {
                text.split('"').nth(1)
            }
            _ => None,
        };
        let quoted = text.split('"').nth(1);
        if let Some(name) = name {
            out.push(String::from_utf8_lossy(&program_of(quoted.unwrap_or(name))).into_owned());
        }
    }
    out.sort_unstable();
    out.dedup();
    out
}

/// The name by which other programs call a file: without folder, extension and the archive's additions (`_N_NAME_SPF`).
pub(super) fn program_of(file: &str) -> Vec<u8> {
    let name = file.rsplit(['/', '\\']).next().unwrap_or(file).to_ascii_uppercase();
    let name = name.split('.').next().unwrap_or_default();
    let name = name.strip_prefix("_N_").unwrap_or(name);
    let name = name.strip_suffix("_SPF").or_else(|| name.strip_suffix("_MPF")).unwrap_or(name);
    name.as_bytes().to_vec()
}
