//! Report of methods over cases: errors with the paper's, verdict, cost, convergence, parameters, plots.

mod data;
mod figures;
mod tables;

use self::figures::{curves, error_bars, rows, time_bars};
use self::tables::{convergence, cost, errors, parameter_table, verdict, verdict_table};
use super::named_causes;
use super::study::{held_out, registered};
use super::words::reservations;
use crate::protocol::Study;
use truegrind_math::statistics::ErrorSummary;
use truegrind_report::document::{Block, Document, KeyFigure};
use truegrind_report::repeated::spread;
use truegrind_report::table::Cell;

pub(super) use self::data::{json, table};
pub(super) use self::tables::times;

/// Terminal.
pub(super) fn summary(page: &mut Document, study: &Study) {
    page.push(verdict(study));
    page.push(key_figures(study));
    page.push(errors(study));
    page.push(notes(study));
    page.push(verdict_table(study));
    page.push(Block::List(reservations(study)));
    page.push(convergence(study));
    page.push(cost(study));
}

/// Page; `timings`: with the measured seconds.
pub(super) fn page(page: &mut Document, study: &Study, timings: bool) {
    page.push(verdict(study));
    page.push(key_figures(study));
    page.push(errors(study));
    page.push(notes(study));
    page.heading(2, "Errors");
    page.figure(
        error_bars(study),
        "Held-out errors, mean over the cases; whiskers are one standard deviation over the cases. The papers call the mean \
         of |e| STD. A method that diverged in any case has no bar. BC: frames alone; NC: named causes.",
    );
    for (picture, not_drawn) in rows(study) {
        page.figure(
            picture,
            format!(
                "Held-out rows of the first case in the order of the file; BC has registered frames and nominal links. \
                 Methods that diverged in any case are omitted.{not_drawn}"
            ),
        );
    }
    page.heading(2, "Significant differences");
    page.push(verdict_table(study));
    page.push(Block::List(reservations(study)));
    page.push(convergence(study));
    page.heading(2, "Convergence and cost");
    page.figure(
        curves(study, false),
        "RMSE of the fit over the iterations, first case, methods as printed. The cost of an iteration differs between \
         methods. A curve ends where it exceeds ten times its start; a method that exceeds it after one step has no curve.",
    );
    page.figure(
        curves(study, true),
        "The same over passes through the rows, those with derivatives counted once: a measure of the computing cost.",
    );
    page.push(cost(study));
    if timings {
        page.push(times(study));
        page.figure(
            time_bars(study),
            "Time of one case, while other cases ran on other cores: not the same in every run.",
        );
    }
    if !study.parameters.is_empty() {
        page.heading(2, "Identified parameters");
        page.paragraph(
            "First case. σ includes the tolerances as prior for every method. Parameters that the data do not determine are \
             marked: their values depend on the search only, and two methods that disagree on them do not contradict each \
             other.",
        );
        for table in &study.parameters {
            page.push(Block::Details {
                summary: format!("{} {}", table.id, table.name),
                blocks: vec![parameter_table(table).into()],
            });
        }
    }
}

/// Caveats for the comparison with the paper's figures.
fn notes(study: &Study) -> Block {
    let mut notes = Vec::new();
    if study.reduced {
        notes.push(format!(
            "Reduced protocol: {} rows instead of {}. The paper's figures belong to the full protocol.",
            study.rows, study.methods.protocol.rows
        ));
    }
    if study.simulated {
        notes.push(
            format!(
                "Simulated rows of {}: the paper's figures were measured on another arm. Compare the order of the methods, \
                 not the size of the errors.",
                study.robot
            ),
        );
    }
    notes.extend(study.experiment.caveats.iter().cloned());
    Block::List(notes)
}

/// The error of the diagnosis, which is none of the methods compared.
fn named_causes_beside(study: &Study) -> String {
    let found = study.named_causes.as_deref().and_then(named_causes::complete);
    let errors: Vec<f64> = found.into_iter().flatten().map(|case| case.held_out.rmse).collect();
    let (id, name) = named_causes::LABEL;
    spread(&errors).map_or_else(String::new, |(mean, _)| format!("; {id} ({name}): {mean:.3} mm"))
}

fn key_figures(study: &Study) -> Vec<KeyFigure> {
    let rmse = |errors: &[ErrorSummary]| spread(&errors.iter().map(|e| e.rmse).collect::<Vec<_>>());
    let best = study
        .results
        .iter()
        .filter_map(|r| Some((r, rmse(&held_out(r)?)?)))
        .min_by(|(_, a), (_, b)| a.0.total_cmp(&b.0));
    let mut figures = vec![];
    if let Some((best, (mean, deviation))) = best {
        figures.push(
            KeyFigure::new("Smallest held-out RMSE", Cell::with_sigma(mean, deviation), 3, "mm").note(
                format!(
                    "of the methods compared: {} {}{}",
                    best.method.id,
                    best.method.name,
                    named_causes_beside(study)
                ),
            ),
        );
    }
    figures.push(
        KeyFigure::new("Frames registered alone", rmse(&registered(study)).map(|r| r.0), 3, "mm")
            .note("nominal links, before compensation"),
    );
    figures.push(KeyFigure::new("Noise floor", study.noise_floor_mm, 3, "mm").note(if study.simulated {
        "from repeated poses, or from rounding and sensor"
    } else {
        "from repeated poses, or from the rounding of angles"
    }));
    figures
}
