//! Train/test splits and cross-validation folds of the rows.
//!
//! All readings of a repeated pose are on the same side of every split: a fit that has seen one has seen the others.
//! All functions return indices of [`Dataset::rows`] in ascending order.

use rand::RngExt;
use rand_chacha::ChaCha8Rng;
use rand_chacha::rand_core::SeedableRng;

use super::dataset::Dataset;
use super::repeated_poses::{pose_of_rows, poses, with_poses};

/// Training rows and held-out rows.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Split {
    /// Rows of the fit.
    pub train: Vec<usize>,
    /// Held-out rows.
    pub test: Vec<usize>,
}

impl Split {
    /// The same split of a subset, as indices of the set from which its rows were picked.
    pub fn of_whole(&self, picked: &[usize]) -> Self {
        let of_whole = |rows: &[usize]| rows.iter().map(|&row| picked[row]).collect();
        Self { train: of_whole(&self.train), test: of_whole(&self.test) }
    }
}

impl From<Split> for (Vec<usize>, Vec<usize>) {
    fn from(split: Split) -> Self {
        (split.train, split.test)
    }
}

/// Holds out a random share of the poses: `held_out` = 0.2 for 80/20, clamped to 0 to 1.
///
/// ```
/// use truegrind_calibration::measurement::import::{Options, read};
/// use truegrind_calibration::measurement::split;
///
/// // Ten poses, each read twice: both readings are on the same side.
/// let lines: String = (0..20).map(|k| format!("{},20,30,40,50,60,500.{k}\n", k / 2)).collect();
/// let rows = read("poses.csv", format!("q1,q2,q3,q4,q5,q6,L\n{lines}").as_bytes(), &Options::default())?;
/// let split = split::random(&rows, 0.2, 7);
/// assert_eq!((split.train.len(), split.test.len()), (16, 4));
/// assert!(split.test.chunks(2).all(|pair| pair[0] / 2 == pair[1] / 2));
/// assert_eq!(split, split::random(&rows, 0.2, 7));
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
pub fn random(data: &Dataset, held_out: f64, seed: u64) -> Split {
    let rows = data.rows.len();
    let wanted = (rows as f64 * held_out.clamp(0.0, 1.0)).round() as usize;
    with_poses(data, |poses| {
        let (mut test, mut train) = (Vec::with_capacity(wanted), Vec::with_capacity(rows - wanted));
        for pose in shuffled(poses.collect::<Vec<_>>(), seed) {
            // A pose that would overshoot by more than half of its rows goes to the other side.
            let side = if 2 * test.len() + pose.len() <= 2 * wanted { &mut test } else { &mut train };
            side.extend_from_slice(pose);
        }
        sorted(train, test)
    })
}

/// k-fold cross-validation over random poses: k splits whose test rows cover every row once; at most one fold for each pose.
/// The random order depends on the joint angles, not on row indices: adding, removing or reordering rows leaves nearly all
/// other rows in their folds.
pub fn folds(data: &Dataset, folds: usize, seed: u64) -> Vec<Split> {
    let poses = shuffled_by_angles(data, poses(data), seed);
    let k = folds.clamp(1, poses.len().max(1));
    complements(data.rows.len(), into_folds(poses, k))
}

/// Groups in a random order that depends only on their angles and the seed.
pub(crate) fn shuffled_by_angles(data: &Dataset, groups: Vec<Vec<usize>>, seed: u64) -> Vec<Vec<usize>> {
    /// Angles are first rounded to this step (rad), so that the order does not depend on their last digits.
    const STEP_RAD: f64 = 1e-3;
    let key = |group: &Vec<usize>| {
        let steps = data.rows[group[0]].joints.iter().map(|q| (q / STEP_RAD).round() as i64 as u64);
        steps.fold(splitmix64(seed, 0), splitmix64)
    };
    sorted_by_key(groups, key)
}

/// Groups in the order of their keys (stable).
fn sorted_by_key<T>(groups: Vec<T>, key: impl Fn(&T) -> u64) -> Vec<T> {
    let mut keyed: Vec<(u64, T)> = groups.into_iter().map(|group| (key(&group), group)).collect();
    keyed.sort_by_key(|(key, _)| *key);
    keyed.into_iter().map(|(_, group)| group).collect()
}

/// Hash step of SplitMix64 (Steele, Lea and Flood 2014).
fn splitmix64(state: u64, value: u64) -> u64 {
    let mut z = (state ^ value).wrapping_add(0x9e37_79b9_7f4a_7c15);
    z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
    z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
    z ^ (z >> 31)
}

/// Consecutive groups in k parts of nearly equal numbers of rows; no part is empty if there are at least k groups.
fn into_folds(groups: Vec<Vec<usize>>, k: usize) -> Vec<Vec<usize>> {
    let (count, rows) = (groups.len(), groups.iter().map(Vec::len).sum::<usize>().max(1));
    let mut parts: Vec<Vec<usize>> = vec![Vec::new(); k];
    let (mut part, mut before) = (0, 0);
    for (i, group) in groups.into_iter().enumerate() {
        // The part of its middle row, at most the next one, and early enough to leave a group for each further part.
        let wanted = (2 * before + group.len()) * k / (2 * rows);
        let next = part + usize::from(!parts[part].is_empty());
        part = wanted.clamp(part, next.min(k - 1)).max((k + i).saturating_sub(count).min(next));
        before += group.len();
        parts[part].extend(group);
    }
    parts
}

