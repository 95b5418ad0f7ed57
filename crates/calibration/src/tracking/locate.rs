//! Change localisation by generalised likelihood ratios: which parameter changed, since which pose, as a jump or a drift.
//!
//! **Method.** For every parameter k and every pose s of the history, the generalised likelihood ratio (Willsky and Jones
//! 1976) of a change of k from s on, given the filter's state before the history: a *jump* is constant from s on, a *drift*
//! grows by the same amount with each pose. With Jᵢ and rᵢ of pose i at the state before the history, P its covariance
//! and weights wᵢ (jump 1, drift i − s + 1): B = Σ wᵢ JᵢᵀJᵢ, D = Σ wᵢ² JᵢᵀJᵢ, h = Σ wᵢ Jᵢᵀrᵢ over i ≥ s, A and g the sums
//! over all poses with weight 1, and M = (P⁻¹ + A)⁻¹:
//! ratio = (h(k) − B(:,k)ᵀ M g)² / (D(k,k) − B(:,k)ᵀ M B(:,k)), exact for rows of unit noise.
//!
//! Parameters that move together, such as the six of a knocked sensor, form a group: with l and S the vector and matrix of the
//! same expressions, ratio = lᵀ (S + Λ⁻¹)⁻¹ l, Λ the prior covariance of the displacement. A group is preferred to the best
//! single parameter where its [`surprisal`] is larger by [`GROUP_MARGIN`]: unmodelled effects are smooth in the joints, and six
//! parameters follow them where one cannot. But what a group does by itself is the group: a reflector that was exchanged or bumped moves
//! the readings exactly as a bend of the last link, which it is fixed to. By their size the two are not alike: reflectors move by
//! millimetres, links do not bend by degrees. Such parameters ([`Group::covers`]) are rivals at most.
//!
//! The sums of a drift are sums of those of a jump: B_s = B_{s+1} + A_s, and Σ w² = 2 Σ w(w + 1)/2 − Σ w. With CCᵀ = P⁻¹ + A
//! the product C⁻¹B is accumulated instead of B, since B(:,k)ᵀ M B(:,l) is the product of its columns k and l: a pose costs
//! its rows times p², and p³ is spent only once.
//!
//! **Shapes.** n poses of m rows, p parameters: J is nm × p, column-major. n m p² + p³ operations.
//!
//! **Source and departures.** Willsky and Jones, "A generalized likelihood ratio approach to the detection and estimation
//! of jumps in linear systems", IEEE TAC 21, 1976, extended by the drift.
//!
//! **Checked against** least squares with the change as an additional parameter.

use super::alarm::Mount;
use nalgebra::{Cholesky, DMatrix, DVector, Dyn};
use truegrind_math::distribution::ln_gamma;

/// Ratios within this of the largest are alternatives: e^−2 of its likelihood.
pub const ALTERNATIVE_MARGIN: f64 = 4.0;

/// A group is preferred to a single parameter where its surprisal is larger by the first number, and by the second as a share
/// of the parameter's ratio.
pub const GROUP_MARGIN: (f64, f64) = (30.0, 0.25);

/// How a parameter changes from a pose on.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Form {
    /// Constant from the first changed pose on.
    Jump,
    /// Growing by the same amount with each pose.
    Drift,
}

/// A change of one parameter.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Change {
    /// Index of the parameter.
    pub parameter: usize,
    /// First changed pose.
    pub since: usize,
    /// How it changes.
    pub form: Form,
    /// Size of the change; of a drift, at the last pose.
    pub shift: f64,
    /// Standard deviation of that.
    pub sigma: f64,
    /// Likelihood ratio: χ² with one degree of freedom if nothing had moved.
    pub ratio: f64,
}

/// Ratios that differ by less than this share differ by rounding.
const TIE: f64 = 1e-6;

impl Change {
    /// Whether two changes explain the history exactly alike.
    pub fn is_tied_with(&self, other: &Change) -> bool {
        (self.ratio - other.ratio).abs() <= TIE * self.ratio.max(other.ratio)
    }
}

