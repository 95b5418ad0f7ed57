//! Export of an arm to other formats. They contain links and joint ranges; [`lost_in_export`] lists everything else.

use std::fmt::Write;

use nalgebra::{Matrix6, Rotation3, UnitQuaternion, Vector3, Vector6};

use crate::condition::Condition;
use crate::joints::Joints;
use crate::model::Model;
use truegrind_math::se3::Pose;

/// An export format.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Format {
    /// Unified Robot Description Format: links without shapes.
    Urdf,
    /// Standard table of Denavit–Hartenberg parameters.
    Standard,
    /// The same after Craig.
    Modified,
    /// The kinematics file of ROS drivers for Universal Robots.
    UrYaml,
}

/// The joints of a UR kinematics file.
const UR: [&str; 6] = ["shoulder", "upper_arm", "forearm", "wrist_1", "wrist_2", "wrist_3"];

/// Twists of the first five links of every arm of Universal Robots (°, without signs): axes 2 to 4 are parallel, the others stand across.
const UR_TWISTS_DEG: [f64; 5] = [90.0, 0.0, 0.0, 90.0, 90.0];

/// How far a twist of a data sheet may be from these (°).
const SAME_TWIST_DEG: f64 = 5.0;

/// Whether the axes of a nominal arm lie as those of an arm of Universal Robots.
pub fn has_axes_of_ur(nominal: &Model) -> bool {
    let twists = nominal.links.iter().map(|link| link.alpha_rad.to_degrees().abs());
    twists.zip(UR_TWISTS_DEG).all(|(found, expected)| (found - expected).abs() < SAME_TWIST_DEG)
}

/// Parts of an arm that the format cannot represent, one sentence each.
pub fn lost_in_export(model: &Model, format: Format) -> Vec<String> {
    let mut out = Vec::new();
    let acting = model.effects.iter().filter(|effect| !effect.is_zero());
    let names: Vec<&str> = acting.map(|effect| effect.name()).collect();
    if !names.is_empty() {
        out.push(format!("effects beyond rigid links are left out: {}", names.join(", ")));
    }
    if format != Format::Urdf && model.bodies.is_some() {
        out.push("masses are left out".to_owned());
    }
    let behind = flange_in_last_frame(model, format);
    if behind != Pose::identity() {
        let (place, turn) = (behind.translation.vector, behind.rotation);
        out.push(format!(
            "the file ends at the last link frame; the flange lies in it at ({}, {}, {}) mm, turned by the quaternion \
             ({}, {}, {}, {}), w first",
            place.x, place.y, place.z, turn.w, turn.i, turn.j, turn.k
        ));
    }
    out.extend(angle_note(model, format));
    out.extend(far_normals(model, format));
    if format == Format::UrYaml {
        out.push(
            "the driver will report that `hash` differs from the factory calibration of the controller. This is correct: the controller's own \
             Cartesian moves do not use this arm"
                .to_owned(),
        );
    }
    if format == Format::UrYaml && model.limits.speed_rad_s.is_some() {
        out.push("ranges and speeds of joints are left out".to_owned());
    }
    if format != Format::Urdf {
        let sums = model.limits.sums.iter().map(|sum| format!("the range of {} is left out", sum.name()));
        out.extend(sums);
    }
    out
}

/// What to keep in mind where nearly parallel axes put a common normal far away.
fn far_normals(model: &Model, format: Format) -> Option<String> {
    let farthest_mm = plain_dh(model).iter().map(|row| row[1].abs()).fold(0.0, f64::max);
    let is_table = matches!(format, Format::Standard | Format::Modified);
    (is_table && farthest_mm > FAR_MM).then(|| {
        format!(
            "nearly parallel axes: their common normal lies {:.0} m away, so that angles must keep all their digits (rounding one at the \
             fourth decimal of a degree can move the flange by {:.1} mm); a URDF has no such numbers",
            farthest_mm / 1000.0,
            farthest_mm * 0.5e-4_f64.to_radians()
        )
    })
}

/// A common normal farther than this makes a table ill-conditioned (mm).
const FAR_MM: f64 = 10_000.0;

/// The flange in the last frame of a format: a table ends before the flange; Craig's, and the file of UR drivers, also before
/// length and twist of the last link.
pub fn flange_in_last_frame(model: &Model, format: Format) -> Pose {
    let last = &model.links[5];
    match format {
        Format::Urdf => Pose::identity(),
        Format::Standard => model.flange,
        Format::Modified | Format::UrYaml => {
            let turn = UnitQuaternion::from_axis_angle(&Vector3::x_axis(), last.alpha_rad);
            Pose::from_parts(Vector3::new(last.a_mm, 0.0, 0.0).into(), turn) * model.flange
        }
    }
}

