//! Train/test splits and cross-validation folds of the rows, and the noise floor from repeated poses.
//!
//! All readings of a repeated pose are on the same side of every split: a fit that has seen one has seen the others.
//! All functions return indices of [`Dataset::rows`] in ascending order.

use std::collections::BTreeMap;

use nalgebra::Vector3;
use rand::RngExt;
use rand_chacha::ChaCha8Rng;
use rand_chacha::rand_core::SeedableRng;

use super::dataset::{Dataset, Reading, Row};

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

/// Largest joint difference between two rows of the same pose (rad): below the step of a rounded log, or the scatter of an
/// encoder at rest.
fn same_pose_rad(data: &Dataset) -> f64 {
    if data.angle_step_rad.is_some() { 0.000_5f64.to_radians() } else { 0.003f64.to_radians() }
}

/// Rows grouped by pose, in the order of their first row. Two rows are of one pose when all joints agree (to 0.0005° in a
/// log rounded to fixed steps, else to 0.003°) and the controller's read-out, if logged, agrees too: it separates poses whose
/// angles are rounded coarsely.
pub fn poses(data: &Dataset) -> Vec<Vec<usize>> {
    with_poses(data, |poses| poses.map(<[usize]>::to_vec).collect())
}

/// Calls `work` with the rows of each pose, as [`poses`] groups them; one shared list, since there can be a million.
fn with_poses<T>(data: &Dataset, work: impl FnOnce(&mut dyn Iterator<Item = &[usize]>) -> T) -> T {
    let first = first_rows(data);
    let mut rows: Vec<usize> = (0..data.rows.len()).collect();
    rows.sort_by_key(|&row| first[row]);
    work(&mut rows.chunk_by(|&a, &b| first[a] == first[b]))
}

/// The first row of the same pose, for each row.
fn first_rows(data: &Dataset) -> Vec<usize> {
    // One key for each row, close for equal poses and hardly ever for others: only neighbours in its order are compared.
    // The weights are powers of the golden section, so that no regular grid of angles collides.
    const WEIGHTS: [f64; 6] = [1.0, 0.618_034, 0.381_966, 0.236_068, 0.145_898, 0.090_170];
    let same = same_pose_rad(data);
    let reach = same * WEIGHTS.iter().sum::<f64>();
    let along = |row: &Row| row.joints.iter().zip(WEIGHTS).map(|(q, w)| q * w).sum::<f64>() + 0.0;
    let key: Vec<f64> = data.rows.iter().map(along).collect();
    let mut order: Vec<usize> = (0..data.rows.len()).collect();
    order.sort_by(|&a, &b| key[a].total_cmp(&key[b]).then(a.cmp(&b)));
    let mut group: Vec<usize> = (0..data.rows.len()).collect();
    // Bitwise equal rows are represented by the first of them, so that a pose measured a thousand times is not compared a
    // million times. They are neighbours in the order.
    let mut distinct: Vec<(usize, [u64; 10])> = Vec::new();
    let mut last = None;
    order.retain(|&i| {
        if last != Some(key[i]) {
            distinct.clear();
            last = Some(key[i]);
        }
        let bits = bits(&data.rows[i]);
        match distinct.iter().find(|(_, known)| *known == bits) {
            Some((first, _)) => group[i] = *first,
            None => distinct.push((i, bits)),
        }
        group[i] == i
    });
    for (k, &i) in order.iter().enumerate() {
        for &j in order[k + 1..].iter().take_while(|&&j| key[j] - key[i] <= reach) {
            let (a, b) = (root(&mut group, i), root(&mut group, j));
            if a != b
                && (data.rows[i].joints - data.rows[j].joints).amax() <= same
                && !readouts_differ(data, i, j)
            {
                group[a.max(b)] = a.min(b);
            }
        }
    }
    (0..data.rows.len()).map(|row| root(&mut group, row)).collect()
}

/// The bits of a row's joints and read-out; −0 and 0 count as equal.
fn bits(row: &Row) -> [u64; 10] {
    let mut out = [0; 10];
    let readout = row.readout_mm();
    for (bits, value) in out.iter_mut().zip(row.joints.iter().chain(readout.iter().flatten())) {
        *bits = (value + 0.0).to_bits();
    }
    out[9] = u64::from(readout.is_some());
    out
}

