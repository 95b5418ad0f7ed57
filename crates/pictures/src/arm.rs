//! Body of an arm and its motion over the time axis.
//!
//! **Method.** Every link is an entity inside the one before it, with the pose of its frame in the frame before as a
//! column over time; its body is drawn once, in its own frame. In frame i the joint axis i and its origin do not move
//! (T = Rz(θ) Tz(d) Tx(a) Rx(α) Ry(β): the inverse's translation does not contain θ), so a link is the cylinder along d
//! and the capsule along a, and a disc around the joint axis. Radii are proportional to the
//! length of the arm, since data sheets contain no shapes. Meshes named by a robot file are drawn instead, each in its link frame.
//! Joint effects and thermal growth move the frames, not the bodies.

use nalgebra::{Point3, UnitQuaternion, Vector3};
use re_sdk_types::archetypes::{Capsules3D, Cylinders3D, Mesh3D, Points3D, Transform3D};
use re_sdk_types::components::{Color, FillMode, RotationQuat, Translation3D};

use super::colour::Rgba;
use super::recording::{Store, VisualError};
use truegrind_arm::condition::Condition;
use truegrind_arm::model::{Joints, Model, PreparedModel};
use truegrind_math::se3::Pose;
use truegrind_surfaces::Tessellation;

/// Radius of each link, relative to the length of the arm.
const GIRTH: [f64; 6] = [0.056, 0.046, 0.042, 0.034, 0.028, 0.022];
/// Height and radius of the foot, relative to the length of the arm.
const FOOT: [f64; 2] = [0.05, 0.095];
/// Thickness of the flange, relative to the length of the arm.
const FLANGE: f64 = 0.014;
/// Radius of the tool, relative to the length of the arm.
const TOOL: f64 = 0.020;
/// Links shorter than this share of the arm have no body.
const SHORT: f64 = 0.02;

/// Thickness of a ghost over that of the arm.
const GHOST_GIRTH: f64 = 1.04;

/// Colours and thickness of an arm.
#[derive(Debug, Clone, Copy)]
pub(super) struct Paint {
    pub(super) link: Rgba,
    pub(super) joint: Rgba,
    pub(super) tool: Rgba,
    /// Factor of all radii. A ghost is a little thicker, since surfaces that coincide are drawn in stripes.
    pub(super) girth: f64,
}

impl Paint {
    /// Neutral colours.
    pub(super) const SOLID: Paint = Paint {
        link: [205, 209, 215, 255],
        joint: [112, 120, 133, 255],
        tool: [150, 158, 170, 255],
        girth: 1.0,
    };

    /// A single colour.
    pub(super) fn of([r, g, b, _]: Rgba) -> Paint {
        let darker = |c: u8| (u16::from(c) * 7 / 10) as u8;
        let joint = [darker(r), darker(g), darker(b), 255];
        Paint { link: [r, g, b, 255], joint, tool: joint, girth: 1.0 }
    }

    /// A single transparent colour.
    pub(super) fn ghost([r, g, b, _]: Rgba) -> Paint {
        Paint { link: [r, g, b, 64], joint: [r, g, b, 90], tool: [r, g, b, 110], girth: GHOST_GIRTH }
    }
}

/// A mesh of a link.
#[derive(Debug, Clone, PartialEq)]
pub struct LinkMesh {
    /// Its frame: 0 is the base, i the end of link i.
    pub frame: usize,
    /// Pose in that frame.
    pub pose: Pose,
    /// Triangles (mm) in its own frame.
    pub triangles: Tessellation,
}

/// Settings common to all drawings of an arm.
#[derive(Debug, Clone, Copy)]
pub(super) struct Figure<'a> {
    pub(super) model: &'a Model,
    pub(super) condition: &'a Condition,
    pub(super) meshes: &'a [LinkMesh],
}

/// State of an arm at one time.
#[derive(Debug, Clone, Copy)]
pub(super) struct ArmState {
    /// Time.
    pub(super) time: i64,
    /// Controller angles.
    pub(super) joints: Joints,
    /// The tool on the flange.
    pub(super) flange_from_tool: Pose,
}

/// Draws an arm below the entity `root` at `states`, in order of time.
pub(super) fn draw(
    store: &mut Store,
    root: &str,
    figure: Figure<'_>,
    paint: &Paint,
    (axis, states): (&'static str, &[ArmState]),
) -> Result<(), VisualError> {
    let arm = figure.model.at_condition(figure.condition);
    let frames: Vec<[Pose; 7]> = states.iter().map(|s| frames(&arm, &s.joints)).collect();
    let posed = Posed { frames: &frames, flange: figure.model.flange };
    draw_posed(store, root, figure, &posed, paint, (axis, states))
}

/// The frames of an arm at each of its states.
pub(super) struct Posed<'a> {
    pub(super) frames: &'a [[Pose; 7]],
    pub(super) flange: Pose,
}

