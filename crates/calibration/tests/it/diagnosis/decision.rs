//! Causes that cannot be told apart: their shares follow from the evidence, and a measurement that decides is named.

use truegrind_arm::robots;
use truegrind_calibration::diagnosis::decision::members;
use truegrind_calibration::diagnosis::diagnose::{Options, diagnose};
use truegrind_calibration::diagnosis::finding::{Confidence, Family, Finding};
use truegrind_calibration::measurement::dataset::Sensor;

use super::scenarios::frames;
use super::simulator::{Hidden, Log, Setup, run};

fn finding(rivals: &[(&str, Option<usize>, &str, f64)]) -> Finding {
    let alternatives: Vec<_> = rivals
        .iter()
        .map(|(effect, joint, family, beaten_by)| {
            serde_json::json!({
                "effect": effect, "joints": joint.map(|j| [j]), "rows": null, "family": family, "cv_rmse_mm": 0.05,
                "beaten_by": beaten_by,
            })
        })
        .collect();
    serde_json::from_value(serde_json::json!({
        "effect": "gear-ratio", "cause": "", "confidence": "ambiguous", "rows": null, "joints": [4], "parameters": [],
        "evidence": "", "p_value": 0.0, "non_centrality": 50.0, "gain": {"cv_rmse_before_mm": 0.06, "cv_rmse_after_mm": 0.05},
        "family": "drive", "alternatives": alternatives, "remedy": "",
    }))
    .unwrap()
}

#[test]
fn shares_are_bayes_factors_that_sum_to_one() {
    let three = [("gear-eccentricity", Some(4), "drive", 2.0), ("sensor-scale", None, "sensor", -1.0)];
    let found = members(&finding(&three));
    let names: Vec<&str> = found.iter().map(|m| m.effect.as_str()).collect();
    assert_eq!(names, ["sensor-scale", "gear-ratio", "gear-eccentricity"]);
    let total = 1.0 + (-1.0_f64).exp() + 0.5_f64.exp();
    for (member, weight) in found.iter().zip([0.5_f64.exp(), 1.0, (-1.0_f64).exp()]) {
        assert!((member.share - weight / total).abs() < 1e-12, "{member:?}");
    }
    assert_eq!(found[0].family, Family::Sensor);
    // One name in two variants is one member, the same name of another family is not.
    let twice = [("backlash", Some(2), "drive", 3.0), ("backlash", Some(2), "drive", 1.0)];
    assert_eq!(members(&finding(&twice)).len(), 2);
    let elsewhere = [("gear-ratio", Some(4), "log", 1.0)];
    assert_eq!(members(&finding(&elsewhere)).len(), 2);
    // A rival that is beaten is not listed, and a cause without rivals has no family to name.
    assert!(members(&finding(&[("backlash", Some(2), "drive", 30.0)])).is_empty());
    assert!(members(&finding(&[])).is_empty());
    // Beside smooth trends the best rival is at 1, and the other as far behind it as before.
    let mut beside = finding(&[("backlash", Some(2), "drive", 30.0), ("latency", None, "log", 32.0)]);
    beside.margin = Some(1.0);
    let (shares, total) = (members(&beside), 1.0 + (-0.5_f64).exp() + (-1.5_f64).exp());
    for (member, weight) in shares.iter().zip([1.0, (-0.5_f64).exp(), (-1.5_f64).exp()]) {
        assert!((member.share - weight / total).abs() < 1e-12, "{member:?}");
    }
    beside.margin = Some(40.0);
    assert!(members(&beside).is_empty(), "trends do not make a cause surer");
    // Evidence beyond the range of exp() is no division by zero.
    let far =
        members(&finding(&[("backlash", Some(2), "drive", -4000.0), ("latency", None, "log", -4001.0)]));
    assert_eq!(far.len(), 3, "the cause that the finding is named after stands among them");
    assert!((far.iter().map(|m| m.share).sum::<f64>() - 1.0).abs() < 1e-12);
}

/// In whole diagnoses: an uncertain cause has shares that sum to one or none, a sure one has none, and what is in doubt has a measurement
/// that decides.
#[test]
fn uncertain_findings_name_what_decides() {
    let arm = robots::load("abb-irb-120").unwrap().model;
    let (mut with_members, mut decided, mut left_out) = (0, 0, 0);
    let weak = [
        vec![Hidden::Frame { from: 50, to: 58, mm: [0.25, 0.1, 0.0] }],
        vec![Hidden::Tool { from: 40, to: 47, mm: [0.2, 0.1, 0.1] }],
        vec![Hidden::Gear { joint: 4, order: 1.0, peak_rad: 4e-4, phase: 0.4 }],
        vec![Hidden::Payload { from: 60, to: 75, kg: 4.0 }, Hidden::Compliance { joint: 2, peak_rad: 2e-4 }],
        vec![Hidden::Ratio { joint: 3, error: 3e-4 }],
        vec![Hidden::Warp { mm: 0.2 }],
        vec![Hidden::Warp { mm: 0.4 }, Hidden::Compliance { joint: 1, peak_rad: 3e-4 }],
        vec![Hidden::Drift { mm: [0.2, 0.1, 0.0], time_constant_h: 0.3 }],
    ];
    for (seed, hidden) in (0..2).flat_map(|seed| weak.iter().map(move |hidden| (seed, hidden))) {
        let setup = Setup {
            sensor: Sensor::Cable,
            rows: 120,
            sigma_mm: 0.04,
            dirty: false,
            seed,
            log: Log::default(),
        };
        let dataset = run(&arm, hidden, &setup).dataset;
        let start = frames(&dataset, &arm);
        let found = diagnose(&dataset, "abb-irb-120", &arm, &start, &Options::default(), &|_| {}).unwrap();
        for (number, finding) in (1..).zip(&found.diagnosis.findings) {
            // What the written arm has at size 0 is not corrected with it.
            let says = finding.remedy.contains("compensate with this model");
            assert!(!says || finding.corrected == Some(true), "{finding:?}");
            if finding.corrected == Some(false) {
                left_out += 1;
                assert!(finding.remedy.contains("the written model leaves it out"), "{finding:?}");
            }
            if finding.confidence == Confidence::Identified {
                assert!(finding.members.is_empty() && finding.decided_by.is_none(), "{finding:?}");
                continue;
            }
            if !finding.members.is_empty() {
                with_members += 1;
                assert!(finding.members.len() > 1);
                assert!((finding.members.iter().map(|m| m.share).sum::<f64>() - 1.0).abs() < 1e-12);
                assert!(finding.decided_by.is_some(), "{finding:?}");
            }
            if let Some(decision) = &finding.decided_by {
                decided += 1;
                let command = format!("--for DIAGNOSIS.json --finding {number} ");
                assert!(!decision.contains("truegrind plan") || decision.contains(&command), "{decision}");
                assert!(!decision.contains("truegrind plan") || decision.contains("--outlet "), "{decision}");
                let has_target = decision.contains(" --touched-point ");
                assert!(!decision.contains("truegrind plan") || has_target, "{decision}");
            }
        }
    }
    assert!(with_members > 0 && decided > 0 && left_out > 0, "{with_members} {decided} {left_out}");
}
