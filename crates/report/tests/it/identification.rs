//! Tables, sentences, JSON and page of an identification.

use truegrind_arm::estimated::{EstimatedParameter, Judgement, Reason, ReasonKind, StageErrors};
use truegrind_arm::link::LinkModel;
use truegrind_arm::parameter::{LinkCoordinate, Parameter};
use truegrind_arm::sensor::Sensor;
use truegrind_calibration::identification::benefit::Benefit;
use truegrind_calibration::identification::beyond_noise::BeyondNoise;
use truegrind_calibration::identification::fit::Outlier;
use truegrind_calibration::identification::identifiability::Identifiability;
use truegrind_calibration::identification::identify::Identification;
use truegrind_calibration::identification::rounding::NotFused;
use truegrind_math::statistics::ErrorSummary;
use truegrind_report::format::{csv, markdown, terminal};
use truegrind_report::identification as view;
use truegrind_report::table::Cell;

use super::examples::{identification, leave};

fn parameter(name: &str, unit: &str, nominal: f64, value: f64, sigma: f64, prior: f64) -> EstimatedParameter {
    EstimatedParameter {
        name: name.to_owned(),
        unit: unit.to_owned(),
        nominal,
        value,
        sigma,
        prior_sigma: Some(prior),
        determined: (1.0 - (sigma / prior).powi(2)).clamp(0.0, 1.0),
    }
}

/// The identification of the examples with figures that a reader can check by hand.
fn by_hand() -> Identification {
    let mut found = identification().0.clone();
    found.parameters = vec![
        parameter("link1.a", "mm", 0.0, 0.25, 0.02, 1.0),
        parameter(
            "link2.alpha",
            "rad",
            -0.5_f64.to_radians(),
            0.25_f64.to_radians(),
            0.005_f64.to_radians(),
            0.3_f64.to_radians(),
        ),
        parameter("link6.alpha", "rad", 0.0, 0.0, 0.3_f64.to_radians(), 0.3_f64.to_radians()),
        parameter("effect1.1", "rad/(N m)", 0.0, 2.5e-6, 1e-7, 1e-4),
        parameter("target.x", "mm", 0.0, 12.5, 0.4, 50.0),
        parameter("sensor.rx", "rad", 0.0, 10.0_f64.to_radians(), 0.1_f64.to_radians(), 3.0),
        parameter("outlet2.z", "mm", 0.0, -100.0, 0.5, 2000.0),
    ];
    let summary = |count, rmse| ErrorSummary {
        count,
        rmse,
        mean_absolute: 0.8 * rmse,
        mean: -0.1 * rmse,
        standard_deviation: 0.9 * rmse,
        max: 2.0 * rmse,
    };
    found.estimated.registered = StageErrors { fitted: summary(96, 2.0), held_out: summary(24, 2.1) };
    found.estimated.calibrated = StageErrors { fitted: summary(96, 0.4), held_out: summary(24, 0.5) };
    found
}

fn text_of(cell: &Cell) -> &str {
    if let Cell::Text(text) = cell { text } else { panic!("{cell:?}") }
}

/// What moved between repetitions is no remark below `[ok]`.
#[test]
fn repeated_poses_that_show_more_than_noise_head_a_warning() {
    let mut found = by_hand();
    for status in [Judgement::NotEvaluated, Judgement::Pass] {
        found.estimated.verdict.status = status;
        found.estimated.verdict.reasons =
            vec![Reason::new(ReasonKind::MoreThanNoise, "they differ by 0.350 mm in one direction")];
        let text = terminal::document(&view::summary(&found), 300);
        assert!(text.contains("[warning] The model may be used"), "{text}");
        assert!(text.contains("by 0.350 mm in one direction"), "{text}");
        found.estimated.verdict.reasons.clear();
        assert!(terminal::document(&view::summary(&found), 300).contains("[ok] The model may be used"));
    }
}

