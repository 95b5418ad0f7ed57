//! An estimated arm: the nominal arm, all identified parameters with their covariance, and their provenance.
//!
//! The TOML file of an estimated arm is complete: it contains the nominal arm too, so it suffices to correct programs.

pub mod beyond_noise;
mod checks;
mod error;
mod file;
mod posterior;
mod verdict;
mod width_uncertainty;

use nalgebra::{DMatrix, Vector3, Vector6};
use serde::{Deserialize, Serialize};

use super::chain::{Chain, cross, minus, scaled};
use super::condition::Condition;
use super::jacobian::EffectTwists;
use super::model::{Model, PreparedModel};
use super::parameter::{LinkCoordinate, Parameter};
use super::region::Region;
use super::sensor::Sensor;
use crate::joints::Joints;
use truegrind_math::lanes::{AnyWidth, Real, SinCos, WIDTH, vectorised};
use truegrind_math::se3::Pose;
use truegrind_math::statistics::ErrorSummary;

pub use error::{ModelFileError, SCHEMA};
pub use verdict::{Judgement, Reason, ReasonKind, Verdict};
pub use width_uncertainty::{PosteriorComponent, WidthUncertainty};

/// One identified number.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct EstimatedParameter {
    /// Name, as `link2.alpha`.
    pub name: String,
    /// Unit of all the numbers.
    pub unit: String,
    /// Value of the data sheet (0 for an effect).
    pub nominal: f64,
    /// Estimated value.
    pub value: f64,
    /// Standard deviation of the estimate, priors included.
    pub sigma: f64,
    /// Standard deviation of the prior; absent without one.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub prior_sigma: Option<f64>,
    /// Share of the information that came from the data: 1 − (sigma / prior sigma)²; 0 where the prior alone determines it.
    pub determined: f64,
}

impl EstimatedParameter {
    /// Whether it belongs to a link.
    pub fn is_of_link(&self) -> bool {
        self.name.starts_with("link")
    }

    /// Whether it belongs to the arm (a link or an effect) rather than to the sensor.
    pub fn is_of_arm(&self) -> bool {
        self.is_of_link() || self.name.starts_with("effect")
    }
}

/// Where an estimate came from.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Provenance {
    /// Measurement file.
    pub file: String,
    /// SHA-256 of its bytes.
    pub sha256: String,
    /// Rows used.
    pub rows: usize,
    /// Rows set aside as outliers, as the spreadsheet counts them.
    pub set_aside: Vec<usize>,
    /// Sensor.
    pub sensor: Sensor,
    /// Method by name.
    pub method: String,
    /// Seed of the split.
    pub seed: u64,
    /// Share of rows that was held out to state the error.
    pub held_out: f64,
    /// Whether rounded angles were refined by read-out fusion.
    pub sharpened: bool,
    /// Version of truegrind.
    pub version: String,
}

/// Errors of one stage on fitted and on held-out rows (mm).
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct StageErrors {
    /// Rows of the fit.
    pub fitted: ErrorSummary,
    /// Held-out rows.
    pub held_out: ErrorSummary,
}

/// An estimated arm.
#[derive(Debug, Clone, PartialEq)]
pub struct Estimated {
    /// Catalogue name of the nominal arm.
    pub robot: String,
    /// The nominal arm, with which the controller computes.
    pub nominal: Model,
    /// The estimated arm. Doubtful effects are included with parameters 0, for the covariance.
    pub model: Model,
    /// All identified parameters, those of the arm first.
    pub parameters: Vec<EstimatedParameter>,
    /// Parameters of the arm in the order of the covariance.
    pub order: Vec<Parameter>,
    /// Covariance of the arm's parameters (mm, rad).
    pub covariance: DMatrix<f64>,
    /// How uncertain the widths of the tolerances are that the covariance assumes; absent where they were stated.
    pub width_uncertainty: Option<WidthUncertainty>,
    /// Where the data came from.
    pub provenance: Provenance,
    /// Errors of the nominal arm with registered frames.
    pub registered: StageErrors,
    /// Errors of the calibrated arm: with geometry, and after a diagnosis with its causes.
    pub calibrated: StageErrors,
    /// Noise floor from sensor and rounding (mm); absent where it is unknown.
    pub noise_floor_mm: Option<f64>,
    /// RMS error of a position that the model leaves beyond the noise (mm); absent where the noise is unknown.
    pub beyond_noise_mm: Option<f64>,
    /// The same as errors of the joints' angles (rad, 1 σ) that move the measured target by as much ([`beyond_noise`]): what is counted
    /// in every σ. Absent where the noise is unknown, and in files of earlier versions.
    pub beyond_noise_rad: Option<[f64; 6]>,
    /// The judgement.
    pub verdict: Verdict,
    /// Where the arm was measured.
    pub region: Region,
    /// The condition for which the estimate is valid.
    pub condition: Condition,
}

