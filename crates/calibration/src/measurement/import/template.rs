//! Column template of an empty measurement table.

use super::column_names;
use crate::measurement::dataset::Sensor;

/// A column of an empty table.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Column {
    /// Its name, as the import expects it.
    pub name: &'static str,
    /// Its content and unit; columns with the same meaning are adjacent.
    pub meaning: &'static str,
}

const JOINTS: &str = "joint angles as the controller logs them (°)";
const CABLE: &str = "reading of the cable's encoder (mm)";
const POSITION: &str = "what the sensor reads, in its own frame (mm)";
const QUATERNION: &str = "orientation of the target in the sensor's frame, a unit quaternion";
const TIME: &str = "hours since the start (may be empty)";
const TEMPERATURE: &str = "temperature of the arm (°C, may be empty)";
const PAYLOAD: &str = "load on the flange (kg, may be empty)";
const PAYLOAD_CENTRE: &str = "its centre of mass in the flange frame (mm); empty: at the flange";
const SESSION: &str =
    "any name; a new one where sensor or target may have shifted, which is then checked (may be empty)";
const STATION: &str = "any name of the place where the sensor stood, the same where it was not moved on purpose; at least four poses from each \
                       (may be empty in all rows where there is only one)";
const OUTLET: &str =
    "number of the cable's outlet, from 1 (may be empty in all rows where there is only one)";
const READOUT: &str =
    "position as the controller shows it (mm, may be empty); it refines rounded joint angles";
const APPROACH: &str =
    "side from which each joint arrived, −1 or +1 (may be empty); it separates backlash from other errors";
const PATH: &str = "for rows read while the arm runs a path, which `accept` judges: any name, which run (from 1), which sampling point \
                    (may be empty)";

/// All columns for a sensor, those that must be filled first.
///
/// ```
/// use truegrind_calibration::measurement::dataset::Sensor;
/// use truegrind_calibration::measurement::import::template::columns;
///
/// let names: Vec<&str> = columns(Sensor::Cable).iter().map(|column| column.name).collect();
/// assert!(names.join(",").starts_with("q1,q2,q3,q4,q5,q6,L,anchor,t,temperature,payload,payload_x,payload_y,payload_z,session,"));
/// ```
pub fn columns(sensor: Sensor) -> Vec<Column> {
    let of = |names: &[&'static str], meaning| {
        names.iter().map(move |&name| Column { name, meaning }).collect::<Vec<_>>()
    };
    let position = of(&column_names::POSITION, POSITION);
    let reading = match sensor {
        Sensor::Cable => [of(&["L"], CABLE), of(&["anchor"], OUTLET)].concat(),
        Sensor::Position => [position, of(&["station"], STATION)].concat(),
        Sensor::Pose => {
            let turn = of(&column_names::QUATERNION, QUATERNION);
            [position, turn, of(&["station"], STATION)].concat()
        }
    };
    // A cable measures no position on a path.
    let path = if sensor == Sensor::Cable { Vec::new() } else { of(&column_names::PATH, PATH) };
    [
        of(&["q1", "q2", "q3", "q4", "q5", "q6"], JOINTS),
        reading,
        of(&["t"], TIME),
        of(&["temperature"], TEMPERATURE),
        of(&["payload"], PAYLOAD),
        of(&column_names::PAYLOAD_CENTRE, PAYLOAD_CENTRE),
        of(&["session"], SESSION),
        of(&column_names::READOUT, READOUT),
        of(&["approach1", "approach2", "approach3", "approach4", "approach5", "approach6"], APPROACH),
        path,
    ]
    .concat()
}

/// The meaning of each group of columns, with the first and last name of the group.
pub fn meanings(columns: &[Column]) -> Vec<(String, &'static str)> {
    let mut out: Vec<(String, &'static str)> = Vec::new();
    for together in columns.chunk_by(|a, b| a.meaning == b.meaning) {
        let [first, last] = [together[0].name, together[together.len() - 1].name];
        let names = if together.len() == 1 { first.to_owned() } else { format!("{first} to {last}") };
        out.push((names, together[0].meaning));
    }
    out
}
