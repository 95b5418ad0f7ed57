//! Acceptance report of an estimated arm: decision, errors, method.

use serde_json::{Value, json};

use super::document::{Block, Document, KeyFigure, PageVerdict, Provenance, Source};
use super::plot::{Axis, Graph, Histogram, Ink, Reference, Sample, Series};
use super::status::Status;
use super::table::{Cell, Column, Table};
use truegrind_arm::estimated::Estimated;
use truegrind_calibration::acceptance::orientation::Orientation;
use truegrind_calibration::acceptance::path::{PATH_CYCLES, PATH_POINTS, PathFound};
use truegrind_calibration::acceptance::{
    Acceptance, Decision, ISO_CYCLES, ISO_POSES, MIN_POSES, MIN_SHARE, Scatter, Uncertainty, Uncounted,
};
use truegrind_calibration::measurement::dataset::{Dataset, Sensor};
use truegrind_math::statistics::ErrorSummary;

/// Further data for the report.
#[derive(Debug, Clone, Default)]
pub struct Statement {
    /// Serial numbers and other remarks by name.
    pub serials: Vec<(String, String)>,
    /// The model file, and the SHA-256 of its bytes.
    pub model: Option<(String, String)>,
    /// Whether the sensor's frame was stated.
    pub frames_stated: bool,
    /// Seed of the folds.
    pub seed: u64,
}

/// The whole page.
pub fn document(
    found: &Acceptance,
    dataset: &Dataset,
    estimated: &Estimated,
    statement: &Statement,
) -> Document {
    let mut page = summary(found, dataset, estimated);
    page.heading(2, "Errors");
    page.figure(
        frequency(found, dataset.sensor),
        "Error of each row under the estimated arm, with a sensor frame fitted without that row.",
    );
    page.figure(by_row(found, dataset.sensor), "Errors by row in file order, with the tolerance.");
    if let Some(turns) = &found.orientation {
        page.figure(
            turns_by_row(turns),
            "Orientation error by row: angle between measured and predicted target.",
        );
    }
    page.heading(2, "Conditions");
    page.push(conditions(found, estimated));
    page.heading(2, "Method");
    page.push(Block::List(method(found, statement)));
    page.push(Block::Details {
        summary: format!("Errors of the {} rows", found.rows),
        blocks: vec![row_table(found).excerpt(300).into()],
    });
    page.heading(2, "Provenance");
    page.push(provenance(dataset, estimated, statement));
    page
}

/// Summary for the terminal.
pub fn summary(found: &Acceptance, dataset: &Dataset, estimated: &Estimated) -> Document {
    let mut page = Document::new(format!("Acceptance of {}", estimated.robot));
    page.subtitle = format!("{}, {} poses in {} rows", dataset.file, found.poses, found.rows);
    page.push(verdict(found, dataset.sensor));
    page.push(Block::KeyFigures(figures(found)));
    page.push(table(found, dataset.sensor));
    page.push(orientation_table(found));
    page.push(iso(found, dataset));
    page
}

/// Whether the arm is accepted.
pub fn is_accepted(found: &Acceptance) -> bool {
    found.overall() == Decision::Accepted
}

/// RMS error of a model above which the readings are of another arm (mm).
const OTHER_ARM_MM: f64 = 25.0;

/// Share of a joint's range in the fit below which the verdict says how little was tested.
const MIN_COVERAGE: f64 = 0.5;

