//! Search for the cheapest measurement that would make the position of a path known, predicted from the model's covariance.
//!
//! For each of a short list of measurements, alone and in pairs, the covariance of the path's position afterwards is computed
//! (`measurement_information`). A path with deviation d and covariance P now will have covariance P', and d is expected with
//! second moment M = d dᵀ + (1 − tr P' / tr P) P. The measurement suffices if the position would then be corrected: sigma at
//! most √tr M, and the probability of harm Φ(−c/2s) at most the accepted risk, with c² = tr M and s² = tr(P' M) / tr M (all
//! summed over the points of the path).
//!
//! Sensor and target positions that the model file does not state are assumed; see the constants below.

use nalgebra::{DMatrix, Matrix3, Matrix6, Point3, Vector3, Vector6};
use rayon::prelude::*;

use crate::condition::arm_conditions::ArmConditions;
use crate::frames::frame_pair::{ResolvedFrames, carried_through};
use crate::frames::taught::taught_frame;
use crate::risk::beyond_noise::RegisteredErrors;
use crate::risk::measurement_information::{FREE, PriorSigma, Readings, SensorPosition, factor, updated};
use crate::risk::placement::{AssessedTarget, PathDeviation, accepts_position, evenly_spaced};
use crate::risk::registration::Registration;
use crate::risk::remedy::{Measurement, Remedy};
use truegrind_arm::estimated::{Estimated, RegisteredFrame};
use truegrind_arm::model::{Joints, PreparedModel};
use truegrind_arm::sensor::Sensor;
use truegrind_math::se3::{Pose, difference};
use truegrind_math::tail::normal_two_sided;

/// Accuracy of a sensor frame measured in the base, as with `--frame-sigma 0.1` (mm, rad).
const FRAME_KNOWN: PriorSigma = PriorSigma { mm: 0.1, rad: 1e-4 };
/// Accuracy of a target position on the flange from a coordinate measuring machine (mm).
const PLATE_KNOWN_MM: f64 = 0.03;
/// Accuracy of a point touched by hand (mm, each coordinate).
const TOUCH_KNOWN_MM: f64 = 0.05;
/// Standard deviation of a reading where the model does not state it (mm).
const READING_MM: f64 = 0.05;
/// Smallest standard deviation of any sensor (mm).
const MIN_SENSOR_SIGMA_MM: f64 = 1e-3;
/// Distance of a tracker from the base; distance of a cable outlet relative to that of the outermost target.
const TRACKER_MM: f64 = 2500.0;
const OUTLET_FARTHER: f64 = 1.6;
/// Height of a target above the flange, and distance from the axis of joint 6 of one beside it (mm).
const TARGET_OFF_MM: f64 = 60.0;
const BESIDE_MM: f64 = 100.0;
/// Smallest distance between touched points of a work object (mm).
const TOUCHED_APART_MM: f64 = 100.0;

const POSES: u32 = 30;
const MORE_POSES: u32 = 100;

/// A path whose position is not corrected.
pub(crate) struct UnknownPlacement<'a, 'm> {
    pub(crate) targets: &'a [AssessedTarget],
    pub(crate) list: &'a [ResolvedFrames],
    pub(crate) conditions: &'a ArmConditions<'m>,
    pub(crate) knowledge: &'a Estimated,
    pub(crate) max_risk: f64,
}

/// The cheapest measurement, or pair, that would make its position known; the best one where none suffices. `None` where
/// nothing can be predicted: invalid covariance.
pub(crate) fn remedy(placement: &UnknownPlacement<'_, '_>) -> Option<Remedy> {
    let known = CurrentKnowledge::of(placement)?;
    let touched = placement.touched().map(|touched| known.touching(placement, &touched));
    let candidates = candidates(touched.is_some(), placement.has_rows());
    let informations = InformationTable::of(placement, &candidates);
    let foreseen: Vec<(f64, Remedy)> = candidates
        .into_par_iter()
        .filter_map(|measurements| {
            let remedy = known.with(measurements, &informations, touched.as_ref(), placement.max_risk)?;
            Some((remedy.minutes(), remedy))
        })
        .collect();
    let cheapest = foreseen.iter().filter(|(_, r)| r.suffices).min_by(|a, b| a.0.total_cmp(&b.0));
    let best = foreseen.iter().min_by(|a, b| a.1.sigma_mm.total_cmp(&b.1.sigma_mm));
    cheapest.or(best).map(|(_, remedy)| remedy.clone())
}

