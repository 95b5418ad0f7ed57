//! Registration of the sensor's frame and target from nominal poses: the start of every identification.
//!
//! Method: closed forms where there are any, then a few damped Gauss–Newton steps on the true residual.
//!
//! - [`points`]: base_from_sensor from point pairs (Umeyama 1991, eq. 34 to 43, without scale).
//! - [`target_point`]: base_from_sensor B and the point t on the flange with Fᵢ t = B mᵢ; linear in (R_B, b, t), with
//!   R_B projected to the nearest rotation.
//! - [`poses`]: B and flange_from_target T with B Mᵢ = Fᵢ T (Shah 2013: the rotations from the first singular
//!   vectors of Σ R_Mᵢᵀ ⊗ R_Fᵢᵀ).
//! - [`cable`]: outlet o and zero z with lᵢ = |pᵢ − o| + z; linear in (o, z, |o|² − z²) after squaring, plus starts in
//!   all directions, since poses near a plane do not distinguish an outlet from its mirror image.
//!
//! Shapes: n poses of the flange in the base and as many readings, paired by index. Stopping rule: see `fit`. Departures:
//! rows are not weighted; every closed form has a second start for the cases in which it is degenerate. Where the poses do not
//! show the target's place on the flange, a fit without a prior puts it metres away, to gain what an arm is off by: it is then
//! fitted again with one (`UnseenTarget`).
//! Checked against known truth, and against the UR arms' residuals with frames alone.

mod fit;

use nalgebra::{
    DMatrix, DVector, Matrix3, Point3, SMatrix, SVector, SymmetricEigen, Translation3, UnitQuaternion,
    Vector3, Vector6,
};

use self::fit::{Normal, fit};
use truegrind_math::se3::{Pose, apply_twist, difference, rotation_from_matrix, skew};

/// Lever arm that converts an orientation error to a position error [mm/rad] where both are summed.
const LEVER_MM: f64 = 300.0;

/// Result of [`points`]: a sensor's frame.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct FrameRegistration {
    /// The sensor's frame in the arm's base.
    pub base_from_sensor: Pose,
    /// Root mean square residual distance (mm).
    pub rmse_mm: f64,
}

/// Result of [`target_point`]: a sensor's frame and its target.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PointRegistration {
    /// The sensor's frame in the arm's base.
    pub base_from_sensor: Pose,
    /// The target in the flange frame (mm).
    pub target_mm: Vector3<f64>,
    /// Root mean square residual distance (mm).
    pub rmse_mm: f64,
    /// Whether a direction of `target_mm` is held by its prior, since the poses do not show it.
    pub is_target_held: bool,
}

/// Result of [`poses`]: a sensor's frame and the frame of its target.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PoseRegistration {
    /// The sensor's frame in the arm's base.
    pub base_from_sensor: Pose,
    /// The target on the flange.
    pub flange_from_target: Pose,
    /// Root mean square residual distance (mm).
    pub rmse_mm: f64,
    /// Root mean square residual rotation (rad).
    pub rmse_rad: f64,
    /// Whether a direction of the target's place is held by its prior, since the poses do not show it.
    pub is_target_held: bool,
}

/// Result of [`cable`]: a cable's outlet.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct CableRegistration {
    /// The outlet in the arm's base (mm).
    pub outlet_mm: Vector3<f64>,
    /// Reading at length zero (mm).
    pub zero_mm: f64,
    /// Root mean square residual length (mm).
    pub rmse_mm: f64,
    /// The second-best outlet and zero, where another local minimum has at most twice the error: the poses hardly
    /// distinguish the two.
    pub rival: Option<(Vector3<f64>, f64)>,
}

