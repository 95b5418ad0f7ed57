//! Curves that run as another: drawn over it they would hide it.

use super::graph::Series;

/// Share of the height of a picture that a line is wide.
const LINE: f64 = 0.005;

/// The curves that can be told apart, and of the others the name with that of the one that they run as: nowhere apart by more than a
/// line's width, where `counts` says of an x that it counts. What has a band is drawn whatever it runs as.
pub fn told_apart(series: Vec<Series>, counts: impl Fn(f64) -> bool) -> (Vec<Series>, Vec<(String, String)>) {
    let heights = || series.iter().flat_map(|s| &s.points).map(|p| p[1]).filter(|y| y.is_finite());
    let (low, high) =
        heights().fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), y| (low.min(y), high.max(y)));
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