/// A raster in one orientation: what holds at the target alone is said where the error is.
#[test]
fn a_target_that_the_poses_do_not_show_is_in_the_headline() {
    let mut found = by_hand();
    found.estimated.verdict.status = Judgement::NotEvaluated;
    found.estimated.verdict.reasons = vec![Reason::new(ReasonKind::TargetNotShown, "...")];
    let text = terminal::document(&view::summary(&found), 400);
    assert!(text.contains("frames alone; errors are those of the target"), "{text}");
}

#[test]
fn the_stage_table_keeps_registering_apart_and_leaves_raw_open() {
    let mut found = by_hand();
    let text = terminal::table(&view::stage_table(&found), 100);
    let expected = "\
Errors by stage
Stage              Rows      Count  RMSE [mm]  mean |e| [mm]  SD [mm]  max [mm]  signed mean [mm]
─────────────────  ────────  ─────  ─────────  ─────────────  ───────  ────────  ────────────────
raw                all           –          –              –        –         –                 –
frames registered  fitted       96      2.000          1.600    1.800     4.000            -0.200
frames registered  held out     24      2.100          1.680    1.890     4.200            -0.210
geometry           fitted       96      0.400          0.320    0.360     0.800            -0.040
geometry           held out     24      0.500          0.400    0.450     1.000            -0.050
";
    assert_eq!(&text[..expected.len()], expected);
    let notes = view::stage_table(&found).notes.join(" ");
    assert!(notes.contains("no sensor frame was stated"), "{notes}");
    assert!(notes.contains("the gain of the model is that from frames registered to geometry"), "{notes}");
    assert!(notes.contains("\"STD\""), "{notes}");
    // A stated frame gives the raw row; lengths of vectors have no signed mean.
    found.raw = Some(ErrorSummary::of([3.0, -4.0]));
    found.estimated.provenance.sensor = Sensor::Position;
    let table = view::stage_table(&found);
    assert_eq!(table.rows[0][2], Cell::Count(2));
    assert!(table.rows.iter().all(|row| row[7] == Cell::Missing));
    assert!(!table.notes.join(" ").contains("no sensor frame was stated"));
}

#[test]
fn parameters_are_shown_in_millimetres_and_degrees() {
    let found = by_hand();
    let table = view::parameter_table(&found);
    let text = terminal::table(&table, 140);
    let expected = "\
Estimated parameters
Parameter      Nominal    Estimated ± σ  Deviation  Unit        Tolerance  Determined [%]  Held by
───────────  ─────────  ───────────────  ─────────  ──────────  ─────────  ──────────────  ───────────────
link1.a              0    0.250 ± 0.020     0.2500  mm                1.0             100  data
link2.alpha  -0.500000  0.2500 ± 0.0050     0.7500  °                0.30             100  data
link6.alpha          0      0.00 ± 0.30     0.0000  °                0.30               0  ⚠\u{fe0e} held by prior
effect1.1            0      2.50 ± 0.10     2.5000  µrad/(N m)        100             100  data
";
    let trimmed =
        |text: &str| text.lines().take(7).map(|l| l.trim_end().replace('─', "")).collect::<Vec<_>>();
    assert_eq!(trimmed(&text), trimmed(expected), "{text}");
    // Far from the data sheet is said, whoever holds it there.
    let mut far = by_hand();
    far.parameters[0].value = 4.1;
    let text = csv::table(&view::parameter_table(&far));
    assert!(text.contains("\"data, 4.1 tolerances off\""), "{text}");
    assert_eq!(table.rows.len(), 4, "frames stand in a table of their own");
    let file = csv::table(&table);
    assert!(
        file.starts_with("name,nominal,value,sigma_value,deviation,unit")
            || file.starts_with("name,nominal,value,sigma,deviation,unit"),
        "{file}"
    );
}

