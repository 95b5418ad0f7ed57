//! Tool orientations from three words.
//!
//! Angles are degrees. A *tool vector* points from the tip to the spindle: `A3= B3= C3=` (Siemens), `I J K` with
//! G43.5 (Fanuc), `TX TY TZ` (Heidenhain). The z axis of a tool frame points the opposite way, out of the tool. The
//! rotation about the vector is the *spin*, the angle from the frame whose x axis lies in the plane of z and the work
//! object's x (or y, where z is along x); see [`spun`].

use nalgebra::{Const, Matrix3, SVD, UnitQuaternion, Vector3};

use truegrind_math::se3::rotation_from_matrix;

/// The convention of A, B and C.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum Angles {
    /// About z by A, the new y by B, the new x by C (KUKA).
    Abc,
    /// About the fixed x by A, y by B, z by C (ISO 841 letters; W, P, R of FANUC).
    Wpr,
    /// About x by A, the new y by B, the new z by C (Stäubli).
    Rxyz,
    /// A rotation vector (A, B, C) whose length is the angle.
    RotationVector,
}

impl Angles {
    /// Its name in comments and files.
    pub fn text(self) -> &'static str {
        match self {
            Angles::Abc => "abc",
            Angles::Wpr => "wpr",
            Angles::Rxyz => "rxyz",
            Angles::RotationVector => "rotation-vector",
        }
    }

    /// Every convention.
    pub const ALL: [Angles; 4] = [Angles::Abc, Angles::Wpr, Angles::Rxyz, Angles::RotationVector];

    /// The convention of a name.
    pub fn of(text: &str) -> Option<Angles> {
        Angles::ALL.into_iter().find(|angles| angles.text().eq_ignore_ascii_case(text))
    }

    /// The names of all conventions, for messages.
    pub fn words() -> String {
        Angles::ALL.map(Angles::text).join(", ")
    }

    /// The rotation of three angles (°).
    pub fn rotation(self, [a, b, c]: [f64; 3]) -> UnitQuaternion<f64> {
        let [a, b, c] = [a, b, c].map(f64::to_radians);
        let x = |angle| UnitQuaternion::from_axis_angle(&Vector3::x_axis(), angle);
        let y = |angle| UnitQuaternion::from_axis_angle(&Vector3::y_axis(), angle);
        let z = |angle| UnitQuaternion::from_axis_angle(&Vector3::z_axis(), angle);
        match self {
            Angles::Abc => z(a) * y(b) * x(c),
            Angles::Wpr => z(c) * y(b) * x(a),
            Angles::Rxyz => x(a) * y(b) * z(c),
            Angles::RotationVector => UnitQuaternion::from_scaled_axis(Vector3::new(a, b, c)),
        }
    }

    /// The three angles (°) of a rotation, of all that mean it the nearest to `near`.
    ///
    /// ```
    /// use truegrind_programs::nc::orientation::Angles;
    ///
    /// // Of all equivalent angles, those nearest to the machine's current ones.
    /// for convention in [Angles::Abc, Angles::Wpr, Angles::Rxyz] {
    ///     let current = [30.0, -40.0, 200.0];
    ///     let found = convention.angles(&convention.rotation(current), [25.0, -35.0, 190.0]);
    ///     assert!(found.iter().zip(current).all(|(found, expected)| (found - expected).abs() < 1e-9), "{found:?}");
    /// }
    /// ```
    pub fn angles(self, rotation: &UnitQuaternion<f64>, near: [f64; 3]) -> [f64; 3] {
        if self == Angles::RotationVector {
            return rotation_vector(rotation, near);
        }
        let m = rotation.to_rotation_matrix();
        // First, middle and last angle of the product of three rotations.
        let (first, middle, last) = match self {
            // Rz(f) Ry(m) Rx(l).
            Angles::Abc | Angles::Wpr => (
                m[(1, 0)].atan2(m[(0, 0)]),
                (-m[(2, 0)]).atan2(m[(0, 0)].hypot(m[(1, 0)])),
                m[(2, 1)].atan2(m[(2, 2)]),
            ),
            // Rx(f) Ry(m) Rz(l).
            _ => (
                (-m[(1, 2)]).atan2(m[(2, 2)]),
                m[(0, 2)].atan2(m[(0, 0)].hypot(m[(0, 1)])),
                (-m[(0, 1)]).atan2(m[(0, 0)]),
            ),
        };
        let [first, middle, last] = [first, middle, last].map(f64::to_degrees);
        let near = if self == Angles::Wpr { [near[2], near[1], near[0]] } else { near };
        let candidates = if middle.abs() > 90.0 - 1e-7 {
            // Gimbal lock: only the sum or difference of first and last is determined; the last is kept.
            let keep = near[2];
            let first = match (self, middle > 0.0) {
                (Angles::Rxyz, true) => m[(1, 0)].atan2(m[(1, 1)]).to_degrees() - keep,
                (Angles::Rxyz, false) => keep - m[(1, 0)].atan2(m[(1, 1)]).to_degrees(),
                (_, true) => (-m[(0, 1)]).atan2(m[(1, 1)]).to_degrees() + keep,
                (_, false) => (-m[(0, 1)]).atan2(m[(1, 1)]).to_degrees() - keep,
            };
            [[first, middle, keep]; 2]
        } else {
            [[first, middle, last], [first + 180.0, 180.0 - middle, last + 180.0]]
        };
        let nearest = candidates.map(|angles| {
            std::array::from_fn(|i| {
                let turns = ((near[i] - angles[i]) / 360.0_f64).round();
                angles[i] + 360.0 * turns
            })
        });
        let distance = |angles: &[f64; 3]| (0..3).map(|i| (angles[i] - near[i]).abs()).sum::<f64>();
        let [a, b] = nearest;
        let best = if distance(&a) <= distance(&b) { a } else { b };
        if self == Angles::Wpr { [best[2], best[1], best[0]] } else { best }
    }
}

