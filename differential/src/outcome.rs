//! What a run of the test counts.

use std::fmt;

/// The languages.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum Dialect {
    /// ABB's RAPID.
    Rapid,
    /// Fanuc style G-code.
    Fanuc,
    /// LinuxCNC.
    LinuxCnc,
    /// Siemens 840D.
    Siemens,
    /// Heidenhain conversational.
    Heidenhain,
}

impl Dialect {
    /// All of them.
    pub const ALL: [Dialect; 5] =
        [Dialect::Rapid, Dialect::Fanuc, Dialect::LinuxCnc, Dialect::Siemens, Dialect::Heidenhain];

    /// The word that names it.
    pub fn name(self) -> &'static str {
        match self {
            Dialect::Rapid => "rapid",
            Dialect::Fanuc => "fanuc",
            Dialect::LinuxCnc => "linuxcnc",
            Dialect::Siemens => "siemens",
            Dialect::Heidenhain => "heidenhain",
        }
    }
}

/// Something that a corrected program does and should not.
#[derive(Debug, Clone, PartialEq)]
pub struct Disagreement {
    /// In which language.
    pub dialect: Dialect,
    /// The seed of the program.
    pub seed: u64,
    /// Line of the original (from 1); 0 where none is meant.
    pub line: usize,
    /// Kind in a word.
    pub kind: &'static str,
    /// What was seen.
    pub text: String,
}

impl fmt::Display for Disagreement {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { dialect, seed, line, kind, text } = self;
        write!(f, "{} seed {seed}, line {line}: {kind}: {text}", dialect.name())
    }
}

/// Counts of a run.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Tally {
    /// Programs.
    pub programs: usize,
    /// Executed motions of the originals.
    pub executed: usize,
    /// Executed motions that were changed and compared on the actual arm.
    pub corrected: usize,
    /// Executed motions that were left.
    pub left: usize,
    /// Executed motions that were refused.
    pub refused: usize,
    /// Executed motions that the arm of the test cannot reach in the original either.
    pub unreachable: usize,
    /// Executed motions that could not be judged, because what the arm does there hangs on less than can be told.
    pub open: usize,
    /// Executed motions that were changed and flagged since they rest on a configuration that is not checked, where the arm
    /// comes in another one. Not among the corrected.
    pub guessed: usize,
    /// Corrected executions that are off by more than numbers are written to, and by no more than the report states for them.
    pub stated: usize,
    /// What is wrong.
    pub disagreements: Vec<Disagreement>,
}

impl Tally {
    /// Adds the counts of another run.
    pub fn merge(&mut self, other: Tally) {
        self.programs += other.programs;
        self.executed += other.executed;
        self.corrected += other.corrected;
        self.left += other.left;
        self.refused += other.refused;
        self.unreachable += other.unreachable;
        self.open += other.open;
        self.guessed += other.guessed;
        self.stated += other.stated;
        self.disagreements.extend(other.disagreements);
    }
}
