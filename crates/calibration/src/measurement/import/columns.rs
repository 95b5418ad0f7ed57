//! Finds the columns of a table by their headers.

use std::collections::BTreeMap;

use super::cell::{Line, Table};
use super::column_names::{
    LETTERS, PATH, PAYLOAD_CENTRE, POSITION, QUATERNION, READOUT, joint, joint_number,
};
use super::error::{ImportError, Location};
use super::stated_unit::{WithUnit, with_unit};
use crate::measurement::dataset::Sensor;
use truegrind_math::sentence::listed;

/// Column indices.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct HeaderColumns {
    /// Index of the header in the table's rows.
    pub(super) header: usize,
    /// Width of the header up to the last name.
    pub(super) width: usize,
    /// q1 to q6.
    pub(super) joints: [usize; 6],
    /// The sensor.
    pub(super) sensor: Sensor,
    /// Columns of the sensor: L, or x y z, or x y z qw qx qy qz.
    pub(super) reading: Vec<usize>,
    /// x, y, z of the controller.
    pub(super) readout: Option<[usize; 3]>,
    /// t, temperature, payload.
    pub(super) time: Option<usize>,
    pub(super) temperature: Option<usize>,
    pub(super) payload: Option<usize>,
    /// payload_x, payload_y, payload_z.
    pub(super) payload_centre: Option<[usize; 3]>,
    /// session.
    pub(super) session: Option<usize>,
    /// approach1 to approach6, each where given.
    pub(super) approach: [Option<usize>; 6],
    /// anchor, of cables.
    pub(super) anchor: Option<usize>,
    /// station, of trackers and cameras.
    pub(super) station: Option<usize>,
    /// path, cycle, sample, where all three are there.
    pub(super) path: Option<[usize; 3]>,
    /// Columns that are kept but not used.
    pub(super) other: Vec<(String, usize)>,
    /// Notes for the user.
    pub(super) notes: Vec<String>,
}

impl HeaderColumns {
    /// Finds the columns, or reports missing, duplicate or superfluous ones.
    pub(super) fn find(file: &str, table: &Table) -> Result<Self, ImportError> {
        let mut location = Location { sheet: table.sheet.as_deref().map(Into::into), ..Location::file(file) };
        let Some(header) = header_row(&table.rows) else {
            return Err(ImportError::Empty { location });
        };
        let line = &table.rows[header];
        location.row = Some(line.number);
        let cells = line.cells.iter().enumerate().filter(|(_, cell)| !cell.is_empty());
        let named = cells
            .map(|(i, cell)| Ok((without_unit(cell.to_string(), &location)?, i)))
            .collect::<Result<Vec<(String, usize)>, ImportError>>()?;
        let found: Vec<String> = named.iter().map(|(n, _)| n.clone()).collect();
        let letter = joint_letter(&found);
        let is_known = |name: &str| is_known(name) || joint_number(name, letter).is_some();
        let by_name = by_name(&named, letter, &location)?;
        let get = |name: &str| by_name.get(name).copied();
        let path = path_columns(&named, &get, &location)?;
        let is_used = |name: &str| is_known(name) || path.is_some() && PATH.contains(&name);
        let unused: Vec<&str> = by_name.keys().copied().filter(|n| !is_used(n)).collect();

        let joints = (1..=6).map(|j| format!("{letter}{j}"));
        let missing: Vec<String> = joints.filter(|name| get(name).is_none()).collect();
        let missing = describe_missing(&missing, &unused);
        if !missing.is_empty() {
            return Err(ImportError::MissingColumns { location, missing, found });
        }
        let joints = std::array::from_fn(|j| get(&format!("{letter}{}", j + 1)).unwrap_or_default());

        let (sensor, reading) = sensor_columns(&get, &location, &unused, &found)?;
        let mut notes = Vec::new();
        let readout = match READOUT.map(get) {
            [Some(x), Some(y), Some(z)] => Some([x, y, z]),
            [None, None, None] => None,
            _ => {
                notes.push(
                    "the controller's read-out needs x, y and z; found only some of them, so it is not used"
                        .into(),
                );
                None
            }
        };
        let payload_centre = match PAYLOAD_CENTRE.map(get) {
            [Some(x), Some(y), Some(z)] if get("payload").is_some() => Some([x, y, z]),
            [None, None, None] => None,
            _ => {
                notes.push(
                    "the centre of the payload needs the columns payload, payload_x, payload_y and payload_z; found only some of them, so it is not \
                     used"
                        .into(),
                );
                None
            }
        };
        let approach = std::array::from_fn(|j| get(&format!("approach{}", j + 1)));
        notes.extend(part_of_path(&get, path));
        for name in &unused {
            if let Some(expected) = OPTIONAL.iter().copied().find(|o| get(o).is_none() && is_near(name, o)) {
                notes.push(format!("column `{name}` is not used; did you mean {expected}?"));
            }
        }
        let of_cable = sensor == Sensor::Cable;
        // The outlets of a cable are numbered; what is named a station still says which rows belong together.
        let stations_of_cable = get("station").filter(|_| of_cable && get("session").is_none());
        let is_idle = |name: &str| match name {
            "station" => of_cable && stations_of_cable.is_none(),
            "anchor" => !of_cable,
            _ => !is_used(name),
        };
        let other: Vec<(String, usize)> = named.iter().filter(|(n, _)| is_idle(n)).cloned().collect();
        if stations_of_cable.is_some() {
            notes.push(
                "column station is read as session: where the outlet of a cable stands, and when its zero was set, is told by the column anchor, \
                 a number for each"
                    .to_owned(),
            );
        }
        if !other.is_empty() {
            let names: Vec<String> = other.iter().map(|(n, _)| format!("`{n}`")).collect();
            notes.push(format!("columns kept but not used: {}", names.join(", ")));
        }
        let width = line.cells.iter().rposition(|c| !c.is_empty()).map_or(0, |i| i + 1);
        Ok(Self {
            header,
            width,
            joints,
            sensor,
            reading,
            readout,
            time: get("t"),
            temperature: get("temperature"),
            payload: get("payload"),
            payload_centre,
            session: get("session").or(stations_of_cable),
            approach,
            anchor: get("anchor").filter(|_| of_cable),
            station: get("station").filter(|_| !of_cable),
            path,
            other,
            notes,
        })
    }
}