/// Three words of orientation near a pole of their convention. At B = ±90 A and C turn the tool about one axis: for a small turn about another
/// there are no words near them.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct WordsAtPole {
    convention: Angles,
    words_deg: [f64; 3],
}

/// How far the words turn the tool per turn of their own, in the direction in which they do so least: below this they are near a pole, which is
/// B beyond ±80.
///
/// A control may run the words linearly from one block to the next. Let the tool turn by s for a unit of the word there, and by 1 at the other end
/// of a line: words that run ahead by 1/s tilt it on the way by up to (1 + s)²/4s − 1 of the turn that they express at the ends. For
/// s = cos 80° = 0.17 that is all of it, so that beyond nothing is gained.
const POLE: f64 = 0.12;

impl WordsAtPole {
    /// `None` where the words are not near a pole.
    pub fn of(convention: Angles, words_deg: [f64; 3]) -> Option<Self> {
        let may_be = match convention {
            Angles::RotationVector => Vector3::from(words_deg).norm() > 300.0,
            _ => words_deg[1].to_radians().cos().abs() < 2.0 * POLE,
        };
        let words = Self { convention, words_deg };
        (may_be && words.turns().singular_values[2] < POLE).then_some(words)
    }

    /// Of the orientations with words near these the nearest to `rotation`.
    ///
    /// ```
    /// use nalgebra::{UnitQuaternion, Vector3};
    /// use truegrind_programs::nc::orientation::{Angles, WordsAtPole};
    ///
    /// let words = [0.0, 89.9, 0.0];
    /// let at_pole = WordsAtPole::of(Angles::Wpr, words).ok_or("not near")?;
    /// // A turn of 0.2° about each axis: that about x would take A and C 64° away.
    /// let turn = UnitQuaternion::from_scaled_axis(Vector3::repeat(0.2_f64.to_radians()));
    /// let wanted = turn * Angles::Wpr.rotation(words);
    /// assert!(Angles::Wpr.angles(&wanted, words)[0].abs() > 60.0);
    /// let found = at_pole.nearest(&wanted);
    /// let near = Angles::Wpr.angles(&found, words);
    /// assert!(near.iter().zip(words).all(|(near, word)| (near - word).abs() < 0.3), "{near:?}");
    /// // What is left is the turn about x, to second order.
    /// assert!((found.angle_to(&wanted).to_degrees() - 0.2).abs() < 1e-3);
    /// assert!(WordsAtPole::of(Angles::Wpr, [0.0, 75.0, 0.0]).is_none());
    /// # Ok::<(), &str>(())
    /// ```
    pub fn nearest(&self, rotation: &UnitQuaternion<f64>) -> UnitQuaternion<f64> {
        let turns = self.turns();
        let (Some(turned), Some(words)) = (turns.u, turns.v_t) else { return *rotation };
        let mut at = Vector3::from(self.words_deg);
        for _ in 0..STEPS {
            let left = (rotation * self.convention.rotation(at.into()).inverse()).scaled_axis();
            for k in 0..2 {
                let by = turned.column(k).dot(&left) / turns.singular_values[k];
                at += words.row(k).transpose() * by.to_degrees();
            }
        }
        self.convention.rotation(at.into())
    }

