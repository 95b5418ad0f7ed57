//! Methods over cases: errors beside the paper's, verdict, cost, convergence, parameters, plots.

mod data;
mod figures;
mod tables;

use self::figures::{curves, error_bars, rows, time_bars};
use self::tables::{convergence, cost, errors, parameter_table, verdict, verdict_table};
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
        "Held-out errors, mean over the cases; whiskers are one standard deviation over the cases. The mean of |e| is \
         what the papers call STD. A method that diverged in any case has no bar.",
    );
    for (picture, not_drawn) in rows(study) {
        page.figure(
            picture,
            format!(
                "Held-out rows of the first case in the order of the file; BC has its frames registered, links nominal. \
                 Methods that diverged in any case are left out.{not_drawn}"
            ),
        );
    }
    page.heading(2, "Which differences are real");
    page.push(verdict_table(study));
    page.push(Block::List(reservations(study)));
    page.push(convergence(study));
    page.heading(2, "Convergence and cost");
    page.figure(
        curves(study, false),
        "Root mean square of the fit over the iterations, first case, methods as printed. An iteration of one method \
         costs something else than one of another. A curve ends where it is ten times above its start; who is there after \
         one step has none.",
    );
    page.figure(
        curves(study, true),
        "The same over passes through the rows, those with derivatives counted once: what an engineer pays for.",
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

/// What is to be known of the figures beside each other.
fn notes(study: &Study) -> Block {
    let mut notes = Vec::new();
    if study.reduced {
        notes.push(format!(
            "Reduced protocol: {} rows in place of {}. The paper's figures beside ours belong to the whole one.",
            study.rows, study.methods.protocol.rows
        ));
    }
    if study.simulated {
        notes.push(
            format!(
                "Simulated rows of {}: the paper's figures were measured on another arm and stand beside ours for the order \
                 of the methods, not for their size.",
                study.robot
            ),
        );
    }
    notes.extend(study.experiment.caveats.iter().cloned());
    Block::List(notes)
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
            KeyFigure::new("Smallest held-out RMSE", Cell::with_sigma(mean, deviation), 3, "mm")
                .note(format!("{} {}", best.method.id, best.method.name)),
        );
    }
    figures.push(
        KeyFigure::new("Frames registered alone", rmse(&registered(study)).map(|r| r.0), 3, "mm")
            .note("nominal links, the fair before"),
    );
    figures.push(KeyFigure::new("Noise floor", study.noise_floor_mm, 3, "mm").note(if study.simulated {
        "repeated poses, else rounding and sensor"
    } else {
        "repeated poses, else the rounding of angles"
    }));
    figures
}
