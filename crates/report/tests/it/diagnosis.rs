//! The answer of a diagnosis on one screen, and its page.

use std::sync::OnceLock;

use truegrind_arm::robots;
use truegrind_calibration::diagnosis::cause_kind::CauseKind;
use truegrind_calibration::diagnosis::diagnose::{Diagnosed, Options, diagnose};
use truegrind_calibration::diagnosis::finding::{Confidence, NoiseFloorSource, Session};
use truegrind_calibration::identification::start::candidate_frames;
use truegrind_calibration::measurement::dataset::Dataset;
use truegrind_calibration::measurement::import;
use truegrind_report::diagnosis as view;
use truegrind_report::document::Document;
use truegrind_report::format::terminal;

use super::examples::leave;

const TRACKER: &[u8] = include_bytes!("../../../../tests/data/irb120-tracker.csv");

/// What is found in the shipped rows of a tracker.
fn diagnosed() -> (&'static Diagnosed, &'static Dataset) {
    static FOUND: OnceLock<(Diagnosed, Dataset)> = OnceLock::new();
    let (found, dataset) = FOUND.get_or_init(|| {
        let arm = robots::load("abb-irb-120").unwrap().model;
        let dataset = import::read("irb120-tracker.csv", TRACKER, &import::Options::default()).unwrap();
        let frames = candidate_frames(&dataset, &arm).unwrap().remove(0);
        let found = diagnose(&dataset, "abb-irb-120", &arm, &frames, &Options::default(), &|_| ()).unwrap();
        (found, dataset)
    });
    (found, dataset)
}

fn on_a_terminal(page: &Document) -> String {
    terminal::document(page, 100)
}

#[test]
fn the_answer_fits_one_screen_and_says_what_to_do() {
    let (found, _) = diagnosed();
    let text = on_a_terminal(&view::summary(found));
    assert!(text.lines().count() <= 40, "{}\n{text}", text.lines().count());
    for word in [
        "[found] 4 causes identified",
        "explains",
        "What to do",
        "1 and 3: compensate",
        "[ok] The model may be used",
    ] {
        assert!(text.contains(word), "{word}:\n{text}");
    }
    assert!(!text.contains("held out without"), "statistics are behind a fold:\n{text}");
}

/// Every finding has its number, its sentence and an action; findings with one action share a line.
#[test]
fn every_finding_has_an_action() {
    let (found, _) = diagnosed();
    let text = on_a_terminal(&view::summary(found)).replace('\n', " ");
    let (_, actions) = text.split_once("What to do").unwrap();
    for (k, finding) in found.diagnosis.findings.iter().enumerate() {
        let action = finding.decided_by.as_ref().unwrap_or(&finding.remedy);
        let words: Vec<&str> = action.split_whitespace().collect();
        let actions = actions.split_whitespace().collect::<Vec<_>>().join(" ");
        assert!(actions.contains(&words.join(" ")), "{}: {action}\n{actions}", k + 1);
    }
}

/// A cause that cannot be told apart is titled by the likeliest of them, whichever was accepted first.
#[test]
fn an_ambiguous_finding_is_titled_by_its_likeliest_member() {
    let (found, dataset) = diagnosed();
    let mut found = found.clone();
    let finding = &mut found.diagnosis.findings[0];
    finding.confidence = Confidence::Ambiguous;
    finding.members = serde_json::from_value(serde_json::json!([
        {"effect": "gear-transmission", "joints": [1], "rows": null, "family": "drive", "share": 0.98},
        {"effect": "joint-compliance", "joints": [2], "rows": null, "family": "arm", "share": 0.02},
    ]))
    .unwrap();
    let text = on_a_terminal(&view::summary(&found));
    let one_line = text.split_whitespace().collect::<Vec<_>>().join(" ");
    assert!(one_line.contains("An error in the drive (98 %) or the arm (2 %)"), "{one_line}");
    let page = on_a_terminal(&view::document(&found, dataset));
    assert!(page.contains("1. Gear transmission, joint 1"), "{page}");
}

