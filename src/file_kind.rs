//! What a file is that stands where another kind is read: the parser of that kind would complain about its first line.
//!
//! A guess for messages alone, from the name and the first lines; whatever can be read as what was asked for is read.

use truegrind_programs::reading::Language;

/// A kind of file, with the option or the verb that reads it.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[non_exhaustive]
pub enum FileKind {
    /// Nothing but space.
    Empty,
    /// A RAPID program.
    Rapid,
    /// An NC program.
    Nc,
    /// A table of measurements.
    Measurements,
    /// An estimated arm.
    Model,
    /// A robot file, of any format.
    Robot,
    /// A simulated actual arm.
    Arm,
    /// A recipe of a simulation.
    Recipe,
    /// A surface file.
    Surface,
    /// A mesh.
    Mesh,
    /// A cell file.
    Cell,
    /// An experiment.
    Experiment,
    /// A diagnosis.
    Diagnosis,
    /// Another result.
    Report,
}

/// Longest part of a file that is looked at.
const LOOKED_AT: usize = 1 << 20;

impl FileKind {
    /// The kind of a file, where its name or its content shows one.
    ///
    /// ```
    /// use truegrind::file_kind::FileKind;
    ///
    /// assert_eq!(FileKind::of("poses.txt", b"q1,q2,q3,q4,q5,q6,L\n"), Some(FileKind::Measurements));
    /// assert_eq!(FileKind::of("part.mod", b""), Some(FileKind::Empty));
    /// assert_eq!(FileKind::of("arm.toml", b"[[robot]]\nname = \"mine\"\n"), Some(FileKind::Robot));
    /// assert_eq!(FileKind::of("notes.txt", b"remember the milk\n"), None);
    /// ```
    pub fn of(name: &str, bytes: &[u8]) -> Option<Self> {
        if bytes.iter().all(u8::is_ascii_whitespace) {
            return Some(Self::Empty);
        }
        match Language::by_name(name) {
            Some(Language::Rapid) => return Some(Self::Rapid),
            Some(Language::Nc) => return Some(Self::Nc),
            None => {}
        }
        let extension = name.rsplit_once('.').map(|(_, extension)| extension.to_ascii_lowercase());
        match extension.as_deref() {
            Some("stl" | "ply") => return Some(Self::Mesh),
            Some("xlsx") => return Some(Self::Measurements),
            Some("urdf") => return Some(Self::Robot),
            _ => {}
        }
        let text = String::from_utf8_lossy(&bytes[..bytes.len().min(LOOKED_AT)]);
        let start = text.trim_start();
        if start.starts_with('{') {
            return serde_json::from_slice(bytes).ok().as_ref().and_then(of_json);
        }
        if start.starts_with('<') && text.contains("<robot") {
            return Some(Self::Robot);
        }
        if is_header(start.lines().next().unwrap_or_default()) {
            return Some(Self::Measurements);
        }
        if bytes.len() > LOOKED_AT {
            return None;
        }
        toml::from_str(&text).ok().as_ref().and_then(of_toml)
    }

    /// The kind in words, with what reads it.
    pub fn text(self) -> &'static str {
        match self {
            Self::Empty => "this file is empty",
            Self::Rapid => "this is a RAPID program",
            Self::Nc => "this is an NC program",
            Self::Measurements => "these are measurements, which identify, diagnose, track and accept read",
            Self::Model => "this is a model file, which --model reads",
            Self::Robot => "this is a robot file, which --robot reads",
            Self::Arm => "this is a simulated arm, which --actual reads",
            Self::Recipe => "this is a recipe, which simulate reads",
            Self::Surface => "this is a surface file, which path and --surface read",
            Self::Mesh => "this is a mesh, which a surface file names",
            Self::Cell => "this is a cell file, which --cell reads",
            Self::Experiment => "this is an experiment, which compare --experiment reads",
            Self::Diagnosis => "this is a diagnosis, which plan --for reads",
            Self::Report => "this is the JSON of a result, which nothing here reads",
        }
    }
}

/// Whether a line names the joint angles, as the header of a table of measurements does.
fn is_header(line: &str) -> bool {
    let names: Vec<String> =
        line.split([',', ';', '\t']).map(|cell| cell.trim().trim_matches('"').to_ascii_lowercase()).collect();
    ["q", "j"].iter().any(|letter| {
        (1..=6).all(|joint| {
            let wanted = format!("{letter}{joint}");
            names.iter().any(|name| {
                name.strip_prefix(&wanted).is_some_and(|rest| !rest.starts_with(|c: char| c.is_ascii_digit()))
            })
        })
    })
}

fn of_json(value: &serde_json::Value) -> Option<FileKind> {
    let schema = value["schema"].as_str()?.strip_prefix("truegrind.")?;
    Some(if schema.starts_with("diagnosis/") { FileKind::Diagnosis } else { FileKind::Report })
}

fn of_toml(keys: &toml::Table) -> Option<FileKind> {
    let has = |key: &str| keys.contains_key(key);
    let is_list = |key: &str| keys.get(key).is_some_and(toml::Value::is_array);
    let schema = keys.get("schema").and_then(toml::Value::as_str);
    if schema.is_some_and(|schema| schema.starts_with("truegrind.model/")) {
        Some(FileKind::Model)
    } else if is_list("robot") {
        Some(FileKind::Robot)
    } else if has("joint_map") && has("link") {
        Some(FileKind::Arm)
    } else if has("surface") && has("work_object") {
        Some(FileKind::Surface)
    } else if has("poses") && has("sensor") {
        Some(FileKind::Recipe)
    } else if is_list("tool") || is_list("wobj") {
        Some(FileKind::Cell)
    } else if has("title") && has("paper") {
        Some(FileKind::Experiment)
    } else {
        None
    }
}