/// The proper rotation nearest to a matrix (Umeyama 1991, eq. 43). `None` when the matrix leaves more than one direction
/// undetermined.
fn nearest_rotation(matrix: &Matrix3<f64>) -> Option<UnitQuaternion<f64>> {
    // The squares must be finite, or the SVD iteration does not end.
    if !matrix.iter().all(|v| v.abs() < 1e100) {
        return None;
    }
    let svd = matrix.svd(true, true);
    let (u, v_t) = (svd.u?, svd.v_t?);
    let s = svd.singular_values;
    if s[1].is_nan() || s[1] <= 1e-9 * s[0] {
        return None;
    }
    let sign = Matrix3::from_diagonal(&Vector3::new(1.0, 1.0, (u * v_t).determinant().signum()));
    Some(rotation_from_matrix(&(u * sign * v_t)))
}

/// The rigid motion from points in the sensor's frame to points in the base, by least squares.
///
/// `None` for fewer than three points, points on a line, or non-finite numbers.
pub fn points(base_mm: &[Vector3<f64>], sensor_mm: &[Vector3<f64>]) -> Option<FrameRegistration> {
    let n = base_mm.len().min(sensor_mm.len());
    if n < 3 || base_mm.iter().chain(sensor_mm).any(|p| !p.iter().all(|v| v.is_finite())) {
        return None;
    }
    let mean = |list: &[Vector3<f64>]| list[..n].iter().sum::<Vector3<f64>>() / n as f64;
    let (centre_base, centre_sensor) = (mean(base_mm), mean(sensor_mm));
    let mut covariance = Matrix3::zeros();
    for (b, s) in base_mm.iter().zip(sensor_mm) {
        covariance += (b - centre_base) * (s - centre_sensor).transpose();
    }
    let rotation = nearest_rotation(&covariance)?;
    let translation = Translation3::from(centre_base - rotation * centre_sensor);
    let base_from_sensor = Pose::from_parts(translation, rotation);
    let square = base_mm
        .iter()
        .zip(sensor_mm)
        .map(|(b, s)| (base_from_sensor * Point3::from(*s) - Point3::from(*b)).norm_squared())
        .sum::<f64>();
    Some(FrameRegistration { base_from_sensor, rmse_mm: (square / n as f64).sqrt() })
}

/// Standard deviation of a target about the flange's origin (mm): a hook or a reflector has a stand-off.
pub const TARGET_SIGMA_MM: f64 = 50.0;

/// Residual below which rows count as exact (mm), where it weights a prior.
const EXACT_MM: f64 = 1e-3;

/// The prior of a target that the poses do not show.
///
/// An arm's errors follow its pose, so that many rows do not average them out: a residual of r mm in each of n rows moves the target by
/// r/√(λ/n), λ the information on a direction beside the frame. Where that is more than [`TARGET_SIGMA_MM`], the prior knows more.
struct UnseenTarget {
    /// Weight of a row of the prior.
    per_mm: f64,
}

impl UnseenTarget {
    /// The prior where one is needed: `normal` are the equations at the fit, the target's place at `at`; residual `rmse_mm` in `n` rows.
    fn of(normal: &Normal, at: usize, rmse_mm: f64, n: usize) -> Option<Self> {
        let rmse_mm = rmse_mm.max(EXACT_MM);
        let least = normal.least_information(at)? / n as f64;
        (!is_seen(least, rmse_mm)).then(|| Self { per_mm: rmse_mm * (n as f64).sqrt() / TARGET_SIGMA_MM })
    }

    /// Adds the prior's rows about the flange's origin to equations of `size` unknowns.
    fn add(&self, target_mm: &Vector3<f64>, at: usize, size: usize, normal: &mut Normal) {
        for k in 0..3 {
            let mut row = vec![0.0; size];
            row[at + k] = self.per_mm;
            normal.add(&row, self.per_mm * target_mm[k]);
        }
    }
}

/// Whether rows with so much information each on the least seen direction of the target show it, `rmse_mm` being off.
fn is_seen(least_information: f64, rmse_mm: f64) -> bool {
    least_information > 0.0 && rmse_mm.max(EXACT_MM) / least_information.sqrt() <= TARGET_SIGMA_MM
}

