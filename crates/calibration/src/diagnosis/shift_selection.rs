//! Shifts searched again in each fold: the held-out error that includes the choice of their rows.
//!
//! The rows of a shift are searched, so a row helps to choose the shift that judges it. Drift that is met by steps, and error outside the
//! catalogue, then look explained also on rows whose values no fit used. Here the shifts of the model are dropped; on the other rows of each
//! fold they are searched again, of the same kinds, as long as they are supported, to first order and with all else refitted: from none
//! and from those found, of which the one wins that describes these other rows better. The difference to the same folds with the shifts
//! as found is what their choice adds to the mean square error.
//!
//! Source: Varma and Simon 2006 (bias of cross-validation without the selection, nested cross-validation).

use nalgebra::{DMatrix, DVector};
use rayon::prelude::*;

use super::algebra::picked_rows;
use super::catalogue::Candidate;
use super::cause::Cause;
use super::design::{Design, Linear};
use super::extension::{Extended, Subject};
use super::intervals::{ShiftScan, tried};
use crate::measurement::sensor::disturbance::{Disturbance, Kind, Profile};
use crate::measurement::split::Split;
use truegrind_math::work::checkpoint;

/// A kind of shift over all rows.
struct Shift {
    /// In units of their sizes.
    columns: DMatrix<f64>,
    /// For a scan: 1.
    sizes: Vec<f64>,
}

/// What the choice of the rows of its shifts adds to the held-out mean square error of a fit (mm²), over the random folds `splits`
/// and without the observations in `set_aside`; 0 without shifts. `linear` is the linearised fit, `raw` its design.
pub(super) fn added_mm2(
    subject: &Subject<'_>,
    found: &Extended,
    (linear, raw): (&Linear, &Design),
    splits: &[Split],
    set_aside: &[usize],
) -> f64 {
    let places: Vec<usize> = (0..found.causes.len()).filter(|&k| found.causes[k].rows().is_some()).collect();
    if places.is_empty() {
        return 0.0;
    }
    let mut kinds: Vec<&Kind> = Vec::new();
    for &k in &places {
        if let Cause::Measurement(Disturbance { kind, .. }) = &found.causes[k]
            && !kinds.contains(&kind)
        {
            kinds.push(kind);
        }
    }
    let shifts: Vec<Shift> = kinds
        .iter()
        .map(|kind| {
            let always = Cause::Measurement(Disturbance::new((*kind).clone(), Profile::Constant));
            let mut columns = Candidate::of(&always, subject).columns(raw);
            let sizes = always.sizes();
            columns.column_iter_mut().zip(&sizes).for_each(|(mut column, size)| column *= *size);
            Shift { columns, sizes: vec![1.0; sizes.len()] }
        })
        .collect();
    let rows = &subject.observed.dataset.rows;
    let found_shifts: Vec<Chosen> = places
        .iter()
        .filter_map(|&k| {
            let Cause::Measurement(Disturbance { kind, .. }) = &found.causes[k] else { return None };
            let [from, to] = found.causes[k].rows()?;
            let inside = |i: &usize| (from..=to).contains(&rows[*i].number);
            let first = (0..rows.len()).find(inside)?;
            let last = (0..rows.len()).rfind(inside)?;
            Some((kinds.iter().position(|known| *known == kind)?, first, last))
        })
        .collect();
    let parameters: Vec<usize> = places.iter().flat_map(|&k| found.parameter_indices(k)).collect();
    let base = linear.reduced(&parameters);
    let added: Vec<[f64; 2]> = splits
        .par_iter()
        .map(|split| {
            let test: Vec<usize> = split.test.iter().copied().filter(|i| !set_aside.contains(i)).collect();
            let again = Fold::of(&base, &shifts, &split.train).searched(&found_shifts);
            let square = again.held_out_mm2(&split.train, &test) - linear.held_out_mm2(&split.train, &test);
            [square, test.len() as f64]
        })
        .collect();
    let [square, count] = added.iter().fold([0.0, 0.0], |sum, fold| [sum[0] + fold[0], sum[1] + fold[1]]);
    square / count.max(1.0)
}

/// A shift: its kind, first and last observation.
type Chosen = (usize, usize, usize);

/// The rows of a fold that are not held out.
struct Fold<'a> {
    base: &'a Linear,
    shifts: &'a [Shift],
    train: &'a [usize],
    /// The columns of each kind in these rows.
    columns: Vec<DMatrix<f64>>,
    /// The design without shifts.
    plain: Design,
    /// Twice the logarithm of the number of intervals.
    bar: f64,
}