fn verdict(found: &Acceptance, sensor: Sensor) -> PageVerdict {
    let (status, headline) = headline(found);
    let mut reasons = Vec::new();
    match found.uncertainty {
        Uncertainty::Unknown => reasons.push(
            "the sensor uncertainty is unknown, so nothing can be accepted: state it (--sensor-uncertainty), or repeat some poses"
                .to_owned(),
        ),
        Uncertainty::Repeats => reasons.push(from_repeats("the uncertainty", found.scatter)),
        Uncertainty::AboveStated => reasons.push(format!(
            "repeated poses scatter more than the stated uncertainty of {} mm allows: that of their scatter, {} mm, is used instead",
            length(found.stated_mm.unwrap_or_default()),
            length(found.uncertainty_mm)
        )),
        Uncertainty::Stated => {}
    }
    reasons.extend(orientation_reason(found));
    reasons.push(tested(found));
    reasons.extend(found.uncounted.map(uncounted));
    if found.is_registered {
        reasons.push(
            "the placement of the base and the flange was not tested: the sensor was registered with these poses; state --sensor-frame (of a cable \
             --outlet and --cable-zero) and --touched-point to test it"
                .to_owned(),
        );
    }
    if found.overall() == Decision::Accepted && found.is_nominal_within() {
        reasons.push(format!(
            "the nominal arm passes as well (largest error {} mm): these poses do not show what the calibration gains",
            length(found.nominal.max)
        ));
    }
    if found.model.rmse > OTHER_ARM_MM {
        reasons.push(
            "a calibrated arm does not have errors this large: check the units, and that these readings are of this arm"
                .to_owned(),
        );
    }
    if found.is_worse_than_data_sheet() {
        reasons.push(format!(
            "the data sheet fits these readings better than the model does ({:.3} against {:.3} mm RMS): the model is of another arm, or the arm \
             has changed since it was measured",
            found.nominal.rmse, found.model.rmse
        ));
    }
    if let Some(coverage) = found.coverage.filter(|coverage| coverage.share() < MIN_COVERAGE) {
        reasons.push(format!(
            "joint {} was tested over {:.0}° of the {:.0}° that the fit covers: nothing is known beyond",
            coverage.joint + 1,
            coverage.tested_deg,
            coverage.fitted_deg
        ));
    }
    if sensor == Sensor::Cable {
        reasons.push(
            "a cable measures errors only along itself: it can show that an arm does not meet a tolerance, but not that it does, since errors \
             across it may be larger; measure positions (tracker or camera) to accept the arm"
                .to_owned(),
        );
    }
    PageVerdict::new(status, headline, reasons)
}

/// Degrees of freedom below which it is said how the uncertainty becomes smaller: the coverage factor is above 2.28.
const FEW_FREEDOM: usize = 10;

/// How the uncertainty follows from repeated poses.
fn from_repeats(what: &str, scatter: Option<Scatter>) -> String {
    let Some(scatter) = scatter else { return String::new() };
    let more = if scatter.freedom < FEW_FREEDOM {
        "; so few repeated readings leave it large: repeat ten poses, or state it"
    } else {
        ""
    };
    format!(
        "{what} is {:.2} times the scatter of repeated poses (the factor of Student's t for 95.45 % at {} {}); it does not contain systematic \
         errors of the sensor{more}",
        scatter.coverage_factor(),
        scatter.freedom,
        degrees_of_freedom(scatter.freedom)
    )
}

fn degrees_of_freedom(count: usize) -> &'static str {
    if count == 1 { "degree of freedom" } else { "degrees of freedom" }
}

/// The coverage factor of an expanded uncertainty.
fn coverage_factor((expanded, uncertainty): (f64, Uncertainty), scatter: Option<Scatter>) -> Option<f64> {
    match uncertainty {
        Uncertainty::Unknown => None,
        Uncertainty::Stated => Some(2.0),
        Uncertainty::Repeats | Uncertainty::AboveStated => scatter.map(|scatter| expanded / scatter.sigma),
    }
}

/// Digits after the point that show a length (mm): three, or two significant ones where it is smaller.
fn digits(mm: f64) -> usize {
    if mm.abs() < 0.001 && mm != 0.0 { (1.0 - mm.abs().log10().floor()).min(9.0) as usize } else { 3 }
}

/// A length (mm) with as many digits as show it.
fn length(mm: f64) -> String {
    format!("{mm:.*}", digits(mm))
}

