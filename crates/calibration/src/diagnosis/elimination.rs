//! Backward elimination of causes beside the discrepancy: the least significant cause that is no longer significant is removed and
//! the variances of the discrepancy are estimated again, until all remaining causes are significant.
//!
//! Each round has the parameters of the fit and the functions of the discrepancy, in units of their standard deviations, as
//! nuisance parameters. Their normal matrix follows from products that are computed once, so that a round takes small matrices and one product over
//! the rows, for the scatter of the residuals.

use nalgebra::{DMatrix, DVector};
use rayon::prelude::*;

use super::algebra::{back_and_forth, gram, lower_factor, product, product_of_transposed, solved};
use super::design::{Linear, removed_directions, side_by_side, units};
use super::discrepancy::{Discrepancy, Functions, typical_mm};
use super::products::{Products, Whitening};
use super::score::{Residuals, Score, is_scattered, log_p_of_pure, score_from};
use truegrind_math::work::checkpoint;

/// A cause to be tested.
pub struct Tested<'a> {
    /// Its columns over all rows, whitened as in the fit.
    pub columns: &'a DMatrix<f64>,
    /// Prior standard deviations of its parameters.
    pub sizes: Vec<f64>,
    /// Number of variants of it that were tried.
    pub tried: f64,
    /// Places of its parameters in the fit.
    pub parameters: Vec<usize>,
    /// Whether it is a shift, whose rows were searched.
    pub is_shift: bool,
}

/// What is significant.
#[derive(Debug, Clone, Copy)]
pub struct Criteria {
    /// Number of candidate families.
    pub families: f64,
    /// Largest p-value, corrected for trials.
    pub alpha: f64,
}

/// Significance of a cause with the discrepancy in the model.
#[derive(Debug, Clone, Copy)]
pub struct Significance {
    /// Evidence less 2 ln of the variants tried.
    pub merit: f64,
    /// Natural logarithm of the p-value, corrected for trials.
    pub log_p: f64,
    /// Whether that is small enough and the evidence positive.
    pub is_significant: bool,
}

/// What an elimination leaves.
pub struct Eliminated {
    /// Of each cause, removed or not, beside all that remain.
    pub significance: Vec<Significance>,
    /// The causes that were removed, in this order.
    pub removed: Vec<usize>,
    /// The discrepancy given the others.
    pub discrepancy: Discrepancy,
}

/// Eliminates some of the causes of a linearised fit; `numbers` are the row numbers of its observations.
pub fn eliminate(
    linear: &Linear,
    functions: &Functions,
    causes: &[Tested<'_>],
    numbers: &[usize],
    criteria: Criteria,
) -> Eliminated {
    let columns = causes.iter().map(|cause| cause.columns).collect();
    let mut whitening = Whitening::new(linear, &functions.columns, columns, numbers);
    let parameters = |which: &[usize]| -> Vec<usize> {
        which.iter().flat_map(|&k| causes[k].parameters.iter().copied()).collect()
    };
    let mut removed = excursions(functions, causes, &mut whitening, criteria);
    let mut discrepancy = Discrepancy::of(functions, &mut whitening, &parameters(&removed), None);
    loop {
        checkpoint();
        let round = Round::of(causes, whitening.at(discrepancy.correlation), &discrepancy);
        let significance = round.significance(&removed, criteria);
        let worst = (0..causes.len())
            .filter(|k| !removed.contains(k) && !significance[*k].is_significant)
            .max_by(|&a, &b| significance[a].log_p.total_cmp(&significance[b].log_p).then(b.cmp(&a)));
        let Some(worst) = worst else { return Eliminated { significance, removed, discrepancy } };
        removed.push(worst);
        discrepancy = Discrepancy::of(functions, &mut whitening, &parameters(&removed), Some(&discrepancy));
    }
}

/// Shifts that describe the excursions of correlated noise. With all of them in the model the noise that is left is white, however
/// correlated it is, so they must win together beside noise whose correlation is estimated without them. Where they lose, those remain that
/// are significant alone. Where smooth functions of time are larger than the noise, its correlation is what they leave of a
/// drift, which shifts may describe.
fn excursions(
    functions: &Functions,
    causes: &[Tested<'_>],
    whitening: &mut Whitening<'_>,
    criteria: Criteria,
) -> Vec<usize> {
    let shifts: Vec<usize> = (0..causes.len()).filter(|&k| causes[k].is_shift).collect();
    if shifts.is_empty() {
        return shifts;
    }
    let parameters: Vec<usize> = shifts.iter().flat_map(|&k| causes[k].parameters.iter().copied()).collect();
    let without = Discrepancy::of(functions, whitening, &parameters, None);
    let noise_mm = without.noise * typical_mm(whitening.linear);
    if without.correlation < CORRELATED_NOISE || without.time_mm() > DRIFT * noise_mm {
        return Vec::new();
    }
    let round = Round::of(causes, whitening.at(without.correlation), &without);
    if round.merit_together(&shifts) > 0.0 {
        return Vec::new();
    }
    let alone = round.significance(&shifts, criteria);
    shifts.into_iter().filter(|&k| !alone[k].is_significant).collect()
}

/// Lag-one correlation, given smooth functions of time, from which the noise itself is correlated, and unconfirmed shifts are its
/// excursions.
pub(super) const CORRELATED_NOISE: f64 = 0.3;

/// Size of the smooth functions of time, relative to the noise, from which they are a drift. Of 80 simulated series with a correlation above
/// that, autocorrelated noise had at most 2.04 in all but two and drifts at least 3.1.
const DRIFT: f64 = 2.0;

/// One round: the fit with all its parameters and the functions, at its optimum.
struct Round<'a> {
    causes: &'a [Tested<'a>],
    products: &'a Products,
    /// Standard deviation of the noise, in units of the whitened rows.
    noise: f64,
    /// Standard deviations of the functions in the model, with their places.
    terms: &'a [(usize, f64)],
    /// L of the normal matrix of all P nuisance parameters.
    lower: DMatrix<f64>,
    /// How they change from the estimate to the optimum, P.
    step: DVector<f64>,
    /// Their values there, P.
    x: DVector<f64>,
    /// The columns of causes along them, P × o: L⁻¹ of their products.
    shared: DMatrix<f64>,
    /// Gradient of the columns of causes at the optimum, o.
    gradient: DVector<f64>,
    /// L⁻¹ of the columns of the identity of each cause's parameters, P × k.
    units: Vec<DMatrix<f64>>,
}

