//! What repeated poses say of the error that programs will have: whether they scatter as white noise of a reading does.
//!
//! The scatter of repeated poses is taken off the error on held-out rows, and what is left is the arm's. That holds for noise that every
//! reading draws anew. It does not hold for what repetitions share in the order of time. A sensor that is bumped before all poses are
//! repeated makes them scatter by 0.7 of its shift, but the rows about their mean by half of it at most; a single bumped reading counts in one
//! of twelve repetitions, but in one of a hundred rows; and a gear's play, on either side of which an arm comes to rest, is the arm's error
//! in programs too. Four patterns are looked for in the differences of a later and an earlier reading of one pose:
//!
//! - in common: a vector that all share, or that grows with the rows between them (F test, as likelihood ratio after Bartlett);
//! - unequal: some are far larger than the others (mixture of two normal distributions, by its likelihood);
//! - wandering: they scatter more than residuals of neighbouring rows, in which noise is as large and the arm's error is added.
//!
//! Where one is found, only the white part is noise. Of the rest as much is the sensor's as both the repetitions and the residuals in the order
//! of rows show: with V the mean square of residuals and S that of half the differences of neighbours, V − S varies slowly, and repetitions that
//! lie g rows apart in the mean scatter by at least 3g/n times as much as n rows about their mean do by a drift.

use nalgebra::Vector3;

use super::fit::Fitted;
use crate::measurement::dataset::Dataset;
use crate::measurement::noise_floor::{NoiseFloor, repeated_readings};
use truegrind_estimation::problem::Problem;
use truegrind_math::distribution::wilson_hilferty;
use truegrind_math::tail::chi_square_tail;

/// Fewest differences that show a pattern.
const MIN_DIFFERENCES: usize = 4;
/// Probability of a chance pattern in common.
const CHANCE: f64 = 1e-3;
/// The same as a normal quantile.
const CHANCE_SIGMAS: f64 = 3.1;
/// Share of the squared differences that is in common from which it matters.
const IN_COMMON: f64 = 0.25;
/// Log likelihood by which unequal differences must beat equal ones: in 300 draws of 6, 12, 30 and 100 equal ones at most one came near.
const UNEQUAL: f64 = 5.5;
/// Variance of the larger differences over that of the others from which they are of another kind.
const LARGER: f64 = 12.0;
/// Differences from which their sizes are judged, evenly in their order.
const MAX_SQUARES: usize = 2000;
/// Share of larger differences up to which they are single gross readings.
const MAX_GROSS_SHARE: f64 = 0.25;

/// What the scatter of repeated poses is made of.
#[derive(Debug, Clone, PartialEq)]
pub struct Repeats {
    /// As the poses scatter.
    floor: NoiseFloor,
    /// White noise of a reading (mm); absent where the repetitions do not show it.
    white_mm: Option<f64>,
    /// What else they show, in words.
    pattern: Option<String>,
    /// Squares that the errors on rows share with the repetitions beyond white noise (mm²).
    shared_mm2: f64,
    /// Mean square of the errors without gross readings, over that with them.
    without_gross: f64,
}

/// A later reading less an earlier one of the same pose.
struct Difference {
    rows: [usize; 2],
    by: Vector3<f64>,
}

impl Difference {
    fn gap(&self) -> f64 {
        (self.rows[1] - self.rows[0]) as f64
    }
}

impl Repeats {
    /// Judges the scatter `floor` of repeated poses by the rows that were fitted. `square_mm2`: mean square of their errors, parameters counted.
    pub(super) fn of(floor: NoiseFloor, dataset: &Dataset, fitted: &Fitted, square_mm2: f64) -> Self {
        let plain = Self {
            floor,
            white_mm: Some(floor.sigma_mm),
            pattern: None,
            shared_mm2: 0.0,
            without_gross: 1.0,
        };
        let differences = differences(dataset);
        if differences.len() < MIN_DIFFERENCES {
            return plain;
        }
        let residuals = residuals_mm(dataset, fitted);
        Case { floor, dataset, residuals: &residuals, square_mm2, axes: dataset.sensor.axes() }
            .judge(differences)
            .unwrap_or(plain)
    }