/// That small stations show nothing of the arm.
fn uncounted(left: Uncounted) -> String {
    let Uncounted { rows, stations, of_stations } = left;
    let whole = match stations {
        0 => String::new(),
        stations => format!(", all those of {stations} of the {of_stations} stations among them"),
    };
    format!(
        "{rows} rows do not count{whole}: their stations have so few poses that the fitted frame of the station absorbs an error of the arm; \
         measure at least 10 poses from each station"
    )
}

/// What the poses show of the arm.
fn tested(found: &Acceptance) -> String {
    let tested = &found.tested;
    let [x, y, z] = tested.volume_mm;
    let volume = format!(
        "tested: a volume of {x:.0} × {y:.0} × {z:.0} mm; errors of the links show {:.0} % as strongly in these poses as in the poses of the fit, \
         placement excluded",
        100.0 * tested.share
    );
    if tested.is_enough() {
        return volume;
    }
    format!(
        "{volume}, where at least {:.0} % are required: measure at least {MIN_POSES} poses all over the volume in which the arm works, \
         with different orientations",
        100.0 * MIN_SHARE
    )
}

/// The decision, stated for the quantity that decides, or for both if both pass.
fn headline(found: &Acceptance) -> (Status, String) {
    let overall = found.overall();
    let by_orientation = found.orientation.as_ref().map_or(Decision::NotEvaluated, |turns| turns.decision);
    if found.orientation_asked && overall == by_orientation && overall != found.decision {
        return orientation_headline(found);
    }
    let [max, limit, u] = [found.model.max, found.tolerance_mm, found.uncertainty_mm].map(length);
    match overall {
        Decision::Accepted => {
            let turn =
                found.orientation.as_ref().and_then(|turns| Some((turns.model.max, turns.tolerance_rad?)));
            let turn = turn.map_or_else(String::new, |(max, limit)| {
                let [max, limit] = [max, limit].map(f64::to_degrees);
                format!("; largest orientation error {max:.4}°, tolerance {limit:.4}°")
            });
            let [x, y, z] = found.tested.volume_mm;
            let placement =
                if found.is_registered { ", apart from the placement of base and flange" } else { "" };
            let place = format!("Accepted: largest error {max} mm, tolerance {limit} mm");
            (Status::Good, format!("{place}{turn}; over {x:.0} × {y:.0} × {z:.0} mm{placement}"))
        }
        Decision::Refused => {
            (Status::Bad, format!("Not accepted: largest error {max} mm, tolerance {limit} mm"))
        }
        Decision::Open if found.decision == Decision::Accepted && !found.tested.is_enough() => (
            Status::Warning,
            format!(
                "Not decided: largest error {max} mm, tolerance {limit} mm, but the poses show only a small part of the arm"
            ),
        ),
        Decision::Open if found.decision == Decision::Accepted && !found.is_worse_than_data_sheet() => (
            Status::Warning,
            format!(
                "Not decided: largest error along the cable {max} mm, tolerance {limit} mm, but the error across it is not known"
            ),
        ),
        Decision::Open if found.decision == Decision::Accepted => (
            Status::Warning,
            format!(
                "Not decided: largest error {max} mm, tolerance {limit} mm, but the model is worse than the data sheet"
            ),
        ),
        Decision::Open if found.uncertainty == Uncertainty::Unknown => (
            Status::Warning,
            format!(
                "Not decided: largest error {max} mm, tolerance {limit} mm, but the sensor uncertainty is unknown"
            ),
        ),
        Decision::Open => (
            Status::Warning,
            format!(
                "Not decided: the largest error {max} mm is within the sensor uncertainty {u} mm of the tolerance {limit} mm"
            ),
        ),
        Decision::NotEvaluated => (
            Status::NotEvaluated,
            format!("{} poses are too few: at least {MIN_POSES} are required", found.poses),
        ),
    }
}

