//! Machine-readable results of methods over cases: a table with one row for each method and case, and JSON.

use serde_json::{Value, json};

use crate::experiment::PaperFigures;
use crate::named_causes::NamedCauses;
use crate::protocol::{Outcome, Study};
use crate::views::study::{title, treatment};
use crate::views::{named_causes, words};
use truegrind_arm::parameter::Parameter;
use truegrind_report::table::{Cell, Column, Table};

/// The columns of [`table`].
fn columns() -> Vec<Column> {
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
    ]
}

/// Table for CSV: one row for each method and case.
pub(crate) fn table(study: &Study) -> Table {
    let mut table = Table::new(title(study, "Every case"), columns());
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
    let diagnosed = study.named_causes.iter().flatten().zip(&study.cases);
    for (k, (found, case)) in diagnosed.enumerate() {
        let (id, name) = named_causes::LABEL;
        let mut row: Vec<Cell> = vec![
            id.into(),
            name.into(),
            "diagnose".into(),
            Cell::Missing,
            protocol.into(),
            (k + 1).into(),
            (case.seed as usize).into(),
        ];
        if let Some(NamedCauses { held_out, fitted, .. }) = found {
            let errors = [held_out.rmse, held_out.mean_absolute, held_out.max, fitted.rmse];
            row.extend(errors.map(Cell::from));
        }
        row.resize(15, Cell::Missing);
        row.push(if found.is_some() { Cell::Missing } else { "refused".into() });
        row.resize(20, Cell::Missing);
        table.push(row);
    }
    table
}

fn figures(paper: PaperFigures) -> [Cell; 3] {
    [paper.rmse_mm.into(), paper.mean_absolute_mm.into(), paper.max_mm.into()]
}

/// The whole result as JSON, without measured times.
pub(crate) fn json(study: &Study) -> Value {
    let outcome = |o: &Outcome| {
        json!({
            "held_out": o.held_out,
            "fitted": o.fitted,
            "termination": o.termination,
            "diverged": o.diverged,
            "evaluations": o.evaluations,
            "iterations": o.iterations,
            "farthest_tolerances": o.farthest,
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
    let sentences = [words::answer(study), words::reservations(study)].concat();
    json!({
        "protocol": study.methods.protocol,
        "rows": study.rows,
        "reduced_protocol": study.reduced,
        "simulated": study.simulated,
        "noise_floor_mm": study.noise_floor_mm,
        "before": { "paper": study.methods.before, "cases": study.cases },
        "methods": methods,
        "named_causes": study.named_causes,
        "verdict": study.judgement,
        "sentences": sentences,
        "parameters": parameters,
    })
}
