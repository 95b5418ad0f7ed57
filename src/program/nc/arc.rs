//! Arcs in a plane: from centre or radius to the point half way, and back from three points to a centre.
//!
//! The two axes of a plane and its normal are right-handed (G17 x y, G18 z x, G19 y z), so that G3 turns positively.

use std::f64::consts::{PI, TAU};

/// The axes of a plane: first, second, and the one across.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Plane {
    /// First axis, 0 for X.
    pub a: usize,
    /// Second axis.
    pub b: usize,
    /// The axis across.
    pub across: usize,
}

impl Plane {
    /// G17.
    pub const XY: Plane = Plane { a: 0, b: 1, across: 2 };
    /// G18.
    pub const ZX: Plane = Plane { a: 2, b: 0, across: 1 };
    /// G19.
    pub const YZ: Plane = Plane { a: 1, b: 2, across: 0 };

    /// The axis about which G3 (`positive`) or G2 turns positively.
    pub fn axis(&self, positive: bool) -> [f64; 3] {
        let mut axis = [0.0; 3];
        axis[self.across] = if positive { 1.0 } else { -1.0 };
        axis
    }
}

/// An arc, perhaps rising across its plane.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Arc {
    /// Its plane.
    pub plane: Plane,
    /// The centre, along the plane's two axes (mm).
    pub centre_mm: [f64; 2],
    /// The angle that it sweeps, positive for G3 (rad).
    pub sweep_rad: f64,
}

impl Arc {
    /// An arc about a centre. Ends that coincide are a whole circle.
    pub fn about(
        plane: Plane,
        start: [f64; 3],
        end: [f64; 3],
        centre_mm: [f64; 2],
        positive: bool,
    ) -> Option<Arc> {
        let angle = |p: [f64; 3]| (p[plane.b] - centre_mm[1]).atan2(p[plane.a] - centre_mm[0]);
        let radius = |p: [f64; 3]| (p[plane.b] - centre_mm[1]).hypot(p[plane.a] - centre_mm[0]);
        let (first, last) = (radius(start), radius(end));
        // Controls take centres that fit both ends to some hundredths; more is a mistake of the program.
        if first < 1e-9 || (first - last).abs() > 0.5_f64.max(0.01 * first) {
            return None;
        }
        let chord = (start[plane.a] - end[plane.a]).hypot(start[plane.b] - end[plane.b]);
        let mut sweep_rad = (angle(end) - angle(start)).rem_euclid(TAU);
        if chord < 1e-6 {
            sweep_rad = TAU;
        }
        if !positive && sweep_rad < TAU {
            sweep_rad -= TAU;
        } else if !positive {
            sweep_rad = -TAU;
        }
        Some(Arc { plane, centre_mm, sweep_rad })
    }

    /// An arc of a radius; a negative one takes the longer way.
    pub fn of_radius(
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
        // A radius rounded a little below half the chord is a half circle.
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
        Arc::about(plane, start, end, centre, positive)
    }

    /// The point at a share of the way, 0 at the start.
    pub fn at(&self, start: [f64; 3], end: [f64; 3], share: f64) -> [f64; 3] {
        let Plane { a, b, across } = self.plane;
        let [u, v] = [start[a] - self.centre_mm[0], start[b] - self.centre_mm[1]];
        let (sin, cos) = (self.sweep_rad * share).sin_cos();
        // Ends whose radii differ a little are spiralled between, as controls do.
        let first = u.hypot(v);
        let last = (end[a] - self.centre_mm[0]).hypot(end[b] - self.centre_mm[1]);
        let scale = if first > 0.0 { 1.0 + share * (last / first - 1.0) } else { 1.0 };
        let mut point = [0.0; 3];
        point[a] = self.centre_mm[0] + scale * (u * cos - v * sin);
        point[b] = self.centre_mm[1] + scale * (u * sin + v * cos);
        point[across] = start[across] + share * (end[across] - start[across]);
        point
    }

    /// The arc through three points, the second on the way, that turns as asked; `None` where they are in line. For a
    /// whole circle the second point is the one opposite.
    pub fn through(
        plane: Plane,
        start: [f64; 3],
        via: [f64; 3],
        end: [f64; 3],
        positive: bool,
        whole: bool,
    ) -> Option<Arc> {
        let Plane { a, b, .. } = plane;
        if whole {
            let centre = [0.5 * (start[a] + via[a]), 0.5 * (start[b] + via[b])];
            return Arc::about(plane, start, start, centre, positive);
        }
        // From the chord's middle along its normal, so that both ends have the same radius.
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
        Arc::about(plane, start, end, [middle[0] + h * normal[0], middle[1] + h * normal[1]], positive)
    }

    /// Whether it goes more than half round.
    pub fn is_long(&self) -> bool {
        self.sweep_rad.abs() > PI + 1e-9
    }

    /// Whether it is a whole circle.
    pub fn is_whole(&self) -> bool {
        self.sweep_rad.abs() > TAU - 1e-9
    }
}
