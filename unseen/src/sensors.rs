//! What measures the arm, and what the way from the target to the reading does to it.

use nalgebra::{Point3, UnitQuaternion, Vector3};
use rand::{Rng, RngExt};

use crate::arms::{Pose, Sheet};
use crate::draw::{between, direction, normal, scaled};

/// Kind of sensor.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub enum Kind {
    /// Length of a drawn wire.
    Cable,
    /// Position of a reflector.
    Position,
    /// Position and orientation of a target.
    Pose,
}

impl Kind {
    /// Name in tables.
    pub fn name(self) -> &'static str {
        match self {
            Kind::Cable => "cable",
            Kind::Position => "tracker",
            Kind::Pose => "tracker pose",
        }
    }

    /// Least and greatest standard deviation of a length (mm).
    pub fn noise(self) -> (f64, f64) {
        match self {
            Kind::Cable => (0.02, 0.15),
            _ => (0.005, 0.06),
        }
    }
}

/// A sensor in its place.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Sensor {
    /// What it measures.
    pub kind: Kind,
    /// Its place in the room; a cable's outlet is its origin.
    pub place: Pose,
    /// What a cable reads at length 0 (mm).
    pub zero_mm: f64,
    /// The target on the flange.
    pub target: Pose,
    /// Standard deviation of a coordinate or a length (mm).
    pub sigma_mm: f64,
    /// Distance at which an error of orientation weighs as one of position (mm).
    pub lever_mm: f64,
}

/// A reading: one length, three coordinates, or three coordinates and a rotation vector (rad) besides the rotation meant.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Reading {
    /// mm.
    Cable(f64),
    /// mm.
    Position(Vector3<f64>),
    /// mm.
    Pose(Pose),
}

impl Reading {
    /// Its lengths (mm).
    pub fn lengths(&self) -> Vec<f64> {
        match self {
            Reading::Cable(length) => vec![*length],
            Reading::Position(at) => at.iter().copied().collect(),
            Reading::Pose(pose) => pose.translation.vector.iter().copied().collect(),
        }
    }
}

impl Sensor {
    /// Draws a sensor beside an arm, or at the other end of the hall; its noise is drawn later.
    pub fn draw(sheet: &Sheet, kind: Kind, far: bool, rng: &mut impl Rng) -> Self {
        let reach = sheet.reach_mm();
        let place = match kind {
            Kind::Cable => {
                let at = Vector3::new(
                    reach * between(rng, 0.9, 1.3),
                    reach * between(rng, -0.5, 0.5),
                    reach * between(rng, -0.2, 0.4),
                );
                Pose::from_parts(at.into(), UnitQuaternion::identity())
            }
            _ => {
                let away = if far { between(rng, 6e3, 14e3) } else { reach * between(rng, 1.8, 3.5) };
                let around = between(rng, -1.2, 1.2);
                let at = Vector3::new(away * around.cos(), away * around.sin(), between(rng, 200.0, 900.0));
                Pose::from_parts(
                    at.into(),
                    UnitQuaternion::from_scaled_axis(direction(rng) * between(rng, 0.0, 3.0)),
                )
            }
        };
        let arm = Vector3::new(25.0 * normal(rng), 25.0 * normal(rng), between(rng, 40.0, 110.0));
        let target = Pose::from_parts(
            arm.into(),
            UnitQuaternion::from_scaled_axis(direction(rng) * between(rng, 0.0, 1.5)),
        );
        let zero_mm = if kind == Kind::Cable { between(rng, -50.0, 50.0) } else { 0.0 };
        Self { kind, place, zero_mm, target, sigma_mm: 1.0, lever_mm: scaled(rng, 100.0, 400.0) }
    }

    /// The ideal reading of a target in the room.
    pub fn ideal(&self, target: &Pose) -> Reading {
        match self.kind {
            Kind::Cable => Reading::Cable(
                (target.translation.vector - self.place.translation.vector).norm() + self.zero_mm,
            ),
            Kind::Position => Reading::Position(
                self.place.inverse_transform_point(&Point3::from(target.translation.vector)).coords,
            ),
            Kind::Pose => Reading::Pose(self.place.inv_mul(target)),
        }
    }

    /// Lengths in a reading.
    pub fn lengths(&self) -> usize {
        if self.kind == Kind::Cable { 1 } else { 3 }
    }