/// Two joints whose zero moved in the same rows are two causes.
#[test]
fn a_cause_with_rows_names_its_joint() {
    let (found, dataset) = diagnosed();
    let mut found = found.clone();
    let finding = &mut found.diagnosis.findings[0];
    finding.confidence = Confidence::Ambiguous;
    finding.members = serde_json::from_value(serde_json::json!([
        {"effect": "joint-zero-shift", "joints": [3], "rows": [0, 20], "family": "drive", "share": 0.6},
        {"effect": "joint-zero-shift", "joints": [5], "rows": [0, 20], "family": "drive", "share": 0.4},
    ]))
    .unwrap();
    let text = on_a_terminal(&view::summary(&found)).split_whitespace().collect::<Vec<_>>().join(" ");
    for words in ["joint zero shift of joint 3 in rows", "joint zero shift of joint 5 in rows"] {
        assert!(text.contains(words), "{words}: {text}");
    }
    let page = on_a_terminal(&view::document(&found, dataset));
    assert!(page.contains("1. Joint zero shift, joint 3, rows"), "{page}");
}

/// The terminal says why a cause is not certain, its nearest rival, and that programs are not corrected for it.
#[test]
fn a_doubt_is_told_with_the_nearest_rival_and_what_becomes_of_programs() {
    let (found, _) = diagnosed();
    let mut found = found.clone();
    let finding = &mut found.diagnosis.findings[0];
    finding.confidence = Confidence::Ambiguous;
    finding.doubts = vec!["it is found in 1 of 6 halves of the rows".to_owned()];
    finding.decided_by = Some("measure it again".to_owned());
    finding.alternatives = serde_json::from_value(serde_json::json!([
        {"effect": "base-tilt", "joints": null, "rows": null, "family": "set-up", "cv_rmse_mm": 0.05, "beaten_by": 14.8},
    ]))
    .unwrap();
    for (corrected, words) in [
        (Some(false), "the written model leaves it out; to decide, measure it again"),
        (
            Some(true),
            "programs are corrected for it, since only its place is uncertain; to decide, measure it again",
        ),
    ] {
        found.diagnosis.findings[0].corrected = corrected;
        let text = on_a_terminal(&view::summary(&found)).split_whitespace().collect::<Vec<_>>().join(" ");
        let whole = format!(
            "1: not certain: it is found in 1 of 6 halves of the rows (nearest rival: base tilt); {words}"
        );
        assert!(text.contains(&whole), "{text}");
        assert!(text.contains("ambiguous: there is such an error"), "{text}");
    }
}

/// What is cut short is a list of parts, and not a sentence that happens to have a semicolon.
#[test]
fn a_finding_of_several_terms_is_titled_by_the_first() {
    let (found, _) = diagnosed();
    let mut found = found.clone();
    let finding = &mut found.diagnosis.findings[0];
    finding.cause = "joint 3 slips; it was seen twice".to_owned();
    finding.terms.clear();
    let one = on_a_terminal(&view::summary(&found)).split_whitespace().collect::<Vec<_>>().join(" ");
    assert!(one.contains("Joint 3 slips; it was seen twice"), "{one}");
    found.diagnosis.findings[0].terms = vec!["joint 3 slips".to_owned(), "it was seen twice".to_owned()];
    let several = on_a_terminal(&view::summary(&found)).split_whitespace().collect::<Vec<_>>().join(" ");
    assert!(several.contains("Joint 3 slips; with 1 further term"), "{several}");
}

/// The table of sessions has the rows in a column of their own.
#[test]
fn a_session_says_what_shifted() {
    let (found, dataset) = diagnosed();
    let mut found = found.clone();
    found.diagnosis.findings[0].sessions = vec![Session {
        rows: [80, 99],
        effect: CauseKind::SensorZeroShift,
        cause: "the cable's zero jumped by 1.200 mm in rows 80 to 99".to_owned(),
        shift: Some("the cable's zero jumped by 1.200 mm".to_owned()),
        worth_mm: 0.3,
    }];
    let page = on_a_terminal(&view::document(&found, dataset));
    assert!(page.contains("the cable's zero jumped by 1.200 mm"), "{page}");
    assert!(!page.contains("in rows 80 to 99"), "{page}");
}

/// The source of a noise floor is a sentence in files, and is read from it.
#[test]
fn a_source_of_the_noise_floor_survives_a_file() {
    for source in [
        NoiseFloorSource::Repeats { poses: 20, freedom: 40 },
        NoiseFloorSource::RoundingAlone,
        NoiseFloorSource::Unknown,
    ] {
        let text = serde_json::to_string(&source).unwrap();
        assert_eq!(text, format!("\"{source}\""));
        assert_eq!(serde_json::from_str::<NoiseFloorSource>(&text).unwrap(), source);
    }
    assert!(serde_json::from_str::<NoiseFloorSource>("\"a guess\"").is_err());
}

