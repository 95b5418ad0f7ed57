//! Methods over cases: errors beside the paper's, verdict, cost, convergence, parameters, plots.

use serde_json::{Value, json};

use super::{caveats, words};
use crate::comparison::experiment::{PaperFigures, Treatment, Units};
use crate::comparison::parameters::ParameterTable;
use crate::comparison::protocol::{MethodResult, Outcome, Study};
use crate::comparison::verdict::Conclusion;
use crate::estimation::estimate::Termination;
use crate::kinematics::parameter::Parameter;
use crate::math::statistics::{ErrorSummary, mean_and_deviation};
use crate::measurement::dataset::Sensor;
use crate::report::document::{Block, Document, KeyFigure, Verdict};
use crate::report::number::Precision;
use crate::report::plot::{Axis, BarGroup, Bars, Graph, Mark, Reference, Series};
use crate::report::status::Status;
use crate::report::table::{Cell, Column, Table};

/// Terminal.
pub(super) fn summary(page: &mut Document, study: &Study) {
    head(page, study);
    page.push(errors(study));
    page.push(verdict_table(study));
    page.push(verdict(study));
    page.push(convergence(study));
    page.push(cost(study));
}

/// Page.
pub(super) fn page(page: &mut Document, study: &Study) {
    head(page, study);
    page.push(verdict(study));
    page.push(errors(study));
    page.heading(2, "Errors");
    page.figure(
        error_bars(study),
        "Held-out errors, mean over the cases; whiskers are one standard deviation over the cases. The mean of |e| is \
         what the papers call STD.",
    );
    page.figure(
        rows(study),
        "Errors of the held-out rows of the first case, by method. Rows are in the order of the file.",
    );
    page.heading(2, "Which differences are real");
    page.push(verdict_table(study));
    page.push(convergence(study));
    page.heading(2, "Convergence and cost");
    page.figure(
        curves(study, false),
        "Root mean square of the fit over the iterations, first case, methods as printed. An iteration of one method \
         costs something else than one of another.",
    );
    page.figure(
        curves(study, true),
        "The same over passes through the rows, those with derivatives counted once: what an engineer pays for.",
    );
    page.push(cost(study));
    page.push(times(study));
    page.figure(
        time_bars(study),
        "Seconds for one case, while other cases ran on other cores: not the same in every run.",
    );
    if !study.parameters.is_empty() {
        page.heading(2, "What was identified");
        page.paragraph(
            "First case. σ holds tolerances as prior, whatever the method did. Parameters that the data do not see are \
             marked: a number there is an accident of the method's path, and two methods that disagree on it do not \
             contradict each other.",
        );
        for table in &study.parameters {
            page.push(Block::Details {
                summary: format!("{} {}", table.id, table.name),
                blocks: vec![parameter_table(table).into()],
            });
        }
    }
}

fn head(page: &mut Document, study: &Study) {
    let mut notes = Vec::new();
    if study.reduced {
        notes.push(format!(
            "Reduced protocol: {} rows in place of {}. The paper's figures beside ours belong to the whole one.",
            study.rows, study.methods.protocol.rows
        ));
    }
    if study.simulated {
        notes.push(
            "Simulated rows: the paper's figures were measured on another arm and stand beside ours for the order of the \
             methods, not for their size."
                .to_owned(),
        );
    }
    notes.extend(caveats(&study.experiment));
    page.push(Block::List(notes));
    let best = study
        .results
        .iter()
        .filter(|r| !r.outcomes.iter().any(|o| o.diverged))
        .min_by(|a, b| over(a, |s| s.rmse).0.total_cmp(&over(b, |s| s.rmse).0));
    let registered = over_cases(&study.cases.iter().map(|c| c.registered).collect::<Vec<_>>(), |s| s.rmse);
    let mut figures = vec![];
    if let Some(best) = best {
        let (mean, deviation) = over(best, |s| s.rmse);
        figures.push(
            KeyFigure::new("Smallest held-out RMSE", Cell::with_sigma(mean, deviation), 3, "mm")
                .note(format!("{} {}", best.method.id, best.method.name)),
        );
    }
    figures.push(
        KeyFigure::new("Frames registered alone", registered.0, 3, "mm")
            .note("nominal links, the fair before"),
    );
    figures.push(
        KeyFigure::new("Noise floor", study.noise_floor_mm, 3, "mm")
            .note("repeated poses, else the rounding of angles"),
    );
    page.push(figures);
}

