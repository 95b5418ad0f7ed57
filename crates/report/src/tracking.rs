//! Report on a track: processed poses, detected changes, current parameters.

use serde_json::{Value, json};

use super::document::{Block, Document, KeyFigure, PageVerdict, Provenance, Source};
use super::plot::{Axis, Graph, Reference, Series};
use super::status::Status;
use super::table::{Cell, Table};
use truegrind_arm::parameter::display_unit;
use truegrind_calibration::tracking::alarm::Mount;
use truegrind_calibration::tracking::gain::Gain;
use truegrind_calibration::tracking::state::ConsumedFile;
use truegrind_calibration::tracking::{Alarm, Departure, Tracker};
use truegrind_math::statistics::median;

/// Summary for the terminal.
pub fn summary(tracker: &Tracker, fresh: usize, alarms: &[Alarm], model: &str) -> Document {
    let mut page = Document::new("Track");
    page.subtitle = format!("{}, {} readings", tracker.robot(), tracker.state().sensor);
    head(&mut page, tracker, fresh, alarms, model);
    page
}

/// Whether a file is the CSV of [`table`] rather than a measurement.
pub fn is_table(csv: &[u8]) -> bool {
    csv.starts_with(b"parameter,unit,")
}

/// The page.
pub fn document(tracker: &Tracker, fresh: usize, alarms: &[Alarm], model: &str) -> Document {
    let mut page = summary(tracker, fresh, alarms, model);
    let earlier = tracker.state().alarms.len() - alarms.len().min(tracker.state().alarms.len());
    if earlier > 0 {
        page.heading(2, "Earlier changes");
        page.push(Block::List(tracker.state().alarms[..earlier].iter().map(ToString::to_string).collect()));
    }
    page.heading(2, "Innovations");
    let history = &tracker.state().history;
    let points: Vec<[f64; 2]> = history.iter().enumerate().map(|(i, s)| [i as f64 + 1.0, s.nis]).collect();
    page.figure(
        Graph {
            title: "Normalised innovations squared of the latest poses".to_owned(),
            x: Axis::new("pose, latest last", ""),
            y: Axis::log("NIS", ""),
            series: vec![Series::points("", points)],
            references: vec![Reference::Horizontal(tracker.state().sensor.scalars() as f64, "expected mean".to_owned())],
            ..Graph::default()
        }
        .svg(),
        "Normalised innovation squared of each pose. Its mean is near the line as long as arm, sensor and noise match the model.",
    );
    page.heading(2, "Current parameters");
    page.push(table(tracker));
    page.push(Provenance { sources: sources(tracker), ..Provenance::here() });
    page
}

/// The processed files.
fn sources(tracker: &Tracker) -> Vec<Source> {
    let of = |consumed: &ConsumedFile| Source::new(&consumed.file, "Measurements", "", Some(consumed.rows));
    tracker.state().consumed.iter().map(of).collect()
}

/// Verdict, key figures, and where the model is.
fn head(page: &mut Document, tracker: &Tracker, fresh: usize, alarms: &[Alarm], model: &str) {
    let state = tracker.state();
    let departure = tracker.departure();
    let departed = departure.as_ref().filter(|departure| departure.is_significant);
    let set_aside = tracker.latest_set_aside();
    let (mut status, mut headline) = headline(tracker, fresh, alarms, departure.as_ref());
    let gain = expected_gain(tracker, departure.as_ref()).filter(|_| status == Status::Good);
    if let Some(gain) = &gain {
        headline.push_str(&format!("; {}", gain_headline(gain)));
    }
    let mut reasons: Vec<String> = alarms.iter().map(ToString::to_string).collect();
    let earlier = departed.filter(|_| alarms.is_empty()).and_then(reported);
    reasons.extend(earlier.map(|alarm| format!("reported in an earlier run: {alarm}")));
    reasons.extend(departed.filter(|now| now.is_of_shape).map(departure_sentence));
    reasons.extend(departed.and_then(turn_sentence));
    reasons.extend(departed.and_then(|now| last_link_sentence(now, alarms)));
    reasons.extend(which_moved(alarms, departed));
    reasons.extend(set_aside.map(|[aside, all]| {
        format!(
            "{aside} of the latest {all} poses were set aside, since they fit neither the arm nor a detected change: the model written here is \
             that of the earlier poses"
        )
    }));
    if tracker.mostly_set_aside() {
        reasons.insert(
            0,
            format!(
                "{} of {} poses were set aside, since they fit neither the arm nor a detected change: the model follows the others \
                 only",
                state.outliers, state.poses
            ),
        );
        status = Status::Bad;
        headline.push_str("; too many poses do not fit");
    }
    if set_aside.is_some() || tracker.mostly_set_aside() {
        reasons.push(DO_NOT_FIT.to_owned());
    } else if status == Status::Warning {
        reasons.push(what_to_do(alarms, departed).to_owned());
    }
    reasons.extend(gain.as_ref().map(gain_sentence));
    reasons.extend(noise_sentences(tracker));
    page.push(PageVerdict::new(status, headline, reasons));
    page.push(key_figures(tracker, alarms.len(), departure.as_ref()));
    page.paragraph(format!("Model written: {model}"));
}