/// The equations of rows that see the target at `target_mm` on the flange: the sensor's frame (3 + 3), then the target.
fn add_target_rows(
    flange: &Pose,
    target_mm: &Vector3<f64>,
    seen_mm: &Vector3<f64>,
    base_mm: &Vector3<f64>,
    normal: &mut Normal,
) {
    let residual = flange.rotation * target_mm + flange.translation.vector - seen_mm - base_mm;
    let turn = skew(seen_mm);
    let to_base = flange.rotation.to_rotation_matrix();
    for k in 0..3 {
        let mut row = [0.0; 9];
        row[k] = -1.0;
        for c in 0..3 {
            row[3 + c] = turn[(k, c)];
            row[6 + c] = to_base[(k, c)];
        }
        normal.add(&row, residual[k]);
    }
}

/// Whether poses show the place of a target near `target_mm` on the flange beside the sensor's frame, where the arm is off by `rmse_mm`.
///
/// What a reading is does not count: only how the poses turn the flange.
pub fn poses_show_target(base_from_flange: &[Pose], target_mm: &Vector3<f64>, rmse_mm: f64) -> bool {
    let places: Vec<Vector3<f64>> =
        base_from_flange.iter().map(|f| (f * Point3::from(*target_mm)).coords).collect();
    // The sensor's frame about the middle of the places, where its turn and its place are told apart best.
    let middle = places.iter().sum::<Vector3<f64>>() / places.len().max(1) as f64;
    let mut normal = Normal::new(9);
    for (flange, place) in base_from_flange.iter().zip(&places) {
        add_target_rows(flange, target_mm, &(place - middle), &middle, &mut normal);
    }
    let least = normal.least_information(6).map_or(0.0, |least| least / places.len().max(1) as f64);
    is_seen(least, rmse_mm)
}

/// The sensor's frame and its unknown target on the flange.
///
/// Where the orientation of the flange hardly changes, target and frame are not separately identifiable; the target then
/// remains near the flange's origin.
pub fn target_point(base_from_flange: &[Pose], measured_mm: &[Vector3<f64>]) -> Option<PointRegistration> {
    let n = base_from_flange.len().min(measured_mm.len());
    let origins: Vec<_> = base_from_flange.iter().map(|f| f.translation.vector).collect();
    let plain = points(&origins, measured_mm)?;
    let mut starts = vec![(plain.base_from_sensor, Vector3::zeros())];
    starts.extend(linear_target_point(base_from_flange, measured_mm));
    let rows = |state: &(Pose, Vector3<f64>), normal: &mut Normal| {
        let (base_from_sensor, t) = state;
        for (flange, m) in base_from_flange.iter().zip(measured_mm) {
            let seen = base_from_sensor.rotation * m;
            add_target_rows(flange, t, &seen, &base_from_sensor.translation.vector, normal);
        }
    };
    let step = |state: &(Pose, Vector3<f64>), d: &DVector<f64>| {
        let twist = Vector6::from_iterator(d.iter().take(6).copied());
        (apply_twist(&state.0, &twist), state.1 + Vector3::new(d[6], d[7], d[8]))
    };
    let (cost, found) = best_start(starts, 9, rows, step)?;
    let mut normal = Normal::new(9);
    rows(&found, &mut normal);
    let rmse = |cost: f64| (cost / n as f64).sqrt();
    let Some(unseen) = UnseenTarget::of(&normal, 6, rmse(cost), n) else {
        let (base_from_sensor, target_mm) = found;
        return Some(PointRegistration {
            base_from_sensor,
            target_mm,
            rmse_mm: rmse(cost),
            is_target_held: false,
        });
    };
    let held = |state: &(Pose, Vector3<f64>), normal: &mut Normal| {
        rows(state, normal);
        unseen.add(&state.1, 6, 9, normal);
    };
    let starts = vec![(plain.base_from_sensor, Vector3::zeros()), found];
    let (_, (base_from_sensor, target_mm)) = best_start(starts, 9, held, step)?;
    let mut normal = Normal::new(9);
    rows(&(base_from_sensor, target_mm), &mut normal);
    let rmse_mm = rmse(normal.cost);
    Some(PointRegistration { base_from_sensor, target_mm, rmse_mm, is_target_held: true })
}