/// The candidates.
fn candidates(touch: bool, rows: bool) -> Vec<Vec<Measurement>> {
    use Measurement::{Beside, Frame, More, Plate, Station, Touch};
    let (beside_target, plate) = (Beside { poses: POSES }, Plate { poses: POSES });
    let (station, more) = (Station { poses: POSES }, More { poses: MORE_POSES });
    let mut out = Vec::new();
    if touch {
        out.push(vec![Touch]);
    }
    if rows {
        let alone = [Frame, beside_target, plate, station, more];
        out.extend(alone.map(|measurement| vec![measurement]));
        out.extend([beside_target, plate, station].map(|measurement| vec![Frame, measurement]));
    }
    if touch && rows {
        out.extend([beside_target, plate].map(|measurement| vec![Touch, measurement]));
    }
    out
}

/// Information of each measurement on the arm's parameters, computed once for all candidates: it depends only on whether the
/// sensor frame is stated.
struct InformationTable(Vec<((Measurement, bool), DMatrix<f64>)>);

impl InformationTable {
    fn of(placement: &UnknownPlacement<'_, '_>, candidates: &[Vec<Measurement>]) -> Self {
        let mut asked: Vec<(Measurement, bool)> = Vec::new();
        for set in candidates {
            let stated = set.contains(&Measurement::Frame);
            for measurement in set.iter().filter(|m| **m != Measurement::Touch) {
                if !asked.contains(&(*measurement, stated)) {
                    asked.push((*measurement, stated));
                }
            }
        }
        let one = |asked: (Measurement, bool)| (asked, placement.information(asked.0, asked.1));
        Self(asked.into_par_iter().map(one).collect())
    }

    /// Sum over the measurements of a candidate.
    fn sum(&self, measurements: &[Measurement], parameters: usize) -> DMatrix<f64> {
        let stated = measurements.contains(&Measurement::Frame);
        let of = |m: &Measurement| self.0.iter().find(|(asked, _)| *asked == (*m, stated));
        let zero = DMatrix::zeros(parameters, parameters);
        measurements.iter().filter_map(of).fold(zero, |sum, (_, information)| sum + information)
    }
}

/// How the work object's frame moves with the arm's parameters once it is taught with this arm, and the uncertainty of
/// touching, in the base.
struct TouchedFrame {
    carried: RegisteredFrame,
    /// Twists of the frame by each coordinate of each touched point, for one standard deviation.
    touch_sigma_twists: Vec<Vector6<f64>>,
}

/// Effect of touching the work object.
struct TouchEffect {
    /// Derivative of the path's position by the arm's parameters, relative to the touched frame.
    twists: DMatrix<f64>,
    /// Covariance added by manual touching.
    adds: Matrix6<f64>,
}

/// Present knowledge of the path's position.
struct CurrentKnowledge {
    registration: Registration,
    off: PathDeviation,
    /// Present position, and its derivative by the arm's parameters.
    twist: Vector6<f64>,
    twists: DMatrix<f64>,
    /// Over all points: gᵀ W h is the sum of the scalar products of the displacements by two twists.
    weights: Matrix6<f64>,
    covariance: Matrix6<f64>,
    /// What the errors beyond the noise make of it, which no measurement of parameters lessens.
    beyond: Matrix6<f64>,
    factor: DMatrix<f64>,
}

impl CurrentKnowledge {
    fn of(placement: &UnknownPlacement<'_, '_>) -> Option<Self> {
        let off = placement.off(None);
        let registration = Registration::of(&off.intended)?;
        let twist = registration.twist(off.shifts.iter().copied());
        let twists = twists_of(&registration, &off);
        let mut weights = Matrix6::zeros();
        for k in 0..6 {
            weights.set_column(k, &registration.weighed(&Matrix6::identity().column(k).into_owned()));
        }
        let factor = factor(&placement.knowledge.covariance)?;
        let part = &twists * &factor;
        let errors = RegisteredErrors::of(&registration, &off.intended, &off.errors);
        let beyond = errors.map_or_else(Matrix6::zeros, |errors| errors.covariance);
        let covariance = Matrix6::from_iterator((&part * part.transpose()).iter().copied()) + beyond;
        Some(Self { registration, off, twist, twists, weights, covariance, beyond, factor })
    }