/// What programs would gain from the tracked model, though the arm did not change.
struct ExpectedGain {
    /// Error of programs corrected with the model in use and with the tracked one, over the measured region (mm).
    programs_mm: [f64; 2],
    /// What shows it.
    shown: Gain,
}

/// The distance of the models is the error of the one in use, as far as the tracked one is right.
fn expected_gain(tracker: &Tracker, departure: Option<&Departure>) -> Option<ExpectedGain> {
    let now = departure?;
    let shown = tracker.gain()?;
    Some(ExpectedGain { programs_mm: [now.rms_mm.hypot(now.tracked_mm), now.tracked_mm], shown })
}

fn gain_headline(gain: &ExpectedGain) -> String {
    let [in_use_mm, tracked_mm] = gain.programs_mm;
    format!(
        "corrected again with the tracked model they would be off by {tracked_mm:.3} instead of {in_use_mm:.3} mm"
    )
}

fn gain_sentence(gain: &ExpectedGain) -> String {
    let [_, tracked_mm] = gain.programs_mm;
    let Gain { poses, in_use_mm: in_use, tracked_mm: tracked, .. } = gain.shown;
    format!(
        "programs may run as they are; to improve them, correct the originals with the model written here. These poses decide what the fit of the \
         model in use left open: the arm need not have changed. Placement of base and target is excluded, and so is what neither model contains; the \
         error of the model in use is known to ± {tracked_mm:.3} mm. Shown by {poses} poses before they were used: the tracked model predicted them to \
         {tracked:.3} mm, the model in use fits them to {in_use:.3} mm"
    )
}

/// Whether the programs remain valid.
fn headline(
    tracker: &Tracker,
    fresh: usize,
    alarms: &[Alarm],
    departure: Option<&Departure>,
) -> (Status, String) {
    let changes = match alarms.len() {
        0 => "no change detected in them".to_owned(),
        1 => "one change detected".to_owned(),
        n => format!("{n} changes detected"),
    };
    let processed = format!("{fresh} new poses processed, {changes}");
    let but = if alarms.is_empty() { ", but" } else { ";" };
    match departure {
        Some(now) if now.is_significant && !now.is_of_shape => {
            (Status::Warning, format!("{processed}{but} {}", unseen_headline(now)))
        }
        Some(now) if now.is_significant => {
            let headline = format!(
                "{processed}{but} the arm is {:.3} mm from the model that the programs were corrected with: they are not known to \
                 remain valid",
                now.rms_mm
            );
            (Status::Warning, headline)
        }
        _ if tracker.latest_set_aside().is_some() || tracker.mostly_set_aside() => {
            let headline = format!(
                "{processed}{but} readings no longer agree with the model that the programs were corrected with: they are not known to remain \
                 valid"
            );
            (Status::Warning, headline)
        }
        _ if !alarms.is_empty() => (Status::Warning, processed),
        _ if tracker.worse_fit().is_some() => (
            Status::Warning,
            format!(
                "{processed}, but they fit less well than at the beginning: the programs are not known to remain valid"
            ),
        ),
        Some(_) => (
            Status::Good,
            format!(
                "{processed}, and the arm agrees with the model that the programs were corrected with: they remain valid"
            ),
        ),
        None => (Status::Good, processed),
    }
}

