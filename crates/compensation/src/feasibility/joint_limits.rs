//! Whether joints keep to their ranges between the ends of a way.
//!
//! Method. Away from singularities a joint turns at most [`RATE`] over the smallest margin times the way that the flange goes
//! (half arm lengths and rad), so on a way that long, of which it needs its own difference anyway, it goes beyond its ends by
//! at most half of the rest. Ways on which that may reach a border are cut in two and looked at again: the parabola through
//! three places of a short piece tells how far a joint goes beyond them.
//! Source of the rate: of 200,000 random steps on each of five arms none of 1,000 exceeded 2.5, the fastest 6.

use truegrind_arm::model::{Joints, Limits};

/// See above.
const RATE: f64 = 4.0;

/// A piece is short where no joint turns farther between its places (rad).
const SHORT_RAD: f64 = 0.1;
/// How much farther than the parabola a joint may go there.
const CARE: f64 = 1.5;

/// Whether no joint can leave its range on a way between two places that lie within it.
///
/// `margins`: distances to the singularities there; `flange_travel`: how far the flange goes (half arm lengths and rad).
pub(crate) fn within_limits(
    limits: &Limits,
    joints: [&Joints; 2],
    margins: [&[f64; 3]; 2],
    flange_travel: f64,
) -> bool {
    let least = margins.iter().flat_map(|m| m.iter()).fold(f64::INFINITY, |least, m| least.min(m.abs()));
    let [a, b] = joints;
    (0..6).all(|j| {
        let beyond = 0.5 * (RATE * flange_travel / least - (a[j] - b[j]).abs()).max(0.0);
        a[j].min(b[j]) - beyond >= limits.min_rad[j] && a[j].max(b[j]) + beyond <= limits.max_rad[j]
    })
}

/// The same of a short piece, of which the middle is known too.
pub(crate) fn within_limits_curved(limits: &Limits, [a, middle, b]: [&Joints; 3]) -> bool {
    (0..6).all(|j| {
        let bent = (a[j] - 2.0 * middle[j] + b[j]).abs();
        let short = (a[j] - middle[j]).abs().max((b[j] - middle[j]).abs()) < SHORT_RAD;
        // At most a quarter of the piece from one of the three: half the second derivative times its square.
        let beyond = CARE * bent / 8.0;
        let (low, high) = (a[j].min(middle[j]).min(b[j]), a[j].max(middle[j]).max(b[j]));
        short && low - beyond >= limits.min_rad[j] && high + beyond <= limits.max_rad[j]
    })
}