/// Mean and, for several cases, standard deviation of a figure over the cases.
fn over(result: &MethodResult, figure: fn(&ErrorSummary) -> f64) -> (f64, Option<f64>) {
    over_cases(&result.outcomes.iter().map(|o| o.held_out).collect::<Vec<_>>(), figure)
}

fn over_cases(errors: &[ErrorSummary], figure: fn(&ErrorSummary) -> f64) -> (f64, Option<f64>) {
    let values: Vec<f64> = errors.iter().map(figure).collect();
    let (mean, deviation) = mean_and_deviation(&values);
    (mean, (values.len() > 1).then_some(deviation))
}

pub(super) fn name_of(study: &Study, id: &str) -> String {
    let found = study.results.iter().find(|r| r.method.id == id);
    found.map_or_else(|| id.to_owned(), |r| format!("{id} ({})", r.method.name))
}

fn title(study: &Study, what: &str) -> String {
    let protocol = if study.reduced { "Reduced protocol: " } else { "" };
    let simulated = if study.simulated { ", simulated" } else { "" };
    format!("{protocol}{what}, {} cases of {} rows{simulated}", study.cases.len(), study.rows)
}

/// How the cases ended, in words.
fn ended(outcomes: &[Outcome]) -> String {
    let n = outcomes.len();
    let diverged = outcomes.iter().filter(|o| o.diverged).count();
    if diverged > 0 {
        return format!("diverged in {diverged} of {n}");
    }
    let converged = outcomes.iter().filter(|o| o.termination.is_converged()).count();
    if converged == n {
        return "converged".to_owned();
    }
    let mut kinds: Vec<Termination> = Vec::new();
    for outcome in outcomes {
        if !kinds.contains(&outcome.termination) {
            kinds.push(outcome.termination);
        }
    }
    match kinds.as_slice() {
        [one] => one.to_string(),
        _ => format!("converged in {converged} of {n}"),
    }
}

/// The name, and that the method diverged where it did.
fn named(result: &MethodResult) -> String {
    let diverged = result.outcomes.iter().filter(|o| o.diverged).count();
    match diverged {
        0 => result.method.name.clone(),
        n => format!("{}: diverged in {n} of {}", result.method.name, result.outcomes.len()),
    }
}

/// Mean ± deviation over the cases; of a method that diverged the size of the mean alone.
fn figure(result: &MethodResult, figure: fn(&ErrorSummary) -> f64) -> Cell {
    let (mean, deviation) = over(result, figure);
    if result.outcomes.iter().any(|o| o.diverged) {
        return Cell::Text(Precision::Significant(1).format(mean));
    }
    Cell::with_sigma(mean, deviation)
}

/// The papers' table, ours and theirs side by side.
fn errors(study: &Study) -> Table {
    let mut table = Table::new(
        title(study, "Held-out errors"),
        vec![
            Column::text("id", ""),
            Column::text("method", "Method"),
            Column::number("rmse_mm", "RMSE", "mm", 3),
            Column::number("paper_rmse_mm", "paper", "mm", 2),
            Column::number("mean_absolute_mm", "mean |e|", "mm", 3),
            Column::number("paper_mean_absolute_mm", "paper", "mm", 2),
            Column::number("max_mm", "max", "mm", 2),
            Column::number("paper_max_mm", "paper", "mm", 2),
        ],
    );
    let cell = |(mean, deviation): (f64, Option<f64>)| Cell::with_sigma(mean, deviation);
    let registered: Vec<ErrorSummary> = study.cases.iter().map(|c| c.registered).collect();
    let before = study.methods.before.unwrap_or_default();
    table.push([
        "BC".into(),
        "frames alone".into(),
        cell(over_cases(&registered, |s| s.rmse)),
        before.rmse_mm.into(),
        cell(over_cases(&registered, |s| s.mean_absolute)),
        before.mean_absolute_mm.into(),
        cell(over_cases(&registered, |s| s.max)),
        before.max_mm.into(),
    ]);
    for result in &study.results {
        let paper = result.method.paper.unwrap_or_default();
        table.push([
            result.method.id.as_str().into(),
            named(result).into(),
            figure(result, |s| s.rmse),
            paper.rmse_mm.into(),
            figure(result, |s| s.mean_absolute),
            paper.mean_absolute_mm.into(),
            figure(result, |s| s.max),
            paper.max_mm.into(),
        ]);
    }
    table.notes = vec![
        "± is the standard deviation over the cases. mean |e| is what the papers print as STD, SD or Mean (ltlm-2024 eq. \
         20, ukf-vslm-2023 eq. 28)."
            .to_owned(),
        "BC, before compensation: the paper's carries the cable's constant offset; ours has its frames registered, links \
         nominal."
            .to_owned(),
    ];
    if study.sensor != Sensor::Cable {
        table.notes.push("Errors are distances between positions.".to_owned());
    }
    if let Some(floor) = study.noise_floor_mm {
        let floor = Precision::Significant(2).format(floor);
        table.notes.push(format!("Noise floor {floor} mm: below it there is nothing left to explain."));
    }
    table
}

