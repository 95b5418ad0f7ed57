//! Inputs shared by several verbs: robots and models.

use std::path::{Path, PathBuf};

use anyhow::{Context, anyhow, bail};
use clap::Args;
use truegrind::arm::estimated::{Estimated, Judgement};
use truegrind::arm::model::Model;
use truegrind::file_kind::FileKind;
use truegrind::robots::foreign::{ImportOptions, ImportedRobot, Kind, import};
use truegrind::robots::{self, Robot};

use super::files;
use super::terminal::print_message;

/// Where the arm begins and ends in a URDF that holds more than one arm, or more than the arm.
#[derive(Debug, Clone, Default, Args)]
pub(super) struct UrdfLinks {
    /// Base link, if --robot is a URDF. Default: the root of its tree.
    #[arg(long, value_name = "LINK", requires = "robot")]
    base: Option<String>,
    /// Flange link, if --robot is a URDF. Default: tool0 or flange.
    #[arg(long, value_name = "LINK", requires = "robot")]
    tip: Option<String>,
}

impl UrdfLinks {
    /// The robot of this name, between these links.
    pub(super) fn of<'a>(&'a self, name: &'a str) -> NamedRobot<'a> {
        NamedRobot { name, links: self }
    }
}

/// The robot of a verb that may do without one.
#[derive(Debug, Clone, Default, Args)]
pub(super) struct StatedRobot {
    /// Robot. The model names it already; if given, it must match.
    #[arg(long)]
    robot: Option<String>,
    #[command(flatten)]
    links: UrdfLinks,
}

impl StatedRobot {
    pub(super) fn named(&self) -> Option<NamedRobot<'_>> {
        self.robot.as_deref().map(|name| self.links.of(name))
    }
}

/// A robot on the command line: a catalogue name or a robot file, and the links of a URDF.
#[derive(Debug, Clone, Copy)]
pub(super) struct NamedRobot<'a> {
    pub(super) name: &'a str,
    pub(super) links: &'a UrdfLinks,
}

impl<'a> From<&'a str> for NamedRobot<'a> {
    fn from(name: &'a str) -> Self {
        static WHOLE: UrdfLinks = UrdfLinks { base: None, tip: None };
        WHOLE.of(name)
    }
}

impl NamedRobot<'_> {
    /// Reads a robot file.
    pub(super) fn import(&self) -> anyhow::Result<ImportedRobot> {
        let UrdfLinks { base, tip } = self.links.clone();
        let choice = ImportOptions { base, tip, ..ImportOptions::default() };
        let path = Path::new(self.name);
        import(&files::read_text(path)?, self.name, &choice).map_err(|e| other_than_robot_or(path, e))
    }
}

/// A robot by catalogue name, or from a robot file of any supported format; of a URDF, the arm between the stated links.
pub(super) fn robot<'a>(named: impl Into<NamedRobot<'a>>) -> anyhow::Result<Robot> {
    let named = named.into();
    let NamedRobot { name, links } = named;
    if Kind::of(name).is_some() || name.contains('/') || Path::new(name).is_file() {
        return Ok(named.import()?.robot);
    }
    if links.base.is_some() || links.tip.is_some() {
        bail!("--robot {name}: a robot of the catalogue; --base and --tip name links of a URDF: omit them");
    }
    Ok(robots::load(name)?)
}

/// A model on the command line.
#[derive(Debug, Clone)]
pub(super) enum NamedModel {
    /// The word `nominal`: nothing is corrected.
    Nominal,
    /// An estimated arm from a file.
    Estimated {
        /// Name for reports.
        name: String,
        /// Short hash of the file.
        hash: String,
        /// The arm.
        arm: Box<Estimated>,
    },
}

/// What `--model` reads.
const MODEL_FILE: &str = "a model file as written by `truegrind identify -o`";

/// Reads `nominal` or a model file.
pub(super) fn model(argument: &str) -> anyhow::Result<NamedModel> {
    if argument.eq_ignore_ascii_case("nominal") {
        return Ok(NamedModel::Nominal);
    }
    let path = Path::new(argument);
    let text = files::read_text(path)?;
    let arm = Estimated::from_toml(&text).map_err(|e| {
        let told = anyhow!("{argument}: {}; expected {MODEL_FILE}", e.to_string().trim_end());
        other_kind_or(path, &[FileKind::Model], MODEL_FILE, told)
    })?;
    robots::check_catalogue_name(&arm.robot, &arm.nominal).map_err(|e| anyhow!("{argument}: {e}"))?;
    if arm.verdict.status == Judgement::Fail {
        bail!(
            "{argument}: this model cannot be used, since its fit failed: {}",
            arm.verdict.sentences().join("; ")
        );
    }
    let hash = Estimated::file_hash(&text);
    Ok(NamedModel::Estimated { name: files::name(path), hash, arm: Box::new(arm) })
}