    /// A reading with noise of these standard numbers: one for a cable, three or six for a tracker.
    pub fn disturbed(&self, reading: &Reading, noise: &[f64; 6]) -> Reading {
        let push = Vector3::new(noise[0], noise[1], noise[2]) * self.sigma_mm;
        match reading {
            Reading::Cable(length) => Reading::Cable(length + push.x),
            Reading::Position(at) => Reading::Position(at + push),
            Reading::Pose(pose) => {
                let turn = Vector3::new(noise[3], noise[4], noise[5]) * (self.sigma_mm / self.lever_mm);
                Reading::Pose(Pose::from_parts(
                    (pose.translation.vector + push).into(),
                    UnitQuaternion::from_scaled_axis(turn) * pose.rotation,
                ))
            }
        }
    }
}

/// White noise of one row.
pub fn white(rng: &mut impl Rng) -> [f64; 6] {
    std::array::from_fn(|_| normal(rng))
}

/// Which sensor measures a run of a kind that any sensor may measure.
pub fn any(rng: &mut impl Rng) -> Kind {
    match rng.random_range(0..8) {
        0..4 => Kind::Cable,
        4..7 => Kind::Position,
        _ => Kind::Pose,
    }
}

/// Length of wire from the point where it enters a pulley that follows the target about the vertical, over the pulley, to the
/// target (mm). `away` from that point to the target, `radius` of the pulley.
pub fn over_pulley(away: &Vector3<f64>, radius: f64) -> f64 {
    let (out, up) = (away.x.hypot(away.y) - radius, away.z);
    let distance = out.hypot(up);
    let free = (distance * distance - radius * radius).sqrt();
    let leaves = up.atan2(out) + (radius / distance).acos();
    free + radius * (std::f64::consts::PI - leaves)
}

/// What a drum in layers reads less than a length that it gave out (mm). `layer_mm` of wire lie in each layer; each layer further in
/// has its radius smaller by the share `thinner`.
pub fn on_drum(length: f64, layer_mm: f64, thinner: f64) -> f64 {
    let full = (length / layer_mm).floor();
    let rest = length - full * layer_mm;
    // Layer k reads longer by k · thinner for each millimetre.
    thinner * (layer_mm * full * (full - 1.0) / 2.0 + full * rest)
}

/// Length of a wire that hangs as a catenary beyond its chord (mm). `away` from outlet to target (mm), `weight` of a metre over
/// the tension at 1 m (1/m), `stiffens` by what share the tension of the drum's spring grows for each metre more.
pub fn catenary(away: &Vector3<f64>, weight: f64, stiffens: f64) -> f64 {
    let (level, up) = (away.x.hypot(away.y) * 1e-3, away.z * 1e-3);
    let chord = level.hypot(up);
    if !(weight > 0.0 && level > 1e-6) {
        return 0.0;
    }
    let tension = (1.0 + stiffens * (chord - 1.0)).max(0.2);
    // The horizontal pull over the weight of a metre.
    let c = tension * (level / chord) / weight;
    let x = level / (2.0 * c);
    // (2c sinh x)² − level², without the loss of digits of a difference.
    let more = level * level * (x.sinh().powi(2) / (x * x) - 1.0);
    1e3 * more / ((chord * chord + more).sqrt() + chord)
}

/// What the end of a pole does under its own load: displacement (mm) and rotation vector (rad), where `down` is a unit vector. A beam with
/// its load at the end turns there by one and a half times its sag over its length (Euler and Bernoulli). `level` is the sag of the level
/// pole (mm), which is softer by the share `softens` than where it is nearly upright.
pub fn drooped(
    down: &Vector3<f64>,
    pole: &Vector3<f64>,
    level: f64,
    softens: f64,
) -> (Vector3<f64>, Vector3<f64>) {
    let along = pole.normalize();
    let across = along.cross(&down.cross(&along));
    let sag = across * (level * (1.0 - softens * (1.0 - across.norm())));
    (sag, along.cross(&sag) * (1.5 / pole.norm()))
}

/// By how much a beam through layered air arrives higher than a straight one (mm), in the plane of the vertical. `from` station
/// to `to` target in the room (mm); `gradient` K/m at the floor, falling off within `layer_mm` of height.
pub fn refracted(from: &Vector3<f64>, to: &Vector3<f64>, gradient: f64, layer_mm: f64) -> f64 {
    /// Change of the index of air for a kelvin.
    const INDEX: f64 = -0.93e-6;
    let level = (to - from).xy().norm() * 1e-3;
    let steps = 16;
    let bend: f64 = (0..steps)
        .map(|k| {
            let share = (f64::from(k) + 0.5) / f64::from(steps);
            let height = from.z + share * (to.z - from.z);
            let slope = INDEX * gradient * (-height.max(0.0) / layer_mm).exp();
            // A kink at this place moves the end by its lever; the eye at the station sees it the other way round.
            slope * level * level * (1.0 - share) / f64::from(steps)
        })
        .sum();
    -1e3 * bend
}