fn verdict_table(study: &Study) -> Table {
    let judgement = &study.judgement;
    let reference = &judgement.reference;
    let mut table = Table::new(
        title(study, &format!("Held-out RMSE against {reference}")),
        vec![
            Column::text("id", ""),
            Column::number("difference_mm", "difference", "mm", 4),
            Column::text("better_in", format!("{reference} better in")),
            Column::text("p_signed_rank", "p, signed rank"),
            Column::text("p_t", "p, corrected t"),
            Column::number("converged_difference_mm", "converged", "mm", 4),
            Column::text("conclusion", "Conclusion"),
        ],
    );
    for comparison in &judgement.comparisons {
        let test = &comparison.limited;
        table.push([
            comparison.id.as_str().into(),
            test.mean_mm.into(),
            format!("{} of {}", test.reference_better, judgement.cases).into(),
            words::p(test.signed_rank_holm).into(),
            words::p(test.resampled_holm).into(),
            comparison.converged.as_ref().map(|t| t.mean_mm).into(),
            words::conclusion(comparison, reference).into(),
        ]);
    }
    table.notes = vec![format!(
        "difference: method minus {reference}, positive where {reference} is better. p two-sided, after Holm's correction \
         over {} comparisons. converged: the same once both were run until they converged.",
        judgement.comparisons.len()
    )];
    table
}

fn verdict(study: &Study) -> Verdict {
    let comparisons = &study.judgement.comparisons;
    let real = comparisons
        .iter()
        .filter(|c| matches!(c.conclusion, Conclusion::ReferenceBetter | Conclusion::MethodBetter));
    let same = comparisons
        .iter()
        .filter(|c| matches!(&c.conclusion, Conclusion::SameOptimum { stopped, .. } if !stopped.is_empty()));
    let headline = format!(
        "Of {} methods compared with {}, {} differ significantly; {} share its optimum and differ only by where they were \
         stopped",
        comparisons.len(),
        name_of(study, &study.judgement.reference),
        real.count(),
        same.count()
    );
    Verdict::new(Status::Good, headline, words::sentences(study))
}

/// What each least-squares method finds when nothing stops it.
fn convergence(study: &Study) -> Table {
    let mut table = Table::new(
        title(study, "Stopped and converged"),
        vec![
            Column::text("id", ""),
            Column::number("rmse_mm", "RMSE as limited", "mm", 4),
            Column::number("iterations", "iterations", "", 1),
            Column::number("converged_rmse_mm", "converged", "mm", 4),
            Column::number("converged_iterations", "further steps", "", 1),
            Column::text("converged_ended", "Ended"),
        ],
    );
    for result in &study.results {
        let Some(converged) = &result.converged else { continue };
        let all: Vec<ErrorSummary> = converged.iter().map(|o| o.held_out).collect();
        table.push([
            result.method.id.as_str().into(),
            over(result, |s| s.rmse).0.into(),
            iterations(&result.outcomes).into(),
            over_cases(&all, |s| s.rmse).0.into(),
            iterations(converged).into(),
            ended(converged).into(),
        ]);
    }
    table.notes = vec![
        "Converged: continued on the same cost by steps that neither fixed damping nor a decaying step size slows. Both \
         leave stationary points where they are, so this is where the method itself would end, often thousands of its \
         iterations later along what the data hardly see."
            .to_owned(),
    ];
    table
}

fn iterations(outcomes: &[Outcome]) -> f64 {
    outcomes.iter().map(|o| o.iterations as f64).sum::<f64>() / outcomes.len().max(1) as f64
}

