//! Writes the measurement file of a simulation, with as many decimals as the rounding requires.

use nalgebra::Vector3;

use super::recipe::{Approach, Recipe};
use crate::measurement::dataset::{Reading, Sensor};
use truegrind_arm::condition::Condition;
use truegrind_arm::model::Joints;
use truegrind_math::work::checkpoint;

/// One row before rounding.
pub(super) struct Logged {
    pub(super) joints: Joints,
    pub(super) reading: Reading,
    pub(super) readout: Vector3<f64>,
    pub(super) condition: Condition,
    pub(super) anchor: usize,
    pub(super) station: usize,
}

/// Format of a number: rounded to an optional step, with the decimals that the step needs; never a negative zero.
struct Format {
    step: Option<f64>,
    decimals: usize,
}

impl Format {
    fn new(step: Option<f64>, otherwise: usize) -> Self {
        let decimals = step.map_or(otherwise, |step| {
            (0..9).find(|&d| ((step * 10f64.powi(d)).fract() + 1e-9).fract() < 2e-9).unwrap_or(9) as usize
        });
        Self { step, decimals }
    }

    fn write(&self, value: f64) -> String {
        let value = self.step.map_or(value, |step| (value / step).round() * step);
        let text = format!("{value:.*}", self.decimals);
        match text.strip_prefix('-') {
            Some(rest) if rest.bytes().all(|b| b == b'0' || b == b'.') => rest.to_owned(),
            _ => text,
        }
    }
}

pub(super) fn csv(recipe: &Recipe, rows: &[Logged]) -> String {
    let angle = Format::new(recipe.rounding.angles_deg, 6);
    let length = Format::new(recipe.rounding.reading_mm, 4);
    let readout = Format::new(recipe.rounding.readout_mm, 4);
    let quaternion = Format::new(None, 9);
    let (hours, degrees, mass, centre_mm) =
        (Format::new(None, 5), Format::new(None, 3), Format::new(None, 3), Format::new(None, 3));
    let logged = !recipe.conditions.unlogged;
    let first = rows.first().map(|r| r.condition).unwrap_or_default();
    let time = logged && first.time_h.is_some();
    let temperature = logged && first.temperature_c.is_some();
    let payload = logged && first.payload_kg.is_some();
    let centre = payload && first.payload_centre_mm != [0.0; 3];
    let approach = logged && recipe.conditions.approach != Approach::Unknown;
    let anchors = recipe.sensor.anchors() > 1;
    let stations = !recipe.station.is_empty();

    let mut header: Vec<String> = (1..=6).map(|j| format!("q{j}")).collect();
    let sensor: &[&str] = match recipe.sensor.rig().sensor() {
        Sensor::Cable => &["L"],
        Sensor::Position => &["measured_x", "measured_y", "measured_z"],
        Sensor::Pose => &[
            "measured_x",
            "measured_y",
            "measured_z",
            "measured_qw",
            "measured_qx",
            "measured_qy",
            "measured_qz",
        ],
    };
    let mut name = |wanted: bool, names: &[&str]| {
        header.extend(names.iter().filter(|_| wanted).map(|n| (*n).to_owned()));
    };
    name(true, sensor);
    name(recipe.readout, &["x", "y", "z"]);
    name(time, &["t"]);
    name(temperature, &["temperature"]);
    name(payload, &["payload"]);
    name(centre, &["payload_x", "payload_y", "payload_z"]);
    name(approach, &["approach1", "approach2", "approach3", "approach4", "approach5", "approach6"]);
    name(anchors, &["anchor"]);
    name(stations, &["station"]);
    let mut out = header.join(",") + "\n";
    for row in rows {
        checkpoint();
        let mut cells: Vec<String> = row.joints.iter().map(|q| angle.write(q.to_degrees())).collect();
        match &row.reading {
            Reading::Cable(l) => cells.push(length.write(*l)),
            Reading::Position(p) => cells.extend(p.iter().map(|v| length.write(*v))),
            Reading::Pose(pose) => {
                cells.extend(pose.translation.vector.iter().map(|v| length.write(*v)));
                let q = pose.rotation;
                let sign = if q.w < 0.0 { -1.0 } else { 1.0 };
                cells.extend([q.w, q.i, q.j, q.k].map(|v| quaternion.write(sign * v)));
            }
        }
        if recipe.readout {
            cells.extend(row.readout.iter().map(|v| readout.write(*v)));
        }
        let mut optional = |wanted: bool, format: &Format, value: Option<f64>| {
            cells.extend(value.filter(|_| wanted).map(|v| format.write(v)));
        };
        optional(time, &hours, row.condition.time_h);
        optional(temperature, &degrees, row.condition.temperature_c);
        optional(payload, &mass, row.condition.payload_kg);
        if centre {
            cells.extend(row.condition.payload_centre_mm.map(|mm| centre_mm.write(mm)));
        }
        if approach {
            cells.extend(row.condition.approach.map(|side| side.to_string()));
        }
        if anchors {
            cells.push((row.anchor + 1).to_string());
        }
        if stations {
            cells.push((row.station + 1).to_string());
        }
        out += &cells.join(",");
        out.push('\n');
    }
    out
}
