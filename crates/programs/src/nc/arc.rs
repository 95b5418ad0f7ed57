//! Arcs in a plane: from centre or radius to the midpoint, and from three points to a centre.
//!
//! The two axes of a plane and its normal are right-handed (G17 x y, G18 z x, G19 y z), so that G3 rotates
//! positively.

use std::f64::consts::{PI, TAU};

/// Ends in the same direction from the centre within this angle make a full circle, as on LinuxCNC (rad).
const FULL_TURN_RAD: f64 = 1e-6;

/// Ends farther apart than this fraction of the radius determine the circle together with the midpoint.
const LONG_CHORD: f64 = 0.1;

/// Points within this distance do not determine a rotation (mm).
const COINCIDENT_MM: f64 = 0.05;

/// The largest change of direction or scale by a correction.
const MAX_CHANGE: f64 = 0.01;

/// Every control accepts radii at both ends that differ by less than this (mm).
const EQUAL_RADII_MM: f64 = 5e-4;

/// Every control accepts radii at the ends of a nearly closed arc that differ by less than in the original plus this
/// (mm).
const SIMILAR_RADII_MM: f64 = 2e-3;

/// Samples for comparing two arcs.
const SAMPLES: u8 = 12;

/// The axes of a plane: first, second, and normal.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Plane {
    /// First axis, 0 for X.
    pub a: usize,
    /// Second axis.
    pub b: usize,
    /// The normal.
    pub normal: usize,
}

impl Plane {
    /// G17.
    pub const XY: Plane = Plane { a: 0, b: 1, normal: 2 };
    /// G18.
    pub const ZX: Plane = Plane { a: 2, b: 0, normal: 1 };
    /// G19.
    pub const YZ: Plane = Plane { a: 1, b: 2, normal: 0 };

    /// The axis about which G3 (`positive`) or G2 rotates positively.
    pub fn axis(&self, positive: bool) -> [f64; 3] {
        let mut axis = [0.0; 3];
        axis[self.normal] = if positive { 1.0 } else { -1.0 };
        axis
    }
}

/// An arc or helix.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Arc {
    /// Its plane.
    pub plane: Plane,
    /// The centre along the plane's two axes (mm).
    pub centre_mm: [f64; 2],
    /// The sweep, positive for G3 (rad).
    pub sweep_rad: f64,
}

impl Arc {
    /// An arc about a centre. Coincident ends make a full circle.
    pub fn from_centre(
        plane: Plane,
        start: [f64; 3],
        end: [f64; 3],
        centre_mm: [f64; 2],
        positive: bool,
    ) -> Option<Arc> {
        let angle = |p: [f64; 3]| (p[plane.b] - centre_mm[1]).atan2(p[plane.a] - centre_mm[0]);
        let radius = |p: [f64; 3]| (p[plane.b] - centre_mm[1]).hypot(p[plane.a] - centre_mm[0]);
        let (first, last) = (radius(start), radius(end));
        // Controls accept centres whose radii agree within some hundredths of a mm; more is an error of the program.
        if first < 1e-9 || (first - last).abs() > 0.5_f64.max(0.01 * first) {
            return None;
        }
        let chord = (start[plane.a] - end[plane.a]).hypot(start[plane.b] - end[plane.b]);
        let difference = if positive { angle(end) - angle(start) } else { angle(start) - angle(end) };
        let mut sweep_rad = difference.rem_euclid(TAU);
        // Ends in the same direction, even at different distances.
        if chord < 1e-6 || !(FULL_TURN_RAD..=TAU - FULL_TURN_RAD).contains(&sweep_rad) {
            sweep_rad = TAU;
        }
        Some(Arc { plane, centre_mm, sweep_rad: if positive { sweep_rad } else { -sweep_rad } })
    }

