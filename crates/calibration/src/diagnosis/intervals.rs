//! Change points of shifts, by scanning intervals of rows.
//!
//! With prefix sums of gradient, information and Q-products over the observations, the evidence of any interval takes p k²
//! operations, so thousands of intervals are tried: a coarse grid of starts and ends, then the best ones refined row by
//! row. The Q-products are summed once for a fit; a model without some parameters subtracts d directions. An interval from the
//! first row is equivalent to its complement, which is reported instead: the change happened at its first row. Each station of a tracker
//! has a frame of its own, so that the same holds of a shift of the sensor from the first row of any station. Source:
//! likelihood-ratio scan of circular binary segmentation, Olshen et al. 2004, with nuisance parameters projected off.

use std::borrow::Cow;
use std::cmp::Ordering;
use std::collections::BTreeMap;
use std::ops::Range;

use nalgebra::DMatrix;
use rayon::prelude::*;

use super::algebra::{gram, without_lower_gram};
use super::design::Design;
use truegrind_math::axpy::add_scaled;
use truegrind_math::lanes::{AnyWidth, Real, SinCos, WIDTH, vectorised};
use truegrind_math::work::checkpoint;

/// Rows of a shift, as indices of observations, both included, and its evidence.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Interval {
    /// First.
    pub from: usize,
    /// Last.
    pub to: usize,
    /// Evidence as in `score`, trials not counted.
    pub evidence: f64,
}

impl Interval {
    /// Order of the results: best first, ties by position.
    fn before(&self, other: &Self) -> Ordering {
        other.evidence.total_cmp(&self.evidence).then(self.from.cmp(&other.from)).then(self.to.cmp(&other.to))
    }
}

/// Shortest interval: fewer rows are outliers, not a shift.
pub const MIN_INTERVAL_ROWS: usize = 4;

/// Effective number of distinct intervals among n rows, for the multiple-testing correction.
pub fn tried(n: f64) -> f64 {
    n.max(2.0) * n.max(3.0).ln()
}

/// Starts and ends on the coarse grid.
const GRID: usize = 96;

/// Evidence of a grid interval below which refining its ends cannot make it significant.
const REFINED_EVIDENCE: f64 = 5.0;

/// Difference of evidence below which two descriptions of the same rows are equivalent.
const TIE_EVIDENCE: f64 = 6.0;

/// Most parameters of a shift.
const MAX_SHIFT_PARAMETERS: usize = 6;

/// Dot product in eight partial sums, for vectorisation.
fn dot(x: &[f64], y: &[f64]) -> f64 {
    let mut sums = [0.0; 8];
    let (whole, rest) = (x.chunks_exact(8), x.len() / 8 * 8);
    for (a, b) in whole.zip(y.chunks_exact(8)) {
        for k in 0..8 {
            sums[k] += a[k] * b[k];
        }
    }
    let tail: f64 = x[rest..].iter().zip(&y[rest..]).map(|(a, b)| a * b).sum();
    sums.iter().sum::<f64>() + tail
}

/// Prefix sums of one kind of shift against a full design.
#[derive(Debug, Clone)]
pub struct ShiftScan {
    n: usize,
    k: usize,
    /// Columns in units of the sizes.
    scaled: DMatrix<f64>,
    /// The observations of each station, one after the other; all where there is one, or where they alternate.
    stations: Vec<Range<usize>>,
    /// Observations at which an interval may begin on the coarse grid, and n.
    cuts: Vec<usize>,
    stride: usize,
    /// Prefix sums of Q-products at the cuts, p × (k · cuts).
    shared: DMatrix<f64>,
    /// Their scalar products with each other.
    products: DMatrix<f64>,
    /// Prefix sums of squares at every observation, k × k each.
    square: Vec<f64>,
    /// Those at the cuts, in the order of [`by_entry`].
    square_at_cuts: Vec<f64>,
}

/// A scan against one design.
struct ScanSums<'a> {
    strip: &'a ShiftScan,
    design: &'a Design,
    /// Prefix sums at every observation, k each.
    gradient: Vec<f64>,
    /// Prefix sums of the products with the removed directions at the cuts, d × (k · cuts).
    given_back: Option<DMatrix<f64>>,
    /// Scalar products of the prefix sums at the cuts with each other: the lower triangle.
    products: Cow<'a, DMatrix<f64>>,
    /// Those of each cut with itself, in the order of [`by_entry`].
    own_products: Vec<f64>,
}