/// A header without its unit. In another unit than the expected one a required column is an error, and an optional one keeps
/// its header, so that it is not used.
fn without_unit(header: String, location: &Location) -> Result<String, ImportError> {
    match with_unit(&header) {
        None | Some(WithUnit { is_expected: false, is_required: false, .. }) => Ok(header),
        Some(WithUnit { name, is_expected: true, .. }) => Ok(name.to_owned()),
        Some(WithUnit { name, unit, expected, .. }) => Err(ImportError::Unusable {
            location: Location { column: Some(name.into()), ..location.clone() },
            message: format!(
                "the header states `{unit}`; expected {expected}: convert the numbers and the header"
            ),
        }),
    }
}

/// The columns of a path. Other programs use these names too, so they count only when all three are present.
fn path_columns(
    named: &[(String, usize)],
    get: &dyn Fn(&str) -> Option<usize>,
    location: &Location,
) -> Result<Option<[usize; 3]>, ImportError> {
    let [Some(path), Some(cycle), Some(sample)] = PATH.map(get) else { return Ok(None) };
    match PATH.into_iter().find(|name| named.iter().filter(|(found, _)| found == name).count() > 1) {
        None => Ok(Some([path, cycle, sample])),
        Some(doubled) => Err(ImportError::DuplicateColumn {
            location: Location { column: Some(doubled.into()), ..location.clone() },
        }),
    }
}

/// A note where only two of the three columns are present.
fn part_of_path(get: &dyn Fn(&str) -> Option<usize>, path: Option<[usize; 3]>) -> Option<String> {
    let missing: Vec<&str> = PATH.into_iter().filter(|name| get(name).is_none()).collect();
    let [missing] = missing[..] else { return None };
    path.is_none().then(|| {
        format!(
            "rows of a path need the columns {}; {missing} is missing, and the rows are read as poses",
            PATH.join(", ")
        )
    })
}

/// The columns by name. A used column that occurs twice, or a joint beyond the sixth, is an error.
fn by_name<'a>(
    named: &'a [(String, usize)],
    letter: char,
    location: &Location,
) -> Result<BTreeMap<&'a str, usize>, ImportError> {
    let mut by_name = BTreeMap::new();
    for (name, index) in named {
        let doubled = by_name.insert(name.as_str(), *index).is_some();
        if doubled && (is_known(name) || joint_number(name, letter).is_some()) {
            return Err(ImportError::DuplicateColumn {
                location: Location { column: Some(name.as_str().into()), ..location.clone() },
            });
        }
    }
    for name in by_name.keys() {
        if let Some(joint) = joint_number(name, letter).filter(|j| *j > 6) {
            let location = Location { column: Some((*name).into()), ..location.clone() };
            return Err(ImportError::TooManyJoints { location, joint });
        }
    }
    Ok(by_name)
}

/// Whether the header row is decided.
pub(super) fn shows_header(rows: &[Line]) -> bool {
    let used = |line: &Line| line.cells.iter().any(|cell| !cell.is_empty());
    rows.len() >= TITLES && (rows[..TITLES].iter().any(used) || rows.last().is_some_and(used))
}

/// Most title rows above the header.
const TITLES: usize = 20;

/// The first row with a joint's name, else the first nonempty row.
fn header_row(rows: &[Line]) -> Option<usize> {
    rows.iter()
        .take(TITLES)
        .position(names_a_joint)
        .or_else(|| rows.iter().position(|line| line.cells.iter().any(|c| !c.is_empty())))
}

