//! Data sheets of robot arms: the catalogue that ships, and any other arm from a TOML file.
//!
//! One file per maker in the folder beside this one, each number with its source. The nominal model is the one
//! with which the controller computes; nothing here is measured. Schema of a file: [`sheet`]; its checks: [`validation`].
//!
//! ```
//! let robot = truegrind_arm::robots::load("abb-irb-120")?;
//! let flange = robot.model.forward(&nalgebra::Vector6::zeros(), &Default::default());
//! assert!((flange.translation.vector - nalgebra::Vector3::new(374.0, 0.0, 630.0)).norm() < 1e-9);
//! # Ok::<(), truegrind_arm::robots::RobotError>(())
//! ```

mod error;
pub mod export;
pub mod foreign;
pub mod sheet;
pub mod validation;

use std::sync::OnceLock;

use crate::model::Model;
use sheet::{DataSheet, RobotFile};
use truegrind_math::toml_text::{self, TomlError};

pub use error::{NominalMismatch, RobotError};

/// The files of the catalogue: name for messages, text.
const FILES: [(&str, &str); 7] = [
    ("abb.toml", include_str!("robots/abb.toml")),
    ("fanuc.toml", include_str!("robots/fanuc.toml")),
    ("hsr.toml", include_str!("robots/hsr.toml")),
    ("kuka.toml", include_str!("robots/kuka.toml")),
    ("staubli.toml", include_str!("robots/staubli.toml")),
    ("universal-robots.toml", include_str!("robots/universal-robots.toml")),
    ("yaskawa.toml", include_str!("robots/yaskawa.toml")),
];

/// An arm according to its data sheet.
#[derive(Debug, Clone, PartialEq)]
pub struct Robot {
    /// The data sheet, sources included.
    pub sheet: DataSheet,
    /// The nominal model.
    pub model: Model,
    /// Warnings, one sentence each. In the catalogue only `hsr-jr680` has one: the ranges of its joints are not published.
    pub warnings: Vec<String>,
    /// Where the base of the model is in that of the robot file, if it is another: the model's is on axis 1.
    pub base_note: Option<String>,
}

impl Robot {
    /// Checks a data sheet and builds the model. `file` is named in errors.
    pub fn new(sheet: DataSheet, file: &str) -> Result<Self, RobotError> {
        let warnings = validation::check(&sheet).map_err(|fault| fault.of(file, &sheet.name))?;
        let links = <&[_; 6]>::try_from(sheet.link.as_slice())
            .map_err(|_| validation::link_count(sheet.link.len()).of(file, &sheet.name))?;
        let model = sheet.model(links);
        validation::check_published(&sheet, &model).map_err(|fault| fault.of(file, &sheet.name))?;
        Ok(Self { sheet, model, warnings, base_note: None })
    }
}

/// Names of the arms that ship, in alphabetical order.
pub fn catalogue() -> Vec<String> {
    let mut names: Vec<String> = (0..FILES.len())
        .filter_map(|file| shipped(file).ok())
        .flat_map(|content| content.robot.iter().map(|sheet| sheet.name.clone()))
        .collect();
    names.sort();
    names
}

/// File `index` of the catalogue, parsed once.
fn shipped(index: usize) -> Result<&'static RobotFile, RobotError> {
    static READ: [OnceLock<RobotFile>; FILES.len()] = [const { OnceLock::new() }; FILES.len()];
    if let Some(content) = READ[index].get() {
        return Ok(content);
    }
    let (file, text) = FILES[index];
    // That no array of it is too long is for a test to say, not for every start.
    let content = toml::from_str(text).map_err(|error| syntax(&error.into(), text, file))?;
    Ok(READ[index].get_or_init(|| content))
}

/// An arm of the catalogue; the name is case-insensitive.
///
/// ```
/// use truegrind_arm::robots;
///
/// assert_eq!(robots::load("ABB-IRB-120")?.sheet.maker, "ABB");
/// let unknown = robots::load("abb-irb-121").map(|robot| robot.sheet.name).map_err(|error| error.to_string());
/// assert!(unknown.is_err_and(|said| said.contains("unknown robot \"abb-irb-121\"") && said.contains("abb-irb-120")));
/// # Ok::<(), robots::RobotError>(())
/// ```
pub fn load(name: &str) -> Result<Robot, RobotError> {
    for (index, (file, _)) in FILES.iter().enumerate() {
        let mut sheets = shipped(index)?.robot.iter();
        if let Some(sheet) = sheets.find(|sheet| sheet.name.eq_ignore_ascii_case(name.trim())) {
            return Robot::new(sheet.clone(), file);
        }
    }
    let similar = similar(name);
    let near = if similar.is_empty() { String::new() } else { format!(" (similar: {})", similar.join(", ")) };
    Err(RobotError::Unknown { name: name.to_owned(), near, known: catalogue().join(", ") })
}