/// Adds the products of some scalar rows with the rows of `basis` to `out`, k × rows of the basis.
fn add_products(scaled: &DMatrix<f64>, basis: &DMatrix<f64>, rows: Range<usize>, out: &mut [f64]) {
    let mut terms: Vec<(usize, f64)> = Vec::with_capacity(rows.len());
    for (a, sum) in out.chunks_exact_mut(basis.nrows()).enumerate() {
        terms.clear();
        terms.extend(rows.clone().map(|s| (s, scaled[(s, a)])).filter(|(_, c)| *c != 0.0));
        add_scaled(&terms, basis.as_slice(), sum);
    }
}

/// Prefix sums of the products at the cuts, rows of the basis × (k · cuts).
fn sums_at(cuts: &[usize], scaled: &DMatrix<f64>, basis: &DMatrix<f64>, per: usize) -> DMatrix<f64> {
    let (p, k) = (basis.nrows(), scaled.ncols());
    let mut out = DMatrix::zeros(p, k * cuts.len());
    let mut at = 0;
    for (c, &cut) in cuts.iter().enumerate() {
        let (first, count) = (at * per, (cut - at) * per);
        let (basis, scaled) = (basis.columns(first, count), scaled.rows(first, count));
        let (before, mut place) =
            out.columns_range_pair_mut(c.saturating_sub(1) * k..c * k, c * k..(c + 1) * k);
        if c > 0 {
            place.copy_from(&before);
        }
        place.gemm(1.0, &basis, &scaled, 1.0);
        at = cut;
    }
    out
}

/// What the cuts have at each entry (a, b) of the lower triangle of a k × k matrix: of one entry all cuts, then of the next. A scan reads
/// them thousands of times in this order, and in a matrix of all cuts they are pages apart.
fn by_entry(k: usize, cuts: usize, of: impl Fn(usize, usize, usize) -> f64) -> Vec<f64> {
    let mut out = Vec::with_capacity(k * (k + 1) / 2 * cuts);
    for a in 0..k {
        for b in 0..=a {
            out.extend((0..cuts).map(|cut| of(cut, a, b)));
        }
    }
    out
}

/// Evidence of k parameters with information `square` and gradient `gradient` in units of their sizes, and 0 in place of 1 where
/// the information is not positive definite: S + I = L Lᵀ and L y = g on the stack, the gain is yᵀy.
#[inline(always)]
fn evidence<R: Real>(
    like: R,
    k: usize,
    square: impl Fn(usize, usize) -> R,
    gradient: impl Fn(usize) -> R,
) -> [R; 2] {
    let (zero, one) = (like.splat(0.0), like.splat(1.0));
    if k == 1 {
        let (g, s) = (gradient(0), square(0, 0).each(|s| s.max(0.0)));
        return [g * g / (s + one) - (one + s).each(f64::ln), one];
    }
    let (mut l, mut y) = ([zero; MAX_SHIFT_PARAMETERS * MAX_SHIFT_PARAMETERS], [zero; MAX_SHIFT_PARAMETERS]);
    let (mut det, mut definite, mut gain) = (one, one, zero);
    for a in 0..k {
        for b in 0..=a {
            let mut sum = if a == b { square(a, b) + one } else { square(a, b) };
            for c in 0..b {
                sum -= l[a * MAX_SHIFT_PARAMETERS + c] * l[b * MAX_SHIFT_PARAMETERS + c];
            }
            if a == b {
                definite = definite * sum.positive();
                det = det * sum;
                l[a * MAX_SHIFT_PARAMETERS + a] = sum.sqrt();
            } else {
                l[a * MAX_SHIFT_PARAMETERS + b] = sum / l[b * MAX_SHIFT_PARAMETERS + b];
            }
        }
        let mut sum = gradient(a);
        for c in 0..a {
            sum -= l[a * MAX_SHIFT_PARAMETERS + c] * y[c];
        }
        y[a] = sum / l[a * MAX_SHIFT_PARAMETERS + a];
        gain += y[a] * y[a];
    }
    [gain - det.each(f64::ln), definite]
}

/// The evidence, or none.
fn valid([evidence, definite]: [f64; 2]) -> f64 {
    if definite > 0.0 { evidence } else { f64::NEG_INFINITY }
}

/// Evidence of several intervals: the lower triangles of their information and their gradients, one after the other for each entry.
struct Evidences<'a> {
    k: usize,
    squares: &'a [f64],
    gradients: &'a [f64],
    evidence: &'a mut [f64],
}

