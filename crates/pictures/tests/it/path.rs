//! The picture of a path.

use std::f64::consts::PI;

use nalgebra::{Isometry3, Point3, Translation3, UnitQuaternion, Vector3};
use re_sdk_types::archetypes::{LineStrips3D, Mesh3D, Points3D, Transform3D};
use re_sdk_types::components::{Color, LineStrip3D, RotationQuat, Translation3D};
use truegrind_arm::condition::Condition;
use truegrind_arm::inverse::Inverse;
use truegrind_arm::model::{Joints, Model};
use truegrind_compensation::deviation::{After, Deviation, MotionStatus, PathPoint, PathReport};
use truegrind_math::se3::Pose;
use truegrind_pictures::colour::{AFTER, BEFORE, Scale};
use truegrind_pictures::path::AXIS;
use truegrind_pictures::{LinkMesh, PathScene, Recording, VisualError, Workpiece, path_recording};
use truegrind_programs::motion::MotionKind;
use truegrind_surfaces::{Surface, Tessellation, sample};

use super::read::Read;

/// A program on a wavy patch, run by an arm that is not quite its data sheet.
pub(super) struct Parts {
    nominal: Model,
    actual: Model,
    reports: Vec<PathReport>,
    triangles: Tessellation,
    base_from_object: Pose,
}

const FLANGE_FROM_TOOL: [f64; 3] = [0.0, 0.0, 120.0];

pub(super) fn scene_parts() -> Parts {
    parts(60)
}

fn parts(count: usize) -> Parts {
    let nominal = truegrind_arm::robots::load("abb-irb-120").unwrap().model;
    let mut actual = nominal.clone();
    for (k, link) in actual.links.iter_mut().enumerate() {
        link.a_mm += 0.3 * (k as f64 - 2.0);
        link.theta_rad += 1e-3 * (k as f64 * 1.7).sin();
        link.alpha_rad += 5e-4 * (k as f64 * 2.3).cos();
    }
    let surface: Surface = sample::BLADE.read().unwrap().surface;
    let base_from_object = Isometry3::from_parts(
        Translation3::new(420.0, 20.0, 250.0),
        UnitQuaternion::from_euler_angles(0.0, 0.05, 0.4),
    );
    let flange_from_tool =
        Pose::from_parts(Translation3::from(Vector3::from(FLANGE_FROM_TOOL)), UnitQuaternion::identity());
    let inverse = Inverse::new(&nominal, &Condition::default(), &nominal);
    let better = Inverse::new(&actual, &Condition::default(), &nominal);
    let (real, told) =
        (actual.at_condition(&Condition::default()), nominal.at_condition(&Condition::default()));
    let mut near: Option<Joints> = None;
    let mut points = Vec::new();
    for index in 0..count {
        // Four passes, of which the first point of each is above the surface.
        let (pass, along) = (index * 4 / count, (index * 4 % count) as f64 / count as f64);
        let share = if pass % 2 == 0 { along } else { 1.0 - along };
        let contact = surface.contact([-40.0 + 26.0 * pass as f64, -70.0 + 140.0 * share]).unwrap();
        let cutting = index * 4 % count >= 4;
        let lift = if cutting { 0.0 } else { 20.0 };
        let place = contact.position_mm + contact.normal.into_inner() * lift;
        let intended = base_from_object
            * Pose::from_parts(Translation3::from(place), UnitQuaternion::from_euler_angles(PI, 0.0, PI));
        let flange = intended * flange_from_tool.inverse();
        let joints = match near {
            Some(seed) => inverse.solve_near(&flange, &seed).unwrap().joints,
            None => inverse.all(&flange)[0].joints,
        };
        near = Some(joints);
        let after = better.solve_near(&flange, &joints).unwrap().joints;
        let normal = contact.normal.into_inner();
        // What is left after: a hundredth of the correction is not made.
        let after = after + (joints - after) * 0.01;
        let off = |q: &Joints| {
            Deviation::between(
                &intended,
                &(real.forward(q) * flange_from_tool),
                &base_from_object,
                Some(&normal),
            )
        };
        assert!((told.forward(&joints).translation.vector - flange.translation.vector).norm() < 1e-6);
        points.push(PathPoint {
            index,
            file: 0,
            line: 10 + index as u32,
            instruction: "MoveL".to_owned(),
            kind: MotionKind::Linear,
            cutting,
            base_from_object,
            part: 0,
            part_from_object: base_from_object,
            flange_from_tool,
            intended,
            normal: Some(normal),
            joints_before: Some(joints),
            joints_after: Some(after),
            before: Some(off(&joints)),
            after: Some(off(&after)),
            sigma_mm: Some(0.05),
            shape_sigma_mm: None,
            outside: None,
            status: MotionStatus::Changed,
            reason: None,
        });
    }
    let report = PathReport {
        program: "blade.mod".to_owned(),
        files: Vec::new(),
        model: "ltlm".to_owned(),
        after: After::PredictedRemainder,
        points,
        missing: None,
        differences: Vec::new(),
        between: None,
        held_out_mm: Some(0.08),
        turn_sigma_rad: None,
        assumptions: Vec::new(),
    };
    Parts { nominal, actual, reports: vec![report], triangles: surface.tessellate(20), base_from_object }
}