    /// An arc of a radius; a negative radius takes the longer arc.
    pub fn from_radius(
        plane: Plane,
        start: [f64; 3],
        end: [f64; 3],
        radius_mm: f64,
        positive: bool,
    ) -> Option<Arc> {
        let [da, db] = [end[plane.a] - start[plane.a], end[plane.b] - start[plane.b]];
        let chord = da.hypot(db);
        if chord < 1e-6 {
            return None;
        }
        let square = radius_mm * radius_mm - 0.25 * chord * chord;
        // A radius rounded to slightly below half the chord is a half circle.
        if square < -1e-3 * chord {
            return None;
        }
        let height = square.max(0.0).sqrt();
        // Left of the chord for a short positive arc.
        let side = if positive == (radius_mm >= 0.0) { 1.0 } else { -1.0 };
        let centre = [
            start[plane.a] + 0.5 * da - side * height * db / chord,
            start[plane.b] + 0.5 * db + side * height * da / chord,
        ];
        Arc::from_centre(plane, start, end, centre, positive)
    }

    /// The point at a fraction of the arc, 0 at the start.
    pub fn point_at(&self, start: [f64; 3], end: [f64; 3], share: f64) -> [f64; 3] {
        let Plane { a, b, normal: normal_axis } = self.plane;
        let [u, v] = [start[a] - self.centre_mm[0], start[b] - self.centre_mm[1]];
        let (sin, cos) = (self.sweep_rad * share).sin_cos();
        // Unequal radii are interpolated along a spiral, as controls do.
        let first = u.hypot(v);
        let last = (end[a] - self.centre_mm[0]).hypot(end[b] - self.centre_mm[1]);
        let scale = if first > 0.0 { 1.0 + share * (last / first - 1.0) } else { 1.0 };
        let mut point = [0.0; 3];
        point[a] = self.centre_mm[0] + scale * (u * cos - v * sin);
        point[b] = self.centre_mm[1] + scale * (u * sin + v * cos);
        point[normal_axis] = start[normal_axis] + share * (end[normal_axis] - start[normal_axis]);
        point
    }

    /// The arc through three points, the second in the middle, in the given direction; `None` if they are collinear.
    /// For a full circle the second point is opposite.
    pub fn through(
        plane: Plane,
        start: [f64; 3],
        via: [f64; 3],
        end: [f64; 3],
        positive: bool,
        file_effects: bool,
    ) -> Option<Arc> {
        let Plane { a, b, .. } = plane;
        if file_effects {
            let centre = [0.5 * (start[a] + via[a]), 0.5 * (start[b] + via[b])];
            return Arc::from_centre(plane, start, start, centre, positive);
        }
        // From the middle of the chord along its normal, so that both ends have the same radius.
        let [da, db] = [end[a] - start[a], end[b] - start[b]];
        let chord = da.hypot(db);
        if chord < 1e-6 {
            return None;
        }
        let middle = [0.5 * (start[a] + end[a]), 0.5 * (start[b] + end[b])];
        let normal = [-db / chord, da / chord];
        let [u, v] = [via[a] - middle[0], via[b] - middle[1]];
        let (along, off) = (u * da / chord + v * db / chord, u * normal[0] + v * normal[1]);
        if off.abs() < 1e-9 {
            return None;
        }
        // |centre − start| = |centre − via| with centre = middle + h normal.
        let h = (along * along + off * off - 0.25 * chord * chord) / (2.0 * off);
        Arc::from_centre(plane, start, end, [middle[0] + h * normal[0], middle[1] + h * normal[1]], positive)
    }