    /// Knowledge after `measurements`.
    fn with(
        &self,
        measurements: Vec<Measurement>,
        informations: &InformationTable,
        touching: Option<&TouchEffect>,
        max_risk: f64,
    ) -> Option<Remedy> {
        let information = informations.sum(&measurements, self.factor.nrows());
        let touching = touching.filter(|_| measurements.contains(&Measurement::Touch));
        let twists = touching.map_or(&self.twists, |touching| &touching.twists);
        let left = updated(&self.factor, &information, twists)?;
        let mut left = Matrix6::from_iterator(left.iter().copied()) + self.beyond;
        if let Some(touching) = touching {
            left += touching.adds;
        }
        let sigma_mm = self.registration.mean_square(&left).max(0.0).sqrt();
        sigma_mm.is_finite().then(|| Remedy {
            measurements,
            sigma_mm,
            suffices: self.would_be_taken(&left, sigma_mm, max_risk),
        })
    }

    /// Effect of touching.
    fn touching(&self, placement: &UnknownPlacement<'_, '_>, touched: &TouchedFrame) -> TouchEffect {
        let twists = twists_of(&self.registration, &placement.off(Some(&touched.carried)));
        let mut adds = Matrix6::zeros();
        let Some(first) = placement.targets.first() else { return TouchEffect { twists, adds } };
        let object = placement.list[first.frames_index].real.object;
        for touch_sigma_twists in &touched.touch_sigma_twists {
            let shift = |intended: &Point3<f64>| {
                let lever = (object * intended).coords - touched.carried.origin_mm;
                let moved: Vector3<f64> = touch_sigma_twists.fixed_rows::<3>(0)
                    + touch_sigma_twists.fixed_rows::<3>(3).cross(&lever);
                object.rotation.inverse() * moved
            };
            let twist = self.registration.twist(self.off.intended.iter().map(shift));
            adds += twist * twist.transpose();
        }
        TouchEffect { twists, adds }
    }

    /// Whether the position is expected to be corrected with the remaining covariance `left`.
    fn would_be_taken(&self, left: &Matrix6<f64>, sigma_mm: f64, max_risk: f64) -> bool {
        let total = |m: &Matrix6<f64>| (self.weights * m).trace();
        let (now, then) = (total(&self.covariance), total(left));
        let brought = if now > 0.0 { (1.0 - then / now).max(0.0) } else { 0.0 };
        let expected = self.twist * self.twist.transpose() + self.covariance * brought;
        let square = total(&expected);
        let along = (self.weights * left * self.weights * expected).trace() / square;
        let chance = 0.5 * normal_two_sided(0.5 * (square / along).sqrt());
        let deviation_mm = (square / self.off.shifts.len() as f64).sqrt();
        accepts_position(deviation_mm, sigma_mm, chance, max_risk)
    }
}

fn twists_of(registration: &Registration, off: &PathDeviation) -> DMatrix<f64> {
    let twists = registration.twists(&off.jacobian);
    DMatrix::from_fn(6, twists.ncols(), |i, k| twists[(i, k)])
}