#[test]
fn frames_stand_apart_and_are_said_not_to_be_the_tcp() {
    let table = view::frame_table(&by_hand());
    assert_eq!(table.rows.len(), 3);
    assert_eq!(text_of(&table.rows[0][1]), "measured point on the flange, not the TCP");
    assert_eq!(text_of(&table.rows[1][1]), "sensor frame in the robot base");
    let Cell::WithSigma { value, sigma } = table.rows[1][2] else { panic!("{:?}", table.rows[1]) };
    assert!((value - 10.0).abs() < 1e-12 && (sigma - 0.1).abs() < 1e-12);
    assert_eq!(text_of(&table.rows[1][3]), "°");
    assert_eq!(text_of(&table.rows[2][1]), "cable outlet in the robot base");
    assert!(table.notes.join(" ").contains("It is not the TCP"));
}

#[test]
fn combinations_are_sentences_in_mm_and_degrees() {
    let mut found = by_hand();
    let theta = Parameter::Link { joint: 0, coordinate: LinkCoordinate::Theta };
    let length = found
        .geometry
        .parameters
        .iter()
        .copied()
        .find(|p| matches!(p, Parameter::Link { joint: 0, coordinate: LinkCoordinate::D }))
        .unwrap();
    assert_eq!(found.geometry.model.links[0].model, LinkModel::Dh);
    found.identifiability = Some(Identifiability {
        parameters: 31,
        rank: 29,
        condition: f64::INFINITY,
        singular_values: (0..31).map(|k| if k < 29 { 1e4 / 2f64.powi(k) } else { 0.0 }).collect(),
        determined_condition: 1e6,
        observability: [0.1, 0.2, 0.3, 0.4, 0.5],
        combinations: vec![vec![(length, -0.5), (theta, 1.0)], vec![(length, 1.0)]],
        held_by_priors: 17,
    });
    let json = view::json(&found, identification().1);
    let told = &json["identifiability"];
    assert_eq!(told["sentences"][0], "link1.theta +0.30° together with link1.d −0.50 mm is not identifiable");
    assert_eq!(told["sentences"][1], "link1.d +1.0 mm is not identifiable");
    assert_eq!(told["combinations"][0][0]["parameter"], "link1.d");
    assert_eq!(told["combinations"][0][0]["share"], -0.5);
    assert!(told["condition"].is_null(), "infinity is no number of JSON");
    assert_eq!(told["determined_condition"], 1e6);
    assert_eq!(told["observability"]["o3"], 0.3);
    let text = terminal::document(&view::document(&found, identification().1), 120);
    assert!(
        text.contains("[warning] Rank 29 of 31: 2 combinations of parameters change no reading"),
        "{text}"
    );
    assert!(text.contains("O1") && text.contains('∞'));
}

#[test]
fn what_makes_up_for_an_unseen_link_is_named() {
    let (found, dataset) = identification();
    let json = view::json(found, dataset);
    let sentences: Vec<&str> = json["identifiability"]["sentences"]
        .as_array()
        .unwrap()
        .iter()
        .map(|s| s.as_str().unwrap())
        .collect();
    // A longer first link lifts everything, the outlet of the cable too; a longer last link takes the hook along; a turn of
    // the first joint turns the outlet about the base.
    let with = |name: &str| sentences.iter().find(|s| s.starts_with(name)).copied().unwrap_or_default();
    assert_eq!(
        with("link1.d"),
        "link1.d +1.0 mm together with outlet.z +1.0 mm is not identifiable",
        "{sentences:?}"
    );
    assert!(with("link6.d").contains("target.z −1.0 mm"), "{sentences:?}");
    assert!(with("link1.theta").contains("outlet.y"), "{sentences:?}");
    assert!(json["identifiability"]["observability"]["o1"].as_f64().unwrap() > 0.0);
}