impl AnyWidth for Evidences<'_> {
    type Output = ();

    #[inline(always)]
    fn run<R: SinCos>(self, like: R) {
        let Self { k, squares, gradients, evidence: out } = self;
        let count = out.len();
        for at in (0..count).step_by(R::ROWS) {
            let entry = |all: &[f64], place: usize| like.load(&all[place * count..][..count], at);
            let [found, definite] =
                evidence(like, k, |a, b| entry(squares, a * (a + 1) / 2 + b), |a| entry(gradients, a));
            let (mut values, mut flags) = ([0.0; WIDTH], [0.0; WIDTH]);
            found.store(&mut values, 0);
            definite.store(&mut flags, 0);
            for (place, (value, flag)) in
                out[at..].iter_mut().take(R::ROWS).zip(values.into_iter().zip(flags))
            {
                *place = valid([value, flag]);
            }
        }
    }
}

impl ShiftScan {
    /// Sums `columns`, given for all rows, with prior standard deviations `sizes`; `None` for too few rows or too many
    /// parameters.
    pub fn of(whole: &Design, columns: &DMatrix<f64>, sizes: &[f64]) -> Option<Self> {
        let (n, per, k) = (whole.observations, whole.per, columns.ncols());
        if n < 3 * MIN_INTERVAL_ROWS || k > MAX_SHIFT_PARAMETERS {
            return None;
        }
        let mut scaled = columns.clone();
        for (mut column, size) in scaled.column_iter_mut().zip(sizes) {
            column *= *size;
        }
        let mut square = vec![0.0; (n + 1) * k * k];
        for i in 0..n {
            for a in 0..k {
                for b in 0..k {
                    let c: f64 = (i * per..(i + 1) * per).map(|s| scaled[(s, a)] * scaled[(s, b)]).sum();
                    square[((i + 1) * k + a) * k + b] = square[(i * k + a) * k + b] + c;
                }
            }
        }
        let stride = n.div_ceil(GRID).max(1);
        let cuts: Vec<usize> = (MIN_INTERVAL_ROWS..n - 1).step_by(stride).chain([n]).collect();
        let shared = sums_at(&cuts, &scaled, &whole.basis, per);
        let products = gram(&shared);
        let square_at_cuts = by_entry(k, cuts.len(), |cut, a, b| square[(cuts[cut] * k + a) * k + b]);
        let stations = std::iter::once(0..n).collect();
        Some(Self { n, k, stations, scaled, cuts, stride, shared, products, square, square_at_cuts })
    }

    /// The same for observations of several stations, one for each observation.
    pub fn of_stations(self, station_of: &[usize]) -> Self {
        let mut stations: Vec<Range<usize>> = Vec::new();
        for run in station_of.chunk_by(|a, b| a == b) {
            let from = stations.last().map_or(0, |before| before.end);
            stations.push(from..from + run.len());
        }
        let mut named = station_of.to_vec();
        named.sort_unstable();
        named.dedup();
        // Where stations alternate, a shift is none of a station.
        if named.len() == stations.len() { Self { stations, ..self } } else { self }
    }

    /// The best intervals, best first: at most `count`, none of which shares most of its rows with a better one. `design` is
    /// the full design of the scan, or a reduction of it.
    pub fn scan(&self, design: &Design, count: usize) -> Vec<Interval> {
        let n = self.n;
        let sums = ScanSums::of(self, design);
        let grid = self.cuts.len() - 1;
        let coarse: Vec<Vec<Interval>> = (0..grid)
            .into_par_iter()
            .map(|first| {
                checkpoint();
                let from = self.cuts[first];
                let mut found = Vec::new();
                for (evidence, cut) in sums.after_cut(first).into_iter().zip(&self.cuts[first + 1..]) {
                    let to = cut - 1;
                    if to + 1 >= from + MIN_INTERVAL_ROWS && is_valid_end(to, n) {
                        found.push(Interval { from, to, evidence });
                    }
                }
                found
            })
            .collect();
        let mut best: Vec<Interval> = Vec::new();
        let mut last: Option<Interval> = None;
        while best.len() < count {
            // The next one with little overlap; a full sort is not worth it for a few.
            let next = coarse
                .iter()
                .flatten()
                .filter(|i| last.is_none_or(|last| last.before(i).is_lt()))
                .filter(|i| best.iter().all(|b| overlap(b, i) < 0.5))
                .min_by(|a, b| a.before(b));
            let Some(next) = next.copied() else { break };
            last = Some(next);
            let next = if next.evidence > REFINED_EVIDENCE { refined(&sums, next) } else { next };
            if !best.iter().any(|b| (b.from, b.to) == (next.from, next.to)) {
                best.push(next);
            }
        }
        best
    }
}