/// Budgets: rows evaluated, in all and for one iteration.
fn cost(study: &Study) -> Table {
    let mut table = Table::new(
        title(study, "Budget of each method"),
        vec![
            Column::text("id", ""),
            Column::text("solver", "Solver"),
            Column::text("treatment", "Treatment"),
            Column::number("iterations", "iterations", "", 1),
            Column::number("residual_passes", "residuals", "", 0),
            Column::number("jacobian_passes", "Jacobians", "", 0),
            Column::number("residual_passes_per_iteration", "each", "", 1),
            Column::number("jacobian_passes_per_iteration", "each", "", 1),
            Column::text("ended", "Ended"),
        ],
    );
    for result in &study.results {
        let (residuals, jacobians) = passes(study, result);
        let n = iterations(&result.outcomes);
        table.push([
            result.method.id.as_str().into(),
            result.solver.name.into(),
            treatment(result).into(),
            n.into(),
            residuals.into(),
            jacobians.into(),
            (residuals / n).into(),
            (jacobians / n).into(),
            ended(&result.outcomes).into(),
        ]);
    }
    table.notes = vec![
        "residuals, Jacobians: passes over the rows of the fit, mean over the cases; each: for one iteration. ukf-vslm-2023 Table VII gives Θ(iterations × \
         rows) for all methods alike: counted, the constants differ by orders of magnitude. LTLM takes two Jacobians and \
         2M evaluations per iteration, a filter's iteration is a sweep, a swarm's a generation."
            .to_owned(),
    ];
    table
}

fn treatment(result: &MethodResult) -> &'static str {
    match (result.treatment, result.method.units) {
        (Treatment::Printed, Units::Rad) => "printed, rad",
        (Treatment::Printed, Units::Deg) => "printed, deg",
        (Treatment::Sound, _) => "sound",
    }
}

/// Passes over the rows of the fit: residuals alone, and with derivatives.
fn passes(study: &Study, result: &MethodResult) -> (f64, f64) {
    let per = match study.sensor {
        Sensor::Cable => 1,
        Sensor::Position => 3,
        Sensor::Pose => 6,
    };
    let n = result.outcomes.len().max(1) as f64;
    let (mut residuals, mut jacobians) = (0.0, 0.0);
    for (outcome, case) in result.outcomes.iter().zip(&study.cases) {
        let rows = (case.train * per).max(1) as f64;
        residuals += outcome.evaluations.residuals as f64 / rows / n;
        jacobians += outcome.evaluations.jacobians as f64 / rows / n;
    }
    (residuals, jacobians)
}

/// Measured seconds.
pub(super) fn times(study: &Study) -> Table {
    let mut table = Table::new(
        "Time of one case, measured on this machine (not the same in every run)",
        vec![
            Column::text("id", ""),
            Column::text("method", "Method"),
            Column::significant("time_s", "time", "s", 2),
            Column::significant("time_per_iteration_s", "per iteration", "s", 2),
            Column::number("paper_time_s", "paper", "s", 2),
            Column::number("paper_iterations", "paper, iterations", "", 0),
        ],
    );
    for result in &study.results {
        let paper = result.method.paper.unwrap_or_default();
        let seconds = seconds(result);
        table.push([
            result.method.id.as_str().into(),
            result.method.name.as_str().into(),
            seconds.into(),
            (seconds / iterations(&result.outcomes)).into(),
            paper.time_s.into(),
            paper.iterations.into(),
        ]);
    }
    table.notes = vec![
        "Wall clock while other cases ran on other cores, without the search for convergence.".to_owned(),
    ];
    table
}

fn seconds(result: &MethodResult) -> f64 {
    result.outcomes.iter().map(|o| o.seconds).sum::<f64>() / result.outcomes.len().max(1) as f64
}

fn parameter_table(parameters: &ParameterTable) -> Table {
    let mut table = Table::new(
        format!("Link parameters by {} {}", parameters.id, parameters.name),
        vec![
            Column::text("parameter", "Parameter"),
            Column::text("unit", "Unit"),
            Column::number("nominal", "nominal", "", 3),
            Column::significant("deviation", "deviation", "", 2),
            Column::number("paper_deviation", "paper", "", 3),
            Column::number("determined", "seen by the data", "", 2),
            Column::text("observable", "Observable"),
        ],
    );
    for row in &parameters.rows {
        let (scale, unit) =
            if row.parameter.unit() == "mm" { (1.0, "mm") } else { (1f64.to_degrees(), "°") };
        table.push([
            row.parameter.to_string().into(),
            unit.into(),
            (row.nominal * scale).into(),
            Cell::with_sigma(row.deviation * scale, Some(row.sigma * scale)),
            row.paper.map(|v| v * scale).into(),
            row.determined.into(),
            if row.is_observable() { "yes" } else { "no" }.into(),
        ]);
    }
    if parameters.rows.iter().any(|row| row.paper.is_some()) {
        table.notes = vec![
            "paper: what it prints for this method, on its own arm and rows; no target, since most of it lies in what the \
             rows do not see. Its link 2 has an offset d2, ours a turn beta in its place."
                .to_owned(),
        ];
    }
    table
}

