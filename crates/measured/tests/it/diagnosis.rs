//! Diagnoses of real arms: never worse than geometry on held-out rows.

use truegrind_arm::robots;
use truegrind_calibration::diagnosis::diagnose::{Diagnosed, Options, diagnose};
use truegrind_calibration::identification::start::candidate_frames;
use truegrind_measured::data_set;

fn diagnosed(file: &str, robot: &str, options: &Options) -> Diagnosed {
    let dataset = data_set(file, None);
    let nominal = robots::load(robot).unwrap().model;
    let frames = candidate_frames(&dataset, &nominal).unwrap().remove(0);
    diagnose(&dataset, robot, &nominal, &frames, options, &|_| {}).unwrap()
}

#[test]
#[cfg_attr(not(measured_data), ignore = "TRUEGRIND_DATA names no folder of measured data")]
fn the_wire_of_the_irb_120_jumped_and_the_held_out_error_halves() {
    let found = diagnosed("RobotCali.xlsx", "abb-irb-120", &Options::default());
    let fits = &found.diagnosis.fits;
    // A dense Gauss–Newton reference with the same priors has 0.36 mm with sharpened angles.
    assert!(fits.geometric.cv_rmse_mm < 0.36, "{}", fits.geometric.cv_rmse_mm);
    assert!(fits.extended.cv_rmse_mm < 0.8 * fits.geometric.cv_rmse_mm, "{}", fits.extended.cv_rmse_mm);
    assert!(fits.extended.cv_blocks_rmse_mm <= fits.geometric.cv_blocks_rmse_mm);
    let names: Vec<&str> = found.diagnosis.findings.iter().map(|f| f.effect.as_str()).collect();
    assert!(names.contains(&"sensor-zero-shift") && names.contains(&"angle-rounding"), "{names:?}");
}

#[test]
#[cfg_attr(not(measured_data), ignore = "TRUEGRIND_DATA names no folder of measured data")]
fn the_findings_of_the_ur5_are_few_and_each_contributes() {
    let found = diagnosed("ur5-jacobi/grid.csv", "universal-robots-ur5", &Options::default());
    let findings = &found.diagnosis.findings;
    let effects: Vec<&str> = findings.iter().map(|f| f.effect.as_str()).collect();
    assert!(findings.len() <= 10, "{effects:?}");
    // Backlash of several joints is one finding with all of them, and still moves programs.
    let backlash = findings.iter().find(|f| f.effect == "backlash").unwrap();
    let joints = backlash.joints.as_ref().unwrap();
    assert!(joints.len() > 1 && backlash.parameters.len() >= joints.len(), "{backlash:?}");
    let acting = found.estimated.model.effects.iter().filter(|e| e.name() == "backlash" && !e.is_zero());
    assert_eq!(acting.count(), joints.len());
    let held_out = found.diagnosis.fits.extended;
    assert!(held_out.cv_rmse_mm < 0.0485 && held_out.cv_blocks_rmse_mm < 0.0544, "{held_out:?}");
}