pub(super) fn titled(parts: &Parts, title: &str) -> Recording {
    path_recording(&PathScene {
        title,
        arm: &parts.actual,
        nominal: &parts.nominal,
        meshes: &[],
        arm_is: "simulated actual arm",
        condition: Condition::default(),
        reports: &parts.reports,
        workpiece: Some(Workpiece { triangles: &parts.triangles, base_from_object: parts.base_from_object }),
    })
    .unwrap()
}

pub(super) fn recording(parts: &Parts) -> Recording {
    titled(parts, "blade")
}

fn read(parts: &Parts) -> Read {
    Read::of(&recording(parts).rrd().unwrap())
}

fn strips(read: &Read, entity: &str) -> Vec<Vec<Point3<f64>>> {
    let strips = read.fixed::<LineStrip3D>(entity, &LineStrips3D::descriptor_strips());
    let point = |p: &re_sdk_types::datatypes::Vec3D| {
        Point3::new(f64::from(p.x()), f64::from(p.y()), f64::from(p.z()))
    };
    strips.iter().map(|s| s.0.iter().map(point).collect()).collect()
}

#[test]
fn everything_that_was_asked_for_is_there() {
    let entities = read(&scene_parts()).entities();
    for entity in [
        "/workpiece",
        "/arm/after/link1/link2/link3/link4/link5/link6/flange/tool",
        "/arm/before/link1/link2/link3/link4/link5/link6/flange/tool",
        "/arm/nominal/foot",
        "/arm/exaggerated/foot",
        "/arm/exaggerated/link1/link2/link3/link4/link5/link6/flange/tool",
        "/path/intended",
        "/path/travel",
        "/path/before",
        "/path/after/ltlm",
        "/exaggerated/before",
        "/exaggerated/after/ltlm",
        "/tool_axes",
        "/deviation/normal/before",
        "/deviation/normal/after/ltlm",
        "/deviation/normal/sigma_above",
        "/deviation/normal/sigma_below",
        "/deviation/size/before",
        "/deviation/size/after/ltlm",
        "/deviation/angle/before",
        "/joints/change/6",
        "/summary",
        "/legend/bar",
    ] {
        assert!(entities.contains(entity), "{entity} not among {entities:?}");
    }
}

#[test]
fn the_page_names_views_with_their_units() {
    let views = read(&scene_parts()).views();
    let named =
        |class: &str| views.iter().filter(|(c, _)| c == class).map(|(_, n)| n.as_str()).collect::<Vec<_>>();
    assert_eq!(named("TextDocument"), ["Summary"]);
    // Two of the arm, the deviation, its size before: a remainder has no picture of its size.
    assert_eq!(named("3D").len(), 4, "{views:?}");
    assert!(named("3D").iter().all(|n| n.contains("[mm]")), "{views:?}");
    assert_eq!(named("TimeSeries").len(), 4);
    assert!(named("TimeSeries").iter().all(|n| n.contains("[mm]") || n.contains("[°]")), "{views:?}");
}

