//! Experiment files (TOML): the rows, the methods, their settings, and the figures printed in the paper.
//!
//! ```toml
//! name = "my-comparison"
//! title = "Two methods on my arm"
//! paper = "ours"
//!
//! [methods]
//! reference = "B"                 # every other method is compared with this one
//!
//! [methods.protocol]
//! rows = 100                      # drawn at random from the file for each case
//! held_out = 0.2
//! cases = 10
//!
//! [[methods.method]]
//! id = "A"
//! name = "LM as printed"
//! solver = "lm-as-printed"        # a name of `identify --method`
//! units = "deg"                   # unit of angles in its damping
//! settings = { max-iterations = 60 }
//! paper = { rmse_mm = 0.36 }
//!
//! [[methods.method]]
//! id = "B"
//! name = "LM"
//! solver = "lm"
//! treatment = "sound"
//! ```
//!
//! An experiment has exactly one of the sections `methods`, `grinding`, `uniformity`, `signed-rank` and `degradation`;
//! it determines the kind. [`Experiment::shipped`] returns those that come with the program.

use serde::{Deserialize, Serialize};
use thiserror::Error;

use crate::degradation::settings::Degradation;
use truegrind_calibration::identification::solver::{self, Solver};

/// An experiment.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, rename_all = "kebab-case")]
pub struct Experiment {
    /// Name on the command line.
    pub name: String,
    /// Title, one line.
    pub title: String,
    /// Source: `ltlm-2024`, `ukf-vslm-2023`, `rls-2025`, or any other name.
    pub paper: String,
    /// Tables and figures of the paper that it reproduces.
    #[serde(default)]
    pub figures: Vec<String>,
    /// Description of the procedure.
    #[serde(default)]
    pub about: String,
    /// Caveats for the interpretation of the result.
    #[serde(default)]
    pub caveats: Vec<String>,
    /// Recipe of [`RECIPES`] that is simulated when no file is given.
    #[serde(default)]
    pub recipe: Option<String>,
    /// Methods over splits of measured rows.
    #[serde(default)]
    pub methods: Option<Methods>,
    /// A ground surface.
    #[serde(default)]
    pub grinding: Option<Grinding>,
    /// Uniformity of a chaotic map.
    #[serde(default)]
    pub uniformity: Option<Uniformity>,
    /// A paper's own test on its own figures.
    #[serde(default)]
    pub signed_rank: Option<SignedRankTables>,
    /// An arm that degrades.
    #[serde(default)]
    pub degradation: Option<Degradation>,
}

/// Kind of an experiment, with its settings.
#[derive(Debug, Clone, Copy)]
pub enum Kind<'a> {
    /// Methods over splits of measured rows.
    Methods(&'a Methods),
    /// A ground surface.
    Grinding(&'a Grinding),
    /// Uniformity of a chaotic map.
    Uniformity(&'a Uniformity),
    /// A paper's own test on its own figures.
    SignedRank(&'a SignedRankTables),
    /// An arm that degrades.
    Degradation(&'a Degradation),
}

/// Methods over splits of measured rows.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Methods {
    /// Rows, splits, cases.
    pub protocol: Protocol,
    /// Id of the method that all others are compared with.
    pub reference: String,
    /// Errors printed in the paper for the arm before compensation.
    #[serde(default)]
    pub before: Option<PaperFigures>,
    /// Whether to tabulate the identified parameters, as the papers do.
    #[serde(default)]
    pub parameters: bool,
    /// The methods.
    pub method: Vec<Method>,
}

/// Protocol: rows, split and number of cases.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Protocol {
    /// Rows of one case, drawn at random from the file.
    pub rows: usize,
    /// Share of them that is held out.
    pub held_out: f64,
    /// Cases.
    pub cases: usize,
    /// Treatment of methods that do not state their own.
    #[serde(default)]
    pub treatment: Treatment,
    /// Part of a reading that is used.
    #[serde(default)]
    pub reading: ReadingUsed,
    /// The fixed point of [`ReadingUsed::Distance`], in the sensor's frame (mm).
    #[serde(default)]
    pub fixed_point_mm: [f64; 3],
    /// Whether the controller's read-out is used to refine rounded joint angles. The papers do not do this.
    #[serde(default)]
    pub fuse_readout: bool,
}

/// Problem that a method solves.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Treatment {
    /// As in the papers: outlet or frames from a fit of the frames alone, then the 24 link parameters, every row with
    /// the same weight (1 mm).
    #[default]
    Printed,
    /// Links and frames together, rows weighted by sensor noise and rounding, manufacturing tolerances as priors.
    Sound,
}

/// Part of a reading that is used.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum ReadingUsed {
    /// The whole reading.
    #[default]
    AsMeasured,
    /// The position of a pose or position.
    Position,
    /// The distance of a pose or position from a fixed point, as measured by a cable sensor.
    Distance,
}

