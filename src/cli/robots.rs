//! `truegrind robots [NAME]`, `truegrind robots --check FILE`: catalogue and robot files.

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
    /// Robot of the catalogue, or a robot file.
    name: Option<String>,
    /// Show how a robot file is interpreted, to compare with the manual: a robot file of truegrind, a URDF, a table of DH parameters
    /// (CSV), or the calibration of a Universal Robots arm (.conf, .yaml).
    #[arg(long, value_name = "FILE", conflicts_with = "name")]
    check: Option<PathBuf>,
    /// Base link of a URDF. Default: the root of its tree.
    #[arg(long, value_name = "LINK", requires = "check")]
    base: Option<String>,
    /// Flange link of a URDF. Default: tool0 or flange.
    #[arg(long, value_name = "LINK", requires = "check")]
    tip: Option<String>,
    /// The log states joint 3 relative to the ground, independent of joint 2, as FANUC controllers do.
    #[arg(long, requires = "check")]
    ground_joint_3: bool,
    /// Write the arm as a truegrind robot file, for instance to state that it hangs (gravity under [robot.mounting]).
    #[arg(short, long, value_name = "ARM.toml")]
    output: Option<PathBuf>,
    /// Write a self-contained HTML page with a picture of the zero pose.
    #[arg(long, value_name = "FILE", num_args = 0..=1, default_missing_value = "-")]
    html: Option<PathBuf>,
}

pub(super) fn run(arguments: &Arguments) -> anyhow::Result<ExitStatus> {
    if let Some(path) = &arguments.check {
        return check(arguments, path);
    }
    // A conflict between `name` and `check` makes the parser forget what requires `check`.
    if arguments.html.is_some()
        || arguments.base.is_some()
        || arguments.tip.is_some()
        || arguments.ground_joint_3
    {
        bail!("--html, --base, --tip and --ground-joint-3 are for a robot file: give it with --check FILE");
    }
    match &arguments.name {
        Some(name) => {
            let robot = inputs::robot(name.as_str())?;
            let text = format::terminal::document(&view::document(&robot), width());
            let Some(output) = &arguments.output else {
                print_result(text)?;
                return Ok(ExitStatus::Done);
            };
            expect_robot_file(output)?;
            let inputs: &[&Path] =
                if robots::catalogue().iter().any(|known| known == name) { &[] } else { &[Path::new(name)] };
            Batch::check(inputs, &[output])?;
            let mut batch = Batch::sparing(inputs.iter().copied());
            batch.add(output, robots::to_toml(&robot).map_err(|error| anyhow!("{name}: {error}"))?);
            batch.write()?;
            if is_stdout(output) { print_message_lines(&text) } else { print_result(text)? }
        }
        None if arguments.output.is_some() => {
            bail!("which arm shall be written? Give its name, or a robot file with --check FILE")
        }
        None => {
            let all = robots::catalogue();
            let sheets = all.iter().map(|name| robots::load(name)).collect::<Result<Vec<_>, _>>()?;
            print_result(format::terminal::table(&view::catalogue_table(&sheets), width()))?;
        }
    }
    Ok(ExitStatus::Done)
}

fn expect_robot_file(output: &Path) -> anyhow::Result<()> {
    if is_stdout(output) || output.extension().is_some_and(|extension| extension.eq_ignore_ascii_case("toml"))
    {
        return Ok(());
    }
    bail!("{}: the output is a robot file; expected the extension .toml", output.display());
}

/// Shows how a robot file is interpreted.
fn check(arguments: &Arguments, path: &Path) -> anyhow::Result<ExitStatus> {
    let outputs: Vec<&Path> =
        [&arguments.output, &arguments.html].into_iter().filter_map(|p| p.as_deref()).collect();
    Batch::check(&[path], &outputs)?;
    if let Some(output) = &arguments.output {
        expect_robot_file(output)?;
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
        let toml = robots::to_toml(&found.robot).map_err(|error| anyhow!("{name}: {error}"))?;
        batch.add(output, toml);
    }
    if let Some(html) = &arguments.html {
        batch.add(html, format::html::document(&view::checked(&found)));
    }
    batch.write()?;
    let text = format::terminal::document(&view::understood(&found), width());
    if outputs.into_iter().any(is_stdout) {
        print_message_lines(&text)
    } else {
        print_result(text)?
    }
    Ok(ExitStatus::Done)
}