/// The sensor's frame for a target whose place on the flange is known.
pub fn known_target(
    base_from_flange: &[Pose],
    measured_mm: &[Vector3<f64>],
    target_mm: &Vector3<f64>,
) -> Option<FrameRegistration> {
    let places: Vec<_> =
        base_from_flange.iter().map(|flange| (flange * Point3::from(*target_mm)).coords).collect();
    points(&places, measured_mm)
}

/// The target in the flange frame (mm) for a sensor whose frame is known: the mean of what the rows say.
pub fn target_in_known_frame(
    base_from_flange: &[Pose],
    measured_mm: &[Vector3<f64>],
    base_from_sensor: &Pose,
) -> Vector3<f64> {
    let n = base_from_flange.len().min(measured_mm.len()).max(1);
    let on_flange =
        |(flange, m): (&Pose, &Vector3<f64>)| flange.inverse() * (base_from_sensor * Point3::from(*m));
    base_from_flange.iter().zip(measured_mm).map(|pair| on_flange(pair).coords).sum::<Vector3<f64>>()
        / n as f64
}

/// R_B, b, t from Rᵢ t − R_B mᵢ − b = −pᵢ as if the nine entries of R_B were free.
fn linear_target_point(
    base_from_flange: &[Pose],
    measured_mm: &[Vector3<f64>],
) -> Option<(Pose, Vector3<f64>)> {
    // Metres give all columns a similar scale.
    let mut normal = Normal::new(15);
    for (flange, m) in base_from_flange.iter().zip(measured_mm) {
        let to_base = flange.rotation.to_rotation_matrix();
        for k in 0..3 {
            let mut row = [0.0; 15];
            for c in 0..3 {
                row[3 * k + c] = -m[c] * 1e-3;
                row[12 + c] = to_base[(k, c)];
            }
            row[9 + k] = -1.0;
            normal.add(&row, flange.translation.vector[k] * 1e-3);
        }
    }
    let x = normal.least_norm_step(1e-10)?;
    let rotation = nearest_rotation(&Matrix3::from_fn(|k, c| x[3 * k + c]))?;
    let b = Vector3::new(x[9], x[10], x[11]) * 1e3;
    let t = Vector3::new(x[12], x[13], x[14]) * 1e3;
    Some((Pose::from_parts(Translation3::from(b), rotation), t))
}

