//! Which share of a run does which unit.

use std::str::FromStr;

use super::key::Fields;

/// Share `number` of `of`, counted from 1.
///
/// A unit's share follows from its name alone, by a hash of it and not by its place among the others: a file that is added or taken
/// away while the jobs of a run are starting moves no other unit from one share to another, and every machine comes to
/// the same answer without asking the others. The price is that shares are equal only on average.
///
/// ```
/// use truegrind::units::share::Share;
/// let share: Share = "3/8".parse()?;
/// let names = ["a.mod", "b/c.mod"];
/// for name in names {
///     let doing = (1..=8).filter(|&number| Share { number, of: 8 }.has(name));
///     assert_eq!(doing.count(), 1);
/// }
/// assert!("0/8".parse::<Share>().is_err() && "9/8".parse::<Share>().is_err());
/// # assert_eq!((share.number, share.of), (3, 8));
/// # Ok::<(), String>(())
/// ```
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Share {
    /// Which one, from 1.
    pub number: u32,
    /// Of how many.
    pub of: u32,
}

impl Share {
    /// Whether the unit with this name is in the share. Names are those below the folder that was given, with `/` between
    /// folders on every machine.
    pub fn has(&self, name: &str) -> bool {
        self.of > 0 && Self::of_name(name, self.of) == self.number
    }

    /// The number of the share, of so many, that does the unit with this name.
    pub fn of_name(name: &str, of: u32) -> u32 {
        let hash = Fields::new("truegrind.share/1").text(name).digest();
        let (first, _) = hash.split_at(8);
        let number = first.iter().fold(0_u64, |sum, byte| sum << 8 | u64::from(*byte));
        (number % u64::from(of.max(1))) as u32 + 1
    }
}

impl FromStr for Share {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let number = |word: &str| word.trim().parse::<u32>().ok();
        text.split_once('/')
            .and_then(|(number_of, of)| Some(Self { number: number(number_of)?, of: number(of)? }))
            .filter(|share| (1..=share.of).contains(&share.number))
            .ok_or_else(|| "expected I/N, such as 3/8: share 3 of 8, counted from 1".to_owned())
    }
}
