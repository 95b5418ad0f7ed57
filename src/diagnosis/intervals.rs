//! From which row to which: change points of a shift, found by scanning.
//!
//! Prefix sums of gradient, information and Q-products over the observations make the evidence of any interval a matter of
//! p k² operations, so thousands of intervals are tried: a coarse grid of starts and ends, then the best ones refined row by
//! row. An interval that begins with the first rows is the same as its complement, and only the later one is told: what
//! happened, happened at its first row. Source: the likelihood-ratio scan of circular binary segmentation, Olshen et al.
//! 2004, with nuisance parameters projected off.

use nalgebra::DMatrix;
use rayon::prelude::*;

use super::design::Design;

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

/// Shortest interval: fewer rows are outliers, not a shift.
pub const SHORTEST: usize = 4;

/// Starts and ends on the coarse grid.
const GRID: usize = 96;

/// Most parameters of a shift.
const MOST: usize = 6;

/// Scalar product in eight partial sums, which the compiler can keep side by side.
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

/// Prefix sums over observations.
struct Sums {
    k: usize,
    p: usize,
    gradient: Vec<f64>,
    square: Vec<f64>,
    shared: Vec<f64>,
}

impl Sums {
    fn of(design: &Design, columns: &DMatrix<f64>, sizes: &[f64]) -> Self {
        let (n, per, p, k) = (design.observations, design.per, design.basis.nrows(), columns.ncols());
        let mut out = Self {
            k,
            p,
            gradient: vec![0.0; (n + 1) * k],
            square: vec![0.0; (n + 1) * k * k],
            shared: vec![0.0; (n + 1) * k * p],
        };
        for i in 0..n {
            for a in 0..k {
                let column = |s: usize, a: usize| columns[(s, a)] * sizes[a];
                let scalars = i * per..(i + 1) * per;
                let g: f64 = scalars.clone().map(|s| column(s, a) * design.residual[s]).sum();
                out.gradient[(i + 1) * k + a] = out.gradient[i * k + a] + g;
                for b in 0..k {
                    let c: f64 = scalars.clone().map(|s| column(s, a) * column(s, b)).sum();
                    out.square[((i + 1) * k + a) * k + b] = out.square[(i * k + a) * k + b] + c;
                }
                let (before, after) = out.shared.split_at_mut(((i + 1) * k + a) * p);
                let last = &before[(i * k + a) * p..][..p];
                after[..p].copy_from_slice(last);
                for s in scalars {
                    let c = column(s, a);
                    if c != 0.0 {
                        for (to, q) in after[..p].iter_mut().zip(design.basis.column(s).iter()) {
                            *to += c * q;
                        }
                    }
                }
            }
        }
        out
    }

    /// Evidence of observations from..=to.
    fn evidence(&self, from: usize, to: usize, work: &mut Vec<f64>) -> f64 {
        let (k, p) = (self.k, self.p);
        work.resize(k * p, 0.0);
        let (low, high) = (from * k, (to + 1) * k);
        for a in 0..k {
            let (l, h) = (&self.shared[(low + a) * p..][..p], &self.shared[(high + a) * p..][..p]);
            for (w, (h, l)) in work[a * p..][..p].iter_mut().zip(h.iter().zip(l)) {
                *w = h - l;
            }
        }
        if k == 1 {
            let g = self.gradient[high] - self.gradient[low];
            let s = (self.square[high] - self.square[low] - dot(work, work)).max(0.0);
            return g * g / (s + 1.0) - (1.0 + s).ln();
        }
        // S + I = L Lᵀ and L y = g on the stack: the gain is yᵀy.
        let (mut l, mut y, mut log_det) = ([0.0; MOST * MOST], [0.0; MOST], 0.0);
        for a in 0..k {
            for b in 0..=a {
                let mut sum = self.square[(high + a) * k + b]
                    - self.square[(low + a) * k + b]
                    - dot(&work[a * p..][..p], &work[b * p..][..p])
                    + f64::from(u8::from(a == b));
                for c in 0..b {
                    sum -= l[a * MOST + c] * l[b * MOST + c];
                }
                if a == b {
                    if !(sum > 0.0) {
                        return f64::NEG_INFINITY;
                    }
                    log_det += sum.ln();
                    l[a * MOST + a] = sum.sqrt();
                } else {
                    l[a * MOST + b] = sum / l[b * MOST + b];
                }
            }
            let mut sum = self.gradient[high + a] - self.gradient[low + a];
            for c in 0..a {
                sum -= l[a * MOST + c] * y[c];
            }
            y[a] = sum / l[a * MOST + a];
        }
        dot(&y, &y) - log_det
    }
}