/// The decision on the orientation.
fn orientation_headline(found: &Acceptance) -> (Status, String) {
    let Some((turns, limit)) =
        found.orientation.as_ref().and_then(|turns| Some((turns, turns.tolerance_rad?)))
    else {
        let headline = "A tolerance of the orientation was stated, but the sensor does not measure it";
        return (Status::NotEvaluated, headline.to_owned());
    };
    let [max, limit, u] = [turns.model.max, limit, turns.uncertainty_rad].map(f64::to_degrees);
    match turns.decision {
        Decision::Refused => {
            (Status::Bad, format!("Not accepted: largest orientation error {max:.4}°, tolerance {limit:.4}°"))
        }
        _ if turns.uncertainty == Uncertainty::Unknown => (
            Status::Warning,
            format!(
                "Not decided: largest orientation error {max:.4}°, tolerance {limit:.4}°, but the sensor uncertainty of orientations is unknown"
            ),
        ),
        _ => (
            Status::Warning,
            format!(
                "Not decided: the largest orientation error {max:.4}° is within the sensor uncertainty {u:.4}° of the tolerance {limit:.4}°"
            ),
        ),
    }
}

/// Reservation on the decision about the orientation.
fn orientation_reason(found: &Acceptance) -> Option<String> {
    let turns = found.orientation.as_ref()?;
    turns.tolerance_rad?;
    match turns.uncertainty {
        Uncertainty::Stated => None,
        Uncertainty::AboveStated => Some(format!(
            "repeated poses scatter more than the stated orientation uncertainty allows: that of their scatter, {:.4}°, is used instead",
            turns.uncertainty_rad.to_degrees()
        )),
        Uncertainty::Repeats => Some(from_repeats("the orientation uncertainty", turns.scatter)),
        Uncertainty::Unknown => Some(
            "the orientation uncertainty is unknown, so nothing can be accepted: state it (--sensor-uncertainty-angle), or repeat some poses"
                .to_owned(),
        ),
    }
}

/// What the uncertainty is expanded by.
fn expanded(found: &Acceptance) -> String {
    match (coverage_factor((found.uncertainty_mm, found.uncertainty), found.scatter), found.scatter) {
        (Some(factor), Some(scatter)) if found.uncertainty != Uncertainty::Stated => {
            format!("expanded, k = {factor:.2} ({} {})", scatter.freedom, degrees_of_freedom(scatter.freedom))
        }
        _ => "expanded, k = 2".to_owned(),
    }
}

fn figures(found: &Acceptance) -> Vec<KeyFigure> {
    let share = 100.0 * (1.0 - found.model.rmse / found.nominal.rmse);
    let change = if share < 0.0 { "more" } else { "less" };
    let uncertainty = Some(found.uncertainty_mm).filter(|_| found.uncertainty != Uncertainty::Unknown);
    vec![
        KeyFigure::new("Largest error", found.model.max, digits(found.model.max), "mm")
            .note(format!("nominal arm: {} mm", length(found.nominal.max))),
        KeyFigure::new("RMS error", found.model.rmse, digits(found.model.rmse), "mm").note(format!(
            "nominal arm: {} mm ({:.0} % {change} now)",
            length(found.nominal.rmse),
            share.abs()
        )),
        KeyFigure::new("Tolerance", found.tolerance_mm, digits(found.tolerance_mm), "mm"),
        KeyFigure::new("Uncertainty of the sensor", uncertainty, digits(found.uncertainty_mm), "mm")
            .note(expanded(found)),
        KeyFigure::new("Poses", found.poses, 0, "").note("that the model was not fitted to"),
    ]
}

/// The figures of both arms; a signed mean if the sensor has a sign.
pub fn table(found: &Acceptance, sensor: Sensor) -> Table {
    let signed = sensor == Sensor::Cable;
    let arms = [("data sheet, sensor registered", &found.nominal), ("estimated", &found.model)];
    let all =
        |of: fn(&ErrorSummary) -> f64| arms.iter().map(|(_, errors)| digits(of(errors))).max().unwrap_or(3);
    Table::of("Errors", &arms.map(|(arm, errors)| (arm, errors, Some(errors.mean).filter(|_| signed))))
        .text("arm", "Arm", |(arm, ..)| *arm)
        .number("rmse_mm", "RMSE", "mm", all(|errors| errors.rmse), |(_, errors, _)| errors.rmse)
        .number("mean_absolute_mm", "mean |e|", "mm", all(|errors| errors.mean_absolute), |(_, errors, _)| {
            errors.mean_absolute
        })
        .number(
            "standard_deviation_mm",
            "SD",
            "mm",
            all(|errors| errors.standard_deviation),
            |(_, errors, _)| errors.standard_deviation,
        )
        .number("max_mm", "max", "mm", all(|errors| errors.max), |(_, errors, _)| errors.max)
        .number("mean_mm", "signed mean", "mm", all(|errors| errors.mean), |(.., mean)| *mean)
        .table()
}

