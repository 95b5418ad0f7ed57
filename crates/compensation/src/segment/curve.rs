//! The path of the tool from one target to the next, as controllers interpolate it.
//!
//! Method. Line: straight position, orientation by the shortest rotation (slerp). Arc: position on the circle through start,
//! circle point and end, or, where the program names the axis (G2, G3), on the circle in the plane normal to that axis,
//! rising along it in proportion to the angle. Orientation on an arc of an NC program: slerp. On one of RAPID: in proportion
//! within the frame that moves along the path, R(s) = turn(axis, s θ) R₀ exp(s v) with exp(v) = R₀⁻¹ turn(axis, −θ) R₁; among
//! v, v ± 2π the rotation that passes nearest to the orientation of the circle point is taken; with CirPathMode \CirPointOri
//! from start over circle point to end. Where a control may run A, B and C of an NC program linearly, each on its own, and that is
//! another way ([`AxisTurn`]), `Curve::by_axes` is that way.
//! Shapes: poses of the tool in the work object (mm), shares s of the path from 0 to 1.
//! Source: ABB, RAPID reference manual, MoveC and CirPathMode; DIN 66025 for G2 and G3. Departure: CirPathMode \ObjectFrame
//! and the wrist modes are taken as the standard mode; the position on the circle is the same in all.
//! Checked against: circles and helices in closed form, full circles, a tool that keeps its orientation, one that turns with
//! the path.

use std::f64::consts::TAU;

use nalgebra::{Point3, Unit, UnitQuaternion, Vector3};

use truegrind_math::se3::Pose;
use truegrind_programs::motion::{AxisTurn, Motion, Switch};

/// An arc whose ends are closer than this is a full circle (mm). Never less than what the NC writers close: a corrected full
/// circle whose ends are this close is written as one, and must be followed as one here.
pub(crate) const CLOSED_MM: f64 = 2e-3;

/// An arc about a stated axis whose ends are closer than this (mm), or than this share of their distance from the point opposite, is taken as
/// a full turn whose ends are corrected differently: its centre is then known to about three thousandths of a millimetre all the same.
const NEARLY_CLOSED_MM: f64 = 0.3;
const NEARLY_CLOSED_SHARE: f64 = 0.01;

/// An arc from its start over a point to its end, possibly rising along its axis.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Arc {
    /// On the axis, at the height of the start (mm).
    pub centre: Point3<f64>,
    /// The axis; the arc turns positively about it.
    pub axis: Unit<Vector3<f64>>,
    /// Unit vector from the axis to the start.
    x: Vector3<f64>,
    y: Vector3<f64>,
    /// Its radius (mm).
    pub radius: f64,
    /// Swept angle (rad), positive.
    pub sweep: f64,
    /// Total rise along the axis (mm).
    rise: f64,
}

impl Arc {
    /// The arc through three points, about the axis where one is stated; `None` where the points are collinear or coincide.
    pub fn through(
        start: &Point3<f64>,
        via: &Point3<f64>,
        end: &Point3<f64>,
        axis: Option<&Unit<Vector3<f64>>>,
    ) -> Option<Self> {
        let (mut a, mut b) = (via - start, end - start);
        let mut rise = 0.0;
        let is_stated = axis.is_some();
        let axis = match axis {
            Some(axis) => {
                rise = axis.dot(&b);
                a -= axis.into_inner() * axis.dot(&a);
                b -= axis.into_inner() * rise;
                *axis
            }
            None => Unit::try_new(a.cross(&b), 1e-9)?,
        };
        let whole = b.norm() < CLOSED_MM;
        // Three points do not determine the circle where two of them are almost one. In an NC program the third is opposite.
        let nearly_whole = is_stated && b.norm() < NEARLY_CLOSED_MM.max(NEARLY_CLOSED_SHARE * a.norm());
        let to_centre = if whole {
            0.5 * a
        } else if nearly_whole && a.norm() > 4.0 * b.norm() {
            0.5 * (a + 0.5 * b)
        } else {
            let normal = a.cross(&b);
            let square = normal.norm_squared();
            if square < 1e-9 {
                return None;
            }
            (normal.cross(&a) * b.norm_squared() + b.cross(&normal) * a.norm_squared()) / (2.0 * square)
        };
        let radius = to_centre.norm();
        if !(radius > CLOSED_MM) {
            return None;
        }
        let x = -to_centre / radius;
        let y = axis.cross(&x);
        let angle = |point: &Vector3<f64>| {
            let off = point - to_centre;
            off.dot(&y).atan2(off.dot(&x)).rem_euclid(TAU)
        };
        // About a stated axis a full turn whose ends are corrected differently may end a little behind its start.
        let past_start = if angle(&a) > angle(&b) { TAU } else { 0.0 };
        let sweep = if whole { TAU } else { angle(&b) + past_start };
        Some(Self { centre: start + to_centre, axis, x, y, radius, sweep, rise })
    }