/// Purged cross-validation for serially correlated rows: blocks of rows, distributed at random over `folds` folds; rows within
/// `reach` of a held-out row, and repetitions of held-out poses, are excluded from training. Test rows cover every row once.
/// With a `reach` of 0, or too few blocks, these are random [`folds`].
///
/// Random folds leave a held-out row between two training rows that share its error, so they underestimate the error of later
/// rows. Source: purged cross-validation, López de Prado 2018; h-block cross-validation, Burman, Chow and Nolan 1994.
pub fn purged(data: &Dataset, folds: usize, reach: usize, seed: u64) -> Vec<Split> {
    let n = data.rows.len();
    let stretch = (2 * reach).max(1);
    let k = folds.clamp(1, n.max(1));
    if reach == 0 || n < 2 * k * stretch {
        return self::folds(data, folds, seed);
    }
    let stretches: Vec<Vec<usize>> =
        (0..n.div_ceil(stretch)).map(|b| (b * stretch..n.min((b + 1) * stretch)).collect()).collect();
    let order = sorted_by_key((0..stretches.len()).collect(), |b| splitmix64(splitmix64(seed, 0), *b as u64));
    let stretches = order.into_iter().map(|b| stretches[b].clone()).collect();
    let pose_of = pose_of_rows(data);
    into_folds(stretches, k)
        .into_iter()
        .map(|mut test| {
            test.sort_unstable();
            let mut near = vec![false; n];
            let mut held = vec![false; n];
            for &i in &test {
                near[i.saturating_sub(reach)..n.min(i + reach + 1)].fill(true);
                held[pose_of[i]] = true;
            }
            let train = (0..n).filter(|&i| !near[i] && !held[pose_of[i]]).collect();
            Split { train, test }
        })
        .collect()
}

/// Cross-validation over contiguous blocks of rows: drifts and jumps during the measurement raise this error but not that of
/// random folds. Repetitions of a test pose in other blocks are excluded from training.
pub fn blocks(data: &Dataset, blocks: usize) -> Vec<Split> {
    let n = data.rows.len();
    let k = blocks.clamp(1, n.max(1));
    let pose_of = pose_of_rows(data);
    (0..k)
        .map(|b| {
            let test: Vec<usize> = (b * n / k..(b + 1) * n / k).collect();
            let mut held = vec![false; n];
            test.iter().for_each(|&i| held[pose_of[i]] = true);
            let train = (0..n).filter(|&i| !held[pose_of[i]]).collect();
            Split { train, test }
        })
        .collect()
}

/// Cross-validation over regions of joint space, each held out whole: what a program may meet where nothing was measured nearby. In an
/// order of rows that is random, blocks do not show this.
///
/// All poses are one region at first; the region with the most rows is halved at the median of the joint that spreads the most there,
/// until there are `regions`.
pub fn regions(data: &Dataset, regions: usize) -> Vec<Split> {
    let mut parts = vec![poses(data)];
    let rows = |part: &Vec<Vec<usize>>| part.iter().map(Vec::len).sum::<usize>();
    while parts.len() < regions {
        let divisible = (0..parts.len()).filter(|&k| parts[k].len() > 1);
        let Some(largest) = divisible.max_by_key(|&k| rows(&parts[k])) else { break };
        let upper = upper_half(data, &mut parts[largest]);
        parts.push(upper);
    }
    complements(data.rows.len(), parts.into_iter().map(|part| part.concat()).collect())
}

/// Takes the upper half of some poses, along the joint that spreads the most.
fn upper_half(data: &Dataset, poses: &mut Vec<Vec<usize>>) -> Vec<Vec<usize>> {
    /// Poses that stand nearer along the joint are not separated, such as those of one step of a grid (rad).
    const APART_RAD: f64 = 1e-3;
    let angle = |pose: &[usize], joint: usize| data.rows[pose[0]].joints[joint];
    let variance = |joint: usize| {
        let mean = poses.iter().map(|pose| angle(pose, joint)).sum::<f64>() / poses.len() as f64;
        poses.iter().map(|pose| (angle(pose, joint) - mean).powi(2)).sum::<f64>()
    };
    let spreads: [f64; 6] = std::array::from_fn(variance);
    let widest = (0..6).max_by(|&a, &b| spreads[a].total_cmp(&spreads[b])).unwrap_or(0);
    poses.sort_by(|a, b| angle(a, widest).total_cmp(&angle(b, widest)));
    let half = poses.len() / 2;
    let gaps =
        (1..poses.len()).filter(|&k| angle(&poses[k], widest) - angle(&poses[k - 1], widest) > APART_RAD);
    let at = gaps.min_by_key(|k| k.abs_diff(half)).unwrap_or(half);
    poses.split_off(at)
}

fn shuffled<T>(mut groups: Vec<T>, seed: u64) -> Vec<T> {
    let mut rng = ChaCha8Rng::seed_from_u64(seed);
    // Fisher and Yates.
    for i in (1..groups.len()).rev() {
        groups.swap(i, rng.random_range(0..=i));
    }
    groups
}

fn sorted(mut train: Vec<usize>, mut test: Vec<usize>) -> Split {
    train.sort_unstable();
    test.sort_unstable();
    Split { train, test }
}

fn complements(rows: usize, tests: Vec<Vec<usize>>) -> Vec<Split> {
    tests
        .into_iter()
        .map(|test| {
            let mut held = vec![false; rows];
            test.iter().for_each(|&i| held[i] = true);
            sorted((0..rows).filter(|&i| !held[i]).collect(), test)
        })
        .collect()
}
