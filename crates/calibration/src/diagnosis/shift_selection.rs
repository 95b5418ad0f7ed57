//! Shifts searched again in each fold: the held-out error that includes the choice of their rows.
//!
//! The rows of a shift are searched, so a row helps to choose the shift that judges it. Drift that is met by steps, and error outside the
//! catalogue, then look explained also on rows whose values no fit used. Here the shifts of the model are dropped; on the other rows of each
//! fold they are searched again, of the same kinds, as long as they are supported, to first order and with all else refitted. The difference to the same folds with the shifts as found is what their choice adds to the mean square error.
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
        .into_iter()
        .map(|kind| {
            let always = Cause::Measurement(Disturbance::new(kind.clone(), Profile::Constant));
            let mut columns = Candidate::of(&always, subject).columns(raw);
            let sizes = always.sizes();
            columns.column_iter_mut().zip(&sizes).for_each(|(mut column, size)| column *= *size);
            Shift { columns, sizes: vec![1.0; sizes.len()] }
        })
        .collect();
    let parameters: Vec<usize> = places.iter().flat_map(|&k| found.parameter_indices(k)).collect();
    let base = linear.reduced(&parameters);
    let added: Vec<[f64; 2]> = splits
        .par_iter()
        .map(|split| {
            let test: Vec<usize> = split.test.iter().copied().filter(|i| !set_aside.contains(i)).collect();
            let again = searched(&base, &shifts, &split.train, places.len());
            let square = again.held_out_mm2(&split.train, &test) - linear.held_out_mm2(&split.train, &test);
            [square, test.len() as f64]
        })
        .collect();
    let [square, count] = added.iter().fold([0.0, 0.0], |sum, fold| [sum[0] + fold[0], sum[1] + fold[1]]);
    square / count.max(1.0)
}

/// A shift in some of the rows of a fold: its kind, first and last row.
type Chosen = (usize, usize, usize);

/// The fit with shifts that are searched in the rows `train`: one after the other, then each again beside the others, then further ones.
/// There can be twice as many as were found, since a search one by one needs more.
fn searched(base: &Linear, shifts: &[Shift], train: &[usize], found: usize) -> Linear {
    let whole = base.part(train).whole().design;
    let of_train: Vec<DMatrix<f64>> =
        shifts.iter().map(|shift| picked_rows(&shift.columns, train, base.per)).collect();
    let columns = |&(kind, from, to): &Chosen| within(&of_train[kind], base.per, from, to);
    let bar = 2.0 * tried(train.len() as f64).ln();
    let best = |design: &Design| {
        let scanned = of_train.iter().zip(shifts).enumerate().filter_map(|(kind, (columns, shift))| {
            let scan = ShiftScan::of(design, columns, &shift.sizes)?;
            Some((kind, *scan.scan(design, 1).first()?))
        });
        let best = scanned.max_by(|a, b| a.1.evidence.total_cmp(&b.1.evidence));
        best.filter(|(_, interval)| interval.evidence > bar).map(|(kind, i)| (kind, i.from, i.to))
    };
    let beside = |chosen: &[Chosen]| {
        chosen.iter().fold(whole.clone(), |design, shift| design.with_random_effects(&columns(shift)))
    };
    let mut chosen: Vec<Chosen> = Vec::new();
    let further = |chosen: &mut Vec<Chosen>| {
        let mut design = beside(chosen);
        while chosen.len() < 2 * found
            && let Some(next) = best(&design)
        {
            checkpoint();
            design = design.with_random_effects(&columns(&next));
            chosen.push(next);
        }
    };
    further(&mut chosen);
    for first in chosen.clone() {
        let others: Vec<Chosen> = chosen.iter().copied().filter(|shift| *shift != first).collect();
        let again = best(&beside(&others));
        chosen = others.into_iter().chain(again).collect();
    }
    further(&mut chosen);
    let effects = chosen
        .iter()
        .map(|&(kind, from, to)| within(&shifts[kind].columns, base.per, train[from], train[to]));
    effects.fold(base.clone(), |fit, columns| fit.with_random_effects(&columns))
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