/// The sensor's frame and its target's frame on the flange, from full poses: B Mᵢ ≈ Fᵢ T.
pub fn poses(base_from_flange: &[Pose], sensor_from_target: &[Pose]) -> Option<PoseRegistration> {
    let n = base_from_flange.len().min(sensor_from_target.len());
    let measured: Vec<_> = sensor_from_target.iter().map(|m| m.translation.vector).collect();
    let point = target_point(base_from_flange, &measured)?;
    let mut rotations = vec![point.base_from_sensor.rotation];
    rotations.extend(shah_rotation(base_from_flange, sensor_from_target));
    let starts = rotations
        .into_iter()
        .filter_map(|rotation| solve_translations(base_from_flange, sensor_from_target, rotation))
        .collect();
    let rows = |state: &(Pose, Pose), normal: &mut Normal| {
        for (f, m) in base_from_flange.iter().zip(sensor_from_target) {
            let (predicted, seen) = (f * state.1, state.0 * m);
            let residual = difference(&seen, &predicted);
            let turn_seen = skew(&(seen.translation.vector - state.0.translation.vector));
            let turn_tool = skew(&(predicted.translation.vector - f.translation.vector));
            let to_base = f.rotation.to_rotation_matrix();
            let lever = to_base.matrix();
            // The target's twist is in the flange frame, about the flange's origin.
            let turned = -turn_tool * lever;
            for k in 0..3 {
                let mut row = [0.0; 12];
                row[k] = -1.0;
                let mut turn = [0.0; 12];
                turn[3 + k] = -LEVER_MM;
                for c in 0..3 {
                    row[3 + c] = turn_seen[(k, c)];
                    row[6 + c] = lever[(k, c)];
                    row[9 + c] = turned[(k, c)];
                    turn[9 + c] = LEVER_MM * lever[(k, c)];
                }
                normal.add(&row, residual[k]);
                normal.add(&turn, LEVER_MM * residual[3 + k]);
            }
        }
    };
    let step = |state: &(Pose, Pose), d: &DVector<f64>| {
        let at = |k: usize| Vector6::from_iterator(d.iter().skip(k).take(6).copied());
        let turn = UnitQuaternion::from_scaled_axis(Vector3::new(d[9], d[10], d[11]));
        let target = Pose::from_parts(
            Translation3::from(turn * state.1.translation.vector + Vector3::new(d[6], d[7], d[8])),
            turn * state.1.rotation,
        );
        (apply_twist(&state.0, &at(0)), target)
    };
    let (_, found) = best_start(starts, 12, rows, step)?;
    let residuals = |(base_from_sensor, flange_from_target): &(Pose, Pose)| {
        let (mut square_mm, mut square_rad) = (0.0, 0.0);
        for (f, m) in base_from_flange.iter().zip(sensor_from_target) {
            let d = difference(&(base_from_sensor * m), &(f * flange_from_target));
            square_mm += d.fixed_rows::<3>(0).norm_squared();
            square_rad += d.fixed_rows::<3>(3).norm_squared();
        }
        [square_mm, square_rad].map(|square: f64| (square / n as f64).sqrt())
    };
    let mut normal = Normal::new(12);
    rows(&found, &mut normal);
    let unseen = UnseenTarget::of(&normal, 6, residuals(&found)[0], n);
    let is_target_held = unseen.is_some();
    let (base_from_sensor, flange_from_target) = match unseen {
        None => found,
        Some(unseen) => {
            let held = |state: &(Pose, Pose), normal: &mut Normal| {
                rows(state, normal);
                unseen.add(&state.1.translation.vector, 6, 12, normal);
            };
            let at_flange = Pose::from_parts(Translation3::identity(), found.1.rotation);
            let placed = known_target(base_from_flange, &measured, &Vector3::zeros())?.base_from_sensor;
            best_start(vec![(placed, at_flange), found], 12, held, step)?.1
        }
    };
    let [rmse_mm, rmse_rad] = residuals(&(base_from_sensor, flange_from_target));
    Some(PoseRegistration { base_from_sensor, flange_from_target, rmse_mm, rmse_rad, is_target_held })
}

/// Both frames for a known rotation of the sensor: the target's rotation is the mean, both translations follow linearly.
fn solve_translations(
    base_from_flange: &[Pose],
    sensor_from_target: &[Pose],
    rotation: UnitQuaternion<f64>,
) -> Option<(Pose, Pose)> {
    let target = mean_rotation(
        base_from_flange
            .iter()
            .zip(sensor_from_target)
            .map(|(f, m)| f.rotation.inverse() * rotation * m.rotation),
    )?;
    let mut normal = Normal::new(6);
    for (f, m) in base_from_flange.iter().zip(sensor_from_target) {
        let residual = f.translation.vector - rotation * m.translation.vector;
        let to_base = f.rotation.to_rotation_matrix();
        for k in 0..3 {
            let mut row = [0.0; 6];
            row[k] = -1.0;
            for c in 0..3 {
                row[3 + c] = to_base[(k, c)];
            }
            normal.add(&row, residual[k]);
        }
    }
    let x = normal.least_norm_step(1e-10)?;
    let base_from_sensor = Pose::from_parts(Translation3::new(x[0], x[1], x[2]), rotation);
    Some((base_from_sensor, Pose::from_parts(Translation3::new(x[3], x[4], x[5]), target)))
}

