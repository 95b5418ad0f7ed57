//! Rows grouped by the pose at which they were read.

use super::dataset::{Dataset, Row};

/// Rows grouped by pose, in the order of their first row. Two rows are of one pose when all joints agree (to 0.0005° in a
/// log rounded to fixed steps, else to 0.003°) and the controller's read-out, if logged, agrees too: it separates poses whose
/// angles are rounded coarsely.
pub fn poses(data: &Dataset) -> Vec<Vec<usize>> {
    with_poses(data, |poses| poses.map(<[usize]>::to_vec).collect())
}

/// The pose index of each row, in the order of [`poses`].
pub fn pose_of_rows(data: &Dataset) -> Vec<usize> {
    let mut out = vec![0; data.rows.len()];
    for (p, rows) in poses(data).iter().enumerate() {
        rows.iter().for_each(|&i| out[i] = p);
    }
    out
}

/// Calls `work` with the rows of each pose, as [`poses`] groups them; one shared list, since there can be a million.
pub(super) fn with_poses<T>(data: &Dataset, work: impl FnOnce(&mut dyn Iterator<Item = &[usize]>) -> T) -> T {
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

/// Largest joint difference between two rows of the same pose (rad): below the step of a rounded log, or the scatter of an
/// encoder at rest.
fn same_pose_rad(data: &Dataset) -> f64 {
    if data.angle_step_rad.is_some() { 0.000_5f64.to_radians() } else { 0.003f64.to_radians() }
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