    /// The noise floor: scatter that every reading draws anew (mm).
    pub fn white_mm(&self) -> Option<f64> {
        self.white_mm
    }

    /// What repeated poses show beside white noise, in words.
    pub fn pattern(&self) -> Option<&str> {
        self.pattern.as_deref()
    }

    /// What is left of a mean square (mm²) of errors once the noise and the motion of the sensor are taken off.
    pub(super) fn beyond(&self, square_mm2: f64) -> f64 {
        let white = self.white_mm.unwrap_or(0.0).powi(2);
        (square_mm2 * self.without_gross - white - self.shared_mm2).max(0.0)
    }
}

/// The residual of each row that was fitted (mm); of a cable in the first coordinate.
pub(super) fn residuals_mm(dataset: &Dataset, fitted: &Fitted) -> Vec<Vector3<f64>> {
    let per = fitted.problem.rows_per_observation();
    let mut residual = vec![0.0; fitted.problem.rows()];
    fitted.problem.residuals(&fitted.estimate.x, 0..residual.len(), &mut residual);
    let of = |(i, residual): (usize, &[f64])| {
        let mut mm = Vector3::zeros();
        residual.iter().take(3).enumerate().for_each(|(k, r)| mm[k] = r / fitted.problem.per_mm(i));
        mm
    };
    residual.chunks(per).enumerate().map(of).take(dataset.rows.len()).collect()
}

fn differences(dataset: &Dataset) -> Vec<Difference> {
    let of = |group: &Vec<(usize, Vector3<f64>)>| {
        group
            .windows(2)
            .map(|two| Difference { rows: [two[0].0, two[1].0], by: two[1].1 - two[0].1 })
            .collect()
    };
    repeated_readings(dataset).iter().flat_map::<Vec<Difference>, _>(of).collect()
}

/// What a judgement needs.
struct Case<'a> {
    floor: NoiseFloor,
    dataset: &'a Dataset,
    residuals: &'a [Vector3<f64>],
    square_mm2: f64,
    axes: usize,
}