/// The names of the catalogue that contain a name, whatever stands between letters and digits: `irb120`, `UR 10`.
fn similar(name: &str) -> Vec<String> {
    let plain = |name: &str| -> String {
        name.chars().filter(char::is_ascii_alphanumeric).map(|c| c.to_ascii_lowercase()).collect()
    };
    let name = plain(name);
    let is_similar = |known: &String| {
        let known_name = plain(known);
        let without_maker = plain(known.split_once('-').map_or("", |(_, model)| model));
        known_name.contains(&name) || !without_maker.is_empty() && name.contains(&without_maker)
    };
    if name.len() < 2 { Vec::new() } else { catalogue().into_iter().filter(is_similar).collect() }
}

/// Refuses a nominal arm with a name of the catalogue that is not that arm. Other names are accepted.
///
/// ```
/// use truegrind_arm::robots::{self, NominalMismatch};
///
/// let mut arm = robots::load("abb-irb-120")?.model;
/// assert_eq!(robots::check_catalogue_name("abb-irb-120", &arm), Ok(()));
/// arm.links[3].d_mm += 1.0;
/// let Err(NominalMismatch::Name { place, .. }) = robots::check_catalogue_name("abb-irb-120", &arm) else { panic!("another arm") };
/// assert!(place.contains("link 4 d_mm"));
/// // A user's own arm has another name.
/// assert_eq!(robots::check_catalogue_name("workshop-6", &arm), Ok(()));
/// # Ok::<(), robots::RobotError>(())
/// ```
///
/// # Errors
/// [`NominalMismatch::Name`], which says where the two differ first.
pub fn check_catalogue_name(name: &str, nominal: &Model) -> Result<(), NominalMismatch> {
    let plain =
        |text: &str| text.chars().filter(char::is_ascii_alphanumeric).collect::<String>().to_lowercase();
    let wanted = plain(name);
    let mut different = None;
    for (index, (file, _)) in FILES.iter().enumerate() {
        let Ok(content) = shipped(index) else { continue };
        for sheet in &content.robot {
            // The maker's designation counts as the catalogue's name.
            if wanted.is_empty() || (plain(&sheet.name) != wanted && plain(&sheet.model) != wanted) {
                continue;
            }
            let Ok(known) = Robot::new(sheet.clone(), file) else { continue };
            match validation::difference(nominal, &known.model) {
                None => return Ok(()),
                Some(place) => different = Some(place),
            }
        }
    }
    different.map_or(Ok(()), |place| Err(NominalMismatch::Name { name: name.to_owned(), place }))
}

/// Refuses a nominal arm whose links differ from those of another arm with the same name.
///
/// # Errors
/// [`NominalMismatch::Arms`], which says where the two differ first.
pub fn check_same_links(nominal: &Model, stated: &Model) -> Result<(), NominalMismatch> {
    validation::difference(nominal, stated).map_or(Ok(()), |place| Err(NominalMismatch::Arms { place }))
}

/// An arm from a user's own file, which holds exactly one `[[robot]]`. `file` is named in errors.
///
/// ```
/// use truegrind_arm::robots::{self, RobotError};
///
/// let misspelt = "[[robot]]\nname = \"mine\"\nmakr = \"ours\"\n";
/// let Err(RobotError::Syntax { line, found, .. }) = robots::parse(misspelt, "mine.toml") else { panic!("no such key") };
/// assert_eq!((line, found.as_str()), (3, "makr = \"ours\""));
/// assert_eq!(
///     robots::parse("robot = []", "mine.toml").map_err(|error| error.to_string()).err().as_deref(),
///     Some("mine.toml: found 0 robots, expected one [[robot]]; put each arm into a file of its own")
/// );
/// ```
pub fn parse(text: &str, file: &str) -> Result<Robot, RobotError> {
    let mut sheets = read(text, file)?.robot;
    match (sheets.pop(), sheets.len()) {
        (Some(sheet), 0) => Robot::new(sheet, file),
        (_, rest) => Err(RobotError::Several { file: file.to_owned(), found: rest + usize::from(rest > 0) }),
    }
}

/// The text of a file that [`parse`] reads.
///
/// # Errors
/// The TOML writer's message for a number that cannot be written.
pub fn to_toml(robot: &Robot) -> Result<String, String> {
    toml::to_string(&RobotFile { robot: vec![robot.sheet.clone()] }).map_err(|error| error.to_string())
}

/// The sheets of a file, as written: keys and types are right, values are not yet checked.
fn read(text: &str, file: &str) -> Result<RobotFile, RobotError> {
    toml_text::read(text).map_err(|error| syntax(&error, text, file))
}

fn syntax(error: &TomlError, text: &str, file: &str) -> RobotError {
    let start = error.span().map_or(0, |span| span.start).min(text.len());
    let before = text.get(..start).unwrap_or_default();
    let line_start = before.rfind('\n').map_or(0, |i| i + 1);
    let found = text.get(line_start..).and_then(|rest| rest.lines().next()).unwrap_or_default();
    RobotError::Syntax {
        file: file.to_owned(),
        line: before.matches('\n').count() + 1,
        column: before.get(line_start..).unwrap_or_default().chars().count() + 1,
        found: found.trim().to_owned(),
        message: error.message().replace('\n', " "),
    }
}