/// The best intervals of columns that are given for all rows, best first: at most `count`, none of which shares most of
/// its rows with a better one.
pub fn scan(design: &Design, columns: &DMatrix<f64>, sizes: &[f64], count: usize) -> Vec<Interval> {
    let n = design.observations;
    if n < 3 * SHORTEST || columns.ncols() > MOST {
        return Vec::new();
    }
    let sums = Sums::of(design, columns, sizes);
    let stride = n.div_ceil(GRID).max(1);
    let starts: Vec<usize> = (SHORTEST..n - 1).step_by(stride).collect();
    let mut coarse: Vec<Interval> = starts
        .par_iter()
        .map(|&from| {
            let mut work = Vec::new();
            let mut found = Vec::new();
            let ends = (from + SHORTEST - 1..n - 1).step_by(stride).chain(std::iter::once(n - 1));
            for to in ends.filter(|&to| to + 1 >= from + SHORTEST && ends_well(to, n)) {
                found.push(Interval { from, to, evidence: sums.evidence(from, to, &mut work) });
            }
            found
        })
        .collect::<Vec<_>>()
        .concat();
    coarse.sort_by(|a, b| b.evidence.total_cmp(&a.evidence).then(a.from.cmp(&b.from)).then(a.to.cmp(&b.to)));
    let mut best: Vec<Interval> = Vec::new();
    for interval in coarse {
        if best.len() >= count {
            break;
        }
        if best.iter().all(|b| overlap(b, &interval) < 0.5) {
            best.push(refined(&sums, interval, stride, n));
        }
    }
    best
}

/// A shift ends with the last row, or leaves enough rows after it to be told from one that does.
fn ends_well(to: usize, n: usize) -> bool {
    to == n - 1 || to + SHORTEST < n
}

/// Shared rows over all rows of two intervals.
fn overlap(a: &Interval, b: &Interval) -> f64 {
    let shared = (a.to.min(b.to) + 1).saturating_sub(a.from.max(b.from)) as f64;
    let all = (a.to.max(b.to) + 1 - a.from.min(b.from)) as f64;
    shared / all
}

/// Moves one end at a time within the grid's spacing, until neither helps.
fn refined(sums: &Sums, mut best: Interval, stride: usize, n: usize) -> Interval {
    let mut work = Vec::new();
    for _ in 0..6 {
        let before = best;
        for from in best.from.saturating_sub(2 * stride).max(SHORTEST)..=(best.from + 2 * stride).min(n - 2) {
            if from + SHORTEST <= best.to + 1 {
                let evidence = sums.evidence(from, best.to, &mut work);
                if evidence > best.evidence {
                    best = Interval { from, evidence, ..best };
                }
            }
        }
        for to in best.to.saturating_sub(2 * stride)..=(best.to + 2 * stride).min(n - 1) {
            if best.from + SHORTEST <= to + 1 && ends_well(to, n) {
                let evidence = sums.evidence(best.from, to, &mut work);
                if evidence > best.evidence {
                    best = Interval { to, evidence, ..best };
                }
            }
        }
        if best == before {
            break;
        }
    }
    best
}