/// Orientation errors and the decision on them.
pub fn orientation_table(found: &Acceptance) -> Table {
    let mut table = Table::new(
        "Orientation",
        vec![
            Column::text("arm", "Arm"),
            Column::number("mean_deg", "mean", "°", 4),
            Column::number("standard_deviation_deg", "SD", "°", 4),
            Column::number("max_deg", "max", "°", 4),
            Column::number("max_mrad", "max", "mrad", 3),
            Column::number("tolerance_deg", "Tolerance", "°", 4),
            Column::text("remark", "Remark"),
        ],
    );
    let Some(turns) = &found.orientation else {
        let mut row = vec![Cell::from("estimated")];
        row.extend((0..5).map(|_| Cell::Missing));
        row.push("not evaluated: the sensor does not measure the orientation".into());
        table.push(row);
        return table;
    };
    let remark = match (turns.tolerance_rad, turns.decision) {
        (None, _) => "not evaluated: no tolerance was stated (--tolerance-angle)".to_owned(),
        (_, Decision::NotEvaluated) => {
            format!("not evaluated: {} poses, at least {MIN_POSES} are required", found.poses)
        }
        (_, decision) => word(decision).to_owned(),
    };
    let limit = turns.tolerance_rad.map(f64::to_degrees);
    for (name, errors, limit, remark) in [
        ("data sheet, sensor registered", &turns.nominal, None, ""),
        ("estimated", &turns.model, limit, remark.as_str()),
    ] {
        table.push([
            name.into(),
            errors.mean.to_degrees().into(),
            errors.standard_deviation.to_degrees().into(),
            errors.max.to_degrees().into(),
            (1e3 * errors.max).into(),
            limit.into(),
            remark.into(),
        ]);
    }
    table
}

fn word(decision: Decision) -> &'static str {
    match decision {
        Decision::Accepted => "accepted",
        Decision::Refused => "not accepted",
        Decision::Open => "not decided",
        Decision::NotEvaluated => "not evaluated",
    }
}

/// The error of each row.
pub fn row_table(found: &Acceptance) -> Table {
    let mut columns = vec![Column::count("row", "Row"), Column::number("error_mm", "Error", "mm", 4)];
    if found.orientation.is_some() {
        columns.push(Column::number("error_deg", "Orientation", "°", 5));
    }
    let mut table = Table::new("Rows", columns);
    let mut turns = found.orientation.iter().flat_map(|turns| &turns.errors_rad);
    for &(row, error) in &found.errors_mm {
        let turn = turns.next().map(|(_, rad)| Cell::from(rad.to_degrees()));
        table.push([row.into(), error.into()].into_iter().chain(turn));
    }
    table
}