/// The first row of a group (union–find with path halving).
fn root(group: &mut [usize], mut i: usize) -> usize {
    while group[i] != i {
        group[i] = group[group[i]];
        i = group[i];
    }
    i
}

/// Whether the controller's read-out separates two rows of equal rounded angles.
fn readouts_differ(data: &Dataset, i: usize, j: usize) -> bool {
    match (data.rows[i].readout_mm(), data.rows[j].readout_mm()) {
        (Some(a), Some(b)) => (a - b).amax() > 1.5 * data.readout_step_mm.unwrap_or(1e-3),
        _ => false,
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

/// The pose index of each row, in the order of [`poses`].
pub fn pose_of_rows(data: &Dataset) -> Vec<usize> {
    let mut out = vec![0; data.rows.len()];
    for (p, rows) in poses(data).iter().enumerate() {
        rows.iter().for_each(|&i| out[i] = p);
    }
    out
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

/// Scatter of repeated poses.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct NoiseFloor {
    /// Pooled standard deviation of a length, or of the position (root of the sum over the coordinates) (mm).
    pub sigma_mm: f64,
    /// Number of poses that were measured more than once.
    pub poses: usize,
    /// Degrees of freedom: rows of these poses minus poses.
    pub freedom: usize,
}

/// Fewest degrees of freedom of a known noise floor: of one repeated pose the scatter is right to a factor of ten or so.
const FEWEST_FREEDOM: usize = 4;

impl NoiseFloor {
    /// Whether enough poses were repeated for the scatter to be that of the sensor.
    pub fn is_known(&self) -> bool {
        self.freedom >= FEWEST_FREEDOM
    }
}

/// The noise floor from repeated poses: √(Σ |r − r̄|² / Σ (n − 1)) over poses with the same outlet and approach.
/// `None` where no pose was repeated. Drift between the repetitions counts as noise. Copied rows show no noise: readings equal
/// to the last digit count once if the others scatter too widely for that to be chance, or if there are no others.
///
/// ```
/// use truegrind_calibration::measurement::import::{Options, read};
/// use truegrind_calibration::measurement::split::noise_floor;
///
/// let csv = "q1,q2,q3,q4,q5,q6,L\n1,2,3,4,5,6,500.00\n9,2,3,4,5,6,612.00\n1,2,3,4,5,6,500.06\n1,2,3,4,5,6,500.03\n";
/// let rows = read("poses.csv", csv.as_bytes(), &Options::default())?;
/// let floor = noise_floor(&rows).ok_or("no pose was repeated")?;
/// assert_eq!((floor.poses, floor.freedom), (1, 2));
/// assert!((floor.sigma_mm - 0.03).abs() < 1e-9);
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
pub fn noise_floor(data: &Dataset) -> Option<NoiseFloor> {
    pooled_scatter_by(data, |row, _| Some(row.reading.place_mm()))
}

/// The noise floor of orientations (rad), from rotation vectors relative to the first reading of each pose, as the root of the
/// sum over the coordinates. `None` where no pose was repeated or the sensor measures no orientation.
pub fn noise_floor_rad(data: &Dataset) -> Option<f64> {
    let turn = |row: &Row| if let Reading::Pose(pose) = &row.reading { Some(pose.rotation) } else { None };
    let mut first = None;
    let against = |row: &Row, begins: bool| {
        let here = turn(row)?;
        let first = *if begins { first.insert(here) } else { first.get_or_insert(here) };
        Some((first.inverse() * here).scaled_axis())
    };
    pooled_scatter_by(data, against).map(|floor| floor.sigma_mm)
}

/// Pooled scatter of repeated readings without copies, of a quantity relative to the first row of its pose, outlet and approach (flagged by `true`).
fn pooled_scatter_by(
    data: &Dataset,
    quantity: impl FnMut(&Row, bool) -> Option<Vector3<f64>>,
) -> Option<NoiseFloor> {
    let repeats = Repeats::of(data, quantity);
    let all = repeats.all.pooled()?;
    if repeats.are_copied() { repeats.own.pooled() } else { Some(all) }
}

/// Whether repeated readings that are equal to the last digit may be so by chance: the sensor's steps are coarse for its scatter.
pub(super) fn repeats_agree_by_chance(data: &Dataset) -> bool {
    !repeats_of_readings(data).are_copied()
}

/// The same of readings at different times, which may all be equal where the steps are coarse.
pub(super) fn repeats_may_all_agree(data: &Dataset) -> bool {
    let is_coarse = data.reading_step_mm.is_some_and(|step| step > FINE_STEP_MM);
    is_coarse && repeats_of_readings(data).own.pooled().is_none()
}

fn repeats_of_readings(data: &Dataset) -> Repeats {
    Repeats::of(data, |row, _| Some(row.reading.place_mm()))
}

/// Step of readings above which they may all be equal at a pose (mm).
const FINE_STEP_MM: f64 = 0.005;

/// Readings of poses that were measured more than once with the same outlet and approach.
struct Repeats {
    /// All readings.
    all: Scatter,
    /// Without those that equal an earlier one to the last digit.
    own: Scatter,
    /// The finest step between two of them (mm).
    finest_mm: f64,
}

impl Repeats {
    fn of(data: &Dataset, mut quantity: impl FnMut(&Row, bool) -> Option<Vector3<f64>>) -> Self {
        with_poses(data, |poses| {
            let mut out = Self { all: Scatter::default(), own: Scatter::default(), finest_mm: f64::INFINITY };
            for pose in poses.filter(|pose| pose.len() > 1) {
                let mut alike: BTreeMap<(usize, [i8; 6]), Vec<usize>> = BTreeMap::new();
                for &i in pose {
                    let row = &data.rows[i];
                    alike.entry((row.anchor, row.condition.approach)).or_default().push(i);
                }
                for rows in alike.into_values().filter(|rows| rows.len() > 1) {
                    let of = |(k, &i): (usize, &usize)| quantity(&data.rows[i], k == 0);
                    let readings: Vec<Vector3<f64>> = rows.iter().enumerate().filter_map(of).collect();
                    out.all.add(&readings);
                    out.own.add(&distinct(&readings));
                    out.finest_mm = out.finest_mm.min(finest_step_mm(&readings));
                }
            }
            out
        })
    }

    /// Whether equal readings are copies: the others scatter too widely for that to be chance, or there are no others.
    fn are_copied(&self) -> bool {
        self.own.pooled().is_none_or(|own| own.sigma_mm > COPY_RATIO * self.finest_mm)
    }
}

/// Ratio of scatter to the finest step of readings above which readings equal to the last digit are copies, not chance.
const COPY_RATIO: f64 = 10.0;

/// Pooled scatter of readings of the same pose.
#[derive(Default)]
struct Scatter {
    square: f64,
    poses: usize,
    freedom: usize,
}

impl Scatter {
    /// Adds the readings of one pose; a single reading has no scatter.
    fn add(&mut self, readings: &[Vector3<f64>]) {
        if readings.len() > 1 {
            let mean = readings.iter().sum::<Vector3<f64>>() / readings.len() as f64;
            self.square += readings.iter().map(|r| (r - mean).norm_squared()).sum::<f64>();
            self.freedom += readings.len() - 1;
            self.poses += 1;
        }
    }

    fn pooled(&self) -> Option<NoiseFloor> {
        let Self { square, poses, freedom } = *self;
        (freedom > 0).then(|| NoiseFloor { sigma_mm: (square / freedom as f64).sqrt(), poses, freedom })
    }
}

/// Readings without those that equal an earlier one.
fn distinct(readings: &[Vector3<f64>]) -> Vec<Vector3<f64>> {
    let mut out: Vec<Vector3<f64>> = Vec::with_capacity(readings.len());
    for reading in readings {
        if !out.contains(reading) {
            out.push(*reading);
        }
    }
    out
}

/// The smallest nonzero difference of a coordinate between readings of one pose (mm).
fn finest_step_mm(readings: &[Vector3<f64>]) -> f64 {
    let mut finest = f64::INFINITY;
    for axis in 0..3 {
        let mut values: Vec<f64> = readings.iter().map(|r| r[axis]).collect();
        values.sort_by(f64::total_cmp);
        // Differences by rounding of the last bit are 0.
        let steps = values.windows(2).map(|pair| pair[1] - pair[0]).filter(|step| *step > 1e-9);
        finest = steps.fold(finest, f64::min);
    }
    finest
}