/// A frame registered with the arm, so that it depends on the arm's parameters.
#[derive(Debug, Clone, PartialEq)]
pub struct RegisteredFrame {
    /// Its origin in the base (mm).
    pub origin_mm: Vector3<f64>,
    /// Its twist in the base per unit of each parameter of the covariance: velocity of the origin, angular velocity.
    pub twists: Vec<Vector6<f64>>,
    /// Share of the variance of the errors beyond the noise ([`beyond_noise`]) that is left of a point relative to the frame: 1 where
    /// the frame does not follow them.
    pub beyond_share: f64,
}

impl RegisteredFrame {
    /// The frame with its twists borrowed.
    pub fn carried(&self) -> CarriedFrame<'_> {
        CarriedFrame { origin_mm: self.origin_mm, twists: &self.twists, beyond_share: self.beyond_share }
    }
}

/// A [`RegisteredFrame`] whose twists are stored elsewhere, perhaps in one list with those of many others.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct CarriedFrame<'a> {
    /// See [`RegisteredFrame::origin_mm`].
    pub origin_mm: Vector3<f64>,
    /// See [`RegisteredFrame::twists`].
    pub twists: &'a [Vector6<f64>],
    /// See [`RegisteredFrame::beyond_share`].
    pub beyond_share: f64,
}

/// A point on the flange whose predicted σ is computed.
#[derive(Debug, Clone, Copy)]
pub struct FlangePoint<'a> {
    /// Controller angles (rad).
    pub joints: Joints,
    /// The point on the flange: its translation counts.
    pub flange_from_tool: Pose,
    /// The registered frame relative to which σ is computed.
    pub carried: Option<CarriedFrame<'a>>,
}

/// Eight points' numbers side by side.
type Eight = [f64; WIDTH];

/// Velocities of points on the last frame for the link parameters (zero for all others); returns the points in the base (mm).
struct LinkVelocities<'a, const MOVES: bool> {
    arm: &'a PreparedModel<'a>,
    angles: &'a [Eight; 6],
    rides: &'a [Eight; 3],
    scale: f64,
    order: &'a [Parameter],
    velocities: &'a mut [[Eight; 3]],
}

impl<const MOVES: bool> AnyWidth for LinkVelocities<'_, MOVES> {
    type Output = [Eight; 3];

    #[cfg_attr(not(debug_assertions), inline(always))]
    fn run<R: SinCos>(self, like: R) -> [Eight; 3] {
        let mut points = [[0.0; WIDTH]; 3];
        for from in (0..WIDTH).step_by(R::ROWS) {
            let mapped = self.arm.apply_joint_map(&loaded(like, self.angles, from));
            let frames = self.arm.frames_at::<R, MOVES>(&mapped);
            let rides = loaded(like, self.rides, from);
            let mut point = frames.origin[6];
            for (k, coordinate) in point.iter_mut().enumerate() {
                *coordinate += rides[0] * frames.x[k] + rides[1] * frames.y[5][k] + rides[2] * frames.z[6][k];
                coordinate.store(&mut points[k], from);
            }
            let none = like.splat(0.0);
            for (parameter, velocity) in self.order.iter().zip(&mut *self.velocities) {
                let here = match *parameter {
                    Parameter::Link { joint, coordinate } => {
                        link_velocity(&frames, &point, joint, coordinate, like.splat(self.scale))
                    }
                    _ => [none; 3],
                };
                for k in 0..3 {
                    here[k].store(&mut velocity[k], from);
                }
            }
        }
        points
    }
}