/// The sensor's rotation in the base from rotations alone (Shah 2013, eq. 22 to 28).
fn shah_rotation(base_from_flange: &[Pose], sensor_from_target: &[Pose]) -> Option<UnitQuaternion<f64>> {
    let mut sum = SMatrix::<f64, 9, 9>::zeros();
    for (f, m) in base_from_flange.iter().zip(sensor_from_target) {
        let (f, m) = (f.rotation.to_rotation_matrix(), m.rotation.to_rotation_matrix());
        sum += m.matrix().transpose().kronecker(&f.matrix().transpose());
    }
    // sum · vec(R_B) = n · vec(R_T), columns stacked.
    if !sum.iter().all(|v| v.is_finite()) {
        return None;
    }
    let eigen = SymmetricEigen::new(sum.transpose() * sum);
    let v: SVector<f64, 9> = eigen.eigenvectors.column(eigen.eigenvalues.imax()).into_owned();
    let matrix = Matrix3::from_column_slice(v.as_slice());
    // The singular vector's sign is arbitrary; a rotation has a positive determinant.
    nearest_rotation(&(matrix * matrix.determinant().signum()))
}

/// Mean of rotations: the first eigenvector of Σ q qᵀ (Markley et al. 2007).
fn mean_rotation(rotations: impl Iterator<Item = UnitQuaternion<f64>>) -> Option<UnitQuaternion<f64>> {
    let sum = rotations.fold(SMatrix::<f64, 4, 4>::zeros(), |sum, q| sum + q.coords * q.coords.transpose());
    if !sum.iter().all(|v| v.is_finite()) {
        return None;
    }
    let eigen = SymmetricEigen::new(sum);
    let v = eigen.eigenvectors.column(eigen.eigenvalues.imax()).into_owned();
    Some(UnitQuaternion::from_quaternion(nalgebra::Quaternion::from(SVector::<f64, 4>::from(v))))
}

/// Prior standard deviation of a cable's zero and of its hook [mm per mm of residual]: lengths measured from one side
/// hardly separate them from the outlet's distance.
const PRIOR_SIGMA_RATIO: f64 = 200.0;