impl UnknownPlacement<'_, '_> {
    fn arm(&self) -> Option<&PreparedModel<'_>> {
        self.targets.first().map(|target| self.conditions.arm(target.condition_index))
    }

    fn has_rows(&self) -> bool {
        !self.knowledge.region.samples_deg.is_empty()
    }

    /// Deviation of each target, relative to a frame that moves with the arm where there is one.
    fn off(&self, carried: Option<&RegisteredFrame>) -> PathDeviation {
        let against = |frames: &ResolvedFrames| match carried {
            Some(carried) => ResolvedFrames { carried: Some(carried.clone()), ..frames.clone() },
            None => frames.clone(),
        };
        let list: Vec<ResolvedFrames> = self.list.iter().map(against).collect();
        let reference = self.targets.first().map(|target| list[target.frames_index].real.object);
        let reference = reference.unwrap_or_default();
        PathDeviation::of_part(self.targets, &reference, &list, self.conditions, self.knowledge)
    }

    /// `count` of the measured poses.
    fn poses(&self, count: usize) -> Vec<Joints> {
        let samples = &self.knowledge.region.samples_deg;
        let joints = |deg: &[f64; 6]| Joints::from_fn(|i, _| deg[i].to_radians());
        (0..count.div_ceil(samples.len()))
            .flat_map(|_| evenly_spaced(samples, count))
            .take(count)
            .map(|deg| joints(&deg))
            .collect()
    }

    /// The same poses with joint 6 rotated evenly over its range.
    fn turned(&self, count: usize) -> Vec<Joints> {
        let mut poses = self.poses(count);
        for (k, q) in poses.iter_mut().enumerate() {
            let mut turned = *q;
            // Multiples of the golden ratio spread any number of angles evenly.
            turned[5] += std::f64::consts::PI * ((k as f64 * 0.618_033_988_75).fract() - 0.5);
            if self.knowledge.nominal.limits.violated(&turned).is_none() {
                *q = turned;
            }
        }
        poses
    }

    /// Position of the sensor; the second station is a quarter turn about the base from the first.
    fn stand(&self, second: bool) -> SensorPosition {
        let Some(arm) = self.arm() else { return SensorPosition::Tracker(Vector3::zeros()) };
        let points: Vec<Vector3<f64>> =
            self.poses(POSES as usize).iter().map(|q| arm.forward(q).translation.vector).collect();
        let middle = points.iter().sum::<Vector3<f64>>() / points.len().max(1) as f64;
        let out = Vector3::new(middle.x, middle.y, 0.0).try_normalize(1e-9).unwrap_or_else(Vector3::x);
        let out = if second { Vector3::z().cross(&out) } else { out };
        if self.knowledge.provenance.sensor == Sensor::Cable {
            let farthest = points.iter().map(|p| p.xy().norm()).fold(0.0, f64::max);
            SensorPosition::Outlet(out * (OUTLET_FARTHER * farthest))
        } else {
            SensorPosition::Tracker(out * TRACKER_MM)
        }
    }

    /// Standard deviation of a reading, each coordinate (mm), from the held-out error.
    fn reading_mm(&self) -> f64 {
        let rmse = self.knowledge.calibrated.held_out.rmse;
        let coordinates: f64 = if self.knowledge.provenance.sensor == Sensor::Cable { 1.0 } else { 3.0 };
        let sigma = rmse / coordinates.sqrt();
        if sigma > 0.0 && sigma.is_finite() { sigma.max(MIN_SENSOR_SIGMA_MM) } else { READING_MM }
    }

    /// Information of one measurement on the arm's parameters; `stated`: whether the sensor frame is stated.
    fn information(&self, measurement: Measurement, stated: bool) -> DMatrix<f64> {
        let n = self.knowledge.order.len();
        let Some(arm) = self.arm() else { return DMatrix::zeros(n, n) };
        let on_axis = [Vector3::new(0.0, 0.0, TARGET_OFF_MM)];
        let around: [Vector3<f64>; 3] = std::array::from_fn(|k| {
            let angle = k as f64 * std::f64::consts::TAU / 3.0;
            Vector3::new(BESIDE_MM * angle.cos(), BESIDE_MM * angle.sin(), TARGET_OFF_MM)
        });
        let count = measurement.poses() as usize;
        let poses = match measurement {
            Measurement::Touch => return DMatrix::zeros(n, n),
            Measurement::Frame => self.poses(self.knowledge.region.samples_deg.len()),
            Measurement::Beside { .. } | Measurement::Plate { .. } => self.turned(count),
            Measurement::Station { .. } | Measurement::More { .. } => self.poses(count),
        };
        let readings = Readings {
            poses: &poses,
            weight: 1.0,
            stand: self.stand(matches!(measurement, Measurement::Station { .. })),
            stand_known: if stated { FRAME_KNOWN } else { FREE },
            targets: match measurement {
                Measurement::Beside { .. } => &around[..1],
                Measurement::Plate { .. } => &around,
                _ => &on_axis,
            },
            target_known_mm: matches!(measurement, Measurement::Plate { .. }).then_some(PLATE_KNOWN_MM),
            sigma_mm: self.reading_mm(),
        };
        if measurement == Measurement::Frame {
            // The existing rows again, now with a known frame.
            let rows = self.knowledge.provenance.rows.max(poses.len()) as f64;
            let there = Readings { weight: rows / poses.len() as f64, ..readings };
            let free = Readings { stand_known: FREE, ..there };
            let normal = there.normal(self.knowledge, arm);
            return normal.information(&there.own()) - normal.information(&free.own());
        }
        readings.normal(self.knowledge, arm).information(&readings.own())
    }

    /// Three points of the work object that the arm can touch: spread across the path, no closer than one would choose by
    /// hand. `None` where the frame was already taught with this arm, the robot holds the part, or the points are out of
    /// reach.
    fn touched(&self) -> Option<TouchedFrame> {
        let first = self.targets.first()?;
        let frames = &self.list[first.frames_index];
        if frames.carried.is_some() || frames.real.holds_part {
            return None;
        }
        let (condition_index, arm) = (first.condition_index, self.arm()?);
        let (middle, [along, across]) = self.extent();
        [1.0, 0.5, 0.25].iter().find_map(|share| {
            let corners = [middle - along * *share, middle + along * *share, middle + across * *share];
            let joints = corners.map(|corner| {
                let distance = |t: &&AssessedTarget| (t.intended.translation.vector - corner).norm_squared();
                let near = self.targets.iter().min_by(|a, b| distance(a).total_cmp(&distance(b)))?;
                let pose = Pose::from_parts(corner.into(), near.intended.rotation);
                let flange = frames.real.flange_for(&pose);
                self.conditions
                    .inverse(condition_index)
                    .solve_near(&flange, &near.joints)
                    .ok()
                    .map(|s| s.joints)
            });
            let [Some(a), Some(b), Some(c)] = joints else { return None };
            let joints = [a, b, c];
            let tip = frames.real.tool.translation.vector;
            let points = joints.map(|q| arm.forward(&q) * Point3::from(tip));
            let frame = taught_frame(&points)?;
            let carried = carried_through(self.knowledge, arm, &tip, &joints, &points, &frame)?;
            Some(TouchedFrame { carried, touch_sigma_twists: touch_sigma_twists(&points)? })
        })
    }

    /// Centre of the path in its work object, and half the touched extent along and across it (mm).
    fn extent(&self) -> (Vector3<f64>, [Vector3<f64>; 2]) {
        let points: Vec<Vector3<f64>> = self.targets.iter().map(|t| t.intended.translation.vector).collect();
        let middle = points.iter().sum::<Vector3<f64>>() / points.len().max(1) as f64;
        let scatter: Matrix3<f64> = points.iter().map(|p| (p - middle) * (p - middle).transpose()).sum();
        let eigen = scatter.symmetric_eigen();
        let mut order = [0, 1, 2];
        order.sort_by(|&a, &b| eigen.eigenvalues[b].total_cmp(&eigen.eigenvalues[a]));
        let half = |k: usize| {
            let axis: Vector3<f64> = eigen.eigenvectors.column(order[k]).into_owned();
            let reach = points.iter().map(|p| (p - middle).dot(&axis).abs()).fold(0.0, f64::max);
            axis * reach.max(0.5 * TOUCHED_APART_MM)
        };
        (middle, [half(0), half(1)])
    }
}

/// How a frame through three points moves for one standard deviation of each touched coordinate.
fn touch_sigma_twists(points: &[Point3<f64>; 3]) -> Option<Vec<Vector6<f64>>> {
    const STEP_MM: f64 = 1e-3;
    let moved = |point: usize, axis: usize, step: f64| {
        let mut off = *points;
        off[point][axis] += step;
        taught_frame(&off)
    };
    (0..9)
        .map(|k| {
            let (point, axis) = (k / 3, k % 3);
            let apart = difference(&moved(point, axis, -STEP_MM)?, &moved(point, axis, STEP_MM)?);
            Some(apart * (TOUCH_KNOWN_MM / (2.0 * STEP_MM)))
        })
        .collect()
}