/// One time axis, one row for each point, and no clock.
#[test]
fn time_counts_points() {
    let parts = scene_parts();
    let read = read(&parts);
    assert_eq!(read.axes().keys().collect::<Vec<_>>(), [AXIS]);
    let rows = read.values::<Translation3D>("/arm/after/link1", &Transform3D::descriptor_translation());
    let times: Vec<Option<i64>> = rows.iter().map(|(t, _)| *t).collect();
    assert_eq!(times, (0..60).map(Some).collect::<Vec<_>>());
}

/// Link after link, the drawn frames multiply to where the model puts the tool.
#[test]
fn links_move_joint_by_joint_to_where_the_model_is() {
    let parts = scene_parts();
    let read = read(&parts);
    let arm = parts.actual.at_condition(&Condition::default());
    let tool =
        Pose::from_parts(Translation3::from(Vector3::from(FLANGE_FROM_TOOL)), UnitQuaternion::identity());
    type Which = fn(&PathPoint) -> Option<Joints>;
    for (root, which) in
        [("/arm/after", (|p| p.joints_after) as Which), ("/arm/before", (|p| p.joints_before) as Which)]
    {
        for point in parts.reports[0].points.iter().step_by(17) {
            let mut pose = Pose::identity();
            let mut path = root.to_owned();
            for part in ["link1", "link2", "link3", "link4", "link5", "link6", "flange", "tool"] {
                path = format!("{path}/{part}");
                // The last value that is not later: the tool is told only where it changes.
                let told = |rows: Vec<(Option<i64>, _)>| {
                    rows.into_iter().rfind(|(t, _)| t.is_none_or(|t| t <= point.index as i64)).unwrap().1
                };
                let t: Vec<Translation3D> = {
                    let rows = read.values(&path, &Transform3D::descriptor_translation());
                    rows.into_iter().rfind(|(t, _)| t.is_none_or(|t| t <= point.index as i64)).unwrap().1
                };
                let q: Vec<RotationQuat> = told(read.values(&path, &Transform3D::descriptor_quaternion()));
                let [x, y, z, w] = q[0].0.0.map(f64::from);
                pose *= Pose::from_parts(
                    Translation3::new(t[0].x().into(), t[0].y().into(), t[0].z().into()),
                    UnitQuaternion::from_quaternion(nalgebra::Quaternion::new(w, x, y, z)),
                );
            }
            let expected = arm.forward(&which(point).unwrap()) * tool;
            assert!(
                (pose.translation.vector - expected.translation.vector).norm() < 1e-3,
                "{root} {}",
                point.index
            );
            assert!(pose.rotation.angle_to(&expected.rotation) < 1e-5, "{root} {}", point.index);
        }
    }
}

/// The pose of the tool of an arm as it is drawn at a point, frame by frame.
fn drawn_tool(read: &Read, root: &str, index: usize) -> Pose {
    let mut pose = Pose::identity();
    let mut path = root.to_owned();
    for part in ["link1", "link2", "link3", "link4", "link5", "link6", "flange", "tool"] {
        path = format!("{path}/{part}");
        let rows = read.values::<Translation3D>(&path, &Transform3D::descriptor_translation());
        let t = rows.into_iter().rfind(|(t, _)| t.is_none_or(|t| t <= index as i64)).unwrap().1;
        let rows = read.values::<RotationQuat>(&path, &Transform3D::descriptor_quaternion());
        let q = rows.into_iter().rfind(|(t, _)| t.is_none_or(|t| t <= index as i64)).unwrap().1;
        let [x, y, z, w] = q[0].0.0.map(f64::from);
        pose *= Pose::from_parts(
            Translation3::new(t[0].x().into(), t[0].y().into(), t[0].z().into()),
            UnitQuaternion::from_quaternion(nalgebra::Quaternion::new(w, x, y, z)),
        );
    }
    pose
}

