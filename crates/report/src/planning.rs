//! Report on a measurement plan: rows to measure, predicted uncertainties, detectable effects.

use serde_json::{Value, json};

use super::document::{Block, Document, KeyFigure, PageVerdict};
use super::status::Status;
use super::table::{Cell, Column, Table};
use truegrind_arm::parameter::Parameter;
use truegrind_calibration::diagnosis::cause_kind::CauseKind;
use truegrind_calibration::measurement::dataset::Reading;
use truegrind_math::sentence::listed;
use truegrind_planning::poses::field::FieldUncertainty;
use truegrind_planning::poses::parting::{DECIDES, Parting};
use truegrind_planning::poses::power::Detectability;
use truegrind_planning::poses::program::{checked, reading, unchecked};
use truegrind_planning::poses::questions::CandidateCause;
use truegrind_planning::poses::schedule::{FIRST_ROW, Purpose};
use truegrind_planning::poses::{MeasurementSetup, Plan};

/// Rows on a page; all are in the CSV file.
const ROWS_ON_PAGE: usize = 600;

/// One row per reading. As CSV it is the log to fill in: joint angles, approach directions and time under the column names that
/// `identify` reads, and the expected reading of the nominal arm.
pub fn table(plan: &Plan, setup: &MeasurementSetup<'_>) -> Table {
    let mut columns =
        vec![Column::count("row", "Row"), Column::count("pose", "Pose"), Column::text("purpose", "Purpose")];
    columns.extend((1..=6).map(|j| Column::number(format!("q{j}"), format!("q{j}"), "°", 3)));
    columns.extend((1..=6).map(|j| Column::number(format!("approach{j}"), format!("side {j}"), "", 0)));
    columns.push(Column::number("t", "Time", "h", 3));
    let expected: &[&str] = match plan_reading(plan, setup) {
        Some(Reading::Cable(_)) => &["expected_L"],
        _ => &["expected_x", "expected_y", "expected_z"],
    };
    columns.extend(expected.iter().map(|key| {
        Column::number(*key, format!("expected {}", key.trim_start_matches("expected_")), "mm", 1)
    }));
    let cables = plan.poses.iter().any(|pose| pose.anchor > 0);
    if cables {
        columns.push(Column::count("anchor", "Cable"));
    }
    columns.push(Column::text("note", "Note"));
    let mut table = Table::new("Rows to measure", columns);
    for (number, row) in (FIRST_ROW..).zip(&plan.rows) {
        let pose = &plan.poses[row.pose];
        let mut cells: Vec<Cell> = vec![number.into(), (row.pose + 1).into(), row.purpose.label().into()];
        cells.extend(pose.joints.iter().map(|q| Cell::from(q.to_degrees())));
        cells.extend(row.approach.iter().map(|side| Cell::from(f64::from(*side))));
        cells.push(row.time_h.into());
        match reading(plan, setup, row) {
            Some(Reading::Cable(length)) => cells.push(length.into()),
            Some(Reading::Position(p)) => cells.extend(p.iter().map(|v| Cell::from(*v))),
            Some(Reading::Pose(p)) => cells.extend(p.translation.vector.iter().map(|v| Cell::from(*v))),
            None => cells.extend(expected.iter().map(|_| Cell::Missing)),
        }
        if cables {
            cells.push((pose.anchor).into());
        }
        cells.push(if row.cable_unclear {
            "unhook the cable before this pose".into()
        } else {
            Cell::Missing
        });
        table.push(cells);
    }
    table
}

fn plan_reading(plan: &Plan, setup: &MeasurementSetup<'_>) -> Option<Reading> {
    plan.rows.first().and_then(|row| reading(plan, setup, row))
}