/// Unit of angles within a method.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Units {
    /// Radians.
    #[default]
    Rad,
    /// Degrees.
    Deg,
}

/// A method of an experiment.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Method {
    /// Short name, taken from the paper where it has one.
    pub id: String,
    /// Full name.
    pub name: String,
    /// Name of `identify --method`.
    pub solver: String,
    /// Units of angles.
    #[serde(default)]
    pub units: Units,
    /// Treatment; the protocol's where not stated.
    #[serde(default)]
    pub treatment: Option<Treatment>,
    /// Settings that differ from the solver's defaults.
    #[serde(default)]
    pub settings: toml::Table,
    /// Figures printed in the paper.
    #[serde(default)]
    pub paper: Option<PaperFigures>,
    /// Deviations that the paper states as identified by this method: one entry for each link, or none.
    #[serde(default)]
    pub paper_links: Vec<PaperLink>,
}

/// Deviations of one link from its nominal values as printed in a paper; illegible values are omitted.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct PaperLink {
    /// Length (mm).
    pub a_mm: Option<f64>,
    /// Offset (mm).
    pub d_mm: Option<f64>,
    /// Twist (°).
    pub alpha_deg: Option<f64>,
    /// Zero of the joint (°).
    pub theta_deg: Option<f64>,
}

/// Errors and effort printed in a paper for one method.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct PaperFigures {
    /// RMSE (mm).
    pub rmse_mm: Option<f64>,
    /// Mean absolute error (mm), called STD or SD in the papers.
    pub mean_absolute_mm: Option<f64>,
    /// Largest error (mm).
    pub max_mm: Option<f64>,
    /// Time (s).
    pub time_s: Option<f64>,
    /// Iterations.
    pub iterations: Option<f64>,
}

/// A ground surface.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Grinding {
    /// Name of a shipped surface.
    pub surface: String,
    /// Rows of one case, drawn at random from the file; all rows where not stated.
    #[serde(default)]
    pub rows: Option<usize>,
    /// Share of these rows held out to evaluate each method.
    pub held_out: f64,
    /// Number of cases, each with its own random rows.
    #[serde(default = "one")]
    pub cases: usize,
    /// Id of the method that all others are compared with.
    pub reference: String,
    /// Deviations printed in the paper before compensation.
    pub before: Option<PaperPoints>,
    /// The methods.
    pub method: Vec<GrindingMethod>,
}

fn one() -> usize {
    1
}

/// A method of a grinding experiment.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct GrindingMethod {
    /// Short name.
    pub id: String,
    /// Name of `identify --method`.
    pub solver: String,
    /// Figures printed in the paper.
    pub paper: Option<PaperPoints>,
}

/// Five signed deviations, their mean and their standard deviation (mm).
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct PaperPoints {
    /// P1 to P5.
    pub points_mm: [f64; 5],
    /// Signed mean, as printed.
    pub mean_mm: f64,
    /// Standard deviation of the signed values with n − 1, as printed.
    pub sd_mm: f64,
}

/// Uniformity of the logistic-tent map.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Uniformity {
    /// Points of the short sequence.
    pub points: usize,
    /// Points of the long sequence.
    pub long_points: usize,
    /// Bins.
    pub bins: usize,
    /// Sequences for each r.
    pub starts: usize,
    /// Lowest and highest r.
    pub range: [f64; 2],
    /// Number of values of r.
    pub steps: usize,
    /// The r that the paper claims to be best.
    pub claimed: f64,
}

