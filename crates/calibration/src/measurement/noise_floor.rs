//! The noise floor from repeated poses, and whether readings that are equal to the last digit are copies.

use std::collections::BTreeMap;

use nalgebra::Vector3;

use super::dataset::{Dataset, Reading, Row, Sensor};
use super::repeated_poses::with_poses;

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
const MIN_FREEDOM: usize = 4;

impl NoiseFloor {
    /// Whether enough poses were repeated for the scatter to be that of the sensor.
    pub fn is_known(&self) -> bool {
        self.freedom >= MIN_FREEDOM
    }
}

/// The noise floor from repeated poses: √(Σ |r − r̄|² / Σ (n − 1)) over poses with the same outlet and approach.
/// `None` where no pose was repeated. Drift between the repetitions counts as noise. Copied rows show no noise: readings equal
/// to the last digit count once if the others scatter too widely for that to be chance, or if there are no others.
///
/// ```
/// use truegrind_calibration::measurement::import::{Options, read};
/// use truegrind_calibration::measurement::noise_floor::noise_floor;
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

/// The noise floor where sensor or target may have shifted between the repetitions of a pose.
///
/// A shift is no noise: it moves all readings after it alike. Where the repetitions before and after some row differ by a common vector that
/// is most of their differences, and the scatter on either side of it is less than half of the whole, those of either side count alone.
pub fn noise_floor_beside_shift(data: &Dataset) -> Option<NoiseFloor> {
    let whole = noise_floor(data)?;
    // A length changes by another amount in each direction of the cable.
    let sees_vectors = data.sensor != Sensor::Cable;
    if !sees_vectors || !whole.is_known() {
        return Some(whole);
    }
    let are_copied = repeats_of_readings(data).are_copied();
    let groups = readings_of_poses(data);
    let count = data.rows.len();
    let step = count.div_ceil(MAX_CUTS).max(1);
    let floors = (step..count).step_by(step).filter_map(|cut| floor_on_either_side(&groups, are_copied, cut));
    let best = floors.filter(|floor| 2.0 * floor.sigma_mm < whole.sigma_mm);
    // Of few repetitions that are left the scatter may be small by chance.
    let at_most_mm = |floor: &NoiseFloor| floor.sigma_mm * (1.0 + (floor.freedom as f64).sqrt().recip());
    Some(best.min_by(|a, b| at_most_mm(a).total_cmp(&at_most_mm(b))).unwrap_or(whole))
}

/// The noise floor where it is known in which of the ranges of row numbers (both ends included) something was shifted: repetitions count as
/// such where the same ranges contain them.
pub fn noise_floor_within(data: &Dataset, shifted: &[[usize; 2]]) -> Option<NoiseFloor> {
    let mut states: BTreeMap<Vec<bool>, Vec<usize>> = BTreeMap::new();
    for (i, row) in data.rows.iter().enumerate() {
        let state = shifted.iter().map(|[from, to]| (from..=to).contains(&&row.number)).collect();
        states.entry(state).or_default().push(i);
    }
    let floors = states.into_values().filter_map(|rows| noise_floor(&data.subset(&rows)));
    let all = floors.fold(Scatter::default(), |sum, floor| Scatter {
        square: sum.square + floor.freedom as f64 * floor.sigma_mm.powi(2),
        poses: sum.poses + floor.poses,
        freedom: sum.freedom + floor.freedom,
    });
    all.pooled()
}

/// Places of a shift that are tried.
const MAX_CUTS: usize = 64;
/// Fewest poses that were measured before and after a shift.
const MIN_ACROSS: usize = 4;
/// Share of the differences across a shift that their mean must explain.
const IN_COMMON: f64 = 0.7;

/// The rows of a pose, outlet and approach, with their readings.
pub(crate) type Readings = Vec<(usize, Vector3<f64>)>;

/// Those that were repeated, without copies.
pub(crate) fn repeated_readings(data: &Dataset) -> Vec<Readings> {
    let mut out = readings_of_poses(data);
    if repeats_of_readings(data).are_copied() {
        for group in &mut out {
            let mut own: Readings = Vec::with_capacity(group.len());
            for (row, at) in group.iter() {
                if own.iter().all(|(_, known)| known != at) {
                    own.push((*row, *at));
                }
            }
            *group = own;
        }
        out.retain(|group| group.len() > 1);
    }
    out
}

/// Those that were repeated.
fn readings_of_poses(data: &Dataset) -> Vec<Readings> {
    with_poses(data, |poses| {
        let mut out = Vec::new();
        for pose in poses.filter(|pose| pose.len() > 1) {
            let mut alike: BTreeMap<(usize, [i8; 6]), Readings> = BTreeMap::new();
            for &i in pose {
                let row = &data.rows[i];
                let key = (row.anchor, row.condition.approach);
                alike.entry(key).or_default().push((i, row.reading.place_mm()));
            }
            out.extend(alike.into_values().filter(|rows| rows.len() > 1));
        }
        out
    })
}

/// The scatter before and after the row `cut`, where the readings after it differ by a common vector.
fn floor_on_either_side(groups: &[Readings], are_copied: bool, cut: usize) -> Option<NoiseFloor> {
    let mut scatter = Scatter::default();
    let mut across: Vec<Vector3<f64>> = Vec::new();
    for group in groups {
        let side = |is_after: bool| -> Vec<Vector3<f64>> {
            group.iter().filter(|(row, _)| (*row >= cut) == is_after).map(|(_, at)| *at).collect()
        };
        let [before, after] = [false, true].map(side);
        if !before.is_empty() && !after.is_empty() {
            let mean = |of: &[Vector3<f64>]| of.iter().sum::<Vector3<f64>>() / of.len() as f64;
            across.push(mean(&after) - mean(&before));
        }
        for readings in [before, after] {
            scatter.add(&if are_copied { distinct(&readings) } else { readings });
        }
    }
    let count = across.len() as f64;
    let common = across.iter().sum::<Vector3<f64>>().norm_squared() / count;
    let all: f64 = across.iter().map(Vector3::norm_squared).sum();
    let is_shift = across.len() >= MIN_ACROSS && common > IN_COMMON * all;
    scatter.pooled().filter(|floor| is_shift && floor.is_known())
}

/// The noise floor of orientations (rad), from rotation vectors relative to the first reading of each pose, as the root of the
/// sum over the coordinates. `None` where no pose was repeated or the sensor measures no orientation.
pub fn noise_floor_rad(data: &Dataset) -> Option<(f64, usize)> {
    let turn = |row: &Row| if let Reading::Pose(pose) = &row.reading { Some(pose.rotation) } else { None };
    let mut first = None;
    let against = |row: &Row, begins: bool| {
        let here = turn(row)?;
        let first = *if begins { first.insert(here) } else { first.get_or_insert(here) };
        Some((first.inverse() * here).scaled_axis())
    };
    pooled_scatter_by(data, against).map(|floor| (floor.sigma_mm, floor.freedom))
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