#[test]
fn the_page_folds_statistics_and_opens_with_the_answer() {
    let (found, dataset) = diagnosed();
    let html = leave("diagnosis.html", &view::document(found, dataset));
    let at = |text: &str| html.find(text).unwrap_or_else(|| panic!("{text}"));
    assert!(at("What to do") < at("Errors by stage"));
    assert!(at("<details>") < at("Errors by stage"));
    assert_eq!(html.matches("<summary>Statistics</summary>").count(), found.diagnosis.findings.len());
}

/// An error far above the noise floor is no success, whether or not a cause was found.
#[test]
fn a_remainder_far_above_the_noise_floor_is_a_warning() {
    let (found, dataset) = diagnosed();
    let mut found = found.clone();
    let mut summary = |error_mm: f64, floor_mm: f64, source: NoiseFloorSource| {
        let diagnosis = &mut found.diagnosis;
        diagnosis.findings.clear();
        diagnosis.fits.geometric.cv_rmse_mm = error_mm;
        diagnosis.fits.extended.cv_rmse_mm = error_mm;
        diagnosis.fits.extended.rmse_mm = 0.95 * error_mm;
        diagnosis.noise_floor_mm = Some(floor_mm);
        diagnosis.noise_floor_source = source;
        let text = on_a_terminal(&view::document(&found, dataset));
        (text.split_whitespace().collect::<Vec<_>>().join(" "), found.diagnosis.is_partly_unexplained())
    };
    let rounding = NoiseFloorSource::RoundingAlone;
    let (text, flagged) = summary(1.045, 0.004, rounding);
    assert!(flagged && text.contains("[warning] No cause beyond geometry was found"), "{text}");
    assert!(text.contains("is 261 times the noise floor (0.004 mm, which is that of rounding"), "{text}");
    assert!(text.contains("one target in one nest") && text.contains("several times"), "{text}");
    assert!(text.contains("that all rows are of one arm") && text.contains("those of its reading"), "{text}");
    // Angles of four decimals round to a tenth of a micrometre, of which no ratio is told.
    let (text, flagged) = summary(1.93, 0.0004, rounding);
    assert!(flagged && text.contains("(1.930 mm) is far above the noise floor"), "{text}");
    assert!(!text.contains("times the noise floor"), "{text}");
    // Rounding says nothing of the sensor, whose usual noise explains this.
    let (text, flagged) = summary(0.03, 0.004, rounding);
    assert!(!flagged && text.contains("[ok] No cause beyond geometry was found"), "{text}");
    let repeated = NoiseFloorSource::Repeats { poses: 20, freedom: 40 };
    let (text, flagged) = summary(0.1, 0.02, repeated);
    assert!(flagged && text.contains("is 5 times the noise floor (0.020 mm)"), "{text}");
    let (text, flagged) = summary(0.05, 0.02, repeated);
    assert!(!flagged && text.contains("[ok]"), "{text}");
}

/// What the rounding of the log makes is no noise of the sensor: the headline says so, or leaves it out where it shows no digit.
#[test]
fn the_headline_says_what_the_noise_floor_is_of() {
    let mut found = diagnosed().0.clone();
    let mut headline = |floor_mm: f64, source: NoiseFloorSource| {
        found.diagnosis.noise_floor_mm = Some(floor_mm);
        found.diagnosis.noise_floor_source = source;
        let text = on_a_terminal(&view::summary(&found));
        let text = text.split_whitespace().collect::<Vec<_>>().join(" ");
        text.split_once("explains [mm]").map_or(text.clone(), |(head, _)| head.to_owned())
    };
    let rounding = NoiseFloorSource::RoundingAlone;
    let fine = headline(0.0002, rounding);
    assert!(fine.contains("the noise floor is unknown, since too few poses were repeated"), "{fine}");
    assert!(!fine.contains("0.000 mm"), "{fine}");
    let coarse = headline(0.012, rounding);
    assert!(
        coarse.contains("rounding of the logged angles: 0.012 mm; the noise of the sensor is unknown"),
        "{coarse}"
    );
    let measured = headline(0.012, NoiseFloorSource::Repeats { poses: 20, freedom: 40 });
    assert!(measured.contains("noise floor 0.012 mm"), "{measured}");
}
