//! Assignment of units to the shares of a run.

use std::str::FromStr;

use super::key::Fields;

/// Share `number` of `of`, counted from 1.
///
/// The share of a unit depends on a hash of its name alone, not on its position: adding or removing a file while jobs are starting moves
/// no other unit to another share, and all machines agree without communication. Shares are therefore equal only on average.
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
    /// Number, from 1.
    pub number: u32,
    /// Number of shares.
    pub of: u32,
}

impl Share {
    /// Whether the share contains the unit. `name`: path relative to the given folder, with `/` as separator on all platforms.
    pub fn has(&self, name: &str) -> bool {
        self.of > 0 && Self::of_name(name, self.of) == self.number
    }

    /// Number of the share (of `of`) that contains the unit.
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
