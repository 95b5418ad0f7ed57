//! A program in whichever language it is written.

use crate::edit::EditError;
use crate::motion::Listing;
use crate::nc::setup::Setup;
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

/// Endings of file names that are certainly RAPID.
const RAPID: [&str; 7] = ["mod", "modx", "prg", "sys", "sysx", "modb", "pgf"];

/// Endings of file names that are certainly NC.
const NC: [&str; 22] = [
    "nc", "mpf", "spf", "ngc", "ptp", "h", "tap", "cnc", "gcode", "eia", "din", "iso", "min", "mcd", "nci",
    "ncc", "ncp", "pim", "apt", "hnc", "i", "g",
];

impl Language {
    /// The language of a file by the ending of its name, else by what it says.
    ///
    /// ```
    /// use truegrind_programs::reading::Language;
    ///
    /// // By the ending, else by what the file says.
    /// assert_eq!(Language::of("blade.MOD", b""), Language::Rapid);
    /// assert_eq!(Language::of("blade.mpf", b""), Language::Nc);
    /// assert_eq!(Language::of("blade.txt", b"MODULE M\nENDMODULE\n"), Language::Rapid);
    /// assert_eq!(Language::of("blade.txt", b"G90 G1 X10 F500\n"), Language::Nc);
    /// ```
    pub fn of(name: &str, bytes: &[u8]) -> Language {
        let ending = name.rsplit_once('.').map(|(_, ending)| ending.to_ascii_lowercase()).unwrap_or_default();
        if RAPID.contains(&ending.as_str()) {
            return Language::Rapid;
        }
        if NC.contains(&ending.as_str()) {
            return Language::Nc;
        }
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

    /// Whether a file of this name is a program at all, by the ending.
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

/// The files of one task, read.
#[derive(Debug)]
pub enum Program<'s> {
    /// RAPID modules.
    Rapid(rapid::Task<'s>),
    /// NC files.
    Nc(nc::Task<'s>),
}

impl<'s> Program<'s> {
    /// Reads files of one language, given by name and bytes. The first one says which. Never fails: what cannot be read
    /// is listed.
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

    /// Lets go of what only reading and walking through the statements ask for; listing and rewrites stay as they are.
    pub fn forget_trees(&mut self) {
        if let Program::Rapid(task) = self {
            task.forget_trees();
        }
    }

    /// What it tells the robot to do.
    pub fn listing(&self) -> &Listing {
        match self {
            Program::Rapid(task) => &task.listing,
            Program::Nc(task) => &task.listing,
        }
    }

    /// Whether it is known before they are written that none of the changes will be refused.
    pub fn takes(&self, changes: &[Change]) -> bool {
        match self {
            Program::Rapid(task) => task.takes(changes),
            // Of an NC block that shows only in the text that comes of it.
            Program::Nc(_) => false,
        }
    }

    /// The edits that make changes.
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