/// Matrix from controller angles to the joint angles of a file: signs and couplings that the format cannot represent and that
/// users of the exported arm must apply.
pub fn joint_matrix(model: &Model, format: Format) -> Matrix6<f64> {
    match format {
        Format::Standard | Format::Modified => Matrix6::identity(),
        Format::Urdf => Matrix6::from_diagonal(&signs(model)) * model.joint_map,
        Format::UrYaml => model.joint_map,
    }
}

/// Sign of each joint axis of a URDF, so that an uncoupled joint counts as in the controller.
fn signs(model: &Model) -> Vector6<f64> {
    model.joint_map.diagonal().map(|turn| if turn < 0.0 { -1.0 } else { 1.0 })
}

/// Note on the joints of a file that differ from the controller's; `None` where none does.
fn angle_note(model: &Model, format: Format) -> Option<String> {
    let angles = joint_matrix(model, format);
    let sum = |i: usize| {
        let mut out = String::new();
        for (j, turn) in angles.row(i).iter().enumerate().filter(|(_, turn)| **turn != 0.0) {
            let sign = match (*turn < 0.0, out.is_empty()) {
                (true, true) => "−",
                (true, false) => " − ",
                (false, true) => "",
                (false, false) => " + ",
            };
            let times = if turn.abs() == 1.0 { String::new() } else { format!("{} ", turn.abs()) };
            let _ = write!(out, "{sign}{times}J{}", j + 1);
        }
        if out.is_empty() { "0".to_owned() } else { out }
    };
    let own = Matrix6::<f64>::identity();
    let others: Vec<String> = (0..6)
        .filter(|i| angles.row(*i) != own.row(*i))
        .map(|i| format!("joint {} = {}", i + 1, sum(i)))
        .collect();
    (!others.is_empty()).then(|| {
        let ranges = match format {
            Format::Urdf => "; their ranges are those of the sums",
            _ => "",
        };
        format!(
            "some joint angles of the file differ from those of the controller (J1 to J6); whoever moves the arm must compute them: {}{ranges}",
            others.join(", ")
        )
    })
}

/// The links of an arm in a format; `name` is the robot's, `notes` become comments.
pub fn write(model: &Model, name: &str, format: Format, notes: &[String]) -> String {
    match format {
        Format::Urdf => urdf(model, name, notes),
        Format::Standard => table(model, false, notes),
        Format::Modified => table(model, true, notes),
        Format::UrYaml => ur_yaml(model, notes),
    }
}

/// The frame of each joint, which rotates about its z, in the one before; last the flange; all joints at zero.
fn joint_frames(model: &Model) -> [Pose; 7] {
    let mut out = [Pose::identity(); 7];
    let mut rest = Pose::identity();
    for (place, link) in out.iter_mut().zip(&model.links) {
        // The offset theta rotates the frame before the joint; the rest of the link belongs to the next frame.
        let turn = UnitQuaternion::from_axis_angle(&Vector3::z_axis(), link.theta_rad);
        let turned = Pose::from_parts(Default::default(), turn);
        *place = rest * turned;
        rest = turned.inverse() * link.pose(0.0);
    }
    out[6] = rest * model.flange;
    out
}

/// Lines of comments, safe for XML, YAML and tables alike.
fn comments(notes: &[String]) -> impl Iterator<Item = String> {
    notes.iter().map(|note| note.replace(['\n', '\r'], " ").replace("--", "– "))
}

