//! Programs in either language, detected by file name or content.

use crate::edit::EditError;
use crate::motion::Listing;
use crate::motion::load::Loads;
use crate::nc::setup::Setup;
use crate::remainder::TextDifference;
use crate::rewrite::{Change, RewriteOptions, Rewritten};
use crate::{nc, rapid};

/// A program language.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum Language {
    /// ABB's RAPID.
    Rapid,
    /// G-code and Heidenhain conversational.
    Nc,
}

/// Extensions of file names that are certainly RAPID.
const RAPID: [&str; 7] = ["mod", "modx", "prg", "sys", "sysx", "modb", "pgf"];

/// Extensions of file names that are certainly NC.
const NC: [&str; 22] = [
    "nc", "mpf", "spf", "ngc", "ptp", "h", "tap", "cnc", "gcode", "eia", "din", "iso", "min", "mcd", "nci",
    "ncc", "ncp", "pim", "apt", "hnc", "i", "g",
];

impl Language {
    /// The language of a file by the extension of its name, else by its content.
    ///
    /// ```
    /// use truegrind_programs::reading::Language;
    ///
    /// // By the extension, else by the content.
    /// assert_eq!(Language::of("blade.MOD", b""), Language::Rapid);
    /// assert_eq!(Language::of("blade.mpf", b""), Language::Nc);
    /// assert_eq!(Language::of("blade.txt", b"MODULE M\nENDMODULE\n"), Language::Rapid);
    /// assert_eq!(Language::of("blade.txt", b"G90 G1 X10 F500\n"), Language::Nc);
    /// ```
    pub fn of(name: &str, bytes: &[u8]) -> Language {
        Self::by_name(name).unwrap_or_else(|| Self::by_content(bytes))
    }

    fn by_content(bytes: &[u8]) -> Language {
        // RAPID ends its statements with `;` and calls its motions by name.
        let sample = &bytes[..bytes.len().min(1 << 16)];
        let upper = sample.to_ascii_uppercase();
        let says = |sign: &str| upper.windows(sign.len()).any(|part| part == sign.as_bytes());
        if ["ENDMODULE", "ENDPROC", "MODULE ", "MOVEL ", "MOVEJ ", "MOVEABSJ ", "ROBTARGET"]
            .into_iter()
            .any(says)
        {
            Language::Rapid
        } else {
            Language::Nc
        }
    }

    /// The language by the extension of a file name; `None` if it is not of a program.
    pub fn by_name(name: &str) -> Option<Language> {
        let ending = name.rsplit_once('.')?.1.to_ascii_lowercase();
        if RAPID.contains(&ending.as_str()) {
            Some(Language::Rapid)
        } else if NC.contains(&ending.as_str()) {
            Some(Language::Nc)
        } else {
            None
        }
    }
}

/// The files of one task, parsed and interpreted.
#[derive(Debug)]
pub enum Program<'s> {
    /// RAPID modules.
    Rapid(rapid::Task<'s>),
    /// NC files.
    Nc(nc::Task<'s>),
}

impl<'s> Program<'s> {
    /// Reads files of one language, given by name and bytes; the first file determines the language. Never fails:
    /// unreadable regions are listed.
    ///
    /// ```
    /// use truegrind_programs::motion::MotionKind;
    /// use truegrind_programs::nc::setup::Setup;
    /// use truegrind_programs::reading::{Language, Program};
    ///
    /// let source = b"G90 G21\nG0 X0 Y0 Z50\nG1 Z10 F600\nX40\nM30\n";
    /// let program = Program::read(&[("face.nc", &source[..])], &Setup::default());
    /// assert_eq!(program.language(), Language::Nc);
    /// let motions = &program.listing().motions;
    /// assert_eq!(motions.iter().map(|motion| motion.place.line).collect::<Vec<_>>(), [2, 3, 4]);
    /// assert_eq!((motions[0].kind, motions[2].kind), (MotionKind::Joint, MotionKind::Linear));
    /// ```
    pub fn read(files: &[(&str, &'s [u8])], setup: &Setup) -> Program<'s> {
        match files.first().map(|(name, bytes)| Language::of(name, bytes)) {
            Some(Language::Nc) => Program::Nc(nc::Task::read(files, setup)),
            _ => Program::Rapid(rapid::Task::read(files)),
        }
    }

    /// Its language.
    pub fn language(&self) -> Language {
        match self {
            Program::Rapid(_) => Language::Rapid,
            Program::Nc(_) => Language::Nc,
        }
    }

    /// Frees the syntax trees, which listing and rewriting do not need.
    pub fn drop_trees(&mut self) {
        if let Program::Rapid(task) = self {
            task.drop_trees();
        }
    }

    /// Its motions.
    pub fn listing(&self) -> &Listing {
        match self {
            Program::Rapid(task) => &task.listing,
            Program::Nc(task) => &task.listing,
        }
    }

    /// What a corrected version has differently from this original besides what corrections write, in words: no correction changes
    /// conditions, data, signals or settings.
    pub fn text_differences(&self, corrected: &Program<'_>) -> Vec<String> {
        let (found, besides) = match (self, corrected) {
            (Program::Rapid(original), Program::Rapid(corrected)) => {
                (corrected.text_differences(original), "outside any motion")
            }
            (Program::Nc(original), Program::Nc(corrected)) => {
                (corrected.text_differences(original), "besides the words of positions")
            }
            _ => return Vec::new(),
        };
        let names = &corrected.listing().files;
        let shown = |text: &str| if text.is_empty() { "nothing".to_owned() } else { format!("`{text}`") };
        let words = |found: TextDifference| {
            let TextDifference { file, line, here, original, in_motion } = found;
            let name = names.get(file).filter(|_| names.len() > 1);
            let place = name.map_or_else(|| format!("line {line}"), |name| format!("{name} line {line}"));
            let [here, original] = [shown(&here), shown(&original)];
            let what = if in_motion { "in more than its target" } else { besides };
            format!("{place}: {here} here, {original} in the original, {what}")
        };
        found.unwrap_or_default().into_iter().map(words).collect()
    }

    /// The loads that it states in addition to those of its tools. NC programs state none.
    pub fn loads(&self) -> Loads {
        match self {
            Program::Rapid(task) => task.loads(),
            Program::Nc(_) => Loads::default(),
        }
    }

    /// Whether it is known in advance that none of the changes will be refused.
    pub fn accepts(&self, changes: &[Change]) -> bool {
        match self {
            Program::Rapid(task) => task.accepts(changes),
            // For NC this depends on the written text.
            Program::Nc(_) => false,
        }
    }

    /// The edits that make the changes.
    ///
    /// # Errors
    /// [`EditError`] where two changes touch the same bytes.
    pub fn rewrite(&self, changes: &[Change], options: &RewriteOptions) -> Result<Rewritten, EditError> {
        match self {
            Program::Rapid(task) => task.rewrite(changes, options),
            Program::Nc(task) => task.rewrite(changes, options),
        }
    }
}
