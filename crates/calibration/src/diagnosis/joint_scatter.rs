//! An error about one joint whose size or sign differs from row to row: play whose side the rows do not tell, a joint that comes to rest
//! anywhere, an error of its angle that no function of the pose follows.
//!
//! Beside noise of variance s² in every whitened coordinate, the residual r of a row varies by v along the direction g in which the
//! joint moves the reading:
//!
//! cov r = s² 1 + v g gᵀ,  −2 ln L = N ln s² + Σ ln(1 + ρ|g|²) + const,  ρ = v / s²,
//! N s² = Σ [ |r|² − a² + a² / (1 + ρ|g|²) ],  a = g·r / |g|.
//!
//! Rows count in full, whatever the robust fit makes of them: where one in twelve lies on the other flank of a play, it follows the
//! others and all but ignores these.
//!
//! The likelihood ratio against ρ = 0 is compared with that of the same along the line of sight (a sensor whose distances scatter) and
//! along the ways in which the target and the sensor move. It must be large in either half of the rows.

use super::design::Linear;

/// Least twice log likelihood ratio in each half of the rows.
const MIN_EVIDENCE: f64 = 15.0;

/// Least ratio of the joint's evidence to that of the strongest rival without a joint.
const MIN_EVIDENCE_RATIO: f64 = 1.2;

/// How many times the rounding of the logged angles a scatter must be.
const OF_ROUNDING: f64 = 1.5;

/// Fewest scalar rows.
const MIN_SCALAR_ROWS: usize = 60;

/// A joint about which the residual scatters.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct JointScatter {
    /// From 0.
    pub(super) joint: usize,
    /// Standard deviation of its angle (rad).
    pub(super) sigma_rad: f64,
    /// Twice the log likelihood ratio.
    pub(super) evidence: f64,
    /// What it probably is in each row (mm).
    pub(super) effect_mm: Vec<f64>,
}

impl JointScatter {
    /// The joint that explains most of the residual in this way; `None` where none does so clearly. `robust_weight` is that of each row,
    /// `aside` are outliers, which do not count. `logged_rad` is the standard deviation with which the angles are logged: no more than
    /// their rounding is no scatter.
    pub(super) fn of(
        linear: &Linear,
        robust_weight: &[f64],
        aside: &[usize],
        logged_rad: f64,
    ) -> Option<Self> {
        let (slopes, per) = (&linear.slopes, linear.per);
        // The one coordinate of a cable has no direction.
        if per < 3 || linear.residual.len() < MIN_SCALAR_ROWS {
            return None;
        }
        let weights: Vec<f64> = (0..linear.observations)
            .map(|i| if aside.contains(&i) { 0.0 } else { robust_weight[i] })
            .collect();
        let along = |direction: &[f64]| Rows::of(linear.residual.as_slice(), direction, per, &weights);
        let joints = slopes.by_joint.iter().map(|slope| along(slope.as_slice()));
        let (joint, rows, found) = joints
            .enumerate()
            .map(|(joint, rows)| {
                let found = rows.best();
                (joint, rows, found)
            })
            .max_by(|a, b| a.2.evidence.total_cmp(&b.2.evidence))?;
        if found.ratio * found.noise_variance < (OF_ROUNDING * logged_rad).powi(2) {
            return None;
        }
        let halves = [0, 1].map(|half| rows.evidence(found.ratio, |row| row % 2 == half));
        if !halves.iter().all(|evidence| *evidence > MIN_EVIDENCE) {
            return None;
        }
        let frames = slopes.by_target.column_iter().chain(slopes.by_frame.column_iter());
        let rivals = frames.map(|column| along(column.as_slice())).chain([along(slopes.by_scale.as_slice())]);
        let strongest = rivals.map(|rows| rows.best().evidence).fold(0.0, f64::max);
        if found.evidence < MIN_EVIDENCE_RATIO * strongest {
            return None;
        }
        let length = |row: usize| {
            // The weights of the two cancel.
            let slope = &slopes.by_joint[joint].as_slice()[row * per..(row + 1) * per];
            let mm = &slopes.mm[row * per..(row + 1) * per];
            slope.iter().zip(mm).map(|(g, mm)| (g * mm).powi(2)).sum::<f64>().sqrt()
        };
        // The mean of the joint's angle given the row, and what remains uncertain of it.
        let variance = found.ratio * found.noise_variance;
        let effect_mm = rows.list.iter().enumerate().map(|(row, Row { square, along, .. })| {
            if weights[row] == 0.0 {
                return 0.0;
            }
            let share = found.ratio * square / (1.0 + found.ratio * square);
            let mean = if *square > 0.0 { share * along / square.sqrt() } else { 0.0 };
            length(row) * (mean * mean + variance * (1.0 - share)).sqrt()
        });
        Some(Self {
            joint,
            sigma_rad: variance.sqrt(),
            evidence: found.evidence,
            effect_mm: effect_mm.collect(),
        })
    }