    /// The arc between the `commanded` points (start, middle, end) that corresponds to this one between the `intended`
    /// points; `None` if there is none.
    ///
    /// Where the chord is long for the radius, the three points determine the circle. In a short or nearly closed arc their
    /// rounding would rotate it, so the centre is displaced rigidly with the points.
    pub fn displaced(
        &self,
        intended: [[f64; 3]; 3],
        commanded: [[f64; 3]; 3],
        positive: bool,
    ) -> Option<Arc> {
        let Plane { a, b, .. } = self.plane;
        let [start, via, end] = commanded;
        let chord = [end[a] - start[a], end[b] - start[b]];
        let length = chord[0].hypot(chord[1]);
        let radius = (intended[0][a] - self.centre_mm[0]).hypot(intended[0][b] - self.centre_mm[1]);
        if self.is_full_circle() || length >= LONG_CHORD * radius {
            return Arc::through(self.plane, start, via, end, positive, self.is_full_circle());
        }
        let mut centre_mm = self.displaced_centre(intended, commanded);
        if length < 1e-6 {
            return None;
        }
        // Equalise the radii at both ends unless they already agree within the tolerance of controls.
        let along = chord.map(|x| x / length);
        let middle = [start[a] + 0.5 * chord[0], start[b] + 0.5 * chord[1]];
        let off = along[0] * (centre_mm[0] - middle[0]) + along[1] * (centre_mm[1] - middle[1]);
        let end_radius = (intended[2][a] - self.centre_mm[0]).hypot(intended[2][b] - self.centre_mm[1]);
        let apart_mm = off.abs() * length / radius - (end_radius - radius).abs();
        if self.sweep_rad.abs() < PI {
            if apart_mm > EQUAL_RADII_MM {
                centre_mm = [centre_mm[0] - off * along[0], centre_mm[1] - off * along[1]];
            }
        } else if apart_mm > SIMILAR_RADII_MM {
            // That would displace the far side of a nearly closed arc by twice the change.
            return None;
        }
        Arc::from_centre(self.plane, start, end, centre_mm, positive)
    }

    /// The centre, displaced and rotated with the points (least squares over rotation, scale and shift).
    fn displaced_centre(&self, intended: [[f64; 3]; 3], commanded: [[f64; 3]; 3]) -> [f64; 2] {
        let Plane { a, b, .. } = self.plane;
        let mean =
            |points: &[[f64; 3]; 3]| [a, b].map(|axis| points.iter().map(|p| p[axis]).sum::<f64>() / 3.0);
        let (old, new) = (mean(&intended), mean(&commanded));
        // The complex factor from one to the other.
        let (mut real, mut imaginary, mut square) = (0.0, 0.0, 0.0);
        for (from, to) in intended.iter().zip(&commanded) {
            let [x, y] = [from[a] - old[0], from[b] - old[1]];
            let [u, v] = [to[a] - new[0], to[b] - new[1]];
            real += x * u + y * v;
            imaginary += x * v - y * u;
            square += x * x + y * y;
        }
        (real, imaginary) = (real / square, imaginary / square);
        // Nearly coincident points determine no rotation, and no correction rotates by more.
        if square < COINCIDENT_MM * COINCIDENT_MM || (real - 1.0).hypot(imaginary) > MAX_CHANGE {
            (real, imaginary) = (1.0, 0.0);
        }
        let [x, y] = [self.centre_mm[0] - old[0], self.centre_mm[1] - old[1]];
        [new[0] + real * x - imaginary * y, new[1] + imaginary * x + real * y]
    }

    /// The largest in-plane distance (mm) of an arc between `commanded` (start, middle, end) from this arc displaced
    /// with its points (quadratic interpolation).
    pub fn deviation_mm(&self, intended: [[f64; 3]; 3], commanded: [[f64; 3]; 3], new: &Arc) -> f64 {
        let axes = [self.plane.a, self.plane.b];
        let moved = |point: usize, axis: usize| commanded[point][axis] - intended[point][axis];
        (1..SAMPLES).fold(0.0, |most, k| {
            let t = f64::from(k) / f64::from(SAMPLES);
            let weights = [2.0 * (t - 0.5) * (t - 1.0), 4.0 * t * (1.0 - t), 2.0 * t * (t - 0.5)];
            let (was, is) =
                (self.point_at(intended[0], intended[2], t), new.point_at(commanded[0], commanded[2], t));
            let off = axes.map(|axis| {
                let shift: f64 = (0..3).map(|point| weights[point] * moved(point, axis)).sum();
                is[axis] - was[axis] - shift
            });
            off[0].hypot(off[1]).max(most)
        })
    }

    /// Whether it sweeps more than half a turn.
    pub fn is_major(&self) -> bool {
        self.sweep_rad.abs() > PI + 1e-9
    }

    /// Whether it is a full circle.
    pub fn is_full_circle(&self) -> bool {
        self.sweep_rad.abs() > TAU - 1e-9
    }
}
