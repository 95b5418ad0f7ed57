//! A number or nothing in eight bytes, where `Option<f64>` takes sixteen: programs have a million motions.

use std::fmt;

/// A number or nothing.
///
/// ```
/// use truegrind_math::option_f64::OptionF64;
///
/// assert_eq!(OptionF64::from(Some(0.0)).get(), Some(0.0));
/// assert_eq!(OptionF64::NONE.get(), None);
/// assert!(OptionF64::from(f64::NAN).get().is_some_and(f64::is_nan));
/// assert_eq!(size_of::<OptionF64>(), 8);
/// ```
#[derive(Clone, Copy)]
pub struct OptionF64(f64);

/// A NaN that no arithmetic makes.
const NOTHING: u64 = 0x7ff8_0000_0000_a65e;

impl OptionF64 {
    /// Nothing.
    pub const NONE: OptionF64 = OptionF64(f64::from_bits(NOTHING));

    /// The number, if there is one.
    pub fn get(self) -> Option<f64> {
        self.is_some().then_some(self.0)
    }

    /// Whether there is a number.
    pub fn is_some(self) -> bool {
        self.0.to_bits() != NOTHING
    }
}

impl From<f64> for OptionF64 {
    fn from(number: f64) -> Self {
        OptionF64(number)
    }
}

impl From<Option<f64>> for OptionF64 {
    fn from(number: Option<f64>) -> Self {
        number.map_or(OptionF64::NONE, OptionF64)
    }
}

impl PartialEq for OptionF64 {
    fn eq(&self, other: &OptionF64) -> bool {
        self.get() == other.get()
    }
}

impl fmt::Debug for OptionF64 {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        self.get().fmt(f)
    }
}
