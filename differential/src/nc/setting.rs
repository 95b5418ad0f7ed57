//! What stands beside a program: how A, B and C turn the tool, what tools are, where work offsets lie, and the head of
//! comments that says so.

use nalgebra::{Isometry3, Matrix3, Quaternion, Rotation3, Translation3, UnitQuaternion, Vector3};

use super::Control;

/// A frame (mm).
pub type Pose = Isometry3<f64>;

/// How three angles (°) turn the tool.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Angles {
    /// About fixed x by A, y by B, z by C.
    Wpr,
    /// About z by A, the new y by B, the new x by C.
    Abc,
    /// About x by A, the new y by B, the new z by C.
    Rxyz,
}

fn about(axis: usize, degrees: f64) -> Matrix3<f64> {
    let (sin, cos) = degrees.to_radians().sin_cos();
    match axis {
        0 => Matrix3::new(1.0, 0.0, 0.0, 0.0, cos, -sin, 0.0, sin, cos),
        1 => Matrix3::new(cos, 0.0, sin, 0.0, 1.0, 0.0, -sin, 0.0, cos),
        _ => Matrix3::new(cos, -sin, 0.0, sin, cos, 0.0, 0.0, 0.0, 1.0),
    }
}

fn rotation(matrix: Matrix3<f64>) -> UnitQuaternion<f64> {
    UnitQuaternion::from_rotation_matrix(&Rotation3::from_matrix_unchecked(matrix))
}

impl Angles {
    /// The word for it in a comment.
    pub fn word(self) -> &'static str {
        match self {
            Angles::Wpr => "wpr",
            Angles::Abc => "abc",
            Angles::Rxyz => "rxyz",
        }
    }

    /// How A, B and C turn.
    pub fn turned(self, [a, b, c]: [f64; 3]) -> UnitQuaternion<f64> {
        rotation(match self {
            Angles::Wpr => about(2, c) * about(1, b) * about(0, a),
            Angles::Abc => about(2, a) * about(1, b) * about(0, c),
            Angles::Rxyz => about(0, a) * about(1, b) * about(2, c),
        })
    }

    /// A, B and C of a tool that points down, but for a tilt about x and y and a turn about z.
    pub fn down(self, x: f64, y: f64, z: f64) -> [f64; 3] {
        match self {
            Angles::Wpr | Angles::Rxyz => [180.0 + x, y, z],
            Angles::Abc => [z, y, 180.0 + x],
        }
    }
}

/// How a tool vector (from the tip to the spindle) and the turn about it (°) turn the tool: z of the tool against the
/// vector, x in the plane of z and the work's x, or the work's y where z goes along x.
pub fn by_vector(vector: [f64; 3], spin: f64) -> Option<UnitQuaternion<f64>> {
    let z = -Vector3::from(vector).try_normalize(1e-9)?;
    let along = if z.x.abs() < 0.999 { Vector3::x() } else { Vector3::y() };
    let x = (along - z * along.dot(&z)).normalize();
    Some(rotation(Matrix3::from_columns(&[x, z.cross(&x), z]) * about(2, spin)))
}

/// What a program finds on its machine.
#[derive(Debug, Clone)]
pub struct Setting {
    /// How A, B and C turn.
    pub angles: Angles,
    /// Tools by name.
    pub tools: Vec<(String, Pose)>,
    /// Work offsets by name.
    pub frames: Vec<(String, Pose)>,
    /// Whether a number without a point counts thousandths (Fanuc).
    pub increments: bool,
    /// Whether blocks with a slash are passed over.
    pub skip: bool,
}

impl Setting {
    /// The tool of a name.
    pub fn tool(&self, name: &str) -> Option<Pose> {
        self.tools.iter().find(|(other, _)| other == name).map(|(_, pose)| *pose)
    }

    /// The work offset of a name.
    pub fn frame(&self, name: &str) -> Option<Pose> {
        self.frames.iter().find(|(other, _)| other == name).map(|(_, pose)| *pose)
    }

    /// The comments that say all of it.
    pub fn head(&self, control: Control) -> String {
        let mut lines = vec![format!("truegrind angles {}", self.angles.word())];
        for (what, list) in [("tool", &self.tools), ("frame", &self.frames)] {
            for (name, pose) in list {
                let label = format!("{what}{name}").to_lowercase().replace(['.', '_'], "");
                let name = name.replace("54.1P", "54.1 P");
                lines.push(format!("truegrind {what} {name} {label} {}", written(pose)));
            }
        }
        let line = |line: &String| match control {
            Control::Fanuc => format!("({line})\n"),
            _ => format!("; {line}\n"),
        };
        lines.iter().map(line).collect()
    }
}

fn written(pose: &Pose) -> String {
    let [x, y, z] = pose.translation.vector.into();
    let q = pose.rotation;
    format!("[[{x},{y},{z}],[{},{},{},{}]]", q.w, q.i, q.j, q.k)
}

/// A frame whose numbers a program can write and read back as they are.
pub fn plain(position: [f64; 3], turn: [f64; 3]) -> Pose {
    let full = Angles::Wpr.turned(turn);
    let short = |x: f64| (x * 1e9).round() / 1e9;
    let q = Quaternion::new(short(full.w), short(full.i), short(full.j), short(full.k));
    Pose::from_parts(Translation3::from(Vector3::from(position)), UnitQuaternion::from_quaternion(q))
}