impl Case<'_> {
    /// `None` where all is white noise.
    fn judge(&self, differences: Vec<Difference>) -> Option<Repeats> {
        let whole = mean_square(&differences);
        let (differences, common) = self.less_common(differences);
        let unequal = Mixture::of(&differences, self.axes, self.step_mm()).filter(Mixture::is_unequal);
        let gross = unequal.as_ref().map_or_else(Vec::new, |mixture| self.gross_rows(&differences, mixture));
        let white = match (&unequal, &common) {
            (Some(mixture), _) => 0.5 * mixture.narrow * self.axes as f64,
            (None, Some(_)) => 0.5 * independent_square(&differences),
            (None, None) => self.floor.sigma_mm.powi(2),
        };
        let neighbours = self.square_mm2 * self.of_neighbours(&gross);
        let is_changed = common.is_some() || unequal.is_some();
        let least = wilson_hilferty((self.axes * differences.len()) as f64, CHANCE_SIGMAS);
        let wanders = if is_changed { white > neighbours } else { white > least * neighbours };
        if !is_changed && !wanders {
            return None;
        }
        let white_mm = (!wanders).then(|| white.sqrt());
        // Unequal differences are gross readings or the arm's play: no motion of the sensor.
        let moved = match (&common, wanders) {
            (Some(common), false) => common.square,
            (_, true) => 0.5 * whole,
            (None, false) => 0.0,
        };
        let slow = (self.square_mm2 - neighbours).max(0.0);
        let sentence = match (&common, &unequal, wanders) {
            (Some(common), _, _) => self.common_sentence(&differences, common),
            (None, Some(mixture), false) => self.unequal_sentence(&differences, mixture, &gross),
            _ => format!(
                "they differ by {:.3} mm, more than neighbouring rows deviate from each other: the sensor, its target or the arm wandered \
                 between them",
                self.floor.sigma_mm * 2_f64.sqrt()
            ),
        };
        Some(Repeats {
            floor: self.floor,
            white_mm,
            pattern: Some(sentence),
            shared_mm2: slow.min(self.share_of_rows(&differences) * moved),
            without_gross: self.without(&gross),
        })
    }

    /// The variance of a rounded reading's difference bounds how alike readings can be (mm).
    fn step_mm(&self) -> f64 {
        self.dataset.reading_step_mm.unwrap_or(0.0)
    }

    /// The differences without what they have in common, if that is no chance.
    fn less_common(&self, differences: Vec<Difference>) -> (Vec<Difference>, Option<Common>) {
        let alike = |_: &Difference| 1.0;
        let growing = Difference::gap;
        let fits = [(false, Common::of(&differences, &alike)), (true, Common::of(&differences, &growing))];
        let [alike_fit, growing_fit] = fits;
        let grows = growing_fit.1.left < alike_fit.1.left;
        let (grows, mut common) = if grows { growing_fit } else { alike_fit };
        common.grows = grows;
        if !common.is_significant(differences.len(), self.axes) {
            return (differences, None);
        }
        let per = |d: &Difference| if grows { d.gap() } else { 1.0 };
        let rest =
            differences.into_iter().map(|d| Difference { by: d.by - common.by * per(&d), ..d }).collect();
        (rest, Some(common))
    }

    /// Half the mean square of differences of neighbouring residuals over the mean square of residuals, without the gross rows; at most 1.
    fn of_neighbours(&self, gross: &[usize]) -> f64 {
        let mut is_gross = vec![false; self.residuals.len()];
        gross.iter().for_each(|&row| is_gross[row] = true);
        let rows: Vec<usize> = (0..self.residuals.len()).filter(|&row| !is_gross[row]).collect();
        let anchor = |row: usize| self.dataset.rows[row].anchor;
        let (mut sum, mut count) = (0.0, 0.0);
        for pair in rows.windows(2).filter(|pair| anchor(pair[0]) == anchor(pair[1])) {
            sum += 0.5 * (self.residuals[pair[1]] - self.residuals[pair[0]]).norm_squared();
            count += 1.0;
        }
        let all: f64 = rows.iter().map(|&row| self.residuals[row].norm_squared()).sum();
        let ratio = sum / count * rows.len() as f64 / all;
        if ratio.is_finite() { ratio.min(1.0) } else { 1.0 }
    }

    /// Of the larger differences the row with the larger residual, where there are few of them.
    fn gross_rows(&self, differences: &[Difference], mixture: &Mixture) -> Vec<usize> {
        let larger: Vec<&Difference> = mixture.larger(differences);
        if larger.len() as f64 > MAX_GROSS_SHARE * differences.len() as f64 {
            return Vec::new();
        }
        let size = |row: usize| self.residuals[row].norm_squared();
        let mut out: Vec<usize> = larger
            .iter()
            .map(|d| if size(d.rows[0]) > size(d.rows[1]) { d.rows[0] } else { d.rows[1] })
            .collect();
        out.sort_unstable();
        out.dedup();
        out
    }

    fn without(&self, gross: &[usize]) -> f64 {
        let all: f64 = self.residuals.iter().map(Vector3::norm_squared).sum();
        let theirs: f64 = gross.iter().map(|&row| self.residuals[row].norm_squared()).sum();
        let count = self.residuals.len() as f64;
        let ratio = (1.0 - theirs / all) * count / (count - gross.len() as f64);
        if ratio.is_finite() { ratio.min(1.0) } else { 1.0 }
    }

    /// What a drift makes of the scatter of all rows over what it makes of that of the repetitions, which lie farther apart.
    fn share_of_rows(&self, differences: &[Difference]) -> f64 {
        let gap = differences.iter().map(Difference::gap).sum::<f64>() / differences.len() as f64;
        (self.residuals.len() as f64 / (3.0 * gap)).min(1.0)
    }

    fn common_sentence(&self, differences: &[Difference], common: &Common) -> String {
        let number = |row: usize| self.dataset.rows[row].number;
        let first = differences.iter().map(|d| d.rows[0]).max().unwrap_or_default();
        let later = differences.iter().map(|d| d.rows[1]).min().unwrap_or_default();
        let end = differences.iter().map(|d| d.rows[1]).max().unwrap_or_default();
        let gap = differences.iter().map(Difference::gap).sum::<f64>() / differences.len() as f64;
        let way = if self.axes == 1 { "with one sign" } else { "in one direction" };
        let moved = if self.axes == 1 {
            "the sensor, its outlet or the arm"
        } else {
            "the sensor, its target or the arm"
        };
        if common.grows {
            let mm = common.by.norm() * gap;
            return format!("they differ {way}, by {mm:.3} mm after {gap:.0} rows: {moved} drifted");
        }
        let mm = common.by.norm();
        if first < later {
            return format!(
                "they differ by {mm:.3} mm {way} between rows up to {} and rows {} to {}: {moved} moved or drifted",
                number(first),
                number(later),
                number(end)
            );
        }
        format!(
            "the later readings differ by {mm:.3} mm {way} from the earlier ones: {moved} moved or drifted"
        )
    }

    fn unequal_sentence(&self, differences: &[Difference], mixture: &Mixture, gross: &[usize]) -> String {
        let larger = mixture.larger(differences).len();
        let axes = self.axes as f64;
        let [others_mm, mm] = [mixture.narrow, mixture.wide].map(|variance| (axes * variance).sqrt());
        let cause = if gross.is_empty() {
            "gears with play come to rest on either side, which columns approach1 to approach6 would show, or the target or the arm does not stay \
             still"
                .to_owned()
        } else {
            let numbers: Vec<usize> = gross.iter().map(|&row| self.dataset.rows[row].number).collect();
            let s = if gross.len() == 1 { "" } else { "s" };
            format!("check the reading{s} of row{s} {}", truegrind_math::sentence::listed(&numbers))
        };
        format!(
            "{larger} of {} {} by {mm:.3} mm{}, the others by {others_mm:.3} mm: {cause}",
            differences.len(),
            if larger == 1 { "differs" } else { "differ" },
            if larger == 1 { "" } else { " (RMS)" }
        )
    }
}