/// Every effect with its smallest detectable size.
pub fn effect_table(plan: &Plan) -> Table {
    Table::of("Detectable effects", &plan.detectability)
        .text("effect", "Effect", |found| found.effect.as_str())
        .text("which", "Which", |found| found.which.as_str())
        .significant("smallest", "Smallest size", "", 2, |found| found.smallest)
        .text("unit", "Unit", |found| found.unit)
        .significant("shows", "Shows as", "", 2, |found| found.shows)
        .text("shows_unit", "Unit", |found| found.shows_unit)
        .significant("usual", "Usual size", "", 2, |found| found.usual)
        .text("decided", "Detectable", |found| judged(found))
.note("Smallest size: size at which the non-centrality, with geometry and frames free, reaches --decisive in the worst phase or \
         direction. Shows as: its largest effect in a joint or at the sensor. Usual size: a small practical value in the same \
         unit. Shifts are assumed in the middle of the run; a shift near its end must be larger. At its smallest size an effect is reported in \
         about three of four measurements with a tracker, and in about half with one cable, by its own name or as one of several that look alike in \
         these poses; to be identified it may have to be twice as large, and more where another effect looks alike: with one cable, a compliance or \
         a gear ratio at twice the size was identified in 3 of 24.")
.table()
}

fn judged(found: &Detectability) -> Cell {
    if found.shows.is_none() {
        Cell::Judged(Status::Bad, "at no size".to_owned())
    } else if found.is_decided() {
        Cell::Judged(Status::Good, "yes".to_owned())
    } else {
        Cell::Judged(Status::Warning, "only if larger than usual".to_owned())
    }
}

/// Predicted standard deviation of every parameter.
pub fn sigma_table(plan: &Plan) -> Table {
    Table::of("Predicted uncertainty of every parameter", plan.parameters.iter().zip(&plan.sigmas))
        .text("parameter", "Parameter", |(parameter, _)| parameter.to_string())
        .significant("sigma", "Predicted 1σ", "", 2, |(parameter, sigma)| {
            if parameter.is_angle() { sigma.to_degrees() } else { **sigma }
        })
        .text("unit", "Unit", |(parameter, _)| if parameter.is_angle() { "°" } else { "mm" })
        .note(
            "Including the prior tolerances of arm and frames. Unidentifiable parameters keep their tolerance.",
        )
        .table()
}

fn rows_of(plan: &Plan, purpose: Purpose) -> usize {
    plan.rows.iter().filter(|row| row.purpose == purpose).count()
}

/// The number of different poses.
fn poses(plan: &Plan) -> String {
    match plan.poses.len() {
        1 => "1 pose".to_owned(),
        many => format!("{many} poses"),
    }
}

fn verdict(plan: &Plan, setup: &MeasurementSetup<'_>) -> PageVerdict {
    let minutes = plan.rows.last().map_or(0.0, |row| 60.0 * row.time_h);
    let mut reasons = vec![
        format!(
            "what to do: run the program slowly first, then take one reading at each of the {} rows in order (about \
             {minutes:.0} min)",
            plan.rows.len()
        ),
        "poses stay within joint limits and clear of singularities".to_owned(),
    ];
    reasons.push(format!(
        "{} rows at {}: {} with opposite approach direction, {} repeated, {} for warm-up",
        plan.rows.len(),
        poses(plan),
        rows_of(plan, Purpose::OtherSide),
        rows_of(plan, Purpose::Repeat),
        rows_of(plan, Purpose::WarmUp)
    ));
    let quality = &plan.quality;
    if plan.geometry {
        reasons.push(format!(
            "predicted 1σ of a reading at any other pose (a length, or each coordinate, as for --sigma): {:.3} mm after one visit to each pose, \
             {:.3} mm after as many random poses; it is the uncertainty of the link geometry alone: effects that the model does not contain come \
             on top",
            quality.reading_sigma_mm, quality.random_reading_sigma_mm
        ));
    }
    if let Some(field) = &plan.field {
        reasons.push(format!(
            "uncertainty (1σ) of the unexplained error at any other pose: {:.3} mm now, {:.3} mm after these poses, {:.3} mm after as many random \
             ones",
            field.before_mm, field.after_mm, field.random_mm
        ));
        reasons.extend(tells_little(field, plan.poses.len()));
    }
    reasons.extend(plan.partings.iter().map(|parting| parted(parting, plan)));
    let undecided: Vec<&Detectability> = plan.detectability.iter().filter(|d| !d.is_decided()).collect();
    if !undecided.is_empty() {
        let names: Vec<String> =
            undecided.iter().take(6).map(|d| format!("{} ({})", d.effect, d.which)).collect();
        let more = undecided.len().saturating_sub(names.len());
        let tail = if more > 0 { format!(" and {more} more") } else { String::new() };
        reasons.push(format!("not detectable at the usual size: {}{tail}", names.join(", ")));
    }
    reasons.extend(blind_about_last_joint(&undecided, setup));
    reasons.push(format!("checked: {}; not checked: {}", checked(plan), unchecked(plan, setup.sensor)));
    let rough = plan.rows.iter().filter(|row| row.cable_unclear).count();
    if rough > 0 {
        reasons.insert(
            1,
            format!("the cable must be unhooked between poses {rough} times; the comments of the program (-o) and the table of rows (--csv, --html) show where"),
        );
    }
    let (status, headline) = match rough {
        0 => (
            Status::Good,
            "The program may run: links and target stay clear of the stated obstacles and of the arm itself",
        ),
        _ => (Status::Warning, "The program may run if the cable is unhooked between some poses"),
    };
    PageVerdict::new(status, headline, reasons)
}