/// A cable's outlet and zero from the hook's positions in the base and the lengths read.
///
/// `None` for fewer than four rows or non-finite numbers. The zero has a weak prior (σ 200 mm for residuals of 1 mm).
pub fn cable(hook_mm: &[Vector3<f64>], lengths_mm: &[f64]) -> Option<CableRegistration> {
    let n = hook_mm.len().min(lengths_mm.len());
    if n < 4
        || hook_mm.iter().any(|p| !p.iter().all(|v| v.is_finite()))
        || lengths_mm.iter().any(|l| !l.is_finite())
    {
        return None;
    }
    let (hook_mm, lengths_mm) = (&hook_mm[..n], &lengths_mm[..n]);
    let centre = hook_mm.iter().sum::<Vector3<f64>>() / n as f64;
    let reach = lengths_mm.iter().sum::<f64>() / n as f64;
    let mut starts: Vec<(Vector3<f64>, f64)> = Vec::new();
    for (i, j, k) in (0..27).map(|c| (c / 9 - 1, c / 3 % 3 - 1, c % 3 - 1)).filter(|d| *d != (0, 0, 0)) {
        let direction = Vector3::new(f64::from(i), f64::from(j), f64::from(k)).normalize();
        starts.push((centre + direction * reach.abs().max(1.0), 0.0));
    }
    if let Some((outlet, zero)) = squared_lengths(hook_mm, lengths_mm, &centre) {
        let spread: Matrix3<f64> = hook_mm.iter().map(|p| (p - centre) * (p - centre).transpose()).sum();
        let eigen = SymmetricEigen::new(spread);
        let normal = eigen.eigenvectors.column(eigen.eigenvalues.imin()).into_owned();
        starts.push((outlet, zero));
        starts.push((outlet - normal * 2.0 * normal.dot(&(outlet - centre)), zero));
    }
    let rows =
        |points: &[Vector3<f64>], lengths: &[f64], state: &(Vector3<f64>, f64), normal: &mut Normal| {
            for (p, l) in points.iter().zip(lengths) {
                let away = state.0 - p;
                let distance = away.norm().max(1e-6);
                let u = away / distance;
                normal.add(&[u.x, u.y, u.z, 1.0], distance + state.1 - l);
            }
            normal.add(&[0.0, 0.0, 0.0, 1.0 / PRIOR_SIGMA_RATIO], state.1 / PRIOR_SIGMA_RATIO);
        };
    let step = |state: &(Vector3<f64>, f64), d: &DVector<f64>| {
        (state.0 + Vector3::new(d[0], d[1], d[2]), state.1 + d[3])
    };
    // Local minima are found on a sample of the rows; only the best few are refined on all rows.
    let stride = n.div_ceil(80);
    let thin_points: Vec<_> = hook_mm.iter().step_by(stride).copied().collect();
    let thin_lengths: Vec<_> = lengths_mm.iter().step_by(stride).copied().collect();
    let mut minima: Vec<(f64, (Vector3<f64>, f64))> = Vec::new();
    for start in starts {
        let (cost, state) = fit(start, 4, |s, normal| rows(&thin_points, &thin_lengths, s, normal), step);
        let known = minima.iter().any(|(_, other)| (other.0 - state.0).norm() < 1.0);
        if cost.is_finite() && !known {
            minima.push((cost, state));
        }
    }
    minima.sort_by(|a, b| a.0.total_cmp(&b.0));
    let mut refined: Vec<_> = minima
        .into_iter()
        .take(3)
        .map(|(_, state)| fit(state, 4, |s, normal| rows(hook_mm, lengths_mm, s, normal), step))
        .collect();
    refined.sort_by(|a, b| a.0.total_cmp(&b.0));
    let rmse = |cost: f64| (cost / n as f64).sqrt();
    let (cost, (outlet_mm, zero_mm)) = *refined.first()?;
    let rival = refined
        .iter()
        .skip(1)
        .find(|(c, (o, _))| rmse(*c) < 2.0 * rmse(cost).max(1e-3) && (o - outlet_mm).norm() > 1.0)
        .map(|(_, state)| *state);
    Some(CableRegistration { outlet_mm, zero_mm, rmse_mm: rmse(cost), rival })
}

/// A cable's outlet and zero together with the hook on the flange, all unknown.
///
/// The hook has a prior about the flange's origin (σ 200 mm for residuals of 1 mm): one cable measures one direction at
/// each pose, and only rotations of the flange separate the hook from the outlet.
pub fn cable_and_hook(
    base_from_flange: &[Pose],
    lengths_mm: &[f64],
) -> Option<(CableRegistration, Vector3<f64>)> {
    let n = base_from_flange.len().min(lengths_mm.len());
    let origins: Vec<_> = base_from_flange[..n].iter().map(|f| f.translation.vector).collect();
    let plain = cable(&origins, lengths_mm)?;
    let mut starts = vec![(plain.outlet_mm, plain.zero_mm, Vector3::zeros())];
    starts.extend(plain.rival.map(|(outlet, zero)| (outlet, zero, Vector3::zeros())));
    let rows = |(outlet, zero, hook): &(Vector3<f64>, f64, Vector3<f64>), normal: &mut Normal| {
        for (flange, length) in base_from_flange.iter().zip(lengths_mm) {
            let away = flange.rotation * hook + flange.translation.vector - outlet;
            let distance = away.norm().max(1e-6);
            let u = away / distance;
            let on_flange = flange.rotation.inverse_transform_vector(&u);
            let row = [-u.x, -u.y, -u.z, 1.0, on_flange.x, on_flange.y, on_flange.z];
            normal.add(&row, distance + zero - length);
        }
        for (k, value) in [(3, *zero), (4, hook.x), (5, hook.y), (6, hook.z)] {
            let mut row = [0.0; 7];
            row[k] = 1.0 / PRIOR_SIGMA_RATIO;
            normal.add(&row, value / PRIOR_SIGMA_RATIO);
        }
    };
    let step = |(outlet, zero, hook): &(Vector3<f64>, f64, Vector3<f64>), d: &DVector<f64>| {
        (outlet + Vector3::new(d[0], d[1], d[2]), zero + d[3], hook + Vector3::new(d[4], d[5], d[6]))
    };
    let (cost, (outlet_mm, zero_mm, hook_mm)) = best_start(starts, 7, rows, step)?;
    let rmse_mm = (cost / n as f64).sqrt();
    Some((CableRegistration { outlet_mm, zero_mm, rmse_mm, rival: None }, hook_mm))
}