fn mean_square(differences: &[Difference]) -> f64 {
    differences.iter().map(|d| d.by.norm_squared()).sum::<f64>() / differences.len() as f64
}

/// Mean square of differences about zero, of those that are near in time less each other where that is smaller: what wanders is alike in them.
fn independent_square(differences: &[Difference]) -> f64 {
    let freedom = (differences.len() - 1) as f64;
    let about_mean = differences.iter().map(|d| d.by.norm_squared()).sum::<f64>() / freedom;
    let mut near: Vec<&Difference> = differences.iter().collect();
    near.sort_by_key(|d| d.rows);
    let of_near =
        near.windows(2).map(|two| 0.5 * (two[1].by - two[0].by).norm_squared()).sum::<f64>() / freedom;
    about_mean.min(of_near)
}

/// What differences have in common: a vector, or one for each row between the readings.
struct Common {
    grows: bool,
    by: Vector3<f64>,
    /// Sum of squares with and without it.
    whole: f64,
    left: f64,
    /// Half the mean square of what is in common (mm²).
    square: f64,
}

impl Common {
    fn of(differences: &[Difference], per: &dyn Fn(&Difference) -> f64) -> Self {
        let weight: f64 = differences.iter().map(|d| per(d).powi(2)).sum();
        let by = differences.iter().map(|d| d.by * per(d)).sum::<Vector3<f64>>() / weight;
        let whole = differences.iter().map(|d| d.by.norm_squared()).sum::<f64>();
        let left = differences.iter().map(|d| (d.by - by * per(d)).norm_squared()).sum();
        Self {
            grows: false,
            by,
            whole,
            left,
            square: 0.5 * by.norm_squared() * weight / differences.len() as f64,
        }
    }

