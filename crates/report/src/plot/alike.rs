//! Detection of coinciding curves, of which only one is drawn.

use super::graph::Series;
use truegrind_math::statistics::extent;

/// Width of a line as a share of the height of the plot.
const LINE: f64 = 0.005;

/// The distinguishable curves, and for each other one its name with that of the curve it coincides with: within a line width at every
/// x for which `counts` is true. Curves with a band are always drawn.
pub fn distinguishable(
    series: Vec<Series>,
    counts: impl Fn(f64) -> bool,
) -> (Vec<Series>, Vec<(String, String)>) {
    let heights = series.iter().flat_map(|s| &s.points).map(|p| p[1]).filter(|y| y.is_finite());
    let [low, high] = extent(heights);
    let line = LINE * (high - low);
    let agree = |a: &Series, b: &Series| {
        let near =
            |(a, b): (&[f64; 2], &[f64; 2])| a[0] == b[0] && (!counts(a[0]) || (a[1] - b[1]).abs() <= line);
        a.points.len() == b.points.len() && a.points.iter().zip(&b.points).all(near)
    };
    let (mut drawn, mut alike): (Vec<Series>, Vec<(String, String)>) = (Vec::new(), Vec::new());
    for one in series {
        match drawn.iter().find(|other| one.bounds.is_empty() && agree(other, &one)) {
            Some(other) => alike.push((one.name, other.name.clone())),
            None => drawn.push(one),
        }
    }
    (drawn, alike)
}