/// Parameters that can move together, each with its prior standard deviation.
#[derive(Debug, Clone, PartialEq)]
pub struct Group {
    /// What they place.
    pub mount: Mount,
    /// Index and prior standard deviation of each parameter.
    pub members: Vec<(usize, f64)>,
    /// Parameters that move the readings only as the members together can, each with the largest size that is a likely rival.
    pub covers: Vec<(usize, f64)>,
}

impl Group {
    /// Whether the group does all that a parameter does.
    fn does_all_of(&self, parameter: usize) -> bool {
        !self.covers.is_empty()
            && (self.is_member(parameter) || self.covers.iter().any(|(k, _)| *k == parameter))
    }

    fn is_member(&self, parameter: usize) -> bool {
        self.members.iter().any(|(k, _)| *k == parameter)
    }
}

/// Several parameters that jumped at once.
#[derive(Debug, Clone, PartialEq)]
pub struct GroupChange {
    /// Index of the group.
    pub group: usize,
    /// First changed pose.
    pub since: usize,
    /// Size of each member's jump, in the order of the group.
    pub shifts: Vec<f64>,
    /// Covariance of these.
    pub covariance: DMatrix<f64>,
    /// Likelihood ratio: χ² with as many degrees of freedom as there are members if nothing had moved.
    pub ratio: f64,
}

/// −2 ln of the probability that χ² with `freedom` degrees of freedom exceeds `ratio`, asymptotically for large ratios: makes
/// changes of one parameter and of several comparable.
pub fn surprisal(freedom: usize, ratio: f64) -> f64 {
    let half = (ratio / 2.0).max(1.0).ln();
    ratio - (freedom as f64 - 2.0) * half + 2.0 * ln_gamma(0.5 * freedom.max(1) as f64)
}

/// The change that explains the history best, and its alternatives.
#[derive(Debug, Clone, PartialEq)]
pub struct Explanation {
    /// The best.
    pub best: Change,
    /// The other form of the same parameter, where it explains the history nearly as well.
    pub other_form: Option<Change>,
    /// Other parameters that explain the history nearly as well, each at its best.
    pub alternatives: Vec<Change>,
    /// A group that explains it far better than any single parameter.
    pub together: Option<GroupChange>,
    /// A group that explains it about as well as the best single parameter, or better, but not clearly.
    pub nearly: Option<usize>,
}

/// The linearised history: `j` and `r` are Jacobian and residuals with `per` rows for each pose.
struct History {
    per: usize,
    j: DMatrix<f64>,
    r: DVector<f64>,
    /// L⁻¹Jᵀ, with LLᵀ the information of the filter and all poses.
    whitened: DMatrix<f64>,
    /// J M g: the residuals explained without a change.
    explained: DVector<f64>,
}

/// Sums from the last pose back to pose s: of a jump (weights 1) and a drift (weights 1, 2, …) from s on.
struct Sums {
    jump: DMatrix<f64>,
    of_jump: DMatrix<f64>,
    of_drift: DMatrix<f64>,
    jump_cross: DVector<f64>,
    drift_cross: DVector<f64>,
    jump_gradient: DVector<f64>,
    drift_gradient: DVector<f64>,
    drift_square: DVector<f64>,
    /// Σ w(w + 1)/2 on the diagonal.
    triangle: DVector<f64>,
}

impl Sums {
    fn new(p: usize) -> Self {
        let (square, column) = (DMatrix::zeros(p, p), DVector::zeros(p));
        Self {
            jump: square.clone(),
            of_jump: square.clone(),
            of_drift: square,
            jump_cross: column.clone(),
            drift_cross: column.clone(),
            jump_gradient: column.clone(),
            drift_gradient: column.clone(),
            drift_square: column.clone(),
            triangle: column,
        }
    }