    /// The point at a share of the arc.
    pub fn at(&self, s: f64) -> Point3<f64> {
        let (sin, cos) = (self.sweep * s).sin_cos();
        self.centre + (self.x * cos + self.y * sin) * self.radius + self.axis.into_inner() * (self.rise * s)
    }

    /// Its length (mm).
    pub fn length_mm(&self) -> f64 {
        (self.radius * self.sweep).hypot(self.rise)
    }

    /// The share of the arc nearest in angle to a point, close to `near`.
    fn share(&self, point: &Point3<f64>, near: f64) -> f64 {
        let off = point - self.centre;
        let angle = off.dot(&self.y).atan2(off.dot(&self.x));
        let turns = ((near * self.sweep - angle) / TAU).round();
        (angle + turns * TAU) / self.sweep
    }

    /// Distance of a point from the arc and its continuation (mm), close to the share `near`.
    pub fn distance(&self, point: &Point3<f64>, near: f64) -> f64 {
        let s = self.share(point, near);
        let off = point - self.at(s);
        let (sin, cos) = (self.sweep * s).sin_cos();
        let along =
            (self.y * cos - self.x * sin) * (self.radius * self.sweep) + self.axis.into_inner() * self.rise;
        lateral_offset(&off, &along)
    }

    fn turn(&self, s: f64) -> UnitQuaternion<f64> {
        UnitQuaternion::from_axis_angle(&self.axis, self.sweep * s)
    }
}

/// The component of an offset normal to a direction; the whole offset where there is no direction.
pub(crate) fn lateral_offset(off: &Vector3<f64>, along: &Vector3<f64>) -> f64 {
    match along.try_normalize(1e-6) {
        Some(direction) => (off - direction * direction.dot(off)).norm(),
        None => off.norm(),
    }
}

/// Orientation of the tool along an arc.
#[derive(Debug, Clone, Copy, PartialEq)]
enum Turning {
    /// By the shortest rotation from start to end.
    Shortest,
    /// By this rotation vector within the frame that moves along the path (rad).
    WithPath(Vector3<f64>),
    /// Over the orientation of the circle point, reached at this share.
    Over(UnitQuaternion<f64>, f64),
    /// By three words that run linearly.
    Axes(AxisTurn),
}

/// What a curve has beyond its ends.
#[derive(Debug, Clone, PartialEq)]
struct Form {
    /// Absent on a straight line.
    arc: Option<Arc>,
    turning: Turning,
}

/// The path of the tool from one pose to another.
#[derive(Debug, Clone, PartialEq)]
pub struct Curve {
    /// Start.
    pub from: Pose,
    /// End.
    pub to: Pose,
    /// Elsewhere, because nearly every curve is a line by the shortest rotation and is copied a few times.
    form: Option<Box<Form>>,
}

impl Curve {
    /// A straight line.
    pub fn line(from: Pose, to: Pose) -> Self {
        Self { from, to, form: None }
    }

    /// The arc of a circular motion; `None` where its points make none.
    pub fn round(from: Pose, via: &Pose, to: Pose, motion: &Motion) -> Option<Self> {
        let point = |p: &Pose| Point3::from(p.translation.vector);
        let axis = motion.axis.as_deref().and_then(|axis| Unit::try_new(Vector3::from(*axis), 1e-9));
        let arc = Arc::through(&point(&from), &point(via), &point(&to), axis.as_ref())?;
        let middle = arc.share(&point(via), 0.5).clamp(0.0, 1.0);
        let turning = if axis.is_some() {
            Turning::Shortest
        } else if motion.modal.circle_point_orientation == Switch::On {
            Turning::Over(via.rotation, middle.clamp(0.01, 0.99))
        } else {
            with_path(&arc, &from.rotation, &via.rotation, middle, &to.rotation)
        };
        Some(Self { from, to, form: Some(Box::new(Form { arc: Some(arc), turning })) })
    }

    /// The same path on which the words of orientation run linearly. The words of its ends are those that mean their orientations and are
    /// nearest to the words of the program, which is how a correction writes them.
    pub(crate) fn by_axes(&self, turn: &AxisTurn) -> Self {
        let AxisTurn { convention, from_deg, to_deg } = *turn;
        let turning = Turning::Axes(AxisTurn {
            convention,
            from_deg: convention.angles(&self.from.rotation, from_deg),
            to_deg: convention.angles(&self.to.rotation, to_deg),
        });
        Self { form: Some(Box::new(Form { arc: self.arc().copied(), turning })), ..self.clone() }
    }