fn urdf(model: &Model, name: &str, notes: &[String]) -> String {
    let plain: String = name
        .chars()
        .map(|c| if c.is_ascii_alphanumeric() || c == '_' || c == '-' { c } else { '_' })
        .collect();
    let mut out = String::from("<?xml version=\"1.0\"?>\n");
    for note in comments(notes) {
        let _ = writeln!(out, "<!-- {note} -->");
    }
    let _ = writeln!(out, "<robot name=\"{plain}\">\n  <link name=\"base_link\"/>");
    let frames = model.at_condition(&Condition::default()).frames(&Joints::zeros());
    let (poses, signs, ranges) = (joint_frames(model), signs(model), Ranges::of(model));
    let mut at = Pose::identity();
    for i in 0..6 {
        at *= poses[i];
        let parent = if i == 0 { "base_link".to_owned() } else { format!("link_{i}") };
        let _ = write!(out, "  <link name=\"link_{}\"", i + 1);
        match &model.bodies {
            Some(bodies) => {
                let end = frame(&frames, i);
                let centre = at.inverse() * end * nalgebra::Point3::from(bodies[i].centre_mm);
                let _ = writeln!(
                    out,
                    ">\n    <inertial>\n      <origin xyz=\"{}\" rpy=\"0 0 0\"/>\n      <mass value=\"{}\"/>\n      \
                     <inertia ixx=\"0\" ixy=\"0\" ixz=\"0\" iyy=\"0\" iyz=\"0\" izz=\"0\"/>\n    </inertial>\n  </link>",
                    metres(&centre.coords),
                    bodies[i].mass_kg
                );
            }
            None => out.push_str("/>\n"),
        }
        let _ = writeln!(
            out,
            "  <joint name=\"joint_{n}\" type=\"revolute\">\n    <parent link=\"{parent}\"/>\n    <child link=\"link_{n}\"/>\n    \
             <origin {}/>\n    <axis xyz=\"0 0 {sign}\"/>\n    <limit lower=\"{low}\" upper=\"{high}\" velocity=\"{speed}\" \
             effort=\"0\"/>\n  </joint>",
            origin(&poses[i]),
            n = i + 1,
            sign = signs[i],
            low = ranges.low_rad[i],
            high = ranges.high_rad[i],
            speed = ranges.speed_rad_s[i]
        );
    }
    let _ = writeln!(
        out,
        "  <link name=\"tool0\"/>\n  <joint name=\"flange\" type=\"fixed\">\n    <parent link=\"link_6\"/>\n    <child \
         link=\"tool0\"/>\n    <origin {}/>\n  </joint>\n</robot>",
        origin(&poses[6])
    );
    out
}

/// Ranges and speeds of the joints of a URDF. The range of a sum is its own where the robot has one, else the sum of the ranges of the
/// controller's joints.
struct Ranges {
    low_rad: [f64; 6],
    high_rad: [f64; 6],
    /// 0 where none are known.
    speed_rad_s: [f64; 6],
}

impl Ranges {
    fn of(model: &Model) -> Self {
        let (angles, limits) = (joint_matrix(model, Format::Urdf), &model.limits);
        let sum = |i: usize, of: &dyn Fn(usize, f64) -> f64| {
            let row = angles.row(i);
            let parts = row.iter().enumerate().filter(|(_, turn)| **turn != 0.0);
            // A sum of one term keeps its bits.
            parts.map(|(j, turn)| turn.abs() * of(j, *turn)).reduce(|a, b| a + b).unwrap_or(0.0)
        };
        let end = |j: usize, lower: bool| match lower {
            true => limits.min_rad[j],
            false => -limits.max_rad[j],
        };
        let own = |i: usize| limits.sums.iter().find_map(|sum| sum.range_of(&angles.row(i).transpose()));
        Self {
            low_rad: std::array::from_fn(|i| {
                own(i).map_or_else(|| sum(i, &|j, turn| end(j, turn > 0.0)), |[low, _]| low)
            }),
            high_rad: std::array::from_fn(|i| {
                own(i).map_or_else(|| sum(i, &|j, turn| -end(j, turn < 0.0)), |[_, high]| high)
            }),
            speed_rad_s: std::array::from_fn(|i| {
                limits.speed_rad_s.map_or(0.0, |speed| sum(i, &|j, _| speed[j]))
            }),
        }
    }
}

/// The frame at the end of a link, all joints at zero.
fn frame(frames: &crate::chain::Chain<f64>, link: usize) -> Pose {
    let [y, z] = [Vector3::from(frames.y[link]), Vector3::from(frames.z[link + 1])];
    let matrix = nalgebra::Matrix3::from_columns(&[y.cross(&z), y, z]);
    let turn = UnitQuaternion::from_rotation_matrix(&Rotation3::from_matrix_unchecked(matrix));
    Pose::from_parts(Vector3::from(frames.origin[link + 1]).into(), turn)
}

fn metres(v: &Vector3<f64>) -> String {
    let [x, y, z] = <[f64; 3]>::from(v / 1000.0).map(without_noise);
    format!("{x} {y} {z}")
}

/// Roll, pitch and yaw (rad).
fn angles(pose: &Pose) -> [f64; 3] {
    let (roll, pitch, yaw) = pose.rotation.euler_angles();
    [roll, pitch, yaw].map(without_noise)
}

/// Rounding noise of a length (m) or an angle (rad) as zero: a femtometre at one metre.
fn without_noise(value: f64) -> f64 {
    if value.abs() < 1e-15 { 0.0 } else { value }
}