    /// The turn of the tool per turn of the words.
    fn turns(&self) -> SVD<f64, Const<3>, Const<3>> {
        let at = |axis: usize, by_deg: f64| {
            let mut words = self.words_deg;
            words[axis] += by_deg;
            self.convention.rotation(words)
        };
        let columns: [Vector3<f64>; 3] = std::array::from_fn(|axis| {
            let turn = at(axis, STEP_DEG) * at(axis, -STEP_DEG).inverse();
            turn.scaled_axis() / (2.0 * STEP_DEG.to_radians())
        });
        Matrix3::from_columns(&columns).svd(true, true)
    }
}

/// Newton steps of [`WordsAtPole::nearest`]; each leaves a share of the error as large as the turn (rad).
const STEPS: usize = 8;

/// Step of the differences of words (°).
const STEP_DEG: f64 = 1e-3;

/// The rotation vector (°) nearest to an old one, in its direction or the opposite one.
fn rotation_vector(rotation: &UnitQuaternion<f64>, near: [f64; 3]) -> [f64; 3] {
    let vector = rotation.scaled_axis().map(f64::to_degrees);
    let near = Vector3::from(near);
    let length = vector.norm();
    if length < 1e-9 {
        // A full turn keeps its axis.
        return match near.try_normalize(1e-9) {
            Some(axis) => (axis * 360.0 * (near.norm() / 360.0).round()).into(),
            None => vector.into(),
        };
    }
    let axis = vector / length;
    let turns = ((near.dot(&axis) - length) / 360.0).round();
    (axis * (length + 360.0 * turns)).into()
}

/// The tool orientation of a tool vector and the spin about it (°); `None` for a zero vector.
pub fn spun(vector: [f64; 3], spin_deg: f64) -> Option<UnitQuaternion<f64>> {
    let z = -Vector3::from(vector).try_normalize(1e-9)?;
    let along = if z.x.abs() < PARALLEL { Vector3::x() } else { Vector3::y() };
    let x = (along - z * z.dot(&along)).normalize();
    let base = rotation_from_matrix(&Matrix3::from_columns(&[x, z.cross(&x), z]));
    Some(base * UnitQuaternion::from_axis_angle(&Vector3::z_axis(), spin_deg.to_radians()))
}

/// Above this x component of the tool axis, the spin is relative to y.
const PARALLEL: f64 = 0.999;

/// Tool vector and spin (°, the equivalent nearest to `near_deg`) of an orientation.
pub fn vector_and_spin(rotation: &UnitQuaternion<f64>, near_deg: f64) -> ([f64; 3], f64) {
    let vector: [f64; 3] = (-(rotation * Vector3::z())).into();
    let spin = match spun(vector, 0.0) {
        Some(base) => {
            let relative = base.inverse() * rotation;
            2.0 * relative.k.atan2(relative.w).to_degrees()
        }
        None => 0.0,
    };
    (vector, spin + 360.0 * ((near_deg - spin) / 360.0).round())
}