impl<'a> ScanSums<'a> {
    fn of(strip: &'a ShiftScan, design: &'a Design) -> Self {
        let (n, k, per) = (strip.n, strip.k, design.per);
        let mut gradient = vec![0.0; (n + 1) * k];
        for i in 0..n {
            for a in 0..k {
                let g: f64 =
                    (i * per..(i + 1) * per).map(|s| strip.scaled[(s, a)] * design.residual[s]).sum();
                gradient[(i + 1) * k + a] = gradient[i * k + a] + g;
            }
        }
        let given_back = design.removed().map(|removed| sums_at(&strip.cuts, &strip.scaled, removed, per));
        let products = match &given_back {
            Some(back) => Cow::Owned(without_lower_gram(strip.products.clone(), back)),
            None => Cow::Borrowed(&strip.products),
        };
        let own_products = by_entry(k, strip.cuts.len(), |cut, a, b| products[(cut * k + a, cut * k + b)]);
        Self { strip, design, gradient, given_back, products, own_products }
    }

    /// Prefix sums at a cut: k Q-products, then k products with the removed directions.
    fn at_cut(&'a self, cut: usize) -> Vec<f64> {
        let k = self.strip.k;
        let of = |m: &'a DMatrix<f64>| &m.as_slice()[cut * k * m.nrows()..][..k * m.nrows()];
        [of(&self.strip.shared), self.given_back.as_ref().map_or(&[], of)].concat()
    }

    /// Evidence of the observations between the cut `first` and each later one, several in a register.
    fn after_cut(&'a self, first: usize) -> Vec<f64> {
        let (k, cuts) = (self.strip.k, &self.strip.cuts);
        let lasts = first + 1..cuts.len();
        let count = lasts.len();
        let (g, low, from) = (&self.products, first * k, cuts[first]);
        let mut squares = Vec::with_capacity(k * (k + 1) / 2 * count);
        let later = |all: &'a [f64], entry: usize| &all[entry * cuts.len()..][..cuts.len()][first + 1..];
        for a in 0..k {
            for b in 0..=a {
                let entry = a * (a + 1) / 2 + b;
                let (by_a, by_b) = (g.column(low + a), g.column(low + b));
                let (own, square) =
                    (later(&self.own_products, entry), later(&self.strip.square_at_cuts, entry));
                let (before, own_before) = (self.square_at(from, a, b), by_b[low + a]);
                let high = [&by_b.as_slice()[low + k + a..], &by_a.as_slice()[low + k + b..]];
                let shared = own.iter().zip(high[0].iter().step_by(k)).zip(high[1].iter().step_by(k));
                let shared = shared.map(|((own, x), y)| own - x - y + own_before);
                squares.extend(square.iter().zip(shared).map(|(square, shared)| square - before - shared));
            }
        }
        let mut gradients = Vec::with_capacity(k * count);
        for a in 0..k {
            let before = self.gradient[from * k + a];
            gradients.extend(lasts.clone().map(|last| self.gradient[cuts[last] * k + a] - before));
        }
        let mut evidence = vec![0.0; count];
        vectorised(Evidences { k, squares: &squares, gradients: &gradients, evidence: &mut evidence });
        evidence
    }

    /// Prefix sum of squares.
    fn square_at(&self, i: usize, a: usize, b: usize) -> f64 {
        let k = self.strip.k;
        self.strip.square[(i * k + a) * k + b]
    }

    /// Evidence of observations from..=to, with the prefix sums at from and to + 1.
    fn evidence(&self, from: usize, to: usize, low: &[f64], high: &[f64], work: &mut Vec<f64>) -> f64 {
        let (p, d) = (self.strip.shared.nrows(), self.given_back.as_ref().map_or(0, DMatrix::nrows));
        work.clear();
        work.extend(high.iter().zip(low).map(|(h, l)| h - l));
        let k = self.strip.k;
        let (shared, back) = work.split_at(k * p);
        let square = |a: usize, b: usize| {
            let shared = dot(&shared[a * p..][..p], &shared[b * p..][..p])
                - dot(&back[a * d..][..d], &back[b * d..][..d]);
            self.square_at(to + 1, a, b) - self.square_at(from, a, b) - shared
        };
        let gradient = |a: usize| self.gradient[(to + 1) * k + a] - self.gradient[from * k + a];
        valid(evidence(0.0, k, square, gradient))
    }

    /// Prefix sums at any observation, cached in `known`.
    fn at_row<'b>(&self, i: usize, known: &'b mut BTreeMap<usize, Vec<f64>>) -> &'b [f64] {
        if !known.contains_key(&i) {
            let cut = self.strip.cuts.partition_point(|&c| c <= i).saturating_sub(1);
            let before = known.range(..i).next_back().filter(|(near, _)| **near > self.strip.cuts[cut]);
            let (at, mut sum) = before
                .map_or_else(|| (self.strip.cuts[cut], self.at_cut(cut)), |(&near, sum)| (near, sum.clone()));
            let (shared, back) = sum.split_at_mut(self.strip.k * self.strip.shared.nrows());
            let rows = at * self.design.per..i * self.design.per;
            add_products(&self.strip.scaled, &self.design.basis, rows.clone(), shared);
            if let Some(removed) = self.design.removed() {
                add_products(&self.strip.scaled, removed, rows, back);
            }
            known.insert(i, sum);
        }
        &known[&i]
    }
}