/// Accuracy and repeatability of poses and paths (ISO 9283), or why they are missing.
fn iso(found: &Acceptance, dataset: &Dataset) -> Table {
    let mut table = Table::new(
        "ISO 9283",
        vec![
            Column::text("figure", "Figure"),
            Column::number("value_mm", "Largest over poses or path", "mm", 4),
            Column::text("remark", "Remark"),
        ],
    );
    let missing = || match dataset.sensor {
        Sensor::Cable => NO_POSITION.to_owned(),
        _ => format!(
            "not evaluated: {ISO_CYCLES} cycles at {ISO_POSES} poses are required, at most {} were measured at one pose",
            found.most_cycles
        ),
    };
    let remark = match &found.cycles {
        Some(cycles) => format!("{} poses, at least {} cycles", cycles.poses, cycles.cycles),
        None => missing(),
    };
    let [accuracy, repeatability] = match &found.cycles {
        Some(cycles) => [Cell::from(cycles.accuracy_mm), Cell::from(cycles.repeatability_mm)],
        None => [Cell::Missing, Cell::Missing],
    };
    table.push(["pose accuracy AP, under the model".into(), accuracy, remark.as_str().into()]);
    table.push(["pose repeatability RP".into(), repeatability, remark.as_str().into()]);
    if found.paths.is_empty() {
        let remark = if dataset.sensor == Sensor::Cable { NO_POSITION.to_owned() } else { no_path() };
        for figure in ["path accuracy AT, under the model", "path repeatability RT"] {
            table.push([figure.into(), Cell::Missing, remark.as_str().into()]);
        }
    }
    found.paths.iter().for_each(|path| iso_of_path(path, &mut table));
    table
}

const NO_POSITION: &str = "not evaluated: a cable does not measure positions";

fn no_path() -> String {
    format!(
        "not evaluated: no path was measured (columns path, cycle and sample; {PATH_CYCLES} cycles of at least {PATH_POINTS} sampling \
         points)"
    )
}

/// Path accuracy and repeatability of one path, or why they are missing.
fn iso_of_path(found: &PathFound, table: &mut Table) {
    let PathFound { path, cycles, points, .. } = found;
    let left_out = match found.left_out {
        0 => String::new(),
        count => format!(", {count} points omitted that some cycle lacks"),
    };
    let what = format!("path {path}: {cycles} cycles, {points} sampling points{left_out}");
    let remark = if *points < PATH_POINTS {
        format!("not evaluated: at least {PATH_POINTS} sampling points are required ({what})")
    } else if *cycles < PATH_CYCLES {
        format!("not evaluated: {PATH_CYCLES} cycles are required ({what})")
    } else {
        what
    };
    let accuracy = found.accuracy_mm();
    if let Some(deviation) = found.deviation_mm.filter(|_| accuracy.is_none()) {
        let remark = format!("path {path}: mean of {cycles} cycles");
        table.push(["largest deviation of the path".into(), deviation.into(), remark.into()]);
    }
    table.push(["path accuracy AT, under the model".into(), accuracy.into(), remark.as_str().into()]);
    table.push(["path repeatability RT".into(), found.repeatability_mm.into(), remark.as_str().into()]);
}

fn conditions(found: &Acceptance, estimated: &Estimated) -> Table {
    let condition = &estimated.condition;
    let quantities = [
        ("time (warm-up)", "h", condition.time_h),
        ("temperature", "°C", condition.temperature_c),
        ("payload", "kg", condition.payload_kg),
    ];
    Table::of("", quantities.into_iter().zip(found.conditions))
        .text("quantity", "Quantity", |((name, ..), _)| *name)
        .text("unit", "Unit", |((_, unit, _), _)| *unit)
        .significant("least", "From", "", 4, |(_, range)| range.map(|range| range[0]))
        .significant("most", "To", "", 4, |(_, range)| range.map(|range| range[1]))
        .significant("model", "Of the model (median)", "", 4, |((.., model), _)| *model)
        .note("–: not logged; what the model depends on is then taken as in its own rows.")
        .table()
}