#[inline(always)]
fn loaded<R: Real, const N: usize>(like: R, columns: &[Eight; N], from: usize) -> [R; N] {
    let mut out = [like; N];
    for k in 0..N {
        out[k] = like.load(&columns[k], from);
    }
    out
}

#[cfg_attr(not(debug_assertions), inline(always))]
fn link_velocity<R: Real>(
    frames: &Chain<R>,
    point: &[R; 3],
    joint: usize,
    coordinate: LinkCoordinate,
    scale: R,
) -> [R; 3] {
    match coordinate {
        LinkCoordinate::D => scaled(scale, &frames.z[joint]),
        LinkCoordinate::A => scaled(scale, &frames.lateral[joint]),
        LinkCoordinate::Theta => cross(&frames.z[joint], &minus(point, &frames.origin[joint])),
        LinkCoordinate::Alpha => cross(&frames.lateral[joint], &minus(point, &frames.origin[joint + 1])),
        LinkCoordinate::Beta => cross(&frames.y[joint], &minus(point, &frames.origin[joint + 1])),
    }
}

/// Σᵢⱼ Cᵢⱼ vᵢ·vⱼ for a symmetric C, given column by column.
struct Quadratic<'a> {
    matrix: &'a [f64],
    velocities: &'a [[Eight; 3]],
}

impl AnyWidth for Quadratic<'_> {
    type Output = Eight;

    #[cfg_attr(not(debug_assertions), inline(always))]
    fn run<R: SinCos>(self, like: R) -> Eight {
        let n = self.velocities.len();
        let mut out = [0.0; WIDTH];
        for from in (0..WIDTH).step_by(R::ROWS) {
            let mut total = like.splat(0.0);
            // Two columns at once: the sums of one alone would wait for each other. Each is added up in the same order as alone.
            for i in (0..n).step_by(2) {
                let mut sums = [[like.splat(0.0); 3]; 2];
                let next = (i + 1).min(n - 1);
                let [first, second] =
                    [&self.matrix[i * n..(i + 1) * n], &self.matrix[next * n..(next + 1) * n]];
                for ((a, b), w) in first.iter().zip(second).zip(&self.velocities[..i]) {
                    let w = loaded(like, w, from);
                    add_twice(&mut sums[0], *a, &w);
                    add_twice(&mut sums[1], *b, &w);
                }
                let v = loaded(like, &self.velocities[i], from);
                total = with_square(total, &sums[0], first[i], &v);
                if next > i {
                    add_twice(&mut sums[1], second[i], &v);
                    let v = loaded(like, &self.velocities[next], from);
                    total = with_square(total, &sums[1], second[next], &v);
                }
            }
            total.store(&mut out, from);
        }
        out
    }
}

/// Adds 2 c w.
#[inline(always)]
fn add_twice<R: Real>(sum: &mut [R; 3], c: f64, w: &[R; 3]) {
    let twice = w[0].splat(2.0 * c);
    for k in 0..3 {
        sum[k] += twice * w[k];
    }
}

/// `total` + v · (sum + c v).
#[inline(always)]
fn with_square<R: Real>(mut total: R, sum: &[R; 3], c: f64, v: &[R; 3]) -> R {
    for k in 0..3 {
        total += v[k] * (sum[k] + v[k].splat(c) * v[k]);
    }
    total
}

/// √v of a variance that rounding may have made negative; NaN for NaN.
fn root(variance: f64) -> f64 {
    if variance > 0.0 || variance.is_nan() { variance.sqrt() } else { 0.0 }
}