/// The ghost states where the controller believes the arm to be, on the intended path; the real arm beside it is off by the stated
/// factor times the real deviation, within a tenth.
#[test]
fn the_exaggerated_arm_stands_beside_the_ghost_of_the_nominal_one() {
    let parts = scene_parts();
    let read = read(&parts);
    let (_, name) = read.views().into_iter().find(|(_, n)| n.contains("ghost")).unwrap();
    let times: f64 = name.split('×').nth(1).unwrap().split([',', ' ']).next().unwrap().parse().unwrap();
    assert!(times >= 5.0, "{times}");
    for point in parts.reports[0].points.iter().step_by(13) {
        let ghost = drawn_tool(&read, "/arm/nominal", point.index);
        let place = ghost.translation.vector - point.intended.translation.vector;
        assert!(place.norm() < 1e-2, "{}: {place}", point.index);
        let real = drawn_tool(&read, "/arm/exaggerated", point.index);
        let off = real.translation.vector - ghost.translation.vector;
        let deviation = point.base_from_object.rotation * point.before.unwrap().vector_mm * times;
        assert!((off - deviation).norm() < 0.1 * deviation.norm(), "{}: {off} for {deviation}", point.index);
    }
}

/// A mesh takes the place of the bar of its link, in the frame that it moves with; links without one keep theirs.
#[test]
fn meshes_are_drawn_in_the_frames_that_they_move_with() {
    let parts = scene_parts();
    let pose = Pose::translation(1.0, 2.0, 3.0);
    let mesh = |frame| LinkMesh { frame, pose, triangles: parts.triangles.clone() };
    let meshes = [mesh(0), mesh(2)];
    let scene = PathScene {
        title: "meshes",
        arm: &parts.actual,
        nominal: &parts.nominal,
        meshes: &meshes,
        arm_is: "arm",
        condition: Condition::default(),
        reports: &parts.reports,
        workpiece: None,
    };
    let read = Read::of(&path_recording(&scene).unwrap().rrd().unwrap());
    let entities = read.entities();
    for root in ["/arm/after", "/arm/nominal", "/arm/exaggerated"] {
        for there in ["mesh1", "link1/joint", "link1/link2/mesh1", "link1/link2/link3/body"] {
            assert!(entities.contains(format!("{root}/{there}").as_str()), "{root}/{there}: {entities:?}");
        }
        for absent in ["foot", "link1/link2/body", "link1/link2/joint"] {
            assert!(!entities.contains(format!("{root}/{absent}").as_str()), "{root}/{absent}");
        }
    }
    let entity = "/arm/after/link1/link2/mesh1";
    let vertices =
        read.fixed::<re_sdk_types::components::Position3D>(entity, &Mesh3D::descriptor_vertex_positions());
    let first = Vector3::new(vertices[0].x(), vertices[0].y(), vertices[0].z()).cast::<f64>();
    assert!((first - (pose * parts.triangles.vertices_mm[0]).coords).norm() < 1e-3);
}

fn factor(read: &Read) -> f64 {
    let (_, name) = read.views().into_iter().find(|(_, n)| n.starts_with("Deviation ×")).unwrap();
    name.trim_start_matches("Deviation ×").split(' ').next().unwrap().parse().unwrap()
}