/// Whether a sheet has a header that names a joint.
pub(super) fn has_joints(table: &Table) -> bool {
    table.rows.iter().take(TITLES).any(names_a_joint)
}

fn names_a_joint(line: &Line) -> bool {
    line.cells.iter().any(|cell| {
        let header = cell.to_string();
        let name = with_unit(&header).map_or(header.as_str(), |stated| stated.name);
        joint(name).is_some()
    })
}

fn sensor_columns(
    get: &dyn Fn(&str) -> Option<usize>,
    location: &Location,
    unused: &[&str],
    found: &[String],
) -> Result<(Sensor, Vec<usize>), ImportError> {
    let cable = get("L");
    let tracker: Vec<&str> =
        POSITION.iter().chain(&QUATERNION).copied().filter(|n| get(n).is_some()).collect();
    match (cable, tracker.is_empty()) {
        (Some(_), false) => {
            Err(ImportError::TwoSensors { location: location.clone(), tracker: tracker.join(", ") })
        }
        (Some(l), true) => Ok((Sensor::Cable, vec![l])),
        (None, true) => {
            let near = unused
                .iter()
                .filter_map(|name| {
                    let expected =
                        POSITION.iter().chain(["L", "length"].iter()).find(|e| is_near(name, e))?;
                    let expected = if *expected == "length" { "L" } else { expected };
                    Some(((*name).to_owned(), expected.to_owned()))
                })
                .collect();
            Err(ImportError::NoSensor { location: location.clone(), near, found: found.to_vec() })
        }
        (None, false) => {
            let turned = QUATERNION.iter().any(|n| get(n).is_some());
            let wanted: Vec<&str> =
                POSITION.iter().chain(QUATERNION.iter().filter(|_| turned)).copied().collect();
            let missing: Vec<&str> = wanted.iter().copied().filter(|n| get(n).is_none()).collect();
            let missing = describe_missing(&missing, unused);
            if !missing.is_empty() {
                let found = found.to_vec();
                return Err(ImportError::MissingColumns { location: location.clone(), missing, found });
            }
            let sensor = if turned { Sensor::Pose } else { Sensor::Position };
            Ok((sensor, wanted.iter().filter_map(|n| get(n)).collect()))
        }
    }
}

const OPTIONAL: [&str; 13] = [
    "t",
    "session",
    "temperature",
    "payload",
    "anchor",
    "station",
    "approach1",
    "approach2",
    "approach3",
    "approach4",
    "approach5",
    "approach6",
    "L",
];

/// The prefix that a header uses; the first by default.
fn joint_letter(found: &[String]) -> char {
    let names = |letter: char| {
        found.iter().any(|name| joint_number(name, letter).is_some_and(|joint| (1..=6).contains(&joint)))
    };
    LETTERS.into_iter().find(|letter| names(*letter)).unwrap_or(LETTERS[0])
}

/// Whether a header is one of ours, other than a joint's.
pub(super) fn is_known(name: &str) -> bool {
    OPTIONAL.contains(&name)
        || POSITION.contains(&name)
        || QUATERNION.contains(&name)
        || READOUT.contains(&name)
        || PAYLOAD_CENTRE.contains(&name)
}

/// Sentences on missing columns: each with a header that is probably meant for it, and all others in one.
fn describe_missing<S: AsRef<str>>(names: &[S], unused: &[&str]) -> Vec<String> {
    let (mut out, mut others) = (Vec::new(), Vec::new());
    for name in names.iter().map(S::as_ref) {
        match unused.iter().find(|found| is_near(found, name)) {
            Some(found) => {
                out.push(format!("column {name} is missing: found `{found}`, expected {name}; rename it"));
            }
            None => others.push(name),
        }
    }
    match others.as_slice() {
        [] => {}
        [name] => out.push(format!("column {name} is missing")),
        names => out.push(format!("columns {} are missing", listed(names))),
    }
    out
}

/// Whether a header is likely a misspelling: equal but for case and punctuation, or one letter off.
fn is_near(found: &str, expected: &str) -> bool {
    let plain = |s: &str| s.chars().filter(|c| c.is_alphanumeric()).collect::<String>().to_lowercase();
    let (f, e) = (plain(found), plain(expected));
    if f == e {
        return true;
    }
    let digits = |s: &str| s.chars().filter(char::is_ascii_digit).collect::<String>();
    // The joint number is never misspelt: q5 is not a wrong q6. Units after the name are common.
    if digits(&f) != digits(&e) {
        return false;
    }
    let with_unit =
        ["deg", "mm", "h", "c", "kg", "degree", "degrees"].iter().any(|unit| f == format!("{e}{unit}"));
    let joint_word = expected.starts_with('q')
        && ["j", "joint", "axis", "a", "theta"].iter().any(|word| f == format!("{word}{}", digits(&e)));
    with_unit || joint_word || (e.len() > 1 && strsim::levenshtein(&f, &e) == 1)
}
