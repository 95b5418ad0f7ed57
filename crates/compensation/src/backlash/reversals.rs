//! Where a joint reverses along a path, by a parabola through neighbouring samples.

use truegrind_arm::model::Joints;

/// A motor that moves back by less has not reversed (rad): the position noise of a drive at rest.
pub(crate) const DEAD_BAND_RAD: f64 = 1e-5;

/// Where a joint reverses between samples k − 1 and k: vertex of the parabola through these two and a neighbour.
pub(crate) fn turning_point(samples: &[(f64, f64)], k: usize) -> Option<(f64, f64)> {
    let first = match k {
        _ if samples.len() < 3 || k == 0 => return None,
        1 => 0,
        _ => k - 2,
    };
    let [a, b, c] = [samples[first], samples[first + 1], samples[first + 2]];
    // Newton's form: f(s) = f(a) + d1 (s − a) + d2 (s − a)(s − b).
    let d1 = (b.1 - a.1) / (b.0 - a.0);
    let d2 = ((c.1 - b.1) / (c.0 - b.0) - d1) / (c.0 - a.0);
    let vertex = 0.5 * (a.0 + b.0) - 0.5 * d1 / d2;
    let within = vertex > samples[k - 1].0 && vertex < samples[k].0;
    within.then_some((vertex, a.1 + d1 * (vertex - a.0) + d2 * (vertex - a.0) * (vertex - b.0)))
}

/// Whether every other sample of a path implies the same reversals as all samples, for joints with backlash, and none hidden
/// near its end.
pub(crate) fn samples_agree(
    start: &Joints,
    samples: &[(f64, Joints)],
    end: &Joints,
    half: &[f64; 6],
) -> bool {
    if samples.len() < 3 {
        return true;
    }
    (0..6).filter(|&joint| half[joint] > 0.0).all(|joint| {
        let inner = samples.iter().map(|(share, joints)| (*share, joints[joint]));
        let all: Vec<(f64, f64)> =
            [(0.0, start[joint])].into_iter().chain(inner).chain([(1.0, end[joint])]).collect();
        let other: Vec<(f64, f64)> = all.iter().copied().step_by(2).collect();
        let [fine, coarse] = [last_slope(&all), last_slope(&other)];
        // Largest travel of a reversal hidden between the last two samples.
        let hidden = 0.5 * (fine - coarse).abs() * (1.0 - all[all.len() - 2].0);
        let certain = (fine - coarse).abs() < 0.5 * fine.abs() || hidden < 0.1 * DEAD_BAND_RAD;
        let [all, other] = [reversals_of(&all), reversals_of(&other)];
        let alike = |((one, at), (other, near)): (&(i8, f64), &(i8, f64))| {
            one == other && (at - near).abs() < 0.5 * DEAD_BAND_RAD
        };
        certain && all.len() == other.len() && all.iter().zip(&other).all(alike)
    })
}

/// Joint velocity at the end of a path (rad per share), by the parabola through its last three samples.
fn last_slope(samples: &[(f64, f64)]) -> f64 {
    let [.., a, b, c] = samples else { return 0.0 };
    let (first, last) = ((b.1 - a.1) / (b.0 - a.0), (c.1 - b.1) / (c.0 - b.0));
    last + (last - first) / (c.0 - a.0) * (c.0 - b.0)
}

/// Successive directions of a joint, and the reversal points.
fn reversals_of(samples: &[(f64, f64)]) -> Vec<(i8, f64)> {
    let mut out: Vec<(i8, f64)> = Vec::new();
    let mut farthest = samples[0].1;
    for k in 1..samples.len() {
        for (_, angle) in turning_point(samples, k).into_iter().chain([samples[k]]) {
            let gone = angle - farthest;
            let direction = if gone > 0.0 { 1 } else { -1 };
            match out.last_mut() {
                Some((last, at)) if *last == direction => (*at, farthest) = (angle, angle),
                _ if gone.abs() > DEAD_BAND_RAD => {
                    out.push((direction, angle));
                    farthest = angle;
                }
                _ => {}
            }
        }
    }
    out
}