#[test]
fn coloured_paths_lie_where_the_tool_goes_in_the_colours_of_the_scale() {
    let parts = scene_parts();
    let read = read(&parts);
    let points = &parts.reports[0].points;
    let cut: Vec<&PathPoint> = points.iter().filter(|p| p.cutting).collect();
    let sizes = || cut.iter().flat_map(|p| [p.before.unwrap().norm_mm(), p.after.unwrap().norm_mm()]);
    let scale = Scale::over(sizes());
    for (entity, times, by_size) in
        [("/path/before", 1.0, true), ("/exaggerated/before", factor(&read), false)]
    {
        let drawn = strips(&read, entity);
        let colours = read.fixed::<Color>(entity, &LineStrips3D::descriptor_colors());
        assert_eq!(drawn.len(), colours.len());
        let distinct: std::collections::BTreeSet<u32> = colours.iter().map(|c| c.0.0).collect();
        // Exaggerated, before and after have colours of their own.
        if !by_size {
            assert_eq!(
                colours.iter().map(|c| c.to_array()).collect::<Vec<_>>(),
                [BEFORE].repeat(colours.len())
            );
            let after = read.fixed::<Color>("/exaggerated/after/ltlm", &LineStrips3D::descriptor_colors());
            assert!(after.iter().all(|c| c.to_array() == AFTER[0]), "{after:?}");
        }
        assert!(!by_size || distinct.len() >= 4, "{} colours", distinct.len());
        let place = |p: &PathPoint| {
            let d = p.base_from_object.rotation * p.before.unwrap().vector_mm * times;
            Point3::from(p.intended.translation.vector + d)
        };
        for (strip, colour) in drawn.iter().zip(&colours) {
            assert!(strip.len() >= 2);
            for corner in strip {
                assert!(cut.iter().any(|p| (place(p) - corner).norm() < 1e-3), "{entity}: {corner}");
            }
            if !by_size {
                continue;
            }
            // The colour of a piece is that of its second point.
            let end = cut.iter().find(|p| (place(p) - strip[1]).norm() < 1e-3).unwrap();
            assert_eq!(colour.to_array(), scale.of(end.before.unwrap().norm_mm()), "{entity}");
        }
        // Every piece between neighbouring cut points is drawn once.
        let pieces: usize = drawn.iter().map(|s| s.len() - 1).sum();
        let neighbours = points.windows(2).filter(|w| w[0].cutting && w[1].cutting).count();
        assert_eq!(pieces, neighbours, "{entity}");
    }
}

#[test]
fn the_part_stands_in_the_base() {
    let parts = scene_parts();
    let vertices = read(&parts)
        .fixed::<re_sdk_types::components::Position3D>("/workpiece", &Mesh3D::descriptor_vertex_positions());
    assert_eq!(vertices.len(), parts.triangles.vertices_mm.len());
    let first = parts.base_from_object * parts.triangles.vertices_mm[0];
    let drawn = Point3::new(vertices[0].x(), vertices[0].y(), vertices[0].z()).cast::<f64>();
    assert!((first - drawn).norm() < 1e-3);
}

#[test]
fn the_summary_has_the_block_of_table_8_and_says_what_after_is() {
    let parts = scene_parts();
    let text = read(&parts).summary();
    let block = parts.reports[0].block(|p| p.before).unwrap();
    for value in block.five_mm.iter().chain([&block.all.mean, &block.all.standard_deviation, &block.all.max])
    {
        assert!(text.contains(&format!("| {value:.3} |")), "{value:.3} not in\n{text}");
    }
    for needle in ["predicted remainder", "0.050 mm", "0.080 mm", "60 points", "simulated actual arm", "mm"] {
        assert!(text.contains(needle), "{needle} not in\n{text}");
    }
}

/// Labels stand beside the path, where no line runs behind them.
#[test]
fn a_label_stands_beside_the_path() {
    let parts = scene_parts();
    let cut: Vec<nalgebra::Point3<f64>> = parts.reports[0]
        .points
        .iter()
        .filter(|point| point.cutting)
        .map(|point| point.intended.translation.vector.into())
        .collect();
    let (low, high) = cut.iter().fold((cut[0], cut[0]), |(low, high), p| (low.inf(p), high.sup(p)));
    let (middle, radius) = (nalgebra::center(&low, &high), 0.5 * (high - low).norm());
    let read = read(&parts);
    let at = read.fixed::<re_sdk_types::components::Position3D>(
        "/exaggerated/largest/before/label",
        &Points3D::descriptor_positions(),
    );
    let place = nalgebra::Point3::from(at[0].0.0.map(f64::from));
    assert!((place - middle).norm() > 1.2 * radius, "{place} is above the path");
}

