//! Where the text of two versions of a program differs besides what a correction writes.

/// The first place at which two versions of a file differ in more than what a correction writes.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct TextDifference {
    /// Its file, by index.
    pub file: usize,
    /// Its line in the changed version, from 1.
    pub line: u32,
    /// The text of that line; empty at the end of the file.
    pub here: String,
    /// The text of the line of the original.
    pub original: String,
    /// Whether that is in a motion, besides its target.
    pub in_motion: bool,
}

/// Most characters of a line that a difference shows.
const SHOWN: usize = 60;

/// A version of a file, with the words that no correction changes: without regard to case, and where each begins.
pub(crate) struct Version<'s> {
    pub(crate) source: &'s [u8],
    pub(crate) words: Vec<(Vec<u8>, usize)>,
}

impl TextDifference {
    /// The difference that begins at these bytes of the changed version and of the original; `None` at the end of a file.
    pub(crate) fn at(file: usize, sources: [&[u8]; 2], [here, there]: [Option<usize>; 2]) -> Self {
        let before = &sources[0][..here.unwrap_or(sources[0].len())];
        Self {
            file,
            line: before.iter().filter(|byte| **byte == b'\n').count() as u32 + 1,
            here: line_around(sources[0], here),
            original: line_around(sources[1], there),
            in_motion: false,
        }
    }
}

/// The line in which a byte stands.
fn line_around(source: &[u8], at: Option<usize>) -> String {
    let at = at.unwrap_or(source.len());
    let begin = source[..at].iter().rposition(|byte| *byte == b'\n').map_or(0, |end| end + 1);
    let end = source[at..].iter().position(|byte| *byte == b'\n').map_or(source.len(), |end| at + end);
    String::from_utf8_lossy(source[begin..end].trim_ascii()).chars().take(SHOWN).collect()
}

/// The first difference between the changed version of a file and its original.
pub(crate) fn first_difference(file: usize, [changed, original]: [Version<'_>; 2]) -> Option<TextDifference> {
    let differs = |at: &usize| {
        let [here, there] = [&changed, &original].map(|version| version.words.get(*at).map(|(text, _)| text));
        here != there
    };
    let at = (0..changed.words.len().max(original.words.len())).find(differs)?;
    let start = |version: &Version<'_>| version.words.get(at).map(|(_, start)| *start);
    let sources = [changed.source, original.source];
    Some(TextDifference::at(file, sources, [start(&changed), start(&original)]))
}