#[test]
fn a_verdict_is_one_sentence_with_its_reasons() {
    let mut found = by_hand();
    let head = |found: &Identification| terminal::document(&view::summary(found), 300);
    found.estimated.verdict.reasons = vec!["because".into()];
    for (status, badge, sentence) in [
        (Judgement::Pass, "[ok]", "The model may be used; it meets the stated limits"),
        (Judgement::Fail, "[failed]", "The model must not be used"),
        (
            Judgement::NotEvaluated,
            "[ok]",
            "The model may be used; no limit of its error was stated (--limit-rmse, --limit-max)",
        ),
    ] {
        found.estimated.verdict.status = status;
        let text = head(&found);
        let line = format!(
            "{badge} {sentence}: held-out error 0.500 mm RMSE, 2.100 mm with registered frames alone"
        );
        assert!(text.contains(&line), "{text}");
        assert!(text.contains("  - because"));
    }
    // 1 − 0.5 / 2.1
    assert!(head(&found).contains("Gain of the model"));
    assert!(head(&found).contains("76 %"), "{}", head(&found));
}

#[test]
fn outliers_are_listed_by_the_rows_of_the_spreadsheet() {
    let (found, dataset) = identification();
    let mut found = found.clone();
    let mut dataset = dataset.clone();
    // Blank rows in the file: lines run ahead of the index, and rows are called by them.
    for row in &mut dataset.rows {
        row.line += 10;
        row.number = row.line as usize;
    }
    let outlier = |index, robust_sigmas, error_mm| Outlier { index, robust_sigmas, error_mm };
    found.outliers.rows = vec![outlier(3, 41.26, -2.4), outlier(0, 10.5, 0.6)];
    let table = view::outlier_table(&found, &dataset);
    let text = terminal::table(&table, 80);
    let lines: Vec<&str> = text.lines().collect();
    assert_eq!(lines[1], "Row  Error [mm]  Size [robust σ]");
    assert_eq!(lines[3], " 15       2.400             41.3");
    assert_eq!(lines[4], " 12       0.600             10.5");
    dataset.rows[3].extra_mut().session = Some("monday".to_owned());
    let text = terminal::table(&view::outlier_table(&found, &dataset), 80);
    assert!(text.contains("monday") && text.contains('–'), "{text}");
    let json = view::json(&found, &dataset);
    assert_eq!(json["outliers"]["rows"][0]["row"], 15);
    found.outliers.rows.clear();
    found.outliers.too_many = 30;
    let text = markdown::document(&view::document(&found, &dataset));
    assert!(text.contains("30 rows lie beyond 10 robust standard deviations"), "{text}");
}

#[test]
fn a_contradicting_read_out_is_a_warning() {
    let mut found = by_hand();
    found.readout_fusion = Err(NotFused::Mismatch { found_mm: 4.2, expected_mm: 0.6 });
    let text = terminal::document(&view::document(&found, identification().1), 200);
    assert!(
        text.contains("[warning] The Cartesian read-out was not used: it differs by 4.200 mm RMS"),
        "{text}"
    );
    assert_eq!(view::json(&found, identification().1)["sharpening"]["found_mm"], 4.2);
    found.readout_fusion = Err(NotFused::Nothing);
    let text = terminal::document(&view::document(&found, identification().1), 200);
    assert!(text.contains("Angles are used as logged"), "{text}");
}