/// A paper's own test on its own figures.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct SignedRankTables {
    /// Id of the method that is compared with every other.
    pub reference: String,
    /// The tables.
    pub table: Vec<SignedRankTable>,
}

/// One table of figures, lower is better.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct SignedRankTable {
    /// Title.
    pub title: String,
    /// Names of the rows.
    pub rows: Vec<String>,
    /// Methods with one figure for each row and the p value printed in the paper.
    pub method: Vec<SignedRankMethod>,
    /// Why fewer pairs are independent than are listed.
    pub dependence: String,
}

/// Figures of one method.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct SignedRankMethod {
    /// Short name.
    pub id: String,
    /// One figure for each row.
    pub figures: Vec<f64>,
    /// The printed p value of the reference against this method.
    pub paper_p: Option<f64>,
}

/// Why an experiment cannot be run.
#[derive(Debug, Clone, PartialEq, Error)]
#[non_exhaustive]
pub enum ExperimentError {
    /// No experiment of that name.
    #[error("unknown experiment \"{name}\"; the experiments are {}", known.join(", "))]
    Unknown {
        /// Name.
        name: String,
        /// Names that exist.
        known: Vec<String>,
    },
    /// Not TOML, or a key that is missing, misspelt or of the wrong type.
    #[error("{file}: line {line}: {message}")]
    Syntax {
        /// File.
        file: String,
        /// Line, from 1.
        line: usize,
        /// Found and expected.
        message: String,
    },
    /// A value that cannot be used.
    #[error("{file}: {key}: found {found}, expected {expected}")]
    Invalid {
        /// File.
        file: String,
        /// Key.
        key: String,
        /// Value.
        found: String,
        /// Expected values.
        expected: String,
    },
    /// Fewer rows than the protocol asks for.
    #[error(
        "{file} has {found} rows, experiment {experiment} needs {asked}: run it with --rows {possible}, which keeps the shares with \
         fewer rows; its tables are then headed \"reduced protocol\""
    )]
    TooFewRows {
        /// File.
        file: String,
        /// Experiment.
        experiment: String,
        /// Rows in the file.
        found: usize,
        /// Rows that the protocol needs.
        asked: usize,
        /// Largest usable value of `--rows`.
        possible: usize,
    },
    /// Too few rows for the parameters.
    #[error(
        "{file}: {rows} rows, {held_out} of them held out, leave {readings} readings to fit {parameters} parameters: \
         experiment {experiment} needs at least --rows {needed}"
    )]
    TooFewReadings {
        /// File.
        file: String,
        /// Experiment.
        experiment: String,
        /// Rows of one case.
        rows: usize,
        /// Held-out rows.
        held_out: usize,
        /// Readings left for the fit.
        readings: usize,
        /// Parameters.
        parameters: usize,
        /// Smallest usable value of `--rows`.
        needed: usize,
    },
    /// The file has another sensor.
    #[error("{file}: experiment {experiment} needs {expected}, the file has {found}")]
    WrongSensor {
        /// File.
        file: String,
        /// Experiment.
        experiment: String,
        /// Sensor of the file.
        found: &'static str,
        /// Sensor that the experiment needs.
        expected: &'static str,
    },
    /// The rows do not determine the sensor's location.
    #[error(transparent)]
    StartError(#[from] truegrind_calibration::identification::start::StartError),
    /// The recipe cannot be simulated.
    #[error("recipe of experiment {experiment}: {message}")]
    Recipe {
        /// Experiment.
        experiment: String,
        /// Why.
        message: String,
    },
}

/// Shipped experiment files: name for messages, text.
const SHIPPED: [(&str, &[u8]); 10] = [
    ("ltlm-table-6.toml", include_bytes!("../../../experiments/ltlm-table-6.toml")),
    ("ltlm-table-6-80-20.toml", include_bytes!("../../../experiments/ltlm-table-6-80-20.toml")),
    ("ltlm-table-8.toml", include_bytes!("../../../experiments/ltlm-table-8.toml")),
    ("ltlm-figure-2.toml", include_bytes!("../../../experiments/ltlm-figure-2.toml")),
    ("ukf-vslm-d1.toml", include_bytes!("../../../experiments/ukf-vslm-d1.toml")),
    ("ukf-vslm-d2.toml", include_bytes!("../../../experiments/ukf-vslm-d2.toml")),
    ("ukf-vslm-d3.toml", include_bytes!("../../../experiments/ukf-vslm-d3.toml")),
    ("ukf-vslm-d3-distance.toml", include_bytes!("../../../experiments/ukf-vslm-d3-distance.toml")),
    ("ukf-vslm-table-10.toml", include_bytes!("../../../experiments/ukf-vslm-table-10.toml")),
    ("rls-degradation.toml", include_bytes!("../../../experiments/rls-degradation.toml")),
];

