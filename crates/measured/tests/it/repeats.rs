//! Poses that a real file repeats.

use truegrind_calibration::measurement::noise_floor::noise_floor;
use truegrind_calibration::measurement::repeated_poses::poses;
use truegrind_calibration::measurement::split;
use truegrind_measured::data_set;

/// The HSR file repeats some poses; its scatter is published as a noise floor near 0.07 mm mean.
#[test]
#[cfg_attr(not(measured_data), ignore = "TRUEGRIND_DATA names no folder of measured data")]
fn hsr_repeats_poses() {
    let data = data_set("HSR-RobotCali.xlsx", None);
    let floor = noise_floor(&data).unwrap();
    assert!(floor.poses >= 10, "{floor:?}");
    assert!((0.03..0.2).contains(&floor.sigma_mm), "{floor:?}");
    let leak = split::random(&data, 0.2, 1);
    for pose in poses(&data).iter().filter(|p| p.len() > 1) {
        assert!(pose.iter().all(|i| leak.test.contains(i)) || pose.iter().all(|i| leak.train.contains(i)));
    }
}