    /// Adds the preceding pose.
    fn add(&mut self, history: &History, since: usize) {
        let History { per, j, r, whitened, explained } = history;
        let rows = j.rows(since * per, *per);
        self.jump.gemm_tr(1.0, &rows, &rows, 1.0);
        self.of_jump.gemm(1.0, &whitened.columns(since * per, *per), &rows, 1.0);
        self.of_drift += &self.of_jump;
        self.jump_gradient.gemv_tr(1.0, &rows, &r.rows(since * per, *per), 1.0);
        self.drift_gradient += &self.jump_gradient;
        self.jump_cross.gemv_tr(1.0, &rows, &explained.rows(since * per, *per), 1.0);
        self.drift_cross += &self.jump_cross;
        self.drift_square += self.jump.diagonal();
        self.triangle += &self.drift_square;
    }

    /// Estimated jump of a group, the Cholesky factor of its information, and the likelihood ratio.
    fn together(&self, group: &Group) -> Option<(DVector<f64>, Cholesky<f64, Dyn>, f64)> {
        let at = |a: usize| group.members[a].0;
        let d = group.members.len();
        let left = DVector::from_fn(d, |a, _| self.jump_gradient[at(a)] - self.jump_cross[at(a)]);
        let information = DMatrix::from_fn(d, d, |a, b| {
            let own = if a == b { 1.0 / (group.members[a].1 * group.members[a].1) } else { 0.0 };
            self.jump[(at(a), at(b))] - self.of_jump.column(at(a)).dot(&self.of_jump.column(at(b))) + own
        });
        let factor = information.cholesky()?;
        let shifts = factor.solve(&left);
        let ratio = left.dot(&shifts);
        Some((shifts, factor, ratio))
    }

    /// Estimated change of parameter `k` over the last `poses`, its standard deviation and likelihood ratio.
    fn change(&self, k: usize, form: Form, poses: usize) -> Option<(f64, f64, f64)> {
        let (left, square, own, far) = match form {
            Form::Jump => (
                self.jump_gradient[k] - self.jump_cross[k],
                self.jump[(k, k)],
                self.of_jump.column(k).norm_squared(),
                1.0,
            ),
            Form::Drift => (
                self.drift_gradient[k] - self.drift_cross[k],
                2.0 * self.triangle[k] - self.drift_square[k],
                self.of_drift.column(k).norm_squared(),
                poses as f64,
            ),
        };
        let seen = square - own;
        // A change that the history hardly determines is skipped.
        (seen > 1e-9 * square).then(|| (-left / seen * far, far / seen.sqrt(), left * left / seen))
    }
}

/// Searches the first `tracked` parameters, all poses and forms; parameters beyond them are estimated and do not change. `residuals` and
/// `jacobian` (column-major) have `per` rows for each pose, at the state with covariance `covariance`; `groups` can move together. `None` where the covariance is not positive definite or no
/// change is determined.
pub fn locate(
    residuals: &[f64],
    jacobian: &[f64],
    per: usize,
    covariance: &DMatrix<f64>,
    tracked: usize,
    groups: &[Group],
) -> Option<Explanation> {
    let (p, n) = (covariance.nrows(), residuals.len() / per.max(1));
    let j = DMatrix::from_column_slice(n * per, p, jacobian);
    let r = DVector::from_column_slice(residuals);
    let whole = j.tr_mul(&j);
    let factor = (covariance.clone().cholesky()?.inverse() + whole).cholesky()?;
    let mg = factor.solve(&j.tr_mul(&r));
    let whitened = factor.l_dirty().solve_lower_triangular(&j.transpose())?;
    let explained = &j * &mg;
    let history = History { per, j, r, whitened, explained };
    let mut best: Vec<[Option<Change>; 2]> = vec![[None; 2]; tracked];
    let mut together: Vec<Option<GroupChange>> = vec![None; groups.len()];
    let mut sums = Sums::new(p);
    for since in (0..n).rev() {
        sums.add(&history, since);
        for (index, group) in groups.iter().enumerate() {
            let Some((shifts, factor, ratio)) = sums.together(group) else { continue };
            // All have as many degrees of freedom: the largest ratio is the least probable one.
            if together[index].as_ref().is_none_or(|t| ratio > t.ratio) {
                let shifts = shifts.iter().map(|s| -s).collect();
                together[index] =
                    Some(GroupChange { group: index, since, shifts, covariance: factor.inverse(), ratio });
            }
        }
        for (parameter, best) in best.iter_mut().enumerate() {
            for form in [Form::Jump, Form::Drift] {
                // With one pose both forms are the same.
                if form == Form::Drift && since + 1 == n {
                    continue;
                }
                let Some((shift, sigma, ratio)) = sums.change(parameter, form, n - since) else { continue };
                let slot = &mut best[form as usize];
                if slot.is_none_or(|b| ratio > b.ratio) {
                    *slot = Some(Change { parameter, since, form, shift, sigma, ratio });
                }
            }
        }
    }
    compare_changes(&best, &together, groups)
}