/// Shipped recipes, by name.
pub const RECIPES: [(&str, &[u8]); 3] = [
    ("irb120-1024", include_bytes!("../../../experiments/recipes/irb120-1024.toml")),
    ("irb120-1024-position", include_bytes!("../../../experiments/recipes/irb120-1024-position.toml")),
    ("tx60-pose", include_bytes!("../../../experiments/recipes/tx60-pose.toml")),
];

impl Experiment {
    /// Reads an experiment and checks it; `file` is named in errors.
    ///
    /// # Errors
    /// [`ExperimentError::Syntax`] and [`ExperimentError::Invalid`].
    pub fn parse(text: &str, file: &str) -> Result<Self, ExperimentError> {
        let experiment: Self = truegrind_math::toml_text::read(text).map_err(|error| {
            let start = error.span().map_or(0, |span| span.start).min(text.len());
            let line = text.get(..start).unwrap_or_default().matches('\n').count() + 1;
            ExperimentError::Syntax {
                file: file.to_owned(),
                line,
                message: error.message().replace('\n', " "),
            }
        })?;
        experiment.check(file)?;
        Ok(experiment)
    }

    /// The experiments that come with the program.
    ///
    /// # Errors
    /// As [`Experiment::parse`]; a test checks that every shipped file parses.
    pub fn shipped() -> Result<Vec<Self>, ExperimentError> {
        SHIPPED.iter().map(|(file, bytes)| Self::parse(&String::from_utf8_lossy(bytes), file)).collect()
    }

    /// The shipped experiment of that name.
    ///
    /// # Errors
    /// [`ExperimentError::Unknown`], with the names that exist.
    pub fn by_name(name: &str) -> Result<Self, ExperimentError> {
        let mut all = Self::shipped()?;
        match all.iter().position(|e| e.name == name) {
            Some(at) => Ok(all.swap_remove(at)),
            None => Err(ExperimentError::Unknown {
                name: name.to_owned(),
                known: all.into_iter().map(|e| e.name).collect(),
            }),
        }
    }

