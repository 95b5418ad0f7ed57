//! The tool under test, called as its command line calls it. Nothing else of truegrind is used anywhere in this crate.

use std::time::Instant;

use nalgebra::{Vector3, Vector6};
use serde_json::Value;
use truegrind_arm::condition::Condition;
use truegrind_arm::estimated::{Estimated, Judgement};
use truegrind_arm::model::Model;
use truegrind_arm::robots;
use truegrind_calibration::diagnosis::diagnose::{Diagnosed, Options, diagnose};
use truegrind_calibration::diagnosis::preparation::prepare;
use truegrind_calibration::identification::fit::errors_on;
use truegrind_calibration::identification::identify::{self, identify};
use truegrind_calibration::identification::register::starting_frames;
use truegrind_calibration::measurement::convention::AngleConvention;
use truegrind_calibration::measurement::dataset::Dataset;
use truegrind_calibration::measurement::import;
use truegrind_calibration::measurement::plausibility::{ComparedReading, plausibility};
use truegrind_calibration::measurement::split;

use crate::arms::{Angles, Pose};
use crate::designs::Visit;
use crate::shape::shape_sigma;
use crate::statistics::is_near;

/// A finding, as the JSON has it.
#[derive(Debug, Clone, PartialEq)]
pub struct Finding {
    /// Its name.
    pub effect: String,
    /// Names of its parameters.
    pub parameters: Vec<String>,
    /// Joints, from 1.
    pub joints: Option<Vec<usize>>,
    /// Rows, from 0.
    pub rows: Option<[usize; 2]>,
    /// Whether it is told without a doubt.
    pub identified: bool,
}

/// What becomes of the model.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub enum Written {
    /// `-o` writes it.
    Yes,
    /// Only with `--allow-doubtful`.
    Doubtful,
    /// Not at all.
    No,
}

/// Which arm is asked.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Which {
    /// The data sheet's.
    Sheet,
    /// Geometry alone, as the diagnosis has it before it looks for causes.
    Geometry,
    /// Geometry alone, as `identify` writes it from the same rows.
    Identified,
    /// The model file's.
    Written,
}

/// What the tool says.
#[derive(Debug)]
pub struct Reply {
    /// Its findings.
    pub findings: Vec<Finding>,
    /// Held-out error, random folds (mm).
    pub held_out_mm: f64,
    /// Held-out error, contiguous blocks (mm).
    pub held_out_blocks_mm: f64,
    /// Held-out error, regions of joint space (mm).
    pub held_out_regions_mm: f64,
    /// Held-out error of geometry alone, random folds (mm).
    pub geometry_held_out_mm: f64,
    /// Held-out error of geometry alone, contiguous blocks (mm).
    pub geometry_held_out_blocks_mm: f64,
    /// What becomes of the model.
    pub written: Written,
    /// Wall time of import and diagnosis (s).
    pub seconds: f64,
    sheet: Model,
    model: Model,
    identified: Option<Model>,
    found: Diagnosed,
    convention: AngleConvention,
}

/// Errors on fresh series.
#[derive(Debug, Clone, PartialEq)]
pub struct Fresh {
    /// Geometry alone (RMS of all series, mm).
    pub geometry_mm: f64,
    /// The extended model (RMS of all series, mm).
    pub extended_mm: f64,
    /// The extended model on each series (RMS, mm).
    pub series_mm: Vec<f64>,
}

impl Fresh {
    /// From the errors (mm) of geometry and of the extended model on the counted rows of each series.
    pub fn of(series: &[(Vec<f64>, Vec<f64>)]) -> Self {
        let rms = |errors: &mut dyn Iterator<Item = &f64>| {
            let (sum, count) = errors.fold((0.0, 0.0), |(sum, count), e| (sum + e * e, count + 1.0));
            f64::sqrt(sum / count)
        };
        Self {
            geometry_mm: rms(&mut series.iter().flat_map(|(geometry, _)| geometry)),
            extended_mm: rms(&mut series.iter().flat_map(|(_, extended)| extended)),
            series_mm: series.iter().map(|(_, extended)| rms(&mut extended.iter())).collect(),
        }
    }

    /// The share of series whose error is within 10 % of that of all others together: what chance alone leaves of an error that is
    /// estimated from as many rows, whatever their noise.
    pub fn near_by_chance(&self) -> f64 {
        let squares: Vec<f64> = self.series_mm.iter().map(|error| error * error).collect();
        let (sum, count) = (squares.iter().sum::<f64>(), squares.len() as f64);
        let near = |square: &&f64| is_near(&(**square / ((sum - **square) / (count - 1.0))).sqrt());
        squares.iter().filter(near).count() as f64 / count
    }
}