#[test]
fn the_json_holds_everything_and_every_held_out_row() {
    let (found, dataset) = identification();
    let json = view::json(found, dataset);
    assert_eq!(json["schema"], "truegrind.identification/1");
    assert_eq!(json["dataset"]["rows"], 120);
    assert_eq!(json["dataset"]["sensor"], "cable");
    let rows = json["held_out"].as_array().unwrap();
    assert_eq!(rows.len(), found.held_out.len());
    assert_eq!(rows[0]["row"], found.held_out[0].0);
    assert_eq!(rows[0]["geometry_mm"], found.held_out[0].2);
    assert!(json["stages"]["raw"].is_null());
    assert_eq!(json["stages"]["geometry"]["held_out"]["rmse"], found.estimated.calibrated.held_out.rmse);
    let arm = json["parameters"].as_array().unwrap();
    let frames = json["frames"].as_array().unwrap();
    assert_eq!(arm.len(), 24);
    assert_eq!(arm.len() + frames.len(), found.parameters.len());
    assert!(frames.iter().all(|p| p["nominal"].is_null() && p["value"].is_number()));
    for (told, parameter) in arm.iter().zip(&found.parameters) {
        let factor = if parameter.unit == "rad" { 180.0 / std::f64::consts::PI } else { 1.0 };
        assert_eq!(told["unit"], if parameter.unit == "rad" { "deg" } else { "mm" });
        assert!((told["value"].as_f64().unwrap() - factor * parameter.value).abs() < 1e-9);
        assert!((told["sigma"].as_f64().unwrap() - factor * parameter.sigma).abs() < 1e-12);
        assert_eq!(told["held_by_prior"], parameter.determined < 0.5);
    }
    assert_eq!(json["method"]["costs_by_round"].as_array().unwrap().len(), found.geometry.rounds.len());
    assert_eq!(json["sharpening"]["used"], true);
}

#[test]
fn every_round_of_a_fit_keeps_its_story() {
    let (found, _) = identification();
    assert_eq!(found.geometry.rounds.len(), 3);
    assert_eq!(found.geometry.rounds.last().unwrap(), &found.geometry.estimate.trace);
    // The first round comes from nominal and does the work.
    let first = &found.geometry.rounds[0];
    assert!(first.len() > 2 && first[0].cost > 10.0 * first.last().unwrap().cost);
}

#[test]
fn the_page_is_whole() {
    let (found, dataset) = identification();
    let page = view::document(found, dataset);
    let text = leave("identification.html", &page);
    for heading in [
        "Parameters of the arm",
        "Sensor and measured point",
        "Identifiability",
        "Rows",
        "Convergence",
        "Provenance",
    ] {
        assert!(text.contains(&format!(">{heading}</h2>")), "no {heading}");
    }
    assert_eq!(text.matches("<figure>").count(), 5);
    assert!(text.contains(&found.estimated.provenance.sha256));
    assert!(!text.contains("NaN"));
    assert_eq!(text, leave("identification.html", &view::document(found, dataset)), "same input, same bytes");
}

/// What the readings still deviate may be the arm's: where no poses were repeated the figure is a range, in the table, on the page and in
/// the JSON.
#[test]
fn programs_after_is_a_range_where_the_noise_is_not_known() {
    let (found, dataset) = identification();
    let mut found = found.clone();
    let alone = Benefit { estimated_mm: 0.061, estimated_at_most_mm: 0.061, ..found.benefit.unwrap() };
    let mut text = |beyond: BeyondNoise| {
        found.benefit = Some(alone.with_unmodelled(beyond));
        let most_mm = view::json(&found, dataset)["benefit"]["estimated_at_most_mm"].as_f64().unwrap();
        let pages = [view::summary(&found), view::document(&found, dataset)];
        (pages.map(|page| terminal::document(&page, 100)), most_mm)
    };
    let (pages, most_mm) = text(BeyondNoise::AtMost(0.164));
    assert!(pages.iter().all(|page| page.contains("0.061 to 0.175 mm")), "{}", pages[0]);
    assert!((most_mm - 0.061_f64.hypot(0.164)).abs() < 1e-12, "{most_mm}");
    let (pages, _) = text(BeyondNoise::Between { least_mm: 0.06, most_mm: 0.164 });
    assert!(pages.iter().all(|page| page.contains("0.086 to 0.175 mm")), "{}", pages[0]);
    let (pages, most_mm) = text(BeyondNoise::Known(0.06));
    assert!(pages.iter().all(|page| !page.contains(" to 0.")), "{}", pages[0]);
    assert!((most_mm - 0.061_f64.hypot(0.06)).abs() < 1e-12, "{most_mm}");
}