/// What a file that cannot be read as `expected` is, where its name or its content shows another kind than `own`; otherwise `error`, with which
/// its parser complained about the first line.
pub(super) fn other_kind_or(
    path: &Path,
    own: &[FileKind],
    expected: &str,
    error: impl Into<anyhow::Error>,
) -> anyhow::Error {
    let bytes = files::read(path).unwrap_or_default();
    match FileKind::of(&files::name(path), &bytes).filter(|kind| !own.contains(kind)) {
        Some(kind) => anyhow!("{}: {}; expected {expected}", path.display(), kind.text()),
        None => error.into(),
    }
}

/// [`other_kind_or`] where a robot file is read.
pub(super) fn other_than_robot_or(path: &Path, error: impl Into<anyhow::Error>) -> anyhow::Error {
    let expected =
        "a robot file: TOML, URDF, a table of link parameters (.csv), or a UR calibration (.conf, .yaml)";
    other_kind_or(path, &[FileKind::Robot], expected, error)
}

/// Refuses a doubtful model unless allowed, in which case a note is printed.
pub(super) fn refuse_doubtful(model: &NamedModel, allowed: bool) -> anyhow::Result<()> {
    let NamedModel::Estimated { name, arm, .. } = model else { return Ok(()) };
    if arm.verdict.status == Judgement::Doubtful && !allowed {
        bail!(
            "{name}: this model is doubtful, so programs are corrected with it only with --allow-doubtful: {}",
            arm.verdict.sentences().join("; ")
        );
    }
    warn_doubtful(model);
    Ok(())
}

/// Prints a note if the model is doubtful.
pub(super) fn warn_doubtful(model: &NamedModel) {
    let NamedModel::Estimated { name, arm, .. } = model else { return };
    if arm.verdict.status == Judgement::Doubtful {
        print_message(format_args!(
            "note: {name}: this model is doubtful: {}",
            arm.verdict.sentences().join("; ")
        ));
    }
}

/// Name and nominal arm of the robot; `--robot` must match the model.
pub(super) fn nominal(model: &NamedModel, stated: Option<NamedRobot<'_>>) -> anyhow::Result<(String, Model)> {
    match (model, stated) {
        (NamedModel::Nominal, None) => bail!("--model nominal needs --robot"),
        (NamedModel::Nominal, Some(stated)) => {
            let robot = robot(stated)?;
            Ok((robot.sheet.name.clone(), robot.model))
        }
        (NamedModel::Estimated { name, arm, .. }, stated) => {
            if let Some(stated) = stated {
                let robot = robot(stated)?;
                if !robot.sheet.name.eq_ignore_ascii_case(&arm.robot) {
                    bail!(
                        "--robot is {}, but model {name} was identified for {}: give the robot of the model, or \
                         omit --robot",
                        robot.sheet.name,
                        arm.robot
                    );
                }
                robots::check_same_links(&arm.nominal, &robot.model)
                    .map_err(|e| anyhow!("--robot {}, model {name}: {e}", stated.name))?;
            }
            Ok((arm.robot.clone(), arm.nominal.clone()))
        }
    }
}

/// The robot whose measurements are read for a model: the stated one, or that of the catalogue which the model names.
///
/// # Errors
/// An arm that is not in the catalogue: only its robot file says how its logged angles count.
pub(super) fn measured_robot<'a>(
    arm: &'a Estimated,
    stated: Option<NamedRobot<'a>>,
) -> anyhow::Result<NamedRobot<'a>> {
    match stated {
        Some(stated) => Ok(stated),
        None if robots::load(&arm.robot).is_ok() => Ok(arm.robot.as_str().into()),
        None => bail!(
            "the robot of the model, {}, is not in the catalogue: add its robot file, --robot FILE, which says how the logged angles count",
            arm.robot
        ),
    }
}

/// A path relative to the folder of another file.
pub(super) fn beside(path: &Path, name: &str) -> PathBuf {
    path.parent().unwrap_or(Path::new("")).join(name)
}

/// Reads a file named in another file.
pub(super) fn read_beside(path: &Path, name: &str) -> anyhow::Result<Vec<u8>> {
    let full_path = beside(path, name);
    files::read(&full_path).with_context(|| format!("named in {}", path.display()))
}