/// o, z from lᵢ² − |pᵢ|² = 2 lᵢ z − 2 pᵢ·o + (|o|² − z²), with the last bracket as a free unknown.
fn squared_lengths(
    hook_mm: &[Vector3<f64>],
    lengths_mm: &[f64],
    centre: &Vector3<f64>,
) -> Option<(Vector3<f64>, f64)> {
    let mut normal = Normal::new(5);
    for (p, l) in hook_mm.iter().zip(lengths_mm) {
        let (p, l) = ((p - centre) * 1e-3, l * 1e-3);
        normal.add(&[-2.0 * p.x, -2.0 * p.y, -2.0 * p.z, 2.0 * l, 1.0], p.norm_squared() - l * l);
    }
    let x = normal.least_norm_step(1e-10)?;
    Some((centre + Vector3::new(x[0], x[1], x[2]) * 1e3, x[3] * 1e3))
}

/// The best fit of several starts. A later one must be better by more than rounding, so that the first and simplest start
/// decides directions that the data do not determine.
fn best_start<S: Clone>(
    starts: Vec<S>,
    size: usize,
    rows: impl Fn(&S, &mut Normal),
    step: impl Fn(&S, &DVector<f64>) -> S,
) -> Option<(f64, S)> {
    starts
        .into_iter()
        .map(|start| fit(start, size, &rows, &step))
        .filter(|(cost, _)| cost.is_finite())
        .reduce(|best, next| if next.0 + 1e-9 < 0.999 * best.0 { next } else { best })
}

impl Normal {
    /// The least information on any direction of the three unknowns from `at` on, all others free; 0 where there is none. `None` where a
    /// number is not finite.
    fn least_information(&self, at: usize) -> Option<f64> {
        if !self.matrix.iter().all(|v| v.is_finite()) {
            return None;
        }
        let others: Vec<usize> = (0..self.gradient.len()).filter(|k| !(at..at + 3).contains(k)).collect();
        let across = self.matrix.select_rows(&others).columns(at, 3).into_owned();
        let own = self.matrix.view((at, at), (3, 3)).into_owned();
        // Of an unknown of the others that the rows do not show nothing is taken off.
        let eigen = SymmetricEigen::new(self.matrix.select_rows(&others).select_columns(&others));
        let floor = eigen.eigenvalues.max() * 1e-14;
        let mut left = own;
        for (value, vector) in eigen.eigenvalues.iter().zip(eigen.eigenvectors.column_iter()) {
            if *value > floor {
                let share = across.tr_mul(&vector);
                left -= &share * share.transpose() / *value;
            }
        }
        Some(SymmetricEigen::new(left).eigenvalues.min().max(0.0))
    }

    /// The minimum-norm least-squares step; eigenvalues below `relative` times the largest count as 0.
    fn least_norm_step(&self, relative: f64) -> Option<DVector<f64>> {
        let matrix: DMatrix<f64> = self.matrix.clone();
        if !matrix.iter().all(|v| v.is_finite()) {
            return None;
        }
        let eigen = SymmetricEigen::new(matrix);
        let floor = eigen.eigenvalues.max() * relative;
        let mut out = DVector::zeros(self.gradient.len());
        for (value, vector) in eigen.eigenvalues.iter().zip(eigen.eigenvectors.column_iter()) {
            if *value > floor {
                out -= vector * (vector.dot(&self.gradient) / value);
            }
        }
        Some(out)
    }
}