/// What to do about a change.
fn what_to_do(alarms: &[Alarm], departed: Option<&Departure>) -> &'static str {
    match departed {
        None if !alarms.is_empty() && alarms.iter().all(Alarm::is_of_scale) => {
            "what to do: measure a known length with the sensor, and put its scale right (of a draw-wire the millimetres per count); the programs \
             remain what they were. Begin a new track then (--state)"
        }
        Some(now) if !now.is_of_shape && !has_turned(now) => {
            "what to do: check the mark of joint 6 and touch a known point with the tool. If they are right, the reflector moved: begin a new \
             track (--state). If not, measure the arm, identify it, and compensate the original programs again"
        }
        Some(now) if !now.is_of_shape => {
            "what to do: find out what turned, as said above. If it was joint 1 or the base, put it right or teach the work objects \
             again; then begin a new track (--state)"
        }
        Some(_) => {
            "what to do: measure the arm, identify it, and compensate the original programs again; until then, the model written \
             here is the best known. Begin a new track with the new model (--model, --state)"
        }
        None => {
            "what to do: if the arm changed, correct the original programs with the new model; if sensor or target moved, mount \
             them firmly"
        }
    }
}

fn key_figures(tracker: &Tracker, changes: usize, departure: Option<&Departure>) -> Vec<KeyFigure> {
    let state = tracker.state();
    let nis: Vec<f64> = state.history.iter().map(|s| s.nis).filter(|n| n.is_finite()).collect();
    // A single pose after remounting may have a NIS of a million, which would dominate the mean.
    let usual = (!nis.is_empty()).then(|| median(&nis));
    let expected = tracker.expected_median_nis();
    vec![
        KeyFigure::new("Poses", state.poses, 0, "").note(format!("{} set aside", state.outliers)),
        KeyFigure::new("Misfit of the latest poses", usual, 2, "").note(format!(
            "median of the squared difference of readings and model, in units of what is expected (NIS); {expected:.1} if arm, sensor and \
             noise match the model"
        )),
        KeyFigure::new("Arm relative to the first model", departure.map(|now| now.rms_mm), 3, "mm").note(
            departure.map_or_else(String::new, |now| {
                format!(
                    "RMS over the measured region, apart from the placement of base and target; {:.3} mm expected from the \
                     uncertainties",
                    now.expected_mm
                )
            }),
        ),
        KeyFigure::new("Changes", state.alarms.len(), 0, "").note(format!("{changes} in the new poses")),
    ]
}

/// What to do where many poses fit neither the arm nor a change of one part.
const DO_NOT_FIT: &str = "what to do: check the target, the line of sight and that the sensor is where it was; put right what moved, and track new \
    measurements. If nothing did, more than one part of the arm changed, as in a collision: measure 30 poses or more, identify the arm again, \
    compensate the original programs with the new model, and begin a new track with it (--model, --state)";

/// The last alarm that is not decided.
fn reported(now: &Departure) -> Option<&Alarm> {
    let of_last_link = || now.last_link.as_ref().filter(|moved| moved.is_significant)?.reported.as_ref();
    now.reported.as_ref().or_else(of_last_link)
}

fn has_turned(now: &Departure) -> bool {
    now.turn.as_ref().is_some_and(|turn| turn.is_significant)
}

/// The headline where the arm kept its shape.
fn unseen_headline(now: &Departure) -> String {
    let last_link = now.last_link.as_ref().filter(|_| !has_turned(now));
    last_link.map_or_else(
        || turn_headline(now),
        |moved| {
            format!(
                "the touched point is {:.3} mm off, and joint 6 or the last link may be the reason: the programs are not known to remain valid",
                moved.moved_mm
            )
        },
    )
}

/// A move of the touched point that the last link may have made, what it may be, and how to tell.
fn last_link_sentence(now: &Departure, alarms: &[Alarm]) -> Option<String> {
    let moved = now.last_link.as_ref().filter(|moved| moved.is_significant)?;
    let turned_deg = moved.angle_rad.abs().to_degrees();
    let sigma = match moved.sigma_rad {
        0.0 => String::new(),
        sigma => format!(" ± {:.4}", sigma.to_degrees()),
    };
    // The alarm of this run tells the move.
    let again = match (&moved.reported, alarms.is_empty()) {
        (Some(_), false) => "the touched point",
        _ => "since the first poses, the touched point has moved on the flange",
    };
    Some(format!(
        "{again}: {:.3} mm. Either the reflector was exchanged or bumped, and the programs are right; or joint 6 lost its zero (by \
         {turned_deg:.4}{sigma}°) or the last link is bent, and a tool is off by {:.3} mm at 150 mm from axis 6. The readings look the same in all \
         these cases. To tell them apart, check the mark of joint 6, and touch a known point with the tool in two orientations of joint 6",
        moved.moved_mm,
        moved.angle_rad.abs() * TOOL_MM
    ))
}