fn read(text: &str) -> Result<Dataset, String> {
    let rows = import::read("unseen.csv", text.as_bytes(), &import::Options::default());
    rows.map_err(|error| error.to_string())
}

fn dataset(rows: &Dataset, convention: AngleConvention, nominal: &Model) -> Result<Dataset, String> {
    convention.apply(rows.clone(), nominal).ok_or_else(|| "the joint map cannot be inverted".to_owned())
}

/// The rows, where the sensor does not contradict the convention of their angles.
fn read_as(
    text: &str,
    convention: AngleConvention,
    nominal: &Model,
) -> Result<(Dataset, AngleConvention), String> {
    let rows = read(text)?;
    for suspicion in plausibility(&rows, nominal, convention) {
        if suspicion.compared == ComparedReading::Sensor {
            return Err(suspicion.to_string());
        }
    }
    Ok((dataset(&rows, convention, nominal)?, convention))
}

/// `truegrind diagnose unseen.csv --robot NAME -o MODEL.toml --json`. A panic is one run without an answer, not the end of all.
///
/// # Errors
/// What the command line would say.
pub fn diagnosed(text: &str, robot: &str) -> Result<Reply, String> {
    std::panic::catch_unwind(|| answer(text, robot)).unwrap_or_else(|_| Err("it panicked".to_owned()))
}

fn answer(text: &str, robot: &str) -> Result<Reply, String> {
    let start = Instant::now();
    let robot = robots::load(robot).map_err(|error| error.to_string())?;
    let dh = robot.sheet.joints.angles == robots::sheet::Angles::Dh;
    let told = if dh { AngleConvention::Dh } else { AngleConvention::Logged };
    let other = if dh { AngleConvention::Logged } else { AngleConvention::Dh };
    // What a user is told to do where the sensor contradicts the convention: read the file the other way.
    let (rows, convention) = read_as(text, told, &robot.model)
        .or_else(|why| read_as(text, other, &robot.model).map_err(|_| why))?;
    let options = Options::default();
    let frames = starting_frames(&rows, &robot.model, &options.tolerance, true);
    let frames = frames.map_err(|error| error.to_string())?;
    let name = &robot.sheet.name;
    let found = diagnose(&rows, name, &robot.model, &frames, &options, &|_| {});
    let found = found.map_err(|error| error.to_string())?;
    let file = found.estimated.to_toml().map_err(|error| error.to_string())?;
    let seconds = start.elapsed().as_secs_f64();
    let identify_options = identify::Options::default();
    let share = |rows: &Dataset| split::random(rows, identify_options.held_out, identify_options.seed);
    let identified = identify(&rows, name, &robot.model, &frames, &share, &identify_options);
    let written = match found.estimated.verdict.status {
        Judgement::Fail => Written::No,
        Judgement::Doubtful => Written::Doubtful,
        _ => Written::Yes,
    };
    // As a program reads it; a refused arm is in no file.
    let model = match written {
        Written::No => found.estimated.model.clone(),
        _ => Estimated::from_toml(&file).map_err(|error| error.to_string())?.model,
    };
    let json = serde_json::to_value(&found.diagnosis).map_err(|error| error.to_string())?;
    let error = |stage: &str, key: &str| {
        json["fits"][stage][key].as_f64().ok_or_else(|| format!("fits.{stage}.{key} is no number"))
    };
    Ok(Reply {
        findings: findings(&json)?,
        held_out_mm: error("extended", "cv_rmse_mm")?,
        held_out_blocks_mm: error("extended", "cv_blocks_rmse_mm")?,
        held_out_regions_mm: error("extended", "cv_regions_rmse_mm")?,
        geometry_held_out_mm: error("geometric", "cv_rmse_mm")?,
        geometry_held_out_blocks_mm: error("geometric", "cv_blocks_rmse_mm")?,
        written,
        seconds,
        sheet: robot.model,
        model,
        identified: identified.ok().map(|done| done.estimated.model),
        found,
        convention,
    })
}