/// Draws an arm with given frames.
pub(super) fn draw_posed(
    store: &mut Store,
    root: &str,
    figure: Figure<'_>,
    &Posed { frames, flange }: &Posed<'_>,
    paint: &Paint,
    (axis, states): (&'static str, &[ArmState]),
) -> Result<(), VisualError> {
    let Some(first) = states.first() else { return Ok(()) };
    let length = length_mm(figure.model) * paint.girth;
    if !shown(store, root, 0, figure.meshes, paint)? {
        foot(store, root, length, paint)?;
    }
    let times: Vec<i64> = states.iter().map(|s| s.time).collect();
    let mut path = root.to_owned();
    for link in 0..6 {
        path = format!("{path}/link{}", link + 1);
        let poses: Vec<Pose> = frames.iter().map(|f| f[link].inverse() * f[link + 1]).collect();
        motion(store, &path, (axis, &times), &poses)?;
        if !shown(store, &path, link + 1, figure.meshes, paint)? {
            body(store, &path, link, &poses[0].inverse(), figure.model, length, paint)?;
        }
    }
    path = format!("{path}/flange");
    still(store, &path, &flange)?;
    if figure.meshes.is_empty() {
        let disc = Cylinder {
            from: Vector3::z() * (-FLANGE * length),
            to: Vector3::zeros(),
            radius: GIRTH[5] * length * 1.3,
        };
        cylinders(store, &format!("{path}/plate"), &[disc], paint.joint)?;
    }
    // The tool is logged when it changes.
    path = format!("{path}/tool");
    let mut last = None;
    let mut changes: Vec<ArmState> = Vec::new();
    for state in states {
        if last.replace(state.flange_from_tool) != Some(state.flange_from_tool) {
            changes.push(*state);
        }
    }
    let times: Vec<i64> = changes.iter().map(|s| s.time).collect();
    let tools: Vec<Pose> = changes.iter().map(|s| s.flange_from_tool).collect();
    motion(store, &path, (axis, &times), &tools)?;
    tool(store, &path, &first.flange_from_tool, length, paint)
}

/// Draws the meshes of a frame; returns whether there are any.
fn shown(
    store: &mut Store,
    path: &str,
    frame: usize,
    meshes: &[LinkMesh],
    paint: &Paint,
) -> Result<bool, VisualError> {
    let of_frame: Vec<&LinkMesh> = meshes.iter().filter(|mesh| mesh.frame == frame).collect();
    for (k, mesh) in of_frame.iter().enumerate() {
        let xyz = |v: Vector3<f64>| [v.x as f32, v.y as f32, v.z as f32];
        let vertices = mesh.triangles.vertices_mm.iter().map(|v| xyz((mesh.pose * v).coords));
        let normals = mesh.triangles.normals.iter().map(|n| xyz(mesh.pose.rotation * n.into_inner()));
        let drawn = Mesh3D::new(vertices)
            .with_vertex_normals(normals)
            .with_triangle_indices(mesh.triangles.triangles.iter().copied())
            .with_albedo_factor(re_sdk_types::datatypes::Rgba32::from(paint.link));
        store.fixed(format!("{path}/mesh{}", k + 1), &drawn)?;
    }
    Ok(!of_frame.is_empty())
}

/// All frames in the base frame: 0 is the base, i the end of link i.
pub(super) fn frames(arm: &PreparedModel<'_>, joints: &Joints) -> [Pose; 7] {
    let chain = arm.frames(joints);
    std::array::from_fn(|i| {
        if i == 0 {
            return Pose::identity();
        }
        let (y, z) = (Vector3::from(chain.y[i - 1]), Vector3::from(chain.z[i]));
        let matrix = nalgebra::Matrix3::from_columns(&[y.cross(&z), y, z]);
        Pose::from_parts(
            Vector3::from(chain.origin[i]).into(),
            truegrind_math::se3::rotation_from_matrix(&matrix),
        )
    })
}

/// Sum of the lengths and offsets of all links (mm).
pub(super) fn length_mm(model: &Model) -> f64 {
    model.links.iter().map(|l| l.a_mm.abs() + l.d_mm.abs()).sum::<f64>().max(1.0)
}

/// Points occupied by the arm at `joints`, to place the camera.
pub(super) fn extent(arm: &PreparedModel<'_>, joints: &Joints, length: f64) -> Vec<Point3<f64>> {
    let girth = FOOT[1] * length;
    let around = |f: &Pose| {
        let at = Point3::from(f.translation.vector);
        [Vector3::x(), Vector3::y(), Vector3::z()].map(|v| v * girth).map(|v| [at + v, at - v])
    };
    frames(arm, joints).iter().flat_map(around).flatten().collect()
}

/// A time-dependent pose.
pub(super) fn motion(
    store: &mut Store,
    path: &str,
    (axis, times): (&'static str, &[i64]),
    poses: &[Pose],
) -> Result<(), VisualError> {
    let columns = Transform3D::new()
        .with_many_translation(poses.iter().map(|p| translation(&p.translation.vector)))
        .with_many_quaternion(poses.iter().map(|p| quaternion(&p.rotation)))
        .columns_of_unit_batches()
        .map_err(|e| VisualError::Encoding(e.to_string()))?;
    store.over(path, (axis, times), columns)
}

/// A constant pose.
pub(super) fn still(store: &mut Store, path: &str, pose: &Pose) -> Result<(), VisualError> {
    let placed = Transform3D::new()
        .with_translation(translation(&pose.translation.vector))
        .with_quaternion(quaternion(&pose.rotation));
    store.fixed(path, &placed)
}

fn translation(v: &Vector3<f64>) -> Translation3D {
    Translation3D::new(v.x as f32, v.y as f32, v.z as f32)
}

fn quaternion(q: &UnitQuaternion<f64>) -> RotationQuat {
    RotationQuat(re_sdk_types::datatypes::Quaternion::from_xyzw(q.coords.map(|c| c as f32).into()))
}

/// A cylinder between two points.
#[derive(Debug, Clone, Copy)]
struct Cylinder {
    from: Vector3<f64>,
    to: Vector3<f64>,
    radius: f64,
}

impl Cylinder {
    fn length(&self) -> f64 {
        (self.to - self.from).norm()
    }

    fn rotation(&self) -> UnitQuaternion<f64> {
        let along = self.to - self.from;
        UnitQuaternion::rotation_between(&Vector3::z(), &along)
            .unwrap_or_else(|| UnitQuaternion::from_axis_angle(&Vector3::x_axis(), std::f64::consts::PI))
    }
}

fn foot(store: &mut Store, root: &str, length: f64, paint: &Paint) -> Result<(), VisualError> {
    let [height, radius] = FOOT.map(|part| part * length);
    let plate = Cylinder { from: Vector3::zeros(), to: Vector3::z() * height, radius };
    cylinders(store, &format!("{root}/foot"), &[plate], paint.joint)
}

/// Body of a link in its own frame.
fn body(
    store: &mut Store,
    path: &str,
    link: usize,
    own_from_previous: &Pose,
    model: &Model,
    length: f64,
    paint: &Paint,
) -> Result<(), VisualError> {
    let radius = GIRTH[link] * length;
    let axis = own_from_previous.rotation * Vector3::z();
    let start = own_from_previous.translation.vector;
    let corner = start + axis * model.links[link].d_mm;
    let bars: Vec<Cylinder> = [(start, corner), (corner, Vector3::zeros())]
        .into_iter()
        .map(|(from, to)| Cylinder { from, to, radius })
        .filter(|bar| bar.length() > SHORT * length)
        .collect();
    // The last link ends flat at the flange.
    if link == 5 {
        cylinders(store, &format!("{path}/body"), &bars, paint.link)?;
    } else if !bars.is_empty() {
        let capsules = Capsules3D::from_lengths_and_radii(
            bars.iter().map(|b| b.length() as f32),
            bars.iter().map(|b| b.radius as f32),
        )
        .with_translations(bars.iter().map(|b| translation(&b.from)))
        .with_quaternions(bars.iter().map(|b| quaternion(&b.rotation())))
        .with_colors([Color::from(paint.link)])
        .with_fill_mode(FillMode::Solid);
        store.fixed(format!("{path}/body"), &capsules)?;
    }
    // The disc of joint i is around axis i, through the origin of the previous frame; that of the last joint is the flange.
    if link < 5 {
        let half = axis * (1.15 * radius);
        let disc = Cylinder { from: start - half, to: start + half, radius: 1.12 * radius };
        cylinders(store, &format!("{path}/joint"), &[disc], paint.joint)?;
    }
    Ok(())
}

/// A spindle from the flange to the TCP, in the tool frame, and a ball at the TCP.
fn tool(
    store: &mut Store,
    path: &str,
    flange_from_tool: &Pose,
    length: f64,
    paint: &Paint,
) -> Result<(), VisualError> {
    let mount = flange_from_tool.inverse().translation.vector;
    let radius = TOOL * length;
    if mount.norm() > 0.5 * SHORT * length {
        let neck = mount * 0.35;
        let bars = [
            Cylinder { from: mount, to: neck, radius },
            Cylinder { from: neck, to: Vector3::zeros(), radius: 0.4 * radius },
        ];
        cylinders(store, &format!("{path}/body"), &bars, paint.tool)?;
    }
    let tip = Points3D::new([[0.0f32; 3]]).with_radii([(0.5 * radius) as f32]).with_colors([Color::from([
        paint.tool[0],
        paint.tool[1],
        paint.tool[2],
        255,
    ])]);
    store.fixed(format!("{path}/tcp"), &tip)
}

fn cylinders(store: &mut Store, path: &str, bars: &[Cylinder], colour: Rgba) -> Result<(), VisualError> {
    if bars.is_empty() {
        return Ok(());
    }
    let drawn = Cylinders3D::from_lengths_and_radii(
        bars.iter().map(|b| b.length() as f32),
        bars.iter().map(|b| b.radius as f32),
    )
    .with_centers(bars.iter().map(|b| translation(&(0.5 * (b.from + b.to)))))
    .with_quaternions(bars.iter().map(|b| quaternion(&b.rotation())))
    .with_colors([Color::from(colour)])
    .with_fill_mode(FillMode::Solid);
    store.fixed(path, &drawn)
}
