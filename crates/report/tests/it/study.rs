//! Methods over splits.

use truegrind_calibration::identification::solver::{Solver, by_name};
use truegrind_calibration::identification::study::MethodRow;
use truegrind_estimation::estimate::Termination;
use truegrind_math::statistics::ErrorSummary;
use truegrind_report::format::terminal;
use truegrind_report::study as view;
use truegrind_report::table::Cell;

use super::examples::{dataset, leave};

fn row(solver: Option<&'static Solver>, rmse: &[f64], passes: f64, failed: usize) -> MethodRow {
    let count = if solver.is_some() { rmse.len() } else { 0 };
    MethodRow {
        solver,
        held_out: rmse
            .iter()
            .map(|&rmse| ErrorSummary {
                count: 24,
                rmse,
                mean_absolute: 0.8 * rmse,
                max: 2.5 * rmse,
                ..Default::default()
            })
            .collect(),
        terminations: (0..count)
            .map(|i| if i < failed { Termination::IterationLimit } else { Termination::Cost })
            .collect(),
        jacobian_passes: vec![passes; count],
    }
}

fn rows() -> Vec<MethodRow> {
    let named = |name| by_name(name).ok();
    vec![
        row(None, &[2.0, 2.2, 2.1], 0.0, 0),
        row(named("lm"), &[0.44, 0.48, 0.46], 9.0, 0),
        row(named("ltlm"), &[0.44002, 0.48, 0.46], 21.0, 0),
        row(named("lm-as-printed"), &[0.51, 0.58, 0.56], 200.0, 2),
    ]
}

#[test]
fn the_table_states_mean_and_deviation_over_splits() {
    let table = view::table(&rows());
    let text = terminal::table(&table, 200);
    let lines: Vec<&str> = text.lines().collect();
    assert_eq!(lines[0], "Held-out errors over 3 splits");
    assert_eq!(
        lines[3].trim_end(),
        "frames registered  2.100 ± 0.100  1.680 ± 0.080  5.250 ± 0.250                –  –"
    );
    assert_eq!(
        lines[4],
        "lm                 0.460 ± 0.020  0.368 ± 0.016  1.150 ± 0.050              9.0  3 of 3"
    );
    assert_eq!(
        lines[6],
        "lm-as-printed      0.550 ± 0.036  0.440 ± 0.029  1.375 ± 0.090            200.0  1 of 3"
    );
}

#[test]
fn notes_say_who_reached_the_same_optimum_and_what_a_literal_form_is() {
    let notes = view::table(&rows()).notes.join("\n");
    assert!(
        notes.contains("lm and ltlm reach the same optimum on every split (held-out RMSE within 2.0e-5 mm)"),
        "{notes}"
    );
    assert!(
        notes.contains("lm-as-printed as printed in the paper: fixed μ = 5, no scaling, no priors"),
        "{notes}"
    );
    // Without a literal form nothing is said of one, and two methods that differ are not said to agree.
    let mut others = rows();
    others.truncate(3);
    others[2].held_out[1].rmse = 0.49;
    let notes = view::table(&others).notes.join("\n");
    assert!(!notes.contains("μ = 5") && !notes.contains("same optimum"), "{notes}");
    // NaN is like nothing.
    others[2].held_out[1].rmse = f64::NAN;
    assert!(!view::table(&others).notes.join("\n").contains("same optimum"));
}

#[test]
fn one_split_has_no_deviation() {
    let single = vec![row(None, &[2.0], 0.0, 0), row(by_name("lm").ok(), &[0.5], 8.0, 0)];
    let table = view::table(&single);
    assert_eq!(table.rows[1][1], Cell::Number(0.5));
    let json = view::json(&single, "abb-irb-120", &dataset());
    assert_eq!(json["methods"][1]["held_out"]["rmse_mm"]["mean"], 0.5);
    assert!(json["methods"][1]["held_out"]["rmse_mm"]["standard_deviation"].is_null());
    assert!(json["methods"][0]["jacobian_passes"].is_null());
}

#[test]
fn the_page_names_the_best_method_and_who_did_not_converge() {
    let page = view::document(&rows(), "abb-irb-120", &dataset());
    let text = leave("study.html", &page);
    assert!(text.contains("lm has the smallest held-out error: 0.460\u{a0}mm RMSE"));
    assert!(text.contains("lm-as-printed did not converge on 2 of 3 splits"));
    assert_eq!(text.matches("<figure>").count(), 2);
    let json = view::json(&rows(), "abb-irb-120", &dataset());
    assert_eq!(json["schema"], "truegrind.study/1");
    assert!(json["methods"][0]["method"].is_null());
    assert_eq!(json["methods"][3]["literal"], true);
    assert_eq!(json["methods"][3]["converged"], 1);
    assert_eq!(json["methods"][2]["splits"][0]["rmse"], 0.44002);
}