fn findings(json: &Value) -> Result<Vec<Finding>, String> {
    if json["schema"] != "truegrind.diagnosis/1" {
        return Err(format!("schema: expected truegrind.diagnosis/1, found {}", json["schema"]));
    }
    let list = json["findings"].as_array().ok_or("findings: expected a list")?;
    let numbers = |value: &Value| -> Option<Vec<usize>> {
        value.as_array()?.iter().map(|n| n.as_u64().map(|n| n as usize)).collect()
    };
    let finding = |f: &Value| -> Result<Finding, String> {
        let names = f["parameters"].as_array().into_iter().flatten();
        Ok(Finding {
            effect: f["effect"].as_str().ok_or("a finding without an effect")?.to_owned(),
            parameters: names.filter_map(|p| p["name"].as_str().map(str::to_owned)).collect(),
            joints: numbers(&f["joints"]),
            rows: numbers(&f["rows"]).and_then(|rows| rows.try_into().ok()),
            identified: match f["confidence"].as_str() {
                Some("identified") => true,
                Some(_) => false,
                None => return Err("a finding without a confidence".to_owned()),
            },
        })
    };
    list.iter().map(finding).collect()
}

impl Reply {
    /// The whole diagnosis and the model file.
    ///
    /// # Errors
    /// What the command line would say.
    pub fn json(&self) -> Result<String, String> {
        let told = serde_json::to_string_pretty(&self.found.diagnosis).map_err(|error| error.to_string())?;
        Ok(told + "\n" + &self.found.estimated.to_toml().map_err(|error| error.to_string())?)
    }

    /// The flange as an arm has it, at a visit (mm).
    pub fn flange(&self, which: Which, visit: &Visit) -> Pose {
        let model = match which {
            Which::Sheet => &self.sheet,
            Which::Geometry => &self.found.geometric.model,
            Which::Identified => self.identified.as_ref().unwrap_or(&self.sheet),
            Which::Written => &self.model,
        };
        let pose = model.forward(&Vector6::from(visit.q), &condition(visit));
        Pose::from_parts(pose.translation, pose.rotation)
    }

    /// Standard deviation that the model file states of the shape at visits, for a point on the flange (mm).
    pub fn shape_sigma_mm(&self, visits: &[Visit], point: &Vector3<f64>) -> Option<f64> {
        let poses: Vec<Pose> = visits.iter().map(|visit| self.flange(Which::Written, visit)).collect();
        let file = &self.found.estimated;
        let tool = Pose::from_parts((*point).into(), nalgebra::UnitQuaternion::identity());
        let slope = |visit: &Visit| {
            let condition = condition(visit);
            let arm = self.model.at_condition(&condition);
            file.position_jacobian(&arm, &Vector6::from(visit.q), &tool)
        };
        let slopes: Vec<_> = visits.iter().map(slope).collect();
        shape_sigma(&poses, point, &slopes, &file.covariance)
    }

    /// What geometry alone and the extended model, each with its frames and causes of the measurement, get wrong on fresh rows of
    /// the same measurement (mm), on those rows of a file that are counted.
    ///
    /// # Errors
    /// What the import would say.
    pub fn errors(&self, text: &str, visits: &[Visit]) -> Result<(Vec<f64>, Vec<f64>), String> {
        let mut rows = dataset(&read(text)?, self.convention, &self.sheet)?;
        // A fresh row stands in the measurement where its time does. Rows are numbered as in the file, below its headings.
        let first = rows.rows.iter().next().map_or(0, |row| row.number);
        for (row, visit) in rows.rows.iter_mut().zip(visits) {
            row.number = first + visit.row;
        }
        let observed = prepare(&rows, &self.sheet, true).observed;
        let [geometry, extended] = [&self.found.geometric, &self.found.extended]
            .map(|fit| errors_on(&observed, &fit.model, &fit.frames));
        let counted = |errors: Vec<f64>| -> Vec<f64> {
            errors
                .into_iter()
                .zip(visits)
                .filter_map(|(error, visit)| visit.counted.then_some(error))
                .collect()
        };
        Ok((counted(geometry), counted(extended)))
    }
}

fn condition(visit: &Visit) -> Condition {
    Condition { time_h: Some(visit.hours), approach: sides(&visit.q, &visit.before), ..Condition::default() }
}

/// From which side each joint came, as the condition of a pose has it: −1 from below.
fn sides(q: &Angles, before: &Angles) -> [i8; 6] {
    std::array::from_fn(|j| {
        let step = q[j] - before[j];
        if step.abs() < 1e-6 { 0 } else { -step.signum() as i8 }
    })
}

/// The data sheet's flange at logged angles, for the check that both sides mean the same arm.
///
/// # Errors
/// An arm that the catalogue has not.
pub fn sheet_flange(robot: &str, q: &Angles) -> Result<Pose, String> {
    let robot = robots::load(robot).map_err(|error| error.to_string())?;
    let pose = robot.model.forward(&Vector6::from(*q), &Condition::default());
    Ok(Pose::from_parts(pose.translation, pose.rotation))
}