    /// The kind of the experiment; `None` without a section.
    pub fn kind(&self) -> Option<Kind<'_>> {
        let kinds = [
            self.methods.as_ref().map(Kind::Methods),
            self.grinding.as_ref().map(Kind::Grinding),
            self.uniformity.as_ref().map(Kind::Uniformity),
            self.signed_rank.as_ref().map(Kind::SignedRank),
            self.degradation.as_ref().map(Kind::Degradation),
        ];
        let mut found = kinds.into_iter().flatten();
        found.next().filter(|_| found.next().is_none())
    }

    /// Whether measured rows are needed, from a file or from the recipe.
    pub fn takes_rows(&self) -> bool {
        matches!(self.kind(), Some(Kind::Methods(_) | Kind::Grinding(_)))
    }

    fn check(&self, file: &str) -> Result<(), ExperimentError> {
        let wrong = |key: &str, found: String, expected: &str| {
            let (file, key, expected) = (file.to_owned(), key.to_owned(), expected.to_owned());
            Err(ExperimentError::Invalid { file, key, found, expected })
        };
        let Some(kind) = self.kind() else {
            let sections = "one of the sections methods, grinding, uniformity, signed-rank, degradation";
            return wrong("the file", "none or several of them".to_owned(), sections);
        };
        if let Some(recipe) = &self.recipe
            && !RECIPES.iter().any(|(name, _)| name == recipe)
        {
            let names: Vec<&str> = RECIPES.iter().map(|(name, _)| *name).collect();
            return wrong("recipe", recipe.clone(), &names.join(" or "));
        }
        match kind {
            Kind::Methods(methods) => methods.check(&wrong),
            Kind::Grinding(grinding) => {
                share("grinding.held_out", grinding.held_out, &wrong)?;
                if grinding.cases == 0 {
                    return wrong("grinding.cases", "0".to_owned(), "at least 1");
                }
                if !grinding.method.iter().any(|m| m.id == grinding.reference) {
                    return wrong("grinding.reference", grinding.reference.clone(), "the id of a method");
                }
                for (k, method) in grinding.method.iter().enumerate() {
                    solver_named(&format!("grinding.method {}", k + 1), &method.solver, &wrong)?;
                }
                Ok(())
            }
            Kind::SignedRank(tables) => {
                for table in &tables.table {
                    if let Some(m) = table.method.iter().find(|m| m.figures.len() != table.rows.len()) {
                        let found = format!("{} figures of {}", m.figures.len(), m.id);
                        return wrong("signed-rank.table.method.figures", found, "one for each row");
                    }
                    if !table.method.iter().any(|m| m.id == tables.reference) {
                        return wrong(
                            "signed-rank.reference",
                            tables.reference.clone(),
                            "the id of a method",
                        );
                    }
                }
                Ok(())
            }
            Kind::Uniformity(u) => {
                if u.points == 0 || u.bins < 2 || u.starts == 0 || u.steps < 2 {
                    let found = format!(
                        "{} points, {} bins, {} starts, {} steps",
                        u.points, u.bins, u.starts, u.steps
                    );
                    return wrong("uniformity", found, "at least 1 point, 2 bins, 1 start, 2 steps");
                }
                Ok(())
            }
            Kind::Degradation(degradation) => match degradation.fault() {
                Some((key, found, expected)) => wrong(key, found, expected),
                None => Ok(()),
            },
        }
    }
}

/// Reports an invalid value: key, found, expected.
type Wrong<'a> = &'a dyn Fn(&str, String, &str) -> Result<(), ExperimentError>;

fn share(key: &str, value: f64, wrong: Wrong<'_>) -> Result<(), ExperimentError> {
    if value > 0.0 && value <= 0.9 {
        Ok(())
    } else {
        wrong(key, value.to_string(), "a share above 0, up to 0.9")
    }
}

fn solver_named(key: &str, name: &str, wrong: Wrong<'_>) -> Result<(), ExperimentError> {
    match solver::by_name(name) {
        Ok(_) => Ok(()),
        Err(_) => {
            let names: Vec<&str> = solver::all().map(|s| s.name).collect();
            wrong(&format!("{key}: solver"), name.to_owned(), &names.join(", "))
        }
    }
}

impl Methods {
    fn check(&self, wrong: Wrong<'_>) -> Result<(), ExperimentError> {
        share("methods.protocol.held_out", self.protocol.held_out, wrong)?;
        if self.protocol.cases == 0 {
            wrong("methods.protocol.cases", "0".to_owned(), "at least 1")?;
        }
        if !self.method.iter().any(|m| m.id == self.reference) {
            wrong("methods.reference", self.reference.clone(), "the id of a method")?;
        }
        for (k, method) in self.method.iter().enumerate() {
            let key = format!("methods.method {} ({})", k + 1, method.id);
            if self.method[..k].iter().any(|other| other.id == method.id) {
                wrong(&key, method.id.clone(), "an id that no other method has")?;
            }
            if !matches!(method.paper_links.len(), 0 | 6) {
                let found = format!("{} links", method.paper_links.len());
                wrong(&format!("{key}: paper_links"), found, "one for each of 6 links, or none")?;
            }
            solver_named(&key, &method.solver, wrong)?;
            if let Ok(solver) = solver::by_name(&method.solver)
                && let Err(reason) = solver.configured(&method.settings)
            {
                wrong(&key, reason.to_string(), "settings of that method")?;
            }
        }
        Ok(())
    }
}

impl Method {
    /// The solver. [`Experiment::parse`] rejects unknown names; for one the first solver of the list is returned.
    pub fn solver(&self) -> &'static Solver {
        solver::by_name(&self.solver).unwrap_or(&solver::SOLVERS[0])
    }
}