fn names(study: &Study) -> Vec<String> {
    study.results.iter().map(|r| r.method.id.clone()).collect()
}

fn error_bars(study: &Study) -> String {
    let group = |label: &str, figure: fn(&ErrorSummary) -> f64| {
        let all: Vec<(f64, Option<f64>)> = study.results.iter().map(|r| over(r, figure)).collect();
        BarGroup {
            deviations: all.iter().map(|f| f.1).collect(),
            ..BarGroup::new(label, all.iter().map(|f| Some(f.0).filter(|v| v.is_finite())))
        }
    };
    Bars {
        title: "Held-out errors".to_owned(),
        y: Axis::new("error", "mm"),
        names: names(study),
        groups: vec![
            group("RMSE", |s| s.rmse),
            group("mean |e|", |s| s.mean_absolute),
            group("max", |s| s.max),
        ],
        labels: None,
    }
    .svg()
}

fn time_bars(study: &Study) -> String {
    Bars {
        title: "Time of one case".to_owned(),
        y: Axis::log("time", "s"),
        names: names(study),
        groups: vec![BarGroup::new("", study.results.iter().map(|r| Some(seconds(r))))],
        labels: Some(Precision::Significant(2)),
    }
    .svg()
}

/// Figure 7 of the papers: the held-out rows of the first case.
fn rows(study: &Study) -> String {
    let registered = study.cases.first().map_or(&[][..], |c| c.registered_errors_mm.as_slice());
    let mut series = vec![points("BC", registered)];
    for result in &study.results {
        if let Some(outcome) = result.outcomes.first().filter(|o| !o.diverged) {
            series.push(points(&result.method.id, &outcome.errors_mm));
        }
    }
    Graph {
        title: "Errors of the held-out rows, first case".to_owned(),
        x: Axis::new("held-out row", ""),
        y: Axis::new("error", "mm"),
        series,
        references: vec![Reference::Horizontal(0.0, String::new())],
        ..Graph::default()
    }
    .svg()
}

fn points(name: &str, errors: &[f64]) -> Series {
    let points: Vec<[f64; 2]> = errors.iter().enumerate().map(|(i, e)| [i as f64 + 1.0, *e]).collect();
    Series { mark: Mark::Line, ..Series::line(name, points) }
}

/// Figures 8 (ltlm-2024) and 6 (ukf-vslm-2023).
fn curves(study: &Study, by_passes: bool) -> String {
    let series = study.results.iter().filter(|r| r.treatment == Treatment::Printed).filter_map(|result| {
        let outcome = result.outcomes.first()?;
        let points: Vec<[f64; 2]> = outcome
            .curve
            .iter()
            .map(|c| if by_passes { [c.passes.max(1.0), c.rmse] } else { [c.iteration as f64 + 1.0, c.rmse] })
            .collect();
        Some(Series::line(result.method.id.clone(), points))
    });
    let x = if by_passes { "passes over the rows" } else { "iteration (1 is the start)" };
    Graph {
        title: "Convergence, first case".to_owned(),
        x: Axis::log(x, ""),
        y: Axis::log("RMSE of the fit", "mm"),
        series: series.collect(),
        ..Graph::default()
    }
    .svg()
}

