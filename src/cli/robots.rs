//! `truegrind robots [NAME]`, `truegrind robots --check FILE`: catalogue and robot files.

use std::path::{Path, PathBuf};

use anyhow::{anyhow, bail};
use clap::Args;
use serde_json::Value;
use truegrind::report::format;
use truegrind::report::robots as view;
use truegrind::robots;
use truegrind::robots::foreign::{ImportOptions, import};

use super::exit_status::ExitStatus;
use super::files::{self, Batch, is_stdout};
use super::inputs;
use super::output_extension::refuse_other_kind;
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
    /// Write the catalogue, or one robot with all numbers of its data sheet, as JSON.
    #[arg(long, value_name = "FILE", num_args = 0..=1, default_missing_value = "-")]
    json: Option<PathBuf>,
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
    let Some(name) = &arguments.name else {
        if arguments.output.is_some() {
            bail!("which arm shall be written? Give its name, or a robot file with --check FILE")
        }
        let all = robots::catalogue();
        let sheets = all.iter().map(|name| robots::load(name)).collect::<Result<Vec<_>, _>>()?;
        let text = format::terminal::table(&view::catalogue_table(&sheets), width());
        return write(arguments, &[], &text, &view::catalogue_json(&sheets), Vec::new());
    };
    let robot = inputs::robot(name.as_str())?;
    let inputs: &[&Path] =
        if robots::catalogue().iter().any(|known| known == name) { &[] } else { &[Path::new(name)] };
    let mut made = Vec::new();
    if let Some(output) = &arguments.output {
        expect_robot_file(output)?;
        made.push((output.as_path(), robots::to_toml(&robot).map_err(|error| anyhow!("{name}: {error}"))?));
    }
    let text = format::terminal::document(&view::document(&robot), width());
    write(arguments, inputs, &text, &view::json(&robot), made)
}

/// Writes what was made, and the JSON if it was asked for, and prints the text: to stderr if stdout is taken.
fn write<'a>(
    arguments: &'a Arguments,
    inputs: &[&Path],
    text: &str,
    json: &Value,
    mut made: Vec<(&'a Path, String)>,
) -> anyhow::Result<ExitStatus> {
    if let Some(path) = &arguments.json {
        made.push((path, format::json::text(json)?));
    }
    let outputs: Vec<&Path> = made.iter().map(|(path, _)| *path).collect();
    Batch::check(inputs, &outputs)?;
    arguments.json.as_deref().map_or(Ok(()), |path| refuse_other_kind(path, "JSON", &["json"]))?;
    let mut batch = Batch::sparing(inputs.iter().copied());
    for (path, text) in made {
        batch.add(path, text);
    }
    batch.write()?;
    if outputs.into_iter().any(is_stdout) {
        print_message_lines(text)
    } else {
        print_result(text)?
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
    let outputs: Vec<&Path> = [&arguments.output, &arguments.html, &arguments.json]
        .into_iter()
        .filter_map(|path| path.as_deref())
        .collect();
    Batch::check(&[path], &outputs)?;
    arguments.json.as_deref().map_or(Ok(()), |path| refuse_other_kind(path, "JSON", &["json"]))?;
    arguments
        .html
        .as_deref()
        .map_or(Ok(()), |path| refuse_other_kind(path, "an HTML page", &["html", "htm"]))?;
    if let Some(output) = &arguments.output {
        expect_robot_file(output)?;
    }
    let choice = ImportOptions {
        base: arguments.base.clone(),
        tip: arguments.tip.clone(),
        ground_joint_3: arguments.ground_joint_3,
    };
    let name = path.display().to_string();
    let found =
        import(&files::read_text(path)?, &name, &choice).map_err(|e| inputs::other_than_robot_or(path, e))?;
    let mut made = Vec::new();
    if let Some(output) = &arguments.output {
        let toml = robots::to_toml(&found.robot).map_err(|error| anyhow!("{name}: {error}"))?;
        made.push((output.as_path(), toml));
    }
    if let Some(html) = &arguments.html {
        made.push((html, format::html::document(&view::checked(&found))));
    }
    let text = format::terminal::document(&view::understood(&found), width());
    write(arguments, &[path], &text, &view::checked_json(&found), made)
}
