//! Tables of methods over cases: errors with the paper's, significance, budgets, parameters.

use crate::experiment::PaperFigures;
use crate::parameters::ParameterTable;
use crate::protocol::{Outcome, Study};
use crate::verdict::Conclusion;
use crate::views::study::{ended, held_out, iterations, passes, registered, seconds, title, treatment};
use crate::views::{named_causes, words};
use truegrind_arm::parameter::display_unit;
use truegrind_calibration::measurement::dataset::Sensor;
use truegrind_math::statistics::median;
use truegrind_report::document::PageVerdict;
use truegrind_report::number::Precision;
use truegrind_report::repeated::{self, spread};
use truegrind_report::status::Status;
use truegrind_report::table::{Cell, Column, Table};

/// Held-out errors, ours next to the paper's.
pub(super) fn errors(study: &Study) -> Table {
    let paper = |key: &str| Column::number(format!("paper_{key}"), "paper", "mm", 2);
    let mut columns = vec![Column::text("id", ""), Column::text("method", "Method")];
    for column in repeated::columns([3, 3, 2]) {
        let beside = paper(&column.key);
        columns.extend([column, beside]);
    }
    let mut table = Table::new(title(study, "Held-out errors"), columns);
    let mut add = |id: &str, name: &str, ours: [Cell; 3], paper: Option<PaperFigures>| {
        let paper = paper.unwrap_or_default();
        let printed = [paper.rmse_mm, paper.mean_absolute_mm, paper.max_mm];
        let pairs = ours.into_iter().zip(printed).flat_map(|(ours, printed)| [ours, printed.into()]);
        table.push([Cell::from(id), name.into()].into_iter().chain(pairs));
    };
    add("BC", "frames alone", repeated::cells(&registered(study)), study.methods.before);
    for result in &study.results {
        let ours = match held_out(result) {
            Some(errors) => repeated::cells(&errors),
            None => {
                let n = result.outcomes.iter().filter(|o| o.diverged).count();
                [format!("diverged {n}/{}", result.outcomes.len()).into(), Cell::Missing, Cell::Missing]
            }
        };
        add(&result.method.id, &result.method.name, ours, result.method.paper);
    }
    if let Some(cases) = &study.named_causes {
        let ours = match named_causes::complete(cases) {
            Some(found) => repeated::cells(&found.iter().map(|c| c.held_out).collect::<Vec<_>>()),
            None => {
                let n = cases.iter().filter(|case| case.is_none()).count();
                [format!("refused {n}/{}", cases.len()).into(), Cell::Missing, Cell::Missing]
            }
        };
        let (id, name) = named_causes::LABEL;
        add(id, name, ours, None);
    }
    table.notes = vec![
        "± is the standard deviation over the cases. The papers print mean |e| as STD, SD or Mean (ltlm-2024 eq. 20, \
         ukf-vslm-2023 eq. 28)."
            .to_owned(),
        "BC, before compensation: the paper's figure includes the cable's constant offset; ours has registered frames and \
         nominal links. A method with the figures of BC did not improve on its start."
            .to_owned(),
    ];
    if study.sensor != Sensor::Cable {
        table.notes.push("Errors are distances between positions.".to_owned());
    }
    let errors =
        study.results.iter().filter_map(held_out).map(|errors| errors.iter().map(|e| e.rmse).collect());
    table.notes.extend(study.named_causes.as_ref().and_then(|cases| named_causes::note(cases, errors)));
    if let Some(floor) = study.noise_floor_mm {
        let floor = Precision::Significant(2).format(floor);
        table.notes.push(format!("Noise floor {floor} mm: errors cannot be reduced below it."));
    }
    table
}

pub(super) fn verdict_table(study: &Study) -> Table {
    let judgement = &study.judgement;
    let reference = &judgement.reference;
    let mut table = Table::new(
        title(study, &format!("Held-out RMSE against {reference}")),
        vec![
            Column::text("id", ""),
            Column::number("difference_mm", "difference", "mm", 4),
            Column::text("better_in", format!("{reference} better")),
            Column::text("p_signed_rank", "p, ranks"),
            Column::text("p_t", "p, t"),
            Column::number("converged_difference_mm", "converged", "mm", 4),
            Column::text("conclusion", "Conclusion"),
        ],
    );
    for comparison in &judgement.comparisons {
        let test = &comparison.limited;
        if matches!(comparison.conclusion, Conclusion::Diverged { .. } | Conclusion::ReferenceDiverged { .. })
        {
            let mut cells: Vec<Cell> = vec![comparison.id.as_str().into()];
            cells.extend([const { Cell::Missing }; 5]);
            cells.push(words::conclusion(comparison, reference).into());
            table.push(cells);
            continue;
        }
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
        "difference: method minus {reference}, positive if {reference} is better. p: two-sided, of the signed-rank test and of \
         the t test corrected for cases that share rows, both after Holm's correction over {} comparisons. converged: the \
         difference after both have converged.",
        judgement.comparisons.len()
    )];
    table
}

pub(super) fn verdict(study: &Study) -> PageVerdict {
    PageVerdict::new(Status::Good, words::headline(study), words::answer(study))
}