/// A cause scored beside the others, as if it were not in the fit.
struct Beside {
    score: Score,
    /// What takes the columns of the cause, and the residual, off the rows of the round: P × (1 + k), the residual first.
    taken: DMatrix<f64>,
}

impl<'a> Round<'a> {
    fn of(causes: &'a [Tested<'a>], products: &'a Products, discrepancy: &'a Discrepancy) -> Self {
        let (noise, terms) = (discrepancy.noise, discrepancy.terms.as_slice());
        let linear = &products.linear;
        let (p, m) = (linear.x.len(), terms.len());
        let square = noise * noise;
        let size = |a: usize| terms[a - p].1;
        let place = |a: usize| terms[a - p].0;
        let normal = DMatrix::from_fn(p + m, p + m, |a, b| {
            let (a, b) = (a.min(b), a.max(b));
            let (mut product, prior) = if b < p {
                let prior = if a == b { linear.precision[a] } else { 0.0 };
                (linear.normal()[(a, b)] - prior, prior)
            } else if a < p {
                (size(b) * products.linear_functions[(a, place(b))], 0.0)
            } else {
                let prior = if a == b { 1.0 } else { 0.0 };
                (size(a) * size(b) * products.functions_functions[(place(a), place(b))], prior)
            };
            product /= square;
            product + prior
        });
        let lower = lower_factor(normal);
        let gradient = DVector::from_fn(p + m, |a, _| {
            if a < p {
                let prior = linear.precision[a] * linear.x[a];
                (linear.gradient[a] - prior) / square + prior
            } else {
                size(a) * products.functions_residual[place(a)] / square
            }
        });
        let step = back_and_forth(&lower, &gradient).map_or_else(|| DVector::zeros(p + m), |step| -step);
        let x = DVector::from_fn(p + m, |a, _| if a < p { linear.x[a] } else { 0.0 }) + &step;
        let o = products.own.ncols();
        let mut crossed = DMatrix::zeros(p + m, o);
        crossed.rows_mut(0, p).copy_from(&products.linear_own);
        for (a, (place, size)) in terms.iter().enumerate() {
            crossed.row_mut(p + a).copy_from(&(products.functions_own.row(*place) * *size));
        }
        crossed /= square;
        let gradient = &products.own_residual / square + crossed.tr_mul(&step);
        let shared = solved(&lower, crossed);
        let units = causes.par_iter().map(|cause| solved(&lower, units(p + m, &cause.parameters))).collect();
        Self { causes, products, noise, terms, lower, step, x, shared, gradient, units }
    }

    /// Significance of each cause without it and those that are removed.
    fn significance(&self, removed: &[usize], criteria: Criteria) -> Vec<Significance> {
        let causes = self.causes;
        let scored: Vec<Beside> =
            (0..causes.len()).into_par_iter().map(|k| self.beside(k, removed)).collect();
        let plain = scored.iter().zip(causes).map(|(beside, cause)| beside.score.plain_log_p(&cause.sizes));
        let mut log_p: Vec<f64> = plain.collect();
        let scattered: Vec<usize> =
            (0..causes.len()).filter(|&k| is_scattered(&causes[k].sizes, &scored[k].score)).collect();
        let found = self.scattered_log_p(&scored, &scattered);
        scattered.iter().zip(found).for_each(|(&k, found)| log_p[k] = found);
        let judged = log_p.into_iter().zip(&scored).zip(causes);
        judged
            .map(|((log_p, beside), cause)| {
                let merit = beside.score.merit;
                let log_p = (log_p + (cause.tried * criteria.families).ln()).min(0.0);
                let is_significant = merit > 0.0 && log_p <= criteria.alpha.ln();
                Significance { merit, log_p, is_significant }
            })
            .collect()
    }

    /// Evidence of some causes together beside all others, less 2 ln of the variants tried of each.
    fn merit_together(&self, which: &[usize]) -> f64 {
        let p = self.x.len();
        let places = which.iter().flat_map(|&k| &self.causes[k].parameters);
        let values: Vec<f64> = places.map(|&place| self.x[place]).collect();
        let z = side_by_side(which.iter().map(|&k| &self.units[k]), p);
        let (directions, moved) = removed_directions(&z, &DVector::from_vec(values));
        let columns: Vec<usize> = which.iter().flat_map(|&k| self.products.of_cause[k].clone()).collect();
        let shared = self.shared.select_columns(&columns);
        let back = product_of_transposed(&directions, &shared);
        let square = self.noise * self.noise;
        let own = self.products.own.select_columns(&columns);
        let information = gram(&own) / square - gram(&shared) + gram(&back);
        let mut gradient = self.gradient.select_rows(&columns);
        gradient.gemv_tr(-1.0, &back, &moved, 1.0);
        let sizes: Vec<f64> = which.iter().flat_map(|&k| self.causes[k].sizes.iter().copied()).collect();
        let trials: f64 = which.iter().map(|&k| 2.0 * self.causes[k].tried.ln()).sum();
        score_from((gradient, information), &sizes, 1.0).evidence - trials
    }

    /// A cause beside those that are not removed; the same as of [`FullDesign::without`](super::design::FullDesign::without).
    fn beside(&self, k: usize, removed: &[usize]) -> Beside {
        checkpoint();
        let dropped: Vec<usize> = removed.iter().copied().filter(|other| *other != k).chain([k]).collect();
        let p = self.x.len();
        let places = dropped.iter().flat_map(|&k| &self.causes[k].parameters);
        let values: Vec<f64> = places.map(|&place| self.x[place]).collect();
        let z = side_by_side(dropped.iter().map(|&k| &self.units[k]), p);
        let (directions, moved) = removed_directions(&z, &DVector::from_vec(values));
        let range = &self.products.of_cause[k];
        let mut shared = self.shared.columns(range.start, range.len()).into_owned();
        let back = product_of_transposed(&directions, &shared);
        let square = self.noise * self.noise;
        let information = &self.products.own_own[k] / square - gram(&shared) + gram(&back);
        let mut gradient = self.gradient.rows(range.start, range.len()).into_owned();
        gradient.gemv_tr(-1.0, &back, &moved, 1.0);
        let Tested { sizes, tried, .. } = &self.causes[k];
        let score = score_from((gradient, information), sizes, *tried);
        shared -= product(&directions, &back);
        let mut taken = DMatrix::zeros(p, 1 + range.len());
        taken.column_mut(0).copy_from(&(&directions * &moved));
        taken.columns_mut(1, range.len()).copy_from(&shared);
        Beside { score, taken }
    }

    /// Natural logarithms of the p-values of some causes by the scatter of the residuals, with one product over the rows.
    fn scattered_log_p(&self, scored: &[Beside], which: &[usize]) -> Vec<f64> {
        let (products, linear) = (self.products, &self.products.linear);
        let (p, m) = (linear.x.len(), products.functions.ncols());
        let count: usize = which.iter().map(|&k| scored[k].taken.ncols()).sum();
        let (mut of_linear, mut of_functions) = (DMatrix::zeros(p, count), DMatrix::zeros(m, count));
        let mut column = 0;
        for &k in which {
            for (c, taken) in scored[k].taken.column_iter().enumerate() {
                let change = self.lower.tr_solve_lower_triangular(&taken);
                let mut change = change.unwrap_or_else(|| DVector::zeros(self.x.len()));
                if c == 0 {
                    change -= &self.step;
                }
                of_linear.column_mut(column).copy_from(&change.rows(0, p));
                for (a, (place, size)) in self.terms.iter().enumerate() {
                    of_functions[(*place, column)] = size * change[p + a];
                }
                column += 1;
            }
        }
        let mut taken = product_of_transposed(&linear.rows, &of_linear);
        taken += product(&products.functions, &of_functions);
        let firsts: Vec<(usize, usize)> = which
            .iter()
            .scan(0, |first, &k| {
                *first += scored[k].taken.ncols();
                Some((k, *first - scored[k].taken.ncols()))
            })
            .collect();
        firsts
            .into_par_iter()
            .map(|(k, first)| {
                let range = &products.of_cause[k];
                let values = (&linear.residual - taken.column(first)) / self.noise;
                let columns = products.own.columns(range.start, range.len());
                let pure = (columns - taken.columns(first + 1, range.len())) / self.noise;
                let residuals = Residuals { values: &values, poses: &linear.slopes.poses, per: linear.per };
                log_p_of_pure(&residuals, pure, &scored[k].score, &self.causes[k].sizes)
            })
            .collect()
    }
}