/// Selects the best change and its alternatives from the best of each parameter, form and group.
fn compare_changes(
    best: &[[Option<Change>; 2]],
    together: &[Option<GroupChange>],
    groups: &[Group],
) -> Option<Explanation> {
    let better = |[a, b]: &[Option<Change>; 2]| match (a, b) {
        (Some(a), Some(b)) => Some(if b.ratio > a.ratio { *b } else { *a }),
        (a, b) => a.or(*b),
    };
    let mut all: Vec<Change> = best.iter().filter_map(better).collect();
    all.sort_by(|a, b| b.ratio.total_cmp(&a.ratio).then(a.parameter.cmp(&b.parameter)));
    // A mast of the sensor that sinks and a base that rises move the readings exactly alike: the last, which is not of the arm, is meant.
    let tied = all.iter().take_while(|change| change.is_tied_with(&all[0])).enumerate();
    if let Some((at, _)) = tied.max_by_key(|(_, change)| change.parameter) {
        all[..=at].rotate_right(1);
    }
    let gain = |t: &GroupChange| surprisal(groups[t.group].members.len(), t.ratio);
    let covering = covering(all.first()?, together, groups);
    if let (Some(group), None) = (groups.iter().find(|g| g.does_all_of(all[0].parameter)), covering) {
        // Another course than a jump: by one of the members, if they explain it at all.
        if let Some(at) = all.iter().position(|change| group.is_member(change.parameter)) {
            all[..=at].rotate_right(1);
        }
    }
    let first = *all.first()?;
    let near = |c: &Change| c.ratio > first.ratio - ALTERNATIVE_MARGIN;
    let strongest = together.iter().flatten().max_by(|a, b| gain(a).total_cmp(&gain(b)));
    let more = |t: &GroupChange| gain(t) - surprisal(1, first.ratio);
    let (clear, nearly): (Option<GroupChange>, Option<usize>) = match (covering, strongest) {
        (Some(covering), _) => (Some(covering.clone()), None),
        (_, Some(t)) if more(t) > GROUP_MARGIN.0.max(GROUP_MARGIN.1 * first.ratio) => (Some(t.clone()), None),
        (_, Some(t)) if more(t) > -ALTERNATIVE_MARGIN => (None, Some(t.group)),
        _ => (None, None),
    };
    let other = best[first.parameter].iter().flatten().find(|c| c.form != first.form).copied();
    Some(Explanation {
        best: first,
        other_form: other.filter(near),
        alternatives: all[1..].iter().take_while(|c| near(c)).copied().collect(),
        together: clear,
        nearly,
    })
}

/// The group that does all that the best single change does, and explains as much.
fn covering<'a>(
    best: &Change,
    together: &'a [Option<GroupChange>],
    groups: &[Group],
) -> Option<&'a GroupChange> {
    let does = |t: &&GroupChange| groups[t.group].does_all_of(best.parameter);
    let explains = |t: &&GroupChange| t.ratio > best.ratio * (1.0 - COVERED);
    together.iter().flatten().filter(does).find(explains)
}

/// A group explains as much as what it covers where its ratio is not smaller by more than this share: its members have priors, which
/// cost a little.
const COVERED: f64 = 0.02;
