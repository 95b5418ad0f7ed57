//! Which motion of a rewritten program belongs to which of the original.

use super::executed_end::ExecutedEnd;
use truegrind_programs::motion::Listing;

/// Cost of a motion with a known end beside one without (mm): more than between any two targets of a path.
const OTHER_KIND_MM: f64 = 1e4;

/// Cost of a motion beside one with another zone (mm): a target that takes up backlash is inserted a tenth of a millimetre from a corner, and
/// has the zone of inserted ones.
const OTHER_ZONE_MM: f64 = 5.0;

/// The rewritten motion that belongs to each original one: one to one for equal numbers; with inserted targets, the monotone
/// matching of least total distance, by dynamic programming over the inserted targets. `None` for all where motions were lost.
pub(crate) fn align(
    [original, rewritten]: [&Listing; 2],
    before: &[Option<&ExecutedEnd>],
    after: &[Option<&ExecutedEnd>],
) -> Vec<Option<usize>> {
    let (n, m) = (before.len(), after.len());
    if n == m {
        return (0..n).map(Some).collect();
    }
    if m < n || n == 0 {
        return vec![None; n];
    }
    let extra = m - n;
    // A corrected target reaches the intended place, or where only the shape is corrected lies near to it. An inserted one on an arc of short
    // segments may be nearer to it than the correction is large.
    let [zones, zones_after] = [original, rewritten].map(zones_of);
    let distance = |i: usize, k: usize| match (before[i], after[k]) {
        (Some(a), Some(b)) => {
            let from = a.commanded.translation.vector;
            let [commanded, reached] = [b.commanded, b.reached].map(|pose| pose.translation.vector);
            let apart = (from - commanded).norm().min((from - reached).norm());
            apart + if zones[i] == zones_after[k] { 0.0 } else { OTHER_ZONE_MM }
        }
        (None, None) => 0.0,
        _ => OTHER_KIND_MM,
    };
    // cost[e]: least total distance with motions 0..=i matched and e of the extra ones skipped so far.
    let mut cost: Vec<f64> = (0..=extra).map(|e| distance(0, e)).collect();
    let mut from: Vec<Vec<usize>> = vec![(0..=extra).collect()];
    for i in 1..n {
        let mut next = vec![f64::INFINITY; extra + 1];
        let mut origin = vec![0; extra + 1];
        let mut best = (f64::INFINITY, 0);
        for e in 0..=extra {
            if cost[e] < best.0 {
                best = (cost[e], e);
            }
            next[e] = best.0 + distance(i, i + e);
            origin[e] = best.1;
        }
        cost = next;
        from.push(origin);
    }
    let mut e = (0..=extra).min_by(|a, b| cost[*a].total_cmp(&cost[*b])).unwrap_or(0);
    let mut out = vec![None; n];
    for i in (0..n).rev() {
        out[i] = Some(i + e);
        e = from[i][e];
    }
    out
}

/// The zone of each motion, as the program writes it.
fn zones_of(listing: &Listing) -> Vec<Option<&str>> {
    listing.motions.iter().map(|motion| Some(listing.zone(motion)?.text.as_str())).collect()
}