/// Whether the rows will decide between a finding and its rivals, and what would.
fn parted(parting: &Parting, plan: &Plan) -> String {
    let [one, other] = parting.alike.each_ref().map(named);
    let begin = format!(
        "{} is in question: these rows separate the two causes that are most alike, {one} and {other}, with λ = {:.0}, where {DECIDES:.0} decide",
        named(&parting.finding),
        parting.lambda
    );
    let others = match parting.not_computed.as_slice() {
        [] => String::new(),
        kinds => {
            let kinds: Vec<&str> = kinds.iter().map(|kind| kind.as_str()).collect();
            format!(" (not computed: {})", kinds.join(", "))
        }
    };
    if parting.decides() {
        return format!("{begin}: they will probably decide{others}");
    }
    let mut remedies = Vec::new();
    if let Some(load) = parting.with_load.filter(|load| load.lambda > MORE * parting.lambda) {
        let enough = if load.lambda < DECIDES { ", which is not enough alone" } else { "" };
        remedies.push(format!(
            "a load of {} kg on the flange in every second row, logged in the column payload, would give λ = {:.0}{enough}",
            load.kg, load.lambda
        ));
    }
    let times = parting.times_as_many();
    if times < MOST_TIMES {
        let poses = (times * plan.poses.len() as f64).ceil();
        remedies.push(format!("{times:.1} times as many poses would decide (--poses {poses:.0})"));
    }
    if parting.alone < DECIDES {
        remedies
            .push(format!("the effect itself shows with λ = {:.0} only: a less noisy sensor", parting.alone));
    }
    remedies.push("another place of the sensor or of the target may separate them too".to_owned());
    format!("{begin}: they will probably not decide{others}. What would: {}", remedies.join("; "))
}

/// Times the poses up to which more of them are a remedy.
const MOST_TIMES: f64 = 4.0;

/// Gain of λ from which a load is a remedy.
const MORE: f64 = 1.5;

/// A cause with its joints.
fn named(cause: &CandidateCause) -> String {
    let joints: Vec<String> = cause.joints.iter().map(|joint| (joint + 1).to_string()).collect();
    let is_link = matches!(cause.effect, CauseKind::LinkBending | CauseKind::LinkTwist);
    let part = if is_link { "link" } else { "joint" };
    match joints.as_slice() {
        [] => cause.effect.as_str().to_owned(),
        [one] => format!("{} of {part} {one}", cause.effect),
        several => format!("{} of {part}s {}", cause.effect, listed(several)),
    }
}