fn origin(pose: &Pose) -> String {
    let [roll, pitch, yaw] = angles(pose);
    format!("xyz=\"{}\" rpy=\"{roll} {pitch} {yaw}\"", metres(&pose.translation.vector))
}

fn ur_yaml(model: &Model, notes: &[String]) -> String {
    let mut out = String::new();
    for note in comments(notes) {
        let _ = writeln!(out, "# {note}");
    }
    // The description package reads a hash; the driver compares it with that of the controller's factory calibration.
    out.push_str("kinematics:\n  hash: truegrind\n");
    let mut poses = joint_frames(model);
    // The last frame turns about its own z, along which it may stand anywhere.
    poses[5] *= Pose::translation(0.0, 0.0, model.links[5].d_mm);
    for (name, pose) in UR.iter().zip(&poses) {
        let [x, y, z] = <[f64; 3]>::from(pose.translation.vector / 1000.0).map(without_noise);
        let [roll, pitch, yaw] = angles(pose);
        let _ = writeln!(
            out,
            "  {name}:\n    x: {x}\n    y: {y}\n    z: {z}\n    roll: {roll}\n    pitch: {pitch}\n    yaw: {yaw}",
        );
    }
    out
}

/// Two twists as one about x, with what turns the joints before and after: a common normal that may lie far away.
fn table(model: &Model, modified: bool, notes: &[String]) -> String {
    let rows = plain_dh(model);
    let mut out = String::new();
    for note in comments(notes) {
        let _ = writeln!(out, "# {note}");
    }
    out.push_str("convention,theta_deg,d_mm,a_mm,alpha_deg,min_deg,max_deg,q1,q2,q3,q4,q5,q6\n");
    for (i, row) in rows.iter().enumerate() {
        let [theta, d, ..] = *row;
        let [a, alpha] = match (modified, i) {
            (false, _) => [row[2], row[3]],
            (true, 0) => [0.0, 0.0],
            (true, _) => [rows[i - 1][2], rows[i - 1][3]],
        };
        let word = if modified { "modified" } else { "standard" };
        let _ = write!(
            out,
            "{word},{},{d},{a},{},{},{}",
            theta.to_degrees(),
            alpha.to_degrees(),
            model.limits.min_rad[i].to_degrees(),
            model.limits.max_rad[i].to_degrees()
        );
        for j in 0..6 {
            let _ = write!(out, ",{}", model.joint_map[(i, j)]);
        }
        out.push('\n');
    }
    out
}

/// Rows theta (rad), d (mm), a (mm), alpha (rad) of plain Denavit–Hartenberg links for the same axes: the common normals between
/// them, which for nearly parallel ones lie far away. The last frame stays where it is but for a turn and a shift that the last
/// row takes up; where the last link has a twist, the flange keeps it.
fn plain_dh(model: &Model) -> [[f64; 4]; 6] {
    let mut out = [[0.0; 4]; 6];
    // What the frame of the links is off the frame of the rows: a turn about z and a shift along z, since both have one axis.
    let (mut turn, mut shift) = (0.0, 0.0);
    for (row, link) in out.iter_mut().zip(&model.links) {
        let (sin, cos) = link.beta_rad.sin_cos();
        if sin == 0.0 {
            *row = [link.theta_rad + turn, link.d_mm + shift, link.a_mm, link.alpha_rad];
            (turn, shift) = (0.0, 0.0);
            continue;
        }
        // The next axis in the frame after theta: it passes (a, 0, d) along v.
        let (sin_alpha, cos_alpha) = link.alpha_rad.sin_cos();
        let v = Vector3::new(sin, -sin_alpha * cos, cos_alpha * cos);
        let across = v.x.hypot(v.y);
        let normal = Vector3::new(-v.y, v.x, 0.0) / across;
        let place = Vector3::new(link.a_mm, 0.0, link.d_mm);
        // Where the common normal meets the next axis, counted from the place along it.
        let along = -(place.x * v.x + place.y * v.y) / (across * across);
        let foot = place + v * along;
        let theta = normal.y.atan2(normal.x);
        let alpha = (-(v.y * normal.x - v.x * normal.y)).atan2(v.z);
        *row = [link.theta_rad + turn + theta, foot.z + shift, foot.dot(&normal), alpha];
        // The link's own frame after it: from the rows' frame a shift along z and a turn about it.
        shift = -along;
        let rows_x = normal;
        let links_x = {
            let (sin_b, cos_b) = link.beta_rad.sin_cos();
            Vector3::new(cos_b, sin_alpha * sin_b, -cos_alpha * sin_b)
        };
        turn = rows_x.cross(&links_x).dot(&v).atan2(rows_x.dot(&links_x));
    }
    out
}