impl<'a> Fold<'a> {
    fn of(base: &'a Linear, shifts: &'a [Shift], train: &'a [usize]) -> Self {
        let columns = shifts.iter().map(|shift| picked_rows(&shift.columns, train, base.per)).collect();
        let plain = base.part(train).whole().design;
        Self { base, shifts, train, columns, plain, bar: 2.0 * tried(train.len() as f64).ln() }
    }

    /// The fit with the shifts that describe these rows best. `found` are those of all rows.
    fn searched(&self, found: &[Chosen]) -> Linear {
        let here = |i: usize| self.train.partition_point(|&row| row < i);
        let known = found.iter().filter_map(|&(kind, from, to)| {
            let (first, end) = (here(from), here(to + 1));
            (first < end).then(|| (kind, first, end - 1))
        });
        let [anew, near] = [Vec::new(), known.collect()].map(|start| self.improved(start, 2 * found.len()));
        let best = if self.criterion(&near) <= self.criterion(&anew) { near } else { anew };
        let of_all = best.iter().map(|&(kind, from, to)| {
            within(&self.shifts[kind].columns, self.base.per, self.train[from], self.train[to])
        });
        of_all.fold(self.base.clone(), |fit, columns| fit.with_random_effects(&columns))
    }

    /// Adds shifts one by one, searches each again beside the others, and adds further ones, `most` in all.
    fn improved(&self, start: Vec<Chosen>, most: usize) -> Vec<Chosen> {
        let mut chosen = self.extended(start, most);
        for first in chosen.clone() {
            checkpoint();
            let others: Vec<Chosen> = chosen.iter().copied().filter(|shift| *shift != first).collect();
            let again = self.best(&self.beside(&others));
            chosen = others.into_iter().chain(again).collect();
        }
        self.extended(chosen, most)
    }

    fn extended(&self, mut chosen: Vec<Chosen>, most: usize) -> Vec<Chosen> {
        let mut design = self.beside(&chosen);
        while chosen.len() < most
            && let Some(next) = self.best(&design)
        {
            checkpoint();
            design = design.with_random_effects(&self.columns_of(&next));
            chosen.push(next);
        }
        chosen
    }

    /// The best further shift, if it is supported.
    fn best(&self, design: &Design) -> Option<Chosen> {
        let scanned =
            self.columns.iter().zip(self.shifts).enumerate().filter_map(|(kind, (columns, shift))| {
                let scan = ShiftScan::of(design, columns, &shift.sizes)?;
                Some((kind, *scan.scan(design, 1).first()?))
            });
        let best = scanned.max_by(|a, b| a.1.evidence.total_cmp(&b.1.evidence));
        best.filter(|(_, interval)| interval.evidence > self.bar).map(|(kind, i)| (kind, i.from, i.to))
    }

    fn columns_of(&self, &(kind, from, to): &Chosen) -> DMatrix<f64> {
        within(&self.columns[kind], self.base.per, from, to)
    }

    fn beside(&self, chosen: &[Chosen]) -> Design {
        chosen
            .iter()
            .fold(self.plain.clone(), |design, shift| design.with_random_effects(&self.columns_of(shift)))
    }

    /// χ² and, as in a search, a penalty for each parameter and each interval.
    fn criterion(&self, chosen: &[Chosen]) -> f64 {
        let rows = self.plain.residual.len() as f64;
        let penalty = |&(kind, ..): &Chosen| self.columns[kind].ncols() as f64 * rows.ln() + self.bar;
        self.beside(chosen).residual.norm_squared() + chosen.iter().map(penalty).sum::<f64>()
    }
}

/// Columns of a shift in the observations `from` to `to`.
fn within(columns: &DMatrix<f64>, per: usize, from: usize, to: usize) -> DMatrix<f64> {
    let mut out = DMatrix::zeros(columns.nrows(), columns.ncols());
    let (first, count) = (from * per, (to + 1 - from) * per);
    out.rows_mut(first, count).copy_from(&columns.rows(first, count));
    out
}

impl Linear {
    /// Sum of squares of the position errors (mm²) at the observations `test`, fitted to `train` to first order.
    fn held_out_mm2(&self, train: &[usize], test: &[usize]) -> f64 {
        let step: DVector<f64> = self.part(train).whole().optimum() - DVector::from_column_slice(&self.x);
        let error = |s: usize| (self.residual[s] + self.rows.column(s).dot(&step)) * self.slopes.mm[s];
        let scalars = test.iter().flat_map(|&i| i * self.per..(i + 1) * self.per);
        scalars.filter(|&s| self.slopes.mm[s] > 0.0).map(|s| error(s).powi(2)).sum()
    }
}