/// How far the rows part each finding in question and its rivals.
pub fn parting_table(plan: &Plan) -> Table {
    Table::of("Findings in question", &plan.partings)
        .text("finding", "Finding", |parting| named(&parting.finding))
        .text("alike", "Most alike", |parting| parting.alike.each_ref().map(named).join(" and "))
        .significant("lambda", "λ", "", 2, |parting| parting.lambda)
        .significant("lambda_alone", "λ without rivals", "", 2, |parting| parting.alone)
        .significant("lambda_with_load", "λ with a load", "", 2, |parting| {
            parting.with_load.map(|load| load.lambda)
        })
        .text("decides", "Will decide", |parting| {
            if parting.decides() {
                Cell::Judged(Status::Good, "probably".to_owned())
            } else {
                Cell::Judged(Status::Warning, "probably not".to_owned())
            }
        })
.note(format!(
        "λ: non-centrality with which these rows tell the two causes that are most alike from each other, at the size of the finding, geometry and \
         frames free; from {DECIDES:.0} on they probably decide. With a load: the rated one, on the flange in every second row."
    ))
.table()
}

/// Says that a target on the axis of joint 6 shows nothing of that joint.
fn blind_about_last_joint(undecided: &[&Detectability], setup: &MeasurementSetup<'_>) -> Option<String> {
    let target_mm = setup.frames.flange_from_target.translation.vector;
    let on_axis = setup.sensor.scalars() <= 3 && target_mm.xy().norm() < ON_AXIS_MM;
    let of_last = undecided.iter().any(|effect| effect.which.starts_with("joint 6"));
    (on_axis && of_last).then(|| {
        "joint 6 turns the target about itself, so that its errors do not show: mount the target beside the axis of joint 6 and state where \
         (--touched-point 40,0,60)"
            .to_owned()
    })
}

/// Distance from the axis of joint 6 below which a target shows nothing of it (mm).
const ON_AXIS_MM: f64 = 2.0;

/// Says that the poses tell little about an unexplained error, and how many would tell more.
fn tells_little(field: &FieldUncertainty, poses: usize) -> Option<String> {
    let (count, left_mm) = field.needed?;
    Some(if left_mm > 0.5 * field.before_mm {
        format!(
            "these poses show little, and so would more of them ({count}: {left_mm:.3} mm): the error varies over shorter distances \
             than poses can sample. Measure along the programs to be corrected instead"
        )
    } else {
        format!(
            "these {poses} poses show little: {count} poses would leave {left_mm:.3} mm (--poses {count})"
        )
    })
}

/// Summary for the terminal.
pub fn summary(plan: &Plan, setup: &MeasurementSetup<'_>, robot: &str) -> Document {
    let mut page = Document::new(format!("What to measure on {robot}"));
    page.push(verdict(plan, setup));
    push_partings(&mut page, plan);
    if plan.geometry {
        page.push(effect_table(plan));
    }
    page
}

fn push_partings(page: &mut Document, plan: &Plan) {
    if !plan.partings.is_empty() {
        page.push(parting_table(plan));
    }
}

/// The page.
pub fn document(plan: &Plan, setup: &MeasurementSetup<'_>, robot: &str) -> Document {
    let mut page = Document::new(format!("What to measure on {robot}"));
    page.push(verdict(plan, setup));
    page.push(key_figures(plan));
    page.paragraph("Obstacles in the cell are unknown to the planner: state them as boxes (--keep-out).");
    push_partings(&mut page, plan);
    if plan.geometry {
        page.push(effect_table(plan));
    }
    page.heading(2, "Rows");
    page.push(table(plan, setup).excerpt(ROWS_ON_PAGE));
    if plan.geometry {
        page.push(Block::Details {
            summary: "Parameters".to_owned(),
            blocks: vec![sigma_table(plan).into()],
        });
    }
    page
}

