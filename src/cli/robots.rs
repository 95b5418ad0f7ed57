//! `truegrind robots [NAME]`, `truegrind robots --check FILE`.

use std::path::{Path, PathBuf};

use anyhow::{anyhow, bail};
use clap::Args;
use truegrind::report::format;
use truegrind::report::robots as view;
use truegrind::robots;
use truegrind::robots::foreign::{ImportOptions, import};

use super::exit_status::ExitStatus;
use super::files::{self, Batch, is_stdout};
use super::inputs;
use super::terminal::{print_message_lines, print_result, width};

/// Arguments of `robots`.
#[derive(Debug, Args)]
pub(super) struct Arguments {
    /// A robot of the catalogue, or a robot file.
    name: Option<String>,
    /// Say what is understood of a robot file, to be compared with the manual: a robot file of truegrind, a URDF, a table of link
    /// parameters (CSV), the calibration of a Universal Robots arm (.conf, .yaml).
    #[arg(long, value_name = "FILE", conflicts_with = "name")]
    check: Option<PathBuf>,
    /// The link of a URDF that stands; the root of its tree otherwise.
    #[arg(long, value_name = "LINK", requires = "check")]
    base: Option<String>,
    /// The link of a URDF that is the flange; tool0 or flange otherwise.
    #[arg(long, value_name = "LINK", requires = "check")]
    tip: Option<String>,
    /// The log counts joint 3 against the ground, whatever joint 2 does, as FANUC controllers do.
    #[arg(long, requires = "check")]
    ground_joint_3: bool,
    /// Write the arm as a robot file of truegrind.
    #[arg(short, long, value_name = "ARM.toml", requires = "check")]
    output: Option<PathBuf>,
    /// Self-contained HTML page with a picture of the zero pose.
    #[arg(long, value_name = "FILE", requires = "check", num_args = 0..=1, default_missing_value = "-")]
    html: Option<PathBuf>,
}

pub(super) fn run(arguments: &Arguments) -> anyhow::Result<ExitStatus> {
    if let Some(path) = &arguments.check {
        return check(arguments, path);
    }
    match &arguments.name {
        Some(name) => {
            let robot = inputs::robot(name)?;
            print_result(format::terminal::document(&view::document(&robot), width()))?;
        }
        None => {
            let all = robots::catalogue();
            let sheets = all.iter().map(|name| robots::load(name)).collect::<Result<Vec<_>, _>>()?;
            print_result(format::terminal::table(&view::catalogue_table(&sheets), width()))?;
        }
    }
    Ok(ExitStatus::Done)
}

/// What is understood of a file.
fn check(arguments: &Arguments, path: &Path) -> anyhow::Result<ExitStatus> {
    let outputs: Vec<&Path> =
        [&arguments.output, &arguments.html].into_iter().filter_map(|p| p.as_deref()).collect();
    Batch::check(&[path], &outputs)?;
    if let Some(output) = &arguments.output
        && !is_stdout(output)
        && !output.extension().is_some_and(|ending| ending.eq_ignore_ascii_case("toml"))
    {
        bail!("{}: a robot file is written; expected a name that ends in .toml", output.display());
    }
    let choice = ImportOptions {
        base: arguments.base.clone(),
        tip: arguments.tip.clone(),
        ground_joint_3: arguments.ground_joint_3,
    };
    let name = path.display().to_string();
    let found = import(&files::read_text(path)?, &name, &choice)?;
    let mut batch = Batch::sparing([path]);
    if let Some(output) = &arguments.output {
        let text = robots::to_toml(&found.robot).map_err(|error| anyhow!("{name}: {error}"))?;
        batch.add(output, text);
    }
    if let Some(html) = &arguments.html {
        batch.add(html, format::html::document(&view::checked(&found)));
    }
    batch.write()?;
    let said = format::terminal::document(&view::understood(&found), width());
    if outputs.into_iter().any(is_stdout) {
        print_message_lines(&said)
    } else {
        print_result(said)?
    }
    Ok(ExitStatus::Done)
}
