//! Frames of real sensors, the arms nominal.

use nalgebra::Vector3;
use truegrind_arm::condition::Condition;
use truegrind_calibration::measurement::dataset::{Dataset, Reading};
use truegrind_calibration::measurement::registration;
use truegrind_math::se3::Pose;
use truegrind_measured::data_set;

fn positions(data: &Dataset) -> Vec<Vector3<f64>> {
    let of = |reading: &Reading| if let Reading::Position(p) = reading { *p } else { panic!("no position") };
    data.rows.iter().map(|row| of(&row.reading)).collect()
}

fn lengths(data: &Dataset) -> Vec<f64> {
    let of = |reading: &Reading| if let Reading::Cable(l) = reading { *l } else { panic!("no length") };
    data.rows.iter().map(|row| of(&row.reading)).collect()
}

/// Frames alone on real arms: the figures that others' tools reach are 0.70 mm (UR5), 0.8 mm (UR10), 0.6 mm
/// (RobotCali, outlet only) and 6.2 mm (HSR, whose angles hold the DH offsets already).
#[test]
#[cfg_attr(not(measured_data), ignore = "TRUEGRIND_DATA names no folder of measured data")]
fn real_arms_with_frames_alone() {
    let arm = |name: &str| truegrind_arm::robots::load(name).unwrap().model;
    let poses = |name: &str, data: &Dataset| -> Vec<Pose> {
        let model = arm(name);
        let arm = model.at_condition(&Condition::default());
        data.rows.iter().map(|r| arm.forward(&r.joints)).collect()
    };
    let ur5 = data_set("ur5-jacobi/grid.csv", None);
    let found = registration::target_point(&poses("universal-robots-ur5", &ur5), &positions(&ur5)).unwrap();
    assert!(found.rmse_mm < 0.75, "{found:?}");
    let ur10 = data_set("ur10-landgraf/series-d.csv", None);
    let measured: Vec<Pose> =
        ur10.rows.iter().map(|r| if let Reading::Pose(p) = &r.reading { **p } else { panic!() }).collect();
    let found = registration::poses(&poses("universal-robots-ur10", &ur10), &measured).unwrap();
    assert!(found.rmse_mm < 0.9 && found.rmse_rad < 2e-3, "{found:?}");
    let abb = data_set("RobotCali.xlsx", None);
    let hooks: Vec<_> = poses("abb-irb-120", &abb).iter().map(|f| f.translation.vector).collect();
    let found = registration::cable(&hooks, &lengths(&abb)).unwrap();
    assert!(found.rmse_mm < 1.0, "{found:?}");
}