    fn is_significant(&self, count: usize, axes: usize) -> bool {
        let axes_f = axes as f64;
        let freedom = axes_f * (count as f64 - 1.0) + 0.5 * axes_f - 1.0;
        let ratio = freedom * (self.whole / self.left.max(f64::MIN_POSITIVE)).ln();
        self.left < (1.0 - IN_COMMON) * self.whole && chi_square_tail(ratio, axes) < CHANCE
    }
}

/// Differences of two sizes: normal with a small variance, or a large one.
struct Mixture {
    /// Variances of a coordinate (mm²).
    narrow: f64,
    wide: f64,
    /// Share of the small ones.
    share: f64,
    axes: f64,
    /// Log likelihood over that of one size.
    gain: f64,
}

impl Mixture {
    fn of(differences: &[Difference], axes: usize, step_mm: f64) -> Option<Self> {
        let mut squares: Vec<f64> = differences.iter().map(|d| d.by.norm_squared()).collect();
        squares.sort_by(f64::total_cmp);
        // There can be a million.
        let squares: Vec<f64> =
            squares.iter().copied().step_by(squares.len().div_ceil(MAX_SQUARES)).collect();
        let count = squares.len() as f64;
        let axes = axes as f64;
        let one_size = squares.iter().sum::<f64>() / (axes * count);
        if !(one_size > 0.0) {
            return None;
        }
        let least = (step_mm.powi(2) / 6.0).max(1e-4 * one_size);
        let starts =
            [0.3, 0.5, 0.75, 0.9].map(|share| ((share * count) as usize).clamp(2, squares.len() - 1));
        let fits = starts.map(|split| {
            let variance = |of: &[f64]| of.iter().sum::<f64>() / (axes * of.len() as f64);
            let [narrow, wide] = [&squares[..split], &squares[split..]].map(variance);
            let start =
                Self { narrow: narrow.max(least), wide, share: split as f64 / count, axes, gain: 0.0 };
            start.maximised(&squares, least, one_size)
        });
        fits.into_iter().max_by(|a, b| a.gain.total_cmp(&b.gain))
    }

    /// Expectation and maximisation.
    fn maximised(mut self, squares: &[f64], least: f64, one_size: f64) -> Self {
        const ROUNDS: usize = 60;
        let count = squares.len() as f64;
        for _ in 0..ROUNDS {
            let (mut weight, mut of_narrow, mut of_wide, mut log) = (0.0, 0.0, 0.0, 0.0);
            for &square in squares {
                let [narrow, wide] = self.logs(square);
                let most = narrow.max(wide);
                let both = most + ((narrow - most).exp() + (wide - most).exp()).ln();
                let share = (narrow - both).exp();
                weight += share;
                of_narrow += share * square;
                of_wide += (1.0 - share) * square;
                log += both;
            }
            self.gain = log + 0.5 * count * self.axes * (one_size.ln() + 1.0);
            // At least three in ten are of the small kind, else it would be a few that happen to agree.
            self.share = (weight / count).clamp(0.3, 1.0 - 0.5 / count);
            self.narrow = (of_narrow / (self.axes * weight)).max(least);
            self.wide = (of_wide / (self.axes * (count - weight)).max(1e-9)).max(self.narrow);
        }
        self
    }

    /// Log densities of a squared difference under either kind, up to a constant.
    fn logs(&self, square: f64) -> [f64; 2] {
        [(self.share, self.narrow), (1.0 - self.share, self.wide)]
            .map(|(share, variance)| share.ln() - 0.5 * (self.axes * variance.ln() + square / variance))
    }

    fn is_unequal(&self) -> bool {
        self.gain > UNEQUAL && self.wide > LARGER * self.narrow
    }

    fn larger<'a>(&self, differences: &'a [Difference]) -> Vec<&'a Difference> {
        let is_larger = |d: &&Difference| {
            let [narrow, wide] = self.logs(d.by.norm_squared());
            wide > narrow
        };
        differences.iter().filter(is_larger).collect()
    }
}