impl Estimated {
    /// Covariance of the position of a point on the flange (mm²), 3 × 3 in the base.
    pub fn position_covariance(
        &self,
        arm: &PreparedModel<'_>,
        q: &Joints,
        flange_from_tool: &Pose,
    ) -> nalgebra::Matrix3<f64> {
        let jacobian = self.position_jacobian(arm, q, flange_from_tool);
        let product: DMatrix<f64> = &jacobian * &self.covariance * jacobian.transpose();
        product.fixed_view::<3, 3>(0, 0).into_owned()
    }

    /// Predicted standard deviation of the position of a point on the flange (mm): √trace(J Σ Jᵀ), the double sum of
    /// Σᵢⱼ vᵢ·vⱼ over the velocities that the arm's parameters give the point, and the errors beyond the noise ([`beyond_noise`]).
    ///
    /// With `carried`, relative to a registered frame: common motion of point and frame cancels.
    pub fn position_sigma_mm(
        &self,
        arm: &PreparedModel<'_>,
        q: &Joints,
        flange_from_tool: &Pose,
        carried: Option<CarriedFrame<'_>>,
    ) -> f64 {
        let point = FlangePoint { joints: *q, flange_from_tool: *flange_from_tool, carried };
        self.position_sigmas_mm(arm, &[point])[0]
    }