fn method(found: &Acceptance, statement: &Statement) -> Vec<String> {
    let frames = if statement.frames_stated {
        "The sensor frame was stated: nothing was fitted to these rows.".to_owned()
    } else {
        "Sensor frame and target were fitted in five folds: each row is judged with a frame fitted without its pose. Errors common to \
         all readings (the position of the robot) are not judged."
            .to_owned()
    };
    let uncertainty = match found.uncertainty {
        Uncertainty::Unknown => "unknown, so nothing is accepted".to_owned(),
        _ => format!("{} mm", length(found.uncertainty_mm)),
    };
    let rule = format!(
        "Decision rule of ISO 14253-1: accepted if the largest error plus the uncertainty ({uncertainty}) is within the tolerance, not \
         accepted if the largest error exceeds the tolerance by more than the uncertainty, otherwise not decided."
    );
    let mut method = vec![frames, rule];
    if !found.paths.is_empty() {
        method.push(
            "Rows measured on a path are used only for path accuracy and repeatability, in planes normal to the path at each sampling point. The \
             commanded path is the path of the model at the logged joints."
                .to_owned(),
        );
    }
    if let Some(turns) = found.orientation.as_ref().filter(|turns| turns.tolerance_rad.is_some()) {
        method.push(format!(
            "The orientation is judged by the same rule at the same poses ({}); both must pass.",
            match turns.uncertainty {
                Uncertainty::Unknown => "its uncertainty is unknown".to_owned(),
                _ => format!("uncertainty {:.4}°", turns.uncertainty_rad.to_degrees()),
            }
        ));
    }
    method
}

fn axis(sensor: Sensor) -> Axis {
    Axis::new(if sensor == Sensor::Cable { "error, measured minus predicted" } else { "error" }, "mm")
}

fn frequency(found: &Acceptance, sensor: Sensor) -> String {
    let errors: Vec<f64> = found.errors_mm.iter().map(|row| row.1).collect();
    let samples = vec![Sample::new("estimated arm", errors).ink(Ink::Blue)];
    Histogram { title: "Errors".to_owned(), x: axis(sensor), samples, bins: None }.svg()
}

fn by_row(found: &Acceptance, sensor: Sensor) -> String {
    let points: Vec<[f64; 2]> = found.errors_mm.iter().map(|row| [row.0 as f64, row.1]).collect();
    let limit = |mm: f64| Reference::Horizontal(mm, "tolerance".to_owned());
    let mut references = vec![limit(found.tolerance_mm)];
    if sensor == Sensor::Cable {
        references.push(limit(-found.tolerance_mm));
    }
    Graph {
        title: "Errors by row".to_owned(),
        x: Axis::new("row of the file", ""),
        y: axis(sensor),
        series: vec![Series::points("estimated arm", points).ink(Ink::Blue)],
        references,
        ..Graph::default()
    }
    .svg()
}

fn turns_by_row(turns: &Orientation) -> String {
    let points: Vec<[f64; 2]> =
        turns.errors_rad.iter().map(|row| [row.0 as f64, row.1.to_degrees()]).collect();
    let limit = |rad: f64| Reference::Horizontal(rad.to_degrees(), "tolerance".to_owned());
    Graph {
        title: "Errors of the orientation by row".to_owned(),
        x: Axis::new("row of the file", ""),
        y: Axis::new("orientation error", "°"),
        series: vec![Series::points("estimated arm", points).ink(Ink::Blue)],
        references: turns.tolerance_rad.map(limit).into_iter().collect(),
        ..Graph::default()
    }
    .svg()
}

fn provenance(dataset: &Dataset, estimated: &Estimated, statement: &Statement) -> Provenance {
    let mut page = Provenance { seed: Some(statement.seed), ..Provenance::here() };
    let rows = Some(dataset.rows.len());
    page.sources.push(Source::new(&dataset.file, "Measurements", &dataset.sha256, rows));
    page.sources.extend(statement.model.iter().map(|(name, hash)| Source::new(name, "Model", hash, None)));
    let from = &estimated.provenance;
    let role = "Measurements to which the model was fitted";
    page.sources.push(Source::new(&from.file, role, &from.sha256, Some(from.rows)));
    page.remarks.push(("Robot".to_owned(), estimated.robot.clone()));
    page.remarks.extend(statement.serials.iter().cloned());
    page
}

