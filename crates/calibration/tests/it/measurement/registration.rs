//! Registration against known truth: frames, touching points and outlets from nominal poses.

use nalgebra::{Point3, Vector3};
use truegrind_arm::condition::Condition;
use truegrind_calibration::measurement::dataset::{Dataset, Reading};
use truegrind_calibration::measurement::registration;
use truegrind_calibration::measurement::sensor::Rig;
use truegrind_calibration::measurement::simulation::Simulation;
use truegrind_math::se3::{Pose, difference, pose_from_vector};

use super::simulation::{CABLE, SIX, TRACKER, measure, random};

fn flanges(simulation: &Simulation) -> Vec<Pose> {
    let arm = simulation.nominal.at_condition(&Condition::default());
    simulation.rows.iter().map(|row| arm.forward(&row.joints)).collect()
}

fn positions(data: &Dataset) -> Vec<Vector3<f64>> {
    data.rows
        .iter()
        .map(|row| match &row.reading {
            Reading::Position(p) => *p,
            Reading::Pose(pose) => pose.translation.vector,
            Reading::Cable(_) => panic!("a cable has no position"),
        })
        .collect()
}

fn lengths(data: &Dataset) -> Vec<f64> {
    data.rows.iter().map(|row| if let Reading::Cable(l) = row.reading { l } else { panic!() }).collect()
}

#[test]
fn points_carry_a_tetrahedron_back() {
    let truth = pose_from_vector(&[120.0, -40.0, 900.0, 1.0, -2.0, 0.5]);
    let base: Vec<Vector3<f64>> =
        [[0.0; 3], [500.0, 0.0, 0.0], [0.0, 300.0, 0.0], [0.0, 0.0, 700.0]].map(Vector3::from).to_vec();
    let see = |p: &Vector3<f64>| truth.inverse_transform_point(&Point3::from(*p)).coords;
    let sensor: Vec<_> = base.iter().map(see).collect();
    let found = registration::points(&base, &sensor).unwrap();
    assert!(difference(&truth, &found.base_from_sensor).amax() < 1e-9 && found.rmse_mm < 1e-9);
    // Points in a plane still fix a proper rotation, points on a line do not.
    let found = registration::points(&base[..3], &sensor[..3]).unwrap();
    assert!(difference(&truth, &found.base_from_sensor).amax() < 1e-9);
    let line: Vec<_> = (0..5).map(|i| Vector3::new(f64::from(i), 2.0 * f64::from(i), 1.0)).collect();
    assert!(registration::points(&line, &line).is_none());
    assert!(registration::points(&base[..2], &sensor[..2]).is_none());
    let broken = vec![Vector3::new(f64::NAN, 0.0, 0.0); 4];
    assert!(registration::points(&base, &broken).is_none());
}

#[test]
fn target_point_is_found_far_off_the_flange() {
    let sensor = TRACKER.replace("[30, 10, 60]", "[250, -120, 310]");
    let (simulation, data) = measure(&random(40, &format!("{sensor}[noise]\nsigma_mm = 0.05\n")));
    let Rig::Position { base_from_sensor, reflector_mm } = simulation.rig else { panic!() };
    let found = registration::target_point(&flanges(&simulation), &positions(&data)).unwrap();
    assert!((found.target_mm - reflector_mm).norm() < 0.1, "{found:?}");
    assert!((found.base_from_sensor.translation.vector - base_from_sensor.translation.vector).norm() < 0.3);
    assert!((0.06..0.11).contains(&found.rmse_mm), "0.05 mm a coordinate: {}", found.rmse_mm);
}

#[test]
fn one_orientation_leaves_the_point_at_the_flange() {
    let frame = pose_from_vector(&[1000.0, 200.0, 300.0, 0.1, 0.9, -0.4]);
    let reflector = Point3::new(30.0, 10.0, 60.0);
    let spots = [[0.0; 3], [500.0, 0.0, 0.0], [0.0, 300.0, 0.0], [0.0, 0.0, 700.0], [100.0, 200.0, 50.0]];
    let flanges: Vec<Pose> =
        spots.iter().map(|p| pose_from_vector(&[p[0], p[1], p[2], 3.0, 0.0, 0.0])).collect();
    let seen: Vec<_> =
        flanges.iter().map(|f| frame.inverse_transform_point(&(f * reflector)).coords).collect();
    let found = registration::target_point(&flanges, &seen).unwrap();
    assert!(found.rmse_mm < 1e-6);
    assert!(found.target_mm.norm() < 100.0, "{}", found.target_mm);
}

#[test]
fn poses_find_both_frames() {
    let (simulation, data) =
        measure(&random(30, &format!("{SIX}[noise]\nsigma_mm = 0.02\nsigma_deg = 0.01\n")));
    let Rig::Pose { base_from_sensor, flange_from_target } = simulation.rig else { panic!() };
    let measured: Vec<Pose> =
        data.rows.iter().map(|r| if let Reading::Pose(p) = &r.reading { **p } else { panic!() }).collect();
    let found = registration::poses(&flanges(&simulation), &measured).unwrap();
    let [sensor, target] =
        [(base_from_sensor, found.base_from_sensor), (flange_from_target, found.flange_from_target)]
            .map(|(truth, found)| difference(&truth, &found));
    assert!(sensor.fixed_rows::<3>(0).norm() < 0.4 && sensor.fixed_rows::<3>(3).norm() < 2e-4, "{sensor}");
    assert!(target.fixed_rows::<3>(0).norm() < 0.4 && target.fixed_rows::<3>(3).norm() < 2e-4, "{target}");
    assert!(found.rmse_mm < 0.15 && found.rmse_rad < 4e-4, "{found:?}");
}

#[test]
fn cable_outlet_and_zero_from_any_side() {
    for outlet in ["[700, 0, 100]", "[0, -900, 500]", "[300, 200, 1500]"] {
        let sensor = CABLE.replace("[700, 0, 100]", outlet);
        let (simulation, data) = measure(&random(60, &format!("{sensor}[noise]\nsigma_mm = 0.02\n")));
        let Rig::Cable { outlets_mm, zeros_mm, hook_mm } = &simulation.rig else { panic!() };
        let hooks: Vec<_> =
            flanges(&simulation).iter().map(|f| (f * Point3::from(*hook_mm)).coords).collect();
        let found = registration::cable(&hooks, &lengths(&data)).unwrap();
        assert!((found.outlet_mm - outlets_mm[0]).norm() < 0.2, "{outlet}: {found:?}");
        assert!((found.zero_mm - zeros_mm[0]).abs() < 0.1, "{outlet}: {found:?}");
        assert!((0.01..0.03).contains(&found.rmse_mm) && found.rival.is_none(), "{outlet}: {found:?}");
    }
}

#[test]
fn a_plane_of_poses_cannot_tell_the_outlet_from_its_mirror_image() {
    let outlet = Vector3::new(300.0, -200.0, 400.0);
    let hooks: Vec<_> =
        (0..40).map(|i| Vector3::new(f64::from(i % 8) * 100.0, f64::from(i / 8) * 100.0, 0.0)).collect();
    let lengths: Vec<f64> = hooks.iter().map(|h| (h - outlet).norm()).collect();
    let found = registration::cable(&hooks, &lengths).unwrap();
    let (rival, _) = found.rival.unwrap();
    assert!(found.rmse_mm < 1e-3);
    assert!((found.outlet_mm.z + rival.z).abs() < 0.1 && (found.outlet_mm.z.abs() - 400.0).abs() < 0.1);
    assert!((found.outlet_mm - rival).xy().norm() < 0.1);
}