/// The plan at a glance: what it determines of the geometry, or of the unexplained error alone.
fn key_figures(plan: &Plan) -> Vec<KeyFigure> {
    let rows = KeyFigure::new("Rows", plan.rows.len(), 0, "").note(format!("at {}", poses(plan)));
    if !plan.geometry {
        let field = plan.field.iter().flat_map(|field| {
            [("Unexplained error, 1σ now", field.before_mm), ("After these poses", field.after_mm)]
                .map(|(name, mm)| KeyFigure::new(name, mm, 3, "mm").note("at any other pose"))
        });
        return std::iter::once(rows).chain(field).collect();
    }
    vec![
        rows,
        KeyFigure::new("Remaining uncertainty", plan.quality.reading_sigma_mm, 3, "mm")
            .note("predicted 1σ of a reading at any other pose: a length, or each coordinate; effects beyond geometry not included"),
        KeyFigure::new("With random poses", plan.quality.random_reading_sigma_mm, 3, "mm")
            .note(format!("for comparison, {}", poses(plan))),
        KeyFigure::new(
            "Detectable effects",
            plan.detectability.iter().filter(|d| d.is_decided()).count(),
            0,
            "",
        )
        .note(format!("of {}, at usual sizes", plan.detectability.len())),
    ]
}

/// JSON report, schema `truegrind.plan/1`.
pub fn json(plan: &Plan, setup: &MeasurementSetup<'_>, robot: &str) -> Value {
    let rows: Vec<Value> = plan
        .rows
        .iter()
        .enumerate()
        .map(|(number, row)| {
            let pose = &plan.poses[row.pose];
            json!({
                "row": number,
                "pose": row.pose,
                "purpose": row.purpose.label(),
                "joints_deg": pose.joints.iter().map(|q| q.to_degrees()).collect::<Vec<_>>(),
                "approach": row.approach,
                "anchor": pose.anchor,
                "t_h": row.time_h,
                "stops_deg": row.waypoints.iter().map(|q| q.map(f64::to_degrees).as_slice().to_vec()).collect::<Vec<_>>(),
                "expected": match reading(plan, setup, row) {
                    Some(Reading::Cable(length)) => json!(length),
                    Some(Reading::Position(p)) => json!([p.x, p.y, p.z]),
                    Some(Reading::Pose(p)) => {
                        json!([p.translation.x, p.translation.y, p.translation.z])
                    }
                    None => Value::Null,
                },
                "singularity": pose.singularity,
                "rough_way": row.cable_unclear,
            })
        })
        .collect();
    let effects: Vec<Value> = plan
        .detectability
        .iter()
        .map(|found| {
            json!({
                "effect": found.effect,
                "which": found.which,
                "joint": found.joint.map(|j| j + 1),
                "smallest": found.smallest,
                "unit": found.unit,
                "shows": found.shows,
                "shows_unit": found.shows_unit,
                "usual": found.usual,
                "decided": found.is_decided(),
            })
        })
        .collect();
    let cause = |cause: &CandidateCause| json!({ "effect": cause.effect, "joints": cause.joints.iter().map(|joint| joint + 1).collect::<Vec<_>>() });
    let partings: Vec<Value> = plan
        .partings
        .iter()
        .map(|parting| {
            json!({
                "finding": cause(&parting.finding),
                "alike": parting.alike.each_ref().map(cause),
                "lambda": parting.lambda,
                "lambda_alone": parting.alone,
                "with_load": parting.with_load.map(|load| json!({ "kg": load.kg, "lambda": load.lambda })),
                "needed": DECIDES,
                "decides": parting.decides(),
                "not_computed": parting.not_computed,
            })
        })
        .collect();
    let sigma = |(parameter, sigma): (&Parameter, &f64)| json!({ "name": parameter.to_string(), "sigma": sigma, "unit": parameter.unit() });
    json!({
        "schema": "truegrind.plan/1",
        "robot": robot,
        "findings_in_question": partings,
        "unexplained": plan.field.map(|field| json!({
            "before_mm": field.before_mm,
            "after_mm": field.after_mm,
            "random_mm": field.random_mm,
            "poses_to_halve": field.needed.filter(|(_, mm)| *mm <= 0.5 * field.before_mm).map(|(count, _)| count),
        })),
        "quality": {
            "log_det": plan.quality.log_det,
            "random_log_det": plan.quality.random_log_det,
            "reading_sigma_mm": plan.quality.reading_sigma_mm,
            "random_reading_sigma_mm": plan.quality.random_reading_sigma_mm,
        },
        "parameters": plan.parameters.iter().zip(&plan.sigmas).map(sigma).collect::<Vec<_>>(),
        "effects": effects,
        "rows": rows,
    })
}
