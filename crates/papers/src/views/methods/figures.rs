//! Plots of methods over cases: the papers' bars of errors and times, errors row by row, convergence.

use crate::experiment::Treatment;
use crate::protocol::{MethodResult, Study};
use crate::views::named_causes;
use crate::views::study::{held_out, registered, seconds};
use truegrind_report::number::Precision;
use truegrind_report::plot::{Axis, BarGroup, Bars, Graph, Ink, Reference, Series, distinguishable};
use truegrind_report::repeated;

/// A diverged method has no bar: it would dwarf all others.
pub(super) fn error_bars(study: &Study) -> String {
    let mut names = names(study);
    let mut errors: Vec<_> = study.results.iter().map(held_out).collect();
    // The start, and the diagnosis, as in the table.
    names.insert(0, "BC".to_owned());
    errors.insert(0, Some(registered(study)));
    if let Some(cases) = &study.named_causes {
        names.push(named_causes::LABEL.0.to_owned());
        errors.push(
            named_causes::complete(cases).map(|found| found.iter().map(|case| case.held_out).collect()),
        );
    }
    repeated::bars(names, &errors, None)
}

pub(super) fn time_bars(study: &Study) -> String {
    Bars {
        title: "Time of one case".to_owned(),
        y: Axis::log("time", "ms"),
        names: names(study),
        groups: vec![BarGroup::new("", study.results.iter().map(|r| Some(1e3 * seconds(r))))],
        labels: Some(Precision::Significant(2)),
    }
    .svg()
}

/// Most methods in one plot of rows: more lines cannot be distinguished.
const PANEL: usize = 4;

/// Figure 7 of the papers: the held-out rows of the first case, each plot with the start and a few methods, and a note on
/// the methods that are not drawn in it.
pub(super) fn rows(study: &Study) -> Vec<(String, String)> {
    [Treatment::Printed, Treatment::Sound]
        .into_iter()
        .flat_map(|treatment| rows_of(study, treatment))
        .collect()
}

fn rows_of(study: &Study, treatment: Treatment) -> Vec<(String, String)> {
    let registered = study.cases.first().map_or(&[][..], |c| c.registered_errors_mm.as_slice());
    let results = study.results.iter().filter(|r| r.treatment == treatment && !diverged(r));
    let lines =
        results.filter_map(|r| Some(Series::line(&r.method.id, numbered(&r.outcomes.first()?.errors_mm))));
    let start = Series::line("BC", numbered(registered)).ink(Ink::Text);
    let (mut drawn, alike) = distinguishable(std::iter::once(start).chain(lines).collect(), |_| true);
    let start = drawn.remove(0);
    let pictures = drawn.chunks(PANEL).map(|panel| {
        let each = panel.iter().cloned().zip([Ink::Vermilion, Ink::Blue, Ink::Green, Ink::Purple]);
        let ids: Vec<&str> = panel.iter().map(|line| line.name.as_str()).collect();
        let picture = Graph {
            title: format!("Errors of the held-out rows, first case: {}", ids.join(", ")),
            x: Axis::new("held-out row", ""),
            y: Axis::new("error", "mm"),
            series: std::iter::once(start.clone()).chain(each.map(|(line, ink)| line.ink(ink))).collect(),
            references: vec![Reference::Horizontal(0.0, String::new())],
            ..Graph::default()
        };
        (picture.svg(), std::iter::once("BC").chain(ids).map(|id| running_as(id, &alike)).collect())
    });
    pictures.collect()
}

/// Note on methods that are not drawn because their curve is the same as this one.
fn running_as(id: &str, alike: &[(String, String)]) -> String {
    let names: Vec<&str> =
        alike.iter().filter(|(_, same)| same == id).map(|(name, _)| name.as_str()).collect();
    match names.as_slice() {
        [] => String::new(),
        [one] => format!(" {one} is not drawn: its curve is the same as {id}'s."),
        many => format!(" {} are not drawn: their curves are the same as {id}'s.", many.join(", ")),
    }
}

fn diverged(result: &MethodResult) -> bool {
    result.outcomes.iter().any(|o| o.diverged)
}

fn numbered(errors: &[f64]) -> Vec<[f64; 2]> {
    errors.iter().enumerate().map(|(i, e)| [i as f64 + 1.0, *e]).collect()
}

/// Figures 8 (ltlm-2024) and 6 (ukf-vslm-2023).
pub(super) fn curves(study: &Study, by_passes: bool) -> String {
    let series = study.results.iter().filter(|r| r.treatment == Treatment::Printed).filter_map(|result| {
        let outcome = result.outcomes.first()?;
        // A diverging curve is cut where it exceeds ten times the start.
        let highest = 10.0 * outcome.curve.first()?.rmse;
        let points: Vec<[f64; 2]> = outcome
            .curve
            .iter()
            .take_while(|c| c.rmse <= highest)
            .map(|c| if by_passes { [c.passes.max(1.0), c.rmse] } else { [c.iteration as f64 + 1.0, c.rmse] })
            .collect();
        // A curve that diverges at once is not drawn and not in the legend.
        (points.len() > 1).then(|| Series::line(result.method.id.clone(), points))
    });
    let x = if by_passes { "passes over the rows" } else { "iteration (1 is the start)" };
    Graph {
        title: format!("Convergence over {}, first case", if by_passes { "passes" } else { "iterations" }),
        x: Axis::log(x, ""),
        y: Axis::log("RMSE of the fit", "mm"),
        series: series.collect(),
        ..Graph::default()
    }
    .svg()
}

fn names(study: &Study) -> Vec<String> {
    study.results.iter().map(|r| r.method.id.clone()).collect()
}
