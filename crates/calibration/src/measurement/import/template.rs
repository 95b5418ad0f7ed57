//! Column template of an empty measurement table.

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
const SESSION: &str = "any name; another one where sensor or target were set up anew (may be empty)";

/// The columns for a sensor, in the order of the template.
///
/// ```
/// use truegrind_calibration::measurement::dataset::Sensor;
/// use truegrind_calibration::measurement::import::template::columns;
///
/// let names: Vec<&str> = columns(Sensor::Cable).iter().map(|column| column.name).collect();
/// assert_eq!(names.join(","), "q1,q2,q3,q4,q5,q6,L,t,temperature,payload,session");
/// ```
pub fn columns(sensor: Sensor) -> Vec<Column> {
    let of = |names: &[&'static str], meaning| {
        names.iter().map(move |&name| Column { name, meaning }).collect::<Vec<_>>()
    };
    let position = of(&["measured_x", "measured_y", "measured_z"], POSITION);
    let reading = match sensor {
        Sensor::Cable => of(&["L"], CABLE),
        Sensor::Position => position,
        Sensor::Pose => {
            let turn = of(&["measured_qw", "measured_qx", "measured_qy", "measured_qz"], QUATERNION);
            [position, turn].concat()
        }
    };
    [
        of(&["q1", "q2", "q3", "q4", "q5", "q6"], JOINTS),
        reading,
        of(&["t"], TIME),
        of(&["temperature"], TEMPERATURE),
        of(&["payload"], PAYLOAD),
        of(&["session"], SESSION),
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