/// JSON report, schema `truegrind.acceptance/1`.
pub fn json(found: &Acceptance, dataset: &Dataset, estimated: &Estimated, statement: &Statement) -> Value {
    let known = |uncertainty: Uncertainty| match uncertainty {
        Uncertainty::Stated => "stated",
        Uncertainty::AboveStated => "repeated poses, larger than stated",
        Uncertainty::Repeats => "repeated poses",
        Uncertainty::Unknown => "unknown",
    };
    let uncertainty = known(found.uncertainty);
    let orientation = found.orientation.as_ref().map(|turns| {
        let expanded = turns.uncertainty_rad.to_degrees();
        let degrees = |errors: &ErrorSummary| {
            json!({
                "rmse_deg": errors.rmse.to_degrees(), "mean_deg": errors.mean.to_degrees(), "max_deg": errors.max.to_degrees(),
                "standard_deviation_deg": errors.standard_deviation.to_degrees(),
            })
        };
        json!({
            "decision": word(turns.decision),
            "tolerance_deg": turns.tolerance_rad.map(f64::to_degrees),
            "uncertainty": {
                "expanded_deg": (turns.uncertainty != Uncertainty::Unknown).then_some(expanded), "from": known(turns.uncertainty),
                "coverage_factor": coverage_factor((turns.uncertainty_rad, turns.uncertainty), turns.scatter),
                "degrees_of_freedom": turns.scatter.map(|scatter| scatter.freedom),
            },
            "nominal": degrees(&turns.nominal),
            "model": degrees(&turns.model),
            "errors": turns.errors_rad.iter().map(|(row, rad)| json!({ "row": row, "error_deg": rad.to_degrees() })).collect::<Vec<_>>(),
        })
    });
    let [time_h, temperature_c, payload_kg] = found.conditions;
    let serials: serde_json::Map<String, Value> =
        statement.serials.iter().map(|(name, text)| (name.clone(), json!(text))).collect();
    json!({
        "schema": "truegrind.acceptance/1",
        "robot": estimated.robot,
        "decision": word(found.overall()),
        "tolerance_mm": found.tolerance_mm,
        "uncertainty": {
            "expanded_mm": (found.uncertainty != Uncertainty::Unknown).then_some(found.uncertainty_mm), "from": uncertainty,
            "coverage_factor": coverage_factor((found.uncertainty_mm, found.uncertainty), found.scatter),
            "degrees_of_freedom": found.scatter.map(|scatter| scatter.freedom),
        },
        "poses": found.poses,
        "uncounted": found.uncounted.map(|left| json!({
            "rows": left.rows, "stations": left.stations, "of_stations": left.of_stations,
        })),
        "coverage": found.coverage.map(|c| json!({
            "joint": c.joint + 1, "tested_deg": c.tested_deg, "fitted_deg": c.fitted_deg,
        })),
        "tested": { "volume_mm": found.tested.volume_mm, "share": found.tested.share },
        "rows": found.rows,
        "nominal": found.nominal,
        "model": found.model,
        "orientation": orientation,
        "iso_9283": found.cycles.map(|cycles| json!({
            "poses": cycles.poses, "cycles": cycles.cycles, "ap_mm": cycles.accuracy_mm, "rp_mm": cycles.repeatability_mm,
        })),
        "iso_9283_paths": found.paths.iter().map(|path| json!({
            "path": path.path, "cycles": path.cycles, "points": path.points, "points_left_out": path.left_out,
            "deviation_mm": path.deviation_mm, "at_mm": path.accuracy_mm(), "rt_mm": path.repeatability_mm,
        })).collect::<Vec<_>>(),
        "conditions": { "time_h": time_h, "temperature_c": temperature_c, "payload_kg": payload_kg },
        "serials": serials,
        "measurements": { "file": dataset.file, "sha256": dataset.sha256 },
        "model_file": statement.model.as_ref().map(|(name, hash)| json!({ "file": name, "sha256": hash })),
        "fitted_to": { "file": estimated.provenance.file, "sha256": estimated.provenance.sha256 },
        "frames_stated": statement.frames_stated,
        "seed": statement.seed,
        "errors": found.errors_mm.iter().map(|(row, mm)| json!({ "row": row, "error_mm": mm })).collect::<Vec<_>>(),
    })
}