/// Each least-squares method as limited and after convergence.
pub(super) fn convergence(study: &Study) -> Table {
    let rows = study.results.iter().filter_map(|result| Some((result, result.converged.as_ref()?)));
    Table::of(title(study, "Stopped and converged"), rows)
        .text("id", "", |(result, _)| result.method.id.as_str())
        .number("rmse_mm", "RMSE as limited", "mm", 4, |(result, _)| mean_rmse(&result.outcomes))
        .number("iterations", "iterations", "", 1, |(result, _)| iterations(&result.outcomes))
        .number("converged_rmse_mm", "converged", "mm", 4, |(_, converged)| mean_rmse(converged))
        .number("converged_iterations", "further steps", "", 1, |(_, converged)| iterations(converged))
        .significant("farthest", "farthest", "", 2, |(_, converged)| {
            converged.iter().map(|o| o.farthest).sum::<f64>() / converged.len().max(1) as f64
        })
        .text("converged_ended", "Ended", |(_, converged)| ended(converged))
.note("Converged: continued on the same cost without fixed damping or a decaying step size. Neither changes the stationary \
         points, so the method itself would end here, often after thousands more iterations along poorly determined \
         directions. Ended: also states if a method had not converged after 5,000 further steps.")
.note("farthest: largest final deviation of a link parameter from the data sheet, in manufacturing tolerances, mean over \
         the cases. A deviation of tens of tolerances fits the rows with a physically implausible arm.")
.table()
}

/// Mean held-out RMSE, or "diverged" if a case diverged.
fn mean_rmse(outcomes: &[Outcome]) -> Cell {
    let all: Option<Vec<f64>> = outcomes.iter().map(|o| (!o.diverged).then_some(o.held_out.rmse)).collect();
    all.map_or_else(|| "diverged".into(), |all| spread(&all).map(|(mean, _)| mean).into())
}

/// Budgets: passes over the rows, in total and per iteration.
pub(super) fn cost(study: &Study) -> Table {
    let rows =
        study.results.iter().map(|result| (result, passes(study, result), iterations(&result.outcomes)));
    Table::of(title(study, "Budget of each method"), rows)
        .text("id", "", |(result, ..)| result.method.id.as_str())
        .text("solver", "Solver", |(result, ..)| result.solver.name)
        .text("treatment", "Treatment", |(result, ..)| treatment(result))
        .number("iterations", "iterations", "", 1, |(.., n)| *n)
        .number("residual_passes", "residuals", "", 0, |(_, passes, _)| passes.0)
        .number("residual_passes_per_iteration", "each", "", 1, |(_, passes, n)| passes.0 / n)
        .number("jacobian_passes", "Jacobians", "", 0, |(_, passes, _)| passes.1)
        .number("jacobian_passes_per_iteration", "each", "", 1, |(_, passes, n)| passes.1 / n)
        .text("ended", "Ended", |(result, ..)| ended(&result.outcomes))
.note("residuals, Jacobians: passes over the rows of the fit, mean over the cases; each: passes per iteration. \
         ukf-vslm-2023 Table VII gives Θ(iterations × rows) for every method; the counted constants differ by orders of \
         magnitude. LTLM takes two Jacobians and 2M evaluations per iteration; an iteration of a filter is a sweep, of a \
         swarm a generation.")
.table()
}

/// Measured seconds.
pub(crate) fn times(study: &Study) -> Table {
    let mut table = Table::new(
        "Time of one case, measured on this machine (not the same in every run)",
        vec![
            Column::text("id", ""),
            Column::text("method", "Method"),
            Column::significant("time_ms", "time", "ms", 2),
            Column::significant("time_per_iteration_ms", "per iteration", "ms", 2),
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
            (1e3 * seconds).into(),
            (1e3 * seconds / iterations(&result.outcomes)).into(),
            paper.time_s.into(),
            paper.iterations.into(),
        ]);
    }
    if let Some(found) = study.named_causes.as_deref().and_then(named_causes::complete) {
        let seconds = median(&found.iter().map(|c| c.seconds).collect::<Vec<_>>());
        let (id, name) = named_causes::LABEL;
        let time_ms: Cell = seconds.map(|seconds| 1e3 * seconds).into();
        table.push([id.into(), name.into(), time_ms].into_iter().chain([const { Cell::Missing }; 3]));
    }
    table.notes = vec![
        "Wall-clock time while other cases ran on other cores, median over the cases, without the continuation to convergence."
            .to_owned(),
    ];
    table
}

pub(super) fn parameter_table(parameters: &ParameterTable) -> Table {
    let rows = parameters.rows.iter().map(|row| (row, display_unit(row.parameter.unit())));
    let mut table = Table::of(format!("Link parameters by {} {}", parameters.id, parameters.name), rows)
        .text("parameter", "Parameter", |(row, _)| row.parameter.to_string())
        .text("unit", "Unit", |(_, (_, unit))| *unit)
        .number("nominal", "nominal", "", 3, |(row, (scale, _))| row.nominal * scale)
        .number("compensated", "compensated", "", 3, |(row, (scale, _))| {
            (row.nominal + row.deviation) * scale
        })
        .significant("deviation", "deviation", "", 2, |(row, (scale, _))| {
            Cell::with_sigma(row.deviation * scale, Some(row.sigma * scale))
        })
        .number("paper_deviation", "paper", "", 3, |(row, (scale, _))| row.paper.map(|v| v * scale))
        .number("determined", "from the data", "", 2, |(row, _)| row.determined)
        .text("observable", "Observable", |(row, _)| if row.is_observable() { "yes" } else { "no" })
        .note("compensated: nominal plus deviation, as entered in a controller; ± is 1σ of the deviation.")
        .table();
    if parameters.rows.iter().any(|row| row.paper.is_some()) {
        table.notes.push(
            "paper: the printed deviation for this method, on the paper's arm and rows; no target, since its rows do not \
             determine most of it. The paper's link 2 has an offset d2, ours a rotation beta instead."
                .to_owned(),
        );
    }
    table
}