#[test]
fn marked_points_are_labelled_by_line_and_reason_once_for_each_run() {
    let mut parts = scene_parts();
    for index in 20..26 {
        parts.reports[0].points[index].status = MotionStatus::Flagged;
        parts.reports[0].points[index].reason = Some("joint 5 outside the measured region".to_owned());
    }
    let refused = &mut parts.reports[0].points[40];
    (refused.status, refused.reason) = (MotionStatus::Refused, Some("out of reach".to_owned()));
    (refused.joints_after, refused.after) = (None, None);
    let read = read(&parts);
    let labels = |name: &str| {
        let entity = format!("/marks/{name}/labels");
        read.fixed::<re_sdk_types::components::Text>(&entity, &Points3D::descriptor_labels())
            .iter()
            .map(|t| t.to_string())
            .collect::<Vec<_>>()
    };
    assert_eq!(labels("flagged"), ["lines 30–35 flagged: joint 5 outside the measured region"]);
    assert_eq!(labels("refused"), ["line 50 refused: out of reach"]);
    let text = read.summary();
    assert!(text.contains("6 × joint 5 outside the measured region"), "{text}");
    assert!(text.contains("6 flagged, 1 refused"), "{text}");
    // Where there are no joints the arm states still.
    let rows = read.values::<Translation3D>("/arm/after/link1", &Transform3D::descriptor_translation());
    assert_eq!(rows.len(), 59);
}

/// Absent figures leave no trace but a dash; figures that are no numbers are not drawn.
#[test]
fn what_is_not_known_is_not_drawn() {
    let mut parts = scene_parts();
    for point in &mut parts.reports[0].points {
        (point.joints_after, point.after, point.sigma_mm, point.normal) = (None, None, None, None);
        if let Some(before) = &mut point.before {
            before.normal_mm = None;
        }
    }
    parts.reports[0].held_out_mm = None;
    parts.reports[0].points[30].before.as_mut().unwrap().vector_mm.x = f64::NAN;
    let scene = PathScene {
        title: "a|b *c*",
        arm: &parts.actual,
        nominal: &parts.nominal,
        meshes: &[],
        arm_is: "estimated arm",
        condition: Condition::default(),
        reports: &parts.reports,
        workpiece: None,
    };
    let read = Read::of(&path_recording(&scene).unwrap().rrd().unwrap());
    let entities = read.entities();
    for absent in ["/workpiece", "/path/after/ltlm", "/arm/after/foot", "/deviation/size/sigma"] {
        assert!(!entities.contains(absent), "{absent}");
    }
    assert!(!entities.iter().any(|e| e.starts_with("/deviation/normal")), "{entities:?}");
    assert!(read.summary().contains("predicted 1σ – mm, held-out error – mm"), "{}", read.summary());
    for strip in strips(&read, "/path/before") {
        assert!(strip.iter().all(|p| p.iter().all(|c| c.is_finite())));
    }
}

#[test]
fn several_models_share_the_path_before() {
    let mut parts = scene_parts();
    let mut second = parts.reports[0].clone();
    second.model = "lm / fixed".to_owned();
    parts.reports.push(second);
    let mut third = parts.reports[0].clone();
    third.model = "lm / fixed".to_owned();
    for point in &mut third.points {
        point.before.as_mut().unwrap().vector_mm *= 1.5;
    }
    parts.reports.push(third);
    let entities = read(&parts).entities();
    for entity in
        ["/path/after/lm___fixed", "/path/after/lm___fixed_3", "/path/before", "/path/before_lm___fixed_3"]
    {
        assert!(entities.contains(entity), "{entity} not among {entities:?}");
    }
    assert!(!entities.contains("/path/before_lm___fixed"));
}

#[test]
fn nothing_to_draw_is_an_error() {
    let mut parts = scene_parts();
    parts.reports[0].points.clear();
    let mut scene = PathScene {
        title: "empty",
        arm: &parts.actual,
        nominal: &parts.nominal,
        meshes: &[],
        arm_is: "arm",
        condition: Condition::default(),
        reports: &parts.reports,
        workpiece: None,
    };
    assert!(matches!(path_recording(&scene), Err(VisualError::Empty(why)) if why.contains("no points")));
    scene.reports = &[];
    assert!(matches!(path_recording(&scene), Err(VisualError::Empty(why)) if why.contains("no path")));
}

#[test]
fn five_hundred_points_stay_small() {
    let parts = parts(500);
    let size = recording(&parts).rrd().unwrap().len();
    assert!(size < 2_000_000, "{size} bytes");
}