    /// Its size in the readings (mm RMS).
    pub(super) fn rms_mm(&self) -> f64 {
        let square: f64 = self.effect_mm.iter().map(|mm| mm * mm).sum();
        (square / self.effect_mm.len().max(1) as f64).sqrt()
    }

    /// In words, after "as if".
    pub(super) fn words(&self) -> String {
        format!(
            "joint {} did not return to the same angle, but scattered by {:.4}° RMS from reading to reading",
            self.joint + 1,
            self.sigma_rad.to_degrees()
        )
    }
}

/// What a row contributes.
struct Row {
    /// |g|².
    square: f64,
    /// a.
    along: f64,
    /// |r|² − a².
    across_square: f64,
    /// Whether it is no outlier.
    counts: bool,
}

/// The rows for one direction.
struct Rows {
    list: Vec<Row>,
    per: usize,
}

/// A ratio, the noise beside it, and how much likelier it is than 0.
struct Found {
    ratio: f64,
    noise_variance: f64,
    evidence: f64,
}

impl Rows {
    /// Residuals and directions are those of the robust fit, `weights` its weights; 0 for a row that does not count.
    fn of(residual: &[f64], direction: &[f64], per: usize, weights: &[f64]) -> Self {
        let row = |((r, g), weight): ((&[f64], &[f64]), &f64)| {
            let dot = |a: &[f64], b: &[f64]| a.iter().zip(b).map(|(a, b)| a * b).sum::<f64>() / weight;
            if *weight == 0.0 {
                return Row { square: 0.0, along: 0.0, across_square: 0.0, counts: false };
            }
            let square = dot(g, g);
            let along = if square > 0.0 { dot(g, r) / square.sqrt() } else { 0.0 };
            Row { square, along, across_square: dot(r, r) - along * along, counts: true }
        };
        let rows = residual.chunks(per).zip(direction.chunks(per)).zip(weights);
        Self { list: rows.map(row).collect(), per }
    }

    /// Twice the log likelihood ratio of a ratio against 0, in some of the rows, and their noise.
    fn at(&self, ratio: f64, is_in: impl Fn(usize) -> bool) -> (f64, f64) {
        let (mut count, mut logs, mut whole, mut rest) = (0, 0.0, 0.0, 0.0);
        let counted = self.list.iter().enumerate().filter(|(k, row)| row.counts && is_in(*k));
        for (_, Row { square, along, across_square, .. }) in counted {
            let more = 1.0 + ratio * square;
            count += self.per;
            logs += more.ln();
            whole += across_square + along * along;
            rest += across_square + along * along / more;
        }
        let count = f64::from(count as u32);
        (count * (whole / rest).ln() - logs, rest / count)
    }

    fn evidence(&self, ratio: f64, is_in: impl Fn(usize) -> bool) -> f64 {
        self.at(ratio, is_in).0
    }

    /// The most likely ratio, for all rows.
    fn best(&self) -> Found {
        let mean = self.list.iter().map(|row| row.square).sum::<f64>() / self.list.len().max(1) as f64;
        if !(mean > 0.0) {
            return Found { ratio: 0.0, noise_variance: 0.0, evidence: 0.0 };
        }
        // A ratio at which the scatter is from a thirtieth to a thousand times the noise, in steps of a tenth.
        let ratios = (0..110).map(|k| (f64::from(k) * 0.1 - 3.4).exp().powi(2) / mean);
        let found = ratios.map(|ratio| {
            let (evidence, noise_variance) = self.at(ratio, |_| true);
            Found { ratio, noise_variance, evidence }
        });
        found.max_by(|a, b| a.evidence.total_cmp(&b.evidence)).unwrap_or(Found {
            ratio: 0.0,
            noise_variance: 0.0,
            evidence: 0.0,
        })
    }
}