    /// The arc, where it is one.
    pub fn arc(&self) -> Option<&Arc> {
        self.form.as_deref()?.arc.as_ref()
    }

    /// The share at which a point on the arc is passed; one half for a line.
    pub(crate) fn passes(&self, via: &Pose) -> f64 {
        let point = Point3::from(via.translation.vector);
        self.arc().map_or(0.5, |arc| arc.share(&point, 0.5).clamp(0.0, 1.0))
    }

    /// The pose at a share of the path.
    pub fn at(&self, s: f64) -> Pose {
        let Some(Form { arc, turning }) = self.form.as_deref() else {
            return between(&self.from, &self.to, s);
        };
        let rotation = match turning {
            Turning::Axes(turn) => turn.at(s),
            Turning::Shortest => turned(&self.from.rotation, &self.to.rotation, s),
            Turning::WithPath(v) => {
                let along = arc.map_or_else(UnitQuaternion::identity, |arc| arc.turn(s));
                along * self.from.rotation * UnitQuaternion::from_scaled_axis(v * s)
            }
            Turning::Over(via, at) if s < *at => turned(&self.from.rotation, via, s / at),
            Turning::Over(via, at) => turned(via, &self.to.rotation, (s - at) / (1.0 - at)),
        };
        let position = match arc {
            Some(arc) => arc.at(s).coords,
            None => self.from.translation.vector.lerp(&self.to.translation.vector, s),
        };
        Pose::from_parts(position.into(), rotation)
    }

    /// Its length (mm).
    pub fn length_mm(&self) -> f64 {
        match self.arc() {
            Some(arc) => arc.length_mm(),
            None => (self.to.translation.vector - self.from.translation.vector).norm(),
        }
    }

    /// Total rotation of the tool (rad), in steps so that a rotation beyond half a turn is seen.
    pub fn turn_rad(&self) -> f64 {
        if self.form.is_none() {
            return self.from.rotation.angle_to(&self.to.rotation);
        }
        let at = |k: i32| self.at(f64::from(k) / 4.0).rotation;
        (0..4).map(|k| at(k).angle_to(&at(k + 1))).sum()
    }

    /// How far the words of orientation run, all together, where they run linearly; else 0.
    pub(crate) fn axes_turn_rad(&self) -> f64 {
        match self.form.as_deref() {
            Some(Form { turning: Turning::Axes(turn), .. }) => {
                let ran = turn.from_deg.iter().zip(turn.to_deg).map(|(from, to)| (to - from).abs());
                ran.sum::<f64>().to_radians()
            }
            _ => 0.0,
        }
    }

    /// Distance of a pose from the path (mm), close to this share.
    pub fn distance(&self, pose: &Pose, near: f64) -> f64 {
        match self.arc() {
            Some(arc) => arc.distance(&Point3::from(pose.translation.vector), near),
            None => {
                let along = self.to.translation.vector - self.from.translation.vector;
                let on = self.from.translation.vector + along * near;
                lateral_offset(&(pose.translation.vector - on), &along)
            }
        }
    }
}

/// Straight position, orientation by the shortest rotation.
pub(crate) fn between(from: &Pose, to: &Pose, s: f64) -> Pose {
    let position = from.translation.vector.lerp(&to.translation.vector, s);
    Pose::from_parts(position.into(), turned(&from.rotation, &to.rotation, s))
}

fn turned(from: &UnitQuaternion<f64>, to: &UnitQuaternion<f64>, s: f64) -> UnitQuaternion<f64> {
    from.try_slerp(to, s, 1e-9).unwrap_or(*from)
}

/// The rotation within the moving frame that passes nearest to the orientation of the circle point.
fn with_path(
    arc: &Arc,
    from: &UnitQuaternion<f64>,
    via: &UnitQuaternion<f64>,
    middle: f64,
    to: &UnitQuaternion<f64>,
) -> Turning {
    let short = (from.inverse() * arc.turn(-1.0) * to).scaled_axis();
    // One full turn more about the same axis, or about the axis of the arc where there is no rotation yet.
    let about = short.try_normalize(1e-3).unwrap_or_else(|| from.inverse() * arc.axis.into_inner());
    let off = |v: &Vector3<f64>| {
        (arc.turn(middle) * from * UnitQuaternion::from_scaled_axis(v * middle)).angle_to(via)
    };
    let mut best = short;
    for other in [short - about * TAU, short + about * TAU] {
        // The shortest rotation unless another is clearly nearer.
        if off(&other) + 0.1 < off(&best) {
            best = other;
        }
    }
    Turning::WithPath(best)
}
