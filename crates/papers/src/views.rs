//! Reports of the papers' experiments: verdict, tables with the paper's figures next to ours, and plots.
//!
//! Only measured times differ between runs. They have a separate table ([`times`]), and a page shows them on request
//! ([`Origin::timings`]).

mod named_causes;
mod study;
mod words;
mod methods;
mod grinding;
mod uniformity;
mod signed_rank;
mod degradation;

use serde_json::{Value, json};

use crate::Results;
use crate::experiment::Experiment;
use truegrind_report::document::{Block, Document, Provenance, Source};
use truegrind_report::table::Table;

/// Inputs of a run, for the provenance of a page.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Origin {
    /// Measurement file; absent where none is needed.
    pub file: Option<String>,
    /// SHA-256 of its bytes.
    pub sha256: Option<String>,
    /// Rows of the file.
    pub rows: Option<usize>,
    /// Robot.
    pub robot: Option<String>,
    /// Seed.
    pub seed: u64,
    /// Whether measured times are shown, which differ between runs.
    pub timings: bool,
}

/// Summary for the terminal.
pub fn summary(experiment: &Experiment, results: &Results) -> Document {
    let mut page = opening(experiment, results);
    match results {
        Results::Methods(study) => methods::summary(&mut page, study),
        Results::Grinding(result) => grinding::summary(&mut page, result),
        Results::Uniformity(result) => uniformity::summary(&mut page, result),
        Results::SignedRank(tables) => signed_rank::summary(&mut page, tables),
        Results::Degradation(result) => degradation::summary(&mut page, result),
    }
    answer_first(&mut page);
    page
}

/// Moves the verdict and the key figures before the description and the caveats.
fn answer_first(page: &mut Document) {
    let is_answer: [fn(&Block) -> bool; 2] =
        [|block| matches!(block, Block::Verdict(_)), |block| matches!(block, Block::KeyFigures(_))];
    for (place, is) in is_answer.into_iter().enumerate() {
        let Some(found) = page.blocks.iter().position(is).filter(|found| *found > place) else { continue };
        // A verdict below a heading belongs to its section.
        if page.blocks[..found].iter().any(|block| matches!(block, Block::Heading(..))) {
            continue;
        }
        let block = page.blocks.remove(found);
        page.blocks.insert(place.min(found), block);
    }
}

/// The full page, with plots.
pub fn document(experiment: &Experiment, results: &Results, origin: &Origin) -> Document {
    let mut page = opening(experiment, results);
    match results {
        Results::Methods(study) => methods::page(&mut page, study, origin.timings),
        Results::Grinding(result) => grinding::page(&mut page, result),
        Results::Uniformity(result) => uniformity::page(&mut page, result),
        Results::SignedRank(tables) => signed_rank::summary(&mut page, tables),
        Results::Degradation(result) => degradation::page(&mut page, result, origin.timings),
    }
    answer_first(&mut page);
    let source = origin.file.as_ref().map(|name| Source {
        name: name.clone(),
        role: "Measurements".to_owned(),
        sha256: origin.sha256.clone().filter(|hash| !hash.is_empty()),
        rows: origin.rows,
    });
    let mut remarks = vec![("Experiment".to_owned(), experiment.name.clone())];
    remarks.extend(origin.robot.iter().map(|robot| ("Robot".to_owned(), robot.clone())));
    page.push(Provenance {
        seed: Some(origin.seed),
        sources: source.into_iter().collect(),
        remarks,
        ..Provenance::here()
    });
    page
}

/// The table for CSV.
pub fn table(results: &Results) -> Table {
    match results {
        Results::Methods(study) => methods::table(study),
        Results::Grinding(result) => grinding::table(result),
        Results::Uniformity(result) => uniformity::table(result),
        Results::SignedRank(tables) => signed_rank::table(tables),
        Results::Degradation(result) => degradation::table(result),
    }
}

/// Measured times, for the kinds of experiment that have them.
pub fn times(results: &Results) -> Option<Table> {
    match results {
        Results::Methods(study) => Some(methods::times(study)),
        Results::Degradation(result) => Some(degradation::times(result)),
        _ => None,
    }
}

/// The whole result as JSON, schema `truegrind.comparison/1`.
pub fn json(experiment: &Experiment, results: &Results, origin: &Origin) -> Value {
    let (kind, result) = match results {
        Results::Methods(study) => ("methods", methods::json(study)),
        Results::Grinding(result) => ("grinding", grinding::json(result)),
        Results::Uniformity(result) => ("uniformity", uniformity::json(result)),
        Results::SignedRank(tables) => ("signed-rank", signed_rank::json(tables)),
        Results::Degradation(result) => ("degradation", degradation::json(result)),
    };
    json!({
        "schema": "truegrind.comparison/1",
        "experiment": {
            "name": experiment.name,
            "title": experiment.title,
            "paper": experiment.paper,
            "figures": experiment.figures,
            "caveats": experiment.caveats,
        },
        "dataset": {
            "file": origin.file,
            "sha256": origin.sha256,
            "rows": origin.rows,
            "robot": origin.robot,
        },
        "seed": origin.seed,
        "kind": kind,
        "result": result,
    })
}

/// List of the shipped experiments: name, title, and the tables and figures that each reproduces.
pub fn list(experiments: &[Experiment]) -> Document {
    let mut page = Document::new("Experiments");
    page.push(Block::List(
        experiments
            .iter()
            .map(|e| format!("{}: {}. Reproduces {}, {}.", e.name, e.title, e.paper, e.figures.join(", ")))
            .collect(),
    ));
    page
}

fn opening(experiment: &Experiment, results: &Results) -> Document {
    let mut page = Document::new(experiment.title.clone());
    page.subtitle = format!("{}: {}", experiment.paper, experiment.figures.join(", "));
    if let Results::Methods(study) = results
        && study.reduced
    {
        page.subtitle.push_str(&format!(
            " – reduced protocol: {} rows instead of {}",
            study.rows, study.methods.protocol.rows
        ));
    }
    if !experiment.about.is_empty() {
        page.paragraph(experiment.about.clone());
    }
    // Methods over cases add caveats of their rows.
    if !matches!(results, Results::Methods(_)) && !experiment.caveats.is_empty() {
        page.push(Block::List(experiment.caveats.clone()));
    }
    page
}
