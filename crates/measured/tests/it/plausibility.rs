//! Units of real files are not suspected, but where they should be.

use truegrind_calibration::measurement::convention::AngleConvention;
use truegrind_calibration::measurement::plausibility::plausibility;
use truegrind_measured::data_set;

#[test]
#[cfg_attr(not(measured_data), ignore = "TRUEGRIND_DATA names no folder of measured data")]
fn real_files() {
    let robot = |name: &str| truegrind_arm::robots::load(name).unwrap().model;
    let abb = data_set("RobotCali.xlsx", None);
    assert_eq!(plausibility(&abb, &robot("abb-irb-120"), AngleConvention::Logged), []);
    let ur5 = data_set("ur5-jacobi/grid.csv", None);
    assert_eq!(plausibility(&ur5, &robot("universal-robots-ur5"), AngleConvention::Logged), []);
    let ur10 = data_set("ur10-landgraf/series-a.csv", None);
    assert_eq!(plausibility(&ur10, &robot("universal-robots-ur10"), AngleConvention::Logged), []);
    let hsr = data_set("HSR-RobotCali.xlsx", None);
    // Its angles hold the offsets of the DH table already (ukf-vslm-2023, Table I): adding them again would still fit
    // to millimetres, since the outlet absorbs most of it.
    let jr680 = robot("hsr-jr680");
    let found = plausibility(&hsr, &jr680, AngleConvention::Logged);
    assert_eq!((found.len(), found[0].likely.convention), (1, AngleConvention::Dh));
    assert!(found[0].likely_error.rmse_mm < 0.2 && found[0].stated_error.rmse_mm > 4.0, "{}", found[0]);
    assert_eq!(plausibility(&hsr, &jr680, AngleConvention::Dh), []);
    // Another arm's data are nobody's unit error.
    assert_eq!(plausibility(&ur5, &robot("abb-irb-120"), AngleConvention::Logged), []);
}