/// The table for programs: one row for each method and case.
pub(super) fn table(study: &Study) -> Table {
    let mut table = Table::new(
        title(study, "Every case"),
        vec![
            Column::text("id", ""),
            Column::text("method", "Method"),
            Column::text("solver", "Solver"),
            Column::text("treatment", "Treatment"),
            Column::text("protocol", "Protocol"),
            Column::count("case", "Case"),
            Column::count("seed", "Seed"),
            Column::number("rmse_mm", "RMSE", "mm", 4),
            Column::number("mean_absolute_mm", "mean |e|", "mm", 4),
            Column::number("max_mm", "max", "mm", 4),
            Column::number("fitted_rmse_mm", "RMSE of the fit", "mm", 4),
            Column::number("converged_rmse_mm", "RMSE converged", "mm", 4),
            Column::count("iterations", "Iterations"),
            Column::count("residual_rows", "Residual rows"),
            Column::count("jacobian_rows", "Jacobian rows"),
            Column::text("ended", "Ended"),
            Column::text("diverged", "Diverged"),
            Column::number("paper_rmse_mm", "paper RMSE", "mm", 2),
            Column::number("paper_mean_absolute_mm", "paper mean |e|", "mm", 2),
            Column::number("paper_max_mm", "paper max", "mm", 2),
        ],
    );
    let protocol = if study.reduced { "reduced" } else { "whole" };
    for (k, case) in study.cases.iter().enumerate() {
        let paper = study.methods.before.unwrap_or_default();
        let mut row: Vec<Cell> = vec![
            "BC".into(),
            "frames registered".into(),
            Cell::Missing,
            Cell::Missing,
            protocol.into(),
            (k + 1).into(),
            (case.seed as usize).into(),
            case.registered.rmse.into(),
            case.registered.mean_absolute.into(),
            case.registered.max.into(),
        ];
        row.resize(17, Cell::Missing);
        row.extend(figures(paper));
        table.push(row);
    }
    for result in &study.results {
        for (k, (outcome, case)) in result.outcomes.iter().zip(&study.cases).enumerate() {
            let mut row: Vec<Cell> = vec![
                result.method.id.as_str().into(),
                result.method.name.as_str().into(),
                result.solver.name.into(),
                treatment(result).into(),
                protocol.into(),
                (k + 1).into(),
                (case.seed as usize).into(),
                outcome.held_out.rmse.into(),
                outcome.held_out.mean_absolute.into(),
                outcome.held_out.max.into(),
                outcome.fitted.rmse.into(),
                result.converged.as_ref().and_then(|c| c.get(k)).map(|c| c.held_out.rmse).into(),
                outcome.iterations.into(),
                (outcome.evaluations.residuals as usize).into(),
                (outcome.evaluations.jacobians as usize).into(),
                outcome.termination.to_string().into(),
                if outcome.diverged { "yes" } else { "no" }.into(),
            ];
            row.extend(figures(result.method.paper.unwrap_or_default()));
            table.push(row);
        }
    }
    table
}

fn figures(paper: PaperFigures) -> [Cell; 3] {
    [paper.rmse_mm.into(), paper.mean_absolute_mm.into(), paper.max_mm.into()]
}

/// Everything but seconds.
pub(super) fn json(study: &Study) -> Value {
    let outcome = |o: &Outcome| {
        json!({
            "held_out": o.held_out,
            "fitted": o.fitted,
            "termination": o.termination,
            "diverged": o.diverged,
            "evaluations": o.evaluations,
            "iterations": o.iterations,
        })
    };
    let methods: Vec<Value> = study
        .results
        .iter()
        .map(|r| {
            json!({
                "id": r.method.id,
                "name": r.method.name,
                "solver": r.solver.name,
                "treatment": r.treatment,
                "units": r.method.units,
                "settings": r.settings,
                "paper": r.method.paper,
                "cases": r.outcomes.iter().map(outcome).collect::<Vec<_>>(),
                "converged": r.converged.as_ref().map(|c| c.iter().map(outcome).collect::<Vec<_>>()),
                "curve": r.outcomes.first().map(|o| &o.curve),
            })
        })
        .collect();
    let parameters: Vec<Value> = study
        .parameters
        .iter()
        .map(|table| {
            let rows: Vec<Value> = table
                .rows
                .iter()
                .map(|row| {
                    let unit = if matches!(row.parameter, Parameter::Link { coordinate, .. } if coordinate.is_length())
                    {
                        "mm"
                    } else {
                        "rad"
                    };
                    json!({
                        "name": row.parameter.to_string(),
                        "unit": unit,
                        "nominal": row.nominal,
                        "deviation": row.deviation,
                        "sigma": row.sigma,
                        "paper": row.paper,
                        "determined": row.determined,
                        "observable": row.is_observable(),
                    })
                })
                .collect();
            json!({ "id": table.id, "parameters": rows })
        })
        .collect();
    json!({
        "protocol": study.methods.protocol,
        "rows": study.rows,
        "reduced_protocol": study.reduced,
        "simulated": study.simulated,
        "noise_floor_mm": study.noise_floor_mm,
        "before": { "paper": study.methods.before, "cases": study.cases },
        "methods": methods,
        "verdict": study.judgement,
        "sentences": words::sentences(study),
        "parameters": parameters,
    })
}