/// A tool's distance from axis 6 by which a lost zero of joint 6 is illustrated (mm).
const TOOL_MM: f64 = 150.0;

/// The headline where the arm turned and kept its shape.
fn turn_headline(now: &Departure) -> String {
    now.turn.as_ref().map_or_else(String::new, |turn| {
        format!(
            "arm and sensor are turned relative to each other by {:.3}° about axis 1, {:.3} mm at the target: the programs are not known to remain \
             valid",
            turn.angle_rad.to_degrees(),
            turn.rms_mm
        )
    })
}

/// A turn about axis 1, what it may be, and how to tell.
fn turn_sentence(now: &Departure) -> Option<String> {
    let turn = now.turn.as_ref().filter(|turn| turn.is_significant)?;
    Some(format!(
        "since the first poses, arm and sensor have turned relative to each other by {:.4} ± {:.4}° about axis 1, which is {:.3} mm RMS at the \
         target. Either joint 1 lost its zero or the base turned, and programs on parts next to the arm are off by this; or the sensor was moved \
         about axis 1, and they are right. The readings cannot tell. Measure three points fixed to the floor: if they appear to have moved, it was \
         the sensor. If not, measure points on the foot of the arm: if they moved, it was the base; if not, joint 1",
        turn.angle_rad.to_degrees(),
        turn.sigma_rad.to_degrees(),
        turn.rms_mm
    ))
}

/// What readings cannot tell of the new changes, and what to measure.
fn which_moved(alarms: &[Alarm], departed: Option<&Departure>) -> Vec<String> {
    let any = |mount: Mount| alarms.iter().any(|alarm| alarm.is_of(mount));
    let is_open =
        departed.is_some_and(|now| now.last_link.as_ref().is_some_and(|moved| moved.is_significant));
    let target = (any(Mount::Target) && !is_open).then(|| {
        "the touched point: the arm in the model for programs stays as it was. A changed last link or a lost zero of joint 6 would move the \
         readings alike; if the reflector was neither exchanged nor bumped, check the mark of joint 6, and touch a known point with the tool"
            .to_owned()
    });
    let sensor = any(Mount::Sensor).then(|| {
        "sensor or base: the readings show only that one moved relative to the other. Measure three points fixed to the floor: if they appear to \
         have moved, it was the sensor, and the programs are right; if not, it was the base, and programs on parts next to the arm are off"
            .to_owned()
    });
    let scale = alarms.iter().find(|alarm| alarm.is_of_scale()).map(scale_sentence);
    target.into_iter().chain(sensor).chain(scale).collect()
}

/// What a changed scale of the sensor may be.
fn scale_sentence(alarm: &Alarm) -> String {
    let long = if alarm.shift < 0.0 { "short" } else { "long" };
    let kelvin = alarm.shift.abs() / GROWTH_PER_K;
    let warmed = if kelvin > MOST_WARMED_K {
        String::new()
    } else {
        format!(
            ", unless the whole arm is warmer or colder by some {kelvin:.0} K than when it was measured: then programs are off by what it grew"
        )
    };
    format!(
        "the scale of the sensor: it reads {:.3} % too {long} against how it read before, as after an exchange of sensor or encoder; the arm in the \
         model for programs stays as it was{warmed}",
        100.0 * alarm.shift.abs()
    )
}

/// Growth of steel and aluminium per kelvin is 12 and 24 µm/m: between the two.
const GROWTH_PER_K: f64 = 1.8e-5;

/// An arm does not warm by more (K).
const MOST_WARMED_K: f64 = 60.0;

/// How far the arm has moved, and its parameters that moved most.
fn departure_sentence(now: &Departure) -> String {
    let mut out = format!(
        "over the measured region, and apart from the placement of base and target, the arm is {:.3} mm RMS from the model that the \
         track began with; the uncertainties alone would make {:.3} mm: programs that were corrected with it are off by this much",
        now.rms_mm, now.expected_mm
    );
    let moved = now.parameters.iter().take(LISTED).map(|moved| {
        let (scale, unit) = display_unit(&moved.unit);
        format!("{} {:+.4} ± {:.4} {unit}", moved.name, moved.by * scale, moved.sigma * scale)
    });
    let moved: Vec<String> = moved.collect();
    if let Some([rms_mm, expected_mm]) = now.since_first_poses_mm {
        out += &format!(
            "; since the first poses of the track it moved by {rms_mm:.3} mm, where {expected_mm:.3} mm are expected"
        );
    }
    if !moved.is_empty() {
        out += &format!("; moved most: {}", moved.join(", "));
    }
    out
}