    /// [`Estimated::position_sigma_mm`] of many points, eight in lanes.
    pub fn position_sigmas_mm(&self, arm: &PreparedModel<'_>, points: &[FlangePoint<'_>]) -> Vec<f64> {
        self.position_sigmas_mm_in_two(arm, points, &[]).into_iter().map(|(sigma, _)| sigma).collect()
    }

    /// [`Estimated::position_sigmas_mm`], and for each point with `Some` in `others` the same relative to that frame instead: the
    /// velocities are worked out once.
    pub fn position_sigmas_mm_in_two(
        &self,
        arm: &PreparedModel<'_>,
        points: &[FlangePoint<'_>],
        others: &[Option<Option<CarriedFrame<'_>>>],
    ) -> Vec<(f64, Option<f64>)> {
        let mut velocities = vec![[[0.0; WIDTH]; 3]; self.order.len()];
        let mut relative = velocities.clone();
        let mut out = Vec::with_capacity(points.len());
        let variances = |velocities: &[[Eight; 3]]| {
            vectorised(Quadratic { matrix: self.covariance.as_slice(), velocities })
        };
        for (block, first) in points.chunks(WIDTH).zip((0..).step_by(WIDTH)) {
            let at = self.velocities_in_base(arm, block, &mut velocities);
            let beyond: [f64; WIDTH] = match &self.beyond_noise_rad {
                Some(rad) => std::array::from_fn(|k| {
                    block.get(k).map_or(0.0, |point| {
                        beyond_noise::square_mm2(arm, &point.joints, &point.flange_from_tool, rad)
                    })
                }),
                None => [0.0; WIDTH],
            };
            let share = |carried: Option<CarriedFrame<'_>>| carried.map_or(1.0, |frame| frame.beyond_share);
            let other = |k: usize| others.get(first + k).copied().flatten();
            let second = (0..block.len()).any(|k| other(k).is_some()).then(|| {
                relative.copy_from_slice(&velocities);
                subtract_carried(&at, block.len(), |k| other(k).flatten(), &mut relative);
                variances(&relative)
            });
            subtract_carried(&at, block.len(), |k| block[k].carried, &mut velocities);
            let variance = variances(&velocities);
            out.extend((0..block.len()).map(|k| {
                let second = second.as_ref().zip(other(k));
                let with_beyond = |variance: f64, carried| root(variance + share(carried) * beyond[k]);
                (
                    with_beyond(variance[k], block[k].carried),
                    second.map(|(second, carried)| with_beyond(second[k], carried)),
                )
            }));
        }
        out
    }

    /// Velocities of up to eight points (mm per unit of each of the arm's parameters), in the base.
    fn velocities(&self, arm: &PreparedModel<'_>, block: &[FlangePoint<'_>], velocities: &mut [[Eight; 3]]) {
        let at = self.velocities_in_base(arm, block, velocities);
        subtract_carried(&at, block.len(), |k| block[k].carried, velocities);
    }

    /// The same without the motion of registered frames; returns the points.
    fn velocities_in_base(
        &self,
        arm: &PreparedModel<'_>,
        block: &[FlangePoint<'_>],
        velocities: &mut [[Eight; 3]],
    ) -> [Eight; 3] {
        let growth: f64 = arm.model.effects.iter().map(|e| e.growth(&arm.condition)).sum();
        let row = |k: usize| &block[k.min(block.len() - 1)];
        let angles: [Eight; 6] = std::array::from_fn(|i| std::array::from_fn(|k| row(k).joints[i]));
        let rides: [Vector3<f64>; WIDTH] =
            std::array::from_fn(|k| (arm.model.flange * row(k).flange_from_tool).translation.vector);
        let rides: [Eight; 3] = std::array::from_fn(|i| std::array::from_fn(|k| rides[k][i]));
        let (angles, rides, scale, order) = (&angles, &rides, 1.0 + growth, &self.order);
        let at = if arm.moves_links() {
            vectorised(LinkVelocities::<true> { arm, angles, rides, scale, order, velocities })
        } else {
            vectorised(LinkVelocities::<false> { arm, angles, rides, scale, order, velocities })
        };
        if !arm.model.effects.is_empty() {
            let point = |k: usize| -> [f64; 3] { std::array::from_fn(|i| at[i][k]) };
            for k in 0..block.len() {
                let frames = arm.frames(&row(k).joints);
                let mut of_effects = EffectTwists::of(arm, &row(k).joints, &frames, point(k));
                for (parameter, velocity) in self.order.iter().zip(&mut *velocities) {
                    if let Parameter::Effect { index, parameter } = *parameter {
                        let twist = of_effects.twist(index, parameter);
                        (0..3).for_each(|i| velocity[i][k] = twist[i]);
                    }
                }
            }
        }
        at
    }

    /// Derivatives of the positions of many points on the flange with respect to the arm's parameters, one below the other:
    /// 3 n × p, in the base, relative to the registered frames where there are any.
    pub fn position_jacobians(&self, arm: &PreparedModel<'_>, points: &[FlangePoint<'_>]) -> DMatrix<f64> {
        let mut velocities = vec![[[0.0; WIDTH]; 3]; self.order.len()];
        let mut out = DMatrix::zeros(3 * points.len(), self.order.len());
        for (first, block) in (0..).step_by(WIDTH).zip(points.chunks(WIDTH)) {
            self.velocities(arm, block, &mut velocities);
            for (mut column, velocity) in out.column_iter_mut().zip(&velocities) {
                for k in 0..block.len() {
                    (0..3).for_each(|i| column[3 * (first + k) + i] = velocity[i][k]);
                }
            }
        }
        out
    }

    /// [`Estimated::position_jacobians`] of one point: 3 × p.
    pub fn position_jacobian(
        &self,
        arm: &PreparedModel<'_>,
        q: &Joints,
        flange_from_tool: &Pose,
    ) -> DMatrix<f64> {
        let point = FlangePoint { joints: *q, flange_from_tool: *flange_from_tool, carried: None };
        self.position_jacobians(arm, &[point])
    }
}

/// Subtracts from the velocities of the points `at` those that they have as points of the registered frames.
fn subtract_carried<'f>(
    at: &[Eight; 3],
    count: usize,
    carried: impl Fn(usize) -> Option<CarriedFrame<'f>>,
    velocities: &mut [[Eight; 3]],
) {
    for k in 0..count {
        let Some(carried) = carried(k) else { continue };
        let lever = Vector3::new(at[0][k], at[1][k], at[2][k]) - carried.origin_mm;
        for (velocity, twist) in velocities.iter_mut().zip(carried.twists) {
            let moved = twist.fixed_rows::<3>(0) + twist.fixed_rows::<3>(3).cross(&lever);
            (0..3).for_each(|i| velocity[i][k] -= moved[i]);
        }
    }
}