/// The best intervals of columns that are given for all rows: [`ShiftScan::scan`] of one design.
pub fn scan(design: &Design, columns: &DMatrix<f64>, sizes: &[f64], count: usize) -> Vec<Interval> {
    ShiftScan::of(design, columns, sizes).map_or_else(Vec::new, |strip| strip.scan(design, count))
}

/// A shift ends with the last row, or early enough before it to be distinguishable from one that does.
fn is_valid_end(to: usize, n: usize) -> bool {
    to == n - 1 || to + MIN_INTERVAL_ROWS < n
}

/// Shared rows over all rows of two intervals.
fn overlap(a: &Interval, b: &Interval) -> f64 {
    let shared = (a.to.min(b.to) + 1).saturating_sub(a.from.max(b.from)) as f64;
    let all = (a.to.max(b.to) + 1 - a.from.min(b.from)) as f64;
    shared / all
}

/// Moves one end at a time within the grid's spacing, until neither helps.
fn refined(sums: &ScanSums<'_>, mut best: Interval) -> Interval {
    let (n, stride) = (sums.strip.n, sums.strip.stride);
    let (mut work, mut known) = (Vec::new(), BTreeMap::new());
    for _ in 0..6 {
        let before = best;
        let high = sums.at_row(best.to + 1, &mut known).to_vec();
        for from in
            best.from.saturating_sub(2 * stride).max(MIN_INTERVAL_ROWS)..=(best.from + 2 * stride).min(n - 2)
        {
            if from + MIN_INTERVAL_ROWS <= best.to + 1 {
                let low = sums.at_row(from, &mut known);
                let evidence = sums.evidence(from, best.to, low, &high, &mut work);
                if evidence > best.evidence {
                    best = Interval { from, evidence, ..best };
                }
            }
        }
        let low = sums.at_row(best.from, &mut known).to_vec();
        for to in best.to.saturating_sub(2 * stride)..=(best.to + 2 * stride).min(n - 1) {
            if best.from + MIN_INTERVAL_ROWS <= to + 1 && is_valid_end(to, n) {
                let high = sums.at_row(to + 1, &mut known);
                let evidence = sums.evidence(best.from, to, &low, high, &mut work);
                if evidence > best.evidence {
                    best = Interval { to, evidence, ..best };
                }
            }
        }
        if best == before {
            break;
        }
    }
    for equivalent in equivalents(&sums.strip.stations, best) {
        let low = sums.at_row(equivalent.start, &mut known).to_vec();
        let high = sums.at_row(equivalent.end, &mut known);
        let evidence = sums.evidence(equivalent.start, equivalent.end - 1, &low, high, &mut work);
        if evidence > best.evidence - TIE_EVIDENCE {
            return Interval { from: equivalent.start, to: equivalent.end - 1, evidence };
        }
    }
    best
}

/// Rows whose shift reads the same as that of an interval, if what shifted is what each station, or the whole, is free to place: from where the
/// change happened to the end of its station, or of all.
///
/// An interval that starts with nearly the first rows of a station has its complement in the station in which it ends; one that ends with
/// a later station starts in the middle of its first.
fn equivalents(stations: &[Range<usize>], best: Interval) -> Vec<Range<usize>> {
    let starts =
        |range: &Range<usize>| (range.start..=range.start + 3 * MIN_INTERVAL_ROWS).contains(&best.from);
    let of = |row: usize| stations.iter().find(|range| range.contains(&row)).cloned();
    let Some(last) = of(best.to) else { return Vec::new() };
    let all = last.end.max(stations.last().map_or(0, |range| range.end));
    let after = best.to + 1;
    let mut out = Vec::new();
    if after < last.end && stations.iter().any(starts) {
        out.push(after..last.end);
    }
    if after < all && best.from <= 3 * MIN_INTERVAL_ROWS {
        out.push(after..all);
    }
    if after == last.end
        && let Some(first) = of(best.from).filter(|first| first.end < after)
    {
        out.push(best.from..first.end);
    }
    out.dedup();
    out.retain(|range| range.len() >= MIN_INTERVAL_ROWS || stations.len() == 1);
    out
}
