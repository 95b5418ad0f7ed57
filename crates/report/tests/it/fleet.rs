//! The table over arms.

use truegrind_calibration::diagnosis::cause_kind::CauseKind;
use truegrind_report::fleet::{Cause, Row, cause_table, document, json, ranks, summary, table};
use truegrind_report::format::{csv, markdown, terminal};

fn cause(effect: CauseKind, worth_mm: f64, identified: bool) -> Cause {
    Cause {
        effect,
        place: "joint 2".to_owned(),
        sentence: format!("{effect} of joint 2"),
        identified,
        worth_mm: Some(worth_mm),
        remedy: "tighten it".to_owned(),
    }
}

fn row(file: &str, nominal_mm: f64, extended_mm: f64, causes: Vec<Cause>) -> Row {
    Row {
        file: file.to_owned(),
        robot: Some("abb-irb-120".to_owned()),
        rows: 300,
        nominal_mm: Some(nominal_mm),
        geometric_mm: Some(extended_mm),
        extended_mm: Some(extended_mm),
        written_mm: Some(extended_mm),
        noise_floor_mm: None,
        causes,
        output: Some(format!("{file}.toml")),
        note: None,
        failed: false,
    }
}

/// First comes the arm of which most can be gained; one that could not be diagnosed has no place, and comes before all on the page.
#[test]
fn the_arm_with_most_to_gain_comes_first() {
    let rows = [
        row("quiet.csv", 0.4, 0.3, vec![]),
        Row::failed("lost.csv".to_owned(), "no column q1".to_owned()),
        row(
            "worn.csv",
            2.0,
            0.2,
            vec![cause(CauseKind::Backlash, 0.9, false), cause(CauseKind::JointCompliance, 0.5, true)],
        ),
        row("same.csv", 0.4, 0.3, vec![cause(CauseKind::Backlash, 0.1, true)]),
    ];
    assert_eq!(ranks(&rows), [Some(2), None, Some(1), Some(3)]);
    let text = csv::table(&table(&rows));
    let lines: Vec<&str> = text.lines().collect();
    assert!(lines[1].starts_with("2,quiet.csv,") && lines[3].starts_with("1,worn.csv,2 causes,"), "{text}");
    // What is certain comes before what is larger and not.
    assert!(lines[3].contains("joint-compliance,joint 2,0.5,"), "{text}");
    let page = markdown::document(&document(&rows));
    assert!(page.contains("Largest gain: worn.csv with 1.800 mm; 2 of 4 arms"), "{page}");
    assert!(page.find("lost.csv").unwrap() < page.find("quiet.csv").unwrap(), "{page}");
    let causes = csv::table(&cause_table(&rows));
    assert!(causes.contains("backlash,2,1,0.9,\"worn.csv, joint 2\""), "{causes}");
    // Two joints of one arm are one arm.
    let two = vec![cause(CauseKind::Backlash, 0.3, true), cause(CauseKind::Backlash, 0.2, true)];
    let causes = csv::table(&cause_table(&[row("both.csv", 1.0, 0.1, two)]));
    assert!(causes.contains("backlash,1,1,0.3,"), "{causes}");
    assert_eq!(json(&rows)["arms"][2]["rank"], 1);
    assert!(terminal::document(&summary(&rows), 120).contains("no column q1"));
}

/// What the links of the table lead to is the written model: causes that are not certain are not in it, and gain nothing.
#[test]
fn the_gain_is_that_of_the_written_model() {
    let mut doubted = row("doubted.csv", 1.0, 0.1, vec![cause(CauseKind::JointCompliance, 0.5, false)]);
    doubted.written_mm = Some(0.8);
    let rows = [doubted, row("sure.csv", 0.9, 0.2, vec![cause(CauseKind::Backlash, 0.4, true)])];
    assert_eq!(ranks(&rows), [Some(2), Some(1)]);
    let text = terminal::document(&summary(&rows), 200);
    assert!(text.contains("Largest gain: sure.csv with 0.700 mm"), "{text}");
    // Behind the sentence on a failed file "there" would be that file.
    assert!(text.contains("sure.csv: what to do: tighten it"), "{text}");
    assert_eq!(json(&rows)["arms"][0]["written_mm"], 0.8);
}