/// What the scatter of the readings says of the noise that the track assumes.
fn noise_sentences(tracker: &Tracker) -> Vec<String> {
    let replaced = tracker.replaced_noise_mm().map(|[now, before]| {
        format!(
            "the first poses scatter far less than the residual of the model ({before:.3} mm along each axis), so the track assumes {now:.3} mm \
             and sees smaller changes"
        )
    });
    let overstated = tracker.overstated_noise().map(|noise| {
        format!(
            "remark: the readings scatter by {:.3} mm along each axis, but the track assumes {:.3} mm (--sigma, or the residual of the model): a \
             sudden change that moves the readings by less than about {:.2} mm goes unnoticed; a new track with --sigma {:.3} would see it",
            noise.seen_mm, noise.sigma_mm, noise.smallest_change_mm, 1.25 * noise.seen_mm
        )
    });
    let worse = tracker.worse_fit().map(|ratio| {
        format!(
            "the latest readings fit {ratio:.1} times less well than the first ones, though within the noise that the track assumes: arm, sensor \
             or target moved a little, or the poses lie elsewhere; if they lie as before, begin a new track with --sigma set to the scatter of the \
             first ones, to find out what moved"
        )
    });
    worse.into_iter().chain(replaced).chain(overstated).collect()
}

/// Parameters that are listed.
const LISTED: usize = 3;

/// Current parameters.
pub fn table(tracker: &Tracker) -> Table {
    let estimates = tracker.deviations().iter().zip(tracker.sigmas());
    let parameters = tracker.parameters().iter().map(|parameter| display_unit(parameter.unit()));
    Table::of("Parameters, as deviations from the initial model", parameters.zip(estimates).enumerate())
        .text("parameter", "Parameter", |(k, _)| tracker.name(*k))
        .text("unit", "Unit", |(_, ((_, unit), _))| *unit)
        .significant("value", "deviation", "", 2, |(_, ((scale, _), (value, sigma)))| {
            Cell::with_sigma(*value * scale, Some(sigma * scale))
        })
        .table()
}

/// JSON report, schema `truegrind.track-report/1`.
pub fn json(tracker: &Tracker, fresh: usize, alarms: &[Alarm]) -> Value {
    let state = tracker.state();
    let sigmas = tracker.sigmas();
    let parameters: Vec<Value> = tracker
        .parameters()
        .iter()
        .zip(tracker.deviations())
        .zip(&sigmas)
        .enumerate()
        .map(|(k, ((p, value), sigma))| {
            json!({ "name": tracker.name(k), "unit": p.unit(), "deviation": value, "sigma": sigma })
        })
        .collect();
    json!({
        "schema": "truegrind.track-report/1",
        "new_poses": fresh,
        "poses": state.poses,
        "set_aside": state.outliers,
        "new_alarms": alarms,
        "alarms": state.alarms,
        "departure": tracker.departure().map(|now| {
            let [since_mm, since_expected_mm] = now.since_first_poses_mm.map_or([None; 2], |of| of.map(Some));
            json!({
                "rms_mm": now.rms_mm, "expected_mm": now.expected_mm, "significant": now.is_significant,
                "of_shape": now.is_of_shape,
                "turn_about_axis_1": now.turn.as_ref().map(|turn| json!({
                    "angle_rad": turn.angle_rad, "sigma_rad": turn.sigma_rad, "rms_mm": turn.rms_mm,
                    "significant": turn.is_significant,
                })),
                "touched_point": now.last_link.as_ref().map(|moved| json!({
                    "moved_mm": moved.moved_mm, "joint_6_rad": moved.angle_rad, "joint_6_sigma_rad": moved.sigma_rad,
                    "significant": moved.is_significant,
                })),
                "since_first_poses_mm": since_mm, "since_first_poses_expected_mm": since_expected_mm,
            })
        }),
        "gain": expected_gain(tracker, tracker.departure().as_ref()).map(|gain| json!({
            "programs_in_use_mm": gain.programs_mm[0], "programs_tracked_mm": gain.programs_mm[1], "poses": gain.shown.poses,
            "readings_in_use_mm": gain.shown.in_use_mm, "readings_tracked_mm": gain.shown.tracked_mm,
        })),
        "noise": json!({
            "replaced_mm": tracker.replaced_noise_mm().map(|[_, before]| before),
            "smallest_change_mm": tracker.smallest_change_mm(),
        }),
        "parameters": parameters,
    })
}
